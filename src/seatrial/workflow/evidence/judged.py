"""Criteria and requirements judged by draws of a fitted ship: verdicts that stand, fall or stay open with the fit.

The rule is that of a band: a verdict stands where the whole band is on its side of the limit, that is where at most
half of what lies outside a band, 2.5 % of the draws for one of 95 %, say otherwise.  Between them it is undecided.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...belief.posterior import Posterior
from ...belief.reading import posterior
from ...core.parameters import update
from ...environment import Uniform
from ...report.judging.bands import LEFT_OUT, PARAMETERS_ONLY
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
from ..request import PAGES, Note, check_output, level_of, silent
from .drawn import DRAWS, SEED, UNKNOWN, Drawing, Sailed

_DEGREE = math.degrees(1.0)
# Draws get so much more time than the fitted numbers needed, as some are slower.
_MARGIN = 1.3
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
    rows = tuple(_rows(table, asked, note, caveats))
    found = replace(
        table, rows=rows, caveats=(*caveats, *table.caveats),
        conditions={**table.conditions, "bands": f"{bands.level:g} % of {asked.count} draws", "fit": asked.held.digest},
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
    held = posterior(model)
    table = judge(held.ship, scope, elsewhere=elsewhere)
    found = judged_by(table, _ships(held, count, note), 0.01 * level)
    basis = PARAMETERS_ONLY if held.power is None else LEFT_OUT
    return replace(found, conditions={**table.conditions, "bands": f"{level:g} % of {count} draws of the parameters",
                                      "what they count": basis.words, "fit": held.digest})  # fmt: skip


def _ships(held: Posterior, count: int, note: Note) -> Iterator[Ship]:
    """Ships of so many draws; says now and then how far it is."""
    for k, drawn in enumerate(held.draws(count, SEED), 1):
        if k % _TOLD == 0:
            note(f"draw {k} of {count}")
        yield replace(held.ship, model=update(held.ship.model, dict(zip(held.names, drawn.tolist(), strict=True))))


def _rows(table: ImoTable, asked: Drawing, note: Note, caveats: dict[str, None]) -> Iterator[Criterion]:
    """The rows with their bands; rows of one run share its draws."""
    sailed: dict[int, Sailed | str] = {}
    for row in table.rows:
        source = row.source
        if source is None or row.verdict == NOT_APPLICABLE:
            yield row
            continue
        if id(source.run) not in sailed:
            note(f"draws: {row.title}")
            sailed[id(source.run)] = _sailed(asked, table, source)
        found = sailed[id(source.run)]
        if isinstance(found, str):
            where, _, remedy = found.partition(UNKNOWN)
            caveats[f"undecided rows: {remedy}" if remedy else found] = None
            yield replace(row, verdict=UNDECIDED, reason=where)
            continue
        caveats.update(dict.fromkeys(found.caveats))
        yield row.judged_by(_band(row, source, found, asked, table.L_pp), asked.level)


def _sailed(asked: Drawing, table: ImoTable, source: Source) -> Sailed | str:
    """All draws in the manoeuvre of a row, or why there are none."""
    if refused := asked.refusal(source.run):
        return refused
    ship, t = asked.held.ship, source.run.t
    run = simulate(ship, source.policy, speed=table.speed, duration=_MARGIN * source.run.duration)
    return asked.sail(ship, source.policy, run, speed=table.speed, dt=float(t[1] - t[0]), weather=Uniform())


def _band(row: Criterion, source: Source, found: Sailed, asked: Drawing, L_pp: float) -> Band:
    factor = 1.0 / L_pp if row.unit == "L" else _DEGREE
    low, high = (factor * edge for edge in found.bands.edges(source.index, asked.level))
    values = factor * found.bands.indices.get(source.index, np.full(len(found.bands.failed), np.nan))
    met = np.isfinite(values) & (values <= row.limit) & (values >= 0.0 if row.unit == "L" else True)
    return Band(low, high, float(met.mean()), len(values))
