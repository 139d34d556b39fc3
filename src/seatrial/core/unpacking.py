"""How much may come out of a file: what an archive holds is counted before it is unpacked.

A thousandth of the memory that an array of zeros takes is its size when packed; whoever packs such files makes the
program take all of it.  What instruments measure is packed ten times at best.
"""

from __future__ import annotations

import io
import math
import zipfile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import first_line

_LEAST, _RATIO = 64 << 20, 100
_MEMBERS = 10_000


def most(size: int) -> int:
    """Bytes that a file of `size` bytes may hold when unpacked."""
    return max(_LEAST, _RATIO * size)


def told(count: float, size: int) -> str:
    """Why what a file says that it holds is too much, in words."""
    held, least = (f"{one / 1e6:.3g}" if one < 1e9 else f"{one / 1e6:.0f}" for one in (count, most(size)))
    return f"holds {held} MB in a file of {size / 1e6:.2g} MB; {least} MB are the most"


def hold(archive: zipfile.ZipFile, size: int) -> None:
    """Count what a zip file of `size` bytes holds; a member cannot give more than its directory says.

    Raises:
        ValueError: it is too much.
    """
    members = archive.infolist()
    if len(members) > _MEMBERS:
        raise ValueError(f"holds {len(members)} files; {_MEMBERS} are the most")
    if (count := sum(one.file_size for one in members)) > most(size):
        raise ValueError(told(count, size))


def unpacked(content: bytes) -> dict[str, Any]:
    """The arrays of an .npz file.

    Raises:
        ValueError: no such file, or a damaged one; arrays of objects, more than its bytes hold, or too much.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            hold(archive, len(content))
            for member in archive.infolist():
                with archive.open(member) as stream:
                    _hold_array(member.filename, member.file_size, stream)
        with np.load(io.BytesIO(content), allow_pickle=False) as found:
            return {name: found[name] for name in found.files}
    except ValueError:
        raise
    except Exception as error:  # whatever NumPy and zipfile raise on a damaged file
        raise ValueError(first_line(error, 120) or type(error).__name__) from None


def array(content: bytes) -> NDArray[Any]:
    """The array of an .npy file.

    Raises:
        ValueError: no such file, or a damaged one; objects, more values than its bytes hold.
    """
    try:
        _hold_array("it", len(content), io.BytesIO(content))
        return np.load(io.BytesIO(content), allow_pickle=False)
    except ValueError:
        raise
    except Exception as error:  # whatever NumPy raises on a damaged header
        raise ValueError(first_line(error, 120) or type(error).__name__) from None


def _hold_array(name: str, size: int, stream: Any) -> None:
    version = np.lib.format.read_magic(stream)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"{name} is of version {version}")
    first = version == (1, 0)
    read = np.lib.format.read_array_header_1_0 if first else np.lib.format.read_array_header_2_0
    shape, _, kind = read(stream)
    if kind.hasobject:
        raise ValueError(f"{name} holds objects, not numbers")
    if math.prod(shape) * max(kind.itemsize, 1) > (held := size - stream.tell()):
        raise ValueError(f"{name} is said to have the shape {shape}, and holds {held} bytes")
