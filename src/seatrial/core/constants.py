"""Units at sea and gravity, each defined once.

Published models and formulas that were printed with another gravity keep theirs beside them, with the reason.
"""

from __future__ import annotations

from typing import Final

MILE: Final = 1852.0
"""International nautical mile [m], exact by definition (1929)."""
KNOT: Final = MILE / 3600.0
"""[m/s]."""
ARC_DEGREE: Final = 60.0 * MILE
"""A degree of latitude where a metre or two do not matter [m]: a mile was meant as a minute of it."""
GRAVITY: Final = 9.80665
"""Standard gravity [m/s^2] (CGPM 1901); over the seas it is 9.780 to 9.832."""
