"""`seatrial twin`: what it refuses, and what it leaves in its folder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data import DataError, Trial
from seatrial.data.trialfile import read_trial, write_trial
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.approach import approach
from seatrial.simulate.run import simulate
from seatrial.workflow import RequestError
from seatrial.workflow.live import twin as module
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
def test_a_log_without_revolutions_is_followed_with_those_that_hold_its_first_speed(log: Path, tmp_path: Path) -> None:
    """As a fit takes them; with an order it is what the engine makes of that, and a rudder that nobody knows is not."""
    run = read_trial(log)
    without = [name for name in run.channels if not name.startswith("n_P")]
    write_trial(Trial("bare", run.t, {name: run[name] for name in without}), tmp_path / "bare.csv")
    said: list[str] = []
    outcome = twin(SHIP, trial=tmp_path / "bare.csv", note=said.append)
    (told,) = [line for line in said if line.startswith("no n_P in the log")]
    holding = approach(SHIP, speed=float(np.median(run["u"][run.t <= 3.0 * SHIP.L_pp / SHIP.speed])))[1]
    assert f"{holding:.4g} 1/s" in told
    assert outcome.result.follower is not None
    assert outcome.result.acting[SHIP.model.controls.index("n_P")] == pytest.approx(holding, rel=1e-2)
    write_trial(Trial("ordered", run.t, {**{name: run[name] for name in without}, "n_P_cmd": np.full(len(run), 9.0)}),
                tmp_path / "ordered.csv")  # fmt: skip
    said.clear()
    ordered = twin(SHIP, trial=tmp_path / "ordered.csv", note=said.append)
    assert ordered.result.acting[SHIP.model.controls.index("n_P")] == 9.0
    assert any("makes of n_P_cmd" in line for line in said)
    bare = {name: run[name] for name in without if not name.startswith("delta")}
    write_trial(Trial("unsteered", run.t, bare), tmp_path / "unsteered.csv")
    with pytest.raises(DataError, match="no channel delta; a twin is steered by"):
        twin(SHIP, trial=tmp_path / "unsteered.csv")


def test_a_wire_that_tells_no_revolutions_gets_those_of_its_first_speed() -> None:
    """After half a minute of speeds, until the shaft is told; a wire that tells it is left as it is."""
    n_P = approach(SHIP)[1]
    rows = [(float(t), {"psi": 0.0, "v_north": 0.6 * SHIP.speed, "v_east": 0.8 * SHIP.speed}) for t in range(50)]
    rows[40:] = [(t, {**values, "n_P": 9.0}) if t % 2 else (t, values) for t, values in rows[40:]]
    said: list[str] = []
    found = list(module._powered(iter(rows), SHIP, said.append))
    assert [t for t, _ in found] == [t for t, _ in rows]
    assert all("n_P" not in values for _, values in found[:30])
    assert [values["n_P"] for _, values in found[30:41]] == pytest.approx([n_P] * 11, rel=1e-6)
    assert found[41:] == rows[41:]
    assert len(said) == 1
    told = [(t, {**values, "n_P": 9.0}) for t, values in rows]
    assert list(module._powered(iter(told), SHIP, said.append)) == told
    twins = load("twin_virtual")  # a shaft of two, or one reading for both
    for name in ("n_P", "n_P_1"):
        some = [(t, {**values, name: 9.0}) for t, values in rows[:40]]
        found = list(module._powered(iter(some), twins, said.append))
        assert [name in values and values[name] == 9.0 for _, values in found] == [True] * 40
        assert ("n_P_2" in found[-1][1]) == (name == "n_P_1")
        assert "n_P_1" not in found[-1][1] or name == "n_P_1"
    by_turns = [(t, {**values, "n_P_1": 9.0} if t % 2 else values) for t, values in rows[:40]]
    found = list(module._powered(iter(by_turns), twins, said.append))
    assert ["n_P_1" in values for _, values in found] == [False, True] * 20  # told is told
    del said[1:]
    still = [(t, {"psi": 0.0, "u_w": 0.0}) for t, _ in rows]
    assert list(module._powered(iter(still), SHIP, said.append)) == still
    assert len(said) == 1


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
