"""A ship file before it enters the library: sources, conformance, published indices; the evidence on a page."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Literal

from ...core.errors import SeatrialError
from ...core.values import dataclass
from ...ships import Ship
from ..request import Note, make_folder, ship_of, silent
from ..simulation import Simulated, simulate
from .published import Reproduced, Standing, published, reproduce, shown, standing

State = Literal["ok", "note", "error"]
_KEY = re.compile(r"(?P<name>[a-z_]+?)(?P<year>(?:18|19|20)\d\d)[a-z]?\b")
"""A key of a publication at the beginning of a source."""
_ASSUMED = re.compile(r"^assumed\b|; assumed\b")
"""A number that is assumed, or one part of which is."""
_NAMED = 3
_LEAST_REASON = 12
"""Letters of a source "assumed: reason"; fewer are no reason."""


@dataclass(frozen=True)
class Finding:
    """One thing that was checked.

    Attributes:
        what: the check.
        state: "ok", "note" (does not apply, or worth knowing), "error" (not fit for the library).
        detail: what was found.
    """

    what: str
    state: State
    detail: str


@dataclass(frozen=True)
class Checked:
    """A ship file with its findings and the published indices as its model gives them."""

    ship: Ship
    standing: Standing
    findings: tuple[Finding, ...]
    reproduced: tuple[Reproduced, ...]

    @property
    def fit(self) -> bool:
        """Whether nothing stands against it."""
        return not any(one.state == "error" for one in self.findings)


def check_ship_file(name_or_path: str | Path, out: Path | None = None, note: Note = silent) -> Checked:
    """Check a ship file, and write the evidence to a page.

    Args:
        out: the page (.html), with its numbers beside it as .json.

    Raises:
        ShipError: a file that is no ship.
        RequestError: published indices that cannot be read.
    """
    ship = ship_of(str(name_or_path))
    reproduced = reproduce(ship, published(ship))
    findings = (*_notes(ship), *_sources(ship), _validity(ship), *_conformance(ship), *_published(ship, reproduced))
    checked = Checked(ship, standing(ship), findings, reproduced)
    if out is not None:
        make_folder(out.parent)
        from ...report.judging.ship_evidence import Row, page  # a command that names a ship needs no page
        from ...report.page import write

        rows = [Row(one.published.manoeuvre, dict(one.published.settings), one.published.index,
                    shown(one.published, one.published.value), shown(one.published, one.value), one.ratio,
                    one.published.within, one.kept, one.published.source) for one in reproduced]  # fmt: skip
        drawn = {kind: run for kind in ("turning", "zigzag") if (run := _run(ship, kind)) is not None}
        write(out, page(ship, [(one.what, one.state, one.detail) for one in findings], rows,
                        {kind: run.trial for kind, run in drawn.items()}))  # fmt: skip
        note(f"wrote {out}")
    return checked


def _run(ship: Ship, kind: str) -> Simulated | None:
    try:
        return simulate(ship, kind)
    except SeatrialError:
        return None


def _notes(ship: Ship) -> Iterator[Finding]:
    invented = all(entry.source.startswith("assumed") for entry in ship.entries.values())
    for key, why in (("title", "what the ship is"), ("references", "where its numbers are published")):
        said = ship.notes.get(key)
        if key == "references" and not said and invented:
            yield Finding("notes.references", "note", "none, and every number is assumed")
            continue
        yield Finding(f"notes.{key}", "ok", "given") if said else Finding(f"notes.{key}", "error", f"missing: {why}")
    cautions = ship.notes.get("cautions", ())
    yield Finding("notes.cautions", "ok" if cautions else "note",
                  f"{len(cautions)} given" if cautions else "none: a model without limits is rare")  # fmt: skip


def _sources(ship: Ship) -> Iterator[Finding]:
    bare = [path for path, entry in ship.entries.items() if not entry.source.strip()]
    if bare:
        yield Finding("sources", "error", f"{len(bare)} numbers without one: {_some(bare)}")
    hollow = [path for path, entry in ship.entries.items()
              if entry.source.startswith("assumed") and len(entry.source) < _LEAST_REASON]  # fmt: skip
    if hollow:
        yield Finding("reasons", "error", f"assumed without a reason, or with none to speak of: {_some(hollow)}; "
                      "write assumed: and why")  # fmt: skip
    unknown = _unexplained(ship)
    if unknown:
        yield Finding("keys", "error", f"no reference says what {', '.join(sorted(unknown)[:3])} is; add it to "
                      "`references` in [notes], with author and year")  # fmt: skip
    if not bare:
        assumed = sum(bool(_ASSUMED.search(entry.source)) for entry in ship.entries.values())
        yield Finding("sources", "ok", f"{len(ship.entries)} numbers, {assumed} of them assumed")


def _some(paths: list[str]) -> str:
    """The first paths, and how many more there are."""
    more = len(paths) - _NAMED
    return ", ".join(paths[:_NAMED]) + (f" and {more} more" if more > 0 else "")


def _unexplained(ship: Ship) -> set[str]:
    """Keys such as clarke1983 that sources begin with and no reference has, neither as such nor as name and year."""
    references = str([ship.notes.get("references"), ship.notes.get("title")]).lower()
    found = (_KEY.match(entry.source) for entry in ship.entries.values())
    return {key[0] for key in found if key and key[0] not in references
            and not (key["name"] in references and key["year"] in references)}  # fmt: skip


def _validity(ship: Ship) -> Finding:
    if "u" in ship.validity:
        return Finding("validity", "ok", ", ".join(ship.validity))
    return Finding("validity", "error", "[validity] has no u: state at which speeds through the water the model holds")


def _conformance(ship: Ship) -> Iterator[Finding]:
    from ...testing import FORCE_CHECKS, SHIP_CHECKS, ContractError, parts_of

    for name, check in SHIP_CHECKS.items():
        yield _tried(name, partial(check, ship), ContractError)
    for part_name, part in parts_of(ship):
        for name, check in FORCE_CHECKS.items():
            yield _tried(f"{part_name}: {name}", partial(check, part), ContractError)


def _tried(name: str, check: Callable[[], str | None], failed: type[Exception]) -> Finding:
    what = f"conformance, {name.replace('_', ' ')}"
    try:
        why = check()
    except failed as error:
        return Finding(what, "error", str(error))
    return Finding(what, "note", f"does not apply: {why}") if why else Finding(what, "ok", "holds")


def _published(ship: Ship, found: tuple[Reproduced, ...]) -> Iterator[Finding]:
    if not found:
        reason = str(ship.notes.get("unverified", ""))
        yield (Finding("published indices", "note", f"not verified: {reason}") if reason else
               Finding("published indices", "error", "none: add [[notes.published]], or say why there is none as "
                       "unverified = \"...\" in [notes]"))  # fmt: skip
    for one in found:
        what = f"{'code' if one.published.by == 'code' else 'measured'}, {one.published.index.replace('_', ' ')}"
        if math.isnan(one.value):
            yield Finding(what, "error", f"not reached: {one.reason}")
            continue
        wanted = f"published {shown(one.published, one.published.value)} ({one.published.by}: {one.published.source})"
        text = f"{shown(one.published, one.value)}, {wanted}; within {100 * one.published.within:g} % asked"
        yield Finding(what, "ok" if one.kept else "error", text)
