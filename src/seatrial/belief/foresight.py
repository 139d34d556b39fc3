"""Forecasts of held-out trials from filtered states, by the fitted ship, the untuned ship and constant velocity.

For studies of logs without velocities, whose trials come from a smoother: a prediction that restarts from smoothed
states uses later data, and a model.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.parameters import read
from ..core.values import dataclass, replace
from ..data import DataError, Trial
from ..data.check.track import own_samples
from ..engine import SimulationError
from ..identify import StudyError
from ..identify.filters import CONSTANT_VELOCITY
from ..identify.filters.forecast import forecasts
from ..models.nomoto import Nomoto
from ..ships import Ship
from ..study.data import kalman
from ..study.study import Study, readings

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

    Each uses the filter of [data.smoother]; disturbances start as in the ship file, as on an unseen day.

    Returns:
        The errors, and a line for what could not be forecast; both empty where no set has a smoother.
    """
    found: list[Foresight] = []
    notes: list[str] = []
    for smoother, trial in readings(study):
        for label, table, ship in _rivals(smoother, study.problem.ship, fitted):
            try:
                found += _of_trial(label, table, ship, trial)
            except (DataError, StudyError, SimulationError) as error:
                notes.append(f"no forecasts of {trial.name}, {label}: {error}")
    return tuple(found), tuple(notes)


def _rivals(smoother: Any, start: Ship, fitted: Ship) -> tuple[tuple[str, Any, Ship], ...]:
    """Label, filter table and ship of each."""
    fresh = {path: float(read(start.model, path)) for path in smoother.parameters}
    still = replace(start, model=Nomoto(K=1e-9, T=1e6, U=max(start.speed, 1e-2)), notes={}, n_P=None)
    walk = {name: sd for name, sd in smoother.process.items() if name in ("u", "v_m", "r")}
    bare = replace(smoother, current=0.0, parameters={}, process=walk)
    return (FITTED, smoother, fitted.having(fresh)), (UNTUNED, smoother, start), (CONSTANT_VELOCITY, bare, still)


def _of_trial(label: str, smoother: Any, ship: Ship, trial: Trial) -> list[Foresight]:
    if label == CONSTANT_VELOCITY:
        trial = trial.having(n_P=np.zeros(len(trial)), delta=np.zeros(len(trial)))
    run = kalman(smoother, ship).run(ship, own_samples(trial))
    rows: list[Foresight] = []
    for horizon in HORIZONS:
        if rows and trial.duration < _SETTLED + horizon:
            break  # the shorter ones fit
        errors = forecasts(run, horizon, every=_EVERY, begin=_SETTLED)
        rows.append(Foresight(trial.name, label, horizon, len(errors.starts), *errors.rms()))
    return rows
