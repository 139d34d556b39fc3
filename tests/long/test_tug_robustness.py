"""The tug from starts of +-200 % around the truth, with LO and without, and 100 manoeuvres x 1000 samples."""

import resource
import sys
from contextlib import suppress

import numpy as np
import pytest
from scipy.stats import binom, chi2

from seatrial.identify import FitError
from seatrial.identify.shooting.logo import Shooting
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.sensors import Sensors
from seatrial.simulate.run import simulate
from tug_trials import NOISE, TRUE, TRUTH, problem, sailed, trials

pytestmark = pytest.mark.long


def right(schedule, starts):
    """How many of the starts end at the optimum; "go" too has LO as its way back in."""
    recorded, rng = trials(0), np.random.default_rng(7)
    wanted = Shooting().fit(problem(start=TRUE, recorded=recorded)).objective
    hits = 0
    for _ in range(starts):
        told = problem(start=TRUE * (1.0 + rng.uniform(-2.0, 2.0, TRUE.size)), recorded=recorded)
        with suppress(FitError):
            hits += abs(Shooting(schedule=schedule).fit(told).objective / wanted - 1.0) < 1e-6
    return hits


@pytest.mark.parametrize(("schedule", "starts"), [("logo", 24), ("go", 12)])
def test_far_starts_end_at_the_optimum(schedule, starts):
    """Of 50 each all did; without LO a fit takes twice as long."""
    hits = right(schedule, starts)
    sys.stdout.write(f"{schedule}: {hits} of {starts}\n")
    assert hits >= starts - 1


def test_errors_are_as_wide_as_their_sigma_says():
    """40 seeds of noise, 880 estimates: spread one, three sigma left no more often than by chance.

    One of 22 estimates lies beyond three sigma in some 4 % of all fits even where sigma is exact.
    """
    runs, z, squares = sailed(), [], 0.0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        fit = Shooting().fit(problem(recorded=tuple(Sensors(NOISE).read(run, rng) for run in runs)))
        error = fit.values - TRUE
        z.append(error / fit.sigma)
        squares += float(error @ np.linalg.solve(fit.covariance, error))
    z = np.array(z)
    beyond = int((np.abs(z) > 3.0).any(axis=1).sum())
    sys.stdout.write(f"spread {z.std():.3f}, beyond three sigma in {beyond} of 40 fits, squares {squares:.0f}\n")
    assert 0.9 < z.std() < 1.15
    assert beyond <= binom.ppf(0.999, 40, 0.043)
    assert chi2.ppf(0.001, 880) < squares < chi2.ppf(0.999, 880)


def many(count):
    """Zigzags of 1000 samples at as many speeds and angles."""
    rng, out = np.random.default_rng(1), []
    for k in range(count):
        policy = Zigzag(n_P=float(rng.uniform(3.0, 10.0)), delta=float(rng.uniform(0.15, 0.5)), psi=0.35)
        run = simulate(TRUTH, policy, speed=0.5, duration=199.8, dt=0.2, name=f"zigzag {k}")
        out.append(Sensors(NOISE).read(run, rng))
    return tuple(out)


def test_ten_times_the_data_needs_no_more_iterations_and_memory_stays_small():
    """An iteration costs what its data do (benchmarks/shooting.py): their number tells the growth."""
    recorded, iterations = many(100), {}
    for count in (10, 100):
        fit = Shooting().fit(problem(recorded=recorded[:count]))
        assert fit.status == "converged"
        iterations[count] = len(fit.history)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    sys.stdout.write(f"iterations of a fit {iterations}, peak {peak:.0f} MB\n")
    assert iterations[100] <= iterations[10] + 2
    assert peak < 1024.0
