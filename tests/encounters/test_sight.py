"""What a policy sees among traffic, ship by ship in plain words of geometry, and what its two numbers order."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.encounters.conduct import Scene
from seatrial.encounters.learning import MOST, OTHER, OWN, SIZE, Sight
from seatrial.encounters.rules.limits import Limits
from seatrial.encounters.sensing import UNSEEN

LENGTHS = np.array([300.0, 120.0, 60.0, 200.0, 90.0])
PASSING, HORIZON = (float(one.of(np.array(300.0))) for one in (Limits().passing, Limits().horizon))


def scene(x: np.ndarray, y: np.ndarray, psi: np.ndarray, U: np.ndarray) -> Scene:
    return Scene(0.0, x, y, psi, U * np.cos(psi), U * np.sin(psi), LENGTHS[: x.shape[1]])


def drawn(seed: int, ships: int = 5) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-4000.0, 4000.0, (2, 3, ships))
    return x, y, rng.uniform(-7.0, 7.0, (3, ships)), rng.uniform(2.0, 9.0, (3, ships))


def test_other_ships_are_seen_by_their_distance_bearing_course_and_closest_approach() -> None:
    x, y, psi, U = drawn(1)
    first, then = scene(x, y, psi, U), scene(x + 50.0, y - 20.0, psi + 0.2, 1.1 * U)
    found = Sight(first).observed(then)
    assert found.shape == (3, SIZE) == (3, 4 + 3 * 9)
    ahead = np.arange(0.0, 20000.0, 1.0)
    for run in range(3):
        places = [np.array([then.x[run, k] + ahead * then.north[run, k], then.y[run, k] + ahead * then.east[run, k]])
                  for k in range(5)]  # fmt: skip
        away = [np.hypot(*(places[k] - places[0])) for k in range(5)]
        nearest = sorted(range(1, 5), key=lambda k: away[k][0])[:3]
        for place, k in enumerate(nearest):
            seen = dict(zip(OTHER, found[run, 4 + 9 * place : 13 + 9 * place].tolist(), strict=True))
            bearing = math.atan2(places[k][1][0] - places[0][1][0], places[k][0][0] - places[0][0][0])
            bearing, course = bearing - then.psi[run, 0], then.psi[run, k] - then.psi[run, 0]
            at = int(np.argmin(away[k]))
            share = 1.1 * U[run, k] / U[run, 0]  # of the own speed at first
            wanted = (1.0, math.exp(-away[k][0] / (4.0 * PASSING)), math.sin(bearing), math.cos(bearing),
                      math.sin(course), math.cos(course), math.tanh(share - 1.0),
                      math.exp(-away[k][at] / PASSING) if at else 0.0,
                      math.exp(-at / HORIZON) if at else 0.0)  # fmt: skip
            assert [seen[name] for name in OTHER] == pytest.approx(list(wanted), abs=2e-3)


@pytest.mark.parametrize("course", [0.0, 1.2, -2.5])
def test_the_own_ship_is_off_its_first_course_and_line(course: float) -> None:
    """To starboard is positive; along the line makes no difference; the speed is a share of the first."""
    x, y, psi, U = (one[:, :1] for one in drawn(2))
    psi = np.full_like(psi, course)
    first = scene(x, y, psi, U)
    along, aside = 700.0, np.array([[300.0], [-300.0], [0.0]])
    moved = scene(x + along * math.cos(course) - aside * math.sin(course),
                  y + along * math.sin(course) + aside * math.cos(course), psi + 0.3, 0.5 * U)  # fmt: skip
    found = Sight(first).observed(moved)
    wanted = [[math.sin(0.3), math.cos(0.3), math.tanh(float(a) / (4.0 * PASSING)), -0.5] for a in aside.ravel()]
    assert found[:, : len(OWN)] == pytest.approx(np.array(wanted), abs=1e-6)
    assert not found[:, len(OWN) :].any()  # nobody else is there


def test_a_ship_that_no_sensor_sees_and_one_that_draws_away_leave_no_trace() -> None:
    psi, U = np.zeros((1, 3)), np.array([[5.0, 3.0, 5.0]])
    first = scene(np.array([[0.0, -500.0, 0.9 * UNSEEN]]), np.zeros((1, 3)), psi, U)
    behind, unseen = Sight(first).observed(first)[0, 4:22].reshape(2, 9)
    assert not unseen.any()
    assert behind[OTHER.index("here")] == 1.0
    assert behind[OTHER.index("cos bearing")] == pytest.approx(-1.0)
    assert (behind[OTHER.index("closest")], behind[OTHER.index("soon")]) == (0.0, 0.0)


def test_two_numbers_order_a_course_to_either_side_and_half_to_whole_speed() -> None:
    first = scene(*drawn(3))
    orders = Sight(first).ordered(np.array([[1.0, 1.0], [-1.0, -1.0], [0.5, 0.0]]))
    assert pytest.approx(first.psi[:, 0] + MOST * np.array([1.0, -1.0, 0.5])) == orders.psi
    assert pytest.approx([1.0, 0.5, 0.75]) == orders.speed
    beyond = Sight(first).ordered(np.array([[9.0, 9.0]] * 3))
    assert pytest.approx(first.psi[:, 0] + math.radians(120.0)) == beyond.psi
