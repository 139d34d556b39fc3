"""The Esso 190 000 dwt tanker of Fossen's vehicle simulator: the same equations, a step of Euler's rule each."""

from __future__ import annotations

from importlib import import_module

import numpy as np

from ..environment import CHANNELS
from ..ships.files import load
from ..simulate.lanes import Steps, given, run
from .timing import best

MODULE = "python_vehicle_simulator.vehicles.tanker"
"""Where the Python Vehicle Simulator keeps its tanker."""
LANES, STEPS, DT, DELTA = 128, 2000, 0.1, 0.1
RPM, DEEP = 80.0, 1e9


def ours() -> float:
    """Time of a step of one ship [s]; a ship a lane, one thread."""
    ship = load("esso_190k_tanker")
    held = np.tile([RPM / 60.0, DELTA, *([0.0] * len(CHANNELS))], (LANES, 1, 1))
    lanes = given(ship, np.tile([0.0, 0.0, 0.0, 4.8, 0.0, 0.0], (LANES, 1)), held)
    return best(lambda: run(lanes, Steps(DT, STEPS + 1, STEPS, "euler"), threads=1), 1.0) / (STEPS * LANES)


def theirs() -> float:
    """Time of a step of theirs, without its kinematics [s]."""
    vessel = import_module(MODULE).tanker(depth=DEEP, rpm=RPM)
    eta, order = np.zeros(6), np.array([-DELTA])

    def sail() -> None:
        nu, actual = vessel.nu, np.array([-DELTA])
        for _ in range(STEPS):
            nu, actual = vessel.dynamics(eta, nu, actual, order, DT)

    return best(sail, 1.0) / STEPS
