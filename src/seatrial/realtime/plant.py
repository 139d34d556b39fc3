"""The plant: ship, actuators and environment as one compiled step with its own state; environment and network steps.

`Surroundings` gives the environment at each step: the weather, or values that were set since.  Weather that can be
evaluated at any time (gusts on a steady wind) is computed a few steps at a time, few enough that the linear algebra
stays on one thread, so a run of any length needs neither memory nor a pause.  Of other weather a long part is computed
beforehand, and twice as much each time it runs out.  Which part a step is taken from depends on its number alone, so a
run that is reproduced from the middle has the same weather to the last bit.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from ..core.parameters import unknown
from ..core.values import dataclass
from ..data import Array
from ..engine import SimulationError, System
from ..engine.rollout import Simulator
from ..engine.single import Stepper, stepper
from ..environment import CHANNELS, Environment, Uniform, Weather, through_water
from ..environment.grid import SMOOTH, Grid
from ..environment.weather import Gust, Together
from ..manoeuvres import Helm
from ..models import STATES, Sampled, Stepped
from ..models.settled import settled
from ..ships import Ship, ShipError
from ..simulate.approach import approach, time_step
from ..simulate.lanes import Kernel
from ..simulate.loop import closed_loop, loop_memory, loop_values
from ..simulate.place import Place
from ..study.grounds import Beyond, Grounds
from .helm import CommandError, Range, limits, obeying, ranges

__all__ = ["CommandError", "Compiled", "Plant"]

_FORMAT = "seatrial-plant/1"
_CHANNEL = {name: k for k, name in enumerate(CHANNELS)}


@dataclass(frozen=True)
class Compiled:
    """A ship traced and compiled once; each `plant` of it has a state of its own.

    Attributes:
        ship: the ship.
        dt: time step [s].
        ranges: range of each order.
        place: what surrounds the ship; None on open water.
    """

    ship: Ship
    dt: float
    kernel: Kernel
    ranges: Mapping[str, Range]
    place: Place | None = None

    @staticmethod
    def of(ship: Ship, dt: float, place: Place | None = None) -> Compiled:
        """Trace and compile, or take the kernel from the cache; ShipError: a step that does not fit.

        Args:
            place: what surrounds the ship (`simulate.place.place_of`): depth, banks, quays and lines; None: open water.
        """
        if not (dt > 0.0 and math.isfinite(dt)):
            raise ShipError(f"{ship.name}: a step of {dt:g} s; it must be above zero")
        if isinstance(ship.model, Sampled) and abs(dt / float(ship.model.dt) - 1.0) > 1e-9:
            raise ShipError(f"{ship.name}: runs at its own step of {ship.model.dt:g} s only; got {dt:g} s")
        system = closed_loop(ship, Helm(ship.model.controls), dt, place)
        return Compiled(ship, dt, Kernel(system), ranges(ship), place)

    def __reduce__(self) -> tuple[Any, ...]:
        # What is compiled stays in its process; another one takes it from the cache.
        return Compiled.of, (self.ship, self.dt, self.place)

    def plant(
        self, *, environment: Weather | None = None, start: Sequence[float] | None = None,
        n_P: float | None = None, seed: int = 0,
    ) -> Plant:  # fmt: skip
        """A plant of this ship; arguments as in `Plant.of`."""
        return Plant(self, environment or Uniform(), start, n_P, seed)


class Plant:
    """A ship that is simulated by one step of `dt` at a time.

    Any of `names` is read as ``plant["psi"]``: states, actual controls, ``<control>_cmd`` as ordered, and the channels
    of the environment; SI units and radians.

    Attributes:
        ship: the ship.
        dt: time step [s].
        k: steps taken since the start.
        names: values that can be read.
        controls: the controls of the ship.
        orders: names that can be ordered: controls, and n_P or delta where controls follow them.
        ranges: range of each order that has an effect.
        reach: range of each control, that of its gear where it has none as an order.
        seed: of the random parts (sensors).
        linkage: what the gear of a control receives for an order to it; None without a fault between the two.
        place: what surrounds it; the depth of the weather is not used where this has a chart.
        grounds: what the trials of its fit tested; None of a ship without a fit.
    """

    grounds: Grounds | None = None

    def __init__(
        self, compiled: Compiled, environment: Weather, start: Sequence[float] | None, n_P: float | None, seed: int
    ) -> None:
        ship = self.ship = compiled.ship
        self.dt, self.place, self.seed, self.k = compiled.dt, compiled.place, seed, 0
        self.linkage: Callable[[str, float], float] | None = None
        self.controls = ship.model.controls
        self._commands, self._origin = {f"{name}_cmd": name for name in self.controls}, (compiled, environment)
        system = compiled.kernel.system
        self.names = (*system.states, *self.controls, *self._commands, *CHANNELS)
        self._at = {name: system.stored.index(name) for name in (*system.states, *self.controls)}
        self._series = {name: k for k, name in enumerate(system.series)}
        self._obeying = obeying(ship)
        self.orders = tuple(self._obeying)
        self.ranges = compiled.ranges
        gear = {name: limits(ship, name) for name in self.controls}
        self.reach = {name: self.ranges.get(name) or Range(*gear[name], gear[name][1]) for name in self.controls}
        self._valid = tuple((n, self._at[n], *v) for n, v in ship.validity.items() if n in system.states)
        self._around = Surroundings(environment, self.dt)
        self._orders = dict.fromkeys(self.controls, 0.0)
        six, turns = self._start(start, n_P)
        policy = Helm(self.controls, turns)
        memory = loop_memory(ship, policy, self.dt, {"policy.n_P": turns}, six)
        acting = [memory[system.memory.index(control)] for control in self.controls]
        rest = settled(ship.model, np.array([[*acting, *self._around.values]], dtype=np.float64))[0]
        parameters = np.array(list(loop_values(ship, policy).values()), dtype=np.float64)
        made = partial(NetworkStep, ship) if isinstance(ship.model, Stepped) else stepper
        self._stepper: Stepper = made(compiled.kernel.forward, parameters, self.dt)
        self._stepper.load(np.array([*six, *rest[len(six) - len(STATES) :], *memory]))
        self._stepper.surround(self._around.at(0))
        for (order, factor), control in zip(ship.model.follows, self.controls, strict=True):
            low, high = gear[control]  # holds the initial speed, whatever the usual revolutions
            self._give(control, min(max(factor * turns if order == "n_P" else 0.0, low), high))
        self._first = self.snapshot()

    @staticmethod
    def of(
        ship: Ship, *, dt: float, environment: Weather | None = None, start: Sequence[float] | None = None,
        n_P: float | None = None, seed: int = 0, place: Place | None = None,
    ) -> Plant:  # fmt: skip
        """A plant of a ship.

        Args:
            ship: the ship.
            dt: time step [s]; a dead time is a queue of orders of that length.
            environment: weather, current, waves and depth; still air and still, deep water by default.
            start: initial (x, y, psi, u, v_m, r) over ground; by default at the origin, heading north at the
                approach speed through the water.
            n_P: initial and ordered revolutions [1/s]; by default those that hold the initial speed straight ahead,
                zero at rest.
            seed: of the sensors.
            place: as in `Compiled.of`.

        Raises:
            ShipError: an invalid time step or initial state.
        """
        return Compiled.of(ship, dt, place).plant(environment=environment, start=start, n_P=n_P, seed=seed)

    @property
    def t(self) -> float:
        """Time since the start [s]."""
        return self.k * self.dt

    @property
    def changing(self) -> bool:
        """Whether the environment changes by itself."""
        return self._around.changes

    def __getitem__(self, name: str) -> float:
        at = self._at.get(name)
        if at is not None:
            return self._stepper.now[at]
        if name in self._commands:
            return self._orders[self._commands[name]]
        at = _CHANNEL.get(name)
        if at is not None:
            if name == "per_depth" and self.place is not None and self.place.grid is not None:
                return self._sounded(self.place.grid)
            return self._around.values[at]
        raise KeyError(unknown(name, self.names, "value"))

    def _sounded(self, grid: Grid) -> float:
        """One over the depth of the chart where the ship is [1/m], as its forces have it."""
        here = (np.array([self._stepper.now[self._at[name]]]) for name in ("x", "y"))
        return float(grid.field.look(*here)[0][0, SMOOTH.index("chart.per_depth")])

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def order(self, name: str, value: float) -> float:
        """Order a control by its own name, or all that follow n_P or delta; returns the order as taken.

        An order holds until the next one and is clipped to its range.

        Raises:
            CommandError: no such control, or not a finite number.
        """
        if name not in self._obeying:
            raise CommandError(f"{self.ship.name}: {unknown(name, self._obeying, 'control')}")
        if not math.isfinite(value):
            raise CommandError(f"{self.ship.name}: {name} ordered to {value}; give a finite number")
        whole = self.ranges.get(name)
        taken = wanted = value if whole is None else whole.taken(value)
        for control, factor in self._obeying[name]:
            own = self.reach[control].taken(factor * wanted)
            self._give(control, own if self.linkage is None else self.linkage(control, own))
            taken = own / factor if factor else wanted
        return value if whole is not None and whole.all_round else taken

    def _give(self, control: str, value: float) -> None:
        self._orders[control] = value
        self._stepper.give(self._series[control], value)

    def surround(self, environment: Environment) -> None:
        """Set wind, current, waves and depth from now on; CommandError: a value that is not finite."""
        if not all(math.isfinite(float(value)) for value in environment):
            raise CommandError(f"{self.ship.name}: wind, current, waves and depth must be finite numbers")
        self._around.hold(environment)
        self._stepper.surround(self._around.at(self.k))

    def step(self) -> None:
        """Advance by one step; SimulationError if the ship blew up, after which the plant needs a `restore`."""
        stepper_ = self._stepper
        stepper_.step(self.k * self.dt)
        self.k += 1
        if self._around.changes:
            stepper_.surround(self._around.at(self.k))
        now = stepper_.now
        if not math.isfinite(now[0] + now[1] + now[2] + now[3] + now[4] + now[5]):
            name = next(n for n in STATES if not math.isfinite(self[n]))
            raise SimulationError(f"{self.ship.name}: {name} = {self[name]:g} at t = {self.t:g} s", self.t)

    def outside(self) -> tuple[str, float] | None:
        """The first state outside the range of validity in the ship file, and its value; None if all are inside.

        u and v_m are judged through the water, since that velocity acts on the hull.
        """
        now = self._stepper.now
        in_water: dict[str, float] = dict(zip(("u", "v_m"), self._in_water(now), strict=True))
        for name, at, low, high in self._valid:
            value = in_water.get(name, now[at])
            if not low <= value <= high:
                return name, value
        return None

    def untested(self) -> tuple[Beyond, ...]:
        """Where motion, controls, wind and depth are beyond what the trials of its fit tested."""
        if self.grounds is None:
            return ()
        per_depth = self["per_depth"]
        u, v_m = self._in_water(self._stepper.now)
        now = {"u": u, "v_m": v_m, "r": self["r"], **{name: self[name] for name in self.controls},
               "U_T": math.hypot(self["wind_x"], self["wind_y"]),
               "depth": 1.0 / per_depth if per_depth > 0.0 else math.inf}  # fmt: skip
        return self.grounds.left_by({name: np.array([value]) for name, value in now.items()})

    def _in_water(self, state: Sequence[float]) -> tuple[float, float]:
        psi, u, v_m = state[2:5]
        here = Environment(*self._around.values)
        if not math.isfinite(psi):
            return u, v_m
        return through_water(u, v_m, here.current_x, here.current_y, math.cos(psi), math.sin(psi))

    def snapshot(self) -> bytes:
        """The complete state: states, actuators, orders, surroundings and time."""
        values = self._stepper.dump()
        about = {"format": _FORMAT, "ship": self.ship.name, "dt": self.dt, "k": self.k, "around": self._around.steady,
                 "orders": self._orders, "values": len(values)}  # fmt: skip
        return json.dumps(about).encode() + b"\n" + values.astype("<f8").tobytes()

    def restore(self, saved: bytes) -> None:
        """Restore the result of `snapshot`; weather that changes by itself is not part of it and continues.

        Raises:
            ShipError: a snapshot of another ship or time step, or not a snapshot.
        """
        about, values = self._opened(saved)
        self.k = int(about["k"])
        self._stepper.load(values)
        self._around.hold(about["around"])
        for control, value in about["orders"].items():
            self._give(control, value)
        self._stepper.surround(self._around.at(self.k))

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (*self._origin, self.seed, self._first, self.snapshot(), self.linkage)

    def another(self) -> Plant:
        """The same ship in the same weather, with a state of its own, which `restore` takes from a `snapshot`."""
        return Plant(*self._origin, None, 0.0, self.seed)

    def begun(self, first: bytes) -> None:
        """Take a snapshot as the initial state, to which `reset` returns."""
        self.restore(first)
        self._first = first

    def reset(self) -> None:
        """Return to the initial state."""
        self.restore(self._first)

    def _opened(self, saved: bytes) -> tuple[Mapping[str, Any], Array]:
        head, _, body = saved.partition(b"\n")
        wanted = f"{self.ship.name} at steps of {self.dt:g} s"
        try:
            about: dict[str, Any] = json.loads(head)
            values = np.frombuffer(body, dtype="<f8").astype(np.float64)
            size = about["format"] == _FORMAT and about["values"] == len(values) == len(self._stepper.dump())
            same = about["ship"] == self.ship.name and about["dt"] == self.dt
            fits = size and same and set(about["orders"]) == set(self.controls)
        except (ValueError, KeyError, TypeError):
            raise ShipError(f"not a saved state of a ship; give one of {wanted}") from None
        if not fits:
            raise ShipError(f"saved state of {about['ship']} at steps of {about['dt']} s; give one of {wanted}")
        return about, values

    def _start(self, start: Sequence[float] | None, n_P: float | None) -> tuple[tuple[float, ...], float]:
        """The initial states that are given, six or more, and the revolutions."""
        ship, here = self.ship, Environment(*self._around.values)
        if start is None:
            turns = approach(ship)[1] if n_P is None else n_P
            return (0.0, 0.0, 0.0, ship.speed + here.current_x, here.current_y, 0.0), turns
        motion = ship.model.motion
        if len(start) not in (len(STATES), len(motion)) or not all(math.isfinite(value) for value in start):
            count = "six" if motion == STATES else "six or eight"
            raise ShipError(f"{ship.name}: a start is {count} finite numbers: {', '.join(motion)}")
        if n_P is None:
            through = self._in_water(start)[0]
            n_P = approach(ship, through)[1] if through > 1e-6 * max(ship.speed, 1.0) else 0.0
        return tuple(map(float, start)), n_P


def _again(
    compiled: Compiled, environment: Weather, seed: int, first: bytes, now: bytes,
    linkage: Callable[[str, float], float] | None,
) -> Plant:  # fmt: skip
    """A plant as another one was, in this process or another."""
    plant = compiled.plant(environment=environment, n_P=0.0, seed=seed)
    plant.begun(first)
    plant.restore(now)
    plant.linkage = linkage
    return plant


def rate_of(ship: Ship, wanted: float) -> float:
    """Tick rate [Hz]: the wanted one, or the greatest below it that a model in discrete time allows."""
    if not isinstance(ship.model, Sampled):
        return wanted
    dt = float(ship.model.dt)
    return 1.0 / (dt * max(round(1.0 / (wanted * dt)), 1))


def plant_of(
    ship: Ship, rate: float, weather: Weather, start: Sequence[float], seed: int, through_water: bool = True,
    place: Place | None = None,
) -> Plant:  # fmt: skip
    """A ship at a time step that divides the tick, 1/`rate` [s], and suits the ship.

    Args:
        start: initial (x, y, psi, u, v_m, r) [m, rad, m/s, rad/s].
        through_water: whether its velocities are through water; over ground otherwise.
        place: as in `Compiled.of`.
    """
    fitting = 1.0 / (rate * math.ceil(1.0 / (rate * time_step(ship)) - 1e-9))
    dt = float(ship.model.dt) if isinstance(ship.model, Sampled) else fitting
    x, y, psi, u, v_m, r = start
    if through_water:
        _, _, north, east, *_ = weather.series(dt, 1)[0].tolist()
        u, v_m = u + north * math.cos(psi) + east * math.sin(psi), v_m + east * math.cos(psi) - north * math.sin(psi)
    return Plant.of(ship, dt=dt, environment=weather, start=(x, y, psi, u, v_m, r), seed=seed, place=place)


_AT_A_TIME = 16
_AHEAD = 3600.0
"""Other weather is first computed this far ahead [s]."""


class Surroundings:
    """The channels of the environment, step by step.

    Attributes:
        values: the eight values at the step requested last.
        steady: the values if they are constant; None if they change.
    """

    def __init__(self, weather: Weather, dt: float) -> None:
        self._weather, self._dt = weather, dt
        self._first, self._rows = -1, np.zeros((0, len(CHANNELS)))
        always = len(weather.series(dt, 2)) == 1  # also refuses parts that do not fit together
        first = _window(weather, dt, 0, 1)
        self._local = first is not None
        self.values: list[float] = (weather.series(dt, 1) if first is None else first)[0].tolist()
        self.steady = self._always = tuple(self.values) if always else None

    @property
    def changes(self) -> bool:
        """Whether the values differ from step to step."""
        return self.steady is None

    def hold(self, values: tuple[float, ...] | Environment | None) -> None:
        """Set the values from now on; None returns to the weather."""
        self.steady = self._always if values is None else tuple(map(float, values))
        if self.steady is not None:
            self.values = list(self.steady)

    def at(self, k: int) -> Array:
        """The values at step `k`, shape (8,)."""
        if self.steady is not None:
            return np.array(self.steady)
        if not self._first <= k < self._first + len(self._rows):
            self._work_out(k)
        row = self._rows[k - self._first]
        self.values = row.tolist()
        return row

    def _work_out(self, k: int) -> None:
        """Compute the rows around step `k`."""
        first = k - k % _AT_A_TIME
        rows = _window(self._weather, self._dt, first, _AT_A_TIME) if self._local else None
        if rows is None:
            whole = math.ceil(_AHEAD / self._dt)
            last = whole << (k // whole).bit_length()
            first = 0 if last == whole else last // 2
            rows = self._weather.series(self._dt, last)[first:].copy()
        self._first, self._rows = first, rows


def _window(weather: Weather, dt: float, first: int, steps: int) -> Array | None:
    """Rows of some steps, for weather that can be evaluated at these alone; None for any other."""
    if isinstance(weather, Uniform):
        return np.broadcast_to(weather.series(dt, 1), (steps, len(CHANNELS)))
    if isinstance(weather, Gust) and isinstance(weather.base, Uniform):
        out = np.array(np.broadcast_to(weather.base.series(dt, 1), (steps, len(CHANNELS))))
        U = math.hypot(out[0, 0], out[0, 1])
        if U > 0.0:
            north, east = out[0, 0] / U, out[0, 1] / U
            along, across = weather.gusts(dt * np.arange(first, first + steps, dtype=np.float64), U)
            out[:, 0] += along * north - across * east
            out[:, 1] += along * east + across * north
        return out
    if isinstance(weather, Together) and weather.parts:
        parts = [part for one in weather.parts if (part := _window(one, dt, first, steps)) is not None]
        return np.sum(parts, axis=0) if len(parts) == len(weather.parts) else None
    return None


class NetworkStep:
    """Step of a model that moves on arrays, by Euler's rule at its own sample time; an `engine.single.Stepper`.

    Its hidden state is passed through, so a run can be saved at any step.
    """

    def __init__(self, ship: Ship, simulator: Simulator, parameters: Array, dt: float) -> None:
        self._model: Any = ship.model
        self._system: System = simulator.system
        self._before, self._parameters, self._dt = simulator.kernel.before, parameters, dt
        self._series = np.zeros(len(self._system.series))
        self._hidden: tuple[float, ...] = (0.0,) * len(self._system.hidden)
        self.now: Any = [0.0] * len(self._system.stored)

    def give(self, place: int, value: float) -> None:
        self._series[place] = value

    def surround(self, values: Array) -> None:
        self._series[: len(values)] = values

    def step(self, t: float) -> None:
        n, m, c = len(self._system.states), len(self._system.memory), len(self._model.controls)
        state, memory = self.now[:n], self.now[n : n + m]
        prepared = self._before(t, self._dt, state, memory or [0.0], self._series, self._parameters)
        y = np.array(prepared).ravel().tolist()
        na = len(self._system.acting)
        control, around = tuple(y[:c]), Environment(*y[c : c + len(CHANNELS)])
        rates, self._hidden = self._model.advance(tuple(state), control, around, self._hidden)
        moved = (*self._model.derivative(tuple(state), control, around)[:3], *rates)
        self.now = [*(z + self._dt * dz for z, dz in zip(state, moved, strict=True)), *y[na:]]

    def load(self, values: Array) -> None:
        given, own = values.tolist(), len(values) - len(self._hidden)
        self.now, self._hidden = [*given[:own], *self.now[own:]], tuple(given[own:])

    def dump(self) -> Array:
        own = len(self._system.states) + len(self._system.memory)
        return np.array([*self.now[:own], *self._hidden])
