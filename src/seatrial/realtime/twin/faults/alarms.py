"""Which fault is named, and when: the best suspect, once it is clear enough of the next one or time is up."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Annotated

from ....core.records import Limits
from ....core.values import dataclass, replace
from ....identify.filters.augmented import ANTENNA, SLOW
from ....models import unit
from ..follow import Follower
from .suspects import (
    CARRIED,
    ELSEWHERE,
    FORM,
    GROWS,
    IMPULSE,
    JUMP,
    LATE,
    LAZY,
    LEVER,
    LOST,
    MISREAD,
    OF_SENSOR,
    PACE,
    PUSHED,
    RAMP,
    RESISTED,
    REVERSED,
    SCALED,
    SHARE,
    STUCK,
    Evidence,
    Suspect,
)

# A suspect is named where the next one is so much less likely, and in any case after so long [s]; one outlier makes
# evidence that is gone again a little later [s].
_MARGIN, _PATIENCE, _OUTLIER = 10.0, 20.0, 2.5
# How often suspects are compared by the filter run again [s], and the share by which one waits longer each time: a look
# costs seconds, and what was not named by the last will not be a moment later.
_LOOKS, _LONGER = 2.5, 0.25
# A clock, which explains much a little, waits longer for the next one to fall behind; so does a share, which a drift
# begins as [s].
_WAITS = {PACE: 90.0, SHARE: 35.0, FORM: 35.0}
# How one instrument is wrong, or whether it is the thrust or the hull, is worth a longer wait [s].
_WHICH = 40.0
# A fault smaller than this share of its usual size is no matter, however certain.
_MATTERS = 0.1
# A ramp of its usual size matters within this time [s].
_RAMP = 60.0
# Within this margin of the next one it cannot be told from it.
_ALIKE = 4.0
# An antenna is elsewhere from so many deviations of its stated place on, and twice as many of the estimate.
_FAR = 2.5
# A slow force is none of the usual ones from so many deviations of those, and of the estimate, on.
_STRONG = 4.0

UNEXPLAINED = "the model does not explain the readings"
WRONG = "the model is not that of the ship, or the log is wrong"
CLOCK = "the clock was set back"
DEEPER = "a ship deeper than its file"
"""Its propeller moves more than that of the file has to, as one that turns slower or gives less thrust."""
FROZEN, STEERING = "frozen", "steering"
"""Beside those of `suspects`: a reading that repeats itself, and a control that does not follow its order."""

# What a watch can do, by how a fault acts; {} is the sensor or the control.
_SENSOR = "use another source than the {} until it is checked; the twin does without it until it agrees again"
_BESIDE = "read the angle of {} at the stock, and set its sensor; the twin takes the size off meanwhile"
_STUCK = "steer by other means, and look at {} itself: its angle in the log is not what acts"
_FORCE = "no sensor explains it better; allow for it in the passage, the forecasts have it from here on"
_DO = {
    JUMP: _SENSOR, RAMP: _SENSOR, LATE: _SENSOR, SHARE: _SENSOR, FROZEN: _SENSOR, IMPULSE: _FORCE, GROWS: _FORCE,
    CARRIED: _FORCE, STUCK: _STUCK,
    LEVER: "state where the antenna stands (--antenna, or the mapping); the twin takes it there meanwhile",
    PACE: "set the clock of the logger, or state its rate; speeds and forecasts are off by as much",
    LAZY: "give helm early and at low rates, and look at pumps and pressure of {}; the twin lets it move as slowly",
    REVERSED: "turn the sign of {} in the mapping or at the sensor; the twin turns it meanwhile",
    LOST: "compare power and pressure at the shaft of {}, and look at the propeller; the forecasts have the loss",
    MISREAD: _BESIDE, SCALED: "count the turns of {} at the shaft, and set its sensor; the twin scales it meanwhile",
    STEERING: "steer by other means, and look at {}: its angle does not follow the order",
}  # fmt: skip
_BY_CAUSE = {
    "position jumped": "use another source than the position until it is checked; the twin does without it until it "
    "agrees again, and takes it as true after 5 min",
    UNEXPLAINED: "compare draught and depth with the model's, and the mapping with the instruments; trust no forecast",
    WRONG: "give the twin this ship at this draught, and check signs, units and places in the mapping",
    CLOCK: "set the clock of the logger; the motion begins anew from there",
}

Endless = Annotated[float, Limits(null=math.inf)]
"""A number that may be infinite, for which a file has null."""


@dataclass(frozen=True)
class Alarm:
    """A fault that was found.

    Attributes:
        cause: its name, such as "compass frozen".
        how: how it acts, of `suspects`, or `FROZEN`, or `STEERING`, or empty.
        what: channels, states or the control that it acts on.
        since: when it set in [s].
        named: when it was named [s].
        size: estimated size, for each of `what`; empty where there is none.
        unit: of the size.
        score: evidence, twice the logarithm of a Bayes factor; infinite for what the log shows by itself.
        rivals: causes that cannot be told from it.
        over: when it ended [s]; infinite while it lasts.
        of: the cause that it is a consequence of; empty for one by itself.
        explains: causes that were named before it, or after, and are its consequences.
        held, rate: where a jammed control stands or a slow one stood at first, and how fast this one moves.
    """

    cause: str
    how: str
    what: tuple[str, ...]
    since: float
    named: float
    size: tuple[float, ...] = ()
    unit: str = ""
    score: Endless = math.inf
    rivals: tuple[str, ...] = ()
    over: Endless = math.inf
    of: str = ""
    explains: tuple[str, ...] = ()
    held: float = math.nan
    rate: Endless = math.inf

    @property
    def text(self) -> str:
        """One line."""
        degrees = self.unit.startswith("rad")
        shown = [f"{math.degrees(v) if degrees else v:.3g}" for v in self.size]
        unit = self.unit.replace("rad", "deg")
        size = f" by {', '.join(shown)} {unit}".rstrip() if shown and self.unit != "1" else ""
        rivals = f"; cannot be told from: {', '.join(self.rivals)}" if self.rivals else ""
        more = f"; a consequence of: {self.of}" if self.of else ""
        more += f"; explains also: {', '.join(self.explains)}" if self.explains else ""
        return f"{self.cause}{size}, since t = {self.since:.0f} s{rivals}{more}"

    @property
    def advice(self) -> str:
        """What to do, in one line; empty for a fault of a kind that is not known."""
        about = self.cause.rsplit(" ", 1)[0] if self.how in OF_SENSOR or self.how == FROZEN else self.what[0]
        return _BY_CAUSE.get(self.cause) or _DO.get(self.how, "").format(about)

    @property
    def line(self) -> str:
        """The text with the advice."""
        return f"{self.text}; {self.advice}" if self.advice else self.text

    def ended(self, t: float) -> Alarm:
        """The same, over."""
        return replace(self, over=t)


Compared = Callable[[Sequence[Evidence]], Sequence[Evidence]]


@dataclass
class Judge:
    """Watches the evidence from row to row.

    Attributes:
        limit: score from which there is a fault.
        crossed: since when the best suspect is above it [s].
        looked: when suspects were last compared [s].
        wave: period of the sea [s]: what half a wave makes of the evidence, the other half takes back.
    """

    limit: float
    crossed: float = math.nan
    looked: float = -math.inf
    wave: float = 0.0

    def clear(self) -> None:
        """Forget what was above the limit."""
        self.crossed, self.looked = math.nan, -math.inf

    def named(
        self, t: float, evidence: Sequence[Evidence], compared: Compared = list
    ) -> tuple[Evidence, tuple[str, ...]] | None:  # fmt: skip
        """The fault to name now, and causes that cannot be told from it; None where there is none, or not yet.

        Args:
            evidence: of the bank, the best first.
            compared: gives suspects with scores against each other that are exact, the best first.
        """
        evidence = [one for one in evidence if possible(one)]
        if not evidence or evidence[0].score < self.limit:
            self.clear()
            return None
        if math.isnan(self.crossed):
            self.crossed = t
        soon = t - self.looked < max(_LOOKS, _LONGER * (self.looked - self.crossed))
        if soon or t - self.crossed < max(_OUTLIER, self.wave):
            return None
        self.looked = t
        evidence = [one for one in compared(evidence) if possible(one)]
        if not evidence:
            return None
        best = _plainest(evidence)
        if not matters(best, t - best.onset):  # nor is it any of the others, which explain less
            return None
        others = [one for one in evidence if not alike(one.suspect, best.suspect)]
        lead = best.score - others[0].score if others else math.inf
        wait = _WAITS.get(best.suspect.how, _PATIENCE)
        if any(_one_matter(best, one) for one in others if best.score - one.score < _MARGIN):
            wait = max(wait, _WHICH)
        if lead < _MARGIN and t - self.crossed < wait:
            return None
        return best, tuple(dict.fromkeys(one.suspect.cause for one in others if best.score - one.score < _ALIKE))


def _plainest(evidence: Sequence[Evidence]) -> Evidence:
    """The best; of causes that cannot be told apart the one that is more common.

    That is a step rather than a share, as at one speed, and more resistance rather than a shaft that turns slower than
    its sensor says or gives less thrust.
    """
    best = evidence[0]
    near = [one for one in evidence if best.score - one.score < _ALIKE]
    if best.suspect.how == SHARE:
        near = [one for one in near if one.suspect.how == JUMP and one.suspect.what == best.suspect.what]
    elif of_shaft(best.suspect):
        near = [one for one in near if one.suspect.cause == RESISTED and one.size[0] < 0.0]
    else:
        return best
    return near[0] if near else best


def of_shaft(one: Suspect) -> bool:
    """Whether a suspect is a shaft: its sensor, or its thrust."""
    return one.how == LOST or (one.how == SCALED and unit(one.what[0]) != "rad")


def _one_matter(a: Evidence, b: Evidence) -> bool:
    """Whether two causes are of one instrument, or of too little thrust and of the hull that it drives."""
    hull = [one.suspect.how == FORM or one.suspect.cause == RESISTED for one in (a, b)]
    weak = any(of_shaft(one.suspect) and one.size[0] > 0.0 for one in (a, b))
    return (a.suspect.how in OF_SENSOR and a.suspect.what == b.suspect.what) or all(hull) or (any(hull) and weak)


def possible(one: Evidence) -> bool:
    """Whether a fault can have this size: no propeller loses less than nothing, no reading is early."""
    return one.suspect.how not in (LOST, LATE) or one.size[0] >= 0.0


def matters(one: Evidence, since: float = 0.0) -> bool:
    """Whether a fault is large enough to matter; a ramp by how far it has gone since its onset."""
    if one.suspect.fixed:
        return True
    gone = max(since / _RAMP, 1.0) if one.suspect.how == RAMP else 1.0
    return any(gone * abs(size) >= _MATTERS * usual for size, usual in zip(one.size, one.suspect.size, strict=True))


def alike(a: Suspect, b: Suspect) -> bool:
    """Whether two suspects have the same name."""
    return a.cause == b.cause


def alarm_of(best: Evidence, t: float, rivals: tuple[str, ...], frozen: bool, rate: float = math.inf) -> Alarm:
    """The alarm for a suspect; a reading that jumps or drifts because it repeats itself is frozen."""
    one = best.suspect
    if frozen and one.how in OF_SENSOR:
        return Alarm(f"{one.cause.rsplit(' ', 1)[0]} frozen", FROZEN, one.what, best.onset, t, score=best.score)
    size = () if one.fixed else best.size
    held = best.held + (best.size[1] if one.how == STUCK else 0.0)
    what = tuple(dict.fromkeys(one.what))
    if of_shaft(one) and best.size[0] > 0.0:
        rivals = (*rivals, DEEPER)
    return Alarm(one.cause, one.how, what, best.onset, t, size, one.unit, best.score, rivals, held=held, rate=rate)


def strayed(follower: Follower | None) -> tuple[Alarm, ...]:
    """Alarms for what has come out far from what it was taken to be, little by little, so that no row surprised."""
    if follower is None:
        return ()
    settings = follower.machine.settings
    placed = ((ELSEWHERE, LEVER, ANTENNA, _FAR, 2.0 * _FAR, "m forward, starboard"),) if settings.placed else ()
    forces = ((RESISTED, IMPULSE, SLOW[:1], _STRONG, _STRONG, "m/s^2"),
              (PUSHED, IMPULSE, SLOW[1:], _STRONG, _STRONG, ""))  # fmt: skip
    found, t = list[Alarm](), follower.t
    for cause, how, names, far, sure, of in (*placed, *forces):
        some = [(*follower.value(name), settings.start[name]) for name in names if name in settings.start]
        if any(abs(value) > max(far * usual, sure * sd) for value, sd, usual in some):
            found.append(Alarm(cause, how, names, t, t, tuple(value for value, _, _ in some), of, over=t))
    return tuple(found)
