"""Requests to a workflow: checks of settings, and conversion of text such as ``5,90`` to SI values."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..core.constants import GRAVITY
from ..core.errors import StudyError
from ..core.files import REACH, in_reach
from ..core.parameters import values
from ..core.values import dataclass
from ..data import DataError, Trial
from ..environment import Uniform, Weather
from ..forces.shallow import SHALLOWEST
from ..models import STATES
from ..ships import Ship, ShipError
from ..ships.felt import feels
from ..study import SUMMARY
from . import RequestError
from .asked import Around, Draws

if TYPE_CHECKING:
    from ..study.grounds import Grounds

DEGREE = math.pi / 180.0

Note = Callable[[str], object]
"""Takes a line for the user: a warning, or what is being done."""

PAGES = (".html", ".htm")
"""Endings of a file that is written as a page."""
# From so long on the rest of some work is worth telling [s].
_WORTH = 2.0


class Stopped(KeyboardInterrupt):
    """Ctrl-C in work that can be resumed; the text says how."""


def silent(_: str) -> None:
    """Ignore a note."""


def left(begun: float, done: int, every: int) -> str:
    """How long what is left of equal pieces of work will take, a clause for a note; empty where that is not known.

    Args:
        begun: when the work began, by the clock that never goes back [s].
        done, every: pieces that are done, and all of them.
    """
    seconds = (time.monotonic() - begun) * (every - done) / done if done else 0.0
    return f"; {seconds:.0f} s left" if seconds >= _WORTH else ""


def ship_of(ship: str | Path | Ship) -> Ship:
    """A ship of the library by name, a ship file, or a ship as it is.

    Raises:
        ShipError: no such ship, or its file is wrong.
        StudyError: a fitted ship whose file, or the fit beside it, was changed after the fit.
    """
    from ..ships.files import load

    if isinstance(ship, Ship):
        return ship
    if Path(ship).with_name(SUMMARY).is_file():
        from ..study.store import summary_beside

        summary_beside(ship)
    return load(str(ship))


def grounds_of(ship: str | Path | Ship, note: Note) -> Grounds | None:
    """What the trials of a fitted ship tested, from the fit beside its file; None of any other ship.

    Args:
        ship: by its file, or as it was read from there; one that was changed since has none.
        note: told where the fit beside it is of other numbers.
    """
    path = ship.file if isinstance(ship, Ship) else ship
    if path is None or not Path(path).with_name(SUMMARY).is_file():
        return None  # and no fit is imported
    from ..study.store import summary_beside

    try:
        said = summary_beside(path)
    except StudyError as error:
        note(f"warning: what its trials tested is not known: {error}")
        return None
    if said is None or (isinstance(ship, Ship) and _changed(ship)):
        return None
    return said.grounds if said.grounds.covered else None


def _changed(ship: Ship) -> bool:
    """Whether a ship has other numbers than its file has now, or classes of it that are not trusted any more."""
    from ..ships.files import load

    try:
        there = load(str(ship.file))
    except ShipError:
        return True
    return (values(there.model), there.actuators) != (values(ship.model), ship.actuators)


def untested(grounds: Grounds | None, ship: Ship, run: Trial) -> list[str]:
    """A warning where a run leaves the trials that its ship was fitted to; none where it does not."""
    found = grounds.beyond(run, ship.model.controls) if grounds is not None else ()
    if not found:
        return []  # and no pages are imported
    from ..report.judging.tested import reached

    return [f"warning: {run.name} goes beyond the trials of the fit: {reached(found)}; no error is known there"]


def as_steered(trial: Trial, predicted: Trial) -> Trial:
    """A prediction of a trial with the controls and surroundings of that."""
    rows = np.clip(np.searchsorted(trial.t, predicted.t - 1e-9), 0, len(trial) - 1)
    return trial.rows(rows).having(**{name: predicted[name] for name in STATES})


def doubts(ship: Ship) -> list[str]:
    """Lines on what is physically doubtful in the mass matrix of a ship that has one."""
    return [f"{ship.name}: {text}" for text in ship.model.mass_doubts(float(ship.L_pp))]


def positive(**options: float | None) -> None:
    """Refuse an option that is given and is not a positive number."""
    for name, value in options.items():
        option = f"--{name.replace('_', '-')}"
        if value is not None and not (value > 0 and math.isfinite(value)):
            raise RequestError(f"{option} is {value:g}; it must be above zero")
        if value is not None and not in_reach(value):
            raise RequestError(f"{option} is {value:g}; {REACH}")


def level_of(asked: Draws) -> float:
    """The level of bands [%].

    Raises:
        RequestError: one that makes no band.
    """
    level = asked.level or 0.0
    if not 0.0 < level < 100.0:
        raise RequestError(f"--bands is {level:g} percent; it is above 0 and below 100, such as 95")
    return level


def banded(asked: Draws) -> bool:
    """Whether bands are asked for.

    Raises:
        RequestError: they are not, but what belongs to them.
    """
    if asked.level is None and asked != type(asked)():
        raise RequestError(f"{'--extrapolate' if asked.count is None else '--draws'} needs --bands: add --bands 95")
    return asked.level is not None


def finite(**options: float | None) -> None:
    """Refuse an option that is given and is not a finite number."""
    for name, value in options.items():
        if value is not None and not math.isfinite(value):
            raise RequestError(f"--{name} is {value:g}; it must be a finite number")
        if value is not None and value != 0.0 and not in_reach(value):
            raise RequestError(f"--{name} is {value:g}; {REACH}")


def speed_of(ship: Ship, speed: float | None, option: str = "--speed") -> float:
    """Initial speed [m/s]; that of the ship's file where none is given.

    Raises:
        RequestError: a speed above a Froude number of one and above twice the ship's own; no such ship reaches it.
    """
    if speed is None:
        return ship.speed
    most = max(math.sqrt(GRAVITY * ship.L_pp), 2.0 * ship.speed)
    if not speed <= most:
        raise RequestError(
            f"{option} is {speed:g} m/s; {ship.name} goes {ship.speed:g} m/s, "
            f"and {most:.3g} m/s is the most that makes sense"
        )
    return speed


def numbers(option: str, text: str, form: str) -> list[float]:
    """Numbers separated by commas, as many as `form` has, such as ``M/S,DEG such as 5,90``.

    Raises:
        RequestError: anything else.
    """
    wanted = form.partition(" ")[0].count(",") + 1
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if len(found) != wanted:
        raise RequestError(f"{option} is '{text}'; write {form}")
    return found


def pair(option: str, text: str, form: str) -> tuple[float, float]:
    """Two finite numbers of an option.

    Raises:
        RequestError: a text of another form than `form`, which describes it.
    """
    first, second = numbers(option, text, form)
    if not (math.isfinite(first) and math.isfinite(second)):
        raise RequestError(f"{option} is '{text}'; write {form}")
    return first, second


def vector(option: str, text: str | None, most: float = math.inf) -> tuple[float, float]:
    """Magnitude [m/s], up to `most`, and direction [rad] from ``M/S,DEG``.

    Raises:
        RequestError: anything else.
    """
    if text is None:
        return 0.0, 0.0
    size, direction = numbers(option, text, "M/S,DEG such as 5,90")
    if not (size >= 0 and all(one == 0.0 or in_reach(one) for one in (size, direction))):
        raise RequestError(f"{option} is '{text}'; the speed is zero or above, the direction a number")
    if size > most:
        meant = f", that is {direction:g},{size:g}" if 0.0 < direction <= most and size <= 360.0 else ""
        raise RequestError(f"{option} is '{text}'; {size:g} m/s is beyond any on record ({most:g} m/s): write M/S,DEG, "
                           f"speed first{meant}")  # fmt: skip
    return size, math.copysign(abs(direction) % 360.0, direction) * DEGREE


def _waves(text: str | None) -> tuple[float, float, float]:
    if text is None:
        return 0.0, 0.0, 0.0
    height, period, direction = numbers("--waves", text, "M,S,DEG such as 2,8,180")
    if not (height >= 0 and period > 0 and all(one == 0.0 or in_reach(one) for one in (height, period, direction))):
        raise RequestError(f"--waves is '{text}'; the height is zero or above, the period above zero")
    return height, period, direction * DEGREE


@dataclass(frozen=True)
class Surroundings:
    """Weather and depth around a ship as a simulation takes them, and in the units of the request, for output."""

    weather: Weather
    settings: Mapping[str, object]


def surroundings(ship: Ship, around: Around = Around(), seed: int = 1, note: Note = silent) -> Surroundings:
    """What is `around` a ship, with the seed of its gusts.

    Raises:
        RequestError: a value that cannot be read, or an influence that the ship's model has no force for.
    """
    from ..environment.weather import Gust

    depth, gusts = around.depth, around.gusts
    U_T, gamma_T = vector("--wind", around.wind, 150.0)
    U_C, gamma_C = vector("--current", around.current, 15.0)
    H_S, T_W, gamma_W = _waves(around.waves)
    base = Uniform(U_T, gamma_T, U_C, gamma_C, H_S, T_W, gamma_W, depth or math.inf)
    needs = (("--wind", U_T, "wind_x", "wind"), ("--waves", H_S, "wave_x", "waves"),
             ("--depth", depth or 0.0, "per_depth", "shallow water"))  # fmt: skip
    for option, given, channel, what in needs:
        if given and not feels(ship, channel):
            raise RequestError(f"{option}: {ship.name} has no force of {what}; {_remedy(ship, channel)}")
    _check_depth(ship, depth, note)
    if gusts is not None and not U_T:
        raise RequestError("--gusts need a mean wind to blow about; give --wind M/S,DEG")
    settings = {"wind": {"speed": U_T, "from": gamma_T / DEGREE},
                "current": {"speed": U_C, "towards": gamma_C / DEGREE},
                "waves": {"height": H_S, "period": T_W, "from": gamma_W / DEGREE},
                "depth": depth, "gusts": gusts}  # fmt: skip
    return Surroundings(base if gusts is None else Gust(base, gusts, seed), settings)


def _remedy(ship: Ship, channel: str) -> str:
    """How a ship gets a force that it lacks."""
    if "estimate" in ship.notes and "provenance" not in ship.notes and channel != "wave_x":
        return "estimate it with --shallow" if channel == "per_depth" else "estimate it with a table [wind]"
    return f"see seatrial show {ship.name}"


def _check_depth(ship: Ship, depth: float | None, note: Note) -> None:
    draught = float(ship.model.draught)
    if depth is not None and depth <= draught:
        raise RequestError(f"--depth is {depth:g} m; {ship.name} draws {draught:g} m and would be aground")
    if depth is not None and depth < SHALLOWEST * draught:
        note(f"note: --depth: h/d is {depth / draught:.3g}; corrections end at {SHALLOWEST:g}, whose factors are used")


def separate(folder: Path, sources: Iterable[Path]) -> None:
    """Refuse a folder of results that holds the trials they are made from."""
    if any((source if source.is_dir() else source.parent).resolve() == folder.resolve() for source in sources):
        raise DataError(f"{folder}: holds the trials themselves; choose another folder with -o")


def make_folder(folder: Path) -> None:
    """Make a folder for results.

    Raises:
        RequestError: something else is in its place.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RequestError(f"{folder}: not a folder that can be made: {error.strerror}") from None


def check_output(out: Path | None, kinds: tuple[str, ...], what: str, *inputs: Path) -> None:
    """Refuse an output of another kind, without a folder, or in the place of an input, before the work begins.

    Args:
        out: the file to write; None is never refused.
        kinds: endings that are accepted; the first is named.
        what: the file, such as "a ship file".
        inputs: files that must not be replaced.
    """
    if out is None:
        return
    if out.suffix.lower() not in kinds:
        raise RequestError(f"{out}: {what} ends in {kinds[0]}")
    if not out.parent.is_dir():
        raise RequestError(f"{out}: no such folder: {out.parent}")
    if out.is_dir():
        raise RequestError(f"{out}: is a folder; name a file with -o")
    if any(out.exists() and source.exists() and out.samefile(source) for source in inputs):
        raise RequestError(f"{out}: is an input; choose another file with -o")
