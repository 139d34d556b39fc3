"""The files of one recording, and the recordings below a folder."""

from __future__ import annotations

import fnmatch
import glob
import re
from pathlib import Path

from .. import DataError
from ..sheets import ARRAYS, PARQUET, WORKBOOKS
from ..table import existing
from .schema import Files, Mapping

SUFFIXES = ((".csv", ".dat", ".tsv"), WORKBOOKS, PARQUET, ARRAYS, (".txt", ".log", ".asc", ".lvm"))
"""Suffixes of tables: of a folder the first kind that it has."""

_TRIAL, _GROUP = "{trial}", "(?P<trial>[^/]+)"


def recordings(src: Path, mapping: Mapping) -> list[Path]:
    """The recordings at `src`, a file or a folder searched with its subfolders; a folder where several files are one.

    Raises:
        DataError: no such path, or no recording.
    """
    here = existing(src)
    alone = _tables(here) if here.is_dir() and mapping.files is None else [here]
    found = alone if mapping.files is None else _joined(here, mapping.files)
    names = {name_of(one, mapping) for one in found}
    stray = next((one.log for one in mapping.trial if one.log is not None and one.log not in names), None)
    if stray is not None and here.is_dir():
        raise DataError(f"{here}: trial.log is '{stray}'; the recordings here are {', '.join(sorted(names)[:8])}")
    return found


def name_of(source: Path, mapping: Mapping) -> str:
    """The name of a recording, and of its trial where it is one."""
    if mapping.files is None:
        return source.stem
    if source.is_dir():
        return source.resolve().name
    return _named(source, mapping.files.pattern) or source.stem


def folder_of(source: Path, mapping: Mapping) -> Path:
    """The folder from which the files of a recording are named."""
    if source.is_dir() or mapping.files is None:
        return source
    return source.resolve().parents[mapping.files.pattern.count("/")]


def pieces(source: Path, mapping: Mapping, pattern: str) -> list[Path]:
    """The files of a recording that match a pattern from its folder, sorted by name.

    Raises:
        DataError: there is none.
    """
    folder, name = folder_of(source, mapping), name_of(source, mapping)
    found = sorted(one for one in folder.glob(pattern.replace(_TRIAL, glob.escape(name))) if one.is_file())
    if not found:
        raise DataError(f"{folder}: no file {pattern.replace(_TRIAL, name)}; it is named in the mapping")
    return found


def piece(source: Path, mapping: Mapping, pattern: str) -> Path:
    """The only file of a recording that matches a pattern.

    Raises:
        DataError: there is none, or more than one.
    """
    found = pieces(source, mapping, pattern)
    if len(found) > 1:
        named = ", ".join(one.name for one in found[:4])
        raise DataError(f"{folder_of(source, mapping)}: {len(found)} files '{pattern}': {named}; name one, or {_TRIAL}")
    return found[0]


def _tables(folder: Path) -> list[Path]:
    files = sorted(f for f in folder.rglob("*") if f.is_file() and not f.name.startswith((".", "~$")))
    for suffixes in SUFFIXES:
        found = [f for f in files if f.suffix.lower() in suffixes]
        if found:
            return found
    listed = ", ".join(f"*{suffix}" for suffixes in SUFFIXES for suffix in suffixes)
    raise DataError(f"{folder}: no table ({listed}) in this folder or below; is format csv right?")


def _joined(here: Path, files: Files) -> list[Path]:
    """Recordings of several files: a folder, or the first of its files where the name of the trial is in theirs."""
    depth = files.pattern.count("/")
    some = sorted(f for f in here.rglob("*") if f.is_file()) if here.is_dir() else [here]
    found: dict[tuple[Path, str], Path] = {}
    for file in some:
        name = _named(file, files.pattern)
        if name is None or (here.is_dir() and len(file.relative_to(here).parts) <= depth):
            continue
        folder = file.parents[depth]
        found.setdefault((folder, name), file if _TRIAL in files.pattern else folder)
    if not found:
        raise DataError(f"{here}: no file '{files.pattern}' in this folder or below; see files.pattern in the mapping")
    return list(found.values())


def _named(file: Path, pattern: str) -> str | None:
    """The name of the trial whose file this is, empty for that of its folder; None for another file."""
    form = "/".join(_component(part) for part in pattern.split("/"))
    first, *again = form.split(_GROUP)
    form = first + (_GROUP + "(?P=trial)".join(again) if again else "")
    depth = pattern.count("/")
    tail = "/".join(file.resolve().parts[-depth - 1 :])
    found = re.fullmatch(form, tail)
    return None if found is None else found.groupdict().get("trial", "")


def _component(pattern: str) -> str:
    """One name of a pattern as a regular expression.

    What follows a star, up to the next, is of one length: its first place is as good as any later one, and is not
    tried again, so that many stars take no longer than a few.
    """
    parts = [""]
    for part in re.split(r"(\{trial\}|\*|\?|\[[^]/]*\])", pattern):
        if part == "*":
            parts.append("")
        elif part == _TRIAL:
            parts[-1] += _GROUP
        elif part.startswith("[") and part.endswith("]"):
            parts[-1] += "(?!/)" + fnmatch.translate(part)[4:-3]
        else:
            parts[-1] += "[^/]" if part == "?" else re.escape(part)
    first, *rest = parts
    if not rest:
        return first
    middle = (f"[^/]*{one}" if _GROUP in one else f"(?>[^/]*?{one})" for one in rest[:-1] if one)
    return f"{first}{''.join(middle)}[^/]*{rest[-1]}"
