"""Logs whose instruments speak at rates of their own: what they contradict is found as on rows that hold all."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapes import sailed

from seatrial.data import Trial
from seatrial.data.check import check
from seatrial.data.prepare import at_one_rate

SLOW = ("x", "y", "u", "v_m")


def log(every: int = 5, rudder: int = 10, **kw: float) -> Trial:
    """Heading and rate at each row, fixes and speeds at every fifth one, the rudder at every tenth."""
    ship = sailed(duration=500.0, dt=0.2, **kw)
    noise = np.random.default_rng(3)
    channels = {name: ship[name].copy() for name in ("psi", "r", *SLOW, "delta")}
    for name, size in (("psi", 1e-3), ("r", 2e-4), ("x", 0.1), ("y", 0.1), ("u", 0.02), ("v_m", 0.02)):
        channels[name] += size * noise.standard_normal(ship.t.size)
    for name, step, first in (*((one, every, 2) for one in SLOW), ("delta", rudder, 3)):
        channels[name][np.arange(ship.t.size) % step != first % step] = math.nan
    return Trial("log", ship.t, channels, meta={"L_pp": 80.0})


def keys(trial: Trial) -> set[str]:
    return {one.key for one in check(trial) if one.severity == "error"}


def test_a_right_log_of_several_rates_has_no_error() -> None:
    assert not keys(log())


@pytest.mark.slow
@pytest.mark.parametrize(("channel", "factor", "key"), [
    ("r", 1.0 / 60.0, "unit"), ("r", -1.0, "sign"), ("delta", -1.0, "sign"), ("v_m", -1.0, "sign"),
    ("u", 1.0 / 0.514444, "unit"),
])  # fmt: skip
def test_a_fault_of_one_channel_is_named(channel: str, factor: float, key: str) -> None:
    trial = log()
    wrong = trial.having(**{channel: factor * trial[channel]})
    named = [one for one in check(wrong) if one.severity == "error" and one.key == key]
    assert any(channel in one.channels for one in named)


def test_values_at_one_rate_are_those_of_lines_between_readings() -> None:
    t = np.arange(0.0, 60.0, 0.1)
    slow = np.where(np.arange(t.size) % 10 == 4, 3.0 * t, math.nan)
    fast = np.sin(0.1 * t)
    gap = (t > 20.0) & (t < 26.0)
    trial = Trial("a", t, {"x": np.where(gap, math.nan, slow), "psi": fast, "delta": np.where(gap, math.nan, fast)})
    found = at_one_rate(trial, ("x", "psi"))
    assert np.allclose(np.diff(found.t), 1.0)
    there = np.isfinite(found["x"])
    assert np.allclose(found["x"][there], 3.0 * found.t[there])
    # from the last reading before the gap, at 19.4 s, to the first one behind it, at 26.4 s
    assert not there[(found.t > 19.4) & (found.t < 26.4)].any()
    assert there[(found.t > 0.4) & (found.t < 19.4)].all()
    assert np.allclose(found["psi"], np.sin(0.1 * found.t), atol=2e-5)
    assert np.isnan(found["delta"][(found.t > 20.0) & (found.t < 26.0)]).all()


def test_rows_that_hold_all_are_left_as_they_are() -> None:
    t = np.arange(0.0, 60.0, 0.1)
    holes = np.where(np.arange(t.size) % 17 == 0, math.nan, np.cos(t))
    trial = Trial("a", t, {"psi": holes, "r": np.sin(t)})
    assert at_one_rate(trial, ("psi", "r")) is trial
    rare = Trial("a", t, {"psi": np.cos(t), "depth": np.where(np.arange(t.size) % 300 == 0, 1.0, math.nan)})
    assert at_one_rate(rare, ("psi", "r")).t.size == t.size, "a depth sets no steps"


def test_seven_readings_in_ten_rows_are_a_rate() -> None:
    t = np.arange(0.0, 60.0, 0.1)
    some = np.isin(np.arange(t.size), np.round(np.arange(0.0, t.size, 10.0 / 7.0)).astype(int))
    found = at_one_rate(Trial("a", t, {"x": np.where(some, t, math.nan), "psi": t}), ("x", "psi"))
    assert np.isfinite(found["x"][:-1]).all()
    assert abs(found.dt - 1.0 / 7.0) < 1e-3
