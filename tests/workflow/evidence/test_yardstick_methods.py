"""Methods of the yardstick on simulated trials: the truth is right, a program sees what is given, others are told."""

from __future__ import annotations

import json
import math
import os
import time
from pathlib import Path

import numpy as np
import pytest

from seatrial.belief.corrected import as_logged
from seatrial.cli.app import main
from seatrial.data import Trial
from seatrial.data.trialfile import write_trials
from seatrial.models import STATES
from seatrial.ships.files import load
from seatrial.simulate.replay import replay
from seatrial.workflow.evidence.yardstick import BASELINE, yardstick
from seatrial.workflow.request import RequestError

SET = """schema = "seatrial-yardstick/1"
title = "KVLCC2 without noise"
ship = "kvlcc2_l7"
given = ["n_P", "delta"]
history = 5.0
horizons = [5.0, 20.0]
every = 20.0
[data]
train = ["a"]
test = ["b"]
[virtual]
ship = "kvlcc2_l7"
seed = 1
duration = 60.0
sample = 0.5
orders = false
[virtual.trials.a]
type = "zigzag:Zigzag"
rudder = 10.0
heading = 10.0
[virtual.trials.b]
type = "turning:Turning"
rudder = 20.0
"""

PROGRAM = '''"""Stands still, and writes down what it was shown."""
import csv, json, os, pathlib, sys

home = pathlib.Path(sys.argv[1])
task = json.loads((home / "task.json").read_text())
seen = {"train": sorted(p.name for p in (home / "train").glob("*.csv")), "data": os.environ.get("SEATRIAL_DATA", ""),
        "task": task, "asked": {}}
for path in sorted((home / "asked").glob("*.csv")):
    with path.open() as file:
        rows = list(csv.DictReader(file))
    names = {k.split(" ")[0]: k for k in rows[0]}
    after = [row for row in rows if float(row["t [s]"]) > 0.0]
    last = [row for row in rows if float(row["t [s]"]) <= 0.0][-1]
    seen["asked"][path.stem] = sorted(n for n, k in names.items() if n != "t" and all(row[k] for row in after))
    held = ",".join(last[names[n]] for n in ("x", "y", "psi"))
    lines = ["t [s],x [m],y [m],psi [rad]"] + [row["t [s]"] + "," + held for row in after]
    (home / "predicted" / path.name).write_text("\\n".join(lines) + "\\n")
pathlib.Path(__file__).with_suffix(".json").write_text(json.dumps(seen))
'''


@pytest.fixture
def task(tmp_path: Path) -> Path:
    path = tmp_path / "calm.toml"
    path.write_text(SET)
    return path


@pytest.mark.slow
def test_the_truth_itself_has_no_error_and_another_ship_has(task: Path) -> None:
    (row,) = yardstick([task], ["kvlcc2_l7", "esso_osaka_3m"]).result.sets
    baseline, truth, other = row.standings
    assert baseline.method == BASELINE
    assert row.train == ("a",)
    assert truth.eq25 < 1e-3 < baseline.eq25
    assert truth.ahead[1].position < 0.02
    assert other.ahead[1].position > 10.0 * truth.ahead[1].position
    assert truth.count == 2  # 60 s, starts at 5 and 25 s


@pytest.mark.slow
def test_a_program_sees_what_is_given_and_its_answers_are_judged(
    task: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A ship that is said to stand still is wrong by the way it makes."""
    monkeypatch.setenv("SEATRIAL_DATA", "somewhere")
    program = tmp_path / "still.py"
    program.write_text(PROGRAM)
    (row,) = yardstick([task], [str(program)]).result.sets
    baseline, still = row.standings
    seen = json.loads(program.with_suffix(".json").read_text())
    assert seen["train"] == ["a.csv"]
    assert seen["data"] == ""
    assert seen["task"]["horizons"] == [5.0, 20.0]
    assert all(shown == ["delta", "n_P"] for shown in seen["asked"].values())
    assert still.failed == 0
    assert math.isnan(still.eq25)  # it says nothing of velocities
    # about 1.2 m/s, less as the turn slows it and bends its way
    assert 4.0 < still.ahead[0].position < 7.0
    assert baseline.ahead[0].position < still.ahead[0].position


@pytest.mark.slow
def test_a_program_that_fails_is_told_and_the_others_are_measured(task: Path, tmp_path: Path) -> None:
    program = tmp_path / "broken.py"
    program.write_text("raise SystemExit('no such method')\n")
    outcome = yardstick([task], [str(program), "kvlcc2_l7"])
    assert [one.method for one in outcome.result.sets[0].standings] == [BASELINE, "kvlcc2_l7"]
    assert outcome.errors == (f"calm: {program}: {program} ended with 1: no such method",)


@pytest.mark.slow
def test_the_cost_of_a_method_is_processor_time_that_of_a_program_included(task: Path, tmp_path: Path) -> None:
    """A program that waits costs what it takes to start it; one that reckons for a second costs a second more."""
    waits, reckons = tmp_path / "waits.py", tmp_path / "reckons.py"
    waits.write_text("import time\ntime.sleep(1.0)\n")
    reckons.write_text("import time\nwhile time.process_time() < 1.0:\n    pass\n")
    begin = time.process_time()
    (row,) = yardstick([task], [str(waits), str(reckons), "kvlcc2_l7"]).result.sets
    here = time.process_time() - begin
    _, waiting, reckoning, ship = (one.seconds for one in row.standings)
    assert waiting < 0.5
    assert 1.0 <= reckoning < 1.5
    assert 0.0 < ship < here


@pytest.mark.slow
def test_a_study_is_fitted_to_the_training_trials_of_the_set(task: Path, tmp_path: Path) -> None:
    """A number that is half of the truth is found again from trials that are not those of the study's own table."""
    study = tmp_path / "own.toml"
    study.write_text(
        'schema = "seatrial-study/1"\nship = "kvlcc2_l7"\n[data]\nroot = "nowhere"\ntrain = ["*"]\n'
        '[free]\n"hull.N_r" = { start = -0.025, low = -0.1, high = -0.01 }\n[loss]\nsigma = { psi = 0.01, r = 0.001 }\n'
        '[estimator]\ntype = "shooting:Trajectory"\nwindow = 20.0\n'
    )
    (row,) = yardstick([task], [str(study)]).result.sets
    assert row.standings[1].ahead[1].heading < 2e-3
    assert row.standings[1].eq25 < 1e-3


@pytest.mark.slow
def test_a_study_that_cannot_take_the_trials_is_told_and_the_others_are_measured(task: Path, tmp_path: Path) -> None:
    """It lacks a state that its loss names; weights of trials that a set does not have are of no concern."""
    text = ('schema = "seatrial-study/1"\nship = "kvlcc2_l7"\n[data]\nroot = "nowhere"\ntrain = ["*"]\n'
            '[free]\n"hull.N_r" = { prior = 0.3 }\n[loss]\nsigma = { SIGMA = 0.01 }\nweights = { "other*" = 2.0 }\n'
            '[estimator]\ntype = "shooting:Trajectory"\nwindow = 20.0\n')  # fmt: skip
    wrong, right = tmp_path / "wrong.toml", tmp_path / "right.toml"
    wrong.write_text(text.replace("SIGMA", "phi"))
    right.write_text(text.replace("SIGMA", "psi"))
    outcome = yardstick([task], [str(wrong), str(right)])
    (row,) = outcome.result.sets
    assert [one.method for one in row.standings] == [BASELINE, str(right)]
    assert [*row.refused] == [str(wrong)]
    assert len(outcome.errors) == 1


@pytest.mark.slow
def test_without_a_method_those_that_the_set_names_are_measured(task: Path, tmp_path: Path) -> None:
    """Their files lie beside the set; a package that a program lacks is told with where it is to be had."""
    (tmp_path / "needy.py").write_text("import no_such_package\n")
    (tmp_path / "requirements.txt").write_text("no_such_package\n")
    (tmp_path / "still.py").write_text(PROGRAM)
    task.write_text(SET.replace("every = 20.0", 'every = 20.0\nmethods = ["needy.py", "still.py"]'))
    outcome = yardstick([task])
    (row,) = outcome.result.sets
    still, needy = (os.path.relpath(tmp_path / name) for name in ("still.py", "needy.py"))
    assert [one.method for one in row.standings] == [BASELINE, still]
    assert list(row.refused) == [needy]
    assert f"pip install -r {os.path.relpath(tmp_path / 'requirements.txt')}" in outcome.errors[0]
    (named,) = yardstick([task], ["kvlcc2_l7"]).result.sets
    assert [one.method for one in named.standings] == [BASELINE, "kvlcc2_l7"]
    task.write_text(SET.replace("every = 20.0", 'every = 20.0\nmethods = ["gone.py"]'))
    with pytest.raises(RequestError, match=r"methods: no file .*gone\.py"):
        yardstick([task])


@pytest.mark.slow
def test_a_set_whose_data_are_not_here_is_left_out_and_told(
    task: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "studies" / "yardstick"
    folder.mkdir(parents=True)
    (folder / "here.toml").write_text(SET)
    data = 'root = "$SEATRIAL_DATA/nowhere"\nformat = "csv"\n'
    (folder / "away.toml").write_text(SET.partition("[virtual]")[0].replace("[data]\n", f"[data]\n{data}"))
    monkeypatch.chdir(tmp_path)
    assert main(["yardstick", "-o", "found.json"]) == 0
    assert "left out" in capsys.readouterr().err
    assert [one["name"] for one in json.loads(Path("found.json").read_text())["sets"]] == ["here"]


COMPASS = """schema = "seatrial-study/1"
ship = "blueboat"
[data]
root = "nowhere"
train = ["*"]
[free]
"damping.X_uu" = { prior = 0.3 }
[loss]
sigma = { x = 0.05, y = 0.05, psi = 0.01 }
[nuisance]
common = { "deviation.north" = 0.2, "deviation.east" = 0.2 }
[estimator]
type = "shooting:Trajectory"
window = 10.0
"""


@pytest.mark.slow
def test_a_study_that_finds_a_deviation_predicts_what_that_compass_reads(tmp_path: Path) -> None:
    """A boat by its own model, logged by a compass that deviates 9 deg, with speeds made of that heading.

    The truth begun with the sway as logged turns away by itself; a fit that knows the compass does not, though by then
    that reads another 5 deg too much, which its cycle does not tell and the sway does.
    """
    (tmp_path / "logs").mkdir()
    ship, t = load("blueboat"), 0.1 * np.arange(1200)
    rng, errors = np.random.default_rng(3), {"deviation.north": -0.15, "deviation.east": 0.05}
    for name in ("a", "b"):
        orders = {f"throttle_{side}": np.repeat(rng.uniform(0.2, 0.9, 24), 50) for side in ("port", "starboard")}
        zero = dict.fromkeys(STATES, np.zeros(t.size))
        made = replay(ship, Trial(name, t, {**zero, **orders})).having(**orders)
        log = as_logged(made, errors | {"bias.psi": 0.08 * (name == "b")}, ship.model, ("u", "v_m", "r"))
        write_trials([log], tmp_path / "logs")
    (tmp_path / "study.toml").write_text(COMPASS)
    task = tmp_path / "lake.toml"
    task.write_text(
        'schema = "seatrial-yardstick/1"\ntitle = "lake"\nship = "blueboat"\ngiven = ["throttle_*"]\nhistory = 5.0\n'
        'horizons = [2.0, 10.0]\nevery = 20.0\n[data]\nroot = "logs"\ntrain = ["a"]\ntest = ["b"]\n'
    )
    (row,) = yardstick([task], ["blueboat", str(tmp_path / "study.toml")]).result.sets
    _, bare, study = row.standings
    assert study.ahead[1].heading < 0.02
    assert study.ahead[0].position < 0.02
    assert bare.ahead[1].heading > 5.0 * study.ahead[1].heading
    assert study.eq25 < 0.1 * bare.eq25


def test_what_is_no_method_and_no_set_is_refused_in_a_line(
    task: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(RequestError, match="a method is a study, a ship or a program"):
        yardstick([task], ["kvlcc3"])
    with pytest.raises(RequestError, match=r"\.json"):
        yardstick([task], out=tmp_path / "a.csv")
    monkeypatch.chdir(tmp_path)
    assert main(["yardstick"]) == 2
    assert "studies/yardstick" in capsys.readouterr().err.replace(os.sep, "/")


@pytest.mark.slow
def test_the_result_is_json_for_others(task: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "found.json"
    assert main(["yardstick", str(task), "--method", "kvlcc2_l7", "-o", str(out), "--json"]) == 0
    shown, kept = json.loads(capsys.readouterr().out), json.loads(out.read_text())
    assert kept["schema"] == "seatrial-yardstick-result/1"
    for found in (shown, kept):
        one = found["sets"][0]["standings"][1]
        assert one["method"] == "kvlcc2_l7"
        assert one["ahead"][0]["horizon"] == 5.0


@pytest.mark.slow
def test_of_trials_left_out_in_turn_each_answer_meets_its_own_question(task: Path, tmp_path: Path) -> None:
    """A program knows the rudder of the trials it has, and so which part it is asked for: it fails in one of two."""
    task.write_text(SET.replace('train = ["a"]\ntest = ["b"]', 'train = ["b", "a"]').replace(
        "every = 20.0", "every = 20.0\nleft_out = 1"))  # fmt: skip
    program = tmp_path / "half.py"
    program.write_text(
        PROGRAM.replace(
            'for path in sorted((home / "asked")',
            """if (home / "train" / "a.csv").exists():
    sys.exit()
for path in sorted((home / "asked")""",
        )
    )
    (row,) = yardstick([task], ["kvlcc2_l7", str(program)]).result.sets
    _, truth, half = row.standings
    assert row.train == ("b", "a")
    assert (truth.count, half.count, half.failed) == (4, 4, 2)
    assert truth.ahead[1].position < 0.02  # of a turn and a zigzag; another order would mix them
    # so are the answers about training trials, from which its bands are: narrow only where each meets its question
    assert truth.ahead[1].width[0] < 0.1


@pytest.mark.slow
def test_a_first_study_is_a_method(task: Path) -> None:
    (row,) = yardstick([task], ["new:kvlcc2_l7"]).result.sets
    baseline, first = row.standings
    assert first.method == "new:kvlcc2_l7"
    assert first.ahead[1].position < 0.2 * baseline.ahead[1].position
    with pytest.raises(RequestError, match="kvlcc2_l77"):
        yardstick([task], ["new:kvlcc2_l77"])
