"""Forecasts from a filter that has seen only the seconds before, with their uncertainty, beside two trivial ones.

At each start a filter begins anew, follows the log for `warm` seconds (motion, current, disturbances) and then gets no
more readings: its mean is the forecast, its covariance the band.  Controls are those of the log.  Beside it stand
staying put and constant velocity, the slopes of the last readings; all three know the same past.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass
from ...data import Array, DataError, Trial, unwrapped
from ...ships import Ship
from . import CONSTANT_VELOCITY, MODEL, STAYING
from .filtered import Filtered
from .filtering import Kalman

RIVALS = (STAYING, CONSTANT_VELOCITY)
"""What a forecast must beat: staying where it is, and going on as before."""
# Readings of the last second give the constant velocity.
_LAST = 1.0
# Readings of so many seconds before the start [s] tell how well the model explains what goes on.
_RECENT = 10.0


@dataclass(frozen=True)
class Ahead:
    """Forecasts over one horizon, a row each.

    Attributes:
        horizon: length [s].
        trial, start: name of the trial, and when the forecast begins [s].
        errors: forecast less reading of north, east [m] and heading [rad] by who forecasts, `MODEL` or one of
            `RIVALS`, each shape (forecasts, 3).
        sigma: standard deviations that the filter states of the model's three, readings' noise included, same shape.
        state: motion at the start as the filter believes it: x, y, psi, u, v_m, r, shape (forecasts, 6).
        surprise: normalised innovation squared per reading in the last seconds before the start; 1 is as stated.
    """

    horizon: float
    trial: tuple[str, ...]
    start: Array
    errors: dict[str, Array]
    sigma: Array
    state: Array
    surprise: Array

    @property
    def position(self) -> dict[str, Array]:
        """Distance of each forecast from the fix [m], by who forecasts."""
        return {who: np.hypot(e[:, 0], e[:, 1]) for who, e in self.errors.items()}

    @property
    def heading(self) -> dict[str, Array]:
        """Error of the heading [rad], signed, by who forecasts."""
        return {who: e[:, 2] for who, e in self.errors.items()}

    @property
    def north(self) -> Array:
        """Error of the model's north [m], signed."""
        return self.errors[MODEL][:, 0]

    @property
    def east(self) -> Array:
        """Error of the model's east [m], signed."""
        return self.errors[MODEL][:, 1]

    def rms(self, who: str = MODEL) -> tuple[float, float]:
        """Root mean square error of position [m] and heading [rad]."""
        return _rms(self.position[who]), _rms(self.heading[who])

    def ratio(self) -> tuple[float, float]:
        """Error of position and of heading over that of the better of the rivals."""
        best = [min(self.rms(who)[k] for who in RIVALS) for k in (0, 1)]
        return self.rms()[0] / best[0], self.rms()[1] / best[1]

    def covered(self, share: float = 0.9, widen: float = 1.0) -> tuple[float, float]:
        """Share of the fixes and headings within their bands: of north and east, and of the heading.

        Args:
            share: what the bands state.
            widen: factor of the stated standard deviations.
        """
        from scipy.special import ndtri

        z = np.abs(self.errors[MODEL]) / (widen * self.sigma)
        inside = z <= float(ndtri(0.5 + 0.5 * share))
        return float(inside[:, :2].mean()), float(inside[:, 2].mean())

    def of(self, pattern: str) -> Ahead:
        """Those of the trials whose names begin with `pattern`."""
        return self._where(np.array([name.startswith(pattern) for name in self.trial], dtype=np.bool_))

    def _where(self, kept: NDArray[np.bool_]) -> Ahead:
        return Ahead(
            self.horizon, tuple(n for n, k in zip(self.trial, kept, strict=True) if k), self.start[kept],
            {who: e[kept] for who, e in self.errors.items()}, self.sigma[kept], self.state[kept], self.surprise[kept],
        )  # fmt: skip


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def joined(some: Sequence[Ahead]) -> Ahead:
    """Forecasts of several folds or trials over the same horizon, one after the other."""
    return Ahead(
        some[0].horizon, tuple(n for one in some for n in one.trial), np.concatenate([one.start for one in some]),
        {who: np.concatenate([one.errors[who] for one in some]) for who in some[0].errors},
        np.concatenate([one.sigma for one in some]), np.concatenate([one.state for one in some]),
        np.concatenate([one.surprise for one in some]),
    )  # fmt: skip


def looked_ahead(
    settings: Kalman, ship: Ship, trials: Iterable[Trial], horizons: Sequence[float], *, warm: float, every: float
) -> tuple[Ahead, ...]:
    """Forecast each trial from every `every` seconds on, over each horizon.

    Args:
        settings: the filter; its sensors read x, y [m] and psi [rad] of midship.
        trials: on even steps, no longer gaps than a few rows at the starts.
        horizons: lengths [s]; only starts that leave room for the longest count.
        warm: seconds before each start that the filter sees.
        every: time between starts [s].

    Raises:
        DataError: no trial is long enough.
        FitError: a filter leaves the finite.
    """
    tracker, rows = settings.prepared(ship), list[tuple[str, float, Array, Array, float]]()
    for trial in trials:
        for start in np.arange(trial.t[0] + warm, trial.t[-1] - max(horizons), every):
            first, k = (int(np.searchsorted(trial.t, at - 1e-6)) for at in (start - warm, start))
            last = int(np.searchsorted(trial.t, start + max(horizons) + 1e-6, "right"))
            part = trial.rows(slice(first, last))
            read, begun = _read(part), k - first
            held = [begun, *(_row(part, start, horizon) for horizon in horizons)]
            if np.isfinite(read[held]).all():
                found = tracker.run(_blind(part, begun))
                errors = _errors(part, read, found, begun, held[1:], settings)
                rows.append((trial.name, float(start), errors, found.states[begun, :6], _surprise(found, start)))
    if not rows:
        raise DataError(f"no trial leaves room for {warm:g} s of readings and {max(horizons):g} s of forecast")
    names, starts, tables, states, surprises = zip(*rows, strict=True)
    table, who = np.array(tables), (MODEL, *RIVALS)
    return tuple(
        Ahead(
            h, names, np.array(starts), {w: table[:, i, j] for j, w in enumerate(who)}, np.sqrt(table[:, i, 3]),
            np.array(states), np.array(surprises),
        )
        for i, h in enumerate(horizons)
    )  # fmt: skip


def _surprise(found: Filtered, start: float) -> float:
    """NIS per reading over the last `_RECENT` seconds before the start."""
    recent = (found.innovation_t > start - _RECENT) & (found.innovation_t <= start + 1e-6)
    return float(found.nis[recent].sum()) / max(1, int(np.isfinite(found.innovations[recent]).sum()))


def _row(part: Trial, start: float, horizon: float) -> int:
    return int(np.argmin(np.abs(part.t - start - horizon)))


def _read(part: Trial) -> Array:
    return np.column_stack([part["x"], part["y"], unwrapped(part["psi"])])


def _blind(part: Trial, k: int) -> Trial:
    """The log without the readings after row k."""
    later = np.arange(len(part)) > k
    x, y, psi = (np.where(later, np.nan, part[name]) for name in ("x", "y", "psi"))
    return part.having(x=x, y=y, psi=psi)


def _errors(part: Trial, read: Array, found: Filtered, k: int, ends: Sequence[int], settings: Kalman) -> Array:
    """Errors of model, staying put and constant velocity at rows `ends`, and variances, shape (horizons, 4, 3)."""
    states, covs = found.states[:, :3], found.covariances
    last = slice(int(np.searchsorted(part.t, part.t[k] - _LAST - 1e-6)), k + 1)
    good = np.isfinite(read[last]).all(axis=1)
    slope = np.polyfit(part.t[last][good] - part.t[k], read[last][good], 1)[0]
    noise = np.array([sensor.sd for sensor in settings.measurement.values() for _ in sensor.channels])
    out = np.empty((len(ends), 4, 3))
    for i, row in enumerate(ends):
        truth = read[row]
        for j, forecast in enumerate((states[row], read[k], read[k] + slope * (part.t[row] - part.t[k]))):
            out[i, j] = forecast - truth
        out[i, :3, 2] = (out[i, :3, 2] + math.pi) % (2.0 * math.pi) - math.pi
        out[i, 3] = np.diagonal(covs[row])[:3] + noise**2
    return out
