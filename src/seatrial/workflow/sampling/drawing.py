"""Draws of the posterior of a study's fit: refused, made, resumed, kept in the run folder."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ...identify import Fit, StudyError
from ...identify.resume import digest_of
from ...study.cells import Cell
from ...study.series import Series
from ...study.study import Study
from .. import RequestError, Sink

if TYPE_CHECKING:
    from ...belief.drawn import Draws

CHECKPOINT = "checkpoint.posterior.npz"
"""Begins as the checkpoint of a fit does, with which it is removed."""

# A line of progress at most so often [s].
_PAUSE = 10.0


def check_sample(study: Study | Series, count: int | None) -> None:
    """Refuse a number of draws that a run cannot have, before anything is fitted.

    Raises:
        RequestError: of a table of fits, of too few, or of an estimator with a report of its own.
    """
    from ...belief.sampling.sampling import LEAST

    if count is None:
        return
    if isinstance(study, Series):
        raise RequestError(f"{study.path}: --sample is for one study, not for a table of fits ('seatrial-series/1')")
    if count < LEAST:
        raise RequestError(f"--sample {count}: too few to judge the chains; draw {LEAST} or more")
    if study.cells[0].several:
        raise RequestError(f"{study.path}: --sample: {type(study.estimator).__name__} makes several fits; "
                           "use shooting:Trajectory")  # fmt: skip


def _unreported(where: Path, kept: Draws) -> bool:
    """Whether the run that made these draws ended before its report: then it left the checkpoint of their chains."""
    path = where / CHECKPOINT
    return path.exists() and digest_of(path) == kept.said["digest"]


def drawn_for(cell: Cell, out: Path, fits: Mapping[str, Fit], count: int, sink: Sink) -> dict[str, Fit]:
    """The fit of a cell with its draws as details, by its name.

    Empty where so many are in its folder already, or the chains were given up.

    Args:
        fits: made in this run; one that is not among them is read from its folder.
    """
    from ...belief.drawn import read_draws, save_draws
    from ...belief.sampling.sampling import sample
    from ...core.errors import HopelessError
    from ...study.stored import load_fit

    where = out / cell.folder
    fit = fits.get(cell.name) or load_fit(where)
    kept = read_draws(where)
    if kept is not None and kept.fit == fit.digest and len(kept.flat) >= count and not _unreported(where, kept):
        sink.note(f"{where}: {len(kept.flat)} draws of the posterior are done already")
        return {}
    last = time.perf_counter()

    def told(done: int, moves: int) -> None:
        nonlocal last
        if time.perf_counter() - last > _PAUSE:
            last = time.perf_counter()
            sink.note(f"posterior: {done} of {moves} moves of each chain")

    try:
        found = sample(fit, cell.problem, cell.estimator, count, checkpoint=where / CHECKPOINT, told=told)
    except HopelessError as error:
        sink.note(f"--sample: {error}; no draws are kept, and Laplace's covariance stands: seatrial calibrate {where} "
                  "widens it by what left-out trials say")  # fmt: skip
        return {}
    except StudyError as error:
        raise StudyError(f"--sample: {error}") from None
    save_draws(found, fit.digest, where)
    for line in found.words:
        sink.note(f"posterior: {line}")
    return {cell.name: replace(fit, details=found)}
