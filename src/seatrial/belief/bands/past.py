"""What the seconds before a start tell of the disturbances there: a Kalman filter on the measured velocities.

The calibration knows which accelerations and which current a model lacks, as random processes.  Before a start the
velocities have been measured, and what they did beyond the model is a reading of these processes.  The filter's mean
acts on in a prediction, each process fading in its own time; its covariance is where the draws of a band begin, from
which they grow to those of a start without a past.  The size of the innovations tells whether the past is that of this
ship.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.errors import RequestError
from ...core.values import dataclass, fields, replace
from ...data import Array, Trial
from ...identify.record import Record
from ...models import STATES
from ...ships import Ship
from ...simulate.carried import DISTURBED, Carrier, Slow
from ...simulate.carried import disturbed as driven
from ...simulate.lanes import Kernel, Lanes, Steps, run
from ...simulate.loop import open_loop_parameters
from ...simulate.replay import Prepared, prepared
from .disturbance import ACTS, CURRENT, WIND, Disturbance
from .sailing import FreeRuns

LAWS = ("usual", "filtered")
"""What acts on after a start; the calibration says which of them errs less on left-out trials."""

ENOUGH = 0.5
"""Share of the seconds that must lie before a start; with fewer it counts as one without a past."""

_VELOCITIES = slice(3, 6)
# The filter steps by this share of the shortest correlation time, or from row to row where that is longer.
_STEP = 0.1
# Small steps for derivatives of the rates, over the ship's speed and over U / L.
_SMALL = 1e-4


@dataclass(frozen=True)
class Past:
    """The disturbances at some starts, as the seconds before tell; n processes, then the current north and east.

    Attributes:
        mean: over the standard deviation that each has without a past, shape (starts, n + 2).
        root: of the covariance, in the same unit, shape (starts, n + 2, n + 2).
        surprise: root mean square of the innovations over what the filter expects, shape (starts,); 0 without a past.
        seconds: that were read, shape (starts,).
        acted: what `carried.Carrier` carries on, shape (starts, 3).
        unlikely: mean negative log-likelihood of an innovation, but for a constant, shape (starts,).
    """

    mean: Array
    root: Array
    surprise: Array
    seconds: Array
    acted: Array
    unlikely: Array

    def drawn(self, copies: int, rng: np.random.Generator) -> tuple[Array, Array]:
        """Values and currents for so many draws of all starts, shapes (copies starts, n), (copies starts, 2)."""
        starts, n = self.mean.shape
        found = self.mean + np.einsum("sij,csj->csi", self.root, rng.standard_normal((copies, starts, n)))
        flat = found.reshape(copies * starts, n)
        return flat[:, :-2], flat[:, -2:]

    def rows(self, which: NDArray[np.bool_]) -> Past:
        """Of some of the starts."""
        return Past(*(getattr(self, one.name)[which] for one in fields(self)))


def together(parts: Sequence[Past]) -> Past:
    """Starts of several trials as one."""
    return Past(*(np.concatenate([getattr(one, name) for one in parts])
                  for name in (one.name for one in fields(Past))))  # fmt: skip


@dataclass(frozen=True)
class Filter:
    """A ship whose disturbances are read off the past, traced once.

    Attributes:
        disturbance: what the model lacks.
        noise: standard deviation of the readings of each state, shape (6,).
        span: seconds before a start that are read.
        doubt: factor of the noise, for what moves a reading and is no disturbance that lasts.
    """

    ship: Ship
    disturbance: Disturbance
    noise: Array
    span: float
    doubt: float
    kernel: Kernel
    parameters: Array

    @staticmethod
    def of(ship: Ship, disturbance: Disturbance, noise: Array, span: float, doubt: float = 1.0) -> Filter:
        """The ship made ready.

        Raises:
            DataError: a model in discrete time.
            RequestError: `span` is not above zero.
        """
        if not span > 0.0:
            raise RequestError(f"--history is {span:g} s; it must be above zero")
        return Filter(ship, disturbance, noise, span, doubt, Kernel(driven(ship)), open_loop_parameters(ship))

    def lanes(self, state: Array, series: Array) -> Lanes:
        """Runs of the ship from these states under the inputs of `ahead`."""
        return Lanes(self.kernel, self.parameters, state, series)

    def before(self, record: Record, dt: float, starts: Sequence[int]) -> Past:
        """The disturbances at some rows of a trial.

        Args:
            record: on even steps of dt [s].
            starts: rows, each of which is the last that is known.
        """
        who, at = self.disturbance.processes, np.asarray(starts, dtype=np.intp)
        shortest = min((one.tau for one in who if one.sigma > 0), default=np.inf)
        each = max(int(min(_STEP * shortest, 0.1 * self.span) / dt), 1)
        moved, towards, drives = self._linear(record, dt, each)
        read, speeds = record.state[:, _VELOCITIES], record.bridged[:, _VELOCITIES]
        good = np.asarray(np.isfinite(read).all(axis=1))
        now = _Belief.of(len(starts), len(who), (self.doubt * np.maximum(self.noise[_VELOCITIES], 1e-9)) ** 2)
        kept = np.exp(-each * dt / np.array([one.tau for one in who]))
        for k in range(round(self.span / dt) // each, -1, -1):
            known = at >= k * each
            row = np.maximum(at - k * each, 0)
            known &= good[row]
            now.read(known, read[row])
            on = np.flatnonzero(now.begun)
            if k and on.size:
                here = row[on]
                now.mean[on], now.cov[on] = _onwards(now.mean[on], now.cov[on], moved[here], towards[here],
                                                     drives[here], speeds[here], kept)  # fmt: skip
        slow = Carrier(self.ship, Slow.of(self.ship), self.span, self.kernel, self.parameters)
        t = dt * np.arange(len(read), dtype=np.float64)
        acted = slow.means(t, record.state[:, : len(STATES)], record.hidden, record.series, at.tolist())
        return now.told(each * dt, np.array(slow.slow.share) * acted)

    def ahead(self, lanes: FreeRuns, past: Past, law: str) -> Array:
        """Inputs of the ship with what has acted before acting on.

        Args:
            law: of `LAWS`.  "filtered": each disturbance fades in its own time; where it grows with the speed through
                water or air, that of the prediction without it counts.  "usual": as `carried.Slow` has it.

        Returns:
            Controls, environment and the accelerations of `carried.DISTURBED`, shape (lanes, steps, series + 3).
        """
        count, steps, _ = lanes.series.shape
        still = np.concatenate([lanes.series, np.zeros((count, steps, len(DISTURBED)))], axis=2)
        t = lanes.dt * np.arange(steps)
        if law == "usual":
            fade = np.exp(-t / Slow.of(self.ship).fade)
            still[:, :, -len(DISTURBED) :] += past.acted[:, None, :] * fade[:, None]
            return still
        calm = run(self.lanes(lanes.state0, still), Steps(lanes.dt, steps), None).values
        for k, one in enumerate(self.disturbance.processes):
            acting = one.sigma * past.mean[:, k, None] * np.exp(-t / one.tau)
            grows = self._grows(one.by, calm, lanes.series)
            still[:, :, -len(DISTURBED) + ACTS.index(one.on)] += np.nan_to_num(acting * grows)
        flow = [self.kernel.system.series.index(name) for name in CURRENT]
        still[:, :, flow] += self.disturbance.current * past.mean[:, None, -2:]
        return still

    def _linear(self, record: Record, dt: float, each: int) -> tuple[Array, Array, Array]:
        """Change of the velocities by the model from each row so many rows onwards, shape (rows, 3).

        And its derivatives with respect to the velocities, (rows, 3, 3), and the disturbances, (rows, 3, n + 2).
        """
        state = np.hstack([record.bridged, record.hidden])
        acting = np.hstack([record.series, np.zeros((len(state), len(DISTURBED)))])
        U, L = max(self.ship.speed, 1e-3), self.ship.L_pp

        def rates(more: Array, column: int, by: float) -> Array:
            moved = more.copy()
            moved[:, column] += by
            pair = (moved, acting) if more is state else (state, moved)
            return self.kernel.rates(*pair, self.parameters)[:, _VELOCITIES]

        plain = rates(state, 0, 0.0)
        slope = np.stack([(rates(state, 3 + k, h) - plain) / h for k, h in enumerate(_SMALL * np.array([U, U, U / L]))],
                         axis=2)  # fmt: skip
        flow = [self.kernel.system.series.index(name) for name in CURRENT]
        current = [(rates(acting, column, _SMALL * U) - plain) / (_SMALL * U) for column in flow]
        drives = np.zeros((len(state), 3, len(self.disturbance.processes) + 2))
        for k, one in enumerate(self.disturbance.processes):
            drives[:, ACTS.index(one.on), k] = one.sigma * self._grows(one.by, state, record.series)
        drives[:, :, -2:] = self.disturbance.current * np.stack(current, axis=2)
        total = np.vstack([np.zeros(3), np.cumsum(0.5 * dt * (plain[1:] + plain[:-1]), axis=0)])
        later = np.minimum(np.arange(len(state)) + each, len(state) - 1)
        return total[later] - total, each * dt * slope, each * dt * drives

    def _grows(self, by: str, state: Array, series: Array) -> Array:
        """Square of the speed through water or air [m^2/s^2], shape of the rows; 1 where nothing grows."""
        if not by:
            return np.ones(state.shape[:-1])
        north, east = (series[..., self.kernel.system.series.index(name)] for name in
                       (CURRENT if by == "water" else WIND))  # fmt: skip
        sense, cos, sin = (1.0 if by == "water" else -1.0), np.cos(state[..., 2]), np.sin(state[..., 2])
        u = state[..., 3] - sense * (north * cos + east * sin)
        v = state[..., 4] - sense * (east * cos - north * sin)
        return u * u + v * v


@dataclass
class _Belief:
    """Velocities and disturbances at a time before each start.

    Attributes:
        mean, cov: of three velocities, the processes and the current, shapes (starts, n + 5), (starts, n + 5, n + 5).
        noise: variance of a reading of the velocities, shape (3,).
        begun: whether anything was read.
        surprise, unlikely, count: sums of squared innovations and of their negative log-likelihoods, and how many.
    """

    mean: Array
    cov: Array
    noise: Array
    begun: NDArray[np.bool_]
    surprise: Array
    unlikely: Array
    count: Array

    @staticmethod
    def of(starts: int, processes: int, noise: Array) -> _Belief:
        """Nothing read yet."""
        n, none = processes + 5, np.zeros(starts)
        return _Belief(np.zeros((starts, n)), np.tile(np.eye(n), (starts, 1, 1)), noise,
                       np.zeros(starts, dtype=np.bool_), none, none.copy(), none.copy())  # fmt: skip

    def read(self, known: NDArray[np.bool_], velocities: Array) -> None:
        """Take in the velocities where they are known; the first ones are where the filter begins."""
        fresh, old = known & ~self.begun, np.flatnonzero(known & self.begun)
        self.mean[fresh, :3] = velocities[fresh]
        self.cov[fresh, :3, :3] = np.diag(self.noise)
        wide = np.linalg.slogdet(self.cov[old, :3, :3] + np.diag(self.noise))[1]
        self.mean[old], self.cov[old], size = _corrected(self.mean[old], self.cov[old], velocities[old], self.noise)
        self.surprise[old] += size
        self.unlikely[old] += 0.5 * (wide + 3.0 * size)
        self.count[old] += 1.0
        self.begun |= known

    def told(self, step: float, acted: Array) -> Past:
        """What is known now, after steps of so many seconds."""
        own = self.cov[:, 3:, 3:]
        even = 0.5 * (own + own.transpose(0, 2, 1)) + 1e-10 * np.eye(own.shape[1])
        root = np.asarray(np.linalg.cholesky(even), dtype=np.float64)
        surprise = np.sqrt(self.surprise / np.maximum(self.count, 1.0))
        return Past(self.mean[:, 3:], root, surprise, self.count * step, acted,
                    self.unlikely / np.maximum(self.count, 1.0))  # fmt: skip


def _corrected(mean: Array, cov: Array, read: Array, noise: Array) -> tuple[Array, Array, Array]:
    """Mean and covariance after a reading of the velocities, and the mean square of its innovation."""
    inverse = np.linalg.inv(cov[:, :3, :3] + np.diag(noise))
    off = read - mean[:, :3]
    gain = cov[:, :, :3] @ inverse
    size = np.einsum("si,sij,sj->s", off, inverse, off) / 3.0
    return mean + np.einsum("sij,sj->si", gain, off), cov - gain @ cov[:, :3, :], size


def _onwards(
    mean: Array, cov: Array, moved: Array, towards: Array, drives: Array, speeds: Array, kept: Array
) -> tuple[Array, Array]:  # fmt: skip
    """Mean and covariance a step later; arguments by start, `speeds` those at which `moved` was taken."""
    size = mean.shape[1]
    A = np.tile(np.eye(size), (len(mean), 1, 1))
    A[:, :3, :3] += towards
    A[:, :3, 3:] = drives
    here = np.arange(3, 3 + len(kept))
    A[:, here, here] = kept
    after = np.einsum("sij,sj->si", A, mean)
    after[:, :3] += moved - np.einsum("sij,sj->si", towards, speeds)
    cov = A @ cov @ A.transpose(0, 2, 1)
    cov[:, here, here] += 1.0 - kept**2
    return after, 0.5 * (cov + cov.transpose(0, 2, 1))


def carried(filters: Filter, law: str, trial: Trial, *, restart: float | None) -> tuple[Trial, Past]:
    """Prediction as of `replay.replay` with what the past tells acting on, and that past, one row a start.

    Starts with fewer than `ENOUGH` of the seconds before them are predicted as without a past.

    Raises:
        DataError, SimulationError: as `replay`.
    """
    ship, ready = filters.ship, prepared(filters.ship, trial, restart=restart)
    first = int(np.searchsorted(trial.t, ready.t[0]))
    record = Record.of(trial.rows(slice(first, first + len(ready.t))), ship.model)
    past = enough(filters, filters.before(record, ready.dt, ready.starts))
    series = filters.ahead(runs_of(ready), past, law)
    made = ready.sailed(ship, filters.lanes(ready.begun, series), STATES)
    return made.noting(f"what acted in {filters.span:g} s before each start carried on"), past


def enough(filters: Filter, past: Past) -> Past:
    """The same, with starts of too short a past as without one."""
    short = past.seconds < ENOUGH * filters.span * (1.0 - 1e-6)
    n = past.mean.shape[1]
    return Past(np.where(short[:, None], 0.0, past.mean), np.where(short[:, None, None], np.eye(n), past.root),
                np.where(short, 0.0, past.surprise), np.where(short, 0.0, past.seconds),
                np.where(short[:, None], 0.0, past.acted), past.unlikely)  # fmt: skip


def runs_of(ready: Prepared) -> FreeRuns:
    """The runs of a trial, a row of the result for each row of the log."""
    return FreeRuns(ready.begun, ready.series[:, : ready.grid().count], ready.dt / ready.each, ready.each)


def disturbing(disturbance: Disturbance, current: float) -> Disturbance:
    """The same with a current that is known to this standard deviation [m/s], where that is the smaller one."""
    return replace(disturbance, current=min(disturbance.current, current))
