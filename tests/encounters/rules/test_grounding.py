"""Ships over a chart: the hull and not midship, the safety contour apart from the bottom, dangers apart from both."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kinematic import Sailed, tracks
from seatrial.core.errors import ChartError, RequestError
from seatrial.encounters.rules.grounding import grounding
from seatrial.environment.chart import Area, Chart, Spot

SHOAL = np.array([[1000.0, 50.0], [2000.0, 50.0], [2000.0, 900.0], [1000.0, 900.0]])
CHART = Chart("shoal", 30.0, (Area(SHOAL, 8.0),))


def north(east: float) -> object:
    """A ship of 200 m by 33.3 m that goes north, this far east."""
    return tracks([Sailed(0.0, east, 0.0, 8.0)], T=300.0, dt=2.0)


@pytest.mark.parametrize(("east", "least"), [(0.0, 30.0), (30.0, 30.0), (40.0, 8.0), (100.0, 8.0)])
def test_the_side_grounds_before_midship(east: float, least: float) -> None:
    """The shoal begins 50 m east, the side is 16.7 m off: from 33.3 m on it is over the shoal."""
    (one,) = grounding(north(east), CHART, [10.0], [12.0])
    assert one.under_keel == pytest.approx(least - 10.0)
    assert bool(one.fails) == (least < 10.0)


def test_the_bow_grounds_first() -> None:
    """The shoal begins 1000 m north, the bow is 100 m ahead: at 8 m/s after 112.5 s."""
    (one,) = grounding(north(100.0), CHART, [10.0], [12.0])
    assert one.t == pytest.approx(900.0 / 8.0, abs=2.0)


def test_the_safety_contour_is_apart_from_the_bottom() -> None:
    (one,) = grounding(north(100.0), CHART, [6.0], [10.0])
    assert (float(one.under_keel), float(one.safe)) == (2.0, -2.0)
    assert not one.fails


@pytest.mark.parametrize(("east", "met"), [(0.0, True), (15.0, True), (18.0, False)])
def test_a_danger_counts_within_the_hull(east: float, met: bool) -> None:
    chart = replace(CHART, dangers=(Spot(500.0, east, "WRECKS", 3.0),))
    (one,) = grounding(north(0.0), chart, [6.0], [10.0])
    assert bool(one.fails) == met
    assert one.danger == (pytest.approx(-3.0) if met else np.inf)
    assert one.under_keel == pytest.approx(24.0)


def test_what_lies_between_two_rows_counts() -> None:
    """A row each 50 s, 400 m: the danger and a shoal of 40 m are passed between two of them."""
    made = tracks([Sailed(0.0, 0.0, 0.0, 8.0)], T=300.0, dt=50.0)
    low = Area(np.array([[980.0, -60.0], [1020.0, -60.0], [1020.0, 60.0], [980.0, 60.0]]), 5.0)
    (one,) = grounding(made, Chart("a", 30.0, (low,), dangers=(Spot(600.0, 0.0, "OBSTRN", 1.0),)), [6.0], [8.0])
    assert (float(one.under_keel), float(one.danger)) == (-1.0, -5.0)
    assert one.t == pytest.approx(900.0 / 8.0, abs=10.0)


def test_many_runs_at_once() -> None:
    runs = [north(east) for east in (0.0, 40.0)]
    both = replace(runs[0], **{name: np.stack([getattr(one, name) for one in runs])
                               for name in ("x", "y", "psi", "u", "v_m")})  # fmt: skip
    (one,) = grounding(both, CHART, [10.0], [12.0])
    assert one.fails.tolist() == [False, True]


def test_a_chart_without_depth_is_refused() -> None:
    with pytest.raises(ChartError, match="no depths"):
        grounding(north(0.0), Chart("bare", fairways=(SHOAL,)), [6.0], [8.0])
    with pytest.raises(RequestError, match="as many draughts at most"):
        grounding(north(0.0), CHART, [6.0], [5.0])
