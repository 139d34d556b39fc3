"""Encounters as points of a cube: what they are, how they spread, and who is left out."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.core.errors import RequestError
from seatrial.encounters.meeting import Ranges, drawn
from seatrial.encounters.rules import Role
from seatrial.encounters.space import PER_SHIP, Space, around, meeting
from seatrial.environment import Environment

U = 7.0
ROLES = (Role.GIVE_WAY, Role.HEAD_ON, Role.OVERTAKEN)
NONE = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0))


def space(conducts: int = 3, **more: float) -> Space:
    return Space(ROLES, U, conducts, Ranges(**more), ((2.0, 8.0), (-math.pi, math.pi), (0.0, 0.0), (0.0, 0.0)))


def cube(of: Space, count: int = 300) -> np.ndarray:
    return np.random.default_rng(1).random((count, len(of.free)))


def test_points_meet_when_they_say_in_the_role_that_they_have() -> None:
    some = space()
    points = some.at(cube(some))
    met = meeting(points, U)
    distance, t = met.approach
    assert np.abs(distance).max() < 1e-6
    assert t == pytest.approx(points[:, : len(PER_SHIP) * 3 : len(PER_SHIP)], rel=1e-9)
    for ship, role in enumerate(ROLES):
        assert (met.roles[:, ship] == role).all()
        assert met.U_target[:, ship] == pytest.approx(U * points[:, len(PER_SHIP) * ship + 1])


def test_what_does_not_vary_is_no_dimension() -> None:
    assert len(space().free) == 3 * 4 + 2
    assert len(space(conducts=1).free) == 3 * 3 + 2
    assert sum(space().discrete) == 3
    assert sum(space(conducts=1).discrete) == 0
    alone = Space((Role.STAND_ON,), U, 1, Ranges(T=(900.0, 900.0)), NONE)
    assert [alone.names[k] for k in alone.free] == ["k_1", "psi_1"]


def test_courses_and_conducts_are_spread_as_drawn_ones_are() -> None:
    """At one ratio of speeds the courses of `drawn` are uniform over those of the role: the same quantiles."""
    k = {Role.GIVE_WAY: (0.9, 0.9)}
    some = Space((Role.GIVE_WAY,), U, 4, Ranges(k=k), NONE)
    points = some.at(cube(some, 1000))
    others = drawn([Role.GIVE_WAY], 4000, U, 2, Ranges(k=k))
    wanted, found = (np.quantile(one, np.linspace(0.05, 0.95, 19)) for one in (others.psi[:, 0], points[:, 2]))
    assert np.abs(wanted - found).max() < math.radians(8.0)  # four standard errors of a quantile
    share = np.bincount(points[:, 3].astype(int), minlength=4) / len(points)
    assert share == pytest.approx(np.full(4, 0.25), abs=4.0 * math.sqrt(0.25 * 0.75 / 1000))


def test_nobody_begins_nearer_than_asked() -> None:
    near, far = (Space((Role.STAND_ON,), U, 1, Ranges(apart=apart), NONE) for apart in (0.0, 2000.0))
    points = far.at(cube(far))
    met = meeting(points, U)
    assert np.hypot(met.x, met.y).min() >= 2000.0
    assert all(far.holds(one) for one in points[:20])
    close = meeting(near.at(cube(near)), U)
    assert np.hypot(close.x, close.y).min() < 2000.0
    assert not far.holds(np.array([900.0, 1.0, 0.0, 0.0, *[0.0] * 4]))


def test_a_ship_that_is_left_out_is_met_by_nobody() -> None:
    some = space()
    points = some.at(cube(some, 5))
    points[:, 4] = np.nan
    met, whole = meeting(points, U), meeting(some.at(cube(some, 5)), U)
    assert (met.x[:, 1] < -1e6).all()
    assert (met.approach[1][:, 1] <= 0.0).all()
    assert (met.x[:, ::2] == whole.x[:, ::2]).all()


def test_weather_has_its_speed_and_direction() -> None:
    point = np.array([[*[0.0] * 4, 5.0, math.radians(90.0), 1.5, math.radians(180.0)]])
    found = Environment(*around(point)[0])
    assert (found.wind_x, found.wind_y) == pytest.approx((0.0, 5.0), abs=1e-12)
    assert (found.current_x, found.current_y) == pytest.approx((-1.5, 0.0), abs=1e-12)
    assert tuple(found)[4:] == (0.0,) * 4
    some = space()
    wind = some.at(cube(some))[:, -4]
    assert 2.0 <= wind.min() < 2.2 < 7.8 < wind.max() <= 8.0


def test_a_role_that_nothing_has_is_a_line() -> None:
    some = Space((Role.OVERTAKEN,), U, 1, Ranges(k={Role.OVERTAKEN: (0.3, 0.5)}), NONE)
    with pytest.raises(RequestError, match="no encounter of overtaken"):
        some.at(np.full((1, 3), 0.5))
