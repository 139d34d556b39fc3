"""Objective of many candidates, summed while their trajectories are integrated: only the scores are returned.

Reading back every state of a generation of candidates and reducing it costs more than simulating it, so
the weighted squares are summed in the memory of the compiled step.  Inputs that are constant over all samples (a
calm sea, steady revolutions, a weight) are parameters, the others series.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...data import Array, Trial
from ...engine import Scalars, System
from ...engine.rollout import Simulator, simulator
from ...environment import CHANNELS
from ...models import STATES
from ...ships import Ship
from ...simulate.approach import substeps
from ...simulate.loop import open_loop, open_loop_memory, open_loop_parameters
from .. import Problem, StudyError
from ..nuisance import held
from ..record import Windows, windows

# Steps times lanes below which threads cost more than they bring.
_WORTH_A_THREAD = 100_000


@dataclass(frozen=True)
class Layout:
    """Which inputs change with time, which states are compared, and whether one mask holds for all of them.

    Attributes:
        moving: positions, among controls and environment, of the inputs that change with time.
        held: values of the others, by position.
        compared: positions among `STATES` of the states that the loss compares.
        weights: constant weight of each compared state; empty if weights are series.
    """

    moving: tuple[int, ...]
    held: Mapping[int, float]
    compared: tuple[int, ...]
    weights: tuple[float, ...]


def scored(ship: Ship, layout: Layout) -> System:
    """`ship` under given inputs, whose memory is the sum of weighted squared errors so far."""
    plain = open_loop(ship)
    inputs, n = plain.series, len(layout.compared)
    own = ("mask",) if layout.weights else tuple(f"weight.{STATES[k]}" for k in layout.compared)
    series = (*(inputs[k] for k in layout.moving), *(f"measured.{STATES[k]}" for k in layout.compared), *own)
    held = tuple(f"held.{inputs[k]}" for k in layout.held)
    weights = tuple(f"weight.{STATES[k]}" for k in layout.compared) if layout.weights else ()
    first, second = len(plain.parameters), len(plain.parameters) + len(held)

    def completed(given: Scalars, p: Scalars) -> Scalars:
        """Controls and environment in their usual order."""
        found = dict(zip(layout.moving, given, strict=False)) | dict(zip(layout.held, p[first:second], strict=True))
        return tuple(found[k] for k in range(len(inputs)))

    def before(t: Any, dt: Any, state: Scalars, memory: Scalars, given: Scalars, p: Scalars) -> Any:
        m = len(layout.moving)
        measured, tail = given[m : m + n], given[m + n :]
        parts = p[second:] if layout.weights else tail
        errors = [state[k] - y for k, y in zip(layout.compared, measured, strict=True)]
        score: Any = sum(w * e * e for w, e in zip(parts, errors, strict=True))
        if layout.weights:
            score = tail[0] * score
        acting, remembered = completed(given[:m], p), memory[1:]
        if plain.before is not None:
            acting, remembered, _ = plain.before(t, dt, state, remembered, acting, p[:first])
        return acting, (memory[0] + score, *remembered), ()

    def derivative(state: Scalars, acting: Scalars, p: Scalars) -> Scalars:
        return plain.derivative(state, acting, p[:first])

    return System(
        states=plain.states, series=series, parameters=(*plain.parameters, *held, *weights),
        derivative=derivative, memory=("score", *plain.memory), acting=plain.acting or inputs, before=before,
    )  # fmt: skip


@dataclass(frozen=True)
class Scoring:
    """The loss of a problem for many candidates at once.

    Attributes:
        windows: the windows of all trials, cut as `Trajectory` cuts them.
        kernel: compiled with the free parameters lanewise.
        parameters: shared values; those of the free parameters are not used.
        series: shape (windows, steps, series).
        memory: initial memory of each window, shape (windows, memory).
    """

    problem: Problem
    windows: Windows
    kernel: Simulator
    parameters: Array
    series: Array
    memory: Array
    method: str
    threads: int | None

    @staticmethod
    def build(
        problem: Problem, trials: Sequence[Trial], sigma: Mapping[str, float], *,
        window: float, dt: float, every: int, method: str, threads: int | None,
    ) -> Scoring:  # fmt: skip
        """Cut the windows, find the inputs that change, and compile.

        Raises:
            StudyError: the problem has nuisances, which only the gradient estimators eliminate.
        """
        if held(problem):
            raise StudyError("this estimator takes no [nuisance]; leave it out, or use shooting:Trajectory")
        cut = windows(
            trials, problem.ship.model, problem.loss, sigma, window=window, dt=dt, every=every,
            substeps=substeps(problem.ship, dt, method),
        )  # fmt: skip
        layout, series = laid_out(cut)
        parameters = np.array([*open_loop_parameters(problem.ship), *layout.held.values(), *layout.weights])
        own = open_loop_memory(problem.ship, cut.state0, cut.series[:, 0, : -len(CHANNELS)])
        zero = np.zeros((cut.state0.shape[0], 1))
        return Scoring(
            problem, cut, simulator(scored(problem.ship, layout), problem.vector.paths), parameters, series,
            zero if own is None else np.hstack([zero, own]), method, threads,
        )  # fmt: skip

    def begun(self, offset: Array) -> Scoring:
        """The same with these offsets of the initial states from the recorded ones, shape (windows, 6)."""
        state0 = self.windows.state0.copy()
        state0[:, : len(STATES)] += offset
        return replace(self, windows=replace(self.windows, state0=state0))

    def batch(self, size: int) -> Batch:
        """A batch that scores `size` candidates at a time."""
        w = self.series.shape[0]
        return Batch(
            self, size, self.kernel.pack(np.repeat(self.series, size, axis=0)),
            np.repeat(self.windows.state0, size, axis=0), np.repeat(self.memory, size, axis=0), w,
        )  # fmt: skip

    def prior(self, candidates: Array) -> Array:
        """Squared distance from the prior mean in its sigma, shape (candidates,)."""
        vector = self.problem.vector
        return ((candidates - vector.mean) ** 2 * vector.precision).sum(axis=1)


@dataclass(frozen=True)
class Batch:
    """A `Scoring` with its series repeated for `size` candidates, the candidates of a window side by side."""

    scoring: Scoring
    size: int
    packed: Any
    state0: Array
    memory0: Array
    windows: int

    @property
    def threads(self) -> int | None:
        """As set; one if the work ends before a second thread has started."""
        work = self.size * self.windows * self.scoring.windows.steps
        return 1 if self.scoring.threads is None and work < _WORTH_A_THREAD else self.scoring.threads

    def per_window(self, candidates: Array) -> Array:
        """Weighted squares of each candidate in each window, shape (size, windows); inf where it blows up.

        Args:
            candidates: values of the free parameters, shape (size, free).
        """
        own = self.scoring
        with np.errstate(all="ignore"):
            run = own.kernel.run(
                self.state0, self.packed, own.parameters, memory0=self.memory0,
                lanewise=np.tile(candidates, (self.windows, 1)), dt=own.windows.dt, steps=own.windows.steps + 1,
                every=own.windows.steps, method=own.method, threads=self.threads,
            )  # fmt: skip
        score = run.values[:, -1, len(own.kernel.system.states)].reshape(self.windows, self.size).T
        return np.where(np.isfinite(score), score, np.inf)

    def costs(self, candidates: Array) -> Array:
        """Objective of each candidate, prior included, shape (size,)."""
        return self.per_window(candidates).sum(axis=1) + self.scoring.prior(candidates)


def laid_out(cut: Windows) -> tuple[Layout, Array]:
    """The layout of windows, and their series in its order, shape (windows, steps, series)."""
    lanes, steps, inputs = cut.series.shape
    constant = [bool(np.all(cut.series[:, :, k] == cut.series[0, 0, k])) for k in range(inputs)]
    rows = cut.every * np.arange(cut.measured.shape[1])
    measured, weight = np.zeros((lanes, steps, len(STATES))), np.zeros((lanes, steps, len(STATES)))
    measured[:, rows], weight[:, rows] = cut.measured, cut.scale**2
    compared = tuple(k for k in range(len(STATES)) if weight[:, :, k].any())
    mask = np.any(weight > 0, axis=2)
    weights = tuple(float(weight[:, :, k].max()) for k in compared)
    alike = all(np.array_equal(weight[:, :, k], w * mask) for k, w in zip(compared, weights, strict=True))
    layout = Layout(
        tuple(k for k in range(inputs) if not constant[k]),
        {k: float(cut.series[0, 0, k]) for k in range(inputs) if constant[k]}, compared, weights if alike else (),
    )  # fmt: skip
    tail = mask[:, :, None] if alike else weight[:, :, list(compared)]
    parts = (cut.series[:, :, list(layout.moving)], measured[:, :, list(compared)], tail)
    whole = np.concatenate(parts, axis=2)
    # The last sample is scored in the step that leaves it, which needs inputs and counts for nothing.
    beyond = np.where(np.arange(whole.shape[2]) < len(layout.moving), whole[:, -1:], 0.0)
    return layout, np.ascontiguousarray(np.concatenate([whole, beyond], axis=1), dtype=np.float64)
