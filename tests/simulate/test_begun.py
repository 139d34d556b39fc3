"""Starts of predictions of trials that lack states, against motions whose every state is a formula."""

import numpy as np
import pytest

from seatrial.data import DataError, Trial
from seatrial.simulate.begun import begun, too_little, untold

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
