"""The ship's side of the bridge: command, orders, manoeuvres, the ghost, recordings."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.data import DataError, Trial
from seatrial.data.trialfile import read_trial
from seatrial.manoeuvres import Index
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.realtime.bridge.command import Command
from seatrial.realtime.bridge.deck import Deck, Outfit
from seatrial.realtime.bridge.ghost import Ghost
from seatrial.realtime.bridge.view import OWN, indices_json
from seatrial.realtime.conning import TELEGRAPH
from seatrial.realtime.loop import Loop
from seatrial.realtime.plant import Compiled
from seatrial.realtime.recording import rerun
from seatrial.ships.files import load
from seatrial.simulate.run import simulate
from seatrial.workflow.afloat import cannot

SHIP = load("kvlcc2_l7")
N_P = 10.42
DRILLS = {
    "turn": lambda n: Turning(n, math.radians(35.0)),
    "zigzag": lambda n: Zigzag(n, math.radians(10.0), math.radians(10.0)),
}


class Time:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now

    def go_on(self, seconds: float) -> None:
        self.now += seconds


@pytest.fixture(scope="module")
def compiled() -> Compiled:
    return Compiled.of(SHIP, 0.05)


def deck(compiled: Compiled, outfit: Outfit | None = None, clock: Time | None = None) -> tuple[Deck, Loop]:
    loop, time = Loop({OWN: compiled.plant()}, 20.0, math.inf), clock or Time()
    loop.after(lambda _: time.go_on(0.05))
    made = Deck(loop, outfit or Outfit(DRILLS, hold=1e6), time)
    made.command.come("A", 0.0)
    return made, loop


def ticks(loop: Loop, seconds: float) -> None:
    for _ in range(round(seconds * loop.rate)):
        loop.step()


def order(value: Any, name: Any = "delta") -> dict[str, Any]:
    return {"do": "order", "name": name, "value": value}


def test_the_first_has_command_and_hands_it_over_in_so_many_words() -> None:
    command = Command(5.0)
    for who in "ABC":
        command.come(who, 0.0)
    assert command.holder == "A"
    assert not command.take("B", 1.0)
    assert command.asking == "B"
    assert not command.give("B", 1.0)
    command.keep("A")
    assert (command.holder, command.asking) == ("A", "")
    command.take("C", 1.0)
    assert command.give("A", 1.0)
    assert command.holder == "C"


def test_a_silent_commander_is_stale_and_loses_command_to_who_asks() -> None:
    command = Command(5.0)
    command.come("A", 0.0)
    command.come("B", 0.0)
    command.leave("A")
    assert not command.stale(5.0)
    assert command.stale(5.1)
    command.come("A", 5.2)  # a reload keeps its command
    assert not command.stale(6.0)
    assert command.take("B", 11.0)


def test_orders_come_from_the_commander_alone(compiled: Compiled) -> None:
    bridge, loop = deck(compiled)
    bridge.command.come("B", 0.0)
    assert "A has command" in bridge.ask("B", order(0.2))
    assert bridge.ask("A", order(0.2)) == ""
    ticks(loop, 10.0)
    frame = bridge.frame()
    assert frame["ord"]["delta"] == pytest.approx(0.2)
    assert frame["act"]["delta"] == pytest.approx(0.2)
    assert frame["own"][2] > 0.05  # starboard rudder, starboard turn
    assert frame["t"] == pytest.approx(10.0)


def test_beyond_the_limits_is_clipped_and_shown(compiled: Compiled) -> None:
    bridge, loop = deck(compiled)
    bridge.ask("A", order(2.0))
    ticks(loop, 0.1)
    frame = bridge.frame()
    assert frame["clipped"] == ["delta"]
    assert frame["ord"]["delta"] == pytest.approx(math.radians(35.0))
    assert frame["events"][-1][1] == "clipped"


@pytest.mark.parametrize("said", [
    {}, {"do": 3}, {"do": []}, {"do": "sink"}, order("hard over"), order(math.nan), order(True), order(0.1, "sail"),
    order(0.1, []), {"do": "pace", "factor": 1e9}, {"do": "around", "U_T": 1e9, "gamma_T": 0, "U_C": 0, "gamma_C": 0},
    {"do": "drill", "name": "loop the loop"}, {"do": "ghost"}, {"do": "unrecord"}, {"do": "step"}, {"do": "give"},
])  # fmt: skip
def test_nonsense_is_answered_in_a_line_and_moves_nothing(compiled: Compiled, said: dict[str, Any]) -> None:
    bridge, loop = deck(compiled)
    before = bridge.frame()
    answer = bridge.ask("A", said)
    assert answer
    assert "\n" not in answer
    assert bridge.frame() == before
    assert loop.k == 0


def test_a_silent_commander_is_reported_while_orders_hold(compiled: Compiled) -> None:
    bridge, loop = deck(compiled, Outfit(hold=5.0))
    bridge.ask("A", order(0.1))
    ticks(loop, 4.9)
    assert not bridge.frame()["command"][2]
    ticks(loop, 0.2)
    for _ in range(2):
        frame = bridge.frame()
    assert frame["command"][2]
    assert [kind for _, kind, _ in frame["events"]] == ["stale"]
    assert frame["ord"]["delta"] == pytest.approx(0.1)


@pytest.mark.slow
def test_a_zigzag_on_the_bridge_has_the_figures_of_the_simulated_one(compiled: Compiled) -> None:
    bridge, loop = deck(compiled)
    assert bridge.ask("A", {"do": "drill", "name": "zigzag"}) == ""
    ticks(loop, 100.0)
    name, over, complete, indices = bridge.frame()["drill"]
    assert (name, over, complete) == ("zigzag", True, True)
    found = {index[0]: index[1] for index in indices}
    n_P = loop.vessels[OWN].plant["n_P_cmd"]
    policy = DRILLS["zigzag"](n_P)
    wanted = policy.indices(simulate(SHIP, policy, speed=SHIP.speed, duration=100.0, dt=0.05), SHIP.L_pp)
    first = found["first_overshoot"]
    assert first == pytest.approx(wanted["first_overshoot"].value, rel=0.03)
    assert loop.vessels[OWN].plant["delta_cmd"] == 0.0


def test_a_hand_on_the_wheel_ends_a_manoeuvre(compiled: Compiled) -> None:
    bridge, loop = deck(compiled)
    bridge.ask("A", {"do": "drill", "name": "turn"})
    ticks(loop, 5.0)
    assert bridge.frame()["ord"]["delta"] == pytest.approx(math.radians(35.0))
    bridge.ask("A", order(-0.1))
    ticks(loop, 5.0)
    frame = bridge.frame()
    assert frame["drill"][1]
    assert frame["ord"]["delta"] == pytest.approx(-0.1)


def test_a_recording_is_a_trial_that_runs_again(compiled: Compiled, tmp_path: Path) -> None:
    bridge, loop = deck(compiled, Outfit(DRILLS, tmp_path))
    assert bridge.ask("A", {"do": "record"}) == ""
    bridge.ask("A", order(0.3))
    ticks(loop, 3.0)
    path = Path(bridge.frame()["record"][0])
    assert len(read_trial(path)) == 60  # whole while it is written
    assert bridge.ask("A", {"do": "unrecord"}) == ""
    trial = read_trial(path)
    np.testing.assert_array_equal(rerun(path, SHIP)["psi"], trial["psi"])
    assert bridge.frame()["record"] is None
    assert bridge.close() == []


@pytest.mark.slow
def test_a_ghost_of_the_same_run_lies_under_the_ship(compiled: Compiled) -> None:
    policy = Turning(N_P, math.radians(20.0))
    trial = simulate(SHIP, policy, speed=SHIP.speed, duration=60.0, dt=0.05)
    ghost = Ghost(trial, SHIP.model.controls)
    loop, time = Loop({OWN: compiled.plant(start=ghost.start, n_P=N_P)}, 20.0, math.inf), Time()
    loop.after(lambda _: time.go_on(0.05))
    bridge = Deck(loop, Outfit(ghost=ghost, hold=1e6), time)
    bridge.command.come("A", 0.0)
    assert bridge.ask("A", {"do": "ghost", "follow": True}) == ""
    for _ in range(40):
        ticks(loop, 1.0)
    x, y, _, gap, off = bridge.frame()["ghost"]
    assert gap < 0.01 * SHIP.L_pp + 0.1 * SHIP.speed  # one tick late
    assert abs(off) < 0.01
    assert math.hypot(x, y) > SHIP.L_pp
    ticks(loop, 25.0)
    assert bridge.frame()["ghost"] is None


def test_a_ghost_is_laid_where_the_ship_is() -> None:
    t = np.linspace(0.0, 10.0, 11)
    psi = np.full(11, 3.0) + np.linspace(0.0, 1.0, 11)
    trial = Trial("log", t, {"x": 5.0 + t, "y": 0.0 * t, "psi": np.mod(psi, np.pi * 2) - np.pi * 2 * (psi > np.pi)})
    ghost = Ghost(trial, ("delta",))
    ghost.lay((100.0, 50.0, 60.0, 3.0 + math.pi / 2))
    assert ghost.pose(99.0) is None
    x, y, heading = ghost.pose(110.0) or (0.0, 0.0, 0.0)
    assert (x, y) == pytest.approx((50.0, 70.0))
    assert heading == pytest.approx(4.0 + math.pi / 2)
    assert ghost.orders(105.0) == {}
    with pytest.raises(DataError, match="log: a ghost needs two rows"):
        Ghost(trial.rows(slice(0, 1)), ())


def test_a_page_loaded_later_learns_the_way_so_far(compiled: Compiled) -> None:
    bridge, loop = deck(compiled)
    ticks(loop, 30.0)
    hello = json.loads(json.dumps(bridge.hello("A")))
    assert hello["ship"] == {"name": "kvlcc2_l7", "L": 7.0, "B": 1.27}
    assert [one["name"] for one in hello["orders"]] == ["n_P", "delta"]
    assert hello["trail"][-1][1] == pytest.approx(bridge.frame()["own"][0], abs=0.5)
    assert bridge.ask("A", {"do": "reset"}) == ""
    assert bridge.hello("A")["trail"] == []
    assert bridge.frame()["t"] == 0.0


@pytest.mark.slow
def test_a_ship_that_blew_up_stays_where_it_was_seen_last(compiled: Compiled) -> None:
    trial = simulate(SHIP, Turning(N_P, math.radians(20.0)), speed=SHIP.speed, duration=60.0, dt=0.05)
    time = Time()
    loop = Loop({OWN: compiled.plant(n_P=N_P), "other": compiled.plant(n_P=N_P)}, 20.0, math.inf)
    loop.after(lambda _: time.go_on(0.05))
    bridge = Deck(loop, Outfit(DRILLS, ghost=Ghost(trial, SHIP.model.controls), hold=1e6), time)
    bridge.command.come("A", 0.0)
    assert bridge.ask("A", {"do": "ghost"}) == ""
    assert bridge.ask("A", {"do": "drill", "name": "zigzag"}) == ""
    ticks(loop, 20.0)
    before, way = bridge.frame(), bridge.hello("A")["trail"]
    for vessel in loop.vessels.values():
        saved = vessel.plant.snapshot()
        broken = np.frombuffer(saved.partition(b"\n")[2], dtype="<f8").copy()
        broken[3:6] = 1e200
        vessel.plant.restore(saved.partition(b"\n")[0] + b"\n" + broken.tobytes())
    ticks(loop, 5.0)
    frame = json.loads(json.dumps(bridge.frame(), allow_nan=False))
    assert "failed" in {event[1] for event in frame["events"]}
    assert "dropped" not in {event[1] for event in frame["events"]}
    assert frame["t"] > before["t"] + 4.0
    assert np.hypot(*frame["own"][:2]) > 2.0 * SHIP.L_pp
    assert frame["own"] == before["own"]
    assert frame["others"] == before["others"]
    assert frame["ghost"][3] == pytest.approx(math.dist(frame["ghost"][:2], frame["own"][:2]), abs=1e-3)
    assert json.loads(json.dumps(bridge.hello("A"), allow_nan=False))["trail"] == way
    for said in ({"do": "drill", "name": "turn"}, {"do": "ghost"}):
        assert "reset first" in bridge.ask("A", said)
    assert bridge.ask("A", {"do": "reset"}) == ""
    ticks(loop, 1.0)
    assert bridge.frame()["failed"] is None
    assert bridge.frame()["own"][:2] == pytest.approx([loop.vessels[OWN].plant["x"], 0.0], abs=0.1)


def test_a_figure_that_is_no_number_is_none() -> None:
    assert indices_json({"advance": Index(math.nan, "m", math.inf), "time": Index(2.0, "s", None)}) == [
        ["advance", None, "m", None], ["time", 2.0, "s", None]]  # fmt: skip


def test_the_telegraph_on_the_page_is_the_one_on_the_wire(compiled: Compiled) -> None:
    told = deck(compiled)[0].hello("A")["bells"]
    assert [share for share, _ in told] == sorted(TELEGRAPH.values(), reverse=True)
    assert dict(told)[TELEGRAPH["04"]] == "Full ahead"
    assert dict(told)[TELEGRAPH["13"]] == "Half astern"
    assert (told[0][1], told[-1][1]) == ("Navigation full", "Crash astern")


@pytest.mark.slow
def test_a_manoeuvre_under_way_is_saved_and_goes_on_when_restored(compiled: Compiled) -> None:
    bridge, loop = deck(compiled)
    plant = loop.vessels[OWN].plant
    ticks(loop, 5.0)
    assert bridge.ask("A", {"do": "drill", "name": "zigzag"}) == ""
    ticks(loop, 12.0)
    saved = loop.snapshot()

    def onward() -> list[float]:
        found: list[float] = []
        for _ in range(40):
            ticks(loop, 1.0)
            found += [plant["psi"], plant["delta_cmd"]]
        return found

    there = onward()
    figures = bridge.frame()["drill"]
    loop.reset()
    assert bridge.frame()["drill"] is None
    loop.restore(saved)
    assert onward() == there
    assert bridge.frame()["drill"] == figures


def test_a_reset_from_elsewhere_takes_the_hand_of_the_bridge_off(compiled: Compiled) -> None:
    trial = Trial("g", np.arange(100.0), {
        "x": np.arange(100.0), "y": np.zeros(100), "psi": np.zeros(100), "delta": np.full(100, 0.2),
    })  # fmt: skip
    bridge, loop = deck(compiled, Outfit(DRILLS, ghost=Ghost(trial, ("delta",)), hold=1e6))
    plant = loop.vessels[OWN].plant
    assert bridge.ask("A", {"do": "ghost", "follow": True}) == ""
    ticks(loop, 2.0)
    assert plant["delta_cmd"] == 0.2
    saved = loop.snapshot()
    loop.reset()
    frame = bridge.frame()  # before any tick
    assert frame["t"] == 0.0
    assert frame["own"][0] == 0.0
    assert not frame["following"]
    assert bridge.hello("A")["trail"] == []
    ticks(loop, 2.0)
    assert plant["delta_cmd"] == 0.0
    loop.restore(saved)
    ticks(loop, 1.0)
    assert plant["delta_cmd"] == 0.2
    assert bridge.frame()["following"]


def test_what_the_ship_cannot_do_is_off_with_the_reason(compiled: Compiled) -> None:
    bridge, loop = deck(compiled, Outfit(DRILLS, hold=1e6, cannot={"turn": "the wheel is lashed"}))
    assert bridge.hello("A")["cannot"] == {"turn": "the wheel is lashed"}
    assert bridge.ask("A", {"do": "drill", "name": "turn"}) == "the wheel is lashed"
    assert bridge.frame()["drill"] is None
    assert bridge.ask("A", {"do": "drill", "name": "zigzag"}) == ""
    loop.step()
    assert bridge.frame()["drill"][0] == "zigzag"


def test_ships_without_engine_or_rudder_have_no_such_manoeuvres() -> None:
    without = cannot(load("zeefakkel"))
    assert list(without) == ["Stopping", "Crash stop"]
    assert without["Stopping"] == "no revolutions move zeefakkel; its model has no engine"
    by_moment = cannot(load("cybership2"))
    assert "Zigzag 10/10" in by_moment
    assert "Stopping" not in by_moment
    assert cannot(SHIP) == cannot(load("milliampere")) == {}
