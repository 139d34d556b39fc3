"""MATLAB files of version 5 and 7, byte by byte, and no more of them than they hold.

SciPy's reader takes memory for what a file says that it holds, and damaged files end it with the whole process.
The format is in "MAT-File Format", The MathWorks: elements of a kind, a size and bytes, some of them packed.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core import unpacking
from ...core.values import dataclass
from .tree import Alike, Foreign, Tree, cell, texts_of

_MATRIX, _PACKED = 14, 15
_CELL, _STRUCTURE, _OBJECT, _CHAR, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17
_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
_ENCODED = {16: "utf-8", 17: "utf-16", 18: "utf-32"}
_COMPLEX = 0x0800
_FOREIGN = {_SPARSE: "sparse", _FUNCTION: "function_handle"}
_DEEPEST, _ELEMENTS = 16, 200_000
"""Structures within each other, and elements of a file, at most."""


def tree_of_mat(raw: bytes) -> Tree:
    """The variables of a .mat file of version 5 or 7.

    Raises:
        ValueError: no such file, a damaged one, or one that holds too much.
    """
    order = {b"IM": "<", b"MI": ">"}.get(raw[126:128])
    if order is None:
        raise ValueError("no MAT file of version 5, 7 or 7.3; in MATLAB or Octave: save('FILE.mat', '-v7')")
    try:
        found = dict(_Reading(order).variables(raw))
    except (struct.error, zlib.error, StopIteration, UnicodeDecodeError, OverflowError, RuntimeError):
        raise ValueError("damaged, or cut off") from None
    return {name: value for name, value in found.items() if name}  # MATLAB keeps what its objects share without a name


@dataclass
class _Reading:
    """A file that is read.

    Attributes:
        order: of bytes, "<" or ">".
        left: elements that may still come.
    """

    order: str
    left: int = _ELEMENTS

    def variables(self, raw: bytes) -> Iterator[tuple[str, Any]]:
        """Names and values."""
        limit = unpacking.most(len(raw))
        for kind, part in self._elements(memoryview(raw)[128:]):
            if kind != _PACKED:
                yield from self._matrices([(kind, part)], 0)
                continue
            inflater = zlib.decompressobj()
            inner = inflater.decompress(part, limit)
            limit -= len(inner)
            if inflater.unconsumed_tail or limit <= 0:
                raise ValueError(f"holds more than {unpacking.most(len(raw)) / 1e6:.3g} MB "
                                 f"in a file of {len(raw) / 1e6:.2g} MB")  # fmt: skip
            if not inflater.eof:
                raise ValueError("damaged, or cut off")
            yield from self._matrices(self._elements(memoryview(inner)), 0)

    def _elements(self, part: memoryview) -> Iterator[tuple[int, memoryview]]:
        """Kind and bytes of each element of a stretch."""
        at = 0
        while at + 8 <= len(part):
            self.left -= 1
            if self.left < 0:
                raise ValueError(f"holds more than {_ELEMENTS} elements")
            kind, size = struct.unpack_from(f"{self.order}II", part, at)
            start, step = at + 8, 8 + size + (-size % 8 if kind != _PACKED else 0)
            if kind >> 16:
                kind, size, start, step = kind & 0xFFFF, min(kind >> 16, 4), at + 4, 8
            if start + size > len(part):
                raise ValueError("damaged, or cut off")
            yield kind, part[start : start + size]
            at += step

    def _matrices(self, elements: Any, depth: int) -> Iterator[tuple[str, Any]]:
        """Names and values of the elements that are matrices."""
        if depth > _DEEPEST:
            raise ValueError(f"structures within each other more than {_DEEPEST} times")
        for kind, part in elements:
            if kind == _MATRIX:
                yield self._matrix(self._elements(part), depth) if len(part) else ("", np.zeros(0))

    def _matrix(self, parts: Iterator[tuple[int, memoryview]], depth: int) -> tuple[str, Any]:
        (flags,) = struct.unpack_from(f"{self.order}I", next(parts)[1])
        what = flags & 0xFF
        if what == _OPAQUE:
            name, _, kind = (self._text(next(parts)[1]) for _ in range(3))
            return name, Foreign(kind, shut=True)
        dims = next(parts)[1]
        shape = struct.unpack(f"{self.order}{len(dims) // 4}i", dims)
        name = self._text(next(parts)[1])
        if what in _FOREIGN or flags & _COMPLEX:
            return name, Foreign(_FOREIGN.get(what, "complex"))
        if what == _OBJECT:
            return name, Foreign(self._text(next(parts)[1]), shut=True)
        if what == _STRUCTURE:
            return name, self._structure(parts, depth)
        if what == _CELL:
            return name, cell([value for _, value in self._matrices(parts, depth + 1)])
        return name, self._array(what, shape, *next(parts, (2, memoryview(b""))))

    def _text(self, part: memoryview) -> str:
        return bytes(part).decode("latin-1")

    def _structure(self, parts: Iterator[tuple[int, memoryview]], depth: int) -> Any:
        (length,) = struct.unpack(f"{self.order}i", next(parts)[1])
        said = self._text(next(parts)[1])
        if length < 1:
            raise ValueError("damaged, or cut off")
        names = [said[k : k + length].partition("\0")[0] for k in range(0, len(said), length)]
        values = [value for _, value in self._matrices(parts, depth + 1)]
        if not names or len(values) % len(names):
            return Foreign("struct")
        found = tuple(
            dict(zip(names, values[k : k + len(names)], strict=True)) for k in range(0, len(values), len(names))
        )
        return found[0] if len(found) == 1 else Alike(found)

    def _array(self, what: int, shape: tuple[int, ...], kind: int, part: memoryview) -> Any:
        """Numbers or texts, by columns."""
        stored = np.frombuffer(self._plain(kind, part), dtype=f"{self.order}{_STORED.get(kind, 'u4')}")
        if what not in (_CHAR, *_CLASSES) or (stored.dtype.kind == "f" and what not in (_CHAR, 6, 7)):
            raise ValueError(f"an array of the class {what} and the type {kind}")
        if stored.size != prod(shape) or min(shape, default=0) < 0:
            raise ValueError(f"an array of {prod(shape)} values that holds {stored.size}")
        values: NDArray[Any] = stored.reshape(shape, order="F")
        return texts_of(values) if what == _CHAR else values.astype(_CLASSES[what])

    def _plain(self, kind: int, part: memoryview) -> bytes:
        """Bytes of numbers; those of a text that is encoded as the numbers of its characters."""
        if kind not in _ENCODED:
            return bytes(part)
        end = "" if kind == 16 else "-le" if self.order == "<" else "-be"
        text = bytes(part).decode(_ENCODED[kind] + end)
        return text.encode("utf-32-le" if self.order == "<" else "utf-32-be")
