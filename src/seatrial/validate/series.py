"""Results of a series: errors of every model on every test trial, over its seeds (Wakita 2022 Eq. 25, Table 9)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from ..belief.spread import NAME, Spread, load_members, spreads
from ..core.values import dataclass, field, replace
from ..data import Array, Trial
from ..engine import SimulationError
from ..identify.networks.widths import Widths
from ..ships import Ship
from ..ships.classes import foreign
from ..ships.files import load
from ..simulate.replay import replay
from ..study.series import Claim, Row, Series
from ..study.store import HISTORY, MODEL, SUMMARY, Summary, read_summary
from ..study.stored import read_history
from . import Comparison
from .comparison import compare, constant_velocity, pooled
from .metrics import scales

TOGETHER = "together"
"""Label of the column in which all samples of all test trials count alike."""

BASELINE = "constant velocity"
"""The forecast that others are held against."""

# Standard errors of a mean over seeds within which two models are indistinguishable.
_APART = 2.0

@dataclass(frozen=True)
class Member:
    """A fitted ship, or one that is judged without a fit.

    Attributes:
        seed: None where nothing was drawn.
        history: rows (iteration, objective, validation or NaN, seconds), shape (iterations, 4).
        objective: the least loss on the validation trials, where the estimator watches them.
        summary: what `fit.json` holds; None for a ship as it is.
    """

    seed: int | None
    ship: Ship
    history: Array
    objective: float
    summary: Summary | None

    @property
    def seconds(self) -> float:
        """Time of the fit [s]."""
        return self.summary.seconds if self.summary else 0.0


def members(row: Row, out: Path) -> tuple[Member, ...]:
    """The fits of a row that are done, in the order of its seeds.

    Raises:
        StudyError: a folder holds the fit of another problem, or one that cannot be read.
    """
    if not row.cells:
        return (Member(None, row.ship, np.zeros((0, 4)), math.nan, None),)
    found: list[Member] = []
    for cell in row.cells:
        where = out / cell.folder
        if cell.done(out):
            said = read_summary(where)
            ship = load(where / MODEL, trust=foreign(row.ship.model))
            found.append(Member(cell.seed, ship, read_history(where / HISTORY), said.objective, said))
    return tuple(found)


Validity = Mapping[str, Mapping[str, Spread]]
"""How far the members drift apart, by key of the model and label of the test."""


def validity(series: Series, out: Path) -> dict[str, dict[str, Spread]]:
    """The spread of every fit in `out` that has members beside it, on each test trial; the first seed of a row.

    Raises:
        ShipError: members that cannot be read, or of another fit.
        DataError: a test trial lacks what the ship needs.
    """
    found: dict[str, dict[str, Spread]] = {}
    for row in series.rows:
        for cell in row.cells[:1]:
            where = out / cell.folder
            if not ((where / NAME).is_file() and (where / SUMMARY).is_file()):
                continue
            ship = load(where / MODEL, trust=foreign(row.ship.model))
            drifts = spreads(load_members(where / NAME, ship), ship, tuple(series.tests.values()))
            found[row.key] = dict(zip(series.tests, drifts, strict=True))
    return found


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
        width: of the prior of its correction, as left-out trials chose it; 0: none, NaN: nothing was to be chosen.
    """

    key: str
    title: str
    published: str
    members: tuple[Member, ...]
    errors: Mapping[str, Array]
    drawn: Mapping[str, Comparison]
    every: tuple[Mapping[str, Comparison | None], ...] = ()
    width: float = math.nan

    @property
    def name(self) -> str:
        """Its title, and how much residual it has where that was to be chosen."""
        if math.isnan(self.width):
            return self.title
        return f"{self.title}: " + (f"residual width {self.width:g}" if self.width > 0 else "no residual")

    def mean(self, test: str) -> float:
        """Mean over the seeds."""
        return float(np.mean(self.errors[test])) if self.errors[test].size else math.nan

    def deviation(self, test: str) -> float:
        """Standard deviation over the seeds (n - 1); NaN of a single one."""
        found = self.errors[test]
        return float(np.std(found, ddof=1)) if found.size > 1 and np.isfinite(found).all() else math.nan

    def uncertain(self, test: str) -> float:
        """Standard error of the mean over the seeds; 0 where there is one."""
        deviation = self.deviation(test)
        return deviation / math.sqrt(self.errors[test].size) if math.isfinite(deviation) else 0.0

    @property
    def weights(self) -> int:
        """Numbers of a network that were trained; 0 for other models."""
        network = self.members[0].ship.model.learned if self.members else None
        return 0 if network is None else int(network.count)


@dataclass(frozen=True)
class Found:
    """What came of a claim in one row of the table.

    Attributes:
        better, worse: mean errors.
        ratio: of the two.
        verdict: "holds", "holds without residual" (credit to the physics alone: left-out trials chose no residual for
            the better), "does not hold", "within the spread of the seeds", or "not run".
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
        validity: how far the members of each fitted hybrid drift apart on each test trial.
    """

    tests: tuple[str, ...]
    standings: tuple[Standing, ...]
    claims: tuple[tuple[Claim, tuple[Found, ...]], ...]
    sigma: Mapping[str, float]
    validity: Validity = field(default_factory=dict[str, Mapping[str, Spread]])

    def standing(self, key: str) -> Standing | None:
        """The model of that name; None where it was left out."""
        return next((one for one in self.standings if one.key == key), None)


def judged(series: Series, out: Path) -> Table:
    """Predict every test trial with every model that is done in `out`, and look at the claims."""
    scale = scales(series.apart, series.sigma)
    standings = tuple(_standing(series, row, members(row, out), scale) for row in series.rows)
    found = Table((*series.tests, TOGETHER), (*standings, _baseline(series, scale)), (), scale)
    claims = tuple((c, tuple(outcomes(found, c))) for c in series.claims)
    return replace(found, claims=claims, validity=validity(series, out))


def _standing(series: Series, row: Row, found: tuple[Member, ...], scale: Mapping[str, float]) -> Standing:
    every = tuple(_predicted(series, member, row.title, scale) for member in found)
    # Without validation trials, or with one seed, it is the first.
    best = min(range(len(found)), key=lambda k: (math.isnan(found[k].objective), found[k].objective), default=0)
    drawn = {test: one for test, one in every[best].items() if one is not None} if every else {}
    errors = _errors(series, every)
    return Standing(row.key, row.title, row.published, found, errors, drawn, every, _width(row, found))


def _width(row: Row, found: Sequence[Member]) -> float:
    """How wide a prior left-out trials chose; NaN where there was no choice."""
    estimator = row.cells[0].estimator if row.cells else None
    if not found or not isinstance(estimator, Widths):
        return math.nan
    known = found[0].summary.parameters if found[0].summary else {}
    priors = {path: one.prior_sigma for path, one in known.items() if math.isfinite(one.prior_sigma)}
    return estimator.chosen(row.cells[0].problem, priors)


def _predicted(series: Series, member: Member, label: str, scale: Mapping[str, float]) -> dict[str, Comparison | None]:
    out: dict[str, Comparison | None] = dict.fromkeys(series.tests)
    for test, trial in series.tests.items():
        with suppress(SimulationError):
            guess = replay(member.ship, trial, restart=series.restart, method="euler")
            out[test] = compare(trial, guess, label=label, restart=series.restart, sigma=scale)
    return out


def _baseline(series: Series, scale: Mapping[str, float]) -> Standing:
    drawn = {test: compare(trial, constant_velocity(trial, series.restart), label=BASELINE, restart=series.restart,
                           sigma=scale) for test, trial in series.tests.items()}  # fmt: skip
    return Standing(BASELINE, BASELINE, "", (), _errors(series, [drawn]), drawn)


def _errors(series: Series, every: Sequence[Mapping[str, Comparison | None]]) -> dict[str, Array]:
    """Standardised error of each member by test, and of all tests together; infinite without a prediction."""
    found: dict[str, list[float]] = {test: [] for test in (*series.tests, TOGETHER)}
    for comparisons in every:
        for test, one in comparisons.items():
            found[test].append(one.standardised if one is not None and math.isfinite(one.standardised) else math.inf)
        whole = [one for one in comparisons.values() if one is not None]
        found[TOGETHER].append(pooled(whole) if len(whole) == len(comparisons) else math.inf)
    return {test: np.array(errors) for test, errors in found.items()}


def outcomes(table: Table, claim: Claim) -> list[Found]:
    """A claim in each of its rows: what `factor` asks for is met, or missed, by two standard errors; else undecided.

    The same for all: "better" has a factor of one or more, "no worse" gives its margin by a smaller one.
    Without a spread over seeds the means decide.
    """
    out: list[Found] = []
    better, worse = table.standing(claim.better), table.standing(claim.worse)
    for test in claim.rows:
        low, high = (math.nan if one is None else one.mean(test) for one in (better, worse))
        # One that cannot be predicted at all is infinitely worse than one that can.
        ratio = 0.0 if math.isinf(low) else high / low if low > 0 else math.nan
        if better is None or worse is None or math.isnan(ratio):
            out.append(Found(test, low, high, ratio, "not run"))
            continue
        error = math.hypot(better.uncertain(test) * claim.factor, worse.uncertain(test))
        away = -math.inf if math.isinf(low) else high - claim.factor * low
        if error > 0.0 and abs(away) <= _APART * error:
            verdict = "within the spread of the seeds"
        elif ratio < claim.factor:
            verdict = "does not hold"
        else:
            verdict = "holds without residual" if better.width == 0.0 else "holds"
        out.append(Found(test, low, high, ratio, verdict))
    return out


def compositions(series: Series) -> dict[str, tuple[Trial, ...]]:
    """The training trials of each composition that some model was trained on, by what the file calls it."""
    found: dict[str, tuple[Trial, ...]] = {}
    for row in series.rows:
        if row.cells:
            name = ", ".join(one.removeprefix("@") for one in row.train)
            found.setdefault(name, row.cells[0].problem.trials)
    return found
