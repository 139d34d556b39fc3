"""Free-running prediction of a measured trial from its own controls and wind: inputs, initial states, gaps.

`starts` says in which states a prediction begins.  `gaps` lists, row by row, the controls and the environment that a
trial did not log and `inputs` fills in.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray

from ..core.values import dataclass, replace
from ..data import Array, DataError, Trial
from ..data.prepare import between_readings, resampling, true_wind
from ..engine import SimulationError
from ..environment import CHANNELS, VECTORS
from ..models import ROLL, STATES, Model, Sampled, Stepped
from ..models.settled import unseen
from ..ships import Ship
from .approach import substeps
from .begun import begun as started
from .begun import too_little
from .lanes import Lanes, Steps, given, run
from .loop import open_loop_memory
from .run import SIMULATED
from .starts import before, of_a_wrong_compass, smoothed_starts, swung, wrong_compass
from .steering import is_held, logged, sources


def inputs(trial: Trial, model: Model) -> Array:
    """Inputs from each row to the next, shape (rows, controls + 8): controls and environment.

    Controls act with the mean of the two rows, which is exact for the ramp of an actuator; those in the trial's
    `meta["held"]`, and the environment, are constant from row to row.  What was logged at some rows only moves the same
    way (`gaps` lists the others): a control along the straight line from reading to reading, what is held by its last
    value.  A control that the trial lacks is taken from the order it follows (alpha_1 from delta).  A wind that was
    logged as apparent only is converted to the true one by the measured motion.  Wind, waves and current without a
    value in any row are zero, and water without a depth is deep.

    Raises:
        DataError: the trial lacks a control, or the wind that a network needs.
    """
    return _Acting.of(trial, model).series


@dataclass(frozen=True)
class _Acting:
    """What acts on a ship as a trial tells it, shapes (rows, controls + 8).

    Attributes:
        values: at each row.
        series: from each row to the next.
        ramps: columns that move along straight lines; the others hold.
        sampled: whether the model takes the values of its own instants.
    """

    values: Array
    series: Array
    ramps: NDArray[np.intp]
    sampled: bool

    @staticmethod
    def of(trial: Trial, model: Model) -> _Acting:
        """Read a trial."""
        values, ramps = _at_rows(trial, model)
        series, sampled = values.copy(), isinstance(model, Sampled)
        if not sampled:
            series[:-1, ramps] = 0.5 * (values[:-1, ramps] + values[1:, ramps])
        return _Acting(values, series, ramps, sampled)

    def rows(self, some: slice) -> _Acting:
        """The same of some rows."""
        return replace(self, values=self.values[some], series=self.series[some])

    def steps(self, t: Array, starts: Sequence[int], dt: float, count: int) -> Array:
        """What acts in each of `count` steps of `dt` [s] from each start on, shape (starts, count, controls + 8).

        Args:
            t: times of the rows [s].
            starts: rows.
        """
        at = t[list(starts)][:, None] + dt * np.arange(count + 1)
        row = np.clip(np.searchsorted(t, at + 1e-6 * dt, "right") - 1, 0, t.size - 1)
        out = self.series[row[:, :-1]]
        if (np.abs(np.diff(t) - dt) <= 1e-6 * dt).all():
            return out
        span, line, none = np.diff(t)[:, None], self.values[:, self.ramps], np.zeros((1, self.ramps.size))
        since, slope = (at - t[row])[:, :, None], np.vstack([np.diff(line, axis=0) / span, none])
        if self.sampled:
            out[:, :, self.ramps] = (line[row] + since * slope[row])[:, :-1]
            return out
        # The mean of a line over a step is the difference of its integral, a parabola between two rows.
        area = np.vstack([none, np.cumsum(0.5 * span * (line[1:] + line[:-1]), axis=0)])
        out[:, :, self.ramps] = np.diff(area[row] + since * (line[row] + 0.5 * since * slope[row]), axis=1) / dt
        return out


def _at_rows(trial: Trial, model: Model) -> tuple[Array, NDArray[np.intp]]:
    """`values` and `ramps` of `_Acting`."""
    n = len(model.controls)
    wind = wind_of(trial)
    lacking = [name for name in model.needed if not logged(trial, name)] if wind is None else []
    if lacking and trial.meta.get("source") != SIMULATED:  # a simulated trial has the channels of any wind
        wanted = "the network takes the wind; log it, or take a network without (wind = false)"
        raise DataError(f"{trial.name}: no values of {', '.join(lacking)}; {wanted}")
    series = np.zeros((len(trial), n + len(CHANNELS)))
    moving: list[int] = []
    for k, (source, factor) in enumerate(sources(trial, model)):
        if not logged(trial, source):
            raise DataError(f"{trial.name}: {source} has no value in any row; the model is steered by it")
        stays = is_held(trial, source)
        series[:, k] = factor * between_readings(source, trial.t, trial[source], trial.t, held=stays)
        moving += [] if stays else [k]
    around = {name: n + k for k, name in enumerate(CHANNELS)}
    for of, size, direction in VECTORS[1:]:  # the wind follows
        if logged(trial, size) and logged(trial, direction):
            at = around[f"{of}_x"]
            series[:, at] = trial[size] * np.cos(trial[direction])
            series[:, at + 1] = trial[size] * np.sin(trial[direction])
    if wind is not None:
        series[:, n], series[:, n + 1] = wind
    if logged(trial, "T_W"):
        series[:, around["wave_T"]] = trial["T_W"]
    if logged(trial, "depth"):
        series[:, around["per_depth"]] = 1.0 / trial["depth"]
    series[:, n:] = held(series[:, n:])
    return series, np.array(moving, dtype=np.intp)


def own_states(trial: Trial, model: Model, series: Array, dt: float) -> Array:
    """The model's states beyond the six at each row, shape (rows, states - 6): as it recalls them, heel as measured.

    Gaps of the heel are bridged by straight lines.  A roll rate that was not logged is the slope of the heel.

    Args:
        series: inputs per row, see `inputs`.
        dt: time between the rows [s].
    """
    out = unseen(model, series, dt)
    if model.motion == STATES or not logged(trial, "phi"):
        return out
    rows = np.arange(len(trial), dtype=np.float64)
    for k, name in enumerate(ROLL):
        if logged(trial, name):
            good = np.isfinite(trial[name])
            out[:, k] = np.interp(rows, rows[good], trial[name][good])
        elif len(trial) > 1:
            out[:, k] = np.gradient(out[:, 0], dt)
    return out


def held(series: Array) -> Array:
    """Each gap filled with the last value before it (the first after it, at the start)."""
    out = series.copy()
    for column in out.T:
        good = np.flatnonzero(np.isfinite(column))
        if good.size and good.size < column.size:
            before = np.searchsorted(good, np.arange(column.size), "right") - 1
            column[:] = column[good[np.clip(before, 0, None)]]
    return out


# Fewest rows before a start that are sailed to tell what a compass is off by.
_SAILED = 3


def replay(
    ship: Ship, trial: Trial, *, restart: float | None = None, method: str = "rk4",
    smooth_start: float | None = None, begin: tuple[float, Array | None] | None = None, threads: int | None = None,
) -> Trial:  # fmt: skip
    """Free-running prediction of `trial` from its own controls and wind, on its own rows.

    The integrator is the Runge-Kutta method or Euler's, in as many steps from row to row as the ship needs
    (`approach.substeps`).  Every `restart` seconds the state is reset to the measured one (at the first complete sample
    from there on).  Rows range from the first complete sample to the last.  Inputs are constant between rows; uneven
    time is predicted on an even grid of the median step and interpolated at the rows.  The memory of a network starts
    from the measured rows before; without any, as if the first had lasted.  With `smooth_start` each initial state is
    estimated from the last `smooth_start` seconds (`smoothed_starts`).  With `begin`, a time [s] and the state there,
    shape (6,), the rows before that time are left out and the first prediction starts in that state, or as any other
    where it is None.  What the compass of a trial that a fit found to err is off by at a start is read off the seconds
    before (`starts.swung`), and the prediction is as that compass reads.

    Raises:
        DataError: a channel is missing, no row is complete, or there are fewer rows than a network looks back on.
        SimulationError: the prediction blows up; names time and state.
    """
    ready = prepared(ship, trial, restart=restart, method=method, smooth_start=smooth_start, begin=begin)
    lanes = given(ship, ready.begun, ready.series, ready.memory)
    return ready.sailed(ship, lanes, ship.model.motion, method, threads)


@dataclass(frozen=True)
class Prepared:
    """A trial as its free runs take it: a lane for each of them.

    Attributes:
        trial, restart: what was prepared, and the seconds between starts.
        t: times of the rows [s].
        state: x, y, psi (unwrapped), u, v_m, r as measured, shape (rows, 6); NaN is a gap.
        starts: first row of each run.
        begun: initial states, shape (lanes, states).
        lanes: controls and environment per row, shape (lanes, steps, controls + 8).
        memory: of the model at each start.
        off: what the heading reads too little from each start on [rad], shape (lanes,).
        dt, each, steps: time from row to row [s], steps of the integrator between them, rows of the longest run.
    """

    trial: Trial
    restart: float | None
    t: Array
    state: Array
    starts: Sequence[int]
    begun: Array
    lanes: Array
    memory: Array | None
    off: Array
    dt: float
    each: int
    steps: int

    @property
    def series(self) -> Array:
        """Controls and environment per step of the integrator, shape (lanes, steps, controls + 8)."""
        return np.repeat(self.lanes, self.each, axis=1)

    def grid(self, method: str = "rk4") -> Steps:
        """Steps of the longest run, a row of the trial each time."""
        return Steps.between(self.dt, self.steps, self.each, method)

    def sailed(
        self, ship: Ship, lanes: Lanes, names: Sequence[str], method: str = "rk4", threads: int | None = None
    ) -> Trial:
        """The runs one after the other, at the rows of the trial.

        Args:
            lanes: one a start.
            names: of the first states, which are kept.

        Raises:
            SimulationError: a lane blows up; names time and state.
        """
        done, t = run(lanes, self.grid(method), threads=threads), self.t
        out = np.empty((t.size, self.begun.shape[1]))
        for lane, (a, b) in enumerate(pairwise((*self.starts, t.size))):
            for k in range(out.shape[1]):
                out[a:b, k] = np.interp(t[a:b] - t[a], done.t, done.values[lane, :, k])
            if not np.isfinite(out[a:b]).all():
                failed = next(f for f in done.failures if f.lane == lane)
                where = f"{failed.state} = {failed.value:g} at t = {t[a] + failed.time:g} s"
                raise SimulationError(f"{self.trial.name}: {where}; the model blows up")
            if off := float(self.off[lane]):  # as the compass reads, and speeds that were made by it
                ground = (out[a:b, 3] + 1j * out[a:b, 4]) * np.exp(1j * off)
                out[a:b, 2], out[a:b, 3], out[a:b, 4] = out[a:b, 2] - off, ground.real, ground.imag
        meta = {**wrong_compass(self.trial, False).meta, "source": f"predicted by {ship.name}", "restart": self.restart}
        return Trial(self.trial.name, t, {name: out[:, k] for k, name in enumerate(names)}, meta=meta)


def prepared(
    ship: Ship, trial: Trial, *, restart: float | None, method: str = "rk4", smooth_start: float | None = None,
    begin: tuple[float, Array | None] | None = None,
) -> Prepared:  # fmt: skip
    """The runs of a trial before they are sailed; arguments and errors as of `replay`."""
    measured, good = started(trial)
    if good.sum() < 2:
        found = f"{int(good.sum())} complete rows of {', '.join(STATES)}"
        raise DataError(f"{trial.name}: {found}; two are needed")
    rows = slice(int(np.argmax(good)), int(len(good) - np.argmax(good[::-1])))
    t, state, good, acting = trial.t[rows], measured[rows], good[rows], _Acting.of(trial, ship.model).rows(rows)
    dt = _step(ship, t, trial)
    hidden = own_states(trial.rows(rows), ship.model, acting.series, dt)
    if begin is not None:
        late = slice(int(np.searchsorted(t, begin[0] - 1e-6 * dt)), None)
        t, state, good, acting, hidden = t[late], state[late], good[late], acting.rows(late), hidden[late]
        if t.size < 2:
            raise DataError(f"{trial.name}: no two rows from t = {begin[0]:g} s on; there is nothing to predict")
    starts = _starts(t, good, restart, dt)
    remembered = _recalled(ship, trial, t, dt, np.column_stack([state, acting.series]), good, starts)
    spans = [t[min(b, t.size - 1)] - t[a] for a, b in pairwise((*starts, t.size))]
    steps = round(max(spans) / dt) + 1
    lanes = acting.steps(t, starts, dt, steps)
    first = state[starts] if smooth_start is None else smoothed_starts(t, state, starts, smooth_start)
    own = None if begin is None else begin[1]
    if own is not None:
        first[0] = own
    off = np.zeros(len(starts))
    if of_a_wrong_compass(trial) and not isinstance(ship.model, Stepped):
        _swing(ship, trial, t[list(starts)], first, off, range(0 if own is None else 1, len(starts)))
    begun = np.hstack([first, hidden[starts]])
    if remembered is None:
        remembered = open_loop_memory(ship, begun, lanes[:, 0, : len(ship.model.controls)])
    each = substeps(ship, dt, method)
    return Prepared(trial, restart, t, state, starts, begun, lanes, remembered, off, dt, each, steps)


def _swing(ship: Ship, trial: Trial, at: Array, first: Array, off: Array, lanes: range) -> None:
    """Set the states of some starts, and what their headings read too little, by the seconds before them.

    Args:
        at: time of each start [s].
        first, off: of each start; changed.
    """
    right = wrong_compass(trial, False)
    for k in lanes:
        past = before(ship, right, float(at[k]))
        if len(past) >= _SAILED and not too_little(past) and started(past)[1].sum() >= _SAILED:
            first[k], off[k] = swung(ship, first[k], float(replay(ship, past)["v_m"][-1]))


def _step(ship: Ship, t: Array, trial: Trial) -> float:
    """Time step of the prediction [s]: the trial's median one, which a sampled model must share."""
    dt = float(np.median(np.diff(t)))
    if isinstance(ship.model, Sampled) and abs(dt / ship.model.dt - 1) > 0.01:
        raise DataError(
            f"{trial.name}: sampled every {dt:g} s; {ship.name} runs at {ship.model.dt:g} s only; "
            f"fit the model at that step, or {resampling(float(ship.model.dt), trial)}"
        )
    return ship.model.dt if isinstance(ship.model, Sampled) else dt


def _recalled(
    ship: Ship, trial: Trial, t: Array, dt: float, rows: Array, good: NDArray[np.bool_], starts: list[int]
) -> Array | None:
    """Memory of a stepped model at each start, from the complete rows just before it; None for other models.

    Args:
        rows: states, controls and environment per row.
    """
    model = ship.model
    if not isinstance(model, Stepped):
        return None
    if len(t) < model.look_back + 2:
        needs = f"{ship.name} looks {model.look_back * dt:g} s back and needs {model.look_back + 2}"
        raise DataError(f"{trial.name}: {len(t)} rows are too short a record; {needs}")
    found: list[tuple[float, ...]] = []
    for a in starts:
        before = t[a] - dt * np.arange(model.look_back, 0, -1) + 1e-6 * dt
        at = np.searchsorted(t, before, "right") - 1
        broken = np.flatnonzero((at < 0) | ~good[at])
        at = at[broken[-1] + 1 :] if broken.size else at
        past = rows[at]
        found.append(model.recall_memory(past[:, :6], past[:, 6:]) if at.size else model.begin((), ()))
    return np.array(found)


def _starts(t: Array, good: NDArray[np.bool_], restart: float | None, dt: float) -> list[int]:
    """Rows of the restarts: the first, then the first complete one of each interval."""
    if restart is None:
        return [0]
    if not restart > 0.0:
        raise DataError(f"restart is {restart:g} s; it must be above zero")
    number = np.floor((t - t[0] + 1e-6 * dt) / restart)
    edges = [0, *(np.flatnonzero(np.diff(number)) + 1).tolist()]
    found: list[int] = []
    for a in edges:
        later = np.flatnonzero(good[a:])
        row = a + int(later[0]) if later.size else a
        if row not in found and row < t.size - 1:
            found.append(row)
    return found


_TRUE, _APPARENT = ("U_T", "gamma_T"), ("U_A", "gamma_A")


def from_apparent(trial: Trial) -> bool:
    """Whether the true wind follows only from the apparent one (U_A, gamma_A) and the measured motion."""
    measured = all(logged(trial, name) for name in _TRUE)
    return not measured and all(logged(trial, name) for name in (*_APPARENT, "psi", "u", "v_m"))


def wind_of(trial: Trial) -> tuple[Array, Array] | None:
    """North and east components of where the true wind comes from [m/s], shape (samples,); None without a wind.

    An apparent wind is converted to the true one by heading and velocity over ground at midship; the lever arm of the
    mast, which is unknown, is left out.
    """
    if not from_apparent(trial):
        if not all(logged(trial, name) for name in _TRUE):
            return None
        return trial["U_T"] * np.cos(trial["gamma_T"]), trial["U_T"] * np.sin(trial["gamma_T"])
    return true_wind(*(trial[name] for name in (*_APPARENT, "psi", "u", "v_m")))


def wind_words(trial: Trial, felt: bool) -> str:
    """Use of an apparent wind, in one line; empty without one, or with a true wind.

    Args:
        felt: whether the model has a force of the wind.
    """
    blows = logged(trial, "U_A") and float(np.nanmax(np.abs(trial["U_A"]))) > 0.0
    if not blows or all(logged(trial, name) for name in _TRUE):
        return ""
    if not felt:
        return "its apparent wind (U_A) is left out: the model has no force of wind"
    if from_apparent(trial):
        return "its true wind is computed from U_A, gamma_A and the measured motion"
    return ""


def gaps(trial: Trial, model: Model) -> dict[str, NDArray[np.bool_]]:
    """Rows that `inputs` fills in, shape (samples,), by channel."""
    steering = (name if name in trial else order for name, (order, _) in zip(
        model.controls, model.stands_for, strict=True))  # fmt: skip
    pairs = (*(pair for _, *pair in VECTORS), *((_APPARENT,) if from_apparent(trial) else ()))
    around = (name for pair in pairs if all(logged(trial, one) for one in pair) for name in pair)
    acting = [name for name in (*steering, *around, "T_W", "depth") if logged(trial, name)]
    missing = {name: np.asarray(~np.isfinite(trial[name])) for name in acting}
    return {name: rows for name, rows in missing.items() if rows.any()}


def no_wind(trial: Trial, model: Model) -> bool:
    """Whether a trial without wind is taken as in still air; a model that needs the wind refuses it (`inputs`)."""
    refused = bool(model.needed) and trial.meta.get("source") != SIMULATED
    return not refused and wind_of(trial) is None


def unread(trial: Trial, model: Model) -> dict[str, NDArray[np.bool_]]:
    """Those of the `gaps` that are longer than the step from reading to reading of their channel.

    A rudder that is read once a second has none between its readings, although the rows are a tenth apart.
    """
    missing = {name: rows & ~_regular(rows) for name, rows in gaps(trial, model).items()}
    return {name: rows for name, rows in missing.items() if rows.any()}


def _regular(rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Missing rows between two readings, or a reading and an end, that are not much farther apart than most."""
    good = np.flatnonzero(~rows)
    usual = 1.5 * float(np.median(np.diff(good))) if good.size > 1 else 0.0
    out = np.zeros_like(rows)
    for a, b in pairwise((-1, *good.tolist(), rows.size)):
        out[a + 1 : b] = b - a <= usual
    return out


def gap_words(trial: Trial, missing: Mapping[str, NDArray[np.bool_]]) -> str:
    """Channels with gaps, the number of rows, and the longest gap [s] of each."""
    return ", ".join(
        f"{name} has no value in {int(rows.sum())} of {rows.size} rows (up to {_longest(rows) * trial.dt:.3g} s on end)"
        for name, rows in missing.items()
    )


def predicted(trial: Trial) -> slice:
    """Rows of the prediction: from the first complete state to the last; all rows without one."""
    try:
        good = np.flatnonzero(started(trial)[1])
    except DataError:
        return slice(None)
    return slice(int(good[0]), int(good[-1]) + 1) if good.size else slice(None)


def _longest(rows: NDArray[np.bool_]) -> int:
    return max((sum(1 for _ in run) for missing, run in groupby(rows.tolist()) if missing), default=0)
