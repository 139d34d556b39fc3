"""MATLAB files written by hand: version 5 and 7 byte by byte, version 7.3 by plain HDF5.

A value is an array of numbers, a text, a list (a cell), a dictionary (a structure), or a `Run` (an array of them).
"""

from __future__ import annotations

import io
import struct
import zlib
from typing import Any

import numpy as np

STORED = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 9, "i8": 12, "u8": 13}
CLASSES = {"f8": 6, "f4": 7, "i1": 8, "u1": 9, "i2": 10, "u2": 11, "i4": 12, "u4": 13, "i8": 14, "u8": 15}
NAMES = {"f8": "double", "f4": "single", "i1": "int8", "u1": "uint8", "i2": "int16", "u2": "uint16", "i4": "int32",
         "u4": "uint32", "i8": "int64", "u8": "uint64"}  # fmt: skip


class Run(list[dict[str, Any]]):
    """An array of structures."""


class Opaque(str):
    """An object, of which the class is told."""


def shaped(value: np.ndarray) -> np.ndarray:
    return value.reshape(1, -1) if value.ndim < 2 else value


def code(value: np.ndarray) -> str:
    return f"{value.dtype.kind}{value.dtype.itemsize}"


class Version5:
    """The writer of versions 5 and 7.

    Attributes:
        order: of the bytes, "<" or ">".
        packed: whether each variable is packed, as version 7 does.
        small: whether whole numbers are stored in as few bytes as hold them, as MATLAB does.
    """

    def __init__(self, order: str = "<", packed: bool = False, small: bool = False) -> None:
        self.order, self.packed, self.small = order, packed, small

    def file(self, tree: dict[str, Any]) -> bytes:
        head = b"MATLAB 5.0 MAT-file, by hand".ljust(124) + struct.pack(f"{self.order}H", 0x0100)
        return head + (b"IM" if self.order == "<" else b"MI") + b"".join(self.variable(*one) for one in tree.items())

    def variable(self, name: str, value: Any) -> bytes:
        plain = self.matrix(value, name)
        if not self.packed:
            return plain
        inner = zlib.compress(plain)
        return struct.pack(f"{self.order}II", 15, len(inner)) + inner

    def element(self, kind: int, data: bytes) -> bytes:
        if 0 < len(data) <= 4 and kind != 14:
            return struct.pack(f"{self.order}I", len(data) << 16 | kind) + data.ljust(4, b"\0")
        return struct.pack(f"{self.order}II", kind, len(data)) + data + b"\0" * (-len(data) % 8)

    def matrix(self, value: Any, name: str = "") -> bytes:
        if isinstance(value, Opaque):
            return self.opaque(value, name)
        kind, shape, rest = self.parts(value)
        flags = self.element(6, struct.pack(f"{self.order}II", kind, 0))
        dims = self.element(5, struct.pack(f"{self.order}{len(shape)}i", *shape))
        return self.element(14, flags + dims + self.element(1, name.encode()) + rest)

    def opaque(self, kind: str, name: str) -> bytes:
        flags = self.element(6, struct.pack(f"{self.order}II", 17, 0))
        names = (self.element(1, one.encode()) for one in (name, "MCOS", kind))
        return self.element(14, flags + b"".join(names) + self.matrix(np.array([0xDD000000, 2, 1, 1], dtype=np.uint32)))

    def parts(self, value: Any) -> tuple[int, tuple[int, ...], bytes]:
        if isinstance(value, str):
            return 4, (min(len(value), 1), len(value)), self.element(4, value.encode(
                "utf-16-le" if self.order == "<" else "utf-16-be"))  # fmt: skip
        if isinstance(value, Run):
            return 2, (1, len(value)), self.fields(list(value[0]), value)
        if isinstance(value, dict):
            return 2, (1, 1), self.fields(list(value), [value])
        if isinstance(value, list):
            return 1, (1, len(value)), b"".join(map(self.matrix, value))
        data = shaped(value)
        stored = self.stored(data).ravel(order="F")
        bytes_ = stored.astype(stored.dtype.newbyteorder(self.order)).tobytes()
        return CLASSES[code(data)], data.shape, self.element(STORED[code(stored)], bytes_)

    def stored(self, data: np.ndarray) -> np.ndarray:
        if not self.small or not data.size or code(data) != "f8" or not np.array_equal(data, np.round(data)):
            return data
        least = next((one for one in ("u1", "i2", "i4") if np.array_equal(data.astype(one), data)), "f8")
        return data.astype(least) if np.abs(data).max() < 2e9 else data

    def fields(self, names: list[str], elements: list[dict[str, Any]]) -> bytes:
        length = max(map(len, names)) + 1
        said = self.element(1, b"".join(name.encode().ljust(length, b"\0") for name in names))
        values = b"".join(self.matrix(one[name]) for one in elements for name in names)
        return self.element(5, struct.pack(f"{self.order}i", length)) + said + values


def version73(tree: dict[str, Any], packed: bool = False) -> bytes:
    """A file of version 7.3: HDF5 after a head of 512 bytes, arrays turned."""
    import h5py

    held = io.BytesIO()
    with h5py.File(held, "w", userblock_size=512) as file:
        refs = file.create_group("#refs#")
        for name, value in tree.items():
            _put(file, name, value, refs, {"compression": "gzip"} if packed else {})
    raw = held.getvalue()
    return b"MATLAB 7.3 MAT-file, by hand".ljust(124) + b"\0\2IM" + raw[128:]


def _put(group: Any, name: str, value: Any, refs: Any, how: dict[str, Any]) -> None:
    import h5py

    if isinstance(value, dict):
        made = group.create_group(name)
        for key, one in value.items():
            _put(made, key, one, refs, how)
        made.attrs["MATLAB_class"] = np.bytes_("struct")
        return
    if isinstance(value, Run):
        made = group.create_group(name)
        made.attrs["MATLAB_class"] = np.bytes_("struct")
        for key in value[0]:
            made.create_dataset(key, data=_references(refs, [one[key] for one in value], how), dtype=h5py.ref_dtype)
        return
    if isinstance(value, list):
        made = group.create_dataset(name, data=_references(refs, value, how), dtype=h5py.ref_dtype)
        made.attrs["MATLAB_class"] = np.bytes_("cell")
        return
    if isinstance(value, Opaque):
        made = group.create_dataset(name, data=np.array([[0xDD000000, 2, 1, 1]], dtype=np.uint32))
        made.attrs["MATLAB_class"], made.attrs["MATLAB_object_decode"] = np.bytes_(value), np.int32(3)
        return
    if isinstance(value, str):
        made = group.create_dataset(name, data=np.array([[ord(one)] for one in value], dtype=np.uint16))
        made.attrs["MATLAB_class"] = np.bytes_("char")
        return
    data = shaped(value)
    made = group.create_dataset(name, data=data.T, **how)
    made.attrs["MATLAB_class"] = np.bytes_(NAMES[code(data)])


def _references(refs: Any, values: list[Any], how: dict[str, Any]) -> np.ndarray:
    import h5py

    found = np.empty((len(values), 1), dtype=h5py.ref_dtype)
    for k, one in enumerate(values):
        name = f"r{len(refs)}"
        _put(refs, name, one, refs, how)
        found[k, 0] = refs[name].ref
    return found
