"""Recordings: trials that were cut from one log share its weather and its errors, so none is a test of another."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence

from ..data import Trial

# The note of `data.prepare` on a trial that it cuts at its gaps, with parts named NAME_1, NAME_2, ...
_CUT = re.compile(r"run (\d+) (?:without gaps|between leaps of time)")
# The second at which a recording began: 06-Aug-2020_16_24_25, 2020-08-06T16:24:25, 20200806_162425.
_STAMP = re.compile(
    r"(?<!\d)(?:\d{2}[-_.][A-Za-z]{3}[-_.]\d{4}|\d{4}[-_.]?\d{2}[-_.]?\d{2})[-_ T]+\d{2}[-_:.]?\d{2}[-_:.]?\d{2}(?!\d)"
)
_PART = re.compile(r"(.+)_(\d{1,3})")


def recording(trial: Trial) -> str:
    """Name of the recording that a trial comes from.

    Parts that were cut here say so in their processing. A data set that ships its recordings in parts names them after
    the second at which they began, and what stands around it is kind and number of the part.
    """
    name = trial.name
    for step in reversed(trial.meta.get("processing", ())):
        cut = _CUT.fullmatch(str(step))
        if cut:
            name = name.removesuffix(f"_{cut[1]}")
    stamp = _STAMP.search(name)
    return stamp[0] if stamp else name


def recordings(trials: Iterable[Trial]) -> list[list[Trial]]:
    """The trials by recording, in the order of their names.

    Where names hold no time, NAME (or NAME_1) and NAME_2 are one recording if the clock of the one continues in the
    other, after a pause no longer than the longer of the two.
    """
    found: dict[str, list[Trial]] = {}
    for trial in sorted(trials, key=lambda t: t.name):
        found.setdefault(recording(trial), []).append(trial)
    out: list[list[Trial]] = []
    for group in sorted(found.values(), key=lambda group: _place(group[0])):
        if out and _goes_on(out[-1][-1], group[0]):
            out[-1] += group
        else:
            out.append(group)
    return sorted(out, key=lambda group: group[0].name)


def dealt(trials: Sequence[Trial], parts: int, kind: Callable[[Trial], str] = lambda trial: "") -> list[list[Trial]]:
    """The trials in `parts` parts, whole recordings dealt by turns: kind after kind, in the order of names."""
    groups = sorted(recordings(trials), key=lambda group: (kind(group[0]), group[0].name))
    return [[trial for group in groups[part::parts] for trial in group] for part in range(parts)]


def _place(trial: Trial) -> tuple[str, int]:
    """Sort key of a trial; part 10 after part 2."""
    part = _PART.fullmatch(trial.name)
    return (part[1], int(part[2])) if part else (trial.name, 0)


def _goes_on(one: Trial, other: Trial) -> bool:
    """Whether two trials are consecutive parts of one name, and of one clock."""
    (stem, number), (other_stem, other_number) = _place(one), _place(other)
    if stem != other_stem or other_number != max(number, 1) + 1 or not len(one) or not len(other):
        return False
    return 0.0 < float(other.t[0] - one.t[-1]) <= max(one.duration, other.duration)
