"""Foreign logs to trial files.

A format is a module with `read(path) -> Trial` and a line in `FORMATS`, which imports and studies share; `csv` is read
by a mapping file, `nmea` may have one that says where the instruments are, `mcap` and `rosbag2` one that says which
topics are what.  Everything is read before anything is written, so that a file that fails leaves nothing behind.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from ...core.parameters import unknown
from .. import DataError, Trial
from ..robot import files as robot_files
from ..sidecar import plain_meta, said_by, sidecar_path
from ..table import existing, lines_of
from ..trialfile import FOREIGN, read_trial, write_trial
from . import frt_esso, nmea_log, nmea_trial, robot_log, simman, usv_asw
from .mapping import read as read_by_mapping
from .mapping import read_mapping

Reader = Callable[[Path], Trial]


@dataclass(frozen=True)
class Format:
    """A format of logs.

    Attributes:
        suffixes: of its files; none where a recording is a folder.
        read: reader where the columns are known; None where only a mapping file tells them.
        mapped: reader by a mapping file; None where there is nothing to map.
    """

    suffixes: tuple[str, ...]
    read: Reader | None
    mapped: Callable[[Path], Reader] | None = None


def _by_columns(mapping: Path) -> Reader:
    table = read_mapping(mapping)
    return lambda path: read_by_mapping(path, table)


def _by_instruments(mapping: Path) -> Reader:
    aboard = nmea_trial.read_aboard(mapping)
    return lambda path: nmea_trial.read(path, aboard)


def _by_topics(mapping: Path) -> Reader:
    from .robot_schema import read_topics

    topics = read_topics(mapping)
    return lambda path: robot_log.read(path, topics)


FORMATS: Mapping[str, Format] = MappingProxyType({
    "frt-esso": Format((frt_esso.SUFFIX,), frt_esso.read),
    "simman": Format((simman.SUFFIX,), simman.read),
    "usv-asw": Format((usv_asw.SUFFIX,), usv_asw.read),
    "nmea": Format((nmea_log.SUFFIX,), nmea_trial.read, _by_instruments),
    "mcap": Format((robot_files.SUFFIX,), robot_log.read, _by_topics),
    "rosbag2": Format((), robot_log.read, _by_topics),
    "csv": Format((".csv", ".dat"), None, _by_columns),
})  # fmt: skip
"""What can be read besides trial files, by the names of `seatrial import` and of a study's ``data.format``."""

_OF_THE_IMPORT = frozenset({"processing", "lines", "epoch_utc"})
_OF_THE_LOG = frozenset({"start", "datum", "frames"})
"""Keys of a sidecar that each import says anew, and those that another recording does."""


def import_log(
    format: str, src: str | Path, out: str | Path, mapping: str | Path | None = None
) -> list[Path]:
    """Read a foreign log, or a folder of them, and write ``out/<stem>.csv`` and ``.yaml`` for each.

    What a person added to a sidecar that is there already stays in it.

    Args:
        format: one of `FORMATS`.
        src: a file, or a folder whose files (of the format's suffix, also in its folders) are read; for rosbag2 the
            folder of a bag, or one of such folders.
        out: folder for the trial files; made if it is not there.
        mapping: mapping file, for the format csv, and where it helps for nmea, mcap and rosbag2.

    Returns:
        The CSV files written, in the order read.

    Raises:
        DataError: an unknown format, no mapping for csv, a log that cannot be read, or a sidecar there that says
            something else than the log; then nothing has been written.
    """
    read = reader(format, mapping)
    files = recordings(format, Path(src))
    folder = Path(out)
    taken: dict[str, Path] = {}
    for file in files:
        target = folder / f"{file.stem}.csv"
        if target.stem in taken:
            raise DataError(f"{file}: a second recording called {file.stem}, after {taken[file.stem]}")
        if target.resolve() == file.resolve():
            raise DataError(f"{file}: would be written over; choose another folder with -o")
        taken[file.stem] = file
    trials = [_keeping(folder / f"{file.stem}.csv", read(file)) for file in files]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"{folder}: not a folder that can be made: {error.strerror}") from error
    written = [folder / f"{trial.name}.csv" for trial in trials]
    for trial, path in zip(trials, written, strict=True):
        write_trial(trial, path)
    return written


def _keeping(path: Path, trial: Trial) -> Trial:
    """The trial with what the sidecar of an earlier import says beyond it: set points, kind, notes that a person added.

    Raises:
        DataError: the two disagree, or another recording is there; which is right, only a person knows.
    """
    if not sidecar_path(path).exists():
        return trial
    before, now = said_by(path), plain_meta(path, trial.meta)
    same = _same_recording(path, trial)
    anew = _OF_THE_IMPORT if same else _OF_THE_IMPORT | _OF_THE_LOG
    added = {key: value for key, value in before.items() if key not in now and key not in anew}
    for key in sorted(set(before) & set(now) - anew):
        if before[key] != now[key]:
            about = f"{before[key]!r:.60}, by this import it would be {now[key]!r:.60}"
            raise DataError(f"{sidecar_path(path)}: {key} is {about}; take it out there, or choose another folder (-o)")
    if added and not same:
        about = f"says {', '.join(added)} of another recording called {path.stem}"
        raise DataError(f"{sidecar_path(path)}: {about}; remove it, or choose another folder (-o)")
    if not added:
        return trial
    return replace(trial, meta={**trial.meta, **added}).noting(f"kept from the sidecar: {', '.join(added)}")


def _same_recording(path: Path, trial: Trial) -> bool:
    """Whether a trial file holds the same recording, or a part of it: some channel that moves is the same there."""
    if not path.exists():
        return True  # a sidecar written beforehand
    try:
        there = read_trial(path)
    except DataError:
        return True  # what is damaged, or of an older version, is written anew
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


def read_log(path: str | Path) -> Trial:
    """Read a trial file, or a foreign log that is recognised by its head."""
    format = recognised(existing(path))
    return reader(format, None)(Path(path)) if format else read_trial(path)


def read_logs(paths: Iterable[str | Path]) -> tuple[Trial, ...]:
    """Read trial files and recognised foreign logs, in the order given."""
    return tuple(read_log(path) for path in paths)


def reader(format: str, mapping: str | Path | None) -> Reader:
    """The reader of a format, by a mapping file where one is given.

    Raises:
        DataError: an unknown format, a mapping file that it does not take, or none where it needs one.
    """
    if format not in FORMATS:
        raise DataError(unknown(format, FORMATS, "format"))
    known = FORMATS[format]
    if mapping is None:
        if known.read is None:
            raise DataError(f"format {format} needs a mapping file that says which column is which channel")
        return known.read
    if known.mapped is None:
        raise DataError(f"format {format} takes no mapping file; its columns are known")
    return known.mapped(Path(mapping))


def recordings(format: str, src: str | Path) -> list[Path]:
    """The recordings of a format at `src`, itself one or a folder of them, whose folders are searched too.

    Raises:
        DataError: there is nothing, or nothing of this format.
    """
    here = existing(src)
    suffixes = FORMATS[format].suffixes
    if not suffixes:
        found = sorted(file.parent for file in here.rglob(robot_files.BAG)) if here.is_dir() else []
        if not found:
            raise DataError(f"{here}: no bag of ROS 2; give its folder, the one with {robot_files.BAG} in it")
        return found
    if not here.is_dir():
        return [here]
    found = sorted(f for f in here.rglob("*") if f.suffix.lower() in suffixes and f.is_file())
    if not found:
        listed = " or ".join(f"*{suffix}" for suffix in suffixes)
        raise DataError(f"{here}: no file {listed} in this folder or below; is format {format} right?")
    return found
