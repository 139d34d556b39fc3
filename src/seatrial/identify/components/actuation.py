"""What logs show of the actuators against what the ship file says: rates, lags, dead times and limits.

A log of an actual angle proves that a servo is faster, or goes farther, than the file has it.  That it is slower is
shown where whole moves, whatever their size, go at one pace; small moves of no common pace prove nothing.  A log of
order and angle has all of it by least squares (`servo.fit_servo`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ...actuators import NUMBERED, Actuator, Azimuth, Servo, Shaft, table
from ...core.values import dataclass
from ...data import Array, DataError, Trial, unwrapped
from ...models import unit
from ...ships import Ship
from ...simulate.steering import is_held, logged
from ..noise import resolution
from .servo import fit_servo, lateness

# A rate or a limit is exceeded from this share on; what many rows agree on differs from the file from that one on.
_BEYOND, _OTHER = 1.15, 1.05
# A slope is taken over so many noises of travel.
_NOISES = 30.0
# Rows that show as much before it is no outlier, and rows of one pace, within so much, before it is the servo's.
_ROWS, _PACED, _ALIKE = 5, 8, 0.08
# Slopes of less than this share of the fastest rows are no part of a move.
_STILL = 0.2
# Least lag or dead time that is worth a line [s], and how many of its standard deviations it has to be.
_LATE, _SURE = 0.2, 3.0


@dataclass(frozen=True)
class Shown:
    """One number of an actuator as logs show it.

    Attributes:
        control, key: such as ``delta`` and ``rate``.
        shared: table of a ship file, below [actuators], that holds the key for this control and for its like.
        value: in SI units.
        said: what the ship file has.
        rows: how many rows of the logs show it.
    """

    control: str
    shared: str
    key: str
    value: float
    said: float
    rows: int

    @property
    def table(self) -> str:
        """Of a ship file or a study."""
        return f"actuators.{self.shared}"

    @property
    def entry(self) -> str:
        """The line of that table, in degrees where it is an angle."""
        return (f'{self.key} = {{ value = {self._in(self.value)}, unit = "{self._unit}", '
                f'source = "logs, {self.rows} rows" }}')  # fmt: skip

    @property
    def words(self) -> str:
        """What the logs show, and what the file has."""
        does = {"low": "goes to", "high": "goes to", "lag": "follows its order with a lag of",
                "dead_time": "begins to follow its order after"}.get(self.key, "moves at")  # fmt: skip
        return (f"{self.control} {does} {self._in(self.value)} {self._unit}, "
                f"the ship file has {self.key} {self._in(self.said)}")  # fmt: skip

    @property
    def _unit(self) -> str:
        if self.key in ("lag", "dead_time"):
            return "s"
        own = "deg" if unit(self.control) == "rad" else unit(self.control)
        return own if self.key in ("low", "high") else "1/s^2" if own == "1/s" else f"{own}/s"

    def _in(self, value: float) -> str:
        return f"{math.degrees(value) if self._unit.startswith('deg') else value:.3g}"


_Number = tuple[str, float, float, int]
"""Key, value, what the file has, and how many rows show it."""


def exceeded(ship: Ship, trials: Sequence[Trial]) -> Iterator[str]:
    """What logs show of the actuators that the ship file has otherwise, a line each."""
    for one in shown(ship, trials):
        yield f"{one.words}: simulated manoeuvres steer otherwise than these trials; write [{one.table}] {one.entry}"


def shown(ship: Ship, trials: Sequence[Trial]) -> Iterator[Shown]:
    """Numbers of the actuators that these logs show to be others than the ship file has.

    A control that is held between rows (an order, which jumps) is not judged.  Of controls that share a table, as
    two rudders do, the one that differs most speaks.
    """
    found: dict[tuple[str, str], Shown] = {}
    for control in ship.model.controls:
        servo = ship.actuators.of(control)
        logs = [trial for trial in trials if logged(trial, control) and not is_held(trial, control)]
        own = table(control)
        shared = own if own in ship.actuators.by_name else table(NUMBERED.sub("", control))
        for key, value, said, rows in (
            *_paces(control, servo, logs), *_answers(control, servo, logs), *_limits(control, servo, logs),
        ):  # fmt: skip
            before = found.get((shared, key))
            if before is None or abs(value - said) > abs(before.value - before.said):
                found[shared, key] = Shown(control, shared, key, value, said, rows)
    yield from found.values()


def _paces(control: str, servo: Servo, logs: Sequence[Trial]) -> Iterator[_Number]:
    """Rates; those of a shaft that speeds up and that slows down by themselves."""
    sides = (("rate", 1.0), ("rate_down", -1.0)) if isinstance(servo, Shaft) else (("rate", 0.0),)
    level = max((_still_noise(trial[control]) for trial in logs), default=0.0)
    for key, side in sides:
        said = float(getattr(servo, key))
        pace, _, _ = _common(logs, control, said, level, side)
        pace, rows, spread = _common(logs, control, pace, level, side)  # means of as many rows as this pace needs
        if rows >= _PACED and spread < _ALIKE:
            if not 1.0 / _OTHER <= pace / said <= _OTHER:
                yield key, pace, said, rows
            continue
        most = max((moving(trial, control, said, level) for trial in logs), default=0.0)
        if _BEYOND * said < most < math.inf:
            yield key, most, said, _ROWS


def _common(
    logs: Sequence[Trial], control: str, rate: float, level: float, side: float
) -> tuple[float, int, float]:
    """The middle pace of the rows within all moves, how many they are, and their spread as a share of it."""
    found = np.concatenate([_NONE, *(paces(trial, control, rate, level, side) for trial in logs)])
    if not found.size:
        return rate, 0, math.inf
    low, middle, high = (float(value) for value in np.quantile(found, (0.25, 0.5, 0.75)))
    return middle, found.size, (high - low) / middle


_NONE = np.empty(0)


def _still_noise(values: Array) -> float:
    """Standard deviation of the noise of a control that is still in most rows; its moves are no part of it."""
    left = np.abs(np.diff(values, 2))
    left = left[np.isfinite(left)]
    # a second difference of white noise has six times its variance, the median of |N(0, 1)| is 0.6745
    middle = float(np.median(left)) / (0.6745 * math.sqrt(6.0)) if left.size else 0.0
    return max(middle, resolution(values) / math.sqrt(12.0))


def paces(trial: Trial, control: str, rate: float, level: float, side: float = 0.0) -> Array:
    """Rates of the rows within the moves of a control, without the first and last of each [its unit/s].

    Args:
        rate: about as expected; means of so many rows are taken that the noise is small beside the travel.
        level: standard deviation of that noise.
        side: +1 for moves away from zero only, -1 for those towards it, 0 for all.
    """
    values, dt = np.asarray(trial[control]), trial.dt
    if not math.isfinite(rate):
        return _NONE
    block = max(1, math.ceil(_NOISES * level / (rate * dt)))
    count = len(trial) // block
    if count < _ROWS:
        return _NONE
    angle = unwrapped(values) if unit(control) == "rad" else values
    mean = angle[: count * block].reshape(count, block).mean(axis=1)
    slope = np.diff(mean) / (block * dt)
    fast = np.sort(np.abs(slope[np.isfinite(slope)]))[-_ROWS:]
    way = np.where(np.abs(slope) > _STILL * fast.min(initial=math.inf), np.sign(slope), 0.0)
    within = np.zeros(slope.size, bool)
    within[1:-1] = (way[1:-1] != 0.0) & (way[:-2] == way[1:-1]) & (way[2:] == way[1:-1])
    if side:
        within &= np.sign(slope * (mean[1:] + mean[:-1])) == side
    return np.abs(slope[within & np.isfinite(slope)])


def moving(trial: Trial, control: str, rate: float, level: float) -> float:
    """Rate that some rows of a trial show [unit of the control/s]; 0 where it is too coarse or noisy to tell.

    Args:
        rate: about as expected; a slope is taken over so many rows that the noise is small beside the travel.
        level: standard deviation of that noise.
    """
    values, dt = np.asarray(trial[control]), trial.dt
    if not math.isfinite(rate):
        return 0.0
    k = max(2, math.ceil(_NOISES * level / (rate * dt)))
    if len(trial) <= k + _ROWS:
        return 0.0
    angle = unwrapped(values) if unit(control) == "rad" else values
    slopes = np.abs(angle[k:] - angle[:-k]) / (trial.t[k:] - trial.t[:-k])
    return max(_reached(slopes), 0.0)


def _answers(control: str, servo: Servo, logs: Sequence[Trial]) -> Iterator[_Number]:
    """Lag and dead time of an angle whose order is on record too."""
    both = [trial for trial in logs if logged(trial, f"{control}_cmd")]
    if unit(control) != "rad" or not both:
        return
    try:
        if isinstance(servo, Azimuth | Actuator) and lateness(both, control, servo) < 0.5 * _LATE:
            return
        found = fit_servo(both, control)
    except DataError:
        return  # orders that never change show nothing
    for key in ("lag", "dead_time"):
        value, said = float(getattr(found.servo, key)), float(getattr(servo, key, 0.0))
        if abs(value - said) > max(_LATE, _SURE * found.sigma.get(key, 0.0)):
            yield key, value, said, found.samples


def _limits(control: str, servo: Servo, logs: Sequence[Trial]) -> Iterator[_Number]:
    """Limits that were passed."""
    for key, limit, side in (("low", float(servo.low), -1.0), ("high", float(servo.high), 1.0)):
        most = max((_reached(side * trial[control]) for trial in logs), default=-math.inf)
        if math.isfinite(limit) and side * limit > 0.0 and most > _BEYOND * side * limit:
            yield key, side * most, limit, _ROWS


def _reached(values: Array) -> float:
    """What `_ROWS` rows reach, so that one or two outliers are none of it."""
    known = np.sort(values[np.isfinite(values)])
    return float(known[-_ROWS]) if known.size >= _ROWS else -math.inf
