"""`seatrial models`, and the commands that docs/choosing.md shows."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest

from seatrial.choosing import CAPABILITIES
from seatrial.choosing import survey as surveys
from seatrial.choosing.purposes import PURPOSES
from seatrial.choosing.survey import FAMILIES, Assessment
from seatrial.cli.app import main

ROOT = Path(__file__).parents[2]
GUIDE = (ROOT / "docs" / "choosing.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^\$ (seatrial .*)$", GUIDE, re.MULTILINE)
WIDTH = 200
"""A table of names is as wide as its names: none is broken, and what is wider than a terminal the terminal breaks."""
SLOW = "seatrial requirements esso_osaka_3m_harbour --scope berthing"
"""Three seconds; the tests of that command run it."""


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch, surveyed: tuple[Assessment, ...]) -> None:
    """The survey is made once for all tests that only read it."""
    monkeypatch.setattr(surveys, "survey", lambda: surveyed)


@pytest.mark.long
def test_every_family_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["models", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)["families"]
    assert [f["family"] for f in said] == [f.key for f in FAMILIES]
    for family in said:
        assert set(family["represents"]) == {c.key for c in CAPABILITIES}
        assert (family["status"] == "planned") == (family["cost_ns"] is None) == (family["classes"] == [])
    by_name = {f["family"]: f for f in said}
    assert by_name["lowMMG"]["items_unmet"] == {"collision-avoidance": [], "berthing": []}
    assert by_name["KT"]["data"]["length"] == [14.0, 14.0]


@pytest.mark.slow
@pytest.mark.usefixtures("quick")
def test_every_family_as_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["models"]) == 0
    out = capsys.readouterr().out
    assert all(family.key in out for family in FAMILIES)
    assert all(c.about in out for c in CAPABILITIES)
    assert max(map(len, out.splitlines())) <= WIDTH


@pytest.mark.slow
@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("purpose", [p.key for p in PURPOSES])
def test_a_recommendation(purpose: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["models", "--for", purpose]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= WIDTH
    assert "Next:" in out
    assert "{" not in out


@pytest.mark.slow
@pytest.mark.usefixtures("quick")
def test_a_recommendation_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["models", "--for", "berthing", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["ranking"][0]["family"] == "lowMMG"
    assert said["ranking"][0]["items_unmet"] == []
    assert len(said["ranking"]) == len(FAMILIES)
    assert said["next"][-1].endswith("--scope berthing")


def test_an_unknown_purpose(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["models", "--for", "fishing"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert all(p.key in said.err for p in PURPOSES)


@pytest.mark.long
@pytest.mark.usefixtures("quick")
def test_every_command_of_the_guide_runs(tmp_path: Path, monkeypatch, capsys) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    study = re.search(r"```toml\n(.*?)```", GUIDE, re.DOTALL)
    assert study is not None
    (tmp_path / "study.toml").write_text(study[1])
    monkeypatch.chdir(tmp_path)
    assert len(COMMANDS) > 8
    assert SLOW in COMMANDS
    for line in COMMANDS:
        if line == SLOW:
            continue
        assert main(shlex.split(line)[1:]) == 0, f"{line}\n{capsys.readouterr().err}"
