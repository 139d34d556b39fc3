"""Logs in blocks: many lines at a time tell what each line tells alone, in whatever blocks they come."""

from __future__ import annotations

import tracemalloc
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from seatrial.data.nmea import lines
from seatrial.data.nmea.digits import WIDEST, alike, decimals
from seatrial.data.nmea.framing import Tag, tag_block, tag_times
from seatrial.data.nmea.lines import Lines, _Ear, _plain, listen
from seatrial.data.nmea.stamping import around, form_of

KINDS = (
    "GPRMC,{c},A,{a},N,{o},E,{n:.2f},{d:.1f},010526,{e},E,A", "GPRMC,{c},V,{a},S,{o},W,,{d:.1f},310226,,,N",
    "GNGGA,{c},{a},N,{o},E,{q},09,0.9,5.0,M,40.0,M,,", "GPGLL,{a},N,{o},W,{c},A,A", "GPGNS,{c},{a},N,{o},E,AAN,9,1,,",
    "GPZDA,{c},0{q},05,2026,00,00", "GPVTG,{d:.1f},T,,M,{n:.2f},N,{e},K", "GPVTG,{d:.1f},{d:.1f},{n:.1f},{n:.1f}",
    "HEHDT,{d:.2f},T", "02HDG,{d:.2f},{e},W,{e},E", "HCHDM,{d:.0f},M", "TIROT,-{n:.2f},A", "RCRSA,{e},A,-{e},V",
    "RCRPM,S,{q},{n:.1f},,A", "IIVHW,,T,{d:.1f},M,0{n:.2f},N,,K", "VDVBW,{n:.3f},-{e},A,{n:.3f},{e},V,,V,,V",
    "WIMWV,{d:.0f},R,{n:.1f},N,A", "WIMWV,{d:.0f},T,{n:.1f},K", "IIVWR,{e},L,{n:.1f},N,,M,,K", "SDDPT,{n:.2f},{e},",
    "IIMWD,{d:.0f},T,,M,,N,{n:.2f},M", "SDDBT,{n:.2f},f,,M,,F", "IIXDR,A,{e},D,RUDDER,A,-{e},D,HEEL{q},C,{n:.1f},C,AIR",
    "PASHR,{c},{d:.2f},T,+{e},-{e},.1,.02,.02,.05,{q},1", "PSXN,2{q},{e},-{e},{d:.2f},0.1", "GPTXT,01,01,02,u-blox",
    "PSAT,HPR,{c},{d:.2f},{e},{e},N", "GPGSV,3,1,{q},01,40,083,46",
)  # fmt: skip
JUNK = (b"$", b"!", b"*", b",", b"\\", b" ", b"0", b"\x00", b"\xff", b".", b"-", b"+", b"A", b"\t", b'"', b"\r\n", b"#")


class Counting(_Ear):
    """Counts the lines that are read line by line."""

    alone = 0

    def _line_by_line(self, lines: Sequence[tuple[int, bytes]], early: int) -> None:
        self.alone += len(lines)
        super()._line_by_line(lines, early)


def signed(content: str, mark: str = "$") -> bytes:
    total = 0
    for byte in content.encode():
        total ^= byte
    return f"{mark}{content}*{total:02X}".encode()


def clock(draw: np.random.Generator) -> str:
    whole = f"{draw.integers(0, 25):02d}{draw.integers(0, 61):02d}{draw.integers(0, 62):02d}"
    rest = "", ".", ".5", f".{draw.integers(0, 10**6):06d}", f".{draw.integers(0, 10**12)}"
    return whole + rest[draw.integers(0, 5)]


def sentence(draw: np.random.Generator, kind: str) -> bytes:
    """A sentence with random figures, of few digits or of many, or none."""
    width = int(draw.integers(1, 14))
    arc = lambda most: f"{draw.integers(0, most):0{len(str(most))}d}{draw.uniform(0, 63):0{width + 3}.{width}f}"  # noqa: E731
    empty = draw.random() < 0.05
    text = kind.format(c="" if empty else clock(draw), a="" if empty else arc(91), o=arc(181), q=draw.integers(0, 10),
                       n=draw.uniform(0, 1000), d=draw.uniform(-20, 400),
                       e=f"{draw.uniform(0, 90):.{draw.integers(0, 15)}f}")  # fmt: skip
    return signed(text)


def stamp(draw: np.random.Generator, form: int, k: int) -> bytes:
    if form == 1:
        return f"2026-11-{draw.integers(25, 32)}T12:{k // 60:02d}:{k % 60:02d}.{draw.integers(0, 1000):03d}Z ".encode()
    if form == 2:
        told = f"s:GP{draw.integers(0, 10):04d},n:{draw.integers(0, 1000)},c:{1795694400000 + 100 * k}"
        return signed(told).replace(b"$", b"\\") + b"\\"
    return f"{1795694400 + k}.{draw.integers(0, 10**6):06d};N;".encode() if form == 3 else b""


def log(draw: np.random.Generator) -> bytes:
    """A log of a few devices, stamped or not, with lines that are damaged."""
    form, kinds = int(draw.integers(0, 5)), draw.choice(KINDS, 4)
    out = list[bytes]()
    for k in range(160):
        line = stamp(draw, form, k) + sentence(draw, str(kinds[k % 4]))
        for _ in range(int(draw.integers(1, 4)) if draw.random() < 0.15 else 0):
            at, junk = int(draw.integers(0, len(line) + 1)), JUNK[draw.integers(0, len(JUNK))]
            line = line[:at] + junk + line[at + int(draw.integers(0, 2)) :]
        if draw.random() < 0.1:
            inner = line.rpartition(b"$")[2].partition(b"*")[0].decode("latin-1")
            line = signed(inner) if draw.random() < 0.5 else line[:-3]
        out.append(line + (b",1795694400" if form == 4 and line[-3:-2] == b"*" else b"") + b"\r\n")
    return b"".join(out)


def said(heard: Lines) -> dict[str, object]:
    """All of it, with readings by source and names, to the bit."""
    found = {(one.source, one.names): [one.place.tolist(), one.values.tobytes(), one.stamp.tobytes()]
             for one in heard.found}  # fmt: skip
    return {**vars(heard), "found": found}


@pytest.mark.parametrize(
    "cases", [2, pytest.param(25, marks=pytest.mark.slow), pytest.param(1000, marks=pytest.mark.long)]
)
def test_many_lines_at_a_time_tell_what_each_tells_alone(cases: int) -> None:
    alone = every = 0
    for seed in range(cases):
        data = _plain(log(np.random.default_rng(seed)))
        rows = data.splitlines()
        form = form_of(around([(row[: max(row.find(b"$"), 0)], row.rpartition(b"*")[2][2:]) for row in rows]))
        together, by_line = Counting(form), _Ear(form)
        together.block(data)
        by_line._line_by_line([*enumerate(rows)], 1 << 62)
        by_line._said.all = len(rows)
        assert said(together.heard()) == said(by_line.heard()), seed
        alone, every = alone + together.alone, every + len(rows)
    assert alone < 0.4 * every  # a log of damage: of others it is one in a thousand


def test_a_sentence_that_was_cut_off_is_none_where_its_source_has_checksums(tmp_path: Path) -> None:
    """Of a device that never writes one, and of one that seldom does, all count."""
    whole = [signed(f"HEHDT,{k}.5,T") for k in range(40)]
    bare = [b"$GPHDT,%d.5,T" % k for k in range(40)]
    mixed = [signed(f"IIHDT,{k}.5,T") if k % 3 else b"$IIHDT,%d.5,T" % k for k in range(40)]
    lines = [line for three in zip(whole, bare, mixed, strict=True) for line in three]
    lines[60], lines[90] = b"$HEHDT,2", b"at last: $HEHDT,30.5"
    (tmp_path / "a.nmea").write_bytes(b"\r\n".join(lines))
    heard = listen(tmp_path / "a.nmea")
    found = {one.source: np.degrees(one.values[0]) for one in heard.found}
    assert heard.wrong == 2
    assert "HEHDT has in other lines: it was cut off" in heard.first
    np.testing.assert_allclose(found["HEHDT"], [k + 0.5 for k in range(40) if k not in (20, 30)])
    np.testing.assert_allclose(found["GPHDT"], np.arange(40) + 0.5)
    np.testing.assert_allclose(found["IIHDT"], np.arange(40) + 0.5)


@pytest.mark.slow
def test_blocks_of_any_size_tell_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    draw = np.random.default_rng(5)
    data = log(draw)
    path = tmp_path / "a.nmea"
    for ends in (b"\r\n", b"\n", b"\r"):
        path.write_bytes(data.replace(b"\r\n", ends).rstrip())
        whole = said(listen(path))
        for size in (301, 5000):
            monkeypatch.setattr(lines, "_BLOCK", size)
            parts = said(listen(path))
            assert {**parts, "about": ""} == {**whole, "about": ""}
        monkeypatch.undo()


def test_decimals_are_those_of_python() -> None:
    draw = np.random.default_rng(3)
    texts = [f"{draw.uniform(0, 10 ** draw.integers(0, 8)):.{draw.integers(0, 14)}f}" for _ in range(2000)]
    texts += ["", ".", "5.", ".5", "000", "1.2.3", "1e3", "0" * 30, "9" * 15, "9" * 16, "٣"]
    raw = [text.encode() for text in texts]
    width = np.array([len(one) for one in raw])
    found = decimals(np.frombuffer(b"".join(raw) + bytes(WIDEST), np.uint8), np.cumsum(width) - width, width)
    sure = 0
    for text, value, wrong, odd in zip(texts, found.value, found.wrong, found.odd, strict=True):
        if not odd and text.isascii() and sum(map(str.isdigit, text)):
            number = text.replace(".", "", 1).isdigit()
            assert wrong == (not number), text
            assert not number or value == float(text), text
            sure += number
    assert sure > 1500
    assert found.odd[[len(texts) - 4, len(texts) - 2]].all()


def test_rows_are_alike_where_their_bytes_are() -> None:
    words = [b"abc", b"abd", b"abc", b"ab", b"abc", b"abd", b"x"]
    width = np.array([len(one) for one in words])
    data = np.frombuffer(b"".join(words), np.uint8)
    start = np.cumsum(width) - width
    assert sorted(rows.tolist() for rows in alike(data, start, width)) == [[0, 2, 4], [1, 5], [3], [6]]
    beside = np.array([0, 0, 1, 0, 0, 0, 0], np.uint64)
    assert sorted(rows.tolist() for rows in alike(data, start, width, beside, 2)) == [[0, 4], [1, 5]]


@pytest.mark.slow
def test_memory_is_flat_with_the_file(tmp_path: Path) -> None:
    """Of what is not read nothing is kept; of readings the numbers: place, stamp and value of a heading."""
    path, most = tmp_path / "a.nmea", list[int]()
    for size in (60_000, 60_000, 180_000):
        path.write_bytes(b"".join(signed(f"HEHDT,{k % 360}.0,T") + b"\r\n" for k in range(size)))
        tracemalloc.start()
        assert listen(path).sentences == size
        most.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert most[2] - most[1] < 120_000 * 24 * 3  # the parts and the whole, and an order to sort by


def test_tag_blocks_of_many_forms_are_all_taken_apart_at_once() -> None:
    """Sources, the width of a number and what else is told make forms; more than are looked for one by one, too."""
    for forms in (2, 40):
        texts = [tag_block(Tag(f"{chr(65 + k % forms % 26)}{chr(65 + k % forms // 26)}01", k % 10, 1793275200.5 + k))
                 for k in range(200)]  # fmt: skip
        data = np.frombuffer(b"".join(texts) + b"\0" * 30, np.uint8)
        width = np.array([len(one) for one in texts])
        times, begins, sources = tag_times(data, np.cumsum(width) - width, width)
        assert times == pytest.approx(1793275200.5 + np.arange(200.0))
        assert (begins == np.cumsum(width) - width).all()
        assert len(set(sources.tolist())) == forms
