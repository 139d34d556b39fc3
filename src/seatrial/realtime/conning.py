"""Steering by NMEA 0183 sentences, and the ship's own steering control.

Orders are ROR, HTC, TRC, PRC and ETL; APB and XTE guide the track follower of the steering control.  One sender has
command at a time: the first that gives an order.  Orders of other senders are refused until the first has been silent
for `hold` seconds.  Any valid sentence of the commander ends the silence; after it the last orders stay in force.

The steering control holds a heading or follows a track where it is given these instead of a rudder angle.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from ..core.constants import MILE
from ..core.values import dataclass
from ..data.nmea.sentences import Sentence
from ..data.nmea.ship import Fittings
from ..manoeuvres import Settings
from ..manoeuvres.autopilot import Gains, usual_gains, wrapped
from ..manoeuvres.track import los_heading
from ..ships import Ship
from ..ships.felt import idle
from .helm import limits, obeying, ranges
from .wave_filter import WaveFilter
from .wire import ANYBODY, Authority

TELEGRAPH: Mapping[str, float] = MappingProxyType({
    "00": 0.0, "01": 0.3, "02": 0.45, "03": 0.65, "04": 0.85, "05": 1.0,
    "11": -0.3, "12": -0.45, "13": -0.65, "14": -0.85, "15": -1.0,
})  # fmt: skip
"""Share of full revolutions by telegraph position, from stop over dead slow to full; assumed, since ships differ."""

_RAD = math.pi / 180.0

Ordered = dict[str, float]
"""Orders by the name of the control, SI units and radians."""


def rudders(ship: Ship) -> tuple[str, ...]:
    """Controls that are rudders, port to starboard."""
    return tuple(name for name in ship.model.controls if name.partition("_")[0] == "delta")


def shafts(ship: Ship) -> tuple[str, ...]:
    """Controls that are propellers or thrusters for propulsion ahead, in revolutions, port to starboard."""
    pairs, dead = zip(ship.model.controls, ship.model.follows, strict=True), idle(ship)
    return tuple(name for name, (order, _) in pairs
                 if order == "n_P" and name.partition("_")[0] == "n" and name not in dead)  # fmt: skip


def thrusters(ship: Ship) -> Mapping[int, tuple[str, str | None]]:
    """Controls of each thruster by its number in TRC (odd at the bow, even at the stern): strength, azimuth or None."""
    odd, even = iter(range(1, 99, 2)), iter(range(2, 99, 2))
    found: dict[int, tuple[str, str | None]] = {}
    for control in ship.model.controls:
        kind, _, name = control.partition("_")
        if kind in ("n", "f", "throttle") and name and not name.startswith("P"):
            azimuth = f"alpha_{name}"
            found[next(odd if "bow" in name else even)] = control, azimuth if azimuth in ship.model.controls else None
    return found


ORDERS = ("ROR", "HTC", "TRC", "PRC", "ETL", "APB", "XTE")
"""Sentences that give orders: rudder, heading or track, thrusters, propulsion, telegraph, autopilot, cross track."""


class Conning:
    """Command of a ship by wire: which sender has it, and the steering mode.

    Attributes:
        commander: sender in command; empty if there is none.
        mode: "none", "rudder", "heading" or "track".
        counts: orders by outcome: taken, refused (another sender has command), unfit (not applicable to this ship, or
            incomplete), clipped (taken up to the limit of the gear).
        heard: time of the last valid sentence of the commander [simulated s]; None before the first order.
        stale: whether the commander has been silent for longer than `hold`.
        listens: whether orders are taken at all; else each is refused.
    """

    def __init__(
        self, ship: Ship, fittings: Fittings, hold: float = 10.0, full: float | None = None, steers: bool = True,
        authority: Authority = ANYBODY,
    ) -> None:  # fmt: skip
        """Start without a commander.

        Args:
            ship: the ship that is steered.
            fittings: which of its controls are rudders and shafts.
            hold: longest silence of a commander [simulated s].
            full: revolutions that count as full, within the limits of the gear [1/s]; by default those of the approach.
            steers: whether compass and rate gyro exist for a steering control; without them, or without a rudder,
                headings are unfit.
            authority: senders that may have command.
        """
        self.ship, self.hold, self._authority = ship, hold, authority
        self._shafts = {number: name for name, number in fittings.numbers.items()}
        self._rudders, self._thrusters = fittings.rudders, thrusters(ship)
        self._known, self._ranges = obeying(ship), ranges(ship, full)
        self._limits = {name: limits(ship, name) for name in ship.model.controls}
        self.control = SteeringControl.of(ship, self._ranges["delta"].high if "delta" in self._ranges else 35.0 * _RAD)
        self.counts: Counter[str] = Counter()
        self._steers = steers and bool(self._rudders or "delta" in self._known)
        self.listens = True
        self.reset()
        answers = (self._rudder, self._heading_track, self._thruster, self._propulsion, self._telegraph,
                   self._autopilot, self._cross_track)  # fmt: skip
        self._answers: Mapping[str, Callable[[Sentence], Ordered | None]] = dict(zip(ORDERS, answers, strict=True))

    def reset(self) -> None:
        """Remove the commander and stop the steering control; the counts stay."""
        self.commander, self.mode, self.stale = "", "none", False
        self.heard: float | None = None
        self._limit = math.inf
        self._track: float | None = None
        self.control.let_go()

    def listen(self, on: bool) -> None:
        """Take orders from now on, or remove the commander and refuse all."""
        self.listens = on
        if not on:
            self.reset()

    def snapshot(self) -> dict[str, Any]:
        return {"commander": self.commander, "mode": self.mode, "stale": self.stale, "heard": self.heard,
                "listens": self.listens, "limit": self._limit, "track": self._track,
                "control": self.control.snapshot()}  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        self.commander, self.mode, self.stale = saved["commander"], saved["mode"], saved["stale"]
        self.heard, self._limit, self._track = saved["heard"], saved["limit"], saved["track"]
        self.listens = saved["listens"]
        self.control.restore(saved["control"])

    def take(self, sentence: Sentence, sender: str, t: float) -> Ordered:
        """Immediate orders of a sentence; those of the steering control come from `steered`."""
        if sender == self.commander:  # "" is never a sender
            self.heard, self.stale = t, False
        answer = self._answers.get(sentence.kind)
        if answer is None or _is_report(sentence):
            return {}
        if self.refusal(sender, t):
            self.counts["refused"] += 1
            return {}
        ordered = answer(sentence)
        if ordered is None:
            self.counts["unfit"] += 1
            return {}
        self.counts["taken"] += 1
        self.commander, self.heard, self.stale = sender, t, False
        return ordered

    def refusal(self, sender: str, t: float) -> str:
        """Why orders of a sender are refused now; empty if they are taken."""
        if not self.listens:
            return "somebody else steers, who has not handed over to the wire"
        if not self._authority.may(sender):
            return "this sender may not have command"
        another = sender != self.commander and self.commander != "" and not self._silent(t)
        return f"{self.commander} has command" if another else ""

    def missing(self, kind: str) -> str:
        """What the ship lacks to obey any order of this kind, HTC, ROR, TRC or PRC; empty if it lacks nothing."""
        if kind == "HTC" and not self._steers:
            return "the ship has no rudder, or no gyros, to steer a heading with"
        if kind == "ROR" and not self._all_rudders(0.0):
            return "the ship has no rudder"
        if kind == "TRC" and not self._thrusters:
            return "the ship has no thruster"
        return "the ship has no shaft" if kind == "PRC" and not self._shafts else ""

    def steered(self, psi: float, r: float, t: float, dt: float) -> Ordered:
        """Rudder orders of the steering control for the next `dt` seconds; empty while it does not steer."""
        self.watch(t)
        if self.mode not in ("heading", "track"):
            return {}
        if self.stale and self.mode == "track":
            self.control.across = None  # the cross-track error is out of date; the direction of the track stays
        return self._all_rudders(self.control.rudder(psi, r, dt, self._limit))

    def watch(self, t: float) -> None:
        """Update `stale`."""
        self.stale = self.commander != "" and self._silent(t)

    def _silent(self, t: float) -> bool:
        return self.heard is not None and t - self.heard > self.hold

    def _all_rudders(self, angle: float) -> Ordered:
        if self._rudders:
            return dict.fromkeys(self._rudders, angle)
        return {"delta": angle} if "delta" in self._known else {}

    def _by_rudder(self, angles: Ordered) -> Ordered | None:
        if angles:
            self.mode = "rudder"
            self.control.let_go()
        return angles or None

    def _rudder(self, s: Sentence) -> Ordered | None:
        """ROR: an angle for each rudder; a single rudder obeys the starboard field."""
        starboard = s.number("stbdrudderorder") if s["stbdrudderstatus"] == "A" else None
        port = s.number("portrudderorder") if s["portrudderstatus"] == "A" else None
        if len(self._rudders) > 1:
            half = len(self._rudders) // 2
            pairs = [(name, port if k < half else starboard) for k, name in enumerate(self._rudders)]
            return self._by_rudder({name: angle * _RAD for name, angle in pairs if angle is not None})
        return self._by_rudder({} if starboard is None else self._all_rudders(starboard * _RAD))

    def _heading_track(self, s: Sentence) -> Ordered | None:
        """HTC: override and the manual modes order a rudder angle, the others a heading or a track."""
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
        course, most = wanted * _RAD, math.inf if limit is None else limit * _RAD
        if mode != "T":
            return self._steer(course, limit=most, rate=self._rate(s))
        same = self._track is not None and abs(math.remainder(course - self._track, 2.0 * math.pi)) < 1e-3
        across = self.control.across if same else None
        return self._steer(course, across or 0.0, most, self._rate(s))

    def _steer(
        self, course: float, across: float | None = None, limit: float = math.inf, rate: float = math.inf
    ) -> Ordered:
        """Hold a heading, or follow a track of that direction from `across` metres to starboard of it."""
        self.mode, self._limit = "heading" if across is None else "track", limit
        if across is not None:
            self._track = course
        self.control.steer(course, rate, across)
        return {}

    def _rate(self, s: Sentence) -> float:
        """Limit of the rate of turn towards a new heading [rad/s]."""
        rate, radius = s.number("cmdturnrate"), s.number("cmdturnradius")
        if s["turnmode"] == "T" and rate:
            return rate * _RAD / 60.0
        return self.ship.speed / (radius * MILE) if s["turnmode"] == "R" and radius else math.inf

    def _autopilot(self, s: Sentence) -> Ordered | None:
        """APB: follow the track from origin to destination, or the given heading where the track is incomplete."""
        if s["LCgwarn"] != "A" or s["LCcwarn"] != "A" or not self._steers:
            return None
        across, track = _across(s, "ctrkUnit"), s.number("bearO2D")
        if across is not None and track is not None and s["bearO2Du"] == "T":
            return self._steer(track * _RAD, across)
        heading = s.number("bearS")
        return None if heading is None or s["bearSu"] != "T" else self._steer(heading * _RAD)

    def _cross_track(self, s: Sentence) -> Ordered | None:
        """XTE: cross-track error of the track that is already followed."""
        across = _across(s, "disUnit")
        if self.mode != "track" or across is None or self._track is None or "V" in (s["gwarn"], s["LCcwarn"]):
            return None
        return self._steer(self._track, across, self._limit, self.control.rate)

    def _thruster(self, s: Sentence) -> Ordered | None:
        """TRC: strength and azimuth of a thruster; a sentence without the flag C is not a command."""
        number = s["thrusternum"]
        strength, azimuth = self._thrusters.get(number, ("", None)) if isinstance(number, int) else ("", None)
        value = self._revolutions(strength, s.number("dmdrpm"), s["rpmmode"]) if strength else None
        angle = s.number("dmdazimuth")
        out: Ordered = {} if value is None else {strength: value}
        if azimuth is not None and angle is not None:
            out[azimuth] = math.remainder(angle * _RAD, 2.0 * math.pi)
        return out or None

    def _propulsion(self, s: Sentence) -> Ordered | None:
        """PRC: revolutions of a shaft, from the demand or, without one, from the lever position."""
        demand, mode = s.number("rpmdemand"), s["rpmdemandstatus"]
        if demand is None or mode not in ("P", "R"):
            demand, mode = (s.number("leverdmdpos"), "P") if s["leverdmdstatus"] == "A" else (None, None)
        told = {name: self._revolutions(name, demand, mode) for name in self._numbered(s["engineshaftnum"])}
        return {name: value for name, value in told.items() if value is not None} or None

    def _telegraph(self, s: Sentence) -> Ordered | None:
        """ETL: engine order as a share of full revolutions."""
        share, number = TELEGRAPH.get(str(s["engtelposind"])), s["enginenum"]
        names = self._numbered(int(number) if isinstance(number, str) else None)
        return None if share is None else {n: self._within(n, share * self._ranges[n].full) for n in names} or None

    def _numbered(self, number: object) -> tuple[str, ...]:
        """Shafts with a number; None selects all, and so does 0 where no shaft is amidships."""
        alone = set(self._shafts) == {0}
        if number is None or (number == 0 and 0 not in self._shafts) or (number == 1 and alone):
            return tuple(self._shafts.values())
        return tuple(name for own, name in self._shafts.items() if own == number)

    def _revolutions(self, control: str, demand: float | None, mode: object) -> float | None:
        """Order of a shaft or thruster from rev/min or per cent of full strength, clipped to its range.

        100 per cent is the limit of the gear or, without a limit, the revolutions that hold the approach speed.
        """
        if demand is None or mode not in ("P", "R") or (mode == "R" and not control.startswith("n")):
            return None
        if mode == "R":
            return self._within(control, demand / 60.0)
        whole = self._limits[control][1] if demand > 0 else -self._limits[control][0]
        return self._within(control, demand / 100.0 * (whole if math.isfinite(whole) else self._ranges[control].full))

    def _within(self, control: str, wanted: float) -> float:
        """An order clipped to its range."""
        taken = self._ranges[control].taken(wanted) if control in self._ranges else wanted
        self.counts["clipped"] += taken != wanted
        return taken


def _is_report(s: Sentence) -> bool:
    """Whether the sentence reports a setting instead of ordering one."""
    if s.kind == "HTC":
        return s["status"] == "R"
    return (s.kind == "TRC" and s["status"] != "C") or (s.kind == "ETL" and s["msgtype"] != "O")


def _across(s: Sentence, unit: str) -> float | None:
    """Distance to starboard of the track [m]: "steer left" means that the ship is to starboard."""
    miles, side = s.number("ctrkerr"), s["dirs"]
    if miles is None or s[unit] != "N" or (side is None and miles):
        return None
    return miles * MILE if side == "L" else -miles * MILE


_POLE = 0.1
"""Pole of the integral action relative to the frequency of the loop: too slow to affect turns."""

_NEAR = math.radians(5.0)
"""Largest heading error at which the integral is updated [rad]."""

_AHEAD = 2.5
"""Look-ahead distance of the track follower in ship lengths, as in the manoeuvre `track`."""


@dataclass
class SteeringControl:
    """Heading controller with integral action, preceded by a line-of-sight track follower.

    Attributes:
        limit: largest rudder order [rad].
        course: heading to steer [rad]; None while it does not steer.
        rate: limit of the rate at which the reference heading approaches `course` [rad/s].
        across: distance to starboard of the track [m]; `course` is then the direction of the track. None: no track.
        filter: takes what waves add out of heading and rate of turn; None: there are none.
    """

    gains: Gains
    ahead: float
    limit: float
    course: float | None = None
    rate: float = math.inf
    across: float | None = None
    filter: WaveFilter | None = None
    _reference: float | None = None
    _integral: float = 0.0

    @staticmethod
    def of(ship: Ship, rudder_limit: float) -> SteeringControl:
        """A control with the gains of an assumed merchant ship of this length and speed."""
        settings = Settings(ship.n_P or 0.0, ship.speed, ship.L_pp, rudder_limit)
        return SteeringControl(usual_gains(settings, _POLE), _AHEAD * ship.L_pp, rudder_limit)

    def steer(self, course: float, rate: float = math.inf, across: float | None = None) -> None:
        """Steer this heading [rad], or a track of this direction from `across` metres to starboard of it."""
        self.course, self.rate, self.across = course, rate, across

    def let_go(self) -> None:
        """Stop steering and clear the integral."""
        self.course, self.rate, self.across, self._reference, self._integral = None, math.inf, None, None, 0.0
        if self.filter is not None:
            self.filter.reset()

    def snapshot(self) -> list[float | None]:
        own = [self.course, self.rate, self.across, self._reference, self._integral]
        return own if self.filter is None else [*own, *self.filter.snapshot()]

    def restore(self, saved: Sequence[Any]) -> None:
        self.course, self.rate, self.across, self._reference, self._integral = saved[:5]
        if self.filter is not None:
            self.filter.restore(saved[5:])

    def rudder(self, psi: float, r: float, dt: float, limit: float = math.inf) -> float:
        """Rudder for the next `dt` seconds [rad]; 0 while it does not steer.

        Args:
            psi, r: heading [rad] and rate of turn [rad/s].
            dt: time until the next call [s].
            limit: rudder limit, if a smaller one was ordered [rad].
        """
        if self.course is None:
            return 0.0
        if self.filter is not None:
            psi, r = self.filter.step(psi, r, dt)
        aim = float(self.course if self.across is None else los_heading(self.course, self.across, self.ahead))
        before = psi if self._reference is None else self._reference
        step = float(wrapped(aim - before))
        here = aim if math.isinf(self.rate) else before + min(max(step, -self.rate * dt), self.rate * dt)
        self._reference = here
        turning = math.copysign(self.rate, step) if math.cos(aim - here) < 1.0 - 1e-12 else 0.0
        most = min(limit, self.limit)
        error = float(wrapped(here - psi))
        wanted = float(self.gains.K_p * error - self.gains.K_d * (r - turning) + self.gains.K_i * self._integral)
        if abs(wanted) < most and abs(error) < _NEAR:  # errors of a turn are not a steady disturbance
            self._integral += error * dt
        return min(max(wanted, -most), most)
