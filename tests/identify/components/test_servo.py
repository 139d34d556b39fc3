"""Servos from logs of order and angle; the rates are K_alpha of You 2023 section 4.4.2."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.actuators import Actuator, Azimuth
from seatrial.data import DataError, Trial
from seatrial.identify.components.servo import answered, fit_servo, lateness, servos
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

STEPS = np.radians([0, 20, -20, 20, -20, 35, 10, -35, 0, 90])


def log(
    servo: Azimuth | Actuator, orders: np.ndarray = STEPS, *, dt: float = 0.2, hold: float = 8.0, noise: float = 0.0,
    offset: float = 0.0, seed: int = 0, jitter: float = 0.0, control: str = "alpha_1",
) -> Trial:  # fmt: skip
    """A log of the servo, made in steps of 1 ms with a queue for the dead time."""
    rng = np.random.default_rng(seed)
    n = round(hold / dt) * orders.size
    t = dt * np.arange(n) + (jitter * dt * rng.uniform(-1, 1, n) if jitter else 0.0)
    t -= t[0]
    ordered = np.repeat(orders, n // orders.size)
    fine, y, at = 1e-3, float(orders[0]), np.empty(n)
    k, now = 0, 0.0
    for row in range(n):
        while now < t[row] - 1e-9:
            step = min(fine, t[row] - now)
            while k + 1 < n and t[k + 1] + servo.dead_time <= now + 1e-9:
                k += 1
            _, (y,) = servo.advance((y,), float(ordered[k]), step)
            now += step
        at[row] = y
    shown = at + offset + noise * rng.standard_normal(n)
    return Trial("log", t, {control: np.arctan2(np.sin(shown), np.cos(shown)), f"{control}_cmd": ordered})


@pytest.mark.slow
def test_lateness_is_the_dead_time_that_a_servo_lacks() -> None:
    ramps = np.radians([0, 30, -30, 30, -30])
    for late in (0.2, 0.5):
        found = lateness([log(Actuator(rate=0.1, dead_time=late), ramps, dt=0.05, hold=12.0, control="delta")],
                         "delta", Actuator(rate=0.1))  # fmt: skip
        # where both go on and where one alone does, over the time of the ramps: tau^2 (T - tau) + 2 tau^3/3 over T
        T = 2 * np.radians(30) / 0.1
        assert found == pytest.approx(np.sqrt(late**2 * (1 - late / T / 3)), rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("rate", [0.1151, 0.1161])
def test_the_rate_of_the_tug_within_its_sigma(rate: float) -> None:
    found = fit_servo([log(Azimuth(rate=rate), noise=0.005, seed=1)], "alpha_1")
    assert abs(found.servo.rate - rate) < 3 * found.sigma["rate"]
    assert found.sigma["rate"] < 0.002 * rate
    assert found.rmse == pytest.approx(0.005, rel=0.1)
    assert found.R2 > 0.999
    assert (found.servo.lag, found.servo.dead_time) == (0.0, 0.0)


@pytest.mark.slow
def test_without_noise_all_of_it_comes_back() -> None:
    truth = Azimuth(rate=0.3, lag=0.5, dead_time=0.31)
    found = fit_servo([log(truth, offset=0.02)], "alpha_1")
    assert found.servo.rate == pytest.approx(0.3, rel=1e-3)
    assert found.servo.lag == pytest.approx(0.5, abs=2e-2)
    assert found.servo.dead_time == pytest.approx(0.31, abs=2e-2)
    assert found.offset == pytest.approx(0.02, abs=1e-3)
    assert found.rmse < 1e-3


@pytest.mark.slow
def test_lag_and_dead_time_with_noise() -> None:
    truth = Azimuth(rate=0.25, lag=0.6, dead_time=0.5)
    found = fit_servo([log(truth, noise=0.004, seed=3), log(truth, -STEPS, noise=0.004, seed=4)], "alpha_1")
    for name in ("rate", "lag", "dead_time"):
        assert abs(getattr(found.servo, name) - getattr(truth, name)) < 3.5 * found.sigma[name] + 0.005, name


@pytest.mark.slow
def test_angles_that_wrap_turn_the_shorter_way() -> None:
    orders = np.radians([170.0, -170.0, 100.0, -150.0, 150.0, 170.0])
    trial = log(Azimuth(rate=0.4), orders, noise=0.003, seed=2)
    assert np.abs(np.diff(trial["alpha_1"])).max() > 6.0
    found = fit_servo([trial], "alpha_1")
    assert found.servo.rate == pytest.approx(0.4, rel=0.01)
    assert found.rmse == pytest.approx(0.003, rel=0.15)


@pytest.mark.slow
def test_uneven_time_and_gaps() -> None:
    trial = log(Azimuth(rate=0.2), noise=0.003, jitter=0.3, seed=5)
    holed, ordered = trial["alpha_1"].copy(), trial["alpha_1_cmd"].copy()
    holed[30:60], ordered[45:50] = np.nan, np.nan
    found = fit_servo([trial.having(alpha_1=holed, alpha_1_cmd=ordered)], "alpha_1")
    assert found.servo.rate == pytest.approx(0.2, rel=0.01)
    assert found.samples == len(trial) - 30


@pytest.mark.slow
def test_no_lag_is_made_of_a_noisy_first_angle() -> None:
    """A servo with a rate only has neither lag nor dead time, whatever its first reading happened to be."""
    trials = [log(Azimuth(rate=0.1151), STEPS[:5], hold=5.0, noise=0.0035, seed=seed) for seed in range(10)]
    for trial in trials:
        first = trial["alpha_1"].copy()
        first[0] += 0.0105  # three times the noise
        found = fit_servo([trial.having(alpha_1=first)], "alpha_1")
        assert (found.servo.lag, found.servo.dead_time) == (0.0, 0.0)
        assert abs(found.servo.rate - 0.1151) < 3.5 * found.sigma["rate"]


@pytest.mark.slow
def test_the_angle_that_answers_is_quieter_than_its_reading() -> None:
    servo, noise = Azimuth(rate=0.1151), 0.0035
    true, read = log(servo)["alpha_1"], log(servo, noise=noise, offset=0.01, seed=7)
    quiet = answered(fit_servo([read], "alpha_1"), read)
    assert np.sqrt(np.mean((quiet - true) ** 2)) < 0.2 * noise
    holed = read["alpha_1"].copy()
    holed[:5], holed[-3:] = np.nan, np.nan
    late = answered(fit_servo([read], "alpha_1"), read.having(alpha_1=holed))
    assert np.flatnonzero(np.isnan(late)).tolist() == [0, 1, 2, 3, 4, len(read) - 3, len(read) - 2, len(read) - 1]


@pytest.mark.slow
def test_a_rudder_is_a_servo_too() -> None:
    orders = np.radians([0, 35, -35, 35, 0])
    found = fit_servo([log(Actuator(rate=0.04), orders, hold=40.0, noise=0.002, control="delta")], "delta")
    assert isinstance(found.servo, Actuator)
    assert found.servo.rate == pytest.approx(0.04, rel=0.01)


@pytest.mark.slow
def test_the_servos_of_a_simulated_tug_come_back() -> None:
    ship = load("qiuxin5")
    run = simulate(ship, Zigzag(approach(ship)[1], 0.35, 0.35), speed=ship.speed, duration=60.0, dt=0.2)
    assert servos([run]) == ("alpha_1", "alpha_2")
    for control, rate in (("alpha_1", 0.1151), ("alpha_2", 0.1161)):
        found = fit_servo([run], control)
        assert found.servo.rate == pytest.approx(rate, rel=1e-6)
        assert found.rmse < 1e-8


@pytest.mark.slow
def test_a_rate_that_is_never_reached_is_not_told() -> None:
    small = np.radians([0.0, 2.0, -1.0, 1.0, 0.0, 2.0])
    found = fit_servo([log(Azimuth(rate=2.0, lag=1.0), small, noise=2e-4)], "alpha_1")
    assert any("order larger steps" in line for line in found.cautions)
    assert found.servo.lag == pytest.approx(1.0, rel=0.05)


@pytest.mark.slow
def test_half_a_turn_is_cautioned() -> None:
    found = fit_servo([log(Azimuth(rate=0.5), np.array([0.0, 1.0, 1.0 - np.pi + 1e-3]))], "alpha_1")
    assert any("either way round" in line for line in found.cautions)


@pytest.mark.slow
def test_bad_logs() -> None:
    good = log(Azimuth(rate=0.2))
    with pytest.raises(DataError, match="in degrees"):
        fit_servo([good.having(alpha_1_cmd=np.degrees(good["alpha_1_cmd"]))], "alpha_1")
    with pytest.raises(DataError, match="never changes"):
        fit_servo([good.having(alpha_1_cmd=np.zeros(len(good)))], "alpha_1")
    with pytest.raises(DataError, match="alpha_2"):
        fit_servo([good], "alpha_2")
    with pytest.raises(DataError, match="no trial"):
        fit_servo([], "alpha_1")
    with pytest.raises(DataError, match="5 samples"):
        fit_servo([good.rows(slice(0, 5))], "alpha_1")
    with pytest.raises(DataError, match="has no values"):
        fit_servo([good.having(alpha_1=np.full(len(good), np.nan))], "alpha_1")
