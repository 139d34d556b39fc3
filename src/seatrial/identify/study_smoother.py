"""The table [data.smoother] of a study: motion from raw positions and headings, before anything is fitted."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..data import Trial
from ..data.track import own_samples
from ..parameters import Free, read, specs, unknown
from ..ships import Ship
from . import StudyError
from .filtering import Kalman
from .measurement import Antenna, Heading

# Of the innovation test [s]: the usual 2 L/U hangs on a length that may be assumed.
_WINDOW = 10.0


def kalman(said: Any, ship: Ship) -> Kalman:
    """The filter that a table asks for; disturbances are its parameters.

    Raises:
        StudyError, ParameterError: a noise of zero, or a path that the ship has not.
    """
    known, free = specs(ship.model), []
    for path, sd in said.parameters.items():
        if path not in known:
            raise StudyError(unknown(path, known))
        value = float(read(ship.model, path))
        free.append(Free(path, value, known[path].low, known[path].high, value, sd))
    walk = {name: sd for name, sd in said.process.items() if name != "current"}
    if said.current:
        walk["current"] = said.current
    x, y = said.antenna
    return Kalman(
        measurement={"gnss": Antenna(said.position, x=x, y=y, delay=said.delay),
                     "compass": Heading(said.heading, delay=said.delay)},
        process=walk, parameters=tuple(free), current=bool(said.current), window=_WINDOW,
    )  # fmt: skip


def smoothed(said: Any, ship: Ship, trial: Trial) -> Trial:
    """The trial with motion from a Kalman smoother on the ship; what repeats a fix is no reading.

    The current that the filter finds is not handed on: the fit has its own, and a forecast must not know it.
    """
    found = kalman(said, ship).run(ship, own_samples(trial)).smoothed().trial()
    own = {name: v for name, v in found.channels.items() if name not in ("U_C", "gamma_C") or name in trial}
    return replace(found, channels={name: trial[name] if name in ("U_C", "gamma_C") else v for name, v in own.items()})
