"""What a study says that its tables alone cannot judge: settings against trials, and trials against the ship."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..data import Trial
from ..data.prepare import unbroken
from ..models import STATES, follows
from ..ships import Ship
from . import StudyError

# Median steps of a trial: beyond, the trial is split; beyond, a time step is coarse.
_MISSING, _COARSE = 10, 10
_KINDS = ((int, "a whole number"), (float, "a number"), (str, "a text"), (bool, "true or false"))


def kind(value: object) -> str:
    """What a key must be, in words, by a value that it may have."""
    return next((words for known, words in _KINDS if type(value) is known), f"a {type(value).__name__}")


def finite(where: str, table: Mapping[str, Any]) -> None:
    """Refuse settings that no estimator can work with, tables of numbers and threads included.

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
    """Refuse a standard deviation that is none.

    Raises:
        StudyError: naming the key.
    """
    for key, value in table.items():
        if not (value > 0 and math.isfinite(value)):
            raise StudyError(f"{where}.{key} is {value:g}; it must be a finite number above zero")


def no_infinity(where: str, value: Any, but: tuple[str, ...]) -> None:
    """Refuse an infinite number anywhere in a document but below the keys that may hold one.

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
    """Judge dt and every against the trials.

    Returns:
        What to warn of.

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
    """Trials without long leaps of time, and which were split for them."""
    out: list[Trial] = []
    notes: list[str] = []
    for trial in trials:
        parts = unbroken(trial, _MISSING * trial.dt) if len(trial) > 2 else (trial,)
        out += parts
        if parts != (trial,):
            notes.append(f"warning: {trial.name} leaps over {_MISSING} steps of time; taken as {len(parts)} trials")
    return tuple(out), notes


def filled(path: Path, ship: Ship, trials: Iterable[Trial]) -> None:
    """Refuse a trial one of whose channels that the fit needs is empty.

    Raises:
        StudyError: naming trial and channel.
    """
    orders = follows(ship.model)
    for trial in trials:
        needed = [c if c in trial else order for c, (order, _) in zip(ship.model.controls, orders, strict=True)]
        for name in (*STATES, *needed):
            if name in trial and not np.isfinite(trial[name]).any():
                raise StudyError(f"{path}: {trial.name}: channel {name} has no values; fill it, or leave the trial out")
