"""Reading of a mapping file, and refusal of one that cannot mean what it says, at its key."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from ...core.parameters import unknown
from .. import UNITS, DataError
from ..geodesy import Datum, zone_of
from ..sidecar import check_meta, read_described
from ..table import within
from ..units import KNOWN, conversion, of_thruster, standard_unit
from .clocks.calendar import DAYS, EPOCHS, offset_of
from .schema import Channel, Clock, Ground, Mapping, Position, Sensor
from .uses import uses

ASK = "?"
"""Value of a key that nothing in the log decides; whoever reads the mapping refuses it until a person has answered."""

_ASKED = re.compile(r"""(\w+)\s*=\s*["']\?["']""")
FORMATS = ("iso", "clock", "seconds of the day", "epoch", "gps", *DAYS)
"""How a column may tell the time."""
_DIRECTIVES = "YymdHMSfpabBjz%I"


def read_mapping(path: Path) -> Mapping:
    """Read and check a mapping file.

    Raises:
        DataError: what is wrong with it, and at which key.
    """
    _refuse_open(path)
    found = read_described(path, Mapping, "seatrial-mapping/1")
    with within(path):
        _check_table(found)
        for channel, column in found.channels.items():
            _check_channel(channel, column)
        for place, clock in _clocks(found):
            (_check_clock if clock.step is None else _check_step)(place, clock)
        _check_instruments(found)
        _check_files(found)
        _check_long(found)
        _check_trials(found)
        for one in found.trial:
            check_meta(Path(f"trial '{one.name}'"), {"kind": one.kind, "set_points": dict(one.set_points)})
        _refuse_twice(found)
    return found


def _refuse_open(path: Path) -> None:
    """Refuse a mapping file that still asks.

    Raises:
        DataError: naming the line and its key.
    """
    table = ""
    text = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
    for number, line in enumerate(text.splitlines(), 1):
        plain = line.partition("#")[0].strip()
        table = plain.strip("[]") if plain.startswith("[") else table
        found = _ASKED.search(plain)
        if found is not None:
            outer = table or (plain.partition("=")[0].strip() if "{" in plain else "")
            place = ".".join(part for part in (outer, found[1]) if part)
            raise DataError(f'{path}: line {number}: {place} is "{ASK}"; write the answer to the doubt above it')


def instruments(mapping: Mapping) -> Iterator[tuple[str, Sensor]]:
    """Every instrument of a mapping by its key."""
    yield from ((f"channels.{name}", one) for name, one in mapping.channels.items())
    for key in ("position", "ground", "log", "apparent", "heading"):
        one = getattr(mapping, key)
        if one is not None:
            yield key, one


def _check_table(found: Mapping) -> None:
    counts = found.skip, found.footer, found.units_row
    if not any(True for _ in instruments(found)) or not found.delimiter or min(counts) < 0:
        raise DataError("give one channel at least, a delimiter, and skip, footer and units_row of 0 or more")
    twice = next((name for k, name in enumerate(found.columns) if name and name in found.columns[:k]), None)
    if twice is not None:
        raise DataError(f"columns: '{twice}' is there twice; give each column a name of its own")
    if found.thousands and found.thousands == found.decimal:
        raise DataError(f"thousands and decimal are both '{found.decimal}'; leave thousands out")
    if found.delimiter == found.decimal:
        raise DataError(f"delimiter and decimal are both '{found.decimal}'; a table with decimal commas has another "
                        'delimiter, such as ";"')  # fmt: skip
    if found.frame.velocity == "earth" and not ({"u", "v_m"} <= set(found.channels) and _knows_heading(found)):
        raise DataError('frame.velocity = "earth" needs channels u (north), v_m (east) and psi')


def _knows_heading(found: Mapping) -> bool:
    return "psi" in found.channels or found.heading is not None


def _check_channel(name: str, column: Channel) -> None:
    place = f"channels.{name}"
    if name == "t":
        raise DataError(f"{place}: time has a table of its own, 'time'")
    if not name.isidentifier():
        raise DataError(f"{place}: a channel name is letters, digits and underscores")
    near = unknown(name, UNITS, "channel")
    if standard_unit(name) is None and not of_thruster(name) and "near:" in near:
        # a typing error would silently make an unused channel
        raise DataError(f"{place}: {near}")
    if column.sign not in (1.0, -1.0):
        raise DataError(f"{place}.sign is {column.sign:g}; it must be 1 or -1")
    if column.scale == 0.0:
        raise DataError(f"{place}.scale is 0; it must be another number")
    if column.letter is not None and not column.letters:
        raise DataError(f"{place}.letters is missing; {place}.letter names a column of letters")
    if column.despite is not None and column.despite not in KNOWN:
        raise DataError(f"{place}.despite: {unknown(column.despite, KNOWN, 'unit')}")
    conversion(name, column.unit)


def _clocks(found: Mapping) -> Iterator[tuple[str, Clock]]:
    yield "time", found.time
    yield from ((f'files.clocks."{f}"', clock) for f, clock in (found.files.clocks if found.files else {}).items())


def _check_clock(place: str, clock: Clock) -> None:
    if not clock.column:
        raise DataError(f"{place}.column is missing; a table without a clock has a step, in s")
    if clock.format is None:
        if clock.unit is None:
            raise DataError(f'{place}.unit is missing; a time that is no number has a format, such as format = "iso"')
        conversion("t", clock.unit)
        wrong = ("zone", "date", "week", "nanoseconds")
    elif clock.format in FORMATS:
        wrong = {"iso": ("week", "nanoseconds"), "clock": ("zone", "date", "week", "nanoseconds"),
                 "seconds of the day": ("zone", "date", "week", "nanoseconds"),
                 "epoch": ("zone", "date", "week"), "gps": ("zone", "date", "nanoseconds")}.get(
                     clock.format, ("date", "week", "nanoseconds"))  # fmt: skip
    else:
        _check_pattern(place, clock.format)
        wrong = ("week", "nanoseconds")
    said = next((key for key in wrong if getattr(clock, key) is not None), None)
    if said is not None:
        about = "numbers" if clock.format is None else f'format = "{clock.format}"'
        raise DataError(f"{place}.{said} is of no use with {about}; leave it out")
    if clock.format == "gps" and clock.week is None:
        raise DataError(f"{place}.week is missing; it names the column of the GPS week")
    if clock.format == "epoch" and (clock.unit or "s") not in EPOCHS:
        raise DataError(f"{place}.unit is '{clock.unit}'; Unix time is in {', '.join(EPOCHS)}")
    if clock.zone is not None and clock.zone != "unknown" and offset_of(clock.zone) is None:
        _check_zone(place, clock.zone)
    if clock.format not in (None, "epoch"):
        conversion("t", clock.unit or "s")


def _check_step(place: str, clock: Clock) -> None:
    """A table without a clock has a step and nothing else."""
    if not clock.step or clock.step <= 0.0:
        raise DataError(f"{place}.step is {clock.step}; it must be above 0 s")
    if clock != Clock(step=clock.step, offset=clock.offset):
        raise DataError(f"{place}.step is for a table without a clock; leave out the other keys, or step")


def _check_zone(place: str, zone: str) -> None:
    from zoneinfo import available_timezones

    known = available_timezones()
    if known and zone not in known:
        raise DataError(f"{place}.zone: {unknown(zone, sorted(known), 'zone')}; or +02:00, UTC, unknown")


def _check_pattern(place: str, pattern: str) -> None:
    found = re.findall(r"%(.?)", pattern)
    strange = next((one for one in found if one not in _DIRECTIVES or not one), None)
    if "%" not in pattern:
        about = unknown(pattern, FORMATS, "format")
        raise DataError(f'{place}.format: {about}; or a pattern such as "%d.%m.%Y %H:%M:%S"')
    if strange is not None:
        known = ", ".join(f"%{one}" for one in _DIRECTIVES)
        raise DataError(f"{place}.format: '%{strange}' is not read; known: {known}")
    hourly = set(found) - {"f", "%"} == {"M", "S"}  # of the hour alone, as spreadsheets cut times
    if not (hourly or ({"H", "I"} & set(found) and "M" in found)):
        raise DataError(f"{place}.format is '{pattern}'; it needs hours and minutes, %H and %M, or %M:%S alone")


def _check_instruments(found: Mapping) -> None:
    for place, one in instruments(found):
        if one.limit is not None and one.limit <= 0.0:
            raise DataError(f"{place}.limit is {one.limit:g}; it must be above 0 s")
        for key in ("antenna", "place", "mast"):
            if len(getattr(one, key, ())) not in (0, 2):
                raise DataError(f"{place}.{key} must be two numbers: m forward and m to starboard of midship")
    for place, one in (("ground", found.ground), ("log", found.log), ("apparent", found.apparent)):
        if one is not None:
            with within(f"{place}.unit"):
                conversion("u", one.unit)
    _check_sources(found)
    _check_need_of_heading(found)


def _check_sources(found: Mapping) -> None:
    """Refuse what instruments give and channels give too, and instruments without their columns."""
    place, heading = found.position, found.heading
    if place is not None:
        _check_place(place)
    if place is not None and {"x", "y"} & set(found.channels):
        raise DataError("position gives x and y, which channels gives too; keep one of them")
    if found.ground is not None:
        _check_ground(found.ground)
    if heading is not None and len(heading.quaternion) != 4:
        raise DataError("heading.quaternion must be four columns: x, y, z, w")
    if heading is not None and "psi" in found.channels:
        raise DataError("heading gives psi, which channels gives too; keep one of them")
    if found.apparent is not None and {"U_A", "gamma_A"} & set(found.channels):
        raise DataError("apparent gives U_A and gamma_A, which channels gives too; keep one of them")
    if found.apparent is not None and found.apparent.sign not in (1.0, -1.0):
        raise DataError(f"apparent.sign is {found.apparent.sign:g}; it must be 1 or -1")
    if found.apparent is not None and found.apparent.letter is not None and not found.apparent.letters:
        raise DataError("apparent.letters is missing; apparent.letter names a column of letters")


def _check_place(place: Position) -> None:
    beside = (place.latitude_minutes, place.longitude_minutes, place.latitude_letter, place.longitude_letter)
    if (place.latitude == place.longitude or place.format == "utm") and any(beside):
        raise DataError("position: columns of minutes and letters are of two columns of degrees; leave them out")
    if place.format == "utm" and place.latitude == place.longitude:
        raise DataError("position: northings and eastings are two columns")
    if place.first != "latitude" and place.latitude != place.longitude:
        raise DataError("position.first is of one column that holds both; exchange the two columns in its place")
    if (place.format == "utm") != (place.zone is not None):
        raise DataError('position.zone and format = "utm" go together; give both, or none')
    if place.zone is not None:
        with within("position.zone"):
            zone_of(place.zone)
    if place.datum:
        if len(place.datum) != 2:
            raise DataError("position.datum must be two numbers: latitude and longitude in degrees")
        with within("position.datum"):
            Datum(*place.datum)


def _check_ground(ground: Ground) -> None:
    given = tuple(key for key in ("speed", "course", "north", "east") if getattr(ground, key) is not None)
    if given not in (("speed", "course"), ("north", "east")):
        raise DataError("ground needs speed and course, or north and east")


def _check_need_of_heading(found: Mapping) -> None:
    if _knows_heading(found):
        return
    wants = {
        "position.antenna": found.position is not None and any(found.position.antenna),
        "ground": found.ground is not None and not {"u", "v_m"} <= set(found.channels),
        "log.course": found.log is not None and found.log.course is not None,
    }
    needing = next((key for key, wanted in wants.items() if wanted), None)
    if needing is not None:
        raise DataError(f"{needing} needs the heading: give channels.psi or heading")


def _check_files(found: Mapping) -> None:
    files = found.files
    if files is not None and found.sheet == "*":
        raise DataError('sheet = "*" makes each sheet a trial; it cannot stand beside files')
    named = {one.file: place for place, one in instruments(found) if one.file is not None}
    if files is None:
        if named:
            file, place = next(iter(named.items()))
            raise DataError(f"{place}.file is '{file}'; files.pattern must say which file has the rows")
        return
    for name in (files.pattern, *(name for name in named if name), *files.clocks):
        if name.startswith("/") or ".." in name.split("/") or "\\" in name or not name.strip("/"):
            raise DataError(f"files: '{name}' must be a path below the folder of a trial, with /")
        if "**" in name:
            raise DataError(f"files: '{name}' has '**'; a star is for one name, and a folder below is */")
    if files.join == "rows" and (named or files.clocks or files.step is not None):
        raise DataError('files.join = "rows" joins pieces of one log; file, clocks and step are of join = "time"')
    if files.step is not None and files.step <= 0.0:
        raise DataError(f"files.step is {files.step:g}; it must be above 0 s")
    stray = next((name for name in files.clocks if name not in named and name != files.pattern), None)
    if stray is not None:
        raise DataError(f"files.clocks: {unknown(stray, [n for n in named if n], 'file of a channel')}")


def _check_long(found: Mapping) -> None:
    long = found.long
    if long is None:
        return
    if not long.name:
        raise DataError("long.name is empty; it names the column of the names")
    if found.files is not None or found.sheet == "*" or found.split.column is not None or found.time.step is not None:
        raise DataError('long is of one table with a clock; it cannot stand beside files, sheet = "*", split.column or '
                        "time.step")  # fmt: skip
    wanted = {use.column for use in uses(found)}
    stray = next((name for name in long.hold if name not in wanted), None)
    if stray is not None:
        raise DataError(f"long.hold: {unknown(stray, sorted(wanted), 'column of the mapping')}")


def _check_trials(found: Mapping) -> None:
    split = found.split
    if split.gap is not None and split.gap <= 0.0:
        raise DataError(f"split.gap is {split.gap:g}; it must be above 0 s")
    if split.scattered and split.column is None:
        raise DataError("split.scattered is of split.column; leave it out")
    if split.column is not None and found.files is not None:
        raise DataError("split.column divides one file; it cannot stand beside files")
    if found.trial and (split.column is not None or split.gap is not None):
        raise DataError("trial and split both divide the log; keep one of them")
    seen: set[tuple[str | None, str]] = set()
    for k, one in enumerate(found.trial):
        if not re.fullmatch(r"[^\s./\\][^/\\]*", one.name):
            raise DataError(f"trial[{k}].name is '{one.name}'; it names a file, so it has no / and begins with no dot")
        if (one.log, one.name) in seen:
            raise DataError(f"trial[{k}].name is '{one.name}', as that of another trial; choose another")
        seen.add((one.log, one.name))
        if isinstance(one.start, float) and isinstance(one.stop, float) and one.start >= one.stop:
            raise DataError(f"trial[{k}] ('{one.name}'): from {one.start:g} to {one.stop:g}; 'to' must be later")


def _refuse_twice(found: Mapping) -> None:
    seen: dict[tuple[str | None, str], str] = {}
    main = found.files.pattern if found.files else None
    for use in uses(found):
        if use.key == "split.column":
            continue
        where = (None if use.file == main else use.file, use.column)
        if where in seen and use.key != "position.longitude":
            raise DataError(f"column '{use.column}' is used twice, by {seen[where]} and {use.key}; keep one of them")
        seen[where] = use.key
