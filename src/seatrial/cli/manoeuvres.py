"""The command that runs a manoeuvre, and how words of the command line become one."""

from __future__ import annotations

import importlib
import inspect
import math
import pkgutil
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from .. import manoeuvres
from ..core.files import in_reach
from ..core.parameters import unknown, values
from ..data import Trial
from ..engine import SimulationError
from ..environment import Weather
from ..manoeuvres import Manoeuvre, Settings
from ..ships import Ship
from ..ships.felt import driven
from ..simulate.run import surge_balance
from .support import (
    DEGREE,
    UsageError,
    around_ship,
    doubts,
    emit,
    finite,
    index_json,
    make_folder,
    note,
    positive,
    read_ship,
    show_indices,
)  # fmt: skip

# A manoeuvre that is not over after this many ship lengths of way never will be.
_FIRST, _LAST = 30.0, 2000.0
_OPTIONS = ("rudder", "heading", "side", "seed")


@cache
def known() -> dict[str, type[Manoeuvre]]:
    """Every manoeuvre of the package by its kind."""
    found: dict[str, type[Manoeuvre]] = {}
    for module in pkgutil.iter_modules(manoeuvres.__path__, f"{manoeuvres.__name__}."):
        members: list[tuple[str, Any]] = inspect.getmembers(importlib.import_module(module.name), inspect.isclass)
        for _, cls in members:
            if cls.__module__ == module.name and issubclass(cls, Manoeuvre) and cls.kind:
                found[cls.kind] = cls
    return dict(sorted(found.items()))


def find(name: str) -> type[Manoeuvre]:
    """A manoeuvre by its kind.

    Raises:
        UsageError: an unknown one; lists the known ones.
    """
    if name not in known():
        near = unknown(name, known(), "manoeuvre").partition(";")[0]
        raise UsageError(f"{near}; known: {', '.join(known())}")
    return known()[name]


def rudder_limit(ship: Ship) -> float:
    """Greatest angle of what obeys the order delta [rad]; infinite without a limit."""
    servos = [ship.actuators.of(c) for c, (order, _) in zip(ship.model.controls, ship.model.follows, strict=True)
              if order == "delta"]  # fmt: skip
    return min((abs(float(servo.high)) for servo in servos), default=math.inf)


def lacks(ship: Ship, cls: type[Manoeuvre]) -> str | None:
    """What of a ship is missing for a manoeuvre; None where nothing is."""
    if cls.by_engine and not driven(ship):
        return f"no revolutions move {ship.name}; her model has no engine"
    return None


def order(name: str, ship: Ship, U: float, n_P: float, given: dict[str, Any]) -> Manoeuvre:
    """The named manoeuvre as a user wants it; `given` holds the options that were given.

    Raises:
        UsageError: an option the manoeuvre does not take, an angle that cannot be, a rudder beyond the ship's, or an
            engine that she lacks.
    """
    cls = find(name)
    if (why := lacks(ship, cls)) is not None:
        raise UsageError(f"{name}: {why}; take a manoeuvre by the rudder such as turning, or a ship with an engine")
    for option in given:
        if option not in cls.takes:
            takes = ", ".join(f"--{one}" for one in cls.takes) or "none of " + ", ".join(f"--{o}" for o in _OPTIONS)
            raise UsageError(f"{name} takes no --{option}; it takes {takes}")
    limit = rudder_limit(ship)
    settings = Settings(
        n_P, U, ship.L_pp, limit, rudder=_angle("--rudder", given.get("rudder")),
        heading=_angle("--heading", given.get("heading")), side=_side(given.get("side", "starboard")),
        seed=int(given.get("seed", 1)), controls=_greatest(ship),
        astern=ship.validity.get("n_P", (-math.inf, 0.0))[0] < 0.0 and ship.validity.get("u", (-1.0, 0.0))[0] < 0.0,
    )  # fmt: skip
    if settings.rudder is not None and settings.rudder > limit * (1 + 1e-9):
        raise UsageError(
            f"--rudder is {given['rudder']:g} deg; the rudder of {ship.name} goes to {limit / DEGREE:g} deg"
        )
    return cls.ordered(settings)


def _greatest(ship: Ship) -> dict[str, float]:
    found = {name: float(ship.actuators.of(name).high) for name in ship.model.controls}
    return {name: high if math.isfinite(high) else 0.0 for name, high in found.items()}


def _side(text: str) -> float:
    if text not in ("port", "starboard"):
        raise UsageError(f"--side is '{text}'; known: port, starboard")
    return -1.0 if text == "port" else 1.0


def _angle(option: str, degrees: float | None) -> float | None:
    if degrees is not None and not (0 < degrees <= 360 and in_reach(degrees)):
        raise UsageError(f"{option} is {degrees:g} deg; it is a magnitude above 0 (--side gives the side)")
    return None if degrees is None else degrees * DEGREE


@dataclass(frozen=True)
class Ran:
    """A run and how it ended.

    Attributes:
        complete: whether it is all that was asked for: the manoeuvre over, and a duration that was given reached.
        reason: why it ended before; None where it did not.
    """

    trial: Trial
    complete: bool
    reason: str | None = None


def run_manoeuvre(
    ship: Ship, policy: Manoeuvre, *, speed: float, duration: float | None, dt: float | None, around: Weather
) -> Ran:
    """The run; without a duration it grows until it holds all its indices."""
    from ..simulate.run import simulate

    length = duration or _FIRST * ship.L_pp / max(speed, 1e-3)
    limit = length if duration else _LAST * ship.L_pp / max(speed, 1e-3)
    begin = 0.0 if policy.from_rest else speed
    while True:
        try:
            run = simulate(ship, policy, speed=begin, duration=length, environment=around, dt=dt)
        except SimulationError as error:
            return _until(ship, policy, begin, around, dt, duration, error)
        complete = policy.complete(run) or (duration is not None and policy.timed)
        if complete or 2 * length > limit:
            return Ran(run, complete, None if complete else f"not over after {run.duration:g} s")
        length *= 2


def _until(
    ship: Ship, policy: Manoeuvre, speed: float, around: Weather, dt: float | None, duration: float | None,
    error: SimulationError,
) -> Ran:  # fmt: skip
    """The run up to where it left the ship's validity or blew up.

    Raises:
        SimulationError: at its very beginning.
    """
    from ..simulate.run import simulate, time_step

    step = dt or time_step(ship)
    end = 0.0 if error.time is None else error.time - step
    if end < 2.0 * step:
        raise error
    run = simulate(ship, policy, speed=speed, duration=end, environment=around, dt=dt)
    whole = duration is None and not policy.timed and policy.complete(run)
    return Ran(run, whole, None if whole else str(error))


def unfelt(ship: Ship, U: float, rps: float | None) -> Iterator[str]:
    """What a user gave that the ship's model does not look at."""
    if rps is not None and surge_balance(ship, U, rps) == surge_balance(ship, U, 2 * rps + 1):
        yield f"note: --rps: revolutions do not enter the model of {ship.name}"


def left(ship: Ship, run: Trial) -> Iterator[str]:
    """Where the controls went beyond what the ship's file calls valid."""
    for name in ship.model.controls:
        low, high = ship.validity.get(name, (-math.inf, math.inf))
        least, most = float(np.min(run[name])), float(np.max(run[name]))
        if least < low - 1e-9 or most > high + 1e-9:
            yield (f"note: {name} went from {least:.4g} to {most:.4g}; the file of {ship.name} claims to hold "
                   f"within [{low:g}, {high:g}] ([validity])")  # fmt: skip


def simulate(
    ship: Annotated[str, typer.Argument(help="A name of the library (seatrial ships) or a ship file.")],
    name: Annotated[str, typer.Argument(metavar="MANOEUVRE", help=f"One of: {', '.join(known())}.")],
    rudder: Annotated[float | None, typer.Option(help="Rudder angle, magnitude [deg].")] = None,
    heading: Annotated[float | None, typer.Option(help="Heading change, such as of a zigzag [deg].")] = None,
    side: Annotated[str | None, typer.Option(help="First side: port or starboard.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of a random manoeuvre, and of the gusts.")] = None,
    speed: Annotated[float | None, typer.Option(help="Approach speed [m/s].")] = None,
    rps: Annotated[float | None, typer.Option(help="Propeller revolutions [1/s].")] = None,
    duration: Annotated[float | None, typer.Option(help="Length of the run [s]; else until it is over.")] = None,
    dt: Annotated[float | None, typer.Option(help="Time step [s].")] = None,
    wind: Annotated[str | None, typer.Option(help="True wind M/S,DEG: where it comes from.")] = None,
    gusts: Annotated[str | None, typer.Option(help="Spectrum of the gusts about that wind.")] = None,
    current: Annotated[str | None, typer.Option(help="Current M/S,DEG: where it goes.")] = None,
    waves: Annotated[str | None, typer.Option(help="Waves M,S,DEG: height, mean period, where from.")] = None,
    depth: Annotated[float | None, typer.Option(help="Depth of the water [m]; deep unless given.")] = None,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Trial file to write (.csv).")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")] = False,
) -> None:
    """A manoeuvre and its indices; exit 1 where it does not come to its end."""
    from ..simulate.approach import approach, step_doubt, time_step

    positive(speed=speed, duration=duration, dt=dt, depth=depth)
    finite(rps=rps)
    if seed is not None and seed < 0:
        raise UsageError(f"--seed is {seed}; it is zero or above")
    find(name)
    vessel = read_ship(ship)
    _tested(vessel, rps)
    for line in doubts(vessel):
        note(f"warning: {line}")
    if dt is not None and (doubt := step_doubt(vessel, dt)) is not None:
        note(f"warning: --dt: {doubt}")
    around = around_ship(vessel, wind, gusts, current, waves, depth, 1 if seed is None else seed)
    U, n_P = approach(vessel, speed, rps)
    given = {"rudder": rudder, "heading": heading, "side": side}
    if not gusts or "seed" in find(name).takes:
        given["seed"] = seed
    policy = order(name, vessel, U, n_P, {k: v for k, v in given.items() if v is not None})
    ran = run_manoeuvre(vessel, policy, speed=U, duration=duration, dt=dt, around=around.weather)
    run = ran.trial
    for line in (*unfelt(vessel, U, rps), *left(vessel, run)):
        note(line)
    if out is not None:
        write(run, out)
    settings = {"speed": U, "rps": n_P, **_set_points(policy, side), "duration": run.duration,
                "dt": dt or time_step(vessel), **around.settings}  # fmt: skip
    _tell(vessel, policy, ran, {"ship": vessel.name, "manoeuvre": name, "settings": settings}, json)


def _tell(ship: Ship, policy: Manoeuvre, ran: Ran, head: dict[str, Any], json: bool) -> None:
    """The figures of a run, and how it ended.

    Raises:
        Exit: with status 1, of a run that is not complete.
    """
    indices = {n: index_json(i) for n, i in policy.indices(ran.trial, ship.L_pp).items()}
    ended = {"complete": ran.complete, "reason": ran.reason, "time": ran.trial.duration}
    if json:
        emit({**head, **ended, "indices": indices})
    else:
        show_indices(f"{ship.name}, {policy.kind}", indices)
    if not ran.complete:
        note(f"error: {ran.reason}; what the run never reached is left out")
        raise typer.Exit(1)


def _tested(ship: Ship, rps: float | None) -> None:
    """Refuse revolutions for which the thrust of the ship was never measured."""
    from ..identify.lint import tested

    for control, (low, high) in tested(ship).items():
        if rps is not None and control.startswith("n_") and not low <= rps <= high:
            raise UsageError(
                f"--rps is {rps:g}; thrust by {control} of {ship.name} was tested from {low:g} to {high:g} 1/s"
            )


def _set_points(policy: Any, side: str | None) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if isinstance(values(policy).get("delta"), float):
        found["rudder"] = abs(policy.delta / DEGREE)
    if isinstance(values(policy).get("psi"), float):
        found["heading"] = policy.psi / DEGREE
    return {**found, "side": side or "starboard"} if "side" in policy.takes else found


def write(run: Trial, out: Path) -> None:
    """Write a trial file and say so."""
    from ..data.trialfile import write_trial

    make_folder(out.parent)
    write_trial(run, out)
    note(f"wrote {out}")
