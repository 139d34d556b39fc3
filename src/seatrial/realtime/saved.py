"""The state of a whole loop in one piece of bytes."""

from __future__ import annotations

import base64
import binascii
import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..ships import ShipError

if TYPE_CHECKING:
    from .fleet import Vessel

_FORMAT = "seatrial-loop/1"


def packed(k: int, rate: float, vessels: Mapping[str, Vessel]) -> bytes:
    """Ships and instruments at tick `k`."""
    ships = {
        name: [_text(vessel.plant.snapshot()), _text(vessel.watch.snapshot() if vessel.watch else b"")]
        for name, vessel in vessels.items()
    }
    return json.dumps({"format": _FORMAT, "k": k, "rate": rate, "ships": ships}).encode()


def unpacked(saved: bytes, rate: float, vessels: Mapping[str, Vessel]) -> int:
    """Restore ships and instruments; gives back the tick.

    Raises:
        ShipError, SensorError: saved of others, or not by `packed`; some are then restored already.
    """
    try:
        about: dict[str, Any] = json.loads(saved)
        ships = {name: tuple(map(_bytes, pair)) for name, pair in about["ships"].items()}
        k, fits = int(about["k"]), about["format"] == _FORMAT and about["rate"] == rate
    except (ValueError, KeyError, TypeError, AttributeError, binascii.Error):
        raise ShipError("not a saved loop; give what its snapshot gave") from None
    if not fits or set(ships) != set(vessels):
        there, here = f"{', '.join(ships)} at {about['rate']} Hz", f"{', '.join(vessels)} at {rate:g} Hz"
        raise ShipError(f"saved loop of {there}; this one has {here}")
    for name, (plant, watch) in ships.items():
        vessels[name].plant.restore(plant)
        own = vessels[name].watch
        if own is not None:
            own.restore(watch)
    return k


def _text(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _bytes(text: str) -> bytes:
    return base64.b64decode(text, validate=True)
