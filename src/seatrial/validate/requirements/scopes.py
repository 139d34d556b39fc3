"""The items of each scope, in our words, and the judge; checks of the computation itself."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import is_dataclass, replace
from functools import partial
from importlib.metadata import metadata
from types import MappingProxyType

import numpy as np

from ...core.parameters import unknown
from ...engine import SimulationError
from ...models import Sampled
from ...ships import Ship, ShipError
from ...ships.steering import by_angle
from ...simulate.run import fastest
from . import Elsewhere, Finding, Item, Judgement, Plot, Table, control, hull, judged, propulsion, steering, weather
from . import thresholds as limit
from .plausible import plausible
from .probe import Probe


def _step(p: Probe) -> Judgement:
    """The time step is chosen by scale and stiffness; what it costs in accuracy is measured."""
    dt = p.step
    if isinstance(p.ship.model, Sampled):
        own = Finding("step of the runs over that of the model", dt / float(p.ship.model.dt), "-", limit.OWN_STEP,
                      "a model in discrete time does not run at the step it was made for")  # fmt: skip
        return judged("a model in discrete time runs at the step it was made for", [own])
    found = [
        Finding("time step", dt, "s"), Finding("in time of one ship length", dt / p.unit_time, "L/U"),
        Finding("step times fastest motion", dt * fastest(p.ship), "-", limit.STIFF,
                "the time step is too coarse for the fastest motion of the ship"),
    ]  # fmt: skip
    cases = {"a hard turn to starboard": (p.n_P, p.limit), "a hard turn to port": (p.n_P, -p.limit)}
    if p.reverses and p.astern:
        cases["a crash stop"] = (-p.n_P, 0.0)
    lines: list[tuple[str, np.ndarray, np.ndarray]] = []
    p.runs([*cases.values()], 15 * p.unit_time, dt=dt / 4)
    p.runs([*cases.values()], 15 * p.unit_time, dt=dt)
    for name, (n, delta) in cases.items():
        coarse, fine = (p.run(n, delta, 15 * p.unit_time, dt=dt / k) for k in (1, 4))
        every = np.interp(coarse.t, fine.t, np.arange(len(fine))).round().astype(int)
        apart = np.hypot(coarse["x"] - fine["x"][every], coarse["y"] - fine["y"][every]) / p.ship.L_pp
        error = float(apart.max()) if np.isfinite(apart).all() else math.inf
        wrong = f"the time step is too coarse: {name} is {error:.1e} L from that at a quarter of it"
        found.append(Finding(f"track error of {name} over 15 L/U", error, "L", limit.STEP_ERROR, wrong))
        lines.append((name, coarse.t / p.unit_time, apart))
    greatest = max(one.value for one in found if one.bound is limit.STEP_ERROR)
    tried = "hard turns and a crash stop" if "a crash stop" in cases else "hard turns"
    good = f"chosen automatically; {tried} are {greatest:.1e} L from those at a quarter of the step"
    return judged(good, found, Plot("Error of the track by the time step", "t U/L", "L", tuple(lines)))


def _real_time(p: Probe) -> Judgement:
    """A step takes less time than it covers."""
    length, dt = 100 * p.unit_time, p.step
    orders = [(p.n_P, 0.1 * p.limit)]
    p.sail(orders, 2 * p.unit_time, p.U, dt)
    begun = p.clock()
    (run,) = p.sail(orders, length, p.U, dt)
    taken = max(p.clock() - begun, 1e-9)
    if isinstance(run, SimulationError):
        raise run
    factor = run.duration / taken
    found = [
        Finding("real-time factor, one ship", factor, "times", limit.REAL_TIME, "does not keep up with the clock"),
        Finding("step", 1e6 * dt, "us"), Finding("time per step", 1e6 * taken * dt / run.duration, "us"),
    ]  # fmt: skip
    return judged(f"runs {factor:.3g} times as fast as the clock, everything included", found)


def _numbered(*rows: tuple[str, Callable[[Probe], Judgement]]) -> tuple[Item, ...]:
    return tuple(Item(str(number), text, check) for number, (text, check) in enumerate(rows, start=1))


_RESISTANCE = "Surge, sway and yaw meet a resistance that follows each velocity"
_MANOEUVRING = (
    ("Course stability depends on hull and speed", hull.stability),
    ("No motion that theory or physics rules out", plausible),
    ("The rudder makes the ship turn", steering.turning),
    ("Speed follows the propeller's revolutions", propulsion.speed_by_revolutions),
    ("The answer to the rudder depends on speed and revolutions", steering.answer_varies),
)
_ACTUATORS_AND_TIME = (
    ("An order takes time to reach the actuator", control.delay),
    ("Actuators have greatest values and rates", control.limits),
    ("The time step follows scale and stiffness by itself", _step),
    ("Each step is computed in real time", _real_time),
)
COLLISION_AVOIDANCE = _numbered(
    (_RESISTANCE, hull.resistance),
    *_MANOEUVRING,
    ("Wind and waves carry the ship off or turn it", weather.wind_and_waves),
    *_ACTUATORS_AND_TIME,
)
"""What a simulator for collision avoidance must show (sawada2024, Section 6), numbered."""
BERTHING = _numbered(
    ("Left alone, the ship comes to rest", hull.rest_is_stable),
    (_RESISTANCE, partial(hull.resistance, at_rest=True)),
    *_MANOEUVRING,
    ("Side thrusters lose force with headway", control.side_thrusters),
    ("Backing swings the bow by the hand of the propeller", propulsion.reversing),
    ("Wind carries the ship off or turns it", weather.wind),
    *_ACTUATORS_AND_TIME,
)
"""What a simulator for berthing must show (sawada2024, Section 6), numbered."""


def _open_source(p: Probe) -> Judgement:
    """Source of the model's classes can be read, and its licence allows that."""
    parts = [p.ship.model, *(part for part in vars(p.ship.model).values() if is_dataclass(part))]
    read = [type(part).__name__ for part in parts if _readable(type(part))]
    known = metadata("seatrial").json
    licence = str(known.get("license_expression") or known.get("license") or "")
    found = [
        Finding("classes of the model whose source can be read, of all", len(read) / len(parts), "-", limit.ALL_OPEN,
                "the source of a part of the model cannot be read"),
        Finding(f"licence '{licence}' is an open one", float(licence.split(" ")[0] in _OPEN), "-", limit.ALL_OPEN,
                "the licence is not one of open source"),
    ]  # fmt: skip
    return judged(f"its {len(parts)} classes are open to read, licence {licence}", found)


def _readable(cls: type) -> bool:
    try:
        return bool(inspect.getsource(cls).strip())
    except (OSError, TypeError):
        return False


def _unstable(p: Probe) -> Judgement:
    """The ship, or it with one number of the hull changed, keeps turning with the rudder amidships."""
    return hull.stability(p, both=True)


def _elsewhere(p: Probe) -> Judgement:
    return Judgement("not judged", "`seatrial requirements` tests it; `judge` alone examines motion only")


CHECKED_ONCE = (_step, _real_time, _open_source, _elsewhere)
"""Checks of the computation, the source or an interface, which no draw of the numbers changes."""
_OPEN = ("MIT", "BSD-3-Clause", "BSD-2-Clause", "Apache-2.0")
FUNCTIONAL = (
    Item("1a", "The propulsion answers its order", lambda p: control.delay(p, p.propulsion)),
    Item("1b", "The ship answers the propulsion", propulsion.speed_by_revolutions),
    Item("1c", "Straight ahead it meets a resistance", hull.straight_resistance),
    Item("1d", "The rudder answers its order", lambda p: control.delay(p, p.steering)),
    Item("1e", "The hull answers the rudder's actual angle", steering.turning),
    Item("1f", "In a turn the ship moves sideways", steering.lateral),
    Item("2", "A ship that is unstable on course can be represented", _unstable),
    Item("3", "It connects to a ship's own equipment", _elsewhere),
    Item("4", "Its equations can be read without doubt", _elsewhere),
    Item("N1", "The model is open source (6.2, non-functional)", _open_source),
    Item("N2", "It is described by equations (6.2, non-functional)", _elsewhere),
)
SCOPES: Mapping[str, tuple[Item, ...]] = MappingProxyType({
    "collision-avoidance": COLLISION_AVOIDANCE, "berthing": BERTHING, "functional": FUNCTIONAL,
})  # fmt: skip
"""Sawada et al. 2024 section 6.2 (11 and 14 items), and the list of IEC 62065 in its section 6.1."""


_COMMON = _NOT_RUN, _BLOWS_UP = "not run", "a run of this item blows up"
"""Beginnings of reasons that may hold for many items, each with figures of its own behind a colon."""


def checked(item: Item, p: Probe) -> Judgement:
    """The judgement of an item; a ship that blows up in a run of it fails, one that is too quick is not run."""
    if p.quickest > limit.QUICK.far.high and item.check not in (plausible, _open_source, _elsewhere):
        why = f"a motion dies out within 1/{p.quickest:.0f} of a length: mass, inertia or damping is that of no ship"
        return Judgement("not judged", f"{_NOT_RUN}: {why}")
    try:
        return item.check(p)
    except (SimulationError, ShipError, ArithmeticError, np.linalg.LinAlgError) as error:
        return Judgement("fail", f"{_BLOWS_UP}: {error}")


def _said_once(rows: Iterable[tuple[Item, Judgement]]) -> Iterator[tuple[Item, Judgement]]:
    """The rows; a cause that an item before has named, to its colon, is referred to by that item's number."""
    said: dict[str, str] = {}
    for item, found in rows:
        cause = found.reason.partition(":")[0] if found.reason.startswith(_COMMON) else found.reason
        first = item.number if found.verdict == "pass" else said.setdefault(cause, item.number)
        same = f"{cause}, as item {first}" if cause != found.reason else f"for the reason of item {first}"
        yield item, found if first == item.number else replace(found, reason=same)


def judge(ship: Ship, scope: str, probe: Probe | None = None, elsewhere: Elsewhere | None = None) -> Table:
    """Run `ship` through the items of `scope`; `elsewhere` has checks of interfaces, by item.

    Raises:
        ShipError: an unknown scope.
    """
    if scope not in SCOPES:
        raise ShipError(unknown(scope, SCOPES, "scope"))
    examined = probe or Probe.of(ship)
    conditions = {
        "approach": f"{examined.U:.4g} m/s, {examined.n_P:.4g} 1/s {examined.balanced}".strip(),
        "ship length": f"{ship.L_pp:g} m, so L/U is {examined.unit_time:.4g} s",
        "steering limit used": f"{math.degrees(examined.limit):.3g} deg" if by_angle(ship)
        else "a demand of 100 %, put as 35 deg of helm",
        "time step": f"{examined.step:g} s, RK4",
    }
    given = elsewhere or {} if scope == "functional" else {}
    rows = (
        (item, given[item.number](ship) if item.number in given else checked(item, examined)) for item in SCOPES[scope]
    )
    return Table(ship.name, scope, tuple(_said_once(rows)), conditions)
