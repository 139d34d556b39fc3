"""What a model can know of the trials of the IMO standards: propulsion, reverse thrust, scale."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..environment import CALM
from ..forces.propeller import KoseWake, Standard
from ..models import Sampled, follows
from ..models.settled import settled
from ..parameters import values
from ..ships import Ship
from ..simulate import straight, surge_balance

# Change of the surge acceleration, over U^2/L, below which a model does not answer.
_NOTHING = 1e-9
_SHIP_LENGTH = 100.0
_LIKE = "propeller:{}, whose reversed thrust is its curve for ahead turned round and was never fitted"


def rudder_limit(ship: Ship) -> float:
    """Greatest angle of what obeys the rudder order [rad]; infinite without a limit."""
    pairs = zip(ship.model.controls, follows(ship.model), strict=True)
    servos = [ship.actuators.of(control) for control, (order, _) in pairs if order == "delta"]
    return min((abs(float(getattr(servo, "high", math.inf))) for servo in servos), default=math.inf)


def held_speed(ship: Ship, V: float, n_P: float) -> bool:
    """Whether nothing changes the surge velocity: neither speed, nor revolutions, nor turning."""
    if isinstance(ship.model, Sampled):
        return not any(path.rpartition(".")[2].startswith("u_") for path in values(ship.model))
    control = straight(ship, n_P)
    rest = settled(ship.model, np.array([[*control, *CALM]], dtype=np.float64))[0].tolist()
    motions = ((V, 0.0), (0.5 * V, 0.0), (V, 0.3 * V))  # at speed, slow, turning
    rates = [
        float(ship.model.derivative((0.0, 0.0, 0.0, u, -v, v / ship.L_pp, *rest), control, CALM)[3])
        for u, v in motions
    ]
    return all(abs(rate) * ship.L_pp < _NOTHING * V * V for rate in rates)


def no_stop(ship: Ship, V: float, n_P: float, astern: float) -> str:
    """Why the ship cannot be stopped by its engine at all; empty where it can."""
    if not any(order == "n_P" for order, _ in follows(ship.model)):
        return "nothing of this ship obeys an order of revolutions"
    scale = _NOTHING * V * V / ship.L_pp
    ahead, stopped, back = (surge_balance(ship, V, n) for n in (n_P or 1.0, 0.0, astern or -1.0))
    if abs(ahead - back) < scale and abs(ahead - stopped) < scale:
        return "the model has no propulsion: its surge does not answer the revolutions"
    if astern >= 0:
        return "the shaft of this ship does not turn astern"
    if back >= stopped - scale:
        return "the model has no reverse thrust: reversed revolutions brake no more than a stopped propeller"
    return ""


def unreliable_stop(ship: Ship, astern: float, ranges: Mapping[str, tuple[float, float]]) -> str:
    """Why a computed stop is not to be trusted; empty where it lies within what the model was made for.

    Args:
        astern: revolutions ordered [1/s].
        ranges: least and greatest value of each channel of the run.
    """
    doubts: list[str] = []
    propeller = getattr(ship.model, "propeller", None)
    if isinstance(propeller, Standard | KoseWake):
        doubts.append(_LIKE.format(type(propeller).__name__))
    low = ship.validity.get("n_P", (-math.inf, math.inf))[0]
    if astern < low:
        doubts.append(f"the ship file is valid for n_P of {low:g} 1/s and above, full astern is {astern:.3g} 1/s")
    for name, (low, high) in ship.validity.items():
        least, greatest = ranges.get(name, (math.nan, math.nan))
        if name != "n_P" and (least < low or greatest > high):
            doubts.append(f"{name} leaves its validity of {low:g} to {high:g} ({least:.3g} to {greatest:.3g})")
    return "; ".join(doubts)


def scale_note(ship: Ship) -> str:
    """What a ship below the length of the standards should know about the limits; empty for the others."""
    if ship.L_pp >= _SHIP_LENGTH:
        return ""
    return (
        f"The standards hold for ships of {_SHIP_LENGTH:g} m and more (chemical tankers and gas carriers of any "
        f"length); this one has {ship.L_pp:.4g} m.  If it is a model, its zigzag limits are not those of the ship: "
        "L/V grows with the square root of the scale."
    )
