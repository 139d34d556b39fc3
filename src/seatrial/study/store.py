"""A fit on disk: the ship (model.toml), the numbers (fit.json, fit.npz) and the history of the search (history.csv).

`stored.load_fit` reads it back as the value that it was.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ..core.files import plain, read_toml, write_whole
from ..core.parameters import Free, read, values
from ..core.records import Limits, from_json, json_of, read_json, to_archive, to_json
from ..core.records import digest as digest_of
from ..core.values import dataclass, field, replace
from ..core.version import __version__
from ..data import Array, DataError, Trial
from ..data.prepare.made import uncounted
from ..identify import Fit, Loss, Problem, StudyError, Verdict
from ..identify.diagnosis.findings import Diagnosis
from ..identify.nuisance import EVERY
from ..models import STATES
from ..ships import Entry, Ship
from ..ships.writing import save
from . import MODEL, SUMMARY
from .grounds import Grounds, grounds, of_trials

ARRAYS, HISTORY, RUN = "fit.npz", "history.csv", "run.json"
SCHEMA, ARRAYS_SCHEMA, SEAL = "seatrial-fit/1", "seatrial-arrays/1", "seal"
COLUMNS = ["iteration", "objective", "validation", "seconds"]
"""Of history.csv."""
# How a caution begins that speaks of parameters which are zero until a fit has moved them.
_UNFITTED = "As it stands"
# Dotted paths of parameters in a sentence.
_PATHS = re.compile(r"\b\w+\.\w+")
# Magnitudes beyond are no measure of anything; see `core.files.REACH`.
_MOST = 1e30
# Of a correlation, what rounding may leave.
_ROUNDING = 1e-6


@dataclass(frozen=True)
class Parameter:
    """A free parameter in fit.json: what was found, and how it was declared."""

    value: float
    sigma: float
    shrinkage: float
    start: float
    low: Annotated[float, Limits(null=-math.inf)]
    high: Annotated[float, Limits(null=math.inf)]
    prior: float
    prior_sigma: Annotated[float, Limits(null=math.inf)]
    at_bound: bool = False
    prior_tied: Mapping[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True)
class Summary:
    """fit.json: a fit for people and programs, written once.

    Attributes:
        parameters: by path.
        covariance: shape (parameters, parameters).
        diagnosis: `Diagnosis.numbers`; None where nothing was tested.
        nuisances: currents and biases that were estimated along, by trial and name.
        provenance: of the model.
        study_text, study_file: the study as written, and where it was read from.
        scale: divisor of the error of each state where this fit is judged.
        version: of seatrial, that made it.
        seal: digests of this document and of the model beside it.
    """

    study: str
    digest: str
    status: str
    objective: float
    seconds: float
    evaluations: int
    parameters: Mapping[str, Parameter]
    covariance: Array
    verdicts: tuple[Verdict, ...]
    diagnosis: Mapping[str, Any] | None
    nuisances: Mapping[str, Mapping[str, Annotated[float, Limits(least=-_MOST, most=_MOST)]]]
    provenance: Mapping[str, Any]
    study_text: str = ""
    scale: Mapping[str, float] | None = None
    version: str = ""
    study_file: str = ""
    grounds: Grounds = field(default_factory=Grounds)
    seal: Mapping[str, str | None] | None = None

    @property
    def explained(self) -> bool:
        """Whether the model explains the data, as far as that was tested."""
        return self.diagnosis is None or bool(self.diagnosis.get("explained", True))

    def column(self, name: str) -> Array:
        """One field of each parameter."""
        return np.array([vars(one)[name] for one in self.parameters.values()], dtype=np.float64)

    @property
    def free(self) -> tuple[Free, ...]:
        """The parameters as they were declared; ParameterError where one cannot be."""
        return tuple(Free(path, one.start, one.low, one.high, one.prior, one.prior_sigma, tuple(one.prior_tied.items()))
                     for path, one in self.parameters.items())  # fmt: skip

    def check(self, where: Path) -> None:
        """Refuse estimates that are no numbers, and spreads that are none.

        Raises:
            StudyError: the key in the file `where`.
        """
        for path, one in self.parameters.items():
            if not math.isfinite(one.value):
                raise StudyError(f"{where}: parameters.{path}.value is {one.value:g}; it must be a finite number")
            if one.sigma <= 0.0:  # NaN, of a fit that gives none, is not
                raise StudyError(f"{where}: parameters.{path}.sigma is {one.sigma:g}; it must be above zero")
        check_covariance(self.covariance, len(self.parameters), where)


@dataclass(frozen=True)
class Arrays:
    """fit.npz: what JSON cannot hold of the fit of that digest, to the last bit; fields as of `Fit`."""

    digest: str
    diagnosis: Diagnosis | None
    loss: Loss | None
    ends: Array


def check_covariance(covariance: Array, size: int, where: Path) -> None:
    """Refuse a covariance of so many parameters that is none.

    Raises:
        StudyError: what is wrong with it, in the file `where`.
    """
    if covariance.size != size * size:
        raise StudyError(f"{where}: covariance must be {size} rows of {size} numbers")
    covariance = covariance.reshape(size, size)
    known = np.isfinite(np.diag(covariance))
    inner = covariance[np.ix_(known, known)]
    greatest = float(np.abs(inner).max(initial=0.0))
    if not np.allclose(inner, inner.T, rtol=0.0, atol=_ROUNDING * greatest):
        raise StudyError(f"{where}: covariance must be symmetric")
    scale = np.sqrt(np.abs(np.diag(inner)))
    sizes = np.outer(scale, scale)
    unit = inner / np.where(sizes > 0.0, sizes, 1.0)
    if inner.size and (np.diag(inner).min() < 0.0 or np.linalg.eigvalsh(unit).min() < -_ROUNDING):
        raise StudyError(f"{where}: covariance has a negative variance")


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
    if fit.diagnosis is None and fit.loss is None and not fit.ends.size:
        (where / ARRAYS).unlink(missing_ok=True)  # of a fit before
    else:
        kept = Arrays(fit.digest, fit.diagnosis, fit.loss, fit.ends)
        write_whole(where / ARRAYS, to_archive(kept, ARRAYS_SCHEMA))
    model = save(_sourced(fit, study), where / MODEL, provenance)
    write_summary(where, Summary(
        study, fit.digest, fit.status, fit.objective, fit.seconds, fit.evaluations, _parameters(fit), fit.covariance,
        fit.verdicts, fit.diagnosis.numbers() if fit.diagnosis else None, fit.nuisances,
        {key: value for key, value in provenance.items() if key not in ("sigma", "began")}, text, scale, __version__,
        file, _stood_on(fit, problem, test),
    ))  # fmt: skip
    return model


def _stood_on(fit: Fit, problem: Problem, test: Sequence[Trial]) -> Grounds:
    """Grounds of a fit, whose ranges are those of the ship and not of a rudder that reads 2.5 deg too much."""
    controls = fit.ship.model.controls
    logged = replace(grounds(problem.trials, problem.validation, test, controls), made=uncounted(problem.loss.sigma))
    off = {name.partition(".")[2]: size for name, size in fit.nuisances.get(EVERY, {}).items()
           if name.startswith(("offset.", "bias."))}  # fmt: skip
    if not off:
        return logged
    true = [trial.having(**{name: trial[name] - size for name in (*controls, *STATES) for key, size in off.items()
                            if name in trial and (name == key or name.startswith(f"{key}_"))})
            for trial in problem.trials]  # fmt: skip
    return replace(of_trials(true, controls, logged.trials, logged.kinds), made=logged.made)


def _parameters(fit: Fit) -> dict[str, Parameter]:
    found = zip(fit.free, fit.values.tolist(), fit.sigma.tolist(), fit.shrinkage.tolist(), strict=True)
    return {
        free.path: Parameter(value, sigma, shrinkage, free.start, free.low, free.high, free.prior, free.sigma,
                             free.path in fit.at_bound, dict(free.tied))
        for free, value, sigma, shrinkage in found
    }  # fmt: skip


def write_summary(folder: str | Path, summary: Summary | Mapping[str, Any]) -> Path:
    """Write the fit.json of a folder, sealed: with digests of its content and of the model.toml beside it."""
    content = {"schema": SCHEMA, **plain(summary)}
    content.pop(SEAL, None)
    path = Path(folder) / SUMMARY
    seal = {"fit": digest_of(content), "model": _model_digest(path.with_name(MODEL))}
    return write_whole(path, json.dumps({**content, SEAL: seal}, indent=1) + "\n")


def read_summary(path: str | Path) -> Summary:
    """The fit.json of `save_fit`, from the file or its folder.

    Raises:
        StudyError: no such file, another schema, what is wrong in it and at which key, or that it or the model beside
            was changed after the fit.
    """
    where = Path(path) / SUMMARY if Path(path).is_dir() else Path(path)
    document = json_of(where, SCHEMA, StudyError)
    found = from_json(Summary, document, where, StudyError)
    found.check(where)
    _check_seal(where, document)
    return found


def _check_seal(where: Path, document: Mapping[str, Any]) -> None:
    """Refuse the content of a fit.json that was changed after the fit, or beside whose file the model was.

    A fit of before there were seals has none, and is accepted.

    Raises:
        StudyError: which of the two files it is.
    """
    seal, model = document.get(SEAL), where.with_name(MODEL)
    if seal is None:
        return
    content = {key: value for key, value in document.items() if key != SEAL}
    if seal.get("fit") != digest_of({"schema": SCHEMA, **content}):
        raise StudyError(f"{where}: was changed after the fit; put back what identify wrote, or fit again")
    if model.is_file() and seal.get("model") != _model_digest(model):
        raise StudyError(f"{model}: was changed after the fit that {SUMMARY} beside it is of; put back what identify "
                         "wrote, and save a ship with other numbers elsewhere")  # fmt: skip


def _model_digest(path: Path) -> str | None:
    """Of the content of a ship file; None where none can be read."""
    try:
        return digest_of(read_toml(path))
    except (OSError, ValueError):
        return None


def summary_beside(model: str | Path) -> Summary | None:
    """What the fit of a model says, from the fit.json beside it; None where none is."""
    where = Path(model).with_name(SUMMARY)
    return read_summary(where) if Path(model).name == MODEL and where.is_file() else None


def fitted_scale(model: str | Path) -> dict[str, float]:
    """Scale of each state where a fitted model is judged; empty where no fit beside it has one.

    Raises:
        StudyError: a scale that is no number above zero.
    """
    said = summary_beside(model)
    if said is None or said.scale is None or set(said.scale) != set(STATES):
        return {}
    for name, value in said.scale.items():
        if not 1.0 / _MOST <= value <= _MOST:
            where = Path(model).with_name(SUMMARY)
            raise StudyError(f"{where}: scale.{name} is {value:g}; it must be a positive number")
    return dict(said.scale)


@dataclass(frozen=True)
class Claim:
    """run.json: the study whose run a folder is, the fingerprint of its problem, and the version that began it.

    The version is empty in a folder of before it was kept.
    """

    study: str
    digest: str
    version: str = ""

    @property
    def differs(self) -> str:
        """What is other than now where the fingerprint is: the version alone is part of it."""
        if self.version == __version__:
            return "with other settings or data"
        if self.version:
            return f"by version {self.version} of seatrial (this is {__version__}), perhaps with other settings or data"
        return "with other settings or data, or by another version of seatrial"


def claim(folder: str | Path, digest: str, study: str) -> bool:
    """Mark `folder` as the run of one problem, so that another cannot resume in it by mistake.

    Returns:
        Whether the folder was free until now.

    Raises:
        StudyError: the folder holds the run of another problem.
    """
    where = Path(folder) / RUN
    if where.exists():
        held = read_json(where, Claim, "seatrial-run/1", StudyError)
        if held.digest != digest:
            raise StudyError(
                f"{folder}: holds a run of study '{held.study}' {held.differs} ({held.digest}, this is {digest}); "
                "choose another folder with -o, or remove this one, and it is fitted anew"
            )
        return False
    where.parent.mkdir(parents=True, exist_ok=True)
    write_whole(where, to_json(Claim(study, digest, __version__), "seatrial-run/1"))
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


def _sourced(fit: Fit, study: str) -> Ship:
    """The fitted ship with the study as the source of each fitted number, without cautions that no longer hold."""
    entries = dict(fit.ship.entries)
    for i, free in enumerate(fit.free):
        source = f"fitted in study {study}, from {free.start:.6g}"
        entries[free.path] = Entry(source, float(fit.values[i]), sigma=_finite(float(fit.sigma[i])))
    return replace(fit.ship, entries=entries, notes=_outgrown(fit, study))


def _outgrown(fit: Fit, study: str) -> Mapping[str, Any]:
    """Notes of the fitted ship: of its cautions those that its fit does not answer."""
    notes = dict(fit.ship.notes)
    if "cautions" in notes:
        moved = any(f.start == 0.0 != v for f, v in zip(fit.free, fit.values, strict=True))
        kept = [line for line in map(str, notes["cautions"]) if not (moved and line.startswith(_UNFITTED))]
        notes["cautions"] = [_told(line, fit, study) for line in kept if not _answered(line, fit)]
    return notes


def _answered(caution: str, fit: Fit) -> bool:
    """Whether a caution is of parameters, and the fit has found all that it names."""
    named = set(_PATHS.findall(caution)) & set(values(fit.ship.model))
    return bool(named) and named <= set(fit.vector.paths)


def _told(caution: str, fit: Fit, study: str) -> str:
    from ..ships.estimate import FIRST_LOOK  # which reads its formulas when it is imported

    if caution != FIRST_LOOK:
        return caution
    return f"{len(fit.free)} numbers are fitted in study {study}, the others estimated from particulars"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _history(fit: Fit) -> str:
    rows = [",".join(f"{v:.17g}" if math.isfinite(v) else "" for v in row) for row in fit.history.tolist()]
    return "\n".join([",".join(COLUMNS), *rows, ""])
