"""Criteria and requirements judged by draws of a fitted ship: verdicts that stand, fall or stay open with the fit.

The rule is that of a band: a verdict stands where the whole band is on its side of the limit, that is where at most
half of what lies outside a band, 2.5 % of the draws for one of 95 %, say otherwise.  Between them it is undecided.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...belief.posterior import Posterior
from ...belief.reading import drawn_from
from ...core.parameters import update
from ...environment import Uniform
from ...report.judging.bands import basis_of
from ...report.judging.imo import page
from ...report.page import write
from ...ships import Ship
from ...simulate.run import simulate
from ...validate.imo import NOT_APPLICABLE, UNDECIDED, Band, Criterion, ImoTable, Source, imo_table
from ...validate.requirements import Elsewhere, Table
from ...validate.requirements.draws import judged_by
from ...validate.requirements.scopes import judge
from .. import RequestError
from ..asked import Bands, Draws
from ..request import PAGES, Note, check_output, left, level_of, silent
from .drawn import DRAWS, SEED, UNKNOWN, Drawing, Sailed

Held = np.ndarray[Any, np.dtype[np.bool_]]

_DEGREE = math.degrees(1.0)
# Draws get so much more time than the fitted numbers needed, as some are slower.
_MARGIN, _ESTIMATED = 1.3, 2.5
EXAMINED = 100
"""Draws that are examined by the requirements unless told."""
_TOLD = 20


def imo_with_bands(
    model: str, bands: Bands, *, out: Path | None = None, note: Note = silent
) -> ImoTable:
    """Judge a fitted ship by IMO MSC.137(76), each criterion by all draws; writes a page where `out` is given.

    Args:
        bands: those that are asked for; criteria of a run that leaves the trials of the fit are undecided unless it
            extrapolates.

    Raises:
        RequestError: a level or number of draws that makes no band, or an output that is no page.
        StudyError: the model has no posterior (says which command makes one), or the calibration of another fit.
        ShipError: a ship without a steady approach.
    """
    check_output(out, PAGES, "the page of the criteria")
    asked = Drawing.of(model, bands)
    table = imo_table(asked.held.ship)
    caveats: dict[str, None] = {}
    judged = tuple(_rows(table, asked, note, caveats))
    every = [met for _, met in judged if met is not None]
    found = replace(
        table, rows=tuple(row for row, _ in judged), caveats=(*caveats, *table.caveats),
        together=float(np.logical_and.reduce(every).mean()) if every and not asked.held.fitted else None,
        conditions={**table.conditions, "bands": f"{bands.level:g} % of {asked.count} draws",
                    **({"fit": asked.held.digest} if asked.held.fitted else {"draws": "of the sigmas of an estimate"})},
    )  # fmt: skip
    if out is not None:
        note(f"wrote {write(out, page(found))}")
    return found


def requirements_with_bands(
    model: str, scope: str, bands: Draws, elsewhere: Elsewhere, *, note: Note = silent
) -> Table:
    """Judge a fitted ship by Sawada 2024 section 6, each item of its motion by all draws.

    The draws are those of the parameters alone: the items ask for physics that is there or not, not for a track.

    Args:
        bands: those that are asked for; 100 draws unless it says another number.
        elsewhere: checks of interfaces, by item.

    Raises:
        RequestError: a level or number of draws that makes no band.
        StudyError: the model has no posterior (says which command makes one).
    """
    level, count = level_of(bands), EXAMINED if bands.count is None else bands.count
    least = round(200.0 / (100.0 - level) + 0.5)
    if not least <= count <= DRAWS:
        raise RequestError(f"--draws is {count}; requirements at {level:g} percent take {least} to {DRAWS}")
    held = drawn_from(model)
    table = judge(held.ship, scope, elsewhere=elsewhere)
    found = judged_by(table, _ships(held, count, note), 0.01 * level)
    basis = basis_of(held)
    return replace(found, conditions={**table.conditions, "bands": f"{level:g} % of {count} draws of the parameters",
                                      "what they count": basis.words, "fit": held.digest})  # fmt: skip


def _ships(held: Posterior, count: int, note: Note) -> Iterator[Ship]:
    """Ships of so many draws; says now and then how far it is."""
    begun = time.monotonic()
    for k, drawn in enumerate(held.draws(count, SEED), 1):
        if k % _TOLD == 0:
            note(f"draw {k} of {count}{left(begun, k - 1, count)}")
        yield replace(held.ship, model=update(held.ship.model, dict(zip(held.names, drawn.tolist(), strict=True))))


def _rows(
    table: ImoTable, asked: Drawing, note: Note, caveats: dict[str, None]
) -> Iterator[tuple[Criterion, Held | None]]:
    """The rows with their bands, and which draws meet each; rows of one run share its draws."""
    sailed: dict[int, Sailed | str] = {}
    every = len({id(row.source.run) for row in table.rows if row.source is not None and row.verdict != NOT_APPLICABLE})
    begun = time.monotonic()
    for row in table.rows:
        source = row.source
        if source is None or row.verdict == NOT_APPLICABLE:
            yield row, None
            continue
        if id(source.run) not in sailed:
            note(f"draws: {row.title}{left(begun, len(sailed), every)}")
            sailed[id(source.run)] = _sailed(asked, table, source)
        found = sailed[id(source.run)]
        if isinstance(found, str):
            where, _, remedy = found.partition(UNKNOWN)
            caveats[f"undecided rows: {remedy}" if remedy else found] = None
            yield replace(row, verdict=UNDECIDED, reason=where), None
            continue
        for line in found.caveats:
            _kept(caveats, line)
        kept = replace(row, source=replace(source, draws=found.bands))
        yield (kept.judged_by(_band(row, source, found, asked, table.L_pp), asked.level),
               _met(row, source, found, table.L_pp))  # fmt: skip


def _kept(caveats: dict[str, None], line: str) -> None:
    """Add a caveat; of several that differ by the number of draws that failed the greatest stays."""
    count, draws, rest = line.partition(" of ")
    same = next((one for one in caveats if draws and count.isdigit() and one.partition(" of ")[2] == rest), None)
    if same is None or int(same.partition(" ")[0]) < int(count):
        caveats.pop(same or "", None)
        caveats[line] = None


def _sailed(asked: Drawing, table: ImoTable, source: Source) -> Sailed | str:
    """All draws in the manoeuvre of a row, or why there are none."""
    if refused := asked.refusal(source.run):
        return refused
    ship, t = asked.held.ship, source.run.t
    margin = _MARGIN if asked.held.fitted else _ESTIMATED
    run = simulate(ship, source.policy, speed=table.speed, duration=margin * source.run.duration)
    return asked.sail(ship, source.policy, run, speed=table.speed, dt=float(t[1] - t[0]), weather=Uniform())


def _factor(row: Criterion, L_pp: float) -> float:
    return 1.0 / L_pp if row.unit == "L" else _DEGREE


def _met(row: Criterion, source: Source, found: Sailed, L_pp: float) -> Held:
    """Whether each draw meets the criterion; one that does not give the value does not."""
    values = _factor(row, L_pp) * found.bands.indices.get(source.index, np.full(len(found.bands.failed), np.nan))
    return np.isfinite(values) & (values <= row.limit) & (values >= 0.0 if row.unit == "L" else True)


def _band(row: Criterion, source: Source, found: Sailed, asked: Drawing, L_pp: float) -> Band:
    low, high = (_factor(row, L_pp) * edge for edge in found.bands.edges(source.index, asked.level))
    return Band(low, high, float(_met(row, source, found, L_pp).mean()), len(found.bands.failed))
