"""A scenario in a loop: ships, weather, pilots, faults, contacts, alarms and criteria, each tick in this order."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ...core.errors import LoopError
from ...core.values import dataclass, replace
from ...data.nmea.ship import NULL_ISLAND, Fittings
from ...environment import CHANNELS, Environment
from ...environment.chart import Chart
from ...environment.sea import encountered
from ...models.common import Composed
from ...sensors.seaway import Seen
from ...sensors.suite import draught, usual
from ...ships import Ship
from ...simulate.place import Place, aground_or_inside, place_of
from ..bridge.soundings import Soundings
from ..bridge.view import OWN
from ..fleet import Vessel
from ..loop import Clock, LoneClock, Loop
from ..machinery import Machinery
from ..on_wire import FIRST, OnWire, Speech, exact, fitted
from ..plant import Plant, plant_of, rate_of
from ..recording import Recording, dated
from ..wave_filter import WaveFilter
from ..wire import ANYBODY, Authority, WireError
from ..wire import Line as Port
from .alerts import Alarms
from .contacts import Contacts
from .faults import Faults
from .handover import Handover
from .judge import Judge
from .pilots import Behaving, OwnPilot, TrafficPilot
from .reports import REPORTED, Reports
from .scenario import Sailing, Scenario
from .sky import Sky
from .wakes import Wakes

_SLOWEST = 0.4
"""Lowest frequency of a wave filter [rad/s]: the floor of trackers of the encounter; slower is the rudder's own."""

_TURN = 3.0
"""Distance before a waypoint at which the next leg counts, in ship lengths, as in `pilots`."""


@dataclass(frozen=True)
class Still:
    """Weather that stays as it is."""

    around: Environment

    def series(self, dt: float, steps: int) -> NDArray[np.float64]:
        """The channels, shape (1, 8)."""
        return np.array([self.around], dtype=np.float64).reshape(1, len(CHANNELS))


class Places:
    """Where ships sail on a chart, each kind of ship tabulated once."""

    def __init__(self, chart: Chart | None) -> None:
        self._chart, self._known = chart, dict[str, Place]()

    def of(self, name: str, ship: Ship, start: Sequence[float]) -> Place | None:
        """The place of a ship; None on open water, or for a family that has no forces of banks and quays.

        Raises:
            LoopError: it begins aground or in a wall.
        """
        if self._chart is None or not isinstance(ship.model, Composed):
            return None
        if ship.name not in self._known:
            self._known[ship.name] = place_of(ship, self._chart)
        place = self._known[ship.name]
        if wrong := aground_or_inside(place, tuple(start), draught(ship)):
            raise LoopError(f"{name}: {wrong}; begin elsewhere")
        return place


@dataclass(frozen=True)
class Line:
    """A wire, and how the own ship of a scenario uses it.

    Attributes:
        framed: as in `on_wire.Speech`.
        rates: sentences of the instruments and their rates [Hz]; None for the usual ones.
        only: sentences of `reports` that are sent.
        hold: longest silence of a commander [s].
        simulator: whether sentences are marked as those of a simulator.
        log: file for the sentences sent.
    """

    wire: Port
    framed: bool = False
    rates: Mapping[str, float] | None = None
    only: Sequence[str] = REPORTED
    hold: float = 10.0
    authority: Authority = ANYBODY
    simulator: bool = False
    log: BinaryIO | None = None


class Stage:
    """A scenario under way.

    Attributes:
        scenario: what is played.
        loop: the loop, with the own ship "own" and the others by their names in the scenario.
        fittings: of the own ship.
        on_wire: the own ship on its wire; None without one.
        pilot: track pilot of the own ship; None for a ship without a rudder, or without a pilot.
        faults, machinery, contacts, wakes, judge, alarms, handover, sky: as the modules of these names.
        soundings: of the chart; None on open water.
    """

    def __init__(
        self, scenario: Scenario, factor: float = math.inf, line: Line | None = None, page: bool = False,
        clock: Clock | None = None,
    ) -> None:  # fmt: skip
        """Set the stage at time 0.

        Args:
            factor: simulated over clock time.
            line: the wire, if there is one.
            page: whether a mariner at a page may steer.
            clock: of the loop; unless given that of the machine.

        Raises:
            LoopError: a ship that cannot be steered along its route, that begins aground or in a wall, or a rate that
                fits no ship.
            ChartError: a chart that cannot be tabulated for a ship.
            WireError: a sentence that the instruments cannot provide.
        """
        self.scenario = scenario
        own, ticks = scenario.own, rate_of(scenario.own.ship, scenario.rate)
        plants = _plants(scenario, ticks)
        plants[OWN].grounds = own.grounds
        self.fittings = self._fitted(plants[OWN], line)
        suite = usual(own.ship, own.antenna) if own.usual else exact(plants[OWN].controls, self.fittings, ticks)
        clock = clock or (None if page else LoneClock())
        self.loop = loop = Loop(plants, ticks, factor, sensors={OWN: suite}, clock=clock)
        route = own.sailing.legs
        self.sky = Sky(loop, scenario)
        self.soundings = Soundings(loop, scenario.chart) if scenario.chart is not None else None
        self._manned()
        self.faults = Faults(loop, OWN, scenario.faults)
        self.machinery = Machinery(loop, OWN, scenario.aboard)
        self.pilot = None
        if own.piloted and (own.sailing.route or "delta" in plants[OWN].ranges):
            _steerable(loop, OWN)
            self.pilot = OwnPilot(loop, OWN, route, True)
        self.contacts = Contacts(loop, OWN, scenario.limits.cpa, scenario.limits.tcpa)
        self.wakes = Wakes(loop, OWN)
        self.judge = Judge(loop, OWN, route, _TURN * own.ship.L_pp, scenario.criteria, self._keel)
        self.on_wire = self._connected(line)
        self.alarms = Alarms(loop, OWN, self.contacts, self.faults, scenario.limits, self._across, self._deaf,
                             self._keel)  # fmt: skip
        self.handover = self._helm(page)
        self._rock()
        if self.on_wire is not None and line is not None:
            self.reports = Reports(loop, self.on_wire, scenario, self.contacts, self.alarms, line.only)
            loop.after(self.on_wire.tick)

    def run(self, duration: float | None = None) -> None:
        """Run to the end: the last waypoint abeam, the own ship failed, or the duration over."""
        self.loop.after(self._end)
        self.loop.run((duration or self.scenario.duration) - self.loop.t)

    def record(self, path: Path) -> Recording:
        """Record the own ship to a new trial file."""
        meta = dated(self.fittings.epoch, self.scenario.datum)
        recording = Recording(self.own.plant, path, kind="afloat", meta=meta)
        self.loop.witness(OWN, recording)
        return recording

    @property
    def own(self) -> Vessel:
        """The own ship."""
        return self.loop.vessels[OWN]

    @property
    def digest(self) -> str:
        """Digest of the states of all ships to the last bit; equal where a run is the same."""
        found = hashlib.sha256()
        for name, vessel in self.loop.vessels.items():
            found.update(name.encode() + b"\0" + vessel.plant.snapshot())
        return found.hexdigest()[:16]

    def mmsi(self, name: str) -> int:
        """MMSI of another ship: its own, or one that no ship has."""
        other = next(one for one in self.scenario.others if one.name == name)
        return other.sailing.mmsi or FIRST + self.scenario.others.index(other)

    def _manned(self) -> None:
        """A pilot for each other ship; one without a rudder drifts, unless a route is asked of it."""
        for other in self.scenario.others:
            plant = self.loop.vessels[other.name].plant
            if self.scenario.chart is not None and plant.place is None:
                self.loop.tell(other.name, "chart", "its family knows no banks and quays; it feels the depth at most")
            if other.sailing.route or other.conduct is not None:
                _steerable(self.loop, other.name)
            if other.conduct is not None:
                continue
            if "delta" in plant.ranges:
                TrafficPilot(self.loop, other.name, other.sailing.legs)
            else:
                self.loop.tell(other.name, "drifts", f"{plant.ship.name} has no rudder to steer; it drifts freely")
        if conducts := {one.name: one.conduct for one in self.scenario.others if one.conduct is not None}:
            Behaving(self.loop, OWN, conducts)

    def _rock(self) -> None:
        """Let the instruments of the own ship see its motion in waves, and who steers by them filter it out."""
        sea, rao, vessel = self.scenario.sea, self.scenario.rao, self.own
        if sea is None or rao is None:
            return
        plant = vessel.plant
        vessel.seen = Seen(plant, sea, rao).at(plant.t)
        chi = sea.gamma_W + math.pi - plant["psi"]
        met = encountered(np.array([sea.spectrum.omega_P]), math.hypot(plant["u"], plant["v_m"]), chi)
        for one in (self.on_wire and self.on_wire.conning.control, self.pilot and self.pilot.control):
            if one is not None:
                one.filter = WaveFilter(max(abs(float(met[0])), _SLOWEST))

    def _end(self, loop: Loop) -> None:
        if self.judge.arrived is not None or loop.vessels[OWN].failure is not None:
            loop.stop()

    def _fitted(self, plant: Plant, line: Line | None) -> Fittings:
        scenario, ship = self.scenario, plant.ship
        fittings = Fittings(
            scenario.datum or NULL_ISLAND, scenario.epoch, stern=-0.5 * ship.L_pp, transducer=draught(ship),
            variation=scenario.variation, mmsi=scenario.own.sailing.mmsi,
            kind=scenario.own.sailing.kind, status=scenario.own.sailing.status,
            simulator=line is not None and line.simulator,
        )  # fmt: skip
        abaft = (-0.4 * ship.L_pp, 0.0) if scenario.own.usual else fittings.antenna
        return fitted(ship, replace(fittings, antenna=scenario.own.antenna or abaft))

    def _connected(self, line: Line | None) -> OnWire | None:
        if line is None:
            return None
        if self.scenario.others and "VDM" in line.only and find_spec("pyais") is None:
            raise WireError("other ships are reported by AIS, which needs the extra 'nmea': pip install "
                            "'seatrial[nmea]'; or leave VDM out of --only")  # fmt: skip
        speech = Speech(self.fittings, line.rates, line.framed)
        return OnWire(self.loop, OWN, line.wire, speech, log=line.log, hold=line.hold, authority=line.authority,
                      ticking=False)  # fmt: skip

    def _helm(self, page: bool) -> Handover:
        helm = Handover(self.loop, OWN, self.pilot, self.on_wire, page)
        if self.machinery.steers:
            helm.join("fmu", self.machinery)
        return helm

    def _across(self) -> float | None:
        """Distance from the route by the instruments [m]; None without a route or before the first readings."""
        return None if self.pilot is None or not self.scenario.own.sailing.route else self.pilot.across

    def _keel(self) -> float:
        """Water under the keel of the own ship by the chart [m]; infinite without one."""
        return math.inf if self.soundings is None else self.soundings.under(self.own.plant)

    def _deaf(self) -> bool:
        return self.on_wire is not None and self.on_wire.conning.stale

    def snapshot(self) -> bytes:
        """The state of everything."""
        return self.loop.snapshot()

    def told(self) -> list[Any]:
        """Events so far: time, ship, kind and text."""
        return [[round(e.t, 2), e.ship, e.kind, e.text] for e in self.loop.events]


def _plants(scenario: Scenario, ticks: float) -> dict[str, Plant]:
    """The ships by name, the own one first, in the weather of the start."""
    around, places, own = Still(scenario.first), Places(scenario.chart), scenario.own
    begin = {OWN: (own.ship, own.begun or _start(own.sailing))}
    begin |= {one.name: (one.ship, _start(one.sailing)) for one in scenario.others}
    return {
        name: plant_of(ship, ticks, around, start, scenario.seed, name != OWN or own.begun is None,
                       places.of(name, ship, start))
        for name, (ship, start) in begin.items()
    }  # fmt: skip


def _start(sailing: Sailing) -> tuple[float, ...]:
    return (sailing.x, sailing.y, sailing.psi, sailing.speed, 0.0, 0.0)


def _steerable(loop: Loop, name: str) -> None:
    if "delta" not in loop.vessels[name].plant.ranges:
        ship = loop.vessels[name].plant.ship.name
        raise LoopError(f"{name}: {ship} has no rudder to follow a route with; choose another ship, or pilot = 'none'")
