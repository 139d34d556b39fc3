"""A slow disturbance, read off the seconds before a prediction and carried into it, where it fades.

Gusts that the anemometer missed, currents and the errors of a model last for some ten seconds.  Before a start, the
measured change of the velocities less the model's own rates shows what has acted; its exponential mean, times a share,
acts on in the prediction and is forgotten.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..core.values import dataclass, replace
from ..data import Array, DataError, Trial
from ..engine import Scalars, System
from ..models import STATES, Sampled
from ..ships import Ship
from .lanes import Kernel, Lanes
from .loop import open_loop, open_loop_parameters
from .replay import Prepared, inputs, prepared, unseen

DISTURBED = ("d_u", "d_v_m", "d_r")
"""Accelerations that are added to those of the model: ahead, to starboard [m/s^2] and in yaw [rad/s^2]."""
_VELOCITIES = slice(3, 6)
# On trials of FRT-DS-ESSO that the model had not seen; 6 to 10 s and shares of .4 to .7 differ by less than 1 %.
_SHARE, _FILTER, _FADE = (0.0, 0.5, 0.5), 1.0, 2.5


@dataclass(frozen=True)
class Slow:
    """How much of what acted before a start acts on after it.

    Attributes:
        share: of the mean ahead, to starboard and in yaw that is carried on.
        filter: time constant of the mean over the past [s].
        fade: time in which it fades to 1/e [s].
    """

    share: tuple[float, float, float]
    filter: float
    fade: float

    @staticmethod
    def of(ship: Ship) -> Slow:
        """The usual one, in the time in which the ship travels its length.

        Half of what acted across and in yaw; nothing ahead, where a slip of a measured speed looks like a force.
        """
        T = ship.L_pp / ship.speed
        return Slow(_SHARE, _FILTER * T, _FADE * T)


def disturbed(ship: Ship) -> System:
    """The open loop of a ship with the accelerations of `DISTURBED` behind its inputs.

    Raises:
        DataError: a model in discrete time, which has no accelerations.
    """
    if isinstance(ship.model, Sampled):
        raise DataError(f"{ship.name}: a model in discrete time has no accelerations, so nothing is carried on")
    bare = open_loop(ship)
    n = len(bare.series)

    def derivative(state: Scalars, acting: Scalars, parameters: Scalars) -> Scalars:
        rates = bare.derivative(state, acting[:n], parameters)
        moved = (rate + more for rate, more in zip(rates[_VELOCITIES], acting[n:], strict=True))
        return (*rates[:3], *moved, *rates[6:])

    return replace(bare, series=(*bare.series, *DISTURBED), derivative=derivative)


@dataclass(frozen=True)
class Carrier:
    """A ship that takes disturbances, traced once for any number of trials.

    Attributes:
        slow: what is carried on.
        history: seconds before a start that are read.
    """

    ship: Ship
    slow: Slow
    history: float
    kernel: Kernel
    parameters: Array

    @staticmethod
    def of(ship: Ship, history: float, slow: Slow | None = None) -> Carrier:
        """The ship made ready.

        Args:
            history: seconds before a start that are read.
            slow: what is carried on; None takes the usual (`Slow.of`).

        Raises:
            DataError: `history` is not above zero, or the model is one in discrete time.
        """
        if not history > 0.0:
            raise DataError(f"history is {history:g} s; it must be above zero")
        return Carrier(ship, slow or Slow.of(ship), history, Kernel(disturbed(ship)), open_loop_parameters(ship))

    def replay(
        self, trial: Trial, *, restart: float | None = None, method: str = "rk4", smooth_start: float | None = None,
        threads: int | None = None,
    ) -> Trial:  # fmt: skip
        """Free-running prediction as of `replay.replay`, what has acted before each start carried on.

        Raises:
            DataError, SimulationError: as `replay`.
        """
        ready = prepared(self.ship, trial, restart=restart, method=method, smooth_start=smooth_start)
        acted = self.before(trial, ready)
        since = ready.dt * np.arange(ready.steps)
        carried = acted[:, None, :] * np.exp(-since / self.slow.fade)[None, :, None]
        ready = replace(ready, lanes=np.concatenate([ready.lanes, carried], axis=2))
        lanes = Lanes(self.kernel, self.parameters, ready.begun, ready.series)
        made = ready.sailed(self.ship, lanes, STATES, method, threads)
        return made.noting(f"what acted in {self.history:g} s before each start carried on")

    def before(self, trial: Trial, ready: Prepared) -> Array:
        """Shares of what has acted before each start, shape (starts, 3)."""
        first = int(np.searchsorted(trial.t, ready.t[0]))
        series = inputs(trial, self.ship.model)[first : first + ready.t.size]
        hidden = unseen(self.ship.model, series, ready.dt)
        found = self.means(ready.t, ready.state, hidden, series, ready.starts)
        return np.array(self.slow.share) * found

    def means(self, t: Array, state: Array, hidden: Array, series: Array, starts: Sequence[int]) -> Array:
        """Exponential mean of what acts beyond the model before each start, shape (starts, 3).

        It begins at none, so that little history says little; rows with gaps say nothing.

        Args:
            t: times of the rows [s].
            state, hidden, series: as measured, what the model remembers, and what acts, per row.
            starts: rows, each of which is the last that is known.
        """
        acting = np.hstack([series, np.zeros((len(t), len(DISTURBED)))])
        acted = np.nan_to_num(beyond(self.kernel, self.parameters, t, np.hstack([state, hidden]), acting))
        span = np.diff(t)
        out = np.zeros((len(starts), len(DISTURBED)))
        for k, row in enumerate(starts):
            began = int(np.searchsorted(t, t[row] - self.history * (1.0 + 1e-9)))
            age = t[row] - t[began + 1 : row + 1]
            weight = np.exp(-age / self.slow.filter) * span[began:row] / self.slow.filter
            out[k] = weight @ acted[began:row]
        return out


def beyond(kernel: Kernel, parameters: Array, t: Array, state: Array, acting: Array) -> Array:
    """Measured accelerations from each row to the next less those of the model, shape (rows - 1, 3).

    Ahead and to starboard [m/s^2], in yaw [rad/s^2]; NaN where the velocities have a gap.

    Args:
        t: times of the rows [s].
        state: measured, with what the model remembers, shape (rows, states).
        acting: controls and environment, shape (rows, inputs).
    """
    rates = kernel.rates(np.nan_to_num(state), acting, parameters)
    return np.diff(state[:, _VELOCITIES], axis=0) / np.diff(t)[:, None] - rates[:-1, _VELOCITIES]
