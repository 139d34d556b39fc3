"""How the runs in a harbour begin, by the geometry of ship and chart; nothing is simulated."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.environment.chart import nearest
from seatrial.environment.geojson import load_chart
from seatrial.ships.files import load
from seatrial.workflow.harbour import RUNS, SHIP

NAMES = ("berthing", "unberthing", "lock", "canal", "meeting")


def planned(name: str, speed: float | None = None):
    chart, making = RUNS[name]
    ship, there = load(SHIP), load_chart(chart)
    return ship, there, making(ship, there, speed)


def gap(ship, chart, start) -> float:
    """From the side of the ship, as a straight wall, to the line of the fenders [m]."""
    quay = next(q for q in chart.quays if q.fender is not None)
    off = float(nearest(quay.line, np.array([start[0]]), np.array([start[1]]))[0][0])
    return off - 0.5 * ship.model.breadth - quay.fender.height


@pytest.mark.slow
def test_a_berthing_begins_half_a_breadth_off_and_an_unberthing_at_the_fenders() -> None:
    ship, chart, plan = planned("berthing")
    assert gap(ship, chart, plan.start) == pytest.approx(0.5 * ship.model.breadth)
    ship, chart, plan = planned("unberthing")
    assert gap(ship, chart, plan.start) == pytest.approx(0.0, abs=1e-9)
    assert plan.start[3:] == (0.0, 0.0, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["berthing", "unberthing"])
def test_the_quay_lies_to_starboard_of_a_ship_that_lies_along_it(name: str) -> None:
    _, chart, plan = planned(name)
    quay = next(q for q in chart.quays if q.fender is not None)
    x, y, psi = plan.start[:3]
    a, b = quay.line[0], quay.line[-1]
    to_middle = 0.5 * (a + b) - np.array([x, y])
    assert float(to_middle @ [-math.sin(psi), math.cos(psi)]) > 0.0  # starboard is 90 deg clockwise of the bow
    along = (b - a) / np.linalg.norm(b - a)
    assert abs(float(along @ [math.cos(psi), math.sin(psi)])) > math.cos(0.011)
    assert abs(float(to_middle @ [math.cos(psi), math.sin(psi)])) < 0.6  # midship before the middle of the quay


@pytest.mark.slow
def test_tugs_press_the_ship_into_its_fenders_and_pull_it_a_breadth_and_a_half_off() -> None:
    for name, breadths, more in (("berthing", 0.0, -0.5), ("unberthing", 1.5, 0.0)):
        ship, chart, plan = planned(name)
        policy, body = plan.policy, ship.model.body
        assert gap(ship, chart, (policy.x, policy.y)) == pytest.approx(breadths * ship.model.breadth + more)
        assert policy.psi == pytest.approx(plan.start[2], abs=0.011)
        assert (policy.mass, policy.inertia) == (body.m + body.m_y, body.I_zG + body.J_z)
        fore = ship.model.thrusters_by_name["fore"]
        assert (policy.arm, policy.side) == (fore.x, math.copysign(1.0, fore.y))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "aside"), [("lock", 0.0), ("canal", 0.0), ("meeting", 1.0)])
def test_a_ship_begins_on_its_track_with_the_first_leg_ahead(name: str, aside: float) -> None:
    ship, chart, plan = planned(name, 2.0)
    line = chart.fairways[0]
    leg = line[1] - line[0]
    psi = math.atan2(leg[1], leg[0])
    here = np.array(plan.start[:2]) - line[0]
    assert plan.start[2] == pytest.approx(psi)
    assert plan.start[3:] == (2.0, 0.0, 0.0)
    assert float(here @ [-math.sin(psi), math.cos(psi)]) == pytest.approx(aside * ship.model.breadth)
    before = np.linalg.norm(leg) - float(here @ [math.cos(psi), math.sin(psi)])
    if len(line) > 2:
        assert before == pytest.approx(min(6.0 * ship.L_pp, 0.9 * np.linalg.norm(leg)))
    else:
        assert before == pytest.approx(0.95 * np.linalg.norm(leg))
    way = np.linalg.norm(np.diff(line, axis=0), axis=1).sum() - float(here @ [math.cos(psi), math.sin(psi)])
    assert plan.duration == pytest.approx(0.9 * way / 2.0)


@pytest.mark.slow
def test_two_ships_meet_port_to_port_half_a_run_later() -> None:
    """Two tracks a breadth to starboard of the fairway each, so the ships pass two breadths apart, port to port."""
    ship, _, plan = planned("meeting", 3.0)
    x, y, psi, U = plan.start[:4]
    other = plan.other
    assert other is not None
    t = np.linspace(0.0, plan.duration, 2001)
    north = other.x + other.U * np.cos(other.psi) * t - (x + U * math.cos(psi) * t)
    east = other.y + other.U * np.sin(other.psi) * t - (y + U * math.sin(psi) * t)
    distance = np.hypot(north, east)
    nearest_at = int(np.argmin(distance))
    assert t[nearest_at] == pytest.approx(0.5 * plan.duration, rel=1e-3)
    assert distance[nearest_at] == pytest.approx(2.0 * ship.model.breadth, rel=1e-3)
    to_starboard = -math.sin(psi) * north[nearest_at] + math.cos(psi) * east[nearest_at]
    assert to_starboard < 0.0
    assert math.cos(other.psi - psi) == pytest.approx(-1.0)
    section = ship.model.breadth * ship.model.draught
    assert vars(other) == pytest.approx(vars(other) | {"U": 3.0, "L": ship.L_pp, "A_M": section}, rel=0.01)
