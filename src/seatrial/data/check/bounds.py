"""Bounds of physics: speeds, rates of turn and accelerations that no ship of the length has.

They scale by Froude: U/sqrt(g L), r sqrt(L/g) and accelerations over g are the same for a ship and its model.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from .. import Trial
from .relations import G, length_of
from .sensors import Fault

# Controls of thrusters that can turn a ship at rest, and the fastest such turn, r sqrt(L/g).
_ON_THE_SPOT, _SPINS = ("alpha", "n_bow", "n_stern", "f_"), 0.8
# Froude number of displacement ships, and of craft that plane; those are small [m], and turn by this r L/u at least.
_FAST, _PLANING, _SMALL, _STEERED = 0.6, 2.5, 30.0, 0.15
# Sideways acceleration of the bow, r^2 L/2, and that of the ship, over g: no thruster lifts the ship that it drives.
_WHIRLS, _LEAPS = 1.0, 1.0
# Length of a ship of which none is known, the shortest one [m].
_SHORTEST = 1.0


def scale_faults(trial: Trial) -> Iterator[Fault]:
    """Speed and yaw rate against the length: a model's log with a ship's length, or the reverse.

    Where thrusters turn a ship at rest its way says nothing of its rate of turn; Froude's law does.
    """
    length = length_of(trial)
    if length is None or "u" not in trial:
        return
    u = np.abs(trial["u"])
    speed = float(np.nanquantile(u, 0.95)) if np.isfinite(u).any() else 0.0
    froude = speed / math.sqrt(G * length)
    if froude > 0.6:
        yield Fault(
            "error", "u", "wrong scale or unit: too fast for its length",
            f"Froude number {froude:.2f} at {speed:.3g} m/s and L_pp {length:g} m",
            "check L_pp and scale in the sidecar and the unit of the speed", "scale", "length",
        )  # fmt: skip
    if "r" not in trial or speed <= 0:
        return
    fast = u > 0.5 * speed
    turn = np.abs(trial["r"][fast]) * length / u[fast]
    sharp = float(np.nanquantile(turn, 0.95)) if np.isfinite(turn).any() else 0.0
    spot = any(name.startswith(_ON_THE_SPOT) for name in trial.channels)
    spins = float(np.nanquantile(np.abs(trial["r"]), 0.95)) * math.sqrt(length / G) if sharp > 3.0 else 0.0
    if sharp > 3.0 and not (spot and spins < _SPINS):
        yield Fault(
            "warning" if spot else "error", "r", "wrong scale or unit: turns too sharply for its length",
            f"r L/u is {sharp:.2g} in the fastest rows (ships stay below about 1.5), L_pp {length:g} m",
            "check L_pp and scale in the sidecar and the unit of r", "scale", "length",
        )  # fmt: skip
