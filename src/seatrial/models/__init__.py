"""Model families: how a ship answers its controls.

A model is a frozen dataclass (numbers declared with `spec`, `terms`, `parts`) with the names of its
states and controls and one method, `derivative`, written for floats and symbols alike: tuples in,
tuples out, no `if` on a value.  Every model carries the six states of the trial first and may add its
own after them, which are zero in a straight run.  Positions and heading are kinematics over ground,
velocities are over ground too, forces see the water.

A family in discrete time (ARX, recurrent networks) is `Sampled`: once per sample it says how fast the
velocities change until the next one, so it runs in the same engine as the others.  One with too many numbers
to be traced (a network) is `Stepped` besides: it moves all lanes at once, on arrays.
"""

from __future__ import annotations

from typing import ClassVar, Protocol, runtime_checkable

from ..core.parameters import Scalar
from ..core.symbolic import cos, sin
from ..data import Array
from ..engine import Plant
from ..environment import Environment, to_earth

STATES = ("x", "y", "psi", "u", "v_m", "r")
UNITS = {"x": "m", "y": "m", "psi": "rad", "u": "m/s", "v_m": "m/s", "r": "rad/s",
         "n_P": "1/s", "delta": "rad", "slow_wind_x": "m/s", "slow_wind_y": "m/s", "slow_n": "1/s",
         "lead": "rad/s^2"}  # fmt: skip
_PREFIXES = {"n": "1/s", "delta": "rad", "alpha": "rad", "f": "N", "X": "N", "Y": "N", "N": "N m"}


class Model(Protocol):
    """A continuous-time ship model.

    A single-screw ship has the controls n_P [1/s] and delta [rad].  Other controls are named by a
    prefix that gives the unit and the part they move, port to starboard where numbered: n_bow, delta_1,
    alpha_2 (direction of a thrust, clockwise from ahead), f_1 (thrust [N]).  `UNITS` and `unit` know them.

    A family that means nothing at rest says so by an attribute `valid_at_rest = False`.
    """

    states: ClassVar[tuple[str, ...]]
    """Names of the states; the first six are `STATES`."""

    @property
    def controls(self) -> tuple[str, ...]:
        """Names of the controls."""
        ...

    def derivative(
        self, state: tuple[Scalar, ...], control: tuple[Scalar, ...], environment: Environment
    ) -> tuple[Scalar, ...]:
        """Time derivative of `state` [SI/s] under the actual controls and the environment."""
        ...


@runtime_checkable
class Sampled(Protocol):
    """A model in discrete time.

    Attributes:
        dt: sample time [s]; the model runs at no other.
        memory: names of what it remembers (lagged values, network memory).

    Its `derivative` is the kinematics with held velocities; `advance` gives what changes them.
    """

    @property
    def dt(self) -> float:
        """Sample time [s]."""
        ...

    @property
    def memory(self) -> tuple[str, ...]:
        """Names of what it remembers."""
        ...

    def begin(self, state: tuple[Scalar, ...], control: tuple[Scalar, ...]) -> tuple[Scalar, ...]:
        """Memory as if the ship had been in this state, under these controls, for ever."""
        ...

    def advance(
        self, state: tuple[Scalar, ...], control: tuple[Scalar, ...], environment: Environment,
        memory: tuple[Scalar, ...],
    ) -> tuple[tuple[Scalar, ...], tuple[Scalar, ...]]:  # fmt: skip
        """Rates of (u, v_m, r) that hold until the next sample, and the memory of the next sample."""
        ...


@runtime_checkable
class Stepped(Sampled, Protocol):
    """A model in discrete time that no trace can follow; what differentiates a ship refuses it."""

    @property
    def needed(self) -> tuple[str, ...]:
        """Channels that a trial must have besides states and controls."""
        ...

    @property
    def look_back(self) -> int:
        """Samples before a start that its memory depends on."""
        ...

    def recall(self, state: Array, acting: Array) -> tuple[float, ...]:
        """Memory after the measured samples before a start: (samples, 6) and controls with environment."""
        ...

    def plant(self, memory: Array) -> Plant:
        """The model under way from what each lane remembers (lanes, memory); acting: controls, environment."""
        ...


def unit(name: str) -> str:
    """SI unit of a state or control by its name; "-" where none follows from it."""
    return UNITS.get(name) or _PREFIXES.get(name.removesuffix("_cmd").partition("_")[0], "-")


def follows(model: Model) -> tuple[tuple[str, float], ...]:
    """For each control of `model`, the conventional order it obeys (n_P or delta) and its factor.

    A control that obeys none is its own order.  A model says otherwise by an attribute `follows`.
    """
    given = getattr(model, "follows", None)
    return tuple((name, 1.0) for name in model.controls) if given is None else given


def kinematics(psi: Scalar, u: Scalar, v_m: Scalar, r: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """Rates of x, y [m/s] and psi [rad/s] of a ship moving over ground with u, v_m, r."""
    north, east = to_earth(u, v_m, cos(psi), sin(psi))
    return north, east, r
