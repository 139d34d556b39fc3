"""Samples of a posterior on disk: posterior.npz, posterior.nc where ArviZ is there, and their summary in fit.json."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from ..core.files import packed, write_whole
from ..core.unpacking import unpacked
from ..data import Array
from ..identify import StudyError
from ..study.store import load_fit_summary, write_summary
from .sampling.sampled import Sampled

DRAWS, NETCDF, KEY = "posterior.npz", "posterior.nc", "posterior"


def save_draws(found: Sampled, folder: str | Path) -> Path:
    """Write the draws to the folder of their fit, and their summary into its fit.json; returns the path of the draws.

    Raises:
        StudyError: no fit in the folder.
    """
    where = Path(folder)
    document = load_fit_summary(where)
    arrays: dict[str, Any] = {
        "paths": np.array(found.paths), "draws": found.draws, "density": found.density, "best": found.best,
        "laplace": found.laplace, "fit": np.array(str(document.get("digest", ""))),
    }  # fmt: skip
    path = write_whole(where / DRAWS, packed(**arrays))
    (where / NETCDF).unlink(missing_ok=True)
    if (data := inference_data(found)) is not None:
        data.to_netcdf(str(where / NETCDF))
    write_summary(where, {**document, KEY: found.numbers()})
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


def read_draws(path: str | Path) -> tuple[tuple[str, ...], Array]:
    """Paths, and all draws of all chains, shape (draws, paths).

    Raises:
        StudyError: no such file, or not as `save_draws` wrote it.
    """
    try:
        found = unpacked(Path(path).read_bytes())
        paths = tuple(str(one) for one in found["paths"])
        draws = np.asarray(found["draws"], dtype=np.float64).reshape(-1, len(paths))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise StudyError(f"{path}: cannot be read: {error}; seatrial identify STUDY --sample N makes it") from None
    if not (len(draws) and np.isfinite(draws).all()):
        raise StudyError(f"{path}: holds no finite draws; seatrial identify STUDY --sample N makes them")
    return paths, draws


def drawn_of(path: str | Path) -> str:
    """Digest of the fit whose posterior the draws are of, of a file that `read_draws` has read."""
    return str(unpacked(Path(path).read_bytes()).get("fit", ""))
