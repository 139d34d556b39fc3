"""Fitting by CMA-ES: whole generations, restarts with doubled population, the box kept by a penalty.

Suyama 2023 section 5: covariance matrix adaptation (Hansen) with restarts (Auger and Hansen 2005) within a
box.  The strategy itself is the library `cmaes`; this module adds the box, the stopping rule, the record of the scores
of each generation, and the kernel that scores one.  The search is a function of its seed and of these scores, so
replaying them restores a killed run bit for bit; the inner state of the strategy is not stored.

Reading back every state of a generation of candidates and reducing it costs more than simulating it, so the weighted
squares are summed in the memory of the compiled step, and only the sums are returned.  Inputs that are constant over
all samples (a calm sea, steady revolutions, a weight) are parameters, the others series.
"""

from __future__ import annotations

import json
import math
import os
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO, Self

import numpy as np

from ...core.files import write_whole
from ...core.values import dataclass, field, replace
from ...data import Array, Trial
from ...engine import Scalars, System
from ...engine.rollout import is_rk4
from ...environment import CHANNELS
from ...ships import Ship
from ...simulate.approach import substeps
from ...simulate.lanes import Kernel, Lanes, Steps, run
from ...simulate.loop import open_loop, open_loop_memory, open_loop_parameters
from .. import Fit, FitError, Problem, Progress, StudyError
from ..lint import linted
from ..nuisance import begun_as, checked_initial, held
from ..record import Windows, cut_as, windows
from ..resume import begin_anew, digest, foreign
from ..trajectory.gauss_newton import State, minimise
from ..trajectory.local import finished
from ..trajectory.objective import TrajectoryObjective
from ..watch import tell, with_values
from .penalty import KINDS, penalty

# A population is as good as converged when its best has not moved for this many generations.
_PATIENCE, _PER_DIMENSION = 10, 30
# The joint descent of parameters and initial states ends after this many iterations, or below this relative decrease.
_JOINED, _CLOSE = 60, 1e-9
# Steps times lanes below which threads cost more than they bring.
_WORTH_A_THREAD = 100_000


@dataclass(frozen=True)
class Evolution:
    """CMA-ES within the box of the free parameters.

    Attributes:
        window: length of a prediction before it restarts [s]; None runs each trial through.
        every: stride of the compared steps.
        dt: time step [s]; None takes the median step of the trials.
        initial: "free" estimates the initial state of each window: where a run ends, parameters and initial states
            are refined together, and the next run begins from these states.  "measured" takes the row as recorded.
        method: "rk4", in as many steps from row to row as the ship needs (`approach.substeps`), or "euler" by one.
        population: candidates of a generation in the first run; doubled at each restart up to `largest`.
        agree: stop when this many runs have found the best objective, within `agreement` (relative).
        runs: most runs.
        generations: most generations of a run.
        tolerance: a run has converged when its best moves by less than this (relative).
        step: first standard deviation, as a share of the box.
        penalty: how the box is kept, "spread" or "hansen2009"; see `penalty`.
        seed: of all random numbers; the outcome is the same on any number of threads.
        threads: None takes every processor.
    """

    window: float | None = None
    every: int = 1
    dt: float | None = None
    method: str = "rk4"
    initial: str = "free"
    population: int = 12
    largest: int = 128
    agree: int = 3
    agreement: float = 1e-6
    runs: int = 9
    generations: int = 2000
    tolerance: float = 1e-9
    step: float = 0.3
    penalty: str = "spread"
    seed: int = 1
    threads: int | None = None

    def __post_init__(self) -> None:
        for name in ("window", "every", "dt", "agree", "agreement", "runs", "generations", "tolerance", "step"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise StudyError(f"estimator.{name} is {value:g}; it must be above zero")
        if not 4 <= self.population <= self.largest:
            known = f"it lies between 4 and {self.largest}, largest"
            raise StudyError(f"estimator.population is {self.population}; {known}")
        if self.penalty not in KINDS:
            raise StudyError(f"estimator.penalty is {self.penalty!r}; it must be one of {', '.join(KINDS)}")
        is_rk4(self.method)
        checked_initial(self.initial)

    @property
    def starts_remedy(self) -> tuple[str, str]:
        """Remedy for the noise of measured initial states; see `Estimator`."""
        return ("estimator.initial", 'say "free"') if self.initial == "measured" else ("", "")

    @linted
    def fit(self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None) -> Fit:
        """Estimate the free parameters of `problem`; see `Estimator`.

        Raises:
            StudyError: a parameter without a box, or nuisances in the problem.
            FitError: no candidate of any run could be simulated.
        """
        low, high = box(problem)
        sigma, settings = cut_as(problem, self)
        smooth = TrajectoryObjective.build(begun_as(problem, self.initial), problem.trials, sigma, **settings)
        watch = Scoring.build(problem, problem.validation, sigma, **settings).batch(1) if problem.validation else None
        scoring, print_ = Scoring.build(problem, problem.trials, sigma, **settings), digest(problem, self)
        search = _Search(self, problem, scoring, watch, smooth, low, high)
        with Record.open(checkpoint, print_) as record:
            ends, begun, history, status, evaluations = search.go(record, progress)
        best = ends[int(np.argmin(ends[:, 0]))]
        return replace(
            finished(problem, smooth, best[1:], begun, history, evaluations, status, print_),
            objective=float(best[0]), seconds=float(history[-1, 3]), ends=ends,
        )  # fmt: skip


def box(problem: Problem) -> tuple[Array, Array]:
    """Bounds of the free parameters; three sigma about the prior where only that holds one.

    Raises:
        StudyError: a parameter with neither.
    """
    low, high = problem.vector.box
    for f, known in zip(problem.free, np.isfinite(low) & np.isfinite(high), strict=True):
        if not known:
            raise StudyError(f"free: {f.path} has no range; evolution needs ratio, low and high, or a prior")
    return low, high


@dataclass(frozen=True)
class _Search:
    """The runs of one fit; positions within the box go from 0 to 1."""

    settings: Evolution
    problem: Problem
    scoring: Scoring
    watch: Batch | None
    smooth: TrajectoryObjective
    low: Array
    high: Array

    def go(self, record: Record, progress: Progress | None) -> tuple[Array, Array, Array, str, int]:
        """Ends of the runs (objective, values), starts, history, why it stopped, and how many evaluations it took."""
        ends: list[Array] = []
        begun = np.zeros(self.smooth.nuisances)
        history: list[tuple[float, float, float, float]] = []
        evaluations, population, found = 0, self.settings.population, 0
        while len(ends) < self.settings.runs and found < self.settings.agree:
            end = np.full(self.low.size + 1, np.inf)
            for objective, values, row in self.run(len(ends), population, record, begun):
                evaluations += population
                end = np.array([objective, *values]) if objective < end[0] else end
                history.append((len(history) + 1.0, *row))
                best = min((*ends, end), key=lambda one: one[0])[1:]
                ship = with_values(self.problem.ship, self.problem.free, best if np.isfinite(best).all() else values)
                tell(progress, (len(history), row[0], row[1]), ship)
            end, starts = self.joined(end, begun)
            begun = starts if end[0] < min((one[0] for one in ends), default=math.inf) else begun
            ends.append(end)
            best = min(one[0] for one in ends)
            found = sum(bool(one[0] <= best + self.settings.agreement * abs(best)) for one in ends)
            population = min(2 * population, self.settings.largest)
        if not any(np.isfinite(one[0]) for one in ends):
            why = self.smooth.failure(self.problem.vector.start)
            raise FitError(f"no candidate of any run can be simulated; {why}")
        said = f"{found} of {len(ends)} runs found the same objective to {self.settings.agreement:g}"
        return np.array(ends), begun, np.array(history), said, evaluations

    def joined(self, end: Array, begun: Array) -> tuple[Array, Array]:
        """Parameters and initial states refined together from the end of a run, and these states."""
        if not begun.size or not np.isfinite(end[0]):
            return end, begun
        state = minimise(
            self.smooth, State(end[1:], begun, float(end[0])), self.low, self.high,
            iterations=_JOINED, tolerance=_CLOSE, each=lambda _: None,
        )  # fmt: skip
        return np.array([state.cost, *state.p]), state.eta

    def run(
        self, number: int, population: int, record: Record, begun: Array
    ) -> Iterator[tuple[float, Array, tuple[float, float, float]]]:
        """One run from these starts: by generation best objective, values, and (objective, validation, seconds)."""
        from cmaes import CMA

        draw = np.random.default_rng([self.settings.seed, number])
        strategy = CMA(
            mean=draw.random(self.low.size), sigma=self.settings.step, population_size=population,
            seed=int(draw.integers(2**31)),
        )  # fmt: skip
        start = np.clip((self.problem.vector.start - self.low) / (self.high - self.low), 0.0, 1.0)
        keeps = penalty(self.settings.penalty, start)
        batch, bests = self.scoring.begun(self.smooth.layout.starts(begun)).batch(population), []
        patience = _PATIENCE + math.ceil(_PER_DIMENSION * self.low.size / population)
        for _ in range(self.settings.generations):
            asked = np.array([strategy.ask() for _ in range(population)])
            inside = np.clip(asked, 0.0, 1.0)
            values = self.low + (self.high - self.low) * inside
            costs, validation, seconds = record.next(population, lambda v=values: self.scores(batch, v))
            strategy.tell(list(zip(asked, keeps.values(asked, inside, costs, strategy).tolist(), strict=True)))
            k = int(np.argmin(costs))
            bests.append(float(costs[k]))
            yield bests[-1], values[k], (bests[-1], validation, seconds)
            recent = bests[-patience:]
            still = len(bests) > patience and max(recent) - min(recent) <= self.settings.tolerance * abs(min(recent))
            if still or strategy.should_stop():
                return

    def scores(self, batch: Batch, values: Array) -> tuple[Array, float]:
        """Objectives of a generation, and what its best would score in validation."""
        costs = batch.costs(values)
        if not np.isfinite(costs).any():
            warnings.warn(
                f"every candidate of a generation fails ({self.smooth.failure(values[0])}); the search "
                "contracts towards the declared start", stacklevel=2,
            )  # fmt: skip
        if self.watch is None:
            return costs, math.nan
        windows = self.watch.scoring.windows
        seen = float(self.watch.per_window(values[int(np.argmin(costs))][None]).sum())
        return costs, seen / (windows.weight * max(windows.samples, 1))


@dataclass
class Record:
    """Generations in order; the only mutable state of a search.

    Attributes:
        old: numbers of an earlier process that were not used yet.
        stream: where new ones go; None keeps nothing.
        began: start of the clock, seconds already spent included.
    """

    old: Array
    stream: BinaryIO | None
    began: float = field(default_factory=time.perf_counter)

    @staticmethod
    def open(path: Path | None, digest: str) -> Record:
        """Read `path` if it holds this problem; an empty record if there is no file.

        Raises:
            ResumeError: the file belongs to another problem.
        """
        if path is None:
            return Record(np.zeros(0), None)
        head = (json.dumps({"digest": digest}) + "\n").encode()
        if not path.exists() or path.stat().st_size < len(head):
            write_whole(path, head)
            return Record(np.zeros(0), path.open("ab"))
        whole = path.read_bytes()
        if not whole.startswith(head):
            if not whole.startswith(b'{"digest": '):
                begin_anew(path)
                return Record.open(path, digest)
            raise foreign(path)
        numbers = np.frombuffer(whole[len(head) : len(head) + (len(whole) - len(head)) // 8 * 8], dtype="<f8").copy()
        return Record(numbers, path.open("r+b"))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.stream is not None:
            self.stream.close()

    def next(self, size: int, score: Callable[[], tuple[Array, float]]) -> tuple[Array, float, float]:
        """Scores of the next generation, its validation and the seconds so far; `score` is asked where none is kept.

        A generation is kept as (seconds, validation, scores...); one that was cut short by a kill is scored again.
        """
        if self.old.size >= size + 2:
            row, self.old = self.old[: size + 2], self.old[size + 2 :]
            self.began = time.perf_counter() - float(row[0])
            # Past what was read back, so that a torn generation after it is overwritten.
            if self.stream is not None:
                if self.stream.tell() == 0:
                    self.stream.readline()
                self.stream.seek(8 * (size + 2), os.SEEK_CUR)
            return row[2:], float(row[1]), float(row[0])
        if self.stream is not None and self.old.size:
            self.stream.truncate(self.stream.tell() or None)
        self.old = np.zeros(0)
        costs, validation = score()
        seconds = time.perf_counter() - self.began
        if self.stream is not None:
            try:
                self.stream.write(np.array([seconds, validation, *costs], dtype="<f8").tobytes())
                self.stream.flush()
            except OSError as error:
                raise OSError(error.errno, error.strerror, self.stream.name) from error
        return costs, validation, seconds


@dataclass(frozen=True)
class Layout:
    """Which inputs change with time, which states are compared, and whether one mask holds for all of them.

    Attributes:
        moving: positions, among controls and environment, of the inputs that change with time.
        held: values of the others, by position.
        compared: positions among the states of those that the loss compares.
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
    each = tuple(f"weight.{ship.model.motion[k]}" for k in layout.compared)
    own, weights = (("mask",), each) if layout.weights else (each, ())
    series = (*(inputs[k] for k in layout.moving), *(f"measured.{ship.model.motion[k]}" for k in layout.compared), *own)
    held = tuple(f"held.{inputs[k]}" for k in layout.held)
    first, second = len(plain.parameters), len(plain.parameters) + len(held)

    def before(t: Any, dt: Any, state: Scalars, memory: Scalars, given: Scalars, p: Scalars) -> Any:
        m = len(layout.moving)
        measured, tail = given[m : m + n], given[m + n :]
        parts = p[second:] if layout.weights else tail
        errors = [state[k] - y for k, y in zip(layout.compared, measured, strict=True)]
        score: Any = sum(w * e * e for w, e in zip(parts, errors, strict=True))
        if layout.weights:
            score = tail[0] * score
        found = dict(zip(layout.moving, given, strict=False)) | dict(zip(layout.held, p[first:second], strict=True))
        acting: Scalars = tuple(found[k] for k in range(len(inputs)))
        remembered = memory[1:]
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
    kernel: Kernel
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
        if held(problem) or np.isfinite(list(problem.nuisance.initial.values())).any():
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
            problem, cut, Kernel(scored(problem.ship, layout), problem.vector.paths), parameters, series,
            zero if own is None else np.hstack([zero, own]), method, threads,
        )  # fmt: skip

    def begun(self, offset: Array) -> Scoring:
        """The same with these offsets of the initial states from the recorded ones, shape (windows, motion)."""
        state0 = self.windows.state0.copy()
        state0[:, : offset.shape[1]] += offset
        return replace(self, windows=replace(self.windows, state0=state0))

    def batch(self, size: int) -> Batch:
        """A batch that scores `size` candidates at a time."""
        series, state0, memory = (np.repeat(a, size, axis=0) for a in (self.series, self.windows.state0, self.memory))
        lanes = Lanes(self.kernel, self.parameters, state0, self.kernel.pack(series), memory)
        return Batch(self, size, lanes, len(self.series))

    def prior(self, candidates: Array) -> Array:
        """Squared distance from the prior mean in its sigma, shape (candidates,)."""
        vector = self.problem.vector
        away = candidates - vector.mean
        return (np.einsum("pi,ij->pj", away, vector.precision) * away).sum(axis=1)


@dataclass(frozen=True)
class Batch:
    """A `Scoring` with its series repeated for `size` candidates, the candidates of a window side by side."""

    scoring: Scoring
    size: int
    lanes: Lanes
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
        own, cut = self.scoring, self.scoring.windows
        with np.errstate(all="ignore"):
            lanes = replace(self.lanes, lanewise=np.tile(candidates, (self.windows, 1)))
            done = run(lanes, Steps(cut.dt, cut.steps + 1, cut.steps, own.method), threads=self.threads)
        score = done.values[:, -1, len(own.kernel.system.states)].reshape(self.windows, self.size).T
        return np.where(np.isfinite(score), score, np.inf)

    def costs(self, candidates: Array) -> Array:
        """Objective of each candidate, prior included, shape (size,)."""
        return self.per_window(candidates).sum(axis=1) + self.scoring.prior(candidates)


def laid_out(cut: Windows) -> tuple[Layout, Array]:
    """The layout of windows, and their series in its order, shape (windows, steps, series)."""
    lanes, steps, inputs = cut.series.shape
    constant = [bool(np.all(cut.series[:, :, k] == cut.series[0, 0, k])) for k in range(inputs)]
    rows = cut.every * np.arange(cut.measured.shape[1])
    measured, weight = np.zeros((lanes, steps, cut.width)), np.zeros((lanes, steps, cut.width))
    measured[:, rows], weight[:, rows] = cut.measured, cut.scale**2
    compared = tuple(k for k in range(cut.width) if weight[:, :, k].any())
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
