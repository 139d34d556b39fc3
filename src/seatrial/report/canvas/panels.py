"""Panels of lines, marks and areas over named axes; `svg` draws them.

Its calls have the names and units of Matplotlib (inches of a figure, points of a line), which whoever adds a figure
knows.  That library takes .3 s for a figure of a page, and the fit of a ship .6 s; this takes milliseconds.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, TypedDict, Unpack

import numpy as np

from ...core.values import dataclass, field
from ...data import Array
from .ticks import alone, labels, logarithmic, rounded

# Okabe and Ito's palette.
BLUE, VERMILION, GREEN, PINK, ORANGE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"
INK, SOFT, GREY, RULE, GRID = "#111", "#5d6871", "#8a8a8a", "#b5bcc2", "#e4e7ea"
_MARGIN = 0.05
"""Part of the range of the data that an axis leaves free on either side."""
_DASHES = {"-": (), "--": (3.7, 1.6), "none": None, "None": None}
MARKS = ("o", ".", "s", "^", "v", "D", "P", "x")


class Look(TypedDict, total=False):
    """How a line or an area looks: colour, dashes, width [pt], marks with size and face, opacity, name, depth."""

    color: str
    ls: Any
    lw: float
    marker: str
    ms: float
    mfc: str
    mew: float
    alpha: float
    label: str | None
    zorder: float


@dataclass(frozen=True)
class Line:
    """A line or marks through points; a rule lies across the panel at one value of `across`, and is no data."""

    x: Array
    y: Array
    look: Look
    across: str = ""

    @property
    def label(self) -> str:
        """Its name in the legend; empty, or with a leading underscore, for none."""
        return self.look.get("label") or ""

    @property
    def mark(self) -> str:
        """Its mark; empty for none."""
        return self.look.get("marker") or ""

    @property
    def dashes(self) -> Sequence[float] | None:
        """Strokes and gaps in widths of the line; None without a line."""
        style = self.look.get("ls", "-")
        return _DASHES[style] if isinstance(style, str) else style[1]


@dataclass(frozen=True)
class Area:
    """Filled polygons, or a span across the panel between two values of `across`."""

    parts: tuple[tuple[Array, Array], ...]
    look: Look
    across: str = ""

    @property
    def label(self) -> str:
        """As of a line."""
        return self.look.get("label") or ""


@dataclass(frozen=True)
class Words:
    """A text beside the panel, at a height of its own."""

    text: str
    height: float


@dataclass
class Axis:
    """One axis of a panel; panels over one abscissa share it."""

    name: str = ""
    scale: str = "linear"
    knee: float = 1.0
    bins: int = 0
    whole: bool = False
    size: float = 10.0
    given: tuple[float | None, float | None] = (None, None)
    ticks: Sequence[tuple[float, str]] | None = None
    seen: list[Array] = field(default_factory=list[Array])

    def place(self, values: Any) -> Any:
        """Values as their scale has them: a logarithm, or one beyond the knee (of a width of 1.5) to either side."""
        if self.scale == "log":
            return np.log10(np.maximum(values, 1e-300))
        if self.scale == "symlog":
            size = np.abs(values) / self.knee
            return np.sign(values) * np.where(size <= 1.0, 1.5 * size, 1.5 + np.log10(np.maximum(size, 1.0)))
        return np.asarray(values, dtype=float)

    @property
    def ends(self) -> tuple[float, float]:
        """The values at its ends: those given, else those of the data with a margin."""
        low, high = self.given
        if low is None or high is None:
            own = self._reach()
            low, high = own[0] if low is None else low, own[1] if high is None else high
        return low, high

    def _reach(self) -> tuple[float, float]:
        every = np.concatenate([np.empty(0), *(np.ravel(one) for one in self.seen)])
        every = every[np.isfinite(every) & ((every > 0.0) | (self.scale != "log"))]
        low, high = (float(every.min()), float(every.max())) if every.size else (0.1, 1.0)
        if self.scale == "log":
            spare = (high / low) ** _MARGIN if high > low else 10.0**0.5
            return low / spare, high * spare
        spare = _MARGIN * (high - low) if high > low else 0.055 * abs(low) or 0.055
        return low - spare, high + spare

    def marked(self, length: float, letters: float) -> tuple[list[tuple[float, str]], str]:
        """Numbers along an axis of some length, with room for one each `letters`; and the power of ten of them all."""
        low, high = sorted(self.ends)
        if self.ticks is not None:
            return [(value, label) for value, label in self.ticks if low <= value <= high], ""
        bins = self.bins or max(2, min(9, int(length / letters)))
        values = logarithmic(low, high, bins) if self.scale == "log" else rounded(low, high, bins, self.whole)
        while self.scale == "linear" and not self.whole and len(values) < 2 and high > low:  # one number is no scale
            bins += 1
            values = rounded(low, high, bins)
        said, power = ([alone(one) for one in values], "") if self.scale == "log" else labels(values)
        return list(zip(values, said, strict=True)), power


class Axes:
    """One panel."""

    def __init__(self, x: Axis) -> None:
        self.x, self.y, self.title, self.grid_shown, self.shown = x, Axis(), "", True, True
        self.equal, self.rows, self.numbered = "", 1, True
        self.lines: list[Line] = []
        self.areas: list[Area] = []
        self.texts: list[Words] = []
        self.key: tuple[str, int, float] | None = None

    def plot(self, x: Any, y: Any, style: str = "", **look: Unpack[Look]) -> None:
        """A line, or marks where the style is one."""
        if style in MARKS:
            look = {**look, "marker": style, "ls": "none"}
        elif style:
            look = {**look, "ls": style}
        across, up = (np.atleast_1d(np.asarray(one, dtype=float)) for one in (x, y))
        self._add(Line(across, up, look))

    def _add(self, line: Line) -> None:
        self.lines.append(line)
        if line.across != "x":
            self.x.seen.append(line.x)
        if line.across != "y":
            self.y.seen.append(line.y)

    def step(self, x: Array, y: Array, **look: Unpack[Look]) -> None:
        """A line that holds each value until the next, as an order does."""
        self.plot(np.repeat(x, 2)[1:], np.repeat(y, 2)[:-1], **look)

    def errorbar(self, x: Any, y: Any, reach: Any, **look: Unpack[Look]) -> None:
        """A line with a bar to both sides of each point, where it has a reach."""
        self.plot(x, y, **look)
        for at, middle, half in zip(x, y, reach, strict=True):
            if half > 0.0:
                self.plot([at, at], [middle - half, middle + half], color=look.get("color", INK), lw=1.0)

    def axhline(self, y: float, **look: Unpack[Look]) -> None:
        """A rule at a height."""
        self._add(Line(np.array([0.0, 1.0]), np.array([y, y]), look, "x"))

    def axvline(self, x: float, **look: Unpack[Look]) -> None:
        """A rule at an abscissa."""
        self._add(Line(np.array([x, x]), np.array([0.0, 1.0]), look, "y"))

    def axhspan(self, low: float, high: float, **look: Unpack[Look]) -> None:
        """A band between two heights."""
        self._fill(((np.array([0.0, 1.0, 1.0, 0.0]), np.array([low, low, high, high])),), look, "x")

    def axvspan(self, low: float, high: float, **look: Unpack[Look]) -> None:
        """A band between two abscissas."""
        self._fill(((np.array([low, high, high, low]), np.array([0.0, 0.0, 1.0, 1.0])),), look, "y")

    def fill(self, x: Any, y: Any, **look: Unpack[Look]) -> None:
        """A polygon."""
        self._fill(((np.asarray(x, dtype=float), np.asarray(y, dtype=float)),), look)

    def fill_between(self, x: Array, low: Array, high: Array, **look: Unpack[Look]) -> None:
        """What lies between two lines, with a gap where one of them has one."""
        known = np.isfinite(x) & np.isfinite(low) & np.isfinite(high)
        ends = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]])))
        self._fill(tuple((np.concatenate([x[a:b], x[a:b][::-1]]), np.concatenate([high[a:b], low[a:b][::-1]]))
                         for a, b in ends.reshape(-1, 2).tolist()), look)  # fmt: skip

    def stairs(self, values: Array, edges: Array, *, fill: bool, **look: Unpack[Look]) -> None:
        """A histogram, as an area or as its outline."""
        x, y = np.repeat(edges, 2), np.concatenate([[0.0], np.repeat(values, 2), [0.0]])
        if fill:
            self._fill(((x, y),), look)
        else:
            self.plot(x, y, **look)
        self.y.seen.append(np.array([0.0]))

    def _fill(self, parts: tuple[tuple[Array, Array], ...], look: Look, across: str = "") -> None:
        self.areas.append(Area(parts, look, across))
        for x, y in parts:
            if across != "x":
                self.x.seen.append(x)
            if across != "y":
                self.y.seen.append(y)

    def text(self, words: str, height: float) -> None:
        """A word to the right of the panel, at a part of its height."""
        self.texts.append(Words(words, height))

    def set(self, **what: Any) -> None:
        """Names, limits, scales and title: `xlabel`, `ylim`, `yscale`, `title`, `aspect`."""
        for key, value in what.items():
            getattr(self, f"set_{key}")(value)

    def set_xlabel(self, name: str) -> None:
        self.x.name = name

    def set_ylabel(self, name: str) -> None:
        self.y.name = name

    def set_title(self, title: str) -> None:
        self.title = title

    def set_xlim(self, ends: tuple[float | None, float | None]) -> None:
        self.x.given = ends

    def set_ylim(self, ends: tuple[float | None, float | None]) -> None:
        self.y.given = ends

    def set_xscale(self, scale: str, knee: float = 1.0) -> None:
        self.x.scale, self.x.knee = scale, knee

    def set_yscale(self, scale: str) -> None:
        self.y.scale = scale

    def set_xticks(self, places: Iterable[float], words: Iterable[str]) -> None:
        self.x.ticks = tuple(zip(map(float, places), words, strict=True))

    def set_yticks(self, places: Iterable[float], words: Iterable[str]) -> None:
        self.y.ticks = tuple(zip(map(float, places), words, strict=True))

    def set_aspect(self, aspect: str, adjustable: str = "box") -> None:
        """Equal scale along both axes, by a smaller box or by wider limits (`datalim`)."""
        self.equal = adjustable if aspect == "equal" else ""

    def legend(self, where: str = "best", columns: int = 1, size: float = 9.0) -> None:
        """Name the lines in the emptiest corner, or `beside` the panel."""
        self.key = where, columns, size

    @property
    def named(self) -> list[Line | Area]:
        """What has a name, in the order of drawing."""
        return [one for one in (*self.areas, *self.lines) if one.label and not one.label.startswith("_")]


class Figure:
    """Panels in rows and columns, of so many inches; `shared`: a column over one abscissa."""

    def __init__(self, rows: int, columns: int, size: tuple[float, float], *, shared: bool) -> None:
        self.size, self.shared = size, shared
        self.grid = np.empty((rows, columns), dtype=object)
        for column in range(columns):
            axis = Axis()
            for row in range(rows):
                self.grid[row, column] = Axes(axis if shared else Axis())
                self.grid[row, column].numbered = not shared or row == rows - 1
        self.key: tuple[list[Line | Area], int] | None = None

    @property
    def axes(self) -> list[Axes]:
        """The panels that are shown, row by row."""
        return [ax for ax in self.grid.ravel() if ax.shown]

    def tall(self, column: int) -> Axes:
        """The panel of a column over the height of all rows."""
        first, *others = self.grid[:, column]
        first.rows, first.numbered = len(others) + 1, True
        for ax in others:
            ax.shown = False
        return first

    def legend(self, named: list[Line | Area], columns: int) -> None:
        """Name these below all panels."""
        self.key = named, columns
