"""Test of a finished fit: residuals against sensor noise, and score tests of the errors that instruments may have.

One Gauss-Newton step from the optimum predicts what estimating one more quantity would change: the objective, that
quantity, and every parameter (score test, Rao 1948; "modification index" in structural equation models, Soerbom 1989).
Where the residuals are white, the covariance follows from their size channel by channel; else each sigma is widened to
the largest of the sandwich estimates by window and by trial (White 1980; Liang and Zeger 1986) and of the shifts that
the suspects would cause.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.parameters import values
from ...data import Array, Trial
from ...environment import CHANNELS
from ...models import STATES, unit
from .. import Fit, Problem
from ..noise import input_noise, noise
from ..nuisance import EVERY, begun_as
from ..record import Settings, cut_as
from ..trajectory.objective import TrajectoryObjective
from ..trajectory.suspects import suspects
from ..vector import Vector
from .diagnosis import Channel, Diagnosis, Residuals, Suspicion
from .misfit import correlated
from .verdicts import judged_by

# A fixed parameter is tested with this change, relative.
_TENTH = 0.1
# Draws of the noise of the inputs.
_DRAWS = 16
_LISTED = 5
# Residuals are alike up to the first lag of no more than this correlation.
_LASTS = 0.05
# Rows beyond which a part of the trials is tested, at least so many of them.
_ROWS, _LEAST = 20_000, 8


@dataclass(frozen=True)
class _Linear:
    """The fit, linearised at its optimum, initial states and other nuisances of the trials eliminated.

    Attributes:
        e: weighted residuals, shape (lanes, rows, 6).
        J: weighted derivatives by the parameters, nuisances projected out, shape (lanes, rows * 6, parameters).
        extra: the same by the suspects, shape (lanes, rows * 6, suspects).
        held: the same by the fixed parameters.
        drawn: changes by draws of the noise of the inputs, weighted and projected alike.
        leverage: of the nuisances, shape (lanes, rows, 6).
        products: of the parameters with parameters and suspects, channel by channel, shape (6, n, n + suspects).
        squares: of the suspects, channel by channel, shape (6, suspects).
    """

    e: Array
    J: Array
    extra: Array
    held: Array
    drawn: Array
    leverage: Array
    products: Array
    squares: Array

    @staticmethod
    def of(e: Array, columns: Array, counts: tuple[int, ...], leverage: Array) -> _Linear:
        """From columns side by side, shape (lanes, rows * 6, parameters + suspects + fixed + draws)."""
        J, extra, held, drawn = np.split(columns, np.cumsum(counts)[:-1], axis=-1)
        n, both = counts[0], counts[0] + counts[1]
        own = columns.reshape(-1, len(STATES), columns.shape[-1])[:, :, :both]
        channels = np.ascontiguousarray(own.transpose(1, 0, 2))
        products = np.stack([one[:, :n].T @ one for one in channels])
        squares = np.einsum("crk,crk->ck", channels[:, :, n:], channels[:, :, n:])
        return _Linear(e, J, extra, held, drawn, leverage, products, squares)

    def gram(self, size: Array | float = 1.0) -> Array:
        """Products of the parameters with parameters and suspects, over all channels, each times its `size`."""
        return np.tensordot(size * np.ones(len(STATES)), self.products, axes=1)

    @staticmethod
    def mixed(one: Array, other: Array) -> Array:
        """Products of two kinds of columns."""
        rows = one.shape[0] * one.shape[1]  # stated, as either may have no column
        return one.reshape(rows, one.shape[-1]).T @ other.reshape(rows, other.shape[-1])


def diagnosed(
    fit: Fit, problem: Problem, settings: Settings, rejected: Mapping[str, Mapping[str, int]], *, widen: bool
) -> Fit:
    """The fit with its diagnosis, and with verdicts that it caps; sigma follows where the loss leaves it open.

    Args:
        fit: the optimum.
        problem: what was fitted.
        settings: how trajectories were cut and compared; the estimator.
        rejected: outliers, for the record.
        widen: whether sigma follows from the residuals; else it is as the estimator states it.
    """
    if fit.covariance.shape != (len(fit.free),) * 2:
        return fit  # an estimator that states no covariance
    trials = problem.trials
    problem = replace(problem, free=fit.free, trials=_enough(problem.trials))
    own = begun_as(problem, getattr(settings, "initial", "free"))
    sigma, arguments = cut_as(problem, settings)
    objective = TrajectoryObjective.build(own, own.trials, sigma, **arguments)
    found = fit.nuisances.get(EVERY, {})
    p = np.append(fit.values, [found.get(name, 0.0) for name in problem.nuisance.common])
    eta = objective.begun(p)
    if not np.isfinite(objective.cost(p, eta)):
        return fit
    known = tuple(one for one in suspects(problem.ship.model, problem.trials) if one.name not in problem.nuisance.common
                  and not _estimated(one.name, problem))  # fmt: skip
    fixed = {path: value for path, value in _fixed(fit, problem).items() if path in objective.forward.system.parameters}
    with np.errstate(all="ignore"):
        linear = _linear(objective, p, eta, known, fixed, _draws(objective, problem))
    vector = problem.vector
    A = linear.gram()[:, : linear.J.shape[-1]] + np.diag(np.append(vector.precision, objective.deviation**-2.0))
    channels, size = _channels(objective, linear, A, noise(problem.trials))
    covariance, tested = _tests(objective, linear, A, channels, size, known, problem)
    shown = _shown(problem)
    diagnosis = Diagnosis(
        channels, tested, rejected, _errors(objective, p, covariance), _residuals(objective, linear, channels, problem),
        (shown, unit(shown)) if shown else ("", ""),
    )  # fmt: skip
    wide = _widened(linear, A, covariance, objective.windows.trial, diagnosis, vector)
    count = len(problem.free)
    factor = np.sqrt(np.diag(wide) / np.maximum(np.diag(covariance), 1e-300))[:count]
    diagnosis = replace(
        diagnosis, widened=dict(zip(vector.paths, factor.tolist(), strict=True)) if widen else {},
    )  # fmt: skip
    diagnosis = _influence(diagnosis, linear, A, fixed, wide if widen else covariance, problem)
    own_sigma = wide[:count, :count]
    if len(problem.trials) < len(trials):  # the factor is known from a part of the trials, the rest from all
        own_sigma = factor[:, None] * fit.covariance * factor[None, :]
    return judged_by(fit, problem, diagnosis, own_sigma if widen else fit.covariance)


def _tests(
    objective: TrajectoryObjective, linear: _Linear, A: Array, channels: Mapping[str, Channel], size: Array, known: Any,
    problem: Problem,
) -> tuple[Array, tuple[Suspicion, ...]]:
    """Covariance for white residuals and noisy inputs, and the score tests of the suspects."""
    weight, by_inputs = objective.windows.weight, _by_inputs(linear, A)
    # Residuals below the noise do not make an error of an instrument more certain than the noise allows.
    least = np.array([_unit(objective, k) * channels[n].noise if n in channels else 1.0 for k, n in enumerate(STATES)])
    floor = np.maximum(size, least**2)
    least_sure = _covariance(linear, A, floor / weight) + by_inputs
    tested = _suspicions(linear, A, floor, known, least_sure, problem)
    return _covariance(linear, A, size / weight) + by_inputs, tested


def _enough(trials: tuple[Trial, ...]) -> tuple[Trial, ...]:
    """Trials at even distances in their order that have enough rows to test a fit; all of them as a rule."""
    rows = sum(len(trial) for trial in trials)
    return trials[:: max(min(round(rows / _ROWS), len(trials) // _LEAST), 1)]


def _shown(problem: Problem) -> str:
    """The control that residuals are drawn against: the first rudder or azimuth, else the first; "" without any."""
    names = problem.ship.model.controls
    return next((name for name in names if unit(name) == "rad"), names[0] if names else "")


def _estimated(name: str, problem: Problem) -> bool:
    """Whether a nuisance of each trial stands for this error already."""
    kind, _, channel = name.partition(".")
    own = problem.nuisance
    return (kind == "bias" and channel in own.bias) or (kind == "current" and own.current > 0)


def _fixed(fit: Fit, problem: Problem) -> dict[str, float]:
    """Parameters of the model that are not free and not zero, by path."""
    free = {f.path for f in problem.free}
    return {path: value for path, value in values(fit.ship.model).items() if path not in free and value}


def _linear(
    objective: TrajectoryObjective, p: Array, eta: Array, known: Any, fixed: Mapping[str, float], draws: list[Array]
) -> _Linear:
    e, slopes, extra, held, drawn = objective.linear(p, eta, known, fixed, draws)
    scale = objective.windows.scale
    n, k, h, d = p.size, extra.shape[-1], held.shape[-1], drawn.shape[-1]
    whole = np.concatenate([slopes[..., :n], extra, held, drawn], axis=-1)
    whole *= scale[..., None]
    whole[(scale == 0.0) | ~np.isfinite(whole).all(axis=-1)] = 0.0
    columns = whole.reshape(len(whole), -1, n + k + h + d)
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
    return _Linear.of(e, columns, (n, k, h, d), leverage.reshape(scale.shape))


def _channels(
    objective: TrajectoryObjective, linear: _Linear, A: Array, level: Mapping[str, float]
) -> tuple[dict[str, Channel], Array]:
    """Residuals of each compared channel, and their mean square per degree of freedom (weighted), shape (6,)."""
    cut, scale = objective.windows, objective.windows.scale
    back = _inverse(A)
    out: dict[str, Channel] = {}
    size = np.ones(len(STATES))
    for k, name in enumerate(STATES):
        seen = scale[:, :, k] > 0
        if not seen.any():
            continue
        e = np.where(seen, linear.e[:, :, k], 0.0)
        fitted = (back * linear.products[k, :, : len(A)]).sum() + linear.leverage[:, :, k][seen].sum()
        freedom = max(float(seen.sum() - fitted), 1.0)
        size[k] = float((e**2).sum()) / freedom
        both = seen[:, 1:] & seen[:, :-1]
        product = np.where(both, e[:, 1:] * e[:, :-1], 0.0).sum()
        alike = float(product) / max(int(both.sum()), 1) / max(float((e**2).sum()) / seen.sum(), 1e-300)
        per = _unit(objective, k)
        if name in level:
            out[name] = Channel(
                level[name], float(np.sqrt(size[k])) / (per * level[name]), alike, max(int(both.sum()), 1) ** -0.5,
                correlated([e.T], _LASTS)[1] * cut.dt * cut.every, int(seen.sum()),
            )  # fmt: skip
    return out, size


def _unit(objective: TrajectoryObjective, channel: int) -> float:
    """Weight of a residual of a channel [1/SI unit]; 0 where it is not compared."""
    scale = objective.windows.scale[:, :, channel]
    return float(np.median(scale[scale > 0])) if (scale > 0).any() else 0.0


def _inverse(A: Array) -> Array:
    """Pseudo-inverse of a normal matrix; parameters of 1e-5 stand beside those of 300, so it is scaled before."""
    scale = np.maximum(np.diag(A), 1e-300) ** -0.5
    return np.linalg.pinv(scale[:, None] * A * scale, hermitian=True) * np.outer(scale, scale)


def _covariance(linear: _Linear, A: Array, size: Array) -> Array:
    """Covariance for residuals of these mean squares by channel, each over the share that counts as independent."""
    n = len(A)
    prior = A - linear.gram()[:, :n]
    back = _inverse(A)
    return back @ (linear.gram(size)[:, :n] + prior) @ back


def _suspicions(
    linear: _Linear, A: Array, size: Array, known: Any, covariance: Array, problem: Problem
) -> tuple[Suspicion, ...]:
    e, count = linear.e.ravel(), linear.J.shape[-1]
    cost, back = float(e @ e), _inverse(A)
    sigma = np.sqrt(np.diag(covariance))
    G, sized = linear.gram(), linear.gram(size)
    squares, sized_squares = linear.squares.sum(axis=0), size @ linear.squares
    both = [part.reshape(e.size, -1).T for part in (linear.J, linear.extra)]
    slope, extra_slope = (part @ e for part in both)
    drawn = linear.drawn.reshape(e.size, -1) / np.sqrt(max(linear.drawn.shape[-1], 1))
    moved, extra_moved = (part @ drawn for part in both)
    out: list[Suspicion] = []
    for k, one in enumerate(known):
        # The suspect, less what the parameters explain of it.
        own = -back @ G[:, count + k]
        curvature = float(own @ G[:, :count] @ own + 2.0 * own @ G[:, count + k] + squares[k])
        if not curvature > 1e-9 * squares[k]:
            continue  # no data tell it apart from the parameters
        g = float(own @ slope + extra_slope[k])
        spread = float(own @ sized[:, :count] @ own + 2.0 * own @ sized[:, count + k] + sized_squares[k])
        spread += float(((own @ moved + extra_moved[k]) ** 2).sum())
        estimate = -g / curvature
        moves = own * estimate / np.maximum(sigma, 1e-300)
        out.append(Suspicion(
            one.name, one.words, one.unit, one.per, g * g / max(spread, 1e-300), g * g / curvature / cost, estimate,
            float(np.sqrt(spread)) / curvature, dict(zip(problem.vector.paths, moves.tolist(), strict=False)),
            one.of_reading,
        ))  # fmt: skip
    return tuple(sorted(out, key=lambda s: -s.drop))


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
    out: list[Array] = []
    for _ in range(_DRAWS):
        white = rng.standard_normal((lanes, -(-steps // substeps) + 1, noisy.size)) * level[noisy]
        acts = np.where(held, white[:, 1:], 0.5 * (white[:, 1:] + white[:, :-1]))
        draw = np.zeros(cut.series.shape)
        draw[:, :, noisy] = np.repeat(acts, substeps, axis=1)[:, :steps]
        out.append(draw)
    return out


def _by_inputs(linear: _Linear, A: Array) -> Array:
    """Covariance that the noise of the inputs adds."""
    moves = _inverse(A) @ linear.mixed(linear.J, linear.drawn)
    return moves @ moves.T / max(moves.shape[1], 1)


def _residuals(
    objective: TrajectoryObjective, linear: _Linear, channels: Mapping[str, Channel], problem: Problem
) -> dict[str, Residuals]:
    """Residuals of each trial in units of the noise, its windows one after the other."""
    cut, out = objective.windows, dict[str, Residuals]()
    shown, names = _shown(problem), problem.ship.model.controls
    control = cut.series[:, :: cut.every, names.index(shown) if shown else 0][:, : cut.scale.shape[1]]
    for index in np.unique(cut.trial).tolist():
        mine = cut.trial == index
        seen = cut.scale[mine].any(axis=2)
        found: dict[str, Array] = {}
        for name, channel in channels.items():
            k = STATES.index(name)
            scale = cut.scale[mine][:, :, k]
            raw = np.where(scale > 0, linear.e[mine][:, :, k] / np.where(scale > 0, scale, 1.0), np.nan)
            found[name] = (raw / channel.noise)[seen]
        t = np.arange(int(seen.sum()), dtype=np.float64) * (cut.dt * cut.every)
        out[problem.trials[index].name] = Residuals(t, found, control[mine][seen])
    return out


def _errors(objective: TrajectoryObjective, p: Array, covariance: Array) -> tuple[Suspicion, ...]:
    """The errors of instruments that were estimated; the drop is that of a Wald test."""
    count = objective.where.size
    sigma = np.sqrt(np.diag(covariance))[count:]
    return tuple(
        Suspicion(one.name, one.words, one.unit, one.per, (value / max(sd, 1e-300)) ** 2, 0.0, value, sd, {},
                  one.of_reading)
        for one, value, sd in zip(objective.common, p[count:].tolist(), sigma.tolist(), strict=True)
    )


def _widened(
    linear: _Linear, A: Array, covariance: Array, trial: Any, diagnosis: Diagnosis, vector: Vector
) -> Array:
    """Covariance with each sigma widened where the model does not explain the data."""
    if not diagnosis.lacking:
        return covariance
    back = _inverse(A)
    by_window = (linear.J.transpose(0, 2, 1) @ linear.e.reshape(len(linear.e), -1, 1))[:, :, 0]
    most = np.diag(covariance).copy()
    names = np.unique(trial)
    by_trial = np.array([by_window[trial == name].sum(axis=0) for name in names])
    for scores in (by_window, by_trial):
        if len(scores) > 1:
            meat = len(scores) / (len(scores) - 1.0) * scores.T @ scores
            most = np.maximum(most, np.diag(back @ meat @ back))
    count = len(vector)
    for cause in diagnosis.causes[:1]:
        shift = np.array([cause.moves[path] for path in vector.paths])
        most[:count] += np.diag(covariance)[:count] * shift**2
    factor = np.sqrt(most / np.maximum(np.diag(covariance), 1e-300))
    return factor[:, None] * covariance * factor[None, :]


def _influence(
    diagnosis: Diagnosis, linear: _Linear, A: Array, fixed: Mapping[str, float], covariance: Array, problem: Problem
) -> Diagnosis:
    """With the fixed parameters whose error, of one sigma if the ship file states it, would move the result most.

    `linear.held` is the change of the readings by a tenth of the value of each.
    """
    vector, entries = problem.vector, problem.ship.entries
    stated = {path: float(sigma) for path in fixed if path in entries and (sigma := entries[path].sigma)}
    back, sigma = _inverse(A), np.sqrt(np.diag(covariance))
    mixed = linear.mixed(linear.J, linear.held)
    shares = {path: stated[path] / abs(value) if path in stated else _TENTH for path, value in fixed.items()}
    out: list[tuple[str, str, float]] = []
    squares = np.zeros(len(vector))
    for k, path in enumerate(fixed):
        moved = shares[path] / _TENTH * (-back @ mixed[:, k] / np.maximum(sigma, 1e-300))[: len(vector)]
        squares += moved**2 if path in stated else 0.0
        if moved.size:
            at = int(np.argmax(np.abs(moved)))
            out.append((path, vector.paths[at], float(moved[at])))
    first = tuple(sorted(out, key=lambda row: -abs(row[2]))[:_LISTED])
    return replace(
        diagnosis, fixed=first, shares={path: shares[path] for path, _, _ in first},
        carried=dict(zip(vector.paths, np.sqrt(squares).tolist(), strict=True)) if stated else {},
    )  # fmt: skip
