"""Bands of manoeuvres by the calibration beside a model: which kind they are, and that they are as wide as it says."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from calibrated_run import UNIT, H, calibrated
from fitted_run import saved, trial
from seatrial.cli.app import main
from seatrial.identify import StudyError
from seatrial.workflow import RequestError
from seatrial.workflow.asked import Approach, Bands, Orders, Span
from seatrial.workflow.evidence.bands import simulate_with_bands


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return saved(tmp_path / "run", [trial(35), trial(20, 20)])


@pytest.mark.slow
def test_edges_of_a_turn_are_the_calibrated_ones_and_so_are_its_indices(run: Path) -> None:
    calibrated(run)
    found = simulate_with_bands(str(run), "turning", Bands(90.0, 300), orders=Orders(35.0))
    made = found.sailed
    assert (made.basis.kind, made.basis.recordings) == ("calibrated", 24)
    assert "calibrated on 24 left-out recordings" in made.caveats[0]
    low, high = made.bands.band("x", 0.9)
    at = int(np.argmin(np.abs(made.bands.t - 60.0)))
    # errors are normal with a deviation that the calibration knows
    assert 0.5 * (high - low)[at] == pytest.approx(1.645 * UNIT[0] * H[2] / 50.0, rel=0.25)
    value, low_d, high_d = (one.value for one in found.indices["tactical_diameter"])
    assert low_d < value < high_d
    wide = simulate_with_bands(str(_sized(run, 3.0)), "turning", Bands(90.0, 300), orders=Orders(35.0))
    wider = [b[2].value - b[1].value for b in (found.indices["advance"], wide.indices["advance"])]
    assert wider[1] == pytest.approx(3.0 * wider[0], rel=0.1)


def _sized(run: Path, size: float) -> Path:
    calibrated(run, size=size)
    return run


@pytest.mark.slow
def test_a_zigzag_has_its_indices_apart_by_the_mean_factor(run: Path) -> None:
    widths: list[float] = []
    scales: list[float] = []
    for size in (1.0, 2.0):
        found = simulate_with_bands(str(_sized(run, size)), "zigzag", Bands(90.0, 300),
                                    orders=Orders(20.0, heading=20.0))  # fmt: skip
        _, low, high = (one.value for one in found.indices["first_overshoot"])
        widths.append(high - low)
        (said,) = (line for line in found.sailed.caveats if "times as far apart" in line)
        scales.append(float(said.split("indices are ")[1].split()[0]))
    assert scales[1] == pytest.approx(2.0 * scales[0], rel=0.02)
    assert widths[1] == pytest.approx(2.0 * widths[0], rel=0.02)


@pytest.mark.slow
def test_kinds_and_times_that_no_left_out_trial_shows_are_named(run: Path) -> None:
    calibrated(run, kinds=("zigzag",))
    found = simulate_with_bands(str(run), "turning", Bands(90.0, 300), orders=Orders(35.0), span=Span(400.0))
    assert any("no left-out trial is of this kind (turning)" in line for line in found.sailed.caveats)
    assert any(line.startswith("calibrated up to 150 s") for line in found.sailed.caveats)


@pytest.mark.slow
def test_beyond_its_trials_a_calibrated_ship_is_refused_or_says_so(run: Path) -> None:
    calibrated(run)
    with pytest.raises(RequestError, match="leaves the trials of the fit"):
        simulate_with_bands(str(run), "turning", Bands(90.0, 300), orders=Orders(35.0), begin=Approach(0.5))
    found = simulate_with_bands(str(run), "turning", Bands(90.0, 300, True), orders=Orders(35.0),
                                begin=Approach(0.5))  # fmt: skip
    assert any("no left-out trial has tested the bands there" in line for line in found.sailed.caveats)


@pytest.mark.slow
def test_a_calibration_of_another_fit_is_refused_and_a_level_it_does_not_show_is_said(run: Path) -> None:
    path = calibrated(run)
    found = simulate_with_bands(str(run), "turning", Bands(99.0, 2000))
    assert any(line.startswith("24 recordings show 96 % by themselves; bands of 99 %") for line in found.sailed.caveats)
    path.write_text(json.dumps({**json.loads(path.read_text()), "fit": "of-another"}))
    with pytest.raises(StudyError, match="seatrial calibrate MODEL"):
        simulate_with_bands(str(run), "turning", Bands(90.0))


@pytest.mark.slow
def test_json_and_page_say_what_bands_stand_on(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:  # fmt: skip
    calibrated(run)
    out = tmp_path / "turn.csv"
    assert main(["simulate", str(run), "turning", "--bands", "90", "--draws", "300", "-o", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["basis"]["recordings"] == 24
    assert json.loads(out.with_suffix(".bands.json").read_text())["basis"]["kind"] == "calibrated"
    assert "These bands are calibrated on 24 left-out recordings" in out.with_suffix(".bands.html").read_text()
