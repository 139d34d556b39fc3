"""The posterior of a fitted ship, from the files of its fit, which are held to each other by the digest."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from ..core.parameters import Free, read, specs
from ..data import Array
from ..identify import Fit, StudyError
from ..ships import Ship
from ..ships.estimate import MADE
from ..ships.files import load
from ..study.store import MODEL, SUMMARY, read_summary
from ..study.stored import load_fit
from .bands.calibration import HOW as CALIBRATION
from .bands.calibration import beside, read_calibration
from .drawn import DRAWS, read_draws
from .posterior import Posterior
from .power import Power

HOW = "seatrial identify STUDY.toml -o RUN writes RUN/model.toml with its posterior beside"
"""What a message adds where a model has no posterior."""


def posterior(model: str | Path, *, weighed: bool = True) -> Posterior:
    """The posterior of a fitted ship, from the fit.json beside its file.

    Args:
        weighed: whether it is widened by what trials left out of the fit say, where they were (`calibrate`).

    Raises:
        StudyError: no posterior is beside, or that of another fit or of other numbers; says which command makes one.
        ShipError: the ship file cannot be read.
    """
    file = Path(model)
    if file.suffix != ".toml" or not file.is_file():
        raise StudyError(f"{model}: has no posterior, as it is no fitted ship file; {HOW}")
    if file.name != MODEL or not (file.parent / SUMMARY).is_file():
        raise StudyError(f"{model}: has no posterior ({file.with_name(SUMMARY)} of a {MODEL}); {HOW}")
    ship, fit, summary = load(file), load_fit(file.parent), read_summary(file.parent)
    made = ship.notes.get("provenance", {}).get("digest", "none")
    if made != fit.digest:
        raise StudyError(f"{file}: is of fit {made}, the {SUMMARY} beside it of fit {fit.digest}; keep the two files "
                         "of one run together")  # fmt: skip
    for free, value in zip(fit.free, fit.values, strict=True):
        own = float(read(ship.model, free.path))
        if not math.isclose(own, value, rel_tol=1e-6, abs_tol=1e-12):
            raise StudyError(f"{file}: {free.path} is {own:.6g}, and {value:.6g} in the {SUMMARY} beside it: one was "
                             "edited after the fit; fit again, or take the file as it was written")  # fmt: skip
    if not fit.free or not np.all(np.isfinite(fit.covariance)) or not np.any(fit.covariance):
        raise StudyError(f"{file}: its fit has no covariance ({SUMMARY}); {HOW} with an estimator that gives one, "
                         "such as shooting:Trajectory")  # fmt: skip
    return Posterior(ship, fit.free, fit.values, fit.covariance, fit.digest, summary.grounds,
                     _power(beside(file), fit.digest) if weighed else None, _samples(file.parent, fit),
                     fit.diagnosis.form if fit.diagnosis else 0.0)  # fmt: skip


def stated(ship: Ship) -> Posterior | None:
    """What the file of an estimated ship states of its numbers, each by itself; None of another ship, and of a fit."""
    if MADE not in ship.notes or "provenance" in ship.notes:
        return None
    sigmas = {path: ship.entries[path].sigma or 0.0 for path in specs(ship.model) if path in ship.entries}
    free = tuple(Free(path, float(read(ship.model, path)), sigma=sigma) for path, sigma in sigmas.items() if sigma > 0)
    mean, sigma = (np.array([getattr(one, name) for one in free]) for name in ("start", "sigma"))
    return Posterior(ship, free, mean, np.diag(sigma * sigma), fitted=False) if free else None


def drawn_from(model: str | Path) -> Posterior:
    """What draws of a ship are taken from: the posterior of its fit, or what an estimate states.

    Raises:
        StudyError, ShipError: as `posterior`.
    """
    file = Path(model)
    found = None if file.suffix != ".toml" or not file.is_file() else stated(load(file))
    return posterior(model) if found is None else found


def _power(path: Path, digest: str) -> Power | None:
    """What trials left out say of the likelihood, from the calibration beside a model; None where none is there.

    Raises:
        StudyError: it cannot be read, or is of another fit.
    """
    if not path.is_file():
        return None
    found = read_calibration(path)
    if found.fit != digest:
        raise StudyError(f"{path}: is of fit {found.fit}, the model beside it of fit {digest}; {CALIBRATION}")
    return found.power


def _samples(where: Path, fit: Fit) -> Array | None:
    """Draws of the sampled posterior that lie beside a fit; None where there are none.

    Raises:
        StudyError: they cannot be read, or are of other parameters.
    """
    found, file = read_draws(where), where / DRAWS
    if found is None:
        return None
    if found.fit != fit.digest:
        raise StudyError(f"{file}: is of fit {found.fit or 'none'}, the {SUMMARY} beside it of fit {fit.digest}; "
                         "keep the files of one run together, or delete the draws")  # fmt: skip
    if set(found.paths) != set(fit.vector.paths):
        raise StudyError(f"{file}: holds {len(found.paths)} parameters, the fit beside it {len(fit.free)} others; keep "
                         "the files of one run together")  # fmt: skip
    return found.flat[:, [found.paths.index(path) for path in fit.vector.paths]]
