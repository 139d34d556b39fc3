"""What orders in sentences do to a ship: ROR, HTC, TRC, PRC and ETL, and APB or XTE for her own track follower.

One sender has command at a time, the first that gives an order; another one's are turned away until the first has been
silent for `hold` seconds.  Any valid sentence of who has command breaks the silence; after it the last orders stay.

The ship's own steering control: holds a heading or follows a track, where it is told these and no rudder angle.

An autopilot of a ship that nobody steers: it holds the course that the ship was on at the start.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from ..data.nmea.sentences import Sentence
from ..data.nmea.ship import MILE, Fittings
from ..manoeuvres import Settings
from ..manoeuvres.autopilot import Gains, usual_gains, wrapped
from ..manoeuvres.track import los_heading
from ..ships import Ship
from ..ships.felt import idle
from .helm import limits, obeying, ranges
from .loop import Loop
from .wire import ANYBODY, Authority

TELEGRAPH: Mapping[str, float] = MappingProxyType({
    "00": 0.0, "01": 0.3, "02": 0.45, "03": 0.65, "04": 0.85, "05": 1.0,
    "11": -0.3, "12": -0.45, "13": -0.65, "14": -0.85, "15": -1.0,
})  # fmt: skip
"""Shares of full revolutions by telegraph position, from stop over dead slow to full; assumed, as ships differ."""

_RAD = math.pi / 180.0

Ordered = dict[str, float]
"""Orders by the name of the control, SI units and radians."""


def rudders(ship: Ship) -> tuple[str, ...]:
    """Controls that are rudders, port to starboard."""
    return tuple(name for name in ship.model.controls if name.partition("_")[0] == "delta")


def shafts(ship: Ship) -> tuple[str, ...]:
    """Controls that are propellers or thrusters which drive her ahead, in revolutions, port to starboard."""
    pairs, dead = zip(ship.model.controls, ship.model.follows, strict=True), idle(ship)
    return tuple(name for name, (order, _) in pairs
                 if order == "n_P" and name.partition("_")[0] == "n" and name not in dead)  # fmt: skip


def thrusters(ship: Ship) -> Mapping[int, tuple[str, str | None]]:
    """Thrusters by their number in TRC, odd at the bow and even at the stern: strength, and azimuth where it turns."""
    odd, even = iter(range(1, 99, 2)), iter(range(2, 99, 2))
    found: dict[int, tuple[str, str | None]] = {}
    for control in ship.model.controls:
        kind, _, name = control.partition("_")
        if kind in ("n", "f") and name and not name.startswith("P"):
            azimuth = f"alpha_{name}"
            found[next(odd if "bow" in name else even)] = control, azimuth if azimuth in ship.model.controls else None
    return found


class Conning:
    """Who steers a ship by wire, and how.

    Attributes:
        commander: who has command; empty while nobody has.
        mode: "none", "rudder", "heading" or "track".
        counts: orders taken, and those turned away: refused (another has command), unfit (not for this ship, or
            without what it takes), clipped (taken, as far as the engine goes).
        heard: when who has command was last heard of [simulated s]; None before the first order.
        stale: whether who has command has been silent for longer than `hold`.
    """

    def __init__(
        self, ship: Ship, fittings: Fittings, hold: float = 10.0, full: float | None = None, steers: bool = True,
        authority: Authority = ANYBODY,
    ) -> None:  # fmt: skip
        """Nobody in command.

        Args:
            ship: who is steered.
            fittings: which of her controls are rudders and shafts.
            hold: how long a commander may be silent [simulated s].
            full: revolutions that count as full where the gear goes as far [1/s]; by default those of the approach.
            steers: whether there are compass and rate gyro for a steering control; without, headings are unfit.
            authority: who may have command.
        """
        self.ship, self.hold, self._authority = ship, hold, authority
        self._shafts = {number: name for name, number in fittings.numbers.items()}
        self._rudders, self._thrusters = fittings.rudders, thrusters(ship)
        self._known, self._ranges = obeying(ship), ranges(ship, full)
        self._limits = {name: limits(ship, name) for name in ship.model.controls}
        self.control = SteeringControl.of(ship, self._ranges["delta"].high if "delta" in self._ranges else 35.0 * _RAD)
        self.counts: Counter[str] = Counter()
        self._steers = steers
        self.reset()
        self._answers: Mapping[str, Callable[[Sentence], Ordered | None]] = {
            "ROR": self._rudder, "HTC": self._heading_track, "TRC": self._thruster, "PRC": self._propulsion,
            "ETL": self._telegraph, "APB": self._autopilot, "XTE": self._cross_track,
        }  # fmt: skip

    def reset(self) -> None:
        """Nobody in command, and nothing steers; what was counted stays."""
        self.commander, self.mode, self.stale = "", "none", False
        self.heard: float | None = None
        self._limit = math.inf
        self._track: float | None = None
        self.control.let_go()

    def snapshot(self) -> dict[str, Any]:
        """Who has command and how she is steered, for JSON."""
        return {"commander": self.commander, "mode": self.mode, "stale": self.stale, "heard": self.heard,
                "limit": self._limit, "track": self._track, "control": self.control.snapshot()}  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go on from what `snapshot` gave."""
        self.commander, self.mode, self.stale = saved["commander"], saved["mode"], saved["stale"]
        self.heard, self._limit, self._track = saved["heard"], saved["limit"], saved["track"]
        self.control.restore(saved["control"])

    def take(self, sentence: Sentence, sender: str, t: float) -> Ordered:
        """Orders that follow from a sentence at once; those of the steering control come from `steered`."""
        if sender == self.commander:  # which "" never is
            self.heard, self.stale = t, False
        answer = self._answers.get(sentence.kind)
        if answer is None or _is_report(sentence):
            return {}
        another = sender != self.commander and self.commander != "" and not self._silent(t)
        if another or not self._authority.may(sender):
            self.counts["refused"] += 1
            return {}
        ordered = answer(sentence)
        if ordered is None:
            self.counts["unfit"] += 1
            return {}
        self.counts["taken"] += 1
        self.commander, self.heard, self.stale = sender, t, False
        return ordered

    def steered(self, psi: float, r: float, t: float, dt: float) -> Ordered:
        """The rudder of the steering control, where it steers, for the next `dt` seconds."""
        self.watch(t)
        if self.mode not in ("heading", "track"):
            return {}
        if self.stale and self.mode == "track":
            self.control.across = None  # where the track is, nobody knows any more; its direction stays
        return self._all_rudders(self.control.rudder(psi, r, dt, self._limit))

    def watch(self, t: float) -> None:
        """See whether who has command is heard of."""
        self.stale = self.commander != "" and self._silent(t)

    def _silent(self, t: float) -> bool:
        return self.heard is not None and t - self.heard > self.hold

    def _all_rudders(self, angle: float) -> Ordered:
        if self._rudders:
            return dict.fromkeys(self._rudders, angle)
        return {"delta": angle} if "delta" in self._known else {}

    def _by_rudder(self, angles: Ordered) -> Ordered | None:
        if not angles:
            return None
        self.mode = "rudder"
        self.control.let_go()
        return angles

    def _rudder(self, s: Sentence) -> Ordered | None:
        """ROR: an angle for each rudder; a single one obeys the starboard field."""
        starboard = s.number("stbdrudderorder") if s["stbdrudderstatus"] == "A" else None
        port = s.number("portrudderorder") if s["portrudderstatus"] == "A" else None
        if len(self._rudders) > 1:
            half = len(self._rudders) // 2
            pairs = [(name, port if k < half else starboard) for k, name in enumerate(self._rudders)]
            return self._by_rudder({name: angle * _RAD for name, angle in pairs if angle is not None})
        return self._by_rudder({} if starboard is None else self._all_rudders(starboard * _RAD))

    def _heading_track(self, s: Sentence) -> Ordered | None:
        """HTC: override and the manual modes give a rudder angle, the others a heading or a track."""
        if s["headingref"] == "M":
            return None
        mode = "M" if s["override"] == "A" else s["steermode"]
        limit = s.number("cmdrudderlimit")
        if mode in ("M", "R"):
            angle, side = s.number("cmdrudderang"), s["cmdrudderdir"]
            if angle is None or (side is None and angle):
                return None
            return self._by_rudder(self._all_rudders((-angle if side == "L" else angle) * _RAD))
        wanted = s.number("cmdtrack" if mode == "T" else "cmdheading")
        if mode not in ("S", "H", "T") or wanted is None or not self._steers:
            return None
        self.mode, self._limit = "track" if mode == "T" else "heading", math.inf if limit is None else limit * _RAD
        if mode == "T":
            same = self._track is not None and abs(math.remainder(wanted * _RAD - self._track, 2.0 * math.pi)) < 1e-3
            self._track = wanted * _RAD
            self.control.steer(self._track, self._rate(s), (self.control.across or 0.0) if same else 0.0)
        else:
            self.control.steer(wanted * _RAD, self._rate(s))
        return {}

    def _rate(self, s: Sentence) -> float:
        """Greatest rate of turn towards a new heading [rad/s]."""
        rate, radius = s.number("cmdturnrate"), s.number("cmdturnradius")
        if s["turnmode"] == "T" and rate:
            return rate * _RAD / 60.0
        return self.ship.speed / (radius * MILE) if s["turnmode"] == "R" and radius else math.inf

    def _autopilot(self, s: Sentence) -> Ordered | None:
        """APB: follow the track from the origin to the destination, else steer the heading that is given."""
        if s["LCgwarn"] != "A" or s["LCcwarn"] != "A" or not self._steers:
            return None
        across, track = _across(s, "ctrkUnit"), s.number("bearO2D")
        if across is not None and track is not None and s["bearO2Du"] == "T":
            self.mode, self._track, self._limit = "track", track * _RAD, math.inf
            self.control.steer(self._track, math.inf, across)
            return {}
        heading = s.number("bearS")
        if heading is None or s["bearSu"] != "T":
            return None
        self.mode, self._limit = "heading", math.inf
        self.control.steer(heading * _RAD)
        return {}

    def _cross_track(self, s: Sentence) -> Ordered | None:
        """XTE: how far off the track that is followed already."""
        across = _across(s, "disUnit")
        if self.mode != "track" or across is None or self._track is None or "V" in (s["gwarn"], s["LCcwarn"]):
            return None
        self.control.steer(self._track, self.control.rate, across)
        return {}

    def _thruster(self, s: Sentence) -> Ordered | None:
        """TRC: strength and azimuth of a thruster; a sentence without C is no command."""
        number = s["thrusternum"]
        if not isinstance(number, int) or number not in self._thrusters:
            return None
        strength, azimuth = self._thrusters[number]
        value = self._revolutions(strength, s.number("dmdrpm"), s["rpmmode"])
        angle = s.number("dmdazimuth")
        out: Ordered = {} if value is None else {strength: value}
        if azimuth is not None and angle is not None:
            out[azimuth] = math.remainder(angle * _RAD, 2.0 * math.pi)
        return out or None

    def _propulsion(self, s: Sentence) -> Ordered | None:
        """PRC: revolutions of a shaft, by the demand in it or else by the lever."""
        demand, mode = s.number("rpmdemand"), s["rpmdemandstatus"]
        if demand is None or mode not in ("P", "R"):
            demand, mode = (s.number("leverdmdpos"), "P") if s["leverdmdstatus"] == "A" else (None, None)
        return self._on_shafts(s["engineshaftnum"], demand, mode)

    def _telegraph(self, s: Sentence) -> Ordered | None:
        """ETL: an order to the engine, as a share of full revolutions."""
        share, number = TELEGRAPH.get(str(s["engtelposind"])), s["enginenum"]
        names = self._numbered(int(number) if isinstance(number, str) else None)
        return None if share is None else {n: self._within(n, share * self._ranges[n].full) for n in names} or None

    def _on_shafts(self, number: object, demand: float | None, mode: object) -> Ordered | None:
        """Revolutions for the shaft of a number."""
        told = {name: self._revolutions(name, demand, mode) for name in self._numbered(number)}
        return {name: value for name, value in told.items() if value is not None} or None

    def _numbered(self, number: object) -> tuple[str, ...]:
        """Shafts of a number; none stands for all, and so does 0 where no shaft is amidships."""
        alone = set(self._shafts) == {0}
        if number is None or (number == 0 and 0 not in self._shafts) or (number == 1 and alone):
            return tuple(self._shafts.values())
        return tuple(name for own, name in self._shafts.items() if own == number)

    def _revolutions(self, control: str, demand: float | None, mode: object) -> float | None:
        """An order of a shaft or thruster from rev/min or per cent of its full strength, as far as that goes.

        All of it is the limit of the gear; where that has none, what holds the approach.
        """
        if demand is None or mode not in ("P", "R") or (mode == "R" and not control.startswith("n")):
            return None
        if mode == "R":
            return self._within(control, demand / 60.0)
        whole = self._limits[control][1] if demand > 0 else -self._limits[control][0]
        return self._within(control, demand / 100.0 * (whole if math.isfinite(whole) else self._ranges[control].full))

    def _within(self, control: str, wanted: float) -> float:
        """An order as far as its range goes."""
        taken = self._ranges[control].taken(wanted) if control in self._ranges else wanted
        self.counts["clipped"] += taken != wanted
        return taken


def _is_report(s: Sentence) -> bool:
    """Whether it tells of a setting and orders none."""
    return (
        (s.kind == "HTC" and s["status"] == "R") or (s.kind == "TRC" and s["status"] != "C")
        or (s.kind == "ETL" and s["msgtype"] != "O")
    )  # fmt: skip


def _across(s: Sentence, unit: str) -> float | None:
    """Distance to starboard of the track [m]: who shall steer left is to starboard."""
    miles, side = s.number("ctrkerr"), s["dirs"]
    if miles is None or s[unit] != "N" or (side is None and miles):
        return None
    return miles * MILE if side == "L" else -miles * MILE


_POLE = 0.1
"""Pole of the integral action as a share of the loop's frequency: slow enough to leave turns alone."""

_NEAR = math.radians(5.0)
"""Heading error up to which the integral grows [rad]."""

_AHEAD = 2.5
"""Look-ahead of the track follower in ship lengths, as in the manoeuvre `track`."""


@dataclass
class SteeringControl:
    """A heading controller with integral action, and before it a track follower by line of sight.

    Attributes:
        limit: greatest rudder that it orders [rad].
        course: heading to steer [rad]; None while it does not steer.
        rate: greatest rate at which the heading to steer is approached [rad/s].
        across: distance to starboard of the track, where one is followed [m]; then `course` is the track's.
    """

    gains: Gains
    ahead: float
    limit: float
    course: float | None = None
    rate: float = math.inf
    across: float | None = None
    _reference: float | None = None
    _integral: float = 0.0

    @staticmethod
    def of(ship: Ship, rudder_limit: float) -> SteeringControl:
        """With the gains of an assumed merchant ship of this length and speed."""
        settings = Settings(ship.n_P or 0.0, ship.speed, ship.L_pp, rudder_limit)
        return SteeringControl(usual_gains(settings, _POLE), _AHEAD * ship.L_pp, rudder_limit)

    def steer(self, course: float, rate: float = math.inf, across: float | None = None) -> None:
        """Steer this heading [rad], or along a track of this direction from `across` metres to starboard of it."""
        self.course, self.rate, self.across = course, rate, across

    def let_go(self) -> None:
        """Steer no more; what was learned of the weather is forgotten."""
        self.course, self.rate, self.across, self._reference, self._integral = None, math.inf, None, None, 0.0

    def snapshot(self) -> list[float | None]:
        """What it steers, and what it has learned, for JSON."""
        return [self.course, self.rate, self.across, self._reference, self._integral]

    def restore(self, saved: Sequence[Any]) -> None:
        """Go on from what `snapshot` gave."""
        self.course, self.rate, self.across, self._reference, self._integral = saved

    def rudder(self, psi: float, r: float, dt: float, limit: float = math.inf) -> float:
        """Rudder for the next `dt` seconds [rad]; 0 while it does not steer.

        Args:
            psi, r: heading [rad] and rate of turn [rad/s].
            dt: time until it is asked again [s].
            limit: of the rudder, where a smaller one was ordered [rad].
        """
        if self.course is None:
            return 0.0
        aim = float(self.course if self.across is None else los_heading(self.course, self.across, self.ahead))
        before = psi if self._reference is None else self._reference
        step = float(wrapped(aim - before))
        here = aim if math.isinf(self.rate) else before + min(max(step, -self.rate * dt), self.rate * dt)
        self._reference = here
        turning = math.copysign(self.rate, step) if math.cos(aim - here) < 1.0 - 1e-12 else 0.0
        most = min(limit, self.limit)
        error = float(wrapped(here - psi))
        wanted = float(self.gains.K_p * error - self.gains.K_d * (r - turning) + self.gains.K_i * self._integral)
        if abs(wanted) < most and abs(error) < _NEAR:  # what a turn adds up is no weather
            self._integral += error * dt
        return min(max(wanted, -most), most)


class CourseKeeper:
    """The steering control of one ship of a loop, asked after each tick; saved, restored and reset with it.

    It follows the line through the start in the direction of the heading there, so that a current or a hull that is
    not alike on both sides does not set it off its course.
    """

    def __init__(self, loop: Loop, name: str) -> None:
        """Hold the present course of the ship `name`, by the order `delta` which it must have, from now on."""
        self._name, self._vessel = name, loop.vessels[name]
        plant = self._vessel.plant
        self._x, self._y, self._course = plant["x"], plant["y"], plant["psi"]
        self._control = SteeringControl.of(plant.ship, plant.ranges["delta"].high)
        loop.after(self.tick)
        loop.keep(f"the autopilot of {name}", self)

    def tick(self, loop: Loop) -> None:
        """Order the rudder for the next tick."""
        plant = self._vessel.plant
        if self._vessel.failure is None:
            north, east = plant["x"] - self._x, plant["y"] - self._y
            across = east * math.cos(self._course) - north * math.sin(self._course)
            self._control.steer(self._course, across=across)
            loop.order(self._name, "delta", self._control.rudder(plant["psi"], plant["r"], 1.0 / loop.rate))

    def snapshot(self) -> list[float | None]:
        """What it steers, for JSON."""
        return self._control.snapshot()

    def restore(self, saved: Sequence[Any]) -> None:
        """Go on from what `snapshot` gave."""
        self._control.restore(saved)

    def reset(self) -> None:
        """Back to the start."""
        self._control.let_go()
