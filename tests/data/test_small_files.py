"""Small files that hold much: the program counts what is inside, and says so in one line.

Each is given to the real command in a process of its own, whose peak of memory is measured; a time limit only ends it.
"""

from __future__ import annotations

import io
import json
import os
import random
import re
import socket
import sqlite3
import struct
import zipfile
from collections.abc import Callable
from contextlib import closing
from fnmatch import fnmatchcase
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from peaks import MEMORY, peak

from seatrial.core.files import TomlError, toml_of
from seatrial.core.unpacking import most, unpacked
from seatrial.data import DataError
from seatrial.data.documents import read_json
from seatrial.data.formats import usv_asw
from seatrial.data.formats.csv import read_all, read_mapping
from seatrial.data.guess import guess
from seatrial.data.inside import hold_parquet, hold_workbook
from seatrial.data.mapping.recordings import _component, _named
from seatrial.data.robot.files import opened
from seatrial.data.table import existing
from seatrial.environment.chart import crosses, inside, nearest, offshore
from seatrial.environment.geojson import load_chart
from seatrial.environment.grid import Size, grid_of
from workbooks import voyage, write_workbook

MAPPING = (
    'schema = "seatrial-mapping/1"\ntime = { column = "t", unit = "s" }\n[channels.psi]\ncolumn = "h"\nunit = "deg"\n'
)


# -- TOML


@pytest.mark.parametrize(
    "text",
    ["a." * 5000 + "a = 1", "a . " * 5000 + "a = 1", '"a".' * 5000 + "a = 1", f"[{'a.' * 5000}a]",
     f"x = {{ {'a.' * 5000}a = 1 }}", "".join(f"k{k}.{'a.' * 40}a = 1\n" for k in range(5))],
)  # fmt: skip
def test_a_key_of_thousands_of_parts_is_refused_before_it_is_parsed(text: str) -> None:
    with pytest.raises(TomlError, match=r"line 1: a key of over \d+ parts"):
        toml_of(text)


def test_the_keys_and_texts_of_honest_files_are_read() -> None:
    said = 'a.b."c.d".e = "1.2.3"\n[x.y.z]\nnote = "One. Two. Three and four. Five..."\n# a.b.c\n'
    assert toml_of(said)["a"]["b"]["c.d"]["e"] == "1.2.3"


@pytest.mark.parametrize("text", ["a = " + "[" * 9000, "a = " + "9" * 9000, "a = 0x" + "f" * 9000, "a = 1e99999\n[b"])
def test_depths_digits_and_exponents_of_toml_end_in_one_line(text: str) -> None:
    with pytest.raises(ValueError, match=r"^[^\n]+$"):
        toml_of(text)


# -- archives


def npz(shape: tuple[int, ...], body: bytes = b"", **more: bytes) -> bytes:
    """An archive with an array that is said to have a shape."""
    held = io.BytesIO()
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header) + 1) + header + b"\n" + body)
        for name, content in more.items():
            archive.writestr(f"{name}.npy", content)
    return held.getvalue()


@pytest.mark.slow
def test_arrays_hold_what_their_bytes_hold() -> None:
    held = io.BytesIO()
    np.savez(held, a=np.arange(12.0).reshape(3, 4), b=np.array("text"))
    found = unpacked(held.getvalue())
    assert np.array_equal(found["a"], np.arange(12.0).reshape(3, 4))
    assert str(found["b"]) == "text"
    with pytest.raises(ValueError, match="said to have the shape"):
        unpacked(npz((10**15,)))
    with pytest.raises(ValueError, match="said to have the shape"):
        unpacked(npz((3, 5), bytes(8 * 14)))
    assert unpacked(npz((3, 5), bytes(8 * 15)))["a"].shape == (3, 5)
    with pytest.raises(ValueError, match="MB are the most"):
        unpacked(npz((10**7,), bytes(8 * 10**7)))
    objects = io.BytesIO()
    np.savez(objects, a=np.array([{}]))
    with pytest.raises(ValueError, match="objects"):
        unpacked(objects.getvalue())


def test_what_a_file_may_hold_grows_with_it() -> None:
    assert most(0) == most(1000) < MEMORY / 4
    assert most(10**9) == 100 * 10**9


# -- tables


def parquet(path: Path, frame: object, **how: object) -> Path:
    frame.write_parquet(path, **how)  # pyright: ignore
    return path


@pytest.mark.slow
def test_rows_pages_and_texts_of_parquet_are_counted(tmp_path: Path) -> None:
    pl = pytest.importorskip("polars")
    path = tmp_path / "a.parquet"
    rng = np.random.default_rng(0)
    hold_parquet(parquet(path, pl.DataFrame({"a": rng.normal(size=50_000), "s": ["on", "off"] * 25_000, "n": None})))
    for frame in ({"a": np.zeros(9_000_000)}, {"s": ["x" * 100_000] * 800}, {"s": ["x" * 70_000_000]}):
        with pytest.raises(DataError, match="MB are the most"):
            hold_parquet(parquet(path, pl.DataFrame(frame)))
    raw = path.read_bytes()
    for k in range(1, 40):  # cut, and changed in its footer
        path.write_bytes(raw[:-k])
        with pytest.raises(DataError):
            hold_parquet(path)


def sheet(path: Path, cells: str, packed: bool = True) -> Path:
    """A workbook of one sheet, from the XML of its rows."""
    write_workbook(path, voyage(rows=3))
    with zipfile.ZipFile(path) as archive:
        held = {name: archive.read(name) for name in archive.namelist()}
    name = next(one for one in held if re.search(r"worksheets/sheet\d*\.xml", one))
    rows = f"<sheetData>{cells}</sheetData>".encode()
    held[name] = re.sub(rb"<sheetData>.*</sheetData>", rows, held[name], flags=re.DOTALL)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in held.items():
            archive.writestr(name, content)
    return path


def test_the_rectangle_of_a_sheet_is_counted(tmp_path: Path) -> None:
    path = tmp_path / "a.xlsx"
    write_workbook(path, voyage(rows=300))
    hold_workbook(path)
    first = '<row r="1"><c r="A1"><v>1</v></c></row>'
    hold_workbook(sheet(path, first + '<row r="2000"><c r="C2000"><v>1</v></c></row>'))
    for last in ("XFD1048576", "ZZ99999"):
        with pytest.raises(DataError, match="spans"):
            hold_workbook(sheet(path, f'{first}<row r="9"><c r="{last}"><v>1</v></c></row>'))
    with pytest.raises(DataError, match="place"):
        hold_workbook(sheet(path, first + '<row r="2"><c r="&#65;1"><v>1</v></c></row>'))


@pytest.mark.parametrize(
    "text",
    ['t,h\n0,1\n"' + "1" * 200_000 + '",2\n', '"t","h' + "h" * 200_000 + '"\n0,1\n1,2\n',
     "t,h\n0,1\n1," + "2" * 200_000 + "\n", 't,h\n0,"' + '"' * 200_000 + "\n"],
)  # fmt: skip
def test_a_cell_longer_than_any_reader_takes_is_one_line(tmp_path: Path, text: str) -> None:
    path, mapping = tmp_path / "a.csv", tmp_path / "m.toml"
    path.write_text(text)
    mapping.write_text(MAPPING)
    for read in (guess, lambda one: read_all(one, read_mapping(mapping))):
        with pytest.raises(DataError, match=r"^[^\n]+$"):
            read(path)


# -- names and patterns


@pytest.mark.slow
def test_a_pattern_means_what_a_shell_means_by_it() -> None:
    rng = random.Random(0)
    for _ in range(800):
        pieces = ["a", "b", "*", "?", ".", "[ab]", "[!a]", "[z-a]"]
        pattern = "".join(rng.choice(pieces) for _ in range(rng.randint(1, 8)))
        name = "".join(rng.choice("ab.") for _ in range(rng.randint(1, 8)))
        assert (re.fullmatch(_component(pattern), name) is not None) == fnmatchcase(name, pattern), (pattern, name)


def test_many_stars_end() -> None:
    """A star that is tried again for each place of the next takes the power of their number."""
    here = Path("/tmp") / ("a" * 200)
    assert _named(here, "*a" * 40 + "b") is None
    assert _named(here, "{trial}" + "*a" * 40 + "b") is None
    assert _named(Path("/x/run7_psi_3.csv"), "{trial}_*.csv") == "run7_psi"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes on this system")
def test_pipes_sockets_and_devices_are_no_files(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "x.csv")
    with closing(socket.socket(socket.AF_UNIX)) as one:
        os.chdir(tmp_path)
        one.bind("y.csv")
        for path in (tmp_path / "x.csv", Path("y.csv"), Path("/dev/zero")):
            with pytest.raises(DataError, match="is a pipe, a socket or a device"):
                existing(path)


def test_a_loop_of_links_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.csv").symlink_to(tmp_path / "b.csv")
    (tmp_path / "b.csv").symlink_to(tmp_path / "a.csv")
    with pytest.raises(DataError, match="no such file"):
        existing(tmp_path / "a.csv")


# -- robots


@pytest.mark.slow
def test_chunks_of_mcap_are_counted(tmp_path: Path) -> None:
    zstandard = pytest.importorskip("zstandard")
    magic = b"\x89MCAP0\r\n"

    def log(compression: str, said: int, data: bytes) -> Path:
        body = struct.pack("<QQQII", 0, 0, said, 0, len(compression)) + compression.encode()
        body += struct.pack("<Q", len(data)) + data
        records = b"\x01" + struct.pack("<QII", 8, 0, 0) + b"\x06" + struct.pack("<Q", len(body)) + body
        path = tmp_path / "a.mcap"
        path.write_bytes(magic + records + magic)
        return path

    zeros = bytes(80_000_000)
    tiny = (b"\x05" + struct.pack("<QHIQQ", 22, 1, 0, 0, 0)) * 250_000
    for path in (
        lambda: log("zstd", len(zeros), zstandard.compress(zeros)),
        lambda: log("zstd", 10, zstandard.compress(zeros)),
        lambda: log("lz4", 10, pytest.importorskip("lz4.frame").compress(zeros)),
        lambda: log("zstd", len(tiny), zstandard.compress(tiny)),
    ):
        with pytest.raises(DataError, match=r"^[^\n]+$"), opened(path()) as bag:
            list(bag.messages)


def bag(folder: Path, name: str, content: bytes, mode: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / name).write_bytes(content)
    (folder / "metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n"
        f"  relative_file_paths:\n    - {name}\n  duration: {{nanoseconds: 0}}\n"
        "  starting_time: {nanoseconds_since_epoch: 0}\n  message_count: 0\n  topics_with_message_count: []\n"
        f"  compression_format: {'zstd' if mode else repr('')}\n  compression_mode: {mode or repr('')}\n"
    )
    return folder


def database(path: Path, *statements: str, data: bytes = b"") -> bytes:
    with closing(sqlite3.connect(path)) as base:
        for one in statements:
            base.execute(one)
        if data:
            base.execute("INSERT INTO messages VALUES (1, 1, 1, ?)", (data,))
        base.commit()
    return path.read_bytes()


MESSAGES = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)"


@pytest.mark.slow
def test_databases_of_a_bag_are_counted_and_make_up_no_rows(tmp_path: Path) -> None:
    zstandard = pytest.importorskip("zstandard")
    pytest.importorskip("rosbags")
    zeros = zstandard.compress(bytes(80_000_000))
    endless = "CREATE VIEW endless AS WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT x FROM n"
    made = "CREATE TABLE t(a, b GENERATED ALWAYS AS (zeroblob(1000000000)))"
    cases = (
        (bag(tmp_path / "a", "a.db3.zstd", zeros, "FILE"), "MB are the most"),
        (bag(tmp_path / "b", "b.db3", database(tmp_path / "b.db3", MESSAGES, data=zeros), "MESSAGE"), "are the most"),
        (bag(tmp_path / "c", "c.db3", database(tmp_path / "c.db3", MESSAGES, endless), ""), "makes up rows"),
        (bag(tmp_path / "d", "d.db3", database(tmp_path / "d.db3", MESSAGES, made), ""), "makes up rows"),
    )
    for folder, words in cases:
        with pytest.raises(DataError, match=words), opened(folder) as found:
            list(found.messages)


# -- charts


def chart(path: Path, kind: str, points: object, **more: object) -> Path:
    shape = "Polygon" if kind == "depth" else "LineString"
    feature = {"type": "Feature", "properties": {"kind": kind, **more},
               "geometry": {"type": shape, "coordinates": [points] if kind == "depth" else points}}  # fmt: skip
    path.write_text(json.dumps({"type": "FeatureCollection", "schema": "seatrial-chart/1", "frame": "metres",
                                "depth": 20.0, "features": [feature]}))  # fmt: skip
    return path


FENDER = {"curve": "cone", "height": 1.0, "reaction": 1e6, "spacing": 20.0}


@pytest.mark.parametrize(
    ("points", "more", "words"),
    [
        ([[0, k] for k in range(200_001)], {}, "1000000 are the most of such a file"),
        ([[0, 0], [0, 400]], {"fender": {**FENDER, "spacing": 1e-9}}, "fenders 1e-09 m apart"),
        ([[0, 0], [0, 400]], {"bollards": 1e-9}, "bollards 1e-09 m apart"),
        ([[0, 0], [0, 10**400]], {}, "a number of 401 digits"),
    ],
)
def test_points_and_posts_of_a_chart_are_counted(tmp_path: Path, points: object, more: dict, words: str) -> None:
    with pytest.raises(ValueError, match=words) as caught:
        load_chart(chart(tmp_path / "a.geojson", "quay", points, **more))
    assert "\n" not in str(caught.value)


def test_fenders_within_reach_of_a_ship_are_counted(tmp_path: Path) -> None:
    dense = load_chart(chart(tmp_path / "a.geojson", "quay", [[0, 0], [0, 400]], fender={**FENDER, "spacing": 1.0}))
    with pytest.raises(ValueError, match="fenders or corners within reach"):
        grid_of(dense, Size(320.0, 58.0, 20.8))


def test_a_number_of_json_has_nineteen_digits(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text('{"a": ' + "9" * 4000 + "}")
    with pytest.raises(DataError, match="a number of 4000 digits"):
        read_json(tmp_path / "a.json")


Places = NDArray[np.float64]


def coast(count: int, seed: int) -> Places:
    """A line of many sides that winds and does not cross itself."""
    rng = np.random.default_rng(seed)
    along = np.cumsum(rng.uniform(1.0, 20.0, count))
    return np.column_stack([along, 60.0 * np.sin(along / 90.0) + rng.uniform(-4.0, 4.0, count)])


def segment_distance(p: Places, a: Places, b: Places) -> float:
    s = float(np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0))
    return float(np.linalg.norm(p - a - s * (b - a)))


@pytest.mark.parametrize("count", [2, 7, pytest.param(150, marks=pytest.mark.slow)])
def test_the_nearest_side_of_a_grid_of_places_is_that_of_each_place(count: int) -> None:
    line = coast(count, count)
    north, east = np.meshgrid(np.linspace(-200.0, 1700.0, 41), np.linspace(-300.0, 300.0, 37), indexing="ij")
    off, x, y = nearest(line, north, east)
    signed = offshore(line, north, east)
    rng = np.random.default_rng(1)
    for i, j in zip(rng.integers(0, 41, 60), rng.integers(0, 37, 60), strict=True):
        p = np.array([north[i, j], east[i, j]])
        away = [segment_distance(p, a, b) for a, b in pairwise(line)]
        assert off[i, j] == pytest.approx(min(away), abs=1e-9)
        foot = p + off[i, j] * np.array([x[i, j], y[i, j]])
        assert min(segment_distance(foot, a, b) for a, b in pairwise(line)) < 1e-6
        assert abs(signed[i, j]) == pytest.approx(min(away), abs=1e-9)
    # to starboard of a line that runs north is east of it, away from its ends
    beside = (north > line[0, 0] + 200.0) & (north < line[-1, 0] - 200.0) & (np.abs(east) > 150.0)
    assert (np.sign(signed[beside]) == np.sign(east[beside])).all()


@pytest.mark.parametrize("count", [3, 200])
def test_what_lies_in_a_polygon_is_where_its_turns_add_up_to_one(count: int) -> None:
    """The angle that an outline turns about a place is 2 pi inside and 0 outside."""
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    size = 100.0 + 30.0 * np.random.default_rng(2).uniform(-1.0, 1.0, count)
    outline = np.column_stack([size * np.cos(angle), size * np.sin(angle)])
    north, east = np.meshgrid(np.linspace(-140.0, 140.0, 33), np.linspace(-140.0, 140.0, 29), indexing="ij")
    found = inside(outline, north, east)
    ring = np.vstack([outline, outline[:1]])
    turned = np.arctan2(ring[:, 1] - east[..., None], ring[:, 0] - north[..., None])
    steps = np.diff(turned, axis=-1)
    winds = np.abs(((steps + np.pi) % (2.0 * np.pi) - np.pi).sum(axis=-1)) > np.pi
    assert np.array_equal(found, winds)


@pytest.mark.parametrize(("a", "b"), [(3, 130), (64, 128), (0, 199), (70, 72)])
def test_a_line_that_crosses_itself_is_told_by_its_sides(a: int, b: int) -> None:
    """A straight line whose last point is put across an earlier side."""
    line = np.column_stack([np.arange(b + 2.0), np.zeros(b + 2)])
    line[b] = [a + 0.5, 5.0]
    line[b + 1] = [a + 0.5, -5.0]
    assert crosses(line) == (a + 1, b + 1)
    assert crosses(line[: b + 1]) is None


# -- the command


Making = Callable[[Path], list[str]]


def _wide(folder: Path) -> list[str]:
    pl = pytest.importorskip("polars")
    parquet(folder / "a.parquet", pl.DataFrame({"t": np.zeros(40_000_000)}))
    return ["check", "a.parquet"]


def _far_cell(folder: Path) -> list[str]:
    sheet(folder / "a.xlsx", '<row r="1"><c r="A1"/></row><row r="1048576"><c r="XFD1048576"><v>1</v></c></row>')
    (folder / "m.toml").write_text(MAPPING)
    return ["import", "csv", "a.xlsx", "--mapping", "m.toml", "-o", "out"]




def _pipe(folder: Path) -> list[str]:
    os.mkfifo(folder / "x.csv")
    return ["check", "x.csv"]


def _dotted(kind: str, *before: str) -> Callable[[Path], list[str]]:
    def made(folder: Path) -> list[str]:
        (folder / "a.toml").write_text(f'schema = "seatrial-{kind}/1"\n' + "a." * 50_000 + "a = 1\n")
        (folder / "a.csv").write_text("t,h\n0,1\n1,2\n")
        return [*before, *(["-o", "out"] if before[0] in ("import", "identify") else [])]

    return made


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak of memory is read from /proc")
@pytest.mark.parametrize(
    "make",
    [_wide, _far_cell, _pipe, _dotted("ship", "show", "a.toml"), _dotted("study", "identify", "a.toml"),
     _dotted("mapping", "import", "csv", "a.csv", "--mapping", "a.toml")],
)  # fmt: skip
def test_a_small_file_takes_little_and_is_refused_in_one_line(make: Making, tmp_path: Path) -> None:
    status, memory, said = peak(make(tmp_path), tmp_path)
    assert (status, len(said.splitlines())) == (2, 1), said
    assert memory < MEMORY
    assert sum(one.stat().st_size for one in tmp_path.rglob("*") if one.is_file()) < 2e6


def test_a_workbook_is_counted_before_any_reader_opens_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By a guess, by a mapping, by the reader of a public set: none unpacks what holds too much."""
    seen: list[Path] = []
    monkeypatch.setattr("polars.read_excel", lambda path, **_: seen.append(path))
    monkeypatch.setattr("fastexcel.read_excel", lambda path, **_: seen.append(path))
    first = '<row r="1"><c r="A1"><v>1</v></c></row>'
    path = sheet(tmp_path / "a.xlsx", f'{first}<row r="9"><c r="ZZ99999"><v>1</v></c></row>')
    mapping = tmp_path / "m.toml"
    mapping.write_text(MAPPING)
    for read in (guess, usv_asw._sheet, lambda one: read_all(one, read_mapping(mapping))):
        with pytest.raises(DataError, match="spans"):
            read(path)
    assert seen == []
