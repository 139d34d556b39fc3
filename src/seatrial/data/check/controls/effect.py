"""Effect of the rudder on the yaw at every delay: whether a rudder that seems turned round is late instead.

Going ahead, dr/dt = a (u/U) r + b (u/U)^2 delta(t - lag) + c of a trial, after Nomoto's equation of first order, over
windows of some ship times.  A zigzag whose rudder is half a period late looks like one of the other sign; turns,
zigzags of other periods and the beginning of a log do not, so all trials of a ship are taken together.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ....core.constants import GRAVITY
from ....core.values import dataclass
from ... import Array, Trial
from ...prepare import integral, segments
from ..relations import length_of, window_of

Rows = NDArray[np.intp]

# Greatest delay and its step in ship times, and the greatest one as a part of a trial.
_FARTHEST, _STEP, _PART = 12.0, 0.5, 0.25
# A delay is gross from so many ship times on.
_GROSS = 1.6
OWN = 1.0
"""What ships respond later than by the equation of first order, in ship times."""
# What is better explains so much more than the other sign, and than no delay; with a likelihood so much larger (ln).
_OTHER, _AT_ONCE, _SURE = 1.3, 1.15, 4.0
_MOST = 2000


@dataclass(frozen=True)
class Effect:
    """What is left over of the changes of r, as a part of them, at each delay.

    Attributes:
        lags: by which the yaw follows the rudder that was logged [s]; below zero the log is late.
        left: shape of `lags`; a ten-millionth of a percent at least, what rounding leaves of an exact log.
        gain: of the rudder, b; above zero to starboard.
        windows: how many, each overlapping its neighbours by three quarters.
    """

    lags: Array
    left: Array
    gain: Array
    windows: int

    @property
    def late(self) -> float:
        """Seconds by which the rudder was logged too late; 0 where no delay explains the yaw so much better."""
        k, now = self._least(1.0), self.lags.size // 2
        other, own = self._of(self._least(-1.0), -1.0), self._of(k, 1.0)
        clear = self._better(own, other, _OTHER) and self._better(own, float(self.left[now]), _AT_ONCE)
        found = clear and self._ship_times(k) > _GROSS and 0 < k < self.lags.size - 1
        return -float(self.lags[k]) - OWN / _STEP * float(self.lags[1] - self.lags[0]) if found else 0.0

    @property
    def opposed(self) -> bool:
        """Whether a rudder of the other sign explains the yaw, nearly at once, and no delay does nearly as well."""
        k = self._least(-1.0)
        near = self._ship_times(k) <= 2.0 * _GROSS
        return near and self._better(self._of(k, -1.0), self._of(self._least(1.0), 1.0), _OTHER)

    def _least(self, sign: float) -> int:
        return int(np.argmin(np.where(self.gain * sign > 0, self.left, np.inf)))

    def _of(self, k: int, sign: float) -> float:
        return float(self.left[k]) if self.gain[k] * sign > 0 else 1.0

    def _ship_times(self, k: int) -> float:
        return _STEP * abs(k - self.lags.size // 2)

    def _better(self, left: float, other: float, more: float) -> bool:
        """Whether one explains more by a factor, or leaves half, and is likelier; of four windows one is new."""
        sure = self.windows / 8.0 * math.log(other / left) > _SURE
        return sure and (1.0 - left > more * (1.0 - other) or left < 0.5 * other)


def effect(trials: Sequence[Trial]) -> Effect | None:
    """The effect of `delta` that the trials of one ship show together; None where too little moves."""
    if not trials:
        return None
    ship_time = float(np.median([math.sqrt((length_of(trial) or 100.0) / GRAVITY) for trial in trials]))
    most = min(_FARTHEST * ship_time, _PART * float(np.median([trial.duration for trial in trials])))
    count = max(math.ceil(most / (_STEP * ship_time)), 4)
    lags = _STEP * ship_time * np.arange(-count, count + 1.0)
    sums = np.zeros((lags.size, 6))
    windows = 0
    for trial in trials:
        for gain, turned, steered in _windowed(trial, lags):
            windows += gain.size
            parts = (turned * turned, turned * steered, steered * steered, turned * gain, steered * gain, gain * gain)
            sums += np.column_stack([np.broadcast_to(part.sum(axis=-1), lags.shape) for part in parts])
    rr, rd, dd, rg, dg, gg = sums.T
    free = rr * dd - rd**2
    if windows < 12 or not (free > 1e-9 * rr * dd).all() or not (gg > 0).all():
        return None
    a, b = (rg * dd - dg * rd) / free, (dg * rr - rg * rd) / free
    return Effect(lags, np.maximum((gg - a * rg - b * dg) / gg, 1e-9), b, windows)


def ahead(trial: Trial) -> NDArray[np.bool_]:
    """Rows in which the ship goes ahead, with the propeller ahead."""
    u = trial["u"]
    going = u > 0.3 * float(np.nanmax(np.abs(u), initial=0.0))
    return np.asarray(going & ~(trial["n_P"] <= 0) if "n_P" in trial else going)


def _windowed(trial: Trial, lags: Array) -> list[tuple[Array, Array, Array]]:
    """Changes of r, its integral and that of the rudder at each delay, about the means of a run ahead."""
    known = np.isfinite(trial["delta"])
    if known.sum() < 20:
        return []
    usual = float(np.nanmedian(np.abs(trial["u"]))) or 1.0
    marked = trial.having(ahead_=np.where(ahead(trial), 1.0, np.nan))
    marked = marked.rows(slice(None, None, max(len(trial) // _MOST, 1)))
    found = []
    for run in segments(marked, ("u", "r", "ahead_")):
        if len(run) < 20:
            continue
        a, b = windows(run, 0.5 * window_of(trial))
        t, way = run.t, run["u"] / usual
        rudder = np.interp(t[None, :] - lags[:, None], trial.t[known], trial["delta"][known])
        turned = integral(t, way * run["r"])
        steered = np.array([integral(t, way**2 * one) for one in rudder])
        parts = run["r"][b] - run["r"][a], turned[b] - turned[a], steered[:, b] - steered[:, a]
        gain, turned, steered = (part - part.mean(axis=-1, keepdims=True) for part in parts)
        found.append((gain, turned, steered))
    return found


def windows(run: Trial, length: float) -> tuple[Rows, Rows]:
    """First and last rows of overlapping windows of about `length` [s], at most a third of the run."""
    count = len(run)
    width = min(max(round(length / run.dt), 4), count // 3)
    first: Rows = np.arange(0, count - width, max(width // 4, 1), dtype=np.intp)
    return first, first + width
