"""Channels of the bare numbers of a robot's log: what moves the ship by its name and by what the ship does.

Each number is tried as a channel of its own, so that the import itself puts it on the rows of the motion.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import combinations
from pathlib import Path

import numpy as np

from ...core.values import dataclass
from .. import Array, Trial
from ..guess.answers import DOUBT
from ..guess.entries import Known
from ..guess.helm import rudder_sense
from ..guess.thrust import sense_of
from .aboard import unknown_control
from .topics import Number, Topics

_SURE = 6.0
_PULSES, _NEUTRAL, _MOST = (800.0, 2200.0), 1500.0, 400.0
_KIND = re.compile(r" \((?:std_msgs|mavros_msgs|heron_msgs|marine_msgs)/msg/\w+\)$")
_SIDES = {"left": "port", "port": "port", "right": "starboard", "starboard": "starboard", "stbd": "starboard"}
_WORDS = re.compile(r"[a-z]+")
_STEERS = frozenset(("rudder", "helm", "tiller", "steer", "steering", "servo"))
_MANY = 12
_WHOLE = 1.5
"""Shares of the greatest order are below this."""
Reader = Callable[[Path, Topics | None], Trial]


@dataclass(frozen=True)
class Line:
    """A number of the mapping: topic, channel and keys, what shows it, and what is in doubt."""

    at: str
    number: Number
    evidence: str
    doubts: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The line of the mapping file, with its comments before."""
        one = self.number
        keys = [f'channel = "{one.channel}"', *([f'unit = "{one.unit}"'] if one.unit else []),
                *(["sign = -1"] if one.sign < 0 else []), *([f"scale = {one.scale:g}"] if one.scale != 1.0 else []),
                *([f"offset = {one.offset:.10g}"] if one.offset else [])]  # fmt: skip
        said = [f"# {self.evidence}", *(f"# {DOUBT} {doubt}" for doubt in self.doubts)]
        return "\n".join([*said, f'"{self.at}" = {{ {", ".join(keys)} }}'])


def numbers_of(path: Path, read: Reader) -> tuple[list[Line], list[str]]:
    """What the numbers of a log are that the import leaves out or does not know, and what stays unknown of them.

    Args:
        path: of the log.
        read: its reader.

    Raises:
        DataError: a log that cannot be read.
    """
    plain = read(path, None)
    ignored = plain.meta.get("ignored", {})
    asked = [_KIND.sub("", one) for one in ignored if _KIND.search(one) or re.search(r"\[\w+\]$", one)]
    asked += [one for name in plain.channels if unknown_control(name) for one in _at(plain, name)]
    if not asked:
        return [], []
    trial = read(path, Topics(numbers={at: Number(f"bare_{k}", "-") for k, at in enumerate(asked)}))
    values = {at: trial[f"bare_{k}"] for k, at in enumerate(asked) if f"bare_{k}" in trial}
    moving = {at: one for at, one in values.items() if np.ptp(one[np.isfinite(one)]) > 0.0}
    lines = list(_lines(moving, _motion(trial)))
    taken = {one.at for one in lines}
    return lines, [f"{at}: nothing shows what it is; give it a channel in [numbers], or leave it" for at in moving
                   if at not in taken]  # fmt: skip


def _at(trial: Trial, name: str) -> list[str]:
    """Topic of a channel that was named by the last part of it."""
    return [one for one in re.findall(r"(/\S+) \(std_msgs", " ".join(trial.meta["processing"]))
            if one.rpartition("/")[2] == name]  # fmt: skip


def _motion(trial: Trial) -> Known:
    """Rate and speed of the ship, by the track where nothing else tells them."""
    u = trial.channels.get("u", trial.channels.get("U_G"))
    if u is None and "x" in trial:
        there = np.isfinite(trial["x"] + trial["y"])
        if there.sum() > 2:
            t = trial.t[there]
            u = np.interp(trial.t, t, np.hypot(np.gradient(trial["x"][there], t), np.gradient(trial["y"][there], t)))
    return Known(trial.t, None, u, None, trial.channels.get("r"), u)


def _lines(values: Mapping[str, Array], known: Known) -> Iterator[Line]:
    left = dict(values)
    for at in list(left):
        # an autopilot calls all that it drives servos
        if _STEERS & set(_WORDS.findall(at.lower().replace("servo_output", ""))):
            yield _rudder(at, left.pop(at), known)
    yield from _shafts({at: left.pop(at) for at in list(left) if "rpm" in at.lower()}, known)
    pair = _pair(left, known)
    yield from pair
    for one in pair:
        left.pop(one.at)
    if not pair and known.r is not None and known.u is not None:
        yield from _apart(left, known)


def _rudder(at: str, values: Array, known: Known) -> Line:
    """A rudder or its order by its name: unit by its size, sign by what the bow does."""
    sense, sure = rudder_sense(known.t, known.r, values) if known.r is not None else (0.0, 0.0)
    largest = float(np.nanmax(np.abs(values)))
    side = f"the bow goes to {'starboard' if sense > 0 else 'port'} with it ({sure:.0f} standard errors)"
    doubts = [] if sure > _SURE else ["nothing shows to which side it turns the ship; taken as positive to starboard"]
    sign = -1 if sense < 0 and sure > _SURE else 1
    if _pulse(values):
        number = Number("steering", "-", sign, 1.0 / _MOST, -sign * _NEUTRAL / _MOST)
        return Line(at, number, f"by its name; {side}", (*doubts, _TAKEN))
    unit = "deg" if largest > 1.6 else "rad"
    if 0.8 < largest < 4.0:
        doubts.append(f"values up to {largest:.3g}, taken in {unit}")
    return Line(at, Number("delta", unit, sign), f"by its name, values up to {largest:.3g}; {side}", tuple(doubts))


def _shafts(values: Mapping[str, Array], known: Known) -> Iterator[Line]:
    """Revolutions by their name: of one shaft, or of one to each side."""
    sides = {at: {_SIDES[word] for word in _WORDS.findall(at.lower()) if word in _SIDES} for at in values}
    for at, one in values.items():
        if len(values) > 2 or (len(values) == 2 and sorted(map(sorted, sides.values())) != [["port"], ["starboard"]]):
            return
        channel = "n_P" if len(values) == 1 else "n_P_1" if "port" in sides[at] else "n_P_2"
        sense, sure = rudder_sense(known.t, known.u, one) if known.u is not None else (0.0, 0.0)
        back = sense < 0.0 and sure > _SURE
        doubts = ["the ship loses speed by it: its sign is turned here"] if back else []
        yield Line(at, Number(channel, "rpm", -1 if back else 1), "revolutions by its name", (*doubts, _GEARED))


_GEARED = "taken as those of the propeller; of a motor with a gear write scale"
_TAKEN = f"taken as pulses of {_NEUTRAL:g} us for none and {_MOST:g} us either way for all of it"


def _pulse(values: Array) -> bool:
    good = values[np.isfinite(values) & (values != 0.0)]
    return bool(good.size) and _PULSES[0] < float(good.min()) <= float(good.max()) < _PULSES[1]


def _share(values: Array) -> tuple[Array, float, float]:
    """Values as a share of the most, with scale and offset to it."""
    if _pulse(values):
        return (values - _NEUTRAL) / _MOST, 1.0 / _MOST, -_NEUTRAL / _MOST
    scale = 0.01 if 1.5 < float(np.nanmax(np.abs(values))) <= 100.5 else 1.0
    return scale * values, scale, 0.0


def _pair(values: Mapping[str, Array], known: Known) -> list[Line]:
    """The two motors of a ship that they turn, each on the side and with the sense that the motion shows."""
    for one, other in combinations(list(values)[:_MANY], 2):
        made = [_share(values[at]) for at in (one, other)]
        if max(float(np.nanmax(np.abs(share))) for share, _, _ in made) > _WHOLE:
            continue
        signs, exchanged, told = sense_of([share for share, _, _ in made], known)
        if not told or not _both([share for share, _, _ in made], signs, known):
            continue
        out: list[Line] = []
        for at, (_, scale, offset), sign, side in zip((one, other), made, signs, _sides(exchanged), strict=True):
            doubts = [_TAKEN] if _pulse(values[at]) else []
            own = [_SIDES[word] for word in _WORDS.findall(at.lower()) if word in _SIDES]
            if own and own[0] != side:
                doubts.append(f"its name says {own[0]}, and the ship turns as if it were to {side}")
            if sign < 0.0:
                doubts.append("the ship loses speed by it: its sign is turned here")
            turned = -1 if sign < 0.0 else 1
            out.append(Line(at, Number(f"throttle_{side}", "-", turned, scale, turned * offset), told, tuple(doubts)))
        return out
    return []


def _both(pair: Sequence[Array], signs: tuple[float, float], known: Known) -> bool:
    """Whether the sum of two shares moves the ship ahead, and their difference turns it, more surely than one alone."""
    if known.u is None or known.r is None:
        return False
    (a, b), (p, q) = pair, signs
    for rate, together in ((known.u, p * a + q * b), (known.r, p * a - q * b)):
        alone = max(rudder_sense(known.t, rate, one)[1] for one in (a, b))
        if rudder_sense(known.t, rate, together)[1] <= alone:
            return False
    return True


def _sides(exchanged: bool) -> tuple[str, str]:
    return ("starboard", "port") if exchanged else ("port", "starboard")


def _apart(values: Mapping[str, Array], known: Known) -> Iterator[Line]:
    """One motor and one rudder: what raises the speed, and what turns the ship."""
    values = {at: one for at, one in values.items() if float(np.nanmax(np.abs(_share(one)[0]))) <= _WHOLE}
    for channel, rate in (("throttle", known.u), ("steering", known.r)):
        if rate is None:
            continue
        found = [(sure, sense, at) for at, one in values.items()
                 for sense, sure in [rudder_sense(known.t, rate, _share(one)[0])]]  # fmt: skip
        if found and max(found)[0] > _SURE:
            sure, sense, at = max(found)
            _, scale, offset = _share(values[at])
            sign = 1 if sense > 0.0 else -1
            what = "the speed rises" if channel == "throttle" else "the bow goes to starboard"
            said = f"{what} with it, times {sign}"
            doubts = [_TAKEN] if _pulse(values[at]) else []
            yield Line(at, Number(channel, "-", sign, scale, sign * offset), f"{said} ({sure:.0f} standard errors)",
                       tuple(doubts))  # fmt: skip
