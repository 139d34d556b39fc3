"""Every ship in a uniform current: motion in still water plus the drift, the air being at rest relative to the water.

A public simulator took the advance speed of its propeller from the velocity over ground; this is the test for it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from discovery import SHIPS, control_size, environment_size, flat

from seatrial.engine.rollout import simulator
from seatrial.environment import CHANNELS, Environment
from seatrial.models import Sampled, unit
from seatrial.simulate.run import approach, fastest, open_loop, open_loop_parameters, straight

CONTINUOUS = [name for name, ship in SHIPS.items() if not isinstance(ship.model, Sampled)]
every_ship = pytest.mark.parametrize("name", CONTINUOUS)


def seen_from_ground(around: Environment, current: tuple[float, float]) -> Environment:
    """The same weather with everything, air and water, carried along; the wind is where it comes from."""
    return around._replace(
        current_x=around.current_x + current[0], current_y=around.current_y + current[1],
        wind_x=around.wind_x - current[0], wind_y=around.wind_y - current[1],
    )  # fmt: skip


def carried(psi: Any, current: tuple[float, float]) -> tuple[Any, Any]:
    """The current in ship axes."""
    c, s = np.cos(psi), np.sin(psi)
    return current[0] * c + current[1] * s, current[1] * c - current[0] * s


@every_ship
def test_rates_in_a_current(name: str) -> None:
    """At any state, in wind and waves: the same accelerations through the water, 1e-12 of the largest rate."""
    ship = SHIPS[name]
    rates, size = flat(ship)
    n, c = len(ship.model.states), len(ship.model.controls)
    current = (0.21 * ship.speed, -0.13 * ship.speed)
    for x in np.random.default_rng(11).uniform(-1, 1, (60, size.size)) * size:
        x[-2:] = np.abs(x[-2:])
        still = rates(tuple(x.tolist()))
        u_C, v_C = carried(x[2], current)
        state = (*x[:3], x[3] + u_C, x[4] + v_C, *x[5:n])
        moved = seen_from_ground(Environment(*x[n + c : n + c + len(CHANNELS)]), current)
        found = rates((*state, *x[n : n + c], *moved))
        wanted = np.array(still, dtype=float)
        wanted[:2] += current
        wanted[3:5] += x[5] * v_C, -x[5] * u_C  # the ship turns within the current
        assert np.abs(np.array(found) - wanted).max() <= 1e-12 * np.abs(wanted).max() + 1e-15


@every_ship
def test_motion_in_a_current_is_motion_in_still_water_plus_drift(name: str) -> None:
    """A turn of five ship lengths and one that begins from rest, by RK4 in small steps: 1e-9 of L_pp, U and U/L_pp.

    The two frames are one to physics but not to RK4, whose error the step brings below the bar: it is short
    beside the fastest motion of the ship and beside its turning.  The turn begins just below the approach
    speed, where no table of speeds has its corner: across one, RK4 is of second order only.
    """
    ship = SHIPS[name]
    own, U, L = len(ship.model.states), ship.speed, ship.L_pp
    current = (0.21 * U, -0.13 * U)
    weather = Environment(*(0.5 * np.array(environment_size(ship))))
    weather = weather._replace(current_x=0.0, current_y=0.0, per_depth=0.0)
    start = np.zeros((2, own))
    start[0, 3] = 0.97 * U
    dt = min(0.004 * L / U, 0.02 / max(fastest(ship), 1e-9))
    pilot = run(name, start, weather, dt)
    dt = min(dt, 0.005 / np.abs(pilot.values[..., 5]).max())
    still = run(name, start, weather, dt)
    start[:, 3:5] += current
    moved = run(name, start, seen_from_ground(weather, current), dt)
    wanted = still.values.copy()
    wanted[..., 0] += current[0] * still.t
    wanted[..., 1] += current[1] * still.t
    u_C, v_C = carried(still.values[..., 2], current)
    wanted[..., 3] += u_C
    wanted[..., 4] += v_C
    size = np.array([L, L, 1.0, U, U, U / L, *([(U / L) ** 2] * (own - 6))])
    assert np.isfinite(still.values).all()
    assert (np.abs(moved.values - wanted) <= 1e-9 * size).all()
    assert np.abs(wanted - still.values)[..., :2].max() > 0.5 * L


@pytest.mark.parametrize("name", [name for name in SHIPS if name not in CONTINUOUS])
def test_a_sampled_ship_keeps_its_velocities_through_the_water(name: str) -> None:
    """Its positions between samples are those of velocities that run straight; its velocities know no current."""
    ship = SHIPS[name]
    model: Any = ship.model
    U, L = ship.speed, ship.L_pp
    current = (0.21 * U, -0.13 * U)
    start = np.array([[0.0, 0.0, 0.3, U, 0.0, 0.0]])
    still = run(name, start, Environment(), model.dt)
    start[0, 3:5] += carried(0.3, current)
    moved = run(name, start, Environment(current_x=current[0], current_y=current[1]), model.dt)
    wanted = still.values[..., 2:6].copy()
    u_C, v_C = carried(wanted[..., 0], current)
    wanted[..., 1] += u_C
    wanted[..., 2] += v_C
    assert (np.abs(moved.values[..., 2:6] - wanted) <= 1e-9 * np.array([1.0, U, U, U / L])).all()
    assert np.abs(wanted[..., 0]).max() > 0.3


def run(name: str, start: Any, around: Environment, dt: float) -> Any:
    """Open loop from two starts: what runs at the approach runs, every angle is 0.4 rad."""
    ship = SHIPS[name]
    running = straight(ship, approach(ship)[1])
    usual = zip(ship.model.controls, running, control_size(ship), strict=True)
    control = [0.4 if unit(key) == "rad" else x or 0.3 * size for key, x, size in usual]
    series = np.tile([*control, *around], (len(start), 1, 1))
    steps = round(5 * ship.L_pp / ship.speed / dt) + 1
    memory = None
    if isinstance(ship.model, Sampled):
        memory = np.array([ship.model.begin(tuple(state), tuple(control)) for state in start.tolist()])
    return simulator(open_loop(ship)).run(
        start, series, open_loop_parameters(ship), memory0=memory, dt=dt, steps=steps, every=max(steps // 50, 1)
    )
