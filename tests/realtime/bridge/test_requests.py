"""What the bridge answers to requests beyond the wheel: recordings, the state that is kept, weather, pace."""

from __future__ import annotations

import errno
import json
import math
import os
import re
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.data.trialfile import read_trial
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.realtime.bridge import server
from seatrial.realtime.bridge.deck import Deck, Outfit
from seatrial.realtime.bridge.ghost import Ghost
from seatrial.realtime.bridge.view import OWN
from seatrial.realtime.loop import Loop
from seatrial.realtime.plant import Plant
from seatrial.ships.files import load
from seatrial.simulate.approach import time_step
from seatrial.workflow import RequestError
from seatrial.workflow.afloat import sail
from seatrial.workflow.asked import Departure, Page, RealTime

HARD = math.radians(10.0)


def aboard(
    name: str = "kvlcc2_l7", outfit: Outfit | None = None, *others: str, called: str | None = None
) -> tuple[Deck, Loop]:
    own = load(name)
    ships = {OWN: own if called is None else replace(own, name=called)} | {other: load(other) for other in others}
    steps = {key: 0.05 / math.ceil(0.05 / time_step(ship)) for key, ship in ships.items()}
    loop = Loop({key: Plant.of(ship, dt=steps[key]) for key, ship in ships.items()}, 20.0, math.inf)
    made = Deck(loop, outfit or Outfit(hold=1e6), lambda: loop.t)
    made.command.come("A", 0.0)
    return made, loop


def ticks(loop: Loop, seconds: float) -> None:
    for _ in range(round(seconds * loop.rate)):
        loop.step()


def ask(deck: Deck, do: str, **more: Any) -> str:
    return deck.ask("A", json.loads(json.dumps({"do": do, **more})))


def wind(deck: Deck, U_T: float, U_C: float = 0.0) -> str:
    return ask(deck, "around", U_T=U_T, gamma_T=1.5, U_C=U_C, gamma_C=0.0)


@pytest.mark.slow
def test_engine_orders_beyond_the_scale_are_clipped_and_marked() -> None:
    deck, loop = aboard()
    assert ask(deck, "order", name="n_P", value=99999.0) == ""
    ticks(loop, 1.0)
    frame, high = deck.frame(), loop.vessels[OWN].plant.ranges["n_P"].high
    assert frame["clipped"] == ["n_P"]
    assert frame["ord"]["n_P"] == pytest.approx(high)
    assert ask(deck, "order", name="n_P", value=-1e308) == ""
    ticks(loop, 60.0)
    assert deck.frame()["failed"] is None


@pytest.mark.parametrize("value", [10**400, -(10**400)])
def test_a_number_of_hundreds_of_digits_is_refused_in_a_line(value: int) -> None:
    deck, _ = aboard()
    assert re.fullmatch("value .*finite number", ask(deck, "order", name="n_P", value=value))


def test_wind_without_a_wind_force_is_refused() -> None:
    deck, loop = aboard()
    assert wind(deck, 30.0).startswith("kvlcc2_l7 has no force of wind")
    assert deck.hello("A")["feels"] == {"wind": False, "current": True}
    assert wind(deck, 0.0, 1.0) == ""
    ticks(loop, 0.1)
    assert deck.frame()["around"] == [0.0, 0.0, 1.0, 0.0]


def test_a_second_ship_without_a_wind_force_is_reported() -> None:
    deck, loop = aboard("esso_osaka_3m", None, "kvlcc2_l7")
    assert deck.hello("A")["feels"] == {"wind": True, "current": True}
    assert wind(deck, 5.0) == ""
    assert [(e.ship, e.kind, e.text) for e in loop.events] == [
        ("kvlcc2_l7", "calm", "kvlcc2_l7 has no force of wind and is not affected")]  # fmt: skip


def test_recordings_that_begin_in_one_second_have_names_of_their_own(tmp_path: Path) -> None:
    deck, loop = aboard(outfit=Outfit(folder=tmp_path, hold=1e6))
    for _ in range(3):
        assert ask(deck, "record") == ""
        assert ask(deck, "record") == "a recording is already in progress"
        ticks(loop, 0.2)
        assert ask(deck, "unrecord") == ""
    assert len(list(tmp_path.glob("*.csv"))) == 3


def test_a_recording_that_ended_by_itself_is_told_as_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    deck, loop = aboard(outfit=Outfit(folder=tmp_path, hold=1e6))
    assert ask(deck, "record") == ""
    ticks(loop, 1.0)
    path, rows, failure = deck.frame()["record"]
    assert (rows, failure) == (20, "")
    monkeypatch.setattr(os, "write", lambda *_: (_ for _ in ()).throw(OSError(errno.ENOSPC, "No space left on device")))
    ticks(loop, 0.1)
    for _ in range(2):
        assert deck.frame()["record"] == (path, rows, f"{path}: cannot be written: No space left on device; "
                                          "the lines before are complete")  # fmt: skip
        ticks(loop, 1.0)
    monkeypatch.undo()
    assert ask(deck, "record") == ""  # another one may begin at once
    ticks(loop, 0.5)
    assert deck.frame()["record"][2] == ""
    assert ask(deck, "unrecord") == ""
    assert [len(read_trial(one)) for one in sorted(tmp_path.glob("*.csv"), key=len_of)] == [11, 20]


def len_of(path: Path) -> int:
    return path.stat().st_size


def test_a_recording_has_the_start_instant_and_the_datum_of_the_bridge_or_of_its_ghost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def serve(deck: Deck, loop: Loop, *_: Any) -> None:
        deck.command.come("A", 0.0)
        assert ask(deck, "record") == ""
        ticks(loop, 1.0)

    def bridge(ghost: Path | None = None, place: str | None = None) -> tuple[Path, ...]:
        page = Page(page=True, port=0, ghost=ghost)
        return sail("kvlcc2_l7", departure=Departure(place=place), page=page, run=RealTime(out=tmp_path)).written

    monkeypatch.setattr(server, "serve", serve)
    began = datetime.now(UTC)
    (path,) = bridge(place="35,139.5")
    meta = read_trial(path).meta
    assert -1.0 < (datetime.fromisoformat(meta["start"]) - began).total_seconds() < 60.0
    assert meta["datum"] == {"latitude": 35.0, "longitude": 139.5}
    (beside,) = bridge(path)
    assert read_trial(beside).meta["datum"] == meta["datum"]
    (without,) = bridge()
    assert "datum" not in read_trial(without).meta
    with pytest.raises(RequestError, match="--place and --ghost"):
        bridge(path, "35,139.5")


@pytest.mark.parametrize("name", ["../../sec/X", "/abs/X", "..", "a\\b\n\x1b[31m", ".hidden", "\x00"])
def test_a_recording_stays_in_its_folder_whatever_the_ship_is_called(tmp_path: Path, name: str) -> None:
    (tmp_path / "sec").mkdir()
    folder = tmp_path / "in" / "it"
    folder.mkdir(parents=True)
    deck, loop = aboard(outfit=Outfit(folder=folder, hold=1e6), called=name)
    assert ask(deck, "record") == ""
    ticks(loop, 0.5)
    assert ask(deck, "unrecord") == ""
    (path,) = tmp_path.rglob("*.csv")
    assert path.parent == folder
    assert re.fullmatch(r"\w[\w.+-]*\.csv", path.name)


@pytest.mark.slow
def test_a_state_is_kept_and_the_run_continues_from_it_the_same() -> None:
    deck, loop = aboard(outfit=Outfit({"zigzag": lambda n: Zigzag(n, HARD, HARD)}, hold=1e6))
    assert "no state" in ask(deck, "back")
    assert ask(deck, "drill", name="zigzag") == ""
    ticks(loop, 8.0)
    assert deck.frame()["kept"] is None
    assert ask(deck, "save") == ""
    way = deck.hello("A")["trail"]
    ticks(loop, 12.0)
    first = deck.frame()["own"]
    ask(deck, "order", name="delta", value=-0.3)
    ticks(loop, 5.0)
    leaps = deck.leaps
    assert ask(deck, "back") == ""
    frame = deck.frame()
    assert (frame["t"], frame["kept"], deck.leaps) == (pytest.approx(8.0), pytest.approx(8.0), leaps + 1)
    assert deck.hello("A")["trail"] == way
    assert frame["drill"][:2] == ["zigzag", False]  # who steered steers again
    ticks(loop, 12.0)
    assert deck.frame()["own"] == first


def test_the_pace_may_be_the_fastest() -> None:
    deck, loop = aboard()
    loop.pace(3.0)
    assert deck.frame()["factor"] == 3.0
    assert ask(deck, "pace", factor="fastest") == ""
    assert math.isinf(loop.factor)
    assert deck.frame()["factor"] is None
    assert "time factor 1000" in ask(deck, "pace", factor=1000)


def test_a_ghost_says_whose_trial_it_is() -> None:
    t = np.linspace(0.0, 10.0, 11)
    trial = Trial("log", t, {"x": t, "y": 0.0 * t, "psi": 0.0 * t}, meta={"ship": "kcs"})
    deck, _ = aboard(outfit=Outfit(ghost=Ghost(trial, ("delta",)), hold=1e6))
    assert deck.hello("A")["ghost"] == {"name": "log", "duration": 10.0, "ship": "kcs"}
