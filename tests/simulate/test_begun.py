"""Starts of predictions of trials that lack states, against motions whose every state is a formula."""

import numpy as np
import pytest

from seatrial.data import DataError, Trial
from seatrial.simulate.begun import begun, drift, too_little, untold

T = np.arange(0.0, 60.0, 0.5)
R, U, V = 0.02, 3.0, -0.4


def _circle(*names, **changed):
    """A ship that turns at a constant rate with constant drift: the track is an arc about a fixed point."""
    psi = 0.3 + R * T
    arc = {
        "x": (U * np.sin(psi) + V * np.cos(psi)) / R, "y": (-U * np.cos(psi) + V * np.sin(psi)) / R, "psi": psi,
        "u": np.full(T.size, U), "v_m": np.full(T.size, V), "r": np.full(T.size, R),
    }  # fmt: skip
    return Trial("arc", T, {name: changed.get(name, arc[name]) for name in names}), arc


def _thinned(values, every, first):
    out = np.full(values.size, np.nan)
    out[first::every] = values[first::every]
    return out


def test_velocities_and_rate_are_those_of_track_and_heading():
    trial, arc = _circle("x", "y", "psi")
    state, good = begun(trial)
    assert good.all()
    inner = slice(3, -3)  # a chord over w seconds is short of the arc by (r w)^2/24
    for k, name in enumerate(("u", "v_m", "r"), start=3):
        assert state[inner, k] == pytest.approx(arc[name][inner], abs=1e-3 * U, rel=1e-3)


def test_positions_that_nothing_tells_are_zero_and_a_sway_without_a_track_too():
    state, good = begun(_circle("psi", "u", "r")[0])
    assert good.all()
    assert not state[:, :2].any()
    assert not state[:, 4].any()
    assert state[:, 3] == pytest.approx(U)


def test_a_heading_is_the_course_over_ground_of_a_track_and_else_the_integral_of_the_rate():
    trial, arc = _circle("x", "y")
    state, _ = begun(trial)
    assert state[3:-3, 2] == pytest.approx(arc["psi"][3:-3] + np.arctan2(V, U), abs=1e-3)
    state, _ = begun(_circle("u", "r", r=R * T)[0])  # the trapezoid is exact for a straight line
    assert state[:, 2] == pytest.approx(0.5 * R * T**2)


def test_a_gap_of_a_state_that_is_told_stays_one():
    _, arc = _circle("psi")
    gappy = arc["u"].copy()
    gappy[5] = np.nan
    state, good = begun(_circle("psi", "u", u=gappy)[0])
    assert np.flatnonzero(~good).tolist() == [5]
    assert np.isnan(state[5, 3])


def test_instruments_that_report_by_turns_are_bridged_between_their_first_and_last_readings():
    _, arc = _circle("psi")
    psi, u = _thinned(arc["psi"], 4, 1), _thinned(arc["u"], 4, 3)
    state, good = begun(_circle("psi", "u", psi=psi, u=u)[0])
    last = T.size - 1 - 2  # the last reading of the heading comes two rows before that of the speed
    assert np.flatnonzero(good).tolist() == list(range(3, last + 1 if np.isfinite(psi[last]) else last))
    assert state[good, 2] == pytest.approx(arc["psi"][good])


def test_slopes_are_of_the_stretch_that_was_read():
    """A line that is held beyond its readings would halve the speed of the first row."""
    _, arc = _circle("x")
    track = {name: _thinned(arc[name], 10, 7) for name in ("x", "y")}
    state, good = begun(_circle("x", "y", "psi", **track)[0])
    assert np.hypot(state[good, 3], state[good, 4]) == pytest.approx(np.hypot(U, V), rel=2e-3)


@pytest.mark.parametrize(
    ("names", "told"),
    [(("psi", "r"), "log the speed u, or positions"), (("u", "v_m"), "log the heading psi, or the rate of turn r"),
     (("x", "psi"), "log the speed u")],
)  # fmt: skip
def test_too_little_is_refused_with_what_would_do(names, told):
    trial, _ = _circle(*names)
    assert told in too_little(trial)
    with pytest.raises(DataError, match="arc: no channel"):
        untold(trial)


def test_an_empty_channel_is_no_reading():
    trial, _ = _circle("x", "y", "psi", "u", u=np.full(T.size, np.nan))
    assert untold(trial) == ("u", "v_m", "r")


CURRENT = 0.41, -0.23
"""North and east [m/s]."""


def _swaying(seed, heading, turn, current=CURRENT, noise=0.0, sway=-11.0):
    """A ship that weaves about a heading, or circles, and sways against its turn; seen from the ground."""
    psi = heading + (0.35 * np.sin(0.15 * T) if turn == 0.0 else turn * T)
    r = 0.0525 * np.cos(0.15 * T) if turn == 0.0 else np.full(T.size, turn)
    north, east = current
    u = 3.0 + north * np.cos(psi) + east * np.sin(psi)
    v_m = sway * r - north * np.sin(psi) + east * np.cos(psi)
    v_m = v_m + np.random.default_rng(seed).normal(0.0, noise, T.size)
    return Trial(f"{seed}", T, {"psi": psi, "r": r, "u": u, "v_m": v_m})


def test_a_drift_is_the_current_that_headings_tell_apart():
    trials = [_swaying(1, 0.2, 0.0), _swaying(2, 2.4, 0.0), _swaying(3, 4.0, 0.03)]
    assert drift(trials) == pytest.approx(CURRENT, abs=1e-9)
    noisy = [_swaying(k, heading, 0.0, noise=0.2) for k, heading in enumerate((0.2, 1.9, 3.1, 5.0))]
    # four times 120 rows of .2 m/s, half of them for each component
    assert drift(noisy) == pytest.approx(CURRENT, abs=3 * 0.2 / np.sqrt(240))


def test_a_turn_is_no_drift():
    """Two circles to either side in still water: their sway follows r alone."""
    assert drift([_swaying(1, 0.0, 0.1, (0.0, 0.0)), _swaying(2, 0.0, -0.1, (0.0, 0.0))]) == pytest.approx((0.0, 0.0))


def test_headings_all_alike_tell_no_drift():
    straight = [Trial(f"{k}", T, {"psi": np.full(T.size, 0.3), "r": np.zeros(T.size), "u": np.full(T.size, 3.0),
                                  "v_m": np.full(T.size, 0.2)}) for k in range(3)]  # fmt: skip
    assert drift(straight) == (0.0, 0.0)


def test_gaps_of_a_log_say_nothing_of_a_drift():
    trials = [_swaying(1, 0.2, 0.0), _swaying(2, 2.4, 0.0), _swaying(3, 4.0, 0.03)]
    torn = [trial.having(v_m=np.where(np.arange(T.size) % 7 == 3, np.nan, trial["v_m"])) for trial in trials]
    assert drift(torn) == pytest.approx(CURRENT, abs=1e-9)
