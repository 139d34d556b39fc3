"""Windows of measured trials as lanes, predicted under disturbances that nobody measured.

The windows are those of `replay` with a restart; what acts on the ship may be changed beforehand, and a
disturbance may be added: a current, a wind, an acceleration fixed to the ship or to the earth.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.symbolic import cos, sin
from ..data import Array, DataError, Trial, unwrapped
from ..engine import Scalars, System
from ..engine.rollout import simulator
from ..environment import CHANNELS, to_body
from ..models import STATES, Sampled
from ..ships import Ship
from ..simulate.loop import open_loop, open_loop_parameters
from ..simulate.replay import inputs, unseen

EXTRA = ("d_u", "d_v_m", "d_r", "d_north", "d_east")
"""Accelerations that are added to the model's: along the ship, across, in yaw; and towards north and east."""

CURRENT, WIND, BODY, EARTH = ("current_x", "current_y"), ("wind_x", "wind_y"), EXTRA[:3], EXTRA[3:]


@dataclass(frozen=True)
class Cut:
    """All windows of some trials, padded to one length.

    Attributes:
        label: what each window is counted under, such as its kind of manoeuvre; shape (lanes,).
        trial, row: index of the trial of each window and of its first row there, shape (lanes,).
        state0: state in which each starts, shape (lanes, 6).
        hidden: states of the model beyond the six, as the log before each row leaves them, shape
            (lanes, steps, states - 6); they begin so and go by the model afterwards.
        series: what acts, by `names`, shape (lanes, steps, channels).
        names: controls, environment, then `EXTRA`.
        measured: shape (lanes, steps, 6), heading unwrapped; NaN beyond the end.
        sigma: scale of each state, SI units, shape (6,).
        dt: time step [s].
    """

    label: NDArray[np.str_]
    trial: NDArray[np.intp]
    row: NDArray[np.intp]
    state0: Array
    hidden: Array
    series: Array
    names: tuple[str, ...]
    measured: Array
    sigma: Array
    dt: float

    @staticmethod
    def of(trials: Mapping[str, Sequence[Trial]], ship: Ship, sigma: Mapping[str, float], restart: float) -> Cut:
        """Cut trials, by label, into windows of `restart` seconds, the last of each as short as it is.

        Raises:
            DataError: uneven steps, a gap at the start of a window, or trials with different steps.
        """
        every = [(label, trial) for label, some in trials.items() for trial in some]
        dt = float(np.median([trial.dt for _, trial in every]))
        steps = round(restart / dt)
        parts: list[tuple[str, int, int, Array, Array, Array]] = []
        for k, (label, trial) in enumerate(every):
            if np.abs(np.diff(trial.t) - dt).max() > 0.01 * dt:
                raise DataError(f"{trial.name}: steps of {dt:g} s are needed; resample it (data.prepare.resample)")
            state, acting = states(trial), inputs(trial, ship.model)
            hidden = unseen(ship.model, acting, dt)
            acting = np.hstack([acting, np.zeros((len(acting), len(EXTRA)))])
            for a in range(0, len(trial) - 1, steps):
                if not np.isfinite(state[a]).all():
                    raise DataError(f"{trial.name}: no complete reading at t = {trial.t[a]:g} s, where a window starts")
                rows = np.arange(a, a + steps)
                held, inside = np.minimum(rows, len(trial) - 1), (rows < len(trial))[:, None]
                parts.append((label, k, a, hidden[held], acting[held], np.where(inside, state[held], np.nan)))
        label, index, row, hidden, series, measured = (np.array(column) for column in zip(*parts, strict=True))
        names = (*ship.model.controls, *CHANNELS, *EXTRA)
        scale = np.array([sigma[name] for name in STATES])
        return Cut(label, index, row, measured[:, 0], hidden, series, names, measured, scale, dt)

    def adding(self, channels: Sequence[str], values: Array) -> Cut:
        """The same with values on top of channels, shape (lanes, channels) or (lanes, steps, channels)."""
        series = self.series.copy()
        series[:, :, self.at(channels)] += values if values.ndim == 3 else values[:, None, :]
        return replace(self, series=series)

    def starting(self, state0: Array) -> Cut:
        """The same from other states, shape (lanes, 6)."""
        return replace(self, state0=state0)

    def lanes(self, which: NDArray[np.bool_] | NDArray[np.intp]) -> Cut:
        """Only some windows."""
        own = ("label", "trial", "row", "state0", "hidden", "series", "measured")
        return replace(self, **{name: getattr(self, name)[which] for name in own})

    def at(self, channels: Sequence[str]) -> list[int]:
        """Places of channels in the series."""
        return [self.names.index(name) for name in channels]

    @property
    def since(self) -> Array:
        """Time since the restart of each step [s], shape (steps,)."""
        return self.dt * np.arange(self.series.shape[1])


def states(trial: Trial) -> Array:
    """The measured states side by side, heading unwrapped, shape (samples, 6)."""
    found = trial.stack(*STATES)
    found[:, 2] = unwrapped(found[:, 2])
    return found


def disturbed(ship: Ship) -> System:
    """The open loop of a ship with the accelerations of `EXTRA` on top.

    Raises:
        DataError: a model in discrete time, which has no accelerations.
    """
    if isinstance(ship.model, Sampled):
        raise DataError(f"{ship.name}: a model in discrete time takes no added accelerations")
    bare = open_loop(ship)
    n, own = len(bare.series), slice(3, 6)

    def derivative(state: Scalars, acting: Scalars, parameters: Scalars) -> Scalars:
        rates = bare.derivative(state, acting[:n], parameters)
        d_u, d_v, d_r, north, east = acting[n:]
        ahead, aside = to_body(north, east, cos(state[2]), sin(state[2]))
        u, v_m, r = rates[own]
        return (*rates[:3], u + d_u + ahead, v_m + d_v + aside, r + d_r, *rates[6:])

    return replace(bare, series=(*bare.series, *EXTRA), derivative=derivative)


@dataclass(frozen=True)
class Predictor:
    """A ship whose windows can be predicted again and again.

    Attributes:
        compiled: kernel of the ship's structure.
        parameters: its numbers.
    """

    compiled: Any
    parameters: Array

    @staticmethod
    def of(ships: Sequence[Ship]) -> tuple[Predictor, ...]:
        """Of ships that differ in numbers only: compiled once."""
        compiled = simulator(disturbed(ships[0]))
        return tuple(Predictor(compiled, open_loop_parameters(ship)) for ship in ships)

    def errors(self, cut: Cut, every: int = 1) -> Array:
        """Prediction less measurement over sigma, shape (lanes, rows, 6); zero where nothing was measured.

        Euler's rule at the trials' own step, as the common evaluator has it.
        """
        begun = np.hstack([cut.state0, cut.hidden[:, 0]])
        run = self.compiled.run(
            begun, cut.series, self.parameters, dt=cut.dt, steps=cut.series.shape[1], every=every, method="euler"
        )
        return np.nan_to_num((run.values[:, :, : len(STATES)] - cut.measured[:, ::every]) / cut.sigma, nan=0.0)

    def accelerations(self, cut: Cut) -> Array:
        """The model's own rates of u, v_m and r at every measured row, shape (lanes, steps, 3)."""
        lanes, steps, channels = cut.series.shape
        state = np.concatenate([np.nan_to_num(cut.measured), cut.hidden], axis=2).reshape(lanes * steps, -1)
        rates = self.compiled.evaluate(state, cut.series.reshape(lanes * steps, channels), self.parameters)
        return rates[:, 3:6].reshape(lanes, steps, 3)


def loss(cut: Cut, errors: Array) -> dict[str, float]:
    """Standardised mean squared error (Wakita 2022 Eq. 25) by label, all windows pooled, and of "all"."""
    squared = (errors**2).sum(axis=2)
    count = np.isfinite(cut.measured[..., 0]).sum(axis=1)
    found = {str(label): cut.label == label for label in dict.fromkeys(cut.label.tolist())}
    found["all"] = np.ones(len(cut.label), dtype=bool)
    return {label: float(squared[mine].sum() / count[mine].sum()) for label, mine in found.items()}
