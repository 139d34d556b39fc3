"""Where a training stands: weights, moments of Adam and the place in the order of batches, written whole to a file.

The order of the batches of an epoch follows from seed and epoch, so a place in it says all that is still to come.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from pathlib import Path

import numpy as np

from ..data import Array
from ..files import packed, write_whole
from .resume import ResumeError, kept_arrays

_ROW = 4


@dataclass
class Stand:
    """One mutable record: everything that the rest of a training follows from.

    Attributes:
        seed: index of the seed at work.
        epoch, place: epoch at work, from 1, and how many of its batches are done.
        theta, mean, square: weights and the two moments of Adam, float32; empty before a seed has begun.
        steps: updates so far with this seed.
        total, batches: sum of the losses of this epoch, and all updates with all seeds.
        best, best_loss, best_epoch: weights of the least watched loss so far with this seed.
        ends, finals: watched loss and best weights of each finished seed, shapes (seeds,), (seeds, weights).
        history: rows (epoch counted over all seeds, loss, watched loss or NaN, seconds).
        stopped: why the last seed to end did so.
    """

    seed: int = 0
    epoch: int = 1
    place: int = 0
    theta: Array = field(default_factory=lambda: np.zeros(0))
    mean: Array = field(default_factory=lambda: np.zeros(0))
    square: Array = field(default_factory=lambda: np.zeros(0))
    steps: int = 0
    total: float = 0.0
    batches: int = 0
    best: Array = field(default_factory=lambda: np.zeros(0))
    best_loss: float = float("inf")
    best_epoch: int = 0
    ends: Array = field(default_factory=lambda: np.zeros(0))
    finals: Array = field(default_factory=lambda: np.zeros((0, 0)))
    history: Array = field(default_factory=lambda: np.zeros((0, _ROW)))
    stopped: str = ""

    def begin(self, theta: Array) -> None:
        """Start a seed from `theta`."""
        zero = np.zeros_like(theta)
        self.epoch, self.place, self.steps, self.total = 1, 0, 0, 0.0
        self.theta, self.mean, self.square, self.best = theta, zero, zero.copy(), theta
        self.best_loss, self.best_epoch = float("inf"), 0

    def end(self, why: str) -> None:
        """Close the seed at work."""
        self.ends = np.append(self.ends, self.best_loss)
        self.finals = np.vstack([self.finals.reshape(-1, self.best.size), self.best])
        self.seed, self.stopped, self.theta = self.seed + 1, why, np.zeros(0)

    def note(self, loss: float, watched: float, seconds: float) -> None:
        """Add a row to the history."""
        self.history = np.vstack([self.history, [len(self.history) + 1.0, loss, watched, seconds]])

    def write(self, path: Path, digest: str) -> None:
        """Write to `path`, whole or not at all."""
        arrays = {f.name: np.array(getattr(self, f.name)) for f in fields(self)}
        write_whole(path, packed(digest=np.array(digest), **arrays))

    @staticmethod
    def read(path: Path | None, digest: str) -> Stand:
        """What `path` holds of this problem; a fresh one where there is no file.

        Raises:
            ResumeError: the file belongs to another problem.
        """
        kept = kept_arrays(path, ("digest", *(f.name for f in fields(Stand))))
        if kept is None:
            return Stand()
        if str(kept.pop("digest")) != digest:
            raise ResumeError(f"{path} belongs to another problem; choose another output folder")
        return Stand(**{name: value.item() if value.ndim == 0 else value for name, value in kept.items()})
