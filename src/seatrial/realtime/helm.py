"""Orders that come from outside, and what of a ship they move."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from ..core.parameters import Scalar, spec
from ..manoeuvres.given import Given
from ..models import follows, unit
from ..ships import Ship, ShipError
from ..ships.felt import idle
from ..simulate.approach import approach

_MOST = 1.25
"""Revolutions at most where the gear has no limit, over those of the approach; assumed."""

_RUDDER = math.radians(35.0)
"""Rudder angle at most where the gear has no limit, and where other gear steers like a rudder; assumed."""


class CommandError(ValueError):
    """An order that no ship can take: no such control, or no number."""


@dataclass(frozen=True)
class Helm(Given):
    """A policy whose orders are given step by step, one for each control."""

    n_P: Scalar = spec("1/s", "revolutions at the start", default=0.0)


@dataclass(frozen=True)
class Range:
    """How far an order goes: for whoever gives it, shows it or carries it out.

    Attributes:
        low, high: least and greatest order; those of the gear where it has any.
        full: what counts as full ahead.
        all_round: whether it is an angle without ends; an order beyond half a turn is the same one the other way.
    """

    low: float
    high: float
    full: float
    all_round: bool = False

    def taken(self, order: float) -> float:
        """An order as it is carried out."""
        if self.all_round:
            return order if abs(order) <= math.pi else math.remainder(order, 2.0 * math.pi)
        return min(max(order, self.low), self.high)


def ranges(ship: Ship, turns: float | None = None) -> dict[str, Range]:
    """How far each order of a ship goes, by its name; orders that move nothing of her are not among them.

    A control goes as far as its actuator; where that has no limit, a rudder to 35 degrees, an azimuth all the way
    round, and what drives her to 1.25 times what holds her approach.  An order that several controls obey goes as
    far as all of them do.

    Args:
        ship: the ship.
        turns: revolutions that count as full where the gear ends beyond them [1/s]; by default those of the approach.
    """
    full = abs(_turns(ship) if turns is None else turns)
    dead, following = idle(ship), dict(zip(ship.model.controls, follows(ship.model), strict=True))
    own = {control: _range(ship, control, *following[control], full) for control in following}
    found: dict[str, Range] = {}
    for order, moves in obeying(ship).items():
        live = [(control, factor) for control, factor in moves if factor and control not in dead]
        if order in own and live:
            found[order] = own[order]
        elif live:
            found[order] = _together(order, [(own[control], factor) for control, factor in live])
    return {order: found[order] for order in found if found[order].low < found[order].high}


def _turns(ship: Ship) -> float:
    """Revolutions of the approach [1/s]; 0 where there is no steady run."""
    try:
        return approach(ship)[1]
    except ShipError:
        return 0.0


def _range(ship: Ship, control: str, order: str, factor: float, turns: float) -> Range:
    """How far one control goes that follows an order."""
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
    """How far an order goes that several controls obey."""
    ends = [sorted((part.low / factor, part.high / factor)) for part, factor in parts]
    low, high = max(a for a, _ in ends), min(b for _, b in ends)
    if order == "delta":
        low, high = max(low, -_RUDDER), min(high, _RUDDER)
    full = min(abs(part.full / factor) for part, factor in parts)
    return Range(low, high, min(full, high))


def obeying(ship: Ship) -> dict[str, tuple[tuple[str, float], ...]]:
    """What each order moves, by the name of the order: controls with their factors.

    A control obeys its own name; n_P and delta, where they are no controls, all that follow them.
    """
    found: dict[str, tuple[tuple[str, float], ...]] = {name: ((name, 1.0),) for name in ship.model.controls}
    pairs = list(zip(ship.model.controls, follows(ship.model), strict=True))
    for order in dict.fromkeys(order for _, (order, _) in pairs):
        if order not in found:
            found[order] = tuple((control, factor) for control, (of, factor) in pairs if of == order)
    return found


def limits(ship: Ship, control: str) -> tuple[float, float]:
    """Least and greatest value that the actuator of a control takes."""
    servo: Any = ship.actuators.of(control)
    return float(getattr(servo, "low", -math.inf)), float(getattr(servo, "high", math.inf))


_FORCES = MappingProxyType({"X": "Force ahead", "Y": "Sideways force", "N": "Turning moment"})
_PAIR = MappingProxyType({"1": "port", "2": "starboard"})
_SHOWN = MappingProxyType({"rad": ("deg", 180.0 / math.pi), "1/s": ("rpm", 60.0)})

Moves = Sequence[tuple[str, float]]
"""Controls that obey an order, with their factors."""


def label(name: str, moves: Moves, controls: Sequence[str]) -> str:
    """What an order is called, of a ship with these controls."""
    kind, _, rest = name.partition("_")
    if len(moves) > 1:
        of, all_of = moves[0][0], "Both" if len(moves) == 2 else "All"
        if name == "delta" and not of.startswith("delta"):  # an order to turn, which azimuths at the stern go against
            return "Turn by azimuths"
        what = "rudders" if of.startswith("delta") else "engines" if of.startswith("n_P") else "thrusters"
        return f"{all_of} {what}"
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
    """SI unit that an order is shown in, and how much of it one of the order is."""
    factors = {factor for _, factor in moves}
    own, other = unit(name), unit(moves[0][0])
    per = factors.pop() if other != own and len(factors) == 1 else 1.0
    return (other if per != 1.0 else own), per


def sided(name: str, ship: Ship) -> bool:
    """Whether an order goes to starboard where it is above zero, and to port below."""
    return name.partition("_")[0] in ("delta", "alpha", "Y", "N") or name in sideways(ship)


def sideways(ship: Ship) -> frozenset[str]:
    """Revolutions of thrusters in a tunnel across the ship: they neither turn nor obey what drives it ahead."""
    pairs = zip(ship.model.controls, follows(ship.model), strict=True)
    return frozenset(
        name for name, (order, _) in pairs
        if name.startswith("n_") and order != "n_P" and f"alpha_{name[2:]}" not in ship.model.controls
    )  # fmt: skip


def clipped(ship: Ship, name: str, wanted: float, taken: float) -> str:
    """An order that her gear does not follow all the way, in a line."""
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
