"""How unlike the trials of a fit a run has been so far: the mean distance of motions, controls and wind from theirs.

A model errs more where its trials have not been.  By how much, trials of other days say (`calibration.best_power`): on
trials like those of the fit the distance tells little, on those of an unseen day or kind the greater part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...data import Array, DataError, Trial
from ...models import STATES
from ...ships import Ship
from ...simulate.loop import open_loop
from ..coverage import WIND, Reference, usual
from .sailing import FreeRuns

# Points that a reference keeps: its file is read at every prediction with bands.
_POINTS = 2000
_DIGITS = 3


def reference_of(trials: Sequence[Trial]) -> Reference | None:
    """Motions, controls and apparent wind of some trials without their past, thinned; None where they tell none.

    Means over the past tell a kind of manoeuvre and not its error: on kinds left out whole novelty with them has a rank
    correlation of .0 with the error, without them of .3.
    """
    try:
        found = Reference.of(trials, usual(trials))
    except DataError:  # none in common, or one that never changes and too few samples
        return None
    points = found.points[:: -(-len(found.points) // _POINTS)]
    return replace(found, points=points.round(_DIGITS))


def acting(ship: Ship, states: Array, lanes: FreeRuns) -> dict[str, Array]:
    """Channels of free runs: states, controls and the true wind, each of shape (lanes, rows).

    Args:
        states: shape (lanes, rows, 6 or more), rows as of `lanes.t`.
    """
    names = open_loop(ship).series
    series = lanes.series[:, :: lanes.every][:, : states.shape[1]]
    return {**dict(zip(STATES, np.moveaxis(states[:, :, : len(STATES)], 2, 0), strict=True)),
            **dict(zip(names, np.moveaxis(series, 2, 0), strict=True))}  # fmt: skip


def so_far(reference: Reference, run: Mapping[str, Array], t: Array) -> Array:
    """Mean novelty from the start to each row, shape (lanes, rows); 1, the edge of the trials, where it is unknown.

    Args:
        run: channels of shape (lanes, rows): psi, the reference's own, and for the apparent wind wind_x and wind_y,
            where the true wind comes from, north and east [m/s].
        t: times of the rows [s].
    """
    known = dict(run)
    if set(WIND) <= set(reference.channels) and {"wind_x", "wind_y"} <= set(known):
        cos, sin = np.cos(known["psi"]), np.sin(known["psi"])
        ahead = known["wind_x"] * cos + known["wind_y"] * sin + known["u"]
        known |= dict(zip(WIND, (ahead, known["wind_y"] * cos - known["wind_x"] * sin + known["v_m"]), strict=True))
    shape = known["u"].shape
    if not set(reference.channels) <= set(known):
        return np.ones(shape)
    rows = np.stack([known[name] for name in reference.channels], axis=-1).reshape(-1, len(reference.channels))
    good = np.isfinite(rows).all(axis=1)
    at = np.ones(len(rows))
    at[good] = reference.novelty(rows[good])
    at = at.reshape(shape)
    gathered = np.cumsum(0.5 * (at[:, 1:] + at[:, :-1]) * np.diff(t), axis=1)
    return np.concatenate([at[:, :1], gathered / (t[1:] - t[0])], axis=1)
