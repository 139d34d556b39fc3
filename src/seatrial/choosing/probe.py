"""A ship in hand: her rates at any motion and under any orders, without dimension.

Velocities are in units of the approach speed U (yaw rate: U/L_pp), revolutions of those of the straight
run, so that one threshold holds for ships of every size; rates are in U^2/L_pp and U^2/L_pp^2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any

from ..environment import CALM, Environment
from ..models import Sampled, follows
from ..models.settled import begun
from ..models.trim import Trim, trim
from ..ships import Ship

Rates = tuple[float, float, float]

TUNNEL = "n_probe"
"""The control of a side thruster that a probe fits: the part is called ``probe``."""


@dataclass(frozen=True)
class Probe:
    """A ship to be asked, and her straight run at the approach speed."""

    ship: Ship
    at: Trim

    @classmethod
    def of(cls, ship: Ship) -> Probe:
        """Find the straight run.

        Raises:
            ParameterError: there is none.
        """
        return cls(ship, trim(ship.model, speed=ship.speed))

    def state(self, u: float, v_m: float, r: float) -> tuple[float, ...]:
        """The motion in SI units, heading aside; what the model has beyond settles to what acts (`under`)."""
        U = self.ship.speed
        return (0.0, 0.0, 0.4, u * U, v_m * U, r * U / self.ship.L_pp)

    def control(self, n: float, delta: float, tunnel: float = 0.0) -> tuple[float, ...]:
        """Controls at `n` times the revolutions of the straight run and `delta` off its rudder."""
        base = self.at.orders
        given = {"n_P": n * (base.get("n_P", 0.0) or 1.0), "delta": delta + base.get("delta", 0.0),
                 TUNNEL: tunnel}  # fmt: skip
        return tuple(factor * given.get(order, 0.0) for order, factor in follows(self.ship.model))

    def rates(
        self, u: float = 1.0, v_m: float = 0.0, r: float = 0.0, n: float = 1.0, delta: float = 0.0,
        environment: Environment = CALM, tunnel: float = 0.0,
    ) -> Rates:  # fmt: skip
        """Scaled rates of u, v_m, r."""
        return self.under(self.state(u, v_m, r), self.control(n, delta, tunnel), environment)

    def under(
        self, state: tuple[float, ...], control: tuple[float, ...], environment: Environment = CALM
    ) -> Rates:
        """The same in a motion (six states) under given controls; NaN where the model has no answer."""
        model: Any = self.ship.model
        state = begun(model, state, control, environment)
        try:
            if isinstance(model, Sampled):
                du, dv, dr = model.advance(state, control, environment, model.begin(state, control))[0]
            else:
                du, dv, dr = model.derivative(state, control, environment)[3:6]
        except (ZeroDivisionError, OverflowError, ValueError):
            return math.nan, math.nan, math.nan
        U, L = self.ship.speed, self.ship.L_pp
        return du * L / (U * U), dv * L / (U * U), dr * L * L / (U * U)

    def has(self, name: str) -> bool:
        """Whether the model has a place for a part of that name."""
        model: Any = self.ship.model
        return name in {f.name for f in fields(model)}

    def having(self, **parts: Any) -> Probe:
        """The same ship with other parts, asked about the same straight run."""
        model: Any = self.ship.model
        return replace(self, ship=replace(self.ship, model=replace(model, **parts)))
