"""A meeting as a scenario of the range: places and times stay, others behave, and what cannot be met is told."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from scenes import scene
from seatrial.core.errors import RequestError
from seatrial.encounters.meeting import Meeting, dnv, imazu, named
from seatrial.realtime.range.encounter import LONG, encountered
from seatrial.realtime.range.pilots import Behaving
from seatrial.realtime.range.scenario import Other, Sailing, ordinary
from seatrial.realtime.range.stage import Stage

OWN = ordinary("own", 100.0, 8.0)


@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0), (500.0, -200.0, 2.0)])
def test_all_ships_of_a_problem_would_be_at_one_place_at_its_time(start: tuple[float, float, float]) -> None:
    north, east, psi = start
    for met in imazu(8.0, 600.0):
        played = encountered(OWN, met, ["ignores"] * len(met.x), start=start)
        assert played.duration == pytest.approx(LONG * 600.0)
        own = played.own.sailing
        assert (own.x, own.y, own.psi, own.speed) == (*start, 8.0)
        for one in played.others:
            way = 600.0 * one.sailing.speed
            x, y = one.sailing.x + way * math.cos(one.sailing.psi), one.sailing.y + way * math.sin(one.sailing.psi)
            assert x == pytest.approx(north + 4800.0 * math.cos(psi))
            assert y == pytest.approx(east + 4800.0 * math.sin(psi), abs=1e-6)
            assert one.ship.L_pp == 100.0
            assert one.conduct == "ignores"
        assert played.criteria.rules


def test_ships_beyond_reach_and_ships_without_way_are_no_traffic() -> None:
    def met(x: float, U: float) -> Meeting:
        return Meeting(8.0, np.array([3000.0, x]), np.array([0.0, 0.0]), np.array([math.pi, math.pi]),
                       np.array([8.0, U]))  # fmt: skip

    assert [one.name for one in encountered(OWN, met(-1e6, 8.0), ["rules"] * 2).others] == ["target 1"]
    with pytest.raises(RequestError, match=r"target 2 of .* has a speed of 0 m/s"):
        encountered(OWN, met(2000.0, 0.0), ["rules"] * 2)
    away = Meeting(8.0, np.array([-3000.0]), np.array([0.0]), np.array([math.pi]), np.array([8.0]))
    with pytest.raises(RequestError, match="nobody is met"):
        encountered(OWN, away, ["rules"])


def test_encounters_have_names() -> None:
    assert (named("imazu:7", 8.0).psi == imazu(8.0, 1500.0)[6].psi).all()
    assert (named("dnv:20", 8.0).x == dnv(8.0)[19].x).all()
    one, same, next_ = (named("drawn:give-way+stand-on", 8.0, seed) for seed in (1, 1, 2))
    assert [int(r) for r in one.roles] == [int(r) for r in next_.roles]
    assert (one.x == same.x).all()
    assert (one.x != next_.x).all()


@pytest.mark.parametrize(("text", "said"), [
    ("imazu:0", "imazu has the numbers 1 to 22"), ("imazu:23", "1 to 22"), ("imazu", "1 to 22"), ("dnv:x", "1 to "),
    ("imazoo:1", "near: imazu"), ("drawn:giveway", "near: give-way"), ("drawn:none", "no role 'none'"),
    ("drawn:", "no role ''"),
])  # fmt: skip
def test_names_of_no_encounter_are_a_line(text: str, said: str) -> None:
    with pytest.raises(RequestError, match=said):
        named(text, 8.0)


def crossing(conduct: str | None) -> Stage:
    """A ship from port has to give way to the own one, which goes on; both would be at (3200, 0) after 400 s."""
    other = Other("other", ordinary("other", 100.0, 8.0), Sailing(3200.0, -3200.0, 0.5 * math.pi, 8.0), conduct=conduct)
    own: Any = {"route": (), "rate": 2.0, "duration": 700.0}
    return Stage(scene(other, **own))


@pytest.mark.slow
def test_a_ship_by_the_rules_gives_way_and_one_that_ignores_them_does_not() -> None:
    passed = {}
    for conduct in ("rules", "ignores", None):
        stage = crossing(conduct)
        stage.loop.run(700.0)
        passed[conduct] = stage.wakes.passed(926.0, 720.0)["other"]
        if conduct == "rules":
            tracks = stage.wakes.tracks
            assert tracks is not None
            assert np.degrees(tracks.psi[1].max()) > 115.0  # from 90 deg, to starboard
            assert np.degrees(tracks.psi[1].min()) > 85.0
    assert passed["rules"].touched is None
    assert passed["rules"].distance > 400.0
    assert passed["ignores"].touched is not None
    assert passed[None].touched is not None


def test_each_ship_behaves_by_its_own_speed_and_place() -> None:
    slow = Other("slow", ordinary("slow", 60.0, 3.0), Sailing(4000.0, 500.0, 0.0, 3.0), conduct="rules")
    fast = Other("fast", ordinary("fast", 60.0, 9.0), Sailing(-4000.0, 500.0, 1.0, 9.0), conduct="late")
    loop = Stage(scene(slow, fast, route=(), rate=2.0)).loop
    pilots = Behaving(loop, "own", {"slow": "rules", "fast": "late"})
    assert [float(one._speed[0]) for one in pilots._watches.values()] == pytest.approx([3.0, 9.0])
    assert [one._ship for one in pilots._watches.values()] == [1, 2]


@pytest.mark.slow
def test_ships_that_behave_go_on_alike_from_what_was_saved() -> None:
    first, again = crossing("rules"), crossing("rules")
    first.loop.run(150.0)
    saved = first.loop.snapshot()
    first.loop.run(150.0)
    again.loop.restore(saved)
    again.loop.run(150.0)
    assert again.digest == first.digest
    first.loop.reset()
    first.loop.run(300.0)
    assert first.digest == again.digest
