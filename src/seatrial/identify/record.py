"""A trial as a model sees it, and the windows that predictions are compared with: one lane of a kernel each.

A `Record` is one trial on even steps: measured states, inputs, and the states that are not measured.  `windows` cuts
records into windows that start at measured states; `shooting.chains` cuts them into windows that follow each other.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.values import dataclass
from ..data import Array, DataError, Trial, unwrapped
from ..data.prepare import between_readings, derived, resample
from ..models import STATES, Model
from ..simulate.begun import begun
from ..simulate.lanes import Steps
from ..simulate.replay import inputs, own_states
from ..simulate.steering import is_held, logged, sources
from . import Loss, Problem, StudyError
from .noise import noise

# A step may differ from the others by this fraction before the trial counts as uneven.
_UNEVEN = 0.02


def spread(trials: Sequence[Trial], names: Sequence[str] = STATES) -> dict[str, float]:
    """Standard deviation of each of these states over all trials together, heading unwrapped; the default sigma.

    States that no trial has are left out.

    Raises:
        DataError: a channel that never changes has no spread to measure errors by.
    """
    out: dict[str, float] = {}
    for name in names:
        having = [t for t in trials if logged(t, name) and name not in derived(t)]
        if not having:
            continue
        values = np.concatenate([unwrapped(t[name]) if name == "psi" else t[name] for t in having])
        out[name] = float(np.nanstd(values))
        if not out[name] > 0:
            raise DataError(f"channel {name} is constant in every trial; give its scale in [loss] sigma")
    return out


def scales(problem: Problem) -> dict[str, float]:
    """Sigma of each compared channel: as the loss has it, else noise or `spread` of the training trials.

    Raises:
        StudyError: a loss with another scale.
    """
    if problem.loss.sigma:
        return dict(problem.loss.sigma)
    if problem.loss.scale not in ("noise", "spread"):
        raise StudyError(f"loss.scale is '{problem.loss.scale}'; it is noise or spread")
    names = problem.ship.model.motion
    return noise(problem.trials, names) if problem.loss.scale == "noise" else spread(problem.trials, names)


def step_of(trials: Sequence[Trial], dt: float | None = None) -> float:
    """Time step of a fit [s]: `dt` where it is given, else the median step of the trials."""
    return dt or float(np.median([trial.dt for trial in trials]))


def every_of(every: int | None, dt: float) -> int:
    """Stride of the compared rows: as given, else about one second, rows being `dt` [s] apart."""
    return every or max(round(1.0 / dt), 1)


class Settings(Protocol):
    """How trajectories are cut, integrated and compared; every estimator of trajectories has these."""

    @property
    def window(self) -> float | None:
        """Length of a prediction [s]; None runs each trial through."""
        ...

    @property
    def every(self) -> int | None:
        """Stride of the compared rows; None takes about one second (`every_of`)."""
        ...

    @property
    def dt(self) -> float | None:
        """Time step [s]; None takes the median step of the trials."""
        ...

    @property
    def method(self) -> str:
        """"euler" or "rk4"."""
        ...

    @property
    def threads(self) -> int | None:
        """None takes every processor."""
        ...


def compared_as(estimator: Any) -> Any:
    """How the trajectories of a fit are cut for its test: as its estimator has it, or as its `compared_as` says."""
    return getattr(estimator, "compared_as", estimator)


def cut_as(problem: Problem, settings: Settings) -> tuple[dict[str, float], dict[str, Any]]:
    """Scale of each channel, and the arguments by which trials are cut and integrated."""
    window = settings.window or max(trial.duration for trial in problem.trials)
    dt = step_of(problem.trials, settings.dt)
    return scales(problem), {
        "window": window, "dt": dt, "every": every_of(settings.every, dt),
        "method": settings.method, "threads": settings.threads,
    }  # fmt: skip


def even(trial: Trial, dt: float, model: Model | None = None) -> Trial:
    """The trial on even steps of `dt` [s]; resampled where it is not already.

    Rows that were not logged are not made up, but for the controls of the `model`: they move between their readings
    whether a row is there or not.  A row has a control where a reading is within half a step.
    """
    steps = np.diff(trial.t)
    if np.all(np.abs(steps - dt) <= _UNEVEN * dt):
        return trial
    out = resample(trial, dt)
    if model is None:
        return out
    read = [name for name, _ in sources(trial, model) if logged(trial, name)]
    return out.having(**{name: _steered(name, trial, out, dt) for name in read})


def _steered(name: str, trial: Trial, out: Trial, dt: float) -> Array:
    """A control at the rows of a resampled trial, held ones by what acts on the mean until the next row."""
    values, good = trial[name], np.isfinite(trial[name])
    if is_held(trial, name):
        # the integral of what is held rises along straight lines
        since = np.append(trial.t, trial.t[-1] + 2.0 * dt)
        acts = between_readings(name, trial.t, values, trial.t, held=True)
        area = np.append(0.0, np.cumsum(acts * np.diff(since)))
        return np.diff(np.interp(np.append(out.t, out.t[-1] + dt), since, area)) / dt
    t = trial.t[good]
    after = np.clip(np.searchsorted(t, out.t), 1, max(t.size - 1, 1))
    near = np.minimum(np.abs(out.t - t[after - 1]), np.abs(out.t - t[np.minimum(after, t.size - 1)]))
    on = near <= (0.5 + 1e-6) * dt
    line = between_readings(name, trial.t, values, out.t, held=False)
    return np.where(np.isfinite(out[name]), out[name], np.where(on, line, np.nan))


def measured(trial: Trial, motion: Sequence[str] = STATES) -> Array:
    """The measured states side by side, heading unwrapped, shape (rows, 6), or 8 with heel and roll rate.

    Heel and roll rate that a trial lacks are gaps.

    Raises:
        DataError: a channel is missing.
    """
    absent = [name for name in STATES if name not in trial]
    if absent:
        raise DataError(f"{trial.name}: no channel {', '.join(absent)}; a fit needs {', '.join(STATES)}")
    return _told(trial, motion)


def _told(trial: Trial, motion: Sequence[str]) -> Array:
    """The same of a trial that may lack channels, which are gaps."""
    none = np.full(len(trial), np.nan)
    state = np.column_stack([trial.channels.get(name, none) for name in motion])
    if np.isfinite(state[:, 2]).any():
        state[:, 2] = unwrapped(state[:, 2])
    return state


class Piece(NamedTuple):
    """One window of a record.

    Attributes:
        state0: state at its start.
        series: controls and environment per step, the last row held beyond the end, shape (steps, controls + 8).
        measured: compared rows, zero where `scale` is zero, shape (rows, motion).
        scale: root weight over sigma of each entry, zero for a gap, shape (rows, motion).
        rows: indices of the compared rows in the record, shape (rows,); the last one held beyond the end.
        inside: compared rows that lie within the record.
        read: whether a control was read at each step, shape (steps, controls).
    """

    state0: Array
    series: Array
    measured: Array
    scale: Array
    rows: NDArray[np.intp]
    inside: NDArray[np.bool_]
    read: NDArray[np.bool_]


@dataclass(frozen=True)
class Record:
    """One trial on even steps as a model sees it, row by row.

    Attributes:
        state: measured states, heading unwrapped, shape (rows, motion): six, or eight of a ship that rolls.
        series: what acts, controls and environment, shape (rows, controls + 8).
        hidden: the model's states beyond the six, as measured or as `Model.recall` has them, shape (rows, states - 6).
        begun: states to start from (`simulate.begun`), shape (rows, 6).
        complete: indices of the rows at which a window may start: with all states that the trial tells.
        read: whether each control was read, shape (rows, controls).
    """

    state: Array
    series: Array
    hidden: Array
    begun: Array
    complete: NDArray[np.intp]
    read: NDArray[np.bool_]

    @staticmethod
    def of(trial: Trial, model: Model) -> Record:
        """Read a trial.

        Raises:
            DataError: the trial lacks a control, or tells too little of the motion.
        """
        states, good = begun(trial)
        # what is made from others is no reading
        own = trial.having(**{name: np.full(len(trial), np.nan) for name in derived(trial) if name in STATES})
        state, series = _told(own, model.motion), inputs(trial, model)
        read = np.column_stack([np.isfinite(trial[name]) for name, _ in sources(trial, model)])
        hidden = own_states(trial, model, series, trial.dt)
        return Record(state, series, hidden, states, np.flatnonzero(good), read)

    @property
    def last(self) -> int:
        """Index of the last complete row; 0 where there is none."""
        return int(np.max(self.complete, initial=0))

    @property
    def bridged(self) -> Array:
        """The six measured states, gaps bridged by straight lines, shape (rows, 6)."""
        rows, good = np.arange(len(self.state), dtype=np.float64), self.complete
        return np.column_stack([np.interp(rows, rows[good], column[good]) for column in self.begun.T])

    def begins(self, onwards: int) -> Iterator[int]:
        """First rows of windows, each complete, `onwards` rows apart or as soon after as a row is complete."""
        first = 0
        while first < self.last:
            first = int(self.complete[np.searchsorted(self.complete, first)])
            yield first
            first += onwards

    def window(self, begin: int, steps: int, every: int, scale: Array, *, joined: bool = False) -> Piece:
        """The window of `steps` rows from row `begin`, of which every `every`-th is compared.

        Args:
            scale: root weight over sigma of each state that may be compared, shape (6,) or (motion,).
            joined: whether the first row counts in the window before.
        """
        at = np.arange(begin, begin + steps)
        held = np.minimum(at, self.last)
        rows, inside = held[::every], at[::every] <= self.last
        counts = inside & ((at[::every] > begin) if joined else True)
        state = self.state[rows, : scale.size]
        scaled = np.where(np.isfinite(state) & counts[:, None], scale, 0.0)
        start = np.append(self.begun[begin], self.hidden[begin])
        return Piece(start, self.series[held], np.where(scaled > 0, state, 0.0), scaled, rows, inside,
                     self.read[held])  # fmt: skip


@dataclass(frozen=True)
class Windows:
    """Windows of all trials, padded to one length.

    Attributes:
        state0: measured state at the start of each window, shape (lanes, states).
        series: controls and environment per step, shape (lanes, steps, controls + 8).
        measured: shape (lanes, rows, motion); zero where `scale` is zero.
        scale: root weight over sigma of each entry, same shape; zero marks a gap or padding.
        trial: index of the trial each window comes from, shape (lanes,).
        weight: share of a compared row that counts as independent.
        dt, steps, every: time step of the integrator [s], its samples in a window, and how many of its steps lie
            between compared rows.
        read: whether each control was read at each row, shape (lanes, rows of the log, controls).
    """

    state0: Array
    series: Array
    measured: Array
    scale: Array
    trial: NDArray[np.intp]
    weight: float
    dt: float
    steps: int
    every: int
    read: NDArray[np.bool_]

    @property
    def width(self) -> int:
        """States that are measured, the first ones of the model: six, or eight of a ship that rolls."""
        return self.scale.shape[2]

    def grid(self, method: str) -> Steps:
        """Steps of every window, a compared row each time."""
        return Steps(self.dt, self.steps, self.every, method)

    @property
    def samples(self) -> int:
        """Compared rows, gaps left out."""
        return int(self.scale.any(axis=2).sum())

    @property
    def entries(self) -> int:
        """Compared numbers, gaps left out."""
        return int((self.scale > 0).sum())


def share(loss: Loss, interval: float) -> float:
    """Share of a compared row that counts as independent, rows lying `interval` [s] apart."""
    return 1.0 if not loss.correlation else min(interval / loss.correlation, 1.0)


def root_weights(sigma: Mapping[str, float], weight: float, motion: Sequence[str]) -> Array:
    """Root of the weight over sigma of each state, zero for those that are not compared, shape (motion,)."""
    return np.array([np.sqrt(weight) / sigma[n] if n in sigma else 0.0 for n in motion])


def lanes(
    parts: Sequence[tuple[int, Piece]], weight: float, *, dt: float, steps: int, every: int, substeps: int
) -> dict[str, Any]:
    """Arguments of `Windows`: pieces with the indices of their trials, one lane each.

    Args:
        dt, steps, every: of the rows of the trials.
        substeps: equal steps of the integrator from row to row, with what acts held.
    """
    pieces = [piece for _, piece in parts]
    return {
        "state0": np.stack([p.state0 for p in pieces]),
        "series": between(np.stack([p.series for p in pieces]), substeps),
        "measured": np.stack([p.measured for p in pieces]), "scale": np.stack([p.scale for p in pieces]),
        "trial": np.array([index for index, _ in parts], dtype=np.intp), "weight": weight, "dt": dt / substeps,
        "steps": (steps - 1) * substeps + 1, "every": every * substeps, "read": np.stack([p.read for p in pieces]),
    }  # fmt: skip


def windows(
    trials: Sequence[Trial], model: Model, loss: Loss, sigma: Mapping[str, float], *,
    window: float, dt: float, every: int, stride: float | None = None, substeps: int = 1,
) -> Windows:  # fmt: skip
    """Every trial cut into windows of `window` seconds, the last one shorter; one follows the other.

    From row to row, `dt` [s] apart, the integrator takes `substeps` equal steps (`approach.substeps`), with
    inputs held constant.  With a `stride` [s] a window begins every `stride` seconds, so that windows overlap
    if it is shorter.
    A window starts at a complete row; rows with gaps inside it weigh nothing.

    Raises:
        DataError: a trial lacks a channel, or has no window with two complete rows.
    """
    steps = max(round(window / dt), 1) + 1
    weight = share(loss, every * dt)
    scale = root_weights(sigma, weight, model.motion)
    onwards = steps - 1 if stride is None else max(round(stride / dt), 1)
    parts: list[tuple[int, Piece]] = []
    for index, trial in enumerate(trials):
        record, own = Record.of(even(trial, dt, model), model), scale * np.sqrt(loss.weight(trial.name))
        cut = [record.window(begin, steps, every, own) for begin in record.begins(onwards)]
        found = [(index, piece) for piece in cut if piece.inside.sum() > 1]
        if not found:
            raise DataError(f"{trial.name}: no window of {window:g} s with two rows of all that the trial tells")
        parts += found
    return Windows(**lanes(parts, weight, dt=dt, steps=steps, every=every, substeps=substeps))


def between(series: Array, substeps: int) -> Array:
    """Inputs of every step of the integrator from those of every row, shape (lanes, steps, inputs); all hold."""
    return series if substeps == 1 else np.repeat(series, substeps, axis=1)[:, : (series.shape[1] - 1) * substeps + 1]
