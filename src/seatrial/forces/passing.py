"""Another ship that meets, overtakes or passes: slender bodies in potential flow, on parallel courses.

Double body, rigid free surface, images in the bottom; sections of a parabola A (1 - 4 x^2/L^2), U_1 the own speed and
U_2 that of the other along the own bow, xi and eta its midship ahead and to starboard:

    X = rho U_2 int S_1' u dx_1,   Y = rho (2 U_2 - U_1) int S_1' v dx_1,
    N = rho int [(2 U_2 - U_1) x_1 S_1' + 2 U_2 S_1] v dx_1,
    v = U_2 eta/(2 pi) sum int S_2'/r^3 dx_2,   u = U_2/(2 pi) sum int S_2' (x_2 + xi - x_1)/r^3 dx_2,
    r^2 = (x_2 + xi - x_1)^2 + eta^2 + 4 k^2 h^2.

Y > 0 is towards the other ship where it is to starboard.  U_1 = 0 is a moored ship (Wang 1975).  The double integrals
of polynomials over r^3 are in closed form: repeated integrals of the kernel at the four differences of the ends.

It reproduces one published worksheet, which rests on the same theory, and no measurement: measured forces on a
moored ship go with V^2.3.  Not valid nearer than about B + d, across courses, nor for wake and waves.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

from ..core.parameters import Scalar, spec
from ..core.symbolic import clip, larger, log, magnitude, root, sign, smaller, where
from ..core.values import dataclass
from . import Flow, Force, ForceModule

IMAGES = 10
"""Images in the bottom, and as many in the surface; four digits at a depth of a tenth of the length."""

# Beyond so many mean lengths there is no force [-], and the differences of the closed form are all rounding.
_FAR = 8.0
# A boat is too small to matter; shorter than this share of the own length it is as long as that.
_LEAST = 0.25
# Images deeper than so many lengths of both ships add nothing: the fifth power of that.
_DEEP = 4.0
# Factors of the series, multiplied as kernels are slow to divide.
_SIXTH, _24TH, _120TH = 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0


class Kernel(NamedTuple):
    """Repeated integrals over s of 1/r^3 (K) and of s/r^3 (H), r^2 = s^2 + b^2, from the second on."""

    K2: Scalar
    K3: Scalar
    K4: Scalar
    K5: Scalar
    H2: Scalar
    H3: Scalar
    H4: Scalar


def kernel(s: Scalar, square: Scalar, image: bool) -> Kernel:
    """The repeated integrals at s for b^2 = `square` > 0.

    Those of an image are less what a power series in s/b begins with: 1 and s of the kernels give nothing with ships
    of equal ends, and beside them the rest, which falls with b^-5, would be rounding.
    """
    b = root(square)
    t = s / b
    p = root(1.0 + t * t)
    turn = sign(t) * log(magnitude(t) + p)
    t_2 = t * t
    t_3, t_4, t_5 = t * t_2, t_2 * t_2, t * t_2 * t_2
    line = 0.5 * (t * p + turn)  # the integral of p
    cube = 0.25 * t * p * p * p + 0.75 * line  # of p^3
    moment = 0.5 * t_2 * turn - 0.5 * (line - turn)  # of t asinh t
    k_4, k_5 = (p * p * p) * _SIXTH + 0.5 * (t * turn - p), cube * _SIXTH + 0.5 * (moment - line)
    h_3, h_4 = p - t * turn, 0.75 * t * p - (0.5 * t_2 - 0.25) * turn
    if not image:
        return Kernel(p / b, line, b * k_4, b * b * k_5, -turn, b * h_3, b * b * h_4)
    k_2 = -0.5 * t_4 / ((p + 1.0) * (p + 1.0))
    k_3 = 0.5 * (t_3 / (p + 1.0) + (turn - t)) - t_3 * _SIXTH
    k_4, k_5 = k_4 + 2.0 * _SIXTH - 0.5 * t_2 - t_4 * _24TH, k_5 + (2.0 * _SIXTH) * t - t_3 * _SIXTH - t_5 * _120TH
    h_3, h_4 = h_3 - 1.0 + 0.5 * t_2 - t_4 * _24TH, h_4 - t + t_3 * _SIXTH - t_5 * _120TH
    return Kernel(k_2 / b, k_3, b * k_4, b * b * k_5, t - turn - t_3 * _SIXTH, b * h_3, b * b * h_4)


class Shape(NamedTuple):
    """Double integrals over both ships: of x_1 x_2/r^3, x_1^2 x_2/r^3, x_2/r^3, and x_1 x_2 s/r^3."""

    both: Scalar
    second: Scalar
    second_only: Scalar
    along: Scalar


def shape(
    L_1: Scalar, L_2: Scalar, xi: Scalar, eta: Scalar, per_h: Scalar, images: int = IMAGES, deep: float = _DEEP
) -> Shape:
    """The integrals of `Shape`, summed over images.

    Args:
        L_1, L_2: lengths [m].
        xi, eta: the other midship ahead and to starboard [m].
        per_h: one over the depth [1/m]; 0 in deep water, without images.
        images: number of images on each side.
        deep: lengths of both ships beyond which an image adds nothing.
    """
    found: tuple[Scalar, ...] = (0.0, 0.0, 0.0, 0.0)
    shallow, most = larger(per_h, 1e-6), deep * (L_1 + L_2)
    for k in range(images + 1):
        far = smaller(2.0 * k / shallow, most)
        weight = 1.0 if k == 0 else where(far < most, 2.0, 0.0)
        one = _pair(L_1, L_2, xi, eta * eta + far * far, k > 0)
        found = tuple(a + weight * b for a, b in zip(found, one, strict=True))
    return Shape(*found)


def _pair(L_1: Scalar, L_2: Scalar, xi: Scalar, square: Scalar, image: bool) -> tuple[Scalar, ...]:
    both: Scalar = 0.0
    second: Scalar = 0.0
    only: Scalar = 0.0
    along: Scalar = 0.0
    for side_2 in (1.0, -1.0):
        for side_1 in (1.0, -1.0):
            e, f, w = 0.5 * side_2 * L_2, 0.5 * side_1 * L_1, side_1 * side_2
            q = kernel(e + xi - f, square, image)
            both = both + w * (e * (-f * q.K2 - q.K3) + f * q.K3 + q.K4)
            only = only + w * (q.K3 - e * q.K2)
            second = second + w * (e * (-f * f * q.K2 - 2.0 * f * q.K3 - 2.0 * q.K4)
                                   + f * f * q.K3 + 2.0 * f * q.K4 + 2.0 * q.K5)  # fmt: skip
            along = along + w * (e * (-f * q.H2 - q.H3) + f * q.H3 + q.H4)
    return both, second, only, along


@dataclass(frozen=True, kw_only=True)
class Passing(ForceModule):
    """Force of the other ship of the flow, on one of midship section A_M; a factor for what theory leaves out."""

    A_M: Scalar = spec("m^2", "midship section under water", (1e-6, 1e4))
    B: Scalar = spec("m", "breadth; the other ship is taken to be no nearer than it", (1e-3, 1e3))
    c_passing: Scalar = spec("", "force over that of theory", (0.0, 10.0), default=1.0)

    def force(self, flow: Flow) -> Force:
        L_1, L_2 = flow.L_pp, larger(flow.L_2, _LEAST * flow.L_pp)
        away = flow.eta * flow.eta
        side = where(flow.eta < 0.0, -1.0, 1.0)
        eta = side * root(larger(away, self.B * self.B))
        mean = 0.5 * (L_1 + L_2)
        reach = _FAR * mean
        xi, eta = clip(flow.xi, -reach, reach), clip(eta, -reach, reach)
        q = shape(L_1, L_2, xi, eta, flow.d_over_h / flow.d)
        left = _fading(xi / reach) * _fading(eta / reach)
        scale = self.c_passing * flow.rho * flow.U_2 / (2.0 * pi) * left
        slope_1, slope_2 = -8.0 * self.A_M / (L_1 * L_1), -8.0 * flow.A_2 / (L_2 * L_2)
        lead = 2.0 * flow.U_2 - flow.u
        section = self.A_M * (q.second_only - 4.0 / (L_1 * L_1) * q.second)
        X = scale * flow.U_2 * slope_1 * slope_2 * q.along
        Y = scale * eta * lead * slope_1 * slope_2 * q.both
        N = scale * eta * slope_2 * (lead * slope_1 * q.second + 2.0 * flow.U_2 * section)
        return Force(X, Y, N)


def _fading(x: Scalar) -> Scalar:
    """One up to half the reach, from there smoothly to zero at its end."""
    left = clip(2.0 * (1.0 - magnitude(x)), 0.0, 1.0)
    return left * left * (3.0 - 2.0 * left)
