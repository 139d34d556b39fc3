"""What a prediction takes of a log: controls, wind, sea and depth row by row, gaps, starts, and what it says."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatrial.data import DataError, Trial
from seatrial.environment import CHANNELS
from seatrial.ships.files import load
from seatrial.simulate.replay import (
    gap_words,
    gaps,
    inputs,
    no_wind,
    own_states,
    predicted,
    prepared,
    unread,
    wind_of,
    wind_words,
)
from seatrial.simulate.starts import smoothed_starts

L7 = load("kvlcc2_l7").model
N = len(L7.controls)
T = np.arange(0.0, 4.0, 0.5)


def log(meta: dict[str, Any] | None = None, **channels: Any) -> Trial:
    """Eight rows of a ship that sails north-east, with the rudder and revolutions given."""
    given = {"delta": np.linspace(0.0, 0.35, 8), "n_P": np.full(8, 11.0), "psi": np.full(8, math.pi / 4)}
    given |= {"u": np.full(8, 1.0), "v_m": np.full(8, 0.1), "r": np.zeros(8), "x": T, "y": T}
    given |= {name: np.broadcast_to(np.asarray(value, dtype=float), 8).copy() for name, value in channels.items()}
    return Trial("log", T, given, meta=meta or {})


def around(trial: Trial) -> dict[str, np.ndarray]:
    return dict(zip(CHANNELS, inputs(trial, L7)[:, N:].T, strict=True))


def test_a_log_is_taken_by_its_components_and_over_its_depth() -> None:
    """Speeds and heights times cosine and sine of their own bearing, the mean period, and one over the depth."""
    got = around(log(U_T=[8.0] * 4 + [9.0] * 4, gamma_T=0.3, U_C=0.4, gamma_C=2.0, H_S=1.5, gamma_W=-1.0, T_W=7.0,
                     depth=[20.0] * 4 + [25.0] * 4))  # fmt: skip
    assert got["wind_x"] == pytest.approx([8.0 * math.cos(0.3)] * 4 + [9.0 * math.cos(0.3)] * 4)
    assert got["wind_y"] == pytest.approx([8.0 * math.sin(0.3)] * 4 + [9.0 * math.sin(0.3)] * 4)
    assert (got["current_x"][0], got["current_y"][0]) == pytest.approx((0.4 * math.cos(2.0), 0.4 * math.sin(2.0)))
    assert (got["wave_x"][0], got["wave_y"][0]) == pytest.approx((1.5 * math.cos(1.0), -1.5 * math.sin(1.0)))
    assert got["wave_T"] == pytest.approx([7.0] * 8)
    assert got["per_depth"] == pytest.approx([0.05] * 4 + [0.04] * 4)
    bare = around(log(U_C=0.4, H_S=1.5, gamma_T=0.3))  # a size without a direction is none
    assert not any(column.any() for column in bare.values())


def test_controls_act_with_the_mean_of_two_rows_and_held_ones_with_the_first() -> None:
    delta = np.linspace(0.0, 0.35, 8)
    at = L7.controls.index("delta")
    assert inputs(log(), L7)[:-1, at] == pytest.approx(0.5 * (delta[:-1] + delta[1:]))
    assert inputs(log(), L7)[-1, at] == pytest.approx(0.35)
    assert inputs(log({"held": ["delta"]}), L7)[:, at] == pytest.approx(delta)


def test_gaps_are_filled_with_the_value_before_and_told() -> None:
    nan = math.nan
    trial = log({"held": ["delta"]}, delta=[nan, 0.1, nan, nan, 0.2, 0.2, nan, 0.3], depth=[10.0, nan] * 4, U_T=nan)
    series = inputs(trial, L7)
    assert series[:, L7.controls.index("delta")] == pytest.approx([0.1, 0.1, 0.1, 0.1, 0.2, 0.2, 0.2, 0.3])
    assert series[:, N + CHANNELS.index("per_depth")] == pytest.approx([0.1] * 8)
    assert series[:, N] == pytest.approx(0.0)
    missing = gaps(trial, L7)
    assert {name: int(rows.sum()) for name, rows in missing.items()} == {"delta": 4, "depth": 4}
    assert "delta has no value in 4 of 8 rows (up to 1 s on end)" in gap_words(trial, missing)
    assert "depth has no value in 4 of 8 rows (up to 0.5 s on end)" in gap_words(trial, missing)
    assert gaps(log(), L7) == {}


def test_between_the_readings_of_a_slower_instrument_nothing_is_unread() -> None:
    nan = math.nan
    slow = log(delta=[nan, 0.1, nan, nan, 0.2, nan, nan, 0.3], depth=[10.0, nan] * 4)
    assert unread(slow, L7) == {}
    fast = log(delta=[0.1, 0.1, 0.1, nan, nan, 0.2, 0.2, 0.2], depth=[10.0, 10.0, 10.0, nan, nan, nan, 10.0, nan])
    assert {name: np.flatnonzero(rows).tolist() for name, rows in unread(fast, L7).items()} == {
        "delta": [3, 4], "depth": [3, 4, 5, 7]}  # fmt: skip


def test_an_apparent_wind_is_a_true_one_by_heading_and_speed() -> None:
    """A true wind from a bearing, felt aboard as wind plus motion, comes back; a true wind that is logged wins."""
    U, gamma, psi, u, v = 9.0, 1.9, math.pi / 4, 1.0, 0.1
    ahead, aside = U * math.cos(gamma - psi) + u, U * math.sin(gamma - psi) + v
    felt = {"U_A": math.hypot(ahead, aside), "gamma_A": math.atan2(aside, ahead)}
    north, east = wind_of(log(**felt)) or (None, None)
    assert north == pytest.approx([U * math.cos(gamma)] * 8)
    assert east == pytest.approx([U * math.sin(gamma)] * 8)
    assert around(log(**felt))["wind_y"] == pytest.approx([U * math.sin(gamma)] * 8)
    both = wind_of(log(**felt, U_T=3.0, gamma_T=0.0))
    assert both is not None
    assert (both[0][0], both[1][0]) == pytest.approx((3.0, 0.0))
    assert wind_of(log(U_A=3.0)) is None
    assert set(gaps(log(U_A=[5.0] * 7 + [math.nan], gamma_A=0.3), L7)) == {"U_A"}


def test_what_is_made_of_a_wind_is_said() -> None:
    felt = {"U_A": 5.0, "gamma_A": 0.3}
    assert "computed from U_A, gamma_A" in wind_words(log(**felt), felt=True)
    assert "left out" in wind_words(log(**felt), felt=False)
    for silent in (log(), log(**felt, U_T=3.0, gamma_T=0.0), log(U_A=0.0, gamma_A=0.3), log(U_A=5.0)):
        assert not wind_words(silent, felt=True)
    assert no_wind(log(), L7)
    assert not no_wind(log(**felt), L7)


def test_heel_is_bridged_and_its_rate_is_its_slope() -> None:
    model = load("naval_blanke").model
    n = len(model.controls)
    heel = 0.02 * T
    broken = np.where(np.arange(8) == 3, math.nan, heel)
    series = np.zeros((8, n + len(CHANNELS)))
    found = own_states(log(phi=broken), model, series, 0.5)
    assert found[:, 0] == pytest.approx(heel)
    assert found[:, 1] == pytest.approx([0.02] * 8)
    assert own_states(log(phi=heel, p=0.5), model, series, 0.5)[:, 1] == pytest.approx([0.5] * 8)
    assert not own_states(log(), model, series, 0.5)[:, :2].any()


def test_a_prediction_starts_at_the_first_whole_row_of_each_interval() -> None:
    """Rows before the first whole one are left out; a restart within a gap waits for its end."""
    ship, nan = load("kvlcc2_l7"), math.nan
    trial = log(u=[nan, 1.0, 1.1, 1.2, nan, nan, 1.5, 1.6], psi=[3.0, 3.1, -3.1, -3.0, -2.9, -2.8, -2.7, -2.6])
    ready = prepared(ship, trial, restart=1.5)
    assert ready.t == pytest.approx(T[1:])
    assert list(ready.starts) == [0, 5]  # t = 0.5 and, as 2.0 and 2.5 are broken, 3.0
    assert ready.begun[:, 3] == pytest.approx([1.0, 1.5])
    assert ready.state[:, 2] == pytest.approx([3.1, *(np.array([-3.1, -3.0, -2.9, -2.8, -2.7, -2.6]) + math.tau)])
    assert (ready.dt, ready.steps) == (0.5, 6)
    assert ready.lanes[0, :5] == pytest.approx(inputs(trial, ship.model)[1:6])
    assert ready.lanes[1, :2] == pytest.approx(inputs(trial, ship.model)[6:8])
    assert predicted(trial) == slice(1, 8)
    assert predicted(log(u=[1.0] * 6 + [nan] * 2)) == slice(0, 6)
    assert predicted(log(u=nan)) == slice(0, 8)  # the track tells the speed
    assert predicted(log(u=nan, x=nan)) == slice(None)
    assert predicted(Trial("bare", T, {"u": T})) == slice(None)
    later = prepared(ship, log(), restart=None, begin=(2.0, np.arange(6.0)))
    assert later.t == pytest.approx(T[4:])
    assert later.begun[0, :6].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    with pytest.raises(DataError, match="no two rows from t = 3"):
        prepared(ship, log(), restart=None, begin=(3.5, np.arange(6.0)))
    with pytest.raises(DataError, match="1 complete rows"):
        prepared(ship, log(u=[nan] * 7 + [1.0]), restart=None)
    with pytest.raises(DataError, match="restart is 0 s"):
        prepared(ship, log(), restart=0.0)


def test_a_start_is_the_weighted_fit_of_places_and_rates_together() -> None:
    """Heading by least squares with both scatters known, as the normal equations give it; the rest by rotation."""
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 6.0, 0.1)
    psi, r = 0.4 + 0.05 * t + 0.004 * t**2, 0.05 + 0.008 * t
    u, v_m = 4.0 + 0.02 * t, -0.3 + 0.01 * t
    state = np.column_stack([10.0 + 3.0 * t, -5.0 + t, psi, u, v_m, r]) + rng.normal(0.0, 0.01, (60, 6))
    (found,) = smoothed_starts(t, state, [59], 3.0)
    past = slice(29, 60)
    tau = t[past] - t[59]
    place, rate = np.vander(tau, 3, increasing=True), np.column_stack([np.zeros(31), np.ones(31), 2.0 * tau])

    def end(values: Any, rates: Any) -> Any:
        left = [values - place @ np.linalg.pinv(place) @ values, rates - rate @ np.linalg.pinv(rate) @ rates]
        w, z = 28.0 / (left[0] @ left[0]), 29.0 / (left[1] @ left[1])
        normal = w * place.T @ place + z * rate.T @ rate
        return np.linalg.solve(normal, w * place.T @ values + z * rate.T @ rates)[:2]

    rows = state[past]
    heading, turn = end(rows[:, 2], rows[:, 5])
    c, s = np.cos(rows[:, 2]), np.sin(rows[:, 2])
    x, north = end(rows[:, 0], c * rows[:, 3] - s * rows[:, 4])
    y, east = end(rows[:, 1], s * rows[:, 3] + c * rows[:, 4])
    c, s = math.cos(heading), math.sin(heading)
    assert found == pytest.approx([x, y, heading, c * north + s * east, c * east - s * north, turn], rel=1e-9)
    assert (smoothed_starts(t, state, [5], 0.55) != state[5]).any()  # six rows are enough
    assert (smoothed_starts(t, state, [5], 0.45) == state[5]).all()
