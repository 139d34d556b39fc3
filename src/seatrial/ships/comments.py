"""Comments in the text of a ship file: what each number means, and which further ones its components take."""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterator
from dataclasses import MISSING, fields
from typing import Any

from ..core.parameters import PRIME, Parts, Spec, Terms, specs
from . import Ship
from .actuation import meanings

_WIDTH = 118


def annotated(text: str, ship: Ship) -> str:
    """The text that `to_toml` gives of a ship, with comments; it reads as the same ship."""
    known = {**specs(ship.model), **_servos(ship)}
    known |= {"approach.speed": Spec("m/s", "speed at which manoeuvres begin"),
              "approach.n_P": Spec("1/s", "revolutions that hold it")}  # fmt: skip
    out: list[str] = ["# Tables, types and numbers are explained in docs/types.md and docs/extending.md."]
    table = ""
    for line in text.splitlines():
        if line.startswith("["):
            table = line.strip("[]")
            part = _part(ship.model, table)
            if part is not None:
                out.append(f"# {_first(type(part))}")
        elif not line and table:
            out += _further(ship, table)
        key = line.partition(" = ")[0]
        meaning = known.get(f"{table}.{key}") or known.get(key if table == "model" else "")
        if meaning is not None and " = {" in line:
            beside = f"{line}  # {meaning.about}"
            out += [beside] if len(beside) <= _WIDTH else [f"# {key}: {meaning.about}", line]
        else:
            out.append(line)
    return "\n".join([*out, *([] if table.startswith("notes") else _further(ship, table))]) + "\n"


def _servos(ship: Ship) -> dict[str, Spec]:
    """What the numbers of the actuators mean, by path."""
    return {f"actuators.{name}.{key}": meaning for name, servo in ship.actuators.by_name.items()
            for key, meaning in meanings(type(servo), name).items()}  # fmt: skip


def _part(model: Any, table: str) -> Any:
    """The component of a table; None of the others."""
    if table == "model":
        return model
    name, _, own = table.partition(".")
    part = vars(model).get(name)
    if isinstance(part, Parts):
        return dict(part.items()).get(own)
    return None if own or isinstance(part, Terms) or not hasattr(type(part), "__dataclass_fields__") else part


def _further(ship: Ship, table: str) -> Iterator[str]:
    """The numbers that a component takes and the file leaves at their default, as comments."""
    part = _part(ship.model, table)
    prefix = "" if table == "model" else f"{table}."
    for f in fields(part) if part is not None else ():
        meaning = f.metadata.get("spec")
        if meaning is None or f.default is MISSING or f"{prefix}{f.name}" in ship.entries:
            continue
        if getattr(part, f.name) == f.default and math.isfinite(f.default):
            unit = f', unit = "{meaning.unit}"' if meaning.unit not in ("", "-", PRIME) else ""
            yield f'# {f.name} = {{ value = {float(f.default)!r}{unit}, source = "assumed" }}  # {meaning.about}'


def _first(cls: type) -> str:
    """The first sentence of a class's docstring, in one line."""
    text = inspect.getdoc(cls) or cls.__name__
    line = " ".join(text.partition("\n\n")[0].split())
    return line if len(line) <= _WIDTH else f"{line[: _WIDTH - 4]} ..."
