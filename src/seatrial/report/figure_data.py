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
        below = next((one.get_xlabel() for one in ax.get_shared_x_axes().get_siblings(ax) if one.get_xlabel()), "x")
        panel = f"{ax.get_ylabel() or f'panel {number}'} over {ax.get_xlabel() or below}"
        for name, points in _series(ax):
            known = np.asarray(points, dtype=float).reshape(-1, 2)
            for x, y in known[np.isfinite(known).all(axis=1)].tolist():
                yield panel, name, f"{x:.{_DIGITS}g}", f"{y:.{_DIGITS}g}"


def _series(ax: Any) -> Iterator[tuple[str, Any]]:
    """Lines, marks and bars of a panel; rules across it are no data."""
    for k, line in enumerate(ax.get_lines(), 1):
        points = _numbers(line.get_xydata())
        label = str(line.get_label())
        rule = label.startswith("_") and len(points) <= 2 and line.get_marker() == "None"
        if len(points) and not rule:
            yield (f"line {k}" if label.startswith("_") else label), points
    for k, marks in enumerate(ax.collections, 1):
        points = _numbers(marks.get_offsets()) if marks.get_offset_transform() is ax.transData else np.empty((0, 2))
        label = str(marks.get_label())
        if len(points):
            yield (f"marks {k}" if label.startswith("_") else label), points
    for k, bars in enumerate(ax.containers, 1):
        drawn = [bar for bar in bars if hasattr(bar, "get_height")]
        yield f"bars {k}", [(bar.get_x() + bar.get_width() / 2, bar.get_y() + bar.get_height()) for bar in drawn]


def _numbers(points: Any) -> Any:
    return np.ma.filled(np.ma.asarray(points, dtype=float), np.nan).reshape(-1, 2)
