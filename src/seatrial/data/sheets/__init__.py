"""Files whose tables are packed: workbooks, Parquet, MATLAB's .mat of version 5, 7 and 7.3, NumPy's .npy and .npz.

A file of arrays is read as a tree of what it holds, of which tables of variables of one length are made:

- a structure whose fields are those of another beside it is a table of its own, such as a trial; others are one table;
- fields have the last part of their path as a name, where that is theirs alone;
- a matrix is one column for each of its shorter side, named by a cell of as many texts beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from ...core import unpacking
from ...core.errors import first_line
from ...core.parameters import unknown
from ...core.values import dataclass
from .. import DataError
from ..inside import read_frame, workbook
from ..table import bytes_of
from .hdf import tree_of_hdf
from .matlab import tree_of_mat
from .tree import Foreign, Tree, sheets

if TYPE_CHECKING:
    import polars as pl

__all__ = ["ARRAYS", "PARQUET", "WORKBOOKS", "Sheets", "packed", "sheets_of"]

WORKBOOKS, PARQUET, ARRAYS = (".xlsx", ".xlsm", ".xls", ".ods"), (".parquet",), (".mat", ".npy", ".npz")


@dataclass(frozen=True)
class Sheets:
    """The tables of a file.

    Attributes:
        path: of the file.
        names: of its tables; "" for one without a name.
        load: gives one of them by its name.
        headed: whether the columns have names; else the first rows of a table are those above its header.
        apart: what the file holds beside them, in words.
    """

    path: Path
    names: tuple[str, ...]
    load: Callable[[str], pl.DataFrame]
    headed: bool
    apart: tuple[str, ...] = ()

    def one(self, name: str | None) -> pl.DataFrame:
        """A table by its name; None for the first.

        Raises:
            DataError: no such table, or one that is not readable.
        """
        if name is not None and name not in self.names:
            raise DataError(f"{self.path}: {unknown(name, self.names, 'sheet')}")
        return self.load(self.names[0] if name is None else name)


def packed(path: Path) -> bool:
    """Whether a file is one of these, by its suffix."""
    return path.suffix.lower() in (*WORKBOOKS, *PARQUET, *ARRAYS)


def sheets_of(path: Path) -> Sheets:
    """The tables of a packed file.

    Raises:
        DataError: a damaged file, or one that holds too much; a reader that is missing.
    """
    suffix = path.suffix.lower()
    if suffix in WORKBOOKS:
        return _of_workbook(path)
    if suffix in PARQUET:
        frame = read_frame(path)
        return Sheets(path, ("",), lambda _: frame, True)
    return _of_arrays(path)


def _of_workbook(path: Path) -> Sheets:
    with workbook(path):
        import fastexcel

        book = fastexcel.read_excel(path)

    def load(name: str) -> pl.DataFrame:
        """Cells of a sheet as texts, from its first row."""
        try:
            return book.load_sheet(name, header_row=None, skip_rows=0, dtypes="string").to_polars()
        except Exception as error:  # whatever the reader raises on a damaged sheet
            raise DataError(f"{path}: sheet '{name}' is not readable: {first_line(error, 120)}") from None

    return Sheets(path, tuple(book.sheet_names), load, False)


def _of_arrays(path: Path) -> Sheets:
    raw = bytes_of(path)
    try:
        found, apart = sheets(_reader(path, raw)(raw))
    except ImportError:
        raise DataError(f"{path}: MATLAB files of version 7.3 need the extra 'log': pip install 'seatrial[log]'; "
                        "or in MATLAB: save('FILE.mat', '-v7')") from None  # fmt: skip
    except ValueError as error:
        raise DataError(f"{path}: not readable: {error}") from None
    if not found:
        raise DataError(f"{path}: no table in it: {'; '.join(apart) or 'no two variables of one length'}")
    return Sheets(path, tuple(found), lambda name: found[name], True, apart)


def _reader(path: Path, raw: bytes) -> Callable[[bytes], Tree]:
    hdf = raw.startswith(b"MATLAB 7.3 MAT-file") or raw[512:520] == b"\x89HDF\r\n\x1a\n"
    return {".npy": _of_npy, ".npz": _of_npz}.get(path.suffix.lower(), tree_of_hdf if hdf else tree_of_mat)


def _of_npy(raw: bytes) -> Tree:
    """The fields of a .npy file, or its array without a name; no pickles, which are programs.

    Raises:
        ValueError: no such file, a damaged one, objects, or fewer values than it says.
    """
    found = unpacking.array(raw)
    return _fields(found) if found.dtype.names else {"": found}


def _of_npz(raw: bytes) -> Tree:
    """The arrays of a .npz file; those with named fields are structures.

    Raises:
        ValueError: no such file, a damaged one, objects, or too much.
    """
    return {name: _fields(one) if one.dtype.names else _plain(one) for name, one in unpacking.unpacked(raw).items()}


def _fields(table: NDArray[Any]) -> dict[str, Any]:
    return {name: _fields(part) if part.dtype.names else _plain(part)
            for name in table.dtype.names or () for part in (table[name],)}  # fmt: skip


def _plain(values: NDArray[Any]) -> Any:
    return values if values.dtype.kind in "fiubUSM" else Foreign(str(values.dtype))
