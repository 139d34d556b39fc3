"""Nomoto's second-order model of steering, and its constants from linear derivatives (Sawada 2024 Eqs. 4, 5)."""

from __future__ import annotations

import math
from typing import ClassVar, NamedTuple

from ..core.parameters import ParameterError, Scalar, Scalars, spec
from ..core.symbolic import magnitude
from ..core.values import dataclass
from ..environment import Environment
from . import STATES, Model
from .common import Surroundings


class SecondOrder(NamedTuple):
    """K [1/s] and T_1, T_2, T_3 [s] of T_1 T_2 r'' + (T_1 + T_2) r' + r = K (delta + T_3 delta')."""

    K: Scalar
    T_1: Scalar
    T_2: Scalar
    T_3: Scalar

    @property
    def T(self) -> Scalar:
        """Time constant of the first-order model that comes nearest at slow steering: T_1 + T_2 - T_3 [s]."""
        return self.T_1 + self.T_2 - self.T_3

    def to_prime(self, L: Scalar, U: Scalar) -> SecondOrder:
        """The same without dimension, for a length L [m] and a speed U [m/s] (Eq. 7)."""
        pace = U / L
        return SecondOrder(self.K / pace, self.T_1 * pace, self.T_2 * pace, self.T_3 * pace)

    def from_prime(self, L: Scalar, U: Scalar) -> SecondOrder:
        """The same in 1/s and s, where this is without dimension (Eq. 7)."""
        pace = U / L
        return SecondOrder(self.K * pace, self.T_1 / pace, self.T_2 / pace, self.T_3 / pace)


class Derivatives(NamedTuple):
    """Linear derivatives in the form and with the signs of Sawada 2024 Eq. 4, all without dimension.

    Origin at the centre of gravity, beta positive with the flow on the port bow; m_x, m_y are the mass with its
    added mass in surge and in sway, n the moment of inertia with its added part, I_zz + J_zz.
    C_Y_delta is positive for a rudder that pushes the stern to port as it turns the bow to starboard.
    """

    m_x: float
    m_y: float
    n: float
    C_Y_beta: float
    C_Y_r: float
    C_Y_delta: float
    C_N_beta: float
    C_N_r: float
    C_N_delta: float

    @property
    def stability(self) -> float:
        """Above zero where the ship is stable on a straight course: the common denominator of Eq. 5."""
        return self.C_Y_beta * self.C_N_r - (self.m_x - self.C_Y_r) * self.C_N_beta

    def second_order(self, L: float, U: float) -> SecondOrder:
        """Nomoto's constants of a ship of length L [m] at the speed U [m/s] (Eq. 5).

        Raises:
            ParameterError: neutral stability, or time constants that are not real.
        """
        gain = self.C_N_beta * self.C_Y_delta + self.C_Y_beta * self.C_N_delta
        if self.stability == 0.0 or gain == 0.0:
            raise ParameterError("the derivatives give no finite K and T: neutrally stable, or a rudder without effect")
        K = U / L * gain / self.stability  # (5b)
        total = L / U * (self.m_y * self.C_N_r + self.n * self.C_Y_beta) / self.stability  # (5c)
        product = (L / U) ** 2 * self.m_y * self.n / self.stability  # (5d)
        T_3 = L / U * self.m_y * self.C_N_delta / gain  # (5e)
        return SecondOrder(K, *time_constants(total, product), T_3)


def time_constants(total: float, product: float) -> tuple[float, float]:
    """T_1 and T_2 [s], the slower one first, from their sum [s] and product [s^2].

    Raises:
        ParameterError: they are not real, which no hull without a restoring force has.
    """
    root = 0.25 * total * total - product
    if root < 0.0:
        raise ParameterError(
            f"T1 + T2 = {total:g} s and T1 T2 = {product:g} s^2 give no real time constants: the motion oscillates"
        )
    slow = 0.5 * total + math.copysign(math.sqrt(root), total)
    return slow, product / slow


@dataclass(frozen=True, kw_only=True)
class Nomoto2(Model):
    """T_1 T_2 r'' + (T_1 + T_2) r' + n_1 r + alpha r^3 = K (delta + delta_r) + K T_3 delta'.

    Sawada 2024 Eq. 5a with the cubic term of Eq. 8, at a held speed through the water, without drift.
    The rudder is never differentiated: the own state `lead` [rad/s^2] carries what is between rudder
    and yaw rate, and is zero in a straight run.  The constants hold at U; at another speed K grows with
    it and the times fall with it.  An unstable ship has a negative T_1 (or n_1 = -1).
    """

    states: ClassVar[tuple[str, ...]] = (*STATES, "lead")

    K: Scalar = spec("1/s", "steady yaw rate over rudder angle at U")
    T_1: Scalar = spec("s", "slow time constant at U; negative if unstable")
    T_2: Scalar = spec("s", "fast time constant at U")
    T_3: Scalar = spec("s", "time constant of the rudder's rate at U")
    U: Scalar = spec("m/s", "speed at which K and the time constants hold", (1e-3, 100.0))
    alpha: Scalar = spec("s^2", "Norrbin's cubic term, per rad^2", default=0.0)
    n_1: Scalar = spec("-", "factor of the linear term: 1, or -1 for an unstable ship", default=1.0)
    delta_r: Scalar = spec("rad", "residual rudder: the angle that the ship feels amidships", default=0.0)

    @property
    def constants(self) -> SecondOrder:
        """K, T_1, T_2, T_3 at the speed U."""
        return SecondOrder(self.K, self.T_1, self.T_2, self.T_3)

    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        around = Surroundings.of(state, environment)
        r, lead = around.r, state[6]
        ratio = around.u_r / self.U
        pace, product = magnitude(ratio), self.T_1 * self.T_2
        steady = self.K * ratio * (control[1] + self.delta_r)
        held = self.n_1 * r + self.alpha * r * r * r
        # (5a) in observer form: r' = lead - (T1 + T2)/(T1 T2) r + K T3/(T1 T2) delta, lead' the rest
        dr = lead + pace * (self.T_3 * steady - (self.T_1 + self.T_2) * r) / product
        dlead = pace * pace * (steady - held) / product
        return (*around.rates((0.0, 0.0, dr)), dlead)
