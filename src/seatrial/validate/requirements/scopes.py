"""The items of each scope, in our words, and the judge."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from ...core.parameters import unknown
from ...ships import Ship, ShipError
from ...simulate.run import time_step
from . import Item, Judgement, Table, around, control, motion, numerics
from .probe import Probe


def _connection(p: Probe) -> Judgement:
    return Judgement(
        "not applicable",
        "a matter of interfaces, not of motion, so it is not tried here: seatrial steer SHIP --nmea ADDRESS puts the "
        "ship on the wire in the sentences of a bridge (IEC 61162-1 and -450), seatrial export in other programs",
    )  # fmt: skip


def _simplicity(p: Probe) -> Judgement:
    from ...core.parameters import values

    count = len(values(p.ship.model))
    sourced = len([path for path in values(p.ship.model) if path in p.ship.entries])
    return Judgement(
        "pass", f"the equations are open; {sourced} of {count} numbers of this ship are given with their source "
        "(seatrial show SHIP --sources), the rest are constants of a published formula or leave a term out",
        {"parameters": (float(count), "-"), "with a source": (float(sourced), "-")},
    )  # fmt: skip


COLLISION_AVOIDANCE = (
    Item("1", "Surge, sway and yaw meet a resistance that follows each velocity", motion.resistance),
    Item("2", "Course stability depends on hull and speed", motion.stability),
    Item("3", "No motion that theory or physics rules out", motion.plausible),
    Item("4", "The rudder makes the ship turn", motion.turning),
    Item("5", "Speed follows the propeller's revolutions", motion.speed_by_revolutions),
    Item("6", "The answer to the rudder depends on speed and revolutions", motion.answer_varies),
    Item("7", "Wind and waves carry the ship off or turn it", around.wind_and_waves),
    Item("8", "An order takes time to reach the actuator", control.delay),
    Item("9", "Actuators have greatest values and rates", control.limits),
    Item("10", "The time step follows scale and stiffness by itself", numerics.step),
    Item("11", "Each step is computed in real time", numerics.real_time),
)
BERTHING = (
    Item("1", "Left alone, the ship comes to rest", motion.rest_is_stable),
    Item("2", "Surge, sway and yaw meet a resistance that follows each velocity", motion.resistance),
    Item("3", "Course stability depends on hull and speed", motion.stability),
    Item("4", "No motion that theory or physics rules out", motion.plausible),
    Item("5", "The rudder makes the ship turn", motion.turning),
    Item("6", "Speed follows the propeller's revolutions", motion.speed_by_revolutions),
    Item("7", "The answer to the rudder depends on speed and revolutions", motion.answer_varies),
    Item("8", "Side thrusters lose force with headway", control.side_thrusters),
    Item("9", "Backing swings the bow by the hand of the propeller", control.reversing),
    Item("10", "Wind carries the ship off or turns it", around.wind),
    Item("11", "An order takes time to reach the actuator", control.delay),
    Item("12", "Actuators have greatest values and rates", control.limits),
    Item("13", "The time step follows scale and stiffness by itself", numerics.step),
    Item("14", "Each step is computed in real time", numerics.real_time),
)
FUNCTIONAL = (
    Item("1a", "The propulsion answers its order", control.delay_of_propulsion),
    Item("1b", "The ship answers the propulsion", motion.speed_by_revolutions),
    Item("1c", "Straight ahead it meets a resistance", motion.resistance),
    Item("1d", "The rudder answers its order", control.delay_of_steering),
    Item("1e", "The hull answers the rudder's actual angle", motion.turning),
    Item("1f", "In a turn the ship moves sideways", motion.lateral),
    Item("2", "A ship that is unstable on course can be represented", motion.stability),
    Item("3", "It connects to a ship's own equipment", _connection),
    Item("4", "Its equations can be read without doubt", _simplicity),
)
SCOPES: Mapping[str, tuple[Item, ...]] = MappingProxyType({
    "collision-avoidance": COLLISION_AVOIDANCE, "berthing": BERTHING, "functional": FUNCTIONAL,
})  # fmt: skip
"""Sawada et al. 2024 section 6.2 (11 and 14 items), and the list of IEC 62065 in its section 6.1."""


def judge(ship: Ship, scope: str, probe: Probe | None = None) -> Table:
    """Run `ship` through the items of `scope`.

    Raises:
        ShipError: an unknown scope.
    """
    if scope not in SCOPES:
        raise ShipError(unknown(scope, SCOPES, "scope"))
    examined = probe or Probe.of(ship)
    conditions = {
        "approach": f"{examined.U:.4g} m/s, {examined.n_P:.4g} 1/s {examined.balanced}".strip(),
        "ship length": f"{ship.L_pp:g} m, so L/U is {examined.unit_time:.4g} s",
        "steering limit used": f"{math.degrees(examined.limit):.3g} deg",
        "time step": f"{time_step(ship):g} s, RK4",
    }
    return Table(ship.name, scope, tuple((item, item.check(examined)) for item in SCOPES[scope]), conditions)
