"""What fit.json does not hold of a fit, in fit.npz: residuals, what they say, residual weights, ends of the search.

The arrays are arrays; the rest is one text of JSON, whose records are read back by the types of their fields.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from ..core.files import packed
from ..core.unpacking import unpacked
from ..data import Array
from ..identify import Fit, Loss, StudyError
from ..identify.diagnosis.findings import Diagnosis, Residuals

ARRAYS = "fit.npz"


@dataclass(frozen=True)
class Held:
    """The fields of a `Fit` that are kept here, and the digest of the fit."""

    digest: str
    diagnosis: Diagnosis | None = None
    loss: Loss | None = None
    ends: Array | None = None


def to_bytes(fit: Fit) -> bytes | None:
    """The content of fit.npz; None where there is nothing to keep."""
    if fit.diagnosis is None and fit.loss is None and not fit.ends.size:
        return None
    residuals = dict(fit.diagnosis.residuals) if fit.diagnosis else {}
    said = {"digest": fit.digest, "loss": _json(fit.loss), "trials": {n: list(r.values) for n, r in residuals.items()},
            "diagnosis": _json(replace(fit.diagnosis, residuals={})) if fit.diagnosis else None}  # fmt: skip
    arrays: dict[str, Any] = {"ends": fit.ends, "said": np.array(json.dumps(said))}
    for k, one in enumerate(residuals.values()):
        arrays[f"residuals_{k}"] = np.column_stack([one.t, one.control, *one.values.values()])
    return packed(**arrays)


def read_arrays(path: Path) -> Held:
    """What `to_bytes` has kept.

    Raises:
        StudyError: not such a file, or not as it was written.
    """
    try:
        found = unpacked(path.read_bytes())
        said = json.loads(str(found["said"]))
        told = said["diagnosis"]
        diagnosis = None if told is None else replace(
            _read(Diagnosis, told, "diagnosis"),
            residuals={name: _residuals(found[f"residuals_{k}"], channels)
                       for k, (name, channels) in enumerate(said["trials"].items())},
        )  # fmt: skip
        loss = None if said["loss"] is None else _read(Loss, said["loss"], "loss")
        return Held(str(said["digest"]), diagnosis, loss, np.asarray(found["ends"], dtype=np.float64))
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        why = str(error) or type(error).__name__
        raise StudyError(f"{path}: cannot be read: {why}; delete it, and the fit is read without residuals") from None


def _residuals(table: Array, channels: list[str]) -> Residuals:
    t, control, *rest = table.T
    return Residuals(t, dict(zip(channels, rest, strict=True)), control)


def _json(value: Any) -> Any:
    """A record in the types of JSON; numbers that are not finite stay what they are, as Python reads them back."""
    if is_dataclass(value):
        return {f.name: _json(vars(value)[f.name]) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): _json(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_json(one) for one in value]
    return value.item() if isinstance(value, np.generic) else value


@cache
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)


def _read(kind: Any, value: Any, where: str) -> Any:
    """A value of this type from the types of JSON; ValueError: it is of another."""
    origin, inner = get_origin(kind), get_args(kind)
    if is_dataclass(kind) and isinstance(value, dict):
        return _record(kind, value, where)
    if origin is Mapping and isinstance(value, dict):
        return {key: _read(inner[1], one, f"{where}.{key}") for key, one in value.items()}
    if origin is tuple and isinstance(value, list):
        kinds = inner[:1] * len(value) if inner[-1] is Ellipsis else inner
        return tuple(_read(one, item, where) for one, item in zip(kinds, value, strict=True))
    if type(None) in inner:
        return None if value is None else _read(next(one for one in inner if one is not type(None)), value, where)
    if kind is float and type(value) in (int, float):
        return float(value)
    if kind in (int, str, bool) and type(value) is kind:
        return value
    raise ValueError(f"{where} is {str(value)[:40]}, not {kind}")


def _record(kind: Any, value: dict[str, Any], where: str) -> Any:
    known = {f.name: f for f in fields(kind)}
    strange = [name for name in value if name not in known]
    lacking = [n for n, f in known.items() if n not in value and f.default is MISSING and f.default_factory is MISSING]
    if strange or lacking:
        raise ValueError(f"{where} has no {', '.join(lacking)}" if lacking else f"{where} has {', '.join(strange)}")
    return kind(**{name: _read(_hints(kind)[name], one, f"{where}.{name}") for name, one in value.items()})
