"""Tables of a notebook: printed, shown as HTML, and handed to any library of data frames."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..report.page import number, text

if TYPE_CHECKING:
    import polars as pl

Cell = str | float | int | None

_DIGITS = 4


@dataclass(frozen=True)
class Table:
    """Rows under headings.

    Attributes:
        title: one line above it.
        head: name of each column.
        rows: cells; a number stays a number, None is empty.
        notes: lines below it.
    """

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    notes: tuple[str, ...] = ()

    def printed(self) -> str:
        """The table as text, numbers to the right."""
        cells = [self.head, *(tuple(map(_shown, row)) for row in self.rows)]
        widths = [max(len(row[k]) for row in cells) for k in range(len(self.head))]
        right = [bool(self.rows) and all(_is_number(row[k]) for row in self.rows) for k in range(len(self.head))]
        lines = ["  ".join(cell.rjust(width) if to_right else cell.ljust(width)
                           for cell, width, to_right in zip(row, widths, right, strict=True)).rstrip()
                 for row in cells]  # fmt: skip
        return "\n".join([self.title, *(lines if self.rows else []), *self.notes])

    def html(self) -> str:
        """The table as HTML."""
        sides = ["right" if all(_is_number(row[k]) for row in self.rows) else "left" for k in range(len(self.head))]
        cells = [("th", self.head), *(("td", tuple(map(_shown, row))) for row in self.rows)]
        lines = ["<tr>" + "".join(f"<{kind} style='text-align:{side}'>{text(cell)}</{kind}>"
                                  for cell, side in zip(row, sides, strict=True)) + "</tr>"
                 for kind, row in cells] if self.rows else []  # fmt: skip
        notes = "".join(f"<div>{text(note)}</div>" for note in self.notes)
        return f"<div><b>{text(self.title)}</b></div><table>{''.join(lines)}</table>{notes}"


class Tabular(ABC):
    """What is a table: `print` and a notebook show it, `to_frame` or the Arrow interface hand it on."""

    @property
    @abstractmethod
    def table(self) -> Table:
        """Its rows."""

    def __repr__(self) -> str:
        return self.table.printed()

    def _repr_html_(self) -> str:
        return self.table.html()

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


def entries(title: str, pairs: Iterable[tuple[str, object]]) -> str:
    """Names with their values as HTML."""
    lines = "".join(f"<tr><th style='text-align:left'>{text(name)}</th><td style='text-align:left'>{text(value)}</td>"
                    "</tr>" for name, value in pairs)  # fmt: skip
    return f"<div><b>{text(title)}</b></div><table>{lines}</table>"


def _is_number(cell: Cell) -> bool:
    return cell is None or isinstance(cell, int | float)


def _shown(cell: Cell) -> str:
    if isinstance(cell, float):
        return number(cell, _DIGITS).replace("−", "-")
    return "" if cell is None else str(cell)
