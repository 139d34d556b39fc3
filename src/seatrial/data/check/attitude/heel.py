"""Faults of the heel: degrees, a sign turned, an offset; against the roll rate and against the turning.

In a turn a displacement ship heels outwards, tan(phi) = -(h/GM) u r/g with the lever h of the side force about the
centre of gravity; h/GM is below some 15 for the tenderest published ship (container_son_nomoto, GM 0.3 m).
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ....core.constants import GRAVITY
from ....core.values import dataclass
from ... import Trial
from ...prepare import Remedy, Step
from ..sensors import Fault, degrees, stretches

# Heel of no ship that still manoeuvres [rad], and h/GM of none.
_CAPSIZED, _TENDER = 0.9, 25.0
# Correlation that is no accident, and heel by the turning that shows a sign [rad].
_ALIKE, _SHOWN = 0.4, math.radians(0.05)
# Time over which slopes are compared with the roll rate [s]; ratios that are degrees, whichever of them they are.
_SPAN, _DEGREES = 2.0, (20.0, 170.0)
# Offset that matters [rad]; part of the greatest rate of turn below which a course is straight, where it lasts [s];
# least part of the rows that turn to either side.
_LIST, _STRAIGHT, _LASTING, _ENOUGH = math.radians(0.5), 0.1, 20.0, 0.1
_FEWEST = 20


def heel_faults(trial: Trial) -> Iterator[Fault]:
    """Unit, sign and offset of the heel and of the roll rate; nothing for a trial without heel."""
    if "phi" not in trial:
        return
    phi = trial["phi"]
    known = np.isfinite(phi)
    if known.sum() < _FEWEST or not np.ptp(phi[known]) > 0:
        return
    turn = _Turn.of(trial)
    rolls = _against_rate(trial) if "p" in trial else None
    largest = float(np.quantile(np.abs(phi[known]), 0.99))
    if largest > _CAPSIZED or (turn and turn.shown and abs(turn.lever) > _TENDER) or _within(rolls, 1.0):
        grounds = f"up to {largest:.3g} rad" + (f", h/GM would be {abs(turn.lever):.3g}" if turn and turn.shown else "")
        names = ("phi", "p") if rolls and 0.3 < abs(rolls) < 3.0 else ("phi",)
        yield Fault("error", ", ".join(names), "heel is in degrees", grounds,
                    Remedy('unit = "deg" in the mapping', (degrees(*names),)), "unit", "unit")  # fmt: skip
        return
    if _within(rolls, -1.0):
        yield Fault("error", "p", "roll rate is in degrees", f"the heel changes by {rolls:.3g} of it",
                    Remedy('unit = "deg/s" in the mapping', (degrees("p"),)), "unit", "unit")  # fmt: skip
    yield from _signs(turn, rolls)
    yield from _offset(trial)


def _signs(turn: _Turn | None, rolls: float | None) -> Iterator[Fault]:
    inward = turn is not None and turn.shown and turn.lever > 0.0
    opposed = rolls is not None and rolls < 0.0
    if turn is not None and inward:
        names = ("phi",) if opposed or rolls is None else ("phi", "p")
        yield Fault(
            "warning", ", ".join(names), "heels into the turn",
            f"correlation of phi with u r is {turn.alike:.2f}; here phi > 0 is starboard down, and ships heel outwards",
            Remedy("if it is positive to port (a planing craft does heel inwards)", (_turned(*names),)), "sign", "sign",
        )  # fmt: skip
    elif opposed:
        yield Fault("error", "p", "roll rate against the heel", f"the heel changes by {rolls:.3g} of it",
                    Remedy(steps=(_turned("p"),)), "sign", "sign")  # fmt: skip


def _turned(*names: str) -> Step:
    return Step(do="multiply", channels=names, amount=(-1.0,))


def _within(ratio: float | None, power: float) -> bool:
    """Whether a ratio, or one over it, is that of degrees to radians."""
    return ratio is not None and _DEGREES[0] < abs(ratio) ** power < _DEGREES[1]


@dataclass(frozen=True)
class _Turn:
    """Heel by the turning.

    Attributes:
        lever: tan(phi) g over u r, so -h/GM of a ship that heels outwards.
        alike: correlation of phi with u r.
        shown: whether the heel shows it.
    """

    lever: float
    alike: float
    shown: bool

    @staticmethod
    def of(trial: Trial) -> _Turn | None:
        """None for a log without turning or speed."""
        if "r" not in trial or "u" not in trial:
            return None
        phi, push = trial["phi"], trial["u"] * trial["r"] / GRAVITY
        known = np.isfinite(phi) & np.isfinite(push)
        phi, push = phi[known] - np.mean(phi[known]), push[known] - np.mean(push[known])
        if known.sum() < _FEWEST or not (np.std(push) > 0 and np.std(phi) > 0):
            return None
        alike = float(np.corrcoef(phi, push)[0, 1])
        lever = float((phi @ push) / (push @ push))
        return _Turn(lever, alike, abs(alike) > _ALIKE and abs(lever) * float(np.std(push)) > _SHOWN)


def _against_rate(trial: Trial) -> float | None:
    """Change of the heel over that by the roll rate; None where they are not alike."""
    phi, p, h = trial["phi"], trial["p"], max(round(_SPAN / trial.dt), 1)
    steps = np.diff(trial.t)
    way = np.concatenate([[0.0], np.cumsum(0.5 * (p[1:] + p[:-1]) * steps)])
    change, by_rate = phi[h:] - phi[:-h], way[h:] - way[:-h]
    known = np.isfinite(change) & np.isfinite(by_rate)
    if known.sum() < _FEWEST:
        return None
    change, by_rate = change[known], by_rate[known]
    size = math.sqrt(float(change @ change) * float(by_rate @ by_rate))
    alike = float(change @ by_rate) / size if size > 0 else 0.0
    return float(change @ by_rate) / float(by_rate @ by_rate) if abs(alike) > _ALIKE else None


def _offset(trial: Trial) -> Iterator[Fault]:
    """Heel on a straight course, or midway between turns to either side: a list of the ship, or the sensor's zero."""
    if "r" not in trial:
        return
    known = np.isfinite(trial["phi"]) & np.isfinite(trial["r"])
    upright = _straight(trial) & known
    if upright.sum() >= _FEWEST:
        heel, where, least = float(np.median(trial["phi"][upright])), "on a straight course", _LIST
    else:
        most = 0.5 * np.nanmax(np.abs(trial["r"]), initial=0.0)
        sides = [trial["phi"][known & (way * trial["r"] > most)] for way in (1.0, -1.0)]
        if min(side.size for side in sides) < max(_FEWEST, _ENOUGH * len(trial)):
            return
        heel = 0.5 * sum(float(np.median(side)) for side in sides)
        where, least = "midway between turns to either side", 2.0 * _LIST
    if abs(heel) > least:
        way = "starboard" if heel > 0 else "port"
        yield Fault(
            "warning", "phi", f"heel {where}", f"{abs(math.degrees(heel)):.2g} deg to {way}",
            Remedy("no action where the ship lists", (Step(do="add", channels=("phi",), amount=(-heel,), unit="rad"),)),
            "quality", "heel_offset",
        )  # fmt: skip


def _straight(trial: Trial) -> NDArray[np.bool_]:
    """Rows of stretches that go straight ahead for a ship length or more; a zigzag swings through the middle faster."""
    r, length = trial["r"], trial.meta.get("L_pp")
    U = float(np.nanmedian(np.abs(trial["u"]))) if "u" in trial else 0.0
    lasting = float(length) / U if isinstance(length, int | float) and U > 0 else _LASTING
    slow = np.abs(r) < _STRAIGHT * np.nanmax(np.abs(r), initial=0.0)
    out = np.zeros(len(trial), dtype=np.bool_)
    for first, last in stretches(trial.t, slow):
        if last - first >= lasting:
            out |= (trial.t >= first) & (trial.t <= last)
    return out
