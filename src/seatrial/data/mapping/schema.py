"""The mapping file, `seatrial-mapping/1`: its tables and keys as values, checked before any log is read.

docs/data.md has an example of every key.
"""

from __future__ import annotations

from typing import Literal

from ...core.values import dataclass, field
from ..sidecar import Described

Words = tuple[str, ...]
Angle = Literal["deg", "rad", "cdeg", "mrad", "gon", "mil"]
Offset = tuple[float, ...]
"""Place aboard from midship [m]: forward, starboard; empty for midship itself."""


@dataclass(frozen=True)
class Column:
    """Where a channel comes from: `(sign * column + offset) * unit`, the offset in the unit of the column."""

    column: str
    unit: str
    offset: float = 0.0
    sign: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """What every instrument may have.

    Attributes:
        file: its own file, where a trial is several (`Files`); None for the file of the rows.
        lag: its values are late by so much [s].
        interpolate: how its values come to the times of the rows: straight lines, the nearest, or the last one held.
        limit: longest distance between two values that a line joins, or from a value to a row that takes it [s]; beyond
            is a gap.  None for 2.5 times the median step of its values, and 1 s at least where values are held.
    """

    file: str | None = None
    lag: float = 0.0
    interpolate: Literal["linear", "nearest", "hold"] = "linear"
    limit: float | None = None


@dataclass(frozen=True)
class Channel(Column, Sensor):
    """A channel of the trial: `(sign * scale * letter * column + offset) * unit`.

    Attributes:
        scale: factor of the column.
        letters: factor by the letter beside the number, `{ P = -1, S = 1 }` for "12.3 S"; of a word alone the value,
            `{ Midships = 0, "HALF AHEAD" = 0.6 }`.
        letter: column of the letter, where it is one of its own.
        despite: unit that the table gives, where it is wrong and `unit` is right.
    """

    scale: float = 1.0
    letters: dict[str, float] = field(default_factory=dict[str, float])
    letter: str | None = None
    despite: str | None = None


@dataclass(frozen=True)
class Clock:
    """The time of the rows: `(column + offset) * unit`, or what a format says.

    Attributes:
        column: numbers or texts of the time; left out with `step`.
        unit: of numbers; of `offset` (s by default).
        offset: added.
        sort: rows are put in the order of their times, and of rows that are the same one is kept.
        step: of a table without a clock, from row to row [s].
        format: None for numbers since some start, "iso" (ISO 8601, also with / or a blank), "clock" (hh:mm:ss of the
            day), "seconds of the day", "epoch" (since 1970), "gps" (seconds of the week), days as MATLAB ("datenum"),
            a spreadsheet ("excel") or astronomers ("julian", "mjd") count them, or a pattern such as
            "%d.%m.%Y %H:%M:%S".
        zone: of times without one: "UTC", "+02:00", "Europe/Oslo"; "unknown" where nobody knows it.
        date: column of the date, or several of its parts, joined with `column` by blanks.
        week: column of the GPS week, and how often it began anew at 1024 (`rollover`).
        nanoseconds: column of the nanoseconds after those of `column`.
        fraction: "ns" where the digits after the dot count nanoseconds without leading zeros: 5.42 is 5.000000042 s.
    """

    column: str = ""
    unit: str | None = None
    offset: float = 0.0
    sort: bool = False
    step: float | None = None
    format: str | None = None
    zone: str | None = None
    date: str | Words | None = None
    week: str | None = None
    rollover: int = 0
    nanoseconds: str | None = None
    fraction: Literal["decimal", "ns"] = "decimal"

    @property
    def parts(self) -> Words:
        """Columns of the date."""
        return () if self.date is None else (self.date,) if isinstance(self.date, str) else self.date


@dataclass(frozen=True)
class Frame:
    """Axes of the columns of u and v_m."""

    velocity: Literal["body", "earth"] = "body"


@dataclass(frozen=True)
class Position(Sensor):
    """Latitude and longitude, to x and y of midship.

    Attributes:
        latitude, longitude: columns; the same one where its cells hold both: 35 10.5N 139 42.1E, 35.175, 139.702, or
            POINT(139.702 35.175).
        first: which of two bare numbers of a cell is the first.
        format: 63.44, 6326.47 or 63 26 28.3, radians, or whole numbers of 1e-7 deg; letters N, S, E, W and the signs
            of degrees, minutes, seconds are read.  "utm" where the columns are northings and eastings of a zone [m].
        zone: of UTM, such as 32N: its number, and the half of the earth or the letter of its band.
        latitude_minutes, longitude_minutes: columns of the minutes, where those of the degrees are whole.
        latitude_letter, longitude_letter: columns of the letters, where they are columns of their own.
        antenna: its place aboard.
        datum: latitude and longitude [deg] where x and y are zero; empty for the first fix.
    """

    latitude: str
    longitude: str
    format: Literal["deg", "ddmm.mmm", "dms", "rad", "1e-7 deg", "utm"] = "deg"
    first: Literal["latitude", "longitude"] = "latitude"
    zone: str | None = None
    latitude_minutes: str | None = None
    longitude_minutes: str | None = None
    latitude_letter: str | None = None
    longitude_letter: str | None = None
    antenna: Offset = ()
    datum: Offset = ()


@dataclass(frozen=True)
class Ground(Sensor):
    """Speed over ground of an antenna, to u and v_m of midship: speed and course, or its parts north and east.

    Attributes:
        speed, course: columns.
        north, east: columns, in their place.
        unit, course_unit: of the speeds, and of the course.
        despite: unit of the speeds that the table gives, where it is wrong.
        antenna: its place aboard.
    """

    speed: str | None = None
    course: str | None = None
    north: str | None = None
    east: str | None = None
    unit: str = "m/s"
    course_unit: Angle = "deg"
    despite: str | None = None
    antenna: Offset = ()


@dataclass(frozen=True)
class Log(Sensor):
    """Speed through the water, to u (and v_m, where it has a course through the water) without the current.

    Attributes:
        speed, course: columns.
        unit, course_unit: of the speed, and of the course.
        despite: as of `Ground`.
        place: of the log aboard.
    """

    speed: str
    course: str | None = None
    unit: str = "m/s"
    course_unit: Angle = "deg"
    despite: str | None = None
    place: Offset = ()


@dataclass(frozen=True)
class Apparent(Sensor):
    """The wind on board, to U_A and gamma_A, and with heading and speeds to the true wind U_T, gamma_T.

    Attributes:
        speed, direction: columns; the direction is where it comes from, from the bow to starboard.
        unit, direction_unit: of both.
        despite: as of `Ground`.
        sign: of the direction; -1 where it grows to port.
        towards: whether the direction is where the wind goes to.
        offset: added to the direction, in its unit: of a vane that is not mounted straight ahead.
        letters, letter: of the direction, as those of a channel: `{ P = -1, S = 1 }`.
        mast: place of the anemometer.
    """

    speed: str
    direction: str
    unit: str = "m/s"
    direction_unit: Angle = "deg"
    despite: str | None = None
    sign: float = 1.0
    towards: bool = False
    offset: float = 0.0
    letters: dict[str, float] = field(default_factory=dict[str, float])
    letter: str | None = None
    mast: Offset = ()


@dataclass(frozen=True)
class Heading(Sensor):
    """The heading as a quaternion, to psi.

    Attributes:
        quaternion: columns of x, y, z, w.
        frame: "ned" for axes north, east, down and forward, starboard, down; "enu" for east, north, up and forward,
            port, up.
        offset: added to psi [deg].
    """

    quaternion: Words
    frame: Literal["ned", "enu"] = "ned"
    offset: float = 0.0


@dataclass(frozen=True)
class Files:
    """The files of one trial.

    Attributes:
        pattern: of `join = "time"` the file whose times are the rows, of "rows" the pieces; from the folder of the
            trial, with `*`, `?`, and `{trial}` for the name of the trial, which else is that of the folder.
        join: "time" for topics with times of their own, "rows" for one log cut over files.
        step: even rows in place of the times of the file [s].
        clocks: clocks of files that differ from `time`, by file.
    """

    pattern: str
    join: Literal["time", "rows"] = "time"
    step: float | None = None
    clocks: dict[str, Clock] = field(default_factory=dict[str, Clock])


@dataclass(frozen=True)
class Cut:
    """A trial cut out of a log.

    Attributes:
        name: of the trial.
        start, stop: first and last time, keys `from` and `to`: t [s], or a text in the manner of the clock.
        log: stem of the file or name of the folder it is cut from, where there are several.
        kind, set_points: for the sidecar.
    """

    name: str
    start: float | str = field(metadata={"key": "from"})
    stop: float | str = field(metadata={"key": "to"})
    log: str | None = None
    kind: str | None = None
    set_points: dict[str, float | str] = field(default_factory=dict[str, float | str])


@dataclass(frozen=True)
class Split:
    """Where a log is divided into trials: `column` changes, or time leaps by more than `gap` [s].

    Attributes:
        scattered: the rows of a word of `column` are one trial wherever they are, as of ships that take turns.
    """

    column: str | None = None
    gap: float | None = None
    scattered: bool = False


@dataclass(frozen=True)
class Long:
    """A long table: a row has a time, the name of a quantity, and its value; columns of the mapping are names.

    Attributes:
        name: columns of the name; those of several are joined by a dot.
        value: column of the value.
        unit: column of its unit.
        hold: names whose value is written when it changes, and holds until the next.
    """

    name: Words
    value: str
    unit: str | None = None
    hold: Words = ()


@dataclass(frozen=True, kw_only=True)
class Mapping(Described):
    """A mapping file.

    Attributes:
        time: the clock.
        channels: columns of the channels, by channel.
        frame: the axes of the velocities.
        position, ground, log, apparent, heading: instruments that give no channel of a trial as it is.
        files: the files of one trial; None for one file.
        long: of a table of one value a row; None for one of a column a quantity.
        trial, split: where a log is divided.
        delimiter: what separates cells; "whitespace" for any white space.
        decimal: the decimal mark.
        thousands: mark between groups of three digits, as in 6,650,000.00.
        encoding: of the text; None for that of the byte-order mark, else UTF-8.
        skip: lines before the header.
        footer: lines after the last row, empty ones not counted.
        columns: names of the columns of a table without a header, in their order; "" for one that is not read.
        units_row: rows of units after the header; true is 1.
        sheet: of a workbook, or structure of a file of arrays; None for the first, "*" where each one that has a column
            of the mapping is a trial.
        missing: words of a missing value, beside the empty cell, nan, na and null.
        duplicates: which of the rows of one time counts; "spread" lays them evenly up to the next time.
    """

    time: Clock
    channels: dict[str, Channel] = field(default_factory=dict[str, Channel])
    frame: Frame = Frame()
    position: Position | None = None
    ground: Ground | None = None
    log: Log | None = None
    apparent: Apparent | None = None
    heading: Heading | None = None
    files: Files | None = None
    long: Long | None = None
    trial: tuple[Cut, ...] = ()
    split: Split = Split()
    delimiter: str = ","
    decimal: Literal[".", ","] = "."
    thousands: Literal["", ",", ".", "'", " "] = ""
    encoding: str | None = None
    skip: int = 0
    footer: int = 0
    columns: Words = ()
    units_row: bool | int = False
    sheet: str | None = None
    missing: Words = ()
    duplicates: Literal["refuse", "first", "last", "mean", "spread"] = "refuse"

    @property
    def separator(self) -> str | None:
        """What separates cells; None for white space."""
        return None if self.delimiter == "whitespace" else self.delimiter
