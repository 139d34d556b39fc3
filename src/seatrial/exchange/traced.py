"""A ship traced once for all exports: right-hand side, step and actuators as CasADi functions."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import Any

import casadi as ca

from ..actuators import queue_length
from ..core.parameters import Spec, walk
from ..core.symbolic import Function
from ..core.values import dataclass, replace
from ..engine.trace import preparation, right_hand_side
from ..environment import CHANNELS
from ..manoeuvres import Given
from ..models import Sampled, Stepped, unit
from ..ships import Ship, ShipError
from ..simulate.loop import closed_loop, loop_values, open_loop
from .writing import title

ABOUT = {
    "x": "position north", "y": "position east", "psi": "heading, clockwise from north",
    "u": "velocity ahead over ground", "v_m": "velocity to starboard over ground, at midship", "r": "yaw rate",
    "phi": "heel, starboard side down", "p": "roll rate, starboard side down",
    "wind_x": "true wind speed times cosine of where it comes from", "wind_y": "the same with the sine",
    "current_x": "velocity of the water northwards", "current_y": "velocity of the water eastwards",
    "wave_x": "significant height times cosine of where the waves come from", "wave_y": "the same with the sine",
    "wave_T": "mean period of the waves, 0 without waves", "per_depth": "one over the water depth, 0 in deep water",
}  # fmt: skip
"""What the header of an exported source says of each state."""
_MOST_WAITING = 1000
_ANY = (-math.inf, math.inf)
_UNITS = {"wind": "m/s", "current": "m/s", "wave_T": "s", "wave": "m", "per_depth": "1/m"}


@dataclass(frozen=True)
class Variable:
    """One element of an input or output: name, unit, meaning, and limits: of the actuator, or where the model holds."""

    name: str
    unit: str
    about: str
    low: float = -math.inf
    high: float = math.inf

    def __post_init__(self) -> None:
        if not self.name.isprintable():  # it goes into sources, where a line break would end a comment
            raise ShipError(f"{self.name!a}: a name with control characters is not exported")

    @property
    def limits(self) -> str:
        """The limits in words; nothing where there are none."""
        bounded = math.isfinite(self.low) or math.isfinite(self.high)
        return f", {self.low:g} to {self.high:g}" if bounded else ""


@dataclass(frozen=True)
class Number:
    """One parameter with its value in SI and where it comes from."""

    path: str
    value: float
    unit: str
    about: str
    source: str


@dataclass(frozen=True)
class Servos:
    """The actuators over one step of `dt` seconds.

    Attributes:
        dt: length of the step [s]; dead times are queues of orders of that length.
        memory: what they remember: per control the actual value, then what else, then the orders that wait.
        start: where the actual value of each control stands in `memory`.
        numbers: limits, rates and lags.
        open: function (a, o, p) -> (u, a_next); u is what acts over the step.
    """

    dt: float
    memory: tuple[Variable, ...]
    start: tuple[int, ...]
    numbers: tuple[Number, ...]
    open: Function

    @property
    def baked(self) -> Function:
        """Function (a, o) -> (u, a_next) with the numbers in place."""
        a, o = ca.SX.sym("a", len(self.memory)), ca.SX.sym("o", len(self.start))
        outputs = self.open(a, o, ca.DM([n.value for n in self.numbers]))
        return ca.Function("actuate", [a, o], [ca.densify(y) for y in outputs], ["a", "o"], ["u", "a_next"])


@dataclass(frozen=True)
class Equations:
    """What is exported of a ship.

    Attributes:
        name: an identifier in C and Python.
        title: name of the ship, in one line.
        states, controls, environment: the elements of x, u and e.
        numbers: the parameters of the model.
        open: function (x, u, e, p) -> dx, p in the order of `numbers`; None of a network.
        servos: the actuators, where a length of the step was given.
    """

    name: str
    title: str
    states: tuple[Variable, ...]
    controls: tuple[Variable, ...]
    environment: tuple[Variable, ...]
    numbers: tuple[Number, ...]
    open: Any
    servos: Servos | None

    @property
    def rates(self) -> Function:
        """Function (x, u, e) -> dx with the numbers in place."""
        x, u, e = self._symbols()
        dx = self.open(x, u, e, ca.DM([n.value for n in self.numbers]))
        return ca.Function(f"{self.name}_rates", [x, u, e], [_tidy(dx)], ["x", "u", "e"], ["dx"])

    @property
    def step(self) -> Function:
        """Function (x, u, e, dt) -> x_next: Runge-Kutta of fourth order with u and e held."""
        (x, u, e), dt, f = self._symbols(), ca.SX.sym("dt"), self.rates
        ends = [x, u, e, dt]
        return ca.Function(f"{self.name}_step", ends, [_tidy(_rk4(f, *ends))], ["x", "u", "e", "dt"], ["x_next"])

    @property
    def ordered_step(self) -> Function | None:
        """Function (x, a, o, e) -> (x_next, a_next) over `servos.dt`; None without servos."""
        if self.servos is None:
            return None
        x, _, e = self._symbols()
        a, o = ca.SX.sym("a", len(self.servos.memory)), ca.SX.sym("o", len(self.controls))
        acting, after = self.servos.baked(a, o)
        x_next = _rk4(self.rates, x, acting, e, self.servos.dt)
        names = ["x", "a", "o", "e"], ["x_next", "a_next"]
        return ca.Function(f"{self.name}_ordered_step", [x, a, o, e], [_tidy(x_next), _tidy(after)], *names)

    def _symbols(self) -> list[Any]:
        groups = zip("xue", (self.states, self.controls, self.environment), strict=True)
        return [ca.SX.sym(letter, len(names)) for letter, names in groups]


def equations_of(ship: Ship, dt: float | None = None) -> Equations:
    """The equations of a ship.

    Args:
        ship: any ship in continuous time.
        dt: length of the step behind the actuators [s]; None leaves the actuators out.

    Raises:
        ShipError: a model in discrete time; a step that is not above zero.
    """
    if isinstance(ship.model, Stepped):
        ways = "--python FILE exports its steps, --fmu FILE.fmu a slave"
        raise ShipError(f"{ship.name}: a network has no symbolic right-hand side; {ways}")
    if isinstance(ship.model, Sampled):
        family = type(ship.model).__name__
        raise ShipError(f"{ship.name}: {family} is a model in discrete time and has no right-hand side to export")
    outlined = outline(ship, dt)
    system = open_loop(ship)
    traced = right_hand_side(system)
    known = _numbers(ship, system.parameters)
    x, p = ca.SX.sym("x", len(system.states)), ca.SX.sym("p", len(known))
    u, e = ca.SX.sym("u", len(ship.model.controls)), ca.SX.sym("e", len(CHANNELS))
    offsets = [0.0] * (len(system.parameters) - len(known))  # of the current: a measured one comes by e
    dx = _tidy(traced(x, ca.vertcat(u, e), ca.vertcat(p, *offsets)))
    used, open_ = _used([x, u, e], p, [dx], known)
    return replace(outlined, numbers=used, open=open_)


def outline(ship: Ship, dt: float | None = None) -> Equations:
    """The equations without their right-hand side: what goes in and out, and the actuators over a step of `dt` [s].

    Raises:
        ShipError: a step that is not above zero.
    """
    if dt is not None and not (dt > 0.0 and math.isfinite(dt)):
        raise ShipError(f"{ship.name}: a step of {dt:g} s; it must be above zero")
    states = (Variable(n, unit(n), ABOUT.get(n, "state of the model's own"), *ship.validity.get(n, _ANY))
              for n in ship.model.states)  # fmt: skip
    return Equations(
        name=identifier(ship.name), title=one_line(title(ship)), states=tuple(states),
        controls=tuple(_control(ship, n) for n in ship.model.controls),
        environment=tuple(Variable(n, unit_around(n), ABOUT[n]) for n in CHANNELS),
        numbers=(), open=None, servos=None if dt is None else _servos(ship, dt),
    )  # fmt: skip


def _used(inputs: list[Any], p: Any, outputs: list[Any], known: tuple[Number, ...]) -> tuple[tuple[Number, ...], Any]:
    """The numbers that matter, and the function of them alone."""
    if not known:
        return (), ca.Function("open", [*inputs, p], outputs)
    bears = ca.which_depends(ca.vertcat(*outputs), p, 1, False)
    kept = [k for k, found in enumerate(bears) if found]
    fewer = ca.SX.sym("p", len(kept))
    full = ca.SX.zeros(len(known))
    for position, k in enumerate(kept):
        full[k] = fewer[position]
    replaced = ca.substitute(outputs, [p], [full])
    return tuple(known[k] for k in kept), ca.Function("open", [*inputs, fewer], [_tidy(y) for y in replaced])


def _numbers(ship: Ship, names: tuple[str, ...]) -> tuple[Number, ...]:
    found = {path: (meaning, value) for path, meaning, value in walk(ship.model)}
    return tuple(_number(name, *found[name], source_of(ship, name)) for name in names if name in found)


def _number(path: str, meaning: Spec, value: Any, source: str) -> Number:
    return Number(path, float(value), meaning.unit, meaning.about, source)


def source_of(ship: Ship, path: str) -> str:
    """Where a number of a ship comes from, in one line."""
    return one_line(ship.entries[path].source) if path in ship.entries else "default"


def _control(ship: Ship, name: str) -> Variable:
    servo, (low, high) = ship.actuators.of(name), ship.validity.get(name, _ANY)
    low, high = max(float(servo.low), low), min(float(servo.high), high)
    fastest = float(servo.rate)
    most = f"; changes by at most {fastest:.4g} {unit(name)} a second" if math.isfinite(fastest) else ""
    return Variable(name, unit(name), f"actual value of the control{most}", low, high)


def unit_around(name: str) -> str:
    """SI unit of a channel of the environment."""
    return next(u for start, u in _UNITS.items() if name.startswith(start))


def _rk4(f: Any, x: Any, u: Any, e: Any, dt: Any) -> Any:
    k = f(x, u, e)
    total = k
    for share in (0.5, 0.5, 1.0):
        k = f(x + share * dt * k, u, e)
        total = total + (k if share == 1.0 else 2.0 * k)
    return x + dt / 6.0 * total


def _tidy(y: Any) -> Any:
    return ca.cse(ca.densify(y))


def _servos(ship: Ship, dt: float) -> Servos:
    for name in ship.model.controls:
        waiting = queue_length(float(ship.actuators.of(name).dead_time), dt)
        if waiting > _MOST_WAITING:
            found = f"{waiting} orders of {name} waiting"
            raise ShipError(f"{ship.name}: a step of {dt:g} s keeps {found}; take a longer one")
    policy = Given(ship.model.controls)
    system, values = closed_loop(ship, policy, dt), loop_values(ship, policy)
    n, m = len(ship.model.controls), len(system.memory)
    own = [name for name in system.parameters if not name.startswith("ship.")]
    known = _limits(ship, own, values)
    a, o, p = ca.SX.sym("a", m), ca.SX.sym("o", n), ca.SX.sym("p", len(own))
    places = dict(zip(own, range(len(own)), strict=True))
    p_all = ca.vertcat(*(p[places[name]] if name in places else ca.SX(values[name]) for name in system.parameters))
    rest = ca.SX.zeros(len(system.states))
    joined = preparation(system)(0.0, dt, rest, a, ca.vertcat(ca.SX.zeros(len(CHANNELS)), o), p_all)  # type: ignore[misc]
    acting, after = joined[:n], joined[n + len(CHANNELS) : n + len(CHANNELS) + m]
    used, open_ = _used([a, o], p, [_tidy(acting), _tidy(after)], known)
    start = tuple(system.memory.index(name) for name in ship.model.controls)
    return Servos(dt, tuple(_remembered(name) for name in system.memory), start, used, open_)


def _limits(ship: Ship, names: list[str], values: Mapping[str, float]) -> tuple[Number, ...]:
    """The numbers of the actuators by ``<table>.<limit>``."""
    servos, free = ship.actuators.by_name.items(), Spec("", "as it comes")
    meanings = {f"{name}.{path}": meaning for name, servo in servos for path, meaning, _ in walk(servo)}
    return tuple(_number(n, meanings.get(n, free), values[n], source_of(ship, f"actuators.{n}")) for n in names)


def _remembered(name: str) -> Variable:
    control, _, rest = name.partition(".")
    if not rest:
        return Variable(name, unit(name), "actual value at the beginning of the step")
    if rest.startswith("order_"):
        return Variable(name, unit(control), "an order that waits, the oldest first")
    return Variable(name, "s" if rest == "pause_left" else "", "memory of the actuator")


def identifier(name: str) -> str:
    """A name as an identifier of C, Python and CasADi (no double underscores), in lower case."""
    text = re.sub(r"[\W_]+", "_", name, flags=re.ASCII).lower().strip("_")
    return text if re.match(r"[a-z]", text) else f"ship_{text}".rstrip("_")


def one_line(text: str) -> str:
    """Text without line breaks and control characters."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def elements(letter: str, variables: Iterable[Variable], indent: int = 4) -> list[str]:
    """Lines of a comment that say what each element of an array is."""
    return [f"{'':{indent}}{letter}[{k}]  {one.name} [{one.unit}]  {one.about}{one.limits}"
            for k, one in enumerate(variables)]  # fmt: skip


def docstring(text: Iterable[str]) -> list[str]:
    """Lines as the docstring of a Python module."""
    first, *rest = (line.replace("\\", "/").replace('"', "'") for line in text)
    return [f'"""{first}', *rest, '"""']
