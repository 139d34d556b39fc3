"""Hybrids: the MMG family with a bounded residual force, a wind-driven surface current and a short memory."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from ..core.parameters import Scalar, Scalars, Terms, spec, terms
from ..core.values import dataclass
from ..data import Array
from ..environment import Environment
from ..forces import Flow, Force
from ..forces.shallow import afloat
from . import STATES
from .common import Surroundings
from .mmg import Mmg
from .residual import Scale, inward, meaning, network, odd, outward


@dataclass(frozen=True, kw_only=True)
class Hybrid(Mmg):
    """An MMG ship with a residual force, a surface current that follows the wind, and a memory of the shaft.

    The residual is linear in its weights `residual_X`, `residual_Y` and `residual_N` (see `residual`), so that
    `shooting:Trajectory` fits them with the coefficients of the physics, through the trajectory; all zero, the
    ship is the MMG ship.  Hidden tanh units of those terms, `unit_in` and `unit_out`, make a small network beside it
    (see `residual`).  All of it is silent at rest in still air and bounded everywhere.

    The water at the surface drifts with the wind that blew over it in the last minutes: `drift_along` times that wind
    downwind and `drift_across` to the right of it, both after a first-order lag `tau_wind`.  A logged current comes
    on top.  Revolutions as they were, after a lag `tau_shaft`, are the factor m of the residual: what the race and
    the swirl of the propeller leave in the water by the stern.

    Three states follow the six: the lagged wind (where it comes from) and the lagged revolutions.  A prediction
    from a log starts them from the log before it (`recall`), as settled where there is none; a simulation starts them
    settled to the wind and the revolutions it begins with.
    """

    states: ClassVar[tuple[str, ...]] = (*STATES, "slow_wind_x", "slow_wind_y", "slow_n")

    scale: Scale
    residual_X: Terms = terms(meaning)
    residual_Y: Terms = terms(meaning)
    residual_N: Terms = terms(meaning)
    unit_in: Terms = terms(inward)
    unit_out: Terms = terms(outward)
    drift_along: Scalar = spec("", "surface drift downwind over the speed of the wind", (-0.1, 0.1), default=0.0)
    drift_across: Scalar = spec("", "surface drift to the right of it, likewise", (-0.1, 0.1), default=0.0)
    tau_wind: Scalar = spec("s", "time in which the drift follows the wind", (1.0, 1e5), default=60.0)
    tau_shaft: Scalar = spec("s", "time in which the water at the stern follows the shaft", (0.5, 1e3), default=8.0)

    @property
    def sides(self) -> tuple[int, ...]:
        return 1, -1, 1

    @property
    def asymmetries(self) -> tuple[str, ...]:
        """Terms that make port and starboard differ, as those of a single screw do."""
        given = {"X": self.residual_X, "Y": self.residual_Y, "N": self.residual_N}
        wrong = [
            f"residual_{axis}.{name}" for axis in given for name in given[axis].names if odd(name) == (axis == "X")
        ]
        return (*wrong, "drift_across")

    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        wind_x, wind_y, slow_n = state[6:9]
        # The wind is where it comes from; the water goes the other way.
        north = self.drift_across * wind_y - self.drift_along * wind_x
        east = -self.drift_across * wind_x - self.drift_along * wind_y
        drifting = environment._replace(current_x=environment.current_x + north, current_y=environment.current_y + east)
        around = Surroundings.of(state, drifting)
        flow = around.flow(self.body, control[0], control[1])
        force = self.force(flow, control[2:])
        force = force + self.residual(flow, slow_n)
        body = afloat(self.body, self.hull, flow, self.extras.components)
        rates = around.rates(body.acceleration(force, flow.u, flow.v_m, flow.r))
        return (
            *rates, (environment.wind_x + environment.current_x - wind_x) / self.tau_wind,
            (environment.wind_y + environment.current_y - wind_y) / self.tau_wind,
            (control[0] - slow_n) / self.tau_shaft,
        )  # fmt: skip

    def residual(self, flow: Flow, slow_n: Scalar) -> Force:
        """What trials show beyond the physics [N, N, N m], polynomial and network; `slow_n` [1/s] is remembered."""
        factors = self.scale.factors(flow, slow_n)
        force = self.scale.force(factors, self.residual_X, self.residual_Y, self.residual_N)
        if not self.unit_in.names:
            return force
        return force + self.scale.sized(network(self.unit_in, self.unit_out, factors))

    def recall(self, series: Array, dt: float) -> Array:
        """The three remembered states at each row, shape (rows, 3), from the rows before it; settled at the first."""
        around = series[:, len(self.controls) :]
        # Over the water: where the wind comes from, plus where the current goes.
        given = ((around[:, 0] + around[:, 2], self.tau_wind), (around[:, 1] + around[:, 3], self.tau_wind),
                 (series[:, 0], self.tau_shaft))  # fmt: skip
        return np.column_stack([_lagged(x, float(tau), dt) for x, tau in given])


def _lagged(x: Array, tau: float, dt: float) -> Array:
    """First-order lag of a series, held from row to row, that begins settled."""
    if x.size <= 1:  # called by the thousand, where many ships begin at once
        return x.copy()
    from scipy.signal import lfilter  # nearly half a second, for what only measured rows need

    share = -math.expm1(-dt / tau)
    later, _ = lfilter([share], [1.0, share - 1.0], x, zi=np.array([(1.0 - share) * x[0]]))
    return np.append(x[0], np.asarray(later, dtype=np.float64)[:-1])
