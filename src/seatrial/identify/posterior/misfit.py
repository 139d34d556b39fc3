"""Test of the residuals of a fit against sensor noise, which shows whether the model lacks something.

Initial states are measured, hence wrong by their noise, and a wrong initial state bends the whole track; so the fit
is first repeated with the initial states free within that noise, and only the remaining residuals are tested.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...core.values import dataclass, replace
from ...data import Array
from ...models import STATES
from .. import Fit, Loss, Nuisance, Problem
from ..record import Settings, cut_as
from ..trajectory.gauss_newton import State, minimise
from ..trajectory.objective import TrajectoryObjective

# Residuals larger than the noise by this share, correlations beyond this (over their own scatter), and runs fewer
# than expected by this many deviations are more than chance and the fit itself explain.
_LARGE, _ALIKE, _RUNS = 1.15, 0.1, -4.0


def white(fit: Fit, problem: Problem, settings: Settings) -> dict[str, float]:
    """Deviation of the noise of each measured state, from differences of the residuals between samples.

    What a model lacks, and what an error of the start does, changes slowly; second differences of
    neighbouring residuals hold little of it.
    """
    motion = problem.ship.model.motion
    every = replace(problem, loss=Loss(dict.fromkeys(motion, 1.0), 0.0))
    objective = TrajectoryObjective.plain(every, settings)
    cut = objective.windows
    errors = np.where(cut.scale > 0, cut.measured - objective.predicted(fit.values), np.nan)
    second = errors[:, 2:] - 2.0 * errors[:, 1:-1] + errors[:, :-2]
    seen = np.flatnonzero(np.isfinite(second).any(axis=(0, 1))).tolist()
    # White noise of deviation s has second differences of deviation sqrt(6) s.
    return {motion[k]: float(np.sqrt(np.nanmean(second[:, :, k] ** 2) / 6.0)) for k in seen}


@dataclass(frozen=True)
class Remainder:
    """Residuals of one channel.

    Attributes:
        channel: name of the state.
        size: root mean square over the noise's deviation.
        correlation: of residuals one correlation time (or one sample) apart.
        runs: number of runs of one sign, in deviations from what independent residuals have
            (Wald and Wolfowitz 1940).
        samples: residuals that count.
    """

    channel: str
    size: float
    correlation: float
    runs: float
    samples: int

    @property
    def warnings(self) -> tuple[str, ...]:
        """Deviations from noise, one line each."""
        out: list[str] = []
        if self.size > _LARGE:
            out.append(f"{self.channel}: the residuals are {self.size:.2g} times the sensor noise")
        if self.correlation > _ALIKE + 4.0 / math.sqrt(max(self.samples, 1)):
            out.append(f"{self.channel}: residuals are correlated beyond the correlation time "
                       f"(correlation {self.correlation:.2f})")  # fmt: skip
        if self.runs < _RUNS:
            out.append(f"{self.channel}: residuals keep their sign for longer than chance allows "
                       f"({-self.runs:.0f} deviations too few runs)")  # fmt: skip
        return tuple(out)


@dataclass(frozen=True)
class Misfit:
    """Residuals of every compared channel."""

    remainders: tuple[Remainder, ...]

    @property
    def lacking(self) -> bool:
        """Whether the model lacks something."""
        return any(r.warnings for r in self.remainders)

    @property
    def words(self) -> tuple[str, ...]:
        """The finding and its grounds, one line each."""
        grounds = tuple(line for r in self.remainders for line in r.warnings)
        if not grounds:
            return ("The residuals look like sensor noise: nothing in these trials contradicts the model.",)
        return (
            "The model lacks something that these trials show (wind, current, waves, an actuator's lag, or a term of "
            "the model): bands and intervals count noise only, and are too narrow.", *grounds,
        )  # fmt: skip


def misfit(fit: Fit, problem: Problem, settings: Settings, *, noise: Mapping[str, float] | None = None) -> Misfit:
    """Compare the residuals of a fit with the sensor noise.

    Args:
        fit: the optimum.
        problem: the problem that was fitted.
        settings: how trajectories were cut and compared; the estimator that made the fit.
        noise: declared standard deviation of each measured state's noise; None estimates it (`white`).
    """
    motion = problem.ship.model.motion
    sigma, arguments = cut_as(problem, settings)
    level = white(fit, problem, settings) if noise is None else {n: float(noise.get(n, 0.0)) for n in motion}
    # A channel without noise would have infinite weight; a millionth of the scale replaces zero.
    level = {n: max(v, 1e-6 * sigma.get(n, 1.0), 1e-9) for n, v in level.items() if n in STATES or n in sigma}
    own = replace(problem, nuisance=Nuisance(initial=level), loss=Loss({n: level[n] for n in sigma}, 0.0))
    objective = TrajectoryObjective.build(own, own.trials, own.loss.sigma, **arguments)
    eta, vector = np.zeros(objective.nuisances), fit.vector
    begin = State(fit.values, eta, objective.cost(fit.values, eta))
    end = minimise(objective, begin, vector.low, vector.high, iterations=30, tolerance=1e-6, each=lambda _: None)
    cut = objective.windows
    left = np.where(cut.scale > 0, objective.residuals(end.p, end.eta), np.nan)
    lag = max(math.ceil((problem.loss.correlation or 0.0) / (cut.dt * cut.every)), 1)
    return Misfit(tuple(_remainder(name, left[:, :, motion.index(name)], lag) for name in sigma))


def correlated(rows: Sequence[Array], least: float = 0.0, longest: int | None = None) -> tuple[float, float]:
    """Correlation of neighbours, and samples per independent one, of several series about zero together.

    The latter is 1 plus twice the correlations up to the first lag at which they are `least` or below: an error of the
    start, or of the model, bends a whole track, so its residuals are many but count as one.

    Args:
        rows: the series, zero where there is no sample; the first axis is time.
        least, longest: correlation, and lag in samples, at which the sum ends; None takes the longest series.
    """
    power = sum(float((e * e).sum()) for e in rows)
    if not power > 0:
        return 0.0, 1.0
    total, first = 1.0, 0.0
    for lag in range(1, longest or max(map(len, rows))):
        # The sum over all products, as the power: the fewer the products at a long lag, the less it counts.
        c = sum(float((e[lag:] * e[:-lag]).sum()) for e in rows if len(e) > lag) / power
        first = c if lag == 1 else first
        if c <= least:
            break
        total += 2.0 * c
    return first, total


def _remainder(name: str, e: Array, lag: int) -> Remainder:
    known = np.isfinite(e)
    count = int(known.sum())
    size = float(np.sqrt(np.nanmean(e**2)))
    both = known[:, lag:] & known[:, :-lag]
    product = np.where(both, e[:, lag:] * e[:, :-lag], 0.0)
    alike = float(product.sum()) / max(int(both.sum()), 1) / max(size**2, 1e-300)
    return Remainder(name, size, alike, _runs(e[:, ::lag]), count // lag)


def _runs(e: Array) -> float:
    """Runs of one sign over all windows, in deviations from what independent signs give."""
    runs, mean, variance = 0, 0.0, 0.0
    for row in e:
        sign = row[np.isfinite(row)] > 0
        up, down = int(sign.sum()), int((~sign).sum())
        n = up + down
        if not (up and down):
            # One sign throughout a window is one run; independent signs would give half as many as samples.
            runs, mean, variance = runs + 1, mean + 0.5 * n, variance + 0.25 * n
            continue
        expected = 2.0 * up * down / n
        runs += int(np.count_nonzero(np.diff(sign))) + 1
        mean += expected + 1.0
        variance += expected * (expected - 1.0) / max(n - 1, 1)
    return (runs - mean) / math.sqrt(variance) if variance > 0 else 0.0
