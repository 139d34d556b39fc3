"""Axes, units and signs of position, heading, speeds and rate, decided by physics.

Track, heading, and rates and speeds are three sources (`check.track`): a reading of the columns is right if the track
follows the speeds turned by the heading, if the heading is the integral of the rate of turn, and if the ship goes about
where it points.  Every reading that the names leave open is tried; among those that fit about as well as the best, the
one that strains the names least is taken, and what still differs among them is a doubt.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import product

import numpy as np

from ...core.constants import KNOT
from ...core.values import dataclass, replace
from .. import Array, Trial, unwrapped
from ..check.relations import left_over
from ..geodesy import SEMI_AXIS
from ..units import KNOWN
from .roles import Signal

SPEEDS = {"m/s": 1.0, "kn": KNOT, "km/h": 1.0 / 3.6}
RATES = {"deg/s": np.pi / 180.0, "rad/s": 1.0, "deg/min": np.pi / 10800.0}
_TIME_STRAIN = {"s": 0.0, "ms": 0.5, "us": 1.0, "ns": 1.2, "min": 1.6}
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0}
_LOST = 0.25
_TURN, _TURN_FINE = 730.0, 36_000.0
"""Whole numbers from there to there are hundredths of degrees on a circle, in which loggers keep angles."""
_COURSE = 0.3  # weight of the angle between heading and course [rad]: drift and current are no fault
_ABSURD, _FASTEST = 5.0, 60.0
_ASTERN = 0.3  # what a ship that goes astern by its heading counts as [rad]
_BAND, _FLOOR = 1.3, 0.03
"""Readings with a miss up to this factor and share above the best are as good as it."""


@dataclass(frozen=True)
class Option:
    """One way to read something.

    Attributes:
        choice: what it decides, each with its answer, such as {"unit of psi": "deg"}.
        strain: how far it is from what the names say.
        values: what it makes of the columns.
    """

    choice: Mapping[str, str]
    strain: float
    values: tuple[Array, ...]


@dataclass(frozen=True)
class Reading:
    """All choices together, and how well they fit.

    Attributes:
        choice: answers by what they decide.
        strain: how far they are from what the names say.
        miss: of track, turn and course together; 0 fits.
        parts: misses by test.
    """

    choice: Mapping[str, str]
    strain: float
    miss: float
    parts: Mapping[str, float]


@dataclass(frozen=True)
class Verdict:
    """The reading that was taken, and what the others say against it.

    Attributes:
        best: the reading.
        rivals: for each choice, the reading that answers it otherwise and is most to be feared, whatever it changes.
        alone: for each choice, the reading that answers only this otherwise.
        smallest: the least miss of all.
        lost: miss of the best reading where none fits, so that only names count; else 0.
    """

    best: Reading
    rivals: Mapping[str, Reading]
    alone: Mapping[str, Reading]
    smallest: float
    lost: float = 0.0

    def _near(self, rival: Reading) -> bool:
        return rival.miss <= _BAND * self.smallest + _FLOOR

    def sure(self, key: str) -> bool:
        """Whether the tests or else the names decide a choice."""
        rival = self.rivals.get(key)
        return rival is None or not self._near(rival) or rival.strain > self.best.strain + 2.0

    def measured(self, key: str) -> bool:
        """Whether the tests decide a choice, the others held or strained by the names."""
        rival = self.alone.get(key)
        return rival is not None and not self._near(rival) and self.sure(key)

    def told(self, *keys: str) -> str:
        """The evidence for some choices in words; empty where the tests say nothing of them."""
        said: dict[str, list[str]] = {}
        now = self.best.parts
        for key in keys:
            rival = self.alone.get(key)
            if rival is None or self._near(rival):
                continue
            shown = max(now, key=lambda name, then=rival.parts: then.get(name, 0.0) - now[name])
            if shown in rival.parts:
                said.setdefault(shown, []).append(f"{_size(shown, rival.parts[shown])} if {rival.choice[key]}")
        return "; ".join(
            f"{_TESTS[shown]} within {_size(shown, now[shown])} ({', '.join(rest)})" for shown, rest in said.items()
        )


def _size(test: str, miss: float) -> str:
    """A miss in words: angles as such, others as a share of what was moved."""
    return f"{np.degrees(miss / _COURSE):.0f} deg" if test == "course" else f"{miss:.0%}"


_TESTS = {"track": "the track follows the speeds", "turn": "the heading follows the rate of turn",
          "course": "the ship goes where it points"}  # fmt: skip


def with_units(t: Array, found: Mapping[str, Signal]) -> Mapping[str, Signal]:
    """Positions without a unit in the one that makes them as fast as a speed beside them; in m where that fits."""
    pair = next((two for two in (("north", "east"), ("x", "y")) if set(two) <= set(found)), None)
    speed = next((found[role] for role in ("sog", "speed", "stw") if role in found), None)
    if pair is None or speed is None or any(found[role].unit for role in pair) or t.size < 20:
        return found
    far = max(t.size // 100, 1)
    t = t * (1.0 if np.nanmedian(np.diff(t)) < _TICK else 1e-3)
    went = np.hypot(*(found[role].values[far:] - found[role].values[:-far] for role in pair)) / (t[far:] - t[:-far])
    said = 0.5 * (speed.values[far:] + speed.values[:-far])
    moving = said > 0.3 * np.nanmax(said, initial=0.0)
    if moving.sum() < 10:
        return found
    ratio = float(np.nanmedian(went[moving] / said[moving]))
    units = [unit for unit, one in product(_PLACES, [speed.unit] if speed.unit else ["kn", "m/s", "km/h"])
             if abs(ratio * KNOWN[unit][1] / KNOWN[one][1] - 1.0) < _ALIKE]  # fmt: skip
    if not units or units[0] == "m":
        return found
    made = {role: replace(found[role].column, unit=units[0], where="speed") for role in pair}
    return {**found, **{role: replace(found[role], column=one) for role, one in made.items()}}


_PLACES, _ALIKE, _TICK = ("m", "NM", "km", "ft"), 0.1, 20.0
"""Units of a track, how well it follows a speed, and the step of a clock from which on it counts ms."""


class Motion:
    """The columns of the motion and every way to read them."""

    def __init__(self, t: Array, found: Mapping[str, Signal], times: Sequence[str] = (), rows: int = 10**9) -> None:
        every = max(len(t) // rows, 1)
        self.t, self.times = t[::every], ("s", *times)
        self.found = dict(found)
        self.values = {role: signal.values[::every] for role, signal in found.items()}

    @cached_property
    def headings(self) -> list[Option]:
        """Ways to read the heading [rad]."""
        role = next((name for name in ("heading", "yaw") if name in self.found), None)
        if {"qz", "qw"} <= set(self.found) and role is None:
            return self._quaternions()
        if role is None:
            return [Option({}, 0.0, ())]
        raw, said = self.values[role], self.found[role].unit
        out: list[Option] = []
        for unit, sense in product(_angles(raw, said), _SENSES):
            strain = unit_strain(unit, said) + _size_strain(raw, unit)
            strain += (
                0.0 if sense == _SENSES[0] else _turned_strain(self.found[role]) + (0.5 if sense == _SENSES[2] else 0.0)
            )
            psi = KNOWN[unit][1] * raw
            psi = dict(zip(_SENSES, (psi, 0.5 * np.pi - psi, -psi), strict=True))[sense]
            out.append(Option({"unit of psi": unit, "sense of psi": sense}, strain, (unwrapped(psi),)))
        return [one for one in out if one.strain < _ABSURD]

    def _quaternions(self) -> list[Option]:
        x, y = (self.values.get(name, np.zeros(self.t.size)) for name in ("qx", "qy"))
        z, w = self.values["qz"], self.values["qw"]
        yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        robotic = _robotic(self.found["qw"])
        ned = Option({"frame of the quaternion": "ned"}, 0.3 * robotic, (unwrapped(yaw),))
        enu = Option({"frame of the quaternion": "enu"}, 0.5 * (not robotic), (unwrapped(0.5 * np.pi - yaw),))
        return [ned, enu]

    @cached_property
    def positions(self) -> list[Option]:
        """Ways to read the position [m]."""
        if {"latitude", "longitude"} <= set(self.found):
            return self._fixes()
        for pair, strain in ((("north", "east"), 3.0), (("x", "y"), 1.0)):
            if set(pair) <= set(self.found):
                a, b = (self.values[role] * KNOWN[self.found[role].unit or "m"][1] for role in pair)
                first, second = (self.found[role].column.said for role in pair)
                robotic = pair == ("x", "y") and _robotic(self.found["x"])
                strain = 0.0 if robotic else strain
                mirrored = [Option({"north": first, "axes": MIRRORED}, _MIRROR, (a, -b))] if pair == ("x", "y") else []
                return [Option({"north": first, "axes": "x, y"}, 0.3 * robotic, (a, b)),
                        Option({"north": second, "axes": "y, x"}, strain, (b, a)), *mirrored]  # fmt: skip
        return [Option({}, 0.0, ())]

    def _fixes(self) -> list[Option]:
        latitude, longitude = self.values["latitude"], self.values["longitude"]
        first, second = (self.found[role].column.said for role in ("latitude", "longitude"))
        out = [Option({"north": first, "axes": "x, y"}, 0.0, _plane(latitude, longitude))]
        if np.nanmax(np.abs(longitude)) < 89.0:
            # of x and y either may be to the north
            metres = max(map(self.found["latitude"].column.score, ("x", "y"))) > 0.0
            out.append(Option({"north": second, "axes": "y, x"}, 0.5 if metres else 2.5, _plane(longitude, latitude)))
        return out

    @cached_property
    def velocities(self) -> list[Option]:
        """Ways to read speeds: parts, and whether these are of the body or of the earth."""
        pair = speeds_of(self.found)
        if pair is None:
            return [Option({}, 0.0, ())]
        a, b = (self.values[role] for role in pair)
        said = speed_unit_said(self.found, pair)
        fine = ("cm/s", "mm/s", "0.1 kn") if not said and _whole(a, b) else ()
        units = [(unit, unit_strain(unit, said) + 0.3 * k) for k, unit in enumerate((*speed_units(said), *fine))]
        out: list[Option] = []
        for unit, strain in units:
            size = KNOWN[unit][1]
            if pair[1] == "cog":
                for angle in _angles(b, self.found["cog"].unit):
                    more = unit_strain(angle, self.found["cog"].unit) + _size_strain(b, angle)
                    course = KNOWN[angle][1] * b
                    out.append(
                        Option(
                            {"unit of speed": unit, "unit of course": angle, "frame of speeds": "north, east"},
                            strain + more,
                            (size * a * np.cos(course), size * a * np.sin(course)),
                        )
                    )
                continue
            strains = _FRAMES[pair]
            for frame, more in strains.items():
                out.append(
                    Option({"unit of speed": unit, "frame of speeds": frame}, strain + more, (size * a, size * b))
                )
        return out

    @cached_property
    def rates(self) -> list[Option]:
        """Ways to read the rate of turn [rad/s]."""
        if "r" not in self.found:
            return [Option({}, 0.0, ())]
        raw, said = self.values["r"], self.found["r"].unit
        robotic = _robotic(self.found["r"])
        senses = ("to starboard", 1.0, 0.3 * robotic), ("to port", -1.0, 0.0 if robotic else 1.0)
        return [
            Option(
                {"unit of r": unit, "sense of r": sense},
                unit_strain(unit, said) + strain + 0.3 * k,
                (sign * size * raw,),
            )
            for k, (unit, size) in enumerate(RATES.items())
            for sense, sign, strain in senses
        ]

    def verdict(self) -> Verdict:
        """The reading that fits and strains least, with its rivals."""
        readings = [
            one for time in self.times for heading in self.headings
            for one in self._with(time, heading)
        ]  # fmt: skip
        lost = min(max(one.parts.get("track", 0.0), one.parts.get("turn", 0.0)) for one in readings)
        if lost > _LOST:
            # the sources contradict each other: they decide nothing
            readings = [replace(one, miss=0.0, parts={}) for one in readings]
        smallest = min(one.miss for one in readings)
        near = [one for one in readings if one.miss <= _BAND * smallest + _FLOOR]
        best = min(near, key=lambda one: (round(one.strain, 3), one.miss))
        rivals: dict[str, Reading] = {}
        for key, answer in best.choice.items():
            others = [one for one in readings if key in one.choice and one.choice[key] != answer]
            close = [one for one in others if one.miss <= _BAND * smallest + _FLOOR]
            if others:
                rivals[key] = min(close, key=lambda one: one.strain) if close else min(others, key=lambda one: one.miss)
        alone = {
            key: min(same, key=lambda one: one.miss) for key in best.choice
            if (same := [one for one in readings if _only(key, one.choice, best.choice)])
        }  # fmt: skip
        return Verdict(best, rivals, alone, smallest, lost if lost > _LOST else 0.0)

    def _with(self, time: str, heading: Option) -> list[Reading]:
        """Readings with this unit of time and this heading, with every rate, position and velocity."""
        t = self.t * TIMES[time]
        strain = heading.strain + _TIME_STRAIN[time]
        turned = [(rate, self._turn(t, heading, rate)) for rate in self.rates]
        moved = [
            (place, speed, self._track(t, heading, place, speed))
            for place in self.positions
            for speed in self.velocities
        ]
        out: list[Reading] = []
        for (rate, turn), (place, speed, track) in product(turned, moved):
            parts = {**turn, **track}
            choice = {
                **({"unit of time": time} if len(self.times) > 1 else {}),
                **heading.choice,
                **rate.choice,
                **place.choice,
                **speed.choice,
            }
            out.append(Reading(choice, strain + rate.strain + place.strain + speed.strain, sum(parts.values()), parts))
        return out

    def _turn(self, t: Array, heading: Option, rate: Option) -> dict[str, float]:
        if not (heading.values and rate.values):
            return {}
        miss = _missed(Trial("", t, {"psi": heading.values[0], "r": rate.values[0]}))
        return {} if miss is None else {"turn": miss}

    def _track(self, t: Array, heading: Option, place: Option, speed: Option) -> dict[str, float]:
        out: dict[str, float] = {}
        north = east = None
        psi = heading.values[0] if heading.values else np.zeros(t.size)
        if speed.values:
            frame = speed.choice["frame of speeds"]
            north, east = _to_earth(frame, speed.values[0], speed.values[1], psi)
            if place.values and (heading.values or "," in frame):
                u, v = north * np.cos(psi) + east * np.sin(psi), east * np.cos(psi) - north * np.sin(psi)
                miss = _missed(
                    Trial(
                        "",
                        t,
                        {
                            "x": place.values[0],
                            "y": place.values[1],
                            "psi": psi + 1e-9 * np.arange(t.size),
                            "u": u,
                            "v_m": v,
                        },
                    )
                )
                out |= {} if miss is None else {"track": miss}
        if heading.values and (place.values or (north is not None and "," in speed.choice["frame of speeds"])):
            went = _gone(t, *place.values) if place.values else speed.values
            if not place.values:
                went = _to_earth(speed.choice["frame of speeds"], went[0], went[1], psi)
            miss = _aside(went[0], went[1], psi)
            out |= {} if miss is None else {"course": _COURSE * miss}
        return out


_BODY, _TO_PORT = "ahead and starboard of the ship", "ahead and port of the ship"
_FRAMES = {
    ("u", "v"): {_BODY: 0.0, _TO_PORT: 1.0, "north, east": 1.2, "east, north": 2.0},
    ("vx", "vy"): {_BODY: 0.3, _TO_PORT: 1.0, "north, east": 0.3, "east, north": 1.0},
    ("v_north", "v_east"): {"north, east": 0.0, "east, north": 2.0},
}
"""Axes of each pair of velocities, and how far they are from its names; those of the earth have a comma."""


def speeds_of(found: Mapping[str, Signal]) -> tuple[str, str] | None:
    """The two quantities that tell the velocity; "U" beside a course is the speed over ground."""
    pairs = ("u", "v"), ("v_north", "v_east"), ("vx", "vy"), ("sog", "cog"), ("speed", "cog"), ("u", "cog")
    return next((two for two in pairs if set(two) <= set(found)), None)


def speed_unit_said(found: Mapping[str, Signal], pair: tuple[str, str]) -> str:
    """The unit that the log says of either part of a velocity."""
    return found[pair[0]].unit or (found[pair[1]].unit if pair[1] != "cog" else "")


def _only(key: str, one: Mapping[str, str], other: Mapping[str, str]) -> bool:
    """Whether two readings differ in one choice alone (the axes and the column that is north are one choice)."""
    differs = {name for name in one if one[name] != other.get(name)} - {"north"}
    return differs == {key}


MIRRORED = "x, -y"
"""Axes whose second one points to port of the first: a compass counts clockwise, and a map may not."""
_MIRROR = 2.1
"""Farther from the names than a yaw that counts anticlockwise, and less far than a heading that does."""
_SENSES = ("clockwise from north", "anticlockwise from east", "anticlockwise from north")
_ROBOTIC = re.compile(r"pose|odom|twist|orientation|angular", re.IGNORECASE)


def _robotic(signal: Signal) -> bool:
    """Whether a name is of the messages of robots, whose axes are east, north, up as often as north, east, down."""
    return bool(_ROBOTIC.search(signal.column.name))


def _turned_strain(signal: Signal) -> float:
    """How far a heading that grows to port is from its name."""
    return 2.5 if signal.role == "heading" else 0.7 if "yaw" in signal.column.name.lower() else 1.5


def speed_units(said: str) -> tuple[str, ...]:
    """Units that a speed may be in; one that the log says is among them."""
    return (*SPEEDS, *({said} - set(SPEEDS) - {""}))


def _whole(a: Array, b: Array) -> bool:
    """Whether speeds are whole numbers, and larger than those of ships in usual units."""
    both = np.concatenate([a, b])
    good = both[np.isfinite(both)]
    return bool(good.size and np.abs(good).max() > _FASTEST and (good == np.round(good)).all())


def _angles(raw: Array, said: str) -> tuple[str, ...]:
    """Units that an angle may be in: what the log says, else hundredths of degrees by size."""
    other = said or ("cdeg" if _hundredths(raw) else "gon" if _gons(raw) else "")
    return ("deg", "rad", *({other} - {"deg", "rad", ""}))


def _gons(raw: Array) -> bool:
    """Whether values fill a circle of 400 and none goes beyond."""
    good = raw[np.isfinite(raw)]
    return bool(good.size and good.min() >= 0.0 and 361.0 < good.max() <= 400.0)


def _hundredths(raw: Array) -> bool:
    good = raw[np.isfinite(raw)]
    return bool(good.size and _TURN < np.abs(good).max() <= _TURN_FINE and (good == np.round(good)).all())


def unit_strain(unit: str, said: str) -> float:
    """How far a unit is from what the log says of it."""
    return 0.0 if unit == said or not said else 3.0


def _size_strain(raw: Array, unit: str) -> float:
    """How odd the numbers would be in this unit of an angle."""
    largest = float(np.nanmax(np.abs(raw), initial=0.0))
    if unit not in ("deg", "rad"):
        return 0.0
    if unit == "deg" and _hundredths(raw):
        return 3.0
    if unit == "rad":
        return 4.0 if largest > 30.0 else 2.2 if largest > 7.0 else 0.0
    return 0.5 if largest < 6.5 else 0.0


def _plane(latitude: Array, longitude: Array) -> tuple[Array, Array]:
    middle = float(np.nanmean(latitude))
    north = SEMI_AXIS * np.radians(latitude - latitude[np.isfinite(latitude)][0])
    east = SEMI_AXIS * np.cos(np.radians(middle)) * np.radians(longitude - longitude[np.isfinite(longitude)][0])
    return north, east


def _to_earth(frame: str, a: Array, b: Array, psi: Array) -> tuple[Array, Array]:
    """Velocities north and east."""
    if frame == "north, east":
        return a, b
    if frame == "east, north":
        return b, a
    v = -b if "port" in frame else b
    return a * np.cos(psi) - v * np.sin(psi), a * np.sin(psi) + v * np.cos(psi)


def _missed(trial: Trial) -> float | None:
    """What the sources of a trial leave over, as a share of what they moved; at most 3."""
    now = left_over([trial], causes=False)
    if now is None:
        return None
    good = np.isfinite(now.left) & np.isfinite(now.moved)
    if good.sum() < 6 or not now.moved[good].any():
        return None
    return float(min(np.sqrt(np.sum(now.left[good] ** 2) / np.sum(now.moved[good] ** 2)), 3.0))


def _gone(t: Array, x: Array, y: Array) -> tuple[Array, Array]:
    """Velocities of a track over a fiftieth of it, which noise of fixes does not decide."""
    step = max(t.size // 50, 1)
    north, east = np.full(t.size, np.nan), np.full(t.size, np.nan)
    middle = slice(step, t.size - step)
    north[middle], east[middle] = x[2 * step :] - x[: -2 * step], y[2 * step :] - y[: -2 * step]
    return north, east


def _aside(north: Array, east: Array, psi: Array) -> float | None:
    """How far the ship goes aside of where it points [rad], where it goes at all."""
    speed = np.hypot(north, east)
    good = np.isfinite(speed) & np.isfinite(psi)
    good &= speed > 0.3 * np.nanmax(speed, initial=0.0)
    if good.sum() < 10:
        return None
    off = np.arctan2(east, north) - psi
    off = np.abs(np.arctan2(np.sin(off), np.cos(off))[good])
    if np.median(off) > 0.5 * np.pi:  # astern, or by a compass whose bow is the stern: no sense of turn tells that
        return float(np.hypot(np.sqrt(np.mean((np.pi - off) ** 2)), _ASTERN))
    return float(np.sqrt(np.mean(off**2)))
