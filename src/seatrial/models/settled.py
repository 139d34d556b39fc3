"""How the states of a model beyond the six begin where no log tells of what came before."""

from __future__ import annotations

import numpy as np

from ..data import Array
from . import STATES, Model, Stepped


def settled(model: Model, acting: Array) -> Array:
    """States beyond the six as if what acts had acted for long, shape (rows, states - 6).

    A model that remembers says so by a method `recall`, as `Hybrid` does; other states begin at rest.

    Args:
        acting: controls and environment of each row by itself, shape (rows, controls + 8).
    """
    recall = None if isinstance(model, Stepped) else getattr(model, "recall", None)
    if recall is None or not len(acting):
        return np.zeros((len(acting), len(model.states) - len(STATES)))
    return np.concatenate([np.asarray(recall(row[None], 1.0), dtype=np.float64)[:1] for row in acting])
