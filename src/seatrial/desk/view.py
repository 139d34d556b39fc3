"""What the page draws of a trial: a thinned track and its channels, and the steps that cut it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import RequestError
from ..core.files import write_whole
from ..data import UNITS, Array
from ..data.prepare.steps import Step, steps_text
from ..data.trialfile import read_trial
from ..models import unit

_ROWS = 3000
"""Rows that are drawn; more than a screen has columns."""
_GAP = 2.5
"""Usual steps between the readings of an instrument from which on there is a gap."""
_DEGREES = {"rad": ("°", 180.0 / np.pi), "rad/s": ("°/s", 180.0 / np.pi)}


def drawn(path: Path) -> dict[str, Any]:
    """A trial for the page: time [s], each channel with its unit there (degrees for rad), null for a gap.

    Raises:
        DataError: it cannot be read.
    """
    trial = read_trial(path)
    every = max(1, -(-len(trial) // _ROWS))
    channels = [_channel(name, _between(name, np.asarray(trial[name]))[::every]) for name in trial.channels]
    return {"name": trial.name, "t": trial.t[::every].tolist(), "rows": len(trial), "channels": channels}


def _between(name: str, values: Array) -> Array:
    """A channel on all rows: one of an instrument slower than the rows on lines between its readings, gaps as gaps."""
    known = np.flatnonzero(np.isfinite(values))
    if known.size < 2:
        return values
    rows, steps = np.arange(values.size), np.diff(known)
    after = np.clip(np.searchsorted(known, rows), 1, known.size - 1)
    near = (steps <= _GAP * np.median(steps))[after - 1] & (rows >= known[0]) & (rows <= known[-1])
    lines = values[known[after - 1]] if name.startswith("gamma") else np.interp(rows, known, values[known])
    return np.where(np.isfinite(values), values, np.where(near, lines, np.nan))


def _channel(name: str, values: Array) -> dict[str, Any]:
    own = UNITS.get(name) or unit(name)
    shown, factor = _DEGREES.get(own, (own, 1.0))
    scaled = np.where(np.isfinite(values), values * factor, np.nan)
    return {"name": name, "unit": shown, "values": [None if value != value else value for value in scaled.tolist()]}


def cut(path: Path, trial: str, stretches: Sequence[tuple[float, float]]) -> None:
    """Write a file of steps that cut stretches of time, each from its first to its last second, out of a trial.

    Raises:
        RequestError: no stretch, or one that ends before it begins.
    """
    if not stretches:
        raise RequestError("no stretch of time is chosen: drag over a trace, or write the times")
    for first, last in stretches:
        if not first < last:
            raise RequestError(f"a stretch from {first:g} to {last:g} s ends before it begins")
    step = Step(do="cut", where=tuple(sorted(stretches)), trials=(trial,))
    write_whole(path, steps_text([(f"cut out of {trial}", (step,))]))
