"""What physics leaves of the parameters that a first study frees, whatever the data say.

A hull at rest in the water is given no energy by it: with X the force along the motion, X u <= 0 where a ship only
surges, Y v_m <= 0 where it only sways and N r <= 0 where it only turns.  So each coefficient of its own velocity is
held on its side of zero, as far as it is there.  No ship is lighter than the water that it displaces: added mass is not
negative (Newman, Marine Hydrodynamics, 1977, section 4.14).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fnmatch import fnmatchcase

from ...core.parameters import values
from ...ships import Ship

# Linear in every family, or of a damping that is odd in its velocity. Elsewhere X_uu is the curvature about a speed.
_TAKES = ("X_u", "Y_v", "N_r", "*.X_u", "*.Y_v", "*.N_r", "damping.X_uu", "damping.X_uuu", "damping.Y_vv",
          "damping.Y_vvv", "damping.Y_uv", "damping.N_rr", "damping.N_rrr", "damping.N_ur")  # fmt: skip
_MASSES = ("inertia.m_11", "inertia.m_22")
# Least radius of gyration over the length: a bar of a third of it has as much.
_INERTIA, _GYRATION = "inertia.m_33", 0.1


def limits(ship: Ship, paths: Iterable[str]) -> Mapping[str, Mapping[str, float]]:
    """The bound of each parameter that has one, as keys of [free]; those that the ship already breaks have none."""
    known, heavy = values(ship.model), float(ship.model.displaced)
    least = {**dict.fromkeys(_MASSES, heavy), _INERTIA: heavy * (_GYRATION * ship.L_pp) ** 2}
    out: dict[str, Mapping[str, float]] = {}
    for path in paths:
        value = float(known[path])
        if value < 0.0 and any(fnmatchcase(path, one) and path.count(".") == one.count(".") for one in _TAKES):
            out[path] = {"high": 0.0}
        elif 0.0 < least.get(path, 0.0) <= value:
            out[path] = {"low": least[path]}
    return out
