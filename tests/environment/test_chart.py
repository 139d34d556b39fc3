"""Charts: what a file may hold and what is refused in one line; depth, suction and distance as a ship reads them."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.environment.chart import Area, Bank, Chart, ChartError, Quay, crosses, inside, nearest, spaced
from seatrial.environment.fenders import CURVES, Fender
from seatrial.environment.geojson import library, load_chart
from seatrial.environment.grid import SMOOTH, Size, Stop, between, grid_of, suction

SHIP = Size(320.0, 58.0, 20.8)
FACE = {
    "type": "Feature",
    "properties": {"kind": "quay"},
    "geometry": {"type": "LineString", "coordinates": [[0, 400], [0, 0]]},
}


def document(**changes: Any) -> dict[str, Any]:
    base = {
        "type": "FeatureCollection",
        "schema": "seatrial-chart/1",
        "frame": "metres",
        "depth": 25.0,
        "features": [FACE],
    }
    return base | changes


def feature(kind: str, points: Any, **properties: Any) -> dict[str, Any]:
    polygon = kind == "depth"
    shape = {"type": "Polygon", "coordinates": [points]} if polygon else {"type": "LineString", "coordinates": points}
    return {"type": "Feature", "properties": {"kind": kind, **properties}, "geometry": shape}


def read(folder: Path, said: Any) -> Chart:
    path = folder / "a.geojson"
    path.write_text(json.dumps(said), encoding="utf-8")
    return load_chart(path)


def test_the_charts_of_the_package_are_read() -> None:
    assert set(library()) >= {"tanker_quay", "lock", "canal", "canal_bend"}
    for name in library():
        chart = load_chart(name)
        assert chart.name == name
        assert chart.fairways
        assert chart.source


def test_metres_are_east_then_north_and_the_water_is_to_starboard(tmp_path: Path) -> None:
    chart = read(tmp_path, document())
    assert chart.quays[0].line.tolist() == [[400.0, 0.0], [0.0, 0.0]]
    _, normals = spaced(chart.quays[0].line, 50.0)
    assert normals[0] == pytest.approx([0.0, -1.0])  # drawn southwards, the water is west


def test_degrees_become_metres_about_the_datum(tmp_path: Path) -> None:
    said = document(frame="latlon", datum={"latitude": 51.9, "longitude": 4.1},
                    features=[feature("quay", [[4.1, 51.9], [4.11, 51.9]])])  # fmt: skip
    line = read(tmp_path, said).quays[0].line
    assert line[0] == pytest.approx([0.0, 0.0], abs=1e-6)
    assert line[1, 1] == pytest.approx(6378137.0 * math.radians(0.01) * math.cos(math.radians(51.9)), rel=3e-3)


BAD = {
    "crosses itself": document(features=[feature("quay", [[0, 0], [100, 0], [100, 100], [50, -50]])]),
    "positive down": document(features=[feature("depth", [[0, 0], [9, 0], [9, 9]], depth=-5.0)]),
    "hemisphere": document(frame="latlon", datum={"latitude": 51.9, "longitude": 4.1},
                           features=[feature("quay", [[4.1, -51.9], [4.2, -51.9]])]),
    "longitude, latitude": document(frame="latlon", datum={"latitude": 35.6, "longitude": 139.8},
                                    features=[feature("quay", [[35.6, 139.8], [35.7, 139.8]])]),
    "falls at its end": document(features=[feature("quay", [[0, 0], [9, 0]], fender={
        "curve": {"deflections": [0, 0.5, 1], "reactions": [0, 1, 0.8]}, "height": 1, "reaction": 1e6, "spacing": 9})]),
    "near: height": document(features=[feature("quay", [[0, 0], [9, 0]], fender={
        "curve": "cone", "hieght": 1, "reaction": 1e6, "spacing": 9})]),
    "near: cone": document(features=[feature("quay", [[0, 0], [9, 0]], fender={
        "curve": "coen", "height": 1, "reaction": 1e6, "spacing": 9})]),
    "height is missing": document(features=[feature("quay", [[0, 0], [9, 0]], fender={
        "curve": "cone", "reaction": 1e6, "spacing": 9})]),
    "height is -1": document(features=[feature("quay", [[0, 0], [9, 0]], fender={
        "curve": "cone", "height": -1, "reaction": 1e6, "spacing": 9})]),
    "no kind 'quey'": document(features=[feature("quey", [[0, 0], [9, 0]])]),
    "slope of -1": document(features=[feature("bank", [[0, 0], [9, 0]], slope=-1)]),
    "two points": document(features=[feature("quay", [[0, 0]])]),
    "no two alike": document(features=[feature("quay", [[0, 0], [0, 0]])]),
    "km from the datum": document(features=[feature("quay", [[0, 0], [9e6, 0]])]),
    "frame is 'feet'": document(frame="feet"),
    "with \"schema\"": document(schema="chart"),
    "depth of -25": document(depth=-25.0),
    "is a LineString": document(features=[{**FACE, "geometry": {"type": "Point", "coordinates": [0, 0]}}]),
}  # fmt: skip


@pytest.mark.parametrize("about", list(BAD))
def test_a_chart_that_cannot_be_is_refused_in_one_line(about: str, tmp_path: Path) -> None:
    with pytest.raises(ChartError) as error:
        read(tmp_path, BAD[about])
    assert about in str(error.value)
    assert "a.geojson" in str(error.value)
    assert "\n" not in str(error.value)


def test_what_is_no_chart_is_refused(tmp_path: Path) -> None:
    (tmp_path / "b.geojson").write_text('{"depth": NaN}', encoding="utf-8")
    for name, about in (
        (tmp_path / "b.geojson", "NaN"),
        (tmp_path / "none.geojson", "none.geojson"),
        ("cannal", "near: canal"),
    ):
        with pytest.raises(ChartError, match=about):
            load_chart(name)


def test_geometry() -> None:
    square = np.array([[0.0, 0.0], [0.0, 10.0], [10.0, 10.0], [10.0, 0.0]])
    north, east = np.array([5.0, 15.0, -1.0]), np.array([5.0, 5.0, 5.0])
    assert inside(square, north, east).tolist() == [True, False, False]
    off, x, y = nearest(square[:2], north, east)
    assert off == pytest.approx([5.0, 15.0, 1.0])
    assert (x[0], y[0]) == pytest.approx((-1.0, 0.0))
    assert crosses(np.array([[0.0, 0.0], [10.0, 10.0], [0.0, 10.0], [10.0, 0.0]])) == (1, 3)
    assert crosses(square) is None


def test_the_mirror_ship_has_the_published_numbers() -> None:
    """KVLCC2 at 3 m/s, midship section .998 B d: force towards the wall in kN by distance and depth."""
    known = {0.75: (364, 983, 1226, 1339), 1.0: (211, 710, 886, 968), 1.5: (86, 395, 493, 539),
             2.0: (41, 236, 294, 321),
             3.0: (12, 98, 123, 134)}  # fmt: skip
    scale = 1025.0 * 9.0 * (0.998 * SHIP.B * SHIP.d / SHIP.L) ** 2 / 1e3
    for over, row in known.items():
        for h, force in zip((np.inf, 31.2, 25.0, 22.9), row, strict=True):
            assert scale * suction(np.array(over * SHIP.B), np.array(h), SHIP.L, 100) == pytest.approx(force, abs=0.6)


def test_the_mirror_ship_is_smooth_and_fades() -> None:
    b = np.geomspace(0.02, 200.0, 400)
    assert (np.diff(between(b)) < 0.0).all()
    assert between(np.array([19.999]))[0] == pytest.approx(between(np.array([20.001]))[0], rel=1e-2)
    assert suction(np.array(50.0 * SHIP.L), np.array(25.0), SHIP.L) < 1e-7


@pytest.mark.slow
def test_a_grid_gives_depth_suction_and_the_way_to_the_quay() -> None:
    wall = np.array([[3000.0, 100.0], [-3000.0, 100.0]])
    chart = Chart("a", 25.0, banks=(Bank(np.array([[-3000.0, -200.0], [3000.0, -200.0]]), 0.5),), quays=(Quay(wall),))
    field = grid_of(chart, SHIP).field
    row = dict(zip(SMOOTH, field.look(np.array([0.0]), np.array([0.0]))[0][0], strict=False))
    assert row["chart.per_depth"] == pytest.approx(1.0 / 25.0)
    assert row["chart.quay"] == pytest.approx(100.0, rel=1e-9)
    assert (row["chart.quay_x"], row["chart.quay_y"]) == pytest.approx((0.0, 1.0), abs=1e-9)
    # the slope of 1:2 acts like a wall 25 m nearer
    wanted = suction(np.array(100.0), np.array(25.0), 320.0) - suction(np.array(175.0), np.array(25.0), 320.0)
    assert row["chart.bank_y"] == pytest.approx(float(wanted), rel=1e-2)  # straight lines between nodes
    assert row["chart.bank_x"] == pytest.approx(0.0, abs=1e-9)


def test_depths_by_area_and_slope() -> None:
    """The water is to starboard of a bank: a line southwards has it in the west, and land in the east."""
    chart = Chart("a", 40.0, banks=(Bank(np.array([[100.0, 50.0], [0.0, 50.0], [-100.0, 80.0]]), 0.5),))
    found = chart.depth_at(np.array([50.0, 50.0, 50.0, -1.0]), np.array([40.0, -60.0, 60.0, 52.0]))
    assert found == pytest.approx([5.0, 40.0, 0.0, 0.0])


def test_a_chart_without_banks_is_silent() -> None:
    chart = Chart("a", fairways=(np.array([[0.0, 0.0], [500.0, 0.0]]),))
    values = grid_of(chart, SHIP).field.look(np.array([0.0]), np.array([0.0]))[0][0]
    assert values[:3].tolist() == [0.0, 0.0, 0.0]


@pytest.mark.slow
def test_a_cell_holds_what_the_hull_can_reach() -> None:
    fender = Fender(CURVES["cone"], 1.0, 1e6, 10.0)
    chart = Chart("a", 25.0, quays=(Quay(np.array([[2000.0, 0.0], [0.0, 0.0]]), fender),))
    grid = grid_of(chart, Size(100.0, 20.0, 6.0))
    there = grid.field.look(np.array([1000.0]), np.array([-11.0]))[0][0][len(SMOOTH) :]
    norths = sorted(there[: grid.stops * 6].reshape(-1, 6)[:, 0].tolist())
    wanted = [k for k in range(5, 2000, 10) if abs(k - 1000) < 50]
    assert set(wanted) <= set(norths)
    far, which = grid.field.look(np.array([1000.0]), np.array([-300.0]))
    assert which[0] == 0
    assert not far[0][len(SMOOTH) :].any()
    assert Stop._fields[0] == "north"


@pytest.mark.slow
def test_a_wide_chart_has_wider_cells_and_a_cell_too_fine_is_refused() -> None:
    """A kilometre of water about a model of 7 m; the shore of the shoal is where it was."""
    shoal, model = np.array([[-500.0, -300.0], [-500.0, 900.0], [500.0, 900.0], [500.0, -300.0]]), Size(7.0, 1.16, 0.46)
    chart = Chart("wide", 30.0, areas=(Area(shoal, 0.5),))
    field = grid_of(chart, model).field
    assert 0.25 * model.B < field.cell < 0.25 * model.L
    over = [field.look(np.array([0.0]), np.array([east]))[0][0][0] for east in (898.0, 902.0)]
    assert over == pytest.approx([1.0 / 0.5, 1.0 / 30.0])
    with pytest.raises(ChartError, match=r"wide: 1014 by 1214 m with nodes 0\.3 m apart, 13\.7 million of them"):
        grid_of(chart, model, 0.3)


def test_two_curves_in_one_chart_are_refused() -> None:
    line = np.array([[100.0, 0.0], [0.0, 0.0]])
    quays = tuple(
        Quay(line + 200.0 * k, Fender(CURVES[name], 1.0, 1e6, 10.0)) for k, name in enumerate(("cone", "element"))
    )
    with pytest.raises(ChartError, match="one curve"):
        grid_of(Chart("a", 25.0, quays=quays), SHIP)


@pytest.mark.slow
def test_the_cost_of_a_look_does_not_grow_with_the_chart() -> None:
    """The row that a ship reads is as long with 4 km of fenders as with 1 km."""
    widths: list[int] = []
    for length in (1000.0, 4000.0):
        line = np.array([[length, 0.0], [0.0, 0.0]])
        chart = Chart("a", 25.0, quays=(Quay(line, Fender(CURVES["cone"], 1.0, 1e6, 20.0)),))
        widths.append(len(grid_of(chart, Size(100.0, 20.0, 6.0)).field.near))
    assert widths[0] == widths[1]


def test_the_slopes_of_two_ships_are_the_integral() -> None:
    """J(b) = 1/6 of the integral of (1 - 3t + 2t^3)(t^2 + b^2)^-3/2, and the images in the bottom."""
    x, w = np.polynomial.legendre.leggauss(400)
    t, w = 0.5 * (x + 1.0), 0.5 * w
    for b in (0.2, 1.0, 5.0, 19.0):
        wanted = float((w * (1.0 - 3.0 * t + 2.0 * t**3) * (t * t + b * b) ** -1.5).sum()) / 6.0
        assert between(np.array([b]))[0] == pytest.approx(wanted, rel=1e-4 if b < 10.0 else 0.05, abs=1e-9)
    d, h = 70.0, 25.0
    images = between(np.array([2.0 * math.hypot(d, k * h) / 320.0 for k in range(11)]))
    wanted = 64.0 / math.pi * d / 320.0 * (images[0] + 2.0 * images[1:].sum())
    assert suction(np.array(d), np.array(h), 320.0) == pytest.approx(wanted, rel=1e-12)


def test_a_fender_has_the_friction_of_its_usual_face_and_no_loss_unless_told() -> None:
    plain = Fender(CURVES["linear"], 2.0, 1e6, 20.0)
    assert (plain.mu, plain.chi) == (0.2, 0.0)
    assert CURVES["linear"].stiffest == 1.0
    assert CURVES["cone"].stiffest == pytest.approx(0.17 / 0.01)
    for name, deflection in (("cone", 0.70), ("cone72", 0.72), ("element", 0.575)):
        assert CURVES[name].rated == deflection
