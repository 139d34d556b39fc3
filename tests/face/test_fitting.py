"""Problems and fits with verbs, and the promise of docs/python.md: simulate, plot and fit in twelve lines."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest

import seatrial as st
from house import REPOSITORY
from seatrial.core.parameters import read
from seatrial.identify import Fit as HouseFit
from seatrial.identify import StudyError
from seatrial.identify.problem import Problem as HouseProblem
from seatrial.identify.resume import digest
from seatrial.ships.files import load as load_house
from seatrial.study.study import read_study as read_house_study

matplotlib.use("Agg")
from matplotlib import pyplot

from seatrial.face.plots import residuals

pytestmark = pytest.mark.slow

TRUTH = {"hull.R_0": 1.15, "hull.N_v": 1.1, "hull.N_r": 0.9}
NOISE = {"x": 0.03, "y": 0.03, "psi": 0.0017, "u": 0.005, "v_m": 0.005, "r": 0.0009}
PAGES = ("README.md", "docs/python.md")


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    yield
    pyplot.close("all")


@pytest.fixture(scope="module")
def trials() -> tuple[st.Trial, ...]:
    ship = st.load("kvlcc2_l7")
    at_sea = ship.having({path: factor * read(ship.model, path) for path, factor in TRUTH.items()})
    orders = {"turn": st.Turning(rudder_deg=35), "zigzag": st.Zigzag(rudder_deg=20, heading_deg=20, side="port")}
    return tuple(at_sea.simulate(order, dt=0.1).rows(slice(0, 1500, 5)).with_noise(NOISE, seed=k).named(name)
                 for k, (name, order) in enumerate(orders.items()))  # fmt: skip


@pytest.fixture(scope="module")
def problem(trials: tuple[st.Trial, ...]) -> st.Problem:
    ship = st.load("kvlcc2_l7")
    return st.Problem(ship, trials, st.near(ship, *TRUTH, ratio=0.5))


@pytest.fixture(scope="module")
def fit(problem: st.Problem) -> st.Fit:
    return st.fit(problem)


def test_the_truth_is_found_and_within_its_interval(fit: st.Fit) -> None:
    truth = {path: factor * read(load_house("kvlcc2_l7").model, path) for path, factor in TRUTH.items()}
    frame = fit.summary().to_frame()
    assert frame.columns == ["parameter", "unit", "start", "estimate", "sigma", "low 95 %", "high 95 %", "verdict"]
    for row in frame.iter_rows(named=True):
        exact = truth[row["parameter"]]
        assert abs(row["estimate"] - exact) < 4.0 * row["sigma"]
        assert row["high 95 %"] - row["estimate"] == pytest.approx(1.959964 * row["sigma"], rel=1e-6)
        assert row["verdict"] == "identified"
        assert row["start"] == pytest.approx(exact / TRUTH[row["parameter"]])
    assert "the residuals look like sensor noise" in str(fit.summary())
    assert "<table>" in fit._repr_html_()


def test_a_problem_is_that_of_the_house(problem: st.Problem) -> None:
    house = HouseProblem(load_house("kvlcc2_l7"), problem.trials, problem.free)
    assert digest(problem, st.Trajectory()) == digest(house, st.Trajectory())
    assert repr(problem) == "Problem('kvlcc2_l7', 3 free parameters, 2 trials, 600 rows)"
    assert repr(house) == repr(problem)
    assert any("no trial is held out" in line for line in problem.lint())
    assert "hull.N_v" in problem._repr_html_()


def test_a_fitted_ship_has_verbs(fit: st.Fit, trials: tuple[st.Trial, ...]) -> None:
    assert isinstance(fit.ship, st.Ship)
    zigzag = trials[1]
    before, after = (float(np.sqrt(np.mean((ship.predict(zigzag, restart=20.0)["psi"] - zigzag["psi"]) ** 2)))
                     for ship in (st.load("kvlcc2_l7"), fit.ship))  # fmt: skip
    assert after < 0.5 * before
    assert len(repr(fit)) < 120


def test_residuals_are_drawn_over_the_noise_in_a_band(fit: st.Fit) -> None:
    axes = fit.plot_residuals()
    assert [ax.get_ylabel() for ax in axes] == [f"{n} / noise [-]" for n in ("x", "y", "psi", "u", "v_m", "r")]
    assert axes[-1].get_xlabel().endswith("[s]")
    drawn = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for ax in axes for line in ax.lines
                            if line.get_marker() == "."])  # fmt: skip
    assert 0.9 < np.mean(np.abs(drawn[np.isfinite(drawn)]) < 2.0) < 0.99
    names = {text.get_text() for text in axes[0].texts}
    assert {"turn", "zigzag"} <= names


def test_names_of_trials_give_way_to_numbers_where_they_have_no_room(fit: st.Fit) -> None:
    assert fit.diagnosis is not None
    one = next(iter(fit.diagnosis.residuals.values()))

    def named(count: int, name: str) -> list[str]:
        many = replace(fit.diagnosis, residuals={f"{name}{k}": one for k in range(count)})
        return [text.get_text() for text in residuals(many)[0].texts[1:]]

    assert named(2, "turn") == ["turn0", "turn1"]
    assert named(12, "a long name ") == [str(k + 1) for k in range(12)]
    assert named(41, "a") == []


def test_a_study_of_the_command_line_has_verbs(tmp_path: Path, trials: tuple[st.Trial, ...]) -> None:
    for trial in trials:
        trial.save(tmp_path / f"{trial.name}.csv")
    (tmp_path / "study.toml").write_text(
        'schema = "seatrial-study/1"\nship = "kvlcc2_l7"\n[data]\nroot = "."\ntrain = ["turn"]\ntest = ["zigzag"]\n'
        '[free]\n"hull.N_r" = { ratio = 0.3 }\n[estimator]\ntype = "shooting:Trajectory"\n'
    )
    study = st.read_study(tmp_path / "study.toml")
    assert isinstance(study.problem, st.Problem)
    assert isinstance(study.problem.ship, st.Ship)
    assert {type(one) for one in (*study.problem.trials, *study.test)} == {st.Trial}
    assert study.digest == read_house_study(tmp_path / "study.toml").digest


def test_a_fit_reads_back_to_the_last_bit(fit: st.Fit, tmp_path: Path) -> None:
    fit.save(tmp_path / "new" / "folder", name="trials of spring")
    again = st.read_fit(tmp_path / "new" / "folder")
    for f in fields(HouseFit):
        one, other = getattr(fit, f.name), getattr(again, f.name)
        if isinstance(one, np.ndarray):
            assert np.array_equal(one, other, equal_nan=True), f.name
        elif f.name not in ("ship", "details", "diagnosis", "free"):
            assert one == other, f.name
    assert again.ship.model == fit.ship.model
    assert [repr(f) for f in again.free] == [repr(f) for f in fit.free]  # NaN is no number equal to itself
    assert str(again.summary()) == str(fit.summary())
    assert again.diagnosis is not None
    assert again.diagnosis.lines == fit.diagnosis.lines
    assert again.ship.entries["hull.N_v"].source == "fitted in study trials of spring, from -0.137"
    ours, theirs = (one.plot_residuals()[2].lines[0].get_ydata() for one in (fit, again))
    assert np.array_equal(ours, theirs, equal_nan=True)
    with pytest.raises(StudyError, match="copy that folder"):
        again.save(tmp_path / "copy")


@pytest.mark.long
def test_a_fit_of_the_command_line_is_read(fitted: Path) -> None:
    again = st.read_fit(fitted / "run")
    assert again.folder == fitted / "run"
    assert len(again.summary().table.rows) == 1
    assert again.plot_residuals()[0].lines


def test_without_residuals_the_message_says_what_to_do(fit: st.Fit, tmp_path: Path) -> None:
    fit.save(tmp_path)
    (tmp_path / "fit.npz").unlink()
    again = st.read_fit(tmp_path)
    assert "not tested" in str(again.summary())
    with pytest.raises(StudyError, match=r"fit\.ship\.predict\(trial\)"):
        again.plot_residuals()


def test_another_estimator_is_taken(problem: st.Problem) -> None:
    found = st.fit(problem, st.OneStep(step=2.0))
    assert math.isfinite(found.objective)
    assert found.problem is problem


@pytest.mark.parametrize("page", PAGES)
def test_simulate_plot_and_fit_take_twelve_lines(
    page: str, trials: tuple[st.Trial, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = re.search(r"^```python\n(.*?)^```", (REPOSITORY / page).read_text(encoding="utf-8"), re.M | re.S)
    assert code is not None
    lines = [line for line in code[1].splitlines() if line.strip() and not line.strip().startswith("#")]
    assert len(lines) <= 12
    assert all(word in code[1] for word in ("simulate(", ".plot(", "st.fit(", "summary()"))
    for folder in ("logs", "demo/trials"):
        (tmp_path / folder).mkdir(parents=True)
        for trial in trials:
            trial.save(tmp_path / folder / f"{trial.name}.csv")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(compile(code[1], page, "exec"), names)
    assert isinstance(names["fit"], st.Fit)
    assert len(pyplot.get_fignums()) == 2
    assert (tmp_path / "fitted" / "model.toml").is_file()


def test_the_guide_runs_as_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What comes after the first block, which has a test of its own."""
    page = (REPOSITORY / "docs" / "python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", page, re.M | re.S)[1:]
    assert len(blocks) >= 2
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "docs/python.md", "exec"), names)
    assert len(pyplot.gcf().axes) == 2


def test_the_guide_names_every_manoeuvre_and_what_it_names_is_there() -> None:
    page = (REPOSITORY / "docs" / "python.md").read_text(encoding="utf-8")
    for name in st.__all__:
        cls = getattr(st, name)
        if isinstance(cls, type) and cls.__module__.startswith("seatrial.manoeuvres.") and getattr(cls, "kind", ""):
            assert f"`{name}`" in page, name
    for name in set(re.findall(r"\bst\.(\w+)", page)):
        assert name in st.__all__, name
