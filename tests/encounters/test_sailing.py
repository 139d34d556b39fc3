"""Encounters sailed: who acts, who does not, and what is left of the geometry where nobody does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.core.errors import RequestError
from seatrial.encounters.conduct import CONDUCTS, Conduct, Orders, Scene, Watch
from seatrial.encounters.meeting import Meeting, Ranges, drawn, imazu
from seatrial.encounters.rules import Limits, Role, judge
from seatrial.encounters.sailing import STEP, Sea, _Fleet, paced, sail, stepped
from seatrial.environment import Environment
from seatrial.environment.chart import Area, Chart
from seatrial.manoeuvres import Settings
from seatrial.manoeuvres.autopilot import CourseKeeping, usual_gains
from seatrial.models.arx import Arx
from seatrial.ships.files import load
from seatrial.simulate.approach import approach, time_step
from seatrial.simulate.place import place_of
from seatrial.simulate.run import campaign

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


@pytest.mark.slow
def test_an_encounter_turns_and_moves_with_its_start() -> None:
    """The same from another place on another course: tracks, currents and other ships turn with it, to rounding."""
    psi, c, s = 2.1, math.cos(2.1), math.sin(2.1)
    plain, turned = Environment(current_x=0.02, current_y=0.01), (0.02 * c - 0.01 * s, 0.02 * s + 0.01 * c)
    around = Environment(current_x=turned[0], current_y=turned[1])
    seas = (Sea(2.0 * T, 5.0, around=np.array([plain])),
            Sea(2.0 * T, 5.0, around=np.array([around]), start=np.array([[400.0, -70.0, psi]])))  # fmt: skip
    here, there = (sail(SHIP, problem(2), sea, "rules", ("rules",)).tracks for sea in seas)
    assert np.abs(here.psi[0, 0]).max() > 0.4  # it gives way
    assert there.x == pytest.approx(400.0 + here.x * c - here.y * s, abs=1e-6)
    assert there.y == pytest.approx(-70.0 + here.x * s + here.y * c, abs=1e-6)
    assert there.psi == pytest.approx(here.psi + psi, abs=1e-8)
    assert there.u == pytest.approx(here.u, abs=1e-8)


@pytest.mark.slow
def test_depth_of_a_chart_is_felt_as_that_of_the_weather() -> None:
    """Even water by either way: more lag in a turn, and less speed, than in deep water."""
    ship, h = load("kvlcc2_shallow"), 27.0
    whole = np.array([[-3e4, -3e4], [-3e4, 3e4], [3e4, 3e4], [3e4, -3e4]])
    place = place_of(ship, Chart("even", areas=(Area(whole, h),)), touching=False)
    met = Meeting(ship.speed, np.array([9e3]), np.array([9e3]), np.array([0.0]), np.array([5.0]))
    seas = Sea(600.0, place=place), Sea(600.0, around=np.array([Environment(per_depth=1.0 / h)])), Sea(600.0)
    chart, weather, deep = (sail(ship, met, sea, lambda scene: Ordered(0.8, 1.0)).tracks for sea in seas)
    for name in ("x", "y", "psi", "u"):
        assert getattr(chart, name)[0, 0] == pytest.approx(getattr(weather, name)[0, 0], rel=1e-9, abs=1e-9)
    assert chart.u[0, 0, -1] < 0.97 * deep.u[0, 0, -1]


@pytest.mark.slow
def test_other_ships_slow_and_turn_with_lags_of_their_length() -> None:
    fleet = _Fleet(SHIP, problem(1), np.array([SHIP.L_pp, SHIP.L_pp]), Sea(60.0), {})
    psi, pace = fleet.motion[2, 0, 1], V / SHIP.L_pp
    fleet.order(1, Orders(np.array([psi]), np.array([0.5])))
    steps = round(8.0 / pace / STEP)  # one lag of surge
    for _ in range(steps):
        fleet.advance()
    assert fleet.motion[3, 0, 1] == pytest.approx(V * (0.5 + 0.5 * math.exp(-steps * STEP * pace / 8.0)))
    fleet.order(1, Orders(np.array([psi + math.radians(60.0)]), np.array([0.5])))
    turned = []
    for _ in range(round(30.0 / pace / STEP)):
        fleet.advance()
        turned.append(float(fleet.motion[2, 0, 1] - psi))
    assert turned[-1] == pytest.approx(math.radians(60.0), abs=1e-3)
    assert max(turned) < math.radians(60.5)  # no overshoot to speak of
    rate = np.diff(turned).max() / STEP
    assert rate <= 0.25 * pace * (1.0 + 1e-9)
    assert rate > 0.2 * pace


@pytest.mark.slow
def test_a_turn_is_that_of_the_ship_by_small_steps() -> None:
    """The own ship's way over 60 s of a course change, against the plain simulation with a tenth of its step."""
    ordered = math.radians(60.0)
    found = sail(SHIP, problem(1), Sea(60.0, every=10.0), lambda scene: Ordered(ordered, 1.0)).tracks
    U, n_P = approach(SHIP, V)
    steer = CourseKeeping(n_P, ordered, *usual_gains(Settings(n_P, U, SHIP.L_pp, 0.6)), math.radians(20.0))
    dt = 0.1 * time_step(SHIP)
    fine = campaign(SHIP, steer, {"policy.K_i": np.zeros(1)}, speed=U, duration=60.0, dt=dt, every=round(10.0 / dt),
                    threads=1).values[0]  # fmt: skip
    assert np.abs(found.x[0, 0] - fine[:, 0]).max() < 0.02 * SHIP.L_pp
    assert np.abs(found.y[0, 0] - fine[:, 1]).max() < 0.02 * SHIP.L_pp
    assert np.abs(found.psi[0, 0] - fine[:, 2]).max() < math.radians(1.0)


@pytest.mark.parametrize(("limits", "ordered", "failed"), [
    ({"v_m": (-0.02, 0.02)}, 60.0, [0, 1]),  # it drifts in a turn
    ({"v_m": (-0.02, 0.02)}, 0.0, []),  # and is carried sideways in the other run, not through the water
    ({"u": (0.0, V + 0.1)}, 0.0, []),  # its speed over ground is .3 m/s more there
    ({"u": (0.0, V + 0.05)}, 60.0, []),  # on a course across it too
    ({"u": (0.0, V - 0.01)}, 0.0, [0, 1]),
    ({"r": (-1e-4, 1e-4)}, 60.0, [0, 1]),
])  # fmt: skip
def test_a_motion_out_of_the_range_of_validity_is_one_through_the_water(
    limits: dict[str, tuple[float, float]], ordered: float, failed: list[int],
) -> None:  # fmt: skip
    one = rows(problem(1), slice(None))
    two = Meeting(V, *(np.concatenate([getattr(one, name)] * 2) for name in ("x", "y", "psi", "U_target")))
    around = np.array([Environment(), Environment(current_x=0.3, current_y=0.2)])
    found = sail(replace(SHIP, validity=limits), two, Sea(40.0, around=around),
                 lambda scene: Ordered(math.radians(ordered), 1.0))  # fmt: skip
    assert found.failed.tolist() == failed


@pytest.mark.slow
def test_runs_of_a_batch_are_as_if_each_were_alone() -> None:
    """A block of the kernel and a bit: each run with its own ship, weather and meeting, to the last bit."""
    met = drawn([Role.GIVE_WAY, Role.HEAD_ON], 19, V, 3, Ranges(T=(90.0, 150.0)))
    rng = np.random.default_rng(4)
    draws = {"hull.N_v": -0.137 * rng.uniform(0.9, 1.1, 19)}
    around = np.array([Environment(current_x=a, current_y=b) for a, b in rng.uniform(-0.1, 0.1, (19, 2))])
    conducts = rng.integers(2, size=(19, 2))

    def sailed(some: slice) -> np.ndarray:
        sea = Sea(240.0, 20.0, around=around[some])
        found = sail(SHIP, rows(met, some), sea, "rules", ("rules", "port"), 1,
                     {name: one[some] for name, one in draws.items()}, conducts[some]).tracks  # fmt: skip
        return np.stack([found.x, found.y, found.psi, found.u, found.v_m])

    whole = sailed(slice(None))
    assert np.ptp(whole[2, :, 0]) > math.radians(30.0)  # somebody turns
    for k, begun in enumerate((met.x, met.y, met.psi)):
        assert (whole[k, :, 1:, 0] == begun).all()
    for run in (0, 15, 16, 18):
        assert (sailed(slice(run, run + 1))[:, 0] == whole[:, run]).all()


@pytest.mark.slow
def test_conducts_of_one_ship_differ_by_run_as_if_each_were_alone() -> None:
    """Six runs of two ships that run straight at the ship: each conduct orders what it does in a batch of its own."""
    known = [CONDUCTS[name] for name in ("rules", "ignores", "late", "small", "port")]
    chosen = np.array([0, 1, 2, 3, 4, 0])
    met = imazu(V, T)[4]

    def scene(t: float, runs: int) -> Scene:
        north, east = met.U_target * np.cos(met.psi), met.U_target * np.sin(met.psi)
        x, y = np.array([V * t, *(met.x + north * t)]), np.array([0.0, *(met.y + east * t)])
        psi = np.array([0.0, *met.psi])
        rows = [np.tile(one, (runs, 1)) for one in (x, y, psi, np.array([V, *north]), np.array([0.0, *east]))]
        return Scene(t, *rows, np.full(3, SHIP.L_pp))

    def watch(ways: list[Conduct], of: list[int]) -> Watch:
        return Watch(ways, np.array(of), 0, scene(0.0, len(of)), np.full(len(of), V), Limits())

    mixed, alone = watch(known, chosen.tolist()), [watch([known[k]], [0]) for k in chosen]
    swings = set()
    for t in np.arange(0.0, 1.5 * T, 5.0):
        orders, single = mixed.look(scene(t, 6)), [one.look(scene(t, 1)) for one in alone]
        assert orders.psi.tolist() == [float(one.psi[0]) for one in single]
        assert orders.speed.tolist() == [float(one.speed[0]) for one in single]
        swings.add(tuple(np.round(orders.psi, 6)))
    assert len({tuple(column) for column in np.array(sorted(swings)).T}) >= 4  # who ignores, and three that act


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
    watch = Watch((CONDUCTS["rules"],), np.array([0]), 0, scene, np.array([V]), Limits())
    rows = np.array([0])
    room = watch._room(scene, np.array([0.0]), np.array([1.0]), rows)
    assert room == pytest.approx(aside - 1.3 * passing)
    t = 0.5 * math.pi * SHIP.L_pp / (0.25 * V)  # of its own turn, on the mean heading meanwhile
    north = 300.0 - V * t - V * t * math.cos(math.pi / 4)
    east = aside - V * t * math.sin(math.pi / 4)
    least = abs(north - east) / math.sqrt(2.0)  # both make V across: the relative course is south-west
    room = watch._room(scene, np.array([math.pi / 2]), np.array([1.0]), rows)
    assert room == pytest.approx(least - 1.3 * passing)
    told = replace(scene, psi=scene.psi + 2.0 * math.pi)  # as a compass may tell it: the turn is the shorter one
    assert watch._room(told, np.array([math.pi / 2]), np.array([1.0]), rows) == pytest.approx(room)


def looked(psi: float, off: float, times: list[float], turn: float = 0.0) -> list[tuple[float, bool]]:
    """Heading ordered [rad], and risk, at times [s]; a ship on course psi [deg] passes `off` [m] to the east at T.

    All is turned about the origin, the order back.
    """
    angle = math.radians(psi)

    def scene(t: float) -> Scene:
        x = np.array([[V * t, V * T + V * math.cos(angle) * (t - T)]])
        y = np.array([[0.0, off + V * math.sin(angle) * (t - T)]])
        north, east = np.array([[V, V * math.cos(angle)]]), np.array([[0.0, V * math.sin(angle)]])
        c, s = math.cos(turn), math.sin(turn)
        return Scene(t, c * x - s * y, s * x + c * y, np.array([[turn, angle + turn]]), c * north - s * east,
                     s * north + c * east, np.full(2, SHIP.L_pp))  # fmt: skip

    watch = Watch((CONDUCTS["rules"],), np.array([0]), 0, scene(0.0), np.array([V]), Limits())
    return [(float(watch.look(scene(t)).psi[0]) - turn, bool(watch.risk[0, 1])) for t in times]


@pytest.mark.parametrize("psi", [180.0, -60.0, 60.0])
def test_looks_turn_with_the_compass(psi: float) -> None:
    times = [*np.linspace(0.5 * T, 1.5 * T, 21)]
    plain, turned = (looked(psi, 1.0, times, turn) for turn in (0.0, 2.0))
    assert [risk for _, risk in turned] == [risk for _, risk in plain]
    assert [one for one, _ in turned] == pytest.approx([one for one, _ in plain], abs=1e-9)


def test_who_passes_clear_is_no_risk_and_who_passes_nearer_is() -> None:
    passing = float(Limits().passing.of(np.array(SHIP.L_pp)))
    assert looked(180.0, 1.05 * passing, [0.9 * T]) == [(0.0, False)]
    [(psi, risk)] = looked(180.0, 0.95 * passing, [0.9 * T])
    assert (psi > 0.5, risk) == (True, True)


def test_who_stands_on_acts_when_it_is_left_alone_and_no_sooner() -> None:
    horizon, alone = (float(one.of(np.array(SHIP.L_pp))) for one in (Limits().horizon, Limits().alone))
    early, soon = T - 0.95 * horizon, T - 0.95 * alone
    (held, risk), (acts, _) = looked(90.0, 0.0, [early, soon])
    assert (held, risk) == (0.0, True)
    assert acts > 0.5
    [(gives, _)] = looked(-90.0, 0.0, [early])  # and who gives way at once
    assert gives > 0.5


@pytest.mark.parametrize("psi", [180.0, -60.0, 60.0])
def test_risk_is_over_when_each_is_abaft_the_beam_of_the_other(psi: float) -> None:
    """Nobody alters here: they meet at T, and draw apart from then on."""
    (_, before), (_, after), (back, _) = looked(psi, 1.0, [0.98 * T, 1.05 * T, 2.0 * T])
    assert (before, after) == (True, False)
    assert back == 0.0  # as soon as there is room


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
    (lambda: sail(replace(SHIP, model=Arx(dt=1.0)), problem(1), Sea(100.0)), "a model in discrete time"),
])  # fmt: skip
def test_what_cannot_be_sailed_is_a_line(wrong, said) -> None:
    with pytest.raises(RequestError, match=said):
        wrong()


def test_others_look_as_often_in_the_time_of_a_model_as_in_that_of_a_ship(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each 10 s of a ship of 300 m or more; by the root of the length each 1.5 s of a model of 7 m."""
    looks: list[float] = []
    look = Watch.look

    def seen(self: Watch, scene: Scene) -> Orders:
        if self._ship:
            looks.append(scene.t)
        return look(self, scene)

    monkeypatch.setattr(Watch, "look", seen)
    sail(SHIP, problem(1), Sea(30.0, every=2.0), "rules", ("rules",))
    assert set(np.diff(looks[1:])) == {1.5}
    assert (paced(300.0), paced(1200.0), stepped(paced(3.0)), stepped(paced(0.1))) == (10.0, 10.0, 1.0, 0.5)
    assert paced(75.0, 600.0) == 300.0


@pytest.mark.parametrize(("share", "counts"), [(1.4, True), (1.6, False)])
def test_a_manoeuvre_keeps_clear_of_whom_it_meets_within_half_again_the_horizon(share: float, counts: bool) -> None:
    """Head-on on the old course, after so many horizons; later than that nobody has to be kept clear of yet."""
    L = np.array([300.0, 300.0])
    T, U = share * float(Limits().horizon.of(L[0])), 8.0
    x, zero = np.array([[0.0, 2.0 * U * T]]), np.zeros((1, 2))
    scene = Scene(0.0, x, zero, np.array([[0.0, math.pi]]), np.array([[U, -U]]), zero, L)
    watch = Watch((CONDUCTS["rules"],), np.zeros(1, dtype=int), 0, scene, np.array([U]), Limits())
    room = watch._room(scene, np.zeros(1), np.ones(1), np.zeros(1, dtype=int))[0]
    assert room == (pytest.approx(-1.3 * float(Limits().passing.of(L[0]))) if counts else math.inf)
