"""Logs for the tutorial on networks: a day with the 3 m Esso Osaka on a pond, as trial files.

Nine random manoeuvres of somebody at the sticks, two turns, two zigzags and two short berthings, each in a wind of
its own; velocities have the noise of a good receiver.  The ship is that of the library, so nothing is measured here.

Run from the root of the repository: python examples/network_logs.py networks/trials
"""

import math
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import seatrial as st

Berthing = st.manoeuvres.berthing.Berthing

NOISE = {"u": 0.003, "v_m": 0.003, "r": 0.0005}
DEGREES = math.pi / 180.0


def plans() -> Iterator[tuple[str, st.Policy, float]]:
    """Name, who steers and for how long [s]."""
    for k in range(1, 10):
        yield f"random_{k}", st.manoeuvres.human_random.HumanRandom(n_P=10.0, delta=35.0 * DEGREES, seed=k), 300.0
    for k, side in enumerate((1.0, -1.0), start=1):
        yield f"turning_{k}", st.manoeuvres.turning.Turning(10.0, side * 35.0 * DEGREES), 200.0
        yield f"zigzag_{k}", st.manoeuvres.zigzag.Zigzag(10.0, 20.0 * DEGREES, 20.0 * DEGREES, side), 140.0
        yield f"berthing_{k}", _berthing(side), 240.0


def _berthing(side: float) -> Berthing:
    """Some forty metres to a berth that lies three metres aside."""
    usual = Berthing.ordered(st.manoeuvres.Settings(10.0, 0.3, 3.0, 35.0 * DEGREES, side=side))
    return replace(usual, along=42.0, across=3.0 * side)


def _noisy(trial: st.Trial, rng: np.random.Generator) -> st.Trial:
    return trial.having(**{name: trial[name] + size * rng.standard_normal(len(trial)) for name, size in NOISE.items()})


def main(folder: Path) -> None:
    """Write one trial file for each."""
    ship, rng = st.load("esso_osaka_3m"), np.random.default_rng(6)
    folder.mkdir(parents=True, exist_ok=True)
    for number, (name, policy, duration) in enumerate(plans()):
        wind = st.Uniform(U_T=rng.uniform(0.5, 1.5), gamma_T=rng.uniform(0.0, 2.0 * math.pi))
        speed = 0.0 if name.startswith("random") else 0.3
        run = st.run_policy(ship, policy, speed=speed, duration=duration, dt=0.1, environment=wind, name=name)
        st.write_trial(_noisy(run, np.random.default_rng(number)), folder / f"{name}.csv")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
