"""Actuators between order and force: limits, rates, lag, dead time, reversal, as states of the plant.

An actuator answers once per time step: its end point is exact, and what acts over the step is the mean
of that answer (of a plain ramp: of its two ends).  So the right-hand side of the ship stays smooth
within the step, whatever the integrator.  A dead time is a queue of orders whose length
follows from the step.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import ClassVar, Protocol

from .core.parameters import Scalar, Scalars, spec
from .core.symbolic import atan2, both, clip, cos, exp, is_symbol, larger, magnitude, sign, sin, where
from .core.values import dataclass, field

# Stand in for zero where it divides, and for an infinite rate, which no kernel can compare with.
_SLOWEST, _AT_ONCE = 1e-9, 1e300


class Servo(Protocol):
    """One actuator.  Its memory is the actual value first, then what `extra` names.

    Attributes:
        low, high: least and greatest value; infinite without a limit.
        rate: greatest rate of change; infinite without a limit.
        dead_time: time before an order begins to act [s].
        at_once: whether it obeys within the step of the order.
    """

    extra: ClassVar[tuple[str, ...]]

    @property
    def low(self) -> Scalar: ...

    @property
    def high(self) -> Scalar: ...

    @property
    def rate(self) -> Scalar: ...

    @property
    def dead_time(self) -> Scalar: ...

    @property
    def at_once(self) -> bool: ...

    def advance(self, memory: Scalars, order: Scalar, dt: Scalar) -> tuple[Scalar, Scalars]:
        """Mean value that acts over the next `dt` seconds, and the memory at their end."""
        ...


def approach(actual: Scalar, target: Scalar, rate: Scalar, lag: Scalar, dt: Scalar) -> tuple[Scalar, Scalar]:
    """Mean over `dt` and end of y' = clip((target - y)/lag, -rate, rate); a plain ramp where lag is 0.

    The mean of a plain ramp is that of its ends, also in the step in which it arrives: a replay knows the
    ends only, and so meets the same mean.  Without a rate the target acts at once.
    """
    error, lag_ = target - actual, larger(lag, _SLOWEST)
    if not is_symbol(lag) and lag == 0.0:
        end = clip(target, actual - rate * dt, actual + rate * dt)
        return where(rate < _AT_ONCE, 0.5 * (actual + end), end), end
    linear = clip(error, -rate * lag_, rate * lag_)
    ramped = clip(error - linear, -rate * dt, rate * dt)
    t = magnitude(ramped) / larger(rate, _SLOWEST)
    left, decay = error - ramped, exp(-(dt - t) / lag_)
    mean = actual + ramped * (1.0 - 0.5 * t / dt) + left * (1.0 - (t + lag_ * (1.0 - decay)) / dt)
    return mean, target - left * decay


@dataclass(frozen=True, kw_only=True)
class Paced:
    """What goes to a target at a rate, with a first-order lag, after a dead time; the defaults obey at once."""

    extra: ClassVar[tuple[str, ...]] = ()

    rate: Scalar = spec("1/s", "greatest rate of change", (1e-9, math.inf), default=math.inf)
    lag: Scalar = spec("s", "time constant of the answer", (0.0, 1e4), default=0.0)
    dead_time: Scalar = spec("s", "time before an order begins to act", (0.0, 1e3), default=0.0)

    @property
    def at_once(self) -> bool:
        """Whether it has neither rate nor lag nor dead time."""
        return math.isinf(self.rate) and self.lag == 0.0 and self.dead_time == 0.0

    def target(self, actual: Scalar, order: Scalar) -> Scalar:
        """Where an order sends it from its actual value."""
        return order

    def advance(self, memory: Scalars, order: Scalar, dt: Scalar) -> tuple[Scalar, Scalars]:
        """Mean value that acts over the next `dt` seconds, and the value at their end."""
        mean, end = approach(memory[0], self.target(memory[0], order), self.rate, self.lag, dt)
        return mean, (end,)


@dataclass(frozen=True, kw_only=True)
class Actuator(Paced):
    """A steering gear or any other servo with limits."""

    low: Scalar = spec("", "least value", default=-math.inf)
    high: Scalar = spec("", "greatest value", default=math.inf)

    def target(self, actual: Scalar, order: Scalar) -> Scalar:
        """The order as far as the limits let it."""
        return clip(order, self.low, self.high)


@dataclass(frozen=True, kw_only=True)
class Azimuth(Paced):
    """The servo of an azimuth thruster: turns the shorter way round at its rate, K_alpha [rad/s].

    You 2023 Eq. 9, d alpha/dt = K e/sqrt(e^2 + epsilon^2), whose epsilon is 0 there; under a fixed step
    that sign function chatters, so the rate is clipped to what the step needs.
    """

    @property
    def low(self) -> float:
        """Minus infinity: it turns all the way round."""
        return -math.inf

    @property
    def high(self) -> float:
        """Infinite: it turns all the way round."""
        return math.inf

    def target(self, actual: Scalar, order: Scalar) -> Scalar:
        """The angle of the order that is nearest the actual one."""
        error = order - actual
        return actual + atan2(sin(error), cos(error))


@dataclass(frozen=True, kw_only=True)
class Shaft:
    """Propeller revolutions of a ship that must stop its engine to reverse it.

    Speeding up and slowing down have rates of their own; before it turns the other way than it last did,
    the shaft has stood still for `pause` seconds.
    """

    extra: ClassVar[tuple[str, ...]] = ("pause_left", "last_side")

    low: Scalar = spec("1/s", "greatest revolutions astern, as a negative number", default=-math.inf)
    high: Scalar = spec("1/s", "greatest revolutions ahead", default=math.inf)
    rate: Scalar = spec("1/s^2", "rate of speeding up", (1e-9, math.inf), default=math.inf)
    rate_down: Scalar = spec("1/s^2", "rate of slowing down", (1e-9, math.inf), default=math.inf)
    pause: Scalar = spec("s", "standstill before a reversal", (0.0, 1e3), default=0.0)
    dead_time: Scalar = spec("s", "time before an order begins to act", (0.0, 1e3), default=0.0)

    @property
    def at_once(self) -> bool:
        """Whether it has neither rates nor pause nor dead time."""
        return math.isinf(self.rate) and math.isinf(self.rate_down) and self.pause == self.dead_time == 0.0

    def advance(self, memory: Scalars, order: Scalar, dt: Scalar) -> tuple[Scalar, Scalars]:
        """Mean revolutions over the next `dt` seconds, and revolutions, pause left and last side at their end."""
        n, left, last = memory
        wanted = clip(order, self.low, self.high)
        turning = magnitude(n) > 0
        side = where(turning, sign(n), last)
        # A reversal first stops the shaft, then waits; the same way as before it may start again at once.
        held = both(wanted * side < 0, where(turning, 1.0, left) > 0)
        target = where(held, 0.0, wanted)
        rate = where(magnitude(target) > magnitude(n), self.rate, self.rate_down)
        mean, end = approach(n, target, rate, 0.0, dt)
        return mean, (end, where(turning, self.pause, larger(left - dt, 0.0)), side)


def queued(
    orders: Scalars, order: Scalar, dead_time: float, dt: float
) -> tuple[tuple[tuple[float, Scalar], ...], Scalars]:
    """Which order acts over which share of the step, after the dead time; and the queue of the next step.

    Args:
        orders: those of the last `queue_length` steps, the oldest first.
    """
    if not orders:
        return ((1.0, order),), ()
    late = len(orders) - dead_time / dt
    line = (*orders, order)
    pieces = ((1.0, line[0]),) if late < 1e-9 else ((1.0 - late, line[0]), (late, line[1]))
    return pieces, line[1:]


def queue_length(dead_time: float, dt: float) -> int:
    """How many orders wait at a time."""
    return math.ceil(dead_time / dt - 1e-9)


_TABLES = {"n_P": "propeller", "delta": "rudder"}
NUMBERED = re.compile(r"_\d+$")
"""The number of one of several alike, at the end of the name of its control."""


def table(control: str) -> str:
    """The name of a control's actuator: propeller and rudder for n_P and delta, else the control's own."""
    return _TABLES.get(control, control)


@dataclass(frozen=True)
class Actuators:
    """The actuators of a ship by `table` name; a control without one obeys at once."""

    by_name: Mapping[str, Servo] = field(default_factory=dict[str, Servo])

    def of(self, control: str) -> Servo:
        """The actuator of a control; rudder and propeller serve the numbered ones (delta_1, n_P_2) too."""
        names = (table(control), table(NUMBERED.sub("", control)))
        return next((self.by_name[name] for name in names if name in self.by_name), Actuator())

    @property
    def rudder(self) -> Servo:
        """The steering gear."""
        return self.of("delta")

    @property
    def propeller(self) -> Servo:
        """The shaft."""
        return self.of("n_P")
