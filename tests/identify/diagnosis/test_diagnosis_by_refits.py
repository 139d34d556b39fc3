"""Tests of a finished fit, of linear models: they say what a refit without a trial, or with a suspect, gives."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

import suzaku_turns
from seatrial.core.parameters import Free
from seatrial.data import Array
from seatrial.identify import StudyError
from seatrial.identify.diagnosis import diagnose
from seatrial.identify.diagnosis.apart import Beside, _copies, sigma_by_trial
from seatrial.identify.diagnosis.by_trial import Moments, Scores, contradictions, deviates, differing
from seatrial.identify.diagnosis.channels import Channel
from seatrial.identify.diagnosis.findings import Diagnosis, Suspicion
from seatrial.identify.diagnosis.linear import Linear
from seatrial.identify.posterior import information
from seatrial.identify.trajectory.gauss_newton import Block, Normal
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.identify.vector import Vector

TRIALS, ROWS, PARAMETERS = 5, 40, 3
NAMES, PATHS = tuple("abcde"), ("p", "q", "s")
CHANNELS = 2


class World:
    """Readings y = J p + noise of several trials, one lane each, and columns of suspects."""

    def __init__(self, seed: int = 1, suspects: int = 2, prior: float = 0.0) -> None:
        rng = np.random.default_rng(seed)
        self.J = rng.normal(size=(TRIALS, ROWS, PARAMETERS)) * [1.0, 30.0, 0.1]
        self.extra = rng.normal(size=(TRIALS, ROWS, suspects)) + self.J[:, :, :1]
        self.y = self.J @ [1.0, 0.1, -5.0] + rng.normal(size=(TRIALS, ROWS))
        self.prior = prior * np.array([[1.0, 5.0, 0.0], [5.0, 1e3, 0.0], [0.0, 0.0, 1e-2]])

    @property
    def A(self) -> Array:
        return np.einsum("tri,trj->ij", self.J, self.J) + self.prior

    @property
    def p(self) -> Array:
        return np.linalg.solve(self.A, np.einsum("tri,tr->i", self.J, self.y))

    @property
    def e(self) -> Array:
        return self.J @ self.p - self.y

    @property
    def sigma(self) -> Array:
        return np.sqrt(np.diag(np.linalg.inv(self.A)))

    def scores(self) -> Scores:
        gram = np.einsum("tri,trj->tij", self.J, self.J)
        return Scores(NAMES, np.einsum("tri,tr->ti", self.J, self.e), gram, gram, self.prior)

    def moments(self) -> Moments:
        whole = np.concatenate([self.J, self.extra], axis=2)
        gram = np.einsum("tri,trj->tij", whole, whole)
        return Moments(NAMES, gram, gram.copy(), np.einsum("tri,tr->ti", whole, self.e), np.linalg.inv(self.A),
                       float((self.e**2).sum()), self.e.size)

    def linear(self, trial: Any = None) -> Linear:
        """Rows are pairs of two channels."""
        e = self.e.reshape(TRIALS, ROWS // CHANNELS, CHANNELS)
        held, drawn = 0.1 * self.J[:, :, :2], np.zeros((TRIALS, ROWS, 0))
        columns = np.concatenate([self.J, self.extra, held, drawn], axis=2)
        return Linear.of(e, columns, (PARAMETERS, self.extra.shape[2], 2, 0), np.zeros(e.shape),
                         np.arange(TRIALS) if trial is None else trial, (self.prior, np.full(PARAMETERS, 1e9)))


def refitted(world: World, columns: Array) -> tuple[Array, Array, float]:
    """Estimates with these columns as further unknowns, (trials, rows, more); their covariance, and the cost."""
    whole = np.concatenate([world.J, columns], axis=2).reshape(-1, PARAMETERS + columns.shape[2])
    prior = np.zeros((whole.shape[1],) * 2)
    prior[:PARAMETERS, :PARAMETERS] = world.prior
    back = np.linalg.inv(whole.T @ whole + prior)
    found = back @ whole.T @ world.y.ravel()
    return found, back, float(((whole @ found - world.y.ravel()) ** 2).sum())


# Trials against each other


@pytest.mark.parametrize("prior", [0.0, 5.0])
def test_a_trial_left_out_moves_the_optimum_as_a_refit_without_it(prior: float) -> None:
    world = World(prior=prior)
    scores = world.scores()
    for k in range(TRIALS):
        keep = np.arange(TRIALS) != k
        other = World(prior=prior)
        other.J, other.y = world.J[keep], world.y[keep]
        np.testing.assert_allclose(scores.step(k), other.p - world.p, rtol=1e-8, atol=1e-12)
        rest = scores.without(k)
        assert rest.names == [name for i, name in enumerate(NAMES) if i != k]
        np.testing.assert_allclose(rest.score, np.einsum("tri,tr->ti", other.J, other.e), atol=1e-8)
        assert np.array_equal(rest.curvature, scores.curvature[keep])
        assert np.array_equal(rest.scatter, scores.scatter[keep])
        assert rest.prior is scores.prior


@pytest.mark.parametrize("prior", [0.0, 5.0])
def test_the_square_of_a_score_is_over_the_scatter_that_the_noise_gives_it(prior: float) -> None:
    """By propagation of unit noise through e = J p - y at the optimum, the prior known by its own noise."""
    world = World(prior=prior)
    chi, freedom = world.scores().squares()
    flat, back = world.J.reshape(-1, PARAMETERS), np.linalg.inv(world.A)
    root = np.linalg.cholesky(world.prior) if prior else np.zeros((PARAMETERS, PARAMETERS))
    sources = np.hstack([flat @ back @ flat.T - np.eye(len(flat)), flat @ back @ root])
    for k in range(TRIALS):
        mine = sources[k * ROWS : (k + 1) * ROWS]
        spread = world.J[k].T @ mine @ mine.T @ world.J[k]
        g = world.scores().score[k]
        assert chi[k] == pytest.approx(g @ np.linalg.inv(spread) @ g, rel=1e-6)
        assert freedom[k] == PARAMETERS


def test_a_direction_that_no_trial_has_counts_as_no_freedom() -> None:
    world = World()
    world.J[:, :, 2] = 0.0
    gram = np.einsum("tri,trj->tij", world.J, world.J)
    world_e = world.y - world.J @ np.linalg.lstsq(world.J.reshape(-1, 3), world.y.ravel(), rcond=None)[0]
    found = Scores(NAMES, np.einsum("tri,tr->ti", world.J, -world_e), gram, gram, np.zeros((3, 3)))
    chi, freedom = found.squares()
    assert freedom.tolist() == [2.0] * TRIALS
    assert np.isfinite(chi).all()


def test_chi_squares_become_deviates_of_the_same_chance() -> None:
    """Wilson and Hilferty's cube root is within some hundredths of a deviate of the exact tail."""
    for freedom in (5.0, 10.0, 40.0):
        for chance in (0.9, 0.3, 0.05, 1e-3):
            chi = stats.chi2.isf(chance, freedom)
            assert deviates(chi, freedom) == pytest.approx(stats.norm.isf(chance), abs=0.05)
    assert deviates(10.0, 10.0) == pytest.approx(math.sqrt(2.0 / 90.0), rel=1e-12)


def test_the_trial_of_another_ship_is_named_with_what_the_others_ask_for() -> None:
    world = World(3)
    world.y[2] += world.J[2] @ [2.0, 0.05, 9.0]
    scores, sigma = world.scores(), world.sigma
    found = contradictions(scores, PATHS, sigma)
    chi, freedom = scores.squares()
    assert len(found) == 4
    first = found[0]
    assert (first.trial, first.freedom) == ("c", 3)
    assert [one.removes for one in found] == sorted((one.removes for one in found), reverse=True)
    assert first.chi == pytest.approx(chi[2])
    assert first.deviates == pytest.approx(deviates(chi[2], 3.0))
    assert first.alone
    assert first.matters
    keep = np.arange(TRIALS) != 2
    other = World(3)
    other.J, other.y = world.J[keep], world.y[keep]
    for path, by, sd in zip(PATHS, other.p - world.p, sigma, strict=True):
        assert first.moves[path] == pytest.approx(by / sd, rel=1e-6)
    rest, expected = other_squares(other)
    excess = np.maximum(chi - freedom, 0.0).sum()
    assert first.removes == pytest.approx(1.0 - np.maximum(rest - expected, 0.0).sum() / excess, rel=1e-6)
    assert first.together == pytest.approx(deviates(0.8 * chi.sum(), 0.8 * 15.0))
    assert contradictions(Scores(NAMES[:2], scores.score[:2], scores.curvature[:2], scores.scatter[:2], scores.prior),
                          PATHS, sigma) == ()


def other_squares(world: World) -> tuple[Array, Array]:
    gram = np.einsum("tri,trj->tij", world.J, world.J)
    return Scores(NAMES, np.einsum("tri,tr->ti", world.J, world.e), gram, gram, world.prior).squares()


# An error of one trial, or by trial


def suspicion(world: World, name: str = "bias.psi", at: int = 0, drop: float = 0.0, share: float = 0.0) -> Suspicion:
    return Suspicion(name, name, "deg", 1.0, drop, share, 0.0, 1.0, {})


def test_an_error_of_one_trial_alone_is_what_a_refit_with_it_gives() -> None:
    world = World(5)
    world.y[3] += 3.0 * world.extra[3, :, 1]
    moments, sigma = world.moments(), world.sigma
    tested = (suspicion(world, "other"), suspicion(world))
    one = differing(moments, tested, ["other", "bias.psi"], PATHS, sigma)[0]
    assert list(one.each) == ["d"]
    assert (one.words, one.numbers) == ("bias.psi", 1)
    column = np.zeros((TRIALS, ROWS, 1))
    column[3, :, 0] = world.extra[3, :, 1]
    found, back, cost = refitted(world, column)
    assert one.each["d"].size == pytest.approx(found[-1], rel=1e-8)
    assert one.each["d"].sigma == pytest.approx(math.sqrt(back[-1, -1]), rel=1e-8)
    assert one.drop == pytest.approx(found[-1] ** 2 / back[-1, -1], rel=1e-8)
    assert one.share == pytest.approx(1.0 - cost / moments.cost, rel=1e-8)
    for path, by, sd in zip(PATHS, found[:3] - world.p, sigma, strict=True):
        assert one.moves[path] == pytest.approx(by / sd, rel=1e-7)


def test_an_error_that_differs_by_trial_is_what_a_refit_with_a_number_for_each_gives() -> None:
    world = World(7)
    for k, size in enumerate((2.0, -2.0, 1.5, -1.5, 1.0)):
        world.y[k] += size * world.extra[k, :, 0]
    moments, sigma = world.moments(), world.sigma
    (one,) = differing(moments, (suspicion(world),), ["bias.psi", "other"], PATHS, sigma)
    columns = np.zeros((TRIALS, ROWS, TRIALS))
    for k in range(TRIALS):
        columns[k, :, k] = world.extra[k, :, 0]
    found, back, cost = refitted(world, columns)
    assert list(one.each) == list(NAMES)
    for k, name in enumerate(NAMES):
        assert one.each[name].size == pytest.approx(found[3 + k], rel=1e-7)
        assert one.each[name].sigma == pytest.approx(math.sqrt(back[3 + k, 3 + k]), rel=1e-7)
    more = found[3:]
    assert one.drop == pytest.approx(more @ np.linalg.solve(back[3:, 3:], more), rel=1e-7)
    assert one.share == pytest.approx(1.0 - cost / moments.cost, rel=1e-7)
    for path, by, sd in zip(PATHS, found[:3] - world.p, sigma, strict=True):
        assert one.moves[path] == pytest.approx(by / sd, rel=1e-6)
    # one number for all that explains nearly as much is preferred
    assert not differing(moments, (suspicion(world, drop=one.drop - 20.0),), ["bias.psi"], PATHS, sigma)
    assert not differing(moments, (suspicion(world, share=0.6 * one.share),), ["bias.psi"], PATHS, sigma)
    assert differing(moments, (suspicion(world, share=0.45 * one.share),), ["bias.psi"], PATHS, sigma)
    two = Moments(NAMES[:2], moments.gram[:2], moments.scatter[:2], moments.slope[:2], moments.back, moments.cost, 80)
    assert not differing(two, (suspicion(world),), ["bias.psi"], PATHS, sigma)


@pytest.mark.parametrize(("first", "rest", "alone"), [
    (60.0, 5.7, True), (60.0, 5.9, False), (1000.0, 100.0, True), (1000.0, 130.0, False),
])  # fmt: skip
def test_one_trial_has_it_alone_by_schwarz_or_where_it_explains_four_fifths(
    first: float, rest: float, alone: bool
) -> None:
    """Drops of three trials, each by itself; of 1000 rows a number costs ln 1000, and which of three 2 ln 3.

    Alone: 60 - 6.91 - 2.20 = 50.9 against 60 + 2 x 5.7 - 3 x 6.91 = 50.7; or four fifths of the whole.
    """
    gram = np.tile(np.diag([1.0, 100.0]), (3, 1, 1))
    slope = np.column_stack([np.zeros(3), 10.0 * np.sqrt([first, rest, rest])])
    moments = Moments(NAMES[:3], gram, gram, slope, np.eye(1), 50.0, 1000)
    one = Suspicion("bias.psi", "a bias", "deg", 1.0, 0.0, 0.0, 0.0, 1.0, {})
    (found,) = differing(moments, (one,), ["bias.psi"], PATHS[:1], np.ones(1))
    assert list(found.each) == (["a"] if alone else list("abc"))
    assert found.drop == pytest.approx(first if alone else first + 2.0 * rest)
    assert found.each["a"].size == pytest.approx(-math.sqrt(first) / 10.0)


def test_noise_alone_differs_in_no_trial_and_scatter_widens() -> None:
    for seed in range(20):
        world = World(seed)
        assert not differing(world.moments(), (suspicion(world),), ["bias.psi"], PATHS, world.sigma)
    world = World(5)
    world.y[3] += 3.0 * world.extra[3, :, 1]
    moments = world.moments()
    wide = Moments(moments.names, moments.gram, 4.0 * moments.scatter, moments.slope, moments.back, moments.cost,
                   moments.rows)
    tested = (suspicion(world),)
    (plain,), (one,) = (differing(m, tested, ["x", "bias.psi"], PATHS, world.sigma) for m in (moments, wide))
    assert one.each["d"].sigma == pytest.approx(2.0 * plain.each["d"].sigma)
    assert one.each["d"].size == pytest.approx(plain.each["d"].size)
    assert one.drop == pytest.approx(plain.drop / 4.0)


# The fit, linearised


def test_products_are_those_of_all_rows_by_trial_and_channel() -> None:
    world = World(2, prior=3.0)
    linear = world.linear()
    whole = np.concatenate([world.J, world.extra], axis=2)
    np.testing.assert_allclose(linear.A, world.A)
    np.testing.assert_allclose(linear.gram(), np.einsum("tri,trj->ij", world.J, whole))
    size = np.array([2.0, 5.0])
    weight = np.tile(size, ROWS // 2)
    np.testing.assert_allclose(linear.gram(size), np.einsum("r,tri,trj->ij", weight, world.J, whole))
    for k in range(TRIALS):
        for c in range(CHANNELS):
            own, every = world.J[k, c::2], whole[k, c::2]
            np.testing.assert_allclose(linear.products[k, c], own.T @ every)
            np.testing.assert_allclose(linear.squares[k, c], (world.extra[k, c::2] ** 2).sum(axis=0))
    grouped = world.linear(np.array([4, 4, 2, 2, 2]))
    assert grouped.trials == [2, 4]
    np.testing.assert_allclose(grouped.products[1], linear.products[:2].sum(axis=0))
    np.testing.assert_allclose(grouped.squares[0], linear.squares[2:].sum(axis=0))
    other = linear.testing(world.extra[:, :, ::-1], linear.extra_slope[:, ::-1])
    np.testing.assert_allclose(linear.extra_slope, np.einsum("trk,tr->tk", world.extra, world.e))
    np.testing.assert_allclose(other.squares, linear.squares[:, :, ::-1])
    np.testing.assert_allclose(other.gram()[:, :3], linear.gram()[:, :3])
    assert other.A is linear.A
    np.testing.assert_allclose(linear.mixed(linear.J, linear.held), 0.1 * (world.A - world.prior)[:, :2])


def test_a_suspect_is_what_a_refit_with_it_gives() -> None:
    world = World(4)
    world.y += 0.4 * world.extra[:, :, 1]
    linear, problem = world.linear(), SimpleNamespace(vector=SimpleNamespace(paths=PATHS))
    known = [SimpleNamespace(name=n, words=n, unit="deg", per=2.0, of_reading=n == "y", most=np.inf)
             for n in ("x", "y")]  # fmt: skip
    covariance = np.linalg.inv(world.A)
    for size in (np.ones(2), np.full(2, 3.0)):
        tested = diagnose._suspicions(linear, size, known, size[0] * covariance, problem)  # type: ignore[arg-type]
        assert [one.drop for one in tested] == sorted((one.drop for one in tested), reverse=True)
        assert tested[0].name == "y"
        for one in tested:
            found, back, cost = refitted(world, world.extra[:, :, :1] if one.name == "x" else world.extra[:, :, 1:])
            assert one.size == pytest.approx(found[-1], rel=1e-8)
            assert one.sigma == pytest.approx(math.sqrt(size[0] * back[-1, -1]), rel=1e-8)
            assert one.drop == pytest.approx(found[-1] ** 2 / back[-1, -1] / size[0], rel=1e-8)
            assert one.share == pytest.approx(1.0 - cost / float((world.e**2).sum()), rel=1e-8)
            assert (one.unit, one.per, one.of_reading) == ("deg", 2.0, one.name == "y")
            for path, by, sd in zip(PATHS, found[:3] - world.p, world.sigma, strict=True):
                assert one.moves[path] == pytest.approx(by / sd / math.sqrt(size[0]), rel=1e-6)
    same = world.linear()
    copy = same.testing(world.J[:, :, :1], same.slope[:, :1])
    assert diagnose._suspicions(copy, np.ones(2), known[:1], covariance, problem) == ()  # type: ignore[arg-type]


def test_a_vector_is_freed_with_both_components() -> None:
    world = World(6)
    world.y += 0.5 * world.extra[:, :, 0] - 0.3 * world.extra[:, :, 1]
    problem = SimpleNamespace(vector=SimpleNamespace(paths=PATHS))
    known = [SimpleNamespace(name=f"current.{n}", words=n, unit="m/s", per=1.0, of_reading=False, most=np.inf)
             for n in ("north", "east")]  # fmt: skip
    tested = diagnose._suspicions(world.linear(), np.ones(2), known, np.linalg.inv(world.A),
        problem)  # type: ignore[arg-type]
    found, *_ = refitted(world, world.extra)
    for one in tested:
        for path, by, sd in zip(PATHS, found[:3] - world.p, world.sigma, strict=True):
            assert one.moves[path] == pytest.approx(by / sd, rel=1e-6)


def test_covariance_of_channels_of_other_noise_is_the_sandwich() -> None:
    world = World(8, prior=2.0)
    size = np.array([0.5, 4.0])
    weight = np.tile(size, ROWS // 2)
    back = np.linalg.inv(world.A)
    meat = np.einsum("r,tri,trj->ij", weight, world.J, world.J) + world.prior
    np.testing.assert_allclose(diagnose._covariance(world.linear(), size), back @ meat @ back, rtol=1e-8)


def test_noise_of_the_inputs_adds_the_scatter_of_its_draws() -> None:
    world, rng = World(9), np.random.default_rng(0)
    draws = rng.normal(size=(TRIALS, ROWS, 7))
    linear = replace(world.linear(), drawn=draws)
    moves = np.linalg.inv(world.A) @ np.einsum("tri,trk->ik", world.J, draws)
    np.testing.assert_allclose(diagnose._by_inputs(linear), moves @ moves.T / 7, rtol=1e-8)
    left = draws - world.J @ moves
    np.testing.assert_allclose(diagnose._left(linear), left, atol=1e-9)
    # The score of a suspect scatters by them too.
    problem = SimpleNamespace(vector=SimpleNamespace(paths=PATHS))
    known = [SimpleNamespace(name="x", words="x", unit="", per=1.0, of_reading=False, most=np.inf)]
    (one,) = diagnose._suspicions(linear, np.ones(2), known, np.eye(3), problem)  # type: ignore[arg-type]
    own = world.extra[:, :, 0] - world.J @ np.linalg.solve(world.A, np.einsum("tri,tr->i", world.J, world.extra[:, :,
        0]))
    curvature = float((own**2).sum())
    spread = curvature + float((np.einsum("tr,trk->k", own, draws) ** 2).sum()) / 7
    assert one.sigma == pytest.approx(math.sqrt(spread) / curvature, rel=1e-8)


def test_moments_are_those_of_the_trials() -> None:
    world, rng = World(2), np.random.default_rng(0)
    draws = rng.normal(size=(TRIALS, ROWS, 4))
    linear = replace(world.linear(), drawn=draws)
    problem: Any = SimpleNamespace(trials=[SimpleNamespace(name=name) for name in NAMES])
    size = np.array([2.0, 3.0])
    found, wanted = diagnose._moments(linear, size, problem), world.moments()
    n = PARAMETERS
    np.testing.assert_allclose(found.gram[:, :n, :], wanted.gram[:, :n, :], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.gram[:, n:, :n], wanted.gram[:, n:, :n], rtol=1e-9, atol=1e-9)
    for k in (n, n + 1):
        np.testing.assert_allclose(found.gram[:, k, k], wanted.gram[:, k, k])
    np.testing.assert_allclose(found.slope, wanted.slope, atol=1e-9)
    np.testing.assert_allclose(found.back, wanted.back)
    assert (found.names, found.rows) == (list(NAMES), wanted.rows)
    assert found.cost == pytest.approx(wanted.cost)
    weight = np.tile(size, ROWS // 2)
    for k in range(TRIALS):
        moved = world.J[k].T @ draws[k] / 2.0
        scatter = np.einsum("r,ri,rj->ij", weight, world.J[k], world.J[k]) + moved @ moved.T
        np.testing.assert_allclose(found.scatter[k, :n, :n], scatter, rtol=1e-9)


def channel(**changes: Any) -> Channel:
    return Channel(**{"noise": 1.0, "size": 1.0, "alike": 0.0, "alike_sigma": 0.01, "lasting": 1.0, "count": 100,
        **changes})


def test_sigma_is_widened_to_the_scatter_of_windows_and_trials_and_by_the_likeliest_cause() -> None:
    world = World(11)
    trial = np.array([0, 0, 0, 1, 1])
    linear, A = world.linear(trial), np.linalg.inv(world.A)
    vector = Vector(tuple(Free(path, 0.0) for path in PATHS))
    bad = {"x": channel(size=9.0)}
    assert diagnose._widened(linear, A, trial, Diagnosis({"x": channel()}), vector) == (A, 0.0)
    wide, form = diagnose._widened(linear, A, trial, Diagnosis(bad), vector)
    assert form == 0.0, "two trials of a right form"
    one = np.zeros(TRIALS, dtype=int)
    alone, none = diagnose._widened(world.linear(one), A, one, Diagnosis(bad), vector)
    assert none == 0.0
    assert np.sum(np.diag(alone) / np.diag(A)) < 6.0, "one trial has no scatter of trials"
    windows, trials = (linear.by_groups(group)[0] for group in (np.arange(TRIALS), trial))
    for way in np.random.default_rng(1).standard_normal((50, 3)) / np.sqrt(np.diag(world.A)):
        variance = [float(way @ C @ way) for C in (wide, A, windows, trials)]
        assert variance[0] >= (1.0 - 1e-9) * max(variance[1:]), "no combination is surer than any of the three has it"
    assert np.array_equal(A, np.linalg.inv(world.A))
    other = World(11)  # what all windows of a trial ask alike shows between trials only
    other.y += 0.5 * other.J[:, :, 0] * np.array([1.0, 1.0, 1.0, -1.5, -1.5])[:, None]
    apart = other.linear(trial)
    by_trial, by_window = (apart.by_groups(group)[0][0, 0] for group in (trial, np.arange(TRIALS)))
    assert by_trial > 1.5 * by_window
    assert diagnose._widened(apart, A, trial, Diagnosis(bad), vector)[0][0, 0] >= (1.0 - 1e-9) * by_trial
    cause = Suspicion("a", "a", "m", 1.0, 100.0, 0.5, 1.0, 0.1, dict(zip(PATHS, (3.0, -2.0, 0.0), strict=True)))
    more, _ = diagnose._widened(linear, A, trial, Diagnosis(bad, (cause, cause)), vector)
    shift = np.sqrt(np.diag(A)) * [3.0, -2.0, 0.0]
    np.testing.assert_allclose(more, wide + np.outer(shift, shift), rtol=1e-8)
    # a prior knows more than residuals that disagree, of each parameter and of each combination
    reach = np.sqrt(np.diag(A)) * [1.2, 0.5, 99.0]
    less, _ = diagnose._widened(replace(linear, reach=reach), A, trial, Diagnosis(bad, (cause, cause)), vector)
    assert np.all(np.diag(less) <= (1.0 + 1e-9) * reach**2)
    assert np.linalg.eigvalsh(np.eye(3) - less / np.outer(reach, reach))[0] > -1e-9


def test_scores_that_overflow_widen_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search without bounds may end where derivatives are 1e200; their squares are no scatter."""
    world, trial = World(11), np.array([0, 0, 0, 1, 1])
    linear, A = world.linear(trial), np.linalg.inv(world.A)
    bad, vector = Diagnosis({"x": channel(size=9.0)}), Vector(tuple(Free(path, 0.0) for path in PATHS))
    for wrong in (np.inf, np.nan):
        monkeypatch.setattr(Linear, "by_groups", lambda self, group, wrong=wrong: (np.full_like(A, wrong), wrong))
        wide, form = diagnose._widened(linear, A, trial, bad, vector)
        np.testing.assert_allclose(wide, A, rtol=1e-9)
        assert form == 0.0


@pytest.mark.slow
def test_a_covariance_that_overflows_gives_no_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    told = suzaku_turns.problem()
    sound = Trajectory(method="euler", initial="measured").fit(told)
    assert any(one.status in ("identified", "graded") for one in sound.verdicts)
    count = len(told.free)
    monkeypatch.setattr(diagnose, "_tests", lambda *_: (np.full((count, count), np.inf), (), (), ()))
    found = Trajectory(method="euler", initial="measured").fit(told)
    assert not any(one.status == "identified" for one in found.verdicts)
    assert any("blow up" in one.text for one in found.verdicts)


@pytest.mark.parametrize(("noise", "each"), [(1.0, np.arange(TRIALS)), (4.0, np.arange(TRIALS)),
                                             (4.0, np.array([0, 1, 0, 1, 0]))])  # fmt: skip
def test_few_trials_widen_all_that_data_fix_by_students_t_and_by_what_trials_scatter_together(
    noise: float, each: Array
) -> None:
    """Of a form that fits none of the trials by as much again, the share is told; residuals of noise alone have none.

    Args:
        noise: variance of the residuals, which the covariance counts.
        each: trial of each window.
    """
    few = (stats.t.ppf(0.975, len(set(each))) / stats.norm.ppf(0.975)) ** 2
    vector = Vector(tuple(Free(path, 0.0) for path in PATHS))
    bad = Diagnosis({"x": channel(size=9.0)})
    for apart in (0.0, 9.0):
        world = World(31, prior=5.0)
        world.y = world.J @ [1.0, 0.1, -5.0] + np.sqrt(noise) * np.random.default_rng(4).normal(size=world.y.shape)
        # every second trial asks for other numbers, by so many sigma of what one trial knows of each
        world.y += apart * np.sqrt(noise / ROWS) * world.J @ (1.0 / world.J.std(axis=(0, 1))) * (-1.0) ** each[:, None]
        linear, data = world.linear(each), world.A - world.prior
        back = np.linalg.inv(world.A)
        covariance = back @ (noise * data + world.prior) @ back
        wide, form = diagnose._widened(linear, covariance, each, bad, vector)
        times = linear.by_groups(each)[1] / noise
        counted = np.sum(covariance * data) / np.sum(back * data)
        least = np.linalg.inv(world.prior + data / (few * max(noise * times, counted)))
        for way in np.random.default_rng(1).standard_normal((50, 3)) / np.sqrt(np.diag(world.A)):
            assert float(way @ wide @ way) >= (1.0 - 1e-9) * float(way @ least @ way)
        assert form == pytest.approx(max(1.0 - few * counted / (noise * times), 0.0), rel=1e-9)
        assert (form > 0.5) == (apart > 0.0)
        assert diagnose._widened(linear, covariance, each, Diagnosis({"x": channel()}), vector)[1] == 0.0


def test_what_no_trial_tells_does_not_count_as_noise_of_those_that_do() -> None:
    """Two parameters of which only the sum acts: their difference is as wide as it can be, and nothing else is."""
    vector, each = Vector(tuple(Free(path, 0.0) for path in PATHS)), np.arange(TRIALS)
    world = World(31)
    world.J[:, :, 2] = world.J[:, :, 0] * (1.0 + 1e-9 * np.random.default_rng(1).normal(size=world.J.shape[:2]))
    world.y = world.J @ [1.0, 0.1, -5.0] + np.random.default_rng(4).normal(size=world.y.shape)
    columns = np.concatenate([world.J, world.extra], axis=2)
    e = (world.J @ (np.linalg.pinv(world.J.reshape(-1, 3), rcond=1e-7) @ world.y.ravel()) - world.y)
    rows = (TRIALS, ROWS // CHANNELS, CHANNELS)
    linear = Linear.of(e.reshape(rows), columns, (PARAMETERS, columns.shape[2] - PARAMETERS, 0, 0), np.zeros(rows),
                       each, (world.prior, np.full(PARAMETERS, 1e7)))  # fmt: skip
    covariance = information.covariance(linear.A, linear.reach)
    assert covariance[0, 0] > 1e13
    wide, form = diagnose._widened(linear, covariance, each, Diagnosis({"x": channel(size=9.0)}), vector)
    assert form == 0.0
    assert wide[1, 1] < 10.0 * covariance[1, 1], "the second is as well known as before, but for so few trials"


@pytest.mark.slow
def test_residuals_that_are_alike_within_a_trial_leave_the_scatter_of_trials_right() -> None:
    """Refits with new noise, half of it one number a trial and column: their scatter, by trials and as if white."""
    found, told, white = list[Array](), list[Array](), list[Array]()
    for seed in range(200):
        rng, world = np.random.default_rng(seed), World(seed=21)
        world.y = world.J @ [1.0, 0.1, -5.0] + rng.normal(size=world.y.shape)
        world.y += np.einsum("trk,tk->tr", world.J / world.J.std(axis=(0, 1)), 0.5 * rng.normal(size=(TRIALS, 3)))
        found.append(world.p)
        told.append(np.diag(world.linear().by_groups(np.arange(TRIALS))[0]))
        white.append(np.diag(np.linalg.inv(world.A)))
    scatter = np.var(found, axis=0)
    # two hundred refits know a variance to a tenth
    np.testing.assert_allclose(np.mean(told, axis=0) / scatter, 1.0, atol=0.3)
    assert np.all(np.mean(white, axis=0) / scatter < 0.2)


def test_fixed_parameters_move_the_free_ones_by_their_error() -> None:
    """`held` is the change by a tenth of the value: a refit with the change taken off the readings."""
    world = World(12)
    linear = world.linear()
    vector = Vector(tuple(Free(path, 0.0) for path in PATHS))
    entries = {"m": SimpleNamespace(sigma=0.5)}
    problem: Any = SimpleNamespace(vector=vector, ship=SimpleNamespace(entries=entries))
    fixed = {"m": -2.0, "d": 4.0}
    covariance = np.linalg.inv(world.A)
    found = diagnose._influence(Diagnosis(), linear, fixed, covariance, problem)
    moved = {}
    for k, (path, share) in enumerate((("m", 0.25), ("d", 0.1))):
        flat = world.J.reshape(-1, 3)
        change = share / 0.1 * linear.held[:, :, k].ravel()
        moved[path] = np.linalg.lstsq(flat, world.y.ravel() - change, rcond=None)[0] - world.p
    assert found.shares == {"m": 0.25, "d": 0.1}
    rows = {path: (free, by) for path, free, by in found.fixed}
    assert [abs(by) for _, _, by in found.fixed] == sorted((abs(by) for _, _, by in found.fixed), reverse=True)
    for path, by in moved.items():
        relative = by / world.sigma
        at = int(np.argmax(np.abs(relative)))
        assert rows[path] == (PATHS[at], pytest.approx(relative[at], rel=1e-6))
    for path, by in zip(PATHS, moved["m"] / world.sigma, strict=True):
        assert found.carried[path] == pytest.approx(abs(by), rel=1e-6, abs=1e-9)
    many = diagnose._influence(Diagnosis(), replace(linear, held=np.tile(linear.held[:, :, :1], 8)),
                               {f"f{k}": 1.0 for k in range(8)}, covariance, problem)
    assert len(many.fixed) == len(many.shares) == 5
    assert many.carried == {}


def test_errors_that_were_estimated_have_the_drop_of_a_wald_test() -> None:
    common = tuple(SimpleNamespace(name=n, words=n, unit="deg", per=0.1, of_reading=False) for n in ("x", "y"))
    objective: Any = SimpleNamespace(count=2, common=common)
    found = diagnose._errors(objective, np.array([9.0, 9.0, 3.0, -4.0]), np.diag([1.0, 1.0, 4.0, 0.25]))
    assert [(one.name, one.size, one.sigma, one.drop) for one in found] == [("x", 3.0, 2.0, 2.25), ("y", -4.0, 0.5,
        64.0)]


def test_part_of_many_trials_is_tested_at_even_distances() -> None:
    def trials(count: int, rows: int) -> Any:
        return tuple(range(rows)[:rows] for _ in range(count))

    assert len(diagnose._enough(trials(10, 1000))) == 10
    assert len(diagnose._enough(trials(40, 1000))) == 20
    assert len(diagnose._enough(trials(12, 50_000))) == 12
    assert len(diagnose._enough(trials(16, 50_000))) == 8
    assert len(diagnose._enough(trials(100, 6_000))) == 9


def test_long_predictions_move_a_regression_by_the_step_to_their_optimum_within_reach() -> None:
    world = World(13)
    vector = Vector((Free("p", 1.0, prior=1.0, sigma=0.5), Free("q", 0.1), Free("s", -5.0)))
    at = world.p + np.array([0.02, 0.001, 0.3])
    e = (world.J @ at - world.y).reshape(TRIALS, ROWS // CHANNELS, CHANNELS)
    slope = np.einsum("tri,tr->ti", world.J, e.reshape(TRIALS, ROWS))
    linear = replace(world.linear(), slope=slope, A=world.A + np.diag([4.0, 0.0, 0.0]))
    objective: Any = SimpleNamespace(problem=SimpleNamespace(vector=vector), count=3)
    fit: Any = SimpleNamespace(sigma=np.array([0.1, 0.01, 1.0]), covariance=np.eye(3))
    found, spread = diagnose._pulled(Diagnosis(), linear, at, objective, fit)
    exact = np.linalg.solve(world.A + np.diag([4.0, 0.0, 0.0]),
                            np.einsum("tri,tr->i", world.J, world.y) + np.array([4.0, 0.0, 0.0]))
    step = exact - at
    for path, by, sd in zip(PATHS, step, fit.sigma, strict=True):
        assert found.pulled[path] == pytest.approx(by / sd, rel=1e-7)
    np.testing.assert_allclose(spread, np.eye(3) + np.outer(step, step))
    near = replace(linear, reach=np.full(3, 1e-3))
    cut, _ = diagnose._pulled(Diagnosis(), near, at, objective, fit)
    np.testing.assert_allclose(list(cut.pulled.values()), np.clip(step, -1e-3, 1e-3) / fit.sigma)


def test_residuals_of_a_channel_are_per_degree_of_freedom_and_over_the_noise() -> None:
    world = World(14)
    linear = world.linear()
    scale = np.full((TRIALS, ROWS // CHANNELS, CHANNELS), 4.0)
    cut = SimpleNamespace(scale=scale, dt=0.25, every=4)
    motion = ("u", "r")
    objective: Any = SimpleNamespace(windows=cut,
        problem=SimpleNamespace(ship=SimpleNamespace(model=SimpleNamespace(motion=motion))))
    found, size = diagnose._channels(objective, linear, {"u": 0.2, "r": 0.5})
    back, e = np.linalg.inv(world.A), linear.e
    for k, name in enumerate(motion):
        own = world.J[:, k::2].reshape(-1, 3)
        freedom = 100 - np.trace(back @ own.T @ own)
        square = float((e[:, :, k] ** 2).sum()) / freedom
        assert size[k] == pytest.approx(square)
        level = {"u": 0.2, "r": 0.5}[name]
        one = found[name]
        assert one.size == pytest.approx(math.sqrt(square) / (4.0 * level))
        product = float((e[:, 1:, k] * e[:, :-1, k]).sum()) / 95
        assert one.alike == pytest.approx(product / (float((e[:, :, k] ** 2).sum()) / 100))
        assert (one.noise, one.count, one.by_inputs) == (level, 100, 0.0)
        assert one.alike_sigma == pytest.approx(1.0 / math.sqrt(95))
    blind = scale.copy()
    blind[:, :, 1] = 0.0
    objective.windows = SimpleNamespace(scale=blind, dt=0.25, every=4)
    found, size = diagnose._channels(objective, linear, {"u": 0.2, "r": 0.5})
    assert list(found) == ["u"]
    assert size[1] == 1.0
    # what the noise of the inputs leaves is no fault of the model
    draws = np.random.default_rng(0).normal(size=(TRIALS, ROWS, 6))
    objective.windows = cut
    noisy = replace(linear, drawn=draws)
    left = diagnose._left(noisy).reshape(TRIALS, ROWS // 2, 2, 6)[:, :, 0]
    inputs = float((left**2).sum()) / 6 / (100 - np.trace(back @ world.J[:, ::2].reshape(-1, 3).T @ world.J[:,
        ::2].reshape(-1, 3)))
    both, reduced = diagnose._channels(objective, noisy, {"u": 0.2, "r": 0.5})
    assert both["u"].by_inputs == pytest.approx(math.sqrt(inputs) / 0.8)
    assert reduced[0] == pytest.approx(max(both["u"].size ** 2 * 0.64 - inputs, min(both["u"].size ** 2 * 0.64, 0.64)))
    within = float((left[:, 1:] * left[:, :-1]).sum()) / 6
    total = float((e[:, 1:, 0] * e[:, :-1, 0]).sum()) - within
    assert both["u"].alike == pytest.approx(total / 95 / (float((e[:, :, 0] ** 2).sum()) / 100))


def test_what_is_shown_estimated_and_fixed() -> None:
    def shown(*controls: str) -> str:
        return diagnose._shown(SimpleNamespace(ship=SimpleNamespace(model=SimpleNamespace(controls=controls))))  # type: ignore[arg-type]

    assert (shown("n_P", "delta"), shown("n_P", "n_S"), shown()) == ("delta", "n_P", "")
    own: Any = SimpleNamespace(nuisance=SimpleNamespace(bias={"u": 0.1}, current=0.2))
    told = [diagnose._estimated(name, own) for name in ("bias.u", "bias.r", "current.north", "scale.u")]
    assert told == [True, False, True, False]
    own.nuisance.current = 0.0
    assert not diagnose._estimated("current.north", own)


# Nuisance parameters beside the free ones


def arrow(seed: int = 0) -> tuple[Array, list[Block], Array]:
    """Hessian of two parameters, one common error, and of three trials with an initial state and two numbers each."""
    rng = np.random.default_rng(seed)
    blocks, sources = [], []
    top = rng.normal(size=(40, 3))
    whole = top.T @ top
    full = np.zeros((12, 12))
    for k in range(3):
        rows = rng.normal(size=(20, 6))
        H = rows.T @ rows
        whole += H[:3, :3]
        blocks.append(Block(np.arange(3 * k, 3 * k + 3)[None], H[None, 3:, 3:], H[None, 3:, :3], np.zeros((1, 3))))
        part = slice(3 + 3 * k, 6 + 3 * k)
        full[part, part], full[part, :3], full[:3, part] = H[3:, 3:], H[3:, :3], H[:3, 3:]
        sources.append(part)
    full[:3, :3] = whole
    return full, blocks, whole


def test_nuisances_beside_the_parameters_are_those_of_the_whole_covariance() -> None:
    full, blocks, whole = arrow()
    layout = SimpleNamespace(own=SimpleNamespace(count=2, names=("current_x", "bias_psi")))
    free = tuple(Free(path, 1.0) for path in ("p", "q"))
    objective: Any = SimpleNamespace(
        count=2, layout=layout, normal=lambda p, eta: Normal(0.0, whole, np.zeros(3), tuple(blocks)),
        before=lambda p: (np.zeros((3, 3)), np.full(3, 1e9)), information=np.zeros((3, 3)),
        problem=SimpleNamespace(vector=Vector(free)), common=(SimpleNamespace(name="offset.delta"),),
    )  # fmt: skip
    found = Beside.of(objective, np.zeros(3), np.zeros(9))
    exact = np.linalg.inv(full)
    assert found.names == ("offset.delta", "current_x of each trial", "bias_psi of each trial")
    for k in range(3):
        own = [3 + 3 * k + 1, 3 + 3 * k + 2]
        np.testing.assert_allclose(found.sigma[k], np.sqrt(np.diag(exact)[own]), rtol=1e-9)
    take = np.zeros((3, 12))
    take[0, 2] = 1.0
    for k in range(3):
        take[1, 3 + 3 * k + 1] = take[2, 3 + 3 * k + 2] = 1.0 / 3.0
    mixed, variance = (take @ exact)[:, :2], np.diag(take @ exact @ take.T)
    np.testing.assert_allclose(found.correlation, mixed / np.sqrt(np.outer(variance, np.diag(exact)[:2])), rtol=1e-9)
    assert sigma_by_trial(found, layout, ("a", "b", "c"))["b"]["bias_psi"] == pytest.approx(found.sigma[1,
        1])  # type: ignore[arg-type]
    strong = replace(found, correlation=np.array([[0.99, 0.2], [0.1, -0.97], [0.5, 0.94]]))
    told = {v.subject: v.text for v in strong.verdicts(("p", "q"))}
    assert list(told) == ["p and offset.delta", "q and current_x of each trial"]
    assert "correlation -0.970" in told["q and current_x of each trial"]


def test_an_error_that_is_a_copy_of_a_parameter_is_named_with_it() -> None:
    rng = np.random.default_rng(1)
    J = rng.normal(size=(50, 4)) * [1.0, 100.0, 1.0, 10.0]
    names = ("p", "q", "offset.delta", "bias.r")
    free = Normal(0.0, J.T @ J, np.zeros(4))
    assert _copies(free, names, 2) is None
    copy = J.copy()
    copy[:, 2] = 0.02 * J[:, 1]
    assert _copies(Normal(0.0, copy.T @ copy, np.zeros(4)), names, 2) == ("offset.delta", "q")
    copy[:, 2] = 0.3 * J[:, 3]
    assert set(_copies(Normal(0.0, copy.T @ copy, np.zeros(4)), names, 2) or ()) == {"offset.delta", "bias.r"}
    twins = J.copy()
    twins[:, 1] = 2.0 * J[:, 0]
    assert _copies(Normal(0.0, twins.T @ twins, np.zeros(4)), names, 2) is None, "two parameters are not its matter"
    copy = J.copy()
    copy[:, 3] = 0.0
    with pytest.raises(StudyError, match=r"insensitive to bias\.r"):
        _copies(Normal(0.0, copy.T @ copy, np.zeros(4)), names, 2)
