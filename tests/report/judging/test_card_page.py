"""Each number and line of a model card, against those that it is made of."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from example_report import fit
from seatrial.belief.bands.calibration import Errors
from seatrial.belief.bands.held import Held
from seatrial.campaign.analysis.proportion import Proportion
from seatrial.identify import Verdict
from seatrial.report.judging.card import Calibrated, Card, forbidden, page, pooled
from seatrial.report.judging.fans import narrow
from seatrial.study.grounds import Plane
from seatrial.validate.fitness import FIT, NOT_FIT, OPEN, Fitness, Found, Limit
from shown import items, tables, tiles, words
from summaries import summary_of

ERRORS = {"x": 7.2, "y": 9.6, "psi": math.radians(3.0), "u": 0.11, "v_m": 0.07, "r": math.radians(0.25)}
def rows_of(
    kind: str, horizon: float, windows: int, inside: dict[str, float], error: dict[str, float] | None = None
) -> Held:
    """Windows of three trials that are alike."""
    between = {name: Proportion(share * windows, windows).interval for name, share in inside.items()}
    return Held(kind, horizon, windows, 3, inside, between, WIDE, error or ERRORS)


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
    limit = Limit("drift", "about", "position", 1.25, "m", "5.1", "low speed", 3.0)
    found = (Found(limit, {"a": (value,)}, value, 0.4, 0.6, verdict, "why"),
             Found(replace(limit, key="stop"), {}, math.nan, 0.0, 0.0, verdict, "why"))  # fmt: skip
    return Fitness("p", title, found, 4.0)


def card(**changes: Any) -> Card:
    own = replace(fit(), ship=SimpleNamespace(name="boat", L_pp=7.0, model=SimpleNamespace(draught=0.5)))
    summary = summary_of(grounds={"trials": TRIALS, "covered": COVERED, "kinds": ["zigzag", "turning"]},
                   provenance={"trained_on": ["a", "b", "c"]}, diagnosis={"explained": True})  # fmt: skip
    rows = (rows_of("zigzag", 10.0, 40, HELD), rows_of("zigzag", 20.0, 30, HELD),
            rows_of("all kinds", 10.0, 900, HELD, {**ERRORS, "x": 3.6, "y": 4.8}),
            rows_of("all kinds", 20.0, 700, {**HELD, "speeds": 0.91}, {**ERRORS, "x": 9.0, "y": -12.0}))  # fmt: skip
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
    assert tiles(html) == [("15 m", "position error (rms) 20 s after a start"), ("3.0°", "heading error (rms)"),
                           ("93 % (91–95)", "of positions within bands of 95 %")]  # fmt: skip
    assert "explain" not in html
    bad = card(missing=("gone: x",), summary=replace(card().summary, diagnosis={"explained": False}))
    told = items(page(bad).sections[0].html)
    assert told == ["The model does not explain the trials of its fit: its sigmas count what these trials disagree by, "
                    "and its bands what that tells of its form.",
                    "gone: x"]  # fmt: skip
    wide = replace(bad, widened=True)
    assert items(page(wide).sections[0].html)[0].endswith("its sigmas count what these trials disagree by.")
    assert page(bad).document["explained"] is False
    assert page(card(summary=summary_of())).document["explained"] is None


def test_errors_and_what_bands_held_stand_apart_beside_what_trials_were_corrected_by() -> None:
    one = page(card(changes=("d: corrected by a current of 0.25 m/s towards 60 deg",)))
    body = next(s for s in one.sections if s.title == "Error and coverage on unseen trials").html
    errors, held = tables(body)
    assert [row[:4] for row in errors] == [row[:4] for row in held], "the same rows"
    assert errors[-1][4] == "15"
    assert held[0][4:] == ["held: position", "heading", "speeds"]
    assert held[-1][4].startswith("93 %")
    assert max(map(len, (*errors, *held))) <= 9, "a wider one is cut off where it is read"
    assert items(body) == one.document["changes"] == ["d: corrected by a current of 0.25 m/s towards 60 deg"]


def test_a_calibration_replaces_the_share_of_the_draws_at_the_head() -> None:
    inside = {"position": 0.97, "heading": 0.9, "speeds": 0.9}
    held = tuple(rows_of("all kinds", end, 50, {**inside, "position": share}, WIDE)
                 for end, share in ((5.0, 0.91), (20.0, 0.97)))  # fmt: skip
    found = Calibrated(8, ("zigzag", "turning"), 25.0, held, (), ("little",))
    one = page(card(calibrated=found))
    assert tiles(one.sections[0].html)[-1][0] == "97 % (88–100)"
    body = next(s for s in one.sections if s.title == "Bands that hold").html
    assert "calibrated on 8 recordings that fits left out in turn; kinds: zigzag, turning. They hold up to 25 s" in body
    assert items(body) == ["little"]
    assert "Too few recordings" in body
    nine = "90 % (78–97)"
    assert [row[:6] for row in tables(body)[0][1:]] == [
        ["all kinds", "5.00", "50", "91 % (79–97)", nine, nine],
        ["all kinds", "20.0", "50", "97 % (88–100)", nine, nine],
    ]
    told = one.document["bands"]
    assert (told["level"], told["recordings"], told["reach"], told["doubts"]) == (0.95, 8, 25.0, ["little"])
    assert [row["horizon"] for row in told["unseen"]] == [5.0, 20.0]
    assert told["left_out"] == []
    other = page(card(calibrated=replace(found, unseen=(), left_out=held[:1])))
    body = next(s for s in other.sections if s.title == "Bands that hold").html
    assert "No unseen trial is at hand" in body
    assert len(tables(body)) == 1
    assert tiles(other.sections[0].html)[-1][0] == "93 % (91–95)", "of the draws, where none is unseen"
    assert page(card()).document["bands"] is None


def test_ranges_stand_in_two_halves_in_the_units_of_people() -> None:
    body = page(card()).sections[1].html
    left, right = (rows[1:] for rows in tables(body))
    assert left == [["Froude number u/√(g L)", "0.0603", "0.241", "-"], ["surge speed", "0.500", "2.00", "m/s"],
                    ["rate of turn", "−1.15", "1.15", "°/s"], ["rudder", "−35.0", "20.0", "°"]]  # fmt: skip
    assert right == [["propeller", "−1.00", "2.00", "1/s"], ["wind", "0", "8.00", "m/s"],
                     ["wave height", "none", "on record", ""], ["depth", "none", "on record", ""]]  # fmt: skip
    one = card()
    shallow = replace(one.grounds, covered={**one.grounds.covered, "depth": (1.0, math.inf)})
    found = tables(page(replace(one, summary=replace(one.summary, grounds=shallow))).sections[1].html)
    assert ["depth over draught", "2.00", "deep", "-"] in found[0]
    drawn = replace(one.grounds, tested=(Plane("u", "r", ((0.5, 0.0), (2.0, -0.02), (2.0, 0.02))),))
    told = page(replace(one, summary=replace(one.summary, grounds=drawn)))
    assert "Tested together" in told.sections[1].html
    assert any("not tested together" in line for line in told.document["must_not"])
    assert not any("not tested together" in line for line in page(one).document["must_not"])
    assert "Tested together" not in body
    assert "Kinds of manoeuvre: zigzag, turning." in body
    assert "seatrial simulate --bands refuses it" in body
    assert "refuses" not in page(card(widened=True)).sections[1].html
    assert card().grounds.covered["depth"] == (math.inf, math.inf)


def test_errors_are_rows_in_degrees_with_shares_of_the_bands() -> None:
    body = page(card()).sections[2].html
    found, shares = tables(body)
    assert found[1] == ["zigzag", "10", "3", "40", "12", "3.0", "0.11", "0.070", "0.25"]
    assert shares[1] == ["zigzag", "10", "3", "40", "93 % (80–99)", "96 % (85–100)", "88 % (74–96)"]
    assert [row[:4] for row in found[2:]] == [["zigzag", "20", "3", "30"], ["all kinds", "10", "3", "900"],
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
        ["berthing", "fit", "drift: fit (0.500 m of 1.25 m, 95 %: 0.400 to 0.600; 1 error in 1 trial; why); "
                            "stop: fit (why)"],
        ["towing", "not judged", "no trial"],
    ]  # fmt: skip
    body = next(s for s in one.sections if s.title.startswith("Fit for which")).html
    place = "error of the place 3 L/U (12 s) after a start in the measured state, in windows"
    assert items(body)[0] == (
        f"drift: about; {place} at low speed (F_n below 0.05); at most 1.25 m (Sawada 2024 section 5.1)")  # fmt: skip
    assert "1.64 times the root mean square error" in words(body)
    assert "m: of the ship at full scale" in words(body)


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
    """Where the interval of the share excludes what is claimed; of many windows, where it is below .9."""
    told = "with its bands as a margin: where 95 % are claimed, "

    def said(*rows: Held, **changes: Any) -> list[str]:
        return [line.removeprefix(told) for line in forbidden(card(rows=rows, **changes)) if line.startswith(told)]

    few = rows_of("all kinds", 20.0, 22, {"position": 19 / 22, "heading": 0.99, "speeds": 0.99})
    assert said(few) == []
    assert said(rows_of("all kinds", 20.0, 22, {"position": 18 / 22, "heading": 0.99})) == [
        "82 % (60–95) of 22 windows held (position, 20 s ahead)"]  # fmt: skip
    assert said(rows_of("all kinds", 20.0, 3, {"position": 1 / 3})) == [
        "33 % (1–91) of 3 windows held (position, 20 s ahead)"]  # fmt: skip
    assert said(rows_of("all kinds", 20.0, 2, {"position": 0.5})) == [], "one of two: as many as 99 %"
    both = rows_of("all kinds", 20.0, 16, {"position": 0.5, "heading": 0.3})
    assert said(few, both) == ["30 % (10–57) of 16 windows held (heading, 20 s ahead)"]
    many = rows_of("all kinds", 20.0, 5000, {"position": 0.893})
    assert said(many) == ["89 % (88–90) of 5000 windows held (position, 20 s ahead)"]
    assert said(rows_of("all kinds", 20.0, 5000, {"position": 0.907})) == []
    kinds = (rows_of("zigzag", 20.0, 16, {"position": 0.1}), few)
    assert said(*kinds) == [], "of all kinds together only"
    assert pooled(kinds) == (few,)
    held = tuple(rows_of(kind, 5.0, 5000, {"position": share}) for kind, share in (("zigzag", 0.1), ("all kinds", 0.6)))
    found = Calibrated(8, (), 25.0, held, (), ())
    assert said(few, calibrated=found) == ["60 % (59–61) of 5000 windows held (position, 5 s ahead)"]
    assert "where an error must be known: no unseen trial has been judged" in forbidden(
        card(rows=(), calibrated=replace(found, unseen=())))  # fmt: skip
    assert narrow(rows_of("all", 1.0, 9, {"position": math.nan, "heading": 1.0}), 0.95) == ""


def test_the_error_of_the_hardest_way_of_leaving_out_is_quoted_with_its_spread() -> None:
    errors = {"recording": Errors(0.21, (0.13, 0.2, 0.3)), "speed": Errors(0.233, (0.1, 0.2, 0.4)),
              "wind": Errors(0.22, (0.18, 0.26))}  # fmt: skip
    found = Calibrated(8, ("zigzag",), 25.0, (), (), (), errors)
    one = page(card(calibrated=found))
    # sd of .1, .2 and .4 with n - 1
    told = "standardised error of trials left out by speed, ± over parts"
    assert tiles(one.sections[0].html)[-1] == ("0.23 ± 0.15", told)
    body = next(s for s in one.sections if s.title == "Bands that hold").html
    assert [row[0] for row in tables(body)[0][1:]] == ["by speed", "by wind", "by turns"]
    assert tables(body)[0][1] == ["by speed", "3", "0.233", "0.15", "0.400"]
    assert one.document["bands"]["errors"]["speed"]["spread"] == pytest.approx(math.sqrt(7.0 / 3.0) / 10.0)
    turns = page(card(calibrated=replace(found, errors={"recording": errors["recording"]})))
    assert tiles(turns.sections[0].html)[-1][1] == "standardised error of trials left out by turns, ± over parts"
    assert "standardised" not in page(card(calibrated=replace(found, errors={}))).sections[0].html


def test_numbers_that_are_not_identified_are_no_physics() -> None:
    weak = "to read its numbers as physics: 1 of 2 parameters are not, or weakly, identified"
    assert weak in forbidden(card())
    pair = Verdict("hull.Y_v and rudder.t_R", "weak", "")
    sure = tuple(replace(v, status=s) for v, s in zip(card().fit.verdicts, ("identified", "graded"), strict=True))
    known = replace(card().fit, verdicts=(*sure, pair))
    assert not any("physics" in line for line in forbidden(card(fit=known)))
    bad = card(fit=known, summary=replace(card().summary, diagnosis={"explained": False}))
    assert forbidden(bad)[-1] == "to read its numbers as physics: the residuals contradict the model"
