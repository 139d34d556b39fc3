"""Where on earth the ship is, when, over what depth, and the chart that the user brings; for the page."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from ...core.errors import ChartError
from ...core.values import dataclass, field
from ...data import DataError
from ...data.documents import read_json
from ...data.geodesy import Datum
from ...environment.chart import Chart, Points
from ...environment.enc import is_cell, read_cell
from ...environment.geojson import load_chart
from ...sensors.suite import draught
from ..plant import Plant
from ..recording import dated

_FARTHEST = 300e3
"""A line of a coast is drawn that comes nearer to the datum than this [m]."""

Lines = tuple[Points, ...]


@dataclass(frozen=True)
class Shown:
    """A chart as it is drawn, in metres north and east of the ship's datum.

    Attributes:
        chart: depths, banks, quays and fairways; None of a plain coast.
        land: outlines that are filled.
        coasts: lines.
    """

    chart: Chart | None = None
    land: Lines = ()
    coasts: Lines = ()

    def json(self) -> dict[str, Any]:
        """What the page draws."""
        chart = self.chart or Chart("")
        return {
            "land": [_rounded(line) for line in self.land],
            "coasts": [_rounded(line) for line in (*self.coasts, *(line for line, _ in chart.contours))],
            "areas": [[_rounded(area.outline), area.depth, [_rounded(hole) for hole in area.holes]]
                      for area in chart.areas],
            "spots": [[round(one.x, 2), round(one.y, 2), one.depth if one.depth == one.depth else None]
                      for one in (*chart.dangers, *chart.marks)],
            "banks": [_rounded(bank.line) for bank in chart.banks],
            "quays": [_rounded(quay.line) for quay in chart.quays],
            "fairways": [_rounded(line) for line in chart.fairways],
        }  # fmt: skip

    def depth(self, x: float, y: float) -> float:
        """Depth on the chart at a place [m]; infinite where it has none."""
        return math.inf if self.chart is None else float(self.chart.depth_at(np.array([x]), np.array([y]))[0])


@dataclass(frozen=True)
class Situation:
    """Place, time and chart of a bridge.

    Attributes:
        datum: where x and y are zero; None: nowhere on earth.
        epoch: seconds since 1970, UTC, at t = 0; None: at no date.
        shown: the chart.
    """

    datum: Datum | None = None
    epoch: float | None = None
    shown: Shown = field(default_factory=Shown)

    @property
    def meta(self) -> dict[str, Any]:
        """Sidecar entries of a recording that begins at t = 0."""
        return dict(dated(0.0 if self.epoch is None else self.epoch, self.datum))

    def hello(self, plant: Plant) -> dict[str, Any]:
        """Constant data."""
        return {"epoch": self.epoch, "draught": draught(plant.ship), "chart": self.shown.json()}

    def frame(self, plant: Plant) -> dict[str, Any]:
        """Latitude and longitude of midship [deg], and the depth of the water there [m]; None where unknown.

        The depth is that which the ship feels; that of the chart where it feels deep water.
        """
        x, y, felt = plant["x"], plant["y"], plant["per_depth"]
        if not math.isfinite(x + y):
            return {"place": None, "depth": None}
        depth = 1.0 / felt if felt > 0.0 else self.shown.depth(x, y)
        place = None if self.datum is None else [round(value, 7) for value in self.datum.place(x, y)]
        return {"place": place, "depth": round(depth, 2) if math.isfinite(depth) else None}


def read_chart(path: str | Path, datum: Datum | None) -> tuple[Shown, Datum | None]:
    """A chart of the library by name, a `seatrial-chart/1`, a cell of S-57, or any GeoJSON in longitude and latitude.

    Of the latter, polygons are land and lines are coasts.

    Args:
        datum: where the ship's x and y are zero; None: that of the chart, if it has one, or the middle of a cell.

    Returns:
        The chart, and the datum of the ship.

    Raises:
        ChartError: a file that is no chart, or is not where the ship is.
    """
    if not Path(path).suffix and len(Path(path).parts) == 1:
        return Shown(load_chart(path)), datum
    if is_cell(Path(path)):
        cell, here = read_cell(path, datum)
        return Shown(cell), here
    try:
        said = read_json(Path(path))
    except DataError as error:
        raise ChartError(str(error)) from None
    if "schema" not in said:
        return _coast(Path(path), said, datum), datum
    chart = load_chart(Path(path))
    own = said.get("datum") if said.get("frame") == "latlon" else None
    if own is None:
        return Shown(chart), datum
    there = Datum(own["latitude"], own["longitude"])
    return Shown(chart if datum in (None, there) else _moved(chart, there, datum)), datum or there


def _moved(chart: Chart, there: Datum, here: Datum) -> Chart:
    """A chart about another datum."""

    def moved(line: Points) -> Points:
        places = np.array([there.place(float(x), float(y)) for x, y in line])
        return np.column_stack(here.track(places[:, 0], places[:, 1]))

    def all_moved(things: tuple[Any, ...], name: str) -> tuple[Any, ...]:
        return tuple(type(one)(**{**vars(one), name: moved(getattr(one, name))}) for one in things)

    return Chart(chart.name, chart.depth, all_moved(chart.areas, "outline"), all_moved(chart.banks, "line"),
                 all_moved(chart.quays, "line"), tuple(map(moved, chart.fairways)), chart.source)  # fmt: skip


def _coast(path: Path, said: Mapping[str, Any], datum: Datum | None) -> Shown:
    """Polygons and lines of a plain GeoJSON."""
    if datum is None:
        raise ChartError(f"{path}: points in longitude and latitude; say with --place where the ship is")
    land: list[Points] = []
    coasts: list[Points] = []
    features = said.get("features", [said]) if said.get("type") in ("FeatureCollection", "Feature") else None
    if not isinstance(features, list):
        raise ChartError(f"{path}: no FeatureCollection of GeoJSON")
    for number, feature in enumerate(cast("list[Any]", features), 1):
        try:
            geometry = feature["geometry"]
            kind, rings = geometry["type"], geometry["coordinates"]
            if kind in ("Polygon", "MultiPolygon"):
                for polygon in [rings] if kind == "Polygon" else rings:
                    land.append(_line(polygon[0], datum))
            elif kind in ("LineString", "MultiLineString"):
                coasts += [_line(line, datum) for line in ([rings] if kind == "LineString" else rings)]
        except (TypeError, KeyError, IndexError, ValueError):
            raise ChartError(f"{path}: feature {number}: no geometry of [longitude, latitude]") from None
    land, coasts = ([line for line in lines if _off(line) < _FARTHEST] for lines in (land, coasts))
    if not (land or coasts):
        raise ChartError(f"{path}: no land or coast within {_FARTHEST / 1000.0:.0f} km of "
                         f"{datum.latitude:g}, {datum.longitude:g}; points are [longitude, latitude]")  # fmt: skip
    return Shown(None, tuple(land), tuple(coasts))


def _off(line: Points) -> float:
    """Distance of a line from the datum [m]; its sides may be long, so not that of its points."""
    start, along = line[:-1], np.diff(line, axis=0)
    share = -(start * along).sum(axis=1) / np.maximum((along * along).sum(axis=1), 1e-9)
    return float(np.hypot(*(start + np.clip(share, 0.0, 1.0)[:, None] * along).T).min())


def _line(points: Any, datum: Datum) -> Points:
    pairs = np.array([point[:2] for point in points], dtype=np.float64)
    if pairs.ndim != 2 or len(pairs) < 2 or not np.isfinite(pairs).all() or (np.abs(pairs[:, 1]) > 90.0).any():
        raise ValueError("no line")
    return np.column_stack(datum.track(pairs[:, 1], pairs[:, 0]))


def _rounded(line: Points) -> list[list[float]]:
    return np.round(line, 2).tolist()
