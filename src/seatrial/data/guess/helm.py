"""Sign and unit of rudders, unit of revolutions: what the ship answers to them.

A rudder is positive where the bow goes to starboard: in `dr/dt = a r + b delta + c` the sign of b, which also a
helmsman who steers against the ship does not turn, since the rudder of one moment moves the ship of the next.
Revolutions are per second or per minute by the advance of the propeller in one, a few hundredths of a ship's length.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .. import Array
from ..units import KNOWN
from .answers import ASK, Answer, quoted
from .cells import MIDSHIPS
from .roles import STRANGE, Signal

_SURE = 6.0
_ROWS = 4000
_MOVED = 0.2
"""A rudder that moves by less than this part of what it is held at tells nothing: loss of speed moves the rate more."""

_TURNED = 0.5
_WELL_OVER, _FAR = 0.12, 1.0
"""Rudder beyond the loop of a ship that is unstable on course [rad], and how far it turns by it [rad]."""

_HARD_OVER = math.radians(46.0)
"""Rudder angle that few rudders reach, of those with a flap [rad]."""

_BEYOND = 1e100
"""No rate or angle in any unit."""

_PITCH = 0.025
"""Advance of a ship in one turn of its propeller, in lengths; 0.008 to 0.08 of ships and models."""


def rudder_sense(t: Array, r: Array, delta: Array) -> tuple[float, float]:
    """Sign of the answer of the rate of turn to a rudder, and how sure it is, in standard errors."""
    best = (0.0, 0.0)
    step = float(np.nanmedian(np.diff(t)))
    for lag in (0.5, 2.0, 8.0, 30.0):
        far = max(round(lag / step), 1)
        every = max(far // 4, 1)
        before = np.arange(0, t.size - far, every)[:_ROWS]
        if before.size < 30:
            continue
        smooth = _mean(r, max(far // 2, 1))
        change = smooth[before + far] - smooth[before]
        matrix = np.column_stack([_mean(delta, max(far // 2, 1))[before], smooth[before], np.ones(before.size)])
        # squares of what no ship does are infinite, of which LAPACK finds no singular values, and no end
        good = (np.abs(change) < _BEYOND) & (np.abs(matrix) < _BEYOND).all(axis=1)
        if good.sum() < 30 or np.ptp(change[good]) == 0.0:
            continue
        moved, held = float(np.ptp(matrix[good, 0])), abs(float(np.median(matrix[good, 0])))
        if moved < max(_MOVED * held, 1e-9):
            continue
        size, *_ = np.linalg.lstsq(matrix[good], change[good], rcond=None)
        left = change[good] - matrix[good] @ size
        spread = float(left @ left) / max(good.sum() - 3, 1)
        back = np.linalg.pinv(matrix[good].T @ matrix[good])
        # windows overlap by three quarters
        error = math.sqrt(max(spread * back[0, 0] * 4.0, 1e-30))
        share = 1.0 - float(left @ left) / float(np.sum((change[good] - change[good].mean()) ** 2))
        sure = abs(size[0]) / error if share > 0.1 else 0.0
        if sure > best[1]:
            best = float(np.sign(size[0])), min(sure, 99.0)
    return best


def _mean(values: Array, count: int) -> Array:
    """Mean over some rows around each; NaN where there are not so many, as at the ends."""
    out = np.full(values.size, np.nan)
    if values.size >= count:
        out[(count - 1) // 2 : values.size - count // 2] = np.convolve(values, np.ones(count) / count, "valid")
    return out


_SERVO = 90.0
"""Degrees of a servo in the middle of its travel."""


def neutral_of(order: Signal, rudder: Signal | None) -> float:
    """What an order or a rudder reads where the rudder is midships, in its unit; 0 where it is signed.

    A servo counts from one end of its travel, so that midships is 90, or what its linkage makes of it.  Beside a
    measured rudder it is the middle of what the two differ by; alone, a value of 90 that the others lie on both sides
    of, never as far as through zero.
    """
    values = order.values
    good = values[np.isfinite(values)]
    if not good.size or order.column.letters or good.min() < 0.0 or good.max() < 4.0:
        return 0.0
    if rudder is not None and rudder is not order:
        apart = (values - rudder.values)[np.isfinite(values + rudder.values)]
        opposed = (values + rudder.values)[np.isfinite(values + rudder.values)]
        if not apart.size or np.nanmin(rudder.values) >= 0.0:
            return 0.0
        closer = min((apart, opposed), key=lambda one: float(np.subtract(*np.percentile(one, [75, 25]))))
        middle = float(np.round(np.median(closer)))
        return middle if middle > float(np.nanmax(np.abs(rudder.values))) * 0.5 else 0.0
    usual = float(np.median(good))
    both = good.min() < _SERVO - 1.0 and good.max() > _SERVO + 1.0
    return _SERVO if both and abs(usual - _SERVO) < 20.0 and good.max() < 2.0 * _SERVO else 0.0


def from_neutral(signal: Signal, neutral: float, keys: dict[str, str], answer: Answer) -> tuple[dict[str, str], Answer]:
    """Keys and answer of a rudder that is read from its neutral."""
    turned = keys.get("sign") == "-1"
    other = f"; with sign = {1 if turned else -1} offset is {-neutral if turned else neutral:g}"
    doubt = f"its values lie about {neutral:g}, which is taken as midships{other}"
    keys = {**keys, "offset": f"{neutral if turned else -neutral:g}"}
    return keys, Answer(f"{answer.evidence}; midships at {neutral:g} {signal.unit or 'deg'}", (*answer.doubts, doubt))


def read_rudder(signal: Signal, t: Array, r: Array | None, logged: set[str]) -> tuple[dict[str, str], Answer]:
    """Keys of a rudder's channel beside its column, with the evidence.

    Args:
        signal: the rudder or its order.
        t: time [s].
        r: rate of turn to starboard [rad/s], None without one.
        logged: units of the other angles of the log.
    """
    largest = float(np.nanmax(np.abs(signal.values), initial=0.0))
    unit, told, doubts = _unit(signal, largest, logged)
    keys = {"unit": quoted(unit)}
    sense, sure = rudder_sense(t, r, _lettered(signal)) if r is not None else (0.0, 0.0)
    if signal.column.letters:
        more, said, doubt = _sides(signal, sense, sure)
    elif sure <= _SURE and r is not None and (held := _held(t, r, signal.values, unit)):
        more, doubt = ({"sign": "-1"} if held < 0 else {}), ""
        said = f"held, it turns the bow to {'starboard' if held > 0 else 'port'}"
    elif sure > _SURE:
        side = "starboard" if sense > 0 else "port"
        more, doubt = ({"sign": "-1"} if sense < 0 else {}), ""
        said = f"the bow goes to {side} with it ({sure:.0f} standard errors)"
    else:
        more, said = {"sign": quoted(ASK)}, ""
        doubt = ("nothing shows to which side it turns the ship; write sign = 1 if positive turns the bow to "
                 "starboard, and -1 if to port")  # fmt: skip
    evidence = f"{signal.column.said}, {told}" + (f"; {said}" if said else "")
    return keys | more, Answer(evidence, (*doubts, *([doubt] if doubt else [])))


def _held(t: Array, r: Array, delta: Array, unit: str) -> float:
    """Sign of the turn by a rudder that is held well over: a ship turns to that side in the end; 0 where none shows."""
    size = KNOWN[unit][1] if unit in KNOWN else 0.0
    largest = float(np.nanmax(np.abs(delta), initial=0.0))
    rows = np.flatnonzero(np.isfinite(delta + r) & (np.abs(delta) > 0.9 * largest))
    if largest * size < _WELL_OVER or rows.size < 30:
        return 0.0
    turned = np.sign(delta[rows]) * r[rows] * np.gradient(t)[rows]
    total = float(turned.sum())
    return float(np.sign(total)) if abs(total) > max(_FAR, 0.9 * float(np.abs(turned).sum())) else 0.0


def _unit(signal: Signal, largest: float, logged: set[str]) -> tuple[str, str, list[str]]:
    """Unit of a rudder's angle, why, and doubts."""
    if signal.column.unit and not signal.unit:
        doubt = (f"the {signal.column.where} says {signal.column.unit}, which is no unit of an angle: write one, and "
                 "scale = the angle of 1 in it")  # fmt: skip
        return ASK, f"values up to {largest:.3g}", [doubt]
    unit, told = _angle(signal, largest, logged)
    if not signal.unit and unit in KNOWN and largest * KNOWN[unit][1] > _HARD_OVER:
        doubt = f"values up to {largest:.3g} {unit} are more than rudders take; is it a share of hard over, in percent?"
        return unit, told, [doubt]
    if unit == ASK and 0.15 < largest < 0.8 and not logged:
        return "rad", told, [f"values up to {largest:.3g} are taken as radians; write deg if they are degrees"]
    if unit == ASK:
        doubt = f"nothing shows whether it is in deg or rad (up to {largest:.3g}); write the unit in place of ?"
        return unit, told, [doubt]
    if signal.unit and signal.unit != unit:
        return unit, told, [f"the {signal.column.where} says {signal.unit}, and its values go up to {largest:.3g}"]
    return unit, told, []


def _sides(signal: Signal, sense: float, sure: float) -> tuple[dict[str, str], str, str]:
    """Letters of a rudder as signs, what they are, and the doubt about it."""
    letters = signal.column.letters
    turned = sense < 0 and sure > _SURE
    signs = {letter: (-1 if letter.lower() in _PORT else 1) * (-1 if turned else 1) * (letter.lower() not in MIDSHIPS)
             for letter in letters}  # fmt: skip
    keys = {"letters": f"{{ {', '.join(f'{letter} = {sign}' for letter, sign in signs.items())} }}"}
    said = f"letters {', '.join(letters)} are port and starboard"
    if turned:
        doubt = (
            "by its letters the ship would turn away from its rudder; they are those of the blade's edge, turned here"
        )
        return keys, said, doubt
    doubt = "the ship turns too little to show that the letters are sides of the turn"
    return keys, said, doubt if sure < _SURE else ""


_PORT = ("p", "ps", "l", "bb", "bab", "port", "b", "hid", "backbord", "babord", "bakbord")


def _lettered(signal: Signal) -> Array:
    """Values signed by their letters, to starboard positive."""
    if not signal.column.letters:
        return signal.values
    sides = [-1.0 if _side(cell) in _PORT else 1.0 for cell in signal.column.cells]
    return signal.values * np.array(sides) if len(sides) == signal.values.size else signal.values


def _side(cell: str) -> str:
    return "".join(c for c in cell if c.isalpha()).lower()


def _angle(signal: Signal, largest: float, logged: set[str]) -> tuple[str, str]:
    """Unit of a rudder's angle, and why."""
    if signal.unit == "rad" and largest > 4.0:
        return "deg", f"values up to {largest:.3g} are degrees"
    if signal.unit:
        return signal.unit, f"unit by its {signal.column.where}"
    if largest > 180.0:
        return ASK, f"values up to {largest:.3g}"
    if largest > 1.6:
        return "deg", f"values up to {largest:.3g} are degrees"
    if logged == {"rad"}:
        return "rad", f"values up to {largest:.3g}, in radians as the heading"
    return ASK, f"values up to {largest:.3g}"


def read_revolutions(
    signal: Signal, speed: Array | None, r: Array | None, turned: float
) -> tuple[dict[str, str], Answer]:  # fmt: skip
    """Unit of revolutions by the advance in one of them, where no header says it.

    Args:
        signal: the revolutions.
        speed, r: size of the speed [m/s] and rate of turn [rad/s], None where they are unknown.
        turned: by how much the heading changed in all [rad]; the length of the ship shows in turns only.
    """
    values = np.abs(signal.values)
    largest = float(np.nanmax(values, initial=0.0))
    if signal.unit:
        return {"unit": f'"{signal.unit}"'}, Answer(f"{signal.column.said}, unit by its {signal.column.where}")
    evidence = f"{signal.column.said}, values up to {largest:.3g}"
    if signal.column.unit:
        doubt = f"the {signal.column.where} says {signal.column.unit}, which is no unit of revolutions; write theirs"
        return {"unit": f'"{ASK}"'}, Answer(evidence, (doubt,))
    running = np.isfinite(values) & (values > 0.3 * largest)
    if speed is None or running.sum() < 10 or r is None or turned < _TURNED:
        unit = "rpm" if largest > 60.0 else ASK
        doubt = (
            "nothing shows whether it is in rpm or 1/s; write it"
            if unit == ASK
            else f"up to {largest:.3g} is taken as rpm"
        )
        return {"unit": f'"{unit}"'}, Answer(evidence, (doubt,))
    # a ship turns at most by about half a radian while it goes its length
    length = 0.5 * float(np.nanquantile(np.abs(speed), 0.9)) / max(float(np.nanquantile(np.abs(r), 0.98)), 1e-6)
    advance = {unit: float(np.nanmedian(np.abs(speed)[running] / (values[running] * size))) / length
               for unit, size in (("1/s", 1.0), ("rpm", 1.0 / 60.0))}  # fmt: skip
    far = {unit: abs(math.log(max(value, 1e-9) / _PITCH)) for unit, value in advance.items()}
    unit = min(far, key=far.__getitem__)
    other = "rpm" if unit == "1/s" else "1/s"
    evidence += (f"; the ship goes about {advance[unit]:.2g} lengths in a turn of the propeller, if in {other} "
                 f"{advance[other]:.2g}")  # fmt: skip
    if far[other] - far[unit] > 1.5 or (unit == "rpm" and largest > 60.0):
        return {"unit": f'"{unit}"'}, Answer(evidence)
    return {"unit": f'"{unit}"'}, Answer(
        evidence, (f"{unit} fits a little better than {other}; write {other} if it is that",)
    )


def with_rudder(found: Mapping[str, Signal], t: Array, r: Array | None) -> dict[str, Signal]:
    """The quantities of a log, with the column of no known name that the bow follows most surely as its rudder.

    The rate of turn follows its own change too: a column that is a rate or a heading by its size turns nothing.
    """
    strange = {role: one for role, one in found.items() if role.startswith(STRANGE)}
    rest = {role: one for role, one in found.items() if role not in strange}
    if r is None or not strange:
        return rest
    sure = {role: rudder_sense(t, r, one.values)[1] for role, one in strange.items()
            if float(np.ptp(one.values)) > _STEERS and not _rate_like(r, one.values)}  # fmt: skip
    best = max(sure, key=lambda role: sure[role], default="")
    if not best or sure[best] <= _STRANGELY:
        return rest
    return {**rest, "delta": replace(strange[best], role="delta")}


_STEERS, _STRANGELY, _LIKE = 4.0, 8.0, 0.95
"""Range of a rudder [deg], standard errors by which a column of no name is one, and correlation of a rate."""


def _rate_like(r: Array, values: Array) -> bool:
    """Whether a column changes as the rate does, over a fiftieth of the trial: it is that rate, the other one noisy."""
    over = max(r.size // 50, 5)
    smooth, own = ((one := _mean(each, over))[over:] - one[:-over] for each in (r, values))
    good = np.isfinite(smooth) & np.isfinite(own)
    return bool(abs(np.corrcoef(smooth[good], own[good])[0, 1]) > _LIKE)
