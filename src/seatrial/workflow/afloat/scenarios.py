"""Scenarios from their files, checked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

from ...core.constants import GRAVITY
from ...core.parameters import unknown
from ...core.records import document_of, filled, of_schema
from ...core.symbolic import Scalar
from ...data.geodesy import Datum
from ...encounters.conduct import CONDUCTS
from ...environment import CALM, Uniform
from ...environment.chart import Chart, ChartError
from ...environment.weather import Gust
from ...models import unit
from ...realtime.bridge.situation import read_chart
from ...realtime.bridge.view import OWN
from ...realtime.helm import obeying
from ...realtime.range.faults import INSTRUMENTS
from ...realtime.range.scenario import Criteria, Fault, Limits, Other, Own, Sailing, Scenario, Weather, ordinary
from ...realtime.range.schema import (
    SCHEMA,
    CriteriaTable,
    FaultTable,
    SailingTable,
    ScenarioFile,
    TrafficTable,
    WeatherTable,
)
from ...ships import Ship
from .. import RequestError
from ..asked import Around, InWaves
from ..request import DEGREE, Note, grounds_of, ship_of, silent, speed_of, surroundings
from ..seaway import Seaway, bound_for
from .machinery import aboard_of

# So far from its origin a plane is no map of the sea any more [m].
_FARTHEST = 1e6
_CHANNELS = {"wind": ("wind_x", "wind_y"), "current": ("current_x", "current_y"),
             "waves": ("wave_x", "wave_y", "wave_T"), "depth": ("per_depth",)}  # fmt: skip


def read_scenario(path: Path, own: Ship | None = None, seed: int | None = None) -> Scenario:
    """A scenario from its file; `own` takes the place of its own ship, `seed` of its seed.

    Raises:
        RequestError: what is wrong in the file, and at which key.
    """
    return scenario_of(document_of(path), path, own, seed)


def scenario_of(
    document: dict[str, Any], path: Path, own: Ship | None = None, seed: int | None = None
) -> Scenario:
    """A scenario from the contents of its file; `path` is for messages, and ship files are looked for beside it.

    `own` takes the place of its own ship, `seed` of its seed.

    Raises:
        RequestError: what is wrong in the file, and at which key.
    """
    table = filled(ScenarioFile, of_schema(document, SCHEMA, path), path)
    table = table if seed is None else replace(table, seed=seed)
    try:
        played = _scenario(table, path, own or _ship(path, table.own.ship))
        tested = None if own is not None else grounds_of(_place(path, table.own.ship), silent)
        return replace(played, own=replace(played.own, grounds=tested))
    except ValueError as error:
        about = str(error)
        raise RequestError(about if about.startswith(str(path)) else f"{path}: {about}") from None


def _scenario(table: ScenarioFile, path: Path, own: Ship) -> Scenario:
    chart, datum = _chart(table, path, _datum(table))
    if table.gusts is not None:
        Gust(Uniform(), table.gusts)
    if OWN in table.traffic:
        raise RequestError(f"traffic.{OWN}: is the own ship; choose another name")
    _check_times(table)
    start = table.start if table.start.tzinfo is not None else table.start.replace(tzinfo=UTC)
    rao = _beside(path, table.rao)
    waves = InWaves(_beside(path, table.sea), None if rao is None else Path(rao), table.roll_damping)
    seaway = bound_for(own, waves, table.seed, Around(), silent)
    return Scenario(
        table.title or path.stem, table.duration,
        Own(own, _sailing("own", table.own, own, datum), table.own.instruments == "usual",
            table.own.pilot == "track", table.own.antenna),
        tuple(_other(path, name, one, datum) for name, one in table.traffic.items()),
        table.rate, table.seed, datum, start.timestamp(),
        None if table.variation is None else table.variation * DEGREE, table.gusts,
        _weather(own, table.weather, seaway), tuple(_fault(k, one, own) for k, one in enumerate(table.faults, 1)),
        _criteria(table.criteria, chart),
        Limits(table.alarms.cpa, table.alarms.tcpa, table.alarms.cross_track, table.alarms.rudder * DEGREE,
               _charted("alarms", table.alarms.under_keel, chart)),
        chart, seaway.sea, seaway.rao, table.sensors, aboard_of(table, path, own),
    )  # fmt: skip


def _check_times(table: ScenarioFile) -> None:
    """Refuse what would begin when the run is over, and so never happen."""
    begins = {f"weather {k}: begins": one.at for k, one in enumerate(table.weather, 1)}
    begins |= {f"faults {k}: begins": one.at for k, one in enumerate(table.faults, 1) if one.at is not None}
    if table.criteria.heading_error is not None:
        begins["criteria.settle: the heading counts"] = table.criteria.settle
    for what, at in begins.items():
        if at >= table.duration:
            raise RequestError(f"{what} at {at:g} s; the run ends at {table.duration:g} s")


def _charted(table: str, under_keel: float | None, chart: Chart | None) -> float | None:
    """The least water under the keel, which a chart alone tells."""
    if under_keel is not None and chart is None:
        raise RequestError(f"{table}.under_keel: there is no chart to tell the depth; give chart = a chart file")
    return under_keel


def _chart(table: ScenarioFile, path: Path, datum: Datum | None) -> tuple[Chart | None, Datum | None]:
    """The chart, of the library or a file beside the scenario, and where x and y are zero."""
    if table.chart is None:
        return None, datum
    beside = path.parent / table.chart
    try:
        shown, here = read_chart(beside if beside.suffix and beside.exists() else table.chart, datum)
    except ChartError as error:
        raise RequestError(f"chart: {error}") from None
    if shown.chart is None:
        raise RequestError(f"chart: {table.chart}: a coast to look at; a scenario takes a seatrial-chart/1")
    return shown.chart, here


def _ship(path: Path, name: str) -> Ship:
    return ship_of(_place(path, name))


def _place(path: Path, name: str) -> str | Path:
    beside = path.parent / name
    return beside if name.endswith(".toml") and beside.exists() else name


def _datum(table: ScenarioFile) -> Datum | None:
    """Where x and y are zero: `place`, or where the own ship begins by latitude and longitude."""
    if table.place is not None:
        return Datum(*table.place)
    at = table.own.at
    return Datum(*_degrees("own.at", cast("dict[str, Any]", at))) if isinstance(at, dict) else None


def _degrees(key: str, given: dict[str, Any]) -> tuple[float, float]:
    for name in given:
        if name not in ("lat", "lon"):
            raise RequestError(f"{key}: {unknown(str(name), ('lat', 'lon'), 'key')}")
    found = [given.get(name) for name in ("lat", "lon")]
    for name, value, most in zip(("lat", "lon"), found, (89.0, 180.0), strict=True):
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= most:
            raise RequestError(f"{key}: {name} is {value!r}; it is a number of degrees, -{most:g} to {most:g}")
    latitude, longitude = (float(cast("float", value)) for value in found)
    return latitude, longitude


def _point(key: str, given: Any, datum: Datum | None) -> tuple[float, float]:
    """A point [m]."""
    if given is None:
        return 0.0, 0.0
    if isinstance(given, dict):
        if datum is None:
            raise RequestError(f"{key}: is a latitude and longitude; give place = [LAT, LON], where x and y are zero")
        there = datum.north_east(*_degrees(key, cast("dict[str, Any]", given)))
        if not math.hypot(*there) <= _FARTHEST:
            told = f"{math.hypot(*there) / 1e3:.0f} km from where x and y are zero"
            raise RequestError(f"{key}: is {told}; a scenario reaches {_FARTHEST / 1e3:g} km")
        return there
    found = cast("Sequence[Any]", given if isinstance(given, list | tuple) else ())
    if len(found) == 2 and all(isinstance(one, int | float) and not isinstance(one, bool) for one in found):
        north, east = (float(one) for one in found)
        if math.isfinite(north) and math.isfinite(east) and math.hypot(north, east) <= _FARTHEST:
            return north, east
    raise RequestError(f"{key}: is {given!r}; write [NORTH, EAST] in metres, or {{ lat = DEG, lon = DEG }}")


def _sailing(key: str, table: SailingTable, ship: Ship, datum: Datum | None) -> Sailing:
    x, y = _point(f"{key}.at", table.at, datum)
    route = [_point(f"{key}.route {k}", one, datum) for k, one in enumerate(table.route, 1)]
    for k, (a, b) in enumerate(pairwise([(x, y), *route]), 1):
        if math.dist(a, b) < 1.0:
            raise RequestError(f"{key}.route {k}: is at the point before it; leave it out")
    heading = 0.0 if table.heading is None else table.heading * DEGREE
    if table.heading is None and route:
        heading = math.atan2(route[0][1] - y, route[0][0] - x)
    speed = speed_of(ship, table.speed, f"{key}.speed")
    return Sailing(x, y, heading, speed, tuple(route), table.mmsi or 0, table.type, table.status)


def _other(path: Path, name: str, table: TrafficTable, datum: Datum | None) -> Other:
    key = f"traffic.{name}"
    if (table.ship is None) == (table.length is None):
        raise RequestError(f"{key}: give a ship, or the length of one that steers as most do")
    if table.ship is not None:
        ship = _ship(path, table.ship)
    elif table.speed:
        length = cast("float", table.length)
        if table.speed > math.sqrt(GRAVITY * length):
            raise RequestError(f"{key}.speed is {table.speed:g} m/s; no ship of {length:g} m goes that fast")
        ship = ordinary(name, length, table.speed)
    else:
        raise RequestError(f"{key}: a ship of a length alone needs a speed above zero")
    if table.conduct is not None and table.conduct not in CONDUCTS:
        raise RequestError(f"{key}.conduct: {unknown(table.conduct, CONDUCTS, 'conduct')}")
    if table.conduct is not None and table.route:
        raise RequestError(f"{key}: a ship of a conduct goes on with its heading; leave out its route, or conduct")
    return Other(name, ship, _sailing(key, table, ship, datum), table.ais, table.radar, table.conduct)


def _beside(path: Path, name: str | None) -> str | None:
    """A file of the name beside the scenario, or the name itself."""
    there = None if name is None else path.parent / name
    return str(there) if there is not None and there.is_file() else name


def _weather(own: Ship, tables: Sequence[WeatherTable], seaway: Seaway) -> tuple[Weather, ...]:
    """The weather by time, in which a sea gives the waves of the mean drift from the start on."""
    now, end = CALM._replace(**channels_of(own, seaway.around)), 0.0
    found = [Weather(0.0, 0.0, now)] if now != CALM else list[Weather]()
    for k, one in enumerate(tables, 1):
        key = f"weather {k}"
        if one.at < end:
            raise RequestError(f"{key}: begins at {one.at:g} s, before the one before it is reached at {end:g} s")
        if one.waves is not None and seaway.sea is not None:
            raise RequestError(f"{key}.waves: the sea gives the mean drift already; leave one of waves and sea out")
        given = {name: value for name, value in vars(one).items() if name in _CHANNELS and value is not None}
        try:
            now = now._replace(**channels_of(own, Around(**given)))
        except ValueError as error:
            raise RequestError(f"{key}: {error}") from None
        found.append(Weather(one.at, one.over, now))
        end = one.at + one.over
    return tuple(found)


def channels_of(ship: Ship, around: Around, note: Note = silent) -> dict[str, Scalar]:
    """Channels of the environment that are told here, without gusts.

    Raises:
        RequestError: as of `surroundings`.
    """
    weather = surroundings(ship, around, note=note).weather
    now = cast("Uniform", weather.base if isinstance(weather, Gust) else weather).now()._asdict()
    return {c: now[c] for name, some in _CHANNELS.items() if getattr(around, name) is not None for c in some}


def _fault(k: int, table: FaultTable, own: Ship) -> Fault:
    key, gear = f"faults {k}", obeying(own)
    of_gear = table.kind in ("jammed", "slow", "lost")
    known = tuple(gear) if of_gear else tuple(INSTRUMENTS)
    if table.of not in known:
        what = "control" if of_gear else "instrument"
        raise RequestError(f"{key}: {table.kind} of {unknown(table.of, known, what)}")
    fault = Fault(table.kind, table.of, table.at, table.lasts, label=table.label or f"{table.of} {table.kind}")
    if table.kind in ("jump", "drift"):
        names = INSTRUMENTS[table.of]
        for name in table.by:
            if name not in names:
                raise RequestError(f"{key}: by: {unknown(name, names, 'value')}")
        if not table.by:
            raise RequestError(f"{key}: a {table.kind} needs by = {{ {next(iter(names))} = ... }}")
        return replace(fault, by={names[name][0]: value * names[name][1] for name, value in table.by.items()})
    if table.by:
        raise RequestError(f"{key}: by is of jump and drift; {table.kind} has none")
    if (table.rate is None) == (table.kind == "slow"):
        raise RequestError(f"{key}: slow gear needs its rate, and no other fault has one")
    turning = unit(gear[table.of][0][0]) == "rad" if of_gear else False
    scale = DEGREE if turning else 1.0
    return fault if table.rate is None else replace(fault, rate=table.rate * scale)


def _criteria(table: CriteriaTable, chart: Chart | None) -> Criteria:
    error = None if table.heading_error is None else table.heading_error * DEGREE
    keel = _charted("criteria", table.under_keel, chart)
    return Criteria(table.passing_distance, table.cross_track, error, table.time, table.settle, keel,
                    table.rules)  # fmt: skip
