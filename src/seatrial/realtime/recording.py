"""Recordings of a running ship: a trial file that is valid at any moment, and the orders to reproduce it (`rerun`).

Each row is written in one piece as it comes, except the first, which waits for the second, since a trial has at least
two rows; the sidecar is written before them.  So a process that is killed leaves a complete trial, or none.  Beside
``NAME.csv`` and ``NAME.yaml``, ``NAME.orders.jsonl`` has the initial state and every change of orders or surroundings
with the number of its step.
"""

from __future__ import annotations

import base64
import hashlib
import json
import math
import os
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from ..core.parameters import values
from ..data import UNITS, DataError, Trial
from ..data.geodesy import Datum
from ..data.sidecar import sidecar_path, sidecar_text
from ..data.trialfile import read_trial
from ..environment import CHANNELS, VECTORS, Environment, Weather
from ..models import STATES, unit
from ..ships import Ship, ShipError
from ..simulate.place import Place
from ..simulate.run import SIMULATED
from .plant import Plant

SCHEMA = "seatrial-orders/1"
"""What a recording of orders says of itself."""


def orders_path(path: Path) -> Path:
    """Where the orders of a recording are."""
    return path.with_name(f"{path.stem}.orders.jsonl")


def digest(ship: Ship) -> str:
    """Digest of the numbers of a ship; differs for a ship of the same name with other numbers."""
    servos = {control: repr(ship.actuators.of(control)) for control in ship.model.controls}
    network = {} if ship.model.learned is None else ship.model.learned.weights
    weights = {name: hashlib.sha256(array.tobytes()).hexdigest() for name, array in network.items()}
    said = json.dumps([type(ship.model).__name__, values(ship.model), servos, weights], sort_keys=True, default=repr)
    return hashlib.sha256(said.encode()).hexdigest()[:16]


def dated(epoch: float, datum: Datum | None) -> dict[str, Any]:
    """Sidecar entries of time 0 [s since 1970, UTC] and of x = y = 0, so that conversions keep date and position."""
    start = {"start": datetime.fromtimestamp(epoch, UTC).isoformat()}
    return start if datum is None else {**start, "datum": asdict(datum)}


class Recording:
    """A recording of a ship, row by row; a `Witness` of a loop, or called directly once before each step.

    The files are created with the second row.  If the ship is set to another state, or waves or a depth appear that
    have no column in the file, the recording continues in a new file: ``NAME_2.csv`` and so on.

    Attributes:
        paths: files written so far, the present one last.
        rows: rows of the present file; 0 if there is none.
        failure: why the recording ended by itself; empty while it continues.
    """

    def __init__(
        self, plant: Plant, path: str | Path, *, every: int = 1, kind: str = "recording",
        meta: Mapping[str, Any] = MappingProxyType({}),
    ) -> None:  # fmt: skip
        """Prepare to record.

        Args:
            plant: the ship to record.
            path: a new file with the suffix .csv.
            every: write every n-th row.
            kind: kind of the run, for the sidecar.
            meta: further entries of the sidecar, such as `dated`.

        Raises:
            DataError: no such folder, another suffix, or an existing file.
        """
        self._base = Path(path)
        if self._base.suffix != ".csv" or every < 1:
            raise DataError(f"{self._base}: a recording is a .csv file with every n-th row, n at least 1")
        if not self._base.parent.is_dir():
            raise DataError(f"{self._base}: no folder {self._base.parent}; make it first")
        self._plant, self._every, self._kind, self._more = plant, every, kind, dict(meta)
        self._refuse_present(self._base)
        self.paths: list[Path] = []
        self.rows, self.failure = 0, ""
        self._begun = False
        self._files: tuple[Appender, Appender] | None = None

    def see(self, plant: Plant) -> None:
        """Record state and changed orders; call before each step.  DataError if the file can no longer be written."""
        try:
            self._see(plant)
        except (DataError, OSError) as error:
            self.failure = str(error)
            raise

    def _see(self, plant: Plant) -> None:
        if not self._begun or plant.k < self._last or not set(usual_names(plant)) <= set(self._columns.names):
            self._begin()
            return
        orders = self._orders()
        if orders != self._ordered:
            self._ordered = orders
            self._change(json.dumps({"k": plant.k, **orders}))
        if plant.k == self._last:
            return
        self._last, self._seen = plant.k, self._seen + 1
        if self._seen % self._every == 0:
            self._write(text(self._columns.row()))

    def jumped(self, plant: Plant) -> None:
        """Continue in a new file, since the ship was set to another state."""
        self._shut()

    def close(self) -> None:
        """Write the present state, unless the ship blew up or writing failed before, and close the files.

        Raises:
            DataError: that row cannot be written; the files are closed nevertheless.
        """
        try:
            if self._begun and not self.failure and all(math.isfinite(self._plant[name]) for name in STATES):
                self._seen = -1  # so that this row is written, whatever its number
                self.see(self._plant)
        finally:
            self._shut()

    def _begin(self) -> None:
        """Take the initial state and the first row; the files are created with the second."""
        self._shut()
        plant, number = self._plant, len(self.paths) + 1
        self._path = self._base if number == 1 else self._base.with_name(f"{self._base.stem}_{number}.csv")
        self._refuse_present(self._path)
        self._held = [n for n in plant.controls if self._every == 1 and plant.ship.actuators.of(n).at_once]
        self._columns = Columns(plant, usual_names(plant), self._held)
        start = base64.b64encode(plant.snapshot()).decode()
        self._changes = [json.dumps({"schema": SCHEMA, "ship": plant.ship.name, "numbers": digest(plant.ship),
                                     "dt": plant.dt, "changing": plant.changing, "placed": plant.place is not None,
                                     "start": start})]  # fmt: skip
        self._first = f"{self._columns.head}\n{text(self._columns.row())}"
        self._begun, self._last, self._seen, self.rows = True, plant.k, 0, 0
        self._ordered = self._orders()

    def _open(self, row: str) -> None:
        """Write orders and sidecar first: a table without its sidecar is not a trial."""
        path, ship = self._path, self._plant.ship
        meta = {"ship": ship.name, "L_pp": ship.L_pp, "kind": self._kind, "source": SIMULATED, **self._more}
        said = sidecar_text(path, meta | ({"held": self._held} if self._held else {})).rstrip()
        texts = {orders_path(path): "\n".join(self._changes), sidecar_path(path): said, path: f"{self._first}\n{row}"}
        made: list[Appender] = []
        try:
            for file, content in texts.items():
                made.append(Appender(file))
                made[-1].add(content)
        except DataError:
            for one in made:
                one.withdraw()
            raise
        orders, sidecar, table = made
        sidecar.close()
        self._files, self.rows = (table, orders), 2
        self.paths.append(path)

    def _change(self, line: str) -> None:
        if self._files is None:
            self._changes.append(line)
        else:
            self._files[1].add(line)

    def _write(self, row: str) -> None:
        if self._files is None:
            self._open(row)
        else:
            self._files[0].add(row)
            self.rows += 1

    def _shut(self) -> None:
        for file in self._files or ():
            file.close()
        self._files, self._begun, self.rows = None, False, 0

    def _orders(self) -> dict[str, Any]:
        """Orders, and surroundings unless they change by themselves."""
        plant = self._plant
        around = None if plant.changing else [plant[name] for name in CHANNELS]
        return {"orders": {name: plant[f"{name}_cmd"] for name in plant.controls}, "around": around}

    @staticmethod
    def _refuse_present(path: Path) -> None:
        for file in (path, sidecar_path(path), orders_path(path)):
            if file.exists():
                raise DataError(f"{file}: exists already; a recording overwrites nothing")


class Appender:
    """A new text file to which whole lines are appended: after a kill at any moment it ends with a complete line."""

    def __init__(self, path: Path) -> None:
        """Create the file; DataError if it exists already or cannot be created."""
        self._path, self._size = path, 0
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        except FileExistsError:
            raise DataError(f"{path}: exists already; a recording overwrites nothing") from None
        except OSError as error:
            raise DataError(f"{path}: cannot be written: {error.strerror}") from error

    def add(self, line: str) -> None:
        """Append a line, or several that belong together; DataError if writing failed: the file is then unchanged."""
        data = line.encode() + b"\n"
        try:
            written, reason = os.write(self._file, data), "no room left"
        except OSError as error:
            written, reason = 0, error.strerror or "writing failed"
        if written == len(data):
            self._size += written
            return
        os.ftruncate(self._file, self._size)
        raise DataError(f"{self._path}: cannot be written: {reason}; the lines before are complete")

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)

    def withdraw(self) -> None:
        """Remove the file."""
        self.close()
        self._path.unlink(missing_ok=True)


def rerun(
    path: str | Path, ship: Ship, environment: Weather | None = None, place: Place | None = None
) -> Trial:
    """Reproduce a recorded run from its initial state and orders, bit for bit on the same kind of machine.

    Args:
        path: the .csv file of the recording; rows and columns of the result are those of the file.
        ship: the recorded ship, with the same numbers.
        environment: the weather of the run, if it changed by itself.
        place: where the ship sailed, if it was on a chart.

    Raises:
        DataError: no such recording, or orders that cannot be read.
        ShipError: another ship, or changing weather or a place that is not given.
    """
    here = Path(path)
    trial, (about, changes) = read_trial(here), _read(orders_path(here))
    if about["ship"] != ship.name or about["numbers"] != digest(ship):
        raise ShipError(f"{here}: recorded {about['ship']} with other numbers; give the ship as it was recorded")
    if about["changing"] and environment is None:
        raise ShipError(f"{here}: the weather changed by itself; give the weather of the run")
    if about.get("placed", False) != (place is not None):
        raise ShipError(f"{here}: recorded {'on a chart; give its place' if place is None else 'on open water'}")
    plant = Plant.of(ship, dt=float(about["dt"]), environment=environment, start=(0.0,) * 6, n_P=0.0, place=place)
    plant.restore(base64.b64decode(about["start"]))
    columns = Columns(plant, trial.channels, trial.meta.get("held", ()))
    rows: list[list[float]] = []
    for t in trial.t.tolist():
        while True:
            _obey(plant, changes)
            if plant.k >= round(t / plant.dt):
                break
            plant.step()
        rows.append(columns.row())
    channels = dict(zip(trial.channels, np.array(rows).T.copy(), strict=True))
    return replace(trial, channels=channels).noting("reproduced from its orders")


def _obey(plant: Plant, changes: deque[dict[str, Any]]) -> None:
    while changes and changes[0]["k"] <= plant.k:
        change = changes.popleft()
        for control, value in change["orders"].items():
            plant.order(control, value)
        if change["around"] is not None:
            plant.surround(Environment(*change["around"]))


def _read(path: Path) -> tuple[dict[str, Any], deque[dict[str, Any]]]:
    """The initial state and the changes after it; an incomplete last line is ignored."""
    try:
        lines = path.read_text(encoding="utf-8").split("\n")[:-1]
    except (OSError, UnicodeDecodeError):
        raise DataError(f"{path}: no orders to read; the file belongs beside its recording") from None
    try:
        about, *changes = (json.loads(line) for line in lines)
        wanted = {"ship", "numbers", "dt", "changing", "start"}
        whole = about["schema"] == SCHEMA and wanted <= about.keys()
        whole = whole and all({"k", "orders", "around"} <= change.keys() for change in changes)
    except (ValueError, KeyError, TypeError, AttributeError):
        whole, about, changes = False, {}, []
    if not whole:
        raise DataError(f"{path}: not the orders of a recording; the first line must name '{SCHEMA}'")
    return about, deque(changes)


_WAVES, _BOTTOM = ("H_S", "gamma_W", "T_W"), ("depth",)
Reader = Callable[[], float]


class Columns:
    """The channels of a trial read from a plant, time first.

    Attributes:
        names: of the channels.
    """

    def __init__(self, plant: Plant, names: Iterable[str], held: Iterable[str] = ()) -> None:
        """Read channels by name; of `held` controls, which obey at once, the order is what acts after a row."""
        readers = _readers(plant, frozenset(held))
        self.names = tuple(names)
        self._read = tuple(readers[name] for name in self.names)

    def row(self) -> list[float]:
        """The present values."""
        return [read() for read in self._read]

    @property
    def head(self) -> str:
        """The first line of a trial file."""
        return ",".join(f"{name} [{UNITS.get(name) or unit(name)}]" for name in self.names)


def usual_names(plant: Plant) -> tuple[str, ...]:
    """Channels to record: always wind and current; waves and depth where there are any."""
    waves = plant.changing or any(plant[name] != 0.0 for name in ("wave_x", "wave_y", "wave_T"))
    bottom = plant["per_depth"] != 0.0
    commands = (f"{name}_cmd" for name in plant.controls)
    air_and_water = (name for _, *pair in VECTORS[:2] for name in pair)
    return ("t", *STATES, *plant.controls, *commands, *air_and_water, *(_WAVES if waves else ()),
            *(_BOTTOM if bottom else ()))  # fmt: skip


def text(row: list[float]) -> str:
    """A row of a trial file; numbers are read back to the same bits, a gap is empty."""
    return ",".join("" if value != value else repr(value) for value in row)


def _readers(plant: Plant, held: frozenset[str]) -> dict[str, Reader]:
    """How to read each channel."""

    def of_components(of: str, polar: Callable[[float, float], float]) -> Reader:
        return lambda: polar(plant[f"{of}_x"], plant[f"{of}_y"])

    orders = {f"{name}_cmd": f"{name}_cmd" for name in plant.controls}
    values = {name: f"{name}_cmd" if name in held else name for name in (*STATES, *plant.controls)}
    plain = {**values, **orders, "T_W": "wave_T"}
    found: dict[str, Reader] = {name: partial(plant.__getitem__, of) for name, of in plain.items()}
    for of, size, direction in VECTORS:
        found |= {size: of_components(of, math.hypot), direction: of_components(of, lambda x, y: math.atan2(y, x))}
    return {**found, "t": lambda: plant.t,
            "depth": lambda: 1.0 / plant["per_depth"] if plant["per_depth"] else math.nan}  # fmt: skip
