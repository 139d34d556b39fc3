"""Simulation-based calibration of the sampler (Talts et al. 2018): ranks of the truth among draws of its posterior.

Two hundred ships from the prior of each of five, each a zigzag of its own with the noise of instruments, each posterior
sampled; the ranks of the truths are uniform if density, sampler and prior agree.

    python benchmarks/ranks.py [--repeats N] [--draws N]
"""

from __future__ import annotations

import argparse
import json
import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import kstest
from timing import machine

from seatrial.belief.ranks import calibrate
from seatrial.core.parameters import near
from seatrial.data import Array
from seatrial.identify import Loss, Problem
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

RESULTS = Path(__file__).parent / "results" / "ranks.json"
SHIPS = {
    "suzaku": ("hull.R_0", "rudder.kappa"),
    "kvlcc2_l7": ("hull.Y_v", "hull.N_r", "rudder.t_R"),
    "esso_osaka_3m": ("hull.Y_v", "hull.N_v", "hull.N_r"),
    "kcs": ("hull.N_r", "rudder.a_H"),
    "mariner": ("derivatives.Y_v", "derivatives.N_v"),
}
REPEATS, DRAWS, BINS = 200, 160, 10


def ranks(name: str, repeats: int = REPEATS, draws: int = DRAWS) -> Array:
    """Ranks in (0, 1) of the truths of one ship, shape (repeats, parameters): a 10/10 zigzag over twelve lengths."""
    ship = load(name)
    speed, n_P = approach(ship)
    ten = math.radians(10.0)
    dt = round(12.0 * ship.L_pp / speed / 240.0, 2)
    trial = simulate(ship, Zigzag(n_P=n_P, delta=ten, psi=ten), speed=speed, duration=240 * dt, dt=dt, name="zigzag")
    free = tuple(replace(f, prior=f.start, sigma=0.15 * abs(f.start))
                 for f in near(ship.model, *SHIPS[name], ratio=0.6))  # fmt: skip
    loss = Loss({"x": 0.02 * ship.L_pp, "y": 0.02 * ship.L_pp, "psi": 0.02}, 0.0)
    estimator = Trajectory(window=240 * dt, every=4, initial="measured", threads=2)
    return calibrate(Problem(ship, (trial,), free, loss), estimator, repeats=repeats, draws=draws, seed=1)


def row(name: str, repeats: int, draws: int) -> dict[str, Any]:
    """What the ranks of one ship say."""
    began = time.process_time()
    found = ranks(name, repeats, draws)
    return {"cpu_s": time.process_time() - began, "parameters": {path: {
        "p": float(kstest(one, "uniform").pvalue), "mean": float(one.mean()),
        "histogram": np.histogram(one, BINS, (0.0, 1.0))[0].tolist(),
    } for path, one in zip(SHIPS[name], found.T, strict=True)}}  # fmt: skip


def main() -> None:
    """All ships, kept one by one."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=REPEATS)
    parser.add_argument("--draws", type=int, default=DRAWS)
    asked = parser.parse_args()
    rows: dict[str, Any] = {}
    for name in SHIPS:
        rows[name] = row(name, asked.repeats, asked.draws)
        RESULTS.write_text(json.dumps({
            "what": "ranks of true parameters among draws of their posterior: p of Kolmogorov and Smirnov's test",
            "machine": machine(), "command": "python benchmarks/ranks.py", "repeats": asked.repeats,
            "draws": asked.draws, "ships": rows,
        }, indent=1) + "\n")  # fmt: skip


if __name__ == "__main__":
    main()
