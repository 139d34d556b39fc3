"""A saved fit as the value that it was: model.toml, fit.json, history.csv and fit.npz to a `Fit`."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np

from ..core.errors import ShipError
from ..core.parameters import ParameterError
from ..core.records import read_archive
from ..data import Array
from ..identify import Fit, StudyError
from ..ships.files import load
from .store import ARRAYS, ARRAYS_SCHEMA, COLUMNS, HISTORY, MODEL, SUMMARY, Arrays, read_summary


def load_fit(folder: str | Path) -> Fit:
    """The fit that `store.save_fit` wrote; a run of before fit.npz has no residuals.

    Raises:
        StudyError: no fit in that folder, or one that cannot be used; names file and key.
    """
    where = Path(folder)
    if not (where / SUMMARY).is_file():
        made = "a run of a table of fits has one a folder below fits/" if (where / "fits").is_dir() else "none is there"
        raise StudyError(f"{where}: no fit in this folder ({SUMMARY}); {made}")
    said = read_summary(where)
    held = _held(where, said.digest)
    try:
        ship, free = load(where / MODEL), said.free
    except (ShipError, ParameterError) as error:
        raise StudyError(f"{where}: {error}") from None
    return Fit(
        ship, free, said.column("value"), said.column("sigma"), said.covariance.reshape(len(free), len(free)),
        said.column("shrinkage"), tuple(path for path, one in said.parameters.items() if one.at_bound), said.verdicts,
        read_history(where / HISTORY), said.objective, said.seconds, said.evaluations, said.status, said.digest,
        ends=held.ends, nuisances=said.nuisances, diagnosis=held.diagnosis, loss=held.loss,
    )  # fmt: skip


def _held(where: Path, digest: str) -> Arrays:
    path = where / ARRAYS
    if not path.is_file():
        return Arrays(digest, None, None, np.zeros((0, 0)))
    remedy = "delete it, and the fit is read without residuals"
    held = read_archive(path, Arrays, ARRAYS_SCHEMA, StudyError, remedy)
    if held.digest != digest:
        raise StudyError(f"{path}: of fit {held.digest}, {SUMMARY} is of {digest}; delete the one that is not wanted")
    return held


def read_history(path: Path) -> Array:
    """Rows (iteration, objective, validation or NaN, seconds) of a history.csv, shape (iterations, 4).

    Raises:
        StudyError: no such file, or not as it was written.
    """
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            head, *rows = list(csv.reader(stream)) or [[]]
        if head != COLUMNS or any(len(row) != len(COLUMNS) for row in rows):
            raise ValueError(f"it has columns {', '.join(COLUMNS)}")
        numbers = [[float(cell) if cell else math.nan for cell in row] for row in rows]
        return np.array(numbers, dtype=np.float64).reshape(-1, len(COLUMNS))
    except (OSError, ValueError, csv.Error) as error:
        raise StudyError(f"{path}: cannot be read: {error}") from None
