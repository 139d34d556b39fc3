"""Training a network on trials (Wakita 2022 section 2.2): estimator of a study whose ship is of the family `Neural`.

PyTorch, of the extra `neural`, is imported when a training begins and never before.

`Training` holds the settings, `Loop` runs the epochs (batches in the order of the seed, Adam, the watched loss, the
stopping rule) and `Stand` is the checkpoint.  The order of the batches of an epoch follows from seed and epoch, so the
position in it determines all that is still to come.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import NoTorchError as NoTorchError
from ...core.files import packed, write_whole
from ...core.parameters import ParameterError, unknown
from ...core.values import dataclass, field, fields, replace
from ...data import Array
from ...engine.rollout import default_threads
from ...models.network import KINDS, Limits, Network, initial
from ...models.network_pass import accelerations
from ...models.neural import Neural
from ...ships import Ship
from .. import Fit, FitError, Problem, Progress, StudyError, Verdict
from ..lint import linted
from ..resume import digest, kept_arrays
from ..watch import tell
from .data import CHANNELS, Rows, Source, answers, typical, weights_of_errors
from .engine import Engine, Form, one_thread_each

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any

EXTRA = "pip install 'seatrial[neural]'"
"""What a message says where PyTorch is not installed."""

# Limits of a trained network: its inputs may leave the range of the training files by this share of it, its
# answers their largest by this factor.
_MARGIN, _HEADROOM = 0.25, 1.5
_SAMPLES = 4096
# Least values of settings, and what others may be.
_LEAST = {"epochs": 1, "batch": 1, "stride": 1, "horizon": 2, "patience": 1, "watch": 0, "hidden": 0, "layers": 0,
          "memory": 0, "threads": 1}  # fmt: skip
_KNOWN = {"schedule": ("constant", "cosine"), "wind": ("true", "measured"), "start": ("measured", "held"),
          "device": ("auto", "cpu", "cuda"), "kind": ("", *KINDS)}  # fmt: skip


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
        self._least()
        if not self.learning_rate > 0:
            raise StudyError(f"estimator.learning_rate is {self.learning_rate:g}; it must be above zero")
        if not 0.0 <= self.acceleration <= 1.0:
            raise StudyError(f"estimator.acceleration is {self.acceleration:g}; it is a share, 0 to 1")
        for name in ("curriculum", "seeds"):
            value: Any = getattr(self, name)
            if not isinstance(value, list | tuple) or any(type(one) is not int for one in value):
                raise StudyError(f"estimator.{name} is {value!r}; it must be a list of whole numbers")
            object.__setattr__(self, name, tuple(value))
        if not self.seeds or min(self.seeds) < 0 or any(rows < 2 for rows in self.curriculum):
            raise StudyError("estimator: seeds are one or more numbers from 0, curriculum has horizons from 2 rows")

    def _least(self) -> None:
        for name, least in _LEAST.items():
            value: int | None = getattr(self, name)
            if value is not None and value < least:
                raise StudyError(f"estimator.{name} is {value}; it must be {least} or more")
        for name, known in _KNOWN.items():
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
        began = time.perf_counter()
        model, device = self._model(problem), self._device()
        found = Rows.of(problem.trials, model, self.wind == "measured", max(self.horizon, *self.curriculum, 0))
        if self.scaled and not model.network.trained and set(model.network.scale) == {1.0}:
            model = replace(model, network=replace(model.network, scale=typical(found, model)))
        plan, mark = self._plan(problem, model, found, device), digest(problem, self)
        stand = Stand.read(checkpoint, mark)
        began -= float(stand.history[-1, 3]) if len(stand.history) else 0.0
        with one_thread_each():
            Loop(plan, stand, checkpoint and (checkpoint, mark), began, progress).run()
        return self._finished(plan, found, stand, mark, time.perf_counter() - began)

    def _model(self, problem: Problem) -> Neural:
        model: Any = problem.ship.model
        if not isinstance(model, Neural):
            raise StudyError(f"{problem.ship.name}: Training is for networks only; this is {type(model).__name__}")
        if problem.free:
            raise StudyError(f"free: {problem.free[0].path}: a network has weights, no free parameters; leave it out")
        return replace(model, network=self.form(model.network))

    def form(self, network: Network) -> Network:
        """The ship's network in the form that the settings ask for.

        Raises:
            StudyError: the network is trained already, or there is no such form.
        """
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
        there = partial(
            Source, weight=weights_of_errors(found, problem.trials, problem.loss), dt=float(model.dt), device=device,
            apparent=measured, repeat=known - 1 if self.start == "held" else 0,
        )  # fmt: skip
        watched, rows, seen = None, self.watch or self.horizon, np.zeros(0, dtype=np.int64)
        if problem.validation:
            other = Rows.of(problem.validation, model, measured, rows)
            watched, seen = there(other), other.starts(rows, max(rows - known, 1))
        engine = Engine(
            Form(network, known, self.acceleration), device, self.threads or default_threads(),
            answers(found, float(model.dt)) if self.scaled else (1.0, 1.0, 1.0),
        )  # fmt: skip
        stages = tuple((n, found.starts(n, self.stride)) for n in horizons)
        return Plan(self, problem.ship, model, engine, there(found), watched, stages, (rows, seen))

    def _finished(self, plan: Plan, found: Rows, stand: Stand, mark: str, seconds: float) -> Fit:
        best = int(np.argmin(stand.ends))
        network = plan.network(stand.finals[best])
        if self.bounded and network.limits is None:
            network = replace(network, limits=_limits(network, found.shown(plan.model)))
        none, of = np.zeros(0), f", seed {self.seeds[best]} of {len(self.seeds)}" if len(self.seeds) > 1 else ""
        said = Verdict(
            f"{network.count} weights", "not identified",
            "no weight means anything by itself; judge the network by its predictions of trials kept back",
        )  # fmt: skip
        return Fit(
            replace(plan.ship, model=replace(plan.model, network=network)), (), none, none, np.zeros((0, 0)), none, (),
            (said,), stand.history, float(stand.ends[best]), seconds, stand.batches, f"{stand.stopped}{of}", mark,
            stand.ends[:, None],
        )  # fmt: skip


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
_FIRST, _SECOND, _TINY = 0.9, 0.999, 1e-8
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
    """

    settings: Training
    ship: Ship
    model: Neural
    engine: Engine
    source: Source
    watched: Source | None
    stages: tuple[tuple[int, NDArray[np.int64]], ...]
    watch: tuple[int, NDArray[np.int64]]

    def begin(self, seed: int) -> Any:
        """The first weights of a seed, as the engine has them, float32."""
        network, vector = self.model.network, self.engine.vector
        known = vector.exact(network.weights) if network.trained else vector.joined(initial(network, seed).weights)
        return known.astype(np.float32)

    def network(self, theta: Array) -> Network:
        """The network with weights as the engine has them."""
        return self.model.network.having(self.engine.vector.named(np.asarray(theta, dtype=np.float64)))

    def made(self, theta: Array) -> Ship:
        """The ship with that network."""
        return replace(self.ship, model=replace(self.model, network=self.network(theta)))


@dataclass
class Loop:
    """A running training.

    Attributes:
        checkpoint: file of the stand and the digest in it, or None.
        began: start of the clock, seconds already spent included.
        written: when the file was last written.
        theta, moments, free: weights, moments of Adam and what may move, on the device.
    """

    plan: Plan
    stand: Stand
    checkpoint: tuple[Path, str] | None
    began: float
    progress: Progress | None
    written: float = field(default_factory=time.perf_counter)
    theta: Any = None
    moments: tuple[Any, Any] = (None, None)
    free: Any = None

    def run(self) -> Stand:
        """Train with every seed that is left.

        Raises:
            FitError: the loss stops being a number before the first epoch is over.
        """
        stand, seeds = self.stand, self.plan.settings.seeds
        while stand.seed < len(seeds):
            if not stand.theta.size:
                stand.begin(self.plan.begin(seeds[stand.seed]))
            self._there()
            while not (why := self._epoch()):
                pass
            stand.end(why)
            self._save()
        return stand

    def _epoch(self) -> str:
        """One pass over the windows; why the seed ends with it, or an empty text."""
        stand, plan, own = self.stand, self.plan, self.plan.settings
        rows, starts = self._stage()
        size = min(own.batch, len(starts))
        order = np.random.default_rng([own.seeds[stand.seed], stand.epoch]).permutation(len(starts))
        count = len(starts) // size
        while stand.place < count:
            at = np.sort(order[stand.place * size : (stand.place + 1) * size])
            if wrong := self._step(starts[at], rows, (stand.epoch - 1 + stand.place / count) / own.epochs):
                return self._broken(wrong)
            stand.place += 1
            if time.perf_counter() - self.written > _PAUSE:
                self._save()
        loss = stand.total / count
        seen = self._watched_loss(loss)
        if seen < stand.best_loss:
            stand.best, stand.best_loss, stand.best_epoch = self._here(self.theta), seen, stand.epoch
        shown = math.nan if plan.watched is None else seen
        stand.note(loss, shown, time.perf_counter() - self.began)
        tell(self.progress, (len(stand.history), loss, shown), partial(plan.made, stand.best))
        stand.epoch, stand.place, stand.total = stand.epoch + 1, 0, 0.0
        if stand.epoch > own.epochs:
            return f"{own.epochs} epochs done"
        before_last = -(-(len(plan.stages) - 1) * own.epochs // len(plan.stages))  # epochs
        last = self._stage()[0] == plan.stages[-1][0]
        if last and stand.epoch - 1 - max(stand.best_epoch, before_last) >= own.patience:
            return f"no better for {own.patience} epochs"
        if time.perf_counter() - self.written > _QUICK:
            self._save()
        return ""

    def _stage(self) -> tuple[int, NDArray[np.int64]]:
        """Windows of this epoch: the curriculum has an even share of the epochs for each length."""
        stages = self.plan.stages
        return stages[min((self.stand.epoch - 1) * len(stages) // self.plan.settings.epochs, len(stages) - 1)]

    def _weighted(self, each: Sequence[float]) -> float:
        """The loss of losses by channel."""
        share = self.plan.settings.acceleration
        return (1.0 - share) * sum(each[:6]) + share * sum(each[6:])

    def _step(self, starts: NDArray[np.int64], rows: int, done: float) -> str:
        """One update of the weights; what is not a number, or an empty text."""
        import torch

        stand, own, (mean, square) = self.stand, self.plan.settings, self.moments
        loss, gradient = self.plan.engine.losses(self.theta, self.plan.source.batch(starts, rows))
        each = loss.tolist()
        if not all(map(math.isfinite, each)):
            return next(CHANNELS[k] for k in _BLAMED if not math.isfinite(each[k]))
        if gradient is None or not bool(torch.isfinite(gradient).all()):
            return "the gradient"
        stand.steps += 1
        stand.batches += 1
        stand.total += self._weighted(each)
        rate = own.learning_rate * (0.5 * (1.0 + math.cos(math.pi * done)) if own.schedule == "cosine" else 1.0)
        mean.mul_(_FIRST).add_(gradient, alpha=1.0 - _FIRST)
        square.mul_(_SECOND).addcmul_(gradient, gradient, value=1.0 - _SECOND)
        bias = 1.0 - _FIRST**stand.steps, math.sqrt(1.0 - _SECOND**stand.steps)
        step = mean / (square.sqrt() / bias[1] + _TINY)
        self.theta.add_(step * self.free, alpha=-rate / bias[0])
        return ""

    def _broken(self, wrong: str) -> str:
        """The message for a loss that is not finite.

        Raises:
            FitError: there is nothing better to keep than where it began.
        """
        stand = self.stand
        seed = self.plan.settings.seeds[stand.seed]
        where = f"seed {seed}, epoch {stand.epoch}, batch {stand.place + 1}: {wrong}"
        if not stand.best_epoch:
            raise FitError(f"the loss is not a number in {where}; lower learning_rate or shorten the horizon")
        return f"the loss is not a number in {where}; kept the weights of epoch {stand.best_epoch}"

    def _watched_loss(self, otherwise: float) -> float:
        """Loss of the validation windows; that of the training where there are none."""
        plan, size = self.plan, self.plan.settings.batch
        if plan.watched is None:
            return otherwise
        (rows, starts), total = plan.watch, 0.0
        for part in (starts[k : k + size] for k in range(0, len(starts), size)):
            each = plan.engine.losses(self.theta, plan.watched.batch(part, rows), gradient=False)[0].tolist()
            total += len(part) * self._weighted(each)
        return total / len(starts) if math.isfinite(total) else math.inf

    def _there(self) -> None:
        """The stand's vectors on the device."""
        import torch

        stand, engine = self.stand, self.plan.engine
        given = (stand.theta, stand.mean, stand.square, engine.vector.free.astype(np.float32))
        self.theta, mean, square, self.free = (torch.tensor(a, device=engine.device) for a in given)
        self.moments = (mean, square)

    def _here(self, a: Tensor) -> Any:
        return a.detach().cpu().numpy().copy()

    def _save(self) -> None:
        stand = self.stand
        if stand.theta.size:
            stand.theta, stand.mean, stand.square = map(self._here, (self.theta, *self.moments))
        if self.checkpoint is not None:
            stand.write(*self.checkpoint)
        self.written = time.perf_counter()


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
    history: Array = field(default_factory=lambda: np.zeros((0, 4)))
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
        kept = kept_arrays(path, digest, (f.name for f in fields(Stand))) or {}
        return Stand(**{name: value.item() if value.ndim == 0 else value for name, value in kept.items()})
