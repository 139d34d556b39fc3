"""What a case is set in: the encounters of its file with an axis of runs, and the waters around them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...core.errors import ChartError, RequestError, ShipError
from ...data import Array
from ...encounters.area import encounters, reports
from ...encounters.meeting import IMAZU_T, Meeting, Ranges, dnv, drawn, imazu, role
from ...encounters.rules import Limits, Waters
from ...encounters.sailing import paced
from ...environment.geojson import load_chart
from ...environment.grid import SMOOTH
from ...forces.shallow import SHALLOWEST
from ...sensors.suite import draught
from ...ships import Ship
from ...ships.felt import feels
from ...simulate.approach import approach
from ...simulate.place import Place, place_of
from .claimed import CaseFile, Where


def meeting_of(file: CaseFile, ship: Ship, folder: Path) -> Meeting:
    """The encounters of a case, with an axis of runs."""
    said, speed = file.encounters, approach(ship)[0]
    if (said.file is None) == (said.set == "ais"):
        raise RequestError("encounters.file: a table of AIS is what set = \"ais\" has, and no other set")
    if said.file is not None:
        return encounters(reports(folder / said.file), speed)
    if said.set == "drawn":
        if not said.roles:
            raise RequestError("encounters.roles: name one at least, such as \"give-way\"")
        met = drawn([role(name) for name in said.roles], said.runs, speed, file.seed, ranges_of(file, ship))
        return replace(met, U=np.full(said.runs, speed))
    if said.set == "given":
        if not said.ships:
            raise RequestError("encounters.ships: give one at least, with x, y, psi, U and conduct")
        conducts_of(file)
        return Meeting(np.array([speed]), *(np.array([[float(getattr(one, name)) for one in said.ships]])
                                            for name in ("x", "y", "psi", "U")))  # fmt: skip
    some = imazu(speed, paced(ship.L_pp, IMAZU_T)) if said.set == "imazu" else dnv(speed)
    ships = max(len(one.x) for one in some)
    return alike(some, ships)


def waters_of(file: CaseFile, ship: Ship, folder: Path) -> Waters:
    """Where a case is."""
    said, sight = file.waters, file.waters.visibility or math.inf
    if said.chart is None:
        if said != Where(visibility=said.visibility):
            raise RequestError("waters: a place, a draught or a safety depth is of a chart; give chart too")
        return Waters(visibility=sight, U=approach(ship)[0])
    beside = folder / said.chart
    try:
        chart = load_chart(beside if beside.suffix and beside.exists() else said.chart)
        return Waters(chart, said.draught or draught(ship), said.safety, sight, approach(ship)[0])
    except ChartError as error:
        raise RequestError(f"waters.chart: {error}") from None


def place_in(waters: Waters, ship: Ship) -> Place | None:
    """Where the ship feels depth and banks of a chart; None where its model knows none, or the chart is too wide.

    It never feels less than `SHALLOWEST` draughts: beyond that no model holds, and the ground is judged by the chart.
    """
    if waters.chart is None or not feels(ship, "per_depth"):
        return None
    try:
        place = place_of(ship, waters.chart, touching=False)
    except (ChartError, ShipError):
        return None
    if (grid := place.grid) is None:
        return None
    table, depth = grid.field.table.copy(), SMOOTH.index("chart.per_depth")
    table[..., depth] = np.minimum(table[..., depth], 1.0 / (SHALLOWEST * float(ship.model.draught)))
    return replace(place, grid=replace(grid, field=replace(grid.field, table=table)))


def ranges_of(file: CaseFile, ship: Ship) -> Ranges:
    """From where encounters are drawn; they begin farther apart than ships may pass."""
    (low, high), longest = Ranges().T, max(ship.L_pp, file.encounters.length or 0.0)
    apart = float(Limits().passing.of(np.array(longest)))
    return Ranges((paced(ship.L_pp, low), paced(ship.L_pp, high)), apart=apart)


def conducts_of(file: CaseFile) -> list[int]:
    """Numbers of the conducts of the ships given, in `traffic`."""
    for one in file.encounters.ships:
        if one.conduct not in file.traffic:
            raise RequestError(f"encounters.ships: conduct '{one.conduct}' is not in traffic")
    return [file.traffic.index(one.conduct) for one in file.encounters.ships]


def alike(some: Sequence[Meeting], ships: int) -> Meeting:
    """Meetings of as many ships each: those that have fewer have more that sail away, far astern."""
    U = float(np.ravel(some[0].U)[0])
    added: Array = np.tile([[-1e6], [0.0], [math.pi], [U]], ships)
    added[0] -= 1e4 * np.arange(ships)  # apart from each other

    def whole(values: Array, far: Array) -> Array:
        return np.concatenate([values, far[len(values) :]])

    rows = [np.stack([whole(getattr(one, name), far) for one in some])
            for name, far in zip(("x", "y", "psi", "U_target"), added, strict=True)]  # fmt: skip
    return Meeting(np.full(len(some), U), *rows)
