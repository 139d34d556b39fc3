"""What physics leaves of the parameters that a first study frees, whatever the data say.

A hull at rest in the water is given no energy by it: with X the force along the motion, X u <= 0 where a ship only
surges, Y v_m <= 0 where it only sways and N r <= 0 where it only turns.  So each coefficient of its own velocity is
held on its side of zero, as far as it is there.  A propeller that stands still in the flow is a drag as well, so the
last term of K_T, which alone is left then, is not positive.

No ship is lighter than the water that it displaces: added mass is not negative (Newman, Marine Hydrodynamics, 1977,
section 4.14).  Where draught and beam are known it is that of the ellipsoid in the box of the hull at least, of which
every ship fills more.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from fnmatch import fnmatchcase
from typing import Any

from ...core.parameters import values
from ...ships import Ship

# Linear in every family, or of a damping that is odd in its velocity. Elsewhere X_uu is the curvature about a speed.
_TAKES = ("X_u", "Y_v", "N_r", "*.X_u", "*.Y_v", "*.N_r", "damping.X_uu", "damping.X_uuu", "damping.Y_vv",
          "damping.Y_vvv", "damping.Y_uv", "damping.N_rr", "damping.N_rrr", "damping.N_ur",
          "propeller*.k_2")  # fmt: skip
_MASSES = ("inertia.m_11", "inertia.m_22")
# Least radius of gyration over the length: a bar of a third of it has as much.
_INERTIA, _GYRATION = "inertia.m_33", 0.1


def limits(ship: Ship, paths: Iterable[str]) -> Mapping[str, Mapping[str, float]]:
    """The bound of each parameter that has one, as keys of [free]; those that the ship already breaks have none."""
    known, heavy = values(ship.model), float(ship.model.displaced)
    least = {**dict.fromkeys(_MASSES, heavy), _INERTIA: heavy * (_GYRATION * ship.L_pp) ** 2}
    if {f"body.{name}" for name in ("rho", "B", "d", "m_x", "m_y", "J_z")} <= set(known):
        added = ellipsoid(*(float(known[f"body.{name}"]) for name in ("rho", "L_pp", "B", "d")))
        least |= dict(zip(("body.m_x", "body.m_y", "body.J_z"), added, strict=True))
    out: dict[str, Mapping[str, float]] = {}
    for path in paths:
        value = float(known[path])
        if value < 0.0 and any(fnmatchcase(path, one) and path.count(".") == one.count(".") for one in _TAKES):
            out[path] = {"high": 0.0}
        elif 0.0 < least.get(path, 0.0) <= value:
            out[path] = {"low": least[path]}
    return out


def ellipsoid(rho: float, L: float, B: float, d: float) -> tuple[float, float, float]:
    """Added masses in surge and sway [kg] and added inertia in yaw [kg m^2] of half an ellipsoid, L by B by d deep.

    The surface is a mirror, as at the Froude numbers of ships (Lamb, Hydrodynamics, 1932, sections 114 and 115).
    """
    from scipy.special import elliprd

    a, b, c = 0.5 * L, 0.5 * B, d
    mass, R_D = rho * math.pi / 6.0 * L * B * d, elliprd
    alpha: Any = 2.0 / 3.0 * a * b * c * R_D(b * b, c * c, a * a)
    beta: Any = 2.0 / 3.0 * a * b * c * R_D(a * a, c * c, b * b)
    apart, both = a * a - b * b, a * a + b * b
    turned = 0.2 * mass * apart**2 * (beta - alpha) / (2.0 * apart + both * (alpha - beta))
    return float(mass * alpha / (2.0 - alpha)), float(mass * beta / (2.0 - beta)), float(turned)
