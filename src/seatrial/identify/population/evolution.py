"""Fitting by CMA-ES: whole generations, restarts with doubled population, the box kept by a penalty.

Suyama 2023 section 5: covariance matrix adaptation (Hansen) with restarts (Auger and Hansen 2005) within a
box.  The strategy itself is the library `cmaes`; this module adds the objective, which scores a generation in
one kernel call, the box, the stopping rule, and the record from which a killed run resumes.

The record holds the scores of each generation, appended as they come.  The search is a function of its seed and of
these numbers, so replaying them restores it bit for bit; the inner state of the strategy is not stored.
"""

from __future__ import annotations

import json
import math
import os
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import BinaryIO, Self

import numpy as np

from ...core.files import write_whole
from ...data import Array
from ...engine.rollout import is_rk4
from .. import Fit, FitError, Problem, Progress, StudyError
from ..digest import digest
from ..lint import linted
from ..nuisance import begun_as, checked_initial
from ..record import cut_as
from ..resume import ResumeError, begin_anew
from ..trajectory.gauss_newton import State, minimise
from ..trajectory.objective import TrajectoryObjective
from ..trajectory.shooting import finished
from ..watch import tell, with_values
from .scored import Batch, Scoring

# Steepness of the penalty: in units of the generation's spread of values per squared spread of samples.
_STEEP = 10.0
# A population is as good as converged when its best has not moved for this many generations.
_PATIENCE, _PER_DIMENSION = 10, 30
# The joint descent of parameters and initial states ends after this many iterations, or below this relative decrease.
_JOINED, _CLOSE = 60, 1e-9


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
        own = begun_as(problem, self.initial)
        smooth = TrajectoryObjective.build(own, problem.trials, sigma, **settings)
        watch = Scoring.build(problem, problem.validation, sigma, **settings).batch(1) if problem.validation else None
        print_ = digest(problem, self)
        search = _Search(
            self, problem, Scoring.build(problem, problem.trials, sigma, **settings), watch, smooth, low, high
        )
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
            near = best + self.settings.agreement * abs(best)
            found = sum(bool(one[0] <= near) for one in ends)
            population = min(2 * population, self.settings.largest)
        if not any(np.isfinite(one[0]) for one in ends):
            raise FitError("no candidate of any run can be simulated; " + self.smooth.failure(self.start))
        said = f"{found} of {len(ends)} runs found the same objective to {self.settings.agreement:g}"
        return np.array(ends), begun, np.array(history), said, evaluations

    def joined(self, end: Array, begun: Array) -> tuple[Array, Array]:
        """Parameters and initial states refined together from the end of a run, and these states."""
        if not begun.size or not np.isfinite(end[0]):
            return end, begun
        state = State(end[1:], begun, float(end[0]))
        state = minimise(self.smooth, state, self.low, self.high, iterations=_JOINED, tolerance=_CLOSE,
                         each=lambda _: None)  # fmt: skip
        return np.array([state.cost, *state.p]), state.eta

    @property
    def start(self) -> Array:
        """The declared start."""
        return self.problem.vector.start

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
        batch, bests = self.scoring.begun(self.smooth.layout.starts(begun)).batch(population), []
        patience = _PATIENCE + math.ceil(_PER_DIMENSION * self.low.size / population)
        for _ in range(self.settings.generations):
            asked = np.array([strategy.ask() for _ in range(population)])
            inside = np.clip(asked, 0.0, 1.0)
            values = self.low + (self.high - self.low) * inside
            costs, validation, seconds = record.next(population, lambda v=values: self.scores(batch, v))
            strategy.tell(list(zip(asked, self.told(asked, inside, costs).tolist(), strict=True)))
            k = int(np.argmin(costs))
            yield float(costs[k]), values[k], (float(costs[k]), validation, seconds)
            bests.append(float(costs[k]))
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

    def told(self, asked: Array, inside: Array, costs: Array) -> Array:
        """Values given to the strategy: the objective at the nearest point of the box, plus a penalty on the distance.

        The penalty is measured in the generation's own spread of objectives and of samples, so that it
        neither hides the objective nor lets the mean wander off, whatever their scales.  A candidate
        that cannot be simulated is worse than all others, the more so the farther from the start.
        """
        good = np.isfinite(costs)
        start = np.clip((self.start - self.low) / (self.high - self.low), 0.0, 1.0)
        far = ((inside - start) ** 2).sum(axis=1)
        if not good.any():
            return far
        quarter = np.quantile(costs[good], [0.25, 0.75])
        away = ((asked - inside) ** 2).sum(axis=1) / max(float(asked.var(axis=0).mean()), 1e-300)
        worst = float(costs[good].max())
        heard = np.where(good, costs, worst + (1.0 + far) * max(abs(worst), 1e-300))
        return heard + _STEEP * float(quarter[1] - quarter[0]) * away


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
            raise ResumeError(f"{path} belongs to another problem; choose another output folder")
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
            self._at(8 * (size + 2))
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

    def _at(self, step: int) -> None:
        """Move past a generation that was read back, so that a torn one after it is overwritten."""
        if self.stream is not None:
            if self.stream.tell() == 0:
                self.stream.readline()
            self.stream.seek(step, os.SEEK_CUR)
