"""How rough the sea is: process noise under which the first readings of a log are most likely."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np

from ...environment import CHANNELS
from ...ships import Ship
from .follow import Follower, Machine, begun, made
from .settings import Settings, scaled

Row = tuple[float, Mapping[str, float]]
FACTORS = (1.0, 3.0, 10.0, 30.0)
"""Factors of the usual process noise that are tried."""

# A start this long is enough [L/U], and no more than so many rows are taken.
_LENGTH, _ROWS, _GAP = 60.0, 1500, 5.0
# A reading counts as so many standard deviations at most.
_MOST = 25.0


def likeliest(
    ship: Ship, settings: Settings, rows: Iterable[Row], held: Collection[str] = ()
) -> tuple[Settings, tuple[float, float]]:  # fmt: skip
    """The settings with the factors of motion and slow forces under which the first rows are most likely.

    Args:
        rows: of the log, from its beginning.
        held: controls that keep the value of a row until the next one.
    """
    some = _first(ship, rows)
    found: dict[tuple[float, float], float] = {}

    def score(motion: float, slow: float) -> float:
        if (motion, slow) not in found:
            found[motion, slow] = _likelihood(made(ship, scaled(settings, motion, slow)), some, held)
        return found[motion, slow]

    motion = max(FACTORS, key=lambda one: score(one, 1.0))
    slow = max(FACTORS, key=lambda one: score(motion, one))
    motion = max(FACTORS, key=lambda one: score(one, slow))
    return scaled(settings, motion, slow), (motion, slow)


def _first(ship: Ship, rows: Iterable[Row]) -> Sequence[Row]:
    span, out = _LENGTH * ship.L_pp / max(ship.speed, 1e-3), list[Row]()
    for t, values in rows:
        if out and (t - out[0][0] > span or t <= out[-1][0]):
            break
        out.append((t, values))
    return out[:: max(1, len(out) // _ROWS)]


def _likelihood(machine: Machine, rows: Sequence[Row], held: Collection[str]) -> float:
    """Logarithm of the likelihood of the readings, outliers clipped."""
    controls = machine.ship.model.controls
    acting = np.zeros(len(controls) + len(CHANNELS))
    kept = np.array([*(name in held for name in controls), *(True for _ in CHANNELS)])
    follower: Follower | None = None
    total, long = 0.0, _GAP * machine.ship.L_pp / max(machine.ship.speed, 1e-3)
    for t, values in rows:
        before = acting.copy()
        for k, name in enumerate(controls):
            acting[k] = values.get(name, acting[k])
        readings = np.array([values.get(name, math.nan) for name in machine.channels])
        if follower is None or t - follower.t > long:
            known = all(math.isfinite(values.get(name, math.nan)) for name in ("psi", *_places(machine)))
            follower = begun(machine, t, readings) if known else None
            continue
        follower, step = follower.row(t, np.where(kept, before, 0.5 * (before + acting)), readings)
        if step.rows.size:
            _, size = np.linalg.slogdet(step.spread)
            total -= 0.5 * (min(float(step.innovation @ step.inverse @ step.innovation), _MOST * step.rows.size) + size)
    return total if math.isfinite(total) else -math.inf


def _places(machine: Machine) -> tuple[str, ...]:
    return tuple(name for name in ("x", "y") if name in machine.channels)
