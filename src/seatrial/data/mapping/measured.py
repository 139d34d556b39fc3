"""What instruments of one file measure, in SI and by the names of a trial, before it is brought to midship.

Latitude and longitude are here in degrees, and north and east [m/s] are the parts of a speed over ground.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping as Named
from types import MappingProxyType

import numpy as np

from .. import Array, DataError, unwrapped
from ..geodesy import of_utm, zone_of
from ..units import conversion
from .angles import LATITUDE, LONGITUDE, degrees, parted, with_minutes
from .numbers import lettered, numbers
from .schema import Apparent, Channel, Ground, Heading, Log, Position, Sensor
from .tables import Table

_MOST: Named[str, float] = MappingProxyType({
    "psi": 1e4, "r": 2.0 * math.pi, "delta": math.pi, "u": 60.0, "v_m": 60.0, "U_G": 60.0, "U_C": 15.0, "U_T": 120.0,
    "U_A": 150.0, "n_P": 300.0, "phi": math.pi,
})  # fmt: skip
"""Largest magnitudes of channels in SI that a ship or a model can have."""

_HEADED = ("psi", "gamma_T", "gamma_A", "gamma_G")


def measured(table: Table, place: str, sensor: Sensor) -> dict[str, Array]:
    """The channels of an instrument, each of shape (rows,).

    Args:
        table: its file.
        place: its key in the mapping, such as `channels.psi`.
        sensor: the instrument.

    Raises:
        DataError: a cell that is not what the mapping says, naming file, column and row.
    """
    if isinstance(sensor, Channel):
        name = place.partition(".")[2]
        table.agree(sensor.column, sensor.unit, sensor.despite, channel=True)
        return {name: _channel(table, name, sensor)}
    if isinstance(sensor, Position):
        return _of_grid(table, sensor) if sensor.format == "utm" else _placed(table, sensor)
    if isinstance(sensor, Ground):
        return _ground(table, sensor)
    if isinstance(sensor, Log):
        found = {"u_w": _speed(table, sensor.speed, "u", sensor)}
        return (
            found if sensor.course is None else {**found, "gamma_w": _turned(table, sensor.course, sensor.course_unit)}
        )
    if isinstance(sensor, Apparent):
        direction = Channel(sensor.direction, sensor.direction_unit, sensor.offset, sensor.sign, letters=sensor.letters,
                            letter=sensor.letter)  # fmt: skip
        turned = math.pi if sensor.towards else 0.0
        return {
            "U_A": _speed(table, sensor.speed, "U_A", sensor),
            "gamma_A": _channel(table, "gamma_A", direction) + turned,
        }
    if isinstance(sensor, Heading):
        return {"psi": _of_quaternion(table, sensor)}
    raise DataError(f"{place}: no instrument of this kind")


def _placed(table: Table, place: Position) -> dict[str, Array]:
    latitude, longitude = place.latitude, place.longitude
    if latitude == longitude:
        table, latitude, longitude = parted(table, latitude, place.first)
    columns = (
        (LATITUDE, latitude, place.latitude_letter, place.latitude_minutes),
        (LONGITUDE, longitude, place.longitude_letter, place.longitude_minutes),
    )
    for _, column, _, _ in columns:
        table.agree(column, "rad" if place.format == "rad" else "deg")
    found = {
        kind[0]: with_minutes(table, degrees(table, column, letter, place.format, kind), minutes)
        for kind, column, letter, minutes in columns
    }
    known = [np.isfinite(one) for one in found.values()]
    if known[0].any() and known[1].any() and not (known[0] & known[1]).any():
        raise DataError(f"{table.at(latitude, int(np.flatnonzero(known[0])[0]))}: no row has a {' and a '.join(found)} "
                        "too; write both in one row")  # fmt: skip
    return found


def _of_grid(table: Table, place: Position) -> dict[str, Array]:
    """Latitude and longitude by northings and eastings of a zone of UTM."""
    both: list[Array] = []
    zone, south = zone_of(str(place.zone))
    for column, name, least, most in (
        (place.latitude, "northing", 0.0, 1e7),
        (place.longitude, "easting", 1e5, 9e5),
    ):
        table.agree(column, "m")
        values = numbers(table, column)
        wrong = np.flatnonzero((values < least) | (values > most))
        if wrong.size:
            about = f"{values[wrong[0]]:.9g} is no {name} of {least:g} to {most:g} m; are the two columns exchanged?"
            raise DataError(f"{table.at(column, int(wrong[0]))}: {about}")
        both.append(values)
    latitude, longitude = of_utm(both[0], both[1], zone, south)
    return {"latitude": latitude, "longitude": longitude}


def _channel(table: Table, name: str, column: Channel) -> Array:
    raw = (
        lettered(table, column.column, column.letters, column.letter)
        if column.letters
        else numbers(table, column.column)
    )
    table.agree(column.column, column.unit, column.despite)
    factor = conversion(name, column.unit)[1]
    found = raw * (column.sign * column.scale * factor) + column.offset * factor
    _refuse_impossible(table, name, column, raw, found)
    return found


def _refuse_impossible(table: Table, name: str, column: Channel, raw: Array, found: Array) -> None:
    """Refuse values that no ship has: the unit is another."""
    stem = re.sub(r"(_\d+|_cmd|_sd)+$", "", name)
    over = np.flatnonzero(np.abs(found) > _MOST.get(stem, math.inf))
    if not over.size and name in _HEADED and conversion(name, column.unit)[1] == 1.0:
        # a heading in degrees that wraps leaps by a whole turn of 360
        over = np.flatnonzero(np.abs(np.abs(np.diff(found)) - 360.0) < 20.0) + 1
    if over.size:
        row = int(over[0])
        about = f"{raw[row]:.6g} {column.unit} is no value of {name}; is the column in another unit?"
        raise DataError(f"{table.at(column.column, row)}: {about}")


def _speed(table: Table, column: str, name: str, one: Ground | Log | Apparent) -> Array:
    table.agree(column, one.unit, one.despite, channel=True)
    return _channel(table, name, Channel(column, one.unit, despite=one.despite))


def _turned(table: Table, column: str, unit: str) -> Array:
    return unwrapped(_channel(table, "gamma_G", Channel(column, unit)))


def _ground(table: Table, ground: Ground) -> dict[str, Array]:
    if ground.north is not None and ground.east is not None:
        return {"north": _speed(table, ground.north, "u", ground),
                "east": _speed(table, ground.east, "u", ground)}  # fmt: skip
    speed = _speed(table, str(ground.speed), "U_G", ground)
    course = _turned(table, str(ground.course), ground.course_unit)
    return {"U_G": speed, "gamma_G": course, "north": speed * np.cos(course), "east": speed * np.sin(course)}


def _of_quaternion(table: Table, heading: Heading) -> Array:
    x, y, z, w = (numbers(table, column) for column in heading.quaternion)
    size = x * x + y * y + z * z + w * w
    wrong = np.flatnonzero(np.abs(size - 1.0) > 0.01)
    if wrong.size:
        row = int(wrong[0])
        about = f"a quaternion of size {math.sqrt(size[row]):.4g}; it must be 1: are its columns x, y, z, w?"
        raise DataError(f"{table.at(heading.quaternion[0], row)}: {about}")
    yaw = np.arctan2(2.0 * (w * z + x * y), size - 2.0 * (y * y + z * z))
    psi = yaw if heading.frame == "ned" else 0.5 * math.pi - yaw
    return unwrapped(psi + math.radians(heading.offset))
