import json
import re

import pytest

from example_report import report
from seatrial.identify.filters import CONSTANT_VELOCITY
from seatrial.report.report import Report, ReportError


@pytest.mark.long
def test_page_is_whole_and_self_contained(tmp_path):
    path = report().write(tmp_path / "deep" / "report.html")
    html = path.read_text()
    assert html.startswith("<!DOCTYPE html>")
    assert not re.search(r"https?://|<script [^>]*src|<link|<img|@import|url\((?!#)", html)
    assert html.count("<svg") == html.count("</svg>") == 9
    assert "zigzag &lt;1&gt;" in html
    assert "<frozen>" not in html
    assert "needs a <zigzag>" not in html
    assert "What this does not show" in html
    words = re.sub(r'<svg.*?</svg>|href="data:[^"]*"', "", html, flags=re.DOTALL).lower()
    assert "nan" not in words.replace("provenance", "")
    assert len(html) < 900_000
    assert sorted(p.name for p in path.parent.iterdir()) == ["report.html", "report.json"]


@pytest.mark.long
def test_numbers_beside_the_page(tmp_path):
    one = report()
    one.write(tmp_path / "report.html")
    data = json.loads((tmp_path / "report.json").read_text())
    pooled = data["standardised"]
    assert pooled["fitted"] < pooled["published"] < pooled[CONSTANT_VELOCITY]
    expected = one.trials["zigzag 2"]["fitted"].standardised
    assert data["trials"]["zigzag 2"]["fitted"]["standardised"] == expected
    assert data["trials"]["arc"]["fitted"]["indices"]["tactical_diameter"]["unit"] == "m"
    assert data["fit"]["parameters"]["rudder.t_R"]["high"] is None
    assert any("1 of 3 trials were used" in line for line in data["caveats"])


@pytest.mark.long
def test_pages_are_the_same_for_the_same_report(tmp_path):
    a, b = (report().write(tmp_path / name).read_text() for name in ("a.html", "b.html"))
    assert a == b


def test_all_trials_seen(tmp_path):
    names = tuple(report().trials)
    text = report(trained_on=names).numbers()["caveats"][0]
    assert text.startswith("None of the 3 trials is unseen")


def test_empty_report(tmp_path):
    html = Report("nothing", ()).write(tmp_path / "r.html").read_text()
    assert "Nothing was compared" in html


def test_refusals(tmp_path):
    one = report().comparisons[0]
    with pytest.raises(ReportError, match="two comparisons labelled"):
        Report("twice", (one, one))
    with pytest.raises(ReportError, match="overwritten"):
        Report("nothing", ()).write(tmp_path / "report.json")


@pytest.mark.long
def test_metrics_table_is_in_degrees(tmp_path):
    html = report().write(tmp_path / "r.html").read_text()
    assert "°/s" in html
