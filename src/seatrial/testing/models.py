"""Checks of a model family on a ship, against the contract of `seatrial.models`, current included."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from typing import Any

import casadi as ca
import numpy as np

from .. import models
from ..core.parameters import update, walk
from ..data import Array
from ..engine import Rollout
from ..environment import CHANNELS, Environment
from ..models import STATES, Model, Sampled, Stepped, unit
from ..ships import Ship
from ..simulate.lanes import Steps, given, run
from ..simulate.run import approach, fastest, straight
from . import discovery
from .discovery import (
    compiled,
    control_size,
    environment_size,
    even,
    flat,
    mirrored_control,
    rate_size,
    require,
    state_size,
)

SIDES = (1, -1, -1, 1, -1, -1)
"""What a mirror at the centre plane makes of x, y, psi, u, v_m, r."""
# Physical channels that cannot be negative: the period of the waves, one over the depth.
POSITIVE = [CHANNELS.index("wave_T"), CHANNELS.index("per_depth")]
_AT_REST = "the model is not valid at rest"
_ARRAYS = "the model moves on arrays and refuses symbols"


def situations(ship: Ship) -> Array:
    """Inputs of `flat`: at random, at rest, and in every quadrant of speed, controls and drift."""
    _, size = flat(ship)
    n, c = len(ship.model.states), len(ship.model.controls)
    random = np.random.default_rng(3).uniform(-1, 1, (80, size.size))
    rest = np.zeros((3, size.size))
    rest[1, n : n + c], rest[2, n + c :] = 0.5, 0.5
    quadrants = np.zeros((54, size.size))
    for row, (u, v, angle, way) in zip(
        quadrants, itertools.product((0.7, 1e-9, -0.5), (0.0, 0.4, -0.4), (0.0, 0.7), (1.0, 0.0, -1.0)), strict=True
    ):
        row[3:5] = u, v
        row[n : n + c] = [angle if unit(control) == "rad" else way for control in ship.model.controls]
    x = np.vstack([random, rest, quadrants]) * size
    around = [n + c + k for k in POSITIVE]
    x[:, around] = np.abs(x[:, around])
    return x


def untried_families() -> list[str]:
    """Families of the package that neither a ship nor an example has."""
    flown = {type(ship.model) for ship in discovery.ships().values()}
    return [cls.__qualname__ for cls in discovery.classes_of(models) if issubclass(cls, Model) and cls not in flown]


def declared(ship: Ship) -> None:
    """Every number is declared with what it is, and lies within what physics allows."""
    discovery.declared(ship.model)


def answers(ship: Ship) -> None:
    """States, controls and what they follow are complete; properties are of the kind that `Model` declares."""
    model = ship.model
    require(model.states[:6] == STATES, f"the first six states are {model.states[:6]}, not {STATES}")
    rolls = bool(set(models.ROLL) & set(model.states))
    require(rolls == (model.motion != STATES), f"{models.ROLL} come together, first behind the six: {model.states}")
    require(len(set(model.controls)) == len(model.controls) == len(model.follows), "a control without what it follows")
    nameless = [c for c in model.controls if unit(c) == "-" and not c.startswith("throttle_")]
    require(not nameless, f"no unit follows from {nameless}")
    require(all(np.isfinite(factor) for _, factor in model.follows), "a factor that is not finite")
    sizes = model.draught, model.breadth, model.displaced
    require(all(np.isfinite(size) and size >= 0.0 for size in sizes), f"draught, breadth, mass are {sizes}")
    require(len(model.sides) == len(model.states) - len(STATES), "`sides` has one sign a state beyond the six")
    known = {path for path, _, _ in walk(model)}
    require(known.issuperset(model.asymmetries), f"`asymmetries` names none of the parameters: {model.asymmetries}")
    rows = np.zeros((3, len(model.controls) + len(CHANNELS)))
    shape = np.shape(model.recall(rows, 0.1))
    require(shape == (3, len(model.states) - len(STATES)), f"`recall` gives the shape {shape}")


def finite_and_equal_on_symbols(ship: Ship) -> str | None:
    """Finite with finite Jacobians; symbols equal floats to 1e-12 of the largest rate, each in its own measure."""
    if isinstance(ship.model, Stepped):
        return _ARRAYS
    rates, size = flat(ship)
    f, j = compiled(rates, size.size)
    x = situations(ship)
    direct = np.array([rates(tuple(row)) for row in x.tolist()], dtype=float)
    require(np.isfinite(direct).all(), "a rate is not finite")
    require(np.isfinite(j(x.T).full()).all(), "a derivative is not finite")
    # What the outputs are measured by: rates, then changes and memory of a sampled model.
    own = rate_size(ship)
    measure = np.array([*own, *own[3:6], *([own[5]] * direct.shape[1])])[: direct.shape[1]]
    scale = np.abs(direct / measure).max(axis=1, keepdims=True)
    off = np.abs(f(x.T).full().T - direct) / measure
    require((off <= 1e-12 * scale + 1e-300).all(), "floats and symbols differ")
    return None


def silent_at_rest(ship: Ship) -> str | None:
    """In still air and water with stopped propellers nothing moves, wherever the rudder and however deep the water.

    A family that is no physics at rest has `valid_at_rest = False`, and why in its docstring.
    """
    model: Any = ship.model
    if not model.valid_at_rest:
        require("at rest" in (type(model).__doc__ or ""), "not valid at rest, and its docstring does not say why")
        return _AT_REST
    sized = dict(zip(model.controls, control_size(ship), strict=True))
    for share, per_depth in ((0.0, 0.0), (0.8, 0.0), (-0.8, environment_size(ship)[-1])):
        state = (5.0, -3.0, 0.7, *([0.0] * (len(model.states) - 3)))
        control = tuple(share * x if unit(control) == "rad" else 0.0 for control, x in sized.items())
        around = Environment(per_depth=per_depth)
        moved = [*model.derivative(state, control, around)]
        if isinstance(model, Sampled):
            moved += model.advance(state, control, around, model.begin(state, (0.0,) * len(control)))[0]
        require(all(abs(rate) == 0 for rate in moved), f"at rest under {control} the rates are {moved}")
    return None


def all_but_silent_near_rest(ship: Ship) -> str | None:
    """At a thousandth of its speed, whatever way it moves, no rate is more than a twentieth of its usual size."""
    model = ship.model
    if not model.valid_at_rest:
        return _AT_REST
    for u, v, r in itertools.product((1.0, 0.0, -1.0), repeat=3):
        way = np.array([u * ship.speed, v * ship.speed, r * ship.speed / ship.L_pp])
        state = (0.0, 0.0, 0.0, *(1e-3 * way).tolist(), *([0.0] * (len(model.states) - 6)))
        rates = np.array(model.derivative(state, (0.0,) * len(model.controls), Environment()), dtype=float)
        require((np.abs(rates) <= 0.05 * rate_size(ship)).all(), f"all but at rest the rates are {rates}")
    return None


def mirrored(ship: Ship) -> str | None:
    """With its port and starboard coefficients equal and its bias to one side taken away, the ship is symmetric."""
    if isinstance(ship.model, Stepped):
        return "a network is as symmetric as its data"
    model: Any = even(ship.model)
    n, c = len(model.states), len(model.controls)
    own, measure = model.sides, rate_size(ship)
    for x in situations(ship):
        state, control = tuple(x[:n].tolist()), tuple(x[n : n + c].tolist())
        around = Environment(*x[n + c : n + c + len(CHANNELS)].tolist())
        other = around._replace(wind_y=-around.wind_y, current_y=-around.current_y, wave_y=-around.wave_y)
        port = tuple(s * value for s, value in zip((*SIDES, *own), state, strict=True))
        flipped = mirrored_control(model, control)
        here, there = model.derivative(state, control, around), model.derivative(port, flipped, other)
        seen = tuple(s * rate for s, rate in zip((*SIDES, *own), there, strict=True))
        scale = np.abs(np.array(here) / measure).max()
        off = np.abs(np.array(seen) - here) / measure
        require((off <= 1e-12 * scale).all(), f"at {x} the rates are {here}, in the mirror {seen}")
        if isinstance(model, Sampled):
            change, _ = model.advance(state, control, around, model.begin(state, control))
            back, _ = model.advance(port, flipped, other, model.begin(port, flipped))
            bound = np.maximum(1e-11 * np.abs(change), 1e-12 * max(map(abs, change)))
            off = np.abs(np.array((back[0], -back[1], -back[2])) - change)
            require((off <= bound).all(), f"at {x} the changes are {change}, in the mirror {back}")
    return None


def parameters_may_be_symbols(ship: Ship) -> None:
    """The derivative takes symbols for every parameter, with finite sensitivities."""
    model = ship.model
    names = [path for path, _, _ in walk(model)]
    p = ca.SX.sym("p", len(names))
    symbolic = update(model, {path: p[i] for i, path in enumerate(names)})
    x = np.array([0, 0, 0.1, 0.7, 0.4, 0.3, *([0.5] * (len(model.states) - 6))]) * discovery.state_size(ship)
    control = tuple((0.6 * np.array(control_size(ship))).tolist())
    given = (tuple(x.tolist()), control, Environment(0.5, 0.3, 0.1, 0.0))
    y = ca.vertcat(*(ca.SX(rate) for rate in symbolic.derivative(*given)))
    found = ca.Function("f", [p], [y, ca.jacobian(y, p)])([value for _, _, value in walk(model)])
    direct = np.array(model.derivative(*given), dtype=float)
    off = np.abs(np.array(found[0]).ravel() - direct)
    require((off <= np.maximum(1e-10 * np.abs(direct), 1e-12)).all(), "symbols for parameters give other rates")
    require(np.isfinite(found[1].full()).all(), "a sensitivity to a parameter is not finite")


def _carried_along(around: Environment, current: tuple[float, float]) -> Environment:
    """The same weather with everything, air and water, carried along; the wind is where it comes from."""
    return around._replace(
        current_x=around.current_x + current[0], current_y=around.current_y + current[1],
        wind_x=around.wind_x - current[0], wind_y=around.wind_y - current[1],
    )  # fmt: skip


def _in_ship_axes(psi: Any, current: tuple[float, float], phi: Any = 0.0) -> tuple[Any, Any]:
    """Velocities u and v_m of a ship that drifts; heeled, it drifts over ground with v_m cos(phi)."""
    c, s = np.cos(psi), np.sin(psi)
    return current[0] * c + current[1] * s, (current[1] * c - current[0] * s) / np.cos(phi)


def _heel(ship: Ship, states: Array) -> tuple[Any, Any]:
    """Heel and roll rate in rows of states, zero of a ship that does not roll."""
    named = dict(zip(ship.model.states, np.moveaxis(states, -1, 0), strict=False))
    return named.get("phi", 0.0), named.get("p", 0.0)


def rates_in_a_current(ship: Ship) -> str | None:
    """At any state, in wind and waves: the same accelerations through the water, 1e-12 of the largest rate."""
    if isinstance(ship.model, Sampled):
        return "a sampled model has rates between samples only"
    rates, size = flat(ship)
    n, c = len(ship.model.states), len(ship.model.controls)
    current = (0.21 * ship.speed, -0.13 * ship.speed)
    for x in np.random.default_rng(11).uniform(-1, 1, (60, size.size)) * size:
        x[-2:] = np.abs(x[-2:])
        still = rates(tuple(x.tolist()))
        phi, p = _heel(ship, x[:n])
        u_C, v_C = _in_ship_axes(x[2], current, phi)
        state = (*x[:3], x[3] + u_C, x[4] + v_C, *x[5:n])
        moved = _carried_along(Environment(*x[n + c : n + c + len(CHANNELS)]), current)
        found = rates((*state, *x[n : n + c], *moved))
        wanted = np.array(still, dtype=float)
        wanted[:2] += current
        # the ship turns, and rolls, within the current
        wanted[3:5] += wanted[2] * v_C * np.cos(phi), (p * v_C * np.sin(phi) - wanted[2] * u_C) / np.cos(phi)
        off = np.abs(np.array(found) - wanted).max()
        require(off <= 1e-12 * np.abs(wanted).max() + 1e-15, f"at {x} a current changes more than the drift")
    return None


def motion_in_a_current(ship: Ship) -> str | None:
    """Motion in a current is motion in still water plus the drift: to 1e-9 of L_pp, U and U/L_pp by RK4 in small steps.

    A turn of five ship lengths and one that begins from rest.  The two frames are one to physics but not to RK4,
    whose error the step brings below the bar: it is short beside the fastest motion of the ship and beside its
    turning.  The turn begins just below the approach speed, where no table of speeds has its corner: across one, RK4
    is of second order only.
    """
    if isinstance(ship.model, Sampled):
        return _sampled_in_a_current(ship)
    own, U, L = len(ship.model.states), ship.speed, ship.L_pp
    current = (0.21 * U, -0.13 * U)
    weather = Environment(*(0.5 * np.array(environment_size(ship))))
    weather = weather._replace(current_x=0.0, current_y=0.0, per_depth=0.0)
    start = np.zeros((2, own))
    start[0, 3] = 0.97 * U
    dt = min(0.004 * L / U, 0.02 / max(fastest(ship), 1e-9))
    pilot = _run(ship, start, weather, dt)
    dt = min(dt, 0.005 / float(np.abs(pilot.values[..., 5]).max()))
    still = _run(ship, start, weather, dt)
    start[:, 3:5] += current
    moved = _run(ship, start, _carried_along(weather, current), dt)
    wanted = still.values.copy()
    heel = _heel(ship, still.values[..., :own])[0]
    drift = (*(speed * still.t for speed in current), 0.0, *_in_ship_axes(still.values[..., 2], current, heel))
    for k, change in enumerate(drift):
        wanted[..., k] += change
    size = np.array([L, L, 1.0, U, U, U / L, *(state_size(ship)[6:])])
    require(np.isfinite(still.values).all(), "the run in still water is not finite")
    require((np.abs(moved.values - wanted) <= 1e-9 * size).all(), "in a current it moves otherwise than by the drift")
    require(np.abs(wanted - still.values)[..., :2].max() > 0.5 * L, "the run is too short to show the current")
    return None


def _sampled_in_a_current(ship: Ship) -> None:
    """Positions between samples are those of velocities that run straight; velocities through water know no current."""
    model: Any = ship.model
    U, L = ship.speed, ship.L_pp
    current = (0.21 * U, -0.13 * U)
    start = np.array([[0.0, 0.0, 0.3, U, 0.0, 0.0]])
    still = _run(ship, start, Environment(), model.dt)
    start[0, 3:5] += _in_ship_axes(0.3, current)
    moved = _run(ship, start, _carried_along(Environment(), current), model.dt)
    wanted = still.values[..., 2:6].copy()
    wanted[..., 1:3] += np.stack(_in_ship_axes(wanted[..., 0], current), axis=-1)
    off = np.abs(moved.values[..., 2:6] - wanted)
    require((off <= 1e-9 * np.array([1.0, U, U, U / L])).all(), "a current changes its velocities through the water")
    require(np.abs(wanted[..., 0]).max() > 0.3, "the run does not turn")


def _run(ship: Ship, start: Array, around: Environment, dt: float) -> Rollout:
    """Open loop from given starts: what runs at the approach runs, every angle is 0.4 rad."""
    running = straight(ship, approach(ship)[1])
    usual = zip(ship.model.controls, running, control_size(ship), strict=True)
    control = [0.4 if unit(key) == "rad" else x or 0.3 * size for key, x, size in usual]
    series = np.tile([*control, *around], (len(start), 1, 1))
    steps = round(5 * ship.L_pp / ship.speed / dt) + 1
    return run(given(ship, start, series), Steps(dt, steps, max(steps // 50, 1)))


Check = Callable[[Ship], str | None]

SHIP_CHECKS: Mapping[str, Check] = {
    check.__name__: check
    for check in (
        declared, answers, finite_and_equal_on_symbols, silent_at_rest, all_but_silent_near_rest, mirrored,
        parameters_may_be_symbols, rates_in_a_current, motion_in_a_current,
    )
}  # fmt: skip
"""The checks of a ship by name."""
