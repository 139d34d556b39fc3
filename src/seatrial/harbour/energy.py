"""Energy of a berthing ship by design practice: E = .5 M v_n^2 C_M C_E C_S C_C (PIANC WG33, BS 6349-4).

C_M is the water that moves along (four published forms), C_E what goes into the turn where the contact point sticks to
the fender.  A frictionless berth takes K^2/(K^2 + x^2) of .5 (m + m_y) v^2 instead: `frictionless`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType

from ..core.values import dataclass


def vasco_costa(B: float, d: float, C_b: float, keel: float) -> float:
    """1 + 2 d/B (1964); clearance under the keel above .1 d, speed above .08 m/s (from memory)."""
    return 1.0 + 2.0 * d / B


def ueda(B: float, d: float, C_b: float, keel: float) -> float:
    """1 + pi d/(2 C_b B) (1981)."""
    return 1.0 + math.pi * d / (2.0 * C_b * B)


def pianc2002(B: float, d: float, C_b: float, keel: float) -> float:
    """1.8 up to a clearance of .1 d, 1.5 from .5 d on, straight between."""
    return min(max(1.875 - 0.75 * keel / d, 1.5), 1.8)


ADDED: Mapping[str, Callable[[float, float, float, float], float]] = MappingProxyType(
    {"vasco_costa": vasco_costa, "ueda": ueda, "pianc2002": pianc2002}
)
"""C_M by author, of breadth, draught, block coefficient and clearance under the keel [m]."""


def gyration(L: float, C_b: float) -> float:
    """K = (.19 C_b + .11) L [m]."""
    return (0.19 * C_b + 0.11) * L


@dataclass(frozen=True)
class Berthed:
    """A berthing as design practice sees it.

    Attributes:
        M: displacement [kg].
        L, B, d, C_b: of the ship [m].
        from_bow: contact point aft of the stem, over L.
        angle: berthing angle [rad].
        v: speed towards the quay [m/s].
        keel: clearance under the keel [m].
        C_S, C_C: softness and configuration of the berth; closed quays .8 to .9, open 1.
    """

    M: float
    L: float
    B: float
    d: float
    C_b: float
    from_bow: float
    angle: float
    v: float
    keel: float
    C_S: float = 1.0
    C_C: float = 1.0

    def eccentricity(self) -> float:
        """C_E = (K^2 + R^2 cos^2 gamma)/(K^2 + R^2)."""
        K = gyration(self.L, self.C_b)
        R = math.hypot((0.5 - self.from_bow) * self.L, 0.5 * self.B)
        gamma = 0.5 * math.pi - self.angle - math.asin(0.5 * self.B / R)
        return (K * K + (R * math.cos(gamma)) ** 2) / (K * K + R * R)

    def energy(self, added: str = "pianc2002") -> float:
        """E [J] with C_M of an author."""
        C_M = ADDED[added](self.B, self.d, self.C_b, self.keel)
        return 0.5 * self.M * self.v**2 * C_M * self.eccentricity() * self.C_S * self.C_C


def frictionless(mass: float, K: float, lever: float, v: float) -> float:
    """What a frictionless fender takes of a ship of `mass`, added mass included, at a lever along the quay [J]."""
    return 0.5 * mass * v * v * K * K / (K * K + lever * lever)
