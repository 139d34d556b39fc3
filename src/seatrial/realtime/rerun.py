"""A recorded run made again from its start and its orders, bit for bit on the same kind of machine."""

from __future__ import annotations

import base64
import json
from collections import deque
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..data import DataError, Trial
from ..data.trialfile import read_trial
from ..environment import Environment, Weather
from ..ships import Ship, ShipError
from .columns import Columns
from .plant import Plant
from .recording import SCHEMA, digest, orders_path


def rerun(path: str | Path, ship: Ship, environment: Weather | None = None) -> Trial:
    """The run of a recording made again; its rows and columns are those of the file.

    Args:
        path: the .csv file of the recording.
        ship: the ship that was recorded, with the same numbers.
        environment: the weather she sailed in, where that changed by itself.

    Raises:
        DataError: no such recording, or orders that cannot be read.
        ShipError: another ship, or weather that changed and is not given.
    """
    here = Path(path)
    trial, (about, changes) = read_trial(here), _read(orders_path(here))
    if about["ship"] != ship.name or about["numbers"] != digest(ship):
        raise ShipError(f"{here}: recorded {about['ship']} with other numbers; give the ship as she was")
    if about["changing"] and environment is None:
        raise ShipError(f"{here}: the weather changed by itself; give the one it was")
    plant = Plant.of(ship, dt=float(about["dt"]), environment=environment, start=(0.0,) * 6, n_P=0.0)
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
    return replace(trial, channels=channels).noting("made again from its orders")


def _obey(plant: Plant, changes: deque[dict[str, Any]]) -> None:
    while changes and changes[0]["k"] <= plant.k:
        change = changes.popleft()
        for control, value in change["orders"].items():
            plant.order(control, value)
        if change["around"] is not None:
            plant.surround(Environment(*change["around"]))


def _read(path: Path) -> tuple[dict[str, Any], deque[dict[str, Any]]]:
    """The start, and the changes after it; a last line that is not whole was never finished and does not count."""
    try:
        lines = path.read_text(encoding="utf-8").split("\n")[:-1]
    except (OSError, UnicodeDecodeError):
        raise DataError(f"{path}: no orders to read; they lie beside the recording they belong to") from None
    try:
        about, *changes = (json.loads(line) for line in lines)
        wanted = {"ship", "numbers", "dt", "changing", "start"}
        whole = about["schema"] == SCHEMA and wanted <= about.keys()
        whole = whole and all({"k", "orders", "around"} <= change.keys() for change in changes)
    except (ValueError, KeyError, TypeError, AttributeError):
        whole, about, changes = False, {}, []
    if not whole:
        raise DataError(f"{path}: not the orders of a recording; its first line says '{SCHEMA}'")
    return about, deque(changes)
