"""Moving horizon estimation: the most likely states of a window, process noise included, and what came before it.

The unknowns are the states at all rows of the window.  A Gauss-Newton step on them is one pass of the affine Kalman
filter and smoother about the present trajectory (Bell 1994), which is the condensing of the window by dynamic
programming.  What came before the window counts through the arrival cost: the Gaussian of its first state given all
earlier readings and no later one.  When a row leaves the window, the arrival is carried on over it, linearised about
the smoothed trajectory but conditioned on the readings that leave only; so the past keeps the better linearisation of
its future, and no reading counts twice.  On a linear model the last state is that of the Kalman filter.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from ...core.values import dataclass, field
from ...data import Array
from .kalman import FilterModel, Rows, moved, over, substeps


@dataclass
class _Row:
    """A row of the window.

    Attributes:
        t: time [s].
        acting: inputs since the row before.
        reading: shape (m,).
        rows: channels that count.
        node: the present trajectory there, shape (n,).
    """

    t: float
    acting: Array
    reading: Array
    rows: Rows
    node: Array


@dataclass(frozen=True)
class _Pass:
    """One pass: Gaussians before and after each row's readings, and Jacobians from row to row."""

    ahead: list[tuple[Array, Array]]
    after: list[tuple[Array, Array]]
    onward: list[Array]


@dataclass
class Horizon:
    """A window that moves along with a log.

    Attributes:
        model: ship and sensors.
        density: spectral density of the process noise, shape (n,).
        step: longest Runge-Kutta step [s].
        span: length of the window [s].
        arrival: mean and covariance at the first row, given what came before it.
    """

    model: FilterModel
    density: Array
    step: float
    span: float
    arrival: tuple[Array, Array]
    _rows: deque[_Row] = field(default_factory=deque[_Row])

    @staticmethod
    def begun(
        model: FilterModel, density: Array, step: float, span: float, t: float, mean: Array, cov: Array
    ) -> Horizon:  # fmt: skip
        """A window of one row, at time `t`, at which the state is known as given, its readings included."""
        none = np.zeros(0, dtype=np.intp)
        first = _Row(t, np.zeros(0), np.full(len(model.channels), np.nan), none, mean)
        return Horizon(model, density, step, span, (mean, cov), deque([first]))

    @property
    def rows(self) -> int:
        """Rows in the window."""
        return len(self._rows)

    @property
    def t(self) -> float:
        """Time of the last row [s]."""
        return self._rows[-1].t

    def add(self, t: float, acting: Array, reading: Array, rows: Rows) -> None:
        """Append a row; `rows` are the channels that count."""
        last = self._rows[-1]
        count = substeps(t - last.t, self.step)
        node = last.node
        for _ in range(count):
            node = self.model.step(node, acting, (t - last.t) / count)[0]
        self._rows.append(_Row(t, acting, reading, rows, node))

    def solve(self, iterations: int = 1) -> tuple[Array, Array]:
        """Mean and covariance of the state at the last row; rows that are too old leave the window.

        Args:
            iterations: Gauss-Newton steps.
        """
        run = self._forward()
        for _ in range(iterations - 1):
            self._smooth(run)
            run = self._forward()
        self._smooth(run)
        old = sum(row.t < self.t - self.span for row in self._rows)
        if old:  # of the same pass: about the trajectory that the solution before has smoothed
            self.arrival = run.ahead[old]
            for _ in range(old):
                self._rows.popleft()
        return run.after[-1]

    @property
    def states(self) -> Array:
        """The trajectory of the window, smoothed, shape (rows, n)."""
        return np.array([row.node for row in self._rows])

    def _forward(self) -> _Pass:
        """The affine filter about the present trajectory."""
        ahead, after, onward = [self.arrival], list[tuple[Array, Array]](), list[Array]()
        rows = list(self._rows)
        for k, row in enumerate(rows):
            after.append(self._read(row, *ahead[-1]))
            if k + 1 < len(rows):
                slope, reached, noise = self._between(row, rows[k + 1])
                mean, cov = after[-1]
                onward.append(slope)
                cov = slope @ cov @ slope.T + noise
                ahead.append((reached + slope @ (mean - row.node), 0.5 * (cov + cov.T)))
        return _Pass(ahead, after, onward)

    def _between(self, row: _Row, later: _Row) -> tuple[Array, Array, Array]:
        """Jacobian from a row to the next, where its node ends up, and noise in between."""
        span = later.t - row.t
        count = substeps(span, self.step)
        at, whole, noise = row.node, np.eye(row.node.size), np.zeros((row.node.size, row.node.size))
        for _ in range(count):
            at, slope, blur = moved(self.model, at, later.acting, span / count, self.density)
            whole, noise = slope @ whole, slope @ noise @ slope.T + blur
        return whole, at, noise

    def _read(self, row: _Row, mean: Array, cov: Array) -> tuple[Array, Array]:
        if not row.rows.size:
            return mean, cov
        expected, transposed = self.model.read(row.node, row.acting)
        slope = transposed.T[row.rows]
        miss = self.model.wrapped(row.reading - expected)[row.rows] - slope @ (mean - row.node)
        noise = self.model.noise[row.rows] ** 2
        gain = over(cov @ slope.T, slope @ cov @ slope.T + np.diag(noise))
        keep = np.eye(mean.size) - gain @ slope
        after = keep @ cov @ keep.T + (gain * noise) @ gain.T
        return mean + gain @ miss, 0.5 * (after + after.T)

    def _smooth(self, run: _Pass) -> None:
        """Move the trajectory to the smoothed means of a pass."""
        rows = list(self._rows)
        rows[-1].node = later = run.after[-1][0]
        for k in range(len(rows) - 2, -1, -1):
            mean, cov = run.after[k]
            ahead, spread = run.ahead[k + 1]
            rows[k].node = later = mean + over(cov @ run.onward[k].T, spread) @ (later - ahead)
