"""Systems of the Open Simulation Platform: `OspSystemStructure.xml`, its simulators, connections and initial values.

Connections of variables are read (OSP-IS 1.0, system structure); those of groups, whose variables stand in another file
of each FMU, and functions, which are no FMUs, are refused by name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

from ...core.errors import RequestError
from ...core.values import dataclass

_MADE = re.compile(rb"<!(?:DOCTYPE|ENTITY)", re.IGNORECASE)
_LARGEST = 4_000_000

End = tuple[str, str]
"""Simulator and variable."""


@dataclass(frozen=True)
class Structure:
    """A system.

    Attributes:
        sources: file of each simulator, by its name.
        connections: pairs of ends that have one value; which is the output their FMUs know.
        start: initial values of each simulator.
        step: base step [s]; None where it has none.
    """

    sources: Mapping[str, Path]
    connections: tuple[tuple[End, End], ...]
    start: Mapping[str, Mapping[str, float]]
    step: float | None


def read_structure(path: Path) -> Structure:
    """The system of a file.

    Raises:
        RequestError: no such file, or no such system; functions, which are not read.
    """
    found = {_tag(part): part for part in _root(path)}
    if len(found.get("Functions", ())):
        raise RequestError(f"{path}: has Functions; connect variables directly")
    sources, start = dict[str, Path](), dict[str, dict[str, float]]()
    for one in found.get("Simulators", ()):
        name = one.get("name", "")
        sources[name] = path.parent / one.get("source", "").removeprefix("file:///")
        start[name] = {value.get("variable", ""): _number(path, name, value) for value in one.iter()
                       if _tag(value) == "InitialValue"}  # fmt: skip
    pairs = tuple(_pair(path, one, sources) for one in found.get("Connections", ()))
    step = found.get("BaseStepSize")
    return Structure(sources, pairs, start, None if step is None else _float(path, "BaseStepSize", step.text))


def _root(path: Path) -> ElementTree.Element:
    """The root of a file, bounded before it is parsed."""
    try:
        raw = path.read_bytes() if path.stat().st_size <= _LARGEST else b"<!ENTITY"
        if _MADE.search(raw):
            raise RequestError(f"{path}: is larger than 4 MB or declares entities of its own; a system has none")
        root = ElementTree.fromstring(raw)
    except OSError as error:
        raise RequestError(f"{path}: cannot be read: {error.strerror}") from None
    except (ElementTree.ParseError, LookupError, ValueError) as error:  # the latter of its encoding
        raise RequestError(f"{path}: no whole XML file ({error})") from None
    if _tag(root) != "OspSystemStructure":
        raise RequestError(f"{path}: its root is {_tag(root)}; it must be OspSystemStructure")
    return root


def _pair(path: Path, one: ElementTree.Element, sources: Mapping[str, Path]) -> tuple[End, End]:
    """The two ends of a connection."""
    ends = [(end.get("simulator", ""), end.get("name", "")) for end in one]
    if _tag(one) == "VariableGroupConnection":
        raise RequestError(f"{path}: connects the groups {' and '.join('.'.join(end) for end in ends)}; name their "
                           "variables in VariableConnection")  # fmt: skip
    if _tag(one) != "VariableConnection" or len(ends) != 2:
        raise RequestError(f"{path}: {_tag(one)} of {len(ends)} ends; a connection has two variables")
    for name, _ in ends:
        if name not in sources:
            raise RequestError(f"{path}: connects the simulator '{name}'; it has {', '.join(sources) or 'none'}")
    return ends[0], ends[1]


def _tag(one: ElementTree.Element) -> str:
    return one.tag.rpartition("}")[2]


def _number(path: Path, simulator: str, one: ElementTree.Element) -> float:
    name = f"InitialValue {simulator}.{one.get('variable')}"
    for value in one:
        if _tag(value) in ("Real", "Integer"):
            return _float(path, name, value.get("value"))
    raise RequestError(f"{path}: {name} has no Real or Integer; only numbers are given")


def _float(path: Path, name: str, text: str | None) -> float:
    try:
        return float(text or "")
    except ValueError:
        raise RequestError(f"{path}: {name} is {text!r}; it must be a number") from None
