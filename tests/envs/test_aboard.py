"""What an agent orders and sees aboard a ship: ranges of the controls, shares of them, draws of wind and parameters."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import read
from seatrial.environment import CALM
from seatrial.envs import Berth, Course, TaskError
from seatrial.envs.episodes import Fleet, Settings, uniform, work_of
from seatrial.envs.system import ranges_of
from seatrial.ships.files import load
from seatrial.simulate.approach import approach, fastest

SHIP = load("kvlcc2_l7")
HARD = math.radians(35.0)


def test_an_action_goes_from_end_to_end_and_the_rest_holds_the_approach() -> None:
    work, n_P = work_of(SHIP, Course(), Settings()), approach(SHIP)[1]
    at = SHIP.model.controls.index("delta")
    for action, delta in ((-1.0, -HARD), (0.0, 0.0), (0.5, 0.5 * HARD), (1.0, HARD), (3.0, HARD)):
        orders = work.ordered((action,))
        assert orders[at] == pytest.approx(delta, abs=1e-12)
        assert orders[1 - at] == pytest.approx(n_P)
    assert work.turns == pytest.approx(n_P)
    both = work_of(load("twin_virtual"), Course(), Settings())
    told = dict(zip(both.ship.model.controls, both.ordered((0.4,)), strict=True))
    assert told["delta_1"] == told["delta_2"] == pytest.approx(0.4 * both.orders[0].high)
    assert told["n_P_1"] == told["n_P_2"] == pytest.approx(both.turns)


def test_a_range_is_that_of_the_actuator_else_of_the_validity_else_the_usual() -> None:
    assert ranges_of(SHIP, 3.0)["delta"] == pytest.approx((-HARD, HARD))
    bare = load("twin_virtual")
    assert ranges_of(bare, -3.0)["n_P_1"] == (-3.0, 3.0)
    told = replace(bare, validity={**bare.validity, "n_P_1": (-1.0, 2.0)})
    assert ranges_of(told, 3.0)["n_P_1"] == (-1.0, 2.0)
    with pytest.raises(TaskError, match="n_P has no limits"):
        work_of(load("mariner"), Berth(), Settings())


def test_time_between_actions_is_a_25th_of_a_length_and_its_steps_suit_the_fastest_motion() -> None:
    work = work_of(SHIP, Course(), Settings())
    wanted = SHIP.L_pp / (25.0 * SHIP.speed)
    assert 0.4 * wanted <= work.scale.period <= wanted
    assert (SHIP.L_pp, SHIP.speed) == (work.scale.L, work.scale.U)
    assert work.scale.lengths == pytest.approx(work.scale.period * SHIP.speed / SHIP.L_pp)
    for period in (0.1, 40.0):
        own = work_of(SHIP, Course(), Settings(period=period))
        assert period / own.dt == pytest.approx(max(2, math.ceil(fastest(SHIP) * period / 0.5)))
    assert work_of(SHIP, Course(), Settings(period=1.0, steps=7, limit=9)).dt == pytest.approx(1.0 / 7.0)
    assert work_of(SHIP, Course(), Settings(limit=9)).limit == 9


def judged(work: Any, state: Any, control: Any = (0.0, 0.0), current: float = 0.0) -> Any:
    around = CALM._replace(current_x=current)
    return work.judged(tuple(state), control, around, (0.0,), ())


def test_a_moment_is_seen_within_its_ranges_with_what_the_actuators_do() -> None:
    work = work_of(SHIP, Course(), Settings())
    at = SHIP.model.controls.index("delta")
    control = [0.0, 0.0]
    control[at] = 0.5 * HARD
    plain = judged(work, (0, 0, 0.2, SHIP.speed, 0, 0), control)
    assert len(plain.seen) == len(work.seen) == 5 + 2
    assert plain.seen[5 + at] == pytest.approx(0.5)
    assert plain.reward == pytest.approx(-(0.04 + 0.1 * 0.25) * work.scale.lengths)  # the rudder only: it steers
    assert judged(work, (0, 0, 0.2, 5.0 * SHIP.speed, 0, 0)).seen[2] == 3.0
    assert judged(work, (0, 0, 0.2, math.nan, 0, 0)).over == 1.0
    narrow = replace(work, ship=replace(SHIP, validity={"u": (0.0, 1.0)}))
    for u, current, over in ((1.1, 0.0, 1.0), (1.1, 0.2, 0.0), (0.9, -0.2, 1.0), (0.9, 0.0, 0.0)):
        assert judged(narrow, (0, 0, 0.0, u, 0, 0), (0.0, 0.0), current).over == over  # through the water
    assert judged(replace(work, task=Course(lost=1e9)), (0, 0, 3.0, 1.0, 0, 0)).reward == -1e3


@pytest.mark.slow
def test_episodes_differ_evenly_by_wind_current_and_parameters() -> None:
    ship = load("esso_osaka_3m")
    settings = Settings(wind=(0.5, 1.5), current=(0.1, 0.2), randomise={"hull.Y_v": 0.1, "hull.N_r": 0.3})
    fleet = Fleet.of(ship, Course(), settings)
    assert fleet.draws == 4 + 2 + 2
    begun = fleet.begin(np.random.default_rng(1).random((4000, fleet.draws)))
    for k, (low, high) in ((0, settings.wind), (2, settings.current)):
        size = np.hypot(begun.around[:, k], begun.around[:, k + 1])
        assert np.quantile(size, [0.0, 0.5, 1.0]) == pytest.approx([low, 0.5 * (low + high), high], abs=0.03 * high)
        way = np.arctan2(begun.around[:, k + 1], begun.around[:, k])
        assert np.histogram(way, 4, (-math.pi, math.pi))[0].min() > 900
    assert not begun.around[:, 4:].any()
    for k, (name, share) in enumerate(settings.randomise.items()):
        own = begun.own[:, fleet.free.index(f"ship.{name}") if f"ship.{name}" in fleet.free else k]
        value = float(read(ship.model, name))
        ends = sorted((value * (1.0 - share), value * (1.0 + share)))
        assert np.quantile(own, [0.0, 0.5, 1.0]) == pytest.approx([ends[0], value, ends[1]], abs=0.02 * abs(value))
    psi = begun.state[:, 2]
    u = begun.state[:, 3] - begun.around[:, 2] * np.cos(psi) - begun.around[:, 3] * np.sin(psi)
    v = begun.state[:, 4] - begun.around[:, 3] * np.cos(psi) + begun.around[:, 2] * np.sin(psi)
    assert u == pytest.approx(ship.speed)
    assert v == pytest.approx(0.0, abs=1e-12)
    assert (begun.goal.shape, fleet.steps) == ((4000, 1), round(fleet.work.scale.period / fleet.work.dt))


def test_draws_depend_on_seed_episode_and_place_alone() -> None:
    """SplitMix64 of a zero state gives e220a8397b1dcdaf first (Steele, Lea and Flood 2014, as in public codes)."""
    one = uniform(np.array([3], np.uint64), np.array([5], np.uint64), 9)[0]
    many = uniform(np.array([1, 3, 3], np.uint64), np.array([5, 5, 6], np.uint64), 4)
    assert (many[1] == one[:4]).all()
    assert np.unique(np.concatenate([many.ravel(), one[4:]])).size == 12 + 5
    mask = 2**64 - 1

    def mixed(z: int) -> int:
        z = (z + 0x9E3779B97F4A7C15) & mask
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        return z ^ (z >> 31)

    assert mixed(0) == 0xE220A8397B1DCDAF
    key = mixed(mixed(3) ^ 5)
    assert one.tolist() == [(mixed(key ^ mixed(k)) >> 11) * 2.0**-53 for k in range(9)]
