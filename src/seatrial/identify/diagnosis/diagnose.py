"""Test of a finished fit: residuals against sensor noise, and score tests of the errors that instruments may have.

One Gauss-Newton step from the optimum predicts what estimating one more quantity would change: the objective, that
quantity, and every parameter (score test, Rao 1948; "modification index" in structural equation models, Soerbom 1989).
Where the residuals are white, the covariance follows from their size channel by channel; else each combination of
parameters has the largest variance of that and of the scatter of windows and of trials (White 1980; Liang and Zeger
1986; Bell and McCaffrey 2002), to which the shifts come that the suspects would cause.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.parameters import values
from ...data import Array, Trial
from ...data.prepare import measured
from ...models import STATES, unit
from .. import Fit, Problem
from ..noise import noise
from ..nuisance import EVERY
from ..posterior import information
from ..posterior.acting import Acting, acting
from ..posterior.misfit import correlated
from ..posterior.verdicts import blown_up, judged_by
from ..record import Settings
from ..trajectory.objective import TrajectoryObjective
from ..trajectory.suspects import Suspect, suspects
from ..vector import Vector
from .alternatives import alternatives
from .apart import Beside, sigma_by_trial
from .blame.contradiction import Contradiction
from .blame.gain import gains
from .blame.witness import Witness, witnesses
from .by_trial import Moments, Scores, contradictions, differing
from .channels import Channel, Residuals
from .findings import Diagnosis, Differing, Suspicion
from .linear import Linear, linearised
from .priors import pulls

# A fixed parameter is tested with this change, relative.
_TENTH = 0.1
_LISTED = 5
# No number of a ship is off by more than itself: what wants that is a term that the model lacks.
_ITSELF = 1.0
# Residuals are alike up to the first lag of no more than this correlation.
_LASTS = 0.05
# Ranges by the scatter of trials are those of Student's t at this level.
_LEVEL = 0.95
# A parameter whose variance is so many times that of the directions that data and priors fix is open along another.
_OPEN = 1e6
# Rows beyond which a part of the trials is tested, at least so many of them.
_ROWS, _LEAST = 20_000, 8


def diagnosed(
    fit: Fit, problem: Problem, settings: Settings, rejected: Mapping[str, Mapping[str, int]], *, widen: bool,
    regresses: bool = False,
) -> Fit:  # fmt: skip
    """The fit with its diagnosis, and with verdicts that it caps; sigma follows where the loss leaves it open.

    Args:
        fit: the optimum.
        problem: what was fitted.
        settings: how trajectories were cut and compared; the estimator.
        rejected: outliers, for the record.
        widen: whether sigma follows from the residuals; else it is as the estimator states it.
        regresses: whether the fit takes measured states as exact; then sigma grows by how far
            predictions would move it.
    """
    if fit.covariance.shape != (len(fit.free),) * 2:
        return fit  # an estimator that states no covariance
    trials = problem.trials
    problem = replace(problem, free=fit.free, trials=_enough(problem.trials))
    objective = TrajectoryObjective.like(problem, settings)
    found = fit.nuisances.get(EVERY, {})
    p = np.append(fit.values, [found.get(name, 0.0) for name in problem.nuisance.common])
    eta = objective.begun(p, known=fit.nuisances)
    if not np.isfinite(objective.cost(p, eta)):
        return replace(fit, verdicts=blown_up(fit.verdicts))
    known = tuple(one for one in suspects(problem.ship.model, problem.trials) if one.name not in problem.nuisance.common
                  and not _estimated(one.name, problem) and not _unread(one.name, problem))  # fmt: skip
    fixed = {path: value for path, value in _fixed(fit, problem).items() if path in objective.kernel.system.parameters}
    linear = linearised(objective, p, eta, known, fixed, problem)
    vector, count = problem.vector, len(problem.free)
    channels, size = _channels(objective, linear, noise(problem.trials, problem.ship.model.motion))
    covariance, tested, apart, own_errors = _tests(objective, linear, channels, size, known, problem)
    if not np.isfinite(covariance).all():
        return replace(fit, verdicts=blown_up(fit.verdicts))
    tested = _with_alternatives(objective, p, eta, covariance, channels, tested, problem) if widen else tested
    shown, beside = _shown(problem), Beside.of(objective, p, eta)
    diagnosis = Diagnosis(
        channels, tested, rejected, _errors(objective, p, covariance), _residuals(objective, linear, channels, problem),
        (shown, unit(shown)) if shown else ("", ""), contradictions=apart, differing=own_errors,
        terms=_terms(linear, size, fixed, problem),
        pulls=pulls(vector, p, np.diag(information.inverse(linear.A)), float(linear.e.ravel() @ linear.e.ravel())),
        by_trial=sigma_by_trial(beside, objective.layout, [trial.name for trial in problem.trials]),
    )  # fmt: skip
    wide, form = _widened(linear, covariance, objective.windows.trial, diagnosis, vector)
    part = len(problem.trials) / len(trials)
    stated = np.diag(covariance)[:count] if widen else np.diag(fit.covariance) / part
    ratio = np.diag(wide)[:count] / np.maximum(stated, 1e-300)
    factor = np.sqrt(np.maximum(ratio, 1.0)) if diagnosis.lacking and not regresses else np.ones(count)
    diagnosis = replace(diagnosis, widened=dict(zip(vector.paths, factor.tolist(), strict=True)), form=form)
    diagnosis = _influence(diagnosis, linear, fixed, wide if widen else covariance, problem)
    # The factor may be known from a part of the trials, and what it is of from all.
    spread = wide[:count, :count] if widen and part == 1.0 else factor[:, None] * fit.covariance * factor[None, :]
    if regresses:
        diagnosis, spread = _pulled(diagnosis, linear, p, objective, fit)
    judged = judged_by(fit, problem, diagnosis, spread, _together(objective, linear, p, eta))
    return replace(judged, verdicts=(*judged.verdicts, *beside.verdicts(vector.paths)))


def _together(objective: TrajectoryObjective, linear: Linear, p: Array, eta: Array) -> tuple[Acting, ...]:
    """Parameters and errors of instruments of which only combinations act in the trials."""
    names = (*objective.problem.vector.paths, *(one.name for one in objective.common))
    own = np.zeros((len(p), len(p)))
    own[: objective.count, : objective.count] = objective.problem.vector.precision

    def known(values: Array) -> Array:
        return objective.normal(values, eta).reduced(0.0)[0] - own

    return acting(names, linear.gram()[:, : len(p)], p, known)


def _pulled(
    diagnosis: Diagnosis, linear: Linear, p: Array, objective: TrajectoryObjective, fit: Fit
) -> tuple[Diagnosis, Array]:
    """With how far the predictions would move the parameters, to first order, and its square in their covariance."""
    vector, count = objective.problem.vector, objective.count
    slope = linear.slope.sum(axis=0)
    slope[:count] += vector.precision @ (p[:count] - vector.mean)
    step = np.clip(-information.inverse(linear.A) @ slope, -linear.reach, linear.reach)[:count]
    moves = dict(zip(vector.paths, (step / fit.sigma).tolist(), strict=True))
    return replace(diagnosis, pulled=moves), fit.covariance + np.outer(step, step)


def _tests(
    objective: TrajectoryObjective, linear: Linear, channels: Mapping[str, Channel], size: Array, known: Any,
    problem: Problem,
) -> tuple[Array, tuple[Suspicion, ...], tuple[Contradiction, ...], tuple[Differing, ...]]:
    """Covariance for white residuals and noisy inputs, the score tests of the suspects, and trial against trial."""
    weight, by_inputs = _independent(objective, channels), _by_inputs(linear)
    # Residuals below the noise do not make an error of an instrument more certain than the noise allows.
    motion = problem.ship.model.motion
    least = np.array([_unit(objective, k) * channels[n].noise if n in channels else 1.0 for k, n in enumerate(motion)])
    floor = np.maximum(size, least**2)
    least_sure = _covariance(linear, floor / weight) + by_inputs
    # The ship's own uncertain numbers come first: an instrument is tested by what they cannot explain.
    own = linear.freed(problem.vector.precision)
    tested = _suspicions(own, floor, known, _covariance(own, floor / weight) + by_inputs, problem)
    tested = _credited(own, tested, known, channels, problem)
    moments = _moments(own, floor, problem)
    sigma, paths, n = np.sqrt(np.diag(least_sure)), problem.vector.paths, len(linear.A)
    scores = Scores(moments.names, moments.slope[:, :n], moments.gram[:, :n, :n], moments.scatter[:, :n, :n],
                    linear.A - linear.gram()[:, :n])  # fmt: skip
    own_errors = differing(moments, tested, [one.name for one in known], paths, sigma)
    return (
        _covariance(linear, size / weight) + by_inputs, tested, contradictions(scores, paths, sigma), own_errors,
    )


def _credited(
    linear: Linear, tested: tuple[Suspicion, ...], known: Any, channels: Mapping[str, Channel], problem: Problem
) -> tuple[Suspicion, ...]:
    """Suspects with what the logs say of them, and what they explain beside those that the logs show."""
    log: Mapping[str, Witness] = witnesses(problem.trials, problem.ship.L_pp)
    names = [one.name for one in known]
    shown = [names.index(one.name) for one in tested if one.name in log and log[one.name].shown]
    e = linear.e.reshape(len(linear.e), -1)
    own = linear.extra - linear.J @ (information.inverse(linear.A) @ linear.mixed(linear.J, linear.extra))
    found = gains(e, own, linear.trial, shown, sum(one.count * (1.0 + one.by_inputs**2) for one in channels.values()))
    return tuple(replace(one, log=log.get(one.name), gain=found[names.index(one.name)]) for one in tested)


def _terms(
    linear: Linear, size: Array, fixed: Mapping[str, float], problem: Problem
) -> tuple[Suspicion, ...]:
    """Score tests of the parameters that are held: as relative errors of the values that they have."""
    held = linear.testing(linear.held / _TENTH, linear.held_slope / _TENTH)
    known = [Suspect(path, f"an error of {path}, held at {value:.4g},", "%", 0.01) for path, value in fixed.items()]
    covariance = _covariance(linear, np.maximum(size, 1.0)) + _by_inputs(linear)
    found = _suspicions(held, np.maximum(size, 1.0), known, covariance, problem)
    return tuple(replace(one, most=_ITSELF) for one in found)


def _moments(linear: Linear, size: Array, problem: Problem) -> Moments:
    """Products by trial; the scatter is that of residuals of these mean squares and of the noise of the inputs."""
    n, k = linear.J.shape[-1], linear.extra.shape[-1]
    gram, scatter = (_bordered(one, linear.products, linear.squares) for one in (np.ones(size.size), size))
    slope = np.zeros((len(linear.trials), n + k))
    for at, index in enumerate(linear.trials):
        mine = linear.trial == index
        both = [part[mine].reshape(-1, part.shape[-1]).T for part in (linear.J, linear.extra)]
        drawn = linear.drawn[mine].reshape(both[0].shape[1], -1) / np.sqrt(max(linear.drawn.shape[-1], 1))
        moved = np.concatenate([part @ drawn for part in both])
        scatter[at] += moved @ moved.T
        slope[at] = np.concatenate([part[mine].sum(axis=0) for part in (linear.slope, linear.extra_slope)])
    cost, rows = float(linear.e.ravel() @ linear.e.ravel()), int(np.count_nonzero(linear.e))
    names = [problem.trials[index].name for index in linear.trials]
    return Moments(names, gram, scatter, slope, information.inverse(linear.A), cost, rows)


def _bordered(size: Array, products: Array, squares: Array) -> Array:
    """Products of all columns by trial; of suspects, with the parameters and each with itself."""
    own, others = np.einsum("c,tcnk->tnk", size, products), np.einsum("c,tck->tk", size, squares)
    n = own.shape[1]
    out = np.zeros((len(own), own.shape[2], own.shape[2]))
    out[:, :n], out[:, n:, :n] = own, own[:, :, n:].transpose(0, 2, 1)
    out[:, np.arange(n, out.shape[1]), np.arange(n, out.shape[1])] = others
    return out


def _with_alternatives(
    objective: TrajectoryObjective, p: Array, eta: Array, covariance: Array, channels: Mapping[str, Channel],
    tested: tuple[Suspicion, ...], problem: Problem,
) -> tuple[Suspicion, ...]:
    """Suspects, with what is there or not as a whole where the residuals contradict the model."""
    if not any(one.grounds(name) for name, one in channels.items()):
        return tested
    whole = alternatives(objective, p, eta, np.sqrt(np.diag(covariance)), problem)
    return tuple(sorted([*tested, *whole], key=lambda one: -one.drop))


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


def _unread(name: str, problem: Problem) -> bool:
    """Whether it is an error of a sensor that no trial has: it would act through starts that are estimated anyway."""
    _, _, channel = name.partition(".")
    return channel in STATES and not any(measured(trial, channel) for trial in problem.trials)


def _fixed(fit: Fit, problem: Problem) -> dict[str, float]:
    """Parameters of the model that are not free and not zero, by path."""
    free = {f.path for f in problem.free}
    return {path: value for path, value in values(fit.ship.model).items() if path not in free and value}


def _channels(
    objective: TrajectoryObjective, linear: Linear, level: Mapping[str, float]
) -> tuple[dict[str, Channel], Array]:
    """Residuals of each compared channel, and their mean square per degree of freedom (weighted), shape (motion,)."""
    cut, scale = objective.windows, objective.windows.scale
    back = information.inverse(linear.A)
    drawn = _left(linear).reshape(*scale.shape, -1)
    out: dict[str, Channel] = {}
    motion = objective.problem.ship.model.motion
    size = np.ones(len(motion))
    for k, name in enumerate(motion):
        seen = scale[:, :, k] > 0
        if not seen.any():
            continue
        e = np.where(seen, linear.e[:, :, k], 0.0)
        fitted = (back * linear.products[:, k, :, : len(back)].sum(axis=0)).sum() + linear.leverage[:, :, k][seen].sum()
        freedom = max(float(seen.sum() - fitted), 1.0)
        size[k] = float((e**2).sum()) / freedom
        # What the noise of the inputs leaves is alike, and no fault of the model.
        d = np.where(seen[..., None], drawn[:, :, k], 0.0)
        inputs = float((d**2).sum()) / max(d.shape[-1], 1) / freedom
        both = seen[:, 1:] & seen[:, :-1]
        product = np.where(both, e[:, 1:] * e[:, :-1], 0.0).sum()
        product -= np.where(both[..., None], d[:, 1:] * d[:, :-1], 0.0).sum() / max(d.shape[-1], 1)
        alike = float(product) / max(int(both.sum()), 1) / max(float((e**2).sum()) / seen.sum(), 1e-300)
        per = _unit(objective, k)
        if name in level:
            out[name] = Channel(
                level[name], float(np.sqrt(size[k])) / (per * level[name]), alike, max(int(both.sum()), 1) ** -0.5,
                correlated([e.T], _LASTS)[1] * cut.dt * cut.every, int(seen.sum()),
                float(np.sqrt(inputs)) / (per * level[name]),
            )  # fmt: skip
            # The covariance counts the noise of the inputs by itself.
            size[k] = max(size[k] - inputs, min(size[k], (per * level[name]) ** 2))
    return out, size


def _independent(objective: TrajectoryObjective, channels: Mapping[str, Channel]) -> Array:
    """Share of the residuals of each channel that counts as independent, shape (motion,): all where each counts."""
    cut, motion = objective.windows, objective.problem.ship.model.motion
    own = [min(cut.dt * cut.every / channels[n].lasting, 1.0) if n in channels else cut.weight for n in motion]
    return np.array(own) if cut.weight < 1.0 else np.ones(len(motion))


def _left(linear: Linear) -> Array:
    """What the parameters do not take up of the draws of the noise of inputs, shape (lanes * rows * motion, draws)."""
    return linear.drawn - linear.J @ (information.inverse(linear.A) @ linear.mixed(linear.J, linear.drawn))


def _unit(objective: TrajectoryObjective, channel: int) -> float:
    """Weight of a residual of a channel [1/SI unit]; 0 where it is not compared."""
    scale = objective.windows.scale[:, :, channel]
    return float(np.median(scale[scale > 0])) if (scale > 0).any() else 0.0


def _covariance(linear: Linear, size: Array) -> Array:
    """Covariance for residuals of these mean squares by channel, each over the share that counts as independent."""
    n = len(linear.A)
    meat = linear.gram(size)[:, :n] + linear.A - linear.gram()[:, :n]
    return information.covariance(linear.A, linear.reach, meat)


def _suspicions(
    linear: Linear, size: Array, known: Any, covariance: Array, problem: Problem
) -> tuple[Suspicion, ...]:
    e, count = linear.e.ravel(), linear.J.shape[-1]
    cost, back = float(e @ e), information.inverse(linear.A)
    sigma = np.sqrt(np.diag(covariance))
    G, sized = linear.gram(), linear.gram(size)
    by_channel = linear.squares.sum(axis=0)
    squares, sized_squares = by_channel.sum(axis=0), size @ by_channel
    both = [part.reshape(e.size, -1).T for part in (linear.J, linear.extra)]
    slope, extra_slope = linear.slope.sum(axis=0), linear.extra_slope.sum(axis=0)
    drawn = linear.drawn.reshape(e.size, -1) / np.sqrt(max(linear.drawn.shape[-1], 1))
    moved, extra_moved = (part @ drawn for part in both)
    out: list[Suspicion] = []
    owns, estimates = dict[int, Array](), dict[int, float]()
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
        owns[k], estimates[k] = own, estimate
        out.append(Suspicion(
            one.name, one.words, one.unit, one.per, g * g / max(spread, 1e-300), g * g / curvature / cost, estimate,
            float(np.sqrt(spread)) / curvature, {}, one.of_reading, most=one.most,
        ))  # fmt: skip
    moves = [_moves(k, [one.name for one in known], owns, estimates, linear) / np.maximum(sigma, 1e-300) for k in owns]
    named = [dict(zip(problem.vector.paths, each.tolist(), strict=False)) for each in moves]
    return tuple(sorted((replace(s, moves=own) for s, own in zip(out, named, strict=True)), key=lambda s: -s.drop))


def _moves(
    k: int, names: Sequence[str], owns: Mapping[int, Array], estimates: Mapping[int, float], linear: Linear
) -> Array:
    """Moves of the parameters with a suspect; a wind or current comes with its other component, as it is freed."""
    kind, _, way = names[k].partition(".")
    pair = [i for i in owns if names[i] in (f"{kind}.north", f"{kind}.east")] if way in ("north", "east") else [k]
    if len(pair) < 2:
        return owns[k] * estimates[k]
    own = np.array([owns[i] for i in pair])
    columns = (np.tensordot(own, linear.J, axes=(1, 2)) + np.moveaxis(linear.extra[..., pair], -1, 0)).reshape(2, -1)
    slope = own @ linear.slope.sum(axis=0) + linear.extra_slope.sum(axis=0)[pair]
    return -np.linalg.pinv(columns @ columns.T, hermitian=True) @ slope @ own


def _by_inputs(linear: Linear) -> Array:
    """Covariance that the noise of the inputs adds."""
    moves = information.inverse(linear.A) @ linear.mixed(linear.J, linear.drawn)
    return moves @ moves.T / max(moves.shape[1], 1)


def _residuals(
    objective: TrajectoryObjective, linear: Linear, channels: Mapping[str, Channel], problem: Problem
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
            k = problem.ship.model.motion.index(name)
            scale = cut.scale[mine][:, :, k]
            raw = np.where(scale > 0, linear.e[mine][:, :, k] / np.where(scale > 0, scale, 1.0), np.nan)
            found[name] = (raw / channel.noise)[seen]
        t = np.arange(int(seen.sum()), dtype=np.float64) * (cut.dt * cut.every)
        out[problem.trials[index].name] = Residuals(t, found, control[mine][seen])
    return out


def _errors(objective: TrajectoryObjective, p: Array, covariance: Array) -> tuple[Suspicion, ...]:
    """The errors of instruments that were estimated; the drop is that of a Wald test."""
    count = objective.count
    sigma = np.sqrt(np.diag(covariance))[count:]
    return tuple(
        Suspicion(one.name, one.words, one.unit, one.per, (value / max(sd, 1e-300)) ** 2, 0.0, value, sd, {},
                  one.of_reading)
        for one, value, sd in zip(objective.common, p[count:].tolist(), sigma.tolist(), strict=True)
    )


def _widened(
    linear: Linear, covariance: Array, trial: Any, diagnosis: Diagnosis, vector: Vector
) -> tuple[Array, float]:
    """Covariance, wider where the model does not explain the data, nowhere wider than without them; `Diagnosis.form`.

    Four trials scatter in four directions of fifty, so what they scatter by in all directions together counts in each.
    """
    if not diagnosis.lacking:
        return covariance, 0.0
    from scipy.special import ndtri, stdtrit  # a quarter of a second, for what few ask

    wide, count, form = covariance.copy(), len(vector), 0.0
    for group in (np.arange(len(trial)), trial):
        if (groups := len(np.unique(group))) > 1:
            scatter, times = linear.by_groups(group)
            if not np.isfinite(scatter).all():
                continue  # a search without bounds may end where squares of derivatives overflow
            wide = information.larger(wide, scatter)
            if group is trial:
                data, back = linear.gram()[:, : len(linear.A)], information.inverse(linear.A)
                told = np.diag(covariance) < _OPEN * np.diag(back)
                known = np.where(np.outer(told, told), data, 0.0)
                noise = float(np.sum(covariance * known) / max(np.sum(back * known), 1e-300))
                few = float(stdtrit(groups, 0.5 + 0.5 * _LEVEL) / ndtri(0.5 + 0.5 * _LEVEL)) ** 2
                form = max(1.0 - few * noise / max(times, 1e-300), 0.0)
                wide = information.larger(wide, information.weakened(linear.A, data, few * max(times, noise)))
    sigma = np.sqrt(np.diag(covariance))[:count]
    acting = [one for one in diagnosis.suspicions if one.matters and one.possible]
    for cause in (*acting[:1], *diagnosis.differing[:1]):
        shift = sigma * [cause.moves[path] for path in vector.paths]
        wide[:count, :count] += np.outer(shift, shift)
    return information.smaller(np.diag(linear.reach**2), wide), form


def _influence(
    diagnosis: Diagnosis, linear: Linear, fixed: Mapping[str, float], covariance: Array, problem: Problem
) -> Diagnosis:
    """With the fixed parameters whose error, of one sigma if the ship file states it, would move the result most.

    `linear.held` is the change of the readings by a tenth of the value of each.
    """
    vector, entries = problem.vector, problem.ship.entries
    stated = {path: float(sigma) for path in fixed if path in entries and (sigma := entries[path].sigma)}
    back, sigma = information.inverse(linear.A), np.sqrt(np.diag(covariance))
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
