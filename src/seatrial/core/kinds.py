"""Kinds of files by their key `schema`, and what is said of one that was given where another is wanted."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

KINDS: Mapping[str, tuple[str, str]] = MappingProxyType({
    "seatrial-ship": ("a ship file", "seatrial simulate {file} zigzag, or the key ship of a study"),
    "seatrial-study": ("a study", "seatrial identify {file} -o RUN"),
    "seatrial-series": ("a table of fits", "seatrial identify {file} -o RUN"),
    "seatrial-campaign": ("a campaign", "seatrial campaign {file} -o RUN"),
    "seatrial-scenario": ("a scenario", "seatrial range {file}"),
    "seatrial-mapping": ("a mapping of logs", "seatrial import csv LOGS --mapping {file} -o trials"),
    "seatrial-nmea": ("a mapping of NMEA logs", "seatrial import nmea LOGS --mapping {file} -o trials"),
    "seatrial-robot": ("a mapping of robot logs", "seatrial import mcap LOGS --mapping {file} -o trials"),
    "seatrial-steps": ("a file of steps", "seatrial mend TRIALS --by {file} -o mended"),
    "seatrial-captive": ("a mapping of captive tests", "seatrial captive SHIP TABLE --mapping {file}"),
    "seatrial-particulars": ("a file of particulars", "seatrial estimate {file} -o SHIP.toml"),
    "seatrial-sea": ("a sea", "seatrial simulate SHIP zigzag --waves {file}"),
    "seatrial-yardstick": ("a set of the yardstick", "seatrial yardstick {file}"),
    "seatrial-sets": ("a file of sets of recordings", "the key data.sets of a study"),
    "seatrial-project": ("defaults of a project", "any command, as seatrial.toml in the folder where it is run"),
    "seatrial-published": ("results of a publication", "the key published of a table of fits"),
    "seatrial-printed": ("what a paper prints, no input of a fit",
                         "the report of its study: seatrial identify {beside} -o RUN"),
})  # fmt: skip
"""What a file of a schema is, and what takes it: {file} is its name, {beside} the one that it is named after."""


def wrong_kind(path: str | Path, found: object, wanted: str) -> str:
    """One line on a file whose schema is not the one that is wanted: what it is, and what takes it.

    Args:
        path: the file.
        found: its key `schema`; None where it has none.
        wanted: schema that is read, such as "seatrial-study/1".
    """
    name, right = wanted.partition("/")[0], f'schema = "{wanted}"'
    asked = KINDS.get(name, ("such a file", ""))[0]
    if found is None:
        return f"{path}: has no schema; {asked} begins with {right}"
    if (said := described(path, found)) and str(found).partition("/")[0] != name:
        return f"{path}: {said}; {asked} begins with {right}"
    return f"{path}: schema is {str(found)[:60]!r}; this version reads '{wanted}'"


def described(path: str | Path, found: object) -> str:
    """What a file of a schema is, and what takes it; empty of one that is not known."""
    file, kind = Path(path), str(found).partition("/")[0]
    if kind not in KINDS:
        return ""
    what, used = KINDS[kind]
    return f"is {what}, for {used.format(file=file, beside=file.with_name(file.name.replace('_printed', '')))}"
