"""What the hybrids of a series say of the test trials before anybody holds them against the measurement."""

from __future__ import annotations

from collections.abc import Mapping

from .network_scores import Validity
from .page import number, table, text
from .spread import WIDE


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
