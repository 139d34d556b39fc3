"""Waves are found while a twin settles, by what changes within a length; what lasts is not taken for waves."""

from __future__ import annotations

import numpy as np
import pytest

from linear_ship import CHANNELS, NOISE, machine
from sea_logs import NOISE as READ
from sea_logs import Bridge, sailed
from seatrial.realtime.twin.follow import Step
from seatrial.realtime.twin.live import Live
from seatrial.realtime.twin.settings import usual
from seatrial.realtime.twin.tally import Roughness
from seatrial.ships.files import load


def seen(off: np.ndarray) -> Roughness:
    """Innovations of the linear ship (20 s to its length), one row a second, shape (rows, 5), as large as stated."""
    sea, empty = Roughness(), np.zeros(0)
    for k, row in enumerate(off):
        sea.note(Step(float(k), 1.0, np.arange(5), np.ones(5, dtype=bool), row, np.diag(NOISE**2), empty, empty,
                      empty, empty, empty, empty, empty))  # fmt: skip
    return sea


def noise(rows: int = 400) -> np.ndarray:
    return NOISE * np.random.default_rng(3).standard_normal((rows, 5))


def test_noise_as_stated_is_no_sea() -> None:
    assert seen(noise()).noise(machine()) == {}


def test_a_wave_of_the_heading_makes_compass_and_gyro_as_rough_as_it_is() -> None:
    """A sine of six seconds: variance half its squared amplitude, beside that of the noise."""
    off, t = noise(), np.arange(400.0)
    psi, r = CHANNELS.index("psi"), CHANNELS.index("r")
    off[:, psi] += 0.01 * np.sin(2.0 * np.pi * t / 6.1)
    off[:, r] += 0.01 * np.cos(2.0 * np.pi * t / 6.1)
    found = seen(off).noise(machine())
    assert set(found) == {"compass", "rate gyro"}
    # the mean over ten seconds takes a part of the wave with it, up to the share of a half wave in ten seconds
    for name, of in (("compass", NOISE[psi]), ("rate gyro", NOISE[r])):
        assert found[name] ** 2 == pytest.approx(of**2 + 0.5e-4, rel=0.4)


@pytest.mark.parametrize("lasts", [lambda t: 0.02 + 0.0 * t, lambda t: 1e-4 * t,
                                   lambda t: 0.02 * np.sin(2.0 * np.pi * t / 150.0)])  # fmt: skip
def test_what_lasts_longer_than_a_length_is_no_sea(lasts: object) -> None:
    off = noise()
    off[:, CHANNELS.index("psi")] += lasts(np.arange(400.0))  # type: ignore[operator]
    assert seen(off).noise(machine()) == {}


def test_few_readings_tell_nothing() -> None:
    assert seen(10.0 * noise(29)).noise(machine()) == {}
    assert set(seen(10.0 * noise(60)).noise(machine())) == {"position", "compass", "rate gyro", "log"}


@pytest.mark.slow
def test_yaw_in_waves_is_no_fault_and_a_step_of_the_compass_in_them_still_is() -> None:
    """Half a degree at nine seconds, which no model has, was a compass that jumped time and again."""
    channels = ("x", "y", "psi", "r", "u_w", "v_north", "v_east", "n_P", "delta")
    ship, noisy = load("kvlcc2"), READ | {"y": READ["x"], "v_east": READ["v_north"]}
    live, w = Live(ship, usual(ship, channels, noise=noisy), channels), 2.0 * np.pi / 9.0
    for t, row in Bridge(sailed()).rows(900.0):
        turned = row | {"psi": row["psi"] + 0.009 * np.sin(w * t), "r": row["r"] + 0.009 * w * np.cos(w * t)}
        if t == 760.0:
            assert [one.cause for one in live.alarms] == []
        live.feed(t, turned | {"psi": turned["psi"] + (0.07 if t >= 780.0 else 0.0)})
    assert set(live.rough) == {"compass", "rate gyro"}
    assert [one.cause for one in live.alarms] == ["compass jumped"]
