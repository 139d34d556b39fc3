"""Tables of a notebook: printed, shown as HTML, and handed to any library of data frames."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..report import page
from ..report.blocks import Body, Cell, Table, plain_text

if TYPE_CHECKING:
    import polars as pl

# The columns of words, as a notebook brings a style of its own.
_STYLE = "<style>.seatrial :is(th,td):is(.text,:first-child){text-align:left}</style>"


def table_of(
    title: str, head: tuple[str, ...], rows: tuple[tuple[Cell, ...], ...], notes: tuple[str, ...] = ()
) -> Table:
    """A table that stands alone; columns of numbers stand to the right."""
    words = tuple(k for k in range(len(head)) if not all(_is_number(row[k]) for row in rows))
    return Table(head, rows, words, title=title, notes=notes)


def html(body: Body) -> str:
    """Blocks in a notebook."""
    return f'{_STYLE}<div class="seatrial">{page.html(body)}</div>'


class Tabular(ABC):
    """What is a table: `print` and a notebook show it, `to_frame` or the Arrow interface hand it on."""

    @property
    @abstractmethod
    def table(self) -> Table:
        """Its rows."""

    def __repr__(self) -> str:
        return "\n".join(plain_text((self.table,)))

    def _repr_html_(self) -> str:
        return html((self.table,))

    def to_frame(self) -> pl.DataFrame:
        """The rows as a Polars data frame; any other library reads it by the Arrow interface."""
        shown = self.table
        return frame({name: [row[k] for row in shown.rows] for k, name in enumerate(shown.head)})

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        """The Arrow PyCapsule interface: ``pandas.DataFrame.from_arrow(x)``, ``pyarrow.table(x)``, ..."""
        return self.to_frame().__arrow_c_stream__(requested_schema)


def frame(columns: dict[str, Sequence[Cell]]) -> pl.DataFrame:
    """A Polars data frame of these columns; a column that mixes whole and other numbers holds the latter."""
    import polars as pl

    return pl.DataFrame(columns, strict=False)


def _is_number(cell: Cell) -> bool:
    return cell is None or isinstance(cell, int | float)
