"""What `--help` says, and what README.md says of the commands, the ships and the manoeuvres."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
import typer

from seatrial.cli.app import app, main
from seatrial.ships.files import library
from seatrial.workflow.simulation import known

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
COMMANDS: Any = typer.main.get_command(app)
NAMES = sorted(COMMANDS.commands)
TENS = dict(enumerate(("", "", "twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety")))
ONES = ("", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")


def in_words(number: int) -> str:
    """A number from 20 to 99."""
    return "-".join(word for word in (TENS[number // 10], ONES[number % 10]) if word)


@pytest.mark.parametrize("name", NAMES)
def test_help_is_for_users(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """What a function raises, takes or returns is for those who call it from Python."""
    assert main([name, "--help"]) == 0
    told = capsys.readouterr().out
    assert f"seatrial {name}" in told
    assert not re.search(r"\b(Raises|Args|Returns|Attributes|Yields):", told)


@pytest.mark.parametrize("name", NAMES)
def test_readme_has_every_command(name: str) -> None:
    assert re.search(rf"`seatrial {name}\b", README)


def test_readme_has_no_command_that_there_is_not() -> None:
    assert set(re.findall(r"`seatrial ([a-z][a-z-]*)", README)) <= set(NAMES)


def test_readme_counts_ships_and_manoeuvres() -> None:
    assert f"{in_words(len(library())).capitalize()} ships, every number of a file with its source" in README
    assert f"one of {in_words(len(known()))} manoeuvres" in README


def test_type_checkers_of_others_read_our_types() -> None:
    """PEP 561: without this file they take every name of an installed package for Any."""
    assert files("seatrial").joinpath("py.typed").is_file()
