"""The policy that examples/learned_among_traffic.py learned, as a stack of a case."""

from __future__ import annotations

from pathlib import Path

import numpy as np

HIDDEN = 6


class Policy:
    def __init__(self, weights: np.ndarray) -> None:
        self.weights = weights

    def predict(self, seen: np.ndarray, deterministic: bool = True) -> tuple[np.ndarray, None]:
        inputs = seen.shape[1]
        first, more = self.weights[: inputs * HIDDEN].reshape(HIDDEN, inputs), self.weights[inputs * HIDDEN :]
        course = np.tanh(np.tanh(seen @ first.T + more[:HIDDEN]) @ more[HIDDEN : 2 * HIDDEN] + more[-1])
        return np.column_stack([np.where(np.abs(course) < 0.1, 0.0, course), np.ones(len(seen))]), None


def load() -> Policy:
    return Policy(np.load(Path(__file__).with_name("learned.npy")))
