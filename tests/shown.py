"""What a page shows: the cells of its tables, its tiles and lists, and the numbers behind a drawing."""

from __future__ import annotations

import base64
import csv
import gzip
import io
import re
from html import unescape

import numpy as np

from seatrial.data import Array
from seatrial.report.blocks import Body, Group, Table, cell
from seatrial.report.figure_data import taken
from seatrial.report.page import html as html_of


def html(shown: Body | str) -> str:
    """A body as a page shows it."""
    return shown if isinstance(shown, str) else html_of(shown)


_NUMBER = re.compile(r"[*<≤≥~±]*\s?[−+-]?(\d|∞)")


_NO_NUMBER = ("diverges", "failed", "blows up", "all", "deep", "no number", "not determined")
"""Words that stand in the place of a number."""


def aligned(body: Body) -> None:
    """Fail where a column of numbers stands to the left, or one of words to the right; mixed and empty ones may."""
    for block in body:
        if isinstance(block, Group):
            aligned(block.body)
        for k in range(1, len(block.head)) if isinstance(block, Table) else ():
            cells = [said for row in block.rows if (said := cell(row[k]).strip("* –✓")) and said not in _NO_NUMBER]
            numeric = {bool(_NUMBER.match(said)) for said in cells if not re.match(r"\d+, ", said)}
            if len(numeric) == 1:
                assert (k in block.words) is not numeric.pop(), f"column {block.head[k]}: {cells[:3]}"


def tables(shown: Body | str) -> list[list[list[str]]]:
    """Rows of cells of each table, the heading first; a cell that is marked as the best begins with *."""
    if not isinstance(shown, str):
        aligned(shown)
    found = []
    for one in re.findall(r"<table>(.*?)</table>", html(shown), re.S):
        rows = [
            re.findall(r"<t[hd]([^>]*)>(.*?)</t[hd]>", row, re.S) for row in re.findall(r"<tr>(.*?)</tr>", one, re.S)
        ]
        found.append([["*" * ("best" in how) + unescape(cell) for how, cell in row] for row in rows])
    return found


def tiles(shown: Body | str) -> list[tuple[str, str]]:
    """Values with what they are."""
    return [(unescape(a), unescape(b)) for a, b in re.findall(r"<b>(.*?)</b><span>(.*?)</span>", html(shown))]


def items(shown: Body | str) -> list[str]:
    """Lines of all lists."""
    return [unescape(one) for one in re.findall(r"<li>(.*?)</li>", html(shown), re.S)]


def words(shown: Body | str) -> str:
    """The text without its marks."""
    bare = re.sub(r"<svg.*?</svg>|<metadata>.*?</metadata>", "", html(shown), flags=re.S)
    return unescape(re.sub(r"<[^>]+>", " ", bare))


def series(svg: str) -> dict[tuple[str, str], Array]:
    """Points of each panel and line of a drawing of Matplotlib, shape (points, 2)."""
    _, address = taken(svg)
    text = gzip.decompress(base64.b64decode(address.partition(",")[2])).decode()
    found: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for row in csv.DictReader(io.StringIO(text)):
        found.setdefault((row["panel"], row["series"]), []).append((float(row["x"]), float(row["y"])))
    return {key: np.array(points) for key, points in found.items()}
