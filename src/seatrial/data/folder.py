"""All recordings below a folder, whatever its subfolders: trial files, or logs of one format."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..core.parameters import unknown
from ..core.values import dataclass, field, replace
from . import DataError, Trial
from .check import Finding, check_set
from .formats import formats, known_by_suffix, reader, recordings
from .importing import recognised
from .table import existing
from .trialfile import SUFFIXES, read_trial

_FOREIGN = (".dat",)


@dataclass(frozen=True)
class Folder:
    """The recordings of a folder.

    Attributes:
        root: the folder.
        format: of its logs; empty for trial files.
        files: of the recordings, by their names: their places below the root, without suffix.
        trials: as they were read, by the same names.
        unread: why, of the recordings that could not be read.
    """

    root: Path
    format: str
    files: Mapping[str, Path]
    trials: Mapping[str, Trial]
    unread: Mapping[str, str] = field(default_factory=dict[str, str])


def read_folder(folder: str | Path, format: str | None = None, mapping: str | Path | None = None) -> Folder:
    """Read every recording below a folder.

    Args:
        folder: searched with its subfolders.
        format: of the logs; None takes trial files, or logs that their first line tells.
        mapping: a mapping file for `format`.

    Raises:
        DataError: no folder, nothing in it, files of several formats, a wrong mapping file, or no recording that can be
            read.
    """
    root = existing(folder)
    if not root.is_dir():
        raise DataError(f"{root}: is a file; name the folder it is in")
    if format is None:
        if mapping is not None:
            raise DataError(f"{mapping}: a mapping is of no use without a format; add --format csv")
        format, paths = _told(root)
    else:
        if format not in formats():
            raise DataError(unknown(format, formats(), "format"))
        paths = recordings(format, root, mapping)
    read = reader(format, mapping) if format else read_trial
    files: dict[str, Path] = {}
    for path in paths:
        # a recording that is a folder has no suffix to take off
        place = path.relative_to(root)
        name = (place if path.is_dir() else place.with_suffix("")).as_posix()
        if name in files:
            raise DataError(f"{path}: a second recording of this name, after {files[name]}; rename one")
        files[name] = path
    trials: dict[str, Trial] = {}
    unread: dict[str, str] = {}
    for name, path in files.items():
        try:
            trials[name] = replace(read(path), name=name)
        except DataError as error:
            unread[name] = str(error)
    if not trials:
        raise DataError(next(iter(unread.values())))
    return Folder(root, format, files, trials, unread)


def overlaps(trials: Mapping[str, Trial]) -> tuple[Finding, ...]:
    """Pairs of recordings of which one holds rows of the other."""
    some = tuple(trials.values())
    seen: set[frozenset[str]] = set()
    found: list[Finding] = []
    for one in check_set(some, some):
        pair = frozenset(one.trials)
        if len(pair) == 2 and pair not in seen:
            seen.add(pair)
            found.append(replace(one, what="two trials share a recording"))
    return tuple(found)


def _told(root: Path) -> tuple[str, list[Path]]:
    """The one format of all files below the root, and these."""
    suffixes = (*SUFFIXES, *_FOREIGN)
    paths = sorted(f for f in root.rglob("*") if f.is_file() and f.suffix.lower() in suffixes and f.name[0] != ".")
    if not paths:
        raise DataError(f"{root}: no trial file ({', '.join(SUFFIXES)}) in this folder or below; "
                        f"{known_by_suffix(root) or 'import the logs first, or name their --format'}")  # fmt: skip
    by = {path: recognised(path) or "" for path in paths}
    known = sorted(set(by.values()))
    if len(known) > 1:
        first = {one: next(path for path in paths if by[path] == one) for one in known}
        listed = " and ".join(f"{first[one].name} ({one or 'trial file'})" for one in known)
        raise DataError(f"{root}: holds files of several formats: {listed}; name one with --format")
    return known[0], paths
