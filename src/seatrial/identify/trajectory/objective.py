"""The trajectory objective of many problems at once: residuals and exact normal equations of all windows.

Problems share ship, controls and loss; each has its own values and nuisances, and may have its own data.  Lanes are
problems x windows, which one call of the kernel integrates with exact derivatives.  Nuisances are eliminated last.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from typing import Any

import numpy as np

from ...core.values import dataclass, fields, replace
from ...data import Array, Trial
from ...engine.rollout import default_threads
from ...engine.simd import LANES
from ...simulate.approach import substeps
from ...simulate.lanes import Kernel, Lanes, Steps, run, slopes
from ...simulate.loop import open_loop, open_loop_parameters
from .. import Problem, StudyError
from ..nuisance import Index, Layout, begun_as, first_errors, held
from ..record import Settings, Windows, cut_as, windows
from .gauss_newton import STILL, Block, Mask, Normal, State, descend
from .suspects import Suspect, named, recorded

# Steps to the best nuisances, mostly a few, and parts of one: a current bends a whole track.  Short parts creep into
# valleys: right where parameters are known, wrong where a search begins (objectives of 149 000 for 98 000).
_TOWARDS, _SHARES, _SHORT = 40, (1.0, 0.3, 0.1), (0.03, 0.01)
_FIRST = np.zeros(1, dtype=np.intp)  # of problems, where there is one


@dataclass(frozen=True)
class Data:
    """Data that each problem is fitted to, in place of the trials.

    Attributes:
        state0: state at the start of each window, shape (problems, windows, states).
        measured: shape (problems, windows, rows, motion).
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
    """

    values: Array
    costs: Array
    data: Array

    @staticmethod
    def joined(parts: Sequence[Ends]) -> Ends:
        """Those of several calls as of one."""
        return Ends(*(np.concatenate([getattr(one, f.name) for one in parts]) for f in fields(Ends)))


@dataclass(frozen=True)
class TrajectoryObjective:
    """Sum of squared weighted residuals, plus priors of parameters and nuisances, of each of many problems.

    The vector `p` of a problem holds the free parameters, then the errors of instruments that all trials share
    (`common`); `eta` its other nuisances, as `layout` has them.  Where problems are many they are the first axis, and
    `which` says whose `data` they are fitted to.

    Attributes:
        data: what each problem is fitted to; None fits all of them to the trials.
        threads: None takes every processor; their number changes no digit.
    """

    problem: Problem
    common: tuple[Suspect, ...]
    windows: Windows
    layout: Layout
    kernel: Kernel
    method: str
    threads: int | None
    data: Data | None = None

    @staticmethod
    def build(
        problem: Problem, trials: Sequence[Trial], sigma: Mapping[str, float], *,
        window: float, dt: float, every: int, method: str, threads: int | None, stride: float | None = None,
    ) -> TrajectoryObjective:  # fmt: skip
        """Cut the windows and compile the kernels."""
        cut = windows(
            trials, problem.ship.model, problem.loss, sigma, window=window, dt=dt, every=every, stride=stride,
            substeps=substeps(problem.ship, dt, method),
        )  # fmt: skip
        motion = problem.ship.model.motion
        layout = Layout.of(problem.nuisance, cut.trial, motion)
        # The prior of a free initial state represents its measurement, which must not count twice.
        measured = [motion.index(name) for name, sd in problem.nuisance.initial.items() if math.isfinite(sd)]
        cut.scale[:, 0, measured] = 0.0
        lanewise = (*problem.vector.paths, *layout.own.lanewise)
        common = named(problem.ship.model, trials, tuple(problem.nuisance.common), cut.trial)
        kernel = Kernel(open_loop(problem.ship), lanewise, lanewise)
        return TrajectoryObjective(problem, common, cut, layout, kernel, method, threads)

    @staticmethod
    def like(problem: Problem, settings: Settings, *, stride: float | None = None) -> TrajectoryObjective:
        """Cut and integrated as an estimator does it, initial states free unless it says "measured"."""
        sigma, arguments = cut_as(problem, settings)
        own = begun_as(problem, getattr(settings, "initial", "free"))
        return TrajectoryObjective.build(own, problem.trials, sigma, stride=stride, **arguments)

    @staticmethod
    def plain(problem: Problem, settings: Settings) -> TrajectoryObjective:
        """The same of a problem whose only nuisances are initial states; a StudyError where it has others."""
        if held(problem):
            raise StudyError("many problems at once take no [nuisance]; leave it out, or use shooting:Trajectory")
        return TrajectoryObjective.like(problem, settings)

    @property
    def count(self) -> int:
        """Number of free parameters."""
        return len(self.problem.free)

    @property
    def nuisances(self) -> int:
        """Length of the nuisance vector."""
        return self.layout.deviation.size

    @property
    def freed(self) -> bool:
        """Whether the initial states of windows are estimated."""
        return self.layout.own.initial.size > 0

    @property
    def deviation(self) -> Array:
        """Standard deviations of the priors of the errors of instruments; inf where there is none."""
        return np.array(list(self.problem.nuisance.common.values()))

    @property
    def compared(self) -> list[int]:
        """Positions among the measured states that the loss compares."""
        return np.flatnonzero((self.windows.scale > 0).any(axis=(0, 1))).tolist()

    @property
    def grid(self) -> Steps:
        """Steps of every window, a compared row each time."""
        return self.windows.grid(self.method)

    @property
    def interval(self) -> float:
        """Time between compared rows [s]."""
        return self.windows.dt * self.windows.every

    def before(self, p: Array) -> tuple[Array, Array]:
        """Matrix of the information of priors and intervals on `p`, and how far each may be off without data."""
        vector, free, others = self.problem.vector, p[: self.count], np.abs(p[self.count :])
        wide = np.where(np.isfinite(self.deviation), self.deviation, np.maximum(1e3 * others, 1.0))
        return self._with_errors(vector.held(free)), np.append(vector.reach(free), wide)

    @property
    def information(self) -> Array:
        """Matrix of the information of the priors on `p`; zero where there is none."""
        return self._with_errors(self.problem.vector.precision)

    def _with_errors(self, held: Array) -> Array:
        """A matrix of information on the parameters, with that of the priors of the errors of instruments below it."""
        return np.pad(held, (0, len(self.common))) + np.diag(np.append(np.zeros(len(held)), self.deviation**-2.0))

    def extended(self, p: Array, begun: bool = False) -> Array:
        """Parameters, then errors of instruments: zero, or where their search begins; of one problem or of many."""
        own = first_errors(self.problem.nuisance, self.problem.trials) if begun else np.zeros(len(self.common))
        return np.concatenate([p, np.broadcast_to(own, (*p.shape[:-1], len(self.common)))], axis=-1)

    def bounds(self) -> tuple[Array, Array]:
        """Bounds of `p`; the errors of instruments have none."""
        vector, wide = self.problem.vector, np.full(len(self.common), np.inf)
        return np.append(vector.low, -wide), np.append(vector.high, wide)

    @cached_property
    def _alone(self) -> Any:
        """Inputs of the windows, packed."""
        return self.kernel.pack(self.windows.series)

    @cached_property
    def _packed(self) -> Any:
        """The same for as many problems as run together."""
        return self.kernel.pack(np.tile(self.windows.series, (self._chunk, 1, 1)))

    @property
    def _chunk(self) -> int:
        """Problems that fill the kernel's blocks best together, at most four blocks or one problem."""
        lanes = len(self.windows.state0)
        sizes = [k for k in range(1, LANES + 1) if k * lanes <= 4 * LANES] or [1]
        return min(sizes, key=lambda k: (-(-k * lanes // LANES) * LANES / (k * lanes), k))

    def series(self, p: Array, change: Array | None = None) -> Any:
        """Inputs of the windows of each problem, corrected by its errors of instruments, and changed; packed.

        Args:
            p: shape (problems, parameters).
            change: of the inputs, shape as of `windows.series`.
        """
        cut = self.windows
        errors = zip(self.common, p[:, self.count :].T, strict=True)
        changes: list[Any] = [c[:, None, None, None] * one.acts(cut.series, cut.dt) for one, c in errors if one.acts]
        changes += [] if change is None else [change]
        if not changes:
            return self._packed if len(p) > 1 else self._alone
        whole = np.broadcast_to(cut.series + sum(changes), (len(p), *cut.series.shape))
        return self.kernel.pack(whole.reshape(-1, *cut.series.shape[1:]))

    def lanes(self, p: Array, eta: Array, which: Index | None = None) -> tuple[Lanes, Array]:
        """Runs of the windows, problem by problem, and the bias to add to predictions.

        Args:
            p, eta: shapes (problems, parameters) and (problems, nuisances).

        Returns:
            The runs, and shape (problems, windows, 1, motion).
        """
        cut, layout, windows = self.windows, self.layout, len(self.windows.state0)
        own = layout.of_trials(eta)[:, layout.trial]
        state0 = np.repeat(cut.state0[None], len(p), axis=0) if self.data is None else self.data.state0[which].copy()
        off = recorded(self.common, cut.state0[:, : cut.width], self.interval)
        bias = layout.own.offset(own)  # a channel began off by it too
        state0[..., : cut.width] += layout.starts(eta) - np.tensordot(p[:, self.count :], off, axes=1) - bias
        values = np.repeat(p[:, : self.count], windows, axis=0)
        lanewise = np.hstack([values, own[..., : layout.own.currents].reshape(len(values), -1)])
        lanes = Lanes(self.kernel, open_loop_parameters(self.problem.ship), state0.reshape(len(values), -1),
                      self.series(p), lanewise=lanewise)  # fmt: skip
        return lanes, bias[..., None, :]

    def states(self, lanes: Lanes, threads: int | None = None) -> Array:
        """Measured states that these runs predict, shape (problems, windows, rows, motion)."""
        rows = run(lanes, self.grid, threads=threads or self.threads).values[:, :, : self.windows.width]
        return rows.reshape(-1, *self.windows.scale.shape)

    def slopes(self, lanes: Lanes, threads: int | None = None) -> tuple[Array, Array]:
        """The same with their derivatives by `kernel.free` and the initial state in a last axis."""
        cut = self.windows
        rows, found = slopes(lanes, self.grid, threads or self.threads)
        return (rows[:, :, : cut.width].reshape(-1, *cut.scale.shape),
                found[:, :, : cut.width].reshape(-1, *cut.scale.shape, found.shape[-1]))  # fmt: skip

    def read(self, states: Array, p: Array, bias: Array) -> Array:
        """What the sensors read where the model predicts `states`, shape (problems, windows, rows, motion)."""
        out = states + bias
        for one, c in zip(self.common, p[:, self.count :].T, strict=True):
            if one.reads:
                out = out + c[:, None, None, None] * one.reads(states, None, self.interval)
        return out

    def columns(self, states: Array, slopes: Array, p: Array, lanes: Lanes, threads: int | None = None) -> Array:
        """Derivatives of the readings by `p`, then currents and initial states, shape (..., rows, motion, columns).

        Inputs by one-sided differences, which share the run of all windows.
        """
        if not self.common:
            return slopes
        n, moved = self.count, np.moveaxis(slopes, -1, 0)
        for one, c in zip(self.common, p[:, n:].T, strict=True):
            if one.reads and c.any():
                moved = moved + c[:, None, None, None] * one.reads(states, moved, self.interval)
        found = [self.direction(one, states, p, lanes, threads, moved[n + self.layout.own.currents :])
                 for one in self.common]  # fmt: skip
        return np.concatenate([np.moveaxis(moved[:n], 0, -1), np.stack(found, axis=-1), np.moveaxis(moved[n:], 0, -1)],
                              axis=-1)  # fmt: skip

    def direction(self, one: Suspect, states: Array, p: Array, lanes: Lanes, threads: Any, begun: Array) -> Array:
        """Derivative of the readings by an error of an instrument; `begun` has theirs by the initial states first."""
        out = np.zeros_like(states)
        if one.reads:
            [off] = recorded((one,), self.windows.state0[:, : self.windows.width], self.interval)
            out = one.reads(states, None, self.interval) - np.einsum("wk,k...wrm->...wrm", off, begun[: off.shape[1]])
        if one.acts:
            changed = self.series(p, one.step * one.acts(self.windows.series, self.windows.dt))
            with np.errstate(all="ignore"):
                out = out + (self.states(replace(lanes, series=changed), threads) - states) / one.step
        return out

    def weighted(self, read: Array, which: Index | None = None) -> Array:
        """Weighted residuals of readings, shape (problems, windows, rows, motion)."""
        scale, measured = self.windows.scale, self.windows.measured if self.data is None else self.data.measured[which]
        return np.where(scale > 0, (read - measured) * scale, 0.0)

    def _each(self, work: Callable[[Array, Array, Index, int], Array], p: Array, eta: Array, which: Index) -> Array:
        """What `work` says of each problem, some at a time, so that the memory does not grow with their number.

        The last problem fills the kernel's blocks, so that a result does not depend on the neighbours.
        """
        threads, size = self.threads or default_threads(), self._chunk
        if len(p) == 1:
            return work(p, eta, which, threads)
        firsts = range(0, len(p), size)

        def some(first: int) -> Array:
            at = np.minimum(np.arange(first, first + size), len(p) - 1)
            return work(p[at], eta[at], which[at], max(threads // len(firsts), 1))[: len(p) - first]

        with ThreadPoolExecutor(threads) as pool:
            return np.concatenate(list(pool.map(some, firsts)))

    @np.errstate(all="ignore")
    def _residuals(self, p: Array, eta: Array, which: Index, threads: int | None) -> Array:
        lanes, bias = self.lanes(p, eta, which)
        return self.weighted(self.read(self.states(lanes, threads), p, bias), which)

    @np.errstate(all="ignore")  # a trial step may leave residuals that are finite, but not their squares
    def _squares(self, p: Array, eta: Array, which: Index, threads: int) -> Array:
        return (self._residuals(p, eta, which, threads) ** 2).reshape(len(p), -1).sum(axis=1)

    @np.errstate(all="ignore")
    def _products(self, p: Array, eta: Array, which: Index, threads: int) -> Array:
        """Products of the columns of (slopes, residuals), shape (problems, windows or 1, columns, columns).

        Columns are those of `p`, then of what acts on a window alone (initial state, current, biases), whose windows
        are kept apart, and the residuals.
        """
        (lanes, bias), own, width = self.lanes(p, eta, which), self.layout.own, self.windows.width
        states, found = self.slopes(lanes, threads)
        error, found = self.weighted(self.read(states, p, bias), which), self.columns(states, found, p, lanes, threads)
        n, compared = p.shape[1], self.compared
        scale, begin = self.windows.scale[:, :, compared], n + own.currents
        count, last = n + own.initial.size, n + own.initial.size + own.currents
        whole = np.empty((len(p), *scale.shape, last + own.bias.size + 1))
        for k, state in enumerate(compared):  # one copy, as derivatives are most of the memory
            whole[..., k, :n] = found[..., state, :n]
            whole[..., k, n:count] = found[..., state, begin + own.initial]
            whole[..., k, count:last] = found[..., state, n:begin]
        whole[..., last:-1] = np.eye(width)[compared][:, own.bias] - found[..., compared, :][..., begin + own.bias]
        whole *= scale[..., None]
        whole[:, scale == 0.0] = 0.0
        whole[..., -1] = error[..., compared]
        flat = whole.reshape(len(p), len(scale) if self.nuisances else 1, -1, whole.shape[-1])
        return np.matmul(flat.transpose(0, 1, 3, 2), flat)

    def away(self, p: Array, which: Index) -> tuple[Array, Array]:
        """Offset of each `p` from the prior mean, and its product with the information of the priors."""
        away = p - self.extended(self.problem.vector.mean[None] if self.data is None else self.data.mean[which])
        return away, np.einsum("pi,ij->pj", away, self.information)

    def priors(self, p: Array, eta: Array, which: Index) -> Array:
        """Part of the objectives that the trials do not contribute, shape (problems,)."""
        with np.errstate(over="ignore"):
            away, drawn = self.away(p, which)
            return (drawn * away).sum(axis=1) + ((eta / self.layout.deviation) ** 2).sum(axis=1)

    def costs(self, p: Array, eta: Array, which: Index) -> Array:
        """Objectives, shape (problems,); inf where a window blows up."""
        told = self._each(self._squares, p, eta, which) + self.priors(p, eta, which)
        return np.where(np.isfinite(told), told, np.inf)

    def normals(self, p: Array, eta: Array, which: Index) -> Normal:
        """Objectives and their exact Gauss-Newton normal equations."""
        G, n = self._each(self._products, p, eta, which), p.shape[1]
        _, drawn = self.away(p, which)
        whole = G.sum(axis=1)
        good = np.isfinite(whole).all(axis=(1, 2))
        told = np.where(good, whole[:, -1, -1], np.inf)
        G[~good] = np.eye(G.shape[-1])  # where the model blows up there is nothing to solve
        return Normal(told + self.priors(p, eta, which), whole[:, :n, :n] + self.information,
                      whole[:, :n, -1] + drawn, self._blocks(G, eta, n), told)  # fmt: skip

    def _blocks(self, G: Array, eta: Array, n: int) -> tuple[Block, ...]:
        """Normal equations of the nuisances: of windows, or a block for each trial where trials have their own."""
        layout = self.layout
        if not self.nuisances:
            return ()
        if layout.own.count:
            return tuple(self._block(k, G, eta, n) for k in range(len(layout.slices)))
        where = layout.by_window
        weight = layout.deviation[where] ** -2.0
        return (Block(where, G[:, :, n:-1, n:-1] + weight[:, :, None] * np.eye(where.shape[1]), G[:, :, n:-1, :n],
                      G[:, :, n:-1, -1] + weight * eta[:, where]),)  # fmt: skip

    def _block(self, trial: int, G: Array, eta: Array, n: int) -> Block:
        """Normal equations of one trial's nuisances, summed over its windows."""
        part = self.layout.slices[trial]
        weight = self.layout.deviation[part] ** -2.0
        own = np.repeat(np.diag(weight)[None], len(G), axis=0)
        cross, gradient = np.zeros((len(G), weight.size, n)), weight * eta[:, part]
        for lane in self.layout.lanes[trial]:
            at = self.layout.of_window[lane] - part.start
            own[:, at[:, None], at] += G[:, lane, n:-1, n:-1]
            cross[:, at] += G[:, lane, n:-1, :n]
            gradient[:, at] += G[:, lane, n:-1, -1]
        return Block(np.arange(part.start, part.stop)[None], own[:, None], cross[:, None], gradient[:, None])

    def settled(self, p: Array, eta: Array | None = None, deep: bool = False) -> tuple[Normal, Array]:
        """Normal equations at the best nuisances for each `p`, not eliminated, and these, from `eta`; `deep` creeps."""
        eta = np.zeros((len(p), self.nuisances)) if eta is None else eta.copy()
        now = self.normals(p, eta, np.arange(len(p)))
        going = np.isfinite(now.cost) & bool(self.nuisances)
        for _ in range(2 * _TOWARDS if deep else _TOWARDS):
            # each problem ends by itself: its digits do not depend on its neighbours
            at = np.flatnonzero(going)
            if not at.size:
                break
            step, share = now.of(at).alone(), np.zeros(at.size)
            for one in (*_SHARES, *_SHORT) if deep else _SHARES:
                left = np.flatnonzero(share == 0.0)
                if left.size:
                    tried = self.costs(p[at[left]], eta[at[left]] + one * step[left], at[left])
                    share[left[tried < now.cost[at[left]]]] = one
            eta[at] += share[:, None] * step
            then, before = self.normals(p[at], eta[at], at), now.cost[at]
            now = now.having(at, then)
            going[at] = (share > 0.0) & (then.cost < (1.0 - 1e-10) * before)
        return now, eta

    def best(self, values: Array) -> Normal:
        """The same, the nuisances eliminated, for each of `values`, shape (problems, free)."""
        found, _ = self.settled(self.extended(values))
        H, g = found.reduced()
        return Normal(found.cost, H, g, data=found.data)

    def predicted(self, values: Array) -> Array:
        """Readings of all windows by one set of values from the best nuisances, shape (windows, rows, motion)."""
        p = self.extended(values)
        lanes, bias = self.lanes(p[None], self.begun(p)[None])
        return self.read(self.states(lanes), p[None], bias)[0]

    def descend(
        self, starts: Array, *, held: Mask | None = None, iterations: int = 60, tolerance: float = 1e-10
    ) -> Ends:
        """Go down with every problem from its start, shape (problems, free); see `gauss_newton.descend`."""
        (low, high), every = self.bounds(), np.arange(len(starts))
        p = np.clip(self.extended(starts), low, high)
        now, eta = self.settled(p)
        end = descend(self, State.begin(p, eta, now.cost), low, high, held=held, iterations=iterations,
                      tolerance=tolerance, still=STILL)  # fmt: skip
        return Ends(end.p[:, : self.count], end.cost, end.cost - self.priors(end.p, end.eta, every))

    def residuals(self, p: Array, eta: Array) -> Array:
        """Weighted residuals of one problem, shape (windows, rows, motion); not finite where the model blows up."""
        return self._residuals(p[None], eta[None], _FIRST, None)[0]

    def cost(self, p: Array, eta: Array) -> float:
        """Objective of one problem."""
        return float(self.costs(p[None], eta[None], _FIRST)[0])

    def normal(self, p: Array, eta: Array) -> Normal:
        """Objective and normal equations of one problem."""
        return self.normals(p[None], eta[None], _FIRST).of(0)

    def variance(self, p: Array, eta: Array) -> float:
        """Mean squared residual over sigma^2 per degree of freedom: the factor by which sigma^2 was wrong."""
        # by their weight: samples of one lasting error do not count as many
        independent = float(self.windows.entries) * self.windows.weight
        return float((self.residuals(p, eta) ** 2).sum()) / max(independent - p.size - self.layout.flat, 1.0)

    def begun(
        self, p: Array, until: float | None = None, known: Mapping[str, Mapping[str, float]] | None = None
    ) -> Array:
        """The best nuisance parameters of one problem.

        Args:
            until: seconds of each window that are used; None uses all of it.
            known: of a fit (`Fit.nuisances`), by trial and name: sought from, and deeply; None: from zero, few steps.
        """
        here, eta, layout = self, np.zeros(self.nuisances), self.layout
        for index, part in zip(np.unique(self.windows.trial).tolist(), layout.slices, strict=True) if known else ():
            found = (known or {}).get(self.problem.trials[index].name, {})
            eta[part.stop - len(layout.own.names) : part.stop] = [found.get(name, 0.0) for name in layout.own.names]
        if not eta.size:
            return eta
        if until is not None:
            rows = np.arange(self.windows.scale.shape[1]) * self.interval
            seen = np.where((rows <= until)[None, :, None], self.windows.scale, 0.0)
            here = replace(self, windows=replace(self.windows, scale=seen))
        starts = np.unique([eta, 0.0 * eta], axis=0)  # from known currents a start may end in a valley of its own
        found, best = here.settled(np.repeat(p[None], len(starts), axis=0), starts, known is not None)
        return best[int(np.argmin(np.where(np.isnan(found.cost), np.inf, found.cost)))]

    def standardised(self, p: Array) -> float:
        """Pooled standardised MSE of all windows without nuisances (Wakita 2022 Eq. 25)."""
        with np.errstate(over="ignore"):
            e = self.residuals(p, np.zeros(self.nuisances))
            return float((e * e).sum()) / (self.windows.weight * max(self.windows.samples, 1))

    def failure(self, p: Array) -> str:
        """Description of the trial and state that blow up first at `p`."""
        with np.errstate(all="ignore"):
            lanes, _ = self.lanes(p[None], np.zeros((1, self.nuisances)))
            first = next(iter(run(lanes, self.grid, threads=self.threads).failures), None)
        return "the objective is not finite" if first is None else (
            f"trial {self.problem.trials[int(self.windows.trial[first.lane])].name}, window {first}")
