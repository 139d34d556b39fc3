"""Heel in a turn and in a zigzag, for runs that hold phi; as recorded, a list of the ship included.

A rudder below the centre of gravity first heels the ship into the turn; then, with the turning, it heels outwards.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..data import Array, Trial
from . import Index


def in_turn(run: Trial, side: float, last: NDArray[np.bool_] | None) -> dict[str, Index]:
    """Greatest heel into the turn before it goes outwards, and out of it, with their times, and the steady heel.

    Args:
        run: from the execute on.
        side: of the turn, +1 to starboard.
        last: rows of the steady part; None where the run has none.

    Returns:
        `inward_heel`, `outward_heel`, `steady_heel` (outward positive) [rad], times since the execute [s].
    """
    outward = _known(run)
    if outward is None:
        return {}
    outward = -side * outward
    t = run.t - run.t[0]
    peak = int(np.nanargmax(outward))
    before = int(np.nanargmin(outward[: peak + 1]))
    out = {"outward_heel": Index(max(float(outward[peak]), 0.0), "rad"),
           "outward_heel_time": Index(float(t[peak]), "s")}  # fmt: skip
    if outward[before] < 0.0:
        out |= {"inward_heel": Index(-float(outward[before]), "rad"), "inward_heel_time": Index(float(t[before]), "s")}
    if last is not None and np.isfinite(outward[last]).any():
        out["steady_heel"] = Index(float(np.nanmean(outward[last])), "rad")
    return out


def either_way(run: Trial) -> dict[str, Index]:
    """Greatest heel to starboard and to port since the execute [rad], both positive."""
    phi = _known(run)
    if phi is None:
        return {}
    return {
        "heel_to_starboard": Index(max(float(np.nanmax(phi)), 0.0), "rad"),
        "heel_to_port": Index(max(-float(np.nanmin(phi)), 0.0), "rad"),
    }


def _known(run: Trial) -> Array | None:
    """The heel [rad]; None where the run has no value of it."""
    return run["phi"] if "phi" in run and np.isfinite(run["phi"]).any() else None
