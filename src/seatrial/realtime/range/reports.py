"""Contacts and alarms as sentences: VDM of transponders, TTM and TLL of the radar, ALF and ALR; ACN and ACK in.

The radar takes its bearings from the gyro compass, so a wrong compass turns what it reports; transponders tell their
own positions, whatever the receiver of the own ship says.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import Any

from ...core.constants import KNOT, MILE
from ...core.errors import RefusalError
from ...data.nmea.ais import Message as Form
from ...data.nmea.ais import Transponder, position, static
from ...data.nmea.sentences import NmeaError, Sentence, Value, encode
from ...data.nmea.ship import clock, compass
from ..bridge.view import OWN, beam
from ..loop import Loop
from ..on_wire import FIRST, OnWire
from ..plant import Plant
from ..wire import Message
from .alerts import CPA, GNSS, GYRO, PILOT, RUDDER, TRACK, Alarm, Alarms
from .contacts import Contact, Contacts, Sensed
from .scenario import Scenario

REPORTED = ("VDM", "TTM", "TLL", "ALF", "ALR", "ARC")
"""Sentences of the range beside those of the ship's own instruments."""

_MAKER = "RNG"
"""Mnemonic of the maker in alerts: identifiers from 10000 on need one."""

_SWEEP, _STATIC, _AGAIN = 2.0, 360.0, 30.0
"""Time between two reports of the radar, of static data, and of alarms that stand [s]."""

_TURNING = math.radians(10.0) / 60.0
"""Rate of turn from which a transponder of class A reports more often [rad/s]."""

_SHORT = {GYRO: 11, GNSS: 12, RUDDER: 20, TRACK: 31, PILOT: 41, CPA: 100}
"""Number of each kind of alarm in ALR, to which the instance is added."""


def interval(U: float, r: float, class_b: bool) -> float:
    """Time between two position reports [s] at a speed [m/s] and rate of turn [rad/s] (ITU-R M.1371-5, table 1)."""
    knots = U / KNOT
    if class_b:
        return 30.0 if knots > 2.0 else 180.0
    turning = abs(r) > _TURNING
    if knots > 23.0:
        return 2.0
    if knots > 14.0:
        return 2.0 if turning else 6.0
    return 10.0 / 3.0 if turning else 10.0


class Reports:
    """Reports on the wire of the own ship.

    Attributes:
        refused: acknowledgements refused so far.
    """

    def __init__(
        self, loop: Loop, on_wire: OnWire, scenario: Scenario, contacts: Contacts, alarms: Alarms,
        only: Iterable[str] = REPORTED,
    ) -> None:  # fmt: skip
        """Report from the next tick on; `only` these sentences."""
        self._on_wire, self._contacts, self._alarms, self._only = on_wire, contacts, alarms, frozenset(only)
        self._others = {one.name: one for one in scenario.others}
        self._sensed = None if scenario.sensing is None else Sensed(loop, OWN, scenario.sensing, scenario.seed)
        self._numbers = {name: k for k, name in enumerate((n for n in loop.vessels if n != OWN), 1)}
        self._by = {name: self._transponder(name, loop.vessels[name].plant) for name in self._numbers}
        self.reset()
        on_wire.speakers.append(self.speak)
        on_wire.listeners.append(self.hear)
        loop.keep("the reports", self)

    def speak(self, loop: Loop) -> Iterator[bytes]:
        """The lines that are due after this tick."""
        for kind, lines in (("VDM", self._ais), ("TTM", self._radar), ("ALF", self._alerts)):
            if kind in self._only or (kind == "TTM" and "TLL" in self._only) or (kind == "ALF" and "ALR" in self._only):
                yield from lines(loop)
        waiting, self._waiting = self._waiting, []
        yield from waiting

    def hear(self, message: Message, loop: Loop) -> None:
        """Acknowledge by ACN or ACK."""
        sentence = message.sentence
        if sentence.kind not in ("ACN", "ACK") or not self._on_wire.authority.may(message.sender):
            return
        try:
            self._obey(sentence, loop.t)
        except RefusalError:
            self.refused += 1
            if sentence.kind == "ACN" and "ARC" in self._only:
                said = {"time": self._clock(loop.t), "mfrcode": sentence["mfrcode"], "alertid": sentence["alertid"],
                        "alertinst": sentence["alertnum"], "alertcmd": sentence["alertcmd"]}  # fmt: skip
                self._waiting.append(encode(Sentence("II", "ARC", said)))

    def _obey(self, sentence: Sentence, t: float) -> None:
        if sentence.kind == "ACK":
            wanted = sentence["alarmid"]
            found = [key for key in self._alarms.alarms if _short(*key) == wanted]
            self._alarms.acknowledge(*(found[0] if found else (0, 0)), t)
            return
        identifier, instance = sentence.number("alertid"), sentence.number("alertnum")
        command, maker = sentence["alertcmd"], sentence["mfrcode"]
        if maker not in (None, _MAKER) or identifier is None or instance is None or command not in ("A", "Q"):
            raise RefusalError("not a command to an alarm of this ship")
        if command == "A":
            self._alarms.acknowledge(int(identifier), int(instance), t)
        self._sent.pop(f"{int(identifier)} {int(instance)}", None)

    def _transponder(self, name: str, plant: Plant) -> Transponder:
        other = self._others.get(name)
        mmsi = (other.sailing.mmsi if other is not None else 0) or FIRST + self._numbers[name] - 1
        class_b = other is not None and other.ais == "class B"
        # the antenna of another ship is taken to be amidships
        kind, status = (None, "under way") if other is None else (other.sailing.kind, other.sailing.status)
        return Transponder(mmsi, other.name if other else plant.ship.name, plant.ship.L_pp, beam(plant),
                           float(plant.ship.model.draught), class_b=class_b, kind=kind, status=status)  # fmt: skip

    def _ais(self, loop: Loop) -> Iterator[bytes]:
        for name, number in self._numbers.items():
            other, vessel, by = self._others.get(name), loop.vessels[name], self._by[name]
            if (other is not None and other.ais == "none") or vessel.failure is not None:
                continue
            if self._sensed is not None and not self._sensed.sends(name):
                continue
            plant, first = vessel.plant, float(number % 10)
            if loop.t + 1e-9 >= self._static.get(name, first):
                self._static[name] = loop.t + _STATIC
                yield from static(by, "VDM", number)
            if loop.t + 1e-9 < self._next.get(name, first):
                continue
            said = self._motion(loop.t, plant)
            period = interval(said["U"], said["r"], by.class_b)
            self._next[name] = loop.t + period
            form: Form = 2 if other is not None and other.ais == "class A assigned" else 3 if period % 1.0 else 1
            off = (0.0, 0.0) if self._sensed is None else self._sensed.heard(name)
            if off is not None:
                said = self._motion(loop.t, plant, off)
                lines = position(by, said, clock(self._on_wire.fittings, said).second, "VDM", form)
                self._late.append((loop.t + (0.0 if self._sensed is None else self._sensed.delay), lines))
        while self._late and self._late[0][0] <= loop.t + 1e-9:
            yield from self._late.pop(0)[1]

    def _motion(self, t: float, plant: Plant, off: tuple[float, float] = (0.0, 0.0)) -> dict[str, float]:
        x, y, psi, u, v = (plant[state] for state in ("x", "y", "psi", "u", "v_m"))
        latitude, longitude = self._on_wire.fittings.datum.place(x + off[0], y + off[1])
        return {"t": t, "psi": psi, "r": plant["r"], "latitude": latitude, "longitude": longitude,
                "U": math.hypot(u, v), "chi": psi + math.atan2(v, u)}  # fmt: skip

    def _radar(self, loop: Loop) -> Iterator[bytes]:
        if loop.t + 1e-9 < self._sweep:
            return
        self._sweep = loop.t + _SWEEP
        own = loop.vessels[OWN].plant
        psi = self._on_wire.latest.get("psi", own["psi"])
        turned = math.remainder(psi - own["psi"], math.tau)
        seen = self._contacts.seen if self._sensed is None else self._sensed.contacts(loop.t)
        for name, contact in seen.items():
            other = self._others.get(name)
            if other is not None and not other.radar:
                continue
            with suppress(NmeaError):  # a distance or a speed that does not fit in a sentence
                if "TTM" in self._only:
                    yield encode(Sentence("RA", "TTM", self._tracked(loop.t, contact, turned)))
                if "TLL" in self._only:
                    yield encode(Sentence("RA", "TLL", self._placed(loop.t, contact, turned)))

    def _tracked(self, t: float, seen: Contact, turned: float) -> dict[str, Value]:
        return {
            "targetnum": self._numbers[seen.name], "targetdist": seen.distance / MILE,
            "targetbearing": compass(seen.bearing + turned), "targetbearingu": "T", "targetspeed": seen.U / KNOT,
            "targetcourse": compass(seen.chi + turned), "targetcourseu": "T", "closestapproach": seen.cpa / MILE,
            "timetoCPA": min(max(seen.tcpa / 60.0, -9999.0), 9999.0), "speedu": "N",
            "targetname": _name(seen.name), "targetstatus": "T", "reftarget": None, "time": self._clock(t),
            "acquisitiontype": "A",
        }  # fmt: skip

    def _placed(self, t: float, seen: Contact, turned: float) -> dict[str, Value]:
        """Place of a contact: from the receiver of the own ship on, by bearing and distance."""
        latest, datum = self._on_wire.latest, self._on_wire.fittings.datum
        if "latitude" not in latest:
            raise NmeaError("no position yet", "field")
        x, y = datum.north_east(latest["latitude"], latest["longitude"])
        (ahead, aside), psi = self._on_wire.fittings.antenna, latest.get("psi", 0.0)
        x -= ahead * math.cos(psi) - aside * math.sin(psi)
        y -= ahead * math.sin(psi) + aside * math.cos(psi)
        bearing = seen.bearing + turned
        latitude, longitude = datum.place(x + seen.distance * math.cos(bearing), y + seen.distance * math.sin(bearing))
        return {"targetnum": self._numbers[seen.name], "targetlat": latitude, "targetlon": longitude,
                "targetname": _name(seen.name), "time": self._clock(t), "status": "T", "reftarget": None}  # fmt: skip

    def _alerts(self, loop: Loop) -> Iterator[bytes]:
        for (identifier, instance), alarm in self._alarms.alarms.items():
            key = f"{identifier} {instance}"
            revision, last = self._sent.get(key, (0, -math.inf))
            if alarm.revision == revision and (alarm.state == "N" or loop.t < last + _AGAIN - 1e-9):
                continue
            self._sent[key] = alarm.revision, loop.t
            yield from self._alert(alarm)

    def _alert(self, alarm: Alarm) -> Iterator[bytes]:
        cause, time = alarm.cause, self._clock(alarm.changed)
        self._count = (self._count + 1) % 10
        if "ALF" in self._only:
            yield encode(Sentence("II", "ALF", {
                "numSen": 1, "senNum": 1, "seqmid": self._count, "timelastchange": time,
                "alertcat": "A" if cause.identifier == CPA else "B", "alertpriority": cause.priority,
                "alertstate": alarm.state, "mfrcode": _MAKER, "alertid": cause.identifier,
                "alertinst": cause.instance, "revisionctr": alarm.revision, "escalationctr": 0,
                "alerttxt": cause.title,
            }))  # fmt: skip
        if "ALR" in self._only:
            yield encode(Sentence("II", "ALR", {
                "timealarmchange": time, "alarmnum": _short(cause.identifier, cause.instance),
                "alarmcond": "A" if alarm.state in ("V", "A") else "V",
                "alarmstate": "V" if alarm.state in ("V", "U") else "A", "alarmtext": cause.title,
            }))  # fmt: skip

    def _clock(self, t: float) -> float:
        moment = clock(self._on_wire.fittings, {"t": t})
        return moment.hour * 3600.0 + moment.minute * 60.0 + moment.second + moment.microsecond * 1e-6

    def snapshot(self) -> dict[str, Any]:
        return {"next": self._next, "static": self._static, "sweep": self._sweep, "sent": self._sent,
                "count": self._count, "late": [[t, [line.decode() for line in lines]] for t, lines in self._late]}

    def restore(self, saved: Mapping[str, Any]) -> None:
        self.reset()
        self._next, self._static, self._sweep = dict(saved["next"]), dict(saved["static"]), saved["sweep"]
        self._sent = {key: (int(revision), float(t)) for key, (revision, t) in saved["sent"].items()}
        self._count = saved["count"]
        self._late = [(float(t), [line.encode() for line in lines]) for t, lines in saved["late"]]

    def reset(self) -> None:
        self._next: dict[str, float] = {}
        self._static: dict[str, float] = {}
        self._sent: dict[str, tuple[int, float]] = {}
        self._waiting: list[bytes] = []
        self._late: list[tuple[float, list[bytes]]] = []
        self._sweep, self._count, self.refused = 0.0, 0, 0


def _short(identifier: int, instance: int) -> int:
    """Number of an alarm in ALR, of three digits."""
    return _SHORT.get(identifier, 0) + instance


def _name(name: str) -> str | None:
    """A name as a field of a sentence takes it."""
    return "".join(c if c.isascii() and (c.isalnum() or c in " _./-") else "_" for c in name)[:12].strip() or None
