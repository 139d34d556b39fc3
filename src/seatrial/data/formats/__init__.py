"""Formats of logs: one module a format, found by walking this folder.

Contract of a module: `name`, by which `seatrial import` and ``data.format`` of a study choose it; `suffixes` of its
files, in lower case (one without a leading dot is the name of a file that marks its folder as one recording); and
``read(source, mapping)``, which gives the `Trial` of one recording with our channels, units and signs.  It keeps gaps
as NaN and the recorded times, and raises `DataError` that names file, column and line of a fault.

A module whose logs leave a choice has `read_mapping(path)` too: the mapping file, read and checked before any log is;
`read` gets what it returns.  It raises `DataError` for an unknown key (the near ones are named), a wrong type or unit.
One that cannot do without sets ``needs_mapping = True``.  `mapping` is None where there
is no mapping file.  Where a mapping cuts a log into trials or joins files, `read_all(source, mapping)` gives all trials
of one recording, and `recordings(src, mapping)` finds the recordings in place of `suffixes`.

Conformance (`seatrial.testing.check_format`, by a short log that the module of a text format gives as `EXAMPLE`): it
reads that log into a trial with possible values, and answers damaged ones by `DataError` in one line with the file.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from shlex import quote
from typing import Any

from ...core.errors import TrackError
from ...core.parameters import unknown
from ...core.values import dataclass
from .. import DataError, Trial
from ..recognise import recognise, sentences
from ..table import existing

__all__ = ["Format", "Reader", "formats", "known_by_suffix", "logs", "reader", "recordings"]

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
        read_all: the trials of one recording; None where each is one.
        recordings: finds the recordings; None where `suffixes` do.
    """

    name: str
    suffixes: tuple[str, ...]
    read: Callable[[Path, Any], Trial]
    read_mapping: Callable[[Path], object] | None = None
    needs_mapping: bool = False
    read_all: Callable[[Path, Any], tuple[Trial, ...]] | None = None
    recordings: Callable[[Path, Any], list[Path]] | None = None


def formats() -> Mapping[str, Format]:
    """Every format that has a module in this folder, by name."""
    every = (_of_module(module.name) for module in pkgutil.iter_modules(__path__, f"{__name__}."))
    return {one.name: one for one in every}


def _of_module(module: str) -> Format:
    one = import_module(module)
    needed = getattr(one, "needs_mapping", False)
    others = (getattr(one, key, None) for key in ("read_all", "recordings"))
    return Format(one.name, one.suffixes, one.read, getattr(one, "read_mapping", None), needed, *others)


def known_by_suffix(src: Path) -> str:
    """How to import the first file at `src` that is of a format, by what is in it or its suffix; "" where none."""
    files = sorted(f for f in src.rglob("*") if f.is_file()) if src.is_dir() else [src]
    for file in files:
        if (known := recognise(file)) is not None:
            return known.told(file)
        for one in formats().values():
            if {file.suffix.lower(), file.name} & set(one.suffixes) and not one.needs_mapping:
                return f"{file.name} looks like {one.name}: seatrial import {one.name} {quote(str(src))} -o trials"
    return ""


def _format(name: str) -> Format:
    own = name.replace("-", "_")  # the usual name of its module, as to import all of them takes its time
    if own in (module.name for module in pkgutil.iter_modules(__path__)):
        one = _of_module(f"{__name__}.{own}")
        if one.name == name:
            return one
    known = formats()
    if name not in known:
        raise DataError(unknown(name, known, "format"))
    return known[name]


def reader(format: str, mapping: str | Path | None = None) -> Reader:
    """The reader of a format, by a mapping file where one is given; the mapping file is read here.

    Raises:
        DataError: an unknown format, a mapping file that it does not take or that is wrong, or none where it needs one.
    """
    chosen, checked = _mapped(format, mapping)
    return lambda path: chosen.read(path, checked)


def logs(format: str, src: str | Path, mapping: str | Path | None = None) -> Iterator[tuple[Path, tuple[Trial, ...]]]:
    """The recordings of a format at `src`, each with its trials, by a mapping file where one is given.

    Raises:
        DataError: as `reader` and `recordings`, and of a log that cannot be read.
    """
    chosen, checked = _mapped(format, mapping)
    found = _found(chosen, checked, existing(src))
    read, alone = list[tuple[Path, tuple[Trial, ...]]](), list[TrackError]()
    for path in found:
        try:
            one = path, chosen.read_all(path, checked) if chosen.read_all else (chosen.read(path, checked),)
        except TrackError as error:
            alone.append(error)
            if len(alone) == len(found):
                raise alone[0] from None
            continue
        except DataError as error:
            known = recognise(path) if path.is_file() else None
            if known is None or known.format == format:
                raise
            raise DataError(f"{error}; {known.told(path)}") from None
        read.append(one)
    said = [f"doubt: left out: {error}" for error in alone]
    yield from ((path, tuple(trial.noting(*said) for trial in trials) if said else trials) for path, trials in read)


def _mapped(name: str, mapping: str | Path | None) -> tuple[Format, Any]:
    """A format, and what its mapping file says."""
    chosen = _format(name)
    if mapping is None:
        if chosen.needs_mapping:
            raise DataError(f"format {name} needs a mapping file that says which column is which channel")
        return chosen, None
    if chosen.read_mapping is None:
        raise DataError(f"format {name} takes no mapping file; its columns are known")
    return chosen, chosen.read_mapping(Path(mapping))


def recordings(format: str, src: str | Path, mapping: str | Path | None = None) -> list[Path]:
    """The recordings of a format at `src`, itself one or a folder of them, searched with its subfolders.

    Raises:
        DataError: an unknown format, a wrong mapping file, no such path, or nothing of this format.
    """
    if mapping is None:
        return _found(_format(format), None, existing(src))
    return _found(*_mapped(format, mapping), existing(src))


def _is(path: Path, format: str) -> bool:
    """Whether a file is of a format by what is in it, whatever its name."""
    known = recognise(path)
    return known.format == format if known is not None and known.format else format == "nmea" and sentences(path)


def _found(chosen: Format, checked: Any, here: Path) -> list[Path]:
    if chosen.recordings is not None and (checked is not None or not chosen.needs_mapping):
        return chosen.recordings(here, checked)
    suffixes, format = chosen.suffixes, chosen.name
    marks = [name for name in suffixes if not name.startswith(".")]
    if not here.is_dir() and not marks:
        return [here]
    files = [f for f in here.rglob("*") if f.is_file()] if here.is_dir() else []
    found = sorted({f.parent for f in files if f.name in marks} | {f for f in files if f.suffix.lower() in suffixes})
    if found or (found := [] if marks else sorted(path for path in files if _is(path, format))):
        return found
    if marks:
        raise DataError(f"{here}: no recording of format {format}; give its folder, the one with {marks[0]} in it")
    listed = " or ".join(f"*{suffix}" for suffix in suffixes)
    raise DataError(f"{here}: no file {listed} in this folder or below; is format {format} right?")
