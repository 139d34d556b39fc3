"""Several ships stepped together, tick by tick and without a clock, with a log of events; saving and restoring all."""

from __future__ import annotations

import base64
import binascii
import json
import math
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from itertools import count
from typing import Any, NamedTuple, Protocol

from ..core.errors import LoopError as LoopError
from ..core.parameters import unknown
from ..core.values import dataclass, field
from ..engine import SimulationError
from ..environment import Environment
from ..sensors import Reading
from ..sensors.seaway import Seen
from ..sensors.suite import Suite, Watch
from ..ships import ShipError
from .helm import CommandError, clipped
from .plant import Plant

_EVENTS = 1000
"""Number of events that are kept; older ones are only counted."""


class Witness(Protocol):
    """Observer of a ship, called at each tick after the orders are applied and before the step; a recording."""

    def see(self, plant: Plant) -> None:
        """Take note of the present state."""

    def jumped(self, plant: Plant) -> None:
        """The ship was set to another state."""


@dataclass(frozen=True)
class Event:
    """An event that the commander should know.

    Attributes:
        t: simulated time [s].
        ship: name in the loop; empty where the event concerns all ships.
        kind: clipped, stale, heard, outside, inside, untested, tested, failed, slipped or dropped.
        text: one line.
    """

    t: float
    ship: str
    kind: str
    text: str


class Vessel:
    """One ship of a loop: its plant, its instruments, and the status of its commander.

    Attributes:
        failure: why the ship is no longer stepped; None while it is.
        heard: simulated time of the last order [s]; None before the first.
        stale: whether the last order is older than the longest silence of a commander.
        clipped: orders that are beyond the limits at present.
        outside: a state outside the range of validity, if any.
        untested: whether it is beyond what the trials of its fit tested.
        readings: readings of the instruments during the last tick.
        altered: faults of the instruments: what the readings of a tick become; None without any.
        seen: the ship in a sea, as its instruments see it; None is calm.
    """

    def __init__(self, name: str, plant: Plant) -> None:
        self.name, self.plant = name, plant
        self.watch: Watch | None = None
        self.altered: Callable[[list[Reading]], list[Reading]] | None = None
        self.seen: Seen | None = None
        self.recall({})

    def known(self) -> dict[str, Any]:
        """The status, for JSON."""
        return {"failure": self.failure, "heard": self.heard, "stale": self.stale,
                "clipped": sorted(self.clipped), "outside": self.outside, "untested": self.untested}  # fmt: skip

    def recall(self, known: Mapping[str, Any]) -> None:
        """Restore the result of `known`; missing entries are cleared."""
        self.failure: str | None = known.get("failure")
        self.heard: float | None = known.get("heard")
        self.outside: str | None = known.get("outside")
        self.untested = bool(known.get("untested"))
        self.stale, self.clipped = bool(known.get("stale")), set[str](known.get("clipped", ()))
        self.readings: list[Reading] = []


class Fleet:
    """Ships stepped together.

    Attributes:
        rate: ticks per simulated second [Hz].
        k: ticks since the start.
        vessels: the ships by name.
        patience: time without orders after which a ship that had received one counts as stale [s].
        events, counted: the last events, and the number of each kind.
    """

    def __init__(
        self, plants: Sequence[Plant] | Mapping[str, Plant], rate: float, sensors: Suite | Mapping[str, Suite] | None,
        patience: float,
    ) -> None:  # fmt: skip
        named = dict(plants) if isinstance(plants, Mapping) else _named(plants)
        if not named:
            raise LoopError("a loop without ships; give at least one")
        if not (rate > 0.0 and math.isfinite(rate)):
            raise LoopError(f"a rate of {rate:g} Hz; it must be above zero and finite")
        if not patience > 0.0:
            raise LoopError(f"a patience of {patience:g} s; it must be above zero")
        self._steps = {name: _steps_a_tick(name, plant, rate) for name, plant in named.items()}
        suites = dict.fromkeys(named, sensors) if isinstance(sensors, Suite) else dict(sensors or {})
        self.vessels = {name: Vessel(name, plant) for name, plant in named.items()}
        for name, suite in suites.items():
            if name not in named:
                raise LoopError(f"sensors: {unknown(name, named, 'ship')}")
            self.equip(name, suite)
        self.rate, self.k, self.patience = rate, 0, patience
        self.events: deque[Event] = deque(maxlen=_EVENTS)
        self.counted: Counter[str] = Counter()
        self.witnesses: list[tuple[str, Witness]] = []

    @property
    def t(self) -> float:
        """Simulated time [s]."""
        return self.k / self.rate

    def vessel(self, ship: str) -> Vessel:
        """A ship by name; CommandError if there is none."""
        if ship not in self.vessels:
            raise CommandError(unknown(ship, self.vessels, "ship"))
        return self.vessels[ship]

    def equip(self, ship: str, suite: Suite) -> None:
        """Install instruments; SensorError: one for something that the ship does not have."""
        vessel = self.vessel(ship)
        suite.fit(vessel.plant, ship)
        vessel.watch = suite.start(vessel.plant.seed, list(self.vessels).index(ship))

    def tell(self, ship: str, kind: str, text: str) -> None:
        """Record an event."""
        self.counted[kind] += 1
        self.events.append(Event(self.t, ship, kind, text))

    def obey(self, ship: str, control: str, value: float) -> None:
        """Apply an order to a ship, clipped to the limits of its gear."""
        vessel = self.vessels[ship]
        taken = vessel.plant.order(control, value)
        if abs(taken - value) > 1e-12 * max(abs(value), 1.0):
            if control not in vessel.clipped:
                self.tell(ship, "clipped", clipped(vessel.plant.ship, control, value, taken))
            vessel.clipped.add(control)
        else:
            vessel.clipped.discard(control)
        vessel.heard = self.t
        if vessel.stale:
            vessel.stale = False
            self.tell(ship, "heard", "orders are received again")

    def move(self) -> None:
        """Show each ship to its witnesses and step it by one tick; a ship that blows up stays where it is."""
        self.show(lambda witness, plant: witness.see(plant))
        for name, vessel in self.vessels.items():
            vessel.readings = []
            if vessel.failure is None:
                try:
                    self._sail(vessel, self._steps[name])
                except SimulationError as error:
                    vessel.failure = str(error)
                    self.tell(name, "failed", vessel.failure)
        self.k += 1
        for vessel in self.vessels.values():
            self._look_after(vessel)

    def show(self, how: Callable[[Witness, Plant], None]) -> None:
        """Show running ships to their witnesses; a witness that raises is removed."""
        for pair in tuple(self.witnesses):
            vessel = self.vessels[pair[0]]
            if vessel.failure is None:
                try:
                    how(pair[1], vessel.plant)
                except Exception as error:
                    self.witnesses.remove(pair)
                    self.tell(pair[0], "dropped", f"a witness failed: {error}")

    def arrive(self, k: int, known: Mapping[str, Mapping[str, Any]] | None = None) -> None:
        """Continue at tick `k` with the states that the ships were set to, and the `known` status of each."""
        self.k = k
        for name, vessel in self.vessels.items():
            vessel.recall((known or {}).get(name, {}))
        self.show(lambda witness, plant: witness.jumped(plant))

    @staticmethod
    def _sail(vessel: Vessel, steps: int) -> None:
        plant, watch, readings, seen = vessel.plant, vessel.watch, vessel.readings, vessel.seen
        for _ in range(steps):
            plant.step()
            if watch is not None:
                readings += watch.read(plant.t, plant if seen is None else seen.at(plant.t))
        if vessel.altered is not None:
            readings[:] = vessel.altered(readings)

    def _look_after(self, vessel: Vessel) -> None:
        """Check the silence of the commander and the validity of the model; orders stay in force."""
        silence = 0.0 if vessel.heard is None else self.t - vessel.heard
        if silence > self.patience and not vessel.stale:
            vessel.stale = True
            self.tell(vessel.name, "stale", f"no order for {silence:.3g} s; the last orders hold")
        name, value = (vessel.plant.outside() if vessel.failure is None else None) or (None, 0.0)
        if name and not vessel.outside:
            self.tell(vessel.name, "outside", f"{name} = {value:.4g} is outside the range of validity")
        elif vessel.outside and not name and vessel.failure is None:
            self.tell(vessel.name, "inside", "back in the range of validity")
        vessel.outside = name
        if vessel.failure is None and self.k % max(round(self.rate), 1) == 0:  # each second is enough
            self._look_beyond(vessel)

    def _look_beyond(self, vessel: Vessel) -> None:
        """Check whether the ship is where the trials of its fit were."""
        found = vessel.plant.untested()
        if found and not vessel.untested:
            from ..report.judging.tested import reached

            self.tell(vessel.name, "untested", f"beyond the trials of the fit: {reached(found)}; no error is known")
        elif vessel.untested and not found:
            self.tell(vessel.name, "tested", "back where the trials of the fit were")
        vessel.untested = bool(found)


def _named(plants: Sequence[Plant]) -> dict[str, Plant]:
    """Ships by the names of their files; repeated names are numbered from 2."""
    found: dict[str, Plant] = {}
    for plant in plants:
        names = (f"{plant.ship.name}{'' if n == 1 else f'_{n}'}" for n in count(1))
        found[next(name for name in names if name not in found)] = plant
    return found


def _steps_a_tick(name: str, plant: Plant, rate: float) -> int:
    steps = 1.0 / (rate * plant.dt)
    if abs(steps - round(steps)) > 1e-6 * steps or round(steps) < 1:
        wanted = f"the time between two must be a whole number of its steps of {plant.dt:g} s"
        raise LoopError(f"{name}: {rate:g} ticks a second; {wanted}")
    return round(steps)


_FORMAT = "seatrial-loop/2"


class Keeper(Protocol):
    """A component beside a loop that affects how its ships continue (autopilot, wire, bridge); saved with the loop."""

    def snapshot(self) -> Any:
        """Its complete state, for JSON."""
        ...

    def restore(self, saved: Any) -> None:
        """Restore the result of `snapshot`; ValueError if that belongs to another."""

    def reset(self) -> None:
        """Return to the initial state."""


@dataclass
class Waiting:
    """Orders by ship and control, the latest last, and surroundings by ship, that the next tick applies."""

    orders: dict[tuple[str, str], float] = field(default_factory=dict[tuple[str, str], float])
    around: dict[str, Environment] = field(default_factory=dict[str, Environment])


class Saved(NamedTuple):
    """The rest of a saved loop: tick, status of each ship (`Vessel.known`), patience [s], and what waits."""

    k: int
    known: Mapping[str, Mapping[str, Any]]
    patience: float
    waiting: Waiting


def packed(fleet: Fleet, keepers: Mapping[str, Keeper], waiting: Waiting) -> bytes:
    """State of ships, instruments, keepers, and what waits for the next tick, as JSON."""
    ships = {
        name: [_text(vessel.plant.snapshot()), _text(vessel.watch.snapshot() if vessel.watch else b""), vessel.known()]
        for name, vessel in fleet.vessels.items()
    }
    return json.dumps({
        "format": _FORMAT, "k": fleet.k, "rate": fleet.rate, "ships": ships,
        "patience": fleet.patience if math.isfinite(fleet.patience) else None,
        "keepers": {name: keeper.snapshot() for name, keeper in keepers.items()},
        "orders": [[*who, value] for who, value in waiting.orders.items()],
        "around": {ship: [float(value) for value in around] for ship, around in waiting.around.items()},
    }).encode()  # fmt: skip


def unpacked(saved: bytes, fleet: Fleet, keepers: Mapping[str, Keeper]) -> Saved:
    """Restore ships, instruments and keepers, and return the rest; a keeper that was not saved is reset.

    Raises:
        ShipError, SensorError: saved from other ships, or not by `packed`; some are then restored already.
    """
    try:
        about: dict[str, Any] = json.loads(saved)
        ships = {name: (_bytes(plant), _bytes(watch), dict(known))
                 for name, (plant, watch, known) in about["ships"].items()}  # fmt: skip
        fits, kept = about["format"] == _FORMAT and about["rate"] == fleet.rate, dict(about["keepers"])
        patience = math.inf if about["patience"] is None else float(about["patience"])
        waiting = Waiting(
            {(str(ship), str(control)): float(value) for ship, control, value in about["orders"]},
            {str(ship): Environment(*map(float, around)) for ship, around in about["around"].items()},
        )
        rest = Saved(int(about["k"]), {name: known for name, (*_, known) in ships.items()}, patience, waiting)
    except (ValueError, KeyError, TypeError, AttributeError, binascii.Error):
        raise ShipError("not a saved loop; give the result of Loop.snapshot") from None
    if not fits or set(ships) != set(fleet.vessels):
        there, here = f"{', '.join(ships)} at {about['rate']} Hz", f"{', '.join(fleet.vessels)} at {fleet.rate:g} Hz"
        raise ShipError(f"saved loop of {there}; this one has {here}")
    for name in kept:
        if name not in keepers:
            raise ShipError(f"saved loop with {name}; this one has {', '.join(keepers) or 'no keeper'}")
    for name, (plant, watch, _) in ships.items():
        fleet.vessels[name].plant.restore(plant)
        own = fleet.vessels[name].watch
        if own is not None and watch:
            own.restore(watch)
        elif own is not None:  # installed after the snapshot
            own.reset()
    for name, keeper in keepers.items():
        _restore(name, keeper, kept)
    return rest


def _restore(name: str, keeper: Keeper, kept: Mapping[str, Any]) -> None:
    if name not in kept:
        keeper.reset()
        return
    try:
        keeper.restore(kept[name])
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise ShipError(f"not a saved loop: the state of {name} cannot be read ({error})") from None


def _text(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _bytes(text: str) -> bytes:
    return base64.b64decode(text, validate=True)
