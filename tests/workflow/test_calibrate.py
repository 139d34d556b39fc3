"""From a fit to bands of predictions by the commands, and what each refuses."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fitted_run import saved, trial
from seatrial.cli.app import main
from seatrial.data.trialfile import read_trials, write_trial

STUDY = """
schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[data]
root = "logs"
train = ["*"]
[free]
"hull.Y_v" = { prior = 0.3 }
"hull.N_r" = { prior = 0.3 }
[estimator]
type = "shooting:Trajectory"
window = 30.0
"""


def told(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    """Status, output and errors of a command."""
    status = main(arguments)
    out, err = capsys.readouterr()
    return status, out, err


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line with which a request is refused."""
    status, _, err = told(capsys, *arguments)
    assert status == 2
    return err.strip().splitlines()[-1]


@pytest.mark.slow
def test_a_model_without_a_calibration_says_which_command_makes_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = trial(20.0)
    model = str(saved(tmp_path / "run", [run]))
    write_trial(run, tmp_path / "t.csv")
    log, out = str(tmp_path / "t.csv"), str(tmp_path / "out")
    for command in (("predict", model, log, "-o", out), ("validate", model, log)):
        assert "seatrial calibrate MODEL" in refused(capsys, *command, "--bands", "95")
    to_bands = ("predict", model, log, "-o", out, "--bands")
    assert "above 0 and below 100" in refused(capsys, *to_bands, "100")
    assert "leave --smooth-start" in refused(capsys, *to_bands, "95", "--smooth-start", "2")
    assert "give one of the two" in refused(capsys, *to_bands, "95", "--history", "20", "--fit-first", "20")
    for begin in ("history 20", "fit-first 20"):
        asked = f"--{begin}".split()
        assert f"seatrial calibrate MODEL --{begin}" in refused(capsys, *to_bands, "95", *asked)
    assert "add --bands 95" in refused(capsys, "validate", model, log, "--draws", "100")
    assert "no posterior" in refused(capsys, "predict", "kvlcc2_l7", log, "-o", out, "--bands", "95")
    assert not (tmp_path / "out").exists()
    assert "not named" in refused(capsys, "calibrate", model)
    assert "two or more" in refused(capsys, "calibrate", model, "--parts", "1")


@pytest.mark.long
def test_bands_from_the_study_to_the_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("logs").mkdir()
    Path("new").mkdir()
    for k in range(22):
        angle = 10.0 + 0.5 * k
        one = trial(angle, angle if k % 2 else None, side=1 if k % 4 < 2 else -1, seed=k, duration=60.0)
        name = f"{one.name}_{k}"
        write_trial(replace(one, name=name), Path("new" if k in (5, 10) else "logs") / f"{name}.csv")
    Path("study.toml").write_text(STUDY)
    assert told(capsys, "identify", "study.toml", "-o", "run")[0] == 0
    status, out, err = told(capsys, "calibrate", "run/model.toml", "--parts", "4", "--json")
    assert status == 0, err
    found = json.loads(out)
    assert (found["trials"], found["recordings"], found["kinds"]) == (20, 20, ["turning", "zigzag"])
    assert not Path("run/left-out").exists()
    before = Path("run/model.bands.json").read_bytes()
    assert told(capsys, "calibrate", "run/model.toml", "--parts", "4")[0] == 0
    assert Path("run/model.bands.json").read_bytes() == before

    status, _, err = told(capsys, "predict", "run/model.toml", "new", "--restart", "20", "--bands", "95", "-o", "out")
    assert status == 0, err
    for measured in read_trials([Path("new")]):
        edges, predicted = (read_trials(Path(folder) / f"{measured.name}.csv")[0] for folder in ("out/bands", "out"))
        assert (edges["x_low"] < predicted["x"]).all()
        inside = (measured["x"] >= edges["x_low"]) & (measured["x"] <= edges["x_high"])
        assert inside.mean() > 0.7
    status, out, err = told(capsys, "validate", "run/model.toml", "new", "--restart", "20", "--bands", "90", "--json",
                            "-o", "report.html")  # fmt: skip
    assert status == 0, err
    held = json.loads(out)["bands"]
    assert (held["level"], held["recordings"]) == (0.9, 20)
    assert {row["kind"] for row in held["held"]} == {"turning", "zigzag", "all kinds"}
    assert np.mean([share for row in held["held"] for share in row["inside"].values()]) > 0.75
    assert "calibrated on 20 recordings" in Path("report.html").read_text()

    both = ("--history", "10", "--fit-first", "10")
    status, out, err = told(capsys, "calibrate", "run/model.toml", "--parts", "4", *both, "--json")
    assert status == 0, err
    assert {"history 10", "fit-first 10"} <= set(json.loads(out))
    assert Path("run/model.bands.json").read_bytes() == before
    for some in (both[:2], both[2:]):
        where = Path(f"out{some[0]}")
        to_new = ("run/model.toml", "new", "--bands", "95", *some)
        restart = ("--restart", "20")
        status, _, err = told(capsys, "predict", *to_new, *restart, "-o", str(where))
        assert status == 0, err
        assert "the past does not fit" not in err
        for measured in read_trials([Path("new")]):
            edges, predicted = (read_trials(folder / f"{measured.name}.csv")[0] for folder in (where / "bands", where))
            assert edges.t.tolist() == predicted.t.tolist()
            assert (edges["y_low"] < predicted["y"]).all()
        status, out, err = told(capsys, "validate", *to_new, *restart, "--json")
        assert status == 0, err
        held = json.loads(out)["bands"]
        assert np.mean([share for row in held["held"] for share in row["inside"].values()]) > 0.75

    status, _, err = told(capsys, "predict", "run/model.toml", "new", "--bands", "99", *restart, "-o", "far")
    assert (status, err.count("20 recordings show 95 % by themselves; bands of 99 % are by Student's t")) == (0, 2), err
    hard = trial(34.0, side=1, seed=50, duration=60.0)
    write_trial(hard, Path("hard.csv"))
    assert "leaves the trials of the fit" in refused(capsys, "predict", "run/model.toml", "hard.csv", "--bands", "95",
                                                     "-o", "more")  # fmt: skip
    assert not Path("more").exists()
    first = sorted(Path("logs").glob("*.csv"))[0]
    first.write_text(first.read_text().rstrip().rsplit("\n", 1)[0] + "\n")
    assert "trials are not as they were" in refused(capsys, "calibrate", "run/model.toml")
