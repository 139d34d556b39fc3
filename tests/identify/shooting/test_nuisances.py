"""Currents and sensor biases of each trial: derivatives are exact, the truth comes back, bad input is told."""

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.environment import Uniform
from seatrial.identify import Nuisance, StudyError
from seatrial.identify.shooting.chains import chains
from seatrial.identify.shooting.condensed import Condensed
from seatrial.identify.shooting.constraints import Inequalities, Penalty
from seatrial.identify.shooting.logo import Shooting
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.sensors import Sensors
from seatrial.simulate.run import simulate
from tug_trials import DT, NAMES, NOISE, ROWS, TRUE, TRUTH, policies, problem

BOTH = Nuisance(current=0.2, bias={"u": 0.05, "psi": math.radians(1.0)})


def drifted(which, rng, *, biased=False):
    """Runs in a current of their own that nobody recorded; with `biased`, logs and compasses are off too."""
    out = []
    for k in which:
        around = Uniform(U_C=rng.uniform(0.05, 0.2), gamma_C=rng.uniform(0.0, 2 * math.pi))
        run = simulate(TRUTH, policies()[k], speed=0.0 if k < 4 else 0.5, duration=(ROWS[k] - 1) * DT, dt=DT,
                       environment=around, name=f"run_{k + 1}")  # fmt: skip
        hidden = {name: np.zeros(len(run)) for name in ("U_C", "gamma_C")}
        off = {name: run[name] + biased * rng.normal(0.0, sigma) for name, sigma in BOTH.bias.items()}
        out.append(Sensors(NOISE).read(run.having(**hidden, **off), rng))
    return tuple(out)


@pytest.mark.slow
@pytest.mark.parametrize("freed", [True, False])
@pytest.mark.parametrize("linked", [True, False])
def test_slopes_with_nuisances_are_those_of_the_objective(freed, linked):
    told = replace(problem(recorded=drifted((6, 10), np.random.default_rng(0))), nuisance=BOTH)
    cut = chains(told.trials, TRUTH.model, told.loss, NOISE, window=5.0, dt=DT, every=1, weights={})
    none = Penalty(Inequalities.none(told), 1.0, np.zeros(0))
    o = Condensed.build(told, cut, anchor=np.array([TRUE, np.zeros(22)]), penalty=none, freed=freed,
                        span=np.array(list(NOISE.values())), method="rk4", threads=2)  # fmt: skip
    o = replace(o, linked=linked)
    own = np.array([[0.03, -0.05, 0.02, 0.01], [-0.04, 0.02, -0.03, 0.02]])
    point, wide = o.start(TRUE * 1.05, own), np.full(22, np.inf)
    linear = o.linear(point)
    assert linear.cost == pytest.approx(o.cost(point)[0], rel=1e-10)
    d = o.step(linear, point.p, 1e-3, -wide, wide)
    t = 1e-5
    up, down = (o.cost(o.moved(linear, point, d, s, -wide, wide)) for s in (t, -t))
    nothing = np.zeros_like(linear.gaps)
    assert 0.25 * (up[0] - down[0]) / t == pytest.approx(linear.slope(d, nothing), rel=1e-5)
    np.testing.assert_allclose(up[1], (1 - t) * linear.gaps, atol=1e-7)


@pytest.mark.long
def test_a_current_that_nobody_recorded_does_no_harm_once_it_is_estimated():
    """Few parameters of four runs; without the nuisance they are many sigma off."""
    recorded = drifted((1, 5, 8, 11), np.random.default_rng(1))
    whole = problem(start=0.8 * TRUE, recorded=recorded)
    few = ("inertia.m_11", "inertia.m_33", "damping.X_u", "damping.N_r")
    ship = TRUTH.having({f.path: f.start for f in whole.free if f.path in few})
    told = replace(whole, ship=ship, free=tuple(f for f in whole.free if f.path in few))
    true = np.array([TRUE[NAMES.index(f.path)] for f in told.free])
    blind = Shooting().fit(told)
    assert np.abs((blind.values - true) / blind.sigma).max() > 10.0
    fit = Shooting().fit(replace(told, nuisance=Nuisance(current=0.2)))
    assert np.abs((fit.values - true) / fit.sigma).max() < 3.0
    # What was hidden is told, to a tenth of the least current.
    assert set(fit.nuisances) == {t.name for t in recorded}
    rng = np.random.default_rng(1)
    for k, own in zip((1, 5, 8, 11), fit.nuisances.values(), strict=True):
        U_C, gamma_C = rng.uniform(0.05, 0.2), rng.uniform(0.0, 2 * math.pi)
        for _ in BOTH.bias:  # drawn and thrown away
            rng.normal(0.0, 1.0)
        Sensors(NOISE).read(simulate(TRUTH, policies()[k], speed=0.5, duration=(ROWS[k] - 1) * DT, dt=DT), rng)
        assert own == pytest.approx(
            {"current_x": U_C * math.cos(gamma_C), "current_y": U_C * math.sin(gamma_C)}, abs=0.005
        )
    assert blind.nuisances == {}


@pytest.mark.slow
def test_both_estimators_tell_currents_and_biases_by_the_same_names():
    recorded = drifted((5, 8), np.random.default_rng(2), biased=True)
    whole = problem(recorded=recorded)
    told = replace(whole, ship=TRUTH, free=(replace(whole.free[0], start=TRUE[0]),), nuisance=BOTH)
    ours = Shooting().fit(told).nuisances
    others = Trajectory(window=80.0, every=1, method="rk4", tolerance=1e-10).fit(
        replace(told, nuisance=replace(BOTH, initial=NOISE))
    ).nuisances  # fmt: skip
    assert list(ours) == list(others) == [t.name for t in recorded]
    for name, own in ours.items():
        assert set(own) == {"current_x", "current_y", "bias_u", "bias_psi"}
        assert own == pytest.approx(others[name], abs=0.02)


@pytest.mark.long
def test_all_parameters_come_back_from_hidden_currents_and_biases():
    rng = np.random.default_rng(5)
    for biased, nuisance in ((False, Nuisance(current=0.2)), (True, BOTH)):
        told = replace(problem(recorded=drifted(range(12), rng, biased=biased)), nuisance=nuisance)
        fits = [Shooting(schedule=s).fit(told) for s in ("logo", "go")]
        assert fits[0].objective == pytest.approx(fits[1].objective, rel=1e-8)
        assert fits[0].status == "converged"
        assert np.abs((fits[0].values - TRUE) / fits[0].sigma).max() < 3.0


@pytest.mark.parametrize(("nuisance", "back_end", "words"), [
    (Nuisance(initial={"u": 0.1}), "engine", "leave it out and say estimator.initial"),
    (Nuisance(bias={"speed": 0.1}), "engine", "nuisance.bias: no channel 'speed'; known: x, y"),
    (Nuisance(bias={"u": 0.0}), "engine", "nuisance.bias.u: is 0; it must be above zero"),
    (Nuisance(current=0.1), "ipopt", "takes no \\[nuisance\\]"),
])  # fmt: skip
@pytest.mark.slow
def test_nuisances_that_cannot_be_are_told(nuisance, back_end, words):
    with pytest.raises(StudyError, match=words):
        Shooting(back_end=back_end).fit(replace(problem(), nuisance=nuisance))
