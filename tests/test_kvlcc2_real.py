"""Published KVLCC2 coefficients tuned to zigzags of two tanks, judged by zigzags that the fit has not seen.

The data are read through SEATRIAL_DATA, never copied.
"""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.parameters import values
from seatrial.data import Trial
from seatrial.identify import Problem
from seatrial.identify.lint import lint
from seatrial.manoeuvres.turning import Turning
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.replay import replay
from seatrial.simulate.run import simulate
from seatrial.study.study import Study, read_study

HOME = Path(__file__).parents[1]
ROOT = Path(os.environ.get("SEATRIAL_DATA", HOME.parent / "shared" / "data"))
STUDY = HOME / "studies" / "kvlcc2_fine_tuning.toml"
UNTUNED = load("kvlcc2_l7")

data = pytest.mark.skipif(
    not ((ROOT / "kvlcc2_hsva_simman2008").is_dir() and (ROOT / "kvlcc2_marin_simman2008").is_dir()),
    reason="KVLCC2 zigzags absent: set SEATRIAL_DATA (SIMMAN 2008 workshop, HSVA and MARIN)",
)


@pytest.fixture(scope="module")
def study() -> Study:
    return read_study(STUDY)


@pytest.fixture(scope="module")
def tuned(study: Study) -> Ship:
    return study.estimator.fit(study.problem).ship


def errors(ship: Ship, trial, restart: float | None) -> tuple[float, float]:
    """Root mean square error of heading [deg] and yaw rate [deg/s]."""
    run = replay(ship, trial, restart=restart)
    out = []
    for name in ("psi", "r"):
        truth = np.interp(run.t, trial.t, np.unwrap(trial[name]) if name == "psi" else trial[name])
        out.append(math.degrees(float(np.sqrt(np.nanmean((run[name] - truth) ** 2)))))
    return out[0], out[1]


def ratios(pairs, restart: float | None) -> np.ndarray:
    """Mean error over the trials, tuned over untuned: heading, yaw rate."""
    after = np.mean([errors(ship, trial, restart) for ship, trial in pairs], axis=0)
    return after / np.mean([errors(UNTUNED, trial, restart) for _, trial in pairs], axis=0)


def test_the_ship_of_the_study_is_the_published_one() -> None:
    ours = load(HOME / "studies" / "kvlcc2_l7_neutral.toml")
    assert values(ours.model) == {**values(UNTUNED.model), "rudder.delta_0": 0.0}
    policy = Turning(10.0, 0.4)
    a, b = (simulate(ship, policy, speed=1.18, duration=60, dt=0.1) for ship in (ours, UNTUNED))
    assert np.array_equal(a.stack("x", "psi"), b.stack("x", "psi"))


@pytest.mark.slow
@data
def test_the_study_is_sound_and_its_sets_are_apart(study: Study) -> None:
    assert (len(study.problem.trials), len(study.test)) == (8, 3)
    (rate,) = lint(study.problem, study.test)  # the model's rudder is faster than the ship's by Froude's law
    assert (rate.severity, rate.where) == ("warning", "actuators")
    assert rate.text.startswith("delta moves at 20.2 deg/s, the ship file has rate 15.8")
    for trial in (*study.problem.trials, *study.test):
        assert trial.meta["L_pp"] == pytest.approx(7.0)


@data
@pytest.mark.long
@pytest.mark.parametrize("restart", [None, 30.0])
def test_unseen_zigzags_are_predicted_with_half_the_error(study: Study, tuned: Ship, restart: float | None) -> None:
    assert (ratios([(tuned, trial) for trial in study.test], restart) <= 0.5).all()


@pytest.fixture(scope="module")
def held(study: Study) -> list[tuple[Ship, Trial]]:
    """Each trial with the ship that was tuned to all others."""
    every = (*study.problem.trials, *study.test)
    return [(study.estimator.fit(without(study.problem, every, trial)).ship, trial) for trial in every]


@data
@pytest.mark.long
@pytest.mark.parametrize("restart", [None, 30.0])
def test_each_zigzag_left_out_in_turn(held: list[tuple[Ship, Trial]], restart: float | None) -> None:
    assert (ratios(held, restart) <= 0.5).all()


def without(problem: Problem, trials, trial) -> Problem:
    return replace(problem, trials=tuple(one for one in trials if one is not trial))


@data
@pytest.mark.long
@pytest.mark.parametrize("side", [1, -1])
def test_the_turning_circle_stays_sensible(tuned: Ship, side: int) -> None:
    """No circle was fitted; a zigzag that bends the cubic terms would show here."""
    policy = Turning(10.33, side * math.radians(35))
    found = policy.indices(simulate(tuned, policy, speed=1.18, duration=150, dt=0.05), 7.0)
    assert 2.9 < found["advance"].over_L < 3.6
    assert 2.9 < found["tactical_diameter"].over_L < 3.6
