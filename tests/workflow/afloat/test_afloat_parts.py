"""What the commands in real time put together: other ships, places, situations, buttons."""

from __future__ import annotations

import copy
import json
import math
import statistics
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.core.listening import listen
from seatrial.data.geodesy import Datum
from seatrial.environment.chart import Chart
from seatrial.realtime.range.stage import Stage
from seatrial.ships.files import load
from seatrial.workflow import RequestError, afloat
from seatrial.workflow.afloat import cannot, drills, sail, situation_of
from seatrial.workflow.afloat.scenarios import scenario_of
from seatrial.workflow.afloat.scenes import alone, datum_of, other_of, varied
from seatrial.workflow.asked import Around, Departure, InWaves, RealTime
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
    ran = sail("kvlcc2_l7", departure=Departure(other=("otter@0,50,0",)), run=RealTime(duration=1.0), note=said.append)
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
        ran = sail(scenario=path, judge=True, run=RealTime(duration=1.0))
    else:
        ran = sail("mariner", waves=waves, run=RealTime(duration=1.0))
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


SCENE: dict[str, Any] = {
    "schema": "seatrial-scenario/1", "duration": 600.0, "seed": 7, "gusts": "davenport",
    "own": {"ship": "kvlcc2", "at": [100.0, 50.0], "heading": 30.0, "speed": 6.0, "mmsi": 211000001},
    "traffic": {"ferry": {"length": 150.0, "speed": 8.0, "at": [3000.0, 3000.0], "heading": 270.0}},
    "weather": [{"at": 0.0, "wind": "10,0", "current": "0.5,90"}, {"at": 60.0, "over": 30.0, "wind": "20,90"}],
}  # fmt: skip


def changed(said: dict[str, Any] = SCENE, *, waves: InWaves = InWaves(), around: Around = Around(), **more: Any) -> Any:
    """A scenario with the options in place of what it says."""
    read = scenario_of(copy.deepcopy(said), Path("scene.toml"), None, more.get("seed"))
    return varied(read, Departure(**more), around, waves, lambda _: None)


def test_a_scenario_without_options_is_what_its_file_says() -> None:
    made = scenario_of(copy.deepcopy(SCENE), Path("scene.toml"))
    assert repr(changed()) == repr(made)
    said = {key: value for key, value in SCENE.items() if key not in ("weather", "gusts")}
    assert changed(said).weather == ()


def test_what_a_transponder_says_of_its_ship_stands_in_the_scenario() -> None:
    said = copy.deepcopy(SCENE)
    said["own"] |= {"type": "tanker"}
    said["traffic"]["ferry"] |= {"type": "passenger", "status": "restricted"}
    made = changed(said)
    assert (made.own.sailing.kind, made.own.sailing.status) == ("tanker", "under way")
    assert (made.others[0].sailing.kind, made.others[0].sailing.status) == ("passenger", "restricted")
    fit = Stage(made).fittings.transponder
    assert (fit.kind, fit.status) == ("tanker", "under way")


def test_options_take_the_place_of_what_a_scenario_says_of_its_own_ship() -> None:
    own = changed(speed=4.0, heading=0.0, mmsi=265000001, sensors=True, antenna="10,-2").own
    assert (own.sailing.x, own.sailing.y, own.sailing.psi) == (100.0, 50.0, 0.0)
    assert (own.sailing.speed, own.sailing.mmsi, own.usual, own.antenna) == (4.0, 265000001, True, (10.0, -2.0))
    begun = changed(start="1,2,90").own.sailing
    assert (begun.x, begun.y, begun.psi, begun.speed) == pytest.approx((1.0, 2.0, 0.5 * math.pi, 6.0))
    assert (changed().own.piloted, alone(load("kvlcc2")).own.piloted) == (True, False)
    assert (changed().seed, changed(seed=1).seed, alone(load("kvlcc2")).seed) == (7, 1, 1)


def test_other_ships_join_those_of_a_scenario() -> None:
    made = changed(other=("kcs@2000,500,180,5",))
    assert [one.name for one in made.others] == ["ferry", "1 kcs"]
    assert made.others[1].sailing.psi == pytest.approx(math.pi)


def test_weather_that_is_given_holds_to_the_end_and_the_rest_stays() -> None:
    """Of wind, current, depth and gusts each by itself; a current has no share in the wind of the scenario."""
    first, second = (one.around for one in changed(around=Around(current="1,180")).weather)
    assert (first.wind_x, second.wind_x, second.wind_y) == pytest.approx((10.0, 0.0, 20.0))
    assert (first.current_x, second.current_x) == pytest.approx((-1.0, -1.0))
    assert (first.current_y, second.current_y) == pytest.approx((0.0, 0.0), abs=1e-12)
    made = changed(around=Around(wind="5,180"))
    assert [one.around.wind_x for one in made.weather] == pytest.approx([-5.0, -5.0])
    assert [one.around.current_y for one in made.weather] == pytest.approx([0.5, 0.5])
    assert [(one.at, one.over) for one in made.weather] == [(0.0, 0.0), (60.0, 30.0)]
    later = {**SCENE, "weather": [{"at": 60.0, "wind": "20,90"}]}
    begun = changed(later, around=Around(current="1,180")).weather
    assert [(one.at, round(one.around.wind_y, 9)) for one in begun] == [(0.0, 0.0), (60.0, 20.0)]
    assert [one.around.current_x for one in begun] == pytest.approx([-1.0, -1.0])
    assert changed(around=Around(gusts="harris")).gusts == "harris"
    still = {key: value for key, value in SCENE.items() if key not in ("weather", "gusts")}
    with pytest.raises(RequestError, match="--gusts need a mean wind"):
        changed(still, around=Around(gusts="davenport"))


def test_a_sea_that_is_given_replaces_that_of_a_scenario_with_its_mean_drift(tmp_path: Path) -> None:
    rao = yawing(tmp_path)
    said = {**SCENE, "sea": "2,8,90", "rao": str(rao)}
    before, after, flat = (changed(said, waves=waves) for waves in (
        InWaves(), InWaves("1,8,0", rao), InWaves("0,8,0", rao)))  # fmt: skip
    for made, height in ((before, 2.0), (after, 1.0), (flat, 0.0)):
        sizes = [math.hypot(one.around.wave_x, one.around.wave_y) for one in made.weather]
        assert sizes == pytest.approx([height] * len(sizes), rel=0.02), height
    assert after.weather[0].around.wave_y == pytest.approx(0.0, abs=1e-9)  # from the north
    with pytest.raises(RequestError, match="--waves: the sea of the scenario gives the mean drift already"):
        changed(said, around=Around(waves="1,8,0"))
    again, other = changed(said), changed(said, seed=8)
    assert repr(again.sea) == repr(before.sea)
    assert repr(other.sea) != repr(before.sea)


def test_a_place_is_given_once() -> None:
    assert changed(place="35.1,139.7").datum == Datum(35.1, 139.7)
    with pytest.raises(RequestError, match="--place is given by the scenario"):
        changed({**SCENE, "place": [35.0, 139.0]}, place="35.1,139.7")


@pytest.mark.slow
def test_a_scenario_is_judged_under_the_options_of_its_command(tmp_path: Path, capsys: Any) -> None:
    """The same route in a current across it: the pilot of the ship is set off further."""
    path = tmp_path / "scene.toml"
    path.write_text('schema = "seatrial-scenario/1"\nduration = 300.0\n[own]\nship = "kvlcc2"\nspeed = 7.0\n'
                    'pilot = "track"\nroute = [[5000.0, 0.0]]\n[criteria]\ncross_track = 20.0\n')  # fmt: skip
    found: list[dict[str, Any]] = []
    for given, status in (([], 0), (["--current", "1.5,90"], 1)):
        assert main(["range", str(path), "--json", *given]) == status
        found.append(json.loads(capsys.readouterr().out))
    still, set_off = (one["indices"]["cross_track_max"] for one in found)
    assert still < 1.0
    assert set_off > 20.0


def test_a_scenario_with_a_chart_has_the_page_that_shows_it(tmp_path: Path) -> None:
    datum = Datum(63.0, 10.0)
    chart = Chart("a", fairways=(np.array([[0.0, 0.0], [500.0, 0.0]]),))
    given = {"schema": "seatrial-scenario/1", "duration": 10.0, "own": {"ship": "kvlcc2", "pilot": "none"}}
    played = replace(scenario_of(given, tmp_path / "s.toml"), datum=datum, epoch=1.7e9, chart=chart)
    kept, found = afloat._charted(played, tmp_path / "s.toml", None)
    assert kept is played
    assert (found.datum, found.epoch, found.shown.chart) == (datum, 1.7e9, chart)
    with pytest.raises(RequestError, match=r"--chart is given by the scenario; leave it out, or change .*s\.toml"):
        afloat._charted(played, tmp_path / "s.toml", "coast.geojson")
