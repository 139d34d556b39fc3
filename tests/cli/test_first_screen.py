"""What a user meets first: `seatrial` alone, `seatrial doctor`, and the completions of a shell."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from seatrial.cli.app import app as application
from seatrial.cli.app import main
from seatrial.workflow.installation import examine
from seatrial.workflow.installation.doctor import fits


def test_alone_it_offers_five_things_whose_commands_exist(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    told = capsys.readouterr().out
    commands = set(re.findall(r"seatrial ([a-z]+)", told))
    assert commands <= set(application.whole())
    assert len(re.findall(r"^  \S", told, re.MULTILINE)) == 5


@pytest.mark.parametrize(
    ("version", "required", "right"),
    [("1.26.0", "numpy>=1.26", True), ("1.25.9", "numpy>=1.26", False), ("2", "casadi>=3.7,<4", False),
     ("4.0", "casadi>=3.7,<4", False), ("3.7", "casadi>=3.7,<4", True), ("2.13.0+cpu", "torch>=2.4", True),
     ("0.0.11", "shipmmg==0.0.11", True), ("6.0.2", 'pyyaml>=6; extra == "x"', True), ("1.10", "a>=1.9", True)],
)  # fmt: skip
def test_versions_are_compared_as_numbers(version: str, required: str, right: bool) -> None:
    assert fits(version, required) is right


@pytest.mark.slow
def test_doctor_says_what_is_here(capsys: pytest.CaptureFixture[str], monkeypatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SEATRIAL_DATA", str(tmp_path))
    assert main(["doctor", "--json"]) == 0
    found = {(one["area"], one["what"]): one for one in json.loads(capsys.readouterr().out)["findings"]}
    assert found["data", "SEATRIAL_DATA"]["state"] == "note"
    assert {area for area, _ in found} == {"python", "libraries", "compiler", "cache", "extras", "gpu", "data"}


@pytest.mark.slow
def test_doctor_fails_where_commands_would(capsys: pytest.CaptureFixture[str], monkeypatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SEATRIAL_DATA", str(tmp_path / "away"))
    assert main(["doctor"]) == 1
    assert "not a folder" in capsys.readouterr().out


@pytest.mark.slow
def test_doctor_names_the_missing_compiler_and_what_to_install(monkeypatch) -> None:
    monkeypatch.setenv("SEATRIAL_CC", "none")
    (found,) = (one for one in examine() if one.area == "compiler")
    assert found.state == "note"
    assert "virtual machine" in found.found
    assert "gcc" in found.remedy


@pytest.mark.slow
@pytest.mark.parametrize(
    ("typed", "offered"),
    [("seatrial ident", "identify"), ("seatrial show kvlcc2_l", "kvlcc2_l7"), ("seatrial simulate kcs zigz", "zigzag")],
)
def test_a_shell_completes_commands_ships_and_manoeuvres(typed: str, offered: str) -> None:
    asked = {"_SEATRIAL_COMPLETE": "bash_complete", "COMP_WORDS": typed, "COMP_CWORD": str(typed.count(" "))}
    command = [sys.executable, "-m", "seatrial"]
    ran = subprocess.run(command, env={**os.environ, **asked}, capture_output=True, text=True, check=False)
    assert offered in re.split(r"[,\s]", ran.stdout)
