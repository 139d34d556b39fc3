"""A series judged: every model on every trial kept apart, over its seeds (Wakita 2022 Eq. 25, Table 9)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..data import Array, Trial
from ..engine import SimulationError
from ..identify.series import Claim, Row, Series
from ..identify.series_run import Member, members
from ..models import STATES
from ..replay import replay
from . import Comparison
from .comparison import compare, constant_velocity, pooled
from .metrics import ESSO_OSAKA_SIGMA, spread

TOGETHER = "together"
"""Label of the column in which all samples of all test trials count alike."""

BASELINE = "constant velocity"

# Standard errors of a mean over seeds within which two models are not told apart.
_APART = 2.0


@dataclass(frozen=True)
class Standing:
    """One model and how it did.

    Attributes:
        key, title, published: as in the file of the series.
        members: one for each seed that is done.
        errors: by test, the standardised error of each member; infinite where a prediction is no number.
            The last is `TOGETHER`.
        drawn: comparisons by test of the member that the validation trials prefer.
        every: comparisons by test of each member; None where a prediction is no number.
    """

    key: str
    title: str
    published: str
    members: tuple[Member, ...]
    errors: Mapping[str, Array]
    drawn: Mapping[str, Comparison]
    every: tuple[Mapping[str, Comparison | None], ...] = ()

    def mean(self, test: str) -> float:
        """Mean over the seeds."""
        return float(np.mean(self.errors[test])) if self.errors[test].size else math.nan

    def deviation(self, test: str) -> float:
        """Standard deviation over the seeds (n - 1); NaN of a single one."""
        found = self.errors[test]
        return float(np.std(found, ddof=1)) if found.size > 1 and np.isfinite(found).all() else math.nan

    @property
    def weights(self) -> int:
        """Numbers of a network that were trained; 0 for other models."""
        network = getattr(self.members[0].ship.model, "network", None) if self.members else None
        return 0 if network is None else int(network.count)


@dataclass(frozen=True)
class Found:
    """What came of a claim in one row of the table.

    Attributes:
        better, worse: mean errors.
        ratio: of the two.
        verdict: "holds", "does not hold", "within the spread of the seeds", or "not run".
    """

    test: str
    better: float
    worse: float
    ratio: float
    verdict: str


@dataclass(frozen=True)
class Table:
    """All of it.

    Attributes:
        tests: labels of the columns, `TOGETHER` the last.
        standings: one for each model, in the order of the file.
        claims: each with what came of it.
        sigma: scale of each state.
    """

    tests: tuple[str, ...]
    standings: tuple[Standing, ...]
    claims: tuple[tuple[Claim, tuple[Found, ...]], ...]
    sigma: Mapping[str, float]

    def standing(self, key: str) -> Standing | None:
        """The model of that name; None where it was left out."""
        return next((one for one in self.standings if one.key == key), None)


def judged(series: Series, out: Path) -> Table:
    """Predict every test trial with every model that is done in `out`, and look at the claims."""
    scale = sigma(series)
    standings = tuple(_standing(series, row, members(series, row, out), scale) for row in series.rows)
    found = Table((*series.tests, TOGETHER), (*standings, _baseline(series, scale)), (), scale)
    return Table(found.tests, found.standings, tuple((c, tuple(outcomes(found, c))) for c in series.claims), scale)


def sigma(series: Series) -> Mapping[str, float]:
    """Scale of each state: as the file says, that of the common evaluator, or the spread of the test trials."""
    if set(series.sigma) == set(STATES):
        return series.sigma
    tests = tuple(series.tests.values())
    known = all("FRT-DS-ESSO" in str(trial.meta.get("source", "")) for trial in tests)
    return ESSO_OSAKA_SIGMA if known else spread(tests)


def _standing(series: Series, row: Row, found: tuple[Member, ...], scale: Mapping[str, float]) -> Standing:
    every = [_predicted(series, member, row.key, scale) for member in found]
    errors = {test: np.array([math.inf if one[test] is None else _error(one[test]) for one in every])
              for test in series.tests}  # fmt: skip
    errors[TOGETHER] = np.array([_together(tuple(one.values())) for one in every])
    # One that nothing was watched for, or that has no rival, is the first.
    best = min(range(len(found)), key=lambda k: (math.isnan(found[k].objective), found[k].objective), default=0)
    drawn = {test: one for test, one in every[best].items() if one is not None} if every else {}
    return Standing(row.key, row.title, row.published, found, errors, drawn, tuple(every))


def _predicted(
    series: Series, member: Member, label: str, scale: Mapping[str, float]
) -> dict[str, Comparison | None]:  # fmt: skip
    out: dict[str, Comparison | None] = {}
    for test, trial in series.tests.items():
        try:
            guess = replay(member.ship, trial, restart=series.restart, method="euler")
        except SimulationError:
            out[test] = None
            continue
        out[test] = compare(trial, guess, label=label, restart=series.restart, sigma=scale)
    return out


def _baseline(series: Series, scale: Mapping[str, float]) -> Standing:
    drawn = {test: compare(trial, constant_velocity(trial, series.restart), label=BASELINE, restart=series.restart,
                           sigma=scale) for test, trial in series.tests.items()}  # fmt: skip
    errors = {test: np.array([one.standardised]) for test, one in drawn.items()}
    errors[TOGETHER] = np.array([_together(tuple(drawn.values()))])
    return Standing(BASELINE, BASELINE, "", (), errors, drawn)


def _error(comparison: Comparison | None) -> float:
    return math.inf if comparison is None or not math.isfinite(comparison.standardised) else comparison.standardised


def _together(found: Sequence[Comparison | None]) -> float:
    whole = [one for one in found if one is not None]
    return pooled(whole) if len(whole) == len(found) else math.inf


def outcomes(table: Table, claim: Claim) -> list[Found]:
    """A claim in each of its rows; a factor of one asks for no more than no worse."""
    out: list[Found] = []
    better, worse = table.standing(claim.better), table.standing(claim.worse)
    for test in claim.rows:
        low, high = (math.nan if one is None else one.mean(test) for one in (better, worse))
        # One that cannot be predicted at all is infinitely worse than one that can.
        ratio = 0.0 if math.isinf(low) else high / low if low > 0 else math.nan
        if better is None or worse is None or math.isnan(ratio):
            out.append(Found(test, low, high, ratio, "not run"))
        elif ratio >= claim.factor:
            out.append(Found(test, low, high, ratio, "holds"))
        else:
            error = math.hypot(_uncertain(better, test) * claim.factor, _uncertain(worse, test))
            close = claim.factor * low - high <= _APART * error
            out.append(Found(test, low, high, ratio, "within the spread of the seeds" if close else "does not hold"))
    return out


def _uncertain(standing: Standing, test: str) -> float:
    """Standard error of the mean over the seeds; 0 where there is one."""
    spread_ = standing.deviation(test)
    return spread_ / math.sqrt(standing.errors[test].size) if math.isfinite(spread_) else 0.0


def compositions(series: Series) -> dict[str, tuple[Trial, ...]]:
    """The training trials of each composition that some model was trained on, by what the file calls it."""
    found: dict[str, tuple[Trial, ...]] = {}
    for row in series.rows:
        if row.cells:
            name = ", ".join(one.removeprefix("@") for one in row.train)
            found.setdefault(name, row.cells[0].problem.trials)
    return found
