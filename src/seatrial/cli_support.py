"""What the commands share: messages, JSON, tables, and from words of the command line to SI values."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .data import DataError, Trial
from .environment import Uniform
from .manoeuvres import Index, Manoeuvre
from .manoeuvres.turning import Turning
from .manoeuvres.zigzag import Zigzag
from .models import STATES
from .parameters import unknown
from .ships import Ship

if TYPE_CHECKING:
    from rich.console import Console

DEGREE = math.pi / 180.0
# A manoeuvre that is not over after this many ship lengths of way never will be.
_FIRST, _LAST = 30.0, 2000.0


class UsageError(ValueError):
    """A request that cannot be carried out; the text names what, where and the alternatives."""


def note(text: str) -> None:
    """One line for the user, beside the output."""
    sys.stderr.write(text.rstrip("\n") + "\n")


def note_warning(message: Warning | str, *_: Any) -> None:
    """A Python warning as one line for the user."""
    note(f"note: {message}")


def emit(document: Mapping[str, Any]) -> None:
    """One JSON object to standard output; a number that is not finite becomes null."""
    sys.stdout.write(json.dumps(_plain(document), ensure_ascii=False, allow_nan=False) + "\n")


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


def console() -> Console:
    """Standard output as Rich writes it; wide where nobody watches, so that nothing is cut."""
    from rich.console import Console

    return Console(highlight=False, width=None if sys.stdout.isatty() else 160, soft_wrap=True)


def show_table(head: Sequence[str], rows: Iterable[Sequence[str]], right: Sequence[int] = ()) -> None:
    """A plain table; `right` are the columns of numbers."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for k, name in enumerate(head):
        table.add_column(escape(name), justify="right" if k in right else "left", overflow="fold")
    for row in rows:
        table.add_row(*map(escape, row))
    console().print(table)


def read_ship(name: str) -> Ship:
    """A ship of the library by name, or a ship file."""
    from .ships.files import load

    return load(name)


@dataclass(frozen=True)
class Settings:
    """Set points of a manoeuvre as given: degrees; None takes the manoeuvre's own."""

    rudder: float | None
    heading: float | None
    side: str


def _turning(n_P: float, settings: Settings) -> Turning:
    if settings.heading is not None:
        raise UsageError("turning takes no --heading; it takes --rudder and --side")
    return Turning(n_P, _sign(settings.side) * _angle("--rudder", settings.rudder, 35.0))


def _zigzag(n_P: float, settings: Settings) -> Zigzag:
    delta = _angle("--rudder", settings.rudder, 10.0)
    return Zigzag(n_P, delta, _angle("--heading", settings.heading, 10.0), _sign(settings.side))


MANOEUVRES: Mapping[str, Callable[[float, Settings], Manoeuvre]] = {"turning": _turning, "zigzag": _zigzag}


def _sign(side: str) -> float:
    return -1.0 if side == "port" else 1.0


def _angle(option: str, degrees: float | None, default: float) -> float:
    value = default if degrees is None else degrees
    if not 0 < value <= 180:
        raise UsageError(f"{option} is {value:g} deg; it is a magnitude above 0 (--side gives the side)")
    return value * DEGREE


def manoeuvre(name: str, n_P: float, settings: Settings, ship: Ship) -> Manoeuvre:
    """The named manoeuvre for a ship with revolutions `n_P` [1/s].

    Raises:
        UsageError: an unknown manoeuvre or side, an angle that cannot be, a rudder beyond the ship's.
    """
    check_manoeuvre(name)
    if settings.side not in ("port", "starboard"):
        raise UsageError(f"--side is '{settings.side}'; known: port, starboard")
    made = MANOEUVRES[name](n_P, settings)
    rudder = abs(getattr(made, "delta", 0.0))
    limit = float(ship.actuators.rudder.high)
    if rudder > limit * (1 + 1e-9):
        raise UsageError(
            f"--rudder is {rudder / DEGREE:g} deg; the rudder of {ship.name} goes to {limit / DEGREE:g} deg"
        )
    return made


def check_manoeuvre(name: str) -> None:
    """Raise a UsageError that lists the known ones for an unknown manoeuvre."""
    if name not in MANOEUVRES:
        near = unknown(name, MANOEUVRES, "manoeuvre").partition(";")[0]
        raise UsageError(f"{near}; known: {', '.join(MANOEUVRES)}")


def positive(**options: float | None) -> None:
    """Raise a UsageError for an option that is given and not a positive number."""
    for name, value in options.items():
        if value is not None and not (value > 0 and math.isfinite(value)):
            raise UsageError(f"--{name} is {value:g}; it must be above zero")


def vector(option: str, text: str | None) -> tuple[float, float]:
    """Magnitude [m/s] and direction [rad] from ``M/S,DEG``.

    Raises:
        UsageError: anything else.
    """
    if text is None:
        return 0.0, 0.0
    try:
        size, direction = (float(part) for part in text.split(","))
    except ValueError:
        raise UsageError(f"{option} is '{text}'; write M/S,DEG such as 5,90") from None
    if not (size >= 0 and math.isfinite(size) and math.isfinite(direction)):
        raise UsageError(f"{option} is '{text}'; the speed is zero or above, the direction a number")
    return size, direction * DEGREE


def run_manoeuvre(
    ship: Ship, policy: Manoeuvre, *, speed: float, duration: float | None, dt: float | None, around: Uniform
) -> tuple[Trial, bool]:
    """The run and whether it holds all its indices; without a duration it grows until it does."""
    from .simulate import simulate

    length = duration or _FIRST * ship.L_pp / max(speed, 1e-3)
    limit = length if duration else _LAST * ship.L_pp / max(speed, 1e-3)
    while True:
        run = simulate(ship, policy, speed=speed, duration=length, environment=around, dt=dt)
        complete = policy.complete(run)
        if complete or 2 * length > limit:
            return run, complete
        length *= 2


def index_json(index: Index) -> dict[str, Any]:
    """One figure with its unit; angles in degrees, lengths also in ship lengths."""
    if index.unit == "rad":
        return {"value": index.value / DEGREE, "unit": "deg"}
    out: dict[str, Any] = {"value": index.value, "unit": index.unit}
    return out if index.over_L is None else {**out, "over_L": index.over_L}


def show_indices(title: str, indices: Mapping[str, Mapping[str, Any]]) -> None:
    """The figures of a manoeuvre as a table."""
    rows = [
        (name.replace("_", " "), figure(i["value"], 5), i["unit"], figure(i.get("over_L")))
        for name, i in indices.items()
    ]
    show_table((title, "value", "unit", "in L_pp"), rows, right=(1, 3))


def figure(value: float | None, digits: int = 4) -> str:
    """A number for a table."""
    return "–" if value is None or not math.isfinite(value) else f"{value:.{digits}g}"


def around_ship(ship: Ship, wind: tuple[float, float], current: tuple[float, float]) -> Uniform:
    """Steady wind and current; a ship that cannot feel the wind refuses one."""
    if wind[0] and getattr(ship.model, "wind", None) is None:
        raise UsageError(f"--wind: {ship.name} has no wind force; give its file a [wind] table, or leave --wind out")
    return Uniform(*wind, *current)


def cautions(ship: Ship, trials: Iterable[Trial]) -> list[str]:
    """What a user should know before trusting a prediction of these trials by this ship."""
    lines: list[str] = []
    for trial in trials:
        length = trial.meta.get("L_pp")
        if isinstance(length, int | float) and abs(length / ship.L_pp - 1) > 0.02:
            lines.append(f"warning: {trial.name} is of a ship of {length:g} m, {ship.name} has {ship.L_pp:g} m")
        if getattr(ship.model, "wind", None) is not None and "U_T" not in trial:
            lines.append(f"warning: {trial.name} has no wind (U_T, gamma_T); predicted in still air")
        held = [n for n in ship.model.controls if n in trial and not np.isfinite(trial[n]).all()]
        if held:
            lines.append(f"warning: {trial.name} has gaps in {', '.join(held)}; the last value before each is held")
        if all(n in trial for n in STATES):
            known = np.flatnonzero(np.isfinite(trial.stack(*STATES)).all(axis=1))
            cut = len(trial) - (known[-1] - known[0] + 1) if known.size else 0
            if cut:
                lines.append(f"note: {trial.name}: {cut} rows outside of the complete ones are left out")
    return lines


def separate(folder: Path, sources: Iterable[Path]) -> None:
    """Raise a DataError where predictions would be written over the trials they were made from."""
    for source in sources:
        at = source if source.is_dir() else source.parent
        if at.resolve() == folder.resolve():
            raise DataError(f"{folder}: holds the trials themselves; choose another folder with -o")


def make_folder(folder: Path) -> None:
    """Make a folder for results.

    Raises:
        UsageError: something else is in its place.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{folder}: not a folder that can be made: {error.strerror}") from None
