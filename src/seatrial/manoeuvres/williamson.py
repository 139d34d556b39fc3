"""The Williamson turn: back on the own track by a swing to one side and a turn to the other.

Rudder hard over; after 60 deg hard over to the other side; 20 deg short of the reciprocal course
midships; then the ship is steered on that course (IAMSAR Manual volume III).
"""

from __future__ import annotations

import math
from typing import ClassVar

from ..core.values import dataclass
from .recovery import Recovery


@dataclass(frozen=True)
class Williamson(Recovery):
    """A swing of 60 deg to `side`, then round the other way to the reciprocal course."""

    kind: ClassVar[str] = "williamson"
    goal: ClassVar[float] = -math.pi
    usual_swing: ClassVar[float] = math.radians(60.0)
