"""XML of a slave: the descriptions of FMI 2.0 and 3.0, and that of the Open Simulation Platform."""

from __future__ import annotations

import math
import re
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ...core.version import __version__
from ...ships import ShipError
from .layout import Layout, Real
from .source import compiled

BASE = {"m": {"m": 1}, "s": {"s": 1}, "kg": {"kg": 1}, "rad": {"rad": 1}, "N": {"kg": 1, "m": 1, "s": -2}}
"""Exponents of the base units."""

OSP = "resources/OspModelDescription.xml"
"""Where a slave of FMI 2.0 has the description of the Open Simulation Platform."""

_LICENCE = "MIT for the code; the numbers of the ship are of the sources that its description names"

_OSP_SCHEMA = "https://open-simulation-platform.com/OspModelDescription/1.0.0"
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_PLAIN = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*", re.ASCII)


def descriptions(made: Layout, name: str, guid: str, fmi: int) -> dict[str, str]:
    """The descriptions in a slave by their places in it, that of the model first.

    Args:
        made: the variables of the slave.
        name: name of the model; the binary goes by that of the plant.
        guid: digest of the sources.
        fmi: version of the interface, 2 or 3.
    """
    if fmi == 2:
        return {"modelDescription.xml": _model_2(made, name, guid), OSP: osp_description(made)}
    return {
        "modelDescription.xml": _model_3(made, name, guid),
        "sources/buildDescription.xml": _build_description(made),
        "terminalsAndIcons/terminalsAndIcons.xml": _terminals(made),
    }


def _model(made: Layout, own: dict[str, str], abilities: dict[str, str]) -> tuple[Element, Element]:
    """The description down to the variables, and the element of its co-simulation."""
    root = Element("fmiModelDescription", {
        **own, "description": made.plant.title, "author": "seatrial", "version": __version__, "license": _LICENCE,
        "generationTool": f"seatrial {__version__}", "variableNamingConvention": "structured",
    })  # fmt: skip
    slave = SubElement(root, "CoSimulation", {"modelIdentifier": made.plant.name, **abilities})
    _define_units(root, made)
    SubElement(SubElement(root, "LogCategories"), "Category", {"name": "logStatusError"})
    SubElement(root, "DefaultExperiment", {"startTime": "0.0", "stepSize": repr(made.step)})
    return root, slave


def _model_2(made: Layout, name: str, guid: str) -> str:
    root, slave = _model(made, {"fmiVersion": "2.0", "modelName": name, "guid": guid}, {
        "needsExecutionTool": "false", "canHandleVariableCommunicationStepSize": "true",
        "canNotUseMemoryManagementFunctions": "true", "canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true",
    })  # fmt: skip
    files = SubElement(slave, "SourceFiles")
    for file in compiled(2):
        SubElement(files, "File", {"name": file})
    _variables(root, made)
    return _document(root)


def _variables(root: Element, made: Layout) -> None:
    """The variables and, by their places in that list, what depends on what."""
    listed = SubElement(root, "ModelVariables")
    places: dict[int, str] = {}
    for reference, real in enumerate(made.all):
        if real.shown:
            said = _meaning(real, reference) | ({"initial": "calculated"} if real.causality == "output" else {})
            SubElement(SubElement(listed, "ScalarVariable", said), "Real", _numbers(real))
            places[reference] = str(len(listed))
    structure = SubElement(root, "ModelStructure")
    found, first = SubElement(structure, "Outputs"), SubElement(structure, "InitialUnknowns")
    for reference, through in _depends(made).items():
        dependencies = " ".join(places[k] for k in through)
        SubElement(found, "Unknown", {"index": places[reference], "dependencies": dependencies})
        SubElement(first, "Unknown", {"index": places[reference]})


def _depends(made: Layout) -> dict[int, tuple[int, ...]]:
    """By value reference of each output, the inputs it depends on at once.

    Only accelerations do, of a right-hand side; an order acts through its actuator.
    """
    inputs = tuple(k for k, real in enumerate(made.all)
                   if real.causality == "input" and not real.name.startswith("order."))  # fmt: skip
    at_once = "body_acceleration." if made.network is None else "nothing"
    return {k: inputs if real.name.startswith(at_once) else () for k, real in enumerate(made.outputs)}


def _meaning(real: Real, reference: int) -> dict[str, str]:
    """Attributes of a variable: what it is."""
    varies = {"parameter": "fixed"}.get(real.causality, "continuous")
    return {"name": _quoted(real.name), "valueReference": str(reference), "description": real.about,
            "causality": real.causality, "variability": varies}  # fmt: skip


def _numbers(real: Real) -> dict[str, str]:
    """Attributes of a variable: unit, limits and start."""
    of = {"unit": _unit_name(real.unit)} if real.unit not in _NO_UNITS else {}
    of |= {key: repr(float(v)) for key, v in (("min", real.low), ("max", real.high)) if math.isfinite(v)}
    return of | ({"start": repr(real.start)} if real.causality != "output" else {})


def _quoted(name: str) -> str:
    """A name as the structured convention has it; in quotes where it is no chain of identifiers.

    Raises:
        ShipError: one with characters that FMI has no way to write.
    """
    if not (name.isascii() and name.isprintable()):
        raise ShipError(f"{name!a}: names in an FMU are plain ASCII; rename that part in the ship file")
    escaped = name.replace("\\", "\\\\").replace("'", "\\'")
    return name if _PLAIN.fullmatch(name) else f"'{escaped}'"


_NO_UNITS = ("", "-", "'")
"""Marks of a number without a unit."""


def _unit_name(text: str) -> str:
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


def _define_units(root: Element, made: Layout) -> None:
    """Every unit of a variable, by base units where it is made of them."""
    units = SubElement(root, "UnitDefinitions")
    for text in dict.fromkeys(("s", *(real.unit for real in made.all if real.unit not in _NO_UNITS))):
        defined = SubElement(units, "Unit", {"name": _unit_name(text)})
        base = exponents(text)
        if base is not None:
            SubElement(defined, "BaseUnit", {name: str(base[name]) for name in ("kg", "m", "s", "rad") if name in base})


def osp_description(made: Layout) -> str:
    """Which variables go together, for masters that connect groups."""
    root = Element("OspModelDescription", {"xmlns": _OSP_SCHEMA, "version": "1.0"})
    groups, typed = _grouped(made), {"current_velocity": "LinearVelocity"}  # the others are not of one kind
    of_all = SubElement(root, "VariableGroups")
    for name in sorted(groups, key=typed.__contains__):
        group = SubElement(of_all, typed.get(name, "Generic"), {"name": name})
        for real in groups[name]:
            SubElement(group, "Variable", {"ref": _quoted(real.name)})
    return _document(root)


def _grouped(made: Layout) -> dict[str, list[Real]]:
    """Outputs and inputs that go together, by the name of the group."""
    groups: dict[str, list[Real]] = {}
    for real in (*made.outputs, *made.inputs):
        groups.setdefault(real.name.rpartition(".")[0], []).append(real)
    return groups


def _document(root: Element) -> str:
    """The file of an element; characters that no XML may hold become spaces."""
    for element in root.iter():
        for key, text in element.attrib.items():
            element.set(key, _NOT_XML.sub(" ", text))
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"


def _model_3(made: Layout, name: str, token: str) -> str:
    root, _ = _model(made, {"fmiVersion": "3.0", "modelName": name, "instantiationToken": token}, {
        "canGetAndSetFMUState": "true", "canSerializeFMUState": "true",
        "canHandleVariableCommunicationStepSize": "true",
        **({"fixedInternalStepSize": repr(made.step)} if made.whole else {}),
    })  # fmt: skip
    listed = SubElement(root, "ModelVariables")
    time = {"name": "time", "valueReference": str(len(made.all)), "causality": "independent",
            "variability": "continuous", "unit": "s", "description": "time of the simulation"}  # fmt: skip
    SubElement(listed, "Float64", time)
    for reference, real in enumerate(made.all):
        if real.shown:
            SubElement(listed, "Float64", _meaning(real, reference) | _numbers(real))
    structure, known = SubElement(root, "ModelStructure"), _depends(made)
    for reference, through in known.items():
        dependencies = " ".join(map(str, through))
        SubElement(structure, "Output", {"valueReference": str(reference), "dependencies": dependencies})
    for reference in known:
        SubElement(structure, "InitialUnknown", {"valueReference": str(reference)})
    return _document(root)


def _build_description(made: Layout) -> str:
    """Which sources make the binary."""
    root = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    build = SubElement(root, "BuildConfiguration", {"modelIdentifier": made.plant.name})
    files = SubElement(build, "SourceFileSet", {"language": "C99"})
    for name in compiled(3):
        SubElement(files, "SourceFile", {"name": name})
    return _document(root)


def _terminals(made: Layout) -> str:
    """Which variables go together, so that a master connects groups."""
    root = Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    of_all = SubElement(root, "Terminals")
    for name, reals in _grouped(made).items():
        terminal = SubElement(of_all, "Terminal", {"name": name, "matchingRule": "plug"})
        for real in reals:
            SubElement(terminal, "TerminalMemberVariable", {
                "variableName": _quoted(real.name), "variableKind": "signal",
                "memberName": real.name.rpartition(".")[2],
            })  # fmt: skip
    return _document(root)
