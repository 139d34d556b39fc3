"""The path of a fitted ship on a page, with its bands."""

from __future__ import annotations

from pathlib import Path

from ...data import Trial
from ...realtime.bridge.ahead import Ahead, Open
from ...realtime.plant import Plant
from ...report.judging.bands import reach
from ...ships import Ship
from .. import RequestError
from .drawn import Drawing

# An ellipse takes the covariance of the draws, which so many give to a twentieth.
_DRAWS = 200


def path_ahead(
    ship: str | Path | Ship, own: Plant, bands: float | None, draws: int | None, *, extrapolate: bool
) -> Ahead | None:  # fmt: skip
    """What the page draws ahead of a fitted ship, if bands are asked for.

    Args:
        ship: its file.
        own: the ship that is steered.
        bands: level [%]; None for no bands.
        draws: number of draws; None takes 200.
        extrapolate: give bands where the path leaves the ranges of the trials of the fit.

    Raises:
        RequestError: a level or number of draws that makes no band, or options of bands without them.
        StudyError: the model has no posterior (says which command makes one), or the calibration of another fit.
        ShipError: a model that cannot be disturbed.
    """
    if bands is None:
        if draws is not None or extrapolate:
            raise RequestError("--draws and --extrapolate are of bands; add --bands 95")
        return None
    asked = Drawing.of(str(ship), bands, _DRAWS if draws is None else draws, extrapolate=extrapolate)
    if asked.ungrounded:
        raise RequestError(f"--bands: {asked.ungrounded}")

    def refusal(path: Trial) -> str:
        out = asked.refused(path)
        return f"beyond the trials of the fit in {'; '.join(map(reach, out))}" if out else ""

    return Ahead(own, Open(asked.held, asked.found, asked.level, asked.count, refusal))
