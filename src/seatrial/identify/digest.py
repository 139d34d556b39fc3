"""Fingerprint of a fit: everything that decides its numbers, for resuming and for provenance."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from ..data import Trial
from ..ships.writing import to_toml
from . import Estimator, Problem


def digest(problem: Problem, estimator: Estimator) -> str:
    """Fingerprint of everything that decides the numbers of a fit."""
    found = hashlib.sha256()
    settings: Any = estimator
    if hasattr(settings, "threads"):
        settings = replace(settings, threads=None)  # their number changes no digit
    for part in (to_toml(problem.ship), problem.free, problem.loss, problem.nuisance, settings):
        found.update(repr(part).encode())
    include(found, "train", problem.trials)
    include(found, "validation", problem.validation)
    return found.hexdigest()[:16]


def include(found: Any, part_of: str, trials: Iterable[Trial]) -> None:
    """Add the names, times and channels of `trials`, in the role `part_of`, to a hash."""
    for trial in trials:
        found.update(f"{part_of} {trial.name}".encode())
        found.update(trial.t.tobytes())
        for name in sorted(trial.channels):
            found.update(name.encode() + trial[name].tobytes())
