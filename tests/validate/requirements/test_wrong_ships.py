"""No wrong ship passes: each of the gallery fails the requirement that names its defect, at both scopes."""

from __future__ import annotations

import re

import pytest
from wrong_ships import GALLERY, ONLY_WITH_WAVES, Wrong

from seatrial.ships.files import load
from seatrial.validate.requirements.probe import Probe
from seatrial.validate.requirements.scopes import BERTHING, COLLISION_AVOIDANCE, checked, judge
from tiers import slow_but

SAMPLE = (
    "resistance ahead zero, hidden by a stopped propeller", "negative share of revolutions on rudder force",
    "no race at the rudder", "thrust grows with speed", "rudder rate of a hundredth", "rudder stops short of its limit",
    "rudder passes its limit to port", "mass matrix not symmetric",
)  # fmt: skip


def named(wrong: Wrong, scope: int) -> bool:
    """Whether the item of the defect fails at a scope (0 collision avoidance, 1 berthing) with words that name it."""
    item = next(i for i in (COLLISION_AVOIDANCE, BERTHING)[scope] if i.number == wrong.item[scope])
    found = checked(item, wrong.probe())
    said = [one.wrong for one in found.findings if not one.holds]
    return found.verdict == "fail" and any(re.search(wrong.words, text) for text in said)


def test_the_gallery_has_forty_defects_each_once() -> None:
    assert len({wrong.defect for wrong in GALLERY}) == len(GALLERY) >= 40
    assert {wrong.item[0] for wrong in GALLERY} == {str(k) for k in range(1, 11)}
    assert set(SAMPLE) <= {wrong.defect for wrong in GALLERY}


QUICK = ("no race at the rudder", "rudder stops short of its limit", "rudder rate of a hundredth")


@pytest.mark.parametrize(
    "wrong", slow_but([w for w in GALLERY if w.defect in SAMPLE], *(w for w in GALLERY if w.defect in QUICK)),
    ids=lambda w: w.defect,
)  # fmt: skip
def test_a_sample_of_wrong_ships(wrong: Wrong) -> None:
    assert named(wrong, 0)


@pytest.mark.long
@pytest.mark.parametrize("wrong", GALLERY, ids=lambda w: w.defect)
def test_every_wrong_ship_fails_the_item_of_its_defect_at_both_scopes(wrong: Wrong) -> None:
    assert named(wrong, 0)
    assert named(wrong, 1)


@pytest.mark.long
@pytest.mark.parametrize("wrong", ONLY_WITH_WAVES, ids=lambda w: w.defect)
def test_wrong_waves(wrong: Wrong) -> None:
    assert named(wrong, 0)


@pytest.mark.long
@pytest.mark.parametrize(
    ("ship", "far", "near"),
    [
        ("kvlcc2", (), ("9",)),  # no side force astern
        ("kvlcc2_shallow", (), ("9",)),
        ("esso_osaka_3m_harbour", (), ()),
        ("esso_osaka_3m", ("7",), ()),  # no waves
        ("twin_virtual", ("7",), ("10",)),  # no wind; contra-turning, so 9 holds
        ("mariner_nomoto", ("1", "5", "6", "7"), ("1", "2", "6", "7", "9", "10")),
        ("mariner_nomoto2", ("1", "5", "6", "7"), ("1", "2", "6", "7", "9", "10")),
        ("zeefakkel", ("1", "5", "6", "7"), ("1", "2", "6", "7", "9", "10")),
        ("zeefakkel_speeds", ("1", "5", "6", "7"), ("1", "2", "6", "7", "9", "10")),
        ("qiuxin5", ("3", "7"), ("4", "10")),  # its fitted masses are below the water that it displaces
        ("esso_190k_tanker", ("7",), ("1", "2", "9", "10")),  # no damping of a turn on the spot, N_ur and N_vr alone
        ("modified_abkowitz_kvlcc2_l7", ("7",), ("1", "9", "10")),  # from 0.3 m/s on
        ("otter", ("1", "7", "9"), ("2", "10", "12")),  # Y_v = 0, and no greatest rate of the propellers
        ("cybership2", ("3", "6", "7", "8", "9"), ("4", "7", "8", "10", "11", "12")),  # forces as ordered, no propeller
    ],
)
def test_ships_of_the_library_pass_and_fail_for_reasons_of_their_files(
    ship: str, far: tuple[str, ...], near: tuple[str, ...]
) -> None:
    probe = Probe.of(load(ship))
    assert judge(probe.ship, "collision-avoidance", probe).failed == far
    assert judge(probe.ship, "berthing", probe).failed == near


@pytest.mark.long
@pytest.mark.parametrize("name", [
    "kvlcc2_l7", "esso_osaka_3m", "twin_virtual", "esso_osaka_3m_hybrid", "mariner", "modified_abkowitz_kvlcc2_l7",
    "naval_blanke", "container_son_nomoto", "esso_190k_tanker", "otter", "cybership2", "container_175m_nomoto2",
    "zeefakkel", "zeefakkel_speeds", "kvlcc2_l7_arx",
])  # fmt: skip
def test_every_pass_rests_on_a_bound(name: str) -> None:
    """No unconditional pass, by what an item asks of each kind of model: a value was held against a threshold."""
    for scope in ("collision-avoidance", "berthing", "functional"):
        for item, found in judge(load(name), scope).rows:
            assert found.verdict != "pass" or any(one.bound for one in found.findings), (scope, item.number)
