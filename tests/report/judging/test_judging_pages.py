"""Pages that judge: what stands in their tables and drawings, against the values that they are made of."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.belief.coverage import Coverage, Reference
from seatrial.data import Trial
from seatrial.report.blocks import document, gallery
from seatrial.report.judging import coverage, fitness, imo, requirements, ship_evidence
from seatrial.validate.fitness import FIT, NOT_FIT, OPEN, Fitness, Found, Limit
from seatrial.validate.imo import FAIL, PASS, UNDECIDED, Band, Criterion, ImoTable
from seatrial.validate.requirements import Drawn, Finding, Item, Judgement, Plot, Table
from seatrial.validate.requirements.thresholds import Bound
from shown import items, tables, tiles, words


def drawings(html: str) -> list[str]:
    """The drawings of a page with the links to their numbers put back where `series` reads them."""
    return [one.split("</figure>")[0] for one in html.split("<figure>")[1:]]


def numbers_of(html: str) -> Any:
    """Series of each drawing of a page."""
    import base64
    import csv
    import gzip
    import io
    import re

    out: list[dict[tuple[str, str], np.ndarray]] = []
    for address in re.findall(r'href="data:application/gzip;base64,([^"]*)"', html):
        rows = csv.DictReader(io.StringIO(gzip.decompress(base64.b64decode(address)).decode()))
        found: dict[tuple[str, str], list[tuple[float, float]]] = {}
        for row in rows:
            found.setdefault((row["panel"], row["series"]), []).append((float(row["x"]), float(row["y"])))
        out.append({key: np.array(points) for key, points in found.items()})
    return out


LIMITS = (
    Found(Limit("drift", "off the track", "position", 2.0, "m", "5.1", "low speed", 3.0),
        {"a": (1.0, 3.0), "b": (0.0, math.inf, 0.5)}, 1.0, 0.5, 3.0, OPEN, "wide"),
    Found(Limit("turn", "in a turn", "overshoot", 10.0, "deg", "a guess"), {"a": (1.0,)}, 20.0, 15.0, math.inf,
        NOT_FIT, "far"),
    Found(Limit("stop", "stopping", "stopping", 0.5, "share", "IMO"), {}, math.nan, math.nan, math.nan, OPEN,
        "no trial"),
    Found(Limit("way", "speed", "tactical_diameter", 0.1, "U", "5.2"), {"a": (0.01, 0.02), "c": (0.03,)}, 0.05, 0.0,
        0.06, FIT, "near"),
)  # fmt: skip


@pytest.mark.slow
def test_errors_stand_beside_what_a_use_accepts() -> None:
    one = Fitness("p", "berthing", LIMITS, 2.0, ("seen",))
    made = fitness.section(one)
    (rows,) = tables(made.html)
    assert rows[1:] == [
        ["drift: off the track", "2.00", "1.00", "0.500 … 3.00", "m", "2", "5", "? cannot tell", "wide"],
        ["turn: in a turn", "10.0", "20.0", "15.0 … ∞", "deg", "1", "1", "✗ not fit", "far"],
        ["stop: stopping", "0.500", "–", "–", "share", "0", "0", "? cannot tell", "no trial"],
        ["way: speed", "0.100", "0.0500", "0 … 0.0600", "U", "2", "3", "✓ fit", "near"],
    ]
    assert "For berthing: not fit." in words(made.html)
    windows, slow = "after a start in the measured state, in windows", "at low speed (F_n below 0.05)"
    assert items(made.html) == [
        f"drift: off the track; error of the place 3 L/U (6 s) {windows} {slow}; at most 2.00 m "
        "(Sawada 2024 section 5.1)",
        "turn: in a turn; error of the highest heading of a leg, predicted from the reversal of the rudder on; "
        "at most 10.0 deg (a guess)",
        "stop: stopping; error of the way from the engine's order to a fifth of the speed; at most 0.500 share (IMO)",
        "way: speed; error of tactical diameter in a run of the whole manoeuvre; at most 0.100 U "
        "(Sawada 2024 section 5.2)",
        "left out, used in the fit: seen"]  # fmt: skip
    # over the limit, from the bottom: way, stop, turn, drift
    (drawn,) = numbers_of(made.html)
    points = sorted(
        {tuple(np.round(p, 6)) for line in drawn.values() for p in line.tolist()}, key=lambda p: (p[1], p[0])
    )
    assert points == [
        (0.1, 0.0),
        (0.2, 0.0),
        (0.3, 0.0),
        (0.5, 0.0),
        (0.1, 2.0),
        (2.0, 2.0),
        (0.25, 3.0),
        (0.5, 3.0),
        (1.5, 3.0),
    ]


@pytest.mark.slow
def test_the_drawing_of_a_use_has_bars_from_end_to_end(monkeypatch: pytest.MonkeyPatch) -> None:
    kept: list[Any] = []
    monkeypatch.setattr(fitness.figures, "svg", lambda drawn, name: kept.append(drawn) or "")
    fitness._drawn(Fitness("p", "berthing", LIMITS, 2.0))
    (ax,) = kept[0].axes
    lines = [(line.mark, np.column_stack([line.x, line.y]).tolist()) for line in ax.lines]
    bars = [points for mark, points in lines if not mark and len(points) == 2 and points[0][1] == points[1][1]]
    assert bars == [[[1.5, 2.0], [math.inf, 2.0]], [[0.25, 3.0], [1.5, 3.0]]], "none from zero on a logarithmic axis"
    marks = [points for mark, points in lines if mark == "o"]
    assert marks == [[[pytest.approx(0.5), 0.0]], [[2.0, 2.0]], [[0.5, 3.0]]]
    assert lines[-1][1] == [[1.0, 0], [1.0, 1]], "the limit"
    assert [words for _, words in ax.y.ticks] == ["way", "stop", "turn", "drift"]
    low, high = ax.y.ends
    assert low < 0.0 < 3.0 < high < 4.0
    assert ax.x.scale == "log"


ROWS = (
    Criterion("advance", "starboard", 3.0, "L", 4.5, PASS, band=Band(2.7, 3.6, 0.996, 200)),
    Criterion("advance", "port", 5.4, "L", 4.5, FAIL, "wide", band=Band(math.nan, math.nan, 0.012, 200)),
    Criterion("stopping", "", 14.0, "L", 15.0, UNDECIDED, "wide", band=Band(12.0, 16.5, 0.6, 200)),
    Criterion("overshoot", "port", None, "deg", 25.0, "not applicable", "no rudder"),
)  # fmt: skip


@pytest.mark.slow
def test_criteria_have_bands_shares_and_their_place_over_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    table = ImoTable("s", 100.0, 8.0, 1.5, ROWS, {"depth": "deep"}, ("calm only",))
    kept: list[Any] = []
    real = imo.figures.svg
    monkeypatch.setattr(imo.figures, "svg", lambda drawn, name: kept.append(drawn) or real(drawn, name))
    one = imo.page(table)
    (rows,) = tables(one.html)
    assert rows[1:] == [
        ["advance", "starboard", "3.00", "2.70", "3.60", "4.50", "L", "99 %", "pass"],
        ["advance", "port", "5.40", "–", "–", "4.50", "L", "1 %", "fail"],
        ["stopping", "–", "14.0", "12.0", "16.5", "15.0", "L", "60 %", "undecided"],
        ["overshoot", "port", "–", "–", "–", "25.0", "deg", "–", "not applicable"],
    ]
    assert items(one.html) == ["calm only", "advance (port), stopping: wide", "overshoot (port): no rudder"]
    (ax,) = kept[0].axes
    found = {(line.label, tuple(np.round(line.x, 9)), tuple(line.y)) for line in ax.lines}
    assert ("", (0.6, 0.8), (0, 0)) in found
    assert ("", (1.2, 1.2), (1, 1)) in found, "no band: the value itself"
    assert ("", (0.8, 1.1), (2, 2)) in found
    assert {
        (PASS, (round(3.0 / 4.5, 9),), (0,)),
        (FAIL, (1.2,), (1,)),
        (UNDECIDED, (round(14 / 15, 9),), (2,)),
    } <= found
    assert any(points == (1.0, 1.0) for _, points, _ in found)
    assert [words for _, words in ax.y.ticks] == ["advance (starboard)", "advance (port)", "stopping"]
    told = one.document
    assert (told["L_over_V"]["value"], told["speed"]["value"], told["n_P"]["value"]) == (12.5, 8.0, 1.5)
    assert told["criteria"][0]["band"] == {"low": 2.7, "high": 3.6, "met": 0.996, "draws": 200}
    assert told["criteria"][1]["band"] == {"low": None, "high": None, "met": 0.012, "draws": 200}
    assert (told["criteria"][2]["side"], told["criteria"][3]["value"]) == (None, None)
    assert "band" not in told["criteria"][3]
    bare = ImoTable("s", 100.0, 8.0, 1.5, (ROWS[3],), {}, ())
    assert tables(imo.page(bare).html)[0][1:] == [["overshoot", "port", "–", "25.0", "deg", "not applicable"]]
    assert "<figure>" not in imo.page(bare).html


def item(number: str) -> Item:
    return Item(number, f"item {number}", lambda _: Judgement("pass", ""))


@pytest.mark.slow
def test_requirements_are_counted_and_each_value_has_its_bound_and_band() -> None:
    held, broken = Bound(0.0, 1.0, "a share"), Bound(2.0, math.inf, "it must be large")
    x = np.linspace(0.0, 1.0, 5)
    found = (Finding("turn rate", 0.5, "rad/s", held), Finding("speed", 1.0, "-", broken, "too slow"),
             Finding("shown", 12.345, "m"))  # fmt: skip
    drawn = Drawn(0.75, 200, {"turn rate": (0.25, 0.75), "speed": (math.nan, math.nan)})
    rows = (
        (item("1"), Judgement("fail", "slow", found, (Plot("over time", "t [s]", "r [rad/s]", (("r", x, 2 * x),)),),
            drawn)),
        (item("2"), Judgement("pass", "good", found[:1])),
        (item("3"), Judgement("undecided", "by draws")), (item("4"), Judgement("not applicable", "no rudder")),
        (item("5"), Judgement("not judged", "elsewhere")), (item("6"), Judgement("pass", "good")),
    )  # fmt: skip
    table = Table("s", "berthing", rows)
    assert (
        requirements.verdict(table) == "2 of 6 items pass, 1 fail (1), 1 undecided (3), 1 not applicable, 1 not judged"
    )
    assert requirements.verdict(Table("s", "berthing", rows[1:2])) == "1 of 1 items pass"
    one = requirements.page(table)
    first, drawn_rows, plain_rows = tables(one.html)
    assert [row[2] for row in first[1:]] == [
        "✗ fail",
        "✓ pass",
        "? undecided",
        "– not applicable",
        "– not judged",
        "✓ pass",
    ]
    assert drawn_rows[0][1] == "value (band)"
    assert drawn_rows[1] == ["turn rate", "0.5000 (0.250 to 0.750) rad/s", str(held), "✓ holds", "a share"]
    assert drawn_rows[2] == ["speed", "1.000", str(broken), "✗ too slow", "it must be large"]
    assert drawn_rows[3] == ["shown", "12.35 m", "", "", ""]
    assert plain_rows[0][1] == "value"
    assert plain_rows[1][1] == "0.5000 rad/s"
    (lines,) = numbers_of(one.html)
    np.testing.assert_allclose(lines["r [rad/s] over t [s]", "r"], np.column_stack([x, 2 * x]))
    told = one.document["items"]
    assert told[0]["evidence"]["turn rate"] == {"value": 0.5, "unit": "rad/s", "band": {"low": 0.25, "high": 0.75},
                                               "low": 0.0, "high": 1.0, "holds": True, "why": "a share"}  # fmt: skip
    assert told[0]["evidence"]["speed"]["wrong"] == "too slow"
    assert "band" not in told[0]["evidence"]["speed"]
    assert told[0]["evidence"]["shown"] == {"value": 12.345, "unit": "m"}
    assert (told[0]["met"], told[0]["draws"]) == (0.75, 200)
    assert "met" not in told[1]
    assert one.document["failed"] == ["1"]


@pytest.mark.slow
def test_evidence_for_a_ship_counts_what_is_kept_and_draws_two_manoeuvres() -> None:
    ship: Any = SimpleNamespace(name="s", L_pp=4.0, notes={"references": "a paper", "cautions": ["slow", "small"]})
    t = np.arange(5.0)
    turn = Trial("t", t, {"x": 8.0 * t, "y": -4.0 * t})
    zigzag = Trial("z", t, {"psi": 0.1 * t, "delta": -0.2 * t})
    rows = (ship_evidence.Row("turning", {"rudder": 35}, "tactical_diameter", "3.0 L", "3.1 L", 3.1 / 3.0, 0.05,
        True, "p"),
            ship_evidence.Row("zigzag", {}, "first_overshoot", "10 deg", "15 deg", 1.5, 0.1, False, "p"))  # fmt: skip
    checks = (("mass", "ok", "fine"), ("sign", "error", "turned"), ("speed", "note", "low"))
    one = ship_evidence.page(ship, checks, rows, {"turning": turn, "zigzag": zigzag})
    assert "3 checks, 1 against the ship; 1 of 2 published indices reproduced." in words(one.html)
    published, checked = tables(one.html)
    assert published[1:] == [["turning, rudder 35", "tactical diameter", "3.0 L", "3.1 L", "1.03", "±5 %", "yes", "p"],
                             ["zigzag", "first overshoot", "10 deg", "15 deg", "1.50", "±10 %", "no", "p"]]  # fmt: skip
    assert checked[1:] == [list(row) for row in checks]
    assert items(one.html) == ["sign: turned", "a paper", "slow", "small"]
    turning, steering = numbers_of(one.html)
    np.testing.assert_allclose(turning["north / L_pp [-] over east / L_pp [-]", "line 1"], np.column_stack([-t, 2 * t]))
    panel = "angle [°], starboard positive over t [s]"
    np.testing.assert_allclose(steering[panel, "heading"], np.column_stack([t, np.degrees(0.1 * t)]), rtol=1e-4)
    np.testing.assert_allclose(steering[panel, "rudder"], np.column_stack([t, np.degrees(-0.2 * t)]), rtol=1e-4)
    assert one.document["fit"] is False
    assert one.document["published"][0]["ratio"] == pytest.approx(3.1 / 3.0)
    good = ship_evidence.page(ship, checks[:1], (), {})
    assert good.document["fit"] is True
    assert "no published index to compare with" in good.html
    assert "neither a turning circle nor a zigzag" in good.html
    bare = ship_evidence.page(ship, (), (), {"zigzag": Trial("z", t, {"psi": t})})
    assert [name for _, name in numbers_of(bare.html)[0]] == ["heading"]


def judged(name: str, share: float, telling: dict[str, float]) -> Coverage:
    t = np.arange(10.0)
    return Coverage(name, t, 0.5 + 0.1 * t, share, telling, dict.fromkeys(telling, 0.0))


@pytest.mark.slow
def test_coverage_lists_trials_as_given_and_draws_the_most_novel_first() -> None:
    t = np.arange(20.0)
    train = [
        Trial("a", t, {"u": 1.0 + 0.01 * t, "r": 0.001 * t}),
        Trial("b", t, {"u": 1.1 + 0.01 * t, "r": -0.001 * t}),
    ]
    found = (judged("low", 0.06, {"u": 0.2, "r": 0.8}), judged("none", 0.0, {"u": 1.0, "r": 0.0}),
             judged("high", 0.305, {"u": 0.7, "r": 0.3}))  # fmt: skip
    reference = Reference(
        ("u", "r"), np.ones(2), np.zeros((7, 2)), 0.25, np.zeros(2), np.ones(2), {"a": 0.01, "b": 0.032}
    )
    made = coverage.section(reference, train, train[:1], found)
    (rows,) = tables(made.html)
    assert rows[1:] == [["low", "6.0 %", "3.2 %", "edge", "r"], ["none", "0.0 %", "3.2 %", "inside", "–"],
                        ["high", "30.5 %", "3.2 %", "leaves", "u, r"]]  # fmt: skip
    assert "2 training files, 7 samples, one a second." in words(made.html)
    assert "0.250 standard deviations" in words(made.html)
    captions = [one.split("<figcaption>")[1].split("<")[0].strip() for one in drawings(made.html)]
    assert captions == ["surge speed u [m/s]", "rate of turn r [°/s]", "high: 30 % of the samples are novel",
                        "low: 6.0 % of the samples are novel"]  # fmt: skip
    assert document(made.body)["coverage"]["none"]["share"] == 0.0  # type: ignore[index]
    many = tuple(judged(str(k), 0.01 * k, {"u": 1.0, "r": 0.0}) for k in range(1, 15))
    assert len(drawings(coverage.section(reference, train, train, many).html)) == 2 + 12
    still = coverage.section(reference, train, train, found[1:2])
    assert "Novelty over time" not in still.html
    assert "first" in coverage.page(reference, train, train, found, ["first"]).html.split("<h2>")[0]


def test_the_limit_of_novelty_is_one_and_in_view(monkeypatch: pytest.MonkeyPatch) -> None:
    kept: list[Any] = []
    monkeypatch.setattr(coverage.figures, "svg", lambda drawn, name: kept.append(drawn) or "")
    for factor, top in ((0.2, 1.2), (4.0, 1.05 * 4.0 * 1.4)):
        one = judged("a", 0.1, {"u": 1.0})
        coverage.novelty(Coverage("a", one.t, factor * one.novelty, 0.1, {}, {}))
        (ax,) = kept[-1].axes
        assert list(ax.lines[1].y) == [1.0, 1.0]
        assert ax.y.ends == pytest.approx((0.0, top))
    for values in ((np.full(3, 2.0), np.full(2, 2.0)), (np.full(3, math.nan), np.zeros(0))):
        coverage.histogram("u", *values)
        edges = np.unique(kept[-1].axes[0].areas[0].parts[0][0])
        assert len(edges) == 41
        assert edges[-1] - edges[0] == pytest.approx(1.0)


def test_a_channel_of_several_trials_is_one_behind_the_other_and_a_heading_continuous() -> None:
    t = np.arange(3.0)
    trials = [Trial("a", t, {"psi": np.array([3.0, -3.1, -3.0]), "u": t}), Trial("b", t, {"psi": t, "u": 10.0 + t})]
    assert coverage.columns_of(trials, "u").tolist() == [0.0, 1.0, 2.0, 10.0, 11.0, 12.0]
    np.testing.assert_allclose(coverage.columns_of(trials, "psi")[:3], [3.0, 2 * math.pi - 3.1, 2 * math.pi - 3.0])


def test_a_gallery_without_figures_is_empty() -> None:
    assert gallery() == ()
    assert tiles("") == []
