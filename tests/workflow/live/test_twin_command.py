"""`seatrial twin`: what it refuses, and what it leaves in its folder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from seatrial.cli.app import main
from seatrial.data.trialfile import write_trial
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import simulate
from seatrial.workflow import RequestError
from seatrial.workflow.live.twin import CARD, MODEL, STATE, twin

SHIP = load("kvlcc2_l7")


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A zigzag of half a minute."""
    run = simulate(SHIP, Zigzag(10.42, 0.35, 0.35), dt=0.5, duration=30.0, name="zigzag")
    write_trial(run, tmp_path / "zigzag.csv")
    return tmp_path / "zigzag.csv"


def test_it_follows_one_log(log: Path) -> None:
    for given in ({}, {"trial": log, "nmea": "a.nmea"}):
        with pytest.raises(RequestError, match="give one log"):
            twin(SHIP, **given)  # type: ignore[arg-type]
    with pytest.raises(RequestError, match="not an address"):
        twin(SHIP, nmea="udp://somewhere")


@pytest.mark.slow
def test_it_leaves_a_ship_a_card_and_its_state(log: Path, tmp_path: Path) -> None:
    said: list[str] = []
    outcome = twin(SHIP, trial=log, out=tmp_path / "out", free=("hull.N_r",), note=said.append)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {STATE, MODEL, CARD, "card.json"}
    again: Any = load(str(tmp_path / "out" / MODEL))
    assert outcome.result.follower is not None
    assert float(again.model.hull.N_r) == outcome.result.follower.value("hull.N_r")[0]
    twin(SHIP, trial=log, out=tmp_path / "out", free=("hull.N_r",), note=said.append)
    assert any("goes on from t = 30 s" in line for line in said)


@pytest.mark.slow
def test_a_log_of_a_robot_is_followed_as_the_trial_is(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The same numbers through standard messages; half a file, another format and another ship are one line."""
    pytest.importorskip("mcap")
    assert main(["convert", str(log), "--to", "mcap", "-o", str(tmp_path)]) == 0
    robot, found = log.with_suffix(".mcap"), []
    capsys.readouterr()
    for given in (["--trial", str(log)], ["--mcap", str(robot)]):
        assert main(["twin", "kvlcc2_l7", *given, "--json"]) == 0
        found.append(json.loads(capsys.readouterr().out))
    one, other = ({each["name"]: each for each in card["unseen"]} for card in found)
    assert set(one) == set(other)
    for name, each in one.items():
        assert other[name]["sd"] == pytest.approx(each["sd"], rel=1e-6)
        assert other[name]["value"] == pytest.approx(each["value"], abs=1e-6 * each["sd"])
    assert found[0]["hours"][0]["readings"] == found[1]["hours"][0]["readings"]
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(robot.read_bytes()[:300])
    for ship, path, told in (("kvlcc2_l7", cut, "found no message"), ("kvlcc2_l7", log, "give a whole MCAP file"),
                             ("milliampere", robot, "no channel f_bow")):  # fmt: skip
        assert main(["twin", ship, "--mcap", str(path)]) == 2
        said = capsys.readouterr().err.strip()
        assert told in said
        assert "\n" not in said
