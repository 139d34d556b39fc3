"""The items of each scope, in our words, and the judge; checks of the computation and of what is no motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from ...core.parameters import unknown, values
from ...models import Sampled
from ...ships import Ship, ShipError
from ...simulate.run import fastest, time_step
from . import Item, Judgement, Plot, Table, control, given, motion
from .probe import Probe

_ALLOWED = 1e-3


def _step(p: Probe) -> Judgement:
    """The time step is chosen by scale and stiffness; what it costs in accuracy is measured."""
    dt = time_step(p.ship)
    evidence = {"time step": (dt, "s"), "in time of one ship length": (dt / p.unit_time, "L/U")}
    if isinstance(p.ship.model, Sampled):
        return Judgement("pass", "a model in discrete time runs at the step it was made for", evidence)
    evidence["step times fastest motion"] = (dt * fastest(p.ship), "-")
    coarse, fine = (p.run(p.n_P, p.limit, 15 * p.unit_time, dt=dt / k) for k in (1, 4))
    every = np.interp(coarse.t, fine.t, np.arange(len(fine))).round().astype(int)
    apart = np.hypot(coarse["x"] - fine["x"][every], coarse["y"] - fine["y"][every]) / p.ship.L_pp
    evidence["track error of a hard turn over 15 lengths"] = (float(apart.max()), "L")
    evidence["heading error"] = (float(np.degrees(np.abs(coarse["psi"] - fine["psi"][every]).max())), "deg")
    plot = Plot("Error of the track by the time step", "t U/L", "L", (("a hard turn", coarse.t / p.unit_time, apart),))
    return given(
        float(apart.max()) < _ALLOWED,
        f"chosen automatically; a hard turn is {float(apart.max()):.1e} L from that at a quarter of the step",
        f"a hard turn is {float(apart.max()):.1e} L from that at a quarter of the step; wanted below {_ALLOWED:g} L",
        evidence, plot,
    )  # fmt: skip


def _real_time(p: Probe) -> Judgement:
    """A step takes less time than it covers."""
    length, dt = 100 * p.unit_time, time_step(p.ship)
    p.run(p.n_P, 0.1 * p.limit, length)
    begun = p.clock()
    run = p.run(p.n_P, 0.1 * p.limit, length)
    taken = max(p.clock() - begun, 1e-9)
    factor = run.duration / taken
    evidence = {
        "real-time factor, one ship": (factor, "times"), "step": (1e6 * dt, "us"),
        "time per step": (1e6 * taken * dt / run.duration, "us"),
    }  # fmt: skip
    return given(factor > 1.0, f"runs {factor:.3g} times as fast as the clock, everything included",
                 "does not keep up with the clock", evidence)  # fmt: skip


def _connection(p: Probe) -> Judgement:
    return Judgement(
        "not applicable",
        "a matter of interfaces, not of motion, so it is not tried here: seatrial steer SHIP --nmea ADDRESS puts the "
        "ship on the wire in the sentences of a bridge (IEC 61162-1 and -450), seatrial export in other programs",
    )  # fmt: skip


def _simplicity(p: Probe) -> Judgement:
    paths = values(p.ship.model)
    count, sourced = len(paths), sum(path in p.ship.entries for path in paths)
    return Judgement(
        "pass", f"the equations are open; {sourced} of {count} numbers of this ship are given with their source "
        "(seatrial show SHIP --sources), the rest are constants of a published formula or leave a term out",
        {"parameters": (float(count), "-"), "with a source": (float(sourced), "-")},
    )  # fmt: skip


def _numbered(*rows: tuple[str, Callable[[Probe], Judgement]]) -> tuple[Item, ...]:
    return tuple(Item(str(number), text, check) for number, (text, check) in enumerate(rows, start=1))


_MANOEUVRING = (
    ("Surge, sway and yaw meet a resistance that follows each velocity", motion.resistance),
    ("Course stability depends on hull and speed", motion.stability),
    ("No motion that theory or physics rules out", motion.plausible),
    ("The rudder makes the ship turn", motion.turning),
    ("Speed follows the propeller's revolutions", motion.speed_by_revolutions),
    ("The answer to the rudder depends on speed and revolutions", motion.answer_varies),
)
_ACTUATORS_AND_TIME = (
    ("An order takes time to reach the actuator", control.delay),
    ("Actuators have greatest values and rates", control.limits),
    ("The time step follows scale and stiffness by itself", _step),
    ("Each step is computed in real time", _real_time),
)
COLLISION_AVOIDANCE = _numbered(
    *_MANOEUVRING, ("Wind and waves carry the ship off or turn it", motion.wind_and_waves), *_ACTUATORS_AND_TIME
)
BERTHING = _numbered(
    ("Left alone, the ship comes to rest", motion.rest_is_stable),
    *_MANOEUVRING,
    ("Side thrusters lose force with headway", control.side_thrusters),
    ("Backing swings the bow by the hand of the propeller", control.reversing),
    ("Wind carries the ship off or turns it", motion.wind),
    *_ACTUATORS_AND_TIME,
)
FUNCTIONAL = (
    Item("1a", "The propulsion answers its order", lambda p: control.delay(p, p.propulsion)),
    Item("1b", "The ship answers the propulsion", motion.speed_by_revolutions),
    Item("1c", "Straight ahead it meets a resistance", motion.resistance),
    Item("1d", "The rudder answers its order", lambda p: control.delay(p, p.steering)),
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
