"""Scenario files: what they mean, what is refused and where, and the command that plays them."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import pytest

from scenes import DEG
from seatrial.cli.app import main
from seatrial.core.errors import RequestError
from seatrial.workflow.afloat import sail
from seatrial.workflow.afloat.scenarios import read_scenario
from seatrial.workflow.asked import Wire

EXAMPLES = Path(__file__).parents[3] / "examples"
WHOLE = """schema = "seatrial-scenario/1"
title = "A test"
duration = 120.0
rate = 2.0
place = [35.0, 139.7]
variation = -7.0
gusts = "davenport"
[own]
ship = "kvlcc2"
route = [{ lat = 35.02, lon = 139.7 }, [3000.0, 1000.0]]
[traffic.ferry]
length = 150.0
speed = 7.0
at = [4000.0, 3500.0]
heading = 270.0
[traffic.box]
ship = "kcs"
at = [6000.0, 600.0]
route = [[0.0, 700.0]]
ais = "class B"
[[weather]]
wind = "10,45"
current = "0.5,90"
[[weather]]
at = 30.0
over = 10.0
current = "0.2,180"
[[faults]]
kind = "jump"
of = "gyro"
by = { heading = 5.0 }
at = 40.0
[[faults]]
kind = "slow"
of = "delta"
rate = 0.5
[criteria]
passing_distance = 500.0
heading_error = 3.0
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "scenario.toml"
    path.write_text(text)
    return path


def test_a_whole_file(tmp_path):
    said = read_scenario(written(tmp_path, WHOLE))
    ferry, box = said.others
    assert said.own.sailing.route[0][0] == pytest.approx(2219.0, abs=3.0)  # 1.2 minutes of latitude
    assert said.own.sailing.psi == pytest.approx(0.0, abs=1e-6)  # towards the first waypoint
    assert ferry.ship.speed == 7.0
    assert math.degrees(ferry.sailing.psi) == pytest.approx(270.0)
    assert math.degrees(box.sailing.psi) == pytest.approx(180.0 - math.degrees(math.atan2(100.0, 6000.0)))
    assert [one.around.current_x for one in said.weather] == pytest.approx([0.0, -0.2])
    assert said.weather[1].around.wind_x == said.weather[0].around.wind_x  # what is left out stays
    assert said.faults[0].by == {"psi": pytest.approx(5.0 * DEG)}
    assert said.faults[1].rate == pytest.approx(0.5 * DEG)
    assert said.criteria.heading_error == pytest.approx(3.0 * DEG)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('schema = "seatrial-scenario/1"', 'schema = "seatrial-ship/1"', "is a ship file, for seatrial simulate"),
        ("duration = 120.0", "duratoin = 120.0", r"no key 'duratoin'; near: duration"),
        ("duration = 120.0", "duration = -1.0", "duration is -1.0"),
        ('ship = "kvlcc2"', 'ship = "kvlcc3"', "kvlcc2"),
        ("length = 150.0", "lenght = 150.0", r"traffic.ferry.lenght: no key 'lenght'; near: length"),
        ("length = 150.0\n", "", "traffic.ferry: give a ship, or the length"),
        ("length = 150.0\nspeed = 7.0", "length = 150.0", "needs a speed above zero"),
        ("speed = 7.0", "speed = 700.0", "traffic.ferry.speed is 700"),
        ("[traffic.ferry]", "[traffic.own]", "traffic.own: is the own ship"),
        ("route = [[0.0, 700.0]]", "route = [[0.0]]", r"traffic.box.route 1: is \[0.0\]; write"),
        ("route = [[0.0, 700.0]]", "route = [[6000.0, 600.0]]", "route 1: is at the point before it"),
        ("{ lat = 35.02, lon = 139.7 }", "{ lat = 35.02, lng = 139.7 }", "own.route 1: no key 'lng'; near: "),
        ("{ lat = 35.02, lon = 139.7 }", "{ lat = 95.0, lon = 139.7 }", "lat is 95.0; it is a number of degrees"),
        ("place = [35.0, 139.7]\n", "", "own.route 1: is a latitude and longitude; give place"),
        ('ais = "class B"', 'ais = "class C"', "traffic.box.ais is 'class C'"),
        ('gusts = "davenport"', 'gusts = "davenprt"', "no gust spectrum 'davenprt'; near: davenport"),
        ('wind = "10,45"', 'wind = "10"', "weather 1: .*write M/S,DEG"),
        ("at = 30.0\nover = 10.0", "at = 0.0\nover = 10.0\n[[weather]]\nat = 5.0", "weather 3: begins at 5 s, before"),
        ('of = "gyro"', 'of = "gryo"', "faults 1: jump of no instrument 'gryo'; near: .*gyro"),
        ('of = "delta"', 'of = "dleta"', "faults 2: slow of no control 'dleta'; near: delta"),
        ("by = { heading = 5.0 }\n", "", r"faults 1: a jump needs by = \{ heading"),
        ("by = { heading = 5.0 }", "by = { headng = 5.0 }", "faults 1: by: no value 'headng'; near: heading"),
        ("rate = 0.5", "", "faults 2: slow gear needs its rate"),
        ("passing_distance = 500.0", "pasing_distance = 500.0", "criteria.pasing_distance: no key .*passing_distance"),
        ("title =", "title", "scenario.toml"),
        ("at = 30.0\nover", "at = 120.0\nover", "weather 2: begins at 120 s; the run ends at 120 s"),
        ("duration = 120.0", "duration = 10.0", "begins at .* the run ends at 10 s"),
        ("{ lat = 35.02, lon = 139.7 }", "{ lat = -35.0, lon = 139.7 }",
         "own.route 1: is [5-7][0-9]{3} km from where x and y are zero; a scenario reaches 1000 km"),
        ("{ lat = 35.02, lon = 139.7 }", "{ lat = 35.0, lon = 155.0 }", "own.route 1: is 1[0-9]{3} km from"),
        ("[criteria]", "[criteria]\nsettle = 500.0", "criteria.settle: the heading counts at 500 s; the run ends"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(tmp_path, old, new, message):
    assert WHOLE.count(old) >= 1
    path = written(tmp_path, WHOLE.replace(old, new, 1))
    with pytest.raises(RequestError, match=message) as error:
        read_scenario(path)
    assert "\n" not in str(error.value)


@pytest.mark.slow
def test_the_command_plays_judges_and_records(tmp_path, capsys):
    path = written(tmp_path, WHOLE.replace("passing_distance = 500.0", "passing_distance = 100000.0"))
    out = tmp_path / "run.csv"
    assert main(["range", str(path), "--json", "-o", str(out)]) == 1
    told = capsys.readouterr()
    said = json.loads(told.out)
    assert said["met"] is False
    assert [one["met"] for one in said["criteria"] if one["name"] == "passing_distance"] == [False, False]
    assert said["written"] == [str(out)]
    assert all({"priority", "text", "state", "spans"} <= set(one) for one in said["alarms"])
    assert said["steered_by"] == "pilot"
    assert "not met: passing_distance of ferry" in told.err
    again = sail(scenario=path, judge=True)
    assert again.stage.digest == said["state"]
    relaxed = written(tmp_path, WHOLE.replace("heading_error = 3.0", "heading_error = 60.0"))
    assert main(["range", str(relaxed)]) == 0
    assert "after" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["missing.toml"], "missing.toml"), (["--lock-step"], "give --nmea"), (["--log", "x"], "give --nmea"),
        (["--nmea", "udp://10.0.0.1:0"], "--anywhere"), (["--nmea", "udp://127.0.0.1:0", "--only", "HTD"], "near: HDT"),
        (["--nmea", "udp://127.0.0.1:0", "--answer-to", "ZDB"], "near: ZDA"), (["--patience", "0"], "--patience is 0"),
    ],
)  # fmt: skip
def test_wrong_requests_are_refused(tmp_path, capsys, given, message):
    path = given.pop(0) if given[0].endswith(".toml") else str(written(tmp_path, WHOLE))
    assert main(["range", path, *given]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.slow
def test_nobody_on_the_wire_ends_the_run_with_status_1(tmp_path, capsys):
    path = written(tmp_path, WHOLE)
    assert main(["range", str(path), "--nmea", "udp://127.0.0.1:0", "--lock-step", "--patience", "0.2"]) == 1
    assert "no valid sentence" in capsys.readouterr().err


CASES = {"head_on": ("kvlcc2", 320.0, 35.09), "crossing": ("kvlcc2", 320.0, 35.09),
         "crossing_from_port": ("mariner", 161.0, 35.09), "overtaking": ("kvlcc2", 320.0, 35.12),
         "strait": ("kvlcc2", 320.0, 35.12)}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_an_autopilot_that_knows_only_nmea_keeps_clear(name):
    """The same each time, and its own track pilot, which does not look around, comes too near."""
    path, (_, length, lat) = EXAMPLES / "range" / f"{name}.toml", CASES[name]
    pilot = f"{EXAMPLES / 'keep_clear_nmea.py'} {{address}} --length {length:g} --track 35,139.7 {lat},139.7"
    wire = Wire("udp://127.0.0.1:0", lock_step=True, beside=f"{sys.executable} {pilot}")
    ran = [sail(scenario=path, wire=wire, judge=True)
           for _ in range(2 if name == "crossing_from_port" else 1)]  # fmt: skip
    assert all(one.met for one in ran)
    assert ran[0].stage.judge.arrived is not None
    assert ran[0].stage.digest == ran[-1].stage.digest
    blind = sail(scenario=path, judge=True)
    assert not blind.met
    assert any(one.name == "passing_distance" and not one.met for one in blind.judged)


CANAL = """schema = "seatrial-scenario/1"
duration = 60.0
rate = 2.0
chart = "canal"
[own]
ship = "kvlcc2_harbour"
at = [0.0, 60.0]
heading = 0.0
speed = 4.0
[criteria]
under_keel = 3.0
[alarms]
under_keel = 5.0
"""


@pytest.mark.slow
def test_a_chart_is_felt_sounded_and_judged(tmp_path):
    """In 25 m of water with a draught of 20.8 m; the nearer bank turns the bow away."""
    canal = written(tmp_path, CANAL.replace("speed = 4.0", 'speed = 4.0\npilot = "none"'))
    ran = sail(scenario=canal, judge=True)
    plant = ran.stage.loop.vessels["own"].plant
    assert plant.place is not None
    assert plant["per_depth"] == pytest.approx(1.0 / 25.0)
    assert plant["psi"] < 0.0
    (keel,) = ran.judged
    assert (keel.name, keel.met) == ("under_keel", True)
    assert keel.value == pytest.approx(4.2, abs=0.01)
    assert [alarm.cause.text for alarm in ran.stage.alarms.standing()] == ["UNDER KEEL"]
    assert ran.document()["indices"]["under_keel"] == pytest.approx(4.2, abs=0.01)
    strict = written(tmp_path, CANAL.replace("under_keel = 3.0", "under_keel = 4.5"))
    assert not sail(scenario=strict, judge=True).met


@pytest.mark.parametrize(("old", "new", "message"), [
    ('chart = "canal"', 'chart = "canla"', "chart: no chart 'canla'; near: canal"),
    ('chart = "canal"', "", "criteria.under_keel: there is no chart|alarms.under_keel: there is no chart"),
    ('chart = "canal"', 'chart = "coast.geojson"', "a coast to look at"),
])  # fmt: skip
def test_a_chart_that_cannot_be_is_told_in_one_line(tmp_path, old, new, message):
    (tmp_path / "coast.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": [
        {"type": "Feature", "properties": {},
         "geometry": {"type": "LineString", "coordinates": [[139.7, 35.0], [139.8, 35.1]]}}]}))  # fmt: skip
    text = CANAL.replace(old, new).replace("duration = 60.0", "duration = 60.0\nplace = [35.0, 139.7]")
    with pytest.raises(RequestError, match=message) as error:
        read_scenario(written(tmp_path, text))
    assert "\n" not in str(error.value)


@pytest.mark.slow
def test_a_ship_that_begins_on_land_is_refused(tmp_path, capsys):
    path = written(tmp_path, CANAL.replace("at = [0.0, 60.0]", "at = [0.0, 260.0]"))
    assert main(["range", str(path)]) == 2
    told = capsys.readouterr().err
    assert "own: it starts aground" in told
    assert told.strip().count("\n") == 0
