"""Start of a prediction estimated on the first seconds of a trial: initial state, constant current, sensor biases.

The model's parameters are held.  All that is estimated has a prior of ordinary size but the initial state, of which
nothing is known before; the readings weigh by the noise of their sensors, as in a fit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..data import Array, DataError, Trial
from ..identify import Loss, Nuisance, Problem
from ..identify.noise import noise, screened
from ..identify.nuisance import begun_as
from ..identify.trajectory.objective import TrajectoryObjective
from ..models import STATES
from ..ships import Ship
from ..simulate.replay import replay
from .corrected import corrected

# Standard deviations: of each component of the current over sqrt(g L_pp), which is 1 m/s for a ship of 255 m; of the
# bias of the heading [rad]; of those of the speeds over the ship's speed U, and of the rate over U / L_pp.
_CURRENT, _HEADING, _SPEED, _RATE = 0.02, 0.05, 0.05, 0.05
_GRAVITY = 9.81
# Fewest rows that are fitted, and that are predicted after them.
_FEWEST, _REST = 10, 2


@dataclass(frozen=True)
class Beginning:
    """What the first seconds of a trial say about the rest.

    Attributes:
        trial: with the biases taken from its readings, in the current.
        t: time of the first row after them, where predictions start [s].
        state: x, y, psi, u, v_m, r there, by the model, shape (6,).
        found, sigma: current and biases with standard deviations, by name as in `identify.suspects`, SI units.
        size: root mean square residual of the first seconds over the sensors' noise; 1 where the model explains them.
    """

    trial: Trial
    t: float
    state: Array
    found: Mapping[str, float]
    sigma: Mapping[str, float]
    size: float


def fit_first(ship: Ship, trial: Trial, span: float, *, current: bool = True) -> Beginning:
    """Estimate how a trial begins from its first `span` seconds.

    Args:
        ship: a model in continuous time, whose parameters are held.
        trial: the trial, corrected by what is known of its instruments.
        span: from the first complete row on [s].
        current: whether a current is estimated, on top of a logged one.

    Raises:
        DataError: fewer than ten complete rows within `span`, or fewer than two after it.
    """
    level = noise([trial])
    (clean,) = screened([trial], level).trials
    whole = np.isfinite(clean.stack(*STATES)).all(axis=1) if all(name in clean for name in STATES) else np.zeros(1)
    good = np.flatnonzero(whole)
    begin = float(trial.t[good[0]]) if good.size else 0.0
    before = trial.t[good] < begin + span * (1.0 - 1e-9)
    seen, rest = good[before], good[~before]
    if seen.size < _FEWEST:
        few = f"{seen.size} complete rows within {span:g} s"
        raise DataError(f"{trial.name}: {few}; {_FEWEST} are needed to fit them first")
    if rest.size < _REST:
        raise DataError(f"{trial.name}: lasts {trial.duration:g} s; the first {span:g} s leave nothing to predict")
    state, found, sigma, size = _estimated(ship, clean.rows(slice(int(seen[0]), int(rest[0]))), level, current)
    right = corrected(trial, found, ship.model)
    until = replay(ship, right.rows(slice(int(seen[0]), int(rest[0]) + 1)), begin=(begin, state))
    return Beginning(right, float(until.t[-1]), until.rows(slice(-1, None)).stack(*STATES)[0], found, sigma, size)


def _estimated(
    ship: Ship, part: Trial, level: Mapping[str, float], current: bool
) -> tuple[Array, dict[str, float], dict[str, float], float]:
    """Initial state, current and biases with their deviations, and the size of the residuals over the noise."""
    speed = ship.speed
    bias = {"psi": _HEADING, "u": _SPEED * speed, "v_m": _SPEED * speed, "r": _RATE * speed / ship.L_pp}
    nuisance = Nuisance(
        current=_CURRENT * math.sqrt(_GRAVITY * ship.L_pp) if current else 0.0,
        bias={name: sd for name, sd in bias.items() if name in level and sd > 0},
    )  # fmt: skip
    problem = begun_as(Problem(ship, (part,), (), Loss(level, 0.0), nuisance), "free")
    objective = TrajectoryObjective.build(
        problem, (part,), level, window=part.duration, dt=part.dt, every=1, method="rk4", threads=None,
    )  # fmt: skip
    p = np.zeros(0)
    eta = objective.begun(p)
    own, count = objective.layout.own, objective.layout.own.count
    names = [_named(name) for name in own.names]
    values = objective.layout.of_trials(eta)[0]
    spread = np.sqrt(np.diag(np.linalg.inv(objective.normal(p, eta).blocks[0].own)))
    e = objective.residuals(p, eta)
    size = float(np.sqrt((e**2).sum() / max(objective.windows.entries - eta.size, 1)))
    state = objective.windows.state0[0, : len(STATES)] + objective.layout.starts(eta)[0]
    deviation = spread[spread.size - count :]
    return state, dict(zip(names, values.tolist(), strict=True)), dict(zip(names, deviation.tolist(), strict=True)), size


def _named(name: str) -> str:
    """The name in `identify.suspects` of a nuisance of a trial."""
    return {"current_x": "current.north", "current_y": "current.east"}.get(name, name.replace("bias_", "bias.", 1))
