"""Runs in a harbour: a ship, a chart and what is done there, put together with the usual choices of each."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from ...core.errors import RequestError
from ...core.parameters import unknown
from ...core.values import dataclass
from ...data import Trial
from ...data.trialfile import write_trial
from ...environment.chart import Chart, nearest
from ...environment.geojson import load_chart
from ...manoeuvres import Index, Policy, Settings
from ...manoeuvres.autopilot import usual_gains
from ...manoeuvres.track import TrackFollowing, waypoints
from ...manoeuvres.tugs import TugBerthing
from ...ships import Ship
from ...ships.files import load
from ...simulate.approach import approach, straight
from ...simulate.contacts import contact_indices, keel_indices
from ...simulate.place import Other, Place, place_of
from ...simulate.run import simulate
from ..asked import Around
from ..request import numbers, surroundings

SHIP = "kvlcc2_harbour"
"""The ship of a run that names none."""

# Speeds [m/s] and durations [s] below this.
_MOST = 1e5
# Rudder [rad]; in shallow water a ship turns slowly, so its yaw is damped more.
# Look-ahead, and the way to a waypoint at which the next leg is taken, in lengths.
_HARD, _FIRMER, _AHEAD, _TURN = math.radians(35.0), 2.0, 1.2, 0.4


@dataclass(frozen=True)
class Ran:
    """A run in a harbour: what it was made of, its trial and its figures."""

    ship: Ship
    chart: Chart
    place: Place
    trial: Trial
    indices: Mapping[str, Index]


@dataclass(frozen=True)
class _Plan:
    """How a run begins and is steered: start pose, policy, seconds, another ship."""

    start: tuple[float, ...]
    policy: Policy
    duration: float
    other: Other | None = None


def harbour(
    what: str, ship: str = SHIP, chart: str | Path | None = None, *, wind: str | None = None,
    speed: float | None = None, duration: float | None = None, start: str | None = None, out: Path | None = None,
) -> Ran:  # fmt: skip
    """Run one of `RUNS`.

    Args:
        what: berthing, unberthing, lock, canal or meeting.
        ship: a ship; for a berth one with two tugs `fore` and `aft`.
        chart: a chart of the library or a file; by default the usual one of the run.
        wind: true wind as M/S,DEG, where it comes from.
        speed: in a lock or canal [m/s].
        duration: of the run [s].
        start: midship north and east [m] and heading [deg] as X,Y,DEG, in place of the usual one.
        out: trial file to write.

    Raises:
        RequestError: no such run, ship or chart; a value that cannot be read; what the run cannot be made with.
        SimulationError: the run fails.
    """
    if what not in RUNS:
        raise RequestError(unknown(what, RUNS, "run in a harbour"))
    usual, plan_of = RUNS[what]
    for option, value in (("--speed", speed), ("--duration", duration)):
        if value is not None and not 0.0 < value < _MOST:
            raise RequestError(f"{option} is {value:g}; it is above zero, and below {_MOST:g}")
    vessel, there = load(ship), load_chart(chart or usual)
    around = surroundings(vessel, Around(wind))
    plan = plan_of(vessel, there, speed)
    begun = plan.start if start is None else (*_pose(start), *plan.start[3:])
    place = place_of(vessel, there, other=plan.other)
    trial = simulate(vessel, plan.policy, duration=duration or plan.duration, start=begun, place=place, every=10,
                     environment=around.weather, name=f"{vessel.name}_{what}")  # fmt: skip
    if out is not None:
        write_trial(trial, out)
    figures = {**contact_indices(trial, vessel, place), **keel_indices(trial, vessel), **_beside(trial, there)}
    return Ran(vessel, there, place, trial, figures)


def _pose(text: str) -> tuple[float, float, float]:
    x, y, heading = numbers("--start", text, "X,Y,DEG such as 250,-60,0")
    return x, y, math.radians(heading)


def _beside(trial: Trial, chart: Chart) -> dict[str, Index]:
    """How far midship got from the fairway, where there is one [m]."""
    if not chart.fairways:
        return {}
    off = np.min([nearest(line, trial["x"], trial["y"])[0] for line in chart.fairways], axis=0)
    return {"off_fairway": Index(float(off.max()), "m"), "off_fairway_end": Index(float(off[-1]), "m")}


def _berth(ship: Ship, chart: Chart) -> tuple[np.ndarray, float, float]:
    """Middle of the first quay with fenders, the heading along it, starboard side to, and the height of its fenders."""
    quay = next((q for q in chart.quays if q.fender is not None), None)
    if quay is None or quay.fender is None:
        raise RequestError(f"{chart.name}: no quay with fenders; a berth needs one")
    a, b = quay.line[0], quay.line[-1]
    along = (a - b) / float(np.linalg.norm(a - b))  # against its direction the quay is to starboard
    return 0.5 * (a + b), math.atan2(along[1], along[0]), quay.fender.height


def _off(middle: np.ndarray, psi: float, gap: float) -> tuple[float, float]:
    """A point so far off a quay that is to starboard."""
    return float(middle[0] + gap * math.sin(psi)), float(middle[1] - gap * math.cos(psi))


def _tugs(ship: Ship, chart: Chart, gap: float, touching: float) -> TugBerthing:
    tugs = {name: part for name, part in ship.model.thrusters_by_name.items() if name in ("fore", "aft")}
    if len(tugs) < 2:
        raise RequestError(f"{ship.name}: no tugs 'fore' and 'aft' in [thrusters]; try {SHIP}")
    middle, psi, height = _berth(ship, chart)
    x, y = _off(middle, psi, gap + 0.5 * float(ship.model.breadth) + height)
    fore, body = vars(tugs["fore"]), vars(ship.model)["body"]
    mass, inertia = float(body.m + body.m_y), float(body.I_zG + body.J_z)
    return TugBerthing(y, x, psi, mass, inertia, abs(float(fore["x"])), math.copysign(1.0, float(fore["y"])),
                       touching=touching)  # fmt: skip


def _berthing(ship: Ship, chart: Chart, speed: float | None) -> _Plan:
    policy = _tugs(ship, chart, -0.5, 0.04)  # within the fenders, so that the tugs press on
    middle, psi, height = _berth(ship, chart)
    x, y = _off(middle, psi, 0.5 * float(ship.model.breadth) + height + 0.5 * float(ship.model.breadth))
    return _Plan((x, y, psi - 0.01, 0.0, 0.0, 0.0), policy, 900.0)


def _unberthing(ship: Ship, chart: Chart, speed: float | None) -> _Plan:
    middle, psi, height = _berth(ship, chart)
    x, y = _off(middle, psi, 0.5 * float(ship.model.breadth) + height)
    return _Plan((x, y, psi, 0.0, 0.0, 0.0), _tugs(ship, chart, 1.5 * float(ship.model.breadth), 0.0), 900.0)


def _following(ship: Ship, chart: Chart, speed: float, aside: float = 0.0) -> _Plan:
    """Along the first fairway of a chart, `aside` to starboard of it, from six lengths before its first bend."""
    if not chart.fairways:
        raise RequestError(f"{chart.name}: no fairway; draw one for the ship to follow")
    line = chart.fairways[0]
    first = line[1] - line[0]
    way = float(np.linalg.norm(first))
    psi, ahead = math.atan2(first[1], first[0]), max(way - 6.0 * ship.L_pp, 0.1 * way) if len(line) > 2 else 0.05 * way
    across = aside * np.array([-math.sin(psi), math.cos(psi)])
    x, y = line[0] + first / way * ahead + across
    n_P = straight(ship, approach(ship, speed)[1])[0]
    settings = Settings(n_P, speed, ship.L_pp, _HARD)
    K_p, K_d, _ = usual_gains(settings)
    path = waypoints([(float(a), float(b)) for a, b in line + across])
    policy = TrackFollowing(n_P, K_p, _FIRMER * K_d, _AHEAD * ship.L_pp, _TURN * ship.L_pp, delta_max=_HARD, path=path)
    whole = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()) - ahead
    return _Plan((float(x), float(y), psi, speed, 0.0, 0.0), policy, 0.9 * whole / speed)


def _lock(ship: Ship, chart: Chart, speed: float | None) -> _Plan:
    return _following(ship, chart, speed or 1.5)


def _canal(ship: Ship, chart: Chart, speed: float | None) -> _Plan:
    return _following(ship, chart, speed or 3.5)


def _meeting(ship: Ship, chart: Chart, speed: float | None) -> _Plan:
    """Two of a kind, each a breadth to starboard of the fairway, meet half a run later."""
    U, aside = speed or 3.5, 1.0 * float(ship.model.breadth)
    plan = _following(ship, chart, U, aside)
    psi, ahead = plan.start[2], U * plan.duration
    c, s = math.cos(psi), math.sin(psi)
    x, y = plan.start[0] + ahead * c + 2.0 * aside * s, plan.start[1] + ahead * s - 2.0 * aside * c
    section = 0.998 * float(ship.model.breadth) * float(ship.model.draught)
    other = Other(x, y, psi + math.pi, U, ship.L_pp, section)
    return _Plan(plan.start, plan.policy, plan.duration, other)


Making = Callable[[Ship, Chart, "float | None"], _Plan]
RUNS: Mapping[str, tuple[str, Making]] = MappingProxyType({
    "berthing": ("tanker_quay", _berthing), "unberthing": ("tanker_quay", _unberthing), "lock": ("lock", _lock),
    "canal": ("canal_bend", _canal), "meeting": ("canal", _meeting),
})  # fmt: skip
"""Runs by name: the usual chart, and how each begins."""
