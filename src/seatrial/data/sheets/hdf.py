"""MATLAB files of version 7.3, which are HDF5, by h5py: arrays turned, structures as groups, cells as references."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core import unpacking
from ...core.errors import first_line
from ...core.values import dataclass
from .tree import Alike, Foreign, Tree, cell, texts_of

_DEEPEST, _MEMBERS = 16, 20_000
_NUMBERS = "fiub"


def tree_of_hdf(raw: bytes) -> Tree:
    """The variables of a .mat file of version 7.3.

    Raises:
        ImportError: h5py is missing.
        ValueError: a damaged file, one that holds too much, or one whose arrays are in other files.
    """
    import h5py

    try:
        with h5py.File(io.BytesIO(raw), "r") as file:
            return _Reading(file, unpacking.most(len(raw)), len(raw)).group(file, 0)
    except ValueError:
        raise
    except (OSError, KeyError, RuntimeError, TypeError, AttributeError, OverflowError) as error:
        raise ValueError(f"damaged, or cut off ({first_line(error, 80)})") from None


@dataclass(frozen=True)
class _Parts:
    """What one field is in each element of an array of structures."""

    parts: tuple[Any, ...]


@dataclass
class _Reading:
    """A file that is read.

    Attributes:
        file: of h5py.
        left: bytes that may still come.
        size: of the file.
        members: variables, fields and elements so far.
    """

    file: Any
    left: int
    size: int
    members: int = 0

    def group(self, group: Any, depth: int) -> Tree:
        """The members of a group; those that begin with # are MATLAB's own."""
        import h5py

        self._more(len(group), depth)
        found: dict[str, Any] = {}
        for name in group:
            if name.startswith("#"):
                continue
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise ValueError(f"{name} is a link to another place")
            found[str(name)] = self._value(group[name], depth + 1)
        return found

    def _more(self, count: int, depth: int) -> None:
        """Count members before they are read."""
        self.members += count
        if depth > _DEEPEST:
            raise ValueError(f"structures within each other more than {_DEEPEST} times")
        if self.members > _MEMBERS:
            raise ValueError(f"holds more than {_MEMBERS} variables, fields and elements")

    def _value(self, held: Any, depth: int) -> Any:
        import h5py

        kind = held.attrs.get("MATLAB_class", b"")
        kind = kind.decode("latin-1") if isinstance(kind, bytes) else str(kind)
        if "MATLAB_object_decode" in held.attrs:
            return Foreign(kind, shut=True)
        if isinstance(held, h5py.Group):
            return _elements(self.group(held, depth))
        if "MATLAB_empty" in held.attrs:
            return np.zeros(0)
        values = self._read(held)
        if held.dtype == h5py.ref_dtype:
            self._more(values.size, depth)
            parts = [self._value(self.file[one], depth + 1) for one in np.ravel(values)]
            return cell(parts) if kind == "cell" else _Parts(tuple(parts))
        if kind == "char":
            return texts_of(values.T)
        return values.T if values.dtype.kind in _NUMBERS else Foreign(str(values.dtype))

    def _read(self, held: Any) -> NDArray[Any]:
        """A data set, turned as MATLAB has it."""
        if held.is_virtual or held.external:
            raise ValueError(f"{held.name} lies in another file")
        self.left -= held.size * max(held.dtype.itemsize, 1)
        if self.left < 0:
            raise ValueError(f"holds more than {unpacking.most(self.size) / 1e6:.3g} MB "
                             f"in a file of {self.size / 1e6:.2g} MB")  # fmt: skip
        return np.asarray(held[()])


def _elements(fields: Tree) -> Any:
    """A structure, or the elements of an array of them, each of whose fields is a list of parts."""
    lists = {name: one.parts for name, one in fields.items() if isinstance(one, _Parts)}
    counts = {len(parts) for parts in lists.values()}
    if not lists or len(lists) < len(fields) or len(counts) > 1:
        return {name: Foreign("array") if name in lists else one for name, one in fields.items()}
    return Alike(tuple({name: parts[k] for name, parts in lists.items()} for k in range(counts.pop())))
