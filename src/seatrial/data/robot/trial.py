"""Trials from the messages of a robot's log, an MCAP file or a bag of ROS 2.

The rows are the messages of the odometry, else of the twist, else of the fix; messages of other topics are moved to
the nearest row, and a row without one has a gap.  A log that seatrial wrote gives the rows of its trial again,
including those with a missing part of the pose or of the velocity (`exchange.robot_log`).  A mapping
file resolves several topics of one type, and numbers under other names; every key may be left out:

    schema = "seatrial-robot/1"
    odometry = "/ekf/odom"
    datum = { latitude = 35.0, longitude = 139.5 }        # else the first fix
    [numbers]
    "/helm/angle" = { channel = "delta", unit = "deg", sign = -1 }
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ...core.parameters import unknown
from .. import UNITS, Array, DataError, Trial, unwrapped
from ..geodesy import Datum
from ..prepare import nearest_rows, to_body
from ..sidecar import CONVENTIONS, UNPLACED, Described, began, read_described
from ..table import within
from ..units import conversion, standard_unit
from .files import Message, opened
from .messages import FIX, NUMBERS, ODOMETRY, TWIST, TYPES, VELOCITY, Values, earth_fixed, unpacked

# Stamps above this are times since 1970, those below times since some start [ns].
_EPOCH = 10**17
# Later than any log [ns]: the year 2262, beyond which 64 bits end.
_NEVER = 2**63
# The clocks of logger and stamps are the same if they differ by no more than this [ns].
_SAME_CLOCK = 10**9
_NAME = re.compile(r"[A-Za-z]\w*")


@dataclass(frozen=True)
class Number:
    """A channel that a topic of bare numbers holds, in SI where no unit is given."""

    channel: str
    unit: str | None = None
    sign: Literal[-1, 1] = 1

    @property
    def factor(self) -> float:
        """Factor from the number to the channel.

        Raises:
            DataError: an unknown unit, or one that cannot measure the channel.
        """
        return self.sign * (1.0 if self.unit is None else conversion(self.channel, self.unit)[1])


@dataclass(frozen=True)
class Topics(Described):
    """Which topics are read, where a log leaves a choice, and what the mapping file states of the trials.

    Attributes:
        odometry, twist, fix: topics of these types; None for the only one.
        numbers: channels of topics of bare numbers.
        datum: where x and y are zero; None for the first fix.
    """

    odometry: str | None = None
    twist: str | None = None
    fix: str | None = None
    numbers: dict[str, Number] = field(default_factory=dict[str, Number])
    datum: Datum | None = None

    def of(self, kind: str) -> str | None:
        """The topic asked for of a type."""
        return {ODOMETRY: self.odometry, TWIST: self.twist, FIX: self.fix}[kind]


@dataclass
class _Series:
    """All messages of one topic."""

    kind: str
    times: list[int] = field(default_factory=list[int])
    logged: list[int] = field(default_factory=list[int])
    said: list[Values] = field(default_factory=list[Values])

    def column(self, name: str) -> Array:
        return np.array([one.values.get(name, math.nan) for one in self.said])


def read_topics(path: Path) -> Topics:
    """Read a mapping file; the units of `numbers` are checked."""
    topics = read_described(path, Topics, "seatrial-robot/1")
    for topic, one in topics.numbers.items():
        with within(f"{path}: numbers, {topic}"):
            _ = one.factor
    return topics


def read(source: Path, mapping: Topics | None = None) -> Trial:
    """Read one log."""
    topics, path = mapping or Topics(), source
    with opened(path) as bag:
        ignored: Counter[str] = Counter()
        series = _gathered(path, bag.messages, ignored)
        note = bag.note
    chosen = {kind: _chosen(path, kind, series, topics) for kind in (ODOMETRY, TWIST, FIX)}
    rows, again = _rows(path, series, chosen, note)
    steps = [f"imported from {', '.join(f'{t} ({series[t].kind})' for t in sorted(series))}"]
    if again:
        steps.append(f"{again} messages left out whose time was there already")
    channels, turned = _motion(path, rows, series, chosen)
    twist = chosen[TWIST]
    if note and twist is not None:
        _fill(channels, {name: rows.moved(series[twist], name) for name in VELOCITY})
    datum, placed = _place(path, rows, series, chosen, topics, channels)
    steps += turned + placed
    said = _numbers(path, rows, series, topics)
    mapped = {one.channel for one in topics.numbers.values()}
    channels |= {name: values for name, values in said.items() if name in mapped}
    _fill(channels, said)
    meta = {**CONVENTIONS, **_frames(series, chosen), **rows.start, **note.get("meta", {}), **topics.meta}
    if ignored:
        meta["ignored"] = dict(sorted(ignored.items()))
    if datum is not None and "datum" not in meta:
        meta["datum"] = asdict(datum)
    known = {name: values for name, values in channels.items() if np.isfinite(values).any()}
    units = {name: note.get("units", {}).get(name, standard_unit(name) or "-") for name in known if name not in UNITS}
    return Trial(path.stem, rows.t, known, units, meta).noting(*steps)


def _rows(
    path: Path, series: Mapping[str, _Series], chosen: Mapping[str, str | None], note: Mapping[str, Any]
) -> tuple[_Rows, int]:
    """The rows, and how many messages are left out because another one has the same time."""
    base = next((series[topic] for topic in chosen.values() if topic is not None), None)
    parts = [np.array(one.times) for one in (series.values() if note else () if base is None else (base,))]
    stamps = np.concatenate(parts) if parts else np.zeros(0)
    ticks = np.unique(stamps)
    if ticks.size < 2:
        seen = ", ".join(sorted(series)) or "no topic of these types"
        raise DataError(f"{path}: no two messages of Odometry, TwistStamped or NavSatFix define rows; found {seen}")
    again = 0 if note else stamps.size - ticks.size
    return _Rows(ticks, base, began(path, note.get("meta", {}))), again


def _fill(channels: dict[str, Array], others: Mapping[str, Array]) -> None:
    """Fill gaps and missing channels from others, row by row; existing values stay."""
    for name, values in others.items():
        there = channels.get(name)
        channels[name] = values if there is None else np.where(np.isfinite(there), there, values)
        if name == "psi" and there is not None:
            channels[name] = unwrapped(channels[name])


def _gathered(path: Path, messages: Any, ignored: Counter[str]) -> dict[str, _Series]:
    found: dict[str, _Series] = {}
    message: Message
    for message in messages:
        if message.kind not in (*TYPES, *NUMBERS):
            ignored[f"{message.topic} ({message.kind})"] += 1
            continue
        series = found.setdefault(message.topic, _Series(message.kind))
        if series.kind != message.kind:
            raise DataError(f"{path}: {message.topic} is {series.kind} and {message.kind}; give it one type")
        with within(f"{path}: {message.topic}, message {len(series.said) + 1}"):
            one = unpacked(message.kind, message.data)
            if message.logged >= _NEVER:
                raise DataError(f"logged {message.logged} ns after 1970; no clock can give that")
        series.times.append(message.logged if one.stamp is None else one.stamp)
        series.logged.append(message.logged)
        series.said.append(one)
    return found


def _chosen(path: Path, kind: str, series: Mapping[str, _Series], topics: Topics) -> str | None:
    """The topic of a type to read."""
    short = kind.rpartition("/")[2]
    there = [topic for topic, one in series.items() if one.kind == kind]
    asked = topics.of(kind)
    if asked is not None:
        if asked not in there:
            raise DataError(f"{path}: {unknown(asked, there, f'topic of {short}')}")
        return asked
    if len(there) > 1:
        raise DataError(f"{path}: {short} on {', '.join(sorted(there))}; name one in a mapping file")
    if there and kind != FIX:
        _earth_is_up(path, there[0], series[there[0]])
    return there[0] if there else None


def _earth_is_up(path: Path, topic: str, series: _Series) -> None:
    for frame in series.said[0].frames:
        if re.search(r"(^|[_/])(ned|frd)($|[_/])", frame.lower()):
            wanted = "east, north, up and forward, port, up (REP 103)"
            raise DataError(f"{path}: {topic} is in frame '{frame}'; give {wanted}")


class _Rows:
    """The rows of a trial, and other times moved to them."""

    def __init__(self, ticks: Any, base: _Series | None, zero: int) -> None:
        first = zero or int(ticks[0])
        self.ticks, epoch = ticks, first > _EPOCH
        self.t: Array = (ticks - first if epoch else ticks) / 1e9
        self.start = {"start": datetime.fromtimestamp(first / 1e9, UTC).isoformat()} if epoch else {}
        behind = 0 if base is None else int(np.median(np.array(base.logged) - np.array(base.times)))
        self.behind = behind if abs(behind) > _SAME_CLOCK else 0

    def moved(self, series: _Series, name: str) -> Array:
        """A quantity on the rows; NaN where no message is within half a row."""
        late = self.behind if series.kind in NUMBERS else 0
        times, ticks = np.array(series.times) - late, self.ticks
        return nearest_rows(ticks, times, series.column(name), 0.5 * float(np.median(np.diff(ticks))))[0]


def _motion(
    path: Path, rows: _Rows, series: Mapping[str, _Series], chosen: Mapping[str, str | None]
) -> tuple[dict[str, Array], list[str]]:
    """Pose and velocities, from a twist where the odometry has no velocities; and the processing steps."""
    channels: dict[str, Array] = {}
    odometry, twist = chosen[ODOMETRY], chosen[TWIST]
    if odometry is not None:
        channels |= {n: rows.moved(series[odometry], n) for n in ("x", "y", "psi", "phi", "u", "v_m", "r")}
        channels["psi"] = unwrapped(channels["psi"])
        if not np.nan_to_num(channels["phi"]).any():
            del channels["phi"]
    if twist is not None and not any(np.isfinite(channels.get(n, math.nan)).any() for n in ("u", "v_m", "r")):
        channels |= {n: rows.moved(series[twist], n) for n in ("u", "v_m", "r")}
        frame = series[twist].said[0].frames[0]
        if earth_fixed(frame):
            psi = channels.get("psi")
            if psi is None or not np.isfinite(psi).any():
                wanted = "give an odometry with the heading, or the velocity in the ship's own frame"
                raise DataError(f"{path}: {twist} is in the earth's frame '{frame}', and no heading is known; {wanted}")
            # read as ahead and starboard, these were east and minus north
            east, north = channels["u"], -channels["v_m"]
            channels["u"], channels["v_m"] = to_body(north, east, psi)
            return channels, [f"u, v_m: turned from '{frame}' into the ship's axes by psi"]
    return channels, []


def _place(
    path: Path, rows: _Rows, series: Mapping[str, _Series], chosen: Mapping[str, str | None], topics: Topics,
    channels: dict[str, Array],
) -> tuple[Datum | None, list[str]]:  # fmt: skip
    """Where x and y are zero; positions from fixes where there is no odometry."""
    fix = chosen[FIX]
    if fix is None:
        return topics.datum, []
    latitude, longitude = (rows.moved(series[fix], name) for name in ("latitude", "longitude"))
    good = np.flatnonzero(np.isfinite(latitude + longitude))
    if not good.size:
        return topics.datum, []
    k = int(good[0])
    first = Datum(float(latitude[k]), float(longitude[k]))
    if "x" in channels and topics.datum is not None:
        return topics.datum, []
    if "x" in channels:
        x, y = float(channels["x"][k]), float(channels["y"][k])
        with within(path):
            seen = first if not math.isfinite(x + y) else Datum.seeing(first.latitude, first.longitude, x, y)
        return seen, []
    datum = topics.datum or first
    channels["x"], channels["y"] = datum.track(latitude, longitude)
    return datum, [UNPLACED]


def _numbers(path: Path, rows: _Rows, series: Mapping[str, _Series], topics: Topics) -> dict[str, Array]:
    """Bare numbers: each a channel named by the last part of its topic, or by the mapping."""
    out: dict[str, Array] = {}
    there = {topic: one for topic, one in series.items() if one.kind in NUMBERS}
    for topic in topics.numbers:
        if topic not in there:
            raise DataError(f"{path}: {unknown(topic, there, 'topic of Float64')}")
    for topic, one in there.items():
        mapped = topics.numbers.get(topic, Number(topic.rpartition("/")[2]))
        name, factor = mapped.channel, mapped.factor
        if not _NAME.fullmatch(name) or name == "t":
            continue
        if name in out:
            raise DataError(f"{path}: two topics for channel '{name}'; map them in a mapping file")
        values = rows.moved(one, "value")
        out[name] = values if factor == 1.0 else factor * values
    return out


def _frames(series: Mapping[str, _Series], chosen: Mapping[str, str | None]) -> dict[str, Any]:
    """Names of the frames, for writing the log again."""
    found: dict[str, str] = {}
    for kind, names in ((FIX, ("antenna",)), (TWIST, ("ship",)), (ODOMETRY, ("earth", "ship"))):
        topic = chosen[kind]
        if topic is not None and not (kind == TWIST and earth_fixed(series[topic].said[0].frames[0])):
            found |= dict(zip(names, series[topic].said[0].frames, strict=True))
    return {"frames": found} if found else {}
