"""Logs of Signal K: one delta a line, of JSON, in SI and radians.

A server stamps its lines, which are then what came in: deltas, frames of NMEA 2000 and sentences of NMEA 0183 by turns.

The own vessel is ``vessels.self``, else the context that tells most; others are targets, and are left out.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ...core.values import dataclass, field
from .. import Trial
from ..instruments import Heard, each_line, trial_by
from ..n2k.groups import PGNS, finished, said
from ..n2k.layouts import Packets, frame_of, sender
from ..nmea.heard import hear
from ..nmea.readings import KINDS, readings
from ..nmea.sentences import NmeaError
from .nmea import Aboard, read_mapping

__all__ = ["EXAMPLE", "name", "read", "read_mapping", "suffixes"]

name = "signalk"
suffixes = (".jsonl",)
EXAMPLE = """{"updates": [{"timestamp": "2026-11-26T12:00:00Z", "values": [{"path": "navigation.headingTrue", "value": 0.70}]}]}
{"updates": [{"timestamp": "2026-11-26T12:00:01Z", "values": [{"path": "navigation.headingTrue", "value": 0.71}]}]}
{"updates": [{"timestamp": "2026-11-26T12:00:02Z", "values": [{"path": "steering.rudderAngle", "value": 0.11}]}]}
"""  # noqa: E501
_PATHS: Mapping[str, str] = MappingProxyType({
    "navigation.position.latitude": "latitude", "navigation.position.longitude": "longitude",
    "navigation.headingTrue": "psi", "navigation.headingMagnetic": "psi_magnetic",
    "navigation.magneticVariation": "variation", "navigation.rateOfTurn": "r", "navigation.speedOverGround": "U_G",
    "navigation.courseOverGroundTrue": "gamma_G", "navigation.speedThroughWater": "u_log_water",
    "navigation.speedThroughWaterTransverse": "v_log_water", "navigation.attitude.roll": "phi",
    "navigation.attitude.pitch": "theta", "steering.rudderAngle": "delta", "environment.wind.speedApparent": "U_A",
    "environment.wind.angleApparent": "gamma_A", "environment.wind.speedTrue": "U_T",
    "environment.wind.angleTrueWater": "gamma_T_bow", "environment.wind.speedOverGround": "U_T_ground",
    "environment.wind.directionTrue": "gamma_T_ground", "environment.depth.belowSurface": "depth",
    "environment.current.setTrue": "gamma_C", "environment.current.drift": "U_C",
})  # fmt: skip
_SHAFT = re.compile(r"propulsion\.(\w+)\.revolutions")
_STAMP = re.compile(r"(\d{13});[A-Z];")
_CLOCKS = ("time_of_day", "time_of_none", "day", "utc")
_LEFT = 1000
"""Kinds of paths that are counted each."""


def read(source: Path, mapping: Aboard | None = None) -> Trial:
    """Read one log; without a mapping by the one beside it."""
    all_of, raw, by_context, sizes = Heard(), _Raw(), dict[str, Heard](), dict[str, int]()
    of_itself = list[str]()

    def take(text: str) -> None:
        start = _STAMP.match(text)
        body = text[start.end() :] if start else text
        if start and raw.take(int(start[1]) / 1000.0, body):
            return
        try:
            delta = json.loads(body)
            if "updates" not in delta and "self" in delta:  # what a server says of itself when a client comes in
                of_itself.append(str(delta["self"]))
                return
            context, told = str(delta.get("context", "vessels.self")), list(_values(delta))
        except (ValueError, TypeError, AttributeError, LookupError, RecursionError):
            all_of.refuse(f"{text[:40]!r} is no delta")
            return
        heard = by_context.setdefault(context, Heard())
        sizes[context] = sizes.get(context, 0) + len(told)
        for t, giver, path, value in told:
            _hear(heard, t, giver, path, value)

    each_line(source, all_of, take)
    named = ["vessels.self", *of_itself, *(f"vessels.{one}" for one in of_itself)]
    own = next((one for one in named if one in by_context), "") or max(sizes, key=lambda one: sizes[one], default="")
    heard = by_context.get(own, Heard())
    heard.lines, heard.invalid, heard.first = all_of.lines, all_of.invalid, all_of.first
    heard.join(raw.heard)
    heard.ignored.update(raw.heard.ignored)
    heard.ignored.update({f"of {one}": sizes[one] for one in list(by_context)[:_LEFT] if one != own})
    return trial_by(source, heard, "Signal K deltas", mapping, 0.0, (),
                    lambda series: {"delta": "rudder", **finished(series)})  # fmt: skip


def _timeless(values: Mapping[str, float]) -> dict[str, float]:
    return {name: value for name, value in values.items() if name not in _CLOCKS}


@dataclass
class _Raw:
    """Frames and sentences as they came in at a server."""

    heard: Heard = field(default_factory=Heard)
    packets: Packets = field(default_factory=Packets)

    def take(self, t: float, text: str) -> bool:
        """A line stamped `t` [s]; False where it is neither."""
        if (frame := frame_of(text)) is not None:
            whole = self.packets.whole(frame)
            if whole is not None and whole.pgn in PGNS:
                self.heard.add(t, f"{sender(whole.source)}/{whole.pgn}", _timeless(said(whole.pgn, whole.data) or {}))
            elif frame.pgn not in PGNS:
                self.heard.leave(f"PGN {frame.pgn}")
            return True
        try:
            sentence = hear(text.encode("latin-1", "replace"))
        except NmeaError:
            return False
        self.heard.add(t, sentence.source, _timeless(readings(sentence)))
        if sentence.kind not in KINDS:
            self.heard.leave(sentence.kind)
        return True


def _values(delta: Any) -> Iterator[tuple[float, str, str, Any]]:
    """Time, source, path and value of each number of a delta; those of a compound value by their own names."""
    for update in delta["updates"]:
        said = datetime.fromisoformat(str(update.get("timestamp", "")).replace("Z", "+00:00"))
        giver = str(update.get("$source") or _giver(update.get("source")))
        t = (said if said.tzinfo else said.replace(tzinfo=UTC)).timestamp()
        for one in update.get("values", ()):
            value, path = one["value"], str(one["path"])
            parts = value.items() if isinstance(value, dict) else ((None, value),)
            for key, number in parts:
                yield t, giver, path if key is None else f"{path}.{key}", number


def _giver(source: Any) -> str:
    """The device that an object of a source names, as a server joins it: label, then address or talker."""
    if not isinstance(source, dict):
        return "self"
    return ".".join(str(source[key]) for key in ("label", "src", "talker") if source.get(key)) or "self"


def _hear(heard: Heard, t: float, giver: str, path: str, value: Any) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return
    shaft = _SHAFT.fullmatch(path)
    if shaft is not None:  # in hertz; the numbers are those of RPM sentences: odd to starboard
        side = {"port": 2, "starboard": 1, "1": 1}.get(shaft[1].lower(), 0)  # 0 is to port of 1 where both are
        heard.add(t, f"{giver}/{path}", {f"rpm_S_{side}": 60.0 * float(value)})
    elif path in _PATHS:
        wrapped = float(value) % math.tau if _PATHS[path] in ("gamma_A", "gamma_T_bow") else float(value)
        heard.add(t, giver, {_PATHS[path]: wrapped})
    elif path in heard.ignored or len(heard.ignored) < _LEFT:
        heard.leave(path)
