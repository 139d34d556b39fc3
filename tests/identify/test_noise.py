"""Sensor noise and outliers are read off logs, whatever the signal beneath."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.identify.noise import noise, outliers, resolution, screened, sensor_noise

T = np.arange(0.0, 600.0, 1.0)
SWING = np.sin(T / 20.0) * np.sin(T / 47.0)


@pytest.mark.parametrize("dt", [0.1, 1.0])
@pytest.mark.parametrize("level", [0.001, 0.03])
def test_noise_on_a_motion_is_found_within_a_tenth(dt: float, level: float) -> None:
    t = np.arange(0.0, 600.0, dt)
    motion = np.sin(t / 20.0) * np.sin(t / 47.0)
    values = motion + np.random.default_rng(0).normal(0.0, level, t.size)
    assert sensor_noise(values) == pytest.approx(level, rel=0.1)


def test_spikes_do_not_count_as_noise() -> None:
    values = SWING + np.random.default_rng(1).normal(0.0, 0.01, T.size)
    values[[50, 300]] += 5.0
    assert sensor_noise(values) == pytest.approx(0.01, rel=0.15)


def test_rounding_is_noise() -> None:
    rounded = np.round(SWING / 0.01) * 0.01
    assert resolution(rounded) == pytest.approx(0.01)
    assert sensor_noise(rounded) == pytest.approx(0.01 / math.sqrt(12.0), rel=0.3)


def test_outliers_are_what_jumps_off_and_back() -> None:
    values = SWING + np.random.default_rng(2).normal(0.0, 0.01, T.size)
    assert not outliers(values, 0.01).any()
    values[50] += 0.5
    values[200:203] -= 0.3
    assert np.flatnonzero(outliers(values, 0.01)).tolist() == [50, 200, 201, 202]


def test_a_lasting_step_and_a_bad_channel_are_no_outliers() -> None:
    values = SWING + np.random.default_rng(3).normal(0.0, 0.01, T.size)
    stepped = values + 0.5 * (T > 300.0)
    assert not outliers(stepped, 0.01).any()
    torn = values + np.where(np.arange(T.size) % 10 == 0, 1.0, 0.0)
    assert not outliers(torn, 0.01).any()


def _trial(**channels: Any) -> Trial:
    still = {name: np.zeros(T.size) for name in ("x", "y", "psi", "u", "v_m", "r", "delta", "n_P")}
    return Trial("a", T, {**still, **channels})


def test_a_sidecar_decides_and_constant_channels_are_left_out() -> None:
    rng = np.random.default_rng(4)
    trial = _trial(u=SWING + rng.normal(0.0, 0.02, T.size), r=SWING)
    told = Trial(trial.name, trial.t, trial.channels, meta={"noise": {"u": 0.5}})
    assert set(noise([trial])) == {"u", "r"}
    assert noise([trial])["u"] == pytest.approx(0.02, rel=0.15)
    assert noise([told])["u"] == pytest.approx(0.5)


def test_a_spike_across_half_a_turn_is_one_reading() -> None:
    psi = 3.0 + 0.3 * SWING + np.random.default_rng(5).normal(0.0, 0.002, T.size)
    psi[100] += 0.8  # beyond pi, so that it wraps
    trial = _trial(psi=(psi + math.pi) % (2.0 * math.pi) - math.pi)
    clean = screened([trial], {"psi": 0.002})
    assert clean.rejected == {"a": {"psi": 1}}
    assert np.flatnonzero(~np.isfinite(clean.trials[0]["psi"])).tolist() == [100]
