"""What an action costs at each task, by the sums of its description, failures included to the last part."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("gymnasium")

from seatrial.envs import Berth, Canal, Course, Quay, Track
from seatrial.envs.tasks import Scale

SHIP = Scale(80.0, 12.0, 5.0, 4.0)
LENGTHS = 4.0 * 5.0 / 80.0


def test_a_track_costs_what_its_description_says_and_a_hundred_where_it_is_lost() -> None:
    """On the first of two legs, north then east, at random places and headings."""
    goal = (1.0, 0.0, 0.0, 1.0, 600.0)
    lost = 0
    for x, y, psi, a in np.random.default_rng(5).uniform((0, -500, -2, -1), (400, 500, 2, 1), (60, 4)).tolist():
        found = Track().judge(SHIP, (x, y, psi, 5.0, 0.3, 0.01), (a,), goal, (0.0,))
        off, e = abs(y) / 80.0 > 4.0 or math.cos(psi) < 0.0, y / 80.0
        cost = (e * e + 0.5 * (1.0 - math.cos(psi)) + 0.1 * a * a) * LENGTHS + 100.0 * off
        assert (found.reward, found.over) == (pytest.approx(-cost), float(off))
        wanted = (e, math.sin(psi), math.cos(psi), (600.0 - x) / 80.0, 1.0, 0.0, 1.0, 0.06, 0.16)
        assert found.seen == pytest.approx(wanted, abs=1e-12)
        lost += off
    assert 10 < lost < 50


def test_on_the_second_leg_the_first_counts_no_more() -> None:
    goal = (1.0, 0.0, 0.0, 1.0, 600.0)
    found = Track().judge(SHIP, (640.0, 300.0, 1.2, 5.0, 0.3, 0.01), (0.5,), goal, (1.0,))
    h = 1.2 - math.pi / 2
    assert found.seen[:6] == pytest.approx((-0.5, math.sin(h), math.cos(h), 10.0 - 300.0 / 80.0, 0.0, 1.0))
    assert found.reward == pytest.approx(-(0.25 + 0.5 * (1.0 - math.cos(h)) + 0.1 * 0.25) * LENGTHS)
    end = Track().judge(SHIP, (600.0, 801.0, math.pi / 2, 5.0, 0.0, 0.0), (0.0,), goal, (1.0,))
    assert (end.over, end.reward) == (1.0, pytest.approx(0.0, abs=1e-12))


def test_a_course_that_is_lost_costs_a_hundred_besides() -> None:
    for e, lost in ((1.5, 0.0), (1.6, 1.0), (-1.6, 1.0)):
        found = Course().judge(SHIP, (0.0, 0.0, 0.4 + e, 5.0, 0.3, 0.02), (0.5,), (0.4,), ())
        cost = (e * e + 0.1 * 0.25 + 0.1 * (0.02 * 16.0) ** 2) * LENGTHS + 100.0 * lost
        assert (found.reward, found.over) == (pytest.approx(-cost), lost)


@pytest.mark.parametrize(
    ("task", "turns"), [(Course(), 1.0), (Track(), 1.0), (Berth(), 0.0), (Quay(), 0.0), (Canal(), 0.45)]
)
def test_shafts_turn_at_the_start_as_the_task_has_it(task: object, turns: float) -> None:
    assert task.turns == turns  # type: ignore[attr-defined]


def test_a_course_is_drawn_from_the_ship_in_its_direction() -> None:
    (((x, y), end),) = (Course().guide(SHIP, (0.5,), 3.0, 4.0)[0],)
    assert (x, y) == (3.0, 4.0)
    assert end == pytest.approx((3.0 + 480.0 * math.cos(0.5), 4.0 + 480.0 * math.sin(0.5)))
