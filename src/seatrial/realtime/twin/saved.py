"""What outlives a twin: its state, with which a killed one goes on, and the ship with what it has learnt."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...core.files import write_whole
from ...identify import StudyError
from ...ships import Entry, Ship
from .acting import Override
from .ahead import Score
from .alarms import Alarm
from .follow import Follower
from .live import Live
from .tally import Hour

_FORMAT = "seatrial-twin/1"


def save_state(live: Live, path: Path) -> None:
    """Write the state of a twin in one step."""
    follower = live.follower
    if follower is None:
        return
    about = {
        "schema": _FORMAT, "ship": live.machine.ship.name, "names": list(live.machine.names),
        "channels": list(live.machine.channels), "t": follower.t, "mean": follower.mean.tolist(),
        "cov": follower.cov.tolist(), "alarms": [_plain(asdict(one)) for one in live.alarms],
        "hours": [asdict(one) for one in live.tally.hours], "level": live.tally.level, **live.held(),
        "trust": {str(h): asdict(one) for h, one in live.trust.scores.items()},
    }  # fmt: skip
    write_whole(path, json.dumps(_plain(about), allow_nan=False) + "\n")


def load_state(live: Live, path: Path) -> float:
    """Continue from a saved state; the time of it [s].

    Raises:
        StudyError: not a saved state, or one of another ship, log or choice of parameters.
    """
    try:
        about: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if about["schema"] != _FORMAT:
            raise KeyError("schema")
        same = about["ship"] == live.machine.ship.name and about["names"] == list(live.machine.names)
        if not same or about["channels"] != list(live.machine.channels):
            what = "the twin of another ship, log or choice of parameters"
            raise StudyError(f"{path}: {what}; give another folder with -o")
        live.follower = Follower(live.machine, float(about["t"]), np.array(about["mean"]), np.array(about["cov"]))
        live.alarms = [_alarm(one) for one in about["alarms"]]
        live.tally.hours = [Hour(**one) for one in about["hours"]]
        live.tally.level = float(about["level"])
        for h, one in about["trust"].items():
            live.trust.scores[float(h)] = Score(**one)
        live.hold(np.array([_number(v) for v in about["acting"]]), about["masked"],
                  {name: Override(one["how"], _number(one["now"]), _number(one["rate"]))
                   for name, one in about["overrides"].items()})  # fmt: skip
    except (ValueError, KeyError, TypeError, OSError) as error:
        if isinstance(error, StudyError):
            raise
        raise StudyError(f"{path}: not the saved state of a twin; remove it, or give another folder with -o") from None
    return live.follower.t


def _plain(value: Any) -> Any:
    """JSON has no infinity: such numbers as text."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def _number(value: Any) -> float:
    return float(value)


def _alarm(saved: Mapping[str, Any]) -> Alarm:
    since, named, score, over, held, rate = (
        float(saved[name]) for name in ("since", "named", "score", "over", "held", "rate")
    )
    return Alarm(
        saved["cause"], saved["how"], tuple(saved["what"]), since, named, tuple(map(float, saved["size"])),
        saved["unit"], score, tuple(saved["rivals"]), over, held, rate,
    )  # fmt: skip


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
