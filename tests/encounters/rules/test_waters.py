"""Rules that ask of a ship alone, and those of kinds and of restricted visibility: by hand-made geometry, both ways."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from kinematic import Sailed, meeting, tracks
from seatrial.core.errors import ChartError, RequestError
from seatrial.encounters import Tracks
from seatrial.encounters.conduct import CONDUCTS, Scene, Watch
from seatrial.encounters.rules import OPEN_WATER, Limits, Role, Waters, alone, judge
from seatrial.encounters.rules.roles import KINDS, STATUS
from seatrial.encounters.rules.waters import AGROUND, CONTOUR
from seatrial.environment.chart import Area, Chart, Lane, Spot

T, U = 1500.0, 8.0
SEA = Chart("sea", 50.0)
BOX = np.array([[-1e4, -500.0], [1e4, -500.0], [1e4, 500.0], [-1e4, 500.0]])


def one(psi: float = 0.0, x: float = 0.0, y: float = 0.0, orders: Sequence[tuple[float, float, float]] = ()) -> Tracks:
    """A ship of 200 m at 8 m/s for ten minutes."""
    return tracks([Sailed(x, y, psi, U, orders)], T=600.0)


def said(made: Tracks, waters: Waters) -> dict[str, float]:
    return {rule: float(margin) for rule, margin in alone(made, judge(made), waters).margins.items()}


# Rule 6: 15 lengths of 200 m from 8 m/s are 3000 m, half the visibility of 6000 m; as the square of the speed
@pytest.mark.parametrize(("visibility", "U_stop", "margin"), [
    (6000.0, 8.0, 0.0), (3000.0, 8.0, -0.5), (12000.0, 8.0, 1.0), (1500.0, 16.0, 0.0), (6000.0, 4.0, -0.75),
])  # fmt: skip
def test_a_safe_speed_stops_within_half_the_visibility(visibility: float, U_stop: float, margin: float) -> None:
    assert said(one(), Waters(visibility=visibility, U=U_stop))["6"] == pytest.approx(margin, abs=1e-9)


def test_a_ship_that_slows_later_was_too_fast_before() -> None:
    slow = one(orders=((100.0, 0.0, 0.3),))
    assert said(slow, Waters(visibility=3000.0, U=8.0))["6"] == pytest.approx(-0.5)


def test_in_sight_and_on_open_water_nothing_is_asked_of_a_ship_alone() -> None:
    assert said(one(), OPEN_WATER) == {}
    assert said(one(), Waters(SEA, 10.0)).keys() == {AGROUND}


# Rule 9(a): a fairway that goes north through y = 0; its channel is 200 m to either side, the ship 33.3 m in breadth
@pytest.mark.parametrize(("psi", "y", "kept"), [
    (0.0, 60.0, True), (0.0, -60.0, False), (180.0, -60.0, True), (180.0, 60.0, False),
    (0.0, -10.0, True), (180.0, 10.0, True),  # on the axis
    (0.0, -250.0, None), (90.0, -60.0, None), (0.0, 199.0, True), (0.0, -199.0, False), (0.0, -201.0, None),
    (20.0, -190.0, False), (-20.0, 190.0, True), (40.0, -150.0, None),
])  # fmt: skip
def test_in_a_channel_a_ship_is_on_its_starboard_side(psi: float, y: float, kept: bool | None) -> None:
    axis = np.array([[-2e4, 0.0], [2e4, 0.0]])
    made = one(psi, x=-4000.0 if psi == 0.0 else 4000.0 if psi == 180.0 else 0.0, y=y)
    if abs(psi) == 20.0:
        made = tracks([Sailed(0.0, y, psi, U)], T=20.0)
    margin = said(made, Waters(replace(SEA, fairways=(axis,)), 10.0)).get("9(a)")
    assert (None if margin is None else margin >= 0.0) == kept
    turned = said(made, Waters(replace(SEA, fairways=(axis[::-1],)), 10.0)).get("9(a)")  # drawn the other way
    assert (turned is None) == (margin is None)
    assert margin is None or turned == pytest.approx(margin)


def test_the_margin_of_a_channel_is_the_way_beyond_its_axis() -> None:
    axis = np.array([[-2e4, 0.0], [2e4, 0.0]])
    margin = said(one(0.0, y=-60.0), Waters(replace(SEA, fairways=(axis,)), 10.0))["9(a)"]
    assert margin == pytest.approx((-60.0 + 200.0 / 12.0) / 200.0)


# Rule 10(b), (c): a lane 1000 m wide whose traffic goes north
@pytest.mark.parametrize(("psi", "margin"), [
    (0.0, 1.0), (15.0, 0.5), (-15.0, 0.5), (30.0, 0.0), (45.0, 45.0 / 70.0 - 1.0), (70.0, 0.0),
    (90.0, 90.0 / 70.0 - 1.0), (-90.0, 90.0 / 70.0 - 1.0), (110.0, 0.0), (135.0, 45.0 / 70.0 - 1.0), (180.0, -1.0),
])  # fmt: skip
def test_a_lane_is_followed_or_crossed(psi: float, margin: float) -> None:
    lane = Lane(BOX, 0.0, "TSSLPT")
    assert said(one(psi), Waters(replace(SEA, lanes=(lane,)), 10.0))["10"] == pytest.approx(margin, abs=1e-9)
    south = Lane(BOX, math.pi, "TSSLPT")
    assert said(one(psi + 180.0), Waters(replace(SEA, lanes=(south,)), 10.0))["10"] == pytest.approx(margin, abs=1e-9)


def test_beside_a_lane_and_where_it_has_no_direction_nothing_is_asked() -> None:
    lane = Lane(BOX, 0.0, "TSSLPT")
    assert "10" not in said(one(180.0, y=900.0), Waters(replace(SEA, lanes=(lane,)), 10.0))
    assert "10" not in said(one(180.0), Waters(replace(SEA, lanes=(replace(lane, alpha=math.nan),)), 10.0))


def test_who_acts_for_another_ship_is_excused_in_a_lane_but_not_on_the_ground() -> None:
    """Crossing from starboard while it goes with the lane: 45 deg to starboard from 600 s, back when that is clear."""
    orders = ((600.0, 45.0, 1.0), (1400.0, -45.0, 1.0))
    other = Sailed(*meeting(-90.0, T, U, 1.0, 0.0), -90.0, U)
    made = tracks([Sailed(0, 0, 0, U, orders), other], T=2300.0)
    wide = np.array([[-1e5, -1e5], [1e5, -1e5], [1e5, 1e5], [-1e5, 1e5]])
    chart = replace(SEA, lanes=(Lane(wide, 0.0, "TSSLPT"),))
    assert said(made, Waters(chart, 10.0))["10"] >= 0.0
    assert said(tracks([Sailed(0, 0, 0, U, orders)], T=2300.0), Waters(chart, 10.0))["10"] < 0.0
    late = tracks([Sailed(0, 0, 0, U, (orders[0], (1700.0, -45.0, 1.0))), other], T=2300.0)
    assert said(late, Waters(chart, 10.0))["10"] < 0.0  # it is clear after 1355 s, and 196 s are those of the turn back
    shoal = Area(np.array([[6000.0, 1000.0], [3e4, 1000.0], [3e4, 9000.0], [6000.0, 9000.0]]), 8.0)
    assert said(made, Waters(replace(chart, areas=(shoal,)), 10.0))[AGROUND] == pytest.approx(-0.2)


@pytest.mark.parametrize(("draught", "safety", "ground", "contour"), [
    (6.0, 7.0, 2.0 / 6.0, 1.0 / 7.0), (6.0, 10.0, 2.0 / 6.0, -0.2), (10.0, 12.0, -0.2, -4.0 / 12.0),
])  # fmt: skip
def test_the_ground_and_the_safety_contour_are_apart(
    draught: float, safety: float, ground: float, contour: float
) -> None:
    chart = replace(SEA, areas=(Area(BOX, 8.0),))
    found = said(one(), Waters(chart, draught, safety))
    assert (found[AGROUND], found[CONTOUR]) == pytest.approx((ground, contour))
    assert CONTOUR not in said(one(), Waters(chart, draught))
    assert alone(one(), (), Waters(chart, draught, safety)).broken() == tuple(
        name for name, margin in ((AGROUND, ground), (CONTOUR, contour)) if margin < 0.0)  # fmt: skip


def test_just_aground_is_aground_and_a_danger_counts() -> None:
    assert said(one(), Waters(replace(SEA, areas=(Area(BOX, 8.0),)), 8.0))[AGROUND] < 0.0
    wreck = replace(SEA, dangers=(Spot(1000.0, 0.0, "WRECKS", 3.0),))
    assert said(one(), Waters(wreck, 6.0))[AGROUND] == pytest.approx(-0.5)


def test_waters_that_cannot_be_are_refused() -> None:
    with pytest.raises(ChartError, match="no depths"):
        Waters(Chart("bare", fairways=(BOX,)), 6.0)
    for draught, safety in ((0.0, None), (6.0, 5.0)):
        with pytest.raises(RequestError, match="the draught is above zero, and the depth no less"):
            Waters(SEA, draught, safety)


# Rule 18
def met(heading: float, own: Sequence[tuple[float, float, float]] = (), k: float = 1.0) -> Tracks:
    other = Sailed(*meeting(heading, T, U, k, 0.0), heading, k * U)
    return tracks([Sailed(0, 0, 0, U, own), other], T=3600.0)


@pytest.mark.parametrize(("heading", "k", "own", "other"), [
    (90.0, 1.0, Role.YIELDS, Role.STAND_ON), (-90.0, 1.0, Role.YIELDS, Role.STAND_ON),
    (180.0, 1.0, Role.YIELDS, Role.STAND_ON),
    (0.0, 0.4, Role.OVERTAKING, Role.OVERTAKEN), (0.0, 2.0, Role.OVERTAKEN, Role.OVERTAKING),  # Rule 13(a)
])  # fmt: skip
def test_who_keeps_out_of_the_way_by_its_kind(heading: float, k: float, own: Role, other: Role) -> None:
    one, two = judge(met(heading, k=k), ranks=(KINDS["power-driven"], KINDS["fishing"]))
    assert (Role(int(one.role)), Role(int(two.role))) == (own, other)
    two, one = judge(met(heading, k=k), ranks=(KINDS["fishing"], KINDS["fishing"]))
    assert Role.YIELDS not in (Role(int(one.role)), Role(int(two.role)))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_rule_18_asks_for_action_to_either_side_and_for_distance(side: float) -> None:
    acts = ((600.0, side * 50.0, 1.0), (1900.0, -side * 50.0, 1.0))
    for heading in (90.0, 180.0):
        made = met(heading, acts if heading == 180.0 else ((600.0, 50.0, 1.0), (1900.0, -50.0, 1.0)))
        assert judge(made, ranks=(0, 2))[0].broken() == ()
    assert set(judge(met(90.0), ranks=(0, 2))[0].broken()) == {"8(a)", "8(b)", "8(d)", "16", "18"}
    assert "18" not in judge(met(90.0))[0].broken()
    slows = judge(met(-90.0, ((600.0, 0.0, 0.3),)), ranks=(0, 1))[0]
    assert float(slows.margins["18"]) == pytest.approx(0.7 / 0.2 - 1.0, abs=0.01)


def test_a_ship_that_goes_before_others_stands_on_and_17c_is_not_of_it() -> None:
    port = ((600.0, -20.0, 1.0), (1900.0, 20.0, 1.0))
    before = judge(met(90.0, port), ranks=(3, 0))[0]
    assert Role(int(before.role)) is Role.STAND_ON
    assert before.broken() == ("17(a)(i)",)
    assert "17(c)" in judge(met(90.0, port))[0].broken()


def test_ranks_are_in_the_order_of_the_rule_and_by_the_status_of_ais() -> None:
    assert KINDS["not under command"] == KINDS["restricted"] > KINDS["fishing"] > KINDS["sailing"] > 0
    assert {one: STATUS[one] for one in (2, 3, 7, 8)} == {
        2: "not under command", 3: "restricted", 7: "fishing", 8: "sailing"}  # fmt: skip


def test_a_conduct_by_the_rules_knows_kinds() -> None:
    """A ship on the port bow stands on before a power-driven ship, unless it fishes; two kinds of others are apart."""
    far = U * 900.0
    scene = Scene(0.0, np.array([[0.0, far]]), np.array([[0.0, -far]]), np.array([[0.0, 0.5 * math.pi]]),
                  np.array([[U, 0.0]]), np.array([[0.0, U]]), np.full(2, 200.0))  # fmt: skip

    def role(ranks: tuple[int, ...]) -> Role:
        watch = Watch((CONDUCTS["rules"],), np.zeros(1, dtype=np.intp), 0, scene, np.array([U]), Limits())
        watch.look(replace(scene, ranks=ranks))
        return Role(int(watch.role[0, 1]))

    assert role(()) is role((2, 2)) is Role.STAND_ON
    assert role((0, 2)) is Role.YIELDS
    assert role((0,)) is Role.STAND_ON
    east = replace(scene, y=-scene.y, psi=-scene.psi, east=-scene.east)
    watch = Watch((CONDUCTS["rules"],), np.zeros(1, dtype=np.intp), 0, east, np.array([U]), Limits())
    watch.look(replace(east, ranks=(2, 0)))
    assert Role(int(watch.role[0, 1])) is Role.STAND_ON  # the other gives way, though it is to starboard


# Rule 19(e)
@pytest.mark.parametrize(("heading", "own", "kept"), [
    (180.0, (), False), (180.0, ((1000.0, 0.0, 0.4),), True), (180.0, ((1000.0, 0.0, 0.7),), False),
    (180.0, ((300.0, 40.0, 1.0), (1900.0, -40.0, 1.0)), None),  # avoided, so nothing is asked
    (-90.0, (), False), (0.0, (), None),
])  # fmt: skip
def test_unseen_ships_slow_before_they_come_close(
    heading: float, own: Sequence[tuple[float, float, float]], kept: bool | None
) -> None:
    k = 2.0 if heading == 0.0 else 1.0  # from astern: not forward of the beam
    margin = float(judge(met(heading, own, k), restricted=True)[0].margins["19(e)"])
    assert (None if math.isnan(margin) else margin >= 0.0) == kept
    assert math.isnan(float(judge(met(heading, own, k))[0].margins["19(e)"]))
