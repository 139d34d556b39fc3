"""Comparisons of a model and its baselines with trials, and the scales of their errors."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ..core.parameters import values
from ..data import Trial
from ..engine import SimulationError
from ..ships import Ship
from ..ships.files import library, load
from ..validate import Comparison
from . import RequestError, Sink


def compared(
    ship: Ship, trials: Iterable[Trial], restart: float | None, sigma: Mapping[str, float], base: Ship | None = None,
    *, smooth_start: float | None = None,
) -> tuple[tuple[Comparison, ...], tuple[str, ...]]:
    """Each trial beside the ship, the ship it was fitted from (`base`, or as its file says), and constant velocity.

    Returns:
        The comparisons, and a line for each prediction that blew up, which is left out.
    """
    from ..simulate.replay import replay
    from ..validate.comparison import CONSTANT_VELOCITY, compare, constant_velocity

    found: list[Comparison] = []
    failed: list[str] = []
    for trial in trials:
        rows = slice(0, 0)
        for label, model in _models(ship, base).items():
            try:
                predicted = replay(model, trial, restart=restart, smooth_start=smooth_start)
            except SimulationError as error:
                failed.append(f"{label}: {error}")
                continue
            first, last = trial.t.searchsorted([predicted.t[0], predicted.t[-1]])
            rows = slice(int(first), int(last) + 1)
            found.append(compare(trial, predicted, label=label, restart=restart, sigma=sigma, L_pp=ship.L_pp))
        part = trial.rows(rows)
        if len(part):
            steady = constant_velocity(part, restart)
            found.append(compare(part, steady, label=CONSTANT_VELOCITY, restart=restart, sigma=sigma, L_pp=ship.L_pp))
    return tuple(found), tuple(failed)


def scales(trials: Sequence[Trial], given: Mapping[str, float] | None) -> Mapping[str, float]:
    """Scale of each state: as given; that of the common evaluator for its set; else the spread of the trials."""
    from ..models import STATES
    from ..validate.metrics import ESSO_OSAKA_SIGMA, spread

    if given and set(given) == set(STATES):
        return given
    if trials and all("FRT-DS-ESSO" in str(trial.meta.get("source", "")) for trial in trials):
        return ESSO_OSAKA_SIGMA
    return spread(trials)


def scales_asked(trials: Sequence[Trial], fit: str | None) -> tuple[Mapping[str, float], str]:
    """Scale of each state, and its origin in words: the fit that is named, or the trials alone.

    Raises:
        RequestError: no fit is saved beside the model that is named.
    """
    from ..study.store import fitted_scale
    from ..validate.metrics import ESSO_OSAKA_SIGMA

    held = {} if fit is None else fitted_scale(fit)
    if fit is not None and not held:
        raise RequestError(f"--scale: {fit}: no fit beside it has kept its scales; name the model.toml of a fit")
    sigma = scales(trials, held)
    if held:
        return sigma, f"as where {fit} was fitted"
    return sigma, "those of the common evaluator of this set" if sigma is ESSO_OSAKA_SIGMA \
        else "the spread of these trials"


def in_found_currents(trials: Iterable[Trial], model: str, sink: Sink) -> list[Trial]:
    """The trials, those that the model was fitted to with the current that the fit estimated, which is noted."""
    from ..identify.nuisance import with_current
    from ..study.store import fitted_nuisances

    found = fitted_nuisances(model)
    out: list[Trial] = []
    for trial in trials:
        out.append(with_current(trial, found))
        if out[-1] is not trial:
            own = found[trial.name]
            north, east = own["current_x"], own["current_y"]
            towards = math.degrees(math.atan2(east, north)) % 360.0
            sink.note(f"note: {trial.name}: a current of {math.hypot(north, east):.3g} m/s towards {towards:.3g} deg "
                      "acts, as the fit estimated it")  # fmt: skip
    return out


def provenance(ship: Ship) -> Mapping[str, Any]:
    """How a ship was fitted, as its file says; empty where it was not."""
    found = ship.notes.get("provenance", {})
    return found if isinstance(found, Mapping) else {}


def _models(ship: Ship, fitted_from: Ship | None) -> dict[str, Ship]:
    """The ships that predict, by label: the model, and the one that it was fitted from."""
    made = provenance(ship)
    base = made.get("ship")
    if fitted_from is None and base is None:
        return {"published" if _of_the_library(ship, ship.name) else ship.name: ship}
    before = fitted_from or _began(ship, made)
    if before is None:  # fitted by a version that kept no start
        return {"fitted": ship} | ({"published": load(str(base))} if _of_the_library(ship, str(base)) else {})
    published = _of_the_library(before, before.name) and values(load(before.name).model) == values(before.model)
    return {"fitted": ship} | ({"published" if published else "untuned": before} if before.model.trained else {})


def _began(ship: Ship, made: Mapping[str, Any]) -> Ship | None:
    """The ship that a fit started from, rebuilt from its provenance; None where the file does not say."""
    began = made.get("began")
    if not isinstance(began, Mapping) or not began or ship.model.learned is not None:
        return None
    return replace(ship.having({str(path): float(value) for path, value in began.items()}), name=str(made["ship"]))


def _of_the_library(ship: Ship, name: str) -> bool:
    """Whether the library's ship of this name is one of the same structure, not another model of that ship."""
    if name not in library():
        return False
    held = load(name).model
    return type(held) is type(ship.model) and set(values(held)) == set(values(ship.model))
