"""What is wrong with thrusters, mass and sampling in a problem; `lint` asks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..data import Trial
from ..models import unit
from ..models.common import thruster_controls
from ..ships import Ship
from . import Issue, Problem

# Measured revolutions may leave the tested range by this share of it: noise, and a governor that overshoots.
_BEYOND = 0.01
# Steps may differ by this share before a trial is taken at even steps, as `windows` does.
_UNEVEN = 0.02


def mass(problem: Problem) -> Iterator[Issue]:
    """What is doubtful about the mass matrix that the fit begins with; accepted, as fitted ones often are so."""
    model = problem.ship.model
    doubts = getattr(getattr(model, "inertia", None), "doubts", None)
    displaced = float(getattr(getattr(model, "body", None), "m", 0.0))
    for text in () if doubts is None else doubts(displaced, float(problem.ship.L_pp)):
        yield Issue("warning", "inertia", f"{text}; the fit begins there all the same")


def tested(ship: Ship) -> dict[str, tuple[float, float]]:
    """Revolutions [1/s], or throttle, for which the thrust map of each thruster holds, by control; unlimited, none."""
    parts = getattr(ship.model, "thrusters", None)
    found: dict[str, tuple[float, float]] = {}
    for name, part in () if parts is None else parts.items():
        if part.prefixes[0] == "throttle":
            found[f"throttle_{name}"] = float(part.low), float(part.high)
            continue
        n_max, control = float(getattr(part, "n_max", math.inf)), f"n_{name}"
        if n_max < 1e6 and control in ship.model.controls:
            servo: Any = ship.actuators.of(control)
            low, high = (float(getattr(servo, key, end)) for key, end in (("low", -n_max), ("high", n_max)))
            found[control] = max(low, -n_max), min(high, n_max)
    return found


def untested(ship: Ship, trial: Trial) -> Iterator[str]:
    """Revolutions of a trial beyond those for which thrust was tested, a thruster each."""
    for control, (low, high) in tested(ship).items():
        if control not in trial or not np.isfinite(trial[control]).any():
            continue
        least, most = float(np.nanmin(trial[control])), float(np.nanmax(trial[control]))
        slack = _BEYOND * max(abs(low), abs(high))
        if least < low - slack or most > high + slack:
            own = "" if unit(control) == "-" else f" {unit(control)}"
            yield f"{control} goes from {least:.4g} to {most:.4g}{own}, thrust was tested from {low:g} to {high:g}{own}"


def commands(problem: Problem, trial: Trial) -> Iterator[Issue]:
    """Commands that the thrust map was not made for, and commands of thrusters that the ship has not."""
    ship = problem.ship
    for what in untested(ship, trial):
        if problem.extrapolate:
            yield Issue("warning", trial.name, f"{what}; extrapolated, as asked")
        else:
            yield Issue("error", trial.name, f"{what}; test further, leave these rows out, or ask for it: "
                        "extrapolate = true in [data]")  # fmt: skip
    spare = [name for name in _thrusting(ship, trial) if np.nanmax(np.abs(trial[name]), initial=0.0) > 0]
    if spare:
        names = ", ".join(ship.model.thrusters.names)  # type: ignore[attr-defined]
        yield Issue("error", trial.name, f"commands thrusters by {', '.join(spare)} that {ship.name} has not (it has "
                    f"{names}); add them to the ship, rename the columns, or take them out")  # fmt: skip


def _thrusting(ship: Ship, trial: Trial) -> list[str]:
    """Channels named like controls of thrusters that the ship has not."""
    parts = getattr(ship.model, "thrusters", None)
    own = () if parts is None else thruster_controls(parts)
    stems = {control.partition("_")[0] for control in own}
    return [
        name for name in trial.channels
        if name.partition("_")[0] in stems and name not in (*own, "n_P") and not name.endswith(("_cmd", "_sd"))
        and not name.startswith("n_P_") and "_" in name
    ]  # fmt: skip


def sampling(trial: Trial) -> Iterator[Issue]:
    """Steps that differ: the fit interpolates."""
    steps = np.diff(trial.t)
    off = np.abs(steps - trial.dt) > _UNEVEN * trial.dt
    if off.any():
        yield Issue("warning", trial.name, f"{int(off.sum())} of {steps.size} steps differ from {trial.dt:.3g} s (from "
                    f"{steps.min():.3g} to {steps.max():.3g} s); taken at even steps by interpolation")  # fmt: skip
