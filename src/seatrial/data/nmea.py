"""NMEA 0183 (IEC 61162-1) sentences, strictly: what is unknown or missing is an error, and null stays null.

The sentences are built by pynmeagps, whose own ways with a misspelt or a missing field (it becomes 0.0)
are shut off: before it sees a sentence, every field is held against `nmea_fields.SENTENCES`, by which
sentences are read, too.
What the fields mean in SI and the signs of docs/conventions.md is told by `nmea_ship`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

from ..parameters import unknown
from . import DataError
from .nmea_fields import SENTENCES, Place, Value

LONGEST = 82
"""Characters of a sentence, from the dollar to the line feed, both counted."""

Reason = Literal["length", "form", "checksum", "kind", "field"]

_FORM = re.compile(rb"\$([A-Z]{2})([A-Z]{3}),([ -)+-\[\]-}]*)\*([0-9A-Fa-f]{2})(?:\r?\n)?")
_OTHER = re.compile(rb"[$!][A-Z0-9]{3,15}(?:,[ -)+-\[\]-}]*)?\*([0-9A-Fa-f]{2})(?:\r?\n)?")
_TALKER = re.compile(r"[A-Z]{2}")


class NmeaError(DataError):
    """A sentence or a datagram that is not valid.

    Attributes:
        reason: "length", "form", "checksum", "kind" (valid, but not one that seatrial speaks) or "field".
    """

    def __init__(self, text: str, reason: Reason) -> None:
        super().__init__(text)
        self.reason: Reason = reason


@dataclass(frozen=True)
class Sentence:
    """One sentence: who talks ("HE"), what ("HDT"), and its fields by name; None is a null field."""

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
        longest: how many bytes are allowed; some receivers send more digits than the standard has room for.

    Raises:
        NmeaError: whatever is not a valid sentence of a known kind; `reason` says in what way.
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
    """What is wrong with a line that has not the form of a sentence of ours."""
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
