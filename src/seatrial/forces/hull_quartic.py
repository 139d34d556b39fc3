"""Hull forces of the standard MMG model with a fourth-order surge term of drift and yaw rate."""

from __future__ import annotations

from ..core.parameters import Scalar, spec
from ..core.symbolic import speed
from ..core.values import dataclass
from . import Flow, Force
from .hull import Polynomial


@dataclass(frozen=True, kw_only=True)
class QuarticSurge(Polynomial):
    """`hull:Polynomial` with X_vvvr' v'^3 r' besides (Okuda et al. 2023; Suyama 2023 Eq. 15)."""

    X_vvvr: Scalar = spec("'", "surge force by v'^3 r'")

    def force(self, flow: Flow) -> Force:
        U, v, r = speed(flow.u, flow.v_m), flow.v_m, flow.r * flow.L_pp
        area = 0.5 * flow.rho * flow.L_pp * flow.d
        return super().force(flow) + Force(area * self.X_vvvr * (v * v / U) * (v * r / U), 0.0, 0.0)
