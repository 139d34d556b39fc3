"""Choice of a set of runs by Fisher information: greedy D-optimal design, and the expected result of a set.

Pure linear algebra on Fisher matrices; `excitation` computes those from simulated runs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ...core.parameters import Free
from ...data import Array
from .. import Verdict
from ..posterior.verdicts import CLEAR, UNKNOWN, manoeuvre_for
from ..vector import Vector

# A parameter shows in a direction that the data leave open with this much of the unit vector.
_SHOWS = 0.3
# A direction in which the data outweigh the prior less than this is open.
_OPEN = 1.0


@dataclass(frozen=True)
class Information:
    """One run: `matrix` is its Fisher information, shape (free, free); `length` is its T'."""

    name: str
    matrix: Array
    length: float


@dataclass(frozen=True)
class Plan:
    """A set of manoeuvres and its expected result.

    Attributes:
        chosen: names in the order of choice, each with its T' and the log det that it adds.
        length: T' of all together.
        log_det: of the posterior precision relative to the prior, in nats; 0 where nothing is learned.
        free: the parameters.
        sigma: expected standard deviation of each, prior included.
        share: share of each prior variance that the data remove.
        verdicts: each parameter, then each combination that stays undetermined.
        left_out: candidates that could not be run, with the reason.
    """

    chosen: tuple[tuple[str, float, float], ...]
    length: float
    log_det: float
    free: tuple[Free, ...]
    sigma: Array
    share: Array
    verdicts: tuple[Verdict, ...]
    left_out: tuple[str, ...] = field(default=())


def choose(
    found: Sequence[Information], prior: Array, budget: float, *, repeats: int = 1
) -> tuple[tuple[int, ...], tuple[float, ...]]:
    """Greedy D-optimal choice: which runs, in order, and the log det after each.

    Done twice, by what a run adds and by what it adds per length, and the better set is taken: the
    first alone spends the budget on long runs, the second on short ones.

    Args:
        prior: standard deviation of each parameter before the data.
        budget: greatest T' of the set.
        repeats: how often one manoeuvre may be run.
    """
    scaled = [prior[:, None] * one.matrix * prior[None, :] for one in found]
    lengths = [one.length for one in found]
    plans = [_greedy(scaled, lengths, budget, repeats, per_length) for per_length in (True, False)]
    return max(plans, key=lambda plan: plan[1][-1] if plan[1] else 0.0)


def _greedy(
    scaled: Sequence[Array], lengths: Sequence[float], budget: float, repeats: int, per_length: bool
) -> tuple[tuple[int, ...], tuple[float, ...]]:
    chosen: list[int] = []
    reached: list[float] = []
    total, left = np.eye(len(scaled[0])), budget * (1 + 1e-9)
    while True:
        open_ = [k for k, length in enumerate(lengths) if length <= left and chosen.count(k) < repeats]
        if not open_:
            return tuple(chosen), tuple(reached)
        base = _log_det(total)
        gain = {k: (_log_det(total + scaled[k]) - base) / (lengths[k] if per_length else 1.0) for k in open_}
        best = max(gain, key=lambda k: gain[k])
        chosen.append(best)
        total, left = total + scaled[best], left - lengths[best]
        reached.append(_log_det(total))


def _log_det(matrix: Array) -> float:
    return float(np.linalg.slogdet(matrix)[1])


def expected(free: Sequence[Free], runs: Sequence[Information], reached: Sequence[float] = ()) -> Plan:
    """Expected result of a given set of runs, in this order.

    Args:
        reached: the log det after each run, where it is known already.
    """
    prior = before(free)
    scaled = sum((prior[:, None] * one.matrix * prior[None, :] for one in runs), np.zeros((len(free),) * 2))
    if not reached:
        sums = np.cumsum([prior[:, None] * one.matrix * prior[None, :] for one in runs], axis=0)
        reached = [_log_det(np.eye(len(free)) + total) for total in sums]
    weight, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    weight = np.maximum(weight, 0.0)
    left = np.clip(np.einsum("ik,k,ik->i", vectors, 1.0 / (1.0 + weight), vectors), 0.0, 1.0)
    gains = np.diff(np.array([0.0, *reached]))
    return Plan(
        tuple((one.name, one.length, float(gain)) for one, gain in zip(runs, gains, strict=True)),
        sum(one.length for one in runs), float(reached[-1]) if reached else 0.0, tuple(free),
        prior * np.sqrt(left), 1.0 - left,
        (*_singles(free, prior * np.sqrt(left), 1.0 - left), *_combinations(free, prior, weight, vectors)),
    )  # fmt: skip


def before(free: Sequence[Free]) -> Array:
    """Standard deviation before the data; a parameter with neither prior nor interval takes its own size."""
    variance, own = Vector.of(free).variance, np.maximum(np.abs(Vector.of(free).start), 1e-12)
    return np.where(np.isfinite(variance), np.sqrt(variance), own)


def _singles(free: Sequence[Free], sigma: Array, share: Array) -> list[Verdict]:
    out: list[Verdict] = []
    for f, s, part in zip(free, sigma.tolist(), share.tolist(), strict=True):
        status = "identified" if part >= CLEAR else "weak" if part >= UNKNOWN else "not identified"
        told = f"+- {s:.2g} expected about {f.start:.4g}; the data would remove {part:.0%} of the prior variance"
        more = "" if part >= CLEAR else f"; {manoeuvre_for(f.path)} would help"
        out.append(Verdict(f.path, status, told + more))
    return out


def _combinations(free: Sequence[Free], prior: Array, weight: Array, vectors: Array) -> list[Verdict]:
    """One verdict per direction that the data leave open and in which more than one parameter takes part."""
    out: list[Verdict] = []
    for k in np.flatnonzero(weight < _OPEN):
        direction: list[float] = vectors[:, k].tolist()
        parts = sorted((i for i, v in enumerate(direction) if abs(v) > _SHOWS), key=lambda i: -abs(direction[i]))
        if len(parts) < 2:
            continue
        sign = math.copysign(1.0, direction[parts[0]])
        moves = [(free[i].path, sign * direction[i] * float(prior[i])) for i in parts]
        words = " and ".join(f"{path} {'rises' if by > 0 else 'falls'} by {abs(by):.2g}" for path, by in moves)
        out.append(Verdict(
            " and ".join(path for path, _ in moves), "not identified",
            f"the runs hardly change while {words}: they fix other combinations, not this one",
        ))  # fmt: skip
    return out
