"""modelDescription.xml of FMI 2.0, and OspModelDescription.xml of the Open Simulation Platform."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from .fmu_layout import Layout, Real

BASE = {"m": {"m": 1}, "s": {"s": 1}, "kg": {"kg": 1}, "rad": {"rad": 1}, "N": {"kg": 1, "m": 1, "s": -2}}
"""Exponents of the base units."""

OSP = "https://open-simulation-platform.com/OspModelDescription/1.0.0"
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
    for file in ("fmi2.c", "ship.c"):
        SubElement(files, "File", {"name": file})
    units = SubElement(root, "UnitDefinitions")
    for text in dict.fromkeys(real.unit for real in made.all if _measured(real.unit)):
        _define(units, text)
    SubElement(SubElement(root, "LogCategories"), "Category", {"name": "logStatusError"})
    SubElement(root, "DefaultExperiment", {"startTime": "0.0", "stepSize": repr(made.step)})
    _variables(root, made)
    return _text(root)


def _variables(root: Element, made: Layout) -> None:
    """The variables and, by their places in that list, what depends on what."""
    listed = SubElement(root, "ModelVariables")
    outputs: list[int] = []
    inputs: list[int] = []
    rates: list[int] = []
    for reference, real in enumerate(made.all):
        if not real.shown:
            continue
        _variable(listed, real, reference)
        if real.causality == "output":
            outputs.append(len(listed))
            if real.name.startswith("body_acceleration."):
                rates.append(len(listed))
        if real.causality == "input" and not real.name.startswith("order."):
            inputs.append(len(listed))  # an order acts through its actuator, not at once
    structure = SubElement(root, "ModelStructure")
    found = SubElement(structure, "Outputs")
    for place in outputs:
        through = " ".join(map(str, inputs)) if place in rates else ""
        SubElement(found, "Unknown", {"index": str(place), "dependencies": through})
    first = SubElement(structure, "InitialUnknowns")
    for place in outputs:
        SubElement(first, "Unknown", {"index": str(place)})


def _variable(listed: Element, real: Real, reference: int) -> None:
    varies = {"parameter": "fixed"}.get(real.causality, "continuous")
    attributes = {"name": _quoted(real.name), "valueReference": str(reference), "description": real.about,
                  "causality": real.causality, "variability": varies}  # fmt: skip
    if real.causality == "output":
        attributes["initial"] = "calculated"
    of = {"unit": unit_name(real.unit)} if _measured(real.unit) else {}
    of |= {key: repr(float(v)) for key, v in (("min", real.low), ("max", real.high)) if math.isfinite(v)}
    if real.causality != "output":
        of["start"] = repr(real.start)
    SubElement(SubElement(listed, "ScalarVariable", attributes), "Real", of)


def _quoted(name: str) -> str:
    """A name as the structured convention has it; in quotes where it is no chain of identifiers."""
    escaped = name.replace("\\", "\\\\").replace("'", "\\'")
    return name if _PLAIN.fullmatch(name) else f"'{escaped}'"


def _measured(text: str) -> bool:
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


def _define(units: Element, text: str) -> None:
    defined = SubElement(units, "Unit", {"name": unit_name(text)})
    base = exponents(text)
    if base is not None:
        SubElement(defined, "BaseUnit", {name: str(base[name]) for name in ("kg", "m", "s", "rad") if name in base})


def osp_description(made: Layout) -> str:
    """Which variables go together, for masters that connect groups."""
    root = Element("OspModelDescription", {"xmlns": OSP, "version": "1.0"})
    groups: dict[str, list[Real]] = {}
    for real in (*made.outputs, *made.inputs):
        groups.setdefault(real.name.rpartition(".")[0], []).append(real)
    of_all = SubElement(root, "VariableGroups")
    for name in sorted(groups, key=lambda one: _kind(groups[one]) != "Generic"):
        group = SubElement(of_all, _kind(groups[name]), {"name": name})
        for real in groups[name]:
            SubElement(group, "Variable", {"ref": _quoted(real.name)})
    return _text(root)


def _kind(reals: Sequence[Real]) -> str:
    """Type of a group; Generic where its variables are not of one kind."""
    return "LinearVelocity" if reals[0].name.startswith("current_velocity.") else "Generic"


def _text(root: Element) -> str:
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"
