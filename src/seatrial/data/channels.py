"""The standard channels and their units."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

UNITS: Mapping[str, str] = MappingProxyType({
    "t": "s", "x": "m", "y": "m", "psi": "rad", "u": "m/s", "v_m": "m/s", "r": "rad/s",
    "n_P": "1/s", "n_P_cmd": "1/s", "delta": "rad", "delta_cmd": "rad",
    "U_T": "m/s", "gamma_T": "rad", "U_A": "m/s", "gamma_A": "rad",
    "U_C": "m/s", "gamma_C": "rad", "U_G": "m/s", "gamma_G": "rad",
    "phi": "rad", "depth": "m",
    "H_S": "m", "T_W": "s", "gamma_W": "rad",
})  # fmt: skip
