"""Model families: how a ship answers its controls.

A family is a frozen dataclass derived from `Model` (numbers declared with `spec`, `terms`, `parts`) with one method,
`derivative`, written for floats and symbols alike: tuples in, tuples out, no `if` on a value.  Every model carries
the six states of the trial first and may add its own after them, which are zero in a straight run.  Positions and
heading are kinematics over ground, velocities are over ground too, forces see the water.  A family that rolls adds
`ROLL`; these two come first of its own, and sensors measure them: `Model.motion` has all that they measure.

What the rest of the package needs to know about a family is a property of `Model`, with a default that claims nothing.

A family in discrete time (ARX, recurrent networks) is `Sampled`: once per sample it gives how fast the velocities
change until the next one, so it runs in the same engine as the others.  One with too many numbers to be traced (a
network) is `Stepped` besides: it moves all lanes at once, on arrays.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..core.parameters import Scalar, Scalars
from ..core.symbolic import cos, sin
from ..data import Array
from ..engine import Untraced
from ..environment import Environment, to_earth
from ..forces import ThrusterModule

if TYPE_CHECKING:
    from .network import Network

__all__ = ["ROLL", "STATES", "STEERING", "UNITS", "Model", "Sampled", "Stepped", "kinematics", "unit"]

STATES = ("x", "y", "psi", "u", "v_m", "r")
ROLL = ("phi", "p")
"""Heel [rad], positive with the starboard side down, and roll rate [rad/s]: the motion beyond the horizontal plane."""
STEERING = ("n_P", "delta")
"""The orders of every manoeuvre: revolutions [1/s], and the helm: a rudder angle [rad], or what stands for it."""

UNITS = {"x": "m", "y": "m", "psi": "rad", "u": "m/s", "v_m": "m/s", "r": "rad/s",
         "phi": "rad", "p": "rad/s", "n_P": "1/s", "delta": "rad",
         "z": "m", "w": "m/s", "theta": "rad", "q": "rad/s",
         "slow_wind_x": "m/s", "slow_wind_y": "m/s", "slow_n": "1/s", "lead": "rad/s^2"}  # fmt: skip
"""By state its unit."""
_PREFIXES = {"n": "1/s", "throttle": "-", "delta": "rad", "alpha": "rad", "f": "N", "X": "N", "Y": "N", "N": "N m"}


class Model(ABC):
    """A continuous-time ship model: the base of every family.

    A single-screw ship has the controls n_P [1/s] and delta [rad].  Other controls are named by a
    prefix that gives the unit and the part they move, port to starboard where numbered: n_bow, delta_1,
    alpha_2 (direction of a thrust, clockwise from ahead), f_1 (thrust [N]).  `UNITS` and `unit` know them.
    """

    states: ClassVar[tuple[str, ...]] = STATES
    """Names of the states; the first six are `STATES`."""

    valid_at_rest: ClassVar[bool] = True
    """Whether the model is physical at rest; a family with False gives the reason in its docstring."""

    @property
    def motion(self) -> tuple[str, ...]:
        """The first of `states`: those that a log measures, `STATES` and, of a ship that rolls, `ROLL`."""
        rolling = self.states[len(STATES) : len(STATES) + len(ROLL)] == ROLL
        return (*STATES, *ROLL) if rolling else STATES

    @abstractmethod
    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        """Time derivative of `state` [SI/s] under the actual controls and the environment."""

    @property
    def controls(self) -> tuple[str, ...]:
        """Names of the controls; by default n_P [1/s] and delta [rad]."""
        return STEERING

    @property
    def follows(self) -> tuple[tuple[str, float], ...]:
        """For each control the conventional order that it obeys (n_P or delta) and its factor; by default its own."""
        return tuple((name, 1.0) for name in self.controls)

    @property
    def differential(self) -> tuple[float, ...]:
        """What each control takes of the helm (delta) besides what it follows, per radian; by default nothing.

        A craft without a rudder turns by thrusters that push unequally: to starboard with more thrust to port.
        """
        return (0.0,) * len(self.controls)

    def obey(self, orders: Mapping[str, Scalar]) -> Scalars:
        """The controls under orders by name; a control whose orders are absent rests."""
        plain = tuple(factor * orders[order] if order in orders else 0.0 for order, factor in self.follows)
        if "delta" not in orders or not any(self.differential):
            return plain
        helm = orders["delta"]
        return tuple(x + share * helm if share else x for x, share in zip(plain, self.differential, strict=True))

    def obeying(self, order: str) -> tuple[str, ...]:
        """The controls that an order moves."""
        pairs = zip(self.controls, self.follows, self.differential, strict=True)
        return tuple(name for name, (own, _), share in pairs if own == order or (order == "delta" and share))

    @property
    def stands_for(self) -> tuple[tuple[str, float], ...]:
        """For each control the channel of a log that is taken where its own is absent, and the factor.

        It is the order that the control follows; its own where it takes a share of the helm besides, or is a throttle,
        for which no revolutions stand.
        """
        return tuple(
            (name, 1.0) if share or unit(name) == "-" else pair
            for name, pair, share in zip(self.controls, self.follows, self.differential, strict=True)
        )

    @property
    def draught(self) -> Scalar:
        """Draught [m]; 0 where unknown."""
        return 0.0

    @property
    def breadth(self) -> Scalar:
        """Breadth [m]; 0 where unknown."""
        return 0.0

    @property
    def displaced(self) -> Scalar:
        """Mass of the displaced water [kg]; 0 where unknown."""
        return 0.0

    @property
    def thrusters_by_name(self) -> Mapping[str, ThrusterModule]:
        """Thrusters by the name of the part, in the order of their controls."""
        return {}

    @property
    def feels_wind(self) -> bool:
        """Whether the true wind changes the motion."""
        return False

    @property
    def needed(self) -> tuple[str, ...]:
        """Channels that a trial must have besides states and controls."""
        return ()

    @property
    def learned(self) -> Network | None:
        """The network that gives the accelerations; None in a family of equations."""
        return None

    @property
    def trained(self) -> bool:
        """Whether the numbers are usable: False for a network without weights."""
        return self.learned is None or self.learned.trained

    @property
    def asymmetries(self) -> tuple[str, ...]:
        """Paths of numbers that make port and starboard differ; all zero, the ship is its own mirror image."""
        return ()

    @property
    def sides(self) -> tuple[int, ...]:
        """Sign in the mirror image of each state beyond the six; by default all change sides."""
        return (-1,) * (len(self.states) - len(STATES))

    def takes(self, name: str) -> bool:
        """Whether the family has a part of that name (wind, thrusters, ...), filled or not."""
        return name in vars(self)

    def part(self, name: str) -> object | None:
        """The part of that name (hull, propeller, wind, ...); None where the family or the ship has none."""
        return vars(self).get(name)

    def mass_doubts(self, L_pp: float) -> tuple[str, ...]:
        """What is physically doubtful about the mass matrix, a sentence each; L_pp [m] is that of the ship."""
        return ()

    def pushed(self, push: Scalars) -> Scalars | None:
        """Rates of u, v_m [m/s^2] and r [rad/s^2] at rest under a force and a moment over the ship's own mass.

        The push is [m/s^2, m/s^2, m^2/s^2].  None where the family has no masses, and where a force can be added to
        it in place of the wind.
        """
        return None

    def recall(self, series: Array, dt: float) -> Array:
        """States beyond the six at each row of a log, from the rows before it; by default at rest.

        Args:
            series: controls and environment per row, shape (rows, controls + 8), without gaps.
            dt: time between the rows [s].

        Returns:
            shape (rows, states - 6).
        """
        return np.zeros((len(series), len(self.states) - len(STATES)))


class Sampled(Model):
    """A model in discrete time.

    Its `derivative` is the kinematics with held velocities; `advance` gives what changes them.
    """

    dt: Scalar
    """Sample time [s]; the model runs at no other."""

    @property
    @abstractmethod
    def memory(self) -> tuple[str, ...]:
        """Names of what it remembers (lagged values, network memory)."""

    @abstractmethod
    def begin(self, state: Scalars, control: Scalars) -> Scalars:
        """Memory as if the ship had been in this state, under these controls, for ever."""

    @abstractmethod
    def advance(
        self, state: Scalars, control: Scalars, environment: Environment, memory: Scalars
    ) -> tuple[Scalars, Scalars]:
        """Rates of (u, v_m, r) that hold until the next sample, and the memory of the next sample."""

    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        return (*kinematics(*state[2:6]), *(0.0 * x for x in state[3:6]))


class Stepped(Sampled):
    """A model in discrete time that cannot be traced; functions that differentiate a ship refuse it."""

    @property
    @abstractmethod
    def look_back(self) -> int:
        """Samples before a start that its memory depends on."""

    @abstractmethod
    def recall_memory(self, state: Array, acting: Array) -> tuple[float, ...]:
        """Memory after the measured samples before a start: (samples, 6) and controls with environment."""

    @abstractmethod
    def plant(self, memory: Array) -> Untraced:
        """The model under way from what each lane remembers (lanes, memory); acting: controls, environment."""


def unit(name: str) -> str:
    """SI unit of a state or control by its name; "-" where none follows from it."""
    return UNITS.get(name) or _PREFIXES.get(name.removesuffix("_cmd").partition("_")[0], "-")


def kinematics(psi: Scalar, u: Scalar, v_m: Scalar, r: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """Rates of x, y [m/s] and psi [rad/s] of a ship moving over ground with u, v_m, r."""
    north, east = to_earth(u, v_m, cos(psi), sin(psi))
    return north, east, r
