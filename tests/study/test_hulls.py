"""What was tested together: hulls against brute force, and runs that leave them within the box of ranges."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import linprog

from fitted_run import trial
from seatrial.data import Trial
from seatrial.study.grounds import Grounds, Plane, of_trials, planes

CONTROLS = ("n_P", "delta")
WIDE = {"x": (-math.inf, math.inf, 0.0), "y": (-math.inf, math.inf, 0.0)}


def within(points: np.ndarray, at: np.ndarray, slack: tuple[float, float]) -> bool:
    """Whether some mean of the points lies within the slack of `at`: a linear program."""
    ahead = np.vstack([points.T, -points.T])
    bound = np.array([at[0] + slack[0], at[1] + slack[1], slack[0] - at[0], slack[1] - at[1]])
    found = linprog(np.zeros(len(points)), A_ub=ahead, b_ub=bound, A_eq=np.ones((1, len(points))), b_eq=[1.0])
    return found.status == 0


@pytest.mark.slow
def test_a_point_is_outside_where_no_mean_of_tested_points_is_near_it() -> None:
    rng = np.random.default_rng(2)
    tested = rng.normal(size=(12, 2)) @ np.array([[1.0, 0.8], [0.0, 0.3]])
    (plane,) = planes({"x": tested[:, 0], "y": tested[:, 1]}, WIDE)
    slack = (0.2, 0.1)
    at = rng.uniform(-2.5, 2.5, (300, 2))
    over = plane.excess(at[:, 0], at[:, 1], slack)
    box = [low <= x <= high for x, y in at for low, high in ((tested[:, 0].min() - 0.2, tested[:, 0].max() + 0.2),)]
    tall = (at[:, 1] >= tested[:, 1].min() - 0.1) & (at[:, 1] <= tested[:, 1].max() + 0.1)
    told = (over <= 1.0) & np.array(box) & tall
    sure = np.abs(over - 1.0) > 0.05  # the hull is cut by up to a hundredth of its width
    right = np.array([within(tested, one, slack) for one in at])
    assert (told == right)[sure].all()
    assert 20 < right.sum() < 280


def test_a_hull_of_an_ellipse_reaches_its_edge_to_a_hundredth() -> None:
    angle = np.linspace(0.0, 2.0 * math.pi, 4001)
    (plane,) = planes({"x": 3.0 * np.cos(angle), "y": 0.01 * np.sin(angle)}, WIDE)
    assert 12 <= len(plane.corners) <= 24
    assert plane.across(0.0) == pytest.approx((-0.01, 0.01), rel=0.01)
    assert plane.across(1.5) == pytest.approx((-0.01 * math.sqrt(0.75), 0.01 * math.sqrt(0.75)), rel=0.02)
    assert plane.across(9.0) == pytest.approx((0.0, 0.0), abs=2e-3), "at the tested x that is nearest"
    ends = pairwise((*plane.corners, plane.corners[0]))
    area = 0.5 * sum(a * d - b * c for (a, b), (c, d) in ends)
    assert area == pytest.approx(math.pi * 0.03, rel=0.02), "counterclockwise"


def test_a_line_and_a_point_are_hulls_too() -> None:
    x = np.linspace(0.0, 2.0, 50)
    (line,) = planes({"x": x, "y": 2.0 * x}, WIDE)
    assert {(0.0, 0.0), (2.0, 4.0)} <= set(line.corners)
    assert all(high == 2.0 * low for low, high in line.corners)
    over = line.excess(np.array([1.0, 1.0, 1.0]), np.array([2.0, 2.3, 2.5]), (0.1, 0.1))
    assert (over <= 1.0).tolist() == [True, True, False]
    assert line.across(1.0) == pytest.approx((2.0, 2.0))
    (level,) = planes({"x": x, "y": np.full(50, 11.85)}, WIDE)
    assert level.across(0.0) == level.across(2.0) == (11.85, 11.85)
    assert {corner[0] for corner in level.corners} >= {0.0, 2.0}
    (point,) = planes({"x": np.ones(3), "y": np.zeros(3)}, WIDE)
    assert point.corners == ((1.0, 0.0),)
    assert not (point.excess(np.array([9.0]), np.array([9.0]), (0.1, 0.1)) > 1.0).any(), "its ranges hold it"
    assert point.across(3.0) == (0.0, 0.0)
    assert planes({"x": np.array([np.nan, 1.0]), "y": np.array([1.0, np.nan])}, WIDE) == ()


def test_outliers_beyond_the_ranges_make_no_corner() -> None:
    """Samples just beyond a range, whose thousandth at either end is left out, count as at its end."""
    x = np.array([0.0, 1.0, 0.5, 50.0, 1.05])
    y = np.array([0.0, 0.0, 1.0, 0.9, 0.7])
    (plane,) = planes({"x": x, "y": y}, {"x": (0.0, 1.0, 0.1), "y": (0.0, 1.0, 0.1)})
    assert set(plane.corners) == {(0.0, 0.0), (1.0, 0.0), (0.5, 1.0), (1.0, 0.7)}


@pytest.mark.slow
def test_a_turn_at_the_speed_of_the_approach_was_not_tested_by_a_turn_that_slows_it() -> None:
    """Within the range of each channel by itself; only together no trial had them."""
    turn = trial(35)
    found = of_trials([turn, trial(35, side=-1)], CONTROLS)
    assert {(one.x, one.y) for one in found.tested} >= {("u", "r"), ("v_m", "r"), ("u", "delta"), ("n_P", "delta")}
    assert found.beyond(trial(35, seed=3), CONTROLS) == ()
    least, most = (float(f(turn["u"])) for f in (np.min, np.max))
    fast = turn.having(u=np.full(len(turn), most))
    first, *_ = found.beyond(fast, CONTROLS)
    assert [name for name, _ in first.beside] != []
    assert first.channel in ("v_m", "r", "delta")
    assert first.covered[0] <= first.covered[1] < first.reached[0] or first.reached[0] < first.covered[0]
    boxes = Grounds(covered=found.covered)
    assert all(one.channel == "drift" for one in boxes.beyond(fast, CONTROLS))
    assert least < 0.6 * most
    told = found.beyond(turn.having(u=np.full(len(turn), 2.0 * most)), CONTROLS)
    assert next(one.channel for one in told if not one.beside) == "u"
    assert not any("u" in (one.channel, *dict(one.beside)) for one in told if one.beside), "told by itself already"


def test_motion_is_that_through_the_water() -> None:
    t = np.arange(0.0, 50.0)
    still = {"x": t, "y": 0.0 * t, "psi": 0.0 * t, "u": 1.0 + 0.0 * t, "v_m": 0.0 * t, "r": 0.0 * t}
    found = of_trials([Trial("still", t, still)], ())
    drifting = Trial("drifting", t, {**still, "u": 2.5 + 0.0 * t, "U_C": 1.5 + 0.0 * t, "gamma_C": 0.0 * t})
    assert found.beyond(drifting, ()) == ()
    assert found.covered == of_trials([drifting], ()).covered
    assert [one.channel for one in found.beyond(drifting.having(U_C=0.0 * t), ())] == ["u"]


def test_another_loading_is_beyond_trials_that_tell_theirs() -> None:
    one = replace(trial(20), meta={"draught": 0.30})
    found = of_trials([one], CONTROLS)
    assert found.covered["draught"] == (0.30, 0.30)
    (out,) = found.beyond(replace(one, meta={"draught": 0.25}), CONTROLS)
    assert (out.channel, out.reached) == ("draught", (0.25, 0.25))
    assert found.beyond(replace(one, meta={"draught": 0.31}), CONTROLS) == ()
    assert found.beyond(replace(one, meta={}), CONTROLS) == (), "not told"
    assert "draught" not in of_trials([trial(20)], CONTROLS).covered


def test_of_many_pairs_the_two_farthest_are_told() -> None:
    box = dict.fromkeys(("u", "v_m", "r", "delta"), (-1.0, 1.0))
    tip = ((-1.0, -1.0), (1.0, 1.0))
    found = Grounds(covered=box, tested=tuple(Plane(x, y, tip) for x, y in (("u", "v_m"), ("u", "r"), ("u", "delta"))))
    out = found.left_by({"u": np.array([0.0]), "v_m": np.array([0.5]), "r": np.array([0.9]), "delta": np.array([0.7])})
    assert [one.channel for one in out] == ["r", "delta"]
    assert out[0].beside == (("u", 0.0),)
    assert out[0].covered == pytest.approx((0.0, 0.0))
