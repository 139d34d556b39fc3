"""Charts on the bridge: where they are, the depth that ships feel, warnings, and files that are no chart."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.core.errors import ChartError
from seatrial.data.geodesy import Datum
from seatrial.environment.chart import Area, Chart
from seatrial.realtime.bridge.situation import Shown, Situation, read_chart
from seatrial.realtime.bridge.soundings import Soundings
from seatrial.realtime.bridge.view import OWN
from seatrial.realtime.loop import Loop
from seatrial.realtime.plant import Compiled
from seatrial.realtime.recording import dated
from seatrial.sensors.suite import draught
from seatrial.ships.files import load

HERE = Datum(35.0, 139.7)
SHIP = load("kvlcc2_shallow")
T = draught(SHIP)


def coast(folder: Path, *lines: list[list[float]], kind: str = "LineString") -> Path:
    path = folder / "coast.geojson"
    shapes = [{"type": kind, "coordinates": line} for line in lines]
    features = [{"type": "Feature", "properties": {}, "geometry": shape} for shape in shapes]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}), encoding="utf-8")
    return path


def test_a_coast_is_drawn_where_it_is(tmp_path: Path) -> None:
    """A point .01 degrees of latitude north is 1109 m north, one as much of longitude east is 912 m east."""
    shown, datum = read_chart(coast(tmp_path, [[139.7, 35.01], [139.71, 35.0]]), HERE)
    assert datum == HERE
    (line,) = shown.coasts
    np.testing.assert_allclose(line, [[1109.5, 0.0], [0.0, 912.9]], atol=2.0)


def test_lines_far_away_are_left_out_and_long_sides_that_pass_are_not(tmp_path: Path) -> None:
    """Beside a coast at hand one 1400 km north is left out; a side whose ends are 550 km off passes at 11 km."""
    passing = [[134.0, 35.1], [145.4, 35.1]]
    path = coast(tmp_path, [[139.7, 35.01], [139.71, 35.0]], [[139.7, 48.0], [139.8, 48.0]], passing)
    shown, _ = read_chart(path, HERE)
    assert [len(line) for line in shown.coasts] == [2, 2]
    assert max(float(np.abs(line[:, 0]).max()) for line in shown.coasts) < 50e3
    assert len(read_chart(coast(tmp_path, passing), HERE)[0].coasts) == 1


@pytest.mark.parametrize(("lon", "lat"), [(139.7, 48.0), (150.0, 35.0), (35.0, 139.7 - 90.0)])
def test_a_coast_that_is_elsewhere_is_refused_though_one_of_its_coordinates_fits(
    tmp_path: Path, lon: float, lat: float
) -> None:
    """Due north, due east, and with latitude and longitude exchanged."""
    with pytest.raises(ChartError, match=r"no land or coast within 300 km .*\[longitude, latitude\]"):
        read_chart(coast(tmp_path, [[lon, lat], [lon, lat + 0.01]]), HERE)


@pytest.mark.parametrize(
    ("text", "said"),
    [("{", "coast.geojson"), ('{"type": "Topology"}', "no FeatureCollection"),
     ('{"type": "Feature", "geometry": {"type": "LineString", "coordinates": [[139.7, 95.0], [139.7, 95.1]]}}',
      "feature 1: no geometry"),
     ('{"type": "Feature", "geometry": {"type": "LineString", "coordinates": [[139.7, 35.0]]}}', "feature 1"),
     ('{"type": "Feature", "geometry": null}', "feature 1")],
)  # fmt: skip
def test_what_is_no_chart_is_said_in_a_line(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "coast.geojson"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ChartError, match=said) as error:
        read_chart(path, HERE)
    assert len(str(error.value).splitlines()) == 1


def test_a_coast_needs_a_place(tmp_path: Path) -> None:
    with pytest.raises(ChartError, match="--place"):
        read_chart(coast(tmp_path, [[139.7, 35.0], [139.8, 35.0]]), None)


def shoal(depth: float, begins: float) -> Chart:
    """Water of a depth from so many metres north on."""
    outline = np.array([[begins, -9e3], [begins, 9e3], [begins + 9e3, 9e3], [begins + 9e3, -9e3]])
    return Chart("shoal", math.inf, (Area(outline, depth),), (), (), ())


@pytest.fixture(scope="module")
def compiled() -> Compiled:
    return Compiled.of(SHIP, 0.1)


def sailed(compiled: Compiled, chart: Chart | None, seconds: float) -> Loop:
    loop = Loop({OWN: compiled.plant()}, 10.0, math.inf)
    if chart is not None:
        Soundings(loop, chart)
    for _ in range(round(seconds * loop.rate)):
        loop.step()
    return loop


def events(loop: Loop) -> list[str]:
    return [one.text for one in loop.events if one.kind in ("little", "aground")]


@pytest.mark.slow
def test_a_ship_feels_the_depth_of_the_chart_from_where_it_begins(compiled: Compiled) -> None:
    free, shallow, far = (sailed(compiled, chart, 120.0).vessels[OWN].plant
                          for chart in (None, shoal(1.3 * T, 300.0), shoal(1.3 * T, 9e3)))  # fmt: skip
    assert shallow["per_depth"] == pytest.approx(1.0 / (1.3 * T))
    assert far["per_depth"] == 0.0
    assert far["x"] == free["x"]
    assert shallow["u"] < free["u"] - 0.02, "shallow water takes speed"
    assert shallow["x"] > 300.0


@pytest.mark.slow
def test_little_water_and_grounding_are_announced_once(compiled: Compiled) -> None:
    (said,) = events(sailed(compiled, shoal(1.1 * T, 200.0), 60.0))
    assert said.endswith("m under the keel by the chart")
    assert float(said.split()[0]) == pytest.approx(0.1 * T, rel=0.05)
    (said,) = events(sailed(compiled, shoal(0.9 * T, 200.0), 60.0))
    assert said.startswith("aground by the chart")
    assert events(sailed(compiled, shoal(2.0 * T, 200.0), 60.0)) == []


def test_the_page_has_place_and_depth(compiled: Compiled) -> None:
    plant = sailed(compiled, None, 1.0).vessels[OWN].plant
    seen: dict[str, Any] = Situation(HERE, 0.0, Shown(shoal(30.0, -100.0))).frame(plant)
    assert seen["depth"] == pytest.approx(30.0)
    latitude, longitude = seen["place"]
    assert latitude > HERE.latitude
    assert longitude == pytest.approx(HERE.longitude, abs=1e-6)
    assert Situation().frame(plant) == {"place": None, "depth": None}
    assert Situation(HERE, 0.0).meta == dict(dated(0.0, HERE))
