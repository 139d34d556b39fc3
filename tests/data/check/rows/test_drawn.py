"""Straight lines over gaps, among readings with noise; and what draws lines and was read."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.data import Array, Trial
from seatrial.data.check.rows.drawn import line_faults, lines
from seatrial.data.prepare import Remedy

T = np.arange(0.0, 300.0, 0.5)
GAP = slice(200, 241)  # its first and last row were read


def noisy(seed: int = 0, sigma: float = 0.01) -> Array:
    return np.sin(T / 20.0) + sigma * np.random.default_rng(seed).standard_normal(T.size)


def bridged(values: Array, t: Array = T, gap: slice = GAP) -> Array:
    out = values.copy()
    inside, ends = t[gap], [gap.start, gap.stop - 1]
    out[gap] = np.interp(inside, t[ends], values[ends])
    return out


@pytest.mark.parametrize("seed", range(5))
def test_a_line_over_a_gap_is_found_to_the_row_and_noise_has_none(seed: int) -> None:
    assert not lines(T, noisy(seed)).any()
    drawn = np.flatnonzero(lines(T, bridged(noisy(seed))))
    assert (drawn[0], drawn[-1], drawn.size) == (201, 239, 39)


def test_a_line_is_straight_over_time_and_not_over_rows() -> None:
    t = np.cumsum(np.random.default_rng(3).uniform(0.3, 0.7, T.size))
    assert lines(t, bridged(noisy(), t)).sum() == 39
    assert not lines(t, bridged(noisy(), T)).any()  # straight by the number of the row


def test_short_lines_are_a_chance_where_many_are() -> None:
    """A line of eleven rows has nine second differences; a receiver slower than its log has lines everywhere."""
    assert not lines(T, bridged(noisy(), gap=slice(200, 211))).any()
    assert lines(T, bridged(noisy(), gap=slice(200, 213))).sum() == 11
    slow = np.interp(T, T[::10], noisy()[::10])
    assert not lines(T, slow).any()


def test_smooth_curves_and_digits_draw_no_lines() -> None:
    assert not lines(T, np.where(T < 100.0, T, 100.0 + np.sin(T - 100.0))).any()  # simulated, straight ahead at first
    ramp = np.round(np.clip(T - 150.0, 0.0, 40.0) + noisy(1, 0.2) - np.sin(T / 20.0), 1)
    ramp[320:360] = ramp[320] + 0.5 * np.arange(40)  # five digits a row
    assert not lines(T, ramp).any()
    off = ramp.copy()
    off[320:360] = ramp[320] + 0.47 * np.arange(40)
    assert lines(T, off).sum() == 38


def test_within_a_ship_time_most_motion_is_a_line() -> None:
    one = Trial("a", T, {"x": bridged(noisy())}, meta={"L_pp": 9.81 * 19.9**2})  # the line lasts 20 s
    assert line_faults(one)[0]
    assert not line_faults(Trial("a", T, dict(one.channels), meta={"L_pp": 9.81 * 20.1**2}))[0]


def test_lines_over_the_same_rows_are_one_and_masked() -> None:
    trial = Trial("a", T, {"x": bridged(noisy(1)), "y": bridged(noisy(2)), "delta": bridged(noisy(3)),
                           "psi": noisy(4)})  # fmt: skip
    (positions,), masked = line_faults(trial.having(delta=noisy(3)))
    assert positions.channels == ("x", "y")
    assert "t = 100.5 to 119.5 s" in positions.evidence
    assert isinstance(positions.remedy, Remedy)
    mended = positions.remedy.repair(trial)
    for one in (masked, mended):
        assert np.isnan(one["x"][201:240]).all()
        assert np.isfinite(one["x"]).sum() == T.size - 39
        assert np.isfinite(one["psi"]).all()
    (both,), _ = line_faults(trial)
    assert both.channels == ("x", "y", "delta")
    assert isinstance(both.remedy, Remedy)
    assert [step.do for step in both.remedy.steps] == ["cut"]  # an input has no value there
