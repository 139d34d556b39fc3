"""Fitting through the simulated trajectory: windows as lanes, exact sensitivities, Gauss-Newton.

`Trajectory` compares long predictions, restarted from measured (or estimated) states, with the
measurement: the global optimisation (GO) of You 2023 and the loss of Wakita 2022 Eq. 23, for any
model.  `OneStep` compares single steps with it: the local optimisation (LO), a cheap first guess.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ...core.executors import Pool
from ...core.parameters import Free, specs
from ...core.parameters import values as parameter_values
from ...data import Array
from ...engine.rollout import is_rk4
from ...models import STATES
from .. import Fit, FitError, Problem, Progress, StudyError
from ..lint import linted
from ..nuisance import begun_as, checked_initial
from ..record import every_of, scales, step_of
from ..resume import Resume, digest
from ..vector import Vector
from ..watch import tell, with_values
from .gauss_newton import State, minimise
from .local import begin, finished
from .objective import TrajectoryObjective


@dataclass(frozen=True)
class Trajectory:
    """Windowed trajectory least squares with a Gaussian prior and box bounds.

    Attributes:
        window: length of a prediction before it restarts [s].
        stride: time from the start of one prediction to that of the next [s]; None is the window.
        every: stride of the compared rows; None takes about one second.
        dt: time step [s]; None takes the median step of the trials.
        method: "rk4", in as many steps from row to row as the ship needs (`approach.substeps`), or "euler" by one.
        iterations, tolerance: stop after this many iterations, or when the relative decrease is smaller.
        later: shell-style patterns of parameters that are held until the others have been fitted, and are then
            fitted with them: a correction should not learn what the physics can explain.
        starts: number of starts; the first is the declared one, others are drawn within bounds
            (or the prior) from `seed`.
        threads: None takes every processor.
        initial: "free", the initial state of each window is estimated, or "measured", it is as recorded; where the
            problem has `nuisance.initial`, that decides.
    """

    window: float = 100.0
    stride: float | None = None
    every: int | None = None
    dt: float | None = None
    method: str = "rk4"
    iterations: int = 40
    tolerance: float = 1e-4
    later: tuple[str, ...] = ()
    starts: int = 1
    seed: int = 0
    threads: int | None = None
    initial: str = "free"
    spreads: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if isinstance(self.later, str):
            raise StudyError(f"estimator.later is '{self.later}'; write a list of patterns, [\"{self.later}\"]")
        object.__setattr__(self, "later", tuple(self.later))
        for name in ("window", "stride", "every", "dt", "iterations", "tolerance", "starts"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise StudyError(f"estimator.{name} is {value:g}; it must be above zero")
        is_rk4(self.method)
        checked_initial(self.initial)

    @property
    def estimates_common(self) -> bool:
        """It estimates errors of instruments (`Nuisance.common`)."""
        return True

    @property
    def starts_remedy(self) -> tuple[str, str]:
        """Remedy for the noise of measured initial states; see `Estimator`."""
        return ("", "") if self.initial == "free" else ("estimator.initial", 'say "free"')

    @linted
    def fit(
        self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None,
        pool: Pool | None = None,
    ) -> Fit:  # fmt: skip
        """Estimate the free parameters of `problem`; see `Estimator`.

        Raises:
            FitError: the model blows up at every start.
        """
        began = time.perf_counter()
        if self.later:
            begun = self._begun(problem, pool)
            fit = replace(self, later=()).fit(begun, progress=progress, checkpoint=checkpoint, pool=pool)
            return replace(fit, free=problem.free, seconds=time.perf_counter() - began, digest=digest(problem, self))
        objective, watch = self._objectives(problem)
        print_ = digest(problem, self)
        resume = Resume.open(checkpoint, print_, began)
        if pool is not None and self.starts > 1:
            self._descend_apart(pool, problem, resume)
        best = self._descend(objective, problem.vector, resume, watch, progress)
        fit = finished(
            problem, objective, best.p, best.eta, np.array(resume.history), best.evaluations, best.done, print_
        )
        ends = np.array([[s.cost, *s.p[: len(problem.free)]] for s in resume.states.values()])
        return replace(fit, objective=best.cost, seconds=time.perf_counter() - resume.began, ends=ends)

    def _objectives(self, problem: Problem) -> tuple[TrajectoryObjective, TrajectoryObjective | None]:
        """That of the trials, and that of the trials of validation, if any."""
        sigma, dt = scales(problem), step_of(problem.trials, self.dt)
        how: Any = {"window": self.window, "dt": dt, "every": every_of(self.every, dt), "method": self.method,
                    "threads": self.threads}  # fmt: skip
        own = begun_as(problem, self.initial)
        objective = TrajectoryObjective.build(own, problem.trials, sigma, stride=self.stride, **how)
        plain = replace(problem, nuisance=type(problem.nuisance)(), loss=replace(problem.loss, weights={}))
        watch = TrajectoryObjective.build(plain, problem.validation, sigma, **how) if problem.validation else None
        return objective, watch

    def _descend_apart(self, pool: Pool, problem: Problem, resume: Resume) -> None:
        """Go down from the starts that have not begun, each a piece, and note where they end in their order."""
        fresh = [start for start in range(self.starts) if resume.state(start) is None]
        pieces = ((self, replace(problem, linted=True), start) for start in fresh)
        for start, (state, rows) in zip(fresh, pool.ordered(Trajectory.from_start, pieces), strict=True):
            resume.begin(start, state)
            for at, seen in rows:
                resume.note(at, seen)
            resume.end(start, state)

    def _begun(self, problem: Problem, pool: Pool | None) -> Problem:
        """The problem, started at the fit of all but the later parameters."""
        late = [f.path for f in problem.free if any(fnmatchcase(f.path, pattern) for pattern in self.later)]
        early = tuple(f for f in problem.free if f.path not in late)
        if not late or not early:
            told = "no" if not late else "every"
            raise StudyError(f"estimator.later fits {told} free parameter; name those that join the others later")
        found = replace(self, later=()).fit(replace(problem, free=early), pool=pool)
        return replace(problem, free=problem.vector.started(found.vector.by_path(found.values)))

    def _descend(
        self, objective: TrajectoryObjective, vector: Vector, resume: Resume,
        watch: TrajectoryObjective | None, progress: Progress | None,
    ) -> State:  # fmt: skip
        def each(state: State) -> None:
            seen = watch.standardised(state.p) if watch else float("nan")
            resume.note(state, seen)
            ship = with_values(objective.problem.ship, vector.free, (resume.best() or state).p[: len(vector)])
            tell(progress, (len(resume.history), state.cost, seen), ship)

        for start, p in enumerate(self._starts(vector)):
            state = resume.state(start)
            if state is None:
                state = begin(objective, p)
                resume.begin(start, state)
            if np.isfinite(state.cost):
                resume.end(start, self._minimised(objective, state, each))
        best = resume.best()
        if best is None:
            raise FitError("the model blows up at every start; " + objective.failure(self._starts(vector)[0]))
        return best

    def from_start(self, problem: Problem, start: int) -> tuple[State, list[tuple[State, float]]]:
        """Where one start ends, and the state and what is seen of the validation after every iteration."""
        objective, watch = self._objectives(problem)
        state, rows = begin(objective, self._starts(problem.vector)[start]), list[tuple[State, float]]()

        def each(now: State) -> None:
            rows.append((now, watch.standardised(now.p) if watch else float("nan")))

        return (self._minimised(objective, state, each) if np.isfinite(state.cost) else state), rows

    def _minimised(self, objective: TrajectoryObjective, state: State, each: Callable[[State], None]) -> State:
        return minimise(objective, state, *objective.bounds(), iterations=self.iterations, tolerance=self.tolerance,
                        each=each)  # fmt: skip

    def _starts(self, vector: Vector) -> list[Array]:
        rng = np.random.default_rng(self.seed)
        return [vector.start, *(vector.drawn(1, rng)[0] for _ in range(self.starts - 1))]


@dataclass(frozen=True)
class OneStep:
    """Local optimisation: predictions of one short step from every measured state.

    Attributes:
        step: length of the predicted step [s]; longer steps are less noisy, shorter ones more local.
        dt, method, iterations, tolerance, threads: as in `Trajectory`.
    """

    step: float = 1.0
    dt: float | None = None
    method: str = "rk4"
    iterations: int = 20
    tolerance: float = 1e-6
    threads: int | None = None

    @property
    def starts_remedy(self) -> tuple[str, str]:
        """Remedy for the noise of measured initial states; see `Estimator`."""
        return "nuisance.initial", "give its deviations"

    @property
    def compared_as(self) -> Trajectory:
        """Long predictions test it: each step begins at measured states, whose noise pulls the parameters."""
        return Trajectory(dt=self.dt, method=self.method, threads=self.threads)

    @property
    def regresses(self) -> bool:
        """It takes measured states as exact, so that its optimum is not that of the predictions that test it."""
        return True

    @linted
    def fit(
        self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None
    ) -> Fit:
        """Estimate the free parameters of `problem` from single steps; velocities only."""
        dt = step_of(problem.trials, self.dt)
        every = max(round(self.step / dt), 1)
        velocities = {n: s for n, s in scales(problem).items() if n in STATES[3:]}
        local = replace(problem, loss=replace(problem.loss, sigma=velocities, correlation=0.0))
        return Trajectory(
            window=every * dt, every=every, dt=dt, method=self.method, iterations=self.iterations,
            tolerance=self.tolerance, threads=self.threads, initial="measured",
        ).fit(local, progress=progress, checkpoint=checkpoint)  # fmt: skip


def free_everywhere(ship: Any, patterns: Sequence[str], ratio: float) -> tuple[Free, ...]:
    """Every parameter that fits a pattern, with a Gaussian prior of `ratio` times its value.

    Physical limits of the `Spec` are the bounds; zero values, which would get no freedom, are left out.
    """
    from ...core.parameters import match

    known, meaning = parameter_values(ship.model), specs(ship.model)
    paths = dict.fromkeys(path for pattern in patterns for path in match(ship.model, pattern))
    return tuple(
        Free(p, known[p], meaning[p].low, meaning[p].high, known[p], ratio * abs(known[p]))
        for p in paths if known[p] != 0.0
    )  # fmt: skip


