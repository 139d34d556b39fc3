"""Posterior of a hybrid with random hidden units added, to represent what its correction could not learn.

A posterior covers only the terms of its model, and is too narrow where the model lacks some.  So a hybrid receives
hidden units with random weights, whose outputs are zero in the fit and free in its posterior.  Where there are trials
they determine the outputs; elsewhere nothing does, and members drawn from the posterior diverge (randomised priors,
Osband, Aslanides and Cassirer 2018).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..core.parameters import Free, Terms
from ..data import Array
from ..identify import Fit, Problem
from ..identify.posterior.verdicts import posterior
from ..identify.record import cut_as
from ..identify.trajectory.objective import TrajectoryObjective
from ..identify.trajectory.shooting import Trajectory
from ..models.hybrid import Hybrid
from ..ships import Ship

UNITS = 12
WIDTH = 0.3
"""Prior deviation of an output over the typical force: the size of the polynomial weights that trials leave."""

_TERMS = ("u", "v", "r", "n", "d_n", "d_N", "a", "b")


def freer(fit: Fit, problem: Problem, estimator: Trajectory, *, seed: int = 0) -> tuple[Ship, tuple[Free, ...], Array]:
    """The fitted hybrid with random units, its free parameters with their outputs, and the posterior of all.

    Args:
        fit: of `problem` by `estimator`; its ship is a hybrid.
        problem: the problem that was fitted.
        estimator: how the trials were cut and compared.
        seed: of the units.

    Returns:
        ship, free parameters and their covariance, shape (free, free).
    """
    ship, extra = with_units(fit.ship, UNITS, seed)
    free = (*fit.free, *extra)
    wide = replace(problem, ship=ship, free=free, validation=())
    sigma, arguments = cut_as(problem, estimator)
    objective = TrajectoryObjective.build(wide, problem.trials, sigma, **arguments, stride=estimator.stride)
    p, eta = np.append(fit.values, np.zeros(len(extra))), np.zeros(objective.nuisances)
    covariance, _ = posterior(objective.normal(p, eta), free, p, objective.variance(p, eta))
    return ship, free, covariance


def with_units(ship: Ship, count: int, seed: int, width: float = WIDTH) -> tuple[Ship, tuple[Free, ...]]:
    """The ship with `count` more hidden units of random weights and zero outputs, and these outputs as parameters.

    Args:
        ship: a hybrid.
        count: number of units.
        seed: of their weights.
        width: prior deviation of the outputs.
    """
    model = ship.model
    if not isinstance(model, Hybrid):
        raise TypeError(f"{ship.name} is no hybrid: it has no hidden units")
    rng = np.random.default_rng(seed)
    taken = {name.partition("_")[0] for name in model.unit_in.names}
    free = [f"h{k}" for k in range(1, len(taken) + count + 1) if f"h{k}" not in taken][:count]
    inward = {f"{unit}_{term}": float(rng.normal()) for unit in free for term in (*_TERMS, "0")}
    outward = tuple(f"{unit}_{axis}" for unit in free for axis in "XYN")
    silent = dict.fromkeys(outward, 0.0)
    made = replace(model, unit_in=_more(model.unit_in, inward), unit_out=_more(model.unit_out, silent))
    return replace(ship, model=made), tuple(Free(f"unit_out.{n}", 0.0, prior=0.0, sigma=width) for n in outward)


def _more(terms: Terms, added: dict[str, float]) -> Terms:
    return Terms((*terms.names, *added), (*terms.numbers, *added.values()))
