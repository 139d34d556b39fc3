"""Files of arrays that lie about what they hold, or are damaged: one line, and no more memory than they are worth."""

from __future__ import annotations

import io
import random
import struct
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mat_by_hand import Opaque, Run, Version5, version73
from peaks import MEMORY, peak

from seatrial.data import DataError
from seatrial.data.sheets import sheets_of

T = np.arange(40) * 0.5
PLAIN = {"t": T, "a": 2.0 * T}
TREE = {"L": np.array([5.0]), "log": {**PLAIN, "names": ["x", "y"], "M": np.stack([T, T], 1)},
        "run": Run([{"t": T, "s": "abc"}, {"t": T, "s": "d"}]), "o": Opaque("table")}  # fmt: skip
HEAD = Version5().file({})


def packed(inner: bytes) -> bytes:
    body = zlib.compress(inner)
    return HEAD + struct.pack("<II", 15, len(body)) + body


def element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)


def matrix(what: int, shape: tuple[int, ...], rest: bytes) -> bytes:
    flags = element(6, struct.pack("<II", what, 0)) + element(5, struct.pack(f"<{len(shape)}i", *shape))
    return element(14, flags + element(1, b"long_name") + rest)


def nested(depth: int) -> bytes:
    inner = matrix(6, (1, 1), element(9, bytes(8)))
    for _ in range(depth):
        inner = matrix(1, (1, 1), inner)
    return inner


def hdf(make: Any) -> bytes:
    h5py = pytest.importorskip("h5py")
    held = io.BytesIO()
    with h5py.File(held, "w", userblock_size=512) as file:
        make(file)
    return b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM" + held.getvalue()[128:]


def linked(file: Any) -> None:
    import h5py

    file["x"] = h5py.ExternalLink("/etc/passwd", "/x")


def circular(file: Any) -> None:
    file.create_group("a")
    file["a/b"] = file["a"]


def outside(file: Any) -> None:
    file.create_dataset("x", (100,), dtype="f8", external=[("/etc/passwd", 0, 800)])


def many(file: Any) -> None:
    import h5py

    one = file.create_dataset("#refs#/a", data=1.0)
    cell = file.create_dataset("c", data=np.full(21_000, one.ref, dtype=h5py.ref_dtype), dtype=h5py.ref_dtype)
    cell.attrs["MATLAB_class"] = np.bytes_("cell")


def deep(file: Any) -> None:
    file.create_group("/".join("a" * 40))


def npy(shape: object, descr: object, body: bytes = b"", version: int = 1) -> bytes:
    said = f"{{'descr': {descr!r}, 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY" + bytes((version, 0)) + struct.pack("<H", len(said)) + said + body


def npz(**members: bytes) -> bytes:
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as made:
        for name, body in members.items():
            made.writestr(f"{name}.npy", body)
    return held.getvalue()


DOUBLES = element(9, T.tobytes())
HOSTILE = {
    "a bomb.mat": (lambda: packed(matrix(6, (1, 16_000_000), element(9, bytes(128_000_000)))), "holds more than"),
    "many bombs.mat": (lambda: HEAD + 4 * packed(matrix(6, (1, 2_500_000), element(9, bytes(20_000_000))))[128:],
                       "holds more than"),
    "a huge size.mat": (lambda: HEAD + struct.pack("<II", 14, 2**31), "damaged, or cut off"),
    "a huge array.mat": (lambda: HEAD + matrix(6, (40_000, 40_000), DOUBLES), "1600000000 values that holds 40"),
    "a huge cell.mat": (lambda: HEAD + matrix(1, (2**30, 1), nested(1)), "no table"),
    "a huge structure.mat": (lambda: HEAD + matrix(2, (2**30, 2), element(5, struct.pack("<i", 8)) + element(1, b"")),
                             "no table"),
    "no length.mat": (lambda: HEAD + matrix(2, (1, 1), element(5, struct.pack("<i", 0)) + element(1, b"a")), "damaged"),
    "negative.mat": (lambda: HEAD + matrix(6, (-40, -1), DOUBLES), "values that holds"),
    "of texts.mat": (lambda: HEAD + matrix(4, (1, 1), element(6, struct.pack("<I", 2**31))), "no characters"),
    "a text of no size.mat": (lambda: HEAD + matrix(4, (), element(4, b"a\0")), "no table"),
    "another class.mat": (lambda: HEAD + matrix(12, (1, 40), DOUBLES), "class 12 and the type 9"),
    "deep.mat": (lambda: packed(nested(5000)), "within each other"),
    "many.mat": (lambda: packed(matrix(1, (1, 1), struct.pack("<II", 14, 0) * 300_000)), "more than 200000 elements"),
    "cut.mat": (lambda: packed(nested(3))[:-9], "damaged, or cut off"),
    "no head.mat": (lambda: b"MATLAB 5.0", "no MAT file of version 5, 7 or 7.3"),
    "a bomb 7.3.mat": (lambda: hdf(lambda file: file.create_dataset("x", (16_000_000,), dtype="f8", compression="gzip",
                                                                    data=np.zeros(16_000_000))), "holds more than"),
    "unwritten 7.3.mat": (lambda: hdf(lambda file: file.create_dataset("x", (10**12,), dtype="f8", chunks=(1000,))),
                          "holds more than"),
    "linked 7.3.mat": (lambda: hdf(linked), "a link to another place"),
    "outside 7.3.mat": (lambda: hdf(outside), "lies in another file"),
    "circular 7.3.mat": (lambda: hdf(circular), "within each other"),
    "deep 7.3.mat": (lambda: hdf(deep), "within each other"),
    "many 7.3.mat": (lambda: hdf(many), "more than 20000"),
    "huge.npy": (lambda: npy((10**15,), "<f8"), "is said to have the shape"),
    "of nothing.npy": (lambda: npy((10**12,), "|V0"), "is said to have the shape"),
    "of no texts.npy": (lambda: npy((10**9,), "<U0"), "is said to have the shape"),
    "of objects.npy": (lambda: npy((3,), "|O", b"cos\nsystem\n(S'true'\ntR."), "holds objects"),
    "objects inside.npy": (lambda: npy((1,), [("t", "<f8"), ("o", "|O")], bytes(16)), "holds objects"),
    "of no characters.npy": (lambda: npy((2,), [("t", "<f8"), ("s", "<U1")], b"\xff" * 24), "no characters"),
    "deep.npy": (lambda: npy("(" * 3000 + ")" * 3000, "<f8"), "not readable"),
    "short.npy": (lambda: npy((40,), "<f8", bytes(312)), "holds 312 bytes"),
    "a new version.npy": (lambda: npy((40,), "<f8", bytes(320), 9), "version"),
    "a bomb.npz": (lambda: npz(t=npy((16_000_000,), "<f8", bytes(128_000_000))), "MB are the most"),
    "of objects.npz": (lambda: npz(t=npy((3,), "|O", b"cos\nsystem\n")), "holds objects"),
    "no zip.npz": (lambda: b"PK\3\4" + bytes(50), "not readable"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", HOSTILE)
def test_what_lies_or_is_damaged_is_refused_in_one_line(name: str, tmp_path: Path) -> None:
    make, said = HOSTILE[name]
    (tmp_path / name).write_bytes(make())
    with pytest.raises(DataError) as told:
        sheets_of(tmp_path / name)
    text = str(told.value)
    assert text.startswith(f"{tmp_path / name}: ")
    assert said in text
    assert len(text.splitlines()) == 1


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak of memory is read from /proc")
@pytest.mark.parametrize("name", ["a bomb.mat", "a bomb 7.3.mat", "unwritten 7.3.mat", "many.mat", "a bomb.npz"])
def test_the_command_takes_little_memory(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(HOSTILE[name][0]())
    assert (tmp_path / name).stat().st_size < 2e6
    status, memory, said = peak(["import", "--guess", name, "-o", "m.toml"], tmp_path)
    assert (status, len(said.splitlines())) == (2, 1), said
    assert memory < MEMORY
    assert not (tmp_path / "m.toml").exists()


def mutated(raw: bytes, hand: random.Random) -> bytes:
    out = bytearray(raw)
    for _ in range(hand.choice((1, 1, 2, 5, 20))):
        at, how = hand.randrange(len(out)), hand.random()
        if how < 0.5:
            out[at] = hand.choice((0, 1, 127, 128, 255, hand.randrange(256)))
        elif how < 0.7:
            out[at : at + 4] = hand.choice((b"\xff" * 4, b"\0" * 4, b"\xff\xff\xff\x7f"))
        elif how < 0.85:
            del out[at : min(at + hand.randrange(1, 50), len(out) - 1)]
        else:
            out[at:at] = out[at : at + hand.randrange(1, 50)]
    return bytes(out)


def rows() -> bytes:
    table = np.zeros(30, dtype=[("t", "f8"), ("a", "i4"), ("s", "U3")])
    held = io.BytesIO()
    np.save(held, table)
    return held.getvalue()


SEEDS = {
    "v5.mat": lambda: Version5().file(TREE), "v7.mat": lambda: Version5(packed=True).file(TREE),
    "v73.mat": lambda: version73(TREE), "v73 packed.mat": lambda: version73(TREE, True), "rows.npy": rows,
    "some.npz": lambda: npz(t=npy((40,), "<f8", T.tobytes()), a=npy((40,), "<f8", T.tobytes())),
}  # fmt: skip


def survive(folder: Path, name: str, seeds: range) -> int:
    """The number of changed files that are read; all others are refused in one line."""
    raw, read, wrong = SEEDS[name](), 0, list[tuple[int, str]]()
    for seed in seeds:
        (folder / name).write_bytes(mutated(raw, random.Random(seed)))
        try:
            found = sheets_of(folder / name)
            read += all(found.one(one).height > 1 for one in found.names)
        except DataError as error:
            wrong += [(seed, str(error))] if len(str(error).splitlines()) != 1 else []
    assert not wrong
    return read


@pytest.mark.slow
@pytest.mark.parametrize("name", SEEDS)
def test_a_changed_file_is_read_or_refused(name: str, tmp_path: Path) -> None:
    assert survive(tmp_path, name, range(100)) > 0


@pytest.mark.long
@pytest.mark.parametrize("name", SEEDS)
def test_a_thousand_changed_files_are_read_or_refused(name: str, tmp_path: Path) -> None:
    assert survive(tmp_path, name, range(100, 1100)) > 0
