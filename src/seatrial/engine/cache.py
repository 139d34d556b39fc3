"""Compiling kernels, and keeping them: content-addressed, atomic, checked before loading.

The key is a digest of everything that decides the machine code: source, compiler and its version,
flags, processor features, C library.  A file is written under a name of its own and then renamed,
so concurrent processes never see half of one; its last 32 bytes are the digest of the rest, so a
truncated file is compiled anew instead of crashing the process that maps it.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import shutil
import subprocess
import tempfile
import time
from contextlib import suppress
from functools import cache
from pathlib import Path

FLAGS = (
    "-O2", "-ftree-vectorize", "-march=native", "-mprefer-vector-width=512", "-fopenmp-simd",
    "-fno-math-errno", "-fno-trapping-math", "-fno-builtin", "-shared", "-fPIC",
)  # fmt: skip
LIBRARIES = ("-lmvec", "-lm")
DIGEST = 32
_ABANDONED = 7200.0


class CompilerError(RuntimeError):
    """No kernel can be made on this machine; the text says why."""


def directory() -> Path:
    """Where kernels are kept: `SEATRIAL_CACHE`, else the user's cache directory."""
    named = os.environ.get("SEATRIAL_CACHE")
    base = Path(named) if named else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "seatrial"
    return base / "kernels"


def compiler() -> str:
    """Path of the C compiler: `SEATRIAL_CC`, else gcc, else cc.

    Raises:
        CompilerError: there is none, or `SEATRIAL_CC` is "none".
    """
    named = os.environ.get("SEATRIAL_CC")
    if named == "none":
        raise CompilerError("SEATRIAL_CC is 'none'")
    for name in (named,) if named else ("gcc", "cc"):
        found = shutil.which(name)
        if found:
            return found
    raise CompilerError(f"no C compiler found ({named or 'gcc, cc'}); install one, or set SEATRIAL_CC")


@cache
def _machine(cc: str) -> bytes:
    """What besides source and flags decides the machine code."""
    version = subprocess.run([cc, "-dumpfullversion", "-dumpmachine"], capture_output=True, check=False).stdout
    features = b""
    if Path("/proc/cpuinfo").exists():
        lines = Path("/proc/cpuinfo").read_bytes().splitlines()
        features = next((x for x in lines if x.lower().startswith((b"flags", b"features"))), b"")
    libc = os.confstr("CS_GNU_LIBC_VERSION") if hasattr(os, "confstr") else ""
    return b"|".join([cc.encode(), version, features, (libc or "").encode()])


def library(source: str) -> ctypes.CDLL:
    """The compiled `source`, from the cache where it holds a whole copy.

    Raises:
        CompilerError: no compiler, or the source does not compile or load here.
    """
    cc = compiler()
    text = source.encode()
    key = hashlib.sha256(b"\0".join([text, " ".join((*FLAGS, *LIBRARIES)).encode(), _machine(cc)])).hexdigest()
    path = directory() / f"{key[:40]}.so"
    if not _whole(path):
        _compile(cc, text, path)
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        raise CompilerError(f"the compiled kernel does not load: {error}") from error


def _whole(path: Path) -> bool:
    try:
        data = path.read_bytes()
    except OSError:
        return False
    return len(data) > DIGEST and hashlib.sha256(data[:-DIGEST]).digest() == data[-DIGEST:]


def _sweep(folder: Path) -> None:
    """Remove what compilers that were killed left behind: none of them works for hours."""
    for left in folder.glob(f"{tempfile.gettempprefix()}*"):
        with suppress(OSError):  # another process may be at it
            if left.is_dir() and time.time() - left.stat().st_mtime > _ABANDONED:
                shutil.rmtree(left)


def _compile(cc: str, text: bytes, path: Path) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _sweep(path.parent)
        with tempfile.TemporaryDirectory(dir=path.parent) as scratch:
            c, so = Path(scratch, "kernel.c"), Path(scratch, "kernel.so")
            c.write_bytes(text)
            done = subprocess.run(
                [cc, *FLAGS, str(c), "-o", str(so), *LIBRARIES], capture_output=True, text=True, check=False
            )
            if done.returncode:
                raise CompilerError(f"{cc} failed: {done.stderr.strip().splitlines()[-1:] or done.returncode}")
            code = so.read_bytes()
            so.write_bytes(code + hashlib.sha256(code).digest())
            os.replace(so, path)
    except OSError as error:
        raise CompilerError(f"cannot write kernels to {path.parent}: {error.strerror}") from error
