"""How recordings are dealt into the parts that fits leave out: by turns, or so that a part differs as new trials do.

A part that shares its day, its kind of manoeuvre or its wind with the trials of the fit is predicted better than one
that does not.  Recordings stay whole in every way of dealing.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from ..data import Trial
from ..identify import StudyError
from ..identify.recordings import dealt, recordings
from .grounds import kind_of

# A day in the name of a recording: 06-Aug-2020, 2020-08-06, 20200806.
_DAY = re.compile(r"(?<!\d)(?:\d{2}[-_.][A-Za-z]{3}[-_.]\d{4}|\d{4}[-_.]?\d{2}[-_.]?\d{2})(?!\d)")
_STARTED = re.compile(r"\d{4}-\d{2}-\d{2}")

Group = list[Trial]

_TURNS = "recording"
# Slow, middle, fast: fewer leave no extrapolation on both sides, more leave parts of a trial or two.
_RANGES = 3


def day(trial: Trial) -> str:
    """The day of a trial, by its start, else by its name; empty where neither tells it."""
    started = _STARTED.match(str(trial.meta.get("start", trial.meta.get("epoch_utc", ""))))
    return started[0] if started else day_named(trial.name)


def day_named(name: str) -> str:
    """The day in the name of a recording, as it is written; empty where there is none."""
    found = _DAY.search(name)
    return found[0] if found else ""


def folds(trials: Sequence[Trial], by: str, parts: int) -> list[list[Trial]]:
    """The trials in parts, whole recordings.

    Args:
        by: of `FOLDS`: "recording" deals them by turns, each kind of manoeuvre after the other; "day", "kind" and
            "kind-day" make a part of each day, of each kind, and of each kind on each day; "speed" and "wind" one of
            each third of the recordings, by mean speed or true wind.
        parts: how many, dealt by turns.

    Raises:
        StudyError: fewer recordings than parts, or trials that this way of dealing does not tell apart.
    """
    groups = recordings(trials)
    if by == _TURNS:
        if len(groups) < parts:
            raise StudyError(f"--parts is {parts}; there are {len(groups)} recordings to leave out")
        return dealt(trials, parts, kind_of)
    found = FOLDS[by](groups, parts)
    if len(found) < 2:
        raise StudyError(f"--folds {by}: the recordings are not told apart so ({_NEEDS[by]}); "
                         f"this set supports {', '.join(supported(trials, parts))}")  # fmt: skip
    return found


def supported(trials: Sequence[Trial], parts: int) -> dict[str, list[list[Trial]]]:
    """The parts of every way of dealing that tells the recordings apart otherwise than those before it."""
    groups, found = recordings(trials), dict[str, list[list[Trial]]]()
    if len(groups) >= parts:
        found[_TURNS] = dealt(trials, parts, kind_of)
    for by, deal in FOLDS.items():
        if by == _TURNS:
            continue
        made = deal(groups, parts)
        if len(made) > 1 and not any(_same(made, other) for other in found.values()):
            found[by] = made
    return found


def _same(one: Sequence[Sequence[Trial]], other: Sequence[Sequence[Trial]]) -> bool:
    names = [{frozenset(trial.name for trial in part) for part in parts} for parts in (one, other)]
    return names[0] == names[1]


def _by_key(groups: Sequence[Group], key: Callable[[Trial], str]) -> list[list[Trial]]:
    """A part of each value of the key; none where a recording has no value."""
    found: dict[str, list[Trial]] = {}
    for group in groups:
        found.setdefault(key(group[0]), []).extend(group)
    return [] if "" in found else [found[name] for name in sorted(found)]


def _by_level(groups: Sequence[Group], level: Callable[[Trial], float]) -> list[list[Trial]]:
    """Low, middle and high third of a level; none where a recording has no level, or all have the same."""
    levels = np.array([np.mean([level(trial) for trial in group]) for group in groups])
    if not np.isfinite(levels).all() or np.ptp(levels) <= 1e-6 * max(np.abs(levels).max(), 1e-12):
        return []
    thirds = np.array_split(np.argsort(levels, kind="stable"), min(_RANGES, len(groups)))
    return [[trial for k in some for trial in groups[k]] for some in thirds]


def _speed(trial: Trial) -> float:
    if "u" not in trial:
        return np.nan
    return float(np.nanmean(np.abs(trial["u"]))) if np.isfinite(trial["u"]).any() else np.nan


def _wind(trial: Trial) -> float:
    return float(np.nanmean(trial["U_T"])) if "U_T" in trial and np.isfinite(trial["U_T"]).any() else np.nan


def _kind_day(trial: Trial) -> str:
    return f"{kind_of(trial)} {day(trial)}" if day(trial) else ""


FOLDS: Mapping[str, Callable[[Sequence[Group], int], list[list[Trial]]]] = MappingProxyType({
    _TURNS: lambda groups, parts: dealt([trial for group in groups for trial in group], parts, kind_of),
    "day": lambda groups, _: _by_key(groups, day),
    "kind": lambda groups, _: _by_key(groups, kind_of),
    "kind-day": lambda groups, _: _by_key(groups, _kind_day),
    "speed": lambda groups, _: _by_level(groups, _speed),
    "wind": lambda groups, _: _by_level(groups, _wind),
})  # fmt: skip
"""Ways of dealing recordings into parts."""

_NEEDS = {"day": "two days, in names or starts", "kind": "two kinds of manoeuvre",
          "kind-day": "two kinds, or days in names or starts", "speed": "a speed u that differs",
          "wind": "a true wind U_T that differs"}  # fmt: skip
