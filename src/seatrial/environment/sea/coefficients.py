"""Added mass and damping from a table of comma-separated text: a row a frequency, a column a pair of motions.

The header names each column with its unit: ``omega [rad/s]`` or ``T [s]``, ``A_33 [kg]``, ``B_33 [kg/s]``,
``A_35 [kg m]`` and so on, motions from 1 (surge) to 6 (yaw), in ship axes (x forward, y starboard, z down) about
midship in the water line.  A pair that is given once holds both ways.  Constants are columns as well, equal in each
row: ``M_33 [kg]``, ``C_33 [N/m]``, ``C_44 [N m]`` and ``z_G [m]``, the centre of gravity below the water line.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from ...core.parameters import unknown
from ...data import Array, DataError
from ...data.table import lines_of, numbers, once, within
from .hydrodynamics import Hydrodynamics

_HEAD = re.compile(r"\s*(\w+)\s*\[\s*([^\]]+?)\s*\]\s*")
_PAIR = re.compile(r"([ABCM])_([1-6])([1-6])")
_UNITS = {
    "A": ("kg", "kg m", "kg m^2"), "M": ("kg", "kg m", "kg m^2"), "B": ("kg/s", "kg m/s", "kg m^2/s"),
    "C": ("N/m", "N", "N m"),
}  # fmt: skip
_KNOWN = ("omega", "T", "z_G", "A_33", "B_33", "C_33", "M_33")


def read_coefficients(path: Path) -> Hydrodynamics:
    """Coefficients of a table; without wave forces.

    Raises:
        DataError, WeatherError: a column without unit, a gap, a matrix that is missing, what `Hydrodynamics` refuses.
    """
    lines = lines_of(path)
    heads = [cell.strip() for cell in lines[0].split(",")]
    names = [_name(path, head) for head in heads]
    once(path, 1, names, names)
    table, rows = numbers(path, lines, 1, heads, ",")
    holes = np.argwhere(np.isnan(table))
    if holes.size:
        row, column = holes[0]
        raise DataError(f"{path}: column '{heads[column]}', line {rows[row]}: a gap; give a number at each frequency")
    seen = dict(zip(names, table.T, strict=True))
    if ("omega" in seen) == ("T" in seen):
        raise DataError(f"{path}: line 1: give one column of frequency, 'omega [rad/s]' or 'T [s]'")
    for name in ("z_G", "M_33", "C_33", "C_44", "C_55", "M_44", "M_55", "A_33", "A_44", "A_55", "B_33", "B_44", "B_55"):
        if name not in seen:
            raise DataError(f"{path}: line 1: no column {name}; heave, roll and pitch need M, C, A and B of each")
    if "T" in seen:
        omega = 2.0 * math.pi / np.maximum(seen["T"], 1e-9)
        order = np.argsort(omega)
        seen, omega = {name: column[order] for name, column in seen.items()}, omega[order]
    else:
        omega = seen["omega"]
    for name, column in seen.items():
        if (name[0] in "CM" or name == "z_G") and np.ptp(column) > 1e-9 * np.abs(column).max():
            raise DataError(f"{path}: column '{name}': values that differ; it is a constant, the same in each row")
    A, B, M, C = (_matrix(path, letter, seen, omega.size) for letter in "ABMC")
    modes = tuple(k for k in range(6) if f"A_{k + 1}{k + 1}" in seen)
    with within(path):
        return Hydrodynamics(omega, A, B, modes, M[0], C[0], float(seen["z_G"][0]), None, np.empty(0),
                             np.empty((omega.size, 0, 6), dtype=np.complex128), str(path))  # fmt: skip


def _name(path: Path, head: str) -> str:
    found = _HEAD.fullmatch(head)
    name = found[1] if found else head.partition("[")[0].strip()
    pair = _PAIR.fullmatch(name)
    wanted = {"omega": "rad/s", "T": "s", "z_G": "m"}.get(name)
    if pair is not None:
        wanted = _UNITS[pair[1]][(int(pair[2]) > 3) + (int(pair[3]) > 3)]
    if wanted is None:
        raise DataError(f"{path}: line 1: {unknown(name, _KNOWN, 'column')}")
    if found is None or " ".join(found[2].split()) != wanted:
        raise DataError(f"{path}: line 1: column '{head}': write its unit, '{name} [{wanted}]'")
    return name


def _matrix(path: Path, letter: str, seen: dict[str, Array], rows: int) -> Array:
    out = np.zeros((rows, 6, 6))
    for name, column in seen.items():
        pair = _PAIR.fullmatch(name)
        if pair is None or pair[1] != letter:
            continue
        i, j = int(pair[2]) - 1, int(pair[3]) - 1
        out[:, i, j] = column
        if f"{letter}_{pair[3]}{pair[2]}" not in seen:
            out[:, j, i] = column
    if letter == "B":
        for k in range(6):
            if f"A_{k + 1}{k + 1}" in seen and f"B_{k + 1}{k + 1}" not in seen:
                raise DataError(f"{path}: line 1: A_{k + 1}{k + 1} without B_{k + 1}{k + 1}; give both")
    return out
