"""Rudder of the standard MMG model whose side inflow is a velocity, not an angle times a speed."""

from __future__ import annotations

from ..core.parameters import Scalar, spec
from ..core.symbolic import atan2, magnitude, where
from ..core.values import dataclass
from . import Flow, Slipstream
from .rudder import Standard


@dataclass(frozen=True, kw_only=True)
class SwayInflow(Standard):
    """Rudder of the KCS set of Yoshimura, Ueno and Tsukada (2008): v_R = -gamma_R (v_m + l_R r).

    Everything else is `rudder:Standard`.  Which gamma_R acts follows from the drift angle at the
    propeller, b - x_P' r L_pp/U_ref, so v_R jumps where that changes sign; astern the angle is counted
    from the stern.
    """

    x_S: Scalar = spec("m", "position whose drift angle picks gamma_R, ahead of midship")
    U_ref: Scalar = spec("m/s", "speed that makes the yaw rate non-dimensional there", (1e-3, 100.0))

    def _inflow(self, flow: Flow, slipstream: Slipstream) -> tuple[Scalar, Scalar]:
        u_R, _ = super()._inflow(flow, slipstream)
        drift = atan2(-flow.v_m, magnitude(flow.u)) - self.x_S * flow.r / self.U_ref
        gamma_R = where(drift > 0, self.gamma_Rp, self.gamma_Rn)
        return u_R, -gamma_R * (flow.v_m + self.l_R * flow.r)
