"""Nomoto's first-order model of steering, with Norrbin's cubic term."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ..environment import Environment, to_body, to_earth
from ..parameters import Scalar, spec
from ..symbolic import cos, sin
from . import STATES


@dataclass(frozen=True, kw_only=True)
class Nomoto:
    """T r' + r + alpha r^3 = K delta at a held speed through the water, without drift.

    K and T hold at the speed U; at another one K grows with it and T falls with it, as their
    non-dimensional forms K L/U and T U/L stay.  alpha is taken as it is given.
    """

    states: ClassVar[tuple[str, ...]] = STATES
    controls: ClassVar[tuple[str, ...]] = ("n_P", "delta")

    K: Scalar = spec("1/s", "steady yaw rate over rudder angle at U")
    T: Scalar = spec("s", "time constant of the answer to the rudder at U; negative if unstable")
    U: Scalar = spec("m/s", "speed at which K and T hold", (1e-3, 100.0))
    alpha: Scalar = spec("s^2", "Norrbin's cubic term, per rad^2", default=0.0)

    def derivative(
        self, state: tuple[Scalar, ...], control: tuple[Scalar, ...], environment: Environment
    ) -> tuple[Scalar, ...]:
        """Time derivative of `state` [SI/s] under the actual controls and the environment."""
        _, _, psi, u, v_m, r = state
        _, delta = control
        c, s = cos(psi), sin(psi)
        u_C, v_C = to_body(environment.current_x, environment.current_y, c, s)
        ratio = (u - u_C) / self.U
        dr = ratio * (self.K * ratio * delta - r - self.alpha * r * r * r) / self.T  # Norrbin
        north, east = to_earth(u, v_m, c, s)
        return north, east, r, r * v_C, -r * u_C, dr
