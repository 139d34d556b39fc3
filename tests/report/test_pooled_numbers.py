"""Errors pooled over trials, and the numbers of runs of a campaign, against sums by hand."""

from __future__ import annotations

import math
import re
from types import SimpleNamespace
from typing import Any

import pytest

from seatrial.campaign.analysis.proportion import Proportion
from seatrial.report import figures
from seatrial.report import report as pages
from seatrial.report.campaign import _criteria
from seatrial.report.campaign.shown import Unit
from seatrial.report.page import html


def evidence(*trials: dict[str, dict[float, dict[str, float]]]) -> Any:
    """Errors at some seconds after a restart, by label, of each trial."""
    found = {
        str(k): {label: SimpleNamespace(horizons=one) for label, one in each.items()} for k, each in enumerate(trials)
    }
    return SimpleNamespace(labels=("fitted", "published"), trials=found)


def test_errors_are_pooled_over_the_trials_that_all_models_predict() -> None:
    both = {
        "fitted": {10.0: {"x": 3.0, "y": 4.0}, 30.0: {"x": 6.0, "y": 8.0}},
        "published": {10.0: {"x": 1.0, "y": 0.0}},
    }
    more = {"fitted": {10.0: {"x": 0.0, "y": 1.0}, 30.0: {"x": math.nan, "y": 1.0}}, "published": {}}
    alone = {"fitted": {10.0: {"x": 99.0, "y": 99.0}}}
    report = evidence(both, more, alone)
    pooled = pages._pooled_horizon(report, "fitted", ("x", "y"), 2.0)
    assert pooled == pytest.approx({10.0: 2.0 * math.sqrt((25.0 + 1.0) / 2.0), 30.0: 2.0 * 10.0})
    assert pages._pooled_horizon(report, "published", ("x", "y"), 1.0) == pytest.approx({10.0: 1.0})


def test_a_model_without_errors_has_no_curve(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[Any] = []
    monkeypatch.setattr(figures, "horizon", lambda curves, styles, what: drawn.append((what, curves)) or "<svg/>")
    zero = {"fitted": {10.0: {"x": 3.0, "y": 4.0}}, "published": {10.0: {"x": 0.0, "y": 0.0}}}
    styles: Any = {}
    pages._horizons(evidence(zero), styles)
    assert [list(curves) for _, curves in drawn] == [["fitted"]]
    assert drawn[0][1]["fitted"] == pytest.approx({10.0: 5.0})


def test_criteria_tell_runs_violations_and_how_many_more_are_needed() -> None:
    none, some = Proportion(0, 200), Proportion(20, 200)
    common = {"name": "first_overshoot", "index": "first_overshoot", "case": 0, "low": -math.inf, "high": 0.1}
    rows = [SimpleNamespace(**common, violated=one, missing=k) for k, one in enumerate((none, some))]
    analysis: Any = SimpleNamespace(judged=rows, cases=("a",))
    page = html(_criteria(analysis, {"first_overshoot": Unit.of("rad")}))
    cells = [re.sub(r"&[a-z]+;", ">", cell) for cell in re.findall(r"<td[^>]*>(.*?)</td>", page)]
    first, second = cells[:8], cells[8:16]
    assert (first[3], first[4], first[6]) == ("200", "0", "0")
    assert (second[3], second[4], second[6]) == ("200", "20", "1")
    assert first[7].startswith("> ")
    assert not second[7].startswith("> ")
    # a half width of a tenth of p takes (1.96/0.1)^2 (1 - p)/p runs
    assert float(second[7]) == pytest.approx((1.96 / 0.1) ** 2 * 0.9 / 0.1, rel=0.05)
    low, high = (float(x) for x in re.findall(r"[\d.]+", second[5])[1:3])
    assert low == pytest.approx(0.0622, abs=1e-3)  # Clopper and Pearson of 20 in 200
    assert high == pytest.approx(0.1502, abs=1e-3)
