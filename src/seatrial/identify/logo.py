"""Local and global optimisation of trajectories: Algorithm 1 of You 2023 as a schedule that always has an answer.

LO is a prediction over short stretches from measured states, or, where the momentum balance is linear in all
parameters, one linear system.  GO is the whole trajectory by multiple shooting.  Trials are added step by step,
each GO begins where the last one ended, and LO is the way back in where it stalls.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..engine.rollout import is_rk4
from . import Fit, Nuisance, Problem, Progress, StudyError
from .linted import linted
from .logo_run import Run
from .nuisances import Nuisances

_SCHEDULES, _INITIAL = ("lo", "go", "logo"), ("free", "measured")
_BACK_ENDS, _HESSIANS = ("engine", "ipopt"), ("gauss-newton", "exact")


@dataclass(frozen=True)
class Shooting:
    """Estimator: whole trajectories by multiple shooting, first guess and way back in by short predictions.

    A constant current and sensor biases of each trial (`Nuisance`) are estimated along and eliminated.

    Attributes:
        schedule: "lo" alone, "go" from the declared start (over growing windows), or "logo": LO first, then GO.
        growth: trials that are added at a time; 0 takes all at once.
        window: length of the windows of multiple shooting [s].
        smooth: length over which measured velocities are smoothed for LO [s].
        every: compare every so many steps.
        dt: time step [s]; None takes the median step of the trials.
        method: as in `Trajectory`.
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

    @property
    def starts_remedy(self) -> tuple[str, str]:
        """What to do about the noise of measured starts; see `Estimator`."""
        if self.schedule == "lo":
            return "loss.correlation", "give the time over which errors are alike"
        return ("", "") if self.initial == "free" else ("estimator.initial", 'say "free"')

    @linted
    def fit(self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None) -> Fit:
        """Estimate the free parameters of `problem`; see `Estimator`.

        A fit takes about a second, so nothing is kept in `checkpoint`: a killed run starts anew.

        Raises:
            StudyError: nuisances that there cannot be, or weights of trials that there are not.
            FitError: no prediction, however short, is finite.
        """
        began = time.perf_counter()
        self._check(problem)
        run = Run.of(self, problem, began, progress)
        p = np.array([f.start for f in problem.free])
        for count in self._stages(len(problem.trials)):
            p = run.early(problem.trials[:count], p)
        stage = run.stage(problem.trials)
        return run.finished(stage, run.local(stage, p) if self.schedule == "lo" else run.whole(stage, p))

    def _stages(self, count: int) -> list[int]:
        """How many trials take part before all do, stage by stage (You 2023 Algorithm 1)."""
        return [*range(self.growth, count, self.growth)] if self.growth and self.schedule != "lo" else []

    def _check(self, problem: Problem) -> None:
        Nuisances.of(problem.nuisance)
        if self.back_end == "ipopt" and problem.nuisance != Nuisance():
            raise StudyError('estimator.back_end = "ipopt" takes no [nuisance]; leave it out, or take "engine"')
        names = [trial.name for trial in problem.trials]
        for name in (name for name in self.weights if name not in names):
            raise StudyError(f"estimator.weights names '{name}'; the trials are {', '.join(names)}")
