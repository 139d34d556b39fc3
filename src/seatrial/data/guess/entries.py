"""The entries of a mapping file from what was found: channels, positions, speeds, heading, rudders, revolutions."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...core.values import dataclass, replace
from .. import Array
from ..units import KNOWN
from .answers import ASK, Answer, Entry, listed, quoted
from .cells import Column
from .helm import from_neutral, neutral_of, read_revolutions, read_rudder
from .layout import Table
from .motion import MIRRORED, SPEEDS, Motion, Option, Verdict, speed_unit_said, speeds_of
from .naming import magnetic, tokens
from .roles import Signal, held_over, variation_of

_SPEED = "unit of speed"
_ANTENNA = "the antenna is taken to be midship: antenna = [forward, starboard] in m says where it is"


@dataclass(frozen=True)
class Known:
    """What the motion was found to be, for what depends on it.

    Attributes:
        t: time [s].
        psi, u, v, r: heading [rad], speeds over ground [m/s], rate of turn [rad/s]; None where unknown.
        speed: size of the speed [m/s]; None where unknown.
    """

    t: Array
    psi: Array | None
    u: Array | None
    v: Array | None
    r: Array | None
    speed: Array | None

    @property
    def turned(self) -> float:
        """By how much the heading changed in all [rad]."""
        return float(np.nanmax(self.psi) - np.nanmin(self.psi)) if self.psi is not None and self.psi.size else 0.0


def motion_entries(found: Mapping[str, Signal], verdict: Verdict, letters: Mapping[str, str]) -> Iterator[Entry]:
    """Entries of heading, position, speeds and rate by a verdict; letters of a latitude in columns of their own."""
    yield from _heading(found, verdict)
    yield from _position(found, verdict, letters)
    yield from _velocity(found, verdict)
    yield from _rate(found, verdict)


def _doubts(verdict: Verdict, **asked: str) -> tuple[str, ...]:
    """A doubt for each choice that neither the tests nor the names decide."""
    out: list[str] = []
    for key, advice in asked.items():
        name = key.replace("_", " ")
        if name in verdict.best.choice and not verdict.sure(name):
            out.append(f"the {name} may also be {verdict.rivals[name].choice[name]}; {advice}")
    return tuple(out)


def _said(signal: Signal, unit: str) -> tuple[str, ...]:
    """A doubt where the log says another unit."""
    if signal.unit and KNOWN[signal.unit] != KNOWN[unit]:
        return (f"the {signal.column.where} says {signal.unit}, and its values are not",)
    return ()


def _of(signal: Signal, **keys: str) -> dict[str, str]:
    """Keys of a channel, its file among them, and the unit that the log wrongly gives."""
    out = {"column": quoted(signal.column.head), **keys}
    out |= _despite(signal, keys.get("unit", "").strip('"'))
    return out | ({"file": quoted(signal.file)} if signal.file else {})


def _despite(signal: Signal, unit: str) -> dict[str, str]:
    """The key for a unit that the table gives wrongly."""
    written = signal.column.where in ("header", "row of units", "cells")
    wrong = written and unit in KNOWN and KNOWN[unit] != KNOWN[signal.column.unit]
    return {"despite": quoted(signal.column.unit)} if wrong else {}


def once_named(tables: Sequence[Table], entry: Entry) -> Entry:
    """The entry with a doubt where its column's name is that of another column too."""
    heads = [head for table in tables for head in set(table.heads) if table.heads.count(head) > 1]
    twice = [head for head in heads if quoted(head) in entry.keys.values()]
    numbered = [head for table in tables for head in table.heads if f"{head} (2)" in table.heads]
    if first := [head for head in numbered if quoted(head) in entry.keys.values()]:
        return _doubting(entry, f"two columns are called {first[0]}: this is the first, {first[0]} (2) the other")
    if not twice:
        return entry
    return _doubting(entry, f"two columns are called {twice[0]}, and the import refuses that; rename one in the log")


def in_its_unit(columns: Sequence[Column], entry: Entry) -> Entry:
    """The entry with a doubt where its column has a word in the place of a unit that is none known here."""
    used = [one for one in columns if one.unread and quoted(one.head) in entry.keys.values()]
    return _doubting(entry, *(f"{one.said} says {quoted(one.unread)}, which is no unit that is known; the one here is "
                              "a guess" for one in used))  # fmt: skip


def _doubting(entry: Entry, *doubts: str) -> Entry:
    return replace(entry, answer=replace(entry.answer, doubts=(*entry.answer.doubts, *doubts)))


def entry_of(channel: str, signal: Signal, keys: Mapping[str, str], answer: Answer) -> Entry:
    """The entry of a channel that is one column."""
    return Entry(f"channels.{channel}", _of(signal, **keys), answer)


def _told(verdict: Verdict, signal: Signal, *keys: str) -> str:
    told = verdict.told(*keys)
    return f"{signal.column.said}; {told}" if told else signal.column.said


def _heading(found: Mapping[str, Signal], verdict: Verdict) -> Iterator[Entry]:
    choice = verdict.best.choice
    if "frame of the quaternion" in choice:
        parts = [found[name] for name in ("qx", "qy", "qz", "qw") if name in found]
        frame = choice["frame of the quaternion"]
        doubts = _doubts(verdict, frame_of_the_quaternion="write it under frame")
        names = {"qx", "qy"} - set(found)
        evidence = _told(verdict, parts[-1], "frame of the quaternion")
        if not names:
            keys = {"quaternion": listed([one.column.head for one in parts]), "frame": quoted(frame)}
            yield Entry(
                "heading", keys | ({"file": quoted(parts[-1].file)} if parts[-1].file else {}), Answer(evidence, doubts)
            )
        return
    signal = next((found[name] for name in ("heading", "yaw") if name in found), None)
    if signal is None:
        return
    unit, sense = choice["unit of psi"], choice["sense of psi"]
    keys = {"unit": quoted(unit)}
    if sense != "clockwise from north":
        keys["sign"] = "-1"
        if "east" in sense:
            keys["offset"] = "90.0" if unit == "deg" else f"{math.pi / 2 / KNOWN[unit][1]:.12g}"
    doubts = [
        *_said(signal, unit),
        *_doubts(verdict, unit_of_psi="write that", sense_of_psi="turn sign (and offset) then"),
    ]
    if "yaw" in tokens(signal.column.name) and choice.get("axes") == "x, y" and {"x", "y"} <= set(found):
        doubts.append("x, y, yaw may be those of robots, east, north, anticlockwise: no log tells its mirror image")
    if magnetic(signal.column.name):
        degrees, by = variation_of(found) if unit == "deg" else (0.0, "")
        keys |= {"offset": f"{float(keys.get('offset', 0.0)) + degrees:.6g}"} if by else {}
        doubts.append(f"magnetic by its name; {by}its deviation {'goes' if by else 'and variation go'} under offset")
    if not any(signal.column.score(role) for role in ("heading", "yaw", "alpha")):
        doubts.append("taken for the heading as the ship goes about where it points; its name is none that is known")
    evidence = f"{_told(verdict, signal, 'unit of psi', 'sense of psi')}; {sense}{_in_unit(signal, unit)}"
    yield Entry("channels.psi", _of(signal, **keys), Answer(evidence, tuple(doubts)))


def _in_unit(signal: Signal, unit: str) -> str:
    if signal.unit:
        return f", {signal.unit} by its {signal.column.where}"
    return f", {unit} as its values go from {np.nanmin(signal.values):.4g} to {np.nanmax(signal.values):.4g}"


def _position(found: Mapping[str, Signal], verdict: Verdict, letters: Mapping[str, str]) -> Iterator[Entry]:
    swapped = verdict.best.choice.get("axes") == "y, x"
    mirrored = verdict.best.choice.get("axes") == MIRRORED
    doubts = [] if mirrored else list(_doubts(verdict, axes="exchange the two columns then"))
    doubts += [_MIRRORED] if mirrored else []
    if {"latitude", "longitude"} <= set(found):
        first, second = (found[name] for name in (("longitude", "latitude") if swapped else ("latitude", "longitude")))
        halved = first.column.half is not None
        if swapped and not halved:
            doubts.append("the names of the two columns are exchanged in the log")
        if not first.column.score("latitude") and not first.column.score("longitude"):
            metres = max(map(first.column.score, ("x", "y", "north", "east")))
            doubts.append("its values are degrees by their size and digits, "
                          + ("though its name says metres" if metres else "and its name is none that is known"))
        keys = {
            "latitude": quoted(first.column.head),
            "longitude": quoted(second.column.head),
            "format": quoted(angle_form(first)),
        }
        keys |= {} if first.file or swapped or halved else {key: quoted(head) for key, head in letters.items()}
        keys |= {"first": quoted("longitude")} if first.column.half == 1 else {}
        for role in ("latitude", "longitude"):
            if (minutes := _minutes_of(found, role)) is not None:
                keys[f"{role}_minutes"] = quoted(minutes.column.head)
        if (rows := held_over(first.values, second.values)) > 1:
            doubts.append(f"a position stands over {rows} rows: the receiver is slower than the log, and repeats are "
                          "late; leave the repeated cells empty, also those of its speed and course")  # fmt: skip
        evidence = f"{_told(verdict, first, 'axes')}; {_ANTENNA}"
        yield Entry(
            "position", keys | ({"file": quoted(first.file)} if first.file else {}), Answer(evidence, tuple(doubts))
        )
        return
    yield from _metres(found, verdict, doubts, swapped)


def _metres(found: Mapping[str, Signal], verdict: Verdict, doubts: list[str], swapped: bool) -> Iterator[Entry]:
    """Entries of a position in metres; of UTM where its zone is said."""
    pair = next((two for two in (("north", "east"), ("x", "y")) if set(two) <= set(found)), None)
    if pair is None:
        return
    first, second = (found[name] for name in (reversed(pair) if swapped else pair))
    if swapped and pair == ("north", "east"):
        doubts.append("its name says otherwise")
    if _is_grid(first, second):
        if zone := zone_said(first.column):
            keys = {"latitude": quoted(first.column.head), "longitude": quoted(second.column.head)}
            keys |= {"format": quoted("utm"), "zone": quoted(zone)}
            keys |= {"file": quoted(first.file)} if first.file else {}
            evidence = f"{_told(verdict, first, 'axes')}; northing and easting of the zone {zone}; {_ANTENNA}"
            yield Entry("position", keys, Answer(evidence, tuple(doubts)))
            return
        doubts.append("northing and easting, it seems, of a grid whose north is up to 3 deg off the true one; of UTM, "
                      'write [position] with format = "utm" and its zone in place of x and y')  # fmt: skip
    if first.column.where == "speed":
        doubts.append(f"no unit is said; in {first.unit} its track is as fast as the speed beside it")
    for name, signal, key in (("x", first, "north"), ("y", second, "east")):
        keys = {"unit": quoted(signal.unit or "m")}
        if name == "y" and _MIRRORED in doubts:
            keys["sign"], key = "-1", "west"
        evidence = f"{_told(verdict, signal, 'axes')}; {key}"
        yield Entry(f"channels.{name}", _of(signal, **keys), Answer(evidence, tuple(doubts) if name == "x" else ()))


_ZONE = re.compile(r"(?:utm|zone|sone)\W*([1-5]?\d|60)\s*([C-HJ-NP-X])?", re.IGNORECASE)


def _is_grid(northing: Signal, easting: Signal) -> bool:
    """Whether values are far from 0 as those of UTM: an easting has a false origin of 500 km."""
    north, east = (one.values[np.isfinite(one.values)] for one in (northing, easting))
    if not north.size or not east.size or {northing.unit, easting.unit} - {"", "m"}:
        return False
    return bool(east.min() > 1e5 and east.max() < 9e5 and north.min() > 1e5 and north.max() < 1e7)


def zone_said(column: Column) -> str:
    """The zone of UTM with its letter, that heads or a column of one word tell; empty where none is said or several."""
    table = column.table
    said: set[str] = set()
    for head, unit, cells in zip(table.heads, table.units, table.columns, strict=True):
        words = {cell.strip() for cell in cells} if {"zone", "sone"} & set(tokens(head)) else set[str]()
        some = [head, unit, *(f"zone {word}" for word in words if len(words) == 1)]
        said |= {"".join(found.groups()).upper() for text in some if (found := _ZONE.search(text)) and found[2]}
    return said.pop() if len(said) == 1 else ""


def angle_form(signal: Signal) -> str:
    """How latitudes or longitudes are written, for the mapping."""
    if signal.column.kind in ("minutes", "dms"):
        return "dms"
    if signal.unit == "rad" and float(np.nanmax(np.abs(signal.column.values))) <= math.pi:
        return "rad"
    if float(np.nanmedian(np.abs(signal.column.values))) > _WHOLE:
        return "1e-7 deg"
    return "ddmm.mmm" if minutes_run_on(signal.column.values) else "deg"


_MIRRORED = "by the heading y counts to the west; if the heading counts anticlockwise, psi has the sign -1 and y none"
_ENGINE = frozenset(("engine", "eng", "me", "diesel"))
_GEARED = "of the engine by its name, and taken for the shaft: behind a gear of 3 to 1, scale = 0.3333"
_WHOLE = 1e6
"""Numbers beyond any angle, also in degrees and minutes, count 1e-7 deg."""


def in_degrees(found: Mapping[str, Signal]) -> dict[str, Signal]:
    """Latitude and longitude as degrees, whatever way they are written."""
    out = dict(found)
    for role in ("latitude", "longitude"):
        if role not in out:
            continue
        raw, form = out[role].values, angle_form(out[role])
        sizes = {"rad": 180.0 / math.pi, "1e-7 deg": 1e-7}
        values = raw * sizes.get(form, 1.0)
        if form == "ddmm.mmm":
            values = np.sign(raw) * (np.abs(raw) // 100 + np.abs(raw) % 100 / 60.0)
        if (minutes := _minutes_of(found, role)) is not None:
            values = values + np.copysign(minutes.values / 60.0, values)
        out[role] = replace(out[role], values=values)
    if {"latitude", "longitude"} <= set(out):
        unfixed = (out["latitude"].values == 0.0) & (out["longitude"].values == 0.0)
        if unfixed.any() and not unfixed.all():
            for role in ("latitude", "longitude"):
                out[role] = replace(out[role], values=np.where(unfixed, np.nan, out[role].values))
    return out


def _minutes_of(found: Mapping[str, Signal], role: str) -> Signal | None:
    """The minutes in a column of their own, beside whole degrees; None without."""
    minutes = found.get(f"{role}_minutes")
    if minutes is None or angle_form(found[role]) != "deg":
        return None
    fine = np.nanmin(minutes.values) >= 0.0 and np.nanmax(minutes.values) < 60.0
    whole = found[role].column.values
    return minutes if fine and bool((np.nan_to_num(whole) % 1.0 == 0.0).all()) else None


def minutes_run_on(values: Array) -> bool:
    """Whether values are degrees and minutes in one number, 6326.47: beyond any angle, minutes below sixty."""
    good = np.abs(values[np.isfinite(values)])
    return good.size > 0 and bool(np.median(good) > 360.0 and (good % 100.0 < 60.0).all() and good.max() < 18000.0)


def _velocity(found: Mapping[str, Signal], verdict: Verdict) -> Iterator[Entry]:
    frame, pair = verdict.best.choice.get("frame of speeds"), speeds_of(found)
    if frame is None or pair is None:
        return
    first, second = (found[name] for name in pair)
    unit, doubts = _speed_unit(first, speed_unit_said(found, pair), verdict)
    doubts += list(_doubts(verdict, frame_of_speeds="change it here then", unit_of_course="write that"))
    evidence = _told(verdict, first, _SPEED, "frame of speeds")
    file = {"file": quoted(first.file)} if first.file else {}
    if not _has_heading(found):
        if pair[1] == "cog":
            over = Answer(f"{evidence}; over ground", tuple(doubts))
            yield Entry("channels.U_G", _of(first, unit=quoted(unit)), over)
            course = quoted(verdict.best.choice["unit of course"])
            yield Entry("channels.gamma_G", _of(second, unit=course), Answer(second.column.said))
        return
    if pair[1] == "cog":
        keys = {"speed": quoted(first.column.head), "course": quoted(second.column.head), "unit": quoted(unit),
                "course_unit": quoted(verdict.best.choice["unit of course"])}  # fmt: skip
        yield Entry("ground", keys | _despite(first, unit) | file, Answer(f"{evidence}; over ground", tuple(doubts)))
    elif "," in frame:
        north, east = (second, first) if frame == "east, north" else (first, second)
        if (pair == ("v_north", "v_east") and north is second) or pair == ("u", "v"):
            doubts.append(f"the names of the columns say otherwise, and the track says {frame}")
        keys = {"north": quoted(north.column.head), "east": quoted(east.column.head), "unit": quoted(unit)}
        keys |= _despite(first, unit)
        yield Entry("ground", keys | file, Answer(f"{evidence}; velocities {frame}", tuple(doubts)))
    else:
        yield Entry("channels.u", _of(first, unit=quoted(unit)), Answer(evidence, tuple(doubts)))
        sign = {"sign": "-1"} if "port" in frame else {}
        yield Entry("channels.v_m", _of(second, unit=quoted(unit), **sign), Answer(f"{second.column.said}; {frame}"))


def _has_heading(found: Mapping[str, Signal]) -> bool:
    return bool({"heading", "yaw"} & set(found)) or {"qx", "qy", "qz", "qw"} <= set(found)


def _speed_unit(signal: Signal, said: str, verdict: Verdict) -> tuple[str, list[str]]:
    unit = verdict.best.choice[_SPEED]
    if said or verdict.measured(_SPEED):
        return unit, list(_said(signal, unit))
    return ASK, ["nothing shows whether the speed is in m/s or kn; write the unit in place of ?"]


def _rate(found: Mapping[str, Signal], verdict: Verdict) -> Iterator[Entry]:
    if "r" not in found:
        return
    signal, choice = found["r"], verdict.best.choice
    unit, sense = choice["unit of r"], choice["sense of r"]
    doubts = list(_said(signal, unit))
    sign = {"sign": "-1"} if sense == "to port" else {}
    if not (signal.unit or verdict.measured("unit of r")):
        unit, sign = ASK, sign
        doubts.append("nothing shows its unit; write rad/s, deg/s or deg/min in place of ?")
    doubts += list(_doubts(verdict, sense_of_r="write sign = -1 for that"))
    if "sense of r" not in verdict.alone or not verdict.told("sense of r"):
        doubts.append("no heading shows to which side it grows; taken to starboard")
    evidence = f"{_told(verdict, signal, 'unit of r', 'sense of r')}; grows {sense}"
    yield Entry("channels.r", _of(signal, unit=quoted(unit), **sign), Answer(evidence, tuple(doubts)))


def known_motion(verdict: Verdict, t: Array, found: Mapping[str, Signal]) -> Known:
    """Heading, speeds and rate on all rows by the verdict, without those that rest on an open unit."""
    full = Motion(t, found)
    chosen = [_chosen(options, verdict) for options in (full.headings, full.velocities, full.rates, full.positions)]
    psi = chosen[0].values[0] if chosen[0].values else None
    r = chosen[2].values[0] if chosen[2].values else None
    if r is None and psi is not None:
        r = np.gradient(psi, t) if t.size > 2 else None
    u = v = speed = None
    velocity = chosen[1]
    pair = speeds_of(found)
    open_unit = pair is not None and not verdict.measured(_SPEED) and not speed_unit_said(found, pair)
    if velocity.values and not open_unit:
        a, b = velocity.values
        speed, frame = np.hypot(a, b), velocity.choice["frame of speeds"]
        if "," not in frame:
            u, v = a, (-b if "port" in frame else b)
        elif psi is not None:
            north, east = (b, a) if frame == "east, north" else (a, b)
            u, v = north * np.cos(psi) + east * np.sin(psi), east * np.cos(psi) - north * np.sin(psi)
    elif chosen[3].values and t.size > 10:
        gone = [np.gradient(_calm(one), t) for one in chosen[3].values]
        speed = np.hypot(*gone)
        if psi is not None:
            u = gone[0] * np.cos(psi) + gone[1] * np.sin(psi)
            v = gone[1] * np.cos(psi) - gone[0] * np.sin(psi)
    return Known(t, psi, u, v, r, speed)


def _calm(values: Array) -> Array:
    count = max(values.size // 200, 1)
    return np.convolve(np.pad(values, count, "edge"), np.ones(2 * count + 1) / (2 * count + 1), "valid")


def _chosen(options: list[Option], verdict: Verdict) -> Option:
    return next(
        (one for one in options if all(verdict.best.choice.get(key) == said for key, said in one.choice.items())),
        options[0],
    )


def control_entries(found: Mapping[str, Signal], known: Known, angles: set[str], turned: bool) -> Iterator[Entry]:
    """Entries of rudders and revolutions, with their orders; `turned` where the sense of the heading is a doubt."""
    for role, signal in found.items():
        stem = role.split("_cmd")[0].rstrip("_123456789")
        if stem == "delta":
            measured = None if role == "delta" else found.get(role.removesuffix("_cmd"))
            neutral = neutral_of(signal, measured)
            signal = replace(signal, values=signal.values - neutral)
            keys, answer = read_rudder(signal, known.t, known.r, angles)
            if neutral:
                keys, answer = from_neutral(signal, neutral, keys, answer)
            strange = () if signal.column.score("delta") or measured else (
                "taken for the rudder as the bow follows it; its name is none that is known",)  # fmt: skip
            doubts = ("turn its sign too if that of psi and r is turned",) if turned and known.r is not None else ()
            if known.u is not None and np.isfinite(known.u).any() and np.nanmedian(known.u) < 0.0:
                doubts += ("the ship goes astern most of the time, where a rudder turns it to the other side",)
            answer = Answer(answer.evidence, (*answer.doubts, *doubts, *strange))
        elif role.startswith("n_P"):
            keys, answer = read_revolutions(signal, known.speed, known.r, known.turned)
            if _ENGINE & {word.rstrip("0123456789") for word in tokens(signal.column.name)}:
                answer = Answer(answer.evidence, (*answer.doubts, _GEARED))
            if any(one.startswith("alpha") for one in found):
                role = role.replace("n_P", "n")
        elif stem == "alpha":
            unit = signal.unit or ("deg" if np.nanmax(np.abs(signal.values)) > 7.0 else "rad")
            keys = {"unit": quoted(unit)}
            answer = Answer(
                signal.column.said, ("taken as zero for thrust ahead and positive clockwise; nothing tests it",)
            )
        else:
            continue
        keys = {name: value for name, value in keys.items() if name != "despite"}
        yield entry_of(role, signal, keys, answer)


def other_entries(found: Mapping[str, Signal], known: Known, angles: set[str]) -> Iterator[Entry]:
    """Entries of the speed through water, roll, depth and current; `angles` is the unit of the heading."""
    covered = {"u", "v_north", "vx", "sog"} & set(found) or {"speed", "cog"} <= set(found)
    if "sog" in found and speeds_of(found) is None:
        unit, doubts, evidence = _speed(found["sog"], known)
        yield entry_of("U_G", found["sog"], {"unit": quoted(unit)}, Answer(evidence, tuple(doubts)))
    log = found.get("stw") or (None if covered else found.get("speed"))
    if log is not None and not covered:
        yield _log_entry(log, known)
    for role in ("phi", "depth", "U_C", "gamma_C"):
        if role in found:
            yield _plain_entry(role, found[role], next(iter(angles), ""))


def _plain_entry(role: str, signal: Signal, angle: str) -> Entry:
    """A channel that no test reaches: what its header says, else the unit of other angles, with a doubt."""
    largest = float(np.nanmax(np.abs(signal.values), initial=0.0))
    turns, like = role in ("phi", "gamma_C"), angle and not (angle == "rad" and largest > math.pi)
    usual = angle if like else "deg" if largest > 1.0 else "rad"
    unit = signal.unit or ("m" if role == "depth" else "" if not turns or largest > 360.0 else usual)
    said = f"no unit is said; taken as {unit}" + ", as the heading" * bool(turns and like)
    doubts = [] if signal.unit else [said if unit else "nothing shows its unit; write it in place of ?"]
    doubts += ["taken as positive to starboard; nothing tests it"] if role == "phi" else []
    return Entry(f"channels.{role}", _of(signal, unit=quoted(unit or ASK)), Answer(signal.column.said, tuple(doubts)))


def _speed(signal: Signal, known: Known) -> tuple[str, list[str], str]:
    """Unit of a speed, by the header or by the speed of the track, doubts and evidence."""
    unit, doubts, evidence = signal.unit, [], signal.column.said
    if not unit and known.speed is not None:
        ratio = float(np.nanmedian(known.speed / np.where(signal.values > 0, signal.values, np.nan)))
        unit = min(SPEEDS, key=lambda one: abs(math.log(max(ratio, 1e-9) / SPEEDS[one])))
        evidence += f"; {ratio:.3g} m/s of the track for each of it"
        if abs(math.log(ratio / SPEEDS[unit])) > 0.2:
            doubts.append(f"{unit} is only the nearest unit to that")
    if not unit:
        unit = ASK
        doubts.append("nothing shows whether it is in m/s or kn; write the unit in place of ?")
    return unit, doubts, evidence


def _log_entry(signal: Signal, known: Known) -> Entry:
    """The speed log."""
    unit, doubts, evidence = _speed(signal, known)
    if signal.role != "stw":
        doubts.append("taken as speed through the water; with a course over ground it could be over ground")
    keys = {"speed": quoted(signal.column.head), "unit": quoted(unit)}
    return Entry("log", keys | ({"file": quoted(signal.file)} if signal.file else {}), Answer(evidence, tuple(doubts)))
