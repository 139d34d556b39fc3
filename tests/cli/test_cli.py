from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data import Trial
from seatrial.data.trialfile import read_trial, write_trial
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load, save
from seatrial.simulate.run import approach, simulate

WRONG, FAILED = 2, 1


@pytest.fixture(scope="module")
def run() -> Trial:
    ship = load("kvlcc2_l7")
    policy = Zigzag(approach(ship)[1], 0.35, 0.35)
    return simulate(ship, policy, duration=120.0, dt=0.02, every=5, name="zigzag_20_20")


@pytest.fixture
def trial(run: Trial, tmp_path: Path) -> Path:
    path = tmp_path / "logs" / "zigzag_20_20.csv"
    path.parent.mkdir()
    write_trial(run, path)
    return path


def test_ships_and_show(capsys) -> None:
    assert main(["ships", "--json"]) == 0
    assert "kvlcc2" in {ship["name"] for ship in json.loads(capsys.readouterr().out)["ships"]}
    assert main(["show", "kvlcc2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["parameters"]["body.L_pp"]["value"] == 320.0
    assert main(["show", "kvlcc2", "--sources"]) == 0
    assert "yasukawa2015" in capsys.readouterr().out


@pytest.mark.slow
def test_simulate_prints_one_json_object(capsys) -> None:
    assert main(["simulate", "kvlcc2", "turning", "--rudder", "35", "--side", "port", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    advance = said["indices"]["advance"]
    assert said["ship"] == "kvlcc2"
    assert said["manoeuvre"] == "turning"
    assert advance["over_L"] == pytest.approx(advance["value"] / 320.0)
    assert said["indices"]["drift"]["unit"] == "deg"
    assert main(["simulate", "kvlcc2", "zigzag", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["indices"]["first_overshoot"]["unit"] == "deg"


@pytest.mark.slow
def test_a_simulated_trial_is_written_and_predicted(trial: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "made" / "turn.csv"
    assert main(["simulate", "kvlcc2_l7", "turning", "-o", str(out)]) == 0
    assert read_trial(out).meta["kind"] == "turning"
    assert main(["predict", "kvlcc2_l7", str(trial), "-o", str(tmp_path / "p"), "--restart", "50"]) == 0
    predicted, measured = read_trial(tmp_path / "p" / trial.name), read_trial(trial)
    assert set(predicted.channels) == {"x", "y", "psi", "u", "v_m", "r"}
    np.testing.assert_array_equal(predicted.t, measured.t)
    np.testing.assert_allclose(predicted["psi"], measured["psi"], atol=0.02)


@pytest.mark.long
def test_validate_writes_page_and_numbers(trial: Path, tmp_path: Path, capsys) -> None:
    page = tmp_path / "v" / "report.html"
    assert main(["validate", "kvlcc2_l7", str(trial.parent), "-o", str(page), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert set(said["standardised"]) == {"published", "constant velocity"}
    assert page.exists()
    assert page.with_suffix(".json").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["simulate", "kvlc2", "turning"], "near: kvlcc2"),
        (["simulate", "kvlcc2", "spyral"], "turning, williamson, zigzag"),
        (["simulate", "kvlcc2", "turning", "--rudder", "50"], "goes to 35 deg"),
        (["simulate", "kvlcc2", "turning", "--rudder", "-5"], "magnitude"),
        (["simulate", "kvlcc2", "turning", "--side", "left"], "known: port, starboard"),
        (["simulate", "kvlcc2", "turning", "--wind", "5"], "M/S,DEG"),
        (["simulate", "kvlcc2", "turning", "--dt", "0"], "--dt is 0"),
        (["show", "nowhere.toml"], "no such ship file"),
        (["import", "dat9", "x", "-o", "y"], "frt-esso"),
        (["check", "nowhere.csv"], "nowhere.csv"),
        (["identify", "nowhere.toml", "-o", "x"], "no such study file"),
        (["simulat"], "simulate"),
        (["validate", "kvlcc2", "x.csv", "-o", "report.json"], "ends in .html"),
    ],
)
def test_wrong_requests_say_so_in_one_line(arguments: list[str], words: str, capsys, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == WRONG
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert words in said.err
    assert not list(tmp_path.iterdir()), "nothing may be left behind"


def _damage(text: str, kind: str) -> bytes:
    head, *rows = text.splitlines()
    made = {
        "no unit": [head.replace("psi [rad]", "psi"), *rows],
        "unknown unit": [head.replace("psi [rad]", "psi [quadrant]"), *rows],
        "unsorted": [head, rows[1], rows[0], *rows[2:]],
        "repeated": [head, rows[0], *rows],
        "one row": [head, rows[0]],
        "empty": [],
    }
    return b"\x89PNG\x00\xff\xfe\x00" * 50 if kind == "binary" else "\n".join(made[kind]).encode()


@pytest.mark.parametrize(
    ("kind", "words"),
    [("no unit", "no unit"), ("unknown unit", "quadrant"), ("unsorted", "time"), ("repeated", "time"),
     ("one row", "row"), ("empty", "empty"), ("binary", "text")],
)  # fmt: skip
def test_bad_files_are_refused_and_nothing_is_written(trial, kind, words, tmp_path, capsys) -> None:
    trial.write_bytes(_damage(trial.read_text(), kind))
    assert main(["predict", "kvlcc2_l7", str(trial), "-o", str(tmp_path / "p")]) == WRONG
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert words in said
    assert not (tmp_path / "p").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.having(delta=-t["delta"]), "rudder sign"),
        (lambda t: t.having(u=np.full_like(t.t, 1.0)), "u"),
        (
            lambda t: t.having(
                u=t["u"] * np.cos(t["psi"]) - t["v_m"] * np.sin(t["psi"]),
                v_m=t["u"] * np.sin(t["psi"]) + t["v_m"] * np.cos(t["psi"]),
            ),
            "velocities north and east",
        ),
    ],
)
def test_check_finds_what_logs_get_wrong(run, change, words, tmp_path, capsys) -> None:
    write_trial(change(run), tmp_path / "log.csv")
    status = main(["check", str(tmp_path / "log.csv")])
    said = capsys.readouterr().out
    assert words in said
    assert status == (FAILED if "error:" in said else 0)


def test_a_trial_without_what_the_model_needs(run: Trial, tmp_path: Path, capsys) -> None:
    kept = {n: v for n, v in run.channels.items() if n != "delta"}
    write_trial(Trial("bare", run.t, kept), tmp_path / "bare.csv")
    assert main(["predict", "kvlcc2_l7", str(tmp_path / "bare.csv"), "-o", str(tmp_path / "p")]) == WRONG
    assert "delta" in capsys.readouterr().err


def test_predictions_never_overwrite_their_trials(trial: Path, capsys) -> None:
    before = trial.read_bytes()
    assert main(["predict", "kvlcc2_l7", str(trial), "-o", str(trial.parent)]) == WRONG
    assert "another folder" in capsys.readouterr().err
    assert trial.read_bytes() == before


STUDY = """
schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[data]
root = "logs"
train = ["zigzag*.csv"]
[free]
"hull.Y_v" = { prior = 0.3 }
[estimator]
type = "shooting:Trajectory"
window = 30.0
iterations = 3
"""


@pytest.mark.long
def test_identify_runs_once_and_knows_its_folder(trial: Path, tmp_path: Path, capsys) -> None:
    study, out = tmp_path / "study.toml", tmp_path / "run"
    study.write_text(STUDY)
    assert main(["identify", str(study), "-o", str(out), "--json"]) == 0
    first = json.loads(capsys.readouterr().out)
    assert {p.name for p in out.iterdir()} >= {"model.toml", "fit.json", "history.csv", "report.html"}
    assert main(["validate", str(out / "model.toml"), str(trial), "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)["standardised"]) == {"fitted", "published", "constant velocity"}
    assert main(["identify", str(study), "-o", str(out), "--json"]) == 0
    again = capsys.readouterr()
    assert "done already" in again.err
    assert json.loads(again.out)["parameters"] == first["parameters"]
    study.write_text(STUDY.replace("30.0", "20.0"))
    assert main(["identify", str(study), "-o", str(out)]) == WRONG
    assert "another folder" in capsys.readouterr().err


def test_a_ship_that_cannot_feel_the_wind_refuses_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "kvlcc2_l7", "turning", "--wind", "5,90"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "kvlcc2_l7" in said
    assert "wind" in said


@pytest.mark.slow
def test_validate_says_where_a_log_leaps(trial: Path, capsys) -> None:
    log = read_trial(trial)
    write_trial(log.rows((log.t < 20.0) | (log.t > 40.0)), trial)
    assert main(["validate", "kvlcc2_l7", str(trial)]) == 0
    assert re.search(r"zigzag_20_20\b.* 20\b", capsys.readouterr().err)


@pytest.mark.parametrize("manoeuvre", ["stopping", "crash-astern", "acceleration"])
def test_a_ship_without_an_engine_cannot_stop_by_it(manoeuvre: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "zeefakkel", manoeuvre]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    (line,) = [one for one in told.err.splitlines() if "engine" in one]
    assert line.startswith(f"error: {manoeuvre}: ")
    assert "zeefakkel" in line


PLANTED = """
from dataclasses import dataclass
from pathlib import Path
from seatrial.models.mmg import Mmg as Mmg
from seatrial.identify.trajectory.shooting import Trajectory as Trajectory
Path(__file__).with_suffix(".ran").touch()
"""


@pytest.mark.slow
def test_files_run_code_only_where_the_command_line_names_its_module(
    run: Trial, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    (tmp_path / "planted.py").write_text(PLANTED)
    monkeypatch.syspath_prepend(str(tmp_path))
    write_trial(run, tmp_path / "zigzag.csv")
    ship, study = tmp_path / "own.toml", tmp_path / "study.toml"
    save(load("kvlcc2_l7"), ship)
    ship.write_text(ship.read_text().replace("mmg:Mmg", "planted:Mmg"))
    study.write_text(
        'schema = "seatrial-study/1"\nship = "kvlcc2_l7"\n[data]\nroot = "."\ntrain = ["zigzag.csv"]\n'
        '[free]\n"hull.Y_v" = { ratio = 0.5 }\n[estimator]\ntype = "planted:Trajectory"\n'
    )
    for request in (["show", str(ship)], ["identify", str(study), "-o", str(tmp_path / "run")]):
        for extra in ([], ["--trust", "plant"], ["--trust", "planted.more"]):
            assert main([*request, *extra]) == WRONG
            said = capsys.readouterr().err
            assert "--trust planted" in said
            assert said.count("\n") == 1
    assert not (tmp_path / "planted.ran").exists()
    assert main(["show", str(ship), "--trust", "planted", "--json"]) == 0
    assert (tmp_path / "planted.ran").exists()
    assert main(["show", str(ship)]) == WRONG, "trust ends with its command"


@pytest.mark.parametrize(("option", "given"), [("--current", "90,1"), ("--wind", "270,5")])
def test_a_speed_and_a_direction_that_changed_places_are_told(option: str, given: str, capsys) -> None:
    assert main(["simulate", "esso_osaka_3m", "straight", option, given]) == WRONG
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{option} is '{given}'" in line
    assert "write M/S,DEG" in line


@pytest.mark.parametrize("header", ["n_bow [kn]", "throttle_port [rpm]", "alpha_1 [rpm]"])
def test_a_thruster_is_not_measured_in_the_unit_of_something_else(header: str, trial: Path, capsys) -> None:
    lines = trial.read_text().splitlines()
    trial.write_text("\n".join([f"{lines[0]},{header}", *(f"{line},0.5" for line in lines[1:])]) + "\n")
    assert main(["check", str(trial)]) == WRONG
    (line,) = capsys.readouterr().err.splitlines()
    assert f"'{header.partition(' ')[0]}'" in line
    assert f"'{header.partition('[')[2][:-1]}'" in line
@pytest.mark.slow
def test_a_shared_recording_is_told_of_the_trial_whatever_it_is_called(run: Trial, tmp_path: Path, capsys) -> None:
    for folder, name in (("train", "one and two"), ("test", "port and starboard")):
        (tmp_path / folder).mkdir()
        write_trial(run, tmp_path / folder / f"{name}.csv")
    assert main(["check", str(tmp_path / "test"), "--against", str(tmp_path / "train"), "--json"]) == FAILED
    (found,) = [f for f in json.loads(capsys.readouterr().out)["trials"]["port and starboard"] if "share" in f["what"]]
    assert found["trials"] == ["one and two", "port and starboard"]


@pytest.mark.parametrize("name", ["cuda:99", "gpu"])
def test_a_device_that_is_not_here_is_named_in_one_line(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "kvlcc2_l7", "turning", "--device", name]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("\n") == 1
    assert name.removeprefix("cuda:") in told.err
