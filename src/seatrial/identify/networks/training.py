"""Training a network on trials (Wakita 2022 section 2.2): estimator of a study whose ship is of the family `Neural`.

PyTorch, of the extra `neural`, is imported when a training begins and never before.

The module is one idea, hence its length: the settings (`Training`), the epochs that they describe (batches in the order
of the seed, Adam, the watched loss, the stopping rule) and the checkpoint (`Stand`: weights, moments of Adam and the
position in the order of batches, written whole to a file) follow from each other line by line.  The order of the
batches of an epoch follows from seed and epoch, so the position in it determines all that is still to come.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import NoTorchError as NoTorchError
from ...core.parameters import ParameterError, unknown
from ...data import Array
from ...engine.rollout import default_threads
from ...models.network import KINDS, Limits, Network, initial
from ...models.network_pass import accelerations
from ...models.neural import Neural
from ...ships import Ship
from .. import Fit, FitError, Problem, Progress, StudyError, Verdict
from ..lint import linted
from ..watch import tell
from .data import CHANNELS, Rows, Source, answers, typical, weights_of_errors
from .engine import Engine, Form, one_thread_each

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any
from dataclasses import field, fields

from ...core.files import packed, write_whole
from ..resume import ResumeError, kept_arrays

EXTRA = "pip install 'seatrial[neural]'"

# Limits of a trained network: its inputs may leave the range of the training files by this share of it, its
# answers their largest by this factor.
_MARGIN, _HEADROOM = 0.25, 1.5
_SAMPLES = 4096


@dataclass(frozen=True)
class Training:
    """Trains the network of a ship; every field is a setting of a study.

    Attributes:
        epochs: passes over the windows, at most.
        batch, stride: windows of an update; rows between the beginnings of two windows.
        horizon: rows N_T of a window, those included whose state is measured (Eqs. 18, 19).
        curriculum: shorter horizons to begin with, each with an even share of the epochs.
        acceleration: share of the acceleration loss (Eq. 16); the rest is the state loss (Eq. 23).
        learning_rate, schedule: of Adam; "constant" as in the paper, or "cosine" down to zero.
        patience: epochs without a better loss of the validation files after which it stops.
        watch: rows of the windows of the validation files; 0 takes the horizon.
        wind: "true" lets the apparent wind follow the simulated motion, "measured" takes that on board.
        start: what a window's memory begins with: "measured" rows, or the first simulated one "held" before.
        scaled: whether the inputs of an untrained network are divided by their root mean square, and its answers
            counted in the size of the measured accelerations; Wakita 2022 does neither.
        bounded: whether a network without limits gets those of the training files (`models.network.Limits`).
        kind, hidden, layers, memory: form of an untrained network; empty and 0 leave it as the ship has it.
        seeds: one training each; the least loss on the validation files wins.
        device: "auto", "cpu" or "cuda".
        threads: None takes every processor; their number changes no digit.
    """

    epochs: int = 100
    batch: int = 512
    stride: int = 10
    horizon: int = 60
    curriculum: Sequence[int] = ()
    acceleration: float = 0.0
    learning_rate: float = 1e-3
    schedule: str = "constant"
    patience: int = 20
    watch: int = 0
    wind: str = "true"
    start: str = "measured"
    scaled: bool = True
    bounded: bool = True
    kind: str = ""
    hidden: int = 0
    layers: int = 0
    memory: int = 0
    seeds: Sequence[int] = (0,)
    device: str = "auto"
    threads: int | None = None

    def __post_init__(self) -> None:
        self._lists()
        self._least()
        if not self.learning_rate > 0:
            raise StudyError(f"estimator.learning_rate is {self.learning_rate:g}; it must be above zero")
        if not 0.0 <= self.acceleration <= 1.0:
            raise StudyError(f"estimator.acceleration is {self.acceleration:g}; it is a share, 0 to 1")
        if self.threads is not None and self.threads < 1:
            raise StudyError(f"estimator.threads is {self.threads}; it must be 1 or more")

    def _lists(self) -> None:
        for name in ("curriculum", "seeds"):
            value: Any = getattr(self, name)
            if not isinstance(value, list | tuple) or any(type(one) is not int for one in value):
                raise StudyError(f"estimator.{name} is {value!r}; it must be a list of whole numbers")
            object.__setattr__(self, name, tuple(value))
        if not self.seeds or min(self.seeds) < 0 or any(rows < 2 for rows in self.curriculum):
            raise StudyError("estimator: seeds are one or more numbers from 0, curriculum has horizons from 2 rows")

    def _least(self) -> None:
        for name, least in (("epochs", 1), ("batch", 1), ("stride", 1), ("horizon", 2), ("patience", 1), ("watch", 0),
                            ("hidden", 0), ("layers", 0), ("memory", 0)):  # fmt: skip
            if getattr(self, name) < least:
                raise StudyError(f"estimator.{name} is {getattr(self, name)}; it must be {least} or more")
        for name, known in (("schedule", ("constant", "cosine")), ("wind", ("true", "measured")),
                            ("start", ("measured", "held")), ("device", ("auto", "cpu", "cuda")),
                            ("kind", ("", *KINDS))):  # fmt: skip
            if getattr(self, name) not in known:
                raise StudyError(f"estimator: {unknown(getattr(self, name), [k for k in known if k], name)}")
    @linted
    def fit(self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None) -> Fit:
        """Train; the fit has no free parameters, its ship has the weights.

        A training that stops because its loss is not a number keeps the best weights so far and says so.
        Ends of `ends` are the losses of each seed that decided.

        Raises:
            NoTorchError: PyTorch is absent.
            StudyError: the ship has no network, parameters are free, or a setting cannot be.
            DataError: trials that do not fit the network: wind, sample time, length, current.
            FitError: the loss is not a number in the first epoch.
        """
        from ..digest import digest

        began = time.perf_counter()
        model, device = self._model(problem), self._device()
        found = Rows.of(problem.trials, model, self.wind == "measured", max(self.horizon, *self.curriculum, 0))
        if self.scaled and not model.network.trained and set(model.network.scale) == {1.0}:
            model = replace(model, network=replace(model.network, scale=typical(found, model)))
        plan = self._plan(problem, model, found, device)
        mark = digest(problem, self)
        stand = Stand.read(checkpoint, mark)
        began -= float(stand.history[-1, 3]) if len(stand.history) else 0.0
        kept = None if checkpoint is None else (checkpoint, mark)
        with one_thread_each():
            Loop(plan, stand, kept, began, progress).run()
        return self._finished(problem, model, found, stand, plan, mark, time.perf_counter() - began)

    def _model(self, problem: Problem) -> Neural:
        model: Any = problem.ship.model
        if not isinstance(model, Neural):
            raise StudyError(f"{problem.ship.name}: Training is for networks only; this is {type(model).__name__}")
        if problem.free:
            raise StudyError(f"free: {problem.free[0].path}: a network has weights, no free parameters; leave it out")
        return replace(model, network=self._network(model.network))

    def _network(self, network: Network) -> Network:
        """The ship's network in the form that the settings ask for."""
        kind = self.kind or network.kind
        units = self.hidden or network.layers[0]
        layers = (units,) * (self.layers or len(network.layers)) if self.hidden or self.layers else network.layers
        fixed = {"feedforward": 1, "forgetting": self.memory or network.memory or 10}.get(kind, 0)
        if kind == network.kind and not self.memory:
            fixed = network.memory
        if network.trained and (kind, layers, fixed) != (network.kind, network.layers, network.memory):
            raise StudyError("estimator: the ship's network is trained already; its form cannot be changed")
        if self.memory and kind != "forgetting":
            raise StudyError(f"estimator.memory is for the kind 'forgetting' only; this is '{kind}'")
        try:
            return replace(network, kind=kind, layers=layers, memory=fixed)
        except ParameterError as error:
            raise StudyError(f"estimator: {error}") from None

    def _device(self) -> str:
        try:
            import torch
        except ModuleNotFoundError as error:
            absent = error.name == "torch"
            told = f"training needs PyTorch; {EXTRA}" if absent else f"PyTorch is installed and fails to load: {error}"
            raise NoTorchError(f"estimator: {told}") from None
        except (ImportError, OSError) as error:  # a library of its own is missing or does not fit
            raise NoTorchError(f"estimator: PyTorch is installed and fails to load: {error}") from None
        if self.device == "cuda" and not torch.cuda.is_available():
            raise StudyError('estimator.device is "cuda"; PyTorch sees none here; take "auto" or "cpu"')
        return "cuda" if self.device != "cpu" and torch.cuda.is_available() else "cpu"

    def _plan(self, problem: Problem, model: Neural, found: Rows, device: str) -> Plan:
        network, measured = model.network, self.wind == "measured"
        known = network.look_back + 1
        horizons = (*self.curriculum, self.horizon)
        if min(horizons) <= known:
            raise StudyError(f"estimator.horizon is {min(horizons)} rows; the network looks back on {known}, so more")
        repeat = known - 1 if self.start == "held" else 0
        weight = weights_of_errors(found, problem.trials, problem.loss)
        source = Source(found, weight, float(model.dt), device=device, apparent=measured, repeat=repeat)
        watched, rows, seen = None, self.watch or self.horizon, np.zeros(0, dtype=np.int64)
        if problem.validation:
            other = Rows.of(problem.validation, model, measured, rows)
            seen = other.starts(rows, max(rows - known, 1))
            watched = Source(other, weight, float(model.dt), device=device, apparent=measured, repeat=repeat)
        engine = Engine(
            Form(network, known, self.acceleration), device, self.threads or default_threads(),
            answers(found, float(model.dt)) if self.scaled else (1.0, 1.0, 1.0),
        )  # fmt: skip
        return Plan(
            engine, source, watched, tuple((n, found.starts(n, self.stride)) for n in horizons), (rows, seen),
            self.epochs, self.batch, self.patience, self.learning_rate, self.schedule == "cosine", self.seeds,
            lambda seed: engine.vector.exact(network.weights) if network.trained
            else engine.vector.joined(initial(network, seed).weights),
            lambda theta: _with_weights(problem.ship, model, engine.vector.named(np.asarray(theta, dtype=np.float64))),
        )  # fmt: skip

    def _finished(
        self, problem: Problem, model: Neural, found: Rows, stand: Stand, plan: Plan, mark: str, seconds: float
    ) -> Fit:
        best = int(np.argmin(stand.ends))
        weights = plan.engine.vector.named(np.asarray(stand.finals[best], dtype=np.float64))
        network = model.network.having(weights)
        if self.bounded and network.limits is None:
            network = replace(network, limits=_limits(network, found.shown(model)))
        ship = replace(problem.ship, model=replace(model, network=network))
        none, count = np.zeros(0), network.count
        of = f", seed {self.seeds[best]} of {len(self.seeds)}" if len(self.seeds) > 1 else ""
        said = Verdict(
            f"{count} weights", "not identified",
            "no weight means anything by itself; judge the network by its predictions of trials kept back",
        )  # fmt: skip
        return Fit(
            ship, (), none, none, np.zeros((0, 0)), none, (), (said,), stand.history, float(stand.ends[best]), seconds,
            stand.batches, f"{stand.stopped}{of}", mark, stand.ends[:, None],
        )  # fmt: skip


def _with_weights(ship: Ship, model: Neural, weights: Any) -> Ship:
    return replace(ship, model=replace(model, network=model.network.having(weights)))


def _limits(network: Network, shown: Array) -> Limits:
    """Bounds around what the training files show, so that every run of the network stays finite."""
    low, high = shown.min(axis=0), shown.max(axis=0)
    room = _MARGIN * (high - low)
    low, high = np.minimum(low, 0.0) - room, np.maximum(high, 0.0) + room
    some = shown[:: max(len(shown) // _SAMPLES, 1)]
    largest = np.abs(accelerations(network, some[:, None])).max(axis=(0, 1))
    return Limits(tuple(low.tolist()), tuple(high.tolist()), tuple((_HEADROOM * largest).tolist()))


# Adam's constants (Kingma and Ba 2014); seconds between two writings of the checkpoint, within an
# epoch and at its end.
_FIRST, _SECOND, _LEAST = 0.9, 0.999, 1e-8
_PAUSE, _QUICK = 5.0, 0.2
# A position is no number where a velocity is none, so velocities are named first.
_BLAMED = (3, 4, 5, 6, 7, 8, 2, 0, 1)


@dataclass(frozen=True)
class Plan:
    """Plan of a training, the same for every seed.

    Attributes:
        engine: loss and gradient.
        source, watched: rows of training, and of validation or None.
        stages: rows of a window and the first rows of all windows, in the order of the curriculum.
        watch: the same of the watched windows.
        epochs, batch, patience: most passes; windows of a batch; epochs without a better watched loss.
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
    """A running training.

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
        """The message for a loss that is not finite.

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


_ROW = 4


@dataclass
class Stand:
    """State of a training, the only mutable record: all that the rest of it follows from.

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
