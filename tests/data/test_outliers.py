"""What no instrument measured is found before a unit, an axis or a clock is accused; few lost rows are bridged."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from sailed import sail, zigzag

from seatrial.data import Trial
from seatrial.data.check import check
from seatrial.data.prepare import mended

FAR = 5.6e6
"""Metres from latitude and longitude 0, as in the north sea."""


def voyage(duration: float = 400.0) -> Trial:
    """Zigzags of a model with noise, far from latitude and longitude 0."""
    trial = sail(zigzag(15.0, 15.0), duration)
    v_m = 0.01 * np.random.default_rng(1).standard_normal(len(trial))
    trial = trial.having(x=trial["x"] + FAR, y=trial["y"] + 0.1 * FAR, v_m=v_m)
    course = trial["psi"] + np.arctan2(trial["v_m"], trial["u"])
    return trial.having(U_G=np.hypot(trial["u"], trial["v_m"]), gamma_G=course)


def holed(trial: Trial, rows: NDArray[np.bool_], **values: float) -> Trial:
    return trial.having(**{name: np.where(rows, value, trial[name]) for name, value in values.items()})


def gaps_told(trial: Trial) -> dict[str, NDArray[np.bool_]]:
    """Rows by channel of which the findings make gaps; no other cause may be told as an error."""
    found = check(trial)
    assert not [one for one in found if one.severity == "error"], [str(one) for one in found]
    assert {one.kind for one in found} <= {"quality"}, [str(one) for one in found]
    steps = [step for one in found for step in one.steps if step.do == "gaps"]
    [clean] = mended(trial, steps)
    return {name: np.isnan(clean[name]) for name in trial.channels if np.isnan(clean[name]).any()}


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.005, 0.05, 0.3])
@pytest.mark.parametrize("first", [True, False])
def test_fixes_at_latitude_and_longitude_zero_are_gaps_of_all_that_the_receiver_told(share: float, first: bool) -> None:
    trial = voyage()
    lost = np.random.default_rng(3).random(len(trial)) < share
    lost[0] = first  # a receiver that starts up
    spoilt = holed(trial, lost, x=0.0, y=0.0, u=0.0, v_m=0.0, U_G=0.0, gamma_G=0.0)
    told = gaps_told(spoilt)
    assert set(told) == {"x", "y", "u", "v_m", "U_G", "gamma_G"}
    for name, rows in told.items():
        assert np.array_equal(rows, lost), name


@pytest.mark.slow
def test_a_receiver_without_a_fix_for_the_first_minute_is_found() -> None:
    trial = voyage()
    lost = trial.t < 60.0
    told = gaps_told(holed(trial, lost, x=0.0, y=0.0))
    assert set(told) == {"x", "y"}
    assert all(np.array_equal(rows, lost) for rows in told.values())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "value"),
    [("u", -999.0), ("u", 52.63), ("v_m", 9999.0), ("r", 32.767), ("x", -999999.0), ("delta", math.radians(999.0)),
     ("U_G", 52.63), ("y", 1e9)],
)  # fmt: skip
@pytest.mark.parametrize("share", [0.003, 0.2])
def test_numbers_that_stand_for_no_value_are_no_unit(name: str, value: float, share: float) -> None:
    trial = voyage()
    lost = np.random.default_rng(5).random(len(trial)) < share
    told = gaps_told(holed(trial, lost, **{name: value}))
    assert np.array_equal(told[name], lost)
    assert set(told) <= ({"x", "y"} if name in ("x", "y") else {name})


def test_two_numbers_for_no_value_are_both_found() -> None:
    trial = voyage()
    u = trial["u"].copy()
    u[50:60], u[500:505] = -999.0, 999.0
    assert np.array_equal(np.flatnonzero(gaps_told(trial.having(u=u))["u"]), np.r_[50:60, 500:505])


@pytest.mark.slow
def test_a_trial_that_goes_on_elsewhere_after_a_leap_of_time_is_no_outlier() -> None:
    trial = voyage()
    away = np.where(trial.t < 60.0, 50_000.0, 0.0)
    moved = replace(trial.having(x=trial["x"] + away), t=trial.t + np.where(trial.t < 60.0, 0.0, 86_400.0))
    assert not {one.key for one in check(moved)} & {"zeros", "sentinel", "spike"}


@pytest.mark.slow
def test_a_short_hard_turn_in_a_straight_run_is_no_outlier() -> None:
    """Rates of turn far beyond those of the rest, in few rows, are what the ship did."""
    trial = voyage()
    turning = (trial.t > 200.0) & (trial.t < 204.0)
    quiet = trial.having(r=np.where(turning, 0.09, 0.0) + 1e-3 * np.sin(trial.t))
    assert not any("r" in one.channels for one in check(quiet) if one.key in ("zeros", "sentinel", "spike"))


def without_rows(trial: Trial, *bursts: slice) -> Trial:
    kept = np.ones(len(trial), dtype=np.bool_)
    for burst in bursts:
        kept[burst] = False
    return trial.rows(kept)


def sailed() -> Trial:
    trial = sail(zigzag(15.0, 15.0), 600.0)
    return trial.having(v_m=0.01 * np.random.default_rng(1).standard_normal(len(trial)))


def remedied(trial: Trial) -> tuple[Trial, ...]:
    steps = [step for one in check(trial) for step in one.steps]
    order = sorted(steps, key=lambda step: step.do not in ("gaps", "cut"))
    return mended(trial, order)


@pytest.mark.slow
def test_one_row_in_a_hundred_that_was_lost_cuts_no_trial() -> None:
    """A fit interpolates over up to ten steps: so does the remedy, and what it fills is what the ship did."""
    trial = sailed()
    begin = np.random.default_rng(2).choice(np.arange(20, 2900, 60), 8, replace=False)
    holes = [slice(int(a), int(a) + n) for a, n in zip(begin, (1, 1, 1, 2, 3, 5, 8, 9), strict=True)]
    [whole] = remedied(without_rows(trial, *holes))
    assert np.allclose(whole.t, trial.t)
    assert np.isfinite(whole["delta"]).all()
    # a straight line over ten rows misses an arc by u r h^2 / 8
    bow = 1.2 * 0.06 * (10 * trial.dt) ** 2 / 8.0
    assert np.abs(whole["x"] - trial["x"]).max() < bow + 5.0 * 0.03 * math.sqrt(2.0)


@pytest.mark.slow
def test_a_trial_is_divided_where_more_than_ten_rows_are_lost_and_nowhere_else() -> None:
    trial = sailed()
    holes = [slice(100, 101), slice(400, 404), slice(1000, 1030), slice(2000, 2002), slice(2500, 2512)]
    parts = remedied(without_rows(trial, *holes))
    edges = [(0, 999), (1030, 2499), (2512, 2999)]
    assert np.allclose([(part.t[0], part.t[-1]) for part in parts], 0.2 * np.array(edges))
    assert all(np.isfinite(part.stack(*part.channels)).all() for part in parts)


@pytest.mark.slow
def test_short_gaps_of_a_control_are_filled_and_only_long_ones_cut_out() -> None:
    trial = sailed()
    delta = trial["delta"].copy()
    for hole in (slice(100, 101), slice(400, 404), slice(1000, 1030), slice(2000, 2009)):
        delta[hole] = np.nan
    parts = remedied(trial.having(delta=delta))
    assert np.allclose([(part.t[0], part.t[-1]) for part in parts], [(0.0, 199.8), (206.0, 599.8)])
    assert all(np.isfinite(part["delta"]).all() for part in parts)


@pytest.mark.slow
def test_what_is_cut_out_does_not_cut_where_rows_were_lost() -> None:
    """A cut divides at its own stretch; leaps of time beside it are those of another step."""
    trial = sailed()
    lost = without_rows(trial, slice(300, 302), slice(700, 701))
    delta = np.where((lost.t > 400.0) & (lost.t < 410.0), np.nan, lost["delta"])
    parts = remedied(lost.having(delta=delta))
    assert len(parts) == 2
    assert all(np.allclose(np.diff(part.t), 0.2) for part in parts)
