"""Coverage of the 95 % bands on the unseen trials' tactical diameter, over 100 virtual repetitions."""

import sys

import numpy as np
import pytest

from seatrial.belief.ensemble import bands, ensemble
from seatrial.identify.posterior.misfit import misfit
from seatrial.identify.trajectory.multistart import MultiStart
from suzaku_turns import SHIP, TRUTH, manoeuvre, problem, turn, unmodelled

pytestmark = pytest.mark.long
ESTIMATOR = MultiStart(starts=4, method="euler", initial="measured")
UNSEEN = (-10, 20, -35, 40)


def coverage(make, repetitions):
    """Share of repetitions whose band holds the truth, by unseen turn, and the share that is warned of."""
    runs = {angle: turn(TRUTH, angle) for angle in UNSEEN}
    hits, warned = dict.fromkeys(UNSEEN, 0), 0
    for seed in range(repetitions):
        told = make(seed)
        fit = ESTIMATOR.fit(told)
        members = ensemble(fit, told, ESTIMATOR, members=100, seed=seed)
        warned += misfit(fit, told, ESTIMATOR).lacking
        for angle, run in runs.items():
            low, high = bands(members, run, manoeuvre(angle)).interval("tactical_diameter")
            true = manoeuvre(angle).indices(run, SHIP.L_pp)["tactical_diameter"].value
            hits[angle] += low <= true <= high
    return {angle: n / repetitions for angle, n in hits.items()}, warned / repetitions


def test_a_truth_of_the_same_structure_is_covered():
    found, warned = coverage(lambda seed: problem(seed=1000 + seed), 100)
    sys.stdout.write(f"coverage {found}, warned of {warned:.0%}\n")
    assert 0.90 <= np.mean(list(found.values())) <= 0.99
    assert all(share >= 0.90 for share in found.values())
    assert warned <= 0.05


def test_a_truth_with_unmodelled_wind_and_lag_is_reported_and_warned_of():
    found, warned = coverage(lambda seed: unmodelled(2000 + seed), 20)
    sys.stdout.write(f"coverage {found}, warned of {warned:.0%}\n")
    assert warned == 1.0
