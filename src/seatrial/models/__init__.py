"""Model families: how a ship answers its controls.

A model is a frozen dataclass (numbers declared with `spec`) with the names of its states and
controls and one method, `derivative`, written for floats and symbols alike: tuples in, tuples out,
no `if` on a value.  Every model carries the six states of the trial; positions and heading are
kinematics over ground, velocities are over ground too, forces see the water.
"""

from __future__ import annotations

from typing import ClassVar, Protocol

from ..environment import Environment, to_earth
from ..parameters import Scalar
from ..symbolic import cos, sin

STATES = ("x", "y", "psi", "u", "v_m", "r")
UNITS = {"x": "m", "y": "m", "psi": "rad", "u": "m/s", "v_m": "m/s", "r": "rad/s",
         "n_P": "1/s", "delta": "rad"}  # fmt: skip


class Model(Protocol):
    """A continuous-time ship model."""

    states: ClassVar[tuple[str, ...]]
    controls: ClassVar[tuple[str, ...]]

    def derivative(
        self, state: tuple[Scalar, ...], control: tuple[Scalar, ...], environment: Environment
    ) -> tuple[Scalar, ...]:
        """Time derivative of `state` [SI/s] under the actual controls and the environment."""
        ...


def kinematics(psi: Scalar, u: Scalar, v_m: Scalar, r: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """Rates of x, y [m/s] and psi [rad/s] of a ship moving over ground with u, v_m, r."""
    north, east = to_earth(u, v_m, cos(psi), sin(psi))
    return north, east, r
