"""Messages of NMEA 2000 as JSON, as the analyzer of canboat and Signal K's canboatjs print them, back to their bytes.

A line names the fields of a group; they are put where `groups` reads them, so that one decoder says what they mean.
Angles are degrees, or radians where the first line says ``"units":"si"``, as canboatjs always has them: what is not
said is told by headings and courses beyond a turn in radians.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from datetime import date
from types import MappingProxyType
from typing import Any

_TURN = math.tau + 0.001
_ANGLE = "angle"
_FIXED = 0x1F
"""A GNSS fix, as is any method but none."""
_PLAIN = re.compile(r"[^a-z0-9]")
Field = tuple[str, int, int, bool, float, str]
"""Name in small letters without blanks, first byte, bytes, whether it has a sign, size of its unit, kind."""

_FIELDS: Mapping[int, tuple[int, tuple[Field, ...]]] = MappingProxyType({
    127245: (8, (("instance", 0, 1, False, 1.0, ""), ("angleorder", 2, 2, True, 1e-4, _ANGLE),
                 ("position", 4, 2, True, 1e-4, _ANGLE))),
    127250: (8, (("heading", 1, 2, False, 1e-4, _ANGLE), ("deviation", 3, 2, True, 1e-4, _ANGLE),
                 ("variation", 5, 2, True, 1e-4, _ANGLE), ("reference", 7, 1, False, 1.0, "north"))),
    127251: (8, (("rate", 1, 4, True, 3.125e-8, _ANGLE),)),
    127257: (8, (("pitch", 3, 2, True, 1e-4, _ANGLE), ("roll", 5, 2, True, 1e-4, _ANGLE))),
    127258: (8, (("variation", 4, 2, True, 1e-4, _ANGLE),)),
    127488: (8, (("instance", 0, 1, False, 1.0, "engine"), ("engineinstance", 0, 1, False, 1.0, "engine"),
                 ("speed", 1, 2, False, 0.25, ""), ("enginespeed", 1, 2, False, 0.25, ""))),
    127493: (8, (("instance", 0, 1, False, 1.0, "engine"), ("engineinstance", 0, 1, False, 1.0, "engine"),
                 ("transmissiongear", 1, 1, False, 1.0, "gear"))),
    128259: (8, (("speedwaterreferenced", 1, 2, False, 0.01, ""), ("speeddirection", 6, 1, False, 1.0, "way"))),
    128267: (8, (("depth", 1, 4, False, 0.01, ""), ("offset", 5, 2, True, 1e-3, ""))),
    129025: (8, (("latitude", 0, 4, True, 1e-7, ""), ("longitude", 4, 4, True, 1e-7, ""))),
    129026: (8, (("cogreference", 1, 1, False, 1.0, "north"), ("cog", 2, 2, False, 1e-4, _ANGLE),
                 ("sog", 4, 2, False, 0.01, ""))),
    129029: (43, (("date", 1, 2, False, 1.0, "date"), ("time", 3, 4, False, 1e-4, "time"),
                  ("latitude", 7, 8, True, 1e-16, ""), ("longitude", 15, 8, True, 1e-16, ""),
                  ("method", 31, 1, False, 1.0, "fix"))),
    126992: (8, (("source", 1, 1, False, 1.0, "clock"), ("date", 2, 2, False, 1.0, "date"),
                 ("time", 4, 4, False, 1e-4, "time"))),
    129033: (8, (("date", 0, 2, False, 1.0, "date"), ("time", 2, 4, False, 1e-4, "time"))),
    129291: (8, (("setreference", 1, 1, False, 1.0, "north"), ("set", 2, 2, False, 1e-4, _ANGLE),
                 ("drift", 4, 2, False, 0.01, ""))),
    130306: (8, (("windspeed", 1, 2, False, 0.01, ""), ("windangle", 3, 2, False, 1e-4, _ANGLE),
                 ("reference", 5, 1, False, 1.0, "wind"))),
})  # fmt: skip
"""Bytes and fields of each group."""

_WORDS: Mapping[str, Mapping[str, int]] = MappingProxyType({
    "north": {"true": 0xFC, "magnetic": 0xFD}, "gear": {"forward": 0xFC, "neutral": 0xFD, "reverse": 0xFE},
    "way": {"forward": 0xF0, "reverse": 0xF1}, "fix": {"nognss": 0x0F}, "clock": {"localcrystalclock": 0xF5},
    "engine": {"singleengineordualengineport": 0, "dualenginestarboard": 1},
    "wind": {"truegroundreferencedtonorth": 0xF8, "magneticgroundreferencedtomagneticnorth": 0xF9, "apparent": 0xFA,
             "trueboatreferenced": 0xFB, "truewaterreferenced": 0xFC},
})  # fmt: skip
"""Codes by their words, the bits beside them set."""
_ABOVE = MappingProxyType({
    "north": 0xFC, "gear": 0xFC, "way": 0xF0, "fix": 0x0F, "clock": 0xF0, "engine": 0, "wind": 0xF8})  # fmt: skip
"""Bits beside the code of each kind."""


def degrees_by(lines: bytes) -> bool:
    """Whether the angles of a log are degrees, by what its first lines say or show."""
    head = lines[:400]
    if b'"units"' in head:
        return b'"si"' not in head.replace(b" ", b"").lower()
    found = re.findall(rb'"(?:heading|cog|windAngle|wind angle)":\s*(-?[\d.]+)', lines, re.IGNORECASE)
    return any(abs(float(one)) > _TURN for one in found)


def plain(lines: bytes, degrees: bool) -> bytes:
    """Lines of JSON as lines of canboat's own form; what is no message stays as it is, as many lines as before."""
    return b"\n".join(_line(one, degrees) for one in lines.split(b"\n"))


def _line(line: bytes, degrees: bool) -> bytes:
    text = line.strip()
    if not text.startswith(b"{"):
        return line
    if b'"pgn"' not in text:
        return b"# " + text  # what wrote it, in which units
    try:
        said: Any = json.loads(text)
        when, pgn, source = str(said["timestamp"]), int(said["pgn"]), int(said["src"])
        data = _bytes(pgn, dict(said["fields"]), degrees)
    except (ValueError, TypeError, KeyError, RecursionError, OverflowError):
        return line
    return f"{when},{int(said.get('prio', 2))},{pgn},{source},255,{len(data)},{data.hex(',')}".encode()


def _bytes(pgn: int, fields: Mapping[str, Any], degrees: bool) -> bytes:
    """The bytes of a group, of one that is not read none; what is not told is not available."""
    if pgn not in _FIELDS:
        return b"\xff"
    size, known = _FIELDS[pgn]
    given = {_PLAIN.sub("", name.lower()): value for name, value in fields.items() if value is not None}
    out = bytearray(b"\xff" * size)
    if pgn == 129029:
        out[31] = _FIXED
    for name, at, width, signed, unit, kind in sorted(known, key=lambda one: one[0] in given):
        most = (1 << 8 * width - signed) - 1
        raw = _raw(given[name], unit, kind, degrees) if name in given else most if signed else None
        if raw is not None and -most - 1 <= raw <= most:
            out[at : at + width] = raw.to_bytes(width, "little", signed=signed)
    return bytes(out)


def _raw(value: Any, unit: float, kind: str, degrees: bool) -> int | None:
    """A field as a whole number; None where it says nothing that is known."""
    if isinstance(value, Mapping):  # a code with its name beside it
        value = value.get("name", value.get("value"))
    if kind in _WORDS:
        words, above = _WORDS[kind], _ABOVE[kind]
        if isinstance(value, str):
            return words.get(_PLAIN.sub("", value.lower()), _FIXED if kind == "fix" else None)
        return int(value) << 4 | above if kind == "fix" else int(value) | above
    if kind == "date":
        return (date(*map(int, re.split(r"[.-]", str(value)))) - date(1970, 1, 1)).days
    if kind == "time":
        hours, minutes, seconds = str(value).split(":")
        return round((3600 * int(hours) + 60 * int(minutes) + float(seconds)) / unit)
    number = float(value)
    return round((math.radians(number) if kind == _ANGLE and degrees else number) / unit)
