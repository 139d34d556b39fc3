"""What the commands share: messages, JSON, tables, and from words of the command line to SI values."""

from __future__ import annotations

import json
import math
import signal
import sys
import time
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import UsageError as UsageError
from ..core.files import REACH, in_reach
from ..data import DataError
from ..environment import Uniform, Weather
from ..forces.shallow import SHALLOWEST
from ..identify import StudyError
from ..manoeuvres import Index
from ..ships import Ship
from ..ships.felt import feels
from .terminal import in_json, one_line, shown
from .terminal import note as note
from .terminal import say as say

if TYPE_CHECKING:
    from rich.console import Console
    from rich.status import Status

DEGREE = math.pi / 180.0
# Where nobody watches a terminal: a line for every so many rows of a history, or after a silence of so many seconds.
_EVERY, _SILENCE = 10, 10.0


class Stopped(KeyboardInterrupt):
    """Ctrl-C where there is something to say about going on; the text says it."""


class Spoken:
    """Progress of fits in words.

    Args:
        say: takes each line.
        words: of iteration, objective and validation (or NaN).
        seldom: say only the first row, every tenth, and one after a silence.
    """

    def __init__(
        self, say: Callable[[str], object], words: Callable[[int, float, float], str], seldom: bool = False
    ) -> None:
        self.stage, self._words, self._seldom, self._said = say, words, seldom, -math.inf

    def __call__(self, iteration: int, objective: float, validation: float) -> None:
        """A row of the history."""
        now = time.monotonic()
        if self._seldom and iteration != 1 and iteration % _EVERY and now - self._said < _SILENCE:
            return
        self._said = now
        self.stage(self._words(iteration, objective, validation))


def obeyed() -> None:
    """Ctrl-C has done what it is for; see `cli_outcome`, which raises it again until then."""
    signal.setitimer(signal.ITIMER_REAL, 0.0)


@contextmanager
def fitting(study: Path, again: str) -> Generator[None, None, None]:
    """Say what to do after Ctrl-C, and which file it is that an estimator refuses."""
    try:
        yield
    except KeyboardInterrupt:
        raise Stopped(f"interrupted; run the same command again{again}") from None
    except StudyError as error:  # of an estimator, which knows no file
        raise StudyError(str(error) if str(study) in str(error) else f"{study}: {error}") from None


def emit(document: Mapping[str, Any]) -> None:
    """One JSON object to standard output; a number that is not finite becomes null."""
    say(in_json(json.dumps(_plain(document), ensure_ascii=False, allow_nan=False)) + "\n")


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
        table.add_column(escape(shown(name)), justify="right" if k in right else "left", overflow="fold")
    for row in rows:
        table.add_row(*(escape(shown(cell)) for cell in row))
    console().print(table)


def live(status: Status) -> Callable[[str], None]:
    """Who puts a text on the moving line of a terminal."""
    from rich.markup import escape

    return lambda text: status.update(escape(one_line(text)))


def read_ship(name: str) -> Ship:
    """A ship of the library by name, or a ship file."""
    from ..ships.files import load

    return load(name)


def doubts(ship: Ship) -> list[str]:
    """What is physically doubtful about the mass matrix of a ship that has one, in lines."""
    return [f"{ship.name}: {text}" for text in ship.model.mass_doubts(float(ship.L_pp))]


def positive(**options: float | None) -> None:
    """Raise a UsageError for an option that is given and not a positive number."""
    for name, value in options.items():
        if value is not None and not (value > 0 and math.isfinite(value)):
            raise UsageError(f"--{name.replace('_', '-')} is {value:g}; it must be above zero")
        if value is not None and not in_reach(value):
            raise UsageError(f"--{name.replace('_', '-')} is {value:g}; {REACH}")


def speed_of(ship: Ship, speed: float | None, option: str = "--speed") -> float:
    """The speed at the start [m/s], hers where none is given.

    Raises:
        UsageError: above a Froude number of one, and above twice her own: no ship that displaces water goes so fast.
    """
    if speed is None:
        return ship.speed
    most = max(math.sqrt(9.81 * ship.L_pp), 2.0 * ship.speed)
    if not speed <= most:
        raise UsageError(
            f"{option} is {speed:g} m/s; {ship.name} goes {ship.speed:g} m/s, "
            f"and {most:.3g} m/s is the most that makes sense"
        )
    return speed


def finite(**options: float | None) -> None:
    """Raise a UsageError for an option that is given and no finite number."""
    for name, value in options.items():
        if value is not None and not math.isfinite(value):
            raise UsageError(f"--{name} is {value:g}; it must be a finite number")
        if value is not None and value != 0.0 and not in_reach(value):
            raise UsageError(f"--{name} is {value:g}; {REACH}")


def vector(option: str, text: str | None, most: float = math.inf) -> tuple[float, float]:
    """Magnitude [m/s], up to `most`, and direction [rad] from ``M/S,DEG``.

    Raises:
        UsageError: anything else.
    """
    if text is None:
        return 0.0, 0.0
    try:
        size, direction = (float(part) for part in text.split(","))
    except ValueError:
        raise UsageError(f"{option} is '{text}'; write M/S,DEG such as 5,90") from None
    if not (size >= 0 and all(one == 0.0 or in_reach(one) for one in (size, direction))):
        raise UsageError(f"{option} is '{text}'; the speed is zero or above, the direction a number")
    if size > most:
        raise UsageError(f"{option} is '{text}'; {size:g} m/s is beyond any on record ({most:g} m/s): write M/S,DEG")
    return size, math.copysign(abs(direction) % 360.0, direction) * DEGREE


def index_json(index: Index) -> dict[str, Any]:
    """One figure with its unit; angles in degrees, lengths also in ship lengths."""
    if index.unit in ("rad", "rad/s"):
        return {"value": index.value / DEGREE, "unit": index.unit.replace("rad", "deg")}
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


@dataclass(frozen=True)
class Around:
    """What a user put around the ship: the weather, and the settings as they go to the output."""

    weather: Weather
    settings: Mapping[str, Any]


def around_ship(
    ship: Ship, wind: str | None, gusts: str | None, current: str | None, waves: str | None,
    depth: float | None, seed: int,
) -> Around:  # fmt: skip
    """Wind, gusts, current, waves and depth as given on the command line.

    Raises:
        UsageError: a figure that cannot be read; something that this ship's model does not feel.
    """
    from ..environment.weather import Gust

    U_T, gamma_T = vector("--wind", wind, 150.0)
    U_C, gamma_C = vector("--current", current, 15.0)
    H_S, T_W, gamma_W = _waves(waves)
    base = Uniform(U_T, gamma_T, U_C, gamma_C, H_S, T_W, gamma_W, depth or math.inf)
    needs = (("--wind", U_T, "wind_x", "wind"), ("--waves", H_S, "wave_x", "waves"),
             ("--depth", depth or 0.0, "per_depth", "shallow water"))  # fmt: skip
    for option, given, channel, what in needs:
        if given and not feels(ship, channel):
            raise UsageError(f"{option}: {ship.name} has no force of {what}; see seatrial show {ship.name}")
    draught = float(ship.model.draught)
    if depth is not None and depth <= draught:
        raise UsageError(f"--depth is {depth:g} m; {ship.name} draws {draught:g} m and would be aground")
    if depth is not None and depth < SHALLOWEST * draught:
        note(f"note: --depth: h/d is {depth / draught:.3g}; corrections end at {SHALLOWEST:g}, whose factors are used")
    if gusts is not None and not U_T:
        raise UsageError("--gusts need a mean wind to blow about; give --wind M/S,DEG")
    settings = {"wind": {"speed": U_T, "from": gamma_T / DEGREE},
                "current": {"speed": U_C, "towards": gamma_C / DEGREE},
                "waves": {"height": H_S, "period": T_W, "from": gamma_W / DEGREE},
                "depth": depth, "gusts": gusts}  # fmt: skip
    return Around(base if gusts is None else Gust(base, gusts, seed), settings)


def _waves(text: str | None) -> tuple[float, float, float]:
    if text is None:
        return 0.0, 0.0, 0.0
    try:
        height, period, direction = (float(part) for part in text.split(","))
    except ValueError:
        raise UsageError(f"--waves is '{text}'; write M,S,DEG such as 2,8,180") from None
    if not (height >= 0 and period > 0 and all(one == 0.0 or in_reach(one) for one in (height, period, direction))):
        raise UsageError(f"--waves is '{text}'; the height is zero or above, the period above zero")
    return height, period, direction * DEGREE


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


def claimed(out: Path, page: str, digest: str, name: str) -> tuple[bool, bool]:
    """Whether the folder of a study with a page of its own is new, and whether the study is done in it."""
    from ..study.store import claim

    fresh, done = claim(out, digest, name), (out / page).exists()
    if done:
        note(f"{out}: this study is done already, with the same data and settings; nothing was run")
    return fresh, done
