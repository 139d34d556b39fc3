"""Studies: a TOML file that names ship, data, freedom, loss and estimator, read into a `Problem`."""

from __future__ import annotations

import difflib
import fnmatch
import hashlib
import os
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from ..data import Trial
from ..parameters import unknown
from ..ships import Ship, ShipError
from ..ships.files import find_class, load
from ..ships.writing import to_toml
from . import Estimator, Loss, Nuisance, Problem, StudyError
from .freedom import freedom

SCHEMA = "seatrial-study/1"
DATA = "SEATRIAL_DATA"
"""Variable that names the folder of the public data sets; unset, it is ../shared/data beside the
root of the repository (a folder with a pyproject.toml) that holds the study, or the working folder."""

_SUFFIXES = (".csv", ".dat", ".parquet")


@dataclass(frozen=True)
class Study:
    """A study, read and ready to run.

    Attributes:
        test: trials kept apart from training and validation.
        restart: seconds between restarts in the report, or None.
        digest: fingerprint of ship, freedom, loss, estimator and data.
        notes: what a reader should know: parameters that a pattern fits and that stay fixed.
    """

    name: str
    path: Path
    problem: Problem
    estimator: Estimator
    test: tuple[Trial, ...]
    restart: float | None
    digest: str
    notes: tuple[str, ...] = ()

    @property
    def sigma(self) -> Mapping[str, float] | None:
        """Scale of each state in the report; None where the loss names none."""
        return self.problem.loss.sigma or None


def read_study(path: str | Path) -> Study:
    """Read a study and all that it names.

    Raises:
        StudyError: naming the file, the key and what would be right.
        ShipError, DataError, ParameterError: from what the study names.
    """
    here = Path(path)
    document = _document(here)
    said = _checked(here, document)
    ship = _ship(here, said.ship)
    train, validation, test = _data(here, said.data)
    try:
        free, fixed = freedom(ship.model, said.free)
    except StudyError as error:
        raise StudyError(f"{here}: {error}") from None
    problem = Problem(
        ship, train, free, Loss(said.loss.sigma, said.loss.correlation),
        Nuisance(said.nuisance.initial, said.nuisance.current, said.nuisance.bias), validation,
    )  # fmt: skip
    estimator = _estimator(here, said.estimator)
    notes = (f"zero, and so left fixed: {', '.join(fixed)}",) if fixed else ()
    return Study(
        here.stem, here, problem, estimator, test, said.report.restart, digest(problem, estimator), notes
    )  # fmt: skip


def digest(problem: Problem, estimator: Estimator) -> str:
    """Fingerprint of everything that decides the numbers of a fit."""
    found = hashlib.sha256()
    settings: Any = estimator
    if hasattr(settings, "threads"):
        settings = replace(settings, threads=None)  # their number changes no digit
    for part in (to_toml(problem.ship), problem.free, problem.loss, problem.nuisance, settings):
        found.update(repr(part).encode())
    for kind, trials in (("train", problem.trials), ("validation", problem.validation)):
        for trial in trials:
            found.update(f"{kind} {trial.name}".encode())
            found.update(trial.t.tobytes())
            for name in sorted(trial.channels):
                found.update(name.encode() + trial[name].tobytes())
    return found.hexdigest()[:16]


def _document(path: Path) -> dict[str, Any]:
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise StudyError(f"{path}: no such study file") from None
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise StudyError(f"{path}: cannot be read as TOML: {error}") from None
    if document.get("schema") != SCHEMA:
        raise StudyError(f"{path}: schema is {document.get('schema')!r}; this version reads '{SCHEMA}'")
    return document


def _checked(path: Path, document: Mapping[str, Any]) -> Any:
    """The document with its keys and types checked."""
    from pydantic import ValidationError

    from .study_schema import StudyFile

    try:
        return StudyFile.model_validate(document)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        if first["type"] == "extra_forbidden":
            known = StudyFile.keys(first["loc"][:-1])
            raise StudyError(f"{path}: {key}: {unknown(str(first['loc'][-1]), known, 'key')}") from None
        said = "is missing" if first["type"] == "missing" else f"is {first['input']!r}: {first['msg']}"
        raise StudyError(f"{path}: {key} {said}") from None


def _ship(path: Path, name: str) -> Ship:
    beside = path.parent / name
    try:
        return load(beside if name.endswith(".toml") and beside.is_file() else name)
    except ShipError as error:
        raise StudyError(f"{path}: ship: {error}") from None


def _root(path: Path, root: str) -> Path:
    """Folder of the data: variables expanded, relative to the study file."""
    around = (*path.resolve().parents, Path.cwd(), *Path.cwd().parents)
    home = next((p for p in around if (p / "pyproject.toml").exists()), path.resolve().parent)
    known = {DATA: str(home.parent / "shared" / "data"), **os.environ}
    for name in re.findall(r"\$\{?(\w+)", root):
        if name not in known:
            raise StudyError(f"{path}: data.root: the variable {name} is not set")
    text = re.sub(r"\$(?:\{(\w+)\}|(\w+))", lambda m: known[m[1] or m[2]], root)
    found = path.parent / Path(text).expanduser()
    if not found.is_dir():
        raise StudyError(
            f"{path}: data.root: no folder {found}; set {DATA} to the folder of the public data sets "
            "(README.md, Data, says where each can be had)"
        )
    return found


def _data(path: Path, data: Any) -> tuple[tuple[Trial, ...], ...]:
    """Trials of training, validation and test; what is listed for the later is taken out of the earlier."""
    root = _root(path, data.root)
    every = sorted(f for f in root.rglob("*") if f.is_file() and f.suffix.lower() in _SUFFIXES)
    names = {f.relative_to(root).as_posix(): f for f in every}
    excluded = _chosen(path, "exclude", data.exclude, names)
    parts: list[list[str]] = []
    taken = set(excluded)
    for key in ("test", "validation", "train"):
        found = [name for name in _chosen(path, key, getattr(data, key), names) if name not in taken]
        taken |= set(found)
        parts.append(found)
    if not parts[2]:
        raise StudyError(f"{path}: data.train: nothing is left to train on")
    read = _reader(path, data.format, data.mapping)
    test, validation, train = (tuple(_shortened(read(names[name])) for name in found) for found in parts)
    return train, validation, test


def _chosen(path: Path, key: str, patterns: Sequence[str], names: Iterable[str]) -> list[str]:
    every = list(names)
    found: dict[str, None] = {}
    for pattern in patterns:
        fits = [n for n in every if fnmatch.fnmatchcase(n, pattern) or n.rpartition(".")[0] == pattern]
        if not fits:
            near = difflib.get_close_matches(pattern, every, n=3, cutoff=0.3) or every[:3]
            raise StudyError(f"{path}: data.{key}: '{pattern}' fits no file; near: {', '.join(near)}")
        found.update(dict.fromkeys(fits))
    return list(found)


def _reader(path: Path, format: str | None, mapping: str | None) -> Callable[[Path], Trial]:
    from ..data import frt_esso, simman
    from ..data.mapping import read, read_mapping
    from ..data.trialfile import read_trial

    if format == "csv":
        if mapping is None:
            raise StudyError(f"{path}: data.mapping is missing; the format csv needs it")
        table = read_mapping(path.parent / mapping)
        return lambda file: read(file, table)
    formats = {None: read_trial, "frt-esso": frt_esso.read, "simman": simman.read}
    if format not in formats:
        raise StudyError(f"{path}: data.format: {unknown(str(format), ('frt-esso', 'simman', 'csv'), 'format')}")
    return formats[format]


def _shortened(trial: Trial) -> Trial:
    from ..data.prepare import drop_trailing_gaps

    return drop_trailing_gaps(trial)


def _estimator(path: Path, table: Mapping[str, Any]) -> Estimator:
    given = dict(table)
    try:
        cls: Any = find_class(given.pop("type", None), "identify", f"{path}: estimator.type")
    except ShipError as error:
        raise StudyError(str(error)) from None
    if not hasattr(cls, "fit"):
        raise StudyError(f"{path}: estimator.type: {cls.__name__} has no 'fit'; it is no estimator")
    known = {f.name: f for f in fields(cls)}
    for key, value in given.items():
        if key not in known:
            raise StudyError(f"{path}: estimator: {unknown(key, known, 'key')}")
        default = known[key].default
        if isinstance(default, float) and isinstance(value, int) and not isinstance(value, bool):
            given[key] = float(value)
        elif isinstance(default, float | int | str | bool) and type(value) is not type(default):
            raise StudyError(f"{path}: estimator.{key} is {value!r}; it must be a {type(default).__name__}")
    try:
        return cls(**given)
    except (TypeError, ValueError) as error:
        raise StudyError(f"{path}: estimator: {error}") from None


