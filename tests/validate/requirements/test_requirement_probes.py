"""At which speeds, drifts, headings, currents and orders a requirement is tried, and what is made of the answers."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from plain_ships import LIMIT, N_P, L, U, plain

from seatrial.core.parameters import update
from seatrial.data import Trial
from seatrial.engine import SimulationError
from seatrial.ships.files import load
from seatrial.simulate.run import simulate
from seatrial.validate.requirements import Item, Judgement, body, hull, plausible, scopes
from seatrial.validate.requirements.probe import Held, Probe


class Asked(SimpleNamespace):
    """A ship that stands still whatever is asked, and notes what was."""

    def __init__(self, **more: Any) -> None:
        usual = {"ship": SimpleNamespace(L_pp=L), "U": U, "n_P": N_P, "limit": LIMIT, "unit_time": L / U, "rests": True,
                 "ahead": (0.5, 1.0), "astern": (-0.25,), "sways": True, "stops": True, "reverses": True,
                 "points": [], "drifts": []}  # fmt: skip
        super().__init__(**{**usual, **more})

    def controls(self, n: float = 0.0, d: float = 0.0) -> tuple[float, float]:
        return n, d

    def state(self, u: float = 0.0, v_m: float = 0.0, r: float = 0.0) -> tuple[float, ...]:
        return 0.0, 0.0, 0.0, u, v_m, r

    def at(self, motion: Any, control: Any, around: Any = None, psi: float = 0.0) -> Any:
        self.points.append((np.array(motion), np.atleast_2d(np.array(control)), psi))
        return np.zeros((len(self.points[-1][0]), 3))

    def drift(self, states: Any, controls: Any, duration: float, around: Any = None) -> Any:
        """A drift with the water, from where it begins."""
        self.drifts.append((np.array(states), np.array(controls), duration, around))
        t = np.linspace(0.0, duration, 5)
        runs = np.repeat(np.array(states)[:, None], 5, axis=1)
        if around is not None:
            runs[:, :, :2] += np.outer(t, [around.current_x, around.current_y])
        return t, runs

    def allows(self, name: str, value: float) -> bool:
        return not (name == "u" and value < -0.3 * U)


def test_both_sides_are_tried_with_sway_turn_rudder_and_all_together() -> None:
    """Seven motions at each speed; the other side is the same with sway, turn and rudder the other way."""
    p = Asked(ahead=(1.0,), astern=(-0.5,))
    found = list(body.sides(p))  # type: ignore[arg-type]
    (straight, _, _), (here, orders, _), (there, mirrored, _) = p.points
    aside = [(0.2, 0.0, 0.0), (0.4, 0.0, 0.0), (0.0, 0.4, 0.0), (-0.2, 0.4, 0.0), (0.0, 0.0, 0.3), (0.0, 0.0, 1.0),
             (-0.2, 0.4, 1.0)]  # fmt: skip
    wanted = [(f * U, v * f * U, r * abs(f) * U / L) for f in (-0.5, 1.0) for v, r, _ in aside]
    np.testing.assert_allclose(here, wanted)
    np.testing.assert_allclose(there, np.array(wanted) * [1.0, -1.0, -1.0])
    np.testing.assert_allclose(straight, np.array(wanted) * [1.0, 0.0, 0.0])
    np.testing.assert_allclose(orders, [(max(f, 0.0) * N_P, d * LIMIT) for f in (-0.5, 1.0) for *_, d in aside])
    np.testing.assert_allclose(mirrored, orders * [1.0, -1.0])
    assert [one.value for one in found] == [0.0, 0.0, 0.0]


def test_five_headings_are_tried_and_told_in_degrees() -> None:
    p = Asked()
    p.at = lambda motion, control, psi=0.0: np.array([[0.01 * psi * U * U / L, 0.0, 0.0]])
    (one,) = body.heading(p)  # type: ignore[arg-type]
    assert one.what == "rates by heading in calm water (315.127 deg)"
    assert one.value == pytest.approx(0.01 * 5.5)
    p = Asked()
    list(body.heading(p))  # type: ignore[arg-type]
    assert [psi for *_, psi in p.points] == [0.0, 0.7, 1.5708, 2.6, 4.0, 5.5]
    motion, control, _ = p.points[0]
    np.testing.assert_allclose(motion, [(U, 0.1 * U, 0.2 * U / L)])
    np.testing.assert_allclose(control, [(N_P, 0.5 * LIMIT)])


@pytest.mark.parametrize("rests", [True, False])
def test_a_current_of_three_tenths_of_the_speed_is_tried_to_five_sides(rests: bool) -> None:
    """Each run of four lengths begins with the water's own speed added; one at rest goes with it."""
    p = Asked(rests=rests)
    found = list(body.current(p))  # type: ignore[arg-type]
    assert [one.value for one in found] == pytest.approx([0.0] * (1 + rests), abs=1e-12)
    assert {duration for *_, duration, _ in p.drifts} == {4.0 * L / U}
    begin = np.array([0.0, 0.0, 0.0, U, 0.05 * U, 0.1 * U / L])
    np.testing.assert_allclose(p.drifts[0][0], [begin])
    assert p.drifts[0][3] is None
    moving = p.drifts[1 :: 1 + rests]
    for (states, control, _, around), degrees in zip(moving, (0.0, 90.0, 180.0, 270.0, 45.0), strict=True):
        way = 0.3 * U * np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])
        np.testing.assert_allclose(states[0], begin + np.array([0.0, 0.0, 0.0, *way, 0.0]), atol=1e-12)
        np.testing.assert_allclose(control, [(N_P, 0.5 * LIMIT)])
        assert (around.current_x, around.current_y) == pytest.approx(tuple(way), abs=1e-12)
        assert (around.wind_x, around.wind_y) == pytest.approx(tuple(-way), abs=1e-12)
    assert list(body.current(Asked(sways=False))) == []  # type: ignore[arg-type]


def test_a_ship_that_a_current_carries_twice_is_off_by_its_way() -> None:
    p = Asked()
    carried = p.drift

    def twice(states: Any, controls: Any, duration: float, around: Any = None) -> Any:
        t, runs = carried(states, controls, duration, around)
        if around is not None:
            runs[:, :, :2] += np.outer(t, [around.current_x, around.current_y])
        return t, runs

    p.drift = twice
    turn, adrift = body.current(p)  # type: ignore[arg-type]
    assert turn.value == pytest.approx(0.3 * 4.0)  # along one axis
    assert adrift.value == pytest.approx(0.3 * 4.0)


@pytest.mark.parametrize(("reverses", "astern", "lowest"), [(True, (-0.25,), -1.0), (False, (-0.25,), 0.3),
                                                            (True, (), 0.3)])  # fmt: skip
def test_twenty_five_steady_orders_are_held_over_sixty_lengths(reverses: bool, astern: Any, lowest: float) -> None:
    p = Asked(reverses=reverses, astern=astern)
    found, plot = plausible._under_orders(p)  # type: ignore[arg-type]
    ((states, controls, duration, _),) = p.drifts
    assert duration == 60.0 * L / U
    np.testing.assert_allclose(states, [(0.0, 0.0, 0.0, U, 0.0, 0.0)] * 25)
    n, d = np.linspace(lowest, 1.0, 5), np.linspace(-1.0, 1.0, 5)
    np.testing.assert_allclose(controls, [(a * N_P, b * LIMIT) for a in n for b in d])
    assert [one.value for one in found] == [1.0, 0.0]
    assert len(plot.lines) == 7
    assert plot.lines[0][0] == f"{lowest:+.2f} n_P, -35 deg"
    assert plot.equal


def test_what_runs_away_is_the_fastest_in_speeds_and_turns() -> None:
    p = Asked()
    runs = np.zeros((25, 3, 6))
    runs[3, 1, 3:6] = 3.0 * U, 4.0 * U, -0.8 * U / L
    p.drift = lambda states, controls, duration: (np.arange(3.0), runs)
    fastest, turning = plausible._under_orders(p)[0]  # type: ignore[arg-type]
    assert (fastest.value, turning.value) == pytest.approx((5.0, 0.8))
    runs[4, 2, 3] = math.nan
    assert plausible._under_orders(p)[0][0].value == math.inf  # type: ignore[arg-type]


@pytest.mark.parametrize(("least", "lowest"), [(-1.0, -0.5), (-0.4, 0.5)])
def test_motion_is_left_alone_from_twenty_four_starts(
    monkeypatch: pytest.MonkeyPatch, least: float, lowest: float
) -> None:
    p = Asked(allows=lambda name, value: value >= least * U)
    monkeypatch.setattr(plausible, "motion", lambda probe, runs: np.column_stack([np.full(24, 2.0), np.arange(24.0)]))
    (one,) = plausible._left_alone(p)  # type: ignore[arg-type]
    assert one.value == pytest.approx(23.0 / 2.0)
    ((states, controls, duration, _),) = p.drifts
    assert (len(states), duration) == (24, 20.0 * L / U)
    assert not controls.any()
    drawn = np.random.default_rng(1).uniform((lowest, -1.0, -1.0), 1.0, (24, 3))
    np.testing.assert_allclose(states[:, 3:], drawn * [U, 0.2 * U, 0.2 * U / L])
    (stopped,) = plausible._left_alone(Asked(stops=False))  # type: ignore[arg-type]
    assert stopped.what.startswith("motion left 20 L/U after the engines stop: not applicable")


def test_a_push_at_rest_is_over_the_square_of_the_speed_and_the_length() -> None:
    p = Asked()
    p.at = lambda motion, control: np.array([[0.1, -0.3, 0.004]])
    (one,) = plausible._by_itself(p)  # type: ignore[arg-type]
    assert one.value == pytest.approx(0.3 * L / U**2)
    p.at = lambda motion, control: np.array([[0.1, 0.0, -0.04]])
    (one,) = plausible._by_itself(p)  # type: ignore[arg-type]
    assert one.value == pytest.approx(0.04 * L * L / U**2)
    assert list(plausible._by_itself(Asked(rests=False))) == []  # type: ignore[arg-type]


def test_a_step_is_tried_over_fifteen_lengths_against_a_quarter_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tracks that part by a hundredth of a length per length, and a stop only where the ship has one."""
    asked: list[Any] = []

    def runs(orders: Any, duration: float, dt: float) -> None:
        asked.extend((n, delta, duration, dt) for n, delta in orders)

    def run(n: float, delta: float, duration: float, dt: float) -> Trial:
        assert (n, delta, duration, dt) in asked, "all of one step were made at once"
        t = np.arange(0.0, duration + 0.5 * dt, dt)
        off = 0.01 * U * t if dt == 1.0 else 0.0 * t
        return Trial("run", t, {"x": U * t, "y": off})

    monkeypatch.setattr(scopes, "fastest", lambda ship: 0.25)
    p = Asked(step=1.0, run=run, runs=runs)
    p.ship.model = object()
    found = scopes._step(p)  # type: ignore[arg-type]
    assert {one[2:] for one in asked} == {(15.0 * L / U, 1.0), (15.0 * L / U, 0.25)}
    for dt in (1.0, 0.25):
        assert [one[:2] for one in asked if one[3] == dt] == [(N_P, LIMIT), (N_P, -LIMIT), (-N_P, 0.0)]
    evidence = found.evidence
    assert evidence["in time of one ship length"][0] == pytest.approx(U / L)
    assert evidence["step times fastest motion"][0] == 0.25
    for name in ("a hard turn to starboard", "a hard turn to port", "a crash stop"):
        assert evidence[f"track error of {name} over 15 L/U"][0] == pytest.approx(0.15)
    (plot,) = found.plots
    for _, x, y in plot.lines:
        assert x[-1] == pytest.approx(15.0)
        np.testing.assert_allclose(y, 0.01 * x)
    asked.clear()
    p = Asked(step=1.0, run=run, runs=runs, astern=())
    p.ship.model = object()
    scopes._step(p)  # type: ignore[arg-type]
    assert len(asked) == 4


# --- what a probe says of a ship ---


def test_speeds_that_are_tried_are_those_that_the_file_claims() -> None:
    law = lambda m: (m.n - m.u, -m.v, -m.r)  # noqa: E731
    whole = plain(law)
    assert (whole.ahead, whole.astern, whole.rests) == ((0.1, 0.25, 0.5, 0.75, 1.0), (-0.1, -0.25, -0.5), True)
    some = plain(law, file={"u": (0.25 * U, 0.75 * U)})
    assert (some.ahead, some.astern, some.rests) == ((0.25, 0.5, 0.75), (), False)
    assert plain(law, file={"u": (2.0 * U, 3.0 * U)}).ahead == (1.0,)
    assert plain(law, file={"u": (-0.3 * U, U)}).astern == (-0.1, -0.25)
    assert whole.unit_time == L / U
    assert (whole.allows("u", 9.0), some.allows("u", 0.75 * U), some.allows("u", 0.76 * U)) == (True, True, False)


def test_whether_a_ship_sways_and_can_be_stopped_is_seen_in_its_rates() -> None:
    assert plain(lambda m: (m.n - m.u, -m.v, -m.r)).stops
    assert not plain(lambda m: (-m.u, -m.v, -m.r)).stops
    assert plain(lambda m: (m.n, -m.v, 0.0 * m.r)).sways
    assert plain(lambda m: (m.n, 0.3 * m.r, 0.0 * m.r)).sways
    assert plain(lambda m: (m.n, 0.3 * m.d, 0.0 * m.r)).sways
    assert not plain(lambda m: (m.n - m.u, 0.0 * m.v, m.d - m.r)).sways


def test_a_run_is_made_once_and_that_of_another_order_or_step_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    p = Probe(load("kvlcc2"), 7.97, 1.7, dt=1.0)
    first = p.run(1.7, 0.3, 20.0)
    assert p.run(1.7, 0.3, 20.0) is first
    for other in (p.run(1.7, -0.3, 20.0), p.run(1.7, 0.3, 20.0, speed=4.0), p.run(1.7, 0.3, 20.0, dt=0.5),
                  p.sail([(1.7, 0.3)], 20.0, 7.97, 1.0)[0]):  # fmt: skip
        assert other is not first
    assert len(p.made) == 4


@pytest.mark.slow
def test_runs_that_are_made_at_once_are_those_that_are_made_alone() -> None:
    ship = load("esso_osaka_3m_harbour")
    p = Probe.of(ship)
    orders = [(p.n_P, 0.3), (-p.n_P, -0.5), (0.5 * p.n_P, 0.0)]
    for order, found in zip(orders, p.runs(orders, 20.0, speed=0.3), strict=True):
        alone = simulate(replace(ship, validity={}), Held(p.n_P, *order), speed=0.3, duration=20.0, dt=p.step)
        assert isinstance(found, Trial)
        assert found.meta == alone.meta
        assert set(found.channels) == set(alone.channels)
        for name in found.channels:
            np.testing.assert_allclose(found[name], alone[name], rtol=1e-9, atol=1e-12, err_msg=name)


@pytest.mark.slow
def test_a_run_that_blows_up_is_told_beside_one_that_does_not_and_is_not_made_again() -> None:
    """Yaw that feeds itself blows up once it is stirred, and straight ahead it is not."""
    ship = load("kvlcc2")
    fed = {"hull.N_r": 0.9, "hull.N_rrr": 0.9}
    p = Probe(replace(ship, model=update(ship.model, fed)), 7.97, 1.7, dt=1.0)
    stands, gone = p.runs([(1.7, 0.0), (1.7, 0.2)], 60.0)
    assert isinstance(stands, Trial)
    assert isinstance(gone, SimulationError)
    assert "blows up" in str(gone)
    with pytest.raises(SimulationError) as told:
        p.run(1.7, 0.2, 60.0)
    assert told.value is gone
    assert p.run(1.7, 0.0, 60.0) is stands


def test_a_cause_is_said_once_and_referred_to_by_the_number_of_its_item() -> None:
    def row(number: str, verdict: Any, reason: str) -> Any:
        return Item(number, "", lambda p: None), Judgement(verdict, reason)  # type: ignore[arg-type, return-value]

    rows = [row("1", "fail", "a run of this item blows up: r at t = 3 s"), row("2", "pass", "fine"),
            row("3", "pass", "fine"), row("4", "fail", "a run of this item blows up: u at t = 7 s"),
            row("5", "doubt", "unusual: 3"), row("6", "doubt", "unusual: 3"), row("7", "doubt", "unusual: 4"),
            row("8", "not judged", "not run: too quick"), row("9", "not judged", "not run: too quick")]  # fmt: skip
    assert [found.reason for _, found in scopes._said_once(rows)] == [
        "a run of this item blows up: r at t = 3 s", "fine", "fine", "a run of this item blows up, as item 1",
        "unusual: 3", "for the reason of item 5", "unusual: 4", "not run: too quick", "not run, as item 8",
    ]  # fmt: skip


def test_long_steps_under_held_orders_end_where_short_ones_do() -> None:
    """RK4 at a 25th of L/U: its error of the first 3 L/U of a turn is far below what any item looks at."""
    p = Probe.of(load("kvlcc2"))
    assert 9.0 * p.step < p.long_step < 0.041 * p.unit_time
    states, orders = [p.state(p.U), p.state(0.3 * p.U, 0.3 * p.U, 0.02)], [p.controls(p.n_P, 0.5)] * 2
    (t, coarse), (other, fine) = (one.drift(states, orders, 75 * p.long_step)
                                  for one in (p, replace(p, dt=p.long_step / 4.0)))  # fmt: skip
    assert t[-1] == pytest.approx(other[-1], rel=1e-12)
    assert np.abs(coarse[:, -1, 5]).min() > 1e-4 / p.unit_time
    assert np.abs(coarse[:, -1, 3:] - fine[:, -1, 3:]).max() < 1e-6 * p.U
    arx = Probe(load("kvlcc2_l7_arx"), 1.179, 10.4)
    assert arx.long_step == arx.step, "a model in discrete time has its own"


def test_turns_go_on_from_the_angle_between_the_last_that_ends_and_the_first_that_does_not() -> None:
    angles = np.array([-0.2, -0.1, 0.0, 0.1])
    assert hull._bracket(np.array([False, False, True, True]), angles) == (-0.1, 0.0)
    assert hull._bracket(np.array([True, True, True, True]), angles) == (-0.2, -0.2)
    assert hull._bracket(np.zeros(4, dtype=bool), angles) == (math.inf, math.inf)
