"""Bands of predictions on trials: calibrated where the model is right, and seen to fail where it is wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fitted_run import NOISE, PATHS, covariance, trial, truth
from seatrial.belief.bands.ahead import ahead
from seatrial.belief.bands.held import ALL, Held, held
from seatrial.core.parameters import read
from seatrial.data import Trial

MEAN = np.array([float(read(truth().model, path)) for path in PATHS])


def rows(trials: list[Trial], share: float, off: float = 0.0) -> tuple[Held, ...]:
    """Lines of an estimate that is off by a share, with a posterior of a relative deviation of `share`."""
    value = MEAN * (1.0 + off)
    ship = truth().having(dict(zip(PATHS, value.tolist(), strict=True)))
    draws = value + np.random.default_rng(3).standard_normal((200, 3)) @ np.sqrt(covariance(share))
    return held(ahead(ship, one, str(one.meta["kind"]), PATHS, draws, 50.0, NOISE) for one in trials)


@pytest.fixture(scope="module")
def trials() -> list[Trial]:
    return [trial(rudder, heading, side, seed=k) for k, (rudder, heading, side) in enumerate(
        [(35, None, 1), (20, None, -1), (25, None, 1), (30, None, -1), (15, None, 1), (20, 20, 1), (10, 10, -1),
         (15, 15, 1), (20, 10, -1), (10, 5, 1)])]  # fmt: skip


@pytest.mark.slow
def test_bands_of_a_right_model_hold(trials: list[Trial]) -> None:
    found = rows(trials, 0.001)
    assert [row.kind for row in found] == ["turning"] * 3 + ["zigzag"] * 3 + [ALL] * 3
    assert [row.horizon for row in found[:3]] == pytest.approx([5.0, 25.0, 50.0])
    assert [row.trials for row in found[-3:]] == [10, 10, 10]
    held = [share for row in found[-3:] for share in row.inside.values()]
    assert 0.90 <= np.mean(held) <= 0.98


@pytest.mark.slow
def test_bands_of_a_wrong_model_are_seen_to_fail(trials: list[Trial]) -> None:
    right, wrong = rows(trials, 0.001)[-1], rows(trials, 0.001, off=0.2)[-1]
    assert wrong.inside["position"] < 0.6
    assert wrong.distance > 2.0 * right.distance


@pytest.mark.slow
def test_a_wide_posterior_covers_what_it_is_off_by(trials: list[Trial]) -> None:
    assert np.mean([*rows(trials, 0.2, off=0.1)[-1].inside.values()]) >= 0.9


def test_windows_beyond_the_end_or_in_a_gap_do_not_count() -> None:
    short, gap = trial(20, duration=30.0), trial(20, duration=30.0)
    x = gap["x"].copy()
    x[48:53] = np.nan  # 25 s after the start, where the second horizon lies
    one, other = rows([short], 0.01), rows([gap.having(x=x)], 0.01)
    assert [row.horizon for row in one] == pytest.approx([5.0, 25.0])
    assert [row.horizon for row in other] == pytest.approx([5.0, 25.0])
    assert other[1].error["psi"] == one[1].error["psi"]
    assert np.isnan(other[1].distance)


@pytest.mark.slow
def test_a_draw_that_blows_up_takes_no_band_from_the_others() -> None:
    """It counted every reading as outside: bands that held were told to hold in none."""
    draws = MEAN + np.random.default_rng(3).standard_normal((200, 3)) @ np.sqrt(covariance(0.01))
    lost = np.vstack([draws, [[-0.3, 1e12, 0.5]]])
    whole, one = (held([ahead(truth(), trial(20), "turning", PATHS, some, 50.0, NOISE)]) for some in (draws, lost))
    for with_all, with_lost in zip(whole, one, strict=True):
        assert with_lost.inside == pytest.approx(with_all.inside, abs=0.2)
        assert with_lost.width == pytest.approx(with_all.width, rel=0.3)  # edges of 200 draws scatter by 8 %


def test_a_slow_receiver_is_known_between_its_readings() -> None:
    """A fix every fourth row: the distance is that of all readings, within what the track curves in two seconds."""
    whole = trial(20, duration=60.0)
    slow = np.arange(len(whole)) % 4 == 1
    sparse = whole.having(x=np.where(slow, whole["x"], np.nan), y=np.where(slow, whole["y"], np.nan))
    for one, other in zip(rows([whole], 0.01), rows([sparse], 0.01), strict=True):
        assert other.distance == pytest.approx(one.distance, abs=0.1)
        assert other.error["psi"] == pytest.approx(one.error["psi"], abs=one.horizon * NOISE["r"])


def test_a_band_of_known_parameters_is_as_wide_as_the_readings_at_both_ends() -> None:
    """Of the heading: its own reading at the start and at the end, and the rate that was read at the start."""
    first = rows([trial(20)], 1e-9)[0]
    least = 1.96 * math.sqrt(2.0) * NOISE["psi"]
    most = 1.96 * math.hypot(math.sqrt(2.0) * NOISE["psi"], first.horizon * NOISE["r"])
    assert 0.88 * least <= first.width["psi"] <= 1.12 * most
