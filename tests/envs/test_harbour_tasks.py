"""Environments on charts: a canal whose banks draw the ship, a quay with contact."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

gymnasium: Any = pytest.importorskip("gymnasium")
import seatrial.envs  # noqa: E402
from seatrial.envs import Canal, ShipVectorEnv  # noqa: E402


def pressed(o: Any) -> Any:
    """Push towards the fenders at 4 cm/s, heading held."""
    Y = 1.8 * (np.clip(0.35 * o[:, 1] + 0.04, 0.0, 0.1) * 10.0 - o[:, 4])
    N = -6.0 * o[:, 2] - 1.5 * o[:, 5]
    return np.clip(np.stack([Y + N, Y - N], axis=-1), -1.0, 1.0).astype(np.float32)


@pytest.mark.slow
def test_a_canal_draws_the_ship_to_its_nearer_bank() -> None:
    task: Any = Canal(aside=1.5, way=(0.45, 0.45))
    envs = ShipVectorEnv("kvlcc2_harbour", task, 12)
    first, _ = envs.reset(seed=4)
    assert first.shape == (12, 9)
    again = envs.reset(seed=4)[0]
    assert (again == first).all()
    for _ in range(11):
        envs.step(np.zeros((12, 1), dtype=np.float32))
    seen, reward, over, _, _ = envs.step(np.zeros((12, 1), dtype=np.float32))
    aside = np.abs(first[:, 0]) > 0.8
    assert aside.any()
    assert (np.sign(seen[aside, 3] - first[aside, 3]) == np.sign(first[aside, 0])).all()
    assert (np.asarray(reward) <= 0.0).all()
    assert not over.any()


def test_they_are_registered() -> None:
    assert {"seatrial/Quay-v0", "seatrial/Canal-v0"} <= set(seatrial.envs.IDS)


@pytest.mark.long
def test_a_plain_law_lays_ships_on_their_fenders() -> None:
    envs = gymnasium.make_vec("seatrial/Quay-v0", num_envs=16)
    seen, _ = envs.reset(seed=1)
    ends: list[float] = []
    for _ in range(1500):
        seen, reward, over, _, _ = envs.step(pressed(seen))
        ends += reward[over].tolist()
    assert len(ends) >= 8
    assert np.mean(np.array(ends) > 0.0) > 0.5


@pytest.mark.long
def test_a_law_that_rams_the_quay_is_punished() -> None:
    envs = gymnasium.make_vec("seatrial/Quay-v0", num_envs=16)
    envs.reset(seed=1)
    ends: list[float] = []
    for _ in range(800):
        _, reward, over, _, _ = envs.step(np.ones((16, 2), dtype=np.float32))
        ends += reward[over].tolist()
    assert ends
    assert np.mean(np.array(ends) < -1.0) > 0.5
