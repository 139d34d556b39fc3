"""Rudder of the standard MMG model on a ship that does not go straight with it midships."""

from __future__ import annotations

from typing import ClassVar

from ..core.parameters import Scalar, spec
from ..core.values import dataclass
from . import Flow, Force, Slipstream
from .rudder import Standard


@dataclass(frozen=True, kw_only=True)
class OffCentre(Standard):
    """`rudder:Standard` whose angle counts from `delta_0`: with the rudder at -delta_0 it feels no side force.

    Behind one propeller the stream reaches the rudder at an angle, port and starboard of it not alike, and
    a rudder may be rigged a little off.  The MMG papers leave this out: gamma_R and C_2 differ by side, which
    grows with drift and yaw, while the sides do not differ on a straight course.  Near the straight
    course of an unstable ship a degree determines to which side it goes.
    """

    mirror_symmetric: ClassVar[bool] = False
    asymmetries: ClassVar[tuple[str, ...]] = ("delta_0",)

    delta_0: Scalar = spec("rad", "rudder angle added to the one measured", (-0.2, 0.2))

    def force(self, flow: Flow, slipstream: Slipstream) -> Force:
        return super().force(flow._replace(delta=flow.delta + self.delta_0), slipstream)
