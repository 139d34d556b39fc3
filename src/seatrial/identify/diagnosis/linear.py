"""A fit, linearised at its optimum: derivatives by parameters, suspects, fixed parameters and noise of the inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core.values import dataclass, replace
from ...data import Array
from ...environment import CHANNELS
from .. import Problem
from ..noise import between_rows, input_noise
from ..posterior import information
from ..trajectory.objective import TrajectoryObjective
from ..trajectory.suspects import Suspect

# Draws of the noise of the inputs.
_DRAWS = 16
# Beside errors of instruments the priors of a ship are wider by this: an estimate is no measurement.
_WIDER = 3.0
# Finite difference of a fixed parameter, relative, and the relative change that is reported.
_SMALL, _TENTH = 1e-4, 0.1


@dataclass(frozen=True)
class Linear:
    """The fit, linearised at its optimum, initial states and other nuisances of the trials eliminated.

    Attributes:
        e: weighted residuals, shape (lanes, rows, motion).
        J: weighted derivatives by the parameters, nuisances projected out, shape (lanes, rows * motion, parameters).
        extra: the same by the suspects, shape (lanes, rows * motion, suspects).
        held: the same by the fixed parameters.
        drawn: changes by draws of the noise of the inputs, weighted and projected alike.
        leverage: of the nuisances, shape (lanes, rows, motion).
        trial: index of the trial of each lane, shape (lanes,).
        products: of the parameters with these and suspects, by trial and channel (trials, motion, n, n + suspects).
        squares: of the suspects, by trial and channel, shape (trials, motion, suspects).
        slope, extra_slope, held_slope: derivatives of half the objective, without the priors of the parameters, by
            parameters, suspects and fixed parameters, shape (lanes, count).  They are those of the fit with its
            nuisances at their best: what the prior of a start asks is in them, and not in `e`.
        A: information on the parameters, that of priors and intervals included, shape (parameters, parameters).
        reach: how far each parameter may be off where nothing is known, shape (parameters,).
    """

    e: Array
    J: Array
    extra: Array
    held: Array
    drawn: Array
    leverage: Array
    trial: Any
    products: Array
    squares: Array
    slope: Array
    extra_slope: Array
    held_slope: Array
    A: Array
    reach: Array

    @staticmethod
    def of(
        e: Array, columns: Array, counts: tuple[int, ...], leverage: Array, trial: Any,
        before: tuple[Array, Array], slopes: Array | None = None,
    ) -> Linear:  # fmt: skip
        """From columns side by side, shape (lanes, rows * motion, parameters + suspects + fixed + draws).

        Args:
            before: information of priors and intervals, shape (parameters, parameters), and the reach, (parameters,).
            slopes: derivatives by all of them of half the objective, shape (lanes, parameters + ...); None takes those
                of `e`, as there are no nuisances.
        """
        J, extra, held, drawn = np.split(columns, np.cumsum(counts)[:-1], axis=-1)
        asked = np.einsum("lrc,lr->lc", columns, e.reshape(len(e), -1)) if slopes is None else slopes
        of_J, of_extra, of_held, _ = np.split(asked, np.cumsum(counts)[:-1], axis=-1)
        products, squares = _by_channel(columns[..., : counts[0] + counts[1]], counts[0], trial, e.shape[2])
        A = products.sum(axis=(0, 1))[:, : counts[0]] + before[0]
        return Linear(e, J, extra, held, drawn, leverage, trial, products, squares, of_J, of_extra, of_held, A,
                      before[1])  # fmt: skip

    @property
    def trials(self) -> list[int]:
        """Indices of the trials, in the order of `products`."""
        return np.unique(self.trial).tolist()

    def testing(self, extra: Array, slope: Array) -> Linear:
        """The same with other suspects, their columns and derivatives as of `extra` and `extra_slope`."""
        whole = np.concatenate([self.J, extra], axis=-1)
        products, squares = _by_channel(whole, self.J.shape[-1], self.trial, self.e.shape[2])
        return replace(self, extra=extra, products=products, squares=squares, extra_slope=slope)

    def by_groups(self, group: Any) -> tuple[Array, float]:
        """Covariance of the parameters by the scatter of groups of lanes, shape (lanes,), and this over that of noise.

        See `information.by_groups`.
        """
        parts = [np.flatnonzero(group == one) for one in np.unique(group)]
        return information.by_groups(self.A, (self.mixed(self.J[mine], self.J[mine]) for mine in parts),
                                     (self.slope[mine].sum(axis=0) for mine in parts))  # fmt: skip

    def freed(self, precision: Array) -> Linear:
        """The same with wider priors of the first parameters, so that no misfit of the ship goes to an instrument.

        Args:
            precision: of the priors, shape (free parameters, free parameters).
        """
        A, n = self.A.copy(), len(precision)
        A[:n, :n] -= (1.0 - _WIDER**-2.0) * precision
        return replace(self, A=A)

    def gram(self, size: Array | float = 1.0) -> Array:
        """Products of the parameters with parameters and suspects, over all channels, each times its `size`."""
        return np.einsum("c,cnk->nk", size * np.ones(self.products.shape[1]), self.products.sum(axis=0))

    @staticmethod
    def mixed(one: Array, other: Array) -> Array:
        """Products of two kinds of columns."""
        rows = one.shape[0] * one.shape[1]  # stated, as either may have no column
        return one.reshape(rows, one.shape[-1]).T @ other.reshape(rows, other.shape[-1])


def _by_channel(columns: Array, n: int, trial: Any, width: int) -> tuple[Array, Array]:
    """Products of the first `n` columns with all, squares of the others, by trial and channel (`width` a row)."""
    products, squares = list[Array](), list[Array]()
    for index in np.unique(trial):
        own = columns[trial == index].reshape(-1, width, columns.shape[-1])
        channels = np.ascontiguousarray(own.transpose(1, 0, 2))
        products.append(np.stack([one[:, :n].T @ one for one in channels]))
        squares.append(np.einsum("crk,crk->ck", channels[:, :, n:], channels[:, :, n:]))
    return np.array(products), np.array(squares)


@np.errstate(all="ignore")
def linearised(
    objective: TrajectoryObjective, p: Array, eta: Array, known: Any, fixed: Mapping[str, float], problem: Problem
) -> Linear:
    """The fit at parameters `p` and nuisances `eta`, with suspects `known` and the `fixed` parameters by path."""
    e, slopes, extra, held, drawn = _derivatives(objective, p, eta, known, fixed, _draws(objective, problem))
    scale = objective.windows.scale
    n, k, h, d = p.size, extra.shape[-1], held.shape[-1], drawn.shape[-1]
    whole = np.concatenate([slopes[..., :n], extra, held, drawn], axis=-1)
    whole *= scale[..., None]
    whole[(scale == 0.0) | ~np.isfinite(whole).all(axis=-1)] = 0.0
    columns = whole.reshape(len(whole), -1, n + k + h + d)
    slopes_of_all = np.einsum("lrc,lr->lc", columns, e.reshape(len(e), -1))
    weighted = slopes * scale[..., None]
    weighted[scale == 0.0] = 0.0
    leverage = np.zeros((len(columns), columns.shape[1]))
    layout = objective.layout
    if objective.nuisances and not layout.own.count:  # initial states only: window by window
        eta_columns = weighted.reshape(len(columns), -1, weighted.shape[-1])[:, :, n + layout.own.initial]
        prior = np.stack([np.diag(layout.deviation[part] ** -2.0) for part in layout.by_window])
        back = np.linalg.solve(eta_columns.transpose(0, 2, 1) @ eta_columns + prior, eta_columns.transpose(0, 2, 1))
        columns -= eta_columns @ (back @ columns)
        leverage = np.einsum("lrk,lkr->lr", eta_columns, back)
    for index in range(len(layout.slices)) if layout.own.count else ():
        part, mine = layout.slices[index], layout.lanes[index]
        eta_columns = layout.columns(index, weighted[mine], scale[mine], n)
        flat = eta_columns.reshape(-1, eta_columns.shape[2])
        own = flat.T @ flat + np.diag(layout.deviation[part] ** -2.0)
        back = np.linalg.solve(own, flat.T)
        mixed = columns[mine].reshape(-1, n + k + h + d)
        columns[mine] = (mixed - flat @ (back @ mixed)).reshape(columns[mine].shape)
        leverage[mine] = np.einsum("rk,kr->r", flat, back).reshape(leverage[mine].shape)
    return Linear.of(e, columns, (n, k, h, d), leverage.reshape(scale.shape), objective.windows.trial,
                     objective.before(p), slopes_of_all)  # fmt: skip


def _derivatives(
    objective: TrajectoryObjective, p: Array, eta: Array, suspects: Sequence[Suspect], fixed: Mapping[str, float],
    draws: Sequence[Array],
) -> tuple[Array, Array, Array, Array, Array]:  # fmt: skip
    """Weighted residuals, and derivatives of the readings, not weighted.

    Args:
        suspects: errors of instruments that are not estimated.
        fixed: parameters that are not estimated; their change is a tenth of their value.
        draws: changes of the inputs, each of the shape of `windows.series`.

    Returns:
        Residuals (lanes, rows, motion), derivatives by `p`, currents and initial states, by the suspects, and the
        changes of the readings by each fixed parameter and each draw, shapes (lanes, rows, motion, ...).
    """
    lanes, bias = objective.lanes(p[None], eta[None])
    states, found = objective.slopes(lanes)
    e = objective.weighted(objective.read(states, p[None], bias))[0]
    full = objective.columns(states, found, p[None], lanes)[0]
    begun = np.moveaxis(full[..., p.size + objective.layout.own.currents :], -1, 0)
    extra = [objective.direction(one, states, p[None], lanes, None, begun[:, None])[0] for one in suspects]
    names = list(objective.kernel.system.parameters)
    held: list[Array] = []
    for path, value in fixed.items():
        if path not in names:
            continue
        other = lanes.shared.copy()
        other[names.index(path)] = value * (1.0 + _SMALL)
        held.append((objective.states(replace(lanes, shared=other)) - states)[0] * (_TENTH / _SMALL))
    moved = [(objective.states(replace(lanes, series=objective.series(p[None], draw))) - states)[0] for draw in draws]
    none = np.zeros((*e.shape, 0))
    suspected, changed, drawn = (np.stack(some, axis=-1) if some else none for some in (extra, held, moved))
    return e, full, suspected, changed, drawn


def _draws(objective: TrajectoryObjective, problem: Problem) -> list[Array]:
    """Draws of the noise of the logged inputs, as they act: controls with the mean of two rows."""
    level = input_noise(problem.trials, problem.ship.model)
    if not level.any():
        return []
    cut, rng = objective.windows, np.random.default_rng(0)
    substeps = max(round(problem.trials[0].dt / cut.dt), 1)
    lanes, steps, inputs = cut.series.shape
    noisy = np.flatnonzero(level)
    held = noisy >= inputs - len(CHANNELS)
    rows = cut.series[:, ::substeps, noisy]
    read = np.ones(rows.shape, dtype=np.bool_)
    read[:, :, ~held] = cut.read[:, :, noisy[~held]]
    open_ = between_rows(rows, level[noisy], read) * ~held
    gaps = np.argwhere(~read.all(axis=1))
    begun = np.maximum.accumulate(np.where(read, np.arange(rows.shape[1])[:, None], 0), axis=1) if len(gaps) else None
    out: list[Array] = []
    for _ in range(_DRAWS):
        white = rng.standard_normal((lanes, -(-steps // substeps) + 1, noisy.size)) * level[noisy]
        for lane, k in gaps:
            at = np.append(np.flatnonzero(read[lane, :, k]), rows.shape[1])
            white[lane, :, k] = np.interp(np.arange(white.shape[1]), at, white[lane, at, k])
        acts = np.where(held, white[:, 1:], 0.5 * (white[:, 1:] + white[:, :-1]))
        own = rng.standard_normal(open_.shape)
        acts[:, : open_.shape[1]] += open_ * (own if begun is None else np.take_along_axis(own, begun, axis=1))
        draw = np.zeros(cut.series.shape)
        draw[:, :, noisy] = (np.repeat(acts, substeps, axis=1) if substeps > 1 else acts)[:, :steps]
        out.append(draw)
    return out
