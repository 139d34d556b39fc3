"""Ranges of parameters: boxes of a ratio, soft ranges, their losses on left-out trials, and the residuals of a fit.

Suyama 2023 section 4.2 sets the range by hand and can only warn that a wide one may overfit.  Here each range
is judged by predicting every tuning trial from a fit to the others.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core.parameters import Free, read
from ...core.values import dataclass, replace
from ...data import Array, Trial
from ...models import ROLL, STATES
from .. import FitError, Problem, StudyError
from ..nuisance import Layout
from ..posterior.misfit import correlated
from ..record import scales, step_of, windows
from ..trajectory.objective import TrajectoryObjective
from ..vector import Vector

# A descent ends after this many iterations, or at a relative decrease below this.
ITERATIONS, TOLERANCE = 80, 1e-8
# Fewest rows from which the initial state of a trial is estimated.
_FIRST = 10


def longest(trials: Sequence[Trial]) -> float:
    """Duration of the longest trial [s]."""
    return max(t.duration for t in trials)


@dataclass(frozen=True)
class Scorer:
    """The loss of a problem on any trials, each predicted whole from its start; compiled once.

    Where initial states are free (`nuisance.begun_as`) those of a fitted trial are estimated from all of it, those of
    one that is only predicted from the time it takes to travel its first ship length.

    Attributes:
        base: the objective of the problem's own trials.
        sigma: scale of each compared channel.
        dt, method: it was made with; a pickled one is these and the problem, and is compiled where it arrives.
    """

    base: TrajectoryObjective
    sigma: Mapping[str, float]
    dt: float | None
    method: str

    def __reduce__(self) -> tuple[object, ...]:
        return Scorer.of, (self.base.problem, self.dt, self.method)

    @staticmethod
    def of(problem: Problem, dt: float | None, method: str) -> Scorer:
        """With the scales of the loss, or the spread of the trials where it names none."""
        sigma = scales(problem)
        how: Any = {"window": longest(problem.trials), "every": 1, "method": method, "threads": 1,
                    "dt": step_of(problem.trials, dt)}  # fmt: skip
        return Scorer(TrajectoryObjective.build(problem, problem.trials, sigma, **how), sigma, dt, method)

    def objective(
        self, trials: Sequence[Trial], free: Sequence[Free] | None = None, factor: float = 1.0
    ) -> TrajectoryObjective:
        """The trajectory objective of `trials`, one window each; `factor` scales every sigma."""
        base = self.base
        problem = replace(base.problem, trials=tuple(trials), free=tuple(free or base.problem.free))
        cut = windows(
            trials, problem.ship.model, problem.loss, {n: factor * s for n, s in self.sigma.items()},
            window=longest(trials), dt=base.windows.dt * base.windows.every, every=1, substeps=base.windows.every,
        )  # fmt: skip
        layout = Layout.of(problem.nuisance, cut.trial, problem.ship.model.motion)
        return replace(base, problem=problem, windows=cut, layout=layout)

    def best(
        self, trials: Sequence[Trial], free: Sequence[Free], *, starts: int, seed: int, factor: float = 1.0
    ) -> Array:
        """Values that fit `trials` best, by bounded Gauss-Newton from several starts, the first as declared.

        Raises:
            FitError: the model blows up at every start.
        """
        objective = self.objective(trials, free, factor)
        vector = objective.problem.vector
        ends = objective.descend(np.array(_starts(vector, starts, seed)), iterations=ITERATIONS)
        best = int(np.argmin(ends.costs))
        if not math.isfinite(ends.costs[best]):
            raise FitError("the model blows up at every start; " + objective.failure(vector.start))
        return ends.values[best]

    def residuals(self, trials: Sequence[Trial], values: Array, *, seen: bool = True) -> Array:
        """Weighted residuals, shape (trials, rows, 6); not finite where the model blows up.

        Args:
            seen: whether initial states may be estimated from the whole trials.
        """
        objective = self.objective(trials)
        return objective.residuals(values, objective.begun(values, None if seen else self.first(objective)))

    def first(self, objective: TrajectoryObjective) -> float:
        """Time of the readings from which the initial state of a trial that is only predicted is estimated [s]."""
        ship, cut = objective.problem.ship, objective.windows
        return max(ship.L_pp / max(ship.speed, 1e-3), _FIRST * cut.dt * cut.every)

    def scores(self, trials: Sequence[Trial], values: Array, *, seen: bool = True) -> dict[str, float]:
        """Loss of each trial by its name, without any prior; inf where the model blows up.

        Args:
            seen: as in `residuals`.
        """
        if not trials:
            return {}
        costs = (self.residuals(trials, values, seen=seen) ** 2).sum(axis=(1, 2))
        return {t.name: float(c) if math.isfinite(c) else math.inf for t, c in zip(trials, costs, strict=True)}


def _starts(vector: Vector, starts: int, seed: int) -> list[Array]:
    """Where descents begin: the declared start, then anywhere in the box, or in the prior where there is one."""
    draw = np.random.default_rng(seed)
    first, low, high, sigma = vector.start, vector.low, vector.high, vector.sigma
    soft = np.isfinite(sigma)
    out = [first]
    for _ in range(starts - 1):
        normal = np.clip(first + np.where(soft, sigma, 0.0) * draw.standard_normal(first.size), low, high)
        ends = np.where(soft, first, low), np.where(soft, first, high)
        out.append(np.where(soft, normal, draw.uniform(*ends)))
    return out


def within(problem: Problem, ratio: float) -> tuple[Free, ...]:
    """The free parameters in the box ``[P - a|P|, P + a|P|]`` (Suyama 2023 Eq. 38), cut to the interval they declare.

    P is the ship's value.  A parameter whose ship value is zero keeps the interval it declares.

    Raises:
        StudyError: a parameter whose range would be empty.
    """
    out: list[Free] = []
    for f in problem.free:
        value = float(read(problem.ship.model, f.path))
        half = ratio * abs(value)
        low, high = (max(f.low, value - half), min(f.high, value + half)) if half else (f.low, f.high)
        if not low < high:
            raise StudyError(
                f"free: {f.path} is {value:g}: its range at ratio {ratio:g} lies outside of [{f.low:g}, {f.high:g}], "
                "which [free] declares or physics allows"
            )
        out.append(Free(f.path, min(max(value, low), high), low, high))
    return tuple(out)


def softened(problem: Problem, ratio: float, share: float) -> tuple[Free, ...]:
    """The same as Gaussian priors of `share` times the half width, within the interval that each declares."""
    boxes = within(problem, ratio)
    return tuple(
        replace(f, start=b.start, prior=b.start, sigma=share * 0.5 * (b.high - b.low))
        for f, b in zip(problem.free, boxes, strict=True)
    )


@dataclass(frozen=True)
class Residuals:
    """Residuals of a fit, channel by channel, and whether they can be sensor noise.

    Attributes:
        rms: root mean square of the residuals, SI units.
        noise: deviation of white noise in the measurement, from its second differences.
        correlation: of residuals at neighbouring samples.
        bias: mean residual by trial, SI units.
        time: samples per independent one, the largest over the channels that weigh.
        variance: mean square of the weighted residuals over all that is compared.
        independent: independent samples of all trials and channels together.
    """

    rms: Mapping[str, float]
    noise: Mapping[str, float]
    correlation: Mapping[str, float]
    bias: Mapping[str, Mapping[str, float]]
    time: float
    variance: float
    independent: float

    @property
    def counted(self) -> float:
        """Factor of sigma that makes the loss that of independent samples at their own size."""
        return math.sqrt(self.variance * self.time)

    @property
    def warnings(self) -> tuple[str, ...]:
        """One line for each channel whose residuals are not noise of a sensor."""
        return tuple(
            f"the model lacks something: the residual of {name} is {_said(name, rms)} RMS, the noise of its sensor "
            f"{_said(name, self.noise[name])}; neighbouring samples are correlated by {self.correlation[name]:.3f}"
            for name, rms in self.rms.items()
            if rms > 2.0 * self.noise[name] or self.correlation[name] > 0.5
        )


def _said(name: str, value: float) -> str:
    if name in ("psi", "r", "phi", "p"):
        return f"{math.degrees(value):.3g} deg" + ("/s" if name in ("r", "p") else "")
    return f"{value:.3g} m" + ("/s" if name in ("u", "v_m") else "")


def residuals(scorer: Scorer, trials: Sequence[Trial], values: Array) -> Residuals:
    """The residuals of `trials` at `values`."""
    objective = scorer.objective(trials)
    left, scale = objective.residuals(values, objective.begun(values)), objective.windows.scale
    rms, noise, alike = dict[str, float](), dict[str, float](), dict[str, float]()
    bias, times = dict[str, dict[str, float]](), list[tuple[float, float]]()
    for k, name in zip(range(scale.shape[2]), (*STATES, *ROLL), strict=False):
        rows = scale[:, :, k] > 0
        if not rows.any():
            continue
        e = left[:, :, k]
        raw = np.where(rows, e / np.where(rows, scale[:, :, k], 1.0), 0.0)
        rms[name] = float(np.sqrt((raw**2).sum() / rows.sum()))
        second = [np.diff(objective.windows.measured[i, rows[i], k], 2) for i in range(len(trials))]
        # Motion is smooth from sample to sample, noise is not: its second differences have six times its variance.
        noise[name] = float(np.sqrt(np.median(np.concatenate(second) ** 2) / 0.4549 / 6.0))
        bias[name] = {t.name: float(raw[i, rows[i]].mean()) for i, t in enumerate(trials)}
        alike[name], time = correlated([raw[i, rows[i]] for i in range(len(trials))])
        times.append((float((e**2).sum()), time))
    weighty = max(weight for weight, _ in times)
    time = max(t for weight, t in times if weight > 0.01 * weighty)
    compared = float((scale > 0).sum())
    return Residuals(rms, noise, alike, bias, time, float((left**2).sum()) / compared, compared / time)


def flat_directions(
    scorer: Scorer, trials: Sequence[Trial], free: Sequence[Free], values: Array, left: Residuals
) -> int:
    """How many combinations of the parameters the trials leave as wide as their range, or wider.

    The information of the trials is counted by independent samples, and held against the variance of
    a value that lies anywhere in its range.
    """
    objective, vector = scorer.objective(trials), Vector.of(free)
    half = 0.5 * (vector.high - vector.low)
    normal = objective.normal(values, objective.begun(values))
    H = normal.reduced(0.0)[0] - objective.problem.vector.precision
    curvature = half[:, None] * H * half[None, :] / max(left.variance * left.time, 1e-300)
    return int((np.linalg.eigvalsh(0.5 * (curvature + curvature.T)) < 3.0).sum())
