"""Small drawings as plain SVG: axes with ticks, lines, points and texts.

A page has dozens of them; on the canvas of `figures` each takes fifty times as long and as many bytes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

import numpy as np

from ...data import Array
from .panels import GRID, INK, SOFT
from .ticks import labels, plain, rounded

_NAME = 16.0
"""Room that the name of the ordinate takes."""


class Frame:
    """Axes of one drawing."""

    def __init__(
        self, width: int, height: int, x: tuple[float, float], y: tuple[float, float], *, left: int, bottom: int
    ) -> None:
        self.x, self.y, self.left, self.top, self.bottom = x, y, left, 8, bottom
        self.width, self.height = width - left - 12, height - bottom - 8

    def at(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Place of a point on the drawing."""
        across = (x - self.x[0]) / (self.x[1] - self.x[0])
        return self.left + self.width * across, self.top + self.height * (
            1.0 - (y - self.y[0]) / (self.y[1] - self.y[0])
        )

    def holds(self, x: float, y: float) -> bool:
        """Whether a point lies within the axes."""
        return self.x[0] <= x <= self.x[1] and self.y[0] <= y <= self.y[1]

    def line(
        self, x: Iterable[float], y: Iterable[float], colour: str, *,
        width: float = 1.0, dash: str = "", fade: float = 1.0,
    ) -> str:  # fmt: skip
        """A line through points that are numbers."""
        pairs = [self.at(float(a), float(b)) for a, b in zip(x, y, strict=True) if math.isfinite(a + b)]
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in pairs)
        more = (f' stroke-dasharray="{dash}"' if dash else "") + (f' opacity="{fade:g}"' if fade < 1.0 else "")
        return f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{width}"{more}/>'

    def dot(self, x: float, y: float, colour: str, radius: float) -> str:
        """A filled circle."""
        a, b = self.at(x, y)
        return f'<circle cx="{a:.1f}" cy="{b:.1f}" r="{radius:g}" fill="{colour}"/>'

    def points(self, x: Array, y: Array, colour: str, radius: float) -> str:
        """Many points as one path; those beyond the axes stand on their edge."""
        kept = np.isfinite(x) & np.isfinite(y)
        a, b = self.at(np.clip(x[kept], *self.x), np.clip(y[kept], *self.y))
        side = f"h{2 * radius:g}v{2 * radius:g}h-{2 * radius:g}z"
        corners = zip((a - radius).tolist(), (b - radius).tolist(), strict=True)
        path = "".join(f"M{one:.1f} {two:.1f}{side}" for one, two in corners)
        return f'<path d="{path}" fill="{colour}" fill-opacity=".6"/>'

    def span(self, x: tuple[float, float], y: tuple[float, float], colour: str, fade: float = 1.0) -> str:
        """A filled rectangle."""
        (left, top), (right, low) = self.at(x[0], y[1]), self.at(x[1], y[0])
        return (f'<rect x="{left:.1f}" y="{top:.1f}" width="{right - left:.1f}" height="{low - top:.1f}" '
                f'fill="{colour}" opacity="{fade:g}"/>')  # fmt: skip

    def svg(self, parts: Sequence[str], x: str, y: str) -> str:
        """The drawing with its axes, ticks and names."""
        right = self.left + self.width
        return whole(right + 12, self.top + self.height + self.bottom, self.elements(parts, x, y))

    def elements(self, parts: Sequence[str], x: str, y: str, *, scale: bool = True) -> list[str]:
        """The same as elements of a larger drawing, with or without numbers along the ordinate."""
        right, low = self.left + self.width, self.top + self.height
        frame = [f'<path d="M{self.left} {self.top}V{low}H{right}" fill="none" stroke="{SOFT}"/>']
        across, up = rounded(*self.x), rounded(*self.y)
        for value, words in zip(across, plain(across), strict=True):
            a = self.at(value, self.y[0])[0]
            frame.append(label(a, low + 12, words, SOFT, anchor="middle"))
        numbers, power = labels(up, self.left - 4.0 - _NAME * bool(y))
        for value, words in zip(up, numbers, strict=True):
            b = self.at(self.x[0], value)[1]
            frame.append(f'<line x1="{self.left}" x2="{right}" y1="{b:.1f}" y2="{b:.1f}" stroke="{GRID}"/>')
            if scale:
                frame.append(label(self.left - 4, b + 3, words, SOFT, anchor="end"))
        middle = f"translate(10 {self.top + self.height / 2:.0f}) rotate(-90)"
        frame.append(label(self.left + 4, self.top + 2, power, SOFT) if power and scale else "")
        names = [label(self.left + self.width / 2, low + 25, x, INK, anchor="middle"),
                 f'<g transform="{middle}">{label(0, 0, y, INK, anchor="middle")}</g>']  # fmt: skip
        return [*frame, *parts, *names]


def label(x: float, y: float, words: str, colour: str, *, anchor: str = "start", weight: int = 400) -> str:
    """A text at a place of the drawing."""
    return (f'<text x="{x:.1f}" y="{y:.1f}" font-size="10" fill="{colour}" text-anchor="{anchor}" '
            f'font-weight="{weight}">{escape(words)}</text>')  # fmt: skip


def whole(width: float, height: float, parts: Sequence[str]) -> str:
    """Elements as one drawing."""
    return (f'<svg viewBox="0 0 {width:.0f} {height:.0f}" font-family="system-ui,sans-serif">'
            f'{"".join(parts)}</svg>')  # fmt: skip
