"""What outlives a twin: its state, with which a killed one goes on, and the ship with what it has learnt."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core.files import write_whole
from ...core.records import read_json, short, to_json
from ...core.values import dataclass, field, replace
from ...data import Array
from ...identify import StudyError
from ...identify.filters.augmented import WAVES
from ...ships import Entry, Ship
from .ahead import Score
from .faults.acting import Override
from .faults.alarms import Alarm
from .follow import Follower
from .live import Live
from .settings import Seaway
from .tally import Hour

_FORMAT = "seatrial-twin/4"


@dataclass(frozen=True)
class _Saved:
    """The file of a state.

    Attributes:
        ship, names, channels: whose it is, the entries of its state and its readings.
        t, mean, cov: time [s] and estimate, shapes (n,) and (n, n).
        alarms, hours, level: what was found, and how large the innovations were.
        trust: forecasts by horizon [s].
        acting: controls and environment as last logged; NaN before the first reading.
        masked: number of the alarm by channel that is not believed.
        overrides: controls at fault.
        sea: what waves do.
    """

    ship: str
    names: tuple[str, ...]
    channels: tuple[str, ...]
    t: float
    mean: Array
    cov: Array
    alarms: tuple[Alarm, ...]
    hours: tuple[Hour, ...]
    level: float
    trust: Mapping[str, Score]
    acting: Array
    masked: Mapping[str, int]
    overrides: Mapping[str, Override]
    sea: Seaway = field(default_factory=Seaway)


def save_state(live: Live, path: Path) -> None:
    """Write the state of a twin in one step."""
    follower = live.follower
    if follower is None:
        return
    machine = live.machine
    found = _Saved(machine.ship.name, machine.names, machine.channels, follower.t, follower.mean, follower.cov,
                   tuple(live.alarms), tuple(live.tally.hours), live.tally.level,
                   {str(h): one for h, one in live.trust.scores.items()}, *live.held(), live.swell.sea)  # fmt: skip
    write_whole(path, to_json(found, _FORMAT))


def load_state(live: Live, path: Path) -> float:
    """Continue from a saved state; the time of it [s].

    Raises:
        StudyError: not a saved state, or one of another ship, log or choice of parameters.
    """
    remedy = "remove it, or give another folder with -o"
    found = read_json(path, _Saved, _FORMAT, StudyError, remedy)
    if found.sea != Seaway():
        strays = [f"size.{name}" for name in found.sea.size if name not in WAVES]
        strays += [f"noise.{name}" for name in found.sea.noise if name not in live.machine.settings.sensors]
        if strays or (found.sea.size and not found.sea.omega > 0.0):
            raise StudyError(f"{path}: sea.{short((strays or ['omega'])[0])} is of no motion or sensor here; {remedy}")
        live.roughen(found.sea)
    machine = live.machine
    if (found.ship, found.names, found.channels) != (machine.ship.name, machine.names, machine.channels):
        what = "the twin of another ship, log or choice of parameters"
        raise StudyError(f"{path}: {what}; give another folder with -o")
    size, acting = len(machine.names), len(live.held()[0])
    if found.mean.shape != (size,) or found.cov.shape != (size, size) or found.acting.shape != (acting,):
        raise StudyError(f"{path}: mean, cov and acting must be of {size}, {size} x {size} and {acting}; {remedy}")
    count = len(found.alarms)
    if stray := [name for name, k in found.masked.items() if name not in machine.channels or not 0 <= k < count]:
        raise StudyError(f"{path}: masked.{short(stray[0])} is no channel with an alarm; {remedy}")
    live.follower = Follower(machine, found.t, found.mean, found.cov)
    live.alarms, live.tally.hours, live.tally.level = list(found.alarms), list(found.hours), found.level
    live.trust.scores.update({float(h): one for h, one in found.trust.items()})
    live.hold(found.acting, found.masked, found.overrides)
    return found.t


def learnt(live: Live, log: str) -> Ship:
    """The ship with its parameters as the twin has them now, each with its standard deviation and where it is from.

    Args:
        log: name of what the twin has followed.
    """
    ship, follower = live.machine.ship, live.follower
    if follower is None:
        return ship
    found = {path: follower.value(path) for path in live.machine.settings.free}
    entries = dict(ship.entries)
    for path, (value, sigma) in found.items():
        before = entries.get(path)
        source = f"live twin on {log} to t = {follower.t:.0f} s; before: {before.source if before else 'not given'}"
        entries[path] = Entry(source, value, sigma=sigma)
    return replace(ship.moved({path: value for path, (value, _) in found.items()}), entries=entries)


def provenance(live: Live, log: str) -> dict[str, Any]:
    """How the numbers of `learnt` came about."""
    follower = live.follower
    return {
        "estimator": "live twin, extended Kalman filter", "log": log, "until": 0.0 if follower is None else follower.t,
        "hours": len(live.tally.hours), "alarms": [one.text for one in live.alarms][:20],
        "parameters": list(live.machine.settings.free),
    }  # fmt: skip
