"""The numbers behind a drawing, kept inside it until the page makes a link of them.

They travel as a compressed CSV in the drawing's `<metadata>`: a figure is drawn in one place and captioned in another,
and the data have to be those that were drawn.
"""

from __future__ import annotations

import base64
import csv
import gzip
import io
import re
from collections.abc import Iterator
from typing import Any

import numpy as np

_HEAD = ("panel", "series", "x", "y")
_KEPT = re.compile(r"<metadata>([A-Za-z0-9+/=]+)</metadata>")
_DIGITS = 5


def with_data(svg: str, figure: Any) -> str:
    """The drawing with the numbers of the figure inside; as it is where the figure has none."""
    rows = list(_rows(figure))
    if not rows:
        return svg
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerows([_HEAD, *rows])
    packed = base64.b64encode(gzip.compress(text.getvalue().encode(), mtime=0)).decode()
    end = svg.index(">") + 1
    return f"{svg[:end]}<metadata>{packed}</metadata>{svg[end:]}"


def taken(svg: str) -> tuple[str, str]:
    """The drawing without its numbers, and these as the address of a compressed CSV; empty without any."""
    found = _KEPT.search(svg)
    if found is None:
        return svg, ""
    return svg[: found.start()] + svg[found.end() :], f"data:application/gzip;base64,{found[1]}"


def _rows(figure: Any) -> Iterator[tuple[str, ...]]:
    for number, ax in enumerate(figure.axes, 1):
        panel = f"{ax.y.name or f'panel {number}'} over {ax.x.name or 'x'}"
        for name, x, y in _series(ax):
            known = np.isfinite(x) & np.isfinite(y)
            for one, two in zip(x[known].tolist(), y[known].tolist(), strict=True):
                yield panel, name, f"{one:.{_DIGITS}g}", f"{two:.{_DIGITS}g}"


def _series(ax: Any) -> Iterator[tuple[str, Any, Any]]:
    """Lines and marks of a panel; rules across it, and what only shows a direction, are no data."""
    for k, line in enumerate(ax.lines, 1):
        hidden = not line.label or line.label.startswith("_")
        if line.x.size and not (hidden and (line.across or (line.x.size <= 2 and not line.mark))):
            yield (f"line {k}" if hidden else line.label), line.x, line.y
