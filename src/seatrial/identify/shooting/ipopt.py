"""The same problem through CasADi and IPOPT: every sample a node, continuity as equations, Eqs. 18-19 as inequalities.

The full-space form of You 2023 Eqs. 12-14, as the reference for `condensed` and for constraints that bind.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from ...core.symbolic import alone
from ...core.values import dataclass
from ...data import Array
from ...engine.rollout import is_rk4
from ...engine.trace import right_hand_side
from ...models import STATES
from ...simulate.loop import open_loop, open_loop_parameters
from .. import FitError, Problem
from .chains import Chains, FirstStates, Index
from .constraints import Inequalities

# A bound this many sizes away is left out: the barrier would otherwise pull towards the middle.
_FAR = 1e6


@dataclass(frozen=True)
class Solved:
    """Result of IPOPT.

    Attributes:
        p, nodes: parameters (free,), and states at the start of each lane (lanes, states).
        cost: the objective, priors included.
        iterations: of IPOPT.
        status: its return status.
        success: whether that is a solution.
    """

    p: Array
    nodes: Array
    cost: float
    iterations: int
    status: str
    success: bool


@dataclass(frozen=True)
class FullSpace:
    """The nonlinear programme, built once.

    Attributes:
        solver: CasADi function.
        size: unit of each parameter among the unknowns, shape (free,).
        start: lane starts among all nodes (each trial has one more, its end).
        low, high: bounds of the equations and inequalities.
    """

    problem: Problem
    cut: Chains
    solver: Any
    size: Array
    start: Index
    low: Array
    high: Array
    begun: FirstStates

    @staticmethod
    @alone
    def build(
        problem: Problem, cut: Chains, *, anchor: Array, inequalities: Inequalities, begun: FirstStates, span: Array,
        method: str, exact: bool, iterations: int, tolerance: float,
    ) -> FullSpace:  # fmt: skip
        """Set up the programme.

        Args:
            cut: chains of windows of one compared row each.
            anchor, begun, span: as in `Condensed`.
            exact: the exact Hessian of the Lagrangian; else Gauss-Newton's.
        """
        free, lanes, states = len(problem.free), *cut.state0.shape
        start = np.arange(lanes) + cut.trial
        count = lanes + cut.trials
        begin = np.abs(problem.vector.start)
        size = np.where(begin > 0, begin, 10.0)
        q, X = ca.MX.sym("q", free), ca.MX.sym("X", states, count)
        p = q * size
        acting = ca.DM(cut.series[:, : cut.every].reshape(lanes, -1).T)
        ends = _interval(problem, cut, method).map(lanes)(X[:, start.tolist()], acting, ca.repmat(p, 1, lanes))
        gaps = (ends - X[:, (start + 1).tolist()]) / span
        measured, scale = _rows(cut, start, count, states, begun)
        e = (X - measured) * scale
        away, weight = p - anchor[0], anchor[1]
        f = ca.sumsqr(e) + ca.sum1(weight * away * away)
        x, h = ca.veccat(q, X), inequalities.expression(p)
        nlp = {"x": x, "f": f, "g": ca.veccat(gaps, h)}
        options: dict[str, Any] = {
            "print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.max_iter": iterations,
            "ipopt.tol": tolerance, "ipopt.acceptable_iter": 0, "ipopt.mu_strategy": "adaptive",
            "ipopt.nlp_scaling_method": "none", "error_on_fail": False, "show_eval_warnings": False,
        }  # fmt: skip
        if not exact:
            options["hess_lag"] = _gauss_newton(size, weight, scale, x.numel(), gaps.numel() + len(inequalities.names))
        high = np.concatenate([np.zeros(gaps.numel()), np.full(len(inequalities.names), np.inf)])
        solver = ca.nlpsol("shooting", "ipopt", nlp, options)
        return FullSpace(problem, cut, solver, size, start, np.zeros(high.size), high, begun)

    def solve(self, p: Array, nodes: Array, low: Array, high: Array) -> Solved:
        """Solve from parameters `p` and lane starts `nodes`.

        Raises:
            FitError: IPOPT could not even begin.
        """
        count, states = len(nodes) + self.cut.trials, nodes.shape[1]
        X = np.zeros((count, states))
        ends = np.delete(np.arange(count), self.start)
        X[self.start] = nodes
        last = np.append(np.flatnonzero(np.diff(self.cut.trial)), len(nodes) - 1)
        X[ends, : len(STATES)] = self.cut.motion[last, -1]
        below, above = np.full(X.shape, -np.inf), np.full(X.shape, np.inf)
        first = self.start[self.cut.levels[0]]
        fixed = np.ix_(first, np.setdiff1d(np.arange(states), self.begun.free))
        below[fixed] = above[fixed] = X[fixed]
        least, most = (np.where(np.abs(b) < _FAR * self.size, b / self.size, np.sign(b) * np.inf) for b in (low, high))
        found = self.solver(
            x0=np.concatenate([p / self.size, X.ravel()]),
            lbx=np.concatenate([least, below.ravel()]), ubx=np.concatenate([most, above.ravel()]),
            lbg=self.low, ubg=self.high,
        )  # fmt: skip
        stats, at = self.solver.stats(), np.array(found["x"]).ravel()
        if not np.isfinite(float(found["f"])):
            raise FitError(f"IPOPT stopped without a finite objective: {stats['return_status']}")
        return Solved(
            np.clip(at[: p.size] * self.size, low, high), at[p.size :].reshape(count, states)[self.start],
            float(found["f"]), int(stats["iter_count"]), str(stats["return_status"]), bool(stats["success"]),
        )  # fmt: skip


def _interval(problem: Problem, cut: Chains, method: str) -> Any:
    """CasADi function (state, inputs of the lane, free parameters) -> state one compared row later."""
    system = open_loop(problem.ship)
    rates, known = right_hand_side(system), open_loop_parameters(problem.ship)
    z, p = ca.SX.sym("z", len(system.states)), ca.SX.sym("p", len(problem.free))
    acting = ca.SX.sym("a", len(system.series), cut.every)
    parameters = ca.SX(known)
    parameters[problem.vector.positions(system.parameters).tolist()] = p
    at, dt = z, cut.dt
    for step in range(cut.every):
        a = acting[:, step]
        k_1 = rates(at, a, parameters)
        if not is_rk4(method):
            at = at + dt * k_1
            continue
        k_2 = rates(at + 0.5 * dt * k_1, a, parameters)
        k_3 = rates(at + 0.5 * dt * k_2, a, parameters)
        k_4 = rates(at + dt * k_3, a, parameters)
        at = at + dt / 6.0 * (k_1 + 2.0 * k_2 + 2.0 * k_3 + k_4)
    return ca.Function("interval", [z, ca.vec(acting), p], [ca.cse(at)])


def _rows(cut: Chains, start: Index, count: int, states: int, begun: FirstStates) -> tuple[Array, Array]:
    """Measurement and scale of every node, shapes (states, nodes)."""
    measured, scale = np.zeros((count, states)), np.zeros((count, states))
    first, n, drawn = cut.levels[0], len(STATES), begun.weight > 0
    measured[start + 1, :n], scale[start + 1, :n] = cut.measured[:, 1], cut.scale[:, 1]
    measured[start[first], :n], scale[start[first], :n] = cut.measured[first, 0], cut.scale[first, 0]
    at = np.ix_(start[first], begun.free[drawn])
    measured[at], scale[at] = begun.measured[:, drawn], np.sqrt(begun.weight[drawn])
    return measured.T, scale.T


def _gauss_newton(size: Array, weight: Array, scale: Array, unknowns: int, equations: int) -> Any:
    """Hessian of the objective alone, as IPOPT asks for it: diagonal, the continuity's curvature left out."""
    diagonal = np.concatenate([2.0 * weight * size**2, 2.0 * (scale**2).ravel(order="F")])
    sigma, x = ca.MX.sym("sigma"), ca.MX.sym("x", unknowns)
    H = ca.diag(ca.DM(diagonal)) * sigma
    return ca.Function(
        "hessian", [x, ca.MX.sym("p", 0), sigma, ca.MX.sym("lam", equations)], [H],
        ["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"],
    )  # fmt: skip
