"""Memory of the waves that a moving hull leaves, as sections of a state space; `environment.sea.memory` fits them.

The force of three coupled motions is -T(s) times their accelerations,

    T(s) = sum_k (c_k s + d_k)/(s^2 + 2 a_k s + w_k^2).

A section has two states a motion, which are zero in a steady run:

    y' = h,   h' = acceleration - 2 a h - w^2 y,   force = -(c h + d y),

so that y is s v/(...) of the motion's velocity v.  Slow motions feel the added mass d / w^2.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import inf

from ..core.parameters import Scalar, Scalars, spec
from ..core.values import dataclass

Three = tuple[Scalar, Scalar, Scalar]


def weighed(pairs: tuple[Scalar, ...], x: Three) -> Three:
    """A symmetric matrix, given as 11, 12, 13, 22, 23, 33, times a vector."""
    a, b, c, d, e, f = pairs
    return a * x[0] + b * x[1] + c * x[2], b * x[0] + d * x[1] + e * x[2], c * x[0] + e * x[1] + f * x[2]


class _Section(ABC):
    """A pair of poles."""

    a: Scalar
    w: Scalar

    @property
    @abstractmethod
    def numerators(self) -> tuple[Scalars, Scalars]:
        """Numerators c and d of the pairs, in the order of `weighed`."""

    def answer(self, h: Three, y: Three) -> Three:
        """Force of the section on the three motions."""
        c, d = self.numerators
        by_h, by_y = weighed(c, h), weighed(d, y)
        return -by_h[0] - by_y[0], -by_h[1] - by_y[1], -by_h[2] - by_y[2]

    def rates(self, h: Three, y: Three, acceleration: Three) -> tuple[Scalar, ...]:
        """Rates of h and of y of the three motions."""
        damping, stiffness = 2.0 * self.a, self.w * self.w
        return (*(acceleration[k] - damping * h[k] - stiffness * y[k] for k in range(3)), *h)

    @property
    def slow(self) -> Scalars:
        """Added mass that slow motions feel, in the order of `weighed`."""
        over = 1.0 / (self.w * self.w)
        return tuple(d * over for d in self.numerators[1])


@dataclass(frozen=True, kw_only=True)
class Longitudinal(_Section):
    """A section of surge (1), heave (3) and pitch (5)."""

    a: Scalar = spec("1/s", "damping of the section: half the term of s", (1e-9, inf))
    w: Scalar = spec("rad/s", "natural frequency of the section", (1e-9, inf))
    c_11: Scalar = spec("kg/s", "surge by surge, by h", default=0.0)
    c_13: Scalar = spec("kg/s", "surge by heave, by h", default=0.0)
    c_15: Scalar = spec("kg m/s", "surge by pitch, by h", default=0.0)
    c_33: Scalar = spec("kg/s", "heave by heave, by h", default=0.0)
    c_35: Scalar = spec("kg m/s", "heave by pitch, by h", default=0.0)
    c_55: Scalar = spec("kg m^2/s", "pitch by pitch, by h", default=0.0)
    d_11: Scalar = spec("kg/s^2", "surge by surge, by y", default=0.0)
    d_13: Scalar = spec("kg/s^2", "surge by heave, by y", default=0.0)
    d_15: Scalar = spec("kg m/s^2", "surge by pitch, by y", default=0.0)
    d_33: Scalar = spec("kg/s^2", "heave by heave, by y", default=0.0)
    d_35: Scalar = spec("kg m/s^2", "heave by pitch, by y", default=0.0)
    d_55: Scalar = spec("kg m^2/s^2", "pitch by pitch, by y", default=0.0)

    @property
    def numerators(self) -> tuple[Scalars, Scalars]:
        return ((self.c_11, self.c_13, self.c_15, self.c_33, self.c_35, self.c_55),
                (self.d_11, self.d_13, self.d_15, self.d_33, self.d_35, self.d_55))  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Lateral(_Section):
    """A section of sway (2), roll (4) and yaw (6)."""

    a: Scalar = spec("1/s", "damping of the section: half the term of s", (1e-9, inf))
    w: Scalar = spec("rad/s", "natural frequency of the section", (1e-9, inf))
    c_22: Scalar = spec("kg/s", "sway by sway, by h", default=0.0)
    c_24: Scalar = spec("kg m/s", "sway by roll, by h", default=0.0)
    c_26: Scalar = spec("kg m/s", "sway by yaw, by h", default=0.0)
    c_44: Scalar = spec("kg m^2/s", "roll by roll, by h", default=0.0)
    c_46: Scalar = spec("kg m^2/s", "roll by yaw, by h", default=0.0)
    c_66: Scalar = spec("kg m^2/s", "yaw by yaw, by h", default=0.0)
    d_22: Scalar = spec("kg/s^2", "sway by sway, by y", default=0.0)
    d_24: Scalar = spec("kg m/s^2", "sway by roll, by y", default=0.0)
    d_26: Scalar = spec("kg m/s^2", "sway by yaw, by y", default=0.0)
    d_44: Scalar = spec("kg m^2/s^2", "roll by roll, by y", default=0.0)
    d_46: Scalar = spec("kg m^2/s^2", "roll by yaw, by y", default=0.0)
    d_66: Scalar = spec("kg m^2/s^2", "yaw by yaw, by y", default=0.0)

    @property
    def numerators(self) -> tuple[Scalars, Scalars]:
        return ((self.c_22, self.c_24, self.c_26, self.c_44, self.c_46, self.c_66),
                (self.d_22, self.d_24, self.d_26, self.d_44, self.d_46, self.d_66))  # fmt: skip
