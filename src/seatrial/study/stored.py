"""A saved fit as the value that it was: model.toml, fit.json, history.csv and fit.npz to a `Fit`."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import ShipError
from ..core.parameters import Free, ParameterError
from ..data import Array
from ..identify import Fit, StudyError, Verdict
from ..ships.files import load
from .arrays import ARRAYS, Held, read_arrays
from .store import COLUMNS, HISTORY, MODEL, SUMMARY, check_seal, read_summary

_ABSENT = {"low": -math.inf, "high": math.inf, "prior": math.nan, "prior_sigma": math.inf}
"""What null, which JSON has for numbers that are not finite, stands for; elsewhere NaN."""
_ROUNDING = 1e-6
"""Of a correlation, what rounding may leave."""


def load_fit(folder: str | Path) -> Fit:
    """The fit that `store.save_fit` wrote; a run of before fit.npz has no residuals.

    Raises:
        StudyError: no fit in that folder, or one that cannot be used; names file and key.
    """
    where = Path(folder)
    if not (where / SUMMARY).is_file():
        made = "a run of a table of fits has one a folder below fits/" if (where / "fits").is_dir() else "none is there"
        raise StudyError(f"{where}: no fit in this folder ({SUMMARY}); {made}")
    numbers = read_numbers(where)
    held = _held(where, numbers.digest)
    try:
        ship = load(where / MODEL)
    except ShipError as error:
        raise StudyError(f"{where}: {error}") from None
    return Fit(
        ship, numbers.free, numbers.values, numbers.sigma, numbers.covariance, numbers.shrinkage, numbers.at_bound,
        numbers.verdicts, read_history(where / HISTORY), numbers.objective, numbers.seconds, numbers.evaluations,
        numbers.status, numbers.digest, ends=np.zeros((0, 0)) if held.ends is None else held.ends,
        nuisances=numbers.nuisances, diagnosis=held.diagnosis, loss=held.loss,
    )  # fmt: skip


@dataclass(frozen=True)
class Numbers:
    """What fit.json holds of a fit, checked: the fields of a `Fit` of these names, and the whole document."""

    free: tuple[Free, ...]
    values: Array
    sigma: Array
    covariance: Array
    shrinkage: Array
    at_bound: tuple[str, ...]
    verdicts: tuple[Verdict, ...]
    objective: float
    seconds: float
    evaluations: int
    status: str
    digest: str
    nuisances: Mapping[str, Mapping[str, float]]
    document: Mapping[str, Any]


def read_numbers(path: str | Path) -> Numbers:
    """The numbers of a fit, from its fit.json or the folder of it.

    Raises:
        StudyError: what is wrong in it and at which key, or that it was changed after the fit.
    """
    where = Path(path) / SUMMARY if Path(path).is_dir() else Path(path)
    read = _Reading(where, read_summary(where))
    parameters = read.table("parameters")
    try:
        free = tuple(read.free(path) for path in parameters)
    except ParameterError as error:
        raise StudyError(f"{where}: {error}") from None
    found = Numbers(
        free, read.column("value"), read.column("sigma"), read.matrix("covariance", len(free)),
        read.column("shrinkage"), tuple(path for path, own in parameters.items() if own.get("at_bound") is True),
        read.verdicts(), read.number(read.document, "objective"), read.number(read.document, "seconds"),
        int(read.number(read.document, "evaluations")), str(read.document.get("status", "")),
        str(read.get(read.document, "digest", "")), read.nuisances(), read.document,
    )  # fmt: skip
    _check_numbers(where, found)
    check_seal(where, read.document)
    return found


def _check_numbers(where: Path, found: Numbers) -> None:
    """Refuse estimates that are no numbers, and spreads that are none."""
    for free, value, sigma in zip(found.free, found.values.tolist(), found.sigma.tolist(), strict=True):
        if not math.isfinite(value):
            raise StudyError(f"{where}: parameters.{free.path}.value is {value:g}; it must be a finite number")
        if sigma <= 0.0:  # NaN, of a fit that gives none, is not
            raise StudyError(f"{where}: parameters.{free.path}.sigma is {sigma:g}; it must be above zero")
    known = np.isfinite(found.covariance).all(axis=0)
    inner = found.covariance[np.ix_(known, known)]
    size = float(np.abs(inner).max(initial=0.0))
    if not np.allclose(inner, inner.T, rtol=0.0, atol=_ROUNDING * size):
        raise StudyError(f"{where}: covariance must be symmetric")
    scale = np.sqrt(np.abs(np.diag(inner)))
    sizes = np.outer(scale, scale)
    unit = inner / np.where(sizes > 0.0, sizes, 1.0)
    if inner.size and (np.diag(inner).min() < 0.0 or np.linalg.eigvalsh(unit).min() < -_ROUNDING):
        raise StudyError(f"{where}: covariance has a negative variance")


def _held(where: Path, digest: str) -> Held:
    path = where / ARRAYS
    if not path.is_file():
        return Held(digest)
    held = read_arrays(path)
    if held.digest != digest:
        raise StudyError(f"{path}: of fit {held.digest}, {SUMMARY} is of {digest}; delete the one that is not wanted")
    return held


class _Reading:
    """The document of fit.json, which people may have edited."""

    def __init__(self, path: Path, document: Mapping[str, Any]) -> None:
        self.path, self.document = path, document

    def get(self, table: Mapping[str, Any], key: str, where: str) -> Any:
        """A value that must be there."""
        if key not in table:
            raise StudyError(f"{self.path}: {where}{key} is missing")
        return table[key]

    def number(self, table: Mapping[str, Any], key: str, where: str = "") -> float:
        """A number; null is what `_ABSENT` says."""
        value = self.get(table, key, where)
        if value is None:
            return _ABSENT.get(key, math.nan)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise StudyError(f"{self.path}: {where}{key} is {str(value)[:40]}; it must be a number")
        return float(value)

    def table(self, key: str) -> dict[str, dict[str, Any]]:
        """Tables by name."""
        found = self.get(self.document, key, "")
        if not isinstance(found, dict) or not all(isinstance(one, dict) for one in found.values()):
            raise StudyError(f"{self.path}: {key} must be tables by name")
        return found

    def free(self, path: str) -> Free:
        """One free parameter as it was declared."""
        own = self.table("parameters")[path]
        start, low, high, prior, sigma = (
            self.number(own, key, f"parameters.{path}.") for key in ("start", "low", "high", "prior", "prior_sigma")
        )
        return Free(path, start, low, high, prior, sigma)

    def column(self, key: str) -> Array:
        """One number of each parameter."""
        found = self.table("parameters").items()
        return np.array([self.number(own, key, f"parameters.{path}.") for path, own in found], dtype=np.float64)

    def matrix(self, key: str, size: int) -> Array:
        """A square matrix."""
        found = self.get(self.document, key, "")
        try:
            return np.array(found, dtype=np.float64).reshape(size, size)
        except (TypeError, ValueError):
            raise StudyError(f"{self.path}: {key} must be {size} rows of {size} numbers") from None

    def verdicts(self) -> tuple[Verdict, ...]:
        """The verdicts."""
        found = self.get(self.document, "verdicts", "")
        try:
            return tuple(Verdict(str(one["subject"]), str(one["status"]), str(one["text"])) for one in found)
        except (TypeError, KeyError):
            raise StudyError(f"{self.path}: each of verdicts needs subject, status and text") from None

    def nuisances(self) -> dict[str, dict[str, float]]:
        """Nuisance parameters by trial and name."""
        return {trial: {name: self.number(own, name, f"nuisances.{trial}.") for name in own}
                for trial, own in self.table("nuisances").items()}  # fmt: skip


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
