"""Steady straight run before a manoeuvre, and the time step of a ship."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from ..environment import CALM
from ..models import Sampled, Stepped
from ..models.settled import settled
from ..ships import Ship, ShipError

# A step this fraction of L/U keeps RK4 errors of a turn far below its indices' last digit.
_STEP = 1.0 / 250.0
# RK4 is stable up to 2.8; a fifth of that keeps the fastest motion accurate as well.
_STIFF = 0.5
# Above 25 such fractions, or above `_STIFF`, the indices of a turn are off by more than some 0.05 %.
_ROUGH = 1.0 / 10.0
# RK4 is stable on the negative axis to 2.785 and on the imaginary one to 2.83.
_UNSTABLE = 2.8
# Between two rows of a log the inputs are known and constant, so that only the error of RK4 remains: at half the step
# limit of `step_doubt` it is below a twentieth of the standard error of any parameter with ordinary sensors (a test).
_BETWEEN = 0.4
# A search may start with almost no mass: stiffness adds no more than this many times the steps of size and speed.
_STIFFEST = 16.0
# A bracket of any width is down to rounding after far fewer halvings than these.
_HALVINGS = 200


def time_step(ship: Ship) -> float:
    """A step that suits the ship's size, speed and stiffness [s].

    1, 2 or 5 times a power of ten, at most L/(250 U), and so short that the fastest motion of the ship at
    its approach decays by less than `_STIFF` within a step; a model in discrete time has its own step.
    """
    if isinstance(ship.model, Sampled):
        return float(ship.model.dt)
    wanted = min(_STEP * ship.L_pp / max(ship.speed, 1e-3), _STIFF / max(fastest(ship), 1e-9))
    return rounded_down(wanted)


def rounded_down(wanted: float) -> float:
    """The greatest of 1, 2 and 5 times a power of ten that is not above `wanted`."""
    decade = 10.0 ** math.floor(math.log10(wanted))
    return max(m * decade for m in (1.0, 2.0, 5.0) if m * decade <= wanted * (1 + 1e-9))


def step_doubt(ship: Ship, dt: float) -> str | None:
    """Why a time step [s] is too long for this ship; None where it is short enough."""
    if isinstance(ship.model, Sampled | Stepped):
        return None
    rate = max(fastest(ship), 1e-9)
    most = min(_ROUGH * ship.L_pp / max(ship.speed, 1e-3), _STIFF / rate)
    if dt <= most:
        return None
    unstable = dt > _UNSTABLE / rate
    what = f"unstable above some {_UNSTABLE / rate:.2g} s" if unstable else f"inaccurate above some {most:.2g} s"
    less = rounded_down(most)
    return f"a step of {dt:g} s is too long for {ship.name}: its integration is {what}; take {less:g} s or less"


def substeps(ship: Ship, dt: float, method: str = "rk4") -> int:
    """Equal steps of the integrator between two rows of a log, `dt` [s] apart, with constant inputs.

    By the rule of `time_step`, the ship's size, speed and stiffness; but there is no order or ramp to resolve
    between rows, so the steps may be longer.  Euler's method takes one step from row to row;
    so do models in discrete time, and networks.
    """
    if method != "rk4" or isinstance(ship.model, Sampled | Stepped):
        return 1
    rate = fastest(ship)
    longest = _BETWEEN * _ROUGH * ship.L_pp / max(ship.speed, 1e-3)
    if math.isfinite(rate):
        longest = max(min(longest, _BETWEEN * _STIFF / max(rate, 1e-9)), longest / _STIFFEST)
    return max(math.ceil(dt / longest * (1.0 - 1e-9)), 1)


def fastest(ship: Ship) -> float:
    """Greatest magnitude of the eigenvalues of (u, v_m, r) at the approach speed, rudder midships [1/s]."""
    control, h = straight(ship, ship.n_P or 0.0), 1e-6 * max(ship.speed, 1e-3)
    state = np.array(_ahead(ship, ship.speed, control))
    matrix = np.empty((state.size - 3, state.size - 3))
    for k in range(3, state.size):
        aside = np.zeros(state.size)
        aside[k] = h
        up, down = (ship.model.derivative(tuple((state + s * aside).tolist()), control, CALM) for s in (1, -1))
        matrix[:, k - 3] = (np.array(up[3:], dtype=float) - np.array(down[3:], dtype=float)) / (2 * h)
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def straight(ship: Ship, n_P: float) -> tuple[float, ...]:
    """Controls of a straight run: controls that follow n_P have its value, all others are zero."""
    return ship.model.obey({"n_P": n_P})


def surge_balance(ship: Ship, u: float, n_P: float) -> float:
    """Surge acceleration straight ahead in calm at `u` [m/s] and `n_P` [1/s]; [m/s^2]."""
    control = straight(ship, n_P)
    state = _ahead(ship, u, control)
    if isinstance(ship.model, Sampled):
        return float(ship.model.advance(state, control, CALM, ship.model.begin(state, control))[0][0])
    return float(ship.model.derivative(state, control, CALM)[3])


def _ahead(ship: Ship, u: float, control: tuple[float, ...]) -> tuple[float, ...]:
    """The state straight ahead in calm, settled to the controls."""
    rest = settled(ship.model, np.array([[*control, *CALM]], dtype=np.float64))[0]
    return (0.0, 0.0, 0.0, u, 0.0, 0.0, *rest.tolist())


def approach(ship: Ship, speed: float | None = None, n_P: float | None = None) -> tuple[float, float]:
    """Speed [m/s] and revolutions [1/s] of a steady straight run; ShipError: no balance in the range searched.

    Without either, the ship file's speed and the revolutions that hold it; with one, the other of the steady run; with
    both, both as given.
    """
    if speed is not None and n_P is not None:
        return speed, n_P
    if n_P is not None:
        by_speed = partial(surge_balance, ship, n_P=n_P)
        if by_speed(0.5 * ship.speed) == by_speed(ship.speed) == 0.0:
            return ship.speed, n_P  # a response model keeps any speed
        return _balance(by_speed, 1e-3, 5 * ship.speed, ship), n_P
    U = ship.speed if speed is None else speed
    if ship.n_P is not None and speed is None:
        return U, ship.n_P
    if surge_balance(ship, U, 0.0) >= 0.0:
        return U, ship.n_P or 0.0  # a response model has no surge balance
    return U, _balance(partial(surge_balance, ship, U), 0.1 * U / ship.L_pp, 2000 * U / ship.L_pp, ship)


def _balance(f: Callable[[float], float], low: float, high: float, ship: Ship) -> float:
    if f(low) * f(high) > 0:
        raise ShipError(
            f"{ship.name}: no steady run between {low:g} and {high:g}; "
            "give n_P in [approach] of its file, or speed and revolutions where a command asks for both"
        )
    return bracketed_root(f, low, high)


def bracketed_root(f: Callable[[float], float], low: float, high: float) -> float:
    """Root of a continuous function between two points where its signs differ, to rounding.

    Inverse quadratic interpolation where it is safe, else bisection: Chandrupatla (1997), Advances in
    Engineering Software 28(3).  Ours, because the import of scipy.optimize takes longer than most manoeuvres.
    """
    a, b, fa, fb = high, low, f(high), f(low)
    c, fc, share = a, fa, 0.5
    for _ in range(_HALVINGS):
        x, fx = (b, fb) if abs(fb) < abs(fa) else (a, fa)
        width = abs(b - a)
        least = 2e-14 * abs(x) + 1e-14
        if fx == 0.0 or width <= least:
            return x
        x = a + min(max(share, 0.5 * least / width), 1.0 - 0.5 * least / width) * (b - a)
        fx = f(x)
        if (fx > 0.0) == (fa > 0.0):
            c, fc = a, fa
        else:
            c, b, fc, fb = b, a, fb, fa
        a, fa = x, fx
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        quadratic = phi * phi < xi and (1.0 - phi) ** 2 < 1.0 - xi
        share = (fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
                 if quadratic else 0.5)  # fmt: skip
    return a
