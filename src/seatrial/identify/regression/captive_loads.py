"""Loads of a ship at the runs of captive tests, and their derivatives by its parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...core.parameters import update, values
from ...core.symbolic import alone
from ...core.values import dataclass
from ...data import Array, DataError
from ...data.captive import LOADS, MOTION, Captive
from ...forces import Flow
from ...ships import Ship, ShipError

# Drift angle [rad] and r' beyond which a run counts as oblique.
_OBLIQUE = 1e-3


@dataclass(frozen=True)
class Predicted:
    """Loads of a model at the runs, and their derivatives.

    Attributes:
        names: loads that were measured and that the family has.
        measured: shape (loads * runs,), load by load, NaN where there is none.
        motion: at the scale of the ship, shape (runs, 8).
        back: factor from a load of the ship to one of the model tested, shape (loads,).
        group: which noise each load has, shape (loads * runs,).
        included: whether the loads contain the inertia of the model.
    """

    ship: Ship
    names: tuple[str, ...]
    measured: Array
    motion: Array
    back: Array
    group: NDArray[np.intp]
    included: bool

    @staticmethod
    @alone
    def of(ship: Ship, runs: Captive) -> Predicted:
        """Runs scaled to the length of the ship by Froude's law."""
        if not hasattr(ship.model, "loads"):
            raise ShipError(f"{ship.name}: {type(ship.model).__name__} has no forces that a captive test measures; "
                           "take a ship of the family MMG, Abkowitz or modified Abkowitz")  # fmt: skip
        scale = ship.L_pp / runs.L_pp
        root = math.sqrt(scale)
        # u, v_m by the root, r and n_P by one over it, accelerations stay, that of yaw by one over the scale.
        motion = runs.motion * np.array([root, root, 1 / root, 1 / root, 1.0, 1.0, 1.0, 1 / scale])
        has = _loads(ship.model, ship.L_pp, _rho(ship), tuple(motion[0]), False)
        names = tuple(name for name in LOADS if name in runs.loads and has[LOADS.index(name)] is not None)
        if not names:
            raise DataError(
                f"{runs.name}: {', '.join(runs.loads)} alone does not determine anything of {type(ship.model).__name__}"
            )
        force = runs.rho / _rho(ship) / scale**3
        back = np.array([force / scale if name == "N" else force for name in names])
        measured = np.concatenate([runs.loads[name] for name in names])
        oblique = (np.abs(runs.beta) > _OBLIQUE) | (np.abs(runs.column("r")) * runs.L_pp > _OBLIQUE * runs.U)
        group = np.concatenate([2 * k + oblique for k in range(len(names))])
        return Predicted(ship, names, measured, motion, back, group, runs.inertia == "included")

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Which loads were measured."""
        return np.isfinite(self.measured)

    @alone
    def by(self, paths: Sequence[str]) -> Callable[[Array], tuple[Array, Array]]:
        """Loads at the scale of the test and their derivatives, as a function of the parameters at the paths.

        Shapes (loads * runs,) and (loads * runs, paths), load by load.
        """
        q, x = ca.SX.sym("p", len(paths)), ca.SX.sym("x", len(MOTION))
        model = update(self.ship.model, {path: q[k] for k, path in enumerate(paths)})
        found = _loads(model, self.ship.L_pp, _rho(self.ship), tuple(x[k] for k in range(len(MOTION))), self.included)
        chosen = ca.vertcat(*(found[LOADS.index(name)] for name in self.names))
        count, rows = len(self.names), len(self.motion)
        run = ca.Function("loads", [q, x], [chosen, ca.jacobian(chosen, q)]).map(rows)

        def at(p: Array) -> tuple[Array, Array]:
            value, slope = run(np.tile(p[:, None], rows), self.motion.T)
            slopes = slope.full().reshape(count, rows, len(paths)) * self.back[:, None, None]
            return (self.back[:, None] * value.full()).ravel(), slopes.reshape(count * rows, len(paths))

        return at


def _rho(ship: Ship) -> float:
    """Density of the ship's water; any where forces are primed throughout."""
    return float(values(ship.model).get("body.rho", 1000.0))


def _loads(model: Any, L_pp: float, rho: float, x: tuple[Any, ...], included: bool) -> tuple[Any, ...]:
    """X, Y, N, T, F_N at one row of `MOTION`; with the inertia of the model itself where it was not taken off."""
    u, v, r, n_P, delta, *rates = x
    flow = Flow(u, v, r, n_P, delta, u, v, rho, L_pp, model.draught)
    found = model.loads(flow, tuple(rates))
    if not included:
        return tuple(found)
    m, lever, inertia = _rigid(model, L_pp, rho)
    du, dv, dr = rates
    return (
        found.X - m * (du - v * r) + lever * r * r, found.Y - m * (dv + u * r) - lever * dr,
        found.N - inertia * dr - lever * (dv + u * r), *found[3:],
    )  # fmt: skip


def _rigid(model: Any, L_pp: float, rho: float) -> tuple[Any, Any, Any]:
    """Mass [kg], its moment about midship [kg m] and inertia about midship [kg m^2]."""
    body = model.body
    if hasattr(body, "I_zG"):
        return body.m, body.m * body.x_G, body.I_zG + body.m * body.x_G * body.x_G
    unit = 0.5 * rho * L_pp**3
    return unit * body.m, unit * body.m * body.x_G * L_pp, unit * L_pp * L_pp * body.I_z


def conditions(runs: Captive) -> NDArray[np.intp]:
    """A number for each speed, drift and rate of turn regardless of side: runs of one condition err alike."""
    U, turn = runs.U, np.abs(runs.column("r")) * runs.L_pp / runs.U
    state = np.round(np.column_stack([U / U.max(), np.abs(runs.beta), turn]), 2)
    return np.unique(state, axis=0, return_inverse=True)[1].ravel()
