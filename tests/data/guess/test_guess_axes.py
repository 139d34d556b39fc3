"""Readings of a motion, one formula at a time: planes, axes, courses, speeds over ground and what is known then."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from columns import signal
from shapes import MODEL, Sheet, sailed, stamps

from seatrial.data.geodesy import Datum
from seatrial.data.guess import guess
from seatrial.data.guess.answers import ASK
from seatrial.data.guess.entries import Known, _calm, known_motion, minutes_run_on, motion_entries, other_entries
from seatrial.data.guess.motion import (
    RATES,
    SPEEDS,
    Motion,
    Reading,
    Verdict,
    _aside,
    _gone,
    _plane,
    _size_strain,
    _to_earth,
    _turned_strain,
    speed_unit_said,
    speeds_of,
)
from seatrial.data.guess.naming import meanings

NAN = np.nan


def test_units_of_speed_and_rate_are_sizes_in_si() -> None:
    assert pytest.approx({"m/s": 1.0, "kn": 0.5144444444444445, "km/h": 0.2777777777777778}, rel=1e-12) == SPEEDS
    assert pytest.approx({"deg/s": math.pi / 180, "rad/s": 1.0, "deg/min": math.pi / 180 / 60}, rel=1e-12) == RATES


def test_latitudes_and_longitudes_become_metres_of_a_plane() -> None:
    here = Datum(60.0, 5.0)
    latitude, longitude = np.array([NAN, 60.0, 60.01, 59.99]), np.array([NAN, 5.0, 5.02, 4.98])
    north, east = _plane(latitude, longitude)
    exact = here.track(latitude, longitude)
    assert north[1:] == pytest.approx(exact[0][1:], rel=5e-3, abs=0.2)
    assert east[1:] == pytest.approx(exact[1][1:], rel=5e-3, abs=0.2)
    assert (north[1], east[1]) == (0.0, 0.0)


@pytest.mark.parametrize(("frame", "north", "east"), [
    ("north, east", 3.0, 1.0), ("east, north", 1.0, 3.0),
    ("ahead and starboard of the ship", 3.0 * math.cos(0.4) - math.sin(0.4), 3.0 * math.sin(0.4) + math.cos(0.4)),
    ("ahead and port of the ship", 3.0 * math.cos(0.4) + math.sin(0.4), 3.0 * math.sin(0.4) - math.cos(0.4)),
])  # fmt: skip
def test_velocities_of_each_frame_point_where_they_say(frame: str, north: float, east: float) -> None:
    found = _to_earth(frame, np.array([3.0]), np.array([1.0]), np.array([0.4]))
    assert [float(one[0]) for one in found] == pytest.approx([north, east])


def test_a_track_is_followed_over_a_fiftieth_of_it_to_either_side() -> None:
    t = np.arange(200.0)
    north, east = _gone(t, 2.0 * t, -(t**2))
    assert north[4:-4] == pytest.approx(16.0)
    assert east[4:-4] == pytest.approx(-16.0 * t[4:-4])
    assert np.isnan(north[[0, 3, 196, 199]]).all()
    few = _gone(t[:20], 2.0 * t[:20], t[:20])
    assert few[0][1:-1] == pytest.approx(4.0)  # one row at least


def test_a_ship_goes_aside_by_the_angle_of_its_fast_rows() -> None:
    psi = np.full(40, 3.0)
    course = psi + np.where(np.arange(40) < 20, 0.3, -0.4)  # across the seam of angles
    speed = np.ones(40)
    size = math.sqrt(0.5 * (0.09 + 0.16))
    assert _aside(speed * np.cos(course), speed * np.sin(course), psi) == pytest.approx(size)
    for slow, wanted in ((0.31, size), (0.29, 0.4)):
        speed[:20] = slow
        assert _aside(speed * np.cos(course), speed * np.sin(course), psi) == pytest.approx(wanted)
    assert _aside(np.cos(course[:10]), np.sin(course[:10]), psi[:10]) == pytest.approx(0.3)
    assert _aside(np.cos(course[:9]), np.sin(course[:9]), psi[:9]) is None


@pytest.mark.parametrize(("largest", "deg", "rad"), [
    (31.0, 0.0, 4.0), (29.0, 0.0, 2.2), (7.1, 0.0, 2.2), (6.9, 0.0, 0.0), (6.6, 0.0, 0.0), (6.4, 0.5, 0.0),
])  # fmt: skip
def test_numbers_strain_the_unit_in_which_they_would_be_odd(largest: float, deg: float, rad: float) -> None:
    values = np.array([0.0, -largest, NAN])
    assert (_size_strain(values, "deg"), _size_strain(values, "rad")) == (deg, rad)


def test_a_heading_that_grows_to_port_strains_its_name() -> None:
    assert _turned_strain(signal("heading", [0.0, 1.0])) == 2.5
    assert _turned_strain(signal("yaw", [0.0, 1.0], "Yaw_deg")) == 0.7
    assert _turned_strain(signal("yaw", [0.0, 1.0], "attitude")) == 1.5


def test_the_pair_of_a_velocity_is_the_one_that_says_most() -> None:
    everything = {name: signal(name, [1.0]) for name in ("u", "v", "v_north", "v_east", "vx", "vy", "sog", "cog",
                                                        "speed")}  # fmt: skip
    for pair in (("u", "v"), ("v_north", "v_east"), ("vx", "vy"), ("sog", "cog"), ("speed", "cog")):
        assert speeds_of(everything) == pair
        del everything[pair[0]]
    assert speeds_of(everything) is None
    assert speeds_of({"u": signal("u", [1.0]), "cog": signal("cog", [1.0])}) == ("u", "cog")
    said = {"u": signal("u", [1.0]), "v": signal("v", [1.0], unit="kn"), "cog": signal("cog", [1.0], unit="deg")}
    assert speed_unit_said(said, ("u", "v")) == "kn"
    assert speed_unit_said(said, ("u", "cog")) == ""
    assert speed_unit_said({**said, "u": signal("u", [1.0], unit="m/s")}, ("u", "v")) == "m/s"


@pytest.mark.parametrize("frame", ["ned", "enu"])
def test_a_quaternion_gives_the_heading_of_its_frame(frame: str) -> None:
    psi = np.linspace(0.1, 4.0, 30)
    yaw = psi if frame == "ned" else 0.5 * np.pi - psi
    parts = {"qx": 0.0 * psi, "qy": 0.0 * psi, "qz": np.sin(0.5 * yaw), "qw": np.cos(0.5 * yaw)}
    found = Motion(np.arange(30.0), {name: signal(name, values) for name, values in parts.items()}).headings
    assert [one.choice["frame of the quaternion"] for one in found] == ["ned", "enu"]
    own = next(one for one in found if one.choice["frame of the quaternion"] == frame).values[0]
    assert np.diff(own) == pytest.approx(np.diff(psi))
    assert np.cos(own - psi) == pytest.approx(1.0)
    # tilted by phi and theta, the same heading
    phi, theta = 0.2, -0.3
    cr, sr, cp, sp = math.cos(phi / 2), math.sin(phi / 2), math.cos(theta / 2), math.sin(theta / 2)
    cy, sy = np.cos(yaw / 2), np.sin(yaw / 2)
    parts = {"qw": cr * cp * cy + sr * sp * sy, "qx": sr * cp * cy - cr * sp * sy,
             "qy": cr * sp * cy + sr * cp * sy, "qz": cr * cp * sy - sr * sp * cy}  # fmt: skip
    tilted = Motion(np.arange(30.0), {name: signal(name, values) for name, values in parts.items()}).headings
    assert tilted[0].values[0] - yaw == pytest.approx(np.full(30, tilted[0].values[0][0] - yaw[0]), abs=1e-9)
    assert math.cos(tilted[0].values[0][0] - yaw[0]) == pytest.approx(1.0)


def test_headings_are_read_in_both_units_and_three_senses() -> None:
    raw = np.array([10.0, 20.0, 5.0])
    found = {(one.choice["unit of psi"], one.choice["sense of psi"]): one for one in
             Motion(np.arange(3.0), {"yaw": signal("yaw", raw, "yaw")}).headings}  # fmt: skip
    assert found["deg", "clockwise from north"].values[0] == pytest.approx(np.radians(raw))
    assert found["deg", "anticlockwise from east"].values[0] == pytest.approx(np.radians(90.0 - raw))
    assert found["deg", "anticlockwise from north"].values[0] == pytest.approx(np.radians(-raw))
    assert np.diff(found["rad", "clockwise from north"].values[0]) % (2 * np.pi) == pytest.approx(
        np.diff(raw) % (2 * np.pi)
    )
    strains = [found["deg", sense].strain for _, sense in list(found)[:3]]
    assert strains == pytest.approx([0.0, 0.7, 1.2])
    assert found["rad", "clockwise from north"].strain == pytest.approx(2.2)


def test_rates_strain_their_names_by_unit_and_side() -> None:
    for head, starboard, port in (("ROT", 0.0, 1.0), ("twist.angular.z", 0.3, 0.0)):
        rates = Motion(np.arange(3.0), {"r": signal("r", [1.0, 2.0, 3.0], head, unit="deg/s")}).rates
        by = {(one.choice["unit of r"], one.choice["sense of r"]): one for one in rates}
        assert by["deg/s", "to starboard"].strain == pytest.approx(starboard)
        assert by["deg/s", "to port"].strain == pytest.approx(port)
        assert by["rad/s", "to starboard"].strain == pytest.approx(3.0 + starboard + 0.3)
        assert by["deg/min", "to port"].strain == pytest.approx(3.0 + port + 0.6)
        assert by["deg/s", "to port"].values[0] == pytest.approx(-np.radians([1.0, 2.0, 3.0]))


@pytest.mark.parametrize(("values", "yes"), [
    ([6326.47, 6327.0], True), ([6360.5, 6327.0], False), ([18001.0, 6327.0], False), ([17959.0, 6327.0], True),
    ([359.0, 358.0], False), ([401.0, 402.0], True), ([63.2, 63.4], False), ([NAN, 6326.47], True), ([NAN], False),
])  # fmt: skip
def test_degrees_and_minutes_in_one_number_are_beyond_any_angle(values: list[float], yes: bool) -> None:
    assert minutes_run_on(np.array(values)) == yes
    assert minutes_run_on(-np.array(values)) == yes


def test_a_mean_over_a_hundredth_of_the_rows_keeps_lines_and_calms_noise() -> None:
    line = np.arange(400.0)
    assert _calm(line)[3:-3] == pytest.approx(line[3:-3])
    assert _calm(line).size == 400
    spike = np.zeros(400)
    spike[200] = 5.0
    assert _calm(spike)[198:203] == pytest.approx(1.0)  # five rows
    assert _calm(spike)[[197, 203]] == pytest.approx(0.0)
    assert _calm(np.array([0.0, 3.0, 0.0])) == pytest.approx([1.0, 1.0, 1.0])


def option(motion: Motion, ways: str, **choice: str) -> tuple[float, list[float]]:
    """Strain and first values of the way to read something that has these answers."""
    wanted = {key.replace("_", " "): value for key, value in choice.items()}
    found = next(one for one in getattr(motion, ways) if wanted.items() <= dict(one.choice).items())
    return found.strain, [float(values[1]) for values in found.values]


def test_courses_and_speeds_over_ground_are_read_in_every_unit() -> None:
    t = np.arange(3.0)
    for said, own, other in (("", 0.0, 0.3), ("m/s", 0.0, 3.3)):
        pair = {"sog": signal("sog", [1.0, 2.0, 1.0], unit=said), "cog": signal("cog", [0.0, 60.0, 50.0])}
        motion = Motion(t, pair)
        strain, values = option(motion, "velocities", unit_of_speed="m/s", unit_of_course="deg")
        assert (strain, values) == (pytest.approx(own), pytest.approx([1.0, math.sqrt(3.0)]))
        strain, values = option(motion, "velocities", unit_of_speed="kn", unit_of_course="rad")
        assert (strain, values) == (pytest.approx(other + 4.0),
                                    pytest.approx([2 * 0.514444 * math.cos(60), 2 * 0.514444 * math.sin(60)], rel=1e-5))
        assert option(motion, "velocities", unit_of_speed="km/h", unit_of_course="deg")[0] == pytest.approx(
            other + 0.3
        )
    known = Motion(t, {**pair, "cog": signal("cog", [0.0, 1.0, 2.0], unit="deg")})
    assert option(known, "velocities", unit_of_speed="m/s", unit_of_course="rad")[0] == pytest.approx(3.0)
    assert option(known, "velocities", unit_of_speed="m/s", unit_of_course="deg")[0] == pytest.approx(0.5)


@pytest.mark.parametrize(("pair", "strains"), [
    (("u", "v"), (0.0, 1.0, 1.2, 2.0)), (("vx", "vy"), (0.3, 1.0, 0.3, 1.0)),
    (("v_north", "v_east"), (None, None, 0.0, 2.0)),
])  # fmt: skip
def test_axes_of_velocities_strain_their_names(pair: tuple[str, str], strains: tuple[float | None, ...]) -> None:
    motion = Motion(np.arange(3.0), {name: signal(name, [0.0, 1.0 + k, 0.0], unit="kn") for k, name in enumerate(pair)})
    frames = ("ahead and starboard of the ship", "ahead and port of the ship", "north, east", "east, north")
    found = {(one.choice["unit of speed"], one.choice["frame of speeds"]): one for one in motion.velocities}
    for frame, strain in zip(frames, strains, strict=True):
        assert (found["kn", frame].strain if ("kn", frame) in found else None) == (
            strain if strain is None else pytest.approx(0.3 + strain)
        )
        if strain is not None:
            assert found["m/s", frame].strain == pytest.approx(3.0 + strain)
            assert [float(one[1]) for one in found["kn", frame].values] == pytest.approx([0.514444, 1.028889], rel=1e-5)


def test_positions_are_read_as_named_or_exchanged() -> None:
    t = np.arange(3.0)
    for pair, head, own, other in ((("north", "east"), "A", 0.0, 3.0), (("x", "y"), "A", 0.0, 1.0),
                                   (("x", "y"), "pose.x", 0.3, 0.0),
                                   (("north", "east"), "pose.x", 0.0, 3.0)):  # fmt: skip
        found = {name: signal(name, [0.0, 5.0 + k, 0.0], head) for k, name in enumerate(pair)}
        motion = Motion(t, {**found, "r": signal("r", [0.0, 1.0, 2.0])})
        assert option(motion, "positions", axes="x, y") == (pytest.approx(own), [5.0, 6.0])
        assert option(motion, "positions", axes="y, x") == (pytest.approx(other), [6.0, 5.0])
    fix = {"latitude": signal("latitude", [60.0, 60.001, 60.0]), "longitude": signal("longitude", [5.0, 5.001, 5.0])}
    motion = Motion(t, fix)
    assert option(motion, "positions", axes="x, y")[1] == pytest.approx([111.3, 55.66], rel=1e-3)
    assert option(motion, "positions", axes="y, x") == (2.5, pytest.approx([111.3, 110.9], rel=1e-3))
    named = signal("latitude", fix["latitude"].values, "pos.x", means=tuple(meanings("pos.x")))
    assert option(Motion(t, {**fix, "latitude": named}), "positions", axes="y, x")[0] == 0.5
    assert option(motion, "positions", axes="x, y")[0] == 0.0
    for longitude, ways in ((88.5, 2), (-89.5, 1), (100.0, 1)):
        fix["longitude"] = signal("longitude", [longitude] * 3)
        assert len(Motion(t, fix).positions) == ways


@pytest.mark.parametrize(("head", "ned", "enu"), [("orientation.w", 0.3, 0.0), ("qw", 0.0, 0.5)])
def test_a_quaternion_of_a_robot_is_as_often_of_east_north_up(head: str, ned: float, enu: float) -> None:
    motion = Motion(np.arange(2.0), {"qz": signal("qz", [0.0, 0.1]), "qw": signal("qw", [1.0, 0.99], head)})
    assert [one.strain for one in motion.headings] == [ned, enu]
    named = Motion(np.arange(2.0), {**motion.found, "heading": signal("heading", [0.0, 1.0])})
    assert "unit of psi" in named.headings[0].choice


def reading(miss: float, strain: float = 0.0, answer: str = "a", **parts: float) -> Reading:
    return Reading({"k": answer}, strain, miss, parts)


def test_a_choice_is_sure_where_the_others_fit_worse_or_strain_more() -> None:
    def judged(miss: float, strain: float, smallest: float = 0.1) -> tuple[bool, bool]:
        rival = reading(miss, strain, "b", track=miss)
        found = Verdict(reading(smallest, 1.0, track=smallest), {"k": rival}, {"k": rival}, smallest)
        return found.sure("k"), found.measured("k")

    assert judged(0.161, 1.0) == (True, True)  # 1.3 times .1, and .03
    assert judged(0.159, 1.0) == (False, False)
    assert judged(0.159, 3.1) == (True, False)
    assert judged(0.159, 2.9) == (False, False)
    assert judged(0.031, 1.0, 0.0) == (True, True)
    assert judged(0.029, 1.0, 0.0) == (False, False)
    alone = Verdict(reading(0.1), {}, {}, 0.1)
    assert (alone.sure("k"), alone.measured("k"), alone.told("k"), alone.lost) == (True, False, "", 0.0)


def test_the_evidence_is_the_test_that_the_other_reading_fails_most() -> None:
    best = Reading({"k": "a"}, 0.0, 0.05, {"track": 0.02, "course": 0.03})
    rival = Reading({"k": "b"}, 0.0, 1.2, {"track": 0.9, "course": 0.3})
    assert Verdict(best, {"k": rival}, {"k": rival}, 0.05).told("k") == (
        "the track follows the speeds within 2% (90% if b)"
    )
    other = Reading({"k": "c"}, 0.0, 0.5, {"track": 0.1, "course": 0.3})
    assert Verdict(best, {"k": other}, {"k": other}, 0.05).told("k") == (
        "the ship goes where it points within 6 deg (57 deg if c)"
    )
    near = Reading({"k": "b"}, 0.0, 0.09, {"track": 0.06})
    assert Verdict(best, {"k": near}, {"k": near}, 0.05).told("k") == ""


@pytest.mark.slow
def test_a_unit_of_time_strains_and_scales_the_clock() -> None:
    """A turn of .1 rad a row at .1 rad/s: a row is a second, in whatever unit that is written."""
    rows = np.arange(300.0)
    psi, r = np.degrees(0.1 * rows + 0.2 * np.sin(0.1 * rows)), 0.1 + 0.02 * np.cos(0.1 * rows)
    found = {"heading": signal("heading", psi, unit="deg"), "r": signal("r", r, unit="rad/s")}
    for unit, size in (("s", 1.0), ("ms", 1000.0), ("us", 1e6), ("min", 1.0 / 60.0)):
        best = Motion(size * rows, found, ("ms", "us", "min")).verdict().best
        assert best.choice["unit of time"] == unit
        assert best.miss < 0.01
        assert best.strain == pytest.approx(0.3 + {"s": 0.0, "ms": 0.5, "us": 1.0, "min": 1.6}[unit])  # rad/s: .3
    assert "unit of time" not in Motion(rows, found).verdict().best.choice


@pytest.mark.parametrize(("part", "lost"), [(0.2, False), (0.3, True)])
def test_sources_that_contradict_each_other_decide_nothing(part: float, lost: bool) -> None:
    """A heading that turns to one side, and a rate that is too small by a part in each unit."""
    rows = np.arange(300.0)
    psi, r = np.degrees(0.1 * rows), (1.0 - part) * 0.1 + 1e-3 * np.sin(rows)
    found = {"heading": signal("heading", psi, unit="deg"), "r": signal("r", r, unit="rad/s")}
    verdict = Motion(rows, found).verdict()
    assert verdict.lost == (pytest.approx(part, abs=0.01) if lost else 0.0)
    assert (verdict.best.miss == 0.0) == lost


def verdict(**choice: str) -> Verdict:
    named = {key.replace("_", " "): value for key, value in choice.items()}
    return Verdict(Reading(named, 0.0, 0.0, {}), {}, {}, 0.0)


def sailing(frame: str) -> tuple[Known, Any, Any]:
    t = np.arange(60.0)
    psi, u, v = 0.05 * t + 1.0, 3.0 + 0.01 * t, -0.4 + 0.0 * t
    north, east = u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)
    a, b = {"north, east": (north, east), "east, north": (east, north), "ahead and port of the ship": (u, -v),
            "ahead and starboard of the ship": (u, v)}[frame]  # fmt: skip
    pair = ("vx", "vy")
    found = {"heading": signal("heading", np.degrees(psi), unit="deg"), pair[0]: signal(pair[0], a, unit="m/s"),
             pair[1]: signal(pair[1], b, unit="m/s")}  # fmt: skip
    told = verdict(unit_of_psi="deg", sense_of_psi="clockwise from north", unit_of_speed="m/s", frame_of_speeds=frame)
    return known_motion(told, t, found), u, v


@pytest.mark.parametrize(
    "frame", ["north, east", "east, north", "ahead and port of the ship", "ahead and starboard of the ship"]
)
def test_what_is_known_of_a_motion_is_in_body_axes_whatever_its_frame(frame: str) -> None:
    known, u, v = sailing(frame)
    assert known.u == pytest.approx(u)
    assert known.v == pytest.approx(v)
    assert known.speed == pytest.approx(np.hypot(u, v))
    assert known.r == pytest.approx(0.05)
    assert known.turned == pytest.approx(59 * 0.05)
    assert replace(known, psi=None).turned == 0.0


def test_without_speeds_the_track_gives_them() -> None:
    t = np.arange(100.0)
    psi = np.full(100, 0.7)
    x, y = t * (2.0 * np.cos(0.7) - 0.5 * np.sin(0.7)), t * (2.0 * np.sin(0.7) + 0.5 * np.cos(0.7))
    found = {"heading": signal("heading", np.degrees(psi)), "x": signal("x", x), "y": signal("y", y)}
    told = verdict(unit_of_psi="deg", sense_of_psi="clockwise from north", axes="x, y", north="'A'")
    known = known_motion(told, t, found)
    middle = slice(3, -3)
    assert known.u is not None
    assert known.v is not None
    assert known.speed is not None
    assert known.u[middle] == pytest.approx(2.0)
    assert known.v[middle] == pytest.approx(0.5)
    assert known.speed[middle] == pytest.approx(math.hypot(2.0, 0.5))
    few = known_motion(told, t[:10], {name: signal(name, one.values[:10]) for name, one in found.items()})
    assert few.speed is None


@pytest.mark.parametrize(("unit", "factor"), [("m/s", 1.0), ("kn", 1852.0 / 3600.0), ("km/h", 1.0 / 3.6)])
def test_the_unit_of_a_log_is_that_of_the_speed_of_the_track(unit: str, factor: float) -> None:
    speed = np.linspace(2.0, 6.0, 30)
    still = Known(np.arange(30.0), None, None, None, None, speed)
    for share, doubtful in ((1.0, False), (1.17, False), (1.28, True)):
        log = np.append(speed[:-1] / factor / share, 0.0)  # at rest it says nothing of its unit
        (entry,) = other_entries({"stw": signal("stw", log)}, still, set())
        assert entry.keys["unit"] == f'"{unit}"'
        assert any("only the nearest unit" in one for one in entry.answer.doubts) == doubtful
        assert f"{share * factor:.3g} m/s of the track" in entry.answer.evidence


def test_the_speed_of_a_ship_whose_track_is_unknown_has_no_unit() -> None:
    nothing = Known(np.arange(3.0), None, None, None, None, None)
    (entry,) = other_entries({"speed": signal("speed", [1.0, 2.0, 3.0])}, nothing, set())
    assert (entry.table, entry.keys["unit"]) == ("log", f'"{ASK}"')
    assert len(entry.answer.doubts) == 2
    covered = {"speed": signal("speed", [1.0, 2.0]), "cog": signal("cog", [1.0, 2.0])}
    assert not list(other_entries(covered, nothing, set()))
    (entry,) = other_entries({"stw": signal("stw", [1.0, 2.0], unit="kn")}, nothing, set())
    assert (entry.keys["unit"], entry.answer.doubts) == ('"kn"', ())


@pytest.mark.parametrize(("role", "largest", "unit"), [
    ("phi", 1.1, "deg"), ("phi", 0.9, "rad"), ("phi", 361.0, ASK), ("gamma_C", 359.0, "deg"), ("gamma_C", 0.9, "rad"),
    ("depth", 500.0, "m"), ("U_C", 1.0, ASK),
])  # fmt: skip
def test_units_of_channels_that_nothing_tests_are_those_of_their_size(role: str, largest: float, unit: str) -> None:
    nothing = Known(np.arange(3.0), None, None, None, None, None)
    (entry,) = other_entries({role: signal(role, [0.0, -largest])}, nothing, set())
    assert entry.keys["unit"] == f'"{unit}"'
    assert len(entry.answer.doubts) == 1 + (role == "phi")
    assert any("write it in place" in one for one in entry.answer.doubts) == (unit == ASK)


@pytest.mark.parametrize(("sense", "unit", "sign", "offset"), [
    ("clockwise from north", "deg", False, None), ("anticlockwise from north", "deg", True, None),
    ("anticlockwise from east", "deg", True, 90.0), ("anticlockwise from east", "rad", True, math.pi / 2),
])  # fmt: skip
def test_a_heading_gets_the_sign_and_offset_of_its_sense(
    sense: str, unit: str, sign: bool, offset: float | None
) -> None:
    found = {"heading": signal("heading", [10.0, 20.0])}
    (entry,) = motion_entries(found, verdict(unit_of_psi=unit, sense_of_psi=sense), {})
    assert entry.table == "channels.psi"
    assert entry.keys["unit"] == f'"{unit}"'
    assert entry.keys.get("sign") == ("-1" if sign else None)
    assert (float(entry.keys["offset"]) if "offset" in entry.keys else None) == (offset and pytest.approx(offset))


def test_a_rate_that_grows_to_port_is_turned() -> None:
    found = {"r": signal("r", [1.0, 2.0], unit="deg/s")}
    for sense in ("to port", "to starboard"):
        (entry,) = motion_entries(found, verdict(unit_of_r="deg/s", sense_of_r=sense), {})
        assert (entry.table, entry.keys.get("sign")) == ("channels.r", "-1" if sense == "to port" else None)
        assert entry.keys["unit"] == '"deg/s"'
    (entry,) = motion_entries({"r": signal("r", [1.0, 2.0])}, verdict(unit_of_r="deg/s", sense_of_r="to port"), {})
    assert entry.keys["unit"] == f'"{ASK}"'


@pytest.mark.slow
def test_a_wind_rests_on_the_frame_of_speeds_and_is_doubted_with_it(tmp_path: Path) -> None:
    """A model that hardly turns, in noise: which side of v is starboard is open, and so is the side of the wind."""
    how = {**MODEL, "noise": 2.0, "rudder": 2.0, "current": 0.0, "wind": 0.275}
    log = sailed(**how, seed=427, psi_0=4.0)
    sheet = Sheet().put("time", stamps(log.t, "utc")).put("x", log["x"], 4).put("y", log["y"], 4)
    sheet.put("psi [rad]", log["psi"], 5).put("u", log["u"], 4).put("v", log["v_m"], 4)
    sheet.put("r [deg/s]", np.degrees(log["r"]), 6).put("delta [deg]", np.degrees(log["delta"]), 3)
    sheet.put("apparent wind speed [m/s]", log["U_A"], 3)
    sheet.put("apparent wind angle", np.degrees(log["gamma_A"]) % 360.0, 2)
    found = guess(sheet.write(tmp_path / "log.csv"))
    assert any("the frame of speeds may also be" in one for one in found.doubts)
    assert any(one.startswith("apparent: its sense rests on the frame of speeds") for one in found.doubts)
