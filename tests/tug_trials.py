"""The tug of You 2023: the 12 manoeuvres of its Table 2 sailed by the ship of Table 3, read by noisy sensors."""

import math

import numpy as np

from seatrial.core.parameters import Free, specs, values
from seatrial.identify import Loss, Problem
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models import STATES
from seatrial.sensors import Sensors
from seatrial.ships.files import load
from seatrial.simulate.replay import replay
from seatrial.simulate.run import simulate

TRUTH = load("qiuxin5")
NOISE = {"x": 0.02, "y": 0.02, "psi": math.radians(0.2), "u": 0.01, "v_m": 0.01, "r": math.radians(0.2)}
NAMES = tuple(p for p, v in values(TRUTH.model).items() if p.startswith(("inertia", "damping")) and v != 0.0)
TRUE = np.array([values(TRUTH.model)[p] for p in NAMES])
# You 2023 Eq. 17: masses by empirical formulas, everything else from zero.
EMPIRICAL = {"inertia.m_11": 196.98, "inertia.m_22": 254.0454, "inertia.m_33": 220.1974}
COLD = np.array([EMPIRICAL.get(p, 0.0) for p in NAMES])
RPS = (3.0, 5.0, 7.0, 10.0)
DT, ROWS = 0.2, (366,) * 10 + (365,) * 2


def policies():
    """Straight lines, +20+20 zigzags (heading/angle), and turns at 10 to 30 deg, each at four speeds."""
    ten = math.radians(10.0)
    straight = [Turning(n_P=n, delta=0.0) for n in RPS]
    zigzags = [Zigzag(n_P=n, delta=2 * ten, psi=2 * ten) for n in RPS]
    turns = [Turning(n_P=n, delta=-math.radians(a)) for n, a in zip(RPS, (10, 15, 20, 30), strict=True)]
    return [*straight, *zigzags, *turns]


def sailed(environment=None):
    """12 runs without noise, 4390 samples at 0.2 s; straight lines start from rest, the others from slow ahead."""
    runs = []
    for k, (policy, rows) in enumerate(zip(policies(), ROWS, strict=True)):
        run = simulate(TRUTH, policy, speed=0.0 if k < 4 else 0.5, duration=(rows - 1) * DT, dt=DT,
                       environment=environment, name=f"run_{k + 1}")  # fmt: skip
        # One Runge-Kutta step of 0.2 s is too long for a tug of 2 m: its motion between rows in steps that suit it.
        exact = replay(TRUTH, run)
        runs.append(run.having(**{name: exact[name] for name in STATES}))
    return tuple(runs)


def trials(seed=0, environment=None):
    """As recorded."""
    rng = np.random.default_rng(seed)
    return tuple(Sensors(NOISE).read(run, rng) for run in sailed(environment))


def problem(seed=0, start=None, recorded=None):
    """All 22 parameters free within what they can be."""
    start = COLD if start is None else start
    meaning = specs(TRUTH.model)
    start = np.array([np.clip(v, meaning[p].low, meaning[p].high) for p, v in zip(NAMES, start, strict=True)])
    free = tuple(Free(p, float(v), meaning[p].low, meaning[p].high) for p, v in zip(NAMES, start, strict=True))
    ship = TRUTH.having({p: float(v) for p, v in zip(NAMES, start, strict=True)})
    return Problem(ship, recorded or trials(seed), free, Loss(NOISE, correlation=0.0))
