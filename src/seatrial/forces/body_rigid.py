"""Rigid body and added mass where the hull derivatives already hold the turning terms of the added mass."""

from __future__ import annotations

from ..core.parameters import Scalar
from ..core.values import dataclass
from . import Force
from .body import Body


@dataclass(frozen=True, kw_only=True)
class RigidCoriolis(Body):
    """A body whose added mass resists acceleration, and turns only within the hull's derivatives.

    Sets printed as X_vr + m_y, Y_r - m_x (or X_br - m_y, Y_r - m_x by drift angle) go with it as they
    stand.  With `Body` such a set would count m_y v_m r and m_x u r twice.
    """

    def acceleration(self, force: Force, u: Scalar, v_m: Scalar, r: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """Rates of u, v_m [m/s^2] and r [rad/s^2] under `force`, at velocities through the water."""
        held = Force(force.X - self.m_y * v_m * r, force.Y + self.m_x * u * r, force.N)
        return super().acceleration(held, u, v_m, r)
