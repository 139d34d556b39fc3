"""Factors by recording: their coverage on recordings that were never seen, of many and of few, and what is refused."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy import stats

from seatrial.belief.bands.conformal import factors, needed, unsure
from seatrial.core.errors import RequestError


def scores(count: int, windows: int, scatter: float, rng: np.random.Generator) -> tuple[np.ndarray, list[str]]:
    """Absolute errors of recordings that differ in size, shape (windows, 1, 1), and whose they are."""
    sizes = np.exp(scatter * rng.standard_normal(count))
    found = np.abs(rng.standard_t(4, (count, windows))) * sizes[:, None]
    return found.reshape(-1, 1, 1), [f"r{k}" for k in range(count) for _ in range(windows)]


@pytest.mark.parametrize("scatter", [0.0, pytest.param(0.6, marks=pytest.mark.slow)])
def test_coverage_on_new_recordings_is_the_level(scatter: float) -> None:
    rng, held = np.random.default_rng(0), []
    for _ in range(60):
        found, names = scores(24, 8, scatter, rng)
        factor = factors(found, names, ["turn"] * len(names), 0.9).factor[0, 0, 0]
        held.append(float((scores(200, 2, scatter, rng)[0] <= factor).mean()))
    assert np.mean(held) == pytest.approx(0.9, abs=0.015)


def test_a_quantile_over_samples_would_not_cover() -> None:
    """One long recording of small errors among many short ones: samples say one thing, trials another."""
    rng = np.random.default_rng(1)
    short, names = scores(30, 2, 0.0, rng)
    long = 0.05 * np.abs(rng.standard_normal((2000, 1, 1)))
    both, owners = np.concatenate([short, long]), [*names, *["long"] * 2000]
    factor = factors(both, owners, ["turn"] * len(owners), 0.9).factor[0, 0, 0]
    new = scores(2000, 1, 0.0, rng)[0]
    assert (new <= factor).mean() > 0.85
    assert (new <= np.quantile(both, 0.9)).mean() < 0.3


@pytest.mark.slow
def test_kinds_have_their_own_size_and_hold_each() -> None:
    rng = np.random.default_rng(2)
    held: dict[str, list[float]] = {"turn": [], "zigzag": []}
    for _ in range(30):
        small, names = scores(20, 6, 0.2, rng)
        large, others = scores(12, 6, 0.2, rng)
        kinds = ["turn"] * len(names) + ["zigzag"] * len(others)
        found = factors(np.concatenate([small, 4.0 * large]), [*names, *(f"z{n}" for n in others)], kinds, 0.9)
        turn, zigzag, other = found.factor[:, 0, 0]
        assert found.kinds == ("turn", "zigzag", "")
        assert other == zigzag > 1.3 * turn
        assert found.recordings[:, 0].tolist() == [20, 12, 32]
        new = scores(200, 2, 0.2, rng)[0]
        held["turn"].append(float((new <= turn).mean()))
        held["zigzag"].append(float((4.0 * new <= zigzag).mean()))
    assert np.mean(held["turn"]) == pytest.approx(0.9, abs=0.03)
    assert np.mean(held["zigzag"]) == pytest.approx(0.9, abs=0.03)


def test_one_recording_much_unlike_the_others_widens_and_does_not_burst() -> None:
    rng = np.random.default_rng(3)
    found, names = scores(24, 8, 0.2, rng)
    odd = found.copy()
    odd[:8] *= 30.0
    plain, wide = (factors(one, names, ["turn"] * len(names), 0.9).factor[0, 0, 0] for one in (found, odd))
    assert plain <= wide < 8.0 * plain


def test_channels_that_are_alike_have_one_factor() -> None:
    rng = np.random.default_rng(4)
    found, names = scores(24, 8, 0.0, rng)
    both = np.concatenate([found, 3.0 * found, found], axis=2)
    made = factors(both, names, ["turn"] * len(names), 0.9, alike=[[0, 1]]).factor[0, 0]
    assert made[0] == made[1] > made[2]


@pytest.mark.parametrize(("level", "least"), [(0.5, 2), (0.8, 4), (0.9, 9), (0.95, 19), (0.99, 99)])
def test_ranks_show_a_level_from_as_many_recordings_on_as_it_needs(level: float, least: int) -> None:
    """One recording fewer, and the level is said to be more than they show by themselves."""
    assert needed(level) == least
    assert unsure(least, level) == ()
    (told,) = unsure(least - 1, level)
    assert told.startswith(f"{least - 1} recordings show {int(100 * (1 - 1 / least) + 1e-9) if least > 2 else 0} % by")


def test_two_recordings_are_refused_and_three_are_not() -> None:
    rng = np.random.default_rng(5)
    found, names = scores(2, 4, 0.0, rng)
    with pytest.raises(RequestError, match="2 recordings, and at least 3 are needed"):
        factors(found, names, ["turn"] * len(names), 0.95)
    found, names = scores(3, 4, 0.0, rng)
    assert np.isfinite(factors(found, names, ["turn"] * len(names), 0.95).factor).all()


@pytest.mark.parametrize("level", [0.9, 0.95, 0.99])
def test_of_few_recordings_the_factor_is_student_t_of_their_root_mean_square(level: float) -> None:
    """Recordings count once, however many windows they have; where fewer go on, there are fewer degrees of freedom."""
    size, many = np.array([1.0, 2.0, 1.5, 0.5]), (1, 7, 2, 30)
    owners = np.repeat(np.arange(4), many)
    score = np.repeat(size[owners][:, None, None], 4, axis=1)
    score[owners == 3, 2:] = np.nan
    made = factors(score, [f"r{k}" for k in owners], ["turn"] * len(owners), level)
    for horizon, some in ((0, size), (3, size[:3])):
        expected = stats.t.ppf(0.5 + 0.5 * level, len(some)) * np.sqrt(np.mean(some**2))
        assert made.factor[0, horizon, 0] == pytest.approx(expected, rel=1e-12)
        assert made.factor[1, horizon, 0] == made.factor[0, horizon, 0]


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [1.0, 3.0])
@pytest.mark.parametrize(("scatter", "count"), [(0.0, 4), (0.4, 4), (0.4, 6), (0.6, 8)])
def test_bands_of_few_recordings_hold_on_new_ones_and_are_not_twice_too_wide(
    scatter: float, count: int, ratio: float
) -> None:  # fmt: skip
    """Half of the recordings are of a kind whose errors are larger; the width is held to one that knows the law."""
    rng, held, width = np.random.default_rng(6), [], []
    kinds = [("turn", "zigzag")[k % 2] for k in range(count) for _ in range(6)]
    size = np.array([(1.0, ratio)[k % 2] for k in range(count) for _ in range(6)])[:, None, None]
    right = np.quantile(scores(20000, 1, scatter, rng)[0], 0.95)
    for _ in range(80):
        found, names = scores(count, 6, scatter, rng)
        turn, zigzag, _ = factors(size * found, names, kinds, 0.95).factor[:, 0, 0]
        new = scores(200, 2, scatter, rng)[0]
        held += [float((new <= turn).mean()), float((ratio * new <= zigzag).mean())]
        width.append(zigzag / (ratio * right))
    assert 0.93 <= np.mean(held) <= 0.98
    assert np.mean(held[1::2]) >= 0.88  # of the harder kind alone
    assert np.median(width) < 2.0


def test_a_higher_level_has_wider_bands_whatever_rule_gives_them() -> None:
    rng = np.random.default_rng(7)
    for count in (3, 5, 9, 18, 25):
        found, names = scores(count, 4, 0.6, rng)
        kinds = [("turn", "zigzag")[k % 2] for k in range(count) for _ in range(4)]
        each = [factors(found, names, kinds, level).factor for level in (0.5, 0.8, 0.9, 0.95, 0.99)]
        assert (np.diff(each, axis=0) >= 0.0).all()


@pytest.mark.parametrize(("count", "level"), [(3, 0.95), (4, 0.95), (8, 0.95), (8, 0.99)])
def test_what_is_said_of_nine_sets_of_ten_is_so(count: int, level: float) -> None:
    """Normal errors, one a recording: the band of each set holds a share that is known in closed form."""
    rng = np.random.default_rng(8)
    sets = np.sqrt(np.mean(rng.standard_normal((20000, count)) ** 2, axis=1)) * stats.t.ppf(0.5 + 0.5 * level, count)
    holds = 2.0 * stats.norm.cdf(sets) - 1.0
    assert np.mean(holds) == pytest.approx(level, abs=0.003)
    (told,) = unsure(count, level)
    least = int(re.findall(r"for (\d+) % or more", told)[0])
    assert 100.0 * np.quantile(holds, 0.1) == pytest.approx(least + 0.5, abs=1.0)


def test_a_horizon_that_few_recordings_reach_has_no_factor() -> None:
    rng = np.random.default_rng(6)
    found, names = scores(24, 4, 0.0, rng)
    later = np.where(np.arange(len(found))[:, None, None] < 10 * 4, found, np.nan)
    made = factors(np.concatenate([found, found, later], axis=1), names, ["turn"] * len(names), 0.95)
    assert np.isfinite(made.factor[0, :2, 0]).all()
    assert np.isnan(made.factor[0, 2, 0])
    assert made.recordings[-1].tolist() == [24, 24, 10]
