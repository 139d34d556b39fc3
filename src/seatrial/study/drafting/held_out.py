"""Which recordings are held out of a fit: whole ones, by kind, side and time, and never a copy of what is fitted."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime

from ...data import Trial
from ...data.folder import overlaps
from ...data.kinds import Kind
from ...data.sidecar import began
from ...identify import StudyError

_HELD = 0.25
"""Part of the recordings of a kind that is held out, at least one of two."""

ROWS = 30
"""Rows that a recording needs at least, to be fitted or to judge."""

_DATE = re.compile(r"(\d{1,2}-[A-Z][a-z]{2}-\d{4}|\d{4}-\d\d-\d\d)[_ T](\d\d)[:_-]?(\d\d)[:_-]?(\d\d)")


def copies(trials: Mapping[str, Trial]) -> dict[str, str]:
    """Recordings that hold rows of a longer one, with its name."""
    out: dict[str, str] = {}
    for one in overlaps(trials):
        shorter, longer = sorted(one.trials, key=lambda name: (trials[name].duration, name))
        out.setdefault(shorter, f"shares rows with {longer}, which is kept")
    return out


def held_out(
    trials: Mapping[str, Trial], kinds: Mapping[str, Kind], parts: bool
) -> tuple[dict[str, tuple[str, ...]], dict[str, tuple[str, ...]], tuple[str, ...]]:
    """Recordings for training and for test by kind, the later ones of each for test; and notes."""
    groups: dict[str, list[str]] = {}
    for name in _in_time(trials):
        groups.setdefault(kinds[name].name, []).append(name)
    train: dict[str, tuple[str, ...]] = {}
    test: dict[str, tuple[str, ...]] = {}
    by_time = parts or timed(trials)
    for kind in sorted(groups, key=lambda one: -len(groups[one])):
        held = set(_chosen(groups[kind], kinds, by_time))
        train[kind] = tuple(name for name in groups[kind] if name not in held)
        test[kind] = tuple(name for name in groups[kind] if name in held)
    if not any(test.values()):
        # one of each kind: the last recording of all judges the others
        last = _in_time(trials)[-1]
        train[kinds[last].name], test[kinds[last].name] = (), (last,)
    alone = [kind for kind in train if not test[kind]]
    notes = [f"{kind}: one recording only, for training; nothing of this kind judges the model" for kind in alone]
    notes += [f"{kind}: in the test only" for kind in train if not train[kind]]
    if parts:
        notes = ["one recording only: cut in time, the last part judges the first; record another for a real test"]
    return train, {kind: names for kind, names in test.items() if names}, tuple(notes)


def _chosen(names: Sequence[str], kinds: Mapping[str, Kind], by_time: bool) -> list[str]:
    """A quarter of the recordings of a kind, of each side that has three or more; at least one of two."""
    sides: dict[float, list[str]] = {}
    for name in names:
        sides.setdefault(kinds[name].settings.get("side", 0.0), []).append(name)
    held = [
        one
        for some in sides.values()
        if len(some) > 2
        for one in _some(some, max(1, round(_HELD * len(some))), by_time)
    ]
    return held or (_some(names, 1, by_time) if len(names) > 1 else [])


def _some(names: Sequence[str], count: int, by_time: bool) -> list[str]:
    """The latest; where no times are known, some from within the order of the names, not its ends."""
    return list(names[-count:]) if by_time else [names[int((k + 0.5) * len(names) / count)] for k in range(count)]


def timed(trials: Mapping[str, Trial]) -> bool:
    """Whether it is known when the recordings were made."""
    return len({began(name, trial.meta) or dated(name) for name, trial in trials.items()} - {0}) > 1


def _in_time(trials: Mapping[str, Trial]) -> list[str]:
    """Names in the order in which they were recorded: by `start`, else by a date in the name, else by name."""
    stamps = {name: began(name, trial.meta) / 1e9 or dated(name) for name, trial in trials.items()}
    return sorted(trials, key=lambda name: (stamps[name], name))


def dated(name: str) -> float:
    """A date and time in a name as seconds since 1970; 0 without."""
    found = _DATE.search(name)
    if found is None:
        return 0.0
    parts = found.groups()
    form = "%Y-%m-%d %H %M %S" if parts[0][:4].isdigit() else "%d-%b-%Y %H %M %S"
    try:
        return datetime.strptime(" ".join(parts), form).replace(tzinfo=UTC).timestamp()
    except ValueError:
        return 0.0


def cut(trials: Mapping[str, Trial]) -> tuple[dict[str, Trial], tuple[Trial, ...]]:
    """The first and the last part of the only recording."""
    (name, trial), stem = next(iter(trials.items())), next(iter(trials)).rpartition("/")[2]
    k = round((1.0 - _HELD) * len(trial))
    if len(trial) - k < ROWS:
        raise StudyError(f"{name}: {len(trial)} rows of one recording are too few to keep some for the test")
    parts = (replace(trial.rows(slice(None, k)).noting(f"rows 1 to {k} of {name}"), name=f"{stem}_first"),
             replace(trial.rows(slice(k, None)).noting(f"rows after {k} of {name}"), name=f"{stem}_last"))  # fmt: skip
    return {part.name: part for part in parts}, parts
