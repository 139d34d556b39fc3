"""Which reading of SUZAKU's flap and slipstream agrees with what Suyama 2023 prints: Figs. 3 and 8 to 11, and Table 7.

Circles of the published sets under each reading; and whether Table 7 is consistent in itself: if the trials were those
of the set of the widest range, the fits in the narrower ranges should be the published ones.

    python benchmarks/flap.py
"""

from __future__ import annotations

import json
import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from seatrial.core.parameters import read
from seatrial.data import Trial
from seatrial.identify.tuning.ranges import Scorer, within
from seatrial.identify.vector import Vector
from seatrial.manoeuvres.turning import Turning
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.run import simulate
from seatrial.study.study import read_study

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results" / "suyama2023_flap.json"
STUDY = read_study(ROOT / "studies" / "suyama2023.toml")
PATHS = tuple(f.path for f in STUDY.problem.free)
SETS = {f"0.{k}": {path: float(read(load(f"suzaku_tuned_0{k}").model, path)) for path in PATHS} for k in "23456"}
TESTS, STARTS = (-10.0, 20.0, -35.0, 40.0), 12
READINGS = [(s, f) for s in ("literal", "consistent") for f in ("none", "equal", "double", "hensen")]


def turn(ship: Ship, degrees: float, duration: float) -> Trial:
    """A turn as the paper simulates it: Euler's rule, 1 s."""
    return simulate(ship, Turning(106 / 60, math.radians(degrees)), speed=3.086, duration=duration, dt=1.0,
                    method="euler", name=f"D{degrees:+g}")  # fmt: skip


def diameter(ship: Ship, degrees: float) -> float:
    """Steady diameter in lengths."""
    run = turn(ship, degrees, 900.0)
    u, v_m, r = (float(run[name][-1]) for name in ("u", "v_m", "r"))
    return 2.0 * math.hypot(u, v_m) / abs(r) / ship.L_pp


def consistent(ship: Ship, a: str) -> dict[str, float]:
    """Fits to the trials of set `a` in the narrower ranges against the published sets of these ranges."""
    trials = tuple(turn(ship.having(SETS[a]), float(t.name[1:]), 600.0) for t in STUDY.problem.trials)
    posed = replace(STUDY.problem, ship=ship, trials=trials, validation=())
    scorer, off, same, count = Scorer.of(posed, 1.0, "euler"), list[float](), 0, 0
    for narrower in (n for n in SETS if n < a):
        free = within(posed, float(narrower))
        low, high = Vector.of(free).low, Vector.of(free).high
        found = scorer.best(trials, free, starts=STARTS, seed=1)
        ours, printed = (2 * (v - low) / (high - low) - 1 for v in (found, np.array(list(SETS[narrower].values()))))
        off += list((ours - printed) ** 2)
        bound = np.abs(printed) > 0.99
        same += int((np.abs(ours[bound] - printed[bound]) < 0.01).sum())
        count += int(bound.sum())
    return {"off": math.sqrt(float(np.mean(off))), "same_bound": same, "bounds": count}


def main() -> None:
    """Go through the readings and write what they give."""
    began, rows, base = time.perf_counter(), list[dict[str, Any]](), load("suzaku")
    for slipstream, flap in READINGS:
        model: Any = base.model
        ship = replace(base, model=replace(model, rudder=replace(model.rudder, slipstream=slipstream, flap=flap)))
        before = {d: diameter(ship, d) for d in (35.0, *TESTS)}
        after = {a: {d: diameter(ship.having(values), d) for d in TESTS} for a, values in SETS.items()}
        rows.append({
            "slipstream": slipstream, "flap": flap, "right": before[35.0], "left": before[-35.0],
            "larger": sum(bool(one[d] > before[d]) for one in after.values() for d in TESTS),
            "apart": {f"{d:+g}": after["0.6"][d] - after["0.5"][d] for d in TESTS},
            "table7": {a: consistent(ship, a) for a in ("0.5", "0.6")},
        })  # fmt: skip
        print(f"{time.perf_counter() - began:.0f} s", rows[-1], flush=True)
    RESULTS.write_text(json.dumps({
        "command": "python benchmarks/flap.py", "starts": STARTS, "seconds": time.perf_counter() - began, "rows": rows,
    }, indent=1) + "\n")  # fmt: skip


if __name__ == "__main__":
    main()
