"""Pages of campaigns and of searches for rare events: each number with its unit and its place."""

from __future__ import annotations

import math
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.campaign import Criterion
from seatrial.campaign.analysis import Analysis, Extreme, Figure, Judged, Lost
from seatrial.campaign.analysis.proportion import Proportion
from seatrial.campaign.analysis.sensitivity import Effect, Sensitivity
from seatrial.campaign.analysis.spread import SHARES, Histogram, Quantile, Spread
from seatrial.campaign.rare import Rare
from seatrial.report.campaign import page, rare, shares
from seatrial.report.campaign.shown import Unit, bound, valued
from shown import items, tables, tiles, words

QUANTILES = tuple(Quantile(share, 0.1 * k, 0.1 * k - 0.01, 0.1 * k + 0.01) for k, share in enumerate(SHARES, start=1))
ANGLES = Spread(197, 3, 0.2, 0.05, 0.1, 0.4, QUANTILES)
LONG = tuple(Quantile(share, 300.0 + k, 299.0 + k, math.nan) for k, share in enumerate(SHARES))
LENGTHS = Spread(200, 0, 300.0, 5.0, 290.0, 310.0, LONG)
FIRST = Sensitivity("first order from given data", 9, 0, (Effect("rudder.rate", 0.5, 0.02, rank=-0.7),))
ENDS = (Extreme(7, 0.4), Extreme(9, 0.3))
WIDE = Histogram(np.array([0.1, 0.2, 0.4]), np.array([[0.5, 0.4], [0.6, 0.39]]), (0.1, 0.01))


def analysis(**changes: Any) -> Analysis:
    document = {"name": "c", "design": "random", "rows": 200, "inputs": ["rudder.rate", "U_T"], "cases": ["a", "b"]}
    figures = (
        Figure(0, "first_overshoot", ANGLES, ENDS, ENDS[::-1], FIRST),
        Figure(1, "advance", LENGTHS, (), (), None),
    )
    judged = (Judged(0, "first_overshoot", "first_overshoot", -math.inf, math.radians(10.0), Proportion(20, 198), 2,
        ENDS),
              Judged(1, "advance", "advance", 280.0, 400.0, Proportion(0, 200), 0, ()))  # fmt: skip
    lost = (Lost(0, Proportion(3, 200), Proportion(5, 200), (Extreme(4, 12.5), Extreme(8, 31.25)), (11, 12)),
            Lost(1, Proportion(0, 200), Proportion(1, 200), (), ()))  # fmt: skip
    manifest = SimpleNamespace(**{**document, **changes.pop("about", {})})
    given = {"held": SimpleNamespace(manifest=manifest, folder="F"), "rows": 200,
             "figures": figures, "histograms": {"first_overshoot": WIDE}, "judged": judged, "lost": lost}  # fmt: skip
    return Analysis(**{**given, **changes})


UNITS = {"first_overshoot": "rad", "advance": "m"}


def body(title: str, **changes: Any) -> str:
    return next(s.html for s in page(analysis(**changes), UNITS, {}).sections if s.title == title)


def test_the_head_counts_runs_failures_and_violations() -> None:
    head = body("")
    assert tiles(head) == [("200", "runs of 2 cases"), ("3", "failed"), ("0.101", "violate first overshoot (a)"),
                           ("0", "violate advance (b)")]  # fmt: skip
    assert "a, b; 2 inputs, design random." in words(head)
    assert tiles(body("", rows=12_345))[0][0] == "12 345"
    one = analysis(about={"cases": ["a"]}, judged=analysis().judged[:1] * 6, figures=analysis().figures[:1], lost=())
    shown = tiles(page(one, UNITS, {}).sections[0].html)
    assert shown[0][1] == "runs of 1 case"
    assert shown[2:] == [("0.101", "violate first overshoot")] * 4


@pytest.mark.parametrize(("changes", "told"), [
    ({}, ["More than 1% of the runs did not reach: first overshoot.", "2 runs (a) did not reach the first overshoot"]),
    ({"rows": 150, "figures": analysis().figures[1:]}, ["50 of 200 runs are not computed yet.",
        "2 runs (a) did not reach"]),
    ({"judged": (), "figures": (), "about": {"design": "grid"}}, ["The runs are a grid, no sample"]),
    ({"judged": (), "figures": (), "about": {"design": "sobol"}}, ["The points fill the space"]),
    ({"judged": (), "figures": (), "about": {"design": "latin-hypercube"}}, ["The points fill the space"]),
    ({"judged": (), "figures": (), "about": {"design": "saltelli"}}, ["Distributions and probabilities are those of"]),
    ({"judged": (), "about": {"design": "saltelli"}, "figures": (
        Figure(0, "advance", LENGTHS, (), (), Sensitivity("Sobol indices (Saltelli 2010)", 9, 3, ())),
        Figure(1, "advance", LENGTHS, (), (), Sensitivity("Sobol indices (Saltelli 2010)", 9, 2, ())))},
     ["Distributions and probabilities are", "Up to 3 blocks hold a run"]),
    ({"judged": (), "figures": (Figure(0, "advance", Spread(98, 1, 0, 0, 0, 0, LONG), (), (), None),)},
     ["More than 1% of the runs did not reach: advance."]),
    ({"judged": (), "figures": (Figure(0, "advance", Spread(990, 9, 0, 0, 0, 0, LONG), (), (), None),)}, []),
])  # fmt: skip
def test_warnings(changes: dict[str, Any], told: list[str]) -> None:
    found = items(body("", **changes))
    assert len(found) == len(told)
    for line, start in zip(found, told, strict=True):
        assert line.startswith(start)


def test_distributions_are_in_degrees_with_three_quantiles() -> None:
    html = body("Distributions")
    clear = {"first_overshoot": Histogram(WIDE.edges, WIDE.shares, (0.0, 0.0))}
    (rows,) = tables(html)
    assert rows[0][6:9] == ["5 %", "50 %", "95 %"]
    assert rows[1] == ["first overshoot [°]", "a", "197", "11.46", "2.86", "5.730", "11.46 (10.89 to 12.03)",
                       "22.92 (22.35 to 23.49)", "34.38 (33.80 to 34.95)", "22.92"]  # fmt: skip
    assert rows[2] == [
        "advance [m]",
        "b",
        "200",
        "300.0",
        "5.00",
        "290.0",
        "301.0 (300.0 to –)",
        "303.0 (302.0 to –)",
        "305.0 (304.0 to –)",
        "310.0",
    ]
    assert "First overshoot; 10 % lie beyond" in html
    assert "lie beyond" not in body("Distributions", histograms=clear)
    # the upper bound of 10 deg lies within the edges of 5.7 and 22.9 deg: one dashed line
    assert html.count('stroke-dasharray="5 3"') == 1
    assert body("Distributions", figures=(), judged=()) == ""


def test_sensitivities_are_rows_of_shares_with_ranks_or_interactions() -> None:
    (rows,) = tables(body("Which inputs matter"))
    assert rows == [["index", "case", "input", "alone", "±", "rank correlation"],
                    ["first overshoot", "a", "rudder.rate", "0.500", "0.020", "−0.700"]]  # fmt: skip
    effects = (Effect("U_T", 0.25, 0.01, 0.75, 0.03), Effect("psi", 0.1, 0.02, 0.2, 0.04))
    total = Sensitivity("Sobol indices (Saltelli 2010)", 9, 0, effects)
    figures = tuple(Figure(case, "advance", LENGTHS, (), (), total) for case in range(6))
    html = body("Which inputs matter", figures=figures, about={"design": "saltelli", "cases": list("abcdef")})
    (rows,) = tables(html)
    assert rows[0][3:] == ["alone", "±", "with interactions", "±"]
    assert rows[1][2:] == ["U_T", "0.250", "0.010", "0.750", "0.030"]
    assert rows[2][2:] == ["psi", "0.100", "0.020", "0.200", "0.040"]
    assert rows[3][1] == "b"
    assert "12 rows" in html
    assert html.count("<figure>") == 4
    assert "Advance (a): Sobol indices" in html
    assert "Saltelli 2010, SALib" in html
    assert "Pearson" not in html
    assert "jackknife" in body("Which inputs matter")


def test_bars_of_shares_are_ordered_by_what_would_remain() -> None:
    effects = (Effect("low", 0.3, 0.0, 0.1, 0.0), Effect("high", 0.05, 0.0, 0.6, 0.0), Effect("alone", 0.4, 0.0))
    found = re.findall(r">(low|high|alone)</text>", shares(Sensitivity("saltelli", 9, 0, effects)))
    assert found == ["high", "alone", "low"]


def test_worst_runs_are_named_by_number_with_values_in_degrees() -> None:
    html = body("Worst runs")
    (rows,) = tables(html)
    assert rows == [
        ["", "case", "run: value", ""],
        ["violates or comes nearest to first overshoot", "a", "7: 22.92", "9: 17.19"],
        ["violates or comes nearest to advance", "b", "", ""],
        ["largest first overshoot [°]", "a", "7: 22.92", "9: 17.19"],
        ["smallest first overshoot [°]", "a", "9: 17.19", "7: 22.92"],
    ]
    assert "seatrial simulate --from F 7 -o run.csv" in html
    assert "--from F 7 -o" in body("Worst runs", judged=())
    assert "--from F 0 -o" in body("Worst runs", judged=(), figures=(
        Figure(0, "advance", LENGTHS, (), (), None), Figure(0, "advance", LENGTHS, (), ENDS[1:], None)))  # fmt: skip
    assert body("Worst runs", judged=(), figures=()) == ""


def test_lost_runs_are_counted_by_case() -> None:
    first, second, third = items(body("Failed and incomplete runs"))
    assert first.startswith(
        "a: 3 runs left the validity of the ship or blew up, probability 0.0150 (0.00310 to 0.0432)"
    )
    assert first.endswith("earliest: 4 (after 12.5 s), 8 (after 31.2 s).")
    assert second == ("a: 5 runs do not hold all that their indices need; first without a failure: 11, 12; a longer "
                      "duration may.")  # fmt: skip
    assert third == "b: 1 runs do not hold all that their indices need."
    assert items(body("Failed and incomplete runs", lost=())) == [
        "No run failed, and each holds all that its indices need."
    ]


def test_the_document_has_probabilities_in_si() -> None:
    told = page(analysis(rows=150), UNITS, {"campaign": "c.toml"}).document
    assert (told["rows"], told["of"], told["cases"], told["units"]) == (150, 200, ["a", "b"], UNITS)
    first = told["criteria"][0]
    assert first["probability"] == pytest.approx(20 / 198)
    assert first["interval"][0] < first["probability"] < first["interval"][1]
    assert first["runs_for_10_percent"] == pytest.approx(19.6**2 * 178 / 20, rel=1e-3)
    assert first["high"] == pytest.approx(math.radians(10.0))


def test_bounds_are_told_with_their_unit() -> None:
    units = {"angle": Unit.of("rad"), "rate": Unit.of("rad/s"), "way": Unit.of("m"), "ratio": Unit.of("-")}
    one = Criterion("angle", math.radians(-5.0), math.radians(10.0))
    assert bound(one, units) == "≥ −5.000° and ≤ 10.00°"
    assert bound(Criterion("way", -math.inf, 4.0), units) == "≤ 4.000 m"
    assert bound(Criterion("ratio", 0.5, math.inf), units) == "≥ 0.5000"
    assert bound(Criterion("unknown", 0.5, math.inf), units) == "≥ 0.5000"
    assert valued(math.radians(2.0), units["rate"]) == "2.000°/s"
    assert (units["rate"].label("yaw_rate"), units["ratio"].label("a_b")) == ("yaw rate [°/s]", "a b")


def level(margins: Any, next_bound: float, share: float, bound: float = math.inf, accepted: float = 1.0) -> Any:
    return SimpleNamespace(
        margins=np.array(margins), next_bound=next_bound, share=share, bound=bound, accepted=accepted
    )


def searched(**changes: Any) -> Rare:
    levels = (level(np.linspace(0.02, 0.2, 100), 0.03, 0.1), level(np.linspace(0.001, 0.03, 100), 0.005, 0.12, 0.03,
        0.5),
              level(np.linspace(-0.004, 0.005, 100), 0.0, 0.4, 0.005, 0.25))  # fmt: skip
    estimate = SimpleNamespace(probability=0.0048, interval=(0.0031, 0.0074))
    given = {"case": "a", "levels": levels, "estimate": estimate, "reached": True, "runs": 4480, "unknown": 0.0,
             "nearest": {"rudder.rate": 0.04, "first_overshoot": math.radians(11.0), "t": math.nan}, "distance": 2.75,
             "run": 1234}  # fmt: skip
    return Rare(**{**given, **changes})


def test_a_search_tells_probability_levels_and_a_run_in_degrees() -> None:
    lost = searched(case="b", reached=False, unknown=0.125, run=None, nearest={})
    found = rare.page("c", "first_overshoot", Criterion("first_overshoot", -math.inf, math.radians(10.0)),
                      (searched(), lost), "rad", "F", {"campaign": "c.toml"})  # fmt: skip
    html = found.html
    assert "first overshoot ≤ 10.00°; subset simulation, 8960 runs." in words(html)
    assert tiles(html) == [("0.00480", "a: 0.00310 to 0.00740, 95 %, 4480 runs"),
                           ("< 0.0120", "b: the search ended before a tenth of a level was a violation")]  # fmt: skip
    assert items(html) == ["b: 12.5% of the last level did not reach the index; they count as no violation."]
    first, other, nearest = tables(html)
    assert first == [
        ["a: level", "margin at most [°]", "share inside the next", "moves accepted"],
        ["1", "all", "0.100", ""],
        ["2", "1.719", "0.120", "0.500"],
        ["3", "0.2865", "0.400", "0.250"],
    ]
    assert other[0][0] == "b: level"
    assert nearest[1:] == [["rudder.rate", "0.0400"], ["first_overshoot", "0.192"]]
    assert "2.75 standard deviations away" in html
    assert "first overshoot 11.00°." in html
    assert "seatrial simulate --from F 1234 -o run.csv" in html
    assert "b: none was found." in words(html)
    told = found.document["cases"]
    assert (told[0]["probability"], told[0]["interval"], told[0]["run"]) == (0.0048, [0.0031, 0.0074], 1234)
    assert (told[1]["run"], told[0]["distance"]) == (None, 2.75)
    # the line at the bound is drawn where violations were found
    assert html.count('stroke-dasharray="5 3"') == 2
    outside = searched(levels=searched().levels[:2])
    only = rare.page("c", "x", Criterion("first_overshoot", 0.0, 1.0), (outside,), "m", "F", {}).html
    assert 'stroke-dasharray="5 3"' not in only
