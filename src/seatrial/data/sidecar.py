"""The YAML sidecar of a trial file: description of the recording.

Every key has a fixed meaning and is checked, because a typing error (`L_ppp`) would silently disable a check;
free text goes under `notes`, which is kept as it is.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from datetime import datetime
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar, cast

import numpy as np

from ..core.parameters import unknown
from ..core.values import dataclass, fields
from . import DataError
from .documents import read_keys, read_yaml, yaml_text
from .geodesy import Datum
from .table import within

SCHEMA = "manoeuvre-trial/1"
"""What the sidecar of a trial says of itself."""

CONVENTIONS: Mapping[str, str] = MappingProxyType(
    {"reference_point": "midship", "frame": "NED", "delta_positive": "starboard_turn"}
)
"""Conventions of every `Trial`, and the defaults of a sidecar."""


UNPLACED = "x, y are those of the antenna; midship is taken to be there"
"""Step of the processing of a trial whose antenna stands nobody knows where."""


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is(kind: type) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, kind)


def _texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(one, str) for one in cast("list[Any]", value))


def _named(kind: type) -> Callable[[Any], bool]:
    """Whether a value has texts by name, or numbers above zero by name."""

    def fits(value: Any) -> bool:
        if not isinstance(value, Mapping):
            return False
        held = cast("Mapping[Any, Any]", value).values()
        return all(isinstance(one, str) if kind is str else _number(one) and one > 0 for one in held)

    return fits


_RANGES: Mapping[str, tuple[float, float, str]] = MappingProxyType({
    "scale": (0.01, 10_000.0, "ship over model"), "L_pp": (0.1, 600.0, "m"), "draught": (1e-3, 40.0, "m"),
    "water_density": (900.0, 1100.0, "kg/m^3"),
})  # fmt: skip
_TYPES: tuple[tuple[str, Callable[[Any], bool], str], ...] = (
    *((key, _is(str), "text") for key in ("ship", "kind", "source", "licence", "start", "epoch_utc")),
    ("processing", _texts, "a list of texts, one a step"), ("held", _texts, "a list of texts, one a channel"),
    ("missing", _texts, "a list of texts, one a quantity"),
    *((key, _is(Mapping), "keys with values") for key in ("datum", "frames", "lines", "set_points", "setpoints")),
    *((key, _is(Mapping), "names with what is said of each") for key in ("sources", "ignored")),
    ("derived", _named(str), "channels with what each is made of"),
    ("noise", _named(float), "channels with a standard deviation above zero each"),
    ("restart", _number, "a number"),
)  # fmt: skip
KEYS = ("schema", *CONVENTIONS, *_RANGES, *(key for key, _, _ in _TYPES), "notes")
"""Keys of a sidecar."""

# A set point beyond these is in degrees without a unit [rad].
_LARGEST = MappingProxyType({"delta": math.pi, "rudder": math.pi, "psi": 2.0 * math.pi, "heading": 2.0 * math.pi})
_POINT = re.compile(r"(delta|rudder|psi|heading)(?:\s*\[(.*)\])?")


@dataclass(frozen=True, kw_only=True)
class Described:
    """Keys of the sidecar that a mapping file may give for all of its trials."""

    ship: str | None = None
    scale: float | None = None
    L_pp: float | None = None
    draught: float | None = None
    kind: str | None = None
    source: str | None = None
    licence: str | None = None
    water_density: float | None = None

    @property
    def meta(self) -> dict[str, Any]:
        """The keys that are given, with their values."""
        given = {one.name: getattr(self, one.name) for one in fields(Described)}
        return {key: value for key, value in given.items() if value is not None}


D = TypeVar("D", bound=Described)


def read_described(path: Path, kind: type[D], schema: str) -> D:
    """A mapping file, the keys that it shares with sidecars checked as there; see `documents.read_keys`."""
    found = read_keys(path, kind, schema)
    check_meta(path, found.meta)
    return found


def sidecar_path(path: Path) -> Path:
    """Where the sidecar of a trial file is."""
    return path.with_suffix(".yaml")


def read_sidecar(path: Path) -> dict[str, Any]:
    """Contents of the sidecar of the trial file `path`, over the conventions; these alone without one.

    Raises:
        DataError: not YAML, not a mapping, another schema, or an impossible value.
    """
    return {**CONVENTIONS, **(said_by(path) if sidecar_path(path).exists() else {})}


def said_by(path: Path) -> dict[str, Any]:
    """Contents of the sidecar of the trial file `path` itself, without its schema.

    Raises:
        DataError: as `read_sidecar`, and without a sidecar.
    """
    where = sidecar_path(path)
    meta = read_yaml(where)
    schema = meta.pop("schema", None)
    if schema != SCHEMA:
        raise DataError(f"{where}: schema is {schema!r}; this version reads '{SCHEMA}'")
    check_meta(where, meta)
    return meta


def sidecar_text(path: Path, meta: Mapping[str, Any]) -> str:
    """The sidecar of `path` as YAML text, schema and conventions included."""
    plain = plain_meta(path, meta)
    check_meta(sidecar_path(path), plain)
    return yaml_text({"schema": SCHEMA, **plain})


def began(name: object, meta: Mapping[str, Any]) -> int:
    """Start of a trial's time since 1970 [ns], from its `start`; 0 without one.

    Raises:
        DataError: an invalid start, or one without a time zone; the text begins with `name`.
    """
    start = meta.get("start", meta.get("epoch_utc"))  # key of older imports of NMEA logs
    if not isinstance(start, str | datetime):
        return 0
    try:
        when = start if isinstance(start, datetime) else datetime.fromisoformat(start)
        if when.tzinfo is None:
            raise DataError(f"{name}: start is '{start}', without a time zone; write 2024-05-01T12:00:00+00:00")
        ticks = int(when.replace(microsecond=0).timestamp()) * 10**9 + when.microsecond * 1000
        if not 0 <= ticks < 2**63:
            raise DataError(f"{name}: start is '{start}'; stamps of nanoseconds go from 1970 to 2262")
        return ticks
    except DataError:
        raise
    except (ValueError, OverflowError):
        raise DataError(f"{name}: start is '{start}'; write 2024-05-01T12:00:00+00:00") from None


def check_meta(where: Path, meta: Mapping[str, Any]) -> None:
    """Check the keys and values of a sidecar.

    Raises:
        DataError: an unknown key (the near ones are named), a wrong type, a number outside its range.
    """
    for key in meta:
        if key not in KEYS:
            raise DataError(f"{where}: {unknown(key, KEYS, 'key')}; free text goes under 'notes'")
    for key, (low, high, unit) in _RANGES.items():
        if meta.get(key) is not None and not (_number(meta[key]) and low <= meta[key] <= high):
            raise DataError(f"{where}: {key} is {meta[key]!r}; it must be a number from {low:g} to {high:g} ({unit})")
    for key, fits, wanted in _TYPES:
        if meta.get(key) is not None and not fits(meta[key]):
            raise DataError(f"{where}: {key} is {meta[key]!r:.60}; {key} must be {wanted}")
    allowed = {**{k: (v,) for k, v in CONVENTIONS.items()}, "delta_positive": ("starboard_turn", "port_turn")}
    for key, fine in allowed.items():
        if meta.get(key, fine[0]) not in fine:
            raise DataError(
                f"{where}: {key} is {meta[key]!r}; a trial file has {' or '.join(fine)}: "
                "convert the log with 'seatrial import'"
            )
    _check_place(where, meta)
    _check_points(where, meta.get("set_points") or meta.get("setpoints") or {})


def _check_place(where: Path, meta: Mapping[str, Any]) -> None:
    """Check `start`, with its time zone, and `datum`."""
    began(where, meta)
    try:
        if meta.get("datum") is not None:
            with within(where):
                Datum(*(float(meta["datum"][key]) for key in ("latitude", "longitude")))
    except DataError:
        raise
    except (KeyError, TypeError, ValueError):
        raise DataError(f"{where}: datum needs latitude and longitude, in degrees") from None


def _check_points(where: Path, points: Mapping[Any, Any]) -> None:
    for key, value in points.items():
        found = _POINT.fullmatch(str(key))
        if found is None:
            continue
        name, unit = found[1], found[2] or "rad"
        if unit not in ("rad", "deg"):
            raise DataError(f"{where}: set_points: {key}: no unit of an angle; write '{name} [deg]' or '{name} [rad]'")
        if not _number(value) or not abs(value) <= (_LARGEST[name] if unit == "rad" else math.degrees(_LARGEST[name])):
            raise DataError(
                f"{where}: set_points: {key} is {value!r} {unit}; it must be a number up to {_LARGEST[name]:.3g} rad, "
                f"and in degrees it is called '{name} [deg]'"
            )


def plain_meta(path: Path, meta: Mapping[str, Any]) -> dict[str, Any]:
    """Contents for the sidecar of `path`, in types that YAML has, conventions included."""
    return {key: _plain(path, key, value) for key, value in {**CONVENTIONS, **meta}.items()}


def _plain(path: Path, key: str, value: Any) -> Any:
    """The same value in types that YAML has."""
    if isinstance(value, np.generic | np.ndarray):
        return cast("Any", value).tolist()
    if isinstance(value, Mapping):
        return {str(k): _plain(path, f"{key}.{k}", v) for k, v in cast("Mapping[Any, Any]", value).items()}
    if isinstance(value, list | tuple):
        return [_plain(path, key, v) for v in cast("list[Any]", value)]
    if value is None or isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, Path):
        return str(value)
    raise DataError(f"{path}: meta '{key}' is a {type(value).__name__}; give text, numbers or lists")
