"""Roll damping by the simplified method of Ikeda (Kawahara, Maekawa and Ikeda, STAB 2009), from particulars.

Numbers as two public codes have them, which agree; the paper itself was not opened.  Friction, waves, eddies and bilge
keels are non-dimensional, B^ = B_44/(rho volume B^2) sqrt(B/(2 g)), at the frequency omega^ = omega sqrt(B/(2 g)).
It was made from systematic calculations within `LIMITS`; an evaluation of 2021 by model tests (Alexandersson, Mao and
Ringsberg) found most modern ships outside of them, and the part of the waves the cause of most errors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache

from ...core.values import dataclass
from . import Limits, table

# That of the programs of which the regressions were made.
GRAVITY = 9.81
LIMITS: Limits = {
    "C_b": (0.5, 0.85), "B/d": (2.5, 4.5), "OG/d": (-1.5, 0.2), "C_m": (0.9, 0.99), "b_BK/B": (0.01, 0.06),
    "l_BK/L": (0.05, 0.4), "omega^": (0.0, 1.0),
}  # fmt: skip
# Kinematic viscosity of the programs [m^2/s]; their density is that of sea water, here the ship's own.
_NU = 1.14e-6


@dataclass(frozen=True, kw_only=True)
class Hull:
    """Particulars that the method needs, SI.

    Attributes:
        L_pp, B, d: length, breadth, draught [m].
        C_b, C_m: coefficients of block and midship section.
        OG: from the water line down to the roll axis, the centre of gravity [m]: draught less its height, so
            negative for a centre of gravity above the water line.
        b_BK, l_BK: breadth and length of the bilge keels [m]; zero without.
    """

    L_pp: float
    B: float
    d: float
    C_b: float
    C_m: float
    OG: float
    b_BK: float = 0.0
    l_BK: float = 0.0

    @property
    def volume(self) -> float:
        """Displaced volume [m^3]."""
        return self.C_b * self.L_pp * self.B * self.d

    @property
    def unit(self) -> float:
        """B_44 over rho of B^ = 1 [m^5/s]."""
        return self.volume * self.B**2 / math.sqrt(self.B / (2.0 * GRAVITY))

    def outside(self, omega: float) -> tuple[str, ...]:
        """What leaves the range of the method at a frequency [rad/s], in words."""
        here = {"C_b": self.C_b, "B/d": self.B / self.d, "OG/d": self.OG / self.d, "C_m": self.C_m,
                "omega^": omega * math.sqrt(self.B / (2.0 * GRAVITY))}  # fmt: skip
        if self.b_BK:
            here |= {"b_BK/B": self.b_BK / self.B, "l_BK/L": self.l_BK / self.L_pp}
        return tuple(f"{name} is {value:.3g}, outside [{LIMITS[name][0]:g}, {LIMITS[name][1]:g}]"
                     for name, value in here.items() if not LIMITS[name][0] <= value <= LIMITS[name][1])  # fmt: skip


@dataclass(frozen=True)
class Damping:
    """Parts of B^ at one amplitude and frequency."""

    friction: float
    wave: float
    eddy: float
    keel: float

    @property
    def whole(self) -> float:
        """Their sum."""
        return self.friction + self.wave + self.eddy + self.keel


def damping(hull: Hull, omega: float, phi: float) -> Damping:
    """B^ at rest, for rolling with the amplitude `phi` [rad] and the frequency `omega` [rad/s]."""
    hat = omega * math.sqrt(hull.B / (2.0 * GRAVITY))
    return Damping(_friction(hull, omega, phi), _wave(hull, hat), _eddy(hull, hat, phi), _keel(hull, hat, phi))


def coefficients(
    hull: Hull, omega: float, rho: float, amplitudes: tuple[float, float] = (0.05, 0.2)
) -> tuple[float, float]:
    """Linear [kg m^2/s] and quadratic [kg m^2] damping with the same B_44 at two amplitudes [rad].

    By the energy of a period B_44 = B_1 + 8/(3 pi) omega phi B_2.
    """
    low, high = (damping(hull, omega, phi).whole * rho * hull.unit for phi in amplitudes)
    B_2 = max(high - low, 0.0) / (8.0 / (3.0 * math.pi) * omega * (amplitudes[1] - amplitudes[0]))
    return max(low - 8.0 / (3.0 * math.pi) * omega * amplitudes[0] * B_2, 0.0), B_2


def lift(hull: Hull, rho: float) -> float:
    """Damping by the lift of the hull over the speed [kg m]: B_44 = B_U |u|; one public code."""
    d, OG = hull.d, hull.OG
    kappa = 106.0 * (hull.C_m - 0.91) ** 2 - 700.0 * (hull.C_m - 0.91) ** 3
    k_N = 2.0 * math.pi * d / hull.L_pp + kappa * (4.1 * hull.B / hull.L_pp - 0.045)
    l_0, l_R = 0.3 * d, 0.5 * d
    return 0.5 * rho * hull.L_pp * d * k_N * l_0 * l_R * (1.0 - 1.4 * OG / l_R + 0.7 * OG * OG / (l_0 * l_R))


def _friction(hull: Hull, omega: float, phi: float) -> float:
    d, ratio = hull.d, hull.C_b * hull.B / hull.d
    r_f = d * ((0.887 + 0.145 * hull.C_b) * (1.7 + ratio) - 2.0 * hull.OG / d) / math.pi
    s_f = hull.L_pp * (1.75 * d + hull.C_b * hull.B)
    period = 2.0 * math.pi / omega
    C_f = 1.328 * (3.22 * r_f**2 * phi**2 / (period * _NU)) ** -0.5
    return 4.0 / (3.0 * math.pi) * s_f * r_f**3 * phi * omega * C_f / hull.unit


def _eddy(hull: Hull, hat: float, phi: float) -> float:
    C_b, x, OG = hull.C_b, hull.B / hull.d, hull.OG / hull.d
    AE = ((-0.0182 * C_b + 0.0155) * (x - 1.8) ** 3
          + _poly((-79.414, 215.695, -215.883, 93.894, -14.848), C_b))  # fmt: skip
    BE1 = ((3.98 * C_b - 5.1525) * (-0.2 * x + 1.6) * OG
           * ((0.9717 * C_b**2 - 1.55 * C_b + 0.723) * OG + 0.04567 * C_b + 0.9408))  # fmt: skip
    BE2 = (0.25 * OG + 0.95) * OG + _poly((-219.2, 443.7, -283.3, 59.6), C_b)
    BE3 = -15.0 * C_b * x + 46.5 * C_b + 11.2 * x - 28.6
    return 4.0 * hat * phi / (3.0 * math.pi * C_b * x**3) * AE * math.exp(BE1 + BE2 * hull.C_m**BE3)


def _keel(hull: Hull, hat: float, phi: float) -> float:
    if not hull.b_BK:
        return 0.0
    C_b, x, OG, deg = hull.C_b, hull.B / hull.d, hull.OG / hull.d, math.degrees(phi)
    b, l = hull.b_BK / hull.B, hull.l_BK / hull.L_pp  # noqa: E741
    f1 = (-0.3651 * C_b + 0.3907) * (x - 2.83) ** 2 - 2.21 * C_b + 2.632
    f2 = 0.00255 * deg**2 + 0.122 * deg + 0.4794
    f3 = (-0.8913 * b**2 - 0.0733 * b) * l**2 + (5.2857 * b**2 - 0.01185 * b + 0.00189) * l
    c1 = (5.0 * b + 0.3 * x - 0.2 * l + 0.00125 * deg**2 - 0.0425 * deg - 1.86) * OG
    c2 = -15.0 * b + 1.2 * C_b - 0.1 * x - 0.0657 * OG**2 + 0.0586 * OG + 1.6164
    c3 = 2.5 * OG + 15.75
    return f1 * f2 * f3 * math.exp(c1 + c2 * hull.C_m**c3) * hat


def _wave(hull: Hull, hat: float) -> float:
    x, C_b, C_m, up = hull.B / hull.d, hull.C_b, hull.C_m, 1.0 - hull.OG / hull.d

    def at(of: str, first: int, last: int) -> list[float]:
        return [_poly(_numbers(f"{of}{k}"), C_b if of == "A3" else x) for k in range(first, last + 1)]

    A11, A12, A13 = (_poly(at(f"A1{k}", 1, count), C_b) for k, count in ((1, 3), (2, 4), (3, 4)))
    AA11, AA12 = (_poly(at(f"AA1{k}", 1, 3), C_b) for k in (1, 2))
    A1 = (A11 * up**2 + A12 * up + A13) * ((AA11 * C_m + AA12) * (1.0 - up) + 1.0)
    A2 = _poly((-1.402, 7.189, -10.993, 9.45), up)
    AA311 = (_poly((-17.102, 41.495, -33.234, 8.8007), C_b) * up + _poly((36.566, -89.203, 71.8, -18.108), C_b))
    AA31 = _poly((-0.3767, 3.39, -10.356, 11.588), x) * AA311
    z = up - _poly((-0.0727, 0.7, -1.2818), x)
    AA3 = AA31 * (_poly((-1.05584, 12.688, -63.70534, 172.84571, -274.05701, 257.68705, -141.40915, 44.13177, -7.1654,
                         0.0), z) + _poly((-0.0495, 0.4518, -0.61655), x))  # fmt: skip
    A3 = _poly(at("A3", 1, 7), up) + AA3
    return A1 / hat * math.exp(-A2 * (math.log(hat) - A3) ** 2 / 1.44)


def _poly(numbers: Sequence[float], x: float) -> float:
    """Polynomial, highest power first."""
    total = 0.0
    for number in numbers:
        total = total * x + number
    return total


@cache
def _numbers(name: str) -> tuple[float, ...]:
    row = next(row for row in table("ikeda") if row["name"] == name)
    return tuple(map(float, row["coefficients"].split()))
