"""Published indices of a ship, which its file names, and what its model makes of them.

A ship file says what its source measured or computed, so that a reader of the file can see whether the model gives it::

    [[notes.published]]
    manoeuvre = "turning"
    rudder = 35.0            # set points as options of `seatrial simulate`, in degrees
    index = "advance"
    over_L = 3.25            # or value and unit
    within = 0.05            # of the published number
    source = "yasukawa2015 Tab. 6, free-running model"
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, TypeVar

from ...core.errors import SeatrialError
from ...core.parameters import unknown
from ...ships import Ship
from .. import RequestError
from ..asked import Approach, Around, Orders, Span
from ..simulation import Simulated, simulate

Group = TypeVar("Group", Orders, Approach, Span, Around)
SETTINGS = ("rudder", "heading", "side", "speed", "rps", "steer", "throttle", "duration", "depth")
_KEYS = ("manoeuvre", *SETTINGS, "index", "value", "unit", "over_L", "within", "source")
_DEGREES = math.degrees(1.0)
_UNITS = {
    "deg": 1.0 / _DEGREES, "deg/s": 1.0 / _DEGREES, "rad": 1.0, "rad/s": 1.0, "m": 1.0, "s": 1.0, "m/s": 1.0, "-": 1.0,
}  # fmt: skip


@dataclass(frozen=True)
class Published:
    """An index that a source gives.

    Attributes:
        value: SI units and radians, or lengths of the ship.
        lengths: whether `value` is in lengths of the ship.
        within: share of `value` by which a simulation may differ.
    """

    manoeuvre: str
    settings: Mapping[str, Any]
    index: str
    value: float
    lengths: bool
    unit: str
    within: float
    source: str


@dataclass(frozen=True)
class Reproduced:
    """What the model gives in place of a published index; NaN with the reason where the run did not reach it."""

    published: Published
    value: float
    reason: str = ""

    @property
    def ratio(self) -> float:
        """Simulated over published."""
        return self.value / self.published.value if self.published.value else math.nan

    @property
    def kept(self) -> bool:
        """Whether it is within the tolerance."""
        return abs(self.value - self.published.value) <= self.published.within * abs(self.published.value)


def published(ship: Ship) -> tuple[Published, ...]:
    """The indices that the file of a ship names.

    Raises:
        RequestError: an entry that cannot be used, by its number, with what would be right.
    """
    said = ship.notes.get("published", ())
    if not isinstance(said, list | tuple):
        raise RequestError(f"{ship.name}: notes.published is a list of tables: [[notes.published]]")
    return tuple(_read(f"{ship.name}: notes.published, entry {k}", one) for k, one in enumerate(said, 1))


def _read(where: str, said: Any) -> Published:
    if not isinstance(said, Mapping):
        raise RequestError(f"{where}: not a table; write [[notes.published]]")
    for key in said:
        if key not in _KEYS:
            raise RequestError(f"{where}: {unknown(str(key), _KEYS, 'key')}")
    for key in ("manoeuvre", "index", "within", "source"):
        if key not in said:
            raise RequestError(f"{where}: {key} is missing")
    lengths = "over_L" in said
    if lengths == ("value" in said):
        raise RequestError(f"{where}: give over_L, in lengths of the ship, or value with unit")
    unit = "L" if lengths else str(said.get("unit", ""))
    if not lengths and unit not in _UNITS:
        raise RequestError(f"{where}: {unknown(unit, tuple(_UNITS), 'unit')}")
    try:
        value, within = float(said["over_L" if lengths else "value"]), float(said["within"])
    except (TypeError, ValueError):
        raise RequestError(f"{where}: value and within are numbers") from None
    if not (0.0 < within < 1.0 and math.isfinite(value)):
        raise RequestError(f"{where}: within is {within:g}; it is a share of the published number, such as 0.05")
    settings = {key: said[key] for key in SETTINGS if key in said}
    return Published(str(said["manoeuvre"]), settings, str(said["index"]), value * _UNITS.get(unit, 1.0), lengths, unit,
                     within, str(said["source"]))  # fmt: skip


def reproduce(ship: Ship, wanted: tuple[Published, ...]) -> tuple[Reproduced, ...]:
    """Each published index as the model gives it; entries with the same run share it.

    Raises:
        RequestError: a manoeuvre or an index that does not exist.
    """
    runs: dict[tuple[Any, ...], Simulated | str] = {}
    found: list[Reproduced] = []
    for one in wanted:
        key = (one.manoeuvre, *sorted(one.settings.items()))
        if key not in runs:
            runs[key] = _run(ship, one)
        found.append(_found(ship, one, runs[key]))
    return tuple(found)


def _run(ship: Ship, one: Published) -> Simulated | str:
    try:
        return simulate(ship, one.manoeuvre, orders=_some(Orders, one), begin=_some(Approach, one),
                        span=_some(Span, one), around=_some(Around, one))  # fmt: skip
    except RequestError:
        raise
    except SeatrialError as error:
        return str(error)


def _some(group: type[Group], one: Published) -> Group:
    """The settings of an entry that belong to a group."""
    own = {field.name for field in fields(group)}
    return group(**{key: value for key, value in one.settings.items() if key in own})


def _found(ship: Ship, one: Published, ran: Simulated | str) -> Reproduced:
    if isinstance(ran, str):
        return Reproduced(one, math.nan, ran)
    indices = ran.policy.indices(ran.trial, ran.ship.L_pp)
    if one.index not in indices:
        if ran.complete:
            raise RequestError(f"{ship.name}: notes.published: {unknown(one.index, tuple(indices), 'index')}")
        return Reproduced(one, math.nan, ran.reason or "the run did not reach it")
    return Reproduced(one, indices[one.index].value / (ran.ship.L_pp if one.lengths else 1.0))


def shown(one: Published, value: float) -> str:
    """A value with its unit, angles in degrees."""
    return f"{value / _UNITS.get(one.unit, 1.0):.4g} {one.unit}"
