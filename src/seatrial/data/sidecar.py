"""The YAML sidecar of a trial file: what a table of numbers cannot say of itself.

Keys with a fixed meaning are checked; every other key is kept as it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, cast

import numpy as np

from . import DataError

SCHEMA = "manoeuvre-trial/1"

CONVENTIONS: Mapping[str, str] = MappingProxyType({
    "reference_point": "midship",
    "frame": "NED",
    "delta_positive": "starboard_turn",
})  # fmt: skip
"""What holds where a sidecar is silent, and in every `Trial`."""

_POSITIVE = ("scale", "L_pp", "water_density")
_TEXT = ("ship", "kind", "source", "licence")


def sidecar_path(path: Path) -> Path:
    """Where the sidecar of a trial file is."""
    return path.with_suffix(".yaml")


def read_sidecar(path: Path) -> dict[str, Any]:
    """What the sidecar of the trial file `path` says, over the conventions; these alone without one.

    Raises:
        DataError: not YAML, not a mapping, another schema, or a key whose value cannot be.
    """
    import yaml

    where = sidecar_path(path)
    if not where.exists():
        return dict(CONVENTIONS)
    try:
        said = yaml.safe_load(where.read_text(encoding="utf-8"))
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise DataError(f"{where}: line {line}: not YAML ({error.problem})") from None
    except (yaml.YAMLError, UnicodeDecodeError, OSError) as error:
        raise DataError(f"{where}: not readable ({str(error).splitlines()[0]})") from None
    if not isinstance(said, dict):
        raise DataError(f"{where}: must be keys with values, such as 'schema: {SCHEMA}'")
    meta = {str(key): value for key, value in cast("dict[Any, Any]", said).items()}
    schema = meta.pop("schema", None)
    if schema != SCHEMA:
        raise DataError(f"{where}: schema is {schema!r}; this version reads '{SCHEMA}'")
    _check(where, meta)
    return {**CONVENTIONS, **meta}


def sidecar_text(path: Path, meta: Mapping[str, Any]) -> str:
    """The sidecar of `path` as YAML text, schema and conventions included."""
    import yaml

    plain = {key: _plain(path, key, value) for key, value in {**CONVENTIONS, **meta}.items()}
    _check(sidecar_path(path), plain)
    return yaml.safe_dump({"schema": SCHEMA, **plain}, sort_keys=False, allow_unicode=True, width=100)


def _check(where: Path, meta: Mapping[str, Any]) -> None:
    for key in _POSITIVE:
        value = meta.get(key)
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if value is not None and not (number and math.isfinite(value) and value > 0):
            raise DataError(f"{where}: {key} is {value!r}; it must be a number above zero")
    for key in _TEXT:
        if not isinstance(meta.get(key), str | None):
            raise DataError(f"{where}: {key} is {meta[key]!r}; it must be text")
    steps = meta.get("processing", [])
    if not (isinstance(steps, list) and all(isinstance(s, str) for s in cast("list[Any]", steps))):
        raise DataError(f"{where}: processing must be a list of texts, one a step")
    allowed = {**{k: (v,) for k, v in CONVENTIONS.items()}, "delta_positive": ("starboard_turn", "port_turn")}
    for key, fine in allowed.items():
        if meta.get(key, fine[0]) not in fine:
            raise DataError(
                f"{where}: {key} is {meta[key]!r}; a trial file has {' or '.join(fine)}: "
                "convert the log with 'seatrial import'"
            )


def _plain(path: Path, key: str, value: Any) -> Any:
    """The same value in types that YAML has."""
    if isinstance(value, np.generic | np.ndarray):
        return cast("Any", value).tolist()
    if isinstance(value, Mapping):
        items = cast("Mapping[Any, Any]", value).items()
        return {str(k): _plain(path, f"{key}.{k}", v) for k, v in items}
    if isinstance(value, list | tuple):
        return [_plain(path, key, v) for v in cast("list[Any]", value)]
    if value is None or isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, Path):
        return str(value)
    raise DataError(f"{path}: meta '{key}' is a {type(value).__name__}; give text, numbers or lists")
