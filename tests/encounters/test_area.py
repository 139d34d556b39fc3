"""Encounters out of reports of an area: two ships on crossing courses by closed forms, gaps, and nobody in risk."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from seatrial.core.errors import RequestError
from seatrial.data.geodesy import Datum
from seatrial.encounters.area import Reports, encounters
from seatrial.encounters.rules import Role

HERE = Datum(55.0, 11.0)
Way = Callable[[float], tuple[float, float]]


def said(*ships: tuple[float, float, float, float], every: float = 10.0, until: float = 2400.0,
         heard: Callable[[float], bool] = lambda t: True) -> Reports:  # fmt: skip
    """Reports of ships from (x, y) on course psi [deg] at U."""
    rows = []
    for number, (x, y, psi, U) in enumerate(ships, 1):
        chi = math.radians(psi)
        for t in np.arange(0.0, until, every):
            if heard(t):
                place = HERE.place(x + U * t * math.cos(chi), y + U * t * math.sin(chi))
                rows.append((t, number, *map(float, place), U, chi % math.tau))
    t, ship, latitude, longitude, U_, chi_ = np.array(rows)[np.random.default_rng(1).permutation(len(rows))].T
    return Reports(t, ship.astype(np.int64), latitude, longitude, U_, chi_)


def test_a_crossing_is_met_from_both_ships_with_its_angles_ratio_and_times() -> None:
    """A goes 30 deg at 6 m/s, B 300 deg at 9 m/s, through one place after 1900 s: risk from 1200 s before on."""
    a, b = math.radians(30.0), math.radians(300.0)
    start = [(-6.0 * 1900.0 * math.cos(a), -6.0 * 1900.0 * math.sin(a), 30.0, 6.0),
             (-9.0 * 1900.0 * math.cos(b), -9.0 * 1900.0 * math.sin(b), 300.0, 9.0)]  # fmt: skip
    found = encounters(said(*start), 12.0)
    assert found.x.shape == (2, 1)
    dcpa, tcpa = found.approach
    assert dcpa == pytest.approx(np.zeros((2, 1)), abs=80.0)  # the earth is round, lengths are doubled for the first
    assert tcpa == pytest.approx(np.full((2, 1), 1200.0), abs=31.0)  # a look each 30 s
    assert (found.U_target / 12.0)[:, 0] == pytest.approx([1.5, 1.0 / 1.5], rel=1e-3)
    assert np.degrees(found.psi[:, 0]) == pytest.approx([-90.0, 90.0], abs=0.2)
    # A sees B, which comes from starboard of it, and gives way; B stands on
    assert [int(role) for role in found.roles[:, 0]] == [Role.GIVE_WAY, Role.STAND_ON]


def test_ships_at_rest_far_apart_or_unheard_are_in_no_encounter() -> None:
    head_on = ((-6000.0, 0.0, 0.0, 6.0), (6000.0, 0.0, 180.0, 6.0))
    assert encounters(said(*head_on), 6.0).x.shape == (2, 1)
    for wrong in (
        said((-6000.0, 0.0, 0.0, 6.0), (6000.0, 3000.0, 180.0, 6.0)),  # a mile and a half apart
        said((-6000.0, 0.0, 0.0, 6.0), (0.0, 0.0, 0.0, 0.1)),  # at anchor
        said((0.0, 0.0, 0.0, 6.0), (6000.0, 0.0, 0.0, 6.0)),  # the same speed
        said(*head_on, heard=lambda t: t > 900.0),  # less than 180 s are left
        said(*head_on, every=400.0),  # nobody knows where they are between
    ):
        with pytest.raises(RequestError, match="of 2 ships none came into risk"):
            encounters(wrong, 6.0)


def test_risk_that_is_there_when_both_are_first_heard_counts_from_then() -> None:
    found = encounters(said((-6000.0, 0.0, 0.0, 6.0), (6000.0, 0.0, 180.0, 6.0), heard=lambda t: t > 500.0), 6.0)
    assert found.approach[1] == pytest.approx(np.full((2, 1), 480.0), abs=31.0)
    assert np.degrees(found.bearings[0]) == pytest.approx(np.zeros((2, 1)), abs=0.2)
