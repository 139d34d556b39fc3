"""Normal equations of one problem written out: one row of derivatives for each reading, one column for each unknown."""

from __future__ import annotations

import numpy as np

from seatrial.data import Array
from seatrial.identify.trajectory.objective import TrajectoryObjective
from seatrial.simulate.lanes import Kernel, Lanes, slopes
from seatrial.simulate.loop import open_loop, open_loop_parameters


def written_out(objective: TrajectoryObjective, values: Array, eta: Array) -> tuple[float, Array, Array]:
    """Objective, Hessian and gradient (halves) by the parameters, then by the offsets of the start of each window.

    Parameters are shared by all lanes, nothing is eliminated, and no problem has a neighbour.
    """
    vector, cut, method = objective.problem.vector, objective.windows, objective.method
    ship = objective.problem.ship.having(vector.by_path(values))
    begun, n, windows = objective.layout.own.initial, len(values), len(cut.state0)
    offset, state0 = eta.reshape(windows, -1), cut.state0.copy()
    state0[:, begun] += offset
    kernel = Kernel(open_loop(ship), (), vector.paths)
    states, found = slopes(Lanes(kernel, open_loop_parameters(ship), state0, cut.series), cut.grid(method), 1)
    e = np.where(cut.scale > 0, (states[..., : cut.width] - cut.measured) * cut.scale, 0.0)
    weighted = np.where(cut.scale[..., None] > 0, found[:, :, : cut.width] * cut.scale[..., None], 0.0)
    J = np.zeros((*e.shape, n + eta.size))
    J[..., :n] = weighted[..., :n]
    for k in range(windows):
        J[k, ..., n + k * len(begun) : n + (k + 1) * len(begun)] = weighted[k][..., n + begun]
    J = J.reshape(e.size, -1)
    weight = np.append(vector.sigma, objective.layout.deviation) ** -2.0
    away = np.append(values - vector.mean, eta)
    cost = float((e**2).sum() + (weight * away**2).sum())
    return cost, J.T @ J + np.diag(weight), J.T @ e.ravel() + weight * away
