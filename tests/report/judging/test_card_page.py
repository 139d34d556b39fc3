"""Each number and line of a model card, against those that it is made of."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from example_report import fit
from seatrial.belief.bands.held import Held
from seatrial.identify import Verdict
from seatrial.report.judging.card import Calibrated, Card, _least, forbidden, page, pooled
from seatrial.validate.fitness import FIT, NOT_FIT, OPEN, Fitness, Found, Limit
from shown import items, tables, tiles, words
from summaries import summary_of

ERRORS = {"x": 7.2, "y": 9.6, "psi": math.radians(3.0), "u": 0.11, "v_m": 0.07, "r": math.radians(0.25)}
HELD = {"position": 0.93, "heading": 0.96, "speeds": 0.88}
WIDE = dict(zip(("x", "y", "psi", "u", "v_m", "r"), (1.0, 2.0, math.radians(3.0), 0.4, 0.5, math.radians(6.0)),
                strict=True))  # fmt: skip
COVERED = {"u": [0.5, 2.0], "r": [-0.02, 0.02], "delta": [math.radians(-35.0), math.radians(20.0)], "n_P": [-1.0, 2.0],
           "U_T": [0.0, 8.0], "H_S": [0.0, 0.0], "depth": [None, None]}  # fmt: skip
TRIALS = [
    {"name": "a", "kind": "zigzag", "role": "fit", "duration": 99.6, "rows": 997, "digest": "d1"},
    {"name": "b", "kind": "turning", "role": "fit", "duration": 50.2, "rows": 503, "digest": "d2"},
    {"name": "c", "kind": "zigzag", "role": "fit", "duration": 10.0, "rows": 101, "digest": "d3"},
    {"name": "d", "kind": "spiral", "role": "kept back", "duration": 70.0, "rows": 701, "digest": "d4"},
]
DEPTH, WAVES = "in shallow water", "in waves: no trial of the fit had any on record"


def use(verdict: str, title: str = "berthing", value: float = 0.5) -> Fitness:
    limit = Limit("drift", "about", "position", 1.25, "m", "5.1")
    return Fitness("p", title, (Found(limit, {"a": (value,)}, value, 0.4, 0.6, verdict, "why"),
                                Found(replace(limit, key="stop"), {}, math.nan, 0.0, 0.0, verdict, "why")))  # fmt: skip


def card(**changes: Any) -> Card:
    own = replace(fit(), ship=SimpleNamespace(name="boat", L_pp=7.0))
    summary = summary_of(grounds={"trials": TRIALS, "covered": COVERED, "kinds": ["zigzag", "turning"]},
                   provenance={"trained_on": ["a", "b", "c"]}, diagnosis={"explained": True})  # fmt: skip
    rows = (Held("zigzag", 10.0, 40, 2, HELD, WIDE, ERRORS), Held("zigzag", 20.0, 30, 2, HELD, WIDE, ERRORS),
            Held("all kinds", 10.0, 900, 3, HELD, WIDE, {**ERRORS, "x": 3.6, "y": 4.8}),
            Held("all kinds", 20.0, 700, 3, {**HELD, "speeds": 0.91}, WIDE, {**ERRORS, "x": 9.0, "y": -12.0}))
    given = {"fit": own, "summary": summary, "restart": 20.0, "rows": rows, "pooled": {"fitted": 0.25}, "uses": (),
             "unjudged": {}, "missing": (), "unseen": (("d", "spiral", 70.0), ("new", "turning", 31.4)),
             "banded": True, "widened": False, "calibrated": None, "repeat": {"digest of the model": "m"},
             "versions": {"seatrial": "1"}}  # fmt: skip
    return Card(**{**given, **changes})


def ranging(**covered: Any) -> tuple[str, ...]:
    one = card()
    grounds = replace(one.grounds, covered={**one.grounds.covered, **covered})
    return forbidden(replace(one, summary=replace(one.summary, grounds=grounds)))


def test_the_head_counts_trials_of_the_fit_by_kind_and_shows_the_last_horizon_of_all_kinds() -> None:
    html = page(card()).sections[0].html
    assert ("boat, 7.00 m, study S: 2 parameters fitted to 3 trials (2 zigzag, 1 turning); judged on 2 unseen trials."
            ) in words(html)  # fmt: skip
    assert tiles(html) == [("15 m", "position error after 20 s"), ("3.0°", "heading error"),
                           ("93 %", "of positions within bands of 95 %")]  # fmt: skip
    assert "explain" not in html
    bad = card(missing=("gone: x",), summary=replace(card().summary, diagnosis={"explained": False}))
    told = items(page(bad).sections[0].html)
    assert told == ["The model does not explain the trials of its fit: its sigmas are too narrow, and its bands.",
                    "gone: x"]  # fmt: skip
    wide = replace(bad, widened=True)
    assert items(page(wide).sections[0].html)[0].endswith("its sigmas are too narrow.")
    assert page(bad).document["explained"] is False
    assert page(card(summary=summary_of())).document["explained"] is None


def test_a_calibration_replaces_the_share_of_the_draws_at_the_head() -> None:
    inside = {"position": 0.97, "heading": 0.9, "speeds": 0.9}
    held = tuple(Held("all kinds", end, 50, 3, {**inside, "position": share}, WIDE, WIDE)
                 for end, share in ((5.0, 0.91), (20.0, 0.97)))  # fmt: skip
    found = Calibrated(8, ("zigzag", "turning"), 25.0, held, (), ("little",))
    one = page(card(calibrated=found))
    assert tiles(one.sections[0].html)[-1][0] == "97 %"
    body = next(s for s in one.sections if s.title == "Bands that hold").html
    assert "calibrated on 8 recordings that fits left out in turn; kinds: zigzag, turning. They hold up to 25 s" in body
    assert items(body) == ["little"]
    assert "Too few recordings" in body
    assert [row[:6] for row in tables(body)[0][1:]] == [["all kinds", "5.00", "50", "91 %", "90 %", "90 %"],
                                                       ["all kinds", "20.0", "50", "97 %", "90 %", "90 %"]]  # fmt: skip
    told = one.document["bands"]
    assert (told["level"], told["recordings"], told["reach"], told["doubts"]) == (0.95, 8, 25.0, ["little"])
    assert [row["horizon"] for row in told["unseen"]] == [5.0, 20.0]
    assert told["left_out"] == []
    other = page(card(calibrated=replace(found, unseen=(), left_out=held[:1])))
    body = next(s for s in other.sections if s.title == "Bands that hold").html
    assert "No unseen trial is at hand" in body
    assert len(tables(body)) == 1
    assert tiles(other.sections[0].html)[-1][0] == "93 %", "of the draws, where no unseen trial has judged the bands"
    assert page(card()).document["bands"] is None


def test_ranges_stand_in_two_halves_in_the_units_of_people() -> None:
    body = page(card()).sections[1].html
    left, right = (rows[1:] for rows in tables(body))
    assert left == [["surge speed", "0.500", "2.00", "m/s"], ["rate of turn", "−1.15", "1.15", "°/s"],
                    ["rudder", "−35.0", "20.0", "°"], ["propeller", "−1.00", "2.00", "1/s"]]  # fmt: skip
    assert right == [["wind", "0", "8.00", "m/s"], ["wave height", "0", "0", "m"], ["depth", "deep", "deep", "m"]]
    assert "Kinds of manoeuvre: zigzag, turning." in body
    assert "seatrial simulate --bands refuses it" in body
    assert "refuses" not in page(card(widened=True)).sections[1].html
    assert card().grounds.covered["depth"] == (math.inf, math.inf)


def test_errors_are_rows_in_degrees_with_shares_of_the_bands() -> None:
    body = page(card()).sections[2].html
    (found,) = tables(body)
    assert found[1] == ["zigzag", "10", "2", "40", "12", "3.0", "0.11", "0.070", "0.25", "93 %", "96 %", "88 %"]
    assert [row[:4] for row in found[2:]] == [["zigzag", "20", "2", "30"], ["all kinds", "10", "3", "900"],
                                              ["all kinds", "20", "3", "700"]]  # fmt: skip
    assert "restarted every 20 s: fitted 0.250." in words(body)
    none = page(card(rows=(), banded=False)).sections[2].html
    assert "no covariance" in none
    assert "No unseen trial has been judged" in none
    assert "no covariance" not in page(card(rows=())).sections[2].html
    assert tiles(page(card(rows=())).sections[0].html) == []


def test_purposes_have_the_error_beside_its_limit() -> None:
    one = page(card(uses=(use(FIT),), unjudged={"towing": "no trial"}))
    (rows,) = tables(next(s for s in one.sections if s.title.startswith("Fit for which")).html)
    assert rows[1:] == [
        ["berthing", "fit", "drift 0.50 of 1.2 m: fit; stop: fit"],
        ["towing", "not judged", "no trial"],
    ]


def test_trials_given_to_the_card_follow_those_of_the_run() -> None:
    one = page(card())
    (rows,) = tables(next(s for s in one.sections if s.title == "Trials").html)
    assert rows[1] == ["a", "zigzag", "fit", "100", "997", "d1"]
    assert [row[0] for row in rows[1:]] == ["a", "b", "c", "d", "new"]
    assert rows[-1] == ["new", "turning", "given to the card", "31", "–", "–"]
    old = page(card(unseen=(), summary=summary_of(provenance={"trained_on": ["a", "b"]})))
    assert items(next(s for s in old.sections if s.title == "Trials").html) == ["a", "b"]


def test_parameters_have_start_estimate_sigma_and_what_the_data_say() -> None:
    body = page(card()).sections[-1].html
    (rows,) = tables(body)
    assert rows[1:] == [["hull.Y_v", "−0.3000", "−0.3100", "0.010", "99 %", "identified"],
                        ["rudder.t_R", "0.3900", "0.4000", "0.090", "10 %", "not identified"]]  # fmt: skip
    pair = replace(card().fit, verdicts=(*card().fit.verdicts, Verdict("a and b", "weak", "they trade off")))
    assert items(page(card(fit=pair)).sections[-1].html) == ["a and b: they trade off"]
    none = replace(card().fit, free=(), verdicts=())
    assert "A network" in page(card(fit=none)).sections[-1].html


@pytest.mark.parametrize(("covered", "line", "told"), [
    ({"u": [0.12, 2.0]}, "astern or stopped", True), ({"u": [0.08, 2.0]}, "astern or stopped", False),
    ({"u": [0.08, 2.0]}, "outside of surge speed 0.0800 to 2.00 m/s", True),
    ({"n_P": [0.5, 2.0]}, "with the propeller stopped or reversed", True),
    ({"n_P": [0.0, 2.0]}, "with the propeller stopped or reversed", False),
    ({"n_bow": [0.5, 2.0]}, "with the propeller stopped or reversed", False),
    ({"r": [0.01, 0.02]}, "for turns to port", True), ({"r": [-0.02, -0.01]}, "for turns to starboard", True),
    ({"r": [-0.01, 0.01]}, "for turns to port", False), ({"r": [-0.01, 0.01]}, "for turns to starboard", False),
    ({}, "with rudder angles beyond −35.0 to 20.0°", True), ({}, "in wind above 8.00 m/s", True), ({}, WAVES, True),
    ({"U_T": [0.0, 0.0]}, "in wind: no trial of the fit had any on record", True),
    ({"H_S": [0.0, 1.5]}, "in waves above 1.50 m", True), ({"H_S": [0.0, 1.5]}, WAVES, False), ({}, DEPTH, True),
    ({"depth": [10.0, 20.0]}, "in water of other depth than depth 10.0 to 20.0 m", True),
    ({"depth": [10.0, 20.0]}, DEPTH, False),
])  # fmt: skip
def test_it_must_not_be_used_where_its_trials_did_not_go(covered: Any, line: str, told: bool) -> None:
    assert (line in ranging(**covered)) == told


def test_without_ranges_it_says_so() -> None:
    bare = card(summary=summary_of(grounds={"trials": TRIALS}))
    assert "where its trials did not go: the ranges were not kept" in forbidden(bare)
    assert DEPTH not in forbidden(bare)


def test_purposes_that_are_not_shown_are_forbidden() -> None:
    told = forbidden(card(uses=(use(FIT, "x"), use(NOT_FIT, "y"), use(OPEN, "z")), unjudged={"w": "no trial"}))
    assert told[:3] == ("for y: errors are greater than that use accepts",
        "for z without more trials: they cannot tell",
                        "for w: it has not been judged for that")  # fmt: skip
    assert page(card(uses=(use(NOT_FIT, "y"),))).document["must_not"][0] == told[0]


def test_bands_are_called_narrow_only_beyond_chance() -> None:
    """The limit is .9, or three standard deviations of a binomial share below .95, whichever is less."""
    assert _least(100_000) == 0.9
    for windows in (9, 16, 100, 150):
        rng = np.random.default_rng(1)
        shares = rng.binomial(windows, 0.95, 200_000) / windows
        assert _least(windows) == pytest.approx(min(0.9, 0.95 - 3.0 * shares.std()), abs=2e-3)
    few = Held("all kinds", 20.0, 16, 3, {"position": 0.79, "heading": 0.99, "speeds": 0.99}, WIDE, ERRORS)
    told = "with its bands as a margin: where 95 % are claimed, "
    assert not any(line.startswith(told) for line in forbidden(card(rows=(few,))))
    for held, said in (({"position": 0.78, "heading": 0.7}, "70 %"), ({"position": 0.99, "heading": 0.78}, "78 %")):
        assert told + f"{said} held" in forbidden(card(rows=(replace(few, inside=held),)))
    many = replace(few, windows=5000, inside={"position": 0.893})
    assert told + "89 % held" in forbidden(card(rows=(many,)))
    assert not any(line.startswith(told) for line in forbidden(card(rows=(replace(many, inside={"position": 0.907}),))))
    kinds = (replace(few, kind="zigzag", inside={"position": 0.1}), few)
    assert not any(line.startswith(told) for line in forbidden(card(rows=kinds))), "of all kinds together only"
    assert pooled(card(rows=kinds)) == (few,)
    held = tuple(Held(kind, 5.0, 5000, 3, {"position": share}, WIDE, WIDE)
                 for kind, share in (("zigzag", 0.1), ("all kinds", 0.6)))  # fmt: skip
    found = Calibrated(8, (), 25.0, held, (), ())
    assert told + "60 % held" in forbidden(card(rows=(few,), calibrated=found))
    assert "where an error must be known: no unseen trial has been judged" in forbidden(
        card(rows=(), calibrated=replace(found, unseen=())))  # fmt: skip


def test_numbers_that_are_not_identified_are_no_physics() -> None:
    weak = "to read its numbers as physics: 1 of 2 parameters are not, or weakly, identified"
    assert weak in forbidden(card())
    pair = Verdict("hull.Y_v and rudder.t_R", "weak", "")
    sure = tuple(replace(v, status=s) for v, s in zip(card().fit.verdicts, ("identified", "conditional"), strict=True))
    known = replace(card().fit, verdicts=(*sure, pair))
    assert not any("physics" in line for line in forbidden(card(fit=known)))
    bad = card(fit=known, summary=replace(card().summary, diagnosis={"explained": False}))
    assert forbidden(bad)[-1] == "to read its numbers as physics: the residuals contradict the model"
