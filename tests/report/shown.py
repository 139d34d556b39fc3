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
from seatrial.report.figure_data import taken


def tables(html: str) -> list[list[list[str]]]:
    """Rows of cells of each table, the heading first; a cell that is marked as the best begins with *."""
    found = []
    for one in re.findall(r"<table>(.*?)</table>", html, re.S):
        rows = [
            re.findall(r"<t[hd]([^>]*)>(.*?)</t[hd]>", row, re.S) for row in re.findall(r"<tr>(.*?)</tr>", one, re.S)
        ]
        found.append([["*" * ("best" in how) + unescape(cell) for how, cell in row] for row in rows])
    return found


def tiles(html: str) -> list[tuple[str, str]]:
    """Values with what they are."""
    return [(unescape(a), unescape(b)) for a, b in re.findall(r"<b>(.*?)</b><span>(.*?)</span>", html)]


def items(html: str) -> list[str]:
    """Lines of all lists."""
    return [unescape(one) for one in re.findall(r"<li>(.*?)</li>", html, re.S)]


def words(html: str) -> str:
    """The text without its marks."""
    return unescape(re.sub(r"<[^>]+>", " ", re.sub(r"<svg.*?</svg>|<metadata>.*?</metadata>", "", html, flags=re.S)))


def series(svg: str) -> dict[tuple[str, str], Array]:
    """Points of each panel and line of a drawing of Matplotlib, shape (points, 2)."""
    _, address = taken(svg)
    text = gzip.decompress(base64.b64decode(address.partition(",")[2])).decode()
    found: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for row in csv.DictReader(io.StringIO(text)):
        found.setdefault((row["panel"], row["series"]), []).append((float(row["x"]), float(row["y"])))
    return {key: np.array(points) for key, points in found.items()}
