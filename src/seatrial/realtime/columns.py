"""What a recording holds of a ship: the channels of a trial, read off her as she is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from ..data import UNITS
from ..models import STATES, unit
from .plant import Plant

_VECTORS = (("wind", "U_T", "gamma_T"), ("current", "U_C", "gamma_C"), ("wave", "H_S", "gamma_W"))
_WAVES, _BOTTOM = ("H_S", "gamma_W", "T_W"), ("depth",)
Reader = Callable[[], float]


class Columns:
    """Channels of a trial by name, time first.

    Attributes:
        names: what they are called.
    """

    def __init__(self, plant: Plant, names: Iterable[str], held: Iterable[str] = ()) -> None:
        """Read these channels off a ship.

        Args:
            held: controls that obey at once: what acts from a row on is what is ordered there.
        """
        readers = _readers(plant, tuple(held))
        self.names = tuple(names)
        self._read = tuple(readers[name] for name in self.names)

    def row(self) -> list[float]:
        """Their values now."""
        return [read() for read in self._read]

    @property
    def head(self) -> str:
        """The first line of a trial file."""
        return ",".join(f"{name} [{UNITS.get(name) or unit(name)}]" for name in self.names)


def usual_names(plant: Plant) -> tuple[str, ...]:
    """What is recorded of a ship: always wind and current, waves and a bottom where there are any."""
    waves = plant.changing or any(plant[name] != 0.0 for name in ("wave_x", "wave_y", "wave_T"))
    bottom = plant["per_depth"] != 0.0
    commands = (f"{name}_cmd" for name in plant.controls)
    air_and_water = (name for _, *pair in _VECTORS[:2] for name in pair)
    return ("t", *STATES, *plant.controls, *commands, *air_and_water, *(_WAVES if waves else ()),
            *(_BOTTOM if bottom else ()))  # fmt: skip


def text(row: list[float]) -> str:
    """A row of a trial file; numbers read back to the same bits, a gap is empty."""
    return ",".join("" if value != value else repr(value) for value in row)


def _readers(plant: Plant, held: tuple[str, ...]) -> dict[str, Reader]:
    found: dict[str, Reader] = {"t": lambda: plant.t}
    for name in (*STATES, *plant.controls):
        found[name] = _value(plant, f"{name}_cmd" if name in held else name)
    for name in plant.controls:
        found[f"{name}_cmd"] = _value(plant, f"{name}_cmd")
    for of, size, direction in _VECTORS:
        found[size], found[direction] = _length(plant, of), _direction(plant, of)
    found["T_W"] = _value(plant, "wave_T")
    found["depth"] = lambda: 1.0 / plant["per_depth"] if plant["per_depth"] else math.nan
    return found


def _value(plant: Plant, name: str) -> Reader:
    return lambda: plant[name]


def _length(plant: Plant, of: str) -> Reader:
    return lambda: math.hypot(plant[f"{of}_x"], plant[f"{of}_y"])


def _direction(plant: Plant, of: str) -> Reader:
    return lambda: math.atan2(plant[f"{of}_y"], plant[f"{of}_x"])
