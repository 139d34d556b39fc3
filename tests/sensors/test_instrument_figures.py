"""Figures of instruments: those of a merchant ship one by one, what is refused, and plain arithmetic of readings."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.environment import CHANNELS
from seatrial.sensors import SensorError, Sensors
from seatrial.sensors.instruments import Anemometer, EchoSounder, Feedback, Gnss, Gyro, RateGyro, SpeedLog
from seatrial.sensors.stream import EXACT, Errors, _wandered, direction, not_below_zero, rounded
from seatrial.sensors.suite import Suite, draught, usual
from seatrial.ships.files import load

DEGREE, KNOT = math.pi / 180.0, 1852.0 / 3600.0
SHIP = load("kvlcc2")
L = SHIP.L_pp
TRUTH = {"x": 10.0, "y": -20.0, "psi": 0.5, "u": 5.0, "v_m": 0.3, "r": 0.01, "n_P": 1.2, "delta": 0.2} | dict.fromkeys(
    CHANNELS, 0.0
)


def test_the_figures_of_a_merchant_ship_are_those_of_makers() -> None:
    """Rate [Hz], latency [s], place forward and to starboard, errors (noise, walk, memory, step), further steps."""
    one = {instrument.kind: instrument for instrument in usual(SHIP).instruments}
    assert [*one] == ["gnss", "gyro", "rate_gyro", "speed_log", "anemometer", "echo_sounder", "feedback"]
    assert {kind: (i.rate, i.latency) for kind, i in one.items()} == {
        "gnss": (1.0, 0.2), "gyro": (10.0, 0.05), "rate_gyro": (10.0, 0.05), "speed_log": (1.0, 0.1),
        "anemometer": (1.0, 0.1), "echo_sounder": (1.0, 0.1), "feedback": (5.0, 0.05),
    }  # fmt: skip
    assert all(i.loss == 0.0 and math.isinf(i.outage_every) for i in one.values())
    fix, log, mast, echo, shown = (one[k] for k in ("gnss", "speed_log", "anemometer", "echo_sounder", "feedback"))
    assert isinstance(fix, Gnss)
    assert (fix.position, fix.velocity) == (Errors(0.5, walk=0.05, memory=600.0), Errors(0.05))
    assert (fix.speed_quantum, fix.course_quantum) == pytest.approx((0.1 * KNOT, 0.1 * DEGREE))
    assert (fix.antenna_x, fix.antenna_y) == pytest.approx((-0.4 * L, 0.0))
    assert one["gyro"].errors["psi"] == Errors(0.05 * DEGREE, quantum=0.1 * DEGREE)
    assert one["rate_gyro"].errors["r"] == Errors(0.01 * DEGREE)
    assert isinstance(log, SpeedLog)
    assert (log.at_x, log.at_y, log.stern_x, log.ground) == (pytest.approx(0.3 * L), 0.0, None, None)
    assert log.water == Errors(0.03, quantum=0.1 * KNOT)
    assert isinstance(mast, Anemometer)
    assert (mast.wind, mast.motion, mast.skew) == (Errors(0.3), Errors(0.05), 0.0)
    assert (mast.at_x, mast.at_y) == (pytest.approx(-0.4 * L), 0.0)
    assert (mast.speed_quantum, mast.direction_quantum) == pytest.approx((0.1, DEGREE))
    assert isinstance(echo, EchoSounder)
    assert (echo.draught, echo.reach, echo.depth) == (20.8, 200.0, Errors(0.05, quantum=0.1))
    assert isinstance(shown, Feedback)
    assert shown.controls == ("n_P", "delta")
    assert shown.of == {"delta": Errors(0.1 * DEGREE, quantum=0.1 * DEGREE)}
    assert draught(SHIP) == 20.8


def test_an_antenna_that_is_placed_moves_no_other_instrument() -> None:
    suite = usual(SHIP, antenna=(12.0, -3.0))
    assert suite.place(Gnss) == (12.0, -3.0)
    assert suite.place(SpeedLog) == (pytest.approx(0.3 * L), 0.0)
    assert suite.place(Anemometer) == (pytest.approx(-0.4 * L), 0.0)
    assert Suite((Gyro(),)).place(Gnss) == (0.0, 0.0)
    assert Suite((SpeedLog(at_x=2.0, at_y=3.0), SpeedLog(at_x=5.0))).place(SpeedLog) == (2.0, 3.0)


@pytest.mark.parametrize(("forward", "starboard"), [(0.0, 0.0), (30.0, 0.0), (0.0, 4.0), (-25.0, -6.0)])
def test_an_antenna_is_where_a_rigid_body_has_it(forward: float, starboard: float) -> None:
    """By complex numbers: place z0 + a e^{i psi}, velocity the derivative of it."""
    z = complex(10.0, -20.0) + complex(forward, starboard) * complex(math.cos(0.5), math.sin(0.5))
    way = (complex(5.0, 0.3) + 0.01j * complex(forward, starboard)) * complex(math.cos(0.5), math.sin(0.5))
    found = Gnss(antenna_x=forward, antenna_y=starboard).measure(TRUTH)
    assert found == pytest.approx((z.real, z.imag, way.real, way.imag))
    said = Gnss(antenna_x=forward, antenna_y=starboard).say(found)
    assert (said["U"], said["chi"]) == pytest.approx((abs(way), math.atan2(way.imag, way.real)))


def test_a_log_with_bottom_track_has_the_stern_behind_the_bow() -> None:
    log = SpeedLog(at_x=10.0, at_y=2.0, stern_x=-40.0, ground=EXACT)
    truth = TRUTH | {"current_x": 0.6, "current_y": -0.2}
    current = complex(0.6, -0.2) * complex(math.cos(0.5), -math.sin(0.5))
    assert [*log.errors] == ["u_w", "v_w", "v_w_stern", "u", "v_m", "v_stern"]
    u, v, stern = 5.0 - 0.01 * 2.0, 0.3 + 0.01 * 10.0, 0.3 - 0.01 * 40.0
    assert log.measure(truth) == pytest.approx(
        (u - current.real, v - current.imag, stern - current.imag, u, v, stern)
    )
    assert [*SpeedLog(ground=Errors(0.1)).errors] == ["u_w", "v_w", "u", "v_m"]
    assert SpeedLog(ground=Errors(0.1)).errors["u"] == Errors(0.1)


@pytest.mark.parametrize("skew", [0.0, 0.2, -0.3])
def test_an_anemometer_that_is_turned_to_starboard_reads_less_by_its_skew(skew: float) -> None:
    said = Anemometer(skew=skew).say((6.0, 2.0, 5.0, 0.5))
    assert said["U_A"] == pytest.approx(math.hypot(6.0, 2.0))
    assert said["gamma_A"] == pytest.approx((math.atan2(2.0, 6.0) - skew) % math.tau)
    felt = complex(6.0, 2.0) * complex(math.cos(skew), -math.sin(skew)) - complex(5.0, 0.5)
    assert said["U_T"] == pytest.approx(abs(felt))
    assert said["gamma_T_bow"] == pytest.approx(math.atan2(felt.imag, felt.real) % math.tau)
    assert [*Anemometer(motion=None).say((6.0, 2.0))] == ["U_A", "gamma_A"]
    assert [*Anemometer(motion=None).errors] == ["ahead", "aside"]
    assert Anemometer(wind=Errors(0.3), motion=Errors(0.1)).errors == {
        "ahead": Errors(0.3), "aside": Errors(0.3), "u": Errors(0.1), "v_m": Errors(0.1)
    }  # fmt: skip


def test_resolutions_round_what_is_read() -> None:
    assert Anemometer(speed_quantum=0.5, direction_quantum=0.1).say((3.0, 4.2))["U_A"] == 5.0
    assert Anemometer(direction_quantum=0.1).say((3.0, 4.2))["gamma_A"] == pytest.approx(1.0)
    said = Gnss(speed_quantum=0.5, course_quantum=0.1).say((0.0, 0.0, 3.0, 4.2))
    assert (said["U"], said["chi"]) == (5.0, pytest.approx(1.0))
    assert rounded(-0.74, 0.5) == -0.5
    assert (rounded(0.3, 0.0), rounded(math.inf, 0.5)) == (0.3, math.inf)
    assert direction(-0.1) == pytest.approx(math.tau - 0.1)
    assert direction(math.tau - 0.01, 0.1) == 0.0  # 6.3 is a turn
    assert direction(359.97 * DEGREE, 0.1 * DEGREE) == 0.0
    assert direction(359.93 * DEGREE, 0.1 * DEGREE) == pytest.approx(359.9 * DEGREE)


def test_a_depth_is_told_within_reach_and_not_above_the_transducer() -> None:
    echo = EchoSounder(draught=5.0, reach=50.0)
    assert echo.measure(TRUTH | {"per_depth": 1.0 / 30.0}) == (pytest.approx(25.0),)
    assert echo.measure(TRUTH | {"per_depth": 0.0}) == (math.inf,)
    for below, told in ((50.0, True), (50.01, False), (0.0, True), (-0.01, False), (math.inf, False)):
        assert ("below" in echo.say((below,))) == told
    assert EchoSounder().say((math.inf,)) == {"transducer": 0.0}


def test_a_wandering_bias_grows_by_the_root_of_time_and_decays() -> None:
    walk = Errors(walk=0.2)
    assert _wandered(1.0, walk, 9.0, 2.0) == pytest.approx(1.0 + 0.2 * 3.0 * 2.0)
    held = Errors(walk=0.2, memory=10.0)
    kept = math.exp(-0.5)
    assert _wandered(1.0, held, 5.0, 0.0) == pytest.approx(kept)
    assert _wandered(0.0, held, 5.0, 1.0) == pytest.approx(0.2 * math.sqrt(5.0 * (1.0 - kept**2)))
    assert _wandered(0.0, held, 1e6, 1.0) == pytest.approx(0.2 * math.sqrt(5.0))


@pytest.mark.parametrize("made", [
    lambda: Errors(noise=-0.1), lambda: Errors(walk=-0.1), lambda: Errors(quantum=-0.1), lambda: Errors(bias=math.inf),
    lambda: Errors(memory=0.0), lambda: Errors(noise=math.inf), lambda: Gyro(rate=0.0), lambda: Gyro(rate=math.inf),
    lambda: Gyro(latency=-0.1), lambda: Gyro(loss=1.1), lambda: Gyro(loss=-0.1), lambda: Gyro(outage_every=0.0),
    lambda: Gyro(outage_length=-1.0), lambda: Gnss(speed_quantum=-0.1), lambda: Gnss(course_quantum=-0.1),
    lambda: Anemometer(skew=math.inf), lambda: Anemometer(speed_quantum=-1.0), lambda: EchoSounder(draught=-1.0),
    lambda: Anemometer(direction_quantum=-1.0), lambda: EchoSounder(reach=0.0), lambda: Feedback(of={"n": EXACT}),
    lambda: Gyro().start(-1), lambda: Suite(()).start(-1), lambda: Sensors(quantum={"u": -0.1}),
    lambda: not_below_zero("x", a=0.0, b=-1e-9), lambda: Gyro(rate=math.nan),
])  # fmt: skip
def test_impossible_figures_are_refused(made: object) -> None:
    with pytest.raises(SensorError):
        made()  # type: ignore[operator]


def test_figures_at_their_limits_are_taken() -> None:
    assert Gyro(loss=1.0).start(0).read(0.0, TRUTH) is None
    for one in (Gyro(loss=0.0), Gyro(latency=0.0), EchoSounder(draught=0.0), EchoSounder(reach=0.1)):
        assert one.start(0).read(0.0, TRUTH | {"per_depth": 1.0}) is not None
    assert Sensors({"u": 0.0}, {"u": -5.0}).bias == {"u": -5.0}
    assert Errors(bias=-1.0).bias == -1.0
    not_below_zero("x", a=0.0)


def test_a_reading_is_of_its_sample_and_comes_when_it_is_due() -> None:
    """Two samples a second, .6 s late, in steps of .25 s; the time of the sample is told."""
    run = RateGyro(rate=2.0, latency=0.6).start()
    found = [(0.25 * k, one.t, one.values["r"]) for k in range(12)
             if (one := run.read(0.25 * k, TRUTH | {"r": 0.25 * k})) is not None]  # fmt: skip
    assert found == [(0.75, 0.0, 0.0), (1.25, 0.5, 0.5), (1.75, 1.0, 1.0), (2.25, 1.5, 1.5), (2.75, 2.0, 2.0)]
    assert run.snapshot()["next"] == 6
    again = RateGyro(rate=2.0, latency=0.6).start()
    again.restore(run.snapshot())
    assert run.read(3.25, TRUTH) == again.read(3.25, TRUTH) is not None
    run.reset()
    assert run.read(0.0, TRUTH) is None
    assert run.read(0.75, TRUTH) is not None


def test_a_ship_without_what_an_instrument_measures_is_named() -> None:
    usual(SHIP).fit(TRUTH, "kvlcc2")
    lacking = {name: value for name, value in TRUTH.items() if name != "delta"}
    with pytest.raises(SensorError, match="feedback of other: delta"):
        usual(SHIP).fit(lacking, "other")


def test_saved_instruments_go_on_as_they_were() -> None:
    suite = usual(SHIP)
    one, other = suite.start(3), suite.start(3)
    for k in range(25):
        one.read(0.1 * k, TRUTH)
    other.restore(one.snapshot())
    for k in range(25, 60):
        assert one.read(0.1 * k, TRUTH) == other.read(0.1 * k, TRUTH)
    with pytest.raises(SensorError, match="saved state of 7 instruments; there are 1"):
        Suite((Gyro(),)).start().restore(one.snapshot())
    with pytest.raises(SensorError, match="not saved instruments"):
        one.restore(b"{")
    with pytest.raises(SensorError, match="another instrument"):
        Gyro().start().restore(RateGyro().start().snapshot())
    one.reset()
    assert one.read(0.0, TRUTH) == suite.start(3).read(0.0, TRUTH)


def test_a_recorded_channel_has_bias_then_noise_then_steps() -> None:
    t = np.arange(5000.0)
    run = Trial("run", t, {"u": 0.0 * t + 1.0, "r": 0.0 * t, "psi": 0.0 * t})
    read = Sensors({"r": 0.5}, {"u": 0.26}, {"u": 0.5, "r": 0.25}).read(run, np.random.default_rng(0))
    assert np.unique(read["u"]).tolist() == [1.5]
    assert np.unique(np.mod(read["r"], 0.25)).tolist() == [0.0]
    assert np.std(read["r"]) == pytest.approx(math.hypot(0.5, 0.25 / math.sqrt(12.0)), rel=0.04)
    assert abs(np.mean(read["r"])) < 4.0 * 0.5 / math.sqrt(5000)
    assert np.array_equal(read["psi"], run["psi"])


@pytest.mark.parametrize("rate", [0.1, 1.0, 50.0])
def test_sums_of_steps_that_are_rounded_take_the_samples_of_their_numbers(rate: float) -> None:
    """Ten steps a sample, added up: the times are a little early or late, the samples and their noise the same."""
    step, t = 0.1 / rate, 0.0
    gyro = RateGyro(rate=rate, latency=2.0 / rate, rate_of_turn=Errors(noise=1.0))
    summed, exact = gyro.start(5), gyro.start(5)
    for k in range(400):
        one, other = summed.read(t, TRUTH), exact.read(k * step, TRUTH)
        assert (one is None) == (other is None) == (k < 20 or k % 10 != 0)
        if one is not None and other is not None:
            assert one.values == other.values
        t += step


def test_an_instrument_of_which_nothing_is_said_reads_once_a_second_at_once_and_always() -> None:
    gyro = Gyro()
    assert (gyro.rate, gyro.latency, gyro.loss, gyro.outage_every, gyro.outage_length) == (1.0, 0.0, 0.0, math.inf, 0.0)
    run = gyro.start()
    assert [k for k in range(40) if run.read(0.25 * k, TRUTH) is not None] == list(range(0, 40, 4))
    assert Errors() == Errors(0.0, 0.0, 0.0, math.inf, 0.0) == EXACT
    assert Errors(memory=0.4).memory == 0.4
    lossy = Gyro(loss=0.5, rate=10.0).start(1)
    kept = sum(lossy.read(0.1 * k, TRUTH) is not None for k in range(1000))
    assert abs(kept - 500) < 4.0 * math.sqrt(250)
