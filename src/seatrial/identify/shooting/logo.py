"""Local and global optimisation of trajectories: Algorithm 1 of You 2023 as a schedule that always has an answer.

LO is a prediction over short stretches from measured states, or, where the momentum balance is linear in all
parameters, one linear system (`balance`).  GO is the whole trajectory by multiple shooting.  Trials are added step by
step, each GO begins where the last one ended, and LO is the way back in where it stalls.  A search that grew with its
trials can end at a poor optimum of the whole, so another from the momentum balance stands against it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ...core.values import dataclass, field, replace
from ...data import Array, DataError, Trial
from ...engine.rollout import is_rk4
from ...models import STATES
from ...simulate.approach import substeps
from .. import Fit, FitError, Nuisance, Problem, Progress, StudyError
from ..lint import linted
from ..nuisance import INITIAL
from ..posterior.verdicts import judged
from ..record import Settings, scales, spread, step_of
from ..resume import digest
from ..trajectory.gauss_newton import Normal
from ..trajectory.local import WINDOW, Cut
from ..trajectory.objective import TrajectoryObjective
from ..vector import Vector
from ..watch import tell, with_values
from .balance import momentum_guess
from .chains import chains
from .condensed import DAMPING, Condensed, Point, Search, descend
from .constraints import Inequalities, Penalty
from .ipopt import FullSpace

Way = Callable[[Condensed, Array], Point]
"""Where a search of whole trajectories begins."""

_KNOWN = {"schedule": ("lo", "go", "logo"), "initial": INITIAL, "back_end": ("engine", "ipopt"),
          "hessian": ("gauss-newton", "exact"), "ridge_about": ("start", "zero")}  # fmt: skip


@dataclass(frozen=True)
class Shooting:
    """Estimator: whole trajectories by multiple shooting, first guess and way back in by short predictions.

    A constant current and sensor biases of each trial (`Nuisance`) are estimated along and eliminated.

    Attributes:
        schedule: "lo" alone, "go" from the declared start (over growing windows), or "logo": LO first, then GO.
        growth: trials that are added at a time; 0 takes all at once.
        window: length of the windows of multiple shooting [s].
        smooth: length over which measured velocities are smoothed for LO [s].
        every: stride of the compared steps.
        dt: time step [s]; None takes the median step of the trials.
        method: as in `Trajectory`.
        ridge: weight of the squared offset from the start, relative to the start (absolute where that is zero);
            or, with `ridge_about` "zero", of the squared parameters in SI units (lambda of You 2023 Eq. 13).
        ridge_about: "start" or "zero".
        constraints: whether You 2023 Eqs. 18-19 are kept (`constraints`).
        initial: first state of each trial "free", its measurement counting as any other row, or as "measured".
        weights: of the manoeuvres by trial name; 1 where not named.
        back_end: "engine", or "ipopt" (CasADi), to which `hessian` belongs: "gauss-newton" or "exact".
        iterations, tolerance: stop after this many iterations, or when the relative decrease is smaller.
        starts: number of searches; the first as described, the second from the momentum balance (with "go" or
            `growth`, which begin elsewhere), the others from starts drawn within bounds (or the prior) from `seed`.
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
    ridge_about: str = "start"
    constraints: bool = False
    initial: str = "free"
    weights: Mapping[str, float] = field(default_factory=dict[str, float])
    back_end: str = "engine"
    hessian: str = "gauss-newton"
    iterations: int = 60
    tolerance: float = 1e-10
    starts: int = 2
    seed: int = 0
    threads: int | None = None

    def __post_init__(self) -> None:
        for name in ("window", "smooth", "every", "dt", "iterations", "tolerance", "starts"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise StudyError(f"estimator.{name} is {value:g}; it must be above zero")
        for name in ("growth", "ridge"):
            if not getattr(self, name) >= 0:
                raise StudyError(f"estimator.{name} is {getattr(self, name):g}; it must be zero or above")
        for name, known in _KNOWN.items():
            if getattr(self, name) not in known:
                raise StudyError(f"estimator.{name} is '{getattr(self, name)}'; known: {', '.join(known)}")
        for name, weight in self.weights.items():
            if not weight > 0:
                raise StudyError(f"estimator.weights of {name} is {weight:g}; it must be above zero")
        is_rk4(self.method)

    @property
    def starts_remedy(self) -> tuple[str, str]:
        """Remedy for the noise of measured initial states; see `Estimator`."""
        if self.schedule == "lo":
            return "loss.correlation", "give the time over which errors are alike"
        return ("", "") if self.initial == "free" else ("estimator.initial", 'say "free"')

    @property
    def compared_as(self) -> Settings:
        """A fit of whole trajectories is tested on these: its windows join, and each alone would explain too much."""
        if self.schedule == "lo":
            return Cut(WINDOW, self.every, self.dt, self.method, self.threads, "free")
        return Cut(None, self.every, self.dt, self.method, self.threads, self.initial)

    @property
    def regresses(self) -> bool:
        """As `OneStep.regresses`."""
        return self.schedule == "lo"

    @linted
    def fit(self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None) -> Fit:
        """Estimate the free parameters of `problem`; see `Estimator`.

        A fit takes about a second, so nothing is kept in `checkpoint`: a killed run starts from the beginning.

        Raises:
            StudyError: nuisances that there cannot be, or weights of trials that there are not.
            FitError: no prediction, however short, is finite.
        """
        began = time.perf_counter()
        self._check(problem)
        run = Run.of(self, problem, began, progress)
        p = problem.vector.start
        if self.growth and self.schedule != "lo":  # You 2023 Algorithm 1
            for count in range(self.growth, len(problem.trials), self.growth):
                p = run.early(problem.trials[:count], p)
        stage = run.stage(problem.trials)
        return run.finished(stage, run.local(stage, p) if self.schedule == "lo" else run.best(stage, p))

    def _check(self, problem: Problem) -> None:
        if problem.nuisance.initial:
            raise StudyError(
                "[nuisance] initial is not for logo:Shooting, which frees the first state of a trial as a whole; "
                'leave it out and say estimator.initial = "free", or use shooting:Trajectory'
            )
        if self.back_end == "ipopt" and problem.nuisance != Nuisance():
            raise StudyError('estimator.back_end = "ipopt" takes no [nuisance]; leave it out, or take "engine"')
        names = [trial.name for trial in problem.trials]
        for name in (name for name in self.weights if name not in names):
            raise StudyError(f"estimator.weights names '{name}'; the trials are {', '.join(names)}")


# LO windows are shares of GO's, the first ones a single compared row; steps of a local descent at most.
_LADDER, _LOCAL = (0.0, 0.2, 1.0), 12
# Before them, one row by Euler: hardly curved in the parameters and never far out, so that a start from which
# any longer prediction blows up is walked back.  Steps at most (a mass grows twofold a step), and damping.
_FAR, _FAR_DAMPING = 80, 1e-2
UNJOINED = "LO only: no whole trajectory could be joined"
"""Status of a fit whose GO failed; its parameters and their sigma are those of short predictions."""

# Weight of a squared violation (relative) per sample; rounds of the multipliers of constraints.
_STIFF, _ROUNDS = 1e5, 6
# Searches end at the same optimum if their objectives differ by less (relative).
_SAME = 1e-6


@dataclass
class Run:
    """One running fit: what is the same in all stages, and what it has cost so far."""

    settings: Shooting
    problem: Problem
    sigma: Mapping[str, float]
    dt: float
    span: Array
    anchor: Array
    inequalities: Inequalities
    began: float
    progress: Progress | None
    watch: TrajectoryObjective | None
    history: list[tuple[float, float, float, float]] = field(default_factory=list[tuple[float, float, float, float]])
    evaluations: int = 0
    status: str = ""
    joins: bool = True
    ends: list[Array] = field(default_factory=list[Array])

    @staticmethod
    def of(settings: Shooting, problem: Problem, began: float, progress: Progress | None) -> Run:
        sigma, dt, watch = scales(problem), step_of(problem.trials, settings.dt), None
        if problem.validation:  # whole trials from their measured starts, without nuisances
            longest = max(trial.duration for trial in problem.validation)
            watch = TrajectoryObjective.build(
                replace(problem, nuisance=Nuisance()), problem.validation, sigma, window=longest + dt, dt=dt,
                every=settings.every, method=settings.method, threads=settings.threads,
            )  # fmt: skip
        start, mean, prior = problem.vector.start, problem.vector.mean, _apart(problem.vector)
        near = settings.ridge_about == "start"
        ridge = settings.ridge * (np.where(start != 0, np.abs(start), 1.0) ** -2.0 if near else np.ones(start.size))
        weight = prior + ridge
        middle = (prior * mean + (ridge * start if near else 0.0)) / np.where(weight > 0, weight, 1.0)
        anchor = np.array([np.where(weight > 0, middle, start), weight])
        full = sigma if len(sigma) == len(STATES) else {**spread(problem.trials), **sigma}
        unseen = [1.0] * (len(problem.ship.model.states) - len(STATES))
        make = Inequalities.of if settings.constraints else Inequalities.none
        return Run(
            settings, problem, sigma, dt, np.array([*(full[n] for n in STATES), *unseen]), anchor,
            make(problem), began, progress, watch,
        )  # fmt: skip

    @property
    def bounds(self) -> tuple[Array, Array]:
        return self.problem.vector.low, self.problem.vector.high

    def each(self, search: Search) -> None:
        """Note the state of a search, with the standardised error of whole validation trials."""
        seen = self.watch.standardised(search.point.p) if self.watch else float("nan")
        self.history.append((len(self.history) + 1.0, search.cost, seen, time.perf_counter() - self.began))
        ship = with_values(self.problem.ship, self.problem.free, search.point.p)
        tell(self.progress, (len(self.history), search.cost, seen), ship)

    def stage(self, trials: tuple[Trial, ...], window: float | None = None, method: str | None = None) -> Condensed:
        """The objective of some trials, cut into windows."""
        own, part, method = self.settings, replace(self.problem, trials=trials), method or self.settings.method
        cut = chains(
            trials, part.ship.model, part.loss, self.sigma, window=own.window if window is None else window,
            dt=self.dt, every=own.every, weights=own.weights, substeps=substeps(part.ship, self.dt, method),
        )  # fmt: skip
        penalty = Penalty(self.inequalities, _STIFF * max(cut.entries, 1), np.zeros(len(self.inequalities.names)))
        return Condensed.build(
            part, cut, anchor=self.anchor, penalty=penalty, freed=own.initial == "free", span=self.span,
            method=method, threads=own.threads,
        )  # fmt: skip

    def local(self, stage: Condensed, p: Array) -> Point:
        """LO: the momentum balance where it is linear, else (or where it fails) short predictions."""
        own, cut = self.settings, stage.chains
        guess = momentum_guess(stage.problem, cut, smooth=own.smooth, span=0.8 * own.window, start=p)
        if guess is not None and np.isfinite(cost := stage.cost(stage.start(guess))[0]):
            self.status = "solved: momentum balance"
            self.each(Search(stage.start(guess), cost))
            return stage.start(guess)
        return self.short(stage, p)

    def short(self, stage: Condensed, p: Array) -> Point:
        """Predictions from measured states over windows that grow, first by a step of Euler's."""
        point, begun = stage.start(p), False
        for k, share in enumerate((0.0, *_LADDER)):
            way = None if k else "euler"
            rung = stage if share == 1.0 else self.stage(stage.problem.trials, share * self.settings.window, way)
            rung = replace(rung, linked=False)
            search = descend(
                rung, rung.start(point.p, point.own), *self.bounds,
                iterations=_LOCAL if k else _FAR, damping=DAMPING if k else _FAR_DAMPING, tolerance=1e-3,
                each=self.each,
            )  # fmt: skip
            self.evaluations += search.evaluations
            begun, point = begun or bool(np.isfinite(search.cost)), search.point
        self.status = "short predictions"
        if not begun:
            raise FitError(f"{self.problem.ship.name}: the model blows up in one step of {self.dt:g} s at the start")
        return stage.start(point.p, point.own)

    def early(self, trials: tuple[Trial, ...], p: Array) -> Array:
        """GO of some trials; as it was where so few do not determine the parameters."""
        try:
            end = self.whole(self.stage(trials), p, self.ways)
        except (FitError, DataError):
            end = None
        if end is not None and self.joins:
            return end.p
        self.status, self.joins = "", True
        return p

    @property
    def ways(self) -> list[Way]:
        """Where GO begins: warm if that joins, else LO (You 2023 Algorithm 1, lines 4-8)."""
        ways: list[Way] = [self.short, self.local] if self.settings.schedule == "go" else [self.local, self.short]
        return [Condensed.start, *ways] if self.status == "converged" else ways

    def whole(self, stage: Condensed, p: Array, ways: Sequence[Way]) -> Point:
        """GO from the first of the ways in at `p` that converges, else the best of them.

        Where the windows of no way in can be joined: the best of these, as LO has it.
        """
        ends: list[Search] = []
        begun: list[Point] = []
        for way in ways:
            try:
                begun.append(way(stage, p))
                end = self.joined(stage, begun[-1])
            except (FitError, np.linalg.LinAlgError):
                continue
            ends.append(end)
            if end.closed and end.done == "converged":
                break
        best = min((end for end in ends if end.closed), key=lambda end: end.cost, default=None)
        if best is not None:
            self.status, self.joins = best.done, True
            return best.point
        costs = [stage.cost(point)[0] for point in begun]
        if not np.isfinite(min(costs, default=np.inf)):
            raise FitError(f"{self.problem.ship.name}: no trajectory could be joined, from the start or from LO")
        self.status, self.joins = UNJOINED, False
        return begun[int(np.argmin(costs))]

    def best(self, stage: Condensed, p: Array) -> Point:
        """The best end of the searches from `p` and from the further starts; where each ended is kept."""
        own, vector = self.settings, self.problem.vector
        begun: list[tuple[Array, list[Way]]] = [(p, self.ways)]
        if own.starts > 1 and (own.growth or own.schedule == "go"):  # else the first begins there
            begun.append((vector.start, [self.local]))
        drawn = vector.drawn(max(own.starts - 2, 0), np.random.default_rng(own.seed))
        cold: list[Way] = [Condensed.start, self.short]
        begun += [(one, cold) for one in drawn]
        best, cost, told = None, np.inf, (self.status, self.joins)
        for start, ways in begun:
            try:
                end = self.whole(stage, start, ways)
            except FitError:
                if len(begun) == 1:
                    raise
                self.ends.append(np.array([np.inf, *start]))
                continue
            reached = stage.cost(end)[0] if self.joins else np.inf
            self.ends.append(np.array([reached, *end.p]))
            if best is None or reached < cost:
                best, cost, told = end, reached, (self.status, self.joins)
        if best is None:
            raise FitError(f"{self.problem.ship.name}: no trajectory could be joined from any of {len(begun)} starts")
        self.status, self.joins = told
        same = sum(end[0] <= cost * (1.0 + _SAME) for end in self.ends)
        if self.joins and (same < len(self.ends) or own.starts > 2):
            self.status += f"; {same} of {len(self.ends)} starts end there"
        return best

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
        return end if end.closed else _closed(stage, end)

    def by_ipopt(self, stage: Condensed, start: Point) -> Search:
        """The same by IPOPT, every compared row a node of its own."""
        own, cut = self.settings, stage.chains
        fine = self.stage(stage.problem.trials, self.dt * own.every).chains
        programme = FullSpace.build(
            stage.problem, fine, anchor=self.anchor, inequalities=self.inequalities, begun=stage.begun,
            span=self.span, method=own.method, exact=own.hessian == "exact", iterations=2 * own.iterations,
            tolerance=max(1e4 * own.tolerance, 1e-8),
        )  # fmt: skip
        found = programme.solve(start.p, fine.state0, *self.bounds)
        jump = (cut.steps - 1) // cut.every
        first = np.concatenate([np.flatnonzero(fine.trial == t)[::jump] for t in range(cut.trials)])
        point = replace(start, p=found.p, nodes=found.nodes[first])
        done = "converged" if found.success else found.status
        search = Search(point, stage.cost(point)[0], iteration=found.iterations, closed=found.success, done=done)
        self.evaluations += found.iterations
        self.each(search)
        return search

    def finished(self, stage: Condensed, point: Point) -> Fit:
        """The fit, with covariance and verdicts from the condensed normal equations of the parameters alone."""
        p, linked = point.p, self.joins and self.settings.schedule != "lo"
        linear = replace(stage, linked=linked).linear(point)
        n, count, m = linear.g_p.size, *linear.g.shape
        samples = stage.chains.entries * stage.chains.weight
        variance = linear.data / max(samples - n - count * (m - n), 1.0)
        # `posterior` divides all by the variance; the priors of the nuisances stand as they are given.
        N, own = linear.N.copy(), np.arange(n, m)
        N[:, own, own] += (variance - 1.0) * np.append(stage.begun.weight, stage.nuisances.deviation**-2.0)
        H, g, _ = stage.reduced(replace(linear, N=N), 0.0)
        # The ridge is no knowledge of the parameters: it steers, but does not sharpen what is claimed.
        ridge = np.diag(self.anchor[1]) - self.problem.vector.precision
        return judged(
            self.problem, p, Normal(linear.cost, H - ridge, g), variance, history=np.array(self.history),
            seconds=time.perf_counter() - self.began, evaluations=self.evaluations, status=self.status,
            digest=digest(self.problem, self.settings), ends=np.array(self.ends or [[linear.cost, *p]]),
            nuisances=stage.nuisances.by_trial(self.problem.trials, point.own),
        )  # fmt: skip


def _apart(vector: Vector) -> Array:
    """Inverse variances of the priors, which this search weighs one by one."""
    precision = np.diag(vector.precision)
    if not np.array_equal(vector.precision, np.diag(precision)):
        raise StudyError("[captive]: multiple shooting takes no correlated priors; take shooting:Trajectory")
    return precision


def _closed(stage: Condensed, end: Search) -> Search:
    """A search that stopped with windows apart, its trajectories run through: an answer, if not the best one."""
    point = replace(end.point, nodes=end.point.nodes.copy())
    for level in stage.chains.levels[1:]:
        point.nodes[level] += stage.cost(point)[1][level]
    cost = stage.cost(point)[0]
    return replace(end, point=point, cost=cost, closed=bool(np.isfinite(cost)))
