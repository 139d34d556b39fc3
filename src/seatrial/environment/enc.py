"""Cells of S-57 (`.000`) as charts, read by GDAL (extra `enc`).

Depth areas have their least depth, DRVAL1, and what dries or is land 0, so that a ship never feels more water than is
charted; outside the cell there is none.  Depths are above chart datum: the tide is not in them.  A danger without a
depth lies at the surface, unless EXPSOU says that it is no shallower than the area around (S-52 takes it for dangerous
too).  IHO S-57 edition 3.1, appendix A: object classes and attributes.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import ChartError, first_line
from ..core.values import dataclass
from ..data import DataError
from ..data.geodesy import Datum
from .chart import Area, Chart, Lane, Points, Spot

DEPTHS, SOLID = ("DEPARE", "DRGARE", "UNSARE"), ("LNDARE", "FLODOC", "HULKES", "PONTON", "SLCONS")
DANGERS = ("OBSTRN", "WRECKS", "UWTROC")
"""Object classes of S-57 that a keel may strike: obstructions, wrecks, rocks."""
MARKS = ("BOYLAT", "BOYCAR", "BOYISD", "BOYSAW", "BOYSPP", "BCNLAT", "BCNCAR", "BCNISD", "BCNSAW", "BCNSPP")
"""Object classes of S-57 of buoys and beacons."""
LANES, TRACKS = ("TSSLPT", "FAIRWY"), ("RECTRC", "NAVLNE")

# EXPSOU: within the range of depth of the area around, or deeper.
_NO_SHALLOWER = (1.0, 3.0)
_METRES, _FARTHEST = 1.0, 200e3
# Longest side that is straight enough [deg], 500 m of a meridian.
_STRAIGHT = 0.0045


def is_cell(path: Path) -> bool:
    """Whether a file is a base cell of S-57, by its name."""
    return path.suffix == ".000"


# Kinds of geometry in the binary form of OGC 06-103r4, as GDAL hands them out; collections are above.
_POINT, _LINE, _POLYGON = 1, 2, 3
_WITH_Z = 0x80000000



@dataclass(frozen=True, eq=False)
class Shape:
    """A simple geometry.

    Attributes:
        kind: 1 a point, 2 a line, 3 a polygon.
        rings: points as [longitude, latitude(, depth)]: one array, or the border and the holes of a polygon.
    """

    kind: int
    rings: tuple[Points, ...]


@dataclass(frozen=True, eq=False)
class _Feature:
    """One object: its geometry in metres north and east, and its attributes."""

    shape: Shape
    said: Mapping[str, Any]

    def number(self, name: str) -> float:
        """An attribute as a number; NaN where it is not told."""
        value = self.said.get(name)
        try:
            return math.nan if value is None or value == "" else float(value)
        except (TypeError, ValueError):
            return math.nan


def read_cell(path: str | Path, datum: Datum | None = None) -> tuple[Chart, Datum]:
    """A cell as a chart, with its updates where they lie beside it, and the datum of its metres.

    Args:
        path: of the base cell, `.000`.
        datum: where x and y are zero; by default the middle of the cell.

    Raises:
        ChartError: the extra is missing; no cell, another unit of depth, or no depth areas; a cell far from the datum.
    """
    path = Path(path)
    read = _reader(path)
    layers = _layers(path)
    _metres(path, read("DSID"))
    raw = {name: list(read(name)) for name in (*DEPTHS, *SOLID, *DANGERS, *MARKS, *LANES, *TRACKS, "DEPCNT",
                                                     "COALNE") if name in layers}  # fmt: skip
    if not any(raw.get(name) for name in ("DEPARE", "DRGARE")):
        raise ChartError(f"{path}: no depth areas (DEPARE, DRGARE); a ship needs a cell that has depths")
    here = datum or _middle(path, raw)
    found = {name: [_placed(one, here) for one in some] for name, some in raw.items()}
    areas = _areas(found)
    if not any(float(np.abs(area.outline).min(axis=0).max()) < _FARTHEST for area in areas):
        raise ChartError(f"{path}: no water within {_FARTHEST / 1000.0:.0f} km of {here.latitude:g}, "
                         f"{here.longitude:g}; another cell, or another place")  # fmt: skip
    dangers, unknown = _dangers(found, areas)
    lanes = tuple(Lane(one.shape.rings[0], math.radians(one.number("ORIENT")), name)
                  for name in LANES for one in found.get(name, ()) if one.shape.kind == _POLYGON)  # fmt: skip
    marks = tuple(Spot(float(one.shape.rings[0][0, 0]), float(one.shape.rings[0][0, 1]), name)
                  for name in MARKS for one in found.get(name, ()) if one.shape.kind == _POINT)  # fmt: skip
    tracks = tuple(one.shape.rings[0] for name in TRACKS for one in found.get(name, ()) if one.shape.kind == _LINE)
    chart = Chart(path.stem, 0.0, areas, fairways=tracks, source=f"S-57 cell {path.name}", contours=_contours(found),
                  dangers=dangers, marks=marks, lanes=lanes, lacks=_lacks(layers, found, unknown))  # fmt: skip
    return chart, here


def _reader(path: Path) -> Callable[[str], Iterator[_Feature]]:
    try:
        from pyogrio import raw as gdal
    except ImportError:
        raise ChartError(f'{path}: reading S-57 needs pyogrio; pip install "seatrial[enc]"') from None

    def read(layer: str) -> Iterator[_Feature]:
        meta, _fids, places, columns = gdal.read(path, layer=layer)
        names = [str(name) for name in meta["fields"]]
        count = len(columns[0]) if columns else 0
        for k in range(count):
            said = {name: column[k] for name, column in zip(names, columns, strict=True)}
            for shape in shapes(places[k]) if places is not None else (Shape(0, ()),):
                yield _Feature(shape, said)

    return read


def _layers(path: Path) -> frozenset[str]:
    from pyogrio import list_layers
    from pyogrio.errors import DataSourceError

    if not path.is_file():
        raise ChartError(f"{path}: no such file")
    try:
        found = frozenset(str(row[0]) for row in list_layers(path))
    except DataSourceError as error:
        raise ChartError(f"{path}: no cell of S-57 that GDAL can read: {first_line(error)}") from None
    if "DSID" not in found:
        raise ChartError(f"{path}: no cell of S-57; it has no record DSID")
    return found


def _metres(path: Path, heads: Iterator[_Feature]) -> None:
    """Refuse depths in other units than metres."""
    unit = next((one.number("DSPM_DUNI") for one in heads), math.nan)
    if unit != _METRES:
        raise ChartError(f"{path}: unit of depth {unit:g} (DUNI); 1, metres, is read")


def _middle(path: Path, raw: Mapping[str, list[_Feature]]) -> Datum:
    """The middle of all depth areas."""
    rings = [one.shape.rings[0][:, :2] for name in DEPTHS for one in raw.get(name, ()) if one.shape.kind == _POLYGON]
    low, high = np.min([r.min(axis=0) for r in rings], axis=0), np.max([r.max(axis=0) for r in rings], axis=0)
    try:
        return Datum(float(0.5 * (low[1] + high[1])), float(0.5 * (low[0] + high[0])))
    except DataError as error:
        raise ChartError(f"{path}: {error}") from None


def _placed(one: _Feature, datum: Datum) -> _Feature:
    """A feature in metres."""
    rings = (_finer(ring[:, :2]) for ring in one.shape.rings)
    placed = tuple(np.column_stack(datum.track(ring[:, 1], ring[:, 0])) for ring in rings)
    return _Feature(Shape(one.shape.kind, placed), one.said)


def _finer(line: Points) -> Points:
    """A line with points between where its sides are long: a side along a parallel is no straight line in metres.

    With sides of 500 m its greatest distance from one, side^2 tan(latitude) / (8 R), is a centimetre at 60 degrees.
    """
    count = np.ceil(np.abs(np.diff(line, axis=0)).max(axis=1, initial=0.0) / _STRAIGHT).clip(1.0).astype(int)
    k = np.repeat(np.arange(len(count)), count)
    share = (np.arange(len(k)) - np.repeat(np.cumsum(count) - count, count)) / count[k]
    return np.concatenate([line[k] + share[:, None] * (line[k + 1] - line[k]), line[-1:]])


def _areas(found: Mapping[str, list[_Feature]]) -> tuple[Area, ...]:
    """Water first, then what stands in it, dangers with an extent last."""
    areas: list[Area] = []
    for name in (*DEPTHS, *SOLID, *DANGERS):
        for one in found.get(name, ()):
            if one.shape.kind == _POLYGON:
                known = {"DEPARE": "DRVAL1", "DRGARE": "DRVAL1"}.get(name, "VALSOU" if name in DANGERS else "")
                depth = one.number(known) if known else 0.0
                if name in DANGERS and math.isnan(depth) and one.number("EXPSOU") in _NO_SHALLOWER:
                    continue  # as deep as the area around it
                areas.append(Area(one.shape.rings[0], max(depth, 0.0) if depth == depth else 0.0, one.shape.rings[1:]))
    return tuple(areas)


def _dangers(found: Mapping[str, list[_Feature]], areas: tuple[Area, ...]) -> tuple[tuple[Spot, ...], int]:
    """Dangers at points and along lines, and how many of all have no depth."""
    spots: list[Spot] = []
    water = Chart("", areas=areas)
    unknown = 0
    for name in DANGERS:
        for one in found.get(name, ()):
            depth = one.number("VALSOU")
            unknown += math.isnan(depth)
            if one.shape.kind == _POLYGON:
                continue
            ring = one.shape.rings[0]
            if math.isnan(depth) and one.number("EXPSOU") in _NO_SHALLOWER:
                depth = float(water.depth_at(ring[:1, 0], ring[:1, 1])[0])
            depth = max(depth, 0.0) if depth == depth else 0.0
            spots += [Spot(float(x), float(y), name, depth) for x, y in ring[:, :2]]
    return tuple(spots), unknown


def _contours(found: Mapping[str, list[_Feature]]) -> tuple[tuple[Points, float], ...]:
    lines = [(one.shape.rings[0], one.number("VALDCO")) for one in found.get("DEPCNT", ()) if one.shape.kind == _LINE]
    coasts = [(one.shape.rings[0], 0.0) for one in found.get("COALNE", ()) if one.shape.kind == _LINE]
    return (*lines, *coasts)


def _lacks(layers: frozenset[str], found: Mapping[str, list[_Feature]], unknown: int) -> tuple[str, ...]:
    """What the cell does not tell."""
    said = [f"no {what} ({name})" for name, what in (
        ("LNDARE", "land"), ("DEPCNT", "depth contours"), ("SOUNDG", "soundings"), ("M_QUAL", "quality of the survey"),
    ) if name not in layers]  # fmt: skip
    some = [*found.get("DEPARE", ()), *found.get("DRGARE", ())]
    bare = sum(math.isnan(one.number("DRVAL1")) for one in some)
    if bare:
        said.append(f"{bare} of {len(some)} depth areas have no least depth (DRVAL1) and count as dry")
    if found.get("UNSARE"):
        said.append(f"{len(found['UNSARE'])} unsurveyed areas (UNSARE) count as dry")
    if unknown:
        count = sum(len(found.get(name, ())) for name in DANGERS)
        said.append(f"{unknown} of {count} dangers have no depth (VALSOU); they count as at the surface, but for those "
                    "that EXPSOU says are no shallower than the water around")  # fmt: skip
    return (*said, "depths are above chart datum, without the tide; outside the cell there is no water")


def shapes(raw: bytes | None) -> tuple[Shape, ...]:
    """The simple geometries of one, which may be a collection; none of a feature without place."""
    return tuple(_shapes(_Reader(raw))) if raw else ()


class _Reader:
    """Bytes with a place in them."""

    def __init__(self, raw: bytes) -> None:
        self.raw, self.at, self.order = raw, 0, "<"

    def head(self) -> tuple[int, int]:
        """Kind, and numbers of a point."""
        self.order = "<" if self.raw[self.at] else ">"
        self.at += 1
        code = self.count()
        kind = code & 0x0FFFFFFF
        deep = bool(code & _WITH_Z) or kind // 1000 in (1, 3)
        return kind % 1000, 3 if deep else 2

    def count(self) -> int:
        (value,) = struct.unpack_from(f"{self.order}I", self.raw, self.at)
        self.at += 4
        return int(value)

    def points(self, count: int, size: int) -> Points:
        found = np.frombuffer(self.raw, f"{self.order}f8", count * size, self.at).reshape(count, size)
        self.at += 8 * count * size
        return found.astype(np.float64)


def _shapes(reader: _Reader) -> Iterator[Shape]:
    kind, size = reader.head()
    if kind == _POINT:
        yield Shape(kind, (reader.points(1, size),))
    elif kind == _LINE:
        yield Shape(kind, (reader.points(reader.count(), size),))
    elif kind == _POLYGON:
        yield Shape(kind, tuple(reader.points(reader.count(), size) for _ in range(reader.count())))
    else:
        for _ in range(reader.count()):
            yield from _shapes(reader)
