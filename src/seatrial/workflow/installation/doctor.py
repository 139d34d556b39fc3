"""What is installed here and what works: Python, libraries, compiler, cache, extras, GPU, data."""

from __future__ import annotations

import os
import platform
import re
import sys
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Literal

from ...core.errors import SeatrialError
from ...core.executors import processors
from ...core.values import dataclass
from ...core.version import __version__

State = Literal["ok", "note", "error"]

_NAME = re.compile(r"[A-Za-z0-9._-]+")
_BOUND = re.compile(r"(>=|<=|==|<|>)\s*([0-9]+(?:\.[0-9]+)*)")
_EXTRA = re.compile(r"extra\s*==\s*['\"]([^'\"]+)['\"]")
_ELSEWHERE = re.compile(r"sys_platform\s*!=\s*['\"]([^'\"]+)['\"]")
# A kernel with a function of the vector library, so that finding it is part of the test.
_TRIAL = "#include <math.h>\nint seatrial_doctor(void) { return (int)floor(cos(0.0)); }\n"
# Extras that bring others together, or tools of development.
_SETS = ("all", "test", "bench", "docs")


@dataclass(frozen=True)
class Finding:
    """One thing looked at.

    Attributes:
        area: what it belongs to: python, libraries, compiler, cache, extras, gpu, data.
        what: the thing.
        state: "ok"; "note", where something optional is missing; "error", where commands will fail.
        found: what is there, in words.
        remedy: what to do; empty where there is nothing to do.
    """

    area: str
    what: str
    state: State
    found: str
    remedy: str = ""


def examine() -> tuple[Finding, ...]:
    """Look at the installation; nothing is changed but for a small kernel in the cache."""
    return (*_python(), *_libraries(), *_compiler(), *_cache(), *_extras(), _gpu(), _data())


def _python() -> Iterator[Finding]:
    where = Path(__file__).resolve().parents[2]
    yield Finding("python", "seatrial", "ok", f"{__version__} in {where}")
    yield Finding("python", "Python", "ok", f"{platform.python_version()}, {platform.system()} {platform.machine()}")
    yield Finding("python", "processor cores", "ok", f"{processors()} used of {os.cpu_count() or 1}")


def _stated() -> tuple[str, ...]:
    """Requirements of the distribution; empty where the package is used without being installed."""
    try:
        return tuple(metadata.requires("seatrial") or ())
    except metadata.PackageNotFoundError:
        return ()


def _needed_here(requirement: str) -> bool:
    return not any(sys.platform == other for other in _ELSEWHERE.findall(requirement))


def _numbers(version: str) -> tuple[int, ...]:
    """The release of a version, such as (2, 13, 0) of 2.13.0+cpu."""
    release = re.match(r"[0-9]+(?:\.[0-9]+)*", version)
    return tuple(int(part) for part in release.group().split(".")) if release else ()


def fits(version: str, requirement: str) -> bool:
    """Whether a version lies in the range that a requirement states; markers after ; are not read."""
    have = _numbers(version)
    for sign, bound in _BOUND.findall(requirement.partition(";")[0]):
        limit = _numbers(bound)
        size = max(len(have), len(limit))
        a, b = (one + (0,) * (size - len(one)) for one in (have, limit))
        if not {">=": a >= b, "<=": a <= b, "==": a == b, "<": a < b, ">": a > b}[sign]:
            return False
    return True


def _lack(requirement: str) -> str:
    """What is wrong with an installed distribution; empty where it is as required."""
    name = _NAME.match(requirement)
    if name is None:
        return ""
    try:
        version = metadata.version(name.group())
    except metadata.PackageNotFoundError:
        return f"{name.group()} missing"
    stated = requirement.partition(";")[0].strip()
    return "" if fits(version, requirement) else f"{name.group()} {version}, but {stated} is required"


def _libraries() -> Iterator[Finding]:
    stated = _stated()
    if not stated:
        yield Finding("libraries", "distribution", "note", "used without being installed: requirements unknown",
                      "pip install seatrial, or pip install -e . in the checkout")  # fmt: skip
        return
    required = [one for one in stated if not _EXTRA.search(one)]
    lacks = [lack for lack in map(_lack, required) if lack]
    if lacks:
        yield Finding("libraries", "required", "error", "; ".join(lacks), "pip install --upgrade seatrial")
    else:
        yield Finding("libraries", "required", "ok", f"{len(required)} installed, in the stated ranges")


def _compiler() -> Iterator[Finding]:
    from ...engine import cache, compilers

    remedy = 'pip install "seatrial[compiler]", or gcc (Debian: apt install gcc) for runs some twenty times as fast'
    try:
        found = " ".join(compilers.compiler().command)
        cache.library(_TRIAL)
    except SeatrialError as error:
        yield Finding("compiler", "C compiler", "note", f"{error}; the virtual machine is used", remedy)
        return
    yield Finding("compiler", "C compiler", "ok", f"{found}; compiled kernels load")


def _cache() -> Iterator[Finding]:
    from ...engine import cache

    folder = cache.directory()
    if not folder.exists():
        yield Finding("cache", "kernels", "note", f"{folder}: not there yet; it is made when first needed")
        return
    if not os.access(folder, os.W_OK):
        yield Finding("cache", "kernels", "error", f"{folder}: not writable", "name a folder by SEATRIAL_CACHE")
        return
    held = [path.stat().st_size for path in folder.iterdir() if path.is_file()]
    yield Finding("cache", "kernels", "ok", f"{folder}: {len(held)} files, {sum(held) / 1e6:.1f} MB")


def _extras() -> Iterator[Finding]:
    by_name: dict[str, list[str]] = {}
    for requirement in _stated():
        for name in _EXTRA.findall(requirement):
            if name not in _SETS and _needed_here(requirement):
                by_name.setdefault(name, []).append(requirement)
    for name, required in sorted(by_name.items()):
        lacks = [lack for lack in map(_lack, required) if lack]
        if lacks:
            yield Finding("extras", name, "note", "; ".join(lacks), f"pip install 'seatrial[{name}]'")
        else:
            yield Finding("extras", name, "ok", "installed")


def _gpu() -> Finding:
    from ...engine.cuda.gpu import gpu

    try:
        return Finding("gpu", "CUDA", "ok", str(gpu(0).device.name))
    except SeatrialError as error:
        return Finding("gpu", "CUDA", "note", str(error))


def _data() -> Finding:
    named = os.environ.get("SEATRIAL_DATA")
    if not named:
        return Finding("data", "SEATRIAL_DATA", "note", "not set: studies of public data sets ask for it",
                       "export SEATRIAL_DATA=FOLDER of the data sets (docs/data.md says where they are)")  # fmt: skip
    folder = Path(named)
    if not folder.is_dir():
        return Finding("data", "SEATRIAL_DATA", "error", f"{named}: not a folder", "name a folder, or unset it")
    sets = sorted(path.name for path in folder.iterdir() if path.is_dir() and not path.name.startswith("."))
    return Finding("data", "SEATRIAL_DATA", "ok" if sets else "note", f"{named}: {', '.join(sets) or 'empty'}")
