"""A ship as a co-simulation slave: one file with description, sources and binary, by FMI 2.0 or 3.0.

It is the whole ship under orders, or its hull alone: without propeller, rudder and thrusters, moved by forces from
outside.  The page inside a slave describes it: inputs, outputs and every number with its source.
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
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import Any

from ...core.errors import CompilerError
from ...core.parameters import Parts, Scalar, parts
from ...engine.compilers import compiler
from ...environment import Environment
from ...forces import Flow, Force, ForceModule
from ...forces.body import Body
from ...forces.shallow import afloat
from ...models import Model
from ...models.common import Surroundings
from ...models.fossen import Fossen, Inertia, Particulars
from ...models.mmg import Mmg
from ...models.neural import Neural
from ...models.twin import TwinMmg
from ...ships import Ship, ShipError
from ...simulate.approach import time_step
from ..network_source import trained
from ..plant import outline, plant
from ..writing import filled, write
from .layout import Layout, Real, layout
from .source import compiled, sources
from .xml import OSP, descriptions

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
    described = descriptions(made, target.stem, guid, fmi)
    content = {name: text.encode() for name, text in described.items()} | content
    beside = {target.with_name(f"{target.stem}_{Path(OSP).name}"): content[OSP]} if OSP in described else {}
    return write({target: _zipped(content), **beside})


FORCES = ("X_outer", "Y_outer", "N_outer")
"""Sum of the forces from outside: ahead [N], to starboard [N], moment about midship to starboard [N m]."""


@dataclass(frozen=True, kw_only=True)
class _Hull(Model):
    """A ship without propeller, rudder and thrusters, moved by forces from outside."""

    body: Any

    @property
    def controls(self) -> tuple[str, ...]:
        """The forces from outside."""
        return FORCES

    def derivative(
        self, state: tuple[Scalar, ...], control: tuple[Scalar, ...], environment: Environment
    ) -> tuple[Scalar, ...]:
        """Time derivative of `state` [SI/s] under the forces from outside."""
        around = Surroundings.of(state, environment)
        flow = around.flow(self.body)
        return around.rates(self.acceleration(flow, Force(*control)))

    @abstractmethod
    def acceleration(self, flow: Flow, outer: Force) -> tuple[Scalar, Scalar, Scalar]:
        """Accelerations of u, v_m and r [m/s^2, rad/s^2] under the hull's own forces and those from outside."""


@dataclass(frozen=True, kw_only=True)
class MmgHull(_Hull):
    """Hull and body of the MMG family; `extras` are what is fixed to the hull, such as a skeg."""

    body: Body
    hull: ForceModule
    extras: Parts = parts("force")

    def acceleration(self, flow: Flow, outer: Force) -> tuple[Scalar, Scalar, Scalar]:
        """See `_Hull`."""
        total = self.hull.force(flow) + outer
        for module in self.extras.components:
            total = total + module.force(flow)
        return afloat(self.body, self.hull, flow, self.extras.components).acceleration(total, flow.u, flow.v_m, flow.r)


@dataclass(frozen=True, kw_only=True)
class FossenHull(_Hull):
    """Inertia and damping of Fossen's family."""

    body: Particulars
    inertia: Inertia
    damping: ForceModule

    def acceleration(self, flow: Flow, outer: Force) -> tuple[Scalar, Scalar, Scalar]:
        """See `_Hull`."""
        return self.inertia.acceleration(self.damping.force(flow) + outer, flow.u, flow.v_m, flow.r)


def hull_of(ship: Ship) -> Ship:
    """The ship with its hull for a model; paths of the parameters, and so their sources, stay.

    Raises:
        ShipError: a model whose hull is not a part of its own.
    """
    model: Any = ship.model
    if type(model) in (Mmg, TwinMmg):
        hull: Any = MmgHull(body=model.body, hull=model.hull, extras=model.part("extras") or Parts())
    elif type(model) is Fossen:
        hull = FossenHull(body=model.body, inertia=model.inertia, damping=model.damping)
    else:
        whole = f"{type(model).__name__} does not keep the hull apart from what drives it"
        raise ShipError(f"{ship.name}: --hull takes an Mmg, TwinMmg or Fossen model; {whole}; leave --hull out")
    title = f"{ship.notes.get('title', ship.name)}: the hull alone, forces from outside"
    return replace(ship, name=f"{ship.name}_hull", model=hull, notes={**ship.notes, "title": title})


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
    strip = ("-s",) if platform.system() == "Linux" else ()
    try:
        with tempfile.TemporaryDirectory() as scratch:
            for file, text in files.items():
                Path(scratch, file).write_text(text, encoding="utf-8")
            # Its own scratch files go where ours went: Python passes over a TMPDIR that is full, a compiler does not.
            done = subprocess.run(
                [*cc.command, *FLAGS, *strip, *which, "-o", name, "-lm"], env={**os.environ, "TMPDIR": scratch},
                cwd=scratch, capture_output=True, text=True, check=False,
            )  # fmt: skip
            if done.returncode:
                raise ShipError(f"{target}: {cc.name} failed: {_why(done.stderr) or f'exit {done.returncode}'}")
            return Path(scratch, name).read_bytes()
    except OSError as error:
        folder = tempfile.gettempdir()
        raise ShipError(
            f"{target}: cannot be compiled in {folder}: {error.strerror}; set TMPDIR to a folder with room") from None


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
    moves = "a right-hand side, by the Runge-Kutta method of fourth order" if made.network is None else (
        "a network; body accelerations are those over its last sample")  # fmt: skip
    tables = (("Outputs", made.outputs), ("Inputs", made.inputs),
              ("Parameters", (*made.numbers, *made.servos, *made.starts)))  # fmt: skip
    return filled("slave.html.txt", "page", title=escape(made.plant.title), step=f"{made.step:g}", moves=moves,
                  tables="\n".join(_table(title, reals) for title, reals in tables)) + "\n"  # fmt: skip


def _table(title: str, reals: Sequence[Real]) -> str:
    rows = (f"<tr><td>{escape(r.name)}</td><td>{escape(r.unit)}</td><td>{escape(r.about)}</td>"
            f"<td>{f'{r.start:g}' if r.causality != 'output' else ''}</td></tr>" for r in reals if r.shown)  # fmt: skip
    return filled("slave.html.txt", "table", title=title, rows="\n".join(rows))
