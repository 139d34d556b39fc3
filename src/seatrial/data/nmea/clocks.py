"""When each reading of a log was taken: by the clock of its own fix, by the stamps of the logger, or between fixes.

A receiver tells one fix in several sentences, each with the time of the fix: these are one epoch, whatever stands
between them.  Sentences without a clock have the stamp of their line, moved by what the stamps are off the receiver's
clock; without stamps, those of one source between two fixes are spread evenly over them.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .. import Array, DataError
from .sources import Series
from .stamping import unwrapped_days

_DAY = 86400.0
_ROLL = 1024 * 7 * _DAY
"""After so many seconds a receiver that does not know better begins to count the weeks of GPS anew."""
_ONCE = 0.5
"""A stamp counts where less than this share of the readings of each source come at the stamp of the one before."""
_OFF, _SPREAD = 0.5, 0.5
"""Stamps that are off the receiver's clock by more [s], or that scatter about it by more, are told."""
_SLOW = 0.5
_NO_CLOCK = ("ZDA",)
"""Its time is that of a pulse or of sending, and not of a fix: it serves where no fix has a clock."""


@dataclass
class Reading:
    """The readings of one sentence.

    Attributes:
        line: its number.
        source: talker and kind.
        values: as `readings.readings` has them.
        stamp: of its line [s].
    """

    line: int
    source: str
    values: Mapping[str, float]
    stamp: float | None = None


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


def timed(where: object, found: Sequence[Reading], dated: bool) -> Timed:
    """Times of all readings.

    Args:
        where: of the log, which errors begin with.
        found: in the order of their lines.
        dated: whether stamps count from 1970.

    Raises:
        DataError: no time, or a clock that goes back.
    """
    clock = _clock_of(found)
    stamped = sum(one.stamp is not None for one in found)
    most = 2 * stamped > len(found)
    if clock is None and not most:
        raise DataError(f"{where}: no time: a TAG block with c: or a stamp on {stamped} of {len(found)} lines, and no "
                        "clock that goes on in RMC, GGA, GNS, GLL, PASHR or ZDA")  # fmt: skip
    now, midnights = _ticks(where, found, clock) if clock else ({}, Counter[float]())
    own = _own(found, now)
    steps = list[str]()
    midnight = midnights.most_common(1)[0][0] if midnights else None
    if clock is None or (most and _tells(found)):
        times, lost = _stamped(found, dated)
        if lost:
            bare = len(found) - stamped
            steps.append(f"{bare} of {len(found)} sentences have no stamp: {bare - lost} of them get that of the lines "
                         f"around them, {lost} are left out")  # fmt: skip
        times, midnight = _onto(times, own, midnight, dated, steps)
    else:
        why = f"{len(found) - stamped} of {len(found)} lines have none" if not most else "coarser than the readings"
        steps += [f"stamps of lines left aside: {why}"] * bool(stamped)
        steps.append(f"time by the clock in {clock}; sentences without one spread between its fixes")
        times, lost = _between(found, now), 0
    return Timed(_told(found, {**times, **own}, steps), midnight, lost, tuple(steps))


def _told(found: Sequence[Reading], times: Mapping[int, float], steps: list[str]) -> dict[str, dict[str, Series]]:
    """Series by source and name; of two readings of one source at one time the later line counts."""
    told: dict[str, dict[str, dict[float, float]]] = defaultdict(lambda: defaultdict(dict))
    again = 0
    for k, one in enumerate(found):
        t = times.get(k)
        if t is None:
            continue
        for name, value in one.values.items():
            if name not in ("time_of_day", "time_of_none", "day"):
                kept = told[one.source][name]
                again += t in kept and kept[t] != value
                kept[t] = value
    if again:
        steps.append(f"{again} readings at the time of another one of their kind: the later one counts")
    return {source: {name: _series(kept) for name, kept in one.items()} for source, one in told.items()}


def _series(kept: Mapping[float, float]) -> Series:
    t: Array = np.array(sorted(kept), dtype=np.float64)
    return t, np.array([kept[one] for one in t.tolist()], dtype=np.float64)


def _clock_of(found: Sequence[Reading]) -> str | None:
    """The source whose clock the log goes by: that with most readings, a fix before a pulse; None without one."""
    count = Counter(one.source for one in found if "time_of_day" in one.values)
    if not count:  # a receiver without a fix still has a clock
        count = Counter(one.source for one in found if "time_of_none" in one.values)
    if not count:
        return None
    fixes = {source: n for source, n in count.items() if not source.endswith(_NO_CLOCK)}
    among = fixes if fixes and max(fixes.values()) >= _SLOW * max(count.values()) else count
    return max(among, key=lambda source: (among[source], source.endswith("RMC"), source))


def _ticks(where: object, found: Sequence[Reading], clock: str) -> tuple[dict[int, float], Counter[float]]:
    """Times of the clock by the place of its sentence, since 0 o'clock of the first day, and the dates that are told.

    Raises:
        DataError: it goes back, or stands still from beginning to end.
    """
    now: dict[int, float] = {}
    midnights: Counter[float] = Counter()
    last: float | None = None
    days = 0
    name = "time_of_day" if any("time_of_day" in one.values for one in found) else "time_of_none"
    for k, one in enumerate(found):
        if "day" in one.values and last is not None and one.source != clock:
            midnights[one.values["day"] - _DAY * days] += 1
        if one.source != clock or name not in one.values:
            continue
        t = one.values[name] + _DAY * days
        if last is not None and t < last - 0.5 * _DAY:  # midnight
            days, t = days + 1, t + _DAY
        if last is not None and t < last:
            raise DataError(
                f"{where}: line {one.line}: the clock of {clock} goes back by {last - t:.6g} s, from {_said(last)} to "
                f"{_said(t)}; cut the log there into two, or take out what was logged twice"
            )
        if "day" in one.values:
            midnights[one.values["day"] - _DAY * days] += 1
        now[k], last = t, t
    if len(set(now.values())) < 2:
        raise DataError(f"{where}: no time: the clock of {clock} stands still, and most lines have no stamp")
    return now, midnights


def _said(t: float) -> str:
    minutes, seconds = divmod(t % _DAY, 60.0)
    return f"{int(minutes) // 60:02d}:{int(minutes) % 60:02d}:{seconds:05.2f}"


def _own(found: Sequence[Reading], now: Mapping[int, float]) -> dict[int, float]:
    """Times of sentences that carry that of their fix, on the day of the clock around them."""
    out: dict[int, float] = {}
    current = next(iter(now.values()), None)
    for k, one in enumerate(found):
        current = now.get(k, current)
        t = one.values.get("time_of_day")
        if t is not None and current is not None and not one.source.endswith(_NO_CLOCK):
            out[k] = t + _DAY * round((current - t) / _DAY)
    return out


def _between(found: Sequence[Reading], now: Mapping[int, float]) -> dict[int, float]:
    """Times without stamps: those of one source between two times of the clock are spread over them evenly.

    Where a source speaks before the first fix and not after the last one, it speaks before each: the last of its
    readings between two fixes is that of the later one.
    """
    groups: list[tuple[float, list[int]]] = []
    early: list[int] = []
    for k in range(len(found)):
        t = now.get(k)
        if t is not None and (not groups or t > groups[-1][0]):
            groups.append((t, []))
        (groups[-1][1] if groups else early).append(k)
    ends = [*(t for t, _ in groups[1:]), 2.0 * groups[-1][0] - groups[-2][0]]
    first = groups[0][0]
    spans = [(2.0 * first - groups[1][0], first, early), *((t, end, one) for (t, one), end in
                                                           zip(groups, ends, strict=True))]  # fmt: skip

    def key(k: int) -> tuple[str, tuple[str, ...]]:
        # one that tells one shaft after the other is not told twice
        return found[k].source, tuple(found[k].values)

    before = {key(k) for k in early} - {key(k) for k in groups[-1][1]}
    out: dict[int, float] = {}
    for start, end, group in spans:
        many, seen = Counter(map(key, group)), Counter[tuple[str, tuple[str, ...]]]()
        for k in group:
            this = key(k)
            out[k] = start + (end - start) * (seen[this] + (this in before)) / many[this]
            seen[this] += 1
    return out


def _tells(found: Sequence[Reading]) -> bool:
    """Whether stamps tell the readings of a source apart: those of one second a line do not, at ten readings a second.

    A source that tells several things in a burst (one rudder after the other) is not one that is told twice.
    """
    last: dict[tuple[str, tuple[str, ...]], float] = {}
    same, count = 0, 0
    for one in found:
        if one.stamp is None:
            continue
        key = one.source, tuple(one.values)
        count += key in last
        same += last.get(key) == one.stamp
        last[key] = one.stamp
    return same <= _ONCE * count


def _stamped(found: Sequence[Reading], dated: bool) -> tuple[dict[int, float], int]:
    """Stamps by the place of the sentence; one without has that of its neighbours where both are the same."""
    have = [k for k, one in enumerate(found) if one.stamp is not None]
    stamps = [found[k].stamp or 0.0 for k in have]
    times = dict(zip(have, stamps if dated else unwrapped_days(stamps), strict=True))
    out: dict[int, float] = {}
    before: float | None = None
    gap: list[int] = []
    for k in range(len(found)):
        if k in times:
            out |= dict.fromkeys(gap, times[k]) if before == times[k] else {}
            gap, before = [], times[k]
            out[k] = before
        else:
            gap.append(k)
    return out, len(found) - len(out)


def _onto(
    times: dict[int, float], own: Mapping[int, float], midnight: float | None, dated: bool, steps: list[str]
) -> tuple[dict[int, float], float | None]:
    """Stamps moved onto the clock of the receiver, by what they are off it in the median, and its first midnight."""
    both = [k for k in own if k in times]
    if not both:
        return times, 0.0 if dated else midnight
    off = np.array([times[k] - own[k] for k in both])
    middle = float(np.median(off))
    if dated and midnight is None:
        midnight = _DAY * round(middle / _DAY)
    elif dated and midnight is not None and (weeks := round((middle - midnight) / _ROLL)):
        midnight += weeks * _ROLL
        steps.append(f"dates of the receiver are {weeks} x 1024 weeks old: those of the stamps count")
    ahead = middle - (midnight or 0.0) * dated
    if abs(ahead) > _OFF and (dated or abs(ahead) < 0.5 * _DAY):
        steps.append(f"stamps of lines are {ahead:+.6g} s off the clock of the receiver, which counts")
    spread = float(np.quantile(off, 0.95) - np.quantile(off, 0.05))
    if spread > _SPREAD:
        steps.append(f"doubt: stamps of lines scatter by {spread:.3g} s about the clock of the receiver")
    return {k: t - middle for k, t in times.items()}, midnight
