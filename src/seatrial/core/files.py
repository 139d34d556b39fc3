"""Atomic writing of files, removal of scratch files, locks of folders, and checks of names from files.

Every result of the package is written here: under a name of its own in the folder where it will stand, on the disk
(fsync), and only then moved into its place.  After a full disk, a kill or Ctrl-C the previous file is still there.
"""

from __future__ import annotations

import io
import json
import math
import os
import re
import socket
import stat
import tomllib
import zlib
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import fields, is_dataclass
from functools import cache
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from .errors import BusyError as BusyError
from .errors import TomlError as TomlError

try:
    import fcntl
except ImportError:  # absent on Windows, where folders are not locked
    fcntl = None

LOCK = "run.lock"
LARGEST = 4_000_000
"""Bytes of a TOML file at most: a report that a study of thousands of trials leaves is far below."""

_PARTS = 30
_PART = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+"""
_DEEP = re.compile(rf"(?<![A-Za-z0-9_-]){_PART}(?:\.[ \t]*+{_PART}){{{_PARTS},}}+")
_LEAST, _MOST = 1e-30, 1e30
REACH = f"magnitudes lie between {_LEAST:g} and {_MOST:g}"
"""Which numbers a file may hold, as a message says it."""
_MODE = 0o666  # less what the umask takes
# Longest name [bytes]: scratch files add to it, and file systems take 255.
_LONGEST = 180
_NUMBERS = count()
_LEFT = re.compile(r"\..+\.(?:(?P<host>[0-9a-f]{8})-)?(?P<pid>\d+)(?:-\d+)?\.tmp")


def is_plain(name: str) -> bool:
    """Whether a text from a file may name a file or folder: no path, not hidden, no control characters."""
    short = 0 < len(name.encode(errors="replace")) <= _LONGEST
    return short and name.isprintable() and name[0] != "." and not set(name) & set("/\\")


def read_toml(path: Path) -> dict[str, Any]:
    """A TOML file, with numbers that arithmetic can use: integers of 64 bits, no NaN, magnitudes that can be squared.

    Infinite numbers are accepted; the caller judges them.

    Raises:
        TomlError: what is wrong with it, and at which key.
        OSError, UnicodeDecodeError: it cannot be read as text.
    """
    if why := no_file(path):
        raise TomlError(why)
    if (size := path.stat().st_size) > LARGEST:
        raise TomlError(f"{size} bytes; {LARGEST} are the most of such a file")
    return toml_of(path.read_text(encoding="utf-8"))


def no_file(path: Path) -> str:
    """Why a path cannot be read as a file or a folder: a pipe would be waited for, a device has no end; else ""."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):  # whoever opens it says so
        return ""
    return "" if stat.S_ISREG(mode) or stat.S_ISDIR(mode) else "is a pipe, a socket or a device; name a file"


def toml_of(text: str) -> dict[str, Any]:
    """The same of a text.

    Raises:
        TomlError: as `read_toml`.
    """
    try:
        if found := _DEEP.search(text):  # the parser takes the square of their number
            line = text.count("\n", 0, found.start()) + 1
            raise TomlError(f"line {line}: a key of over {_PARTS} parts; nest no deeper")
        document = tomllib.loads(text)
        _usable(document, "")
    except RecursionError:
        raise TomlError("tables or lists are nested too deep") from None
    except TomlError:
        raise
    except tomllib.TOMLDecodeError as error:
        raise TomlError(str(error)) from None
    except ValueError as error:  # an invalid date, an integer of thousands of digits
        raise TomlError(f"an invalid value: {str(error).partition(';')[0]}") from None
    return document


def _usable(value: Any, key: str) -> None:
    if isinstance(value, dict):
        for name, one in value.items():
            _usable(one, f"{key}.{name}" if key else str(name))
    elif isinstance(value, list):
        for one in value:
            _usable(one, key)
    elif isinstance(value, int) and abs(value) >= 2**63:
        raise TomlError(f"{key}: an integer of {len(str(abs(value)))} digits; 64 bits hold no more than 19")
    elif isinstance(value, float) and (math.isnan(value) or not (value == 0.0 or math.isinf(value) or in_reach(value))):
        raise TomlError(f"{key} is {value:g}; {REACH}")


def in_reach(value: float) -> bool:
    """Whether a number can be squared and inverted without overflow or underflow."""
    return _LEAST <= abs(value) <= _MOST


def plain(value: Any) -> Any:
    """A value in the types of JSON: records as mappings, paths as text; a number that is not finite becomes null."""
    if is_dataclass(value):
        return {field.name: plain(vars(value)[field.name]) for field in fields(value)}
    if isinstance(value, np.generic | np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


def write_whole(path: str | Path, content: str | bytes) -> Path:
    """Write one file; see `write_together`."""
    return write_together({Path(path): content})[0]


def write_together(files: Mapping[Path, str | bytes | Callable[[str], None]]) -> tuple[Path, ...]:
    """Write files: all are complete, on the disk, before the first takes its place.

    Args:
        files: by path the text or bytes, or a function that saves to the path it is given.

    Raises:
        OSError: one cannot be written; its `filename` is that of the file, and nothing has changed.
    """
    made: dict[Path, Path] = {}
    for folder in dict.fromkeys(path.parent for path in files):
        _sweep_once(folder)
    at = next(iter(files), Path())
    try:
        for at, content in files.items():
            made[at] = _scratch(at)
            _fill(made[at], content)
        for at, scratch in made.items():
            os.replace(scratch, at)
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(at)) from error
    finally:
        for scratch in made.values():
            with suppress(OSError):
                scratch.unlink()
    return tuple(files)


def packed(**arrays: Any) -> bytes:
    """Arrays as the bytes of an .npz file, so that `write_whole` handles a full disk."""
    held = io.BytesIO()
    np.savez(held, allow_pickle=False, **arrays)
    return held.getvalue()


def _fill(scratch: Path, content: str | bytes | Callable[[str], None]) -> None:
    if callable(content):
        content(str(scratch))
    handle = os.open(scratch, os.O_WRONLY | os.O_CREAT, _MODE)
    with os.fdopen(handle, "wb") as stream:
        if not callable(content):
            stream.write(content.encode() if isinstance(content, str) else content)
        stream.flush()
        os.fsync(stream.fileno())


def _scratch(path: Path) -> Path:
    """A name beside `path` that contains its process: `.NAME.HOST-PID-NUMBER.tmp`."""
    short = path.name.encode()[:_LONGEST].decode(errors="ignore")
    return path.with_name(f".{short}.{_host()}-{os.getpid()}-{next(_NUMBERS)}.tmp")


@cache
def _host() -> str:
    return f"{zlib.crc32(socket.gethostname().encode()):08x}"


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:  # of another user
        return True
    return True


def sweep(folder: Path) -> None:
    """Remove the scratch files of ended processes of this machine."""
    with suppress(OSError):
        for left in folder.iterdir():
            found = _LEFT.fullmatch(left.name)
            if found and found["host"] in (None, _host()) and not _alive(int(found["pid"])):
                with suppress(OSError):
                    left.unlink()


_sweep_once = cache(sweep)


def set_aside(path: Path) -> Path:
    """Rename a file that cannot be used to `NAME.damaged`, so that work can start over; return the new path."""
    aside = path.with_name(f"{path.name}.damaged")
    os.replace(path, aside)
    return aside


@contextmanager
def held_alone(folder: Path) -> Generator[None, None, None]:
    """Lock a folder for this process; it is made if absent, and removed again if it stays empty.

    The kernel releases the lock of a killed process, so there are no stale ones; `run.lock` names the process and the
    machine for the message of `BusyError`.

    Raises:
        BusyError: another process has locked it.
        OSError: the folder cannot be made.
    """
    above = [path for path in (folder, *folder.parents) if not path.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    handle = _locked(folder / LOCK)
    try:
        yield
    finally:
        if handle is not None:
            with suppress(OSError):
                (folder / LOCK).unlink()
            os.close(handle)
        with suppress(OSError):  # it is not empty
            for path in above:
                path.rmdir()


def _locked(path: Path) -> int | None:
    """Descriptor of the locked file; None where locks are unsupported or the folder is read-only."""
    if fcntl is None:
        return None
    while True:
        try:
            handle = os.open(path, os.O_RDWR | os.O_CREAT, _MODE)
        except OSError:  # a read-only folder; a later write raises
            return None
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.fstat(handle).st_nlink == 0:  # its owner has removed it meanwhile
                os.close(handle)
                continue
            os.ftruncate(handle, 0)
            os.write(handle, json.dumps({"pid": os.getpid(), "host": socket.gethostname()}).encode())
        except BlockingIOError:
            who = _owner(handle)
            os.close(handle)
            raise BusyError(f"{path.parent}: {who} works in it; wait for it, or choose another folder") from None
        except OSError:  # a file system without locks, or a full one
            return handle
        return handle


def _owner(handle: int) -> str:
    try:
        owner = json.loads(os.pread(handle, 4096, 0))
        return f"process {int(owner['pid'])} on {owner['host']}"
    except (OSError, ValueError, KeyError, TypeError):
        return "another process"
