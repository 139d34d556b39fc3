"""A rudder indicator that sticks, among flickers whose longest is a matter of chance."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.data.check.controls.rudder import stuck_faults

DEG = math.pi / 180.0


def flickering(seed: int) -> Trial:
    """1200 rows of 20 deg to either side; an indicator of 0.1 deg with 0.05 deg of noise repeats two rows of three.

    Its longest repeat is then about ln 1200 / ln 1.6 = 15 rows, and up to twice that in some of many logs.
    """
    t = np.arange(1200.0)
    told = 20.0 * np.sign(np.sin(2 * math.pi * t / 160.0)) + 0.04 * np.random.default_rng(seed).standard_normal(t.size)
    return Trial(f"log {seed}", t, {"delta": np.round(told, 1) * DEG})


def longest(trial: Trial) -> int:
    ends = np.flatnonzero(np.diff(trial["delta"]) != 0)
    return int(np.diff(ends).max())


def test_every_log_in_which_it_stuck_is_cut_there() -> None:
    """Also those in which an indicator that works repeats a value for longer than usual."""
    logs = [flickering(seed) for seed in range(40)]
    assert sum(longest(log) > 15 for log in logs) >= 5
    stuck = []
    for log in logs:
        delta = log["delta"].copy()
        delta[400:700] = delta[400]
        stuck.append(log.having(delta=delta))
    [fault] = stuck_faults(stuck)
    assert [step.trials for step in fault.remedy.steps] == [(log.name,) for log in logs]
    for log, step in zip(stuck, fault.remedy.steps, strict=True):
        [(since, until)] = step.where
        assert since <= 400.0
        assert until >= 699.0
        assert np.ptp(log["delta"][int(since) : int(until) + 1]) == 0.0  # it may have shown that value before


@pytest.mark.slow
def test_no_flicker_is_a_stuck_rudder() -> None:
    assert [*stuck_faults([flickering(seed) for seed in range(200)])] == []


def test_three_digits_hide_the_noise_beyond_ten_degrees() -> None:
    """9.94 deg flickers, and 10.7 deg does not: the log of a model basin, as written to three digits."""
    t = np.arange(3000) * 0.02
    told = np.where(t < 30.0, 9.94, -10.72) + 0.004 * np.random.default_rng(2).standard_normal(t.size)
    told[:40], told[1500:1530] = np.linspace(-9.0, 9.94, 40), np.linspace(9.94, -10.72, 30)
    told[-10:] = np.linspace(-10.72, 0.0, 10)
    rounded = np.array([float(f"{value:.3g}") for value in told])
    assert longest(Trial("basin", t, {"delta": rounded * DEG})) > 1000
    assert [*stuck_faults([Trial("basin", t, {"delta": rounded * DEG})])] == []
    frozen = np.round(told, 2)
    frozen[1600:2900] = frozen[1600]
    assert len([*stuck_faults([Trial("stuck", t, {"delta": frozen * DEG})])]) == 1
