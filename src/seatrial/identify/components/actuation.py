"""What logs show of the actuators against what the ship file says: rates and limits that were exceeded.

A log of an actual angle can prove that a servo is faster, or goes farther, than the file has it.  That it is slower no
log proves: its orders may have been small.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ...actuators import Shaft, table
from ...data import Array, Trial, unwrapped
from ...models import unit
from ...ships import Ship
from ...simulate.steering import is_held, logged
from ..noise import sensor_noise

# A rate or a limit is exceeded from this share on, and a slope is taken over so many noises of travel.
_BEYOND, _NOISES = 1.15, 30.0
# Rows that show as much before it is no outlier.
_ROWS = 5


def exceeded(ship: Ship, trials: Sequence[Trial]) -> Iterator[str]:
    """Rates and limits of the ship file that some of these trials exceed, a line each.

    A control that is held between rows (an order, which jumps) is not judged.
    """
    for control in ship.model.controls:
        servo = ship.actuators.of(control)
        logs = [trial for trial in trials if logged(trial, control) and not is_held(trial, control)]
        rate = max(float(servo.rate), float(servo.rate_down)) if isinstance(servo, Shaft) else float(servo.rate)
        seen = max((moving(trial, control, rate) for trial in logs), default=0.0)
        if _BEYOND * rate < seen < math.inf:
            yield _words(control, "moves at", "rate", seen, rate, "/s")
        for key, limit, side in (("low", float(servo.low), -1.0), ("high", float(servo.high), 1.0)):
            most = max((_reached(side * trial[control]) for trial in logs), default=-math.inf)
            if math.isfinite(limit) and side * limit > 0.0 and most > _BEYOND * side * limit:
                yield _words(control, "goes to", key, side * most, limit, "")


def moving(trial: Trial, control: str, rate: float) -> float:
    """Rate that some rows of a trial show [unit of the control/s]; 0 where it is too coarse or noisy to tell.

    Args:
        rate: about as expected; a slope is taken over so many rows that the noise is small beside the travel.
    """
    values, dt = np.asarray(trial[control]), trial.dt
    if not math.isfinite(rate):
        return 0.0
    level = sensor_noise(values)
    k = max(2, math.ceil(_NOISES * level / (rate * dt))) if math.isfinite(level) else 2
    if len(trial) <= k + _ROWS:
        return 0.0
    angle = unwrapped(values) if unit(control) == "rad" else values
    slopes = np.abs(angle[k:] - angle[:-k]) / (trial.t[k:] - trial.t[:-k])
    return max(_reached(slopes), 0.0)


def _reached(values: Array) -> float:
    """What `_ROWS` rows reach, so that one or two outliers are none of it."""
    known = np.sort(values[np.isfinite(values)])
    return float(known[-_ROWS]) if known.size >= _ROWS else -math.inf


def _words(control: str, does: str, key: str, seen: float, said: float, per: str) -> str:
    degrees = unit(control) == "rad"
    factor, own = (math.degrees(1.0), "deg") if degrees else (1.0, unit(control))
    said_in = f'rate = {{ value = {factor * seen:.3g}, unit = "{own}{per}" }}'.replace("rate", key, 1)
    return (f"{control} {does} {factor * seen:.3g} {own}{per}, the ship file has {key} {factor * said:.3g}: "
            f"simulated manoeuvres steer otherwise than these trials; write [actuators.{table(control)}] {said_in}")
