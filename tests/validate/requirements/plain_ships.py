"""Ships whose rates are written down, examined by NumPy alone: no step is compiled, so a ship takes milliseconds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from seatrial.actuators import Actuators
from seatrial.core.parameters import Scalar, spec
from seatrial.data import Trial
from seatrial.environment import CALM, Environment
from seatrial.models import Model
from seatrial.ships import Ship
from seatrial.validate.requirements.probe import Probe

U, L, N_P = 2.0, 50.0, 1.5
LIMIT = math.radians(35.0)
Law = Callable[[Any], tuple[Any, Any, Any]]


@dataclass(frozen=True)
class Plain(Probe):
    """A probe that evaluates the model's rates on arrays, and integrates them by the classical Runge-Kutta rule."""

    def at(self, motion: Any, control: Any, around: Any = CALM, psi: float = 0.0) -> Any:
        given = [np.atleast_2d(np.asarray(one, dtype=float)) for one in (motion, control, around)]
        rows = max(map(len, given))
        given = [np.broadcast_to(one, (rows, one.shape[1])) for one in given]
        state = (0.0 * given[0][:, 0], 0.0 * given[0][:, 0], psi + 0.0 * given[0][:, 0], *given[0].T)
        rates = self.ship.model.derivative(state, tuple(given[1].T), Environment(*given[2].T))[3:6]
        return np.column_stack([rate + np.zeros(rows) for rate in rates])

    def drift(self, states: Any, controls: Any, duration: float, around: Any = CALM, dt: Any = None) -> Any:
        steps = max(round(duration / (dt or self.step)), 2)
        z = np.array(states, dtype=float).T
        control, h = tuple(np.array(controls, dtype=float).T), duration / steps

        def rates(at: Any) -> Any:
            return np.array([rate + 0.0 * z[0] for rate in self.ship.model.derivative(tuple(at), control, around)])

        rows = [z]
        for _ in range(steps):
            a = rates(z)
            b = rates(z + 0.5 * h * a)
            c = rates(z + 0.5 * h * b)
            z = z + h / 6.0 * (a + 2.0 * b + 2.0 * c + rates(z + h * c))
            rows.append(z)
        return h * np.arange(steps + 1), np.array(rows).transpose(2, 0, 1)

    def sail(self, orders: Any, duration: float, speed: float, dt: float) -> Any:
        t, runs = self.drift([self.state(speed)] * len(orders), [self.controls(*order) for order in orders], duration,
                             dt=dt)  # fmt: skip
        return [Trial("run", t, dict(zip(("x", "y", "psi", "u", "v_m", "r"), rows.T, strict=True))
                      | {name: np.full(len(t), value) for name, value in (("n_P", n), ("n_P_cmd", n), ("delta", delta),
                                                                          ("delta_cmd", delta))})
                for rows, (n, delta) in zip(runs, orders, strict=True)]  # fmt: skip

    def zigzag(self, angle: float, duration: float) -> Trial:
        steps, state, side = 240, self.state(self.U), 1.0
        rows = [state]
        for _ in range(steps):
            if side * state[2] >= angle:
                side = -side
            held, lasts = self.controls(self.n_P, side * angle), duration / steps
            _, (run,) = self.drift([state], [held], lasts, dt=lasts)
            state = tuple(run[-1].tolist())
            rows.append(state)
        names = ("x", "y", "psi", "u", "v_m", "r")
        return Trial("zigzag", np.linspace(0.0, duration, steps + 1), dict(zip(names, np.array(rows).T, strict=True)))


def plain(law: Law, *names: str, masses: Any = None, file: Any = None, gear: Any = None, dt: float = 12.5,
          q: float = 1.0) -> Plain:  # fmt: skip
    """A ship whose rates are law(m), without dimension: over U^2/L, and over U^2/L^2 for yaw.

    `m` has u, v over U; r over U/L; n over that of the approach; d [rad]; own, the controls of its own; ahead, aside,
    where the wind comes from, and east, north, where the water goes, over U; psi; and the one parameter q.
    """
    controlled = ("n_P", "delta", *names)

    @dataclass(frozen=True)
    class Written(Model):
        q: Scalar = spec("-", "the one parameter", (-1e3, 1e3))

        @property
        def controls(self) -> Any:
            return controlled

        def pushed(self, push: Any) -> Any:
            return None if masses is None else tuple(np.linalg.solve(np.array(masses), push).tolist())

        def derivative(self, state: Any, control: Any, around: Any) -> Any:
            _, _, psi, u, v, r = state[:6]
            m = SimpleNamespace(
                u=u / U, v=v / U, r=r * L / U, n=control[0] / N_P, d=control[1], own=control[2:], psi=psi, q=self.q,
                ahead=(around.wind_x * np.cos(psi) + around.wind_y * np.sin(psi)) / U,
                aside=(around.wind_y * np.cos(psi) - around.wind_x * np.sin(psi)) / U,
                north=around.current_x / U, east=around.current_y / U,
            )  # fmt: skip
            X, Y, N = law(m)
            c, k = np.cos(psi), np.sin(psi)
            return (c * u - k * v, k * u + c * v, r, X * U * U / L, Y * U * U / L, N * U * U / L / L)

    ship = Ship("written", Written(q), gear or Actuators(), L_pp=L, speed=U, validity=file or {})
    return Plain(ship, U, N_P, dt=dt)
