"""The command export: the plant of a ship as files for controllers and co-simulation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ..environment import CHANNELS
from ..exchange import plant, save_c, save_casadi, save_fmu, save_network, save_python
from ..exchange.casadi_function import description
from ..exchange.fmi.fmu import VERSIONS
from ..exchange.fmi.fmu import slave as layout_of
from ..models import Stepped
from ..ships import Ship
from ..simulate.approach import step_doubt
from .support import UsageError, emit, make_folder, note, positive, read_ship


class Slave(NamedTuple):
    """What is asked of the co-simulation slave: its file, the hull alone, its internal step [s], version of FMI."""

    path: Path | None
    hull: bool
    dt: float | None
    fmi: int | None

    def save(self, ship: Ship) -> tuple[Path, ...]:
        """Write it, where it is asked for."""
        if self.path is None:
            return ()
        return save_fmu(ship, self.path, dt=self.dt, hull=self.hull, fmi=self.fmi or VERSIONS[0])


def export(
    model: str, casadi: Path | None, c: Path | None, python: Path | None, actuators: float | None, slave: Slave,
    json: bool,
) -> None:  # fmt: skip
    """Write the plant in each form that is asked for.

    Raises:
        UsageError: none is asked for, or a path that cannot be written to.
        ShipError: a ship that has no right-hand side; a file that cannot be written.
    """
    _check(casadi, c, python, slave)
    ship = read_ship(model)
    if isinstance(ship.model, Stepped) and casadi is None and c is None:
        _network(ship, python, actuators, slave, json)
        return
    made = plant(ship, actuators)
    _doubt(ship, actuators, slave.dt)
    written: list[Path] = []
    if casadi is not None:
        written += save_casadi(made, casadi)
    if c is not None:
        make_folder(c)
        written += save_c(made, c)
    if python is not None:
        written.append(save_python(made, python))
    written += slave.save(ship)
    _tell(ship, {**description(made), **_variables(ship, slave)}, written, json)


def _tell(ship: Ship, document: Mapping[str, Any], written: Iterable[Path], json: bool) -> None:
    for caution in ship.notes.get("cautions", ()):
        note(f"note: {ship.name}: {caution}")
    if json:
        emit({**document, "written": [str(path) for path in written]})
    else:
        for path in written:
            note(f"wrote {path}")


def _doubt(ship: Ship, actuators: float | None, dt: float | None) -> None:
    """Say where a step is too long to trust what comes out."""
    for option, step in (("--actuators", actuators), ("--dt", dt)):
        if step is not None and (doubt := step_doubt(ship, step)) is not None:
            note(f"warning: {option}: {doubt}")


def _variables(ship: Ship, slave: Slave) -> dict[str, Any]:
    """What the co-simulation slave takes and gives, where one is asked for."""
    if slave.path is None:
        return {}
    made = layout_of(ship, dt=slave.dt, hull=slave.hull)
    units = {key: {real.name: real.unit for real in reals}
             for key, reals in (("inputs", made.inputs), ("outputs", made.outputs))}  # fmt: skip
    return {"fmu": {"fmi": slave.fmi or VERSIONS[0], "step": made.step, **units}}


def _network(ship: Ship, python: Path | None, actuators: float | None, slave: Slave, json: bool) -> None:
    """The forms that a network is exported in: its steps in Python, and a slave."""
    if actuators is not None:
        raise UsageError("--actuators: a network is exported without its actuators; leave the option out")
    told = _variables(ship, slave)  # refuses what the slave cannot be before anything is written
    written = () if python is None else save_network(ship, python)
    written += slave.save(ship)
    _tell(ship, {"ship": ship.name, "states": list(ship.model.states), "controls": list(ship.model.controls),
                 "environment": list(CHANNELS), **told}, written, json)  # fmt: skip


def _check(casadi: Path | None, c: Path | None, python: Path | None, slave: Slave) -> None:
    """Refuse what cannot be written before anything is."""
    files = {path.resolve(): path for path in (casadi, python, slave.path) if path is not None}
    _check_slave(slave)
    if not files and c is None:
        raise UsageError("export to what? give --casadi FILE, --c FOLDER, --python FILE or --fmu FILE")
    if casadi is not None and python is not None and len(files) == 1:
        raise UsageError(f"{casadi}: --casadi and --python name one file")
    if python is not None and python.suffix != ".py":
        raise UsageError(f"{python}: a Python file ends in .py")
    for path in files.values():
        if not path.parent.is_dir():
            raise UsageError(f"{path}: no such folder: {path.parent}")
        if path.is_dir():
            raise UsageError(f"{path}: is a folder; name a file")


def _check_slave(slave: Slave) -> None:
    for name, given in (("--hull", slave.hull), ("--dt", slave.dt is not None), ("--fmi", slave.fmi is not None)):
        if given and slave.path is None:
            raise UsageError(f"{name} is of the co-simulation slave: give --fmu FILE.fmu too")
    positive(dt=slave.dt)
    if slave.fmi not in (None, *VERSIONS):
        raise UsageError(f"--fmi is {slave.fmi}; known: {', '.join(map(str, VERSIONS))}")
    if slave.path is not None and slave.path.suffix != ".fmu":
        raise UsageError(f"{slave.path}: a co-simulation slave ends in .fmu")
