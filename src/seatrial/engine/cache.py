"""Compiling kernels, and keeping them: content-addressed, atomic, checked before loading.

The key is a digest of everything that decides the machine code: source, compiler and its version,
flags, processor features, C library.  A file is written under a name of its own and then renamed,
so concurrent processes never see half of one; its last 32 bytes are the digest of the rest, so a
truncated file is compiled anew instead of crashing the process that maps it.

A kernel is code that this process runs, and the digest detects an accident, not an intent. So the folder
is the user's own and closed to others, as is each file that is loaded from it.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import shutil
import stat
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path

from ..core.errors import CompilerError as CompilerError
from .compilers import Compiler, compiler

DIGEST = 32
"""Bytes of a SHA-256, which stands behind each kernel in the cache."""
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
# Seconds after which a folder of a build that was killed is cleared away; no compilation lasts an hour.
_ABANDONED = 7200.0
_JOINT = b"\0"


def directory() -> Path:
    """Where kernels are kept: `SEATRIAL_CACHE`, else the user's cache directory."""
    named = os.environ.get("SEATRIAL_CACHE")
    base = Path(named) if named else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "seatrial"
    return base / "kernels"


@cache
def _machine(cc: Compiler) -> bytes:
    """What besides source and flags decides the machine code."""
    features = b""
    if Path("/proc/cpuinfo").exists():
        lines = Path("/proc/cpuinfo").read_bytes().splitlines()
        features = next((x for x in lines if x.lower().startswith((b"flags", b"features"))), b"")
    libc = os.confstr("CS_GNU_LIBC_VERSION") if hasattr(os, "confstr") else ""
    return b"|".join([" ".join(cc.command).encode(), cc.identity, features, (libc or "").encode()])


def library(source: str) -> ctypes.CDLL:
    """The compiled `source`, from the cache where it holds a whole copy.

    Raises:
        CompilerError: no compiler, a folder that others could put kernels into, or the source does not compile or
            load here.
    """
    cc, text = compiler(), source.encode()
    parts = [text, " ".join((*cc.flags, *cc.libraries)).encode(), _machine(cc)]
    path = kept(parts, "so", lambda scratch: _compiled(cc, text, scratch))
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        raise CompilerError(f"the compiled kernel does not load: {error}") from error


def kept(parts: Sequence[bytes], kind: str, make: Callable[[Path], bytes]) -> Path:
    """The file of code that `parts` decide, made in a scratch folder where the cache holds no whole copy.

    Raises:
        CompilerError: a folder that others could put kernels into, or that cannot be written.
    """
    path = _own_folder() / f"{hashlib.sha256(_JOINT.join(parts)).hexdigest()[:40]}.{kind}"
    if _whole(path):
        return path
    try:
        _sweep(path.parent)
        with tempfile.TemporaryDirectory(dir=path.parent) as scratch:
            code, whole = make(Path(scratch)), Path(scratch, "whole")
            whole.write_bytes(code + hashlib.sha256(code).digest())
            whole.chmod(0o700)
            os.replace(whole, path)
    except OSError as error:
        raise CompilerError(f"cannot write kernels to {path.parent}: {error.strerror}") from error
    return path


def _own_folder() -> Path:
    """The folder of the kernels without links, made where it is not, and closed to others.

    Raises:
        CompilerError: it is another user's, or others could put another one in its place.
    """
    given = directory()
    try:
        given.mkdir(mode=0o700, parents=True, exist_ok=True)
        folder = given.resolve()
        own, above = folder.stat(), folder.parent.stat()
        if not hasattr(os, "geteuid"):
            return folder
        user = os.geteuid()
        if own.st_uid != user:
            raise CompilerError(f"{given}: belongs to user {own.st_uid}, not to you; name a folder by SEATRIAL_CACHE")
        exposed = above.st_mode & stat.S_IWOTH and not above.st_mode & stat.S_ISVTX
        if exposed or above.st_uid not in (user, 0):
            raise CompilerError(f"{given.parent}: others may replace what it holds; close it or set SEATRIAL_CACHE")
        if stat.S_IMODE(own.st_mode) != 0o700:
            folder.chmod(0o700)
    except OSError as error:
        raise CompilerError(f"cannot write kernels to {given}: {error.strerror}") from error
    return folder


def _whole(path: Path) -> bool:
    """Whether it is a complete kernel that only this user could have written."""
    try:
        held, data = path.lstat(), path.read_bytes()
    except OSError:
        return False
    if not stat.S_ISREG(held.st_mode) or held.st_mode & _OTHERS_WRITE:
        return False
    if hasattr(os, "geteuid") and held.st_uid != os.geteuid():
        return False
    return len(data) > DIGEST and hashlib.sha256(data[:-DIGEST]).digest() == data[-DIGEST:]


def _sweep(folder: Path) -> None:
    """Remove what compilers that were killed left behind: none of them works for hours."""
    for left in folder.glob(f"{tempfile.gettempprefix()}*"):
        with suppress(OSError):  # another process may be at it
            if left.is_dir() and time.time() - left.stat().st_mtime > _ABANDONED:
                shutil.rmtree(left)


def _compiled(cc: Compiler, text: bytes, scratch: Path) -> bytes:
    c, so = scratch / "kernel.c", scratch / "kernel.so"
    c.write_bytes(text)
    command = [*cc.command, *cc.flags, str(c), "-o", str(so), *cc.libraries]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise CompilerError(f"{cc.name} failed: {done.stderr.strip().splitlines()[-1:] or done.returncode}")
    return so.read_bytes()
