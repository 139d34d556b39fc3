"""Anchors: what one holds, and one that is dragged along the bottom on a short scope as a brake.

H_M = H_R (m_A/4536 kg)^b.  The form is published; H_R and b of stockless anchors, and the force of one that is
dredged, are from memory: a ship file states its own.  Catenary and chain friction are not here; a ship that rides to
an anchor is one on a line (`contact.Line`) with the holding power as the setting of its winch.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from ..core.parameters import Scalar, spec
from ..core.symbolic import larger, root
from ..core.values import dataclass
from . import Flow, Force, ForceModule

STOCKLESS: Mapping[tuple[str, str], tuple[float, float]] = MappingProxyType({
    ("mud", "movable"): (107e3, 0.92), ("mud", "fixed"): (205e3, 0.92),
    ("sand", "movable"): (196e3, 0.80), ("sand", "fixed"): (311e3, 0.80),
})  # fmt: skip
"""H_R [N] and b by soil and fluke, from memory of UFC 4-159-03 table 5-3."""

# 10 000 lb, to which the holding powers of the table refer [kg].
_REFERENCE = 4536.0
# Slower than this the drag of an anchor fades out [m/s].
_CREEP = 0.05


def holding(mass: float, soil: str = "sand", fluke: str = "movable") -> float:
    """Holding power of a stockless anchor of that mass [kg], the pull horizontal [N]."""
    H_R, b = STOCKLESS[soil, fluke]
    return H_R * (mass / _REFERENCE) ** b


@dataclass(frozen=True, kw_only=True)
class DredgedAnchor(ForceModule):
    """An anchor under foot: a constant force against the motion of its hawse; in still water, as it sees no ground.

    Usually one to two times the weight of the anchor (from memory).
    """

    H: Scalar = spec("N", "force of the dragged anchor; 0 when it is up", (0.0, 1e8), default=0.0)
    x: Scalar = spec("m", "hawse ahead of midship")

    def force(self, flow: Flow) -> Force:
        v = flow.v_m + self.x * flow.r
        share = self.H / root(larger(flow.u * flow.u + v * v + _CREEP * _CREEP, _CREEP * _CREEP))
        return Force(-share * flow.u, -share * v, -self.x * share * v)
