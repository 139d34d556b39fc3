"""Ships that roll are fitted to logs with heel: truth within its standard errors, exact slopes, logs without heel."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import Free, values
from seatrial.data import Trial
from seatrial.identify import Loss, Problem, StudyError
from seatrial.identify.lint import lint
from seatrial.identify.nuisance import begun_as
from seatrial.identify.record import scales, windows
from seatrial.identify.trajectory.objective import TrajectoryObjective
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.replay import replay
from seatrial.simulate.run import simulate

SHIP: Any = load("container_son_nomoto")
NOISE = {"x": 1.0, "y": 1.0, "psi": 2e-3, "u": 0.03, "v_m": 0.03, "r": 2e-4, "phi": 2e-3, "p": 4e-4}
START = {"body.GM": 0.4, "derivatives.K_v": 2e-4, "derivatives.N_r": -1.8e-3}


@cache
def log(kind: str) -> Trial:
    n_P, angle = 80.0 / 60.0, math.radians(20.0)
    policy = Turning(n_P, 1.5 * angle) if kind == "turning" else Zigzag(n_P, angle, angle, 1.0)
    trial = simulate(SHIP, policy, duration=300.0, dt=0.05, every=20, name=kind)
    rng = np.random.default_rng(len(kind))
    return replace(trial.having(**{n: trial[n] + sd * rng.standard_normal(len(trial)) for n, sd in NOISE.items()}),
                   meta={**trial.meta, "source": "virtual"})  # fmt: skip


def problem(*without: str) -> Problem:
    trials = tuple(replace(one, channels={n: v for n, v in one.channels.items() if n not in without})
                   for one in (log("turning"), log("zigzag")))  # fmt: skip
    return Problem(SHIP.having(START), trials, tuple(Free(path, value) for path, value in START.items()))


@pytest.mark.slow
@pytest.mark.parametrize("without", [(), pytest.param(("p",), marks=pytest.mark.long),
                                     pytest.param(("phi", "p"), marks=pytest.mark.long)])  # fmt: skip
def test_truth_within_its_standard_errors(without: tuple[str, ...]) -> None:
    """Without the heel too: sway and yaw tell of it, at errors ten times as large."""
    fit, truth = Trajectory(window=100.0).fit(problem(*without)), values(SHIP.model)
    off = [(value - truth[path]) / sd for path, value, sd in zip(START, fit.values, fit.sigma, strict=True)]
    assert np.abs(off).max() < 4.0
    assert fit.diagnosis is not None
    assert set(fit.diagnosis.channels) == {n for n in NOISE if n not in without}
    assert not fit.diagnosis.lacking
    assert all(one.size == pytest.approx(1.0, abs=0.15) for one in fit.diagnosis.channels.values())


@pytest.mark.slow
def test_slopes_of_the_objective_are_exact() -> None:
    """By parameters and by the initial heel and roll rate of each window."""
    own = begun_as(problem(), "free")
    assert {"phi", "p"} <= set(own.nuisance.initial)
    objective = TrajectoryObjective.build(own, own.trials, scales(own), window=100.0, dt=1.0, every=5, method="rk4",
                                          threads=1)  # fmt: skip
    p, eta = own.vector.start, np.zeros(objective.nuisances)
    normal = objective.normal(p, eta)
    for k, step in enumerate(1e-5 * p):
        moved = p.copy()
        moved[k] += step
        down = 2.0 * p - moved
        slope = (objective.cost(moved, eta) - objective.cost(down, eta)) / (4.0 * step)
        assert slope == pytest.approx(normal.g[k], rel=1e-4)
    block = normal.blocks[0]
    for k in (6, 7):
        moved = eta.copy()
        moved[block.where[0, k]] += 1e-6
        slope = (objective.cost(p, moved) - objective.cost(p, -moved)) / 4e-6
        assert slope == pytest.approx(block.gradient[0, k], rel=1e-4)


@pytest.mark.slow
def test_windows_begin_at_the_measured_heel() -> None:
    bare = problem("p")
    cut = windows(bare.trials, SHIP.model, Loss(), scales(bare), window=50.0, dt=1.0, every=1)
    assert cut.width == 8
    assert (cut.scale[:, :, 6] > 0).any()
    assert not (cut.scale[:, :, 7] > 0).any()
    first = np.flatnonzero(cut.trial == 0)[1]
    assert cut.state0[first, 6] == bare.trials[0]["phi"][50]
    assert cut.state0[first, 7] == pytest.approx(np.gradient(bare.trials[0]["phi"])[50])


def test_a_prediction_restarts_at_the_measured_heel_and_has_heel() -> None:
    found = replay(SHIP, log("zigzag"), restart=60.0)
    assert set(found.channels) == set(SHIP.model.motion)
    assert found["phi"][60] == log("zigzag")["phi"][60]
    assert float(np.sqrt(np.mean((found["phi"] - log("zigzag")["phi"]) ** 2))) < 4.0 * NOISE["phi"]


@pytest.mark.slow
def test_a_log_without_heel_is_warned_of_and_sigma_of_an_unknown_channel_refused() -> None:
    said = [one.text for one in lint(problem("phi", "p"))]
    assert any("no heel" in text for text in said)
    assert not any("no heel" in one.text for one in lint(problem()))
    plane = replace(problem(), ship=load("kvlcc2_l7"), loss=Loss({"phi": 0.01}))
    assert any("phi" in one.text and one.severity == "error" for one in lint(plane))
    with pytest.raises(StudyError, match="phi"):
        Trajectory().fit(replace(plane, free=(Free("hull.Y_v", -0.3),)))
