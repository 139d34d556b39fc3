"""Forecasts from a filter that has seen only the seconds before, with their uncertainty, beside two trivial ones.

At each start a filter begins anew, follows the log for `warm` seconds (motion, current, disturbances) and then gets no
more readings: its mean is the forecast, its covariance the band.  Controls are those of the log.  Beside it stand
staying put and constant velocity, the slopes of the last readings; all three know the same past.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...data import Array, DataError, Trial, unwrapped
from ...ships import Ship
from .filtered import Filtered
from .filtering import Kalman

MODEL, STAYING, CONSTANT = "model", "staying put", "constant velocity"
RIVALS = (STAYING, CONSTANT)
# Readings of the last second give the constant velocity.
_LAST = 1.0


@dataclass(frozen=True)
class Ahead:
    """Forecasts over one horizon, a row each.

    Attributes:
        horizon: length [s].
        trial, start: name of the trial, and when the forecast begins [s].
        position: distance of the forecast from the fix [m] by who forecasts, `MODEL` or one of `RIVALS`.
        heading: error of the heading [rad], signed, likewise.
        north, east: errors of the model's position [m], signed.
        sigma: standard deviations that the filter states of north, east [m] and heading [rad], readings' noise
            included, shape (forecasts, 3).
    """

    horizon: float
    trial: tuple[str, ...]
    start: Array
    position: dict[str, Array]
    heading: dict[str, Array]
    north: Array
    east: Array
    sigma: Array

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

        z = np.abs(np.column_stack([self.north, self.east, self.heading[MODEL]])) / (widen * self.sigma)
        inside = z <= float(ndtri(0.5 + 0.5 * share))
        return float(inside[:, :2].mean()), float(inside[:, 2].mean())

    def of(self, pattern: str) -> Ahead:
        """Those of the trials whose names begin with `pattern`."""
        return self._where(np.array([name.startswith(pattern) for name in self.trial], dtype=np.bool_))

    def _where(self, kept: NDArray[np.bool_]) -> Ahead:
        return Ahead(
            self.horizon, tuple(n for n, k in zip(self.trial, kept, strict=True) if k), self.start[kept],
            {who: e[kept] for who, e in self.position.items()}, {who: e[kept] for who, e in self.heading.items()},
            self.north[kept], self.east[kept], self.sigma[kept],
        )  # fmt: skip


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def joined(some: Sequence[Ahead]) -> Ahead:
    """Forecasts of several folds or trials over the same horizon, one after the other."""
    return Ahead(
        some[0].horizon, tuple(n for one in some for n in one.trial), np.concatenate([one.start for one in some]),
        {who: np.concatenate([one.position[who] for one in some]) for who in some[0].position},
        {who: np.concatenate([one.heading[who] for one in some]) for who in some[0].heading},
        np.concatenate([one.north for one in some]), np.concatenate([one.east for one in some]),
        np.concatenate([one.sigma for one in some]),
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
    tracker, rows = settings.prepared(ship), list[tuple[str, float, Array]]()
    for trial in trials:
        for start in np.arange(trial.t[0] + warm, trial.t[-1] - max(horizons), every):
            first, k = (int(np.searchsorted(trial.t, at - 1e-6)) for at in (start - warm, start))
            last = int(np.searchsorted(trial.t, start + max(horizons) + 1e-6, "right"))
            part = trial.rows(slice(first, last))
            read, begun = _read(part), k - first
            held = [begun, *(_row(part, start, horizon) for horizon in horizons)]
            if np.isfinite(read[held]).all():
                found = tracker.run(_blind(part, begun))
                rows.append((trial.name, float(start), _errors(part, read, found, begun, held[1:], settings)))
    if not rows:
        raise DataError(f"no trial leaves room for {warm:g} s of readings and {max(horizons):g} s of forecast")
    names, starts, errors = zip(*rows, strict=True)
    table = np.array(errors)
    return tuple(_over(h, names, np.array(starts), table[:, i]) for i, h in enumerate(horizons))


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


def _over(horizon: float, names: tuple[str, ...], starts: Array, errors: Array) -> Ahead:
    who = (MODEL, *RIVALS)
    return Ahead(
        horizon, names, starts, {w: np.hypot(errors[:, j, 0], errors[:, j, 1]) for j, w in enumerate(who)},
        {w: errors[:, j, 2] for j, w in enumerate(who)}, errors[:, 0, 0], errors[:, 0, 1], np.sqrt(errors[:, 3]),
    )  # fmt: skip
