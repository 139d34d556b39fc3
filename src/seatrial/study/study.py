"""Study files: TOML that names ship, data, free parameters, loss and estimator, read into a `Problem`.

Settings are checked against the trials, and the trials against the ship, as the tables alone cannot.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, cast

import numpy as np

from ..core.parameters import Free, specs, unknown
from ..core.records import document_of, filled, of_schema
from ..core.values import dataclass, field, fields
from ..core.version import __version__
from ..data import Trial
from ..data.prepare import BREAK, unbroken
from ..identify import Estimator, Loss, Nuisance, Problem, StudyError
from ..identify.resume import digest, include
from ..ships import Ship, ShipError
from ..ships.classes import Trust, find_class, trusting
from ..ships.files import load
from .cells import Cell
from .data import Split, chosen, read_data, read_raw
from .freedom import freedom, joint, stated, suspected, taken, tested
from .schema import StudyFile

if TYPE_CHECKING:
    from ..identify.regression.captive import CaptiveFit
    from .virtual import VirtualTrials

SCHEMA = "seatrial-study/1"
"""The first key of a study's file."""
# A trial fills a window with this share of its length.
_FILLED = 0.9
# A time step of more than so many of the log is coarse.
_COARSE = 10
# Parameters that a note names.
_NAMED = 6
_KINDS = {int: "a whole number", float: "a number", str: "a text", bool: "true or false"}


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
        partial: as of a table of fits.
    """

    partial: ClassVar[bool] = False

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

    @property
    def cells(self) -> tuple[Cell, ...]:
        """A study is a table of one cell."""
        text = self.path.read_text(encoding="utf-8")
        return (Cell(None, self.problem, self.estimator, self.name, "", self.restart, self.test, text, str(self.path),
                     self.unidentified, self.digest),)  # fmt: skip

    @property
    def apart(self) -> tuple[Trial, ...]:
        """Trials that the fit does not see."""
        return self.test

    @property
    def kept_back(self) -> bool:
        """Whether the report judges the fit on trials that it has not seen."""
        return bool(self.problem.validation or self.test)

    @property
    def judged_on(self) -> tuple[Trial, ...]:
        """The trials kept back; those of training, where none was."""
        return (*self.problem.validation, *self.test) or self.problem.trials

    @property
    def rivals(self) -> VirtualTrials | None:
        """The source of the trials on which a rival is judged beside the fit; None where there is no rival."""
        return self.virtual if self.rival else None


def read_study(
    path: str | Path, *, trust: Trust = False, suspects: bool = False, trials: tuple[Trial, ...] = ()
) -> Study:  # fmt: skip
    """Read a study and all that it names.

    Args:
        trials: to train on instead of all that its table [data] names.
        suspects: as if the study had `suspects = "auto"` in [nuisance].
        trust: modules outside the package whose code the study and its ship may run by naming their classes;
            True for any.

    Raises:
        StudyError: naming the file, the key and what would be right.
        ShipError, DataError, ParameterError: from what the study names.
    """
    with trusting(trust):
        return _read(Path(path), suspects, trials)


def _read(here: Path, suspects: bool, trials: tuple[Trial, ...]) -> Study:
    document = _document(here)
    said = filled(StudyFile, document, here, StudyError)
    ship = read_ship(here, said.ship, {"actuators": said.actuators, "wind": said.wind})
    tests, asked = tested(here, said.captive, ship) if said.captive else None, ship.model
    ship = tests.ship if tests else ship
    virtual, (train, validation, test) = (
        (None, (trials, (), ())) if trials else made(here, said) if said.virtual
        else (None, read_data(here, said.data, ship))
    )  # fmt: skip
    try:
        free, fixed = freedom(asked, said.free, stated(ship))  # priors are about what the file of the ship has
        if tests and said.captive:
            free = joint(free, tests, said.captive.scatter, taken(ship.model, said.free, stated(ship)))
    except StudyError as error:
        raise StudyError(f"{here}: {error}") from None
    (train, torn), (validation, off), (test, kept) = (_whole(trials) for trials in (train, validation, test))
    _filled(here, ship, (*train, *validation, *test))
    _check_numbers(here, document)
    known = specs(ship.model)
    for path in said.report.unidentified:
        if path not in known:
            raise StudyError(f"{here}: report.unidentified: {unknown(path, known)}")
    problem = Problem(
        ship, train, free, _loss(here, said.loss, train, given=bool(trials)),
        Nuisance(**vars(said.nuisance)), validation, said.data.extrapolate,
    )  # fmt: skip
    estimator = read_estimator(here, said.estimator)
    problem = suspected(str(here), problem, estimator, suspects)
    notes = (*((f"zero, and so left fixed: {', '.join(fixed)}",) if fixed else ()),
             *_priors(ship, said.free, free, tests), *torn, *off, *kept,
             *_steps(here, train, said.estimator))  # fmt: skip
    return Study(
        here.stem, here, problem, estimator, test, said.report.restart,
        _run_digest(problem, estimator, test, said), notes, said.title,
        _rival(here, said.rival.free if said.rival else (), free), virtual,
        vars(said.report.published) if said.report.published else {}, said.report.unidentified,
    )  # fmt: skip


def _priors(
    ship: Ship, table: Mapping[str, Any], free: Sequence[Free], tests: CaptiveFit | None
) -> tuple[str, ...]:  # fmt: skip
    """Which parameters take the sigma of the ship file, or of the captive tests, as their prior."""
    paths = taken(ship.model, table, stated(ship))
    told = [f"{f.path} +- {f.sigma:.2g}" for f in free if f.path in (tests.paths if tests else paths)]
    named = ", ".join(told[:_NAMED]) + (f" and {len(told) - _NAMED} more" if len(told) > _NAMED else "")
    source = f"{len(tests.runs)} captive tests, with their correlations," if tests else "the ship file"
    return (f"priors from {source} (prior = false in [free] for none): {named}",) if told else ()


def readings(study: Study) -> tuple[tuple[Any, Trial], ...]:
    """Trials kept back as they were read, each with the table [data.smoother] of the study for it.

    Empty where the study has no such table. Forecasts are compared with these: smoothed states use later readings.
    """
    said = filled(StudyFile, _document(study.path), study.path, StudyError)
    return () if said.virtual is not None else read_raw(study.path, said.data, study.problem.ship)


def _loss(here: Path, said: Any, train: Sequence[Trial], given: bool = False) -> Loss:
    """The table [loss]; a weight whose pattern matches no training trial is refused, unless these are not its own."""
    weights = {one: weight for one, weight in said.weights.items() if any(fnmatchcase(t.name, one) for t in train)}
    if not given and (idle := next((one for one in said.weights if one not in weights), None)):
        named = ", ".join(trial.name for trial in train[:3])
        raise StudyError(f"{here}: loss.weights: '{idle}' fits no training trial; they are named {named}, ...")
    return Loss(said.sigma, said.correlation, weights, said.scale)


def _run_digest(problem: Problem, estimator: Estimator, test: Sequence[Trial], said: Any) -> str:
    """Fingerprint of everything that decides what a run leaves in its folder, the report too."""
    parts = "".join(map(repr, (said.title, said.report, said.rival, said.virtual, said.actuators, said.wind)))
    found = hashlib.sha256(f"{__version__} {digest(problem, estimator)}{parts}".encode())
    include(found, "test", test)
    return found.hexdigest()[:16]


def _document(path: Path) -> dict[str, Any]:
    if not path.exists():
        raise StudyError(f"{path}: no such study file")
    document = of_schema(document_of(path, StudyError), SCHEMA, path, StudyError)
    shared = document.get("virtual")
    return {**document, "virtual": _shared(path, shared)} if isinstance(shared, str) else document


def _shared(path: Path, name: str) -> Any:
    """The table [virtual] of the study that `virtual` names: two studies of the same simulated trials."""
    try:
        table = document_of(path.parent / name, StudyError).get("virtual")
    except StudyError as error:
        raise StudyError(f"{path}: virtual: {error}") from None
    if not isinstance(table, dict):
        raise StudyError(f"{path}: virtual: {name} has no table [virtual]; name a study that has one")
    return cast("dict[str, Any]", table)


def read_ship(path: Path, name: str, tables: Mapping[str, Mapping[str, Any]] | None = None) -> Ship:
    """The ship that the study at `path` names: a file beside it, or one of the library.

    Args:
        tables: those that the study lays over tables of the file.

    Raises:
        StudyError: neither, or a key or number that a ship file may not have either.
    """
    beside = path.parent / name
    file = beside if name.endswith(".toml") and beside.is_file() else name
    try:
        return load(file, over={key: table for key, table in (tables or {}).items() if table})
    except ShipError as error:
        try:
            load(file)
        except ShipError:
            raise StudyError(f"{path}: ship: {error}") from None
        raise StudyError(f"{path}: {str(error).rpartition('.toml: ')[2]}") from None  # of a table of the study


def _rival(path: Path, names: Sequence[str], free: tuple[Free, ...]) -> tuple[Free, ...]:
    """The parameters of the rival, as the study frees them."""
    known = [f.path for f in free]
    for name in names:
        if name not in known:
            raise StudyError(f"{path}: rival.free: {unknown(name, known, 'free parameter')}")
    return tuple(f for f in free if f.path in names)


def made(path: Path, said: Any) -> tuple[VirtualTrials, Split]:
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
            raise StudyError(f"{path}: {where}.{key} is {value!r}; it must be {_KINDS[type(default)]}")
    try:
        return cls(**given)
    except (TypeError, ValueError) as error:
        raise StudyError(f"{path}: {where}: {error}") from None


def _check_numbers(path: Path, document: Mapping[str, Any]) -> None:
    """Refuse numbers that are not finite, standard deviations and weights that are not positive, no threads.

    Raises:
        StudyError: naming the key.
    """
    for keys, value in _leaves(document):
        where, estimator = f"{path}: {'.'.join(keys)}", keys[0] == "estimator"
        if keys[:-1] in (("loss", "sigma"), ("nuisance", "bias")) and not 0.0 < float(value) < math.inf:
            raise StudyError(f"{where} is {value}; it must be a finite number above zero")
        if isinstance(value, float) and (math.isinf(value) or (estimator and math.isnan(value))):
            open_ended = value > 0 and keys[:-1] in (("nuisance", "common"), ("nuisance", "initial"))
            if open_ended or (keys[0] == "free" and keys[-1] in ("low", "high")):
                continue
            raise StudyError(f"{where} is {value:g}; it must be a finite number")
        if not estimator:
            continue
        if "weights" in keys[1:-1] and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise StudyError(f"{where} is {value!r}; it must be a number above zero")
        if keys[-1] == "threads" and (isinstance(value, bool) or not isinstance(value, int) or value < 1):
            raise StudyError(f"{where} is {value!r}; it must be 1 or more, or left out for all processors")


def _leaves(value: Any, *keys: str) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Values of a document below its tables and lists, each with the keys that lead to it."""
    if isinstance(value, Mapping):
        for key, one in value.items():
            yield from _leaves(one, *keys, key)
    elif isinstance(value, list):
        for one in value:
            yield from _leaves(one, *keys)
    else:
        yield keys, value


def _steps(path: Path, trials: Iterable[Trial], table: Mapping[str, Any]) -> list[str]:
    """Check window, dt and every of an estimator against the trials; a default window adapts.

    Returns:
        Warnings.

    Raises:
        StudyError: a window longer than a trial, or more than a quarter of it from one compared row to the next.
    """
    notes: list[str] = []
    window = float(table.get("window") or 0.0)
    for trial in trials:
        if trial.duration + trial.dt < _FILLED * window:
            raise StudyError(
                f"{path}: {trial.name} lasts {trial.duration:g} s, estimator.window is {window:g} s; shorten the "
                "window, or leave the trial out (data.exclude)"
            )
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


def _whole(trials: tuple[Trial, ...]) -> tuple[tuple[Trial, ...], list[str]]:
    """The trials split at long leaps of time, and a warning for each that was split."""
    out: list[Trial] = []
    notes: list[str] = []
    for trial in trials:
        parts = unbroken(trial, BREAK * trial.dt) if len(trial) > 2 else (trial,)
        out += parts
        if parts != (trial,):
            notes.append(f"warning: {trial.name} leaps over {int(BREAK)} steps of time; taken as {len(parts)} trials")
    return tuple(out), notes


def _filled(path: Path, ship: Ship, trials: Iterable[Trial]) -> None:
    """Refuse a trial in which a control is empty; states without a reading are for `lint` to judge.

    Raises:
        StudyError: naming trial and channel.
    """
    orders = ship.model.stands_for
    for trial in trials:
        needed = [c if c in trial else order for c, (order, _) in zip(ship.model.controls, orders, strict=True)]
        for name in needed:
            if name in trial and not np.isfinite(trial[name]).any():
                raise StudyError(f"{path}: {trial.name}: channel {name} has no values; fill it, or leave the trial out")
