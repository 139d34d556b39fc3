"""What each key of a scenario becomes: SI units, radians, places in metres, and what stays as it was before."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pytest

from seatrial.core.errors import RequestError
from seatrial.environment import CALM
from seatrial.realtime.range.scenario import Scenario
from seatrial.ships.files import load
from seatrial.ships.writing import save
from seatrial.workflow.afloat.scenarios import scenario_of

DEG = math.pi / 180.0
PLAIN: Mapping[str, Any] = MappingProxyType({"schema": "seatrial-scenario/1", "duration": 600.0,
                                             "own": {"ship": "kvlcc2"}})  # fmt: skip


def made(own: Mapping[str, Any] = MappingProxyType({}), **more: Any) -> Scenario:
    document = copy.deepcopy({**PLAIN, **more})
    document["own"] = {"ship": "kvlcc2", **own}
    return scenario_of(document, Path("here") / "scene.toml")


def refused(text: str, own: Mapping[str, Any] = MappingProxyType({}), **more: Any) -> None:
    with pytest.raises(RequestError, match=text):
        made(own, **more)


def test_a_scenario_of_two_keys_has_the_usual_values() -> None:
    found = made()
    assert (found.title, found.duration, found.rate, found.seed) == ("scene", 600.0, 10.0, 1)
    assert (found.datum, found.variation, found.gusts, found.chart, found.weather) == (None, None, None, None, ())
    assert found.epoch == 1_767_268_800.0  # 2026-01-01 12:00 UTC
    sailing = found.own.sailing
    assert (sailing.x, sailing.y, sailing.psi, sailing.route, sailing.mmsi) == (0.0, 0.0, 0.0, (), 0)
    assert sailing.speed == found.own.ship.speed
    assert (found.own.usual, found.own.piloted) == (False, True)
    assert (found.limits.cpa, found.limits.tcpa, found.limits.rudder) == (926.0, 720.0, pytest.approx(5.0 * DEG))
    assert (found.limits.cross_track, found.limits.under_keel) == (None, None)
    judged = found.criteria
    assert (judged.passing_distance, judged.cross_track, judged.heading_error, judged.time, judged.settle) \
        == (None, None, None, None, 60.0)


def test_the_own_ship_has_its_own_instruments_and_pilot() -> None:
    found = made({"instruments": "usual", "pilot": "none", "mmsi": 235_000_001, "speed": 6.5})
    assert (found.own.usual, found.own.piloted) == (True, False)
    assert (found.own.sailing.mmsi, found.own.sailing.speed) == (235_000_001, 6.5)


def test_a_start_without_a_zone_is_utc() -> None:
    from datetime import datetime

    assert made(start=datetime.fromisoformat("1970-01-02T00:00:00")).epoch == 86400.0
    assert made(start=datetime.fromisoformat("1970-01-02T00:00:00+09:00")).epoch == 86400.0 - 9 * 3600.0


def test_a_heading_is_as_told_else_towards_the_first_waypoint() -> None:
    assert made({"heading": 270.0, "route": [[0.0, 900.0]]}).own.sailing.psi == pytest.approx(1.5 * math.pi)
    sailing = made({"at": [1000.0, 2000.0], "route": [[900.0, 2300.0], [5000.0, 0.0]]}).own.sailing
    assert sailing.psi == pytest.approx(math.atan2(300.0, -100.0))
    assert (sailing.x, sailing.y) == (1000.0, 2000.0)
    assert sailing.route == ((900.0, 2300.0), (5000.0, 0.0))


def test_points_by_latitude_are_metres_north_and_east_of_the_place() -> None:
    """A minute of latitude is a sea mile; a minute of longitude at 60 deg is half of one (WGS 84 to a percent)."""
    found = made({"route": [{"lat": 60.0 + 1.0 / 60.0, "lon": 10.0}, {"lat": 60.0, "lon": 10.0 + 2.0 / 60.0}]},
                 place=[60.0, 10.0])  # fmt: skip
    (north, nothing), (still, east) = found.own.sailing.route
    assert (north, east) == (pytest.approx(1852.0, rel=0.01), pytest.approx(1852.0, rel=0.01))
    assert abs(nothing) < 1.0
    assert abs(still) < 1.0
    assert found.datum is not None
    assert (found.datum.latitude, found.datum.longitude) == (60.0, 10.0)


def test_without_a_place_x_and_y_are_zero_where_the_own_ship_begins() -> None:
    found = made({"at": {"lat": 35.5, "lon": -139.0}})
    assert found.datum is not None
    assert (found.datum.latitude, found.datum.longitude) == (35.5, -139.0)
    assert math.hypot(found.own.sailing.x, found.own.sailing.y) < 1e-6


@pytest.mark.parametrize(("at", "told"), [
    ({"lat": 89.5, "lon": 0.0}, "lat is 89.5; it is a number of degrees, -89 to 89"),
    ({"lat": 0.0, "lon": 180.5}, "lon is 180.5; it is a number of degrees, -180 to 180"),
    ({"lat": -89.5, "lon": 0.0}, "lat is -89.5"),
    ({"lat": True, "lon": 0.0}, "lat is True"),
    ({"lat": "1", "lon": 0.0}, "lat is '1'"),
    ({"lat": 1.0}, "lon is None"),
    ({"lat": 1.0, "lom": 0.0}, "no key 'lom'"),
    ([1.0], r"is \[1.0\]; write \[NORTH, EAST\]"),
    ([1.0, 2.0, 3.0], r"write \[NORTH, EAST\]"),
    ([1.0, True], r"write \[NORTH, EAST\]"),
    ([1.0, "2"], r"write \[NORTH, EAST\]"),
    ([math.nan, 0.0], r"write \[NORTH, EAST\]"),
    ([0.0, math.inf], r"write \[NORTH, EAST\]"),
    ([8e5, 8e5], r"write \[NORTH, EAST\]"),
    ("there", r"write \[NORTH, EAST\]"),
])  # fmt: skip
def test_a_place_that_is_none_is_refused(at: object, told: str) -> None:
    refused(f"own.at: .*{told}", {"at": at}, place=[0.0, 0.0])


def test_edges_of_what_a_place_may_be_are_taken() -> None:
    assert made({"at": [6e5, 8e5]}).own.sailing.x == 6e5  # a thousand kilometres off, to the metre
    assert made({"at": {"lat": 89.0, "lon": 180.0}}).datum is not None
    refused(r"own.route 1: is \d+ km from where x and y are zero; a scenario reaches 1000 km",
            {"route": [{"lat": 10.0, "lon": 0.0}]}, place=[0.0, 0.0])  # fmt: skip
    refused(r"own.route 1: is a latitude and longitude; give place", {"route": [{"lat": 10.0, "lon": 0.0}]})


def test_waypoints_on_one_another_are_refused_from_the_start_on() -> None:
    refused("own.route 1: is at the point before it", {"at": [5.0, 5.0], "route": [[5.0, 5.9]]})
    refused("own.route 2: is at the point before it", {"route": [[100.0, 0.0], [100.0, 0.9]]})
    assert len(made({"route": [[100.0, 0.0], [100.0, 1.0]]}).own.sailing.route) == 2


def test_others_are_ships_of_the_library_of_a_file_or_of_a_length(tmp_path: Path) -> None:
    save(load("kcs"), tmp_path / "mine.toml")
    document = copy.deepcopy({**PLAIN, "traffic": {
        "a": {"ship": "kcs", "speed": 3.0, "mmsi": 235_000_002, "ais": "none", "radar": False},
        "b": {"ship": "mine.toml", "at": [10.0, 20.0], "heading": 90.0},
        "c": {"length": 100.0, "speed": 6.0}}})  # fmt: skip
    (a, b, c) = scenario_of(document, tmp_path / "scene.toml").others
    assert (a.name, a.ship.name, a.sailing.speed, a.sailing.mmsi, a.ais, a.radar) \
        == ("a", "kcs", 3.0, 235_000_002, "none", False)
    assert (b.ship.L_pp, b.sailing.psi, b.sailing.x, b.sailing.y) == (load("kcs").L_pp, 90.0 * DEG, 10.0, 20.0)
    assert (b.sailing.speed, b.ais, b.radar) == (b.ship.speed, "class A", True)
    assert (c.ship.L_pp, c.ship.speed, c.sailing.speed) == (100.0, 6.0, 6.0)


@pytest.mark.parametrize(("other", "told"), [
    ({}, "give a ship, or the length of one"),
    ({"ship": "kcs", "length": 100.0}, "give a ship, or the length of one"),
    ({"length": 100.0}, "a ship of a length alone needs a speed above zero"),
    ({"length": 100.0, "speed": 0.0}, "needs a speed above zero"),
    ({"length": 100.0, "speed": 31.4}, "speed is 31.4 m/s; no ship of 100 m goes that fast"),
])  # fmt: skip
def test_another_ship_that_is_none_is_refused(other: dict[str, Any], told: str) -> None:
    refused(f"traffic.x.*{told}", traffic={"x": other})


def test_a_ship_of_a_length_may_go_at_the_speed_of_its_own_wave() -> None:
    (x,) = made(traffic={"x": {"length": 100.0, "speed": 31.3}}).others  # Froude number one is sqrt(9.81 * 100) = 31.32
    assert x.ship.speed == 31.3
    refused("traffic.own: is the own ship", traffic={"own": {"ship": "kcs"}})


def test_weather_changes_what_it_names_and_leaves_the_rest() -> None:
    """Wind by where it comes from, current by where it goes, depth as its inverse."""
    first, second, third = made({"ship": "kvlcc2_shallow"}, weather=[
        {"wind": "10,30", "depth": 50.0},
        {"at": 60.0, "over": 20.0, "current": "0.5,90"},
        {"at": 80.0, "wind": "4,180", "waves": "2,8,90"},
    ]).weather  # fmt: skip
    assert [(one.at, one.over) for one in (first, second, third)] == [(0.0, 0.0), (60.0, 20.0), (80.0, 0.0)]
    assert (first.around.wind_x, first.around.wind_y) == pytest.approx((10 * math.cos(30 * DEG), 5.0))
    assert first.around.per_depth == pytest.approx(1.0 / 50.0)
    assert (first.around.current_x, first.around.current_y) == (CALM.current_x, CALM.current_y)
    assert (second.around.current_x, second.around.current_y) == pytest.approx((0.0, 0.5), abs=1e-12)
    assert (second.around.wind_x, second.around.per_depth) == (first.around.wind_x, first.around.per_depth)
    assert (third.around.wind_x, third.around.wind_y) == pytest.approx((-4.0, 0.0), abs=1e-12)
    assert (third.around.wave_x, third.around.wave_y, third.around.wave_T) == pytest.approx((0.0, 2.0, 8.0), abs=1e-12)
    assert third.around.current_y == pytest.approx(0.5)


def test_weather_that_begins_before_the_last_is_reached_is_refused() -> None:
    refused("weather 2: begins at 79 s, before the one before it is reached at 80 s",
            weather=[{"at": 60.0, "over": 20.0, "current": "1,0"}, {"at": 79.0, "current": "0,0"}])  # fmt: skip
    refused("weather 1: --wind", weather=[{"wind": "fast"}])


@pytest.mark.parametrize(("fault", "by"), [
    ({"kind": "jump", "of": "gyro", "by": {"heading": 5.0}}, {"psi": 5.0 * DEG}),
    ({"kind": "drift", "of": "gnss", "by": {"north": 0.1, "course": 2.0}}, {"x": 0.1, "chi": 2.0 * DEG}),
    ({"kind": "jump", "of": "speed_log", "by": {"aside": -0.3}}, {"v_w": -0.3}),
    ({"kind": "frozen", "of": "rate_gyro"}, {}),
    ({"kind": "silent", "of": "anemometer", "at": 20.0, "lasts": 30.0, "label": "no wind"}, {}),
])  # fmt: skip
def test_errors_of_instruments_are_in_their_units(fault: dict[str, Any], by: dict[str, float]) -> None:
    (found,) = made(faults=[fault]).faults
    assert found.by == pytest.approx(by)
    assert (found.kind, found.of, found.at, found.lasts) \
        == (fault["kind"], fault["of"], fault.get("at"), fault.get("lasts"))
    assert found.label == fault.get("label", f"{fault['of']} {fault['kind']}")
    assert found.rate == math.inf


def test_slow_gear_turns_by_degrees_and_a_shaft_by_revolutions() -> None:
    rudder, shaft = made(faults=[{"kind": "slow", "of": "delta", "rate": 0.5}, {"kind": "slow", "of": "n_P",
                                                                               "rate": 0.02}]).faults  # fmt: skip
    assert (rudder.rate, shaft.rate) == (pytest.approx(0.5 * DEG), 0.02)


@pytest.mark.parametrize(("fault", "told"), [
    ({"kind": "jammed", "of": "gyro"}, "jammed of no control 'gyro'"),
    ({"kind": "frozen", "of": "delta"}, "frozen of no instrument 'delta'"),
    ({"kind": "jump", "of": "gyro", "by": {"rate": 5.0}}, "by: no value 'rate'"),
    ({"kind": "drift", "of": "gnss"}, "a drift needs by = { north = ... }"),
    ({"kind": "frozen", "of": "gyro", "by": {"heading": 5.0}}, "by is of jump and drift; frozen has none"),
    ({"kind": "slow", "of": "delta"}, "slow gear needs its rate"),
    ({"kind": "jammed", "of": "delta", "rate": 1.0}, "no other fault has one"),
    ({"kind": "silent", "of": "gyro", "rate": 1.0}, "no other fault has one"),
])  # fmt: skip
def test_a_fault_that_cannot_be_is_refused(fault: dict[str, Any], told: str) -> None:
    refused(f"faults 1: .*{told}", faults=[fault])


def test_what_would_begin_when_the_run_is_over_is_refused() -> None:
    refused("weather 1: begins at 600 s; the run ends at 600 s", weather=[{"at": 600.0, "wind": "1,0"}])
    refused("faults 1: begins at 600 s", faults=[{"kind": "silent", "of": "gyro", "at": 600.0}])
    refused("the heading counts at 600 s", criteria={"heading_error": 3.0, "settle": 600.0})
    assert made(criteria={"settle": 600.0}).criteria.settle == 600.0  # no heading is judged
    assert made(faults=[{"kind": "silent", "of": "gyro", "at": 599.0}, {"kind": "silent", "of": "gnss"}]).faults


def test_criteria_and_alarms_are_in_radians() -> None:
    found = made(criteria={"passing_distance": 500.0, "cross_track": 40.0, "heading_error": 3.0, "time": 90.0,
                           "settle": 30.0},
                 alarms={"cpa": 300.0, "tcpa": 200.0, "cross_track": 25.0, "rudder": 10.0},
                 variation=-7.0)  # fmt: skip
    one, other = found.criteria, found.limits
    assert (one.passing_distance, one.cross_track, one.heading_error, one.time, one.settle, one.under_keel) \
        == (500.0, 40.0, pytest.approx(3.0 * DEG), 90.0, 30.0, None)
    assert (other.cpa, other.tcpa, other.cross_track, other.rudder, other.under_keel) \
        == (300.0, 200.0, 25.0, pytest.approx(10.0 * DEG), None)
    assert found.variation == pytest.approx(-7.0 * DEG)
    for table in ("criteria", "alarms"):
        refused(f"{table}.under_keel: there is no chart", **{table: {"under_keel": 2.0}})


def test_a_chart_is_of_the_library_or_beside_the_scenario(tmp_path: Path) -> None:
    keel = {"criteria": {"under_keel": 2.0}, "alarms": {"under_keel": 3.0}}
    document = copy.deepcopy({**PLAIN, "chart": "canal", **keel})
    found = scenario_of(document, tmp_path / "scene.toml")
    assert found.chart is not None
    assert (found.criteria.under_keel, found.limits.under_keel) == (2.0, 3.0)
    (tmp_path / "canal").write_text("a file of that name without a suffix is no chart")
    again = scenario_of(copy.deepcopy(document | {"schema": PLAIN["schema"]}), tmp_path / "scene.toml")
    assert again.chart is not None
    assert again.chart.name == found.chart.name
    refused("chart: .*nowhere", chart="nowhere")
