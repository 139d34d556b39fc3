"""Recovery of masses and damping of the Otter from manoeuvres by unequal thrust, measured with noise."""

import math

import numpy as np
import pytest

from seatrial.core.parameters import Free, specs, values
from seatrial.forces import HARD_OVER
from seatrial.identify import Loss, Problem
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.sensors import Sensors
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

pytestmark = pytest.mark.long

TRUTH = load("otter")
NOISE = {"x": 0.02, "y": 0.02, "psi": math.radians(0.2), "u": 0.01, "v_m": 0.01, "r": math.radians(0.2)}
NAMES = ("inertia.m_11", "inertia.m_22", "inertia.m_33", "damping.X_u", "damping.N_r", "damping.N_rr", "damping.C_D")
TRUE = np.array([values(TRUTH.model)[name] for name in NAMES])


def trials(seed):
    """Zigzags and turns, 20 s each at 25 rows a second, as the thrust goes with the square of a lagging shaft."""
    policies = [
        Zigzag(n_P=8.0, delta=0.4 * HARD_OVER, psi=math.radians(20.0)),
        Zigzag(n_P=11.0, delta=0.3 * HARD_OVER, psi=math.radians(10.0), side=-1.0),
        Turning(n_P=8.0, delta=0.5 * HARD_OVER), Turning(n_P=12.0, delta=-0.25 * HARD_OVER),
    ]  # fmt: skip
    rng = np.random.default_rng(seed)
    runs = [simulate(TRUTH, policy, speed=1.0, duration=20.0, dt=0.02, every=2, name=f"run_{k}")
            for k, policy in enumerate(policies)]  # fmt: skip
    return tuple(Sensors(NOISE).read(run, rng) for run in runs)


def test_masses_and_damping_come_back_within_three_sigma():
    meaning = specs(TRUTH.model)
    start = TRUE * np.array([1.3, 0.8, 1.4, 0.7, 1.5, 0.6, 0.7])
    free = tuple(Free(name, float(v), meaning[name].low, meaning[name].high)
                 for name, v in zip(NAMES, start, strict=True))  # fmt: skip
    ship = TRUTH.having({name: float(v) for name, v in zip(NAMES, start, strict=True)})
    told = Problem(ship, trials(1), free, Loss(NOISE, correlation=0.0))
    fit = Trajectory(window=5.0, initial="free", every=5).fit(told)
    assert np.abs((fit.values - TRUE) / fit.sigma).max() < 3.0
    assert (fit.sigma / np.abs(TRUE)).max() < 0.2
    assert np.abs(fit.values / TRUE - 1.0).max() < 0.2
