"""The real-time loop: ships stepped on a schedule without drift, with orders from any thread; the schedule itself."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from ..core.parameters import unknown
from ..core.values import dataclass
from ..environment import Environment
from ..sensors import Reading
from ..sensors.suite import Suite
from .fleet import Event, Fleet, Keeper, LoopError, Vessel, Waiting, Witness, packed, unpacked
from .helm import CommandError
from .plant import Plant

__all__ = ["CommandError", "Event", "Loop", "LoopError", "LoopReport", "Vessel", "Witness"]

_NAP = 0.05
"""Longest single wait [s], so that a pause or a stop takes effect."""

SLOWEST, FASTEST = 0.1, 100.0
"""Range of time factors with a schedule; the only other value is infinite, as fast as possible."""


class Clock(Protocol):
    """A source of time that can wait."""

    def now(self) -> float:
        """Time of a monotonic clock [s]."""
        ...

    def sleep(self, seconds: float, /) -> None:
        """Wait."""


class WallClock:
    """The clock of the machine."""

    now, sleep = staticmethod(time.perf_counter), staticmethod(time.sleep)


class LoneClock(WallClock):
    """The clock of the machine for a loop beside which no thread waits: a wait of zero does not give way to others."""

    @staticmethod
    def sleep(seconds: float, /) -> None:
        """Wait."""
        if seconds > 0.0:
            time.sleep(seconds)


class Schedule:
    """When the next tick is due, and how late the ticks were; tick k is due at its own time, however late others were.

    All late ticks are made up for.  Only if the machine stood still for longer than `patience`, or the ships were set
    to another time, the schedule restarts; `slipped` counts the time that was given up.

    Attributes:
        factor: simulated time over clock time; infinite is as fast as possible.
        period: time between two ticks [s of the clock].
        ticks, overruns, worst, late, slipped: as in `LoopReport`.
    """

    def __init__(self, rate: float, factor: float, clock: Clock, patience: float = 10.0) -> None:
        self._clock, self._rate, self._patience = clock, rate, patience
        self.ticks = self.overruns = 0
        self.worst = self.late = self.slipped = 0.0
        self._origin, self._since, self.period = 0.0, 0, 0.0
        self._held: float | None = None
        self.pace(factor)

    def pace(self, factor: float) -> None:
        """Change the time factor from now on; the simulated time to the next tick stays the same.

        Raises:
            LoopError: neither between 0.1 and 100 nor infinite.
        """
        if not (SLOWEST <= factor <= FASTEST or factor == math.inf):
            raise LoopError(f"time factor {factor:g}; give {SLOWEST:g} to {FASTEST:g}, or inf for as fast as possible")
        ticks = self.left() / self.period if self.period else 0.0
        self.factor, self.period = factor, 1.0 / (self._rate * factor)
        self._due_in(ticks * self.period)

    def _due_in(self, seconds: float) -> None:
        if self._held is not None:
            self._held = seconds
        self._origin, self._since = self._clock.now() + seconds, 0

    def hold(self) -> None:
        """Stop the schedule, during a pause or while the loop does not run."""
        if self._held is None:
            self._held = self.left()

    def release(self) -> None:
        """Continue the schedule with the remaining time to the next tick unchanged."""
        if self._held is not None:
            held, self._held = self._held, None
            self._due_in(held)

    def left(self) -> float:
        """Time until the next tick is due [s]; negative if it is late."""
        if self._held is not None:
            return self._held
        if math.isinf(self.factor):
            return 0.0
        return self._origin + self._since * self.period - self._clock.now()

    def give_up(self) -> float:
        """Give up a delay of more than one period instead of making up for it; returns the time given up [s]."""
        late = -self.left()
        if late <= self.period:
            return 0.0
        self.slipped += late
        self._due_in(0.0)
        return late

    def begin(self) -> float:
        """Count a tick that begins now; returns the time given up, if any [s]."""
        self.late = max(-self.left(), 0.0)
        self.ticks += 1
        self.worst = max(self.worst, self.late)
        if self.late > self.period > 0.0:
            self.overruns += 1
        given_up = self.give_up() if self.late > self._patience else 0.0
        self._since += 1
        return given_up


@dataclass(frozen=True)
class LoopReport:
    """Timing of the loop since it was made.

    Attributes:
        t: simulated time [s].
        ticks: ticks taken on the schedule, without single steps.
        overruns: ticks that began more than one period late.
        worst_late, late: largest delay of a tick, and that of the last one [s].
        slipped: clock time given up because the machine stood still or the ships were set to another time [s].
        events: number of each kind, including events that are no longer kept.
    """

    t: float
    ticks: int
    overruns: int
    worst_late: float
    late: float
    slipped: float
    events: Mapping[str, int]


class Loop:
    """Ships stepped together in real time, tick by tick.

    Each tick applies the orders received since the last one (of several for one control the last counts), shows each
    ship to its witnesses, and steps it by one period.  An order holds until the next one.  All methods may be called
    from any thread.

    Attributes:
        vessels: the ships by name.
        rate: ticks per simulated second [Hz].
        paused: whether the loop is paused.
    """

    def __init__(
        self, plants: Sequence[Plant] | Mapping[str, Plant], rate: float, factor: float = 1.0, *,
        sensors: Suite | Mapping[str, Suite] | None = None, patience: float = math.inf, clock: Clock | None = None,
    ) -> None:  # fmt: skip
        """A loop at simulated time 0.

        Args:
            plants: ships, by name or by the names of their files (repeated names are numbered).
            rate: ticks per simulated second [Hz]; the period is a whole number of steps of each ship.
            factor: simulated time over clock time, 0.1 to 100, or infinite for as fast as possible.
            sensors: instruments of all ships, or by name.
            patience: time without orders after which a ship that had received one counts as stale [simulated s].
            clock: source of time; the clock of the machine by default.

        Raises:
            LoopError: no ships, a rate that does not fit, a factor out of range, sensors of an unknown ship.
            SensorError: an instrument for something that a ship does not have.
        """
        self._fleet = Fleet(plants, rate, sensors, patience)
        self.vessels: Mapping[str, Vessel] = self._fleet.vessels
        self.rate, self.paused = rate, False
        self._clock = clock or WallClock()
        self._schedule = Schedule(rate, factor, self._clock)
        self._schedule.hold()  # until `run`
        self._waiting = Waiting()
        self._keepers: dict[str, Keeper] = {}
        self._callbacks: list[Callable[[Loop], None]] = []
        self._lock, self._stopping = threading.RLock(), threading.Event()

    @property
    def t(self) -> float:
        """Simulated time [s]."""
        return self._fleet.t

    @property
    def k(self) -> int:
        """Ticks since the start of the simulated time."""
        return self._fleet.k

    @property
    def factor(self) -> float:
        """Simulated time over clock time."""
        return self._schedule.factor

    @property
    def events(self) -> tuple[Event, ...]:
        """The last 1000 events, oldest first."""
        with self._lock:
            return tuple(self._fleet.events)

    @property
    def report(self) -> LoopReport:
        """Timing since the loop was made."""
        s = self._schedule
        return LoopReport(self.t, s.ticks, s.overruns, s.worst, s.late, s.slipped, dict(self._fleet.counted))

    def readings(self, ship: str) -> Sequence[Reading]:
        """Readings of the instruments of a ship during the last tick."""
        return self._fleet.vessel(ship).readings

    def equip(self, ship: str, suite: Suite) -> None:
        """Install instruments in place of those of a ship; SensorError: one for something that it does not have."""
        with self._lock:
            self._fleet.equip(ship, suite)

    def order(self, ship: str, control: str, value: float) -> None:
        """Order a control from the next tick on; CommandError: no such ship or control, or not a finite number."""
        plant = self._fleet.vessel(ship).plant
        if control not in plant.orders:
            raise CommandError(f"{ship}: {unknown(control, plant.orders, 'control')}")
        if not math.isfinite(value):
            raise CommandError(f"{ship}: {control} ordered to {value}; give a finite number")
        with self._lock:
            self._waiting.orders.pop((ship, control), None)  # so that the latest order is applied last
            self._waiting.orders[ship, control] = float(value)

    def surround(self, ship: str, environment: Environment) -> None:
        """Set wind, current, waves and depth at a ship from the next tick on; CommandError if one is not finite."""
        self._fleet.vessel(ship)
        if not all(math.isfinite(float(value)) for value in environment):
            raise CommandError(f"{ship}: wind, current, waves and depth must be finite numbers")
        with self._lock:
            self._waiting.around[ship] = environment

    def witness(self, ship: str, witness: Witness) -> None:
        """Show a ship to a witness from the next tick on; a witness that raises is removed."""
        self._fleet.vessel(ship)
        with self._lock:
            self._fleet.witnesses.append((ship, witness))

    def dismiss(self, witness: Witness) -> None:
        """Remove a witness."""
        with self._lock:
            self._fleet.witnesses[:] = [pair for pair in self._fleet.witnesses if pair[1] is not witness]

    def after(self, callback: Callable[[Loop], None]) -> None:
        """Call a listener after each tick; a listener that raises is removed."""
        with self._lock:
            self._callbacks.append(callback)

    def keep(self, name: str, keeper: Keeper) -> None:
        """Save, restore and reset a component with the ships; a repeated name is numbered from 2."""
        with self._lock:
            same = sum(one.partition(" #")[0] == name for one in self._keepers)
            self._keepers[f"{name} #{same + 1}" if same else name] = keeper

    def run(self, duration: float = math.inf) -> LoopReport:
        """Run on the schedule until `stop`, or for a simulated time [s]."""
        self._stopping.clear()
        end = self.k + duration * self.rate - 1e-6
        while not self._stopping.is_set() and self.k < end:
            with self._lock:
                left = self._turn()
            if left > 0.0 or math.isinf(self._schedule.factor):
                self._clock.sleep(min(left, _NAP))  # a wait of zero still lets other threads run
        with self._lock:
            self._schedule.hold()
        return self.report

    def stop(self) -> None:
        """End `run` after the present tick."""
        self._stopping.set()

    def pause(self) -> None:
        """Pause the loop."""
        with self._lock:
            self.paused = True
            self._schedule.hold()

    def resume(self) -> None:
        """Continue; the time of the pause is not made up for, earlier delays are."""
        with self._lock:
            self.paused = False

    def step(self) -> None:
        """Take one tick now, regardless of the schedule; for a loop that is paused or does not run."""
        with self._lock:
            self._tick()

    def pace(self, factor: float) -> None:
        """Change the time factor; LoopError if it is neither between 0.1 and 100 nor infinite."""
        with self._lock:
            self._schedule.pace(factor)

    def reset(self) -> None:
        """Return ships, instruments, time and keepers to the initial state; waiting orders are discarded."""
        with self._lock:
            for vessel in self.vessels.values():
                vessel.plant.reset()
                if vessel.watch is not None:
                    vessel.watch.reset()
            for keeper in self._keepers.values():
                keeper.reset()
            self._waiting = Waiting()
            self._fleet.arrive(0)
            self._note(self._schedule.give_up())

    def snapshot(self) -> bytes:
        """The complete state: ships, instruments, keepers, and waiting orders."""
        with self._lock:
            return packed(self._fleet, self._keepers, self._waiting)

    def restore(self, saved: bytes) -> None:
        """Restore the result of `snapshot`, of the same ships at the same rate with the same keepers.

        Raises:
            ShipError, SensorError: saved from another loop; this one is then unchanged.
        """
        with self._lock:
            before = self.snapshot()
            try:
                found = unpacked(saved, self._fleet, self._keepers)
            except ValueError:
                unpacked(before, self._fleet, self._keepers)
                raise
            self._waiting, self._fleet.patience = found.waiting, found.patience
            self._fleet.arrive(found.k, found.known)
            self._note(self._schedule.give_up())

    def tell(self, ship: str, kind: str, text: str) -> None:
        """Record an event of a component beside the loop (a wire, a page)."""
        with self._lock:
            self._fleet.tell(ship, kind, text)

    def _turn(self) -> float:
        """Take a tick if one is due; returns a lower bound of the time until the next one [s]."""
        if self.paused:
            return _NAP
        self._schedule.release()
        left = self._schedule.left()
        if left <= 0.0:
            self._note(self._schedule.begin())
            self._tick()
        return left

    def _tick(self) -> None:
        fleet = self._fleet
        waiting, self._waiting = self._waiting, Waiting()
        for (ship, control), value in waiting.orders.items():
            fleet.obey(ship, control, value)
        for ship, environment in waiting.around.items():
            fleet.vessels[ship].plant.surround(environment)
        fleet.move()
        for callback in tuple(self._callbacks):
            try:
                callback(self)
            except Exception as error:
                self._callbacks.remove(callback)
                fleet.tell("", "dropped", f"a listener failed: {error}")

    def _note(self, given_up: float) -> None:
        if given_up > 0.0:
            self._fleet.tell("", "slipped", f"{given_up:.3g} s of clock time are given up and not made up for")
