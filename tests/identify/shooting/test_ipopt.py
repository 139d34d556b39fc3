"""IPOPT in full space and the engine's condensed windows are two ways to one optimum."""

from dataclasses import replace

import numpy as np
import pytest

from seatrial.data.prepare import cut
from seatrial.identify.shooting.logo import Shooting
from seatrial.manoeuvres.turning import Turning
from seatrial.sensors import Sensors
from seatrial.simulate.run import simulate
from tug_trials import NAMES, NOISE, TRUE, TRUTH, problem

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def told():
    """Four short runs, so that the test takes seconds; priors hold what they do not excite."""
    whole = problem(start=0.8 * TRUE)
    free = tuple(replace(f, prior=v, sigma=0.3 * abs(v)) for f, v in zip(whole.free, TRUE, strict=True))
    return replace(whole, trials=tuple(cut(t, 0.0, 30.0) for t in whole.trials[3::3]), free=free)


@pytest.mark.long
@pytest.mark.parametrize("initial", ["free", "measured"])
def test_the_same_optimum_as_the_engine(told, initial):
    engine = Shooting(initial=initial).fit(told)
    ipopt = Shooting(initial=initial, back_end="ipopt").fit(told)
    assert engine.status == ipopt.status == "converged"
    assert ipopt.objective == pytest.approx(engine.objective, rel=1e-6)
    assert np.abs((ipopt.values - engine.values) / engine.sigma).max() < 1e-2


@pytest.mark.long
def test_the_exact_hessian_ends_there_too(told):
    few = replace(told, trials=told.trials[1:3])
    engine = Shooting().fit(few)
    exact = Shooting(back_end="ipopt", hessian="exact").fit(few)
    assert exact.objective == pytest.approx(engine.objective, rel=1e-6)


def test_a_constraint_that_binds_is_met_by_both():
    """A ship that gains speed from its linear damping: Eq. 19 forbids it, and X_u ends on the boundary."""
    pushed = TRUTH.having({"damping.X_u": 6.0})
    rng, runs = np.random.default_rng(3), []
    for n in (3.0, 5.0, 8.0):
        run = simulate(pushed, Turning(n_P=n, delta=0.2), speed=0.1, duration=40.0, dt=0.2, name=f"run {n:g}")
        runs.append(Sensors(NOISE).read(run, rng))
    told = problem(start=TRUE, recorded=tuple(runs))
    told = replace(told, free=tuple(f for f in told.free if f.path in ("damping.X_u", "damping.X_uu", "inertia.m_11")))
    at = NAMES.index("damping.X_u")
    loose = Shooting().fit(told)
    assert dict(zip([f.path for f in loose.free], loose.values, strict=True))["damping.X_u"] > 3.0
    fits = [Shooting(constraints=True, back_end=b).fit(told) for b in ("engine", "ipopt")]
    for fit in fits:
        X_u = dict(zip([f.path for f in fit.free], fit.values, strict=True))["damping.X_u"]
        assert X_u == pytest.approx(0.0, abs=1e-3 * abs(TRUE[at]))
    assert fits[0].objective == pytest.approx(fits[1].objective, rel=1e-5)
    assert fits[0].objective > loose.objective
