"""Virtual trials: simulated runs of a true ship, with weather and sensor noise, as a logger would record them.

A study with a table [virtual] has no files: its trials are made from a ship of the library, given what the
model under study lacks (wind with gusts, a lag of the rudder), and then recorded with noise.  Everything
random follows from one seed and the order of the trials, so a study is the same wherever it is run.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..actuators import Actuators
from ..core.parameters import ParameterError, unknown
from ..core.values import dataclass, field, fields, replace
from ..data import Array, DataError, Trial
from ..environment import Uniform, Weather
from ..environment.weather import Gust, WeatherError
from ..identify import StudyError
from ..identify.lint import tested
from ..manoeuvres import Manoeuvre, Settings
from ..models import STATES
from ..sensors import SensorError, Sensors
from ..ships import Ship, ShipError
from ..ships.classes import find_class
from ..ships.files import load
from ..simulate.run import approach, simulate

# Of revolutions, that the map of a bench needs.
_LEVELS = 3
_ANGLES = ("psi", "r", "delta", "alpha")
_AROUND = {"wind": ("U_T", "gamma_T"), "current": ("U_C", "gamma_C")}


@dataclass(frozen=True)
class Sail:
    """How one trial is sailed.

    Attributes:
        policy: the manoeuvre.
        speed: at the execute point [m/s]; None takes the ship's.
        duration: of the trial [s]; None takes that of all.
        current: speed [m/s] and where it flows to [rad]; None takes that of all.
    """

    policy: Manoeuvre
    speed: float | None = None
    duration: float | None = None
    current: tuple[float, float] | None = None


@dataclass(frozen=True)
class Bench:
    """A bollard pull of each thruster.

    Attributes:
        revolutions: levels [1/s].
        repeats: rows per level.
        noise: standard deviation of the load cell [N].
    """

    revolutions: tuple[float, ...]
    repeats: int = 1
    noise: float = 0.0


@dataclass(frozen=True)
class VirtualTrials:
    """Runs of a truth, as a logger on board would have recorded them.

    Attributes:
        ship: the truth, with every force and actuator that it has.
        sails: each trial by its name.
        wind: mean wind, and current; gusts blow on the wind, other in every trial.
        gusts: name of a spectrum of `weather.Gust`; empty leaves the wind steady.
        sensors: what the log adds to the states, the first sample included.
        seed: of gusts and noise.
        duration, sample, step: length, time between samples and time step of the truth [s]; Runge-Kutta.
        speed: at the execute point [m/s]; None takes the ship's.
        orders: whether the log holds the controls as ordered, so that the lag of an actuator stays hidden;
            if not, it holds both, the order as ``<control>_cmd``.
        known: which of "wind" and "current" the log tells.
        bench: of the thrusters of the truth; None where there is none.
    """

    ship: Ship
    sails: Mapping[str, Sail]
    wind: Uniform = field(default_factory=Uniform)
    gusts: str = ""
    sensors: Sensors = field(default_factory=Sensors)
    seed: int = 1
    duration: float = 600.0
    sample: float = 1.0
    step: float = 0.1
    speed: float | None = None
    orders: bool = True
    known: tuple[str, ...] = ()
    bench: Bench | None = None

    def run(self) -> tuple[Trial, ...]:
        """The trials, recorded, in the order of `sails`.

        Raises:
            SimulationError: the truth blows up or leaves its validity.
            SensorError: a sensor of a channel that is not there.
        """
        return tuple(self._trial(k, name) for k, name in enumerate(self.sails))

    def weather(self, number: int) -> Weather:
        """The weather of trial `number`."""
        current = tuple(self.sails.values())[number].current
        wind = self.wind if current is None else replace(self.wind, U_C=current[0], gamma_C=current[1])
        if not self.gusts:
            return wind
        return Gust(wind, self.gusts, int(np.random.SeedSequence([self.seed, number]).generate_state(1)[0]))

    def pulled(self) -> dict[str, tuple[Array, Array]]:
        """Revolutions [1/s] and pull [N] of each thruster on the bench, by its name; empty without a bench."""
        bench = self.bench
        if bench is None:
            return {}
        found: dict[str, tuple[Array, Array]] = {}
        model: Any = self.ship.model
        for number, (name, part) in enumerate(model.thrusters.items()):
            n = np.repeat(bench.revolutions, bench.repeats).astype(np.float64)
            pull = np.array([part.thrust(float(level)) for level in n])
            noise = np.random.default_rng([self.seed, number, 2]).normal(0.0, bench.noise, n.size)
            found[name] = (n, pull + noise)
        return found

    def _trial(self, number: int, name: str) -> Trial:
        sail = self.sails[name]
        run = simulate(
            self.ship, sail.policy, speed=self.speed if sail.speed is None else sail.speed, dt=self.step,
            duration=sail.duration or self.duration, every=round(self.sample / self.step),
            environment=self.weather(number), name=name,
        )  # fmt: skip
        controls = self.ship.model.controls
        if self.orders:
            # One that obeys at once acts as ordered, and is logged as the mean from row to row.
            held = run.meta.get("held", ())
            run = run.having(**{c: run[f"{c}_cmd"] for c in controls if f"{c}_cmd" in run and c not in held})
        orders = () if self.orders else (f"{c}_cmd" for c in controls)
        around = [name for what in self.known for name in _AROUND[what]]
        kept = {n: run[n] for n in (*STATES, *controls, *orders, *around) if n in run}
        logged = "ordered" if self.orders else "acting"
        told = f"virtual trial of {self.ship.name}, seed {self.seed}; controls as {logged}"
        meta = {k: v for k, v in run.meta.items() if k != "ship"} | {"source": told}
        return self.sensors.read(
            replace(run, channels=kept, meta=meta), np.random.default_rng([self.seed, number, 1])
        )  # fmt: skip


def virtual_trials(table: Any) -> tuple[VirtualTrials, tuple[Trial, ...]]:
    """The document and the trials of the table [virtual] of a study, whose angles are in degrees.

    Raises:
        StudyError: naming the key and what would be right.
    """
    try:
        source = read(table)
        return source, source.run()
    except (SensorError, WeatherError, DataError) as error:
        raise StudyError(f"virtual: {error}") from None


def read(table: Any) -> VirtualTrials:
    """The document behind [virtual], with the truth made but nothing run; for other seeds use `replace`."""
    ship = _truth(table)
    U, n_P = approach(ship)
    for key in ("duration", "sample", "step"):
        if not getattr(table, key) > 0:
            raise StudyError(f"virtual.{key} is {getattr(table, key):g} s; it must be above zero")
    ratio = table.sample / table.step
    if ratio < 1 or abs(ratio - round(ratio)) > 1e-9:
        raise StudyError(f"virtual.sample is {table.sample:g} s; a whole number of steps of {table.step:g} s is needed")
    sails = {
        name: Sail(
            _policy(name, one, ship, one.speed or table.speed or U, n_P), one.speed, one.duration, _flowing(one.current)
        )
        for name, one in table.trials.items()
    }
    known = tuple(_AROUND) if table.known is True else tuple(table.known or ())
    noise = {n: math.radians(v) if n.partition("_")[0] in _ANGLES else v for n, v in table.noise.items()}
    measured = (*STATES, *ship.model.controls)
    for name in noise:
        if name not in measured:
            raise StudyError(f"virtual.noise: {unknown(name, measured, 'channel')}")
    around = Uniform(
        table.wind.speed, math.radians(table.wind.from_), table.current.speed, math.radians(table.current.towards)
    )
    return VirtualTrials(
        ship, sails, around, table.wind.gusts, Sensors(noise=noise), table.seed, table.duration, table.sample,
        table.step, table.speed, table.orders, known, _bench(table.bench, ship),
    )  # fmt: skip


def _flowing(table: Any) -> tuple[float, float] | None:
    return None if table is None else (table.speed, math.radians(table.towards))


def _bench(table: Any, ship: Ship) -> Bench | None:
    if table is None:
        return None
    if not ship.model.takes("thrusters"):
        raise StudyError(f"virtual.bench: {ship.name} has no thrusters to pull at")
    bench = Bench(tuple(table.revolutions), table.repeats, table.noise)
    ahead = {n for n in bench.revolutions if n > 0}
    if len(ahead) < _LEVELS:
        raise StudyError(f"virtual.bench.revolutions has {len(ahead)} levels ahead; a map needs {_LEVELS} or more")
    return bench


def _truth(table: Any) -> Ship:
    ship = load(table.ship)
    if table.wind_force:
        if not ship.model.takes("wind"):
            raise StudyError(f"virtual.wind_force: the model of {ship.name} takes no force of wind")
        model: Any = ship.model
        ship = replace(ship, model=replace(model, wind=_wind_force(dict(table.wind_force))))
    elif table.wind.speed and ship.model.part("wind") is None:
        raise StudyError(f"virtual.wind: {ship.name} has no force of wind; give [virtual.wind_force]")
    servos: dict[str, Any] = dict(ship.actuators.by_name)
    for name, seconds in table.lag.items():
        if name not in servos:
            raise StudyError(f"virtual.lag: {unknown(name, servos, 'actuator')}")
        servos[name] = replace(servos[name], lag=seconds)
    return replace(ship, actuators=Actuators(servos))


def _wind_force(given: dict[str, Any]) -> Any:
    try:
        cls: Any = find_class(given.pop("type", None), "forces", "virtual.wind_force.type")
    except ShipError as error:
        raise StudyError(str(error)) from None
    known = {f.name: f for f in fields(cls)}
    for key, value in given.items():
        if key not in known:
            raise StudyError(f"virtual.wind_force: {unknown(key, known, 'key')}")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise StudyError(f"virtual.wind_force.{key} is {value!r}; it must be a number, in SI units")
    try:
        return cls(**{key: float(value) for key, value in given.items()})
    except TypeError as error:
        raise StudyError(f"virtual.wind_force: {error}") from None


def _policy(name: str, one: Any, ship: Ship, speed: float, n_P: float) -> Manoeuvre:
    where = f"virtual.trials.{name}"
    try:
        cls: Any = find_class(one.type, "manoeuvres", f"{where}.type")
    except ShipError as error:
        raise StudyError(str(error)) from None
    if Manoeuvre not in cls.__mro__:
        raise StudyError(f"{where}.type: {cls.__name__} is no manoeuvre")
    limit = float(ship.actuators.rudder.high)
    rudder = None if one.rudder is None else math.radians(abs(one.rudder))
    if rudder is not None and rudder > limit * (1 + 1e-9):
        most = math.degrees(limit)
        raise StudyError(f"{where}.rudder is {one.rudder:g} deg; the rudder of {ship.name} goes to {most:g} deg")
    heading = None if one.heading is None else math.radians(one.heading)
    side = -1.0 if (one.rudder or 0.0) < 0 else 1.0
    n_P = n_P if one.revolutions is None else one.revolutions
    most = {name: float(ship.actuators.of(name).high) for name in ship.model.controls}
    if one.revolutions is not None:
        for name, (low, high) in tested(ship).items():
            if not low <= one.revolutions <= high * (1 + 1e-9):
                raise StudyError(f"{where}.revolutions is {one.revolutions:g} 1/s; thrust by {name} of {ship.name} was "
                                 f"tested from {low:g} to {high:g} 1/s")  # fmt: skip
    bounded = {name: high for name, high in most.items() if math.isfinite(high)}
    settings = Settings(n_P, speed, ship.L_pp, limit, rudder, heading, side, one.seed, controls=bounded)
    known = [f.name for f in fields(cls)]
    for key in (key for key in one.set if key not in known):
        raise StudyError(f"{where}.set: {unknown(key, known, 'setting')}")
    try:
        return replace(cls.ordered(settings), **one.set)
    except (ParameterError, TypeError) as error:
        raise StudyError(f"{where}: {error}") from None
