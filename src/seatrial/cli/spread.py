"""What a saved hybrid says of trials before anybody trusts it: how far its members drift apart on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..data import DataError, Trial
from ..engine import SimulationError
from ..identify import Estimator, Fit, Problem
from ..ships import Ship, ShipError
from .support import note

if TYPE_CHECKING:
    from ..validate.spread import Spread


def keep_members(
    problem: Problem, estimator: Estimator, fit: Fit, out: Path, sigma: Mapping[str, float], restart: float | None
) -> None:
    """Write the members of a fitted hybrid beside its model.toml; other families have none.

    Args:
        out: folder of the fit.
        sigma: scale of each state.
        restart: seconds between restarts of the predictions.
    """
    from ..models.hybrid import Hybrid
    from ..validate.spread import NAME, members, save_members

    if not isinstance(fit.ship.model, Hybrid):
        return
    try:
        found = members(fit, problem, estimator, sigma, restart=restart)
    except DataError as error:
        note(f"warning: no members, so predictions will not tell how sure they are: {error}")
        return
    save_members(found, out / NAME)


def tell_spread(model: str, ship: Ship, trials: Sequence[Trial]) -> list[Spread]:
    """Say of each trial whether it leaves the training data, and return it; nothing where no members are saved.

    Advice only: where it cannot be had, a line says why, and what was predicted stands.
    """
    from ..validate.spread import NAME, load_members, spreads

    beside = Path(model).with_name(NAME)
    if Path(model).suffix != ".toml" or not beside.is_file():
        return []
    try:
        found = load_members(beside, ship)
    except ShipError as error:
        note(f"warning: not known whether these trials leave the training data: {error}")
        return []
    told: list[Spread] = []
    for trial in trials:
        try:
            told += spreads(found, ship, [trial])
        except (DataError, SimulationError) as error:
            note(f"warning: {trial.name}: not known whether it leaves the training data: {error}")
            continue
        note(f"{'warning' if told[-1].verdict == 'leaves' else 'note'}: {told[-1]}")
    return told


def spread_numbers(told: Sequence[Spread]) -> dict[str, Any]:
    """The same for a JSON document: under "spread" by trial; nothing where nothing was told."""
    return {"spread": {judged.name: judged.numbers() for judged in told}} if told else {}
