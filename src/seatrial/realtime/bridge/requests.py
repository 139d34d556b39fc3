"""What somebody on the bridge asks for, as it came off the wire."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from ...core.errors import RefusalError as RefusalError

Request = Mapping[str, Any]
"""What is asked ("do") and its figures by name."""


def number(said: Request, name: str) -> float:
    """A figure of a request.

    Raises:
        RefusalError: it is not there, or no finite number.
    """
    value = said.get(name)
    if not isinstance(value, bool) and isinstance(value, int | float):
        with suppress(OverflowError):  # a whole number of hundreds of digits
            if math.isfinite(value):
                return float(value)
    raise RefusalError(f"{name} is to be a finite number")
