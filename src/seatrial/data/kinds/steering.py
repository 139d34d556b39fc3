"""Kinds told by the rudder and the heading: zigzags, spirals, turns and what follows them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ...core.ranks import median, quantile
from .. import Array
from .kind import Kind
from .signals import DEGREE, Hold, Signals, both_ways

# On the spot: turning from this share of the greatest rate on, about a middle so many lengths away at most; so much of
# the turning, and so much of the thrust in it opposed.
_TURNS, _SPOT, _SPINS, _DRIVEN = 0.3, 0.4, 0.6, 0.5
# A rudder below this, or below this share of the greatest one held, is midships.
_MIDSHIPS, _SHARE = 1.5 * DEGREE, 0.2
# Angles alike, and headings alike, of a zigzag: share and least.
_ALIKE, _LEAST = 0.2, 1.5 * DEGREE
# From more legs on one at either end may not belong to it.
_LEGS = 3
# A turn: from so much heading on it is one, and from so much on a circle; less than the first is an initial turn.
_SHORT, _TURN, _CIRCLE = 60.0 * DEGREE, 90.0 * DEGREE, 360.0 * DEGREE
# Steady turns of a spiral, and how often it changes from growing to falling rudder.
_LEVELS, _WAYS = 7, 3
_STEADY = 15.0 * DEGREE
# Heading of reversal, at most; of a single reversal half of it: a Williamson turn has 60 deg.
_WIDEST = 90.0 * DEGREE
# Part of the trial that a kind should fill.
_MOST, _PART = 0.5, 0.25


def spinning(seen: Signals) -> Kind | None:
    """Turned about its own middle by two thrusts that are opposed."""
    if seen.pair is None or seen.U is None or not math.isfinite(seen.L_pp):
        return None
    port, starboard = seen.pair
    rate = np.abs(seen.r)
    turns = rate > _TURNS * quantile(rate, 0.98)
    lever = _SPOT * seen.L_pp
    spot = turns & (lever * rate > seen.U)
    thrusts = np.abs(port - starboard) > 0.2 * quantile(np.abs([port, starboard]), 0.99)
    opposed = thrusts & (port * starboard < 0)
    dt = np.gradient(seen.t)
    swept = float(np.sum((rate * dt)[spot]))
    driven = (opposed & spot).sum() > _DRIVEN * (thrusts & spot).sum()
    if not driven or swept < _TURN or swept < _SPINS * float(np.sum((rate * dt)[turns])):
        return None
    net = float(np.sum((seen.r * dt)[spot]))
    side = {"side": math.copysign(1.0, net)} if abs(net) > 0.6 * swept else {}
    return Kind("spinning", side, (
        f"{swept / DEGREE:.0f} deg turned while the track has a radius of less than {_SPOT:g} L",
        "one thrust ahead and one astern",
    )).doubting(
        f"it makes way besides, {seen.top:.2g} m/s" if seen.top > lever * float(np.max(rate)) else "",
    )  # fmt: skip


def zigzag(seen: Signals) -> Kind | None:
    """The rudder reversed between two angles, each time at about the same heading to either side."""
    if seen.delta is None:
        return _weaving(seen)
    run = _alternating(seen, seen.holds)
    # the way back to a course, or onto one, may be a leg alike in rudder, and ends at another heading
    some = (run, run[:-1], run[1:]) if len(run) > _LEGS else (run,) if len(run) > 1 else ()
    return next((found for legs in some if (found := _zigzag(seen, legs)) is not None), None)


def _zigzag(seen: Signals, run: Sequence[Hold]) -> Kind | None:
    """The zigzag of these legs, if they are one."""
    at = np.array([seen.psi[one.last] for one in run])
    sides = np.sign([one.level for one in run])
    ends = at[:-1]  # the run may end within a leg
    first = float(seen.psi[run[0].first])
    lasting = [float(np.mean(ends[sides[:-1] == side])) for side in (1.0, -1.0) if (sides[:-1] == side).any()]
    middle = 0.5 * sum(lasting) if len(lasting) == 2 else first
    swing = sides[: ends.size] * (ends - middle)
    heading, spread = float(np.mean(swing)), float(np.max(swing) - np.min(swing))
    share = float(seen.t[run[-1].last] - seen.t[run[0].first]) / seen.duration
    lean, most = float(middle - first), _WIDEST if len(run) > 2 else 0.5 * _WIDEST
    if not 0.5 * DEGREE < heading < most or spread > max(2.0 * _LEAST, 2.0 * _ALIKE * heading):
        return None
    if share < (_PART if len(run) > 2 else _MOST) or abs(lean) > max(20.0 * DEGREE, 1.5 * heading):
        return None
    rudder = median(np.abs([one.level for one in run]))
    told = ", ".join(f"{angle / DEGREE:.1f}" for angle in (ends - middle))
    return Kind(
        "zigzag", {"rudder": rudder, "heading": _round(heading), "side": float(sides[0])},
        (f"{seen.helm(rudder)} to either side, {len(run)} legs", f"reversed at headings of {told} deg "
         "about their middle"),
    ).doubting(
        "one reversal only" if len(run) < 3 else "",
        f"headings at reversal differ by {spread / DEGREE:.1f} deg" if spread > max(_LEAST, _ALIKE * heading) else "",
        f"it fills {100 * share:.0f} % of the trial" if share < _MOST else "",
        f"the middle lies {lean / DEGREE:.0f} deg from the first heading"
        if abs(lean) > max(5.0 * DEGREE, 0.75 * heading) else "",
    )  # fmt: skip


def _weaving(seen: Signals) -> Kind | None:
    """The same without a rudder on record: a heading that swings evenly."""
    swing = seen.psi - median(seen.psi)
    peaks = _peaks(swing)
    if len(peaks) < 4 or np.ptp(seen.psi) > 120.0 * DEGREE:
        return None
    height = np.abs(swing[peaks])
    if np.std(height) > 0.15 * np.mean(height) or np.mean(height) < 2.0 * DEGREE:
        return None
    return Kind("zigzag", {"side": float(np.sign(swing[peaks[0]]))},
                (f"the heading swings {len(peaks)} times by {np.mean(height) / DEGREE:.0f} deg to either side",),
                ("rudder and heading of reversal cannot be told",))  # fmt: skip


def _peaks(swing: Array) -> list[int]:
    """Rows of the extremes between changes of sign, without the first and last part."""
    sign = np.sign(swing)
    cuts = np.flatnonzero(np.diff(sign) != 0) + 1
    return [a + int(np.argmax(np.abs(swing[a:b]))) for a, b in pairwise(cuts.tolist())]


def _alternating(seen: Signals, holds: Sequence[Hold]) -> list[Hold]:
    """The longest run of held angles that are alike in size and of alternating sign, the ship turning with each."""
    best: list[Hold] = []
    run: list[Hold] = []
    for one in (one for one in holds if abs(one.level) > _MIDSHIPS):
        opposite = bool(run) and one.level * run[-1].level < 0.0
        if run and opposite and _alike([*run, one]) and _quick(seen, run[-1], one):
            run.append(one)
        else:
            run = [run[-1], one] if opposite and _alike([run[-1], one]) and _quick(seen, run[-1], one) else [one]
        if len(run) > len(best):
            best = list(run)
    return best


def _alike(run: Sequence[Hold]) -> bool:
    sizes = np.abs([one.level for one in run])
    return float(np.ptp(sizes)) <= max(_LEAST, _ALIKE * median(sizes))


def _quick(seen: Signals, before: Hold, after: Hold) -> bool:
    """Whether the rudder goes over at once, rather than resting in between."""
    over = float(seen.t[after.first] - seen.t[before.last])
    return over < max(2.0 * seen.clock, 0.5 * seen.lasts(before))


def spiral(seen: Signals) -> Kind | None:
    """Steady turns at one angle after another; or, where the rudder hunts, at one rate of turn after another."""
    if seen.delta is None:
        return None
    for values, what, unit in ((seen.delta, "rudder angles", DEGREE), (seen.r, "rates of turn", DEGREE)):
        reach = quantile(np.abs(values), 0.98)
        steps = seen.fine_holds if values is seen.delta else seen.held(values, 0.03 * reach, 0.5, finest=0.0)
        levels = np.array([one.level for one in steps])
        if levels.size < _LEVELS or not (levels.min() < -0.3 * reach and levels.max() > 0.3 * reach):
            continue
        held = sum(seen.lasts(one) for one in steps) / seen.duration
        turned = median([abs(seen.turned(one.first, one.last)) for one in steps])
        ways = 1 + int(np.sum(np.diff(np.sign(np.diff(levels))) != 0))
        small = median(np.abs(np.diff(levels))) < 0.5 * reach
        if ways <= _WAYS and small and held > _MOST and turned > _STEADY:
            between = f"{levels.min() / unit:.2g} and {levels.max() / unit:.2g} deg{'/s' if values is seen.r else ''}"
            return Kind("spiral", {"rudder": quantile(np.abs(seen.delta), 0.98)},
                        (f"{levels.size} {what} held one after another between {between}",
                         f"they rise and fall {ways} times in all")).doubting(
                        "by rates of turn: a reverse spiral" if values is seen.r else "")  # fmt: skip
    return None


def turning(seen: Signals) -> Kind | None:
    """One angle held through a turn, and what follows it."""
    if seen.delta is None:
        return _circling(seen)
    helm = [one for one in seen.holds if abs(one.level) > max(_MIDSHIPS, _SHARE * _greatest(seen))]
    if not helm:
        return None
    main = max(helm, key=lambda one: abs(seen.turned(one.first, one.last)) + 1e-6 * seen.lasts(one))
    angle, whole = seen.turned(main.first, main.last), seen.turned(0, -1)
    others = [one for one in helm if one != main and abs(seen.turned(one.first, one.last)) > 20.0 * DEGREE]
    busy = sum(abs(seen.turned(one.first, one.last)) for one in others)
    if busy > 0.6 * abs(angle) or len(others) > 3:
        return _both_sides(seen, helm)
    pair = _reversed(seen, main, helm)
    if pair is not None and _TURN < abs(angle) < _CIRCLE:
        return _recovery(seen, *pair)
    share = seen.lasts(main) / seen.duration
    if both_ways(seen) and share < _MOST:
        return None
    after = _midships_after(seen, main)
    out = Kind("turning", {"rudder": _round(abs(main.level)), "side": math.copysign(1.0, main.level)}, (
        f"{seen.helm(main.level)} held for {seen.lasts(main):.0f} s", f"the heading changes by "
        f"{angle / DEGREE:.0f} deg meanwhile"))  # fmt: skip
    against = not seen.by_thrust and angle * main.level < -((5 * DEGREE) ** 2)
    wrong = "the ship turns against the rudder: is its sign right?" if against else ""
    if abs(angle) < _SHORT:
        alone = len(helm) == 1 and share > _PART
        return _initial(seen, main, out, whole).doubting(wrong) if alone else None
    if after is not None and abs(angle) >= _TURN:
        return _pulled(seen, out, after, abs(angle)).doubting(wrong)
    if share < _PART and (others or both_ways(seen)):
        return None
    return out.doubting(
        wrong, f"{abs(angle) / DEGREE:.0f} deg only, no full circle" if abs(angle) < 350.0 * DEGREE else "",
        f"it fills {100 * share:.0f} % of the trial" if share < 0.4 else "",
    )  # fmt: skip


def _initial(seen: Signals, main: Hold, out: Kind, whole: float) -> Kind:
    """A turn of less than sixty degrees that is all there is."""
    late = main.last < len(seen.t) - 1 - max(3, len(seen.t) // 10)
    few = abs(whole) > 1.5 * _SHORT
    return Kind("initial-turning", {**out.settings, "heading": _round(abs(seen.turned(main.first, main.last)))},
                out.evidence).doubting("more follows the turn" if late or few else "")  # fmt: skip


def _pulled(seen: Signals, out: Kind, after: Hold, angle: float) -> Kind:
    """The rudder is put midships after a steady turn: a pull-out, or the end of a turning circle."""
    told = f"then midships for {seen.lasts(after):.0f} s, engine unchanged"
    if angle > 1.5 * _CIRCLE:
        return Kind("turning", out.settings, (*out.evidence, f"{told}: a pull-out ends it"), out.doubts)
    return Kind("pull-out", out.settings, (*out.evidence, told), ("to one side only",))


def _both_sides(seen: Signals, helm: Sequence[Hold]) -> Kind | None:
    """Two turns, one to either side, each with a pull-out or not."""
    turns = [one for one in helm if abs(seen.turned(one.first, one.last)) > _TURN]
    if len(turns) != 2 or len(helm) > 4 or turns[0].level * turns[1].level > 0 or not _alike(turns):
        return None
    rudder = median(np.abs([one.level for one in turns]))
    settings = {"rudder": _round(rudder), "side": math.copysign(1.0, turns[0].level)}
    told = tuple(f"{seen.helm(one.level)} for {seen.turned(one.first, one.last) / DEGREE:.0f} deg of "
                 "heading" for one in turns)  # fmt: skip
    calm = [_midships_after(seen, one) for one in turns]
    if calm[0] is not None:
        return Kind("pull-out", settings, (*told, f"midships after {sum(map(bool, calm))} of the turns"))
    return Kind("recovery", settings, told)


def _reversed(seen: Signals, main: Hold, helm: Sequence[Hold]) -> tuple[Hold, Hold] | None:
    """The main turn and one like it to the other side, at once before or after it."""
    k = helm.index(main)
    for before, after in pairwise(helm[max(k - 1, 0) : k + 2]):
        if before.level * after.level < 0 and _alike((before, after)) and _quick(seen, before, after):
            return before, after
    return None


def _recovery(seen: Signals, before: Hold, main: Hold) -> Kind:
    """Hard over to one side, then to the other: as a Williamson or a Scharnow turn."""
    first, second = (seen.turned(one.first, one.last) / DEGREE for one in (before, main))
    whole = abs(seen.turned(before.first, -1)) / DEGREE
    return Kind(
        "recovery", {"rudder": _round(max(abs(before.level), abs(main.level))),
                     "side": math.copysign(1.0, before.level)},
        (f"{seen.helm(before.level)} for {first:.0f} deg of heading, then {seen.helm(main.level)} for "
         f"{second:.0f} deg",),
    ).doubting("" if 150.0 < whole < 210.0 else f"it ends {whole:.0f} deg from the first course")  # fmt: skip


def _midships_after(seen: Signals, turn: Hold) -> Hold | None:
    """The rudder held midships after a steady turn, the engine unchanged, for a few ship lengths."""
    limit = max(_MIDSHIPS, 0.1 * abs(turn.level))
    after = next((one for one in seen.holds if one.first > turn.last and abs(one.level) <= limit), None)
    met = any(one.level * turn.level < 0 and abs(one.level) > limit for one in seen.holds
              if after is not None and turn.last < one.first < after.first)  # fmt: skip
    if met and not seen.by_thrust:
        return None  # the turn was met with counter rudder
    if after is None or seen.t[after.first] - seen.t[turn.last] > 3.0 * seen.clock or seen.lasts(after) < seen.clock:
        return None
    if seen.by_thrust and seen.pair is not None:
        rests = np.max(np.abs(seen.pair)[:, after.first : after.last + 1], axis=0)
        if median(rests) < 0.05 * quantile(np.abs(seen.pair), 0.99):
            return None  # without thrust it coasts
    if seen.n is not None:
        held, then = (median(seen.n[one.first : one.last + 1]) for one in (turn, after))
        if abs(then - held) > 0.2 * abs(held):
            return None
    return after


def _circling(seen: Signals) -> Kind | None:
    """A turn without a rudder on record: the heading goes one way at a steady rate."""
    whole = seen.turned(0, -1)
    half = seen.r[len(seen.r) // 2 :]
    if abs(whole) < 270.0 * DEGREE or np.std(half) > 0.35 * abs(np.mean(half)):
        return None
    return Kind(
        "turning",
        {"side": math.copysign(1.0, whole)},
        (f"the heading changes by {whole / DEGREE:.0f} deg, in the end {np.mean(half) / DEGREE:.2g} deg/s",),
    )


def _greatest(seen: Signals) -> float:
    return max((abs(one.level) for one in seen.holds), default=0.0)


def _round(angle: float) -> float:
    """An angle as it was probably meant: whole degrees."""
    return round(angle / DEGREE) * DEGREE


STEERING = (zigzag, turning, spiral)
"""Descriptions of kinds by rudder and heading, in the order to try."""
