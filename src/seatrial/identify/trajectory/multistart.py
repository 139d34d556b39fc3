"""The gradient search from many starts at once."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ...core.executors import Pool, parted
from ...core.parameters import Free
from ...data import Array
from .. import Fit, FitError, Problem, Progress
from ..lint import linted
from ..nuisance import begun_as, checked_initial, held
from ..record import cut_as
from ..resume import digest
from ..vector import Vector
from ..watch import tell, with_values
from .batch import Ends, Many
from .gauss_newton import CONVERGED, STILL, Alike, State, descend
from .local import begin, finished
from .objective import TrajectoryObjective
from .shooting import Trajectory


@dataclass(frozen=True)
class MultiStart:
    """`Trajectory` from many starts at once; the same optimum, in fewer seconds.

    Attributes:
        window, every, dt, method, threads: as in `Trajectory`; None for the window runs each trial through.
        initial: "free" estimates the initial state of each window, its reading counting as any other;
            "measured" starts from the row as recorded, with its noise.
        starts: the first is the declared one, others are drawn within bounds (or the prior) from `seed`.
        iterations, tolerance: stop after this many iterations, or when two steps decrease by less than this (relative).
    """

    window: float | None = None
    every: int = 1
    dt: float | None = None
    method: str = "rk4"
    initial: str = "free"
    starts: int = 20
    seed: int = 0
    iterations: int = 60
    tolerance: float = 1e-10
    threads: int | None = None
    spreads: ClassVar[bool] = True

    def __post_init__(self) -> None:
        checked_initial(self.initial)
        Trajectory(
            window=self.window or 100.0, every=self.every, dt=self.dt, method=self.method, iterations=self.iterations,
            tolerance=self.tolerance, starts=self.starts,
        )  # fmt: skip

    @property
    def starts_remedy(self) -> tuple[str, str]:
        """Remedy for the noise of measured initial states; see `Estimator`."""
        return ("estimator.initial", 'say "free"') if self.initial == "measured" else ("", "")

    @linted
    def fit(
        self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None,
        pool: Pool | None = None,
    ) -> Fit:  # fmt: skip
        """Estimate the free parameters of `problem`; see `Estimator`.

        A fit takes about a second, so nothing is kept in `checkpoint`: a killed run starts from the beginning.

        Raises:
            FitError: the model blows up at every start.
        """
        began, history = time.perf_counter(), list[tuple[float, float, float, float]]()

        def each(costs: Array, values: Array) -> None:
            history.append((len(history) + 1.0, float(costs.min()), float("nan"), time.perf_counter() - began))
            ship = with_values(problem.ship, problem.free, values[int(np.argmin(costs))])
            tell(progress, (len(history), history[-1][1], float("nan")), ship)

        starts = drawn(problem.free, self.starts, np.random.default_rng(self.seed))
        ends = self.ends(problem, starts, each) if pool is None else self._elsewhere(pool, problem, starts, each)
        objective = self._objective(problem)
        best = int(np.argmin(ends.costs))
        if not np.isfinite(ends.costs[best]):
            raise FitError("the model blows up at every start; " + objective.failure(objective.extended(starts[0])))
        status = f"{int(ends.converged.sum())} of {self.starts} starts converged"
        fit = finished(
            problem, objective, ends.values[best], objective.begun(ends.values[best]), np.array(history),
            int(ends.evaluations.sum()), status, digest(problem, self),
        )  # fmt: skip
        table = np.column_stack([ends.costs, ends.values[:, : len(problem.free)]])
        return replace(fit, seconds=time.perf_counter() - began, ends=table)

    def _objective(self, problem: Problem) -> TrajectoryObjective:
        sigma, arguments = cut_as(problem, self)
        return TrajectoryObjective.build(begun_as(problem, self.initial), problem.trials, sigma, **arguments)

    def ends(self, problem: Problem, starts: Array, each: Callable[[Array, Array], None]) -> Ends:
        """Where these starts end: all of them in one call of the kernel, or one by one where trials have nuisances."""

        def told(now: State, _: object) -> None:
            each(now.cost, now.p[:, : starts.shape[1]])

        how: Any = {"iterations": self.iterations, "tolerance": self.tolerance, "each": told}
        if not held(problem):
            return Many.like(problem, self).descend(starts, **how)
        objective = self._objective(problem)
        begun = State.rows([begin(objective, one).begun for one in starts])
        end = descend(Alike(objective), begun, *objective.bounds(), still=STILL, **how)
        return Ends(end.p, end.cost, end.cost, end.evaluations, end.done == CONVERGED)

    def _elsewhere(
        self, pool: Pool, problem: Problem, starts: Array, each: Callable[[Array, Array], None]
    ) -> Ends:  # fmt: skip
        """The descents, some starts a piece; the rows of the history are told when all are done."""
        pieces = ((self, problem, starts[part.start : part.stop]) for part in parted(len(starts), pool))
        done = list(pool.ordered(_descended, pieces))
        for turn in range(max(len(rows) for _, rows in done)):
            now = [rows[min(turn, len(rows) - 1)] for _, rows in done if rows]
            each(np.concatenate([costs for costs, _ in now]), np.concatenate([values for _, values in now]))
        return Ends.joined([ends for ends, _ in done])


def _descended(estimator: MultiStart, problem: Problem, starts: Array) -> tuple[Ends, list[tuple[Array, Array]]]:
    """Where these starts end, and objectives and values after every iteration."""
    rows: list[tuple[Array, Array]] = []
    ends = estimator.ends(problem, starts, lambda costs, values: rows.append((costs.copy(), values.copy())))
    return ends, rows


def drawn(free: Sequence[Free], count: int, rng: np.random.Generator) -> Array:
    """The declared start, and others drawn within the bounds, or from start and scale where there are none."""
    vector = Vector.of(free)
    out = vector.drawn(count, rng)
    out[0] = vector.start
    return out
