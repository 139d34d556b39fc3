"""The report of a fine-tuning, from a tuning made by hand."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from seatrial.core.parameters import near
from seatrial.identify import Fit, Problem
from seatrial.identify.tuning.ranges import Residuals
from seatrial.identify.tuning.tuned import Method, Range, Tuning, findings
from seatrial.manoeuvres.turning import Turning
from seatrial.report import tuning as drawings
from seatrial.report.blocks import line
from seatrial.report.figure_data import taken
from seatrial.report.page import Section, write
from seatrial.report.tuning import numbers, page
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

pytestmark = pytest.mark.slow

PATHS = ("rudder.a_H", "rudder.epsilon")


@pytest.fixture(scope="module")
def tuning():
    ship = load("suzaku")
    runs = [
        simulate(ship, Turning(106 / 60, angle), duration=200.0, dt=1.0, method="euler", name=name)
        for name, angle in (("D+10", 0.17), ("D-20", -0.35), ("D-10 <b>", -0.17))
    ]
    one = {run.name: 100.0 for run in runs[:2]}
    other = {run.name: 200.0 for run in runs[2:]}
    ranges = tuple(made(ship, ratio, cost, one, other) for ratio, cost in ((0.2, 50.0), (0.4, 20.0), (0.6, 10.0)))
    left = Residuals(
        {"x": 5.0, "psi": 0.02}, {"x": 1.0, "psi": 0.0035}, {"x": 0.9, "psi": 0.2},
        {"x": dict(one), "psi": dict(one)}, 50.0, 25.0, 8.0,
    )  # fmt: skip
    problem = Problem(ship, tuple(runs[:2]), near(ship.model, *PATHS, ratio=0.6))
    return Tuning(problem, tuple(runs[2:]), ranges, 1, one, other, left, 1, 1e-4)


def made(ship, ratio, cost, one, other):
    """A range whose second parameter is at its upper end."""
    free = near(ship.model, *PATHS, ratio=ratio)
    values = np.array([0.5 * (free[0].low + free[0].start), free[1].high])
    history = np.array([[k + 1.0, cost * (1.0 + np.exp(-0.2 * (k % 30))), np.nan, 0.01 * k] for k in range(60)])
    fit = Fit(
        ship=ship.having(dict(zip(PATHS, values.tolist(), strict=True))), free=free, values=values, sigma=np.ones(2),
        covariance=np.eye(2), shrinkage=np.ones(2), at_bound=(), verdicts=(), history=history, objective=cost,
        seconds=1.5, evaluations=700, status="2 of 2", digest="0", ends=np.array([[cost, *values]] * 2),
    )  # fmt: skip
    share = dict.fromkeys(one, cost)
    test = dict.fromkeys(other, 4.0 * cost if ratio < 0.6 else 300.0)
    left_out = dict.fromkeys(one, cost if ratio < 0.6 else 90.0)
    return Range(
        ratio, free, fit, "gradient", {name: Method.of(fit) for name in ("evolution", "gradient")}, share, test,
        left_out, values, share, test, left_out,
    )  # fmt: skip


def shown(tuning, **given):
    return page(tuning, title="SUZAKU <tuned>", provenance={"study": "a & b"}, method="euler", **given).html


@pytest.fixture(scope="module")
def html(tuning):
    return shown(tuning, sections=[Section("Identifiability & bands", line("made elsewhere"))])


def test_the_page_holds_every_figure_and_table(tuning, html):
    assert html.count("<svg") == 2 + 1 + 1 + 2 * len(tuning.tests)
    for heading in ("Two methods, side by side", "The range", "Cross-validation", "The parameters",
                    "Held-out trials", "Residuals", "Provenance"):  # fmt: skip
        assert f"<h2>{heading}</h2>" in html
    assert "SUZAKU &lt;tuned&gt;" in html
    assert "D-10 &lt;b&gt;" in html
    assert "<b>D-10" not in html
    assert "D-10 <b>" not in html
    assert "a &amp; b" in html
    assert not re.search(r"(src|href)=\"(?!#|data:)", html)
    assert ">nan<" not in html
    assert taken(drawings.objectives(tuning))[0] in html  # the same each time


def test_sections_made_elsewhere_stand_before_the_provenance(html):
    assert "<h2>Identifiability &amp; bands</h2><p>made elsewhere</p><h2>Provenance</h2>" in html


@pytest.mark.long
def test_without_test_trials(tuning):
    html = shown(replace(tuning, tests=(), ranges=tuple(replace(r, test={}) for r in tuning.ranges), untuned_test={}))
    assert "Held-out trials" not in html
    assert "nothing is known of manoeuvres" in html


def test_the_untuned_track_is_that_of_the_ship_and_tuned_ones_leave_it(html):
    distances = re.search(r"root mean square \[m\]</h3>(.*?)</table>", html, re.S)[1]
    rows = re.findall(r"<tr>(.*?)</tr>", distances)[1:]
    for row in rows:
        untuned, *tuned = [float(x) for x in re.findall(r">([0-9.e-]+)</td>", row)]
        assert untuned == pytest.approx(0.0, abs=1e-6)  # the trials were made with the untuned ship
        assert tuned == sorted(tuned)


@pytest.mark.long
def test_the_numbers(tuning, tmp_path):
    write(tmp_path / "report.html", page(replace(tuning, tests=()), title="t", provenance={}))
    found = json.loads((tmp_path / "report.json").read_text())
    assert found["chosen"] == 0.4
    assert found["ranges"][2]["parameters"]["rudder.epsilon"] == pytest.approx(
        {"value": 1.27 * 1.6, "low": 1.27 * 0.4, "high": 1.27 * 1.6, "position": 1.0, "at_bound": True}
    )
    assert found["ranges"][0]["parameters"]["rudder.a_H"]["position"] == pytest.approx(-0.5)
    assert found["ranges"][1]["methods"]["evolution"]["ends"] == [20.0, 20.0]
    assert numbers(tuning)["residuals"]["independent"] == 8.0


@pytest.mark.parametrize(
    "words",
    [
        "a_r = 0.4 is chosen", "8 independent ones for 2", "1 of 2 combinations", "rudder.epsilon",
        "no better than untuned: D-10 <b> at 0.2", "overfitting", "x is 5 m RMS",
        "it is the chosen one",
    ],
)  # fmt: skip
def test_the_findings_say_it(tuning, words):
    assert any(words in f.text for f in findings(tuning))


def test_a_range_cut_by_what_is_possible_is_told(tuning):
    last = tuning.ranges[-1]
    cut = replace(last, free=(replace(last.free[0], low=0.9 * last.free[0].start), last.free[1]))
    said = [f.text for f in findings(replace(tuning, ranges=(*tuning.ranges[:-1], cut)))]
    assert any("is cut there: rudder.a_H" in text for text in said)
    assert not any("is cut there" in f.text for f in findings(tuning))


def test_methods_apart_are_told(tuning):
    first = tuning.ranges[0]
    worse = replace(first.methods["evolution"], objective=1.01 * first.fit.objective)
    ranges = (replace(first, methods={**first.methods, "evolution": worse}), *tuning.ranges[1:])
    said = [f.text for f in findings(replace(tuning, ranges=ranges)) if f.severity == "warning"]
    assert any("0.01 apart; the better, gradient, is kept" in text for text in said)
