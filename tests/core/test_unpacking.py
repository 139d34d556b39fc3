"""What an archive may hold is counted before it is unpacked: bounds from both sides, and each way to be damaged."""

from __future__ import annotations

import io
import struct
import zipfile

import numpy as np
import pytest

from seatrial.core.unpacking import hold, most, told, unpacked


def archive(**members: bytes) -> bytes:
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as made:
        for name, content in members.items():
            made.writestr(f"{name}.npy", content)
    return held.getvalue()


def array(version: tuple[int, int] | None, values: object = (1.0, 2.0, 3.0)) -> bytes:
    held = io.BytesIO()
    np.lib.format.write_array(held, np.asarray(values), version=version, allow_pickle=True)
    return held.getvalue()


def claiming(shape: str) -> bytes:
    """A header by hand, and three numbers behind it."""
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head + struct.pack("<3d", 1.0, 2.0, 3.0)


@pytest.mark.parametrize("version", [(1, 0), (2, 0)])
def test_arrays_of_either_version_come_back(version: tuple[int, int]) -> None:
    found = unpacked(archive(a=array(version), b=array(version, [[4, 5]])))
    assert found["a"].tolist() == [1.0, 2.0, 3.0]
    assert found["b"].tolist() == [[4, 5]]


def test_a_shape_may_be_what_its_bytes_hold_and_no_more() -> None:
    assert unpacked(archive(a=claiming("(3,)")))["a"].tolist() == [1.0, 2.0, 3.0]
    for shape in ("(4,)", "(2, 2)", "(1000000000000000,)"):
        with pytest.raises(ValueError, match="and holds 24 bytes"):
            unpacked(archive(a=claiming(shape)))


@pytest.mark.parametrize(("content", "said"), [
    (archive(a=array((3, 0))), r"version \(3, 0\)"),
    (archive(a=array(None, np.array([None], dtype=object))), "objects"),
    (b"", "."), (b"PK", "."), (archive(a=array((1, 0)))[:-30], "."),
    (archive(a=array((1, 0))).replace(b"a.npy", b"b.npy", 1), "."),
])  # fmt: skip
def test_damage_is_a_value_error(content: bytes, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        unpacked(content)


@pytest.mark.slow
def test_a_file_holds_64_mb_or_a_hundred_times_its_size() -> None:
    assert most(0) == most(1) == 64 * 1024 * 1024
    assert most(10_000_000) == 1_000_000_000
    assert told(3e9, 2_000_000) == "holds 3000 MB in a file of 2 MB; 200 MB are the most"
    zeros = archive(a=b"\0" * (most(0) + 1))
    with pytest.raises(ValueError, match=r"67\.1 MB are the most"):
        unpacked(zeros)
    with zipfile.ZipFile(io.BytesIO(zeros)) as held:
        hold(held, most(0) // 100 + 1)  # a file of that size may


@pytest.mark.slow
def test_ten_thousand_members_and_no_more() -> None:
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w") as made:
        for k in range(10_000):
            made.writestr(str(k), b"")
    with zipfile.ZipFile(held) as kept:
        hold(kept, 1)
    with zipfile.ZipFile(held, "a") as made:
        made.writestr("one more", b"")
    with zipfile.ZipFile(held) as kept, pytest.raises(ValueError, match="10001 files; 10000"):
        hold(kept, 1)
