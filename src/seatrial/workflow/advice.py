"""Warnings before a prediction is trusted: gaps, scale, wind, tested ranges, and the spread of a hybrid's members."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..data import DataError, Trial
from ..engine import SimulationError
from ..identify import Estimator, Fit, Problem
from ..ships import Ship, ShipError
from ..ships.felt import feels
from ..simulate.replay import gap_words, gaps, no_wind, predicted, wind_words
from . import Document, RequestError, Sink

if TYPE_CHECKING:
    from ..validate.spread import Spread

# A time step above so many median steps of the trial gets a warning.
_LEAP = 10


def trained(ship: Ship, name: str) -> Ship:
    """The ship, if its network is trained or it has none; `name` is how the user named it.

    Raises:
        RequestError: its network is untrained.
    """
    if ship.model.trained:
        return ship
    remedy = f'train it: seatrial identify STUDY.toml -o DIR, with ship = "{name}" in the study'
    raise RequestError(f"{name}: the network of {ship.name} is untrained (its file names no weights); {remedy}")


def cautions(ship: Ship, trials: Iterable[Trial]) -> list[str]:
    """Warnings and notes on predicting these trials with this ship, one line each."""
    return [line for trial in trials for line in _of_trial(ship, trial)]


def _of_trial(ship: Ship, trial: Trial) -> Iterator[str]:
    from ..identify.lint import untested

    yield from (f"warning: {trial.name}: {text}; extrapolated" for text in untested(ship, trial))
    leap = float(np.diff(trial.t).max()) if len(trial) > 2 else 0.0
    if leap > _LEAP * trial.dt:
        yield f"warning: {trial.name} leaps over {leap:.3g} s; the controls are not known in that time"
    length = trial.meta.get("L_pp")
    if isinstance(length, int | float) and abs(length / ship.L_pp - 1) > 0.02:
        yield f"warning: {trial.name} is of a ship of {length:g} m, {ship.name} has {ship.L_pp:g} m"
    windy = feels(ship, "wind_x")
    if no_wind(trial, ship.model) and windy:
        yield f"warning: {trial.name} has no wind (U_T, gamma_T); predicted in still air"
    if words := wind_words(trial, windy):
        yield f"note: {trial.name}: {words}"
    part = trial.rows(predicted(trial))
    if found := gaps(part, ship.model):
        first = ", or the first after it at the start" if any(rows[0] for rows in found.values()) else ""
        yield f"warning: {trial.name}: {gap_words(part, found)}; the last value before is held{first}"
    if len(part) < len(trial):
        yield f"note: {trial.name}: {len(trial) - len(part)} rows outside of the complete ones are left out"


def keep_members(
    fit: Fit, problem: Problem, estimator: Estimator, out: Path, sigma: Mapping[str, float], restart: float | None,
    sink: Sink,
) -> None:  # fmt: skip
    """Write the posterior members of a fitted hybrid to its folder; other families have none.

    Args:
        fit: of the hybrid, by `estimator` to `problem`.
        out: folder of the fit.
        sigma: scale of each state.
        restart: seconds between restarts of the predictions.
        sink: receives why there are none, where a hybrid has none.
    """
    from ..models.hybrid import Hybrid
    from ..validate.spread import NAME, members, save_members

    if not isinstance(fit.ship.model, Hybrid):
        return
    try:
        found = members(fit, problem, estimator, sigma, restart=restart)
    except DataError as error:
        sink.note(f"warning: no members, so predictions cannot report their spread: {error}")
        return
    save_members(found, out / NAME)


def spread_of(model: str, ship: Ship, trials: Sequence[Trial], sink: Sink) -> list[Spread]:
    """Whether each trial leaves the training data of a saved hybrid, noted too; empty where no members are saved.

    Advice only: where it cannot be had, a note says why, and the prediction stands.
    """
    from ..validate.spread import NAME, load_members, spreads

    beside = Path(model).with_name(NAME)
    if Path(model).suffix != ".toml" or not beside.is_file():
        return []
    try:
        found = load_members(beside, ship)
    except ShipError as error:
        sink.note(f"warning: not known whether these trials leave the training data: {error}")
        return []
    out: list[Spread] = []
    for trial in trials:
        try:
            out += spreads(found, ship, [trial])
        except (DataError, SimulationError) as error:
            sink.note(f"warning: {trial.name}: not known whether it leaves the training data: {error}")
            continue
        sink.note(f"{'warning' if out[-1].verdict == 'leaves' else 'note'}: {out[-1]}")
    return out


def spread_numbers(found: Sequence[Spread]) -> Document:
    """The spread for a JSON document, under "spread" by trial; empty where there is none."""
    return {"spread": {one.name: one.numbers() for one in found}} if found else {}
