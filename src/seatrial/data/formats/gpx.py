"""Tracks in GPX: places with their times, and speed and course where they are told; no heading is in such a file."""

from __future__ import annotations

import math
import re
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path
from xml.etree import ElementTree

from .. import DataError, Trial
from ..instruments import Heard, trial_by
from ..table import bytes_of
from .nmea import Aboard, read_mapping

__all__ = ["EXAMPLE", "name", "read", "read_mapping", "suffixes"]

name = "gpx"
suffixes = (".gpx",)
EXAMPLE = """<?xml version="1.0"?>
<gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>
<trkpt lat="35.1" lon="139.7"><time>2026-11-26T12:00:00Z</time></trkpt>
<trkpt lat="35.1001" lon="139.7001"><time>2026-11-26T12:00:10Z</time></trkpt>
</trkseg></trk></gpx>
"""
_MADE = re.compile(rb"<!(?:DOCTYPE|ENTITY)", re.IGNORECASE)


def read(source: Path, mapping: Aboard | None = None) -> Trial:
    """Read one track; without a mapping by the one beside it."""
    raw = bytes_of(source)
    if _MADE.search(raw):
        raise DataError(f"{source}: declares entities of its own; a track has none")
    heard = Heard()
    try:
        for _, one in ElementTree.iterparse(BytesIO(raw)):
            if _tag(one) == "trkpt":
                _point(heard, one)
                one.clear()
    except (ElementTree.ParseError, LookupError, ValueError) as error:  # the latter of its encoding
        raise DataError(f"{source}: no whole GPX file ({error})") from None
    return trial_by(source, heard, "a GPX track", mapping)


def _tag(one: ElementTree.Element) -> str:
    return one.tag.rpartition("}")[2]


def _point(heard: Heard, one: ElementTree.Element) -> None:
    """One place; without a time it is of a route, and is left out."""
    said = {_tag(part): (part.text or "").strip() for part in one.iter()}
    try:
        when = datetime.fromisoformat(said.get("time", "").replace("Z", "+00:00"))
        place = {"latitude": float(one.get("lat", "")), "longitude": float(one.get("lon", ""))}
    except ValueError:
        heard.leave("point without time or place")
        return
    for key, channel, factor in (("speed", "U_G", 1.0), ("course", "gamma_G", math.pi / 180.0)):
        try:
            place[channel] = factor * float(said[key])
        except (KeyError, ValueError):
            continue
    heard.add((when if when.tzinfo else when.replace(tzinfo=UTC)).timestamp(), "gpx/trk", place)
