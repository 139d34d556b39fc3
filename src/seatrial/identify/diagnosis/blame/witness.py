"""What the logs say of an instrument by themselves: track, heading, rates and speeds held against each other.

That the displacement of a position is the integral of the speeds, and a change of heading that of the rate of turn, is
true of any ship.  A fit whose model is wrong ascribes a part of its misfit to whichever instrument acts alike.  This
redundancy, the moment at which yaw follows the rudder, the angles at which that is held to both sides and straight
ahead, and the likeness of both sides of a hull know nothing of the model, and so judge that (analytical redundancy;
Chow and Willsky 1984).  What nothing else shows has no witness.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

from ....core.values import dataclass, replace
from ....data import Trial
from ....data.check.controls.rudder import Helm, rudder_lag
from ....data.check.relations import CAUSES, left_over
from ....data.check.suspects import Normal
from ....data.check.symmetry import sideways
from ....data.prepare.made import derived

_CAUSE_OF: Mapping[str, str] = MappingProxyType({
    "bias.psi": "heading_bias", "deviation.north": "deviation_north", "deviation.east": "deviation_east",
    "bias.u": "log_bias", "bias.v_m": "sway_bias", "bias.r": "gyro_bias", "scale.u": "log_scale",
    "scale.r": "gyro_scale", "delay.position": "lag_x", "delay.psi": "lag_psi", "delay.speed": "lag_u",
    "delay.r": "lag_r", "delay.receiver": "lag_gnss", "antenna.ahead": "lever_ahead",
    "antenna.starboard": "lever_aside",
})  # fmt: skip
"""Suspects of a fit and the cause in `data.check.relations` that is the same error."""
# Speeds through the water differ from the track by the current, which is no error.
_WATER = ("water_north", "water_east")
# A cause is shown from so many standard errors on, with what it must take of what exceeds the noise; at most so many.
_SURE, _TAKES, _ROUNDS = 8.0, 0.2, 3
# Causes whose squares differ by less than this part explain the same.
_TIE = 0.02
# A log that is so many standard errors from none confirms what a fit finds alike: it knows nothing of the model.
_AGREES = 5.0
# The log denies an error from so many standard errors on, where it allows less than half of it.
_DENIES, _HALF = 3.0, 0.5
# ... and standard errors in what an unknown hull leaves open of a lag of the rudder.
_OPEN = 3.0
# One rudder, or one of several.
_RUDDER = re.compile(r"delta(_\d+)?")
# Half the scatter of angles held to both sides that counts as none [rad].
_HELD = math.radians(0.25)
# Drift of a hull that is not quite alike on both sides [rad].
_UNEVEN = math.radians(0.3)


@dataclass(frozen=True)
class Witness:
    """What the logs say of one error of an instrument, SI units.

    Attributes:
        size, sigma: as they show it, beside the causes that are shown.
        shown: whether they show it beyond chance, and nothing explains the same better.
        leads: whether it is the one that explains most of those that explain the same.
    """

    size: float
    sigma: float
    shown: bool
    leads: bool = False

    def denies(self, size: float) -> bool:
        """Whether an error of this size contradicts the logs."""
        off = abs(size - self.size)
        return not self.shown and off > _DENIES * self.sigma and off > _HALF * abs(size)

    def confirms(self, size: float) -> bool:
        """Whether the logs have an error of this size too, though they do not show it beyond doubt by themselves."""
        return abs(self.size) > _AGREES * self.sigma and abs(size - self.size) < _DENIES * self.sigma


def witnesses(trials: Sequence[Trial], length: float | None = None) -> dict[str, Witness]:
    """By name of the suspect, as in `trajectory.suspects`, those that the logs of one ship tell of.

    Args:
        length: of the ship [m], for trials that do not say it.
    """
    told = [replace(_own(one), meta={"L_pp": length, **one.meta} if length else one.meta) for one in trials]
    return {**_of_sensors(told), **dict(_of_rudder(told)), **dict(_of_sides(told))}


def _own(trial: Trial) -> Trial:
    """The trial without channels that are made from others: those agree with their sources whatever is wrong."""
    made = derived(trial)
    return replace(trial, channels={name: values for name, values in trial.channels.items() if name not in made})


def _of_sensors(trials: Sequence[Trial]) -> dict[str, Witness]:
    now = left_over(trials)
    if now is None:
        return {}
    normal = Normal.of(now)
    beside = [name for name in _WATER if normal.fit([name])]
    shown: list[str] = []
    ties: set[str] = set()
    excess = _left(normal, beside) - 1.0
    for _ in range(_ROUNDS):
        found = _strongest(normal, [*beside, *shown], _TAKES * excess)
        if not found:
            break
        shown.append(found[0])
        ties |= {*found}
    out: dict[str, Witness] = {}
    for name, cause in _CAUSE_OF.items():
        others = [one for one in shown if one != cause and not (cause in ties and cause not in shown)]
        fitted = normal.fit([cause, *beside, *others])
        if fitted:
            out[name] = Witness(fitted[0][0], fitted[1][0], cause in ties, cause in shown)
    return out


def _left(normal: Normal, causes: Sequence[str]) -> float:
    """Mean square that some causes leave over, in noise."""
    fitted = normal.fit(causes) if causes else None
    return fitted[2] ** 2 if fitted else normal.square / max(normal.count, 1)


def _strongest(normal: Normal, others: Sequence[str], least: float) -> list[str]:
    """Causes that explain most of what some others leave over, the best first and those that explain the same.

    Args:
        least: of the mean square that a cause must take away.
    """
    before, found = _left(normal, others), list[tuple[float, str]]()
    for cause in CAUSES:
        fitted = None if cause in (*others, *_WATER) else normal.fit([cause, *others])
        if fitted and abs(fitted[0][0]) > _SURE * fitted[1][0] and before - fitted[2] ** 2 > max(least, 0.0):
            found.append((fitted[2] ** 2, cause))
    found.sort()
    return [cause for left, cause in found if left < (1.0 + _TIE) * found[0][0]]


def _of_rudder(trials: Sequence[Trial]) -> Iterator[tuple[str, Witness]]:
    """Of each rudder as if it were the only one; an error that all have alike is one of all, as their sum acts."""
    names = sorted({name for one in trials for name in one.channels if _RUDDER.fullmatch(name)})
    found = {name: dict(_of_one(name, trials)) for name in names}
    for kind in ("delay", "offset"):
        told = {name: one[kind] for name, one in found.items() if kind in one}
        common = _common(tuple(told.values())) if len(told) == len(names) > 1 else None
        yield from ((f"{kind}.{name}", replace(one, leads=one.leads and not common)) for name, one in told.items())
        if common:
            yield f"{kind}.delta", common


def _of_one(name: str, trials: Sequence[Trial]) -> Iterator[tuple[str, Witness]]:
    some = [one.having(delta=one[name]) for one in trials if {name, "r", "u"} <= set(one.channels)]
    found = rudder_lag(some) if some else None
    if found:
        yield "delay", Witness(found.size, math.hypot(found.error, found.unsure / _OPEN), found.told, found.told)
    offset = Helm.of(some).offset if some else None
    if offset is not None:
        yield "offset", Witness(offset, _HELD, shown=True, leads=True)


def _common(some: Sequence[Witness]) -> Witness | None:
    """The error that all have; None where they differ, or some show it and some do not."""
    sizes, sigma = [one.size for one in some], max(one.sigma for one in some)
    if max(sizes) - min(sizes) > 2.0 * math.sqrt(2.0) * sigma or len({one.shown for one in some}) > 1:
        return None
    return replace(some[0], size=math.fsum(sizes) / len(sizes), sigma=sigma)


def _of_sides(trials: Sequence[Trial]) -> Iterator[tuple[str, Witness]]:
    """A hull that is alike on both sides drifts to neither; a propeller and trim leave some tenths of a degree open."""
    found = sideways(trials)
    if found:
        yield "bias.psi_speed", Witness(found.angle, math.hypot(found.error, _UNEVEN), found.told, found.told)
