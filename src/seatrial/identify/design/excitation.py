"""Excitation design: choice of the manoeuvres that are most informative about chosen parameters.

Each candidate is simulated, and the exact sensitivities of the replayed run to the free parameters
give its Fisher information, the initial state of every window being unknown too.  A set is chosen greedily so
that the determinant of the posterior precision is greatest (D-optimal) within a budget of dimensionless
length T' = T V/L (Sawada 2024 Eq. 33).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...core.parameters import Free, Spec, match, walk
from ...data import Array, Trial
from ...engine import SimulationError
from ...engine.rollout import sensitivity
from ...manoeuvres import Policy
from ...models import STATES, Sampled
from ...ships import Ship
from ...simulate.approach import substeps
from ...simulate.loop import open_loop, open_loop_parameters
from ...simulate.run import simulate, time_step
from .. import Loss, StudyError
from ..record import windows
from ..vector import Vector
from .optimal import Information, Plan, before, choose, expected

# Default number of independent readings per L/U, and default length of a window in L/U.
_READINGS, _WINDOW = 10.0, 10.0


@dataclass(frozen=True)
class Published:
    """Training data of a published identification.

    Attributes:
        reference: number in the list of Sawada 2024.
        model: what was identified, with `parameters` unknowns.
        manoeuvres: Z zigzag, T turning, R random, PRS pseudo-random sequence.
        length: T' from the shortest to the longest data set.
    """

    reference: int
    model: str
    parameters: tuple[int, ...]
    manoeuvres: str
    length: tuple[float, float]


TABLE_1 = (
    Published(104, "KT", (2,), "Z", (14.0, 14.0)),
    Published(69, "whole ship, linear", (15,), "Z", (17.7, 17.7)),
    Published(105, "MMG", (21, 30), "Z, T", (8.8, 50.8)),
    Published(106, "whole ship", (7, 18), "m-level PRS", (25.9, 25.9)),
    Published(73, "MMG", (57,), "Z, T, R", (258.0, 269.5)),
    Published(65, "RNN", (122600,), "Z, T, R", (256.3, 256.3)),
)
"""Data sets of relevant identification studies: Sawada 2024 Table 1."""


@dataclass(frozen=True)
class Candidate:
    """A manoeuvre that may be run: its name in the plan, its policy, its duration and its initial speed.

    Attributes:
        duration: length of the run [s].
        speed: initial speed [m/s].
    """

    name: str
    policy: Policy
    duration: float
    speed: float


def dimensionless_length(trials: Iterable[Trial], V: float, L: float) -> float:
    """T' = T V/L of a set of trials (Sawada 2024 Eq. 33).

    Args:
        trials: the data set; T is the sum of their durations [s].
        V: representative speed: the initial one of turns and zigzags, of Fr = 0.05 in harbour [m/s].
        L: length of the ship [m].

    Raises:
        StudyError: a speed or length that is not above zero.
    """
    if not (V > 0 and L > 0):
        raise StudyError(f"V is {V:g} m/s and L {L:g} m; both must be above zero")
    return sum(trial.duration for trial in trials) * V / L


def usual_noise(ship: Ship) -> dict[str, float]:
    """Assumed noise of good sensors on a ship of this size and speed, by channel, SI units."""
    rate = ship.speed / ship.L_pp
    return {"x": 3e-3 * ship.L_pp, "y": 3e-3 * ship.L_pp, "psi": math.radians(0.1),
            "u": 5e-3 * ship.speed, "v_m": 5e-3 * ship.speed, "r": 5e-3 * rate}  # fmt: skip


def wanted(ship: Ship, paths: Sequence[str | Free]) -> tuple[Free, ...]:
    """The free parameters: patterns of paths (``hull.*``) with a prior as wide as their own value, or `Free`.

    A parameter of zero takes the median magnitude of those beside it as its prior deviation.

    Raises:
        ParameterError: a path that the model lacks.
    """
    known = {path: (meaning, float(value)) for path, meaning, value in walk(ship.model)}
    found: dict[str, Free] = {}
    for wish in paths:
        if isinstance(wish, Free):
            match(ship.model, wish.path)
            found[wish.path] = wish
            continue
        for path in match(ship.model, wish):
            meaning, value = known[path]
            found[path] = Free(path, value, meaning.low, meaning.high, value, abs(value) or _usual_size(path, known))
    return tuple(found.values())


def _usual_size(path: str, known: Mapping[str, tuple[Spec, float]]) -> float:
    """Median magnitude of the parameters of the same component that are not zero."""
    component = path.rpartition(".")[0]
    sizes = [abs(value) for name, (_, value) in known.items() if name.rpartition(".")[0] == component and value]
    return float(np.median(sizes)) if sizes else 1.0


def informations(
    ship: Ship, free: Sequence[Free], runs: Sequence[tuple[Trial, float]], noise: Mapping[str, float], *,
    interval: float | None = None, window: float | None = None, threads: int | None = None,
) -> tuple[Information, ...]:  # fmt: skip
    """Fisher information of each run about the free parameters.

    The run is replayed in windows from its own controls; the state at the start of each window is unknown
    but for the readings in it, as in a fit with `Nuisance.initial`.

    Args:
        runs: trials on even steps, each with the speed that makes its T'.
        noise: standard deviation of the readings of each state that is measured.
        interval: time between independent readings [s]; None takes a tenth of L/U.
        window: length of a window [s]; None takes ten L/U.

    Raises:
        StudyError: no noise, or of a channel that is no state; a model in discrete time.
    """
    if not noise or not all(name in STATES and 0 < value < math.inf for name, value in noise.items()):
        raise StudyError(f"noise: give deviations above zero for some of {', '.join(STATES)}")
    if isinstance(ship.model, Sampled):
        raise StudyError(f"{ship.name}: a model in discrete time has no sensitivities to design by")
    rate, dt = ship.speed / ship.L_pp, runs[0][0].dt
    every = max(round((interval or 1.0 / (_READINGS * rate)) / dt), 1)
    cut = windows(
        [run for run, _ in runs], ship.model, Loss(noise, correlation=0.0), noise,
        window=window or _WINDOW / rate, dt=dt, every=every, substeps=substeps(ship, dt),
    )  # fmt: skip
    values = open_loop_parameters(ship)
    system = open_loop(ship)
    vector = Vector.of(free)
    values[vector.positions(system.parameters)] = vector.start
    _, slopes = sensitivity(system, vector.paths).run(
        cut.state0, cut.series, values, dt=cut.dt, steps=cut.steps, every=cut.every, method="rk4", threads=threads
    )
    weighted = slopes[:, :, : len(STATES)] * cut.scale[..., None]
    matrix = np.array([_reduced(lane[cut.scale[k] > 0], len(free)) for k, lane in enumerate(weighted)])
    return tuple(
        Information(run.name, matrix[cut.trial == k].sum(axis=0), dimensionless_length([run], V, ship.L_pp))
        for k, (run, V) in enumerate(runs)
    )


def _reduced(J: Array, n: int) -> Array:
    """Information of the first `n` columns, the others (the initial state) unknown and eliminated.

    Args:
        J: weighted derivatives, one row per reading; columns are parameters, then initial states.
    """
    of_interest, nuisance = J[:, :n], J[:, n:]
    span, size, _ = np.linalg.svd(nuisance, full_matrices=False)
    span = span[:, size > 1e-9 * max(float(size.max(initial=0.0)), 1e-300)]
    rest = of_interest - span @ (span.T @ of_interest)
    return rest.T @ rest


def plan(
    ship: Ship, free: Sequence[Free], candidates: Sequence[Candidate], budget: float, *,
    noise: Mapping[str, float] | None = None, interval: float | None = None, window: float | None = None,
    repeats: int = 1,
) -> Plan:  # fmt: skip
    """Choose a set of manoeuvres for the free parameters within a budget of T'.

    Args:
        candidates: what may be run; see `candidates.usual`.
        budget: greatest T' of the set.
        noise: standard deviation of the readings by channel; None takes `usual_noise`.
        interval, window: see `informations`.
        repeats: how often one manoeuvre may be run.

    Raises:
        StudyError: no parameter, no candidate that can be run, or none that fits the budget.
    """
    if not free:
        raise StudyError("free: no free parameter to design for")
    runs, left_out = _runs(ship, candidates)
    if not runs:
        raise StudyError(f"{ship.name}: no candidate can be run; {left_out[0] if left_out else 'none was given'}")
    found = informations(ship, free, runs, noise or usual_noise(ship), interval=interval, window=window)
    blown = [one.name for one in found if not np.isfinite(one.matrix).all()]
    left_out += [f"{name}: its sensitivities are not finite" for name in blown]
    found = [one for one in found if one.name not in blown]
    shortest = min((one.length for one in found), default=math.inf)
    if not shortest <= budget:
        raise StudyError(f"budget: T' = {budget:g} is less than the shortest candidate's, {shortest:.3g}")
    prior = before(free)
    order, reached = choose(found, prior, budget, repeats=repeats)
    return replace(expected(free, [found[k] for k in order], reached), left_out=tuple(left_out))


def _runs(ship: Ship, candidates: Sequence[Candidate]) -> tuple[list[tuple[Trial, float]], list[str]]:
    runs: list[tuple[Trial, float]] = []
    left_out: list[str] = []
    dt = time_step(ship)
    for one in candidates:
        try:
            run = simulate(ship, one.policy, speed=one.speed, duration=one.duration, dt=dt, name=one.name)
        except SimulationError as error:
            left_out.append(f"{one.name}: {error}")
            continue
        runs.append((run, one.speed))
    return runs, left_out
