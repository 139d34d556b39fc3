"""Choosing a model: what each family can represent, what it needs and costs, and which one suits a purpose.

Contract: a `Family` is what is known beforehand of a way to model a ship; `survey` puts beside it what
is found by flying the ships of the library through the same probes; `recommend` ranks the families for
a `Purpose`.  What code can determine (does the speed answer to the propeller? is it silent at rest?) is
measured, so the table cannot claim more than the code does; the rest is declared, with the section of
Sawada et al. (2024) that states it.  A declared answer can only lower a measured one.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..core.values import dataclass, field
from ..ships import Ship

ANSWERS = ("yes", "part", "partly", "no", "planned")
"""From best to worst: as the library's ships are; with a part added to the ship file; in part; not; not built."""


@dataclass(frozen=True)
class Finding:
    """An answer of `ANSWERS`, and how it is known: what was measured on which ship, or the source that states it."""

    answer: str
    how: str


@dataclass(frozen=True)
class Capability:
    """Something that a model may be able to represent: `about` in words."""

    key: str
    about: str


def table(name: str) -> dict[str, Any]:
    """What a file of this room declares."""
    return tomllib.loads(Path(__file__).with_name(name).read_text(encoding="utf-8"))


CAPABILITIES = tuple(Capability(key, about) for key, about in table("families.toml")["capabilities"].items())
"""What a family may do for its user, as `families.toml` names it."""


@dataclass(frozen=True)
class Family:
    """A way to model a ship, as far as it is known beforehand.

    Attributes:
        key, name: short name for tables and JSON, and the name in words.
        classes: model classes as ship files name them, such as "mmg:Mmg"; empty where it is only planned.
        form: the equation, or what is modelled, in a line.
        section: where Sawada et al. (2024) describe it.
        source: citation of the family.
        routes: ways to its numbers, with Sawada's section each.
        studies: reference numbers of the rows of Sawada's Table 1 with the data it needs.
        counted: patterns of the paths of its coefficients; the others (size, reference speed) are not counted.
        declared: answers that code cannot determine, by capability.
        belongs: whether a ship whose model is of `classes` is of this family.
        specimen: makes a ship for the probes where the library has none.
        next: commands that run as they stand, or with the user's own file for a name in capitals.
    """

    key: str
    name: str
    classes: tuple[str, ...]
    form: str
    section: str
    source: str
    routes: Mapping[str, str]
    declared: Mapping[str, Finding]
    studies: tuple[int, ...] = ()
    counted: tuple[str, ...] = ("*",)
    belongs: Callable[[Ship], bool] = field(default=lambda ship: True)
    specimen: Callable[[], Ship] | None = None
    next: tuple[str, ...] = ()


@dataclass(frozen=True)
class Need:
    """What a purpose requires of a model: capabilities, all of them, and the source.

    Attributes:
        about: the need in words.
        keys: capabilities that must all be there; none where no family differs, such as the actuators.
        place: section of Sawada et al. (2024).
        item: number in the list of section 6.2 for this purpose; 0 where it is from elsewhere.
        must: False for what is only good to have.
    """

    about: str
    keys: tuple[str, ...]
    place: str
    item: int = 0
    must: bool = True
