"""Many bounded least-squares problems at once: starts, held parameters or resampled data as lanes.

Each problem has its own parameter values, and may have its own held parameters and its own data; all share
ship, controls and loss.  One kernel call integrates the trajectories of all of them with their exact
derivatives; only the assignment of lanes to problems differs.  The normal equations of the initial states are kept
apart until they are eliminated.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...data import Array, Trial
from ...engine.rollout import default_threads
from ...engine.simd import LANES
from ...simulate.approach import substeps
from ...simulate.lanes import Kernel, Lanes, Steps, run, slopes
from ...simulate.loop import open_loop, open_loop_parameters
from .. import Problem, StudyError
from ..nuisance import Nuisances, begun_as, held
from ..record import Settings, Windows, cut_as, windows
from .gauss_newton import CONVERGED, STILL, Block, Mask, Normal, State, descend

# Most steps to the best initial states for given parameters.
_SETTLING = 8


@dataclass(frozen=True)
class Data:
    """Data that each problem is fitted to, in place of the trials.

    Attributes:
        state0: state at the start of each window, shape (problems, windows, states).
        measured: shape (problems, windows, rows, 6).
        mean: replaces the prior means, shape (problems, free).
    """

    state0: Array
    measured: Array
    mean: Array

    def of(self, index: Any) -> Data:
        """Some of the problems."""
        return Data(self.state0[index], self.measured[index], self.mean[index])


@dataclass(frozen=True)
class Ends:
    """Where each problem ended.

    Attributes:
        values: shape (problems, free).
        costs, data: objectives there, and their data's part, shape (problems,); inf where the model blows up.
        evaluations: of the objective, shape (problems,).
        converged: whether the last steps no longer mattered, shape (problems,).
    """

    values: Array
    costs: Array
    data: Array
    evaluations: NDArray[np.intp]
    converged: Mask

    @staticmethod
    def joined(parts: Sequence[Ends]) -> Ends:
        """Those of several calls as of one."""
        return Ends(*(np.concatenate([getattr(one, f.name) for one in parts]) for f in fields(Ends)))


@dataclass(frozen=True)
class Many:
    """The objective of a problem for many values, and data, at once.

    Attributes:
        windows: of all trials, cut as `Trajectory` cuts them.
        compared: positions among the measured states that the loss compares.
        chunk: problems that are integrated together.
        packed: series of the windows, repeated for a chunk.
        low, high: bounds, shape (free,).
        begun: entries of the initial state of each window that are estimated; the others are as recorded.
        near: inverse variances of the priors of these, zero without one, shape (begun,).
    """

    problem: Problem
    windows: Windows
    compared: tuple[int, ...]
    begun: tuple[int, ...]
    near: Array
    kernel: Kernel
    chunk: int
    packed: Any
    shared: Array
    low: Array
    high: Array
    method: str
    threads: int

    @staticmethod
    def build(
        problem: Problem, trials: Sequence[Trial], sigma: Mapping[str, float], *,
        window: float, dt: float, every: int, method: str, threads: int | None,
    ) -> Many:  # fmt: skip
        """Cut the windows and compile.

        Raises:
            StudyError: the problem has nuisances, which `Trajectory` eliminates.
        """
        if held(problem):
            raise StudyError("many problems at once take no [nuisance]; leave it out, or use shooting:Trajectory")
        cut = windows(
            trials, problem.ship.model, problem.loss, sigma, window=window, dt=dt, every=every,
            substeps=substeps(problem.ship, dt, method),
        )  # fmt: skip
        vector, own = problem.vector, Nuisances.of(problem.nuisance, problem.ship.model.motion)
        near = np.array(list(problem.nuisance.initial.values())) ** -2.0
        cut.scale[:, 0, own.initial[near > 0]] = 0.0  # the prior of an initial state represents its measurement
        kernel, chunk = Kernel(open_loop(problem.ship), vector.paths, vector.paths), _chunk(cut.state0.shape[0])
        return Many(
            problem, cut, tuple(np.flatnonzero((cut.scale > 0).any(axis=(0, 1))).tolist()),
            tuple(own.initial.tolist()), near, kernel, chunk,
            kernel.pack(np.tile(cut.series, (chunk, 1, 1))), open_loop_parameters(problem.ship),
            vector.low, vector.high, method, threads or default_threads(),
        )  # fmt: skip

    @staticmethod
    def like(problem: Problem, settings: Settings) -> Many:
        """Cut and integrated as an estimator does it."""
        sigma, arguments = cut_as(problem, settings)
        own = begun_as(problem, getattr(settings, "initial", "measured"))
        return Many.build(own, problem.trials, sigma, **arguments)

    def predicted(self, values: Array) -> Array:
        """Predictions of all windows by one set of values, shape (windows, rows, motion)."""
        cut = self.windows
        state0 = cut.state0.copy()
        if self.begun:
            state0[:, list(self.begun)] += self.settled(values[None], None)[1].reshape(len(state0), -1)
        lanes = self.lanes(state0, cut.series, np.repeat(values[None], len(state0), axis=0))
        return run(lanes, self.grid, threads=self.threads).values[:, :, : cut.width]

    def lanes(self, state0: Array, series: Any, lanewise: Array) -> Lanes:
        """Runs of some windows, each with its own values of the free parameters."""
        return Lanes(self.kernel, self.shared, state0, series, lanewise=lanewise)

    @property
    def grid(self) -> Steps:
        """Steps of every window, a compared row each time."""
        return self.windows.grid(self.method)

    def normals(self, values: Array, data: Data | None = None) -> Normal:
        """Objective and normal equations at `values`, shape (problems, free); of the best starts, these eliminated."""
        found, _ = self.settled(values, data)
        H, g = found.reduced()
        return Normal(found.cost, H, g, data=found.data)

    def settled(self, values: Array, data: Data | None) -> tuple[Normal, Array]:
        """The same at the best initial states for `values`, not eliminated, and their offsets from the recorded ones.

        Returns:
            The normal equations, and offsets of shape (problems, windows * starts).
        """
        eta = np.zeros((len(values), self.windows.state0.shape[0] * len(self.begun)))
        now = self.at(values, eta, data)
        going = np.ones(len(values), dtype=np.bool_)
        for _ in range(_SETTLING if self.begun else 0):
            further = eta - now.blocks[0].back()[..., -1].reshape(eta.shape)
            then = self.at(values, further, data)
            # each problem ends by itself: its digits do not depend on its neighbours
            better, last = going & (then.cost < now.cost), now
            going &= then.cost < (1.0 - 1e-10) * now.cost
            now = Normal.stacked([(then if good else last).of(k) for k, good in enumerate(better)])
            eta[better] = further[better]
            if not going.any():
                break
        return now, eta

    def at(self, values: Array, eta: Array, data: Data | None) -> Normal:
        """Objective and normal equations at `values` and at these offsets of the initial states."""
        n, lanes = values.shape[1], self.windows.state0.shape[0]
        G = self._parted(values, eta, data, self._products)
        vector = self.problem.vector
        weight, away = vector.precision, values - (vector.mean if data is None else data.mean)
        whole = G.sum(axis=1)
        whole[:, range(n), range(n)] += weight
        good = np.isfinite(G).all(axis=(1, 2, 3))
        told = np.where(good, whole[:, -1, -1], np.inf)
        blocks: tuple[Block, ...] = ()
        if self.begun:
            G[~good] = np.eye(G.shape[-1])  # where the model blows up there is nothing to solve
            offset = eta.reshape(len(eta), lanes, -1)
            blocks = (Block(np.arange(eta.shape[1]).reshape(lanes, -1), G[:, :, n:-1, n:-1] + np.diag(self.near),
                            G[:, :, n:-1, :n], G[:, :, n:-1, -1] + self.near * offset),)  # fmt: skip
        return Normal(told + self.priors(values, eta, data), whole[:, :n, :n], whole[:, :n, -1] + weight * away, blocks,
                      told)  # fmt: skip

    def priors(self, values: Array, eta: Array, data: Data | None) -> Array:
        """Part of the objectives that the trials do not contribute, shape (problems,)."""
        vector = self.problem.vector
        away = values - (vector.mean if data is None else data.mean)
        offset = eta.reshape(len(eta), len(self.windows.state0), len(self.near))
        return (vector.precision * away**2).sum(axis=1) + (self.near * offset**2).sum(axis=(1, 2))

    def costs(self, values: Array, eta: Array, data: Data | None) -> Array:
        """Objectives alone, shape (problems,); inf where the model blows up."""
        told = self._parted(values, eta, data, self._squares) + self.priors(values, eta, data)
        return np.where(np.isfinite(told), told, np.inf)

    def _parted(self, values: Array, eta: Array, data: Data | None, work: Callable[..., Array]) -> Array:
        """What `work` says of each problem, some at a time, so that the memory does not grow with their number.

        It gets the problems, the data, and initial states and values of a whole chunk; the last problem fills it.
        """
        lanes = self.windows.state0.shape[0]

        def one(first: int) -> Array:
            index = np.arange(first, min(first + self.chunk, len(values)))
            filled = np.append(index, np.repeat(index[-1], self.chunk - index.size))
            state0 = np.tile(self.windows.state0, (self.chunk, 1)) if data is None else data.state0[filled].reshape(
                self.chunk * lanes, -1
            ).copy()
            state0[:, list(self.begun)] += eta[filled].reshape(self.chunk * lanes, -1)
            return work(index, data, state0, np.repeat(values[filled], lanes, axis=0))

        with ThreadPoolExecutor(self.threads) as pool:
            return np.concatenate(list(pool.map(one, range(0, len(values), self.chunk))))

    def _errors(self, index: NDArray[np.intp], data: Data | None, found: Array) -> Array:
        """Errors of the compared states, not weighted, shape (problems, windows, rows, compared)."""
        lanes, states = self.windows.state0.shape[0], list(self.compared)
        measured = self.windows.measured[None] if data is None else data.measured[index]
        predicted = found[: index.size * lanes].reshape(index.size, lanes, found.shape[1], -1)
        return np.subtract(predicted[..., states], measured[..., states])

    def _squares(self, index: NDArray[np.intp], data: Data | None, state0: Array, lanewise: Array) -> Array:
        """Sum of the squared weighted residuals of each problem."""
        states = run(self.lanes(state0, self.packed, lanewise), self.grid, threads=1).values
        scale = self.windows.scale[:, :, list(self.compared)]
        with np.errstate(all="ignore"):
            e = np.where(scale > 0, self._errors(index, data, states) * scale, 0.0)
            return (e * e).reshape(index.size, -1).sum(axis=1)

    def _products(self, index: NDArray[np.intp], data: Data | None, state0: Array, lanewise: Array) -> Array:
        """Products of the columns of (slopes, residuals), shape (problems, windows or 1, columns, columns).

        Columns are those of the parameters, then of the estimated starts, whose windows are kept apart, and the
        residuals.
        """
        lanes, n = self.windows.state0.shape[0], lanewise.shape[1]
        predicted, found = slopes(self.lanes(state0, self.packed, lanewise), self.grid, threads=1)
        used, states = index.size * lanes, list(self.compared)
        scale = self.windows.scale[:, :, states]
        columns = np.empty((index.size, *scale.shape, n + len(self.begun) + 1))
        with np.errstate(all="ignore"):
            columns[..., :n] = found[:used, :, states, :n].reshape(columns[..., :n].shape)
            columns[..., n:-1] = found[:used, :, states, n:][..., list(self.begun)].reshape(columns[..., n:-1].shape)
            columns[..., -1] = self._errors(index, data, predicted)
            np.multiply(columns, scale[..., None], out=columns)
            columns[:, scale == 0.0] = 0.0
            flat = columns.reshape(index.size, lanes if self.begun else 1, -1, columns.shape[-1])
            return np.matmul(flat.transpose(0, 1, 3, 2), flat)

    def descend(
        self, starts: Array, *, data: Data | None = None, held: Mask | None = None,
        iterations: int = 60, tolerance: float = 1e-10, each: Callable[[State, NDArray[np.intp]], None] | None = None,
    ) -> Ends:  # fmt: skip
        """Go down with every problem from its start; see `gauss_newton.descend`.

        Args:
            starts: shape (problems, free).
            data: what to fit to; None takes the trials.
        """
        values = np.clip(starts, self.low, self.high)
        now, eta = self.settled(values, data)
        begun = State.rows([State(*one).begun for one in zip(values, eta, now.cost, strict=True)])
        end = descend(_Fitted(self, data), begun, self.low, self.high, held=held, iterations=iterations,
                      tolerance=tolerance, still=STILL, each=each)  # fmt: skip
        return Ends(end.p, end.cost, end.cost - self.priors(end.p, end.eta, data), end.evaluations,
                    end.done == CONVERGED)  # fmt: skip


@dataclass(frozen=True)
class _Fitted:
    """The objectives of many values, or of one data set each."""

    many: Many
    data: Data | None

    def _of(self, which: NDArray[np.intp]) -> Data | None:
        return None if self.data is None else self.data.of(which)

    def costs(self, p: Array, eta: Array, which: NDArray[np.intp]) -> Array:
        """See `gauss_newton.Objectives`."""
        return self.many.costs(p, eta, self._of(which))

    def normals(self, p: Array, eta: Array, which: NDArray[np.intp]) -> Normal:
        """See `gauss_newton.Objectives`."""
        return self.many.at(p, eta, self._of(which))


def _chunk(lanes: int) -> int:
    """Number of problems of `lanes` windows that fills the kernel's blocks best, at most four blocks or one problem."""
    sizes = [k for k in range(1, LANES + 1) if k * lanes <= 4 * LANES] or [1]
    return min(sizes, key=lambda k: (-(-k * lanes // LANES) * LANES / (k * lanes), k))
