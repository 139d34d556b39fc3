"""Indices of a run and whether it meets its criteria."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ...core.values import dataclass
from ...manoeuvres.track import Leg
from ..loop import Loop
from .pilots import Guide
from .scenario import Criteria
from .wakes import Passed


@dataclass(frozen=True)
class Judged:
    """One criterion after a run.

    Attributes:
        name: as in `Criteria`, "contact", which is always judged, or a rule of the road, whose value is the margin.
        value: what the run has; None where it never came to that.
        limit: what it may have.
        met: whether it does.
        where: what the value belongs to, such as a ship; empty for the whole run.
    """

    name: str
    value: float | None
    limit: float
    unit: str
    met: bool
    where: str = ""


class Judge:
    """Cross-track and heading errors of a run along its route by the true motion, and its end.

    Attributes:
        arrived: when the last waypoint was abeam [s]; None before.
        cross_track: greatest distance from the leg that is followed [m].
        cross_track_rms: root of its mean square so far [m].
        heading_error: greatest difference of the heading from the leg, `settle` seconds after the leg began [rad].
        under_keel: least water under the keel [m]; infinite without a chart.
    """

    def __init__(
        self, loop: Loop, own: str, route: Sequence[Leg], turn: float, criteria: Criteria,
        keel: Callable[[], float] = lambda: math.inf,
    ) -> None:  # fmt: skip
        """Judge the ship `own` of the loop from now on; `turn` as in `pilots.Guide`, `keel`: the water under it now."""
        self._keel = keel
        self._vessel, self._guide, self._criteria = loop.vessels[own], Guide(route, turn), criteria
        self.reset()
        loop.after(self.tick)
        loop.keep("the judge", self)

    def tick(self, loop: Loop) -> None:
        """Take note of this tick."""
        plant, guide = self._vessel.plant, self._guide
        if self._vessel.failure is not None or self.arrived is not None:
            return
        self.under_keel = min(self.under_keel, self._keel())
        leg = guide.number
        across = abs(guide.across(plant["x"], plant["y"]))
        if guide.number != leg:
            self._since = loop.t
        if guide.past:
            self.arrived = loop.t
        if guide.number and loop.t - self._since < self._criteria.settle:  # a corner is no error
            across = min(across, abs(float(guide.route[guide.number - 1].along_across(plant["x"], plant["y"])[1])))
        self.cross_track = max(self.cross_track, across)
        self._squares, self._count = self._squares + across * across, self._count + 1
        if loop.t - self._since >= self._criteria.settle:
            apart = abs(math.remainder(plant["psi"] - guide.leg.alpha, math.tau))
            self.heading_error = max(self.heading_error or 0.0, apart)

    @property
    def cross_track_rms(self) -> float:
        """Root of the mean square of the cross-track error so far [m]."""
        return math.sqrt(self._squares / self._count) if self._count else 0.0

    def judged(self, passed: Mapping[str, Passed]) -> tuple[Judged, ...]:
        """Every criterion, those of other ships once for each."""
        wanted, found = self._criteria, list[Judged]()
        for name, one in passed.items():
            if one.touched is not None:
                found.append(Judged("contact", one.touched, 0.0, "s", False, name))
            if wanted.passing_distance is not None:
                met = one.distance >= wanted.passing_distance
                found.append(Judged("passing_distance", one.distance, wanted.passing_distance, "m", met, name))
            if wanted.rules:
                found += [Judged(f"rule {rule}", margin, 0.0, "-", margin >= 0.0, name)
                          for rule, margin in one.margins.items()]  # fmt: skip
        if wanted.under_keel is not None:
            met = self.under_keel >= wanted.under_keel
            found.append(Judged("under_keel", self.under_keel, wanted.under_keel, "m", met))
        if wanted.cross_track is not None:
            met = self.cross_track <= wanted.cross_track
            found.append(Judged("cross_track", self.cross_track, wanted.cross_track, "m", met))
        if wanted.heading_error is not None:
            met = self.heading_error is not None and self.heading_error <= wanted.heading_error
            found.append(Judged("heading_error", self.heading_error, wanted.heading_error, "rad", met))
        if wanted.time is not None:
            met = self.arrived is not None and self.arrived <= wanted.time
            found.append(Judged("time", self.arrived, wanted.time, "s", met))
        return tuple(found)

    def snapshot(self) -> dict[str, Any]:
        return {"guide": self._guide.snapshot(), "arrived": self.arrived, "cross_track": self.cross_track,
                "heading_error": self.heading_error, "since": self._since, "squares": self._squares,
                "count": self._count, "under_keel": self.under_keel}  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        self._guide.restore(saved["guide"])
        self.arrived, self.cross_track, self.heading_error = (
            saved["arrived"], saved["cross_track"], saved["heading_error"]
        )  # fmt: skip
        self._since, self._squares, self._count = saved["since"], saved["squares"], saved["count"]
        self.under_keel = saved["under_keel"]

    def reset(self) -> None:
        self._guide.reset()
        self.arrived: float | None = None
        self.heading_error: float | None = None
        self.cross_track = 0.0
        self.under_keel = math.inf
        self._since, self._squares, self._count = 0.0, 0.0, 0
