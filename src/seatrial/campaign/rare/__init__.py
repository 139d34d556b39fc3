"""Probability that a run violates a criterion, where it is too rare to be counted: subset simulation of a campaign.

The inputs of a campaign are functions of points in the unit cube, and so of points in standard normal space; `subset`
has the method, `levels` the folder.  A level is a function of the campaign, the criterion and the level above, so a
killed search goes on with the level that it was in, and ends with the same numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from ...core.files import held_alone
from ...core.parameters import unknown
from ...core.values import dataclass
from ...data import Array, Trial
from ...manoeuvres import Manoeuvre
from .. import Campaign, CampaignError
from .. import chunk as chunks
from ..chunk import Runs
from .levels import Sought, begin, cube_of, level_path, read_level, read_search, write_level
from .subset import MOST, SHARE, Estimate, Level, estimate, first_level, next_level

__all__ = ["RUNS", "Rare", "Sought", "rare", "replay"]

RUNS = 1600
"""Usual number of runs of a level: 1e4 runs in all for a probability of 1e-6, known to 30 %."""


@dataclass(frozen=True)
class Rare:
    """What a search found for one case.

    Attributes:
        case: name.
        levels: from all points to those in the event.
        estimate: of the probability.
        reached: whether the last level holds the event; if not, the probability is below that of the last level.
        runs: number of runs of all levels.
        unknown: share of the runs of the last level that did not reach the index; they count as no violation.
        nearest: inputs and index of the violation nearest to the middle of all inputs, which is among the most likely
            ones; empty without a violation.
        distance: of it from the middle, in standard normal space.
        run: its number, by which it is replayed: the case times the runs of a level, plus its row in the last level;
            None without a violation.
    """

    case: str
    levels: tuple[Level, ...]
    estimate: Estimate
    reached: bool
    runs: int
    unknown: float
    nearest: Mapping[str, float]
    distance: float
    run: int | None = None


Watch = Callable[[str, int, float], object]
"""Told after each level: case, number of the level, probability so far."""


def rare(
    campaign: Campaign, criterion: str, folder: Path, *, runs: int = RUNS, threads: int = 1, watch: Watch | None = None,
    source: Path | None = None,
) -> tuple[Rare, ...]:  # fmt: skip
    """Estimate the probability of violating a criterion, case by case.

    Args:
        runs: of each level, a multiple of 10.
        folder: new, or that of a search that was cut off; each level is a Parquet file.
        source: file of the campaign; its text is kept.

    Raises:
        CampaignError: no such criterion, gusts, a folder of something else, or a level that cannot be reached.
        OSError: a level cannot be written.
    """
    _check(campaign, criterion, runs)
    sought = Sought(campaign, criterion, runs, threads)
    begin(sought, folder, source)
    with held_alone(folder / ".search"):
        return tuple(_case(sought, number, folder, watch) for number in range(len(campaign.cases)))


def _check(campaign: Campaign, criterion: str, runs: int) -> None:
    if criterion not in campaign.criteria:
        given = unknown(criterion, campaign.criteria, "criterion") if campaign.criteria else "there are no [criteria]"
        raise CampaignError(f"{campaign.name}: --rare {criterion}: {given}")
    if runs < 10 * SHARE or runs % SHARE:
        raise CampaignError(f"--runs is {runs}; give a multiple of {SHARE} from {10 * SHARE} on, such as {RUNS}")
    if campaign.gusts is not None:
        raise CampaignError(
            f"{campaign.name}: gusts differ from run to run at the same inputs, which a search for rare events cannot "
            "follow; leave weather.gusts out, or count the violations of many runs"
        )
    if not campaign.dims:
        raise CampaignError(f"{campaign.name}: no input varies; every run is the same")


def _case(sought: Sought, case: int, folder: Path, watch: Watch | None) -> Rare:
    levels: list[Level] = []
    name, rows = sought.campaign.cases[case].name, dict[str, Array]()
    while not levels or not (levels[-1].last or len(levels) == MOST):
        path = level_path(folder, case, len(levels))
        if not path.exists():
            write_level(sought, case, _next(sought, case, levels), path)
        found, rows = read_level(sought, path)
        levels.append(found)
        if watch is not None:
            watch(name, len(levels), float(np.prod([level.share for level in levels])))
    return _found(sought, case, tuple(levels), rows)


def _next(sought: Sought, case: int, levels: list[Level]) -> Level:
    campaign, limit = sought.campaign, sought.limit(case)
    if not levels:
        return first_level(limit, campaign.seed, sought.runs, campaign.dims)
    if levels[-1].stalled:
        raise CampaignError(
            f"{campaign.cases[case].name}: level {len(levels)}: {sought.index} is the same or unknown in more than "
            f"{1 - 1 / SHARE:.0%} of the runs, so none is nearer to {sought.criterion}; count the violations of many "
            "runs instead, or take a longer duration"
        )
    return next_level(limit, campaign.seed, len(levels), levels[-1])


def replay(campaign: Campaign, folder: Path, run: int) -> tuple[Runs, Manoeuvre, Trial]:
    """A run of the last level of a search as a trial, with its inputs and the manoeuvre as it was ordered.

    Args:
        run: its number: the case times the runs of a level, plus its row.

    Raises:
        CampaignError: a folder of another search, or no such run.
    """
    about = read_search(folder)
    sought = Sought(campaign, about.criterion, about.runs)
    if about.digest != sought.digest:
        raise CampaignError(f"{folder}: its ships or the version have changed since the search; nothing is replayed")
    case, row = divmod(run, sought.runs)
    paths = [path for k in range(MOST) if (path := level_path(folder, case, k)).exists()]
    if run < 0 or not paths:
        raise CampaignError(f"{folder}: no run {run}; runs of the last level of case k go from k x {sought.runs} on")
    level, _ = read_level(sought, paths[-1])
    return chunks.replay(campaign, case * campaign.runs, cube_of(level.points[row : row + 1]))


def _found(sought: Sought, number: int, levels: tuple[Level, ...], rows: Mapping[str, Array]) -> Rare:
    last = levels[-1]
    event = np.flatnonzero(last.margins < 0)
    away = np.linalg.norm(last.points[event], axis=1)
    at = int(event[np.argmin(away)]) if len(event) else None
    nearest = {} if at is None else {name: float(column[at]) for name, column in rows.items()}
    runs = sought.runs + (len(levels) - 1) * (sought.runs - sought.runs // SHARE)
    return Rare(sought.campaign.cases[number].name, levels, estimate(levels), last.last, runs,
                float(np.isinf(last.margins).mean()), nearest, float(away.min()) if len(event) else float("nan"),
                None if at is None else number * sought.runs + at)  # fmt: skip
