"""The argument of a safety case: what was run, what was found and how sure it is, and what that does not show."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from ...campaign.analysis.proportion import Proportion
from ...encounters import Tracks
from ...encounters.meeting import Meeting
from ...encounters.rules import Judged, Limits, Role
from ...report.blocks import Body, bullets, fields, lead, number, soft, table
from ...report.judging.encounter import shown
from ...report.page import Page, Section
from ...ships import Ship
from .claimed import CONTACT, MUTE, SCHEMA, Case
from .outside import Program

_PICTURES = 4
Again = Callable[[Sequence[int]], Iterator[tuple[int, Tracks, tuple[Judged, ...], tuple[int, ...]]]]
"""Sails runs again: number, tracks, verdicts and the place of the run among these."""

def answer(found: Case) -> Body:
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
    silent = [MUTE] if isinstance(found.file.stack, Program) else []
    return [CONTACT, *silent, *sorted(said)]


def results(found: Case) -> Body:
    """By rule: how often it applied, was broken, and the interval of Clopper and Pearson."""
    rows: list[tuple[str, ...]] = []
    for rule in _rules(found):
        one = found.share(rule)
        low, high = one.interval
        name = rule if rule in (CONTACT, MUTE) else f"Rule {rule}"
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


def document(found: Case) -> dict[str, object]:
    rules = {rule: found.share(rule) for rule in _rules(found)}
    return {
        "schema": SCHEMA, "claim": found.file.claim, "digest": found.digest, "ship": found.file.ship,
        "posterior": found.posterior or None, "stack": found.file.called, "traffic": list(found.file.traffic),
        "seed": found.file.seed, "runs": len(found.broken), "failed": sum(one is None for one in found.broken),
        "rules": {rule: {"applied": one.runs, "broken": one.hits, "share": one.value, "low": one.interval[0],
                         "high": one.interval[1]} for rule, one in rules.items()},
        "broken_runs": [k for k, one in enumerate(found.broken) if one],
    }  # fmt: skip


def page(found: Case, ship: Ship, meeting: Meeting, path: Path, again: Again) -> Page:
    """The page of a case; `path` is that of its file."""
    file = found.file
    where = file.encounters
    run = [
        f"ship {ship.name}, steered by {file.called}",
        f"other ships: {', '.join(file.traffic)}, drawn by run",
        f"encounters: {where.set}" + (f", roles {', '.join(where.roles)}" if where.set == "drawn" else ""),
        f"{len(found.broken)} runs of seed {file.seed}; wind {file.weather.wind[0]:g} to {file.weather.wind[1]:g} m/s, "
        f"current {file.weather.current[0]:g} to {file.weather.current[1]:g} m/s, from any direction",
        "who is met: " + _spread(meeting),
    ]
    limits = [
        "other ships turn and slow with lags of a ship of their length, not by models of their own",
        "everybody sees everybody without error, delay or loss: a fault of sensors and of reports is not tried",
        "open water: no land, no depth, no lanes; good visibility",
        "how often ships meet so at sea is not in these shares: they are of the encounters above",
        "thresholds of the rules are those of `encounters.rules.limits`, each with its source; COLREG has none",
    ]
    return Page(f"Safety case: {file.claim}", (
        Section("", answer(found) + fields(document(found))),
        Section("What was run", bullets(run)),
        Section("What was found", results(found)),
        Section("Runs that fail", _failures(found, again)),
        Section("What this does not show", bullets(limits)),
        Section("Who can repeat it",
                bullets((f"seatrial case {path} -o FOLDER", f"digest of the case {found.digest}"))),
    ))  # fmt: skip


def _spread(met: Meeting) -> str:
    """How the encounters are spread over classes."""
    counts = Counter(np.ravel(np.atleast_2d(met.roles)).tolist())
    return ", ".join(f"{Role(one).name.lower().replace('_', '-')} {count}" for one, count in counts.most_common())


def _failures(found: Case, again: Again) -> Body:
    """Drawings of the first runs that fail, sailed again."""
    wrong = [k for k, one in enumerate(found.broken) if one]
    if not wrong:
        return soft("None.")
    body: Body = soft(f"{len(wrong)} runs; the first {min(len(wrong), _PICTURES)} are drawn. Runs count from 0.")
    for run, tracks, judged, where in again(wrong[:_PICTURES]):
        rules = ", ".join(found.broken[run] or ())
        body += lead(f"Run {run}: {rules}") + shown(tracks, judged, Limits(), where)
    return body
