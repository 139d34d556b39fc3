"""Side thrusters in a tunnel, with what forward speed takes from them, and forces ordered directly."""

from __future__ import annotations

from math import pi
from typing import ClassVar

from ..core.constants import GRAVITY
from ..core.parameters import ParameterError, Scalar, Scalars, choice, spec
from ..core.symbolic import exp, is_symbol, larger, magnitude, root, where
from ..core.values import dataclass
from . import Flow, Force, ThrusterModule

# Squared revolutions [1/s^2] below which a jet is as good as none: its velocity never divides by zero.
_STILL = 1e-12


@dataclass(frozen=True, kw_only=True)
class Tunnel(ThrusterModule):
    """A side thruster: T = K_T rho D^4 n |n|, or T_0 (n/n_0)|n/n_0| from its rated thrust; n > 0 to starboard.

    Ahead or astern the jet bends along the hull and its suction takes side force and moment; they fade
    unequally, so each has its own numbers.  `loss_form` picks how:

    - ``jet``: exp(-c (u/V_j)^2), with V_j = sqrt(T/(rho A)) the velocity of the jet.  It only falls: hold it
      to the speeds of the test behind c.  Measured moments come back at speed: for a tanker of 60 000 tdw half
      the moment is left at 4 kn, and all of it again at 15 kn (Chislett and Bjoerheden 1966, abstract).
    - ``froude``: 1 + a_1 Fn + a_2 Fn^2 with Fn = |u|/sqrt(g L_pp), not below zero (the form, without its
      constant, that Miyauchi et al. fit to a 3 m model, whose numbers are not published): it can come back.
    - ``none``: the thrust at rest, at every speed.

    No published set of these numbers is general; a ship file states its own.
    """

    prefixes: ClassVar[tuple[str, ...]] = ("n",)
    effect: ClassVar[tuple[tuple[float, float, float], ...]] = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    loss_form: str = choice("how forward speed takes side force", ("none", "jet", "froude"), "none")
    x: Scalar = spec("m", "position ahead of midship")
    D: Scalar = spec("m", "diameter of the tunnel", (1e-4, 20.0))
    K_T: Scalar = spec("", "thrust coefficient T/(rho n^2 D^4); 0 where rated thrust is given", (0.0, 5.0), default=0.0)
    T_0: Scalar = spec("N", "rated thrust; 0 where K_T is given", (0.0, 1e8), default=0.0)
    n_0: Scalar = spec("1/s", "revolutions of the rated thrust", (1e-3, 1e4), default=1.0)
    to_port: Scalar = spec("", "thrust to port over that to starboard at the same |n|", (0.0, 2.0), default=1.0)
    c_Y: Scalar = spec("", "jet: how fast the side force fades with (u/V_j)^2", (0.0, 1e3), default=0.0)
    c_N: Scalar = spec("", "jet: how fast the moment fades with (u/V_j)^2", (0.0, 1e3), default=0.0)
    a_Y1: Scalar = spec("", "froude: side force, linear in Fn", default=0.0)
    a_Y2: Scalar = spec("", "froude: side force, quadratic in Fn", default=0.0)
    a_N1: Scalar = spec("", "froude: moment, linear in Fn", default=0.0)
    a_N2: Scalar = spec("", "froude: moment, quadratic in Fn", default=0.0)
    n_per_delta: Scalar = spec("1/s", "revolutions for a rudder order of one radian; 0 obeys none", default=0.0)

    def __post_init__(self) -> None:
        thrust = (self.K_T, self.T_0)
        if not any(map(is_symbol, thrust)) and (self.K_T > 0.0) == (self.T_0 > 0.0):
            raise ParameterError("a tunnel thruster has either K_T or a rated thrust T_0 (at n_0); give one of them")
        froude = (self.a_Y1, self.a_Y2, self.a_N1, self.a_N2)
        numbers = {"jet": (self.c_Y, self.c_N), "froude": froude}.get(self.loss_form, (1.0,))
        if not any(is_symbol(x) or x for x in numbers):
            names = "c_Y and c_N" if self.loss_form == "jet" else "a_Y1, a_Y2, a_N1 and a_N2"
            raise ParameterError(f"loss_form {self.loss_form} needs {names}; without them, loss_form is none")

    @property
    def follows(self) -> tuple[tuple[str, float], ...]:
        """Revolutions obey the helm where the ship file gives `n_per_delta`."""
        return (("delta", self.n_per_delta) if self.n_per_delta else ("", 0.0),)

    def thrust(self, rho: Scalar, n: Scalar) -> Scalar:
        """Thrust at rest [N] at `n` [1/s], positive to starboard."""
        per = self.K_T * rho * self.D * self.D * self.D * self.D + self.T_0 / (self.n_0 * self.n_0)
        return where(n < 0, self.to_port, 1.0) * per * n * magnitude(n)

    def left(self, flow: Flow, n: Scalar) -> tuple[Scalar, Scalar]:
        """What forward speed leaves of the side force and of the moment, as ratios."""
        if self.loss_form == "jet":
            per = magnitude(self.thrust(flow.rho, n)) + _STILL
            ratio = flow.u * flow.u * flow.rho * 0.25 * pi * self.D * self.D / per  # (u/V_j)^2
            return exp(-self.c_Y * ratio), exp(-self.c_N * ratio)
        if self.loss_form == "froude":
            Fn = magnitude(flow.u) / root(GRAVITY * flow.L_pp)
            side, turn = (self.a_Y1 + self.a_Y2 * Fn) * Fn, (self.a_N1 + self.a_N2 * Fn) * Fn
            return larger(1.0 + side, 0.0), larger(1.0 + turn, 0.0)
        return 1.0, 1.0

    def inputs(self, flow: Flow, control: Scalars) -> Scalars:
        """Side force [N] and moment about midship [N m]; their loss with speed is in them."""
        T = self.thrust(flow.rho, control[0])
        side, turn = self.left(flow, control[0])
        return T * side, self.x * T * turn

    def force(self, flow: Flow, control: Scalars) -> Force:
        Y, N = self.inputs(flow, control)
        return Force(0.0, Y, N)


@dataclass(frozen=True, kw_only=True)
class Direct(ThrusterModule):
    """Forces ordered directly, X [N], Y [N] and N [N m], as the controllers of model ships in a basin do.

    `X_per_n` and `N_per_delta` let it obey orders of revolutions and rudder, a convention and no physics;
    at zero they obey none.
    """

    prefixes: ClassVar[tuple[str, ...]] = ("X", "Y", "N")
    effect: ClassVar[tuple[tuple[float, float, float], ...]] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    X_per_n: Scalar = spec("N s", "surge force for an order of one revolution per second", default=0.0)
    N_per_delta: Scalar = spec("N m", "yaw moment for a rudder order of one radian", default=0.0)

    @property
    def follows(self) -> tuple[tuple[str, float], ...]:
        """Surge force obeys n_P and yaw moment the rudder order, where the ship file gives the factors."""
        surge = ("n_P", self.X_per_n) if self.X_per_n else ("", 0.0)
        yaw = ("delta", self.N_per_delta) if self.N_per_delta else ("", 0.0)
        return surge, ("", 0.0), yaw

    def inputs(self, flow: Flow, control: Scalars) -> Scalars:
        """The forces themselves."""
        return control

    def force(self, flow: Flow, control: Scalars) -> Force:
        return Force(*control)
