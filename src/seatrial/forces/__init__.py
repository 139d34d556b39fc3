"""Forces on a ship: one physical effect, one module.

A force module is a frozen dataclass that declares its numbers with `spec` and turns a `Flow` into
a `Force`.  It sees velocities *through the water* at midship, never the ground, the trial or the
integrator.  Modules that feed one another hand over a value: the propeller leaves a `Slipstream`.

Conformance (`seatrial.testing`): silent at rest, mirrored under (v_m, r, delta) -> -(v_m, r, delta)
where `mirror_symmetric` (its port and starboard coefficients being equal), finite with finite
Jacobians at rest and astern, floats = symbols.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple, Protocol

from ..core.parameters import Scalar, Scalars

HARD_OVER = math.radians(35.0)
"""Helm [rad] that asks a craft without a rudder for all that turns it: 100 percent of its steering demand."""


class Force(NamedTuple):
    """Surge force X [N], sway force Y [N] and yaw moment N about midship [N m]."""

    X: Scalar
    Y: Scalar
    N: Scalar

    def __add__(self, other: Force) -> Force:  # type: ignore[override]
        return Force(self.X + other.X, self.Y + other.Y, self.N + other.N)

    def __sub__(self, other: Force) -> Force:
        return Force(self.X - other.X, self.Y - other.Y, self.N - other.N)


class Flow(NamedTuple):
    """What the ship feels at one instant.

    Attributes:
        u, v_m, r: velocities through the water at midship [m/s, m/s, rad/s].
        n_P: propeller revolutions [1/s], positive ahead.
        delta: rudder angle [rad], positive turns the bow to starboard.
        u_A, v_A: apparent wind, the components it comes from in ship axes [m/s].
        rho: density of the water [kg/m^3].
        L_pp, d: length between perpendiculars and draught [m].
        wave_u, wave_v: significant wave height, the components it comes from in ship axes [m].
        wave_T: mean period of the waves [s]; 0 without waves.
        d_over_h: draught over depth of the water; 0 in deep water.
        bank_u, bank_v: suction of the banks, the components towards them in ship axes [-]; 0 without banks.
        quay_u, quay_v: towards the nearest quay, over its distance from midship [1/m]; 0 without a quay.
        xi, eta: midship of another ship ahead of and to starboard of the own one [m].
        U_2: its velocity through the water along the own bow [m/s].
        L_2, A_2: its length [m] and midship section [m^2]; 0 where there is none.
    """

    u: Scalar
    v_m: Scalar
    r: Scalar
    n_P: Scalar
    delta: Scalar
    u_A: Scalar
    v_A: Scalar
    rho: Scalar
    L_pp: Scalar
    d: Scalar
    wave_u: Scalar = 0.0
    wave_v: Scalar = 0.0
    wave_T: Scalar = 0.0
    d_over_h: Scalar = 0.0
    bank_u: Scalar = 0.0
    bank_v: Scalar = 0.0
    quay_u: Scalar = 0.0
    quay_v: Scalar = 0.0
    xi: Scalar = 0.0
    eta: Scalar = 0.0
    U_2: Scalar = 0.0
    L_2: Scalar = 0.0
    A_2: Scalar = 0.0


class Slipstream(NamedTuple):
    """What the propeller leaves for the rudder behind it.

    Attributes:
        u_P: longitudinal inflow velocity of the propeller (1 - w_P) u [m/s].
        K_T_nD2: K_T (n_P D_P)^2, signed as the thrust [m^2/s^2]: the race without a division by n_P.
        D_P: propeller diameter [m].
    """

    u_P: Scalar
    K_T_nD2: Scalar
    D_P: Scalar


class ForceModule(Protocol):
    """A force that depends on the flow alone (hull, wind, waves)."""

    mirror_symmetric: ClassVar[bool] = True

    @abstractmethod
    def force(self, flow: Flow) -> Force:
        """Force of this effect on the ship."""


class PropellerModule(Protocol):
    """A propeller: its force and the slipstream it leaves."""

    mirror_symmetric: ClassVar[bool] = True

    @abstractmethod
    def force(self, flow: Flow) -> tuple[Force, Slipstream]:
        """Force of the propeller, and what it leaves for the rudder."""


class RudderModule(Protocol):
    """A rudder in a slipstream."""

    mirror_symmetric: ClassVar[bool] = True

    @abstractmethod
    def force(self, flow: Flow, slipstream: Slipstream) -> Force:
        """Force of the rudder, hull interaction included."""


class ThrusterModule(ABC):
    """A thruster with controls of its own (tunnel, azimuth): the base of every thruster."""

    mirror_symmetric: ClassVar[bool] = True

    prefixes: ClassVar[tuple[str, ...]]
    """Names of its controls: a part called ``bow`` with the prefixes ("n",) has the control ``n_bow``."""

    @property
    def follows(self) -> tuple[tuple[str, float], ...]:
        """For each control the order of a conventional ship that it obeys and the factor; ("", 0.0) for none.

        A stern azimuth has (("n_P", 1.0), ("delta", -1.0)).
        """
        return (("", 0.0),) * len(self.prefixes)

    @property
    def differential(self) -> tuple[float, ...]:
        """What each control takes of the helm besides the order that it follows, per radian; by default nothing."""
        return (0.0,) * len(self.prefixes)

    @property
    def tested(self) -> tuple[float, float]:
        """Range of the first control for which the thrust is known; infinite without a limit."""
        return -math.inf, math.inf

    def loss(self, flow: Flow, control: Scalars) -> tuple[Scalar, Scalar, Scalar]:
        """Surge, sway and yaw force lost per velocity ahead [N s/m, N s/m, N s]; by default none."""
        return 0.0, 0.0, 0.0

    @abstractmethod
    def force(self, flow: Flow, control: Scalars) -> Force:
        """Force of the thruster under its own actual controls, in the units of their prefixes."""
