"""Ships against a chart: water for the keel under the whole hull, the safety contour, and charted dangers.

The three are apart: a ship may cross its safety contour with water under its keel, and a danger lies in water that is
deep around it.  Depths are those of the chart, without tide and squat: what the ship needs says the caller.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...core.errors import ChartError, RequestError
from ...core.values import dataclass
from ...environment.chart import Chart
from ..tracks import Tracks
from .geometry import Array, Bools

_STATIONS = 9
"""Points along each side of a hull at which the depth is read."""


@dataclass(frozen=True, eq=False)
class Grounding:
    """One ship over a chart in all runs; arrays of shape (...).

    Attributes:
        under_keel: least depth under the hull less the draught [m]; zero or below it is aground.
        safe: least depth under the hull less the safety depth [m]; below zero the safety contour is crossed.
        danger: least water above a danger within the hull less the draught [m]; infinite where there is none.
        t: time of the least depth [s].
    """

    under_keel: Array
    safe: Array
    danger: Array
    t: Array

    @property
    def fails(self) -> Bools:
        """Aground, or on a charted danger."""
        return (self.under_keel <= 0.0) | (self.danger <= 0.0)


def grounding(
    tracks: Tracks, chart: Chart, draughts: Sequence[float], safety: Sequence[float]
) -> tuple[Grounding, ...]:
    """Judge every ship against a chart.

    Args:
        tracks: in metres north and east of the datum of the chart.
        chart: with depths.
        draughts: of the ships, or of the first of them, squat and allowances included [m].
        safety: depth that each takes for safe, no less than its draught [m].

    Raises:
        ChartError: a chart without depths.
        RequestError: numbers that do not fit the ships.
    """
    if np.isinf(chart.depth) and not (chart.areas or chart.banks):
        raise ChartError(f"{chart.name}: no depths; grounding is judged on a chart with depth areas")
    count = len(draughts)
    fits = 0 < count == len(safety) <= len(tracks.L)
    if not fits or any(not 0.0 < d <= s for d, s in zip(draughts, safety, strict=True)):
        raise RequestError(f"{len(tracks.L)} ships have as many draughts at most, above zero, and as many safety "
                           "depths, no less")  # fmt: skip
    return tuple(_one(tracks, k, chart, draughts[k], safety[k]) for k in range(count))


def _one(tracks: Tracks, k: int, chart: Chart, draught: float, safety: float) -> Grounding:
    L, B = float(tracks.L[k]), float(tracks.B[k])
    t, (x, y, psi) = _followed(tracks.t, tracks.x[..., k, :], tracks.y[..., k, :], tracks.psi[..., k, :], 0.25 * L)
    c, s = np.cos(psi), np.sin(psi)
    depth = np.full(x.shape, np.inf)
    for along in np.linspace(-0.5 * L, 0.5 * L, _STATIONS):
        for across in (-0.5 * B, 0.0, 0.5 * B):
            north, east = x + along * c - across * s, y + along * s + across * c
            depth = np.minimum(depth, chart.depth_at(north.ravel(), east.ravel()).reshape(x.shape))
    danger = np.full(x.shape[:-1], np.inf)
    for spot in chart.dangers:
        north, east = spot.x - x, spot.y - y
        within = (np.abs(north * c + east * s) <= 0.5 * L) & (np.abs(east * c - north * s) <= 0.5 * B)
        danger = np.where(within.any(axis=-1), np.minimum(danger, spot.depth - draught), danger)
    least = depth.min(axis=-1)
    return Grounding(least - draught, least - safety, danger, t[depth.argmin(axis=-1)])


def _followed(t: Array, x: Array, y: Array, psi: Array, step: float) -> tuple[Array, tuple[Array, Array, Array]]:
    """Rows close enough that a ship moves no farther than `step` [m] from one to the next, straight between."""
    moved = float(np.hypot(np.diff(x, axis=-1), np.diff(y, axis=-1)).max())
    count = max(int(np.ceil(moved / step)), 1)
    at = np.arange((len(t) - 1) * count + 1) / count
    row = np.minimum(at.astype(int), len(t) - 2)
    share = at - row

    def between(rows: Array) -> Array:
        return rows[..., row] + share * (rows[..., row + 1] - rows[..., row])

    return between(t), (between(x), between(y), between(np.unwrap(psi)))
