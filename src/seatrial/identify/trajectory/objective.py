"""The trajectory objective: residuals and exact normal equations of all windows at once."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...data import Array, Trial
from ...engine import Rollout
from ...simulate.approach import substeps
from ...simulate.lanes import Kernel, Lanes, run, slopes
from ...simulate.loop import open_loop, open_loop_parameters
from .. import Problem
from ..nuisance import Index, Layout
from ..record import Windows, windows
from .gauss_newton import Block, Normal
from .suspects import Suspect, named

# Steps to the best initial states for given parameters: the readings are near, so a few suffice.
_TOWARDS = 8
# Parts of a step that are tried one after the other: a current of its own bends a whole track.
_SHARES = (1.0, 0.3, 0.1)
# Finite difference of a fixed parameter, relative, and the relative change that is reported.
_SMALL, _TENTH = 1e-4, 0.1


@dataclass(frozen=True)
class TrajectoryObjective:
    """Sum of squared weighted residuals, plus priors of parameters and nuisances.

    The vector `p` holds the free parameters, then the errors of instruments that all trials share (`common`).
    """

    problem: Problem
    common: tuple[Suspect, ...]
    windows: Windows
    layout: Layout
    kernel: Kernel
    packed: Any
    where: Index
    method: str
    threads: int | None

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
        system = open_loop(problem.ship)
        lanewise = layout.own.lanewise
        kernel = Kernel(system, lanewise, (*problem.vector.paths, *lanewise))
        where = problem.vector.positions(system.parameters)
        common = named(problem.ship.model, trials, tuple(problem.nuisance.common))
        packed = kernel.pack(cut.series)
        return TrajectoryObjective(problem, common, cut, layout, kernel, packed, where, method, threads)

    @property
    def nuisances(self) -> int:
        """Length of the nuisance vector."""
        return self.layout.deviation.size

    @property
    def deviation(self) -> Array:
        """Standard deviations of the priors of the errors of instruments; inf where there is none."""
        return np.array(list(self.problem.nuisance.common.values()))

    def before(self, p: Array) -> tuple[Array, Array]:
        """Information of priors and intervals on each entry of `p`, and how far it may be off without data."""
        vector, count = self.problem.vector, self.where.size
        free, others = p[:count], np.abs(p[count:])
        wide = np.where(np.isfinite(self.deviation), self.deviation, np.maximum(1e3 * others, 1.0))
        return np.append(vector.held(free), self.deviation**-2.0), np.append(vector.reach(free), wide)

    def extended(self, p: Array) -> Array:
        """Parameters, then errors of instruments, these zero."""
        return np.append(p, np.zeros(len(self.common)))

    def bounds(self) -> tuple[Array, Array]:
        """Bounds of `p`; the errors of instruments have none."""
        vector, wide = self.problem.vector, np.full(len(self.common), np.inf)
        return np.append(vector.low, -wide), np.append(vector.high, wide)

    def lanes(self, p: Array, eta: Array) -> tuple[Lanes, Array]:
        """Runs of the windows, and the bias to add to predictions."""
        parameters = open_loop_parameters(self.problem.ship)
        parameters[self.where] = p[: self.where.size]
        state0 = self.windows.state0.copy()
        state0[:, : self.windows.width] += self.layout.starts(eta)
        nuisances, own = self.layout.own, self.layout.of_trials(eta)[self.layout.trial]
        lanes = Lanes(self.kernel, parameters, state0, self.series(p), lanewise=nuisances.drift(own))
        return lanes, nuisances.offset(own)[:, None, :]

    def predicted(self, lanes: Lanes) -> Rollout:
        """The runs of the windows, their compared rows."""
        return run(lanes, self.windows.grid(self.method), threads=self.threads)

    def linearised(self, lanes: Lanes) -> tuple[Array, Array]:
        """Compared states and their derivatives, shapes (lanes, rows, motion) and (lanes, rows, motion, columns)."""
        states, found = slopes(lanes, self.windows.grid(self.method), self.threads)
        return states[:, :, : self.windows.width], found[:, :, : self.windows.width]

    def series(self, p: Array, change: Array | None = None) -> Any:
        """Inputs, corrected by the errors of instruments in `p`, and changed by `change`; packed."""
        changes = [c * one.acts(self.windows.series, self.windows.dt)
                   for one, c in zip(self.common, p[self.where.size :], strict=True) if one.acts]  # fmt: skip
        changes += [] if change is None else [change]
        return self.kernel.pack(self.windows.series + sum(changes)) if changes else self.packed

    @property
    def _interval(self) -> float:
        """Time between compared rows [s]."""
        return self.windows.dt * self.windows.every

    def _read(self, predicted: Array, p: Array, bias: Array) -> Array:
        """What the sensors read where the model predicts `predicted`, shape (lanes, rows, motion)."""
        out = predicted + bias
        for one, c in zip(self.common, p[self.where.size :], strict=True):
            if one.reads:
                out = out + c * one.reads(predicted, None, self._interval)
        return out

    def _columns(self, run: Array, slopes: Array, p: Array, lanes: Lanes) -> Array:
        """Derivatives of the readings by `p`, then currents and initial states, shape (lanes, rows, 6, columns).

        Inputs by one-sided differences, which share the run of all windows.
        """
        if not self.common:
            return slopes
        n, moved = self.where.size, np.moveaxis(slopes, -1, 0)
        for one, c in zip(self.common, p[n:], strict=True):
            if one.reads and c:
                moved = moved + c * one.reads(run, moved, self._interval)
        found = [self.direction(one, run, p, lanes) for one in self.common]
        return np.concatenate([np.moveaxis(moved[:n], 0, -1), np.stack(found, axis=-1), np.moveaxis(moved[n:], 0, -1)],
                              axis=-1)  # fmt: skip

    def direction(self, one: Suspect, run: Array, p: Array, lanes: Lanes) -> Array:
        """Derivative of the readings by an error of an instrument, shape (lanes, rows, motion)."""
        out = np.zeros_like(run)
        if one.reads:
            out = one.reads(run, None, self._interval)
        if one.acts:
            changed = self.windows.series + one.step * one.acts(self.windows.series, self.windows.dt)
            known = [c * other.acts(self.windows.series, self.windows.dt)
                     for other, c in zip(self.common, p[self.where.size :], strict=True) if other.acts]  # fmt: skip
            packed = self.kernel.pack(changed + sum(known) if known else changed)
            with np.errstate(all="ignore"):
                other = self.predicted(replace(lanes, series=packed)).values[:, :, : self.windows.width]
            out = out + (other - run) / one.step
        return out

    def residuals(self, p: Array, eta: Array) -> Array:
        """Weighted residuals, shape (lanes, rows, motion); not finite where the model blows up."""
        lanes, bias = self.lanes(p, eta)
        with np.errstate(all="ignore"):
            return self._weighted(self._read(self.predicted(lanes).values[:, :, : self.windows.width], p, bias))

    def _weighted(self, predicted: Array) -> Array:
        scale = self.windows.scale
        return np.where(scale > 0, (predicted - self.windows.measured) * scale, 0.0)

    def _prior(self, p: Array) -> tuple[Array, Array]:
        """Offset from the prior mean and 1/sigma^2 of each entry of `p`; zero where there is no prior."""
        vector = self.problem.vector
        return p - self.extended(vector.mean), np.append(vector.precision, self.deviation**-2.0)

    def cost(self, p: Array, eta: Array) -> float:
        """Objective; inf where any lane blows up within its window."""
        e = self.residuals(p, eta)
        away, weight = self._prior(p)
        # A trial step may leave residuals that are finite, but not their squares.
        with np.errstate(over="ignore"):
            total = float((e * e).sum() + (weight * away**2).sum() + ((eta / self.layout.deviation) ** 2).sum())
        return total if np.isfinite(total) else float("inf")

    def normal(self, p: Array, eta: Array) -> Normal:
        """Objective and its exact Gauss-Newton normal equations."""
        (lanes, bias), n = self.lanes(p, eta), p.size
        states, found = self.linearised(lanes)
        e = self._weighted(self._read(states, p, bias))
        columns = self._columns(states, found, p, lanes)
        columns *= self.windows.scale[..., None]
        columns[self.windows.scale == 0.0] = 0.0
        J = columns.reshape(-1, columns.shape[-1])
        away, weight = self._prior(p)
        H = J[:, :n].T @ J[:, :n] + np.diag(weight)
        g = J[:, :n].T @ e.ravel() + weight * away
        blocks = self._blocks(columns, e, eta, n)
        cost = float((e * e).sum() + (weight * away**2).sum() + ((eta / self.layout.deviation) ** 2).sum())
        return Normal(cost, H, g, blocks)

    def _blocks(self, D: Array, e: Array, eta: Array, n: int) -> tuple[Block, ...]:
        """Normal equations of the nuisances: of windows, or a block for each trial where trials have their own."""
        layout = self.layout
        if not self.nuisances:
            return ()
        if layout.own.count:
            return tuple(self._block(i, D, e, eta, n) for i in range(len(layout.slices)))
        flat = D.reshape(len(D), -1, D.shape[-1])
        N, J, where = flat[:, :, n + layout.own.initial], flat[:, :, :n], layout.by_window
        back, weight = N.transpose(0, 2, 1), layout.deviation[where] ** -2.0
        gradient = (back @ e.reshape(len(e), -1, 1))[:, :, 0] + weight * eta[where]
        return (Block(where, back @ N + weight[:, :, None] * np.eye(where.shape[1]), back @ J, gradient),)

    def _block(self, index: int, D: Array, e: Array, eta: Array, n: int) -> Block:
        """Normal equations of one trial's nuisances."""
        layout, mine = self.layout, self.layout.lanes[index]
        part = layout.slices[index]
        N = layout.columns(index, D[mine], self.windows.scale[mine], n)
        own = D[mine].reshape(len(mine), N.shape[1], -1)
        flat, J = N.reshape(-1, N.shape[2]), own.reshape(-1, own.shape[2])[:, :n]
        weight = layout.deviation[part] ** -2.0
        return Block(
            np.arange(part.start, part.stop)[None], (flat.T @ flat + np.diag(weight))[None], (flat.T @ J)[None],
            (flat.T @ e[mine].ravel() + weight * eta[part])[None],
        )  # fmt: skip

    def linear(
        self, p: Array, eta: Array, suspects: Sequence[Suspect], fixed: Mapping[str, float], draws: Sequence[Array]
    ) -> tuple[Array, Array, Array, Array, Array]:
        """Weighted residuals, and unweighted derivatives of the readings, for tests of a finished fit.

        Args:
            suspects: errors of instruments that are not estimated.
            fixed: parameters that are not estimated; their change is a tenth of their value.
            draws: changes of the inputs, each of the shape of `windows.series`.

        Returns:
            Residuals (lanes, rows, 6), derivatives by `p`, currents and initial states, by the suspects, and the
            changes of the readings by each fixed parameter and each draw, shapes (lanes, rows, 6, ...).
        """
        lanes, bias = self.lanes(p, eta)
        states, found = self.linearised(lanes)
        e = self._weighted(self._read(states, p, bias))
        full = self._columns(states, found, p, lanes)
        extra = [self.direction(one, states, p, lanes) for one in suspects]
        names = list(self.kernel.system.parameters)
        held: list[Array] = []
        for path, value in fixed.items():
            if path not in names:
                continue
            other = lanes.shared.copy()
            other[names.index(path)] = value * (1.0 + _SMALL)
            moved = self.predicted(replace(lanes, shared=other)).values[:, :, : self.windows.width]
            held.append((moved - states) * (_TENTH / _SMALL))
        moved = [self._disturbed(draw, states, p, lanes) for draw in draws]
        none = np.zeros((*states.shape, 0))
        suspected, changed, drawn = (np.stack(some, axis=-1) if some else none for some in (extra, held, moved))
        return e, full, suspected, changed, drawn

    def _disturbed(self, draw: Array, run: Array, p: Array, lanes: Lanes) -> Array:
        """Change of the readings by a change of the inputs, shape (lanes, rows, motion)."""
        with np.errstate(all="ignore"):
            other = self.predicted(replace(lanes, series=self.series(p, draw))).values
        return other[:, :, : self.windows.width] - run

    def variance(self, p: Array, eta: Array) -> float:
        """Mean squared residual over sigma^2 per degree of freedom: the factor by which sigma^2 was wrong.

        Samples are counted by their weight, so that lasting errors do not count as many.
        """
        e = self.residuals(p, eta)
        independent = float(self.windows.entries) * self.windows.weight
        return float((e * e).sum()) / max(independent - p.size - self.layout.flat, 1.0)

    def begun(
        self, p: Array, until: float | None = None, known: Mapping[str, Mapping[str, float]] | None = None
    ) -> Array:
        """The best nuisance parameters for `p`.

        Args:
            until: seconds of each window that are used; None uses all of it.
            known: currents and biases to search from, by trial and name (`Fit.nuisances`); zero where there are none.
        """
        here, eta = self, np.zeros(self.nuisances)
        if not eta.size:
            return eta
        known, indices = known or {}, np.unique(self.windows.trial).tolist()
        for index, part in zip(indices, self.layout.slices, strict=True) if known else ():
            found = known.get(self.problem.trials[index].name, {})
            own = np.array([found.get(name, 0.0) for name in self.layout.own.names])
            eta[part.stop - own.size : part.stop] = own
        if until is not None:
            rows = np.arange(self.windows.scale.shape[1]) * self.windows.every * self.windows.dt
            seen = np.where((rows <= until)[None, :, None], self.windows.scale, 0.0)
            here = replace(self, windows=replace(self.windows, scale=seen))
        cost = here.cost(p, eta)
        for _ in range(_TOWARDS):
            step = np.zeros(eta.size)
            for block in here.normal(p, eta).blocks:
                step[block.where] = -block.back()[..., -1]
            further, then = eta, cost
            for share in _SHARES:
                further = eta + share * step
                if (then := here.cost(p, further)) < cost:
                    break
            if not then < cost:
                break
            last, eta, cost = cost - then <= 1e-10 * cost, further, then
            if last:
                break
        return eta

    def standardised(self, p: Array) -> float:
        """Pooled standardised MSE of all windows without nuisances (Wakita 2022 Eq. 25)."""
        e = self.residuals(p, np.zeros(self.nuisances))
        with np.errstate(over="ignore"):
            return float((e * e).sum()) / (self.windows.weight * max(self.windows.samples, 1))

    def failure(self, p: Array) -> str:
        """Description of the trial and state that blow up first at `p`."""
        with np.errstate(all="ignore"):
            failures = self.predicted(self.lanes(p, np.zeros(self.nuisances))[0]).failures
        if not failures:
            return "the objective is not finite"
        first = failures[0]
        trial = self.problem.trials[int(self.windows.trial[first.lane])].name
        return f"trial {trial}, window {first}"
