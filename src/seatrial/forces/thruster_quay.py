"""A side thruster whose jet strikes a closed quay: part of the thrust comes back on the hull.

T (1 - k_q exp(-c/l_q)) with c the gap to the quay, for the jet that goes towards it only.  The form is an assumption
and no table of it was found; ten to sixty percent are quoted for leaving a closed quay (from memory).  k_q is 0 by
default.
"""

from __future__ import annotations

from ..core.parameters import Scalar, Scalars, spec
from ..core.symbolic import exp, where
from ..core.values import dataclass
from . import Flow
from .cushion import quay_gap
from .thruster import Tunnel


@dataclass(frozen=True, kw_only=True)
class QuayTunnel(Tunnel):
    """A tunnel thruster that loses thrust against a quay."""

    B: Scalar = spec("m", "breadth of the ship", (1e-3, 1e3))
    k_q: Scalar = spec("", "thrust lost at the quay; no published value, 0 is off", (0.0, 1.0), default=0.0)
    l_q: Scalar = spec("m", "gap over which the loss falls to 1/e", (1e-3, 1e3), default=10.0)

    def inputs(self, flow: Flow, control: Scalars) -> Scalars:
        c, side = quay_gap(flow, self.B)
        strikes = where(control[0] * side < 0.0, side * side, 0.0)  # a thrust away from the quay blows towards it
        left = 1.0 - self.k_q * strikes * exp(-c / self.l_q)
        return tuple(left * one for one in super().inputs(flow, control))
