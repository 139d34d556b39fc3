"""Tables of captive model tests: one steady run, or one instant of a forced motion, a row.

A table has our names and units in its header (`beta [deg],U [m/s],delta [deg],X [N],...`), or a mapping file,
`seatrial-captive/1`, says which column is which:

    schema = "seatrial-captive/1"
    L_pp = 6.893
    water_density = 1000.0
    over = "L^2"
    [columns]
    beta = { column = "beta(deg)", unit = "deg" }
    delta = { column = "delta(deg)", unit = "deg", sign = -1 }
    X = { column = "X'", unit = "'" }

A primed load is over 0.5 rho L^2 U^2 (`over = "L^2"`) or 0.5 rho L d U^2 (`over = "L d"`, which needs `d`), a moment
by L more; a primed r is r L/U.  Rows that repeat a run count once.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..core.parameters import PRIME, unknown
from ..core.values import dataclass
from . import Array, DataError
from .mapping.schema import Column
from .sidecar import Described, read_described
from .table import existing, lines_of, numbers, once, split_row, within
from .units import KNOWN

MOTION = ("u", "v_m", "r", "n_P", "delta", "u_dot", "v_dot", "r_dot")
"""Velocities at midship, controls and accelerations of a run, as `Captive.motion` has them."""

LOADS = ("X", "Y", "N", "T", "F_N")
"""What gauges measure: forces and moment on the model about midship, thrust, normal force of the rudder."""

OTHER_LOAD = " (other load)"
"""What the kind of a run ends in whose propeller is loaded otherwise than in most."""

_UNITS = {
    "U": "m/s", "u": "m/s", "v_m": "m/s", "beta": "rad", "r": "rad/s", "n_P": "1/s", "delta": "rad",
    "u_dot": "m/s^2", "v_dot": "m/s^2", "r_dot": "rad/s^2",
    "X": "N", "Y": "N", "N": "N m", "T": "N", "F_N": "N",
}  # fmt: skip
_PRIMED = ("r", *LOADS)
_HEAD = re.compile(r"(\w+)\s*\[(.*)\]")
# A motion or an angle below this share of what is tested is none; so is a change of the propeller's load.
_NONE, _LOADED = 1e-3, 0.05


@dataclass(frozen=True, kw_only=True)
class CaptiveMapping(Described):
    """A mapping file of captive tests.

    Attributes:
        columns: by quantity; see `MOTION`, `LOADS`, and U, beta in place of u and v_m.
        over: what primed forces are over, times 0.5 rho U^2.
        d: draught of the model [m].
        inertia: whether the loads contain the inertia of the model itself, or it was taken off.
        moment_about: point about which N is, ahead of midship [m]; x_G where the tank gives N about the centre of
            gravity.
        delimiter: what separates cells.
    """

    columns: dict[str, Column]
    over: Literal["L^2", "L d"] = "L^2"
    d: float | None = None
    inertia: Literal["removed", "included"] = "removed"
    moment_about: float = 0.0
    delimiter: str = ","


@dataclass(frozen=True)
class Captive:
    """Runs of captive tests, SI units, origin midship, our signs.

    Attributes:
        motion: shape (runs, 8), the columns of `MOTION`.
        loads: by name of `LOADS`, shape (runs,); NaN where a run has none.
        L_pp: of the model [m].
        rho: density of the water [kg/m^3].
        inertia: whether the loads contain the inertia of the model ("included").
        repeated: rows of the tables left out since they repeat a run.
        source: of the mapping file.
    """

    name: str
    motion: Array
    loads: Mapping[str, Array]
    L_pp: float
    rho: float
    inertia: str = "removed"
    repeated: int = 0
    source: str = ""

    def __len__(self) -> int:
        return len(self.motion)

    def column(self, name: str) -> Array:
        """One column of the motion."""
        return self.motion[:, MOTION.index(name)]

    @property
    def U(self) -> Array:
        """Speed through the water [m/s]."""
        return np.hypot(self.column("u"), self.column("v_m"))

    @property
    def beta(self) -> Array:
        """Drift angle, positive with v_m < 0 [rad]."""
        return np.arctan2(-self.column("v_m"), self.column("u"))

    @property
    def kinds(self) -> tuple[str, ...]:
        """What each run is, by its motion: "drift", "yaw + rudder", "PMM", "rudder (other load)" ..."""
        U = self.U
        moved = {
            "drift": np.abs(self.beta) > _NONE, "yaw": np.abs(self.column("r")) * self.L_pp > _NONE * U,
            "rudder": np.abs(self.column("delta")) > _NONE,
        }  # fmt: skip
        pushed = np.abs(self.motion[:, 5:]) @ np.array([1.0, 1.0, self.L_pp]) * self.L_pp > _NONE * U * U
        load = self.column("n_P") * self.L_pp / U
        usual = np.median(load)
        other = np.abs(load - usual) > _LOADED * abs(usual)
        return tuple(
            ("PMM" if pushed[k] else " + ".join(n for n in moved if moved[n][k]) or "straight")
            + (OTHER_LOAD if other[k] else "")
            for k in range(len(self))
        )

    def kept(self, rows: NDArray[np.bool_]) -> Captive:
        """Some of the runs."""
        loads = {name: values[rows] for name, values in self.loads.items()}
        return Captive(self.name, self.motion[rows], loads, self.L_pp, self.rho, self.inertia, 0, self.source)


def read_captive_mapping(path: Path) -> CaptiveMapping:
    """Read and check a mapping file of captive tests."""
    found = read_described(path, CaptiveMapping, "seatrial-captive/1")
    with within(path):
        for name, column in found.columns.items():
            _factor(f"columns.{name}", name, column.unit)
            if column.sign not in (1.0, -1.0):
                raise DataError(f"columns.{name}.sign is {column.sign:g}; it must be 1 or -1")
        if not found.delimiter:
            raise DataError("delimiter is empty; give what separates cells")
        primed = any(column.unit == PRIME for name, column in found.columns.items() if name in LOADS)
        if found.over == "L d" and primed and not (found.d and found.d > 0):
            raise DataError('over = "L d" needs d, the draught of the model [m]')
    return found


def read_captive(
    paths: Sequence[str | Path], mapping: str | Path | None = None, *, L_pp: float = math.nan, rho: float = 1000.0
) -> Captive:
    """Read tables of captive tests as one set of runs.

    Args:
        mapping: mapping file; without one the headers have our names and units.
        L_pp, rho: of the model, where the mapping gives none.

    Raises:
        DataError: a table that cannot be read, quantities that are missing, signs that no ship has.
    """
    said = read_captive_mapping(Path(mapping)) if mapping is not None else None
    length = said.L_pp if said is not None and said.L_pp is not None else L_pp
    density = said.water_density if said is not None and said.water_density is not None else rho
    parts = [_table(existing(path), said) for path in paths]
    if not parts:
        raise DataError("no table of captive tests; name one at least")
    names = {name for part in parts for name in part}
    joined = {name: np.concatenate([part.get(name, _absent(name, part)) for part in parts]) for name in names}
    where = ", ".join(str(path) for path in paths)
    with within(where):
        motion, loads = _dimensional(joined, length, density, said)
        if said is not None and said.moment_about:
            loads |= _at_midship(loads, said.moment_about, length)
        motion, loads, repeated = _once_each(motion, loads)
        runs = Captive(", ".join(Path(path).stem for path in paths), motion, loads, length, density,
                       said.inertia if said else "removed", repeated, (said.source or "") if said else "")  # fmt: skip
        _plausible(runs)
    return runs


def _absent(name: str, part: Mapping[str, Array]) -> Array:
    return np.full(len(next(iter(part.values()))), math.nan if name.rstrip(PRIME) in LOADS else 0.0)


def _factor(place: str, name: str, unit: str) -> float:
    """Factor to SI of the unit of a quantity; NaN for a prime."""
    if name not in _UNITS:
        raise DataError(f"{place}: {unknown(name, _UNITS, 'quantity of a captive test')}")
    if unit == PRIME:
        if name not in _PRIMED:
            raise DataError(f"{place}: {name} cannot be primed; give it in {_UNITS[name]}")
        return math.nan
    if unit not in KNOWN or KNOWN[unit][0] != _UNITS[name]:
        fitting = [symbol for symbol, (si, _) in KNOWN.items() if si == _UNITS[name]]
        raise DataError(f"{place}: unit '{unit}' cannot measure {name}; right would be one of: {', '.join(fitting)}")
    return KNOWN[unit][1]


def _headed(path: Path, heads: Sequence[str]) -> dict[str, Column]:
    """Columns by the names and units of the header; columns with other names are left aside."""
    found = {m[1]: Column(head, m[2]) for head in heads if (m := _HEAD.fullmatch(head)) and m[1] in _UNITS}
    if not found:
        raise DataError(f"{path}: line 1: no column such as 'beta [deg]' or 'Y [N]'; rename them, or give a mapping")
    return found


def _table(path: Path, said: CaptiveMapping | None) -> dict[str, Array]:
    """Columns of one table by quantity in SI units; a primed one under its name with a prime."""
    lines = lines_of(path)
    delimiter = said.delimiter if said else ","
    heads = split_row(lines[0], delimiter)
    columns = said.columns if said else _headed(path, heads)
    for one in columns.values():
        if one.column not in heads:
            raise DataError(f"{path}: line 1: {unknown(one.column, heads, 'column')}")
    once(path, 1, heads, [one.column for one in columns.values()])
    wanted = [heads.index(one.column) for one in columns.values()]
    rows = [lines[0]]
    for k, line in enumerate(lines[1:], 2):
        cells = split_row(line, delimiter) if line.strip() else []
        if cells and len(cells) != len(heads):
            raise DataError(f"{path}: line {k} has {len(cells)} cells, the header has {len(heads)}")
        rows.append(delimiter.join(cells[c] for c in wanted) if cells else "")
    table, _ = numbers(path, rows, 1, [one.column for one in columns.values()], delimiter)
    if not len(table):
        raise DataError(f"{path}: no row of numbers below the header")
    found: dict[str, Array] = {}
    for k, (name, one) in enumerate(columns.items()):
        factor = _factor(f"{path}: column '{one.column}'", name, one.unit)
        primed = math.isnan(factor)
        found[name + PRIME * primed] = (one.sign * table[:, k] + one.offset) * (1.0 if primed else factor)
    return found


def _dimensional(
    joined: Mapping[str, Array], L_pp: float, rho: float, said: CaptiveMapping | None
) -> tuple[Array, dict[str, Array]]:
    """Motion and loads in SI units."""
    if not L_pp > 0:
        raise DataError("no length of the model; give L_pp in the mapping file")
    have = {name.rstrip(PRIME) for name in joined}
    if not ("U" in have or "u" in have):
        raise DataError("no speed; a captive test has U, or u and v_m")
    if not have & set(LOADS):
        raise DataError(f"no load; a captive test has one at least of {', '.join(LOADS)}")
    rows = len(next(iter(joined.values())))
    nothing = np.zeros(rows)
    motion = {name: joined.get(name, nothing) for name in MOTION}
    if "U" in joined:
        beta = joined.get("beta", nothing)
        motion["u"], motion["v_m"] = joined["U"] * np.cos(beta), -joined["U"] * np.sin(beta)
    U = np.hypot(motion["u"], motion["v_m"])
    if "r'" in joined:
        motion["r"] = joined["r'"] * U / L_pp
    across = (said.d or math.nan) if said is not None and said.over == "L d" else L_pp
    force = 0.5 * rho * L_pp * across * U * U
    loads: dict[str, Array] = {}
    for name in LOADS:
        if name + PRIME in joined:
            loads[name] = joined[name + PRIME] * force * (L_pp if name == "N" else 1.0)
        elif name in joined:
            loads[name] = joined[name]
    found = np.column_stack([motion[name] for name in MOTION])
    bad = np.flatnonzero(~np.isfinite(found).all(axis=1) | ~(U > 0))
    if bad.size:
        raise DataError(f"row {bad[0] + 1}: no speed, or a gap in the motion; leave the run out")
    return found, loads


def _at_midship(loads: Mapping[str, Array], x: float, L_pp: float) -> dict[str, Array]:
    """The moment about midship, of one about a point `x` ahead of it."""
    if "N" not in loads:
        raise DataError("moment_about: the tables have no N")
    if "Y" not in loads:
        raise DataError("moment_about: N about midship needs Y")
    if not abs(x) <= 0.5 * L_pp:
        raise DataError(f"moment_about is {x:g} m, outside a model of {L_pp:g} m; give the distance ahead of midship")
    return {"N": loads["N"] + x * loads["Y"]}


def _once_each(motion: Array, loads: Mapping[str, Array]) -> tuple[Array, dict[str, Array], int]:
    """Each run once: tables list one run under every series that it belongs to, and it was measured once."""
    every = np.column_stack([motion, *loads.values()])
    _, first = np.unique(np.nan_to_num(every, nan=math.pi), axis=0, return_index=True)
    first.sort()
    return motion[first], {name: values[first] for name, values in loads.items()}, len(every) - len(first)


def _plausible(runs: Captive) -> None:
    """Refuse signs that no ship has: a hull is pushed away from the side that the water comes from."""
    kinds = np.array([kind.removesuffix(OTHER_LOAD) for kind in runs.kinds])
    for kind, cause, named, load, remedy in (
        ("drift", runs.beta, "beta", "Y", "beta is positive with v_m < 0 and Y to starboard"),
        ("rudder", runs.column("delta"), "delta", "N", "delta is positive where it turns the bow to starboard"),
    ):
        some = kinds == kind
        if load not in runs.loads or some.sum() < 2:
            continue
        x, y = cause[some] - cause[some].mean(), runs.loads[load][some]
        good = np.isfinite(y)
        if good.any() and float(x[good] @ (y[good] - y[good].mean())) < 0:
            what = f"{load} falls with {named} over {int(good.sum())} runs of {kind}"
            raise DataError(f"{what}; {remedy}: correct a sign (sign = -1 in the mapping)")
