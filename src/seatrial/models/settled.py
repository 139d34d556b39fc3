"""Initial values of the states beyond the six: from the log before, or settled to what acts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..data import Array
from . import STATES, Model


def unseen(model: Model, series: Array, dt: float) -> Array:
    """`Model.recall` of a log: states beyond the six at each row, shape (rows, states - 6)."""
    return np.asarray(model.recall(series, dt), dtype=np.float64)


def settled(model: Model, acting: Array) -> Array:
    """States beyond the six as if what acts had acted for long, shape (rows, states - 6).

    Args:
        acting: controls and environment of each row by itself, shape (rows, controls + 8).
    """
    if len(model.states) == len(STATES) or not len(acting):
        return np.zeros((len(acting), len(model.states) - len(STATES)))
    return np.concatenate([unseen(model, row[None], 1.0) for row in acting])


def begun(
    model: Model, motion: Sequence[float], control: Sequence[float], environment: Sequence[float]
) -> tuple[float, ...]:
    """The whole state in a motion (x, y, psi, u, v_m, r), the rest settled to what acts."""
    acting = np.array([[*control, *environment]], dtype=np.float64)
    return (*motion, *settled(model, acting)[0].tolist())
