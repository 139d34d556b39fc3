"""The power by which a likelihood counts (`power`), from the errors of fits on trials that they have not seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.values import dataclass, replace
from ..data import Array, Trial
from ..identify import Fit, Problem, StudyError
from ..identify.posterior.misfit import white
from ..identify.record import scales
from ..identify.trajectory.objective import TrajectoryObjective
from .parts import LeftOut, widened
from .power import LEAST, Power, directions
from .sampling.density import density_of

# What noise explains in so many of a hundred cases is taken for noise: that of its start bends a whole window, so that
# there are no more independent errors of this kind than windows.
_CHANCE = 0.95
# Range of the factor that is looked for, and halvings.
_GREATEST, _HALVINGS = 1e8, 60



def power(fit: Fit, problem: Problem, settings: Any, parts: Sequence[LeftOut]) -> Power:
    """The power by which the likelihood of a fit counts, from trials left out in turn.

    Args:
        fit: of `problem` by the estimator `settings`.
        parts: fits that leave trials out, and these trials; see `left_out`.

    Raises:
        StudyError: too few trials, or an estimator that compares no trajectories.
    """
    if len(problem.trials) < LEAST:
        raise StudyError(f"{len(problem.trials)} trials are too few to leave each out in turn; fit {LEAST} or more")
    # Windows that overlap count samples twice, in the covariance that T is of as well; what is missed is counted once.
    settings = replace(settings, stride=None) if getattr(settings, "stride", None) is not None else settings
    # Scales that are estimated from the trials stay those of all of them.
    whole = replace(problem, loss=replace(problem.loss, sigma=scales(problem)))
    density_of(fit, whole, settings)  # refuses what has no likelihood to count less
    level = white(fit, whole, settings)
    sigma = np.array([level.get(name, 0.0) for name in problem.ship.model.motion])
    found = {trial.name: _told(whole, trial, one, settings, sigma) for one in parts for trial in one.trials}
    missed = list(found.values())
    factor = _factor(missed)
    errors = {name: _mean([one], 1.0) for name, one in found.items()}
    return Power(factor, len(found), errors, _mean(missed, factor), widened(fit, problem))


@dataclass(frozen=True)
class _Missed:
    """A trial as the fit of the others predicts it.

    Attributes:
        squares: summed squared error of each channel, in units of its scale, shape (channels,).
        noise: what instruments add to it, at the samples and through the starts of windows, shape (channels,).
        slopes: its derivatives with respect to `across`, squared and summed, shape (channels, free).
        fixed: curvature of the likelihood of the others in these directions, shape (free,).
        windows: that the trial was cut into.
    """

    squares: Array
    noise: Array
    slopes: Array
    fixed: Array
    windows: int

    def explained(self, factor: float) -> Array:
        """What the parameters add to the squares on average, the likelihood counting by 1/factor, shape (channels,)."""
        return self.slopes @ (1.0 / (1.0 + self.fixed / factor))


def _mean(found: Sequence[_Missed], factor: float) -> float:
    """Squared errors over the expected ones: of all trials together, so that great motions count; mean of channels."""
    from scipy.special import gammaincinv  # a quarter of a second, for what few ask

    windows = sum(one.windows for one in found)
    sure = 2.0 * float(gammaincinv(windows / 2.0, _CHANCE)) / windows  # quantile of chi^2 with so many degrees
    expected = np.sum([sure * one.noise + one.explained(factor) for one in found], axis=0)
    return float((np.sum([one.squares for one in found], axis=0) / expected).mean())


def _factor(missed: Sequence[_Missed]) -> float:
    """By which the likelihood is to count less, so that the errors are those that are expected."""
    low, high = 0.0, 0.0 if _mean(missed, 1.0) <= 1.0 else float(np.log(_GREATEST))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _mean(missed, float(np.exp(middle))) > 1.0 else (low, middle)
    return float(np.exp(high))


def _told(problem: Problem, trial: Trial, out: LeftOut, settings: Any, sigma: Array) -> _Missed:
    """The trial as a fit that has not seen it predicts it; `sigma` is the noise of each state."""
    alone = TrajectoryObjective.plain(replace(problem, trials=(trial,), validation=()), settings)
    across, fixed = directions(problem.free, out.held.covariance)
    errors, slopes, begun, scale = _answer(alone, out.held.mean[None])
    noise = ((begun * sigma) ** 2).sum(axis=(0, 2)) + ((scale * sigma[alone.compared]) ** 2).sum(axis=0)
    return _Missed((errors**2).sum(axis=0), noise, ((slopes @ across) ** 2).sum(axis=0), fixed,
                   len(alone.windows.state0))  # fmt: skip


def _answer(objective: TrajectoryObjective, values: Array) -> tuple[Array, Array, Array, Array]:
    """Errors of predictions and what they depend on; estimated starts are the best ones, and answer to the parameters.

    Returns:
        Errors over their scales, shape (rows, channels), their slopes by parameter (rows, channels, free) and by
        measured state at the start (rows, channels, motion), and the inverse scales (rows, channels).
    """
    cut, states, n = objective.windows, objective.compared, values.shape[1]
    freed, answer, eta = objective.layout.own.initial, np.zeros((len(cut.state0), 0, n)), np.zeros((1, 0))
    if objective.freed:
        found, eta = objective.settled(values)
        answer = -found.blocks[0].back()[0, :, :, :-1]
    lanes, _ = objective.lanes(values, eta)
    (run,), (columns,) = objective.slopes(lanes)
    begun = columns[:, :, states, n : n + cut.width].copy()
    own = columns[:, :, states, :n] + np.einsum("wrcs,wsn->wrcn", begun[..., freed], answer)
    begun[..., freed] = 0.0
    scale = cut.scale[:, :, states]
    errors = (run[:, :, states] - cut.measured[:, :, states]) * scale
    rows = (scale > 0).all(axis=2)
    return errors[rows], (own * scale[..., None])[rows], (begun * scale[..., None])[rows], scale[rows]
