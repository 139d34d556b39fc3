"""Orders to a ship: the controls that each moves, its range, its name and its value in degrees and rev/min."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from types import MappingProxyType

from ..core.errors import CommandError as CommandError
from ..core.values import dataclass
from ..models import unit
from ..ships import Ship, ShipError
from ..ships.felt import idle
from ..simulate.approach import approach

_MOST = 1.25
"""Largest revolutions relative to those of the approach, where the gear has no limit; assumed."""

_RUDDER = math.radians(35.0)
"""Largest rudder angle where the gear has no limit or other gear acts as a rudder [rad]; assumed."""


@dataclass(frozen=True)
class Range:
    """Range of an order, the same wherever the order is given, shown or carried out.

    Attributes:
        low, high: least and greatest order; the limits of the gear where it has any.
        full: the order that counts as full ahead.
        all_round: whether it is an angle without limits; an order beyond half a turn is wrapped.
    """

    low: float
    high: float
    full: float
    all_round: bool = False

    def taken(self, order: float) -> float:
        """The order that is carried out: clipped, or wrapped if it is an angle without limits."""
        if self.all_round:
            return order if abs(order) <= math.pi else math.remainder(order, 2.0 * math.pi)
        return min(max(order, self.low), self.high)


def ranges(ship: Ship, turns: float | None = None) -> dict[str, Range]:
    """Range of each order of a ship, by its name; orders without effect are left out.

    The range of a control is that of its actuator.  Without a limit it is 35 degrees for a rudder, all round for an
    azimuth, and 1.25 times the value that holds the approach speed for propulsion.  The range of an order that several
    controls obey is the intersection of their ranges.

    Args:
        ship: the ship.
        turns: revolutions that count as full, within the limits of the gear [1/s]; by default those of the approach.
    """
    if turns is None:
        with suppress(ShipError):  # no steady run: full is 0
            turns = approach(ship)[1]
    full = abs(turns or 0.0)
    dead, following = idle(ship), dict(zip(ship.model.controls, ship.model.follows, strict=True))
    own = {control: _range(ship, control, *following[control], full) for control in following}
    found: dict[str, Range] = {}
    for order, moves in obeying(ship).items():
        live = [(control, factor) for control, factor in moves if factor and control not in dead]
        if order in own and live:
            found[order] = own[order]
        elif live:
            found[order] = _together(order, [(own[control], factor) for control, factor in live])
    return {order: found[order] for order in found if found[order].low < found[order].high}


def _range(ship: Ship, control: str, order: str, factor: float, turns: float) -> Range:
    """Range of one control that follows an order."""
    low, high = limits(ship, control)
    kind = control.partition("_")[0]
    if kind == "alpha" and math.isinf(high - low):
        return Range(-math.pi, math.pi, math.pi, all_round=True)
    hold = turns * (abs(factor) if order == "n_P" else 1.0)
    most = _RUDDER if kind == "delta" else _MOST * (hold or 1.0)
    ahead = high if math.isfinite(high) else most
    full = min(hold, ahead) if hold and (order == "n_P" or math.isinf(high)) and kind != "delta" else ahead
    return Range(low if math.isfinite(low) else -most, ahead, full)


def _together(order: str, parts: Sequence[tuple[Range, float]]) -> Range:
    """Range of an order that several controls obey."""
    ends = [sorted((part.low / factor, part.high / factor)) for part, factor in parts]
    low, high = max(a for a, _ in ends), min(b for _, b in ends)
    if order == "delta":
        low, high = max(low, -_RUDDER), min(high, _RUDDER)
    full = min(abs(part.full / factor) for part, factor in parts)
    return Range(low, high, min(full, high))


def obeying(ship: Ship) -> dict[str, tuple[tuple[str, float], ...]]:
    """Controls that obey each order, with their factors, by the name of the order.

    A control obeys its own name; where n_P and delta are not controls, all controls that follow them obey.
    """
    own = {name: ((name, 1.0),) for name in ship.model.controls}
    shared: dict[str, tuple[tuple[str, float], ...]] = {}
    for control, (order, factor) in zip(ship.model.controls, ship.model.follows, strict=True):
        shared[order] = (*shared.get(order, ()), (control, factor))
    return {**own, **{order: moves for order, moves in shared.items() if order not in own}}


def limits(ship: Ship, control: str) -> tuple[float, float]:
    """Least and greatest value of the actuator of a control."""
    servo = ship.actuators.of(control)
    return float(servo.low), float(servo.high)


_FORCES = MappingProxyType({"X": "Force ahead", "Y": "Sideways force", "N": "Turning moment"})
_PAIR = MappingProxyType({"1": "port", "2": "starboard"})
_SHOWN = MappingProxyType({"rad": ("deg", 180.0 / math.pi), "1/s": ("rpm", 60.0)})

Moves = Sequence[tuple[str, float]]
"""Controls that obey an order, with their factors."""


def label(name: str, moves: Moves, controls: Sequence[str]) -> str:
    """Name of an order in mariners' terms, for a ship with these controls."""
    kind, _, rest = name.partition("_")
    if len(moves) > 1:
        of = moves[0][0]
        if name == "delta" and not of.startswith("delta"):  # azimuths at the stern point the other way
            return "Turn by azimuths"
        what = "rudders" if of.startswith("delta") else "engines" if of.startswith("n_P") else "thrusters"
        return f"{'Both' if len(moves) == 2 else 'All'} {what}"
    if kind in _FORCES:
        return f"{_FORCES[kind]}{'' if rest == 'tau' else f' {rest}'}"
    what = {"delta": "rudder", "alpha": "azimuth"}.get(kind, "thruster")
    if name == "n_P" or name.startswith("n_P_"):
        what, rest = "engine", name[4:]
    pair = (f"{name.removesuffix(rest)}{side}" in controls for side in _PAIR)
    if what in ("rudder", "engine") and all(pair):
        rest = _PAIR.get(rest, rest)
    text = f"{what} {rest}" if rest.isdigit() else f"{rest.replace('_', ' ')} {what}"
    return text.strip().capitalize()


def scale(name: str, moves: Moves) -> tuple[str, float]:
    """SI unit in which an order is shown, and the factor from the order to it."""
    factors = {factor for _, factor in moves}
    own, other = unit(name), unit(moves[0][0])
    per = factors.pop() if other != own and len(factors) == 1 else 1.0
    return (other if per != 1.0 else own), per


def sided(name: str, ship: Ship) -> bool:
    """Whether positive orders act to starboard and negative ones to port."""
    return name.partition("_")[0] in ("delta", "alpha", "Y", "N") or name in sideways(ship)


def sideways(ship: Ship) -> frozenset[str]:
    """Revolutions of tunnel thrusters, which neither turn nor follow the order for propulsion ahead."""
    pairs = zip(ship.model.controls, ship.model.follows, strict=True)
    return frozenset(
        name for name, (order, _) in pairs
        if name.startswith("n_") and order != "n_P" and f"alpha_{name[2:]}" not in ship.model.controls
    )  # fmt: skip


def clipped(ship: Ship, name: str, wanted: float, taken: float) -> str:
    """One line on an order that was clipped."""
    moves = obeying(ship)[name]
    shown, per = scale(name, moves)
    text, factor = _SHOWN.get(shown, (shown, 1.0))
    across = sided(name, ship)

    def figure(value: float) -> str:
        size = value * per * factor
        number = abs(size) if across else size + 0.0
        side = (" port" if size < 0.0 else " starboard") if across and size else ""
        return f"{number:.0f} {text}{side}" if number == 0.0 or abs(number) >= 100.0 else f"{number:.3g} {text}{side}"

    called = label(name, moves, ship.model.controls)
    return f"{called} ordered {figure(wanted)}, taken as {figure(taken)}"
