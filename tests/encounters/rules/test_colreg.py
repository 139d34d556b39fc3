"""Roles and rules on ships of simple motion: symmetry, exchange of roles, and each breach by itself."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from kinematic import Sailed, meeting, tracks
from seatrial.core.errors import RequestError
from seatrial.encounters import Tracks
from seatrial.encounters.rules import Judged, Limit, Limits, Role, judge
from seatrial.encounters.rules.roles import classes

T, U = 1500.0, 8.0
Orders = tuple[tuple[float, float, float], ...]
STARBOARD: Orders = ((600.0, 40.0, 1.0), (1900.0, -40.0, 1.0))
PORT: Orders = ((600.0, -40.0, 1.0), (1900.0, 40.0, 1.0))


def met(heading: float, own: Orders = (), other: Orders = (), k: float = 1.0, off: float = 0.0) -> Tracks:
    """The own ship heads north; the other one has this heading [deg] and would be where it is after T seconds."""
    return tracks([Sailed(0, 0, 0, U, own), Sailed(*meeting(heading, T, U, k, off), heading, k * U, other)], T=3600.0)


def mirrored(made: Tracks) -> Tracks:
    """East and west exchanged."""
    return replace(made, y=-made.y, psi=-made.psi, v_m=-made.v_m)


def moved(made: Tracks, angle: float, north: float, east: float, later: float) -> Tracks:
    c, s = math.cos(angle), math.sin(angle)
    return replace(made, t=made.t + later, x=north + c * made.x - s * made.y, y=east + s * made.x + c * made.y,
                   psi=made.psi + angle + 2.0 * math.pi)  # fmt: skip


def numbers(judged: Judged) -> dict[str, float]:
    return {rule: float(margin) for rule, margin in judged.margins.items() if not np.isnan(margin)}


@pytest.mark.parametrize(("heading", "k", "own", "other"), [
    (180.0, 1.0, Role.HEAD_ON, Role.HEAD_ON),
    (176.0, 1.0, Role.HEAD_ON, Role.HEAD_ON),
    (-90.0, 1.0, Role.GIVE_WAY, Role.STAND_ON),
    (-45.0, 1.0, Role.GIVE_WAY, Role.STAND_ON),
    (90.0, 1.0, Role.STAND_ON, Role.GIVE_WAY),
    (135.0, 1.0, Role.STAND_ON, Role.GIVE_WAY),
    (0.0, 0.4, Role.OVERTAKING, Role.OVERTAKEN),
    (20.0, 0.4, Role.OVERTAKING, Role.OVERTAKEN),
    (0.0, 2.0, Role.OVERTAKEN, Role.OVERTAKING),
])  # fmt: skip
def test_roles_of_both_ships(heading: float, k: float, own: Role, other: Role) -> None:
    one, two = judge(met(heading, k=k))
    assert (Role(int(one.role)), Role(int(two.role))) == (own, other)


@pytest.mark.slow
def test_the_own_ship_judged_alone_has_the_verdicts_of_the_whole() -> None:
    """Also of Rule 17, which knows whom the own ship has to act for; other ships that touch are not its concern."""
    rows = [Sailed(0, 0, 0, U, STARBOARD)]
    rows += [Sailed(*meeting(heading, T, U, 1.0, 0.0), heading, U, ()) for heading in (180.0, -90.0, 90.0)]
    made = tracks(rows, T=3600.0)
    whole, own = judge(made), judge(made, own=True)
    assert [(one.ship, one.other) for one in own] == [(0, 1), (0, 2), (0, 3)]
    for one, same in zip(own, whole, strict=False):
        assert numbers(one) == numbers(same)
        assert (one.role, one.gap) == (same.role, same.gap)
    twice = tracks([*rows, rows[-1]], T=3600.0)
    with pytest.raises(RequestError, match="target 3 and target 4 touch"):
        judge(twice)
    assert numbers(judge(twice, own=True)[3]) == numbers(own[2])


@pytest.mark.parametrize("heading", [-130.0, -90.0, -30.0])
@pytest.mark.parametrize("own", [(), STARBOARD, PORT])
def test_the_mirror_exchanges_the_roles_of_rule_15(heading: float, own: Orders) -> None:
    here, there = judge(met(heading, own)), judge(mirrored(met(heading, own)))
    assert [int(one.role) for one in here] == [Role.GIVE_WAY, Role.STAND_ON]
    assert [int(one.role) for one in there] == [Role.STAND_ON, Role.GIVE_WAY]
    assert [float(one.at.distance) for one in here] == pytest.approx([float(one.at.distance) for one in there])


@pytest.mark.parametrize("heading", [180.0, -90.0, 90.0, 20.0])
def test_place_direction_and_clock_have_no_say(heading: float) -> None:
    made = met(heading, STARBOARD, PORT, k=0.9)
    for here, there in zip(judge(made), judge(moved(made, 2.1, -4e4, 7e3, 1e5)), strict=True):
        assert int(here.role) == int(there.role)
        assert numbers(there) == pytest.approx(numbers(here), abs=1e-6)


@pytest.mark.parametrize("scale", [1.0 / 50.0, 2.0])
def test_a_model_is_judged_as_its_ship(scale: float) -> None:
    """Froude's law: lengths by the scale, times and speeds by its root."""
    made = met(-90.0, ((700.0, 35.0, 1.0), (1900.0, -35.0, 1.0)))
    root = math.sqrt(scale)
    model = replace(made, t=made.t * root, x=made.x * scale, y=made.y * scale, u=made.u * root, L=made.L * scale,
                    B=made.B * scale)  # fmt: skip
    for here, there in zip(judge(made), judge(model), strict=True):
        assert numbers(there) == pytest.approx(numbers(here), abs=1e-6)


@pytest.mark.parametrize(("heading", "k", "own", "other", "broken", "others"), [
    # nobody acts: every duty of either ship is broken
    (180.0, 1.0, (), (), {"8(a)", "8(b)", "8(d)", "14"}, {"8(a)", "8(b)", "8(d)", "14"}),
    (-90.0, 1.0, (), (), {"8(a)", "8(b)", "8(d)", "16"}, {"17(b)"}),
    (0.0, 0.4, (), (), {"8(a)", "8(b)", "13", "16"}, {"17(b)"}),
    # as the rules ask
    (180.0, 1.0, STARBOARD, STARBOARD, set(), set()),
    (-90.0, 1.0, STARBOARD, (), set(), set()),
    (0.0, 0.4, ((700.0, 40.0, 1.0), (1400.0, -40.0, 1.0)), (), set(), set()),
    # slowing alone is action
    (-90.0, 1.0, ((600.0, 0.0, 0.3),), (), set(), set()),
    # to port in a meeting; the other ship did as it should
    (180.0, 1.0, PORT, STARBOARD, {"14", "8(d)"}, {"8(d)"}),
    # late; too little; in small steps
    (-90.0, 1.0, ((1150.0, 60.0, 1.0),), (), {"8(a)", "16"}, set()),
    (-90.0, 1.0, ((600.0, 20.0, 1.0),), (), {"8(b)", "16"}, set()),
    (-90.0, 1.0, tuple((600.0 + 180.0 * k, 10.0, 1.0) for k in range(4)), (), {"8(b)", "16"}, set()),
    # a little faster, to pass close ahead
    (-90.0, 1.0, ((700.0, 0.0, 1.1),), (), {"8(a)", "8(b)", "8(d)", "15", "16"}, set()),
    # the stand-on ship turns while the other one still has time
    (90.0, 1.0, STARBOARD, (), {"17(a)(i)"}, set()),
    # and to port for a ship on its port side, once it may act
    (90.0, 1.0, ((1250.0, -60.0, 1.0),), (), {"17(c)"}, {"8(a)", "8(b)", "16"}),
])  # fmt: skip
def test_each_breach_is_named_and_no_other(
    heading: float, k: float, own: Orders, other: Orders, broken: set[str], others: set[str],
) -> None:  # fmt: skip
    one, two = judge(met(heading, own, other, k))
    assert (set(one.broken()), set(two.broken())) == (broken, others)


@pytest.mark.parametrize(("L", "U"), [(200.0, 8.0), (200.0, 4.0), (3.0, 1.0), (3.0, 0.5)])
@pytest.mark.parametrize(("turns", "seen"), [
    (((0.0, 31.0),), True), (((0.0, 29.0),), False),
    (((0.0, 26.0), (12.0, 6.0)), True),  # most of it in one move: an ordered course is reached slowly
    (((0.0, 22.0), (12.0, 12.0)), False),
    (((0.0, 11.0), (4.5, 11.0), (9.0, 11.0)), False),  # a series of small alterations
    (((0.0, 16.0), (3.0, 16.0)), True),
    (((0.0, 26.0), (12.0, -56.0)), False),  # a large one to the other side is not the rest of it
])  # fmt: skip
def test_an_alteration_is_seen_by_the_way_that_it_takes_whatever_length_and_speed(
    L: float, U: float, turns: tuple[tuple[float, float], ...], seen: bool,
) -> None:  # fmt: skip
    """Turns after lengths sailed, 12.5 deg a length, by a fast and a slow ship and by models of both."""
    passage = L / U
    orders = tuple((20.0 * passage + at * passage, turn, 1.0) for at, turn in turns)
    start = meeting(-60.0, 45.0 * passage, U)
    ships = [Sailed(0, 0, 0, U, orders, L), Sailed(*start, -60.0, U, (), L)]
    made = tracks(ships, T=90.0 * passage, dt=max(0.2 * passage, 0.5), rate=12.5 / passage)
    limits = Limits().changed({"horizon": 60.0 * passage * math.sqrt(300.0 / L)}, "test")
    assert (judge(made, limits)[0].margins["8(b)"] >= 0.0) == seen


def test_without_risk_there_is_no_encounter() -> None:
    """Passing clear on the first courses is no merit: nothing applies, whatever the ships do."""
    for one in judge(met(-90.0, off=2500.0)):
        assert not one.met.exists
        assert not numbers(one)
        assert not one.fails


def test_relief_by_the_other_ship_asks_for_nothing() -> None:
    """The stand-on ship turns away at once: the risk is gone before the other one has to act."""
    one, two = judge(met(-90.0, (), ((580.0, 60.0, 1.0),)))
    assert not {"8(a)", "8(b)", "16"} & set(numbers(one))
    assert two.broken() == ("17(a)(i)",)


def test_contact_fails_whatever_else() -> None:
    """A ship that stands on as it should until the end is in contact all the same."""
    late = judge(met(90.0, ((1300.0, 40.0, 1.0), (1330.0, -40.0, 1.0))))[0]
    assert late.contact
    assert late.fails
    free = judge(met(90.0, other=STARBOARD))[0]
    assert not free.contact
    assert not free.fails


def test_action_for_a_third_ship_is_no_breach_of_rule_17() -> None:
    """A ship from port has to keep clear of the own one, which gives way to one from starboard."""
    port, starboard = (Sailed(*meeting(heading, T), heading, U) for heading in (90.0, -90.0))
    alone = judge(tracks([Sailed(0, 0, 0, U, STARBOARD), port], T=3600.0))[0]
    assert "17(a)(i)" in alone.broken()
    both = judge(tracks([Sailed(0, 0, 0, U, STARBOARD), port, starboard], T=3600.0))
    assert [int(one.role) for one in both if one.ship == 0] == [Role.STAND_ON, Role.GIVE_WAY]
    assert not both[0].broken()


def test_a_ship_that_turns_away_and_comes_back_is_in_the_same_encounter() -> None:
    """The distance grows while it runs away from one astern of its beam, and that one is not past and clear."""
    made = met(-90.0, ((600.0, -120.0, 1.0), (900.0, 120.0, 1.0)))
    one = judge(made)[0]
    opening = one.pair.approach[1] < 0.0
    assert opening[(made.t > 840.0) & (made.t < 900.0)].any()
    assert made.t[one.met.ends] > 1200.0
    assert Role(int(one.role)) is Role.GIVE_WAY


def test_yaw_in_waves_is_no_action() -> None:
    """Four degrees either way with a period of 8 s, and a true alteration found where it begins."""
    made = met(-90.0, STARBOARD)
    t = np.arange(0.0, 3600.0, 1.0)
    fine = replace(made, t=t, **{name: np.array([np.interp(t, made.t, one) for one in getattr(made, name)])
                                 for name in ("x", "y", "psi", "u", "v_m")})  # fmt: skip
    yawing = replace(fine, psi=fine.psi + math.radians(4.0) * np.sin(t * 2.0 * math.pi / 8.0))
    one, two = judge(yawing)
    assert not two.own.exists
    assert t[one.own.row] == pytest.approx(600.0, abs=15.0)
    assert not one.broken()
    assert not two.broken()


def test_the_record_that_ends_too_soon_judges_nothing_that_is_to_come() -> None:
    made = met(-90.0)
    rows = int(np.searchsorted(made.t, 700.0))
    cut = replace(made, t=made.t[:rows], **{name: getattr(made, name)[:, :rows]
                                            for name in ("x", "y", "psi", "u", "v_m")})  # fmt: skip
    one = judge(cut)[0]
    assert one.met.exists
    assert not one.met.over
    assert set(numbers(one)) == {"8(d)", "15"}
    assert numbers(one)["8(d)"] == pytest.approx(-1.0, abs=0.01)  # it heads for the other ship


@pytest.mark.slow
def test_many_runs_are_judged_as_each_of_them() -> None:
    runs = [met(-90.0, own, other, off=off) for own in ((), STARBOARD, PORT) for other in ((), PORT)
            for off in (0.0, 300.0)]  # fmt: skip
    many = replace(runs[0], **{name: np.stack([getattr(one, name) for one in runs])
                               for name in ("x", "y", "psi", "u", "v_m")})  # fmt: skip
    judged = judge(many)
    for k, run in enumerate(runs):
        for one, each in zip(judged, judge(run), strict=True):
            assert int(one.role[k]) == int(each.role)
            assert float(one.gap[k]) == float(each.gap)
            assert one.broken((k,)) == each.broken()
            np.testing.assert_array_equal([one.margins[rule][k] for rule in each.margins], list(each.margins.values()))


def test_either_role_is_accepted_at_a_border() -> None:
    """At 112.5 deg from the bow a ship may take itself for overtaking or crossing; at 90 deg it may not."""
    limits = Limits()
    for aspect, roles in ((110.0, {Role.OVERTAKING, Role.GIVE_WAY}), (100.0, {Role.GIVE_WAY}),
                          (115.0, {Role.OVERTAKING, Role.GIVE_WAY}), (120.0, {Role.OVERTAKING})):  # fmt: skip
        found = classes(np.radians(30.0), np.radians(-aspect), np.radians(-30.0), limits)
        assert {Role(k) for k in np.flatnonzero(found)} == roles


def test_every_direction_has_a_role_and_its_mirror_the_opposite_one() -> None:
    """Whole plane of bearings: exchange of sides exchanges giving way and standing on, and nothing else."""
    limits = Limits()
    a, b = np.meshgrid(*[np.radians(np.arange(-179.5, 180.0, 3.0))] * 2)
    turned = b + math.pi - a
    here, there = classes(b, a, turned, limits), classes(-b, -a, -turned, limits)
    exchanged = here[..., [0, 1, 2, 4, 3, 5, 6, 7]]
    np.testing.assert_array_equal(there, exchanged)
    apart = (np.abs(a) > np.radians(117.6)) & (np.abs(b) > np.radians(117.6))  # each astern of the other
    np.testing.assert_array_equal(here.any(axis=-1), ~apart)


def test_restricted_visibility_has_no_roles() -> None:
    for heading, own, broken in ((-90.0, PORT, {"19(d)"}), (90.0, PORT, {"19(d)"}), (90.0, STARBOARD, set())):
        one = judge(met(heading, own), restricted=True)[0]
        assert Role(int(one.role)) is Role.UNSEEN
        assert set(one.broken()) == broken


def test_a_threshold_needs_a_source_and_a_value() -> None:
    with pytest.raises(RequestError, match="without a source"):
        Limit(5.0, "not", " ")
    with pytest.raises(RequestError, match="above zero"):
        Limits().changed({"passing": -1.0}, "a test")
    with pytest.raises(RequestError, match=r"threshold.*passing"):
        Limits().changed({"pasing": 1.0}, "a test")


def test_ships_that_begin_in_contact_are_refused() -> None:
    with pytest.raises(RequestError, match="own and target 1 touch in the first row of 1 of 1 runs"):
        judge(tracks([Sailed(0, 0, 0, 8.0), Sailed(50.0, 10.0, 90.0, 8.0)]))


@pytest.mark.parametrize(("change", "said"), [
    ({"t": np.array([0.0, 1.0, 1.0])}, "increase strictly"),
    ({"psi": np.full((2, 3), np.nan)}, "psi has gaps"),
    ({"u": np.zeros((2, 4))}, "u has the shape"),
    ({"L": np.array([100.0, 0.0])}, "length L and a breadth B above zero"),
    ({"L": np.array([100.0])}, "ships and rows, 1 and 3"),
    ({"names": ("one",)}, "1 names for 2 ships"),
])  # fmt: skip
def test_tracks_that_cannot_be_are_refused(change: dict[str, object], said: str) -> None:
    whole = {name: np.zeros((2, 3)) for name in ("x", "y", "psi", "u", "v_m")}
    good = {"t": np.array([0.0, 1.0, 2.0]), **whole, "L": np.array([100.0, 100.0]), "B": np.array([20.0, 20.0])}
    with pytest.raises(RequestError, match=said):
        Tracks(**(good | change))  # type: ignore[arg-type]
