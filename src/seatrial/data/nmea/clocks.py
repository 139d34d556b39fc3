"""When each reading of a log was taken: by the clock of its own fix, by the stamps of the logger, or between fixes.

A receiver tells one fix in several sentences, each with the time of the fix: these are one epoch, whatever stands
between them.  Sentences without a clock have the stamp of their line, moved by what the stamps are off the receiver's
clock; without stamps, those of one source between two fixes are spread evenly over them.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...core.errors import TrackError
from ...core.values import dataclass
from .. import Array, DataError
from .digits import Places
from .sources import Series
from .stamping import unwrapped_days

PIECES = 1 << 16
"""Sentences of a line at most; a place in a log is the number of the line times this, and which of them it is."""

_DAY = 86400.0
ROLL = 1024 * 7 * _DAY
"""After so many seconds a receiver that does not know better begins to count the weeks of GPS anew."""
_ONCE = 0.5
"""A stamp counts where less than this share of the readings of each source come at the stamp of the one before."""
_OFTEN = 0.9
"""A clock that is told so often as the most frequent one, as a part of that, may be the one of the log."""
_OFF, _SPREAD = 0.5, 0.5
"""Stamps that are off the receiver's clock by more [s], or that scatter about it by more, are told."""
_SLOW = 0.5
_BACK = 1.0
"""Stamps may go back by so much from one line of a source to the next [s]: lines are written as they come."""
_LONG = 60.0
"""A piece of a log is a trial where it is at least so long [s]."""
_MANY = 50
"""Pieces of a log at most."""
_AHEAD = 10.0
"""A clock without a fix is believed where it goes on to that of the fix within so many seconds or of its steps."""
_LATE, _OTHER = 0.05, 5.0
"""A clock that tells a time which another one told before is late by as much [s]; by more it is another clock."""
_NO_CLOCK = ("ZDA",)
"""Its time is that of a pulse or of sending, and not of a fix: it serves where no fix has a clock."""


@dataclass(frozen=True)
class Spoken:
    """What one source tells by one set of names.

    Attributes:
        source: talker and kind.
        names: of the readings, as `readings.readings` has them.
        place: in the log, rising, see `PIECES`.
        values: names by places.
        stamp: of the lines [s]; NaN where one has none.
    """

    source: str
    names: tuple[str, ...]
    place: Places
    values: Array
    stamp: Array

    def __len__(self) -> int:
        return len(self.place)

    def __getitem__(self, name: str) -> Array:
        return self.values[self.names.index(name)]

    def rows(self, some: slice | NDArray[np.bool_]) -> Spoken:
        """Some of it."""
        return Spoken(self.source, self.names, self.place[some], self.values[:, some], self.stamp[some])


@dataclass(frozen=True)
class Timed:
    """Readings with their times.

    Attributes:
        told: by source and name, in the order of time.
        epoch: seconds since 1970 at time 0; None where the log has no date.
        untimed: sentences that have no time.
        steps: what was done, in words.
    """

    told: Mapping[str, Mapping[str, Series]]
    epoch: float | None
    untimed: int
    steps: tuple[str, ...]


@dataclass(frozen=True)
class _Step:
    """Where a clock goes back: places of the reading before and of the first one after, and their times [s]."""

    clock: str
    before: int
    after: int
    last: float
    now: float

    def __str__(self) -> str:
        return (f"line {self.after // PIECES}: {self.clock} goes back by {self.last - self.now:.6g} s, from "
                f"{_said(self.last)} to {_said(self.now)}")  # fmt: skip


_Key = tuple[str, tuple[str, ...]]
"""Source and names."""


@dataclass(frozen=True)
class Piece:
    """A log, or a piece of it that its clock parts from the others.

    Attributes:
        found: what each source tells.
        ahead: those that speak before the fix of their time.
        steps: what is said of it.
    """

    found: Sequence[Spoken]
    ahead: frozenset[_Key] = frozenset()
    steps: tuple[str, ...] = ()


def parted(where: object, found: Sequence[Spoken], dated: bool) -> list[Piece]:
    """The pieces of a log whose clock goes back; one where it does not.

    What stands between the last time of a piece and the first one of the next belongs to neither for sure: it is left
    out, but for what speaks before the fix of its time.

    Raises:
        DataError: a piece that is too short for a trial, naming the line where the clock goes back.
    """
    clock = _clock_of(found)
    steps, ahead = _steps(found, clock, dated), _ahead(found, clock)
    if not steps:
        return [Piece(found, ahead)]
    begins, ends = [0, *(one.after for one in steps)], [*(one.before for one in steps), 1 << 62]
    times = [_inside(found, begin, end, dated) for begin, end in zip(begins, ends, strict=True)]
    spans = [(float(one[0]), float(one[-1])) for one in times]
    runs = [np.split(one, np.flatnonzero(np.diff(one) > _LONG) + 1) for one in times]
    beside = [run for a, b in pairwise(runs) for run in (a[-1], b[0])]  # a clock that is wrong for a while is no piece
    once = any(len(a) > 1 and a[-2] <= b[0] for a, b in pairwise(times))
    if once or len(steps) >= _MANY or min(float(one[-1] - one[0]) for one in beside) < _LONG:
        raise DataError(f"{where}: {steps[0]}; cut the log there into two, or take out what was logged twice")
    out = list[Piece]()
    for k, (begin, end, (first, last)) in enumerate(zip(begins, ends, spans, strict=True)):
        early = ends[k - 1] + 1 if k else 0
        mine = [one.rows((one.place >= _first(one, ahead, early, begin)) & (one.place <= end)) for one in found]
        said = [f"piece {k + 1} of {len(begins)}, cut at {'; '.join(map(str, steps))}"]
        twice = [f"{n + 1}" for n, (a, b) in enumerate(spans) if n != k and a < last and first < b]
        if twice:
            said.append(f"doubt: it lies over the time of piece {', '.join(twice)}; what was logged twice is in both, "
                        "and a clock that was set tells a wrong time before")  # fmt: skip
        out.append(Piece([one for one in mine if len(one)], ahead, tuple(said)))
    return out


def _first(one: Spoken, ahead: frozenset[_Key], early: int, begin: int) -> int:
    """Where a source begins in a piece: what speaks ahead of a fix with its last reading before that."""
    if (one.source, one.names) not in ahead:
        return begin
    last = one.place[(one.place >= early) & (one.place < begin)][-1:]
    return int(last[0]) if early and len(last) else early


def _ahead(found: Sequence[Spoken], clock: str | None) -> frozenset[_Key]:
    """Sources that speak before the first fix and not after the last one: they speak before each."""
    if clock is None:
        return frozenset()
    place, t, _ = _shown(found, clock)
    last = place[np.append(True, np.diff(t) != 0.0)][-1]
    return frozenset((one.source, one.names) for one in found if one.place[0] < place[0] and one.place[-1] < last)


def _steps(found: Sequence[Spoken], clock: str | None, dated: bool) -> list[_Step]:
    """Where the clock goes back, or without one the stamps of a source."""
    if clock is not None:
        place, t, _ = _shown(found, clock)
        return [_Step(f"the clock of {clock}", *map(int, place[k : k + 2]), *map(float, t[k : k + 2]))
                for k in np.flatnonzero(np.diff(t) < 0.0).tolist()]  # fmt: skip
    every = list[_Step]()
    for one in found:
        mine = one.rows(np.isfinite(one.stamp))
        step = np.diff(mine.stamp)
        for k in np.flatnonzero((step < -_BACK) & (dated | (step >= -0.5 * _DAY))).tolist():
            every.append(_Step("the stamp", *map(int, mine.place[k : k + 2]), *map(float, mine.stamp[k : k + 2])))
    out = list[_Step]()
    for one in sorted(every, key=lambda step: step.after):
        if not out or one.before >= out[-1].after:  # each source tells the same step
            out.append(one)
    return out


def _inside(found: Sequence[Spoken], begin: int, end: int, dated: bool) -> Array:
    """Times of a piece of a log, by its clock or by its stamps [s]."""
    clock = _clock_of(found)
    if clock is not None:
        place, t, _ = _shown(found, clock)
    else:
        place, t = _ordered([(one.place, one.stamp) for one in found])
    inside = t[(place >= begin) & (place <= end) & np.isfinite(t)]
    return inside if clock is not None or dated else unwrapped_days(inside)


def timed(where: object, piece: Piece, dated: bool) -> Timed:
    """Times of all readings.

    Args:
        where: of the log, which errors begin with.
        piece: what each source tells.
        dated: whether stamps count from 1970.

    Raises:
        DataError: no time, or a clock that goes back, see `parted`.
    """
    found = piece.found
    clock = _clock_of(found)
    stamped, count = sum(int(np.isfinite(one.stamp).sum()) for one in found), sum(map(len, found))
    most = 2 * stamped > count
    if clock is None and not most:
        raise TrackError(f"{where}: no time: a TAG block with c: or a stamp on {stamped} of {count} lines, and no "
                        "clock that goes on in RMC, GGA, GNS, GLL, PASHR or ZDA")  # fmt: skip
    ticks = _ticks(where, found, clock) if clock else _NONE
    own = [_own(one, ticks) for one in found]
    steps = list(piece.steps)
    midnight = _midnight(found, ticks, clock)
    if clock is None or (most and _tells(found) and not _steps(found, None, dated)):
        times = _stamped(found, dated)
        lost = sum(int(np.isnan(one).sum()) for one in times)
        if lost:
            bare = count - stamped
            steps.append(f"{bare} of {count} sentences have no stamp: {bare - lost} of them get that of the lines "
                         f"around them, {lost} are left out")  # fmt: skip
        times, midnight = _onto(times, own, midnight, dated, steps)
    else:
        back = _steps(found, None, dated)
        why = (f"{count - stamped} of {count} lines have none" if not most else
               f"{back[0]}" if back else "coarser than the readings")  # fmt: skip
        steps += [f"stamps of lines left aside: {why}"] * bool(stamped)
        steps.append(f"time by the clock in {clock}; sentences without one spread between its fixes")
        times, lost = _between(piece, ticks), 0
    times = [np.where(np.isnan(mine), one, mine) for mine, one in zip(own, times, strict=True)]
    return Timed(_told(found, times, steps), midnight, lost, tuple(steps))


@dataclass(frozen=True)
class _Ticks:
    """Times of the clock by its places, since 0 o'clock of the first day [s], and how many days later each is."""

    place: Places
    t: Array
    days: Places

    def last(self, place: Places) -> NDArray[np.intp]:
        """Number of the tick at or before each place; -1 before the first."""
        return np.searchsorted(self.place, place, side="right") - 1


_NONE = _Ticks(np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64))


def _told(found: Sequence[Spoken], times: Sequence[Array], steps: list[str]) -> dict[str, dict[str, Series]]:
    """Series by source and name; of two readings of one source at one time the later line counts."""
    parts: dict[tuple[str, str], list[tuple[Places, Array, Array]]] = defaultdict(list)
    first: dict[tuple[str, str], tuple[int, int]] = {}
    for one, t in zip(found, times, strict=True):
        there = np.flatnonzero(np.isfinite(t))
        for k, name in enumerate(one.names):
            if len(there) and name not in ("time_of_day", "time_of_none", "day"):
                key, begun = (one.source, name), (int(one.place[there[0]]), k)
                parts[key].append((one.place[there], t[there], one.values[k, there]))
                first[key] = min(first.get(key, begun), begun)
    told: dict[str, dict[str, Series]] = {}
    again = 0
    for source, name in sorted(first, key=lambda key: first[key]):
        place, t, values = (np.concatenate(some) for some in zip(*parts[source, name], strict=True))
        order = np.lexsort((place, t))
        t, values = t[order], values[order]
        same = np.diff(t) == 0.0
        again += int(np.count_nonzero(same & (np.diff(values) != 0.0)))
        last = np.append(~same, True)
        told.setdefault(source, {})[name] = t[last], values[last]
    if again:
        steps.append(f"{again} readings at the time of another one of their kind: the later one counts")
    return told


def _clock_of(found: Sequence[Spoken]) -> str | None:
    """The source whose clock the log goes by: that with most readings, a fix before a pulse; None without one."""
    count = Counter[str]()
    for name in ("time_of_day", "time_of_none"):  # a receiver without a fix still has a clock
        for one in found:
            if name in one.names:
                count[one.source] += len(one)
        if count:
            break
    if not count:
        return None
    fixes = {source: n for source, n in count.items() if not source.endswith(_NO_CLOCK)}
    among = fixes if fixes and max(fixes.values()) >= _SLOW * max(count.values()) else count
    often = [source for source in among if among[source] >= _OFTEN * max(among.values())]
    late = {source: _late(found, source, often) for source in often} if len(often) > 1 else dict.fromkeys(often, 0.0)
    early = [source for source in often if late[source] <= min(late.values()) + _LATE]
    first = [source for source in early if not source.startswith("2/")] or early  # of two that share a name
    return max(first, key=lambda source: (among[source], source.endswith("RMC"), source))


def _late(found: Sequence[Spoken], source: str, others: Sequence[str]) -> float:
    """By how much the times of a clock are older than those that others have told before it [s].

    A device that repeats the fix of a receiver tells an old time; no device tells one that is still to come.
    """
    place, t, _ = _shown(found, source)
    behind = [0.0]
    for other in others:
        there, told, _ = _shown(found, other)
        last = np.searchsorted(there, place, side="right") - 1
        if other != source and (last >= 0).any():
            behind.append(float(np.median((told[last] - t)[last >= 0])))
    return max(one for one in behind if one < _OTHER)


def _ordered(parts: Sequence[tuple[Places, Array]]) -> tuple[Places, Array]:
    """Places and values of several sources in the order of the log."""
    place, values = (np.concatenate(some) for some in zip(*parts, strict=True))
    order = np.argsort(place, kind="stable")
    return place[order], values[order]


def _shown(found: Sequence[Spoken], clock: str) -> tuple[Places, Array, Places]:
    """Places and times of the clock of a source [s], and how many midnights it has passed."""
    mine = [one for one in found if one.source == clock]
    parts = {name: [(one.place, one[name]) for one in mine if name in one.names]
             for name in ("time_of_day", "time_of_none")}  # fmt: skip
    fixes, none = parts.values()
    place, t, days = _over_midnight(*_ordered(fixes or none))
    if fixes and none:
        more, told, later = _over_midnight(*_ordered(fixes + none))
        steps = np.diff(told)
        between = np.diff(np.isin(more, place).astype(np.int8)) != 0  # from a fix to none, or back
        if (steps >= 0.0).all() and (steps[between] <= _AHEAD * max(1.0, float(np.median(steps)))).all():
            return more, told, later
    return place, t, days


def _over_midnight(place: Places, t: Array) -> tuple[Places, Array, Places]:
    """Times that go on over midnight; a leap ahead of half a day and more undoes one, as a clock was wrong between."""
    steps, later = np.diff(t, prepend=t[0]), np.zeros(len(t), np.int64)
    day = 0
    for k in np.flatnonzero(np.abs(steps) > 0.5 * _DAY).tolist():
        before, day = day, max(day - 1, 0) if steps[k] > 0.0 else day + 1
        later[k] = day - before
    days = np.cumsum(later)
    return place, t + _DAY * days, days


def _ticks(where: object, found: Sequence[Spoken], clock: str) -> _Ticks:
    """The clock of a source.

    Raises:
        DataError: it goes back, or stands still from beginning to end.
    """
    if back := _steps(found, clock, False):
        raise DataError(f"{where}: {back[0]}; cut the log there into two, or take out what was logged twice")
    place, t, days = _shown(found, clock)
    if t[0] == t[-1]:
        raise DataError(f"{where}: no time: the clock of {clock} stands still, and most lines have no stamp")
    return _Ticks(place, t, days)


def _said(t: float) -> str:
    minutes, seconds = divmod(t % _DAY, 60.0)
    return f"{int(minutes) // 60:02d}:{int(minutes) % 60:02d}:{seconds:05.2f}"


def _midnight(found: Sequence[Spoken], ticks: _Ticks, clock: str | None) -> float | None:
    """The midnight before the first tick that most dates tell, seconds since 1970; None without any."""
    dates = list[tuple[Places, Array]]()
    for one in found:
        if "day" not in one.names:
            continue
        last = ticks.last(one.place)
        told = last >= 0 if one.source != clock else np.isin(one.place, ticks.place)
        dates.append((one.place[told], one["day"][told] - _DAY * ticks.days[last[told]]))
    if not sum(len(place) for place, _ in dates):
        return None
    days, first, count = np.unique(_ordered(dates)[1], return_index=True, return_counts=True)
    return float(days[np.lexsort((first, -count))[0]])


def _own(one: Spoken, ticks: _Ticks) -> Array:
    """Times of sentences that carry that of their fix, on the day of the clock around them; else NaN."""
    if not len(ticks.t) or "time_of_day" not in one.names or one.source.endswith(_NO_CLOCK):
        return np.full(len(one), np.nan)
    t, now = one["time_of_day"], ticks.t[np.maximum(ticks.last(one.place), 0)]
    return t + _DAY * np.round((now - t) / _DAY)


def _between(piece: Piece, ticks: _Ticks) -> list[Array]:
    """Times without stamps: those of one source between two times of the clock are spread over them evenly.

    One that tells one shaft after the other is not told twice.  Of a source that speaks ahead of each fix, the last of
    its readings between two fixes is that of the later one.  Before the first fix and after the last one a source goes
    on as often as between them.
    """
    new = np.append(True, np.diff(ticks.t) > 0.0)
    place, t = ticks.place[new], ticks.t[new]
    start, end = np.append(2.0 * t[0] - t[1], t), np.append(t, 2.0 * t[-1] - t[-2])
    out = list[Array]()
    for one in piece.found:
        span = np.searchsorted(place, one.place, side="right")
        before = (one.source, one.names) in piece.ahead
        told = np.bincount(span, minlength=len(start))
        many, seen = told[span], np.arange(len(one)) - np.searchsorted(span, span)
        begin, stop = start.copy(), end.copy()
        if told[1:-1].any():
            usual = float(np.median(told[1:-1][told[1:-1] > 0]))
            begin[0] = end[0] - (end[0] - start[0]) * max(1.0, told[0] / usual)
            stop[-1] = start[-1] + (end[-1] - start[-1]) * max(1.0, told[-1] / usual)
        out.append(begin[span] + (stop - begin)[span] * (seen + before) / many)
    return out


def _tells(found: Sequence[Spoken]) -> bool:
    """Whether stamps tell the readings of a source apart: those of one second a line do not, at ten readings a second.

    A source that tells several things in a burst (one rudder after the other) is not one that is told twice.
    """
    steps = [np.diff(one.stamp[np.isfinite(one.stamp)]) for one in found]
    return sum(int(np.count_nonzero(one == 0.0)) for one in steps) <= _ONCE * sum(map(len, steps))


def _stamped(found: Sequence[Spoken], dated: bool) -> list[Array]:
    """Stamps; one without has that of its neighbours where both are the same, else it is NaN."""
    order = np.argsort(np.concatenate([one.place for one in found]), kind="stable")
    stamps = np.concatenate([one.stamp for one in found])[order]
    have = np.flatnonzero(np.isfinite(stamps))
    known = stamps[have] if dated else unwrapped_days(stamps[have])
    stamps[have] = known
    after = np.searchsorted(have, np.arange(len(stamps)))
    inner = np.flatnonzero(np.isnan(stamps) & (after > 0) & (after < len(have)))
    before, behind = known[after[inner] - 1], known[after[inner]]
    stamps[inner] = np.where(before == behind, before, np.nan)
    out = np.empty(len(stamps))
    out[order] = stamps
    return np.split(out, np.cumsum([len(one) for one in found])[:-1])


def _onto(
    times: list[Array], own: Sequence[Array], midnight: float | None, dated: bool, steps: list[str]
) -> tuple[list[Array], float | None]:
    """Stamps moved onto the clock of the receiver, by what they are off it in the median, and its first midnight."""
    off = np.concatenate([t - mine for t, mine in zip(times, own, strict=True)])
    off = off[np.isfinite(off)]
    if not len(off):
        return times, 0.0 if dated else midnight
    middle = float(np.median(off))
    if dated and midnight is None:
        midnight = _DAY * round(middle / _DAY)
    elif dated and midnight is not None and (weeks := round((middle - midnight) / ROLL)):
        midnight += weeks * ROLL
        steps.append(f"dates of the receiver are {weeks} x 1024 weeks old: those of the stamps count")
    ahead = middle - (midnight or 0.0) * dated
    if abs(ahead) > _OFF and (dated or abs(ahead) < 0.5 * _DAY):
        steps.append(f"stamps of lines are {ahead:+.6g} s off the clock of the receiver, which counts")
    spread = float(np.quantile(off, 0.95) - np.quantile(off, 0.05))
    if spread > _SPREAD:
        steps.append(f"doubt: stamps of lines scatter by {spread:.3g} s about the clock of the receiver")
    return [t - middle for t in times], midnight
