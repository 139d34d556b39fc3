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
from seatrial.report.blocks import Body
from seatrial.report.figure_data import taken
from seatrial.report.page import html as html_of


def html(shown: Body | str) -> str:
    """A body as a page shows it."""
    return shown if isinstance(shown, str) else html_of(shown)


def tables(shown: Body | str) -> list[list[list[str]]]:
    """Rows of cells of each table, the heading first; a cell that is marked as the best begins with *."""
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
