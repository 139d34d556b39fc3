"""Azimuth thrusters: thrust by revolutions, or ordered in newtons, in any direction.

alpha is clockwise from ahead: a stern thruster at alpha > 0 pushes the stern to starboard, and the ship
turns to port.  The moment of a thruster at (x, y) is x Y - y X, as in Sawada 2024 Eq. 25; the sign of
the second lever is misprinted in You 2023 Eq. 8.
"""

from __future__ import annotations

import math
from typing import ClassVar

from ..core.parameters import Scalar, Scalars, spec
from ..core.symbolic import clip, cos, magnitude, sin, tanh, where
from ..core.values import dataclass
from . import Flow, Force, ThrusterModule

# Revolutions [1/s] over which the offset of a thrust polynomial fades out, so that a still propeller is silent.
_FADE = 0.01
# A polynomial with this limit [1/s] holds without one.
_UNLIMITED = 1e6

Columns = tuple[tuple[Scalar, Scalar, Scalar], ...]


def columns(x: Scalar, y: Scalar) -> Columns:
    """Columns of B of a thruster at (x, y): what a force ahead and a force to starboard do (Sawada 2024 Eq. 28)."""
    return (1.0, 0.0, -y), (0.0, 1.0, x)


def steered(x: Scalar) -> tuple[str, float]:
    """How the direction of a thruster obeys a rudder order: against it at the stern, with it at the bow."""
    return "delta", (1.0 if x > 0 else -1.0)


@dataclass(frozen=True, kw_only=True)
class Azimuth(ThrusterModule):
    """Thruster whose thrust is a polynomial in the revolutions, less what forward speed takes from it.

    T = c_0 + c_1 n + c_2 n^2 + ... + c_5 n^5 ahead (You 2023 Eq. 20); c_2 alone is T_|n|n |n| n (Sawada 2024
    Eq. 25).  A bollard pull gives no thrust at n < 0: there the polynomial is turned round and multiplied by
    `astern`.  c_0, a fit's error at rest, fades out below some 0.03 1/s; beyond `n_max` the thrust holds.
    """

    prefixes: ClassVar[tuple[str, ...]] = ("n", "alpha")

    x: Scalar = spec("m", "position ahead of midship")
    y: Scalar = spec("m", "position to starboard of the centreline", default=0.0)
    c_0: Scalar = spec("N", "thrust polynomial, offset", default=0.0)
    c_1: Scalar = spec("N s", "thrust polynomial, n", default=0.0)
    c_2: Scalar = spec("N s^2", "thrust polynomial, n |n|: T_|n|n", default=0.0)
    c_3: Scalar = spec("N s^3", "thrust polynomial, n^3", default=0.0)
    c_4: Scalar = spec("N s^4", "thrust polynomial, n^3 |n|", default=0.0)
    c_5: Scalar = spec("N s^5", "thrust polynomial, n^5", default=0.0)
    n_max: Scalar = spec(
        "1/s", "greatest revolutions for which the polynomial holds", (0.0, _UNLIMITED), default=_UNLIMITED
    )  # fmt: skip
    astern: Scalar = spec("", "thrust astern over that ahead at the same |n|", (0.0, 2.0), default=1.0)
    t: Scalar = spec("", "thrust deduction factor", (-0.5, 1.0), default=0.0)
    T_nu: Scalar = spec("N s^2/m", "thrust lost per |n| and velocity along the shaft", (0.0, 1e9), default=0.0)

    @property
    def follows(self) -> tuple[tuple[str, float], ...]:
        """Revolutions obey n_P; the direction obeys the rudder order, so that delta > 0 turns to starboard."""
        return ("n_P", 1.0), steered(self.x)

    @property
    def effect(self) -> Columns:
        """Columns of B (Sawada 2024 Eq. 28)."""
        return columns(self.x, self.y)

    @property
    def tested(self) -> tuple[float, float]:
        """Revolutions [1/s] for which the polynomial holds; infinite where `n_max` is left at its limit."""
        most = float(self.n_max)
        return (-most, most) if most < _UNLIMITED else (-math.inf, math.inf)

    def thrust(self, n: Scalar) -> Scalar:
        """Thrust at bollard pull [N] at `n` [1/s]."""
        k = clip(n, -self.n_max, self.n_max)
        a = magnitude(k)
        ahead = k * (self.c_1 + a * (self.c_2 + a * (self.c_3 + a * (self.c_4 + a * self.c_5))))  # You 2023 (20)
        return where(k < 0, self.astern, 1.0) * (ahead + self.c_0 * tanh(k / _FADE))

    def inputs(self, flow: Flow, control: Scalars) -> Scalars:
        """u_1 and u_2 [N] of Sawada 2024 Eq. 26."""
        n, alpha = control
        T = (1.0 - self.t) * self.thrust(n)
        return T * cos(alpha), T * sin(alpha)  # Sawada 2024 (26)

    def loss(self, flow: Flow, control: Scalars) -> tuple[Scalar, Scalar, Scalar]:
        """d_loss(n, alpha) of Sawada 2024 Eq. 25 [N s/m, N s/m, N s]: what u_r along the shaft takes."""
        n, alpha = control
        c, s = cos(alpha), sin(alpha)
        along = (1.0 - self.t) * self.T_nu * magnitude(n) * c
        return along * c, along * s, along * (self.x * s - self.y * c)

    def force(self, flow: Flow, control: Scalars) -> Force:
        u_1, u_2 = self.inputs(flow, control)
        d_X, d_Y, d_N = self.loss(flow, control)
        lever = self.x * u_2 - self.y * u_1
        return Force(u_1 - d_X * flow.u, u_2 - d_Y * flow.u, lever - d_N * flow.u)  # Sawada 2024 (27)


@dataclass(frozen=True, kw_only=True)
class ThrustAzimuth(ThrusterModule):
    """Thruster with its thrust ordered in newtons, for ships whose thrust map is unknown.

    `f_per_n` lets it obey an order of revolutions: so many newtons per 1/s, a convention and no physics.
    """

    prefixes: ClassVar[tuple[str, ...]] = ("f", "alpha")

    x: Scalar = spec("m", "position ahead of midship")
    y: Scalar = spec("m", "position to starboard of the centreline", default=0.0)
    f_per_n: Scalar = spec("N s", "thrust for an order of one revolution per second", (0.0, 1e9), default=1.0)

    @property
    def follows(self) -> tuple[tuple[str, float], ...]:
        """Thrust obeys n_P by `f_per_n`; the direction obeys the rudder order, delta > 0 to starboard."""
        return ("n_P", self.f_per_n), steered(self.x)

    @property
    def effect(self) -> Columns:
        """Columns of B (Sawada 2024 Eq. 28)."""
        return columns(self.x, self.y)

    def inputs(self, flow: Flow, control: Scalars) -> Scalars:
        """Force ahead and to starboard [N]."""
        f, alpha = control
        return f * cos(alpha), f * sin(alpha)

    def force(self, flow: Flow, control: Scalars) -> Force:
        u_1, u_2 = self.inputs(flow, control)
        return Force(u_1, u_2, self.x * u_2 - self.y * u_1)
