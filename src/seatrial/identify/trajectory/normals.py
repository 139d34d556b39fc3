"""Normal equations of many problems at once, with those of their initial states apart until they are eliminated."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...data import Array
from .gauss_newton import Mask


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
