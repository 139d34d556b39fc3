"""Manoeuvres: the policy that steers and the figures read off the run, in one class.

A policy is a frozen dataclass whose numbers are declared with `spec` (so a campaign can vary them
lane by lane).  `command` is element-wise like physics and keeps its memory in a tuple that is
handed through, so ship + actuators + environment + policy compile into one step.

To add a manoeuvre, write a module here: the command line finds every `Manoeuvre` with a `kind`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from numbers import Real
from typing import Any, ClassVar, Protocol, Self, runtime_checkable

import numpy as np

from ..core.parameters import ParameterError, Scalar, Scalars, possible, spec
from ..core.values import dataclass, field, fields, replace
from ..data import Array, Trial
from ..forces import HARD_OVER
from ..models import STEERING

__all__ = ["Given", "Index", "Manoeuvre", "Policy", "Scheduled", "Settings", "decimals"]

# Slower than this [m/s] a ship gives no sensible L/U.
_SLOWEST = 1e-3


@dataclass(frozen=True)
class Index:
    """One figure read off a run: value, unit, and for lengths the value in ship lengths.

    Attributes:
        helm: power of the rudder angle in it: 1 of an angle of the rudder, -1 of what it gives per radian.
        resolution: how finely the run determines it, in its unit; 0 where no step of the manoeuvre limits it.
    """

    value: float
    unit: str
    over_L: float | None = None
    helm: int = 0
    resolution: float = 0.0


def decimals(resolution: float) -> int:
    """Decimals that are worth printing of a figure known this finely: a tenth of it."""
    return max(0, 1 - math.floor(math.log10(resolution) + 1e-9))


def by_demand(indices: Mapping[str, Index]) -> dict[str, Index]:
    """The figures of a craft without rudder: its helm in percent of `HARD_OVER`, and called so."""
    out: dict[str, Index] = {}
    for name, index in indices.items():
        if index.helm:
            share = (100.0 / HARD_OVER) ** index.helm
            unit = {("rad", 1): "%", ("s", 1): "% s/rad", ("-", -1): "rad/%"}.get((index.unit, index.helm), index.unit)
            demand = replace(index, value=share * index.value, unit=unit, resolution=share * index.resolution)
            out[name.replace("rudder", "steer")] = demand
        else:
            out[name] = index
    return out


@dataclass(frozen=True)
class Settings:
    """Settings of a user for a manoeuvre, and data of the ship; SI and radians.

    Attributes:
        n_P, speed: revolutions [1/s] and speed [m/s] of the approach.
        L_pp: length of the ship [m].
        rudder_limit: greatest rudder angle, or helm of a craft without rudder [rad]; infinite without a limit.
        rudder, heading: magnitudes [rad]; None takes the manoeuvre's own.
        side: +1 starboard, -1 port.
        seed: of a random manoeuvre.
        astern: whether the ship's file holds for going astern.
        controls: greatest value of each control of the ship by name, 0 where it has no limit.
    """

    n_P: float
    speed: float
    L_pp: float
    rudder_limit: float
    rudder: float | None = None
    heading: float | None = None
    side: float = 1.0
    seed: int = 1
    astern: bool = True
    controls: Mapping[str, float] = field(default_factory=dict[str, float])

    def rudder_or(self, usual: float) -> float:
        """The rudder of the user, else the usual one within the limit of the ship [rad]."""
        return min(usual, self.rudder_limit) if self.rudder is None else self.rudder

    @property
    def clock(self) -> float:
        """L/U of the approach [s]."""
        return self.L_pp / max(self.speed, _SLOWEST)

    def heading_or(self, usual: float) -> float:
        """The heading change of the user, else the usual one [rad]."""
        return usual if self.heading is None else self.heading


class Policy(ABC):
    """What steers the ship, once per time step: the base of every policy and manoeuvre."""

    kind: ClassVar[str] = ""
    """Name in trial files; empty for that of the class."""

    memory: ClassVar[tuple[str, ...]] = ()
    """Names of what it remembers between steps."""

    from_rest: ClassVar[bool] = False
    """Whether a run begins with the ship at rest."""

    by_engine: ClassVar[bool] = False
    """Whether it needs an engine that obeys orders."""

    timed: ClassVar[bool] = False
    """Whether the clock alone ends it, so that a run of any length is complete."""

    @property
    def orders(self) -> tuple[str, ...]:
        """What `command` orders, by default (n_P [1/s], delta [rad]).

        Each control of the ship takes the order that `Model.follows` gives, and rests where it is not ordered.
        """
        return STEERING

    def begin(self, state: Scalars) -> Scalars:
        """Memory at the execute point, from the initial (x, y, psi, u, v_m, r)."""
        return ()

    @abstractmethod
    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        """Orders for the actuators, as `orders` names them, and the memory of the next step."""


@runtime_checkable
class Scheduled(Protocol):
    """A policy that is handed values per step, fixed beforehand (random orders, recorded commands).

    Its `command(t, state, memory, given)` gets them as a fourth argument.
    """

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the values."""
        ...

    def schedule(self, dt: float, steps: int) -> Array:
        """The values per step, shape (steps, len(given)); the same at every call."""
        ...


class Manoeuvre(Policy):
    """A policy with a purpose: it determines when it is over and which figures it yields.

    Its `kind` is the name on the command line.  Its numbers are checked as it is made.

    Raises:
        ParameterError: a number outside the range of its `spec`, such as an angle in degrees, or an angle that is NaN.
    """

    takes: ClassVar[tuple[str, ...]] = ()
    """Which of rudder, heading, side, seed a user can set."""

    def __post_init__(self) -> None:
        mine: Any = self
        for f in fields(mine):
            value, meaning = vars(self)[f.name], f.metadata.get("spec")
            # The default may lie outside the range: no limit.
            if meaning is None or not isinstance(value, Real) or value == f.default:
                continue
            if meaning.unit == "rad" and math.isnan(value):
                raise ParameterError(f"{f.name} is nan; it is an angle in rad")
            possible({f.name: meaning}, {f.name: value})

    @classmethod
    @abstractmethod
    def ordered(cls, settings: Settings) -> Self:
        """The manoeuvre for the settings of a user."""

    @abstractmethod
    def complete(self, trial: Trial) -> bool:
        """Whether the run holds all that the indices need."""

    @abstractmethod
    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Figures of the run by their standard names, SI units and radians; those that it does not reach are left out.

        Raises:
            DataError: a channel that they need is absent, or the rudder never leaves its initial angle.
        """


@dataclass(frozen=True)
class Given(Policy):
    """A policy that passes on the orders given to each step from outside, one for each name in `given`."""

    given: tuple[str, ...] = ()

    @property
    def orders(self) -> tuple[str, ...]:
        """What it orders: what it is given."""
        return self.given

    def command(self, t: Scalar, state: Scalars, memory: Scalars, given: Scalars = ()) -> tuple[Scalars, Scalars]:
        return given, memory

    def schedule(self, dt: float, steps: int) -> Array:
        """Nothing fixed beforehand; shape (steps, orders)."""
        return np.zeros((steps, len(self.given)))


@dataclass(frozen=True)
class Helm(Given):
    """A policy whose orders are set from outside at each step, one for each control."""

    n_P: Scalar = spec("1/s", "revolutions at the start", default=0.0)
