"""What a filter believes before its first update, and which readings it gets when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..data import Array, DataError, Trial, unwrapped
from ..data.prepare import to_body
from ..environment import CALM
from ..ships import Ship
from .filter_model import CURRENT, FilterModel
from .measurement import Antenna, Heading, Rate, Sensor

# The first speed and rate of turn are slopes over this many L/U, and over so many readings at least.
_STRETCH, _FIRST = 0.2, 5
# The first readings set the mean and are used again as readings, so they count little as the former.
_WIDE = 10.0

Gauss = dict[str, tuple[float, float]]


@dataclass(frozen=True)
class Timeline:
    """The instants at which a filter stops: every row of the trial, and when each reading was true.

    Attributes:
        t: times [s], shape (events,).
        row: the row of the trial whose inputs act from there on, shape (events,).
        readings: shape (events, channels); NaN where there is none.
        events: the event of each row of the trial, shape (rows,).
    """

    t: Array
    row: NDArray[np.intp]
    readings: Array
    events: NDArray[np.intp]


def timeline(trial: Trial, model: FilterModel) -> Timeline:
    """Rows and readings in the order in which they were true; readings from before the first row are left out.

    Raises:
        DataError: a channel is missing or holds no reading, or time does not rise.
    """
    if len(trial) < 2 or not (np.diff(trial.t) > 0.0).all():
        raise DataError(f"{trial.name}: a filter needs two rows at least, and a time that rises from row to row")
    near = 1e-6 * trial.dt
    true = [trial.t - delay for delay in model.delay]
    good = [np.isfinite(trial[name]) & (at >= trial.t[0] - near) for name, at in zip(model.channels, true, strict=True)]
    for name, some in zip(model.channels, good, strict=True):
        if not some.any():
            raise DataError(f"{trial.name}: channel {name} holds no reading from t = {trial.t[0]:g} s on")
    found = np.sort(np.concatenate([trial.t, *(at[some] for at, some in zip(true, good, strict=True))]))
    t = found[np.concatenate([[True], np.diff(found) > near])]
    readings = np.full((t.size, len(model.channels)), np.nan)
    for k, (name, at, some) in enumerate(zip(model.channels, true, good, strict=True)):
        readings[np.searchsorted(t, at[some] + near, "right") - 1, k] = trial[name][some]
    row = np.clip(np.searchsorted(trial.t, t + near, "right") - 1, 0, len(trial) - 1)
    return Timeline(t, row, readings, np.searchsorted(t, trial.t + near, "right") - 1)


def begin(
    ship: Ship, trial: Trial, sensors: Sequence[Sensor], names: Sequence[str], given: Mapping[str, tuple[float, float]]
) -> tuple[Array, Array]:
    """Mean and standard deviation of each state at the first row, each shape (names,).

    Args:
        given: what is known beforehand by name; the rest is read off the first readings, widely.

    Raises:
        DataError: the heading is neither given nor read.
    """
    guess: Gauss = {name: (0.0, 0.0) for name in names if name != "psi"}
    guess |= {name: (0.0, 0.2 * ship.speed) for name in CURRENT if name in names}
    guess |= {"x": (0.0, ship.L_pp), "y": (0.0, ship.L_pp), "u": (ship.speed, ship.speed), "v_m": (0.0, ship.speed)}
    guess |= _turning(ship, trial, sensors) | {name: pair for name, pair in given.items() if name in ("psi", "r")}
    if "psi" not in guess:
        raise DataError(f"{trial.name}: no sensor reads the heading; give it in `start` as psi = (value, sd)")
    guess |= _moving(ship, trial, sensors, guess["psi"][0]) | dict(given)
    return np.array([guess[name][0] for name in names]), np.array([guess[name][1] for name in names])


def _turning(ship: Ship, trial: Trial, sensors: Sequence[Sensor]) -> Gauss:
    """Heading and rate of turn from the first readings."""
    quick = ship.speed / ship.L_pp
    found: Gauss = {"r": (0.0, quick)}
    for sensor in sensors:
        if isinstance(sensor, Heading):
            t, psi, late = _first(ship, trial, sensor)
            rate, rough = _slope(t, psi[:, 0], sensor.sd)
            found["psi"] = (psi[0, 0] - rate * late, _WIDE * sensor.sd + quick * abs(late))
            found["r"] = (rate, 0.5 * quick + 3.0 * rough)
    for sensor in sensors:
        if isinstance(sensor, Rate):
            found["r"] = (_first(ship, trial, sensor)[1][0, 0], 0.5 * quick + _WIDE * sensor.sd)
    return found


def _moving(ship: Ship, trial: Trial, sensors: Sequence[Sensor], psi: float) -> Gauss:
    """Position and velocity over ground from the first fixes."""
    for sensor in sensors:
        if isinstance(sensor, Antenna):
            t, fixes, late = _first(ship, trial, sensor)
            (north, rough), (east, _) = (_slope(t, fixes[:, k], sensor.sd) for k in (0, 1))
            arm = sensor.read((0.0, 0.0, psi, 0.0, 0.0, 0.0), CALM)
            u, v_m = to_body(np.array([north]), np.array([east]), np.array([psi]))
            wide, unsure = _WIDE * sensor.sd + ship.speed * abs(late), 0.25 * ship.speed + 3.0 * rough
            return {
                "x": (fixes[0, 0] - arm[0] - north * late, wide), "y": (fixes[0, 1] - arm[1] - east * late, wide),
                "u": (float(u[0]), unsure), "v_m": (float(v_m[0]), unsure),
            }  # fmt: skip
    return {}


def _first(ship: Ship, trial: Trial, sensor: Sensor) -> tuple[Array, Array, float]:
    """Times and values of the first complete readings, and when the first was true [s after the first row]."""
    values = trial.stack(*sensor.channels)
    if sensor.angle:
        values = np.column_stack([unwrapped(column) for column in values.T])
    rows = np.flatnonzero(np.isfinite(values).all(axis=1))
    if rows.size == 0:
        raise DataError(f"{trial.name}: no row holds a reading of {', '.join(sensor.channels)}")
    near = int(np.searchsorted(trial.t[rows], trial.t[rows[0]] + _STRETCH * ship.L_pp / ship.speed))
    rows = rows[: max(near, _FIRST)]
    return trial.t[rows], values[rows], float(trial.t[rows[0]] - sensor.delay - trial.t[0])


def _slope(t: Array, values: Array, sd: float) -> tuple[float, float]:
    """Rate of the first readings by least squares, and its standard deviation."""
    away = t - t.mean()
    weight = float(away @ away)
    return (float(away @ values) / weight, sd / float(np.sqrt(weight))) if weight > 0.0 else (0.0, 0.0)
