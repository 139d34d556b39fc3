"""Bearings, closest approaches, domains and contact of hulls against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kinematic import Sailed, meeting, tracks
from seatrial.encounters import Tracks
from seatrial.encounters.rules import judge
from seatrial.encounters.rules.geometry import (
    Motion,
    Pair,
    clearance,
    closest,
    ellipse,
    touch,
    wrapped,
)  # fmt: skip
from seatrial.encounters.rules.verdict import motion


def pair(made: Tracks) -> Pair:
    return Pair(made.t, motion(made, 0), motion(made, 1))


def at_rest(x: float, y: float, psi: float, L: float = 100.0, B: float = 20.0) -> Motion:
    one = [np.array([value, value]) for value in (x, y, psi, 0.0, 0.0)]
    return Motion(*one, np.array([L]), np.array([B]))


def test_imazu_bearings_in_closed_form() -> None:
    """Equal speeds: a ship of heading psi is seen 90 - |psi| / 2 off the bow, 2 R sin(|psi| / 2) away."""
    T, U = 1000.0, 8.0
    for heading in (-135.0, -90.0, -45.0, -10.0, 15.0, 90.0):
        seen = pair(tracks([Sailed(0, 0, 0, U), Sailed(*meeting(heading, T, U), heading, U)], T=400.0))
        expected = -math.copysign(90.0 - abs(heading) / 2.0, heading)
        assert np.degrees(seen.beta) == pytest.approx(expected, abs=1e-6)
        assert np.degrees(seen.alpha) == pytest.approx(-expected, abs=1e-6)
        assert seen.range[0] == pytest.approx(2.0 * T * U * math.sin(math.radians(abs(heading)) / 2.0))
        dcpa, tcpa = seen.approach
        assert dcpa == pytest.approx(0.0, abs=1e-6)
        assert tcpa == pytest.approx(T - seen.t)


def test_passing_distance_of_a_crossing_in_closed_form() -> None:
    """A ship `off` m aside of the meeting point passes at off |v| / |w|: the offset across the relative motion."""
    U, off = 8.0, 500.0
    seen = pair(tracks([Sailed(0, 0, 0, U), Sailed(*meeting(-90.0, 1000.0, U, off=off), -90.0, U)], T=1500.0))
    at = closest(seen, np.ones(seen.t.shape, dtype=bool))
    assert at.distance == pytest.approx(off / math.sqrt(2.0), rel=1e-9)
    assert seen.approach[0][0] == pytest.approx(off / math.sqrt(2.0), rel=1e-9)


def test_the_closest_approach_lies_between_rows() -> None:
    """Head-on at 16 m/s with rows 50 s apart: the nearest row is up to 400 m off, the track itself is not."""
    seen = pair(tracks([Sailed(0, 0, 0, 8.0), Sailed(16400.0, 300.0, 180.0, 8.0)], T=2000.0, dt=50.0))
    at = closest(seen, np.ones(seen.t.shape, dtype=bool))
    assert at.distance == pytest.approx(300.0, rel=1e-6)
    assert at.t == pytest.approx(16400.0 / 16.0, abs=1e-6)
    assert seen.range.min() > 310.0
    assert np.degrees(at.angle(seen.beta)) == pytest.approx(90.0, abs=30.0)


def test_equal_velocities_have_no_closest_approach() -> None:
    """No approach is apart from an approach in 0 s."""
    seen = pair(tracks([Sailed(0, 0, 30.0, 8.0), Sailed(800.0, 0.0, 30.0, 8.0)], T=100.0))
    dcpa, tcpa = seen.approach
    assert np.isnan(tcpa).all()
    assert dcpa == pytest.approx(800.0)
    assert not any(one.met.exists for one in judge(tracks([Sailed(0, 0, 30.0, 8.0), Sailed(800.0, 0.0, 30.0, 8.0)])))


@pytest.mark.parametrize(("bearing", "axis"), [(0.0, 4.0), (90.0, 1.6), (-90.0, 1.6), (180.0, 4.0)])
def test_the_domain_of_fujii_at_its_axes(bearing: float, axis: float) -> None:
    far = 0.5 * axis * 100.0
    c, s = math.cos(math.radians(bearing + 20.0)), math.sin(math.radians(bearing + 20.0))
    seen = Pair(np.array([0.0, 1.0]), at_rest(0, 0, math.radians(20.0)), at_rest(far * c, far * s, 0.0))
    assert ellipse(seen, 4.0, 1.6) == pytest.approx(0.5)


def brute(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    """Whether any of a fine grid of points of one rectangle lies in the other."""
    (x, y, psi, L, B), (p, q, chi, M, C) = one, other
    a, b = np.meshgrid(np.linspace(-L / 2, L / 2, 201), np.linspace(-B / 2, B / 2, 81))
    north = x + a * math.cos(psi) - b * math.sin(psi) - p
    east = y + a * math.sin(psi) + b * math.cos(psi) - q
    along, across = north * math.cos(chi) + east * math.sin(chi), east * math.cos(chi) - north * math.sin(chi)
    return bool(((np.abs(along) <= M / 2) & (np.abs(across) <= C / 2)).any())


@pytest.mark.slow
def test_hulls_touch_as_their_points_do() -> None:
    rng = np.random.default_rng(5)
    seen = {True: 0, False: 0}
    for _ in range(300):
        one = (0.0, 0.0, rng.uniform(0, 6.3), 100.0, 20.0)
        other = (*rng.uniform(-90, 90, 2), rng.uniform(0, 6.3), 60.0, 15.0)
        gap = clearance(Pair(np.array([0.0, 1.0]), at_rest(*one), at_rest(*other)))[0]
        if abs(gap) > 1.0:  # a grid sees no overlap of a corner finer than its mesh
            assert (gap < 0.0) == brute(one, other), (one, other, gap)
            seen[bool(gap < 0.0)] += 1
    assert min(seen.values()) > 50


@pytest.mark.parametrize(("aside", "touches"), [(0.0, True), (25.0, True), (40.0, False)])
def test_contact_between_rows_is_seen(aside: float, touches: bool) -> None:
    """200 m ships of 33.3 m breadth pass each other on opposite courses within one step of 30 s, 480 m."""
    made = tracks([Sailed(0, 0, 0, 8.0), Sailed(8400.0, aside, 180.0, 8.0)], T=1200.0, dt=30.0)
    seen = pair(made)
    assert clearance(seen).min() > 0.0  # at none of the rows
    assert (touch(seen) < 0.0) == touches
    assert touch(seen) == pytest.approx(aside - 200.0 / 6.0, abs=1e-6)


def test_angles_wrap_the_shorter_way() -> None:
    assert wrapped(np.radians([190.0, -190.0, 530.0, 10.0])) == pytest.approx(np.radians([-170.0, 170.0, 170.0, 10.0]))
