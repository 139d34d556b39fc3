"""Simulation of a standard manoeuvre by name, up to its last index or the end of the ship's validity."""

from __future__ import annotations

import importlib
import inspect
import math
import pkgutil
from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from .. import manoeuvres
from ..core.files import in_reach
from ..core.parameters import unknown
from ..core.values import dataclass, field
from ..data import Trial
from ..engine import SimulationError
from ..engine.cuda.named import device_of
from ..environment import Weather
from ..forces import HARD_OVER
from ..manoeuvres import Index, Manoeuvre, Settings, by_demand
from ..ships import Ship
from ..ships.felt import driven
from ..ships.steering import by_angle, helm_limit, throttled
from ..simulate.approach import approach, step_doubt, surge_balance, time_step
from . import RequestError
from .asked import Approach, Around, InWaves, Orders, Span
from .request import (
    DEGREE,
    Note,
    doubts,
    finite,
    grounds_of,
    make_folder,
    positive,
    ship_of,
    silent,
    surroundings,
    untested,
)
from .seaway import Motion, Seaway, bound_for

# A manoeuvre that is not over after this many ship lengths of way never will be.
_FIRST, _LAST = 30.0, 2000.0
_OPTIONS = ("rudder", "heading", "side", "seed")


@cache
def known() -> dict[str, type[Manoeuvre]]:
    """Every manoeuvre of the package by its kind."""
    found: dict[str, type[Manoeuvre]] = {}
    for module in _modules():
        found |= _kinds(module)
    return dict(sorted(found.items()))


def _modules() -> list[str]:
    return [module.name for module in pkgutil.iter_modules(manoeuvres.__path__)]


@cache
def _kinds(module: str) -> Mapping[str, type[Manoeuvre]]:
    """The manoeuvres of one module by their kinds."""
    room = importlib.import_module(f"{manoeuvres.__name__}.{module}")
    own: list[tuple[str, Any]] = inspect.getmembers(room, inspect.isclass)
    return {cls.kind: cls for _, cls in own
            if cls.__module__ == room.__name__ and issubclass(cls, Manoeuvre) and cls.kind}  # fmt: skip


def find(name: str) -> type[Manoeuvre]:
    """A manoeuvre by its kind.

    Raises:
        RequestError: an unknown one; lists the known ones.
    """
    stem = name.replace("-", "_")
    if stem in _modules() and name in (named := _kinds(stem)):  # most modules are named as their manoeuvre
        return named[name]
    if name not in known():
        near = unknown(name, known(), "manoeuvre").partition(";")[0]
        raise RequestError(f"{near}; known: {', '.join(known())}")
    return known()[name]


def lacks(ship: Ship, cls: type[Manoeuvre]) -> str | None:
    """What a manoeuvre needs and the ship lacks; None where nothing is missing."""
    if cls.by_engine and not driven(ship):
        return f"no revolutions move {ship.name}; its model has no engine"
    return None


def order(name: str, ship: Ship, U: float, n_P: float, given: Mapping[str, Any]) -> Manoeuvre:
    """The named manoeuvre with the options `given` (degrees), at speed U [m/s] and revolutions n_P [1/s].

    Raises:
        RequestError: an option that the manoeuvre does not take, an impossible angle, a rudder beyond the ship's, or an
            engine that the ship lacks.
    """
    cls = find(name)
    if (why := lacks(ship, cls)) is not None:
        raise RequestError(f"{name}: {why}; take a manoeuvre by the rudder such as turning, or a ship with an engine")
    for option in given:
        if option not in cls.takes:
            takes = ", ".join(f"--{one}" for one in cls.takes) or "none of " + ", ".join(f"--{o}" for o in _OPTIONS)
            raise RequestError(f"{name} takes no --{option}; it takes {takes}")
    limit, highs = helm_limit(ship), {name: float(ship.actuators.of(name).high) for name in ship.model.controls}
    settings = Settings(
        n_P, U, ship.L_pp, limit, rudder=_angle("--rudder", given.get("rudder")),
        heading=_angle("--heading", given.get("heading")), side=_side(given.get("side", "starboard")),
        seed=int(given.get("seed", 1)),
        controls={name: high if math.isfinite(high) else 0.0 for name, high in highs.items()},
        astern=ship.validity.get("n_P", (-math.inf, 0.0))[0] < 0.0 and ship.validity.get("u", (-1.0, 0.0))[0] < 0.0,
    )  # fmt: skip
    if settings.rudder is not None and settings.rudder > limit * (1 + 1e-9):  # never a demand, which is checked before
        raise RequestError(
            f"--rudder is {given['rudder']:g} deg; the rudder of {ship.name} goes to {limit / DEGREE:g} deg"
        )
    return cls.ordered(settings)


def _side(text: str) -> float:
    if text not in ("port", "starboard"):
        raise RequestError(f"--side is '{text}'; known: port, starboard")
    return -1.0 if text == "port" else 1.0


def _angle(option: str, degrees: float | None) -> float | None:
    if degrees is not None and not (0 < degrees <= 360 and in_reach(degrees)):
        raise RequestError(f"{option} is {degrees:g} deg; it is a magnitude above 0 (--side gives the side)")
    return None if degrees is None else degrees * DEGREE


@dataclass(frozen=True)
class Simulated:
    """A simulated manoeuvre.

    Attributes:
        ship: the ship.
        policy: the manoeuvre as it was ordered.
        trial: the run.
        settings: speed, revolutions, set points, time step and surroundings, in the units of the request.
        complete: whether the manoeuvre ended and a requested duration was reached.
        reason: why the run ended before; None where it is complete.
        motions: motions in waves by name; empty without a sea.
    """

    ship: Ship
    policy: Manoeuvre
    trial: Trial
    settings: Mapping[str, object]
    complete: bool
    reason: str | None = None
    motions: Mapping[str, Motion] = field(default_factory=dict[str, Motion])

    @property
    def indices(self) -> Mapping[str, Index]:
        """The indices of the manoeuvre that the run reached; of a craft without rudder by its steering demand [%]."""
        found = self.policy.indices(self.trial, self.ship.L_pp)
        return found if by_angle(self.ship) else by_demand(found)


def simulate(
    ship: str | Path | Ship, manoeuvre: str | Manoeuvre, *, orders: Orders = Orders(), begin: Approach = Approach(),
    span: Span = Span(), around: Around = Around(), waves: InWaves = InWaves(), device: str = "cpu",
    out: Path | None = None, note: Note = silent,
) -> Simulated:  # fmt: skip
    """Run a manoeuvre; without a duration until it holds all its indices.

    Args:
        ship: a name of the library, a ship file or a ship.
        manoeuvre: its kind, see `known`, or the manoeuvre itself, which takes no rudder, heading or side.
        orders, begin, span: of the manoeuvre, the approach and the time; without a duration it is as long as it takes.
        around: weather and depth, see `surroundings`.
        waves: an irregular sea and the operators of the ship's motion in it, see `seaway`.
        device: where it runs.
        out: trial file of the run.
        note: takes warnings.

    Raises:
        RequestError, ShipError: a request that cannot be carried out.
        SimulationError: a run that fails at its very beginning.
    """
    dt, side = span.dt, orders.side
    positive(speed=begin.speed, duration=span.duration, dt=dt, depth=around.depth)
    device_of(device)
    finite(rps=begin.rps)
    seed = _seed(orders)
    takes = manoeuvre.takes if isinstance(manoeuvre, Manoeuvre) else find(manoeuvre).takes
    vessel = ship_of(ship)
    rudder = helm_of(vessel, manoeuvre, orders) if isinstance(manoeuvre, str) else orders.rudder
    rps = ahead_of(vessel, begin)
    _check_revolutions(vessel, rps)
    for line in doubts(vessel):
        note(f"warning: {line}")
    if dt is not None and (doubt := step_doubt(vessel, dt)) is not None:
        note(f"warning: --dt: {doubt}")
    U, n_P = approach(vessel, begin.speed, rps)
    seaway = bound_for(vessel, waves, seed, around, note, U)
    place = surroundings(vessel, seaway.around, seed, note)
    given = {"rudder": rudder, "heading": orders.heading, "side": side,
             "seed": orders.seed if not (around.gusts or waves.sea) or "seed" in takes else None}  # fmt: skip
    options = {key: value for key, value in given.items() if value is not None}
    policy = manoeuvre if isinstance(manoeuvre, Manoeuvre) else order(manoeuvre, vessel, U, n_P, options)
    run, reason = _run(vessel, policy, U, span, place.weather, device, seaway)
    for line in (*_unfelt(vessel, U, rps), *_beyond(vessel, run), *untested(grounds_of(ship, note), vessel, run)):
        note(line)
    run, motions = seaway.seen(run, note)
    if out is not None:
        from ..data.trialfile import write_trial

        make_folder(out.parent)
        write_trial(run, out)
        note(f"wrote {out}")
    ahead = {"throttle": 100.0 * n_P} if throttled(vessel) else {"rps": n_P}
    settings = {"speed": U, **ahead, **_set_points(vessel, policy, side), "duration": run.duration,
                "dt": dt or time_step(vessel), **place.settings, **seaway.settings}  # fmt: skip
    return Simulated(vessel, policy, run, settings, reason is None, reason, motions)


def _seed(orders: Orders) -> int:
    if orders.seed is not None and orders.seed < 0:
        raise RequestError(f"--seed is {orders.seed}; it is zero or above")
    return 1 if orders.seed is None else orders.seed


def helm_of(ship: Ship, manoeuvre: str, orders: Orders) -> float | None:
    """The helm [deg] of a rudder angle [deg] or a steering demand [%], whichever the ship has.

    Raises:
        RequestError: the other one, or a demand beyond 100 percent.
    """
    rudder, steer = orders.rudder, orders.steer
    if rudder is not None and not by_angle(ship):
        raise RequestError(f"--rudder: {ship.name} has no rudder; give --steer, a demand in percent of its greatest")
    if steer is None:
        return rudder
    if by_angle(ship):
        raise RequestError(f"--steer: {ship.name} is steered by an angle; give --rudder in degrees")
    if "rudder" not in find(manoeuvre).takes:
        raise RequestError(f"{manoeuvre} takes no --steer")
    if not 0.0 < steer <= 100.0:
        raise RequestError(f"--steer is {steer:g} percent; it is above 0 and at most 100 (--side gives the side)")
    return steer / 100.0 * HARD_OVER / DEGREE


def ahead_of(ship: Ship, begin: Approach) -> float | None:
    """The order ahead [1/s] of revolutions [1/s] or a throttle [%], whichever the ship has.

    Raises:
        RequestError: the other one, or a throttle beyond 100 percent.
    """
    rps, throttle = begin.rps, begin.throttle
    if rps is not None and throttled(ship):
        raise RequestError(f"--rps: {ship.name} is driven by throttle; give --throttle in percent of full ahead")
    if throttle is None:
        return rps
    if not throttled(ship):
        raise RequestError(f"--throttle: {ship.name} is driven by revolutions; give --rps in 1/s")
    if not (-100.0 <= throttle <= 100.0):
        raise RequestError(f"--throttle is {throttle:g} percent; it is from -100 (full astern) to 100")
    return throttle / 100.0


def _run(
    ship: Ship, policy: Manoeuvre, speed: float, span: Span, around: Weather, device: str, seaway: Seaway
) -> tuple[Trial, str | None]:
    """The run, and why it is not complete; without a duration it grows until it holds all its indices."""
    from ..simulate.run import simulate as run_once

    duration, dt = span.duration, span.dt
    length = duration or _FIRST * ship.L_pp / max(speed, 1e-3)
    limit = length if duration else _LAST * ship.L_pp / max(speed, 1e-3)
    begin = 0.0 if policy.from_rest else speed
    once = partial(run_once, ship, policy, speed=begin, environment=around, dt=dt, device=device)
    if seaway.sea is not None and seaway.forces is not None:
        from ..simulate.sixdof import forced

        once = partial(forced, ship, policy, speed=begin, environment=around, dt=dt, device=device, sea=seaway.sea,
                       forces=seaway.forces)  # fmt: skip
    while True:
        try:
            run = once(duration=length)
        except SimulationError as error:
            return _until(ship, policy, once, span, error)
        complete = policy.complete(run) or (duration is not None and policy.timed)
        if complete or 2 * length > limit:
            return run, None if complete else f"not over after {run.duration:g} s"
        length *= 2


def _until(
    ship: Ship, policy: Manoeuvre, once: Callable[..., Trial], span: Span, error: SimulationError
) -> tuple[Trial, str | None]:
    """The run up to where it left the ship's validity or diverged.

    Raises:
        SimulationError: at its very beginning.
    """
    step = span.dt or time_step(ship)
    end = 0.0 if error.time is None else error.time - step
    if end < 2.0 * step:
        raise error
    run = once(duration=end)
    whole = span.duration is None and not policy.timed and policy.complete(run)
    return run, None if whole else str(error)


def _unfelt(ship: Ship, U: float, rps: float | None) -> Iterator[str]:
    """What a user gave that the ship's model ignores."""
    if rps is not None and surge_balance(ship, U, rps) == surge_balance(ship, U, 0.5 * rps - 1):
        yield f"note: --rps: revolutions do not enter the model of {ship.name}"


def _beyond(ship: Ship, run: Trial) -> Iterator[str]:
    """Where the controls went beyond what the ship's file calls valid."""
    for name in ship.model.controls:
        low, high = ship.validity.get(name, (-math.inf, math.inf))
        least, most = float(np.min(run[name])), float(np.max(run[name]))
        if least < low - 1e-9 or most > high + 1e-9:
            yield (f"note: {name} went from {least:.4g} to {most:.4g}; the file of {ship.name} claims to hold "
                   f"within [{low:g}, {high:g}] ([validity])")  # fmt: skip


def _check_revolutions(ship: Ship, rps: float | None) -> None:
    """Refuse revolutions at which the thrust of the ship was never measured."""
    if rps is None:
        return
    from ..identify.lint import tested

    for control, (low, high) in tested(ship).items():
        if control.startswith("n_") and not low <= rps <= high:
            raise RequestError(
                f"--rps is {rps:g}; thrust by {control} of {ship.name} was tested from {low:g} to {high:g} 1/s"
            )


def _set_points(ship: Ship, policy: Manoeuvre, side: str | None) -> dict[str, object]:
    rudder, heading = (vars(policy).get(name) for name in ("delta", "psi"))
    found: dict[str, object] = {}
    if isinstance(rudder, float):
        found |= {"rudder": abs(rudder / DEGREE)} if by_angle(ship) else {"steer": 100.0 * abs(rudder) / HARD_OVER}
    if isinstance(heading, float):
        found["heading"] = heading / DEGREE
    return {**found, "side": side or "starboard"} if "side" in policy.takes else found
