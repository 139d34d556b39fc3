"""What a terminal shows of a run: each number from its place in the document, in the unit of its column."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from seatrial.data import Trial
from seatrial.identify import Problem
from seatrial.report.blocks import Line, Table, plain_text
from seatrial.ships.files import load
from seatrial.study.study import Study
from seatrial.workflow import figure, reports
from seatrial.workflow.reports import comparisons, leads, sources

OUT, BACK = Path("run"), "trials kept back"


def table(block: object) -> Table:
    assert isinstance(block, Table)
    return block


def test_a_figure_is_a_number_or_a_dash() -> None:
    assert figure(math.pi) == "3.142"
    assert figure(math.pi, 2) == "3.1"
    assert figure(3) == "3"
    for none in (None, math.nan, math.inf, -math.inf, "3"):
        assert figure(none) == "–"


def test_a_fit_shows_parameters_combinations_errors_and_forecasts_in_degrees() -> None:
    parameters = {
        "hull.N_r": {"start": 1.0, "value": 2.0, "sigma": 0.123, "shrinkage": 0.987, "at_bound": False},
        "hull.Y_v": {"start": 3.0, "value": 4.0, "sigma": 0.5, "shrinkage": 0.25, "at_bound": True},
        "hull.R_0": {"start": 5.0, "value": 6.0, "sigma": 0.5, "shrinkage": 0.25, "at_bound": False},
    }
    pairs = [{"subject": f"pair {k}", "status": "identified", "text": f"rise together {k}"} for k in range(8)]
    found = {
        "parameters": parameters,
        "verdicts": [{"subject": "hull.N_r", "status": "identified", "text": ""}, *pairs],
        "standardised": {"fitted": 0.5, "untuned": 1.25}, "diagnosis": {"explained": True, "lines": ["like noise"]},
        "forecasts": [{"trial": "a", "horizon": 30.0, "label": "fitted", "position": 2.5, "heading": math.pi / 6}],
        "status": "converged", "seconds": 12.34,
    }  # fmt: skip
    first, *lines = reports._fit(found, OUT, BACK)
    assert table(first).head == ("parameter", "start", "fitted", "sigma", "± % (95 %)", "from data", "verdict")
    assert table(first).rows == (("hull.N_r", "1", "2", "0.12", "12", "0.99", "identified"),
                                 ("hull.Y_v", "3", "4", "0.5", "24", "0.25", "at bound"),
                                 ("hull.R_0", "5", "6", "0.5", "16", "0.25", ""))  # fmt: skip
    assert table(first).words == (6,)
    assert [*plain_text(tuple(lines))] == [
        *(f"pair {k}: rise together {k}" for k in range(6)), "... and 2 more combinations: see run/report.html",
        "like noise", "standardised error on trials kept back, fitted: 0.5",
        "standardised error on trials kept back, untuned: 1.25",
        "forecast of a over 30 s, fitted: 2.5 m, 30 deg", "converged; 12.3 s; wrote run/model.toml, run/report.html",
    ]  # fmt: skip
    six = {**found, "verdicts": pairs[:6], "parameters": {}, "diagnosis": None}
    first, *lines = reports._fit(six, OUT, reports._of(False))
    assert first == Line("pair 0: rise together 0")  # weights of a network are no parameters
    assert not any("more combinations" in line for line in plain_text(tuple(lines)))
    assert Line("standardised error on the training trials (none was kept back), fitted: 0.5") in lines


def test_a_fine_tuning_shows_the_sum_of_losses_and_what_is_chosen() -> None:
    def one(ratio: float, first: float, bounds: list[bool]) -> dict[str, Any]:
        return {"ratio": ratio, "tune": {"x": first, "y": 1.0}, "test": {"x": 2.0, "y": 2.5}, "left_out": {"x": 7.0},
                "apart": 0.123, "parameters": {str(k): {"at_bound": b} for k, b in enumerate(bounds)},
                "methods": {"a": {"seconds": 1.25}, "b": {"seconds": 0.5}}}  # fmt: skip

    found = {
        "untuned": {"tune": {"x": 5.0, "y": 6.0}, "test": {"x": 7.0, "y": 8.5}},
        "ranges": [one(0.1, 3.0, [True, False]), one(0.4, 2.0, [True, True])], "chosen": 0.4, "diagnosis": None,
        "findings": [{"severity": "warning", "where": "a", "text": "b"},
                     {"severity": "info", "where": "c", "text": "d"}],
    }  # fmt: skip
    first, *lines = reports._tuning(found, OUT)
    assert table(first).rows == (
        ("untuned", "11", "15.5", "", "", "", ""), ("0.1", "4", "4.5", "7", "1 of 2", "0.12", "1.2 + 0.5"),
        ("0.4 chosen", "3", "4.5", "7", "2 of 2", "0.12", "1.2 + 0.5"),
    )  # fmt: skip
    assert table(first).words == ()
    assert [*plain_text(tuple(lines))] == ["warning: a: b", "c: d", "wrote run/model.toml, run/report.html"]


def test_rivals_show_the_farthest_parameter_and_what_blows_up() -> None:
    scores = {"full": {"relative": {"u": 0.01, "v_m": 0.02, "r": 0.035}},
              "truth": {"relative": {"u": None, "v_m": 0.0, "r": 1.0}}}  # fmt: skip
    found = {
        "diagnosis": None,
        "cases": {"calm": {"scores": scores, "sigmas_off": {"a": 1.5, "b": -2.5},
                           "model_over_truth": {"x": 1.125, "y": 1.5}, "fits": {"full": {"parameters": [1, 2, 3]}}}},
        "servos": {"rudder": {"rate": 0.123456, "sigma": {"rate": 0.00125}}},
    }  # fmt: skip
    first, *lines = reports._shooting(found, OUT)
    assert table(first).rows == (("calm", "3 parameters", "1 %", "2 %", "3.5 %", "1.5", "2.5"),
                                 ("calm", "truth", "blows up", "0 %", "100 %", "", ""))  # fmt: skip
    assert table(first).words == (1,)
    assert [*plain_text(tuple(lines))] == ["rudder: 0.12346 rad/s +- 0.0013", "wrote run/model.toml, run/report.html"]


def test_a_table_of_fits_shows_means_with_their_spread() -> None:
    def one(seeds: list[int], **means: tuple[float | None, float | None]) -> dict[str, Any]:
        return {"seeds": seeds, "mean": {k: m for k, (m, _) in means.items()},
                "standard_deviation": {k: s for k, (_, s) in means.items()}}  # fmt: skip

    found = {
        "tests": ["t1"],
        "models": {"A": one([1, 2], t1=(0.1234, 0.0456), together=(0.5, None)),
                   "B": one([], t1=(None, None), together=(None, None)),
                   "C": one([1], t1=(None, None), together=(2.0, 0.5))},
        "claims": [{"says": "A beats B", "rows": [{"test": "t1", "verdict": "holds"},
                                                  {"test": "t2", "verdict": "open"}]}],
    }  # fmt: skip
    first, *lines = reports._table(found, OUT)
    assert table(first).head == ("standardised error", "seeds", "t1", "together")
    assert table(first).words == ()
    assert table(first).rows == (("A", "2", "0.123 +- 0.046", "0.5"), ("B", "0", "", ""),
                                 ("C", "1", "no number", "2 +- 0.5"))  # fmt: skip
    assert [*plain_text(tuple(lines))] == ["A beats B: t1: holds, t2: open", "wrote run/report.html, run/report.json"]


def test_comparisons_show_each_trial_and_the_pooled_ones_last() -> None:
    def error(value: float) -> Any:
        return SimpleNamespace(standardised=value)

    report = SimpleNamespace(labels=("fitted", "untuned"), pooled={"fitted": 0.5, "untuned": math.nan},
                             trials={"a": {"fitted": error(0.25), "untuned": error(1.0)}, "b": {"fitted": error(2.0)}})
    made = table(*comparisons(cast("Any", report)))
    assert made.head == ("standardised error", "fitted", "untuned")
    assert made.rows == (("a", "0.25", "1"), ("b", "2", "failed"), ("pooled", "0.5", "–"))
    assert made.words == ()


def test_what_speaks_against_a_run_names_the_trials_and_the_measure() -> None:
    base = {"diagnosis": {"explained": True, "lines": []}}
    worse = {**base, "worse_than_untuned": {"fitted": 2.0, "untuned": 1.0, "what": "loss"}}
    assert leads(worse, OUT, False) == ("worse than untuned: loss 2 against 1 before the fit, on the training trials",)
    one = {"diagnosis": {"explained": False, "lines": ["x"], "cause": "only this; that"}}
    assert leads(one, OUT, True) == ("not explained: only this; see run/report.html",)
    three = {**base, "not_explained": ["a", "b", "c"]}
    assert leads(three, OUT, True)[0].startswith("not explained: the data of 3 fits (a, b, c); ")
    chains = {**base, "posterior": {"converged": False, "words": ["the chains differ"]}}
    assert leads(chains, OUT, True) == ("the chains differ",)
    assert leads({**base, "posterior": {"converged": True, "words": ["fine"]}}, OUT, True) == ()


def trial(name: str, source: str = "") -> Trial:
    t = np.array([0.0, 1.0])
    return Trial(name, t, {"u": t}, meta={"source": source} if source else {})


def test_a_fit_is_judged_on_what_was_kept_back_else_on_what_it_was_trained_on() -> None:
    a, b, c = (trial(name) for name in "abc")

    def on(validation: tuple[Trial, ...], test: tuple[Trial, ...]) -> tuple[Trial, ...]:
        problem = Problem(load("kvlcc2_l7"), (a,), (), validation=validation)
        return Study("s", Path("s.toml"), problem, cast("Any", None), test, None, "d").judged_on

    assert on((b,), (c,)) == (b, c)
    assert on((), (c,)) == (c,)
    assert on((), ()) == (a,)


def test_a_source_is_told_once_and_empty_roles_are_not() -> None:
    assert sources([trial("a", "one"), trial("b", "two"), trial("c", "one"), trial("d")]) == "one; two; "
    roles = {"for training": [trial("a"), trial("b")], "for validation": [], "kept back": [trial("c")]}
    assert reports._counted(roles) == "2 for training, 1 kept back"


def test_what_all_trials_share_is_said_and_nothing_where_there_is_none() -> None:
    ship = load("kvlcc2_l7")

    def changes(nuisances: dict[str, dict[str, float]]) -> tuple[str, ...]:
        return reports._changes(cast("Any", SimpleNamespace(nuisances=nuisances, ship=ship)), [trial("a")])

    assert changes({}) == changes({"a": {"current.north": 1.0}}) == changes({"*": {"current.north": 0.0}}) == ()
    (line,) = changes({"*": {"current.north": 0.0, "current.east": -0.25}})
    assert "a current of 0.25 m/s towards 270 deg" in line
