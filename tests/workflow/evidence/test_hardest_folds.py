"""Calibration by the hardest of the ways to leave trials out: its error is that of fits made anew without each part."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fitted_run import saved, trial
from seatrial.belief.bands.calibration import load
from seatrial.belief.reading import posterior
from seatrial.cli.app import main
from seatrial.data.trialfile import write_trial
from seatrial.report.blocks import document
from seatrial.simulate.replay import replay
from seatrial.study.study import read_study
from seatrial.validate.metrics import spread, standardised
from seatrial.workflow.evidence.calibrate import calibrate
from seatrial.workflow.request import RequestError

STUDY = """
schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[data]
root = "logs"
train = ["*"]
[free]
"hull.Y_v" = { prior = 0.3 }
"hull.N_r" = { prior = 0.3 }
[loss]
sigma = { psi = 0.002, u = 0.005, v_m = 0.005, r = 0.001 }
[estimator]
type = "shooting:Trajectory"
window = 30.0
every = 4
[report]
restart = 30.0
"""


def test_a_way_to_leave_out_that_is_none_is_refused(tmp_path: Path) -> None:
    model = saved(tmp_path / "run", [trial(20.0, duration=20.0)])
    ways = "recording, day, kind, kind-day, speed, wind, hardest"
    with pytest.raises(RequestError, match=f"--folds month: is none of {ways}"):
        calibrate(str(model), by="month")


@pytest.mark.long
def test_the_error_of_the_hardest_way_is_that_of_fits_without_each_part(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Turns on three days, whose rudders are logged 0, 2 and 4 deg off: a day is new to the fit of the others."""
    monkeypatch.chdir(tmp_path)
    Path("logs").mkdir()
    for k in range(6):
        one = trial(15.0 + 3.0 * (k % 2), side=1 if k % 2 else -1, seed=k, duration=60.0)
        off = np.radians(2.0 * (k // 2))
        name = f"turn_{1 + k // 2:02d}-Jul-2020_10_1{k}_00"
        write_trial(replace(one.having(delta=one["delta"] + off), name=name), Path("logs") / f"{name}.csv")
    Path("study.toml").write_text(STUDY)
    assert main(["identify", "study.toml", "-o", "run"]) == 0
    told = document(calibrate("run/model.toml", by="hardest").shown)
    errors = told["errors"]
    assert isinstance(errors, dict)
    # ranges of speed and wind: no wind was logged; each kind on each day is each day, as all are turns
    assert [*errors] == ["recording", "day", "speed"]
    assert told["folds"] == max(errors, key=lambda way: errors[way]["mean"])
    kept = load("run/model.toml", posterior("run/model.toml", weighed=False)).errors
    assert {way: one.numbers() for way, one in kept.items()} == errors, "the card quotes the hardest of these"

    study = read_study("study.toml")
    sigma = spread(study.problem.trials)
    anew: list[float] = []
    for date in ("01", "02", "03"):
        out = [t for t in study.problem.trials if f"_{date}-Jul" in t.name]
        fit = study.estimator.fit(replace(study.problem, trials=tuple(t for t in study.problem.trials if t not in out)))
        anew.append(float(np.mean([standardised(t, replay(fit.ship, t, restart=30.0), sigma, restart=30.0)
                                   for t in out])))  # fmt: skip
    assert errors["day"]["parts"] == pytest.approx(anew, rel=0.02)
    assert errors["day"]["mean"] == pytest.approx(np.mean(anew), rel=0.02)
    assert errors["day"]["spread"] == pytest.approx(np.std(anew, ddof=1), rel=0.02)
