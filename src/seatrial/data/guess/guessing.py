"""The guess: a folder of logs to the text of a mapping file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np

from ...core.values import dataclass, replace
from .. import Array, DataError
from ..importing import recognised
from ..mapping.tables import NUMBERED
from ..recognise import recognise, sentences
from ..table import existing
from .answers import ASK, DOUBT, Answer, Entry, listed, quoted, text_of
from .cells import Column
from .clock import an_hour_back, coarse, half_a_day_back
from .entries import (
    Known,
    control_entries,
    in_degrees,
    in_its_unit,
    known_motion,
    motion_entries,
    once_named,
    other_entries,
)
from .helm import with_rudder
from .logs import Log, Topic, bridged, find_log, leap
from .motion import TIMES, Motion, Verdict, speeds_of, with_units
from .roles import Signal, pointed, sided, signals, somewhere, strangers, trial_column
from .rows_of_names import long_entry
from .thrust import halves_of_rudder, neglected, thrust_entries, unplaced
from .wind import read_two_winds, read_wind, wind_entries, wind_pairs

_OTHERS = 8
_SHOWN = 12
_SLOW = 5.0
_BY_NAMES = "names alone are followed"
_REACH, _DELAY, _LONGEST = 2.5, 1.0, 30.0
"""Steps of a topic that a line spans, the delay [s] that one may have, and how long an order holds [s]."""

_ROWS, _FEW = 600, 400
"""Rows that the tests look at, and those of other trials for a second opinion."""

_MOVING, _MOSTLY = 0.3, 0.9
"""Part of the most speed at which a ship is under way, and part of such rows in which it goes astern throughout."""

_EXCHANGED = 0.6
"""The heading is in the column of the course where its misses are below this part of those as named."""


@dataclass(frozen=True)
class Guess:
    """What a folder holds.

    Attributes:
        format: name of the reader that takes it.
        text: of the mapping file; empty where the reader needs none.
        doubts: of the mapping.
        asks: keys whose value is "?".
        notes: on what was found, for the reader of a screen.
    """

    format: str
    text: str = ""
    doubts: tuple[str, ...] = ()
    asks: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def guess(src: str | Path) -> Guess:
    """Guess the mapping of a log or of a folder of logs.

    Raises:
        DataError: nothing there that is a table or a known log, or tables that cannot be told apart.
    """
    here = Path(src)
    known = reader_of(here)
    if known is not None and not known.tabular:
        return _of_numbers(here, known) if known.format in _ROBOTS else Guess(known.format, notes=(known.said,))
    log = find_log(here)
    columns = [column for topic in (log.main, *log.topics) for column in topic.columns]
    tables = [topic.table for topic in (log.main, *log.topics)]
    entries = [_reaching(log, in_its_unit(columns, once_named(tables, one))) for one in _entries(log)]
    # what the entries name, where the names of all columns are not meant
    text = " ".join(value for one in entries for key, value in one.keys.items() if key != "columns")
    entries += [one for topic in (log.main, *log.topics, *log.unread) for one in neglected(topic.columns, text)]
    if not {"position", "channels.x", "channels.y"} & {one.table for one in entries}:
        entries += unplaced(columns, text)
    if not any(one.table.startswith("channels.") or one.table in _SOURCES for one in entries):
        raise DataError(f"{log.main.table.path}: {_nothing(log)}")
    notes = [*log.notes, *([known.said] if known else [])]
    head = ["A mapping for `seatrial import csv`, guessed; correct what is wrong.",
            f"A comment that begins with {DOUBT} names what the log does not show; a value \"{ASK}\" must be answered.",
            *notes, *_left_out(log, text)]  # fmt: skip
    entries = [*map(_templated(log), entries), *_clocks(log)]
    doubts = tuple(f"{_place(one)}: {doubt}" for one in entries for doubt in one.answer.doubts)
    asks = tuple(f"{one.table}.{key}" if one.table else key for one in entries for key in one.asked)
    return Guess(
        "csv",
        text_of(head, [Entry("", {"schema": quoted("seatrial-mapping/1")}), *entries]),
        doubts,
        asks,
        tuple(notes),
    )


_SOURCES = ("position", "ground", "log", "apparent", "heading")
_ROBOTS = ("mcap", "rosbag2", "rosbag1", "ulog", "tlog")


def _of_numbers(src: Path, known: Reader) -> Guess:
    """A mapping of the bare numbers of the longest log, where there are any that are not known by themselves."""
    from ..formats import formats, recordings
    from ..robot.guessed import numbers_of

    largest = max(recordings(known.format, src), key=_bytes)
    lines, unknown = numbers_of(largest, formats()[known.format].read)
    if not lines and not unknown:
        return Guess(known.format, notes=(known.said,))
    head = [f"# A mapping for `seatrial import {known.format}`, guessed by {largest.name}; correct what is wrong.",
            *(f"# {DOUBT} {one}" for one in unknown), "", 'schema = "seatrial-robot/1"', "", "[numbers]"]  # fmt: skip
    doubts = (*unknown, *(f"{one.at}: {doubt}" for one in lines for doubt in one.doubts))
    return Guess(known.format, "\n".join([*head, *(one.text for one in lines)]) + "\n", doubts)


def _bytes(path: Path) -> int:
    return sum(one.stat().st_size for one in (path.rglob("*") if path.is_dir() else (path,)))


def _nothing(log: Log) -> str:
    """Why a table gives no channel, and what to do."""
    if all(map(NUMBERED.fullmatch, log.main.table.heads)):
        return (f"{len(log.main.table.heads)} columns without names; write a mapping that names them in their order: "
                'columns = ["t", "psi", ...]')  # fmt: skip
    heads = ", ".join(one.said for one in log.main.columns[:_SHOWN])
    return f"no column is known as a quantity of a ship's motion ({heads}); write a mapping (docs/data.md)"


def _reaching(log: Log, entry: Entry) -> Entry:
    """The entry of a topic with how far its values reach: orders hold until the next, lines go over usual delays."""
    topic = next((one for one in log.topics if quoted(one.name) == entry.keys.get("file")), None)
    if topic is None or topic.clock is None:
        return entry
    steps = np.diff(np.sort(topic.clock.t[np.isfinite(topic.clock.t)]))
    usual, most = float(np.median(steps)), float(np.max(steps))
    held = entry.table.endswith("_cmd")
    keys = {**entry.keys, **({"interpolate": quoted("hold")} if held else {})}
    if held or most > _REACH * usual:
        keys["limit"] = f"{min(most, _LONGEST if held else max(_REACH * usual, _DELAY)):.3g}"
    return replace(entry, keys=keys)


def _templated(log: Log) -> Callable[[Entry], Entry]:
    """Names of files that begin with that of the trial, as those of any trial."""
    before, there, after = log.pattern.partition("{trial}")
    name = log.main.name.removeprefix(before).removesuffix(after) if there else ""

    def change(entry: Entry) -> Entry:
        file = entry.keys.get("file", "")
        return replace(entry, keys={**entry.keys, "file": file.replace(name, "{trial}", 1)}) if name and file else entry

    return change


def _clocks(log: Log) -> Iterator[Entry]:
    """The clocks of files that have another one than the rows; a program writes the digits of all its files alike."""
    alike = None if log.main.clock is None or log.main.table.long else {**log.main.clock.keys, "fraction": ""}
    for one in log.topics:
        if one.clock is not None and alike and {**one.clock.keys, "fraction": ""} != alike:
            file = _templated(log)(Entry("", {"file": quoted(one.name)})).keys["file"]
            answer = replace(one.clock.answer, evidence=f"{', '.join(one.clock.heads)}: {one.clock.answer.evidence}")
            yield Entry(f"files.clocks.{file}", dict(one.clock.keys), answer)


def _place(entry: Entry) -> str:
    """Where in the mapping an entry stands."""
    return entry.table or next(iter(entry.keys), "the folder")


def _entries(log: Log) -> Iterator[Entry]:
    yield from _table_entries(log)
    t, found = _quantities(log)
    times = log.main.clock.units if log.main.clock else ()
    found, verdict, exchanged = _judged(t, found, times)
    yield _time_entry(log, verdict)
    if verdict.lost:
        doubt = f"track, heading and speeds fit together in no reading (within {verdict.lost:.0%} at best); {_BY_NAMES}"
        yield Entry("", {}, Answer("", (doubt,)))
    for entry in motion_entries(found, verdict, _letters(log)):
        if exchanged and entry.table == "channels.psi":
            doubt = "the columns of heading and course are exchanged: this one is where the ship points"
            entry = replace(entry, answer=replace(entry.answer, doubts=(*entry.answer.doubts, doubt)))
        yield entry
    yield from _second_opinion(log, verdict, exchanged)
    known = known_motion(verdict, _scaled(t, verdict), found)
    found = with_rudder(found, known.t, known.r)
    if known.u is not None and (np.abs(known.u) > _MOVING * np.nanmax(np.abs(known.u), initial=0.0)).any():
        going = known.u[np.abs(known.u) > _MOVING * np.nanmax(np.abs(known.u))]
        if (going < 0.0).mean() > _MOSTLY:
            doubt = "by its heading the ship goes astern: where it went ahead, the bow is the stern: offset = 180 (deg)"
            yield Entry("", {}, Answer("", (doubt,)))
    angles = {verdict.best.choice[key] for key in ("unit of psi",) if key in verdict.best.choice}
    turned = not (
        verdict.sure("sense of psi") and verdict.sure("sense of r") and verdict.sure("frame of the quaternion")
    )
    yield from control_entries(found, known, angles, turned)
    yield from thrust_entries(found, known)
    yield from halves_of_rudder(found)
    changes = [said for said, doubted in (("it is turned to the other side if the sense of psi is", turned),
        ("its sense rests on the frame of speeds, which is a doubt; look at it again if that changes",
         not verdict.sure("frame of speeds")),
    ) if doubted]  # fmt: skip
    for entry in _wind_entries(found, known):
        doubts = tuple(changes) if entry.answer.evidence else ()
        yield replace(entry, answer=replace(entry.answer, doubts=(*entry.answer.doubts, *doubts)))
    yield from other_entries(found, known, angles)


def _quantities(log: Log) -> tuple[Array, Mapping[str, Signal]]:
    """Time of the rows and the quantities on them; those of no known name among them where the motion tells them."""
    every = pointed(log.t, in_degrees(somewhere(_with_letters(log), log.main.columns)), log.main.columns)
    t, found = _once(log.t[log.piece], {**every, **strangers(every, log.main.columns)}, log.piece)
    return t, with_units(t, bridged(t, found))


def _with_letters(log: Log) -> dict[str, Signal]:
    """The quantities of the log, with the letters that any of its files has beside their numbers."""
    out = dict(log.found)
    for role, signal in log.found.items():
        letters = dict(signal.column.letters)
        for topic in log.others:
            for column in topic.columns:
                letters |= column.letters if column.head == signal.column.head else {}
        if letters != signal.column.letters:
            out[role] = replace(signal, column=replace(signal.column, letters=letters))
    return out


def _once(t: Array, found: Mapping[str, Signal], piece: slice) -> tuple[Array, dict[str, Signal]]:
    """Time and quantities of one trial, without rows that repeat or go back in time."""
    high = np.maximum.accumulate(np.nan_to_num(t, nan=-np.inf))
    rows = np.flatnonzero(np.isfinite(t) & np.concatenate([[True], t[1:] > high[:-1]]))
    return t[rows], {role: one.rows(piece, rows) for role, one in found.items()}


def _scaled(t: Array, verdict: Verdict) -> Array:
    return t * TIMES[verdict.best.choice.get("unit of time", "s")]


def _judged(
    t: Array, found: Mapping[str, Signal], times: tuple[str, ...], rows: int = _ROWS
) -> tuple[Mapping[str, Signal], Verdict, bool]:  # fmt: skip
    """The verdict on the motion, also with heading and course exchanged where both are there."""
    verdict = Motion(t, found, times, rows).verdict()
    if "heading" in found and (speeds_of(found) or ("",))[-1] == "cog":  # a course alone is where the track goes
        turned = {**found, "heading": found["cog"], "cog": found["heading"]}
        other = Motion(t, turned, times, rows).verdict()
        if not other.lost and other.best.miss < _EXCHANGED * (verdict.lost or verdict.best.miss) - 0.01:
            return turned, other, True
    return found, verdict, False


def _letters(log: Log) -> dict[str, str]:
    """Columns of N and S, of E and W, beside latitude and longitude."""
    out: dict[str, str] = {}
    for column in log.main.columns:
        held = {cell.strip().upper() for cell in column.cells} - {""}
        for key, known in (("latitude_letter", {"N", "S"}), ("longitude_letter", {"E", "W"})):
            if held and held <= known:
                out.setdefault(key, column.head)
    return out


def _second_opinion(log: Log, verdict: Verdict, ours: bool) -> Iterator[Entry]:
    """Doubts where other trials of the folder, alike by their columns, are read better in another way."""
    for other in log.others[:_OTHERS] if log.join == "time" else ():
        if other.clock is None:
            continue
        t, found = _once(other.clock.t, in_degrees(sided(signals(other.columns, other.clock.heads))), slice(None))
        _, its, exchanged = _judged(t, found, other.clock.units, _FEW)
        differs = [
            key
            for key, said in its.best.choice.items()
            if verdict.best.choice.get(key, said) != said and its.measured(key)
        ]
        if exchanged != ours or differs:
            what = (f"{', '.join(differs)} differ there" if exchanged == ours else
                    "heading and course are the other way round there")  # fmt: skip
            yield Entry("", {}, Answer("", (f"{other.name}: {what}; give it a mapping of its own",)))


def _table_entries(log: Log) -> Iterator[Entry]:
    """Keys of the layout, of repeated rows, of several files and of several trials."""
    yield _layout_entry(log)
    if beside := log.main.table.beside:
        doubt = f"sheets {', '.join(map(quoted, beside))} are tables too; a mapping of their own with sheet reads them"
        yield Entry("", {}, Answer("", (doubt,)))
    for said in log.main.table.apart:
        yield Entry("", {}, Answer("", (f"not read: {said}",)))
    if (long := log.main.table.long) is not None:
        yield long_entry(long)
    yield from _repeats(log)
    if log.pattern:
        keys = {"pattern": quoted(log.pattern), "join": quoted(log.join)}
        yield Entry("files", keys, Answer("the files of one trial"))
    column = trial_column(log.main.columns, log.t)
    if log.ship:
        keys = {"column": quoted(log.ship), "scattered": "true"}
        yield Entry("split", keys, Answer(f"'{log.ship}' says whose row it is: a trial of each; the rest is of one"))
    elif column is not None:
        yield Entry("split", {"column": quoted(column.head)}, Answer(f"{column.said} numbers the trials of one file"))
    elif (gap := leap(log.t)) is not None:
        yield Entry("split", {"gap": f"{gap:g}"}, Answer("time leaps between the trials of one file [s]"))


def _layout_entry(log: Log) -> Entry:
    """Keys of the layout: those that differ from the defaults."""
    layout = log.main.table.layout
    # a file of plain letters is in any encoding
    encodings = [one.table.layout.encoding for one in (log.main, *log.others)]
    encoding = next((one for one in encodings if one not in ("utf-8-sig", "utf-16")), "")
    words = sorted({word for topic in (log.main, *log.topics, *log.others)
                    for column in topic.columns if column.kind != "text" for word in column.missing})  # fmt: skip
    rows = (
        ("encoding", encoding and quoted(encoding), f"the text is {encoding}"),
        ("delimiter", layout.delimiter != "," and quoted(layout.delimiter), ""),
        ("decimal", layout.decimal != "." and quoted(layout.decimal), ""),
        ("thousands", layout.thousands and quoted(layout.thousands), "groups of three digits have a mark"),
        ("skip", layout.skip and str(layout.skip),
         f"{layout.skip} lines before the {'rows' if layout.named else 'header'}"),
        ("columns", layout.named and listed(log.main.table.heads), "the header alone does not tell columns apart"),
        ("footer", layout.footer and str(layout.footer), f"{layout.footer} lines after the last row"),
        ("units_row", layout.units_row and "true", "the row below the header has units"),
        ("sheet", layout.sheet and quoted(layout.sheet), ""),
        ("missing", words and listed(words), "words among the numbers are taken as gaps"),
    )
    keys = {key: value for key, value, _ in rows if isinstance(value, str) and value}
    return Entry("", keys, Answer("; ".join(said for key, _, said in rows if key in keys and said)))


def _repeats(log: Log) -> Iterator[Entry]:
    """What to do with rows of the same time, in any of the files."""
    if trial_column(log.main.columns, log.t) is not None:
        return
    count, same, often = 0, True, False
    for topic in (log.main, *log.topics, *log.others):
        if topic.clock is None:
            continue
        order = np.argsort(topic.clock.t, kind="stable")
        repeats = np.flatnonzero(np.diff(topic.clock.t[order]) == 0.0)
        columns = [column for column in topic.columns if column.kind in ("number", "letters")]
        pairs = [(order[k], order[k + 1]) for k in repeats.tolist()[:500]]
        same &= all(column.cells[a] == column.cells[b] for column in columns for a, b in pairs)
        often |= repeats.size > 0.1 * order.size
        count += repeats.size
    if not count:
        return
    evidence = f"{count} rows repeat the time of another, " + ("all with its values" if same else "with other values")
    if often and not same and coarse(log.t):
        doubt = "the clock is coarser than the rows, which are laid evenly from each of its times to the next"
        yield Entry("", {"duplicates": quoted("spread")}, Answer(evidence, (doubt,)))
        return
    doubts = () if same else ("the clock is coarser than the rows, or stepped back; \"first\", \"last\" and \"mean\" "
                              "say which of them counts",)  # fmt: skip
    yield Entry("", {"duplicates": quoted("mean" if often and not same else "first")}, Answer(evidence, doubts))


def _time_entry(log: Log, verdict: Verdict) -> Entry:
    clock = log.main.clock
    if clock is None:
        doubt = "no column is a clock; write the name of the one that is, and its unit"
        near = next((one for one in log.main.columns if one.kind in ("iso", "stamp", "clock")), None)
        if near is not None:
            cell = next(cell for cell in near.cells if cell.strip())
            doubt = (
                f"{near.said} has times that are not read, such as '{cell}'; "
                f"write column = {quoted(near.head)} and "
                'their pattern, such as format = "%Y-%m-%dT%H:%M:%S CEST" with zone = "+02:00", in place of unit'
            )
        return Entry("", {"time": f'{{ column = "{ASK}", unit = "s" }}'}, Answer("", (doubt,)))
    keys, answer = dict(clock.keys), clock.answer
    unit = verdict.best.choice.get("unit of time")
    if unit is not None:
        keys["unit"] = quoted(unit)
        told = verdict.told("unit of time")
        step = float(np.nanmedian(np.diff(log.t[log.piece])))
        unsaid = not verdict.measured("unit of time") and (unit != "s" or step > _SLOW)
        doubts = (f"its unit is not said anywhere; in s the step would be {step:g} s",) if unsaid else ()
        answer = Answer(f"{answer.evidence}; {told}" if told else answer.evidence, (*answer.doubts, *doubts))
    rest = [other for other in _others(log.main) if other.head not in clock.heads]
    if rest:
        answer = replace(answer, evidence=f"{answer.evidence}; not {', '.join(one.said for one in rest)}")
    back = int((np.diff(log.t) < 0).sum())
    if back == 1 and half_a_day_back(log.t):
        doubt = "it goes back by 12 hours, as a clock without AM and PM: add 12 hours from there on, or cut the log"
        answer = replace(answer, doubts=(*answer.doubts, doubt))
    elif back == 1 and "zone" in keys and an_hour_back(log.t):
        doubt = ('it goes back by an hour, as at the end of summer time: write the zone, such as "Europe/Oslo"; of a '
                 'log that was joined in disorder zone = "unknown" and sort = true')  # fmt: skip
        keys["zone"], answer = quoted(ASK), replace(answer, doubts=(*answer.doubts, doubt))
    elif back and trial_column(log.main.columns, log.t) is None:
        keys["sort"] = "true"
        answer = replace(answer, doubts=(*answer.doubts, f"{back} rows go back in time; sorted"))
    inside = ", ".join(f"{key} = {value}" for key, value in keys.items())
    return Entry(
        "", {"time": f"{{ {inside} }}"}, replace(answer, evidence=f"{', '.join(clock.heads)}: {answer.evidence}")
    )


def _others(topic: Topic) -> list[Column]:
    return [
        one
        for one in topic.columns
        if one.kind in ("iso", "stamp", "clock") or (one.score("time") > 0.9 and one.varies)
    ]


def _wind_entries(found: Mapping[str, Signal], known: Known) -> Iterator[Entry]:
    """Entries of the wind: where two instruments tell it, both are read as one wind."""
    pairs = wind_pairs(found)
    motion = None if known.psi is None or known.u is None or known.v is None else (known.psi, known.u, known.v)
    apparent = next((two for two in pairs if two[1] == "gamma_A"), None)
    true = next((two for two in pairs if two != apparent), None)
    if apparent and true and motion:
        for pair, verdict in zip((apparent, true), read_two_winds(found, apparent, true, motion), strict=True):
            yield from wind_entries(found, pair, verdict)
        return
    taken: set[bool] = set()
    for pair in pairs:
        verdict = read_wind(found, pair, motion)
        if verdict.best.relative not in taken:
            taken.add(verdict.best.relative)
            yield from wind_entries(found, pair, verdict)


def _left_out(log: Log, text: str) -> list[str]:
    """The columns that no entry names."""
    out: list[str] = []
    for topic in (log.main, *log.topics, *log.unread):
        rest = [column.head if column.varies or not np.isfinite(column.values).any()
                else f"{column.head} (always {np.nanmedian(column.values):g})"
                for column in topic.columns if quoted(column.head) not in text]  # fmt: skip
        more = f" and {len(rest) - _SHOWN} more" * (len(rest) > _SHOWN)
        out += [f"columns left out of {topic.name}: {', '.join(rest[:_SHOWN])}{more}"] if rest else []
    return out


@dataclass(frozen=True)
class Reader:
    """A reader of `seatrial import`.

    Attributes:
        format: its name.
        said: one line for the user.
        tabular: whether the logs are tables, of which a mapping may be written as well.
    """

    format: str
    said: str
    tabular: bool


def reader_of(src: Path) -> Reader | None:
    """The reader that takes a log or a folder without a mapping; None where none does.

    Raises:
        DataError: no such path, or a file of a format that is not read; what converts it is named.
    """
    here = existing(src)
    files = [here] if here.is_file() else sorted(path for path in here.rglob("*") if path.is_file())
    bags = [path.parent for path in files if path.name == "metadata.yaml" and b"rosbag2" in path.read_bytes()[:200]]
    if bags:
        return _said("rosbag2", here, "a recording of ROS 2", False)
    if any(path.suffix.lower() == ".mcap" for path in files):
        return _said("mcap", here, "MCAP files", False)
    known = next(filter(None, map(recognise, files)), None)
    if known is not None and known.format:
        return _said(known.format, here, known.name, False)
    if known is not None and here.is_file():
        raise DataError(f"{here}: {known.told(here)}")
    for path in files:
        if sentences(path):
            return _said("nmea", here, "NMEA 0183 sentences", False)
    for path in files:
        try:
            format = recognised(path)
        except DataError:
            continue
        if format:
            return _said(format, here, "the columns of a public set", format != "simman")
    return None


def _said(format: str, src: Path, what: str, tabular: bool) -> Reader:
    return Reader(format, f"{what}: seatrial import {format} {src} -o DIR reads them without a mapping", tabular)
