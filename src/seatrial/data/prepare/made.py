"""Channels that are made from others: no second measurement, whatever their noise looks like.

A rate differenced from a heading, and velocities differenced from a track, repeat the noise of what they are made of.
`meta["derived"]` names such channels, and what each is made of; a fit leaves them out of its residuals, which loses
nothing as their sources are in them (`measured`).  `unsaid` finds those that a logger made and
did not tell.

The evidence: predict a channel by a linear filter over the rows around of what it may be made of.  If an instrument of
its own measured it, the noise of the source enters the prediction and not the reading, so that their difference is at
least that noise through the filter.  A difference well below it shows that the reading has the source's own noise.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ...core.ranks import median
from ...core.values import dataclass, replace
from .. import Array, Trial

SOURCES: Mapping[str, tuple[str, ...]] = MappingProxyType({
    "r": ("psi",), "u": ("x", "y", "psi"), "v_m": ("x", "y", "psi"),
})  # fmt: skip
"""What the channels of a motion can be made of."""

# Rows to either side of differences, and of a filter; rows to judge by for each weight.
_NEAR, _FAR, _FOR_EACH = 2, 15, 6
# What is left of a reading that is made of the source, over the noise of the source through the filter: at least 1
# where the two are independent.
_BELOW = 0.3
# Room for degrees of freedom and for rows that only one of two interpolations leaves out.
_SURELY = 1.2
# So many rows, those in the middle, tell it.
_ENOUGH = 2000
# A source whose noise is below this share of its spread shows little: what is left must be what rounding leaves.  Below
# the second one it shows none, as of a simulation.
_SHOWN, _NONE = 2e-4, 1e-6
# Rows that a second pass leaves out: those of wraps and outliers, in median deviations.
_WILD = 8.0
# Share of a series below which differences are rounding.
_ROUND = 1e-9


@dataclass(frozen=True)
class Made:
    """Evidence that a channel is made from others.

    Attributes:
        name: the channel.
        of: what it is made of.
        reach: rows to either side over which.
        left: what a filter over them leaves [SI], root mean square.
        least: what it would leave at least of a measurement [SI].
    """

    name: str
    of: tuple[str, ...]
    reach: int
    left: float
    least: float

    @property
    def source(self) -> str:
        """What it is made of, as in `meta["derived"]`."""
        return ", ".join(self.of)

    @property
    def words(self) -> str:
        """How it is made."""
        return f"{'differences' if self.reach == _NEAR else 'a filter over the rows around'} of {self.source}"


def derived(trial: Trial) -> Mapping[str, str]:
    """Channels that are made from others, and what of."""
    return trial.meta.get("derived") or {}


def marked(trial: Trial, made: Mapping[str, str]) -> Trial:
    """The trial with more channels that are told to be made from others."""
    return replace(trial, meta={**trial.meta, "derived": {**derived(trial), **made}}) if made else trial


def measured(trial: Trial, name: str) -> bool:
    """Whether a channel has a value in some row, and is not made from others."""
    return name in trial and name not in derived(trial) and bool(np.isfinite(trial[name]).any())


def uncounted(compared: Collection[str]) -> tuple[str, ...]:
    """Channels that do not count in a fit beside those they can be made of; none where the fit names none."""
    return tuple(name for name in SOURCES if name not in compared) if {"x", "y", "psi"} <= set(compared) else ()


def unsaid(whole: Trial) -> Iterator[Made]:
    """Channels that a logger has made of others without a word."""
    first = max(len(whole) - _ENOUGH, 0) // 2
    trial = whole.rows(slice(first, first + _ENOUGH))
    near, far = _Around(trial, _NEAR), _Around(trial, _FAR)
    for name, of in SOURCES.items():
        if measured(trial, name) and all(measured(trial, one) for one in of):
            found, between = _made(near, name, of, math.inf)
            found = found or _made(far, name, of, between)[0]
            if found is not None:
                yield found


def _made(around: _Around, name: str, of: tuple[str, ...], most: float) -> tuple[Made | None, float]:
    """Evidence, if any, and what interpolation leaves of the source.

    Args:
        most: what interpolation between fewer rows leaves: between more it leaves no more, which often tells enough.
    """
    reach = around.reach
    if len(around.trial) <= 2 * reach:
        return None, math.inf
    values, rates = around.inner(name)[:, 0], around.rates(name)
    good = np.isfinite(rates).all(axis=1) & np.isfinite(values)
    if good.sum() < 2 * reach * _FOR_EACH:
        return None, math.inf
    values = values[good]
    weights, off = _tame(rates[good], values)
    left = float(np.sqrt(np.mean(off**2)))
    through = weights / (around.away * around.trial.dt)
    share = math.hypot(float(np.linalg.norm(through)), float(through.sum()))
    if left > _BELOW * share * _SURELY * most:
        return None, most
    noise, spread, between = _noise(around, name)
    least = noise * share
    rounded = _rounding(values)
    shown = noise >= _SHOWN * spread or (noise >= _NONE * spread and left <= rounded)
    told = shown and left <= _BELOW * least
    return Made(name, of, reach, left, least) if told else None, between


def _filter(columns: Array, values: Array) -> tuple[Array, Array]:
    """Weights of least squares, and what they leave, by degree of freedom."""
    # of a smooth run the columns are nearly alike: their squares would leave no digit to the weights
    weights: Array = np.linalg.lstsq(columns, values, rcond=1e-10)[0].astype(np.float64)
    freedom = max(values.size - weights.size, 1)
    return weights, (values - columns @ weights) * math.sqrt(values.size / freedom)


def _tame(columns: Array, values: Array) -> tuple[Array, Array]:
    """The same without the few rows that are far off: of wraps and outliers."""
    weights, off = _filter(columns, values)
    # of a log without noise the median is what rounding leaves, and many rows are far off that
    rounding = _ROUND * float(np.sqrt(np.mean(values**2)))
    kept = np.abs(off) <= max(_WILD * median(np.abs(off)), rounding)
    return _filter(columns[kept], values[kept]) if 0.9 < kept.mean() < 1.0 else (weights, off)


@dataclass(frozen=True)
class _Around:
    """The rows of a trial that have so many (`reach`) to either side, each beside these."""

    trial: Trial
    reach: int

    @cached_property
    def away(self) -> NDArray[np.intp]:
        """Rows from one to those around it, shape (2 reach,)."""
        return np.array([k for k in range(-self.reach, self.reach + 1) if k])

    def inner(self, name: str) -> Array:
        """Values of the rows themselves, shape (rows, 1)."""
        return self._of(name)[self.reach : len(self.trial) - self.reach, None]

    def beside(self, name: str) -> Array:
        """Values of the rows around, shape (rows, 2 reach)."""
        return sliding_window_view(self._of(name), 2 * self.reach + 1)[:, self.away + self.reach]

    def _of(self, name: str) -> Array:
        return self.trial.heading if name == "psi" else self.trial[name]

    @cached_property
    def _axes(self) -> tuple[Array, Array]:
        """Cosine and sine of the heading, shape (rows, 1)."""
        return np.cos(self.inner("psi")), np.sin(self.inner("psi"))

    def moved(self, name: str, ends: Sequence[Array], back: int) -> Array:
        """What the source of a channel moved along the axes of each row, to some ends from so many rows before it on.

        Args:
            ends: its headings, or north and east.
        """
        first = slice(self.reach - back, len(self.trial) - self.reach - back)
        if name == "r":
            return ends[0] - self._of("psi")[first, None]
        (c, s), (x, y) = self._axes, ends
        north, east = x - self.trial["x"][first, None], y - self.trial["y"][first, None]
        return c * north + s * east if name == "u" else c * east - s * north

    @cached_property
    def _track(self) -> tuple[Array, Array]:
        return self.beside("x"), self.beside("y")

    @cached_property
    def _span(self) -> Array:
        return self.beside("t") - self.inner("t")

    def around(self, name: str) -> tuple[Array, ...]:
        """Headings, or north and east, of the rows around."""
        return (self.beside("psi"),) if name == "r" else self._track

    def rates(self, name: str) -> Array:
        """Mean rates of change of the source from each row to those around, shape (rows, 2 reach)."""
        with np.errstate(all="ignore"):
            return self.moved(name, self.around(name), 0) / self._span


def _noise(around: _Around, name: str) -> tuple[float, float, float]:
    """White noise of the source, by what interpolation between the rows around leaves; its spread; what is left."""
    trial, reach = around.trial, around.reach
    # all from the row before, as only differences can be taken along axes that turn
    own = around.moved(name, [around.inner(one) for one in (("psi",) if name == "r" else ("x", "y"))], 1)[:, 0]
    moves = np.delete(around.moved(name, around.around(name), 1), reach - 1, axis=1)  # of the row before itself: zero
    good = np.isfinite(moves).all(axis=1) & np.isfinite(own)
    weights, off = _tame(moves[good], own[good])
    # the row before counts with what is left to one
    norm = math.sqrt(1.0 + float(weights @ weights) + (1.0 - float(weights.sum())) ** 2)
    source = trial.heading if name == "r" else np.hypot(trial["x"], trial["y"])
    between = float(np.sqrt(np.mean(off**2)))
    return between / norm, float(np.nanstd(source)), between


def _rounding(values: Array) -> float:
    """What rounding leaves of a reading, root mean square, with a fifth more; that of a single float at least."""
    steps = np.diff(np.unique(values))
    step = median(steps[steps <= 1.5 * steps.min()]) if 1 < steps.size < 0.5 * values.size else 0.0
    return max(1.2 * step / math.sqrt(12.0), 1e-7 * float(np.sqrt(np.mean(values**2))))
