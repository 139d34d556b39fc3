"""A safety case: one stack in many encounters, on a ship whose error is known, and what may be said of it.

Each run draws the ship from the posterior of its fit, the other ships' conducts and the weather; the tracks are judged
by the rules of the road.  Parts of the runs lie in the folder as they end, so that a case which is cut off goes on.
"""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterator, Sequence
from functools import lru_cache, partial
from itertools import groupby
from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ...belief.bands import calibration
from ...belief.drawn import DRAWS
from ...belief.posterior import Posterior
from ...belief.reading import posterior
from ...campaign.running import Shard
from ...core import executors
from ...core.files import held_alone, write_whole
from ...core.records import digest, from_json, json_of, read_record, to_json
from ...core.values import dataclass
from ...data import Array
from ...encounters import Tracks
from ...encounters.conduct import CONDUCTS, Master, Scene, Watch
from ...encounters.meeting import Meeting, role
from ...encounters.rules import OPEN_WATER, Alone, Judged, Waters, alone, judge
from ...encounters.rules import Limits as Rules
from ...encounters.rules.roles import KINDS
from ...encounters.sailing import Command, Sailed, Sea, paced, sail, stepped
from ...encounters.sensing import looking
from ...encounters.space import PER_SHIP, WEATHER, Space, around, meeting
from ...environment import CHANNELS, Environment
from ...identify import StudyError
from ...realtime.links.wiring import Wiring
from ...realtime.range.encounter import LONG, encountered
from ...report.blocks import fields, lead
from ...ships import Ship
from ...simulate.approach import approach
from ...simulate.place import Place
from ...study.grounds import Grounds
from ...study.store import MODEL, SUMMARY
from .. import SILENT, Outcome, RequestError, Sink
from ..request import ship_of
from . import argued
from .behind import closest, grounds_of, required, untested
from .claimed import CONTACT, MUTE, PART, RARE, SCHEMA, Case, CaseFile, Failed, Part, Where, part_at, rare_at
from .outside import Ran, Spoken, ran
from .rare import SHIPS, UNDER_WAY, Rarely, margins, ordered, rarely
from .setting import conducts_of, meeting_of, place_in, ranges_of, waters_of
from .stacks import Stack, beside, conduct, stack_of

_TOGETHER = 1000
"""Runs of a part."""
_TOGETHER_ON_WIRE = 20
"""The same of a stack in a process of its own, whose runs take seconds."""
_PAIRED = 10_000
"""Runs from which on not all are sailed again on the ship as it was fitted, but every second part, third and so on."""
_ROWS = 600
"""Rows of tracks at most, but for rounding: those of a part are in memory together."""
_NOTHING = Alone()
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
    if file.rare is not None and not (setup.called and setup.space.free):
        raise RequestError("rare: nothing varies in these encounters; every run is the same")
    firsts = range(0, setup.runs, setup.together)
    out.mkdir(parents=True, exist_ok=True)
    with held_alone(out / ".shards" / f"{mine.index + 1}-of-{mine.count}"):
        known = {first: part for first in firsts if (part := _read(out, first, setup.digest))}
        own = mine.of(list(range(len(firsts))))
        todo = [firsts[k] for k in own if firsts[k] not in known]
        for part in _computed(path, setup, todo, workers, dask, sink):
            write_whole(part_at(out, part.first), to_json(part, PART))
            known[part.first] = part
            sink.note(f"runs {part.first + 1} to {part.first + len(part.broken)} of {setup.runs}")
        known |= {first: part for first in firsts if first not in known and (part := _read(out, first, setup.digest))}
    parts = tuple(known[first] for first in firsts if first in known)
    found = Case(file, setup.digest, parts, setup.posterior.digest if setup.posterior else "",
                 _rarely(setup, out, sink) if len(parts) == len(firsts) else None)  # fmt: skip
    if len(parts) < len(firsts):
        said = f"{len(parts)} of {len(firsts)} parts are there; the page is written by the shard that ends last"
        document = {"schema": SCHEMA, "digest": setup.digest, "parts": len(parts), "of": len(firsts)}
        return Outcome(found, fields(document, lead(said)))
    if file.found is not None:
        sink.note(_as_found(file.found, replayed(setup)))
    again = partial(_again, setup)
    page = argued.page(found, setup.ship, setup.meeting, path, again, required(setup.ship), setup.waters,
                       setup.place is not None)  # fmt: skip
    argued.kept(out, page)
    sink.note(f"wrote {out / 'case.html'}")
    return Outcome(found, fields(argued.document(found), argued.answer(found) + argued.results(found)))


def _rarely(setup: Setup, out: Path, sink: Sink) -> Rarely | None:
    """A breach by levels, kept in the folder; None where the case asks for none.

    Raises:
        RequestError: the folder has that of another case, or what levels do not take.
    """
    asked, place = setup.file.rare, rare_at(out)
    if asked is None:
        return None
    if place.is_file():
        known = from_json(Rarely, json_of(place, RARE), place)
        if known.case != setup.digest:
            raise RequestError(f"{place}: is of another case; choose another folder, or remove it")
        return known
    space, held, under = setup.space, setup.posterior, out / UNDER_WAY
    ships = ordered(held.draws(SHIPS, setup.file.seed)) if held else np.zeros((SHIPS, 0))

    def margin(cube: Array, ship: Array) -> Array:
        drawn, draws = np.isfinite(ship), None
        if held is not None:
            chosen = ships[(np.where(drawn, ship, 0.0) * SHIPS).astype(np.intp)]
            draws = dict(zip(held.names, np.where(drawn[:, None], chosen, held.mean).T, strict=True))
        sailed, found = setup.at(space, space.at(cube), draws), np.full(len(cube), np.nan)
        if len(sailed.runs):
            found[sailed.runs] = margins(judge(sailed.tracks, setup.rules, own=True), asked.breach)
        return found

    found = rarely(margin, asked, len(space.free), case=setup.digest, seed=setup.file.seed, posterior=bool(held),
                   kept=under, sink=sink)  # fmt: skip
    write_whole(place, to_json(found, RARE))
    shutil.rmtree(under, ignore_errors=True)
    return found


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
    stack: str | Command | Wiring
    rules: Rules
    digest: str
    waters: Waters = OPEN_WATER
    grounds: Grounds | None = None
    place: Place | None = None

    @property
    def together(self) -> int:
        """Runs of a part."""
        return _TOGETHER_ON_WIRE if isinstance(self.stack, Wiring) else _TOGETHER

    def every(self, duration: float) -> float:
        """Time between rows of tracks [s]; longer where they would be more than `_ROWS`."""
        return stepped(max(paced(self.ship.L_pp), duration / _ROWS))

    @property
    def runs(self) -> int:
        return len(self.meeting.x)

    @property
    def start(self) -> tuple[float, float, float]:
        """Place of the own ship north and east of the chart's datum [m], and its course [rad]."""
        return (*self.file.waters.at, self.file.waters.psi)

    @property
    def ranks(self) -> tuple[int, ...]:
        """Of the own ship and those that are met; empty where all are of one kind."""
        return (0, *(KINDS[one] for one in self.file.encounters.kinds)) if self.file.encounters.kinds else ()

    def judged(self, tracks: Tracks, own: bool = True) -> tuple[tuple[Judged, ...], Alone]:
        """Verdicts on the own ship towards others, and by itself."""
        found = judge(tracks, self.rules, restricted=self.waters.restricted, own=own, ranks=self.ranks)
        return found, alone(tracks, found, self.waters, self.rules)

    @staticmethod
    def of(file: CaseFile, folder: Path) -> Setup:
        ship = ship_of(folder / file.ship if file.ship.endswith(".toml") else file.ship)
        for name in file.traffic:
            conduct(name, "traffic")
        if not file.traffic:
            raise RequestError("traffic: name a conduct at least; 'ignores' keeps course and speed")
        for what in WEATHER:
            low, high = getattr(file.weather, what)
            if low > high:
                raise RequestError(f"weather.{what}: {low:g} to {high:g}; the least comes first")
        met = meeting_of(file, ship, folder)
        stack = stack_of(file.stack, folder)
        known = _posterior(folder / file.ship) if file.ship.endswith(".toml") and not file.as_fitted else None
        if len(file.encounters.kinds) > met.x.shape[-1]:
            raise RequestError(f"encounters.kinds: {len(file.encounters.kinds)} of them; {met.x.shape[-1]} ships are "
                               "met at most")  # fmt: skip
        if any(file.encounters.kinds) and isinstance(stack, Wiring):
            raise RequestError("encounters.kinds: a program is not told kinds of ships; a stack that is called is")
        if file.sensors is not None and isinstance(file.stack, Stack) and file.stack.speaks == "signalk":
            raise RequestError("sensors: Signal K tells ships as they are; let the program steer by nmea")
        mark = digest([to_json(file, SCHEMA), known.digest if known else ship.name,
                       *_beside(file, folder, drawn=known is not None)])  # fmt: skip
        grounds = grounds_of(folder / file.ship) if file.ship.endswith(".toml") else None
        waters = waters_of(file, ship, folder)
        place = None if isinstance(stack, Wiring) else place_in(waters, ship)
        return Setup(file, ship, known, met, stack, Rules(), mark, waters, grounds, place)

    def sailed(self, rows: slice, first: int, plain: bool) -> Sailed:
        """Some runs of a stack that is called; `plain` on the ship as it was fitted."""
        met, count = self.meeting, len(range(*rows.indices(self.runs)))
        latest = float(np.max(np.where(np.isfinite(met.approach[1]), met.approach[1], 0.0)))
        said = self.file.encounters
        duration = said.duration or LONG * latest
        sea = Sea(duration, self.every(duration), said.length, self.rules, self._around(first, count), self.ranks,
                  np.array([self.start]), self.place)  # fmt: skip
        return sail(self.ship, self._some(rows), sea, self._seeing(first), self.file.traffic, self.file.seed + first,
                    self._draws(rows, plain), np.array([conducts_of(self.file)]) if said.ships else None)  # fmt: skip

    def at(self, space: Space, points: Array, draws: dict[str, Array] | None = None) -> Sailed:
        """Runs of points of a space, on ships that are drawn, or as fitted."""
        there = points[:, : len(PER_SHIP) * len(space.roles)].reshape(len(points), -1, len(PER_SHIP))
        duration, said = LONG * space.ranges.T[1], self.file.encounters
        sea = Sea(duration, self.every(duration), said.length, self.rules, around(points), self.ranks)
        return sail(self.ship, meeting(points, space.U), sea, self.called, self.file.traffic, self.file.seed, draws,
                    np.nan_to_num(there[:, :, 3]).astype(np.intp))  # fmt: skip

    @property
    def called(self) -> str | Command:
        """The stack, of those that are called.

        Raises:
            RequestError: it is on a wire.
        """
        if isinstance(self.stack, Wiring):
            raise RequestError("stack: a program on a wire runs one encounter at a time; a search takes a conduct, or "
                               "FILE.py:NAME")  # fmt: skip
        return self.stack

    @property
    def space(self) -> Space:
        """The encounters that are drawn, as numbers.

        Raises:
            RequestError: a fixed set is met, or sensors err.
        """
        if self.file.encounters.set != "drawn":
            raise RequestError(f"encounters.set: '{self.file.encounters.set}' has nothing to vary; a search takes "
                               "\"drawn\"")  # fmt: skip
        if self.file.waters != Where():
            raise RequestError("waters: a search is in open water, in sight of one another; leave the table out")
        if self.file.sensors is not None:
            raise RequestError("sensors: their errors differ from run to run in the same encounter, which a search "
                               "does not follow; leave the table out")  # fmt: skip
        said = self.file.weather
        return Space(tuple(role(name) for name in self.file.encounters.roles), approach(self.ship)[0],
                     len(self.file.traffic), ranges_of(self.file, self.ship),
                     (said.wind, said.wind_from, said.current, said.current_towards))  # fmt: skip

    def _seeing(self, first: int) -> str | Command:
        """The stack, with the sensors of the case between it and the ships."""
        stack = cast("str | Command", self.stack)
        if self.file.sensors is None:
            return stack
        U, known = self.meeting.U, () if callable(stack) else (CONDUCTS[stack],)

        def begin(scene: Scene) -> Master:
            runs = len(scene.x)
            return Watch(known, np.zeros(runs, dtype=np.intp), 0, scene, np.full(runs, np.ravel(U)[0]), self.rules)

        rng = np.random.default_rng((self.file.seed, first, 3))
        return looking(stack if callable(stack) else begin, self.file.sensors, rng)

    def ran(self, run: int, plain: bool) -> Ran:
        """One run of a stack on a wire."""
        first, one = run // self.together * self.together, slice(run, run + 1)
        draws = self._draws(one, plain) or {}
        met, file = self._some(one), self.file
        chosen = np.random.default_rng((file.seed, run, 2)).integers(len(file.traffic), size=met.x.size)
        around = Environment(*map(float, self._around(first, self.together)[run - first]))
        return ran(encountered(
            self.ship.moved({name: float(value[0]) for name, value in draws.items()}), met,
            [file.traffic[k] for k in chosen], length=file.encounters.length, seed=file.seed + run, around=around,
            sensing=file.sensors, title=f"run {run}", start=self.start,
        ), cast("Wiring", self.stack), cast("Spoken", cast("Stack", file.stack).speaks))  # fmt: skip

    def _some(self, rows: slice) -> Meeting:
        met = self.meeting
        U, x, y, psi, target = (getattr(met, name)[rows] for name in ("U", "x", "y", "psi", "U_target"))
        return Meeting(U, x, y, psi, target)

    def _draws(self, rows: slice, plain: bool) -> dict[str, Array] | None:
        """Values of parameters of the ship in these runs; None where it is as it was fitted."""
        if self.posterior is None or plain:
            return None
        values = self.posterior.draws(self.runs, self.file.seed)[rows]
        return {name: values[:, k] for k, name in enumerate(self.posterior.names)}

    def current(self, first: int, count: int) -> Array:
        """Current north and east of these runs [m/s], shape (2, runs)."""
        return self._around(first, count)[:, [CHANNELS.index("current_x"), CHANNELS.index("current_y")]].T

    def _around(self, first: int, count: int) -> Array:
        """Weather of these runs."""
        rng, said = np.random.default_rng((self.file.seed, first, 1)), self.file.weather
        wind, current, a, b = (rng.uniform(*span, count) for span in (said.wind, said.current, said.wind_from,
                                                                      said.current_towards))  # fmt: skip
        return around(np.column_stack([wind, a, current, b]))


def _beside(file: CaseFile, folder: Path, drawn: bool) -> list[str]:
    """What is in the files that a stack names, in the table of AIS, and in those beside a fit that widen draws."""
    named = (*beside(file.stack), *(one for one in (file.encounters.file, file.waters.chart) if one))
    paths, model = [folder / one for one in named], folder / file.ship
    paths += [calibration.beside(model), model.with_name(DRAWS)] if drawn else []
    return [digest(path.read_bytes().decode(errors="replace")) for path in paths if path.is_file()]


def _posterior(path: Path) -> Posterior | None:
    """What the ship is drawn from; None of a ship without a fit.

    Raises:
        RequestError: the fit beside it is of another ship, or tells no posterior.
    """
    if path.name != MODEL or not path.with_name(SUMMARY).is_file():
        return None
    try:
        return posterior(path)
    except StudyError as error:
        raise RequestError(f"ship: {error}; as_fitted = true takes the numbers of its file as known exactly") from None


def _read(out: Path, first: int, mark: str) -> Part | None:
    """Runs that the folder has.

    Raises:
        RequestError: they are of another case.
    """
    path = part_at(out, first)
    if not path.is_file():
        return None
    known = from_json(Part, json_of(path, PART), path)
    if known.case != mark:
        raise RequestError(f"{path}: is of another case; choose another folder, or remove it")
    return known


def _part(setup: Setup, first: int) -> Part:
    """Some runs, sailed."""
    rows = slice(first, min(first + setup.together, setup.runs))
    found = _of_part(setup, rows, plain=False)
    again = first // setup.together % max(setup.runs // _PAIRED, 1) == 0
    plain = _of_part(setup, rows, plain=True) if setup.posterior and again else []
    return Part(
        setup.digest, first, tuple(one.broken for one in found), tuple(one.judged for one in found),
        tuple(one.broken for one in plain), tuple(one.closest for one in found),
        tuple(one.closest for one in plain), tuple(one.untested for one in found),
    )  # fmt: skip


@dataclass(frozen=True)
class _Became:
    """What became of one run, as `Part` has it of each."""

    broken: tuple[str, ...] | None = None
    judged: tuple[str, ...] = ()
    closest: float | None = None
    untested: str = ""


def _of_part(setup: Setup, rows: slice, plain: bool) -> list[_Became]:
    """What became of some runs."""
    if not isinstance(setup.stack, Wiring):
        return _broken(setup, setup.sailed(rows, rows.start, plain), rows)
    return [_on_wire(setup, setup.ran(run, plain), run) for run in range(rows.start, rows.stop)]


def _on_wire(setup: Setup, one: Ran, run: int) -> _Became:
    """The same of a run on a wire.

    Raises:
        RequestError: the stack never said anything in the first run.
    """
    if run == 0 and not one.spoke:
        raise RequestError("stack: no valid sentence came from its command; does it run, and send to {address}?")
    if one.tracks is None or not one.valid:
        return _Became()
    first = run // setup.together * setup.together
    current = setup.current(first, setup.together)[:, [run - first]]
    return _became(setup, one.tracks, current, [one.silent is not None])[0]


def _broken(setup: Setup, sailed: Sailed, rows: slice) -> list[_Became]:
    """The same of runs that were sailed together."""
    found = [_Became()] * (rows.stop - rows.start)
    if len(sailed.runs):
        current = setup.current(rows.start, len(found))[:, sailed.runs]
        ended = _became(setup, sailed.tracks, current, np.isfinite(sailed.silent))
        for run, one in zip(sailed.runs.tolist(), ended, strict=True):
            found[run] = one
    return found


def _became(setup: Setup, tracks: Tracks, current: Array, silent: Sequence[bool] | NDArray[np.bool_]) -> list[_Became]:
    """Verdicts on the tracks of runs that went to their end, one or many."""
    own, by_itself = setup.judged(tracks)
    near, out = closest(own), untested(tracks, setup.grounds, (current[0], current[1]))
    found: list[_Became] = []
    for k, mute in enumerate(silent):
        where = (k,) if tracks.x.ndim > 2 else ()
        broken = {*broken_of(own, where, by_itself), *([MUTE] if mute else [])}
        found.append(_Became(tuple(sorted(broken)), _applied(own, where, by_itself), float(near[k]), out[k]))
    return found


def broken_of(own: Sequence[Judged], where: tuple[int, ...], by_itself: Alone = _NOTHING) -> tuple[str, ...]:
    """Rules that the own ship did not keep in one run, `CONTACT`, and how it met the ground."""
    said = {rule for one in (*own, by_itself) for rule in one.broken(where)}
    return tuple(sorted(said | ({CONTACT} if any(one.contact[where] for one in own) else set())))


def _applied(own: Sequence[Judged], where: tuple[int, ...], by_itself: Alone) -> tuple[str, ...]:
    every = (*own, by_itself)
    return tuple(sorted({rule for one in every for rule, margin in one.margins.items() if np.isfinite(margin[where])}))


def _again(setup: Setup, runs: Sequence[int]) -> Iterator[tuple[int, Tracks, tuple[Judged, ...], tuple[int, ...]]]:
    """Tracks and verdicts of some runs, sailed again, and the place of each among them."""
    if isinstance(setup.stack, Wiring):
        for run in runs:
            tracks = setup.ran(run, plain=False).tracks
            if tracks is not None:
                yield run, tracks, setup.judged(tracks, own=False)[0], ()
        return
    for first, some in groupby(runs, lambda run: run // _TOGETHER * _TOGETHER):
        sailed = setup.sailed(slice(first, min(first + _TOGETHER, setup.runs)), first, plain=False)
        judged, _ = setup.judged(sailed.tracks, own=False)
        for run in some:
            yield run, sailed.tracks, judged, (int(np.flatnonzero(sailed.runs == run - first)[0]),)


def replayed(setup: Setup) -> Failed:
    """What the one run of a kept failure breaks now, and the digest of its tracks."""
    sailed = setup.sailed(slice(0, 1), 0, plain=True)
    if not len(sailed.runs):
        return Failed(broken=(), tracks="")
    tracks = sailed.tracks
    bits = np.stack([tracks.x, tracks.y, tracks.psi, tracks.u, tracks.v_m]).tobytes()
    own, by_itself = setup.judged(tracks)
    return Failed(broken=broken_of(own, (0,), by_itself),
                  tracks=hashlib.sha256(bits).hexdigest()[:16])  # fmt: skip


def _as_found(then: Failed, now: Failed) -> str:
    if then == now:
        return f"as found: breaks {', '.join(now.broken)} on the same tracks, bit for bit"
    if then.tracks == now.tracks:
        return f"the same tracks as found, but other rules are broken: {', '.join(now.broken) or 'none'}"
    return (f"not as found: {', '.join(now.broken) or 'nothing'} broken, then {', '.join(then.broken)}; stack, ship or "
            "version have changed, or the type of processor")  # fmt: skip
