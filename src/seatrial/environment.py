"""Wind and current as the plant feels them.

Wind is given by the direction it comes FROM, current by the direction it goes TOWARDS, both
clockwise from north.  Inside, each is a pair of earth-fixed components, so that a right-hand side
needs no more than the sine and cosine of the heading that it computes anyway.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from .parameters import Scalar
from .symbolic import cos, sin


class Environment(NamedTuple):
    """What surrounds the ship at one instant; the order is that of `CHANNELS`.

    Attributes:
        wind_x, wind_y: U_T cos(gamma_T), U_T sin(gamma_T): where the true wind comes from [m/s].
        current_x, current_y: velocity of the water over ground, north and east [m/s].
    """

    wind_x: Scalar = 0.0
    wind_y: Scalar = 0.0
    current_x: Scalar = 0.0
    current_y: Scalar = 0.0


CHANNELS = Environment._fields
CALM = Environment()


@dataclass(frozen=True)
class Uniform:
    """Steady, uniform wind and current.

    Attributes:
        U_T, gamma_T: true wind speed [m/s] and the direction it comes from [rad].
        U_C, gamma_C: current speed [m/s] and the direction it goes towards [rad].
    """

    U_T: float = 0.0
    gamma_T: float = 0.0
    U_C: float = 0.0
    gamma_C: float = 0.0

    def now(self) -> Environment:
        """Its earth-fixed components."""
        return Environment(*components(self.U_T, self.gamma_T), *components(self.U_C, self.gamma_C))


def components(magnitude: Scalar, direction: Scalar) -> tuple[Scalar, Scalar]:
    """(north, east) components of a vector given by its length and its direction from north."""
    return magnitude * cos(direction), magnitude * sin(direction)


def to_body(north: Scalar, east: Scalar, cos_psi: Scalar, sin_psi: Scalar) -> tuple[Scalar, Scalar]:
    """An earth-fixed vector in ship axes (forward, starboard)."""
    return north * cos_psi + east * sin_psi, east * cos_psi - north * sin_psi


def to_earth(u: Scalar, v_m: Scalar, cos_psi: Scalar, sin_psi: Scalar) -> tuple[Scalar, Scalar]:
    """A ship-fixed vector (forward, starboard) in earth axes (north, east)."""
    return u * cos_psi - v_m * sin_psi, u * sin_psi + v_m * cos_psi
