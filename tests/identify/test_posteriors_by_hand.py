"""Verdicts, profiles, draws and ranges by closed forms: thresholds from both sides, places and words."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from seatrial.belief import ensemble
from seatrial.belief.sampling.hamiltonian import Sampler, _refined
from seatrial.belief.sampling.sampled import Sampled
from seatrial.core.parameters import Free, read
from seatrial.identify import Fit, Issue, Problem, StudyError, Verdict
from seatrial.identify.diagnosis.findings import Diagnosis, Suspicion
from seatrial.identify.posterior import profile
from seatrial.identify.posterior.misfit import Misfit, Remainder, _remainder, _runs, correlated
from seatrial.identify.posterior.profile import Identifiability, Profile
from seatrial.identify.posterior.verdicts import _groups, capped, manoeuvre_for, overruled, removed, verdicts
from seatrial.identify.tuning import ranges
from seatrial.identify.tuning.ranges import Residuals, _starts, softened, within
from seatrial.identify.tuning.tuned import findings
from seatrial.identify.vector import Vector
from seatrial.ships.files import load

SHIP = load("kvlcc2_l7")


# Verdicts


@pytest.mark.parametrize(("sigma", "share", "status"), [
    (0.31, 0.95, "identified"), (0.32, 0.95, "weak"), (0.70, 0.95, "weak"), (0.71, 0.95, "not identified"),
    (0.01, 0.91, "identified"), (0.01, 0.89, "weak"), (0.01, 0.51, "weak"), (0.01, 0.49, "not identified"),
])  # fmt: skip
def test_a_verdict_is_the_stricter_of_prior_and_own_size(sigma: float, share: float, status: str) -> None:
    free = (Free("hull.Y_v", 1.0, prior=1.0, sigma=5.0),)
    (one,) = verdicts(free, np.array([1.0]), np.array([[sigma**2]]), np.array([share]), ())
    assert one.status == status
    bare = (Free("hull.Y_v", 1.0),)
    (own,) = verdicts(bare, np.array([1.0]), np.array([[sigma**2]]), np.array([0.0]), ())
    assert one.within == own.within == pytest.approx(1.96 * sigma)
    assert own.status == ("identified" if sigma < 0.316 else "weak" if sigma < 0.707 else "not identified")


def test_a_bound_counts_where_the_data_press_on_it() -> None:
    free = (Free("hull.Y_v", 1.0, 0.0, 2.0),)
    value, spread = np.array([2.0]), np.array([[1e-4]])
    for share, pressed, status in ((0.6, (), "at bound"), (0.4, (), "not identified"), (0.4, ("hull.Y_v",),
        "at bound")):
        (one,) = verdicts(free, value, spread, np.array([share]), ("hull.Y_v",), pressed)
        assert one.status == status
    assert "which the data do not ask for" in verdicts(free, value, spread, np.array([0.4]), ("hull.Y_v",))[0].text
    assert verdicts(free, value, spread, np.array([0.95]), ())[0].status == "identified"


def test_two_and_three_parameters_that_the_data_join_are_named() -> None:
    free = tuple(Free(f"hull.{n}", 1.0, prior=1.0, sigma=9.0) for n in "abcd")
    values, share = np.ones(4), np.full(4, 0.99)
    joined = 1e-4 * np.eye(4)
    for c, told in ((0.96, "rise and fall together"), (-0.96, "trade off against each other"), (0.94, "")):
        joined[0, 2] = joined[2, 0] = c * 1e-4
        pairs = verdicts(free, values, joined, share, ())[4:]
        assert [one.subject for one in pairs] == (["hull.a and hull.c"] if told else [])
        if told:
            assert told in pairs[0].text
            assert f"{c:+.3f}" in pairs[0].text
    # a + b + c is known to a hundredth of each; d is known by itself
    sum_of = np.array([1.0, 1.0, 1.0, 0.0]) / math.sqrt(3.0)
    covariance = np.diag([1.0, 1.0, 1.0, 0.01]) - 0.9999 * np.outer(sum_of, sum_of)
    (group,) = _groups(("a", "b", "c", "d"), covariance)
    assert group.subject == "a, b and c"
    assert _groups(("a", "b"), covariance[:2, :2]) == ()
    named = verdicts(free, values, covariance, np.full(4, 0.1), ())
    assert [one.subject for one in named[4:]] == ["hull.a, hull.b and hull.c"]


def test_what_the_data_removed_is_a_share_of_the_variance_before() -> None:
    free = (Free("a", 1.0, prior=1.0, sigma=0.5), Free("b", 1.0, 0.0, 2.0), Free("c", -3.0))
    values, covariance = np.array([1.0, 1.0, -4.0]), np.diag([0.05, 0.1, 4.0])
    found = removed(Vector(free), values, covariance)
    assert found == pytest.approx([1 - 0.05 / 0.25, 1 - 0.1 / (4.0 / 12.0), 1 - 4.0 / 16.0])
    assert removed(Vector(free), values, 99.0 * covariance).tolist() == [0.0, 0.0, 0.0]


def test_verdicts_are_capped_and_overruled() -> None:
    told = (Verdict("a", "identified", "x"), Verdict("b", "weak", "y"))
    lacking = Diagnosis(suspicions=(Suspicion("s", "s", "m", 1.0, 99.0, 0.5, 1.0, 0.1, {"a": 9.0}),))
    assert capped(told, None) == told == capped(told, Diagnosis())
    one, two = capped(told, lacking)
    assert (one.status, two) == ("graded", told[1])
    assert one.text == "x; by these trials, if the form of the model is right"
    # what is weak has a range too, which is no grade where it leaves the sign open
    wide, near = (capped((Verdict("b", "weak", "y", far),), lacking)[0] for far in (1.01, 0.6))
    assert (wide.status, near.status) == ("weak", "graded")
    assert near.text == "y; within 60 % by these trials, if the form of the model is right"
    fit = replace(example(), verdicts=told)
    found = overruled(fit, {"a": "no roll", "z": "no wind"}).verdicts
    assert [(v.subject, v.status) for v in found] == [("a", "not identified"), ("b", "weak"), ("z", "not identified")]
    assert found[0].text == "x; nevertheless: no roll"
    assert found[2].text == "held, not fitted: no wind"


def example() -> Fit:
    free = (Free("a", 1.0), Free("b", 2.0))
    return Fit(SHIP, free, np.ones(2), np.ones(2), np.eye(2), np.ones(2), (), (), np.zeros((0, 4)), 1.0, 1.0, 1, "", "")


@pytest.mark.parametrize(("path", "word"), [
    ("propeller.A_1", "sternway"), ("propeller.C_3", "stopping"), ("propeller.k_0", "coasting"), ("rudder.C_PR",
        "reversed"),
    ("rudder.a_H", "zigzags"), ("hull.X_0A", "astern"), ("hull.X_vv", "coupled"), ("hull.C_5", "crabbing"),
    ("hull.Y_v", "small and large"), ("body.m", "reversals"), ("wind.A_F", "drifting"), ("else.x", "more varied"),
])  # fmt: skip
def test_a_manoeuvre_that_would_help(path: str, word: str) -> None:
    assert word in manoeuvre_for(path)


# Profiles


def profiled(**changes: Any) -> Profile:
    given = {"free": Free("hull.Y_v", 5.0, 0.0, 10.0), "best": 5.0, "low": 0.0, "high": 10.0, "values": np.arange(3.0),
             "rise": np.zeros(3), "others": np.zeros((3, 1)), "interval": (4.0, 6.0), "closed": (True,
                 True)}  # fmt: skip
    return Profile(**{**given, **changes})


@pytest.mark.parametrize(("changes", "status"), [
    ({}, "identified"), ({"interval": (2.6, 7.5)}, "identified"), ({"interval": (2.4, 7.5)}, "weak"),
    ({"interval": (0.0, 10.0), "closed": (False, False)}, "not identified"),
    ({"interval": (0.0, 9.0), "closed": (False, True)}, "weak"), ({"loose": True}, "weak"),
    ({"closed": (False, False)}, "identified"), ({"best": 10.0}, "at bound"), ({"best": 0.0}, "at bound"),
    ({"best": 9.999}, "identified"), ({"best": 10.0 - 5e-6}, "at bound"), ({"best": 5e-6}, "at bound"),
])  # fmt: skip
def test_a_profile_tells_its_status(changes: Any, status: str) -> None:
    one = profiled(**changes)
    assert one.status == status == one.verdict.status
    assert one.verdict.subject == "hull.Y_v"


def test_a_profile_tells_its_interval_and_share() -> None:
    one = profiled()
    assert one.share == pytest.approx(0.2)
    assert one.verdict.text == "95 % interval 4 to 6, 20 % of the range"
    assert profiled(closed=(True, False)).verdict.text.endswith("up to the end of it")
    assert profiled(interval=(5.0, 5.123)).percent == "1.2 %"
    assert profiled(interval=(4.0, 5.0)).percent == "10 %"
    assert profiled(interval=(2.0, 8.0)).percent == "60 %"
    assert "trades off with others" in profiled(loose=True).verdict.text


def test_the_interval_of_a_parabola_is_two_roots_of_the_limit() -> None:
    """chi square 3.84 with sigma 1: 1.96 to either side, wherever the steps lie; the better of two optima is zero."""
    values = np.array([-3.2, -1.7, 0.0, 0.9, 2.9])
    for lift in (0.0, -0.5):
        one = profile._profile(Free("p", 0.0), 0.0, -5.0, 5.0, values, values**2 + lift, np.zeros((5, 1)), False)
        assert one.interval == pytest.approx((-stats.norm.ppf(0.975), stats.norm.ppf(0.975)),
            abs=1e-9 if not lift else 0.2)
        assert one.closed == (True, True)
    half = profile._profile(Free("p", 0.0), 0.0, -5.0, 5.0, values[2:], values[2:] ** 2, np.zeros((3, 1)), True)
    assert half.closed == (False, True)
    assert half.interval == pytest.approx((0.0, stats.norm.ppf(0.975)))
    assert half.loose
    lost = profile._profile(Free("p", 0.0), 0.0, -5.0, 5.0, values, np.array([math.inf, 1.0, 0.0, 1.0, math.inf]),
                            np.zeros((5, 1)), False)
    assert lost.interval == (-1.7, 0.9), "the last steps that are numbers"
    assert pytest.approx(stats.chi2.ppf(0.95, 1)) == profile.THRESHOLD


def test_combinations_name_the_parts_that_count() -> None:
    assert profile._parts(np.array([0.1, -1.0, 0.19, 0.21])) == [1, 3]
    one = profile._combination(("a", "b", "c"), np.array([0.4, -0.8, 0.01]), 0.4)
    assert one.subject == "b, a"
    assert "b +1.00, a -0.50" in one.text
    assert "40% of the box" in one.text
    assert "the whole box" in profile._combination(("a", "b"), np.ones(2), 1.1).text
    assert profile._combination(("a", "b"), np.array([0.01, 1.0]), 0.4).subject == "b"
    three = tuple(profiled(free=Free(n, 5.0, 0.0, 10.0)) for n in "abc")
    correlation = np.array([[1.0, -0.97, 0.5], [-0.97, 1.0, 0.94], [0.5, 0.94, 1.0]])
    known = Identifiability(three, correlation, np.eye(3), np.array([0.3, 0.24, 0.1]), 0.0, 10.0)
    told = known.verdicts
    assert [v.subject for v in told] == ["a", "b", "c", "a", "a and b"]
    assert "trade off" in told[-1].text
    assert told[3].text == "the data are insensitive to it"


# Residuals


@pytest.mark.slow
def test_residuals_that_last_count_as_fewer() -> None:
    rng = np.random.default_rng(0)
    alike, samples = 0.8, 60_000
    e = np.zeros(samples)
    for k in range(1, samples):
        e[k] = alike * e[k - 1] + rng.standard_normal()
    first, lasting = correlated([e], 0.02)
    assert first == pytest.approx(alike, abs=0.01)
    assert lasting == pytest.approx((1.0 + alike) / (1.0 - alike), rel=0.1)
    assert correlated([np.zeros(5)]) == (0.0, 1.0)
    one, other = np.array([1.0, 2.0, 3.0]), np.array([-1.0, 1.0])
    assert correlated([one, other])[0] == pytest.approx((2.0 + 6.0 - 1.0) / (14.0 + 2.0))
    assert correlated([one], longest=2)[1] == pytest.approx(1.0 + 2.0 * 8.0 / 14.0)


def test_remainders_are_those_of_white_noise_or_not() -> None:
    rng = np.random.default_rng(2)
    white = rng.standard_normal((6, 500)) * 1.3
    white[0, :100] = math.nan
    one = _remainder("u", white, 2)
    known = white[np.isfinite(white)]
    assert one.size == pytest.approx(math.sqrt(np.mean(known**2)))
    assert abs(one.correlation) < 4.0 / math.sqrt(2900)
    assert abs(one.runs) < 4.0
    assert one.samples == 2900 // 2
    a, b = white[1:, 2:], white[1:, :-2]
    total = (a * b).sum() + (white[0, 102:] * white[0, 100:-2]).sum()
    assert one.correlation == pytest.approx(total / (5 * 498 + 398) / one.size**2)
    # Wald and Wolfowitz: 4 above, 4 below, 2 runs where 5 are expected, variance 12/7
    assert _runs(np.array([[1.0, 1, 1, 1, -1, -1, -1, -1]])) == pytest.approx((2 - 5) / math.sqrt(4 * 3 / 7))
    assert _runs(np.ones((1, 9))) == pytest.approx((1 - 4.5) / math.sqrt(9 * 0.25))
    assert _runs(np.full((1, 3), math.nan)) == 0.0


@pytest.mark.parametrize(("changes", "count"), [
    ({}, 0), ({"size": 1.14}, 0), ({"size": 1.16}, 1), ({"correlation": 0.13}, 0), ({"correlation": 0.15}, 1),
    ({"runs": -3.9}, 0), ({"runs": -4.1}, 1), ({"size": 2.0, "runs": -9.0, "correlation": 0.5}, 3),
])  # fmt: skip
def test_a_remainder_warns(changes: Any, count: int) -> None:
    one = Remainder(**{"channel": "u", "size": 1.0, "correlation": 0.0, "runs": 0.0, "samples": 10_000, **changes})
    assert len(one.warnings) == count
    assert Misfit((one,)).lacking == (count > 0)
    assert len(Misfit((one,)).words) == 1 + count


# Draws


def sampled(draws: Any, **changes: Any) -> Sampled:
    draws = np.asarray(draws, dtype=float)
    n = draws.shape[2]
    given = {"free": tuple(Free(f"p_{k}", 0.0) for k in range(n)), "draws": draws, "density": np.zeros(draws.shape[:2]),
             "accepted": np.full(draws.shape[:2], 0.8), "divergent": 0, "best": np.zeros(n), "laplace": np.eye(n),
             "variance": 1.0, "tails": {}, "seconds": 1.0, "calls": 10, "digest": "d"}  # fmt: skip
    return Sampled(**{**given, **changes})


def test_draws_have_their_moments_beside_laplace() -> None:
    rng = np.random.default_rng(5)
    draws = rng.normal(size=(1000, 4, 2)) * [2.0, 0.5] + [1.0, -3.0]
    one = sampled(draws, laplace=np.diag([4.0, 1.0]), best=np.array([0.5, -3.0]))
    flat = draws.reshape(-1, 2)
    np.testing.assert_allclose(one.mean, flat.mean(axis=0))
    np.testing.assert_allclose(one.sigma, flat.std(axis=0, ddof=1))
    np.testing.assert_allclose(one.interval, np.quantile(flat, (0.025, 0.975), axis=0))
    np.testing.assert_allclose(one.shift, (flat.mean(axis=0) - [0.5, -3.0]) / [2.0, 1.0])
    np.testing.assert_allclose(one.ratio, flat.std(axis=0, ddof=1) / [2.0, 1.0])
    assert one.converged
    told = one.numbers()
    assert told["parameters"]["p_1"]["high_95"] == pytest.approx(np.quantile(flat[:, 1], 0.975))
    assert (told["draws"], told["chains"], told["accepted"]) == (4000, 4, pytest.approx(0.8))
    beside = one.words[1]
    assert beside.startswith("Laplace's approximation is off for 2 of 2 parameters; take the draws' intervals: "
                             "p_1 mean")


@pytest.mark.parametrize(("shift", "ratio", "holds"), [(0.0, 1.0, True), (0.2, 1.0, True), (0.3, 1.0, False),
                                                       (-0.3, 1.0, False), (0.0, 1.15, True), (0.0, 1.3, False),
                                                       (0.0, 0.87, True), (0.0, 0.75, False)])  # fmt: skip
def test_laplace_holds_within_a_quarter_and_a_fifth(shift: float, ratio: float, holds: bool) -> None:
    rng = np.random.default_rng(6)
    draws = rng.normal(size=(2000, 4, 1))
    draws = (draws - draws.mean()) / draws.std() * ratio + shift
    assert ("approximation holds" in sampled(draws).words[1]) == holds


@pytest.mark.slow
def test_draws_that_a_bound_cuts_or_a_ridge_joins_are_told() -> None:
    rng = np.random.default_rng(7)
    z = rng.normal(size=(1000, 4, 3))
    half, ridge = np.abs(z[:, :, :1]), z[:, :, 1:2]
    free = (Free("a", 1.0, 0.0, 9.0), Free("b", 1.0, -99.0, 99.0), Free("c", 1.0, -99.0, 99.0))
    one = sampled(np.concatenate([half, ridge, np.exp(ridge) + 0.01 * z[:, :, 2:]], axis=2), free=free,
        laplace=np.eye(3))
    assert one.cut == ("a",)
    assert sampled(-half, free=(Free("a", -1.0, -9.0, 0.0),)).cut == ("a",)
    assert sampled(half + 0.5, free=(Free("a", 1.0, 0.0, 9.0),)).cut == ()
    (line,) = [w for w in one.words if "ridge" in w]
    assert line.startswith("b and c lie on a ridge (rank correlation +")
    lost = sampled(z, divergent=30)
    assert "30 of 4000 moves were lost" in lost.words[1]
    assert not any("lost" in w for w in sampled(z, divergent=19).words)
    heavy = sampled(z, tails={"u": 2.1, "r": 1.9})
    assert "fourth moment: u 2.1 times" in heavy.words[-1]
    few = sampled(np.tile(z[:45, :1], (2, 4, 1)))
    assert "too few for intervals" in few.words[0]
    wanted = min(max(1.3 * 400.0 / few.effective.min(), 2.0), 20.0)
    assert f"draw {wanted:.0f} times as many" in few.words[0]
    apart = sampled(z[:200] + np.array([0.0, 0.0, 0.0, 3.0])[None, :, None])
    assert "do not agree" in apart.words[0]
    assert ", as far as these chains can tell" in apart.words[1]


def sampler(low: Any, high: Any, groups: int = 1, **changes: Any) -> Sampler:
    given = {"density": lambda x: (-0.5 * (x**2).sum(axis=1), -x), "low": np.array(low), "high": np.array(high),
        "warm": 30,
             "draws": 30, "seed": 1, "groups": np.zeros(2, dtype=np.intp)}  # fmt: skip
    return Sampler(**{**given, **changes})


def test_a_drift_goes_straight_and_reflects_at_bounds() -> None:
    free = sampler([-9.0, -9.0], [9.0, 9.0])
    root = np.array([[[2.0, 0.0], [1.0, 1.0]]] * 2)
    values, p = np.zeros((2, 2)), np.array([[1.0, 0.5], [-1.0, 0.0]])
    ends, after, stuck = free._drift(values, p, np.full((2, 1), 0.5), root)
    np.testing.assert_allclose(ends, [[1.0, 0.75], [-1.0, -0.5]])
    np.testing.assert_allclose(after, p)
    assert not stuck.any()
    # with a unit metric the path is that of a billiard ball
    walls = sampler([-1.0, -1.0], [1.0, 1.0])
    unit = np.array([np.eye(2)] * 2)
    ends, after, _ = walls._drift(values, np.array([[3.0, 0.5], [0.5, -5.0]]), np.ones((2, 1)), unit)
    np.testing.assert_allclose(ends, [[-1.0, 0.5], [0.5, -1.0]], atol=1e-9)
    np.testing.assert_allclose(np.abs(after), [[3.0, 0.5], [0.5, 5.0]])
    # a reflection keeps the length of the momentum, whatever the metric
    ends, after, _ = walls._drift(values, np.array([[2.0, 1.5], [2.5, -1.0]]), np.ones((2, 1)), root)
    assert np.abs(ends).max() <= 1.0
    np.testing.assert_allclose(np.linalg.norm(after, axis=1), np.linalg.norm([[2.0, 1.5], [2.5, -1.0]], axis=1))


@pytest.mark.slow
def test_a_trajectory_turns_on_the_circle_of_a_gaussian() -> None:
    free = sampler([-99.0, -99.0], [99.0, 99.0])
    start = np.array([[1.0, 0.0], [0.0, 2.0]])
    chains = free.begun(start, np.eye(2)[None])
    momentum = np.array([[0.0, 1.0], [-2.0, 0.0]])
    values, gradient, density, after = free._trajectory(chains, momentum, np.full((2, 1), 0.001), 1571)
    np.testing.assert_allclose(values, momentum, atol=2e-3)
    np.testing.assert_allclose(after, -start, atol=2e-3)
    np.testing.assert_allclose(gradient, -values)
    np.testing.assert_allclose(density, -0.5 * (values**2).sum(axis=1))


def test_the_metric_moves_towards_the_draws() -> None:
    rng = np.random.default_rng(3)
    drawn = rng.normal(size=(4000, 5, 2)) @ np.diag([3.0, 0.2])
    root = _refined(np.eye(2), drawn)
    np.testing.assert_allclose(root @ root.T, np.diag([9.0, 0.04]), atol=0.25, rtol=0.05)
    few = _refined(np.eye(2), drawn[:4, :1])
    unit = drawn[:4, 0] - drawn[:4, 0].mean(axis=0)
    np.testing.assert_allclose(few @ few.T, (0.5 * unit.T @ unit + 20.0 * np.eye(2)) / (2.0 + 20.0))


# Ranges of a fine-tuning


def test_ranges_are_about_the_value_of_the_ship_within_what_is_declared() -> None:
    path, other = "hull.Y_v", "rudder.t_R"
    value, more = float(read(SHIP.model, path)), float(read(SHIP.model, other))
    problem = Problem(SHIP, (), (Free(path, value, 1.2 * value, 0.0), Free(other, more, 0.0, 1.0)))
    one, two = within(problem, 0.4)
    assert (one.low, one.high, one.start) == pytest.approx((1.2 * value, 0.6 * value, value))
    assert (two.low, two.high) == pytest.approx((0.6 * more, 1.4 * more))
    soft = softened(problem, 0.4, 0.5)
    assert soft[1].prior == pytest.approx(more)
    assert soft[1].sigma == pytest.approx(0.5 * 0.4 * more)
    assert (soft[0].low, soft[1].high) == (1.2 * value, 1.0)
    with pytest.raises(StudyError, match="lies outside of"):
        within(replace(problem, free=(Free(path, 0.0, 0.0, 1.0),)), 0.4)


@pytest.mark.slow
def test_descents_begin_as_declared_then_in_the_box_or_the_prior() -> None:
    vector = Vector((Free("a", 1.0, 0.0, 4.0), Free("b", 5.0, -50.0, 50.0, prior=5.0, sigma=0.5)))
    found = np.array(_starts(vector, 2000, 3))
    assert found[0].tolist() == [1.0, 5.0]
    assert found[1:, 0].min() >= 0.0
    assert found[1:, 0].mean() == pytest.approx(2.0, abs=0.12)
    assert found[1:, 0].std() == pytest.approx(4.0 / math.sqrt(12.0), rel=0.05)
    assert found[1:, 1].mean() == pytest.approx(5.0, abs=0.05)
    assert found[1:, 1].std() == pytest.approx(0.5, rel=0.06)


def left(**changes: Any) -> Residuals:
    given = {"rms": {"x": 1.0, "psi": 0.02}, "noise": {"x": 0.6, "psi": 0.015}, "correlation": {"x": 0.4, "psi": 0.4},
             "bias": {}, "time": 4.0, "variance": 9.0, "independent": 50.0}  # fmt: skip
    return Residuals(**{**given, **changes})


def test_residuals_of_a_tuning_warn_beyond_noise_and_count_as_independent() -> None:
    assert left().warnings == ()
    assert left().counted == pytest.approx(6.0)
    (line,) = left(noise={"x": 0.4, "psi": 0.015}).warnings
    assert line.startswith("the model lacks something: the residual of x is 1 m RMS, the noise of its sensor 0.4 m;")
    (line,) = left(correlation={"x": 0.4, "psi": 0.6}).warnings
    assert ("psi is 1.15 deg RMS, the noise of its sensor 0.859 deg; neighbouring samples are "
            "correlated by 0.600") in line
    assert ranges._said("r", math.radians(2.0)) == "2 deg/s"
    assert ranges._said("u", 0.5) == "0.5 m/s"


def swept(ratio: float, tune: float, test: float, out: tuple[float, float], **changes: Any) -> Any:
    free = (Free("hull.Y_v", -0.3, -0.3 * (1 + ratio), -0.3 * (1 - ratio)),)
    given = {"ratio": ratio, "left_out": dict(zip("ab", out, strict=True)), "soft_left_out": {"a": 90.0, "b": 90.0},
             "test": {"c": test}, "fit": SimpleNamespace(objective=tune), "kept": "gradient", "apart": 1e-6,
                 "at_bound": (),
             "free": free}  # fmt: skip
    return SimpleNamespace(**{**given, **changes})


def told(chosen: int = 1, *, before: float = 200.0, **changes: Any) -> list[Issue]:
    sweep = changes.pop("sweep", (swept(0.2, 50.0, 100.0, (50.0, 51.0)), swept(0.4, 20.0, 50.0, (10.0, 10.5)),
                                  swept(0.6, 10.0, 80.0, (40.0, 42.0))))  # fmt: skip
    vector = SimpleNamespace(current=lambda model: np.array([-0.3]))
    problem = SimpleNamespace(free=sweep[0].free, vector=vector, ship=SimpleNamespace(model=None))
    best = sweep[chosen]
    given = {"ranges": sweep, "best": best, "problem": problem, "residuals": left(), "flat": 0, "agreement": 1e-4,
             "tests": ("c",), "untuned_test": {"c": before},
             "best_test": min(sweep, key=lambda r: sum(r.test.values())).ratio}  # fmt: skip
    return list(findings(SimpleNamespace(**{**given, **changes})))  # type: ignore[arg-type]


def warned(issues: list[Issue]) -> list[str]:
    return [one.text for one in issues if one.severity == "warning"]


def test_a_sound_sweep_has_one_warning_that_the_tests_rise_beyond_the_best() -> None:
    issues = told()
    assert warned(issues) == ["beyond a_r = 0.4 the loss of the test trials rises while that of the "
                              "tuning trials falls: overfitting"]  # fmt: skip
    infos = [one.text for one in issues if one.severity == "info"]
    assert infos[0].startswith("a_r = 0.4 is chosen: it predicts the tuning trials left out best, with a loss of 20.5;")
    assert "no better than the chosen box (180 to 20.5)" in infos[1]
    assert "tuned beats untuned on every test trial, in every range" in infos
    assert any(text.endswith("it is the chosen one") for text in infos)
    assert any("both methods find the same objective in every range, to 1e-06 at worst" in text for text in infos)


def test_what_a_sweep_leaves_open_is_warned_of() -> None:
    assert any("widest range tried" in text for text in warned(told(2)))
    assert not any("widest range tried" in text for text in warned(told(0)))
    unclear = (swept(0.2, 50.0, 100.0, (9.0, 21.0)), swept(0.4, 20.0, 50.0, (10.0, 10.5)))
    assert any("cannot distinguish a_r = 0.4 from 0.2" in text for text in warned(told(sweep=unclear)))
    assert any("do not agree on a range: a 0.2, b 0.4" in text for text in warned(told(sweep=unclear)))
    assert any("predicted no better than untuned: c at 0.2" in text for text in warned(told(before=100.0)))
    assert not any("no better than untuned" in text for text in warned(told(before=100.1)))
    assert any("1 of 1 combinations" in text for text in warned(told(flat=1)))
    assert any("too few data" in text for text in warned(told(residuals=left(independent=0.9))))
    later = warned(told(2, sweep=(swept(0.2, 5.0, 100.0, (50.0, 51.0)), swept(0.4, 20.0, 50.0, (10.0, 10.5)),
                                  swept(0.6, 10.0, 80.0, (4.0, 4.2)))))  # fmt: skip
    assert any("is seen to predict the test trials best; the chosen one has 1.6 times its loss" in t for t in later)
    assert any(one.where == "a_r 0.4" and "worse than the narrower a_r 0.2" in one.text for one in told(sweep=(
        swept(0.2, 5.0, 100.0, (50.0, 51.0)), swept(0.4, 20.0, 50.0, (10.0, 10.5)))))
    cut = swept(0.4, 20.0, 50.0, (10.0, 10.5), free=(Free("hull.Y_v", -0.3, -0.40, -0.18),))
    assert any("is cut there: hull.Y_v" in text for text in warned(told(sweep=(swept(0.2, 50.0, 9.0, (50.0, 51.0)),
        cut))))
    stuck = (swept(0.2, 50.0, 100.0, (50.0, 51.0)), swept(0.4, 20.0, 50.0, (10.0, 10.5), at_bound=("hull.Y_v",)))
    assert any("1 of 1 end at a bound of their range (hull.Y_v)" in text for text in warned(told(sweep=stuck)))
    soft = (swept(0.2, 50.0, 100.0, (50.0, 51.0), soft_left_out={"a": 5.0, "b": 5.0}), swept(0.4, 20.0, 50.0, (10.0,
        10.5)))
    assert any("of a_r = 0.2, predicts the trials left out better than the chosen box (10 to 20.5)" in one.text
               for one in told(sweep=soft))  # fmt: skip


def test_a_loss_near_the_least_is_no_warning() -> None:
    def at(loss: float) -> list[Issue]:
        sweep = (swept(0.2, 50.0, 50.0, (50.0, 51.0)), swept(0.4, 20.0, loss, (10.0, 10.5)))
        return told(sweep=sweep)

    assert any("the loss in the chosen one is 4 % above it" in one.text for one in at(52.0))
    assert any("the chosen one has 1.06 times its loss" in text for text in warned(at(53.0)))


# Bands of an ensemble


def test_bands_of_an_ensemble_are_quantiles_of_its_members() -> None:
    states = np.zeros((401, 2, 6))
    states[:, :, 2] = np.linspace(0.0, 1.0, 401)[:, None]
    given: Any = SimpleNamespace()
    one = ensemble.Bands(given, np.arange(2.0), states, states[0], {"a": np.append(np.linspace(0, 2, 201), math.nan),
                         "b": np.full(3, math.nan)}, {}, {}, {})  # fmt: skip
    low, high = one.band("psi")
    assert (low[0], high[1]) == pytest.approx((0.025, 0.975))
    assert one.band("psi", 0.5)[0][0] == pytest.approx(0.25)
    assert one.interval("a", 0.9) == pytest.approx((0.1, 1.9))
    assert all(math.isnan(v) for v in one.interval("b"))
    group = ensemble.Ensemble(given, (), np.zeros((4, 1)), np.array([1.0, 2.0, 3.0, 10.0]), 3.0, {}, given)
    assert group.excess == pytest.approx(3.0 / 2.5)
    assert group.surpassed == pytest.approx(0.5)
