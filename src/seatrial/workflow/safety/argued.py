"""The argument of a safety case: what was run, what was found and how sure it is, and what that does not show."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import cast

import numpy as np

from ...campaign.analysis.proportion import Proportion
from ...core.files import write_whole
from ...core.records import from_json, json_of, plain
from ...core.version import __version__
from ...encounters import Tracks
from ...encounters.meeting import Meeting
from ...encounters.rules import OPEN_WATER, Judged, Limits, Waters
from ...encounters.rules.limits import L_REFERENCE
from ...encounters.rules.waters import AGROUND, CONTOUR
from ...models import unit
from ...report.blocks import Body, bullets, fields, lead, number, soft, table
from ...report.judging.encounter import shown
from ...report.judging.requirements import verdict
from ...report.judging.space import Space, drawn, space
from ...report.page import Page, Section, write
from ...ships import Ship
from ...validate.requirements import Table
from .. import Outcome, RequestError
from ..contributing.published import standing
from .behind import told as told_of
from .claimed import CONTACT, MUTE, PART, RARE, SCHEMA, Case, CaseFile, Part, part_at, rare_at
from .rare import Rarely, told

_PICTURES, _KINDS, _NEAREST = 4, 12, 2
PAGE, NUMBERS, SUMS = "case.html", "case.json", "case.sha256"
Again = Callable[[Sequence[int]], Iterator[tuple[int, Tracks, tuple[Judged, ...], tuple[int, ...]]]]
"""Sails runs again: number, tracks, verdicts and the place of the run among these."""


def answer(found: Case) -> Body:
    """The claim, and what the runs say to it."""
    rows = [one for one in found.broken if one is not None]
    share = Proportion(sum(bool(one) for one in rows), len(rows))
    low, high = share.interval
    mute = sum(MUTE in one for one in rows)
    silent = f"{mute} of them by falling silent, " if mute else ""
    return lead(f"{found.file.claim}: {share.hits} of {share.runs} runs fail (a rule broken, contact, silence), "
                f"{silent}{_percent(share.value)} (95 % interval {_percent(low)} to {_percent(high)})")  # fmt: skip


def _percent(share: float) -> str:
    return f"{number(100.0 * share, 3)} %" if math.isfinite(share) else "–"


def _points(share: float) -> str:
    return f"{number(100.0 * share, 3)} points"


def _rules(found: Case) -> list[str]:
    said = {rule for part in found.parts for rules in part.judged for rule in rules}
    silent = [MUTE] if found.file.foreign else []
    numbers = {rule: int(rule.partition("(")[0]) if rule[0].isdigit() else 0 for rule in said}
    return [CONTACT, *silent, *sorted(said, key=lambda rule: (numbers[rule], rule))]


def results(found: Case) -> Body:
    """By rule: how often it applied, was broken, and the interval of Clopper and Pearson."""
    rows: list[tuple[str, ...]] = []
    for rule in _rules(found):
        one = found.share(rule)
        low, high = one.interval
        name = rule if rule in (CONTACT, MUTE, AGROUND, CONTOUR) else f"Rule {rule}"
        interval = f"{number(100.0 * low, 3)} to {_percent(high)}"
        rows.append((name, f"{one.hits} of {one.runs}", _percent(one.value), interval))
    body = table(("", "broken in runs", "share", "95 % interval"), rows, words=(0,), wide=True)
    body += bullets((*_split(found), *_few()))
    asked = found.file.rare
    return body + told(found.rarely, asked) if found.rarely and asked else body


def needed(share: float) -> int:
    """Runs without a breach from which the interval of 95 % of Clopper and Pearson lies below a share."""
    return math.ceil(math.log(0.025) / math.log1p(-share))


def _few() -> list[str]:
    told = ", ".join(f"{needed(share)} to show less than {100.0 * share:g} %" for share in (0.1, 0.01, 0.001))
    return [f"of runs without a breach it takes {told}"]


def _split(found: Case) -> list[str]:
    """What the uncertainty of the ship adds, and runs that are no evidence."""
    said: list[str] = []
    failed = sum(one is None for one in found.broken)
    if failed:
        said.append(f"{failed} runs ended in a failure of the model; they count for nothing above")
    if pairs := found.pairs:
        drawn_, plain = (sum(bool(one[k]) for one in pairs) for k in (0, 1))
        only, (more, low, high) = sum(bool(a) and not b for a, b in pairs), found.added
        said += [f"ship: {drawn_} of {len(pairs)} break a rule with ships drawn from fit {found.posterior}, {plain} "
                 f"on the ship as it was fitted; {only} do so only where the ship is another one",
                 f"stack and encounters: {_percent(plain / len(pairs))}; the ship's error adds {_points(more)} (95 % "
                 f"interval {_points(low)} to {_points(high)}), by the {len(pairs)} runs that were sailed on both"]
    else:
        said.append("ship: taken as known exactly; a fitted model.toml with its posterior shows what its error adds")
    return said


def _shared(found: Case) -> dict[str, float] | None:
    """Shares of runs that fail, of those sailed twice; None without any."""
    if not (pairs := found.pairs):
        return None
    more, low, high = found.added
    drawn_, plain_ = (sum(bool(one[k]) for one in pairs) / len(pairs) for k in (0, 1))
    return {"runs": len(pairs), "drawn": drawn_, "fitted": plain_, "added": more, "low": low, "high": high}


def document(found: Case) -> dict[str, object]:
    rules = {rule: found.share(rule) for rule in _rules(found)}
    return {
        "schema": SCHEMA, "claim": found.file.claim, "case": plain(found.file), "digest": found.digest,
        "results": found.sealed, "ship": found.file.ship,
        "posterior": found.posterior or None, "stack": found.file.called, "traffic": list(found.file.traffic),
        "seed": found.file.seed, "runs": len(found.broken), "failed": sum(one is None for one in found.broken),
        "rules": {rule: {"applied": one.runs, "broken": one.hits, "share": one.value if one.runs else None,
                         "low": one.interval[0], "high": one.interval[1]} for rule, one in rules.items()},
        "split": _shared(found),
        "rare": found.rarely and dataclasses.asdict(found.rarely),
        "broken_runs": [k for k, one in enumerate(found.broken) if one],
    }  # fmt: skip


def page(
    found: Case, ship: Ship, meeting: Meeting, path: Path, again: Again, table_: Table | None,
    waters: Waters = OPEN_WATER, felt: bool = False,
) -> Page:  # fmt: skip
    """The page of a case, in the order in which a surveyor asks.

    Args:
        path: of its file.
        table_: the ship by the requirements of collision avoidance; None where it could not be judged.
        waters: where it was.
        felt: whether its model knows depth and banks there.
    """
    failed = np.array([bool(one) for one in found.broken], dtype=bool)
    tried = space(meeting, failed)
    return Page(f"Safety case: {found.file.claim}", (
        Section("", answer(found) + fields(document(found))),
        Section("What is claimed, and of what", bullets(_asked(found, ship, waters))),
        Section("How many runs, and how sure", results(found)),
        Section("Which ship, and how good is its model", _ship(ship, found, table_, path)),
        Section("What failed", _failed(found)),
        Section("Show me", _failures(found, again, waters)),
        Section("What was not tried", drawn(tried) + bullets(_not_tried(found, tried, waters, felt))),
        Section("Who says", _says(max(ship.L_pp, found.file.encounters.length or 0.0))),
        Section("Repeat it", bullets((
            f"seatrial case {path} -o FOLDER (the same to the last bit on one type of processor)",
            f"seed {found.file.seed}, version {__version__}; a run is drawn anew by its number alone",
        ))),
        Section("Sign it", _signed(found)),
    ))  # fmt: skip


def _asked(found: Case, ship: Ship, waters: Waters) -> list[str]:
    file, where = found.file, found.file.encounters
    return [
        f"claim: {file.claim}",
        f"ship {ship.name}, steered by {file.called}; other ships: {', '.join(file.traffic)}, drawn by run",
        f"encounters: {where.set}" + (f", own ship as {', '.join(where.roles)}" if where.set == "drawn" else "")
        + (f"; ships met by kind (Rule 18): {', '.join(where.kinds)}" if where.kinds else ""),
        ", ".join(f"{what} {low:g} to {high:g} m/s" if high else f"no {what}"
                  for what, (low, high) in (("wind", file.weather.wind), ("current", file.weather.current))),
        _where(found, waters),
        "a run fails where a rule is broken, hulls touch, the ship runs aground or crosses its safety contour, or a "
        "stack falls silent",
    ]  # fmt: skip


def _where(found: Case, waters: Waters) -> str:
    sight = (f"visibility {number(waters.visibility)} m: Rules 6 and 19 in place of 11 to 18" if waters.restricted
             else "in sight of one another")  # fmt: skip
    if waters.chart is None:
        return f"open water, {sight}"
    said = found.file.waters
    safe = "" if waters.safety is None else f", safety depth {number(waters.safety)} m"
    return (f"chart {waters.chart.name} ({waters.chart.source or 'no source named'}), from {number(said.at[0])} m "
            f"north, {number(said.at[1])} m east on {number(math.degrees(said.psi))}°, draught "
            f"{number(waters.draught)} m{safe}; {sight}")  # fmt: skip


def _ship(ship: Ship, found: Case, table_: Table | None, path: Path) -> Body:
    """What stands behind the model, and what it does of what collision avoidance asks of one."""
    known, more = standing(ship), told_of(found, path.parent / found.file.ship)
    said = [f"drawn anew for each run from the posterior of its fit, {found.posterior}: what that adds is told above"
            if found.posterior else "taken as known exactly: nothing here says what the error of its model adds",
            f"its file is {known.told} ({known.why})",
            _valid(ship),
            "runs whose model leaves what is watched are no evidence and counted apart"]  # fmt: skip
    if table_ is None:
        return bullets(said) + more + soft("Not judged by the requirements of collision avoidance.")
    rows = [(item.number, one.verdict, item.text) for item, one in table_.rows]
    judged = table(("item", "", "what Sawada et al. 2024, 6.2, ask of a model"), rows, words=(1, 2), wide=True)
    # without the evidence, among which is how fast this machine is: a case is the same bytes wherever it is run
    kept = {"verdict": verdict(table_), "items": {item: judged_ for item, judged_, _ in rows}}
    return bullets(said) + more + fields({"requirements": kept}, lead(verdict(table_)) + judged)


def _ends(name: str, low: float, high: float) -> str:
    angle = unit(name).startswith("rad")
    factor = math.degrees(1.0) if angle else 1.0
    return f"{name} {number(factor * low, 3)} to {number(factor * high, 3)} {unit(name).replace('rad', '°')}"


def _valid(ship: Ship) -> str:
    """The range in which the model holds by its file, and what of it is watched in each run."""
    ends = ", ".join(_ends(name, *span) for name, span in ship.validity.items())
    if not ends:
        return "its file states no range of validity: nothing is watched but that the model does not blow up"
    return f"its file calls it valid for {ends}; its motion through the water is watched in each run"


def _kinds(found: Case) -> list[tuple[tuple[str, ...], list[int]]]:
    """Rules that broke together with their runs: contacts first, then what is most frequent."""
    kinds: dict[tuple[str, ...], list[int]] = {}
    for run, one in enumerate(found.broken):
        if one:
            kinds.setdefault(one, []).append(run)
    return sorted(kinds.items(), key=lambda one: (CONTACT not in one[0], -len(one[1])))


def _failed(found: Case) -> Body:
    """Which rules broke together, and in which runs."""
    kinds = _kinds(found)
    if not kinds:
        return soft("Nothing.")
    rows = [(", ".join(kind), str(len(runs)), ", ".join(map(str, runs[:12])) + (" …" if len(runs) > 12 else ""))
            for kind, runs in kinds[:_KINDS]]  # fmt: skip
    left = len(kinds) - len(rows)
    more = soft(f"And {left} more combinations; all runs are in the numbers beside this page.") if left > 0 else ()
    return table(("rules broken together", "runs", "numbers, from 0"), rows, words=(0, 2), wide=True) + more


def _not_tried(found: Case, tried: Space, waters: Waters, felt: bool = False) -> list[str]:
    hit, possible = tried.hit
    seeing = ("reports that are worse than late, lost or noisy: clutter, false echoes, lies" if found.file.sensors
              else "errors, delays and gaps of sensors: the stack sees everybody as they are")  # fmt: skip
    return [
        f"{possible - hit} of {possible} cells of the encounter space in which ships can meet, above",
        seeing,
        *_beyond(waters, felt),
        "own models of the other ships: they turn with lags of a ship of their length",
        "how often ships meet so at sea: shares are of these encounters, not of voyages",
    ]


def _beyond(waters: Waters, felt: bool) -> list[str]:
    """What of the waters is not in it."""
    said = ["Rules 5 and 7: what a watch knows is not in tracks"]
    if waters.chart is None:
        return [*said, "land, depth and lanes: open water"] + ["restricted visibility"] * (not waters.restricted)
    return [*said,
            "squat, but for what the draught has of it; quays: it would pass through them" if felt
            else "banks and shallow water as a ship feels them: it sails as in open water, judged on the chart",
            "tide: depths are those of the chart",
            *(f"the chart: {one}" for one in waters.chart.lacks)]  # fmt: skip


def _says(L: float) -> Body:
    """Thresholds for ships of a length with their sources, and what is asked elsewhere of such evidence."""
    limits = Limits()
    named = [(one.name, getattr(limits, one.name)) for one in dataclasses.fields(limits)]
    rows = [(name, number(one.value), number(float(one.of(np.array(L)))), one.source) for name, one in named]
    return (soft("COLREG 1972 has one figure, the 22.5 degrees of Rule 13(b); all others are of those named here, in "
                 "SI units and radians. Distances grow with the length of the longer ship, times with its root "
                 "(Froude's law); window, extremis and stopping are ship lengths, sailed at the own speed, so that a "
                 "slow model has as long as it needs to turn.")
            + table(("threshold", f"at {L_REFERENCE:g} m", f"here, {number(L)} m", "who says so"), rows, words=(0, 3),
                    wide=True)
            + table(("asked for by", "what", "where it is here"), _TRACED, words=(0, 1, 2), wide=True))  # fmt: skip


_TRACED = (
    ("Sawada et al. 2024, section 6.2", "a model that turns, slows and drifts as ships do, with delays and limits",
     "Which ship: item by item"),
    ("IMO MASS Code (MSC 111, in effect from 1 July 2026, non-mandatory)", "goals met, shown by evidence for the "
     "operational envelope", "What is claimed; How sure; What was not tried"),
    ("DNV-CG-0264", "simulation beside assurance of the process and tests that show the simulation valid; tolerance of "
     "failures", "Which ship; sensors and silence of a stack, where the case asks for them"),
    ("ISO/AWI 25927", "test scenarios from the operational design domain, sampled, with indicators",
     "What is claimed; What was not tried"),
)  # fmt: skip
"""Requirements of others, by their public summaries: the texts of the code and the guideline were not at hand."""


def _signed(found: Case) -> Body:
    return bullets((
        f"inputs (case, ship, fit, stack): {found.digest}",
        f"results (all parts): {found.sealed}",
        "seatrial case --verify FOLDER finds any change of parts, numbers or page since; sign these two lines, and "
        f"keep {SUMS}, which has the digests of this page and its numbers",
        "name, date, signature: ______________________________",
    ))  # fmt: skip


def _failures(found: Case, again: Again, waters: Waters) -> Body:
    """Drawings of failures, the first run of each kind, sailed again."""
    kinds = _kinds(found)
    if not kinds:
        return _nearest(found, again, waters)
    firsts = [runs[0] for _, runs in kinds]
    more = [run for _, runs in kinds for run in runs[1:]]
    some = sorted((firsts + more)[:_PICTURES])
    body: Body = soft(f"Of {len(firsts) + len(more)} runs that fail {len(some)} are drawn, contacts before all, the "
                      "first of each combination before others. Runs count from 0.")  # fmt: skip
    for run, tracks, judged, where in again(some):
        rules = ", ".join(found.broken[run] or ())
        body += lead(f"Run {run}: {rules}") + shown(tracks, judged, Limits(), where, waters)
    return body


def _nearest(found: Case, again: Again, waters: Waters) -> Body:
    """Where nothing failed, the runs that came nearest to it: those with the least gap between hulls."""
    gaps = {part.first + k: gap for part in found.parts for k, gap in enumerate(part.closest) if gap is not None}
    some = sorted(sorted(gaps, key=lambda run: gaps[run])[:_NEAREST])
    if not some:
        return soft("None failed.")
    body: Body = soft(f"None failed. Of {len(gaps)} runs those are drawn in which the hulls came nearest.")
    for run, tracks, judged, where in again(some):
        body += lead(f"Run {run}: {number(gaps[run], 3)} m between hulls")
        body += shown(tracks, judged, Limits(), where, waters)
    return body


def kept(out: Path, made: Page) -> None:
    """Write a page, its numbers, and the digests of both as `sha256sum -c` reads them."""
    write(out / PAGE, made)
    write_whole(out / SUMS, _sums(out))


def _sums(out: Path) -> str:
    return "".join(f"{hashlib.sha256((out / name).read_bytes()).hexdigest()}  {name}\n" for name in (PAGE, NUMBERS))


def verified(out: Path) -> Outcome[Case]:
    """Whether the numbers of a case are those of its parts, and these and its page are as they were when it was signed.

    Raises:
        RequestError: what has changed, or is not there.
    """
    path = out / NUMBERS
    said = json_of(path, SCHEMA)
    parts = tuple(from_json(Part, json_of(one, PART), one) for one in sorted(out.glob("part-*.json")))
    inputs, results = said.get("digest"), said.get("results")
    for part in parts:
        if part.case != inputs:
            raise RequestError(f"{part_at(out, part.first)}: is of case {part.case}, the numbers are of {inputs}")
    file = from_json(CaseFile, cast("dict[str, object]", said.get("case")), path)
    rare = rare_at(out)
    levels = from_json(Rarely, json_of(rare, RARE), rare) if file.rare is not None else None
    found = Case(file, str(inputs), parts, str(said.get("posterior") or ""), levels)
    if found.sealed != results:
        raise RequestError(f"{out}: parts have changed since: their digest is {found.sealed}, signed was {results}")
    own = json.loads(json.dumps(document(found)))
    for key, value in own.items():
        if key != "schema" and said.get(key) != value:
            raise RequestError(f"{path}: {key} is not what the parts say; run the case again")
    try:
        then, now = (out / SUMS).read_text(encoding="utf-8").splitlines(), _sums(out).splitlines()
    except OSError as error:
        raise RequestError(f"{error.filename}: cannot be read, so that the page is not known to be as it was; run the "
                           "case again") from None  # fmt: skip
    for name, one, other in zip((PAGE, NUMBERS), [*then, "", ""], now, strict=False):
        if one != other:
            raise RequestError(f"{out / name}: has changed since it was written; run the case again")
    return Outcome(found, fields(own, lead(f"{out}: as signed; inputs {inputs}, results {results}, "
                                           f"{len(found.broken)} runs in {len(parts)} parts")))  # fmt: skip
