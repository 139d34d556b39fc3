"""The water between a ship and a closed quay: what must flow out round its ends and under its keel before it.

A derivation, untested and without losses, so an upper bound and off by default (k_c = 0).  For a gap b the water that
leaves at the ends has m_e = rho h L^3/(12 b), that under the keel m_k = rho B L h^2/(h - d), both ways together m_b =
m_e m_k/(m_e + m_k).  It holds water that m_y already counts: the larger of the two acts.  The gap changes its mass, so
besides its inertia there is a force of half v^2 times the change per metre, away from the quay either way.
"""

from __future__ import annotations

from ..core.parameters import Scalar, spec
from ..core.symbolic import clip, larger, root, where
from ..core.values import dataclass
from . import Flow, Force, ForceModule

# A quay farther off than a million metres is none [1/m]; nearer than this the ship touches it [m]; the keel touches
# ground at this depth over draught.
_NONE, _NEAREST, _AGROUND = 1e-6, 0.5, 1.02


def quay_gap(flow: Flow, B: Scalar) -> tuple[Scalar, Scalar]:
    """Gap between side and quay [m], and the share of the way to it that is to starboard, -1 to 1; 0 without a quay."""
    toward = root(flow.quay_u * flow.quay_u + flow.quay_v * flow.quay_v)
    there = toward > _NONE
    safe = where(there, toward, 1.0)
    return larger(where(there, 1.0 / safe, 1e6) - 0.5 * B, _NEAREST), where(there, flow.quay_v / safe, 0.0)


@dataclass(frozen=True, kw_only=True)
class Cushion(ForceModule):
    """Added mass in sway, and the force that goes with its change, beside a closed quay in shallow water."""

    B: Scalar = spec("m", "breadth", (1e-3, 1e3))
    k_c: Scalar = spec("", "share of the water that has no other way; no published value, 0 is off", (0.0, 1.0),
                       default=0.0)  # fmt: skip

    def mass(self, flow: Flow) -> tuple[Scalar, Scalar]:
        """m_b [kg] abreast of a quay, and how much it grows per metre that the gap closes [kg/m]."""
        b, _ = quay_gap(flow, self.B)
        over = clip(flow.d_over_h, 0.05, 1.0 / _AGROUND)
        h = flow.d / over
        c = flow.rho * h * flow.L_pp * flow.L_pp * flow.L_pp / 12.0
        m_k = flow.rho * self.B * flow.L_pp * h * h / (h - flow.d)
        m_b = c * m_k / (c + m_k * b)
        return m_b, m_b * m_b / c

    def _here(self, flow: Flow) -> Scalar:
        """How far the ship lies along a closed quay in shallow water."""
        _, side = quay_gap(flow, self.B)
        return self.k_c * side * side * where(flow.d_over_h > 0.05, 1.0, 0.0)

    def added(self, flow: Flow, m_y: Scalar) -> Scalar:
        """Added mass in sway beyond `m_y` [kg]."""
        return self._here(flow) * larger(self.mass(flow)[0] - m_y, 0.0)

    def force(self, flow: Flow) -> Force:
        _, side = quay_gap(flow, self.B)
        growth = self.mass(flow)[1]
        return Force(0.0, -0.5 * self._here(flow) * growth * flow.v_m * flow.v_m * where(side < 0.0, -1.0, 1.0), 0.0)
