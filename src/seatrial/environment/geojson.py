"""Charts in GeoJSON: `seatrial-chart/1`.

A FeatureCollection with `schema`, and at its top `frame` ("metres", with points [east, north] as GeoJSON has them, or
"latlon", with points [longitude, latitude] and a `datum`), `depth` [m] and `source`.  The `kind` of a feature is one of
`KINDS`; each has the properties that stand there and no others.  docs/harbour.md has an example.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, cast

import numpy as np

from ..core.parameters import unknown
from ..data import DataError
from ..data.documents import read_json
from ..data.geodesy import Datum
from .chart import Area, Bank, Chart, ChartError, Points, Quay
from .enc import is_cell, read_cell
from .fenders import CURVES, Curve, Fender

SCHEMA = "seatrial-chart/1"
FOLDER = Path(__file__).parent / "charts"
"""Charts of the package."""

KINDS: Mapping[str, tuple[str, tuple[str, ...]]] = MappingProxyType({
    "depth": ("Polygon", ("depth",)),
    "bank": ("LineString", ("slope",)),
    "quay": ("LineString", ("fender", "closed", "bollards")),
    "fairway": ("LineString", ()),
})  # fmt: skip
"""Kinds of features: geometry, and properties besides `kind` and `name`."""

_TOP = ("type", "schema", "name", "frame", "datum", "depth", "source", "features")
_FENDER = ("curve", "height", "reaction", "spacing", "mu", "chi")
_CURVE = ("deflections", "reactions", "rated")
# A point of a harbour is not farther from its datum [m].
_FARTHEST = 200e3


def library() -> tuple[str, ...]:
    """Names of the charts that come with the package."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.geojson")))


def load_chart(name_or_path: str | Path) -> Chart:
    """A chart of the library by name, of a file, or of a cell of S-57 (.000), about its middle.

    Raises:
        ChartError: no such chart; a key, a point or a number that cannot be, in one line.
    """
    path = Path(name_or_path)
    if is_cell(path):
        return read_cell(path)[0]
    if isinstance(name_or_path, str) and not path.suffix and len(path.parts) == 1:
        if name_or_path not in library():
            raise ChartError(unknown(name_or_path, library(), "chart"))
        path = FOLDER / f"{name_or_path}.geojson"
    try:
        return _Reading(path, read_json(path)).chart()
    except DataError as error:
        raise ChartError(str(error)) from None


class _Reading:
    """One pass over a chart; `at` says where, for messages."""

    def __init__(self, path: Path, said: Mapping[str, Any]) -> None:
        self.path, self.said, self.at = path, said, str(path)
        self.keys(said, _TOP, "key")
        if said.get("schema") != SCHEMA or said.get("type") != "FeatureCollection":
            raise ChartError(f'{path}: a chart is a FeatureCollection with "schema": "{SCHEMA}"')
        frame = said.get("frame")
        if frame not in ("metres", "latlon"):
            raise ChartError(f'{path}: frame is {frame!r}; it is "metres" or "latlon"')
        self.datum = self._datum() if frame == "latlon" else None

    def chart(self) -> Chart:
        features = self.said.get("features")
        found: dict[str, list[Any]] = {kind: [] for kind in KINDS}
        if not isinstance(features, list):
            raise ChartError(f"{self.path}: features is missing; it is a list")
        for k, feature in enumerate(cast("list[Any]", features), 1):
            self.at = f"{self.path}: feature {k}"
            kind, thing = self._feature(feature)
            found[kind].append(thing)
        self.at = str(self.path)
        depth, name = self.number(self.said, "depth", math.inf), str(self.said.get("name") or self.path.stem)
        if not depth > 0.0:
            raise ChartError(f"{self.path}: a depth of {depth:g} m; depths are positive down, in m")
        try:
            return Chart(
                name, depth, tuple(found["depth"]), tuple(found["bank"]),
                tuple(found["quay"]), tuple(found["fairway"]), str(self.said.get("source", "")),
            )  # fmt: skip
        except ChartError as error:
            raise ChartError(f"{self.path}: {str(error).removeprefix(f'{name}: ')}") from None

    def keys(self, said: Mapping[str, Any], known: tuple[str, ...], what: str) -> None:
        for key in said:
            if key not in known:
                raise ChartError(f"{self.at}: {unknown(key, known, what)}")

    def number(self, said: Mapping[str, Any], key: str, absent: float | None = None) -> float:
        value = said.get(key, absent)
        if isinstance(value, bool) or not isinstance(value, int | float) or math.isnan(value):
            raise ChartError(f"{self.at}: {key} is {value!r}; it is a number" if key in said
                             else f"{self.at}: {key} is missing")  # fmt: skip
        return float(value)

    def table(self, said: Any, what: str) -> dict[str, Any]:
        if not isinstance(said, dict):
            raise ChartError(f"{self.at}: {what} is {said!r:.40}; it is a table of keys")
        return cast("dict[str, Any]", said)

    def _datum(self) -> Datum:
        said = self.table(self.said.get("datum"), "datum")
        try:
            return Datum(self.number(said, "latitude"), self.number(said, "longitude"))
        except DataError as error:
            raise ChartError(f"{self.path}: {error}") from None

    def _feature(self, feature: Any) -> tuple[str, Any]:
        said = self.table(feature, "feature")
        properties, geometry = (self.table(said.get(key), key) for key in ("properties", "geometry"))
        kind = str(properties.get("kind", ""))
        if kind not in KINDS:
            raise ChartError(f"{self.at}: {unknown(str(kind), KINDS, 'kind')}")
        shape, own = KINDS[kind]
        self.keys(properties, ("kind", "name", *own), "property")
        if geometry.get("type") != shape:
            raise ChartError(f"{self.at}: a {kind} is a {shape}, not {geometry.get('type')!r}")
        rings = geometry.get("coordinates")
        if shape == "Polygon":
            if not isinstance(rings, list) or len(cast("list[Any]", rings)) != 1:
                raise ChartError(f"{self.at}: a depth area is one ring without holes; draw the shallower one later")
            rings = cast("list[Any]", rings)[0]
        points = self._points(rings)
        try:
            return kind, self._thing(kind, points, properties)
        except ChartError as error:
            text = str(error)
            raise ChartError(text if text.startswith(self.at) else f"{self.at}: {text}") from None

    def _thing(self, kind: str, points: Points, properties: Mapping[str, Any]) -> Any:
        if kind == "depth":
            depth = self.number(properties, "depth")
            if not depth > 0.0:
                raise ChartError(f"depth is {depth:g} m; depths are positive down, in m")
            return Area(points, depth)
        if kind == "bank":
            slope = self.number(properties, "slope", math.inf)
            return Bank(points, slope)
        if kind == "fairway":
            return points
        said = properties.get("fender")
        fender = None if said is None else self._fender(self.table(said, "fender"))
        closed = properties.get("closed", True)
        if not isinstance(closed, bool):
            raise ChartError(f"closed is {closed!r}; it is true or false")
        return Quay(points, fender, closed, self.number(properties, "bollards", 0.0))

    def _fender(self, said: Mapping[str, Any]) -> Fender:
        self.keys(said, _FENDER, "key of a fender")
        curve = said.get("curve")
        if isinstance(curve, str):
            if curve not in CURVES:
                raise ChartError(unknown(curve, CURVES, "fender curve"))
            known = CURVES[curve]
        else:
            own = self.table(curve, "curve")
            self.keys(own, _CURVE, "key of a curve")
            lists = [own.get(key) for key in _CURVE[:2]]
            if not all(isinstance(one, list) and all(isinstance(x, int | float) for x in one) for one in lists):
                raise ChartError(
                    "a fender curve has lists of deflections and reactions, as shares of height and rating"
                )
            s, R = (tuple(map(float, cast("list[float]", one))) for one in lists)
            known = Curve(s, R, self.number(own, "rated", s[-1] if s else 1.0))
        numbers = {key: self.number(said, key) for key in ("height", "reaction", "spacing")}
        return Fender(known, **numbers, mu=self.number(said, "mu", 0.2), chi=self.number(said, "chi", 0.0))

    def _points(self, said: Any) -> Points:
        try:
            pairs = np.array([point[:2] for point in said], dtype=np.float64)
        except (TypeError, ValueError, IndexError, KeyError):
            pairs = np.zeros((0, 0))
        if pairs.ndim != 2 or pairs.shape[1] != 2 or len(pairs) < 2 or not np.isfinite(pairs).all():
            raise ChartError(f"{self.at}: coordinates are two points or more, each of two numbers")
        points = pairs[:, ::-1].copy() if self.datum is None else self._placed(pairs)
        far = float(np.abs(points).max())
        if far > _FARTHEST:
            raise ChartError(f"{self.at}: a point {far / 1000.0:.0f} km from the datum; a harbour lies within "
                             f"{_FARTHEST / 1000.0:.0f} km of it")  # fmt: skip
        return points

    def _placed(self, pairs: Points) -> Points:
        """Metres of [longitude, latitude]."""
        here, (lon, lat) = cast("Datum", self.datum), pairs.T
        if (np.abs(lat) > 90.0).any():
            raise ChartError(
                f"{self.at}: latitude {float(lat[np.abs(lat) > 90.0][0]):g}; points are [longitude, latitude]"
            )
        off = np.maximum(np.abs(lat - here.latitude), np.abs(np.remainder(lon - here.longitude + 180.0, 360.0) - 180.0))
        if (off > 5.0).any():
            k = int(np.argmax(off))
            raise ChartError(
                f"{self.at}: point {k + 1} at latitude {lat[k]:g}, longitude {lon[k]:g} is in another part of the "
                f"world than the datum, {here.latitude:g}, {here.longitude:g}; check the hemisphere, and that points "
                "are [longitude, latitude]"
            )
        return np.column_stack(here.track(lat, lon))
