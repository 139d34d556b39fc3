"""Multiple-shooting Gauss-Newton: start states of all windows free, continuity an exact constraint, condensed.

Windows start from states of their own, measured ones at first, so no prediction runs for long while the
parameters are still wrong; that each window begins where the one before ends is a constraint, met at the optimum
(You 2023 Eqs. 12-14; condensing as in Bock 1983).  The linearised constraints express every start state by the
parameters and the first state of its trial, which leaves normal equations of their size.  `descend` takes shortened
steps, judged by the objective and an exact penalty on the gaps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ...core.values import dataclass, replace
from ...data import Array
from ...models import STATES, Sampled
from ...simulate.lanes import Kernel, Lanes, run, slopes
from ...simulate.loop import open_loop, open_loop_parameters
from .. import Problem, StudyError
from ..nuisance import Nuisances
from ..trajectory.gauss_newton import steps
from .chains import Chains, FirstStates, Index
from .constraints import Penalty

_NUDGE = 1e-13


@dataclass(frozen=True)
class Point:
    """Unknowns of a search.

    Attributes:
        p: parameters, shape (free,).
        nodes: start states of all windows, shape (lanes, states).
        own: nuisances of each trial, shape (trials, count); see `Nuisances`.
    """

    p: Array
    nodes: Array
    own: Array


@dataclass(frozen=True)
class Linear:
    """Everything about one point, linearised and condensed.

    Attributes:
        cost: objective there, priors included; gaps do not enter.
        data: its part that the trials contribute.
        gaps: end of the window before less start, zero for first windows, shape (lanes, states).
        N, g: normal equations of (parameters, first state, nuisances) per trial, gaps closed: (trials, m, m),
            (trials, m).
        own: gradient per trial with the gaps left open, shape (trials, m).
        closing: what closing the gaps does to half the objective, to first order.
        H_p, g_p: priors, ridge and penalties, shapes (free, free), (free,).
        G, h: start states by those m unknowns, and by closing the gaps: (lanes, states, m), (lanes, states).
        residuals: weighted, shape (lanes, rows, 6).
        slopes: raw derivatives, shape (lanes, rows, states, free + currents + states).
    """

    cost: float
    data: float
    gaps: Array
    N: Array
    g: Array
    own: Array
    closing: float
    H_p: Array
    g_p: Array
    G: Array
    h: Array
    residuals: Array
    slopes: Array

    def slope(self, d: Array, weights: Array) -> float:
        """Derivative of half the objective and the weighed gaps along a step that closes them."""
        along = float((self.own * d).sum()) + float(self.g_p @ d[0, : self.g_p.size]) + self.closing
        return along - float((weights * np.abs(self.gaps)).sum())


@dataclass(frozen=True)
class Condensed:
    """The objective of whole trajectories in windows.

    Attributes:
        problem, chains: what is fitted, and how it is cut.
        anchor: mean of the prior and the ridge together, and their weight, shape (2, free).
        penalty: inequalities.
        nuisances: currents and biases of each trial.
        begun: which entries of the first state of each trial are free (their measurements count as any other row).
        linked: whether windows must join; else each starts from its measured state, a local optimisation.
        span: scale of each state's gaps, shape (states,).
    """

    problem: Problem
    chains: Chains
    kernel: Kernel
    packed: Any
    where: Index
    anchor: Array
    penalty: Penalty
    nuisances: Nuisances
    begun: FirstStates
    linked: bool
    span: Array
    method: str
    threads: int | None

    @staticmethod
    def build(
        problem: Problem, cut: Chains, *, anchor: Array, penalty: Penalty, freed: bool, span: Array,
        method: str, threads: int | None,
    ) -> Condensed:  # fmt: skip
        """Compile for `problem`.

        Raises:
            StudyError: a model in discrete time, which has no start state to free.
        """
        if isinstance(problem.ship.model, Sampled):
            raise StudyError(
                f"{problem.ship.name}: shooting in windows needs a continuous model; take arx_fit:ArxRegression"
            )
        system, vector, own = open_loop(problem.ship), problem.vector, Nuisances.of(problem.nuisance)
        kernel = Kernel(system, own.lanewise, (*vector.paths, *own.lanewise))
        return Condensed(
            problem, cut, kernel, kernel.pack(cut.series), vector.positions(system.parameters), anchor, penalty, own,
            FirstStates.of(cut, span) if freed else FirstStates.none(cut), True, span, method, threads,
        )  # fmt: skip

    def start(self, p: Array, own: Array | None = None) -> Point:
        """Parameters `p`, windows from measured states less their biases; without `own`, no nuisance."""
        own = np.zeros((self.chains.trials, self.nuisances.count)) if own is None else own
        nodes = self.chains.state0.copy()
        nodes[:, : len(STATES)] -= self.nuisances.offset(own)[self.chains.trial]
        return Point(p, nodes, own)

    def _lanes(self, point: Point) -> tuple[Lanes, Array]:
        """Runs of the windows, and what is added to predictions, shape (lanes, 1, 6)."""
        parameters = open_loop_parameters(self.problem.ship)
        parameters[self.where] = point.p
        own = point.own[self.chains.trial]
        lanes = Lanes(self.kernel, parameters, point.nodes, self.packed, lanewise=self.nuisances.drift(own))
        return lanes, self.nuisances.offset(own)[:, None, :]

    def _compared(self, values: Array, nodes: Array, offset: Array) -> tuple[Array, Array]:
        """Weighted residuals, and gaps at the start of each window."""
        cut, n = self.chains, len(STATES)
        e = np.where(cut.scale > 0, (values[:, :, :n] + offset - cut.measured) * cut.scale, 0.0)
        gaps = np.zeros_like(nodes)
        for lanes in cut.levels[1:] if self.linked else ():
            gaps[lanes] = values[lanes - 1, -1, : nodes.shape[1]] - nodes[lanes]
        return e, gaps

    def extra(self, p: Array) -> tuple[float, Array, Array]:
        """Prior, ridge and penalties: objective, halved gradient and Hessian."""
        away, weight = p - self.anchor[0], self.anchor[1]
        z, dz = self.penalty.rows(p)
        return (float((weight * away**2).sum() + z @ z), weight * away + dz.T @ z, np.diag(weight) + dz.T @ dz)

    def priors(self, point: Point) -> float:
        """Part of the objective of the nuisance parameters and of the first states without compared readings."""
        return self.nuisances.prior(point.own) + self.begun.prior(point.nodes)

    def cost(self, point: Point) -> tuple[float, Array]:
        """Objective and gaps; inf where a window blows up."""
        lanes, offset = self._lanes(point)
        with np.errstate(all="ignore"):
            values = run(lanes, self.chains.grid(self.method), threads=self.threads).values
            e, gaps = self._compared(values, point.nodes, offset)
            total = float((e * e).sum()) + self.extra(point.p)[0] + self.priors(point)
        good = np.isfinite(total) and np.isfinite(gaps).all()
        return (total if good else float("inf")), gaps

    def linear(self, point: Point) -> Linear:
        """Objective, linearised and condensed."""
        runs, offset = self._lanes(point)
        with np.errstate(all="ignore"):
            values, found = slopes(runs, self.chains.grid(self.method), self.threads)
        e, gaps = self._compared(values, point.nodes, offset)
        n, lanes, states = point.p.size, *point.nodes.shape
        count, q = self.chains.trials, n + self.begun.count
        m, weight = q + self.nuisances.count, self.nuisances.deviation**-2.0
        N, own, g = np.zeros((count, m, m)), np.zeros((count, m)), np.zeros((count, m))
        N[:, q:, q:], own[:, q:] = np.diag(weight), weight * point.own
        N[:, n:q, n:q], own[:, n:q] = np.diag(self.begun.weight), self.begun.weight * self.begun.away(point.nodes)
        g += own
        G, h = np.zeros((lanes, states, m)), np.zeros((lanes, states))
        closing = 0.0
        for k, level in enumerate(self.chains.levels):
            self._begun(k, found, gaps, G, h)
            J, moved = self._rows(level, found, G, h)
            t, r, JT = self.chains.trial[level], e[level].reshape(len(level), -1), J.transpose(0, 2, 1)
            closing += float((r * moved).sum())
            N[t] += JT @ J
            own[t] += (JT @ r[..., None])[..., 0]
            g[t] += (JT @ (r + moved)[..., None])[..., 0]
        data, (more, g_p, H_p) = float((e * e).sum()), self.extra(point.p)
        cost = data + more + self.priors(point)
        return Linear(cost, data, gaps, N, g, own, closing, H_p, g_p, G, h, e, found)

    def _begun(self, k: int, slopes: Array, gaps: Array, G: Array, h: Array) -> None:
        """Start states of the k-th windows by the unknowns of their trials, put into G and h."""
        level, n, q, c = self.chains.levels[k], self.where.size, self.begun.count, self.nuisances.currents
        if k and self.linked:
            end = slopes[level - 1, -1, : h.shape[1]]
            G[level] = end[..., n + c :] @ G[level - 1]
            G[level, :, :n] += end[..., :n]
            G[level, :, n + q : n + q + c] += end[..., n : n + c]
            h[level] = (end[..., n + c :] @ h[level - 1][..., None])[..., 0] + gaps[level]
        else:  # as measured, less the bias of the reading, unless free
            G[level[:, None], self.nuisances.bias, np.arange(n + q + c, G.shape[2])] = -1.0
            if not k:
                G[level[:, None], self.begun.free] = 0.0
                G[level[:, None], self.begun.free, np.arange(n, n + q)] = 1.0

    def _weighed(self, level: Index, slopes: Array) -> Array:
        """Derivatives of the weighted residuals of some windows, shape (windows, rows, 6, columns)."""
        scale = self.chains.scale[level][..., None]
        return np.where(scale > 0, slopes[level, :, : len(STATES)] * scale, 0.0)

    def _rows(self, level: Index, slopes: Array, G: Array, h: Array) -> tuple[Array, Array]:
        """The same by the m unknowns of the trials, and what closing the gaps of the windows adds to the residuals."""
        n, q, c, scale = self.where.size, self.begun.count, self.nuisances.currents, self.chains.scale[level]
        S = self._weighed(level, slopes)
        flat = S.reshape(len(level), -1, S.shape[-1])
        J = flat[..., n + c :] @ G[level]
        J[..., :n] += flat[..., :n]
        if self.nuisances.count:
            J[..., n + q : n + q + c] += flat[..., n : n + c]
            bias = self.nuisances.bias
            J.reshape(*scale.shape, -1)[..., bias, np.arange(n + q + c, J.shape[-1])] += scale[..., bias]
        return J, (flat[..., n + c :] @ h[level][..., None])[..., 0]

    def reduced(self, linear: Linear, damping: float) -> tuple[Array, Array, Array]:
        """Normal equations of the parameters alone (H, g), and the others by them, shape (trials, m - n, n + 1)."""
        n = linear.g_p.size
        q = linear.g.shape[1] - n
        whole, g = linear.N[:, :n, :n].sum(axis=0) + linear.H_p, linear.g[:, :n].sum(axis=0) + linear.g_p
        whole += np.diag(damping * np.diag(whole))
        if not q:
            return whole, g, np.zeros((len(linear.N), 0, n + 1))
        cross = linear.N[:, n:, :n]
        right = np.concatenate([cross, linear.g[:, n:, None]], axis=2)
        back: Any = np.linalg.solve(linear.N[:, n:, n:] * (1.0 + damping * np.eye(q)), right)
        out: Array = (cross.transpose(0, 2, 1) @ back).sum(axis=0)
        return whole - out[:, :n], g - out[:, n], back

    def step(self, linear: Linear, p: Array, damping: float, low: Array, high: Array) -> Array:
        """Change of the m unknowns of each trial that minimises the damped quadratic within bounds."""
        H, g, back = self.reduced(linear, damping)
        dp = bounded(H, g, low - p, high - p, _NUDGE)
        first = -(back[:, :, :-1] @ dp + back[:, :, -1])
        return np.hstack([np.repeat(dp[None], len(first), axis=0), first])

    def moved(self, linear: Linear, point: Point, d: Array, share: float, low: Array, high: Array) -> Point:
        """A share of the step."""
        nodes, n = (linear.G @ d[self.chains.trial][..., None])[..., 0] + linear.h, point.p.size
        return Point(
            np.clip(point.p + share * d[0, :n], low, high), point.nodes + share * nodes,
            point.own + share * d[:, n + self.begun.count :],
        )  # fmt: skip

    def multipliers(self, linear: Linear, d: Array) -> Array:
        """Those of the continuity constraints after the step `d`, shape (lanes, states)."""
        n, c = linear.g_p.size, self.nuisances.currents
        q, out = n + self.begun.count, np.zeros_like(linear.h)
        levels = self.chains.levels
        for k in range(len(levels) - 1, 0, -1):
            level = levels[k]
            step, S = d[self.chains.trial[level]], self._weighed(level, linear.slopes)
            ds = (linear.G[level] @ step[..., None])[..., 0] + linear.h[level]
            both = np.concatenate([step[:, :n], step[:, q : q + c], ds], axis=1)
            r = linear.residuals[level] + (S @ both[:, None, :, None])[..., 0]
            r += self.chains.scale[level] * self.nuisances.offset(step[:, q:])[:, None, :]
            out[level] = np.einsum("lris,lri->ls", S[..., n + c :], r)
            if k + 1 < len(levels):
                after = levels[k + 1]
                follows = np.isin(level + 1, after)
                end = linear.slopes[level[follows], -1, : self.span.size, n + c :]
                out[level[follows]] += np.einsum("ljs,lj->ls", end, out[after])
        return out


def bounded(H: Array, g: Array, low: Array, high: Array, nudge: float) -> Array:
    """The step within bounds relative to where one problem stands; see `gauss_newton.steps`."""
    everything = np.ones((1, g.size), dtype=np.bool_)
    return steps(H[None], g[None], low[None], high[None], everything, nudge)[0]


# Damping of Marquardt's diagonal: start, least, ratio after a full step, ratio after a refused one.  Less than that of
# `gauss_newton`, with which fits of the tug take 17 % more iterations: refused steps are shortened first.
DAMPING, _LEAST, _DOWN, _UP = 1e-4, 1e-12, 0.1, 8.0
# A refused step is shortened (or, where windows need not join, damped) so often at most.
_TRIES = 16
# Share of the promised decrease that a step must bring; gaps that no longer matter, in scales of their channels.
_ARMIJO, _CLOSED = 1e-4, 1e-6
# Relative rounding of a sum over all samples.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Search:
    """State of a descent.

    Attributes:
        point, cost: parameters and start states, and the objective there.
        iteration, evaluations: what it took.
        closed: whether the windows join.
        done: reason why it stopped; "converged" where it did.
    """

    point: Point
    cost: float
    damping: float = DAMPING
    iteration: int = 0
    evaluations: int = 0
    closed: bool = False
    done: str = ""


def descend(
    objective: Condensed, start: Point, low: Array, high: Array, *,
    iterations: int, tolerance: float, each: Callable[[Search], None], damping: float = DAMPING,
) -> Search:  # fmt: skip
    """Go down from `start` until steps promise less than `tolerance` of the objective and the windows join.

    An exact penalty on the gaps (with weights from the multipliers, Powell 1978) says whether a step is good.
    """
    cost, gaps = objective.cost(start)
    search = Search(start, cost, damping)
    if not np.isfinite(cost):
        return replace(search, done="the model blows up within a window")
    weights = np.zeros(gaps.shape)
    while not search.done:
        if search.iteration >= iterations:
            return replace(search, done=f"stopped after {iterations} iterations")
        # Far from the optimum a linearised trajectory may overflow; such a step is refused.
        with np.errstate(all="ignore"):
            search, weights = _iterate(objective, search, weights, low, high, tolerance)
        each(search)
    return search


def _iterate(
    objective: Condensed, search: Search, weights: Array, low: Array, high: Array, tolerance: float
) -> tuple[Search, Array]:  # fmt: skip
    point = search.point
    linear = objective.linear(point)
    damping, evaluations = search.damping, search.evaluations + 1
    d, share = objective.step(linear, point.p, damping, low, high), 1.0
    if objective.linked:  # else there are no gaps, and multipliers of unstable windows may overflow
        force = 1.1 * np.abs(objective.multipliers(linear, d))
        weights = np.maximum(force, 0.5 * (weights + force))

    def penalised(cost: float, gaps: Array) -> float:
        return 0.5 * cost + float((weights * np.abs(gaps)).sum())

    def joins(gaps: Array) -> bool:
        return bool((np.abs(gaps) <= _CLOSED * objective.span).all())

    before = penalised(linear.cost, linear.gaps)
    for _ in range(_TRIES):
        to = objective.moved(linear, point, d, share, low, high)
        cost, gaps = objective.cost(to)
        evaluations += 1
        after, slope = penalised(cost, gaps), min(linear.slope(d, weights), 0.0)
        if after <= before + _ARMIJO * share * slope + _ROUNDING * before:
            closed, still = joins(gaps), before - after <= tolerance * before
            small = closed and still and (share == 1.0 or -slope <= tolerance * before)
            damping = max(damping * _DOWN, _LEAST) if share == 1.0 else damping * (_UP if share < 0.3 else 1.0)
            done = "converged" if small else ""
            return Search(to, cost, damping, search.iteration + 1, evaluations, closed, done), weights
        share *= 0.5
        if not objective.linked:
            damping, share = damping * _UP, 1.0
            d = objective.step(linear, point.p, damping, low, high)
    end = replace(search, iteration=search.iteration + 1, evaluations=evaluations, closed=joins(linear.gaps),
                  done="no further decrease")  # fmt: skip
    return end, weights
