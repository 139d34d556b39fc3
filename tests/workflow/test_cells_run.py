"""A run of cells: by what its fits are judged, what ends it, when its report is made anew, and what it has found."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fitted_run import covariance, saved, truth
from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.identify import Fit, FitError, Loss, Problem, Progress, StudyError, Verdict
from seatrial.models import STATES
from seatrial.study.cells import Cell
from seatrial.study.schema import Published
from seatrial.study.series import Row, Series
from seatrial.study.store import read_summary, write_summary
from seatrial.study.study import Study
from seatrial.workflow import Silent, identify, reports

T = np.arange(0.0, 20.0)


def rising(name: str, slope: float) -> Trial:
    """Every state rises at its own slope, so that its spread is that slope times that of the times."""
    return Trial(name, T, {state: slope * (k + 1) * T for k, state in enumerate((*STATES, "n_P", "delta"))})


TRAIN, WATCHED, TEST = (rising(name, slope) for name, slope in (("train", 1.0), ("watched", 2.0), ("test", 3.0)))


@dataclass(frozen=True)
class Ends:
    """An estimator that finds what it began with, or fails by an error."""

    error: Exception | None = None
    several: bool = False

    def fit(self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None) -> Fit:
        if self.error is not None:
            raise self.error
        C = covariance(0.01)[:1, :1]
        return Fit(problem.ship, problem.free, np.array([problem.free[0].start]), np.sqrt(np.diag(C)), C, np.ones(1),
                   (), (Verdict("hull.N_r", "identified", ""),), np.zeros((0, 4)), 1.0, 0.1, 1, "done",
                   "digest")  # fmt: skip


def problem(*validation: Trial) -> Problem:
    return Problem(truth(), (TRAIN,), (Free("hull.N_r", -0.05),), validation=validation)


def study(path: Path, who: Any = Ends(), **more: Any) -> Study:
    path.write_text("as written")
    return Study("s", path, problem(WATCHED), who, (TEST,), None, "d", **more)


def series(path: Path, *who: Any) -> Series:
    cells = tuple(Cell(k, problem(), one, "t: m", "m") for k, one in enumerate(who))
    row = Row("m", "model", truth(), (), cells)
    return Series("t", path, "T", "", (row,), {"a": TEST}, {}, (), Published(source=""), None, {}, (), (), ())


def spread_of(slopes: dict[str, float]) -> float:
    """Standard deviation of x over trials that rise so."""
    return float(np.std(np.concatenate([slope * T for slope in slopes.values()])))


def test_a_study_is_judged_by_what_it_keeps_back_and_its_members_by_its_training(tmp_path: Path) -> None:
    """A table judges all by its tests, so that its models compare; a report of its own kind has scales of its own."""
    (cell,) = identify._scaled(study(tmp_path / "s.toml"))
    assert cell.scale is not None
    assert cell.scale["x"] == pytest.approx(spread_of({"watched": 2.0, "test": 3.0}), rel=0.05)
    assert cell.spread is not None
    assert cell.spread["x"] == pytest.approx(spread_of({"train": 1.0}), rel=0.05)
    table = identify._scaled(series(tmp_path / "t.toml", Ends(), Ends()))
    assert [one.seed for one in table] == [0, 1]
    for one in table:
        assert one.scale == one.spread
        assert one.scale is not None
        assert one.scale["x"] == pytest.approx(spread_of({"test": 3.0}), rel=0.05)
    for other in (study(tmp_path / "s.toml", Ends(several=True)),
                  study(tmp_path / "s.toml", rival=("x",), virtual=object())):  # fmt: skip
        (cell,) = identify._scaled(other)
        assert cell.scale is None
        assert cell.spread is None
    given = dict.fromkeys(STATES, 7.0)
    stated = study(tmp_path / "s.toml")
    stated = replace(stated, problem=replace(stated.problem, loss=Loss(given)))
    assert identify._scaled(stated)[0].scale == identify._scaled(stated)[0].spread == given


@pytest.mark.parametrize(("key", "error", "ends"), [
    ("", FitError("no"), True), ("m", FitError("no"), False), ("m", StudyError("no"), True),
])  # fmt: skip
def test_a_fit_that_fails_ends_a_study_and_leaves_the_rest_of_a_table(
    key: str, error: Exception, ends: bool, tmp_path: Path
) -> None:
    cell = Cell(None, problem(), Ends(error), "s", key)  # type: ignore[arg-type]
    places = tmp_path / "s.toml", tmp_path / "run"
    if ends:
        with pytest.raises(type(error)):
            identify._ended(cell, places, print, None, None)
    else:
        assert identify._ended(cell, places, print, None, None) is error


def test_a_fit_is_saved_in_the_folder_of_its_cell_with_what_it_is_judged_by(tmp_path: Path) -> None:
    cell = Cell(3, problem(), Ends(), "t: m", "m", test=(TEST,), text="as written", file="t.toml", scale={"x": 2.0},
                unidentified={"hull.N_r": "it is copied"})  # fmt: skip
    fit = identify._ended(cell, (tmp_path / "t.toml", tmp_path), print, None, None)
    assert isinstance(fit, Fit)
    said = read_summary(tmp_path / "fits" / "m" / "seed-3")
    assert (said.study, said.study_text, said.study_file) == ("t: m", "as written", "t.toml")
    assert said.scale == {"x": 2.0}
    assert [(one.name, one.role) for one in said.grounds.trials] == [("train", "fit"), ("test", "kept back")]
    assert [(v.subject, v.status) for v in said.verdicts] == [("hull.N_r", "not identified")]
    assert cell.done(tmp_path)


class Counting(Silent):
    def __init__(self) -> None:
        self.lines: list[str] = []

    def note(self, line: str) -> None:
        self.lines.append(line)


def test_a_table_counts_its_cells_from_those_that_are_done(tmp_path: Path) -> None:
    table, sink = series(tmp_path / "t.toml", Ends(), Ends(), Ends(FitError("no"))), Counting()
    cells = table.cells
    fits, failed = identify._fits(table, tmp_path, cells, cells[1:], sink, None)
    assert [*fits] == ["m, seed-1"]
    assert failed == ["m, seed-2: no"]
    assert sink.lines == ["2 of 3: m, seed-1", "3 of 3: m, seed-2", "error: m, seed-2: no"]


def test_what_a_fit_has_found_is_its_file_and_its_errors(tmp_path: Path) -> None:
    saved(tmp_path, [TRAIN])
    report = reports._Fitted(study(tmp_path / "s.toml"), tmp_path)
    numbers = {"schema": "x/1", "standardised": {"fitted": 1.0}, "forecasts": [], "worse_than_untuned": None,
               "trials": {}}  # fmt: skip
    found = report.document(numbers)
    told = json.loads((tmp_path / "fit.json").read_text())
    assert found["schema"] == told["schema"] == "seatrial-fit/1"
    assert found["parameters"] == told["parameters"]
    assert {key for key in numbers if key in found} == {"schema", "standardised", "forecasts", "worse_than_untuned"}
    assert "posterior" not in found
    own = reports._Tuned(study(tmp_path / "s.toml"), tmp_path).document({"ranges": [1]})
    assert own == {"diagnosis": None, "ranges": [1]}


@pytest.mark.parametrize(("text", "told"), [
    (None, "cannot be read"), ("{", "cannot be read"), ("[]", "holds no report"),
])  # fmt: skip
def test_a_report_that_was_damaged_is_named_with_what_helps(text: str | None, told: str, tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    if text is not None:
        path.write_text(text)
    with pytest.raises(StudyError, match=rf"report\.json: {told}.*; delete it, and the study is fitted anew"):
        identify._told(path)
    path.write_text('{"a": 1}')
    assert identify._told(path) == {"a": 1}


def test_a_table_names_the_fits_whose_model_does_not_explain_the_data(tmp_path: Path) -> None:
    table = series(tmp_path / "t.toml", Ends(), Ends(), Ends())
    for cell, explained in zip(table.cells[:2], (True, False), strict=True):
        assert isinstance(identify._ended(cell, (table.path, tmp_path), print, None, None), Fit)
        where = tmp_path / cell.folder
        write_summary(where, replace(read_summary(where), diagnosis={"explained": explained, "lines": []}))
    found = reports._Table(table, tmp_path).document({"schema": "x/1"})
    assert found == {"schema": "x/1", "not_explained": ["m, seed-1"]}


def test_a_run_is_reported_by_what_its_file_asks_for(tmp_path: Path) -> None:
    from seatrial.identify.tuning.fine_tuning import FineTuning

    path = tmp_path / "s.toml"
    asked = (study(path), study(path, FineTuning()), study(path, Ends(several=True)),
             study(path, rival=("x",), virtual=object()), series(path, Ends()))  # fmt: skip
    wanted = [reports._Fitted, reports._Tuned, reports._Fitted, reports._Rivals, reports._Table]
    assert [type(reports.reporting(one, tmp_path)) for one in asked] == wanted
