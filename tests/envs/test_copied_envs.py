"""An environment or a plant that is pickled or copied goes on by itself, as the one that it was taken from."""

from __future__ import annotations

import copy
import math
import multiprocessing
import pickle
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import gymnasium
import numpy as np
import pytest

from cuda_shim import Shim
from seatrial.core.executors import dask
from seatrial.engine.cuda import DeviceError
from seatrial.engine.cuda.named import device_of
from seatrial.environment import Environment, Uniform, Weather
from seatrial.environment.weather import Gust
from seatrial.envs import Course, ShipEnv, ShipVectorEnv, Track
from seatrial.realtime.plant import Plant
from seatrial.ships.files import load

SHIP = "kvlcc2_l7"
WAYS: dict[str, Callable[[Any], Any]] = {
    "pickle": lambda one: pickle.loads(pickle.dumps(one)), "deepcopy": copy.deepcopy, "copy": copy.copy,
}  # fmt: skip
way = pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
STEPS = 60


def actions(env: Any) -> list[Any]:
    """Some for `STEPS` steps, whatever the environment has drawn before."""
    shape = env.action_space.shape
    return list(np.random.default_rng(5).uniform(-1.0, 1.0, (STEPS, *shape)).astype(np.float32))


def sailed(env: Any, given: list[Any]) -> list[Any]:
    """What each step told, beginning anew where a single environment is over; of a device, as NumPy has it."""
    told: list[Any] = []
    for action in given:
        *outcome, _ = env.step(action)
        outcome = [one.host() if hasattr(one, "host") else np.array(one) for one in outcome]
        told.append(outcome)
        if isinstance(env.unwrapped, ShipEnv) and (outcome[2] or outcome[3]):
            told.append([env.reset()[0]])
    return told


def same(one: list[Any], other: list[Any]) -> bool:
    return len(one) == len(other) and all(
        len(a) == len(b) and all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))
        for a, b in zip(one, other, strict=True)
    )


SETTINGS: dict[str, Any] = {"current": (0.0, 0.1), "randomise": {"hull.Y_v": 0.2}, "limit": 25}
ENVS: dict[str, Callable[[], Any]] = {
    "single": lambda: ShipEnv(SHIP, Course(), **SETTINGS),
    "pictures": lambda: ShipEnv(SHIP, Track(), "rgb_array", limit=25),
    "made": lambda: gymnasium.make("seatrial/Course-v0", **SETTINGS),
    "vector": lambda: ShipVectorEnv(SHIP, Course(), 20, **SETTINGS),
    "threads": lambda: ShipVectorEnv(SHIP, Course(), 40, threads=2, copy=False, **SETTINGS),
    "shim": lambda: ShipVectorEnv(SHIP, Course(), 20, device=Shim(), **SETTINGS),
}


@pytest.mark.slow
@way
@pytest.mark.parametrize("kind", ENVS)
def test_a_copy_of_an_environment_goes_on_as_it_does(kind: str, way: Callable[[Any], Any]) -> None:
    """Over ends of episodes; the copy is stepped first, so one that shares memory with it would show in both."""
    env = ENVS[kind]()
    env.reset(seed=3)
    given = actions(env)
    before = sailed(env, given[:7])
    # A shallow copy of a wrapper of Gymnasium's shares what it wraps.
    other = copy.deepcopy(env) if way is copy.copy and kind == "made" else way(env)
    there, here = sailed(other, given), sailed(env, given)
    assert same(there, here)
    assert not same(here[:7], before)
    if kind == "pictures":
        assert np.array_equal(env.render(), other.render())


@pytest.mark.cuda
def test_a_copy_of_an_environment_on_a_gpu_goes_on_as_it_does() -> None:
    try:
        device_of("cuda")
    except DeviceError as error:
        pytest.skip(str(error))
    env = ShipVectorEnv(SHIP, Course(), 64, device="cuda", **SETTINGS)
    env.reset(seed=3)
    given = actions(env)
    sailed(env, given[:7])
    for there in WAYS.values():
        other = there(env)
        assert same(sailed(other, given), sailed(there(env), given))


def voyage(plant: Plant, steps: int = 300) -> list[float]:
    """All values of a plant over some steps, with an order and a change of wind on the way."""
    out: list[float] = []
    for k in range(steps):
        if k == steps // 3:
            plant.order("delta", math.radians(20.0) - plant["delta_cmd"])
        plant.step()
        out += [plant[name] for name in plant.names]
    return out


def begun(ship: str, environment: Weather | None = None) -> Plant:
    """A plant on its way."""
    found = load(ship)
    plant = Plant.of(found, dt=float(getattr(found.model, "dt", 0.1)), environment=environment, seed=4)
    plant.order("delta", 0.3)
    for _ in range(40):
        plant.step()
    return plant


def _blown() -> Plant:
    plant = begun(SHIP)
    plant.surround(Environment(3.0, 1.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0))
    return plant


PLANTS: dict[str, Callable[[], Plant]] = {
    "calm": lambda: begun(SHIP), "arx": lambda: begun("kvlcc2_l7_arx"), "harbour": lambda: begun("kvlcc2_harbour"),
    "gusts": lambda: begun("kvlcc2", Gust(Uniform(U_T=9.0, gamma_T=0.5, U_C=0.1), seed=3)), "blown": _blown,
}  # fmt: skip


@pytest.mark.slow
@way
@pytest.mark.parametrize("kind", PLANTS)
def test_a_copy_of_a_plant_goes_on_as_it_does(kind: str, way: Callable[[Any], Any]) -> None:
    plant = PLANTS[kind]()
    other = way(plant)
    assert (other.k, other.seed, other.orders) == (plant.k, plant.seed, plant.orders)
    assert voyage(other) == voyage(plant)
    other.reset()
    plant.reset()
    assert voyage(other, 20) == voyage(plant, 20)


def test_a_fault_of_the_gear_goes_along() -> None:
    plant = begun(SHIP)
    plant.linkage = halved
    other = pickle.loads(pickle.dumps(plant))
    assert other.order("delta", 0.2) == plant.order("delta", 0.2)
    assert other["delta_cmd"] == plant["delta_cmd"] == 0.1


def halved(control: str, value: float) -> float:
    return 0.5 * value


def elsewhere(env: Any, given: list[Any], plant: Plant) -> tuple[list[Any], list[float]]:
    return sailed(env, given), voyage(plant, 20)


@pytest.mark.slow
def test_an_environment_and_a_plant_travel_to_another_process() -> None:
    env, plant = ENVS["vector"](), begun(SHIP)
    env.reset(seed=3)
    given = actions(env)
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        steps, values = pool.submit(elsewhere, env, given, plant).result()
    assert same(steps, sailed(env, given))
    assert values == voyage(plant, 20)


@pytest.mark.slow
def test_an_environment_and_a_plant_travel_to_a_dask_worker() -> None:
    pytest.importorskip("distributed")
    env, plant = ENVS["single"](), begun(SHIP)
    env.reset(seed=3)
    given = actions(env)
    with dask("local:1") as pool:
        steps, values = pool.submit(elsewhere, env, given, plant).result()
    assert same(steps, sailed(env, given))
    assert values == voyage(plant, 20)
