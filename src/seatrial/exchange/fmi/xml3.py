"""The descriptions of FMI 3.0: the slave, how it is built, and its terminals."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from .layout import Layout
from .source import compiled
from .xml import define_units, depends, document, grouped, meaning, numbers, quoted


def model_description(made: Layout, name: str, token: str) -> str:
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
