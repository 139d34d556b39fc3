"""The columns that a mapping reads."""

from __future__ import annotations

from collections.abc import Mapping as Table

from ...core.values import dataclass
from .schema import Clock, Mapping


@dataclass(frozen=True)
class Use:
    """A column that a mapping reads.

    Attributes:
        key: where the mapping names it, such as `channels.psi.column`.
        column: its name.
        file: the file it is in; None for the file of the rows.
        number: whether its cells are numbers as they stand, and not texts of times, angles or letters.
    """

    key: str
    column: str
    file: str | None = None
    number: bool = True


def uses(mapping: Mapping) -> tuple[Use, ...]:
    """Every column that a mapping reads, the clock first."""
    found = _of_clock("time", mapping.time, None)
    for file, clock in (mapping.files.clocks if mapping.files else {}).items():
        found += _of_clock(f'files.clocks."{file}"', clock, file)
    for name, one in mapping.channels.items():
        plain = not one.letters or one.letter is not None
        found.append(Use(f"channels.{name}.column", one.column, one.file, plain))
        found += _named(f"channels.{name}", one.file, False, {"letter": one.letter})
    return (*found, *_of_instruments(mapping))


def _of_instruments(mapping: Mapping) -> list[Use]:
    found: list[Use] = []
    if (place := mapping.position) is not None:
        angles = {"latitude": place.latitude, "longitude": place.longitude}
        letters = {"latitude_letter": place.latitude_letter, "longitude_letter": place.longitude_letter}
        found += _named("position", place.file, place.format != "dms" and place.latitude != place.longitude, angles)
        found += _named("position", place.file, False, letters)
        minutes = {"latitude_minutes": place.latitude_minutes, "longitude_minutes": place.longitude_minutes}
        found += _named("position", place.file, True, minutes)
    if (ground := mapping.ground) is not None:
        keys = ("speed", "course", "north", "east")
        found += _named("ground", ground.file, True, {key: getattr(ground, key) for key in keys})
    if (log := mapping.log) is not None:
        found += _named("log", log.file, True, {"speed": log.speed, "course": log.course})
    if (wind := mapping.apparent) is not None:
        plain = not wind.letters or wind.letter is not None
        found += _named("apparent", wind.file, True, {"speed": wind.speed})
        found += _named("apparent", wind.file, plain, {"direction": wind.direction})
        found += _named("apparent", wind.file, False, {"letter": wind.letter})
    if (heading := mapping.heading) is not None:
        named = {f"quaternion[{k}]": column for k, column in enumerate(heading.quaternion)}
        found += _named("heading", heading.file, True, named)
    if mapping.split.column is not None:
        found += _named("split", None, False, {"column": mapping.split.column})
    return found


def _named(place: str, file: str | None, number: bool, columns: Table[str, str | None]) -> list[Use]:
    return [Use(f"{place}.{key}", column, file, number) for key, column in columns.items() if column is not None]


def _of_clock(place: str, clock: Clock, file: str | None) -> list[Use]:
    if clock.step is not None:
        return []
    dates = {"date" if len(clock.parts) == 1 else f"date[{k}]": one for k, one in enumerate(clock.parts)}
    texts = {**dates, "week": clock.week, "nanoseconds": clock.nanoseconds}
    found = _named(place, file, clock.format is None, {"column": clock.column})
    return found + _named(place, file, False, texts)
