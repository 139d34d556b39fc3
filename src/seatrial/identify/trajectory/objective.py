"""The trajectory objective: residuals and exact normal equations of all windows at once."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...data import Array, Trial
from ...engine.rollout import Sensitivity, Simulator, sensitivity, simulator
from ...models import STATES
from ...simulate.approach import substeps
from ...simulate.loop import open_loop, open_loop_parameters
from .. import Problem
from ..nuisance import Index, Layout
from ..record import Windows, windows
from .gauss_newton import Block, Normal

# Steps to the best initial states for given parameters: the readings are near, so a few suffice.
_TOWARDS = 8


@dataclass(frozen=True)
class TrajectoryObjective:
    """Sum of squared weighted residuals, plus priors of parameters and nuisances."""

    problem: Problem
    windows: Windows
    layout: Layout
    forward: Simulator
    slopes: Sensitivity
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
        layout = Layout.of(problem.nuisance, cut.trial)
        # The prior of a free initial state represents its measurement, which must not count twice.
        measured = [STATES.index(name) for name, sd in problem.nuisance.initial.items() if math.isfinite(sd)]
        cut.scale[:, 0, measured] = 0.0
        system = open_loop(problem.ship)
        lanewise = layout.own.lanewise
        free = (*problem.vector.paths, *lanewise)
        forward = simulator(system, lanewise)
        where = problem.vector.positions(system.parameters)
        return TrajectoryObjective(
            problem, cut, layout, forward, sensitivity(system, free, lanewise), forward.pack(cut.series),
            where, method, threads,
        )  # fmt: skip

    @property
    def nuisances(self) -> int:
        """Length of the nuisance vector."""
        return self.layout.deviation.size

    def _arguments(self, p: Array, eta: Array) -> tuple[Array, Array, dict[str, Any], Array]:
        """Initial states, parameters, run arguments and the bias to add to predictions."""
        parameters = open_loop_parameters(self.problem.ship)
        parameters[self.where] = p
        state0 = self.windows.state0.copy()
        state0[:, : len(STATES)] += self.layout.starts(eta)
        nuisances, own = self.layout.own, self.layout.of_trials(eta)[self.layout.trial]
        arguments: dict[str, Any] = {
            "dt": self.windows.dt, "steps": self.windows.steps, "every": self.windows.every,
            "method": self.method, "threads": self.threads, "lanewise": nuisances.drift(own),
        }  # fmt: skip
        return state0, parameters, arguments, nuisances.offset(own)[:, None, :]

    def residuals(self, p: Array, eta: Array) -> Array:
        """Weighted residuals, shape (lanes, rows, 6); not finite where the model blows up."""
        state0, parameters, arguments, bias = self._arguments(p, eta)
        with np.errstate(all="ignore"):
            run = self.forward.run(state0, self.packed, parameters, **arguments)
            return self._weighted(run.values[:, :, : len(STATES)] + bias)

    def _weighted(self, predicted: Array) -> Array:
        scale = self.windows.scale
        return np.where(scale > 0, (predicted - self.windows.measured) * scale, 0.0)

    def _prior(self, p: Array) -> tuple[Array, Array]:
        """Offset from the prior mean and 1/sigma^2 of each parameter; zero where there is no prior."""
        vector = self.problem.vector
        return p - vector.mean, vector.precision

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
        state0, parameters, arguments, bias = self._arguments(p, eta)
        run, slopes = self.slopes.run(state0, self.packed, parameters, **arguments)
        e, n, slopes = self._weighted(run[:, :, : len(STATES)] + bias), p.size, slopes[:, :, : len(STATES)]
        slopes *= self.windows.scale[..., None]
        slopes[self.windows.scale == 0.0] = 0.0
        J = slopes.reshape(-1, slopes.shape[-1])
        away, weight = self._prior(p)
        H = J[:, :n].T @ J[:, :n] + np.diag(weight)
        g = J[:, :n].T @ e.ravel() + weight * away
        blocks = tuple(self._block(i, slopes, e, eta, n) for i in range(len(self.layout.slices)) if self.nuisances)
        cost = float((e * e).sum() + (weight * away**2).sum() + ((eta / self.layout.deviation) ** 2).sum())
        return Normal(cost, H, g, blocks)

    def _block(self, index: int, D: Array, e: Array, eta: Array, n: int) -> Block:
        """Normal equations of one trial's nuisances."""
        part, mine = self.layout.slices[index], self.layout.lanes[index]
        N = self.layout.columns(index, D[mine], self.windows.scale[mine], n)
        own = D[mine].reshape(len(mine), N.shape[1], -1)
        flat, J = N.reshape(-1, N.shape[2]), own.reshape(-1, own.shape[2])[:, :n]
        weight = self.layout.deviation[part] ** -2.0
        return Block(
            part, flat.T @ flat + np.diag(weight), flat.T @ J,
            flat.T @ e[mine].ravel() + weight * eta[part],
        )  # fmt: skip

    def variance(self, p: Array, eta: Array) -> float:
        """Mean squared residual over sigma^2 per degree of freedom: the factor by which sigma^2 was wrong.

        Samples are counted by their weight, so that lasting errors do not count as many.
        """
        e = self.residuals(p, eta)
        independent = float(self.windows.entries) * self.windows.weight
        return float((e * e).sum()) / max(independent - p.size - self.layout.flat, 1.0)

    def begun(self, p: Array, until: float | None = None) -> Array:
        """The best nuisance parameters for `p`, searched from zero.

        Args:
            until: seconds of each window that are used; None uses all of it.
        """
        here, eta = self, np.zeros(self.nuisances)
        if not eta.size:
            return eta
        if until is not None:
            rows = np.arange(self.windows.scale.shape[1]) * self.windows.every * self.windows.dt
            seen = np.where((rows <= until)[None, :, None], self.windows.scale, 0.0)
            here = replace(self, windows=replace(self.windows, scale=seen))
        cost = here.cost(p, eta)
        for _ in range(_TOWARDS):
            further = eta.copy()
            for block in here.normal(p, eta).blocks:
                further[block.where] -= np.linalg.solve(block.own, block.gradient)
            then = here.cost(p, further)
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
        state0, parameters, arguments, _ = self._arguments(p, np.zeros(self.nuisances))
        with np.errstate(all="ignore"):
            run = self.forward.run(state0, self.packed, parameters, **arguments)
        if not run.failures:
            return "the objective is not finite"
        first = run.failures[0]
        trial = self.problem.trials[int(self.windows.trial[first.lane])].name
        return f"trial {trial}, window {first}"
