"""Controls that no log has: what their actuator makes of the order on record, or revolutions that hold the first speed.

`[data] assumed` names them.  Revolutions that hold a speed are those of the ship file in calm water; a fit estimates by
which share they are off in each trial (`[nuisance] common`, "level.n_P.TRIAL"), as it cannot tell the thrust from the
resistance by them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from ..data import Array, DataError, Trial
from ..data.prepare import derived, marked
from ..identify import StudyError
from ..models import unit
from ..ships import Ship, ShipError
from ..simulate.approach import approach, straight
from ..simulate.begun import begun
from ..simulate.steering import logged

_FIRST = 3.0
"""Lengths of the ship in which a trial shows its first speed."""

SPEED = "the first speed"
"""What tells revolutions that are not logged, as `derived` of a trial has it."""

LEVEL = 0.1
"""Standard deviation of the share by which revolutions of a first speed are off: a tenth of the speed is current."""


def wanting(trial: Trial, ship: Ship) -> dict[str, str]:
    """Controls that the trial does not have, and what tells them: the order, the first speed, or "" for nothing."""
    controls, model, out = ship.model.controls, ship.model, dict[str, str]()
    for name, (stand_in, _), (order, _) in zip(controls, model.stands_for, model.follows, strict=True):
        if not (logged(trial, name) or logged(trial, stand_in)):
            ordered = logged(trial, f"{name}_cmd")
            out[name] = f"{name}_cmd" if ordered else SPEED if order == "n_P" and unit(name) == "1/s" else ""
    return out


def with_assumed(trial: Trial, names: Sequence[str], ship: Ship) -> Trial:
    """The trial with these controls, as far as it does not have them, marked as derived.

    Raises:
        StudyError: a name that is no control of the ship, or that neither an order nor a speed tells.
        ShipError: no revolutions hold the first speed.
    """
    for name in names:
        if name not in ship.model.controls:
            raise StudyError(f"'{name}' is no control of {ship.name}, which has {', '.join(ship.model.controls)}")
    found = {name: of for name, of in wanting(trial, ship).items() if name in names}
    for name, of in found.items():
        if not of:
            raise StudyError(f"{trial.name}: no {name} and no order {name}_cmd; log it, or leave the trial out")
    values = {name: _holding(trial, name, ship) if of == SPEED else _obeyed(trial, name, ship)
              for name, of in found.items()}  # fmt: skip
    return marked(trial.having(**values), found)


def unassumed(trial: Trial, ship: Ship) -> str:
    """Why what the trial lacks cannot be assumed; empty where it can, or where it lacks nothing."""
    try:
        with_assumed(trial, tuple(wanting(trial, ship)), ship)
    except (StudyError, ShipError) as error:
        return str(error).removeprefix(f"{trial.name}: ")
    return ""


def levels(trials: Iterable[Trial], ship: Ship) -> tuple[str, ...]:
    """Errors that a fit estimates for revolutions of a first speed: of the first such control of each trial."""
    first = {trial.name: next((one for one in ship.model.controls if derived(trial).get(one) == SPEED), "")
             for trial in trials}  # fmt: skip
    return tuple(f"level.{control}.{name}" for name, control in first.items() if control)


def _obeyed(trial: Trial, name: str, ship: Ship) -> Array:
    """What the actuator of the ship file makes of the order, which counts until the next one."""
    servo, order = ship.actuators.of(name), trial[f"{name}_cmd"]
    good = np.isfinite(order)
    last = np.searchsorted(trial.t[good], trial.t - float(servo.dead_time), "right") - 1
    target = order[good][np.maximum(last, 0)]
    if servo.at_once:
        return target
    memory, out = (float(target[0]), *(0.0 for _ in servo.extra)), [float(target[0])]
    for aim, dt in zip(target[:-1].tolist(), np.diff(trial.t).tolist(), strict=True):
        _, memory = servo.advance(memory, aim, dt)
        out.append(float(memory[0]))
    return np.array(out)


def _holding(trial: Trial, name: str, ship: Ship) -> Array:
    """The constant that holds the first speed."""
    try:
        state = begun(trial)[0]
    except DataError as error:
        raise StudyError(str(error)) from None
    u, since = state[:, 3], trial.t - trial.t[0]
    fast = float(np.nanmax(np.abs(u)))
    early = np.isfinite(u) & (since <= max(_FIRST * ship.L_pp / max(fast, 1e-9), 5.0 * trial.dt))
    first = float(np.median(u[early])) if early.any() else math.nan
    if not first > 0.0:
        raise StudyError(f"{trial.name}: it does not begin ahead, so its speed tells no {name}; log it, or leave the "
                         "trial out")  # fmt: skip
    return np.full(len(trial), holds(ship, name, first))


def holds(ship: Ship, name: str, speed: float) -> float:
    """The control [1/s] that holds a speed [m/s] in calm water; ShipError: none does."""
    return float(straight(ship, approach(ship, speed=speed)[1])[ship.model.controls.index(name)])
