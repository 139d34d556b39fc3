"""A fit on disk: the ship (model.toml), the numbers (fit.json, fit.npz) and the history of the search (history.csv).

`stored.load_fit` reads it back as the value that it was.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from ..core.files import plain, read_toml, write_whole
from ..core.parameters import read
from ..core.version import __version__
from ..data import DataError, Trial
from ..identify import Fit, Problem, StudyError
from ..models import STATES
from ..ships import Entry, Ship
from ..ships.writing import save
from .arrays import ARRAYS, to_bytes
from .grounds import grounds

MODEL, SUMMARY, HISTORY, RUN = "model.toml", "fit.json", "history.csv", "run.json"
SEAL = "seal"
COLUMNS = ["iteration", "objective", "validation", "seconds"]
"""Of history.csv."""
# How a caution begins that speaks of parameters which are zero until a fit has moved them.
_UNFITTED = "As it stands"
# Magnitudes beyond are no measure of anything; see `core.files.REACH`.
_MOST = 1e30


def save_fit(
    fit: Fit, folder: str | Path, problem: Problem, *, study: str, text: str = "",
    scale: Mapping[str, float] | None = None, test: Sequence[Trial] = (), file: str = "",
) -> Path:  # fmt: skip
    """Write model.toml, fit.json, history.csv and, where there are residuals, fit.npz to `folder`, each whole or not.

    Args:
        problem: what was fitted, for the provenance: the ship it began from and the trials used.
        study: name of the study.
        text: the study as written, kept in fit.json.
        scale: divisor of the error of each state where this fit is judged, kept in fit.json.
        test: trials kept apart from training and validation, whose digests are kept.
        file: where the study was read from.

    Returns:
        The path of model.toml.
    """
    where = Path(folder)
    provenance: dict[str, Any] = {
        "study": study, "digest": fit.digest, "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "ship": problem.ship.name, "trained_on": [trial.name for trial in problem.trials],
        "validated_on": [trial.name for trial in problem.validation], "status": fit.status,
        "sigma": {f.path: float(s) for f, s in zip(fit.free, fit.sigma, strict=True)},
        "began": {f.path: float(read(problem.ship.model, f.path)) for f in fit.free},
    }  # fmt: skip
    write_whole(where / HISTORY, _history(fit))
    if (arrays := to_bytes(fit)) is None:
        (where / ARRAYS).unlink(missing_ok=True)  # of a fit before
    else:
        write_whole(where / ARRAYS, arrays)
    model = save(_sourced(fit, study), where / MODEL, provenance)
    summary = {
        **_summary(fit, study, text, provenance), "scale": None if scale is None else dict(scale),
        "version": __version__, "study_file": file,
        "grounds": grounds(problem.trials, problem.validation, test, fit.ship.model.controls),
    }  # fmt: skip
    write_summary(where, summary)
    return model


def write_summary(folder: str | Path, document: Mapping[str, Any]) -> Path:
    """Write the fit.json of a folder, sealed: with digests of its content and of the model.toml beside it."""
    content = {key: value for key, value in plain(document).items() if key != SEAL}
    path = Path(folder) / SUMMARY
    seal = {"fit": _digest(content), "model": _model_digest(path.with_name(MODEL))}
    return write_whole(path, json.dumps({**content, SEAL: seal}, indent=1) + "\n")


def load_fit_summary(path: str | Path) -> dict[str, Any]:
    """The content of fit.json as `save_fit` wrote it, from the file or its folder.

    Raises:
        StudyError: no such file, one of another schema, or a fit or model that was changed afterwards.
    """
    document = read_summary(path)
    check_seal(path, document)
    return document


def read_summary(path: str | Path) -> dict[str, Any]:
    """The same whatever its seal, for those who judge the content first."""
    return _read(_summary_at(path), "seatrial-fit/1")


def check_seal(path: str | Path, document: Mapping[str, Any]) -> None:
    """Refuse the content of a fit.json that was changed after the fit, or beside whose file the model was.

    A fit of before there were seals has none, and is accepted.

    Raises:
        StudyError: which of the two files it is.
    """
    where, seal = _summary_at(path), document.get(SEAL)
    if seal is None:
        return
    model = where.with_name(MODEL)
    held = seal if isinstance(seal, dict) else {}
    if held.get("fit") != _digest({key: value for key, value in document.items() if key != SEAL}):
        raise StudyError(f"{where}: was changed after the fit; put back what identify wrote, or fit again")
    if model.is_file() and held.get("model") != _model_digest(model):
        raise StudyError(f"{model}: was changed after the fit that {SUMMARY} beside it is of; put back what identify "
                         "wrote, and save a ship with other numbers elsewhere")  # fmt: skip


def _summary_at(path: str | Path) -> Path:
    where = Path(path)
    return where / SUMMARY if where.is_dir() else where


def _digest(document: Any) -> str:
    """Of a document whatever the order and layout of its keys."""
    return hashlib.sha256(json.dumps(document, sort_keys=True, default=str).encode()).hexdigest()[:32]


def _model_digest(path: Path) -> str | None:
    """Of the content of a ship file; None where none can be read."""
    try:
        return _digest(read_toml(path))
    except (OSError, ValueError):
        return None


def fitted_scale(model: str | Path) -> dict[str, float]:
    """Scale of each state in the report of a fitted model; empty where no fit beside it has one.

    Raises:
        StudyError: a scale that is no number above zero.
    """
    found = _beside(model).get("scale")
    if not isinstance(found, dict) or set(found) != set(STATES):
        return {}
    where = Path(model).with_name(SUMMARY)
    return {name: _number(value, f"{where}: scale.{name}", positive=True) for name, value in found.items()}


def fitted_nuisances(model: str | Path) -> dict[str, dict[str, float]]:
    """Currents and biases that were estimated with a fitted model, by trial and name; empty where no fit is beside.

    Raises:
        StudyError: an entry that is no finite number.
    """
    found = _beside(model).get("nuisances")
    where = Path(model).with_name(SUMMARY)
    if not isinstance(found, dict):
        return {}
    return {
        str(trial): {name: _number(value, f"{where}: nuisances.{trial}.{name}") for name, value in own.items()}
        for trial, own in found.items() if isinstance(own, dict)
    }  # fmt: skip


def studied(model: str | Path) -> tuple[str, ...]:
    """Names of all trials of the study that a model was fitted in, kept back or not; empty where no fit is beside."""
    told = _beside(model).get("grounds", {})
    trials = told.get("trials", ()) if isinstance(told, dict) else ()
    return tuple(str(one.get("name")) for one in trials if isinstance(one, dict))


def _number(value: object, where: str, positive: bool = False) -> float:
    """A number of a file of a fit, which people may have edited."""
    what = f"{where} is {str(value)[:40]}; it must be a {'positive' if positive else 'finite'} number"
    if not isinstance(value, int | float) or isinstance(value, bool) or not abs(value) <= _MOST:
        raise StudyError(what)
    if positive and not value >= 1.0 / _MOST:
        raise StudyError(what)
    return float(value)


def _beside(model: str | Path) -> dict[str, Any]:
    where = Path(model).with_name(SUMMARY)
    return load_fit_summary(where) if Path(model).name == MODEL and where.is_file() else {}


def claim(folder: str | Path, digest: str, study: str) -> bool:
    """Mark `folder` as the run of one problem, so that another cannot resume in it by mistake.

    Returns:
        Whether the folder was free until now.

    Raises:
        StudyError: the folder holds the run of another problem.
    """
    where = Path(folder) / RUN
    if where.exists():
        held = _read(where, "seatrial-run/1")
        if held.get("digest") != digest:
            raise StudyError(
                f"{folder}: holds a run of study '{held.get('study')}' with other settings or data, or by another "
                f"version of seatrial ({held.get('digest')}, this is {digest}); choose another folder with -o"
            )
        return False
    document = {"schema": "seatrial-run/1", "study": study, "digest": digest}
    where.parent.mkdir(parents=True, exist_ok=True)
    write_whole(where, json.dumps(document) + "\n")
    return True


@contextmanager
def kept(folder: str | Path, fresh: bool) -> Generator[None, None, None]:
    """Release a folder that was only just claimed, where the estimator refuses the study."""
    try:
        yield
    except (StudyError, DataError):
        if fresh:
            (Path(folder) / RUN).unlink(missing_ok=True)
            with suppress(OSError):  # something else is in it
                Path(folder).rmdir()
        raise


def _read(path: Path, schema: str) -> dict[str, Any]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise StudyError(f"{path}: cannot be read: {error}") from None
    if not isinstance(document, dict) or document.get("schema") != schema:
        raise StudyError(f"{path}: is not of schema '{schema}'")
    return document


def _sourced(fit: Fit, study: str) -> Ship:
    """The fitted ship with the study as the source of each fitted number, without cautions that no longer hold."""
    entries = dict(fit.ship.entries)
    for i, free in enumerate(fit.free):
        source = f"fitted in study {study}, from {free.start:.6g}"
        entries[free.path] = Entry(source, float(fit.values[i]), sigma=_finite(float(fit.sigma[i])))
    return replace(fit.ship, entries=entries, notes=_outgrown(fit))


def _outgrown(fit: Fit) -> Mapping[str, Any]:
    notes = dict(fit.ship.notes)
    if "cautions" in notes and any(f.start == 0.0 != v for f, v in zip(fit.free, fit.values, strict=True)):
        notes["cautions"] = [line for line in notes["cautions"] if not str(line).startswith(_UNFITTED)]
    return notes


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _history(fit: Fit) -> str:
    rows = [",".join(f"{v:.17g}" if math.isfinite(v) else "" for v in row) for row in fit.history.tolist()]
    return "\n".join([",".join(COLUMNS), *rows, ""])


def _summary(fit: Fit, study: str, text: str, provenance: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "schema": "seatrial-fit/1", "study": study, "digest": fit.digest, "status": fit.status,
        "objective": fit.objective, "seconds": fit.seconds, "evaluations": fit.evaluations,
        "parameters": {
            free.path: {
                "value": float(fit.values[i]), "sigma": float(fit.sigma[i]),
                "shrinkage": float(fit.shrinkage[i]), "start": free.start, "low": free.low,
                "high": free.high, "prior": free.prior, "prior_sigma": free.sigma,
                "at_bound": free.path in fit.at_bound,
            }
            for i, free in enumerate(fit.free)
        },
        "covariance": fit.covariance.tolist(),
        "verdicts": [asdict(verdict) for verdict in fit.verdicts],
        "diagnosis": fit.diagnosis.numbers() if fit.diagnosis else None,
        "nuisances": fit.nuisances,
        "provenance": {k: v for k, v in provenance.items() if k not in ("sigma", "began")},
        "study_text": text,
    }  # fmt: skip
