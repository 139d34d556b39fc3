"""A ship of the MMG family with roll added: from its stability and a few particulars, every number with its source."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ..core.values import dataclass, replace
from ..models.mmg import Mmg
from ..models.mmg_roll import MmgRoll, Roll
from ..models.rolling import GRAVITY
from . import Entry, Ship, ShipError
from .formulas.roll_damping import Hull, coefficients, lift
from .formulas.stability import inertia, metacentric_radius

# Share of the inertia that is the water's.
_ADDED = 0.2


@dataclass(frozen=True, kw_only=True)
class Stability:
    """What a ship of the horizontal plane does not know of itself, SI.

    Attributes:
        GM: metacentric height [m].
        KG: centre of gravity above the keel [m].
        C_m: coefficient of the midship section.
        b_BK, l_BK: breadth and length of the bilge keels [m]; zero without.
    """

    GM: float
    KG: float
    C_m: float = 0.98
    b_BK: float = 0.0
    l_BK: float = 0.0


def with_roll(ship: Ship, stability: Stability) -> Ship:
    """`ship` with heel and roll rate.

    The inertia is that of the roll period of the IS Code, the damping Ikeda's simplified one at 3 and 11 degrees, with
    the lift of the hull; the lateral force of the hull and its added mass act at half the draught, that of the rudder
    at seven tenths of it, as assumed.  No derivative by heel: a fit, or a captive test, finds them.

    Raises:
        ShipError: another family, or numbers that no ship has.
    """
    model: Any = ship.model
    if type(model) is not Mmg:
        other = type(model).__name__
        raise ShipError(f"{ship.name}: roll is added to a ship of the family mmg:Mmg; {other} is another")
    body = model.body
    L, B, d, m, rho = (float(x) for x in (body.L_pp, body.B, body.d, body.m, body.rho))
    _possible(ship.name, stability, B, d)
    hull = Hull(L_pp=L, B=B, d=d, C_b=m / (rho * L * B * d), C_m=stability.C_m, OG=d - stability.KG,
                b_BK=stability.b_BK, l_BK=stability.l_BK)  # fmt: skip
    whole = inertia(m, B, d, L)
    omega = math.sqrt(m * GRAVITY * stability.GM / whole)
    B_1, B_2 = coefficients(hull, omega, rho)
    half, deep = stability.KG - 0.5 * d, stability.KG - 0.3 * d
    by_ikeda, at_half = "Ikeda's simplified method, Kawahara 2009", "assumed: at half the draught"
    found: dict[str, tuple[float, str]] = {
        "I_x": (whole * (1.0 - _ADDED), f"roll period of the IS Code, {1.0 - _ADDED:g} of it the ship's own"),
        "J_x": (whole * _ADDED, f"roll period of the IS Code, {_ADDED:g} of it the water's, as assumed"),
        "GM": (stability.GM, "given"),
        "BM": (metacentric_radius(B, d, hull.C_b), "breadth, draught and C_b"),
        "B_1": (B_1, by_ikeda), "B_2": (B_2, by_ikeda),
        "B_U": (max(lift(hull, rho), 0.0), "lift of the hull, Ikeda's method"),
        "z_H": (half, at_half), "l_x": (half, at_half),
        "l_y": (half, at_half), "z_R": (deep, "assumed: 0.7 of the draught down"),
        "z_T": (half, at_half), "z_W": (stability.KG - 1.3 * d, "assumed: 0.3 d above the water"),
    }  # fmt: skip
    rolling = MmgRoll(**vars(model), roll=Roll(**{name: value for name, (value, _) in found.items()}))
    entries = {f"roll.{name}": Entry(why, value) for name, (value, why) in found.items()}
    return replace(ship, name=f"{ship.name}_rolling", of=ship.of or ship.name, model=rolling,
                   entries={**ship.entries, **entries}, notes=_noted(ship.notes, hull, omega))  # fmt: skip


def _possible(name: str, stability: Stability, B: float, d: float) -> None:
    for what, value, low, high in (("GM", stability.GM, 0.0, 0.5 * B), ("KG", stability.KG, 0.0, 5.0 * d)):
        if not low < value < high:
            raise ShipError(f"{name}: {what} is {value:g} m; a ship of this size has {low:g} to {high:g} m")


def _noted(notes: Mapping[str, Any], hull: Hull, omega: float) -> dict[str, Any]:
    told = [f"Roll is estimated: period {2.0 * math.pi / omega:.3g} s by the IS Code, damping by Ikeda's simplified "
            "method, heights of lateral forces assumed, no derivatives by heel."]  # fmt: skip
    told += [f"Its roll damping is extrapolated: {one}." for one in hull.outside(omega)]
    title = f"{notes.get('title', '')}, with roll".strip(", ")
    return {**notes, "title": title, "cautions": [*notes.get("cautions", ()), *told]}
