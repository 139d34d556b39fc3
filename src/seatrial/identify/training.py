"""Training a network on trials (Wakita 2022 section 2.2): estimator of a study whose ship is of the family `Neural`.

PyTorch, of the extra `neural`, is imported when a training begins and never before.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..data import Array
from ..engine.rollout import default_threads
from ..models.network import KINDS, Limits, Network, initial
from ..models.network_pass import accelerations
from ..models.neural import Neural
from ..parameters import ParameterError, unknown
from ..ships import Ship
from . import Fit, Problem, Progress, StudyError, Verdict
from .linted import linted
from .training_data import Rows, Source, answers, typical, weights_of_errors
from .training_engine import Engine, Form, one_thread_each
from .training_loop import Loop, Plan
from .training_record import Stand

EXTRA = "pip install 'seatrial[neural]'"

# Limits of a trained network: its inputs may leave the range of the training files by this share of it, its
# answers their largest by this factor.
_MARGIN, _HEADROOM = 0.25, 1.5
_SAMPLES = 4096


class NoTorchError(StudyError):
    """PyTorch is absent or fails to load, so that no network can be trained here; other fits can be made."""


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
        from .digest import digest

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
