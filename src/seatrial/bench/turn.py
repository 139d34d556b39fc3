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
from ..engine.rollout import simulator
from ..environment import CALM, CHANNELS
from ..ships import Ship
from ..ships.files import load
from ..simulate.loop import open_loop, open_loop_parameters
from .timing import best

LANES, DURATION, N_P, DELTA = 128, 200.0, 11.85, math.radians(35.0)
STEPS = (5.0, 4.0, 2.5, 2.0, 1.0, 0.5, 0.2, 0.1)
"""Steps tried for the widest that is good enough [s]."""


@cache
def ship() -> Ship:
    """The 7 m model of KVLCC2."""
    return load("kvlcc2_l7")


@cache
def engine() -> tuple[Any, Array, Array]:
    """The engine of the ship, its parameters, and what acts on each lane."""
    system, held = open_loop(ship()), np.array([N_P, DELTA, *([0.0] * len(CHANNELS))])
    return simulator(system), open_loop_parameters(ship()), np.tile(held, (LANES, 1, 1))


def start() -> Array:
    """State of one ship at the start."""
    return np.array([0.0, 0.0, 0.0, ship().speed, 0.0, 0.0])


def sailed(dt: float) -> Any:
    """The turn of all lanes on one thread; its rows are the start and the end."""
    run, p, held = engine()
    steps = round(DURATION / dt) + 1
    return run.run(np.tile(start(), (LANES, 1)), held, p, dt=dt, steps=steps, every=steps - 1, threads=1)


def per_call() -> float:
    """The engine's time of one right-hand side and ship [s]."""
    return best(lambda: sailed(0.1), 2.0) / (4 * round(DURATION / 0.1) * LANES)


def bare() -> float:
    """Time of the model's derivative on Python floats [s]."""
    model, x, u = ship().model, tuple(start().tolist()), (N_P, DELTA)
    return best(lambda: [model.derivative(x, u, CALM) for _ in range(1000)], 1.0) / 1000


def by_scipy() -> float:
    """Time of one right-hand side in scipy's solve_ivp on our equations on Python floats [s]."""
    system, (_, p, held) = open_loop(ship()), engine()
    numbers, acting = tuple(p.tolist()), tuple(held[0, 0].tolist())

    def rates(_: float, z: Array) -> Any:
        return system.derivative(tuple(z.tolist()), acting, numbers)

    def solved() -> Any:
        return solve_ivp(rates, (0.0, DURATION), start(), max_step=0.1)

    return best(solved, 2.0, 2) / solved().nfev


def track(dt: float) -> Array:
    """States of one ship at every step, shape (steps, 6)."""
    run, p, held = engine()
    steps = round(DURATION / dt) + 1
    return np.asarray(run.run(start()[None], held[:1], p, dt=dt, steps=steps).values[0])


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
