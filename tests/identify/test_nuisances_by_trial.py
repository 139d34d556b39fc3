"""Nuisance parameters of each trial in fits of trajectories, and nuisance parameters that no data tell apart."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.parameters import Free, values
from seatrial.data import Array, Trial
from seatrial.environment import Uniform
from seatrial.identify import Loss, Nuisance, Problem, StudyError
from seatrial.identify.trajectory.objective import TrajectoryObjective
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.lanes import Lanes
from seatrial.simulate.run import approach, simulate

DEG = math.radians(1.0)
NOISE = {"x": 0.02, "y": 0.02, "psi": 0.1 * DEG, "u": 0.01, "v_m": 0.01, "r": 0.02 * DEG}
NEUTRAL = Path(__file__).parents[2] / "studies" / "kvlcc2_l7_neutral.toml"
PATHS = ("hull.R_0", "hull.N_v", "hull.N_r")
PRIORS = Nuisance(current=0.1, bias={"psi": 3.0 * DEG, "u": 0.1})


@cache
def _run(k: int, drift: float) -> Trial:
    ship = load(str(NEUTRAL))
    around = Uniform(U_C=drift, gamma_C=2.0 * k) if drift else None
    angle = (10.0 + 5.0 * k) * DEG
    return simulate(ship, Zigzag(approach(ship)[1], angle, angle, 1.0 - 2.0 * (k % 2)), duration=100.0, dt=0.1,
                    every=5, name=f"run_{k}", environment=around)  # fmt: skip


def _logs(off: Mapping[str, float], seed: int, drift: float = 0.0) -> tuple[tuple[Trial, ...], dict[str, list[float]]]:
    """Noisy logs, each with biases and a current of its own that it does not show, and what was planted."""
    rng, out = np.random.default_rng(seed), list[Trial]()
    true: dict[str, list[float]] = {name: [] for name in off}
    for k in range(4):
        run = _run(k, drift)
        channels = {name: run[name] + rng.normal(0.0, level, len(run)) for name, level in NOISE.items()}
        for name, size in off.items():
            true[name].append(float(rng.normal(0.0, size)))
            channels[name] = channels[name] + true[name][-1]
        controls = {name: run[name] for name in ("n_P", "delta")}
        out.append(Trial(run.name, run.t, {**channels, **controls}, meta={"L_pp": 7.0}))
    if drift:
        true["north"] = [drift * math.cos(2.0 * k) for k in range(4)]
        true["east"] = [drift * math.sin(2.0 * k) for k in range(4)]
    return tuple(out), true


def _problem(trials: tuple[Trial, ...], nuisance: Nuisance, *more: Free) -> Problem:
    ship = load(str(NEUTRAL))
    known = values(ship.model)
    return Problem(ship, trials, (*(Free(path, 1.1 * known[path]) for path in PATHS), *more), nuisance=nuisance)


@pytest.mark.long
def test_biases_and_currents_that_differ_between_trials_come_back_within_their_sigma() -> None:
    names = {"bias_psi": "psi", "bias_u": "u", "current_x": "north", "current_y": "east"}
    known, z, own = values(load(str(NEUTRAL)).model), list[float](), list[float]()
    for seed in range(3):
        trials, true = _logs({"psi": 2.0 * DEG, "u": 0.05}, seed, drift=0.08)
        fit = Trajectory().fit(_problem(trials, PRIORS))
        assert fit.diagnosis is not None
        assert not fit.diagnosis.lacking
        z += [float((v - known[f.path]) / s) for f, v, s in zip(fit.free, fit.values, fit.sigma, strict=True)]
        for k, trial in enumerate(trials):
            found, sigma = fit.nuisances[trial.name], fit.diagnosis.by_trial[trial.name]
            own += [(found[name] - true[key][k]) / sigma[name] for name, key in names.items()]
    assert np.abs([*z, *own]).max() < 4.0
    assert 0.7 < np.sqrt(np.mean(np.square(own))) < 1.3


@pytest.mark.slow
def test_a_recorded_start_is_off_by_the_bias_of_its_trial() -> None:
    """Predictions begin where the record says: with its bias left in, a heading 2 deg off bends every track."""
    ship, true = load(str(NEUTRAL)), {"run_0": 2.0 * DEG, "run_1": -1.0 * DEG, "run_2": 0.5 * DEG}
    trials = tuple(_run(k, 0.0).having(psi=_run(k, 0.0)["psi"] + off) for k, off in enumerate(true.values()))
    problem = replace(_problem(trials, Nuisance(bias={"psi": 30.0 * DEG})), loss=Loss(NOISE))
    exact = Trajectory(initial="measured", window=50.0).fit(problem)
    known = values(ship.model)
    assert {name: one["bias_psi"] for name, one in exact.nuisances.items()} == pytest.approx(true, abs=0.1 * DEG)
    assert exact.values == pytest.approx([known[path] for path in PATHS], rel=0.02)
    # the slopes are those of the objective: differences of it say the same
    objective = TrajectoryObjective.like(problem, Trajectory(initial="measured", window=50.0))
    p, eta = 1.02 * exact.values, np.array([0.3, -0.2, 0.1]) * DEG
    normal, step = objective.normal(p, eta), 1e-5
    slopes = [(objective.cost(p, eta + d) - objective.cost(p, eta - d)) / (4.0 * step) for d in step * np.eye(3)]
    assert np.concatenate([one.gradient.ravel() for one in normal.blocks]) == pytest.approx(slopes, rel=1e-4)
    # ... and what the tests of a fit have the parameters do without, trial by trial
    every, scale = objective.columns(*_slopes(objective, p, eta)), objective.windows.scale
    weighted = np.where((scale > 0.0)[..., None], every[0] * scale[..., None], 0.0)
    for k, (part, mine) in enumerate(zip(objective.layout.slices, objective.layout.lanes, strict=True)):
        found = objective.layout.columns(k, weighted[mine], scale[mine], p.size)[..., 0]
        moved = [objective.residuals(p, eta + d)[mine] for d in step * np.eye(3)[part]]
        assert found.ravel() == pytest.approx((moved[0] - objective.residuals(p, eta)[mine]).ravel() / step, rel=1e-2,
                                              abs=1e-3 * np.abs(found).max())  # fmt: skip


def _slopes(objective: TrajectoryObjective, p: Array, eta: Array) -> tuple[Array, Array, Array, Lanes]:
    """Predictions of all windows with their slopes, as `TrajectoryObjective.columns` takes them."""
    lanes, _ = objective.lanes(p[None], eta[None])
    return (*objective.slopes(lanes), p[None], lanes)


@pytest.mark.slow
def test_a_free_parameter_that_copies_an_error_of_an_instrument_is_refused_with_the_pair() -> None:
    neutral = Free("rudder.delta_0", 0.0)
    trials, _ = _logs({}, 0)
    problem = _problem(trials, Nuisance(common={"offset.delta": math.inf}), neutral)
    with pytest.raises(StudyError, match=r"no data tell offset\.delta apart from rudder\.delta_0"):
        Trajectory().fit(problem)
    known = replace(problem, nuisance=Nuisance(common={"offset.delta": 1.0 * DEG}))
    fit = Trajectory().fit(known)
    pair = next(v for v in fit.verdicts if v.subject == "rudder.delta_0 and offset.delta")
    assert pair.status == "weak"
    assert fit.sigma[-1] > 0.9 * DEG


@pytest.mark.slow
def test_a_parameter_that_goes_with_the_current_of_each_trial_is_named() -> None:
    """Straight runs on one course: a current along it and a resistance change the same speed."""
    ahead = tuple(t.rows(slice(0, 30)).having(delta=np.zeros(30)) for t in _logs({}, 1)[0])
    problem = _problem(ahead, Nuisance(current=0.5))
    fit = Trajectory().fit(replace(problem, free=problem.free[:1]))
    pairs = {v.subject: v.status for v in fit.verdicts if " and " in v.subject}
    assert pairs == {"hull.R_0 and current_x of each trial": "weak"}
