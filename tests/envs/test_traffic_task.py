"""The task among traffic: its verdicts are those of encounters sailed otherwise; a task as Gymnasium has them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import seatrial.envs as envs
import seatrial.envs.traffic as module
from seatrial.core.errors import RequestError, TaskError
from seatrial.encounters.conduct import Orders, Scene
from seatrial.encounters.learning import MOST, SIZE
from seatrial.encounters.meeting import Meeting
from seatrial.encounters.rules import Role, judge
from seatrial.encounters.sailing import Sea, sail
from seatrial.encounters.sensing import Sensing
from seatrial.envs.traffic import BROKEN, CONTACT, KEPT, OFF, EncounterVectorEnv
from seatrial.ships.files import load


def episode(some: EncounterVectorEnv, course: float, seed: int = 3) -> tuple[np.ndarray, Any]:
    """Sum of the rewards of a course that is held, and what is told at the end."""
    some.reset(seed=seed)
    total, over, info = np.zeros(some.num_envs), np.zeros(1, dtype=bool), {}
    while not over.any():
        _, reward, _, over, info = some.step(np.tile([course, 1.0], (some.num_envs, 1)))
        total += reward
    return total, info["broken"]


@pytest.mark.slow
def test_its_verdicts_are_those_of_the_same_encounters_sailed_and_judged() -> None:
    some = EncounterVectorEnv("kvlcc2_l7", 6, roles=("give-way", "stand-on"), traffic=("ignores", "rules"))
    reward, broken = episode(some, 0.3)
    first = int(np.random.default_rng(3).integers(2**31))

    class Turned:
        def look(self, scene: Scene) -> Orders:
            return Orders(np.full(6, 0.3 * MOST), np.ones(6))

    sea = Sea(some._sea.duration, 1.5)  # 10 s by the root of 7/300
    assert sea.duration == pytest.approx(2.2 * 1200.0 * (7.0 / 300.0) ** 0.5, abs=3.0)
    found = sail(load("kvlcc2_l7"), some.meeting, sea, lambda _: Turned(), ("ignores", "rules"), first)
    own = judge(found.tracks, own=True)
    for k in range(6):
        rules = {rule for one in own for rule in one.broken((k,))}
        touched = any(bool(one.contact[k]) for one in own)
        assert set(broken[k]) - {"contact"} == rules
        assert ("contact" in broken[k]) == touched
        wanted = 0.3 * OFF + (BROKEN * len(rules) if broken[k] else KEPT) + CONTACT * touched
        assert reward[k] == pytest.approx(wanted)


@pytest.mark.slow
def test_who_does_not_give_way_is_punished_and_a_seed_is_an_episode() -> None:
    some = EncounterVectorEnv("kvlcc2_l7", 4, traffic=("ignores",))
    straight, broken = episode(some, 0.0)
    assert all("16" in one and "contact" in one for one in broken)
    assert (straight <= CONTACT + 3 * BROKEN).all()
    first = some.meeting.x.copy()
    again, _ = episode(some, 0.0)
    assert (again == straight).all()
    assert (some.meeting.x == first).all()
    seen, reward, ended, cut, _ = some.step(np.zeros((4, 2)))  # begins the next episode, and is not obeyed
    assert (seen.shape, reward.any(), ended.any(), cut.any()) == ((4, SIZE), False, False, False)
    assert (some.meeting.x != first).any()
    away, _ = episode(some, 0.5)
    assert away.mean() > straight.mean()


@pytest.mark.slow
def test_without_sensors_nobody_is_seen() -> None:
    blind = EncounterVectorEnv("kvlcc2_l7", 2, sensing=Sensing())
    assert not blind.reset(seed=1)[0][:, 4:].any()
    assert EncounterVectorEnv("kvlcc2_l7", 2).reset(seed=1)[0][:, 4].all()


@pytest.mark.slow
def test_it_is_an_environment_of_gymnasium() -> None:
    one: Any = gymnasium.make(envs.AMONG, ship="kvlcc2_l7", period=90.0)
    check_env(one.unwrapped, skip_render_check=True)
    over, info = False, {}
    one.reset(seed=2)
    while not over:
        seen, _, ended, over, info = one.step(np.zeros(2, dtype=np.float32))
        assert seen.shape == (SIZE,)
        assert not ended
    assert isinstance(info["broken"], tuple)
    many: Any = gymnasium.make_vec(envs.AMONG, num_envs=3, ship="kvlcc2_l7")
    assert many.reset(seed=1)[0].shape == (3, SIZE)


@pytest.mark.slow
def test_ships_are_drawn_from_a_posterior(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[int, int]] = []

    def draws(count: int, seed: int) -> np.ndarray:
        asked.append((count, seed))
        return np.linspace(0.15, 0.3, count)[:, None]

    monkeypatch.setattr(module, "posterior", lambda fit: SimpleNamespace(names=("propeller.t_P",), draws=draws))
    some = EncounterVectorEnv("kvlcc2_l7", 3, fit="run", traffic=("ignores",))
    some.reset(seed=1)
    for _ in range(10):
        some.step(np.tile([0.5, 1.0], (3, 1)))
    x = some._sailing.scene.x[:, 0]
    assert len(np.unique(np.round(x, 9))) == 3  # three ships, three ways
    some.reset(seed=2)
    assert len({seed for _, seed in asked}) == 2


@pytest.mark.slow
def test_own_ships_of_one_encounter_meet_each_other_and_are_judged_each_by_itself() -> None:
    """Two on opposite courses and a third that keeps on: who holds on breaks Rule 14; where one turns, nobody does."""
    some = EncounterVectorEnv("kvlcc2_l7", 6, own=2, roles=("head-on", "give-way"), traffic=("ignores",))
    total, broken = episode(some, 0.0)
    met = some.meeting
    assert met.x.shape == (6, 2)
    assert met.U_target[:, 0] == pytest.approx(np.full(6, met.U[0]))  # the other own ship has its speed
    assert (met.roles[:, 0] == Role.HEAD_ON).all()
    assert all("14" in one and "contact" in one for one in broken)
    x, y = some._sailing.scene.x, some._sailing.scene.y
    for k in range(0, 6, 2):  # both runs of an encounter have the same three ships
        assert (x[k, [1, 0, 2]] == x[k + 1]).all()
        assert (y[k, [1, 0, 2]] == y[k + 1]).all()
    seen, _ = some.reset(seed=3)
    assert seen[:, 4:22].any(axis=1).all()
    total, over, info = np.zeros(6), np.zeros(1, dtype=bool), {}
    while not over.any():
        turned = np.tile([[0.4, 1.0], [0.0, 1.0]], (3, 1))  # the first of each turns
        seen, reward, _, over, info = some.step(turned)
        total += reward
    assert all(one == () for one in info["broken"])  # the other one is relieved before the deadline
    assert total[::2] == pytest.approx(np.full(3, KEPT + 0.4 * OFF))
    assert total[1::2] == pytest.approx(np.full(3, KEPT))


@pytest.mark.slow
def test_an_own_ship_sails_as_it_does_alone() -> None:
    """Who is beside it changes what is seen of it, not how it moves: the same orders from its own start."""
    some = EncounterVectorEnv("kvlcc2_l7", 2, own=2, roles=("give-way",), traffic=("ignores",))
    some.reset(seed=8)
    for _ in range(6):
        some.step(np.array([[0.3, 1.0], [-0.2, 0.0]]))
    kept = np.stack(some._kept, axis=-1)
    start = kept[:3, 1, 0, 0]
    away = Meeting(some.meeting.U[1:], *(np.array([[one]]) for one in (-1e6, 0.0, 3.0, 1.0)))

    class Turned:
        def look(self, scene: Scene) -> Orders:
            return Orders(np.array([start[2] - 0.2 * MOST]), np.array([0.75]))

    alone = sail(load("kvlcc2_l7"), away, Sea(18.0, 1.5, start=start[None]), lambda _: Turned(), ("ignores",)).tracks
    assert kept[:2, 1, 0] == pytest.approx(np.array([alone.x[0, 0], alone.y[0, 0]]), abs=1e-6)
    assert (kept[:, 0, 1] == kept[:, 1, 0]).all()  # as the first one sees it


@pytest.mark.slow
def test_one_ship_that_leaves_its_model_ends_the_evidence_of_its_encounter() -> None:
    ship = load("kvlcc2_l7")
    slow = replace(ship, validity={"u": (0.9 * ship.speed, 2.0 * ship.speed)})
    some = EncounterVectorEnv(slow, 4, own=2, roles=("give-way",), traffic=("ignores",))
    some.reset(seed=1)
    over, info = np.zeros(1, dtype=bool), {}
    while not over.any():
        _, _, _, over, info = some.step(np.array([[0.0, 1.0], [0.0, -1.0], [0.0, 1.0], [0.0, 1.0]]))
    assert [one is None for one in info["broken"]] == [True, True, False, False]


@pytest.mark.slow
def test_what_it_cannot_be_is_refused() -> None:
    for own, ships, said in ((2, 3, "multiple of own"), (0, 2, "from 1 on"), (3, 3, "2 roles at least")):
        with pytest.raises(TaskError, match=said):
            EncounterVectorEnv("kvlcc2_l7", ships, own=own)
    with pytest.raises(RequestError, match="no encounter of overtaking"):
        EncounterVectorEnv("kvlcc2_l7", 2, own=2, roles=("overtaking",)).reset(seed=1)
    for period in (0.0, 20.0, -3.0):
        with pytest.raises(TaskError, match=r"whole number of 1\.5 s"):
            EncounterVectorEnv("kvlcc2_l7", 2, period=period)
    with pytest.raises(RequestError, match="head"):
        EncounterVectorEnv("kvlcc2_l7", 2, roles=("ahead",))
    with pytest.raises(TaskError, match="call reset first"):
        EncounterVectorEnv("kvlcc2_l7", 2).step(np.zeros((2, 2)))
    some = EncounterVectorEnv("kvlcc2_l7", 2)
    for wrong in (np.zeros((2, 3)), np.full((2, 2), np.nan)):
        with pytest.raises(ValueError, match="finite ones are taken"):
            some.step(wrong)
