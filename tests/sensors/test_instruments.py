"""Instruments at work: geometry exactly, errors by their statistics, time by the sample."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.environment import CHANNELS
from seatrial.sensors import SensorError
from seatrial.sensors.instruments import Anemometer, EchoSounder, Feedback, Gnss, Gyro, RateGyro, SpeedLog
from seatrial.sensors.stream import Errors
from seatrial.sensors.suite import Suite, usual
from seatrial.ships.files import load
from tiers import slow_but

DT = 0.01
REST = {
    "x": 0.0, "y": 0.0, "psi": 0.0, "u": 0.0, "v_m": 0.0, "r": 0.0, "n_P": 0.0, "delta": 0.0,
} | dict.fromkeys(CHANNELS, 0.0)  # fmt: skip


def said(instrument, duration, truth=REST, seed=1, dt=DT):
    """Each reading with the time at which it was told."""
    running = instrument.start(seed)
    asked = ((k * dt, running.read(k * dt, truth)) for k in range(round(duration / dt)))
    return [(t, reading) for t, reading in asked if reading is not None]


def values(instrument, duration, name, **given):
    return np.array([reading.values[name] for _, reading in said(instrument, duration, **given)])


def once(instrument, **truth):
    reading = instrument.start(0).read(0.0, REST | truth)
    assert reading is not None
    return reading.values


def test_the_antenna_is_where_it_stands_and_moves_as_the_ship_turns():
    at = {"antenna_x": -20.0, "antenna_y": 3.0}
    east = once(Gnss(**at), x=100.0, y=50.0, psi=math.pi / 2, u=5.0, v_m=0.5, r=0.02)
    # heading east: 20 m aft is 20 m west, 3 m to starboard is 3 m south
    assert (east["x"], east["y"]) == pytest.approx((97.0, 30.0))
    north_east = (-(0.5 + 0.02 * -20.0), 5.0 - 0.02 * 3.0)
    assert east["U"] == pytest.approx(math.hypot(*north_east))
    assert east["chi"] == pytest.approx(math.atan2(north_east[1], north_east[0]))


def test_the_wind_at_the_mast_is_that_of_ship_weather_and_turning():
    # wind from north at 10 m/s, ship heading north at 5 m/s: 15 m/s from ahead
    ahead = once(Anemometer(), wind_x=10.0, u=5.0)
    assert (ahead["U_A"], ahead["gamma_A"]) == pytest.approx((15.0, 0.0))
    # from east at 10 m/s, heading north at rest: from the starboard beam
    beam = once(Anemometer(), wind_y=10.0)
    assert (beam["U_A"], beam["gamma_A"]) == pytest.approx((10.0, math.pi / 2))
    # turning to starboard in still air, a mast forward moves to starboard: air from starboard, one aft from port
    assert once(Anemometer(at_x=30.0), r=0.1)["gamma_A"] == pytest.approx(math.pi / 2)
    aft = once(Anemometer(at_x=-30.0), r=0.1)
    assert (aft["U_A"], aft["gamma_A"]) == pytest.approx((3.0, 1.5 * math.pi))


def test_the_log_sees_the_water_and_with_bottom_track_the_ground():
    truth = {"psi": math.pi / 2, "u": 5.0, "v_m": 0.2, "r": 0.01, "current_x": 0.5, "current_y": 1.0}
    plain = once(SpeedLog(at_x=10.0), **truth)
    # heading east: the current to the east comes from astern, the one to the north from starboard
    assert plain == pytest.approx({"u_w": 4.0, "v_w": 0.2 + 0.1 + 0.5})
    both = once(SpeedLog(at_x=10.0, ground=Errors()), **truth)
    assert both["u"] == pytest.approx(5.0)
    assert both["v_m"] == pytest.approx(0.3)


def test_compass_rate_gyro_and_indicators_tell_the_truth():
    assert once(Gyro(), psi=-0.1) == pytest.approx({"psi": math.tau - 0.1})
    assert once(Gyro(), psi=7.0 * math.tau) == pytest.approx({"psi": 0.0}, abs=1e-12)
    assert once(RateGyro(), r=-0.02) == {"r": -0.02}
    assert once(Feedback(), delta=0.3, n_P=1.5) == {"delta": 0.3, "n_P": 1.5}


@pytest.mark.parametrize("rate", [0.5, 1.0, 3.0, 10.0, 33.0, 100.0])
def test_readings_come_at_the_rate(rate):
    times = np.array([reading.t for _, reading in said(Gyro(rate=rate), 40.0)])
    assert len(times) == round(40.0 * rate)
    assert np.abs(times - np.arange(len(times)) / rate).max() < DT  # each at the first step that is due: no drift


def test_a_rate_beyond_the_steps_is_that_of_the_steps():
    assert len(said(Gyro(rate=1000.0), 2.0)) == round(2.0 / DT)


@pytest.mark.parametrize("latency", [0.0, 0.05, 0.37, 2.5])
def test_what_is_late_is_late_by_the_latency_and_says_when_it_was_true(latency):
    running, late = Gyro(rate=5.0, latency=latency).start(), []
    for k in range(1000):
        t = k * DT
        reading = running.read(t, REST | {"psi": 0.1 * t})
        if reading is not None:
            late.append(t - reading.t)
            assert reading.values["psi"] == pytest.approx(0.1 * reading.t)
    assert len(late) > 30
    assert min(late) >= latency - 1e-9
    assert max(late) < latency + DT + 1e-9


@pytest.mark.long
def test_noise_has_its_variance_and_is_white_and_without_mean():
    x = values(Gnss(rate=100.0, position=Errors(noise=2.0)), 200.0, "x")
    n = len(x)
    assert x.var() == pytest.approx(4.0, rel=4.0 * math.sqrt(2.0 / n))
    assert abs(x.mean()) < 4.0 * 2.0 / math.sqrt(n)
    assert abs(np.corrcoef(x[1:], x[:-1])[0, 1]) < 4.0 / math.sqrt(n)


@pytest.mark.slow
def test_north_and_east_err_on_their_own():
    told = [r.values for _, r in said(Gnss(rate=100.0, position=Errors(noise=2.0)), 100.0)]
    x, y = (np.array([v[name] for v in told]) for name in "xy")
    assert abs(np.corrcoef(x, y)[0, 1]) < 4.0 / math.sqrt(len(x))


@pytest.mark.slow
@pytest.mark.parametrize("rate", [1.0, 5.0])
def test_a_wandering_bias_grows_with_the_root_of_time_at_any_rate(rate):
    error = Errors(bias=1.0, walk=0.3)
    runs = np.array([values(RateGyro(rate=rate, rate_of_turn=error), 41.0, "r", seed=s, dt=1.0 / rate)
                     for s in range(400)]) - 1.0  # fmt: skip
    for t in (10.0, 20.0, 40.0):
        assert runs[:, round(t * rate)].var() == pytest.approx(0.09 * t, rel=4.0 * math.sqrt(2.0 / 400))
    assert np.all(runs[:, 0] == 0.0)


@pytest.mark.long
def test_a_bias_that_is_called_back_stays_within_its_variance():
    x = values(RateGyro(rate=1.0, rate_of_turn=Errors(walk=0.3, memory=20.0)), 40000.0, "r", dt=1.0)
    assert x[200:].var() == pytest.approx(0.09 * 20.0 / 2.0, rel=0.2)


def test_readings_are_whole_multiples_of_the_quantum():
    told = values(Gyro(rate=100.0, heading=Errors(noise=0.1, quantum=0.01)), 10.0, "psi", truth=REST | {"psi": 1.0})
    assert np.abs(told / 0.01 - np.round(told / 0.01)).max() < 1e-9
    assert len(set(told.round(6))) > 20


def test_single_losses_have_their_share():
    n = len(said(Gyro(rate=100.0, loss=0.2), 100.0))
    assert n == pytest.approx(8000, abs=4.0 * math.sqrt(1600.0))
    assert not said(Gyro(rate=100.0, loss=1.0), 1.0)


@pytest.mark.long
def test_outages_last_and_return_as_told():
    gnss = Gnss(rate=2.0, outage_every=60.0, outage_length=15.0)
    times = np.array([r.t for _, r in said(gnss, 40000.0, dt=0.5)])
    gaps = np.diff(times)
    out = gaps[gaps > 0.75]
    assert out.size == pytest.approx(40000.0 / 75.0, rel=4.0 / math.sqrt(500))
    assert out.mean() == pytest.approx(15.0, rel=4.0 / math.sqrt(500))


def test_the_same_seed_says_the_same_and_another_does_not():
    noisy = Gyro(rate=10.0, heading=Errors(noise=0.1))
    assert values(noisy, 5.0, "psi", seed=3).tolist() == values(noisy, 5.0, "psi", seed=3).tolist()
    assert values(noisy, 5.0, "psi", seed=3).tolist() != values(noisy, 5.0, "psi", seed=4).tolist()


def test_instruments_of_a_suite_err_independently_and_are_saved_and_restored():
    noisy = Gyro(rate=7.0, latency=0.4, loss=0.1, outage_every=5.0, outage_length=1.0,
                 heading=Errors(noise=0.1, walk=0.01))  # fmt: skip
    suite = Suite((noisy, noisy, Gnss(rate=3.0, position=Errors(noise=1.0, walk=0.1))))
    watch = suite.start(5)

    def on(start, end):
        return [r for k in range(start, end) for r in watch.read(k * DT, REST)]

    first = [r.values["psi"] for r in on(0, 777) if r.kind == "gyro"]
    assert len(set(first)) == len(first)
    saved = watch.snapshot()
    onward = on(777, 4000)
    watch.restore(saved)
    assert on(777, 4000) == onward
    watch.reset()
    assert [r.values["psi"] for r in on(0, 777) if r.kind == "gyro"] == first
    for wrong in (b"", b"[]", b"[1,2,3]", b'{"next":1}'):
        with pytest.raises(SensorError, match="saved"):
            watch.restore(wrong)


@pytest.mark.parametrize("rate", slow_but([0.2, 1.0, 5.0], 0.2))
def test_a_bias_that_is_called_back_has_the_same_variance_at_any_rate(rate):
    error = Errors(walk=1.0, memory=1.0)
    x = values(RateGyro(rate=rate, rate_of_turn=error), 8000.0 / rate, "r", dt=1.0 / rate)
    # as many samples as are independent of each other decide how sure the variance is
    independent = len(x) * math.tanh(1.0 / rate)
    assert x[50:].var() == pytest.approx(0.5, rel=4.0 * math.sqrt(2.0 / independent))


@pytest.mark.parametrize(("rate", "dt"), [(1.0, 1.0), (10.0, 1.0), pytest.param(10.0, 0.1, marks=pytest.mark.slow)])
def test_outages_are_as_frequent_where_the_steps_are_slower_than_the_instrument(rate, dt):
    gyro = RateGyro(rate=rate, outage_every=20.0, outage_length=1e-9)
    asked = round(4000.0 / dt)
    lost = asked - len(said(gyro, 4000.0, dt=dt))
    # an outage of no length takes the sample in whose interval it falls
    expected = asked * -math.expm1(-dt / 20.0)
    assert lost == pytest.approx(expected, abs=4.0 * math.sqrt(expected))


@pytest.mark.slow
def test_noise_makes_no_speed_negative_and_of_no_wind_and_no_way_any_direction():
    still = [r.values for _, r in said(Gnss(rate=10.0, velocity=Errors(noise=0.05), speed_quantum=0.05), 400.0)]
    calm = [r.values for _, r in said(Anemometer(rate=10.0, wind=Errors(noise=0.3), speed_quantum=0.1), 400.0)]
    for told, speed, course in ((still, "U", "chi"), (calm, "U_A", "gamma_A"), (calm, "U_T", "gamma_T_bow")):
        assert min(one[speed] for one in told) == 0.0
        quarters = np.histogram([one[course] for one in told], bins=4, range=(0.0, math.tau))[0]
        assert quarters.min() > 0.8 * len(told) / 4
    mean_square = np.mean([one["U_A"] ** 2 for one in calm])
    assert mean_square == pytest.approx(2.0 * 0.09, rel=0.1)


def test_the_resolution_of_speeds_and_directions():
    receiver = Gnss(rate=10.0, velocity=Errors(noise=0.5), speed_quantum=0.25, course_quantum=0.1)
    for _, reading in said(receiver, 20.0, truth=REST | {"u": 5.0}):
        for name, quantum in (("U", 0.25), ("chi", 0.1)):
            assert reading.values[name] / quantum == pytest.approx(round(reading.values[name] / quantum), abs=1e-9)


def test_true_wind_is_that_of_the_weather_from_the_bow_whatever_the_ship_does():
    truth = {"wind_x": 8.0, "psi": math.radians(350.0), "u": 5.0, "v_m": -0.5, "r": 0.02}
    told = once(Anemometer(at_x=-30.0, at_y=4.0), **truth)
    assert (told["U_T"], told["gamma_T_bow"]) == pytest.approx((8.0, math.radians(10.0)))
    assert set(once(Anemometer(motion=None), **truth)) == {"U_A", "gamma_A"}
    # a vane that is turned to starboard shows the wind further to port
    skew = once(Anemometer(skew=0.2), wind_x=8.0)
    assert (skew["U_A"], skew["gamma_A"]) == pytest.approx((8.0, math.tau - 0.2))


def test_the_echo_sounder_finds_the_ground_or_nothing():
    sounder = EchoSounder(draught=5.0, reach=100.0)
    assert once(sounder, per_depth=1 / 40.0) == pytest.approx({"transducer": 5.0, "below": 35.0})
    for per_depth in (0.0, 1 / 106.0, 1 / 4.0):  # no ground, too deep, aground
        assert once(sounder, per_depth=per_depth) == {"transducer": 5.0}
    noisy = EchoSounder(rate=10.0, depth=Errors(noise=1.0, quantum=0.1))
    found = [r.values["below"] for _, r in said(noisy, 100.0, truth=REST | {"per_depth": 1.0}) if "below" in r.values]
    assert 0 < len(found) < 1000
    assert min(found) >= 0.0
    assert not [r for _, r in said(noisy, 10.0) if "below" in r.values]


def test_the_log_tells_the_stern_where_it_is_asked_to():
    truth = {"u": 5.0, "v_m": 0.2, "r": 0.01, "current_y": 0.5}
    told = once(SpeedLog(at_x=10.0, stern_x=-40.0, ground=Errors()), **truth)
    assert told == pytest.approx({"u_w": 5.0, "v_w": -0.2, "v_w_stern": -0.7, "u": 5.0, "v_m": 0.3, "v_stern": -0.2})


def test_the_usual_instruments_of_a_ship_report_its_controls():
    for name in ("kvlcc2", "milliampere"):
        ship = load(name)
        truth = REST | dict.fromkeys(ship.model.controls, 0.1)
        watch = usual(ship).start(0)
        told = {r.kind: r for k in range(200) for r in watch.read(k * 0.1, truth)}
        assert set(told) == {"gnss", "gyro", "rate_gyro", "speed_log", "anemometer", "echo_sounder", "feedback"}
        assert set(told["feedback"].values) == set(ship.model.controls)


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        (lambda: Gyro(rate=0.0), "rate of the gyro is 0"),
        (lambda: Gyro(rate=math.inf), "rate of the gyro"),
        (lambda: Gyro(rate=math.nan), "rate of the gyro"),
        (lambda: Gnss(latency=-1.0), "latency of the gnss is -1"),
        (lambda: Gnss(loss=1.1), "a share, from 0 to 1"),
        (lambda: Gnss(outage_every=0.0), "outage_every"),
        (lambda: Gyro().start(-1), "seed of -1"),
        (lambda: Suite(()).start(-1), "seed of -1"),
        (lambda: Errors(noise=-0.1), "noise of a sensor"),
        (lambda: Gnss(speed_quantum=-1.0), "speed_quantum of the gnss is -1"),
        (lambda: Anemometer(direction_quantum=math.nan), "direction_quantum of the anemometer"),
        (lambda: Anemometer(skew=math.inf), "skew of the anemometer"),
        (lambda: Feedback(of={"dleta": Errors()}), "no control 'dleta'; near: delta"),
        (lambda: Errors(bias=math.nan), "bias of a sensor"),
        (lambda: Errors(memory=0.0), "memory of a sensor"),
    ],
)
def test_figures_that_cannot_be_are_refused(wrong, text):
    with pytest.raises(SensorError, match=text):
        wrong()
