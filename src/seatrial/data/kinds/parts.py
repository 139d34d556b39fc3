"""Manoeuvres in one recording, told apart by the stretches between them on a course.

On a course the rudder rests amidships, or works a little as an autopilot does, and the ship hardly turns.  A day of
transits with some manoeuvres is a long recording of the same: what is left of it are the manoeuvres.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np

from ...core.values import dataclass
from .. import Array, Trial
from ..prepare.steps import Step
from ..sidecar import began
from . import recognised
from .kind import Kind
from .signals import DEGREE, Signals, signals, smooth

# On a course the mean size of the rudder angle over a clock is at most this, or this share of the largest angles up to
# the most, and the ship turns by no more than this, in so many clocks; of these the manoeuvres keep so many on either
# side.  Before the first manoeuvre and after the last only so many are cut off.
_MIDSHIPS, _SHARE, _MOST, _TURNED, _CLOCKS, _KEPT = 1.5 * DEGREE, 0.15, 4.0 * DEGREE, 10.0 * DEGREE, 3.0, 1.0
_LONG = 20.0
# A ship turns by at most so much while it covers its length.
_HARDEST = 0.5
# Kinds that one recording may hold several of, and those of which rest amidships is a part.
_ONE = ("zigzag", "turning", "initial-turning", "spiral", "stopping", "recovery", "pull-out")
_WHOLE = ("pull-out", "recovery", "at rest", "station", "unknown")


@dataclass(frozen=True)
class Part:
    """One manoeuvre of a recording, from `start` to `stop` in its time [s], both included."""

    kind: Kind
    start: float
    stop: float

    def when(self, trial: Trial) -> str:
        """From when to when, by the clock (UTC) where the recording says when it began."""
        origin = began(trial.name, trial.meta) / 1e9
        if not origin:
            return f"{self.start:.0f} to {self.stop:.0f} s"
        ends = (datetime.fromtimestamp(origin + t, UTC).strftime("%H:%M:%S") for t in (self.start, self.stop))
        return " to ".join(ends)


def parts(trial: Trial, whole: Kind | None = None) -> tuple[Part, ...]:
    """The manoeuvres of a recording that holds several, or much else; empty where it is one or none.

    Args:
        trial: the recording.
        whole: what it was recognised as; None looks.
    """
    kind = recognised(trial) if whole is None else whole
    seen = signals(trial, max(len(trial), 1))
    if isinstance(seen, str) or kind.name in _WHOLE or seen.delta is None:
        return ()
    clock, t = _clock(seen), seen.t + trial.t[0]
    rests = _rests(seen, seen.delta, clock)
    kept = _KEPT * clock
    starts = [t[0], *(t[last] - kept for _, last in rests)]
    stops = [*(t[first] + kept for first, _ in rests), t[-1]]
    found: list[Part] = []
    for start, stop in zip(starts, stops, strict=True):
        own = trial.rows((trial.t >= start) & (trial.t <= stop))
        one = recognised(own)
        if one.name in _ONE:
            found.append(Part(one, float(own.t[0]), float(own.t[-1])))
    ended = bool(rests) and (rests[0][0] == 0 or rests[-1][1] == len(t) - 1)
    return tuple(found) if len(found) > 1 or ended else ()


def _clock(seen: Signals) -> float:
    """L/U [s]; of a ship whose length is not told, by how hard it turns."""
    if np.isfinite(seen.L_pp):
        return seen.clock
    hardest = float(np.quantile(np.abs(seen.r), 0.999))
    return min(seen.clock, _HARDEST / max(hardest, 1e-9))


def _rests(seen: Signals, delta: Array, clock: float) -> list[tuple[int, int]]:
    """First and last rows of stretches on a course, at either end of the recording only long ones."""
    width = max(round(clock / max(float(np.median(np.diff(seen.t))), 1e-9)), 1)
    largest = float(np.quantile(np.abs(delta), 0.999))
    most = max(_MIDSHIPS, min(_SHARE * largest, _MOST))
    calm = (smooth(np.abs(delta), width) <= most) & (np.abs(smooth(seen.r, width)) <= _TURNED / _CLOCKS / clock)
    edges = np.flatnonzero(np.diff(calm.astype(np.int8), prepend=0, append=0))
    out: list[tuple[int, int]] = []
    for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        inside = first > 0 and end < len(calm)
        if seen.t[end - 1] - seen.t[first] >= (_CLOCKS if inside else _LONG) * clock:
            out.append((first, end - 1))
    return out


def separating(trial: Trial, found: Sequence[Part]) -> Step:
    """What `mend` does to make a trial of each part: what belongs to none of them is cut out."""
    half = 0.5 * trial.dt
    begins = [float(trial.t[0]), *(one.stop + half for one in found)]
    ends = [*(one.start - half for one in found), float(trial.t[-1])]
    where = tuple((a, b) for a, b in zip(begins, ends, strict=True) if b > a)
    return Step(do="cut", where=where, trials=(trial.name,))
