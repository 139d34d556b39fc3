"""Force modules and combinations that no ship of the library has; plausible numbers of no real ship."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import Any

from ..belief.freer import with_units
from ..core.parameters import Parts, values
from ..forces import thruster, waves, wind_blendermann, wind_isherwood
from ..forces.anchor import DredgedAnchor
from ..forces.azimuth import Azimuth, ThrustAzimuth
from ..forces.bank import Bank
from ..forces.cushion import Cushion
from ..forces.damping import CrossFlowDrag
from ..forces.hull import Polynomial
from ..forces.passing import Passing
from ..forces.propeller import KoseWake
from ..forces.radiation import Lateral, Longitudinal
from ..forces.rudder_linear import Linear
from ..forces.rudder_neutral import OffCentre
from ..forces.shallow import ShallowPolynomial
from ..forces.thruster_fixed import Fixed
from ..forces.thruster_quay import QuayTunnel
from ..forces.tug import LineTug, PushTug
from ..models.fossen import Fossen, Inertia, Particulars
from ..models.harbour import Harbour, Quay
from ..models.mmg_roll import HeelDerivatives, MmgRoll, Roll
from ..models.network import Network, initial
from ..models.neural import Neural
from ..models.unified import Heave, Unified
from ..ships import Ship
from ..ships.files import load

L7: Any = load("kvlcc2_l7")


def numbers(cls: Any, source: Any) -> dict[str, Any]:
    """The numbers of `source` that `cls` has too."""
    known = vars(source)
    return {f.name: known[f.name] for f in fields(cls) if f.name in known}


TUNNEL: dict[str, Any] = {"x": 2.5, "D": 0.06}
JET = thruster.Tunnel(**TUNNEL, K_T=0.3, loss_form="jet", c_Y=4.0, c_N=7.0, to_port=0.9)
DRAG = CrossFlowDrag(X_u=-4.0, X_uu=-20.0, Y_v=-60.0, Y_r=5.0, N_v=-20.0, N_r=-150.0, C_D=0.9)
STERN = {"x": -3.3, "y": 0.3}

MODULES: tuple[Any, ...] = (
    thruster.Tunnel(**TUNNEL, K_T=0.3),
    JET,
    thruster.Tunnel(**TUNNEL, T_0=4.0, n_0=20.0, loss_form="froude", a_Y1=-4.0, a_Y2=5.0, a_N1=-6.0, a_N2=9.0),
    thruster.Direct(),
    Azimuth(**STERN, c_0=0.1, c_1=0.5, c_2=1.2, T_nu=0.9, t=0.1, astern=0.7),
    ThrustAzimuth(**STERN),
    Fixed(**STERN, T_1=2.0, T_2=3.0, astern=0.6),
    DRAG,
    KoseWake(**numbers(KoseWake, L7.model.propeller)),
    Linear(**numbers(Linear, L7.model.rudder)),
    OffCentre(**numbers(OffCentre, L7.model.rudder), delta_0=0.02),
    ShallowPolynomial(**numbers(Polynomial, L7.model.hull), B=1.27, C_b=0.81),
    wind_isherwood.Isherwood(rho_air=1.225, A_T=0.4, A_L=1.0, L_OA=7.3, B=1.27, S=9.0, C=3.8, M=2.0, A_SS=0.3),
    wind_blendermann.Blendermann(
        rho_air=1.225, A_T=0.4, A_L=1.0, L_OA=7.3, s_L=-0.1, **wind_blendermann.blendermann1994("tanker, loaded")
    ),
    waves.MeanDrift(),
    waves.HeadSea(B=1.27, L_BWL=1.0),
    Bank(A_M=0.58, c_bank=1.2, x_bank=-0.2),
    Passing(A_M=0.58, B=1.27),
    Cushion(B=1.27, k_c=0.7),
    QuayTunnel(**TUNNEL, K_T=0.3, B=1.27, k_q=0.4, l_q=2.0),
    QuayTunnel(**TUNNEL, T_0=4.0, n_0=20.0, loss_form="froude", a_Y1=-4.0, a_N1=-6.0, B=1.27, k_q=0.4, l_q=2.0),
    QuayTunnel(**TUNNEL, K_T=0.3, loss_form="jet", c_Y=4.0, c_N=7.0, to_port=0.9, B=1.27, k_q=0.4, l_q=2.0),
    PushTug(x=2.0, y=0.6, f_max=150.0, pulls=0.9),
    LineTug(x=-3.0, y=0.2, f_max=150.0, rise=0.2),
    DredgedAnchor(H=20.0, x=3.2),
)


def _of(name: str) -> Any:
    return next(m for m in MODULES if type(m).__name__ == name)


def _ship(name: str, model: Any) -> Ship:
    return replace(L7, name=name, model=model, n_P=None)


def _network() -> Neural:
    """A network of some weights that answers its rudder; trained on nothing."""
    drawn = initial(Network("forgetting", (12, 8), wind=False, memory=4, scale=(0.5, 0.3, 0.1, 10.0, 0.5)), seed=2)
    return Neural(dt=0.2, network=drawn.having({**drawn.weights, "W_2": 0.05 * drawn.weights["W_2"]}))


def _hybrid() -> Ship:
    """The library's hybrid with a residual, a small network and a drift; some weights, fitted to nothing."""
    bare, _ = with_units(load("esso_osaka_3m_hybrid"), 3, 0)
    drawn = {p: 0.1 * math.sin(k) for k, p in enumerate(values(bare.model)) if p.startswith(("residual_", "unit_out"))}
    return bare.having(drawn | {"drift_along": 0.006, "drift_across": -0.002})


SHIPS: dict[str, Ship] = {
    # physics with all that a fit may add
    "hybrid": _hybrid(),
    # weights on arrays, which no trace can follow
    "network": _ship("network", _network()),
    # the MMG family with all that it can carry
    "dressed": _ship("dressed", replace(
        L7.model, hull=_of("ShallowPolynomial"), propeller=_of("KoseWake"), wind=_of("Isherwood"),
        waves=_of("MeanDrift"), thrusters=Parts(("bow",), (JET,)),
    )),
    # the MMG family with roll, all that it can carry
    "rolling": _ship("rolling", MmgRoll(
        **numbers(MmgRoll, L7.model) | {"wind": _of("Isherwood"), "waves": _of("MeanDrift")},
        roll=Roll(I_x=520.0, J_x=130.0, GM=0.12, BM=0.29, B_1=60.0, B_2=120.0, B_U=30.0, z_H=0.1, z_R=0.2, z_T=0.1,
                  z_W=-0.4, l_x=0.05, l_y=0.1),
        heel=HeelDerivatives(X_vphi=-0.01, X_rphi=0.01, X_phiphi=-0.01, Y_phi=-0.01, Y_vvphi=0.1, Y_vphiphi=0.1,
                             Y_rrphi=0.05, Y_rphiphi=-0.05, N_phi=-0.01, N_vvphi=-0.1, N_vphiphi=-0.1, N_rrphi=-0.05,
                             N_rphiphi=0.05),
    )),
    # the MMG family in six degrees of freedom; memories of one section each, of no real hull
    "unified": _ship("unified", Unified(
        **numbers(MmgRoll, L7.model) | {"wind": _of("Isherwood"), "waves": _of("MeanDrift")},
        roll=Roll(I_x=520.0, J_x=130.0, GM=0.12, BM=0.29, B_1=60.0, B_2=120.0, B_U=30.0, z_H=0.1, z_R=0.2, z_T=0.1,
                  z_W=-0.4, l_x=0.05, l_y=0.1),
        heave=Heave(I_y=9900.0, A_13=5.0, A_15=20.0, A_33=3100.0, A_35=-100.0, A_55=8000.0, A_26=60.0, A_46=-10.0,
                    C_33=76000.0, C_35=-2000.0, C_55=210000.0, B_33=50.0, B_55=100.0),
        longitudinal=Parts(("m1",), (Longitudinal(
            a=0.6, w=3.0, d_11=120.0, d_13=5.0, d_15=-10.0, d_33=9000.0, d_35=200.0, d_55=20000.0),)),
        transverse=Parts(("m1",), (Lateral(
            a=0.7, w=3.5, d_22=4000.0, d_24=-60.0, d_26=90.0, d_44=100.0, d_46=5.0, d_66=6000.0),)),
    )),
    # Fossen's family behind a propeller and a rudder
    "matrices": _ship("matrices", Fossen(
        body=Particulars(rho=1000.0, L_pp=7.0, B=1.27, d=0.46),
        inertia=Inertia(m_11=3330.0, m_22=5800.0, m_33=12000.0, m_23=800.0, m_32=800.0, coriolis="consistent"),
        damping=DRAG, propeller=L7.model.propeller, rudder=_of("Linear"), wind=_of("Blendermann"),
        waves=_of("HeadSea"),
    )),
    # the same family beside a quay without stiffness, which leaves a ship at rest where it is
    "quayside": _ship("quayside", Harbour(
        body=Particulars(rho=1000.0, L_pp=7.0, B=1.27, d=0.46),
        inertia=Inertia(m_11=3330.0, m_22=5800.0, m_33=12000.0, m_23=800.0, m_32=800.0, coriolis="consistent"),
        damping=DRAG, propeller=L7.model.propeller, rudder=_of("Linear"),
        quay=Quay(north=0.0, east=-5.0, direction=0.1, reach=5.0, mu=0.1, flat=2.5, half=0.3),
    )),
}  # fmt: skip
