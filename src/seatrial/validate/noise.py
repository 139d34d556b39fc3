"""What limits a prediction besides its model: noise of the sensors, and of the state it starts from.

Everything is given in the units of the standardised error (Wakita 2022 Eq. 25), so that it stands beside a
model's own figure.  An error that is independent of the model's adds to it; a floor is what would be left of
the figure were everything else perfect.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..data import Array, Trial
from ..data.prepare.smooth import sensor_noise
from ..environment import to_body, to_earth
from ..models import STATES
from ..simulate.replay import smoothed_starts
from .noise_windows import Cut, Predictor, loss, states

_SPAN = 5.0
_CUBIC = 3


def white_noise(trials: Sequence[Trial]) -> Array:
    """Standard deviation of white noise in each state, from third differences, median over trials, shape (6,)."""
    return np.median([[sensor_noise(column) for column in states(trial).T] for trial in trials], axis=0)


def scatter(trials: Sequence[Trial], span: float = _SPAN) -> Array:
    """Root mean square of each state about a cubic through `span` seconds around it, shape (6,).

    Coloured noise shows here that third differences miss; so does true motion quicker than the cubic.
    """
    from scipy import signal

    parts: list[Array] = []
    for trial in trials:
        table = states(trial)
        table = table[np.isfinite(table).all(axis=1)]
        width = 2 * round(0.5 * span / trial.dt) + 1
        if len(table) > width:
            smooth: Any = signal.savgol_filter(table, width, _CUBIC, axis=0)
            parts.append(table - smooth)
    return _root_mean_square(parts)


def slow_velocity_error(trials: Sequence[Trial], span: float = _SPAN) -> Array:
    """Difference of u, v_m and r from what positions and heading say, means over `span` seconds, RMS, shape (3,).

    It holds the noise of the positions too, and so is an upper bound of the error of the velocities.
    """
    parts: list[Array] = []
    for trial in trials:
        table = states(trial)
        table = table[np.isfinite(table).all(axis=1)]
        n, dt = round(span / trial.dt), trial.dt
        psi = table[:, 2]
        said = np.column_stack([*to_earth(table[:, 3], table[:, 4], np.cos(psi), np.sin(psi)), table[:, 5]])
        total = np.vstack([np.zeros(3), np.cumsum(0.5 * (said[1:] + said[:-1]) * dt, axis=0)])
        miss = ((total[n:] - total[:-n]) - (table[n:, :3] - table[:-n, :3])) / (n * dt)
        ahead, aside = to_body(miss[:, 0], miss[:, 1], np.cos(psi[n // 2 :][: len(miss)]),
                               np.sin(psi[n // 2 :][: len(miss)]))  # fmt: skip
        parts.append(np.column_stack([ahead, aside, miss[:, 2]]))
    return _root_mean_square(parts)


def sensor_floor(sd: Array, sigma: Mapping[str, float]) -> float:
    """What the noise of the compared readings adds to any prediction, however good.

    Args:
        sd: noise of each state, SI units, shape (6,).
        sigma: scale of each state.
    """
    return float(np.sum((sd / np.array([sigma[name] for name in STATES])) ** 2))


def kinematic_floor(cut: Cut) -> dict[str, float]:
    """Error by label of a prediction that knows every measured u, v_m and r, and only integrates them.

    What is left is the disagreement of the positions and heading with the velocities.
    """
    motion = np.nan_to_num(cut.measured)
    out = motion.copy()
    psi = motion[:, 0, 2][:, None] + cut.dt * _before(np.cumsum(motion[:, :, 5], axis=1))
    north, east = to_earth(motion[:, :, 3], motion[:, :, 4], np.cos(psi), np.sin(psi))
    out[:, :, 2] = psi
    for k, rate in ((0, north), (1, east)):
        out[:, :, k] = motion[:, 0, k][:, None] + cut.dt * _before(np.cumsum(rate, axis=1))
    return loss(cut, np.nan_to_num((out - cut.measured) / cut.sigma))


def start_floor(cut: Cut, predictor: Predictor, sd: Array) -> Array:
    """Squared error that the noise of the start alone makes, standardised, shape (lanes, steps, 6).

    Each state's error is carried through the model by a difference quotient and the squares add up, the errors
    of the states being independent.

    Args:
        cut: the windows.
        predictor: the ship's model.
        sd: standard deviation of the error of each state at a restart, SI units, shape (6,).
    """
    total = np.zeros_like(cut.measured)
    known = np.isfinite(cut.measured)
    for k, size in enumerate(sd):
        shift = np.zeros(len(STATES))
        shift[k] = size
        ahead = predictor.errors(cut.starting(cut.state0 + shift))
        behind = predictor.errors(cut.starting(cut.state0 - shift))
        total += np.where(known, (0.5 * (ahead - behind)) ** 2, 0.0)
    return total


def smoothed(cut: Cut, trials: Sequence[Trial], span: float) -> Cut:
    """The windows started from the last `span` seconds of readings instead of one; see `replay_start`.

    Args:
        cut: the windows.
        trials: in the order in which they were cut.
        span: length of the past [s].
    """
    state0 = cut.state0.copy()
    for index, trial in enumerate(trials):
        mine = np.flatnonzero(cut.trial == index)
        state0[mine] = smoothed_starts(trial.t, states(trial), cut.row[mine].tolist(), span)
    return cut.starting(state0)


def _before(total: Array) -> Array:
    """A running sum without its own term: what has been gathered when the step begins."""
    return np.hstack([np.zeros((len(total), 1)), total[:, :-1]])


def _root_mean_square(parts: Sequence[Array]) -> Array:
    return np.sqrt(np.mean(np.concatenate(parts) ** 2, axis=0))
