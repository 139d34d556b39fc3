"""Faults that a log shows without a model: readings that repeat, and a rudder that does not follow its order."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping

from ....core.values import dataclass, field
from ....models import unit
from ....ships import Ship

# A channel is stuck where so many repetitions have less than this probability, by the habit of the log itself.
_CHANCE, _FEWEST = 1e-9, 6
# A rudder is judged over this time [s], where its order has called for this much movement [rad].
_SPAN, _CALLED = 20.0, math.radians(4.0)
# Orders nearer than this to the angle call for no movement [rad].
_NEAR = math.radians(1.0)
# Shares of the expected movement below which a rudder is jammed, or slow, and above which it follows.
_JAMMED, _SLOW, _FOLLOWS = 0.05, 0.5, 0.7
# An order that has not moved for so long stands still [s].
_STILL = 3.0
# A gear that has moved this much in one way [rad] has shown its rate; so often, and it is known.
_SHOWN, _OFTEN = math.radians(4.0), 3
JAMMED, SLOW, FOLLOWS = "jammed", "slow", "follows"


@dataclass
class _Run:
    """Readings of one channel: the last one, how often and since when it has repeated, and the habit of the log."""

    last: float = math.nan
    count: int = 0
    since: float = math.nan
    same: int = 0
    all: int = 0


@dataclass
class Repeats:
    """Which channels repeat the same reading for longer than their habit makes likely."""

    runs: dict[str, _Run] = field(default_factory=dict[str, _Run])

    def note(self, t: float, values: Mapping[str, float]) -> None:
        """Note the readings of a row; NaN is none."""
        for name, value in values.items():
            if not math.isfinite(value):
                continue
            run = self.runs.setdefault(name, _Run())
            if value == run.last:
                run.count += 1
            else:
                # a run that was a fault is no habit
                if not self._unlikely(run):
                    run.same, run.all = run.same + run.count, run.all + run.count + 1
                run.last, run.count, run.since = value, 0, t

    @staticmethod
    def _unlikely(run: _Run) -> bool:
        habit = (run.same + 1.0) / (run.all + 2.0)
        return run.all > 30 and run.count >= _FEWEST and run.count * math.log(habit) < math.log(_CHANCE)

    def stuck(self, name: str) -> float | None:
        """Since when a channel is stuck [s]; None where it is not."""
        run = self.runs.get(name)
        return run.since if run is not None and self._unlikely(run) else None

    def repeated(self, name: str, since: float) -> bool:
        """Whether a channel has not changed since a time [s], over a few readings at least."""
        run = self.runs.get(name)
        return run is not None and run.count >= 3 and run.since <= since


@dataclass
class Steering:
    """Whether a control follows its order, where the log has both.

    Attributes:
        control: the control; its order is ``<control>_cmd``.
        rate: how fast it can move [rad/s], by the ship file or as it has shown `_OFTEN` times.
        lag: time constant and dead time of its servo together [s].

    What its sensor is off by is found where neither order nor angle moves, and where the angle jumps.
    """

    control: str
    rate: float
    lag: float
    _moves: deque[tuple[float, float, float]] = field(default_factory=deque[tuple[float, float, float]])
    _both: deque[tuple[float, float, float]] = field(default_factory=deque[tuple[float, float, float]])
    _orders: deque[tuple[float, float]] = field(default_factory=deque[tuple[float, float]])
    _last: tuple[float, float] | None = None
    _beside: float = 0.0
    _turn: list[float] = field(default_factory=lambda: [0.0, 0.0])
    _paces: list[float] = field(default_factory=list[float])

    @staticmethod
    def of(ship: Ship, control: str) -> Steering:
        """The servo of a ship file; one without a rate is taken to cross 70 degrees in 20 s."""
        servo = ship.actuators.of(control)
        rate = float(getattr(servo, "rate", math.inf))
        lag = float(getattr(servo, "lag", 0.0)) + float(getattr(servo, "dead_time", 0.0))
        return Steering(control, rate if math.isfinite(rate) else math.radians(3.5), lag)

    def note(self, t: float, values: Mapping[str, float]) -> None:
        """Note a row; NaN is no reading."""
        if self._last is not None and t <= self._last[0]:  # the clock was set back
            self._moves.clear()
            self._both.clear()
            self._orders.clear()
            self._last = None
        order, angle = values.get(f"{self.control}_cmd", math.nan), values.get(self.control, math.nan)
        if math.isfinite(order):
            self._orders.append((t, order))
        if not math.isfinite(angle):
            return
        if self._last is not None and self._orders:
            then, before = self._last
            wanted = self._order(then)
            self._both.append((t, wanted, angle))
            reach, wanted = self.rate * (t - then), wanted + self._beside
            jumped = abs(angle - before) > 1.25 * reach + _NEAR
            if (jumped or self._uncalled(t, angle - before)) and abs(angle - wanted) > abs(before - wanted):
                # no rudder does that, its sensor does, or another wheel; one that goes to its order may only be quicker
                self._beside, wanted = self._beside + angle - before, wanted + angle - before
                before = angle
            self._learn(t - then, angle - before, wanted - before)
            if abs(wanted - before) > _NEAR:
                called = math.copysign(min(reach, abs(wanted - before) * (t - then) / max(self.lag, t - then)),
                                       wanted - before)  # fmt: skip
                self._moves.append((t, called, angle - before))
            for kept in (self._moves, self._both):
                while kept and kept[0][0] < t - _SPAN:
                    kept.popleft()
            self._stand()
        self._last = t, angle
        while len(self._orders) > 1 and self._orders[1][0] < t - self.lag - 1.0:
            self._orders.popleft()

    def _learn(self, span: float, moved: float, left: float) -> None:
        """Note how fast it goes in one way while its order is far off: a file may have the rate that rules ask."""
        forward = moved * left > 0.0 and abs(left) > abs(moved) + _NEAR
        if forward and moved * self._turn[1] >= 0.0:
            self._turn = [self._turn[0] + span, self._turn[1] + moved]
            return
        if abs(self._turn[1]) > _SHOWN:
            self._paces = sorted([*self._paces, abs(self._turn[1]) / self._turn[0]])[-_OFTEN:]
            self.rate = max(self.rate, self._paces[0]) if len(self._paces) == _OFTEN else self.rate
        self._turn = [span, moved] if forward else [0.0, 0.0]

    def _uncalled(self, t: float, moved: float) -> bool:
        """Whether the angle moves while its order stands still."""
        late = [one for at, one, _ in self._both if at > t - _STILL]
        return abs(moved) > 2.0 * _NEAR and len(late) > 2 and max(late) - min(late) < _NEAR

    def _stand(self) -> None:
        """Where neither moves, what is between them is the sensor's, and no call to move."""
        _, ordered, angles = zip(*self._both, strict=True)
        quiet = self._both[-1][0] - self._both[0][0] > 0.9 * _SPAN and max(ordered) - min(ordered) < _NEAR
        if quiet and max(angles) - min(angles) < _NEAR and abs(angles[-1] - ordered[-1] - self._beside) > _NEAR:
            self._beside = angles[-1] - ordered[-1]
            self._moves.clear()

    def _order(self, t: float) -> float:
        """The order that acted at a time."""
        found = self._orders[0][1]
        for at, order in self._orders:
            if at > t - self.lag + 1e-9:
                break
            found = order
        return found

    def verdict(self) -> tuple[str, float] | None:
        """`JAMMED`, `SLOW` or `FOLLOWS`, and since when [s]; None where too little calls for it to move."""
        called = sum(abs(one) for _, one, _ in self._moves)
        if called < _CALLED or len(self._moves) < 3:
            return None
        share = sum(a * b for _, a, b in self._moves) / sum(a * a for _, a, _ in self._moves)
        if share > _FOLLOWS:
            return FOLLOWS, self._moves[0][0]
        ordered = [one for _, one, _ in self._both]
        # an angle that stands beside an order that has not moved may be one of a sensor that is off
        if max(ordered) - min(ordered) < _CALLED:
            return None
        if share < _JAMMED:
            return JAMMED, self._moves[0][0]
        return (SLOW, self._moves[0][0]) if share < _SLOW else None


def steerings(ship: Ship, channels: Mapping[str, float] | tuple[str, ...]) -> tuple[Steering, ...]:
    """What watches the angles of a ship whose orders are in the log."""
    return tuple(Steering.of(ship, name) for name in ship.model.controls
                 if unit(name) == "rad" and name in channels and f"{name}_cmd" in channels)  # fmt: skip
