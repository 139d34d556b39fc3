"""Hull forces and added mass in shallow water: published factors on the numbers of deep water.

The factors are functions of d/h, draught over depth, and are one exactly in deep water.  Range: h/d
from 1.2 on; in still shallower water the factors of h/d = 1.2 hold (`SHALLOWEST`), since those of both
methods grow without bound as the keel nears the bottom.  Banks and the wave system near the
critical depth Froude number are not in the factors; nor are wake, thrust deduction and flow straightening.
"""

from __future__ import annotations

from typing import NamedTuple

from ..core.parameters import Scalar, choice, spec
from ..core.symbolic import clip, exp, log, smaller
from ..core.values import dataclass, replace
from . import Flow, Force, ForceModule
from .body import Body
from .cushion import Cushion
from .hull import Polynomial
from .squat import Hull, sunk

SHALLOWEST = 1.2
"""Depth over draught below which the factors stay as they are there."""


class Factors(NamedTuple):
    """Shallow over deep of the hull's numbers; one in deep water.

    Attributes:
        Y_v, Y_r, N_v, N_r: linear derivatives.
        drift: terms of second and higher order in the drift (X_vv, Y_vvv, Y_vvr, N_vvr, ...).
        turn: terms of third order in the yaw rate (Y_rrr, N_rrr).
        m_y, J_z: added mass in sway and added moment of inertia.
    """

    Y_v: Scalar
    Y_r: Scalar
    N_v: Scalar
    N_r: Scalar
    drift: Scalar
    turn: Scalar
    m_y: Scalar
    J_z: Scalar


def ankudinov1990(d_over_h: Scalar, L: Scalar, B: Scalar, d: Scalar, C_b: Scalar) -> Factors:
    """Factors in K_0, K_1, K_2 of F = h/d - 1, ascribed to Ankudinov et al. (1990) and Clarke.

    Constants as coded in mmgdynamics 1.0.8, which cites Taimuri et al. (2020); no paper was at hand.
    Another public code (ASVSim) has other constants under Clarke's name.

    Args:
        d_over_h: draught over depth of the water, held within [0, 1/1.2].
        L, B, d: length between perpendiculars, breadth and draught [m].
        C_b: block coefficient.
    """
    s = clip(d_over_h, 0.0, 1.0 / SHALLOWEST)
    q = s / (1.0 - s)  # 1/F with F = h/d - 1
    q_2 = q * q
    slender = 1.0 + B / L
    b = C_b * B / d * slender * slender  # B_1/d with B_1 = C_b B (1 + B/L)^2
    K_0 = 1.0 + q_2 * (0.0775 + q * (-0.0110 + 0.000068 * q_2))
    K_1 = b * q * (-0.0643 + q * (0.0724 + q * (-0.0113 + 0.0000767 * q_2)))
    # 0.0342/F up to B/d = 4, beyond it 0.137 (d/B)/F.  The code has B/d there; only d/B joins the branches.
    K_2 = b * b * q * smaller(0.0342, 0.137 * d / B)
    f_Nr = K_0 + K_1 / 2.0 + K_2 / 3.0
    f_Yv = 1.5 * f_Nr - 0.5
    g_Nr = K_0 + 8.0 / 15.0 * K_1 + 40.0 / 105.0 * K_2
    return Factors(
        Y_v=f_Yv,
        Y_r=K_0 + 2.0 / 5.0 * K_1 + 24.0 / 105.0 * K_2,
        N_v=K_0 + K_1 + K_2,
        N_r=f_Nr,
        drift=f_Yv,
        turn=g_Nr,
        m_y=K_0 + 2.0 / 3.0 * K_1 + 8.0 / 15.0 * K_2,
        J_z=g_Nr,
    )


def kijima1990(d_over_h: Scalar, L: Scalar, B: Scalar, d: Scalar, C_b: Scalar) -> Factors:
    """Linear derivatives ascribed to Kijima et al. (1990), the rest by `ankudinov1990`.

    As coded twice by one author, citing Maimun et al. (2011) and Taimuri et al. (2020).

    (1 - d/h)^-n - d/h for Y_v, N_v and N_r, a cubic in d/h for Y_r, which for fine ships swings by half
    below h/d = 1.5.  Arguments as there.
    """
    s = clip(d_over_h, 0.0, 1.0 / SHALLOWEST)
    fullness, k = C_b * B / d, 2.0 * d / L

    def power(n: Scalar) -> Scalar:
        return exp(-n * log(1.0 - s)) - s

    a_1 = (-5.5 * fullness + 26.0) * fullness - 31.5
    a_2 = (37.0 * fullness - 185.0) * fullness + 230.0
    a_3 = (-38.0 * fullness + 197.0) * fullness - 250.0
    return ankudinov1990(d_over_h, L, B, d, C_b)._replace(
        Y_v=power(0.40 * fullness),
        Y_r=1.0 + s * (a_1 + s * (a_2 + s * a_3)),
        N_v=power(0.425 * fullness),
        N_r=power(1.5 - 7.14 * k),
    )


@dataclass(frozen=True, kw_only=True)
class ShallowPolynomial(Polynomial):
    """`Polynomial` with its numbers for deep water and published factors for the depth that the ship meets.

    R_0 grows by 1 + 0.388 (d/h)^2 (Furukawa et al. 2016 as coded in mmgdynamics), the drift and turn
    terms by the factors of `ankudinov1990`, the linear derivatives by either form.  The two forms differ:
    run both, and take the spread for what is not known.
    """

    B: Scalar = spec("m", "breadth", (1e-3, 1e3))
    C_b: Scalar = spec("", "block coefficient", (0.1, 1.0))
    squat: str = choice("squat that takes water from under the keel", ("none", "icorels", "barrass2004"), "none")
    form: str = choice("factors of the linear derivatives", ("ankudinov1990", "kijima1990"), "ankudinov1990")

    def factors(self, flow: Flow) -> Factors:
        """Factors at the depth of the flow, less the mean sinkage."""
        form = kijima1990 if self.form == "kijima1990" else ankudinov1990
        return form(self.shallow(flow), flow.L_pp, self.B, flow.d, self.C_b)

    def shallow(self, flow: Flow) -> Scalar:
        """Draught over depth under way, with the squat of the ship's choice."""
        hull = Hull(flow.L_pp, self.B, flow.d, self.C_b)
        return flow.d_over_h if self.squat == "none" else sunk(flow.u, flow.d_over_h, hull, self.squat)

    def force(self, flow: Flow) -> Force:
        k = self.factors(flow)
        s = clip(self.shallow(flow), 0.0, 1.0 / SHALLOWEST)
        here = Polynomial(
            R_0=self.R_0 * (1.0 + 0.388 * s * s), X_vv=self.X_vv * k.drift, X_vr=self.X_vr * k.Y_r,
            X_rr=self.X_rr * k.N_r, X_vvvv=self.X_vvvv * k.drift,
            Y_v=self.Y_v * k.Y_v, Y_r=self.Y_r * k.Y_r, Y_vvv=self.Y_vvv * k.drift,
            Y_vvr=self.Y_vvr * k.drift, Y_vrr=self.Y_vrr * k.drift, Y_rrr=self.Y_rrr * k.turn,
            N_v=self.N_v * k.N_v, N_r=self.N_r * k.N_r, N_vvv=self.N_vvv * k.drift,
            N_vvr=self.N_vvr * k.drift, N_vrr=self.N_vrr * k.drift, N_rrr=self.N_rrr * k.turn,
        )  # fmt: skip
        return here.force(flow)


def afloat(body: Body, hull: ForceModule, flow: Flow, extras: tuple[ForceModule, ...] = ()) -> Body:
    """`body` with the added mass of the water it floats in; as it is where neither hull nor a cushion knows it.

    Only m_y and J_z change: no published factor of m_x could be checked, and it is small.
    """
    if isinstance(hull, ShallowPolynomial):
        k = hull.factors(flow)
        body = replace(body, m_y=body.m_y * k.m_y, J_z=body.J_z * k.J_z)
    for module in extras:
        if isinstance(module, Cushion):
            body = replace(body, m_y=body.m_y + module.added(flow, body.m_y))
    return body
