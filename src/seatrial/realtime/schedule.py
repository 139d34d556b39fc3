"""A schedule that does not drift: tick k is due at its own time, however late the ones before it were."""

from __future__ import annotations

import math
import time
from typing import Protocol

from ..core.errors import LoopError as LoopError

SLOWEST, FASTEST = 0.1, 100.0
"""Time factors between which a schedule is kept; beyond is only as fast as possible (infinite)."""


class Clock(Protocol):
    """Tells time and waits."""

    def now(self) -> float:
        """Time on a clock that never goes back [s]."""
        ...

    def sleep(self, seconds: float) -> None:
        """Wait."""
        ...


class WallClock:
    """The clock of the machine."""

    def now(self) -> float:
        """Time on a clock that never goes back [s]."""
        return time.perf_counter()

    def sleep(self, seconds: float) -> None:
        """Wait."""
        time.sleep(seconds)


class Schedule:
    """When the next tick is due, and how far behind the ticks have been.

    Late ticks are caught up with, all of them; only where the machine stood still for longer than `patience`, or the
    ships were taken to another time, the schedule begins anew, and what it gave up is told in `slipped`.

    Attributes:
        factor: simulated time over time on the clock; infinite is as fast as possible.
        period: time between two ticks [s on the clock].
        ticks: ticks counted since the start.
        overruns: ticks that began later than one period after they were due.
        worst: the latest beginning of a tick after it was due [s].
        late: that of the last tick [s].
        slipped: time given up altogether [s].
    """

    def __init__(self, rate: float, factor: float, clock: Clock, patience: float = 10.0) -> None:
        self._clock, self._rate, self._patience = clock, rate, patience
        self.ticks = self.overruns = 0
        self.worst = self.late = self.slipped = 0.0
        self._origin, self._since, self.period = 0.0, 0, 0.0
        self._held: float | None = None
        self.pace(factor)

    def pace(self, factor: float) -> None:
        """Go on with another time factor from now; as far from the next tick in simulated time as before.

        Raises:
            LoopError: not between 0.1 and 100, nor infinite.
        """
        if not (SLOWEST <= factor <= FASTEST or factor == math.inf):
            raise LoopError(f"time factor {factor:g}; give {SLOWEST:g} to {FASTEST:g}, or inf for the fastest")
        ticks = self.left() / self.period if self.period else 0.0
        self.factor, self.period = factor, 1.0 / (self._rate * factor)
        self._due_in(ticks * self.period)

    def hold(self) -> None:
        """Let time stand still; while there is a pause, or nobody runs."""
        if self._held is None:
            self._held = self.left()

    def release(self) -> None:
        """Go on, as far from the next tick as when it was held."""
        if self._held is not None:
            held, self._held = self._held, None
            self._due_in(held)

    def left(self) -> float:
        """Time until the next tick is due [s]; below zero where it is late."""
        if self._held is not None:
            return self._held
        if math.isinf(self.factor):
            return 0.0
        return self._origin + self._since * self.period - self._clock.now()

    def give_up(self) -> float:
        """Catch up with nothing that is late by more than a period; gives back the time given up, if any [s]."""
        late = -self.left()
        if late <= self.period:
            return 0.0
        self.slipped += late
        self._due_in(0.0)
        return late

    def begin(self) -> float:
        """Count a tick that begins now; gives back the time given up, if any [s]."""
        self.late = max(-self.left(), 0.0)
        self.ticks += 1
        self.worst = max(self.worst, self.late)
        if self.late > self.period > 0.0:
            self.overruns += 1
        given_up = self.give_up() if self.late > self._patience else 0.0
        self._since += 1
        return given_up

    def _due_in(self, seconds: float) -> None:
        """Let the next tick be due so much later than now."""
        if self._held is not None:
            self._held = seconds
        self._origin, self._since = self._clock.now() + seconds, 0
