"""A ship as a co-simulation slave: one file with description, sources and binary, by FMI 2.0 or 3.0.

It is the whole ship under orders, or its hull alone: without propeller, rudder and thrusters, moved by forces from
outside.  The page inside a slave describes it: inputs, outputs and every number with its source.
"""

from __future__ import annotations

import io
import math
import zipfile
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from ...core.parameters import Parts, Scalar, parts
from ...core.values import dataclass, replace
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
from ..traced import equations_of, outline
from ..writing import filled, write
from .binaries import chosen, compile_for
from .layout import Layout, Real, layout
from .source import compiled, sources
from .xml import OSP, descriptions

VERSIONS = (2, 3)
"""Of the interface."""

_BEGINNING_OF_TIME = (1980, 1, 1, 0, 0, 0)


def save_fmu(
    ship: Ship, path: str | Path, *, dt: float | None = None, hull: bool = False, fmi: int = 2,
    platforms: Sequence[str] = (),
) -> tuple[Path, ...]:  # fmt: skip
    """Write ``FILE.fmu`` and, of FMI 2.0, ``FILE_OspModelDescription.xml`` beside it.

    The same ship gives the same bytes where the compiler is the same.

    Args:
        ship: any ship in continuous time, or one that moves by a network.
        path: ends in .fmu, in a folder that is there.
        dt: internal step [s]; None takes the one that suits the ship. A network has its own.
        hull: the hull alone, under forces from outside; else the whole ship, under orders.
        fmi: version of the interface, one of `VERSIONS`.
        platforms: whose binaries it holds, such as ``linux64`` and ``win64``; this machine's own unless given.

    Raises:
        ShipError: a ship that has no right-hand side or no hull of its own, or a network without weights; no
            compiler, or no platform of the interface; a file that cannot be written.
    """
    target = Path(path)
    if target.suffix != ".fmu":
        raise ShipError(f"{target}: a co-simulation slave ends in .fmu")
    if fmi not in VERSIONS:
        raise ShipError(f"{target}: no version {fmi} of FMI here; known: {', '.join(map(str, VERSIONS))}")
    try:
        whose = chosen(platforms, fmi)
    except ShipError as error:
        raise ShipError(f"{target}: {error}") from None
    made = slave(ship, dt=dt, hull=hull)
    files, guid = sources(made, fmi)
    name = made.plant.name
    content = {f"binaries/{one.folder(fmi)}/{name}{one.suffix}": compile_for(one, files, compiled(fmi), name, target)
               for one in whose}  # fmt: skip
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
    made = equations_of(taken)  # refuses what has no right-hand side before anything asks for its step
    step = time_step(ship) if dt is None else dt
    return layout(taken, made if hull else equations_of(taken, step), step)


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
