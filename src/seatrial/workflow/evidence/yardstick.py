"""Methods of prediction on the sets of the yardstick: ours, ships as they are, and programs of others.

A method is a study (fitted to the set's training trials), a ship as it is, or a program that is started with a folder:
it reads ``train/*.csv``, ``asked/*.csv`` and ``task.json`` there and writes ``predicted/<name>.csv`` for each question.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Collection, Sequence
from pathlib import Path

import numpy as np

from ...belief.corrected import Errors, as_logged, as_true, shared_by_all
from ...core.files import write_whole
from ...core.records import to_json
from ...core.values import asdict, dataclass
from ...data import DataError, Trial
from ...data.prepare.made import uncounted
from ...data.trialfile import read_trials, write_trials
from ...engine import SimulationError
from ...identify import FitError, StudyError
from ...models import STATES
from ...report.blocks import Body, bullets, fields, table
from ...ships import Ship, ShipError
from ...ships.files import load
from ...simulate.begun import begun
from ...simulate.replay import replay
from ...study.data import DATA
from ...study.study import Study, read_study
from ...validate.comparison import constant_velocity
from ...validate.yardstick import JUDGED, Standing, Task, read_task, scored
from .. import SILENT, Outcome, RequestError, Sink, figure
from ..folders.drafting import new_study
from .fans import DEGREES

SETS = Path("studies") / "yardstick"
"""Where the sets are that a command without any takes, below the working folder."""

BASELINE = "constant velocity"
FIRST = "new:"
"""Before the name of a ship: the study that `study new` writes for it and the training trials."""
RESULT = "seatrial-yardstick-result/1"
"""What the file of a result says of itself."""

Answers = Sequence[Trial | None]
Method = Callable[[Task, Sequence[Trial]], Answers]
"""Answers to questions, in their order."""


@dataclass(frozen=True)
class Row:
    """The methods on one set; `refused` says why others have no scores, by name."""

    name: str
    title: str
    train: tuple[str, ...]
    standings: tuple[Standing, ...]
    refused: dict[str, str]


@dataclass(frozen=True)
class Found:
    """All that was measured."""

    sets: tuple[Row, ...]


def yardstick(
    sets: Sequence[Path] = (), methods: Sequence[str] = (), *, out: Path | None = None, sink: Sink = SILENT
) -> Outcome[Found]:  # fmt: skip
    """Measure methods of prediction on public sets.

    Args:
        sets: files of sets; none takes all of `SETS` whose data are at hand.
        methods: studies, ships or programs; none takes those that each set names, as far as their files are here.
            Constant velocity is always measured.
        out: a JSON file.

    Raises:
        RequestError: no set, or a method that is none.
        StudyError, DataError: a set that was named cannot be read.
    """
    if out is not None and out.suffix != ".json":
        raise RequestError(f"-o {out}: the result is a JSON file; end its name in .json")
    chosen = {name: _method(name) for name in methods}
    rows = [_measured(task, chosen or _usual(path, task), sink) for path, task in _tasks(sets, sink)]
    found = Found(tuple(rows))
    if out is not None:
        write_whole(out, to_json(found, RESULT))
        sink.note(f"wrote {out}")
    every = [f"{row.name}: {name}: {why}" for row in rows for name, why in row.refused.items()]
    return Outcome(found, fields({"sets": [asdict(row) for row in rows]}, _shown(rows)), tuple(every))


def _tasks(sets: Sequence[Path], sink: Sink) -> list[tuple[Path, Task]]:
    if sets:
        return [(path, read_task(path)) for path in sets]
    if not SETS.is_dir():
        raise RequestError(f"no folder {SETS} here; name the file of a set (docs/yardstick.md)")
    found: list[tuple[Path, Task]] = []
    for path in sorted(SETS.glob("*.toml")):
        try:
            found.append((path, read_task(path)))
        except (DataError, StudyError) as error:
            sink.note(f"left out: {error}")
    if not found:
        raise RequestError(f"{SETS}: no set whose data are at hand; docs/datasets.md says where each can be had")
    return found


def _usual(path: Path, task: Task) -> dict[str, Method]:
    """The methods that a set names, by their files as seen from here.

    Raises:
        RequestError: a file that is not there.
    """
    files = [os.path.relpath(path.parent / one) for one in task.said.methods]
    for file in files:
        if not Path(file).is_file():
            raise RequestError(f"{path}: methods: no file {file}")
    return {file: _method(file) for file in files}


def _method(name: str) -> Method:
    """What a name stands for.

    Raises:
        RequestError: nothing that predicts.
    """
    path, first = Path(name), name.removeprefix(FIRST)
    if first != name:
        _library(name, first)  # an unknown ship is told before anything is measured
        return lambda task, asked: _by_fit(*_fitted_first(first, task), asked)
    if path.suffix == ".toml" and path.is_file() and "seatrial-study/" in path.read_text(encoding="utf-8"):
        return lambda task, asked: _by_fit(*_fitted(read_study(path, trials=task.train)), asked)
    if path.is_file() and (path.suffix == ".py" or os.access(path, os.X_OK)):
        return lambda task, asked: _by_program(path, task, asked)
    ship = _library(name, name)
    return lambda task, asked: _by_ship(ship, asked)


def _library(name: str, ship: str) -> Ship:
    """The ship that a method names."""
    try:
        return load(ship)
    except ShipError as error:
        raise RequestError(f"--method {name}: {error}; a method is a study, a ship or a program") from None


def _measured(task: Task, methods: dict[str, Method], sink: Sink) -> Row:
    standings: list[Standing] = []
    refused: dict[str, str] = {}
    for name, method in {BASELINE: _by_constant_velocity, **methods}.items():
        sink.note(f"{task.name}: {name}, {len(task.questions)} questions")
        begin = _processor()
        answers: list[Trial | None] = []
        known: list[Trial | None] = []
        try:
            for part in task.parts or (task,):
                told = method(part, [one.asked for one in (*part.questions, *part.known)])
                answers += told[: len(part.questions)]
                known += told[len(part.questions) :]
        except (RequestError, FitError, SimulationError) as error:
            refused[name] = str(error)
            continue
        standings.append(scored(task, name, answers, known, _processor() - begin))
    return Row(task.name, task.said.title, tuple(one.name for one in task.train), tuple(standings), refused)


def _processor() -> float:
    """Processor time of this process and of the programs that it waited for [s]; other work beside does not count."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


def _by_constant_velocity(task: Task, asked: Sequence[Trial]) -> Answers:
    return [constant_velocity(filled.rows(filled.t >= 0.0), None, state) for filled, state in map(_begun, asked)]


def _begun(asked: Trial) -> tuple[Trial, np.ndarray]:
    """A question with the state at its start held after it, and that state, shape (6,), from what was read before."""
    before = asked.t <= 0.0
    state = begun(asked.rows(before))[0][-1]
    held = {name: np.where(before & np.isfinite(asked[name]), asked[name], value) if name in asked
            else np.full(len(asked), value) for name, value in zip(STATES, state, strict=True)}  # fmt: skip
    return asked.having(**held), state


def _by_ship(ship: Ship, asked: Sequence[Trial]) -> Answers:
    return _by_fit(ship, {}, frozenset(), asked)


def _by_fit(ship: Ship, errors: Errors, made: Collection[str], asked: Sequence[Trial]) -> Answers:
    """Predictions of a ship whose instruments have errors, as these instruments read them.

    Args:
        made: velocities that the logger made of track and heading.
    """
    answers: list[Trial | None] = []
    for one in asked:
        filled, _ = _begun(as_true(one, errors, ship.model, made=made))
        try:
            answer = replay(ship, filled, begin=(0.0, None))
        except SimulationError:
            answers.append(None)
            continue
        answers.append(as_logged(answer, errors, ship.model, made) if errors else answer)
    return answers


def _fitted(study: Study) -> tuple[Ship, Errors, Collection[str]]:
    """The ship of a fit, the errors that all trials share, and velocities that did not count beside the track."""
    fit = study.estimator.fit(study.problem)
    return fit.ship, shared_by_all(fit.nuisances), uncounted(study.problem.loss.sigma)


def _fitted_first(ship: str, task: Task) -> tuple[Ship, Errors, Collection[str]]:
    """Fitted by the study that `study new` writes, some of the training trials held out as it does."""
    with tempfile.TemporaryDirectory(prefix="yardstick-") as where:
        folder = Path(where) / "train"
        folder.mkdir()
        write_trials(task.train, folder)
        new_study("new", ship, folder, Path(where) / "study.toml")
        return _fitted(read_study(Path(where) / "study.toml"))


def _by_program(path: Path, task: Task, asked: Sequence[Trial]) -> Answers:
    """Answers that a program writes; what it did not write, or wrote on other rows, is missing.

    Raises:
        DataError: it ended with an error; the last line that it wrote.
    """
    names = [f"q{k:04d}" for k in range(len(asked))]
    said = {"set": task.name, "given": task.said.given, "judged": JUDGED, "horizons": task.said.horizons,
            "history": task.said.history, "scale": dict(task.scale)}  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="yardstick-") as where:
        home = Path(where)
        for name in ("train", "asked", "predicted"):
            (home / name).mkdir()
        write_trials(task.train, home / "train")
        write_trials([_named(one, name) for one, name in zip(asked, names, strict=True)], home / "asked")
        (home / "task.json").write_text(json.dumps(said, indent=1), encoding="utf-8")
        command = [sys.executable, str(path)] if path.suffix == ".py" else [str(path.resolve())]
        # What the program may not see is not told to it.
        around = {name: value for name, value in os.environ.items() if name != DATA}
        done = subprocess.run([*command, where], env=around, capture_output=True, text=True, check=False)
        if done.returncode:
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            needs = path.with_name("requirements.txt")
            remedy = f"; pip install -r {needs}" if "ModuleNotFoundError" in last and needs.is_file() else ""
            raise DataError(f"{path} ended with {done.returncode}: {last}{remedy}")
        there = home / "predicted"
        written = {one.name: one for one in read_trials(there)} if any(there.glob("*.csv")) else {}
    return [written.get(name) for name in names]


def _named(trial: Trial, name: str) -> Trial:
    return Trial(name, trial.t, trial.channels, units=trial.units, meta={})


def _shown(rows: Sequence[Row]) -> Body:
    body: Body = ()
    for row in rows:
        cells = [
            (one.method if k == 0 else "", figure(one.eq25, 3) if k == 0 else "", figure(ahead.horizon, 3),
             figure(ahead.position, 3), figure(DEGREES["psi"] * ahead.heading, 3), figure(100.0 * ahead.coverage, 3),
             figure(ahead.width[0], 3), figure(DEGREES["psi"] * ahead.width[1], 3), figure(ahead.log_score, 3),
             f"{one.failed}/{one.count}" if k == 0 else "", figure(one.seconds, 3) if k == 0 else "")
            for one in row.standings for k, ahead in enumerate(one.ahead)
        ]  # fmt: skip
        head = (row.name, "Eq. 25", "ahead [s]", "position [m]", "heading [deg]", "in 95 % [%]", "wide [m]",
                "wide [deg]", "log score", "failed", "processor [s]")  # fmt: skip
        body += table(head, cells)
    return body + bullets((
        "Errors are root mean squares at that time after a start. Bands that a method does not give are those of its "
        "errors on training trials.",
        "Eq. 25 (Wakita 2022) is of all rows and states, lower is better; a dash: states are not predicted, or an "
        "answer is no number.",
    ))  # fmt: skip
