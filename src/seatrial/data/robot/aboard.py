"""What the messages of a robot's log say, as readings of instruments; by which axes and with what doubts.

A source is a topic and the letters of its type, ``/imu/data:Imu``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np

from ...core.constants import ARC_DEGREE
from .. import Array, DataError
from ..instruments import Heard
from ..nmea.heard import hear
from ..nmea.readings import readings
from ..nmea.sentences import NmeaError
from ..units import standard_unit
from .bearings import AXES, Track, axes_of, in_the_earth, likeness, track
from .messages import READ, earth_fixed
from .series import Series, behind
from .topics import Number, Topics

# Stamps above this are times since 1970, those below times since some start [ns].
_EPOCH = 10**17
_NED = re.compile(r"(^|[_/])(ned|frd)($|[_/])")
_NAME = re.compile(r"[A-Za-z]\w*")
_SENSE = {"left": "port", "port": "port", "right": "starboard", "starboard": "starboard"}
_THRUST = re.compile(r"(?:^|[/_])(left|right|port|starboard)(?:_\w*?)?[/_](thrust|pos|angle)(?:_cmd)?$")
_MOTORS: Mapping[str, str] = {"[left]": "throttle_port", "[right]": "throttle_starboard", "[throttle]": "throttle",
                              "[rudder]": "steering"}  # fmt: skip
_LOGS: Mapping[str, str] = {"u": "u_log", "v_m": "v_log"}
_CLOCK = ("time_of_day", "time_of_none", "day")
_READINGS = ("psi", "r", "latitude", "longitude", "U_G", "gamma_G", "u_log", "v_log")
_ALIKE = 0.5
"""A rate of turn is that of a heading, or of its opposite, from this correlation on."""
_TURNS = 0.005
"""A ship that turns does so by this at least [rad/s]."""
Motion = dict[str, tuple[Array, dict[str, Array]]]
"""Times and readings by topic."""


class Aboard:
    """Readings of one recording, as they are made of its series.

    Attributes:
        heard: the readings by source.
        steps: what was done and what is in doubt, in words.
        epoch: seconds since 1970 at time 0; None where the log has no date.
        named: topic and unit of the channels of bare numbers.
        frames: names of the frames of the motion.
    """

    def __init__(self, path: Path, series: Mapping[str, Series], topics: Topics) -> None:
        self.path, self.series, self.topics = path, series, topics
        self.heard, self.steps = Heard(), list[str]()
        self.named: dict[str, tuple[str, str]] = {}
        self.frames: dict[str, str] = {}
        ticks = [int(np.min(np.array(one.times))) for one in series.values() if len(one.times)]
        self._first = min(ticks, default=0)
        self.epoch = self._first / 1e9 if self._first > _EPOCH else None
        self._late = behind(series.values())

    def listen(self) -> None:
        """Take all series.

        Raises:
            DataError: axes or topics that the log does not settle.
        """
        motion: Motion = {}
        for topic, one in self._chosen().items():
            short = READ[one.kind][0]
            if short == "Sen":
                self._sentences(topic, one)
            elif short in ("Num", "Out", "Hud"):
                self._numbers(topic, one)
            else:
                motion[topic] = self._seconds(one), self._in_axes(topic, one)
        ground = self._ground(motion)
        for topic in list(motion):
            self._settled(topic, motion, ground)
        self._agreeing(motion)
        for topic, (t, columns) in motion.items():
            for name, values in columns.items():
                self.heard.whole(self.source(topic), _LOGS.get(name, name), t, values)

    def source(self, topic: str) -> str:
        """Name of a source."""
        return f"{topic}:{READ[self.series[topic].kind][0]}"

    def _seconds(self, one: Series) -> Array:
        late = 0 if one.stamped else self._late
        return (np.array(one.times) - (self._first + late)) / 1e9

    def _chosen(self) -> dict[str, Series]:
        """The series without those of a type of which the mapping names another one."""
        left = dict(self.series)
        for short, asked in (("Odo", self.topics.odometry), ("Twi", self.topics.twist), ("Fix", self.topics.fix)):
            there = [topic for topic, one in self.series.items() if READ[one.kind][0] == short]
            if asked is not None:
                self.topics.known(self.path, asked, there)
                left = {topic: one for topic, one in left.items() if topic == asked or topic not in there}
                self.steps += [f"{topic}: left aside, the mapping names {asked}" for topic in there if topic != asked]
        return left

    def _in_axes(self, topic: str, one: Series) -> dict[str, Array]:
        """Readings of a topic in our axes, as its frames say."""
        columns = {name: one.column(name) for name in one.columns}
        names = [frame.lower() for frame in one.frames if frame]
        ned = [_NED.search(name) is not None for name in names]
        axes = self.topics.axes.get(topic)
        if axes is None and any(ned) and not all(ned):
            raise DataError(
                f"{self.path}: {topic} is in frame '{one.frames[ned.index(True)]}', and in "
                f"'{one.frames[ned.index(False)]}'; say which: {_axes_key(topic)}, or \"enu\""
            )
        if axes is None and not any(ned) and "x" in columns and _NED.search(topic.lower()):
            columns = _mirrored(columns)  # a track and its headings alone have no witness that they are no mirror image
            self.steps.append(f"doubt: {topic}: north, east, down by its name alone; as REP 103 has it by axes = "
                              f'{{ "{topic}" = "enu" }} in a mapping')  # fmt: skip
        elif axes == "ned" or (axes is None and any(ned)):
            columns = _mirrored(columns)
            by = "as the mapping says" if axes else f"by its frame '{one.frames[0]}'"
            self.steps.append(f"{topic}: north, east, down and forward, starboard, down, {by}")
        elif axes is not None:
            sign, offset = AXES[axes]
            if "psi" in columns:
                columns["psi"] = sign * columns["psi"] + offset
        if "u" in columns and READ[one.kind][0] == "Twi" and earth_fixed(one.frames[0]):
            self.steps.append(f"u, v_m: turned from '{one.frames[0]}' into the ship's axes by psi")
            columns = _over_ground(columns)
        elif one.frames:
            keys = {"Fix": ("antenna",), "Odo": ("earth", "ship"), "Twi": ("ship",)}.get(READ[one.kind][0], ())
            self.frames |= dict(zip(keys, one.frames, strict=False))
        return self._moving(topic, columns)

    def _moving(self, topic: str, columns: dict[str, Array]) -> dict[str, Array]:
        """Without what a message has to have and nobody measured: zeros, and an orientation that never changes."""
        idle = [name for name in ("u", "v_m", "r", "phi", "theta", "U_G") if name in columns
                and not np.nan_to_num(columns[name]).any()]  # fmt: skip
        if "u" in columns and not {"u", "v_m", "r"} <= set(idle):
            idle = [name for name in idle if name in ("phi", "theta", "U_G")]
        psi, r = (columns.get(name, np.zeros(0)) for name in ("psi", "r"))
        if psi.size > 20 and np.all(psi == psi[0]) and np.max(np.abs(np.nan_to_num(r)), initial=0.0) > _TURNS:
            self.steps.append(f"doubt: {topic}: its orientation never changes while the ship turns; left out")
            idle += ["psi", "phi", "theta"]
        return {name: values for name, values in columns.items() if name not in idle}

    def _ground(self, motion: Motion) -> Track | None:
        """The course over ground by the fixes, else by the positions of an odometry."""
        found: list[Track] = []
        for topic, (t, columns) in motion.items():
            if "latitude" in columns and (one := track(t, *_metres(columns), self.source(topic))) is not None:
                found.insert(0, one)
            elif "x" in columns and (one := track(t, columns["x"], columns["y"], self.source(topic))) is not None:
                found.append(one)
        return next(iter(found), None)

    def _settled(self, topic: str, motion: Motion, ground: Track | None) -> None:
        """Turn headings, rates and velocities of a topic into our axes by the evidence of the motion."""
        t, columns = motion[topic]
        if "psi" in columns and topic not in self.topics.axes:
            self._heading(topic, t, columns, ground)
        psi = next(((at, one["psi"]) for at, one in ((t, columns), *motion.values()) if "psi" in one), None)
        if "r" in columns:
            self._rate(topic, t, columns, psi, ground)
        if "u" in columns and psi is not None and ground is not None:
            at = np.interp(t, psi[0][np.isfinite(psi[1])], np.unwrap(psi[1][np.isfinite(psi[1])]))
            if in_the_earth(t, columns["u"], columns["v_m"], at, ground):
                self.steps.append(f"{topic}: its velocities are those of the earth's axes, as the track shows")
                motion[topic] = t, _over_ground(columns)

    def _heading(self, topic: str, t: Array, columns: dict[str, Array], ground: Track | None) -> None:
        if ground is None:
            self.steps.append(
                f"doubt: {topic}: no track shows from where its heading counts; taken as REP 103 has it "
                f"(yaw from east, to the left); else {_axes_key(topic)}"
            )
            return
        axes, told, astray = axes_of(t, columns["psi"], ground)
        if axes == "enu":
            self.steps.append(f"{'doubt: ' * astray}{topic}: heading {told or 'as REP 103 has it; no track beside it'}"
                              + "; a yaw that began at zero, a compass that is off, or drift" * astray)  # fmt: skip
        elif axes:
            sign, offset = AXES[axes]
            self.steps.append(f"doubt: {topic}: heading {told}; taken so")
            columns["psi"] = sign * columns["psi"] + offset
            if axes == "ned":
                columns |= {name: -columns[name] for name in ("theta",) if name in columns}
        else:
            self.steps.append(
                f"doubt: {topic}: heading {told}; left out, as its zero is not known; if the ship goes "
                f'astern or sideways keep it by axes = {{ "{topic}" = "enu" }} in a mapping'
            )
            columns.pop("psi")

    def _rate(
        self, topic: str, t: Array, columns: dict[str, Array], psi: tuple[Array, Array] | None, ground: Track | None
    ) -> None:
        """The sign of a rate of turn, by the heading or else by the course."""
        by, turned = ("heading", psi) if psi is not None or ground is None else ("course", (ground.t, ground.gamma))
        alike = 0.0 if turned is None else likeness(*turned, t, columns["r"])
        if alike < -_ALIKE:
            self.steps.append(f"doubt: {topic}: its rate of turn is opposite to the change of the {by}; its sign is "
                              "turned here")  # fmt: skip
            columns["r"] = -columns["r"]
        elif psi is None and alike < _ALIKE:
            self.steps.append(f"doubt: {topic}: nothing shows to which side its rate of turn grows; taken as REP 103 "
                              "has it (positive to port)")  # fmt: skip

    def _agreeing(self, motion: Motion) -> None:
        """Refuse positions of two sources that are two ships.

        Raises:
            DataError: they differ.
        """
        having = [topic for topic, (_, columns) in motion.items() if "x" in columns]
        for one, other in pairwise(having):
            (t, a), (times, b) = motion[one], motion[other]
            way = 1.0 + 0.1 * max(float(np.ptp(a["x"])), float(np.ptp(a["y"])))
            for name, most in (("x", way), ("y", way), ("psi", math.radians(10.0))):
                if name in a and name in b and _apart(t, a[name], times, b[name], name == "psi") > most:
                    raise DataError(
                        f"{self.path}: Odometry on {', '.join(sorted(having))}, which differ in {name}; "
                        'name one in a mapping file: odometry = "..."'
                    )

    def _sentences(self, topic: str, one: Series) -> None:
        t = self._seconds(one).tolist()
        for k, text in enumerate(one.sentences):
            self.heard.lines += 1
            try:
                said = hear(text.strip().encode("latin-1", "replace"))
            except NmeaError as error:
                self.heard.refuse(str(error))
                continue
            values = {name: value for name, value in readings(said).items() if name not in _CLOCK}
            if values:
                self.heard.add(t[k], said.source, values)
            else:
                self.heard.leave(said.kind)

    def _numbers(self, topic: str, one: Series) -> None:
        """Bare numbers: each a channel by the mapping, by what its topic is known for, or by its last part."""
        t = self._seconds(one)
        for name in one.columns:
            at = topic + ("" if name in ("value", "psi") else name)
            mapped = self.topics.numbers.get(at) or _known(topic, at.removeprefix(topic), one.kind)
            values = one.column(name)
            if mapped is None or not self._free(at, mapped.channel):
                if np.nan_to_num(values).any():
                    self.heard.ignored[f"{at} ({one.kind})"] = len(one.times)
                continue
            self.named[mapped.channel] = at, mapped.si
            if at not in self.topics.numbers and unknown_control(mapped.channel):
                self.steps.append(
                    f"doubt: {at} looks like a control, and is the channel {mapped.channel}; say what it "
                    "is by [numbers] in a mapping (seatrial import --guess)"
                )
            self.heard.whole(self.source(topic), _LOGS.get(mapped.channel, mapped.channel), t, mapped.of(values))

    def _free(self, at: str, channel: str) -> bool:
        """Whether a name is one of a channel, and no other topic has it.

        Raises:
            DataError: another one has that of a standard channel.
        """
        if not _NAME.fullmatch(channel) or channel == "t":
            return False
        if channel not in self.named or channel == "psi":
            return True
        if at in self.topics.numbers or standard_unit(channel) is not None:
            raise DataError(
                f"{self.path}: two topics for channel '{channel}', {self.named[channel][0]} and {at}; "
                "map them in a mapping file"
            )
        return False

    @property
    def plain(self) -> dict[str, str]:
        """Channels of bare numbers that are no readings of instruments, with their units."""
        return {name: unit for name, (_, unit) in self.named.items() if _LOGS.get(name, name) not in _READINGS}


def _axes_key(topic: str) -> str:
    return f'axes = {{ "{topic}" = "ned" }} in a mapping'


def unknown_control(channel: str) -> bool:
    """Whether a name sounds like a control and is none of ours."""
    return standard_unit(channel) is None and not channel.startswith(_OURS) and _CONTROL.search(channel) is not None


_OURS = ("throttle", "steering", "f_", "alpha_", "n_")
_CONTROL = re.compile(r"rudder|helm|tiller|thrust|throttle|motor|servo|prop|rpm|pwm|steer", re.IGNORECASE)


def _known(topic: str, part: str, kind: str) -> Number | None:
    """What a number is by its topic: VRX's thrusters, the pair of a drive, the compass of mavros, else its name."""
    if part:
        channel = _MOTORS.get(part)
        return None if channel is None else Number(channel)
    if READ[kind][0] == "Hud":
        return Number("psi")
    if topic.endswith("compass_hdg"):
        return Number("psi", "deg")
    found = _THRUST.search(topic)
    if found is not None:
        side, what = _SENSE[found[1]], found[2]
        if what != "thrust":
            return Number(f"alpha_{side}", "rad", -1)
        return Number(f"throttle_{side}" if topic.endswith("_cmd") else f"f_{side}")
    return Number(topic.rpartition("/")[2])


def _mirrored(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Readings by REP 103 of messages that are in north, east, down and forward, starboard, down."""
    out = dict(columns)
    if "x" in out:
        out["x"], out["y"] = columns["y"], columns["x"]
    if "psi" in out:
        out["psi"] = 0.5 * math.pi - columns["psi"]
    return out | {name: -out[name] for name in ("theta", "v_m", "r") if name in out}


def _over_ground(columns: Mapping[str, Array]) -> dict[str, Array]:
    """With speed and course in place of velocities that were read as ahead and aside: east, and minus north."""
    out = {name: values for name, values in columns.items() if name not in ("u", "v_m")}
    east, north = columns["u"], -columns["v_m"]
    return {**out, "U_G": np.hypot(north, east), "gamma_G": np.mod(np.arctan2(east, north), 2.0 * math.pi)}


def _metres(columns: Mapping[str, Array]) -> tuple[Array, Array]:
    """North and east [m] on the tangent plane of the middle, good for a course."""
    latitude, longitude = columns["latitude"], columns["longitude"]
    middle = float(np.nanmedian(latitude)) if np.isfinite(latitude).any() else 0.0
    size = ARC_DEGREE
    return size * latitude, size * math.cos(math.radians(middle)) * np.rad2deg(np.unwrap(np.deg2rad(longitude)))


def _apart(t: Array, a: Array, times: Array, b: Array, circle: bool) -> float:
    """Median distance of two series; of positions that of the way since the first common time."""
    inside = (times >= t[0]) & (times <= t[-1]) & np.isfinite(b)
    good = np.isfinite(a)
    if inside.sum() < 3 or good.sum() < 3:
        return 0.0
    steady: Callable[[Array], Array] = np.unwrap if circle else np.asarray
    off = b[inside] - np.interp(times[inside], t[good], steady(a[good]))
    if circle:
        return float(np.median(np.abs(np.mod(off + math.pi, 2.0 * math.pi) - math.pi)))
    return float(np.median(np.abs(off - off[0])))
