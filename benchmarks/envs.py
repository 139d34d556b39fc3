"""Environments for learning: many ships in one kernel, an action at a time, through Gymnasium's own door."""

from __future__ import annotations

import time
from typing import Any

import gymnasium
import numpy as np
from timing import best, publish

from seatrial.envs import IDS

SHIPS, STEPS, SECONDS = 1024, 400, 0.5
BAR = "> 2"


def sailed(envs: Any, action: Any) -> float:
    """Processor time per environment step over a run with its resets, all threads together [s]."""
    start = time.process_time()
    for _ in range(STEPS):
        envs.step(action)
    return (time.process_time() - start) / (STEPS * SHIPS)


def main() -> None:
    rows: list[dict[str, Any]] = []
    for id in IDS:
        envs: Any = gymnasium.make_vec(id, num_envs=SHIPS)
        envs.reset(seed=0)
        action = np.random.default_rng(0).uniform(-0.3, 0.3, (SHIPS, envs.single_action_space.shape[0]))
        action = action.astype(np.float32)
        spent = min(sailed(envs, action) for _ in range(3))
        quickest = best(lambda envs=envs, action=action: envs.step(action), SECONDS)
        rows += [
            {"what": f"{id}, {SHIPS} ships, one core, resets included: steps a second of processor time",
             "value": 1e-6 / spent, "unit": "million", "bar": BAR},
            {"what": f"{id}, {SHIPS} ships, one thread, the quickest step: steps a second",
             "value": 1e-6 * SHIPS / quickest, "unit": "million", "bar": BAR},
        ]  # fmt: skip
    single: Any = gymnasium.make("seatrial/Course-v0").unwrapped
    single.reset(seed=0)
    calm = np.zeros(1, dtype=np.float32)

    def one() -> None:
        if single.step(calm)[2:4] != (False, False):
            single.reset()

    rows.append({"what": "one ship alone, a step", "value": 1e6 * best(one, SECONDS), "unit": "us", "bar": "-"})
    publish("envs", rows)


if __name__ == "__main__":
    main()
