"""The plant as serialised CasADi functions, for MPC in CasADi, acados or anything that loads them."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..ships import ShipError
from .traced import Equations, Number, Variable
from .writing import write


def save_casadi(plant: Equations, path: str | Path) -> tuple[Path, ...]:
    """Write the right-hand side to `path`, its step and the names of all elements beside it.

    ``tug.casadi`` gets ``tug_step.casadi`` (with actuators also ``tug_ordered_step.casadi``) and
    ``tug.casadi.json``.  `casadi.Function.load` reads the functions; the numbers of the ship are in them.

    Raises:
        ShipError: a folder that is not there, or a file that cannot be written.
    """
    target = Path(path)
    if target.is_dir():
        raise ShipError(f"{target}: is a folder; name a file")

    def beside(what: str) -> Path:
        return target.with_name(f"{target.stem}_{what}{target.suffix}")

    files: dict[Path, str | Callable[[str], None]] = {target: plant.rates.save, beside("step"): plant.step.save}
    if plant.ordered_step is not None:
        files[beside("ordered_step")] = plant.ordered_step.save
    files[target.with_name(f"{target.name}.json")] = json.dumps(description(plant), indent=1, ensure_ascii=False) + "\n"
    return write(files)


def description(plant: Equations) -> dict[str, Any]:
    """Names, units, meanings and limits of every element, and the numbers with their sources."""
    found: dict[str, Any] = {
        "name": plant.name, "title": plant.title, "x": _elements(plant.states), "u": _elements(plant.controls),
        "e": _elements(plant.environment), "numbers": _elements(plant.numbers),
    }  # fmt: skip
    if plant.servos is not None:
        found |= {"dt": plant.servos.dt, "a": _elements(plant.servos.memory), "actual": list(plant.servos.start)}
    return found


def _elements(variables: Sequence[Variable | Number]) -> list[dict[str, Any]]:
    return [
        {k: v for k, v in asdict(one).items() if not (isinstance(v, float) and math.isinf(v))} for one in variables
    ]
