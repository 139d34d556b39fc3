"""Rigid body and added mass in the horizontal plane: from a force to an acceleration."""

from __future__ import annotations

from math import inf

from ..core.parameters import Scalar, spec
from ..core.values import dataclass
from . import Force


@dataclass(frozen=True, kw_only=True)
class Body:
    """Mass, inertia and added mass of a ship, origin midship (MMG; Sawada 2024 Eq. 36)."""

    rho: Scalar = spec("kg/m^3", "density of the water", (500.0, 2000.0))
    L_pp: Scalar = spec("m", "length between perpendiculars", (1e-3, 1e3))
    B: Scalar = spec("m", "breadth", (1e-3, 1e3))
    d: Scalar = spec("m", "draught", (1e-4, 100.0))
    m: Scalar = spec("kg", "mass of the displaced water", (1e-6, inf))
    x_G: Scalar = spec("m", "centre of gravity ahead of midship")
    I_zG: Scalar = spec("kg m^2", "moment of inertia in yaw about the centre of gravity", (1e-9, inf))
    m_x: Scalar = spec("kg", "added mass in surge", (0.0, inf))
    m_y: Scalar = spec("kg", "added mass in sway", (0.0, inf))
    J_z: Scalar = spec("kg m^2", "added moment of inertia in yaw", (0.0, inf))

    def acceleration(self, force: Force, u: Scalar, v_m: Scalar, r: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """Rates of u, v_m [m/s^2] and r [rad/s^2] under `force`, at velocities through the water."""
        surge = self.m + self.m_x
        sway = self.m + self.m_y
        lever = self.x_G * self.m
        yaw = self.I_zG + self.x_G * lever + self.J_z
        Y = force.Y - surge * u * r
        N = force.N - lever * u * r
        rate = 1.0 / (sway * yaw - lever * lever)
        return (
            (force.X + sway * v_m * r + lever * r * r) / surge,  # (36a)
            (yaw * Y - lever * N) * rate,  # (36b)
            (sway * N - lever * Y) * rate,  # (36c)
        )
