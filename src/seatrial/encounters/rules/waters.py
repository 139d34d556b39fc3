"""A ship by the rules that ask of it alone: safe speed, narrow channels, separation schemes, water under the keel.

Rules 5 and 7 ask what a watch knows, which tracks do not tell: they are not judged.  Margins are those of `checks`.
While a ship acts for another one it may be off its side of a channel or a lane (Rules 2, 8); its keel is never excused.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from ...core.errors import ChartError, RequestError
from ...core.values import dataclass, field
from ...environment.chart import Chart, inside, nearest, offshore
from ..tracks import Tracks
from .geometry import Array, Bools, wrapped
from .grounding import grounding
from .limits import Limits
from .verdict import Judged

AGROUND, CONTOUR = "grounding", "safety contour"
"""What a ship can fail by beside the rules: aground or on a danger, and across the contour that it takes for safe."""


@dataclass(frozen=True, eq=False)
class Waters:
    """Where and in what visibility encounters are met.

    Attributes:
        chart: with depths; None in open water.
        draught: of the own ship, squat and allowances included [m].
        safety: depth that it takes for safe [m]; None: no contour is judged.
        visibility: [m]; infinite in sight of one another.
        U: speed at which the ship's stopping distance is that of `Limits.stopping` [m/s].
    """

    chart: Chart | None = None
    draught: float = 0.0
    safety: float | None = None
    visibility: float = np.inf
    U: float = np.inf

    def __post_init__(self) -> None:
        if self.chart is not None and not 0.0 < self.draught <= (self.draught if self.safety is None else self.safety):
            raise RequestError(f"a draught of {self.draught:g} m and a safety depth of {self.safety or 0.0:g} m; the "
                               "draught is above zero, and the depth no less")  # fmt: skip
        if self.chart is not None and np.isinf(self.chart.depth) and not (self.chart.areas or self.chart.banks):
            raise ChartError(f"{self.chart.name}: no depths; grounding is judged on a chart with depth areas")

    @property
    def restricted(self) -> bool:
        """Whether ships are out of sight of one another (Rule 19)."""
        return bool(np.isfinite(self.visibility))


OPEN_WATER = Waters()
"""No land, no depth, and in sight of one another."""


@dataclass(frozen=True, eq=False)
class Alone:
    """The own ship by itself in all runs.

    Attributes:
        margins: by rule, `AGROUND` and `CONTOUR` among them; NaN where it does not apply; shape (...).
    """

    margins: Mapping[str, Array] = field(default_factory=dict[str, Array])

    def broken(self, where: tuple[int, ...] = ()) -> tuple[str, ...]:
        """What is not kept in one run."""
        return tuple(rule for rule, margin in self.margins.items() if margin[where] < 0.0)


def alone(tracks: Tracks, judged: Sequence[Judged], waters: Waters, limits: Limits | None = None) -> Alone:
    """Judge the own ship, the first of the tracks, by itself.

    Args:
        tracks: in metres north and east of the datum of the chart.
        judged: the own ship towards the others, whose action for them excuses it.
    """
    limits = limits or Limits()
    found: dict[str, Array] = {}
    if waters.restricted:
        found["6"] = safe_speed(tracks, waters, limits)
    if waters.chart is not None:
        free = ~_acting(tracks, judged, limits)
        found |= {"9(a)": narrow_channel(tracks, waters.chart, free, limits),
                  "10": separation(tracks, waters.chart, free, limits)}  # fmt: skip
        (keel,) = grounding(tracks, waters.chart, [waters.draught], [waters.safety or waters.draught])
        found[AGROUND] = np.minimum(keel.under_keel, keel.danger) / waters.draught
        found[AGROUND] = np.where(keel.fails, np.minimum(found[AGROUND], -1e-9), found[AGROUND])
        if waters.safety is not None:
            found[CONTOUR] = keel.safe / waters.safety
    return Alone(MappingProxyType({rule: one for rule, one in found.items() if np.isfinite(one).any()}))


def safe_speed(tracks: Tracks, waters: Waters, limits: Limits) -> Array:
    """Rule 6: a speed at which the ship stops within a share `sight` of the visibility, at all times.

    It stops within `stopping` of its lengths from the speed `U`, and as the square of the speed from another, as
    resistance and propeller brake with the square.
    """
    U = _speed(tracks).max(axis=-1)
    reach = limits.stopping.value * float(tracks.L[0]) * (U / waters.U) ** 2
    return limits.sight.value * waters.visibility / np.maximum(reach, 1e-9) - 1.0


def narrow_channel(tracks: Tracks, chart: Chart, free: Bools, limits: Limits) -> Array:
    """Rule 9(a): along a channel, a ship is on the starboard side of its axis, no more than half a breadth beyond it.

    The axis is a fairway or recommended track of the chart; a ship is in its channel within `channel` of it, and goes
    along it one way or the other within `flow`; NaN where it never is.
    """
    x, y, psi = (one[..., 0, :] for one in (tracks.x, tracks.y, tracks.psi))
    far = float(limits.channel.of(np.array(tracks.L[0])))
    margin = np.full(x.shape, np.inf)
    for axis in chart.fairways:
        off, toward_n, toward_e = nearest(axis, x.ravel(), y.ravel())
        across = offshore(axis, x.ravel(), y.ravel()).reshape(x.shape)
        # the axis runs with its water to starboard: a quarter turn to port of the way from it to the ship
        side = np.where(across > 0.0, -1.0, 1.0)
        n, e = side * toward_n.reshape(x.shape), side * toward_e.reshape(x.shape)
        way = wrapped(psi - np.arctan2(-n, e))
        along = np.abs(np.sin(way)) < np.sin(limits.flow.value)
        here = (off.reshape(x.shape) <= far) & (off.reshape(x.shape) > 0.0) & along & free
        kept = (across * np.sign(np.cos(way)) + 0.5 * float(tracks.B[0])) / far
        margin = np.where(here, np.minimum(margin, kept), margin)
    return _least(margin)


def separation(tracks: Tracks, chart: Chart, free: Bools, limits: Limits) -> Array:
    """Rule 10(b) and (c): in a lane with its traffic, within `flow`, or across it at `crossing` from it or more.

    NaN where the ship is in no lane that has a direction.
    """
    x, y, psi = (one[..., 0, :] for one in (tracks.x, tracks.y, tracks.psi))
    margin = np.full(x.shape, np.inf)
    for lane in chart.lanes:
        if np.isnan(lane.alpha):
            continue
        here = inside(lane.outline, x.ravel(), y.ravel()).reshape(x.shape) & free
        off = np.abs(wrapped(psi - lane.alpha))
        least = limits.crossing.value
        kept = np.maximum(1.0 - off / limits.flow.value, np.minimum(off, np.pi - off) / least - 1.0)
        margin = np.where(here, np.minimum(margin, kept), margin)
    return _least(margin)


def _acting(tracks: Tracks, judged: Sequence[Judged], limits: Limits) -> Bools:
    """Rows in which the own ship acts for another one, and comes back to its course once that is past and clear."""
    rows = np.arange(len(tracks.t))
    back = limits.window.value * tracks.L[0] / np.maximum(_speed(tracks)[..., :1], 0.1)
    found = np.zeros(tracks.x[..., 0, :].shape, dtype=bool)
    for one in judged:
        if one.ship == 0:
            off = np.abs(one.own.course) >= limits.detectable.value
            late = tracks.t - tracks.t[one.met.ends][..., None]
            coming = (late > 0.0) & (late <= back) & np.logical_and.accumulate(off | (late <= 0.0), axis=-1)
            found |= one.own.exists[..., None] & (rows >= one.own.row[..., None]) & (
                one.met.during(len(rows)) | coming)  # fmt: skip
    return found


def _speed(tracks: Tracks) -> Array:
    """Of the own ship over ground [m/s], shape (..., rows)."""
    return np.hypot(tracks.u[..., 0, :], tracks.v_m[..., 0, :])


def _least(margin: Array) -> Array:
    """Over the rows; NaN where none counts."""
    least = margin.min(axis=-1)
    return np.where(np.isfinite(least), least, np.nan)
