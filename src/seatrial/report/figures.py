"""Figures of the pages as inline SVG: one canvas, one palette, tracks and time series.

Angles are drawn in degrees, all else in SI units.  Text stays text, so that the page can be searched and the file stays
small; lines differ in dashes and marks too, so that a page is readable without colour vision.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..data import Array, Trial, unwrapped
from ..models import unit
from ..validate import Comparison
from ..validate.metrics import pairs, segments
from .canvas.panels import BLUE, GREEN, GREY, GRID, INK, ORANGE, PINK, RULE, SKY, VERMILION, Axes, Figure
from .canvas.panels import SOFT as SOFT
from .canvas.svg import svg as svg

Styles = Mapping[str, tuple[str, Any]]
"""Colour and dashes by label."""

_POINTS = 600
_SIZE = (5.2, 4.6)
_WIDE = 1.25
TINT = "#eef2f5"
OCHRE = "#b07d00"  # an orange dark enough for text
LINES: tuple[tuple[str, Any, str], ...] = (
    (BLUE, "-", "o"), (VERMILION, (0, (6, 2)), "s"), (GREEN, (0, (3, 1.5)), "^"), (PINK, (0, (1, 1)), "D"),
    (ORANGE, (0, (6, 1.5, 1, 1.5)), "v"), (SKY, (0, (2, 2)), "P"),
)  # fmt: skip
"""Colour, dashes and mark of each line; the dashes and marks keep lines distinct in print without colour."""

BASELINE: tuple[str, Any] = (GREY, (0, (1, 1.5)))
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none", "font.family": "sans-serif", "font.size": 10, "axes.spines.top": False,
    "axes.spines.right": False, "axes.grid": True, "grid.color": GRID, "axes.edgecolor": "#9aa3ab",
    "axes.labelcolor": "#333", "xtick.color": "#555", "ytick.color": "#555", "legend.frameon": False,
    "legend.fontsize": 9, "axes.titlesize": 10, "axes.axisbelow": True, "path.simplify": True,
}  # fmt: skip
MOTION = (
    ("psi", "ψ [°]", math.degrees(1.0)), ("u", "u [m/s]", 1.0), ("v_m", "v_m [m/s]", 1.0),
    ("r", "r [°/s]", math.degrees(1.0)),
)  # fmt: skip
"""Heading, speeds and rate of turn: channel, axis label, factor from SI units."""
HEEL = (("phi", "φ [°]", math.degrees(1.0)), ("p", "p [°/s]", math.degrees(1.0)))
"""Heel and roll rate, where they are measured and predicted."""
_CONTROLS = (
    ("rad", "angle [°]", math.degrees(1.0)), ("1/s", "revs [1/s]", 1.0), ("N", "thrust [N]", 1.0),
    ("-", "order [-]", 1.0),
)  # fmt: skip
# Prefixes of what moves a ship; forces that a log measures have names of their own.
_MOVERS = ("delta", "alpha", "n", "f", "throttle")
_ROW = 1.15
# Least range of a control's axis, of its largest value: the noise of constant revolutions is no manoeuvre.
_STILL = 0.1


def line_styles(labels: Sequence[str], baseline: str) -> dict[str, tuple[str, Any]]:
    """Colour and dashes by label; the baseline is grey."""
    others = [label for label in labels if label != baseline]
    styles = {label: LINES[i % len(LINES)][:2] for i, label in enumerate(others)}
    return {**styles, baseline: BASELINE}


def track(comparisons: Sequence[Comparison], styles: Styles, name: str) -> str:
    """North over east of one trial, measured and predicted, at equal scale."""
    figure, (ax,) = canvas(1)
    measured = max(comparisons, key=lambda c: len(c.measured)).measured
    x, y = measured["x"], measured["y"]
    for c in comparisons:
        rows, gaps = _thin(c)
        east, north = c.predicted["y"][rows], c.predicted["x"][rows]
        color, dashes = styles[c.label]
        ax.plot(_broken(east, gaps), _broken(north, gaps), color=color, ls=dashes, lw=1.5, label=c.label)
    measured_track(ax, measured)
    _ship_ticks(ax, measured["psi"], x, y)
    ax.x.bins = ax.y.bins = 6
    frame(ax, [(c.predicted["y"], c.predicted["x"]) for c in comparisons], (y, x))
    legend_below(figure, ax)
    return svg(figure, f"track {name}")


def measured_track(ax: Axes, measured: Trial) -> None:
    """The measured track with its start, and the names of the axes: north over east."""
    x, y = measured["x"], measured["y"]
    step, first = _every(x.size), np.flatnonzero(np.isfinite(x + y))[:1]
    ax.plot(y[::step], x[::step], color=INK, lw=1.6, label="measured", zorder=2.5)
    ax.plot(y[first], x[first], "o", color=INK, ms=6, mfc="white", label="start", zorder=3)
    ax.set(xlabel="east y [m]", ylabel="north x [m]")


def motion_canvas(measured: Trial, more: int = 0) -> tuple[Figure, tuple[Axes, ...]]:
    """Panels for `MOTION` and `more` channels, and below them the controls: rudders, azimuths, revolutions.

    A control that is logged both as ordered and as it was is drawn as it was.
    """
    groups = [(label, factor, names) for kind, label, factor in _CONTROLS if (names := _controls(measured, kind))]
    motions = len(MOTION) + more
    rows = motions + len(groups)
    figure, axes = canvas(rows, (_SIZE[0], _ROW * rows))
    step = _every(len(measured))
    for ax, (label, factor, names) in zip(axes[motions:], groups, strict=True):
        for k, name in enumerate(names):
            colour, dashes, _ = LINES[k % len(LINES)]
            ax.plot(measured.t[::step], factor * measured[name][::step], color=colour if len(names) > 1 else INK,
                    ls=dashes, lw=1.2, label=name)  # fmt: skip
        low, high = ax.y.ends
        spare = max(_STILL * max(abs(low), abs(high)) - (high - low), 0.2 * (high - low))
        ax.set_ylim((low - 0.5 * spare, high + 0.5 * spare))
        ax.set_ylabel(f"{names[0]} {label[label.index('[') :]}" if len(names) == 1 else label)
        if len(names) > 1:
            ax.legend("beside", size=7.0)
        if all(name.startswith("delta") for name in names):
            low, high = ax.y.ends
            ax.set_ylim((min(low, -0.25 * high), max(high, -0.25 * low)))
            ax.axhline(0.0, color=RULE, lw=0.8, zorder=1)
            ax.text("stbd", 1.0)
            ax.text("port", 0.0)
    return figure, axes


def _controls(measured: Trial, kind: str) -> list[str]:
    """Controls of a trial in this unit, port to starboard where numbered."""
    known = [name for name in measured.channels if name.partition("_")[0] in _MOVERS and unit(name) == kind]
    kept = [name for name in known if name.removesuffix("_cmd") == name or name.removesuffix("_cmd") not in known]
    return sorted(name for name in kept if np.isfinite(measured[name]).any())


def measured_motion(ax: Axes, measured: Trial, channel: str, factor: float) -> Array:
    """One measured channel over time, the heading continuous; returns what is drawn."""
    values = factor * (unwrapped(measured[channel]) if channel == "psi" else measured[channel])
    step = _every(values.size)
    ax.plot(measured.t[::step], values[::step], color=INK, lw=1.3, zorder=2.5)
    return values


def series(comparisons: Sequence[Comparison], styles: Styles, name: str) -> str:
    """Heading, speeds and rate of turn of one trial over time, heel and roll rate where they are predicted."""
    measured = max(comparisons, key=lambda c: len(c.measured)).measured
    heel = tuple(one for one in HEEL if any(one[0] in c.metrics for c in comparisons))
    figure, axes = motion_canvas(measured, len(heel))
    for ax, (channel, label, factor) in zip(axes, (*MOTION, *heel), strict=False):
        curves: list[Array] = []
        for c in comparisons:
            if channel not in c.metrics:
                continue
            rows, gaps = _thin(c)
            values = factor * pairs(c.measured, c.predicted, c.restart)[channel][1]
            curves.append(values)
            color, dashes = styles[c.label]
            t, drawn = _broken(c.measured.t[rows], gaps), _broken(values[rows], gaps)
            ax.plot(t, drawn, color=color, ls=dashes, lw=1.3)
        if channel in measured and np.isfinite(measured[channel]).any():
            ax.set_ylim(_limits(measured_motion(ax, measured, channel, factor), curves))
        ax.set_ylabel(label)
    axes[-1].set_xlabel("time t [s]")
    return svg(figure, f"series {name}")


def horizon(
    curves: Mapping[str, Mapping[float, float]], styles: Styles, what: str
) -> str:
    """One error over the time since the restart, a line for each label; both axes logarithmic."""
    figure, (ax,) = canvas(1, (5.2, 3.4))
    largest = max(max(points.values()) for points in curves.values())
    for label, points in curves.items():
        # Rounding errors around zero would stretch the axis over many decades.
        ends = [end for end in sorted(points) if points[end] > 1e-6 * largest]
        color, dashes = styles[label]
        values = [points[end] for end in ends]
        ax.plot(ends, values, color=color, ls=dashes, lw=1.6, marker="o", ms=3.5, label=label)
    ax.set(xscale="log", yscale="log")
    ticks = sorted({end for points in curves.values() for end in points})
    ax.set_xticks(ticks, [f"{end:g}" for end in ticks])
    ax.set(xlabel="time since restart, each point from the one before to [s]", ylabel=what)
    ax.legend()
    return svg(figure, f"horizon {what}")


def convergence(history: Array) -> str:
    """Objective, and validation where there is one, over the iterations of a fit."""
    figure, (ax,) = canvas(1, (5.2, 3.4))
    ax.plot(history[:, 0], history[:, 1], color=LINES[0][0], lw=1.6, label="objective")
    if np.isfinite(history[:, 2]).any():
        ax.plot(history[:, 0], history[:, 2], color=LINES[1][0], ls=LINES[1][1], lw=1.6, label="validation")
    if np.nanmin(history[:, 1]) > 0:
        ax.set_yscale("log")
    ax.set(xlabel="iteration", ylabel="loss [-]")
    ax.legend()
    return svg(figure, "convergence")


def lines(
    title: str, x: str, y: str, drawn: Sequence[tuple[str, Array, Array]], *, equal: bool = False
) -> str:  # fmt: skip
    """Several lines over named axes; `equal` for tracks, whose axes then have one scale."""
    figure, (ax,) = canvas(1)
    for k, (label, along, up) in enumerate(drawn):
        colour, dashes, _ = LINES[k % len(LINES)]
        width, fade = (1.6, 1.0) if k < len(LINES) else (1.0, 0.6)
        ax.plot(along[:: _every(along.size)], up[:: _every(along.size)], color=colour, ls=dashes, lw=width,
                alpha=fade, label=label)  # fmt: skip
    ax.set(xlabel=x, ylabel=y)
    if equal:
        ax.set_aspect("equal", adjustable="datalim")
    if len(drawn) > 1:
        ax.legend()
    return svg(figure, title)


def canvas(rows: int, size: tuple[float, float] = _SIZE) -> tuple[Figure, tuple[Axes, ...]]:
    """A figure, and its panels one above the other over one abscissa."""
    figure, axes = panels(rows, 1, size)
    return figure, tuple(axes[:, 0])


def panels(rows: int, columns: int, size: tuple[float, float], *, shared: bool = True) -> tuple[Figure, Any]:
    """A figure, and its panels, shape (rows, columns); `shared`: a column over one abscissa."""
    figure = Figure(rows, columns, size, shared=shared)
    return figure, figure.grid


def legend_below(figure: Figure, ax: Axes) -> None:
    """A legend under the panels, with as many columns as its longest label leaves room for."""
    longest = max((len(one.label) for one in ax.named), default=0)
    columns = next(count for count, length in ((3, 15), (2, 28), (1, longest)) if longest <= length)
    figure.legend(ax.named, columns)


def rows_of(figure: Figure, ax: Axes, names: Sequence[str], what: str, columns: int) -> None:
    """Name the rows of a drawing of marks from the top, and its abscissa; a legend below."""
    ax.set_yticks(range(len(names)), names)
    ax.set(ylim=(len(names) - 0.5, -0.5), xlabel=what)
    figure.legend(ax.named, columns)


def _every(samples: int) -> int:
    return max(1, math.ceil(samples / _POINTS))


def _thin(c: Comparison) -> tuple[Any, Any]:
    """Rows to draw, and where among them a new prediction begins."""
    segment = segments(c.measured.t, c.restart)
    starts = np.flatnonzero(np.diff(segment)) + 1
    rows = np.unique(np.concatenate([np.arange(0, segment.size, _every(segment.size)), starts, starts - 1]))
    return rows, np.flatnonzero(np.diff(segment[rows])) + 1


def _broken(values: Array, gaps: Any) -> Array:
    return np.insert(values, gaps, np.nan)


def _ship_ticks(ax: Axes, psi: Array, x: Array, y: Array) -> None:
    """A short line over the bow at some fifteen places of the measured track."""
    rows = np.flatnonzero(np.isfinite(x + y + psi))
    rows = rows[:: max(1, rows.size // 15)]
    length = 0.05 * max(float(np.nanmax(x) - np.nanmin(x)), float(np.nanmax(y) - np.nanmin(y)))
    for i in rows:
        ends_x, ends_y = length * math.cos(psi[i]), length * math.sin(psi[i])
        line = [y[i], y[i] + ends_y], [x[i], x[i] + ends_x]
        ax.plot(*line, color="#8a929a", lw=5, zorder=1.5)


def frame(ax: Axes, others: Sequence[tuple[Array, Array]], truth: tuple[Array, Array]) -> None:
    """Equal scale with the whole of `truth` in view, and of the others what stays near; each abscissa, ordinate."""
    ax.set_aspect("equal", adjustable="box")
    size = max(float(np.nanmax(v) - np.nanmin(v)) for v in truth)
    ranges = [_limits(truth[i], [o[i] for o in others], size) for i in (0, 1)]
    # Widen the narrow direction, so that the frame keeps its shape at equal scale.
    half = 0.5 * max((ranges[0][1] - ranges[0][0]) / _WIDE, ranges[1][1] - ranges[1][0])
    east, north = (0.5 * (low + high) for low, high in ranges)
    ax.set(xlim=(east - _WIDE * half, east + _WIDE * half), ylim=(north - half, north + half))


def _limits(truth: Array, others: Sequence[Array], size: float | None = None) -> tuple[float, float]:
    """Range of the measurement and of the predictions, as far as they stay near it."""
    low, high = float(np.nanmin(truth)), float(np.nanmax(truth))
    reach = 0.6 * (high - low if size is None else size) or 1.0
    ends = [low, high]
    for values in others:
        if np.isfinite(values).any():
            ends += [max(float(np.nanmin(values)), low - reach), min(float(np.nanmax(values)), high + reach)]
    margin = 0.05 * (max(ends) - min(ends)) or 0.5
    return min(ends) - margin, max(ends) + margin
