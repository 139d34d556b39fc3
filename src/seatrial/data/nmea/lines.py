"""The readings of all lines of a log, block by block: what is plain in many lines at a time, the rest line by line.

A line is plain that has one sentence with its checksum right, or none, and nothing that `heard.pieces` and `heard.hear`
would have to think about: no blank in a field, no byte that cannot be printed.  Both ways tell the same of any line.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass, field, replace
from .. import Array, DataError
from ..n2k.groups import PGNS
from ..table import existing
from . import carried
from .clocks import PIECES, Spoken
from .columns import Columns
from .digits import HEX, WIDEST, Bytes, Places, alike, mapped, rows_of
from .framing import SOURCES, TAGGED, TOKEN, Texts, read_line, tag_times
from .heard import LONGEST, Piece, addressed, hear, pieces
from .readings import KINDS, readings
from .sentences import NmeaError
from .stamping import Around, Form, around, form_of

_BLOCK = _HEAD = 1_000_000
"""Bytes that are read at a time, and those at the beginning that are looked at first."""
_LINE = 1 << 16
"""Bytes of a line at most: what is longer is cut."""
_TRIED = 400
"""Lines from the beginning, and as many from the rest, by which the form of the stamps is chosen."""
_FEW = 16
"""Sentences of one shape that are not worth columns of their own."""
_ADDRESS = 8
"""Bytes of an address at most, in a plain line."""
_PAD = WIDEST + _ADDRESS
_NEVER = 1 << 62
_ENOUGH, _NEARLY = 10, 0.9
"""Sentences of a source, and the part of them with a checksum, from which on one without was cut off."""

_REMARKS = (b"#", b";", b"%", b"//")
_CAPITAL = bytes(chr(k) in "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789" for k in range(256))
_LETTER = bytes(chr(k) not in "0123456789+-." for k in range(256))
_ODD = bytes(not 0x20 <= k <= 0x7E and chr(k) != "\n" for k in range(256))
_STRIPPED = np.isin(np.arange(256), list(b"\"' \t,"))


@dataclass
class Lines:
    """What the lines of a log hold.

    Attributes:
        found: readings, by what tells them.
        dated, about: whether stamps count from 1970, and their form in words; empty where there are none.
        others: number of sentences of kinds that are not read.
        all, sentences, bare, wrong: how many lines there are, sentences with readings, those of them without a
            checksum, and lines or parts of them that are no sentence.
        first: what is wrong with the first of those.
        order: of the bytes of frames of NMEA 2000 that sentences carry, in words.
    """

    found: list[Spoken] = field(default_factory=list[Spoken])
    dated: bool = False
    about: str = ""
    others: Counter[str] = field(default_factory=Counter[str])
    all: int = 0
    sentences: int = 0
    bare: int = 0
    wrong: int = 0
    first: str = ""
    order: str = ""


def listen(path: Path) -> Lines:
    """Read the lines of a log.

    Raises:
        DataError: not readable.
    """
    try:
        tried = _tried(existing(path))
        form = form_of(around([(_untagged(one[0].before), one[0].behind) for one in tried]))
        ear = _Ear(form, _summing([part.sentence for one in tried for part in one]))
        for block in _blocks(path):
            ear.block(block)
    except OSError as error:
        raise DataError(f"{path}: not readable: {error.strerror}") from None
    return ear.heard()


def _blocks(path: Path) -> Iterator[bytes]:
    """The file in blocks of whole lines that end in a line feed."""
    with path.open("rb") as file:
        rest = b""
        while chunk := file.read(_BLOCK):
            chunk = rest + chunk
            # a carriage return at the end may be half of a line end
            cut = 1 + max(chunk.rfind(b"\n"), chunk.rfind(b"\r", 0, len(chunk) - 1))
            cut = len(chunk) if not cut and len(chunk) > _LINE else cut
            rest = chunk[cut:]
            yield _plain(chunk[:cut])
        yield _plain(rest)


def _plain(chunk: bytes) -> bytes:
    chunk = chunk.replace(TOKEN, b"") if TOKEN in chunk else chunk
    raw = np.frombuffer(chunk + b"\0", np.uint8)
    ends = raw == ord("\r")
    if ends.any():
        alone = (raw[np.flatnonzero(ends) + 1] != ord("\n")).any()
        chunk = chunk.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if alone else raw[:-1][~ends[:-1]].tobytes()
    return chunk if chunk.endswith(b"\n") or not chunk else chunk + b"\n"


def _tried(path: Path) -> list[list[Piece]]:
    """Lines with a sentence, taken apart, from the beginning of a log and from places all over the rest."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = [line for line in _plain(file.read(_HEAD)).splitlines() if b"$" in line or b"!" in line]
        rest = head[_TRIED :: max(len(head) // _TRIED, 1)]
        if size > _HEAD:
            rest = list[bytes]()
            for at in np.linspace(_HEAD, size, _TRIED, endpoint=False).astype(int).tolist():
                file.seek(at)
                rest += file.read(_LINE // 64).replace(TOKEN, b"").splitlines()[1:2]
    return [parts for line in (*head[:_TRIED], *rest) if (parts := list(pieces(line)))]


def _summing(sentences: Sequence[bytes]) -> frozenset[str]:
    """The sources of some sentences that nearly always have a checksum: one of theirs without was cut off."""
    every, summed = Counter[str](), Counter[str]()
    for one in sentences:
        with suppress(NmeaError):
            heard = hear(one)
            every[heard.source] += 1
            summed[heard.source] += heard.checked
    return frozenset(source for source, n in every.items() if n >= _ENOUGH and summed[source] >= _NEARLY * n)


def _untagged(before: bytes) -> bytes:
    return TAGGED.sub(b"", before)


@dataclass(frozen=True)
class _Plain:
    """Sentences that are the only ones of their lines, a row each.

    Attributes:
        line: number of the line in the block.
        begin, end: first byte of the line, and the one behind its last.
        dollar, stop: where the sentence begins, and where its fields end.
        checked: whether it has a checksum.
        comma: number of its first comma among those of the block.
        address: its bytes as one number.
    """

    line: Places
    begin: Places
    end: Places
    dollar: Places
    stop: Places
    checked: NDArray[np.bool_]
    comma: Places
    address: NDArray[np.uint64]

    def only(self, rows: Places | NDArray[np.bool_]) -> _Plain:
        return _Plain(self.line[rows], self.begin[rows], self.end[rows], self.dollar[rows], self.stop[rows],
                      self.checked[rows], self.comma[rows], self.address[rows])  # fmt: skip


def _inside(places: Places, begin: Places, end: Places) -> tuple[Places, Places]:
    """Number of the first of some places in each span, and how many of them it has; spans do not overlap."""
    if len(places) == len(begin) and bool(((begin <= places) & (places < end)).all()):
        return np.arange(len(begin)), np.ones(len(begin), np.int64)
    if not len(places):
        return np.zeros(len(begin), np.int64), np.zeros(len(begin), np.int64)
    first = np.searchsorted(places, begin)
    return first, np.searchsorted(places, end) - first


def _sentences(data: Bytes, commas: Places, begin: Places, end: Places) -> _Plain:
    """The plain sentences of a block, whose lines these are."""
    marks = np.flatnonzero((data == ord("$")) | (data == ord("!")))
    first, count = _inside(marks, begin, end)
    line = np.flatnonzero(count == 1)
    begin, end, dollar = begin[line], end[line], marks[first[line]]
    stars = np.flatnonzero(data == ord("*"))
    star, count = _inside(stars, dollar, end)
    checked = count == 1
    stop = np.where(checked, np.append(stars, 0)[star], end)
    said = 16 * HEX[data[np.minimum(stop + 1, end)]] + HEX[data[np.minimum(stop + 2, end)]]
    total = np.bitwise_xor.accumulate(data)
    good = np.where(checked, said == (total[stop - 1] ^ total[dollar]), (count == 0) & ~_STRIPPED[data[end - 1]])
    comma = np.searchsorted(commas, dollar)
    width = np.append(commas, len(data))[comma] - dollar - 1
    good &= (dollar + 1 + width < stop) & (width >= 4) & (width <= _ADDRESS) & (stop + 3 - dollar <= LONGEST)
    good &= _inside(np.flatnonzero(mapped(data[:-_PAD], _ODD)), dollar, stop)[1] == 0
    inside = np.arange(_ADDRESS) < width[:, None]
    letters = rows_of(data, dollar + 1, _ADDRESS) * inside
    good &= (rows_of(mapped(data, _CAPITAL), dollar + 1, _ADDRESS) >= inside).all(axis=1)
    address = np.ascontiguousarray(letters).view(np.uint64).ravel()
    return _Plain(line, begin, end, dollar, stop, checked, comma, address).only(good)


_Key = tuple[str, str, tuple[str, ...]]
"""Source of the TAG block, empty where there is none; talker and kind; names of the readings."""
_Said = dict[_Key, list[tuple[int, list[float], float]]]
"""Place, values and stamp of readings."""


class _Ear:
    """The lines that have been heard so far."""

    def __init__(self, form: Form | None, summed: frozenset[str] = frozenset()) -> None:
        self._form, self._tagged, self._summed = form, False, summed
        self._frames = list[carried.Carried]()
        self._said = Lines(about=form.about if form else "")
        self._kept: dict[_Key, list[Spoken]] = defaultdict(list)

    def heard(self) -> Lines:
        """All of it."""
        said = self._said
        said.dated = self._tagged or (self._form is not None and self._form.dated)
        spoken, said.order = carried.told(self._frames) if self._frames else ([], "")
        said.found = [*map(_joined, _by_source(self._kept)), *spoken]
        said.sentences = sum(len(one.place) for one in said.found)
        return said

    def block(self, block: bytes) -> None:
        """Take in lines."""
        raw = np.frombuffer(block, np.uint8)
        end = np.flatnonzero(raw == ord("\n"))
        begin = np.append(0, end[:-1] + 1)[: len(end)]
        data = np.concatenate([raw, np.zeros(_PAD, np.uint8)])
        left = np.ones(len(end), bool)
        commas = np.flatnonzero(raw == ord(","))
        found = _sentences(data, commas, begin, end)
        stamp, tags, good = self._stamps(data, found)
        begun = bool(self._kept or self._said.wrong)
        early = self._columns(data, commas, found.only(good), (stamp[good], tags[good]), left)
        rest = np.flatnonzero(left).tolist()
        self._line_by_line([(k, block[begin[k] : end[k]]) for k in rest], -1 if begun else early)
        self._said.all += len(end)

    def _stamps(self, data: Bytes, found: _Plain) -> tuple[Array, Texts, NDArray[np.bool_]]:
        """Stamps of plain lines, sources in their TAG blocks, and whether these are right."""
        before = np.stack([found.begin, found.dollar - found.begin], axis=1)
        times, ends = np.full(len(before), np.nan), data[np.maximum(found.dollar - 1, 0)]
        tagged = np.flatnonzero((before[:, 1] > 0) & (ends == ord("\\")))
        tags = np.zeros(len(before), SOURCES if len(tagged) else "S1")  # names that are wide take their time
        times[tagged], begins, tags[tagged] = tag_times(data, *before[tagged].T)
        before[tagged, 1] = begins - before[tagged, 0]
        good = ~np.isinf(times)
        blank = np.flatnonzero((before[:, 1] > 0) & (ends <= ord(" ")))
        if len(blank):  # behind a TAG block, perhaps
            slashes = np.flatnonzero(data == ord("\\"))
            first, last = (np.searchsorted(slashes, one[blank]) for one in (found.begin, found.dollar))
            good[blank[last > first]] = False
        self._tagged |= bool(np.isfinite(times).any())
        bare = np.flatnonzero(np.isnan(times))
        if self._form is not None and len(bare):
            behind = np.where(found.checked, found.stop + 3, found.end)
            spans = np.stack([behind, found.end - behind], axis=1)
            times[bare] = self._form.seconds(Around(data, before[bare], spans[bare]))
        return times, tags, good

    def _columns(
        self, data: Bytes, commas: Places, found: _Plain, before: tuple[Array, Texts], left: NDArray[np.bool_]
    ) -> int:
        """Take in plain sentences, and say in `left` which lines these were not; the line of the first reading."""
        known, which = np.unique(found.address, return_inverse=True)
        names = [addressed(one.tobytes().rstrip(b"\0").decode()) for one in known]
        wanted = np.array([kind in KINDS for _, kind in names], bool)[which]
        strange = np.array([kind not in (*KINDS, *carried.KINDS) for _, kind in names], bool)
        for k in np.flatnonzero(strange).tolist():
            self._said.others[names[k][1]] += int(np.count_nonzero(which == k))
        left[found.line[strange[which]]] = False
        whole = found.checked | ~np.array([talker + kind in self._summed for talker, kind in names], bool)[which]
        wanted &= whole
        found, stamp, tags, which = found.only(wanted), before[0][wanted], before[1][wanted], which[wanted]
        letters = np.flatnonzero(mapped(data, _LETTER))
        shape = data[letters]
        start, stop = np.searchsorted(letters, found.dollar), np.searchsorted(letters, found.stop)
        early = _NEVER
        for rows in alike(shape, start, stop - start, found.address, _FEW):
            words = shape[start[rows[0]] : stop[rows[0]]].tobytes().decode().split(",")[1:]
            if any(" " in word for word in words):
                continue
            at = commas[found.comma[rows] + np.arange(len(words))[:, None]]
            talker, kind = names[int(which[rows[0]])]
            columns = Columns(kind, data, at + 1, np.vstack([at[1:], found.stop[rows][None]]), tuple(words), rows)
            for row, said in columns.read():
                line = found.line[row]
                left[line] = False
                bare = ~found.checked[row]
                early = min(early, self._take(talker + kind, said, (line, bare), stamp[row], tags[row]))
        return early

    def _take(
        self, source: str, said: Mapping[str, float | Array], lines: tuple[Places, NDArray[np.bool_]], stamp: Array,
        tags: Texts,
    ) -> int:  # fmt: skip
        """Readings of sentences of one kind, by their lines and which of them have no checksum; the first line."""
        line, bare = lines
        if not said:
            return _NEVER
        values = np.stack([np.broadcast_to(one, len(stamp)) for one in said.values()])
        has = ~np.isnan(values)
        pattern = (1 << np.arange(len(values))) @ has
        some = slice(1) if (pattern == pattern[0]).all() and (tags == tags[0]).all() else slice(None)
        each = zip(pattern[some].tolist(), tags[some].tolist(), strict=True)
        for one, tag in sorted({pair for pair in each if pair[0] > 0}):
            rows, which = np.flatnonzero((pattern == one) & (tags == tag)), has[:, int(np.argmax(pattern == one))]
            names = tuple(name for name, there in zip(said, which.tolist(), strict=True) if there)
            place = (self._said.all + line[rows] + 1) * PIECES
            spoken = Spoken(source, names, place, values[which][:, rows], stamp[rows])
            self._kept[tag.decode(), source, names].append(spoken)
        self._said.bare += int(np.count_nonzero(bare & (pattern > 0)))
        return int(line[pattern > 0].min(initial=_NEVER))

    def _line_by_line(self, lines: Sequence[tuple[int, bytes]], early: int) -> None:
        """Take in lines that are not plain; `early` is the line of the first reading of the others."""
        parted = [(k, line, list(pieces(line))) for k, line in lines]
        last = self._form is not None and self._form.behind
        stood = [
            (_untagged(one[0].before), one[-1 if last else 0].behind) if one else (b"", b"") for _, _, one in parted
        ]
        stamps = self._form.seconds(around(stood)) if self._form is not None else np.full(len(parted), np.nan)
        said: _Said = defaultdict(list)
        for (k, line, parts), stamp in zip(parted, stamps.tolist(), strict=True):
            if not parts:
                # a remark, or the names of the columns of a table above its first sentence
                if line.strip() and not line.lstrip().startswith(_REMARKS) and (early < k or said or self._said.wrong):
                    self._refuse(k, "no sentence")
                continue
            try:
                tagged = TAGGED.search(parts[0].before)
                tag = read_line(tagged[0].strip() + b"$").tag if tagged else None
            except NmeaError as error:
                self._refuse(k, error)
                continue
            if tag is not None and tag.time is not None:
                stamp, self._tagged = tag.time, True
            by = (tag.source if tag else None) or ""
            for number, part in enumerate(parts):
                self._sentence(k, number, part.sentence, (stamp, by), said)
        for key, kept in said.items():
            places, values, times = zip(*kept, strict=True)
            self._kept[key].append(Spoken(*key[1:], np.array(places), np.array(values).T, np.array(times)))

    def _sentence(self, k: int, number: int, sentence: bytes, before: tuple[float, str], said: _Said) -> None:
        try:
            heard = hear(sentence)
        except NmeaError as error:
            self._refuse(k, error)
            return
        if not heard.checked and heard.source in self._summed:
            self._refuse(k, f"no checksum, which {heard.source} has in other lines: it was cut off")
            return
        values, place, (stamp, by) = readings(heard), (self._said.all + k + 1) * PIECES + number, before
        frame = carried.carried(heard, place, stamp) if heard.kind in carried.KINDS else None
        if frame is not None and frame.frame.pgn in PGNS:
            self._frames.append(frame)
        elif frame is not None:
            self._said.others[f"PGN {frame.frame.pgn}"] += 1
        elif values:
            said[by, heard.source, tuple(values)].append((place, list(values.values()), stamp))
            self._said.bare += not heard.checked
        elif heard.kind not in KINDS:
            self._said.others[heard.kind] += 1

    def _refuse(self, k: int, why: object) -> None:
        """Count what is no sentence."""
        self._said.wrong += 1
        self._said.first = self._said.first or f"line {self._said.all + k + 1}: {why}"


def _by_source(kept: Mapping[_Key, Sequence[Spoken]]) -> list[list[Spoken]]:
    """What each source tells; TAG blocks part those of one talker where they name several for one kind.

    Two gyros on one network are both HE, and a name like HE0001 before the talker keeps them apart.
    """
    tags: dict[str, set[str]] = defaultdict(set)
    for tag, source, _ in kept:
        tags[source] |= {tag} - {""}
    several = {source[:-3] for source, some in tags.items() if len(some) > 1}
    out: dict[tuple[str, tuple[str, ...]], list[Spoken]] = defaultdict(list)
    for (tag, source, names), parts in kept.items():
        full = f"{tag}/{source}" if tag and source[:-3] in several else source
        out[full, names] += [replace(one, source=full) for one in parts]
    return list(out.values())


def _joined(parts: Sequence[Spoken]) -> Spoken:
    """What one source tells in all blocks, in the order of the lines."""
    place = np.concatenate([one.place for one in parts])
    order = np.argsort(place, kind="stable")
    values = np.concatenate([one.values for one in parts], axis=1)[:, order]
    stamp = np.concatenate([one.stamp for one in parts])[order]
    return Spoken(parts[0].source, parts[0].names, place[order], values, stamp)
