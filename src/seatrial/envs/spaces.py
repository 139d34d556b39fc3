"""The spaces of an environment, and ships by name."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from ..ships import Ship
from ..ships.files import load
from .system import Work
from .tasks import TaskError, shown


def ship_of(ship: str | Ship) -> Ship:
    """A ship as given, or by the name of the library or of a file.

    Raises:
        TaskError: neither.
        ShipError: no such ship.
    """
    given: Any = ship
    if isinstance(given, Ship):
        return given
    if not isinstance(given, str):
        raise TaskError(f"ship is {shown(given)}; give a Ship, or the name of one")
    return load(given)


def spaces_of(work: Work) -> tuple[Any, Any]:
    """Observations as the task and the ship have them, and actions from -1 to 1."""
    low, high = (np.array([getattr(one, end) for one in work.seen], dtype=np.float32) for end in ("low", "high"))
    return Box(low, high, dtype=np.float32), Box(-1.0, 1.0, (len(work.orders),), dtype=np.float32)


def checked(action: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """An action of the right shape, all of it numbers.

    Raises:
        ValueError: another shape, or a value that is not finite.
    """
    given = np.asarray(action)
    if given.shape != shape:
        raise ValueError(f"an action of shape {given.shape}; this environment takes {shape}")
    if not np.isfinite(given).all():
        raise ValueError("an action that is not finite; entries go from -1 to 1")
    return given
