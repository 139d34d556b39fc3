"""Local and global optimisation of trajectories: Algorithm 1 of You 2023 as a schedule that always has an answer.

LO is a prediction over short stretches from measured states, or, where the momentum balance is linear in all
parameters, one linear system.  GO is the whole trajectory by multiple shooting.  Trials are added step by step,
each GO begins where the last one ended, and LO is the way back in where it stalls.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..data import Array, DataError, Trial
from ..engine.rollout import is_rk4
from ..models import STATES
from . import Fit, FitError, Nuisance, Problem, Progress, StudyError
from .batch import prior as priors
from .chains import chains
from .condensed import Condensed, Point
from .constraints import Inequalities, Penalty
from .descent import Search, descend
from .gauss_newton import Normal
from .ipopt import FullSpace
from .momentum import momentum_guess
from .shooting import digest
from .verdicts import posterior, verdicts
from .windows import spread

_SCHEDULES, _INITIAL = ("lo", "go", "logo"), ("free", "measured")
_BACK_ENDS, _HESSIANS = ("engine", "ipopt"), ("gauss-newton", "exact")
# LO windows are shares of GO's, the last ones a single compared row; steps of a local descent at most.
_LADDER, _LOCAL = (1.0, 0.2, 0.0), 12
# Weight of a squared violation (relative) per sample; rounds of the multipliers of constraints.
_STIFF, _ROUNDS = 1e5, 6


@dataclass(frozen=True)
class Shooting:
    """Estimator: whole trajectories by multiple shooting, first guess and way back in by short predictions.

    Attributes:
        schedule: "lo" alone, "go" from the declared start (over growing windows), or "logo": LO first, then GO.
        growth: trials that are added at a time; 0 takes all at once.
        window: length of the windows of multiple shooting [s].
        smooth: length over which measured velocities are smoothed for LO [s].
        every: compare every so many steps.
        dt: time step [s]; None takes the median step of the trials.
        method: "euler" or "rk4".
        ridge: weight of the squared offset from the start, relative to the start (absolute where that is zero).
        constraints: whether You 2023 Eqs. 18-19 are kept (`constraints`).
        initial: first state of each trial "free", its measurement counting as any other row, or as "measured".
        weights: of the manoeuvres by trial name; 1 where not named.
        back_end: "engine", or "ipopt" (CasADi), to which `hessian` belongs: "gauss-newton" or "exact".
        iterations, tolerance: stop after so many, or when the relative decrease is smaller.
        threads: None takes every processor.
    """

    schedule: str = "logo"
    growth: int = 0
    window: float = 5.0
    smooth: float = 1.0
    every: int = 1
    dt: float | None = None
    method: str = "rk4"
    ridge: float = 0.0
    constraints: bool = False
    initial: str = "free"
    weights: Mapping[str, float] = field(default_factory=dict[str, float])
    back_end: str = "engine"
    hessian: str = "gauss-newton"
    iterations: int = 60
    tolerance: float = 1e-10
    threads: int | None = None

    def __post_init__(self) -> None:
        for name in ("window", "smooth", "every", "dt", "iterations", "tolerance"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise StudyError(f"estimator.{name} is {value:g}; it must be above zero")
        for name in ("growth", "ridge"):
            if not getattr(self, name) >= 0:
                raise StudyError(f"estimator.{name} is {getattr(self, name):g}; it must be zero or above")
        for name, known in (("schedule", _SCHEDULES), ("initial", _INITIAL), ("back_end", _BACK_ENDS),
                            ("hessian", _HESSIANS)):  # fmt: skip
            if getattr(self, name) not in known:
                raise StudyError(f"estimator.{name} is '{getattr(self, name)}'; known: {', '.join(known)}")
        for name, weight in self.weights.items():
            if not weight > 0:
                raise StudyError(f"estimator.weights of {name} is {weight:g}; it must be above zero")
        is_rk4(self.method)

    def fit(self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None) -> Fit:
        """Estimate the free parameters of `problem`; see `Estimator`.

        A fit takes about a second, so nothing is kept in `checkpoint`: a killed run starts anew.

        Raises:
            StudyError: nuisances, or weights of trials that there are not.
            FitError: no prediction, however short, is finite.
        """
        began = time.perf_counter()
        self._check(problem)
        run = _Run.of(self, problem, began, progress)
        p = np.array([f.start for f in problem.free])
        for count in self._stages(len(problem.trials)):
            p = run.early(problem.trials[:count], p)
        stage = run.stage(problem.trials)
        p, nodes = run.local(stage, p) if self.schedule == "lo" else run.whole(stage, p)
        return run.finished(stage, p, nodes)

    def _stages(self, count: int) -> list[int]:
        """How many trials take part before all do, stage by stage (You 2023 Algorithm 1)."""
        return [*range(self.growth, count, self.growth)] if self.growth and self.schedule != "lo" else []

    def _check(self, problem: Problem) -> None:
        if problem.nuisance != Nuisance():
            raise StudyError("logo:Shooting takes no [nuisance]; say initial = \"free\", or use shooting:Trajectory")
        names = [trial.name for trial in problem.trials]
        for name in (name for name in self.weights if name not in names):
            raise StudyError(f"estimator.weights names '{name}'; the trials are {', '.join(names)}")


def _warm(stage: Condensed, p: Array) -> tuple[Array, Array]:
    """Parameters as they are, windows from measured states."""
    return p, stage.chains.nodes


@dataclass
class _Run:
    """One fit as it goes on: what stays the same over its stages, and what it has cost so far."""

    settings: Shooting
    problem: Problem
    sigma: Mapping[str, float]
    dt: float
    span: Array
    anchor: Array
    inequalities: Inequalities
    began: float
    progress: Progress | None
    history: list[tuple[float, float, float, float]] = field(default_factory=list[tuple[float, float, float, float]])
    evaluations: int = 0
    status: str = ""

    @staticmethod
    def of(settings: Shooting, problem: Problem, began: float, progress: Progress | None) -> _Run:
        free = problem.free
        sigma = dict(problem.loss.sigma) or spread(problem.trials)
        dt = settings.dt or float(np.median([t.dt for t in problem.trials]))
        start = np.array([f.start for f in free])
        mean, prior = priors(free)
        ridge = settings.ridge * np.where(start != 0, np.abs(start), 1.0) ** -2.0
        weight = prior + ridge
        middle = (prior * mean + ridge * start) / np.where(weight > 0, weight, 1.0)
        anchor = np.array([np.where(weight > 0, middle, start), weight])
        full = sigma if len(sigma) == len(STATES) else {**spread(problem.trials), **sigma}
        unseen = [1.0] * (len(problem.ship.model.states) - len(STATES))
        make = Inequalities.of if settings.constraints else Inequalities.none
        return _Run(
            settings, problem, sigma, dt, np.array([*(full[n] for n in STATES), *unseen]), anchor,
            make(problem), began, progress,
        )  # fmt: skip

    @property
    def bounds(self) -> tuple[Array, Array]:
        return np.array([f.low for f in self.problem.free]), np.array([f.high for f in self.problem.free])

    def each(self, search: Search) -> None:
        self.history.append((len(self.history) + 1.0, search.cost, float("nan"), time.perf_counter() - self.began))
        if self.progress:
            self.progress(len(self.history), search.cost, float("nan"))

    def stage(self, trials: tuple[Trial, ...], window: float | None = None) -> Condensed:
        """The objective of some trials, cut into windows."""
        own, part = self.settings, replace(self.problem, trials=trials)
        cut = chains(
            trials, part.ship.model, part.loss, self.sigma, window=own.window if window is None else window,
            dt=self.dt, every=own.every, weights=own.weights,
        )  # fmt: skip
        penalty = Penalty(self.inequalities, _STIFF * max(cut.samples, 1), np.zeros(len(self.inequalities.names)))
        return Condensed.build(
            part, cut, anchor=self.anchor, penalty=penalty, freed=own.initial == "free", span=self.span,
            method=own.method, threads=own.threads,
        )  # fmt: skip

    def local(self, stage: Condensed, p: Array) -> tuple[Array, Array]:
        """LO: the momentum balance where it is linear, else (or where it fails) short predictions."""
        own, cut = self.settings, stage.chains
        guess = momentum_guess(stage.problem, cut, smooth=own.smooth, span=0.8 * own.window, start=p)
        if guess is not None and np.isfinite(stage.cost(Point(guess, cut.nodes))[0]):
            self.status = "solved: momentum balance"
            return guess, cut.nodes
        return self.short(stage, p), cut.nodes

    def short(self, stage: Condensed, p: Array) -> Array:
        """Predictions from measured states over windows that grow from the longest that is finite at `p`."""
        begun = False
        for share in reversed(_LADDER):
            rung = stage if share == 1.0 else self.stage(stage.problem.trials, share * self.settings.window)
            search = descend(
                replace(rung, linked=False), Point(p, rung.chains.nodes), *self.bounds, iterations=_LOCAL,
                tolerance=1e-3, each=self.each,
            )  # fmt: skip
            self.evaluations += search.evaluations
            begun, p = begun or bool(np.isfinite(search.cost)), search.point.p
        self.status = "short predictions"
        if not begun:
            raise FitError(f"{self.problem.ship.name}: the model blows up in one step of {self.dt:g} s at the start")
        return p

    def early(self, trials: tuple[Trial, ...], p: Array) -> Array:
        """GO of some trials; as it was where so few do not determine the parameters."""
        try:
            return self.whole(self.stage(trials), p)[0]
        except (FitError, DataError):
            self.status = ""
            return p

    def whole(self, stage: Condensed, p: Array) -> tuple[Array, Array]:
        """GO, warm from `p` if that joins; LO where it does not (You 2023 Algorithm 1, lines 4-8)."""
        ways = [self.curriculum, self.local] if self.settings.schedule == "go" else [self.local, self.curriculum]
        ends: list[Search] = []
        for way in ([_warm, *ways] if self.status == "converged" else ways):
            try:
                end = self.joined(stage, Point(*way(stage, p)))
            except (FitError, np.linalg.LinAlgError):
                continue
            ends.append(end)
            if end.closed and end.done == "converged":
                break
        best = min((end for end in ends if end.closed), key=lambda end: end.cost, default=None)
        if best is None:
            raise FitError(f"{self.problem.ship.name}: no trajectory could be joined, from the start or from LO")
        self.status = best.done
        return best.point.p, best.point.nodes

    def curriculum(self, stage: Condensed, p: Array) -> tuple[Array, Array]:
        """Cold start: short predictions over growing windows."""
        return self.short(stage, p), stage.chains.nodes

    def joined(self, stage: Condensed, start: Point) -> Search:
        """Multiple shooting from `start`, multipliers of the constraints included."""
        own = self.settings
        if own.back_end == "ipopt":
            return self.by_ipopt(stage, start)
        end = Search(start, np.inf)
        for _ in range(_ROUNDS):
            end = descend(
                stage, end.point, *self.bounds, iterations=own.iterations, tolerance=own.tolerance, each=self.each
            )
            self.evaluations += end.evaluations
            pushed = stage.penalty.pushed(end.point.p)
            if np.allclose(pushed.push, stage.penalty.push, rtol=1e-6, atol=1e-12):
                break
            stage = replace(stage, penalty=pushed)
        return end

    def by_ipopt(self, stage: Condensed, start: Point) -> Search:
        """The same by IPOPT, every compared row a node of its own."""
        own, cut = self.settings, stage.chains
        fine = self.stage(stage.problem.trials, self.dt * own.every).chains
        programme = FullSpace.build(
            stage.problem, fine, anchor=self.anchor, inequalities=self.inequalities, freed=stage.freed,
            span=self.span, method=own.method, exact=own.hessian == "exact", iterations=2 * own.iterations,
            tolerance=max(1e4 * own.tolerance, 1e-8),
        )  # fmt: skip
        found = programme.solve(start.p, fine.nodes, *self.bounds)
        jump = (cut.steps - 1) // cut.every
        first = np.concatenate([np.flatnonzero(fine.trial == t)[::jump] for t in range(cut.trials)])
        point = Point(found.p, found.nodes[first])
        done = "converged" if found.success else found.status
        search = Search(point, stage.cost(point)[0], iteration=found.iterations, closed=found.success, done=done)
        self.evaluations += found.iterations
        self.each(search)
        return search

    def finished(self, stage: Condensed, p: Array, nodes: Array) -> Fit:
        """The fit, with covariance and verdicts from the condensed normal equations."""
        free, linked = self.problem.free, self.settings.schedule != "lo"
        linear = replace(stage, linked=linked).linear(Point(p, nodes))
        H, g, _ = stage.reduced(linear, 0.0)
        # The ridge is no knowledge of the parameters: it steers, but does not sharpen what is claimed.
        ridge = np.diag(self.anchor[1] - priors(free)[1])
        samples = stage.chains.samples * stage.chains.weight
        variance = linear.data / max(samples - p.size - stage.freed * linear.g.shape[0] * len(STATES), 1.0)
        covariance, shrinkage = posterior(Normal(linear.cost, H - ridge, g), free, variance)
        at_bound = tuple(f.path for f, v in zip(free, p, strict=True) if v <= f.low or v >= f.high)
        ship = self.problem.ship.having({f.path: float(v) for f, v in zip(free, p, strict=True)})
        return Fit(
            ship=ship, free=free, values=p, sigma=np.sqrt(np.diag(covariance)), covariance=covariance,
            shrinkage=shrinkage, at_bound=at_bound, verdicts=verdicts(free, p, covariance, shrinkage, at_bound),
            history=np.array(self.history, dtype=np.float64).reshape(-1, 4), objective=linear.cost,
            seconds=time.perf_counter() - self.began, evaluations=self.evaluations, status=self.status,
            digest=digest(self.problem, self.settings), ends=np.array([[linear.cost, *p]]),
        )  # fmt: skip
