"""Forecasts of the trials kept back, from what a filter knew when each began, beside those of simpler ideas.

For studies of logs without velocities, whose trials come of a smoother: a prediction that restarts from smoothed
states has looked ahead, and along a model besides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..core.parameters import read
from ..data import DataError, Trial
from ..data.check.track import own_samples
from ..engine import SimulationError
from ..identify import StudyError
from ..identify.filters.forecast import forecasts
from ..models.nomoto import Nomoto
from ..ships import Ship
from ..study.data import kalman
from ..study.study import Study, readings
from .comparison import CONSTANT_VELOCITY

HORIZONS = (10.0, 30.0)
"""Lengths of the forecasts [s]."""
_EVERY = 5.0
# Until the filter has settled [s].
_SETTLED = 20.0
FITTED, UNTUNED = "fitted", "untuned"


@dataclass(frozen=True)
class Foresight:
    """Root mean square errors of the forecasts of one trial over one horizon.

    Attributes:
        horizon: length [s].
        count: how many forecasts.
        position, heading: over the horizon, against raw fixes [m] and compass [rad].
        end: distance at the last fix [m].
    """

    trial: str
    label: str
    horizon: float
    count: int
    position: float
    heading: float
    end: float


def foreseen(study: Study, fitted: Ship) -> tuple[tuple[Foresight, ...], tuple[str, ...]]:
    """Forecasts by the fitted ship, by the ship that the fit began from, and at constant velocity.

    Each has the filter of [data.smoother]; disturbances begin as the ship file has them, as on a day not seen.

    Returns:
        The errors, and a line for what could not be forecast; both empty where no set has a smoother.
    """
    found: list[Foresight] = []
    notes: list[str] = []
    for said, trial in readings(study):
        for label, (table, ship) in _who(said, study.problem.ship, fitted).items():
            try:
                found += _of_trial(label, table, ship, trial)
            except (DataError, StudyError, SimulationError) as error:
                notes.append(f"no forecasts of {trial.name}, {label}: {error}")
    return tuple(found), tuple(notes)


def _who(said: Any, start: Ship, fitted: Ship) -> Mapping[str, tuple[Any, Ship]]:
    """Filter table and ship by label."""
    fresh = {path: float(read(start.model, path)) for path in said.parameters}
    still = replace(start, model=Nomoto(K=1e-9, T=1e6, U=max(start.speed, 1e-2)), notes={}, n_P=None)
    walk = {name: sd for name, sd in said.process.items() if name in ("u", "v_m", "r")}
    bare = said.model_copy(update={"current": 0.0, "parameters": {}, "process": walk})
    return {
        FITTED: (said, fitted.having(fresh)),
        UNTUNED: (said, start),
        CONSTANT_VELOCITY: (bare, still),
    }


def _of_trial(label: str, said: Any, ship: Ship, trial: Trial) -> list[Foresight]:
    if label == CONSTANT_VELOCITY:
        trial = trial.having(n_P=np.zeros(len(trial)), delta=np.zeros(len(trial)))
    run = kalman(said, ship).run(ship, own_samples(trial))
    rows: list[Foresight] = []
    for horizon in HORIZONS:
        if rows and trial.duration < _SETTLED + horizon:
            break  # the shorter ones fit
        errors = forecasts(run, horizon, every=_EVERY, begin=_SETTLED)
        rows.append(Foresight(trial.name, label, horizon, len(errors.starts), *errors.rms()))
    return rows
