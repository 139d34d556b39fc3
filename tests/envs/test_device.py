"""Environments on a device: the same ships as on the processor, in arrays that other libraries take."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest

from cuda_shim import Shim
from seatrial.engine.cuda import DeviceError
from seatrial.engine.cuda.gpu import compiled
from seatrial.engine.cuda.named import device_of
from seatrial.envs import IDS, Course, ShipVectorEnv
from seatrial.envs.device import episode_source
from seatrial.envs.episodes import Fleet, Settings
from seatrial.envs.lanes import Lanes
from seatrial.ships.files import load

SHIPS = 20


@pytest.fixture(params=["shim", pytest.param("cuda", marks=pytest.mark.cuda)])
def device(request: Any) -> Any:
    if request.param == "shim":
        return Shim()
    try:
        return device_of("cuda")
    except DeviceError as error:
        pytest.skip(str(error))


def host(values: Any) -> Any:
    return values.host()


@pytest.mark.slow
@pytest.mark.parametrize(("id", "settings"), [
    ("seatrial/Course-v0", {"current": (0.0, 0.1), "randomise": {"hull.Y_v": 0.2, "hull.N_r": 0.1}, "limit": 40}),
    ("seatrial/Track-v0", {"limit": 60}),
    ("seatrial/Berth-v0", {"wind": (0.0, 1.0)}),
])  # fmt: skip
def test_a_device_sails_the_ships_of_the_processor(id: str, settings: dict[str, Any], device: Any) -> None:
    """The same seeds over 100 steps with ends of episodes among them: states to 1e-9, flags exactly."""
    assert id in IDS
    usual: Any = gymnasium.make_vec(id, num_envs=SHIPS, **settings)
    ours: Any = gymnasium.make_vec(id, num_envs=SHIPS, device=device, **settings)
    first, there = usual.reset(seed=7)[0], ours.reset(seed=7)[0]
    assert host(there) == pytest.approx(first, abs=1e-6)
    usual.action_space.seed(1)
    ended = 0
    for _ in range(100):
        actions = usual.action_space.sample()
        seen, reward, over, cut, _ = usual.step(actions)
        outcome = ours.step(actions)
        assert host(outcome[0]) == pytest.approx(seen, abs=2e-6)  # as single precision has it
        assert host(outcome[1]) == pytest.approx(reward, abs=1e-9)
        assert np.array_equal(host(outcome[2]), over)
        assert np.array_equal(host(outcome[3]), cut)
        ended += int((over | cut).sum())
    for name in ("x", "y", "psi", "u", "v_m", "r"):
        assert ours.lanes.value(name) == pytest.approx(usual.lanes.value(name), rel=1e-9, abs=1e-9)
    assert ours.lanes.series("current_x") == pytest.approx(usual.lanes.series("current_x"), abs=1e-12)
    assert ended >= SHIPS or id == "seatrial/Berth-v0"


def test_seeds_begin_the_same_episodes_whatever_the_number_of_ships(device: Any) -> None:
    few: Any = gymnasium.make_vec("seatrial/Track-v0", num_envs=3, device=device)
    many: Any = gymnasium.make_vec("seatrial/Track-v0", num_envs=40, device=device)
    first, all_of_them = host(few.reset(seed=5)[0]), host(many.reset(seed=5)[0])
    assert np.array_equal(first, all_of_them[:3])
    assert not np.array_equal(host(few.reset()[0]), first)
    assert np.array_equal(host(few.reset(seed=5)[0]), first)


def library(device: Any) -> Any:
    """What takes arrays of the device: NumPy those of the shim, PyTorch those of a GPU."""
    if isinstance(device, Shim):
        return np
    torch = pytest.importorskip("torch")
    if not torch.cuda.is_available():
        pytest.skip("PyTorch without CUDA")
    return torch


def test_arrays_pass_by_dlpack_without_a_copy(device: Any) -> None:
    to = library(device)
    envs: Any = gymnasium.make_vec("seatrial/Course-v0", num_envs=8, device=device)
    seen = to.from_dlpack(envs.reset(seed=1)[0])
    before = host(envs.lanes.observation)
    assert tuple(seen.shape) == (8, len(envs.lanes.work.seen))
    hard = to.ones_like(seen)[:, :1] * 1.0
    for _ in range(5):
        envs.step(hard)
    now = host(envs.lanes.observation)
    assert not np.array_equal(now, before)
    assert np.array_equal(np.asarray(seen.tolist(), np.float32), now)  # the same memory, written by the last step
    for wrong in (np.ones((8, 1)), hard[:7] * 1.0, np.ones((8, 2), np.float32)):
        with pytest.raises(ValueError, match=r"takes \(8, 1\), float32"):
            envs.step(wrong)


def test_single_precision_is_near_double(device: Any) -> None:
    exact, near = (
        ShipVectorEnv("kvlcc2_l7", Course(), 4, device=device, precision=kind) for kind in ("double", "single")
    )
    for envs in (exact, near):
        envs.reset(seed=3)
        for _ in range(20):
            envs.step(np.full((4, 1), 0.3, np.float32))
    assert near.lanes.value("psi") == pytest.approx(exact.lanes.value("psi"), abs=1e-4)
    assert not np.array_equal(near.lanes.value("psi"), exact.lanes.value("psi"))


def test_what_is_not_there_or_cannot_be_is_said() -> None:
    with pytest.raises(DeviceError, match="states beyond the six"):
        ShipVectorEnv("esso_osaka_3m_hybrid", Course(), device=Shim())
    with pytest.raises(DeviceError, match="double precision"):
        ShipVectorEnv("kvlcc2_l7", Course(), precision="single")
    with pytest.raises(DeviceError, match="known: cpu, cuda"):
        ShipVectorEnv("kvlcc2_l7", Course(), device="tpu")
    assert isinstance(ShipVectorEnv("kvlcc2_l7", Course()).lanes, Lanes)


@pytest.mark.parametrize("single", [False, True])
def test_nvrtc_compiles_the_kernels_of_an_environment(single: bool) -> None:
    pytest.importorskip("cuda.core")
    fleet = Fleet.of(load("kvlcc2_l7"), Course(), Settings(current=(0.0, 0.1), randomise={"hull.Y_v": 0.2}))
    assert compiled(episode_source(fleet, single), "sm_90", single)[:4] == b"\x7fELF"
