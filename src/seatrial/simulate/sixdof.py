"""A ship of the unified model in a sea: first-order wave forces inside the run.

The forces depend on where the ship is, and where it is on the forces.  A run is repeated with the forces along the
track of the one before until the track stays: the forces are series of the kernel, which costs nothing but the
repetitions (waveform relaxation; on a finite time it converges whatever the ship).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..core.constants import GRAVITY
from ..core.parameters import update
from ..data import Array, Trial
from ..engine import Rollout, Scalars, SimulationError, System
from ..environment import CHANNELS, FORCES, Environment, InWaves, Weather
from ..environment.sea import Sea, Waves
from ..environment.sea.rao import Rao
from ..manoeuvres import Policy
from ..models.unified import HEAVING
from ..ships import Ship, ShipError
from .approach import rounded_down, time_step
from .lanes import Judge, Kernel, Steps, run, steered
from .run import blown_up, inputs, recorded

# Each round takes the forces along the track of the one before; what does not settle by then drifts off.
_ROUNDS = 30
_STAYS = 1e-3
"""Largest change of a wave's phase and of the heading [rad] between the last two runs."""
_PER_PERIOD = 0.25
"""Largest phase of the peak of the spectrum in a time step [rad]: forces are held over it, 0.3 % at 0.25."""


def step_in(ship: Ship, sea: Sea) -> float:
    """A time step that suits the ship and the waves [s]."""
    return min(time_step(ship), rounded_down(_PER_PERIOD / sea.spectrum.omega_P))


def forced(
    ship: Ship, policy: Policy, *, sea: Sea, forces: Rao, duration: float, speed: float | None = None,
    environment: Weather | Array | None = None, dt: float | None = None, device: str = "cpu",
) -> Trial:  # fmt: skip
    """Run `ship` under `policy` in a sea, see `run.simulate`; the trial has heave and pitch, too.

    Args:
        sea: its waves.
        forces: per metre of wave, see `Hydrodynamics.forces`, about midship at the height of the centre of gravity.

    Raises:
        ShipError: a ship of another family.
        SimulationError: the state leaves the ship's validity, or the track does not stay.
    """
    forces.covers(sea)
    step = step_in(ship, sea) if dt is None else dt
    steps = round(duration / step) + 1
    around = inputs(policy, environment, step, steps)
    here = Environment(*around[0, : len(CHANNELS)].tolist())
    U = ship.speed if speed is None else speed
    start = np.array([[0.0, 0.0, 0.0, U + here.current_x, here.current_y, 0.0]])
    done = solved(ship, policy, start, around, sea.waves, forces, step, steps, sea.spectrum.omega_P)
    if done.failures:
        raise SimulationError(f"{ship.name}: {blown_up(done.failures[0], ship)}", done.failures[0].time)
    rows = done.values[0]
    trial = recorded(ship, policy, done.t, rows, around, dt=step)
    own = {name: rows[:, ship.model.states.index(name)].copy() for name in HEAVING}
    zeta = _elevation(sea.waves, done.t, rows[:, 0], rows[:, 1])
    units = {**trial.units, "z": "m", "w": "m/s", "q": "rad/s", "zeta": "m"}
    return replace(trial.having(**own, zeta=zeta), units=units)


def solved(
    ship: Ship, policy: Policy, start: Array, around: Array, waves: Waves, forces: Rao, dt: float, steps: int,
    omega_P: float,
) -> Rollout:  # fmt: skip
    """The run whose wave forces are those along its own track; every step is stored."""
    if "theta" not in ship.model.states:
        raise ShipError(f"{ship.name}: wave forces move a ship in six degrees of freedom; make one of it (seakeeping)")
    lanes = steered(ship, policy, dt, {}, start, around[None], 1)
    kernel, judge = Kernel(_with_forces(lanes.kernel.system, ship)), Judge(ship.validity)
    table = forces.at(waves.omega)
    rows = np.broadcast_to(around, (steps, around.shape[1]))
    acting = np.zeros((steps, len(FORCES)))
    k_P = omega_P**2 / GRAVITY
    before: Array | None = None
    for _ in range(_ROUNDS):
        forced_by = replace(lanes, kernel=kernel, series=np.hstack([rows, acting])[None])
        now = run(forced_by, Steps(dt, steps), judge, threads=1)
        track = now.values[0, :, :3]
        if before is not None:
            moved = np.abs(track - before)
            if now.failures or (k_P * moved[:, :2].max() < _STAYS and moved[:, 2].max() < _STAYS):
                return now
        elif now.failures:
            return now
        before = track.copy()
        acting = _along(now, forces, table, waves, dt)
    raise SimulationError(
        f"{ship.name}: in these waves its track does not stay from run to run; take a shorter run", None
    )


def _along(done: Rollout, forces: Rao, table: Any, waves: Waves, dt: float) -> Array:
    """Forces held over each step: those at its middle, at the place between its ends."""
    track = done.values[0, :, :3]
    middle = np.vstack([0.5 * (track[1:] + track[:-1]), track[-1:]])
    rate = np.vstack([np.diff(track[:, :2], axis=0), np.zeros((1, 2))]) / dt
    t = done.t + 0.5 * dt
    return forces.motions(waves, t, middle[:, 0], middle[:, 1], middle[:, 2], rate, table)[0]


def _elevation(waves: Waves, t: Array, x: Array, y: Array) -> Array:
    return np.concatenate([waves.elevation(*(one[k : k + 2048] for one in (t, x, y))) for k in range(0, t.size, 2048)])


def _with_forces(system: System, ship: Ship) -> System:
    """The closed loop with wave forces as further series."""
    n, own = len(ship.model.controls), len(FORCES)
    at = [(name[5:], k) for k, name in enumerate(system.parameters) if name.startswith("ship.")]
    first: Any = system.before

    def before(
        t: Any, dt: Any, state: Scalars, memory: Scalars, series: Scalars, p: Scalars
    ) -> tuple[Scalars, Scalars, Scalars]:
        acting, after, logged = first(t, dt, state, memory, series[:-own], p)
        return (*acting, *series[-own:]), after, logged

    def derivative(state: Scalars, acting: Scalars, p: Scalars) -> Scalars:
        model: Any = update(ship.model, {name: p[k] for name, k in at})
        x, y, z, roll, pitch, yaw = acting[-own:]
        around = InWaves(Environment(*acting[n:-own]), (x, y, z, roll, pitch, yaw))
        return model.derivative(state, acting[:n], around)

    return replace(system, series=(*system.series, *FORCES), acting=(*system.acting, *FORCES), before=before,
                   derivative=derivative)  # fmt: skip
