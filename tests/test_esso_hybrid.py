"""The hybrid of the 3 m Esso Osaka on trials that no fit has seen, under the common evaluator of test_esso_osaka."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from esso_osaka import KINDS, ROOT, by_kind
from seatrial.belief.spread import members, spreads
from seatrial.data import Trial
from seatrial.ships import Ship
from seatrial.simulate.carried import Carrier
from seatrial.simulate.replay import replay
from seatrial.study.series import read_series
from seatrial.study.study import read_study
from seatrial.validate import Comparison
from seatrial.validate.comparison import compare, pooled
from seatrial.validate.metrics import ESSO_OSAKA_SIGMA

STUDY = Path(__file__).parents[1] / "studies" / "esso_osaka_hybrid.toml"
DAYS = ("31-Jul", "03-Aug", "06-Aug", "14-Sep", "14-Oct", "12-Nov")

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not ROOT.is_dir(), reason="Esso Osaka data absent: set SEATRIAL_DATA (NAOE-5thLab/FRT-DS-ESSO)"),
]


@pytest.fixture(scope="module")
def trials():
    return by_kind()


def errors(ship: Ship, some: Iterable[Trial]) -> list[Comparison]:
    return [judged(t, replay(ship, t, restart=100.0, method="euler")) for t in some]


def judged(trial: Trial, predicted: Trial) -> Comparison:
    return compare(trial, predicted, label="", restart=100.0, sigma=ESSO_OSAKA_SIGMA)


def test_on_turns_that_no_fit_has_seen_it_is_no_worse_than_its_physics(trials):
    """The residual in full is worse by half, though every state and control of the turns lies among the training data;
    the mean of the fits is better than either end."""
    study, plain = read_study(STUDY), read_study(STUDY.with_name("esso_osaka_mmg.toml"))
    train = tuple(t for kind in KINDS for t in trials[kind] if kind != "turning")
    physics = plain.estimator.fit(replace(plain.problem, trials=train, validation=())).ship
    problem = replace(study.problem, trials=train)
    ends = [values for values, _ in study.estimator.each(problem)]
    ships = [problem.ship.having(problem.vector.by_path(values)) for values in (*ends[1:], np.mean(ends, axis=0))]
    alone, full, mean = (pooled(errors(ship, trials["turning"])) for ship in ships)
    assert mean <= alone
    assert mean <= pooled(errors(physics, trials["turning"]))
    assert full > 1.2 * alone


def test_by_day_no_kind_is_predicted_worse_than_by_the_mmg_model(trials):
    """Each day left out whole, with it all zigzags or all berthings; with the minute before each start it errs less."""
    study, plain = read_study(STUDY), read_study(STUDY.with_name("esso_osaka_mmg.toml"))
    every = [t for kind in KINDS for t in trials[kind]]
    found, physics, carried = ({kind: [] for kind in KINDS} for _ in range(3))
    for day in DAYS:
        train = tuple(t for t in every if day not in t.name)
        alone = plain.estimator.fit(replace(plain.problem, trials=train, validation=())).ship
        fitted = study.estimator.fit(replace(study.problem, trials=train)).ship
        carrier = Carrier.of(fitted, 60.0)
        for kind in KINDS:
            out = [t for t in trials[kind] if day in t.name]
            found[kind] += errors(fitted, out)
            physics[kind] += errors(alone, out)
            carried[kind] += [judged(t, carrier.replay(t, restart=100.0, method="euler")) for t in out]
    assert sum(map(len, found.values())) == len(every)
    for kind in KINDS:
        assert pooled(found[kind]) <= 1.01 * pooled(physics[kind]), kind
        assert pooled(carried[kind]) <= pooled(physics[kind]), kind
    total, alone = (pooled([c for some in one.values() for c in some]) for one in (found, physics))
    assert total <= 0.9 * alone


def test_few_trials_leave_the_residual_out(trials):
    """On TZRB (2536 s) left-out trials choose the physics and the drift alone; with the residual random is .25."""
    row = next(row for row in read_series(STUDY.with_name("wakita2022.toml")).rows if row.key == "hybrid-little")
    (cell,) = row.cells
    names = [t.name for t in cell.problem.trials]
    fit = cell.estimator.fit(cell.problem)
    assert "prior width 0 by left-out trials" in fit.status
    unseen = {kind: [t for t in trials[kind] if t.name not in names] for kind in ("random", "berthing")}
    assert pooled(errors(fit.ship, unseen["random"])) <= 0.23
    assert pooled(errors(fit.ship, unseen["berthing"])) <= 0.135


def test_members_part_on_a_kind_that_no_trial_showed(trials):
    """Without zigzags, the members' spread on them is larger than on what was seen, and goes with the error."""
    from scipy.stats import spearmanr

    study = read_study(STUDY)
    problem = replace(study.problem, trials=tuple(t for k in KINDS for t in trials[k] if k != "zigzag"))
    estimator = replace(study.estimator, widths=(1.0,))
    fit = estimator.fit(problem)
    found = members(fit, problem, estimator, ESSO_OSAKA_SIGMA, restart=100.0)
    judged = spreads(found, fit.ship, trials["zigzag"])
    level = [s.standardised for s in judged]
    assert np.mean(level) > 1.5 * np.mean(list(found.training.values()))
    assert spearmanr(level, [c.standardised for c in errors(fit.ship, trials["zigzag"])]).statistic > 0.7
    fast = {s.name.split("2020_")[1]: s.verdict for s in judged}
    assert {fast[at] for at in ("13_04_24", "13_14_21", "13_57_45")} == {"leaves"}
    assert fast["13_22_52"] == "inside"
