"""How often bands held on the recordings that calibrate them, each judged by factors of the others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...data import Array
from ..power import LEAST
from .calibration import ALIKE, Calibration
from .conformal import factors
from .held import Held, Windows, held


def crossed(found: Calibration, level: float, horizons: Sequence[int] | None = None) -> tuple[Held, ...]:
    """Coverage and widths by kind and horizon on left-out recordings, whose own errors decide nothing.

    The model that predicted a recording was not fitted to it, and its factor is read from the other recordings.  The
    accelerations of the disturbance are those of all recordings together.

    Args:
        level: of 0 to 1.
        horizons: which of the calibration's horizons; None takes the first, the middle and the last that hold.

    Returns:
        Nothing where the others are too few for any.
    """
    left = found.left
    names = dict.fromkeys(left.groups)
    if len(names) - 1 < LEAST:
        return ()
    group = np.array(left.groups)
    good = np.flatnonzero(np.isfinite(found.factors(level).factor[-1]).all(axis=1))
    chosen = [int(j) for j in (good[[0, len(good) // 2, -1]] if horizons is None else horizons)]
    scale = left.spread**found.share * left.usual ** (1.0 - found.share)
    windows: list[Windows] = []
    for name in names:
        own, others = group == name, group != name
        half = _half(found, own, others, scale, level)[:, chosen]
        error = np.where(np.isfinite(half), left.error[own][:, chosen], np.nan)
        windows.append(Windows.of(left.kinds[int(np.argmax(own))], left.horizons[chosen], error, half))
    return held(windows)


def _half(
    found: Calibration, own: NDArray[np.bool_], others: NDArray[np.bool_], scale: Array, level: float
) -> Array:
    """Half widths for one recording by the factors of the others, shape (windows, horizons, 6)."""
    left = found.left
    pick = np.flatnonzero(others)
    made = factors(left.scores(found.share)[pick], [left.groups[k] for k in pick], [left.kinds[k] for k in pick],
                   level, ALIKE)  # fmt: skip
    kind = left.kinds[int(np.argmax(own))]
    row = made.kinds.index(kind) if kind in made.kinds else len(made.kinds) - 1
    return made.factor[row] * scale[own]
