"""Systems for the engine: a ship under given controls, or ship, actuators and policy in one step."""

from __future__ import annotations

from collections.abc import Callable, Container, Hashable, Iterable, Mapping
from functools import lru_cache, reduce
from operator import add
from typing import Any

import numpy as np

from ..actuators import Servo, Shaft, queue_length, queued, table
from ..core.parameters import Parts, Scalar, Spec, Terms, specs, unknown, update, values
from ..core.values import dataclass, fields, is_dataclass, replace
from ..data import Array
from ..engine import Scalars, System
from ..environment import CHANNELS, PLACE, Environment
from ..environment.grid import SMOOTH
from ..manoeuvres import Policy, Scheduled
from ..models import Sampled, Stepped, kinematics, unit
from ..ships import Ship, ShipError
from .place import Place

_VELOCITIES = ("rate_u", "rate_v_m", "rate_r")
_OFFSETS = ("current_x", "current_y")


def _split(names: tuple[str, ...], given: Scalars, prefix: str) -> dict[str, Any]:
    return {n[len(prefix):]: v for n, v in zip(names, given, strict=True) if n.startswith(prefix)}  # fmt: skip


def _rates(model: Any, state: Scalars, acting: Scalars) -> Scalars:
    """Rates of any model: those of a sampled one follow controls and environment in `acting`."""
    n = len(model.controls)
    if isinstance(model, Sampled):
        return (*kinematics(state[2], *state[3:6]), *acting[n + len(CHANNELS) :])
    return model.derivative(state, acting[:n], Environment(*acting[n:]))


class _Equations:
    """A system yet to be built, equal to every other whose equations are the same but for the numbers of parameters."""

    def __init__(self, build: Callable[[], System], *parts: Hashable) -> None:
        self.build, self.parts, self.mark = build, parts, hash(parts)

    def __hash__(self) -> int:
        return self.mark

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Equations) and self.parts == other.parts


@lru_cache(maxsize=64)
def _built(equations: _Equations) -> System:
    return equations.build()


def _structure(thing: Any, free: Container[str], prefix: str) -> Hashable:
    """What the equations of a model, a servo or a policy depend on besides the numbers named in `free`.

    Raises:
        TypeError: a part that cannot be compared by its value, as an array.
    """
    if isinstance(thing, float):
        return thing.hex()  # tells zeros by their sign, and NaN is itself
    if isinstance(thing, Terms | Parts):
        items: Iterable[tuple[str, Any]] = thing.items()
    elif is_dataclass(thing) and not isinstance(thing, type):
        items = ((f.name, getattr(thing, f.name)) for f in fields(thing))
    else:
        hash(thing)
        return type(thing), thing
    return type(thing), tuple(
        (name, None if f"{prefix}{name}" in free else _structure(value, free, f"{prefix}{name}."))
        for name, value in items
    )


def open_loop(ship: Ship) -> System:
    """The ship under given controls and environment; parameters are those of its model.

    Ships that differ in the numbers of parameters only have one system, which is traced once.
    """
    if isinstance(ship.model, Stepped):
        return _stepped(ship)
    names = tuple(_free_values(ship.model))
    try:
        return _built(_Equations(lambda: _open_loop(ship, names), names, _structure(ship.model, frozenset(names), "")))
    except TypeError:  # a model with arrays is not compared
        return _open_loop(ship, names)


def _open_loop(ship: Ship, names: tuple[str, ...]) -> System:
    n = len(ship.model.controls)
    sampled = ship.model if isinstance(ship.model, Sampled) else None

    def model_of(parameters: Scalars) -> Any:
        return update(ship.model, dict(zip(names, parameters[: len(names)], strict=True)))

    def drifting(acting: Scalars, parameters: Scalars) -> Scalars:
        """The environment plus an unmeasured current."""
        around = Environment(*acting[n : n + len(CHANNELS)])
        east, north = around.current_y + parameters[-1], around.current_x + parameters[-2]
        around = around._replace(current_x=north, current_y=east)
        return (*acting[:n], *around, *acting[n + len(CHANNELS) :])

    def derivative(state: Scalars, acting: Scalars, parameters: Scalars) -> Scalars:
        return _rates(model_of(parameters), state, drifting(acting, parameters))

    def before(
        t: Any, dt: Any, state: Scalars, memory: Scalars, series: Scalars, parameters: Scalars
    ) -> tuple[Scalars, Scalars, Scalars]:
        acting = drifting(series, parameters)
        rates, memory = model_of(parameters).advance(state, acting[:n], Environment(*acting[n:]), memory)
        return (*series, *rates), memory, ()

    series = (*ship.model.controls, *CHANNELS)
    return System(
        states=ship.model.states, series=series, derivative=derivative,
        parameters=names + tuple(f"environment.{name}" for name in _OFFSETS),
        memory=sampled.memory if sampled else (), acting=series + _VELOCITIES if sampled else (),
        before=before if sampled else None,
    )  # fmt: skip


def _stepped(ship: Ship) -> System:
    """The open loop of a model that is computed on arrays."""
    model: Any = ship.model
    return System(
        states=model.states, series=(*model.controls, *CHANNELS), plant=model.plant, hidden=model.memory,
        parameters=tuple(f"environment.{name}" for name in _OFFSETS),
        derivative=lambda state, acting, parameters: _rates(model, state, acting),
    )  # fmt: skip


def open_loop_parameters(ship: Ship) -> Array:
    """Values of `open_loop(ship).parameters`."""
    return np.array([*_free_values(ship.model).values(), 0.0, 0.0], dtype=np.float64)


def _free_values(model: Any) -> dict[str, float]:
    """Parameters of a model; without the step of one in discrete time, which belongs to the engine."""
    return {path: v for path, v in values(model).items() if not (path == "dt" and isinstance(model, Sampled))}


def loop_values(ship: Ship, policy: Policy) -> dict[str, float]:
    """Parameters of `closed_loop` by name; without those that change the structure of the compiled step.

    A dead time sets the length of the queue of orders, and a lag of zero removes the exponential.
    """
    out = {f"ship.{path}": value for path, value in _free_values(ship.model).items()}
    for name, servo in {table(control): ship.actuators.of(control) for control in ship.model.controls}.items():
        own = {k: v for k, v in values(servo).items() if k != "dead_time" and not (k == "lag" and v == 0.0)}
        out |= {f"{name}.{limit}": value for limit, value in own.items()}
    return out | {f"policy.{path}": value for path, value in values(policy).items()}


def loop_specs(ship: Ship, policy: Policy) -> dict[str, Spec]:
    """Meaning and range of each of `loop_values`; the limits of an actuator are in the unit of its control."""
    out = {f"ship.{path}": meaning for path, meaning in specs(ship.model).items()}
    for control in ship.model.controls:
        own = unit(control)
        per = {"": own, "1/s": f"{own}/s" if own != "1/s" else "1/s^2"}
        for limit, meaning in specs(ship.actuators.of(control)).items():
            of = meaning.unit if isinstance(ship.actuators.of(control), Shaft) else per.get(meaning.unit, meaning.unit)
            out[f"{table(control)}.{limit}"] = replace(meaning, unit=of)
    return out | {f"policy.{path}": meaning for path, meaning in specs(policy).items()}


def _memory(ship: Ship, dt: float) -> tuple[tuple[str, ...], ...]:
    """Names of the memory of each control's actuator: actual value, its own memory, queued orders."""
    found: list[tuple[str, ...]] = []
    for control in ship.model.controls:
        servo = ship.actuators.of(control)
        waiting = range(queue_length(float(servo.dead_time), dt))
        found.append((control, *(f"{control}.{e}" for e in servo.extra), *(f"{control}.order_{k}" for k in waiting)))
    return tuple(found)


_Shares = tuple[tuple[int, float], ...]
"""Which of a policy's orders a control takes, and how much of each."""


def _sources(ship: Ship, policy: Policy) -> tuple[_Shares, ...]:
    """For each control, the index and the factor of each order of the policy that it takes; none where it rests.

    An order with the name of the control takes precedence over those that it follows.
    """
    given, model = policy.orders, ship.model
    known = sorted({name for name in (*model.controls, *(order for order, _ in model.follows), "delta")
                    if name and (name in model.controls or model.obeying(name))})  # fmt: skip
    for name in given:
        if name not in known:
            raise ShipError(f"{ship.name}: {unknown(name, known, 'control')}")
    found: list[_Shares] = []
    for control, own, share in zip(model.controls, model.follows, model.differential, strict=True):
        pairs = [(control, 1.0)] if control in given else [own, *([("delta", share)] if share else [])]
        found.append(tuple((given.index(name), factor) for name, factor in pairs if name in given))
    return tuple(found)


@dataclass(frozen=True)
class _Loop:
    """Parts of a closed loop: sources of the orders, and layout of the memory."""

    ship: Ship
    policy: Policy
    dt: float
    names: tuple[str, ...]
    sources: tuple[_Shares, ...]
    held: tuple[tuple[str, ...], ...]
    place: Place | None = None

    @property
    def sampled(self) -> Sampled | None:
        return self.ship.model if isinstance(self.ship.model, Sampled) else None

    @property
    def stepped(self) -> Stepped | None:
        return self.ship.model if isinstance(self.ship.model, Stepped) else None

    @property
    def given(self) -> tuple[str, ...]:
        return self.policy.given if isinstance(self.policy, Scheduled) else ()

    @property
    def lags(self) -> tuple[str, ...]:
        return self.sampled.memory if self.sampled and not self.stepped else ()

    def model(self, p: Scalars) -> Any:
        return update(self.ship.model, _split(self.names, p, "ship."))

    def orders(self, t: Any, state: Scalars, memory: Scalars, given: Scalars, p: Scalars) -> tuple[Scalars, Scalars]:
        """The order for each control, and the memory of the policy."""
        steer: Any = update(self.policy, _split(self.names, p, "policy."))
        wanted, memory = steer.command(t, state[:6], memory, *((given,) if self.given else ()))
        taken = (reduce(add, (factor * wanted[k] for k, factor in shares)) if shares else 0.0
                 for shares in self.sources)  # fmt: skip
        return (*taken, *self.own(wanted)), memory

    def own(self, wanted: Scalars) -> Scalars:
        """Orders under their own names, for those that are not a control of the ship."""
        return tuple(order for name, order in zip(self.policy.orders, wanted, strict=True)
                     if name not in self.ship.model.controls)  # fmt: skip

    def actuate(self, k: int, memory: Scalars, order: Any, step: Any, p: Scalars) -> tuple[Any, Scalars]:
        """Mean of control number `k` over the step, and its memory at the end."""
        control = self.ship.model.controls[k]
        usual = self.ship.actuators.of(control)
        servo: Servo = update(usual, _split(self.names, p, f"{table(control)}."))
        own = 1 + len(usual.extra)
        state, mean = memory[:own], 0.0
        pieces, queue = queued(memory[own:], order, float(usual.dead_time), self.dt)
        for share, piece in pieces:
            part, state = servo.advance(state, piece, share * step)
            mean = mean + share * part
        return mean, (*state, *queue)

    def before(
        self, t: Any, step: Any, state: Scalars, memory: Scalars, series: Scalars, p: Scalars
    ) -> tuple[Scalars, Scalars, Scalars]:
        """One time step of policy and actuators, before that of the ship's motion."""
        around, given = series[: len(CHANNELS)], series[len(CHANNELS) :]
        if self.place is not None:
            end = len(given) - len(self.place.names)
            given, around = given[:end], self.place.around(t, state, around, given[end:])
        at = sum(len(group) for group in self.held)
        lags, remembered = memory[at : at + len(self.lags)], memory[at + len(self.lags) :]
        ordered, remembered = self.orders(t, state, remembered, given, p)
        acting: list[Any] = []
        after: list[Any] = []
        at = 0
        for k, (group, order) in enumerate(zip(self.held, ordered, strict=False)):
            mean, end = self.actuate(k, memory[at : at + len(group)], order, step, p)
            # A model in discrete time is fitted to the values at its samples, not to means between them.
            at_sample = self.sampled is not None and not self.ship.actuators.of(self.ship.model.controls[k]).at_once
            acting.append(memory[at] if at_sample else mean)
            after += end
            at += len(group)
        rates: Scalars = ()
        if self.sampled and not self.stepped:
            rates, lags = self.model(p).advance(state, tuple(acting), Environment(*around), lags)
        return (*acting, *around, *rates), (*after, *lags, *remembered), ordered

    def derivative(self, state: Scalars, acting: Scalars, parameters: Scalars) -> Scalars:
        if self.place is None:
            return _rates(self.model(parameters), state, acting)
        n = len(self.ship.model.controls)
        around: Any = self.place.charted(acting[n : n + len(CHANNELS) + len(PLACE)])
        return self.model(parameters).derivative(state, acting[:n], around)


def closed_loop(ship: Ship, policy: Policy, dt: float, place: Place | None = None) -> System:
    """Ship, actuators and policy as one system; its memory is that of actuators, model and policy.

    Parameters are named ``ship.<path>``, ``propeller.<limit>``, ``rudder.<limit>`` (other actuators by their control,
    ``alpha_1.rate``) and ``policy.<name>``.  A dead time is a queue of orders of the length of the time step `dt` [s].
    At a `place` the depth, banks and quays are those of its chart, and the weather's depth is not used.

    Raises:
        ShipError: the policy orders a control that the ship lacks.
    """
    loop = _Loop(ship, policy, dt, tuple(loop_values(ship, policy)), _sources(ship, policy), _memory(ship, dt), place)
    if loop.stepped:
        return _closed_loop(loop)
    free = frozenset(loop.names)
    servos = [(f"{table(control)}.", ship.actuators.of(control)) for control in ship.model.controls]
    try:
        return _built(_Equations(
            lambda: _closed_loop(loop), loop.names, loop.sources, loop.held, dt, logged(ship, policy),
            *(_structure(part, free, prefix)
              for prefix, part in (("ship.", ship.model), ("policy.", policy), *servos)),
            *(servo.at_once for _, servo in servos), place,
        ))  # fmt: skip
    except TypeError:  # a model with arrays is not compared
        return _closed_loop(loop)


def _closed_loop(loop: _Loop) -> System:
    ship, policy = loop.ship, loop.policy
    controls = ship.model.controls
    flat = tuple(name for group in loop.held for name in group)
    place, near = loop.place, ()
    if place is not None:
        near = (*PLACE, *place.names[len(SMOOTH) :])
    return System(
        states=ship.model.states, memory=(*flat, *loop.lags, *policy.memory),
        series=(*CHANNELS, *loop.given, *(place.names if place else ())),
        acting=(*controls, *CHANNELS, *near, *(_VELOCITIES if loop.sampled and not loop.stepped else ())),
        field=place.grid.field if place and place.grid else None,
        kicks=place.kicks(len(controls), place.substeps(ship, loop.dt), loop.model) if place else None,
        logged=logged(ship, policy), parameters=loop.names, derivative=loop.derivative, before=loop.before,
        hidden=loop.stepped.memory if loop.stepped else (), plant=loop.stepped.plant if loop.stepped else None,
    )  # fmt: skip


def logged(ship: Ship, policy: Policy) -> tuple[str, ...]:
    """Names of the orders that a closed loop records: of each control, then the policy's own beyond them."""
    controls = ship.model.controls
    return tuple(f"{name}_cmd" for name in (*controls, *(o for o in policy.orders if o not in controls)))


def loop_memory(
    ship: Ship, policy: Policy, dt: float, given: Mapping[str, Scalar], state: Scalars
) -> tuple[Scalar, ...]:
    """Memory of `closed_loop` at the start: shafts turn at the policy's revolutions, all other values are zero.

    The memory of a stepped model is last, as the engine expects it.

    Args:
        given: parameters of the policy by the names of `closed_loop`; numbers or symbols.
        state: initial state of the ship; numbers or symbols.
    """
    steer = update(policy, {n[7:]: v for n, v in given.items() if n.startswith("policy.")})
    turning = {"n_P": given.get("policy.n_P", 0.0)}
    start = ship.model.obey(turning)
    found: list[Scalar] = []
    for control, group, value in zip(ship.model.controls, _memory(ship, dt), start, strict=True):
        extra = len(ship.actuators.of(control).extra)
        found += [value, *([0.0] * extra), *([value] * (len(group) - 1 - extra))]
    lags = ship.model.begin(state, start) if isinstance(ship.model, Sampled) else ()
    steering = steer.begin(state[:6])
    return (*found, *steering, *lags) if isinstance(ship.model, Stepped) else (*found, *lags, *steering)


def open_loop_memory(ship: Ship, state: Array, controls: Array) -> Array | None:
    """Memory of a sampled model at each start, as after a long time in that state; None for other models.

    Args:
        state: shape (lanes, states).
        controls: shape (lanes, controls).
    """
    if not isinstance(ship.model, Sampled):
        return None
    rows = zip(state.tolist(), controls.tolist(), strict=True)
    return np.array([ship.model.begin(tuple(x), tuple(c)) for x, c in rows], dtype=np.float64)
