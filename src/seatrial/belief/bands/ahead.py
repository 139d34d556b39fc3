"""How far predictions are off, and how often their bands hold, so many seconds ahead, by kind of manoeuvre.

Each trial is cut into windows that start in the measured state.  The fitted numbers predict it, and so does every draw
of the parameters, from a start that is off by the noise of the instruments, as the reading at the end is; at each
horizon the error and whether the measurement lies within the band of the draws are kept.  Nothing else widens the
bands: where they hold less often than they say, the model lacks something.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import values
from ...data import Array, Trial
from ...models import STATES
from ...ships import Ship
from ...simulate.lanes import Kernel, Lanes, Steps, run
from ...simulate.loop import open_loop, open_loop_parameters
from ...simulate.replay import Prepared, prepared
from .held import SHARES, Windows, read_at

# Lanes are sailed in groups of so many stored numbers and inputs, 64 MB.
_STORED = 8_000_000


def ahead(
    ship: Ship, trial: Trial, kind: str, names: Sequence[str], draws: Array, restart: float,
    noise: Mapping[str, float], level: float = 0.95,
) -> Windows:  # fmt: skip
    """Errors and bands of a trial at horizons that are `SHARES` of a window.

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
            measured[k, :, j] = read_at(at, ready.t, column)
    own = np.array([values(ship.model)[name] for name in names])
    sigma, rng = np.array([noise.get(name, 0.0) for name in STATES]), np.random.default_rng(1)
    starts = rng.standard_normal((len(draws) + 1, len(ready.starts), len(STATES))) * sigma
    starts[0] = 0.0  # the fitted numbers start in the reading
    found = _sailed(ship, ready, names, np.vstack([own, draws]), rows, starts)
    found[1:] += rng.standard_normal(found[1:].shape) * sigma
    low, high = _edges(found[1:], level)
    known = np.isfinite(measured) & np.isfinite(found[0])
    inside, error, half = (np.where(known, one, np.nan) for one in (
        (measured >= low) & (measured <= high), found[0] - measured, 0.5 * (high - low)))  # fmt: skip
    return Windows(kind, rows * ready.dt, error, half, inside)


def _edges(drawn: Array, level: float) -> tuple[Array, Array]:
    """Lower and upper edge of the draws that arrived, as one that blew up takes no band from the others; NaN of none.

    Args:
        drawn: shape (draws, windows, horizons, 6).
    """
    arrived = np.isfinite(drawn)
    some = arrived.any(axis=0)
    known = np.where(some, np.where(arrived, drawn, np.nan), 0.0)
    edges = np.nanquantile(known, (0.5 * (1 - level), 0.5 * (1 + level)), axis=0)
    low, high = np.where(some, edges, np.nan)
    return low, high


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
