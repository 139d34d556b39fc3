"""What a saved hybrid says of trials before anybody trusts it: how far its members drift apart on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .cli_support import note
from .data import DataError, Trial
from .identify import Fit
from .ships import Ship

if TYPE_CHECKING:
    from .identify.study import Study
    from .validate.spread import Spread


def keep_members(study: Study, fit: Fit, out: Path, sigma: Mapping[str, float]) -> None:
    """Write the members of a fitted hybrid beside its model.toml; other families have none."""
    from .models.hybrid import Hybrid
    from .validate.spread import NAME, members, save_members

    if not isinstance(fit.ship.model, Hybrid):
        return
    try:
        found = members(fit, study.problem, study.estimator, sigma, restart=study.restart)
    except DataError as error:
        note(f"warning: no members, so predictions will not tell how sure they are: {error}")
        return
    save_members(found, out / NAME)


def tell_spread(model: str, ship: Ship, trials: Sequence[Trial]) -> list[Spread]:
    """Say of each trial whether it leaves the training data, and return it; nothing where no members are saved.

    Raises:
        ShipError: members that are not those of this ship.
    """
    from .validate.spread import NAME, load_members, spreads

    beside = Path(model).with_name(NAME)
    if Path(model).suffix != ".toml" or not beside.is_file():
        return []
    told = spreads(load_members(beside, ship), ship, trials)
    for judged in told:
        note(f"{'warning' if judged.verdict == 'leaves' else 'note'}: {judged}")
    return told


def spread_numbers(told: Sequence[Spread]) -> dict[str, Any]:
    """The same for a JSON document: under "spread" by trial; nothing where nothing was told."""
    return {"spread": {judged.name: judged.numbers() for judged in told}} if told else {}
