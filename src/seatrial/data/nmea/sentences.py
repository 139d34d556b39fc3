"""NMEA 0183 (IEC 61162-1) sentences, strictly: an unknown or missing field is an error, and null stays null.

pynmeagps builds the sentences.  It would make 0.0 of a misspelt or missing field, so every field is first checked
against `SENTENCES`, by which sentences are read too.  `ship` has the meaning of the fields in SI and the signs of
docs/conventions.md.

`SENTENCES` lists the fields of each supported sentence, their order, and the values that they may hold.
Names and order of the fields are those of pynmeagps; N/S and E/W are not named, as latitude and
longitude carry their sign.  The values follow IEC 61162-1 as manuals of equipment
give it.  A field behind `least` may be absent: older equipment does not send it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from datetime import date
from functools import cache
from types import MappingProxyType
from typing import Any, Protocol

from ...core.errors import NmeaError
from ...core.parameters import unknown
from ...core.values import dataclass
from .. import DataError

LONGEST = 82
"""Characters of a sentence, from the dollar to the line feed, both counted."""

_FORM = re.compile(rb"\$([A-Z]{2})([A-Z]{3}),([ -)+-\[\]-}]*)\*([0-9A-Fa-f]{2})(?:\r?\n)?")
_OTHER = re.compile(rb"[$!][A-Z0-9]{3,15}(?:,[ -)+-\[\]-}]*)?\*([0-9A-Fa-f]{2})(?:\r?\n)?")
_TALKER = re.compile(r"[A-Z]{2}")


@dataclass(frozen=True)
class Sentence:
    """One sentence: talker ("HE"), kind ("HDT"), and fields by name; None is a null field."""

    talker: str
    kind: str
    fields: Mapping[str, Value]

    def __getitem__(self, name: str) -> Value:
        return self.fields[name]

    def number(self, name: str) -> float | None:
        """A numeric field; None where it is null."""
        value = self.fields[name]
        return float(value) if isinstance(value, float | int) else None


@cache
def _library() -> Any:
    try:
        import pynmeagps
    except ImportError:
        raise DataError("NMEA sentences need the extra 'nmea': pip install 'seatrial[nmea]'") from None
    return pynmeagps


def checksum(content: bytes) -> str:
    """Exclusive or of the bytes, as two hexadecimal digits."""
    total = 0
    for byte in content:
        total ^= byte
    return f"{total:02X}"


def encode(sentence: Sentence) -> bytes:
    """A sentence as it goes on the wire, with its checksum and CR LF.

    Raises:
        NmeaError: an unknown kind or field, a missing field (None is null), a value that cannot stand
            in its field, or more than 82 characters.
        DataError: pynmeagps is not installed.
    """
    kind = SENTENCES.get(sentence.kind)
    if kind is None:
        raise NmeaError(unknown(sentence.kind, SENTENCES, "sentence"), "kind")
    if not _TALKER.fullmatch(sentence.talker):
        raise NmeaError(f"{sentence.kind}: talker is '{sentence.talker}'; it has two capital letters", "form")
    for name in sentence.fields:
        if name not in kind.fields:
            raise NmeaError(f"{sentence.kind}: {unknown(name, kind.fields, 'field')}", "field")
    texts: list[str] = []
    for name, rule in kind.fields.items():
        if name not in sentence.fields:
            raise NmeaError(f"{sentence.kind}: field '{name}' is missing; None makes it null", "field")
        value = sentence.fields[name]
        text = ("," if isinstance(rule, Place) else "") if value is None else rule.text(value)
        if text is None:
            raise NmeaError(f"{sentence.kind}: field '{name}' cannot be {value!r}; it is {rule}", "field")
        texts += text.split(",") if isinstance(rule, Place) else [text]
    message = _library().NMEAMessage(sentence.talker, sentence.kind, 0, payload=texts)
    line: bytes = message.serialize()
    if len(line) > LONGEST:
        raise NmeaError(f"{sentence.kind}: {len(line)} characters; a sentence has {LONGEST} at most", "length")
    return line


def decode(line: bytes, longest: int = LONGEST) -> Sentence:
    """A sentence from one line, with or without its line end.

    Args:
        line: the bytes from the dollar on.
        longest: how many bytes are allowed; some receivers send more digits than the standard allows.

    Raises:
        NmeaError: whatever is not a valid sentence of a known kind; `reason` is its kind.
    """
    if len(line) > longest:
        raise NmeaError(f"{len(line)} characters; a sentence has {longest} at most", "length")
    found = _FORM.fullmatch(line)
    if found is None:
        raise _foreign(line)
    content, said = line[1 : found.start(4) - 1], found[4].decode().upper()
    if checksum(content) != said:
        raise NmeaError(f"checksum is {said}; that of the sentence is {checksum(content)}", "checksum")
    talker, kind = found[1].decode(), found[2].decode()
    if kind not in SENTENCES:
        raise NmeaError(unknown(kind, SENTENCES, "sentence"), "kind")
    return Sentence(talker, kind, _values(kind, found[3].decode().split(",")))


def _foreign(line: bytes) -> NmeaError:
    """Error of a line without the form of a supported sentence."""
    other = _OTHER.fullmatch(line)
    if other is None:
        return NmeaError("not the form $AACCC,...*hh of a sentence", "form")
    content = line[1 : other.start(1) - 1]
    if checksum(content) != other[1].decode().upper():
        return NmeaError(f"checksum is {other[1].decode()}; that of the sentence is {checksum(content)}", "checksum")
    return NmeaError("an encapsulated, proprietary or query sentence; seatrial does not read these", "kind")


def _values(name: str, texts: list[str]) -> dict[str, Value]:
    """Fields by name; those that an older sentence does not have are null."""
    kind = SENTENCES[name]
    out: dict[str, Value] = {}
    at = 0
    for number, (field, rule) in enumerate(kind.fields.items()):
        width = 2 if isinstance(rule, Place) else 1
        part = texts[at : at + width]
        if len(part) < width:
            if number < kind.least:
                raise NmeaError(f"{name}: {len(texts)} fields; '{field}' is missing", "field")
            out[field] = None
            continue
        at += width
        text = ",".join(part)
        out[field] = None if not text.strip(",") else rule.value(text)
        if out[field] is None and text.strip(","):
            raise NmeaError(f"{name}: field '{field}' is '{text}'; it is {rule}", "field")
    if at < len(texts):
        raise NmeaError(f"{name}: {len(texts)} fields; it has {at}", "field")
    return out


Value = float | int | str | date | None
"""What a field holds; None is a null field, which is not zero."""

_DECIMAL = re.compile(r"-?(?:\d{1,9}(?:\.\d{0,9})?|\.\d{1,9})")
_WHOLE = re.compile(r"\d{1,9}")
_TEXT = re.compile(r"[A-Za-z0-9 _./-]{1,20}")
_CLOCK = re.compile(r"([01]\d|2[0-3])([0-5]\d)([0-5]\d|60)(\.\d{1,6})?")
_DAY = re.compile(r"(\d\d)(\d\d)(\d\d)")
_PLACE = MappingProxyType({90: re.compile(r"(\d\d)([0-5]\d\.\d{1,9})"), 180: re.compile(r"(\d{3})([0-5]\d\.\d{1,9})")})


class Rule(Protocol):
    """What a field of a sentence may hold."""

    def text(self, value: Value) -> str | None:
        """How a value is written; None where it cannot stand in the field."""
        ...

    def value(self, text: str) -> Value:
        """What a text means; None where it means nothing."""
        ...


@dataclass(frozen=True)
class Number(Rule):
    """A decimal between limits; `circle` for a direction, where 360 is written as 0."""

    low: float
    high: float
    decimals: int
    circle: bool = False

    def text(self, value: Value) -> str | None:
        if not isinstance(value, float | int) or not math.isfinite(value) or not self.low <= value <= self.high:
            return None
        rounded = round(float(value), self.decimals)
        return f"{0.0 if self.circle and rounded >= 360.0 else rounded + 0.0:.{self.decimals}f}"

    def value(self, text: str) -> Value:
        number = float(text) if _DECIMAL.fullmatch(text) else math.nan
        return number if self.low <= number <= self.high else None


@dataclass(frozen=True)
class Whole(Rule):
    """A whole number between limits."""

    low: int
    high: int
    digits: int = 1

    def text(self, value: Value) -> str | None:
        fits = isinstance(value, int) and not isinstance(value, bool) and self.low <= value <= self.high
        return f"{value:0{self.digits}d}" if fits else None

    def value(self, text: str) -> Value:
        return int(text) if _WHOLE.fullmatch(text) and self.low <= int(text) <= self.high else None


@dataclass(frozen=True)
class Word(Rule):
    """One of a few words; any short text where none is named."""

    among: tuple[str, ...] = ()

    def text(self, value: Value) -> str | None:
        return value if isinstance(value, str) and self.value(value) is not None else None

    def value(self, text: str) -> Value:
        return text if (text in self.among if self.among else _TEXT.fullmatch(text)) else None


@dataclass(frozen=True)
class Clock(Rule):
    """Time of the day, UTC, hhmmss.ss, as seconds since midnight."""

    def text(self, value: Value) -> str | None:
        if not isinstance(value, float | int) or not 0.0 <= value < 86400.0:
            return None
        hundredths = min(round(value * 100.0), 8639999)
        minutes, rest = divmod(hundredths, 6000)
        return f"{minutes // 60:02d}{minutes % 60:02d}{rest // 100:02d}.{rest % 100:02d}"

    def value(self, text: str) -> Value:
        found = _CLOCK.fullmatch(text)
        return 3600 * int(found[1]) + 60 * int(found[2]) + float(found[3] + (found[4] or "")) if found else None


@dataclass(frozen=True)
class Day(Rule):
    """A date, ddmmyy; two digits of the year from 80 on are those of the last century."""

    def text(self, value: Value) -> str | None:
        return value.strftime("%d%m%y") if isinstance(value, date) and 1980 <= value.year < 2080 else None

    def value(self, text: str) -> Value:
        found = _DAY.fullmatch(text)
        if found is None:
            return None
        day, month, year = map(int, found.groups())
        try:
            return date(year + (1900 if year >= 80 else 2000), month, day)
        except ValueError:
            return None


@dataclass(frozen=True)
class Place(Rule):
    """Latitude or longitude, signed degrees; takes two fields, the second being the hemisphere."""

    greatest: int
    sides: tuple[str, str]
    decimals: int = 7

    def text(self, value: Value) -> str | None:
        if not isinstance(value, float | int) or not abs(value) <= self.greatest:
            return None
        # rounded before it is parted, or 59.99999999 minutes would be written as 60
        units = round(abs(value) * 60.0 * 10**self.decimals)
        degrees, rest = divmod(units, 60 * 10**self.decimals)
        minutes, part = divmod(rest, 10**self.decimals)
        side = self.sides[1 if value < 0 else 0]
        return f"{degrees:0{len(str(self.greatest))}d}{minutes:02d}.{part:0{self.decimals}d},{side}"

    def value(self, text: str) -> Value:
        number, _, side = text.partition(",")
        found = _PLACE[self.greatest].fullmatch(number)
        if found is None or side not in self.sides:
            return None
        degrees = int(found[1]) + float(found[2]) / 60.0
        return None if degrees > self.greatest else degrees if side == self.sides[0] else -degrees


@dataclass(frozen=True)
class Kind:
    """A sentence: its fields in order, and how many of them must be there."""

    fields: Mapping[str, Rule]
    least: int


def _kind(least: int | None = None, /, **fields: Rule) -> Kind:
    return Kind(MappingProxyType(fields), len(fields) if least is None else least)


_HEADING, _BEARING = Number(0.0, 360.0, 2, circle=True), Number(0.0, 360.0, 1, circle=True)
_RATE, _KNOTS, _SPEED = Number(-99999.0, 99999.0, 2), Number(-999.0, 999.0, 3), Number(0.0, 999.0, 3)
_ANGLE, _UNSIGNED = Number(-180.0, 180.0, 2), Number(0.0, 180.0, 2)
_TURNS, _SHARE, _LENGTH = Number(-99999.0, 99999.0, 2), Number(-100.0, 100.0, 1), Number(0.0, 99999.0, 3)
_VALID, _MODE, _NORTH = Word(("A", "V")), Word(tuple("ADEFMNPRS")), Word(("T", "M"))
_SIDE, _MILES, _PLACE_OF = Word(("L", "R")), Word(("N",)), Word(tuple("BPSCEW"))
_LATITUDE, _LONGITUDE, _METRE = Place(90, ("N", "S")), Place(180, ("E", "W")), Word(("M",))
_NUMBER, _PERCENT_OR = Whole(0, 99), Word(("P", "R", "V"))
_EAST, _KNOT, _IDENTIFIER, _INSTANCE = Word(("E", "W")), Word(("N",)), Whole(1, 9_999_999), Whole(1, 999_999)
_TARGET, _MINUTES, _COMMAND = Whole(0, 99, 2), Number(-9999.0, 9999.0, 2), Word(tuple("AQOS"))

SENTENCES: Mapping[str, Kind] = MappingProxyType({
    "HDT": _kind(headingT=_HEADING, headingTu=Word(("T",))),
    "THS": _kind(headt=_HEADING, mi=Word(tuple("AEMSV"))),
    "ROT": _kind(rot=_RATE, valid=_VALID),
    "VBW": _kind(6, longwaterspd=_KNOTS, transwaterspd=_KNOTS, waterspdstatus=_VALID, longgroundspd=_KNOTS,
                 transgroundspd=_KNOTS, groundspdstatus=_VALID, sterntranswaterspd=_KNOTS,
                 sternwaterspdstatus=_VALID, sterntransgroundspd=_KNOTS, sterngroundspdstatus=_VALID),
    "VTG": _kind(8, cogt=_HEADING, cogtUnit=Word(("T",)), cogm=_HEADING, cogmUnit=Word(("M",)), sogn=_SPEED,
                 sognUnit=_MILES, sogk=_SPEED, sogkUnit=Word(("K",)), posMode=_MODE),
    "RMC": _kind(9, time=Clock(), status=_VALID, lat=_LATITUDE, lon=_LONGITUDE, spd=_SPEED, cog=_HEADING, date=Day(),
                 mv=_UNSIGNED, mvEW=Word(("E", "W")), posMode=_MODE, navStatus=Word(tuple("SCUV"))),
    "GGA": _kind(time=Clock(), lat=_LATITUDE, lon=_LONGITUDE, quality=Whole(0, 8), numSV=Whole(0, 99, 2),
                 HDOP=Number(0.0, 99.99, 1), alt=_TURNS, altUnit=_METRE, sep=_TURNS, sepUnit=_METRE,
                 diffAge=_LENGTH, diffStation=Whole(0, 1023, 4)),
    "ZDA": _kind(time=Clock(), day=Whole(1, 31, 2), month=Whole(1, 12, 2), year=Whole(1980, 2079, 4),
                 ltzh=Word(), ltzn=Word()),
    "GLL": _kind(3, lat=_LATITUDE, lon=_LONGITUDE, time=Clock(), status=_VALID, posMode=_MODE),
    "VHW": _kind(hdgT=_HEADING, hgdTu=Word(("T",)), hdgM=_HEADING, hgdMu=Word(("M",)), spdN=_KNOTS, spdNu=_KNOT,
                 spdK=_KNOTS, spdKu=Word(("K",))),
    "HDG": _kind(headingM=_HEADING, deviation=_UNSIGNED, deviationEW=_EAST, variation=_UNSIGNED, variationEW=_EAST),
    "TTM": _kind(13, targetnum=_TARGET, targetdist=_LENGTH, targetbearing=_HEADING, targetbearingu=Word(("T", "R")),
                 targetspeed=_SPEED, targetcourse=_HEADING, targetcourseu=Word(("T", "R")), closestapproach=_LENGTH,
                 timetoCPA=_MINUTES, speedu=Word(("K", "N", "S")), targetname=Word(),
                 targetstatus=Word(("L", "Q", "T")), reftarget=Word(("R",)), time=Clock(),
                 acquisitiontype=Word(("A", "M", "R"))),
    "TLL": _kind(5, targetnum=_TARGET, targetlat=_LATITUDE, targetlon=_LONGITUDE, targetname=Word(), time=Clock(),
                 status=Word(("L", "Q", "T")), reftarget=Word(("R",))),
    "RSA": _kind(stbdangle=_ANGLE, stbdstatus=_VALID, portangle=_ANGLE, portstatus=_VALID),
    "RPM": _kind(source=Word(("S", "E")), engineshaftnum=_NUMBER, rpm=_TURNS, pitch=_SHARE, status=_VALID),
    "MWV": _kind(angle=_HEADING, reference=Word(("R", "T")), speed=_SPEED, speedu=Word(("K", "M", "N")), status=_VALID),
    "DPT": _kind(2, depth=_LENGTH, offset=Number(-999.0, 999.0, 2), rangescale=_LENGTH),
    "ROR": _kind(4, stbdrudderorder=_ANGLE, stbdrudderstatus=_VALID, portrudderorder=_ANGLE,
                 portrudderstatus=_VALID, operatinglocind=_PLACE_OF),
    "HTC": _kind(13, override=_VALID, cmdrudderang=_UNSIGNED, cmdrudderdir=_SIDE, steermode=Word(tuple("MSHTR")),
                 turnmode=Word(("R", "T", "N")), cmdrudderlimit=_UNSIGNED, cmdoffheadinglimit=_UNSIGNED,
                 cmdturnradius=_LENGTH, cmdturnrate=Number(0.0, 9999.0, 2), cmdheading=_HEADING,
                 cmdofftracklimit=_LENGTH, cmdtrack=_HEADING, headingref=_NORTH, status=Word(("C", "R"))),
    "TRC": _kind(thrusternum=_NUMBER, dmdrpm=_TURNS, rpmmode=_PERCENT_OR, dmdpitch=_ANGLE,
                 pitchmode=Word(("P", "D", "V")), dmdazimuth=_BEARING, operatinglocind=_PLACE_OF,
                 status=Word(("C", "R"))),
    "PRC": _kind(leverdmdpos=_SHARE, leverdmdstatus=_VALID, rpmdemand=_TURNS, rpmdemandstatus=_PERCENT_OR,
                 pitchdmd=_SHARE, pitchmode=Word(("P", "D", "V")), operatinglocind=_PLACE_OF, engineshaftnum=_NUMBER),
    "ETL": _kind(time=Clock(), msgtype=Word(("O", "A")),
                 engtelposind=Word(("00", "01", "02", "03", "04", "05", "11", "12", "13", "14", "15")),
                 engsubtelposind=Word(("20", "30", "40")), operatinglocind=_PLACE_OF,
                 enginenum=Word(tuple("0123456789"))),
    "APB": _kind(14, LCgwarn=_VALID, LCcwarn=_VALID, ctrkerr=_LENGTH, dirs=_SIDE, ctrkUnit=_MILES, aalmcirc=_VALID,
                 aalmperp=_VALID, bearO2D=_HEADING, bearO2Du=_NORTH, wpt=Word(), bearD=_HEADING, bearDu=_NORTH,
                 bearS=_HEADING, bearSu=_NORTH, mode=_MODE),
    "ALF": _kind(numSen=Whole(1, 9), senNum=Whole(1, 9), seqmid=Whole(0, 9), timelastchange=Clock(),
                 alertcat=Word(("A", "B", "C")), alertpriority=Word(tuple("EAWC")), alertstate=Word(tuple("ASNOUV")),
                 mfrcode=Word(), alertid=_IDENTIFIER, alertinst=_INSTANCE, revisionctr=Whole(1, 99),
                 escalationctr=Whole(0, 9), alerttxt=Word()),
    "ACN": _kind(time=Clock(), mfrcode=Word(), alertid=_IDENTIFIER, alertnum=_INSTANCE, alertcmd=_COMMAND,
                 status=Word(("C",))),
    "ARC": _kind(time=Clock(), mfrcode=Word(), alertid=_IDENTIFIER, alertinst=_INSTANCE, alertcmd=_COMMAND),
    "ALR": _kind(timealarmchange=Clock(), alarmnum=Whole(0, 999, 3), alarmcond=_VALID, alarmstate=_VALID,
                 alarmtext=Word()),
    "ACK": _kind(alarmid=Whole(0, 999, 3)),
    "XTE": _kind(5, gwarn=_VALID, LCcwarn=_VALID, ctrkerr=_LENGTH, dirs=_SIDE, disUnit=_MILES, mode=_MODE),
})  # fmt: skip
"""The sentences by their three letters."""
