"""Several sets of trials in one study, scaled to its ship where they say so."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.data.prepare import froude_scaled
from seatrial.data.trialfile import write_trial
from seatrial.exchange.robot_log import save_robot_log
from seatrial.identify import StudyError
from seatrial.identify.lint import lint
from seatrial.manoeuvres.turning import Turning
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate
from seatrial.study.study import read_study

STUDY = """
schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[[data.set]]
root = "tank"
train = ["*"]
test = ["tank_b*"]
[[data.set]]
root = "sea"
train = ["sea_a*"]
validation = ["sea_b*"]
scale_to = "ship"
[free]
"hull.Y_v" = { prior = 0.3 }
"""
RATIO = 320.0 / 7.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four turns of the model; two of them written as the ship at sea would have made them."""
    ship, root = load("kvlcc2_l7"), tmp_path_factory.mktemp("study")
    for k, (place, name) in enumerate((p, n) for p in ("tank", "sea") for n in "ab"):
        (root / place).mkdir(exist_ok=True)
        policy = Turning(approach(ship)[1], (-1) ** k * (0.2 + 0.05 * k))
        run = simulate(ship, policy, duration=60, dt=0.1, name=f"{place}_{name}")
        run = run.having(thrust=np.ones(len(run)))
        run = replace(run, units={**run.units, "thrust": "N"}, meta={**run.meta, "L_pp": 7.0, "scale": RATIO})
        if place == "sea":
            run = replace(froude_scaled(run, RATIO), units={**run.units, "thrust": "N"})
            run = run.having(thrust=np.ones(len(run)))
            run = replace(run, meta={**run.meta, "ship": "kvlcc2"})
        write_trial(run, root / place / f"{run.name}.csv")
    return root


def study(folder: Path, text: str):
    path = folder / "study.toml"
    path.write_text(text)
    return read_study(path)


@pytest.mark.slow
def test_sets_are_joined_each_with_its_own_lists(folder: Path) -> None:
    found = study(folder, STUDY)
    assert [t.name for t in found.problem.trials] == ["tank_a", "sea_a"]
    assert [t.name for t in found.problem.validation] == ["sea_b"]
    assert [t.name for t in found.test] == ["tank_b"]


@pytest.mark.slow
def test_scaling_is_by_froude_and_recorded(folder: Path) -> None:
    trial = study(folder, STUDY).problem.trials[1]
    assert trial.meta["L_pp"] == pytest.approx(7.0)
    assert trial.meta["ship"] == "kvlcc2_l7"
    assert trial.dt == pytest.approx(0.1)
    assert trial["u"][0] == pytest.approx(1.179, abs=0.01)
    assert trial["n_P"][-1] == pytest.approx(approach(load("kvlcc2_l7"))[1], rel=1e-9)
    assert "thrust" not in trial  # a force scales with the density too
    steps = " | ".join(trial.meta["processing"])
    assert "equal Froude number" in steps
    assert "thrust" in steps
    assert "recorded as of kvlcc2, L_pp 320 m" in steps
    assert "thrust" in study(folder, STUDY).test[0]


@pytest.mark.slow
def test_without_the_step_lint_refuses_the_other_scale(folder: Path) -> None:
    found = study(folder, STUDY.replace('scale_to = "ship"', ""))
    errors = [i for i in lint(found.problem, found.test) if i.severity == "error"]
    assert {i.where for i in errors} == {"sea_a", "sea_b"}
    assert "320 m, kvlcc2_l7 has 7 m" in errors[0].text
    assert "scale_to" in errors[0].text
    assert not [i for i in lint(study(folder, STUDY).problem) if i.severity == "error"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('root = "tank"', 'rot = "tank"', "near: root"),
        ('scale_to = "ship"', 'scale_to = "model"', "scale_to"),
        ('[[data.set]]\nroot = "tank"', '[data]\ntrain = ["*"]\n[[data.set]]\nroot = "tank"', "beside [[data.set]]"),
        ('root = "sea"', 'root = "see"', "data.set 2.root"),
        ('["sea_b*"]', '["see_b*"]', "data.set 2.validation: 'see_b*' fits no file; near: sea_b.csv"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(folder: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(StudyError) as caught:
        study(folder, STUDY.replace(old, new))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_trial_without_a_length_cannot_be_scaled(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "sea").mkdir()
    run = simulate(load("kvlcc2_l7"), Turning(10.0, 0.3), duration=20, dt=0.1, name="sea_a")
    write_trial(replace(run, meta={}), tmp_path / "sea" / "sea_a.csv")
    text = STUDY[: STUDY.index("[[data")] + STUDY[STUDY.rindex("[[data") :].replace('validation = ["sea_b*"]', "")
    with pytest.raises(StudyError, match="sea_a does not say of what length"):
        study(tmp_path, text)


def one_set(folder: Path, lines: str) -> str:
    """A study of the folder `logs` alone."""
    (folder / "logs").mkdir(exist_ok=True)
    head, tail = STUDY[: STUDY.index("[[data")], STUDY[STUDY.index("[free]") :]
    return f'{head}[data]\nroot = "logs"\ntrain = ["*"]\n{lines}\n{tail}'


@pytest.mark.slow
def test_a_study_reads_what_import_reads(folder: Path) -> None:
    """Each format by the one table: logs of robots, and a mapping of their topics, which counts here too."""
    pytest.importorskip("rosbags")
    run = simulate(load("kvlcc2_l7"), Turning(10.0, 0.3), duration=20, dt=0.1, name="run")
    for format in ("mcap", "rosbag2"):
        text = one_set(folder, f'format = "{format}"')
        save_robot_log(run, format, folder / "logs")
        (trial,) = study(folder, text).problem.trials
        assert trial["delta"] == pytest.approx(run["delta"])
        (folder / "topics.toml").write_text(
            'schema = "seatrial-robot/1"\nnumbers = { "/delta" = { channel = "delta", unit = "deg", sign = -1 } }\n'
        )
        mapped = text.replace("format =", 'mapping = "topics.toml"\nformat =')
        (trial,) = study(folder, mapped).problem.trials
        assert trial["delta"] == pytest.approx(-np.radians(run["delta"]))


@pytest.mark.slow
def test_a_study_reads_folders_of_topics_by_a_mapping(folder: Path, tmp_path: Path) -> None:
    """Each folder is one trial of that name; where the mapping cuts the logs, the trials are those of the cuts."""
    run = simulate(load("kvlcc2_l7"), Turning(10.0, 0.3), duration=20, dt=0.1, name="run")
    columns = ("x", "y", "psi", "u", "v_m", "r", "n_P")
    for name in ("one", "two"):
        (tmp_path / "logs" / name).mkdir(parents=True)
        for file, names in (("motion.csv", columns), ("rudder.csv", ("delta",))):
            rows = [",".join(map(repr, row)) for row in run.stack("t", *names).tolist()]
            (tmp_path / "logs" / name / file).write_text("\n".join([",".join(("t", *names)), *rows]))
    units = {"x": "m", "y": "m", "psi": "rad", "u": "m/s", "v_m": "m/s", "r": "rad/s", "n_P": "1/s", "delta": "rad"}
    channels = "".join(f'[channels.{n}]\ncolumn = "{n}"\nunit = "{u}"\n' for n, u in units.items())
    mapping = 'schema = "seatrial-mapping/1"\nL_pp = 7.0\ntime = { column = "t", unit = "s" }\n[files]\n' + (
        f'pattern = "motion.csv"\n{channels}file = "rudder.csv"\n')  # fmt: skip
    (tmp_path / "m.toml").write_text(mapping)
    text = one_set(tmp_path, 'test = ["two"]\nmapping = "m.toml"\nformat = "csv"')
    found = study(tmp_path, text)
    assert [one.name for one in found.problem.trials] == ["one"]
    assert found.test[0]["delta"] == pytest.approx(run["delta"])
    cut = "[[trial]]\nname = '{}'\n{}from = 0\nto = 9\n"
    (tmp_path / "m.toml").write_text(mapping + cut.format("a", "log = 'one'\n") + cut.format("b", "log = 'two'\n"))
    found = study(tmp_path, text.replace('["two"]', '["b"]'))
    assert [one.name for one in (*found.problem.trials, *found.test)] == ["a", "b"]
    assert found.test[0].t[-1] == pytest.approx(9.0)
    (tmp_path / "m.toml").write_text(mapping + cut.format("a", ""))
    with pytest.raises(StudyError, match=r"two trials are called a; name them apart"):
        study(tmp_path, text)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ('format = "simman"\nmapping = "m.toml"', "data.mapping: format simman takes no mapping file"),
        ('mapping = "m.toml"', 'data.mapping is of no use without a format; write format = "csv"'),
        ('format = "csv"', "data.mapping is missing; the format csv needs it"),
        ('format = "mcab"', "data.format: no format 'mcab'; near: mcap"),
        ('format = "nmea"', "no file *.nmea in this folder or below; is format nmea right?"),
    ],
)
def test_a_mapping_is_never_ignored(folder: Path, lines: str, words: str) -> None:
    with pytest.raises(StudyError) as caught:
        study(folder, one_set(folder, lines).replace('"logs"', '"tank"'))
    assert words in str(caught.value)


def test_an_empty_folder_is_said_to_be_empty(folder: Path) -> None:
    (folder / "nothing").mkdir()
    with pytest.raises(StudyError, match=r"data.set 2.root: \S*nothing holds no trial file \(.csv, .parquet\); set"):
        study(folder, STUDY.replace('root = "sea"', 'root = "nothing"'))


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("{ ratio = 2.0 }", r"\[-0.387, 1.161\] leaves what it can be, \[-1, 1\]; a ratio up to 1.58"),
        ("{ low = 0.1, high = 1.5 }", r"leaves what it can be, \[-1, 1\]; give low and high within it"),
    ],
)
def test_a_range_beyond_physics_is_refused(folder: Path, entry: str, words: str) -> None:
    with pytest.raises(StudyError, match=words):
        study(folder, STUDY + f'"rudder.t_R" = {entry}\n')


def test_lengths_and_angles_of_the_scaled_turn_are_the_models(folder: Path) -> None:
    scaled = study(folder, STUDY).problem.trials[1]
    policy = Turning(approach(load("kvlcc2_l7"))[1], 0.3)
    model = simulate(load("kvlcc2_l7"), policy, duration=60, dt=0.1)
    assert np.max(np.abs(scaled["psi"] - model["psi"])) < math.radians(0.01)
    assert np.max(np.abs(scaled["x"] - model["x"])) < 1e-3


@pytest.mark.parametrize(("root", "told"), [
    ("trials", "make it, or name another"), ("$SEATRIAL_DATA/trials", "set SEATRIAL_DATA to the folder"),
])  # fmt: skip
def test_the_remedy_for_a_folder_that_is_not_there(
    root: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SEATRIAL_DATA", str(tmp_path))
    path = tmp_path / "study.toml"
    path.write_text(STUDY.replace('root = "tank"', f'root = "{root}"'), encoding="utf-8")
    with pytest.raises(StudyError, match=r"root: no folder \S*trials; ") as refused:
        read_study(path)
    assert told in str(refused.value)
    assert ("SEATRIAL_DATA" in str(refused.value)) == ("$" in root)


def test_a_ship_file_is_told_from_a_study(tmp_path: Path) -> None:
    path = tmp_path / "ship.toml"
    path.write_text('schema = "seatrial-ship/1"\n', encoding="utf-8")
    told = r"is a ship file, for seatrial simulate .*, or the key ship of a study; a study begins with"
    with pytest.raises(StudyError, match=told):
        read_study(path)
