"""Nuisance parameters beside the free ones: their deviations, and those that no data tell apart from a parameter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...core.values import dataclass
from ...data import Array
from .. import Problem, StudyError, Verdict
from ..nuisance import Layout
from ..posterior import information
from ..posterior.verdicts import CORRELATED
from ..record import Settings
from ..trajectory.gauss_newton import Block, Normal
from ..trajectory.objective import TrajectoryObjective

# Least curvature of a direction, relative to that of its parameters one by one, priors included: below it sigma is a
# hundred times what it would be alone, and the model errs by more than the data could tell.
_COPY = 1e-4
# Least part in a direction without curvature of what makes it up.
_PART = 0.1


@dataclass(frozen=True)
class Beside:
    """The nuisance parameters of a fit and their covariance with the free parameters, for white residuals.

    Attributes:
        names: of errors of instruments that all trials share, then of currents and biases of trials, the latter by
            their mean over the trials.
        correlation: with each free parameter, shape (names, free).
        sigma: of the current and the biases of each trial, shape (trials, count).
    """

    names: tuple[str, ...]
    correlation: Array
    sigma: Array

    @staticmethod
    def of(objective: TrajectoryObjective, p: Array, eta: Array) -> Beside:
        """At the optimum `p`, `eta`."""
        count, layout = objective.count, objective.layout
        normal = objective.normal(p, eta)
        known, reach = objective.before(p)
        covariance = information.covariance(normal.reduced(0.0)[0] + known - objective.information, reach)
        blocks = normal.blocks if layout.own.count else ()
        own = [_own(block, layout, covariance) for block in blocks]
        # Moves of the mean over the trials with the parameters, and its variance: trials are independent but for these.
        back = sum((one[0] for one in own), np.zeros((layout.own.count, p.size))) / max(len(own), 1)
        alone = sum((one[1] for one in own), np.zeros(layout.own.count)) / max(len(own), 1) ** 2
        moves = np.concatenate([np.eye(p.size)[count:], back])
        mixed = moves @ covariance
        variance = np.einsum("ij,ij->i", mixed, moves) + np.append(np.zeros(p.size - count), alone)
        scale = np.sqrt(np.outer(np.maximum(variance, 1e-300), np.maximum(np.diag(covariance)[:count], 1e-300)))
        sigma = np.array([one[2] for one in own]).reshape(len(own), layout.own.count)
        names = (*(one.name for one in objective.common), *(f"{name} of each trial" for name in layout.own.names))
        return Beside(names, mixed[:, :count] / scale, sigma)

    def verdicts(self, paths: Sequence[str]) -> Iterator[Verdict]:
        """A verdict on each pair of a parameter and a nuisance parameter that the data hardly tell apart."""
        for name, row in zip(self.names, self.correlation.tolist(), strict=True):
            for path, c in zip(paths, row, strict=True):
                if abs(c) > CORRELATED:
                    yield Verdict(f"{path} and {name}", "weak", f"the data hardly tell them apart (correlation "
                                  f"{c:+.3f}): they fix a combination, not each of them")  # fmt: skip


def _own(block: Block, layout: Layout, covariance: Array) -> tuple[Array, Array, Array]:
    """Of one trial: moves of current and biases with the parameters, variances without them, and deviations."""
    (own,), (cross,) = block.own, block.cross
    first = len(own) - layout.own.count
    inverse: Array = np.asarray(np.linalg.inv(own), dtype=np.float64)
    back, alone = -(inverse @ cross)[first:], np.diag(inverse)[first:]
    return back, alone, np.sqrt(alone + np.einsum("ij,jk,ik->i", back, covariance, back))


def sigma_by_trial(beside: Beside, layout: Layout, trials: Sequence[str]) -> dict[str, Mapping[str, float]]:
    """Standard deviations of the current and the biases of each trial, by trial and name."""
    if not beside.sigma.size:
        return {}
    rows = zip(trials, beside.sigma.tolist(), strict=True)
    return {trial: dict(zip(layout.own.names, row, strict=True)) for trial, row in rows}


def refuse_copies(problem: Problem, settings: Settings) -> None:
    """Refuse errors of instruments that neither data nor priors tell apart from a free parameter or each other.

    Raises:
        StudyError: names the pair.
    """
    if not problem.nuisance.common or np.isfinite(list(problem.nuisance.common.values())).all():
        return
    objective = TrajectoryObjective.like(problem, settings)
    p = objective.extended(problem.vector.start, begun=True)
    with np.errstate(all="ignore"):
        normal = objective.normal(p, np.zeros(objective.nuisances))
    if not np.isfinite(normal.H).all():
        return  # the model blows up there, which the estimator reports by trial and state
    pair = _copies(normal, (*problem.vector.paths, *problem.nuisance.common), len(problem.free))
    if pair:
        remedy = f"leave one of them out, or give {pair[0]} a standard deviation"
        raise StudyError(f"[nuisance] common: no data tell {pair[0]} apart from {pair[1]}, also estimated; {remedy}")


def _copies(normal: Normal, names: Sequence[str], count: int) -> tuple[str, str] | None:
    """An error of an instrument, and the free parameter or other error that it is a copy of."""
    H, _ = normal.reduced(0.0)
    size = np.sqrt(np.maximum(np.diag(H), 0.0))
    if not (size[count:] > 0).all():
        silent = names[count + int(np.argmin(size[count:]))]
        raise StudyError(f"[nuisance] common: the data are insensitive to {silent}; leave it out")
    scaled = H / np.outer(np.where(size > 0, size, 1.0), np.where(size > 0, size, 1.0))
    weight, vectors = np.linalg.eigh(scaled)
    for k in np.flatnonzero(weight < _COPY):
        part = np.abs(vectors[:, k])
        mine = count + int(np.argmax(part[count:]))
        if part[mine] > _PART:
            part[mine] = 0.0
            return names[mine], names[int(np.argmax(part))]
    return None
