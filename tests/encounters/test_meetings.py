"""Encounters before anybody acts: all would meet, and their classes are those of the sets."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.core.errors import RequestError
from seatrial.encounters.meetings import (
    IMAZU,
    RANGES,
    STANDARD,
    Meetings,
    drawn,
    imazu,
    kinds_of,
    placed_by,
    seen,
    standard,
)  # fmt: skip

DEG = math.pi / 180.0


def at(meetings: Meetings, t: float) -> tuple[np.ndarray, np.ndarray]:
    return (meetings.x + t * meetings.U * np.cos(meetings.psi), meetings.y + t * meetings.U * np.sin(meetings.psi))


@pytest.mark.parametrize("case", IMAZU)
def test_all_ships_of_a_problem_of_imazu_meet_at_one_point(case: int) -> None:
    found = imazu(case, 7.0, 900.0)
    assert found.x.shape == (1, 1 + len(IMAZU[case]))
    north, east = at(found, 900.0)
    assert north == pytest.approx(np.full_like(north, 6300.0))
    assert east == pytest.approx(np.zeros_like(east), abs=1e-6)


def test_distance_and_bearing_at_the_start_are_those_of_the_isosceles_triangle() -> None:
    """Equal speeds: distance 2 R sin(|psi|/2), bearing 90 - |psi|/2 on the side opposite to the heading."""
    for case, psi in ((2, -90.0), (4, 45.0), (1, 180.0)):
        found = imazu(case, 10.0, 600.0)
        assert math.hypot(found.x[0, 1], found.y[0, 1]) == pytest.approx(12000.0 * math.sin(abs(psi) * DEG / 2))
        bearing = math.degrees(math.atan2(found.y[0, 1], found.x[0, 1]))
        assert bearing == pytest.approx(-math.copysign(90.0 - abs(psi) / 2, psi), abs=1e-9)
    slow = imazu(3, 10.0, 600.0, slow=0.4)
    assert (slow.x[0, 1], slow.y[0, 1], slow.U[0, 1]) == pytest.approx((3600.0, 0.0, 4.0))


def test_classes_of_the_problems_are_those_of_their_names() -> None:
    assert [imazu(case, 5.0).kinds[0].tolist() for case in (1, 2, 3, 4, 5)] == [
        ["HO"], ["GW"], ["OG"], ["SO"], ["HO", "GW"]]  # fmt: skip
    assert imazu(8, 5.0).kinds[0].tolist() == ["HO", "SO"]


@pytest.mark.parametrize("number", STANDARD)
def test_each_standard_situation_is_of_its_class_and_meets_in_its_time(number: int) -> None:
    found = standard(number, 10 * 1852 / 3600)
    for k, words in enumerate(STANDARD[number].split(", "), 1):
        kind, bearing, ratio, minutes = words.split()
        assert kinds_of(*seen(0, 0, 0, found.x[0, k], found.y[0, k], found.psi[0, k])) == kind == found.kinds[0, k - 1]
        north, east = at(found, float(minutes) * 60)
        assert (north[0, k], east[0, k]) == pytest.approx((north[0, 0], east[0, 0]), abs=1e-6)
        beta = math.degrees(math.atan2(found.y[0, k], found.x[0, k])) - float(bearing)
        assert math.remainder(beta, 360.0) == pytest.approx(0.0, abs=1e-6)
        assert found.U[0, k] / found.U[0, 0] == pytest.approx(float(ratio))


def test_who_cannot_get_there_is_not_placed() -> None:
    """A ship of half the speed abeam to starboard never reaches the own ship's place: no real root."""
    assert np.isnan(placed_by("GW", np.array([89 * DEG]), np.array([0.5]), np.array([600.0]), 10.0)[0]).all()


def test_draws_cover_their_ranges_and_meet() -> None:
    found = drawn(2000, 2, 8.0, seed=1)
    assert found.x.shape == (2000, 3)
    assert np.isfinite(found.x).all()
    share = {kind: float(np.mean(found.kinds == kind)) for kind in RANGES}
    assert all(abs(one - 0.2) < 4 * math.sqrt(0.16 / 4000) for one in share.values())
    beta, alpha = seen(0.0, 0.0, 0.0, found.x[:, 1:], found.y[:, 1:], found.psi[:, 1:])
    assert (kinds_of(beta, alpha) == found.kinds).all()
    # they meet at some time between 10 and 20 minutes, exactly
    north, east = found.x[:, 1:] - found.x[:, :1], found.y[:, 1:] - found.y[:, :1]
    v_north = found.U[:, 1:] * np.cos(found.psi[:, 1:]) - found.U[:, :1]
    v_east = found.U[:, 1:] * np.sin(found.psi[:, 1:])
    t = -(north * v_north + east * v_east) / (v_north**2 + v_east**2)
    assert np.hypot(north + t * v_north, east + t * v_east).max() < 1e-5
    assert t.min() > 599.9
    assert t.max() < 1200.1
    assert np.ptp(t) > 500.0
    same = drawn(2000, 2, 8.0, seed=1)
    assert (same.x == found.x).all()
    assert (drawn(2000, 2, 8.0, seed=2).x != found.x).any()


def test_weights_are_shares_of_classes() -> None:
    assert set(drawn(50, 1, 8.0, 0, {"HO": 1.0, "GW": 0.0}).kinds.ravel()) == {"HO"}


def test_a_mirrored_crossing_has_the_other_role() -> None:
    for beta, alpha in ((30 * DEG, -40 * DEG), (80 * DEG, -100 * DEG), (110 * DEG, 3 * DEG)):
        assert (kinds_of(beta, alpha), kinds_of(-beta, -alpha)) == ("GW", "SO")
        assert kinds_of(alpha, beta) in ("SO", "GW", "HO", "")


@pytest.mark.parametrize(("wrong", "said"), [
    (lambda: imazu(23, 5.0), "Imazu's problem 23; there are 1 to 22"),
    (lambda: imazu(3, 5.0, slow=1.2), "the ship ahead is overtaken"),
    (lambda: imazu(1, 0.0), "speed = 0; it is a number above zero"),
    (lambda: standard(99, 5.0), "there are 1 to 20"),
    (lambda: drawn(0, 1, 5.0, 0), "0 encounters"),
    (lambda: drawn(3, 1, 5.0, 0, {"XX": 1.0}), "no class of encounter 'XX'"),
    (lambda: drawn(3, 1, 5.0, 0, {"HO": 0.0}), "all are zero"),
])  # fmt: skip
def test_what_cannot_be_is_a_line(wrong, said) -> None:
    with pytest.raises(RequestError, match=said):
        wrong()
