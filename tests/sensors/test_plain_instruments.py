"""Instruments without a word about them: at midship, exact, at once; and how often and how long they fall silent."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.environment import CHANNELS
from seatrial.sensors import SensorError
from seatrial.sensors.instruments import Anemometer, EchoSounder, Gnss, Gyro, RateGyro, SpeedLog
from seatrial.sensors.stream import Errors, _wandered, direction, rounded

TRUTH = {"x": 3.3, "y": -4.7, "psi": 0.731, "u": 5.013, "v_m": -0.4, "r": 0.05, "n_P": 1.0, "delta": 0.1} | dict(
    zip(CHANNELS, (6.1, -2.3, 0.7, 0.2, 0.0, 0.0, 0.0, 1.0 / 33.37), strict=True)
)
AHEAD = complex(math.cos(0.731), math.sin(0.731))


def once(instrument, **more):
    reading = instrument.start().read(0.0, TRUTH | more)
    assert reading is not None
    return reading.values


def test_they_stand_at_midship_and_round_nothing():
    fix = once(Gnss())
    way = complex(5.013, -0.4) * AHEAD
    assert (fix["x"], fix["y"]) == (3.3, -4.7)
    assert fix["U"] == pytest.approx(abs(way))
    assert fix["chi"] == pytest.approx(math.atan2(way.imag, way.real) % math.tau)
    water = complex(5.013, -0.4) - complex(0.7, 0.2) / AHEAD
    assert once(SpeedLog()) == pytest.approx({"u_w": water.real, "v_w": water.imag})
    wind = complex(6.1, -2.3) / AHEAD
    felt = wind + complex(5.013, -0.4)
    said = once(Anemometer())
    assert (said["U_A"], said["U_T"]) == pytest.approx((abs(felt), abs(wind)))
    assert said["gamma_A"] == pytest.approx(math.atan2(felt.imag, felt.real) % math.tau)
    assert said["gamma_T_bow"] == pytest.approx(math.atan2(wind.imag, wind.real) % math.tau)
    assert once(EchoSounder()) == pytest.approx({"transducer": 0.0, "below": 33.37})


@pytest.mark.parametrize("y", [0.0, 2.0, -3.0])
def test_a_place_to_the_side_moves_ahead_as_the_ship_turns_to_port_of_it(y):
    log = once(SpeedLog(at_y=y))
    assert log["u_w"] - once(SpeedLog())["u_w"] == pytest.approx(-0.05 * y)
    ahead = once(Anemometer(at_y=y))
    plain = once(Anemometer())
    way = [one["U_A"] * np.exp(1j * one["gamma_A"]) for one in (ahead, plain)]
    assert way[0] - way[1] == pytest.approx(-0.05 * y)


def test_the_echo_sounder_reads_from_its_transducer_to_its_reach():
    assert once(EchoSounder(draught=3.0, reach=30.37)) == pytest.approx({"transducer": 3.0, "below": 30.37})
    assert once(EchoSounder(draught=3.0, reach=30.36)) == {"transducer": 3.0}
    assert once(EchoSounder(draught=33.37))["below"] == pytest.approx(0.0, abs=1e-9)
    assert once(EchoSounder(draught=33.38)) == {"transducer": 33.38}


def test_a_reading_is_told_at_once_and_once():
    running = RateGyro(rate=2.0).start()
    told = [running.read(0.1 * k, TRUTH) for k in range(20)]
    assert [k for k, one in enumerate(told) if one is not None] == [0, 5, 10, 15]
    assert [one.t for one in told if one is not None] == pytest.approx([0.0, 0.5, 1.0, 1.5])


@pytest.mark.slow
def test_outages_have_their_mean_length_and_distance():
    """An exponential of 12 s every 30 s, sampled each second: 20 000 s have 476 of them, within four deviations."""
    running = RateGyro(rate=1.0, outage_every=30.0, outage_length=12.0).start(3)
    there = np.array([running.read(float(k), TRUTH) is not None for k in range(20000)])
    edges = np.flatnonzero(np.diff(there.astype(int)))
    begins, ends = edges[there[edges]], edges[~there[edges]]
    lengths = ends[ends > begins[0]][: len(begins) - 1] - begins[: len(begins) - 1]
    # an outage of length T, sampled each second, takes its first sample and all before it is over: T + 1/2 on average
    assert lengths.mean() == pytest.approx(12.5, rel=4.0 / math.sqrt(len(lengths)))
    assert len(begins) == pytest.approx(20000.0 / 42.5, rel=4.0 / math.sqrt(470.0))
    assert lengths.std() == pytest.approx(12.0, rel=0.3)


@pytest.mark.parametrize("elapsed", [0.1, 1.0, 30.0])
def test_a_wandering_bias_decays_and_grows_by_the_law_of_ornstein_and_uhlenbeck(elapsed):
    error = Errors(walk=0.3, memory=20.0)
    assert _wandered(1.0, error, elapsed, 0.0) == pytest.approx(math.exp(-elapsed / 20.0))
    variance = 0.5 * 20.0 * 0.09 * (1.0 - math.exp(-2.0 * elapsed / 20.0))
    assert _wandered(0.0, error, elapsed, 1.0) == pytest.approx(math.sqrt(variance))
    assert _wandered(1.0, Errors(walk=0.3), elapsed, 2.0) == pytest.approx(1.0 + 0.6 * math.sqrt(elapsed))


def test_the_parts_of_an_error_add_up():
    exact = Errors(bias=0.02, quantum=0.001)
    assert once(RateGyro(rate_of_turn=exact))["r"] == pytest.approx(0.07)
    assert once(RateGyro(rate_of_turn=exact), r=0.0503)["r"] == pytest.approx(0.07)
    assert once(RateGyro(rate_of_turn=exact), r=0.0507)["r"] == pytest.approx(0.071)


@pytest.mark.parametrize(("value", "quantum", "wanted"), [(1.26, 0.5, 1.5), (1.24, 0.5, 1.0), (-1.26, 0.5, -1.5),
                                                          (1.26, 0.0, 1.26), (math.inf, 0.5, math.inf)])  # fmt: skip
def test_rounding_is_to_the_nearest_multiple(value, quantum, wanted):
    assert rounded(value, quantum) == pytest.approx(wanted)


def test_directions_are_within_a_turn():
    assert direction(-0.1) == pytest.approx(math.tau - 0.1)
    assert direction(math.tau) == 0.0
    assert direction(math.tau - 0.01, 0.1) == pytest.approx(6.3 - math.tau if math.tau - 0.01 > 6.3 else 0.0, abs=0.02)
    assert 0.0 <= direction(6.28, math.tau / 4.0) < math.tau
    assert direction(6.28, math.tau / 4.0) == 0.0


def test_the_first_seed_is_zero_and_a_saved_instrument_goes_on_as_the_same_kind_only():
    noisy = RateGyro(rate=1.0, loss=0.3, outage_every=50.0, outage_length=5.0, rate_of_turn=Errors(noise=0.1))
    said = [[one and one.values["r"] for one in (run.read(float(k), TRUTH) for k in range(40))]
            for run in (noisy.start(), noisy.start(0), noisy.start(1))]  # fmt: skip
    assert said[0] == said[1] != said[2]
    fresh, again = noisy.start(4), noisy.start(4)
    again.restore(fresh.snapshot())  # in no outage, before its first sample
    assert [again.read(float(k), TRUTH) for k in range(60)] == [fresh.read(float(k), TRUTH) for k in range(60)]
    for other in (Gyro(), Gnss()):
        with pytest.raises(SensorError, match="another instrument"):
            noisy.start().restore({**other.start().snapshot(), "kind": "gyro"})
    with pytest.raises(SensorError, match="another instrument"):
        noisy.start().restore({**Gnss().start().snapshot(), "kind": "rate_gyro"})
