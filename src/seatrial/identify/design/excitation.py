"""Excitation design: choice of the manoeuvres that are most informative about chosen parameters.

Each candidate (`usual` gives turns, zigzags and random runs) is simulated, and the exact sensitivities of the replayed
run to the free parameters give its Fisher information, the initial state of every window being unknown too.  A set is
chosen greedily so that the determinant of the posterior precision is greatest (D-optimal) within a budget of
dimensionless length T' = T V/L (Sawada 2024 Eq. 33).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ...core.parameters import Free, Spec, match, walk
from ...core.values import dataclass, field, replace
from ...data import Array, Trial
from ...engine import SimulationError
from ...manoeuvres import Policy, Settings
from ...manoeuvres.human_random import HumanRandom
from ...manoeuvres.pseudo_random import PseudoRandom
from ...manoeuvres.turning import Turning
from ...manoeuvres.zigzag import Zigzag
from ...models import STATES, Sampled
from ...ships import Ship
from ...simulate.approach import substeps
from ...simulate.lanes import Kernel, Lanes, slopes
from ...simulate.loop import open_loop, open_loop_parameters
from ...simulate.run import approach, simulate, time_step
from .. import Loss, StudyError, Verdict
from ..posterior.verdicts import CLEAR, UNKNOWN, manoeuvre_for
from ..record import windows
from ..vector import Vector

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
    lanes = Lanes(Kernel(system, free=vector.paths), values, cut.state0, cut.series)
    _, found = slopes(lanes, cut.grid("rk4"), threads)
    weighted = found[:, :, : cut.width] * cut.scale[..., None]
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
        candidates: what may be run; see `usual`.
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
    runs, left_out, dt = list[tuple[Trial, float]](), list[str](), time_step(ship)
    for one in candidates:
        try:
            run = simulate(ship, one.policy, speed=one.speed, duration=one.duration, dt=dt, name=one.name)
            runs.append((run, one.speed))
        except SimulationError as error:
            left_out.append(f"{one.name}: {error}")
    return runs, left_out


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
        information: Fisher information of all manoeuvres together, shape (free, free).
    """

    chosen: tuple[tuple[str, float, float], ...]
    length: float
    log_det: float
    free: tuple[Free, ...]
    sigma: Array
    share: Array
    verdicts: tuple[Verdict, ...]
    left_out: tuple[str, ...] = ()
    information: Array = field(default_factory=lambda: np.zeros((0, 0)))


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
    parts = [prior[:, None] * one.matrix * prior[None, :] for one in runs]
    scaled = sum(parts, np.zeros((len(free),) * 2))
    if not reached:
        reached = [_log_det(np.eye(len(free)) + total) for total in np.cumsum(parts, axis=0)]
    weight, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    weight = np.maximum(weight, 0.0)
    left = np.clip(np.einsum("ik,k,ik->i", vectors, 1.0 / (1.0 + weight), vectors), 0.0, 1.0)
    gains = np.diff(np.array([0.0, *reached]))
    return Plan(
        tuple((one.name, one.length, float(gain)) for one, gain in zip(runs, gains, strict=True)),
        sum(one.length for one in runs), float(reached[-1]) if reached else 0.0, tuple(free),
        prior * np.sqrt(left), 1.0 - left,
        (*_singles(free, prior * np.sqrt(left), 1.0 - left), *_combinations(free, prior, weight, vectors)),
        information=sum((one.matrix for one in runs), np.zeros((len(free),) * 2)),
    )  # fmt: skip


def before(free: Sequence[Free]) -> Array:
    """Standard deviation before the data; a parameter with neither prior nor interval takes its own size."""
    vector = Vector.of(free)
    return np.where(np.isfinite(vector.variance), np.sqrt(vector.variance), np.maximum(np.abs(vector.start), 1e-12))


def _singles(free: Sequence[Free], sigma: Array, share: Array) -> list[Verdict]:
    out: list[Verdict] = []
    for f, s, part in zip(free, sigma.tolist(), share.tolist(), strict=True):
        status = "identified" if part >= CLEAR else "weak" if part >= UNKNOWN else "not identified"
        text = f"+- {s:.2g} expected about {f.start:.4g}; the data would remove {part:.0%} of the prior variance"
        out.append(Verdict(f.path, status, text + ("" if part >= CLEAR else f"; {manoeuvre_for(f.path)} would help")))
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


# T' of each kind: a turn of some 540 deg, a zigzag to its fourth overshoot, a stretch of a random run.
_TURN, _ZIGZAG, _RANDOM = 12.0, 15.0, 25.0
_SLOW = 0.6


def usual(ship: Ship, seeds: int = 2) -> tuple[Candidate, ...]:
    """Turns, zigzags and random runs, both sides, at the approach's revolutions and at 60 % of them.

    Args:
        seeds: how many random runs of each kind.
    """
    U, n_P = approach(ship)
    limit = float(ship.actuators.rudder.high)
    settings = Settings(n_P, U, ship.L_pp, limit)
    found = [*_standard(settings, ""), *_random(settings, seeds)]
    if n_P > 0:
        slow, n_slow = approach(ship, n_P=_SLOW * n_P)
        found += _standard(replace(settings, n_P=n_slow, speed=slow), ", slow")
    return tuple(found)


def _standard(settings: Settings, suffix: str) -> list[Candidate]:
    out: list[Candidate] = []
    for word, side in (("starboard", 1.0), ("port", -1.0)):
        for degrees in (35.0, 15.0, 20.0, 10.0):
            angle = math.radians(degrees)
            asked = replace(settings, side=side, rudder=min(angle, settings.rudder_limit))
            name, policy, length = f"turning {degrees:g}", Turning.ordered(asked), _TURN
            if degrees in (20.0, 10.0):
                policy, length = Zigzag.ordered(replace(asked, heading=angle)), _ZIGZAG
                name = f"zigzag {degrees:g}/{degrees:g}"
            out.append(_candidate(f"{name} {word}{suffix}", policy, settings, length))
    return out


def _random(settings: Settings, seeds: int) -> list[Candidate]:
    out: list[Candidate] = []
    for seed in range(1, seeds + 1):
        asked = replace(settings, seed=seed)
        ahead = replace(HumanRandom.ordered(asked), astern=0.0)
        out.append(_candidate(f"pseudo-random, seed {seed}", PseudoRandom.ordered(asked), settings, _RANDOM))
        out.append(_candidate(f"random, seed {seed}", HumanRandom.ordered(asked), settings, _RANDOM))
        out.append(_candidate(f"random, ahead only, seed {seed}", ahead, settings, _RANDOM))
    return out


def _candidate(name: str, policy: Policy, settings: Settings, length: float) -> Candidate:
    return Candidate(name, policy, length * settings.L_pp / settings.speed, settings.speed)
