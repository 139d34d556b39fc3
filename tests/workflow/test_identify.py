"""Workflows as a Python user calls them: values come back, nothing is printed."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data.trialfile import read_trial, write_trial
from seatrial.identify import Fit, Problem, Progress, StudyError
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.report.answer import answered
from seatrial.report.blocks import Body, Fields, Table, Verdict, plain_text
from seatrial.report.page import Page
from seatrial.report.report import Report
from seatrial.sensors import Sensors
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate
from seatrial.workflow import Outcome, RequestError, Silent, reports
from seatrial.workflow.asked import Predicting
from seatrial.workflow.identify import _useless, identify
from seatrial.workflow.validate import check, predict, validate
from two_zigzags import write_zigzags

STUDY = """schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[data]
root = "logs"
train = ["port"]
test = ["starboard"]
[free]
"hull.N_r" = { prior = 0.3 }
[loss]
sigma = { x = 9.0, y = 9.0, psi = 0.5, u = 0.1, v_m = 0.1, r = 0.1 }
[estimator]
type = "shooting:Trajectory"
window = 30.0
iterations = 3
"""


class Recording(Silent):
    """A sink that keeps what it is given."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.rows: dict[str, list[float]] = {}
        self.ended: list[str] = []

    def note(self, line: str) -> None:
        self.lines.append(line)

    def fit(self, name: str, problem: Problem, restart: float | None, *, several: bool) -> Progress:
        rows = self.rows.setdefault(name, [])
        return lambda iteration, objective, validation: rows.append(objective)

    def reporting(self, text: str) -> None:
        self.ended.append(text)


def blocks(outcome: Outcome[Any]) -> Body:
    """What is shown to people, within what JSON says in its place."""
    (said,) = outcome.shown
    assert isinstance(said, Fields)
    return said.body


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    at = tmp_path_factory.mktemp("workflow")
    write_zigzags(at / "logs")
    (at / "study.toml").write_text(STUDY)
    return at / "study.toml"


@pytest.mark.slow
def test_identify_returns_fit_document_and_summary_and_prints_nothing(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sink, out = Recording(), tmp_path / "run"
    outcome = identify(study, out, sink=sink)
    assert capsys.readouterr() == ("", "")
    fit = outcome.result["study"]
    truth = 1.2 * float(load("kvlcc2_l7").model.hull.N_r)
    assert abs(fit.values[0] - truth) < 0.1 * abs(truth)  # it starts at a sixth off
    assert outcome.document["standardised"] == json.loads((out / "report.json").read_text())["standardised"]
    (first, ended) = blocks(outcome)
    assert isinstance(first, Verdict)
    assert first == answered(outcome.document["answer"]).body[0]
    (wrote,) = plain_text((ended,))
    assert wrote.endswith(f"wrote {out}/model.toml, {out}/report.html; --details lists parameters")
    assert sink.rows["study"][-1] == fit.objective
    assert sink.ended == [fit.status]
    assert {p.name for p in out.iterdir()} == {
        "fit.json", "fit.npz", "history.csv", "model.toml", "report.html", "report.json", "run.json"}  # fmt: skip

    again = identify(study, out, sink=sink, details=True)
    assert not again.result
    (same, table, *lines) = blocks(again)
    assert same == first
    assert isinstance(table, Table)
    assert table.rows[0][0] == "hull.N_r"
    assert [*plain_text(lines)][-1].endswith(f"wrote {out}/model.toml, {out}/report.html")
    assert again.document == outcome.document
    assert any("done already" in line for line in sink.lines)

    assert main(["identify", str(study), "-o", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(outcome.document))

    (changed := study.with_name("changed.toml")).write_text(STUDY.replace("iterations = 3", "iterations = 2"))
    with pytest.raises(StudyError, match="other settings"):
        identify(changed, out)


@pytest.mark.slow
def test_validate_predict_and_check_return_values(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = study.parent / "logs"
    report = validate("kvlcc2_l7", [logs]).result
    assert report.pooled["published"] < report.pooled["constant velocity"]
    (first, second) = predict("kvlcc2_l7", [logs], tmp_path / "p", how=Predicting(20.0)).result
    assert read_trial(tmp_path / "p" / "port.csv")["psi"] == pytest.approx(first["psi"])
    assert len(second) == len(read_trial(logs / "starboard.csv"))
    found = check([logs])
    assert set(found.result) == {"port", "starboard"}
    assert found.document["counts"] == {
        s: sum(f.severity == s for some in found.result.values() for f in some) for s in ("error", "warning", "info")
    }
    assert capsys.readouterr() == ("", "")


@pytest.mark.slow
def test_a_study_s_training_trials_are_those_of_its_fit_and_not_what_it_keeps_back(study: Path) -> None:
    logs = study.parent / "logs"
    for name, shared in (("port", 1), ("starboard", 0)):
        found = check([logs / f"{name}.csv"], against=[study]).result[name]
        assert sum(one.kind == "overlap" for one in found) == shared


def test_wrong_requests_are_refused_with_nothing_written(study: Path, tmp_path: Path) -> None:
    with pytest.raises(RequestError, match="--quick"):
        identify(study, tmp_path / "run", quick=True)
    with pytest.raises(RequestError, match="html"):
        validate("kvlcc2_l7", [study.parent / "logs"], out=tmp_path / "run.json")
    with pytest.raises(RequestError, match="--against"):
        check([study.parent / "logs"], out=tmp_path / "page.html")
    (tmp_path / "file").write_text("")
    with pytest.raises(RequestError, match="is a file"):
        identify(study, tmp_path / "file")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


@dataclass(frozen=True)
class Halves:
    """Details of an estimator that brings a page of its own."""

    count: int

    def page(self, fit: Fit, provenance: Mapping[str, str]) -> Page:
        return Report(f"{self.count} halves of {fit.ship.name}", (), fit, provenance=provenance).page


@dataclass(frozen=True)
class Halving(Trajectory):
    """An estimator with details."""

    def fit(self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None) -> Fit:
        return replace(super().fit(problem, progress=progress, checkpoint=checkpoint), details=Halves(2))


@pytest.mark.slow
def test_an_estimator_brings_its_own_report(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("seatrial.study.study.find_class", lambda *_: Halving)
    outcome = identify(study, tmp_path / "run")
    assert outcome.result["study"].details == Halves(2)
    assert "2 halves of kvlcc2_l7" in (tmp_path / "run" / "report.html").read_text()


def test_what_speaks_against_a_fit_is_one_short_line_each() -> None:
    lines = ["the model does not explain the data: sigma and verdicts hold only if the model were right",
             "suspect: an offset of delta of 2 +- .1 deg would remove 80% of the objective; hull.N_r would move",
             "x: residuals are 3 times the sensor noise (0.5)"]  # fmt: skip
    found = {
        "schema": "seatrial-fit/1", "verdicts": [], "forecasts": [], "status": "converged", "seconds": 1.0,
        "standardised": {"fitted": 2.0, "untuned": 1.0},
        "diagnosis": {"explained": False, "lines": lines, "cause": lines[1].removeprefix("suspect: ")},
        "parameters": {"hull.N_r": {"start": 1.0, "value": 2.0, "sigma": 0.1, "shrinkage": 1.0, "at_bound": False}},
    }  # fmt: skip
    worse = {**found, "worse_than_untuned": {"fitted": 2.0, "untuned": 1.0}}
    first = "not explained: an offset of delta of 2 +- .1 deg would remove 80% of the objective; see run/report.html"
    assert reports.leads(found, Path("run"), True) == (first,)
    (same, second) = reports.leads(worse, Path("run"), True)
    assert same == first
    assert second == "worse than untuned: standardised error 2 against 1 before the fit, on trials kept back"
    table, *details = reports._fit(found, Path("run"), "trials kept back")
    assert isinstance(table, Table)
    assert [*plain_text(details)][:3] == lines
    assert reports.leads({**found, "diagnosis": {"explained": True, "lines": []}}, Path("run"), True) == ()
    assert reports.leads({**found, "diagnosis": None}, Path("run"), True) == ()
    (many,) = reports.leads({"schema": "seatrial-networks/1", "not_explained": list("abcd")}, Path("run"), True)
    assert many == "not explained: the data of 4 fits (a, b, c, ...); see fit.json of each in run/fits"


@pytest.mark.parametrize(("errors", "useless"), [
    ({"fitted": 0.3, "untuned": 1.0}, False), ({"untuned": 1.0, "constant velocity": 2.0}, True),
    ({"fitted": math.inf, "constant velocity": 2.0}, True), ({"fitted": None, "constant velocity": 2.0}, True),
    ({}, False)])  # fmt: skip
def test_a_model_without_an_error_of_its_own_in_any_trial_is_useless(
    errors: dict[str, float | None], useless: bool
) -> None:  # fmt: skip
    """Where each prediction of the fitted model failed, the errors are those of the others alone."""
    assert bool(_useless({"standardised": errors})) == useless


@pytest.mark.slow
def test_a_fit_that_blows_up_in_every_trial_exits_with_1(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:  # fmt: skip
    """Yaw gains energy: predictions of a second can be fitted, and those of the whole trial blow up."""
    shutil.copytree(study.parent / "logs", tmp_path / "logs")
    text = STUDY.replace('"hull.N_r" = { prior = 0.3 }', '"hull.N_r" = { low = 0.4, high = 0.6, start = 0.5 }')
    (tmp_path / "study.toml").write_text(text.replace("window = 30.0", "window = 1.0"))
    assert main(["identify", str(tmp_path / "study.toml"), "-o", str(tmp_path / "run")]) == 1
    assert "the fitted model blows up in every trial" in capsys.readouterr().err


@pytest.mark.long
def test_a_fit_that_does_not_explain_the_data_says_so_first(study: Path, tmp_path: Path, capsys) -> None:
    """The rudder indicator is 2 deg off: the first screen has it, then the table and the details; it can be freed."""
    at = tmp_path / "study"
    (at / "logs").mkdir(parents=True)
    rng = np.random.default_rng(0)
    for name in ("port", "starboard"):
        run = read_trial(study.parent / "logs" / f"{name}.csv")
        read = Sensors({"x": 0.01, "y": 0.01, "psi": 0.002, "u": 0.005, "v_m": 0.005, "r": 0.0005}).read(run, rng)
        write_trial(read.having(delta=run["delta"] + math.radians(2.0)), at / "logs" / f"{name}.csv")
    (at / "study.toml").write_text(STUDY.partition("[loss]")[0] + "[estimator]" + STUDY.partition("[estimator]")[2])
    plain, freed = (identify(at / "study.toml", tmp_path / name, free_suspects=name == "freed", details=True)
                    for name in ("plain", "freed"))  # fmt: skip
    assert plain.leads[0].startswith("not explained: an offset of delta of 2")
    assert plain.leads[0].endswith(f"see {tmp_path}/plain/report.html")
    assert len(plain.leads[0].partition("; see")[0]) < 120
    shown = blocks(plain)
    assert isinstance(shown[0], Verdict)
    said = dict(shown[0].grounds)
    assert said["Cause of what is left"].startswith("an offset of delta of 2")
    assert {"Error after 10 s", "Next", "Use", "Parameters"} <= said.keys()
    table = next(k for k, block in enumerate(shown) if isinstance(block, Table))
    details = [*plain_text(shown[table + 1 :])]
    assert any(line.startswith("suspect: an offset of delta") for line in details)
    found = freed.result["study"].nuisances["*"]["offset.delta"]
    assert found == pytest.approx(math.radians(2.0), abs=math.radians(0.1))
    assert not any(line.startswith("not explained") for line in freed.leads)
    assert "--free-suspects" in json.loads((tmp_path / "freed" / "report.json").read_text())["provenance"]["command"]
    changes = json.loads((tmp_path / "freed" / "report.json").read_text())["changes"]
    assert "compared as corrected by an offset of delta" in changes[0]

    assert main(["identify", str(at / "study.toml"), "-o", str(tmp_path / "freed")]) == 2, "settings differ"
    capsys.readouterr()
    assert main(["identify", str(at / "study.toml"), "-o", str(tmp_path / "plain")]) == 0
    brief = capsys.readouterr().out.splitlines()
    assert len(brief) <= 12
    assert any(line.startswith("Cause of what is left: an offset of delta of 2") for line in brief)


@pytest.mark.long
def test_a_fit_that_predicts_worse_than_its_start_says_so(study: Path, tmp_path: Path) -> None:
    """It was trained on a ship with twice the yaw damping, and is judged on one as published."""
    at = tmp_path / "study"
    (at / "logs").mkdir(parents=True)
    ship = load("kvlcc2_l7")
    other = ship.having({"hull.N_r": 2.0 * float(ship.model.hull.N_r)})
    for name, side, sailed in (("port", -1.0, other), ("starboard", 1.0, ship)):
        run = simulate(sailed, Zigzag(approach(ship)[1], 0.35, 0.35, side), duration=60.0, dt=0.1, every=5, name=name)
        write_trial(run, at / "logs" / f"{name}.csv")
    (at / "study.toml").write_text(STUDY)
    outcome = identify(at / "study.toml", tmp_path / "run")
    line = next(one for one in outcome.leads if one.startswith("worse than untuned"))
    (first, *_) = blocks(outcome)
    assert isinstance(first, Verdict)
    assert first.answer == "No"
    assert "predicts these trials better" in first.why
    assert line.endswith("before the fit, on trials kept back")
    assert outcome.document["worse_than_untuned"]["fitted"] > outcome.document["worse_than_untuned"]["untuned"]
    written = json.loads((tmp_path / "run" / "report.json").read_text())
    assert written["worse_than_untuned"] == outcome.document["worse_than_untuned"]
    assert "worse than untuned" in (tmp_path / "run" / "report.html").read_text()
