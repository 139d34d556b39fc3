"""Environments: what Gymnasium asks of them, what physics does, and that lanes are strangers to each other."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from seatrial.engine import rollout
from seatrial.environment import CALM
from seatrial.envs import IDS, Berth, Course, ShipEnv, ShipVectorEnv, TaskError, Track
from seatrial.envs.episodes import Settings, uniform
from seatrial.envs.lanes import Lanes
from seatrial.envs.tasks import Scale
from seatrial.realtime.plant import Plant
from seatrial.ships.files import load

DEGREE = math.pi / 180.0


def vector(id: str, ships: int = 20, **settings: Any) -> Any:
    return gymnasium.make_vec(id, num_envs=ships, **settings)


@pytest.mark.slow
@pytest.mark.parametrize("id", IDS)
def test_gymnasium_finds_nothing_wrong(id: str) -> None:
    check_env(gymnasium.make(id, render_mode="rgb_array").unwrapped)


@pytest.mark.slow
@pytest.mark.parametrize("id", IDS)
def test_a_picture_shows_ship_track_and_task(id: str) -> None:
    env = gymnasium.make(id, render_mode="rgb_array")
    env.reset(seed=3)
    env.action_space.seed(0)
    for _ in range(20):
        env.step(env.action_space.sample())
    picture = np.asarray(env.render())
    assert (picture.shape, picture.dtype) == ((400, 400, 3), np.uint8)
    hull = np.argwhere((picture == (0, 107, 164)).all(axis=2))
    assert np.allclose(hull.mean(axis=0), 200.0, atol=4.0)  # in the middle
    plain = env.unwrapped.lanes  # type: ignore[attr-defined]
    psi, L = float(plain.value("psi")[0]), 400.0 / 14.0
    along = (200.0 - hull[:, 0]) * math.cos(psi) + (hull[:, 1] - 200.0) * math.sin(psi)
    assert np.ptp(along) == pytest.approx(L, abs=2.5)  # north is up, and the bow where the heading is
    assert (picture == (217, 95, 2)).all(axis=2).any()
    assert gymnasium.make(id).unwrapped.render() is None
    with pytest.raises(TaskError, match="render_mode is 'human'"):
        ShipEnv("kvlcc2_l7", Course(), render_mode="human")


@pytest.mark.slow
@pytest.mark.parametrize("id", IDS)
def test_the_vector_is_the_single_one_many_times(id: str) -> None:
    envs, env = vector(id), gymnasium.make(id)
    many, _ = envs.reset(seed=11)
    one, _ = env.reset(seed=14)
    assert np.array_equal(one, many[3])
    assert envs.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    envs.action_space.seed(0)
    for _ in range(30):
        actions = envs.action_space.sample()
        seen, reward, over, cut, _ = envs.step(actions)
        alone = env.step(actions[3])
        assert np.array_equal(alone[0], seen[3])
        assert alone[1:4] == (reward[3], over[3], cut[3])
        assert seen in envs.observation_space
        assert not over[3]


def test_the_plant_is_that_of_everywhere() -> None:
    """The same orders give the same ship in the real-time plant, to rounding."""
    env = ShipEnv("kvlcc2_l7", Course(), current=(0.1, 0.1))
    env.reset(seed=2)
    lanes = env.lanes
    start = tuple(float(lanes.value(name)[0]) for name in ("x", "y", "psi", "u", "v_m", "r"))
    plant = Plant.of(load("kvlcc2_l7"), dt=lanes.work.dt, start=start, n_P=lanes.work.turns)
    plant.surround(CALM._replace(**{f"current_{k}": float(lanes.series(f"current_{k}")[0]) for k in "xy"}))
    assert math.hypot(plant["current_x"], plant["current_y"]) == pytest.approx(0.1)
    for k in range(50):
        action = np.array([math.sin(0.1 * k)], dtype=np.float32)
        plant.order("delta", float(action[0]) * 35.0 * DEGREE)
        env.step(action)
        for _ in range(round(lanes.work.scale.period / lanes.work.dt)):
            plant.step()
        for name in ("x", "y", "psi", "u", "v_m", "r", "delta", "n_P"):
            assert lanes.value(name)[0] == pytest.approx(plant[name], rel=1e-9, abs=1e-12), name


@pytest.mark.slow
def test_steps_are_short_enough() -> None:
    """Forty times as many time steps move the ship by less than a thousandth of its length in ten lengths."""
    ends: list[np.ndarray[Any, Any]] = []
    for steps in (None, 80):
        env = ShipEnv("kvlcc2", Course(off=math.inf), steps=steps)
        env.reset(seed=1)
        for k in range(400):
            env.step(np.array([0.4 if k % 200 < 100 else -0.4], dtype=np.float32))
        ends.append(np.array([env.lanes.value(n)[0] for n in ("x", "y")]))
    assert np.hypot(*(ends[1] - ends[0])) < 1e-3 * 320.0


@pytest.mark.slow
def test_seeds_and_lanes() -> None:
    envs = vector("seatrial/Track-v0", 20, current=(0.0, 0.2), randomise={"hull.Y_v": 0.2, "hull.N_v": 0.2})
    fewer = vector("seatrial/Track-v0", 5, current=(0.0, 0.2), randomise={"hull.Y_v": 0.2, "hull.N_v": 0.2})
    first, again, few = envs.reset(seed=4)[0], envs.reset(seed=4)[0], fewer.reset(seed=4)[0]
    assert np.array_equal(first, again)
    assert np.array_equal(first[:5], few)
    assert len({tuple(row) for row in first.tolist()}) == 20
    assert not np.array_equal(envs.reset()[0], first)
    swapped = fewer.reset(seed=[8, 4, 5, 6, 7])[0]
    assert np.array_equal(swapped[1:], few[:4])


def test_draws_are_even() -> None:
    draws = uniform(np.arange(400, dtype=np.uint64), np.zeros(400, dtype=np.uint64), 25)
    assert draws.min() >= 0.0
    assert draws.max() < 1.0
    counts = np.histogram(draws, 20, (0.0, 1.0))[0]
    assert np.sum((counts - 500.0) ** 2 / 500.0) < 43.8  # chi square, 19 degrees of freedom, 99.9 %
    assert abs(np.corrcoef(draws.T)[0, 1]) < 0.2


@pytest.mark.slow
def test_wind_current_and_parameters_differ_within_their_ranges() -> None:
    lanes = Lanes(load("kvlcc2_l7"), Course(), 200, Settings(current=(0.1, 0.3), randomise={"hull.Y_v": 0.1}))
    lanes.seed(np.arange(200, dtype=np.uint64))
    lanes.reset()
    size = np.hypot(lanes.series("current_x"), lanes.series("current_y"))
    assert 0.1 <= size.min() < 0.12
    assert 0.28 < size.max() <= 0.3
    psi, u, v = (lanes.value(n) for n in ("psi", "u", "v_m"))
    through = u - lanes.series("current_x") * np.cos(psi) - lanes.series("current_y") * np.sin(psi)
    assert through == pytest.approx(lanes.work.scale.U)
    assert v == pytest.approx(lanes.series("current_y") * np.cos(psi) - lanes.series("current_x") * np.sin(psi))
    for _ in range(40):
        lanes.step(np.full((200, 1), 0.5, dtype=np.float32))
    assert np.ptp(lanes.value("r")) > 0.0
    with pytest.raises(TaskError, match=r"kvlcc2_l7.*wind"):
        Lanes(load("kvlcc2_l7"), Course(), 1, Settings(wind=(0.0, 5.0)))
    windy = Lanes(load("esso_osaka_3m"), Course(), 64, Settings(wind=(0.5, 1.0)))
    windy.seed(np.arange(64, dtype=np.uint64))
    windy.reset()
    assert np.hypot(windy.series("wind_x"), windy.series("wind_y")).min() >= 0.5


def test_an_episode_over_begins_anew_at_the_next_step() -> None:
    envs = vector("seatrial/Course-v0", 32, limit=50)
    envs.reset(seed=0)
    action = np.ones((32, 1), dtype=np.float32)
    over = np.zeros(32, dtype=bool)
    ended = 0
    for _ in range(120):
        seen, reward, terminated, truncated, _ = envs.step(action)
        assert (reward[over] == 0.0).all()
        assert np.abs(seen[over, 4]).max(initial=0.0) == 0.0  # no rate of turn at a start
        assert not (terminated & truncated).any()
        assert not (over & (terminated | truncated)).any()
        assert (reward[terminated] < -100.0).all()
        over = terminated | truncated
        ended += int(over.sum())
    assert ended > 32


def test_cut_off_at_the_limit() -> None:
    env = gymnasium.make("seatrial/Course-v0", limit=7)
    env.reset(seed=0)
    flags = [env.step(np.zeros(1, dtype=np.float32))[2:4] for _ in range(7)]
    assert flags == [(False, False)] * 6 + [(False, True)]
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.unwrapped.step(np.zeros(1, dtype=np.float32))


@pytest.mark.slow
def test_a_plain_autopilot_keeps_the_course_better_than_none() -> None:
    def total(steer: bool) -> float:
        envs = vector("seatrial/Course-v0", 64, limit=300)
        seen, _ = envs.reset(seed=5)
        paid, live = np.zeros(64), np.ones(64, dtype=bool)
        for _ in range(300):
            e, r = np.arctan2(seen[:, 0], seen[:, 1]), seen[:, 4]
            order = np.clip((-1.0 * e - 1.0 * r) / (35.0 * DEGREE), -1.0, 1.0) if steer else np.zeros(64)
            seen, reward, over, cut, _ = envs.step(order[:, None].astype(np.float32))
            paid += np.where(live, reward, 0.0)
            live &= ~(over | cut)
        if steer:
            assert np.abs(np.arctan2(seen[:, 0], seen[:, 1])).mean() < 2.0 * DEGREE
        return float(paid.mean())

    assert total(True) > 0.3 * total(False)


@pytest.mark.slow
def test_an_autopilot_on_the_line_of_sight_follows_the_track_to_its_end() -> None:
    envs = vector("seatrial/Track-v0", 64)
    seen, _ = envs.reset(seed=5)
    worst, live, arrived = np.zeros(64), np.ones(64, dtype=bool), np.zeros(64, dtype=bool)
    for _ in range(900):
        h = np.arctan2(seen[:, 1], seen[:, 2]) + np.arctan(seen[:, 0] / 2.0)
        order = np.clip((-1.5 * h - 1.5 * seen[:, 8]) / (35.0 * DEGREE), -1.0, 1.0)
        seen, reward, over, cut, _ = envs.step(order[:, None].astype(np.float32))
        arrived |= live & over & (reward > -50.0)
        worst = np.where(live, np.maximum(worst, np.abs(seen[:, 0])), worst)
        live &= ~(over | cut)
    assert arrived.all()
    assert worst.max() < 2.5


@pytest.mark.slow
def test_a_plain_law_berths_the_ship_without_a_touch() -> None:
    envs = vector("seatrial/Berth-v0", 32)
    seen, _ = envs.reset(seed=1)
    live, berthed, touched = np.ones(32, dtype=bool), np.zeros(32, dtype=bool), np.zeros(32, dtype=bool)
    for _ in range(1000):
        x, y, s, c, _, u, v, r = seen[:, :8].T.astype(float)
        psi, ahead = np.arctan2(s, c), np.clip(-0.5 * x, -0.5, 0.5)
        aside = np.clip(-0.8 * y, -0.15, 0.15) * (np.abs(x) < 0.5)
        sway, yaw = np.clip(10.0 * (aside - v), -1.0, 1.0), np.clip(-2.5 * psi - 2.0 * r, -1.0, 1.0)
        orders = (4.0 * (ahead - u) + 0.5 * ahead, yaw * np.sign(np.maximum(u, 0.02)), sway + yaw, sway - yaw)
        seen, reward, over, cut, _ = envs.step(np.clip(np.column_stack(orders), -1.0, 1.0).astype(np.float32))
        berthed |= live & over & (reward > 5.0)
        touched |= live & over & (reward < -5.0)
        live &= ~(over | cut)
    assert berthed.sum() >= 29
    assert not touched.any()


@pytest.mark.parametrize(("state", "over", "sign"), [
    ((0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 1.0, 1.0),  # berthed
    ((0.0, 0.0, 0.0, 0.1, 0.0, 0.0), 0.0, 0.0),  # there, but with way on
    ((0.0, 0.4, 0.0, 0.0, 0.1, 0.0), 1.0, -1.0),  # alongside the quay and through it
    ((-3.0, -0.2, 0.5, 0.1, 0.0, 0.0), 1.0, -1.0),  # the bow touches first
    ((-3.0, -3.0, 0.5, 0.1, 0.0, 0.0), 0.0, 0.0),
    ((-30.0, -3.0, 0.0, 0.1, 0.0, 0.0), 1.0, -1.0),  # out of the harbour
])  # fmt: skip
def test_berthed_touched_or_gone(state: tuple[float, ...], over: float, sign: float) -> None:
    said = Berth().judge(Scale(3.0, 0.5, 0.4, 0.2), state, (0.0,), (), (0.0,))
    assert said.over == over
    if over:
        assert sign * float(said.reward) > 5.0


def test_harder_contact_costs_more() -> None:
    scale, soft = Scale(3.0, 0.5, 0.4, 0.2), (0.0, 0.3, 0.0, 0.0, 0.01, 0.0)
    hard = (*soft[:4], 0.2, 0.0)
    first, second = (Berth().judge(scale, state, (0.0,), (), (0.0,)).reward for state in (soft, hard))
    assert float(second) < float(first) - 10.0


def test_port_and_starboard_are_alike() -> None:
    task, scale = Track(), Scale(7.0, 1.0, 1.2, 0.2)
    state, goal = (3.0, 2.0, 0.1, 1.0, 0.05, 0.01), (1.0, 0.0, math.cos(0.5), math.sin(0.5), 30.0)
    other, turned = (3.0, -2.0, -0.1, 1.0, -0.05, -0.01), (1.0, 0.0, math.cos(0.5), -math.sin(0.5), 30.0)
    a, b = (task.judge(scale, *case, (0.0,)) for case in ((state, (0.2,), goal), (other, (-0.2,), turned)))
    assert float(a.reward) == pytest.approx(float(b.reward))
    assert [float(v) for v in a.seen] == pytest.approx([
        v * s for v, s in zip(map(float, b.seen), (-1, -1, 1, 1, -1, 1, 1, -1, -1), strict=True)])  # fmt: skip


def aboard(ship: Any, task: Any, ships: int = 20, **settings: Any) -> Lanes:
    lanes = Lanes(load(ship) if isinstance(ship, str) else ship, task, ships, Settings(**settings))
    lanes.seed(np.arange(ships, dtype=np.uint64))
    lanes.reset()
    return lanes


@pytest.mark.slow
def test_a_current_alone_takes_no_ship_out_of_its_validity() -> None:
    """At its approach speed through 2 m/s of moving water kcs is within 0 to 14 m/s, whatever its speed over ground."""
    lanes = aboard("kcs", Course(), 64, current=(2.0, 2.0))
    assert lanes.value("u").max() > load("kcs").validity["u"][1]
    for _ in range(3):
        lanes.step(np.zeros((64, 1), dtype=np.float32))
        assert not lanes.terminated.any()


@pytest.mark.slow
def test_slow_through_the_water_is_slow_whatever_the_current_adds() -> None:
    slow = replace(load("kcs"), validity={"u": (13.0, 20.0)})
    lanes = aboard(slow, Course(), 64, current=(5.0, 5.0))
    assert lanes.value("u").max() > 13.0
    lanes.step(np.zeros((64, 1), dtype=np.float32))
    assert lanes.terminated.all()


@pytest.mark.slow
@pytest.mark.parametrize(("task", "price"), [(Course(), 100.0), (Track(), 100.0), (Berth(), 10.0)])
def test_out_of_the_models_validity_is_no_way_out(task: Any, price: float) -> None:
    narrow = replace(load("esso_osaka_3m_harbour"), validity={"r": (-1e-4, 1e-4)})
    lanes = aboard(narrow, task)
    for _ in range(20):
        lanes.step(np.full((20, len(lanes.work.orders)), 0.5, dtype=np.float32))
        assert (lanes.reward[lanes.terminated] < -0.9 * price).all()
        if lanes.terminated.all():
            return
    pytest.fail("nobody turned")


@pytest.mark.slow
def test_shafts_that_nothing_limits_work_over_the_approachs_revolutions() -> None:
    lanes = aboard("twin_virtual", Berth())
    for _ in range(20):
        lanes.step(np.full((20, 4), 0.5, dtype=np.float32))
        assert np.abs(lanes.reward).max() < 1.0
    at = [one.name for one in lanes.work.seen].index("n_P_1")
    order = lanes.work.orders[0]
    assert lanes.observation[:, at] == pytest.approx(lanes.value("n_P_1") / order.high, rel=1e-6)
    assert np.ptp(lanes.value("n_P_1")) == 0.0
    assert 0.1 < lanes.observation[0, at] < 0.6


@pytest.mark.slow
def test_no_effort_without_orders() -> None:
    """The shaft of kvlcc2_l7 runs from 0 to 20 1/s: the cost is that of running, not to be off the middle."""
    work = aboard("kvlcc2_l7", Berth()).work
    assert work.shares((0.0, 0.0)) == (0.0, 0.0)
    assert work.shares((20.0, -35.0 * DEGREE)) == pytest.approx((1.0, -1.0))
    assert work.ordered((-1.0, 0.0)) == (0.0, 0.0)
    assert work.ranges["n_P"] == (0.0, 20.0)


def test_a_blow_up_ends_the_episode_and_nothing_else() -> None:
    lanes = Lanes(load("kvlcc2_l7"), Course(), 20, Settings())
    lanes.seed(np.arange(20, dtype=np.uint64))
    lanes.reset()
    lanes._state[0, 4, 3] = np.nan
    lanes.step(np.zeros((20, 1), dtype=np.float32))
    assert lanes.terminated.tolist() == [k == 3 for k in range(20)]
    assert np.isfinite(lanes.observation).all()
    assert np.isfinite(lanes.reward).all()
    lanes.step(np.zeros((20, 1), dtype=np.float32))
    assert np.isfinite(lanes.value("v_m")).all()


@pytest.mark.slow
@pytest.mark.parametrize(("ship", "task"), [
    ("esso_osaka_3m_hybrid", Berth()), ("twin_virtual", Track()), ("milliampere", Course())])  # fmt: skip
def test_ships_of_other_kinds(ship: str, task: Any) -> None:
    env = ShipEnv(ship, task)
    seen, _ = env.reset(seed=0)
    for _ in range(20):
        seen = env.step(env.action_space.high)[0]
    assert seen in env.observation_space
    assert seen[-1] != 0.0  # its last actuator moved
    if ship == "milliampere":
        assert [(o.name, round(o.high / DEGREE)) for o in env.lanes.work.orders] == [("delta", 35)]


@pytest.mark.parametrize(("settings", "says"), [
    ({"period": 0.0}, "period"), ({"limit": 0}, "limit"), ({"current": (1.0, 0.5)}, "current"),
    ({"randomise": {"hull.Y_w": 0.1}}, "hull.Y_v"), ({"randomise": {"hull.Y_v": 1.5}}, "share"),
    ({"wind": 3}, "wind is 3"), ({"wind": (0.0, "5")}, r"wind is \(0.0, '5'\)"),
    ({"current": (0.0, math.nan)}, "current is"), ({"period": "2 s"}, "period is '2 s'"),
    ({"limit": None}, "limit is None"), ({"steps": 2.5}, "steps is 2.5"),
    ({"randomise": 0.1}, "randomise is 0.1"),
    ({"gusts": 3}, "'gusts'; near: "), ({"winds": (0.0, 3.0)}, "near: wind"), ({"task": "Course"}, "task is 'Course'"),
    ({"task": Course}, "task is"), ({"ship": 7}, "ship is 7"),
    ({"ship": "kvlcc2_l7_arx"}, "discrete time"), ({"ship": "mariner", "task": Berth()}, "n_P has no limits"),
])  # fmt: skip
def test_what_cannot_be_is_told_in_a_line(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(TaskError, match=says) as caught:
        ShipEnv(**{"ship": "kvlcc2_l7", "task": Course(), **settings})
    assert "\n" not in str(caught.value)


def test_actions_that_are_none() -> None:
    envs = ShipVectorEnv("kvlcc2_l7", Course(), 4)
    envs.reset(seed=0)
    with pytest.raises(ValueError, match=r"takes \(4, 1\)"):
        envs.step(np.zeros((4, 2), dtype=np.float32))
    with pytest.raises(ValueError, match="not finite"):
        envs.step(np.full((4, 1), np.nan, dtype=np.float32))
    with pytest.raises(TaskError, match=r"2\.5 ships on 1 threads"):
        ShipVectorEnv("kvlcc2_l7", Course(), 2.5)
    with pytest.raises(ValueError, match="2 seeds for 4 ships"):
        envs.reset(seed=[1, 2])


@pytest.mark.slow
def test_threads_and_the_virtual_machine_give_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    def run(threads: int = 1) -> Any:
        envs = ShipVectorEnv("kvlcc2_l7", Course(), 40, threads=threads)
        envs.reset(seed=3)
        return np.stack([envs.step(np.full((40, 1), 0.3, dtype=np.float32))[0] for _ in range(5)])

    plain = run()
    assert np.array_equal(run(3), plain)
    monkeypatch.setenv("SEATRIAL_CC", "none")
    rollout._notice.cache_clear()  # it is said once a process, perhaps to an earlier test
    with pytest.warns(UserWarning, match="virtual machine"):
        slow = run()
    np.testing.assert_allclose(slow, plain, atol=1e-6)


@pytest.mark.slow
def test_arrays_are_the_callers_own_unless_asked_otherwise() -> None:
    for copy in (True, False):
        envs = ShipVectorEnv("kvlcc2_l7", Course(), 4, copy=copy)
        first = envs.reset(seed=0)[0]
        assert np.shares_memory(first, envs.step(np.ones((4, 1), dtype=np.float32))[0]) is not copy


def test_without_gymnasium_the_extra_is_named() -> None:
    code = "import sys; sys.modules['gymnasium'] = None\nimport seatrial.envs"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "pip install 'seatrial[gym]'" in done.stderr.splitlines()[-1]


@pytest.mark.slow
@pytest.mark.parametrize("id", ["seatrial/Course-v0", "seatrial/Track-v0"])
def test_episodes_that_begin_in_the_same_step_are_those_of_single_ships(id: str) -> None:
    """Gymnasium's own vector of single environments, over several ends of episodes, cut off and over."""
    mode, limit = AutoresetMode.SAME_STEP, 12
    envs = gymnasium.make_vec(id, num_envs=3, limit=limit, current=(0.02, 0.1), autoreset_mode=mode)
    many = SyncVectorEnv([lambda: gymnasium.make(id, limit=limit, current=(0.02, 0.1))] * 3, autoreset_mode=mode)
    assert np.array_equal(envs.reset(seed=5)[0], many.reset(seed=5)[0])
    assert envs.metadata["autoreset_mode"] == mode
    envs.action_space.seed(1)
    ends = 0
    for _ in range(4 * limit):
        actions = envs.action_space.sample()
        seen, reward, over, cut, info = envs.step(actions)
        wanted, paid, ended, stopped, told = many.step(actions)
        assert np.array_equal(seen, wanted)
        np.testing.assert_array_equal(reward, paid)
        assert np.array_equal(over, ended)
        assert np.array_equal(cut, stopped)
        assert set(info) == set(told)
        if told:
            ends += int(info["_final_obs"].sum())
            assert np.array_equal(info["_final_obs"], told["_final_obs"])
            assert all(np.array_equal(info["final_obs"][k], told["final_obs"][k])
                       for k in np.flatnonzero(info["_final_obs"]))  # fmt: skip
    assert ends >= 9


def test_episodes_cannot_stay_over_in_a_vector() -> None:
    with pytest.raises(TaskError, match=r"autoreset_mode is .*; on the processor it is NEXT_STEP or SAME_STEP"):
        ShipVectorEnv("kvlcc2_l7", Course(), autoreset_mode=AutoresetMode.DISABLED)
