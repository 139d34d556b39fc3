"""Windows of measured trials as lanes: predictions under unmeasured disturbances, and floors of the error.

The windows are those of `replay` with a restart.  Controls and environment can be changed beforehand, and a disturbance
can be added: a current, a wind, an acceleration fixed to the ship or to the earth.

Floors are noise of the sensors, and of the state that a prediction starts from, in units of the standardised error
(Wakita 2022 Eq. 25), to compare with the error of a model.  An error that is independent of the model's adds to it; a
floor is what would remain of the error if everything else were perfect.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import seatrial as st

STATES = st.models.STATES

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
    state0: st.Array
    hidden: st.Array
    series: st.Array
    names: tuple[str, ...]
    measured: st.Array
    sigma: st.Array
    dt: float

    @staticmethod
    def of(trials: Mapping[str, Sequence[st.Trial]], ship: st.Ship, sigma: Mapping[str, float], restart: float) -> Cut:
        """Cut trials, by label, into windows of `restart` seconds, the last of each as short as it is.

        Raises:
            DataError: uneven steps, a gap at the start of a window, or trials with different steps.
        """
        every = [(label, trial) for label, some in trials.items() for trial in some]
        dt = float(np.median([trial.dt for _, trial in every]))
        steps = round(restart / dt)
        parts: list[tuple[str, int, int, st.Array, st.Array, st.Array]] = []
        for k, (label, trial) in enumerate(every):
            if np.abs(np.diff(trial.t) - dt).max() > 0.01 * dt:
                raise st.DataError(f"{trial.name}: steps of {dt:g} s are needed; resample it (data.prepare.resample)")
            state, acting = states(trial), st.replay_inputs(trial, ship.model)
            hidden = st.unseen_states(ship.model, acting, dt)
            acting = np.hstack([acting, np.zeros((len(acting), len(EXTRA)))])
            for a in range(0, len(trial) - 1, steps):
                if not np.isfinite(state[a]).all():
                    raise st.DataError(
                        f"{trial.name}: no complete reading at t = {trial.t[a]:g} s, where a window starts"
                    )
                rows = np.arange(a, a + steps)
                held, inside = np.minimum(rows, len(trial) - 1), (rows < len(trial))[:, None]
                parts.append((label, k, a, hidden[held], acting[held], np.where(inside, state[held], np.nan)))
        label, index, row, hidden, series, measured = (np.array(column) for column in zip(*parts, strict=True))
        names = (*ship.model.controls, *st.environment.CHANNELS, *EXTRA)
        scale = np.array([sigma[name] for name in STATES])
        return Cut(label, index, row, measured[:, 0], hidden, series, names, measured, scale, dt)

    def adding(self, channels: Sequence[str], values: st.Array) -> Cut:
        """The same with values on top of channels, shape (lanes, channels) or (lanes, steps, channels)."""
        series = self.series.copy()
        series[:, :, self.at(channels)] += values if values.ndim == 3 else values[:, None, :]
        return replace(self, series=series)

    def starting(self, state0: st.Array) -> Cut:
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
    def since(self) -> st.Array:
        """Time since the restart of each step [s], shape (steps,)."""
        return self.dt * np.arange(self.series.shape[1])


def states(trial: st.Trial) -> st.Array:
    """The measured states side by side, heading unwrapped, shape (samples, 6)."""
    found = trial.stack(*STATES)
    found[:, 2] = st.unwrapped(found[:, 2])
    return found


def disturbed(ship: st.Ship) -> st.System:
    """The open loop of a ship with the accelerations of `EXTRA` on top.

    Raises:
        DataError: a model in discrete time, which has no accelerations.
    """
    if isinstance(ship.model, st.models.Sampled):
        raise st.DataError(f"{ship.name}: a model in discrete time takes no added accelerations")
    bare = st.open_loop(ship)
    n, own = len(bare.series), slice(3, 6)

    def derivative(state: st.Scalars, acting: st.Scalars, parameters: st.Scalars) -> st.Scalars:
        rates = bare.derivative(state, acting[:n], parameters)
        d_u, d_v, d_r, north, east = acting[n:]
        ahead, aside = st.environment.to_body(north, east, st.symbolic.cos(state[2]), st.symbolic.sin(state[2]))
        u, v_m, r = rates[own]
        return (*rates[:3], u + d_u + ahead, v_m + d_v + aside, r + d_r, *rates[6:])

    return replace(bare, series=(*bare.series, *EXTRA), derivative=derivative)


@dataclass(frozen=True)
class Predictor:
    """A ship whose windows can be predicted again and again.

    Attributes:
        kernel: of the ship's structure.
        parameters: its numbers.
    """

    kernel: st.lanes.Kernel
    parameters: st.Array

    @staticmethod
    def of(ships: Sequence[st.Ship]) -> tuple[Predictor, ...]:
        """Of ships that differ in numbers only: compiled once."""
        kernel = st.lanes.Kernel(disturbed(ships[0]))
        return tuple(Predictor(kernel, st.open_loop_parameters(ship)) for ship in ships)

    def errors(self, cut: Cut, every: int = 1) -> st.Array:
        """Prediction less measurement over sigma, shape (lanes, rows, 6); zero where nothing was measured.

        Euler's rule at the trials' own step, as the common evaluator has it.
        """
        begun = np.hstack([cut.state0, cut.hidden[:, 0]])
        steps = st.lanes.Steps(cut.dt, cut.series.shape[1], every, "euler")
        found = st.lanes.run(st.lanes.Lanes(self.kernel, self.parameters, begun, cut.series), steps)
        return np.nan_to_num((found.values[:, :, : len(STATES)] - cut.measured[:, ::every]) / cut.sigma, nan=0.0)

    def accelerations(self, cut: Cut) -> st.Array:
        """The model's own rates of u, v_m and r at every measured row, shape (lanes, steps, 3)."""
        lanes, steps, channels = cut.series.shape
        state = np.concatenate([np.nan_to_num(cut.measured), cut.hidden], axis=2).reshape(lanes * steps, -1)
        rates = self.kernel.rates(state, cut.series.reshape(lanes * steps, channels), self.parameters)
        return rates[:, 3:6].reshape(lanes, steps, 3)


def loss(cut: Cut, errors: st.Array) -> dict[str, float]:
    """Standardised mean squared error (Wakita 2022 Eq. 25) by label, all windows pooled, and of "all"."""
    squared = (errors**2).sum(axis=2)
    count = np.isfinite(cut.measured[..., 0]).sum(axis=1)
    found = {str(label): cut.label == label for label in dict.fromkeys(cut.label.tolist())}
    found["all"] = np.ones(len(cut.label), dtype=bool)
    return {label: float(squared[mine].sum() / count[mine].sum()) for label, mine in found.items()}


_SPAN = 5.0
_CUBIC = 3


def white_noise(trials: Sequence[st.Trial]) -> st.Array:
    """Standard deviation of white noise in each state, from third differences, median over trials, shape (6,)."""
    return np.median([[st.sensor_noise(column) for column in states(trial).T] for trial in trials], axis=0)


def scatter(trials: Sequence[st.Trial], span: float = _SPAN) -> st.Array:
    """Root mean square of each state about a cubic through `span` seconds around it, shape (6,).

    Coloured noise shows here that third differences miss; so does true motion quicker than the cubic.
    """
    from scipy import signal

    parts: list[st.Array] = []
    for trial in trials:
        table = states(trial)
        table = table[np.isfinite(table).all(axis=1)]
        width = 2 * round(0.5 * span / trial.dt) + 1
        if len(table) > width:
            smooth: Any = signal.savgol_filter(table, width, _CUBIC, axis=0)
            parts.append(table - smooth)
    return _root_mean_square(parts)


def slow_velocity_error(trials: Sequence[st.Trial], span: float = _SPAN) -> st.Array:
    """Difference of u, v_m and r from what positions and heading say, means over `span` seconds, RMS, shape (3,).

    It holds the noise of the positions too, and so is an upper bound of the error of the velocities.
    """
    parts: list[st.Array] = []
    for trial in trials:
        table = states(trial)
        table = table[np.isfinite(table).all(axis=1)]
        n, dt = round(span / trial.dt), trial.dt
        psi = table[:, 2]
        said = np.column_stack(
            [*st.environment.to_earth(table[:, 3], table[:, 4], np.cos(psi), np.sin(psi)), table[:, 5]]
        )
        total = np.vstack([np.zeros(3), np.cumsum(0.5 * (said[1:] + said[:-1]) * dt, axis=0)])
        miss = ((total[n:] - total[:-n]) - (table[n:, :3] - table[:-n, :3])) / (n * dt)
        ahead, aside = st.environment.to_body(miss[:, 0], miss[:, 1], np.cos(psi[n // 2 :][: len(miss)]),
                               np.sin(psi[n // 2 :][: len(miss)]))  # fmt: skip
        parts.append(np.column_stack([ahead, aside, miss[:, 2]]))
    return _root_mean_square(parts)


def sensor_floor(sd: st.Array, sigma: Mapping[str, float]) -> float:
    """What the noise of the compared readings adds to any prediction, however good.

    Args:
        sd: noise of each state, SI units, shape (6,).
        sigma: scale of each state.
    """
    return float(np.sum((sd / np.array([sigma[name] for name in STATES])) ** 2))


def kinematic_floor(cut: Cut) -> dict[str, float]:
    """Error by label of a prediction that knows every measured u, v_m and r, and only integrates them.

    What is left is the disagreement of the positions and heading with the velocities.
    """
    motion = np.nan_to_num(cut.measured)
    out = motion.copy()
    psi = motion[:, 0, 2][:, None] + cut.dt * _before(np.cumsum(motion[:, :, 5], axis=1))
    north, east = st.environment.to_earth(motion[:, :, 3], motion[:, :, 4], np.cos(psi), np.sin(psi))
    out[:, :, 2] = psi
    for k, rate in ((0, north), (1, east)):
        out[:, :, k] = motion[:, 0, k][:, None] + cut.dt * _before(np.cumsum(rate, axis=1))
    return loss(cut, np.nan_to_num((out - cut.measured) / cut.sigma))


def start_floor(cut: Cut, predictor: Predictor, sd: st.Array) -> st.Array:
    """Squared error that the noise of the start alone makes, standardised, shape (lanes, steps, 6).

    Each state's error is carried through the model by a difference quotient and the squares add up, the errors
    of the states being independent.

    Args:
        cut: the windows.
        predictor: the ship's model.
        sd: standard deviation of the error of each state at a restart, SI units, shape (6,).
    """
    total = np.zeros_like(cut.measured)
    known = np.isfinite(cut.measured)
    for k, size in enumerate(sd):
        shift = np.zeros(len(STATES))
        shift[k] = size
        ahead = predictor.errors(cut.starting(cut.state0 + shift))
        behind = predictor.errors(cut.starting(cut.state0 - shift))
        total += np.where(known, (0.5 * (ahead - behind)) ** 2, 0.0)
    return total


def smoothed(cut: Cut, trials: Sequence[st.Trial], span: float) -> Cut:
    """The windows started from the last `span` seconds of readings instead of one; see `replay_start`.

    Args:
        cut: the windows.
        trials: in the order in which they were cut.
        span: length of the past [s].
    """
    state0 = cut.state0.copy()
    for index, trial in enumerate(trials):
        mine = np.flatnonzero(cut.trial == index)
        state0[mine] = st.smoothed_starts(trial.t, states(trial), cut.row[mine].tolist(), span)
    return cut.starting(state0)


def _before(total: st.Array) -> st.Array:
    """A running sum without its own term: what has been gathered when the step begins."""
    return np.hstack([np.zeros((len(total), 1)), total[:, :-1]])


def _root_mean_square(parts: Sequence[st.Array]) -> st.Array:
    return np.sqrt(np.mean(np.concatenate(parts) ** 2, axis=0))
