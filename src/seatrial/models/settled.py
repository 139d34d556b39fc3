"""How the states of a model beyond the six begin, after what a log tells of before, or as if it had long been so."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..data import Array
from . import STATES, Model, Stepped


def unseen(model: Model, series: Array, dt: float) -> Array:
    """States beyond the six at each row of a log, as the rows before it leave them; shape (rows, states - 6).

    A model that remembers says so by a method `recall`, as `Hybrid` does; states that nothing tells of begin at rest.

    Args:
        series: controls and environment per row, shape (rows, controls + 8), without gaps.
        dt: time between the rows [s].
    """
    recall = _recall(model)
    if recall is None or not len(series):
        return np.zeros((len(series), len(model.states) - len(STATES)))
    return np.asarray(recall(series, dt), dtype=np.float64)


def settled(model: Model, acting: Array) -> Array:
    """States beyond the six as if what acts had acted for long, shape (rows, states - 6).

    Args:
        acting: controls and environment of each row by itself, shape (rows, controls + 8).
    """
    recall = _recall(model)
    if recall is None or not len(acting):
        return np.zeros((len(acting), len(model.states) - len(STATES)))
    return np.concatenate([np.asarray(recall(row[None], 1.0), dtype=np.float64)[:1] for row in acting])


def begun(
    model: Model, motion: Sequence[float], control: Sequence[float], environment: Sequence[float]
) -> tuple[float, ...]:
    """The whole state in a motion (x, y, psi, u, v_m, r), the rest settled to what acts."""
    acting = np.array([[*control, *environment]], dtype=np.float64)
    return (*motion, *settled(model, acting)[0].tolist())


def _recall(model: Model) -> Callable[[Array, float], Array] | None:
    """How a model recalls its states, if it does; a stepped one recalls memory, not states."""
    return None if isinstance(model, Stepped) else getattr(model, "recall", None)
