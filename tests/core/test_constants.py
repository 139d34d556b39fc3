"""Units at sea and gravity against what they were defined by."""

from __future__ import annotations

import math

import pytest

from seatrial.core.constants import ARC_DEGREE, GRAVITY, KNOT, MILE


def test_a_mile_is_a_minute_of_the_meridian() -> None:
    quarter = 10_001_965.729  # of the meridian on WGS 84 [m]
    assert pytest.approx(quarter / 90.0 / 60.0, rel=1e-3) == MILE
    assert pytest.approx(quarter / 90.0, rel=1e-3) == ARC_DEGREE


def test_a_knot_is_a_mile_an_hour() -> None:
    assert pytest.approx(0.514444, abs=5e-7) == KNOT
    assert math.isclose(KNOT / 0.3048 * 3600.0, 6076.1155, rel_tol=1e-8)  # feet an hour


def test_gravity_lies_between_equator_and_pole_and_is_that_of_45_degrees() -> None:
    """Somigliana's formula on WGS 84; standard gravity was meant for 45 degrees of latitude at sea level."""

    def normal(latitude: float) -> float:
        s = math.sin(math.radians(latitude)) ** 2
        return 9.7803253359 * (1.0 + 0.00193185265241 * s) / math.sqrt(1.0 - 0.00669437999014 * s)

    assert normal(0.0) < GRAVITY < normal(90.0)
    assert pytest.approx(normal(45.0), abs=1e-3) == GRAVITY
