"""The loop in real time: ships on a schedule that does not drift, orders from any thread, nothing hidden.

The state of a whole loop in one piece of bytes.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from ..core.parameters import unknown
from ..environment import Environment
from ..sensors import Reading
from ..sensors.suite import Suite
from .fleet import Event, Fleet, Keeper, LoopError, Vessel, Waiting, Witness, packed, unpacked
from .helm import CommandError
from .plant import Plant

__all__ = ["CommandError", "Event", "Loop", "LoopError", "LoopReport", "Vessel", "Witness"]

_NAP = 0.05
"""Longest wait at a time [s], so that a pause or a stop is heard."""


SLOWEST, FASTEST = 0.1, 100.0
"""Time factors between which a schedule is kept; beyond is only as fast as possible (infinite)."""


class Clock(Protocol):
    """Tells time and waits."""

    def now(self) -> float:
        """Time on a clock that never goes back [s]."""
        ...

    def sleep(self, seconds: float) -> None:
        """Wait."""
        ...


class WallClock:
    """The clock of the machine."""

    def now(self) -> float:
        """Time on a clock that never goes back [s]."""
        return time.perf_counter()

    def sleep(self, seconds: float) -> None:
        """Wait."""
        time.sleep(seconds)


class Schedule:
    """When the next tick is due, and how far behind the ticks have been.

    Late ticks are caught up with, all of them; only where the machine stood still for longer than `patience`, or the
    ships were taken to another time, the schedule begins anew, and what it gave up is told in `slipped`.

    Attributes:
        factor: simulated time over time on the clock; infinite is as fast as possible.
        period: time between two ticks [s on the clock].
        ticks: ticks counted since the start.
        overruns: ticks that began later than one period after they were due.
        worst: the latest beginning of a tick after it was due [s].
        late: that of the last tick [s].
        slipped: time given up altogether [s].
    """

    def __init__(self, rate: float, factor: float, clock: Clock, patience: float = 10.0) -> None:
        self._clock, self._rate, self._patience = clock, rate, patience
        self.ticks = self.overruns = 0
        self.worst = self.late = self.slipped = 0.0
        self._origin, self._since, self.period = 0.0, 0, 0.0
        self._held: float | None = None
        self.pace(factor)

    def pace(self, factor: float) -> None:
        """Go on with another time factor from now; as far from the next tick in simulated time as before.

        Raises:
            LoopError: not between 0.1 and 100, nor infinite.
        """
        if not (SLOWEST <= factor <= FASTEST or factor == math.inf):
            raise LoopError(f"time factor {factor:g}; give {SLOWEST:g} to {FASTEST:g}, or inf for the fastest")
        ticks = self.left() / self.period if self.period else 0.0
        self.factor, self.period = factor, 1.0 / (self._rate * factor)
        self._due_in(ticks * self.period)

    def hold(self) -> None:
        """Let time stand still; while there is a pause, or nobody runs."""
        if self._held is None:
            self._held = self.left()

    def release(self) -> None:
        """Go on, as far from the next tick as when it was held."""
        if self._held is not None:
            held, self._held = self._held, None
            self._due_in(held)

    def left(self) -> float:
        """Time until the next tick is due [s]; below zero where it is late."""
        if self._held is not None:
            return self._held
        if math.isinf(self.factor):
            return 0.0
        return self._origin + self._since * self.period - self._clock.now()

    def give_up(self) -> float:
        """Catch up with nothing that is late by more than a period; gives back the time given up, if any [s]."""
        late = -self.left()
        if late <= self.period:
            return 0.0
        self.slipped += late
        self._due_in(0.0)
        return late

    def begin(self) -> float:
        """Count a tick that begins now; gives back the time given up, if any [s]."""
        self.late = max(-self.left(), 0.0)
        self.ticks += 1
        self.worst = max(self.worst, self.late)
        if self.late > self.period > 0.0:
            self.overruns += 1
        given_up = self.give_up() if self.late > self._patience else 0.0
        self._since += 1
        return given_up

    def _due_in(self, seconds: float) -> None:
        """Let the next tick be due so much later than now."""
        if self._held is not None:
            self._held = seconds
        self._origin, self._since = self._clock.now() + seconds, 0


@dataclass(frozen=True)
class LoopReport:
    """How the loop has kept up since it was made.

    Attributes:
        t: simulated time [s].
        ticks: ticks taken on the schedule; single steps are not among them.
        overruns: ticks that began more than one period late.
        worst_late, late: how late the latest and the last tick began [s].
        slipped: time on the clock that was given up, as the machine stood still or the ships jumped in time [s].
        events: how many of each kind, the forgotten ones included.
    """

    t: float
    ticks: int
    overruns: int
    worst_late: float
    late: float
    slipped: float
    events: Mapping[str, int]


class Loop:
    """Ships under way together, tick by tick.

    Each tick takes in the orders that came since the last one (of several for one control the last counts), shows
    each ship to her witnesses, and moves her by the steps of one period.  Orders hold until the next.  All methods
    may be called from any thread.

    Attributes:
        paused: whether it waits.
    """

    def __init__(
        self, plants: Sequence[Plant] | Mapping[str, Plant], rate: float, factor: float = 1.0, *,
        sensors: Suite | Mapping[str, Suite] | None = None, patience: float = math.inf, clock: Clock | None = None,
    ) -> None:  # fmt: skip
        """A loop at simulated time 0.

        Args:
            plants: ships, by name or by the names of their files (numbered where one comes twice).
            rate: ticks per simulated second [Hz]; a whole number of steps of each ship fits between two.
            factor: simulated time over time on the clock, 0.1 to 100, or infinite for as fast as possible.
            sensors: instruments of all ships, or by name.
            patience: time without orders after which a ship that was commanded is called stale [simulated s].
            clock: what tells time; the machine's by default.

        Raises:
            LoopError: no ships, a rate that does not fit, a factor that cannot be, sensors of nobody.
            SensorError: instruments of what a ship does not have.
        """
        self._fleet = Fleet(plants, rate, sensors, patience)
        self._clock = clock or WallClock()
        self._schedule = Schedule(rate, factor, self._clock)
        self._schedule.hold()  # until somebody runs it
        self._waiting = Waiting()
        self._keepers: dict[str, Keeper] = {}
        self._callbacks: list[Callable[[Loop], None]] = []
        self._lock, self._stopping = threading.RLock(), threading.Event()
        self.paused = False

    @property
    def t(self) -> float:
        """Simulated time [s]."""
        return self._fleet.t

    @property
    def k(self) -> int:
        """Ticks since the start of the simulated time."""
        return self._fleet.k

    @property
    def rate(self) -> float:
        """Ticks per simulated second [Hz]."""
        return self._fleet.rate

    @property
    def factor(self) -> float:
        """Simulated time over time on the clock."""
        return self._schedule.factor

    @property
    def vessels(self) -> Mapping[str, Vessel]:
        """The ships by name."""
        return self._fleet.vessels

    @property
    def events(self) -> tuple[Event, ...]:
        """The last 1000 events, the oldest first."""
        with self._lock:
            return tuple(self._fleet.events)

    @property
    def report(self) -> LoopReport:
        """How it has kept up."""
        s = self._schedule
        return LoopReport(self.t, s.ticks, s.overruns, s.worst, s.late, s.slipped, dict(self._fleet.counted))

    def readings(self, ship: str) -> Sequence[Reading]:
        """What the instruments of a ship said during the last tick."""
        return self._fleet.vessel(ship).readings

    def equip(self, ship: str, suite: Suite) -> None:
        """Put instruments aboard a ship, in the place of those that she has.

        Raises:
            CommandError: no such ship.
            SensorError: instruments of what she does not have.
        """
        self._fleet.vessel(ship)
        with self._lock:
            self._fleet.equip(ship, suite)

    def order(self, ship: str, control: str, value: float) -> None:
        """Order a control of a ship from the next tick on.

        Raises:
            CommandError: no such ship or control, or not a finite number.
        """
        plant = self._fleet.vessel(ship).plant
        if control not in plant.orders:
            raise CommandError(f"{ship}: {unknown(control, plant.orders, 'control')}")
        if not math.isfinite(value):
            raise CommandError(f"{ship}: {control} ordered to {value}; give a finite number")
        with self._lock:
            self._waiting.orders.pop((ship, control), None)  # the last order comes last, whatever else it moves
            self._waiting.orders[ship, control] = float(value)

    def surround(self, ship: str, environment: Environment) -> None:
        """Let wind, current, waves and depth about a ship be these from the next tick on.

        Raises:
            CommandError: no such ship, or a value that is not finite.
        """
        self._fleet.vessel(ship)
        if not all(math.isfinite(float(value)) for value in environment):
            raise CommandError(f"{ship}: wind, current, waves and depth must be finite numbers")
        with self._lock:
            self._waiting.around[ship] = environment

    def witness(self, ship: str, witness: Witness) -> None:
        """Show a ship to somebody from the next tick on; who fails is left out from then on."""
        self._fleet.vessel(ship)
        with self._lock:
            self._fleet.witnesses.append((ship, witness))

    def dismiss(self, witness: Witness) -> None:
        """Show nothing more to somebody."""
        with self._lock:
            self._fleet.witnesses[:] = [pair for pair in self._fleet.witnesses if pair[1] is not witness]

    def after(self, callback: Callable[[Loop], None]) -> None:
        """Call somebody after each tick; who fails is left out from then on."""
        with self._lock:
            self._callbacks.append(callback)

    def keep(self, name: str, keeper: Keeper) -> None:
        """Let somebody who steers or watches be saved, restored and reset with the ships; a second of a name gets 2."""
        with self._lock:
            same = sum(one.partition(" #")[0] == name for one in self._keepers)
            self._keepers[f"{name} #{same + 1}" if same else name] = keeper

    def run(self, duration: float = math.inf) -> LoopReport:
        """Keep the schedule until `stop`, or for so much simulated time [s]."""
        self._stopping.clear()
        end = self.k + duration * self.rate - 1e-6
        while not self._stopping.is_set() and self.k < end:
            with self._lock:
                left = self._turn()
            if left > 0.0 or math.isinf(self._schedule.factor):
                self._clock.sleep(min(left, _NAP))  # if only to let the other threads in
        with self._lock:
            self._schedule.hold()
        return self.report

    def stop(self) -> None:
        """End `run` after the tick at hand."""
        self._stopping.set()

    def pause(self) -> None:
        """Wait from now on."""
        with self._lock:
            self.paused = True
            self._schedule.hold()

    def resume(self) -> None:
        """Go on; the time of the pause is not caught up with, what was late before it is."""
        with self._lock:
            self.paused = False

    def step(self) -> None:
        """Take one tick now, whatever the schedule says; for a loop that is paused or not run."""
        with self._lock:
            self._tick()

    def pace(self, factor: float) -> None:
        """Change the time factor.

        Raises:
            LoopError: not between 0.1 and 100, nor infinite.
        """
        with self._lock:
            self._schedule.pace(factor)

    def reset(self) -> None:
        """All ships back to their start, instruments, time and keepers as well; orders that wait are forgotten."""
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
        """Everything that decides how all ships go on: instruments, keepers, and the orders that wait."""
        with self._lock:
            return packed(self._fleet, self._keepers, self._waiting)

    def restore(self, saved: bytes) -> None:
        """Go on from what `snapshot` gave; of the same ships at the same rate, with the same keepers.

        Raises:
            ShipError, SensorError: saved of others; the loop is then as it was.
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
        """Put an event on record, of somebody beside the loop (a wire, a page)."""
        with self._lock:
            self._fleet.tell(ship, kind, text)

    def _turn(self) -> float:
        """Take a tick where one is due; the time until the next one, at least [s]."""
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
            fleet.surround(ship, environment)
        fleet.move()
        for callback in tuple(self._callbacks):
            try:
                callback(self)
            except Exception as error:
                self._callbacks.remove(callback)
                fleet.tell("", "dropped", f"a listener failed: {error}")

    def _note(self, given_up: float) -> None:
        if given_up > 0.0:
            self._fleet.tell("", "slipped", f"{given_up:.3g} s on the clock are given up and not caught up with")
