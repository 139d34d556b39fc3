"""Drag of a body on a line, such as a dinghy or an array, where the line is made fast."""

import math
from dataclasses import dataclass
from typing import ClassVar

from ..core.parameters import Scalar, spec
from ..core.symbolic import speed
from . import Flow, Force


@dataclass(frozen=True, kw_only=True)
class Towed:
    """Quadratic drag against the motion of the towing point through the water; the line is short and always taut."""

    mirror_symmetric: ClassVar[bool] = True

    drag: Scalar = spec("kg/m", "drag of the body over the square of its speed", (0.0, math.inf))
    x: Scalar = spec("m", "towing point, positive forward of midship")
    y: Scalar = spec("m", "towing point, positive to starboard", default=0.0)

    def force(self, flow: Flow) -> Force:
        """Force of the line on the ship."""
        u = flow.u - flow.r * self.y
        v = flow.v_m + flow.r * self.x
        pull = self.drag * speed(u, v)
        X, Y = -pull * u, -pull * v
        return Force(X, Y, self.x * Y - self.y * X)


EXAMPLES = (Towed(drag=3.0, x=-3.4), Towed(drag=3.0, x=-3.0, y=0.4))
