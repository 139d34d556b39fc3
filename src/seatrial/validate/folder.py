"""What is in a folder of recordings: kinds of manoeuvre, ranges, and what each trial has that no other has."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np

from ..belief.coverage import Reference
from ..core.values import dataclass
from ..data import DataError, Trial
from ..data.check import Finding
from ..data.folder import Folder, overlaps
from ..data.kinds import Kind, compared, recognised
from ..data.kinds.parts import Part, parts
from ..data.prepare import drop_trailing_gaps

RANGES = ("u", "v_m", "r", "delta", "n_P")
"""Channels whose range is told."""


@dataclass(frozen=True)
class Entry:
    """One recording.

    Attributes:
        trial: without its empty end.
        kind: as it was recognised.
        told: `kind` of the sidecar, empty where there is none; `verdict` what `data.kinds.compared` says of it.
        ranges: 1st and 99th percentile of `RANGES`, SI units, as far as they are there.
        new: share of samples that no other recording has the like of; NaN where that cannot be told.
        parts: its manoeuvres, where it holds several.
    """

    trial: Trial
    kind: Kind
    told: str
    verdict: str
    ranges: Mapping[str, tuple[float, float]]
    new: float
    parts: tuple[Part, ...] = ()


@dataclass(frozen=True)
class Survey:
    """All recordings of a folder, by name, the pairs that overlap, and why coverage cannot be told (empty: it can)."""

    folder: Folder
    entries: Mapping[str, Entry]
    overlaps: tuple[Finding, ...]
    uncovered: str = ""

    @property
    def counts(self) -> dict[str, int]:
        """How many recordings of each kind, the most frequent first."""
        return dict(Counter(one.kind.name for one in self.entries.values()).most_common())


def survey(folder: Folder) -> Survey:
    """Look at every recording of a folder."""
    whole = {name: drop_trailing_gaps(trial) for name, trial in folder.trials.items()}
    own: Mapping[str, float] = {}
    why = ""
    try:
        # fewer than three files would be judged by their own parts
        own = Reference.of(tuple(whole.values())).own if len(whole) > 2 else {}
        why = "" if own else "three recordings at least are needed"
    except DataError as error:
        why = str(error).removeprefix("coverage: ")
    entries = {name: _entry(trial, own.get(name, float("nan"))) for name, trial in whole.items()}
    return Survey(folder, entries, overlaps(whole), why)


def _entry(trial: Trial, new: float) -> Entry:
    kind, told = recognised(trial), trial.meta.get("kind")
    ranges: dict[str, tuple[float, float]] = {}
    for name in RANGES:
        if name in trial and (good := trial[name][np.isfinite(trial[name])]).size:
            low, high = np.quantile(good, [0.01, 0.99])
            ranges[name] = float(low), float(high)
    said = told if isinstance(told, str) else ""
    return Entry(trial, kind, said, compared(trial, kind), ranges, new, parts(trial, kind))
