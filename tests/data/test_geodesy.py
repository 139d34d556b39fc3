"""Metres about a datum and latitudes, both ways, near the poles and over the horizon as well."""

from __future__ import annotations

import math

import pytest

from seatrial.data import DataError
from seatrial.data.geodesy import Datum


@pytest.mark.parametrize("latitude", [0.0, 35.0, -60.0, 78.0, 88.9, -89.0])
@pytest.mark.parametrize("distance", [1.0, 1e4, 1e5, 2e6])
def test_there_and_back(latitude: float, distance: float) -> None:
    datum = Datum(latitude, 170.0)
    for k in range(8):
        x, y = distance * math.cos(k), distance * math.sin(k)
        assert datum.north_east(*datum.place(x, y)) == pytest.approx((x, y), rel=0.0, abs=1e-7)


def test_beyond_the_edge_of_the_earth_is_refused() -> None:
    with pytest.raises(DataError, match=r"^7e\+06 m north") as caught:
        Datum(60.0, 10.0).place(7e6, 0.0)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("latitude", [0.0, 60.0, -85.0])
def test_the_datum_that_sees_a_place(latitude: float) -> None:
    """10 km off at 60 deg north, north there and at the place differ by 0.15 deg: 38 m."""
    datum = Datum(latitude, -179.99)
    there = datum.place(10e3, -10e3)
    found = Datum.seeing(*there, 10e3, -10e3)
    assert datum.north_east(found.latitude, found.longitude) == pytest.approx((0.0, 0.0), abs=1e-6)


def test_no_datum_beyond_the_pole() -> None:
    with pytest.raises(DataError, match="-89 to 89") as caught:
        Datum.seeing(88.99, 0.0, -50e3, 0.0)
    assert "\n" not in str(caught.value)
