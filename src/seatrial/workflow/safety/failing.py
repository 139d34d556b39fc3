"""The search for failures of a stack: adaptive, each shrunk to its simplest form and kept as a case that runs again.

Adaptive stress testing (Lee et al. 2015, IEEE/AIAA DASC) with CMA-ES with margin (Hamano et al. 2022, GECCO; `cmaes`),
which takes conducts by number: the margins of the rules say how near a run is to a breach.  The search begins anew
where it has found a failure, or comes no nearer.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...core.files import write_whole
from ...core.records import plain, read_record
from ...core.values import dataclass, replace
from ...data import Array
from ...encounters.rules import Judged, judge
from ...encounters.sailing import Sailed
from ...encounters.space import PER_SHIP, WEATHER, Space, meeting
from ...realtime.range.encounter import LONG
from ...report.blocks import fields, lead, table
from .. import SILENT, Outcome, RequestError, Sink
from .case import Setup, broken_of, replayed
from .claimed import SCHEMA, CaseFile, Encountered, Met

_FIRST, _POPULATION, _SIGMA = 40, 20, 0.2
"""Points before each descent, points of a generation, and the first step of the search in the unit cube."""
_STILL = 4
"""Generations without progress that end a descent."""
_ROUNDS = 40
_NEAR = np.array([30.0, 0.05, np.radians(5.0)])
"""Changes of time [s], ratio of speeds and course [rad] that are not worth a step."""
_USUAL_T = 900.0

Severity = Callable[[Array], tuple[Array, list[tuple[str, ...]]]]
"""Of points: how far each is from a failure, at most zero in one; and what is broken."""


@dataclass(frozen=True, eq=False)
class Failure:
    """A failure.

    Attributes:
        point: as of `Space`; NaN for ships that are left out.
        broken: rules.
        after: runs of the search until it was found.
    """

    point: Array
    broken: tuple[str, ...]
    after: int


@dataclass(frozen=True, eq=False)
class Searched:
    """What a search found.

    Attributes:
        runs: that it took.
        failures: those that break a rule which none before them broke.
    """

    runs: int
    failures: tuple[Failure, ...]


def searched(severity: Severity, space: Space, runs: int, seed: int, *, first_only: bool = False) -> Searched:
    """Look for failures in a space.

    Args:
        runs: to spend, at most.
        first_only: end with the first.
    """
    known: list[Failure] = []
    asked, spent = _asked(space, seed), 0
    cube = next(asked)
    while spent < runs:
        cube = cube[: runs - spent]
        points = space.at(cube)
        costs, broken = severity(points)
        for k, (cost, rules) in enumerate(zip(costs, broken, strict=True)):
            if cost <= 0.0 and not set(rules) <= {rule for one in known for rule in one.broken}:
                known.append(Failure(points[k], rules, spent + k + 1))
        spent += len(cube)
        if known and first_only:
            break
        cube = asked.send(costs)
    return Searched(spent, tuple(known))


def _asked(space: Space, seed: int) -> Generator[Array, Array, None]:
    """Points of the unit cube, a generation at a time; it is sent their costs.

    The conducts are numbers to the strategy, a margin around each keeps all of them in play.
    """
    from cmaes import CMAwM

    rng, discrete = np.random.default_rng(seed), np.array(space.discrete)
    high = np.where(discrete, space.conducts - 1.0, 1.0)
    # the strategy counts conducts, the cube has a share for each
    scale = np.where(discrete, 1.0 / space.conducts, 1.0)
    middle = np.where(discrete, 0.5 / space.conducts, 0.0)
    while True:
        start = rng.random((_FIRST, len(discrete)))
        costs = yield start
        best, still = float(costs.min()), 0
        if best <= 0.0:
            continue
        mean = start[int(np.argmin(costs))]
        strategy = CMAwM(
            np.where(discrete, np.minimum(np.floor(mean * space.conducts), high), mean), _SIGMA,
            np.column_stack([np.zeros(len(high)), high]), np.where(discrete, 1.0, 0.0),
            seed=int(rng.integers(2**31)), population_size=_POPULATION,
        )  # fmt: skip
        while best > 0.0 and still < _STILL and not strategy.should_stop():
            told = [strategy.ask() for _ in range(_POPULATION)]
            costs = yield np.clip(np.array([one for one, _ in told]) * scale + middle, 0.0, 1.0)
            if len(costs) == _POPULATION:
                strategy.tell([(raw, float(cost)) for (_, raw), cost in zip(told, costs, strict=True)])
            still = 0 if costs.min() < best - 1e-3 else still + 1
            best = min(best, float(costs.min()))


def shrunk(severity: Severity, space: Space, failure: Failure, quiet: int | None) -> Failure:
    """The simplest form that still breaks one of its rules.

    Fewer ships, calm, conducts that do nothing, then the own speed, the usual time, round courses, or half way there.

    Args:
        quiet: number of the conduct that keeps course and speed; None without one.
    """
    for _ in range(_ROUNDS):
        simpler = [one for one in _simpler(failure.point, quiet) if space.holds(one)]
        if not simpler:
            break
        _, broken = severity(np.array(simpler))
        left = next((k for k, rules in enumerate(broken) if set(rules) & set(failure.broken)), None)
        if left is None:
            break
        failure = replace(failure, point=simpler[left], broken=broken[left])
    return failure


def _simpler(point: Array, quiet: int | None) -> list[Array]:
    """Forms a step simpler, the simplest first."""
    ships = (len(point) - len(WEATHER)) // len(PER_SHIP)
    there = [k for k in range(ships) if not np.isnan(point[len(PER_SHIP) * k])]
    changes: list[dict[int, float]] = []
    if len(there) > 1:
        changes += [{len(PER_SHIP) * k: np.nan} for k in there]
    changes += [{len(point) - len(WEATHER) + one: 0.0} for one in (0, 2)]
    if quiet is not None:
        changes += [{len(PER_SHIP) * k + 3: float(quiet)} for k in there]
    for share in (1.0, 0.5):
        for k in there:
            first = len(PER_SHIP) * k
            T, ratio, psi = point[first : first + 3]
            eighth = 0.25 * np.pi * np.round(psi / (0.25 * np.pi))
            away = np.array([_USUAL_T - T, 1.0 - ratio, eighth - psi])
            changes += [{first + one: point[first + one] + share * away[one]}
                        for one in range(3) if abs(away[one]) > (_NEAR[one] if share < 1.0 else 0.0)]  # fmt: skip
    made = []
    for change in changes:
        new = point.copy()
        new[list(change)] = list(change.values())
        if not np.array_equal(new, point, equal_nan=True):
            made.append(new)
    return made


@dataclass(frozen=True, eq=False)
class Sailor:
    """Sails the points of a case, on the ship as it was fitted."""

    setup: Setup
    space: Space

    @property
    def duration(self) -> float:
        """Of each run [s]."""
        return LONG * self.space.ranges.T[1]

    def sailed(self, points: Array) -> Sailed:
        """Runs of points."""
        return self.setup.at(self.space, points)

    def __call__(self, points: Array) -> tuple[Array, list[tuple[str, ...]]]:
        """See `Severity`; a run whose model fails is far from a failure of the stack."""
        sailed = self.sailed(points)
        costs: Array = np.full(len(points), 5.0)
        broken: list[tuple[str, ...]] = [()] * len(points)
        if len(sailed.runs):
            own = judge(sailed.tracks, self.setup.rules, own=True)
            costs[sailed.runs] = severities(own, float(self.setup.rules.passing.of(sailed.tracks.L.max())))
            for k, run in enumerate(sailed.runs.tolist()):
                broken[run] = broken_of(own, (k,))
        return costs, broken


def severities(own: Sequence[Judged], passing: float) -> Array:
    """How far runs are from a failure: the least margin of the rules, and where all are kept, how near ships passed.

    At most 0 where a rule is broken, at most -1 at a contact.
    """
    margin = np.min([np.where(np.isfinite(one.worst), one.worst, 1.0) for one in own], axis=0)
    near = np.min([one.at.distance for one in own], axis=0) / passing
    contact = np.any([one.contact for one in own], axis=0)
    kept = 0.5 * np.clip(margin, 0.0, 1.0) + 0.125 * np.clip(near, 0.0, 4.0) + 1e-3
    return np.where(contact, -1.0, 0.0) + np.where(margin < 0.0, np.maximum(margin, -1.0), np.where(contact, 0.0, kept))


def search(path: Path, out: Path, runs: int, *, sink: Sink = SILENT) -> Outcome[Searched]:
    """Look for failures of the stack of a case, and keep each in its simplest form as a case of its own.

    Raises:
        RequestError: what is wrong in the file, nothing that varies, or a stack that is not called.
    """
    if runs < 1:
        raise RequestError(f"--search is {runs}; a number of runs from 1 on, such as 500")
    file = read_record(path, CaseFile, SCHEMA)
    setup = Setup.of(file, path.parent)
    sailor = Sailor(setup, setup.space)
    setup.called  # noqa: B018 -- refuses a wire before anything is sailed
    if not sailor.space.free:
        raise RequestError(f"{path}: nothing varies in these encounters; there is nothing to search")
    found = searched(sailor, sailor.space, runs, file.seed)
    sink.note(f"{found.runs} runs, {len(found.failures)} kinds of failure")
    quiet = file.traffic.index("ignores") if "ignores" in file.traffic else None
    kept: list[tuple[str, ...]] = []
    for number, one in enumerate(found.failures, 1):
        simple = shrunk(sailor, sailor.space, one, quiet)
        made = out / f"failure-{number}.toml"
        _keep(file, path, sailor, simple, made)
        sink.note(f"wrote {made}")
        ships = int(np.sum(~np.isnan(simple.point[: -len(WEATHER) : len(PER_SHIP)])))
        kept.append((", ".join(one.broken), str(one.after), ", ".join(simple.broken), str(ships), made.name))
    said = {"schema": "seatrial-case-search/1", "runs": found.runs, "seed": file.seed, "failures": [
        {"broken": list(one.broken), "after": one.after, "file": row[-1]}
        for one, row in zip(found.failures, kept, strict=True)
    ]}  # fmt: skip
    body = lead(f"{found.runs} runs searched: {len(kept)} kinds of failure" if kept else
                f"no failure found in {found.runs} runs; that shows no more than that")  # fmt: skip
    if kept:
        body += table(("broken", "found in run", "in its simplest form", "ships", "file"), kept, words=(0, 2, 4),
                      wide=True)  # fmt: skip
    return Outcome(found, fields(said, body))


def _keep(file: CaseFile, path: Path, sailor: Sailor, failure: Failure, made: Path) -> None:
    """Write a failure as a case of one run, with what its own file gives when it is run."""
    import tomlkit

    point, met = failure.point, meeting(failure.point[None], sailor.space.U)
    there = [k for k in range(len(sailor.space.roles)) if not np.isnan(point[len(PER_SHIP) * k])]
    ships = tuple(Met(x=float(met.x[0, k]), y=float(met.y[0, k]), psi=float(met.psi[0, k]),
                      U=float(met.U_target[0, k]), conduct=file.traffic[int(point[len(PER_SHIP) * k + 3])])
                  for k in there)  # fmt: skip
    weather = replace(file.weather, **{name: (float(value),) * 2
                                       for name, value in zip(WEATHER, point[-len(WEATHER) :], strict=True)})

    def beside(said: str) -> str:
        named = path.parent / said.partition(":")[0]
        return os.path.relpath(named, made.parent) + "".join(said.partition(":")[1:]) if named.is_file() else said

    one = replace(
        file, claim=f"{file.claim} (a failure: {', '.join(failure.broken)})", ship=beside(file.ship),
        stack=beside(file.stack) if isinstance(file.stack, str) else
        replace(file.stack, file=beside(file.stack.file)), weather=weather, as_fitted=True, found=None,
        encounters=Encountered(set="given", ships=ships, length=file.encounters.length, duration=sailor.duration),
    )  # fmt: skip
    made.parent.mkdir(parents=True, exist_ok=True)
    again = replayed(Setup.of(one, made.parent))
    if not set(again.broken) & set(failure.broken):
        raise RequestError(f"{made.name}: a failure of Rules {', '.join(failure.broken)} is not there when it is run "
                           "alone; the stack decides by more than the scenes of its run")  # fmt: skip
    text = {"schema": SCHEMA, **_told(plain(replace(one, found=again)))}
    write_whole(made, tomlkit.dumps(text))


def _told(table_: Any) -> Any:
    """Without what is not given; TOML has no null."""
    if isinstance(table_, dict):
        return {key: _told(value) for key, value in table_.items() if value is not None}
    return [_told(one) for one in table_] if isinstance(table_, list | tuple) else table_
