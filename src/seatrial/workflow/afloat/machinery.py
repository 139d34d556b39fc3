"""FMUs of a scenario, checked: its tables `[[fmu]]`, and a system of the Open Simulation Platform around its ship."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ...core.parameters import unknown
from ...environment import CHANNELS
from ...exchange.fmi.inside import Archive
from ...exchange.fmi.layout import PLACES
from ...exchange.fmi.osp import Structure, read_structure
from ...models import STATES, unit
from ...realtime.machinery import Aboard
from ...realtime.range.schema import FmuTable, ScenarioFile
from ...ships import Ship
from ...ships.classes import trusted
from .. import RequestError

_CHANNEL_UNITS = {"wave_x": "m", "wave_y": "m", "wave_T": "s", "per_depth": "-"}
_PLACED = {shown: name for name, (shown, _, _) in PLACES.items()}
"""Values of the ship by the names of an exported one."""


def aboard_of(table: ScenarioFile, path: Path, own: Ship) -> tuple[Aboard, ...]:
    """The FMUs aboard the own ship.

    Raises:
        RequestError: an FMU that cannot be read, a wire that leads nowhere, two that give the same.
    """
    tables = list(table.fmu)
    if table.system is not None:
        file = path.parent / table.system.file
        structure = read_structure(file)
        if structure.step is not None and abs(structure.step * table.rate - 1.0) > 1e-9:
            raise RequestError(f"system: {file} has steps of {structure.step:g} s; write rate = {1 / structure.step:g}")
        tables += _wired(structure, table.system.ship, file)
    if not tables:
        return ()
    found = [_opened(k, one, path, own) for k, one in enumerate(tables, 1)]
    _check(found, table.own.pilot)
    return tuple(_joined(one, {other.name: other for other in found}) for one in found)


def _opened(number: int, table: FmuTable, path: Path, own: Ship) -> Aboard:
    """An FMU whose variables are there, real, and in units that fit; `file` is beside the scenario."""
    key = f"fmu {number}"
    file = path.parent / table.file
    if not trusted(file.stem):
        raise RequestError(f"{key}.file: {file.name} is a program, which runs as you do: allow that by "
                           f"--trust {file.stem}")  # fmt: skip
    archive = Archive.of(file, f"{key}.file")
    known, factors = archive.variables, _factors(key, archive, table, own)
    for variable in table.start:
        if variable not in known:
            raise RequestError(f"{key}.start: {unknown(variable, known, 'variable')}")
        if known[variable].type not in ("Real", "Float64"):
            raise RequestError(f"{key}.start: {variable} is of type {known[variable].type}; only reals are given")
    if not table.gives and not table.reads:
        raise RequestError(f"{key}: is wired to nothing; give reads and gives")
    name = table.name or Path(table.file).stem
    if "." in name:
        raise RequestError(f"{key}.name: '{name}' has a dot; NAME.OUTPUT is how another FMU reads it")
    return Aboard(name, archive, table.reads, table.gives, table.start, factors)


def _factors(key: str, archive: Archive, table: FmuTable, own: Ship) -> dict[str, float]:
    """Factors of the variables that are wired to the ship; its names and those of the FMU are checked."""
    found = dict[str, float]()
    gear = [*own.model.controls, *(f"{name}_cmd" for name in own.model.controls)]
    for part, wires, kind, ends in (("reads", table.reads, "input", [*STATES, *gear, *CHANNELS]),
                                    ("gives", table.gives, "output", gear)):  # fmt: skip
        for variable, name in wires.items():
            _variable(f"{key}.{part}", archive, variable, kind)
            if "." in name and kind == "input":
                continue
            if name not in ends:
                raise RequestError(f"{key}.{part}.{variable}: {unknown(name, ends, 'value of the ship')}")
            found[variable] = archive.factor(variable, _unit(name))
    return found


def _joined(one: Aboard, every: Mapping[str, Aboard]) -> Aboard:
    """An FMU with the factors of what it reads of others: what is given to the ship too is in the ship's unit."""
    factors = dict(one.factors)
    for variable, source in one.reads.items():
        other, _, output = source.partition(".")
        if not output:
            continue
        given = every[other].gives.get(output)
        if given is not None:
            factors[variable] = one.archive.factor(variable, _unit(given))
            continue
        mine, theirs = one.archive.unit(variable), every[other].archive.unit(output)
        if mine and theirs and mine != theirs:
            raise RequestError(f"{one.name}: {variable} is in {mine}, {source} in {theirs}; they must agree")
    return replace(one, factors=factors)


def _variable(key: str, archive: Archive, name: str, causality: str) -> None:
    """Refuse what is no real variable of this causality."""
    known = archive.variables
    if name not in known:
        fitting = [one for one, told in known.items() if told.causality == causality]
        raise RequestError(f"{key}: {archive.path.name}: {unknown(name, fitting, causality)}")
    told = known[name]
    if told.causality != causality or told.type not in ("Real", "Float64"):
        raise RequestError(f"{key}: {archive.path.name}: {name} is {told.causality} of type {told.type}; it must be a "
                           f"real {causality}")  # fmt: skip


def _unit(name: str) -> str:
    if name in CHANNELS:
        return _CHANNEL_UNITS.get(name, "m/s")
    return unit(name)


def _check(aboard: Sequence[Aboard], pilot: str) -> None:
    """Refuse wires from no FMU, and orders of two masters."""
    names = [one.name for one in aboard]
    given: dict[str, str] = {}
    for k, one in enumerate(aboard, 1):
        if names.count(one.name) > 1:
            raise RequestError(f"fmu {k}.name: two are called '{one.name}'; give names")
        for variable, source in one.reads.items():
            other, _, output = source.partition(".")
            if output and other not in names:
                raise RequestError(f"fmu {k}.reads.{variable}: {unknown(other, names, 'FMU')}")
            if output:
                _variable(f"fmu {k}.reads.{variable}", aboard[names.index(other)].archive, output, "output")
        for variable, to in one.gives.items():
            if to in given:
                raise RequestError(f"fmu {k}.gives.{variable}: {given[to]} gives {to} already")
            given[to] = one.name
    if pilot == "track" and "delta_cmd" in given:
        raise RequestError(f'own.pilot: {given["delta_cmd"]} orders the rudder as the track pilot does; '
                           'write pilot = "none"')  # fmt: skip


def _wired(structure: Structure, ship: str, path: Path) -> list[FmuTable]:
    """The FMUs of a system beside its ship, wired as it says."""
    if ship not in structure.sources:
        raise RequestError(f"system.ship: {unknown(ship, structure.sources, 'simulator')}")
    others = [name for name in structure.sources if name != ship]
    outputs = {name: Archive.of(structure.sources[name], "system").outputs for name in others}
    reads: dict[str, dict[str, str]] = {name: {} for name in others}
    gives: dict[str, dict[str, str]] = {name: {} for name in others}
    for ends in structure.connections:
        for (name, variable), (other, theirs) in (ends, ends[::-1]):
            if name == ship:
                continue
            if other == ship:
                wires = gives if variable in outputs[name] else reads
                wires[name][variable] = _of_ship(theirs, path)
            elif variable not in outputs[name]:
                reads[name][variable] = f"{other}.{theirs}"
    return [FmuTable(file=str(structure.sources[name].resolve()), name=name, reads=reads[name], gives=gives[name],
                     start=dict(structure.start[name])) for name in others]  # fmt: skip


def _of_ship(variable: str, path: Path) -> str:
    """A value of the ship by a variable of its exported FMU: an order, an actual control, a state."""
    if variable in _PLACED:
        return _PLACED[variable]
    if variable.startswith("order."):
        return f"{variable.removeprefix('order.')}_cmd"
    if variable.startswith("feedback."):
        return variable.removeprefix("feedback.")
    raise RequestError(f"{path}: connects {variable} of the ship; its orders (order.n_P), actual controls "
                       f"(feedback.n_P) and states ({', '.join(_PLACED)}) can be")  # fmt: skip
