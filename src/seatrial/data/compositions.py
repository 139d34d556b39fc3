"""Named compositions of a data set: which recordings a publication trained on, kind by kind.

A file of sets says in one place what several studies refer to: ``"@TZRB"`` stands for every recording of
the composition TZRB, ``"@TZRB.R"`` for its random manoeuvres.  Nothing is read here but names.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from ..parameters import unknown
from . import DataError
from .documents import read_toml

SCHEMA = "seatrial-sets/1"
MARK = "@"


@dataclass(frozen=True)
class Composition:
    """The recordings of one set, by the kind of manoeuvre.

    Attributes:
        name: its name in the file of sets.
        parts: names of recordings (below the root of the data, without suffix) by the letter of their kind.
    """

    name: str
    parts: Mapping[str, tuple[str, ...]]

    @property
    def files(self) -> tuple[str, ...]:
        """All recordings, kind by kind."""
        return tuple(name for part in self.parts.values() for name in part)


def read_compositions(path: str | Path) -> dict[str, Composition]:
    """Read a file of sets.

    Raises:
        DataError: no such file, another schema, a list that holds no names, or a recording named twice in one set.
    """
    here = Path(path)
    if not here.exists():
        raise DataError(f"{here}: no such file of sets")
    document = read_toml(here)
    if document.get("schema") != SCHEMA:
        raise DataError(f"{here}: schema is {document.get('schema')!r}; this version reads '{SCHEMA}'")
    stray = [key for key in document if key not in ("schema", "source", "sets")]
    if stray:
        raise DataError(f"{here}: {unknown(stray[0], ('schema', 'source', 'sets'), 'key')}")
    sets = document.get("sets")
    if not isinstance(sets, dict) or not sets:
        raise DataError(f"{here}: no set; write [sets.NAME] with a list of recordings for each kind")
    return {name: _composition(here, name, table) for name, table in cast("dict[str, Any]", sets).items()}


def _composition(path: Path, name: str, table: Any) -> Composition:
    if not isinstance(table, dict) or not table:
        raise DataError(f"{path}: sets.{name} must be a table with a list of recordings for each kind")
    parts: dict[str, tuple[str, ...]] = {}
    seen: dict[str, str] = {}
    for kind, value in cast("dict[str, Any]", table).items():
        names = cast("list[Any]", value) if isinstance(value, list) else [value]
        if not isinstance(value, list) or not all(isinstance(one, str) for one in names):
            raise DataError(f"{path}: sets.{name}.{kind} must be a list of names")
        for one in names:
            if one in seen:
                raise DataError(f"{path}: sets.{name}.{kind}: {one} is in {seen[one]} already; name it once")
            seen[one] = kind
        parts[kind] = tuple(names)
    return Composition(name, parts)


def expanded(where: str, entries: Iterable[str], sets: Mapping[str, Composition]) -> list[str]:
    """The entries of a list with each ``@NAME`` or ``@NAME.KIND`` replaced by what it stands for, in order.

    Args:
        where: what an error begins with.
        entries: names, patterns and references.
        sets: known compositions.

    Raises:
        DataError: a reference to an unknown composition or kind.
    """
    out: list[str] = []
    for entry in entries:
        out += _resolved(where, entry[len(MARK) :], sets) if entry.startswith(MARK) else [entry]
    return list(dict.fromkeys(out))


def _resolved(where: str, name: str, sets: Mapping[str, Composition]) -> Sequence[str]:
    if not sets:
        raise DataError(f"{where}: '{MARK}{name}' needs a file of sets; name one with sets = \"...\"")
    if name in sets:
        return sets[name].files
    outer, _, kind = name.rpartition(".")
    if outer not in sets:
        raise DataError(f"{where}: {unknown(name, sets, 'set')}")
    if kind not in sets[outer].parts:
        raise DataError(f"{where}: {MARK}{outer}: {unknown(kind, sets[outer].parts, 'kind')}")
    return sets[outer].parts[kind]
