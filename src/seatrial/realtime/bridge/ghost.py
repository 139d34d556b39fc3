"""A measured trial shown beside the ship, moved and turned so that it starts at a given pose."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...data import Array, DataError, Trial
from ...data.geodesy import Datum
from ...models import STATES

_POSE = ("x", "y", "psi")


class Ghost:
    """Position and heading of a trial at any time since its first row, moved and turned as a whole.

    Attributes:
        name: of the trial.
        ship: ship of the trial; empty if the sidecar does not name it.
        datum: where x and y of the trial are zero, if the sidecar gives it.
        start: first recorded (x, y, psi, u, v_m, r) [m, rad, m/s, rad/s]; velocities without a record are zero.
        duration: of the trial [s].
    """

    def __init__(self, trial: Trial, controls: Sequence[str]) -> None:
        """A ghost of a trial with x, y and psi; `controls` of the own ship are those that `orders` returns.

        Raises:
            DataError: fewer than two rows with position and heading.
        """
        known = np.all(np.isfinite(trial.stack(*_POSE)), axis=1)
        if known.sum() < 2:
            raise DataError(f"{trial.name}: a ghost needs two rows or more with x, y and psi")
        run = trial.rows(known)
        self.name, self._t = trial.name, run.t - run.t[0]
        self.ship = str(trial.meta.get("ship") or "")
        said = trial.meta.get("datum")
        self.datum = None if said is None else Datum(float(said["latitude"]), float(said["longitude"]))
        self.duration = float(self._t[-1])
        self._x, self._y, self._psi = run["x"], run["y"], np.unwrap(run["psi"])
        first = (float(run[name][0]) if name in run else 0.0 for name in STATES)
        self.start = tuple(value if math.isfinite(value) else 0.0 for value in first)
        columns = {name: f"{name}_cmd" if f"{name}_cmd" in run else name for name in controls}
        self._orders = {name: run[column] for name, column in columns.items() if column in run}
        self.lay((0.0, *(self.start[:3])))

    def lay(self, at: Sequence[float]) -> None:
        """Set the time [s] and pose (x, y [m], psi [rad]) of its start."""
        self._t_0, self._x_0, self._y_0, psi = at
        self._turn = psi - float(self._psi[0])

    @property
    def laid(self) -> list[float]:
        """Time [s] and pose (x, y [m], psi [rad]) of its start."""
        return [self._t_0, self._x_0, self._y_0, self._turn + float(self._psi[0])]

    def pose(self, t: float) -> tuple[float, float, float] | None:
        """Pose at a time [s]: x, y [m], psi [rad]; None before its start and after its end."""
        since = t - self._t_0
        if not -1e-9 <= since <= self.duration + 1e-9:
            return None
        north, east = self._at(self._x, since) - self._x[0], self._at(self._y, since) - self._y[0]
        c, s = math.cos(self._turn), math.sin(self._turn)
        psi = self._at(self._psi, since) + self._turn
        return self._x_0 + float(c * north - s * east), self._y_0 + float(s * north + c * east), psi

    def beside(self, t: float, own: Sequence[float | None]) -> list[float] | None:
        """Pose, distance [m] and heading difference [rad] to a ship with x, y, psi first in `own`; None if unknown."""
        (x, y, psi), pose = own[:3], self.pose(t)
        if pose is None or x is None or y is None or psi is None:
            return None
        gap = math.hypot(x - pose[0], y - pose[1])
        return [round(value, 5) for value in (*pose, gap, math.remainder(psi - pose[2], 2.0 * math.pi))]

    def orders(self, t: float) -> Mapping[str, float]:
        """Recorded orders at a time, or actual controls where no orders were recorded; gaps are left out."""
        since = t - self._t_0
        if not 0.0 <= since <= self.duration:
            return {}
        row = int(np.searchsorted(self._t, since + 1e-9, side="right")) - 1
        found = {name: float(values[row]) for name, values in self._orders.items()}
        return {name: value for name, value in found.items() if math.isfinite(value)}

    def _at(self, values: Array, since: float) -> float:
        return float(np.interp(since, self._t, values))
