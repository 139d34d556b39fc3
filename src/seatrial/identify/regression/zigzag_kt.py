"""K and T of Nomoto's first-order model from a zigzag, or from any run with a moving rudder.

`classical` is Nomoto's analysis by hand: the equation T r' + r = K (delta + delta_r) integrated between two moments
reads T [r] + [psi] = K (integral of delta + delta_r t).  Between heading peaks r is zero at both ends, so T drops out
and K and delta_r follow from the areas under the rudder's record; from a peak to the next passage through the initial
heading, T follows from the yaw rate there (Nomoto 1960, Kempf's manoeuvre; Sawada 2024 section 4.1.1).  `fitted` is
least squares on every sample of the yaw rate under the recorded rudder, with K, T, delta_r and the initial yaw rate
free, started from the integrated equation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ...actuators import Actuators
from ...core.values import dataclass
from ...data import Array, DataError, Trial, unwrapped
from ...models.nomoto import Nomoto, to_prime
from ...ships import Entry, Ship
from ..posterior.misfit import correlated
from .regression import least_squares

# A peak or a passage is read off a cubic through this share of the half period about it.
_ABOUT = 0.12
_LEAST_ROWS = 8
# A heading swing below this share of the largest one is noise.
_SWING = 0.3


@dataclass(frozen=True)
class KT:
    """Nomoto's indices of a run.

    Attributes:
        K, T: gain [1/s] and time constant [s].
        delta_r: residual rudder [rad]: the ship answers to delta + delta_r.
        covariance: of (K, T, delta_r), shape (3, 3).
        speed: mean speed of the run [m/s].
        L_pp: length of the ship [m].
        residual: standard deviation of what is left: of the yaw rate [rad/s] (`fitted`), of the heading change of a
            half period [rad] (`classical`).
        way: "classical" or "fitted".
    """

    K: float
    T: float
    delta_r: float
    covariance: Array
    speed: float
    L_pp: float
    residual: float
    way: str

    @property
    def sigma(self) -> Array:
        """Standard deviations of K [1/s], T [s] and delta_r [rad]."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def prime(self) -> tuple[float, float]:
        """K' and T' (Sawada 2024 Eq. 7)."""
        return to_prime(self.K, self.T, self.L_pp, self.speed)

    def ship(self, name: str, actuators: Actuators | None = None) -> Ship:
        """A ship with these indices; its numbers say that they were fitted."""
        model: Any = Nomoto(K=self.K, T=self.T, U=self.speed, delta_r=self.delta_r)
        source = f"{self.way} analysis of a zigzag"
        numbers = {"K": self.K, "T": self.T, "delta_r": self.delta_r}
        entries = {
            key: Entry(source, value, sigma=float(s))
            for (key, value), s in zip(numbers.items(), self.sigma, strict=True)
        }
        entries |= {"U": Entry("mean speed of that run", self.speed), "alpha": Entry("none: a linear model", 0.0),
                    "n_1": Entry("none: a linear model", 1.0),
                    "approach.speed": Entry("mean speed of that run", self.speed)}  # fmt: skip
        return Ship(name, model, actuators or Actuators(), self.L_pp, self.speed, entries=entries)


def classical(trial: Trial, L_pp: float) -> KT:
    """Nomoto's analysis of a zigzag from its heading and rudder alone.

    Deviations come from how far the half periods disagree.

    Args:
        trial: needs psi and delta; from its start the ship has been on a straight course.
        L_pp: length of the ship [m].

    Raises:
        DataError: a channel is missing or has gaps, or there are fewer than four heading peaks.
    """
    t, psi, delta = _record(trial, ("psi", "delta"))
    area = _integral(t, delta)
    peaks = _peaks(t, psi)
    if len(peaks) < 4:
        raise DataError(
            f"{trial.name}: {len(peaks)} heading peaks; the analysis needs four: a longer zigzag, or the fitted way"
        )
    at, heading = np.array(peaks).T
    areas = np.interp(at, t, area)
    # [psi] = K [area] + K delta_r [t]: the yaw rate is zero at both ends.
    gain = least_squares(np.column_stack([np.diff(areas), np.diff(at)]), np.diff(heading))
    K, slope = (float(v) for v in gain.values)
    moments, passed, rates = np.array(_passages(t, psi, at)).T
    since = np.searchsorted(at, moments) - 1
    swing = np.column_stack([np.interp(moments, t, area) - areas[since], moments - at[since]])
    turned = K * swing[:, 0] + slope * swing[:, 1]
    lag = least_squares(rates[:, None], turned - (passed - heading[since]))  # T r = K (area + delta_r t) - [psi]
    # What moves with K and the bias: dT/d(K, slope) by the same equation.
    pull = np.linalg.lstsq(rates[:, None], swing, rcond=None)[0][0]
    J = np.array([[1.0, 0.0, 0.0], [*pull, 1.0], [-slope / K**2, 1.0 / K, 0.0]])
    basic = np.zeros((3, 3))
    basic[:2, :2], basic[2, 2] = gain.covariance, lag.covariance[0, 0]
    return KT(
        K, float(lag.values[0]), slope / K, J @ basic @ J.T, _speed(trial), L_pp, math.sqrt(gain.variance), "classical"
    )


def fitted(trial: Trial, L_pp: float, *, bias: bool = True) -> KT:
    """K, T and delta_r by least squares on the yaw rate.

    The deviations allow for errors that are alike from sample to sample, as those of a model are.

    Args:
        trial: needs r and delta.
        L_pp: length of the ship [m].
        bias: whether delta_r and the initial yaw rate are free; a step of the rudder alone cannot tell K from
            delta_r, so it is fitted without, from the measured initial yaw rate.

    Raises:
        DataError: a channel is missing or has gaps, the rudder hardly moves, or no K and T fit.
    """
    from scipy.optimize import least_squares as search

    t, r, delta = _record(trial, ("r", "delta"))
    start = _integrated(t, r, delta, bias)
    size = np.maximum(np.abs(start), [1e-9, 1e-9, 1e-9, float(np.std(r))])
    free = slice(None) if bias else slice(0, 2)

    def left(x: Array) -> Array:
        full = start / size
        full[free] = x
        return _answer(t, delta, *(full * size).tolist()) - r

    try:
        found: Any = search(left, (start / size)[free], method="lm", xtol=1e-12, ftol=1e-12)  # type: ignore[arg-type]
    except ValueError as error:
        raise DataError(f"{trial.name}: no K and T fit the yaw rate ({error})") from None
    residual, jacobian = np.asarray(found.fun), np.asarray(found.jac)
    variance = float(residual @ residual) / (residual.size - jacobian.shape[1])
    spread, scale = np.zeros((4, 4)), size[free]
    # Samples that count as one: while correlations are beyond their scatter, over a quarter of the run at most.
    _, alike = correlated([residual - float(residual.mean())], 2.0 / math.sqrt(residual.size), residual.size // 4)
    spread[free, free] = np.linalg.inv(jacobian.T @ jacobian) * np.outer(scale, scale) * variance * alike
    start[free] = found.x * scale
    gain, rate, slope, _ = start.tolist()
    if rate == 0.0 or gain == 0.0:
        raise DataError(f"{trial.name}: the yaw rate does not answer to the rudder")
    # K = gain / rate, T = 1 / rate, delta_r = slope / gain
    J = np.array([[1.0 / rate, -gain / rate**2, 0.0], [0.0, -1.0 / rate**2, 0.0], [-slope / gain**2, 0.0, 1.0 / gain]])
    covariance = J @ spread[:3, :3] @ J.T
    return KT(gain / rate, 1.0 / rate, slope / gain, covariance, _speed(trial), L_pp, math.sqrt(variance), "fitted")


def _record(trial: Trial, names: Sequence[str]) -> tuple[Array, Array, Array]:
    for name in names:
        if name not in trial:
            raise DataError(f"{trial.name}: no channel {name}; K and T need {' and '.join(names)}")
    good = np.asarray(np.isfinite(trial.stack(*names)).all(axis=1))
    rows = np.flatnonzero(good)
    if rows.size < 5 * _LEAST_ROWS or not good[rows[0] : rows[-1] + 1].all():
        raise DataError(f"{trial.name}: {' and '.join(names)} have gaps, or fewer than {5 * _LEAST_ROWS} samples")
    first = trial[names[0]][rows]
    return trial.t[rows], unwrapped(first) if names[0] == "psi" else first, trial[names[1]][rows]


def _speed(trial: Trial) -> float:
    if "u" not in trial:
        raise DataError(f"{trial.name}: no channel u; K' and T' need the speed")
    return float(np.nanmean(np.hypot(trial["u"], trial["v_m"]) if "v_m" in trial else trial["u"]))


def _integral(t: Array, x: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (x[1:] + x[:-1]))])


def _integrated(t: Array, r: Array, delta: Array, bias: bool) -> Array:
    """First guess from [r] = gain integral(delta) - rate [psi] + slope t, and the initial yaw rate."""
    columns = np.column_stack([_integral(t, delta), -_integral(t, r), t - t[0], np.ones(t.size)])
    found = np.zeros(4)
    free = slice(None) if bias else slice(0, 2)
    found[free] = least_squares(columns[:, free], r - r[0]).values
    found[3] += r[0]
    return found


def _answer(t: Array, delta: Array, gain: float, rate: float, slope: float, r_0: float) -> Array:
    """Yaw rate of r' = gain delta - rate r + slope, exact for a rudder that is linear between samples."""
    dt = np.diff(t)
    z = rate * dt
    small = np.abs(z) < 1e-6
    safe = np.where(small, 1.0, z)
    fade = np.exp(np.minimum(-z, 50.0))
    ends = np.where(small, 1.0 - 0.5 * z, (1.0 - fade) / safe)
    ramp = np.where(small, 0.5 - z / 6.0, (1.0 - (1.0 - fade) / safe) / safe)
    push = gain * delta + slope
    change = dt * (ends * push[:-1] + ramp * (push[1:] - push[:-1]))
    out = np.empty(t.size)
    out[0] = r_0
    for k in range(dt.size):
        out[k + 1] = fade[k] * out[k] + change[k]
    return out


def _peaks(t: Array, psi: Array) -> list[tuple[float, float]]:
    """Moments and headings of the extremes between passages through the initial heading."""
    crossings = _signs(psi - psi[0])
    largest = float(np.max(np.abs(psi - psi[0])))
    found: list[tuple[float, float]] = []
    for a, b in crossings:
        part = np.abs(psi[a:b] - psi[0])
        row = a + int(np.argmax(part))
        # The last swing may still be on its way out.
        if part[row - a] < _SWING * largest or row >= b - 2 or row <= a:
            continue
        c = _cubic(t, psi, float(t[row]), _ABOUT * float(t[b - 1] - t[a]))
        when = t[row] if c[2] == 0.0 else t[row] - c[1] / (2.0 * c[2])
        if t[a] < when < t[b - 1]:
            found.append((float(when), float(c[0] + c[1] * (when - t[row]) + c[2] * (when - t[row]) ** 2)))
    return found


def _signs(x: Array) -> list[tuple[int, int]]:
    """Spans of rows on one side of zero, noise about it passed over: half a swing decides on the side."""
    level = 0.5 * _SWING * float(np.max(np.abs(x)))
    spans: list[tuple[int, int]] = []
    side, start, last = 0.0, 0, 0
    for row in np.flatnonzero(np.abs(x) > level):
        here = float(np.sign(x[row]))
        if here != side:
            middle = (last + int(row)) // 2
            if side:
                spans.append((start, middle))
            side, start = here, middle if spans or side else 0
        last = int(row)
    spans.append((start, x.size))
    return spans


def _passages(t: Array, psi: Array, peaks: Array) -> list[tuple[float, float, float]]:
    """Moment, heading and yaw rate where the heading passes its initial value between two peaks."""
    found: list[tuple[float, float, float]] = []
    for a, b in pairwise(peaks.tolist()):
        rows = np.flatnonzero((t > a) & (t < b))
        side = np.sign(psi[rows[0]] - psi[0])
        row = rows[int(np.argmax(np.sign(psi[rows] - psi[0]) != side))]
        c = _cubic(t, psi, float(t[row]), _ABOUT * (b - a))
        found.append((float(t[row]), float(c[0]), float(c[1])))
    return found


def _cubic(t: Array, x: Array, when: float, about: float) -> Array:
    """Coefficients, lowest power first, of a cubic through the samples about a moment."""
    near = np.argsort(np.abs(t - when))[: max(_LEAST_ROWS, int(np.sum(np.abs(t - when) <= about)))]
    return np.asarray(np.polynomial.polynomial.polyfit(t[near] - when, x[near], 3), dtype=np.float64)
