"""The binaries of a co-simulation slave: this machine's own, and those of others by a cross compiler.

MinGW-w64 makes the library of Windows; the package ziglang that of every platform named here.
"""

from __future__ import annotations

import errno
import os
import platform
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...core.errors import CompilerError
from ...core.values import dataclass
from ...engine.compilers import Compiler, compiler, packaged
from ...ships import ShipError

FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off")
"""For any processor of the platform: no flag that looks at this one."""

_MINGW = "x86_64-w64-mingw32-gcc"


@dataclass(frozen=True)
class Platform:
    """A platform that binaries are made for.

    Attributes:
        third: its folder by FMI 3.0, section 2.5.1.4.1.
        second: its folder by FMI 2.0, section 2.3; empty where that has none.
        suffix: of a shared library.
        target: its name for the compiler ziglang.
    """

    third: str
    second: str
    suffix: str
    target: str

    def folder(self, fmi: int) -> str:
        """Folder of its binaries by a version of FMI; empty where that has none."""
        return self.second if fmi == 2 else self.third


PLATFORMS = (
    Platform("x86_64-linux", "linux64", ".so", "x86_64-linux-gnu.2.17"),
    Platform("x86_64-windows", "win64", ".dll", "x86_64-windows-gnu"),
    Platform("x86_64-darwin", "darwin64", ".dylib", "x86_64-macos"),
    Platform("aarch64-linux", "", ".so", "aarch64-linux-gnu.2.17"),
    Platform("aarch64-darwin", "", ".dylib", "aarch64-macos"),
    Platform("aarch64-windows", "", ".dll", "aarch64-windows-gnu"),
)
"""What an FMU may run on: our name, FMI 2's folder, ending, and the target of the compiler."""
_PROCESSORS = {"x86_64": "x86_64", "AMD64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64", "ARM64": "aarch64"}


def chosen(names: Sequence[str], fmi: int) -> tuple[Platform, ...]:
    """Platforms by their names of either version of FMI; this machine's own where none is named.

    Raises:
        ShipError: a platform that the version has no name for.
    """
    if not names:
        return (_own(fmi),)
    known = {name: one for one in PLATFORMS for name in (one.second, one.third) if name and one.folder(fmi)}
    found: list[Platform] = []
    for name in names:
        if name not in known:
            raise ShipError(f"no platform '{name}' of FMI {fmi}.0 here; known: {', '.join(dict.fromkeys(known))}")
        if known[name] not in found:
            found.append(known[name])
    return tuple(found)


def compile_for(one: Platform, files: Mapping[str, str], which: Sequence[str], name: str, target: Path) -> bytes:
    """The shared library of the sources; built from relative names, so that no path of this machine enters it.

    Args:
        one: whose library.
        files: sources by name.
        which: those that are compiled, in order.
        name: of the library, without suffix.
        target: file that it is for; begins what is refused.

    Raises:
        ShipError: no compiler for the platform, or one that fails.
    """
    try:
        cc, further = _compiler_for(one)
    except CompilerError as error:
        raise ShipError(f"{target}: an FMU holds a binary: {error}") from None
    made = f"{name}{one.suffix}"
    try:
        with tempfile.TemporaryDirectory() as scratch:
            for file, text in files.items():
                Path(scratch, file).write_text(text, encoding="utf-8")
            # Its own scratch files go where ours went: Python passes over a TMPDIR that is full, a compiler does not.
            done = subprocess.run(
                [*cc.command, *FLAGS, *further, *which, "-o", made, "-lm"], env={**os.environ, "TMPDIR": scratch},
                cwd=scratch, capture_output=True, text=True, check=False,
            )  # fmt: skip
            if done.returncode:
                raise ShipError(f"{target}: {cc.name} failed: {_why(done.stderr) or f'exit {done.returncode}'}")
            return Path(scratch, made).read_bytes()
    except OSError as error:
        folder = tempfile.gettempdir()
        raise ShipError(
            f"{target}: cannot be compiled in {folder}: {error.strerror}; set TMPDIR to a folder with room"
        ) from None


def _here() -> str:
    """This machine's platform as FMI 3.0 names it; empty for a processor that it has no name for."""
    processor = _PROCESSORS.get(platform.machine())
    return f"{processor}-{platform.system().lower()}" if processor else ""


def _own(fmi: int) -> Platform:
    here = _here()
    for one in PLATFORMS:
        if one.third == here and one.folder(fmi):
            return one
    told = f"FMI {fmi}.0 has no name for {platform.system()} {platform.machine()}"
    raise ShipError(f"{told}; --c FOLDER writes the plant as C")


def _compiler_for(one: Platform) -> tuple[Compiler, tuple[str, ...]]:
    """The compiler of a platform and what it is told besides: to keep no symbols, no time and no library of its own.

    Raises:
        CompilerError: there is none.
    """
    if one.third == _here():
        return compiler(), ("-s",) if one.suffix == ".so" else ()
    mingw = shutil.which(_MINGW) if one.third == "x86_64-windows" else None
    if mingw:
        return Compiler((mingw,)), ("-s", "-static-libgcc", "-Wl,--no-insert-timestamp")
    found = packaged()
    if found is None:
        system = " or the system's package of MinGW-w64" if one.third == "x86_64-windows" else ""
        raise CompilerError(f'no compiler for {one.third}; pip install "seatrial[compiler]"{system} brings one')
    return Compiler((*found.command, "-target", one.target)), ("-s",)


def _why(told: str) -> str:
    """The first error line of a compiler; "compilation terminated" comes last."""
    lines = [line.strip() for line in told.splitlines() if line.strip()]
    if any(os.strerror(errno.ENOSPC) in line for line in lines):
        return f"{os.strerror(errno.ENOSPC)} in {tempfile.gettempdir()}; set TMPDIR to a folder with room"
    return next((line for line in lines if "error" in line.lower()), lines[-1] if lines else "")
