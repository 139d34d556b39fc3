"""Tallies: manoeuvres that read their own indices step by step, inside the compiled loop.

The indices of a stored run are read afterwards, in Python, some 0.3 ms a run; a kernel sails it in 10 us.  A `Tally` is
a manoeuvre whose memory also holds what its indices need (moments, peaks, the way so far), so that of each run one row
leaves the kernel.  It agrees with the manoeuvre's own `indices` of the stored run (a test of every tally), but for the
figures that need the whole run, which it leaves out.

To add one, write a module here: `tally_of` finds every `Tally` of the folder by the manoeuvre that it extends.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from abc import abstractmethod
from collections.abc import Mapping
from functools import cache
from typing import Any, ClassVar

import numpy as np

from ...core.parameters import Scalar, Scalars, spec
from ...core.symbolic import both, cos, negated, root, sin, where
from ...core.values import dataclass
from ...data import Array
from ...manoeuvres import Manoeuvre
from ...models import STATES

NEVER = -1.0
"""Time of what has not happened yet [s]."""

Truth = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

Bounds = tuple[tuple[int, float, float], ...]
"""Closed interval of states by number, within which a run is valid."""

# Beyond these a velocity [m/s, rad/s] has blown up, also where a ship file gives no validity.
_ABSURD = 1e6


@dataclass(frozen=True)
class Tally(Manoeuvre):
    """A manoeuvre with a memory of what its indices need.

    Attributes:
        current_x, current_y: velocity of the water [m/s]; validity is judged by the velocity through the water.
        dt: time step [s].
        bounds: range of validity of the states; a run outside it is over, and its tally stays as it was.
        flowing: whether there is a current.
    """

    figures: ClassVar[Mapping[str, str]] = {}
    """Unit of each index that it reads."""

    noted: ClassVar[tuple[str, ...]] = ()
    """Names of the memory beyond the manoeuvre's own; a class's `memory` is the manoeuvre's, "failed", and these."""

    current_x: Scalar = spec("m/s", "velocity of the water to the north", default=0.0)
    current_y: Scalar = spec("m/s", "velocity of the water to the east", default=0.0)
    dt: float = 0.0
    bounds: Bounds = ()
    flowing: bool = False

    @abstractmethod
    def first(self, state: Scalars) -> Scalars:
        """`noted` before the first step, from the initial state."""

    @abstractmethod
    def note(
        self, t: Scalar, state: Scalars, turned: tuple[Scalars, Scalars], noted: Scalars, valid: Scalar
    ) -> Scalars:
        """`noted` after this sample.

        Args:
            turned: the manoeuvre's own memory before and after this sample.
            valid: whether the run has been within its bounds up to this sample; else the figures stay as they are.
        """

    @abstractmethod
    def read(self, noted: Mapping[str, Array], varied: Mapping[str, Array]) -> Mapping[str, Array]:
        """The indices of `figures` per run, NaN where a run did not reach one.

        Args:
            noted: final value of each of `noted` per run, shape (runs,).
            varied: the manoeuvre's own numbers that differ from run to run, shape (runs,).
        """

    @abstractmethod
    def finished(self, noted: Mapping[str, Array], varied: Mapping[str, Array]) -> Truth:
        """Whether each run holds all that the indices need, as `Manoeuvre.complete`."""

    def begin(self, state: Scalars) -> Scalars:
        return (*super().begin(state), NEVER, *self.first(state))

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        own = len(self.memory) - len(self.noted) - 1
        orders, after = super().command(t, state, memory[:own])  # type: ignore[safe-super]
        over, noted = memory[own], memory[own + 1 :]
        valid = both(over < 0, self._within(state))
        over = where(both(over < 0, negated(valid)), t, over)
        return orders, (*after, over, *self.note(t, state, (memory[:own], after), noted, valid))

    def _within(self, state: Scalars) -> Scalar:
        """Whether the state is finite and inside its range of validity."""
        u, v_m = state[3], state[4]
        if self.flowing:
            c, s = cos(state[2]), sin(state[2])
            u = u - self.current_x * c - self.current_y * s
            v_m = v_m - self.current_y * c + self.current_x * s
        values = (*state[:3], u, v_m, *state[5:])
        given = {k: (low, high) for k, low, high in self.bounds}
        inside: Scalar = True
        for k in sorted({3, 4, 5, *given}):
            low, high = given.get(k, (-_ABSURD, _ABSURD))
            inside = both(inside, both(values[k] >= low, values[k] <= high))
        return inside


def way(x: Scalar, y: Scalar, state: Scalars) -> Scalar:
    """Length of the chord from the last sample to this one [m]."""
    return root((state[0] - x) * (state[0] - x) + (state[1] - y) * (state[1] - y))


def passed(open_: Scalar, before: Scalar, now: Scalar, level: Scalar) -> tuple[Scalar, Scalar]:
    """Whether a rising value comes up to a level at this sample for the first time, and where between the samples.

    Args:
        open_: whether it has not come up before.
    """
    fresh = both(open_, now >= level)
    return fresh, (level - before) / where(fresh, now - before, 1.0)


@cache
def _tallies() -> dict[type[Manoeuvre], type[Tally]]:
    found: dict[type[Manoeuvre], type[Tally]] = {}
    for module in pkgutil.iter_modules(__path__, f"{__name__}."):
        members: list[tuple[str, Any]] = inspect.getmembers(importlib.import_module(module.name), inspect.isclass)
        found |= {cls.__bases__[-1]: cls for _, cls in members
                  if cls.__module__ == module.name and issubclass(cls, Tally) and cls.memory}  # fmt: skip
    return found


def tally_of(policy: Manoeuvre, dt: float, validity: Mapping[str, tuple[float, float]], flowing: bool) -> Tally | None:
    """The tally of a manoeuvre for runs with steps of `dt` [s]; None where there is none."""
    cls = _tallies().get(type(policy))
    if cls is None:
        return None
    bounds = tuple((STATES.index(name), *validity[name]) for name in STATES if name in validity)
    return cls(**vars(policy), dt=dt, bounds=bounds, flowing=flowing)
