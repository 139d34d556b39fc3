"""How often bands held on the recordings that calibrate them, each judged by factors of the others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...core.errors import RequestError
from ..power import LEAST
from .calibration import Calibration, crossed_half
from .held import Held, Windows, held


def crossed(found: Calibration, level: float, horizons: Sequence[int] | None = None) -> tuple[Held, ...]:
    """Coverage and widths by kind and horizon on left-out recordings, whose own errors decide nothing.

    The model that predicted a recording was not fitted to it, and its factor is read from the recordings of other days,
    or, where the names of fewer than three days are told, from the other recordings.  The accelerations of the
    disturbance are those of all recordings together.

    Args:
        level: of 0 to 1.
        horizons: which of the calibration's horizons; None takes the first, the middle and the last that hold.

    Returns:
        Nothing where the others are too few for any.
    """
    left = found.left
    if len(set(left.groups)) - 1 < LEAST:
        return ()
    group, unit = np.array(left.groups), np.array(left.days or left.groups)
    good = np.flatnonzero(np.isfinite(found.factors(level).factor[-1]).all(axis=1))
    chosen = [int(j) for j in (good[[0, len(good) // 2, -1]] if horizons is None else horizons)]
    half = np.full(left.error.shape, np.nan)
    for one in dict.fromkeys(unit):
        try:
            half[unit == one] = crossed_half(left, found.share, level, found.novel, unit == one)
        except RequestError:  # the other days are too few
            return ()
    windows: list[Windows] = []
    for name in dict.fromkeys(left.groups):
        own, kind = group == name, left.kinds[left.groups.index(name)]
        error = np.where(np.isfinite(half), left.error, np.nan)[own][:, chosen]
        windows.append(Windows.of(kind, left.horizons[chosen], error, half[own][:, chosen]))
    return held(windows)
