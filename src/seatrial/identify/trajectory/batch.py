"""Many bounded least-squares problems at once: starts, held parameters or resampled data as lanes.

Each problem has its own parameter values, and may have its own held parameters and its own data; all share
ship, controls and loss.  One kernel call integrates the trajectories of all of them with their exact
derivatives; only the assignment of lanes to problems differs.  The normal equations of the initial states are kept
apart until they are eliminated.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...data import Array, Trial
from ...engine.rollout import Sensitivity, default_threads, sensitivity, simulator
from ...engine.simd import LANES
from ...simulate.approach import substeps
from ...simulate.loop import open_loop, open_loop_parameters
from .. import Problem, StudyError
from ..nuisance import Nuisances, begun_as, held
from ..record import Settings, Windows, cut_as, windows
from .gauss_newton import Mask, steps

# Damping of Marquardt's diagonal: start, least, and ratio after a good step; after bad ones the ratio doubles.
_DAMPING, _LEAST, _DOWN, _UP = 1e-2, 1e-9, 0.2, 4.0
# Most steps to the best initial states for given parameters.
_SETTLING = 8
# A problem ends after this many successive steps that no longer matter, or that fail.
_STILL, _FAILED = 2, 7


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
class Normals:
    """Objectives (prior included), their data's part, and halved derivatives of each problem.

    Attributes:
        costs, data: shape (problems,); inf where the model blows up.
        H: shape (problems, free, free).
        g: shape (problems, free).
        own, cross, slope: of the estimated starts: Hessian (problems, windows, starts, starts), mixed with the
            parameters (problems, windows, starts, free), gradient (problems, windows, starts).
        offset: initial states less the recorded ones, shape (problems, windows, starts).
    """

    costs: Array
    data: Array
    H: Array
    g: Array
    own: Array
    cross: Array
    slope: Array
    offset: Array

    def updated(self, index: Any, other: Normals, which: Mask) -> None:
        """Take over `other`, which belongs to the problems `index`, where `which` is set."""
        for mine, its in zip(self.parts, other.parts, strict=True):
            mine[index[which]] = its[which]

    @property
    def parts(self) -> tuple[Array, ...]:
        """All of it, each with the problems first."""
        return self.costs, self.data, self.H, self.g, self.own, self.cross, self.slope, self.offset

    def of(self, index: Any) -> Normals:
        """Some of the problems."""
        return Normals(*(part[index] for part in self.parts))

    def back(self, damping: Array | None = None) -> Array:
        """Answer of the starts to the parameters and by themselves, shape (problems, windows, starts, free + 1)."""
        extra = np.zeros(len(self.costs)) if damping is None else damping
        unit = np.eye(self.own.shape[-1])
        # Where the model blows up there is nothing to solve.
        known = np.isfinite(self.costs)[:, None, None, None]
        hessian = np.where(known, self.own * (1.0 + extra[:, None, None, None] * unit), unit)
        found: Any = np.linalg.solve(hessian, np.concatenate([self.cross, self.slope[..., None]], axis=3))
        return np.asarray(found, dtype=np.float64)

    def reduced(self, back: Array | None = None) -> Normals:
        """The starts eliminated: H and g of the parameters alone."""
        if not self.offset.shape[2]:
            return self
        found = np.einsum("pwsn,pwsm->pnm", self.cross, self.back() if back is None else back)
        return replace(self, H=self.H - found[..., :-1], g=self.g - found[..., -1])


@dataclass(frozen=True)
class Ends:
    """Where each problem ended.

    Attributes:
        values: shape (problems, free).
        normals: objective and normal equations there.
        iterations: steps tried, shape (problems,).
        converged: whether the last steps no longer mattered, shape (problems,).
    """

    values: Array
    normals: Normals
    iterations: NDArray[np.intp]
    converged: Mask

    @staticmethod
    def joined(parts: Sequence[Ends]) -> Ends:
        """Those of several calls as of one."""
        normals = Normals(*map(np.concatenate, zip(*(one.normals.parts for one in parts), strict=True)))
        return Ends(
            np.concatenate([one.values for one in parts]), normals,
            np.concatenate([one.iterations for one in parts]), np.concatenate([one.converged for one in parts]),
        )  # fmt: skip


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
    kernel: Sensitivity
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
        kernel, chunk = sensitivity(open_loop(problem.ship), vector.paths, vector.paths), _chunk(cut.state0.shape[0])
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
            state0[:, list(self.begun)] += self.settled(values[None], None).offset[0]
        run = simulator(open_loop(self.problem.ship), self.kernel.free).run(
            state0, cut.series, self.shared, lanewise=np.repeat(values[None], cut.state0.shape[0], axis=0),
            dt=cut.dt, steps=cut.steps, every=cut.every, method=self.method, threads=self.threads,
        )  # fmt: skip
        return run.values[:, :, : cut.width]

    def normals(self, values: Array, data: Data | None = None) -> Normals:
        """Objective and normal equations at `values`, shape (problems, free); of the best starts, these eliminated."""
        return self.settled(values, data).reduced()

    def settled(self, values: Array, data: Data | None) -> Normals:
        """The same at the best initial states for `values`, not eliminated."""
        offset = np.zeros((len(values), self.windows.state0.shape[0], len(self.begun)))
        now = self.at(values, offset, data)
        going = np.ones(len(values), dtype=np.bool_)
        for _ in range(_SETTLING if self.begun else 0):
            then = self.at(values, now.offset - now.back()[..., -1], data)
            # each problem ends by itself: its digits do not depend on its neighbours
            better = going & (then.costs < now.costs)
            going &= then.costs < (1.0 - 1e-10) * now.costs
            now.updated(np.arange(len(values)), then, better)
            if not going.any():
                break
        return now

    def at(self, values: Array, offset: Array, data: Data | None) -> Normals:
        """Objective and normal equations at `values` and at these offsets of the initial states."""
        count, n = values.shape
        parts = [np.arange(a, min(a + self.chunk, count)) for a in range(0, count, self.chunk)]

        def products(part: NDArray[np.intp]) -> Array:
            return self._part(values, offset, data, part)

        with ThreadPoolExecutor(self.threads) as pool:
            G = np.concatenate(list(pool.map(products, parts)))
        vector = self.problem.vector
        weight, away = vector.precision, values - (vector.mean if data is None else data.mean)
        whole = G.sum(axis=1)
        whole[:, range(n), range(n)] += weight
        costs = whole[:, -1, -1] + (weight * away**2).sum(axis=1) + (self.near * offset**2).sum(axis=(1, 2))
        good = np.isfinite(G).all(axis=(1, 2, 3))
        return Normals(
            np.where(good, costs, np.inf), np.where(good, whole[:, -1, -1], np.inf), whole[:, :n, :n],
            whole[:, :n, -1] + weight * away, G[:, :, n:-1, n:-1] + np.diag(self.near), G[:, :, n:-1, :n],
            G[:, :, n:-1, -1] + self.near * offset[:, : G.shape[1]], offset,
        )  # fmt: skip

    def _part(self, values: Array, offset: Array, data: Data | None, index: NDArray[np.intp]) -> Array:
        """Products of the columns of (slopes, residuals), shape (problems, windows or 1, columns, columns).

        Columns are those of the parameters, then of the estimated starts, whose windows are kept apart, and the
        residuals.
        """
        lanes, n = self.windows.state0.shape[0], values.shape[1]
        filled = np.append(index, np.repeat(index[-1], self.chunk - index.size))
        state0 = np.tile(self.windows.state0, (self.chunk, 1)) if data is None else data.state0[filled].reshape(
            self.chunk * lanes, -1
        ).copy()
        state0[:, list(self.begun)] += offset[filled].reshape(self.chunk * lanes, -1)
        run, slopes = self.kernel.run(
            state0, self.packed, self.shared, dt=self.windows.dt, steps=self.windows.steps, every=self.windows.every,
            lanewise=np.repeat(values[filled], lanes, axis=0), method=self.method, threads=1,
        )  # fmt: skip
        used, states = index.size * lanes, list(self.compared)
        measured = self.windows.measured[None] if data is None else data.measured[index]
        predicted = run[:used].reshape(index.size, lanes, run.shape[1], -1)
        scale = self.windows.scale[:, :, states]
        columns = np.empty((index.size, *scale.shape, n + len(self.begun) + 1))
        with np.errstate(all="ignore"):
            columns[..., :n] = slopes[:used, :, states, :n].reshape(columns[..., :n].shape)
            columns[..., n:-1] = slopes[:used, :, states, n:][..., list(self.begun)].reshape(columns[..., n:-1].shape)
            columns[..., -1] = predicted[..., states] - measured[..., states]
            np.multiply(columns, scale[..., None], out=columns)
            columns[:, scale == 0.0] = 0.0
            flat = columns.reshape(index.size, lanes if self.begun else 1, -1, columns.shape[-1])
            return np.matmul(flat.transpose(0, 1, 3, 2), flat)

    def descend(
        self, starts: Array, *, data: Data | None = None, held: Mask | None = None,
        iterations: int = 60, tolerance: float = 1e-10, each: Callable[[Array, Array], None] | None = None,
    ) -> Ends:  # fmt: skip
        """Bounded Levenberg-Marquardt of every problem from its start.

        Args:
            starts: shape (problems, free).
            data: what to fit to; None takes the trials.
            held: parameters that do not move, shape (problems, free).
            tolerance: relative decrease that no longer matters.
            each: called with all objectives and values after every iteration; the arrays are reused.
        """
        values = np.clip(starts, self.low, self.high)
        moving = np.ones(values.shape, dtype=np.bool_) if held is None else ~held
        now = self.settled(values, data)
        count, still, failed = (np.zeros(len(values), dtype=np.intp) for _ in range(3))
        damping = np.full(len(values), _DAMPING)
        going = np.isfinite(now.costs)
        while going.any() and count.max() < iterations:
            at = np.flatnonzero(going)
            here = now.of(at)
            back = here.back(damping[at])
            short = here.reduced(back)
            step, promised = steps(short.H, short.g, self.low - values[at], self.high - values[at],
                                   moving[at], damping[at])  # fmt: skip
            promised = promised + np.einsum("pws,pws->p", here.slope, back[..., -1])
            offset = here.offset - back[..., -1] - np.einsum("pwsn,pn->pws", back[..., :-1], step)
            then = self.at(values[at] + step, offset, None if data is None else data.of(at))
            gain, size = now.costs[at] - then.costs, np.abs(now.costs[at])
            better = gain >= 0.0
            values[at[better]] += step[better]
            now.updated(at, then, better)
            nothing = np.where(better, gain <= tolerance * size, promised <= tolerance * size)
            still[at], failed[at] = np.where(nothing, still[at] + 1, 0), np.where(better, 0, failed[at] + 1)
            damping[at] = np.where(better, np.maximum(damping[at] * _DOWN, _LEAST), damping[at] * _UP ** failed[at])
            count[at] += 1
            going[at] = (still[at] < _STILL) & (failed[at] < _FAILED)
            if each:
                each(now.costs, values)
        return Ends(np.clip(values, self.low, self.high), now.reduced(), count, still >= _STILL)


def _chunk(lanes: int) -> int:
    """Number of problems of `lanes` windows that fills the kernel's blocks best, at most four blocks or one problem."""
    sizes = [k for k in range(1, LANES + 1) if k * lanes <= 4 * LANES] or [1]
    return min(sizes, key=lambda k: (-(-k * lanes // LANES) * LANES / (k * lanes), k))
