"""Pieces of the bridge, each at its bounds: command, history, ghost, manoeuvres, soundings, coasts, requests."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.core.errors import RefusalError
from seatrial.data import Trial
from seatrial.data.geodesy import Datum
from seatrial.environment import CHANNELS
from seatrial.environment.chart import Area, Chart
from seatrial.models import STATES
from seatrial.realtime.bridge import recorder
from seatrial.realtime.bridge.autopilot import Autopilot
from seatrial.realtime.bridge.command import Command
from seatrial.realtime.bridge.deck import Deck, Outfit, number
from seatrial.realtime.bridge.drill import Drill
from seatrial.realtime.bridge.ghost import Ghost
from seatrial.realtime.bridge.recorder import Recorder, plain, still
from seatrial.realtime.bridge.situation import Shown, Situation, _off
from seatrial.realtime.bridge.soundings import Soundings
from seatrial.realtime.bridge.view import OWN, Order, Trail, beam, bells, motion, outline
from seatrial.realtime.loop import Loop
from seatrial.realtime.pages import LOCAL, Client, Guarded, anywhere, known
from seatrial.realtime.plant import Compiled
from seatrial.ships.files import load

SHIP = load("kvlcc2_l7")
LENGTH = SHIP.L_pp / SHIP.speed
"""Time in which the ship sails its length [s]."""


@pytest.fixture(scope="module")
def compiled() -> Compiled:
    return Compiled.of(SHIP, 0.1)


def at_sea(compiled: Compiled, outfit: Outfit | None = None) -> tuple[Deck, Loop]:
    loop = Loop({OWN: compiled.plant()}, 10.0, math.inf)
    bridge = Deck(loop, outfit or Outfit(hold=1e6), lambda: loop.t)
    bridge.command.come("A", 0.0)
    return bridge, loop


# --- command ---


def test_a_commander_is_stale_by_its_own_silence() -> None:
    command = Command(5.0)
    assert not command.stale(1e9)  # nobody commands
    command.come("A", 10.0)
    command.come("B", 12.0)
    command.beat("B", 14.0)  # of who does not command says nothing
    assert [command.stale(t) for t in (15.0, 15.1)] == [False, True]
    command.beat("A", 16.0)
    assert [command.stale(t) for t in (21.0, 21.1)] == [False, True]
    assert command.take("B", 21.1)
    assert (command.holder, command.stale(26.0), command.stale(26.2)) == ("B", False, True)
    assert command.take("B", 30.0)  # who has it, has it
    assert not command.stale(35.0)


def test_who_leaves_asks_no_more_and_gets_no_command() -> None:
    command = Command(5.0)
    for who in "ABC":
        command.come(who, 0.0)
    assert not command.take("B", 1.0)
    command.leave("C")
    assert command.asking == "B"
    command.keep("C")
    assert command.asking == "B"
    command.leave("B")
    assert command.asking == ""
    assert not command.give("A", 1.0)
    command.come("B", 2.0)
    command.take("B", 2.0)
    assert not command.give("C", 2.0)
    assert command.give("A", 2.0)
    assert (command.holder, command.asking, command.present) == ("B", "", {"A", "B"})


# --- what the page shows ---


def test_the_history_has_a_point_each_fortieth_of_a_length(compiled: Compiled) -> None:
    plant = compiled.plant()
    trail, step = Trail(plant, SHIP.speed), LENGTH / 40.0  # .148 s
    for k in range(100):
        trail.see(0.01 * k, None if k < 10 else 0.123456789)
    rows = trail.rows()
    assert [row[0] for row in rows] == pytest.approx([0.15 * k for k in range(7)], abs=1e-3)
    assert (rows[0][-1], rows[-1][-1]) == (None, 0.1234568)
    assert rows[-1][4] == pytest.approx(SHIP.speed, rel=1e-6)
    for k in range(4100):
        trail.see(1000.0 + k * 2.0 * step, 0.0)
    assert len(trail.rows()) == 4000
    kept = trail.snapshot()
    trail.clear()
    assert trail.rows() == []
    trail.restore([*kept, *kept])
    assert len(trail.rows()) == 4000


def an_order(**more: Any) -> Order:
    given = {"name": "delta", "label": "", "kind": "rudder", "unit": "rad", "per": 1.0, "low": -1.0, "high": 1.5,
             "full": 1.0, "sided": True, "moves": (("delta_1", 1.0), ("delta_2", -2.0), ("delta_3", 0.0))}  # fmt: skip
    return Order(**{**given, **more})


@pytest.mark.parametrize(("apart", "shown"), [(0.049, 0.3245), (0.051, None), (-0.049, 0.2755), (-0.051, None)])
def test_parts_that_differ_by_two_in_a_hundred_of_the_range_have_no_one_value(apart, shown) -> None:
    """The range is 2.5, a fiftieth of it .05; a part without effect does not count."""
    found = an_order().actual({"delta_1": 0.3, "delta_2": -2.0 * (0.3 + apart), "delta_3": 9.0})
    assert found == (shown if shown is None else pytest.approx(shown))


def test_azimuths_of_a_shared_order_are_the_shorter_way_round() -> None:
    moves = (("alpha_1", 1.0), ("alpha_2", 1.0))
    assert an_order(moves=moves).actual({"alpha_1": 0.2 + math.tau, "alpha_2": 0.2}) == pytest.approx(0.2)
    assert an_order(moves=moves[:1]).actual({"alpha_1": 0.2 + math.tau}) == pytest.approx(0.2 + math.tau)
    assert an_order(moves=()).actual({}) == 0.0


def test_a_ship_without_a_breadth_has_a_seventh_of_its_length() -> None:
    plant: Any = SimpleNamespace(ship=SimpleNamespace(name="x", L_pp=70.0, model=SimpleNamespace(breadth=0.0)))
    assert outline(plant) == {"name": "x", "L": 70.0, "B": 10.0}
    plant.ship.model.breadth = 12.0
    assert beam(plant) == 12.0


def test_the_telegraph_has_eleven_positions_from_full_ahead_down() -> None:
    found = bells()
    assert [share for share, _ in found] == [1.0, 0.85, 0.65, 0.45, 0.3, 0.0, -0.3, -0.45, -0.65, -0.85, -1.0]
    assert [name for _, name in found] == [
        "Navigation full", "Full ahead", "Half ahead", "Slow ahead", "Dead slow ahead", "Stop",
        "Dead slow astern", "Slow astern", "Half astern", "Full astern", "Crash astern"]  # fmt: skip


def test_a_picture_has_the_motion_to_seven_digits(compiled: Compiled) -> None:
    plants = {OWN: compiled.plant(), "other": compiled.plant(start=(123.45678912, 5.0, 0.5, 1.0, 0.0, 0.0))}
    loop = Loop(plants, 10.0, math.inf)
    loop.run(0.3)
    seen = motion(loop, (an_order(moves=(("delta", 1.0),)),))
    assert seen["t"] == 0.3
    assert seen["others"]["other"][0] == float(f"{loop.vessels['other'].plant['x']:.7g}")
    assert (seen["act"], seen["ord"], seen["around"]) == ({"delta": 0.0}, {"delta": 0.0}, [0.0] * 4)


# --- ghost and manoeuvres ---


def test_a_ghost_has_its_orders_of_the_row_before_and_its_pose_between_rows() -> None:
    t = np.array([50.0, 52.0, 54.0])
    trial = Trial("log", t, {
        "x": np.array([10.0, 14.0, 14.0]), "y": np.array([0.0, 0.0, 6.0]), "psi": np.array([6.2, 6.3, 0.2]),
        "u": np.array([2.0, np.nan, 2.0]), "delta": np.array([0.1, 0.2, 0.3]),
        "delta_cmd": np.array([0.5, 0.6, np.nan]), "n_P": np.array([1.0, 2.0, 3.0]),
    }, meta={"datum": {"latitude": 35.0, "longitude": 139.0}})  # fmt: skip
    ghost = Ghost(trial, ("delta", "n_P", "alpha"))
    assert (ghost.start, ghost.duration) == ((10.0, 0.0, 6.2, 2.0, 0.0, 0.0), 4.0)
    assert ghost.datum == Datum(35.0, 139.0)
    assert [ghost.orders(s) for s in (-0.1, 0.0, 1.9, 2.0, 4.0, 4.1)] == [
        {}, {"delta": 0.5, "n_P": 1.0}, {"delta": 0.5, "n_P": 1.0}, {"delta": 0.6, "n_P": 2.0}, {"n_P": 3.0}, {}
    ]
    assert ghost.pose(1.0) == pytest.approx((12.0, 0.0, 6.25))
    ghost.lay((100.0, 7.0, 8.0, 6.2 + 0.5 * math.pi))
    assert ghost.laid == pytest.approx([100.0, 7.0, 8.0, 6.2 + 0.5 * math.pi])
    assert ghost.pose(104.0) == pytest.approx((1.0, 12.0, 0.2 + 2.5 * math.pi))
    assert [ghost.pose(s) is None for s in (99.9, 100.0, 104.0, 104.1)] == [True, False, False, True]
    x, y, psi, gap, off = ghost.beside(104.0, [4.0, 16.0, 0.3]) or [0.0] * 5
    assert (x, y, gap) == pytest.approx((1.0, 12.0, 5.0))
    assert off == pytest.approx(math.remainder(0.3 - psi, math.tau), abs=1e-5)
    assert ghost.beside(104.0, [4.0, None, 0.3]) is None


class Endless:
    """A manoeuvre that is never complete."""

    kind, orders = "endless", ("delta", "no_such")

    def __init__(self) -> None:
        self.looked: list[int] = []

    def begin(self, state: Any) -> tuple[float, ...]:
        return (0.0,)

    def command(self, t: float, state: Any, memory: tuple[float, ...]) -> tuple[tuple[float, float], tuple[float, ...]]:
        return (0.1 + memory[0], 0.2), (memory[0] + 1.0,)

    def complete(self, trial: Trial) -> bool:
        self.looked.append(len(trial))
        return False

    def indices(self, trial: Trial, L_pp: float) -> dict[str, Any]:
        return {"rows": L_pp}


def test_a_manoeuvre_is_looked_at_each_quarter_length_and_ends_after_five_hundred() -> None:
    """Rows each hundredth of a length: 26 at the first look, then 25 more each."""
    names = dict.fromkeys((*STATES, *CHANNELS), 0.5)

    class Still(dict):
        t, controls, orders, changing = 0.0, (), ("delta",), False
        ship = SimpleNamespace(L_pp=8.0)

    plant: Any = Still(names)
    plant.t = 7.0
    policy: Any = Endless()
    drill = Drill(policy, plant, 2.0)  # 4 s a length
    said = []
    for k in range(60):
        plant.t = 7.0 + 0.04 * k + 1e-9 * k
        said.append(drill.steer(plant))
    assert policy.looked == [26, 51]
    assert said[:2] == [{"delta": pytest.approx(0.1)}, {"delta": pytest.approx(1.1)}]
    assert drill.indices == {"rows": 8.0}
    saved = drill.snapshot()
    again = Drill(policy, plant, 2.0)
    again.restore(saved)
    assert again.snapshot() == saved
    for t, over in ((1999.0, False), (2001.0, True)):
        plant.t = 7.0 + t
        drill.steer(plant)
        assert drill.over is over
    assert not drill.complete


# --- soundings and coasts ---


@pytest.mark.slow
def test_a_ship_is_told_little_water_below_a_fifth_of_its_draught() -> None:
    """kvlcc2_shallow draws 20.8 m: 24.97 m of water leave a fifth, less is announced; and grounding once more."""
    ship = load("kvlcc2_shallow")
    T = float(ship.model.draught)
    loop = Loop({OWN: Compiled.of(ship, 0.5).plant()}, 2.0, math.inf)
    chart = SimpleNamespace(depth=0.0, depth_at=lambda x, y: np.array([chart.depth]))
    sounds = Soundings(loop, chart)  # type: ignore[arg-type]
    plant, told = loop.vessels[OWN].plant, lambda: [event.kind for event in loop.events]
    for depth, kinds in ((1.21 * T, []), (1.19 * T, ["little"]), (1.1 * T, ["little"]), (1.01 * T, ["little"]),
                         (0.99 * T, ["little", "aground"]), (1.1 * T, ["little", "aground"]),
                         (0.9 * T, ["little", "aground", "aground"]), (3.0 * T, ["little", "aground", "aground"]),
                         (1.1 * T, ["little", "aground", "aground", "little"])):  # fmt: skip
        chart.depth = depth
        sounds.sound(loop)
        assert told() == kinds
        assert sounds.under(plant) == pytest.approx(depth - T)
    text = loop.events[-1].text
    assert f"{0.1 * T:.2g} m under the keel" in text


def test_the_depth_is_passed_on_when_it_changes_by_a_thousandth_and_never_below_a_twentieth_of_the_draught() -> None:
    ship = load("kvlcc2_shallow")
    T = float(ship.model.draught)
    loop = Loop({OWN: Compiled.of(ship, 0.5).plant()}, 2.0, math.inf)
    chart = SimpleNamespace(depth=40.0, depth_at=lambda x, y: np.array([chart.depth]))
    sounds, plant = Soundings(loop, chart), loop.vessels[OWN].plant  # type: ignore[arg-type]
    for depth, felt in ((40.0, 40.0), (40.03, 40.0), (39.97, 40.0), (40.06, 40.06), (0.1, 0.05 * T), (-3.0, 0.05 * T)):
        chart.depth = depth
        sounds.sound(loop)
        loop._waiting.around and loop.vessels[OWN].plant.surround(loop._waiting.around[OWN])
        loop._waiting.around.clear()
        assert 1.0 / plant["per_depth"] == pytest.approx(felt)
    chart.depth = math.inf
    sounds.sound(loop)
    assert loop._waiting.around[OWN].per_depth == 0.0


@pytest.mark.parametrize(("line", "off"), [
    ([[3.0, 4.0], [3.0, 40.0]], 5.0), ([[3.0, -10.0], [3.0, 40.0]], 3.0), ([[-10.0, 10.0], [10.0, -8.0]], 0.743294),
    ([[1.0, 1.0], [1.0, 1.0]], math.sqrt(2.0)), ([[100.0, 1.0], [50.0, 50.0], [6.0, 8.0]], 10.0),
])  # fmt: skip
def test_a_line_is_as_far_as_its_nearest_point(line: Any, off: float) -> None:
    a = np.array(line)
    brute = min(float(np.hypot(*(p + (q - p) * np.linspace(0, 1, 2001)[:, None]).T).min()) for p, q in pairwise(a))
    assert _off(a) == pytest.approx(off, rel=1e-4)
    assert _off(a) == pytest.approx(brute, rel=1e-3, abs=1e-2)


def test_the_page_has_the_depth_that_is_felt_else_that_of_the_chart() -> None:
    here = Datum(35.0, 139.0)
    chart = Chart("c", 50.0, (Area(np.array([[0.0, 0.0], [0.0, 10.0], [10.0, 10.0], [10.0, 0.0]]), 7.126),))
    situation = Situation(here, 1e9, Shown(chart))
    plant: Any = {"x": 5.0, "y": 5.0, "per_depth": 0.0}
    assert situation.frame(plant)["depth"] == 7.13
    assert situation.frame(plant)["place"] == [round(v, 7) for v in here.place(5.0, 5.0)]
    assert situation.frame({**plant, "per_depth": 0.125})["depth"] == 8.0
    assert situation.frame({**plant, "x": -5.0})["depth"] == 50.0
    assert situation.frame({**plant, "x": math.nan}) == {"place": None, "depth": None}
    assert Situation().frame(plant) == {"place": None, "depth": None}
    assert Shown().depth(0.0, 0.0) == math.inf


# --- requests ---


@pytest.mark.parametrize(("said", "refused"), [
    ({"U_T": 0.0, "U_C": 5.0}, False), ({"U_T": 0.0, "U_C": 5.01}, True), ({"U_T": 0.0, "U_C": -0.01}, True),
    ({"U_T": 60.01, "U_C": 0.0}, True), ({"U_T": -0.01, "U_C": 0.0}, True),
])  # fmt: skip
def test_weather_of_the_page_is_within_its_bounds(compiled: Compiled, said: dict[str, float], refused: bool) -> None:
    bridge, loop = at_sea(compiled)
    told = bridge.ask("A", {"do": "around", "gamma_T": 1.0, "gamma_C": 0.5 * math.pi, **said})
    assert bool(told) is refused
    loop.step()
    plant = loop.vessels[OWN].plant
    assert (plant["current_x"], plant["current_y"]) == pytest.approx((0.0, 0.0 if refused else said["U_C"]))


@pytest.mark.slow
def test_wind_up_to_sixty_metres_a_second_is_taken_by_a_ship_that_feels_it() -> None:
    bridge, loop = at_sea(Compiled.of(load("kvlcc2"), 0.1))
    wind = {"do": "around", "gamma_T": 0.5 * math.pi, "U_C": 0.0, "gamma_C": 0.0}
    assert bridge.ask("A", {**wind, "U_T": 60.0}) == ""
    loop.step()
    assert loop.vessels[OWN].plant["wind_y"] == pytest.approx(60.0)


def test_pictures_come_twenty_times_a_second_of_the_clock(compiled: Compiled) -> None:
    now, shown = [0.0], list[float]()
    loop = Loop({OWN: compiled.plant()}, 10.0, math.inf)
    bridge = Deck(loop, Outfit(), lambda: now[0])
    bridge.fresh = lambda: shown.append(now[0])
    for k in range(101):
        now[0] = 0.01 * k
        loop.step()
    assert shown[2:] == pytest.approx([0.05 * k - 0.01 for k in range(1, 21)], abs=0.0101)  # a fifth early
    for later in (5.0, 5.01, 5.02, 5.03):
        now[0] = later
        loop.step()
    assert len(shown) == 24  # one at once, one in its place: nothing is made up for


def test_the_page_has_the_last_six_events_and_counts_all(compiled: Compiled) -> None:
    bridge, loop = at_sea(compiled)
    for k in range(9):
        loop.tell(OWN, "stale", f"event {k}")
    frame = bridge.frame()
    assert [text for _, _, text in frame["events"]] == [f"event {k}" for k in range(3, 9)]
    assert frame["told"] == 9


def test_a_heading_is_held_until_a_hand_is_on_the_rudder_but_not_on_the_engine(compiled: Compiled) -> None:
    bridge, loop = at_sea(compiled)
    assert bridge.ask("A", {"do": "hold", "psi": 0.3 - math.tau}) == ""
    assert bridge.frame()["held"] == pytest.approx(0.3)
    loop.step()
    loop.step()
    assert loop.vessels[OWN].plant["delta_cmd"] > 0.05
    assert bridge.ask("A", {"do": "order", "name": "n_P", "value": 5.0}) == ""
    assert bridge.frame()["held"] == pytest.approx(0.3)
    assert bridge.ask("A", {"do": "order", "name": "delta", "value": -0.1}) == ""
    assert bridge.frame()["held"] is None


def test_one_tick_only_while_the_run_is_paused(compiled: Compiled) -> None:
    bridge, loop = at_sea(compiled)
    assert bridge.ask("A", {"do": "step"}) == "pause first"
    assert bridge.ask("A", {"do": "pause"}) == ""
    assert bridge.ask("A", {"do": "step"}) == ""
    assert loop.k == 1
    assert bridge.frame()["paused"]
    assert bridge.ask("A", {"do": "resume"}) == ""
    assert not loop.paused
    with still(loop):
        assert loop.paused
    assert not loop.paused
    loop.pause()
    with still(loop):
        assert loop.paused
    assert loop.paused


@pytest.mark.parametrize("value", [True, None, "1", math.nan, math.inf, [1.0]])
def test_what_is_no_number_is_refused(value: object) -> None:
    with pytest.raises(RefusalError, match="a must be a finite number"):
        number({"a": value}, "a")
    assert number({"a": 2}, "a") == 2.0


def test_an_autopilot_that_is_off_orders_nothing_and_one_without_a_rudder_cannot_be_on(compiled: Compiled) -> None:
    pilot = Autopilot(compiled.plant())
    assert (pilot.able, pilot.course, pilot.rudder(0.1)) == (True, None, 0.0)
    pilot.engage(-0.2)
    assert pilot.course == pytest.approx(math.tau - 0.2)
    assert pilot.rudder(0.1) < 0.0
    saved = pilot.snapshot()
    pilot.disengage()
    assert pilot.course is None
    pilot.restore(saved)
    assert pilot.course == pytest.approx(math.tau - 0.2)
    none = Autopilot(SimpleNamespace(ranges={}, ship=SimpleNamespace(name="raft")))  # type: ignore[arg-type]
    assert (none.able, none.course, none.rudder(1.0), none.snapshot()) == (False, None, 0.0, None)
    with pytest.raises(RefusalError, match="raft has no rudder"):
        none.engage(0.0)


@pytest.mark.parametrize(("name", "safe"), [("a b/c", "a_b_c"), (".hidden", "hidden"), ("x" * 99, "x" * 80),
                                            ("..", "ship"), ("ship+1.5-b", "ship+1.5-b")])  # fmt: skip
def test_names_of_files_are_plain(name: str, safe: str) -> None:
    assert plain(name) == safe


def test_a_recorder_says_where_it_writes_and_how_many_rows(compiled: Compiled, tmp_path: Path) -> None:
    loop = Loop({OWN: compiled.plant()}, 10.0, math.inf)
    taker = Recorder(loop, tmp_path, {})
    assert taker.told is None
    taker.start()
    assert taker.told == ("", 0, "")
    loop.run(0.3)
    name, rows, why = taker.told
    assert (rows, why) == (3, "")
    assert Path(name).parent == tmp_path
    with pytest.raises(RefusalError, match="already in progress"):
        taker.start()
    (path,) = taker.stop()
    assert str(path) == name
    assert taker.told is None
    assert taker.stop() == []
    assert recorder.OWN == OWN


# --- the server's rules ---


@pytest.mark.parametrize(("host", "names", "served"), [
    ("localhost:8000", LOCAL, True), ("127.0.0.1", LOCAL, True), ("evil.example", LOCAL, False),
    ("192.168.1.5:80", LOCAL, False), ("192.168.1.5:80", (*LOCAL, "addresses"), True),
    ("addresses", ("addresses",), False), ("[::1]:80", ("addresses",), True), ("", LOCAL, False),
    ("http://[", LOCAL, False),
])  # fmt: skip
def test_which_hosts_are_served(host: str, names: tuple[str, ...], served: bool) -> None:
    assert known(host, names) is served


def test_names_of_this_machine_are_served_anywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("seatrial.realtime.pages.socket.gethostname", lambda: "Bridge.ship.example")
    assert anywhere() == ("127.0.0.1", "localhost", "bridge.ship.example", "bridge.local", "addresses")


def test_a_browser_floods_from_two_hundred_requests_a_second_and_is_deaf_when_it_confirms_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [100.0]
    monkeypatch.setattr("seatrial.realtime.pages.time", SimpleNamespace(monotonic=lambda: now[0]))
    client = Client(SimpleNamespace(), behind=3)  # type: ignore[arg-type]
    assert not any(client.floods() for _ in range(200))
    now[0] += 0.99
    assert client.floods()
    now[0] += 0.02
    assert not client.floods()
    client.sent = 3
    assert not client.deaf
    client.sent = 4
    assert client.deaf
    said = deque(['{"read": 2}', '{"read": 9}', '{"read": 1}', '{"read": "x"}', "[]", "rubble"])

    async def receive_text() -> str:
        return said.popleft()

    client.socket = SimpleNamespace(receive_text=receive_text)  # type: ignore[assignment]
    for read, deaf in ((2, False), (4, False), (4, False), (4, False), (4, False), (4, False)):
        asyncio.run(client.hear())
        assert (client.read, client.deaf) == (read, deaf)


def test_a_connection_has_ten_seconds_for_each_request() -> None:
    """From its beginning, and anew from each answer; a socket of a page has all the time."""
    wound: list[tuple[float, object]] = []
    gone: list[int] = []
    one = Guarded.__new__(Guarded)
    one.transport = SimpleNamespace(abort="abort", is_closing=lambda: False)  # type: ignore[assignment]
    one.loop = SimpleNamespace(  # type: ignore[assignment]
        call_later=lambda seconds, what: wound.append((seconds, what)) or SimpleNamespace(cancel=lambda: gone.append(1))
    )
    one._wind()
    assert (wound, gone) == ([(10.0, "abort")], [])
    one._wind()
    assert (wound, gone) == ([(10.0, "abort")] * 2, [1])
    one._unwind()
    assert gone == [1, 1]


def test_who_has_command_hands_it_over_and_nobody_else_does(compiled: Compiled) -> None:
    bridge, _ = at_sea(compiled)
    for who in ("B", "C"):
        bridge.command.come(who, 0.0)
    refused = "nobody asks for command, or you do not have it"
    assert [bridge.ask(who, {"do": "give"}) for who in "AB"] == [refused, refused]
    assert bridge.ask("B", {"do": "take"}) == "A has been asked for command"
    assert bridge.ask("C", {"do": "give"}) == refused
    assert bridge.ask("A", {"do": "give"}) == ""
    assert (bridge.command.holder, bridge.command.asking) == ("B", "")
