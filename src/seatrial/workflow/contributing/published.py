"""Published indices of a ship, which its file names, and what its model makes of them.

A ship file says what its source measured or computed, so that a reader of the file can see whether the model gives it::

    [[notes.published]]
    by = "model test"        # who found it: a "trial", a "model test", or "code" that computes the same equations
    manoeuvre = "turning"
    rudder = 35.0            # set points as options of `seatrial simulate`, in degrees
    index = "advance"
    over_L = 3.25            # or value and unit
    within = 0.05            # of the published number
    source = "yasukawa2015 Tab. 6, free-running model"

Code that agrees shows that numbers and equations were copied rightly, and nothing of the ship: it is another word.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from ...core.errors import SeatrialError
from ...core.files import toml_of
from ...core.parameters import unknown
from ...core.values import dataclass, fields
from ...ships import Ship
from .. import RequestError
from ..asked import Approach, Around, Orders, Span

if TYPE_CHECKING:
    from ..simulation import Simulated

Group = TypeVar("Group", Orders, Approach, Span, Around)
SETTINGS = ("rudder", "heading", "side", "speed", "rps", "steer", "throttle", "duration", "depth")
"""What a published figure may say of how it was measured."""
_BY = ("trial", "model test", "code")
_KEYS = ("by", "manoeuvre", *SETTINGS, "index", "value", "unit", "over_L", "within", "source")
_DEGREES = math.degrees(1.0)
_UNITS = {
    "deg": 1.0 / _DEGREES, "deg/s": 1.0 / _DEGREES, "rad": 1.0, "rad/s": 1.0, "m": 1.0, "s": 1.0, "m/s": 1.0, "-": 1.0,
}  # fmt: skip


@dataclass(frozen=True)
class Published:
    """An index that a source gives.

    Attributes:
        by: who found it: a "trial" or a "model test" measured it, "code" computed it from the same equations.
        value: SI units and radians, or lengths of the ship.
        lengths: whether `value` is in lengths of the ship.
        within: share of `value` by which a simulation may differ.
    """

    by: str
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


@dataclass(frozen=True)
class Standing:
    """What the numbers of a ship were held against.

    Attributes:
        state: "measured" where figures of trials or model tests are named, "verified code" where only those of
            another program are, else "unverified".
        figures: how many of that kind are named.
        within: the widest share by which the model may miss one of them; NaN without any.
        why: their sources, or why there is none.
    """

    state: Literal["measured", "verified code", "unverified"]
    figures: int
    within: float
    why: str

    @property
    def told(self) -> str:
        """State and figures in a few words."""
        return self.state if not self.figures else f"{self.state}: {self.figures} within {100.0 * self.within:.2g} %"


def standing(ship: Ship) -> Standing:
    """What the file of a ship says of figures.

    Raises:
        RequestError: as `published`.
    """
    found = published(ship)
    real = tuple(one for one in found if one.by != "code")
    some = real or found
    if not some:
        return Standing(
            "unverified", 0, math.nan, str(ship.notes.get("unverified") or "its file names no figure of it")
        )
    why = "; ".join(dict.fromkeys(one.source for one in some))
    return Standing("measured" if real else "verified code", len(some), max(one.within for one in some), why)


def warned(named: str | Path) -> str | None:
    """The line on an unverified ship of the library, a ship file, or a study; None on any other and on what is no file.

    A ship with figures of trials may say what of it they do not reach: its side thrusters, or shallow water.  A fit and
    an estimate tell how good they are in their own words.
    """
    from ...ships.files import load

    try:
        path = Path(named)
        said = toml_of(path.read_text(encoding="utf-8")) if path.suffix == ".toml" else {}
        base = said.get("ship") if isinstance(said.get("ship"), str) else None
        there = path.parent / base if base is not None and base.endswith(".toml") else base
        ship = load(there if there is not None else str(named))
        found = standing(ship)
    except (SeatrialError, OSError, ValueError):
        return None  # the command says what is wrong
    if "unverified" not in ship.notes and (found.state != "unverified" or {"provenance", "estimate"} & set(ship.notes)):
        return None
    part = "" if found.state == "unverified" else " in part"
    return f"{ship.name} is unverified{part}: {ship.notes.get('unverified') or found.why}"


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
    _complete(where, said)
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
    return Published(said["by"], str(said["manoeuvre"]), settings, str(said["index"]), value * _UNITS.get(unit, 1.0),
                     lengths, unit, within, str(said["source"]))  # fmt: skip


def _complete(where: str, said: Mapping[Any, Any]) -> None:
    """Refuse a key that no entry has, one that is missing, and another `by`."""
    for key in said:
        if key not in _KEYS:
            raise RequestError(f"{where}: {unknown(str(key), _KEYS, 'key')}")
    for key in ("by", "manoeuvre", "index", "within", "source"):
        if key not in said:
            raise RequestError(f"{where}: {key} is missing")
    if said["by"] not in _BY:
        raise RequestError(f"{where}: {unknown(str(said['by']), _BY, 'by')}")


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
    from ..simulation import simulate  # what only warns of a ship runs none

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
