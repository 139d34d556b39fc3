"""A ship as a co-simulation slave: one file with description, sources and binary, by FMI 2.0."""

from __future__ import annotations

import io
import math
import platform
import subprocess
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

from ..approach import time_step
from ..engine.cache import CompilerError, compiler
from ..ships import Ship, ShipError
from .fmu_hull import hull_of
from .fmu_layout import Layout, layout
from .fmu_source import sources
from .fmu_xml import model_description, osp_description
from .plant import plant
from .writing import write

FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off")
"""For any processor of the platform: no flag that looks at this one."""

_PLATFORMS = {("Linux", "x86_64"): ("linux64", ".so"), ("Darwin", "x86_64"): ("darwin64", ".dylib"),
              ("Windows", "AMD64"): ("win64", ".dll")}  # fmt: skip
_BEGINNING_OF_TIME = (1980, 1, 1, 0, 0, 0)


def save_fmu(ship: Ship, path: str | Path, *, dt: float | None = None, hull: bool = False) -> tuple[Path, Path]:
    """Write ``FILE.fmu`` and, beside it, ``FILE_OspModelDescription.xml``.

    The same ship gives the same bytes where the compiler is the same.

    Args:
        ship: any ship in continuous time.
        path: ends in .fmu, in a folder that is there.
        dt: internal step [s]; None takes the one that suits the ship.
        hull: the hull alone, under forces from outside; else the whole ship, under orders.

    Raises:
        ShipError: a ship that has no right-hand side or no hull of its own; no compiler, or no platform of
            FMI 2.0; a file that cannot be written.
    """
    target = Path(path)
    if target.suffix != ".fmu":
        raise ShipError(f"{target}: a co-simulation slave ends in .fmu")
    made = slave(ship, dt=dt, hull=hull)
    files, guid = sources(made)
    folder, suffix = _platform(target)
    binary = _compiled(files, made.plant.name + suffix, target)
    osp = osp_description(made)
    content: dict[str, bytes] = {"modelDescription.xml": model_description(made, target.stem, guid).encode()}
    content[f"binaries/{folder}/{made.plant.name}{suffix}"] = binary
    content |= {f"sources/{name}": text.encode() for name, text in files.items()}
    content["resources/OspModelDescription.xml"] = osp.encode()
    beside = target.with_name(f"{target.stem}_OspModelDescription.xml")
    write({target: _zipped(content), beside: osp.encode()})
    return target, beside


def slave(ship: Ship, *, dt: float | None = None, hull: bool = False) -> Layout:
    """The variables of the slave and what it computes."""
    taken = hull_of(ship) if hull else ship
    if dt is not None and not (dt > 0.0 and math.isfinite(dt)):
        raise ShipError(f"{ship.name}: a step of {dt:g} s; it must be above zero")
    made = plant(taken)  # refuses what has no right-hand side before anything asks for its step
    step = time_step(ship) if dt is None else dt
    return layout(taken, made if hull else plant(taken, step), step)


def _platform(target: Path) -> tuple[str, str]:
    here = (platform.system(), platform.machine())
    if here not in _PLATFORMS:
        raise ShipError(f"{target}: FMI 2.0 has no name for {' '.join(here)}; --c FOLDER writes the plant as C")
    return _PLATFORMS[here]


def _compiled(files: Mapping[str, str], name: str, target: Path) -> bytes:
    """The shared library of the sources; built from relative names, so that no path of this machine enters it."""
    try:
        cc = compiler()
    except CompilerError as error:
        raise ShipError(f"{target}: an FMU holds a binary: {error}") from None
    with tempfile.TemporaryDirectory() as scratch:
        for file, text in files.items():
            Path(scratch, file).write_text(text, encoding="utf-8")
        strip = ("-s",) if platform.system() == "Linux" else ()
        done = subprocess.run(
            [cc, *FLAGS, *strip, "fmi2.c", "ship.c", "-o", name, "-lm"],
            cwd=scratch, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            told = (done.stderr.strip().splitlines() or [f"exit {done.returncode}"])[-1]
            raise ShipError(f"{target}: {Path(cc).name} failed: {told}")
        return Path(scratch, name).read_bytes()


def _zipped(content: Mapping[str, bytes]) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in content.items():
            entry = zipfile.ZipInfo(name, _BEGINNING_OF_TIME)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, data)
    return packed.getvalue()
