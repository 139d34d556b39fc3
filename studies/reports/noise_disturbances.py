"""Unmeasured disturbances: the share of the error that they explain, and what the past of a window predicts of it.

`fitted` uses the window itself: what a constant current, wind or acceleration could explain at most.
`previous` and `Drift` use only data before a window, so a prediction may use them.  `lagged`, `averaged` and `drifted`
replace the measured wind or derive a current from it; `coherence` shows what motion follows the measured wind.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from noise_windows import BODY, WIND, Cut, Predictor
from numpy.typing import NDArray

import seatrial as st

# Rows this far apart are compared [s], and errors are alike over this time [s] (identify.Loss).
_APART, _ALIKE = 1.0, 5.0
_ITERATIONS = 4
_STEPS = (1.0, 0.5, 0.2, 0.05)


def fitted(cut: Cut, predictor: Predictor, channels: Sequence[str], sd: float, rest: float = 0.2) -> st.Array:
    """The constant in each window that explains it best, shape (lanes, channels): Gauss-Newton with a prior.

    Args:
        cut: the windows.
        predictor: the ship's model.
        channels: what is added to; `CURRENT`, `WIND`, `BODY` or `EARTH` of `noise_windows`.
        sd: standard deviation of the constant before the window is seen, SI units.
        rest: size of the error that no constant explains, over the scale of each state; a larger one trusts the
            window less and `sd` more.
    """
    lanes, n = len(cut.label), len(channels)
    weight = np.sqrt(_APART / _ALIKE) / rest
    every = max(round(_APART / cut.dt), 1)

    def left(theta: st.Array) -> st.Array:
        return weight * predictor.errors(cut.adding(channels, theta), every).reshape(lanes, -1)

    def cost(residual: st.Array, theta: st.Array) -> st.Array:
        return (residual**2).sum(axis=1) + ((theta / sd) ** 2).sum(axis=1)

    theta = np.zeros((lanes, n))
    residual = left(theta)
    best = cost(residual, theta)
    for _ in range(_ITERATIONS):
        step = _step(left, theta, residual, sd)
        for share in _STEPS:
            new = theta + share * step
            tried = left(new)
            value = cost(tried, new)
            better = value < best
            theta[better], residual[better], best[better] = new[better], tried[better], value[better]
            step[better] = 0.0
    return theta


def _step(left: Callable[[st.Array], st.Array], theta: st.Array, residual: st.Array, sd: float) -> st.Array:
    """Gauss-Newton step of every window at once, slopes by difference quotients."""
    small = 1e-3 * sd
    slopes = np.stack([(left(theta + small * one) - residual) / small for one in np.eye(theta.shape[1])], axis=2)
    normal = np.einsum("nri,nrj->nij", slopes, slopes) + np.eye(theta.shape[1]) / sd**2
    downhill = np.einsum("nri,nr->ni", slopes, residual) + theta / sd**2
    return -np.linalg.solve(normal, downhill[..., None])[..., 0]


def previous(cut: Cut, values: st.Array) -> st.Array:
    """Values of the window before, in the same trial; zero in the first window of each."""
    out = np.zeros_like(values)
    same = np.flatnonzero(cut.trial[1:] == cut.trial[:-1]) + 1
    out[same] = values[same - 1]
    return out


def memory(cut: Cut, values: st.Array) -> st.Array:
    """Correlation about zero of each value with that of the window before, shape (values,)."""
    same = np.flatnonzero(cut.trial[1:] == cut.trial[:-1]) + 1
    now, before = values[same], values[same - 1]
    return (now * before).sum(axis=0) / np.sqrt((now**2).sum(axis=0) * (before**2).sum(axis=0))


@dataclass(frozen=True)
class Drift:
    """A slow acceleration, filtered from the past and carried into the prediction, where it is forgotten.

    The model's acceleration is held against the measured change of velocity, row by row.  A random walk seen
    through white noise is filtered, once settled, by an exponential mean, which begins at zero here.

    Attributes:
        filter: time constant of the mean [s].
        forget: time constant with which it fades after the restart [s].
        share: of the estimate that is carried.
    """

    filter: float
    forget: float
    share: float

    def carried(self, cut: Cut, missing: Sequence[st.Array]) -> Cut:
        """The windows with the disturbance in them.

        Args:
            cut: the windows.
            missing: `missing_acceleration` of the same windows.
        """
        found = np.array([_mean_before(missing[k], self.filter / cut.dt)[row]
                          for k, row in zip(cut.trial.tolist(), cut.row.tolist(), strict=True)])  # fmt: skip
        fade = np.exp(-cut.since / self.forget)
        return cut.adding(BODY, self.share * found[:, None, :] * fade[None, :, None])


def missing_acceleration(cut: Cut, predictor: Predictor) -> tuple[st.Array, ...]:
    """What the measured accelerations along, across and in yaw have beyond the model's, for each trial.

    Row k holds the change from row k - 1 to row k, so nothing in it is later than row k; shape (rows, 3) each.
    """
    rates = predictor.accelerations(cut)
    found: list[st.Array] = []
    for index in np.unique(cut.trial):
        mine = cut.trial == index
        velocity = cut.measured[mine][:, :, 3:6].reshape(-1, 3)
        known = np.isfinite(velocity).all(axis=1)
        velocity, rate = velocity[known], rates[mine].reshape(-1, 3)[known]
        out = np.zeros_like(velocity)
        out[1:] = np.diff(velocity, axis=0) / cut.dt - rate[:-1]
        found.append(out)
    return tuple(found)


def _mean_before(values: st.Array, steps: float) -> st.Array:
    """Exponential mean of the rows up to each, from zero."""
    from scipy import signal

    gain = 1.0 / max(steps, 1.0)
    return np.asarray(signal.lfilter([gain], [1.0, gain - 1.0], values, axis=0), dtype=np.float64)


def correlation(values: Sequence[st.Array], dt: float, block: float, lags: Sequence[float]) -> st.Array:
    """Correlation of the means over `block` seconds with those of each lag later, shape (lags, channels).

    Args:
        values: series of several trials, shape (rows, channels) each.
        dt: their time step [s].
        block: length of a mean [s].
        lags: multiples of it [s].
    """
    width = round(block / dt)
    means = [v[: len(v) // width * width].reshape(-1, width, v.shape[1]).mean(axis=1) for v in values]
    power = sum(((m**2).sum(axis=0) for m in means), np.zeros(values[0].shape[1]))
    shifts: list[NDArray[np.float64]] = []
    for lag in lags:
        k = round(lag / block)
        shifts.append(sum(((m[k:] * m[:-k]).sum(axis=0) for m in means if len(m) > k), np.zeros_like(power)))
    return np.array(shifts) / power


def lagged(trial: st.Trial, lag: float) -> st.Trial:
    """The trial with the wind of `lag` seconds before; below zero, of after, which no prediction could know."""
    rows = np.clip(np.arange(len(trial)) - round(lag / trial.dt), 0, len(trial) - 1)
    return _blown(trial, _components(trial)[rows])


def averaged(trial: st.Trial, span: float) -> st.Trial:
    """The trial with the mean wind of the last `span` seconds; infinity takes the mean of the whole trial."""
    wind = _components(trial)
    if not np.isfinite(span):
        return _blown(trial, np.broadcast_to(wind.mean(axis=0), wind.shape))
    width = max(round(span / trial.dt), 1)
    total = np.vstack([np.zeros(2), np.cumsum(wind, axis=0)])
    last = np.arange(1, len(wind) + 1)
    first = np.maximum(last - width, 0)
    return _blown(trial, (total[last] - total[first]) / (last - first)[:, None])


def drifted(trial: st.Trial, share: float, span: float) -> st.Trial:
    """The trial with a surface current of `share` of the wind, as an exponential mean over the last `span` seconds."""
    from scipy import signal

    gain = trial.dt / (span + trial.dt)
    mean: Any = signal.lfilter([gain], [1.0, gain - 1.0], _components(trial), axis=0)
    full: Any = signal.lfilter([gain], [1.0, gain - 1.0], np.ones(len(trial)))
    north, east = (-share * mean / full[:, None]).T
    return trial.having(U_C=np.hypot(north, east), gamma_C=np.arctan2(east, north))


def _components(trial: st.Trial) -> st.Array:
    """North and east of where the true wind comes from, gaps filled with the value before, shape (rows, 2)."""
    gamma_T = trial["gamma_T"]
    return st.held_series(trial["U_T"][:, None] * np.column_stack([np.cos(gamma_T), np.sin(gamma_T)]))


def _blown(trial: st.Trial, wind: st.Array) -> st.Trial:
    return trial.having(U_T=np.hypot(wind[:, 0], wind[:, 1]), gamma_T=np.arctan2(wind[:, 1], wind[:, 0]))


@dataclass(frozen=True)
class Coherence:
    """How much of an acceleration follows the wind force of the model, by frequency.

    Attributes:
        bands: lower and upper end of each band [Hz].
        before: squared coherence of the wind force with the measured acceleration less all other forces of the
            model, shape (bands, 3): 1 where the anemometer and the model explain all of it.
        after: the same with what the whole model leaves over: what a gain or a delay of the wind could still mend.
        left: power that the whole model leaves over, as a share of that which is left without wind force.
        chance: squared coherence that unrelated signals would show with as many windows.
    """

    bands: tuple[tuple[float, float], ...]
    before: st.Array
    after: st.Array
    left: st.Array
    chance: float


def coherence(cut: Cut, predictor: Predictor, bands: Sequence[tuple[float, float]]) -> Coherence:
    """Squared coherence of the wind force with the motion, from complete windows, Hann-tapered, averaged over them."""
    whole = cut.lanes(np.flatnonzero(np.isfinite(cut.measured).all(axis=(1, 2))))
    calm = whole.adding(WIND, -whole.series[:, :, whole.at(WIND)])
    still = predictor.accelerations(calm)[:, :-1]
    force = predictor.accelerations(whole)[:, :-1] - still
    rest = np.diff(whole.measured[:, :, 3:6], axis=1) / cut.dt - still
    lanes, steps, _ = force.shape
    taper = np.hanning(steps)[None, :, None]
    wind, without, over = (
        np.fft.rfft(taper * (v - v.mean(axis=1, keepdims=True)), axis=1) for v in (force, rest, rest - force)
    )
    f = np.fft.rfftfreq(steps, cut.dt)
    inside = [np.flatnonzero((f >= low) & (f < high)) for low, high in bands]
    return Coherence(
        tuple(bands), _shared(wind, without, inside), _shared(wind, over, inside),
        np.array([_power(over[:, k]) / _power(without[:, k]) for k in inside]), 1.0 / lanes,
    )  # fmt: skip


def _power(spectrum: Any) -> st.Array:
    return (np.abs(spectrum) ** 2).sum(axis=(0, 1))


def _shared(a: Any, b: Any, inside: Sequence[Any]) -> st.Array:
    """Squared coherence at each frequency over the windows, mean over each band, weighted by the power of b."""
    cross, own, other = (np.conj(a) * b).sum(axis=0), (np.abs(a) ** 2).sum(axis=0), (np.abs(b) ** 2).sum(axis=0)
    at = np.abs(cross) ** 2 / np.maximum(own, 1e-300)
    return np.array([at[k].sum(axis=0) / other[k].sum(axis=0) for k in inside])
