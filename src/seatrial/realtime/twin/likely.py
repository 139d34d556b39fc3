"""How rough the sea and how noisy the instruments are, by the first readings of a log.

Both are those under which forecasts over five ship lengths are most likely: a twin is there to forecast, and noise has
to be right where it is relied on.  By innovations, which tell of the next reading only, process noise would have to
explain rolling, pitching and jitter, too: forecasts of the 3 m Esso Osaka would then have bands twice as wide as
needed, and be worse than those of the model without a filter.

A fault among the first readings is no noise.  Rows from the first fault on are left out, where a twin with the usual
noise names one or few; one that names many has too little noise, or the wrong model, and all rows count.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...data import Array
from ...data.prepare import turns
from ...environment import CHANNELS
from ...ships import Ship
from .faults.acting import between_rows
from .follow import Follower, Machine, Step, begun, inverse_of, made
from .live import Live
from .settings import Settings, noisier, scaled

Row = tuple[float, Mapping[str, float]]
FACTORS = (1.0, 3.0, 10.0, 30.0)
"""Factors of the usual process noise that are tried."""
NOISIER = (1.0, 2.0, 4.0, 8.0)
"""Factors of the noise of the sensors that are tried."""

# A start this long is enough [L/U], and no more than so many rows are taken.
_LENGTH, _ROWS, _GAP = 60.0, 1500, 5.0
# Forecasts begin after the first, or after a third of a short log and no less than that, each third, and reach over the
# fourth [L/U].
_SETTLED, _SOON, _EVERY, _AHEAD = 10.0, 5.0, 1.0, 5.0
# More faults than this among the first rows are none.
_FEW = 3
# Steps of a forecast are so many times those of the filter.
_LONGER = 4.0
# A reading counts as so many squared standard deviations at most.
_MOST = 25.0


class Factors(NamedTuple):
    """What the usual settings are multiplied by.

    Attributes:
        motion, slow: process noise of the motion and size of slow forces.
        noise: of the sensors.
    """

    motion: float = 1.0
    slow: float = 1.0
    noise: float = 1.0

    def applied(self, settings: Settings) -> Settings:
        """Settings with these factors."""
        return noisier(scaled(settings, self.motion, self.slow), self.noise)


class _Row(NamedTuple):
    """A row that the filter has taken in: what acted since the one before, what was read, the filter and its step."""

    acting: Array
    readings: Array
    after: Follower
    step: Step


def likeliest(
    ship: Ship, settings: Settings, rows: Iterable[Row], held: Collection[str] = ()
) -> tuple[Settings, Factors]:  # fmt: skip
    """The settings with the factors under which forecasts of the first rows are most likely.

    Args:
        rows: of the log, from its beginning.  Rows too few for a forecast are judged by their innovations.
        held: controls that keep the value of a row until the next one.
    """
    some = _sound(ship, settings, _first(ship, rows), held)
    found: dict[Factors, float] = {}

    def score(one: Factors) -> float:
        if one not in found:
            runs = _runs(made(ship, one.applied(settings)), some, held)
            forecasts = [_forecast(way) for run in runs for way in _ways(run)]
            found[one] = _sum(forecasts or [_innovation(row.step) for run in runs for row in run])
        return found[one]

    best = Factors()
    for _ in range(2):
        best = max((best._replace(motion=one) for one in FACTORS), key=score)
        best = max((best._replace(slow=one) for one in FACTORS), key=score)
        best = max((best._replace(noise=one) for one in NOISIER), key=score)
    return best.applied(settings), best


def _first(ship: Ship, rows: Iterable[Row]) -> Sequence[Row]:
    span, out = _LENGTH * ship.L_pp / max(ship.speed, 1e-3), list[Row]()
    for t, values in rows:
        if out and (t - out[0][0] > span or t <= out[-1][0]):
            break
        out.append((t, values))
    return out[:: max(1, len(out) // _ROWS)]


def _sound(ship: Ship, settings: Settings, rows: Sequence[Row], held: Collection[str]) -> Sequence[Row]:
    """The rows before the first fault that a twin with these settings names; all of them where it names many."""
    live = Live(ship, settings, held=tuple(held))
    for t, values in rows:
        live.feed(t, values)
        if len(live.alarms) > _FEW:
            return rows
    since = min((one.since for one in live.alarms), default=math.inf)
    return [row for row in rows if row[0] < since]


def _runs(machine: Machine, rows: Sequence[Row], held: Collection[str]) -> list[list[_Row]]:
    """The rows as the filter takes them in, begun anew after a long gap."""
    controls = machine.ship.model.controls
    acting = np.zeros(len(controls) + len(CHANNELS))
    kept = np.array([*(name in held for name in controls), *(True for _ in CHANNELS)])
    turning = np.array([*(turns(name) for name in controls), *(False for _ in CHANNELS)])
    follower: Follower | None = None
    out, long = list[list[_Row]](), _GAP * machine.unit
    for t, values in rows:
        before = acting.copy()
        for k, name in enumerate(controls):
            acting[k] = values.get(name, acting[k])
        readings = np.array([values.get(name, math.nan) for name in machine.channels])
        if follower is None or t - follower.t > long:
            known = all(math.isfinite(values.get(name, math.nan)) for name in _places(machine))
            follower = begun(machine, t, readings) if known else None
            out.append([])
            continue
        between = between_rows(before, acting, kept, turning)
        follower, step = follower.row(t, between, readings)
        out[-1].append(_Row(between, readings, follower, step))
    return out


def _innovation(step: Step) -> float:
    """Logarithm of the likelihood of what a row read, an outlier clipped."""
    if not step.rows.size:
        return 0.0
    return _density(float(step.innovation @ step.inverse @ step.innovation), step.spread)


def _ways(run: Sequence[_Row]) -> Iterator[Sequence[_Row]]:
    """The rows of each forecast: that from which it starts, to that by which it is judged."""
    if not run:
        return
    unit, times = run[0].after.machine.unit, [row.after.t for row in run]
    at = times[0] + min(max((times[-1] - times[0]) / 3.0, _SOON * unit), _SETTLED * unit)
    while at + _AHEAD * unit <= times[-1]:
        yield run[bisect_left(times, at) : bisect_left(times, at + _AHEAD * unit) + 1]
        at += _EVERY * unit


def _forecast(way: Sequence[_Row]) -> float:
    """Logarithm of the likelihood of position and heading at the end, from the estimate at the start."""
    machine, now = way[0].after.machine, way[0].after
    model, step, acting = machine.traced.model, _LONGER * machine.settings.step, list[Array]()
    for row in way[1:]:
        acting.append(row.acting)
        if row is way[-1] or row.after.t - now.t >= step:
            now, _ = now.ahead(row.after.t, np.mean(acting, axis=0), step)
            acting.clear()
    readings = way[-1].readings
    rows = [k for k, name in enumerate(machine.channels) if name in _places(machine) and math.isfinite(readings[k])]
    if not rows:
        return 0.0
    expected, transposed = model.read(now.mean, way[-1].acting)
    slope, away = transposed.T[rows], model.wrapped(readings - expected)[rows]
    spread = slope @ now.cov @ slope.T + np.diag(model.noise[rows] ** 2)
    return _density(float(away @ inverse_of(spread) @ away), spread)


def _density(distance: float, spread: Array) -> float:
    _, size = np.linalg.slogdet(spread)
    return -0.5 * (min(distance, _MOST * len(spread)) + float(size))


def _sum(scores: Iterable[float]) -> float:
    total = sum(scores)
    return total if math.isfinite(total) else -math.inf


def _places(machine: Machine) -> tuple[str, ...]:
    return tuple(name for name in ("psi", "x", "y") if name in machine.channels)
