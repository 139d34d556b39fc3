"""The human-like random manoeuvre: somebody at the sticks orders rudder and revolutions at whim.

Wakita 2022 section 3 had a man with a game controller seek every combination of state and input
that a berthing meets, revolutions ahead and astern, regardless of what the ship did.  Their histogram
(Fig. 3) is even but for heaps at zero and at both limits.  Here a seeded hand does the same: each
stick is left alone for a random time, then moved, at the pace of a hand, to a new place.
"""

from __future__ import annotations

import math
from typing import ClassVar, Self

import numpy as np

from ..core.parameters import Scalar, Scalars, spec
from ..core.symbolic import larger, smaller
from ..core.values import dataclass
from ..data import Array
from . import Settings
from .pseudo_random import Excitation

# Shares of the moves that end at zero and at a limit, after the heaps of Wakita 2022 Fig. 3.
_ZERO, _LIMIT = 0.15, 0.2
# A place lasts so many L/U on the mean; a stick takes so many L/U from end to end.
_HOLD, _TRAVEL = 1.0, 0.2
_LENGTH = 100.0


@dataclass(frozen=True)
class HumanRandom(Excitation):
    """Random rudder and revolutions, each stick on its own, from the run's seed.

    Attributes:
        hold: mean time that a stick is left alone [s].
        travel: time that a stick takes from one limit to the other [s].
        length: time after which the run counts as complete [s].
        seed: of both sticks.
    """

    kind: ClassVar[str] = "random"
    takes: ClassVar[tuple[str, ...]] = ("rudder", "side", "seed")
    given: ClassVar[tuple[str, ...]] = ("rudder_level", "revolution_level")

    n_P: Scalar = spec("1/s", "greatest propeller revolutions ahead")
    delta: Scalar = spec("rad", "greatest rudder angle; a negative one mirrors the run", (-math.pi, math.pi))
    astern: Scalar = spec("-", "greatest revolutions astern over those ahead", (0.0, 10.0), default=1.0)
    hold: float = 10.0
    travel: float = 2.0
    length: float = 600.0
    seed: int = 1

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """Up to 35 deg of rudder, the approach's revolutions ahead and (where the ship's file holds) astern."""
        delta, unit = settings.side * settings.rudder_or(math.radians(35.0)), settings.clock
        astern = 1.0 if settings.astern else 0.0
        return cls(settings.n_P, delta, astern, _HOLD * unit, _TRAVEL * unit, _LENGTH * unit, settings.seed)

    def schedule(self, dt: float, steps: int) -> Array:
        """Places of the sticks in [-1, 1] per step, shape (steps, 2); the same at every call.

        The sticks begin as in the approach: rudder amidships, revolutions full ahead.
        """
        t = dt * np.arange(steps)
        end = float(t[-1]) if steps else 0.0
        return np.column_stack([
            np.interp(t, *self._places(stick, first, end)) for stick, first in enumerate((0.0, 1.0))
        ])  # fmt: skip

    def _places(self, stick: int, first: float, end: float) -> tuple[list[float], list[float]]:
        """Corners (time [s], place) of one stick's path, up to `end`; a longer run begins like a shorter one."""
        rng = np.random.default_rng([self.seed, stick])
        times, places = [0.0], [first]
        while times[-1] <= end:
            wait, which, place = rng.gamma(2.0, 0.5 * self.hold), rng.uniform(), rng.uniform(-1.0, 1.0)
            goal = 0.0 if which < _ZERO else math.copysign(1.0, place) if which < _ZERO + _LIMIT else place
            leave = times[-1] + wait
            times += [leave, leave + max(0.5 * self.travel * abs(goal - places[-1]), 1e-9 * self.travel)]
            places += [places[-1], goal]
        return times, places

    def command(
        self, t: Scalar, state: Scalars, memory: Scalars, given: Scalars = (0.0, 0.0)
    ) -> tuple[Scalars, Scalars]:
        """Revolutions [1/s] and rudder [rad] where the sticks are."""
        rudder, lever = given
        return (self.n_P * (larger(lever, 0.0) + self.astern * smaller(lever, 0.0)), self.delta * rudder), memory
