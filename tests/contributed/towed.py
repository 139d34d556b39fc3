"""Drag of an object that the ship tows."""

import math
from dataclasses import dataclass
from typing import ClassVar

from ..core.parameters import Scalar, spec
from ..core.symbolic import speed
from . import Flow, Force


@dataclass(frozen=True, kw_only=True)
class TowedBody:
    """Drag of a towed array or dinghy, quadratic and against the motion of the point (x, y) that its line is fast to.

    Quasi-steady: the line is as long as it takes for the object to follow the point without delay, and its own drag
    and its angle to the water are part of `C_D`.
    """

    mirror_symmetric: ClassVar[bool] = True
    asymmetries: ClassVar[tuple[str, ...]] = ("y",)

    area: Scalar = spec("m^2", "area of the towed object that C_D refers to", (0.0, math.inf))
    C_D: Scalar = spec("", "drag coefficient of object and line", (0.0, 100.0))
    x: Scalar = spec("m", "towing point ahead of midship")
    y: Scalar = spec("m", "towing point to starboard", default=0.0)

    def force(self, flow: Flow) -> Force:
        """Pull of the line on the ship, and its moment about midship."""
        u, v = flow.u - self.y * flow.r, flow.v_m + self.x * flow.r
        drag = 0.5 * flow.rho * self.C_D * self.area * speed(u, v)
        X, Y = -drag * u, -drag * v
        return Force(X, Y, self.x * Y - self.y * X)


EXAMPLES = (TowedBody(area=0.01, C_D=1.0, x=-3.5), TowedBody(area=0.01, C_D=1.0, x=-3.3, y=0.4))
