"""How far predictions are off, and how often their bands hold, so many seconds ahead, by kind of manoeuvre.

Each trial is cut into windows that start in the measured state.  The fitted numbers predict it, and so does every draw
of the parameters, from a start that is off by the noise of the instruments, as the reading at the end is; at each
horizon the error and whether the measurement lies within the band of the draws are kept.  Nothing else widens the
bands: where they hold less often than they say, the model lacks something.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.parameters import values
from ..data import Array, Trial
from ..models import STATES
from ..ships import Ship
from ..simulate.lanes import Kernel, Lanes, Steps, run
from ..simulate.loop import open_loop, open_loop_parameters
from ..simulate.replay import Prepared, prepared

SHARES = (0.1, 0.5, 1.0)
"""Horizons as shares of the time between restarts."""

GROUPS: Mapping[str, tuple[str, ...]] = {"position": ("x", "y"), "heading": ("psi",), "speeds": ("u", "v_m", "r")}
"""States whose bands are counted together."""

# Lanes are sailed in groups of so many stored numbers and inputs, 64 MB.
_STORED = 8_000_000


@dataclass(frozen=True)
class Ahead:
    """Windows of one trial at the horizons; NaN where a window ends before, or nothing was measured.

    Attributes:
        name, kind: of the trial.
        horizons: [s], shape (horizons,).
        error: predicted by the fitted numbers minus measured, shape (windows, horizons, 6).
        inside: whether the measurement lies within the band, 1 or 0, of the same shape.
    """

    name: str
    kind: str
    horizons: Array
    error: Array
    inside: Array


@dataclass(frozen=True)
class Row:
    """Windows of one kind at one horizon.

    Attributes:
        horizon: [s].
        windows, trials: their numbers.
        error: root mean square of the distance [m], heading [rad], surge, sway [m/s] and yaw rate [rad/s].
        held: share of the measurements within their bands by group.
    """

    kind: str
    horizon: float
    windows: int
    trials: int
    error: Mapping[str, float]
    held: Mapping[str, float]


def ahead(
    ship: Ship, trial: Trial, kind: str, names: Sequence[str], draws: Array, restart: float,
    noise: Mapping[str, float], level: float = 0.95,
) -> Ahead:  # fmt: skip
    """Errors and bands of a trial.

    Args:
        kind: of manoeuvre.
        names: paths of the parameters that differ between draws.
        draws: shape (draws, names).
        restart: length of a window [s].
        noise: standard deviation of each state's readings.
        level: of the bands.

    Raises:
        DataError: as of `replay`.
    """
    ready = prepared(ship, trial, restart=restart)
    rows = np.maximum(np.round(np.array(SHARES) * restart / ready.dt).astype(np.intp), 1)
    measured = np.full((len(ready.starts), len(rows), len(STATES)), np.nan)
    for k, row in enumerate(ready.starts):
        at = ready.t[row] + rows * ready.dt
        for j, column in enumerate(ready.state.T):
            measured[k, :, j] = np.interp(at, ready.t, column, right=np.nan)
    own = np.array([values(ship.model)[name] for name in names])
    sigma, rng = np.array([noise.get(name, 0.0) for name in STATES]), np.random.default_rng(1)
    starts = rng.standard_normal((len(draws) + 1, len(ready.starts), len(STATES))) * sigma
    starts[0] = 0.0  # the fitted numbers start in the reading
    found = _sailed(ship, ready, names, np.vstack([own, draws]), rows, starts)
    found[1:] += rng.standard_normal(found[1:].shape) * sigma
    low, high = np.quantile(found[1:], (0.5 * (1 - level), 0.5 * (1 + level)), axis=0)
    known = np.isfinite(measured) & np.isfinite(found[0])
    inside = np.where(known, (measured >= low) & (measured <= high), np.nan)
    return Ahead(trial.name, kind, rows * ready.dt, np.where(known, found[0] - measured, np.nan), inside)


def _sailed(
    ship: Ship, ready: Prepared, names: Sequence[str], draws: Array, rows: NDArray[np.intp], starts: Array
) -> Array:
    """States of every draw and window so many rows after its start, shape (draws, windows, horizons, 6).

    Args:
        starts: what each start is off by, shape (draws, windows, 6).
    """
    kernel, windows, steps = Kernel(open_loop(ship), tuple(names)), len(ready.starts), int(rows[-1]) + 1
    series, parameters = ready.series[:, : steps * ready.each], open_loop_parameters(ship)
    stored, grid = steps * len(kernel.system.stored), Steps.between(ready.dt, min(steps, ready.steps), ready.each)
    group = max(_STORED // (windows * (stored + series.shape[1] * series.shape[2])), 1)
    out: list[Array] = []
    for low in range(0, len(draws), group):
        some = draws[low : low + group]
        many = len(some)
        begun = np.tile(ready.begun, (many, 1))
        begun[:, : len(STATES)] += starts[low : low + group].reshape(-1, len(STATES))
        acting, own = np.tile(series, (many, 1, 1)), np.repeat(some, windows, axis=0)
        memory = None if ready.memory is None else np.tile(ready.memory, (many, 1))
        found = run(Lanes(kernel, parameters, begun, acting, memory, own), grid, None).values
        at = np.minimum(rows, found.shape[1] - 1)
        out.append(found[:, at, : len(STATES)].reshape(many, windows, len(rows), len(STATES)))
    return np.concatenate(out)


def by_kind(found: Iterable[Ahead]) -> tuple[Row, ...]:
    """Errors and coverage by kind of manoeuvre and horizon, all kinds together last."""
    every = list(found)
    kinds = dict.fromkeys(sorted(one.kind for one in every))
    parts = [(kind, [one for one in every if one.kind == kind]) for kind in kinds]
    parts += [(ALL, every)] if len(parts) > 1 else []
    return tuple(row for kind, some in parts for row in _rows(kind, some))


ALL = "all kinds"


def _rows(kind: str, found: Sequence[Ahead]) -> Iterable[Row]:
    for k in range(len(SHARES)):
        error = np.concatenate([one.error[:, k] for one in found])
        inside = np.concatenate([one.inside[:, k] for one in found])
        here = np.isfinite(error).any(axis=1)
        trials = sum(bool(np.isfinite(one.error[:, k]).any()) for one in found)
        if not trials:
            continue
        square = _mean(error[here] ** 2)
        sizes = {"position": float(np.sqrt(square[0] + square[1])), "heading": float(np.sqrt(square[2])),
                 **{name: float(np.sqrt(square[STATES.index(name)])) for name in GROUPS["speeds"]}}  # fmt: skip
        held = {name: float(_mean(inside[here][:, [STATES.index(one) for one in some]].reshape(-1, 1))[0])
                for name, some in GROUPS.items()}  # fmt: skip
        yield Row(kind, float(np.median([one.horizons[k] for one in found])), int(here.sum()), trials, sizes, held)


def _mean(found: Array) -> Array:
    """Mean of each column over its numbers; NaN of a column without any."""
    count = np.isfinite(found).sum(axis=0)
    return np.where(count > 0, np.nansum(found, axis=0), np.nan) / np.maximum(count, 1)
