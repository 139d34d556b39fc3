"""What a mariner calls an order, and the order in figures: degrees and revolutions a minute."""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import MappingProxyType

from ..models import unit
from ..ships import Ship
from .helm import obeying

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
    pairs = zip(ship.model.controls, ship.model.follows, strict=True)
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
