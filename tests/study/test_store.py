from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.parameters import Free, near, read
from seatrial.core.version import __version__
from seatrial.data import Trial
from seatrial.identify import Fit, Loss, Problem, StudyError, Verdict
from seatrial.ships.estimate import estimate
from seatrial.ships.files import load
from seatrial.study.store import claim, read_summary, save_fit


def test_a_fit_comes_back(tmp_path: Path) -> None:
    ship = load("kvlcc2_l7")
    free = near(ship.model, "hull.Y_v", ratio=0.3)
    value = np.array([1.1 * free[0].start])
    fit = Fit(
        ship.having({"hull.Y_v": float(value[0])}), free, value, np.array([0.01]), np.eye(1), np.ones(1), (),
        (Verdict("hull.Y_v", "identified", "fine"),), np.array([[0, 2.0, np.nan, 0.1]]), 2.0, 0.1, 1, "done", "d",
        nuisances={"a": {"current_x": 0.1, "bias_u": -0.02}},
    )  # fmt: skip
    problem = Problem(ship, (Trial("a", np.arange(2.0), {}),), free)
    again = load(save_fit(fit, tmp_path, problem, study="s"))
    assert read(again.model, "hull.Y_v") == value[0]
    assert again.entries["hull.Y_v"].sigma == 0.01
    assert again.notes["provenance"]["trained_on"] == ["a"]
    assert "published" in ship.notes
    assert "published" not in again.notes  # of another ship
    assert read_summary(tmp_path).parameters["hull.Y_v"].value == value[0]
    assert read_summary(tmp_path).nuisances == {"a": {"current_x": 0.1, "bias_u": -0.02}}
    assert (tmp_path / "history.csv").read_text().splitlines()[1].startswith("0,2,,")


def test_velocities_that_do_not_count_beside_track_and_heading_are_kept_as_made(tmp_path: Path) -> None:
    """Where a fit says what it compares; one that compares no track tells nothing of them."""
    ship = load("kvlcc2_l7")
    free = near(ship.model, "hull.Y_v", ratio=0.3)
    fit = Fit(ship, free, np.array([free[0].start]), np.array([0.01]), np.eye(1), np.ones(1), (), (),
              np.array([[0, 2.0, np.nan, 0.1]]), 2.0, 0.1, 1, "done", "d")  # fmt: skip
    for sigma, made in (({"x": 1.0, "y": 1.0, "psi": 0.1}, ("r", "u", "v_m")), ({"u": 1.0, "r": 1.0}, ()), (None, ()),
                        ({"x": 1.0, "y": 1.0, "psi": 0.1, "r": 0.1}, ("u", "v_m"))):  # fmt: skip
        problem = Problem(ship, (Trial("a", np.arange(2.0), {}),), free, Loss(sigma) if sigma else Loss())
        save_fit(fit, tmp_path, problem, study="s")
        assert read_summary(tmp_path).grounds.made == made


def test_a_folder_belongs_to_one_problem(tmp_path: Path) -> None:
    claim(tmp_path / "run", "one", "s")
    claim(tmp_path / "run", "one", "s")
    with pytest.raises(StudyError, match="another folder"):
        claim(tmp_path / "run", "two", "s")


def test_a_folder_of_another_problem_says_what_changed(tmp_path: Path) -> None:
    """Its own version means other settings; another one is named; a folder of before says that it cannot tell."""
    run = tmp_path / "run" / "run.json"
    claim(run.parent, "one", "s")
    held = json.loads(run.read_text(encoding="utf-8"))
    for version, said in ((__version__, "'s' with other settings or data (one, this is two)"),
                          ("0.1.0", f"'s' by version 0.1.0 of seatrial (this is {__version__}), perhaps with other"),
                          (None, "with other settings or data, or by another version")):  # fmt: skip
        kept = {key: value for key, value in {**held, "version": version}.items() if value is not None}
        run.write_text(json.dumps(kept), encoding="utf-8")
        with pytest.raises(StudyError, match=re.escape(said)):
            claim(run.parent, "two", "s")
        assert claim(run.parent, "one", "s") is False


@pytest.mark.parametrize(("path", "kept"), [("residual_X.u", False), ("hull.Y_v", True)])
def test_a_caution_about_what_was_zero_goes_with_the_fit_that_moves_it(path: str, kept: bool, tmp_path: Path) -> None:
    ship = load("esso_osaka_3m_hybrid")
    start = read(ship.model, path)
    free, value = (Free(path, start, start - 1.0, start + 1.0),), np.array([start + 0.1])
    fit = Fit(
        ship.having({path: float(value[0])}), free, value, np.array([0.01]), np.eye(1), np.ones(1), (), (),
        np.array([[0, 2.0, np.nan, 0.1]]), 2.0, 0.1, 1, "done", "d",
    )  # fmt: skip
    problem = Problem(ship, (Trial("a", np.arange(2.0), {}),), free)
    before = ship.notes["cautions"]
    again = load(save_fit(fit, tmp_path, problem, study="s"))
    assert before[0].startswith("As it stands")
    assert again.notes["cautions"] == (before if kept else before[1:])


def test_a_fitted_estimate_says_what_is_fitted_and_repeats_no_caution_that_the_fit_answers(tmp_path: Path) -> None:
    known = tmp_path / "known.toml"
    known.write_text('schema = "seatrial-particulars/1"\n[particulars]\nL_pp = 150.0\nB = 25.0\nd = 9.0\nC_b = 0.7\n')
    made = estimate(known).ship
    both, one = (f"outside the range of a formula: {paths}" for paths in ("hull.Y_v, hull.Y_r", "hull.R_0"))
    ship = replace(made, notes={**made.notes, "cautions": [both, one, *made.notes["cautions"]]})
    before = ship.notes["cautions"]

    def cautions(*paths: str) -> list[str]:
        free = near(ship.model, *paths, ratio=0.3)
        n = len(free)
        fit = Fit(ship, free, np.array([f.start for f in free]), np.ones(n), np.eye(n), np.ones(n), (), (),
                  np.array([[0, 2.0, np.nan, 0.1]]), 2.0, 0.1, 1, "done", "d")  # fmt: skip
        problem = Problem(ship, (Trial("a", np.arange(2.0), {}),), free)
        found = load(save_fit(fit, tmp_path, problem, study="s")).notes["cautions"]
        return [str(line) for line in found]

    told = cautions("hull.Y_v", "hull.N_v")
    assert told[:-1] == before[:-1]
    assert both not in cautions("hull.Y_v", "hull.Y_r")
    assert told[-1] == "2 numbers are fitted in study s, the others estimated from particulars"
    assert one not in cautions("hull.R_0")
