"""Several manoeuvres in one recording, told apart by the stretches between them in which the rudder rests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from .. import Trial
from ..prepare.steps import Step
from ..sidecar import began
from . import recognised
from .kind import Kind
from .signals import DEGREE, Hold, Signals, signals

# Between two manoeuvres the rudder rests amidships, within this, and the ship turns by no more, for so many clocks;
# of these the manoeuvres keep so many on either side.
_MIDSHIPS, _TURNED, _CLOCKS, _KEPT = 1.5 * DEGREE, 10.0 * DEGREE, 3.0, 1.0
# Kinds that one recording may hold several of, and those of which rest amidships is a part.
_ONE = ("zigzag", "turning", "initial-turning", "spiral", "stopping", "recovery")
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
    """The manoeuvres of a recording that holds several; empty where it holds one or is none.

    Args:
        trial: the recording.
        whole: what it was recognised as; None looks.
    """
    kind = recognised(trial) if whole is None else whole
    seen = signals(trial)
    if isinstance(seen, str) or kind.name in _WHOLE:
        return ()
    rests = [one for one in seen.holds if _rests(seen, one)]
    kept, t = _KEPT * seen.clock, seen.t + trial.t[0]
    starts = [t[0], *(t[one.last] - kept for one in rests)]
    stops = [*(t[one.first] + kept for one in rests), t[-1]]
    found: list[Part] = []
    for start, stop in zip(starts, stops, strict=True):
        own = trial.rows((trial.t >= start) & (trial.t <= stop))
        one = recognised(own)
        if one.name in _ONE:
            found.append(Part(one, float(own.t[0]), float(own.t[-1])))
    return tuple(found) if len(found) > 1 else ()


def _rests(seen: Signals, one: Hold) -> bool:
    """Whether nothing goes on: within the recording, not before the first helm or after the last."""
    inside = one.first > 0 and one.last < len(seen.t) - 1
    calm = abs(one.level) <= _MIDSHIPS and float(np.ptp(seen.psi[one.first : one.last + 1])) <= _TURNED
    return inside and calm and seen.lasts(one) >= _CLOCKS * seen.clock


def separating(trial: Trial, found: Sequence[Part]) -> Step:
    """What `mend` does to make a trial of each part: what belongs to none of them is cut out."""
    half = 0.5 * trial.dt
    begins = [float(trial.t[0]), *(one.stop + half for one in found)]
    ends = [*(one.start - half for one in found), float(trial.t[-1])]
    where = tuple((a, b) for a, b in zip(begins, ends, strict=True) if b > a)
    return Step(do="cut", where=where, trials=(trial.name,))
