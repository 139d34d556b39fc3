"""Time of a right-hand side with banks, squat, a grid of depths and contact: off a quay, and lying on its fenders.

    python benchmarks/contact.py

256 lanes on one thread, each with a hull of its own, off the quay of twenty fenders of `harbour_range` and
pressed on it by wind: sixteen fenders are under load.  Four right-hand sides a step of the motion, as RK4 takes; what
comes between steps (looks into the chart, impulses, substeps) counts in them.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from harbour_range import OFF, chart
from timing import best, publish

from seatrial.core.parameters import read
from seatrial.environment import Uniform
from seatrial.manoeuvres import Given
from seatrial.ships.files import load
from seatrial.simulate.loop import closed_loop
from seatrial.simulate.place import place_of
from seatrial.simulate.run import campaign

LANES, SECONDS, DT = 256, 100.0, 0.05


def measured(start: tuple[float, ...], wind: float, touching: bool = True, placed: bool = True) -> tuple[float, int]:
    """Nanoseconds per right-hand side and lane, and steps of the motion in a time step."""
    ship = load("kvlcc2_harbour")
    place: Any = place_of(ship, chart(), touching=touching) if placed else None
    weather = Uniform(U_T=wind, gamma_T=math.radians(270.0))
    policy = Given()
    name = "ship.hull.R_0"
    vary = {name: np.linspace(0.9, 1.1, LANES) * read(ship.model, "hull.R_0")}
    system: Any = closed_loop(ship, policy, DT, place)
    substeps = system.kicks.substeps if system.kicks else 1

    def run(seconds: float) -> None:
        done = campaign(replace(ship, validity={}), policy, vary, speed=0.0, duration=seconds, start=start, dt=DT,
                        environment=weather, threads=1, place=place, every=2000)  # fmt: skip
        if done.failures:
            raise SystemExit(f"a lane failed: {done.failures[0]}")

    run(1.0)
    long, short = best(lambda: run(SECONDS)), best(lambda: run(1.0))
    return (long - short) / (4.0 * substeps * LANES * (SECONDS - 1.0) / DT) * 1e9, substeps


def main() -> None:
    rows = []
    for what, bar, given in (
        ("open water, no chart", "", ((0.0,) * 6, 0.0, True, False)),
        ("chart without contact", "", ((250.0, OFF - 200.0, 0.0, 0.0, 0.0, 0.0), 0.0, False)),
        ("contact, 200 m off the quay", "60", ((250.0, OFF - 200.0, 0.0, 0.0, 0.0, 0.0), 0.0)),
        ("contact, lying on fenders", "60", ((250.0, OFF, 0.0, 0.0, 0.0, 0.0), 15.0)),
    ):
        ns, substeps = measured(*given)
        rows.append({"what": f"{what} ({substeps} steps of the motion a time step)", "value": ns,
                     "unit": "ns a right-hand side and lane", "bar": bar})  # fmt: skip
    publish("contact", rows)


if __name__ == "__main__":
    main()
