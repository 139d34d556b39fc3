"""Files are told by what is in them, and those that are not read by the program that converts them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatrial.data import DataError
from seatrial.data.formats import formats, recordings
from seatrial.data.guess import guess
from seatrial.data.importing import import_log
from seatrial.data.recognise import recognise
from seatrial.testing.logs import log_examples
from seatrial.workflow import RequestError
from seatrial.workflow.data import importing

SPOKEN = "$HEHDT,34.8,T*10\r\n$GPGGA,080100.00,6228.1999,N,00609.0002,E,2,09,1.0,4.0,M,45.0,M,,*60\r\n" * 3
BY_CONTENT = ("n2k", "moos", "signalk", "gpx", "dataflash")
TABLE = "Time,HDG,RUD\n0.0,10.0,1.0\n1.0,11.0,1.0\n2.0,12.0,1.0\n"
NAMED = {
    b"\x1b\x01\x03\xad\x59": "EBL", b"LOGG": "BLF",
    b"\xaa\x44\x12\x1c": "NovAtel", b"$@\x00\x01": "Septentrio", b"\xb5\x62\x01": "UBX", b"\xff\x5a": "SBG",
    b"\xfa\xff": "Xsens",
    b"CDF\x01": "netCDF", b"\x89HDF\r\n\x1a\n": "HDF5", b"# Created by Octave 6.4.0\n# name: t\n": "Octave",
    b"SQLite format 3\0": "SQLite", b"\x1f\x8b\x08": "gzip",
    b"\x0a\x0d\x0d\x0a": "pcapng", b"TDSm": "TDMS",
    b"!Boat,Utc,BSP\n!boat,0,1\n0,46352.5,1,6.2\n": "Expedition",
    b"2026-05-01 09:00:00.00: ATT {Yaw : 40.00}\n" * 4: "mavlogdump", b'"TOA5","a","b"\n': "Campbell",
    b"<html><body><table>\n": "HTML", b'<?xml version="1.0"?>\n<kml xmlns="http://www.opengis.net/kml/2.2">\n': "KML",
    b'{"ts": 1.5, "heading": 40.0}\n' * 4: "JSON",
    b"GPRMC,073012.00,A,6326.4,N,01025.2,E,5.0,40.0,140524,,,A*6C\n" * 4: "without the $",
    b'{"class":"VERSION","release":"3.25"}\n' + b'{"class":"TPV","device":"/dev/ttyUSB0","mode":3}\n' * 4: "gpsd",
}  # fmt: skip


@pytest.mark.parametrize("format", BY_CONTENT)
def test_an_example_of_each_format_is_told_under_any_name(format: str, tmp_path: Path) -> None:
    file = tmp_path / "log.xyz"
    file.write_text(log_examples()[format].example, encoding="utf-8")
    known = recognise(file)
    assert known is not None
    assert known.format == format
    assert importing(str(file), None, tmp_path) == (format, file, tmp_path)
    assert guess(file).format == format


@pytest.mark.parametrize("head", NAMED)
def test_what_is_not_read_is_named_with_a_way_on(head: bytes, tmp_path: Path) -> None:
    file = tmp_path / "log.dat"
    file.write_bytes(head)
    known = recognise(file)
    assert known is not None
    assert NAMED[head] in known.name
    assert known.format == ""
    assert known.way
    with pytest.raises(DataError, match="which is not read"):
        guess(file)


@pytest.mark.parametrize("content", [TABLE, TABLE.replace(",", ";"), "", "{}", "A 1 2\nB 2 3\n", "\0" * 100, "<xml>"])
def test_a_table_or_nothing_known_is_none_of_them(content: str, tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_text(content, encoding="utf-8")
    assert recognise(file) is None


def test_a_table_alone_needs_a_mapping(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_text(TABLE, encoding="utf-8")
    with pytest.raises(RequestError, match="--guess"):
        importing(str(file), None, tmp_path)


def test_a_log_under_a_wrong_format_is_named_in_the_refusal(tmp_path: Path) -> None:
    file = tmp_path / "log.nmea"
    file.write_text(log_examples()["signalk"].example, encoding="utf-8")
    with pytest.raises(DataError, match=r"is a log of Signal K: seatrial import signalk"):
        import_log("nmea", file, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_what_is_told_by_content_has_a_reader() -> None:
    assert set(BY_CONTENT) <= set(formats())


@pytest.mark.parametrize("seed", range(20))
def test_a_voyage_recorder_is_known_and_noise_is_not(seed: int, tmp_path: Path) -> None:
    """Records of 8 bytes, fast packets, orders and service records, by the layout that others have read."""
    draw, path, now = np.random.default_rng(seed), tmp_path / "00020001.DAT", 0
    out = bytearray()
    for _ in range(60):
        now = (now + int(draw.integers(0, 900))) % 60000
        pgn, size = ((127250, 8), (129029, 0), (59904, 3), (0, 8))[draw.choice(4, p=[0.7, 0.1, 0.1, 0.1])]
        number = 0xFFFFFFFF if pgn == 0 else 0x08000000 | pgn << 8 | int(draw.integers(0, 250))
        length = int(draw.integers(9, 60))
        data = bytes([int(draw.integers(0, 256)), length]) + draw.bytes(length) if size == 0 else draw.bytes(size)
        out += now.to_bytes(2, "little") + number.to_bytes(4, "little") + data
    path.write_bytes(bytes(out))
    known = recognise(path)
    assert known is not None
    assert known.format == "n2k"
    path.write_bytes(draw.bytes(3000))
    assert recognise(path) is None
    for byte in (b"\x00", b"\xff\x00"):
        path.write_bytes(byte * 3000)
        assert recognise(path) is None


@pytest.mark.parametrize("line", [
    "05/01/2026,12:00:00.250,$GPGLL,3507.407,N,13945.925,E,,A", "$HEHDT,101.3,T",
    "!AIVDM,1,1,,A,13u?etPv2;0n:dDPwUM1U,0",
    "2026-05-01T12:00:00.250Z $INHDT,101.3,T*29",
])  # fmt: skip
@pytest.mark.parametrize("name", ["scs.raw", "gyro.dat", "log"])
def test_sentences_are_told_by_their_form(line: str, name: str, tmp_path: Path) -> None:
    file = tmp_path / name
    file.write_text(f"{line}\r\n" * 5, encoding="utf-8")
    assert importing(str(file), None, tmp_path)[0] == "nmea"


def test_a_line_that_was_cut_off_leaves_a_log_what_it_is(tmp_path: Path) -> None:
    """A logger without power leaves bytes of zero; a file full of them is no text."""
    lines = b"(1778751667.1%02d) can0 09F8017F#50C3A2D2B8A9A900\n"
    file = tmp_path / "a.log"
    file.write_bytes(b"".join(lines % k for k in range(99)) + b"\0\x17\n" + lines % 99)
    assert importing(str(file), None, tmp_path)[0] == "n2k"
    file.write_bytes(b"".join(lines % k + b"\0\0" for k in range(99)))
    with pytest.raises(RequestError):
        importing(str(file), None, tmp_path)


def test_sentences_in_a_folder_are_logs_whatever_their_files_are_called(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text(SPOKEN)
    (tmp_path / "b.log").write_text(SPOKEN)
    (tmp_path / "notes.txt").write_text("Calm, and a slight swell.\nTwo circles, one zigzag.\n")
    (tmp_path / "c.raw").write_text("(0.000) can0 09F8017F#50C3A2D2B8A9A900\n" * 9)
    assert [path.name for path in recordings("nmea", tmp_path)] == ["a.txt", "b.log"]
    (tmp_path / "a.nmea").write_text(SPOKEN)  # whoever names some of them so means these
    assert [path.name for path in recordings("nmea", tmp_path)] == ["a.nmea"]
    with pytest.raises(DataError, match="no file"):
        recordings("signalk", tmp_path)
