"""What the commands in real time put together: other ships, places, situations, buttons."""

from __future__ import annotations

import copy
import json
import math
import statistics
from pathlib import Path
from typing import Any

import pytest

from seatrial.data.geodesy import Datum
from seatrial.realtime.listening import listen
from seatrial.ships.files import load
from seatrial.workflow import RequestError
from seatrial.workflow.afloat import cannot, datum_of, drills, other_of, sail, situation_of
from seatrial.workflow.afloat.scenarios import scenario_of
from seatrial.workflow.asked import Departure, InWaves, Sailing
from seatrial.workflow.request import pair


def test_another_ship_begins_where_and_as_fast_as_told() -> None:
    ship, begun = other_of("kcs@2000,-500,270,4.5")
    assert ship.name == "kcs"
    assert (begun.x, begun.y, begun.psi, begun.speed) == pytest.approx((2000.0, -500.0, math.radians(270.0), 4.5))
    assert other_of("kcs@0,0,90")[1].speed == ship.speed


@pytest.mark.parametrize("text", ["kcs", "kcs@1,2", "kcs@1,2,x", "kcs@1,2,nan", "kcs@1,2,3,-1", "kcs@1,2,3,4,5"])
def test_another_ship_of_another_form_is_refused(text: str) -> None:
    with pytest.raises(RequestError, match="--other"):
        other_of(text)


@pytest.mark.slow
def test_another_ship_without_a_rudder_drifts_and_that_is_said() -> None:
    said: list[str] = []
    ran = sail("kvlcc2_l7", departure=Departure(other=("otter@0,50,0",)), run=Sailing(duration=1.0), note=said.append)
    assert [line.strip() for line in said[1:]] == ["0.0 s  drifts: otter has no rudder to steer; it drifts freely"]
    assert [event.ship for event in ran.stage.loop.events] == ["1 otter"]


def test_a_page_without_a_chart_knows_place_and_date() -> None:
    datum = Datum(35.1, 139.7)
    found = situation_of(None, datum, 1.7e9)
    assert (found.datum, found.epoch) == (datum, 1.7e9)


def test_a_page_with_a_chart_lies_where_the_chart_does(tmp_path: Path) -> None:
    shape = {"type": "Polygon", "coordinates": [[[10.0, 63.0], [10.01, 63.0], [10.01, 63.01], [10.0, 63.0]]]}
    land = {"type": "Feature", "properties": {}, "geometry": shape}
    path = tmp_path / "coast.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [land]}), encoding="utf-8")
    datum = Datum(63.0, 10.0)
    found = situation_of(str(path), datum, 5.0)
    assert (found.datum, found.epoch) == (datum, 5.0)
    assert len(found.shown.land) + len(found.shown.coasts) == 1
    with pytest.raises(RequestError, match="--chart"):
        situation_of(str(tmp_path / "none.geojson"), datum, 5.0)


def test_a_place_is_latitude_then_longitude() -> None:
    assert datum_of("35.1,139.7") == Datum(35.1, 139.7)
    assert datum_of(None) is None
    with pytest.raises(RequestError, match="--pair is '1,inf'"):
        pair("--pair", "1,inf", "A,B")


@pytest.mark.parametrize(
    ("host", "port", "anywhere", "about"),
    [("0.0.0.0", 0, False, "--anywhere"), ("ship", 0, False, "IPv4"), ("127.0.0.1", -1, False, "--port is -1"),
     ("127.0.0.1", 65536, False, "--port is 65536")],
)  # fmt: skip
def test_a_port_that_cannot_be_is_refused(host: str, port: int, anywhere: bool, about: str) -> None:
    with pytest.raises(RequestError, match=about):
        listen(host, port, anywhere)


def test_a_taken_port_is_refused_and_a_free_one_is_loopback() -> None:
    with listen("localhost", 0, False) as one:
        host, port = one.getsockname()
        assert host == "127.0.0.1"
        with pytest.raises(RequestError, match=f"port {port} "):
            listen("localhost", port, False)


def made(name: str) -> dict[str, Any]:
    ship = load(name)
    return {text: make(1.5) for text, make in drills(ship).items()}


def test_the_buttons_are_what_they_say() -> None:
    found = made("kvlcc2_l7")
    degree = math.pi / 180.0
    for side, sign in (("starboard", 1.0), ("port", -1.0)):
        turn = found[f"Turn 35° {side}"]
        assert turn.delta == pytest.approx(sign * 35.0 * degree)
        assert turn.n_P == 1.5
    for angle in (10.0, 20.0):
        zigzag = found[f"Zigzag {angle:g}/{angle:g}"]
        assert (zigzag.delta, zigzag.psi) == pytest.approx((angle * degree, angle * degree))
    assert not cannot(load("kvlcc2_l7"))


def test_a_craft_of_two_thrusters_has_the_buttons_of_its_engines_only() -> None:
    why = cannot(load("otter"))
    assert all("Turn" in text or "urn" in text or "Zigzag" in text or "Pull" in text or "astern" in text
               for text in why)  # fmt: skip
    assert "Zigzag 10/10" in why
    assert "Stopping" not in why


YAW = "omega [rad/s],chi [deg],yaw [deg/m],yaw_phase [deg]\n" + "".join(
    f"{omega},{chi},1.0,0.0\n" for omega in (0.3, 0.6, 1.2, 2.4, 3.6) for chi in range(0, 181, 45)
)


def yawing(folder: Path) -> Path:
    """Operators of a ship that yaws by 1 deg in a wave of 1 m amplitude, whatever its length."""
    path = folder / "ship.csv"
    path.write_text(YAW, encoding="utf-8")
    return path


@pytest.mark.slow
@pytest.mark.parametrize("judge", [False, True])
def test_the_instruments_of_every_run_see_the_sea(judge: bool, tmp_path: Path) -> None:
    """H_S = 2 m is a standard deviation of half a metre, so of half a degree of yaw."""
    waves = InWaves("2,8,90", yawing(tmp_path))
    if judge:
        path = tmp_path / "scene.toml"
        path.write_text('schema = "seatrial-scenario/1"\nduration = 200.0\nsea = "2,8,90"\nrao = "ship.csv"\n'
                        '[own]\nship = "mariner"\npilot = "none"\n', encoding="utf-8")  # fmt: skip
        ran = sail(scenario=path, judge=True, run=Sailing(duration=1.0))
    else:
        ran = sail("mariner", waves=waves, run=Sailing(duration=1.0))
    loop, seen = ran.stage.loop, list[float]()
    for _ in range(2000):
        loop.step()
        seen += [math.remainder(one.values["psi"] - ran.plant["psi"], math.tau)
                 for one in loop.readings("own") if one.kind == "gyro"]  # fmt: skip
    assert math.degrees(statistics.pstdev(seen)) == pytest.approx(0.5, rel=0.3)


def test_waves_of_a_scenario_are_those_of_its_sea_or_given(tmp_path: Path) -> None:
    path = yawing(tmp_path)
    said = {"schema": "seatrial-scenario/1", "duration": 60.0, "sea": "2,8,90", "rao": path.name,
            "own": {"ship": "kvlcc2", "antenna": [10.0, -2.0]}, "weather": [{"at": 5.0, "wind": "10,0"}]}  # fmt: skip
    made = scenario_of(copy.deepcopy(said), tmp_path / "scene.toml")
    assert made.own.antenna == (10.0, -2.0)
    assert made.sea is not None
    assert [one.around.wave_y > 0.5 for one in made.weather] == [True, True]
    said["weather"] = [{"waves": "1,8,0"}]
    with pytest.raises(RequestError, match=r"weather 1\.waves: the sea gives the mean drift already"):
        scenario_of(said, tmp_path / "scene.toml")
