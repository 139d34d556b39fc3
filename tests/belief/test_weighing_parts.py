"""Weights of a likelihood, members and parts of a fit by hand: errors of a known size, ensembles of known draws."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2, norm

from seatrial.belief import parts, spread, weighing
from seatrial.belief.coverage import Coverage
from seatrial.belief.ensemble import Bands, Ensemble
from seatrial.belief.freer import WIDTH, with_units
from seatrial.belief.posterior import Posterior
from seatrial.belief.power import LEAST, Power, directions
from seatrial.belief.spread import MEMBERS, WIDE, Members, Spread, spreads
from seatrial.belief.weighing import _answer, _factor, _mean, _Missed
from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.identify import StudyError
from seatrial.models import STATES
from seatrial.ships.files import load
from seatrial.study.folds import folds

SHIP = load("kvlcc2")


# --- by how much a likelihood counts less ---


def missed(squares: Any, noise: Any, slopes: Any, fixed: Any, windows: int = 4) -> _Missed:
    return _Missed(*(np.array(one, dtype=float) for one in (squares, noise, slopes, fixed)), windows)


def test_what_parameters_explain_grows_with_the_factor_up_to_their_prior() -> None:
    """Of a slope of 3 squared sigmas, 1 / (1 + 99) at first, 1 / (1 + 99/T) at T, all of it in the end."""
    one = missed([0.0], [0.0], [[3.0]], [99.0])
    for factor in (1.0, 11.0, 99.0, 1e9):
        assert one.explained(factor) == pytest.approx([3.0 / (1.0 + 99.0 / factor)])
    two = missed([0.0, 0.0], [0.0, 0.0], [[3.0, 1.0], [0.0, 5.0]], [9.0, 0.0])
    assert two.explained(1.0) == pytest.approx([0.3 + 1.0, 5.0])


def test_errors_are_over_what_noise_may_be_and_parameters_explain_by_channel() -> None:
    """Noise counts by the 95 % end of chi-squared of as many degrees of freedom as windows, over these."""
    sure = float(chi2.ppf(0.95, 4)) / 4.0
    one = missed([20.0, 6.0], [2.0, 1.0], [[4.0], [0.0]], [1.0])
    wanted = 0.5 * (20.0 / (sure * 2.0 + 2.0) + 6.0 / (sure * 1.0))
    assert _mean([one], 1.0) == pytest.approx(wanted)
    other = missed([8.0, 2.0], [1.0, 3.0], [[2.0], [2.0]], [0.0], windows=6)
    sure = float(chi2.ppf(0.95, 10)) / 10.0
    wanted = 0.5 * (28.0 / (sure * 3.0 + 2.0 + 2.0) + 8.0 / (sure * 4.0 + 2.0))
    assert _mean([one, other], 1.0) == pytest.approx(wanted)


def test_the_factor_makes_the_errors_those_that_are_expected() -> None:
    """No noise: squares of 2.4 where 3 / (1 + 99/T) are expected; T = 99 / (3/2.4 - 1) = 396."""
    one = missed([2.4], [0.0], [[3.0]], [99.0])
    assert _factor([one]) == pytest.approx(396.0, rel=1e-6)
    assert _factor([missed([0.03], [0.0], [[3.0]], [99.0])]) == pytest.approx(1.0)
    assert _factor([missed([0.01], [0.0], [[3.0]], [99.0])]) == 1.0  # never below
    assert _factor([missed([9.0], [0.0], [[3.0]], [99.0])]) == pytest.approx(1e8, rel=1e-6)  # not even the prior


FREE = (Free("a", 1.0, prior=1.0, sigma=0.5), Free("b", 2.0, prior=2.0, sigma=0.1), Free("c", 3.0))
COVARIANCE = np.diag([0.01, 0.0025, 0.04])


def test_what_each_parameter_keeps_of_its_prior() -> None:
    """Variances of .01 of .25 and of .0025 of .01; at T = 4 the data count a quarter."""
    one, four = (Power(factor, 5, {}, 1.0) for factor in (1.0, 4.0))
    assert one.shares(FREE, COVARIANCE) == pytest.approx([0.04, 0.25, 0.0])
    kept = [1.0 / (1.0 + (1.0 / share - 1.0) / 4.0) for share in (0.04, 0.25)]
    assert four.shares(FREE, COVARIANCE) == pytest.approx([*kept, 0.0])
    wide = Power(1.0, 5, {}, 2.25)
    assert wide.covariance(FREE, COVARIANCE) == pytest.approx(2.25 * COVARIANCE)
    assert Power(1.0, 5, {}, 0.5).covariance(FREE, COVARIANCE) == pytest.approx(COVARIANCE)


def test_a_parameter_without_a_prior_has_one_of_a_hundred_sigmas() -> None:
    across, fixed = directions((Free("c", 3.0),), np.array([[0.04]]))
    assert across == pytest.approx(np.array([[20.0]]))
    assert fixed == pytest.approx([1e4 - 1.0])


def test_what_is_told_of_trials_left_out() -> None:
    some = Power(3.24, 3, {"a": 1.0, "b": 7.0}, 1.0)
    assert some.words == ("each of 3 trials is missed by 2 times what the fit to the others expects (root mean "
                          "square), so the data count by 1/3.2",)  # fmt: skip
    assert len(replace(some, left=1.1).words) == 1
    assert "widened by 1.5 besides" in replace(some, left=2.25).words[1]
    assert some.numbers()["words"] == list(some.words)
    assert LEAST == 3


def test_a_factor_is_known_by_as_many_degrees_of_freedom_as_trials() -> None:
    """Deviation squared of a direction that the data fix well goes with T = factor x trials / chi-squared."""
    some = Power(9.0, 6, {}, 1.0)
    drawn = some.deviations(np.array([1e6]), 40_000, np.random.default_rng(1))[:, 0] ** 2 * 1e6
    # the mean of n / chi-squared of n degrees is n / (n - 2)
    assert drawn.mean() == pytest.approx(9.0 * 6.0 / 4.0, rel=0.05)
    assert np.median(drawn) == pytest.approx(9.0 * 6.0 / chi2.median(6), rel=0.03)


# --- an ensemble of known members ---


def group(objectives: Any, objective: float) -> Ensemble:
    return Ensemble(SHIP, (), np.zeros((len(objectives), 0)), np.array(objectives), objective, {}, None)  # type: ignore[arg-type]


def test_how_typical_the_fit_is_among_repetitions() -> None:
    some = group([1.0, 2.0, 3.0, 4.0, 10.0], 3.0)
    assert some.excess == 1.0
    assert some.surpassed == 0.6  # its own value counts
    assert group([1.0, 2.0, 3.0], 6.0).excess == 3.0
    assert group([1.0, 2.0, 3.0], 6.0).surpassed == 0.0


def test_edges_of_bands_are_quantiles_of_the_members() -> None:
    draws = np.linspace(0.0, 100.0, 101)
    states = np.zeros((101, 2, 6))
    states[:, 1, STATES.index("psi")] = draws
    indices = {"advance": np.append(draws[:-1], math.nan), "transfer": np.full(101, math.nan)}
    one = Bands(None, np.arange(2.0), states, states[0], indices, {}, {}, {})  # type: ignore[arg-type]
    low, high = one.band("psi")
    assert (low[1], high[1]) == pytest.approx((2.5, 97.5))
    assert (low[0], high[0]) == (0.0, 0.0)
    low, high = one.band("psi", 0.5)
    assert (low[1], high[1]) == pytest.approx((25.0, 75.0))
    assert one.interval("advance", 0.5) == pytest.approx((24.75, 74.25))
    assert all(math.isnan(edge) for edge in one.interval("transfer"))


# --- members of a spread ---


def members(**given: Any) -> Members:
    usual: dict[str, Any] = {
        "paths": ("hull.R_0",), "fitted": np.array([1.0]), "drawn": np.zeros((3, 1)), "units": None,
        "sigma": dict.fromkeys(STATES, 1.0), "restart": None, "training": {}, "reference": None,
    }  # fmt: skip
    return Members(**{**usual, **given})


def test_the_usual_spread_is_that_of_nine_in_ten_trials() -> None:
    levels = {str(k): float(k) for k in range(11)}
    assert members(training=levels).usual == pytest.approx(9.0)
    assert (WIDE, MEMBERS) == (3.0, 16)


def test_a_spread_is_over_the_usual_one(monkeypatch: pytest.MonkeyPatch) -> None:
    found = members(training={"a": 2.0, "b": 2.0})
    monkeypatch.setattr(spread, "_drifts", lambda some, ship, trials: [(np.zeros((1, 1, 6)), 5.0) for _ in trials])
    trial = Trial("new", np.arange(3.0), {"u": np.zeros(3)})
    (one,) = spreads(found, SHIP, [trial])
    assert (one.name, one.standardised, one.ratio, one.coverage) == ("new", 5.0, 2.5, None)


def test_a_spread_in_words() -> None:
    none = np.zeros(1)
    covered = Coverage("x", none, none, 0.256, {"u": 0.9, "r": 0.1}, {"u": 0.0, "r": 0.0})
    assert str(Spread("x", none, 5.0, 1.234, covered)) == (
        "x: this manoeuvre leaves the training data (spread 1.2 times the usual, 25.6 % of the samples are novel in u)")
    alone = str(Spread("x", none, 5.0, 0.9, None))
    assert "could not be compared" in alone
    assert "novel" not in alone


# --- random units of a hybrid ---


def test_units_are_added_beside_those_there_are_and_say_nothing_yet() -> None:
    ship = load("esso_osaka_3m_hybrid")
    before = {name.partition("_")[0] for name in ship.model.unit_in.names}
    wide, free = with_units(ship, 4, seed=2)
    added = [name for name in wide.model.unit_in.names if name not in ship.model.unit_in.names]
    assert len({name.partition("_")[0] for name in added}) == 4
    assert not before & {name.partition("_")[0] for name in added}
    assert len(added) == 4 * 9  # eight inputs and a constant
    assert len(free) == 12
    assert all(one.sigma == WIDTH == 0.3 for one in free)
    assert all((one.start, one.prior) == (0.0, 0.0) for one in free)
    outward = dict(zip(wide.model.unit_out.names, wide.model.unit_out.numbers, strict=True))
    assert all(outward[one.path.removeprefix("unit_out.")] == 0.0 for one in free)
    again, _ = with_units(ship, 4, seed=2)
    assert again.model.unit_in.numbers == wide.model.unit_in.numbers
    other, _ = with_units(ship, 4, seed=3)
    assert other.model.unit_in.numbers != wide.model.unit_in.numbers
    with pytest.raises(TypeError, match="no hybrid"):
        with_units(SHIP, 4, seed=1)


def test_weights_of_units_are_normal() -> None:
    ship = load("esso_osaka_3m_hybrid")
    wide, _ = with_units(ship, 400, seed=0)
    known = set(ship.model.unit_in.names)
    drawn = [v for n, v in zip(wide.model.unit_in.names, wide.model.unit_in.numbers, strict=True) if n not in known]
    assert np.mean(drawn) == pytest.approx(0.0, abs=4.0 / math.sqrt(len(drawn)))
    assert np.std(drawn) == pytest.approx(1.0, rel=0.05)
    assert np.mean(np.abs(drawn) < 1.0) == pytest.approx(2.0 * norm.cdf(1.0) - 1.0, abs=0.03)


# --- fits that leave trials out ---


def trial(name: str) -> Trial:
    return Trial(name, np.arange(4.0), {"u": np.zeros(4)}, {}, {"recording": name})


class Problem(SimpleNamespace):
    """Trials and two parameters; a fit to some of them finds their number."""

    def without(self, some: Any) -> Any:
        left = tuple(one for one in self.trials if one.name not in {o.name for o in some})
        return Problem(**{**vars(self), "trials": left})


class Fitter:
    def fit(self, problem: Any) -> Any:
        values = np.array([0.01 * len(problem.trials), -0.07])
        return SimpleNamespace(values=values, covariance=np.eye(2), diagnosis=None)


def left_out(monkeypatch: pytest.MonkeyPatch, samples: Any, count: int, **how: Any) -> list[Any]:
    free = (Free("hull.R_0", 0.02), Free("hull.N_r", -0.05))
    problem: Any = Problem(trials=tuple(trial(c) for c in "abcde"), free=free, ship=SHIP,
                           vector=SimpleNamespace(paths=("hull.R_0", "hull.N_r")))  # fmt: skip
    monkeypatch.setattr(parts, "begun", lambda estimator, problem, fit: (estimator, problem))
    monkeypatch.setattr(parts, "digest", lambda problem, estimator: "d" + "".join(t.name for t in problem.trials))
    held = Posterior(SHIP, free, np.array([0.05, -0.07]), np.eye(2), samples=samples)
    out = [problem.trials[k::count] for k in range(count)]
    return list(parts.left_out(Fitter(), problem, SimpleNamespace(), held, out=out, **how))


def test_each_recording_is_left_out_once_and_samples_move_with_the_estimate(monkeypatch: pytest.MonkeyPatch) -> None:
    samples = np.array([[0.055, -0.07], [0.045, -0.08]])
    done: list[int] = []
    found = left_out(monkeypatch, samples, 2, each=done.append)
    assert done == [1, 2]
    names = [sorted(t.name for t in one.trials) for one in found]
    assert sorted(name for some in names for name in some) == list("abcde")
    assert sorted(map(len, names)) == [2, 3]
    for one in found:
        kept = 0.01 * (5 - len(one.trials))
        assert one.held.mean.tolist() == [kept, -0.07]
        np.testing.assert_allclose(one.held.samples, samples - [0.05, -0.07] + [kept, -0.07])
        assert float(one.held.ship.model.hull.R_0) == kept


def test_parts_that_are_done_are_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    first = left_out(monkeypatch, None, 5, folder=tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == [f"part-{k}-of-5.npz" for k in range(1, 6)]
    (tmp_path / "part-3-of-5.npz").unlink()
    fitted: list[int] = []
    whole = Fitter.fit
    monkeypatch.setattr(Fitter, "fit", lambda self, problem: fitted.append(1) or whole(self, problem))
    again = left_out(monkeypatch, None, 5, folder=tmp_path)
    assert len(fitted) == 1
    assert [one.held.mean.tolist() for one in again] == [one.held.mean.tolist() for one in first]


def test_more_parts_than_recordings_are_refused() -> None:
    with pytest.raises(StudyError, match="--parts is 3; there are 2 recordings"):
        folds([trial("a"), trial("b")], "recording", 3)
    assert [len(one) for one in folds([trial("a"), trial("b")], "recording", 2)] == [1, 1]


@dataclass(frozen=True)
class Searching:
    """An estimator with choices of its own."""

    later: tuple[str, ...] = ("x",)
    starts: int = 8
    window: float = 60.0

    def settled(self, problem: Any, fit: Any) -> tuple[Any, Any]:
        return replace(self, window=fit.window), replace(problem, chosen=fit.window)


@dataclass(frozen=True)
class Told:
    """A problem, as far as a fit to fewer trials changes it."""

    free: tuple[Free, ...]
    validation: tuple[str, ...] = ("kept",)
    linted: bool = False
    chosen: float = 0.0

    @property
    def vector(self) -> Any:
        return SimpleNamespace(started=lambda own: tuple(replace(f, start=own[f.path]) for f in self.free))


def test_a_fit_to_fewer_trials_begins_at_the_whole_one_and_chooses_nothing_anew() -> None:
    fit: Any = SimpleNamespace(free=FREE, values=np.array([1.5, 2.5, 3.5]), window=30.0)
    told: Any = Told(FREE)
    who, begun = parts.begun(Searching(), told, fit)
    assert (who.later, who.starts, who.window) == ((), 1, 30.0)
    assert [one.start for one in begun.free] == [1.5, 2.5, 3.5]
    assert (begun.validation, begun.linted, begun.chosen) == ((), True, 30.0)
    plain, begun = parts.begun("an estimator without such choices", told, fit)
    assert plain == "an estimator without such choices"
    assert begun.chosen == 0.0


def predicted(freed: tuple[int, ...]) -> Any:
    """Two windows of three rows; channels 0 and 2 of four states are compared, starts are free or measured."""
    rng = np.random.default_rng(7)
    n, width, compared = 2, 4, np.array([0, 2])
    scale = np.full((2, 3, width), 1.0) * np.array([2.0, 1.0, 4.0, 1.0])
    scale[1, 2, 2] = 0.0  # a gap: the row does not count
    cut = SimpleNamespace(state0=rng.normal(size=(2, width)), width=width, measured=rng.normal(size=(2, 3, width)),
                          scale=scale)  # fmt: skip
    back = rng.normal(size=(1, 2, len(freed), n + 1))
    block = SimpleNamespace(back=lambda: back)
    run, columns = rng.normal(size=(2, 3, width)), rng.normal(size=(2, 3, width, n + width + 3))
    asked: list[Any] = []
    objective = SimpleNamespace(
        windows=cut, compared=compared, freed=bool(freed),
        layout=SimpleNamespace(own=SimpleNamespace(initial=list(freed))),
        settled=lambda values: (SimpleNamespace(blocks=[block]), "best starts"),
        lanes=lambda values, eta: asked.append(eta) or ("lanes", None),
        slopes=lambda lanes: ((run,), (columns,)),
    )  # fmt: skip
    return objective, cut, back[0], run, columns, asked


@pytest.mark.parametrize("freed", [(), (1,), (0, 3)])
def test_errors_of_a_prediction_answer_to_parameters_directly_and_by_its_best_starts(freed: tuple[int, ...]) -> None:
    """A start that is estimated moves by -back with the parameters, and is no measurement any more; by sums."""
    objective, cut, back, run, columns, asked = predicted(freed)
    errors, slopes, begun, scale = _answer(objective, np.zeros((1, 2)))
    counted = [(w, r) for w in range(2) for r in range(3) if (w, r) != (1, 2)]
    assert errors.shape == (5, 2)
    assert asked[0] == "best starts" if freed else asked[0].shape == (1, 0)
    for k, (w, r) in enumerate(counted):
        for c, state in enumerate((0, 2)):
            size = (2.0, 4.0)[c]
            assert errors[k, c] == pytest.approx(size * (run[w, r, state] - cut.measured[w, r, state]))
            assert scale[k, c] == size
            for p in range(2):
                through = sum(columns[w, r, state, 2 + s] * back[w, j, p] for j, s in enumerate(freed))
                assert slopes[k, c, p] == pytest.approx(size * (columns[w, r, state, p] - through))
            for s in range(4):
                assert begun[k, c, s] == pytest.approx(0.0 if s in freed else size * columns[w, r, state, 2 + s])


def test_noise_comes_in_at_the_samples_and_through_the_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Variances: of a reading over its scale, and of each measured start by its slope; summed over the rows."""
    objective, *_ = predicted(())
    monkeypatch.setattr(weighing.TrajectoryObjective, "plain", lambda problem, settings: objective)
    sigma, trial_ = np.array([0.5, 0.2, 0.1, 0.3]), trial("a")
    told: Any = SimpleTold(FREE[:2])
    covariance = np.diag([0.01, 0.0025])
    out: Any = SimpleNamespace(held=SimpleNamespace(covariance=covariance, mean=np.zeros(2)))
    found = weighing._told(told, trial_, out, None, sigma)
    errors, slopes, begun, scale = _answer(objective, np.zeros((1, 2)))
    across, fixed = directions(FREE[:2], covariance)
    for c, state in enumerate((0, 2)):
        at_samples = sum((scale[k, c] * sigma[state]) ** 2 for k in range(5))
        through = sum((begun[k, c, s] * sigma[s]) ** 2 for k in range(5) for s in range(4))
        assert found.noise[c] == pytest.approx(at_samples + through)
        assert found.squares[c] == pytest.approx(sum(errors[k, c] ** 2 for k in range(5)))
        for d in range(2):
            moved = [sum(slopes[k, c, p] * across[p, d] for p in range(2)) for k in range(5)]
            assert found.slopes[c, d] == pytest.approx(sum(one**2 for one in moved))
    np.testing.assert_allclose(found.fixed, fixed)
    assert found.windows == 2


@dataclass(frozen=True)
class SimpleTold:
    """A problem that is predicted trial by trial."""

    free: tuple[Free, ...]
    trials: tuple[Trial, ...] = ()
    validation: tuple[Trial, ...] = ()


def test_the_power_is_of_all_left_out_trials_and_each_is_told_by_itself_where_the_data_count_in_full(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Squares of 5.4 in all, where 9 / (1 + 99 / T) are expected of three trials: T = 148.5."""
    squares = {"a": 2.4, "b": 1.2, "c": 1.8}
    asked: list[Any] = []

    def told_of(problem: Any, one: Trial, out: Any, settings: Any, sigma: np.ndarray) -> _Missed:
        asked.append((problem.loss.sigma, one.name, out.name, sigma.tolist()))
        return missed([squares[one.name]], [0.0], [[3.0]], [99.0])

    monkeypatch.setattr(weighing, "_told", told_of)
    monkeypatch.setattr(weighing, "scales", lambda problem: "scales of all")
    monkeypatch.setattr(weighing, "density_of", lambda fit, problem, settings: None)
    monkeypatch.setattr(weighing, "white", lambda fit, problem, settings: {"x": 0.5, "r": 0.1})

    @dataclass(frozen=True)
    class Loss:
        sigma: Any = None

    @dataclass(frozen=True)
    class Whole:
        trials: tuple[Trial, ...]
        loss: Loss
        ship: Any

    ship = SimpleNamespace(model=SimpleNamespace(motion=("x", "u", "r")))
    problem: Any = Whole(tuple(trial(name) for name in "abc"), Loss(), ship)
    parts_of = (("1", "ab"), ("2", "c"))
    outs: Any = [SimpleNamespace(name=one, trials=tuple(map(trial, names))) for one, names in parts_of]
    found = weighing.power(SimpleNamespace(diagnosis=None), problem, None, outs)  # type: ignore[arg-type]
    assert asked == [("scales of all", name, out, [0.5, 0.0, 0.1]) for out, names in parts_of for name in names]
    assert found.trials == 3
    assert found.factor == pytest.approx(99.0 / (9.0 / 5.4 - 1.0))
    assert found.errors == pytest.approx({name: one / 0.03 for name, one in squares.items()})
    assert found.left == pytest.approx(1.0)
    with pytest.raises(StudyError, match="2 trials are too few"):
        weighing.power(None, replace(problem, trials=problem.trials[:2]), None, outs)  # type: ignore[arg-type]
