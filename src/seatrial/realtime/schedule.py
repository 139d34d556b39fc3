"""A schedule that does not drift: tick k is due at its own time, however late the ones before it were."""

from __future__ import annotations

import math
import time
from typing import Protocol

SLOWEST, FASTEST = 0.1, 100.0
"""Time factors between which a schedule is kept; beyond is only as fast as possible (infinite)."""


class LoopError(ValueError):
    """A loop that cannot run as asked; the text says what would be right."""


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

    Late ticks are caught up with, all of them; only where the machine stood still for longer than `patience`
    the schedule begins anew, and the time it gave up is told in `slipped`.

    Attributes:
        factor: simulated time over time on the clock; infinite is as fast as possible.
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
        self.pace(factor)

    def pace(self, factor: float) -> None:
        """Go on with another time factor from now.

        Raises:
            LoopError: not between 0.1 and 100, nor infinite.
        """
        if not (SLOWEST <= factor <= FASTEST or factor == math.inf):
            raise LoopError(f"time factor {factor:g}; give {SLOWEST:g} to {FASTEST:g}, or infinite for the fastest")
        self.factor, self.period = factor, 1.0 / (self._rate * factor)
        self.anchor()

    def anchor(self) -> None:
        """Let the next tick be due now; after a pause."""
        self._origin, self._since = self._clock.now(), 0

    def left(self) -> float:
        """Time until the next tick is due [s]; below zero where it is late."""
        if math.isinf(self.factor):
            return 0.0
        return self._origin + self._since * self.period - self._clock.now()

    def begin(self) -> float:
        """Count a tick that begins now; gives back the time given up, if any [s]."""
        self.late = max(-self.left(), 0.0)
        self.ticks += 1
        self.worst = max(self.worst, self.late)
        if self.late > self.period > 0.0:
            self.overruns += 1
        given_up = 0.0
        if self.late > self._patience:
            given_up = self.late
            self.slipped += given_up
            self.anchor()
        self._since += 1
        return given_up
