"""Sentences as devices and loggers write them: without checksum, padded, quoted, several on a line, stamped.

`sentences` holds the standard, strictly, for what commands a ship.  What is only read off a log loses a bad field, and
nothing else: a receiver that sends a variation of 999.9 has still told where it was.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from ...core.values import dataclass
from .sentences import NmeaError, checksum

_BEGIN = re.compile(rb"[$!](?=[A-Z0-9]{4,15}[,*])")
_SENTENCE = re.compile(rb"[$!]([A-Z0-9]{4,15})((?:,[\x20-\x23\x25-\x29\x2b-\x7e]*)?)(?:\*([0-9A-Fa-f]{2}))?")
LONGEST = 512
"""Bytes of a sentence at most: receivers send more than the 82 of the standard, none so many."""
_NUMBER = re.compile(r"[+-]?(?:\d{1,9}(?:\.\d{0,12})?|\.\d{1,12})")
_CLOCK = re.compile(r"([01]\d|2[0-4])([0-5]\d)([0-5]\d|60)(\.\d*)?")
_PLACE = re.compile(r"(\d{1,3})(\d\d(?:\.\d*)?)")
_NUMERIC = re.compile(r"[0-9.+-]")


def number(text: str) -> float:
    """A field as a number; NaN where it is none."""
    return float(text) if _NUMBER.fullmatch(text) else math.nan


def clock(text: str) -> float:
    """Time of the day, hhmmss.ss [s]; NaN where it is none."""
    found = _CLOCK.fullmatch(text)
    return 3600 * int(found[1]) + 60 * int(found[2]) + float(found[3] + (found[4] or "")) if found else math.nan


def place(text: str) -> float:
    """Degrees and minutes of arc in one field [deg]; NaN where they are none."""
    found = _PLACE.fullmatch(text)
    return int(found[1]) + float(found[2]) / 60.0 if found and float(found[2]) < 60.0 else math.nan


@dataclass(frozen=True)
class Heard:
    """One sentence; the `readings.Fields` of one.

    Attributes:
        talker: its letters or digits, "HE", "02"; empty for a proprietary sentence.
        kind: three letters, "HDT"; of a proprietary sentence the whole address, "PASHR".
        fields: texts without blanks around them.
        checked: whether it has a checksum.
    """

    talker: str
    kind: str
    fields: tuple[str, ...]
    checked: bool = True

    @property
    def source(self) -> str:
        """Talker and kind, as logs name a source."""
        return self.talker + self.kind

    def __len__(self) -> int:
        return len(self.fields)

    def text(self, k: int) -> str:
        return self.fields[k] if k < len(self.fields) else ""

    def word(self, k: int) -> str:
        return "#" if _NUMERIC.search(self.text(k)) else self.text(k)

    def number(self, k: int) -> float:
        return number(self.text(k))

    def clock(self, k: int) -> float:
        return clock(self.text(k))

    def place(self, k: int) -> float:
        return place(self.text(k))


@dataclass(frozen=True)
class Piece:
    """A sentence of a line, what stands before it and what behind."""

    before: bytes
    sentence: bytes
    behind: bytes


def addressed(address: str) -> tuple[str, str]:
    """Talker and kind of an address."""
    return ("", address) if address.startswith("P") or len(address) < 5 else (address[:-3], address[-3:])


def hear(sentence: bytes) -> Heard:
    """A sentence from its bytes, from the dollar on.

    Raises:
        NmeaError: not the form of a sentence, or a checksum that is not its own.
    """
    found = _SENTENCE.fullmatch(sentence.strip().rstrip(b"\x00"))
    if found is None or len(sentence) > LONGEST:
        raise NmeaError("not the form $AACCC,... of a sentence", "form")
    content = sentence[1 : found.end(2)]
    if found[3] is not None and checksum(content) != found[3].decode().upper():
        raise NmeaError(f"checksum is {found[3].decode()}; that of the sentence is {checksum(content)}", "checksum")
    talker, kind = addressed(found[1].decode())
    fields = tuple(part.strip() for part in found[2][1:].decode("latin-1").split(","))
    return Heard(talker, kind, fields, found[3] is not None)


def pieces(line: bytes) -> Iterator[Piece]:
    """The sentences of a line with what stands around each; the first has what stands before all, a TAG block too."""
    starts = [found.start() for found in _BEGIN.finditer(line)]
    for k, start in enumerate(starts):
        end = starts[k + 1] if k + 1 < len(starts) else len(line)
        found = _SENTENCE.match(line, start, end)
        stop = end if found is None or found[3] is None else found.end()
        # a quote closes what a table has quoted, blanks and commas part two sentences
        body = line[start:stop] if stop < end else line[start:stop].rstrip(b"\"' \t,\r\n\x00")
        yield Piece(line[: starts[0]], body, line[stop:end])
