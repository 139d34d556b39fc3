"""Reader of FRT-DS-ESSO: free-running tests of the 3 m model of Esso Osaka (Wakita 2022, Miyauchi 2022).

The data already follow the conventions of this package: midship, rudder positive to starboard,
wind *from*, psi clockwise.  They are CC BY-NC-SA and not part of the package.
"""

from __future__ import annotations

from pathlib import Path
from types import MappingProxyType

from ...core.parameters import unknown
from .. import DataError, Trial
from ..sidecar import CONVENTIONS
from ..table import check_time, continued, lines_of, numbers, once, split_row

name = "frt-esso"
suffixes = (".csv",)
COLUMNS = MappingProxyType({
    "t [s]": "t", "x_position_mid [m]": "x", "u_velo [m/s]": "u", "y_position_mid [m]": "y",
    "vm_velo [m/s]": "v_m", "psi_hat [rad]": "psi", "r_angvelo [rad/s]": "r",
    "n_prop [rps]": "n_P", "delta_rudder [rad]": "delta",
    "wind_velo_relative_mid [m/s]": "U_A", "wind_dir_relative_mid [rad]": "gamma_A",
    "wind_velo_true [m/s]": "U_T", "wind_dir_true [rad]": "gamma_T",
})  # fmt: skip
"""Names in the published files and ours; the velocities there are at midship, as ours."""

META = MappingProxyType({
    "ship": "esso_osaka_3m", "scale": 108.33, "L_pp": 3.0, **CONVENTIONS, "water_density": 998.0,
    "source": "FRT-DS-ESSO, github.com/NAOE-5thLab/FRT-DS-ESSO; cite doi:10.1007/s00773-021-00867-1 "
              "and doi:10.1007/s00773-022-00889-3",
    "licence": "CC BY-NC-SA 4.0",
})  # fmt: skip
"""What the README of the set says of all its trials."""

_KINDS = MappingProxyType({"turn": "turning", "zigzag": "zigzag", "random": "random", "berthing": "berthing"})


def read(source: Path, mapping: None = None) -> Trial:
    """Read one CSV of the set; empty rows at its end are kept as a gap."""
    here = Path(source)
    lines = lines_of(here)
    heads = split_row(lines[0], ",")
    for head in heads:
        if head not in COLUMNS:
            raise DataError(f"{here}: line 1: {unknown(head, COLUMNS, 'column')}")
    absent = [head for head in COLUMNS if head not in heads]
    if absent:
        raise DataError(f"{here}: line 1: no column '{absent[0]}'; is this a file of FRT-DS-ESSO?")
    once(here, 1, heads, COLUMNS)
    table, numbered = numbers(here, lines, 1, heads, ",")
    table, padded = continued(table, heads.index("t [s]"))
    channels = {COLUMNS[head]: table[:, k].copy() for k, head in enumerate(heads)}
    t = channels.pop("t")
    check_time(here, "t [s]", t, numbered)
    meta = {**META, "kind": _kind(here)}
    return Trial(here.stem, t, channels, {}, meta).noting("read from FRT-DS-ESSO", *padded)


def _kind(path: Path) -> str:
    words = (path.name, path.parent.name)
    return next((kind for word in words for start, kind in _KINDS.items() if word.startswith(start)), "free")
