"""Pictures of a notebook: tracks with outlines of the ship, channels over time, residuals of a fit.

Each is drawn on axes of the caller, in the caller's style, or on new axes in the style of the reports.  Tracks are
north up at equal scale; angles are in degrees; every axis has its unit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

import numpy as np

from ..data import Array, DataError, Trial, unwrapped
from ..identify.diagnosis.findings import Diagnosis
from ..models import unit
from ..report.figures import GREY, GRID, LINES, RULE, STYLE
from ..validate.metrics import segments

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.typing import ColorType

_STANDARD: tuple[tuple[str, ...], ...] = (("psi",), ("u",), ("v_m",), ("r",))
_ROW, _WIDTH = 1.5, 6.4
# The outline of a ship in its length ahead of midship and its half breadth to starboard.
_OUTLINE = np.array([[-0.5, -0.9], [-0.46, -1.0], [0.28, -1.0], [0.42, -0.6], [0.5, 0.0],
                     [0.42, 0.6], [0.28, 1.0], [-0.46, 1.0], [-0.5, 0.9], [-0.5, -0.9]])  # fmt: skip
# Breadth of a ship whose breadth is not known, of its length.
_SLENDER = 1.0 / 6.0
# An outline shorter than this share of the track cannot be seen; it is drawn larger, as the legend says.
_LEAST = 0.05
# Letters across new axes.
_LETTERS = 80.0
# Two sigma of white residuals.
_BAND = 2.0


def track(
    trial: Trial, ax: Axes | None = None, *, label: str | None = None, outlines: int = 12, breadth: float | None = None
) -> Axes:  # fmt: skip
    """North over east of one trial, with its start and outlines of the ship; see `Trial.plot`.

    Args:
        breadth: of the ship [m]; None takes that of an ordinary ship of its length.
    """
    if not {"x", "y"} <= set(trial.channels):
        raise DataError(f"{trial.name}: no position x, y; plot_series draws channels over time")
    x, y = trial["x"], trial["y"]
    known = np.flatnonzero(np.isfinite(x + y))
    if not known.size:
        raise DataError(f"{trial.name}: no row has a position; plot_series draws channels over time")
    new = ax is None
    ax = _made(1, _shape(x[known], y[known]))[0] if ax is None else ax
    (line,) = ax.plot(_broken(trial, y), _broken(trial, x), label=trial.name if label is None else label)
    colour = line.get_color()
    ax.plot(y[known[:1]], x[known[:1]], "o", ms=6, mfc="white", color=colour, label="start" if new else None, zorder=3)
    if outlines > 0 and "psi" in trial:
        _outlines(ax, trial, outlines, breadth, colour, named=new)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set(xlabel="east y [m]", ylabel="north x [m]")
    if new:
        _north(ax)
        ax.legend(loc="best")
    return ax


def series(
    trial: Trial, rows: Sequence[str | Sequence[str]] = (), axes: Axes | Sequence[Axes] | None = None, *,
    label: str | None = None,
) -> Sequence[Axes]:  # fmt: skip
    """Channels of one trial over time, a row each or several of one unit in a row; see `Trial.plot_series`."""
    asked = [(row,) if isinstance(row, str) else tuple(row) for row in rows] or _usual(trial)
    if not asked:
        raise DataError(f"{trial.name}: no channel to draw; it has {', '.join(trial.channels) or 'none'}")
    drawn = _axes(len(asked), axes)
    for ax, names in zip(drawn, asked, strict=True):
        symbols = {trial.unit(name) for name in names}
        if len(symbols) > 1:
            told = ", ".join(f"{name} [{trial.unit(name)}]" for name in names)
            raise DataError(f"{trial.name}: {told} in one row; a row has one unit")
        for name in names:
            named = label if len(names) == 1 else f"{label} {name}" if label else name
            ax.plot(_broken(trial, trial.t), _broken(trial, _in_degrees(trial, name)), label=named)
        symbol = symbols.pop().replace("rad", "deg")
        ax.set_ylabel(f"{', '.join(names)} [{symbol}]")
        if len(names) > 1 or (label and ax is drawn[0]):
            ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0, ncols=4, frameon=False)
    drawn[-1].set_xlabel("time t [s]")
    return drawn


def residuals(found: Diagnosis, axes: Axes | Sequence[Axes] | None = None) -> Sequence[Axes]:
    """Residuals over the sensor noise of each channel, trial after trial; those of a right model stay in the band.

    Names of trials that have no room are replaced by their numbers in ``found.residuals``.

    Args:
        found: what the residuals of a fit say, see `Fit.diagnosis`.
        axes: axes to draw on, one a channel; None makes new ones.
    """
    drawn, ends = _axes(len(found.channels), axes), _places(found)
    for ax, (name, told) in zip(drawn, found.channels.items(), strict=True):
        ax.axhspan(-_BAND, _BAND, color=GRID, zorder=0)
        for k, (trial, one) in enumerate(found.residuals.items()):
            if name in one.values:
                ax.plot(one.t - one.t[0] + ends[trial], one.values[name], ".", ms=2.5, color=LINES[k % 2][0])
            ax.axvline(ends[trial], color=RULE, lw=0.8, zorder=0.5)
        noise = math.degrees(told.noise) if unit(name).startswith("rad") else told.noise
        ax.set_ylabel(f"{name} / noise [-]")
        ax.text(1.0, 1.01, f"sensor noise {noise:.2g} {unit(name).replace('rad', 'deg')}, "
                f"residuals {float(f'{told.size:.2g}'):g} times", ha="right", va="bottom", fontsize="small", color=GREY,
                transform=ax.transAxes)  # fmt: skip
    for trial, begin in _named(ends, found).items():
        drawn[0].annotate(trial, (begin, 1.0), (3, -3), xycoords=("data", "axes fraction"), va="top",
                          textcoords="offset points", fontsize="small", color=GREY,
                          bbox={"fc": "white", "ec": "none", "pad": 1.0, "alpha": 0.8})  # fmt: skip
    drawn[-1].set_xlabel("time in the trials, one after the other [s]")
    return drawn


def _named(places: dict[str, float], found: Diagnosis) -> dict[str, float]:
    """Names of the trials where they have room, else their numbers in that order, else nothing; with their places."""
    lengths = [float(one.t[-1] - one.t[0]) for one in found.residuals.values()]
    shares = [length / max(sum(lengths), 1e-300) for length in lengths]
    for names in (list(places), [str(k + 1) for k in range(len(places))]):
        if all(len(name) <= _LETTERS * share for name, share in zip(names, shares, strict=True)):
            return dict(zip(names, places.values(), strict=True))
    return {}


def _places(found: Diagnosis) -> dict[str, float]:
    """Where each trial begins on one axis of time [s]."""
    begin, out = 0.0, dict[str, float]()
    for trial, one in found.residuals.items():
        out[trial] = begin
        begin += float(one.t[-1] - one.t[0])
    return out


def _made(rows: int, size: tuple[float, float]) -> Sequence[Axes]:
    """New axes one above the other, in the style of the reports; a notebook shows the figure."""
    try:
        from cycler import cycler
        from matplotlib import pyplot, rc_context
    except ImportError:
        raise ImportError("pictures need the extra 'plots': pip install 'seatrial[plots]'") from None

    # The first figure sets up the backend, which must not be undone with the style.
    figure = pyplot.figure(figsize=size, layout="constrained")
    with rc_context({**STYLE, "axes.prop_cycle": cycler(color=[colour for colour, _, _ in LINES])}):
        axes = figure.subplots(rows, 1, sharex=True, squeeze=False)
    return cast("Sequence[Axes]", tuple(axes[:, 0]))


def _shape(x: Array, y: Array) -> tuple[float, float]:
    """Size of a figure that suits a track, within limits."""
    north, east = float(np.ptp(x)), float(np.ptp(y))
    ratio = min(max(east / max(north, 1e-9), 0.9), 1.6)
    return (_WIDTH, _WIDTH / ratio) if ratio > 1.0 else (_WIDTH * ratio, _WIDTH)


def _axes(rows: int, given: Axes | Sequence[Axes] | None) -> Sequence[Axes]:
    """Axes for so many rows: those given, or new ones."""
    if given is None:
        return _made(rows, (_WIDTH, max(_ROW * rows, 2.4)))
    several = tuple(np.ravel(np.array(given, dtype=object)))
    if len(several) != rows:
        raise DataError(f"{len(several)} axes for {rows} rows; give as many")
    return several


def _usual(trial: Trial) -> list[tuple[str, ...]]:
    """Heading, speeds and rate of turn as far as they are there, then the controls, those of one unit together."""
    rows = [row for row in _STANDARD if row[0] in trial]
    controls: dict[str, list[str]] = {}
    for name in trial.channels:
        if name.partition("_")[0] in ("delta", "alpha", "n", "f") and not name.endswith("_cmd"):
            controls.setdefault(trial.unit(name), []).append(name)
    return [*rows, *(tuple(names) for names in controls.values())]


def _in_degrees(trial: Trial, name: str) -> Array:
    given = unwrapped(trial[name]) if name == "psi" else trial[name]
    return np.degrees(given) if trial.unit(name).startswith("rad") else given


def _broken(trial: Trial, values: Array) -> Array:
    """Values with a gap before each restart of a prediction, where its state leaps to the measured one."""
    restart = trial.meta.get("restart")
    if not isinstance(restart, int | float) or not len(trial):
        return values
    return np.insert(values, np.flatnonzero(np.diff(segments(trial.t, restart))) + 1, np.nan)


def _outlines(
    ax: Axes, trial: Trial, count: int, breadth: float | None, colour: ColorType, *, named: bool
) -> None:  # fmt: skip
    """Outlines of the ship at even distances along the track, in true size where they can be seen."""
    x, y, psi = trial["x"], trial["y"], trial["psi"]
    length = float(trial.meta.get("L_pp") or 0.0)
    known = np.flatnonzero(np.isfinite(x + y + psi))
    if not length or known.size < 2:
        return
    extent = max(float(np.ptp(x[known])), float(np.ptp(y[known])), length)
    times = max(1, math.ceil(_LEAST * extent / length))
    way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x[known]), np.diff(y[known])))])
    places = known[np.unique(np.searchsorted(way, np.linspace(0.0, way[-1], count)))]
    ahead, aside = times * length * _OUTLINE[:, 0], 0.5 * times * (breadth or _SLENDER * length) * _OUTLINE[:, 1]
    size = "true size" if times == 1 else f"{times} times its size"
    for k, i in enumerate(places):
        c, s = math.cos(psi[i]), math.sin(psi[i])
        ax.fill(y[i] + s * ahead + c * aside, x[i] + c * ahead - s * aside, fc=colour, ec=colour, alpha=0.25, lw=0.8,
                label=f"outline, {size}" if named and k == 0 else None, zorder=1.5)  # fmt: skip


def _north(ax: Axes) -> None:
    """An arrow to the north in a corner."""
    ax.annotate("", (0.04, 0.93), (0.04, 0.83), xycoords="axes fraction", textcoords="axes fraction",
                arrowprops={"arrowstyle": "->", "color": GREY})  # fmt: skip
    ax.text(0.04, 0.935, "N", transform=ax.transAxes, ha="center", va="bottom", color=GREY)
