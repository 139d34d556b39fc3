"""The path of a fitted ship on a page, with its bands."""

from __future__ import annotations

from pathlib import Path

from ...data import Trial
from ...realtime.bridge.path import Open
from ...report.judging.tested import reached
from ...ships import Ship
from .. import RequestError
from ..asked import Bands
from ..request import banded
from .drawn import Drawing

# An ellipse takes the covariance of the draws, which so many give to a twentieth.
_DRAWS = 200


def path_ahead(ship: str | Path | Ship | None, bands: Bands) -> Open | None:
    """What the page draws ahead of a fitted ship, by its file; None unless bands are asked for.

    Raises:
        RequestError: a level or number of draws that makes no band, or options of bands without them.
        StudyError: the model has no posterior (says which command makes one), or the calibration of another fit.
    """
    if not banded(bands):
        return None
    if ship is None:
        raise RequestError("--bands: are those of a fitted ship; name its file before the scenario")
    asked = Drawing.of(str(ship), bands, _DRAWS)
    if asked.ungrounded:
        raise RequestError(f"--bands: {asked.ungrounded}")

    def refusal(path: Trial) -> str:
        out = asked.refused(path)
        return f"beyond the trials of the fit in {reached(out)}" if out else ""

    return Open(asked.held, asked.found, asked.level, asked.count, refusal)
