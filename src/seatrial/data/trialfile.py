"""Trial files, `manoeuvre-trial/1`: a table with units in its header and a sidecar that describes it.

CSV has one header line ``t [s],x [m],...``; a gap is an empty cell; numbers are written so that they
read back exactly.  Parquet has bare names; the units are a JSON object under the key
``seatrial.units`` of the file's metadata (Polars writes no metadata of single fields).  The sidecar,
a YAML file of the same stem, holds the same keys for both.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, cast

import numpy as np

from ..core.files import is_plain, read_toml, write_together
from ..core.kinds import described
from . import UNITS, Array, DataError, Trial
from .inside import parquet, read_frame
from .sidecar import read_sidecar, sidecar_path, sidecar_text
from .table import check_time, continued, existing, lines_of, numbers, split_row, within
from .units import conversion

SUFFIXES = (".csv", ".parquet")
_HEADER = re.compile(r"^(?P<name>[A-Za-z]\w*)\s*(?:\[(?P<unit>[^\]]*)\])?$")
_UNITS_KEY = "seatrial.units"
PART = "unfinished.json"
"""File of a folder of which not all trials are there; names those that were new."""

# First columns of foreign logs that look like trial files, and the format that reads them.
FOREIGN: Mapping[str, str] = MappingProxyType({"x_position_mid [m]": "frt-esso"})


def read_trial(path: str | Path) -> Trial:
    """Read one trial file with its sidecar; without a sidecar the conventions of the format hold.

    Standard channels in other units (deg, kn, rpm) come out in SI.

    Raises:
        DataError: naming file, column and line of what is wrong, or a folder whose trials are not all there.
    """
    here = existing(path)
    refuse_part(here.parent)
    return read_alone(here)


def read_alone(here: Path) -> Trial:
    """The same whatever its folder is."""
    if here.suffix.lower() not in SUFFIXES:
        raise DataError(f"{here}: a trial file ends in .csv or .parquet; {_importing(here)}")
    units, table, lines = _read_parquet(here) if here.suffix.lower() == ".parquet" else _read_csv(here)
    return _assemble(here, units, table, lines)


def read_trials(paths: str | Path | Iterable[str | Path]) -> tuple[Trial, ...]:
    """Read trial files and folders of them; a folder gives its files sorted by name.

    Raises:
        DataError: an empty folder, two trials of one name, or what `read_trial` raises.
    """
    given = [paths] if isinstance(paths, str | Path) else list(paths)
    files: dict[Path, None] = {}
    for path in given:
        here = existing(path)
        found = _files_in(here) if here.is_dir() else [here]
        files.update(dict.fromkeys(file.resolve() for file in found))
    stems: dict[str, Path] = {}
    for file in files:
        if file.stem in stems:
            raise DataError(f"{file}: a second trial of this name, after {stems[file.stem]}; rename one")
        stems[file.stem] = file
    return tuple(read_trial(file) for file in files)


def refuse_part(folder: Path) -> None:
    """Refuse a folder of which `write_trials` was ended before all of its trials were there; DataError says so."""
    if (folder / PART).exists():
        raise DataError(f"{folder}: a part of its trials, as what wrote them was ended; write them again "
                        f"(the same import), or remove {PART} to keep the part")  # fmt: skip


def write_trial(trial: Trial, path: str | Path) -> None:
    """Write a trial and its sidecar; either both new files are complete or the old ones stay.

    Raises:
        DataError: a suffix that is neither .csv nor .parquet, a channel without a usable unit, a
            value that cannot be written, a folder that is not there.
    """
    here = Path(path)
    if here.suffix.lower() not in SUFFIXES:
        raise DataError(f"{here}: a trial file ends in .csv or .parquet")
    if not here.parent.is_dir():
        raise DataError(f"{here}: no folder {here.parent}; make it first")
    _write(_files_of(trial, here))


def write_trials(trials: Iterable[Trial], folder: Path) -> list[Path]:
    """Write ``folder/<name>.csv`` and its sidecar for each trial, all of them or none.

    While files take their places, which takes milliseconds, `PART` names them: where the process is killed just then,
    it stays, no reader takes the part for the whole, and the next call removes what it does not write itself.

    Raises:
        DataError: as of `write_trial`.
    """
    made = {folder / f"{trial.name}.csv": trial for trial in trials}
    mark = folder / PART
    left = _left(mark) - {path.name for path in made}
    files = {name: content for path, trial in made.items() for name, content in _files_of(trial, path).items()}
    fresh = json.dumps(sorted({path.name for path in made if not path.exists()} | left))
    _write({mark: fresh, **files})
    for name in left:
        (folder / name).unlink(missing_ok=True)
        sidecar_path(folder / name).unlink(missing_ok=True)
    mark.unlink()
    return list(made)


def _left(mark: Path) -> set[str]:
    """Trial files that a process had begun to add to a folder before it was ended."""
    try:
        found: Any = json.loads(mark.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return set()
    return {str(name) for name in found if is_plain(str(name))} if isinstance(found, list) else set()


def _files_of(trial: Trial, here: Path) -> dict[Path, Any]:
    """The sidecar and the table of a trial, to be written."""
    _check_writable(here, trial)
    table = _parquet(trial) if here.suffix.lower() == ".parquet" else _csv(trial)
    return {sidecar_path(here): sidecar_text(here, trial.meta), here: table}


def _write(files: Mapping[Path, Any]) -> None:
    try:
        write_together(files)
    except OSError as error:
        raise DataError(f"{error.filename}: cannot be written: {error.strerror}") from error


def _files_in(folder: Path) -> list[Path]:
    found = sorted(f for f in folder.iterdir() if f.suffix.lower() in SUFFIXES and not f.name.startswith("."))
    if not found:
        raise DataError(f"{folder}: no trial file (*.csv, *.parquet) in this folder; {_importing(folder)}")
    return found


def _importing(src: Path) -> str:
    """How logs at `src` become trial files."""
    from .formats import known_by_suffix  # whose formats write trial files

    if src.suffix.lower() == ".toml" and (said := described(src, _schema(src))):
        return f"this one {said}"
    folder = src if src.is_dir() else src.parent
    guessed = f"logs are imported first: seatrial import --guess {folder} -o mapping.toml"
    return known_by_suffix(src) or guessed


def _schema(path: Path) -> object:
    """The key `schema` of a TOML file; None of one that cannot be read."""
    try:
        return read_toml(path).get("schema")
    except (OSError, ValueError):
        return None


def _read_csv(path: Path) -> tuple[dict[str, str], Array, list[int]]:
    lines = lines_of(path)
    first = next(k for k, line in enumerate(lines) if line.strip())
    heads = split_row(lines[first], ",")
    foreign = next((FOREIGN[head] for head in heads if head in FOREIGN), None)
    if foreign:
        raise DataError(f"{path}: a log of format {foreign}; import it first: seatrial import {foreign}")
    if not _named(head for text in heads for head in re.split(r"[;\t]", text)):
        raise DataError(f"{path}: no trial file, whose first line has columns such as 't [s],x [m]'; logs are "
                        f"imported first: seatrial import --guess {path} -o mapping.toml")  # fmt: skip
    if len(heads) == 1 and re.search(r"[;\t]", heads[0]):
        raise DataError(f"{path}: line {first + 1}: columns must be separated by commas")
    units: dict[str, str] = {}
    for head in heads:
        name, unit = _header(path, first + 1, head)
        if name in units:
            raise DataError(f"{path}: column '{name}', line {first + 1}: named twice; keep one")
        units[name] = unit
    table, numbered = numbers(path, lines, first + 1, list(units), ",")
    return units, table, numbered


def _named(heads: Iterable[str]) -> bool:
    """Whether one of the columns has the name of a channel, as those of a trial file with a fault have."""
    return any(re.split(r"[\s\[]", head.strip())[0] in UNITS for head in heads)  # time is one of them


def _header(path: Path, line: int, head: str) -> tuple[str, str]:
    match = _HEADER.match(head)
    if match is None:
        raise DataError(f"{path}: column '{head}', line {line}: write 'name [unit]', such as 'psi [rad]'")
    name, unit = match["name"], (match["unit"] or "").strip()
    if not unit:
        wanted = UNITS.get(name, "unit, or - for none")
        raise DataError(f"{path}: column '{name}', line {line}: no unit; write '{name} [{wanted}]'")
    return name, unit


def _read_parquet(path: Path) -> tuple[dict[str, str], Array, list[int]]:
    import polars as pl

    with parquet(path):
        units: Any = json.loads(pl.read_parquet_metadata(path).get(_UNITS_KEY, "{}"))
        schema = pl.read_parquet_schema(path)
    if not isinstance(units, dict) or not all(isinstance(u, str) for u in cast("dict[Any, Any]", units).values()):
        raise DataError(f"{path}: '{_UNITS_KEY}' of its metadata must be a JSON object of texts, one a column")
    named = cast("dict[str, str]", units)
    for name, kind in schema.items():
        if not kind.is_numeric():
            raise DataError(f"{path}: column '{name}': holds {kind}, not numbers")
        if name not in named:
            raise DataError(f"{path}: column '{name}': no unit; Parquet trials hold units as JSON under '{_UNITS_KEY}'")
    frame = read_frame(path)
    table = np.column_stack([frame[name].cast(pl.Float64).to_numpy() for name in frame.columns])
    infinite = np.argwhere(np.isinf(table))
    if infinite.size:
        row, column = infinite[0].tolist()
        raise DataError(f"{path}: column '{frame.columns[column]}', row {row + 1}: infinite; leave it empty for a gap")
    return {name: named[name] for name in frame.columns}, table, list(range(1, len(table) + 1))


def _assemble(path: Path, units: Mapping[str, str], table: Array, lines: list[int]) -> Trial:
    names = list(units)
    if "t" not in units:
        raise DataError(f"{path}: no column 't [s]'; the columns are {', '.join(names)}")
    table, padded = continued(table, names.index("t"))
    channels: dict[str, Array] = {}
    kept: dict[str, str] = {}
    for k, name in enumerate(names):
        with within(f"{path}: line 1"):
            unit, factor = conversion(name, units[name])
        # a factor of one must leave every bit as it is
        channels[name] = table[:, k].copy() if factor == 1.0 else table[:, k] * factor
        if name not in UNITS:
            kept[name] = unit
    t = channels.pop("t")
    check_time(path, "t", t, lines)
    trial = Trial(path.stem, t, channels, kept, read_sidecar(path), path)
    if trial.meta.get("delta_positive") == "port_turn":
        trial = _starboard_positive(trial)
    return trial.noting(*padded)


def _starboard_positive(trial: Trial) -> Trial:
    flipped = {n: -v for n, v in trial.channels.items() if re.fullmatch(r"delta(_\d+)?(_cmd)?", n)}
    out = trial.having(**flipped).noting("rudder sign turned: positive to starboard")
    return replace(out, meta={**out.meta, "delta_positive": "starboard_turn"})


def _check_writable(path: Path, trial: Trial) -> None:
    check_time(path, "t", trial.t, list(range(2, len(trial) + 2)))
    for name, values in trial.channels.items():
        if not _HEADER.fullmatch(name) or name == "t":
            raise DataError(f"{path}: channel '{name}': a name is letters, digits and underscores")
        with within(path):
            unit, factor = conversion(name, trial.unit(name))
        if factor != 1.0:
            raise DataError(f"{path}: channel '{name}' is in {trial.unit(name)}; a trial holds it in {unit}")
        if np.isinf(values).any():
            raise DataError(f"{path}: channel '{name}' holds infinite values; a gap is NaN")


def _csv(trial: Trial) -> Callable[[str], None]:
    """Saving of the table as CSV, to the path it is given."""
    import polars as pl

    names = ["t", *trial.channels]
    head = ",".join(f"{name} [{trial.unit(name)}]" for name in names)

    def save(path: str) -> None:
        # the shortest text of each number that reads back to the same bits; NaN becomes null, which is an empty cell
        frame = pl.DataFrame([pl.Series(name, trial[name], nan_to_null=True) for name in names])
        with open(path, "wb") as stream:
            stream.write(f"{head}\n".encode())
            frame.write_csv(stream, include_header=False)

    return save


def _parquet(trial: Trial) -> bytes:
    import polars as pl

    names = ["t", *trial.channels]
    data: dict[str, Any] = {name: np.ascontiguousarray(trial[name]) for name in names}
    units = json.dumps({name: trial.unit(name) for name in names})
    held = io.BytesIO()
    pl.DataFrame(data).write_parquet(held, metadata={_UNITS_KEY: units})
    return held.getvalue()
