"""Tracks kept of a run and what the rules of the road make of them: straight lines, a ship lost, ships in contact."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from scenes import FERRY, Criteria, scene
from seatrial.realtime.range import wakes as module
from seatrial.realtime.range.judge import Judge
from seatrial.realtime.range.scenario import Other, Sailing, ordinary
from seatrial.realtime.range.stage import Stage
from seatrial.realtime.range.wakes import Wakes


class Straight:
    """Ships that go straight, as a loop of so many seconds a tick."""

    def __init__(self, tick: float = 0.5, **ships: tuple[float, float, float, float]) -> None:
        self.t, self._tick, self._ships = 0.0, tick, ships
        self.vessels: dict[str, Any] = {
            name: SimpleNamespace(failure=None, plant=_Plant()) for name in ships
        }  # fmt: skip
        self.kept: list[Any] = []
        self._place()

    def after(self, callback: Any) -> None:
        self.kept.append(callback)

    def keep(self, name: str, keeper: Any) -> None:
        self.keeper = keeper

    def run(self, ticks: int) -> None:
        for _ in range(ticks):
            self.t += self._tick
            self._place()
            for callback in self.kept:
                callback(self)

    def _place(self) -> None:
        for name, (x, y, psi, u) in self._ships.items():
            way = u * self.t
            self.vessels[name].plant.update(x=x + way * math.cos(psi), y=y + way * math.sin(psi), psi=psi, u=u, v_m=0.0)


class _Plant(dict):
    ship = ordinary("a", 100.0, 8.0)


def crossing(tick: float = 0.5, **more: tuple[float, float, float, float]) -> Straight:
    """Both would be at (3000, 0) after 375 s, but for 400 m of the other."""
    return Straight(tick, own=(0.0, 0.0, 0.0, 8.0), other=(2600.0, 3000.0, -0.5 * math.pi, 8.0), **more)


def test_a_crossing_ship_is_passed_where_two_lines_have_it() -> None:
    loop: Any = crossing()
    wakes = Wakes(loop, "own")
    loop.run(1500)
    one = wakes.passed(926.0, 300.0)["other"]
    # relative place (2600 - 8 t, 3000 - 8 t): nearest at t = 350 s with (-200, 200)
    assert (one.distance, one.t) == (pytest.approx(200.0 * math.sqrt(2.0)), pytest.approx(350.0))
    assert one.touched is None
    assert 0.0 < (one.in_hand or 0.0) <= 1.0  # it was never avoided
    assert set(one.margins) >= {"8(d)", "15", "16"}
    assert one.margins["16"] < 0.0  # nothing was done


def test_rows_are_a_second_apart_and_each_tick_where_hulls_are_near() -> None:
    loop: Any = crossing()
    wakes = Wakes(loop, "own")
    loop.run(1500)
    tracks = wakes.tracks
    assert tracks is not None
    gaps = np.diff(tracks.t)
    near = np.abs(tracks.x[1] - tracks.x[0]) + np.abs(tracks.y[1] - tracks.y[0]) < 300.0
    assert set(np.round(gaps[near[1:]], 9)) == {0.5} or not near.any()
    assert set(np.round(gaps, 9)) <= {0.5, 1.0}


def test_a_long_run_keeps_a_bounded_number_of_rows_and_passes_as_near(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_MOST", 60)
    loop: Any = crossing(2.0)
    wakes = Wakes(loop, "own")
    loop.run(1000)
    tracks = wakes.tracks
    assert tracks is not None
    assert 15 < len(tracks.t) <= 60
    assert tracks.t[-1] > 1900.0
    gaps = np.diff(tracks.t)
    far = np.hypot(tracks.x[1] - tracks.x[0], tracks.y[1] - tracks.y[0])[1:] > 700.0
    assert gaps[far].max() <= 2.0 * np.median(gaps[far])  # evenly, whatever its length
    assert wakes.passed(926.0, 300.0)["other"].distance == pytest.approx(200.0 * math.sqrt(2.0))  # straight between


def test_a_ship_that_blows_up_is_left_out_and_the_others_stay() -> None:
    loop: Any = crossing(third=(9000.0, 9000.0, 0.0, 5.0))
    wakes = Wakes(loop, "own")
    loop.run(100)
    loop.vessels["third"].failure = "it blew up"
    loop.vessels["third"].plant.update(x=math.nan)
    loop.run(1000)
    assert list(wakes.passed(926.0, 300.0)) == ["other"]


def test_what_was_saved_is_what_was_kept() -> None:
    loop: Any = crossing()
    wakes = Wakes(loop, "own")
    loop.run(300)
    saved = wakes.snapshot()
    first = wakes.tracks
    wakes.reset()
    assert wakes.tracks is None
    wakes.restore(saved)
    again = wakes.tracks
    assert first is not None
    assert again is not None
    assert (first.x == again.x).all()
    loop.run(1)  # half a second after the last row, and nobody is near: not due yet
    assert wakes.snapshot()["rows"][-1][0] == pytest.approx(150.0)


def test_ships_that_touch_at_the_start_are_told_and_not_judged() -> None:
    loop: Any = Straight(own=(0.0, 0.0, 0.0, 8.0), tug=(0.0, 10.0, 0.0, 8.0))
    wakes = Wakes(loop, "own")
    loop.run(5)
    assert wakes.begun == "own and tug"
    assert wakes.passed(926.0, 300.0) == {}
    clear: Any = Straight(own=(0.0, 0.0, 0.0, 8.0), tug=(0.0, 20.0, 0.0, 8.0))  # 100/7 m of breadth each
    assert Wakes(clear, "own").begun == ""


def test_who_is_alone_has_no_tracks() -> None:
    loop: Any = Straight(own=(0.0, 0.0, 0.0, 8.0))
    wakes = Wakes(loop, "own")
    assert loop.kept == []
    assert wakes.passed(926.0, 300.0) == {}


@pytest.mark.slow
def test_rules_are_criteria_where_they_are_asked_for() -> None:
    """A ship that keeps its course where it has to give way breaks Rule 16, whatever the passing distance."""
    late = Other("ferry", FERRY.ship, Sailing(3000.0, 3400.0, 1.5 * math.pi, 8.0))
    for rules in (True, False):
        stage = Stage(scene(late, rate=2.0, criteria=Criteria(rules=rules, passing_distance=100.0)))
        stage.loop.run(700.0)
        judge: Judge = stage.judge
        told = {one.name: one for one in judge.judged(stage.wakes.passed(926.0, 720.0))}
        assert told["passing_distance"].met
        assert ("rule 16" in told) is rules
        if rules:
            assert not told["rule 16"].met
            assert told["rule 16"].where == "ferry"
