"""What designed trials would be worth: bands of the IMO indices by what is known before them, and after them.

Before are the priors of the design, or the posterior of a fitted ship; after, the Fisher information of the trials is
added to it.  The bands count what is open about the free parameters and nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ...belief.bands.manoeuvring import Bands, bands
from ...belief.posterior import Posterior
from ...belief.reading import drawn_from
from ...core.values import dataclass
from ...data import Array
from ...environment import Uniform
from ...identify import StudyError
from ...identify.design.excitation import Plan, before
from ...ships import Ship
from ...validate.imo import Criterion, ImoTable, imo_table
from .. import RequestError
from ..asked import Draws
from ..request import Note, level_of, silent

DRAWS, _LEAST, _MOST = 400, 100, 20_000
_SEED, _MARGIN = 1, 1.3
_DEGREE = math.degrees(1.0)


@dataclass(frozen=True)
class Foreseen:
    """An index of the ship and its bands.

    Attributes:
        name, unit: of the index, as the IMO table has them.
        value: by the numbers of the ship.
        before, after: lower and upper edge without and with the designed trials; NaN where too few draws give it.
    """

    name: str
    unit: str
    value: float
    before: tuple[float, float]
    after: tuple[float, float]

    @property
    def share(self) -> float:
        """Width after over width before; NaN where one is not known."""
        widths = [high - low for low, high in (self.after, self.before)]
        return widths[0] / widths[1] if widths[1] > 0.0 else math.nan


def foreseen(
    ship: Ship, plan: Plan, asked: Draws, *, model: str | Path | None = None, note: Note = silent
) -> tuple[Foreseen, ...]:
    """Bands of the IMO indices before and after the trials of a plan.

    Args:
        asked: the bands; 400 draws unless it says another number.
        model: file of the ship, whose posterior is taken where it is fitted, and what it states where it is estimated.

    Raises:
        RequestError: a level or number of draws that makes no band.
    """
    level, count = level_of(asked), DRAWS if asked.count is None else asked.count
    if not _LEAST <= count <= _MOST:
        raise RequestError(f"--draws is {count}; bands of a design take {_LEAST} to {_MOST}")
    mean = np.array([one.start for one in plan.free])
    now = _known(plan, model, note)
    then: Array = np.asarray(np.linalg.inv(np.linalg.inv(now) + plan.information), dtype=np.float64)
    table = imo_table(ship)
    sides = [dict(_banded(table, Posterior(ship, plan.free, mean, one), count)) for one in (now, then)]
    return tuple(_row(row, level, table.L_pp, *(side[row.title] for side in sides))
                 for row in table.rows if row.title in sides[0])  # fmt: skip


def _known(plan: Plan, model: str | Path | None, note: Note) -> Array:
    """Covariance of the free parameters before the trials: of the fit for those that it has, else of their priors."""
    out = np.diag(before(plan.free) ** 2)
    try:
        held = None if model is None else drawn_from(str(model))
    except StudyError:
        held = None
    if held is None:
        note("note: before the trials the parameters are as open as their priors: as wide as their own size")
        return out
    own = {name: k for k, name in enumerate(held.names)}
    pairs = [(k, own[one.path]) for k, one in enumerate(plan.free) if one.path in own]
    if pairs:
        mine, theirs = map(list, zip(*pairs, strict=True))
        out[np.ix_(mine, mine)] = held.covariance[np.ix_(theirs, theirs)]
    said = "the fit leaves them" if held.fitted else "the estimate states them"
    note(f"note: before the trials {len(pairs)} of {len(plan.free)} parameters are as open as {said}")
    return out


def _banded(table: ImoTable, one: Posterior, count: int) -> Iterator[tuple[str, Bands]]:
    """Draws of each run of the table, by the titles of its rows."""
    drawn, made = one.draws(count, _SEED), dict[int, Bands]()
    for row in table.rows:
        source = row.source
        if source is None or row.value is None:
            continue
        if id(source.run) not in made:
            t = source.run.t
            made[id(source.run)] = bands(
                one.ship, source.policy, one.names, drawn, speed=table.speed,
                duration=_MARGIN * source.run.duration, dt=float(t[1] - t[0]), weather=Uniform(), held=False,
            )  # fmt: skip
        yield row.title, made[id(source.run)]


def _row(row: Criterion, level: float, L_pp: float, *sides: Bands) -> Foreseen:
    factor = 1.0 / L_pp if row.unit == "L" else _DEGREE
    index = row.source.index if row.source else ""
    edges = [tuple(factor * edge for edge in one.edges(index, 0.01 * level)) for one in sides]
    (a, b), (c, d) = edges
    return Foreseen(row.title, row.unit, float(row.value or 0.0), (a, b), (c, d))


def document(found: Sequence[Foreseen], level: float) -> Mapping[str, object]:
    """For JSON."""
    def both(edges: tuple[float, float]) -> list[float | None]:
        return [None if math.isnan(one) else one for one in edges]

    return {"level": level, "indices": [
        {"index": one.name, "unit": one.unit, "value": one.value, "before": both(one.before), "after": both(one.after)}
        for one in found]}  # fmt: skip
