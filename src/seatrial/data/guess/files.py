"""Files of a log as tables of text: text in any layout, workbooks, Parquet."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .. import DataError
from ..inside import hold_workbook, read_frame
from ..table import existing
from .layout import ROWS, Layout, Table, read_text
from .naming import unit_of

TEXTS = (".csv", ".tsv", ".txt", ".dat", ".log", ".asc")
SHEETS = (".xlsx", ".xlsm", ".xls")
TABLES = (*TEXTS, *SHEETS, ".parquet")
"""Suffixes of the files that are looked at."""


def read_table(path: Path) -> Table:
    """One file as a table of text, at most `ROWS` rows of it.

    Raises:
        DataError: it cannot be read, or it is no table.
    """
    suffix = existing(path).suffix.lower()
    if suffix == ".parquet":
        return _parquet(path)
    return _workbook(path) if suffix in SHEETS else read_text(path)


def _parquet(path: Path) -> Table:
    frame = read_frame(path)
    head = frame.head(ROWS)
    columns = tuple(tuple(_cell(value) for value in head[name].to_list()) for name in head.columns)
    return Table(path, Layout(), tuple(head.columns), ("",) * len(columns), columns, frame.height > ROWS)


def _workbook(path: Path) -> Table:
    """The first sheet that holds a table; rows above the header are the lines before it."""
    import polars

    hold_workbook(path)
    try:
        sheets: dict[str, Any] = polars.read_excel(
            path, sheet_id=0, engine="calamine", has_header=False, infer_schema_length=0, raise_if_empty=False
        )
    except ImportError:
        raise DataError(f"{path}: workbooks need the extra 'log': pip install 'seatrial[log]'") from None
    except Exception as error:  # whatever the readers raise on a damaged workbook
        raise DataError(f"{path}: not readable as a workbook: {(str(error).splitlines() or [''])[0][:120]}") from None
    for k, (name, frame) in enumerate(sheets.items()):
        rows = [[_cell(value) for value in row] for row in frame.head(ROWS + 50).iter_rows()]
        if (found := _of_sheet(path, name if k else "", rows)) is not None:
            return found
    raise DataError(f"{path}: no sheet with a header and rows of numbers")


def _of_sheet(path: Path, sheet: str, rows: list[list[str]]) -> Table | None:
    """A sheet as a table; None for one without a header above rows of numbers."""
    from .layout import is_value

    width = max((len(row) for row in rows), default=0)
    first = next((k for k, row in enumerate(rows) if sum(is_value(cell) for cell in row) >= max(2, width // 3)), 0)
    if first == 0 or len(rows) - first < 2:
        return None
    units: list[str] = []
    head = first - 1
    if head and sum(bool(unit_of(cell)) for cell in rows[head]) >= 0.6 * sum(bool(cell) for cell in rows[head]):
        units, head = rows[head], head - 1
    named = [k for k, cell in enumerate(rows[head]) if cell]
    body = rows[first:]
    columns = tuple(tuple(row[k] for row in body) for k in named)
    layout = Layout(skip=head, units_row=1 if units else 0, sheet=sheet)
    said = tuple(units[k] for k in named) if units else ("",) * len(named)
    return Table(path, layout, tuple(rows[head][k] for k in named), said, columns)


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return value.isoformat() if hasattr(value, "isoformat") else str(value).strip()
