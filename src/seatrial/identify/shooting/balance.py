"""A first guess of the parameters from the balance of momentum: one linear system, whatever a search starts from.

In Fossen's family the momentum M nu changes over a window by the impulse of thrust, damping and Coriolis forces.
Written that way the masses enter linearly too.  The motion is smoothed first, so that noise in the regressors does not
pull the estimates towards zero.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from ...core.symbolic import alone
from ...data import Array
from ...environment import CHANNELS, Environment
from ...models import Model
from ...models.common import Surroundings
from ...models.fossen import Fossen
from ...models.settled import unseen
from .. import Problem
from .chains import Chains
from .condensed import bounded

# Damping of the step's matrix, so that parameters that the data do not excite keep their values, and passes over the
# weights of surge, sway and yaw.
_NUDGE, _PASSES = 1e-9, 2


def momentum_guess(problem: Problem, cut: Chains, *, smooth: float, span: float, start: Array) -> Array | None:
    """Parameters that balance the momentum best, within bounds; None where one linear system does not give them.

    That is where the balance is not linear in them, or has fewer equations than there are parameters.

    Args:
        cut: the trials.
        smooth: length over which velocities are smoothed by a quadratic [s].
        span: length of the windows over which the balance is drawn [s].
        start: values of parameters that the data do not excite, shape (free,).
    """
    balance = _balance(problem)
    if balance is None:
        return None
    parts = [_equations(balance, problem.ship.model, cut, k, start, smooth, span) for k in range(cut.trials)]
    error = np.concatenate([part[0] for part in parts])
    slope = np.concatenate([part[1] for part in parts])
    if len(error) * 3 <= start.size:
        return None
    low, high = problem.vector.low, problem.vector.high
    scale, p = np.ones(3), start
    for _ in range(_PASSES):
        A, b = (slope / scale[:, None]).reshape(-1, start.size), (error / scale).ravel()
        p = np.clip(start + bounded(A.T @ A, A.T @ b, low - start, high - start, _NUDGE), low, high)
        left = np.sqrt(np.mean((error + slope @ (p - start)) ** 2, axis=0))
        scale = np.where(left > 0, left, 1.0)
    return p


@alone
def _balance(problem: Problem) -> Any:
    """CasADi functions of (state, control, environment, p): force less Coriolis force, and momentum, with slopes."""
    model = problem.ship.model
    if not isinstance(model, Fossen):
        return None
    sizes = {"z": len(model.states), "c": len(model.controls), "e": len(CHANNELS), "p": len(problem.free)}
    z, c, e, p = (ca.SX.sym(name, size) for name, size in sizes.items())
    free: Any = problem.vector.model(model, p)
    control = tuple(ca.vertsplit(c))
    fixed = (model.propeller is not None) + (model.rudder is not None)
    flow = Surroundings.of(tuple(ca.vertsplit(z)), Environment(*ca.vertsplit(e))).flow(free.body, *control[:fixed])
    force, nu = free.force(flow, control[fixed:]), (flow.u, flow.v_m, flow.r)
    C = free.inertia.coriolis_matrix(*nu)
    push = [f - sum(a * b for a, b in zip(row, nu, strict=True)) for f, row in zip(force, C, strict=True)]
    momentum = [sum(a * b for a, b in zip(row, nu, strict=True)) for row in free.inertia.matrix]
    outs = [ca.vertcat(*(ca.SX(x) for x in side)) for side in (push, momentum)]
    slopes = [ca.densify(ca.jacobian(out, p)) for out in outs]
    if any(ca.depends_on(ca.vec(slope), p) for slope in slopes):
        return None
    pairs = zip(outs, slopes, strict=True)
    return [ca.Function("side", [z, c, e, p], [ca.densify(out), slope]) for out, slope in pairs]


def _equations(
    balance: Any, model: Model, cut: Chains, trial: int, start: Array, smooth: float, span: float
) -> tuple[Array, Array]:
    """Imbalance at `start` and its derivatives over overlapping windows, shapes (windows, 3) and (windows, 3, free)."""
    # Measured states (gaps bridged) and mean inputs of the trial, one row per compared row.
    lanes = np.flatnonzero(cut.trial == trial)
    mean = cut.series[lanes, :-1].reshape(len(lanes), -1, cut.every, cut.series.shape[2]).mean(axis=2)
    within = np.arange(mean.shape[1]) < cut.length[lanes][:, None]
    motion, series = cut.motion[lanes, :-1][within], mean[within]
    h, n = cut.dt * cut.every, series.shape[1] - len(CHANNELS)
    motion = smoothed(motion, max(round(0.5 * smooth / h), 1))
    state = np.hstack([motion, unseen(model, series, h)])
    push, momentum = balance
    force, d_force = _called(push, 0.5 * (state[1:] + state[:-1]), series[:-1], n, start)
    # The momentum on either side of a step under the same environment: a current that changes is no impulse.
    held, d_held = _called(momentum, state, series, n, start)
    total, d_total = (np.concatenate([np.zeros_like(x[:1]), np.cumsum(h * x, axis=0)]) for x in (force, d_force))
    jump = min(max(round(span / h), 1), len(state) - 1)
    a = np.arange(0, len(state) - jump, max(jump // 4, 1))
    b = a + jump
    error = total[b] - total[a] - (held[b] - held[a])
    return error, d_total[b] - d_total[a] - (d_held[b] - d_held[a])


def _called(function: Any, state: Array, series: Array, n: int, start: Array) -> tuple[Array, Array]:
    rows = len(state)
    given = (state.T, series[:, :n].T, series[:, n:].T, np.repeat(start[:, None], rows, axis=1))
    value, slope = function.map(rows)(*given)
    return np.array(value.full()).T, np.array(slope.full()).reshape(3, rows, -1).transpose(1, 0, 2)


def smoothed(values: Array, half: int) -> Array:
    """Each column by the quadratic that fits `half` rows on either side best; ends by the end's own quadratic.

    Shape (rows, columns) in and out; too few rows stay as they are.
    """
    width = 2 * half + 1
    if width < 4 or len(values) < width:
        return values
    x = np.arange(-half, half + 1) / half
    basis = np.column_stack([np.ones(width), x, x * x])
    hat = basis @ np.linalg.pinv(basis)
    view = np.lib.stride_tricks.sliding_window_view(values, width, axis=0)
    out = values.copy()
    out[half:-half] = view @ hat[half]
    out[:half] = hat[:half] @ values[:width]
    out[-half:] = hat[half + 1 :] @ values[-width:]
    return out
