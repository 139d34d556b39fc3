"""Running instruments: samples at their own rate, with errors, latency and losses.

The random numbers of a sample depend only on the seed and on its number, so an instrument that is saved and restored,
or run beside others, gives the same readings.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from ..core.values import dataclass
from . import Reading, SensorError, Truth

_BLOCK = 256
_SLACK = 1e-6
"""A step may be early by this share of the period and still take the sample, as times are rounded sums."""


def not_below_zero(of: str, **figures: float) -> None:
    """Refuse figures of a sensor that are below zero or not finite; SensorError: the first such figure."""
    for name, value in figures.items():
        if not 0.0 <= value < math.inf:
            raise SensorError(f"{name} of {of} is {value:g}; it must be zero or above, and finite")


@dataclass(frozen=True)
class Errors:
    """Errors of one value.

    Attributes:
        noise: standard deviation of white noise, drawn anew for each sample.
        bias: constant error.
        walk: growth of a wandering bias [unit/s^0.5]: after t seconds its variance is walk^2 t.
        memory: time constant of the decay of the wandering bias [s]; its variance then tends to
            walk^2 memory/2, whatever the rate.  By default it does not decay.
        quantum: resolution; values are rounded to whole multiples of it.

    Raises:
        SensorError: a figure below zero.
    """

    noise: float = 0.0
    bias: float = 0.0
    walk: float = 0.0
    memory: float = math.inf
    quantum: float = 0.0

    def __post_init__(self) -> None:
        not_below_zero("a sensor", noise=self.noise, walk=self.walk, quantum=self.quantum)
        if not math.isfinite(self.bias):
            raise SensorError(f"bias of a sensor is {self.bias:g}; it must be finite")
        if not self.memory > 0.0:
            raise SensorError(f"memory of a sensor's bias is {self.memory:g} s; it must be above zero")


EXACT = Errors()
"""No errors."""


@dataclass(frozen=True, kw_only=True)
class Instrument(ABC):
    """Base of the instruments.

    Attributes:
        rate: samples per second [Hz], at the first step that is due; at most one per step of the plant.
        latency: time from the sample to its reading [s].
        loss: share of readings that are lost, one by one.
        outage_every, outage_length: mean time from the end of an outage to the next, and mean length of one [s].

    Raises:
        SensorError: an impossible figure.
    """

    kind: ClassVar[str]

    rate: float = 1.0
    latency: float = 0.0
    loss: float = 0.0
    outage_every: float = math.inf
    outage_length: float = 0.0

    def __post_init__(self) -> None:
        of = f"the {self.kind}"
        for name, value in (("rate", self.rate), ("outage_every", self.outage_every)):
            if not value > 0.0 or (name == "rate" and math.isinf(value)):
                raise SensorError(f"{name} of {of} is {value:g}; it must be above zero")
        not_below_zero(of, latency=self.latency, outage_length=self.outage_length)
        if not 0.0 <= self.loss <= 1.0:
            raise SensorError(f"loss of {of} is {self.loss:g}; it is a share, from 0 to 1")

    @property
    @abstractmethod
    def errors(self) -> Mapping[str, Errors]:
        """Errors of each value that it measures."""

    @abstractmethod
    def measure(self, truth: Truth) -> tuple[float, ...]:
        """The true values in the order of `errors`; a KeyError without such a value."""

    def say(self, measured: Sequence[float]) -> dict[str, float]:
        """The values of a reading from the measured ones, errors included; by default the same."""
        return dict(zip(self.errors, measured, strict=True))

    def start(self, seed: int = 0) -> Running:
        """Start it at time 0; SensorError: a seed below zero."""
        if seed < 0:
            raise SensorError(f"a seed of {seed}; give zero or above")
        return Running(self, seed)


class Running:
    """A running instrument."""

    def __init__(self, instrument: Instrument, seed: int) -> None:
        self.instrument, self.seed = instrument, seed
        self._rate, self._late = instrument.rate, instrument.latency - _SLACK / instrument.rate
        self._errors = tuple(instrument.errors.values())
        self._exact = all(error is EXACT for error in self._errors)
        self._silent = instrument.loss > 0.0 or math.isfinite(instrument.outage_every)
        self._block, self._drawn, self._chances = -1, [[0.0]], [[0.0]]
        self.reset()

    def reset(self) -> None:
        """Back to time 0."""
        self._next = self._last = 0
        self._walked = [0.0] * len(self._errors)
        self._dark_until = -math.inf
        self._waiting: deque[Reading] = deque()

    def read(self, t: float, truth: Truth) -> Reading | None:
        """The reading that is due at time `t` [s], or None; call once a step, with times that do not decrease.

        Args:
            truth: gives true values by name: the six states, controls, and wind and current by their components.
        """
        if t * self._rate + _SLACK >= self._next:
            self._sample(t, truth)
        waiting = self._waiting
        if waiting and waiting[0].t + self._late <= t:
            return waiting.popleft()
        return None

    def snapshot(self) -> dict[str, Any]:
        """Complete state, for JSON."""
        return {"kind": self.instrument.kind, "next": self._next, "last": self._last, "walked": list(self._walked),
                "dark_until": self._dark_until if math.isfinite(self._dark_until) else None,
                "waiting": [[reading.t, dict(reading.values)] for reading in self._waiting]}  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from a `snapshot`; SensorError: it is not of such an instrument."""
        try:
            dark = saved["dark_until"]
            waiting = [Reading(self.instrument.kind, float(t), dict(values)) for t, values in saved["waiting"]]
            walked = [float(value) for value in saved["walked"]]
            following, last, kind = int(saved["next"]), int(saved["last"]), saved["kind"]
        except (KeyError, TypeError, ValueError):
            raise SensorError(f"not a saved {self.instrument.kind}; give one of its snapshots") from None
        if kind != self.instrument.kind or len(walked) != len(self._errors):
            raise SensorError(f"saved state of another instrument than this {self.instrument.kind}")
        self._next, self._last, self._walked = following, last, walked
        self._dark_until = -math.inf if dark is None else float(dark)
        self._waiting = deque(waiting)

    def _sample(self, t: float, truth: Truth) -> None:
        number = math.floor(t * self._rate + _SLACK)
        elapsed = (number - self._last) / self._rate
        self._next, self._last = number + 1, number
        values: Sequence[float] = self.instrument.measure(truth)
        if not self._exact:
            drawn, walked = self._random(number), self._walked
            for k, error in enumerate(self._errors):
                if error.walk:
                    walked[k] = _wandered(walked[k], error, elapsed, drawn[2 * k + 1])
            values = [
                rounded(value + error.bias + walked[k] + error.noise * drawn[2 * k], error.quantum)
                for k, (value, error) in enumerate(zip(values, self._errors, strict=True))
            ]
        if not (self._silent and self._lost(number, t, elapsed)):
            self._waiting.append(Reading(self.instrument.kind, t, self.instrument.say(values)))

    def _lost(self, number: int, t: float, elapsed: float) -> bool:
        """Whether this sample, `elapsed` seconds after the last one, is lost."""
        instrument = self.instrument
        self._random(number)
        single, begins, length = self._chances[number % _BLOCK]
        if t < self._dark_until:
            return True
        if begins < -math.expm1(-elapsed / instrument.outage_every):
            self._dark_until = t - instrument.outage_length * math.log1p(-length)
            return True
        return single < instrument.loss

    def _random(self, number: int) -> list[float]:
        """Normal numbers of a sample: noise and walk of each value."""
        block = number // _BLOCK
        if block != self._block:
            rng = np.random.default_rng([self.seed, block])
            self._drawn = rng.standard_normal((_BLOCK, 2 * len(self._errors))).tolist()
            self._chances = rng.random((_BLOCK, 3)).tolist()
            self._block = block
        return self._drawn[number % _BLOCK]


def _wandered(bias: float, error: Errors, elapsed: float, drawn: float) -> float:
    """A wandering bias `elapsed` seconds later; its variance does not depend on the number of calls."""
    if math.isinf(error.memory):
        return bias + error.walk * math.sqrt(elapsed) * drawn
    grown = -0.5 * error.memory * math.expm1(-2.0 * elapsed / error.memory)
    return math.exp(-elapsed / error.memory) * bias + error.walk * math.sqrt(grown) * drawn


def rounded(value: float, quantum: float) -> float:
    """The nearest multiple of a resolution; the value itself without one."""
    return round(value / quantum) * quantum if quantum and math.isfinite(value) else value


def direction(angle: float, quantum: float = 0.0) -> float:
    """A direction in [0, 2 pi), to a resolution."""
    found = rounded(angle % math.tau, quantum)
    return 0.0 if found >= math.tau else found
