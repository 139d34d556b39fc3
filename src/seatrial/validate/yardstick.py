"""A yardstick for any method of prediction: fixed training trials, questions about others, and scores of the answers.

A question is a stretch of a test trial: some seconds before a start with all channels, and after it nothing but what
`given` names, controls and true wind.  Time counts from the start.  An answer is a trial on the rows of its question
from the start on, with x, y, psi, the other states where a method has them, and standard deviations x_sd, y_sd, psi_sd
where it knows them.  Where it tells none, its errors on questions about training trials stand in.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated

import numpy as np

from ..core.records import Limits, NotNegative, Positive, read_record
from ..core.values import dataclass, field, replace
from ..data import Array, DataError, Trial
from ..identify import StudyError
from ..models import STATES
from ..study.data import read_data
from ..study.schema import DataTable, VirtualTable
from ..study.study import made, read_ship
from . import Comparison
from .comparison import compare, pooled
from .metrics import pairs, reached, scales

SCHEMA = "seatrial-yardstick/1"
JUDGED = ("x", "y", "psi")
"""What every answer has."""

_BANDS = tuple(f"{name}_sd" for name in JUDGED)

_LEVEL = 1.959963984540054
"""Half width of a 95 % band in standard deviations of a normal distribution."""

# Questions about training trials, by which an answer without bands is given some.
_KNOWN = 40


@dataclass(frozen=True, kw_only=True)
class SetFile:
    """A file of the yardstick.

    Attributes:
        ship: that `scale_to` brings trials to; of virtual trials the ship of the questions' length.
        given: patterns of the channels that a method sees of the time it predicts.
        history, horizons, every: seconds before a start, times of the scores after it, from one start to the next [s].
        moving: a stretch counts where the ship makes at least this speed along its path, on average [m/s].
        left_out: so many trials of `data.train`, in their order, are left out together and predicted from the others;
            0 predicts those of `data.test`.
        methods: files, relative to this one, that are measured where none is named: studies and programs.
        scale: of each state in Eq. 25 of Wakita 2022; empty takes the spread of the test trials.
    """

    title: str
    ship: str
    given: Annotated[list[str], Limits(entries=1)]
    history: Positive
    horizons: Annotated[list[float], Limits(entries=1)]
    every: Positive
    moving: NotNegative = 0.0
    left_out: Annotated[int, Limits(least=0)] = 0
    methods: list[str] = field(default_factory=list[str])
    scale: dict[str, Positive] = field(default_factory=dict[str, float])
    data: DataTable
    virtual: VirtualTable | None = None


@dataclass(frozen=True)
class Question:
    """A stretch of a trial.

    Attributes:
        asked: what a method sees of it.
        truth: the rows from the start on, whole.
    """

    asked: Trial
    truth: Trial


@dataclass(frozen=True)
class Task:
    """A set, read.

    Attributes:
        train: all that a method may learn from.
        questions: about test trials; these count.
        known: about training trials, whose answers give bands where a method has none.
        scale: of each state, SI units.
        parts: what a method is asked for, one after the other, each with its own training trials; empty where it is
            asked for this.
    """

    name: str
    said: SetFile
    train: tuple[Trial, ...]
    questions: tuple[Question, ...]
    known: tuple[Question, ...]
    scale: Mapping[str, float]
    parts: tuple[Task, ...] = ()


@dataclass(frozen=True)
class Ahead:
    """Scores at one time after the start.

    Attributes:
        position, heading: root mean square error [m, rad]; infinite where an answer is missing or no number.
        coverage: share of x, y and psi inside of their bands of 95 %.
        width: mean of the bands of x and y, and of that of psi, from edge to edge [m, rad].
        log_score: mean of the logarithm of the normal density of x, y and psi together [1/(m^2 rad)]; more is better.
    """

    horizon: float
    position: float
    heading: float
    coverage: float
    width: tuple[float, float]
    log_score: float


@dataclass(frozen=True)
class Standing:
    """How a method does on a set.

    Attributes:
        eq25: standardised error over all rows of all answers (Wakita 2022 Eq. 25); NaN where states are not predicted.
        count, failed: questions, and those without an answer in numbers.
        own: whether the bands are the method's own.
        seconds: of processor, to learn and to answer.
    """

    method: str
    eq25: float
    count: int
    failed: int
    own: bool
    seconds: float
    ahead: tuple[Ahead, ...]


def read_task(path: Path) -> Task:
    """The set of a file.

    Raises:
        StudyError, DataError, ShipError: naming file, key and what would be right; data that are not at hand.
    """
    said = read_record(path, SetFile, SCHEMA, StudyError)
    if any(not here < after for here, after in zip((0.0, *said.horizons), said.horizons, strict=False)):
        raise StudyError(f"{path}: horizons: {said.horizons} must be positive and increase")
    ship = read_ship(path, said.ship)
    _, (train, _, test) = made(path, said) if said.virtual else (None, read_data(path, said.data, ship))
    whole = _whole(path, said, train, test) if said.left_out else _task(path.stem, said, train, test)
    if not whole.questions:
        key = "train" if said.left_out else "test"
        raise StudyError(f"{path}: data.{key}: no stretch of {said.history:g} and {said.horizons[-1]:g} s to predict")
    return whole


def _whole(path: Path, said: SetFile, train: tuple[Trial, ...], test: tuple[Trial, ...]) -> Task:
    """Training trials predicted from the others, so many at a time."""
    if test or said.left_out >= len(train):
        raise StudyError(f"{path}: left_out: {said.left_out} of {len(train)} training trials are left out in turn; "
                         "leave some to learn from, and data.test empty")  # fmt: skip
    names = [train[k : k + said.left_out] for k in range(0, len(train), said.left_out)]
    parts = tuple(_task(path.stem, said, tuple(t for t in train if all(t is not one for one in out)), out)
                  for out in names)  # fmt: skip
    questions, known = (tuple(one for part in parts for one in getattr(part, key)) for key in ("questions", "known"))
    return Task(path.stem, said, train, questions, known, scales(train, said.scale), parts)


def _task(name: str, said: SetFile, train: tuple[Trial, ...], test: tuple[Trial, ...]) -> Task:
    """Questions about `test`, from all of `train`."""
    questions = tuple(one for trial in test for one in asked(trial, said))
    known = [one for trial in train for one in asked(trial, said)]
    few = known[:: max(math.ceil(len(known) / _KNOWN), 1)]
    return Task(name, said, train, questions, tuple(few), scales(test, said.scale))


def asked(trial: Trial, said: SetFile) -> Iterator[Question]:
    """The stretches of a trial, one every `every` seconds, as far as all of it was read and the ship moves."""
    lacking = [name for name in JUDGED if name not in trial]
    if lacking:
        raise DataError(f"{trial.name}: no channel {', '.join(lacking)}; a yardstick needs x, y and psi")
    t, whole = trial.t, np.asarray(np.isfinite(trial.stack(*JUDGED)).all(axis=1))
    longest, begin = said.horizons[-1], float(trial.t[0]) + said.history
    while begin + longest <= t[-1] + 1e-6:
        row = int(np.searchsorted(t, begin + 1e-6)) - 1
        last = int(np.searchsorted(t, begin + longest + 1e-6))
        first = int(np.searchsorted(t, begin - said.history - 1e-6))
        if whole[row] and _path(trial, row, last) >= said.moving * longest:
            yield _question(trial, slice(first, last), row, said.given)
        begin += said.every


def _path(trial: Trial, row: int, last: int) -> float:
    """Length of the track from a row to another [m], gaps bridged."""
    track = trial.rows(slice(row, last)).stack("x", "y")
    track = track[np.isfinite(track).all(axis=1)]
    return float(np.hypot(*np.diff(track, axis=0).T).sum())


def _question(trial: Trial, rows: slice, row: int, given: Sequence[str]) -> Question:
    part = replace(trial.rows(rows), t=trial.t[rows] - trial.t[row], meta={})
    after = part.t > 0.0
    hidden = {name: np.where(after, np.nan, values) for name, values in part.channels.items()
              if not any(fnmatchcase(name, one) for one in given)}  # fmt: skip
    return Question(part.having(**hidden), part.rows(part.t >= 0.0))


def scored(
    task: Task, method: str, answers: Sequence[Trial | None], known: Sequence[Trial | None], seconds: float
) -> Standing:
    """The scores of a method.

    Args:
        answers, known: to `task.questions` and to `task.known`; None where there is none.
    """
    horizons = task.said.horizons
    answers = [_usable(q, a) for q, a in zip(task.questions, answers, strict=True)]
    known = [_usable(q, a) for q, a in zip(task.known, known, strict=True)]
    errors = np.array([_errors(q, a, horizons) for q, a in zip(task.questions, answers, strict=True)])
    learnt = [_errors(q, a, horizons) for q, a in zip(task.known, known, strict=True)]
    seen = np.reshape(learnt, (-1, *errors.shape[1:]))
    told = np.array([_told(answer, horizons) for answer in answers])
    own = bool(np.isfinite(told).all(axis=(1, 2)).any())
    sd = told if own else np.broadcast_to(_rms(seen), errors.shape)
    failed = [a is None or bool(np.isinf(e).any()) for a, e in zip(answers, errors, strict=True)]
    ahead = tuple(_ahead(h, errors[:, k], sd[:, k]) for k, h in enumerate(horizons))
    return Standing(method, _eq25(task, answers), len(answers), sum(failed), own, seconds, ahead)


def _errors(question: Question, answer: Trial | None, horizons: Sequence[float]) -> Array:
    """Errors of x, y [m] and psi [rad] at each horizon, shape (horizons, 3).

    NaN where the trial has no reading, infinite where the answer has no number; a turn too many counts.
    """
    truth, none = question.truth, np.full(len(question.truth), np.nan)
    guess = truth.having(**dict.fromkeys(JUDGED, none)) if answer is None else answer
    found: list[list[float]] = []
    for horizon in horizons:
        read = reached(truth, truth, None, horizon)
        off = reached(truth, guess, None, horizon)
        found.append([_error(read[name], off.get(name, read[name][:0])) for name in JUDGED])
    return np.array(found)


def _error(read: Array, off: Array) -> float:
    if not read.size or not np.isfinite(read[0]):
        return math.nan
    return float(off[0]) if off.size and np.isfinite(off[0]) else math.inf


def _usable(question: Question, answer: Trial | None) -> Trial | None:
    """The answer on the rows of the truth, which it begins with; None unless it has every row and state asked for."""
    t, dt = question.truth.t, question.truth.dt
    if answer is None or not len(answer) or any(name not in answer for name in JUDGED):
        return None
    row = np.clip(np.searchsorted(answer.t, t - 0.01 * dt), 0, len(answer) - 1)
    if (np.abs(answer.t[row] - t)[1:] > 0.01 * dt).any():
        return None
    told = {name: values[row] for name, values in answer.channels.items() if name in (*STATES, *_BANDS)}
    begun = {name: question.truth[name][:1] for name in told if name in question.truth}
    return Trial(answer.name, t, {name: np.append(begun.get(name, values[:1]), values[1:])
                                  for name, values in told.items()})  # fmt: skip


def _told(answer: Trial | None, horizons: Sequence[float]) -> Array:
    """Standard deviations of x, y and psi that an answer has at each horizon, shape (horizons, 3); NaN where none."""
    if answer is None or any(name not in answer for name in _BANDS):
        return np.full((len(horizons), 3), np.nan)
    found = np.column_stack([np.interp(horizons, answer.t, answer[name]) for name in _BANDS])
    return np.where(found > 0.0, found, np.nan)


def _rms(errors: Array) -> Array:
    """Root mean square of each column over its readings; infinite where an answer is, NaN without a reading."""
    read = ~np.isnan(errors)
    total = np.where(read, errors, 0.0) ** 2
    with np.errstate(invalid="ignore"):
        return np.sqrt(total.sum(axis=0) / read.sum(axis=0))


def _ahead(horizon: float, errors: Array, sd: Array) -> Ahead:
    """Scores of errors and standard deviations of x, y and psi at one horizon, each shape (questions, 3)."""
    x, y, psi = _rms(errors).tolist()
    with np.errstate(invalid="ignore", divide="ignore"):
        away = np.abs(errors) / sd
        density = -0.5 * away**2 - np.log(sd) - 0.5 * math.log(2.0 * math.pi)
    judged = np.isfinite(sd) & ~np.isnan(errors)
    every = judged.all(axis=1)
    wide = [float(2.0 * _LEVEL * np.mean(sd[judged[:, c], c])) if judged[:, c].any() else math.nan for c in range(3)]
    return Ahead(
        horizon, math.hypot(x, y), psi, float(np.mean(away[judged] <= _LEVEL)) if judged.any() else math.nan,
        (0.5 * (wide[0] + wide[1]), wide[2]), float(np.mean(density[every].sum(axis=1))) if every.any() else math.nan,
    )  # fmt: skip


def _eq25(task: Task, answers: Sequence[Trial | None]) -> float:
    """Standardised error of all rows together; infinite where an answer is missing, NaN where one lacks a state."""
    found: list[Comparison] = []
    for question, answer in zip(task.questions, answers, strict=True):
        if answer is None:
            return math.inf
        wanted = [name for name in pairs(question.truth, question.truth) if name in STATES]
        if any(name not in answer for name in wanted):
            return math.nan
        scale = {name: task.scale[name] for name in wanted if name in task.scale}
        after = question.truth.t > 0.0
        found.append(compare(question.truth.rows(after), answer.rows(after), label="", sigma=scale))
        if not np.isfinite(found[-1].predicted.stack(*wanted)).all():
            return math.inf
    return pooled(found)
