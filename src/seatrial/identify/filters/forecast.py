"""Forecast errors of a model on an unseen log: predictions from the filter's state at their start.

A replay that restarts from smoothed states has looked ahead. Here the filter runs once through the log, with
disturbances (a current, a walking parameter) as its states; each forecast begins at what it believed at that
row, holds the disturbances, takes the controls as logged, and is held against raw positions and headings.
In a closed loop the later controls respond to the measured motion, so they contain a little of it.
"""

from __future__ import annotations

import math

import numpy as np

from ...core.values import dataclass
from ...data import Array, DataError
from ...simulate.replay import replay
from .. import StudyError
from .filtered import Filtered


@dataclass(frozen=True)
class Forecasts:
    """Errors of forecasts over one horizon, a row each.

    Attributes:
        horizon: length [s].
        starts: time of each [s], shape (forecasts,).
        position, heading: root mean square over the horizon [m], [rad], same shape.
        end: distance at its last position [m], same shape.
    """

    horizon: float
    starts: Array
    position: Array
    heading: Array
    end: Array

    def rms(self) -> tuple[float, float, float]:
        """Over all of them: position [m], heading [rad], position at the end [m]."""
        return _rms(self.position), _rms(self.heading), _rms(self.end)


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def forecasts(found: Filtered, horizon: float, *, every: float, begin: float = 0.0) -> Forecasts:
    """Forecast from every `every` seconds on.

    Args:
        found: a filter's run through the log; its `source` has readings of x, y [m] and psi [rad], NaN between.
        horizon: length of a forecast [s].
        every: time between starts [s].
        begin: when the first one starts, after the first row [s]; give the filter time to settle.

    Raises:
        StudyError: a smoothed run, which has looked ahead.
        DataError: the log is shorter than one forecast.
        SimulationError: a forecast blows up; names time and state.
    """
    if found.smooth:
        raise StudyError(f"{found.source.name}: a smoothed run knows what comes; forecast from the filtered one")
    t = found.t
    starts = np.arange(t[0] + begin, t[-1] - horizon, every)
    if not starts.size:
        raise DataError(
            f"{found.source.name}: lasts {t[-1] - t[0]:g} s; a forecast of {horizon:g} s after {begin:g} s does not fit"
        )
    position, heading, end = np.array([_one(found, int(np.searchsorted(t, s)), horizon) for s in starts]).T
    return Forecasts(horizon, starts, position, heading, end)


def _one(found: Filtered, k: int, horizon: float) -> tuple[float, float, float]:
    """Errors of the forecast that begins at row k: position, heading, position at the end."""
    last = int(np.searchsorted(found.t, found.t[k] + horizon, "right"))
    window = found.trial().rows(slice(k, last))
    if "U_C" in window:
        still = np.ones(len(window))
        window = window.having(U_C=window["U_C"][0] * still, gamma_C=window["gamma_C"][0] * still)
    known = {f.path: float(found.states[k, found.names.index(f.path)]) for f in found.free}
    predicted = replay(found.ship.having(known), window)
    truth = found.source.rows(slice(k, last))
    away = np.hypot(predicted["x"] - truth["x"], predicted["y"] - truth["y"])[1:]
    off = (predicted["psi"] - truth["psi"] + math.pi)[1:] % (2.0 * math.pi) - math.pi
    away, off = away[np.isfinite(away)], off[np.isfinite(off)]
    if not (away.size and off.size):
        raise DataError(
            f"{truth.name}: no position or no heading between {truth.t[0]:g} and {truth.t[-1]:g} s; a forecast is held "
            "against both"
        )
    return _rms(away), _rms(off), float(away[-1])
