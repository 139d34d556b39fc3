"""Tables, sentences and lists of the report of a fit or a validation, against hand-made comparisons."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from example_report import fit, report
from seatrial.belief.foresight import Foresight
from seatrial.data import Trial
from seatrial.identify import Verdict
from seatrial.identify.filters import CONSTANT_VELOCITY
from seatrial.report import report as pages
from seatrial.report.evidence import Assumption, caveats
from seatrial.report.printed import Row, fields, side_by_side
from seatrial.report.report import Report
from seatrial.validate.comparison import Comparison, compare
from shown import html, items, tables, tiles, words

T = np.arange(101.0)
SIGMA = {"x": 2.0, "y": 2.0, "psi": 0.1, "u": 0.5, "v_m": 0.5, "r": 0.01}


def measured(name: str = "a", **channels: Any) -> Trial:
    own = {"x": 1.5 * T, "y": 0.0 * T, "psi": 0.001 * T, "u": 1.5 + 0.0 * T, "v_m": 0.0 * T, "r": 0.001 + 0.0 * T}
    return Trial(name, T, {**own, **channels}, meta={"kind": "course"})


def off(trial: Trial, label: str, restart: float | None = None, sigma: Any = None, **errors: float) -> Comparison:
    """A prediction that is off by a constant in each channel named."""
    guess = trial.having(**{name: trial[name] + by for name, by in errors.items()})
    return compare(trial, guess, label=label, restart=restart, sigma=sigma or SIGMA)


def made(*comparisons: Comparison, **given: Any) -> Report:
    return Report("t", tuple(comparisons), **given)


def test_the_pooled_error_weighs_trials_by_samples_and_leaves_out_those_not_all_predict() -> None:
    short = measured("b").rows(slice(0, 51))
    one = made(off(measured(), "fitted", x=2.0), off(short, "fitted", x=4.0), off(measured("c"), "fitted", x=99.0),
               off(measured(), "published", y=2.0), off(short, "published"))  # fmt: skip
    assert one.pooled["fitted"] == pytest.approx((101 * 1.0 + 51 * 4.0) / 152)
    assert one.pooled["published"] == pytest.approx(101 / 152)
    assert one.labels == ("fitted", "published")
    (rows,) = tables(pages._trial_table(one))
    assert rows[0][5:] == ["fitted", "published"]
    assert rows[1] == ["a", "course", "not known", "100", "101", "*1.00", "*1.00"]
    assert rows[2] == ["b", "course", "not known", "50", "51", "4.00", "*0"]
    assert rows[3][5:] == ["2450", "–"]
    seen = replace(one, trained_on=("b",))
    assert [row[2] for row in tables(pages._trial_table(seen))[0][1:]] == ["unseen", "fitted", "unseen"]


def test_errors_by_state_are_in_degrees() -> None:
    angle = math.radians(3.0)
    one = made(off(measured(u=1.5 + 0.01 * T), "fitted", psi=angle, r=-math.radians(0.5), u=0.25))
    (rows,) = tables(pages._channels(one))
    found = {row[2]: row for row in rows[1:]}
    assert found["psi"][3:6] == ["°", "3.00", "3.00"]
    assert found["r"][3:6] == ["°/s", "0.500", "−0.500"]
    assert found["u"][3:6] == ["m/s", "0.250", "0.250"]
    variance = float(np.var(0.01 * T))
    assert float(found["u"][6].replace("−", "-")) == pytest.approx(1.0 - 0.25**2 / variance, abs=6e-3)
    assert float(found["u"][7].replace("−", "-")) == pytest.approx(0.0, abs=1e-20), "a constant error has no variance"
    assert found["x"][8] == "101"


def test_indices_have_their_error_in_percent_of_the_measured() -> None:
    one = off(measured(), "fitted")
    told = replace(one, indices={"advance": (10.0, 12.0), "first_overshoot": (math.radians(-8.0), math.radians(-6.0)),
                                 "none": (0.0, 1.0)}, index_units={"advance": "m",
                                     "first_overshoot": "rad"})  # fmt: skip
    (rows,) = tables(pages._indices(made(told)))
    assert rows[1] == ["a", "fitted", "advance", "m", "10.0", "12.0", "2.00", "20"]
    assert rows[2] == ["a", "fitted", "first overshoot", "°", "−8.00", "−6.00", "2.00", "25"]
    assert rows[3][3:] == ["", "0", "1.00", "1.00", "–"]
    assert pages._indices(made(one)) == ()


@pytest.mark.slow
def test_the_fit_has_bounds_shrinkage_and_verdicts() -> None:
    (rows,) = tables(pages._fit(fit()))
    assert rows[1] == ["hull.Y_v", "−0.3000", "−0.3100", "0.010", "−0.500 … 0", "yes", "0.99", "identified"]
    assert rows[2] == ["rudder.t_R", "0.3900", "0.4000", "0.090", "–", "", "0.10", "not identified"]
    assert items(pages._fit(fit())) == ["rudder.t_R: needs a <zigzag>"]
    assert "converged; 1.20 s, 30 evaluations, loss 0.5000." in words(pages._fit(fit()))
    one = replace(fit(), history=fit().history[:1], nuisances={"a": {"current_x": 0.1}, "b": {"bias_r": -0.02}})
    assert "Loss over the iterations" not in html(pages._fit(one))
    assert tables(pages.along(one))[0] == [["trial", "current_x", "bias_r"], ["a", "0.100", "–"], ["b", "–", "−0.0200"]]
    assert pages.along(fit()) == ()


def test_forecasts_are_listed_by_trial_and_horizon() -> None:
    rows = (Foresight("b", "fitted", 10.0, 5, 0.3, 0.05, 0.6), Foresight("a", "fitted", 20.0, 4, 0.4, 0.02, 0.7),
            Foresight("a", "fitted", 10.0, 3, 1.3, 0.01, 0.5))  # fmt: skip
    (found,) = tables(pages._forecasts(made(forecasts=rows)))
    assert found[1:] == [["a", "fitted", "10", "3", "1.30", "0.573", "0.500"],
                         ["a", "fitted", "20", "4", "0.400", "1.15", "0.700"],
                         ["b", "fitted", "10", "5", "0.300", "2.86", "0.600"]]  # fmt: skip


def test_the_shortest_forecasts_are_pooled_by_their_number() -> None:
    rows = (Foresight("a", "fitted", 10.0, 9, 1.0, math.radians(2.0), 0.0),
            Foresight("b", "fitted", 10.0, 3, 3.0, math.radians(4.0), 0.0),
            Foresight("a", "fitted", 30.0, 9, 99.0, 1.0, 0.0))  # fmt: skip
    place, turn = math.sqrt((9 * 1.0 + 3 * 9.0) / 12), math.sqrt((9 * 4.0 + 3 * 16.0) / 12)
    told = pages.sentence(made(off(measured(), "fitted"), forecasts=rows))
    assert told.endswith(
        f"Forecasts over 10 s, started from the filtered state: 'fitted' {place:.1f} m and {turn:.1f}°."
    )


@pytest.mark.parametrize(("restarts", "first", "told"), [
    ((None,), None, "over 1 trial, free-running from the first sample:"),
    ((50.0,), None, "over 1 trial, reset to the measured state every 50 s:"),
    ((50.0, 20.0), None, "over 2 trials, reset to the measured state every 20 or 50 s:"),
    ((None, 20.0), None, "reset to the measured state every 20 s or free-running from the first sample:"),
    ((None,), 30.0, "after the first 30 s, on which the start was estimated, free-running from there:"),
])  # fmt: skip
def test_the_sentence_says_how_it_was_predicted(restarts: Any, first: float | None, told: str) -> None:
    one = made(*(off(measured(str(k)), "fitted", r, x=1.0) for k, r in enumerate(restarts)), fit_first=first)
    assert told in pages.sentence(one)
    assert pages.sentence(one).endswith("'fitted' 0.250.")


def test_what_the_subject_loses_is_named_with_its_size() -> None:
    """The mean square of two trials by their samples; 2 % more is a tie."""
    short = measured("b").rows(slice(0, 51))
    one = made(
        off(measured(), "fitted", 50.0, psi=0.04, v_m=0.1, x=1.0),
        off(short, "fitted", 50.0, psi=0.02, x=1.0),
        off(measured(), "published", 50.0, psi=0.01, v_m=0.0985, x=2.0),
        off(short, "published", 50.0, psi=0.01),
    )
    lost = pages.worse(one, "published")
    mine = math.degrees(math.sqrt((101 * 0.04**2 + 51 * 0.02**2) / 152))
    assert lost == ["heading after 1, 2, 5, 10, 20, 50 s", f"psi ({mine:.2f}° against 0.573°)"]
    more = made(off(measured(), "fitted", v_m=0.1, r=math.radians(2.0)), off(measured(), "published", v_m=0.09))
    assert pages.worse(more, "published") == ["v_m (0.100 m/s against 0.0900 m/s)", "r (2.00°/s against 0°/s)"]
    (line,) = pages.against(more)
    assert line.startswith(
        "'fitted' against 'published': smaller standardised error in 0 of 1, but greater error of v_m ("
    )
    assert "; of r (" in line
    assert pages.against(made(off(measured(), "fitted", x=1.0), off(measured(), "published", x=2.0)))[0].endswith(
        "1 of 1"
    )


def test_errors_grow_by_horizon_as_the_root_of_the_mean_square() -> None:
    found = [SimpleNamespace(horizons=h) for h in ({10.0: {"x": 3.0, "y": 4.0}}, {10.0: {"x": 0.0, "y": 1.0}},
                                                   {10.0: {"x": 7.0}}, {30.0: {"x": 1.0, "y": 1.0}})]  # fmt: skip
    assert pages._grown(found, 10.0, ("x", "y")) == pytest.approx(math.sqrt((25.0 + 1.0) / 2))  # type: ignore[arg-type]
    assert math.isnan(pages._grown(found, 99.0, ("x", "y")))  # type: ignore[arg-type]


def test_worse_than_before_the_fit_says_on_which_trials() -> None:
    one = made(off(measured(), "fitted", x=2.0), off(measured(), "untuned", x=1.0))
    assert pages.worse_than_start(one) == {"fitted": 1.0, "untuned": 0.25}
    assert pages.worse_words(one)[0].endswith("error 1.00 against 0.250 before the fit, on these trials")
    assert pages.worse_words(replace(one, trained_on=("a",)))[0].endswith("on the training trials")
    assert pages.worse_words(replace(one, trained_on=("b",)))[0].endswith("on these trials")
    other = made(off(measured(), "fitted", x=2.0), off(measured(), "published", x=1.0))
    assert pages.worse_than_start(other) == {"fitted": 1.0, "untuned": 0.25}


@pytest.mark.slow
def test_beyond_a_dozen_trials_the_worst_are_drawn_worst_first(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[str] = []
    monkeypatch.setattr(pages.figures, "track", lambda some, styles, name: drawn.append(name) or "<svg></svg>")
    monkeypatch.setattr(pages.figures, "series", lambda some, styles, name: "<svg></svg>")
    several = [off(measured(str(k)), "fitted", x=0.1 * k) for k in range(1, 15)]
    body = html(pages._trials(made(*several), {}))
    assert drawn == [str(k) for k in range(14, 2, -1)]
    assert "The 12 of 14 trials with the largest error, worst first." in body
    drawn.clear()
    assert "worst first" not in html(pages._trials(made(*several[:12]), {}))
    assert drawn == [str(k) for k in range(1, 13)]
    whole = measured("blind")
    blind = Trial("blind", T, {"u": whole["u"], "psi": whole["psi"]})
    drawn.clear()
    pages._trials(made(compare(blind, blind, label="fitted", sigma={"u": 0.5})), {})
    assert drawn == []


def test_long_tables_fold() -> None:
    several = [off(measured(str(k)), "fitted", x=1.0) for k in range(21)]
    assert "<summary>126 rows</summary>" in html(pages._channels(made(*several)))
    assert "<summary>" not in html(pages._channels(made(*several[:20])))


def test_the_head_has_a_tile_for_each_label_and_one_scale() -> None:
    one = made(off(measured(), "fitted", x=1.0), off(measured(), "published", x=2.0), changes=("cut at 10 s",))
    head = pages._head(one)
    assert tiles(head) == [("0.250", "fitted"), ("1.00", "published")]
    assert "cut at 10 s" in items(head)
    assert "Errors divided by: x 2 m, y 2 m, psi 5.73 deg" in words(head)
    two = made(off(measured(), "fitted", x=1.0), off(measured("b"), "fitted", sigma={**SIGMA, "x": 1.0}))
    assert "Errors divided by" not in words(pages._head(two))
    assert "scaled by their own standard deviations" in words(pages._head(two))


def test_assumed_numbers_are_rows() -> None:
    several = tuple(Assumption(f"p.{k}", 1.0 + k, "m" * (k % 2), "a guess") for k in range(7))
    (rows,) = tables(pages._assumptions(made(assumptions=several)))
    assert rows[2] == ["p.1", "2.000", "m", "a guess"]
    line = next(c for c in caveats(made(off(measured(), "fitted"), assumptions=several)) if c.startswith("Assumed"))
    assert line == ("Assumed, neither measured nor fitted: p.0 = 1.00, p.1 = 2.00 m, p.2 = 3.00, p.3 = 4.00 m, "
                    "p.4 = 5.00, p.5 = 6.00 m, ....")  # fmt: skip
    six = caveats(made(off(measured(), "fitted"), assumptions=several[:6]))
    assert next(c for c in six if c.startswith("Assumed")).endswith("p.5 = 6.00 m.")


TURNING = math.radians(0.2)


@pytest.mark.parametrize(("given", "told", "there"), [
    ({}, "whether these are unseen is unknown", True),
    ({"trained_on": ("a",)}, "None of the 2 trials is unseen", False),
    ({"trained_on": ("a",)}, "1 of 2 trials were used in the fit (a): too optimistic", True),
    ({"trained_on": ("a", "b")}, "None of the 2 trials is unseen", True),
    ({"trained_on": ("z",)}, "used in the fit", False), ({"trained_on": ("z",)}, "not recorded", False),
    ({}, "There is one trial", False), ({}, "Free-running predictions from the first sample", True),
    ({"fit_first": 30.0}, "Free-running", False), ({"fit_first": 30.0}, "on its first 30 s", True),
    ({}, "Kinds of manoeuvre covered: course.", True), ({}, "Forward speed lay between 1.50 and 1.50 m/s", True),
    ({}, "No wind was recorded in any trial", True), ({}, "No current was recorded", True),
    ({}, "There is no constant-velocity baseline", True), ({}, "Not every label predicts", False),
    ({}, "scaled by their own", False), ({}, "turned almost only", False),
])  # fmt: skip
def test_caveats(given: Any, told: str, there: bool) -> None:
    one = made(off(measured(), "fitted"), off(measured("b"), "fitted"), **given)
    assert any(told in line for line in caveats(one)) == there


def test_caveats_on_restarts_sides_weather_and_baselines() -> None:
    wind = {"U_T": 0.0 * T, "gamma_T": 0.0 * T}
    turn = measured("turn", r=np.where(T < 4, -TURNING, TURNING), **wind, U_C=0.0 * T)
    port = measured("turn", r=-turn["r"], **wind)
    even = measured("turn", r=np.where(T < 8, -TURNING, TURNING), u=1.0 + 0.01 * T)
    slow = measured("slow", r=0.4 * np.where(T < 2, TURNING, -TURNING))
    lines = caveats(made(off(turn, "fitted", 20.0), off(measured("b"), "fitted", 50.0)))
    assert any(
        line.startswith("Predictions were reset to the measured state every 20.0 s or 50.0 s:") for line in lines
    )
    assert any(line.startswith("No wind was recorded in 1 of 2 trials") for line in lines)
    assert not any(line.startswith(("No current", "Free-running", "There is one trial")) for line in lines)
    assert any("only to starboard" in line for line in caveats(made(off(turn, "fitted"))))
    assert any("only to port" in line for line in caveats(made(off(port, "fitted"))))
    assert any(line.startswith("There is one trial") for line in caveats(made(off(port, "fitted"))))
    for one in (even, slow):
        assert not any("almost only" in line for line in caveats(made(off(one, "fitted"))))
    assert any("between 1.00 and 2.00 m/s" in line for line in caveats(made(off(even, "fitted"))))


def test_a_trial_that_not_every_label_predicts_is_named() -> None:
    one = made(off(measured(), "fitted"), off(measured("b"), "fitted"), off(measured(), CONSTANT_VELOCITY))
    assert "Not every label predicts b; the pooled errors leave these trials out." in caveats(one)
    assert not any("no constant-velocity" in line for line in caveats(one))


def test_caveats_count_verdicts_of_parameters_only() -> None:
    own = replace(fit(), verdicts=(*fit().verdicts, Verdict("hull.Y_v and rudder.t_R", "weak", "")))
    told = caveats(made(off(measured(), "fitted"), fit=own))
    assert any(line.startswith("1 of 2 parameters are not, or only weakly,") for line in told)
    assert not any("only if the form" in line for line in told)
    unsure = replace(own, verdicts=(Verdict("hull.Y_v", "graded", ""), Verdict("rudder.t_R", "identified", "")))
    told = caveats(made(off(measured(), "fitted"), fit=unsure))
    assert any(line.startswith("1 of 2 parameters are known within their ranges only if the form") for line in told)
    assert not any("only weakly" in line for line in told)


def test_the_numbers_are_those_of_the_comparisons() -> None:
    one = report()
    told = one.numbers()
    first = one.trials["arc"]["fitted"]
    assert told["trials"]["arc"]["fitted"]["samples"] == first.samples
    measured_, predicted = first.indices["tactical_diameter"]
    assert told["trials"]["arc"]["fitted"]["indices"]["tactical_diameter"] == {
        "measured": measured_, "predicted": predicted, "unit": "m"}  # fmt: skip
    assert told["fit"]["parameters"]["hull.Y_v"] == {
        "start": -0.3,
        "value": -0.31,
        "sigma": 0.01,
        "low": -0.5,
        "high": 0.0,
        "shrinkage": 0.99,
        "at_bound": True,
    }
    assert told["fit"]["parameters"]["rudder.t_R"]["at_bound"] is False
    assert list(told["worse"]) == list(one.labels[1:])


def test_printed_numbers_agree_to_half_of_their_last_digit() -> None:
    for printed, ours, same in ((0.31, 0.3149, True), (0.31, 0.3151, False), (12.0, 12.5, True), (12.0, 12.6, False),
                                (-0.31, -0.3051, True), (-0.31, 0.31, False), (0.3, math.nan, False)):  # fmt: skip
        assert Row("n", printed, ours).same == same
    assert Row("n", 0.310, 0.3102, digit=0.001).same
    assert not Row("n", 0.310, 0.3106, digit=0.001).same
    rows = [Row("C_T", 0.31, 0.3, "N", "rounded"), Row("how", "yes", "no"), Row("k", 2.0, 2.0)]
    (table,) = tables(side_by_side(rows))
    assert table[1:] == [["C_T [N]", "0.31", "0.3000", "rounded"], ["how", "yes", "no", "not explained"],
                         ["k", "2", "2.000", "as printed"]]  # fmt: skip
    assert fields(rows)[0] == {
        "name": "C_T",
        "printed": 0.31,
        "ours": 0.3,
        "unit": "N",
        "same": False,
        "why": "rounded",
    }
    assert html(side_by_side(rows)).count('<td class="text">') == 6
    assert '<td class="text">C_T [N]</td><td>0.31</td>' in html(side_by_side(rows))
