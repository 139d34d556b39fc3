"""Fits that run a trial through do not trust its first row: KVLCC2, unstable on course, logged at 1 s."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.parameters import near, read
from seatrial.data import Trial
from seatrial.identify import Fit, Loss, Problem, StudyError
from seatrial.identify.nuisance import begun_as
from seatrial.identify.population.evolution import Evolution
from seatrial.identify.trajectory.multistart import MultiStart
from seatrial.identify.trajectory.objective import TrajectoryObjective
from seatrial.identify.tuning.fine_tuning import FineTuning
from seatrial.identify.tuning.ranges import Scorer
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models import STATES
from seatrial.sensors import Sensors
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate
from trajectories_by_hand import written_out

TRUTH = load("kvlcc2")
SENSORS = {"x": 1.0, "y": 1.0, "psi": math.radians(0.2), "u": 0.05, "v_m": 0.05, "r": math.radians(0.02)}
PATHS = ("hull.Y_v", "hull.Y_r", "hull.N_v", "hull.N_r")
WRONG = {"hull.Y_v": 1.1, "hull.N_v": 0.9, "hull.N_r": 0.8}
SMALL = FineTuning(ratios=(0.3, 0.6), population=8, largest=16, agree=2, starts=4, fold_starts=2)


def trials(seed: int, duration: float = 600.0) -> tuple[Trial, ...]:
    """Two zigzags and a turn, every row read by ordinary sensors, the first one too."""
    _, n_P = approach(TRUTH)
    ten, rng = math.radians(10.0), np.random.default_rng(seed)
    policies = (Zigzag(n_P=n_P, delta=ten, psi=ten), Zigzag(n_P=n_P, delta=2 * ten, psi=2 * ten, side=-1.0),
                Turning(n_P=n_P, delta=3.5 * ten))  # fmt: skip
    runs = [simulate(TRUTH, policy, duration=duration, dt=0.1, every=10, name=f"run {k}")
            for k, policy in enumerate(policies, 1)]  # fmt: skip
    return tuple(Sensors(SENSORS).read(run, rng) for run in runs)


def problem(seed: int = 2, duration: float = 600.0, count: int = 3) -> Problem:
    """Four derivatives of the hull, sought from a ship whose own are up to 20 % off."""
    start = TRUTH.having({path: factor * float(read(TRUTH.model, path)) for path, factor in WRONG.items()})
    free = near(start.model, *PATHS, ratio=0.6)
    return Problem(start, trials(seed, duration)[:count], free, Loss(SENSORS, correlation=0.0))


def away(fit: Fit, path: str = "hull.N_r") -> float:
    """Error of a parameter in stated deviations."""
    k = [f.path for f in fit.free].index(path)
    return float((fit.values[k] - float(read(TRUTH.model, path))) / fit.sigma[k])


@pytest.fixture(scope="module")
def short() -> Problem:
    return problem(duration=200.0, count=2)


@pytest.mark.long
def test_the_noise_of_the_first_row_does_not_pass_for_a_coefficient() -> None:
    told = problem()
    assert abs(away(MultiStart(starts=1).fit(told))) < 1.96
    assert abs(away(MultiStart(starts=1, initial="measured").fit(told))) > 10.0


@pytest.mark.long
def test_the_bands_of_fine_tunings_cover_the_truth() -> None:
    """Once -.038, 95 % -.0388 to -.0372, for a truth of -.049: every trial from its first row as read.

    Of 16 intervals of 95 % three or more miss the truth by chance in one of 23 draws.
    """
    missed = 0
    for seed in (1, 2, 3, 4):
        tuning = SMALL.tune(problem(seed))
        assert max(r.apart for r in tuning.ranges) < 1e-4
        off = [abs(away(tuning.fit, path)) for path in PATHS]
        assert max(off) < 2.5
        missed += sum(z > 1.96 for z in off)
    assert missed <= 2


@pytest.mark.slow
def test_starts_are_eliminated_alike_for_one_problem_and_for_many(short: Problem) -> None:
    """The normal equations of many problems are those of each, at the starts that suit it best."""
    own = begun_as(short, "free")
    given = {"window": 90.0, "dt": 1.0, "every": 1, "method": "rk4", "threads": 2}
    sigma = {name: 10.0 * sd for name, sd in SENSORS.items()}
    one = TrajectoryObjective.build(own, own.trials, sigma, **given)
    values = MultiStart(starts=5, seed=0).drawn(own.vector)
    found, n = one.best(values), values.shape[1]
    for k, p in enumerate(values):
        eta = one.begun(p)
        cost, whole, gradient = written_out(one, p, eta)
        back = np.linalg.solve(whole[n:, n:], np.column_stack([whole[n:, :n], gradient[n:]]))
        H, g = whole[:n, :n] - whole[:n, n:] @ back[:, :-1], gradient[:n] - whole[:n, n:] @ back[:, -1]
        assert found.cost[k] == pytest.approx(cost, rel=1e-6)
        np.testing.assert_allclose(found.H[k], H, rtol=1e-4, atol=1e-5 * np.abs(H).max())
        np.testing.assert_allclose(found.g[k], g, rtol=1e-4, atol=1e-4 * np.abs(g).max())
        # No start in the neighbourhood does better.
        for shift in (-0.01, 0.01):
            assert one.cost(p, eta + shift * np.tile(list(SENSORS.values()), len(one.windows.state0))) > cost


@pytest.mark.slow
def test_all_ways_to_the_optimum_end_there(short: Problem) -> None:
    gradient = SMALL.gradient(200.0).fit(begun_as(short, "free"))
    many = MultiStart(starts=3).fit(short)
    evolution = Evolution(population=8, largest=16, agree=2, generations=150, threads=1).fit(short)
    for other in (many, evolution):
        assert other.objective == pytest.approx(gradient.objective, rel=1e-6)
        np.testing.assert_allclose(other.sigma, gradient.sigma, rtol=1e-3)
    assert evolution.ends[:, 0].min() == evolution.objective


@pytest.mark.slow
def test_a_killed_population_search_goes_on_to_the_same_numbers(short: Problem, tmp_path: Path) -> None:
    quick, path = Evolution(runs=2, agree=2, generations=12, population=6), tmp_path / "checkpoint.npz"
    whole = quick.fit(short, checkpoint=path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3 + 3])
    again = replace(quick, threads=1).fit(short, checkpoint=path)
    assert np.array_equal(again.values, whole.values)
    assert np.array_equal(again.sigma, whole.sigma)
    assert np.array_equal(again.ends, whole.ends)


@pytest.mark.slow
def test_a_trial_that_is_only_predicted_starts_by_its_first_length(short: Problem) -> None:
    """What comes after that changes nothing of where the prediction starts."""
    scorer = Scorer.of(begun_as(short, "free"), None, "rk4")
    (run, _) = short.trials
    values = np.array([f.start for f in short.free])
    later = run.t > 60.0
    assert scorer.first(scorer.objective([run])) < 60.0
    bent = run.having(y=np.where(later, run["y"] + 300.0, run["y"]))
    one, other = (scorer.residuals([trial], values, seen=False) for trial in (run, bent))
    assert np.array_equal(one[:, ~later], other[:, ~later])
    one, other = (scorer.residuals([trial], values) for trial in (run, bent))
    assert not np.array_equal(one[:, ~later], other[:, ~later])


@pytest.mark.slow
def test_what_is_not_compared_starts_as_recorded(short: Problem) -> None:
    """Nothing is known of its errors."""
    told = replace(short, loss=Loss({"x": 1.0, "y": 1.0, "psi": 0.003}, 0.0))
    assert set(begun_as(told, "free").nuisance.initial) == {"x", "y", "psi"}
    assert set(begun_as(short, "free").nuisance.initial) == set(STATES)
    assert begun_as(told, "measured") is told


@pytest.mark.parametrize("estimator", [Evolution, MultiStart, FineTuning])
def test_starts_are_free_unless_a_study_asks_for_the_recorded_ones(estimator: type) -> None:
    assert estimator().initial == "free"
    with pytest.raises(StudyError, match=r"estimator.initial is 'smooth'; it is free or measured"):
        estimator(initial="smooth")


def test_the_paper_s_protocol_is_asked_for_by_name() -> None:
    study = Path(__file__).parents[2] / "studies" / "suyama2023.toml"
    told = tomllib.loads(study.read_text(encoding="utf-8"))["estimator"]
    assert (told["initial"], told["method"]) == ("measured", "euler")
