"""The C compiler that makes kernels: one of the system, or the one that the extra `compiler` brings from PyPI.

GCC and Clang vectorise the same source differently.  GCC takes the vector functions of libmvec (glibc) from
declarations in the source, Clang from its own table, where no `-fno-builtin` hides what a function is.
"""

from __future__ import annotations

import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
from functools import cache
from pathlib import Path

from ..core.errors import CompilerError
from ..core.values import dataclass

_COMMON = (
    "-O2", "-ftree-vectorize", "-march=native", "-mprefer-vector-width=512", "-fopenmp-simd",
    "-fno-math-errno", "-fno-trapping-math", "-shared", "-fPIC",
)  # fmt: skip
_LIBRARY = "libmvec.so.1"
_ORDER = ("gcc", "cc", "clang")


@dataclass(frozen=True)
class Compiler:
    """A C compiler and how it is called."""

    command: tuple[str, ...]
    """Program and the words that belong to it: ("/usr/bin/gcc",), (".../zig", "cc")."""

    @property
    def name(self) -> str:
        """Name for messages: gcc, zig cc."""
        return " ".join((Path(self.command[0]).name, *self.command[1:]))

    @property
    def identity(self) -> bytes:
        """What it says of itself: family, version and target."""
        return _identity(self.command)

    @property
    def flags(self) -> tuple[str, ...]:
        """Options for a kernel of many lanes."""
        clang = b"clang" in self.identity.lower()
        vectors = platform.machine() == "x86_64" and self.libraries != ("-lm",)
        own = ("-fveclib=libmvec",) if clang and vectors else () if clang else ("-fno-builtin",)
        return (*_COMMON, *own)

    @property
    def libraries(self) -> tuple[str, ...]:
        """Mathematics: of vectors, and of numbers.

        Zig brings a C library to link with, but none of vectors.  That of the system is named as the file that runs:
        `-lmvec` asks for its development files, which a system without a compiler has not.
        """
        if "zig" not in self.name:
            return ("-lmvec", "-lm")
        found = _vector_library()
        return (found, "-lm") if found else ("-lm",)


def compiler() -> Compiler:
    """The C compiler: `SEATRIAL_CC` ("clang", "zig cc"), else gcc, cc or clang of the path, else the package ziglang.

    Raises:
        CompilerError: there is none, or `SEATRIAL_CC` is "none".
    """
    named = os.environ.get("SEATRIAL_CC")
    if named == "none":
        raise CompilerError("SEATRIAL_CC is 'none'")
    for program, *words in [shlex.split(named)] if named else [[name] for name in _ORDER]:
        found = shutil.which(program)
        if found:
            return Compiler((found, *words))
    if named:
        raise CompilerError(f"no C compiler found ({named}); install one, or set SEATRIAL_CC")
    found = packaged()
    if found is None:
        raise CompilerError(f'no C compiler found ({", ".join(_ORDER)}); pip install "seatrial[compiler]" brings one')
    return found


def no_compiler() -> str:
    """Why there is no C compiler; empty where there is one."""
    try:
        compiler()
    except CompilerError as error:
        return str(error)
    return ""


def packaged() -> Compiler | None:
    """The compiler of the package ziglang, called without Python in between."""
    found = importlib.util.find_spec("ziglang")
    for folder in (found.submodule_search_locations or ()) if found else ():
        program = shutil.which("zig", path=folder)
        if program:
            return Compiler((program, "cc"))
    return None


@cache
def _vector_library() -> str:
    """The file of glibc's vector functions; empty where there is none, as with musl."""
    own = f"lib/{platform.machine()}-linux-gnu"
    folders = [f"/{top}{sub}" for sub in (own, "lib64", "lib") for top in ("", "usr/")]
    return next((str(path) for folder in folders if (path := Path(folder, _LIBRARY)).exists()), "")


@cache
def _identity(command: tuple[str, ...]) -> bytes:
    return subprocess.run([*command, "--version"], capture_output=True, check=False).stdout
