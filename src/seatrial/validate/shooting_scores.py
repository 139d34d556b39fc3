"""What a model is worth over a horizon: errors of whole runs and of predictions that begin at measured states."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..data import Array, Trial, unwrapped
from ..engine.rollout import simulator
from ..identify.record import between
from ..models import STATES
from ..ships import Ship
from ..simulate.approach import substeps
from ..simulate.loop import open_loop, open_loop_memory, open_loop_parameters
from ..simulate.replay import inputs, unseen

VELOCITIES: tuple[str, ...] = ("u", "v_m", "r")
HORIZONS = (1, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50)
"""Steps of a prediction, as in Fig. 22 of You 2023."""

# Rows from one start of a short prediction to the next.
_STRIDE = 10


@dataclass(frozen=True)
class Score:
    """Errors of one model on some trials; infinite where its predictions blow up.

    Attributes:
        relative: by velocity, norm of the error of whole runs over that of the measured, all trials together.
        runs: root mean square error of the whole run, by trial and velocity [m/s, rad/s].
        steps: root mean square error after each of `HORIZONS` steps, by state [m, rad, m/s, rad/s].
        starts: predictions behind each number of `steps`.
    """

    relative: Mapping[str, float]
    runs: Mapping[str, Mapping[str, float]]
    steps: Mapping[str, Array]
    starts: int

    def beyond(self, other: Score) -> Mapping[str, float]:
        """Error after the longest horizon over that of `other`, by state."""
        return {name: float(self.steps[name][-1] / other.steps[name][-1]) for name in self.steps}


def score(ship: Ship, trials: Sequence[Trial]) -> Score:
    """Errors of `ship` on `trials`, which must have complete rows at even steps, the same in all."""
    states = [_states(trial) for trial in trials]
    acting = [inputs(trial, ship.model) for trial in trials]
    known = [np.hstack([state, unseen(ship.model, rows, trials[0].dt)])
             for state, rows in zip(states, acting, strict=True)]  # fmt: skip
    longest = max(len(trial) for trial in trials)
    begun, lanes = np.array([state[0] for state in known]), np.array([_held(rows, longest) for rows in acting])
    whole = _predicted(ship, begun, lanes, trials[0].dt)
    columns = [STATES.index(name) for name in VELOCITIES]
    errors = [run[: len(state), columns] - state[:, columns] for run, state in zip(whole, states, strict=True)]
    runs = {t.name: dict(zip(VELOCITIES, _rms(e), strict=True)) for t, e in zip(trials, errors, strict=True)}
    size = _rms(np.concatenate(states)[:, columns])
    away = _rms(np.concatenate(errors))
    relative = {name: a / b for name, a, b in zip(VELOCITIES, away, size, strict=True)}
    short = _short(ship, known, acting, trials[0].dt)
    steps = {name: np.array(_rms(short[:, :, k])) for k, name in enumerate(STATES)}
    return Score(relative, runs, steps, len(short))


def _states(trial: Trial) -> Array:
    state = trial.stack(*STATES)
    state[:, 2] = unwrapped(state[:, 2])
    return state


def _held(rows: Array, count: int) -> Array:
    """The rows, the last of them held until there are `count`."""
    return np.concatenate([rows, np.repeat(rows[-1:], count - len(rows), axis=0)])


def _short(ship: Ship, states: Sequence[Array], acting: Sequence[Array], dt: float) -> Array:
    """Errors after each of `HORIZONS` steps, shape (starts, horizons, 6).

    Args:
        states: what each row begins with: the measured six, and what the log before it tells of the others.
    """
    ahead, after = HORIZONS[-1], np.array(HORIZONS)
    places = [(k, row) for k, state in enumerate(states) for row in range(0, len(state) - ahead, _STRIDE)]
    begun = np.array([states[k][row] for k, row in places])
    lanes = np.array([acting[k][row : row + ahead + 1] for k, row in places])
    ends = np.array([states[k][row + after, : len(STATES)] for k, row in places])
    return _predicted(ship, begun, lanes, dt)[:, after] - ends


def _predicted(ship: Ship, begun: Array, lanes: Array, dt: float) -> Array:
    """States from each start under the inputs of its lane, shape (lanes, steps, 6); not finite where one blows up."""
    system, each = open_loop(ship), substeps(ship, dt)
    run = simulator(system).run(
        begun, between(lanes, each), open_loop_parameters(ship), dt=dt / each, every=each,
        steps=(lanes.shape[1] - 1) * each + 1,
        memory0=open_loop_memory(ship, begun, lanes[:, 0, : len(ship.model.controls)]),
    )  # fmt: skip
    return run.values[:, :, : len(STATES)]


def _rms(errors: Array) -> list[float]:
    """Root mean square of each column; infinite where a prediction blew up."""
    with np.errstate(over="ignore", invalid="ignore"):
        found = np.sqrt((errors**2).mean(axis=0))
    return [float(value) if math.isfinite(value) else math.inf for value in found]
