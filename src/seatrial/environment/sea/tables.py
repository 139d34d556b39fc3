"""Operators from a table of comma-separated text: frequency, direction, amplitudes and phases.

The header names each column with its unit: ``omega [rad/s]`` or ``T [s]``, ``chi [deg]`` or ``[rad]``, and for each
motion ``heave [m/m]`` or ``roll [rad/m]`` or ``[deg/m]`` with ``heave_phase [deg]`` or ``[rad]``.  Axes and phases are
those of `rao.Rao`.  Rows are sorted by direction and frequency, either first, and lack no pair of them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...core.constants import GRAVITY
from ...core.parameters import unknown
from ...data import Array, DataError
from ...data.table import lines_of, numbers, once, within
from .rao import MODES, Rao

_HEAD = re.compile(r"\s*(\w+)\s*\[\s*([\w/]+)\s*\]\s*")
_ANGLE = {"rad": 1.0, "deg": math.pi / 180.0}
_UNITS = {
    "omega": {"rad/s": 1.0}, "T": {"s": 1.0}, "chi": _ANGLE,
    **{mode: {"m/m": 1.0} if k < 3 else {"rad/m": 1.0, "deg/m": math.pi / 180.0} for k, mode in enumerate(MODES)},
    **{f"{mode}_phase": _ANGLE for mode in MODES},
}  # fmt: skip
_TURN = 4.0 * math.pi
# A wave's slope is k per metre: pitch and yaw remain below a few of it, roll at resonance below some ten.
_STEEPEST = {"roll": 50.0, "pitch": 12.0, "yaw": 12.0}


def read_table(path: Path) -> Rao:
    """Operators from a table.

    Raises:
        DataError: a column without unit or partner, gaps, unsorted rows, angles in degrees that are called radians.
    """
    lines = lines_of(path)
    heads = [cell.strip() for cell in lines[0].split(",")]
    names, factors = _columns(path, heads)
    table, rows = numbers(path, lines, 1, heads, ",")
    if len(table) < 2:
        raise DataError(f"{path}: {len(table)} rows; give a row for each frequency and direction")
    _no_gap(path, table, heads, rows)
    table = table * np.array(factors)
    seen = {name: table[:, k] for k, name in enumerate(names)}
    omega = seen["omega"] if "omega" in seen else 2.0 * math.pi / np.maximum(seen["T"], 1e-9)
    if not (omega > 0.0).all() or not np.isfinite(omega).all():
        raise DataError(f"{path}: line {rows[int(np.argmin(omega))]}: a frequency of zero or less; give those above 0")
    for name, column in seen.items():
        _as_said(path, name, column, rows)
    grid, angles = _grid(path, omega, seen["chi"], rows)
    R = np.zeros((grid.size, angles.size, 6), dtype=np.complex128)
    place = np.searchsorted(grid, omega), np.searchsorted(angles, seen["chi"])
    for k, mode in enumerate(MODES):
        if mode in seen:
            R[*place, k] = seen[mode] * np.exp(1j * seen[f"{mode}_phase"])
            _of_a_ship(path, mode, np.abs(R[:, :, k]), grid)
    with within(path):
        return Rao.of(grid, angles, R, str(path))


def _columns(path: Path, heads: Sequence[str]) -> tuple[list[str], list[float]]:
    """Names and factors to SI of the columns."""
    names: list[str] = []
    factors: list[float] = []
    for head in heads:
        found = _HEAD.fullmatch(head)
        name = found[1] if found else head
        if name not in _UNITS:
            raise DataError(f"{path}: line 1: {unknown(name, _UNITS, 'column')}")
        units = _UNITS[name]
        if found is None or found[2] not in units:
            raise DataError(f"{path}: line 1: column '{head}': write its unit, '{name} [{' or '.join(units)}]'")
        names.append(name)
        factors.append(units[found[2]])
    once(path, 1, names, _UNITS)
    if ("omega" in names) == ("T" in names):
        raise DataError(f"{path}: line 1: give one column of frequency, 'omega [rad/s]' or 'T [s]'")
    if "chi" not in names:
        raise DataError(f"{path}: line 1: no column of directions; give 'chi [deg]', 0 following and 180 head sea")
    given = [mode for mode in MODES if mode in names or f"{mode}_phase" in names]
    for mode in given:
        if (mode in names) != (f"{mode}_phase" in names):
            raise DataError(f"{path}: line 1: {mode} and {mode}_phase go together; give both or none")
    if not given:
        raise DataError(f"{path}: line 1: no motion; give columns such as 'heave [m/m]' and 'heave_phase [deg]'")
    return names, factors


def _no_gap(path: Path, table: Array, heads: Sequence[str], rows: Sequence[int]) -> None:
    holes = np.argwhere(np.isnan(table))
    if holes.size:
        row, column = holes[0]
        raise DataError(
            f"{path}: column '{heads[column]}', line {rows[row]}: a gap; give a number, operators have none"
        )


def _as_said(path: Path, name: str, column: Array, rows: Sequence[int]) -> None:
    """Refuse angles beyond two turns, which are degrees, and amplitudes below zero."""
    if name == "chi" or name.endswith("_phase"):
        beyond = np.flatnonzero(np.abs(column) > _TURN + 1e-9)
        if beyond.size:
            value = column[beyond[0]]
            raise DataError(f"{path}: column '{name}', line {rows[beyond[0]]}: {value:.4g} rad is beyond two turns; "
                            f"if it is in degrees, call it '{name} [deg]'")  # fmt: skip
    elif (column < 0.0).any():
        below = int(np.flatnonzero(column < 0.0)[0])
        raise DataError(f"{path}: column '{name}', line {rows[below]}: {column[below]:.4g} is below zero; "
                        "an amplitude is not, turn its phase by 180 deg")  # fmt: skip


def _grid(path: Path, omega: Array, chi: Array, rows: Sequence[int]) -> tuple[Array, Array]:
    """Frequencies and directions of a table that holds each pair once, in order."""
    straight = np.arange(omega.size)
    orders = [np.lexsort(keys) for w in (omega, -omega) for keys in ((w, chi), (chi, w))]
    agree = max(int(np.argmax(order != straight)) if (order != straight).any() else omega.size for order in orders)
    if agree < omega.size:
        raise DataError(f"{path}: line {rows[agree]}: not sorted; sort the rows by direction, then by frequency")
    pairs = list(zip(omega.tolist(), chi.tolist(), strict=True))
    for k in range(1, len(pairs)):
        if pairs[k] == pairs[k - 1]:
            raise DataError(f"{path}: line {rows[k]}: frequency and direction of the row before; keep one")
    grid, angles = np.unique(omega), np.unique(chi)
    there = set(pairs)
    for one in angles.tolist():
        for other in grid.tolist():
            if (other, one) not in there:
                raise DataError(f"{path}: no row for omega {other:.4g} rad/s at chi {math.degrees(one):.4g} deg; "
                                "give one for each frequency at each direction")  # fmt: skip
    return grid, angles


def _of_a_ship(path: Path, mode: str, amplitude: Array, omega: Array) -> None:
    """Refuse rotations that no ship has, which are degrees called radians."""
    if mode not in _STEEPEST:
        return
    times = amplitude / (omega**2 / GRAVITY)[:, None]
    at = np.unravel_index(int(np.argmax(times)), times.shape)[0]
    if times.max() > _STEEPEST[mode]:
        raise DataError(f"{path}: {mode} at {omega[at]:.3g} rad/s is {times.max():.3g} times the slope of the wave; "
                        f"if it is in degrees, call it '{mode} [deg/m]'")  # fmt: skip
