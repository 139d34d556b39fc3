"""State of running fits for the live page, without network or lock: fits write, the page reads; tracks of trials."""

from __future__ import annotations

import math
import re
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core.parameters import Free, specs, values
from ...core.values import dataclass
from ...data import Trial
from ...identify import Problem, Progress
from ...identify.watch import MakeShip, stage
from ...ships import Ship
from ...simulate.replay import replay

FITTING, REPORTING, DONE, FAILED, STOPPED = "fitting", "writing the report", "done", "failed", "stopped"
"""States of a run."""

WAITING, BEFORE = "waiting", "done before"

STATIC = Path(__file__).with_name("static")
"""The page's own files; nothing is fetched from elsewhere."""

_QUIET = 2.0
"""Time after which a browser is told that there is no news [s]."""

_ROWS = 4000
"""Largest number of rows of a history; beyond it every second row is removed."""

Row = tuple[int, float, float, float]
"""Iteration, objective, validation or NaN, time since the fit began [s]."""


class Part:
    """One fit; the `Watcher` to which its estimator reports.

    Each method that the fit calls is a few assignments, which takes microseconds and never waits.

    Attributes:
        trials: trials whose tracks are drawn.
        history: how often it was thinned, and its rows.
        last: its last row, which may have been thinned out.
        ship: makes the ship with the present parameters of the search; None before there are any.
        tracks: predicted tracks and their iteration; written by the `Tracker`.
        beside: further receiver of every row.
        doing: description of the work before the first row.
    """

    def __init__(self, name: str, problem: Problem, restart: float | None, clock: Callable[[], float]) -> None:
        self.name, self.problem, self.restart = name, problem, restart
        self.trials = shown(problem.trials)
        self.history: tuple[int, list[Row]] = 0, []
        self.last: Row | None = None
        self.ship: MakeShip | None = None
        self.tracks: dict[str, Any] | None = None
        self.beside: Progress | None = None
        self.doing = ""
        self._clock, self._began, self._every = clock, clock(), 1
        self._read: tuple[MakeShip | None, list[float | None]] = None, []

    def at(self, ship: MakeShip) -> None:
        """Report the ship with the present parameters of the search."""
        self.ship = ship

    def stage(self, text: str) -> None:
        """Report the work before the first row."""
        self.doing = text
        stage(self.beside, text)

    def __call__(self, iteration: int, objective: float, validation: float) -> None:
        """Report a row of the history."""
        row = self.last = (iteration, objective, validation, self._clock() - self._began)
        edition, rows = self.history
        if iteration % self._every == 0:
            rows.append(row)
        if len(rows) >= _ROWS:
            self._every *= 2
            self.history = edition + 1, [kept for kept in rows if kept[0] % self._every == 0]
        if self.beside is not None:
            self.beside(iteration, objective, validation)

    def told(self) -> dict[str, Any]:
        """Constant data: parameters with their ranges, measured tracks."""
        problem = self.problem
        meant = specs(problem.ship.model)
        return {
            "name": self.name, "ship": problem.ship.name, "restart": self.restart,
            "trials": len(problem.trials), "validation": len(problem.validation),
            "free": [_parameter(f, *((meant[f.path].unit, meant[f.path].about) if f.path in meant else ("", "")))
                     for f in problem.free],
            "measured": [{"name": trial.name, "track": _track(trial, None)} for trial in self.trials],
        }  # fmt: skip

    def found(self) -> list[float | None]:
        """Present values of the free parameters; empty before there are any."""
        make = self.ship
        if make is not None and make is not self._read[0]:
            try:
                known = values(make().model)
            except ValueError:  # intermediate values for which no ship exists
                known = {}
            self._read = make, [_number(known.get(f.path, math.nan)) for f in self.problem.free]
        return self._read[1]


@dataclass
class Seen:
    """What one browser has already received."""

    part: int = -1
    edition: int = -1
    rows: int = 0
    tracks: Any = None


class Board:
    """A run of one or several fits.

    Args:
        title: of the run.
        files: the expected fits by name, with the file that each writes when it is done.
        before: fits of an earlier run, which are done.

    Attributes:
        parts: the fits that have begun; the page shows the last one.
        state, text: state of the run, and details in words.
        looked: whether a browser is connected.
    """

    def __init__(
        self, title: str, files: Mapping[str, Path] | None = None, clock: Callable[[], float] = time.monotonic,
        before: Iterable[str] = (),
    ) -> None:  # fmt: skip
        self.title, self.parts, self.looked = title, list[Part](), False
        self.state, self.text = FITTING, ""
        self._clock, self._began, self._ended = clock, clock(), math.nan
        self._files, self._at = files or {}, dict[int, str]()
        self._states = {**dict.fromkeys(before, BEFORE), **dict.fromkeys(self._files, WAITING)}

    @property
    def part(self) -> Part | None:
        """The fit that is shown."""
        return self.parts[-1] if self.parts else None

    def begin(self, name: str, problem: Problem, restart: float | None) -> Part:
        """Begin a fit."""
        part, thread = Part(name, problem, restart, self._clock), threading.get_ident()
        before = self._at.get(thread)  # a thread runs one fit after the other, so the one before has ended
        if before is not None and before not in self._files:
            self._states = {**self._states, before: DONE}
        self._at[thread] = name
        self._judge()
        self._states = {**self._states, name: FITTING}
        self.parts.append(part)
        return part

    def _judge(self, otherwise: str = FAILED) -> None:
        """Update the state of running fits by their files: done if the file exists, else `otherwise`."""
        for name, file in self._files.items():
            if self._states[name] == FITTING:
                self._states = {**self._states, name: DONE if file.exists() else otherwise}

    def end(self, state: str, text: str = "") -> None:
        """Set the state of the run."""
        if math.isnan(self._ended) and state != REPORTING:
            self._ended = self._clock()
        became = state if state in (FAILED, STOPPED) else DONE
        self._judge(STOPPED if state == STOPPED else FAILED)
        self._states = {name: became if now == FITTING else now for name, now in self._states.items()}
        self.state, self.text = state, text

    def news(self, seen: Seen) -> dict[str, Any]:
        """Changing data, with all that this browser has not received yet; updates `seen`."""
        ended = self._clock() if math.isnan(self._ended) else self._ended
        said: dict[str, Any] = {
            "title": self.title, "state": self.state, "text": self.text, "elapsed": round(ended - self._began, 1),
            "parts": [[name, state] for name, state in self._states.items()],
        }  # fmt: skip
        count = len(self.parts)
        if not count:
            return said
        part = self.parts[count - 1]
        if seen.part != count:
            seen.part, seen.edition, seen.tracks = count, -1, None
            said["part"] = part.told()
        edition, rows = part.history
        if seen.edition != edition:
            seen.edition, seen.rows, said["anew"] = edition, 0, True
        fresh = rows[seen.rows :]
        seen.rows += len(fresh)
        said |= {"rows": [_row(row) for row in fresh], "last": part.last and _row(part.last), "values": part.found(),
                 "doing": part.doing}  # fmt: skip
        if part.tracks is not seen.tracks:
            seen.tracks = said["tracks"] = part.tracks
        return said

    def pictures(self) -> Callable[[bool], dict[str, Any] | None]:
        """For one browser, as `pages.Source` says: its news, where more than the clock has changed."""
        seen, last, told = Seen(), dict[str, Any](), 0.0

        def following(closing: bool) -> dict[str, Any] | None:
            nonlocal last, told
            news, now = self.news(seen), time.monotonic()
            if {**news, "elapsed": 0.0} == {**last, "elapsed": 0.0} and not closing and now <= told + _QUIET:
                return None
            last, told = news, now
            return {**news, "over": closing}

        return following


def _row(row: Row) -> list[float | int | None]:
    iteration, objective, validation, seconds = row
    return [iteration, _number(objective), _number(validation), round(seconds, 2)]


def _parameter(f: Free, unit: str, about: str) -> dict[str, Any]:
    """A parameter and the range in which it is shown."""
    low, high = _range(f)
    return {
        "path": f.path, "unit": "" if unit == "-" else unit, "about": about, "start": _number(f.start),
        "low": _number(f.low), "high": _number(f.high), "prior": _number(f.prior), "sigma": _number(f.sigma),
        "from": low, "to": high,
    }  # fmt: skip


def _range(f: Free) -> tuple[float, float]:
    """Range between the bounds, or as wide as the prior makes likely, or around the start."""
    middle = f.prior if math.isfinite(f.prior) and math.isfinite(f.sigma) else f.start
    reach = (4.0 if math.isfinite(f.sigma) else 2.0) * f.scale
    return max(f.low, min(middle - reach, f.start)), min(f.high, max(middle + reach, f.start))


def _number(value: float) -> float | None:
    """A rounded number; None if it is not finite, which JSON cannot represent."""
    return float(f"{float(value):.6g}") if math.isfinite(value) else None


_TRIALS, _POINTS = 2, 600
"""Largest number of drawn trials, and of points of a track."""

PERIOD, _SHARE = 3.0, 50.0
"""Time between two predictions [s]; or this multiple of the time that one takes, if longer."""


def shown(trials: tuple[Trial, ...]) -> tuple[Trial, ...]:
    """Trials to draw: of different kinds, as far as their names identify kinds."""
    kinds: dict[str, Trial] = {}
    for trial in trials:
        kinds.setdefault(re.split(r"[^A-Za-z]", trial.name, maxsplit=1)[0].lower(), trial)
    some = list(kinds.values())[:_TRIALS]
    return (*some, *(t for t in trials if all(t is not one for one in some)))[:_TRIALS]


def predicted(ship: Ship, trial: Trial, restart: float | None) -> dict[str, Any]:
    """Predicted track of a trial, reset to the measured state every `restart` seconds; or the reason of a failure."""
    try:
        return {"track": _track(replay(ship, trial, restart=restart, threads=1), restart)}
    except (ValueError, RuntimeError, ArithmeticError) as error:
        return {"track": [], "failed": str(error)}


def _track(trial: Trial, restart: float | None) -> list[list[float] | None]:
    """North and east of some rows; null where the line is interrupted."""
    x, y, t = trial["x"], trial["y"], trial.t
    number = np.zeros(t.size) if restart is None else np.floor((t - t[0]) / restart + 1e-6)
    out: list[list[float] | None] = []
    every = max(t.size // _POINTS, 1)
    breaks = {0, *(np.flatnonzero(np.diff(number)) + 1).tolist()} - {t.size - 1}  # no prediction starts at the end
    for k in range(t.size):
        if k in breaks and out:
            out.append(None)
        if k in breaks or k % every == 0 or k == t.size - 1 or k + 1 in breaks:
            good = np.isfinite(x[k]) and np.isfinite(y[k])
            out.append([round(float(x[k]), 3), round(float(y[k]), 3)] if good else None)
    return out


class Tracker:
    """Predicts tracks periodically in a thread of its own, while a browser is connected."""

    def __init__(self, board: Board) -> None:
        self._board, self._over = board, threading.Event()
        self._done: tuple[Part | None, Any] = None, None
        self._thread = threading.Thread(target=self._run, name="tracks", daemon=True)

    def __enter__(self) -> None:
        """Start the thread."""
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        """Predict a last time, if that is due, and end the thread."""
        self._over.set()
        self._thread.join(5.0)

    def _run(self) -> None:
        pause = 0.0
        while not self._over.wait(pause):
            began = time.thread_time()
            told = self._look()
            pause = max(PERIOD, _SHARE * (time.thread_time() - began)) if told else 0.5
        self._look()

    def _look(self) -> bool:
        """Predict if there is something new and a browser to show it to."""
        part = self._board.part
        if part is None or part.ship is None or not self._board.looked or (part, part.ship) == self._done:
            return False
        make, iteration = part.ship, part.last[0] if part.last else 0
        self._done = part, make
        try:
            ship = make()
        except (ValueError, RuntimeError, ArithmeticError):  # intermediate values for which no ship exists
            return True
        part.tracks = {
            "iteration": iteration, "predicted": [predicted(ship, trial, part.restart) for trial in part.trials],
        }  # fmt: skip
        return True
