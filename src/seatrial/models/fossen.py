"""Fossen's matrix-vector family: M nu_dot + C(nu_r) nu_r + D(nu_r) nu_r = tau + tau_wind + tau_waves."""

from __future__ import annotations

import math
from typing import NamedTuple

from ..core.parameters import ParameterError, Parts, Scalar, Scalars, choice, parts, spec
from ..core.values import dataclass
from ..environment import Environment
from ..forces import Flow, Force, ForceModule, PropellerModule, RudderModule
from .common import Composed, Surroundings

Row = tuple[Scalar, Scalar, Scalar]

_LEAST_GYRATION = 0.1
"""Radius of gyration in yaw over L_pp below which nothing is a ship: they have some 0.25."""


@dataclass(frozen=True, kw_only=True)
class Particulars:
    """Particulars that wind, waves and thrusters need besides the matrices."""

    rho: Scalar = spec("kg/m^3", "density of the water", (500.0, 2000.0))
    L_pp: Scalar = spec("m", "length between perpendiculars", (1e-3, 1e3))
    B: Scalar = spec("m", "breadth; 0 where unknown", (0.0, 1e3), default=0.0)
    d: Scalar = spec("m", "draught; 0 where unknown", (0.0, 100.0), default=0.0)
    m: Scalar = spec("kg", "mass of the water displaced; 0 where unknown", (0.0, 1e12), default=0.0)


@dataclass(frozen=True, kw_only=True)
class Inertia:
    """Mass matrix M, added mass included, and the Coriolis and centripetal matrix C that goes with it.

    Diagonal, it is the one of the model with six parameters (You 2023 Eq. 6); with m_23 and m_32 the
    surge-decoupled one (Eq. 2); in full the fully coupled one.  A fitted M need not be symmetric, which
    a mass matrix is, and may be lighter than the ship: `doubts` reports it.  `coriolis` picks C:

    - ``published``: You 2023 Eq. 3 as printed, from m_11, m_22 and m_23 alone;
    - ``consistent``: from the symmetric part of M, so that without damping a symmetric M keeps its
      momentum over the water and its energy;
    - ``no_munk``: as ``consistent``, without the moment that turns a drifting hull across its course, as where
      lift and viscosity are taken to cancel it (Fossen's Otter); then energy is not kept.
    """

    coriolis: str = choice("which matrix C goes with M", ("published", "consistent", "no_munk"), "published")
    m_11: Scalar = spec("kg", "mass in surge, m - X_udot", (1e-9, 1e12))
    m_22: Scalar = spec("kg", "mass in sway, m - Y_vdot", (1e-9, 1e12))
    m_33: Scalar = spec("kg m^2", "moment of inertia in yaw, I_z - N_rdot", (1e-9, 1e16))
    m_23: Scalar = spec("kg m", "sway force by yaw acceleration, m x_G - Y_rdot", default=0.0)
    m_32: Scalar = spec("kg m", "yaw moment by sway acceleration, m x_G - N_vdot", default=0.0)
    m_12: Scalar = spec("kg", "surge force by sway acceleration (fully coupled model)", default=0.0)
    m_21: Scalar = spec("kg", "sway force by surge acceleration (fully coupled model)", default=0.0)
    m_13: Scalar = spec("kg m", "surge force by yaw acceleration (fully coupled model)", default=0.0)
    m_31: Scalar = spec("kg m", "yaw moment by surge acceleration (fully coupled model)", default=0.0)

    @property
    def matrix(self) -> tuple[Row, Row, Row]:
        """Rows of M."""
        first, second = (self.m_11, self.m_12, self.m_13), (self.m_21, self.m_22, self.m_23)
        return first, second, (self.m_31, self.m_32, self.m_33)

    def coriolis_matrix(self, u: Scalar, v: Scalar, r: Scalar) -> tuple[Row, Row, Row]:
        """Rows of C at velocities through the water."""
        if self.coriolis == "published":
            m_23 = self.m_23
            c_13, c_23 = -self.m_22 * v - m_23 * r, self.m_11 * u  # You 2023 (3)
        else:
            m_12 = 0.5 * (self.m_12 + self.m_21)
            m_13 = 0.5 * (self.m_13 + self.m_31)
            m_23 = 0.5 * (self.m_23 + self.m_32)
            c_13 = -(m_12 * u + self.m_22 * v + m_23 * r)
            c_23 = self.m_11 * u + m_12 * v + m_13 * r
        back = (m_23 * r, 0.0, 0.0) if self.coriolis == "no_munk" else (-c_13, -c_23, 0.0)
        return (0.0, 0.0, c_13), (0.0, 0.0, c_23), back

    def acceleration(self, force: Force, u: Scalar, v: Scalar, r: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """Rates of u, v [m/s^2] and r [rad/s^2] under `force`, at velocities through the water."""
        (_, _, c_13), (_, _, c_23), (c_31, c_32, _) = self.coriolis_matrix(u, v, r)
        right = (force.X - c_13 * r, force.Y - c_23 * r, force.N - c_31 * u - c_32 * v)
        first, second, third = self.matrix
        minors = (_cross(second, third), _cross(third, first), _cross(first, second))
        over = 1.0 / _dot(first, minors[0])
        surge, sway, yaw = (over * _dot(right, row) for row in zip(*minors, strict=True))
        return surge, sway, yaw

    def doubts(self, displaced: float = 0.0, L_pp: float = 0.0) -> tuple[str, ...]:
        """What is physically doubtful about M, a sentence each; `displaced` is the mass of the ship [kg]."""
        found: list[str] = []
        a, b, c = (0.5 * (p + q) for p, q in (
            (self.m_12, self.m_21), (self.m_13, self.m_31), (self.m_23, self.m_32)))  # fmt: skip
        minors = (
            self.m_11, self.m_11 * self.m_22 - a * a,
            _dot((self.m_11, a, b), _cross((a, self.m_22, c), (b, c, self.m_33))),
        )  # fmt: skip
        if min(minors) <= 0.0:
            found.append("M is not positive definite: some motion has no kinetic energy, and the run may blow up")
        for name, p, q in (("12", self.m_12, self.m_21), ("13", self.m_13, self.m_31), ("23", self.m_23, self.m_32)):
            if abs(p - q) > 1e-6 * max(abs(p), abs(q)):
                found.append(f"M is not symmetric (m_{name} = {p:g}, m_{name[::-1]} = {q:g}): no body has such a mass")
        for name, mass in (("11", self.m_11), ("22", self.m_22)):
            if mass < displaced:
                found.append(f"m_{name} = {mass:g} kg is below the displaced {displaced:g} kg: added mass is negative")
        if self.m_33 < displaced * (_LEAST_GYRATION * L_pp) ** 2:
            radius = math.sqrt(self.m_33 / displaced)
            found.append(
                f"m_33 = {self.m_33:g} kg m^2 is that of a radius of gyration of {radius:.2g} m; "
                f"ships have about a quarter of L_pp, here {0.25 * L_pp:.2g} m, and this one spins"
            )
        return tuple(found)


class Affine(NamedTuple):
    """Thrusters in the form tau = B u - D_loss nu_r (Sawada 2024 Eq. 27).

    Attributes:
        B: three rows, one column an input.
        u: the inputs, such as u_1, u_2 [N] of each azimuth thruster.
        D_loss: three rows [SI]; only the first column, of u_r, differs from zero.
    """

    B: tuple[Scalars, ...]
    u: Scalars
    D_loss: tuple[Row, ...]


@dataclass(frozen=True, kw_only=True)
class Fossen(Composed):
    """A ship by its matrices M, C and D, driven by thrusters, or by a propeller and rudder, or both.

    How many parameters it has (6, 22, 30) follows from the numbers that `inertia` and `damping` are given.
    """

    body: Particulars
    inertia: Inertia
    damping: ForceModule
    propeller: PropellerModule | None = None
    rudder: RudderModule | None = None
    wind: ForceModule | None = None
    waves: ForceModule | None = None
    thrusters: Parts = parts("thruster")

    def __post_init__(self) -> None:
        if self.rudder is not None and self.propeller is None:
            raise ParameterError("a rudder works in the slipstream of a propeller; give [propeller] as well")

    @property
    def conventional(self) -> tuple[tuple[str, str], ...]:
        """n_P [1/s] with a propeller, delta [rad] with a rudder."""
        return super().conventional[: (self.propeller is not None) + (self.rudder is not None)]

    def mass_doubts(self, L_pp: float) -> tuple[str, ...]:
        return self.inertia.doubts(float(self.displaced), L_pp)

    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        around, fixed = Surroundings.of(state, environment), len(self.conventional)
        flow = around.flow(self.body, *control[:fixed])
        force = self.force(flow, control[fixed:])
        return around.rates(self.inertia.acceleration(force, flow.u, flow.v_m, flow.r))

    def answer(self, force: Force, flow: Flow) -> tuple[Scalar, Scalar, Scalar]:
        return self.inertia.acceleration(force, 0.0, 0.0, 0.0)

    def force(self, flow: Flow, control: Scalars = ()) -> Force:
        """Damping and all external forces; `control` holds those of the thrusters."""
        total = self.damping.force(flow)
        if self.propeller is not None:
            pull, slipstream = self.propeller.force(flow)
            total = total + pull if self.rudder is None else total + pull + self.rudder.force(flow, slipstream)
        for module in (self.wind, self.waves):
            total = total if module is None else total + module.force(flow)
        return total + self.thrust(flow, control) if control else total

    def affine(self, flow: Flow, control: Scalars) -> Affine:
        """The thrusters, affine in their inputs (Sawada 2024 Eqs. 26-28), for control design.

        Args:
            flow: what the ship feels; only its velocities matter, and only to side thrusters.
            control: the controls of the thrusters.
        """
        columns, inputs, loss = list[Row](), list[Scalar](), (0.0, 0.0, 0.0)
        for part, own in self.steered(control):
            columns.extend(part.effect)
            inputs.extend(part.inputs(flow, own))
            a, b, c = part.loss(flow, own)
            loss = (loss[0] + a, loss[1] + b, loss[2] + c)
        rows = tuple(tuple(column[i] for column in columns) for i in range(3))
        return Affine(rows, tuple(inputs), tuple((d, 0.0, 0.0) for d in loss))


def _cross(a: Row, b: Row) -> Row:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _dot(a: Row, b: Row) -> Scalar:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
