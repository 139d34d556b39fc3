"""The epochs of a training: batches in the order of the seed, Adam, the watched loss, when to stop."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..ships import Ship
from . import FitError, Progress
from .training_data import CHANNELS, Source
from .training_engine import Engine
from .training_record import Stand
from .watch import tell

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any

# Adam's constants (Kingma and Ba 2014); seconds between two writings of the checkpoint, within an
# epoch and at its end.
_FIRST, _SECOND, _LEAST = 0.9, 0.999, 1e-8
_PAUSE, _QUICK = 5.0, 0.2
# A position is no number where a velocity is none, so velocities are named first.
_BLAMED = (3, 4, 5, 6, 7, 8, 2, 0, 1)


@dataclass(frozen=True)
class Plan:
    """What a training does, the same for every seed.

    Attributes:
        engine: loss and gradient.
        source, watched: rows of training, and of validation or None.
        stages: rows of a window and the first rows of all windows, in the order of the curriculum.
        watch: the same of the watched windows.
        epochs, batch, patience: at most so many passes; windows of a batch; epochs without a better watched loss.
        rate, cosine: learning rate, and whether it falls to zero along a half wave of the cosine.
        seeds: one training each.
        begin: weights of a seed.
        ship: the ship with weights, as the engine has them.
    """

    engine: Engine
    source: Source
    watched: Source | None
    stages: tuple[tuple[int, NDArray[np.int64]], ...]
    watch: tuple[int, NDArray[np.int64]]
    epochs: int
    batch: int
    patience: int
    rate: float
    cosine: bool
    seeds: Sequence[int]
    begin: Callable[[int], Any]
    ship: Callable[[Any], Ship]


class Loop:
    """A training under way.

    Args:
        plan: what to do.
        stand: where it stands.
        save: writes the stand, or None.
        began: start of the clock, seconds already spent included.
    """

    def __init__(
        self, plan: Plan, stand: Stand, checkpoint: tuple[Path, str] | None, began: float, progress: Progress | None
    ) -> None:
        self.plan, self.stand, self.checkpoint, self.began, self.progress = plan, stand, checkpoint, began, progress
        self.written = time.perf_counter()
        self.theta: Any = None
        self.moments: tuple[Any, Any] = (None, None)

    def run(self) -> Stand:
        """Train with every seed that is left.

        Raises:
            FitError: the loss stops being a number before the first epoch is over.
        """
        stand, plan = self.stand, self.plan
        while stand.seed < len(plan.seeds):
            if not stand.theta.size:
                stand.begin(plan.begin(plan.seeds[stand.seed]).astype(np.float32))
            self._there()
            why = ""
            while not why:
                why = self._epoch()
            stand.end(why)
            self._save()
        return stand

    def _epoch(self) -> str:
        """One pass over the windows; why the seed ends with it, or an empty text."""
        stand, plan = self.stand, self.plan
        rows, starts = self._stage()
        size = min(plan.batch, len(starts))
        order = np.random.default_rng([plan.seeds[stand.seed], stand.epoch]).permutation(len(starts))
        count = len(starts) // size
        while stand.place < count:
            at = np.sort(order[stand.place * size : (stand.place + 1) * size])
            wrong = self._step(plan.source, starts[at], rows, (stand.epoch - 1 + stand.place / count) / plan.epochs)
            if wrong:
                return self._broken(wrong)
            stand.place += 1
            if time.perf_counter() - self.written > _PAUSE:
                self._save()
        loss = stand.total / count
        seen = self._watched_loss(loss)
        stand.note(loss, math.nan if plan.watched is None else seen, time.perf_counter() - self.began)
        if seen < stand.best_loss:
            stand.best, stand.best_loss, stand.best_epoch = self._here(self.theta), seen, stand.epoch
        row = len(stand.history), loss, math.nan if plan.watched is None else seen
        tell(self.progress, row, partial(plan.ship, stand.best))
        stand.epoch, stand.place, stand.total = stand.epoch + 1, 0, 0.0
        if stand.epoch > plan.epochs:
            return f"{plan.epochs} epochs done"
        last = self._stage()[0] == plan.stages[-1][0]
        if last and stand.epoch - 1 - max(stand.best_epoch, self._final_from()) >= plan.patience:
            return f"no better for {plan.patience} epochs"
        if time.perf_counter() - self.written > _QUICK:
            self._save()
        return ""

    def _stage(self) -> tuple[int, NDArray[np.int64]]:
        """Windows of this epoch: the curriculum has an even share of the epochs for each length."""
        stages = self.plan.stages
        return stages[min((self.stand.epoch - 1) * len(stages) // self.plan.epochs, len(stages) - 1)]

    def _final_from(self) -> int:
        """Epochs before the last stage."""
        return -(-(len(self.plan.stages) - 1) * self.plan.epochs // len(self.plan.stages))

    def _step(self, source: Source, starts: NDArray[np.int64], rows: int, done: float) -> str:
        """One update of the weights; what is not a number, or an empty text."""
        import torch

        stand, (mean, square) = self.stand, self.moments
        loss, gradient = self.plan.engine.losses(self.theta, source.batch(starts, rows))
        each = loss.tolist()
        if not all(map(math.isfinite, each)):
            return next(CHANNELS[k] for k in _BLAMED if not math.isfinite(each[k]))
        if gradient is None or not bool(torch.isfinite(gradient).all()):
            return "the gradient"
        stand.steps += 1
        stand.batches += 1
        share = self.plan.engine.form.acceleration
        stand.total += (1.0 - share) * sum(each[:6]) + share * sum(each[6:])
        rate = self.plan.rate * (0.5 * (1.0 + math.cos(math.pi * done)) if self.plan.cosine else 1.0)
        mean.mul_(_FIRST).add_(gradient, alpha=1.0 - _FIRST)
        square.mul_(_SECOND).addcmul_(gradient, gradient, value=1.0 - _SECOND)
        bias = 1.0 - _FIRST**stand.steps, math.sqrt(1.0 - _SECOND**stand.steps)
        step = mean / (square.sqrt() / bias[1] + _LEAST)
        self.theta.add_(step * self.free, alpha=-rate / bias[0])
        return ""

    def _broken(self, wrong: str) -> str:
        """What to say where the loss stopped being a number.

        Raises:
            FitError: there is nothing better to keep than where it began.
        """
        stand = self.stand
        where = f"seed {self.plan.seeds[stand.seed]}, epoch {stand.epoch}, batch {stand.place + 1}: {wrong}"
        if not stand.best_epoch:
            raise FitError(f"the loss is not a number in {where}; lower learning_rate or shorten the horizon")
        return f"the loss is not a number in {where}; kept the weights of epoch {stand.best_epoch}"

    def _watched_loss(self, otherwise: float) -> float:
        """Loss of the validation windows; that of the training where there are none."""
        plan, engine = self.plan, self.plan.engine
        if plan.watched is None:
            return otherwise
        (rows, starts), total = plan.watch, 0.0
        share = engine.form.acceleration
        for k in range(0, len(starts), plan.batch):
            part = starts[k : k + plan.batch]
            each = engine.losses(self.theta, plan.watched.batch(part, rows), gradient=False)[0].tolist()
            total += len(part) * ((1.0 - share) * sum(each[:6]) + share * sum(each[6:]))
        return total / len(starts) if math.isfinite(total) else math.inf

    def _there(self) -> None:
        """The stand's vectors on the device."""
        import torch

        stand, device = self.stand, self.plan.engine.device
        self.theta, *moments = (torch.tensor(a, device=device) for a in (stand.theta, stand.mean, stand.square))
        self.moments = (moments[0], moments[1])
        self.free = torch.tensor(self.plan.engine.vector.free, dtype=torch.float32, device=device)

    def _here(self, a: Tensor) -> Any:
        return a.detach().cpu().numpy().copy()

    def _save(self) -> None:
        stand = self.stand
        if stand.theta.size:
            stand.theta, stand.mean, stand.square = map(self._here, (self.theta, *self.moments))
        if self.checkpoint is not None:
            stand.write(*self.checkpoint)
        self.written = time.perf_counter()
