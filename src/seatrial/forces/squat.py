"""Squat: how deep a ship sinks under way in shallow water, by the published formulae side by side.

Each gives the largest sinkage S of bow or stern [m], from the speed through the water and the depth at rest; the bow
sinks most where C_b >= .7, else the stern (from a public code).  They disagree by a factor of 1.6 and more: squat is a
range, so run two of them.  Formulae from the pages and codes in docs/harbour.md; Eryuzlu, Millward 1992, Roemisch, the
width of influence and most ranges are from memory and so marked.  None says what squat does to steering:
`shallow:ShallowPolynomial` takes the mean sinkage off the depth where its file names a form.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from ..core.constants import KNOT
from ..core.parameters import Scalar
from ..core.symbolic import clip, exp, larger, log, magnitude, root, smaller, where

# The formulae are regressions that were printed with it.
GRAVITY = 9.81
# The root of 1 - F^2 ends here: none of the formulae holds near the critical speed.
_CRITICAL = 0.95
# Deeper than so much of it per draught is deep water.
_DEEP = 0.02


class Hull(NamedTuple):
    """Length, breadth, draught [m] and block coefficient."""

    L: Scalar
    B: Scalar
    d: Scalar
    C_b: Scalar

    @property
    def volume(self) -> Scalar:
        """Displaced volume [m^3]."""
        return self.C_b * self.L * self.B * self.d


class Channel(NamedTuple):
    """Width [m] of a canal, infinite or 0 for open water; slope of its sides, rise over run, 0 for walls."""

    W: Scalar = 0.0
    slope: Scalar = 0.0

    def section(self, h: Scalar, hull: Hull) -> Scalar:
        """Its area [m^2]; of open water that of the width of influence (7.7 + 20 (1 - C_b)^2) B (from memory)."""
        fine = 1.0 - hull.C_b
        wide = where(self.W > 0.0, self.W, (7.7 + 20.0 * fine * fine) * hull.B)
        return wide * h + where(self.slope > 0.0, h * h / larger(self.slope, 1e-6), 0.0)


OPEN = Channel()
Form = Callable[[Scalar, Scalar, Hull, Channel], Scalar]
"""(V [m/s], h [m], hull, channel) -> S [m]."""


def _power(x: Scalar, n: float) -> Scalar:
    return exp(n * log(larger(x, 1e-12)))


def _above(x: Scalar, limit: float) -> Scalar:
    """One from the limit on, else zero."""
    return _held(1e9 * (x - limit) + 1.0)


def _held(x: Scalar) -> Scalar:
    """X within 0 and 1; by sizes, as a choice between numbers that all lanes share keeps a compiler from vectors."""
    return 0.5 * (magnitude(x) - magnitude(x - 1.0) + 1.0)


def froude(V: Scalar, h: Scalar) -> Scalar:
    """Froude number of the depth, held below .95."""
    return smaller(magnitude(V) / root(GRAVITY * h), _CRITICAL)


def _tuck(V: Scalar, h: Scalar) -> Scalar:
    F = froude(V, h)
    return F * F / root(1.0 - F * F)


def icorels(V: Scalar, h: Scalar, hull: Hull, channel: Channel = OPEN) -> Scalar:
    """C_s nabla/L^2 F^2/sqrt(1 - F^2); C_s 1.7, 2.0, 2.4 for C_b below .7, below .8, above; F below .7."""
    C_s = 1.7 + 0.3 * _above(hull.C_b, 0.7) + 0.4 * _above(hull.C_b, 0.8)
    return C_s * hull.volume / (hull.L * hull.L) * _tuck(V, h)


def huuska(V: Scalar, h: Scalar, hull: Hull, channel: Channel = OPEN) -> Scalar:
    """ICORELS times K_s = 7.45 s + .76, s = .98 B d over the section of a canal with walls; 1 where s <= .03."""
    s = 0.98 * hull.B * hull.d / channel.section(h, hull)
    s = where(channel.W > 0.0, s, 0.03)
    return icorels(V, h, hull) * where(s > 0.03, 7.45 * s + 0.76, 1.0)


def tuck(V: Scalar, h: Scalar, hull: Hull, channel: Channel = OPEN) -> Scalar:
    """1.75 nabla/L^2 F^2/sqrt(1 - F^2), without the factor of a canal."""
    return 1.75 * hull.volume / (hull.L * hull.L) * _tuck(V, h)


def blockage(h: Scalar, hull: Hull, channel: Channel = OPEN) -> Scalar:
    """B d over the section of the canal, or of the width of influence."""
    return hull.B * hull.d / channel.section(h, hull)


def barrass1979(V: Scalar, h: Scalar, hull: Hull, channel: Channel = OPEN) -> Scalar:
    """C_b (A_s/(A_c - A_s))^(2/3) V_k^2.08/30."""
    S = blockage(h, hull, channel)
    return hull.C_b * _power(S / (1.0 - S), 2.0 / 3.0) * _power(magnitude(V) / KNOT, 2.08) / 30.0


def barrass2004(V: Scalar, h: Scalar, hull: Hull, channel: Channel = OPEN) -> Scalar:
    """C_b S^.81 V_k^2.08/20; S .1 to .27, h/d 1.1 to 1.4 (range from memory)."""
    return hull.C_b * _power(blockage(h, hull, channel), 0.81) * _power(magnitude(V) / KNOT, 2.08) / 20.0


def barrass_simple(V: Scalar, h: Scalar, hull: Hull, channel: Channel = OPEN) -> Scalar:
    """C_b V_k^2/100 in open water, times 6 S + .4 between 1 and 2 in a canal; h/d 1.1 to 1.4 (from memory)."""
    knots = V / KNOT
    narrow = where(channel.W > 0.0, clip(6.0 * blockage(h, hull, channel) + 0.4, 1.0, 2.0), 1.0)
    return hull.C_b * knots * knots / 100.0 * narrow


def barrass_K(V: Scalar, h: Scalar, hull: Hull, channel: Channel = OPEN) -> Scalar:
    """K C_b V_k^2/100 with K = 5.74 S^.76, S held at .5 (from a public code)."""
    knots = V / KNOT
    K = 5.74 * _power(smaller(blockage(h, hull, channel), 0.5), 0.76)
    return K * hull.C_b * knots * knots / 100.0


def millward1990(V: Scalar, h: Scalar, hull: Hull, channel: Channel = OPEN) -> Scalar:
    """(L/100) (15 C_b B/L - .55) F^2/(1 - .9 F); C_b .44 to .83 (range from memory)."""
    F = froude(V, h)
    return hull.L / 100.0 * (15.0 * hull.C_b * hull.B / hull.L - 0.55) * F * F / (1.0 - 0.9 * F)


def millward1992(V: Scalar, h: Scalar, hull: Hull, channel: Channel = OPEN) -> Scalar:
    """(L/100) (61.7 C_b d/L - .6) F^2/sqrt(1 - F^2); from memory."""
    return hull.L / 100.0 * (61.7 * hull.C_b * hull.d / hull.L - 0.6) * _tuck(V, h)


def eryuzlu1994(V: Scalar, h: Scalar, hull: Hull, channel: Channel = OPEN) -> Scalar:
    """.298 (h^2/d) (V/sqrt(g d))^2.289 (h/d)^-2.972 K_b; C_b >= .8, h/d 1.1 to 2.5; from memory."""
    wide = channel.W / hull.B
    K_b = where(channel.W > 0.0, where(wide < 9.61, 3.1 / root(larger(wide, 1e-3)), 1.0), 1.0)
    return (0.298 * h * h / hull.d * _power(magnitude(V) / root(GRAVITY * hull.d), 2.289)
            * _power(h / hull.d, -2.972) * K_b)  # fmt: skip


def roemisch1989(V: Scalar, h: Scalar, hull: Hull, channel: Channel = OPEN) -> Scalar:
    """C_V C_F K_dT d at the bow of a ship in open water; h/d 1.19 to 2.25; from memory."""
    critical = 0.58 * _power(h / hull.d * hull.L / hull.B, 0.125) * root(GRAVITY * h)
    x = magnitude(V) / critical
    q = (x - 0.5) * (x - 0.5)
    full = 10.0 * hull.C_b * hull.B / hull.L
    return 8.0 * x * x * (q * q + 0.0625) * full * full * 0.155 * root(h / hull.d) * hull.d


FORMS: Mapping[str, Form] = MappingProxyType({
    form.__name__: form for form in (icorels, huuska, tuck, barrass1979, barrass2004, barrass_simple, barrass_K,
                                     millward1990, millward1992, eryuzlu1994, roemisch1989)
})  # fmt: skip
"""Formulae by name."""


def ends(S: Scalar, C_b: Scalar) -> tuple[Scalar, Scalar]:
    """Sinkage of bow and stern [m], from the larger one (from a public code); even keel at rest."""
    other = share(C_b) * S
    bow_first = C_b >= 0.7
    return where(bow_first, S, other), where(bow_first, other, S)


def share(C_b: Scalar) -> Scalar:
    """Sinkage of the other end over the larger one."""
    return _held(1.0 - 40.0 * (0.7 - C_b) * (0.7 - C_b))


def under_keel(V: Scalar, h: Scalar, hull: Hull, form: str = "icorels", channel: Channel = OPEN) -> Scalar:
    """Clearance under the keel [m]: the depth less draught and largest sinkage; below zero the ship is aground."""
    return h - hull.d - FORMS[form](V, h, hull, channel)


def sunk(V: Scalar, d_over_h: Scalar, hull: Hull, form: str) -> Scalar:
    """Draught over depth under way: the depth less the mean sinkage of bow and stern; as it is in deep water."""
    h = hull.d / larger(d_over_h, _DEEP)
    mean = 0.5 * (1.0 + share(hull.C_b)) * FORMS[form](V, h, hull, OPEN)
    return d_over_h / (1.0 - clip(mean * d_over_h / hull.d, 0.0, 0.5))
