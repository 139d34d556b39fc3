"""A ship as a co-simulation slave: one file with description, sources and binary, by FMI 2.0 or 3.0.

The page inside a slave describes it: inputs, outputs and every number with its source.
"""

from __future__ import annotations

import errno
import io
import math
import os
import platform
import subprocess
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from ...engine.cache import CompilerError, compiler
from ...models.neural import Neural
from ...ships import Ship, ShipError
from ...simulate.approach import time_step
from ..network_source import trained
from ..plant import outline, plant
from ..writing import write
from .hull import hull_of
from .layout import Layout, Real, layout
from .source import compiled, sources
from .xml import build_description, model_description, model_description_3, osp_description, terminals

FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off")
"""For any processor of the platform: no flag that looks at this one."""

VERSIONS = (2, 3)
"""Of the interface."""

_SUFFIXES = {"Linux": ".so", "Darwin": ".dylib", "Windows": ".dll"}
_NAMES = {("Linux", "x86_64"): "linux64", ("Darwin", "x86_64"): "darwin64", ("Windows", "AMD64"): "win64"}
_PROCESSORS = {"x86_64": "x86_64", "AMD64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64", "ARM64": "aarch64"}
_BEGINNING_OF_TIME = (1980, 1, 1, 0, 0, 0)


def save_fmu(
    ship: Ship, path: str | Path, *, dt: float | None = None, hull: bool = False, fmi: int = 2
) -> tuple[Path, ...]:
    """Write ``FILE.fmu`` and, of FMI 2.0, ``FILE_OspModelDescription.xml`` beside it.

    The same ship gives the same bytes where the compiler is the same.

    Args:
        ship: any ship in continuous time, or one that moves by a network.
        path: ends in .fmu, in a folder that is there.
        dt: internal step [s]; None takes the one that suits the ship. A network has its own.
        hull: the hull alone, under forces from outside; else the whole ship, under orders.
        fmi: version of the interface, one of `VERSIONS`.

    Raises:
        ShipError: a ship that has no right-hand side or no hull of its own, or a network without weights; no
            compiler, or no platform of the interface; a file that cannot be written.
    """
    target = Path(path)
    if target.suffix != ".fmu":
        raise ShipError(f"{target}: a co-simulation slave ends in .fmu")
    if fmi not in VERSIONS:
        raise ShipError(f"{target}: no version {fmi} of FMI here; known: {', '.join(map(str, VERSIONS))}")
    made = slave(ship, dt=dt, hull=hull)
    files, guid = sources(made, fmi)
    folder, suffix = _platform(target, fmi)
    binary = f"binaries/{folder}/{made.plant.name}{suffix}"
    content = {binary: _compiled(files, compiled(fmi), made.plant.name + suffix, target)}
    content |= {f"sources/{name}": text.encode() for name, text in files.items()}
    content["documentation/index.html"] = page(made).encode()
    told = _told_2(made, target.stem, guid) if fmi == 2 else _told_3(made, target.stem, guid)
    content = {name: text.encode() for name, text in told.items()} | content
    beside = {target.with_name(f"{target.stem}_{Path(name).name}"): content[name] for name in told if name == _OSP}
    write({target: _zipped(content), **beside})
    return (target, *beside)


_OSP = "resources/OspModelDescription.xml"


def _told_2(made: Layout, name: str, guid: str) -> dict[str, str]:
    return {"modelDescription.xml": model_description(made, name, guid), _OSP: osp_description(made)}


def _told_3(made: Layout, name: str, token: str) -> dict[str, str]:
    return {
        "modelDescription.xml": model_description_3(made, name, token),
        "sources/buildDescription.xml": build_description(made),
        "terminalsAndIcons/terminalsAndIcons.xml": terminals(made),
    }


def slave(ship: Ship, *, dt: float | None = None, hull: bool = False) -> Layout:
    """The variables of the slave and what it computes."""
    taken = hull_of(ship) if hull else ship
    if dt is not None and not (dt > 0.0 and math.isfinite(dt)):
        raise ShipError(f"{ship.name}: a step of {dt:g} s; it must be above zero")
    if isinstance(taken.model, Neural):
        own = float(trained(taken).dt)
        if dt is not None and dt != own:
            raise ShipError(f"{ship.name}: a step of {dt:g} s; its network runs at {own:g} s and no other")
        return layout(taken, outline(taken, own), own)
    made = plant(taken)  # refuses what has no right-hand side before anything asks for its step
    step = time_step(ship) if dt is None else dt
    return layout(taken, made if hull else plant(taken, step), step)


def _platform(target: Path, fmi: int) -> tuple[str, str]:
    """Folder and suffix of the binary."""
    system, processor = platform.system(), platform.machine()
    folder = _NAMES.get((system, processor))
    if fmi == 3 and processor in _PROCESSORS:
        folder = f"{_PROCESSORS[processor]}-{system.lower()}"
    if folder is None or system not in _SUFFIXES:
        raise ShipError(
            f"{target}: FMI {fmi}.0 has no name for {system} {processor}; --c FOLDER writes the plant as C")
    return folder, _SUFFIXES[system]


def _compiled(files: Mapping[str, str], which: Sequence[str], name: str, target: Path) -> bytes:
    """The shared library of the sources; built from relative names, so that no path of this machine enters it."""
    try:
        cc = compiler()
    except CompilerError as error:
        raise ShipError(f"{target}: an FMU holds a binary: {error}") from None
    try:
        with tempfile.TemporaryDirectory() as scratch:
            return _built(cc, files, which, name, target, Path(scratch))
    except OSError as error:
        folder = tempfile.gettempdir()
        raise ShipError(
            f"{target}: cannot be compiled in {folder}: {error.strerror}; set TMPDIR to a folder with room") from None


def _built(
    cc: str, files: Mapping[str, str], which: Sequence[str], name: str, target: Path, scratch: Path
) -> bytes:  # fmt: skip
    for file, text in files.items():
        (scratch / file).write_text(text, encoding="utf-8")
    strip = ("-s",) if platform.system() == "Linux" else ()
    # Its own scratch files go where ours went: Python passes over a TMPDIR that is full, a compiler does not.
    done = subprocess.run(
        [cc, *FLAGS, *strip, *which, "-o", name, "-lm"], env={**os.environ, "TMPDIR": str(scratch)},
        cwd=scratch, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise ShipError(f"{target}: {Path(cc).name} failed: {_why(done.stderr) or f'exit {done.returncode}'}")
    return (scratch / name).read_bytes()


def _why(told: str) -> str:
    """The first error line of a compiler; "compilation terminated" comes last."""
    lines = [line.strip() for line in told.splitlines() if line.strip()]
    if any(os.strerror(errno.ENOSPC) in line for line in lines):
        return f"{os.strerror(errno.ENOSPC)} in {tempfile.gettempdir()}; set TMPDIR to a folder with room"
    return next((line for line in lines if "error" in line.lower()), lines[-1] if lines else "")


def _zipped(content: Mapping[str, bytes]) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in content.items():
            entry = zipfile.ZipInfo(name, _BEGINNING_OF_TIME)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, data)
    return packed.getvalue()


def page(made: Layout) -> str:
    """documentation/index.html."""
    title = escape(made.plant.title)
    moves = "a right-hand side, by the Runge-Kutta method of fourth order" if made.network is None else (
        "a network; body accelerations are those over its last sample")  # fmt: skip
    return "\n".join([
        "<!DOCTYPE html>", f'<html lang="en"><head><meta charset="utf-8"><title>{title}</title></head><body>',
        f"<h1>{title}</h1>",
        f"<p>Written by seatrial. Internal step {made.step:g} s; it moves by {moves}. SI units and radians; forces and "
        "velocities are those of midship, ahead, to starboard and turning to starboard positive; wind and waves have "
        "the direction they come from. It needs the C library and nothing else.</p>",
        *_table("Outputs", made.outputs), *_table("Inputs", made.inputs),
        *_table("Parameters", (*made.numbers, *made.servos, *made.starts)), "</body></html>", "",
    ])  # fmt: skip


def _table(title: str, reals: Sequence[Real]) -> list[str]:
    rows = [f"<tr><td>{escape(r.name)}</td><td>{escape(r.unit)}</td><td>{escape(r.about)}</td>"
            f"<td>{f'{r.start:g}' if r.causality != 'output' else ''}</td></tr>" for r in reals if r.shown]  # fmt: skip
    head = "<table><tr><th>name</th><th>unit</th><th>meaning</th><th>start</th></tr>"
    return [f"<h2>{title}</h2>", head, *rows, "</table>"]
