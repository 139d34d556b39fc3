"""One cause, one alarm: which of the faults that were named together are needed to explain the rows.

A fault that was named before the evidence was whole, or that the true cause made look like one, is a consequence.  The
rows since before all of them are taken in again with each set of faults; a set is as good as the readings are likely
under it.  A reading that a fault takes out counts as one that is as far off as expected, so that leaving out what was
right does not pay.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

import numpy as np

from ....core.values import dataclass, field
from ....data import Array
from ....identify.filters.augmented import SLOW
from ..follow import Follower, Machine, Step
from .acting import Override
from .alarms import FROZEN, STEERING, Alarm
from .suspects import CARRIED, GROWS, IMPULSE, LEVER, LOST, MISREAD, OF_CONTROL, OF_SENSOR, SCALED, comes, walking

CASE = 240.0
"""Faults that are named within this time may have one cause [s]."""

# Water and forces that change so often within a case are those of another ship: they come and go with its turns.
_CHANGES = 3
# No more rows than this are kept; estimates to begin from stand so many rows apart.
_ROWS, _APART = 1200, 5
# A fault that makes the rows less likely by so much less, as twice a logarithm, is not needed.
_NEEDED = 15.0
# A reading counts as so many squared standard deviations at most.
_MOST = 36.0


@dataclass(frozen=True)
class Kept:
    """A row as it came in, to be taken in again once a fault is known.

    Attributes:
        t: time [s].
        acting: controls and environment since the row before.
        readings: by channel.
    """

    t: float
    acting: Array
    readings: Array


def acted(controls: Sequence[str], row: Kept, overrides: Mapping[str, Override], span: float) -> Array:
    """Controls as they are believed to act in a row, which lasts `span` seconds."""
    if not overrides:
        return row.acting
    out = row.acting.copy()
    for name, one in overrides.items():
        k = controls.index(name)
        out[k] = one.acts(float(row.acting[k]), span)
    return out


def override_of(alarm: Alarm) -> Override:
    """What a control does in place of what the log says."""
    now = {LOST: min(alarm.size[0], 1.0), MISREAD: alarm.size[0], SCALED: alarm.size[0]} if alarm.size else {}
    return Override(alarm.how, now.get(alarm.how, alarm.held), alarm.rate)


def masks(machine: Machine, alarm: Alarm) -> list[int]:
    """Channels that are not believed while an alarm lasts."""
    sensor = alarm.how in OF_SENSOR or alarm.how == FROZEN
    return [machine.channels.index(name) for name in alarm.what if sensor and name in machine.channels]


def opening(machine: Machine, alarm: Alarm) -> tuple[tuple[str, ...], Array]:
    """States that are less certain from the onset of an alarm on, and by how much."""
    start = machine.settings.start
    if alarm.how in OF_CONTROL:  # nor is it known how much exactly is left of its effect
        some = tuple(name for name in SLOW if name in machine.names)
        return some, np.array([3.0 * start[name] for name in some])
    if alarm.how in (IMPULSE, LEVER):
        return alarm.what, np.abs(np.array(alarm.size)) + 1e-12
    if not alarm.how:
        known = tuple(name for name in start if name not in machine.settings.free)
        return known, 3.0 * np.array([start[name] for name in known])
    return (), np.zeros(0)


def growing(alarms: Iterable[Alarm], follower: Follower, t: float) -> Follower:
    """The estimate with the walk of what has begun to grow and still may, up to a row."""
    until = follower.t - comes(follower.machine.ship)
    for one in alarms:
        if one.how in (GROWS, CARRIED) and not one.of and until < one.since < t:
            follower = walking(follower, one.how, (one.what, one.size), t)
    return follower


@dataclass
class History:
    """Rows of the last minutes and estimates among them, which no alarm clears."""

    rows: deque[Kept] = field(default_factory=deque[Kept])
    marks: deque[Follower] = field(default_factory=deque[Follower])
    count: int = 0

    def note(self, row: Kept, before: Follower) -> None:
        """Keep a row, and now and then the estimate before it."""
        if not self.marks or self.count % _APART == 0:
            self.marks.append(before)
        self.count += 1
        self.rows.append(row)
        while row.t - self.rows[0].t > 1.5 * CASE or len(self.rows) > _ROWS:
            self.rows.popleft()
        while len(self.marks) > 1 and self.marks[1].t < self.rows[0].t:
            self.marks.popleft()

    def clear(self) -> None:
        """Forget all: the motion began anew."""
        self.rows.clear()
        self.marks.clear()

    def start(self, since: float) -> Follower | None:
        """The last estimate that knows nothing of what set in then."""
        return next((one for one in reversed(self.marks) if one.t <= since), None)


@dataclass(frozen=True)
class Verdict:
    """What is left of alarms that were named together.

    Attributes:
        causes, consequences: those that are needed, and the others.
        follower: the estimate after the last row under the causes.
    """

    causes: tuple[Alarm, ...]
    consequences: tuple[Alarm, ...]
    follower: Follower


def judged(history: History, alarms: Sequence[Alarm]) -> Verdict | None:
    """Which alarms are needed, the earliest tried first; None where no estimate is from before them."""
    start = history.start(min(one.since for one in alarms))
    if start is None or not history.rows:
        return None
    needed = list(alarms)
    best, follower = _again(history, start, needed)
    for one in alarms if len(alarms) > 1 else ():
        fewer = [other for other in needed if other is not one]
        if not fewer:
            break
        score, without = _again(history, start, fewer)
        if score < best + _NEEDED:
            needed, best, follower = fewer, score, without
    return Verdict(tuple(needed), tuple(one for one in alarms if one not in needed), follower)


def _again(history: History, start: Follower, alarms: Sequence[Alarm]) -> tuple[float, Follower]:
    """How unlikely the rows are if these faults set in when they are said to, and the estimate at the end."""
    machine, follower, total = start.machine, start, 0.0
    waiting, masked, overrides = sorted(alarms, key=lambda one: one.since), set[int](), dict[str, Override]()
    for row in history.rows:
        if row.t <= start.t + 1e-9:
            continue
        while waiting and waiting[0].since < row.t:
            one = waiting.pop(0)
            masked |= set(masks(machine, one))
            if one.how in OF_CONTROL:
                overrides[one.what[0]] = override_of(one)
            names, size = opening(machine, one)
            follower = follower.opened(names, size) if names else follower
        acting = acted(machine.ship.model.controls, row, overrides, row.t - follower.t)
        follower = growing(alarms, follower, row.t)
        follower, step = follower.row(row.t, acting, row.readings, masked)
        total += _unlikely(step, masked)
    return total, follower


def _unlikely(step: Step, masked: Collection[int]) -> float:
    """Minus twice the logarithm of the density of a row's readings, each by itself."""
    variance = np.diagonal(step.spread)
    off = np.minimum(step.innovation**2 / variance, _MOST)
    off = np.where(np.isin(step.rows, list(masked)), 1.0, off)
    return float((off + np.log(variance)).sum())


def together(alarms: Sequence[Alarm], t: float, but: Callable[[Alarm], bool]) -> list[Alarm]:
    """Alarms of the last minutes that are causes so far and may not be."""
    return [one for one in alarms if one.named > t - CASE and not one.of and one.how != STEERING and not but(one)]


def restless(alarms: Sequence[Alarm], t: float) -> bool:
    """Whether water and forces have changed more often of late than they do, so that the model is wrong."""
    return sum(one.how in (IMPULSE, GROWS, CARRIED) and one.named > t - CASE for one in alarms) >= _CHANGES
