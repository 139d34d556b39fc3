"""seatrial: from the logs of a ship's trials to a model you can trust, and a simulator you can drive."""

from __future__ import annotations

__version__ = "0.1.0"
