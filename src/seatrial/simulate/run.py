"""Closed-loop runs: a ship and a policy to a trial, or to many lanes at once.

`simulate` runs policy, actuators and ship in one compiled step; `campaign` runs one manoeuvre over many lanes with
parameters that differ from lane to lane.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..core.parameters import values
from ..data import UNITS, Array, Trial
from ..engine import Failure, Rollout, SimulationError
from ..engine.cuda import Device
from ..environment import CHANNELS, VECTORS, Environment, Uniform, Weather
from ..manoeuvres import Policy, Scheduled
from ..models import STATES, Sampled, unit
from ..ships import Ship, ShipError
from .approach import approach, fastest, straight, surge_balance, time_step
from .lanes import Judge, Steps, check_varied, run, steered
from .loop import closed_loop, logged, open_loop, open_loop_parameters
from .place import Place, aground_or_inside, depths

__all__ = ["approach", "campaign", "closed_loop", "fastest", "open_loop", "open_loop_parameters", "simulate",
           "straight", "surge_balance", "time_step"]  # fmt: skip

SIMULATED = "simulated by seatrial"
"""Source of a simulated trial, which has every channel of its environment that was not zero."""

_ROWS = 2e6
"""Largest number of rows of one run that are kept in memory."""


def surroundings(environment: Weather | Array | None, dt: float, steps: int) -> Array:
    """Environment channels as series, shape (steps or 1, 8); ShipError: an array of another shape."""
    if isinstance(environment, np.ndarray):
        if environment.ndim != 2 or environment.shape[1] != len(CHANNELS) or len(environment) not in (1, steps):
            wanted = f"(1 or {steps}, {len(CHANNELS)})"
            raise ShipError(f"environment: an array of shape {environment.shape}; {steps} samples take {wanted}")
        return environment
    return (environment or Uniform()).series(dt, steps)


def inputs(policy: Policy, environment: Weather | Array | None, dt: float, steps: int) -> Array:
    """Inputs per step: the environment, then the schedule of the policy."""
    return scheduled(policy, surroundings(environment, dt, steps)[None], dt, steps)[0]


def scheduled(policy: Policy, around: Array, dt: float, steps: int) -> Array:
    """The environment, shape (lanes or 1, steps or 1, 8), with the schedule of the policy behind it."""
    if not isinstance(policy, Scheduled):
        return around
    shape = len(around), steps
    orders = np.broadcast_to(policy.schedule(dt, steps), (*shape, len(policy.given)))
    return np.concatenate([np.broadcast_to(around[:, :steps], (*shape, len(CHANNELS))), orders], axis=2)


def campaign(
    ship: Ship, policy: Policy, vary: Mapping[str, Array], *, speed: float, duration: float,
    environment: Weather | Array | None = None, dt: float | None = None, every: int = 1,
    method: str = "rk4", threads: int | None = None, start: tuple[float, ...] | None = None,
    device: str | Device = "cpu", precision: str = "double", place: Place | None = None,
) -> Rollout:  # fmt: skip
    """Run `policy` over many lanes at once, one compiled kernel for all.

    Args:
        vary: value per lane of each parameter that differs, by the names of `loop.closed_loop`.
        speed: initial speed straight ahead through the water [m/s]; other arguments as in `simulate`.
        threads: of the processor; None takes all of them.
        device: "cpu", or "cuda" for a GPU.
        precision: "double"; a GPU also takes "single".
        place: where the ship sails (`place.place_of`); the depth is then that of its chart.

    Returns:
        The stored rows; a lane that fails is listed in `failures`, the others continue.

    Raises:
        ShipError: a policy that orders a control that the ship lacks; a step that the model does not support.
        DeviceError: the device is not here.
    """
    step = _checked_step(ship, dt)
    steps = _checked_steps(ship, duration, step, every)
    check_varied(ship, policy, vary)
    lanes = len(next(iter(vary.values()))) if vary else 1
    around = inputs(policy, environment, step, steps)
    here = Environment(*around[0, : len(CHANNELS)].tolist())
    # under way, heading north at `speed` through the water, plus the current over ground
    six = (0.0, 0.0, 0.0, speed + here.current_x, here.current_y, 0.0) if start is None else start
    if len(six) not in (len(STATES), len(ship.model.motion)):
        raise ShipError(f"start: {len(six)} numbers; give {', '.join(ship.model.motion)}")
    if place is not None and (wrong := aground_or_inside(place, six[: len(STATES)], float(ship.model.draught))):
        raise ShipError(f"{ship.name}: {wrong}; move the start into the water")
    begun = np.array([six], dtype=np.float64)
    under_way = steered(ship, policy, step, vary, begun, around[None], lanes, device, precision, place)
    return run(under_way, Steps(step, steps, every, method), Judge.of(ship, around, every), threads)


def surrounded(around: Array, rows: int) -> dict[str, Array]:
    """Wind, current, waves and depth as channels of a trial, those that are not zero."""
    columns = dict(zip(CHANNELS, np.broadcast_to(around, (rows, len(CHANNELS))).T, strict=True))
    found: dict[str, Array] = {}
    for name, size, direction in VECTORS:
        north, east = columns[f"{name}_x"], columns[f"{name}_y"]
        if np.any(north) or np.any(east):
            found |= {size: np.hypot(north, east), direction: np.arctan2(east, north)}
    if "H_S" in found:
        found["T_W"] = columns["wave_T"].copy()
    if np.any(columns["per_depth"]):
        with np.errstate(divide="ignore"):
            found["depth"] = 1.0 / columns["per_depth"]
    return found


def _averaged(rows: Array, every: int, angle: bool = False) -> Array:
    """Mean from each stored row up to the next one; of directions by the smaller angle from that row."""
    starts = np.arange(0, len(rows), every)
    count = np.diff(np.append(starts, len(rows)))
    beyond = rows - np.repeat(rows[starts], count, axis=0)
    if angle:
        beyond = np.arctan2(np.sin(beyond), np.cos(beyond))
    return rows[starts] + np.add.reduceat(beyond, starts, axis=0) / count.reshape(-1, *([1] * (rows.ndim - 1)))


def blown_up(failure: Failure, ship: Ship) -> str:
    water = " through the water" if failure.state in ("u", "v_m") and math.isfinite(failure.value) else ""
    text = f"{failure.state} = {failure.value:.4g}{water} at t = {failure.time:g} s"
    if not math.isfinite(failure.value):
        return f"{text}; the model blows up"
    low, high = ship.validity[failure.state]
    return f"{text} is outside [{low:g}, {high:g}], the range of validity in its file ([validity])"


def _checked_steps(ship: Ship, duration: float, step: float, every: int) -> int:
    """Samples of a run; refuse a run without a step, or with too many rows for memory."""
    steps = duration / step
    if not 0.5 <= steps < math.inf:
        raise ShipError(f"{ship.name}: a run of {duration:g} s has no step of {step:g} s in it")
    if steps / every > _ROWS:
        wanted = f"store fewer than {_ROWS:.0e}, by a longer step or a shorter run"
        raise ShipError(f"{ship.name}: {steps / every:.3g} rows; {wanted}")
    return round(steps) + 1


def _checked_step(ship: Ship, dt: float | None) -> float:
    if dt is not None and isinstance(ship.model, Sampled) and abs(dt / ship.model.dt - 1) > 1e-9:
        raise ShipError(f"{ship.name}: runs at its own step of {ship.model.dt:g} s only; got {dt:g} s")
    return time_step(ship) if dt is None else dt


def simulate(
    ship: Ship, policy: Policy, *, speed: float | None = None, duration: float,
    environment: Weather | Array | None = None, dt: float | None = None, every: int = 1,
    method: str = "rk4", name: str | None = None, start: tuple[float, ...] | None = None,
    device: str | Device = "cpu", place: Place | None = None,
) -> Trial:  # fmt: skip
    """Run `ship` under `policy` and return the trial that a logger would record.

    Args:
        policy: a manoeuvre or any other policy.
        speed: initial speed straight ahead through the water, heading north [m/s]; None takes the ship's.
        duration: length of the run [s].
        environment: steady wind, current and waves, any other `Weather`, or series of the channels of
            `environment.CHANNELS` per step, shape (steps, 8); None is still air and still, deep water.
        dt: time step [s]; None chooses one by `time_step`.
        every: record every so many steps.
        start: initial (x, y, psi, u, v_m, r) over ground, in place of `speed`; of a ship that rolls (phi, p) as well.
        device: "cpu", or "cuda" for a GPU, which is worth its while for campaigns only.
        place: where the ship sails (`place.place_of`).

    Returns:
        The states, each control as it acts and as ordered (``<control>_cmd``), and the channels of the environment
        that are not zero.  The environment, and a control without dynamics, is the mean from a row to the next.

    Raises:
        SimulationError: the state blows up or leaves the ship's validity; names time and state.
    """
    step, controls = _checked_step(ship, dt), ship.model.controls
    at_once = any(ship.actuators.of(control).at_once for control in controls)
    # An order may change between stored rows: every step is kept, so that the acting values can be averaged.
    stride = every if at_once and duration / step <= _ROWS else 1
    done = campaign(
        ship, policy, {}, speed=ship.speed if speed is None else speed, duration=duration,
        environment=environment, dt=dt, every=every // stride, method=method, threads=1, start=start,
        device=device, place=place,
    )  # fmt: skip
    if done.failures:
        raise SimulationError(f"{ship.name}: {blown_up(done.failures[0], ship)}", done.failures[0].time)
    around = surroundings(environment, step, round(duration / step) + 1)
    trial = recorded(ship, policy, done.t, done.values[0], around, dt=step, every=every, stride=stride, name=name)
    return trial if place is None or place.grid is None else trial.having(depth=depths(place, trial["x"], trial["y"]))


def recorded(
    ship: Ship, policy: Policy, t: Array, rows: Array, around: Array, *, dt: float, every: int = 1, stride: int = 1,
    name: str | None = None,
) -> Trial:  # fmt: skip
    """The trial of one run from its stored rows, see `simulate`.

    Args:
        t: time of the stored rows [s].
        rows: shape (stored rows, columns of `closed_loop`).
        around: environment per step, shape (steps or 1, 8).
        dt: time step [s].
        every: steps from row to row of the trial.
        stride: stored rows from row to row of the trial; above 1 where controls without dynamics are averaged.
    """
    controls, columns = ship.model.controls, closed_loop(ship, policy, dt).stored
    held = tuple(control for control in controls if ship.actuators.of(control).at_once)
    held = held if every == 1 or stride > 1 else ()
    kept = (*ship.model.motion, *controls, *logged(ship, policy))
    channels = {n: rows[::stride, columns.index(n)].copy() for n in kept}
    for control in held:  # the value from this row on, not the one before it
        servo, ordered = ship.actuators.of(control), rows[:, columns.index(f"{control}_cmd")]
        acted = np.clip(ordered, servo.low, servo.high)
        channels[control] = _averaged(acted, stride, angle=unit(control) == "rad")
    kind = policy.kind or type(policy).__name__.lower()
    meta = {
        "schema": "manoeuvre-trial/1",
        "ship": ship.name,
        "L_pp": ship.L_pp,
        "kind": kind,
        "set_points": dict(values(policy)),
        "source": SIMULATED,
        **({"held": list(held)} if held else {}),
    }
    times = t[::stride]
    channels |= surrounded(_averaged(around, every), len(times))
    units = {n: unit(n) for n in kept if n not in UNITS}
    return Trial(name or f"{ship.name}_{kind}", times, channels, units=units, meta=meta)
