"""Frames of NMEA 2000 in sentences, by gateways that send the last byte first and such that do not."""

from __future__ import annotations

import math
import struct
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.data.formats.nmea import read
from seatrial.data.nmea.carried import carried
from seatrial.data.nmea.heard import hear

ROWS = 60


def signed(content: str) -> str:
    return f"${content}*{reduce(xor, content.encode()):02X}"


def mxpgn(pgn: int, data: bytes, turned: bool, source: int = 0x23) -> str:
    """Priority 2, not sent on."""
    body = (data[::-1] if turned else data).hex().upper()
    return signed(f"MXPGN,{pgn:06X},{0x2000 | len(data) << 8 | source:04X},{body}")


def heading(raw: int) -> bytes:
    return struct.pack("<BHhhB", 7, raw % 62832, 0x7FFF, 0x7FFF, 0xFC)


def rudder(raw: int) -> bytes:
    return struct.pack("<BBhhH", 0, 0xFF, 0x7FFF, raw, 0xFFFF)


def log(tmp_path: Path, turned: bool, first: int = 10000, stamped: bool = False) -> Trial:
    """A turn at .01 rad/s with a swinging rudder, a second gyro 2 deg ahead; a fix or stamps have the clock."""
    out = list[str]()
    for k in range(ROWS):
        head = f"2026-11-26T12:00:{k:02d}.500Z " if stamped else ""
        said = [] if stamped else [f"GPRMC,1200{k:02d}.00,A,5900.00000,N,01000.00000,E,5.0,90.0,261126,,,A"]
        frames = ((127250, heading(first + 100 * k), 0x23), (127250, heading(first + 349 + 100 * k), 0x30),
                  (127245, rudder(round(3000 * math.sin(0.3 * k))), 0x23), (127505, b"\x00\x01", 0x23))  # fmt: skip
        out += [head + signed(one) for one in said]
        out += [head + mxpgn(pgn, data, turned, source) for pgn, data, source in frames]
    path = tmp_path / "a.nmea"
    path.write_text("\r\n".join(out) + "\r\n")
    return read(path)


@pytest.mark.parametrize("stamped", [False, True], ids=["by the fix", "by stamps"])
@pytest.mark.parametrize("turned", [True, False], ids=["last byte first", "first byte first"])
def test_frames_of_a_miniplex_are_read_in_their_order(tmp_path: Path, turned: bool, stamped: bool) -> None:
    trial = log(tmp_path, turned, stamped=stamped)
    assert trial.t == pytest.approx(np.arange(ROWS), abs=1e-6)
    assert trial["psi"] == pytest.approx(1.0 + 0.01 * np.arange(ROWS), abs=1e-9)
    truth = [1e-4 * round(3000 * math.sin(0.3 * k)) for k in range(ROWS)]
    assert trial["delta"] == pytest.approx(np.array(truth), abs=1e-12)
    assert f"bytes of MXPGN with the {'last' if turned else 'first'} one first" in trial.meta["processing"]
    assert "differs by +2 deg" in trial.meta["sources"]["heading"]
    assert trial.meta["ignored"]["PGN 127505"] == ROWS
    assert trial.meta["lines"]["invalid"] == 0


@pytest.mark.parametrize("first", [0, 25600, 62000])
def test_the_order_is_told_whatever_the_heading_is(tmp_path: Path, first: int) -> None:
    for turned in (True, False):
        trial = log(tmp_path, turned, first)
        assert np.cos(trial["psi"] - 1e-4 * first - 0.01 * np.arange(ROWS)) == pytest.approx(1.0, abs=1e-7)


@pytest.mark.parametrize("turned", [True, False])
def test_a_heading_that_stays_is_told_by_the_order_that_has_one(tmp_path: Path, turned: bool) -> None:
    """Rates that are the same from both ends tell no order, and are doubted."""
    path = tmp_path / "a.nmea"
    lines = [f"2026-11-26T12:00:{k:02d}Z " + mxpgn(127250, heading(10000), turned) for k in range(20)]
    path.write_text("\n".join(lines))
    assert read(path)["psi"] == pytest.approx(1.0)
    lines = [f"2026-11-26T12:00:{k:02d}Z " + mxpgn(127251, bytes([k, 1, 1, 1, 1, 1, 1, k]), turned) for k in range(20)]
    path.write_text("\n".join(lines))
    assert any(step.startswith("doubt: nothing that moves tells the order") for step in read(path).meta["processing"])


def test_seasmart_among_sentences_has_their_clock(tmp_path: Path) -> None:
    lines = list[str]()
    for k in range(ROWS):
        lines += [signed(f"GPRMC,1200{k:02d}.00,A,5900.00000,N,01000.00000,E,5.0,90.0,261126,,,A"),
                  signed(f"PCDIN,01F112,{999 * k:08X},23,{heading(10000 + 100 * k).hex().upper()}")]  # fmt: skip
    path = tmp_path / "a.nmea"
    path.write_text("\n".join(lines))
    assert read(path)["psi"] == pytest.approx(1.0 + 0.01 * np.arange(ROWS), abs=1e-9)


@pytest.mark.parametrize(
    "content", ["MXPGN,01F112,2823,07F342", "MXPGN,01F112,xx,07", "MXPGN,01F112", "PCDIN,01F112,0,23,0"]
)  # fmt: skip
def test_a_sentence_whose_bytes_are_not_as_many_as_it_says_has_no_frame(content: str) -> None:
    assert carried(hear(signed(content).encode()), 0, math.nan) is None
