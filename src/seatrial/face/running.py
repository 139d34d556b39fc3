"""Simulation from a script: an order, a manoeuvre or any policy to a `Run`."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from .. import data
from ..core.errors import MissingError, RequestError
from ..core.parameters import unknown, values
from ..core.values import dataclass, field, fields
from ..environment import Uniform
from ..manoeuvres import Index, Manoeuvre, Policy, decimals
from ..ships import Ship as AnyShip
from ..simulate.run import simulate as run_policy
from ..workflow.asked import Approach, Around, Orders, Span
from ..workflow.request import DEGREE, Note, Surroundings, ship_of, silent, surroundings
from ..workflow.simulation import simulate as simulated
from .orders import Order, Weather
from .tables import Cell, Table, Tabular, html, table_of
from .trials import Trial

_OPTIONS = {"--rudder": "rudder_deg", "--steer": "steer_percent", "--heading": "heading_deg", "--rps": "n_P",
            "--waves": "waves", "--wind": "wind", "--current": "current", "--gusts": "gusts", "--depth": "depth",
            "--side": "side", "--seed": "seed", "--speed": "speed", "--duration": "duration", "--dt": "dt"}  # fmt: skip
"""Options of the command line, which messages name, and what they are called here."""


@dataclass(frozen=True, repr=False)
class Indices(Tabular, Mapping[str, Index]):
    """The figures of a manoeuvre by name: ``run.indices["advance"].value`` in SI units and radians.

    Printed, and as a data frame, angles are in degrees, as the column of units says.
    """

    title: str
    found: Mapping[str, Index]

    def __getitem__(self, name: str) -> Index:
        if name not in self.found:
            near = unknown(name, self.found, "index") if self.found else f"no index '{name}'; there is none"
            raise MissingError(f"{self.title}: {near}")
        return self.found[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.found)

    def __len__(self) -> int:
        return len(self.found)

    @property
    def table(self) -> Table:
        """Value, unit and, for lengths, the value in ship lengths."""

        def row(name: str, index: Index) -> tuple[Cell, ...]:
            angle = index.unit.startswith("rad")
            per = DEGREE if angle else 1.0
            finest, value = index.resolution / per, index.value / per
            value = round(value, decimals(finest)) if finest else value
            return name, value, index.unit.replace("rad", "deg"), index.over_L

        rows = tuple(row(name, index) for name, index in self.found.items())
        return table_of(self.title, ("index", "value", "unit", "over L_pp"), rows)


@dataclass(frozen=True, eq=False, repr=False)
class Run(Trial):
    """A simulated run: a trial, with its ship, its policy and what can be read off.

    Attributes:
        ship: the ship that ran.
        policy: what steered it, in radians.
        settings: speed, revolutions, set points, time step and weather, in the units of the order.
        complete: whether the manoeuvre ended, or the duration was reached.
        reason: why it ended before; empty where it is complete.
        notes: what a user should know of the run, a line each.
    """

    ship: AnyShip = field(kw_only=True)
    policy: Policy = field(kw_only=True)
    settings: Mapping[str, object] = field(kw_only=True, default_factory=dict[str, object])
    complete: bool = field(kw_only=True, default=True)
    reason: str = field(kw_only=True, default="")
    notes: tuple[str, ...] = field(kw_only=True, default=())

    @property
    def breadth(self) -> float | None:
        """Breadth of the ship [m]; None where its model has none."""
        return values(self.ship.model).get("body.B")

    @property
    def indices(self) -> Indices:
        """The figures of the manoeuvre that the run reached; none for a policy that is no manoeuvre."""
        title = f"{self.ship.name}, {self.meta.get('kind', 'run')}{'' if self.complete else ', not complete'}"
        found = self.policy.indices(self, self.ship.L_pp) if isinstance(self.policy, Manoeuvre) else {}
        return Indices(title, found)

    def _repr_html_(self) -> str:
        return super()._repr_html_() + (html((self.indices.table,)) if isinstance(self.policy, Manoeuvre) else "")


def simulate(
    ship: str | Path | AnyShip, what: Order | Policy, *, speed: float | None = None, n_P: float | None = None,
    duration: float | None = None, dt: float | None = None, weather: Weather | None = None,
) -> Run:  # fmt: skip
    """Run a manoeuvre, from a steady straight run north, until it has all its indices.

    Args:
        ship: a name of the library, a ship file or a ship.
        what: an order in degrees such as ``Zigzag(rudder_deg=20, heading_deg=20)``, a manoeuvre of
            `seatrial.manoeuvres` in radians, or any other policy, which needs a duration.
        speed, n_P: approach speed [m/s] and revolutions [1/s]; one determines the other, and without both they are
            those of the ship.
        duration: length of the run [s].
        dt: time step [s]; None takes one that suits the ship.
        weather: wind, current, waves and depth; None is calm, deep water.

    Returns:
        The run; a Python warning tells of one that ended before its manoeuvre was complete.

    Raises:
        RequestError, ShipError: what cannot be run.
        SimulationError: a run that fails at its very beginning.
    """
    return told(ran(ship, what, speed, n_P, duration, dt, weather or Weather()))


def told(run: Run, level: int = 3) -> Run:
    """The run, after Python warnings of what is doubtful about it, `level` callers up."""
    doubtful = [line.removeprefix("warning: ") for line in run.notes if line.startswith("warning: ")]
    if not run.complete:
        doubtful.append(f"{run.name}: {run.reason}; indices that the run did not reach are left out")
    for line in doubtful:
        warnings.warn(line, stacklevel=level)
    return run


def ran(
    ship: str | Path | AnyShip, what: Order | Policy, speed: float | None, n_P: float | None,
    duration: float | None, dt: float | None, weather: Weather,
) -> Run:  # fmt: skip
    """As `simulate`, without a warning."""
    lines: list[str] = []
    try:
        vessel = ship_of(ship)
        if not isinstance(what, Order | Manoeuvre):
            return _steered(vessel, what, speed, duration, dt, weather, lines)
        options: dict[str, Any] = {"seed": weather.seed} if weather.gusts else {}
        options |= options_of(what) if isinstance(what, Order) else {}
        done = simulated(vessel, what.kind if isinstance(what, Order) else what, orders=Orders(**options),
                         begin=Approach(speed, n_P), span=Span(duration, dt), around=_around(weather),
                         note=lines.append)  # fmt: skip
    except RequestError as error:
        raise RequestError(here(str(error))) from None
    return Run(*_parts(done.trial), ship=done.ship, policy=done.policy, settings=done.settings,
               complete=done.complete, reason=done.reason or "", notes=tuple(map(here, lines)))  # fmt: skip


def _steered(
    ship: AnyShip, policy: Policy, speed: float | None, duration: float | None, dt: float | None, weather: Weather,
    lines: list[str],
) -> Run:  # fmt: skip
    if duration is None:
        raise RequestError(f"{type(policy).__name__} is no manoeuvre and has no end of its own; give a duration [s]")
    around = weather_of(ship, weather, lines.append).weather
    calm = isinstance(around, Uniform) and around == Uniform()
    trial = run_policy(ship, policy, speed=speed, duration=duration, environment=None if calm else around, dt=dt)
    return Run(*_parts(trial), ship=ship, policy=policy, notes=tuple(map(here, lines)))


def weather_of(ship: AnyShip, weather: Weather, note: Note = silent) -> Surroundings:
    """Weather as a simulation takes it.

    Raises:
        RequestError: what the ship has no force for, or what cannot be.
    """
    try:
        return surroundings(ship, _around(weather), weather.seed, note)
    except RequestError as error:
        raise RequestError(here(str(error))) from None


def _parts(trial: data.Trial) -> tuple[Any, ...]:
    return tuple(getattr(trial, f.name) for f in fields(data.Trial))


def options_of(order: Order) -> dict[str, Any]:
    """The settings of an order as the workflow takes them; those that are not given are left to the manoeuvre."""
    given = {f.name.removesuffix("_deg").removesuffix("_percent"): vars(order)[f.name] for f in fields(order)}
    return {name: value for name, value in given.items() if value is not None}


def _around(weather: Weather) -> Around:
    """Weather in the words of the command line; a number read back is the same number."""
    wind = f"{weather.wind!r},{weather.wind_from_deg!r}" if weather.wind else None
    current = f"{weather.current!r},{weather.current_towards_deg!r}" if weather.current else None
    sea = f"{weather.wave_height!r},{weather.wave_period!r},{weather.waves_from_deg!r}"
    waves = sea if weather.wave_height else None
    return Around(wind, weather.gusts, current, waves, weather.depth)


def here(line: str) -> str:
    """A message with the names of arguments in place of those of options."""
    for option, name in _OPTIONS.items():
        line = line.replace(option, name)
    return line
