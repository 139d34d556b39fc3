"""Scores of predictions, and what a study says about a rival, a bench and trials of its own."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.environment import Uniform
from seatrial.identify import StudyError
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.report.page import plain
from seatrial.ships.files import load
from seatrial.simulate.run import simulate
from seatrial.study.study import read_study
from seatrial.validate.rivals import HORIZONS, VELOCITIES, free_runs, one_step, score

STUDY = Path(__file__).parents[2] / "studies" / "you2023.toml"
TUG = load("qiuxin5")


@pytest.fixture(scope="module")
def trials():
    runs = (
        simulate(TUG, Zigzag(n_P=n, delta=0.35, psi=0.35), duration=s, dt=0.2, speed=0.5, name=f"zigzag {n:g}")
        for n, s in ((5.0, 30.0), (7.0, 24.0))
    )
    return tuple(replace(run, channels={n: run[n] for n in run.channels if not n.endswith("_cmd")}) for run in runs)


def test_the_truth_without_noise_errs_by_nothing(trials):
    found = score(TUG, trials)
    assert max(found.relative.values()) < 0.01  # the helm changes within a step: the mean of two rows is not exact
    assert found.starts == sum(len(range(0, len(t) - HORIZONS[-1], 10)) for t in trials)
    assert all(len(errors) == len(HORIZONS) for errors in found.steps.values())


def test_another_ship_errs_and_errs_more_later(trials):
    other = TUG.having({"damping.X_u": -20.0, "damping.N_r": -40.0})
    found, truth = score(other, trials), score(TUG, trials)
    assert set(found.runs) == {"zigzag 5", "zigzag 7"}
    assert found.relative["u"] > 0.05
    assert found.steps["x"][-1] > found.steps["x"][0]
    assert all(ratio > 3.0 for ratio in found.beyond(truth).values())


def test_one_that_blows_up_has_errors_without_end(trials):
    wild = TUG.having({"damping.X_uuu": 500.0, "damping.X_u": 500.0})
    found = score(wild, trials)
    assert found.relative["u"] == math.inf
    assert plain({"a": [found.relative["u"], 1.0]}) == {"a": [None, 1.0]}


def written(tmp_path, *swaps):
    text = STUDY.read_text(encoding="utf-8").replace("duration = 73.0", "duration = 12.0", 1)
    for old, new in swaps:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "study.toml"
    path.write_text(text, encoding="utf-8")
    first = "qiuxin5_first_guess.toml"
    (tmp_path / first).write_text((STUDY.parent / first).read_text(encoding="utf-8"), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        pytest.param('free = ["inertia.m_11"', 'free = ["inertia.m_99"', "rival.free", marks=pytest.mark.long),
        ("noise = 0.3", "noise = -0.3", "virtual.bench.noise"),
        ("alpha_1 = 0.2,", "alpha_7 = 0.2,", "virtual.noise"),
        ("revolutions = 3.0,", "revolution = 3.0,", "revolution"),
    ],
)
def test_mistakes_are_named(tmp_path, old, new, words):
    with pytest.raises(StudyError, match=words):
        read_study(written(tmp_path, (old, new)))


@pytest.mark.long
def test_trials_are_sailed_each_in_its_own_way(tmp_path):
    study = read_study(written(tmp_path))
    first = study.problem.trials[0]
    assert first["n_1"] == pytest.approx(3.0)
    assert first.duration == pytest.approx(73.0)
    assert study.test[0].duration == pytest.approx(12.0)
    assert abs(first["u"][0]) < 0.06
    assert {"alpha_1", "alpha_1_cmd"} <= set(first.channels)
    assert np.ptp(first["alpha_1_cmd"]) == 0.0 < np.ptp(first["alpha_1"])
    assert {f.path for f in study.rival} < {f.path for f in study.problem.free}
    pulled = study.virtual.pulled()
    assert set(pulled) == {"1", "2"}
    assert all(len(n) == 33 for n, _ in pulled.values())


@pytest.mark.slow
def test_a_hybrid_begins_with_what_the_log_before_tells():
    bare = load("esso_osaka_3m_hybrid")
    hybrid = bare.having({"drift_along": 0.02, "residual_Y.d_n_N": 0.2})
    run = simulate(hybrid, Zigzag(n_P=9.0, delta=0.35, psi=0.35), duration=60.0, dt=0.2, speed=0.3,
                   environment=Uniform(U_T=3.0, gamma_T=1.0))  # fmt: skip
    found = score(hybrid, [run])
    assert max(found.relative.values()) < 0.01
    assert found.steps["y"][-1] < 1e-3


def test_a_row_predicted_from_the_row_before_errs_less_than_a_whole_run(trials):
    other = TUG.having({"damping.X_u": -20.0, "damping.N_r": -40.0})
    logged = [t.stack(*VELOCITIES) for t in trials]
    steps, runs = one_step(other, trials), free_runs(other, trials)
    for made in (steps, runs):
        assert [part.shape for part in made] == [part.shape for part in logged]
        assert all((part[0] == log[0]).all() for part, log in zip(made, logged, strict=True))
    for step, run, log in zip(steps, runs, logged, strict=True):
        assert (np.abs(run - log).max(axis=0) > np.abs(step - log).max(axis=0)).all()
    # The first two rows of a run are a step.
    np.testing.assert_allclose(steps[0][:2], runs[0][:2], rtol=1e-12)
