"""The plant of a ship: its export for controllers and co-simulation, thrust from a bollard pull, servos from logs."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..core.files import TomlError, toml_of, write_whole
from ..core.values import dataclass
from ..data import Array, DataError, Trial
from ..data.table import lines_of, numbers, split_row
from ..data.units import KNOWN
from ..environment import CHANNELS
from ..exchange import equations_of, save_c, save_casadi, save_fmu, save_network, save_python
from ..exchange.casadi_function import description
from ..exchange.fmi.binaries import chosen
from ..exchange.fmi.fmu import VERSIONS
from ..exchange.fmi.fmu import slave as layout_of
from ..identify.components.servo import ServoFit, fit_servo, servos
from ..identify.components.thrust_map import ThrustMap, fit_thrust, fit_thrusters, shared
from ..models import Stepped
from ..ships import Ship, ShipError
from ..simulate.approach import step_doubt
from . import RequestError
from .request import Note, check_output, make_folder, positive, ship_of, silent

_HEAD = re.compile(r"^(?P<kind>[nT])(_(?P<name>\w+))?\s*\[(?P<unit>[^\]]+)\]$")
_UNITS = {"n": "1/s", "T": "N"}
_HEADING = "# Tables of a ship file (docs/extending.md)."


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
        platforms: whose binaries it holds; this machine's own where none is named.
    """

    path: Path
    hull: bool = False
    dt: float | None = None
    fmi: int = VERSIONS[0]
    platforms: tuple[str, ...] = ()

    def save(self, ship: Ship) -> tuple[Path, ...]:
        """Write it."""
        return tuple(save_fmu(ship, self.path, dt=self.dt, hull=self.hull, fmi=self.fmi, platforms=self.platforms))

    def variables(self, ship: Ship) -> dict[str, Any]:
        """Inputs and outputs with their units."""
        made = layout_of(ship, dt=self.dt, hull=self.hull)
        units = {key: {real.name: real.unit for real in reals}
                 for key, reals in (("inputs", made.inputs), ("outputs", made.outputs))}  # fmt: skip
        return {"fmu": {"fmi": self.fmi, "step": made.step, **units}}


def export(
    model: str | Path | Ship, *, casadi: Path | None = None, c: Path | None = None, python: Path | None = None,
    actuators: float | None = None, fmu: Path | None = None, fmi: int | None = None, hull: bool = False,
    dt: float | None = None, platforms: str | None = None, note: Note = silent,
) -> Exported:  # fmt: skip
    """Write the plant of a ship in each form that is given.

    Args:
        model: a name of the library, a ship file or a ship.
        casadi, c, python, actuators: as the options of `seatrial export`.
        fmu, fmi, hull, dt: see `Slave`.
        platforms: names of `Slave`, such as ``linux64,win64``.
        note: takes cautions and the files as they are written.

    Raises:
        RequestError: no form is given, or a path that cannot be written to.
        ShipError: a ship that has no right-hand side; a file that cannot be written.
    """
    slave = _slave(fmu, fmi, hull, dt, platforms)
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
    made = equations_of(ship, actuators)
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


def _slave(
    path: Path | None, fmi: int | None, hull: bool, dt: float | None, platforms: str | None
) -> Slave | None:
    """The slave that is asked for.

    Raises:
        RequestError: its options without its file, or what it cannot be.
    """
    for name, given in (("--hull", hull), ("--dt", dt is not None), ("--fmi", fmi is not None),
                        ("--platforms", platforms is not None)):  # fmt: skip
        if given and path is None:
            raise RequestError(f"{name} is of the co-simulation slave: give --fmu FILE.fmu too")
    positive(dt=dt)
    if fmi not in (None, *VERSIONS):
        raise RequestError(f"--fmi is {fmi}; known: {', '.join(map(str, VERSIONS))}")
    if path is not None and path.suffix != ".fmu":
        raise RequestError(f"{path}: a co-simulation slave ends in .fmu")
    if path is None:
        return None
    names = tuple(name.strip() for name in (platforms or "").split(",") if name.strip())
    try:
        chosen(names, fmi or VERSIONS[0])
    except ShipError as error:
        raise RequestError(f"--platforms: {error}" if names else f"{path}: {error}") from None
    return Slave(path, hull, dt, fmi or VERSIONS[0], names)


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


def thrust_map(
    table: Path, out: Path | None = None, thrusters: str | None = None, together: bool = False,
    order: int | None = None, note: Note = silent,
) -> list[ThrustMap]:  # fmt: skip
    """Fit thrust by revolutions to a table of a bollard pull, and write the [thrusters] of a ship file.

    Args:
        table: file with columns such as ``n [1/s],T_1 [N],T_2 [N]``.
        out, thrusters, together, order: as the options of `seatrial thrust-map`.
        note: takes what was left out or assumed.

    Raises:
        DataError: a table that cannot be used; names column, line or revolutions.
        RequestError: options that contradict each other.
    """
    _writable(out, "thrusters", table)
    names = None if thrusters is None else [name.strip() for name in thrusters.split(",") if name.strip()]
    columns = read_pull(table)
    rows = len(lines_of(table)) - 1
    if together:
        if not names or len(columns) != 1:
            raise RequestError("--together takes one column of thrust and names whose it is: --thrusters 1,2")
        ((_, (n, T)),) = columns.items()
        both = fit_thrust(n, T, name="+".join(names), order=order)
        found = [shared(name, both, len(names)) for name in names]
    else:
        found = [*fit_thrusters(columns, names, order=order)]
    for one in found:
        if one.rows < rows:
            note(f"note: thruster {one.name}: {rows - one.rows} of {rows} rows have no revolutions or no thrust")
        if one.n_low >= 0:
            note(f"note: thruster {one.name} was not tested astern; astern = 1 is an assumption")
    if out is not None:
        _write(out, "\n".join(_map_toml(one, table.name) for one in found), note)
    return found


def read_pull(path: Path) -> dict[str, tuple[Array, Array]]:
    """Revolutions [1/s] and thrust [N] by thruster, from columns such as ``n [rpm],T_1 [N],T_2 [N]``.

    A column `n` serves all thrusts, `n_1` that of `T_1`; an empty cell leaves its row out.

    Raises:
        DataError: a column of another name or unit, thrust without revolutions, or no thrust.
    """
    lines = lines_of(path)
    found: dict[tuple[str, str], int] = {}
    factors: list[float] = []
    heads = split_row(lines[0], ",")
    for k, head in enumerate(heads):
        match = _HEAD.match(head)
        wanted = _UNITS[match["kind"]] if match else ""
        if match is None or KNOWN.get(match["unit"], ("", 0.0))[0] != wanted:
            raise DataError(f"{path}: column '{head}': write revolutions as n [1/s] or n_1 [rpm], thrust as T_1 [N]")
        if (match["kind"], match["name"] or "") in found:
            raise DataError(f"{path}: column '{head}': named twice; keep one")
        found[match["kind"], match["name"] or ""] = k
        factors.append(KNOWN[match["unit"]][1])
    if len(lines) < 2:
        raise DataError(f"{path}: no rows below the heading; write revolutions and thrust of each level")
    values = numbers(path, lines, 1, heads, ",")[0] * factors
    out: dict[str, tuple[Array, Array]] = {}
    for name, k in ((name, k) for (kind, name), k in found.items() if kind == "T"):
        at = found.get(("n", name), found.get(("n", "")))
        if at is None:
            raise DataError(f"{path}: column '{heads[k]}': no revolutions; add n [1/s] or n_{name} [1/s]")
        pair = values[:, [at, k]]
        pair = pair[~np.isnan(pair).any(axis=1)]
        if not len(pair):
            raise DataError(f"{path}: column '{heads[k]}': no row has both revolutions and thrust")
        out[name or "1"] = pair[:, 0], pair[:, 1]
    if not out:
        raise DataError(f"{path}: no thrust; add a column such as T_1 [N]")
    return out


def servo(
    paths: Sequence[Path], controls: Sequence[str] = (), out: Path | None = None, note: Note = silent
) -> tuple[list[Trial], list[ServoFit]]:
    """Fit the servos of trials that hold both order and angle, and write the [actuators] of a ship file.

    Args:
        paths: trial files, or folders of them.
        controls: such as ``alpha_1``; all that have an order unless given.
        out: tables of a ship file to write (.toml).

    Returns:
        The trials, and a fit for each control.

    Raises:
        DataError: trials without both, or in degrees.
    """
    from ..data.trialfile import read_trials

    _writable(out, "actuators", *paths)
    trials = [*read_trials(paths)]
    wanted = tuple(controls) or servos(trials)
    if not wanted:
        raise DataError("no trial has order and angle of a servo; such as alpha_1_cmd [rad] and alpha_1 [rad]")
    found = [fit_servo(trials, control) for control in wanted]
    for line in (line for one in found for line in one.cautions):
        note(f"warning: {line}")
    if out is not None:
        _write(out, "\n".join(_servo_toml(one) for one in found), note)
    return trials, found


def _writable(out: Path | None, kind: str, *sources: Path) -> None:
    """Refuse an output that is no TOML file, has no folder, is an input, or is a file that this command did not write.

    Args:
        kind: the table that marks a file of this command: "thrusters", or "actuators" alone.
    """
    if out is None:
        return
    check_output(out, (".toml",), "a part of a ship file", *sources)
    if out.exists() and not _ours(out, kind):
        raise RequestError(f"{out}: exists, and this command did not write it; choose another file with -o")


def _ours(out: Path, kind: str) -> bool:
    """Whether a file is what the same command wrote before, and so may be replaced."""
    try:
        text = out.read_text(encoding="utf-8")
        tables = set(toml_of(text))
    except (OSError, UnicodeDecodeError, TomlError):
        return False
    return text.startswith(_HEADING) and kind in tables and ("thrusters" in tables) == (kind == "thrusters")


def _write(out: Path, text: str, note: Note) -> None:
    write_whole(out, f"{_HEADING}\n\n{text}")
    note(f"wrote {out}")


def _number(value: float, unit: str, source: str, sigma: float = math.nan) -> str:
    spread = f", sigma = {float(sigma)!r}" if math.isfinite(sigma) else ""
    quantity = f', unit = "{unit}"' if unit else ""
    return f'{{ value = {float(value)!r}{quantity}{spread}, source = "{source}" }}'


def _map_toml(one: ThrustMap, table: str) -> str:
    """[thrusters.NAME] without its position, which no bollard pull contains, and the limits of its revolutions."""
    source = f"bollard pull, {table}: {one.rows} rows, R^2 {one.R2:.5f}, rmse {one.rmse:.3g} N".replace('"', "'")
    back = source if one.n_low < 0 else "assumed: not tested astern"
    lines = [f"[thrusters.{one.name}]", 'type = "azimuth:Azimuth"', "# x and y, the position [m], are to be added"]
    lines += [
        f"c_{k} = {_number(one.coefficients[k], 'N' if k == 0 else 'N s' if k == 1 else f'N s^{k}', source, s)}"
        for k, s in enumerate(one.sigma) if k in one.powers
    ]  # fmt: skip
    lines += [
        f"n_max = {_number(one.n_max, '1/s', 'greatest revolutions tested')}",
        f"astern = {_number(one.astern, '', back)}", "",
        f"[actuators.n_{one.name}]", f"low = {_number(one.n_low, '1/s', 'least revolutions that the map holds for')}",
        f"high = {_number(one.n_max, '1/s', 'greatest revolutions tested')}", "",
    ]  # fmt: skip
    return "\n".join(lines)


def _servo_toml(one: ServoFit) -> str:
    source = f"log of order and angle: {one.samples} samples, R^2 {one.R2:.5f}, rmse {one.rmse:.3g} rad"
    kind = type(one.servo).__name__
    lines = [f"[actuators.{'rudder' if one.control == 'delta' else one.control}]"]
    lines += [f'type = "{kind}"'] if kind != "Actuator" else []
    units = {"rate": "rad/s", "lag": "s", "dead_time": "s"}
    lines += [
        f"{key} = {_number(vars(one.servo)[key], unit, source, one.sigma[key])}"
        for key, unit in units.items() if key in one.sigma
    ]  # fmt: skip
    return "\n".join([*lines, ""])
