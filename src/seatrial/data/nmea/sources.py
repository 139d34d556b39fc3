"""Which instrument a quantity is taken from where several tell it: one source, and what the others said beside it.

The order of headings is that of their errors: a gyro, a compass of satellites, an inertial unit, a magnetic compass
whose variation is known, and last the heading that a speed log passes on.  Two sources are never interleaved: two gyros
that differ by 2 deg would be a ship that yaws at the rate of the log.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from ...core.constants import ARC_DEGREE
from ...core.values import dataclass
from .. import Array

GROUPS: Mapping[str, tuple[str, ...]] = MappingProxyType({
    "position": ("latitude", "longitude"), "track": ("x", "y"), "velocity over ground": ("U_G", "gamma_G"),
    "heading": ("psi",), "rate of turn": ("r",),
    "log through the water": ("u_log_water", "v_log_water", "v_stern_water"),
    "log over ground": ("u_log", "v_log", "v_stern"), "rudder": ("delta", "delta_port"),
    "rudder order": ("delta_cmd", "delta_port_cmd"), "apparent wind": ("U_A", "gamma_A"),
    "true wind": ("U_T", "gamma_T_bow"), "wind over ground": ("U_T_ground", "gamma_T_ground"), "depth": ("depth",),
    "roll": ("phi",), "pitch": ("theta",), "compass": ("psi_magnetic",), "variation": ("variation",),
})  # fmt: skip
"""Quantities that one source tells, with the names of their readings."""

GROUP_OF: Mapping[str, str] = MappingProxyType({name: group for group, names in GROUPS.items() for name in names})
CIRCLES = frozenset({"psi", "gamma_G", "gamma_A", "gamma_T_bow", "gamma_T_ground", "psi_magnetic"})
_SATELLITES = frozenset({"GP", "GN", "GL", "GA", "GB", "BD", "GQ"})
_INERTIAL = ("PASHR", "PSXN", "PSSN", "PTNL", "PSAT", "PRDID")
_HALF = 0.5
"""A source that is there for less of the log than this share of the longest one is taken for nothing but its gaps."""
_SILENT = 5.0
"""Median intervals without a reading after which a source has fallen silent."""

_COARSE = 1.8
"""A source with so many times fewer different values than another one of its rank is the coarser."""

_AGREES = MappingProxyType({"deg": 0.05, "m/s": 0.01, "rpm": 0.5})
"""Sources that differ by less agree: the last digit of most sentences."""

Series = tuple[Array, Array]
"""Times [s] and values of one quantity, in the order of time."""


def rank(group: str, source: str) -> int:
    """Place of a source in the documented order of its quantity; the least is taken."""
    plain = source.rpartition("/")[2]  # without what a TAG block calls it
    talker, kind = plain[:-3], plain[-3:]
    if group == "heading":
        if plain in _INERTIAL:
            return 2
        later = {"Imu": 1, "INS": 2, "HDG": 3, "HDM": 4, "VHW": 5, "Num": 6, "Hud": 7}
        return later.get(kind, 1 if talker in _SATELLITES else 0)
    order = {"position": ("RMC", "GNS", "GGA", "GLL"), "velocity over ground": ("RMC", "VTG"), "rudder": ("RSA", "XDR"),
             "depth": ("DPT", "DBT"), "log through the water": ("VBW", "VHW"), "true wind": ("MWV", "VWT"),
             "apparent wind": ("MWV", "VWR"), "track": ("Odo", "Pos"), "rate of turn": ("Odo", "Imu", "Twi"),
             "log over ground": ("Odo", "Twi")}.get(group, ())  # fmt: skip
    return order.index(kind) if kind in order else len(order)


@dataclass(frozen=True)
class Choice:
    """The source of a quantity.

    Attributes:
        group: the quantity.
        source: talker and kind.
        rate: readings a second.
        share: of the duration of the log in which it speaks.
        others: what is said of the sources that are left aside.
    """

    group: str
    source: str
    rate: float
    share: float
    others: tuple[str, ...] = ()

    def __str__(self) -> str:
        said = f"{self.source}, {self.rate:.3g} Hz, {100.0 * self.share:.0f} % of the time"
        return said if not self.others else f"{said}; {'; '.join(self.others)}"


def spoken(times: Array, span: float) -> float:
    """Share of a duration in which a source speaks: its gaps beyond `_SILENT` intervals are silence."""
    if len(times) < 2 or span <= 0.0:
        return 0.0
    steps = np.diff(times)
    long = steps[steps > _SILENT * float(np.median(steps))]
    return max(0.0, min(1.0, (float(times[-1] - times[0]) - float(long.sum())) / span))


def chosen(
    told: Mapping[str, Mapping[str, Series]], prefer: Mapping[str, str], span: float
) -> tuple[dict[str, Series], list[Choice]]:
    """One series a reading, and which source each quantity is from.

    Args:
        told: readings by source and name.
        prefer: source by quantity where the user has said it.
        span: duration of the log [s].
    """
    out: dict[str, Series] = {}
    choices: list[Choice] = []
    names = dict.fromkeys(name for one in told.values() for name in one)
    found = dict.fromkeys(GROUP_OF.get(name, name) for name in names)
    for group in (*(one for one in GROUPS if one in found), *(one for one in found if one not in GROUPS)):
        parts = GROUPS.get(group, (group,))
        having = {source: {name: one[name] for name in parts if name in one} for source, one in told.items()}
        having = {source: one for source, one in having.items() if one}
        lead = _leading(group, having, prefer.get(group), span, choices)
        first = next(iter(having[lead].values()))[0]
        others = list[str]()
        kept = having[lead]
        for source, one in having.items():
            if source == lead:
                continue
            kept, said = _beside(kept, one, group == "position" and source[:-3] == lead[:-3])
            others.append(f"{source} {said}")
        out |= kept
        steps = np.diff(first)
        rate = 1.0 / float(np.median(steps)) if len(steps) and float(np.median(steps)) > 0 else math.nan
        choices.append(Choice(group, lead, rate, spoken(first, span), tuple(others)))
    return out, choices


def _leading(
    group: str, having: Mapping[str, Mapping[str, Series]], wanted: str | None, span: float, before: list[Choice]
) -> str:  # fmt: skip
    """The source that is taken: the preferred, else the first in order of those that speak long enough."""
    if wanted is not None and wanted in having:
        return wanted
    size = {source: len(next(iter(one.values()))[0]) for source, one in having.items()}
    share = {source: spoken(next(iter(one.values()))[0], span) for source, one in having.items()}
    enough = [source for source in having if share[source] >= _HALF * max(share.values())]
    if group in ("position", "velocity over ground"):
        # what comes much more often is taken, and the velocity of the receiver whose position is taken
        place = next((one.source[:-3] for one in before if one.group == "position"), None)
        often = max(size[source] for source in enough)
        enough = [s for s in enough if s[:-3] == place] or [s for s in enough if size[s] >= 0.7 * often]
    fine = {source: len(np.unique(np.round(next(iter(having[source].values()))[1], 9))) for source in enough}
    coarse = {source: _COARSE * fine[source] < max(fine.values()) for source in enough}
    # of what is alike, that of the place: a program that estimates both has looked at the other one
    placing = {one.source for one in before if one.group in ("position", "track")}
    return min(enough, key=lambda one: (rank(group, one), coarse[one], -size[one], one not in placing, one))


def _beside(kept: Mapping[str, Series], other: Mapping[str, Series], same: bool) -> tuple[dict[str, Series], str]:
    """Readings with the silences of their source filled from another one, its offset taken off, and what is said.

    Args:
        same: whether the other one tells the fixes of the same receiver, so that any that is lost is taken from it.
    """
    out = dict(kept)
    said, filled = f"left aside{_metres(kept, other)}", ""
    for name in kept:
        if name not in other or name in ("x", "y"):
            continue  # metres from another zero, perhaps of turned axes, fill no gap
        (t, values), (times, more) = out[name], other[name]
        if len(t) < 2 or not len(times):
            continue
        apart, offset = _apart(name, t, values, times, more)
        if (name in ("psi", "u_log_water", "U_G", "delta") or name.startswith("rpm_")) and apart:
            said = f"left aside, {apart}"
        steps = np.diff(t)
        reach = _SILENT * float(np.median(steps))
        after = np.searchsorted(t, times)
        gap = np.concatenate([[math.inf], steps, [math.inf]])[after]
        ends = np.minimum(np.where(after > 0, times - t[np.maximum(after - 1, 0)], math.inf),
                          np.where(after < len(t), t[np.minimum(after, len(t) - 1)] - times, math.inf))  # fmt: skip
        fill = ((gap > reach) | same) & (ends > 0.5 * float(np.median(steps)))
        if fill.sum() < (1 if same else 2):
            continue
        t, values = np.concatenate([t, times[fill]]), np.concatenate([values, more[fill] - offset])
        order = np.argsort(t, kind="stable")
        out[name] = t[order], values[order]
        filled = f", fills {int(fill.sum())} readings where the first is silent"
    return out, said + filled


def _apart(name: str, t: Array, values: Array, times: Array, more: Array) -> tuple[str, float]:
    """What a source says more than another one, in the median, in words; and as a number of its unit."""
    inside = (times >= t[0]) & (times <= t[-1])
    if inside.sum() < 2:
        return "", 0.0
    steady = np.unwrap(values) if name in CIRCLES else values
    off = more[inside] - np.interp(times[inside], t, steady)
    if name in CIRCLES:
        off = np.mod(off + math.pi, 2.0 * math.pi) - math.pi
    middle = 0.0 if name in ("latitude", "longitude") else float(np.median(off))
    unit, factor = ("deg", math.degrees(1.0)) if name in CIRCLES or name == "delta" else (
        ("rpm", 1.0) if name.startswith("rpm_") else ("m/s", 1.0))  # fmt: skip
    if abs(factor * middle) < (_AGREES[unit]):
        return "agrees", middle
    return f"differs by {factor * middle:+.2g} {unit} in the median", middle


def _metres(kept: Mapping[str, Series], other: Mapping[str, Series]) -> str:
    """How far apart two receivers put the ship, beyond what rounding does; empty where they agree."""
    if not all(name in one for name in ("latitude", "longitude") for one in (kept, other)):
        return ""
    (t, north), east = kept["latitude"], kept["longitude"]  # one of the two may be missing at times
    (times, north_2), east_2 = other["latitude"], other["longitude"]
    off = np.hypot(north_2 - np.interp(times, t, north), (np.interp(times, *east_2) - np.interp(times, *east))
                   * math.cos(math.radians(float(north[0]))))  # fmt: skip
    metres = ARC_DEGREE * float(np.median(off))
    return f", {metres:.2g} m away in the median" if metres > 0.1 else ""
