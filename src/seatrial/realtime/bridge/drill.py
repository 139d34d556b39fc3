"""A standard manoeuvre steered in the loop tick by tick, with its indices as they become available."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...data import DataError, Trial
from ...manoeuvres import Index, Manoeuvre
from ...models import STATES
from ..plant import Plant
from ..recording import Columns, usual_names

_CHECK, _ROW, _LAST = 0.25, 0.01, 500.0
"""Time between two evaluations of the indices, between two rows, and until it is ended; in times of one ship length."""


class Drill:
    """One manoeuvre in progress.

    It steers once a tick, so its orders act a tick later than in `simulate`.

    Attributes:
        kind: of the manoeuvre.
        over: whether it has ended.
        complete: whether the run has all that the indices need.
        indices: the indices so far, by name.
    """

    def __init__(self, policy: Manoeuvre, plant: Plant, speed: float) -> None:
        """Begin a manoeuvre from the present state; `speed` [m/s] sets its greatest duration."""
        self.kind, self.over, self.complete = policy.kind, False, False
        self.indices: Mapping[str, Index] = {}
        self._policy, self._begun = policy, plant.t
        self._memory = policy.begin(_state(plant))
        self._orders = policy.orders
        self._columns = Columns(plant, usual_names(plant))
        self._rows: list[list[float]] = []
        self._length = plant.ship.L_pp / max(speed, 1e-3)
        self._checked = 0.0

    def steer(self, plant: Plant) -> dict[str, float]:
        """Orders for the next tick, without those that the ship does not have."""
        t = plant.t - self._begun
        if not self._rows or t - self._rows[-1][0] >= _ROW * self._length:
            row = self._columns.row()
            row[0] = t
            self._rows.append(row)
        if t - self._checked >= _CHECK * self._length:
            self._checked = t
            self._read(plant.ship.L_pp)
            self.over = self.complete or t > _LAST * self._length
        given, self._memory = self._policy.command(t, _state(plant), self._memory)
        pairs = zip(self._orders, given, strict=True)
        return {name: float(value) for name, value in pairs if name in plant.orders}

    def snapshot(self) -> dict[str, Any]:
        """Progress, for JSON."""
        return {"begun": self._begun, "memory": [float(value) for value in self._memory], "rows": self._rows,
                "checked": self._checked}  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Restore the result of `snapshot`; the indices follow with the next evaluation."""
        self._begun, self._checked = float(saved["begun"]), float(saved["checked"])
        self._memory, self._rows = tuple(saved["memory"]), [list(row) for row in saved["rows"]]

    def _read(self, L_pp: float) -> None:
        t, *values = np.array(self._rows).T.copy()
        trial = Trial(self.kind, t, dict(zip(self._columns.names[1:], values, strict=True)))
        try:
            self.complete = bool(self._policy.complete(trial))
            self.indices = self._policy.indices(trial, L_pp)
        except DataError:  # the run is still too short
            return


def _state(plant: Plant) -> tuple[Any, ...]:
    return tuple(plant[name] for name in STATES)
