"""The table [data] of a study: files to trials of training, validation and test, from one folder or several sets.

A set of another scale is brought to the scale of the ship only where it says so.  A file of sets names compositions
of a data set that several studies refer to: ``"@TZRB"`` is every recording of the composition TZRB, ``"@TZRB.R"`` its
random manoeuvres.  [data.smoother] estimates motion from raw positions and headings before anything is fitted.
"""

from __future__ import annotations

import difflib
import fnmatch
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from ..core.parameters import Free, ParameterError, read, specs, unknown
from ..core.records import Limits, read_record
from ..core.values import dataclass, fields, replace
from ..data import DataError, Trial
from ..data.check.track import own_samples
from ..data.documents import read_toml
from ..data.formats import logs, reader, recordings
from ..data.prepare import drop_trailing_gaps, froude_scaled
from ..data.trialfile import SUFFIXES, read_trial
from ..identify import StudyError
from ..models import STATES
from ..ships import Ship, ShipError
from .assumed import with_assumed
from .schema import DataSetTable

if TYPE_CHECKING:
    from ..identify.filters.filtering import Kalman

DATA = "SEATRIAL_DATA"
"""Variable that names the folder of the public data sets; unset, it is ../shared/data beside the
root of the repository (a folder with a pyproject.toml) that holds the study, or the working folder."""

_KINDS = ("test", "validation", "train")

Split = tuple[tuple[Trial, ...], tuple[Trial, ...], tuple[Trial, ...]]
"""Trials of training, validation and test."""


def read_data(path: Path, data: Any, ship: Ship) -> Split:
    """Trials of training, validation and test; test has precedence over validation, and validation over training.

    Args:
        path: the study file; folders are relative to it, and errors begin with it.
        data: its table [data], checked: one folder with its lists, or `set`, several of those.
        ship: the ship whose scale ``scale_to = "ship"`` means.

    Raises:
        StudyError, DataError: naming file and key, or trial, and what would be right.
    """
    sets: Sequence[Any] = data.set
    if not sets:
        if not data.train:
            raise StudyError(f"{path}: data.train is missing")
        found = _one(path, "data", data, ship)
    else:
        usual = DataSetTable()
        alone = [one.name for one in fields(usual) if getattr(data, one.name) != getattr(usual, one.name)]
        if alone:
            raise StudyError(f"{path}: data.{alone[0]} stands beside [[data.set]]; write it in each set")
        parts = [_one(path, f"data.set {k}", one, ship) for k, one in enumerate(sets, start=1)]
        found = tuple(tuple(t for part in parts for t in part[k]) for k in range(3))
    if not found[2]:
        raise StudyError(f"{path}: data.train: nothing is left to train on")
    return found[2], found[1], found[0]


def read_raw(path: Path, data: Any, ship: Ship) -> tuple[tuple[Any, Trial], ...]:
    """The table and the raw trial, for every trial of test and validation of a set that has a smoother."""
    found: list[tuple[Any, Trial]] = []
    for one in data.set or (data,):
        if one.smoother is not None:
            test, validation, _ = _one(path, "data", replace(one, smoother=None, train=[]), ship)
            found += [(one.smoother, trial) for trial in (*validation, *test)]
    return tuple(found)


def chosen(path: Path, key: str, patterns: Sequence[str], names: Iterable[str]) -> list[str]:
    """Names that match the patterns of `key`, in the order of the patterns; each pattern must match one."""
    every = list(names)
    found: dict[str, None] = {}
    for pattern in patterns:
        fits = [n for n in every if fnmatch.fnmatchcase(n, pattern) or pattern in (n.rpartition(".")[0], Path(n).stem)]
        if not fits:
            near = difflib.get_close_matches(pattern, every, n=3, cutoff=0.3) or every[:3]
            hint = f"near: {', '.join(near)}" if near else "there is none"
            raise StudyError(f"{path}: {key}: '{pattern}' fits no file; {hint}")
        found.update(dict.fromkeys(fits))
    return list(found)


def _one(path: Path, where: str, data: Any, ship: Ship) -> tuple[tuple[Trial, ...], ...]:
    """Test, validation and training of one folder; a name in two lists is refused, a pattern yields to test first."""
    root = _root(path, where, data.root)
    sets = read_compositions(path.parent / data.sets) if data.sets else {}
    one_each = _reader(path, where, data.format, data.mapping)
    names = _recordings(path, where, root, data.format, data.mapping)
    several = _several(path, where, root, data)
    if several:
        names = {name: Path(name) for name in several}

    def read(file: Path) -> Trial:
        return several[file.name] if several else one_each(file)

    lists = {key: expanded(f"{path}: {where}.{key}", getattr(data, key), sets) for key in (*_KINDS, "exclude")}
    taken = set(chosen(path, f"{where}.exclude", lists["exclude"], names))
    parts: list[tuple[Trial, ...]] = []
    held: dict[str, str] = {}
    for kind in _KINDS:
        found = [name for name in chosen(path, f"{where}.{kind}", lists[kind], names) if name not in taken]
        outright = [p for p in getattr(data, kind) if not (set(p) & set("*?[") or p.startswith(MARK))]
        plain = chosen(path, f"{where}.{kind}", outright, names)
        twice = [name for name in plain if name in held]
        if twice:
            raise StudyError(f"{path}: {where}.{kind}: {twice[0]} is in {held[twice[0]]} too; keep it in one")
        held |= dict.fromkeys(found, kind)
        taken |= set(found)
        parts.append(tuple(_prepared(path, where, read(names[name]), data, ship) for name in found))
    return tuple(parts)


def named_path(path: Path, where: str, name: str) -> Path:
    """A file or folder that the study at `path` names: variables expanded, relative to the study file.

    Raises:
        StudyError: a variable that is not set; `where` is the key.
    """
    around = (*path.resolve().parents, Path.cwd(), *Path.cwd().parents)
    home = next((p for p in around if (p / "pyproject.toml").exists()), path.resolve().parent)
    known = {DATA: str(home.parent / "shared" / "data"), **os.environ}
    for variable in re.findall(r"\$\{?(\w+)", name):
        if variable not in known:
            raise StudyError(f"{path}: {where}: the variable {variable} is not set")
    text = re.sub(r"\$(?:\{(\w+)\}|(\w+))", lambda m: known[m[1] or m[2]], name)
    return path.parent / Path(text).expanduser()


def _root(path: Path, where: str, root: str) -> Path:
    """Folder of the data."""
    found = named_path(path, f"{where}.root", root)
    if not found.is_dir():
        public = f"set {DATA} to the folder of the public data sets (README.md, Data, says where each can be had)"
        remedy = public if DATA in root else "make it, or name another; a root is relative to the folder of the file"
        raise StudyError(f"{path}: {where}.root: no folder {found}; {remedy}")
    return found


def _reader(path: Path, where: str, format: str | None, mapping: str | None) -> Callable[[Path], Trial]:
    if format is None:
        if mapping is not None:
            raise StudyError(f"{path}: {where}.mapping is of no use without a format; write format = \"csv\"")
        return read_trial
    if format == "csv" and mapping is None:
        raise StudyError(f"{path}: {where}.mapping is missing; the format csv needs it")
    try:
        return reader(format, None if mapping is None else path.parent / mapping)
    except DataError as error:
        raise StudyError(f"{path}: {where}.{'format' if mapping is None else 'mapping'}: {error}") from None


def _recordings(path: Path, where: str, root: Path, format: str | None, mapping: str | None) -> dict[str, Path]:
    """Recordings below the root, by their names in patterns."""
    if format is not None:  # one that there is, as its reader was found
        try:
            found = recordings(format, root, None if mapping is None else path.parent / mapping)
        except DataError as error:
            raise StudyError(f"{path}: {where}.root: {error}") from None
    else:
        found = sorted(f for f in root.rglob("*") if f.is_file() and f.suffix.lower() in SUFFIXES)
    if not found:
        raise StudyError(f"{path}: {where}.root: {root} holds no trial file ({', '.join(SUFFIXES)}); set a format")
    return {f.relative_to(root).as_posix() if f != root else root.resolve().name: f for f in found}


def _several(path: Path, where: str, root: Path, data: Any) -> dict[str, Trial]:
    """Trials by name where a mapping cuts the recordings into several; else none."""
    if data.mapping is None:
        return {}
    mapping = path.parent / data.mapping
    said = read_toml(mapping)
    if not any(key in said for key in ("trial", "split")):
        return {}
    found: dict[str, Trial] = {}
    for _, trials in logs(data.format, root, mapping):
        for trial in trials:
            if trial.name in found:
                raise StudyError(f"{path}: {where}.mapping: two trials are called {trial.name}; name them apart")
            found[trial.name] = trial
    return found


def _prepared(path: Path, where: str, trial: Trial, data: Any, ship: Ship) -> Trial:
    """The trial without its empty end, at the scale of the ship and with smoothed motion where the set asks for it."""
    trial = drop_trailing_gaps(trial)
    # a state that was not recorded is a gap in every row
    trial = trial.having(**{name: np.full(len(trial), np.nan) for name in STATES if name not in trial})
    if data.scale_to is not None:
        trial = _scaled(path, where, trial, ship)
    try:
        trial = with_assumed(trial, data.assumed, ship)
    except (StudyError, ShipError) as error:
        raise StudyError(f"{path}: {where}.assumed: {error}") from None
    if data.smoother is None:
        return trial
    try:
        return smoothed(data.smoother, ship, trial)
    except (StudyError, ParameterError) as error:
        raise StudyError(f"{path}: {where}.smoother: {error}") from None


def _scaled(path: Path, where: str, whole: Trial, ship: Ship) -> Trial:
    """The trial at the scale of the ship, by Froude's law."""
    length = whole.meta.get("L_pp")
    if isinstance(length, bool) or not isinstance(length, int | float) or not length > 0:
        raise StudyError(
            f"{path}: {where}.scale_to: {whole.name} does not say of what length its ship is; give L_pp in its sidecar"
        )
    scaled = froude_scaled(whole, ship.L_pp / length)
    lost = [name for name in whole.channels if name not in scaled]
    if lost:
        scaled = scaled.noting(f"left out, as the density of the water would scale them too: {', '.join(lost)}")
    recorded = f"recorded as of {whole.meta.get('ship', 'a ship')}, L_pp {length:g} m"
    # From here on it is a trial of the study's ship; what it was is in its processing.
    renamed = replace(scaled, meta={**scaled.meta, "ship": ship.name})
    return renamed.noting(f"taken as a trial of {ship.name}, L_pp {ship.L_pp:g} m; {recorded}")


SCHEMA = "seatrial-sets/1"
"""The first key of a file of sets."""
MARK = "@"
"""Begins a reference to a set in place of a file's name."""


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


@dataclass(frozen=True)
class _Sets:
    """A file of sets: recordings by the letter of their kind, set by set, and where they are from."""

    sets: Annotated[Mapping[str, Annotated[Mapping[str, tuple[str, ...]], Limits(entries=1)]], Limits(entries=1)]
    source: Any = None


def read_compositions(path: str | Path) -> dict[str, Composition]:
    """Read a file of sets.

    Raises:
        DataError: as `read_record`, or a recording named twice in one set.
    """
    here = Path(path)
    found = read_record(here, _Sets, SCHEMA, DataError)
    for name, parts in found.sets.items():
        kinds: dict[str, str] = {}
        for kind, one in ((kind, one) for kind, names in parts.items() for one in names):
            if one in kinds:
                raise DataError(f"{here}: sets.{name}.{kind}: {one} is in {kinds[one]} already; name it once")
            kinds[one] = kind
    return {name: Composition(name, parts) for name, parts in found.sets.items()}


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


_CURRENT = ("U_C", "gamma_C")
# Window of the innovation test [s]; the usual 2 L/U depends on a length that may be assumed.
_WINDOW = 10.0


def kalman(said: Any, ship: Ship) -> Kalman:
    """The Kalman filter of a table; the disturbances are its parameters.

    Raises:
        StudyError, ParameterError: a noise of zero, or a path that the ship does not have.
    """
    from ..identify.filters.filtering import Kalman
    from ..identify.filters.measurement import Antenna, Heading

    known, free = specs(ship.model), []
    for path, sd in said.parameters.items():
        if path not in known:
            raise StudyError(unknown(path, known))
        value = float(read(ship.model, path))
        free.append(Free(path, value, known[path].low, known[path].high, value, sd))
    walk = {name: sd for name, sd in said.process.items() if name != "current"}
    if said.current:
        walk["current"] = said.current
    x, y = said.antenna
    return Kalman(
        measurement={"gnss": Antenna(said.position, x=x, y=y, delay=said.delay),
                     "compass": Heading(said.heading, delay=said.delay)},
        process=walk, parameters=tuple(free), current=bool(said.current), window=_WINDOW,
    )  # fmt: skip


def smoothed(said: Any, ship: Ship, trial: Trial) -> Trial:
    """The trial with motion from a Kalman smoother on the ship; repeated fixes are no measurements.

    The current that the filter estimates is left out: the fit estimates its own, and a forecast must not use it.
    """
    found = kalman(said, ship).run(ship, own_samples(trial)).smoothed().trial()
    return replace(found, channels={name: trial[name] if name in _CURRENT else values
                                    for name, values in found.channels.items()
                                    if name not in _CURRENT or name in trial})  # fmt: skip
