"""Bands of free-running predictions of a trial, and of manoeuvres in closed loop: draws, and edges that hold."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from statistics import NormalDist

import numpy as np

from ...core.values import dataclass, replace
from ...data import Array, Trial
from ...environment import CHANNELS, Weather
from ...manoeuvres import Policy
from ...models import STATES
from ...simulate.replay import Prepared, prepared
from ...study.grounds import kind_of
from ..posterior import Posterior
from .calibrating import mean_of, spread
from .calibration import Calibration
from .conformal import unsure
from .disturbance import Disturbance
from .indexing.loop import Loop
from .novel import acting
from .past import Past, disturbing
from .sailing import FreeRuns, Uncertain, check_traced, sailed

# Rows of each run at which draws are kept.
_ROWS = 200


@dataclass(frozen=True)
class Fan:
    """A prediction with bands.

    Attributes:
        predicted: by the fitted numbers.
        since: time since the start or the last restart [s], shape (rows,).
        half: half widths of x, y, psi, u, v_m, r, shape (rows, 6); NaN beyond the horizon at which bands hold.
        level: of 0 to 1.
        kind: of manoeuvre.
        notes: what a reader must know, one line each.
    """

    predicted: Trial
    since: Array
    half: Array
    level: float
    kind: str
    notes: tuple[str, ...]

    @property
    def edges(self) -> Mapping[str, tuple[Array, Array]]:
        """Lower and upper edge of each state, SI units, headings as unwrapped as the prediction's."""
        return {name: (self.predicted[name] - self.half[:, k], self.predicted[name] + self.half[:, k])
                for k, name in enumerate(STATES)}  # fmt: skip


def fan(
    held: Posterior, found: Calibration, trial: Trial, predicted: Trial, level: float, *, restart: float | None = None,
    draws: int = 1000, seed: int = 1, past: Past | None = None, plain: Calibration | None = None,
    begin: tuple[float, Array] | None = None, current: float = math.inf,
) -> Fan:  # fmt: skip
    """Bands around a prediction that starts, and restarts, in measured states, or with more that is known there.

    Args:
        held: posterior of the model.
        found: its calibration, of predictions that begin so.
        trial: with controls and wind.
        predicted: by `replay` with the same `restart` and `begin`, or by `past.carried`.
        level: of 0 to 1.
        restart: seconds between restarts.
        past: what the seconds before each start tell, as `past.carried` gives it.
        plain: calibration of starts without a past, for those that have none in `past`.
        begin: first start and state there, as of `replay`.
        current: standard deviation of each component of a current that was estimated [m/s].

    Raises:
        RequestError: too few recordings for the level.
        DataError: as of `replay`.
        ShipError: a model that cannot be disturbed.
    """
    kind, ready = kind_of(trial), prepared(held.ship, trial, restart=restart, begin=begin)
    known = replace(found, disturbance=disturbing(found.disturbance, current))
    at, width, novelty = _spread(held, known, ready, draws, seed, past)
    since, half = np.zeros(len(ready.t)), np.full((len(ready.t), len(STATES)), np.nan)
    for lane, (a, b) in enumerate(pairwise((*ready.starts, len(ready.t)))):
        since[a:b] = ready.t[a:b] - ready.t[a]
        own_width = np.column_stack([np.interp(since[a:b], at, column) for column in width[lane].T])
        by = plain if plain is not None and past is not None and past.seconds[lane] == 0.0 else found
        new = None if novelty is None else np.interp(since[a:b], at, novelty[lane])
        half[a:b] = by.half(since[a:b], own_width, kind, level, new)
    notes = _notes(found, kind, level, float(since.max(initial=0.0)))
    notes += () if past is None else _surprised(found, past, ready.t[list(ready.starts)])
    return Fan(predicted, since, half, level, kind, notes)


def _spread(
    held: Posterior, found: Calibration, ready: Prepared, draws: int, seed: int, past: Past | None = None
) -> tuple[Array, Array, Array | None]:
    """Times since the start [s], shape (rows,), spread of the draws there, shape (windows, rows, 6), and novelty."""
    every = ready.each * max(-(-(ready.steps - 1) // _ROWS), 1)
    own = whole(FreeRuns(ready.begun, ready.series, ready.dt / ready.each, every))
    who = replace(uncertain(held, found, draws, seed), past=past)
    runs = sailed(held.ship, own, who, seed)
    return own.t, spread(runs, found.noise), found.novelty(acting(held.ship, mean_of(runs), own), own.t)


def _surprised(found: Calibration, past: Past, t: Array) -> tuple[str, ...]:
    """A line where the past of a start is unlike that of every left-out trial."""
    odd = past.surprise > found.surprise
    if not odd.any():
        return ()
    worst = int(np.argmax(past.surprise))
    which = f"{int(odd.sum())} of {len(t)} starts" if len(t) > 1 else "the start"
    return (f"the past does not fit this model: innovations before {which} are up to {past.surprise[worst]:.2g} times "
            f"what the filter expects (before t = {t[worst]:.4g} s), in left-out trials at most {found.surprise:.2g}; "
            "another ship, load or trial, or a sensor at fault: do not rely on these bands",)  # fmt: skip


def scale_of(
    held: Posterior, found: Calibration, run: Trial, kind: str, level: float, *, draws: int = 200, seed: int = 1
) -> float:  # fmt: skip
    """How many times as far apart draws must be for the bands of a run to be the calibrated ones.

    The run is predicted by its own controls; the scale is the geometric mean over the calibrated horizons that it
    reaches and all states.

    Raises:
        RequestError: too few recordings for the level.
        ShipError: a model that cannot be disturbed.
    """
    at, width, novelty = _spread(held, found, prepared(held.ship, run, restart=None), draws, seed)
    h = found.left.horizons
    ahead = h[h <= max(min(found.reach(level), float(at[-1])), float(h[0]))]
    own = np.column_stack([np.interp(ahead, at, column) for column in width[0].T])
    new = None if novelty is None else np.interp(ahead, at, novelty[0])
    with np.errstate(divide="ignore"):
        ratio = np.log(found.half(ahead, own, kind, level, new) / (NormalDist().inv_cdf(0.5 * (1.0 + level)) * own))
    return float(np.exp(np.mean(ratio[np.isfinite(ratio)]))) if np.isfinite(ratio).any() else 1.0


def whole(lanes: FreeRuns) -> FreeRuns:
    """The lanes with their last inputs held until the last row is full."""
    short = -(lanes.series.shape[1] - 1) % lanes.every
    return replace(lanes, series=np.concatenate([lanes.series, np.repeat(lanes.series[:, -1:], short, axis=1)], axis=1))


def _notes(found: Calibration, kind: str, level: float, longest: float) -> tuple[str, ...]:
    lines = [*unsure(len(set(found.left.groups)), level)]
    reach, own = found.reach(level), found.reach(level, kind)
    kinds = found.factors(level).kinds[:-1]
    if longest > reach * (1.0 + 1e-6):
        lines.append(f"bands of {100 * level:g} % hold up to {reach:.4g} s from a start; none beyond (--restart "
                     f"{reach:.4g}, or seatrial calibrate MODEL --horizon {longest:.4g})")  # fmt: skip
    if kind not in kinds:
        lines.append(f"no left-out trial is of this kind ({kind}); they are {', '.join(kinds)}: the widest is taken")
    elif min(longest, reach) > own * (1.0 + 1e-6):
        lines.append(f"left-out trials of this kind ({kind}) go up to {own:.4g} s: other kinds stand for it beyond")
    return tuple(lines)


def uncertain(held: Posterior, found: Calibration, draws: int, seed: int) -> Uncertain:
    """What differs between draws of a calibrated ship; its factors count the errors of left-out trials already.

    So parameters are as unsure as in the fits that the factors are of, without what residuals add (`parts.widened`).
    """
    covariance = held.covariance if held.power is None else held.power.of(held.free, held.covariance)
    plain = replace(held, power=None, covariance=covariance)
    return Uncertain(held.names, plain.draws(draws, seed), found.noise, found.disturbance)


@dataclass(frozen=True)
class Runs:
    """A manoeuvre in closed loop, once by the fitted numbers and once by every draw.

    Attributes:
        t: [s], shape (rows,).
        stored: names of the columns: states, memory of actuators and policy, orders.
        fitted: shape (rows, columns).
        drawn: shape (draws, rows, columns); NaN or inf after one blows up.
        half: half widths of the states that hold at the level, shape (rows, 6); NaN beyond the calibrated horizon.
    """

    t: Array
    stored: tuple[str, ...]
    fitted: Array
    drawn: Array
    half: Array
    level: float

    @property
    def tracks(self) -> Array:
        """States of the draws, each away from the fitted run by so much that their spread is that of the bands.

        Where the calibration does not reach, the factor of its last horizon is kept.  Shape (draws, rows, 6).
        """
        middle, states = self.fitted[:, : len(STATES)], self.drawn[:, :, : len(STATES)]
        width = spread(states[:, None], np.zeros(len(STATES)))[0]
        with np.errstate(all="ignore"):
            factor = self.half / (NormalDist().inv_cdf(0.5 * (1.0 + self.level)) * width)
        factor = np.where(width > 0, factor, 1.0)
        last = int(np.flatnonzero(np.isfinite(factor).all(axis=1)).max(initial=0))
        factor[last + 1 :] = factor[last]
        return middle + factor * (states - middle)


def manoeuvre(
    held: Posterior, found: Calibration, policy: Policy, level: float, *, speed: float, duration: float, dt: float,
    weather: Weather, kind: str | None = None, draws: int = 1000, every: int | None = None, seed: int = 1,
) -> Runs:  # fmt: skip
    """Sail a manoeuvre with every draw, in one call of the kernel.

    Args:
        level: of the bands, 0 to 1.
        speed: initial speed ahead through the water [m/s].
        duration, dt: length and time step of each run [s].
        kind: of manoeuvre as `study.grounds.kind_of` names it; None takes that of the policy.
        every: steps between stored rows; None keeps some 200 rows.

    Raises:
        RequestError: too few recordings for the level.
        ShipError: a model that cannot be disturbed.
    """
    check_traced(held.ship)
    steps = round(duration / dt) + 1
    every = every or max(-(-(steps - 1) // _ROWS), 1)
    around = weather.series(dt, steps)[None]
    north, east = (around[0, 0, CHANNELS.index(name)] for name in ("current_x", "current_y"))
    start = np.array([[0.0, 0.0, 0.0, speed + north, east, 0.0]])
    loop = Loop(held.ship, policy, dt, around, start, every, every * -(-(steps - 1) // every) + 1)
    calm = Disturbance(tuple(replace(one, sigma=0.0) for one in found.disturbance.processes))
    own = replace(uncertain(held, found, draws, seed), start=np.zeros(len(STATES)))
    names = own.names
    middle = np.array([[float(value) for value in held.mean]])
    fitted = loop.run(names, middle, calm, seed)[0]
    drawn = loop.run(names, own.draws, own.disturbance, seed)
    t = dt * every * np.arange(fitted.shape[0])
    width = spread(drawn[:, None, :, : len(STATES)], np.zeros(len(STATES)))[0]
    channels = {"n_P": np.full(len(t), held.ship.n_P or np.nan), **dict(zip(loop.stored, fitted.T, strict=True))}
    channels |= {name: np.full(len(t), around[0, 0, CHANNELS.index(name)]) for name in ("wind_x", "wind_y")}
    novelty = found.novelty({name: column[None] for name, column in channels.items()}, t)
    half = found.half(t, width, kind or policy.kind, level, None if novelty is None else novelty[0])
    return Runs(t, loop.stored, fitted, drawn, half, level)
