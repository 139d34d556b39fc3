"""Samples of a posterior on disk: posterior.npz, and posterior.nc where ArviZ is there."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..core.files import write_whole
from ..core.records import read_archive, to_archive
from ..core.values import dataclass
from ..data import Array
from ..identify import StudyError
from .sampling.sampled import Sampled

DRAWS, NETCDF = "posterior.npz", "posterior.nc"
SCHEMA, _REMEDY = "seatrial-posterior/1", "seatrial identify STUDY --sample N makes it"


@dataclass(frozen=True)
class Draws:
    """posterior.npz: draws of the posterior of a fit.

    Attributes:
        fit: digest of the fit.
        paths: of the parameters.
        draws: shape (draws, chains, paths).
        density, best, laplace: as of `Sampled`.
        said: what they say, `Sampled.numbers`.
    """

    fit: str
    paths: tuple[str, ...]
    draws: Array
    density: Array
    best: Array
    laplace: Array
    said: Mapping[str, Any]

    @property
    def flat(self) -> Array:
        """All draws of all chains, shape (draws, paths)."""
        return self.draws.reshape(-1, len(self.paths))


def save_draws(found: Sampled, fit: str, folder: str | Path) -> Path:
    """Write the draws to the folder of the fit of that digest; returns their path."""
    where = Path(folder)
    made = Draws(fit, found.paths, found.draws, found.density, found.best, found.laplace, found.numbers())
    path = write_whole(where / DRAWS, to_archive(made, SCHEMA))
    (where / NETCDF).unlink(missing_ok=True)
    if (data := inference_data(found)) is not None:
        data.to_netcdf(str(where / NETCDF))
    return path


def inference_data(found: Sampled) -> Any:
    """The chains as `InferenceData`, a variable for each path; None without ArviZ (extra `posterior`)."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FutureWarning)  # its notice of the day about a later version
            import arviz
    except ImportError:
        return None
    chains = found.draws.transpose(1, 0, 2)
    return arviz.from_dict(
        posterior={path: chains[:, :, k] for k, path in enumerate(found.paths)},
        sample_stats={"lp": found.density.T, "acceptance_rate": found.accepted.T},
    )  # fmt: skip


def read_draws(folder: str | Path) -> Draws | None:
    """The draws in the folder of a fit; None where there are none.

    Raises:
        StudyError: not as `save_draws` wrote them.
    """
    path = Path(folder) / DRAWS
    if not path.is_file():
        return None
    found = read_archive(path, Draws, SCHEMA, StudyError, _REMEDY)
    if found.draws.ndim != 3 or found.draws.shape[2] != len(found.paths):
        raise StudyError(f"{path}: draws of shape {found.draws.shape} of {len(found.paths)} parameters; {_REMEDY}")
    if not (found.draws.size and np.isfinite(found.draws).all()):
        raise StudyError(f"{path}: holds no finite draws; {_REMEDY}")
    return found
