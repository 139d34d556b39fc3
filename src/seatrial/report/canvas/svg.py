"""Panels as plain SVG: what they need of room is reckoned from the length of their texts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from hashlib import sha256
from html import escape
from typing import Any

import numpy as np

from ...data import Array
from ..figure_data import with_data
from .panels import BLUE, GRID, INK, SKY, SOFT, Area, Axes, Figure, Line, Look

_At = Callable[..., tuple[Array, Array]]
_Box = tuple[float, float, float, float]
_EDGE, _NUMBER, _NAME = "#9aa3ab", "#555", "#333"
_POINT = 72.0
_LETTER = 0.6
"""Width of a letter, of its height."""
_KEY = 22.0
"""Length of a line in a legend [pt]."""
# Marks by the steps of a path about their point, in halves of their size; those of a circle are its parts of that.
_MARKS: dict[str, tuple[tuple[float, float], ...]] = {
    "o": ((1.0, 1.0),), ".": ((0.5, 0.5),), "s": ((-0.9, -0.9), (1.8, 0.0), (0.0, 1.8), (-1.8, 0.0)),
    "^": ((0.0, -1.0), (1.0, 2.0), (-2.0, 0.0)), "v": ((0.0, 1.0), (1.0, -2.0), (-2.0, 0.0)),
    "D": ((0.0, -1.2), (1.2, 1.2), (-1.2, 1.2), (-1.2, -1.2)),
    "P": ((-0.35, -1.0), (0.7, 0.0), (0.0, 0.65), (0.65, 0.0), (0.0, 0.7), (-0.65, 0.0), (0.0, 0.65), (-0.7, 0.0),
          (0.0, -0.65), (-0.65, 0.0), (0.0, -0.7), (0.65, 0.0)),
    "x": ((-0.8, -0.8), (1.6, 1.6), (-0.8, -0.8), (0.8, -0.8), (-1.6, 1.6)),
}  # fmt: skip


def svg(figure: Figure, salt: str) -> str:
    """The figure as it goes into a page, with its numbers; `salt` keeps the names within it apart from others'."""
    width, height = (_POINT * side for side in figure.size)
    parts: list[str] = []
    rows, columns = figure.grid.shape
    named, most = figure.key or ([], 1)
    most = max(1, min(most, int(width / _key_wide(named, 9.0))))
    floor = height - (8.0 + 13.0 * math.ceil(len(named) / most) if named else 0.0)
    sides = [_sides(figure.grid[:, column].tolist(), (floor / rows, width / columns)) for column in range(columns)]
    across = (width - sum(left + right for left, right in sides)) / columns
    heads, feet = ([max(map(room, row)) for row in figure.grid] for room in (_head, _foot))
    up = (floor - sum(heads) - sum(feet)) / rows
    x = 0.0
    for column, (left, right) in enumerate(sides):
        y = 0.0
        for row, ax in enumerate(figure.grid[:, column]):
            y += heads[row]
            tall = up if ax.rows == 1 else floor - heads[0] - feet[-1]
            if ax.shown:
                parts += _panel(ax, (x + left, y, across, tall), x + 9.0, salt)
            y += up + feet[row]
        x += left + across + right
    parts += _keys(named, most, (0.5 * width, floor), 9.0, centred=True)
    drawn = (f'<svg viewBox="0 0 {width:.0f} {height:.0f}" font-family="sans-serif" font-size="10">'
             f'{"".join(parts)}</svg>')  # fmt: skip
    return with_data(drawn, figure)


def _wide(texts: Iterable[str], size: float = 10.0) -> float:
    return max((_LETTER * size * len(one) for one in texts), default=0.0)


def _head(ax: Axes) -> float:
    """Room above a panel [pt]."""
    power = bool(ax.y.marked(100.0, 20.0)[1])
    return 4.0 + 16.0 * bool(ax.title) + 9.0 * (power and not ax.title)


def _foot(ax: Axes) -> float:
    """Room below a panel [pt]."""
    return 4.0 if not ax.numbered else 18.0 + 14.0 * bool(ax.x.name)


def _sides(panels: Sequence[Axes], share: tuple[float, float]) -> tuple[float, float]:
    """Room to the left and to the right of a column of panels [pt]."""
    shown = [ax for ax in panels if ax.shown]
    numbers = [label for ax in shown for _, label in ax.y.marked(share[0], 1.5 * ax.y.size)[0]]
    left = _wide(numbers, max((ax.y.size for ax in shown), default=10.0)) + 8.0
    left += 14.0 * any(ax.y.name for ax in shown)
    right = max((_wide([one.text for one in ax.texts], 7.0) for ax in shown), default=0.0)
    beside = [_KEY + 12.0 + _wide([one.label for one in ax.named], ax.key[2])
              for ax in shown if ax.key and ax.key[0] == "beside"]  # fmt: skip
    return left, max([right, *beside]) + 10.0


def _panel(ax: Axes, box: _Box, name_at: float, salt: str) -> list[str]:
    left, top, width, height = box
    x, y = ax.x.ends, ax.y.ends
    if ax.equal == "datalim":
        x, y = _widened(x, y, width / height)
    elif ax.equal:
        scale = min(width / (x[1] - x[0]), height / (y[1] - y[0]))
        own = scale * (x[1] - x[0]), scale * (y[1] - y[0])
        left, top, width, height = left + 0.5 * (width - own[0]), top + 0.5 * (height - own[1]), *own
    ends = [[float(end) for end in axis.place(np.array(pair))] for axis, pair in ((ax.x, x), (ax.y, y))]

    def at(a: Any, b: Any, across: str = "") -> tuple[Array, Array]:
        one, two = ((value if across == name else (axis.place(value) - first) / (last - first))
                    for name, value, axis, (first, last) in (("x", a, ax.x, ends[0]), ("y", b, ax.y, ends[1])))
        return left + width * np.asarray(one, dtype=float), top + height * (1.0 - np.asarray(two, dtype=float))

    right, low = left + width, top + height
    mark = "c" + sha256(f"{salt} {left:.1f} {top:.1f} {width:.1f} {height:.1f}".encode()).hexdigest()[:10]
    drawn = [(one.look.get("zorder", 1.0), _area(one, at)) for one in ax.areas]
    drawn += [(one.look.get("zorder", 2.0), _line(one, at)) for one in ax.lines]
    inner = "".join(part for _, part in sorted(drawn, key=lambda pair: pair[0]))
    parts = [f'<clipPath id="{mark}"><rect x="{left - 2:.1f}" y="{top - 2:.1f}" width="{width + 4:.1f}" '
             f'height="{height + 4:.1f}"/></clipPath>', *_scales(ax, at, (left, top, right, low), (x, y)),
             f'<g clip-path="url(#{mark})">{inner}</g>',
             f'<path d="M{left:.1f} {top:.1f}V{low:.1f}H{right:.1f}" fill="none" stroke="{_EDGE}" stroke-width=".8"/>',
             _text((left + right) / 2, top - 6.0, ax.title, _NAME, "middle")]  # fmt: skip
    if ax.y.name:
        parts.append(f'<g transform="translate({name_at + (left - box[0]):.1f} {(top + low) / 2:.1f}) rotate(-90)">'
                     f'{_text(0, 0, ax.y.name, _NAME, "middle", ax.y.size)}</g>')  # fmt: skip
    for one in ax.texts:
        at_height = low - one.height * height + 7.0 * (one.height > 0.5)
        parts.append(_text(right + 4.0, at_height, one.text, SOFT, "start", 7.0))
    if ax.key and ax.named:
        parts += _legend(ax, at, (left, top, right, low))
    return parts


def _widened(x: tuple[float, float], y: tuple[float, float], shape: float) -> tuple[tuple[float, float], ...]:
    """Limits of equal scale in a box of this ratio of width to height, about the same middles."""
    half = 0.5 * max(x[1] - x[0], shape * (y[1] - y[0]))
    (a, b), (c, d) = x, y
    return (0.5 * (a + b) - half, 0.5 * (a + b) + half), (0.5 * (c + d) - half / shape, 0.5 * (c + d) + half / shape)


def _scales(ax: Axes, at: _At, box: _Box, ends: Any) -> list[str]:
    """Grid, numbers and the name of the abscissa."""
    left, top, right, low = box
    x, y = replace(ax.x, given=ends[0]), replace(ax.y, given=ends[1])
    parts: list[str] = []
    several = x.ticks is None and x.scale == "linear"
    values, power = x.marked(right - left, 45.0 if several else 30.0)
    for value, words in values:
        (a,), _ = at(np.array([value]), np.array([ends[1][0]]))
        parts.append(_stroke(a, top, a, low) if ax.grid_shown else "")
        parts.append(_text(a, low + 12.0, words, _NUMBER, "middle", x.size) if ax.numbered else "")
    if power and ax.numbered:
        parts.append(_text(right, low + 24.0, power, _NUMBER, "end", 8.0))
    if ax.numbered:
        parts.append(_text(0.5 * (left + right), low + 27.0, ax.x.name, _NAME, "middle"))
    values, power = y.marked(low - top, 1.5 * y.size)
    for value, words in values:
        _, (b,) = at(np.array([ends[0][0]]), np.array([value]))
        parts.append(_stroke(left, b, right, b) if ax.grid_shown else "")
        parts.append(_text(left - 4.0, b + 0.35 * y.size, words, _NUMBER, "end", y.size))
    if power:
        parts.append(_text(left, top - 3.0, power, _NUMBER, "start", 8.0))
    return parts


def _stroke(a: float, b: float, c: float, d: float) -> str:
    return f'<path d="M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" stroke="{GRID}" stroke-width=".8"/>'


def _text(x: float, y: float, words: str, colour: str, anchor: str, size: float = 10.0) -> str:
    if not words:
        return ""
    at = f'<text x="{x:.1f}" y="{y:.1f}" fill="{colour}" text-anchor="{anchor}"'
    sized = "" if size == 10.0 else f' font-size="{size:g}"'
    return f"{at}{sized}>{escape(words)}</text>"


def _area(one: Area, at: _At) -> str:
    path = "".join(f"M{_path(*at(x, y, one.across))}z" for x, y in one.parts)
    return f'<path d="{path}" fill="{one.look.get("color", SKY)}"{_fade(one.look)}/>' if path else ""


def _line(one: Line, at: _At) -> str:
    a, b = at(one.x, one.y, one.across)
    known = np.isfinite(a) & np.isfinite(b)
    parts: list[str] = []
    if one.dashes is not None:
        ends = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]))).reshape(-1, 2)
        parts.append(_stroked(one, "".join(f"M{_path(a[i:j], b[i:j])}" for i, j in ends.tolist() if j > i + 1)))
    if one.mark:
        parts.append(_marked(one, a[known], b[known]))
    return "".join(parts)


def _path(a: Array, b: Array) -> str:
    """A path to a tenth of a point: where it begins, and its steps, which take fewer letters."""
    points = np.round(np.column_stack([a, b]), 1)
    steps = np.round(np.diff(points, axis=0), 1)
    told = " ".join(f"{x:g} {y:g}" for x, y in steps[(steps != 0.0).any(axis=1)].tolist())
    return f"{points[0, 0]:g} {points[0, 1]:g}l{told or '0 0'}"


def _stroked(one: Line, path: str) -> str:
    if not path:
        return ""
    width = one.look.get("lw", 1.5)
    dashes = " ".join(f"{width * part:.3g}" for part in one.dashes or ())
    return (f'<path d="{path}" fill="none" stroke="{one.look.get("color", BLUE)}" stroke-width="{width:g}" '
            f'stroke-linejoin="round"{f" stroke-dasharray={chr(34)}{dashes}{chr(34)}" if dashes else ""}'
            f'{_fade(one.look)}/>')  # fmt: skip


def _marked(one: Line, a: Array, b: Array) -> str:
    half = 0.5 * one.look.get("ms", 6.0)
    shape = _shape(one.mark, half)
    path = "".join(f"M{x:.1f} {y:.1f}{shape}" for x, y in zip(a.tolist(), b.tolist(), strict=True))
    colour = one.look.get("color", BLUE)
    face = "none" if one.mark == "x" else one.look.get("mfc", colour)
    edge = one.look.get("mew", 0.0 if one.mark == "." else 1.0)
    look = f'fill="{face}" stroke="{colour}" stroke-width="{edge:g}"{_fade(one.look)}'
    return f'<path d="{path}" {look}/>' if path else ""


def _shape(mark: str, half: float) -> str:
    """A mark of this half size as the path that follows its point."""
    steps = _MARKS[mark]
    if len(steps) == 1:
        r = half * steps[0][0]
        return f"m{-r:.3g} 0a{r:.3g} {r:.3g} 0 1 0 {2 * r:.3g} 0a{r:.3g} {r:.3g} 0 1 0 {-2 * r:.3g} 0z"
    return "m" + "l".join(f"{half * x:.3g} {half * y:.3g}" for x, y in steps) + "z" * (mark != "x")


def _fade(look: Look) -> str:
    alpha = look.get("alpha", 1.0)
    return f' opacity="{alpha:g}"' if alpha < 1.0 else ""


def _legend(ax: Axes, at: _At, box: _Box) -> list[str]:
    """Names beside the panel, or in that corner of it which has the fewest points."""
    where, columns, size = ax.key or ("best", 1, 9.0)
    left, top, right, low = box
    step = size + 4.0
    high = step * math.ceil(len(ax.named) / columns)
    if where == "beside":
        return _keys(ax.named, columns, (right + 6.0, 0.5 * (top + low - high)), size)
    wide = columns * _key_wide(ax.named, size)
    corners = [(x, y) for y in (top + 2.0, low - high - 4.0) for x in (right - wide, left + 6.0)]
    placed = [np.column_stack(at(one.x, one.y, one.across)) for one in ax.lines] + [
        np.column_stack(at(x, y, one.across)) for one in ax.areas for x, y in one.parts]  # fmt: skip
    points = np.concatenate([np.empty((0, 2)), *placed])

    def covered(corner: tuple[float, float]) -> int:
        inside = (points >= corner) & (points <= (corner[0] + wide, corner[1] + high))
        return int(inside.all(axis=1).sum())

    return _keys(ax.named, columns, min(corners, key=covered), size)


def _key_wide(named: Sequence[Line | Area], size: float) -> float:
    return _KEY + 16.0 + _wide([one.label for one in named], size)


def _keys(
    named: Sequence[Line | Area], columns: int, corner: tuple[float, float], size: float, *, centred: bool = False
) -> list[str]:  # fmt: skip
    """A sample and the name of each, row by row."""
    columns = max(1, min(columns, len(named)))
    wide = _key_wide(named, size)
    left = corner[0] - 0.5 * columns * wide if centred else corner[0]
    parts: list[str] = []
    for k, one in enumerate(named):
        x, y = left + wide * (k % columns), corner[1] + (size + 4.0) * (k // columns + 0.7)

        def at(a: Any, b: Any, _across: str = "", x: float = x, y: float = y) -> tuple[Array, Array]:
            return x + _KEY * np.asarray(a, dtype=float), y - 7.0 * np.asarray(b, dtype=float)

        if isinstance(one, Area):
            corners = np.array([0.0, 1.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0, 1.0])
            parts.append(_area(Area((corners,), one.look), at))
        else:
            parts.append(_line(Line(np.array([0.0, 1.0]), np.array([0.4, 0.4]), {**one.look, "marker": ""}), at))
            parts.append(_line(Line(np.array([0.5]), np.array([0.4]), {**one.look, "ls": "none"}), at))
        parts.append(_text(x + _KEY + 4.0, y, one.label, INK, "start", size))
    return parts
