"""Encounters sailed: who acts, who does not, and what is left of the geometry where nobody does."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.core.errors import RequestError
from seatrial.encounters.conduct import CONDUCTS, Orders, Scene, Watch
from seatrial.encounters.meeting import Meeting, drawn, imazu
from seatrial.encounters.rules import Limits, Role, judge
from seatrial.encounters.sailing import STEP, Sea, _Others, sail
from seatrial.environment import Environment
from seatrial.ships.files import load

SHIP = load("kvlcc2_l7")
V = SHIP.speed
T = 150.0 * math.sqrt(7.0 / 320.0) * 10.0


def problem(case: int) -> Meeting:
    return imazu(V, T)[case - 1]


def rows(meeting: Meeting, some: slice | list[int]) -> Meeting:
    """Some of the runs."""
    return Meeting(meeting.U, *(np.atleast_2d(getattr(meeting, name))[some] for name in ("x", "y", "psi", "U_target")))


@pytest.mark.slow
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
    gap = np.hypot(found.tracks.x[0, 0] - found.tracks.x[0, 1], found.tracks.y[0, 0] - found.tracks.y[0, 1])
    assert gap.min() > 1.1 * Limits().passing.of(np.array(SHIP.L_pp))  # it aims at more than it is asked for
    assert not judge(found.tracks)[0].fails.any()


@pytest.mark.slow
def test_a_ship_that_turns_to_port_head_on_is_named_by_rule_14() -> None:
    found = sail(SHIP, problem(1), Sea(3.0 * T, every=2.0), "port", ("ignores",))
    own = judge(found.tracks)[0]
    assert "14" in own.broken((0,))
    mirrored = sail(SHIP, problem(1), Sea(3.0 * T, every=2.0), "rules", ("ignores",))
    assert "14" not in judge(mirrored.tracks)[0].broken((0,))


class Ordered:
    """A master that gives one order, and keeps what it sees."""

    def __init__(self, psi: float, speed: float) -> None:
        self.psi, self.speed = psi, speed
        self.seen: list[Scene] = []

    def look(self, scene: Scene) -> Orders:
        self.seen.append(scene)
        return Orders(np.full(len(scene.x), self.psi), np.full(len(scene.x), self.speed))


def test_what_is_seen_moves_as_it_says() -> None:
    """Velocities over ground are the differences of places, of a ship that drifts in its turn too."""
    master = Ordered(math.radians(90.0), 1.0)
    sail(SHIP, problem(1), Sea(40.0, every=5.0), lambda scene: master)
    x, y, north, east = (np.array([getattr(one, name)[0] for one in master.seen])
                         for name in ("x", "y", "north", "east"))  # fmt: skip
    drift = np.array([math.atan2(one.east[0, 0], one.north[0, 0]) - one.psi[0, 0] for one in master.seen])
    assert np.abs(drift[20:]).max() > math.radians(3.0)
    for place, speed in ((x, north), (y, east)):
        assert np.diff(place, axis=0) == pytest.approx(0.25 * (speed[1:] + speed[:-1]), abs=2e-3)


@pytest.mark.slow
def test_fewer_revolutions_slow_the_ship() -> None:
    full, half = (sail(SHIP, problem(1), Sea(120.0, every=10.0), lambda scene, k=k: Ordered(0.0, k)).tracks
                  for k in (1.0, 0.5))  # fmt: skip
    assert full.u[0, 0, -1] == pytest.approx(V, rel=0.02)
    assert half.u[0, 0, -1] < 0.85 * V


def test_a_current_carries_the_ship() -> None:
    """Ahead of the start and to the side by its velocity times the time, at the speed through the water of before."""
    around = np.array([Environment(current_x=0.3, current_y=0.1)])
    found = sail(SHIP, problem(1), Sea(60.0, every=10.0, around=around), lambda scene: Ordered(0.0, 1.0)).tracks
    assert found.u[0, 0, 0] == pytest.approx(V + 0.3)
    assert found.v_m[0, 0, 0] == pytest.approx(0.1)
    assert found.x[0, 0, -1] == pytest.approx(60.0 * (V + 0.3), rel=0.01)
    assert found.y[0, 0, -1] == pytest.approx(6.0, abs=0.6)


def test_other_ships_slow_and_turn_with_lags_of_their_length() -> None:
    L = np.array([SHIP.L_pp, SHIP.L_pp])
    others = _Others(problem(1), L)
    others.share[:] = 0.5
    psi, pace = others.wanted.copy(), V / SHIP.L_pp
    steps = round(8.0 / pace / STEP)  # one lag of surge
    for _ in range(steps):
        others.advance()
    assert others.motion[3] == pytest.approx(V * (0.5 + 0.5 * math.exp(-steps * STEP * pace / 8.0)))
    others.wanted += math.radians(60.0)
    turned = []
    for _ in range(round(30.0 / pace / STEP)):
        others.advance()
        turned.append(float((others.motion[2] - psi)[0, 0]))
    assert turned[-1] == pytest.approx(math.radians(60.0), abs=1e-3)
    assert max(turned) < math.radians(60.5)  # no overshoot to speak of
    rate = np.diff(turned).max() / STEP
    assert rate <= 0.25 * pace * (1.0 + 1e-9)
    assert rate > 0.2 * pace


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


def test_room_is_what_is_left_beyond_the_distance_aimed_at() -> None:
    """A ship on the opposite course passes at its offset; a turn of 90 degrees takes a quarter of a circle's way."""
    passing = float(Limits().passing.of(np.array(SHIP.L_pp)))
    L, aside = np.array([SHIP.L_pp, SHIP.L_pp]), 2.0 * passing
    scene = Scene(0.0, np.array([[0.0, 300.0]]), np.array([[0.0, aside]]), np.array([[0.0, math.pi]]),
                  np.array([[V, -V]]), np.zeros((1, 2)), L)  # fmt: skip
    watch = Watch(CONDUCTS["rules"], 0, scene, np.array([V]), Limits())
    rows = np.array([0])
    room = watch._room(scene, np.array([0.0]), np.array([1.0]), rows)
    assert room == pytest.approx(aside - 1.3 * passing)
    t = 0.5 * math.pi * SHIP.L_pp / (0.25 * V)  # of its own turn, on the mean heading meanwhile
    north = 300.0 - V * t - V * t * math.cos(math.pi / 4)
    east = aside - V * t * math.sin(math.pi / 4)
    least = abs(north - east) / math.sqrt(2.0)  # both make V across: the relative course is south-west
    room = watch._room(scene, np.array([math.pi / 2]), np.array([1.0]), rows)
    assert room == pytest.approx(least - 1.3 * passing)


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
