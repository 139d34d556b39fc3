"""Factors by recording: their coverage on recordings that were never seen, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.belief.bands.conformal import factors, needed
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
def test_too_few_recordings_are_refused_with_the_number_that_is_needed(level: float, least: int) -> None:
    assert needed(level) == least
    rng = np.random.default_rng(5)
    found, names = scores(least - 1, 4, 0.0, rng)
    with pytest.raises(RequestError, match=f"{least - 1} recordings, and at least {least} are needed"):
        factors(found, names, ["turn"] * len(names), level)
    found, names = scores(least, 4, 0.0, rng)
    assert np.isfinite(factors(found, names, ["turn"] * len(names), level).factor).all()


def test_a_horizon_that_few_recordings_reach_has_no_factor() -> None:
    rng = np.random.default_rng(6)
    found, names = scores(24, 4, 0.0, rng)
    later = np.where(np.arange(len(found))[:, None, None] < 10 * 4, found, np.nan)
    made = factors(np.concatenate([found, found, later], axis=1), names, ["turn"] * len(names), 0.95)
    assert np.isfinite(made.factor[0, :2, 0]).all()
    assert np.isnan(made.factor[0, 2, 0])
    assert made.recordings[-1].tolist() == [24, 24, 10]
