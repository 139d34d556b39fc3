"""Wind: apparent or true, from or towards, its side and units: the true wind does not turn with the ship."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product

import numpy as np

from ...core.values import dataclass, replace
from .. import Array
from ..units import KNOWN
from .answers import ASK, Answer, Entry, quoted
from .motion import SPEEDS
from .roles import Signal

Motions = tuple[Array, Array, Array]
"""Heading [rad], speeds over ground ahead and to starboard [m/s]."""

_CLEAR, _FLOOR = 1.2, 0.03
_STRAINED = 1.5
_ROWS = 400


@dataclass(frozen=True)
class WindReading:
    """One way to read a wind.

    Attributes:
        relative: apparent, from the bow; else true, from north.
        towards: the direction is where it goes to.
        side: 1 where angles grow to starboard or clockwise, else -1.
        unit, angle: of speed and direction.
        strain: how far it is from what the names say.
        miss: how much the true wind would change, as a share of it.
    """

    relative: bool
    towards: bool
    side: int
    unit: str
    angle: str
    strain: float
    miss: float = 0.0


@dataclass(frozen=True)
class WindVerdict:
    """The reading of a wind that fits and strains least.

    Attributes:
        best: the reading.
        rival: the best of the others; None without a test.
        close: readings that fit about as well and strain the names little more.
    """

    best: WindReading
    rival: WindReading | None
    close: tuple[WindReading, ...]


def read_wind(found: Mapping[str, Signal], pair: tuple[str, str], motion: Motions | None) -> WindVerdict:
    """Read one wind: the true wind is the one that changes least.

    Args:
        found: quantities of the log.
        pair: roles of speed and direction.
        motion: heading and speeds over ground ahead and to starboard, None where they are unknown.
    """
    readings = _readings(found, pair)
    if motion is None:
        first = min(readings, key=lambda one: one.strain)
        near = tuple(one for one in readings if one is not first and one.strain < first.strain + _STRAINED)
        return WindVerdict(first, None, near)
    airs = _airs(found, pair, readings, motion)
    return _chosen([(one, _share(air, np.nanmean(air, axis=0))) for one, air in zip(readings, airs, strict=True)])


def read_two_winds(
    found: Mapping[str, Signal], apparent: tuple[str, str], true: tuple[str, str], motion: Motions
) -> tuple[WindVerdict, WindVerdict]:
    """Read an apparent and a true wind together: both are one wind."""
    first, second = ([one for one in _readings(found, pair) if one.relative is relative]
                     for pair, relative in ((apparent, True), (true, False)))  # fmt: skip
    airs, others = _airs(found, apparent, first, motion), _airs(found, true, second, motion)
    table = np.array([[_share(b, a) for b in others] for a in airs])
    strain = np.array([[a.strain + b.strain for b in second] for a in first])
    near = table <= _CLEAR * table.min() + _FLOOR
    i, j = np.unravel_index(np.argmin(np.where(near, strain, np.inf) + 1e-3 * table), table.shape)
    return (_chosen(list(zip(first, table[:, j].tolist(), strict=True)), first[i]),
            _chosen(list(zip(second, table[i].tolist(), strict=True)), second[j]))  # fmt: skip


def _chosen(judged: list[tuple[WindReading, float]], best: WindReading | None = None) -> WindVerdict:
    """The reading to take of those with their misses."""
    readings = [replace(one, miss=min(miss, 9.0)) for one, miss in judged]
    smallest = min(one.miss for one in readings)
    near = [one for one in readings if one.miss <= _CLEAR * smallest + _FLOOR]
    taken = min(near, key=lambda one: (one.strain, one.miss))
    if best is not None:
        taken = next(one for one in readings if replace(one, miss=best.miss) == best)
    close = tuple(one for one in near if one is not taken and one.strain < taken.strain + _STRAINED)
    others = [one for one in readings if one is not taken]
    return WindVerdict(taken, min(others, key=lambda one: one.miss, default=None), close)


def _share(air: Array, other: Array) -> float:
    """How far a wind is from another, or from its mean, as a share of its size."""
    lost, size = np.sqrt(np.nanmean(np.sum((air - other) ** 2, axis=1))), np.nanmean(np.hypot(*air.T))
    return float(lost / max(float(size), 1e-6))


def _airs(
    found: Mapping[str, Signal], pair: tuple[str, str], readings: list[WindReading], motion: Motions
) -> list[Array]:
    """The wind over ground by each reading, some rows of it, north and east, shape (rows, 2)."""
    every = max(motion[0].size // _ROWS, 1)
    thin = motion[0][::every], motion[1][::every], motion[2][::every]
    speed, direction = found[pair[0]].values[::every], _signed(found[pair[1]])[::every]
    return [_air(one, speed, direction, thin) for one in readings]


def differences(best: WindReading, rival: WindReading) -> list[str]:
    """What another reading says otherwise, in words."""
    said = [
        ("apparent, from the bow" if rival.relative else "true, from north", best.relative != rival.relative),
        ("where it goes to" if rival.towards else "where it comes from", best.towards != rival.towards),
        ("positive to port" if rival.side < 0 else "positive to starboard", best.side != rival.side),
        (f"in {rival.unit}", best.unit != rival.unit),
    ]  # fmt: skip
    return [words for words, is_so in said if is_so]


def _signed(signal: Signal) -> Array:
    direction = signal.values
    if not signal.column.letters or len(signal.column.cells) != direction.size:
        return direction
    sides = [-1.0 if any(c in "PpLlBb" for c in cell if c.isalpha()) else 1.0 for cell in signal.column.cells]
    return direction * np.array(sides)


def _readings(found: Mapping[str, Signal], pair: tuple[str, str]) -> list[WindReading]:
    """Ways to read a wind; a unit that the log says is not in question, as wrong units make the wind steady too."""
    speed, direction = found[pair[0]], found[pair[1]]
    largest = float(np.nanmax(np.abs(direction.values), initial=0.0))
    units = [speed.unit] if speed.unit else [*SPEEDS]
    angles = [direction.unit] if direction.unit else ["deg"] if largest > 7.0 else ["rad"]
    towards = "towards" in frozenset[str]().union(*(one.words for one in direction.column.means[:1]))
    out: list[WindReading] = []
    for relative, to, side, unit, angle in product((True, False), (False, True), (1, -1), units, angles):
        if not relative and side < 0:
            continue
        strain = _KIND[relative].get(pair[1], 0.4 * relative) + 0.6 * (side < 0) + 1.0 * (to != towards)
        out.append(WindReading(relative, to, side, unit, angle, strain + 0.3 * units.index(unit)))
    return out


_KIND = {True: {"gamma_T": 2.0}, False: {"gamma_A": 2.0}}
"""How far apparent and true are from a name that says the other."""


def _air(one: WindReading, speed: Array, direction: Array, motion: Motions) -> Array:
    """Where the wind over ground comes from: its speed times north and east, shape (rows, 2)."""
    psi, u, v = motion
    size = speed * KNOWN[one.unit][1]
    gamma = one.side * KNOWN[one.angle][1] * direction + (np.pi if one.towards else 0.0)
    if not one.relative:
        return np.column_stack([size * np.cos(gamma), size * np.sin(gamma)])
    ahead, aside = size * np.cos(gamma) - u, size * np.sin(gamma) - v
    north, east = ahead * np.cos(psi) - aside * np.sin(psi), ahead * np.sin(psi) + aside * np.cos(psi)
    return np.column_stack([north, east])


def wind_entries(found: Mapping[str, Signal], pair: tuple[str, str], verdict: WindVerdict) -> Iterator[Entry]:
    """Entries of one wind, with the evidence and a doubt for each reading that fits about as well.

    Args:
        found: quantities of the log.
        pair: roles of its speed and its direction.
        verdict: how it is read.
    """
    best, rival, close = verdict.best, verdict.rival, verdict.close
    speed, direction = found[pair[0]], found[pair[1]]
    kind = "apparent, from the bow" if best.relative else "true, from north"
    way = "goes to" if best.towards else "comes from"
    evidence = f"{speed.column.said} and {direction.column.said}; {kind}, where it {way}"
    if rival is not None and not close:
        evidence += (f"; the true wind would change by {best.miss:.0%} of itself, and by {rival.miss:.0%} if "
                     f"{' and '.join(differences(best, rival))}")  # fmt: skip
    doubts = [
        f"it may also be {said[0]}; nothing in the log decides"
        for one in close
        if len(said := differences(best, one)) == 1
    ]
    unit = best.unit
    if not speed.unit and any(one.unit != unit for one in close):
        unit = ASK
        doubts.append("nothing shows the unit of its speed; write m/s or kn in place of ?")
    answer = Answer(evidence, tuple(dict.fromkeys(doubts)))
    file = {"file": quoted(speed.file)} if speed.file else {}
    if best.relative:
        keys = {"speed": quoted(speed.column.head), "direction": quoted(direction.column.head), "unit": quoted(unit),
                "direction_unit": quoted(best.angle)}  # fmt: skip
        keys |= {"sign": "-1"} if best.side < 0 else {}
        keys |= {"towards": "true"} if best.towards else {}
        if direction.column.letters:
            sides = (f"{one} = {-1 if one[0] in 'PpLlBb' else 1}" for one in direction.column.letters)
            keys["letters"] = f"{{ {', '.join(sides)} }}"
        yield Entry("apparent", keys | file, answer)
        return
    yield Entry("channels.U_T", {"column": quoted(speed.column.head), "unit": quoted(unit), **file}, answer)
    more = {"offset": "180.0" if best.angle == "deg" else f"{np.pi:.12g}"} if best.towards else {}
    keys = {"column": quoted(direction.column.head), "unit": quoted(best.angle), **more, **file}
    yield Entry("channels.gamma_T", keys)


def wind_pairs(found: Mapping[str, Signal]) -> list[tuple[str, str]]:
    """Speeds and directions of one wind each, of those that vary."""
    out: list[tuple[str, str]] = []
    for direction, speeds in _WINDS.items():
        speed = next((one for one in speeds if one in found and all(one != two[0] for two in out)), None)
        if speed and direction in found and (found[speed].column.varies or found[direction].column.varies):
            out.append((speed, direction))
    return out


_WINDS = {
    "gamma_A": ("U_A", "wind_speed"),
    "gamma_T": ("U_T", "wind_speed"),
    "wind_direction": ("wind_speed", "U_A", "U_T"),
}
