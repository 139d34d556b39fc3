"""A single zigzag tunes a ship by the gradient with priors, within a limit that is said."""

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.core.parameters import near, read
from seatrial.data import Trial
from seatrial.identify import Problem
from seatrial.identify.lint import lint
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

pytestmark = pytest.mark.slow

SHIP = load("kvlcc2_l7")
PATHS = ("hull.Y_v", "hull.Y_r", "hull.N_v", "hull.N_r", "hull.R_0", "rudder.a_H", "rudder.x_H", "rudder.t_R",
         "hull.Y_vvr", "hull.N_vvr", "hull.N_vrr", "hull.N_rrr")  # fmt: skip
NOISE = {"x": 0.02, "y": 0.02, "psi": 0.003, "u": 0.01, "v_m": 0.01, "r": 0.002}
DEG, N_P = math.radians(1.0), 10.4


def _advance(ship: Ship) -> float:
    turn = Turning(N_P, 35.0 * DEG)
    return float(turn.indices(simulate(ship, turn, duration=80.0, dt=0.2), ship.L_pp)["advance"].value)


def test_one_zigzag_with_priors_predicts_a_turn_that_it_has_not_seen() -> None:
    rng = np.random.default_rng(5)
    start = {f.path: f.start for f in near(SHIP.model, *PATHS, ratio=0.1)}
    truth = SHIP.having({path: value * (1.0 + 0.15 * rng.choice((-1, 1))) for path, value in start.items()})
    run = simulate(truth, Zigzag(N_P, 20.0 * DEG, 20.0 * DEG), duration=100.0, dt=0.2, name="zigzag")
    noisy = {name: run[name] + rng.normal(0.0, level, len(run)) for name, level in NOISE.items()}
    trial = Trial("zigzag", run.t, {**noisy, "delta": run["delta"], "n_P": run["n_P"]}, meta={"kind": "zigzag"})
    free = tuple(replace(f, low=-math.inf, high=math.inf, sigma=0.3 * abs(f.start))
                 for f in near(SHIP.model, *PATHS, ratio=0.1))  # fmt: skip
    problem = Problem(SHIP, (trial,), free)
    (said,) = [one for one in lint(problem, felt=False) if one.where == "trials"]
    assert said.severity == "warning"
    assert "all but zigzag at its speeds and rudder angles is extrapolation" in said.text
    fit = Trajectory().fit(problem)
    off = np.abs(fit.values - [read(truth.model, path) for path in PATHS]) / fit.sigma
    assert (off < 3.5).all()
    before, after, right = (_advance(ship) for ship in (SHIP, fit.ship, truth))
    assert abs(before / right - 1.0) > 0.05
    assert abs(after / right - 1.0) < 0.02
