"""Thrust of the motors to port and starboard, and controls that no entry takes.

Names of sides and the sense of a motor's signal are often exchanged: thrust that acts on the ship ahead raises its
speed, and more of it to port than to starboard turns the bow to starboard.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from .. import Array
from .answers import Answer, Entry, quoted
from .cells import Column
from .entries import Known, entry_of
from .helm import rudder_sense
from .naming import tokens
from .roles import Signal, like_degrees

_SURE, _APART = 6.0, 0.98
_DRIVING = 0.2
"""Thrust in the mean, as a part of the most, that drives a ship ahead."""
_PULSES = (800.0, 2200.0)
"""Widths of the pulses that servos and motor controllers take [us]; 1500 is their neutral, 400 either way the most."""

_NEUTRAL, _MOST = 1500.0, 400.0
_NEAR, _RESTING = 60.0, 0.1
"""How far from 1500 [us] a motor's own zero may be, and the least part of the rows that it stands there."""

_WORDS = frozenset((
    "rudder", "rud", "delta", "helm", "tiller", "steer", "steering", "servo", "motor", "motors", "thrust", "thruster",
    "thrusters", "thr", "throttle", "pwm", "esc", "force", "prop", "propeller", "rpm", "rps", "revs", "azimuth", "pod",
    "nozzle", "waterjet", "bucket", "engine", "actuator", "control", "controls", "cmd", "command", "ruder", "ror",
    "pedal", "lever", "bowthruster", "telegraph", "output", "outputs",
))  # fmt: skip
_AHEAD, _ORDERS = frozenset(("ahead", "astern", "voraus", "zuruck", "zurueck", "forover", "akterover", "avant")), 30
"""Words of an engine telegraph, and how many orders there may be."""

_PARTS = re.compile(r"(?:servo|motor|thruster|thrust|rudder|pwm|esc|ch|chan|rc)\d*(?:raw|out|cmd|in)?|c\d{1,2}")
_SIDES = ("port", "starboard")


def thrust_entries(found: Mapping[str, Signal], known: Known) -> Iterator[Entry]:
    """Entries of throttles and forces of a motor to port and one to starboard."""
    for stem, channel in (("throttle", "throttle"), ("force", "f")):
        pair = [found[role] for role in (f"{stem}_1", f"{stem}_2") if role in found]
        if len(pair) == 2 and all(_sided(one, side) for one, side in zip(pair, _SIDES, strict=True)):
            yield from _pair(pair, channel, known)


def _sided(signal: Signal, side: str) -> bool:
    return any(side in one.words for one in signal.column.means)


def _pair(pair: Sequence[Signal], channel: str, known: Known) -> Iterator[Entry]:
    """The entries of both motors, each on the side and with the sense that the motion shows."""
    made = [_scaled(one, channel) for one in pair]
    signs, exchanged, told = sense_of([values for _, values, _ in made], known)
    names = _SIDES[::-1] if exchanged else _SIDES
    for signal, (keys, _, doubts), sign, side, own in zip(pair, made, signs, names, _SIDES, strict=True):
        more = list(doubts)
        if not told:
            more.append("the motion does not show its side and sense: taken to be on the side of its name, and "
                        "positive ahead")  # fmt: skip
        if exchanged:
            more.append(f"its name says {own}, and the ship turns as if it were to {side}: sides exchanged here")
        if sign < 0.0:
            more.append("the ship goes ahead by less of it: its sign is turned here")
            keys = {**keys, "sign": "-1"} | ({"offset": f"{-float(keys['offset']):g}"} if "offset" in keys else {})
        evidence = f"{signal.column.said}; {told}" if told else signal.column.said
        yield entry_of(f"{channel}_{side}", signal, keys, Answer(evidence, tuple(more)))


def _scaled(signal: Signal, channel: str) -> tuple[dict[str, str], Array, list[str]]:
    """Keys of a motor, its values as a share of the most or in N, and doubts."""
    values = signal.values
    if channel == "f":
        unit = signal.unit or "N"
        doubts = [] if signal.unit else ["no unit is said; taken as N"]
        return {"unit": quoted(unit)}, values, [*doubts, "a force by its name; whether it was measured is not said"]
    good = values[np.isfinite(values)]
    if good.size and _PULSES[0] < good.min() <= good.max() < _PULSES[1]:
        usual = (one for one, often in Counter(good.tolist()).most_common()
                 if abs(one - _NEUTRAL) < _NEAR and often > _RESTING * good.size)  # fmt: skip
        zero = next(usual, _NEUTRAL)
        # all pulses that a controller takes stay within full thrust either way, wherever its zero is
        most = _MOST + abs(zero - _NEUTRAL)
        doubt = f"taken as pulses of {zero:g} us for no thrust and {most:g} us either way for all of it"
        keys = {"unit": quoted("-"), "scale": f"{1.0 / most:.10g}", "offset": f"{-zero / most:.10g}"}
        return keys, (values - zero) / most, [doubt]
    largest = float(np.max(np.abs(good), initial=0.0))
    size = 100.0 if signal.unit == "%" or 1.5 < largest <= 100.5 else 1.0
    unit = "%" if size == 100.0 else "-"
    doubts = [] if signal.unit or largest <= 1.0 else [f"values up to {largest:.4g}; taken in {unit} of full thrust"]
    return {"unit": quoted(unit)}, values / size, doubts


def sense_of(pair: Sequence[Array], known: Known) -> tuple[tuple[float, float], bool, str]:
    """Signs of both signals, whether their sides are exchanged, and the evidence; empty where the motion has none."""
    if known.u is None or known.r is None:
        return (1.0, 1.0), False, ""
    a, b = pair
    ways = [(*rudder_sense(known.t, known.u, p * a + q * b), (p, q)) for p, q in product((1.0, -1.0), repeat=2)]
    raised = [(sure, signs) for sense, sure, signs in ways if sense > 0.0 and sure >= _SURE]
    tried = [(f"both raise the speed ({sure:.0f} standard errors)", signs) for sure, signs in sorted(raised)[::-1]]
    # thrust that is ever the same, and turns that slow the ship, hide that: it goes ahead by what they have in the mean
    means = [float(np.nanmean(one)) for one in pair]
    if np.nanmean(known.u) > 0.0 and min(map(abs, means)) > _DRIVING * float(np.nanmax(np.abs(pair))):
        p, q = (math.copysign(1.0, one) for one in means)
        tried.append(("the ship goes ahead with both", (p, q)))
    for told, (p, q) in tried:
        sense, sure = rudder_sense(known.t, known.r, p * a - q * b)
        if sure >= _SURE:
            return (p, q), sense < 0.0, f"{told}, the sides turn the ship ({sure:.0f})"
    return (1.0, 1.0), False, ""


def halves_of_rudder(found: Mapping[str, Signal]) -> Iterator[Entry]:
    """A doubt where two rudders are one: how far it is over to port, and how far to starboard."""
    if not {"delta_1", "delta_2"} <= set(found):
        return
    a, b = (found[role].values for role in ("delta_1", "delta_2"))
    known = np.isfinite(a) & np.isfinite(b)
    a, b = a[known], b[known]
    if a.size and a.min() >= 0.0 < a.max() and b.min() >= 0.0 < b.max() and (np.minimum(a, b) == 0.0).mean() > _APART:
        first, second = (found[role].column.said for role in ("delta_1", "delta_2"))
        doubt = (f"{first} and {second} are never over together: the two sides of one rudder, it seems; write a column "
                 "of their difference, and take it as delta")  # fmt: skip
        yield Entry("", {}, Answer("", (doubt,)))


def unplaced(columns: Sequence[Column], text: str) -> Iterator[Entry]:
    """A doubt where a log has columns that look like a position and the mapping reads none."""
    worded = [one for one in columns if one.kind == "text" and max(map(one.score, ("latitude", "longitude"))) > _WORDED]
    if len(worded) > 1:
        cell = next((cell for cell in worded[0].cells if cell.strip()), "")
        doubt = (f"no position is read: {', '.join(one.said for one in worded[:2])} are written in a form that is not "
                 f"known, such as {cell!r:.40}; degrees (59.43), 5925.8 N, 59 25 48 N and the like are")  # fmt: skip
        yield Entry("", {}, Answer("", (doubt,)))
        return
    left = [one for one in columns if one.kind in ("number", "letters") and one.varies and quoted(one.head) not in text
            and (_PLACES & set(tokens(one.name)) or {"x", "y"} & {meant.role for meant in one.means}
                 or like_degrees(Signal("", one, one.values)))]  # fmt: skip
    if len(left) < 2:
        return
    sizes = [one.values for one in left[:3]]
    far = np.nanmedian(np.sqrt(sum(one**2 for one in sizes))) if len(sizes) == 3 else 0.0
    doubt = f"no position is read, and {', '.join(one.said for one in left[:4])} look like one; "
    doubt += ("by their size they are counted from the middle of the earth (ECEF): write columns of latitude and "
              "longitude" if abs(far / _EARTH - 1.0) < _ROUND
              else "write [position] with latitude and longitude, or [channels.x] and [channels.y]")  # fmt: skip
    yield Entry("", {}, Answer("", (doubt,)))


_PLACES = frozenset(("position", "pos", "ecef", "utm", "ned", "enu", "north", "east", "northing", "easting", "lat",
                     "lon", "latitude", "longitude", "lng", "coord", "coordinate", "xyz", "location"))  # fmt: skip
_WORDED = 0.6
"""Score of a name that says a latitude or a longitude."""
_EARTH, _ROUND = 6.371e6, 0.01
"""Radius of the earth [m], and by which part of it a place on it may be off."""


def neglected(columns: Sequence[Column], text: str) -> Iterator[Entry]:
    """A doubt for each column that looks like a control and that no entry of the mapping takes."""
    for column in columns:
        words = set(tokens(column.name))
        orders = sorted({cell.strip() for cell in column.cells} - {""}) if column.kind == "text" else []
        if orders and len(orders) < _ORDERS and any(_AHEAD & set(tokens(cell)) for cell in orders):
            values = ", ".join(f"{quoted(one)} = ..." for one in orders[:3])
            doubt = (f"{column.said} has orders in words ({', '.join(orders[:4])}), and is left out; "
                     f"[channels.n_P_cmd] or [channels.throttle] with letters = {{ {values} }} reads them")
            yield Entry("", {}, Answer("", (doubt,)))
            continue
        worded = column.kind == "text" and len({*column.cells} - {""}) > 2 and any(map(str.isdigit, column.cells[-1]))
        if quoted(column.head) in text or not (worded or (column.kind in ("number", "letters") and column.varies)):
            continue
        if words & _WORDS or any(_PARTS.fullmatch(word) for word in words):
            doubt = (f"{column.said} looks like a control of the ship and is left out; give it a channel such as "
                     f"[channels.n_P], [channels.throttle_port] or [channels.delta_cmd]")  # fmt: skip
            yield Entry("", {}, Answer("", (doubt,)))
