"""Import of foreign logs to trial files, and reading of foreign logs recognised by their first line.

All logs are read before any trial is written, so a log that fails leaves no files.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from . import DataError, Trial
from .formats import logs
from .found import told
from .prepare import marked, unsaid
from .sidecar import plain_meta, said_by, sidecar_path
from .table import lines_of
from .trialfile import FOREIGN, read_alone, write_trials

_OF_THE_IMPORT = frozenset({"processing", "lines", "sources", "missing", "ignored", "epoch_utc"})
_OF_THE_LOG = frozenset({"start", "datum", "frames"})
"""Keys of a sidecar that each import rewrites, and those that another recording rewrites."""


def import_log(format: str, src: str | Path, out: str | Path, mapping: str | Path | None = None) -> list[Path]:
    """Read a foreign log, or a folder of them, and write ``out/<name>.csv`` and ``.yaml`` for each of its trials.

    Keys that a user added to an existing sidecar are kept.

    Args:
        format: one of `formats.formats()`.
        src: a file, or a folder whose files (of the format's suffix, also in its folders) are read; for rosbag2 the
            folder of a bag, or one of such folders.
        out: folder for the trial files; made if it is not there.
        mapping: mapping file; required for csv, optional for logs of instruments: nmea, mcap, rosbag1 and others.

    Returns:
        The CSV files written, in the order read.

    Raises:
        DataError: an unknown format, no mapping for csv, a log that cannot be read, or an existing sidecar
            that contradicts the log; then nothing has been written.
    """
    folder = Path(out)
    taken: dict[str, Path] = {}
    trials: list[Trial] = []
    for file, found in logs(format, Path(src), mapping):
        for trial in found:
            target = folder / f"{trial.name}.csv"
            if trial.name in taken:
                raise DataError(f"{file}: a second recording called {trial.name}, after {taken[trial.name]}")
            if target.resolve() == file.resolve() or (file.is_dir() and _foreign(target, file)):
                raise DataError(f"{target}: a log would be written over; choose another folder with -o")
            taken[trial.name] = file
            trials.append(_keeping(target, told(_told_apart(trial))))
    if not trials:
        raise DataError(f"{src}: no trial; the mapping cuts all of them out of other logs")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"{folder}: not a folder that can be made: {error.strerror}") from error
    return write_trials(trials, folder)


def _told_apart(trial: Trial) -> Trial:
    """The trial with channels marked that its logger has made from others."""
    found = tuple(unsaid(trial))
    made = marked(trial, {one.name: one.source for one in found})
    return made.noting(*(f"{one.name} is {one.words}: marked as derived, no measurement" for one in found))


def _foreign(target: Path, folder: Path) -> bool:
    """Whether a trial file to be written is there, is none of ours, and lies in the folder of a recording."""
    return target.exists() and not sidecar_path(target).exists() and folder.resolve() in target.resolve().parents


def _keeping(path: Path, trial: Trial) -> Trial:
    """The trial with the keys that a user added to the sidecar of an earlier import: set points, kind, notes.

    Raises:
        DataError: the two disagree, or the file there is another recording; the user has to decide.
    """
    if not sidecar_path(path).exists():
        return trial
    before, now = said_by(path), plain_meta(path, trial.meta)
    if all(now.get(key) == value for key, value in before.items() if key not in _OF_THE_IMPORT):
        return trial  # nothing was added, and the table need not be read
    same = _same_recording(path, trial)
    anew = _OF_THE_IMPORT if same else _OF_THE_IMPORT | _OF_THE_LOG
    added = {key: value for key, value in before.items() if key not in now and key not in anew}
    for key in sorted(set(before) & set(now) - anew):
        if before[key] != now[key]:
            about = f"{before[key]!r:.60}, by this import it would be {now[key]!r:.60}"
            raise DataError(f"{sidecar_path(path)}: {key} is {about}; take it out there, or choose another folder (-o)")
    if added and not same:
        about = f"has {', '.join(added)} of another recording called {path.stem}"
        raise DataError(f"{sidecar_path(path)}: {about}; remove it, or choose another folder (-o)")
    if not added:
        return trial
    return replace(trial, meta={**trial.meta, **added}).noting(f"kept from the sidecar: {', '.join(added)}")


def _same_recording(path: Path, trial: Trial) -> bool:
    """Whether a trial file holds the same recording or a part of it: a channel that varies has the same values."""
    if not path.exists():
        return True  # a sidecar written in advance
    try:
        there = read_alone(path)
    except DataError:
        return True  # a damaged file, or one of an older version, is rewritten
    rows = slice(0, min(len(there), len(trial)))
    pairs = ((there[name][rows], trial[name][rows]) for name in trial.channels if name in there)
    return any(np.array_equal(a, b, equal_nan=True) and np.unique(a[np.isfinite(a)]).size > 1 for a, b in pairs)


def recognised(path: str | Path) -> str | None:
    """Format of a foreign log that needs no mapping; None for a trial file or an unknown one."""
    here = Path(path)
    if here.suffix.lower() not in (".csv", ".dat"):
        return None
    first = lines_of(here, "latin-1")[0]
    if here.suffix.lower() == ".dat":
        return "simman" if first.strip().startswith(("HSVA", "MARIN")) else None
    return next((name for head, name in FOREIGN.items() if head in first), None)
