"""Multiple-shooting Gauss-Newton: start states of all windows free, continuity an exact constraint, condensed.

Windows start from states of their own, measured ones at first, so no prediction runs for long while the
parameters are still wrong; that each window begins where the one before ends is a constraint, met at the optimum
(You 2023 Eqs. 12-14; condensing as in Bock 1983).  The linearised constraints express every start state by the
parameters and the first state of its trial, which leaves normal equations of their size.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..data import Array
from ..engine.rollout import Sensitivity, Simulator, sensitivity, simulator
from ..models import STATES, Sampled
from ..systems import open_loop, open_loop_parameters
from . import Problem, StudyError
from .box_steps import steps
from .chains import Chains, Index
from .constraints import Penalty

_NUDGE = np.full(1, 1e-13)


@dataclass(frozen=True)
class Point:
    """Where a search stands: parameters (free,), and start states of all windows (lanes, states)."""

    p: Array
    nodes: Array


@dataclass(frozen=True)
class Linear:
    """Everything about one point, linearised and condensed.

    Attributes:
        cost: objective there, priors included; gaps do not enter.
        data: its part that the trials contribute.
        gaps: end of the window before less start, zero for first windows, shape (lanes, states).
        N, g: normal equations of (parameters, first state) per trial, gaps closed: (trials, m, m), (trials, m).
        own: gradient per trial with the gaps left open, shape (trials, m).
        closing: what closing the gaps does to half the objective, to first order.
        H_p, g_p: priors, ridge and penalties, shapes (free, free), (free,).
        G, h: start states by (parameters, first state), and by closing the gaps: (lanes, states, m), (lanes, states).
        residuals, slopes: weighted residuals (lanes, rows, 6); raw derivatives (lanes, rows, states, free + states).
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
        freed: whether the first state of each trial is free (then its measurement counts as any other row).
        linked: whether windows must join; else each starts from its measured state, a local optimisation.
        span: scale of each state's gaps, shape (states,).
    """

    problem: Problem
    chains: Chains
    forward: Simulator
    kernel: Sensitivity
    packed: Any
    where: Index
    anchor: Array
    penalty: Penalty
    freed: bool
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
        system = open_loop(problem.ship)
        free = tuple(f.path for f in problem.free)
        forward = simulator(system, ())
        where = np.array([system.parameters.index(path) for path in free], dtype=np.intp)
        return Condensed(
            problem, cut, forward, sensitivity(system, free, ()), forward.pack(cut.series), where, anchor, penalty,
            freed, True, span, method, threads,
        )  # fmt: skip

    def _arguments(self, p: Array) -> tuple[Array, dict[str, Any]]:
        parameters = open_loop_parameters(self.problem.ship)
        parameters[self.where] = p
        cut = self.chains
        return parameters, {"dt": cut.dt, "steps": cut.steps, "every": cut.every, "method": self.method,
                            "threads": self.threads}  # fmt: skip

    def _compared(self, values: Array, nodes: Array) -> tuple[Array, Array]:
        """Weighted residuals, and gaps at the start of each window."""
        cut, n = self.chains, len(STATES)
        e = np.where(cut.scale > 0, (values[:, :, :n] - cut.measured) * cut.scale, 0.0)
        gaps = np.zeros_like(nodes)
        if self.linked:
            for before, lanes in self._links():
                gaps[lanes] = values[before, -1, : nodes.shape[1]] - nodes[lanes]
        return e, gaps

    def _links(self) -> list[tuple[Any, Any]]:
        """Pairs of lanes that follow each other, level by level."""
        pairs: list[tuple[Any, Any]] = []
        for level in self.chains.levels[1:]:
            pairs.append((level - 1, level))
        return pairs

    def extra(self, p: Array) -> tuple[float, Array, Array]:
        """Prior, ridge and penalties: objective, halved gradient and Hessian."""
        away, weight = p - self.anchor[0], self.anchor[1]
        z, dz = self.penalty.rows(p)
        return (float((weight * away**2).sum() + z @ z), weight * away + dz.T @ z, np.diag(weight) + dz.T @ dz)

    def cost(self, point: Point) -> tuple[float, Array]:
        """Objective and gaps; inf where a window blows up."""
        parameters, arguments = self._arguments(point.p)
        with np.errstate(all="ignore"):
            run = self.forward.run(point.nodes, self.packed, parameters, **arguments)
            e, gaps = self._compared(run.values, point.nodes)
            total = float((e * e).sum()) + self.extra(point.p)[0]
        good = np.isfinite(total) and np.isfinite(gaps).all()
        return (total if good else float("inf")), gaps

    def linear(self, point: Point) -> Linear:
        """Objective, linearised and condensed."""
        parameters, arguments = self._arguments(point.p)
        with np.errstate(all="ignore"):
            values, slopes = self.kernel.run(point.nodes, self.packed, parameters, **arguments)
        e, gaps = self._compared(values, point.nodes)
        n, q, lanes, states = point.p.size, len(STATES) * self.freed, *point.nodes.shape
        count = self.chains.trials
        N, g, own = np.zeros((count, n + q, n + q)), np.zeros((count, n + q)), np.zeros((count, n + q))
        G, h = np.zeros((lanes, states, n + q)), np.zeros((lanes, states))
        G[self.chains.levels[0], :q, n:] = np.eye(q)
        closing = 0.0
        for k, level in enumerate(self.chains.levels):
            if k and self.linked:
                end = slopes[level - 1, -1, :states]
                G[level] = end[..., n:] @ G[level - 1]
                G[level, :, :n] += end[..., :n]
                h[level] = (end[..., n:] @ h[level - 1][..., None])[..., 0] + gaps[level]
            t, scale = self.chains.trial[level], self.chains.scale[level]
            S = np.where(scale[..., None] > 0, slopes[level, :, : len(STATES)] * scale[..., None], 0.0)
            flat, r = S.reshape(len(level), -1, S.shape[-1]), e[level].reshape(len(level), -1)
            J = flat[..., n:] @ G[level]
            J[..., :n] += flat[..., :n]
            moved = (flat[..., n:] @ h[level][..., None])[..., 0]
            closing += float((r * moved).sum())
            JT = J.transpose(0, 2, 1)
            N[t] += JT @ J
            own[t] += (JT @ r[..., None])[..., 0]
            g[t] += (JT @ (r + moved)[..., None])[..., 0]
        data, (more, g_p, H_p) = float((e * e).sum()), self.extra(point.p)
        return Linear(data + more, data, gaps, N, g, own, closing, H_p, g_p, G, h, e, slopes)

    def reduced(self, linear: Linear, damping: float) -> tuple[Array, Array, Array]:
        """Normal equations of the parameters alone (H, g), and the first states by them, shape (trials, q, n + 1)."""
        n = linear.g_p.size
        q = linear.g.shape[1] - n
        whole, g = linear.N[:, :n, :n].sum(axis=0) + linear.H_p, linear.g[:, :n].sum(axis=0) + linear.g_p
        whole = whole + np.diag(damping * np.diag(whole))
        if not q:
            return whole, g, np.zeros((len(linear.N), 0, n + 1))
        cross = linear.N[:, n:, :n]
        right = np.concatenate([cross, linear.g[:, n:, None]], axis=2)
        back: Any = np.linalg.solve(linear.N[:, n:, n:] * (1.0 + damping * np.eye(q)), right)
        out: Array = (cross.transpose(0, 2, 1) @ back).sum(axis=0)
        return whole - out[:, :n], g - out[:, n], back

    def step(self, linear: Linear, p: Array, damping: float, low: Array, high: Array) -> Array:
        """Change of (parameters, first state) per trial that minimises the damped quadratic within bounds."""
        H, g, back = self.reduced(linear, damping)
        everything = np.ones((1, g.size), dtype=np.bool_)
        (dp,), _ = steps(H[None], g[None], (low - p)[None], (high - p)[None], everything, _NUDGE)
        first = -(back[:, :, :-1] @ dp + back[:, :, -1])
        return np.hstack([np.repeat(dp[None], len(first), axis=0), first])

    def moved(self, linear: Linear, point: Point, d: Array, share: float, low: Array, high: Array) -> Point:
        """A share of the step."""
        nodes = (linear.G @ d[self.chains.trial][..., None])[..., 0] + linear.h
        return Point(np.clip(point.p + share * d[0, : point.p.size], low, high), point.nodes + share * nodes)

    def multipliers(self, linear: Linear, d: Array) -> Array:
        """Those of the continuity constraints after the step `d`, shape (lanes, states)."""
        n = linear.g_p.size
        out = np.zeros_like(linear.h)
        levels, trial = self.chains.levels, self.chains.trial
        for k in range(len(levels) - 1, 0, -1):
            level = levels[k]
            scale = self.chains.scale[level]
            S = np.where(scale[..., None] > 0, linear.slopes[level, :, : len(STATES)] * scale[..., None], 0.0)
            ds = (linear.G[level] @ d[trial[level]][..., None])[..., 0] + linear.h[level]
            both = np.concatenate([d[trial[level], :n], ds], axis=1)
            r = linear.residuals[level] + (S @ both[:, None, :, None])[..., 0]
            out[level] = np.einsum("lris,lri->ls", S[..., n:], r)
            if k + 1 < len(levels):
                after = levels[k + 1]
                follows = np.isin(level + 1, after)
                end = linear.slopes[level[follows], -1, : self.span.size, n:]
                out[level[follows]] += np.einsum("ljs,lj->ls", end, out[after])
        return out
