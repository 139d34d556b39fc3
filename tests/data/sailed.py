"""Trials of a ship that follows Nomoto's equation, as a logger would have them: quick, and of a known kind."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from seatrial.data import Trial

L_PP, SPEED, K, LAG, RATE = 7.0, 1.2, 0.12, 6.0, math.radians(15.0)

Helm = Callable[[float, float, float], float]
"""Order of the rudder [rad] by time [s], heading [rad] and rate of turn [rad/s]."""


def sail(
    helm: Helm, duration: float, *, dt: float = 0.2, engine: Callable[[float], float] = lambda t: 10.0,
    start: float = SPEED, noise: float = 1.0, seed: int = 0, kind: str = "", name: str = "trial",
) -> Trial:  # fmt: skip
    """A run under a helm and an engine [1/s]; speed follows the revolutions with a lag of ten seconds."""
    steps = round(duration / dt)
    rows = np.zeros((steps, 8))
    x = y = psi = r = delta = 0.0
    u = start
    for k in range(steps):
        t, n = k * dt, engine(k * dt)
        rows[k] = t, x, y, psi, u, r, delta, n
        order = helm(t, psi, r)
        delta += min(max(order - delta, -RATE * dt), RATE * dt)
        r += dt * (K * delta * u / SPEED - r) / LAG
        u += dt * ((SPEED * n / 10.0 - u) / 10.0 - 2.0 * abs(r) * u)
        x, y, psi = x + dt * u * math.cos(psi), y + dt * u * math.sin(psi), psi + dt * r
    t, x_, y_, psi_, u_, r_, delta_, n_ = rows.T
    rng = np.random.default_rng(seed)
    sigma = {"x": 0.03, "y": 0.03, "psi": 0.003, "u": 0.01, "v_m": 0.01, "r": 0.001, "delta": 0.003}
    clean = {"x": x_, "y": y_, "psi": psi_, "u": u_, "v_m": -0.3 * L_PP * r_, "r": r_, "delta": delta_, "n_P": n_}
    read = {c: v + noise * sigma.get(c, 0.0) * rng.standard_normal(v.size) for c, v in clean.items()}
    return Trial(name, t.copy(), read, meta={"L_pp": L_PP, **({"kind": kind} if kind else {})})


def deg(angle: float) -> float:
    """Radians of degrees."""
    return math.radians(angle)


def zigzag(rudder: float, heading: float, side: float = 1.0) -> Helm:
    """Reverse the rudder at a heading, both in degrees; begins after ten seconds."""
    held = [side]

    def helm(t: float, psi: float, r: float) -> float:
        if t < 10.0:
            return 0.0
        if held[0] * psi >= deg(heading):
            held[0] = -held[0]
        return held[0] * deg(rudder)

    return helm


def steps(*orders: tuple[float, float]) -> Helm:
    """Rudder angles [deg] from given times [s] on."""
    return lambda t, psi, r: deg([angle for since, angle in orders if t >= since][-1])


def autopilot(course: Callable[[float], float], most: float = 10.0) -> Helm:
    """A PD law on a course [deg] by time, with a greatest rudder [deg]."""
    return lambda t, psi, r: min(max(1.5 * (deg(course(t)) - psi) - 8.0 * r, -deg(most)), deg(most))
