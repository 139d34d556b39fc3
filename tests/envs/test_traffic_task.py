"""The task among traffic: its verdicts are those of encounters sailed otherwise; a task as Gymnasium has them."""

from __future__ import annotations

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
from seatrial.encounters.rules import judge
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

    sea = Sea(some._sea.duration, 10.0)
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
    one: Any = gymnasium.make(envs.AMONG, ship="kvlcc2_l7", period=600.0)
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
def test_what_it_cannot_be_is_refused() -> None:
    for period in (0.0, 15.0, -20.0):
        with pytest.raises(TaskError, match="whole number of 10 s"):
            EncounterVectorEnv("kvlcc2_l7", 2, period=period)
    with pytest.raises(RequestError, match="head"):
        EncounterVectorEnv("kvlcc2_l7", 2, roles=("ahead",))
    with pytest.raises(TaskError, match="call reset first"):
        EncounterVectorEnv("kvlcc2_l7", 2).step(np.zeros((2, 2)))
    some = EncounterVectorEnv("kvlcc2_l7", 2)
    for wrong in (np.zeros((2, 3)), np.full((2, 2), np.nan)):
        with pytest.raises(ValueError, match="finite ones are taken"):
            some.step(wrong)
