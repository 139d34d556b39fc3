"""Which column is which quantity: the best name wins, each column and each quantity once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass, replace
from .. import Array
from .cells import Column

_LEAST = 0.45
"""Score of a name below which it says nothing."""

_NUMBERED = ("delta", "n_P", "alpha", "throttle", "force")
_COMMANDED = ("delta", "n_P", "alpha")
_ORDERS = ("throttle", "force")
"""What is told as an order only, so that a name which says so says nothing more."""
_PAIRS = (("north", "east"), ("x", "y"), ("latitude", "longitude"), ("v_north", "v_east"), ("vx", "vy"))
"""Quantities of which one alone is none: "n" without "e" is no northing."""

_TIMES = ("time", "stamp", "date", "clock", "epoch", "week", "tow", "trial")

_ANGLES = ("deg", "rad", "cdeg", "mrad", "gon", "mil")
_UNITS = {
    **dict.fromkeys(("heading", "yaw", "cog", "delta", "phi", "gamma_A", "gamma_T", "wind_direction", "gamma_C",
                     "alpha"), _ANGLES),
    "variation": ("deg",), "latitude": ("deg", "rad"), "longitude": ("deg", "rad"),
    "r": ("deg/s", "rad/s", "deg/min"), "n_P": ("1/s", "rpm"), "depth": ("m",), "throttle": ("-", "%", "us"),
    "force": ("N", "kN"),
    **dict.fromkeys(("north", "east", "x", "y"), ("m", "km", "ft", "NM", "yd", "cm", "mm")),
    **dict.fromkeys(("u", "v", "v_north", "v_east", "vx", "vy", "sog", "stw", "speed", "U_A", "U_T", "U_C",
                     "wind_speed"), ("m/s", "kn", "km/h", "ft/s", "mph", "cm/s")),
    **dict.fromkeys(("qx", "qy", "qz", "qw"), ("-",)),
}  # fmt: skip
"""Units that can measure each quantity."""


@dataclass(frozen=True)
class Signal:
    """A column as a quantity.

    Attributes:
        role: the quantity, with `_cmd` and a number where it has them.
        column: it is from.
        values: on the rows that all signals share.
        file: topic it is in; empty where the log is one file.
    """

    role: str
    column: Column
    values: Array
    file: str = ""

    def rows(self, piece: slice, rows: NDArray[np.intp]) -> Signal:
        """Some rows of a piece, its cells with them where they are of the same rows."""
        cells = tuple(self.column.cells)
        own = len(cells) == self.values.size
        column = replace(self.column, cells=tuple(np.array(cells, dtype=object)[piece][rows])) if own else self.column
        return replace(self, values=self.values[piece][rows], column=column)

    @property
    def unit(self) -> str:
        """Unit that the log says; empty where it says none that can measure this."""
        fitting = _UNITS.get(self.role.removesuffix("_cmd").rstrip("_123456789"), ())
        return self.column.unit if self.column.unit in fitting else ""


def signals(columns: Sequence[Column], clock: Sequence[str], file: str = "") -> dict[str, Signal]:
    """The quantities of a table by role; columns of the clock are none."""
    found = _assigned(columns, clock, file, frozenset())
    alone = {role for two in _PAIRS for role in two if role in found and not set(two) <= set(found)}
    return _of_a_unit(_assigned(columns, clock, file, frozenset(alone)) if alone else found)


def _of_a_unit(found: dict[str, Signal]) -> dict[str, Signal]:
    """The azimuth of an inertial unit is a heading: the log has no other, and no thruster that could have one."""
    others = {role.split("_")[0] for role in found} & {"heading", "yaw", "qw", "n", "throttle", "force"}
    if "alpha" not in found or others:
        return found
    rest = {role: one for role, one in found.items() if role != "alpha"}
    return rest | {"heading": replace(found["alpha"], role="heading")}


def _assigned(columns: Sequence[Column], clock: Sequence[str], file: str, never: frozenset[str]) -> dict[str, Signal]:
    """Roles to columns, the best score first."""
    pairs: list[tuple[float, int, str]] = []
    for k, column in enumerate(columns):
        if column.head in clock or column.kind not in ("number", "letters", "minutes", "dms"):
            continue
        for one in column.means:
            role = _role(column, one.role, one.words, one.number)
            score = one.score + (0.1 if _fits(column, one.role) else -0.3)
            if role and role not in never and one.score >= _LEAST:
                pairs.append((score, -k, role))
    found: dict[str, Signal] = {}
    taken: set[int] = set()
    for _, k, role in sorted(pairs, reverse=True):
        if role not in found and -k not in taken:
            taken.add(-k)
            found[role] = Signal(role, columns[-k], columns[-k].values, file)
    return found


def _role(column: Column, role: str, words: frozenset[str], number: int) -> str:
    if role in _TIMES:
        return ""
    if "command" in words:
        if role not in (*_COMMANDED, *_ORDERS):
            return ""
        role += "" if role in _ORDERS else "_cmd"
    stem = role.removesuffix("_cmd")
    if stem in _NUMBERED:
        side = 1 if "port" in words else 2 if "starboard" in words else number
        # "rudder port positive" is one rudder, and so is "rudder 1" alone: `sided` takes its number off
        role = f"{stem}_{side}{role.removeprefix(stem)}" if side else role
    return role


def _fits(column: Column, role: str) -> bool:
    """Whether the column's unit can measure the quantity, or nothing is said of it."""
    return not column.unit or column.unit in _UNITS.get(role, (column.unit,))


_FINE, _FAR = 4, 20.0
"""Digits after the dot of a position in degrees at least, and how far from 0 it is, in its own range."""


def placed(found: Mapping[str, Signal]) -> dict[str, Signal]:
    """The quantities of a log, x and y as latitude and longitude where they are degrees by size, range and digits."""
    pair = next((two for two in _PAIRS[:2] if set(two) <= set(found)), None)
    if pair is None or {"latitude", "longitude"} & set(found) or any(found[one].unit for one in pair):
        return dict(found)
    if not all(like_degrees(found[one]) for one in pair):
        return dict(found)
    out = {role: one for role, one in found.items() if role not in pair}
    # a map has its x to the east, a frame of a ship its x to the north: what cannot be a latitude is none
    east_first = bool(np.nanmax(np.abs(found[pair[0]].values)) > 90.0)
    names = ("longitude", "latitude") if east_first else ("latitude", "longitude")
    return out | {name: replace(found[one], role=name) for name, one in zip(names, pair, strict=True)}


def like_degrees(signal: Signal) -> bool:
    """Whether values are a track in degrees: within the globe, far from 0 against their range, with many digits."""
    good = signal.values[np.isfinite(signal.values)]
    if good.size < 2 or np.max(np.abs(good)) > 180.0 or not 0.0 < np.ptp(good) < 2.0:
        return False
    digits = [len(cell.strip().partition(".")[2]) for cell in signal.column.cells[:50] if cell.strip()]
    return float(np.min(np.abs(good))) > _FAR * float(np.ptp(good)) and sorted(digits)[len(digits) // 2] > _FINE


def sided(found: Mapping[str, Signal]) -> dict[str, Signal]:
    """The quantities of a log, numbers taken off where there is only one of a kind."""
    out = placed(found)
    for stem in _NUMBERED[:2]:
        for tail in ("", "_cmd"):
            numbered = [role for role in found if role.startswith(f"{stem}_") and role.endswith(tail)
                        and role.removeprefix(f"{stem}_").removesuffix(tail).isdigit()]  # fmt: skip
            if len(numbered) == 1 and f"{stem}{tail}" not in found:
                out[f"{stem}{tail}"] = replace(out.pop(numbered[0]), role=f"{stem}{tail}")
    return out


_HELD = 0.8
"""Part of the changes of a position that come after the usual number of rows where it is held, not at rest."""


def held_over(latitude: Array, longitude: Array) -> int:
    """Rows over which a logger repeats each position of a slower receiver; 1 where it does not."""
    good = np.isfinite(latitude + longitude)
    changed = np.flatnonzero((np.diff(latitude[good]) != 0.0) | (np.diff(longitude[good]) != 0.0))
    if changed.size < 10:
        return 1
    apart = np.diff(changed)
    usual = int(np.median(apart))
    return usual if usual > 1 and float((np.abs(apart - usual) <= 1).mean()) > _HELD else 1


_NEAR, _SAME = 0.35, 0.01
"""How far [rad] a heading lies from where the ship goes, and within which an angle is that course itself."""


def pointed(t: Array, found: Mapping[str, Signal], columns: Sequence[Column]) -> dict[str, Signal]:
    """The quantities of a log, with a column of no known name as its heading where it points about where the ship goes.

    Args:
        t: time of the rows [s].
        found: quantities, latitude and longitude in degrees.
        columns: of the same rows.
    """
    pair = next((two for two in _PAIRS[:3] if set(two) <= set(found)), None)
    if pair is None or {"heading", "yaw", "qw", "alpha"} & set(found) or t.size < 20:
        return dict(found)
    north, east = (found[role].values for role in pair)
    east = east * (np.cos(np.radians(np.nanmean(north))) if pair[0] == "latitude" else 1.0)
    far = max(t.size // 100, 1)
    went = (north[2 * far :] - north[: -2 * far]) + 1j * (east[2 * far :] - east[: -2 * far])
    moving = np.abs(went) > 0.3 * np.nanmax(np.abs(went), initial=0.0)
    used = {one.column.head for one in found.values()}
    near: list[tuple[float, Column]] = []
    for one in columns:
        if one.head in used or one.kind != "number" or one.unit not in ("", "deg", "rad") or one.values.size != t.size:
            continue
        if (one.means and one.means[0].score >= _LEAST) or not one.varies or np.nanmax(np.abs(one.values)) > 400.0:
            continue
        psi = one.values * (1.0 if one.unit == "rad" else np.pi / 180.0)
        off = np.abs(np.angle(went * np.exp(-1j * psi[far:-far])))[moving]
        most = float(np.nanquantile(off, 0.9))
        if most > _SAME and np.nanmedian(off) < _NEAR:
            near.append((most, one))
    if not near or min(near, key=lambda one: one[0])[0] > 2.0 * _NEAR:
        return dict(found)
    best = min(near, key=lambda one: one[0])[1]
    return {**found, "heading": Signal("heading", best, best.values)}


def somewhere(found: Mapping[str, Signal], columns: Sequence[Column]) -> dict[str, Signal]:
    """The quantities of a log; where it has no position, the only two columns of no known name like one are it.

    Two temperatures are as smooth: a heading or a course has to lie about where they go, in either order.
    """
    if any(set(two) & set(found) for two in _PAIRS[:3]):
        return dict(found)
    used = {one.column.head for one in found.values()}
    some = [one for one in columns if one.head not in used and one.kind in ("number", "letters", "minutes", "dms")
            and not (one.means and one.means[0].score >= _LEAST)]  # fmt: skip
    pair = [one for one in some if like_degrees(Signal("", one, one.values))]
    if len(pair) != 2:
        return dict(found)
    if not any(_leads(a.values, b.values, found) for a, b in (pair, pair[::-1])):
        return dict(found)
    letters = [{letter[:1] for letter in one.letters} for one in pair]
    turned = bool(letters[0] & {"E", "W"}) or float(np.nanmax(np.abs(pair[0].values))) > 90.0
    roles = ("longitude", "latitude") if turned else ("latitude", "longitude")
    return {**found, **{role: Signal(role, one, one.values) for role, one in zip(roles, pair, strict=True)}}


def _leads(latitude: Array, longitude: Array, found: Mapping[str, Signal]) -> bool:
    """Whether a track in degrees goes about where a heading or a course points."""
    far = max(latitude.size // 100, 1)
    narrow = np.cos(np.radians(np.nanmean(latitude)))
    went = latitude[2 * far :] - latitude[: -2 * far] + 1j * narrow * (longitude[2 * far :] - longitude[: -2 * far])
    moving = np.abs(went) > 0.3 * np.nanmax(np.abs(went), initial=0.0)
    said = [found[role] for role in ("heading", "yaw", "cog") if role in found and found[role].values.size > 2 * far]
    turns = [np.exp(-1j * one.values[far:-far] * size) for one in said for size in (np.pi / 180.0, 1.0)
             if one.unit != "rad" or size == 1.0]  # fmt: skip
    return any(float(np.nanmedian(np.abs(np.angle(went * one))[moving])) < _NEAR for one in turns if moving.any())


_STEADY, _VARIED = 0.3, 60.0
"""What a variation changes by in a trial, and how large it is at most [deg]."""


def variation_of(found: Mapping[str, Signal]) -> tuple[float, str]:
    """The variation beside a heading, in degrees and with a sign, and it in words; 0 and "" where it is none."""
    beside = found.get("variation")
    good = beside.values[np.isfinite(beside.values)] if beside is not None else np.zeros(0)
    if beside is None or beside.column.kind != "number" or beside.column.unit not in ("", "deg") or not good.size:
        return 0.0, ""
    if np.ptp(good) > _STEADY or np.abs(good).max() > _VARIED:
        return 0.0, ""
    middle = float(np.median(good))
    return middle, f"{middle:+.6g} deg of {beside.column.said} are added; "


STRANGE, _STRANGERS, _OVER = "strange_", 12, 90.0


def strangers(found: Mapping[str, Signal], columns: Sequence[Column]) -> dict[str, Signal]:
    """Columns of no known name whose whole numbers may be a rudder's angles, by a role that no quantity has."""
    if any(one.startswith(("delta", "alpha", "throttle", "force")) for one in found):
        return {}
    used = {one.column.head for one in found.values()}
    some = [one for one in columns if one.head not in used and one.kind == "number" and one.varies
            and np.isfinite(one.values).all() and np.abs(one.values).max() <= _OVER
            and not (one.means and one.means[0].score >= _LEAST)]  # fmt: skip
    return {f"{STRANGE}{k}": Signal(f"{STRANGE}{k}", one, one.values) for k, one in enumerate(some[:_STRANGERS])}


def trial_column(columns: Sequence[Column], t: Array) -> Column | None:
    """The column that numbers or names the trials of one file: few values, each in one piece."""
    for column in columns:
        if column.score("trial") < _LEAST or column.kind not in ("number", "text"):
            continue
        cells = np.array([cell.strip() for cell in column.cells])
        changes = int((cells[1:] != cells[:-1]).sum())
        if 1 <= changes == np.unique(cells).size - 1 and changes < t.size / 20:
            return column
    return None
