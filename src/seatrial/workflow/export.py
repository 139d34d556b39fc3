"""Export of the plant of a ship: a CasADi function, C source, a Python file, a co-simulation slave (FMU)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..environment import CHANNELS
from ..exchange import plant, save_c, save_casadi, save_fmu, save_network, save_python
from ..exchange.casadi_function import description
from ..exchange.fmi.fmu import VERSIONS
from ..exchange.fmi.fmu import slave as layout_of
from ..models import Stepped
from ..ships import Ship
from ..simulate.approach import step_doubt
from . import RequestError
from .request import Note, make_folder, positive, ship_of, silent


@dataclass(frozen=True)
class Exported:
    """Files of an exported plant, and the description of its inputs, states and outputs."""

    ship: Ship
    description: Mapping[str, Any]
    written: tuple[Path, ...]


@dataclass(frozen=True)
class Slave:
    """A co-simulation slave to write.

    Attributes:
        path: the file (.fmu).
        hull: whether it is the hull alone, with forces as inputs.
        dt: internal step [s]; one that suits the ship where it is None.
        fmi: version of the interface.
    """

    path: Path
    hull: bool = False
    dt: float | None = None
    fmi: int = VERSIONS[0]

    def save(self, ship: Ship) -> tuple[Path, ...]:
        """Write it."""
        return tuple(save_fmu(ship, self.path, dt=self.dt, hull=self.hull, fmi=self.fmi))

    def variables(self, ship: Ship) -> dict[str, Any]:
        """Inputs and outputs with their units."""
        made = layout_of(ship, dt=self.dt, hull=self.hull)
        units = {key: {real.name: real.unit for real in reals}
                 for key, reals in (("inputs", made.inputs), ("outputs", made.outputs))}  # fmt: skip
        return {"fmu": {"fmi": self.fmi, "step": made.step, **units}}


def export(
    model: str | Path | Ship, *, casadi: Path | None = None, c: Path | None = None, python: Path | None = None,
    actuators: float | None = None, fmu: Path | None = None, fmi: int | None = None, hull: bool = False,
    dt: float | None = None, note: Note = silent,
) -> Exported:  # fmt: skip
    """Write the plant of a ship in each form that is given.

    Args:
        model: a name of the library, a ship file or a ship.
        casadi: file of a CasADi function; its step and names go beside it.
        c: folder of a C99 source file and its header.
        python: Python file that needs the standard library only.
        actuators: step [s] from orders through the actuators, in the three forms above.
        fmu: co-simulation slave.
        fmi, hull, dt: see `Slave`.
        note: takes cautions and the files as they are written.

    Raises:
        RequestError: no form is given, or a path that cannot be written to.
        ShipError: a ship that has no right-hand side; a file that cannot be written.
    """
    slave = _slave(fmu, fmi, hull, dt)
    _check(casadi, c, python, slave)
    ship = ship_of(model)
    if isinstance(ship.model, Stepped) and casadi is None and c is None:
        found, written = _network(ship, python, actuators, slave)
    else:
        found, written = _plant(ship, casadi, c, python, actuators, slave, note)
    for caution in ship.notes.get("cautions", ()):
        note(f"note: {ship.name}: {caution}")
    return Exported(ship, found, tuple(written))


def _plant(
    ship: Ship, casadi: Path | None, c: Path | None, python: Path | None, actuators: float | None,
    slave: Slave | None, note: Note,
) -> tuple[Mapping[str, Any], list[Path]]:  # fmt: skip
    made = plant(ship, actuators)
    for option, step in (("--actuators", actuators), ("--dt", slave and slave.dt)):
        if step is not None and (doubt := step_doubt(ship, step)) is not None:
            note(f"warning: {option}: {doubt}")
    written: list[Path] = []
    if casadi is not None:
        written += save_casadi(made, casadi)
    if c is not None:
        make_folder(c)
        written += save_c(made, c)
    if python is not None:
        written.append(save_python(made, python))
    if slave is None:
        return description(made), written
    return {**description(made), **slave.variables(ship)}, [*written, *slave.save(ship)]


def _network(
    ship: Ship, python: Path | None, actuators: float | None, slave: Slave | None
) -> tuple[Mapping[str, Any], list[Path]]:
    """The forms in which a network is exported: its steps in Python, and a slave."""
    if actuators is not None:
        raise RequestError("--actuators: a network is exported without its actuators; leave the option out")
    variables = {} if slave is None else slave.variables(ship)  # refuses an impossible slave before anything is written
    written = [] if python is None else [*save_network(ship, python)]
    written += [] if slave is None else slave.save(ship)
    return {"ship": ship.name, "states": list(ship.model.states), "controls": list(ship.model.controls),
            "environment": list(CHANNELS), **variables}, written  # fmt: skip


def _slave(path: Path | None, fmi: int | None, hull: bool, dt: float | None) -> Slave | None:
    """The slave that is asked for.

    Raises:
        RequestError: its options without its file, or what it cannot be.
    """
    for name, given in (("--hull", hull), ("--dt", dt is not None), ("--fmi", fmi is not None)):
        if given and path is None:
            raise RequestError(f"{name} is of the co-simulation slave: give --fmu FILE.fmu too")
    positive(dt=dt)
    if fmi not in (None, *VERSIONS):
        raise RequestError(f"--fmi is {fmi}; known: {', '.join(map(str, VERSIONS))}")
    if path is not None and path.suffix != ".fmu":
        raise RequestError(f"{path}: a co-simulation slave ends in .fmu")
    return None if path is None else Slave(path, hull, dt, fmi or VERSIONS[0])


def _check(casadi: Path | None, c: Path | None, python: Path | None, slave: Slave | None) -> None:
    """Refuse what cannot be written before anything is."""
    files = {path.resolve(): path for path in (casadi, python, slave and slave.path) if path is not None}
    if not files and c is None:
        raise RequestError("export to what? give --casadi FILE, --c FOLDER, --python FILE or --fmu FILE")
    if casadi is not None and python is not None and len(files) == 1:
        raise RequestError(f"{casadi}: --casadi and --python name one file")
    if python is not None and python.suffix != ".py":
        raise RequestError(f"{python}: a Python file ends in .py")
    for path in files.values():
        if not path.parent.is_dir():
            raise RequestError(f"{path}: no such folder: {path.parent}")
        if path.is_dir():
            raise RequestError(f"{path}: is a folder; name a file")
