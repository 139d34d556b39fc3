"""A ship as a TOML file that reads back to bit-identical values, sources and provenance kept."""

from __future__ import annotations

import inspect
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from ..core.files import write_whole
from ..core.parameters import PRIME, Parts, Spec, Terms, specs
from ..core.parameters import values as parameters
from ..models.network import Network
from . import Entry, Ship, ShipError
from .actuation import USUAL, listed, meanings
from .networks import USUAL as USUAL_WEIGHTS
from .networks import network_lines, settle, weights_name, write_weights
from .numbers import PARTICULARS, Yardsticks, resolve

OWN = ("published", "unverified")
"""Notes that hold of the numbers of one file alone: no ship made from it, by a fit or by `like`, takes them over."""


def save(
    ship: Ship, path: str | Path, provenance: Mapping[str, Any] | None = None, *, comments: bool = False
) -> Path:  # fmt: skip
    """Write `ship` to `path` in one step: readers see the old file or the whole new one; for editing, with comments.

    The weights of a network go beside it: `weights.npz` for a model.toml, `<stem>.weights.npz` for any other.
    """
    target = Path(path)
    weights = target.with_name(weights_name(target))
    text, network = to_toml(ship, provenance, weights.name), ship.model.learned
    text = annotated(text, ship) if comments else text
    waiting = write_weights(network, weights) if network is not None and network.trained else None
    try:
        write_whole(target, text)
    except BaseException:
        if waiting is not None:
            waiting.unlink(missing_ok=True)
        raise
    if waiting is not None:
        settle(waiting, weights)
    return target


def to_toml(ship: Ship, provenance: Mapping[str, Any] | None = None, weights: str = USUAL_WEIGHTS) -> str:
    """`ship` as the text of a ship file; `provenance` (how it was fitted) goes to [notes.provenance].

    The notes of `OWN` are left out: what is written is a ship of its own, a copy to edit, a fit or another scale.

    Args:
        weights: name of the file of a network's weights.
    """
    lines = [
        'schema = "seatrial-ship/1"',
        f"name = {_text(ship.name)}",
        *([f"of = {_text(ship.of)}"] if ship.of else []),
        f"family = {_text(_type(ship.model, 'models'))}",
    ]
    lines += [*_particulars(ship), *_model(ship, _scale(ship), weights)]
    lines += ["", "[approach]", f"speed = {_number(ship, 'approach.speed', ship.speed, 'm/s', None)}"]
    if ship.n_P is not None:
        lines.append(f"n_P = {_number(ship, 'approach.n_P', ship.n_P, '1/s', None)}")
    lines += _actuators(ship)
    if ship.validity:
        lines += ["", "[validity]"]
        lines += [f"{key} = [{float(a)!r}, {float(b)!r}]" for key, (a, b) in ship.validity.items()]
    notes = {key: value for key, value in ship.notes.items() if key not in OWN}
    notes |= {"provenance": dict(provenance)} if provenance else {}
    text = "\n".join(lines) + "\n"
    if not notes:
        return text
    import tomlkit

    return f"{text}\n{tomlkit.dumps({'notes': _plain(notes)})}"


def _type(thing: Any, room: str) -> str:
    cls = type(thing)
    module: str = cls.__module__
    return f"{module.removeprefix(f'seatrial.{room}.')}:{cls.__qualname__}"


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _scale(ship: Ship) -> Yardsticks:
    body, values = parameters(ship.model), dict[str, float]()
    for key, unit in (("rho", "kg/m^3"), ("L_pp", "m"), ("d", "m")):
        entry = ship.entries.get(f"body.{key}", ship.entries.get(f"particulars.{key}"))
        value = entry and body.get(f"body.{key}", resolve(entry, unit, None))
        if value is not None:
            values[key] = float(value)
    return Yardsticks(**values)


def _number(ship: Ship, path: str, value: float, unit: str, scale: Yardsticks | None) -> str:
    """One inline table: as it was printed where that gives the value, else the value itself."""
    value = float(value)
    if not math.isfinite(value):
        raise ShipError(f"{path} is {value}: a ship file holds finite numbers only")
    entry = ship.entries.get(path) or Entry(source="not given", given=value)
    sigma = "" if entry.sigma is None else f", sigma = {float(entry.sigma)!r}"
    source, inside = entry.source, "" if unit in ("", "-", PRIME) else unit
    if resolve(entry, unit, scale) == value:
        key = "prime" if entry.prime else "value"
        given = f", unit = {_text(entry.unit or inside)}" if entry.unit or (inside and not entry.prime) else ""
        return f"{{ {key} = {entry.given!r}{given}, source = {_text(source)}{sigma} }}"
    if not source.startswith("changed from "):
        printed = f"{entry.given!r}{chr(39) if entry.prime else ''} {entry.unit}".strip()
        source = f"changed from {printed} ({source})"
    given = f", unit = {_text(inside)}" if inside else ""
    return f"{{ value = {value!r}{given}, source = {_text(source)}{sigma} }}"


def _particulars(ship: Ship) -> Iterator[str]:
    given = ship.entries
    known = {key: resolve(given[path], meaning.unit, None) for key, meaning in PARTICULARS.items()
             if (path := f"particulars.{key}") in given}  # fmt: skip
    if not ship.model.takes("body"):
        known["L_pp"] = ship.L_pp
    if known:
        yield from ("", "[particulars]")
    for key, value in known.items():
        if value is not None:
            yield f"{key} = {_number(ship, f'particulars.{key}', value, PARTICULARS[key].unit, None)}"


def _model(ship: Ship, scale: Yardsticks, weights: str) -> Iterator[str]:
    model: Any = ship.model
    own = [f for f in fields(model) if "spec" in f.metadata or "choice" in f.metadata]
    if own:
        yield from ("", "[model]", *_declared(ship, "", model, scale))
    for f in fields(model):
        part = getattr(model, f.name)
        if f in own or part is None:
            continue
        if isinstance(part, Network):
            yield from network_lines(part, weights)
        elif isinstance(part, Terms):
            yield from ("", f"[{f.name}]")
            for name, value in part.items():
                yield f"{name} = {_number(ship, f'{f.name}.{name}', value, f.metadata['terms'](name).unit, scale)}"
        elif isinstance(part, Parts):
            for name, component in part.items():
                yield from _component(ship, f"{f.name}.{name}", component, scale)
        else:
            yield from _component(ship, f.name, part, scale)


def _component(ship: Ship, dotted: str, part: Any, scale: Yardsticks) -> Iterator[str]:
    yield from ("", f"[{dotted}]", f"type = {_text(_type(part, 'forces'))}")
    yield from _declared(ship, f"{dotted}.", part, scale)


def _declared(ship: Ship, prefix: str, thing: Any, scale: Yardsticks) -> Iterator[str]:
    """Choices and numbers of one class, without the numbers that the file did not give and that did not change."""
    yield from (f"{f.name} = {_text(getattr(thing, f.name))}" for f in fields(thing) if "choice" in f.metadata)
    for f in fields(thing):
        value, path = getattr(thing, f.name), prefix + f.name
        if "spec" in f.metadata and (path in ship.entries or f.default is MISSING or value != f.default):
            yield f"{f.name} = {_number(ship, path, value, f.metadata['spec'].unit, scale)}"


def _actuators(ship: Ship) -> Iterator[str]:
    for name, kind, numbers in listed(ship):
        yield from ("", f"[actuators.{name}]")
        if kind != USUAL:
            yield f"type = {_text(kind)}"
        for key, value, unit in numbers:
            yield f"{key} = {_number(ship, f'actuators.{name}.{key}', value, unit, None)}"


def _plain(value: Any) -> Any:
    """What TOML can hold: numbers of any library as Python's, None left out, the rest as text."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items() if v is not None}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value if v is not None]
    if isinstance(value, bool | int | str):
        return value
    return float(value) if hasattr(value, "__float__") else str(value)


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
