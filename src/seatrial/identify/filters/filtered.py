"""Result of a filter: states with their covariances, parameters, and the innovation test of the model.

Under the right model the normalised innovation squared (NIS) of each update is chi-squared with as many degrees of
freedom as there were readings, and independent of the others, so its sum over a window is too.  Above the limit of a
window the model no longer fits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import Free, specs, unknown
from ...core.values import dataclass, replace
from ...data import Array, Trial
from ...models import STATES
from ...ships import Ship
from .. import StudyError, Verdict
from ..nuisance import CURRENT
from ..posterior.verdicts import CLEAR, UNKNOWN
from ..vector import Vector
from .kalman import over


class Estimate(NamedTuple):
    """A value and its standard deviation."""

    value: float
    sigma: float


class Pass(NamedTuple):
    """All events of a run, in time order, n states.

    Attributes:
        means, covs: after the readings of the event, shapes (events, n) and (events, n, n).
        crosses: covariance of the state after the event before with that ahead of this one.
        ahead_means, ahead_covs: before the readings of the event.
    """

    means: Array
    covs: Array
    crosses: Array
    ahead_means: Array
    ahead_covs: Array

    @classmethod
    def of(cls, events: int, n: int) -> Pass:
        """An empty one."""
        square = (events, n, n)
        return cls(np.empty((events, n)), np.empty(square), np.zeros(square), np.empty((events, n)), np.empty(square))


@dataclass(frozen=True)
class Filtered:
    """States and parameters over a trial.

    Attributes:
        source: the trial.
        ship: the ship, with the parameters it had before.
        t: rows of the trial [s], shape (rows,).
        names: of the states of the filter: those of the model, current, parameters; n of them.
        free: the parameters that were estimated.
        states, covariances: shapes (rows, n) and (rows, n, n).
        events: the event of `passed` of each row.
        channels: names of the readings.
        innovation_t: times at which readings were true [s], shape (updates,).
        innovations: reading less prediction, shape (updates, channels); NaN where there was none.
        nis: normalised innovation squared, shape (updates,).
        consistency: the innovation test.
        passed: the run event by event, which the smoother goes back over.
        smooth: whether this is the smoothed run.
    """

    source: Trial
    ship: Ship
    t: Array
    names: tuple[str, ...]
    free: tuple[Free, ...]
    states: Array
    covariances: Array
    events: NDArray[np.intp]
    channels: tuple[str, ...]
    innovation_t: Array
    innovations: Array
    nis: Array
    consistency: Consistency
    passed: Pass
    smooth: bool = False

    def of(self, name: str) -> tuple[Array, Array]:
        """A state of the filter over time and its standard deviation, each shape (rows,).

        Raises:
            StudyError: no state of that name.
        """
        if name not in self.names:
            raise StudyError(f"{self.source.name}: {unknown(name, self.names, 'state of the filter')}")
        k = self.names.index(name)
        return self.states[:, k], np.sqrt(np.maximum(self.covariances[:, k, k], 0.0))

    @property
    def parameters(self) -> dict[str, Estimate]:
        """Each parameter, and the current, at the last row."""
        return {name: self._last(name) for name in self.names if name in CURRENT or name in specs(self.ship.model)}

    @property
    def fitted(self) -> Ship:
        """The ship with its parameters as they are at the last row."""
        return self.ship.moved({f.path: self._last(f.path).value for f in self.free})

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """The innovation test ("fits" or "does not fit"), then the verdict on each parameter."""
        fits = Verdict("model", "fits" if self.consistency.fits else "does not fit", self.consistency.text)
        units = specs(self.ship.model)
        return (fits, *(
            _verdict(f, self._last(f.path), variance, units[f.path].unit)
            for f, variance in zip(self.free, Vector(self.free).variance, strict=True)
        ))  # fmt: skip

    def _last(self, name: str) -> Estimate:
        values, sds = self.of(name)
        return Estimate(float(values[-1]), float(sds[-1]))

    def trial(self) -> Trial:
        """The trial with the motion as estimated, standard deviations as ``<name>_sd``.

        An estimated current takes the place of U_C and gamma_C, on top of what the trial said.
        """
        channels: dict[str, Array] = {}
        for name in STATES:
            channels[name], channels[f"{name}_sd"] = self.of(name)
        if CURRENT[0] in self.names:
            north, east = (self.of(name)[0] for name in CURRENT)
            if "U_C" in self.source and "gamma_C" in self.source:
                north = north + self.source["U_C"] * np.cos(self.source["gamma_C"])
                east = east + self.source["U_C"] * np.sin(self.source["gamma_C"])
            channels |= {"U_C": np.hypot(north, east), "gamma_C": np.arctan2(east, north)}
        units = {**self.source.units, **{f"{name}_sd": self.source.unit(name) for name in STATES}}
        out = replace(self.source, channels={**self.source.channels, **channels}, units=units)
        how = "smoother" if self.smooth else "filter"
        return out.noting(f"motion from a Kalman {how} on the model of {self.ship.name}")

    def smoothed(self) -> Filtered:
        """The same run with every row given all readings, those after it too (Rauch-Tung-Striebel)."""
        if self.smooth:
            return self
        run = self.passed
        means, covs = run.means.copy(), run.covs.copy()
        for k in range(len(means) - 2, -1, -1):
            gain = over(run.crosses[k + 1], run.ahead_covs[k + 1])
            means[k] += gain @ (means[k + 1] - run.ahead_means[k + 1])
            cov = covs[k] + gain @ (covs[k + 1] - run.ahead_covs[k + 1]) @ gain.T
            covs[k] = 0.5 * (cov + cov.T)
        return replace(self, states=means[self.events], covariances=covs[self.events], smooth=True)


def _verdict(free: Free, found: Estimate, prior: float, unit: str) -> Verdict:
    removed = 1.0 - found.sigma**2 / prior
    share = f"the readings removed {100.0 * removed:.0f} % of the variance"
    told = f"{found.value:.5g} +- {found.sigma:.2g} {unit}; {share}"
    if min(found.value - free.low, free.high - found.value) < 1e-9 * max(abs(found.value), 1e-30):
        return Verdict(free.path, "at bound", f"{told}; it ends on its bound")
    status = "identified" if removed > CLEAR else "not identified" if removed < UNKNOWN else "weak"
    return Verdict(free.path, status, told)


@dataclass(frozen=True)
class Window:
    """One stretch of the innovation test.

    Attributes:
        start, end: its times [s].
        nis: NIS in it, per degree of freedom; 1 on average under the right model.
        limit: upper limit under the right model.
        readings: degrees of freedom.
    """

    start: float
    end: float
    nis: float
    limit: float
    readings: int


@dataclass(frozen=True)
class Consistency:
    """The outcome of the innovation test.

    Attributes:
        fits: whether no window is above its limit.
        since: start of the first window that is [s]; NaN where none is.
        text: the same in words.
        windows: one after the other.
    """

    fits: bool
    since: float
    text: str
    windows: tuple[Window, ...]


def innovation_test(
    t: Array, innovations: Array, squares: Array, nis: Array, channels: tuple[str, ...], *,
    window: float, false_alarm: float,
) -> Consistency:  # fmt: skip
    """Test the innovations window by window.

    Args:
        t: times of the updates [s], shape (updates,).
        innovations, squares: innovation and its normalised square channel by channel, shape
            (updates, channels); NaN where there was no reading.
        nis: shape (updates,).
        window: length of a window [s].
        false_alarm: probability that a right model is found wrong anywhere in the trial.
    """
    from scipy.special import chdtri

    count = max(1, int((t[-1] - t[0]) / window + 1e-9))
    which = np.minimum(((t - t[0]) / window + 1e-9).astype(int), count - 1)
    dof = np.isfinite(innovations).sum(axis=1)
    each = 1.0 - (1.0 - false_alarm) ** (1.0 / np.unique(which).size)
    found: list[Window] = []
    for k in np.unique(which):
        rows = which == k
        m = int(dof[rows].sum())
        start, end = t[0] + k * window, t[-1] if k == count - 1 else t[0] + (k + 1) * window
        found.append(Window(float(start), float(end), float(nis[rows].sum()) / m, float(chdtri(m, each)) / m, m))
    loud = [w for w in found if w.nis > w.limit]
    if not loud:
        total, m = float(nis.sum()), int(dof.sum())
        text = f"the innovations are {np.sqrt(total / m):.3g} times as large as "
        if total < float(chdtri(m, 1.0 - false_alarm)):
            text += "stated: noise or process noise is stated too large"
        else:
            text = f"the model fits throughout: {text}they should be"
        return Consistency(True, float("nan"), text, tuple(found))
    since = loud[0].start
    rows = (t >= since) & (t <= loud[-1].end)
    worst = channels[int(np.nanargmax(np.nanmean(np.vstack([squares[rows], np.zeros(len(channels))]), axis=0)))]
    until = "on" if loud[-1] is found[-1] else f"to {loud[-1].end:.4g} s"
    peak = max(loud, key=lambda w: w.nis / w.limit)
    text = (
        f"from t = {since:.4g} s {until} the model no longer fits: the innovations are {np.sqrt(peak.nis):.3g} times "
        f"as large as they should be in the window at {peak.start:.4g} s (limit {np.sqrt(peak.limit):.3g}), "
        f"most of all those of {worst}"
    )
    return Consistency(False, since, text, tuple(found))
