"""Every ship of the library, whatever its family and controls, keeps the contract of `seatrial.models`."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from discovery import (
    SHIPS,
    classes_of,
    compiled,
    control_size,
    environment_size,
    even,
    flat,
    mirrored_control,
    rate_size,
    state_size,
)

import seatrial.models
from seatrial.core.parameters import update, walk
from seatrial.environment import CHANNELS, Environment
from seatrial.models import STATES, Model, Sampled, Stepped, unit

every_ship = pytest.mark.parametrize("name", list(SHIPS))
SIDES = (1, -1, -1, 1, -1, -1)
# Physical channels that cannot be negative: the period of the waves, one over the depth.
POSITIVE = [CHANNELS.index("wave_T"), CHANNELS.index("per_depth")]


def situations(name: str) -> Any:
    """Inputs of `flat`: at random, at rest, and in every quadrant of speed, controls and drift."""
    ship = SHIPS[name]
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


def measured(name: str, count: int) -> Any:
    """What the outputs of `flat` are measured by: rates, then changes and memory of a sampled model."""
    own = rate_size(SHIPS[name])
    return np.array([*own, *own[3:6], *([own[5]] * count)])[:count]


def test_every_family_is_flown_by_some_ship() -> None:
    families = [cls for cls in classes_of(seatrial.models) if hasattr(cls, "derivative") and hasattr(cls, "states")]
    flown = {type(ship.model) for ship in SHIPS.values()}
    assert not [cls.__qualname__ for cls in families if cls not in flown], "give it a ship, or a line in examples.py"


@every_ship
def test_states_controls_and_what_they_follow(name: str) -> None:
    model: Model = SHIPS[name].model
    assert model.states[:6] == STATES
    assert len(set(model.controls)) == len(model.controls) == len(model.follows)
    assert all(unit(control) != "-" for control in model.controls)
    assert all(np.isfinite(factor) for _, factor in model.follows)


@every_ship
def test_finite_with_finite_jacobians_everywhere_and_equal_on_symbols(name: str) -> None:
    """Symbols equal floats to 1e-12 of the largest rate, each in the ship's own measure (lengths, L_pp/U)."""
    if isinstance(SHIPS[name].model, Stepped):
        pytest.skip("moves on arrays; it refuses symbols, see tests/models/test_neural.py")
    rates, size = flat(SHIPS[name])
    f, j = compiled(rates, size.size)
    x = situations(name)
    direct = np.array([rates(tuple(row)) for row in x.tolist()], dtype=float)
    assert np.isfinite(direct).all()
    assert np.isfinite(j(x.T).full()).all()
    measure = measured(name, direct.shape[1])
    scale = np.abs(direct / measure).max(axis=1, keepdims=True)
    assert (np.abs(f(x.T).full().T - direct) / measure <= 1e-12 * scale + 1e-300).all()


@every_ship
def test_silent_at_rest(name: str) -> None:
    """In still air and water with stopped propellers nothing moves, wherever the rudder and however deep the water.

    A family that is no physics at rest says `valid_at_rest = False`, and why in its docstring.
    """
    model: Any = SHIPS[name].model
    if not getattr(model, "valid_at_rest", True):
        assert "at rest" in (type(model).__doc__ or "")
        pytest.skip("the model says that it means nothing at rest")
    sized = dict(zip(model.controls, control_size(SHIPS[name]), strict=True))
    for share, per_depth in ((0.0, 0.0), (0.8, 0.0), (-0.8, environment_size(SHIPS[name])[-1])):
        state = (5.0, -3.0, 0.7, *([0.0] * (len(model.states) - 3)))
        control = tuple(share * x if unit(control) == "rad" else 0.0 for control, x in sized.items())
        around = Environment(per_depth=per_depth)
        assert all(abs(rate) == 0 for rate in model.derivative(state, control, around))
        if isinstance(model, Sampled):
            change, _ = model.advance(state, control, around, model.begin(state, (0.0,) * len(control)))
            assert all(abs(rate) == 0 for rate in change)


@every_ship
def test_all_but_silent_when_it_all_but_rests(name: str) -> None:
    """At a thousandth of its speed, whatever way it moves, no rate is more than a twentieth of its usual size."""
    ship = SHIPS[name]
    model: Any = ship.model
    if not getattr(model, "valid_at_rest", True):
        pytest.skip("the model says that it means nothing at rest")
    for u, v, r in itertools.product((1.0, 0.0, -1.0), repeat=3):
        way = np.array([u * ship.speed, v * ship.speed, r * ship.speed / ship.L_pp])
        state = (0.0, 0.0, 0.0, *(1e-3 * way).tolist(), *([0.0] * (len(model.states) - 6)))
        rates = np.array(model.derivative(state, (0.0,) * len(model.controls), Environment()), dtype=float)
        assert (np.abs(rates) <= 0.05 * rate_size(ship)).all()


@every_ship
def test_mirrored(name: str) -> None:
    """With its port and starboard coefficients equal and its bias to one side taken away, each ship is symmetric."""
    ship = SHIPS[name]
    if isinstance(ship.model, Stepped):
        pytest.skip("a network is as symmetric as its data")
    model: Any = even(ship.model)
    n, c = len(model.states), len(model.controls)
    # States of its own change sides with the ship, unless the family says otherwise.
    own, measure = getattr(model, "sides", (-1,) * (n - 6)), rate_size(ship)
    for x in situations(name):
        state, control = tuple(x[:n].tolist()), tuple(x[n : n + c].tolist())
        around = Environment(*x[n + c : n + c + len(CHANNELS)].tolist())
        other = around._replace(wind_y=-around.wind_y, current_y=-around.current_y, wave_y=-around.wave_y)
        port = tuple(s * value for s, value in zip((*SIDES, *own), state, strict=True))
        here = model.derivative(state, control, around)
        there = model.derivative(port, mirrored_control(model, control), other)
        seen = tuple(s * rate for s, rate in zip((*SIDES, *own), there, strict=True))
        scale = np.abs(np.array(here) / measure).max()
        assert (np.abs(np.array(seen) - here) / measure <= 1e-12 * scale).all()
        if isinstance(model, Sampled):
            change, _ = model.advance(state, control, around, model.begin(state, control))
            begun = model.begin(port, mirrored_control(model, control))
            back, _ = model.advance(port, mirrored_control(model, control), other, begun)
            assert (back[0], -back[1], -back[2]) == pytest.approx(change, rel=1e-11, abs=1e-12 * max(map(abs, change)))


@every_ship
def test_parameters_may_be_symbols(name: str) -> None:
    ship = SHIPS[name]
    model: Any = ship.model
    names = [path for path, _, _ in walk(model)]
    p = ca.SX.sym("p", len(names))
    symbolic = update(model, {path: p[i] for i, path in enumerate(names)})
    x = np.array([0, 0, 0.1, 0.7, 0.4, 0.3, *([0.5] * (len(model.states) - 6))]) * state_size(ship)
    given = (tuple(x.tolist()), tuple(0.6 * np.array(control_size(ship))), Environment(0.5, 0.3, 0.1, 0.0))
    y = ca.vertcat(*(ca.SX(rate) for rate in symbolic.derivative(*given)))
    found = ca.Function("f", [p], [y, ca.jacobian(y, p)])([value for _, _, value in walk(model)])
    direct = np.array(model.derivative(*given), dtype=float)
    assert np.array(found[0]).ravel() == pytest.approx(direct, rel=1e-10)
    assert np.isfinite(found[1].full()).all()


def test_wind_blows_only_where_the_ship_has_a_wind_module() -> None:
    model: Any = SHIPS["esso_osaka_3m"].model
    at = (0.0,) * 6, (0.0, 0.0)
    gale = Environment(0.0, 10.0)  # from the east, heading north: pushed to port
    assert model.derivative(*at, gale)[4] < 0
    assert replace(model, wind=None).derivative(*at, gale) == (0.0,) * 6
