"""Fitting through the simulated trajectory: windows as lanes, exact sensitivities, Gauss-Newton.

`Trajectory` compares long predictions, restarted from measured (or estimated) states, with the
measurement: the global optimisation (GO) of You 2023 and the loss of Wakita 2022 Eq. 23, for any
model.  `OneStep` compares single steps with it: the local optimisation (LO), a cheap first guess.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ...core.executors import Pool, parted
from ...core.parameters import Free, specs
from ...core.parameters import values as parameter_values
from ...core.values import dataclass, replace
from ...data import Array
from ...engine.rollout import is_rk4
from ...models import STATES
from .. import Fit, FitError, Nuisance, Problem, Progress, StudyError
from ..lint import linted
from ..nuisance import checked_initial
from ..record import cut_as, scales, step_of
from ..resume import Resume, digest
from ..vector import Vector
from ..watch import tell, with_values
from .gauss_newton import CONVERGED, Index, State, descend
from .local import finished
from .objective import TrajectoryObjective

_BESIDE = 40
"""Iterations for initial states and errors of instruments where the parameters are kept."""

Note = Callable[[int, State, float], None]
"""Called with the number of a start, its state and its standardised error in validation after each iteration."""


@dataclass(frozen=True)
class Trajectory:
    """Windowed trajectory least squares with a Gaussian prior and box bounds.

    Attributes:
        window: length of a prediction before it restarts [s]; None runs each trial through.
        stride: time from the start of one prediction to that of the next [s]; None is the window.
        every: stride of the compared rows; None takes about one second.
        dt: time step [s]; None takes the median step of the trials.
        method: "rk4", in as many steps from row to row as the ship needs (`approach.substeps`), or "euler" by one.
        iterations, tolerance: stop after this many iterations, or when the relative decrease is smaller; 0 keeps the
            parameters as they are, and finds what is estimated beside them.
        later: shell-style patterns of parameters that are held until the others have been fitted, and are then
            fitted with them: a correction should not learn what the physics can explain.
        starts: number of starts; the first is the declared one, others are drawn within bounds
            (or the prior) from `seed`; all go down together.
        threads: None takes every processor.
        initial: "free", the initial state of each window is estimated, or "measured", it is as recorded; where the
            problem has `nuisance.initial`, that decides.
    """

    window: float | None = 100.0
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
    partial: ClassVar[bool] = True
    still: ClassVar[int] = 1

    def __post_init__(self) -> None:
        if isinstance(self.later, str):
            raise StudyError(f"estimator.later is '{self.later}'; write a list of patterns, [\"{self.later}\"]")
        object.__setattr__(self, "later", tuple(self.later))
        for name in ("window", "stride", "every", "dt", "iterations", "tolerance", "starts"):
            value = getattr(self, name)
            if value is not None and not (value > 0 or (name == "iterations" and value == 0)):
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
        resume = Resume.open(checkpoint, digest(problem, self), began)

        def note(start: int, state: State, seen: float) -> None:
            resume.note(start, state, seen)
            ship = with_values(problem.ship, problem.free, (resume.best() or state).p[: objective.count])
            tell(progress, (len(resume.rows), state.cost, seen), ship)

        self._descend(problem, objective, watch, resume, note, pool)
        best, ends = resume.best(), [resume.states[k] for k in range(self.starts)]
        if best is None:
            raise FitError("the model blows up at every start; " + objective.failure(ends[0].p))
        converged = sum(state.done == CONVERGED for state in ends)
        status = best.done if self.starts == 1 else f"{converged} of {self.starts} starts converged"
        fit = finished(problem, objective, best.p, best.eta, resume.history, sum(state.evaluations for state in ends),
                       status, resume.digest)  # fmt: skip
        table = np.array([[state.cost, *state.p[: objective.count]] for state in ends])
        return replace(fit, objective=best.cost, seconds=time.perf_counter() - resume.began, ends=table)

    def at(self, problem: Problem, values: Any) -> Fit:
        """The fit at values that another search has found, as they are: covariance, verdicts, tests of the residuals.

        Args:
            values: one for each of `problem.free`, in their order and units.

        Raises:
            StudyError: a value outside its range.
            FitError: another number of values, or the model blows up with them.
        """
        given = np.asarray(values, dtype=np.float64)
        if given.shape != (len(problem.free),) or not np.isfinite(given).all():
            raise FitError(f"values: {given.size} of them; one finite number for each of {len(problem.free)} free ones")
        own = tuple(replace(free, start=float(value)) for free, value in zip(problem.free, given, strict=True))
        fit = replace(self, iterations=0, starts=1, later=()).fit(replace(problem, free=own))
        return replace(fit, free=problem.free, status="as given")

    def _objectives(self, problem: Problem) -> tuple[TrajectoryObjective, TrajectoryObjective | None]:
        """That of the trials, and that of the trials of validation, if any."""
        if not problem.validation:
            return TrajectoryObjective.like(problem, self, stride=self.stride), None
        sigma, how = cut_as(problem, self)
        how["window"] = self.window or max(trial.duration for trial in problem.validation)
        plain = replace(problem, nuisance=Nuisance(), loss=replace(problem.loss, weights={}))
        watch = TrajectoryObjective.build(plain, problem.validation, sigma, **how)
        return TrajectoryObjective.like(problem, self, stride=self.stride), watch

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
        self, problem: Problem, objective: TrajectoryObjective, watch: TrajectoryObjective | None, resume: Resume,
        note: Note, pool: Pool | None,
    ) -> None:  # fmt: skip
        """Go down from every start that is not done, all together; through a pool some in each piece."""
        if not resume.states:
            p = objective.extended(self.drawn(problem.vector), begun=True)
            eta = np.zeros((len(p), objective.nuisances))
            begun = State.begin(p, eta, objective.costs(p, eta, np.arange(len(p))))
            resume.states |= {k: begun.of(k) for k in range(len(p))}
        todo = {k: state for k, state in resume.states.items() if not state.done}
        if pool is None or len(todo) < 2:
            resume.states |= self._together(objective, todo, watch, note)
        else:
            posed, starts = replace(problem, linted=True), list(todo)
            parts = [{k: todo[k] for k in starts[part.start : part.stop]} for part in parted(len(starts), pool)]
            for ends, rows in pool.ordered(Trajectory.from_states, ((self, posed, part) for part in parts)):
                for row in rows:
                    note(*row)
                resume.states |= ends
                resume.write()
        resume.write()

    def from_states(
        self, problem: Problem, begun: Mapping[int, State]
    ) -> tuple[dict[int, State], list[tuple[int, State, float]]]:
        """Where some starts end, by their numbers, and what is noted on the way."""
        rows: list[tuple[int, State, float]] = []

        def note(start: int, state: State, seen: float) -> None:
            rows.append((start, state, seen))

        objective, watch = self._objectives(problem)
        return self._together(objective, begun, watch, note), rows

    def _together(
        self, objective: TrajectoryObjective, begun: Mapping[int, State], watch: TrajectoryObjective | None, note: Note
    ) -> dict[int, State]:
        """Where these descents end; `note` gets start, state and validation after every iteration of each."""
        if not begun:
            return {}
        starts = list(begun)

        def each(now: State, stepped: Index) -> None:
            for k in stepped.tolist():
                state = now.of(k)
                seen = watch.standardised(state.p[: objective.count]) if watch else float("nan")
                note(starts[k], state, seen)

        start = State.rows(list(begun.values()))
        own = np.arange(start.p.shape[1]) < objective.count
        kept = None if self.iterations else np.broadcast_to(own, start.p.shape)
        end = descend(objective, start, *objective.bounds(), iterations=self.iterations or _BESIDE, held=kept,
                      tolerance=self.tolerance, still=self.still, each=each)  # fmt: skip
        return {start: end.of(k) for k, start in enumerate(starts)}

    def drawn(self, vector: Vector) -> Array:
        """Declared start and others within bounds, or from the prior, shape (starts, free)."""
        rng = np.random.default_rng(self.seed)
        return np.vstack([vector.start, *(vector.drawn(1, rng) for _ in range(self.starts - 1))])


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
