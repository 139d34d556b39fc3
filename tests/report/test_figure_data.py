"""The numbers behind a figure are those drawn, a click away; tables sort; nothing comes from outside."""

from __future__ import annotations

import base64
import csv
import gzip
import io
import math
import re

import numpy as np
import pytest

from seatrial.report import figures, page
from seatrial.report.blocks import figure, table
from seatrial.report.canvas.panels import Figure
from seatrial.report.figure_data import taken, with_data
from seatrial.report.page import Page, Section


def numbers(address: str) -> list[dict[str, str]]:
    text = gzip.decompress(base64.b64decode(address.partition(",")[2])).decode()
    return list(csv.DictReader(io.StringIO(text)))


def drawn() -> Figure:
    fig, (upper, lower) = figures.canvas(2)
    t = np.linspace(0.0, 10.0, 101)
    upper.plot(t, np.sin(t), label="measured")
    upper.plot(t, np.where(t > 5.0, np.nan, np.cos(t)))
    upper.axhline(0.5)
    upper.set(xlabel="t [s]", ylabel="r [°/s]")
    lower.plot([0.25], [7.0], "o", label="peaks")
    lower.plot([0.25, 0.5], [7.0, 6.0], color="#000")
    return fig


@pytest.mark.slow
def test_the_file_holds_what_is_drawn_and_no_rules() -> None:
    _, address = taken(figures.svg(drawn(), "x"))
    rows = numbers(address)
    measured = [row for row in rows if row["series"] == "measured"]
    assert {row["panel"] for row in measured} == {"r [°/s] over t [s]"}
    assert len(measured) == 101
    assert math.isclose(float(measured[30]["y"]), math.sin(3.0), rel_tol=1e-5)
    assert len([row for row in rows if row["series"] == "line 2"]) == 51  # gaps are left out
    assert not [row for row in rows if row["series"] == "line 3"]
    below = [row for row in rows if row["panel"] == "panel 2 over t [s]"]
    assert [(row["series"], row["x"], row["y"]) for row in below] == [("peaks", "0.25", "7")]


@pytest.mark.slow
def test_a_figure_has_a_link_named_by_its_caption_and_the_drawing_keeps_no_copy() -> None:
    html = page.html(figure(figures.svg(drawn(), "x"), "Track, north up"))
    assert 'download="track-north-up.csv.gz"' in html
    assert "<metadata>" not in html
    assert html.count("base64") == 1


def test_a_figure_without_numbers_has_no_link() -> None:
    assert "href" not in page.html(figure(with_data("<svg></svg>", Figure(1, 1, (1.0, 1.0), shared=True)), "nothing"))
    assert "href" not in page.html(figure("<svg></svg>", "a drawing by hand"))


@pytest.mark.slow
def test_the_same_figure_gives_the_same_bytes() -> None:
    assert figures.svg(drawn(), "x") == figures.svg(drawn(), "x")


def test_a_page_sorts_its_tables_and_fetches_nothing() -> None:
    body = table(("ship", "L [m]"), [("a", "7"), ("b", "320"), ("c", "3")])
    html = Page("Ships", (Section("One", body),)).html
    assert "aria-sort" in html
    assert "prefers-color-scheme:dark" in html
    assert not re.search(r'(?:src|href)="(?!data:)', html)


def test_names_with_commas_quotes_and_shares_stay_one_cell() -> None:
    fig, (ax,) = figures.canvas(1)
    ax.plot([1.0, 2.0], [0.5, -1.23456789e-7], label='drift, "95 %"')
    ax.set(xlabel="t, [s]", ylabel="share [%]")
    rows = numbers(taken(with_data("<svg></svg>", fig))[1])
    assert rows == [
        {"panel": "share [%] over t, [s]", "series": 'drift, "95 %"', "x": "1", "y": "0.5"},
        {"panel": "share [%] over t, [s]", "series": 'drift, "95 %"', "x": "2", "y": "-1.2346e-07"},
    ]
