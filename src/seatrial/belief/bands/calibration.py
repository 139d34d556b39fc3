"""The calibration of a fitted ship: what it lacks, and how its predictions of left-out trials came off.

Kept in one file beside the model, with the digests of fit, posterior and trials; held to the model when it is read.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from statistics import NormalDist
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import RequestError
from ...core.files import write_whole
from ...core.records import Limits, read_json, to_json
from ...core.values import dataclass, field, replace
from ...data import Array
from ...identify import StudyError
from ...models import STATES
from ...study.folds import day_named
from ..coverage import Reference
from ..posterior import Posterior
from ..power import Power
from .conformal import Factors, factors, shown
from .disturbance import Disturbance
from .indexing.scores import LeftIndices
from .novel import so_far

SCHEMA = "seatrial-bands/4"
SUFFIX, MEASURED = ".bands.json", "measured"
LEVEL = 0.95
"""At which a calibration is made; it serves every level."""

HOW = "seatrial calibrate MODEL makes them from fits that leave trials out"
"""What a message adds where a fit has no calibration."""
# Spreads of the draws count by this power; the rest is the usual error at the horizon.
SHARES = (0.0, 0.5, 1.0)
# Bands grow with this power of a run's novelty, which has to make the interval score of other days so much better.
POWERS, _TOLD = (0.0, 0.5, 1.0), 0.02
# So many days tell what differs between days; without them recordings are dealt into so many parts.
_DAYS, _PARTS = 3, 5
# North and east are names: position has one factor, so that bands do not depend on where the trials went.
ALIKE = ([STATES.index("x"), STATES.index("y")],)
"""Channels that share a factor."""
# So many digits of the errors are kept.
_DIGITS = 4


@dataclass(frozen=True)
class Left:
    """Predictions of left-out trials at some horizons, one row a window.

    Attributes:
        trials, groups, kinds: trial, recording and kind of manoeuvre of each window.
        horizons: [s], shape (horizons,).
        error: predicted minus measured, shape (windows, horizons, 6); NaN where unknown.
        spread: standard deviation of the draws there, of the same shape.
        novelty: of the run until there (`novel.so_far`), shape (windows, horizons); None where it is not known.
    """

    trials: tuple[str, ...]
    groups: tuple[str, ...]
    kinds: tuple[str, ...]
    horizons: Array
    error: Array
    spread: Array
    novelty: Array | None = None

    @cached_property
    def usual(self) -> Array:
        """Root mean square error at each horizon, each trial counting once, shape (horizons, 6)."""
        weight = np.array([1.0 / self.trials.count(name) for name in self.trials])[:, None, None]
        known = np.isfinite(self.error)
        total = (weight * np.where(known, self.error, 0.0) ** 2).sum(axis=0)
        mean = total / np.maximum((weight * known).sum(axis=0), 1e-300)
        for some in ALIKE:
            mean[:, some] = mean[:, some].mean(axis=1, keepdims=True)
        return np.sqrt(np.maximum(mean, 1e-300))

    def size(self, share: float, power: float = 0.0) -> Array:
        """What factors multiply, shape (windows, horizons, 6): a half width over its factor."""
        plain = self.spread**share * self.usual ** (1.0 - share)
        return plain if self.novelty is None or power == 0.0 else plain * self.novelty[:, :, None] ** power

    def scores(self, share: float, power: float = 0.0) -> Array:
        """Absolute errors over `size`, shape (windows, horizons, 6)."""
        return np.abs(self.error) / self.size(share, power)

    @cached_property
    def days(self) -> tuple[str, ...]:
        """Day of each window; none where the names of fewer than three are told."""
        found = tuple(day_named(name) for name in self.groups)
        return found if all(found) and len(set(found)) >= _DAYS else ()


Error = Annotated[float, Limits(null=math.inf)]
"""Infinite where a prediction blows up."""


@dataclass(frozen=True)
class Errors:
    """Standardised errors (Wakita 2022 Eq. 25) of left-out trials: of all together, and of each part."""

    mean: Error
    parts: tuple[Error, ...]

    @property
    def spread(self) -> float:
        """Standard deviation over the parts (n - 1)."""
        return float(np.std(self.parts, ddof=1)) if np.isfinite(self.parts).all() else math.nan

    def numbers(self) -> dict[str, Any]:
        """The same for a JSON document."""
        return {"mean": self.mean, "spread": self.spread, "parts": list(self.parts)}


def hardest(errors: Mapping[str, Errors]) -> str:
    """The way of leaving out whose trials are predicted worst."""
    return max(errors, key=lambda way: errors[way].mean)


@dataclass(frozen=True)
class Calibration:
    """Bands of a fitted ship.

    Attributes:
        fit, posterior: digests.
        trials: digest of each trial by name.
        begin: how predictions start: "measured", "history S" or "fit-first S", S the seconds before the start.
        noise: standard deviation of the readings of each state, shape (6,).
        disturbance: what the model lacks.
        share: power of the draws' spread, of `SHARES`.
        novel: power of a run's novelty, of `POWERS`.
        reference: motions, controls and wind of the trials of the fit, by which novelty is measured.
        left: predictions of left-out trials.
        surprise: greatest one of a left-out past (`past.Past`); inf where none is read.
        law: of `past.LAWS`, by which what acted before a start acts on; "" where no past is read.
        doubt: `past.Filter.doubt`.
        indices: errors of the indices of left-out turns and zigzags; None where none was left out.
        power: how much less the likelihood is worth by the left-out trials; None where its estimator has none.
        errors: of left-out trials, by each way of leaving them out (`study.folds`) that was tried.
    """

    fit: str
    posterior: str
    trials: Mapping[str, str]
    begin: str
    noise: Array
    disturbance: Disturbance
    share: float
    left: Left
    surprise: Annotated[float, Limits(null=math.inf)] = math.inf
    law: str = ""
    doubt: float = 1.0
    indices: LeftIndices | None = None
    power: Power | None = None
    errors: Mapping[str, Errors] = field(default_factory=dict[str, Errors])
    novel: float = 0.0
    reference: Reference | None = None

    @cached_property
    def _known(self) -> dict[float, Factors]:
        return {}

    @property
    def level(self) -> float:
        """`LEVEL`, or the greatest one that so few recordings show by themselves, without a law of the errors."""
        return min(LEVEL, shown(len(set(self.left.groups))))

    def factors(self, level: float) -> Factors:
        """Half widths over the spread at a level of 0 to 1.

        Raises:
            RequestError: too few recordings for any.
        """
        if level not in self._known:
            self._known[level] = factors_of(self.left, self.share, level, self.novel)
        return self._known[level]

    def novelty(self, run: Mapping[str, Array], t: Array) -> Array | None:
        """How unlike the trials of the fit runs are so far, as of `novel.so_far`; None where it does not count."""
        return so_far(self.reference, run, t) if self.novel and self.reference else None

    def reach(self, level: float, kind: str | None = None) -> float:
        """Longest horizon at which bands of a level hold [s]; of a kind, as far as its own trials go."""
        found = self.factors(level)
        good = np.isfinite(found.factor[-1]).all(axis=1)
        if kind is not None:
            good &= found.recordings[found.kinds.index(kind)] > 0 if kind in found.kinds else False
        return float(self.left.horizons[good].max(initial=0.0))

    def half(self, t: Array, spread: Array, kind: str, level: float, novelty: Array | None = None) -> Array:
        """Half widths of bands, shape (..., times, 6); beyond the longest horizon that holds they are NaN.

        A kind that was not among the left-out trials has the widest factor.  Between horizons factors and usual errors
        are interpolated in the logarithm; before the first one its factor holds, and errors grow as between the first
        two, but a band is never narrower than the noise of a reading.

        Args:
            t: times since the start [s], shape (times,).
            spread: of the draws, shape (..., times, 6).
            novelty: of the run until then (`novel.so_far`), shape (..., times); None is that of the edge of the trials.
                Below the least one of the left-out trials that counts.
        """
        found, h = self.factors(level), self.left.horizons
        row = found.kinds.index(kind) if kind in found.kinds else len(found.kinds) - 1
        good = np.isfinite(found.factor[row]).all(axis=1)
        at = np.log(np.maximum(t, 1e-9))
        new = 1.0
        if self.novel and novelty is not None and self.left.novelty is not None:
            new = np.maximum(novelty, self.left.novelty.min()) ** self.novel
        out = np.empty(np.broadcast_shapes(spread.shape))
        for c in range(len(STATES)):
            factor = np.exp(np.interp(at, np.log(h[good]), np.log(found.factor[row, good, c])))
            usual = np.exp(_extended(at, np.log(h), np.log(self.left.usual[:, c])))
            half = factor * spread[..., c] ** self.share * usual ** (1.0 - self.share) * new
            out[..., c] = np.maximum(half, NormalDist().inv_cdf(0.5 * (1.0 + level)) * self.noise[c])
        out[..., t > h[good][-1] * (1.0 + 1e-6), :] = np.nan
        return out


def factors_of(
    left: Left, share: float, level: float, power: float = 0.0, of: NDArray[np.bool_] | None = None
) -> Factors:
    """Factors by the windows of a mask, or all.

    Raises:
        RequestError: too few recordings for any.
    """
    pick = np.arange(len(left.groups)) if of is None else np.flatnonzero(of)
    return factors(left.scores(share, power)[pick], [left.groups[k] for k in pick], [left.kinds[k] for k in pick],
                   level, ALIKE)  # fmt: skip


def crossed_half(left: Left, share: float, level: float, power: float, own: NDArray[np.bool_]) -> Array:
    """Half widths for some windows by the factors of all others, shape (those, horizons, 6).

    Raises:
        RequestError: too few recordings for any.
    """
    made = factors_of(left, share, level, power, ~own)
    rows = [made.kinds.index(left.kinds[k]) if left.kinds[k] in made.kinds else -1 for k in np.flatnonzero(own)]
    return made.factor[rows] * left.size(share, power)[own]


def _extended(x: Array, at: Array, values: Array) -> Array:
    """Linear interpolation, continued below the first point by the first slope."""
    slope = (values[1] - values[0]) / (at[1] - at[0]) if len(at) > 1 else 0.5
    return np.where(x < at[0], values[0] + slope * (x - at[0]), np.interp(x, at, values))


def best_share(left: Left, level: float) -> float:
    """The power of the draws' spread whose bands are best on left-out trials, by the interval score.

    The score (Gneiting and Raftery 2007) is the width and, for what lies outside, 2 / (1 - level) times how far; taken
    over the usual error of each channel and horizon, where every factor is judged on the windows it is made of.
    """
    found: dict[float, float] = {}
    for share in SHARES:
        made = factors_of(left, share, level)
        found[share] = _interval(left, made.factor[[made.kinds.index(kind) for kind in left.kinds]] * left.size(share),
                                 level)  # fmt: skip
    return min(found, key=lambda share: found[share])


def best_power(left: Left, share: float, level: float) -> float:
    """The power of novelty whose bands are best by the interval score, each day judged by the factors of the others.

    Where no days are told, recordings are dealt into parts.  0 unless the score gains a fiftieth.
    """
    if left.novelty is None:
        return 0.0
    by = np.unique(left.days or left.groups, return_inverse=True)[1]
    by = by if left.days else by % _PARTS
    found: dict[float, float] = {}
    for power in POWERS:
        half = np.full(left.error.shape, np.nan)
        for one in np.unique(by):
            try:
                half[by == one] = crossed_half(left, share, level, power, by == one)
            except RequestError:  # the others are too few
                return 0.0
        found[power] = _interval(left, half, level)
    best = min(found, key=lambda power: found[power])
    return best if found[best] < (1.0 - _TOLD) * found[0.0] else 0.0


def _interval(left: Left, half: Array, level: float) -> float:
    """Interval score over the usual errors, for half widths of all windows."""
    over = np.maximum(np.abs(left.error) - half, 0.0)
    return float(np.nanmean((half + over / (1.0 - level)) / left.usual))


def posterior_digest(held: Posterior) -> str:
    """Fingerprint of what is drawn from: names, means, covariance and samples."""
    text = ",".join(one.path for one in held.free).encode()
    sampled = b"" if held.samples is None else held.samples.tobytes()
    return hashlib.sha256(text + held.mean.tobytes() + held.covariance.tobytes() + sampled).hexdigest()[:16]


def beside(model: str | Path, begin: str = MEASURED) -> Path:
    """Where the calibration of a model is kept for predictions that begin so."""
    path = Path(model)
    return path.with_suffix(SUFFIX) if begin == MEASURED else path.with_name(
        f"{path.stem}.{begin.replace(' ', '-')}{SUFFIX}")


def begin_of(history: float | None, fit_first: float | None) -> str:
    """`Calibration.begin` of predictions by these options."""
    known = (("history", history), ("fit-first", fit_first))
    return next((f"{name} {seconds:g}" for name, seconds in known if seconds is not None), MEASURED)


def save(found: Calibration, path: Path) -> Path:
    """Write a calibration, whole or not at all."""
    new = found.left.novelty
    left = replace(found.left, error=_rounded(found.left.error), spread=_rounded(found.left.spread),
                   novelty=None if new is None else _rounded(new))  # fmt: skip
    return write_whole(path, to_json(replace(found, left=left), SCHEMA))


def _rounded(values: Array) -> Array:
    """To a few digits, which keeps the file small."""
    return np.array([float(f"{one:.{_DIGITS}g}") for one in values.flat]).reshape(values.shape)


def load(model: str | Path, held: Posterior, begin: str = MEASURED) -> Calibration:
    """The calibration beside a fitted model.

    Args:
        held: the posterior of the model.
        begin: how the predictions start, as `Calibration.begin`.

    Raises:
        StudyError: there is none, it cannot be read, or it is of another fit; says which command makes one.
    """
    path = beside(model, begin)
    how = HOW if begin == MEASURED else HOW.replace("MODEL", f"MODEL --{begin}")
    if not path.is_file():
        raise StudyError(f"{model}: its predictions have no bands ({path.name} is not beside it); {how}")
    found = read_calibration(path, how)
    if (found.fit, found.posterior) != (held.digest, posterior_digest(held)):
        raise StudyError(f"{path}: is of fit {found.fit}, the model beside it of fit {held.digest} with another "
                         f"posterior; {how}")  # fmt: skip
    if found.begin != begin:
        raise StudyError(f"{path}: is of predictions that begin by '{found.begin}', not '{begin}'; {how}")
    return found


def read_calibration(path: Path, how: str = HOW) -> Calibration:
    """The calibration of a file that `save` wrote.

    Raises:
        StudyError: not such a file; `how` one is made.
    """
    found = read_json(path, Calibration, SCHEMA, StudyError, how)
    size = (len(found.left.trials), len(found.left.horizons), len(STATES))
    if found.left.novelty is not None and found.left.novelty.shape != size[:2]:
        raise StudyError(f"{path}: novelty of shape {found.left.novelty.shape}, and {size[:2]} are told; {how}")
    if found.left.error.shape != size or found.left.spread.shape != size or found.noise.shape != size[2:]:
        raise StudyError(f"{path}: errors of shape {found.left.error.shape}, and {size} are told; {how}")
    return found
