"""Statistics of campaigns by closed forms: laws of inputs, points, parts, intervals, levels of a rare event."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from scipy.special import ndtr, ndtri
from scipy.stats import qmc

from seatrial.belief.bands.manoeuvring import Bands
from seatrial.campaign import Campaign, Case, Correlated, Criterion
from seatrial.campaign.analysis import margin
from seatrial.campaign.analysis.proportion import Proportion, runs_to_exclude
from seatrial.campaign.analysis.sensitivity import given_data, saltelli
from seatrial.campaign.analysis.spread import SHARES, histogram, spread
from seatrial.campaign.chunk import compute, drawn, ready, sailed_at
from seatrial.campaign.designs import points, uniform
from seatrial.campaign.inputs import Input
from seatrial.campaign.rare import rare, replay
from seatrial.campaign.rare.levels import cube_of
from seatrial.campaign.rare.subset import SHARE, Level, estimate, first_level, next_level
from seatrial.campaign.revolutions import balanced
from seatrial.campaign.running import Shard
from seatrial.campaign.tracks import counts
from seatrial.data import Array
from seatrial.environment import CALM, CHANNELS, Uniform
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load

SHARE_OF = np.linspace(0.001, 0.999, 999)
SHIP = load("kvlcc2_l7")
CASE = Case("case", SHIP, Zigzag(11.85, 0.17, 0.17), SHIP.speed, 20.0, 0.1)


def campaign(runs: int = 7, chunk: int = 3, inputs: dict[str, Input] | None = None, **more: object) -> Campaign:
    cases = (CASE, Case("other", SHIP, Zigzag(11.85, 0.35, 0.17), SHIP.speed, 20.0, 0.1))
    return Campaign("c", cases, runs, inputs or {}, chunk=chunk, **more)  # type: ignore[arg-type]


# Inputs: each is the inverse of its distribution function.


@pytest.mark.parametrize(("one", "law"), [
    (Input("normal", (3.0, 2.0), within=(2.0, 6.5)), stats.truncnorm(-0.5, 1.75, 3.0, 2.0)),
    (Input("normal", (3.0, 2.0), within=(5.0, 9.0)), stats.truncnorm(1.0, 3.0, 3.0, 2.0)),
    (Input("normal", (3.0, 2.0), within=(-5.0, 1.0)), stats.truncnorm(-4.0, -1.0, 3.0, 2.0)),
    (Input("triangular", (1.0, 2.0, 5.0)), stats.triang(0.25, 1.0, 4.0)),
    (Input("uniform", (-2.0, 5.0)), stats.uniform(-2.0, 7.0)), (Input("normal", (-2.0, 5.0)), stats.norm(-2.0, 5.0)),
    (Input("lognormal", (3.0, 0.4)), stats.lognorm(0.4, scale=3.0)),
])  # fmt: skip
def test_an_input_is_the_inverse_of_its_law(one: Input, law: stats.rv_continuous) -> None:
    assert one.of(SHARE_OF) == pytest.approx(law.ppf(SHARE_OF), rel=1e-9, abs=1e-12)
    low, high = one.ends
    assert (low, high) == pytest.approx(law.support())


def test_a_cut_lognormal_keeps_the_shape_between_the_cuts() -> None:
    one, law = Input("lognormal", (3.0, 0.4), within=(2.0, 4.0)), stats.lognorm(0.4, scale=3.0)
    low, high = law.cdf([2.0, 4.0])
    assert law.cdf(one.of(SHARE_OF)) == pytest.approx(low + SHARE_OF * (high - low), abs=1e-12)
    assert Input("lognormal", (3.0, 0.4), within=(-1.0, 4.0)).of(SHARE_OF)[0] > 0.0
    assert Input("lognormal", (3.0, 0.4), within=(-1.0, 4.0)).ends == (0.0, 4.0)


def test_choices_have_their_shares_in_their_order() -> None:
    one = Input("choice", (5.0, 1.0, 3.0), weights=(1.0, 2.0, 1.0))
    assert one.of(np.array([0.001, 0.249, 0.251, 0.749, 0.751, 0.999])).tolist() == [5.0, 5.0, 1.0, 1.0, 3.0, 3.0]
    assert one.ends == (1.0, 5.0)
    even = Input("choice", (5.0, 1.0)).of(np.linspace(0.0005, 0.9995, 1000))
    assert np.count_nonzero(even == 5.0) == 500


def test_joint_inputs_have_their_covariance_and_draws_are_equally_likely() -> None:
    root = np.array([[2.0, 0.0], [1.0, 0.5]])
    joint = Correlated(("a", "b"), np.array([3.0, -1.0]), root)
    assert joint.dims == 2
    for z in ([0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-0.3, 2.0]):
        assert joint.of(ndtr(np.array([z])))[0] == pytest.approx(np.array([3.0, -1.0]) + root @ z)
    draws = np.arange(10.0).reshape(5, 2)
    some = Correlated(("a", "b"), draws.mean(axis=0), np.eye(2), draws)
    assert some.dims == 1
    picked = some.of(np.array([[0.01], [0.19], [0.21], [0.99], [1.0 - 1e-16]]))
    assert picked.tolist() == [draws[k].tolist() for k in (0, 0, 1, 4, 4)]


def test_a_factor_multiplies_the_number_of_the_ship() -> None:
    inputs = {"ship.hull.N_r": Input("uniform", (0.5, 1.5), factor=True), "U_C": Input("constant", (0.2,)),
              "u": Input("uniform", (0.9, 1.1), factor=True)}  # fmt: skip
    found = drawn(campaign(inputs=inputs), 0, 0, 7)
    share = points("random", 1, 2, 7, 0, 7)
    assert found["ship.hull.N_r"] == pytest.approx((0.5 + share[:, 0]) * float(SHIP.model.hull.N_r))
    assert found["u"] == pytest.approx((0.9 + 0.2 * share[:, 1]) * SHIP.speed)
    assert found["U_C"].tolist() == [0.2] * 7


# Points, parts and shards.


def test_points_of_a_latin_hypercube_have_one_in_each_row_and_column() -> None:
    found = points("latin-hypercube", 3, 4, 50, 0, 50)
    for column in found.T:
        assert sorted(np.floor(column * 50).astype(int).tolist()) == list(range(50))
    assert not np.array_equal(found, points("latin-hypercube", 4, 4, 50, 0, 50))


def test_sobol_points_are_those_of_the_sequence_wherever_they_are_entered() -> None:
    """Balanced: of 64 points each half, quarter and eighth of each axis has its share; the average is exact."""
    found = points("sobol", 5, 3, 64, 0, 64)
    for column in found.T:
        for cells in (2, 4, 8, 64):
            assert np.bincount((column * cells).astype(int)).tolist() == [64 // cells] * cells
    assert np.array_equal(points("sobol", 5, 3, 64, 17, 40), found[17:40])
    assert qmc.discrepancy(found) < 0.2 * qmc.discrepancy(points("random", 5, 3, 64, 0, 64))


def test_streams_and_seeds_have_numbers_of_their_own() -> None:
    one = uniform(1, 5, 0, 400)
    assert np.array_equal(uniform(1, 5, 100, 200), one[100:200])
    for other in (uniform(2, 5, 0, 400), uniform(1, 5, 0, 400, stream=1), uniform(1, 5, 400, 800)):
        assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 5.0 / math.sqrt(2000)
        assert not np.isin(other, one).any()
    assert stats.kstest(one.ravel(), "uniform").pvalue > 1e-4


def test_a_saltelli_block_is_a_then_each_input_of_b_then_b() -> None:
    block = points("saltelli", 2, 3, 10, 0, 10).reshape(2, 5, 3)
    for rows in block:
        a, *between, b = rows
        assert not np.isin(a, b).any()
        for k, row in enumerate(between):
            assert [row[i] == (b if i == k else a)[i] for i in range(3)] == [True] * 3
    assert np.array_equal(points("saltelli", 2, 3, 10, 3, 9), block.reshape(10, 3)[3:9])


def test_a_grid_counts_with_the_last_input_fastest() -> None:
    inputs = {"U_T": Input("values", (1.0, 2.0)), "depth": Input("values", (10.0, 20.0, 30.0))}
    found = drawn(campaign(6, 4, inputs, design="grid"), 1, 0, 6)
    assert list(zip(found["U_T"], found["depth"], strict=True)) == list(itertools.product((1, 2), (10, 20, 30)))


@pytest.mark.parametrize(("runs", "chunk"), [(7, 3), (6, 3), (1, 5), (5, 1)])
def test_parts_hold_every_run_of_every_case_once(runs: int, chunk: int) -> None:
    plan = campaign(runs, chunk)
    parts = [plan.part(number) for number in range(plan.parts)]
    held = [(case, run) for case, first, last in parts for run in range(first, last)]
    assert held == [(case, run) for case in range(2) for run in range(runs)]
    assert all(0 < last - first <= chunk for _, first, last in parts)
    shared = [Shard.read(f"{k}/3").of(list(range(plan.parts))) for k in (1, 2, 3)]
    assert sorted(itertools.chain(*shared)) == list(range(plan.parts))
    assert Shard.read("2/3") == Shard(1, 3)


@pytest.mark.slow
def test_rows_are_numbered_over_the_cases_and_verdicts_hold_at_the_bound() -> None:
    plan = campaign(5, 2, {"u": Input("uniform", (1.0, 1.2))})
    rows = [compute(plan, number).columns for number in range(plan.parts)]
    assert np.concatenate([one["run"] for one in rows]).tolist() == list(range(10))
    assert np.concatenate([one["case"] for one in rows]).tolist() == [0.0] * 5 + [1.0] * 5
    reached = rows[0]["first_reversal"]
    exact = {"a": Criterion("first_reversal", float(reached[0]), math.inf), "b": Criterion(
        "first_reversal", -math.inf, float(reached[0])), "c": Criterion("first_reversal", 1e3, 1e4)}  # fmt: skip
    told = compute(campaign(5, 2, {"u": Input("uniform", (1.0, 1.2))}, criteria=exact), 0).columns
    assert (told["a_met"][0], told["b_met"][0], told["c_met"][0]) == (1.0, 1.0, 0.0)
    assert np.isnan(told["a_met"]).tolist() == np.isnan(reached).tolist()


# What is around a run, and how it begins.


def test_weather_and_start_are_vectors_of_their_own_run() -> None:
    """Through the water plus the current is over ground: turned by hand into the axes of the ship."""
    inputs = {"U_C": Input("uniform", (0.1, 0.3)), "gamma_C": Input("uniform", (-3.0, 3.0)),
              "psi": Input("uniform", (-2.0, 2.0)), "v_m": Input("constant", (0.05,)), "U_T": Input("constant", (4.0,)),
              "gamma_T": Input("uniform", (0.0, 6.0)), "depth": Input("uniform", (1.0, 9.0))}  # fmt: skip
    plan = campaign(6, 6, inputs, weather=Uniform(H_S=0.5, gamma_W=1.0, T_W=3.0))
    runs = ready(plan, 0, 0, 6)
    for k in range(6):
        one = {name: float(column[k]) for name, column in runs.columns.items()}
        flow = one["U_C"] * np.array([math.cos(one["gamma_C"]), math.sin(one["gamma_C"])])
        wind = 4.0 * np.array([math.cos(one["gamma_T"]), math.sin(one["gamma_T"])])
        wave = 0.5 * np.array([math.cos(1.0), math.sin(1.0)])
        around = dict(zip(CHANNELS, runs.around[k, 0], strict=True))
        wanted = (*wind, *flow, *wave, 3.0, 1.0 / one["depth"])
        assert [around[name] for name in CHANNELS] == pytest.approx(wanted)
        c, s = math.cos(one["psi"]), math.sin(one["psi"])
        ahead, aside = np.array([[c, s], [-s, c]]) @ flow
        begun = (0.0, 0.0, one["psi"], SHIP.speed + ahead, 0.05 + aside, 0.0)
        assert runs.start[k] == pytest.approx(begun)


@pytest.mark.slow
def test_gusts_differ_from_run_to_run_and_not_by_the_part() -> None:
    plan = campaign(4, 4, weather=Uniform(U_T=8.0), gusts="davenport")
    wind = ready(plan, 0, 0, 4).around[:, :, 0]
    assert np.array_equal(ready(plan, 0, 2, 3).around[0, :, 0], wind[2])
    assert len({tuple(one[:3]) for one in wind.tolist()}) == 4
    assert wind.mean() == pytest.approx(8.0, rel=0.5)
    other = campaign(4, 4, weather=Uniform(U_T=8.0), gusts="davenport", seed=2)
    assert not np.array_equal(ready(other, 0, 0, 1).around[0, :, 0], wind[0])


def test_kept_samples_are_those_before_a_failure() -> None:
    failed, dt, every = np.array([math.nan, 0.0, 0.1, 0.5, 1.0]), 0.1, 4
    wanted = [sum(1 for k in range(0, 21, every) if math.isnan(end) or k * dt < end - 1e-9) for end in failed]
    assert counts(failed, 21, dt, every).tolist() == wanted == [6, 0, 1, 2, 3]


# Intervals.


@pytest.mark.parametrize(("hits", "runs"), [(0, 20), (3, 20), (20, 20), (57, 1000)])
def test_an_interval_is_that_of_clopper_and_pearson(hits: int, runs: int) -> None:
    low, high = Proportion(hits, runs).interval
    assert low == pytest.approx(stats.beta.ppf(0.025, hits, runs - hits + 1) if hits else 0.0)
    assert high == pytest.approx(stats.beta.ppf(0.975, hits + 1, runs - hits) if hits < runs else 1.0)
    assert Proportion(hits, runs).value == hits / runs


def test_runs_of_one_part_count_as_alike_as_parts_differ() -> None:
    """Beta-binomial parts: the interval holds the truth where that of independent runs misses it far too often."""
    rng = np.random.default_rng(4)
    p, alike, parts, each = 0.7, 0.3, 12, 20
    held = {"alike": 0, "independent": 0}
    for _ in range(400):
        own = rng.beta(p * (1 / alike - 1), (1 - p) * (1 / alike - 1), parts)
        shares = rng.binomial(each, own) / each
        for name, one in (("alike", Proportion.of_parts(shares.tolist(), [each] * parts)),
                          ("independent", Proportion(shares.mean() * parts * each, parts * each))):  # fmt: skip
            low, high = one.interval
            held[name] += low <= p <= high
    assert held["alike"] >= 0.9 * 400 > 0.75 * 400 > held["independent"]


def test_parts_that_tell_nothing_of_their_runs_count_all() -> None:
    assert Proportion.of_parts([0.25], [4]) == Proportion(1.0, 4)
    assert Proportion.of_parts([1.0, 1.0], [3, 5]) == Proportion(8.0, 8)
    assert Proportion.of_parts([0.5, 0.5], [4, 4]) == Proportion(4.0, 8), "as alike as if independent, or more"
    assert Proportion.of_parts([], []).interval == (0.0, 1.0)
    assert Proportion.of_parts([1.0, 0.0], [50, 50]).runs == 2.0, "of each part all hit or none: one run a part"
    mixed = Proportion.of_parts([0.9, 0.5, 0.7], [10, 10, 10])
    assert mixed.runs == pytest.approx(0.21 / (1.5 * 100 * 0.08 / 900))
    assert mixed.value == pytest.approx(0.7)


def test_runs_that_an_accuracy_needs() -> None:
    p, accuracy = 0.04, 0.1
    n = Proportion(40, 1000).needed(accuracy)
    half = [1.959963984540054 * math.sqrt(p * (1.0 - p) / count) for count in (n, n - 1)]
    assert half[0] <= accuracy * p < half[1]
    end = stats.beta.ppf(0.975, 1, 1000)  # without a hit, of the most that it can be
    assert Proportion(0, 1000).needed() == math.ceil((1.959963984540054 / 0.1) ** 2 * (1.0 - end) / end)
    for probability in (0.5, 0.01, 1e-4):
        least = runs_to_exclude(probability)
        assert (1.0 - probability) ** least <= 0.05 < (1.0 - probability) ** (least - 1)
    assert (Proportion(0, 0).interval, math.isnan(Proportion(0, 0).value)) == ((0.0, 1.0), True)


def test_quantiles_lie_between_ranks_of_the_least_confidence() -> None:
    values = np.append(np.random.default_rng(2).permutation(np.arange(1.0, 501.0)), [math.nan] * 3)
    found = spread(values)
    assert (found.count, found.missing, found.least, found.most) == (500, 3, 1.0, 500.0)
    assert (found.mean, found.sigma) == pytest.approx((250.5, math.sqrt(500 * 501 / 12)))
    for share, one in zip(SHARES, found.quantiles, strict=True):
        assert one.value == pytest.approx(1.0 + share * 499.0)
        below = stats.binom(500, share)
        if math.isfinite(one.low):  # the values are their ranks
            assert below.cdf(one.low - 1) <= 0.05
            assert below.cdf(one.low - 1) - below.pmf(one.low - 1) < 0.025 < below.cdf(one.low) + 1e-12
        if math.isfinite(one.high):
            assert below.sf(one.high - 1) <= 0.025 < below.sf(one.high - 2)


def test_bars_hold_each_run_once() -> None:
    rng = np.random.default_rng(1)
    groups = [rng.normal(0.0, 1.0, 4000), rng.normal(2.0, 1.0, 1000)]
    found = histogram(groups)
    assert found is not None
    for group, row, beyond in zip(groups, found.shares, found.beyond, strict=True):
        inside = [np.mean((group >= a) & (group < b)) for a, b in itertools.pairwise(found.edges)]
        assert row == pytest.approx(inside, abs=1e-9)
        assert row.sum() + beyond == pytest.approx(1.0)
    assert sum(b * len(g) for b, g in zip(found.beyond, groups, strict=True)) <= 0.003 * 5000
    assert histogram([np.ones(9)]) is None


def test_a_margin_is_the_distance_to_the_nearer_bound() -> None:
    assert margin(np.array([-1.0, 0.0, 2.0, 5.0, 6.0]), 0.0, 5.0).tolist() == [-1.0, 0.0, 2.0, 0.0, -1.0]
    assert margin(np.array([3.0]), -math.inf, 2.0).tolist() == [-1.0]


def test_bands_are_quantiles_of_the_runs_that_came_so_far() -> None:
    tracks = np.full((101, 3, 6), np.nan)
    tracks[:, 0, 3], tracks[:51, 1, 3] = np.arange(101.0), np.arange(51.0)
    found = Bands(np.arange(3.0), tracks, {"a": np.arange(101.0), "b": np.append(np.full(50, np.nan), np.arange(51.0))},
                  np.full(101, np.nan))  # fmt: skip
    assert found.edges("a", 0.9) == pytest.approx((5.0, 95.0))
    assert found.edges("b", 0.5) == pytest.approx((12.5, 37.5))
    assert all(map(math.isnan, (*found.edges("b", 0.9), *found.edges("absent", 0.5))))
    low, high = found.band("u", 0.9)
    assert (low[:2].tolist(), high[:2].tolist()) == (pytest.approx([5.0, 2.5]), pytest.approx([95.0, 47.5]))
    assert math.isnan(low[2])
    assert math.isnan(high[2])


# Shares of the variance: y = 3 a + 2 b + a b of uniform inputs on [-1, 1] has 9/3, 4/3 and 1/9.

PARTS = np.array([3.0, 4.0 / 3.0, 0.0]), 1.0 / 9.0


def _polynomial(cube: Array) -> Array:
    a, b = 2.0 * cube[:, 0] - 1.0, 2.0 * cube[:, 1] - 1.0
    return 3.0 * a + 2.0 * b + a * b


@pytest.mark.slow
def test_shares_of_the_variance_are_those_of_the_polynomial() -> None:
    """Interactions count in the total of both, first order in none; an input without effect has neither."""
    main, both = PARTS
    whole = main.sum() + both
    cube = points("saltelli", 1, 3, 5 * 4096, 0, 5 * 4096)
    found = saltelli(("a", "b", "c"), _polynomial(cube))
    assert found is not None
    assert [one.first for one in found.effects] == pytest.approx(list(main / whole), abs=0.01)
    totals = (main + both * np.array([1.0, 1.0, 0.0])) / whole
    assert [one.total for one in found.effects] == pytest.approx(list(totals), abs=0.01)
    free = points("random", 1, 3, 20000, 0, 20000)
    given = given_data({name: free[:, k] for k, name in enumerate("abc")}, _polynomial(free))
    assert given is not None
    assert [one.first for one in given.effects] == pytest.approx(list(main / whole), abs=0.015)
    assert [abs(one.first - m / whole) < 2.0 * one.first_error + 1e-3
            for one, m in zip(given.effects, main, strict=True)] == [True] * 3  # fmt: skip
    assert given.effects[0].rank > given.effects[1].rank > 0.3
    assert abs(given.effects[2].rank) < 0.03
    down = given_data({"a": -free[:, 0]}, _polynomial(free))
    assert down is not None
    assert down.effects[0].rank == pytest.approx(-given.effects[0].rank)


# Rare events.


def test_a_level_keeps_the_tenth_that_is_nearest() -> None:
    level = Level(np.zeros((40, 1)), np.arange(40.0)[::-1] + 1.0)
    assert (level.next_bound, level.share, level.last, level.stalled) == (4.0, 0.1, False, False)
    assert level.inside.sum() == 4
    there = Level(np.zeros((40, 1)), np.append(np.full(6, -1.0), np.arange(34.0) + 1.0))
    assert (there.next_bound, there.share, there.last) == (0.0, 6 / 40, True)
    assert Level(np.zeros((40, 1)), np.full(40, 2.0), bound=2.0).stalled


def test_the_variation_counts_how_alike_the_points_of_a_chain_are() -> None:
    """Of chains that never move, n points are worth n / 10; of independent ones n."""
    rng, n = np.random.default_rng(3), 40000
    alone = np.where(rng.random(n) < 0.2, -1.0, 1.0)
    stuck = np.tile(np.where(np.arange(n // SHARE) % 5 == 0, -1.0, 1.0), SHARE)
    p = float(np.mean(alone < 0))
    first = estimate([Level(np.zeros((n, 1)), alone)])
    assert first.variation == pytest.approx(math.sqrt((1 - p) / (p * n)))
    free, held = (estimate([Level(np.zeros((n, 1)), m, bound=5.0)]) for m in (alone, stuck))
    assert free.variation == pytest.approx(first.variation, rel=0.1)
    assert held.variation == pytest.approx(math.sqrt(10 * 0.8 / (0.2 * n)), rel=1e-9)
    tenth = np.where(rng.permutation(n) < n // 10, -1.0, 1.0)  # all of them are seeds
    two = estimate([Level(np.zeros((n, 1)), tenth)] * 2)
    assert two.probability == pytest.approx(0.01)
    assert two.variation == pytest.approx(math.sqrt(2.0 * 0.9 / (0.1 * n)), rel=0.03)
    low, high = two.interval
    assert low * high == pytest.approx(two.probability**2)
    assert math.log(high / low) / 2.0 == pytest.approx(1.959964 * math.sqrt(math.log1p(two.variation**2)))


def test_the_variation_counts_how_few_points_of_the_first_level_a_breach_descends_from() -> None:
    """Level by level chains are known from their points; that the last ones are all of one family is not."""
    n, chains = 1000, 1000 // SHARE
    rows = np.arange(n)

    def level(inside: Array, bound: float) -> Level:
        return Level(np.zeros((n, 1)), np.where(inside, -1.0, 1.0), bound=bound)

    first = level(rows < chains, math.inf)  # seed k is row k, its chain the rows k, k + 100, ...
    ten = level(rows % chains < 10, 5.0)  # all points of ten chains
    assert estimate([first, ten]).variation == pytest.approx(math.sqrt(10 / 100 - 1 / n))
    # seeds of the next level are the rows inside in their order: 0 to 9, 100 to 109, ...; every tenth is of family 0
    family = level(rows % chains % 10 == 0, 5.0)
    assert estimate([first, ten, family]).variation == pytest.approx(math.sqrt(1.0 - 1 / n))


@pytest.mark.slow
def test_levels_sample_the_normal_distribution_inside_their_bound() -> None:
    """Beyond a plane the distance along its normal is a cut normal, the others are as they were."""
    def limit(x: Array) -> Array:
        return 2.5 - x[:, 0]

    above = first_level(limit, 5, 20000, 3)
    assert stats.kstest(above.points.ravel(), "norm").pvalue > 1e-4
    level = next_level(limit, 5, 1, above)
    cut = 2.5 - level.bound
    assert cut == pytest.approx(ndtri(0.9), abs=0.05)
    assert level.margins == pytest.approx(limit(level.points))
    assert (level.margins <= level.bound).all()
    law = stats.truncnorm(cut, math.inf)
    assert level.points[:, 0].mean() == pytest.approx(law.mean(), abs=0.02)
    assert level.points[:, 0].std() == pytest.approx(law.std(), abs=0.02)
    assert level.points[:, 1:].mean() == pytest.approx(0.0, abs=0.05)
    assert level.points[:, 1:].std() == pytest.approx(1.0, abs=0.03)
    assert 0.2 < level.accepted < 0.8
    assert (level.step > above.step) == (level.accepted > 0.44)


@pytest.mark.slow
def test_forty_searches_scatter_about_the_truth_as_they_say() -> None:
    """P(z > 3.7191) = 1e-4: the mean is unbiased, and the scatter is the variation that each tells."""
    def search(seed: int) -> tuple[float, float, bool]:
        def limit(x: Array) -> Array:
            return 3.7190165 - x.sum(axis=1) / math.sqrt(2.0)

        levels = [first_level(limit, seed, 1000, 2)]
        while not levels[-1].last:
            levels.append(next_level(limit, seed, len(levels), levels[-1]))
        found = estimate(levels)
        return found.probability, found.variation, found.interval[0] <= 1e-4 <= found.interval[1]

    found = [search(seed) for seed in range(1, 41)]
    p, told, held = (np.array([one[k] for one in found], dtype=np.float64) for k in range(3))
    scatter = p.std(ddof=1) / p.mean()
    assert abs(p.mean() - 1e-4) < 3.5 * p.std(ddof=1) / math.sqrt(40)
    assert 0.6 * told.mean() < scatter < 1.7 * told.mean()
    assert held.sum() >= stats.binom.ppf(1e-3, 40, 0.88)


def test_points_of_the_normal_space_are_points_of_the_cube() -> None:
    z = np.array([[-3.0, 0.0, 1.5], [-40.0, 40.0, 0.1]])
    assert cube_of(z)[0] == pytest.approx(ndtr(z[0]))
    assert (cube_of(z) > 0.0).all()
    assert (cube_of(z) < 1.0).all()


@pytest.mark.slow
def test_balanced_revolutions_leave_no_force_along_the_ship() -> None:
    """By the equations in plain Python, for ships of their own resistance and speed."""
    factors, speeds = np.array([0.8, 1.0, 1.3]), np.array([0.9, 1.1, 1.3])
    R_0 = float(SHIP.model.hull.R_0)
    n_P = balanced(SHIP, {"ship.hull.R_0": factors * R_0}, speeds)
    for factor, speed, turns in zip(factors, speeds, n_P, strict=True):
        model = SHIP.having({"hull.R_0": factor * R_0}).model
        ahead = 0.0, 0.0, 0.0, speed, 0.0, 0.0
        held, more = (model.derivative(ahead, (n, 0.0), CALM)[3] for n in (turns, 1.1 * turns))
        assert abs(held) < 1e-9
        assert more > 1e-4
    assert (np.diff(n_P) > 0.0).all()


def test_of_two_revolutions_that_balance_those_are_taken_from_which_more_push_and_none_are_none() -> None:
    """A parabola of thrust that turns up at small revolutions balances twice; one that pushes at rest never does."""
    speed = np.full(3, 1.1)
    n_P = balanced(SHIP, {"ship.propeller.k_2": np.array([float(SHIP.model.propeller.k_2), 0.3, 5.0])}, speed)
    assert np.isfinite(n_P).tolist() == [True, True, False]
    for k_2, turns in ((float(SHIP.model.propeller.k_2), n_P[0]), (0.3, n_P[1])):
        model = SHIP.having({"propeller.k_2": k_2}).model
        surge = [model.derivative((0.0, 0.0, 0.0, 1.1, 0.0, 0.0), (n, 0.0), CALM)[3] for n in (turns, 1.05 * turns)]
        assert abs(surge[0]) < 1e-9
        assert surge[1] > 0.0


@pytest.mark.slow
def test_a_search_numbers_its_runs_over_the_cases_and_counts_what_it_sailed(tmp_path: Path) -> None:
    """A tenth of each further level are the points that it begins with, which are not sailed again."""
    inputs = {"u": Input("normal", (1.18, 0.05))}
    plain = Campaign("c", (CASE, replace(CASE, name="again")), 4, inputs)
    limit = float(sailed_at(plain, 0, np.array([[0.04]]))["initial_turning_time"][0])  # slower ships take longer
    plan = replace(plain, criteria={"late": Criterion("initial_turning_time", -math.inf, limit)})
    for number, found in enumerate(rare(plan, "late", tmp_path / "search", runs=100)):
        assert found.runs == 100 + 90 * (len(found.levels) - 1) > 100
        assert found.estimate.probability == pytest.approx(0.04, rel=0.8)
        assert found.run is not None
        assert found.run // 100 == number
        _, policy, trial = replay(plan, tmp_path / "search", found.run)
        again = policy.indices(trial, SHIP.L_pp)["initial_turning_time"].value
        assert again == pytest.approx(found.nearest["initial_turning_time"])
        assert again > limit
