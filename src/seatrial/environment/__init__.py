"""Wind, current, waves and depth that act on a ship.

Contract: a `Weather` gives the channels of `CHANNELS` per time step; an `Environment` is one instant of them, on
floats or symbols.  `Uniform` is steady weather; `weather` has gusts, measured series and sums.  Wind and waves are
given by the direction they come FROM, current by the direction it goes TOWARDS, all clockwise from north.  The
channels are earth-fixed components, so that a right-hand side needs only the sine and cosine of the heading, which it
computes in any case.  What lies around the ship (`PLACE`: banks, a quay, another ship) depends on where it is and is
looked up at each step (`grid`); a `Charted` environment has it besides the channels.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.parameters import Scalar, Spec, possible
from ..core.symbolic import cos, sin
from ..core.values import dataclass


class Environment(NamedTuple):
    """Environment of the ship at one instant; the order is that of `CHANNELS`.

    Attributes:
        wind_x, wind_y: U_T cos(gamma_T), U_T sin(gamma_T): where the true wind comes from [m/s].
        current_x, current_y: velocity of the water over ground, north and east [m/s].
        wave_x, wave_y: H_S cos(chi), H_S sin(chi): significant height and where the waves come from [m].
        wave_T: mean period of the waves [s]; 0 without waves.
        per_depth: one over the depth of the water [1/m]; 0 in deep water.
    """

    wind_x: Scalar = 0.0
    wind_y: Scalar = 0.0
    current_x: Scalar = 0.0
    current_y: Scalar = 0.0
    wave_x: Scalar = 0.0
    wave_y: Scalar = 0.0
    wave_T: Scalar = 0.0
    per_depth: Scalar = 0.0


class Charted(NamedTuple):
    """An `Environment` on a chart: its channels, then those of `PLACE`, all of them zero on open water.

    Attributes:
        bank_x, bank_y: sum over the banks of the unit vector towards each times its suction [-].
        quay_x, quay_y: unit vector towards the nearest quay over its distance from midship [1/m].
        other_x, other_y: midship of another ship less the own one, north and east [m].
        other_u, other_v: its velocity through the water, north and east [m/s].
        other_L, other_A: its length [m] and midship section [m^2]; 0 where there is none.
    """

    wind_x: Scalar = 0.0
    wind_y: Scalar = 0.0
    current_x: Scalar = 0.0
    current_y: Scalar = 0.0
    wave_x: Scalar = 0.0
    wave_y: Scalar = 0.0
    wave_T: Scalar = 0.0
    per_depth: Scalar = 0.0
    bank_x: Scalar = 0.0
    bank_y: Scalar = 0.0
    quay_x: Scalar = 0.0
    quay_y: Scalar = 0.0
    other_x: Scalar = 0.0
    other_y: Scalar = 0.0
    other_u: Scalar = 0.0
    other_v: Scalar = 0.0
    other_L: Scalar = 0.0
    other_A: Scalar = 0.0


class InWaves(NamedTuple):
    """An `Environment` with the first-order forces of waves at the place of the ship, in its level axes.

    Attributes:
        calm: the environment without them.
        forces: X, Y, Z [N], K, M, N [N m], z down.
    """

    calm: Environment
    forces: tuple[Scalar, Scalar, Scalar, Scalar, Scalar, Scalar]


FORCES = ("wave_X", "wave_Y", "wave_Z", "wave_K", "wave_M", "wave_N")
"""Names of `InWaves.forces` as series."""

_TURN = (-4.0 * math.pi, 4.0 * math.pi)  # a heading and a bearing may add up to more than one turn
RANGES = {
    "U_T": Spec("m/s", "true wind speed", 0.0, 150.0), "gamma_T": Spec("rad", "where it comes from", *_TURN),
    "U_C": Spec("m/s", "speed of the current", 0.0, 15.0), "gamma_C": Spec("rad", "where it goes", *_TURN),
    "H_S": Spec("m", "significant height", 0.0, 40.0), "T_W": Spec("s", "mean period", 0.0, 100.0),
    "gamma_W": Spec("rad", "where the waves come from", *_TURN), "depth": Spec("m", "depth", 1e-6, math.inf),
}  # fmt: skip
"""Ranges of weather: records of wind, current and sea lie within; a direction beyond two turns is in degrees."""

CHANNELS = Environment._fields
PLACE = Charted._fields[len(CHANNELS) :]
CALM = Environment()
VECTORS = (("wind", "U_T", "gamma_T"), ("current", "U_C", "gamma_C"), ("wave", "H_S", "gamma_W"))
"""Vectors of the environment: stem of their components in `CHANNELS`, size and direction in a trial."""


class Weather(Protocol):
    """The environment of a ship over a run."""

    def series(self, dt: float, steps: int) -> NDArray[np.float64]:
        """The channels of `CHANNELS` per step, shape (steps, 8), or (1, 8) where they are constant.

        Every call gives the same values: a gust has a seed.
        """
        ...


@dataclass(frozen=True)
class Uniform:
    """Steady, uniform wind, current and waves over an even bottom.

    Attributes:
        U_T, gamma_T: true wind speed [m/s] and the direction it comes from [rad].
        U_C, gamma_C: current speed [m/s] and the direction it goes towards [rad].
        H_S, T_W, gamma_W: significant height [m] and mean period [s] of the waves, and where they come from [rad].
        depth: depth of the water [m].

    Raises:
        ParameterError: a direction beyond two turns, which is in degrees; a size below zero or beyond its range.
    """

    U_T: float = 0.0
    gamma_T: float = 0.0
    U_C: float = 0.0
    gamma_C: float = 0.0
    H_S: float = 0.0
    T_W: float = 0.0
    gamma_W: float = 0.0
    depth: float = math.inf

    def __post_init__(self) -> None:
        possible(RANGES, vars(self))

    def now(self) -> Environment:
        """Its earth-fixed components."""
        return Environment(
            *components(self.U_T, self.gamma_T), *components(self.U_C, self.gamma_C),
            *components(self.H_S, self.gamma_W), self.T_W, 1.0 / self.depth,
        )  # fmt: skip

    def series(self, dt: float, steps: int) -> NDArray[np.float64]:
        """The channels of `CHANNELS` per step, shape (1, 8), as they are constant."""
        return np.array([self.now()], dtype=np.float64)


def components(magnitude: Scalar, direction: Scalar) -> tuple[Scalar, Scalar]:
    """(north, east) components of a vector given by its length and its direction from north."""
    return magnitude * cos(direction), magnitude * sin(direction)


def to_body(north: Scalar, east: Scalar, cos_psi: Scalar, sin_psi: Scalar) -> tuple[Scalar, Scalar]:
    """An earth-fixed vector in ship axes (forward, starboard)."""
    return north * cos_psi + east * sin_psi, east * cos_psi - north * sin_psi


def through_water(
    u: Scalar, v_m: Scalar, current_x: Scalar, current_y: Scalar, cos_psi: Scalar, sin_psi: Scalar
) -> tuple[Scalar, Scalar]:
    """Velocity through the water in ship axes (forward, starboard), from that over ground; it acts on the hull."""
    u_C, v_C = to_body(current_x, current_y, cos_psi, sin_psi)
    return u - u_C, v_m - v_C


def to_earth(u: Scalar, v_m: Scalar, cos_psi: Scalar, sin_psi: Scalar) -> tuple[Scalar, Scalar]:
    """A ship-fixed vector (forward, starboard) in earth axes (north, east)."""
    return u * cos_psi - v_m * sin_psi, u * sin_psi + v_m * cos_psi
