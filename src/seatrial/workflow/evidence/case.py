"""A safety case: one stack in many encounters, on a ship whose error is known, and what may be said of it.

Each run draws the ship from the posterior of its fit, the other ships' conducts and the weather; the tracks are judged
by the rules of the road.  Parts of the runs lie in the folder as they end, so that a case which is cut off goes on.
"""

from __future__ import annotations

import importlib.util
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Annotated, Literal, cast

import numpy as np

from ...belief.posterior import Posterior
from ...belief.reading import posterior
from ...campaign.analysis.proportion import Proportion
from ...campaign.running import Shard
from ...core import executors
from ...core.files import held_alone, write_whole
from ...core.records import Limits, NotNegative, Positive, digest, from_json, json_of, read_record, to_json
from ...data import Array
from ...encounters.conduct import CONDUCTS
from ...encounters.meeting import Meeting, dnv, drawn, imazu
from ...encounters.rules import Judged, Role, judge
from ...encounters.rules import Limits as Rules
from ...encounters.sailing import Command, Sailed, Sea, sail
from ...environment import Environment
from ...identify import StudyError
from ...report.blocks import Body, bullets, fields, lead, number, soft, table
from ...report.judging.encounter import shown
from ...report.page import Page, Section, write
from ...ships import Ship
from ...simulate.approach import approach
from .. import SILENT, Outcome, RequestError, Sink
from ..request import ship_of

SCHEMA, PART = "seatrial-case/1", "seatrial-case-part/1"
_TOGETHER = 1000
"""Runs of a part."""
_PICTURES = 4
_LONG = 2.2
"""A run lasts so many times the latest meeting."""
CONTACT = "contact"
RoleName = Literal["head-on", "give-way", "stand-on", "overtaking", "overtaken"]


@dataclass(frozen=True, kw_only=True)
class Encountered:
    """What is met: drawn by role of the own ship towards each other one, or a fixed set."""

    set: Literal["drawn", "imazu", "dnv"] = "drawn"
    roles: tuple[RoleName, ...] = ("head-on", "give-way", "stand-on")
    runs: Annotated[int, Limits(least=1, most=1_000_000)] = 1000
    length: Positive | None = None


@dataclass(frozen=True, kw_only=True)
class Around:
    """Least and greatest true wind and current, from any direction [m/s]."""

    wind: tuple[NotNegative, NotNegative] = (0.0, 0.0)
    current: tuple[NotNegative, NotNegative] = (0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class CaseFile:
    """A case as its file has it; `stack` and `traffic` are conducts, a stack also FILE.py:NAME of one's own."""

    claim: str
    ship: str
    stack: str = "rules"
    seed: Annotated[int, Limits(least=0)] = 1
    traffic: tuple[str, ...] = ("rules", "ignores", "late")
    encounters: Encountered = field(default_factory=Encountered)
    weather: Around = field(default_factory=Around)


@dataclass(frozen=True)
class Part:
    """What became of some runs.

    Attributes:
        first: number of the first run.
        broken: rules that the own ship did not keep, by run; `CONTACT` among them; None where the model failed.
        judged: rules that applied to it, by run.
        plain: the same as `broken` on the ship as it was fitted, without a draw; empty where there is no posterior.
    """

    case: str
    first: int
    broken: tuple[tuple[str, ...] | None, ...]
    judged: tuple[tuple[str, ...], ...]
    plain: tuple[tuple[str, ...] | None, ...] = ()


@dataclass(frozen=True)
class Case:
    """A case that was run.

    Attributes:
        file: what was asked for.
        digest: of all that decides the runs.
        parts: of its runs, in order.
        posterior: digest of the fit from which ships were drawn; empty without one.
    """

    file: CaseFile
    digest: str
    parts: tuple[Part, ...]
    posterior: str

    @property
    def broken(self) -> list[tuple[str, ...] | None]:
        """By run."""
        return [one for part in self.parts for one in part.broken]

    def share(self, rule: str) -> Proportion:
        """Of the runs to which a rule applied (contact: all), those that broke it."""
        rows = [(one, judged) for part in self.parts
                for one, judged in zip(part.broken, part.judged, strict=True) if one is not None]  # fmt: skip
        mine = [one for one, judged in rows if rule == CONTACT or rule in judged]
        return Proportion(sum(rule in one for one in mine), len(mine))


def case(
    path: Path, out: Path, *, workers: int = 1, shard: str | None = None, dask: str | None = None, sink: Sink = SILENT
) -> Outcome[Case]:  # fmt: skip
    """Run a case, or go on with it, and write its page and numbers into a folder.

    Args:
        workers: processes that compute, of this machine.
        shard: ``K/N``, the parts of this call among N that share the folder; the one that finds all writes the page.
        dask: a scheduler whose workers compute instead, or ``local:N``; they find the case under the same path.

    Raises:
        RequestError: what is wrong in the file, or a folder of another case.
        BusyError: another process computes the same shard of this folder.
    """
    file = read_record(path, CaseFile, SCHEMA)
    setup, mine = Setup.of(file, path.parent), Shard() if shard is None else Shard.read(shard)
    firsts = range(0, setup.runs, _TOGETHER)
    out.mkdir(parents=True, exist_ok=True)
    with held_alone(out / ".shards" / f"{mine.index + 1}-of-{mine.count}"):
        known = {first: part for first in firsts if (part := _read(out, first, setup.digest))}
        own = mine.of(list(range(len(firsts))))
        todo = [firsts[k] for k in own if firsts[k] not in known]
        for part in _computed(path, setup, todo, workers, dask, sink):
            write_whole(_place(out, part.first), to_json(part, PART))
            known[part.first] = part
            sink.note(f"runs {part.first + 1} to {part.first + len(part.broken)} of {setup.runs}")
        known |= {first: part for first in firsts if first not in known and (part := _read(out, first, setup.digest))}
    parts = tuple(known[first] for first in firsts if first in known)
    found = Case(file, setup.digest, parts, setup.posterior.digest if setup.posterior else "")
    if len(parts) < len(firsts):
        said = f"{len(parts)} of {len(firsts)} parts are there; the page is written by the shard that ends last"
        document = {"schema": SCHEMA, "digest": setup.digest, "parts": len(parts), "of": len(firsts)}
        return Outcome(found, fields(document, lead(said)))
    write(out / "case.html", _page(found, setup, path))
    sink.note(f"wrote {out / 'case.html'}")
    return Outcome(found, fields(_document(found), _answer(found) + _results(found)))


def _computed(
    path: Path, setup: Setup, firsts: Sequence[int], workers: int, dask: str | None, sink: Sink
) -> Iterator[Part]:
    """Parts as they are done: here, or by processes or a cluster, which read the case anew."""
    if not dask and min(workers, len(firsts)) < 2:
        yield from (_part(setup, first) for first in firsts)
        return
    pieces = ((path.resolve(), setup.digest, first) for first in firsts)
    with executors.dask(dask, sink.note) if dask else executors.processes(min(workers, len(firsts))) as pool:
        yield from pool.each(part_of, pieces)


def part_of(path: Path, mark: str, first: int) -> Part:
    """Some runs of a case, of a file and its stack that are still the same.

    Raises:
        RequestError: they have changed.
    """
    setup = _setup(path, mark)
    if setup.digest != mark:
        raise RequestError(f"{path}: the case has changed while its runs were made; run it again")
    return _part(setup, first)


@lru_cache(maxsize=1)
def _setup(path: Path, mark: str) -> Setup:
    return Setup.of(read_record(path, CaseFile, SCHEMA), path.parent)


@dataclass(frozen=True, eq=False)
class Setup:
    """All that runs need."""

    file: CaseFile
    ship: Ship
    posterior: Posterior | None
    meeting: Meeting
    stack: str | Command
    rules: Rules
    digest: str

    @property
    def runs(self) -> int:
        return len(self.meeting.x)

    @staticmethod
    def of(file: CaseFile, folder: Path) -> Setup:
        ship = ship_of(folder / file.ship if file.ship.endswith(".toml") else file.ship)
        for name in file.traffic:
            _conduct(name, "traffic")
        if not file.traffic:
            raise RequestError("traffic: name a conduct at least; 'ignores' keeps course and speed")
        for what, (low, high) in (("wind", file.weather.wind), ("current", file.weather.current)):
            if low > high:
                raise RequestError(f"weather.{what}: {low:g} to {high:g}; the least comes first")
        met = _meeting(file, approach(ship)[0])
        stack = _stack(file.stack, folder)
        known = _posterior(folder / file.ship) if file.ship.endswith(".toml") else None
        code = (folder / file.stack.partition(":")[0]).read_text(encoding="utf-8") if callable(stack) else ""
        mark = digest([to_json(file, SCHEMA), known.digest if known else ship.name, code])
        return Setup(file, ship, known, met, stack, Rules(), mark)

    def sailed(self, rows: slice, first: int, plain: bool) -> Sailed:
        """Some runs; `plain` on the ship as it was fitted."""
        met, count = self.meeting, len(range(*rows.indices(self.runs)))
        some = Meeting(met.U, *(np.atleast_2d(getattr(met, name))[rows] for name in ("x", "y", "psi", "U_target")))
        draws = None
        if self.posterior is not None and not plain:
            values = self.posterior.draws(self.runs, self.file.seed)[rows]
            draws = {name: values[:, k] for k, name in enumerate(self.posterior.names)}
        latest = float(np.max(np.where(np.isfinite(met.approach[1]), met.approach[1], 0.0)))
        sea = Sea(_LONG * latest, 10.0, self.file.encounters.length, self.rules, self._around(first, count))
        return sail(self.ship, some, sea, self.stack, self.file.traffic, self.file.seed + first, draws)

    def _around(self, first: int, count: int) -> Array:
        """Weather of these runs."""
        rng, said = np.random.default_rng((self.file.seed, first, 1)), self.file.weather
        wind, current = (rng.uniform(*span, count) for span in (said.wind, said.current))
        a, b = rng.uniform(-math.pi, math.pi, (2, count))
        none = np.zeros(count)
        given = Environment(wind * np.cos(a), wind * np.sin(a), current * np.cos(b), current * np.sin(b), none, none,
                            none, none)  # fmt: skip
        around = np.zeros((count, len(given)))
        for k, channel in enumerate(given):
            around[:, k] = channel
        return around


def _meeting(file: CaseFile, speed: float) -> Meeting:
    """The encounters of a case, with an axis of runs."""
    said = file.encounters
    if said.set == "drawn":
        if not said.roles:
            raise RequestError("encounters.roles: name one at least, such as \"give-way\"")
        roles = [Role[name.replace("-", "_").upper()] for name in said.roles]
        return drawn(roles, said.runs, speed, file.seed)
    some = imazu(speed, 1500.0) if said.set == "imazu" else dnv(speed)
    ships = max(len(one.x) for one in some)
    return _alike(some, ships)


def _alike(some: Sequence[Meeting], ships: int) -> Meeting:
    """Meetings of as many ships each: those that have fewer have more that sail away, far astern."""
    U = float(np.ravel(some[0].U)[0])
    added: Array = np.tile([[-1e6], [0.0], [math.pi], [U]], ships)
    added[0] -= 1e4 * np.arange(ships)  # apart from each other

    def whole(values: Array, far: Array) -> Array:
        return np.concatenate([values, far[len(values) :]])

    rows = [np.stack([whole(getattr(one, name), far) for one in some])
            for name, far in zip(("x", "y", "psi", "U_target"), added, strict=True)]  # fmt: skip
    return Meeting(np.full(len(some), U), *rows)


def _conduct(name: str, key: str) -> str:
    if name not in CONDUCTS:
        raise RequestError(f"{key}: no conduct '{name}'; there are {', '.join(CONDUCTS)}")
    return name


def _stack(said: str, folder: Path) -> str | Command:
    """A conduct, or a function of one's own that makes a master from the first scene."""
    file, colon, name = said.partition(":")
    if not colon:
        return _conduct(said, "stack")
    path = folder / file
    spec = importlib.util.spec_from_file_location("seatrial_case_stack", path)
    if not path.is_file() or spec is None or spec.loader is None:
        raise RequestError(f"stack: {path}: no such Python file")
    module: ModuleType = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    made = getattr(module, name, None)
    if not callable(made):
        raise RequestError(f"stack: {path} has no function {name}")
    return cast("Command", made)


def _posterior(path: Path) -> Posterior | None:
    try:
        return posterior(path)
    except StudyError:
        return None


def _place(out: Path, first: int) -> Path:
    return out / f"part-{first:07d}.json"


def _read(out: Path, first: int, mark: str) -> Part | None:
    """Runs that the folder has.

    Raises:
        RequestError: they are of another case.
    """
    path = _place(out, first)
    if not path.is_file():
        return None
    known = from_json(Part, json_of(path, PART), path)
    if known.case != mark:
        raise RequestError(f"{path}: is of another case; choose another folder, or remove it")
    return known


def _part(setup: Setup, first: int) -> Part:
    """Some runs, sailed."""
    rows = slice(first, min(first + _TOGETHER, setup.runs))
    broken, judged = _broken(setup.sailed(rows, first, plain=False), rows)
    plain = _broken(setup.sailed(rows, first, plain=True), rows)[0] if setup.posterior else ()
    return Part(setup.digest, first, broken, judged, plain)


def _broken(sailed: Sailed, rows: slice) -> tuple[tuple[tuple[str, ...] | None, ...], tuple[tuple[str, ...], ...]]:
    """Rules broken, and rules that applied, by run."""
    count = rows.stop - rows.start
    broken: list[tuple[str, ...] | None] = [None] * count
    applied: list[tuple[str, ...]] = [()] * count
    own = judge(sailed.tracks, own=True) if len(sailed.runs) else ()
    for k, run in enumerate(sailed.runs.tolist()):
        broken[run] = _of_run(own, k)
        applied[run] = tuple(sorted({rule for one in own for rule, m in one.margins.items() if np.isfinite(m[k])}))
    return tuple(broken), tuple(applied)


def _of_run(own: Sequence[Judged], k: int) -> tuple[str, ...]:
    said = {rule for one in own for rule in one.broken((k,))}
    return tuple(sorted(said | ({CONTACT} if any(one.contact[k] for one in own) else set())))


def _answer(found: Case) -> Body:
    """The claim, and what the runs say to it."""
    rows = [one for one in found.broken if one is not None]
    share = Proportion(sum(bool(one) for one in rows), len(rows))
    low, high = share.interval
    return lead(f"{found.file.claim}: {share.hits} of {share.runs} runs break a rule or touch, "
                f"{_percent(share.value)} (95 % interval {_percent(low)} to {_percent(high)})")  # fmt: skip


def _percent(share: float) -> str:
    return f"{number(100.0 * share, 3)} %" if math.isfinite(share) else "–"


def _rules(found: Case) -> list[str]:
    said = {rule for part in found.parts for rules in part.judged for rule in rules}
    return [CONTACT, *sorted(said)]


def _results(found: Case) -> Body:
    """By rule: how often it applied, was broken, and the interval of Clopper and Pearson."""
    rows: list[tuple[str, ...]] = []
    for rule in _rules(found):
        one = found.share(rule)
        low, high = one.interval
        name = rule if rule == CONTACT else f"Rule {rule}"
        rows.append((name, str(one.runs), str(one.hits), _percent(one.value), _percent(low), _percent(high)))
    body = table(("", "runs", "broken", "share", "from", "to (95 %)"), rows)
    return body + bullets(_split(found))


def _split(found: Case) -> list[str]:
    """What the uncertainty of the ship adds, and runs that are no evidence."""
    said: list[str] = []
    failed = sum(one is None for one in found.broken)
    if failed:
        said.append(f"{failed} runs ended in a failure of the model; they count for nothing above")
    pairs = [(a, b) for part in found.parts for a, b in zip(part.broken, part.plain, strict=False)
             if a is not None and b is not None]  # fmt: skip
    if pairs:
        drawn_, plain = (sum(bool(one[k]) for one in pairs) for k in (0, 1))
        only = sum(bool(a) and not b for a, b in pairs)
        said.append(f"ship: {drawn_} of {len(pairs)} break a rule with ships drawn from fit {found.posterior}, {plain} "
                    f"on the ship as it was fitted; {only} do so only where the ship is another one")  # fmt: skip
    else:
        said.append("ship: taken as known exactly; a fitted model.toml with its posterior shows what its error adds")
    return said


def _document(found: Case) -> dict[str, object]:
    rules = {rule: found.share(rule) for rule in _rules(found)}
    return {
        "schema": SCHEMA, "claim": found.file.claim, "digest": found.digest, "ship": found.file.ship,
        "posterior": found.posterior or None, "stack": found.file.stack, "traffic": list(found.file.traffic),
        "seed": found.file.seed, "runs": len(found.broken), "failed": sum(one is None for one in found.broken),
        "rules": {rule: {"applied": one.runs, "broken": one.hits, "share": one.value, "low": one.interval[0],
                         "high": one.interval[1]} for rule, one in rules.items()},
        "broken_runs": [k for k, one in enumerate(found.broken) if one],
    }  # fmt: skip


def _page(found: Case, setup: Setup, path: Path) -> Page:
    file = found.file
    where = file.encounters
    run = [
        f"ship {setup.ship.name}, steered by {file.stack}; other ships: {', '.join(file.traffic)}, drawn by run",
        f"encounters: {where.set}" + (f", roles {', '.join(where.roles)}" if where.set == "drawn" else ""),
        f"{len(found.broken)} runs of seed {file.seed}; wind {file.weather.wind[0]:g} to {file.weather.wind[1]:g} m/s, "
        f"current {file.weather.current[0]:g} to {file.weather.current[1]:g} m/s, from any direction",
        "who is met: " + _spread(setup.meeting),
    ]
    limits = [
        "other ships turn and slow with lags of a ship of their length, not by models of their own",
        "everybody sees everybody without error, delay or loss: a fault of sensors and of reports is not tried",
        "open water: no land, no depth, no lanes; good visibility",
        "how often ships meet so at sea is not in these shares: they are of the encounters above",
        "thresholds of the rules are those of `encounters.rules.limits`, each with its source; COLREG has none",
    ]
    return Page(f"Safety case: {file.claim}", (
        Section("", _answer(found) + fields(_document(found))),
        Section("What was run", bullets(run)),
        Section("What was found", _results(found)),
        Section("Runs that fail", _failures(found, setup)),
        Section("What this does not show", bullets(limits)),
        Section("Who can repeat it",
                bullets((f"seatrial case {path} -o FOLDER", f"digest of the case {found.digest}"))),
    ))  # fmt: skip


def _spread(met: Meeting) -> str:
    """How the encounters are spread over classes."""
    counts = Counter(np.ravel(np.atleast_2d(met.roles)).tolist())
    return ", ".join(f"{Role(one).name.lower().replace('_', '-')} {count}" for one, count in counts.most_common())


def _failures(found: Case, setup: Setup) -> Body:
    """Drawings of the first runs that fail, sailed again."""
    wrong = [k for k, one in enumerate(found.broken) if one]
    if not wrong:
        return soft("None.")
    body: Body = soft(f"{len(wrong)} runs; the first {min(len(wrong), _PICTURES)} are drawn. Runs count from 0.")
    again: dict[int, tuple[Sailed, tuple[Judged, ...]]] = {}
    for run in wrong[:_PICTURES]:
        first = run // _TOGETHER * _TOGETHER
        if first not in again:
            sailed = setup.sailed(slice(first, min(first + _TOGETHER, setup.runs)), first, plain=False)
            again[first] = sailed, judge(sailed.tracks)
        sailed, judged = again[first]
        place = int(np.flatnonzero(sailed.runs == run - first)[0])
        rules = ", ".join(found.broken[run] or ())
        body += lead(f"Run {run}: {rules}") + shown(sailed.tracks, judged, setup.rules, (place,))
    return body
