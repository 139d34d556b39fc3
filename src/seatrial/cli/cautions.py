"""What a user should know of model and trials before trusting a prediction: one line each, before anything is run."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..data import Trial
from ..ships import Ship
from ..ships.felt import feels
from ..simulate.replay import gap_words, gaps, no_wind, predicted, wind_words
from .support import UsageError

# Median steps of a trial that are missing in one place: worth a word.
_LEAP = 10


def trained(ship: Ship, name: str) -> Ship:
    """The ship, if there is anything to predict with.

    Raises:
        UsageError: her network is untrained.
    """
    if getattr(getattr(ship.model, "network", None), "trained", True):
        return ship
    remedy = f'train it: seatrial identify STUDY.toml -o DIR, with ship = "{name}" in the study'
    raise UsageError(f"{name}: the network of {ship.name} is untrained (its file names no weights); {remedy}")


def cautions(ship: Ship, trials: Iterable[Trial]) -> list[str]:
    """What a user should know before trusting a prediction of these trials by this ship."""
    from ..identify.lint import untested

    lines: list[str] = []
    for trial in trials:
        lines += [f"warning: {trial.name}: {text}; extrapolated" for text in untested(ship, trial)]
        leap = float(np.diff(trial.t).max()) if len(trial) > 2 else 0.0
        if leap > _LEAP * trial.dt:
            lines.append(f"warning: {trial.name} leaps over {leap:.3g} s; what was steered meanwhile nobody knows")
        length = trial.meta.get("L_pp")
        if isinstance(length, int | float) and abs(length / ship.L_pp - 1) > 0.02:
            lines.append(f"warning: {trial.name} is of a ship of {length:g} m, {ship.name} has {ship.L_pp:g} m")
        if no_wind(trial, ship.model) and feels(ship, "wind_x"):
            lines.append(f"warning: {trial.name} has no wind (U_T, gamma_T); predicted in still air")
        part = trial.rows(predicted(trial))
        if told := wind_words(trial, feels(ship, "wind_x")):
            lines.append(f"note: {trial.name}: {told}")
        if found := gaps(part, ship.model):
            first = ", or the first after it at the start" if any(rows[0] for rows in found.values()) else ""
            lines.append(f"warning: {trial.name}: {gap_words(part, found)}; the last value before is held{first}")
        if len(part) < len(trial):
            cut = len(trial) - len(part)
            lines.append(f"note: {trial.name}: {cut} rows outside of the complete ones are left out")
    return lines
