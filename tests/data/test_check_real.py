"""Behaviour of instruments that is no fault, and faults that only some logs of a day have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from garden.logs import clean
from seatrial.data import Trial
from seatrial.data.check import Finding, check, check_folder
from seatrial.data.prepare import to_body, to_earth


@pytest.fixture(scope="module")
def day() -> list[Trial]:
    """The logs of a calm day of an independent simulator."""
    folder = clean()
    return [Trial(log.name, log.t, dict(log.table), {}, dict(folder.meta)) for log in folder.logs]


def keyed(found: tuple[Finding, ...], key: str) -> list[Finding]:
    return [one for one in found if one.key == key]


def late(trial: Trial, seconds: float, *names: str) -> Trial:
    return trial.having(**{n: np.interp(trial.t - seconds, trial.t, trial[n]) for n in names})


def swinging(seconds: float = 800.0, period: float = 400.0) -> Trial:
    """A slow zigzag of a ship, its compass read to three digits."""
    t = np.arange(0.0, seconds, 0.135)
    turn = 2.0 * np.pi / period
    psi, r = np.radians(25.0) * np.sin(turn * t), np.radians(25.0) * turn * np.cos(turn * t)
    u, v = np.full(t.size, 7.0), -80.0 * r
    north, east = to_earth(u, v, psi)
    noise = np.random.default_rng(0).normal(0.0, 1e-5, t.size)
    x, y = (np.cumsum(part) * 0.135 for part in (north, east))
    table = {"x": x, "y": y, "psi": np.radians(np.round(np.degrees(psi), 1)), "u": u + 1e3 * noise, "v_m": v + noise,
             "r": r + noise}  # fmt: skip
    return Trial("swinging", t, table, {}, {"L_pp": 320.0})


@pytest.mark.slow
def test_a_rounded_heading_rests_at_each_overshoot_and_is_not_frozen() -> None:
    trial = swinging()
    assert {one.key for one in check(trial) if one.severity != "info"} == set()
    psi = trial["psi"].copy()
    psi[1800:2300] = psi[1800]
    [stuck] = keyed(check(trial.having(psi=psi)), "frozen")
    assert stuck.channels == ("psi",)


@pytest.mark.slow
def test_a_peak_is_no_spike() -> None:
    trial = swinging()
    peak = trial["v_m"] - np.exp(-np.abs(trial.t - trial.t[3000]) / 0.5)
    assert keyed(check(trial.having(v_m=peak)), "spike") == []
    spike = trial["v_m"] - (np.arange(len(trial)) == 3000)
    [found] = keyed(check(trial.having(v_m=spike)), "spike")
    assert found.channels == ("v_m",)


@pytest.mark.slow
def test_a_lag_of_some_logs_is_told_of_each_of_them(day: list[Trial]) -> None:
    some = {trial.name for trial in day[1::3]}
    [found] = keyed(check_folder([late(t, 2.5, "r") if t.name in some else t for t in day]), "lag")
    assert (found.channels, set(found.trials)) == (("r",), some)


@pytest.mark.slow
def test_velocities_that_were_smoothed_over_ground_are_late_and_the_receiver_is_not_early(day: list[Trial]) -> None:
    def smoothed(trial: Trial) -> Trial:
        north, east = to_earth(trial["u"], trial["v_m"], trial["psi"])
        moved = replace(trial, channels={**trial.channels, "u": north, "v_m": east})
        moved = late(moved, 3.0, "u", "v_m")
        u, v = to_body(moved["u"], moved["v_m"], trial["psi"])
        return trial.having(u=u, v_m=v)

    [found] = keyed(check_folder([smoothed(trial) for trial in day]), "lag")
    assert found.what.startswith("u, v_m are late by 3")
