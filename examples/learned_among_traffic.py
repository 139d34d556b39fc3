"""An autopilot that keeps clear, learned among traffic by an evolution strategy, and judged as any other stack.

    pip install 'seatrial[gym]'
    python examples/learned_among_traffic.py [GENERATIONS [RUN/model.toml]]
    seatrial case examples/cases/kvlcc2_learned.toml -o case

A network of 31 inputs and six hidden units says how far to turn.  All candidates of a generation sail side by side,
each in encounters of its own, in which two ships have the same candidate on board and a third keeps on.  The mean of
the search is kept in examples/cases/learned.npy, which the case reads.  Of a fit each ship is drawn from its posterior.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from cmaes import SepCMA

import seatrial as st

HIDDEN, CANDIDATES, EACH, OWN = 6, 12, 32, 2
KEPT = Path(__file__).parent / "cases" / "learned.npy"


def acted(weights: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Actions of one network for each row, weights of shape (rows, SIZE): the course only, at full speed."""
    inputs, rows = seen.shape[1], len(seen)
    first, more = weights[:, : inputs * HIDDEN].reshape(rows, HIDDEN, inputs), weights[:, inputs * HIDDEN :]
    inner = np.tanh(np.einsum("rhi,ri->rh", first, seen) + more[:, :HIDDEN])
    course = np.tanh((inner * more[:, HIDDEN : 2 * HIDDEN]).sum(axis=1) + more[:, -1])
    return np.column_stack([np.where(np.abs(course) < 0.1, 0.0, course), np.ones(rows)])


def sailed(envs: st.envs.EncounterVectorEnv, weights: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Rewards of an episode of each ship, and whether it broke a rule."""
    seen, _ = envs.reset(seed=seed)
    total, over, info = np.zeros(envs.num_envs), False, {}
    while not over:
        seen, reward, _, cut, info = envs.step(acted(weights, seen))
        total, over = total + reward, bool(cut[0])
    return total, np.array([bool(one) for one in info["broken"]])


def main(generations: int, fit: str | None = None) -> None:
    envs = st.envs.EncounterVectorEnv(fit or "kvlcc2", CANDIDATES * EACH, fit=fit, own=OWN, roles=("give-way",) * OWN,
                                      traffic=("ignores",))  # fmt: skip
    size = envs.single_observation_space.shape[0] * HIDDEN + 2 * HIDDEN + 1
    search = SepCMA(mean=np.zeros(size), sigma=0.5, population_size=CANDIDATES, seed=1)
    before = sailed(envs, np.zeros((envs.num_envs, size)), 10_000)
    for generation in range(generations):
        asked = [search.ask() for _ in range(CANDIDATES)]
        reward, _ = sailed(envs, np.repeat(asked, EACH, axis=0), generation)
        told = reward.reshape(CANDIDATES, EACH).mean(axis=1)
        search.tell([(one, -float(value)) for one, value in zip(asked, told, strict=True)])
        print(f"generation {generation + 1}: mean reward {told.mean():.2f}, best {told.max():.2f}", flush=True)  # noqa: T201
    mean = search.mean.astype(np.float64)
    np.save(KEPT, mean)
    after = sailed(envs, np.tile(mean, (envs.num_envs, 1)), 10_000)
    print(f"encounters not seen before: reward {before[0].mean():.2f}, {100 * before[1].mean():.0f} % break a rule; "  # noqa: T201
          f"then {after[0].mean():.2f}, {100 * after[1].mean():.0f} %")  # fmt: skip


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40, *sys.argv[2:3])
