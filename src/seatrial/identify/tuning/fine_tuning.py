"""Fine-tuning: several ranges, two methods on each, and the range chosen by trials that were left out.

Suyama 2023, made routine.  For each ratio a_r the same problem is solved by CMA-ES with restarts and by
bounded Gauss-Newton from many starts; the better outcome is kept and both are reported.  Which range to use is
decided on the tuning trials alone, each predicted from a fit to the others, never on the test trials.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import nullcontext
from pathlib import Path
from typing import Any, ClassVar

from ...core import executors
from ...core.executors import Pool
from ...core.parameters import Free
from ...core.values import dataclass, replace
from ...data import Array, Trial
from ...engine.rollout import is_rk4
from .. import Fit, Nuisance, Problem, Progress, StudyError
from ..lint import linted
from ..nuisance import begun_as, checked_initial
from ..population.evolution import Evolution
from ..trajectory.shooting import Trajectory
from ..watch import Staged, part
from .ranges import ITERATIONS, TOLERANCE, Scorer, flat_directions, longest, residuals, softened, within
from .tuned import Method, Range, Tuning

Told = Callable[[str, int, float], None]
"""Called with (what, iteration, objective) while the fits run; from several threads."""


def _silent(what: str, iteration: int, objective: float) -> None:
    """Nobody listens."""


@dataclass(frozen=True)
class _Relay:
    """Progress of one fit as the progress of the several that it is made of; see `watch.part`."""

    progress: Progress | None

    def __call__(self, what: str, iteration: int, objective: float) -> None:
        """A fit with a trial left out, or in a soft range, has ended."""
        if isinstance(self.progress, Staged):
            self.progress.stage(f"{what}: objective {objective:.6g}")
        elif self.progress is not None:
            self.progress(iteration, objective, math.nan)

    def part(self, name: str, problem: Problem) -> Progress | None:
        """A fit to all tuning trials begins."""
        return part(self.progress, name, problem, self.progress)


@dataclass(frozen=True)
class FineTuning:
    """Ranges, methods and cross-validation in one estimator.

    Attributes:
        ratios: the a_r to try; each cuts the intervals of [free] to [P - a_r|P|, P + a_r|P|].
        population, largest, agree, penalty: of the CMA-ES with restarts, see `Evolution`.
        starts: of the gradient method on all tuning trials.
        fold_starts: of the gradient method where a trial is left out and in soft ranges, which it alone fits.
        soft: standard deviation of the soft range over the half width of the box; at 0.5 the ends of the box
            lie two deviations off.  The loss counts in it by independent samples, over what the widest box leaves.
        dt: time step [s]; None takes the median step of the trials.
        initial: "free" estimates the state at the start of each trial along, its first row counting as any other; a
            trial that is only predicted starts where its first length of the ship would have it.  "measured" starts
            every trial from its first row as recorded, as the paper does.
        method: "rk4", in as many steps from row to row as the ship needs (`approach.substeps`), or "euler" by one.
        agreement: relative difference of the two objectives that still counts as the same.
        seed: of everything random.
        threads: fits at a time; None takes every processor.  Their number changes no digit.
    """

    ratios: Sequence[float] = (0.2, 0.3, 0.4, 0.5, 0.6)
    population: int = 12
    largest: int = 128
    agree: int = 3
    penalty: str = "spread"
    starts: int = 20
    fold_starts: int = 3
    soft: float = 0.5
    dt: float | None = None
    method: str = "rk4"
    initial: str = "free"
    agreement: float = 1e-4
    seed: int = 1
    threads: int | None = None
    several: ClassVar[bool] = True
    spreads: ClassVar[bool] = True
    window: ClassVar[float | None] = None
    every: ClassVar[int] = 1

    def __post_init__(self) -> None:
        ratios: Any = self.ratios
        if not isinstance(ratios, list | tuple) or not ratios or not all(_positive(r) for r in ratios):  # type: ignore[arg-type]
            raise StudyError(f"estimator.ratios is {ratios!r}; it must be a list of numbers above zero")
        if list(self.ratios) != sorted(set(self.ratios)):
            raise StudyError("estimator.ratios must rise, each once")
        for name in ("starts", "fold_starts", "soft", "agreement"):
            if not getattr(self, name) > 0:
                raise StudyError(f"estimator.{name} is {getattr(self, name):g}; it must be above zero")
        is_rk4(self.method)
        checked_initial(self.initial)
        self.evolution()

    @property
    def weights_stay(self) -> bool:
        """It compares ranges by left-out trials, at one set of weights."""
        return True

    def evolution(self) -> Evolution:
        """The population method of one range, each trial run through."""
        return Evolution(
            dt=self.dt, method=self.method, initial=self.initial, population=self.population,
            largest=self.largest, agree=self.agree, penalty=self.penalty, seed=self.seed, threads=1,
        )  # fmt: skip

    def gradient(self, duration: float) -> Trajectory:
        """The gradient method of one range, each trial run through; the longest lasts `duration` [s]."""
        return Trajectory(
            window=duration, every=1, dt=self.dt, method=self.method, iterations=ITERATIONS, tolerance=TOLERANCE,
            starts=self.starts, seed=self.seed, threads=1, initial=self.initial,
        )  # fmt: skip

    @linted
    def fit(
        self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None,
        pool: Pool | None = None,
    ) -> Fit:  # fmt: skip
        """The fit within the range chosen by leaving trials out; its `details` are the `Tuning`; see `tune`."""
        tuning = self.tune(problem, problem.validation, told=_Relay(progress), checkpoint=checkpoint, pool=pool)
        return replace(tuning.fit, details=tuning)

    def tune(
        self, problem: Problem, tests: Sequence[Trial] = (), *, told: Told = _silent, checkpoint: Path | None = None,
        pool: Pool | None = None,
    ) -> Tuning:  # fmt: skip
        """Go through the ranges, choose one, and judge it on `tests`, which decide nothing.

        Args:
            checkpoint: each fit to all tuning trials keeps its own file beside it, of the same stem; a killed run
                that is given the same path resumes and ends with the same numbers.
            pool: who computes the fits, with the same numbers; None takes `threads` of this process.

        Raises:
            StudyError: ratios beyond what [free] declares, one tuning trial only, or a trial in both sets.
            FitError: no candidate can be simulated.
        """
        _check(problem, tests, self.ratios)
        plain = replace(problem, validation=())
        sweep = _Sweep(self, plain, Scorer.of(begun_as(plain, self.initial), self.dt, self.method), told, checkpoint)
        untuned = problem.vector.current(problem.ship.model)
        with nullcontext(pool) if pool else executors.threads(self.threads) as at:
            ranges = sweep.ranges(at, tests)
        chosen = min(range(len(ranges)), key=lambda k: sum(ranges[k].left_out.values()))
        best = ranges[chosen]
        left = residuals(sweep.scorer, problem.trials, best.fit.values)
        return Tuning(
            problem, tuple(tests), ranges, chosen, sweep.scorer.scores(problem.trials, untuned),
            sweep.scorer.scores(tests, untuned, seen=False), left,
            flat_directions(sweep.scorer, problem.trials, best.free, best.fit.values, left), self.agreement,
        )  # fmt: skip


def _positive(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < math.inf


def _check(problem: Problem, tests: Sequence[Trial], ratios: Sequence[float]) -> None:
    names = {t.name for t in problem.trials}
    if problem.nuisance != Nuisance():
        raise StudyError("fine-tuning takes no [nuisance]; leave it out, or use shooting:Trajectory")
    twice = [t.name for t in tests if t.name in names]
    if twice:
        raise StudyError(f"{twice[0]} is among the tuning and the test trials; keep it in one")
    if len(names) < 2:
        raise StudyError(
            "fine-tuning chooses the range by leaving one tuning trial out at a time; give two or more, or take "
            'type = "shooting:Trajectory" with priors, as "rudder.*" = { prior = 0.3 } in [free]: it needs one'
        )
    widths = [[f.high - f.low for f in within(problem, ratio)] for ratio in ratios[-2:]]
    if len(widths) == 2 and widths[0] == widths[1]:
        raise StudyError(
            f"estimator.ratios: {ratios[-1]:g} gives the ranges of {ratios[-2]:g} again, for [free] declares no wider "
            "ones; widen them there, or leave the ratio out"
        )


@dataclass(frozen=True)
class _Sweep:
    """One run of a `FineTuning`: independent fits, some at a time."""

    settings: FineTuning
    problem: Problem
    scorer: Scorer
    told: Told
    checkpoint: Path | None

    def ranges(self, pool: Pool, tests: Sequence[Trial]) -> tuple[Range, ...]:
        """Every range with its fits, scores and soft counterpart."""
        own, trials, ratios = self.settings, self.problem.trials, self.settings.ratios
        boxes = {ratio: within(self.problem, ratio) for ratio in ratios}
        sets = (trials, *(self.problem.without([out]).trials for out in trials))
        estimators: dict[str, Any] = {"evolution": own.evolution(), "gradient": own.gradient(longest(trials))}
        whole = {(name, ratio): self._whole(pool, name, estimators[name], ratio, boxes[ratio])
                 for name in estimators for ratio in ratios}  # fmt: skip
        folds = {(ratio, k): self._left(pool, f"a_r {ratio:g}", sets[k], boxes[ratio], 1.0)
                 for ratio in ratios for k in range(1, len(sets))}  # fmt: skip
        hard: dict[tuple[float, int], Array] = {at: pool.result(one) for at, one in folds.items()}
        first = pool.result(whole["gradient", ratios[-1]])
        widest = [first.values, *(hard[ratios[-1], k] for k in range(1, len(sets)))]
        softs = {
            (ratio, k): self._left(
                pool, f"a_r {ratio:g}, soft", sets[k], softened(self.problem, ratio, own.soft),
                residuals(self.scorer, sets[k], widest[k]).counted,
            )
            for ratio in ratios for k in range(len(sets))
        }  # fmt: skip
        soft: dict[tuple[float, int], Array] = {at: pool.result(one) for at, one in softs.items()}
        found: dict[tuple[str, float], Fit] = {at: pool.result(one) for at, one in whole.items()}
        return tuple(self._range(ratio, boxes[ratio], found, hard, soft, tests) for ratio in ratios)

    def _whole(self, pool: Pool, name: str, estimator: Any, ratio: float, free: tuple[Free, ...]) -> Future[Fit]:
        """A fit to all tuning trials, with a checkpoint file of its own."""
        path = self.checkpoint and self.checkpoint.with_name(
            f"{self.checkpoint.stem}.{f'{ratio:g}'.replace('.', '_')}_{name}{self.checkpoint.suffix}"
        )
        # The gradient method takes free initial states as nuisance parameters without a prior.
        own = self.problem if name == "evolution" else begun_as(self.problem, self.settings.initial)
        problem, what = replace(own, free=free), f"a_r {ratio:g}, {name}"

        def plainly(iteration: int, objective: float, _: float) -> None:
            self.told(what, iteration, objective)

        progress = None if pool.away else part(self.told, what, problem, plainly)
        return pool.submit(_fitted, estimator, problem, path and path.absolute(), progress)

    def _left(
        self, pool: Pool, what: str, trials: tuple[Trial, ...], free: tuple[Free, ...], factor: float
    ) -> Future[Array]:
        """The values that fit some of the trials, or a soft range; too short to keep, they are done again."""
        own, told = self.settings, _silent if pool.away else self.told
        what = f"{what}, {', '.join(t.name for t in trials)}"
        return pool.submit(_best, self.scorer, trials, free, own.fold_starts, own.seed, factor, told, what)

    def _range(
        self, ratio: float, box: tuple[Free, ...], fits: Mapping[tuple[str, float], Fit],
        hard: Mapping[tuple[float, int], Array], soft: Mapping[tuple[float, int], Array], tests: Sequence[Trial],
    ) -> Range:  # fmt: skip
        trials, scores = self.problem.trials, self.scorer.scores
        methods = {name: fits[name, ratio] for name in ("evolution", "gradient")}
        kept = min(methods, key=lambda name: methods[name].objective)
        fit, softly = methods[kept], soft[ratio, 0]

        def left_out(values: Mapping[tuple[float, int], Array]) -> dict[str, float]:
            return {t.name: scores([t], values[ratio, k], seen=False)[t.name] for k, t in enumerate(trials, 1)}

        return Range(
            ratio, box, fit, kept, {name: Method.of(one) for name, one in methods.items()},
            scores(trials, fit.values), scores(tests, fit.values, seen=False), left_out(hard),
            softly, scores(trials, softly), scores(tests, softly, seen=False), left_out(soft),
        )  # fmt: skip


def _fitted(estimator: Any, problem: Problem, path: Path | None, progress: Progress | None) -> Fit:
    return estimator.fit(problem, checkpoint=path, progress=progress)


def _best(
    scorer: Scorer, trials: tuple[Trial, ...], free: tuple[Free, ...], starts: int, seed: int, factor: float,
    told: Told, what: str,
) -> Array:  # fmt: skip
    found = scorer.best(trials, free, starts=starts, seed=seed, factor=factor)
    told(what, 1, sum(scorer.scores(trials, found).values()))
    return found
