"""The command export: the plant of a ship as files for controllers and co-simulation."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from .cli_support import UsageError, emit, make_folder, note, positive, read_ship
from .environment import CHANNELS
from .exchange import plant, save_c, save_casadi, save_fmu, save_network, save_python
from .exchange.casadi_function import description
from .exchange.fmu import slave as layout_of
from .models import Stepped
from .ships import Ship


class Slave(NamedTuple):
    """What is asked of the co-simulation slave: its file, the hull alone, its internal step [s]."""

    path: Path | None
    hull: bool
    dt: float | None


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
    if isinstance(ship.model, Stepped) and python is not None and (casadi, c, slave.path) == (None, None, None):
        _network(ship, python, actuators, json)
        return
    made = plant(ship, actuators)
    written: list[Path] = []
    if casadi is not None:
        written += save_casadi(made, casadi)
    if c is not None:
        make_folder(c)
        written += save_c(made, c)
    if python is not None:
        written.append(save_python(made, python))
    if slave.path is not None:
        written += save_fmu(ship, slave.path, dt=slave.dt, hull=slave.hull)
    for caution in ship.notes.get("cautions", ()):
        note(f"note: {ship.name}: {caution}")
    if json:
        emit({**description(made), **_variables(ship, slave), "written": [str(path) for path in written]})
    else:
        for path in written:
            note(f"wrote {path}")


def _variables(ship: Ship, slave: Slave) -> dict[str, Any]:
    """What the co-simulation slave takes and gives, where one is asked for."""
    if slave.path is None:
        return {}
    made = layout_of(ship, dt=slave.dt, hull=slave.hull)
    units = {key: {real.name: real.unit for real in reals}
             for key, reals in (("inputs", made.inputs), ("outputs", made.outputs))}  # fmt: skip
    return {"fmu": {"step": made.step, **units}}


def _network(ship: Ship, python: Path, actuators: float | None, json: bool) -> None:
    """The one form that a network is exported in."""
    if actuators is not None:
        raise UsageError("--actuators: a network is exported without its actuators; leave the option out")
    written = save_network(ship, python)
    if json:
        emit({"ship": ship.name, "states": list(ship.model.states), "controls": list(ship.model.controls),
              "environment": list(CHANNELS), "written": [str(path) for path in written]})  # fmt: skip
    else:
        for path in written:
            note(f"wrote {path}")


def _check(casadi: Path | None, c: Path | None, python: Path | None, slave: Slave) -> None:
    """Refuse what cannot be written before anything is."""
    files = {path.resolve(): path for path in (casadi, python, slave.path) if path is not None}
    if slave.path is None and (slave.hull or slave.dt is not None):
        raise UsageError(f"{'--hull' if slave.hull else '--dt'} is of the co-simulation slave: give --fmu FILE.fmu too")
    positive(dt=slave.dt)
    if not files and c is None:
        raise UsageError("export to what? give --casadi FILE, --c FOLDER, --python FILE or --fmu FILE")
    if slave.path is not None and slave.path.suffix != ".fmu":
        raise UsageError(f"{slave.path}: a co-simulation slave ends in .fmu")
    if casadi is not None and python is not None and len(files) == 1:
        raise UsageError(f"{casadi}: --casadi and --python name one file")
    if python is not None and python.suffix != ".py":
        raise UsageError(f"{python}: a Python file ends in .py")
    for path in files.values():
        if not path.parent.is_dir():
            raise UsageError(f"{path}: no such folder: {path.parent}")
        if path.is_dir():
            raise UsageError(f"{path}: is a folder; name a file")
