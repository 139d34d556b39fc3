"""Logs of NMEA 0183 sentences.

A line may begin with a TAG block, whose time ``c:`` counts, or with the logger's own stamp: seconds, or a
date and time such as 2026-11-21T10:00:00.250Z.  A line that has lost its stamp gets that of the lines before and
after where these have the same one, and is left out elsewhere.  Where most lines have none, RMC, GGA or ZDA
give the time, and the sentences of one kind between two of them are spread evenly.  Rows are those of the instrument
with the most readings (heading, position or rate of turn); other readings go to the nearest row, and a row without
one is a gap.

A mapping file states where the instruments are.  ``LOG.toml`` beside the log ``LOG``, which the wire writes with its
logs, is one; every key may be left out:

    schema = "seatrial-nmea/1"
    antenna = { forward = 12.5, starboard = -2.0 }   # m from midship
    log = { forward = 60.0 }
    mast = { forward = -50.0 }                       # of the anemometer
    datum = { latitude = 35.0, longitude = 139.5 }   # else the first fix
    L_pp = 150.0
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from ...core.files import write_whole
from .. import Array, DataError, Trial, unwrapped
from ..geodesy import Datum
from ..nmea.framing import TOKEN, read_line
from ..nmea.readings import readings
from ..nmea.sentences import NmeaError, decode
from ..prepare import nearest_rows
from ..sidecar import CONVENTIONS, UNPLACED, Described, read_described
from ..table import existing

name = "nmea"
suffixes = (".nmea",)
_SCHEMA = "seatrial-nmea/1"
_LONGEST = 128
"""Bytes of a sentence in a log: receivers with many digits exceed the 82 of the standard."""

_STAMP = re.compile(
    r"^\s*(?:(\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d(?:\.\d+)?)(Z|[+-]\d\d:?\d\d)?|(\d{1,13}(?:\.\d*)?))[\s,;]*$"
)
_START = re.compile(rb"[\\$!]")
_DAY = 86400.0
_MILLISECONDS = 1e11

_PLAIN = ("U_A", "gamma_A", "U_T", "gamma_T", "U_C", "gamma_C", "depth", "phi", "theta", "x", "y")
"""Readings that are channels as they are."""

Series = tuple[Array, Array]
"""Times [s] and values of one quantity, in the order of time."""


@dataclass(frozen=True)
class Place:
    """Place of an instrument, from midship [m]; false at midship itself."""

    forward: float = 0.0
    starboard: float = 0.0

    def __bool__(self) -> bool:
        return bool(self.forward or self.starboard)


@dataclass(frozen=True)
class Aboard(Described):
    """Where the instruments of a log are, and what its mapping file states of the trials.

    Attributes:
        antenna, log, mast: places of the GNSS receiver's antenna, of the speed log and of the anemometer; None for an
            antenna of which the file says nothing.
        datum: where x and y are zero; None for the first fix.
    """

    antenna: Place | None = None
    log: Place = Place()
    mast: Place = Place()
    datum: Datum | None = None

    @property
    def place(self) -> tuple[float, float] | None:
        """Place of the antenna, forward and to starboard [m]; None where it is not stated."""
        return None if self.antenna is None else (self.antenna.forward, self.antenna.starboard)


def read_mapping(path: Path) -> Aboard:
    """Read the mapping file of an NMEA log."""
    return read_described(path, Aboard, _SCHEMA)


def beside(source: Path) -> Path:
    """Where the mapping file of a log itself is, if it has one."""
    return source.with_name(f"{source.name}.toml")


def aboard_of(source: Path, mapping: Path | None = None) -> Aboard:
    """Where the instruments of a log are: by its mapping file, or by the one beside it."""
    own = beside(source)
    return read_mapping(mapping or own) if mapping is not None or own.is_file() else Aboard()


def write_aboard(
    source: Path, antenna: tuple[float, float], log: tuple[float, float], mast: tuple[float, float]
) -> None:  # fmt: skip
    """Write the mapping file beside a log: places of its instruments, forward and to starboard of midship [m]."""
    places = {"antenna": antenna, "log": log, "mast": mast}
    said = [f"{name} = {{ forward = {forward:.9g}, starboard = {starboard:.9g} }}"
            for name, (forward, starboard) in places.items()]  # fmt: skip
    write_whole(beside(source), "\n".join([f'schema = "{_SCHEMA}"', *said]) + "\n")


def read(source: Path, mapping: Aboard | None = None) -> Trial:
    """Read one log; without a mapping by the one beside it."""
    return trial_of(source, _read_log(source), mapping or aboard_of(source), "NMEA 0183 sentences")


def trial_of(source: Path, log: Log, aboard: Aboard, what: str) -> Trial:
    """The trial of readings of instruments, whatever told them; `what` is a word for the processing steps."""
    t, raw, steps = _on_rows(source, log)
    steps = [f"imported from {what}: {', '.join(sorted(raw))}", *log.steps, *steps]
    channels: dict[str, Array] = {}
    psi = unwrapped(raw["psi"]) if "psi" in raw else np.full(len(t), math.nan)
    r = raw["r"] if "r" in raw else _rate(t, psi, steps)
    if "psi" in raw:
        channels["psi"] = psi
    datum = _positions(channels, raw, psi, aboard, steps)
    _velocities(channels, raw, psi, r, aboard, steps)
    channels["r"] = r
    controls(channels, raw, steps)
    _around(channels, raw, psi, r, aboard.mast)
    where = {} if datum is None else {"datum": asdict(datum)}
    begun = {} if log.epoch is None else {
        "start": datetime.fromtimestamp(log.epoch + float(t[0]), UTC).isoformat(timespec="microseconds")}  # fmt: skip
    meta = {**CONVENTIONS, **begun, **where, **aboard.meta, "lines": dict(log.lines), "processing": steps}
    known = {name: values for name, values in channels.items() if np.isfinite(values).any()}
    # floats hold seconds since 1970 to a quarter of a microsecond
    return Trial(source.stem, np.round(t - t[0], 6), known, {}, meta)


def _rate(t: Array, psi: Array, steps: list[str]) -> Array:
    if np.isfinite(psi).sum() < 2:
        return np.full(len(t), math.nan)
    steps.append("no ROT: r by central differences of psi")
    return np.gradient(psi, t)


def _positions(
    channels: dict[str, Array], raw: Mapping[str, Array], psi: Array, aboard: Aboard, steps: list[str]
) -> Datum | None:
    if "latitude" not in raw or "longitude" not in raw:
        return aboard.datum
    latitude, longitude = raw["latitude"], raw["longitude"]
    good = np.flatnonzero(np.isfinite(latitude + longitude))
    if not good.size:
        return aboard.datum
    datum = aboard.datum or Datum(float(latitude[good[0]]), float(longitude[good[0]]))
    x, y = datum.track(latitude, longitude)
    if aboard.antenna is None:
        steps.append(UNPLACED)
    elif aboard.antenna:
        forward, starboard = aboard.antenna.forward, aboard.antenna.starboard
        c, s = np.cos(psi), np.sin(psi)
        x, y = x - (c * forward - s * starboard), y - (s * forward + c * starboard)
        steps.append(f"x, y from the antenna to midship: {forward:g} m forward, {starboard:g} m to starboard")
    channels["x"], channels["y"] = x, y
    return datum


def _velocities(
    channels: dict[str, Array], raw: Mapping[str, Array], psi: Array, r: Array, aboard: Aboard, steps: list[str]
) -> None:
    """Velocities over ground at midship: by VBW, else by course and speed of the antenna."""
    if "u_log" in raw and "v_log" in raw:
        channels["u"], channels["v_m"] = _from(aboard.log, raw["u_log"], raw["v_log"], r)
    elif "U_G" in raw and "gamma_G" in raw:
        channels["u"], channels["v_m"] = _ground(raw, psi, r, aboard)
        steps.append("u, v_m from course and speed over ground, turned by psi")
    if "u_log_water" in raw:
        channels["u_w"] = _from(aboard.log, raw["u_log_water"], raw["u_log_water"], r)[0]
    if "U_G" in raw and "gamma_G" in raw:
        channels["U_G"], channels["gamma_G"] = raw["U_G"], unwrapped(raw["gamma_G"])
        if aboard.antenna:
            u, v = _ground(raw, psi, r, aboard)
            channels["U_G"], channels["gamma_G"] = np.hypot(u, v), unwrapped(psi + np.arctan2(v, u))


def _ground(raw: Mapping[str, Array], psi: Array, r: Array, aboard: Aboard) -> tuple[Array, Array]:
    """Velocity over ground of midship, ahead and to starboard, by course and speed of the antenna [m/s]."""
    drift = raw["gamma_G"] - psi
    return _from(aboard.antenna or Place(), raw["U_G"] * np.cos(drift), raw["U_G"] * np.sin(drift), r)


def _from(place: Place, u: Array, v: Array, r: Array) -> tuple[Array, Array]:
    """Velocity of midship, ahead and to starboard, from that of a place aboard [m/s]."""
    return u + place.starboard * r if place.starboard else u, v - place.forward * r if place.forward else v


def controls(channels: dict[str, Array], raw: Mapping[str, Array], steps: list[str]) -> None:
    """Rudders and shafts, numbered port to starboard where there are several; engines where the log has no shaft."""
    for name in ("delta", "delta_cmd"):
        starboard, port = raw.get(name), raw.get(name.replace("delta", "delta_port"))
        suffix = name.removeprefix("delta")
        if port is not None and starboard is not None:
            channels[f"delta_1{suffix}"], channels[f"delta_2{suffix}"] = port, starboard
        elif starboard is not None:
            channels[name] = starboard
    shafts = [name for name in raw if name.startswith("rpm_")]
    of = "rpm_S_" if any(name.startswith("rpm_S_") for name in shafts) else "rpm_E_"
    numbers = [int(name.removeprefix(of)) for name in shafts if name.startswith(of)]
    if shafts and of == "rpm_E_":
        steps.append("revolutions are those of the engine; the shaft is taken to turn as fast")
    elif len(numbers) < len(shafts):
        steps.append("revolutions are those of the shaft; those of the engine are left out")
    for place, number in enumerate(sorted(numbers, key=lambda k: k if k % 2 else -k), 1):
        channels["n_P" if len(numbers) == 1 else f"n_P_{place}"] = raw[f"{of}{number}"] / 60.0


def _around(channels: dict[str, Array], raw: Mapping[str, Array], psi: Array, r: Array, mast: Place) -> None:
    for name in raw:
        if name in _PLAIN or name.startswith("throttle_"):
            channels[name] = unwrapped(raw[name]) if name == "gamma_C" else raw[name]
    if "U_A" in raw and "gamma_A" in raw and mast:
        channels["U_A"], channels["gamma_A"] = felt_at_midship(raw["U_A"], raw["gamma_A"], r, mast)
    if "gamma_T_bow" in raw:
        channels["gamma_T"] = np.mod(raw["gamma_T_bow"] + psi, 2.0 * math.pi)


def felt_at_midship(U_A: Array, gamma_A: Array, r: Array, mast: Place) -> tuple[Array, Array]:
    """The apparent wind without what the mast itself moves as the ship turns: speed [m/s] and direction [rad]."""
    ahead, aside = _from(mast, U_A * np.cos(gamma_A), U_A * np.sin(gamma_A), r)
    return np.hypot(ahead, aside), np.mod(np.arctan2(aside, ahead), 2.0 * math.pi)


@dataclass
class Log:
    """Readings of a log by quantity, before they are on rows.

    Attributes:
        series: readings by the names of `nmea.readings.readings`.
        steps: what was done or left out, in words.
        epoch: seconds since 1970 at time 0 of the series, where the log has the date.
        lines: how many lines the log has (``all``), how many of them are no valid sentence (``invalid``), and how
            many sentences are left out because they have no time (``untimed``).
    """

    series: dict[str, Series]
    steps: list[str] = field(default_factory=list[str])
    epoch: float | None = None
    lines: Mapping[str, int] = field(default_factory=dict[str, int])


@dataclass
class _Reading:
    """The readings of one line, its own time stamp, and the kind of its sentence."""

    values: Mapping[str, float]
    stamp: float | None
    kind: str = ""


def _read_log(path: Path) -> Log:
    """Readings of a log by quantity.

    Raises:
        DataError: not readable, more invalid lines than sentences, or no time.
    """
    try:
        data = existing(path).read_bytes()
    except OSError as error:
        raise DataError(f"{path}: not readable: {error.strerror}") from None
    lines = data.replace(TOKEN, b"").splitlines()
    found, wrong, steps = _read_lines(path, lines)
    counts = {"all": len(lines), "invalid": wrong, "untimed": 0}
    stamped = sum(one.stamp is not None for one in found)
    if 2 * stamped < len(found):
        if stamped:
            steps.append(f"stamps of lines left aside: {len(found) - stamped} of {len(found)} lines have none")
        steps.append("time by the clock in RMC, GGA or ZDA")
        midnights: Counter[float] = Counter()
        series = _sorted(_by_clock(path, found, midnights), steps)
        # a receiver that has just started may send a factory date: the most frequent date counts
        return Log(series, steps, midnights.most_common(1)[0][0] if midnights else None, counts)
    timed = _by_stamp(found)
    if stamped < len(found):
        counts["untimed"] = len(found) - len(timed)
        steps.append(
            f"{len(found) - stamped} of {len(found)} sentences have no stamp: {len(timed) - stamped} of them get that "
            f"of the lines around them, {len(found) - len(timed)} are left out"
        )
    first = min(t for t, _ in timed)
    return Log(_sorted(timed, steps), steps, 0.0 if first > _DAY * 365 else None, counts)


def _read_lines(path: Path, lines: list[bytes]) -> tuple[list[_Reading], int, list[str]]:
    found: list[_Reading] = []
    others: Counter[str] = Counter()
    wrong, first = 0, ""
    for number, line in enumerate(lines, 1):
        start = _START.search(line)
        if start is None:
            if line.strip() and not line.lstrip().startswith(b"#"):
                wrong, first = wrong + 1, first or f"line {number}: no sentence"
            continue
        try:
            framed = read_line(line[start.start() :].strip())
            sentence = decode(framed.sentence, _LONGEST)
            said = readings(sentence)
        except NmeaError as error:
            if error.reason == "kind":
                others[framed_kind(line)] += 1
            else:
                wrong, first = wrong + 1, first or f"line {number}: {error}"
            continue
        tagged = framed.tag.time if framed.tag else None
        stamp = tagged if tagged is not None else _stamp(line[: start.start()])
        found.append(_Reading(said, stamp, f"{sentence.talker}{sentence.kind}"))
    if len(found) <= wrong:
        said = f"; {first}" if first else ""
        raise DataError(f"{path}: {len(found)} sentences, {wrong} lines that are none; is it a log of NMEA 0183?{said}")
    steps = [f"{wrong} of {len(lines)} lines are no valid sentence, the first: {first}"] if wrong else []
    if others:
        steps.append("left out: " + ", ".join(f"{count} {kind}" for kind, count in sorted(others.items())))
    return found, wrong, steps


def framed_kind(line: bytes) -> str:
    """The letters of a sentence that is not supported, such as VDM, for a message."""
    found = re.search(rb"[$!](P[A-Z]{3}|[A-Z]{2}([A-Z]{3}))", line)
    return (found[2] or found[1]).decode() if found else "other"


def _stamp(prefix: bytes) -> float | None:
    found = _STAMP.match(prefix.decode("latin-1"))
    if found is None:
        return None
    if found[3]:
        value = float(found[3])
        return value / 1000.0 if value > _MILLISECONDS else value
    try:
        said = datetime.fromisoformat(found[1] + (found[2] or "").replace("Z", "+00:00"))
    except ValueError:
        return None
    return (said if said.tzinfo else said.replace(tzinfo=UTC)).timestamp()


def _by_stamp(found: list[_Reading]) -> list[tuple[float, Mapping[str, float]]]:
    """Times by the stamps; a line without one has that of its neighbours where both are the same, or is left out."""
    after: list[float | None] = []
    following: float | None = None
    for one in reversed(found):
        after.append(following)
        following = one.stamp if one.stamp is not None else following
    timed: list[tuple[float, Mapping[str, float]]] = []
    before: float | None = None
    for one, later in zip(found, reversed(after), strict=True):
        if one.stamp is not None:
            before = one.stamp
            timed.append((one.stamp, one.values))
        elif before is not None and before == later:
            timed.append((before, one.values))
    return timed


def _by_clock(
    path: Path, found: list[_Reading], midnights: Counter[float]
) -> Iterable[tuple[float, Mapping[str, float]]]:
    """Times by the clock sentences, since 0 o'clock of the first day; their dates are counted in `midnights`."""
    groups: list[tuple[float, list[_Reading]]] = []
    early: list[_Reading] = []
    for one in found:
        clock = one.values.get("time_of_day")
        if clock is not None:
            last = groups[-1][0] if groups else clock
            # the clock restarts at midnight
            days = round((last - clock) / _DAY)
            clock += _DAY * days
            if "day" in one.values:
                midnights[one.values["day"] - _DAY * days] += 1
            if not groups or clock > last:
                groups.append((clock, early if not groups else []))
        (groups[-1][1] if groups else early).append(one)
    if len(groups) < 2:
        stamped = sum(one.stamp is not None for one in found)
        raise DataError(
            f"{path}: no time: a TAG block with c: or a stamp on {stamped} of {len(found)} lines, and "
            f"{len(groups)} times in RMC, GGA, ZDA"
        )
    ends = [*(t for t, _ in groups[1:]), 2.0 * groups[-1][0] - groups[-2][0]]
    for (start, group), end in zip(groups, ends, strict=True):
        # a quantity that two kinds of sentence tell, such as RMC and GGA, is told twice, not twice as often
        many = Counter((one.kind, name) for one in group for name in one.values)
        seen: Counter[tuple[str, str]] = Counter()
        for one in group:
            for name, value in one.values.items():
                this = one.kind, name
                yield start + (end - start) * seen[this] / many[this], {name: value}
                seen[this] += 1


def _sorted(timed: Iterable[tuple[float, Mapping[str, float]]], steps: list[str]) -> dict[str, Series]:
    """Series in the order of time; of two readings at one time the later line counts."""
    raw: dict[str, dict[float, float]] = {}
    again = 0
    for t, values in timed:
        for name, value in values.items():
            if name not in ("time_of_day", "day"):
                kept = raw.setdefault(name, {})
                again += t in kept and kept[t] != value
                kept[t] = value
    if again:
        steps.append(f"{again} readings at the time of another one of their kind: the later one counts")
    out: dict[str, Series] = {}
    for name, kept in raw.items():
        times = np.array(sorted(kept), dtype=np.float64)
        out[name] = times, np.array([kept[t] for t in times.tolist()], dtype=np.float64)
    return out


def _on_rows(path: Path, log: Log) -> tuple[Array, dict[str, Array], list[str]]:
    """Row times and the quantities on them; NaN where a row has no reading.

    Raises:
        DataError: fewer than two readings of heading, position and rate of turn.
    """
    base = max(("psi", "latitude", "r", "x"), key=lambda name: len(log.series.get(name, ((), ()))[0]))
    if len(log.series.get(base, ((), ()))[0]) < 2:
        raise DataError(f"{path}: no heading (HDT, THS), position (RMC, GGA) or rate of turn (ROT) to make rows of")
    t = log.series[base][0]
    reach = 0.5 * float(np.median(np.diff(t))) * (1.0 + 1e-9)
    out: dict[str, Array] = {}
    farthest = 0.0
    for name, (times, values) in log.series.items():
        out[name], away = nearest_rows(t, times, values, reach)
        farthest = max(farthest, away)
    steps = [f"readings moved to the nearest row, by {farthest:.3g} s at most"] if farthest > 1e-6 else []
    return t, out, steps
