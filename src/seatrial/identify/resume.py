"""Checkpoint of a fit: written whole at intervals, read back after a kill; and its fingerprint, also for provenance."""

from __future__ import annotations

import hashlib
import time
import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import ResumeError as ResumeError
from ..core.files import packed, set_aside, write_whole
from ..core.unpacking import unpacked
from ..core.values import dataclass, field, replace
from ..data import Array, Trial
from ..ships.writing import to_toml
from . import Estimator, Problem
from .trajectory.gauss_newton import State

# A kill loses at most this time [s]; fast iterations do not wait for the disk.
_PAUSE = 0.2


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


def kept_arrays(path: Path | None, digest: str, needed: Iterable[str]) -> dict[str, Any] | None:
    """All arrays of a checkpoint but its digest; None where there is none, or a damaged one (`begin_anew`).

    Args:
        digest: fingerprint of the problem.
        needed: names without which the file is damaged.

    Raises:
        ResumeError: the file belongs to another problem.
    """
    if path is None or not path.exists():
        return None
    content = path.read_bytes()
    try:
        found = unpacked(content)
        kept = str(found.pop("digest"))
        if missing := set(needed) - set(found):
            raise KeyError(", ".join(sorted(missing)))
    except (ValueError, KeyError, SyntaxError):
        begin_anew(path)
        return None
    if kept != digest:
        raise foreign(path, f" (digest {kept}, this is {digest})")
    return found


def digest_of(path: Path) -> str:
    """Fingerprint of the problem that a checkpoint belongs to; empty where the file is damaged."""
    try:
        return str(unpacked(path.read_bytes())["digest"])
    except (ValueError, KeyError, SyntaxError):
        return ""


def foreign(path: Path, which: str = "") -> ResumeError:
    """The error for a file that belongs to another problem."""
    return ResumeError(f"{path} belongs to another problem{which}; choose another output folder")


def begin_anew(path: Path) -> None:
    """Set a damaged checkpoint aside, and warn that the fit starts from the beginning."""
    aside = set_aside(path)
    warnings.warn(f"{path}: is damaged; set aside as {aside.name}, and the fit starts from the beginning", stacklevel=2)


def forget(checkpoint: Path) -> None:
    """Remove a checkpoint and the files beside it with its stem, once the fit is saved."""
    for file in checkpoint.parent.glob(f"{checkpoint.stem}.*"):
        file.unlink(missing_ok=True)


@dataclass
class Resume:
    """Progress of all starts; the one mutable record of a fit.

    Attributes:
        path: checkpoint file, or None to keep nothing.
        digest: fingerprint of the problem it belongs to.
        began: start of the clock, seconds already spent included.
        states: last state of each start.
        rows: of the history in the order of time: (start, objective, validation, seconds).
        written: when the file was last written [s].
    """

    path: Path | None
    digest: str
    began: float
    states: dict[int, State] = field(default_factory=dict[int, State])
    rows: list[tuple[float, float, float, float]] = field(default_factory=list[tuple[float, float, float, float]])
    written: float = 0.0

    @staticmethod
    def open(path: Path | None, digest: str, began: float) -> Resume:
        """Read `path` if it holds this problem; an empty record if there is no file.

        Raises:
            ResumeError: the file belongs to another problem.
        """
        data = kept_arrays(path, digest, ("starts", "counts", "done", "rows"))
        if data is None or path is None:
            return Resume(path, digest, began)
        try:
            states = {
                int(k): State(data[f"p{k}"], data[f"eta{k}"], float(one[0]), float(one[1]), int(one[2]), int(one[3]),
                              str(done), int(one[4]))
                for k, one, done in zip(data["starts"], data["counts"], data["done"], strict=True)
            }  # fmt: skip
            rows = [(float(a), float(b), float(c), float(d)) for a, b, c, d in data["rows"]]
        except (KeyError, ValueError, IndexError, TypeError):
            begin_anew(path)
            return Resume(path, digest, began)
        return Resume(path, digest, began - (rows[-1][3] if rows else 0.0), states, rows)

    @property
    def history(self) -> Array:
        """Rows (number, objective, validation, seconds), one start after the other."""
        rows = np.array(self.rows).reshape(-1, 4)
        rows = rows[np.argsort(rows[:, 0], kind="stable")]
        return np.column_stack([np.arange(1.0, len(rows) + 1.0), rows[:, 1:]])

    def note(self, start: int, state: State, validation: float) -> None:
        """Note an iteration of a start, and write it."""
        self.states[start] = state
        self.rows.append((float(start), state.cost, validation, time.perf_counter() - self.began))
        if time.perf_counter() - self.written > _PAUSE:
            self.write()

    def best(self) -> State | None:
        """State of the start with the least objective."""
        finite = [s for s in self.states.values() if np.isfinite(s.cost)]
        return min(finite, key=lambda s: s.cost) if finite else None

    def write(self) -> None:
        """Write it, if there is a file."""
        if self.path is None:
            return
        self.written, states = time.perf_counter(), self.states
        arrays = {f"p{k}": s.p for k, s in states.items()} | {f"eta{k}": s.eta for k, s in states.items()}
        write_whole(self.path, packed(
            digest=np.array(self.digest), starts=np.array(list(states)),
            counts=np.array([(s.cost, s.damping, s.iteration, s.evaluations, s.small) for s in states.values()]),
            done=np.array([s.done for s in states.values()]), rows=np.array(self.rows).reshape(-1, 4), **arrays,
        ))  # fmt: skip
