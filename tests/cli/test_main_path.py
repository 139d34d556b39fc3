"""The main path from end to end: the demo, and a study from its log to a report, a model and a prediction."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from seatrial.cli.app import main
from seatrial.data.trialfile import read_trial, write_trial
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load, save
from seatrial.simulate.approach import approach
from seatrial.simulate.run import simulate

WRITTEN = {"report.html", "model.toml", "fit.json", "history.csv"}
N_R = "hull.N_r"
STUDY = f"""
schema = "seatrial-study/1"
ship = "mine.toml"
[data]
root = "logs"
train = ["fit*.csv"]
test = ["unseen.csv"]
[free]
"{N_R}" = {{ prior = 0.5 }}
[estimator]
type = "shooting:Trajectory"
window = 30.0
iterations = 8
"""


def said(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict:
    """The JSON object of a command that succeeds."""
    capsys.readouterr()
    assert main([*arguments, "--json"]) == 0, capsys.readouterr().err
    return json.loads(capsys.readouterr().out)


def whole(page: Path) -> str:
    """A page that is complete and loads nothing from elsewhere."""
    html = page.read_text(encoding="utf-8")
    assert html.startswith("<!DOCTYPE html>")
    assert html.rstrip().endswith("</html>")
    assert html.count("<svg") == html.count("</svg>") > 0
    assert not re.search(r"https?://|<script|<link|<img", html)
    return html


def test_the_demo_finds_the_ship_and_writes_its_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "demo"
    found = said(capsys, "demo", "-o", str(out))
    assert found["within_3_sigma"] == found["parameters"] == 12
    errors = found["standardised"]
    assert errors["fitted"] < 0.2 * errors["published"] < errors["constant velocity"]
    assert {path.name for path in out.iterdir()} >= WRITTEN | {"report.json"}
    assert "kvlcc2_l7" in whole(out / "report.html")
    assert load(out / "model.toml").name == load("kvlcc2_l7").name


def test_a_study_becomes_a_report_a_model_and_predictions(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The ship at sea is KVLCC2; its file is wrong by 30 % in one number, which the fit has to put right."""
    truth = load("kvlcc2_l7")
    n_P, logs, run = approach(truth)[1], tmp_path / "logs", tmp_path / "run"
    logs.mkdir()
    for name, angle, side in (("fit_1", 0.35, 1.0), ("fit_2", 0.35, -1.0), ("unseen", 0.2, 1.0)):
        write_trial(
            simulate(truth, Zigzag(n_P, angle, angle, side), duration=60.0, dt=0.1, every=5, name=name),
            logs / f"{name}.csv",
        )
    wrong = truth.having({N_R: 1.3 * float(truth.model.hull.N_r)})  # type: ignore[attr-defined]
    save(wrong, tmp_path / "mine.toml")
    (tmp_path / "study.toml").write_text(STUDY)

    fitted = said(capsys, "identify", str(tmp_path / "study.toml"), "-o", str(run))
    assert {path.name for path in run.iterdir()} >= WRITTEN
    assert N_R in fitted["parameters"]
    assert N_R in whole(run / "report.html")
    model = load(run / "model.toml")
    assert float(model.model.hull.N_r) == pytest.approx(float(truth.model.hull.N_r), rel=0.02)  # type: ignore[attr-defined]

    page = tmp_path / "page" / "report.html"
    found = said(capsys, "validate", str(run / "model.toml"), str(logs / "unseen.csv"), "-o", str(page))
    errors = found["standardised"]
    assert errors["fitted"] < 0.1 * errors["untuned"]
    whole(page)

    assert main(["predict", str(run / "model.toml"), str(logs / "unseen.csv"), "-o", str(tmp_path / "predicted")]) == 0
    predicted, measured = read_trial(tmp_path / "predicted" / "unseen.csv"), read_trial(logs / "unseen.csv")
    assert predicted.t == pytest.approx(measured.t)
    assert predicted["psi"] == pytest.approx(measured["psi"], abs=0.01)

    again = said(capsys, "identify", str(tmp_path / "study.toml"), "-o", str(run))
    assert again["parameters"] == fitted["parameters"], "a finished run is read, not repeated"
