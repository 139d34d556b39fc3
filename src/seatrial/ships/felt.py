"""Channels of the environment and controls that change the motion of a ship."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..environment import Environment
from ..models import STATES, Sampled, Stepped
from ..models.settled import begun
from . import Ship


def feels(ship: Ship, channel: str) -> bool:
    """Whether a channel of the environment changes the motion of a ship under way in a beam sea."""
    if isinstance(ship.model, Stepped):
        return channel.startswith("wind") and bool(ship.model.needed)
    if isinstance(ship.model, Sampled):
        return False
    around = _about(ship)
    draught = float(ship.model.draught) or 0.05 * ship.L_pp
    other = around._replace(**{channel: 0.5 / draught if channel == "per_depth" else 0.01 * ship.L_pp})
    control = tuple(0.1 for _ in ship.model.controls)
    return _rates(ship, control, around)[: len(STATES)] != _rates(ship, control, other)[: len(STATES)]


def idle(ship: Ship) -> frozenset[str]:
    """Controls that change no motion at all, such as the revolutions of a ship whose model keeps its speed."""
    if isinstance(ship.model, Stepped | Sampled):
        return frozenset()
    around, rest = _about(ship), [0.1 for _ in ship.model.controls]
    ways = (0.0, ship.speed)  # a side thruster may do nothing at speed, a rudder nothing at rest
    before = [_rates(ship, rest, around, U) for U in ways]
    return frozenset(
        name for k, name in enumerate(ship.model.controls)
        if all([_rates(ship, [*rest[:k], value, *rest[k + 1 :]], around, U) for U in ways] == before
               for value in (0.2, 1.5))
    )  # fmt: skip


def driven(ship: Ship) -> bool:
    """Whether the order n_P moves the ship at all."""
    dead, pairs = idle(ship), zip(ship.model.controls, ship.model.follows, strict=True)
    return any(order == "n_P" and control not in dead for control, (order, _) in pairs)


def _about(ship: Ship) -> Environment:
    """Calm, with waves of a length that a ship feels."""
    return Environment(wave_T=2.0 * math.sqrt(ship.L_pp))


def _rates(ship: Ship, control: Sequence[float], around: Environment, speed: float | None = None) -> tuple[object, ...]:
    """How the states of a ship change that drifts and turns at a speed [m/s], by default its own."""
    U = max(ship.speed if speed is None else speed, 1e-3)
    motion = (0.0, 0.0, 0.7, U, 0.1 * U, 0.1 * U / ship.L_pp)
    given = tuple(control)
    return tuple(ship.model.derivative(begun(ship.model, motion, given, around), given, around))
