"""The slip after which a ship is as ships are: a sign, two numbers exchanged, a factor; tried on any family of models.

A hull whose N_r and N_v are exchanged is unusual in several figures at once, in an Abkowitz table as in a hull behind a
rudder or a Fossen matrix.  Of the slips that people make the one is named that brings all figures back among ships'.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from ...core.parameters import ParameterError, update, values
from ...core.values import dataclass, replace
from ...engine import SimulationError
from . import Finding, typical, whole
from . import thresholds as limit
from .probe import Probe

_FACTORS = {"a factor of ten too large": 0.1, "a tenth": 10.0, "in degrees, or times 57.3": math.radians(1.0),
            "divided by 57.3": math.degrees(1.0)}  # fmt: skip
_APART = ("wind", "waves", "propeller", "screw", "race", "thrusters")
"""Parts whose numbers are judged by other items, and have no pairs to be exchanged."""
_MEASURES = ("L_", "A_", "D_", "C_b", "U_", "n_")
"""Beginnings of lengths, areas, speeds, and particulars: positive, and in no exchange."""
_GAINED = 0.1
"""Strain that a slip may leave, of that before."""
_RARE, _AS_GOOD = math.log(20.0), math.log(2.0)
"""By so much the log of the probability rises, as of 20 ships one has a slip; within so little another is told."""
_SIGMAS = {True: limit.USUAL.high, False: 2.5}
"""Standard deviations from the middle of a range to its end: of a number against a regression, of a figure of ships."""
_DECADE, _FARTHEST = 10.0, 5.0

Places = Mapping[str, float]
"""Figures by name: 0 in the middle of the usual range of ships, -1 and 1 at its ends."""


@dataclass(frozen=True)
class _Slip:
    """Numbers of the model as they would be without a slip, and the slip in words."""

    words: str
    numbers: Mapping[str, float]


def named(p: Probe, found: Iterable[Finding]) -> list[Finding]:
    """The findings; the first that does not hold says also which slip makes all figures usual, where one does."""
    findings = list(found)
    told = [k for k, one in enumerate(findings) if not one.holds]
    slip = _likely(p) if told and p.searches else ""
    if slip:
        first = findings[told[0]]
        findings[told[0]] = replace(first, wrong=f"{first.wrong}; {slip}")
    return findings


def _likely(p: Probe) -> str:
    """The slip that leaves least, in words; empty where none leaves a tenth of what is unusual."""
    own = _places(p)
    odd = [name for name, z in own.items() if abs(z) > 1.0]
    if not odd:
        return ""
    left: dict[str, float] = {}
    for slip, after in _tried(p, own, odd):
        back = all(abs(after.get(name, math.inf)) <= 1.0 for name in odd)
        if back and _strain(after) <= _GAINED * _strain(own) and _improbable(own) - _improbable(after) > _RARE:
            left[slip.words] = _improbable(after)
    best = sorted(left, key=left.__getitem__)[:2]
    return ", or ".join(words for words in best if left[words] <= left[best[0]] + _AS_GOOD)


def _improbable(places: Places) -> float:
    """Minus the log of the density of normal figures, but for a constant."""
    return 0.5 * sum((_SIGMAS["." in name] * z) ** 2 for name, z in places.items())


def _strain(places: Places) -> float:
    return sum(max(0.0, abs(z) - 1.0) for z in places.values())


def _places(p: Probe) -> Places:
    """Of figures under way: drag across at rest lies where no law was made for, and by orders of magnitude."""
    figures = {what: _place(value, known.usual.low, known.usual.high)
               for what, value, _, known, _ in whole.named(p)
               if known is not limit.SIDEWAYS and math.isfinite(value)}  # fmt: skip
    return figures | {one.path: one.off(one.own) / limit.USUAL.high for one in typical.compared(p)}


def _place(value: float, low: float, high: float) -> float:
    """-1 at the low end and 1 at the high one; of ranges over decades by the logarithm, at most `_FARTHEST`."""
    if low > 0.0 and high > _DECADE * low:
        value, low, high = math.log(max(value, 1e-300)), math.log(low), math.log(high)
    return min(max((value - low) / (high - low) * 2.0 - 1.0, -_FARTHEST), _FARTHEST)


def _tried(p: Probe, own: Places, odd: list[str]) -> Iterator[tuple[_Slip, Places]]:
    """Slips and the figures after each; numbers whose sign moves nothing that is unusual are tried no further."""
    known = {path: float(value) for path, value in values(p.ship.model).items()
             if np.ndim(value) == 0 and value and path.partition(".")[0] not in _APART
             and "_" in _last(path) and not _last(path).startswith(_MEASURES)}  # fmt: skip
    at_work: list[str] = []
    for path, value in known.items():
        slip = _Slip(f"the sign of {_last(path)} looks wrong", {path: -value})
        after = _after(p, slip)
        if after is None or any(abs(after.get(name, math.inf) - own[name]) > 1e-6 for name in odd):
            at_work.append(path)
        if after is not None:
            yield slip, after
    scaled = (_Slip(f"{_last(path)} looks {words}", {path: by * known[path]})
              for path in at_work for words, by in _FACTORS.items())  # fmt: skip
    pairs = {tuple(sorted((path, other))) for path in at_work for other in known if _alike(path, other)}
    swapped = (_Slip(f"{_last(a)} and {_last(b)} look exchanged", {a: known[b], b: known[a]}) for a, b in sorted(pairs))
    for slip in (*scaled, *swapped):
        after = _after(p, slip)
        if after is not None:
            yield slip, after


def _last(path: str) -> str:
    return path.rpartition(".")[2]


def _alike(path: str, other: str) -> bool:
    """Whether two numbers of one part have names of one form, such as N_r and Y_v, N_vvr and Y_vvr, m_x and m_y."""
    (part, _, one), (its, _, two) = path.rpartition("."), other.rpartition(".")
    (letter, _, order), (other_letter, _, its_order) = one.partition("_"), two.partition("_")
    alike = len(letter) == len(other_letter) == 1 and len(order) == len(its_order)
    return path != other and part == its and alike


def _after(p: Probe, slip: _Slip) -> Places | None:
    """The figures without the slip; None where no such ship can be."""
    try:
        made = replace(p.ship, model=update(p.ship.model, slip.numbers))
        return _places(replace(p, ship=made))
    except (ParameterError, SimulationError, ArithmeticError, ValueError, np.linalg.LinAlgError):
        return None
