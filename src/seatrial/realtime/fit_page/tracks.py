"""Tracks of a few training trials, measured and as the ship of the search would sail them."""

from __future__ import annotations

import re
import threading
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from ...data import Trial
from ...replay import replay
from ...ships import Ship

if TYPE_CHECKING:
    from .board import Board, Part

_TRIALS, _POINTS = 2, 600
"""Trials that are drawn, and points of a track, at most."""

PERIOD, _SHARE = 3.0, 50.0
"""Time between two predictions [s]; it is so many times the work of one, if that is longer."""


def shown(trials: tuple[Trial, ...]) -> tuple[Trial, ...]:
    """Those that are drawn: of different kinds, as far as their names tell kinds apart."""
    kinds: dict[str, Trial] = {}
    for trial in trials:
        kinds.setdefault(re.split(r"[^A-Za-z]", trial.name, maxsplit=1)[0].lower(), trial)
    some = list(kinds.values())[:_TRIALS]
    return (*some, *(t for t in trials if all(t is not one for one in some)))[:_TRIALS]


def measured(trial: Trial) -> dict[str, Any]:
    """Name and track [m] of a trial as it was sailed; gaps are null."""
    return {"name": trial.name, "track": _track(trial, None)}


def predicted(ship: Ship, trial: Trial, restart: float | None) -> dict[str, Any]:
    """The same of a ship that sails it anew, set back to the measured state every `restart` seconds; why not, if so."""
    try:
        return {"track": _track(replay(ship, trial, restart=restart, threads=1), restart)}
    except (ValueError, RuntimeError, ArithmeticError) as error:
        return {"track": [], "failed": str(error)}


def _track(trial: Trial, restart: float | None) -> list[list[float] | None]:
    """North and east of some rows; null where the line breaks."""
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
    """Predicts in a thread of its own, now and then, while somebody looks."""

    def __init__(self, board: Board) -> None:
        self._board, self._over = board, threading.Event()
        self._done: tuple[Part | None, Any] = None, None
        self._thread = threading.Thread(target=self._run, name="tracks", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def close(self) -> None:
        """Predict a last time, if that is due, and end."""
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
        """Predict where there is something new and somebody to see it."""
        part = self._board.part
        if part is None or part.ship is None or not self._board.looked or (part, part.ship) == self._done:
            return False
        make, iteration = part.ship, part.last[0] if part.last else 0
        self._done = part, make
        try:
            ship = make()
        except (ValueError, RuntimeError, ArithmeticError):  # values on the way that make no ship
            return True
        part.tracks = {
            "iteration": iteration, "predicted": [predicted(ship, trial, part.restart) for trial in part.trials],
        }  # fmt: skip
        return True
