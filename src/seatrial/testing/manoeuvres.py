"""Checks of a manoeuvre, ordered with its usual settings, against the contract of `seatrial.manoeuvres`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import casadi as ca
import numpy as np

from .. import manoeuvres as room
from ..core.parameters import values, walk
from ..data import Array
from ..manoeuvres import Manoeuvre, Scheduled, Settings
from ..models import STATES
from ..ships import Ship
from ..simulate.run import approach, simulate
from .discovery import ContractError, classes_of, require, state_size

TAKES = ("rudder", "heading", "side", "seed")
_LENGTHS = 20.0
"""Duration of the run of a manoeuvre, in the times in which the ship covers its length."""


@cache
def manoeuvres() -> dict[str, type[Manoeuvre]]:
    """Every manoeuvre of the package by its kind."""
    return {cls.kind: cls for cls in classes_of(room) if issubclass(cls, Manoeuvre) and cls.kind}


def ordered(cls: type[Manoeuvre], ship: Ship) -> Manoeuvre:
    """The manoeuvre with its usual settings for a ship."""
    speed, n_P = approach(ship)
    greatest = {name: float(ship.actuators.of(name).high) for name in ship.model.controls}
    bounded = {name: high if math.isfinite(high) else 0.0 for name, high in greatest.items()}
    return cls.ordered(Settings(n_P, speed, ship.L_pp, float(ship.actuators.rudder.high), controls=bounded))


def _states(ship: Ship, count: int) -> Array:
    return np.random.default_rng(5).uniform(-1, 1, (count, len(STATES))) * state_size(ship)[: len(STATES)]


def named(cls: type[Manoeuvre], ship: Ship) -> None:
    """It has a kind, takes known settings, and its numbers are declared."""
    require(cls.kind, f"{cls.__name__} has no kind, so the command line does not offer it")
    require(set(cls.takes) <= set(TAKES), f"takes {cls.takes}; known: {TAKES}")
    for path, meaning, _ in walk(ordered(cls, ship)):
        require(meaning.about, f"{path}: no word on what it is")


def shapes(cls: type[Manoeuvre], ship: Ship) -> None:
    """`begin` and `command` give as many numbers as `memory` and `orders` name, finite at any state."""
    policy: Any = ordered(cls, ship)
    given = _given(policy)
    require(len(set(policy.orders)) == len(policy.orders), f"orders {policy.orders} twice")
    for row in _states(ship, 20).tolist():
        memory = policy.begin(tuple(row))
        require(len(memory) == len(policy.memory), f"begin gives {len(memory)} numbers for memory {policy.memory}")
        orders, after = policy.command(0.5, tuple(row), memory, *given)
        require(len(orders) == len(policy.orders), f"command gives {len(orders)} orders for {policy.orders}")
        require(len(after) == len(policy.memory), f"command gives {len(after)} numbers for memory {policy.memory}")
        require(np.isfinite([*orders, *after]).all(), f"command gives {orders}, {after} at {row}")


def floats_equal_symbols(cls: type[Manoeuvre], ship: Ship) -> None:
    """Floats and symbols give the same orders and memory, over several steps."""
    policy: Any = ordered(cls, ship)
    given = _given(policy)
    n, m = len(STATES), len(policy.memory)
    t, x, memory = ca.SX.sym("t"), ca.SX.sym("x", n), ca.SX.sym("m", m)
    try:
        orders, after = policy.command(t, tuple(ca.vertsplit(x)), tuple(ca.vertsplit(memory)) if m else (), *given)
    except (TypeError, ValueError, RuntimeError) as error:
        raise ContractError(f"command takes no symbols: {error}") from error
    traced = ca.Function("command", [t, x, memory], [ca.vertcat(*(ca.SX(y) for y in (*orders, *after)))])
    rows = _states(ship, 20).tolist()
    held = policy.begin(tuple(rows[0]))
    for k, row in enumerate(rows):
        orders, after = policy.command(0.5 * k, tuple(row), held, *given)
        direct = np.array([*orders, *after], dtype=float)
        symbols = np.asarray(traced(0.5 * k, row, list(held)).full()).ravel()
        off = np.abs(symbols - direct)
        require((off <= 1e-12 * np.abs(direct).max(initial=1e-300)).all(), f"floats give {direct}, symbols {symbols}")
        held = after


def _given(policy: Manoeuvre) -> tuple[tuple[float, ...], ...]:
    """The values of one step of a scheduled policy, as a further argument of `command`."""
    if not isinstance(policy, Scheduled):
        return ()
    rows, again = policy.schedule(0.5, 40), policy.schedule(0.5, 40)
    require(rows.shape == (40, len(policy.given)), f"schedule gives the shape {rows.shape} for {policy.given}")
    require(np.array_equal(rows, again), "schedule differs from call to call")
    return (tuple(rows[3].tolist()),)


def runs(cls: type[Manoeuvre], ship: Ship) -> str | None:
    """A run records its set points and orders; `complete` gives a truth value, `indices` finite or NaN figures."""
    policy = ordered(cls, ship)
    known = {*ship.model.controls, *(order for order, _ in ship.model.follows)}
    if lacking := [name for name in policy.orders if name not in known]:
        return f"{ship.name} has no {', '.join(lacking)}"
    run = simulate(ship, policy, speed=0.0 if policy.from_rest else None, duration=_LENGTHS * ship.L_pp / ship.speed)
    require(run.meta["kind"] == policy.kind, f"the trial is of kind {run.meta['kind']}, not {policy.kind}")
    require(run.meta["set_points"] == values(policy), "the trial does not hold the set points")
    if policy.complete(run):
        for name, index in policy.indices(run, ship.L_pp).items():
            require(not math.isinf(index.value), f"{name} is infinite")
    return None


Check = Callable[[type[Manoeuvre], Ship], str | None]

MANOEUVRE_CHECKS: Mapping[str, Check] = {
    check.__name__: check for check in (named, shapes, floats_equal_symbols, runs)
}  # fmt: skip
"""The checks of a manoeuvre by name."""
