"""What a fine-tuning is refused for, or warned of, on the command line: one line, and nothing left behind."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data import Trial
from seatrial.data.prepare import froude_scaled
from seatrial.data.trialfile import read_trial, write_trial
from seatrial.manoeuvres.turning import Turning
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

WRONG = 2
TURNS = {"a": 10.0, "b": -20.0, "c": 35.0, "d": -30.0}
STUDY = """schema = "seatrial-study/1"
ship = "suzaku"
[data]
root = "trials"
train = ["a", "b"]
test = ["c"]
[free]
"propeller.w_P0" = { ratio = 0.3 }
"rudder.epsilon" = { ratio = 0.3 }
[loss]
sigma = { x = 8.0, y = 8.0, psi = 0.1 }
[estimator]
type = "fine_tuning:FineTuning"
ratios = [0.2]
population = 4
largest = 4
agree = 1
starts = 1
fold_starts = 1
"""
EVOLUTION = """type = "evolution:Evolution"
population = 6
runs = 1
agree = 1
generations = 60
step = 0.01
"""
LIST, TUNING = STUDY[: STUDY.index("[estimator]")], STUDY[STUDY.index("type = ") :]


@pytest.fixture(scope="module")
def turns() -> dict[str, Trial]:
    ship = load("suzaku_tuned_05")
    made: dict[str, Trial] = {}
    for name, rudder in TURNS.items():
        policy = Turning(approach(ship)[1], math.radians(rudder))
        run = simulate(ship, policy, duration=60.0, dt=0.1, every=10, name=name)
        made[name] = replace(run, meta={"ship": "suzaku", "L_pp": 83.0, "kind": "turning"})
    return made


@pytest.fixture
def study(turns: dict[str, Trial], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "trials").mkdir()
    for name, trial in turns.items():
        write_trial(trial, tmp_path / "trials" / f"{name}.csv")
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    return path


def changed(study: Path, *pairs: tuple[str, str]) -> None:
    """Replace texts in the study, each of which must be there."""
    text = study.read_text()
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    study.write_text(text)


def rewritten(name: str, change) -> None:
    """Change the trial of this name on disk."""
    path = Path("trials") / f"{name}.csv"
    trial = read_trial(path)
    path.unlink()
    path.with_suffix(".yaml").unlink()
    write_trial(change(trial), path)


def refused(capsys) -> str:
    """The one line of a study that is refused; nothing is printed and no folder made."""
    assert main(["identify", "study.toml", "-o", "out"]) == WRONG
    said = capsys.readouterr()
    assert said.out == ""
    assert not Path("out").exists(), list(Path("out").iterdir())
    assert said.err.count("\n") == 1, said.err
    return said.err


def warned(capsys) -> str:
    """What a study that runs is warned of."""
    assert main(["identify", "study.toml", "-o", "out"]) == 0
    assert (Path("out") / "report.html").exists()
    return capsys.readouterr().err


REFUSED = {
    # at 20 deg of rudder the flap is far from its limit
    "unfelt": (("rudder.epsilon", "rudder.delta_f_max"), ("rudder.delta_f_max", "insensitive")),
    "beyond physics": (('"propeller.w_P0" = { ratio = 0.3 }', '"hull.R_0" = { ratio = 1.5 }'), ("hull.R_0", "[0, 1]")),
    "beyond physics, absolute": (
        ('"propeller.w_P0" = { ratio = 0.3 }', '"hull.R_0" = { low = -0.1, high = 0.1 }'), ("hull.R_0", "[0, 1]")
    ),
    "unknown parameter": (("rudder.epsilon", "rudder.epsilom"), ("near: rudder.epsilon",)),
    "unknown setting": (("largest = 4", "lagest = 4"), ("near: largest",)),
    "no range to try": (("ratios = [0.2]", "ratios = []"), ("estimator.ratios",)),
    "falling ratios": (("ratios = [0.2]", "ratios = [0.3, 0.2]"), ("must rise",)),
    "wider than declared": (("ratios = [0.2]", "ratios = [0.3, 0.5]"), ("0.5", "declares no wider")),
    "one trial": (('["a", "b"]', '["a"]'), ("give two or more",)),
    "no trials": (('["a", "b"]', "[]"), ("data.train is missing",)),
    "nuisances": (("[loss]", "[nuisance]\ncurrent = 0.3\n[loss]"), ("takes no [nuisance]",)),
    "another ship": (('ship = "suzaku"', 'ship = "esso_osaka_3m"'), ("is of a ship of 83 m", "scale_to")),
    "no file": (('test = ["c"]', 'test = ["e"]'), ("'e' fits no file",)),
    "no interval": (
        ('"rudder.epsilon" = { ratio = 0.3 }', '"rudder.epsilon" = { low = 0.5, high = inf }'), ("must be a number",)
    ),
    "two lists": (('test = ["c"]', 'test = ["b"]'), ("data.train: b.csv is in test too",)),
    "two sets": (
        ('root = "trials"\ntrain = ["a", "b"]\ntest = ["c"]',
         '[[data.set]]\nroot = "trials"\ntrain = ["a", "b"]\n[[data.set]]\nroot = "trials"\ntest = ["b"]'),
        ("b", "is in training and in test"),
    ),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("case", REFUSED)
def test_refused_in_one_line(case: str, study: Path, capsys) -> None:
    change, words = REFUSED[case]
    changed(study, change)
    said = refused(capsys)
    for word in words:
        assert word in said


@pytest.mark.long
def test_a_study_that_was_refused_can_be_put_right_and_run_in_the_same_folder(study: Path, capsys) -> None:
    changed(study, ('["a", "b"]', '["a"]'))
    refused(capsys)
    changed(study, ('["a"]', '["a", "b"]'))
    warned(capsys)


@pytest.mark.long
def test_another_scale_needs_the_step_that_says_so(study: Path, capsys) -> None:
    for name in TURNS:
        rewritten(name, lambda t: replace(froude_scaled(t, 1.0 / 20.0), meta={**t.meta, "L_pp": 4.15}))
    said = refused(capsys)
    assert "a is of a ship of 4.15 m" in said.replace(":", "")
    assert 'scale_to = "ship"' in said
    changed(study, ('root = "trials"', 'root = "trials"\nscale_to = "ship"'))
    assert "of a ship of" not in warned(capsys)


def test_a_set_without_a_length_cannot_be_scaled(study: Path, capsys) -> None:
    for name in TURNS:
        rewritten(name, lambda t: replace(t, meta={}))
    changed(study, ('root = "trials"', 'root = "trials"\nscale_to = "ship"'))
    assert "give L_pp in its sidecar" in refused(capsys)


@pytest.mark.long
def test_another_ship_of_the_same_length_is_warned_of(study: Path, capsys) -> None:
    rewritten("a", lambda t: replace(t, meta={**t.meta, "ship": "hayabusa"}))
    assert "a: is of ship 'hayabusa', the study is of 'suzaku'" in warned(capsys)


def test_a_recording_under_two_names_is_refused(study: Path, turns, capsys) -> None:
    write_trial(replace(turns["b"], name="copy"), Path("trials") / "copy.csv")
    changed(study, ('test = ["c"]', 'test = ["copy"]'))
    assert "training and test share a recording" in refused(capsys)


@pytest.mark.slow
def test_a_part_of_a_recording_is_refused_too(study: Path, turns, capsys) -> None:
    write_trial(replace(turns["b"].rows(slice(20, 60)), name="part"), Path("trials") / "part.csv")
    changed(study, ('test = ["c"]', 'test = ["part"]'))
    assert "training and test share a recording" in refused(capsys)


@pytest.mark.long
def test_few_samples_are_warned_of(study: Path, capsys) -> None:
    def nearly_empty(trial: Trial) -> Trial:
        hole = np.where(np.arange(len(trial)) % 10 == 0, trial["psi"], np.nan)
        return trial.having(psi=hole)

    for name in ("a", "b"):
        rewritten(name, nearly_empty)
    settings = '[estimator]\ntype = "shooting:Trajectory"\nwindow = 60.0\nevery = 1\niterations = 2\n'
    study.write_text(LIST.replace('"propeller.w_P0" = { ratio', '"hull.*" = { prior') + settings)
    assert "complete samples for" in warned(capsys)


@pytest.mark.long
@pytest.mark.filterwarnings("default:every candidate")
def test_a_generation_that_fails_is_named_and_the_search_goes_on(study: Path, capsys) -> None:
    wild = '"hull.N_r" = { low = -0.1, high = 2000.0 }'
    changed(study, ('"propeller.w_P0" = { ratio = 0.3 }', wild), (TUNING, EVOLUTION))
    said = warned(capsys)
    assert said.count("every candidate of a generation fails (trial a") >= 1
    assert "at t = " in said


VIRTUAL = """
[virtual]
ship = "suzaku_tuned_05"
seed = 1
duration = 60.0
[virtual.trials]
"a" = { type = "turning:Turning", rudder = 10.0 }
"b" = { type = "turning:Turning", rudder = -20.0 }
"""


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('test = ["c"]', 'test = ["b"]'), "b is in two of train, validation and test"),
        (('test = ["c"]', 'test = ["e"]'), "'e' fits no file"),
        (("rudder = 10.0", "rudder = 50.0"), "goes to 40 deg"),
        (("seed = 1\n", ""), "virtual.seed is missing"),
        (("duration = 60.0", "duration = 0.0"), "virtual.duration is 0 s"),
    ],
)
def test_virtual_trials_are_refused_alike(change, words: str, study: Path, capsys) -> None:
    study.write_text(STUDY.replace('root = "trials"\n', "") + VIRTUAL)
    changed(study, change)
    if 'test = ["c"]' in study.read_text():
        changed(study, ('test = ["c"]', "test = []"))
    assert words in refused(capsys)


SEARCHERS = {
    "evolution:Evolution": ("nuisance", "takes no [nuisance]"),
    "regression:Regression": ("", "not linear in propeller.w_P0, rudder.epsilon"),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", SEARCHERS)
def test_other_estimators_refuse_in_one_line_too(kind: str, study: Path, capsys) -> None:
    table, words = SEARCHERS[kind]
    changed(study, (TUNING, f'type = "{kind}"\n'))
    if table:
        changed(study, ("[loss]", "[nuisance]\ncurrent = 0.3\n[loss]"))
    assert words in refused(capsys)


@pytest.mark.long
def test_the_papers_loss_brings_no_advice_that_would_be_refused(study: Path, capsys) -> None:
    changed(study, ("[loss]", "[loss]\ncorrelation = 0.0"))
    assert "nuisance" not in warned(capsys)
