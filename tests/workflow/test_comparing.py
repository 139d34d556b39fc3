"""By what scales and beside which ship a fit is judged, and in which currents."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from seatrial.cli.app import main


def judged(at: Path, model: str, capsys: pytest.CaptureFixture[str], *more: str) -> dict:
    capsys.readouterr()
    assert main(["validate", model, str(at / "logs"), "--json", *more]) == 0
    return json.loads(capsys.readouterr().out)


def test_two_models_are_judged_by_the_same_scales(fitted: Path, capsys) -> None:
    """Constant velocity knows no model, so its error tells by what was divided."""
    fit = str(fitted / "run" / "model.toml")
    ours, theirs = (judged(fitted, m, capsys)["standardised"]["constant velocity"] for m in (fit, "kvlcc2_l7"))
    assert ours == pytest.approx(theirs, rel=1e-9)
    scaled = [judged(fitted, m, capsys, "--scale", fit)["standardised"] for m in (fit, "kvlcc2_l7")]
    assert scaled[0]["constant velocity"] == pytest.approx(scaled[1]["constant velocity"], rel=1e-9)
    assert scaled[0]["constant velocity"] != pytest.approx(ours, rel=1e-2)
    assert main(["validate", fit, str(fitted / "logs"), "--scale", "kvlcc2"]) == 2


def test_a_fit_from_a_ship_file_is_judged_beside_that_ship(fitted: Path, capsys) -> None:
    said = judged(fitted, str(fitted / "run" / "model.toml"), capsys)["standardised"]
    assert said["fitted"] < said["untuned"]
    mine = judged(fitted, str(fitted / "mine.toml"), capsys)["standardised"]["mine"]
    assert math.isfinite(mine)


def test_the_estimated_current_acts_on_the_trials_it_was_estimated_on(fitted: Path, capsys) -> None:
    capsys.readouterr()
    fit = str(fitted / "run" / "model.toml")
    assert main(["validate", fit, str(fitted / "logs"), "--json"]) == 0
    told = capsys.readouterr()
    assert "a: a current of" in told.err
    errors = json.loads(told.out)["trials"]["a"]["fitted"]["metrics"]
    assert errors["x"]["rmse"] < 1.0  # 0.2 m/s over 60 s are 12 m
