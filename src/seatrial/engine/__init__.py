"""The engine: a system traced once, run over many lanes at once.

One lane is one ship, one trial window or one candidate.  A `System` is plain Python over scalars
(see `symbolic`); `rollout` integrates it over all lanes, `sensitivities` with the exact derivatives
of every state with respect to chosen parameters and the initial state.  Two back ends give the
same numbers: a SIMD kernel printed as C (`simd`), and CasADi's virtual machine where no compiler
or no vector mathematics is at hand (`virtual`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.errors import SimulationError as SimulationError
from ..core.parameters import Scalar
from ..core.values import dataclass

if TYPE_CHECKING:
    from .field import Field

Array = NDArray[np.float64]
Scalars = tuple[Scalar, ...]
Derivative = Callable[[Scalars, Scalars, Scalars], Scalars]
Before = Callable[[Scalar, Scalar, Scalars, Scalars, Scalars, Scalars], tuple[Scalars, Scalars, Scalars]]


class EngineNotice(UserWarning):
    """Warning, once, that the engine runs on its slower back end, with the reason."""


class Untraced(Protocol):
    """What moves a ship where no trace can follow (a network of many weights): all lanes at once, on arrays."""

    def rates(self, state: Array, acting: Array) -> Array:
        """Rates (lanes, states) that hold over the next step; called once a step, as it remembers.

        Args:
            state: shape (lanes, states).
            acting: shape (lanes, acting).
        """
        ...


@dataclass(frozen=True)
class Kicks:
    """Impulses before and after each step of the motion, for forces too stiff for its integrator (contact).

    Where the field has nothing near on any lane of a block they are left out: there they must not change a bit.

    An impulse changes velocities only, so that what is touched at the end of a step is touched at the beginning of the
    next: `touch`, the larger part of the work, is done once a step.

    Attributes:
        touch: (state, acting) -> what is touched: a function of the pose and of what is near.
        first: (h, state, rates, acting, touched, parameters) -> (state and what is kept): the impulse before a step of
            `h` [s].
        last: (h, state, kept, acting, touched, parameters) -> state: the one after it.
        touched: how many values `touch` gives.
        substeps: steps of the motion in a time step.
    """

    touch: Callable[[Scalars, Scalars], Scalars]
    first: Callable[[Scalar, Scalars, Scalars, Scalars, Scalars, Scalars], Scalars]
    last: Callable[[Scalar, Scalars, Scalar, Scalars, Scalars, Scalars], Scalars]
    touched: int
    substeps: int = 1


@dataclass(frozen=True)
class System:
    """Everything that is integrated together: plant, actuators, policy.

    Attributes:
        states: names of the continuous states.
        memory: names of what changes once per step (actuators, a policy's memory).
        series: names of the inputs that are given per step and lane (controls, environment).
        acting: names of what `before` hands to `derivative` for the step.
        logged: names of further values that `before` wants stored (orders).
        parameters: names of the parameters.
        derivative: (state, acting, parameters) -> rates.
        before: (t, dt, state, memory, series, parameters) -> (acting, memory after, logged);
            None where the series themselves act.
        hidden: names of what the plant remembers, handed in behind the memory and not stored.
        plant: hidden values (lanes, hidden) -> what moves the ship, in place of `derivative` and by Euler's
            rule, as its rates hold over a step; None for whatever can be traced.
        field: gives the last series at the place of the ship; the others are given from outside.
        kicks: impulses of contact at the things near that the field gives; they need `before` and a field.
    """

    states: tuple[str, ...]
    series: tuple[str, ...]
    parameters: tuple[str, ...]
    derivative: Derivative
    memory: tuple[str, ...] = ()
    acting: tuple[str, ...] = ()
    logged: tuple[str, ...] = ()
    before: Before | None = None
    hidden: tuple[str, ...] = ()
    plant: Callable[[Array], Untraced] | None = None
    field: Field | None = None
    kicks: Kicks | None = None

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the series that are given from outside."""
        looked = len(self.field.names) + len(self.field.near) if self.field else 0
        return self.series[: len(self.series) - looked]

    @property
    def stored(self) -> tuple[str, ...]:
        """Names of the columns of a rollout: states, memory, logged."""
        return self.states + self.memory + self.logged


@dataclass(frozen=True)
class Failure:
    """A lane that left the finite or the valid, and where."""

    lane: int
    time: float
    state: str
    value: float

    def __str__(self) -> str:
        return f"lane {self.lane}: {self.state} = {self.value:.6g} at t = {self.time:.6g} s"


@dataclass(frozen=True)
class Rollout:
    """What a run over lanes gives back.

    Attributes:
        t: times of the stored rows [s], shape (rows,).
        values: shape (lanes, rows, len(system.stored)).
        failures: lanes that blew up or left the validity range; their rows after that are NaN.
    """

    t: Array
    values: Array
    failures: tuple[Failure, ...] = ()
