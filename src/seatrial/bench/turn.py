"""A turn of the 7 m KVLCC2: the engine, the same equations on Python floats, and scipy on those."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from ..data import Array
from ..engine import SimulationError
from ..environment import CALM, CHANNELS
from ..ships import Ship
from ..ships.files import load
from ..simulate.lanes import Lanes, Steps, given, run
from .timing import best

LANES, DURATION, N_P, DELTA = 128, 200.0, 11.85, math.radians(35.0)
STEPS = (5.0, 4.0, 2.5, 2.0, 1.0, 0.5, 0.2, 0.1)
"""Steps tried for the widest that is good enough [s]."""


@cache
def ship() -> Ship:
    """The 7 m model of KVLCC2."""
    return load("kvlcc2_l7")


@cache
def turns() -> Lanes:
    """The turn of all lanes."""
    held = np.array([N_P, DELTA, *([0.0] * len(CHANNELS))])
    return given(ship(), np.tile(start(), (LANES, 1)), np.tile(held, (LANES, 1, 1)))


def start() -> Array:
    """State of one ship at the start."""
    return np.array([0.0, 0.0, 0.0, ship().speed, 0.0, 0.0])


def sailed(dt: float) -> Any:
    """The turn of all lanes on one thread; its rows are the start and the end."""
    steps = round(DURATION / dt) + 1
    return run(turns(), Steps(dt, steps, steps - 1), threads=1)


def per_call() -> float:
    """The engine's time of one right-hand side and ship [s]."""
    return best(lambda: sailed(0.1), 2.0) / (4 * round(DURATION / 0.1) * LANES)


def bare() -> float:
    """Time of the model's derivative on Python floats [s]."""
    model, x, u = ship().model, tuple(start().tolist()), (N_P, DELTA)
    return best(lambda: [model.derivative(x, u, CALM) for _ in range(1000)], 1.0) / 1000


def by_scipy() -> float:
    """Time of one right-hand side in scipy's solve_ivp on our equations on Python floats [s]."""
    system = turns().kernel.system
    numbers, acting = tuple(turns().shared.tolist()), tuple(turns().series[0, 0].tolist())

    def rates(_: float, z: Array) -> Any:
        return system.derivative(tuple(z.tolist()), acting, numbers)

    def solved() -> Any:
        return solve_ivp(rates, (0.0, DURATION), start(), max_step=0.1)

    return best(solved, 2.0, 2) / solved().nfev


def track(dt: float) -> Array:
    """States of one ship at every step, shape (steps, 6)."""
    return run(turns().part(slice(1)), Steps(dt, round(DURATION / dt) + 1)).values[0]


def dense(dt: float, t: Array) -> Array:
    """Track at the times `t`, between steps by the cubic that has the steps' own velocities."""
    z = track(dt)
    c, s = np.cos(z[:, 2]), np.sin(z[:, 2])
    rates = np.column_stack([z[:, 3] * c - z[:, 4] * s, z[:, 3] * s + z[:, 4] * c])
    return np.asarray(CubicHermiteSpline(dt * np.arange(len(z)), z[:, :2], rates)(t))


def widest_step(error: float) -> float:
    """The widest step whose track, at every 0.1 s, is no further than `error` [m] from a fine step of ours."""
    fine = track(0.005)[:: round(0.1 / 0.005), :2]
    t = np.linspace(0.0, DURATION, len(fine))
    for dt in STEPS:
        if np.hypot(*(dense(dt, t) - fine).T).max() <= error:
            return dt
    raise SimulationError(f"no step down to {STEPS[-1]:g} s keeps the track within {error:g} m")
