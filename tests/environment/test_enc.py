"""Cells of S-57 as charts: depths as GDAL has them, land, dangers, lanes and marks; what a cell lacks is said."""

from __future__ import annotations

import json
import math
import re
import struct
import sys
from pathlib import Path

import numpy as np
import pytest

from s57_cell import Cell
from seatrial.core.errors import ChartError
from seatrial.data.geodesy import Datum
from seatrial.environment.enc import read_cell, shapes
from seatrial.environment.geojson import load_chart
from seatrial.environment.grid import Size, grid_of
from seatrial.realtime.bridge.situation import read_chart

gdal = pytest.importorskip("pyogrio.raw", reason="the extra enc")
Ring = list[tuple[float, float]]


def box(west: float, south: float, east: float, north: float) -> Ring:
    return [(west, south), (west, north), (east, north), (east, south)]


def whole() -> Cell:
    """Two depth areas, an island in one, a basin that dries, what lies and stands in them."""
    cell = Cell()
    cell.area("DEPARE", box(10.0, 50.0, 10.05, 50.05), DRVAL1=10, DRVAL2=20)
    cell.area("DEPARE", box(10.05, 50.0, 10.1, 50.05), box(10.07, 50.02, 10.08, 50.03), DRVAL1=20, DRVAL2=30)
    cell.area("LNDARE", box(10.07, 50.02, 10.08, 50.03))
    cell.area("DEPARE", box(10.0, 50.05, 10.1, 50.06), DRVAL1=-1.5, DRVAL2=0)
    cell.line("DEPCNT", [(10.05, 50.0), (10.05, 50.05)], VALDCO=20)
    cell.line("COALNE", [(10.07, 50.02), (10.07, 50.03), (10.08, 50.03)])
    cell.point("OBSTRN", (10.02, 50.02), VALSOU=3.4, WATLEV=3)
    cell.point("WRECKS", (10.03, 50.02), WATLEV=3)
    cell.point("WRECKS", (10.06, 50.01), WATLEV=3, EXPSOU=1)
    cell.point("BOYLAT", (10.04, 50.01))
    cell.area("TSSLPT", box(10.01, 50.0, 10.02, 50.05), ORIENT=90)
    cell.line("RECTRC", [(10.0, 50.01), (10.1, 50.01)])
    return cell


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return whole().write(tmp_path_factory.mktemp("enc") / "ST4TEST.000")


def gdal_depth(path: Path, lon: float, lat: float) -> float:
    """Least depth of the area that GDAL finds at a point; 0 of land; NaN of no area."""
    for layer in ("LNDARE", "DEPARE"):
        meta, _, _, columns = gdal.read(path, layer=layer, bbox=(lon, lat, lon, lat))
        if len(columns[0]):
            return 0.0 if layer == "LNDARE" else float(columns[list(meta["fields"]).index("DRVAL1")][0])
    return math.nan


@pytest.mark.long
def test_depths_are_those_of_gdal_at_a_thousand_points(path: Path) -> None:
    chart, datum = read_cell(path)
    rng = np.random.default_rng(8)
    lon, lat = rng.uniform(9.99, 10.11, 1000), rng.uniform(49.99, 50.07, 1000)
    found = chart.depth_at(*datum.track(lat, lon))
    expected = [gdal_depth(path, a, b) for a, b in zip(lon, lat, strict=True)]
    known = [0.0 if math.isnan(one) else max(one, 0.0) for one in expected]
    np.testing.assert_array_equal(found, known)
    assert {0.0, 10.0, 20.0} == set(found.tolist())


def test_a_grid_of_a_cell_has_the_depths_of_its_points(path: Path) -> None:
    """Area by area within its own bounds, as point by point over all."""
    chart, _ = read_cell(path)
    low_n, high_n, low_e, high_e = chart.extent
    north, east = np.linspace(low_n - 99, high_n + 99, 83), np.linspace(low_e - 99, high_e + 99, 71)
    N, E = np.meshgrid(north, east, indexing="ij")
    np.testing.assert_array_equal(chart.depth_at(N, E), chart.depth_at(N.ravel(), E.ravel()).reshape(N.shape))


@pytest.mark.slow
def test_a_ship_feels_the_depth_of_the_cell(path: Path) -> None:
    """One over depth at the middle of each area, far from its border."""
    chart, datum = read_cell(path)
    field = grid_of(chart, Size(60.0, 12.0, 4.0)).field
    for lon, lat, depth in ((10.025, 50.03, 10.0), (10.06, 50.035, 20.0), (10.075, 50.025, 0.1)):
        x, y = datum.north_east(lat, lon)
        row, column = round((x - field.north) / field.cell), round((y - field.east) / field.cell)
        assert field.table[row, column, 0] == pytest.approx(1.0 / depth)


def test_dangers_marks_lanes_and_lines(path: Path) -> None:
    chart, datum = read_cell(path)
    obstruction, wreck, deep = chart.dangers
    assert (obstruction.what, obstruction.depth) == ("OBSTRN", 3.4)
    assert (obstruction.x, obstruction.y) == pytest.approx(datum.north_east(50.02, 10.02), abs=0.02)
    assert (wreck.what, wreck.depth) == ("WRECKS", 0.0)  # no depth told: at the surface
    assert deep.depth == 20.0  # EXPSOU: within the range of the water around
    assert [one.what for one in chart.marks] == ["BOYLAT"]
    (lane,) = chart.lanes
    assert (lane.what, lane.alpha) == ("TSSLPT", pytest.approx(math.pi / 2))
    assert [depth for _, depth in chart.contours] == [20.0, 0.0]
    (track,) = chart.fairways
    assert track[-1, 1] - track[0, 1] > 6000.0  # in the direction that it is drawn


def test_what_a_cell_lacks_is_said(path: Path) -> None:
    said = "; ".join(read_cell(path)[0].lacks)
    assert "no soundings (SOUNDG)" in said
    assert "2 of 3 dangers have no depth (VALSOU)" in said
    assert "no land" not in said
    assert "without the tide" in said


def test_unsurveyed_and_unsaid_water_is_dry(tmp_path: Path) -> None:
    cell = Cell()
    cell.area("DEPARE", box(10.0, 50.0, 10.01, 50.01), DRVAL1=5)
    cell.area("DEPARE", box(10.01, 50.0, 10.02, 50.01), DRVAL2=9)
    cell.area("UNSARE", box(10.02, 50.0, 10.03, 50.01))
    chart, datum = read_cell(cell.write(tmp_path / "a.000"))
    x, y = datum.track(np.full(4, 50.005), np.array([10.005, 10.015, 10.025, 10.035]))
    assert chart.depth_at(x, y).tolist() == [5.0, 0.0, 0.0, 0.0]
    assert any("1 of 2 depth areas have no least depth" in one for one in chart.lacks)
    assert any("1 unsurveyed" in one for one in chart.lacks)


@pytest.mark.slow
def test_another_datum_moves_the_chart(path: Path) -> None:
    here = Datum(50.0, 10.0)
    chart, datum = read_cell(path, here)
    assert datum == here
    assert chart.dangers[0].x == pytest.approx(here.north_east(50.02, 10.02)[0], abs=0.02)
    shown, there = read_chart(path, here)
    assert there == here
    drawn = json.loads(json.dumps(shown.json()))
    assert [len(holes) for _, _, holes in drawn["areas"]] == [0, 1, 0, 0]
    assert len(drawn["spots"]) == 4
    assert load_chart(path).name == "ST4TEST"


@pytest.mark.parametrize(("make", "said"), [
    (lambda cell: cell.point("BOYLAT", (10.0, 50.0)), "no depth areas"),
    (lambda cell: (cell.area("DEPARE", box(10.0, 50.0, 10.1, 50.1), DRVAL1=5), setattr(cell, "unit", 2)), "DUNI"),
])  # fmt: skip
def test_cells_that_are_no_chart_are_refused(make, said: str, tmp_path: Path) -> None:
    cell = Cell()
    make(cell)
    with pytest.raises(ChartError, match=said):
        read_cell(cell.write(tmp_path / "a.000"))


def test_files_that_are_no_cell_are_refused(tmp_path: Path, path: Path) -> None:
    with pytest.raises(ChartError, match="no such file"):
        read_cell(tmp_path / "b.000")
    (tmp_path / "c.000").write_bytes(b"no cell at all" * 9)
    with pytest.raises(ChartError, match="no cell of S-57"):
        read_cell(tmp_path / "c.000")
    with pytest.raises(ChartError, match="no water within 200 km of 10, 10"):
        read_cell(path, Datum(10.0, 10.0))


def test_without_the_extra_one_line_names_it(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyogrio", None)
    with pytest.raises(ChartError, match=re.escape('pip install "seatrial[enc]"')):
        read_cell(path)


def test_collections_and_depths_in_binary_form() -> None:
    """A multipoint of two points with depth, big-endian, in the form of ISO (1000 above) and of GDAL (a flag)."""
    for code in (1004, 4 | 0x80000000):
        inner = code - 3
        raw = struct.pack(">BII", 0, code, 2) + b"".join(
            struct.pack(">BIddd", 0, inner, lon, 50.0, 7.0) for lon in (10.0, 11.0)
        )
        one, two = shapes(raw)
        assert one.rings[0].tolist() == [[10.0, 50.0, 7.0]]
        assert two.rings[0].tolist() == [[11.0, 50.0, 7.0]]
    assert shapes(None) == ()
