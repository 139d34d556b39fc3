"""Profile likelihoods: how far each parameter can move while all others make up for it.

The covariance of a fit is a statement about the optimum; a profile walks away from it, with all other
parameters fitted again at every step, and so sees bounds and curved valleys as they are.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.executors import Pool, parted
from ...core.parameters import Free
from ...core.values import dataclass
from ...data import Array
from .. import Fit, Problem, Verdict
from ..record import Settings
from ..trajectory.objective import Ends, TrajectoryObjective
from ..vector import Vector
from .misfit import correlated
from .verdicts import CORRELATED, manoeuvre_for

# chi^2 with one degree of freedom: 95 %.
THRESHOLD = 3.841458820694124
# A walk ends where the rise leaves no doubt.
_ENOUGH = 4.0 * THRESHOLD
_STEPS, _REACH, _MOST = 8, 4.0, 30
# An interval wider than this share of the range is uninformative; a direction as uncertain as a quarter of the
# box is about as free as one that was never measured (a uniform density has 0.29).
_WIDE, _FREE = 0.5, 0.25
# Correlations of residuals below this are chance.
_LASTS = 0.05
# Inverse variance of a uniform density, in units of its range.
_BOX = 12.0
# Components of a direction smaller than this share of its largest are not listed.
_NAMED = 0.2


@dataclass(frozen=True)
class Profile:
    """One parameter's profile.

    Attributes:
        low, high: range that was searched.
        values: the parameter at each step, ascending, shape (steps,).
        rise: objective above the least, in units of the noise: 3.84 is the 95 % limit, shape (steps,).
        others: all parameters at each step, shape (steps, free).
        interval: where the rise stays below the limit; ends of the range where it does to there.
        closed: whether the rise exceeds the limit below, and above.
        loose: whether it has a part in a combination that the data leave open.
    """

    free: Free
    best: float
    low: float
    high: float
    values: Array
    rise: Array
    others: Array
    interval: tuple[float, float]
    closed: tuple[bool, bool]
    loose: bool = False

    @property
    def share(self) -> float:
        """Width of the interval as a share of the range."""
        return (self.interval[1] - self.interval[0]) / (self.high - self.low)

    @property
    def percent(self) -> str:
        """The share as text."""
        return f"{100 * self.share:.0f} %" if self.share >= 0.1 else f"{100 * self.share:.2g} %"

    @property
    def status(self) -> str:
        """"identified", "weak", "not identified" or "at bound"."""
        edge, wide = 1e-6 * (self.high - self.low), self.share > _WIDE
        if wide and not any(self.closed):
            return "not identified"
        bound = self.best - self.free.low <= edge or self.free.high - self.best <= edge
        return "weak" if self.loose or wide else "at bound" if bound else "identified"

    @property
    def verdict(self) -> Verdict:
        """The status in words."""
        a, b = (f"{x:.4g}" for x in self.interval)
        told = f"95 % interval {a} to {b}, {self.percent} of the range"
        traded = "it trades off with others, and its place in the range means little; " if self.loose else ""
        text = {
            "identified": told if all(self.closed) else f"{told}, up to the end of it",
            "weak": f"{told}; {traded}{manoeuvre_for(self.free.path)} would narrow it",
            "not identified": f"any value from {a} to {b} explains the data as well once the others follow; "
            f"not to be read as physics; {manoeuvre_for(self.free.path)} would excite it",
            "at bound": f"{told}; it leans on its bound: either the range is too narrow, or it makes up for something "
            "that the model lacks",
        }[self.status]  # fmt: skip
        half = 0.5 * (self.interval[1] - self.interval[0])
        return Verdict(self.free.path, self.status, text, half / abs(self.best) if self.best else math.inf)


@dataclass(frozen=True)
class Identifiability:
    """What the data determine.

    Attributes:
        profiles: one per free parameter, in their order.
        correlation: of the estimates, shape (free, free).
        directions: eigenvectors of the information in units of the ranges, least determined first,
            shape (free, free), a row each.
        deviations: standard deviation along each, as a share of the range.
        better: decrease below the fit's objective that a profile found, in units of the noise.
        independent: number of residuals that count as independent.
    """

    profiles: tuple[Profile, ...]
    correlation: Array
    directions: Array
    deviations: Array
    better: float
    independent: float

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """One per parameter, then the combinations that the data leave open, then the strong pairs."""
        names = [p.free.path for p in self.profiles]
        loose = [k for k in range(len(names)) if self.deviations[k] > _FREE]
        combined = [_combination(names, self.directions[k], float(self.deviations[k])) for k in loose]
        return (*(p.verdict for p in self.profiles), *combined, *self._pairs(names))

    def _pairs(self, names: Sequence[str]) -> list[Verdict]:
        out: list[Verdict] = []
        for i, j in zip(*np.nonzero(np.tril(np.abs(self.correlation), -1) > CORRELATED), strict=True):
            c = float(self.correlation[i, j])
            word = "trade off against each other" if c < 0 else "rise and fall together"
            out.append(Verdict(f"{names[j]} and {names[i]}", "weak", f"they {word} (correlation {c:+.3f})"))
        return out


def profiles(
    fit: Fit, problem: Problem, settings: Settings, *, variance: float | None = None, pool: Pool | None = None
) -> Identifiability:
    """Profile every free parameter of a fit, all of them in one batch, each step from its neighbour.

    Args:
        fit: the optimum.
        problem: the problem that was fitted, without nuisance parameters.
        settings: how trajectories were cut and compared; the estimator that made the fit.
        variance: mean square of the weighted residuals that is noise; None estimates it from the residuals, and
            counts as one those that are alike.
        pool: who walks, some parameters each, with the same numbers; None does it here.

    Raises:
        StudyError: the problem has nuisances.
    """
    objective = TrajectoryObjective.plain(problem, settings)
    base = objective.descend(fit.values[None])
    here, normals = base.values[0], objective.best(base.values)
    n = here.size
    samples, weight = float(objective.windows.entries), objective.windows.weight
    alike = 1.0 / weight if variance is not None else max(1.0 / weight, _alike(objective, here))
    noise = float(normals.data[0]) / max(samples * weight - n, 1.0) * alike * weight if variance is None else variance
    noise = max(noise, 1e-300)
    low, high = _range(fit, problem.vector)
    width, prior = high - low, problem.vector.precision
    H = (normals.H[0] - prior) / noise + prior
    information, vectors = np.linalg.eigh(np.outer(width, width) * H)
    information = np.maximum(information, 1e-12 * information.max())
    # What nothing holds but the box is as uncertain as a uniform density over it.
    covariance = (vectors / (information + _BOX)) @ vectors.T
    scale = np.sqrt(np.diag(covariance))
    whole = np.arange(n)
    if pool is None:
        found = _Walk(objective, here, low, high, scale * width, noise).go(whole)
    else:
        pieces = ((problem, settings, here, low, high, scale * width, noise, whole[part.start : part.stop])
                  for part in parted(n, pool))  # fmt: skip
        found = [one for some in pool.ordered(_walked, pieces) for one in some]
    least = min(float(rise.min(initial=0.0)) for _, rise, _ in found)
    deviations = 1.0 / np.sqrt(information)
    loose = [any(k in _parts(vectors[:, i]) for i in np.flatnonzero(deviations > _FREE)) for k in range(n)]
    return Identifiability(
        tuple(_profile(f, here[k], low[k], high[k], *found[k], loose[k]) for k, f in enumerate(problem.free)),
        covariance / np.outer(scale, scale), vectors.T, deviations,
        -least + (fit.objective - float(normals.cost[0])) / noise, samples / alike,
    )  # fmt: skip


def _alike(objective: TrajectoryObjective, values: Array) -> float:
    """Number of neighbouring residuals that count as one; see `correlated`."""
    scale = objective.windows.scale
    e = np.where(scale > 0, (objective.predicted(values) - objective.windows.measured) * scale, 0.0)
    return correlated([e.swapaxes(0, 1)], _LASTS, e.shape[1] // 2)[1]


def _range(fit: Fit, vector: Vector) -> tuple[Array, Array]:
    """Bounds; where there are none, three deviations of the prior, or eight of the estimate."""
    prior = fit.vector.sigma
    reach = np.where(np.isfinite(prior), 3.0 * prior, 8.0 * fit.sigma)
    reach = np.where(np.isfinite(reach) & (reach > 0), reach, np.maximum(np.abs(fit.values), 1.0))
    low = np.where(np.isfinite(vector.low), vector.low, np.maximum(fit.values - reach, vector.low))
    high = np.where(np.isfinite(vector.high), vector.high, np.minimum(fit.values + reach, vector.high))
    return low, high


@dataclass(frozen=True)
class _Walk:
    """Both ways from the optimum along every parameter at the same time."""

    objective: TrajectoryObjective
    here: Array
    low: Array
    high: Array
    sigma: Array
    variance: float

    def go(self, some: NDArray[np.intp]) -> list[tuple[Array, Array, Array]]:
        """(values, rise, all parameters) of some parameters, ascending, the optimum among them."""
        n = some.size
        which, sign = np.tile(some, 2), np.repeat([-1.0, 1.0], n)
        end = np.where(sign < 0, self.low[which], self.high[which])
        step = np.minimum(np.abs(end - self.here[which]), _REACH * self.sigma[which]) / _STEPS
        at, place, last = np.tile(self.here, (2 * n, 1)), self.here[which].copy(), np.zeros(2 * n)
        kept = {int(k): [(float(self.here[k]), 0.0, self.here)] for k in some}
        going = np.flatnonzero(np.abs(end - place) > 1e-9 * (self.high - self.low)[which])
        first = self.objective.best(self.here[None])
        for turn in range(_MOST):
            if not going.size:
                break
            ahead = place[going] + sign[going] * step[going]
            over = sign[going] * (ahead - end[going]) > -1e-9 * step[going]
            ahead = np.where(over, end[going], ahead)
            ends = self.descended(at[going], which[going], ahead)
            rise = self._rise(ends.data, ends.costs, first.data[0], first.cost[0])
            for k, lane in enumerate(going):
                kept[int(which[lane])].append((float(ahead[k]), float(rise[k]), ends.values[k]))
            # A step over the whole slope is repeated, shorter; along a long valley steps grow.
            jumped = (rise >= _ENOUGH) & (last[going] < 1.0)
            step[going] *= np.where(jumped, 0.2, 2.0 if turn >= _STEPS else 1.0)
            on = going[~jumped]
            place[on], at[on], last[on] = ahead[~jumped], ends.values[~jumped], rise[~jumped]
            going = going[jumped | (~over & (rise < _ENOUGH))]
        return [
            (np.array([r[0] for r in rows]), np.array([r[1] for r in rows]), np.array([r[2] for r in rows]))
            for rows in (sorted(rows, key=lambda row: row[0]) for rows in kept.values())
        ]

    def descended(self, starts: Array, which: NDArray[np.intp], place: Array) -> Ends:
        """All others fitted again, with one parameter of each problem held at its place."""
        rows, held = np.arange(which.size), np.zeros(starts.shape, dtype=np.bool_)
        starts[rows, which], held[rows, which] = place, True
        return self.objective.descend(starts, held=held, tolerance=1e-9)

    def _rise(self, data: Array, costs: Array, data0: float, costs0: float) -> Array:
        prior = (costs - data) - (costs0 - data0)
        with np.errstate(invalid="ignore"):
            rise = (data - data0) / self.variance + prior
        return np.where(np.isfinite(rise), rise, np.inf)


def _walked(
    problem: Problem, settings: Settings, here: Array, low: Array, high: Array, sigma: Array, variance: float,
    some: NDArray[np.intp],
) -> list[tuple[Array, Array, Array]]:  # fmt: skip
    return _Walk(TrajectoryObjective.plain(problem, settings), here, low, high, sigma, variance).go(some)


def _profile(
    free: Free, best: float, low: float, high: float, values: Array, rise: Array, others: Array, loose: bool
) -> Profile:
    # A step that did better than the optimum makes the whole profile stand on it.
    rise = rise - min(float(rise.min()), 0.0)
    inside = np.flatnonzero(rise <= THRESHOLD)
    a, b = (int(inside[0]), int(inside[-1])) if inside.size else (int(np.argmin(rise)),) * 2
    closed = (a > 0, b < values.size - 1)
    left = _crossing(values, rise, a - 1, a) if closed[0] else float(values[a])
    right = _crossing(values, rise, b, b + 1) if closed[1] else float(values[b])
    return Profile(free, float(best), float(low), float(high), values, rise, others, (left, right), closed, loose)


def _crossing(values: Array, rise: Array, a: int, b: int) -> float:
    """Where the rise meets the limit between two steps; its root is about straight."""
    root: NDArray[np.float64] = np.sqrt(np.maximum(rise[[a, b]], 0.0))
    if not np.isfinite(root).all():
        return float(values[a if np.isfinite(root[0]) else b])
    share = (np.sqrt(THRESHOLD) - root[0]) / (root[1] - root[0])
    return float(values[a] + share * (values[b] - values[a]))


def _parts(direction: Array) -> list[int]:
    """Positions of the components of a direction that count, the largest first."""
    size = np.abs(direction)
    return [int(k) for k in np.argsort(-size) if size[k] >= _NAMED * size.max()]


def _combination(names: Sequence[str], direction: Array, deviation: float) -> Verdict:
    order = _parts(direction)
    parts = [f"{names[k]} {direction[k] / direction[order[0]]:+.2f}" for k in order]
    if len(order) == 1:
        return Verdict(names[order[0]], "not identified", "the data are insensitive to it")
    wide = "the whole box" if deviation > 1.0 else f"{deviation:.0%} of the box"
    return Verdict(
        ", ".join(names[k] for k in order), "not identified",
        f"these trade off against each other: moved together by {', '.join(parts)} (shares of their ranges) over "
        f"{wide}, they change the trajectories by less than the noise",
    )  # fmt: skip
