"""A field over the earth's plane: inputs of a system that are read where it is, once a step.

The field is a regular grid: one look costs the same whatever its size.  Values at the nodes are interpolated
bilinearly; what lies near (fenders, walls) is a row of numbers that holds within a cell.  Row 0 says that nothing is
near.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.values import dataclass

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Field:
    """Tables of a system's last series, read at its first two states; beyond the grid its edge holds.

    Attributes:
        names: the interpolated series.
        near: the series that hold within a cell, behind them.
        north, east: the first node [m].
        cell: distance of the nodes [m].
        table: shape (rows to the north, columns to the east, len(names)), two of each at least.
        which: the row of `sets` of each cell, shape (rows - 1, columns - 1).
        sets: shape (rows, len(near)); the first is all zeros.
    """

    names: tuple[str, ...]
    near: tuple[str, ...]
    north: float
    east: float
    cell: float
    table: Array
    which: NDArray[np.int64]
    sets: Array

    def __post_init__(self) -> None:
        rows, columns, width = self.table.shape
        if min(rows, columns) < 2 or width != len(self.names) or self.which.shape != (rows - 1, columns - 1):
            raise ValueError(f"a field of {rows} by {columns} nodes with {width} values for {len(self.names)} names")
        if self.sets.shape[1:] != (len(self.near),) or self.sets[0].any() or self.which.max() >= len(self.sets):
            raise ValueError("sets of a field: the first is of zeros, and each cell names one of them")

    @cached_property
    def _buffers(self) -> tuple[Any, ...]:
        grid = np.array([self.north, self.east, 1.0 / self.cell, *self.table.shape[:2]], dtype=np.float64)
        return (grid, np.ascontiguousarray(self.table, dtype=np.float64),
                np.ascontiguousarray(self.which, dtype=np.int64),
                np.ascontiguousarray(np.append(self.sets.ravel(), 0.0), dtype=np.float64))  # fmt: skip

    @cached_property
    def pointers(self) -> NDArray[np.int64]:
        """Addresses of grid, table, cells and sets, as the kernel takes them; they hold as long as the field does."""
        return np.array([one.ctypes.data for one in self._buffers], dtype=np.int64)

    def look(self, x: Array, y: Array) -> tuple[Array, NDArray[np.int64]]:
        """Values at places, shape (places, names and near), and the set of each."""
        rows, columns, _ = self.table.shape
        # a ship that blew up has no place; the edge is as good as any, and whoever steps it sees the NaN
        a = np.clip(np.nan_to_num((x - self.north) / self.cell), 0.0, rows - 1.0)
        b = np.clip(np.nan_to_num((y - self.east) / self.cell), 0.0, columns - 1.0)
        # the last node belongs to the cell before it, or the look would reach beyond the table
        i, j = np.minimum(a.astype(np.int64), rows - 2), np.minimum(b.astype(np.int64), columns - 2)
        a, b = (a - i)[:, None], (b - j)[:, None]
        T = self.table
        smooth = (1 - a) * ((1 - b) * T[i, j] + b * T[i, j + 1]) + a * ((1 - b) * T[i + 1, j] + b * T[i + 1, j + 1])
        which = self.which[i, j]
        return np.hstack([smooth, self.sets[which]]), which
