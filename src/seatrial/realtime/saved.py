"""The state of a whole loop in one piece of bytes."""

from __future__ import annotations

import base64
import binascii
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from ..environment import Environment
from ..ships import ShipError
from .fleet import Fleet

_FORMAT = "seatrial-loop/2"


class Keeper(Protocol):
    """Somebody beside a loop who has a part in how her ships go on: a steersman, a wire, a bridge."""

    def snapshot(self) -> Any:
        """All that decides what it does from here on, for JSON."""
        ...

    def restore(self, saved: Any) -> None:
        """Go on from what `snapshot` gave; a ValueError where that is of another."""
        ...

    def reset(self) -> None:
        """Back to the start."""
        ...


@dataclass
class Waiting:
    """What the next tick takes in.

    Attributes:
        orders: by ship and control, the last one last.
        around: surroundings by ship.
    """

    orders: dict[tuple[str, str], float] = field(default_factory=dict[tuple[str, str], float])
    around: dict[str, Environment] = field(default_factory=dict[str, Environment])


@dataclass(frozen=True)
class Saved:
    """What of a saved loop is not with the ships, the instruments and the keepers.

    Attributes:
        k: tick.
        known: what was known of each ship (`Vessel.known`).
        patience: of the loop [s].
    """

    k: int
    known: Mapping[str, Mapping[str, Any]]
    patience: float
    waiting: Waiting


def packed(fleet: Fleet, keepers: Mapping[str, Keeper], waiting: Waiting) -> bytes:
    """Ships, instruments, keepers, and what waits for the next tick."""
    ships = {
        name: [_text(vessel.plant.snapshot()), _text(vessel.watch.snapshot() if vessel.watch else b""), vessel.known()]
        for name, vessel in fleet.vessels.items()
    }
    return json.dumps({
        "format": _FORMAT, "k": fleet.k, "rate": fleet.rate, "ships": ships,
        "patience": fleet.patience if math.isfinite(fleet.patience) else None,
        "keepers": {name: keeper.snapshot() for name, keeper in keepers.items()},
        "orders": [[*who, value] for who, value in waiting.orders.items()],
        "around": {ship: [float(value) for value in around] for ship, around in waiting.around.items()},
    }).encode()  # fmt: skip


def unpacked(saved: bytes, fleet: Fleet, keepers: Mapping[str, Keeper]) -> Saved:
    """Restore ships, instruments and keepers, and give back the rest; a keeper that was not there begins anew.

    Raises:
        ShipError, SensorError: saved of others, or not by `packed`; some are then restored already.
    """
    try:
        about: dict[str, Any] = json.loads(saved)
        ships = {name: (_bytes(plant), _bytes(watch), dict(known))
                 for name, (plant, watch, known) in about["ships"].items()}  # fmt: skip
        fits, kept = about["format"] == _FORMAT and about["rate"] == fleet.rate, dict(about["keepers"])
        patience = math.inf if about["patience"] is None else float(about["patience"])
        waiting = Waiting(
            {(str(ship), str(control)): float(value) for ship, control, value in about["orders"]},
            {str(ship): Environment(*map(float, around)) for ship, around in about["around"].items()},
        )
        rest = Saved(int(about["k"]), {name: known for name, (*_, known) in ships.items()}, patience, waiting)
    except (ValueError, KeyError, TypeError, AttributeError, binascii.Error):
        raise ShipError("not a saved loop; give what its snapshot gave") from None
    if not fits or set(ships) != set(fleet.vessels):
        there, here = f"{', '.join(ships)} at {about['rate']} Hz", f"{', '.join(fleet.vessels)} at {fleet.rate:g} Hz"
        raise ShipError(f"saved loop of {there}; this one has {here}")
    for name in kept:
        if name not in keepers:
            raise ShipError(f"saved loop with {name}; this one has {', '.join(keepers) or 'nobody beside it'}")
    for name, (plant, watch, _) in ships.items():
        fleet.vessels[name].plant.restore(plant)
        own = fleet.vessels[name].watch
        if own is not None and watch:
            own.restore(watch)
        elif own is not None:  # put aboard since
            own.reset()
    for name, keeper in keepers.items():
        _restore(name, keeper, kept)
    return rest


def _restore(name: str, keeper: Keeper, kept: Mapping[str, Any]) -> None:
    if name not in kept:
        keeper.reset()
        return
    try:
        keeper.restore(kept[name])
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise ShipError(f"not a saved loop: what is kept of {name} cannot be read ({error})") from None


def _text(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _bytes(text: str) -> bytes:
    return base64.b64decode(text, validate=True)
