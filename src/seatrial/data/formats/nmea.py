"""Logs of NMEA 0183 sentences.

Sentences are read as devices write them (`nmea.heard`).  The time of a fix is the one that its sentence carries, and a
fix that several sentences tell is one; other sentences have the time of the TAG block before them or of the logger's
own stamp (`nmea.stamping`), or lie between the fixes around them (`nmea.clocks`).  A clock that goes back
parts a log into pieces, a trial each; where one of them is too short for a trial, the log is refused.
Each quantity is taken from one source, talker and kind, in the order of `nmea.sources`, and what the others say is
told.  Rows are those of the instrument with the most readings (heading, position or rate of turn); other readings go to
the nearest row, and a row without one is a gap.

A mapping file states where the instruments are.  ``LOG.toml`` beside the log ``LOG``, which the wire writes with its
logs, is one; every key may be left out:

    schema = "seatrial-nmea/1"
    antenna = { forward = 12.5, starboard = -2.0 }   # m from midship
    log = { forward = 60.0 }
    mast = { forward = -50.0 }                       # of the anemometer
    datum = { latitude = 35.0, longitude = 139.5 }   # else the first fix
    variation = 3.5                                  # deg, east positive, of a magnetic compass
    gear = 2.0                                       # turns of the engine for one of the shaft
    prefer = { heading = "HEHDT", position = "GPGGA" }
    L_pp = 150.0
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...core.errors import TrackError
from ...core.files import write_whole
from ...core.parameters import unknown
from ...core.values import asdict, dataclass, field, replace
from .. import UNITS, Array, DataError, Trial, unwrapped
from ..geodesy import Datum
from ..n2k.groups import finished
from ..nmea.clocks import ROLL, Spoken, Timed, parted, timed
from ..nmea.copies import once, shared
from ..nmea.lines import Lines, listen
from ..nmea.readings import KINDS
from ..nmea.sources import GROUPS, Choice, Series, chosen
from ..nmea.stamping import unit_of
from ..prepare import nearest_rows
from ..sidecar import CONVENTIONS, UNPLACED, Described, read_described

name = "nmea"
suffixes = (".nmea",)
_SCHEMA = "seatrial-nmea/1"

_PLAIN = ("U_A", "gamma_A", "U_T", "gamma_T", "U_C", "gamma_C", "depth", "phi", "theta", "x", "y")
"""Readings that are channels as they are."""
_SHARES = ("throttle", "steering")
"""Beginnings of the names of orders that are a share of the greatest one, -1 to 1; such readings are channels too."""


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
        variation: of a magnetic compass, east positive [deg]; it counts before what sentences say.
        gear: turns of the engine for one of the shaft, where no shaft tells its own.
        prefer: source (talker and kind) of a quantity, by the names of `nmea.sources.GROUPS`.
    """

    antenna: Place | None = None
    log: Place = Place()
    mast: Place = Place()
    datum: Datum | None = None
    variation: float | None = None
    gear: float | None = None
    prefer: Mapping[str, str] = field(default_factory=dict[str, str])

    @property
    def place(self) -> tuple[float, float] | None:
        """Place of the antenna, forward and to starboard [m]; None where it is not stated."""
        return None if self.antenna is None else (self.antenna.forward, self.antenna.starboard)


def read_mapping(path: Path) -> Aboard:
    """Read the mapping file of an NMEA log."""
    found = read_described(path, Aboard, _SCHEMA)
    if found.gear is not None and not 0.0 < found.gear < math.inf:
        raise DataError(f"{path}: gear is {found.gear:g}; it is turns of the engine for one of the shaft, above zero")
    return found


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
    """Read the only trial of one log; without a mapping by the one beside it.

    Raises:
        DataError: also for a log whose clock goes back, which is several.
    """
    return only(read_all(source, mapping), source)


def read_all(source: Path, mapping: Aboard | None = None) -> tuple[Trial, ...]:
    """Read one log; where its clock goes back, each piece is a trial."""
    aboard = mapping or aboard_of(source)
    trials = [trial_of(source, log, aboard, "NMEA 0183 sentences") for log in _read_log(source, aboard)]
    return numbered(trials)


def numbered(trials: Sequence[Trial]) -> tuple[Trial, ...]:
    """Trials of one log, named by numbers where there are several."""
    if len(trials) == 1:
        return tuple(trials)
    return tuple(replace(one, name=f"{one.name}_{k}") for k, one in enumerate(trials, 1))


def only(trials: Sequence[Trial], source: Path) -> Trial:
    """The trial of a log that is one.

    Raises:
        DataError: its clock goes back, and it is several.
    """
    if len(trials) != 1:
        raise DataError(f"{source}: its clock goes back, which makes {len(trials)} trials of it; import it first "
                        "(seatrial import)")  # fmt: skip
    return trials[0]


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
    controls(channels, raw, steps, aboard.gear)
    _around(channels, raw, psi, r, aboard.mast)
    channels |= {name: raw[name] for name in log.plain if name in raw}
    where = {} if datum is None else {"datum": asdict(datum)}
    begun = {} if log.epoch is None else {
        "start": datetime.fromtimestamp(log.epoch + float(t[0]), UTC).isoformat(timespec="microseconds")}  # fmt: skip
    sources = {one.group: str(one) for one in log.choices}
    made = {}
    if "r" not in raw and np.isfinite(r).any():
        made = {"derived": {"r": "psi"}}
        sources["rate of turn"] = "central differences of psi, no measurement of its own"
    meta = {
        **CONVENTIONS, **begun, **where, **aboard.meta, "lines": dict(log.lines), "processing": steps,
        "sources": sources, "ignored": dict(log.ignored), **made,
    }  # fmt: skip
    known = {name: values for name, values in channels.items() if np.isfinite(values).any()}
    units = {name: unit for name in known if name not in UNITS and (unit := _unit(name, log.plain))}
    return Trial(source.stem, np.round(t - t[0], log.digits), known, units, meta)


def _unit(name: str, plain: Mapping[str, str]) -> str:
    """Unit of a numbered control, and of what has no standard one; empty where the name has one."""
    if name in plain:
        return plain[name]
    stems = ("delta_", "rad"), ("n_P_", "1/s"), *((one, "-") for one in _SHARES)
    return next((unit for stem, unit in stems if name.startswith(stem)), "")


def _rate(t: Array, psi: Array, steps: list[str]) -> Array:
    if np.isfinite(psi).sum() < 2:
        return np.full(len(t), math.nan)
    steps.append("no ROT: r by central differences of psi")
    known = np.isfinite(psi)
    r = np.full(len(t), math.nan)
    r[known] = np.gradient(psi[known], t[known])
    return r


def _positions(
    channels: dict[str, Array], raw: Mapping[str, Array], psi: Array, aboard: Aboard, steps: list[str]
) -> Datum | None:
    if "latitude" not in raw or "longitude" not in raw:
        return aboard.datum
    latitude, longitude = raw["latitude"], raw["longitude"]
    none = (latitude == 0.0) & (longitude == 0.0)
    if none.any() and not none[np.isfinite(latitude)].all():
        steps.append(f"{int(none.sum())} fixes at 0 N, 0 E are none: a receiver writes them before its first")
        latitude, longitude = (np.where(none, math.nan, one) for one in (latitude, longitude))
    good = np.flatnonzero(np.isfinite(latitude + longitude))
    if not good.size:
        return aboard.datum
    first = Datum(float(latitude[good[0]]), float(longitude[good[0]]))
    if "x" in raw and "y" in raw:
        return aboard.datum or _zero(raw, good, first)
    datum = aboard.datum or first
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


def _zero(raw: Mapping[str, Array], fixed: NDArray[np.intp], first: Datum) -> Datum:
    """Where positions in metres are zero, by the first fix beside one."""
    both = fixed[np.isfinite(raw["x"][fixed] + raw["y"][fixed])]
    if not both.size:
        return first
    k = int(both[0])
    return Datum.seeing(float(raw["latitude"][k]), float(raw["longitude"][k]), float(raw["x"][k]), float(raw["y"][k]))


def _velocities(
    channels: dict[str, Array], raw: Mapping[str, Array], psi: Array, r: Array, aboard: Aboard, steps: list[str]
) -> None:
    """Velocities over ground at midship: by VBW, else by course and speed of the antenna."""
    if "u_log" in raw and "v_log" in raw:
        channels["u"], channels["v_m"] = _from(aboard.log, raw["u_log"], raw["v_log"], r)
    elif "U_G" in raw and "gamma_G" in raw and np.isfinite(psi).any():
        channels["u"], channels["v_m"] = _ground(raw, psi, r, aboard)
        steps.append("u, v_m from course and speed over ground, turned by psi")
    if "u_log_water" in raw:
        channels["u_w"] = _from(aboard.log, raw["u_log_water"], raw["u_log_water"], r)[0]
    if "U_G" in raw and "gamma_G" not in raw:
        channels["U_G"] = raw["U_G"]
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


def controls(
    channels: dict[str, Array], raw: Mapping[str, Array], steps: list[str], gear: float | None = None
) -> None:  # fmt: skip
    """Rudders and shafts, numbered port to starboard where there are several; engines where the log has no shaft."""
    for name in ("delta", "delta_cmd"):
        starboard, port = raw.get(name), raw.get(name.replace("delta", "delta_port"))
        suffix = name.removeprefix("delta")
        if port is not None and starboard is not None:
            channels[f"delta_1{suffix}"], channels[f"delta_2{suffix}"] = port, starboard
        elif starboard is not None or port is not None:
            channels[name] = starboard if port is None else port  # type: ignore[assignment]
    shafts = [name for name in raw if name.startswith("rpm_")]
    of = "rpm_S_" if any(name.startswith("rpm_S_") for name in shafts) else "rpm_E_"
    numbers = [int(name.removeprefix(of)) for name in shafts if name.startswith(of)]
    turns = 60.0
    if shafts and of == "rpm_E_" and gear is not None:
        turns = 60.0 * gear
        steps.append(f"revolutions of the shaft by those of the engine and its gear, {gear:g} to 1")
    elif shafts and of == "rpm_E_":
        steps.append("doubt: revolutions are those of the engine, before its gear; the shaft is taken to turn as fast; "
                     "gear = 2.0 in a mapping (schema = \"seatrial-nmea/1\") says how often the engine turns for one "
                     "turn of the shaft")  # fmt: skip
    elif len(numbers) < len(shafts):
        steps.append("revolutions are those of the shaft; those of the engine are left out")
    for place, number in enumerate(sorted(numbers, key=lambda k: k if k % 2 else -k), 1):
        channels["n_P" if len(numbers) == 1 else f"n_P_{place}"] = raw[f"{of}{number}"] / turns


def _around(channels: dict[str, Array], raw: Mapping[str, Array], psi: Array, r: Array, mast: Place) -> None:
    for name in raw:
        if name in _PLAIN or name.startswith(_SHARES):
            channels[name] = unwrapped(raw[name]) if name == "gamma_C" else raw[name]
    if "U_A" in raw and "gamma_A" in raw and mast:
        channels["U_A"], channels["gamma_A"] = felt_at_midship(raw["U_A"], raw["gamma_A"], r, mast)
    if "gamma_T_bow" in raw:
        channels["gamma_T"] = np.mod(raw["gamma_T_bow"] + psi, 2.0 * math.pi)
    elif "gamma_T_ground" in raw:
        channels["U_T"], channels["gamma_T"] = raw["U_T_ground"], raw["gamma_T_ground"]


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
        choices: which source each quantity is from.
        ignored: number of sentences of each kind that nothing is read from.
        plain: readings that are channels as they are, beside those of instruments, with their units.
        base: reading whose times are the rows; empty for that with most readings.
        digits: of the seconds of the clock; floats hold seconds since 1970 to a quarter of a microsecond.
    """

    series: dict[str, Series]
    steps: list[str] = field(default_factory=list[str])
    epoch: float | None = None
    lines: Mapping[str, int] = field(default_factory=dict[str, int])
    choices: Sequence[Choice] = ()
    ignored: Mapping[str, int] = field(default_factory=dict[str, int])
    plain: Mapping[str, str] = field(default_factory=dict[str, str])
    digits: int = 6
    base: str = ""


def _read_log(path: Path, aboard: Aboard) -> list[Log]:
    """Readings of a log by quantity; of a log whose clock goes back those of each piece.

    Raises:
        DataError: not readable, more invalid lines than sentences, no time, or a clock that goes back.
    """
    read = listen(path)
    if read.sentences <= read.wrong:
        said = f"; {read.first}" if read.first else ""
        kinds = f" of a kind that is read ({', '.join(KINDS[:6])} ...)" if read.others else ""
        raise DataError(f"{path}: {read.sentences} sentences{kinds}, {read.wrong} lines that are none; "
                        f"is it a log of NMEA 0183?{said}")  # fmt: skip
    steps = [f"{read.wrong} of {read.all} lines are no valid sentence, the first: {read.first}"] if read.wrong else []
    if read.bare:
        steps.append(f"{read.bare} sentences have no checksum, and are taken as they are")
    if read.others:
        steps.append("left out: " + ", ".join(f"{count} {kind}" for kind, count in sorted(read.others.items())))
    found, unit = _in_seconds(read)
    if read.about:
        steps.append(f"stamps of lines: {unit or read.about}")
    if read.order:
        steps.append(read.order)
    found, copied = once(found)
    found, turns = shared(found)
    steps += [copied, *turns] if copied else turns
    pieces = parted(path, found, read.dated)
    return [_log(path, aboard, read, timed(path, one, read.dated), [*steps]) for one in pieces]


def _in_seconds(read: Lines) -> tuple[Sequence[Spoken], str]:
    """What was told, with its stamps in seconds, and the unit that they had where it was another one."""
    if read.dated or read.about != "seconds":
        return read.found, ""
    unit, word = unit_of([one.stamp for one in read.found])
    return [replace(one, stamp=unit * one.stamp) for one in read.found], word


def _anew(path: Path, when: Timed) -> list[str]:
    """A doubt where a date is so old, against the file, that the receiver may have counted its weeks anew."""
    begins = [float(t[0]) for one in when.told.values() for t, _ in one.values()]
    if when.epoch is None or not begins:
        return []
    began = when.epoch + min(begins)
    rolls = int((path.stat().st_mtime - began) // ROLL)
    if rolls < 1:
        return []
    told, real = (datetime.fromtimestamp(one, UTC).date() for one in (began, began + rolls * ROLL))
    return [f"doubt: the date is {told}, and the file is {rolls * 1024} weeks younger or more: a receiver that counts "
            f"the weeks of GPS anew tells that date on {real}"]  # fmt: skip


def _log(path: Path, aboard: Aboard, read: Lines, when: Timed, steps: list[str]) -> Log:
    """Readings whose times are known, from one source each."""
    steps += [*when.steps, *_anew(path, when)]
    told = true_headings(path, when.told, aboard, steps)
    ends = [float(t[k]) for one in told.values() for t, _ in one.values() for k in (0, -1)]
    series, choices = chosen(told, preferred(path, aboard, told), max(ends) - min(ends))
    renamed = finished(series)
    choices = [replace(one, group=renamed.get(one.group, one.group)) for one in choices]
    steps += [f"{one.group}: {one}" for one in choices if one.others]
    counts = {"all": read.all, "invalid": read.wrong, "untimed": when.untimed}
    return Log(series, steps, when.epoch, counts, choices, dict(sorted(read.others.items())))


def preferred(path: Path, aboard: Aboard, told: Mapping[str, object]) -> Mapping[str, str]:
    """The sources that the user prefers, which the log must have.

    Raises:
        DataError: an unknown quantity or source.
    """
    for group, source in aboard.prefer.items():
        if group not in GROUPS:
            raise DataError(f"{path}: prefer: {unknown(group, GROUPS, 'quantity')}")
        if source not in told:
            raise DataError(f"{path}: prefer.{group}: {unknown(source, told, 'source')}")
    return aboard.prefer


def true_headings(
    path: Path, told: Mapping[str, Mapping[str, Series]], aboard: Aboard, steps: list[str]
) -> dict[str, dict[str, Series]]:
    """Readings in which a magnetic compass tells true heading too, by the variation of the mapping or of the log.

    Raises:
        DataError: magnetic headings alone, and no variation.
    """
    out = {source: dict(one) for source, one in told.items()}
    magnetic = [source for source, one in out.items() if "psi_magnetic" in one]
    known = {source: one["variation"] for source, one in out.items() if "variation" in one}
    # a compass that has not been set tells 0: another one that is not 0 counts
    real = {source: one for source, one in known.items() if np.any(one[1] != 0.0)} or known
    if magnetic and aboard.variation is None and not real:
        if not any("psi" in one for one in out.values()):
            raise DataError(f"{path}: heading only from {', '.join(magnetic)}, which is magnetic, and no variation in "
                            "HDG or RMC; give it in a mapping: variation = 3.5 (deg, east positive)")  # fmt: skip
        magnetic = []
    for source in magnetic:
        t, values = out[source]["psi_magnetic"]
        if aboard.variation is not None:
            variation, by = np.full(len(t), math.radians(aboard.variation)), "of the mapping"
        else:
            giver = source if source in real else max(real, key=lambda one: len(real[one][0]))
            variation, by = np.interp(t, *real[giver]), f"by {giver}"
        if "psi" not in out[source]:
            out[source]["psi"] = t, np.mod(values + variation, 2.0 * math.pi)
            degrees = math.degrees(float(np.median(variation)))
            steps.append(f"{source}: magnetic heading and variation {by}, {degrees:+.3g} deg")
    for one in out.values():
        one.pop("psi_magnetic", None)
        one.pop("variation", None)
    return {source: one for source, one in out.items() if one}


def _on_rows(path: Path, log: Log) -> tuple[Array, dict[str, Array], list[str]]:
    """Row times and the quantities on them; NaN where a row has no reading.

    Raises:
        DataError: fewer than two readings of heading, position and rate of turn.
    """
    count = {name: len(log.series[name][0]) for name in ("psi", "latitude", "r", "x") if name in log.series}
    base = log.base if count.get(log.base, 0) > 1 else max(count, key=lambda name: count[name], default="psi")
    if len(log.series.get(base, ((), ()))[0]) < 2:
        others = [one for one in path.parent.glob(f"*{path.suffix}") if one != path]
        joined = "; where each device has a file: sort the lines of all by their stamps into one file" * bool(others)
        raise TrackError(f"{path}: no heading (HDT, THS, HDG, PASHR), position (RMC, GGA, GLL) or rate of turn (ROT) "
                         f"to make rows of{joined}")  # fmt: skip
    t = log.series[base][0]
    reach = 0.5 * float(np.median(np.diff(t))) * (1.0 + 1e-9)
    out: dict[str, Array] = {}
    farthest = 0.0
    for name, (times, values) in log.series.items():
        out[name], away = nearest_rows(t, times, values, reach)
        farthest = max(farthest, away)
    steps = [f"readings moved to the nearest row, by {farthest:.3g} s at most"] if farthest > 1e-6 else []
    return t, out, steps
