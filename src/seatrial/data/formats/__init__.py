"""Formats of logs: one module a format, found by walking this folder.

Contract of a module: `name`, by which `seatrial import` and ``data.format`` of a study choose it; `suffixes` of its
files, in lower case (one without a leading dot is the name of a file that marks its folder as one recording); and
``read(source, mapping)``, which gives the `Trial` of one recording with our channels, units and signs.  It keeps gaps
as NaN and the recorded times, and raises `DataError` that names file, column and line of a fault.

A module whose logs leave a choice has `read_mapping(path)` too: the mapping file, read and checked before any log is;
`read` gets what it returns.  It raises `DataError` for an unknown key (the near ones are named), a wrong type or unit.
One that cannot do without sets ``needs_mapping = True``.  `mapping` is None where there
is no mapping file.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from ...core.parameters import unknown
from .. import DataError, Trial
from ..table import existing

__all__ = ["Format", "Reader", "formats", "reader", "recordings"]

Reader = Callable[[Path], Trial]


@dataclass(frozen=True)
class Format:
    """A format of logs, as its module defines it.

    Attributes:
        name: of the format.
        suffixes: of its files, or the name of the file that marks a folder as a recording.
        read: trial of one recording, by what `read_mapping` gave or None.
        read_mapping: reads and checks a mapping file; None where the format takes none.
        needs_mapping: whether a log cannot be read without a mapping file.
    """

    name: str
    suffixes: tuple[str, ...]
    read: Callable[[Path, Any], Trial]
    read_mapping: Callable[[Path], object] | None = None
    needs_mapping: bool = False


def formats() -> Mapping[str, Format]:
    """Every format that has a module in this folder, by name."""
    found: dict[str, Format] = {}
    for module in pkgutil.iter_modules(__path__, f"{__name__}."):
        one = import_module(module.name)
        mapped, needed = getattr(one, "read_mapping", None), getattr(one, "needs_mapping", False)
        found[one.name] = Format(one.name, one.suffixes, one.read, mapped, needed)
    return found


def _format(name: str) -> Format:
    known = formats()
    if name not in known:
        raise DataError(unknown(name, known, "format"))
    return known[name]


def reader(format: str, mapping: str | Path | None = None) -> Reader:
    """The reader of a format, by a mapping file where one is given; the mapping file is read here.

    Raises:
        DataError: an unknown format, a mapping file that it does not take or that is wrong, or none where it needs one.
    """
    chosen = _format(format)
    if mapping is None:
        if chosen.needs_mapping:
            raise DataError(f"format {format} needs a mapping file that says which column is which channel")
        return lambda path: chosen.read(path, None)
    if chosen.read_mapping is None:
        raise DataError(f"format {format} takes no mapping file; its columns are known")
    checked = chosen.read_mapping(Path(mapping))
    return lambda path: chosen.read(path, checked)


def recordings(format: str, src: str | Path) -> list[Path]:
    """The recordings of a format at `src`, itself one or a folder of them, searched with its subfolders.

    Raises:
        DataError: an unknown format, no such path, or nothing of this format.
    """
    suffixes, here = _format(format).suffixes, existing(src)
    marks = [name for name in suffixes if not name.startswith(".")]
    if not here.is_dir() and not marks:
        return [here]
    files = [f for f in here.rglob("*") if f.is_file()] if here.is_dir() else []
    found = sorted({f.parent for f in files if f.name in marks} | {f for f in files if f.suffix.lower() in suffixes})
    if found:
        return found
    if marks:
        raise DataError(f"{here}: no recording of format {format}; give its folder, the one with {marks[0]} in it")
    listed = " or ".join(f"*{suffix}" for suffix in suffixes)
    raise DataError(f"{here}: no file {listed} in this folder or below; is format {format} right?")
