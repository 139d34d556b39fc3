"""Numbers of a paper beside ours: one table "printed | ours | why they differ", for the page of any study."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from decimal import Decimal
from typing import Any

from ..core.values import dataclass
from .blocks import Body, number, table

SAME = "as printed"
"""What a table says of a figure that equals the paper's."""
# Half a unit of the last digit, and a little for the rounding of binary numbers.
_SHARE = 0.5 + 1e-6


@dataclass(frozen=True)
class Row:
    """One number, or one statement in words, of a paper.

    Attributes:
        name: what it is, as the paper calls it.
        printed: as the paper prints it.
        ours: what this program finds, in the same unit.
        unit: of both; empty for words and ratios.
        why: reason of the difference; a row whose numbers are the same to the printed digits needs none.
        digit: unit of the last digit printed; None counts the decimals that the number has here, where zeros at its
            end are lost.
    """

    name: str
    printed: float | str
    ours: float | str
    unit: str = ""
    why: str = ""
    digit: float | None = None

    @property
    def same(self) -> bool:
        """Whether ours is the printed one, numbers to the digits printed."""
        if isinstance(self.printed, str) or isinstance(self.ours, str):
            return self.printed == self.ours
        off = abs(self.ours - self.printed)
        return math.isfinite(off) and off <= _SHARE * (self.digit or _digit(self.printed))

    @property
    def reason(self) -> str:
        """Why they differ; for a row that does and gives no reason, that it is not explained."""
        return SAME if self.same else self.why or "not explained"


def side_by_side(rows: Iterable[Row], *, first: str = "quantity", digits: int = 4) -> Body:
    """The table of the rows: name, printed, ours, why they differ.

    Args:
        first: heading of the first column.
        digits: significant figures of ours.
    """
    lines = [
        [row.name + (f" [{row.unit}]" if row.unit else ""), _shown(row.printed), _shown(row.ours, digits), row.reason]
        for row in rows
    ]
    return table([first, "printed", "ours", "why they differ"], lines, words=(0, 3), wide=True)


def fields(rows: Iterable[Row]) -> list[Mapping[str, Any]]:
    """The rows as fields of the JSON file beside a page."""
    return [{"name": row.name, "printed": row.printed, "ours": row.ours, "unit": row.unit, "same": row.same,
             "why": row.reason} for row in rows]  # fmt: skip


def _shown(value: float | str, digits: int = 0) -> str:
    if isinstance(value, str):
        return value
    return number(value, digits) if digits else f"{value:.12g}".replace("-", "−")


def _digit(printed: float) -> float:
    """Unit of the last digit of a number as it stands here; 1 for a whole one."""
    exponent = Decimal(repr(float(printed))).normalize().as_tuple().exponent
    return 10.0 ** min(int(exponent), 0)
