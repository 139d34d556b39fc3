"""Bounds of physics: speeds, rates of turn and accelerations that no ship of the length has.

They scale by Froude: U/sqrt(g L), r sqrt(L/g) and accelerations over g are the same for a ship and its model.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ...core.constants import GRAVITY
from .. import Trial
from .relations import length_of
from .sensors import Fault, gaps_of

# Controls of thrusters that can turn a ship at rest, and the fastest such turn, r sqrt(L/g).
_ON_THE_SPOT, _SPINS = ("alpha", "n_bow", "n_stern", "f_"), 0.8
# Froude number of displacement ships, and of craft that plane, which are small [m] and turn in few lengths (r L/u).
_FAST, _PLANING, _SMALL, _STEERED = 0.6, 2.5, 10.0, 0.1
# Sideways acceleration of the bow, r^2 L/2, over g: no rudder or thruster lifts the ship; and the shortest ship [m].
_WHIRLS, _SHORTEST = 1.0, 1.0


def whirl_faults(trial: Trial) -> Iterator[Fault]:
    """Rates of turn that would throw the bow aside by more than its weight."""
    if "r" not in trial:
        return
    length = length_of(trial) or _SHORTEST
    thrown = 0.5 * trial["r"] ** 2 * length / GRAVITY
    rows = thrown > _WHIRLS
    if rows.any():
        most = float(np.nanmax(np.abs(trial["r"])))
        yield Fault(
            "error", "r", "turns as no ship can", f"{int(rows.sum())} rows, up to {most:.3g} rad/s: the bow would be "
            f"thrown aside by {float(np.nanmax(thrown)):.3g} g at a length of {length:g} m",
            gaps_of(trial, rows, "r") if rows.mean() < 0.1 else "check the unit of r, and the clock", "scale", "length",
        )  # fmt: skip


def scale_faults(trial: Trial) -> Iterator[Fault]:
    """Speed and yaw rate against the length: a model's log with a ship's length, or the reverse.

    Where thrusters turn a ship at rest its way says nothing of its rate of turn; Froude's law does.
    """
    length = length_of(trial)
    if length is None or "u" not in trial:
        return
    u = np.abs(trial["u"])
    speed = float(np.nanquantile(u, 0.95)) if np.isfinite(u).any() else 0.0
    froude = speed / math.sqrt(GRAVITY * length)
    if froude > _FAST:
        planes = length < _SMALL and froude < _PLANING and not _turns_wide(trial, length, 0.5 * speed)
        yield Fault(
            "warning" if planes else "error", "u",
            f"wrong scale or unit: too fast for its length{', unless it planes' * planes}",
            f"Froude number {froude:.2f} at {speed:.3g} m/s and L_pp {length:g} m",
            "check L_pp and scale in the sidecar and the unit of the speed", "scale", "length",
        )  # fmt: skip
    if "r" not in trial or speed <= 0:
        return
    fast = u > 0.5 * speed
    turn = np.abs(trial["r"][fast]) * length / u[fast]
    sharp = float(np.nanquantile(turn, 0.95)) if np.isfinite(turn).any() else 0.0
    spot = any(name.startswith(_ON_THE_SPOT) for name in trial.channels)
    spins = float(np.nanquantile(np.abs(trial["r"]), 0.95)) * math.sqrt(length / GRAVITY) if sharp > 3.0 else 0.0
    if sharp > 3.0 and not (spot and spins < _SPINS):
        yield Fault(
            "warning" if spot else "error", "r", "wrong scale or unit: turns too sharply for its length",
            f"r L/u is {sharp:.2g} in the fastest rows (ships stay below about 1.5), L_pp {length:g} m",
            "check L_pp and scale in the sidecar and the unit of r", "scale", "length",
        )  # fmt: skip


def _turns_wide(trial: Trial, length: float, fast: float) -> bool:
    """Whether it turns through a radian, and never as sharply as a craft of its length does."""
    if "r" not in trial or "psi" not in trial or not np.isfinite(trial["psi"]).any():
        return False
    ahead = np.abs(trial["u"]) > fast
    turn = np.abs(trial["r"][ahead]) * length / np.abs(trial["u"][ahead])
    turned = float(np.nanmax(trial["psi"]) - np.nanmin(trial["psi"]))
    return turned > 1.0 and bool(np.isfinite(turn).any()) and float(np.nanquantile(turn, 0.95)) < _STEERED
