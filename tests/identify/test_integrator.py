"""One integrator: what a ship sails between two rows of a log, every fit, score and replay sails too.

The logs are made from what acted: controls and environment, held from row to row with the mean of the two, and the
ship's motion under just these in steps so fine that finer ones change nothing.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.core.parameters import Free, values
from seatrial.data import Trial
from seatrial.engine.rollout import simulator
from seatrial.identify import Loss, Problem
from seatrial.identify.population.evolution import Evolution, Scoring
from seatrial.identify.shooting.logo import Shooting
from seatrial.identify.trajectory.multistart import MultiStart
from seatrial.identify.trajectory.objective import TrajectoryObjective
from seatrial.identify.trajectory.shooting import OneStep, Trajectory
from seatrial.identify.tuning.fine_tuning import FineTuning
from seatrial.manoeuvres import Settings
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models import STATES
from seatrial.models.settled import unseen
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.approach import substeps, time_step
from seatrial.simulate.loop import open_loop, open_loop_parameters
from seatrial.simulate.replay import inputs, replay
from seatrial.simulate.run import approach, simulate

# What ordinary sensors read, for a ship of 100 m at 5 m/s: they scale with the ship.
NOISE = {"x": 0.5, "y": 0.5, "psi": math.radians(0.1), "u": 0.02, "v_m": 0.02, "r": math.radians(0.02)}
FAMILIES = {
    "kvlcc2": ("hull.Y_v", "hull.Y_r", "hull.Y_vvr", "hull.N_v"),
    "kvlcc2_l7": ("hull.Y_v", "hull.Y_r", "hull.Y_vvr", "hull.N_v"),
    "esso_osaka_3m": ("hull.Y_v", "hull.Y_r", "hull.N_v", "hull.N_r"),
    "esso_osaka_3m_hybrid": ("hull.Y_v", "hull.Y_r", "hull.N_v", "hull.N_r"),
    "twin_virtual": ("hull.Y_v", "hull.Y_r", "hull.N_v", "hull.N_r"),
    "mariner": ("derivatives.X_u", "derivatives.Y_v", "derivatives.Y_r", "derivatives.N_r"),
    "modified_abkowitz_kvlcc2_l7": ("derivatives.Y_v", "derivatives.Y_r", "derivatives.N_v", "derivatives.N_r"),
    "esso_190k_tanker": ("Y_uv", "Y_T", "N_uv", "N_T"),
    "cybership2": ("damping.X_u", "damping.Y_v", "damping.Y_r", "damping.N_r"),
    "milliampere_aft": ("damping.X_u", "damping.Y_v", "damping.Y_r", "damping.N_r"),
    "qiuxin5": ("damping.X_u", "damping.Y_v", "damping.Y_r", "damping.N_r"),
    "mariner_nomoto": ("K", "T"),
    "zeefakkel": ("K", "T"),
    "mariner_nomoto2": ("K", "T_1", "T_3"),
}


def sensors(ship: Ship) -> dict[str, float]:
    """Deviations of ordinary sensors on a ship of this size and speed."""
    size, pace = ship.L_pp / 100.0, ship.speed / 5.0
    scale = {"x": size, "y": size, "psi": 1.0, "u": pace, "v_m": pace, "r": min(1.0 / size, 10.0)}
    return {name: scale[name] * sd for name, sd in NOISE.items()}


def logged(ship: Ship, dt: float, lengths: float = 20.0) -> Trial:
    """A 20/20 zigzag without noise, a row every `dt` [s]."""
    U, n_P = approach(ship)
    limit = float(getattr(ship.actuators.rudder, "high", math.inf))
    angle = min(math.radians(20.0), limit)
    policy = Zigzag.ordered(Settings(n_P, U, ship.L_pp, limit, angle, angle, 1.0))
    step = dt / math.ceil(dt / time_step(ship) - 1e-9)
    duration = dt * round(max(lengths * ship.L_pp / U, 60 * dt) / dt)
    run = simulate(ship, policy, duration=duration, dt=step, every=round(dt / step))
    return sailed(ship, run, math.ceil(4.0 * dt / time_step(ship)))


def sailed(ship: Ship, run: Trial, fine: int) -> Trial:
    """The run under what acts from row to row, in `fine` steps each."""
    series = inputs(run, ship.model)
    begun = np.append(run.stack(*STATES)[0], unseen(ship.model, series, run.dt)[0])
    out = simulator(open_loop(ship)).run(
        begun[None], np.repeat(series, fine, axis=0)[None], open_loop_parameters(ship), dt=run.dt / fine,
        steps=(len(run) - 1) * fine + 1, every=fine,
    )  # fmt: skip
    return run.having(**{name: out.values[0, :, k] for k, name in enumerate(STATES)})


def problem(ship: Ship, paths: tuple[str, ...], *trials: Trial, off: float = 1.05) -> Problem:
    """Its parameters free, sought from values that are 5 % off."""
    known = values(ship.model)
    wrong = {path: off * known[path] for path in paths}
    free = tuple(Free(path, value, *sorted((0.5 * value, 1.5 * value))) for path, value in wrong.items())
    return Problem(ship.having(wrong), trials, free, Loss(sensors(ship), correlation=0.0))


def recovered(ship: Ship, paths: tuple[str, ...], dt: float, lengths: float = 20.0) -> tuple[np.ndarray, np.ndarray]:
    """Errors of a fit to noise-free data: relative, and over the deviations that ordinary sensors would leave."""
    run = logged(ship, dt, lengths)
    posed = problem(ship, paths, run)
    fit = Trajectory(
        window=run.duration, every=1, tolerance=1e-13, iterations=60, initial="measured"
    ).fit(posed)  # fmt: skip
    true = np.array([values(ship.model)[path] for path in paths])
    found = TrajectoryObjective.build(posed, posed.trials, posed.loss.sigma, window=run.duration, dt=dt, every=1,
                                      method="rk4", threads=1)  # fmt: skip
    deviation = np.sqrt(np.diag(np.linalg.inv(found.normal(true, np.zeros(0)).H)))
    return np.abs(fit.values / true - 1.0), np.abs(fit.values - true) / deviation


@pytest.mark.slow
def test_a_tanker_logged_at_one_second_gives_its_coefficients_back() -> None:
    """Once .48 % off, stated as .039 %: Euler steps of 1 s in the fit, Runge-Kutta in the ship."""
    relative, deviations = recovered(load("kvlcc2"), FAMILIES["kvlcc2"][:2], 1.0, 8.0)
    assert relative.max() < 1e-5
    assert deviations.max() < 0.05


@pytest.mark.long
@pytest.mark.parametrize("dt", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("name", FAMILIES)
def test_every_family_gives_its_parameters_back(name: str, dt: float) -> None:
    relative, deviations = recovered(load(name), FAMILIES[name], dt)
    assert (np.minimum(relative / 1e-6, deviations / 0.05) < 1.0).all(), (relative, deviations)


@pytest.mark.slow
def test_what_replays_also_fits_and_scores() -> None:
    """A model of 7 m logged at 1 s, which one step a row cannot follow: nothing is left for anyone who scores it."""
    ship = load("kvlcc2_l7")
    assert substeps(ship, 1.0) > 1
    posed = problem(ship, FAMILIES["kvlcc2_l7"][:2], logged(ship, 1.0), off=1.0)
    (run,) = posed.trials
    true = np.array([f.start for f in posed.free])
    again = replay(ship, run)
    for name, sd in sensors(ship).items():
        assert again[name] == pytest.approx(run[name], abs=0.02 * sd), name
    given = {"window": 40.0, "dt": 1.0, "every": 2, "method": "rk4", "threads": 1}
    parts = posed, posed.trials, posed.loss.sigma
    smooth = TrajectoryObjective.build(*parts, **given)
    nothing = 1e-4 * smooth.windows.samples
    assert smooth.cost(true, np.zeros(0)) < nothing
    assert Scoring.build(*parts, **given).batch(1).costs(true[None])[0] < nothing
    rough = TrajectoryObjective.build(*parts, **{**given, "method": "euler"}).cost(true, np.zeros(0))
    assert rough > 100 * nothing


@pytest.mark.parametrize(
    "estimator",
    [Trajectory(), OneStep(), MultiStart(), Evolution(), FineTuning(), FineTuning().evolution(),
     FineTuning().gradient(60.0), Shooting()],
    ids=lambda estimator: type(estimator).__name__,
)
def test_every_estimator_steps_as_simulate_does_unless_told_otherwise(estimator: object) -> None:
    assert estimator.method == "rk4"  # type: ignore[attr-defined]


def test_a_step_that_suits_no_ship_is_divided() -> None:
    """By size, speed and stiffness, as `simulate` chooses its own; a single step where the log is fine enough."""
    small, large = load("kvlcc2_l7"), load("kvlcc2")
    assert substeps(large, 1.0) == 1 == substeps(small, 0.1)
    assert substeps(small, 10.0) == pytest.approx(10 * substeps(small, 1.0), rel=0.2)
    assert substeps(small, 10.0, "euler") == 1
    assert substeps(load("kvlcc2_l7_arx"), 10.0) == 1
