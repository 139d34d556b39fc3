"""XML of a slave: the descriptions of FMI 2.0 and 3.0, and that of the Open Simulation Platform."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ...ships import ShipError
from .layout import Layout, Real
from .source import compiled

BASE = {"m": {"m": 1}, "s": {"s": 1}, "kg": {"kg": 1}, "rad": {"rad": 1}, "N": {"kg": 1, "m": 1, "s": -2}}
"""Exponents of the base units."""

OSP = "https://open-simulation-platform.com/OspModelDescription/1.0.0"
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_PLAIN = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*", re.ASCII)


def model_description(made: Layout, name: str, guid: str) -> str:
    """What the slave is and has.

    Args:
        name: name of the model; the binary goes by that of the plant.
        guid: digest of the sources.
    """
    root = Element("fmiModelDescription", {
        "fmiVersion": "2.0", "modelName": name, "guid": guid, "description": made.plant.title,
        "generationTool": "seatrial", "variableNamingConvention": "structured",
    })  # fmt: skip
    slave = SubElement(root, "CoSimulation", {
        "modelIdentifier": made.plant.name, "needsExecutionTool": "false",
        "canHandleVariableCommunicationStepSize": "true", "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true",
    })  # fmt: skip
    files = SubElement(slave, "SourceFiles")
    for file in compiled(2):
        SubElement(files, "File", {"name": file})
    define_units(root, made)
    SubElement(SubElement(root, "LogCategories"), "Category", {"name": "logStatusError"})
    SubElement(root, "DefaultExperiment", {"startTime": "0.0", "stepSize": repr(made.step)})
    _variables(root, made)
    return document(root)


def _variables(root: Element, made: Layout) -> None:
    """The variables and, by their places in that list, what depends on what."""
    listed = SubElement(root, "ModelVariables")
    places: dict[int, str] = {}
    for reference, real in enumerate(made.all):
        if real.shown:
            _variable(listed, real, reference)
            places[reference] = str(len(listed))
    structure = SubElement(root, "ModelStructure")
    found, first = SubElement(structure, "Outputs"), SubElement(structure, "InitialUnknowns")
    for reference, through in depends(made).items():
        told = {"index": places[reference], "dependencies": " ".join(places[k] for k in through)}
        SubElement(found, "Unknown", told)
        SubElement(first, "Unknown", {"index": places[reference]})


def depends(made: Layout) -> dict[int, tuple[int, ...]]:
    """By value reference of each output, the inputs it depends on at once.

    Only accelerations do, of a right-hand side; an order acts through its actuator.
    """
    inputs = tuple(k for k, real in enumerate(made.all)
                   if real.causality == "input" and not real.name.startswith("order."))  # fmt: skip
    at_once = "body_acceleration." if made.network is None else "nothing"
    return {k: inputs if real.name.startswith(at_once) else () for k, real in enumerate(made.outputs)}


def _variable(listed: Element, real: Real, reference: int) -> None:
    said = {**meaning(real, reference), **({"initial": "calculated"} if real.causality == "output" else {})}
    SubElement(SubElement(listed, "ScalarVariable", said), "Real", numbers(real))


def meaning(real: Real, reference: int) -> dict[str, str]:
    """Attributes of a variable: what it is."""
    varies = {"parameter": "fixed"}.get(real.causality, "continuous")
    return {"name": quoted(real.name), "valueReference": str(reference), "description": real.about,
            "causality": real.causality, "variability": varies}  # fmt: skip


def numbers(real: Real) -> dict[str, str]:
    """Attributes of a variable: unit, limits and start."""
    of = {"unit": unit_name(real.unit)} if measured(real.unit) else {}
    of |= {key: repr(float(v)) for key, v in (("min", real.low), ("max", real.high)) if math.isfinite(v)}
    return of | ({"start": repr(real.start)} if real.causality != "output" else {})


def quoted(name: str) -> str:
    """A name as the structured convention has it; in quotes where it is no chain of identifiers.

    Raises:
        ShipError: one with characters that FMI has no way to write.
    """
    if not (name.isascii() and name.isprintable()):
        raise ShipError(f"{name!a}: names in an FMU are plain ASCII; rename that part in the ship file")
    escaped = name.replace("\\", "\\\\").replace("'", "\\'")
    return name if _PLAIN.fullmatch(name) else f"'{escaped}'"


def measured(text: str) -> bool:
    """Whether a unit is one, and no mark of a number without."""
    return text not in ("", "-", "'")


def unit_name(text: str) -> str:
    """A unit as FMI writes it: kg.m2/s for kg m^2/s."""
    return text.replace(" ", ".").replace("^", "")


def exponents(text: str) -> dict[str, int] | None:
    """Exponents of the base units in a unit such as kg m^2/s; None for one that is not made of those in `BASE`."""
    found: dict[str, int] = {}
    for position, part in enumerate(text.split("/")):
        for factor in part.split():
            symbol, _, power = factor.partition("^")
            if symbol == "1":
                continue
            if symbol not in BASE:
                return None
            times = int(power or 1) * (-1 if position else 1)
            for base, exponent in BASE[symbol].items():
                found[base] = found.get(base, 0) + times * exponent
    return {base: exponent for base, exponent in found.items() if exponent}


def define_units(root: Element, made: Layout) -> None:
    """Every unit of a variable, by base units where it is made of them."""
    units = SubElement(root, "UnitDefinitions")
    for text in dict.fromkeys(("s", *(real.unit for real in made.all if measured(real.unit)))):
        defined = SubElement(units, "Unit", {"name": unit_name(text)})
        base = exponents(text)
        if base is not None:
            SubElement(defined, "BaseUnit", {name: str(base[name]) for name in ("kg", "m", "s", "rad") if name in base})


def osp_description(made: Layout) -> str:
    """Which variables go together, for masters that connect groups."""
    root = Element("OspModelDescription", {"xmlns": OSP, "version": "1.0"})
    groups = grouped(made)
    of_all = SubElement(root, "VariableGroups")
    for name in sorted(groups, key=lambda one: _kind(groups[one]) != "Generic"):
        group = SubElement(of_all, _kind(groups[name]), {"name": name})
        for real in groups[name]:
            SubElement(group, "Variable", {"ref": quoted(real.name)})
    return document(root)


def grouped(made: Layout) -> dict[str, list[Real]]:
    """Outputs and inputs that go together, by the name of the group."""
    groups: dict[str, list[Real]] = {}
    for real in (*made.outputs, *made.inputs):
        groups.setdefault(real.name.rpartition(".")[0], []).append(real)
    return groups


def _kind(reals: Sequence[Real]) -> str:
    """Type of a group; Generic where its variables are not of one kind."""
    return "LinearVelocity" if reals[0].name.startswith("current_velocity.") else "Generic"


def document(root: Element) -> str:
    """The file of an element; characters that no XML may hold become spaces."""
    for element in root.iter():
        for key, text in element.attrib.items():
            element.set(key, _NOT_XML.sub(" ", text))
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"


def model_description_3(made: Layout, name: str, token: str) -> str:
    """What the slave is and has.

    Args:
        name: name of the model; the binary goes by that of the plant.
        token: digest of the sources.
    """
    root = Element("fmiModelDescription", {
        "fmiVersion": "3.0", "modelName": name, "instantiationToken": token, "description": made.plant.title,
        "generationTool": "seatrial", "variableNamingConvention": "structured",
    })  # fmt: skip
    grid = {"fixedInternalStepSize": repr(made.step)} if made.whole else {}
    SubElement(root, "CoSimulation", {
        "modelIdentifier": made.plant.name, "canGetAndSetFMUState": "true", "canSerializeFMUState": "true",
        "canHandleVariableCommunicationStepSize": "true", **grid,
    })  # fmt: skip
    define_units(root, made)
    SubElement(SubElement(root, "LogCategories"), "Category", {"name": "logStatusError"})
    SubElement(root, "DefaultExperiment", {"startTime": "0.0", "stepSize": repr(made.step)})
    listed = SubElement(root, "ModelVariables")
    time = {"name": "time", "valueReference": str(len(made.all)), "causality": "independent",
            "variability": "continuous", "unit": "s", "description": "time of the simulation"}  # fmt: skip
    SubElement(listed, "Float64", time)
    for reference, real in enumerate(made.all):
        if real.shown:
            SubElement(listed, "Float64", {**meaning(real, reference), **numbers(real)})
    structure, known = SubElement(root, "ModelStructure"), depends(made)
    for reference, through in known.items():
        told = {"valueReference": str(reference), "dependencies": " ".join(map(str, through))}
        SubElement(structure, "Output", told)
    for reference in known:
        SubElement(structure, "InitialUnknown", {"valueReference": str(reference)})
    return document(root)


def build_description(made: Layout) -> str:
    """Which sources make the binary."""
    root = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    build = SubElement(root, "BuildConfiguration", {"modelIdentifier": made.plant.name})
    files = SubElement(build, "SourceFileSet", {"language": "C99"})
    for name in compiled(3):
        SubElement(files, "SourceFile", {"name": name})
    return document(root)


def terminals(made: Layout) -> str:
    """Which variables go together, so that a master connects groups."""
    root = Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    of_all = SubElement(root, "Terminals")
    for name, reals in grouped(made).items():
        terminal = SubElement(of_all, "Terminal", {"name": name, "matchingRule": "plug"})
        for real in reals:
            SubElement(terminal, "TerminalMemberVariable", {
                "variableName": quoted(real.name), "variableKind": "signal",
                "memberName": real.name.rpartition(".")[2],
            })  # fmt: skip
    return document(root)
