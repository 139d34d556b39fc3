"""The versions that pyproject.toml allows: no lower than the first that was seen to work."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
ASKED = [*PROJECT["dependencies"], *(one for group in PROJECT["optional-dependencies"].values() for one in group)]

# What fails one version below, as `.ci/versions lowest` showed.
FIRST = {
    "click": ("8.2", "--help of a command with arguments: before, their names are made without a context"),
    "polars": ("1.34", "reading workbooks without PyArrow, whose wheels are for NumPy 2"),
    "fastexcel": ("0.15.1", "the same: before, it asks for PyArrow"),
    "cmaes": ("0.12", "a search of which no candidate can be simulated"),
    "rosbags": ("0.10.3", "writing bags"),
    "pyais": ("3.1", "decoding what an AIS transponder says"),
    "websockets": ("15", "connecting without a proxy"),
}


def numbers(version: str) -> tuple[int, ...]:
    return tuple(map(int, version.split(".")))


@pytest.mark.parametrize("name", FIRST)
def test_no_floor_is_below_what_works(name: str) -> None:
    first, why = FIRST[name]
    floors = [found[1] for one in ASKED if (found := re.match(rf"{name}>=([\d.]+)", one))]
    assert floors
    assert min(map(numbers, floors)) >= numbers(first), why


def test_no_library_has_two_floors() -> None:
    """An extra and the tests ask for the same, or the tests would pass with what users do not get."""
    seen: dict[str, set[str]] = {}
    for one in ASKED:
        if found := re.match(r"([\w-]+)(?:\[\w+\])?([<>=!].*)", one):
            seen.setdefault(found[1], set()).add(found[2])
    assert not {name: floors for name, floors in seen.items() if len(floors) > 1}
