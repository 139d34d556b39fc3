"""The head of a report: scores as declared, no improvement that its own figures deny, and what is assumed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from example_report import report
from seatrial.belief.foresight import Foresight
from seatrial.identify.filters import CONSTANT_VELOCITY
from seatrial.report.evidence import assumptions
from seatrial.report.report import Report, against, sentence, worse, worse_than_start, worse_words
from seatrial.ships import Entry
from seatrial.ships.files import load
from seatrial.validate.comparison import compare, constant_velocity


def test_the_head_names_every_score_and_how_it_was_predicted():
    one = report()
    said = sentence(one)
    assert "every 50 s" in said
    assert "from the first sample" in said
    assert all(f"'{label}'" in said for label in one.labels)
    assert "%" not in said


@pytest.mark.slow
def test_what_speaks_against_the_subject_stands_at_the_head():
    """Better by the score, worse in y: the head says both."""
    one = report()
    spoilt = []
    for c in one.comparisons:
        far = c.predicted.having(y=c.measured["y"] + 500.0) if c.label == "fitted" else c.predicted
        near = far.having(**{n: c.measured[n] for n in ("x", "psi", "u", "v_m", "r")}) if c.label == "fitted" else far
        spoilt.append(compare(c.measured, near, label=c.label, restart=c.restart, sigma={**c.sigma, "y": 1e6}))
    bad = Report("bad", tuple(spoilt))
    assert bad.pooled["fitted"] < bad.pooled[CONSTANT_VELOCITY]
    lost = worse(bad, CONSTANT_VELOCITY)
    assert lost[0].startswith("position after")
    assert any(line.startswith("y (500") for line in lost)
    assert all("greater error of position after" in line and "of y (500" in line for line in against(bad))
    assert bad.numbers()["worse"][CONSTANT_VELOCITY] == lost


def test_a_subject_that_is_better_throughout_is_not_spoken_against():
    one = report()
    trials = {c.measured.name: c for c in one.comparisons if c.label == "fitted" and c.measured.name != "arc"}
    pairs = [(c, compare(c.measured, constant_velocity(c.measured, 50.0), label=CONSTANT_VELOCITY, restart=50.0,
                         sigma=c.sigma)) for c in trials.values()]  # fmt: skip
    good = Report("good", tuple(c for pair in pairs for c in pair))
    assert worse(good, CONSTANT_VELOCITY) == []
    assert len(against(good)) == 1
    assert against(good)[0].startswith(f"'fitted' against '{CONSTANT_VELOCITY}'")
    assert against(good)[0].endswith("2 of 2")


def test_forecasts_stand_in_head_page_and_numbers():
    rows = (Foresight("log", "fitted", 10.0, 5, 0.3, 0.05, 0.6), Foresight("log", "untuned", 10.0, 5, 0.5, 0.1, 0.9))
    one = report(forecasts=rows)
    assert "Forecasts over 10 s" in sentence(one)
    assert "'fitted' 0.30 m and 2.9°" in sentence(one)
    assert one.numbers()["forecasts"][1]["position"] == 0.5
    assert any("smoother" in line for line in one.numbers()["caveats"])


def test_what_a_ship_file_assumes_is_told_unless_it_is_fitted():
    ship = load("qiuxin5")
    first, second = list(ship.entries)[:2]
    told = {first: Entry("assumed: as a peg for the rest", 1.0, unit="N"), second: Entry("Assumed", 2.0)}
    ship = replace(ship, entries={**ship.entries, **told})
    found = {a.path: a for a in assumptions(ship)}
    assert (found[first].value, found[first].unit, found[first].why) == (1.0, "N", "as a peg for the rest")
    assert second in found
    assert first not in {a.path for a in assumptions(ship, [first])}
    one = report(assumptions=assumptions(ship))
    assert any(line.startswith("Assumed, neither measured nor fitted:") for line in one.numbers()["caveats"])
    assert one.numbers()["assumptions"][0]["path"] == first



def test_worse_than_before_the_fit_is_said_beyond_a_tie():
    one = report()
    before = tuple(replace(c, label="untuned") if c.label == CONSTANT_VELOCITY else c for c in one.comparisons
                   if c.label in ("fitted", CONSTANT_VELOCITY))  # fmt: skip
    good = Report("good", before)
    for factor, said in ((0.5, True), (0.99, False), (1.5, False)):
        mine = good.pooled["fitted"] * factor
        level = tuple(replace(c, standardised=mine) if c.label == "untuned" else c for c in before)
        found = worse_than_start(Report("one", level))
        assert (found is not None) == said
        assert len(worse_words(Report("one", level))) == said
    assert worse_than_start(Report("alone", tuple(c for c in before if c.label == "fitted"))) is None
