"""Trials from trials: cut, segments, resample, gaps, split, axes, scale.

`steps` has corrections as values, which a file can hold; `smooth` has the Kalman smoother.

Contract: each function takes a `Trial` (or its arrays) and returns a new one that notes the step in its processing.
A gap is filled only by the function that is named for it.
"""

from .axes import froude_scaled, integral, to_body, to_earth, true_wind
from .cutting import BREAK, complete, cut, drop_trailing_gaps, segments, split, unbroken, without
from .made import derived, marked, measured, unsaid
from .steps import Remedy, Step, derivable, mended, read_steps, steps_text
from .timing import (
    ANGLES,
    at_one_rate,
    between_readings,
    interpolate_gaps,
    nearest_rows,
    resample,
    resampling,
    shifted,
    turns,
)

__all__ = [
    "ANGLES", "BREAK", "Remedy", "Step", "at_one_rate", "between_readings", "complete", "cut", "derivable", "derived",
    "drop_trailing_gaps", "froude_scaled", "integral", "interpolate_gaps", "marked", "measured", "mended",
    "nearest_rows", "read_steps", "resample", "resampling", "segments", "shifted", "split", "steps_text", "to_body",
    "to_earth", "true_wind", "turns", "unbroken", "unsaid", "without",
]  # fmt: skip
