"""What the hybrids of a series say of the test trials before anybody holds them against the measurement."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..identify.series import Series
from ..identify.series_run import folder
from ..identify.store import MODEL, SUMMARY
from ..ships.classes import foreign
from ..ships.files import load
from .page import number, table, text
from .spread import NAME, WIDE, Spread, load_members, spreads

Validity = Mapping[str, Mapping[str, Spread]]
"""How far the members drift apart, by key of the model and label of the test."""


def validity(series: Series, out: Path) -> dict[str, dict[str, Spread]]:
    """The spread of every fit in `out` that has members beside it, on each test trial; the first seed of a row.

    Raises:
        ShipError: members that cannot be read, or of another fit.
        DataError: a test trial lacks what the ship needs.
    """
    found: dict[str, dict[str, Spread]] = {}
    for row in series.rows:
        for cell in row.cells[:1]:
            where = folder(out, row, cell)
            if not ((where / NAME).is_file() and (where / SUMMARY).is_file()):
                continue
            ship = load(where / MODEL, trust=foreign(row.ship.model))
            told = spreads(load_members(where / NAME, ship), ship, tuple(series.tests.values()))
            found[row.key] = dict(zip(series.tests, told, strict=True))
    return found


def section(titles: Mapping[str, str], found: Validity) -> str:
    """A table of the verdicts; empty where no model has members.

    Args:
        titles: of the models, by key.
    """
    if not found:
        return ""
    tests = list(next(iter(found.values())))
    rows = [[test, *(f"{one[test].verdict}, {number(one[test].ratio, 2)}" for one in found.values())] for test in tests]
    note = (
        "Beside each fitted hybrid lie ships that its training trials allow as well (spread.npz). How far these drift "
        "apart on a test, over what nine in ten training trials do not exceed, ranks the tests by what the data leave "
        f"open; it is no error bar. Above {WIDE:g}, or with a fifth of its samples novel, a trial leaves the training "
        "data. 'seatrial predict' and 'seatrial validate' say the same of any other trial."
    )
    head = ["test trial", *(titles[key] for key in found)]
    body = table(head, rows, words=range(1, len(head)))
    return f'<h3>What the hybrids say of the tests</h3>{body}<p class="soft">{text(note)}</p>'
