"""Steady straight runs of any model: the speed, drift and controls that leave nothing to accelerate."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property

import numpy as np

from ..core.parameters import ParameterError, Scalar, Scalars, unknown
from ..core.symbolic import alone
from ..core.values import dataclass, replace
from ..data import Array
from ..environment import CALM, Environment
from . import STATES, STEERING, Model, Sampled, Stepped, unit
from .settled import begun

# Newton takes a few rounds; where the forces have a kink it halves its steps and takes more.
_ITERATIONS = 60
# A step halved to this makes no further way: the point is as near as it gets.
_SHORTEST = 1e-9
# An angle taken back by whole turns changes the residual by the rounding of its sine.
_ROUNDING = 1e-12
# How far the speed of a ship that cannot change its thrust may be from the given one.
_NEAR = 0.01
# Accelerations below this count as none [m/s^2, rad/s^2].
_STEADY = 1e-10
# Those of a network in single precision.
_STEADY_SINGLE = 1e-7
# Share of an unknown by which a network's slopes are differenced; its own precision may be single.
_DIFFERENCE = 1e-4

Function = Callable[[Array], Array]


@dataclass(frozen=True)
class Trim:
    """A point about which a model is linearised.

    Attributes:
        states: names of `state`; those of the model, and of a sampled model's memory.
        state, control: their values, SI.
        environment: what surrounds the ship.
        orders: the orders behind the controls, by name.
        residual: largest acceleration left, m/s^2 or rad/s^2.
    """

    states: tuple[str, ...]
    state: tuple[float, ...]
    control: tuple[float, ...]
    environment: Environment
    orders: Mapping[str, float]
    residual: float

    @property
    def speed(self) -> float:
        """Speed ahead over ground [m/s]."""
        return self.state[STATES.index("u")]


def trim(
    model: Model, *, speed: float | None = None, orders: Mapping[str, float] | None = None,
    vary: Sequence[str] | None = None, heading: float = 0.0, environment: Environment = CALM,
) -> Trim:  # fmt: skip
    """The steady straight run at a speed, or under given orders.

    The ship may drift (v_m is always free) and holds its course by the orders that vary: in calm water
    the rudder stays amidships unless the ship is not symmetric.  A model that carries its thrust within
    (Abkowitz) finds its balance within 1 % of the given speed.

    Args:
        model: any model.
        speed: u over ground [m/s]; None finds the one that goes with the orders.
        orders: orders held at given values, SI and radians, by name (n_P, delta, or a control of its own).
        vary: orders to find; None takes n_P and delta, or every control where the model obeys neither,
            less those given.
        heading: psi [rad].
        environment: wind, current, waves and depth; the run is straight over ground.

    Raises:
        ParameterError: an unknown order, neither speed nor orders, or no steady run there.
    """
    given = dict(orders or {})
    known = _known(model, (*given, *(vary or ())))
    usual = [name for name in known if name in STEERING] or list(known)
    wanted = [name for name in (usual if vary is None else vary) if name not in given]
    if speed is None and not given:
        raise ParameterError("a steady run needs a speed, or orders such as n_P")
    search = _Search(model, given, tuple(wanted), speed, heading, environment)
    found = [search.solve(start) for start in search.starts()]
    small = _STEADY_SINGLE if isinstance(model, Stepped) else _STEADY
    steady = [one for one in found if one.residual <= small]
    if not steady and speed is not None:
        free = replace(search, speed=None)  # the balance nearest to the speed
        near = free.solve(np.array([speed if name == "u" else 0.0 for name in free.unknowns]))
        steady = [near] if near.residual <= small and abs(near.speed - speed) <= _NEAR * abs(speed) else []
    if not steady:
        least = min(one.residual for one in found)
        where = f"at {speed:g} m/s" if speed is not None else "under the orders given"
        raise ParameterError(f"no steady straight run {where}: an acceleration of {least:.3g} m/s^2 is left")
    # Of several balances the one with the propeller turning the way the ship goes.
    return max(steady, key=lambda one: one.orders.get("n_P", 0.0) * one.speed >= 0.0)


def point(model: Model, state: Sequence[float], orders: Mapping[str, float], environment: Environment = CALM) -> Trim:
    """Any point, steady or not: its states (those behind the first six settled where left out), and orders.

    Raises:
        ParameterError: an unknown order.
    """
    _known(model, orders)
    search = _Search(model, dict(orders), (), state[3], state[2], environment)
    given = tuple(float(x) for x in state)
    control = search.model.obey(orders)
    whole = begun(search.model, given[: len(STATES)], control, environment)
    return search.point((*given, *whole[len(given) :]), dict(orders))


def _known(model: Model, names: Iterable[str]) -> tuple[str, ...]:
    """The orders that a model obeys; those named are among them."""
    helm = ("delta",) if any(model.differential) else ()
    known = tuple(dict.fromkeys((*(name for name, _ in model.follows), *helm)))
    for name in names:
        if name not in known:
            raise ParameterError(unknown(name, known, "order"))
    return known


def next_sample(model: Sampled, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
    """State of the next sample, memory behind it; heading by the mean of r, position by the rates now."""
    n = len(model.states)
    x, memory = state[:n], state[n:]
    rates, remembered = model.advance(x, control, environment, memory)
    dt = model.dt
    u, v_m, r = (a + dt * b for a, b in zip(x[3:6], rates, strict=True))
    slow = model.derivative(x, control, environment)
    psi = x[2] + 0.5 * dt * (x[5] + r)
    own = (a + dt * b for a, b in zip(x[6:], slow[6:], strict=True))
    return (x[0] + dt * slow[0], x[1] + dt * slow[1], psi, u, v_m, r, *own, *remembered)


@dataclass(frozen=True)
class _Search:
    """Newton's method on the accelerations; unknown are v_m, the model's own states, orders, and u where it is free."""

    model: Model
    given: Mapping[str, float]
    wanted: tuple[str, ...]
    speed: float | None
    heading: float
    environment: Environment

    @property
    def unknowns(self) -> tuple[str, ...]:
        free = () if self.speed is not None else ("u",)
        return (*free, "v_m", *self.model.states[len(STATES) :], *self.wanted)

    def starts(self) -> list[Array]:
        """First guesses: revolutions from a large propeller's to a small one's, or speeds."""
        if self.speed is not None:
            first = [{"n_P": k * self.speed} for k in (1.0, 0.2, 5.0, 25.0, 100.0, 0.0)]
        else:
            first = [{"u": u} for u in (5.0, 1.0, 0.2, 20.0, -1.0)]
        return [np.array([guess.get(name, 0.0) for name in self.unknowns]) for guess in first]

    def split(self, values: Sequence[Scalar]) -> tuple[Scalars, dict[str, Scalar]]:
        """State and orders that a vector of unknowns means."""
        found = dict(zip(self.unknowns, values, strict=True))
        own = tuple(found[name] for name in self.model.states[len(STATES) :])
        u = found.get("u", self.speed)
        orders = {**self.given, **{name: found[name] for name in self.wanted}}
        return (0.0, 0.0, self.heading, u, found["v_m"], 0.0, *own), orders

    def rates(self, state: Scalars, orders: Mapping[str, Scalar]) -> Scalars:
        """Rates of u, v_m, r and the model's own states; a control without an order rests."""
        control = self.model.obey(orders)
        slow = self.model.derivative(state, control, self.environment)[3:]
        if isinstance(self.model, Sampled):
            memory = self.model.begin(state, control)
            return (*self.model.advance(state, control, self.environment, memory)[0], *slow[3:])
        return slow

    def solve(self, start: Array) -> Trim:
        """The nearest balance, or as near as it gets."""
        f, slopes, felt = self.numeric(start) if isinstance(self.model, Stepped) else self.traced
        # What the model does not feel stays at zero.
        kept = [name == "u" or heard for name, heard in zip(self.unknowns, felt, strict=True)]
        here = np.where(kept, start, 0.0).astype(np.float64)
        left = f(here)
        for _ in range(_ITERATIONS):
            step: Array = np.linalg.lstsq(slopes(here), -left, rcond=1e-12)[0].astype(np.float64)
            share, there = 1.0, here + step
            while not np.linalg.norm(f(there)) < np.linalg.norm(left) and share > _SHORTEST:
                share *= 0.5
                there = here + share * step
            if share <= _SHORTEST:
                break
            here, left = there, f(there)
        # An angle found whole turns away is the same balance, where the model feels it by sine and cosine.
        turns = np.array([unit(name) == "rad" for name in self.unknowns])
        within = np.where(turns, np.remainder(here + np.pi, 2.0 * np.pi) - np.pi, here)
        if np.linalg.norm(f(within)) <= np.linalg.norm(left) + _ROUNDING:
            here = within
        if self.speed is None and not np.any(slopes(here)[:, 0]):
            raise ParameterError("the model keeps whatever speed it starts with; give the speed")
        return self.point(*self.split(here.tolist()))

    @cached_property
    @alone
    def traced(self) -> tuple[Function, Function, list[bool]]:
        """Rates and their Jacobian as functions of the unknowns, and which unknowns bear on a rate."""
        import casadi as ca

        x = ca.SX.sym("x", len(self.unknowns))
        y = ca.vertcat(*(ca.SX(rate) for rate in self.rates(*self.split(tuple(ca.vertsplit(x))))))
        slopes = ca.jacobian(y, x)
        f, j = ca.Function("f", [x], [y]), ca.Function("j", [x], [slopes])
        felt = [slopes[:, k].nnz() > 0 for k in range(len(self.unknowns))]
        return lambda at: np.asarray(f(at)).ravel(), lambda at: np.array(j(at).full()), felt

    def numeric(self, start: Array) -> tuple[Function, Function, list[bool]]:
        """The same by central differences, for a model that cannot be traced."""

        def f(at: Array) -> Array:
            return np.array(self.rates(*self.split(at.tolist())), dtype=np.float64)

        def slopes(at: Array) -> Array:
            steps = _DIFFERENCE * np.maximum(np.abs(at), 0.1) * np.eye(at.size)
            return np.column_stack([(f(at + h) - f(at - h)) / (2.0 * h.sum()) for h in steps])

        return f, slopes, np.any(slopes(start) != 0.0, axis=0).tolist()

    def point(self, state: tuple[float, ...], orders: Mapping[str, float]) -> Trim:
        """The trim point, memory of a sampled model included."""
        control = tuple(float(x) for x in self.model.obey(orders))
        names, full = tuple(self.model.states), tuple(float(x) for x in state)
        residual = max(abs(float(rate)) for rate in self.rates(full, orders))
        if isinstance(self.model, Sampled):
            names = (*names, *self.model.memory)
            full = (*full, *(float(x) for x in self.model.begin(full, control)))
        return Trim(names, full, control, self.environment, dict(orders), residual)
