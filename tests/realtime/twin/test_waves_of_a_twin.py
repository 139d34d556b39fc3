"""Waves are found while a twin settles, as an oscillator that compass and gyro agree on; what lasts is no wave."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm, solve_continuous_lyapunov

from linear_ship import CHANNELS, NOISE, machine
from sea_logs import NOISE as READ
from sea_logs import Bridge, sailed
from seatrial.identify.filters.augmented import WAVES, augmented
from seatrial.identify.filters.measurement import Antenna, Heading, Log, Rate, Track
from seatrial.realtime.twin.faults.suspects import Bank, suspects
from seatrial.realtime.twin.follow import Step
from seatrial.realtime.twin.live import Live
from seatrial.realtime.twin.settings import Seaway, afloat_in, usual
from seatrial.realtime.twin.waves import Roughness, Swell
from seatrial.ships.files import load


def seen(off: np.ndarray, psi: float = 0.0) -> Roughness:
    """Innovations of the linear ship (20 s to its length), one row a second, shape (rows, 5), as large as stated."""
    sea, empty, before = Roughness(machine()), np.zeros(0), np.zeros(11)
    before[2] = psi
    for k, row in enumerate(off):
        sea.note(Step(float(k), 1.0, np.arange(5), np.ones(5, dtype=bool), row, np.diag(NOISE**2), empty, empty,
                      empty, empty, before, empty, empty))  # fmt: skip
    return sea


def noise(rows: int = 400) -> np.ndarray:
    return NOISE * np.random.default_rng(3).standard_normal((rows, 5))


def yawing(size: float = 0.01, omega: float = 1.03, rows: int = 400, damping: float = 0.0) -> np.ndarray:
    """Yaw of a frequency, or of a band of it: an oscillator that white noise drives, by its exact transition."""
    off, t = noise(rows), np.arange(float(rows))
    psi, r = CHANNELS.index("psi"), CHANNELS.index("r")
    if not damping:
        off[:, psi] += size * np.sin(omega * t)
        off[:, r] += size * omega * np.cos(omega * t)
        return off
    fine, each = 0.01, 100
    random, state = np.random.default_rng(8), np.array([0.0, size * omega])
    onward = expm(np.array([[0.0, 1.0], [-(omega**2), -2.0 * damping * omega]]) * fine)
    push = size * math.sqrt(4.0 * damping * omega**3 * fine)
    for k in range(rows):
        for _ in range(each):
            state = onward @ state + np.array([0.0, push * random.standard_normal()])
        off[k, [psi, r]] += state
    return off


def test_noise_as_stated_is_no_sea() -> None:
    assert seen(noise()).found() == Seaway()


def test_a_wave_of_the_heading_that_the_gyro_shows_as_well_has_its_size_and_frequency() -> None:
    """A sine of six seconds: its standard deviation is its amplitude by the root of two."""
    found = seen(yawing()).found()
    assert found.noise == {}
    # surge and sway that are not seen are half of what the log would show
    unseen = 0.5 * NOISE[4] / found.omega
    assert found.size == pytest.approx({"wave.psi": found.size["wave.psi"], "wave.x": unseen, "wave.y": unseen})
    assert found.size["wave.psi"] == pytest.approx(0.01 / math.sqrt(2.0), rel=0.03)
    assert found.omega == pytest.approx(1.03, rel=0.01)
    assert found.damping == 0.05  # one frequency is the narrowest of all seas


@pytest.mark.slow
def test_the_damping_of_a_band_of_waves_is_found_within_a_factor_of_two() -> None:
    """The moving mean makes the band narrower than it is; the noise that drives it follows its innovations later."""
    for damping in (0.1, 0.25):
        found = seen(yawing(rows=1500, damping=damping)).found()
        assert 0.5 * damping < found.damping < 1.2 * damping
        assert found.omega == pytest.approx(1.03, rel=0.05)
        assert found.size["wave.psi"] == pytest.approx(0.01, rel=0.1)


def test_what_compass_and_gyro_do_not_agree_on_is_noise() -> None:
    """The same two sines, but the gyro shows the rate of the other way: no ship yaws so."""
    off = yawing()
    off[:, CHANNELS.index("r")] *= -1.0
    found = seen(off).found()
    assert set(found.noise) == {"compass", "rate gyro"}
    # the mean over ten seconds takes a part of the wave with it, up to the share of a half wave in ten seconds
    for name, of, size in (("compass", NOISE[2], 0.01), ("rate gyro", NOISE[3], 0.0103)):
        assert found.noise[name] ** 2 == pytest.approx(of**2 + 0.5 * size**2, rel=0.4)
    assert (found.omega, found.size) == (0.0, {})


def test_places_in_waves_are_taken_along_the_axes_of_the_ship_without_what_yaw_does_at_the_antenna() -> None:
    """Heading 0.5 rad, a sway of 3 m to either side; of an antenna 100 m aft, yaw is a metre of it."""
    off, t, psi = yawing(), np.arange(400.0), 0.5
    off[:, :2] += 3.0 * np.outer(np.sin(1.03 * t + 1.0), [-math.sin(psi), math.cos(psi)])
    found = seen(off, psi).found()
    whole = found.size["wave.y"]
    assert whole == pytest.approx(3.0 / math.sqrt(2.0), rel=0.05)
    assert found.size["wave.x"] == pytest.approx(0.5 * whole)  # none is seen
    aft = seen(off, psi)
    aft.machine = replace(aft.machine, settings=replace(aft.machine.settings, antenna=(-100.0, 0.0)))
    assert whole**2 - aft.found().size["wave.y"] ** 2 == pytest.approx((100.0 * found.size["wave.psi"]) ** 2)


@pytest.mark.parametrize("lasts", [lambda t: 0.02 + 0.0 * t, lambda t: 1e-4 * t,
                                   lambda t: 0.02 * np.sin(2.0 * np.pi * t / 150.0)])  # fmt: skip
def test_what_lasts_longer_than_a_length_is_no_sea(lasts: object) -> None:
    off = noise()
    off[:, CHANNELS.index("psi")] += lasts(np.arange(400.0))  # type: ignore[operator]
    assert seen(off).found() == Seaway()


def test_few_readings_tell_nothing() -> None:
    assert seen(10.0 * noise(29)).found() == Seaway()
    assert set(seen(10.0 * noise(60)).found().noise) == {"position", "compass", "rate gyro", "log"}


def test_settings_in_a_sea_have_oscillators_of_its_variance() -> None:
    """Stationary under their noise: of the displacement q / (4 damping omega^3), of the rate omega^2 times that."""
    settings = afloat_in(machine().settings, Seaway(0.8, 0.1, {"wave.psi": 0.01}, {"compass": 0.5}))
    q = settings.process["wave.r"] ** 2
    A, noise_of = np.array([[0.0, 1.0], [-(settings.memory["wave.r"] ** -2), -1.0 / settings.memory["wave.psi"]]]), q
    found = solve_continuous_lyapunov(A, -np.diag([0.0, noise_of]))
    assert np.sqrt(np.diagonal(found)) == pytest.approx([0.01, 0.008])
    assert (settings.start["wave.psi"], settings.start["wave.r"]) == pytest.approx((0.01, 0.008))
    assert settings.sensors["compass"].sd == 0.5
    assert settings.sensors["rate gyro"].sd == machine().settings.sensors["rate gyro"].sd


def swollen(rows: int, gain: float, masked: tuple[int, ...] = ()) -> float:
    """Density of the yaw in waves after innovations so many times as large as stated, over so many seconds."""
    here = machine()
    names = (*here.names[:9], "wave.r", here.names[10])
    traced = SimpleNamespace(names=names, model=here.traced.model)
    here = replace(here, traced=traced, density=np.ones(11))  # type: ignore[arg-type]
    swell = Swell(Seaway(0.4 * math.pi, 0.1, {"wave.psi": 0.01}), -1.0)
    empty, random = np.zeros(0), np.random.default_rng(2)
    for k in range(rows):
        off = gain * NOISE * np.where(np.arange(5) > 1, np.sign(random.standard_normal(5)), 1e3)
        here = swell.note(Step(float(k), 1.0, np.arange(5), np.ones(5, dtype=bool), off, np.diag(NOISE**2), empty,
                               empty, empty, empty, empty, empty, empty), masked, here)  # fmt: skip
    assert (np.delete(here.density, 9) == 1.0).all()
    assert swell.sea.size["wave.psi"] == pytest.approx(0.01 * math.sqrt(here.density[9]))
    return float(here.density[9])


def test_noise_of_the_waves_follows_their_innovations_every_ten_periods() -> None:
    assert swollen(49, 1.5) == 1.0
    assert swollen(50, 1.5) == pytest.approx(2.25)
    assert swollen(100, 0.5) == pytest.approx(0.25**2)
    assert swollen(1000, 0.1) == pytest.approx(0.02)
    assert swollen(1000, 2.0) == pytest.approx(100.0)
    assert swollen(50, 100.0) == pytest.approx(9.0)  # an outlier counts as three deviations
    assert swollen(50, 1.5, (2, 3)) == 1.0  # sensors that are at fault tell nothing of the sea


def test_a_share_and_a_delay_are_those_of_the_slow_motion() -> None:
    """The eleventh state of the linear ship as the rate of yaw in waves: of 0.03 rad/s, 0.02 are theirs."""
    here, one_of = machine(), {"wave.r": 10}
    names = (*here.names[:10], "wave.r")
    slope = np.eye(5, 11)
    slope[3] = np.eye(11)[5] + np.eye(11)[one_of["wave.r"]]
    usual_state = np.zeros(11)
    usual_state[[5, 10]] = 0.01, 0.02
    traced: Any = SimpleNamespace(names=names, model=here.traced.model, own=6)
    bank = Bank(replace(here, traced=traced), [one for one in suspects(here) if "slow.r" not in one.what])
    bank.onset(0.0, np.ones(10), np.zeros(11))
    before, empty = usual_state.copy(), np.zeros(0)
    before[[5, 10]] = 0.008, -0.02
    step = Step(1.0, 1.0, np.arange(5), np.ones(5, dtype=bool), np.zeros(5), np.eye(5), empty, empty, slope, empty,
                before, empty, slope @ usual_state)  # fmt: skip
    found = np.zeros((5, bank._columns, bank._slots))
    bank._misread(step, found, usual_state)
    shown = {(one.cause, one.share): found[3, first, 0] for one, first in zip(bank.suspects, bank._first, strict=False)}
    assert shown["rate gyro scaled", 1.0] == pytest.approx(0.01)
    late = [value for (cause, _), value in shown.items() if cause == "rate gyro late"]
    assert late == pytest.approx([-0.002, -0.002])


@pytest.mark.slow
def test_what_is_read_in_waves_is_that_of_the_hull_turned_and_moved_by_them() -> None:
    """An antenna far aft on a ship that is drawn, against the same motion with the waves added by hand."""
    ship = load("kvlcc2")
    sensors = (Antenna(0.5, -100.0, 5.0), Heading(0.002), Rate(0.001), Log(0.05, channels=("u_w",)),
               Track(0.05, -100.0, 5.0))  # fmt: skip
    more = tuple(name for pair in WAVES.items() for name in pair)
    memory = dict.fromkeys(WAVES, 10.0) | dict.fromkeys(WAVES.values(), 2.0)
    traced, plain = augmented(ship, more, sensors, memory), augmented(ship, (), sensors, {})
    z, acting = np.array([10.0, 20.0, 0.7, 6.0, 0.4, 0.01, 0.8, 0.3, -1.1, 0.5, 0.05, 0.02]), np.zeros(10)
    c, s, turn = math.cos(0.7), math.sin(0.7), 0.05
    north, east = 6.3 * c - 0.9 * s, 6.3 * s + 0.9 * c  # over ground, with the rates of 0.3 ahead and 0.5 aside
    c_w, s_w = math.cos(0.7 + turn), math.sin(0.7 + turn)
    by_hand = np.array([10.0 + 0.8 * c + 1.1 * s, 20.0 + 0.8 * s - 1.1 * c, 0.7 + turn, north * c_w + east * s_w,
                        east * c_w - north * s_w, 0.03])  # fmt: skip
    assert traced.model.read(z, acting)[0] == pytest.approx(plain.model.read(by_hand, acting)[0], abs=1e-12)
    free = solve_ivp(lambda _, y: [y[1], -0.25 * y[0] - 0.1 * y[1]], (0.0, 0.1), [0.05, 0.02], rtol=1e-10).y[:, -1]
    assert traced.onward(z, acting, 0.1)[0][10:] == pytest.approx(free, rel=1e-6)


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
    sea = live.swell.sea
    assert sea.omega == pytest.approx(w, rel=0.1)
    assert set(sea.size) >= {"wave.psi"}
    assert sea.noise == {}
    assert [one.cause for one in live.alarms] == ["compass jumped"]
