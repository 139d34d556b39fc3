"""What is judged beside what, and by which scales: for `validate` and the report of a fit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .cli_support import note, read_ship
from .data import Trial
from .engine import SimulationError
from .ships import Ship
from .validate import Comparison


def compared(
    ship: Ship, trials: Iterable[Trial], restart: float | None, sigma: Mapping[str, float], base: Ship | None = None,
    *, smooth_start: float | None = None,
) -> tuple[tuple[Comparison, ...], int]:
    """Each trial beside the ship, the ship it was fitted from (`base`, or as its file says), and constant velocity.

    Returns:
        The comparisons and how many predictions blew up; those are left out and told.
    """
    from .replay import replay
    from .validate.comparison import CONSTANT_VELOCITY, compare, constant_velocity

    found: list[Comparison] = []
    failed = 0
    for trial in trials:
        rows = slice(0, 0)
        for label, model in _models(ship, base).items():
            try:
                predicted = replay(model, trial, restart=restart, smooth_start=smooth_start)
            except SimulationError as error:
                note(f"error: {label}: {error}")
                failed += 1
                continue
            first, last = trial.t.searchsorted([predicted.t[0], predicted.t[-1]])
            rows = slice(int(first), int(last) + 1)
            found.append(compare(trial, predicted, label=label, restart=restart, sigma=sigma, L_pp=ship.L_pp))
        part = trial.rows(rows)
        if len(part):
            steady = constant_velocity(part, restart)
            found.append(compare(part, steady, label=CONSTANT_VELOCITY, restart=restart, sigma=sigma, L_pp=ship.L_pp))
    return tuple(found), failed


def scales(trials: Sequence[Trial], given: Mapping[str, float] | None) -> Mapping[str, float]:
    """Scale of each state: as given; that of the common evaluator for its set; else the spread of the trials."""
    from .models import STATES
    from .validate.metrics import ESSO_OSAKA_SIGMA, spread

    if given and set(given) == set(STATES):
        return given
    if trials and all("FRT-DS-ESSO" in str(trial.meta.get("source", "")) for trial in trials):
        return ESSO_OSAKA_SIGMA
    return spread(trials)


def scale_of(sigma: Mapping[str, float], held: Mapping[str, float]) -> str:
    """Where scales come from, in words; `held` are those that the fit beside the model has kept."""
    from .validate.metrics import ESSO_OSAKA_SIGMA

    if sigma is ESSO_OSAKA_SIGMA:
        return "those of the common evaluator of this set"
    return "as where the model was fitted" if held else "the spread of these trials"


def provenance(ship: Ship) -> Mapping[str, Any]:
    """How a ship was fitted, as her file says; empty where she was not."""
    found = ship.notes.get("provenance", {})
    return found if isinstance(found, Mapping) else {}


def _models(ship: Ship, fitted_from: Ship | None) -> dict[str, Ship]:
    """Who predicts, by label: the model, and the one that it was fitted from."""
    if fitted_from is not None:
        if not getattr(getattr(fitted_from.model, "network", None), "trained", True):
            return {"fitted": ship}
        known = _of_the_library(fitted_from, fitted_from.name)
        return {"fitted": ship, "published" if known else "untuned": fitted_from}

    base = provenance(ship).get("ship")
    if base is None:
        return {"published" if _of_the_library(ship, ship.name) else ship.name: ship}
    return {"fitted": ship} | ({"published": read_ship(str(base))} if _of_the_library(ship, str(base)) else {})


def _of_the_library(ship: Ship, name: str) -> bool:
    """Whether the library's ship of this name is one of the same structure, not another model of hers."""
    from .parameters import values
    from .ships.files import library

    if name not in library():
        return False
    held = read_ship(name).model
    return type(held) is type(ship.model) and set(values(held)) == set(values(ship.model))
