"""What a study cannot mean is refused before anything is fitted, with the file and the key."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data.trialfile import write_trial
from seatrial.identify import StudyError
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate
from seatrial.study.study import read_study

STUDY = """
schema = "seatrial-study/1"
ship = "qiuxin5"
[data]
train = ["log"]
[free]
"damping.X_uu" = { prior = 0.3 }
[loss]
sigma = { u = 0.01, v_m = 0.01, r = 0.0035 }
[estimator]
type = "logo:Shooting"
"""
ROOT = Path(__file__).parents[2]


@pytest.fixture
def study(tmp_path: Path) -> Callable[..., Path]:
    """A study of one zigzag of the tug; arguments: text to replace and what by."""
    ship = load("qiuxin5")
    run = simulate(ship, Zigzag(approach(ship)[1], 0.35, 0.35), speed=ship.speed, duration=40.0, dt=0.2, name="log")
    write_trial(run, tmp_path / "log.csv")

    def make(*change: str) -> Path:
        path = tmp_path / "study.toml"
        path.write_text(STUDY.replace(*change) if change else STUDY)  # type: ignore[arg-type]
        return path

    return make


@pytest.mark.parametrize(("setting", "words"), [
    ("threads = -3", "estimator.threads is -3; it must be 1 or more"),
    ("threads = 0", "estimator.threads is 0; it must be 1 or more"),
    ("every = 1000", "estimator.every is 1000, which leaves a row each 200 s of log"),
    ("dt = 30.0", "estimator.dt is 30, which leaves a row each 30 s"),
    ("tolerance = inf", "estimator.tolerance is inf; it must be a finite number"),
    ('weights = { log = "x" }', "estimator.weights.log is 'x'; it must be a number above zero"),
    ("iterations = 2.5", "estimator.iterations is 2.5; it must be a whole number"),
])  # fmt: skip
def test_settings(study: Callable[..., Path], setting: str, words: str) -> None:
    path = study('"logo:Shooting"\n', f'"logo:Shooting"\n{setting}\n')
    with pytest.raises(StudyError) as caught:
        read_study(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert words in str(caught.value)


def test_a_sigma_that_is_none_names_file_and_key(study: Callable[..., Path]) -> None:
    path = study("u = 0.01", "u = nan")
    with pytest.raises(StudyError, match=r"study\.toml: .*loss\.sigma\.u is nan"):
        read_study(path)


@pytest.mark.slow
def test_what_an_estimator_refuses_names_the_file(
    study: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = study("[estimator]", "[nuisance]\ninitial = { u = 0.1 }\n[estimator]")
    assert main(["identify", str(path), "-o", str(tmp_path / "run")]) == 2
    said = capsys.readouterr().err
    assert f"error: {path}: [nuisance] initial is not for logo:Shooting" in said
    assert not (tmp_path / "run").exists()


def test_an_empty_channel_is_refused_and_nothing_is_left(
    study: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from seatrial.data.trialfile import read_trial

    path = study()
    log = read_trial(tmp_path / "log.csv")
    write_trial(log.having(alpha_1=np.full(len(log), np.nan)), tmp_path / "log.csv")
    assert main(["identify", str(path), "-o", str(tmp_path / "run")]) == 2
    assert "log: channel alpha_1 has no values" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_a_trial_with_a_long_leap_of_time_is_taken_as_two(study: Callable[..., Path], tmp_path: Path) -> None:
    from seatrial.data.trialfile import read_trial

    path = study()
    log = read_trial(tmp_path / "log.csv")
    write_trial(log.rows((log.t < 12.0) | (log.t > 25.0)), tmp_path / "log.csv")
    found = read_study(path)
    assert [trial.name for trial in found.problem.trials] == ["log_1", "log_2"]
    assert any("taken as 2 trials" in line for line in found.notes)


def test_a_trial_kept_back_with_a_leap_is_taken_as_two_as_well(study: Callable[..., Path], tmp_path: Path) -> None:
    from dataclasses import replace

    from seatrial.data.trialfile import read_trial

    path = study('train = ["log"]', 'train = ["log"]\ntest = ["other"]')
    log = read_trial(tmp_path / "log.csv")
    torn = log.rows((log.t < 12.0) | (log.t > 25.0))
    write_trial(replace(torn, name="other"), tmp_path / "other.csv")
    found = read_study(path)
    assert [trial.name for trial in found.problem.trials] == ["log"]
    assert [trial.name for trial in found.test] == ["other_1", "other_2"]
    assert any(line.startswith("warning: other leaps over 10 steps") for line in found.notes)


def test_what_is_said_to_be_unidentified_must_be_a_number_of_the_ship(study: Callable[..., Path]) -> None:
    path = study("[estimator]", '[report.unidentified]\n"damping.X_u" = "calm"\n[estimator]')
    assert read_study(path).unidentified == {"damping.X_u": "calm"}
    path = study("[estimator]", '[report.unidentified]\n"damping.X_q" = "calm"\n[estimator]')
    with pytest.raises(StudyError, match=r"study\.toml: report\.unidentified: .*damping\.X_q"):
        read_study(path)


@pytest.mark.parametrize(("thrown", "words"), [
    (KeyboardInterrupt(), "interrupted; run the same command again\n"),
    (StudyError("initial is 'x'"), "you2023.toml: initial is 'x'"),
])  # fmt: skip
@pytest.mark.long
def test_a_study_with_a_rival_says_how_it_goes_on_and_whose_file_it_is(
    thrown: BaseException, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    path = ROOT / "studies" / "you2023.toml"
    assert read_study(path).rival

    def fit(*_: object, **__: object) -> None:
        raise thrown

    monkeypatch.setattr(type(read_study(path).estimator), "fit", fit)
    assert main(["identify", str(path), "-o", str(tmp_path / "run")]) == (130 if "interrupted" in words else 2)
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(("old", "new", "words"), [
    ("[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]", "[0.0, 5.0]", "1 levels ahead"),
    ("revolutions = 10.0, rudder = 0.0", "revolutions = 30.0, rudder = 0.0", "was tested from 0 to 10 1/s"),
    ("full = { u = 2.33", "full = { uu = 2.33", "report.published.full.uu"),
])  # fmt: skip
def test_virtual_trials(tmp_path: Path, old: str, new: str, words: str) -> None:
    text = (ROOT / "studies" / "you2023.toml").read_text(encoding="utf-8")
    assert old in text
    ship = '"qiuxin5_first_guess.toml"'
    path = tmp_path / "you.toml"
    path.write_text(text.replace(ship, '"qiuxin5"').replace(old, new))
    assert tomllib.loads(path.read_text())
    with pytest.raises(StudyError) as caught:
        read_study(path)
    assert words in str(caught.value)


@pytest.mark.slow
def test_an_interrupt_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], study: Callable[..., Path], tmp_path: Path
) -> None:
    from seatrial.identify.shooting.logo import Shooting

    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Shooting, "fit", stop)
    assert main(["identify", str(study()), "-o", str(tmp_path / "run")]) == 130
    said = capsys.readouterr().err
    (line,) = (line for line in said.splitlines() if "interrupted" in line)
    assert "run the same command again" in line


def test_an_interrupt_while_it_loads_is_no_traceback() -> None:
    code = ("import sys; from seatrial.__main__ import main\n"
            "class Stop:\n    def find_spec(self, name, *_):\n        if name == 'seatrial.cli.app':\n"
            "            raise KeyboardInterrupt\n"
            "sys.meta_path.insert(0, Stop()); sys.exit(main())")  # fmt: skip
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "interrupted\n")


def test_a_study_lays_its_actuators_over_those_of_the_ship(study: Callable[..., Path]) -> None:
    """In its units, key by key; what it does not name stays as the file has it, and another value is another run."""
    servo, key = load("qiuxin5").actuators, next(iter(load("qiuxin5").actuators.by_name))
    table = f'[actuators.{key}]\nlag = {{ value = 2.5, unit = "s", source = "logs" }}\n[data]'
    found = read_study(study("[data]", table))
    assert found.problem.ship.actuators.by_name[key].lag == pytest.approx(2.5)
    assert found.problem.ship.actuators.by_name[key].rate == servo.by_name[key].rate
    assert found.digest != read_study(study()).digest
    assert read_study(study()).problem.ship.actuators == servo


@pytest.mark.parametrize(("line", "words"), [
    ('rate = { value = 2.0, unit = "kg", source = "logs" }', "kg"),
    ("rate = { value = 2.0 }", "no source"),
    ("pace = 2.0", "pace"),
])  # fmt: skip
def test_actuators_that_a_ship_file_could_not_have_are_refused(
    study: Callable[..., Path], line: str, words: str
) -> None:
    key = next(iter(load("qiuxin5").actuators.by_name))
    path = study("[data]", f"[actuators.{key}]\n{line}\n[data]")
    with pytest.raises(StudyError, match=words) as told:
        read_study(path)
    assert str(told.value).startswith(f"{path}: actuators.{key}")
    assert "\n" not in str(told.value)
