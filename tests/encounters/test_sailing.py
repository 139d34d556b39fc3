"""Encounters sailed: who acts, who does not, and what is left of the geometry where nobody does."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.core.errors import RequestError
from seatrial.encounters.conduct import CONDUCTS, Orders, Scene
from seatrial.encounters.meeting import Meeting, drawn, imazu
from seatrial.encounters.rules import Limits, Role, judge
from seatrial.encounters.sailing import Sea, sail
from seatrial.ships.files import load

SHIP = load("kvlcc2_l7")
V = SHIP.speed
T = 150.0 * math.sqrt(7.0 / 320.0) * 10.0


def problem(case: int) -> Meeting:
    return imazu(V, T)[case - 1]


def rows(meeting: Meeting, some: slice | list[int]) -> Meeting:
    """Some of the runs."""
    return Meeting(meeting.U, *(np.atleast_2d(getattr(meeting, name))[some] for name in ("x", "y", "psi", "U_target")))


def test_where_nobody_acts_all_come_together() -> None:
    found = sail(SHIP, problem(2), Sea(1.5 * T, every=2.0), "ignores", ("ignores",))
    tracks = found.tracks
    assert tracks.x.shape == (1, 2, math.floor(1.5 * T / 2.0) + 1)
    gap = np.hypot(tracks.x[0, 0] - tracks.x[0, 1], tracks.y[0, 0] - tracks.y[0, 1])
    assert gap.min() < 2.0  # a step of the relative motion at most
    assert tracks.t[gap.argmin()] == pytest.approx(T, rel=0.02)
    assert np.ptp(tracks.psi[0, 1]) == 0.0


@pytest.mark.slow
def test_who_has_to_give_way_does_and_goes_back() -> None:
    found = sail(SHIP, problem(2), Sea(3.0 * T, every=2.0), "rules", ("rules",))
    heading = np.degrees(found.tracks.psi[0])
    assert heading[0].max() > 25.0  # to starboard, behind the ship on the starboard side
    assert heading[0].min() > -5.0
    assert abs(heading[0, -1]) < 2.0
    assert np.ptp(heading[1]) < 1.0  # that one stands on
    assert not judge(found.tracks)[0].fails.any()


@pytest.mark.slow
def test_a_ship_that_turns_to_port_head_on_is_named_by_rule_14() -> None:
    found = sail(SHIP, problem(1), Sea(3.0 * T, every=2.0), "port", ("ignores",))
    own = judge(found.tracks)[0]
    assert "14" in own.broken((0,))
    mirrored = sail(SHIP, problem(1), Sea(3.0 * T, every=2.0), "rules", ("ignores",))
    assert "14" not in judge(mirrored.tracks)[0].broken((0,))


@pytest.mark.slow
def test_runs_do_not_depend_on_the_runs_beside_them() -> None:
    met = drawn([Role.GIVE_WAY, Role.HEAD_ON], 6, V, seed=3)
    sea = Sea(200.0, every=5.0, limits=Limits())
    whole, part = (sail(SHIP, one, sea).tracks for one in (met, rows(met, slice(2, 4))))
    assert (whole.x[2:4] == part.x).all()
    assert (whole.psi[2:4] == part.psi).all()


@pytest.mark.slow
def test_draws_of_the_ship_change_its_way_and_nothing_else() -> None:
    met = rows(problem(2), [0, 0])
    value = SHIP.model.hull.N_r
    found = sail(SHIP, met, Sea(2.0 * T, every=5.0), draws={"hull.N_r": np.array([value, 1.3 * value])}).tracks
    plain = sail(SHIP, met, Sea(2.0 * T, every=5.0)).tracks
    assert np.abs(found.x[0] - plain.x[0]).max() < 1e-6
    assert np.abs(found.y[1, 0] - plain.y[1, 0]).max() > 0.05


@pytest.mark.slow
def test_a_stack_of_ones_own_sees_and_steers() -> None:
    seen: list[Scene] = []

    class Stack:
        def look(self, scene: Scene) -> Orders:
            seen.append(scene)
            return Orders(np.full(len(scene.x), math.radians(40.0)), np.ones(len(scene.x)))

    found = sail(SHIP, problem(1), Sea(60.0, every=5.0), lambda scene: Stack())
    assert seen[1].t == 0.5
    assert seen[0].x.shape == (1, 2)
    assert math.degrees(found.tracks.psi[0, 0, -1]) == pytest.approx(40.0, abs=3.0)


def test_conducts_differ_where_their_names_say_so() -> None:
    assert CONDUCTS["port"].side == -1.0
    assert not CONDUCTS["ignores"].gives_way
    assert CONDUCTS["late"].act < CONDUCTS["rules"].act
    assert max(CONDUCTS["small"].alterations) < Limits().apparent.value


@pytest.mark.parametrize(("wrong", "said"), [
    (lambda: sail(SHIP, problem(1), Sea(100.0), "rulez"), "no conduct 'rulez'; near: rules"),
    (lambda: sail(SHIP, problem(1), Sea(100.0), traffic=("rule",)), "no conduct 'rule'"),
    (lambda: sail(SHIP, problem(1), Sea(100.0, every=0.7)), "whole number of steps of 0.5 s"),
    (lambda: sail(SHIP, problem(1), Sea(15.0)), "two rows"),
    (lambda: sail(load("otter"), problem(1), Sea(100.0)), "no rudder delta and revolutions n_P"),
    (lambda: sail(SHIP, problem(1), Sea(100.0), draws={"hull.N_q": np.ones(1)}), "no parameter 'hull.N_q'"),
])  # fmt: skip
def test_what_cannot_be_sailed_is_a_line(wrong, said) -> None:
    with pytest.raises(RequestError, match=said):
        wrong()
