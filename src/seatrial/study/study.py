"""Study files: TOML that names ship, data, free parameters, loss and estimator, read into a `Problem`.

Settings are checked against the trials, and the trials against the ship, as the tables alone cannot.
"""

from __future__ import annotations

import hashlib
import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import __version__
from ..core.files import read_toml
from ..core.parameters import Free, specs, unknown
from ..data import Trial
from ..data.prepare import unbroken
from ..identify import Estimator, Loss, Nuisance, Problem, StudyError
from ..identify.digest import digest, include
from ..models import STATES
from ..ships import Ship, ShipError
from ..ships.classes import Trust, find_class, trusting
from ..ships.files import load
from .data import Split, chosen, read_data, read_raw
from .freedom import freedom, stated, taken

if TYPE_CHECKING:
    from .virtual import VirtualTrials

SCHEMA = "seatrial-study/1"
# A trial fills a window with this share of its length.
_FILLED = 0.9
# A trial is split at a leap of so many median steps; a time step of more than so many is coarse.
_MISSING, _COARSE = 10, 10
_KINDS = ((int, "a whole number"), (float, "a number"), (str, "a text"), (bool, "true or false"))


@dataclass(frozen=True)
class Study:
    """A study, read and ready to run.

    Attributes:
        test: trials kept apart from training and validation.
        restart: seconds between restarts in the report, or None.
        digest: fingerprint of ship, freedom, loss, estimator, all data, report and program version.
        notes: for the user: parameters that match a pattern and stay fixed, trials that were split, coarse time steps.
        title: heading of the report; empty where the study gives none.
        rival: free parameters of a simpler model that is fitted beside; empty where there is none.
        virtual: source of the trials, if they are simulated.
        published: results of a paper; empty where the study gives none.
        unidentified: why parameters are not identified by these data though sigma may be small, by path.
    """

    name: str
    path: Path
    problem: Problem
    estimator: Estimator
    test: tuple[Trial, ...]
    restart: float | None
    digest: str
    notes: tuple[str, ...] = ()
    title: str = ""
    rival: tuple[Free, ...] = ()
    virtual: VirtualTrials | None = None
    published: Mapping[str, Any] = field(default_factory=dict[str, Any])
    unidentified: Mapping[str, str] = field(default_factory=dict[str, str])

    @property
    def sigma(self) -> Mapping[str, float] | None:
        """Scale of each state in the report; None where the loss names none."""
        return self.problem.loss.sigma or None


def read_study(path: str | Path, *, trust: Trust = False) -> Study:
    """Read a study and all that it names.

    Args:
        trust: modules outside the package whose code the study and its ship may run by naming their classes;
            True for any.

    Raises:
        StudyError: naming the file, the key and what would be right.
        ShipError, DataError, ParameterError: from what the study names.
    """
    with trusting(trust):
        return _read(Path(path))


def _read(here: Path) -> Study:
    document = _document(here)
    said = _checked(here, document)
    ship = read_ship(here, said.ship)
    virtual, (train, validation, test) = (None, read_data(here, said.data, ship)) if said.virtual is None \
        else _made(here, said)
    try:
        free, fixed = freedom(ship.model, said.free, stated(ship))
    except StudyError as error:
        raise StudyError(f"{here}: {error}") from None
    _known(here, ship, said.report.unidentified)
    (train, torn), (validation, off), (test, kept) = (whole(trials) for trials in (train, validation, test))
    filled(here, ship, (*train, *validation, *test))
    no_infinity(f"{here}: ", {key: document[key] for key in document if key != "free"}, ("estimator",))
    no_infinity(f"{here}: free", said.free, ("low", "high"))
    finite(f"{here}: estimator", said.estimator)
    positive(f"{here}: loss.sigma", said.loss.sigma)
    positive(f"{here}: nuisance.bias", said.nuisance.bias)
    problem = Problem(
        ship, train, free, _loss(here, said.loss, train),
        Nuisance(**said.nuisance.model_dump()), validation, said.data.extrapolate,
    )  # fmt: skip
    estimator = read_estimator(here, said.estimator)
    _long_enough(here, train, said.estimator)
    notes = (*((f"zero, and so left fixed: {', '.join(fixed)}",) if fixed else ()), *_priors(ship, said.free), *torn,
             *off, *kept, *steps(here, train, said.estimator))  # fmt: skip
    mark = _run_digest(problem, estimator, test, said)
    return Study(
        here.stem, here, problem, estimator, test, said.report.restart, mark, notes,
        said.title, _rival(here, said.rival, free), virtual,
        said.report.published.model_dump() if said.report.published else {}, said.report.unidentified,
    )  # fmt: skip


def _priors(ship: Ship, table: Mapping[str, Any]) -> tuple[str, ...]:
    """Which parameters take the sigma of the ship file as their prior."""
    sigmas = stated(ship)
    paths = taken(ship.model, table, sigmas)
    named = ", ".join(f"{path} +- {sigmas[path]:.2g}" for path in paths)
    return (f"priors from the ship file, of its formulas (prior = false in [free] for none): {named}",) if paths else ()


def readings(study: Study) -> tuple[tuple[Any, Trial], ...]:
    """Trials kept back as they were read, each with the table [data.smoother] of the study for it.

    Empty where the study has no such table. Forecasts are compared with these: smoothed states use later readings.
    """
    said = _checked(study.path, _document(study.path))
    return () if said.virtual is not None else read_raw(study.path, said.data, study.problem.ship)


def _known(here: Path, ship: Ship, unidentified: Mapping[str, str]) -> None:
    """Refuse a path of [report.unidentified] that the ship does not have."""
    known = specs(ship.model)
    for path in unidentified:
        if path not in known:
            raise StudyError(f"{here}: report.unidentified: {unknown(path, known)}")


def _loss(here: Path, said: Any, train: Sequence[Trial]) -> Loss:
    """The table [loss]; a weight whose pattern matches no training trial is refused."""
    for pattern in said.weights:
        if not any(fnmatchcase(trial.name, pattern) for trial in train):
            named = ", ".join(trial.name for trial in train[:3])
            raise StudyError(f"{here}: loss.weights: '{pattern}' fits no training trial; they are named {named}, ...")
    return Loss(said.sigma, said.correlation, said.weights, said.scale)


def _run_digest(problem: Problem, estimator: Estimator, test: Sequence[Trial], said: Any) -> str:
    """Fingerprint of everything that decides what a run leaves in its folder, the report too."""
    found = hashlib.sha256(f"{__version__} {digest(problem, estimator)}".encode())
    for part in (said.title, said.report, said.rival, said.virtual):
        found.update(repr(part).encode())
    include(found, "test", test)
    return found.hexdigest()[:16]


def _document(path: Path) -> dict[str, Any]:
    try:
        document = read_toml(path)
    except FileNotFoundError:
        raise StudyError(f"{path}: no such study file") from None
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise StudyError(f"{path}: cannot be read as TOML: {error}") from None
    if str(document.get("schema")).startswith("seatrial-ship/"):
        raise StudyError(f"{path}: is a ship file, no study; name it in one: ship = \"{path.name}\"")
    if document.get("schema") != SCHEMA:
        raise StudyError(f"{path}: schema is {document.get('schema')!r}; this version reads '{SCHEMA}'")
    return document


def _checked(path: Path, document: Mapping[str, Any]) -> Any:
    """The document with its keys and types checked."""
    from pydantic import ValidationError

    from .schema import StudyFile, told

    try:
        return StudyFile.model_validate(document)
    except ValidationError as error:
        raise told(path, StudyFile, error) from None


def read_ship(path: Path, name: str) -> Ship:
    """The ship that the study at `path` names: a file beside it, or one of the library.

    Raises:
        StudyError: neither.
    """
    beside = path.parent / name
    try:
        return load(beside if name.endswith(".toml") and beside.is_file() else name)
    except ShipError as error:
        raise StudyError(f"{path}: ship: {error}") from None


def _long_enough(path: Path, trials: Iterable[Trial], estimator: Mapping[str, Any]) -> None:
    """Refuse a window of the study that is longer than a trial; a default window adapts."""
    window = float(estimator.get("window") or 0.0)
    for trial in trials:
        if trial.duration + trial.dt < _FILLED * window:
            raise StudyError(
                f"{path}: {trial.name} lasts {trial.duration:g} s, estimator.window is {window:g} s; shorten the "
                "window, or leave the trial out (data.exclude)"
            )


def _rival(path: Path, table: Any, free: tuple[Free, ...]) -> tuple[Free, ...]:
    """The parameters of the rival, as the study frees them."""
    names = () if table is None else tuple(table.free)
    known = [f.path for f in free]
    for name in names:
        if name not in known:
            raise StudyError(f"{path}: rival.free: {unknown(name, known, 'free parameter')}")
    return tuple(f for f in free if f.path in names)


def _made(path: Path, said: Any) -> tuple[VirtualTrials, Split]:
    """The source of virtual trials, and the trials of training, validation and test, chosen by name."""
    from .virtual import virtual_trials

    try:
        source, run = virtual_trials(said.virtual)
        made = {trial.name: trial for trial in run}
    except (StudyError, ShipError) as error:
        raise StudyError(f"{path}: {error}") from None
    parts = [chosen(path, f"data.{key}", getattr(said.data, key), made) for key in ("train", "validation", "test")]
    if not parts[0]:
        raise StudyError(f"{path}: data.train: nothing is left to train on")
    twice = [name for name in made if sum(name in part for part in parts) > 1]
    if twice:
        raise StudyError(f"{path}: data: {twice[0]} is in two of train, validation and test; keep it in one")
    train, validation, test = (tuple(made[name] for name in part) for part in parts)
    return source, (train, validation, test)


def read_estimator(path: Path, table: Mapping[str, Any], where: str = "estimator") -> Estimator:
    """The estimator of a table of the study at `path`; `where` is the place of the table.

    Raises:
        StudyError: no such estimator, or a setting that it does not have.
    """
    given = dict(table)
    try:
        cls: Any = find_class(given.pop("type", None), "identify", f"{path}: {where}.type")
    except ShipError as error:
        raise StudyError(str(error)) from None
    if not hasattr(cls, "fit"):
        raise StudyError(f"{path}: {where}.type: {cls.__name__} has no 'fit'; it is no estimator")
    known = {f.name: f for f in fields(cls)}
    for key, value in given.items():
        if key not in known:
            raise StudyError(f"{path}: {where}: {unknown(key, known, 'key')}")
        default = known[key].default
        if isinstance(default, float) and isinstance(value, int) and not isinstance(value, bool):
            given[key] = float(value)
        elif isinstance(default, float | int | str | bool) and type(value) is not type(default):
            raise StudyError(f"{path}: {where}.{key} is {value!r}; it must be {kind(default)}")
    try:
        return cls(**given)
    except (TypeError, ValueError) as error:
        raise StudyError(f"{path}: {where}: {error}") from None


def kind(value: object) -> str:
    """The type that a key must have, in words, by an example of its value."""
    return next((words for known, words in _KINDS if type(value) is known), f"a {type(value).__name__}")


def finite(where: str, table: Mapping[str, Any]) -> None:
    """Refuse settings that are not finite, weights that are no numbers, and a wrong number of threads.

    Raises:
        StudyError: naming the key.
    """
    for key, value in table.items():
        if isinstance(value, Mapping):
            for name, one in value.items():
                if key == "weights" and (isinstance(one, bool) or not isinstance(one, int | float)):
                    raise StudyError(f"{where}.{key}.{name} is {one!r}; it must be a number above zero")
            finite(f"{where}.{key}", value)
        elif isinstance(value, float) and not math.isfinite(value):
            raise StudyError(f"{where}.{key} is {value}; it must be a finite number")
    threads = table.get("threads")
    if threads is not None and (isinstance(threads, bool) or not isinstance(threads, int) or threads < 1):
        raise StudyError(f"{where}.threads is {threads!r}; it must be 1 or more, or left out for all processors")


def positive(where: str, table: Mapping[str, float]) -> None:
    """Refuse a standard deviation that is not positive and finite.

    Raises:
        StudyError: naming the key.
    """
    for key, value in table.items():
        if not (value > 0 and math.isfinite(value)):
            raise StudyError(f"{where}.{key} is {value:g}; it must be a finite number above zero")


def no_infinity(where: str, value: Any, but: tuple[str, ...]) -> None:
    """Refuse an infinite number anywhere in a document except below the keys `but`.

    Raises:
        StudyError: naming the key.
    """
    if isinstance(value, Mapping):
        for key, one in value.items():
            if key not in but:
                no_infinity(f"{where}.{key}" if where[-1:] != " " else f"{where}{key}", one, but)
    elif isinstance(value, list):
        for one in value:
            no_infinity(where, one, but)
    elif isinstance(value, float) and math.isinf(value):
        raise StudyError(f"{where} is {value:g}; it must be a finite number")


def steps(path: Path, trials: Iterable[Trial], table: Mapping[str, Any]) -> list[str]:
    """Check dt and every against the trials.

    Returns:
        Warnings.

    Raises:
        StudyError: a step, or the time between compared rows, longer than half a trial.
    """
    notes: list[str] = []
    for trial in trials:
        dt, every = float(table.get("dt") or trial.dt), int(table.get("every") or 1)
        for key, value, span in (("dt", dt, dt), ("every", every, dt * every)):
            if span > 0.25 * trial.duration:
                raise StudyError(
                    f"{path}: estimator.{key} is {value:g}, which leaves a row each {span:g} s of {trial.name}, which "
                    f"is {trial.duration:g} s long; make it smaller"
                )
        if dt > _COARSE * trial.dt and not notes:
            notes.append(f"warning: estimator.dt is {dt:g} s, {trial.name} is logged every {trial.dt:.3g} s")
    return notes


def whole(trials: tuple[Trial, ...]) -> tuple[tuple[Trial, ...], list[str]]:
    """The trials split at long leaps of time, and a warning for each that was split."""
    out: list[Trial] = []
    notes: list[str] = []
    for trial in trials:
        parts = unbroken(trial, _MISSING * trial.dt) if len(trial) > 2 else (trial,)
        out += parts
        if parts != (trial,):
            notes.append(f"warning: {trial.name} leaps over {_MISSING} steps of time; taken as {len(parts)} trials")
    return tuple(out), notes


def filled(path: Path, ship: Ship, trials: Iterable[Trial]) -> None:
    """Refuse a trial in which a channel that the fit needs is empty.

    Raises:
        StudyError: naming trial and channel.
    """
    orders = ship.model.follows
    for trial in trials:
        needed = [c if c in trial else order for c, (order, _) in zip(ship.model.controls, orders, strict=True)]
        for name in (*STATES, *needed):
            if name in trial and not np.isfinite(trial[name]).any():
                raise StudyError(f"{path}: {trial.name}: channel {name} has no values; fill it, or leave the trial out")
