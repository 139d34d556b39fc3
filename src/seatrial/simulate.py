"""From a ship and a way of steering it to a trial: the only door to the engine for whole runs.

`simulate` closes the loop (policy, actuators and ship in one compiled step), `campaign` runs one
manoeuvre over many lanes with parameters that differ from lane to lane.  `replay` (its own module)
feeds a trial's own controls and wind to the model.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .data import Array, Trial
from .engine import Rollout, Scalars, SimulationError, System
from .engine.rollout import simulator
from .environment import CALM, CHANNELS, Environment, Uniform
from .manoeuvres import Policy
from .models import STATES
from .parameters import update, values
from .ships import Ship, ShipError

CONTROLS = ("n_P", "delta")
# A step this fraction of L/U keeps RK4 errors of a turn far below its indices' last digit.
_STEP = 1.0 / 250.0


def _split(names: tuple[str, ...], given: Scalars, prefix: str) -> dict[str, Any]:
    return {n[len(prefix):]: v for n, v in zip(names, given, strict=True) if n.startswith(prefix)}  # fmt: skip


def open_loop(ship: Ship) -> System:
    """The ship under given controls and environment; parameters are those of its model."""
    names = tuple(values(ship.model))
    offsets = ("current_x", "current_y")

    def derivative(state: Scalars, acting: Scalars, parameters: Scalars) -> Scalars:
        model = update(ship.model, dict(zip(names, parameters[: len(names)], strict=True)))
        n_P, delta, wind_x, wind_y, current_x, current_y = acting
        extra_x, extra_y = parameters[len(names) :]
        around = Environment(wind_x, wind_y, current_x + extra_x, current_y + extra_y)
        return model.derivative(state, (n_P, delta), around)

    return System(
        states=ship.model.states, series=CONTROLS + CHANNELS,
        parameters=names + tuple(f"environment.{n}" for n in offsets), derivative=derivative,
    )  # fmt: skip


def open_loop_parameters(ship: Ship) -> Array:
    """Values of `open_loop(ship).parameters`."""
    return np.array([*values(ship.model).values(), 0.0, 0.0], dtype=np.float64)


def _loop_values(ship: Ship, policy: Policy) -> dict[str, float]:
    parts = (("ship.", ship.model), ("propeller.", ship.actuators.propeller),
             ("rudder.", ship.actuators.rudder), ("policy.", policy))  # fmt: skip
    return {prefix + path: v for prefix, part in parts for path, v in values(part).items()}


def closed_loop(ship: Ship, policy: Policy) -> System:
    """Ship, actuators and policy as one system; its memory is the actuators' and the policy's.

    Parameters are named ``ship.<path>``, ``propeller.<limit>``, ``rudder.<limit>``, ``policy.<name>``.
    """
    names = tuple(_loop_values(ship, policy))

    def derivative(state: Scalars, acting: Scalars, parameters: Scalars) -> Scalars:
        model = update(ship.model, _split(names, parameters, "ship."))
        return model.derivative(state, acting[:2], Environment(*acting[2:]))

    def before(
        t: Any, dt: Any, state: Scalars, memory: Scalars, series: Scalars, parameters: Scalars
    ) -> tuple[Scalars, Scalars, Scalars]:
        steer = update(policy, _split(names, parameters, "policy."))
        orders, remembered = steer.command(t, state, memory[2:])
        acting: list[Any] = []
        actual: list[Any] = []
        for name, order, now in zip(("propeller", "rudder"), orders, memory[:2], strict=True):
            actuator = update(getattr(ship.actuators, name), _split(names, parameters, f"{name}."))
            mean, end = actuator.advance(now, order, dt)
            acting.append(mean)
            actual.append(end)
        return (*acting, *series), (*actual, *remembered), orders

    return System(
        states=ship.model.states, memory=(*CONTROLS, *policy.memory), series=CHANNELS,
        acting=CONTROLS + CHANNELS, logged=("n_P_cmd", "delta_cmd"), parameters=names,
        derivative=derivative, before=before,
    )  # fmt: skip


def time_step(ship: Ship) -> float:
    """A step that suits the ship's size and speed: 1, 2 or 5 times a power of ten below L/(250 U) [s]."""
    wanted = _STEP * ship.L_pp / max(ship.speed, 1e-3)
    decade = 10.0 ** math.floor(math.log10(wanted))
    return max(m * decade for m in (1.0, 2.0, 5.0) if m * decade <= wanted)


def surge_balance(ship: Ship, u: float, n_P: float) -> float:
    """Surge acceleration straight ahead in calm at `u` [m/s] and `n_P` [1/s]; [m/s^2]."""
    still_air = ship.model.derivative((0.0, 0.0, 0.0, u, 0.0, 0.0), (n_P, 0.0), CALM)
    return float(still_air[3])


def approach(ship: Ship, speed: float | None = None, n_P: float | None = None) -> tuple[float, float]:
    """Speed [m/s] and revolutions [1/s] of a steady straight run.

    Without either, the ship file's speed and the revolutions that hold it; with one, the other that
    goes with it; with both, both as given.

    Raises:
        ShipError: the model finds no balance in the range searched.
    """
    if speed is not None and n_P is not None:
        return speed, n_P
    if n_P is not None:

        def by_speed(u: float) -> float:
            return surge_balance(ship, u, n_P)

        return _balance(by_speed, 1e-3, 5 * ship.speed, ship), n_P
    U = ship.speed if speed is None else speed
    if ship.n_P is not None and speed is None:
        return U, ship.n_P
    if surge_balance(ship, U, 0.0) >= 0.0:
        return U, ship.n_P or 0.0  # a response model: nothing to hold

    def by_revolutions(n: float) -> float:
        return surge_balance(ship, U, n)

    return U, _balance(by_revolutions, 0.1 * U / ship.L_pp, 2000 * U / ship.L_pp, ship)


def _balance(f: Callable[[float], float], low: float, high: float, ship: Ship) -> float:
    from scipy.optimize import brentq

    if f(low) * f(high) > 0:
        raise ShipError(f"{ship.name}: no steady run between {low:g} and {high:g}; give --speed and --rps")
    found: Any = brentq(f, low, high, xtol=1e-14, rtol=1e-14)  # type: ignore[arg-type]
    return float(found)


def surroundings(environment: Uniform | Array | None) -> Array:
    """Environment channels as series, shape (1, steps or 1, 4)."""
    if isinstance(environment, np.ndarray):
        return environment.reshape(1, -1, len(CHANNELS))
    return np.array((environment or Uniform()).now(), dtype=np.float64).reshape(1, 1, -1)


def campaign(
    ship: Ship, policy: Policy, vary: Mapping[str, Array], *, speed: float, duration: float,
    environment: Uniform | Array | None = None, dt: float | None = None, every: int = 1,
    method: str = "rk4", threads: int | None = None,
) -> Rollout:  # fmt: skip
    """Run `policy` over many lanes at once.

    Args:
        vary: value per lane of each parameter that differs, by the names of `closed_loop`.
        speed: initial speed straight ahead [m/s]; other arguments as in `simulate`.

    Returns:
        The stored rows; a lane that fails is named in `failures`, the others go on.
    """
    system, step = closed_loop(ship, policy), dt or time_step(ship)
    all_values = _loop_values(ship, policy)
    lanes = len(next(iter(vary.values()))) if vary else 1
    state0 = np.tile([0.0, 0.0, 0.0, speed, 0.0, 0.0], (lanes, 1))
    memory0 = np.empty((lanes, len(system.memory)))
    for lane in range(lanes):
        here = all_values | {name: float(column[lane]) for name, column in vary.items()}
        steer = update(policy, {n[7:]: v for n, v in here.items() if n.startswith("policy.")})
        memory0[lane] = (here.get("policy.n_P", 0.0), 0.0,
                         *steer.begin(tuple(state0[lane].tolist())))  # fmt: skip
    around = np.repeat(surroundings(environment), lanes, axis=0)
    return simulator(system, tuple(vary)).run(
        state0, around, np.array(list(all_values.values()), dtype=np.float64),
        memory0=memory0, lanewise=np.column_stack(list(vary.values())) if vary else None,
        dt=step, steps=round(duration / step) + 1, every=every, method=method, threads=threads,
        validity={k: v for k, v in ship.validity.items() if k in system.states},
    )  # fmt: skip


def simulate(
    ship: Ship, policy: Policy, *, speed: float | None = None, duration: float,
    environment: Uniform | Array | None = None, dt: float | None = None, every: int = 1,
    method: str = "rk4", name: str | None = None,
) -> Trial:  # fmt: skip
    """Run `ship` under `policy` and return what a logger would have recorded.

    Args:
        policy: a manoeuvre or any other policy.
        speed: initial speed straight ahead, heading north [m/s]; None takes the ship's.
        duration: length of the run [s].
        environment: steady wind and current, or series of the channels of `environment.CHANNELS`
            per step, shape (steps, 4); None is still air and still water.
        dt: time step [s]; None chooses one by `time_step`.
        every: record every so many steps.

    Raises:
        SimulationError: the state blows up or leaves the ship's validity; names time and state.
    """
    run = campaign(
        ship, policy, {}, speed=ship.speed if speed is None else speed, duration=duration,
        environment=environment, dt=dt, every=every, method=method, threads=1,
    )  # fmt: skip
    if run.failures:
        raise SimulationError(f"{ship.name}: {run.failures[0]}; it left the finite or the ship's validity range")
    columns = closed_loop(ship, policy).stored
    kept = (*STATES, *CONTROLS, "n_P_cmd", "delta_cmd")
    channels = {n: run.values[0, :, columns.index(n)].copy() for n in kept}
    kind = getattr(policy, "kind", type(policy).__name__.lower())
    meta = {"schema": "manoeuvre-trial/1", "ship": ship.name, "L_pp": ship.L_pp, "kind": kind,
            "set_points": dict(values(policy)), "source": "simulated by seatrial"}  # fmt: skip
    return Trial(name or f"{ship.name}_{kind}", run.t, channels, meta=meta)
