"""Pieces of a ship on the wire, each by itself: voices, weather by the step, ranges, orders of links, fit pages."""

from __future__ import annotations

import io
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.core.errors import LoopError, RefusalError
from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.data.geodesy import Datum
from seatrial.data.nmea.framing import read_line
from seatrial.data.nmea.sentences import Sentence
from seatrial.data.nmea.ship import Fittings
from seatrial.environment import CHANNELS, Environment, Uniform
from seatrial.environment.weather import Gust, Measured, Together
from seatrial.realtime.fit_page.board import Part, _number, _range, shown
from seatrial.realtime.fleet import Fleet, Waiting
from seatrial.realtime.helm import Range
from seatrial.realtime.helm import _range as _reach_of
from seatrial.realtime.links.orders import Orders
from seatrial.realtime.loop import Loop
from seatrial.realtime.on_wire import _HELD, RATES, OnWire, Speech, Voice, exact, fitted, steers, told, unsaid
from seatrial.realtime.plant import Compiled, Surroundings, plant_of, rate_of
from seatrial.realtime.wire import Intake, Message
from seatrial.sensors import Reading
from seatrial.sensors.instruments import Feedback, Gnss, Gyro, RateGyro
from seatrial.sensors.suite import Suite
from seatrial.ships.files import load

SHIP = load("kvlcc2_l7")
HERE = Datum(35.0, 139.0)


@pytest.fixture(scope="module")
def compiled() -> Compiled:
    return Compiled.of(SHIP, 0.1)


class Strings:
    """A wire without a socket."""

    address, peers = "no socket", 1

    def __init__(self) -> None:
        self.intake, self.t, self.out = Intake(rate=1e9), 0.0, list[bytes]()
        self.waiting: list[Message] = []

    @property
    def counts(self) -> Any:
        return self.intake.counts

    def poll(self) -> list[Message]:
        waiting, self.waiting = self.waiting, []
        return waiting

    def send(self, data: bytes) -> None:
        self.out.append(data)


def wired(compiled: Compiled, **more: Any) -> tuple[Loop, Any, OnWire]:
    loop, wire = Loop({"s": compiled.plant()}, 10.0, math.inf), Strings()
    speech = more.pop("speech", Speech(Fittings(HERE, epoch=1.8e9), {"HDT": 1.0}))
    on: Any = OnWire(loop, "s", wire, speech, **more)  # type: ignore[arg-type]
    return loop, wire, on


# --- what a ship says ---


def test_ideal_instruments_stand_where_the_fittings_say() -> None:
    suite = exact(("delta", "n_P"), Fittings(antenna=(3.0, -1.0), log=2.0, stern=-4.0, transducer=0.5), 7.0)
    found: Any = {one.kind: one for one in suite.instruments}
    assert {one.rate for one in suite.instruments} == {7.0}
    assert (found["gnss"].antenna_x, found["gnss"].antenna_y) == (3.0, -1.0)
    assert (found["speed_log"].at_x, found["speed_log"].stern_x, found["echo_sounder"].draught) == (2.0, -4.0, 0.5)
    assert found["feedback"].controls == ("delta", "n_P")
    assert steers(suite)
    assert not steers(Suite((Gyro(), Gnss())))
    assert not steers(Suite((RateGyro(),)))


def test_a_fix_is_told_by_latitude_and_longitude_with_its_time() -> None:
    said = told(Reading("gnss", 4.5, {"x": 100.0, "y": -30.0, "U": 2.0}), Fittings(HERE))
    assert said == {"t": 4.5, "U": 2.0, **dict(zip(("latitude", "longitude"), HERE.place(100.0, -30.0), strict=True))}
    assert told(Reading("gyro", 1.0, {"psi": 0.3}), Fittings(HERE)) == {"t": 1.0, "psi": 0.3}


@pytest.mark.parametrize(("kind", "instruments", "fittings", "why"), [
    ("HDT", (Gyro(),), {}, ""), ("ROT", (Gyro(),), {}, "no rate gyro"), ("HDG", (Gyro(),), {}, "no magnetic compass"),
    ("HDG", (Gyro(),), {"variation": 0.0}, ""), ("VDO", (Gyro(), Gnss(), RateGyro()), {}, "no MMSI"),
    ("VDO", (Gyro(), Gnss(), RateGyro()), {"mmsi": 1_000_000_000}, "no MMSI"),
    ("VDO", (Gyro(), Gnss(), RateGyro()), {"mmsi": 999_999_999}, ""),
    ("VDO", (Gnss(),), {"mmsi": 5}, "no gyro and no rate gyro"),
    ("RSA", (Feedback(controls=("n_P",)),), {}, "no rudder with feedback"),
    ("RSA", (Feedback(controls=("delta",)),), {}, ""),
    ("RPM", (Feedback(controls=("delta",)),), {}, "no shaft with feedback"),
    ("RPM", (Feedback(controls=("n_P",)),), {}, ""),
])  # fmt: skip
def test_what_cannot_be_said_and_why(kind: str, instruments: Any, fittings: dict[str, Any], why: str) -> None:
    found = unsaid(kind, Suite(instruments), Fittings(**fittings))
    assert why in found if why else found == ""


def test_each_sentence_comes_at_its_rate_and_none_twice() -> None:
    """Readings of 10 Hz from 0 on: 2 Hz is each fifth, the first where half a second is full."""
    voice = Voice(Fittings(HERE), {"HDT": 2.0, "THS": 10.0, "HDG": 0.4}, 0.0)
    heard: dict[str, list[float]] = {"HDT": [], "THS": [], "HDG": []}
    for k in range(1, 61):
        for kind, said in voice.take(Reading("gyro", 0.1 * k, {"psi": 0.01 * k})):
            heard[kind].append(round(said["t"], 3))
    assert heard["HDT"] == [0.5 * k for k in range(1, 13)]
    assert len(heard["THS"]) == 60
    assert heard["HDG"] == [2.5, 5.0]
    assert voice.latest["psi"] == pytest.approx(0.6)
    saved = voice.snapshot()
    voice.reset()
    assert voice.latest == {}
    assert [kind for kind, _ in voice.take(Reading("gyro", 0.5, {"psi": 0.0}))] == ["HDT", "THS"]
    voice.restore(saved)
    assert voice.snapshot() == saved
    assert not list(voice.take(Reading("gyro", 6.0, {"psi": 0.0})))
    other = Voice(Fittings(HERE), {"ROT": 1.0}, 7.0)
    other.restore(saved)
    assert other.snapshot()["said"] == {"ROT": 0}


def test_the_transponder_waits_for_all_it_needs_and_tells_its_static_data_each_six_minutes() -> None:
    voice = Voice(Fittings(HERE, mmsi=211000001), {"VDO": 0.5, "VHW": 1.0}, 0.0)
    static, waited = list[float](), list[float]()
    fix = {"x": 0.0, "y": 0.0, "U": 1.0, "chi": 0.1}
    for t in range(2, 740, 2):
        if t == 6:
            assert not list(voice.take(Reading("gyro", 5.0, {"psi": 0.2})))
            assert not list(voice.take(Reading("rate_gyro", 5.0, {"r": 0.01})))
        for kind, said in voice.take(Reading("gnss", float(t), fix)):
            assert (kind, said["psi"], said["r"], said["t"]) == ("VDO", 0.2, 0.01, t)
            waited.append(t)
            if "static" in said:
                static.append(t)
    assert waited[0] == 6
    assert static == [6, 360, 720]
    ((kind, said),) = voice.take(Reading("speed_log", 740.0, {"u_w": 2.0}))
    assert (kind, said["psi"], said["u_w"]) == ("VHW", 0.2, 2.0)


def test_the_greatest_rates_are_those_of_the_table() -> None:
    assert RATES["HDT"] == RATES["THS"] == RATES["ROT"] == 10.0
    assert {kind for kind, rate in RATES.items() if rate == 5.0} == {"RSA", "VBW", "RMC", "HDG"}
    rare = {kind for kind, rate in RATES.items() if rate == 1.0}
    assert rare == {"GGA", "GLL", "VTG", "ZDA", "VHW", "RPM", "MWV", "DPT"}


def test_sentences_of_another_source_wait_for_the_next_tick_at_most_five_hundred(compiled: Compiled) -> None:
    loop, _, on = wired(compiled)
    heard: list[int] = []
    on.listeners.append(lambda message, loop: heard.append(message.sentence["k"]))
    on.hold([Message(Sentence("XX", "XXX", {"k": k}), "a") for k in range(_HELD + 3)])
    loop.step()
    assert heard == list(range(3, 503))
    loop.step()
    assert len(heard) == 500


def test_a_log_has_the_time_of_each_sentence(compiled: Compiled) -> None:
    log = io.BytesIO()
    loop, wire, on = wired(compiled, log=log)
    on.speakers.append(lambda loop: [b"$XXABC\r\n"] if loop.k == 10 else [])
    loop.run(2.0)
    rows = [read_line(line) for line in log.getvalue().splitlines()]
    assert [(row.sentence[3:6], row.tag.time, row.tag.source) for row in rows if row.tag] == [
        (b"ABC", 1.8e9 + 1.0, "II0001"), (b"HDT", 1.8e9 + 1.0, "II0001"), (b"HDT", 1.8e9 + 2.0, "II0001")]  # fmt: skip
    assert wire.out[0].startswith(b"$XXABC\r\n$HEHDT")
    on.say(loop, [b"$XXDEF\r\n"])
    assert read_line(log.getvalue().splitlines()[-1]).tag.time == pytest.approx(1.8e9 + 2.0)  # type: ignore[union-attr]


def test_a_line_that_is_lost_and_a_silent_commander_are_told_once(compiled: Compiled) -> None:
    loop, wire, on = wired(compiled, hold=3.0)
    kinds = lambda: [event.kind for event in loop.events]  # noqa: E731
    order = Sentence("AG", "ROR", {"stbdrudderorder": 5.0, "stbdrudderstatus": "A", "portrudderorder": None,
                                   "portrudderstatus": "V"})  # fmt: skip
    wire.waiting = [Message(order, "udp 1:1")]
    loop.run(3.0)
    assert kinds() == ["command"]
    loop.run(2.0)
    assert kinds() == ["command", "stale"]
    assert "nothing received for 3 s" in loop.events[-1].text
    for lost, reopened, text in ((1, 0, "is lost and tried again"), (1, 1, "is back"), (2, 1, "is lost")):
        wire.counts["lost"], wire.counts["reopened"], wire.counts["unsent"] = lost, reopened, 7
        loop.step()
        loop.step()
        assert text in loop.events[-1].text
        assert "7 sentences" in loop.events[-1].text
    assert kinds().count("line") == 3
    on.reset()
    assert on.snapshot() == {**on.snapshot(), "number": 0, "commander": "", "stale": False}


def test_what_a_ship_is_fitted_with_is_of_its_file() -> None:
    fit = fitted(SHIP, Fittings(HERE, mmsi=7))
    assert (fit.rudders, fit.shafts, fit.name, fit.length, fit.mmsi) == (("delta",), ("n_P",), "kvlcc2_l7", 7.0, 7)
    assert (fit.breadth, fit.draught) == (float(SHIP.model.breadth), float(SHIP.model.draught))


# --- plants and loops ---


@pytest.mark.slow
@pytest.mark.parametrize("weather", [
    Gust(Uniform(8.0, 2.0), "davenport", 3), Gust(Uniform(8.0, -1.0), "davenport", 3, across=0.5),
    Together((Gust(Uniform(8.0, 2.0), "davenport", 3), Uniform(0.0, 0.0, 1.0, 0.5))), Gust(Uniform(), "davenport", 3),
    Measured(np.array([0.0, 1000.0, 9000.0]), {"U_T": np.array([1.0, 5.0, 9.0]), "gamma_T": np.array([0.0, 1.0, 2.0])}),
])  # fmt: skip
def test_weather_step_by_step_is_its_series(weather: Any) -> None:
    """At any step, in any order, also beyond the hour that is worked out at first."""
    dt = 5.0
    around, series = Surroundings(weather, dt), weather.series(dt, 1600)
    assert around.changes
    assert len(series) == 1600
    for k in (0, 1, 15, 16, 17, 719, 720, 721, 100, 1439, 1440, 1599, 3):
        np.testing.assert_allclose(around.at(k), series[k], rtol=1e-9, atol=1e-12)
        assert around.values == pytest.approx(series[k].tolist(), abs=1e-12)
    around.hold(Environment(wind_x=3.0))
    assert not around.changes
    assert around.at(9)[0] == around.values[0] == 3.0
    around.hold(None)
    np.testing.assert_allclose(around.at(20), series[20], rtol=1e-9, atol=1e-12)


def test_steady_weather_is_one_row() -> None:
    around = Surroundings(Uniform(8.0, 1.0, depth=20.0), 0.1)
    assert not around.changes
    assert around.steady == tuple(around.values) == pytest.approx(tuple(Uniform(8.0, 1.0, depth=20.0).now()))


@pytest.mark.slow
@pytest.mark.parametrize(("psi", "wanted"), [(0.0, (1.5, 0.4)), (0.5 * math.pi, (1.4, -0.5)), (math.pi, (0.5, -0.4))])
def test_a_start_through_the_water_is_carried_by_the_current(psi: float, wanted: tuple[float, float]) -> None:
    weather = Uniform(U_C=math.hypot(0.5, 0.4), gamma_C=math.atan2(0.4, 0.5))
    for through in (True, False):
        plant = plant_of(SHIP, 10.0, weather, (1.0, 2.0, psi, 1.0, 0.0, 0.0), 3, through_water=through)
        assert (plant["u"], plant["v_m"]) == pytest.approx(wanted if through else (1.0, 0.0))
        assert (plant["x"], plant["y"], plant["psi"], plant.seed) == (1.0, 2.0, psi, 3)
        assert 0.1 / plant.dt == pytest.approx(round(0.1 / plant.dt))
    assert rate_of(SHIP, 7.0) == 7.0


def test_steps_of_a_tick_are_whole() -> None:
    def fleet(dt: float, rate: float, patience: float = 1.0) -> Fleet:
        plant: Any = SimpleNamespace(dt=dt, ship=SHIP)
        return Fleet({"a": plant}, rate, None, patience)

    assert fleet(0.1, 5.0)._steps == {"a": 2}
    for dt, rate, patience, why in ((0.1, 4.0, 1.0, "a: 4 ticks"), (0.1, 20.0, 1.0, "a: 20 ticks"),
                                    (0.1, 0.0, 1.0, "rate of 0"), (0.1, math.inf, 1.0, "rate of inf"),
                                    (0.1, 5.0, 0.0, "patience of 0")):  # fmt: skip
        with pytest.raises(LoopError, match=why):
            fleet(dt, rate, patience)
    assert fleet(0.1, 5.0, 0.4).patience == 0.4
    with pytest.raises(LoopError, match="without ships"):
        Fleet({}, 1.0, None, 1.0)


def test_a_commander_is_missed_after_its_patience_and_heard_again(compiled: Compiled) -> None:
    loop = Loop({"s": compiled.plant()}, 10.0, math.inf, patience=2.0)
    loop.run(5.0)
    assert not loop.vessels["s"].stale  # nobody has ordered yet
    loop.order("s", "delta", 0.1)
    loop.run(2.0)
    assert not loop.vessels["s"].stale
    loop.run(0.2)
    assert loop.vessels["s"].stale
    loop.order("s", "delta", 0.1)
    loop.step()
    assert not loop.vessels["s"].stale
    assert [event.kind for event in loop.events] == ["stale", "heard"]
    assert loop.events[0].t == pytest.approx(7.2, abs=0.11)


def test_an_order_out_of_range_counts_as_clipped_until_one_within(compiled: Compiled) -> None:
    loop = Loop({"s": compiled.plant()}, 10.0, math.inf)
    most = loop.vessels["s"].plant.ranges["delta"].high
    for value, clipped, events in ((most, set(), 0), (most + 1e-6, {"delta"}, 1), (9.0, {"delta"}, 1), (0.1, set(), 1),
                                   (-9.0, {"delta"}, 2)):  # fmt: skip
        loop.order("s", "delta", value)
        loop.step()
        assert loop.vessels["s"].clipped == clipped
        assert len(loop.events) == events
    assert Waiting().orders == {}


@pytest.mark.parametrize(("order", "taken"), [(3.0, 3.0), (math.pi, math.pi), (4.0, 4.0 - math.tau),
                                              (-7.0, math.tau - 7.0)])  # fmt: skip
def test_an_order_all_round_is_wrapped_beyond_half_a_turn(order: float, taken: float) -> None:
    assert Range(-math.pi, math.pi, math.pi, True).taken(order) == pytest.approx(taken)
    assert Range(-1.0, 2.0, 2.0).taken(order) == min(max(order, -1.0), 2.0)


@pytest.mark.parametrize(("control", "order", "factor", "low", "high", "wanted"), [
    ("n_P", "n_P", 1.0, -math.inf, math.inf, (-5.0, 5.0, 4.0)),
    ("n_1", "n_P", -2.0, -math.inf, math.inf, (-10.0, 10.0, 8.0)),
    ("n_bow", "n_bow", 1.0, -math.inf, math.inf, (-5.0, 5.0, 4.0)),
    ("n_bow", "n_bow", 1.0, -3.0, 3.0, (-3.0, 3.0, 3.0)),
    ("n_P", "n_P", 1.0, -1.0, 3.0, (-1.0, 3.0, 3.0)), ("n_P", "n_P", 1.0, -1.0, 9.0, (-1.0, 9.0, 4.0)),
    ("delta", "delta", 1.0, -math.inf, math.inf, (-math.radians(35.0), math.radians(35.0), math.radians(35.0))),
    ("alpha_1", "delta", 1.0, -math.inf, math.inf, (-math.pi, math.pi, math.pi)),
])  # fmt: skip
def test_the_range_of_a_control_is_that_of_its_gear_or_a_quarter_more_than_the_approach(
    control: str, order: str, factor: float, low: float, high: float, wanted: tuple[float, ...]
) -> None:
    gear = SimpleNamespace(of=lambda name: SimpleNamespace(low=low, high=high))
    found = _reach_of(SimpleNamespace(actuators=gear), control, order, factor, 4.0)  # type: ignore[arg-type]
    assert (found.low, found.high, found.full) == pytest.approx(wanted)
    assert found.all_round == control.startswith("alpha")


@pytest.mark.parametrize(("given", "angle"), [({"value": 0.3}, 0.3), ({"value": 90, "units": "deg"}, 0.5 * math.pi),
                                              ({"value": -2.0, "units": "rad"}, -2.0)])  # fmt: skip
def test_angles_of_requests_are_radians_unless_they_say_degrees(given: dict[str, Any], angle: float) -> None:
    signalk = pytest.importorskip("seatrial.realtime.links.signalk")
    assert signalk._angle(given) == pytest.approx(angle)
    for wrong in ({"value": True}, {"value": "1"}, {"value": 1e6}, {"value": 1.0, "units": "grad"}, {}):
        with pytest.raises(RefusalError):
            signalk._angle(wrong)


def test_a_copy_of_a_plant_and_what_it_feels_are_its_own(compiled: Compiled) -> None:
    plant = compiled.plant(environment=Uniform(U_C=0.3, gamma_C=0.5 * math.pi))
    plant.order("delta", 0.2)
    for _ in range(50):
        plant.step()
    other = plant.another()
    assert (other.k, other["x"]) == (0, 0.0)
    other.restore(plant.snapshot())
    assert [other[name] for name in plant] == [plant[name] for name in plant]
    assert plant.t == pytest.approx(5.0)
    assert [plant[name] for name in CHANNELS] == pytest.approx([0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0], abs=1e-12)
    plant.reset()
    assert (plant.k, plant["x"], plant["delta_cmd"]) == (0, 0.0, 0.0)
    assert plant["v_m"] == pytest.approx(0.3)  # it begins through the water, and drifts with it


# --- links ---


def test_orders_of_a_link_become_sentences_in_their_units_and_are_renewed_each_second(compiled: Compiled) -> None:
    loop, _, on = wired(compiled)
    held: list[Message] = []
    on.hold = held.extend
    orders = Orders(loop, on, "app")
    orders.steer_rudder(0.1)
    orders.turn_shafts(2.0)
    orders.steer_heading(-0.5)
    said = [message.sentence for message in held]
    assert [one.kind for one in said] == ["ROR", "PRC", "HTC"]
    assert said[0]["stbdrudderorder"] == said[0]["portrudderorder"] == pytest.approx(math.degrees(0.1), abs=0.01)
    assert (said[1]["rpmdemand"], said[1]["rpmdemandstatus"]) == (120.0, "R")
    assert said[2]["cmdheading"] == pytest.approx(360.0 - math.degrees(0.5), abs=0.01)
    assert {message.sender for message in held} == {"app"}
    held.clear()
    on.conning.commander, on.conning.heard = "app", 0.0
    loop.run(3.0)
    assert [message.sentence["status"] for message in held] == ["R"] * 3
    orders.let_go()
    assert not orders.engaged
    assert held[-1].sentence["stbdrudderorder"] == 0.0
    on.conning.commander = "another"
    before = dict(on.conning.counts)
    with pytest.raises(RefusalError, match="another has command"):
        orders.steer_rudder(0.1)
    assert on.conning.counts["refused"] == before.get("refused", 0) + 1
    assert (orders.commands, orders.mode, orders.heading) == (False, "none", None)


# --- pages of fits ---


def test_a_history_is_thinned_by_twos_and_told_to_who_stands_beside() -> None:
    clock, told = [10.0], list[tuple[float, ...]]()
    problem: Any = SimpleNamespace(trials=(), validation=(), free=())
    part = Part("a", problem, None, lambda: clock[0])
    part.beside = lambda *row: told.append(row)  # type: ignore[assignment]
    for k in range(4000):
        clock[0] = 10.0 + k
        part(k, 1.0 / (k + 1), 2.0)
    edition, rows = part.history
    assert (edition, len(rows)) == (1, 2000)
    assert [row[0] for row in rows[:3]] == [0, 2, 4]
    assert part.last == (3999, 1.0 / 4000.0, 2.0, 3999.0)
    assert told[7] == (7, 1.0 / 8.0, 2.0)
    part(4001, 0.0, 0.0)
    part(4002, 0.0, 0.0)
    assert len(part.history[1]) == 2001
    assert [_number(value) for value in (1.23456789, math.nan, -math.inf)] == [1.23457, None, None]


def test_the_range_of_a_parameter_is_four_sigmas_about_its_prior_or_two_scales_about_its_start() -> None:
    assert _range(Free("a.b", 5.0)) == (-5.0, 15.0)  # its scale is its size
    assert _range(Free("a.b", 5.0, 4.0, 11.0)) == (4.0, 8.5)  # and a quarter of its bounds
    assert _range(Free("a.b", 5.0, prior=3.0, sigma=0.25)) == (2.0, 5.0)
    assert _range(Free("a.b", 1.0, prior=3.0, sigma=0.25)) == (1.0, 4.0)
    assert _range(Free("a.b", 3.0, 2.5, 3.75, prior=3.0, sigma=0.25)) == (2.5, 3.75)


def test_trials_of_two_kinds_are_drawn() -> None:
    t = np.arange(3.0)
    trials = tuple(Trial(name, t, {}) for name in ("turn_1", "turn_2", "Zigzag-1", "spiral"))
    assert [one.name for one in shown(trials)] == ["turn_1", "Zigzag-1"]
    assert [one.name for one in shown(trials[:2])] == ["turn_1", "turn_2"]
    assert [one.name for one in shown(trials[:1])] == ["turn_1"]
