"""The numbers behind a drawing, kept inside it until the page makes a link of them.

They travel as a compressed CSV in the drawing's `<metadata>`: a figure is drawn in one place and captioned in another,
and the data have to be those that were drawn.
"""

from __future__ import annotations

import base64
import gzip
import re
from collections.abc import Iterator
from typing import Any

import numpy as np

_KEPT = re.compile(r"<metadata>([A-Za-z0-9+/=]+)</metadata>")
_DIGITS = 5


def with_data(svg: str, figure: Any) -> str:
    """The drawing with the numbers of the figure inside; as it is where the figure has none."""
    rows = "".join(_rows(figure))
    if not rows:
        return svg
    packed = base64.b64encode(gzip.compress(f"panel,series,x,y\n{rows}".encode(), 6, mtime=0)).decode()
    end = svg.index(">") + 1
    return f"{svg[:end]}<metadata>{packed}</metadata>{svg[end:]}"


def taken(svg: str) -> tuple[str, str]:
    """The drawing without its numbers, and these as the address of a compressed CSV; empty without any."""
    found = _KEPT.search(svg)
    if found is None:
        return svg, ""
    return svg[: found.start()] + svg[found.end() :], f"data:application/gzip;base64,{found[1]}"


def _rows(figure: Any) -> Iterator[str]:
    """Lines of a table, a text for each line or set of marks."""
    for number, ax in enumerate(figure.axes, 1):
        panel = f"{ax.y.name or f'panel {number}'} over {ax.x.name or 'x'}"
        for name, x, y in _series(ax):
            known = np.isfinite(x) & np.isfinite(y)
            row = f"{_cell(panel)},{_cell(name)},%.{_DIGITS}g,%.{_DIGITS}g\n"
            yield "".join([row % pair for pair in zip(x[known].tolist(), y[known].tolist(), strict=True)])


def _cell(text: str) -> str:
    """A text within quotes where it needs them, to be completed by `%`."""
    quoted = text.replace('"', '""')
    return (f'"{quoted}"' if set(',"\r\n') & set(text) else text).replace("%", "%%")


def _series(ax: Any) -> Iterator[tuple[str, Any, Any]]:
    """Lines and marks of a panel; rules across it, and what only shows a direction, are no data."""
    for k, line in enumerate(ax.lines, 1):
        hidden = not line.label or line.label.startswith("_")
        if line.x.size and not (hidden and (line.across or (line.x.size <= 2 and not line.mark))):
            yield (f"line {k}" if hidden else line.label), line.x, line.y
