"""Filters on virtual trials of which the truth is known: velocities, consistency, parameters, alarms."""

import math

import casadi as ca
import numpy as np
import pytest

from seatrial.core.parameters import Free, read
from seatrial.data import Trial
from seatrial.engine.trace import right_hand_side
from seatrial.identify.filters.filtering import Kalman
from seatrial.identify.filters.measurement import Antenna, Heading, Rate
from seatrial.manoeuvres.straight import Straight
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.sensors import Sensors
from seatrial.ships.files import load
from seatrial.simulate.loop import open_loop, open_loop_parameters
from seatrial.simulate.replay import inputs
from seatrial.simulate.run import simulate

TUG, NOMOTO = load("qiuxin5"), load("zeefakkel")
KINDS = pytest.mark.parametrize("kind", ["ekf", "ukf"])
NOISE = {"x": 0.02, "y": 0.02, "psi": 0.002, "r": 0.002}
SENSORS = {"gnss": Antenna(0.02), "compass": Heading(0.002), "gyro": Rate(0.002)}
WALK = {"u": 0.01, "v_m": 0.01, "r": 0.005}
SPREAD = {"x": 0.1, "y": 0.1, "psi": 0.02, "u": 0.1, "v_m": 0.05, "r": 0.02}
RUNS = 32


def zigzag(n_P=7.0):
    return Zigzag(n_P=n_P, delta=math.radians(20), psi=math.radians(20))


class Sea:
    """Many runs at once of one ship under given controls and random accelerations."""

    def __init__(self, ship, base, fine=4):
        """The controls of `base` hold from row to row; each row is integrated in `fine` steps."""
        system = open_loop(ship)
        rhs = right_hand_side(system)
        z, a, p = (ca.MX.sym("i", *rhs.size_in(i)) for i in range(3))
        dt = base.dt / fine
        k1 = rhs(z, a, p)
        k2 = rhs(z + dt / 2 * k1, a, p)
        k3 = rhs(z + dt / 2 * k2, a, p)
        k4 = rhs(z + dt * k3, a, p)
        step = ca.Function("step", [z, a, p], [z + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])
        self.step, self.dt, self.fine = step.map("runs", "serial", RUNS, [1, 2], []), dt, fine
        self.ship, self.names, self.values = ship, system.parameters, open_loop_parameters(ship)
        kept = {n: base[n] for n in ship.model.controls}
        self.base = Trial("run", base.t, kept, meta={"held": list(kept)})
        self.acting = inputs(self.base, ship.model)
        self.start = np.array([base[n][0] for n in ("x", "y", "psi", "u", "v_m", "r")])

    def runs(self, rng, walk=WALK, jump=None, spread=SPREAD):
        """True states, shape (RUNS, rows, 6); `jump` is (time, path, value)."""
        q = np.array([0.0, 0.0, 0.0, walk["u"], walk["v_m"], walk["r"]])
        sd = np.array(list(spread.values()))
        state = self.start + sd * rng.normal(size=(RUNS, 6))
        out, values = [state], self.values.copy()
        for k in range(len(self.base) - 1):
            if jump and self.base.t[k] >= jump[0] - 1e-9:
                values[self.names.index(jump[1])] = jump[2]
            for _ in range(self.fine):
                # half of the noise before the step and half after it: right to second order
                state = state + q * math.sqrt(self.dt / 2) * rng.normal(size=state.shape)
                state = np.asarray(self.step(state.T, self.acting[k], values)).T
                state = state + q * math.sqrt(self.dt / 2) * rng.normal(size=state.shape)
            out.append(state)
        return np.stack(out, axis=1)

    def measured(self, states, rng):
        """One run as the sensors read it."""
        columns = dict(zip(("x", "y", "psi", "u", "v_m", "r"), states.T, strict=True))
        return Sensors(NOISE).read(self.base.having(**columns), rng)

    def prior(self):
        return {n: (m, s) for (n, s), m in zip(SPREAD.items(), self.start, strict=True)}


@pytest.fixture(scope="module")
def sea():
    return Sea(TUG, simulate(TUG, zigzag(), duration=48.0, dt=0.01, every=20, speed=0.9))


@pytest.fixture(scope="module")
def truth(sea):
    return sea.runs(np.random.default_rng(11))


def finite_differences(trial):
    north, east = np.gradient(trial["x"], trial.t), np.gradient(trial["y"], trial.t)
    c, s = np.cos(trial["psi"]), np.sin(trial["psi"])
    return {"u": north * c + east * s, "v_m": east * c - north * s}


def rms(a, b):
    return float(np.sqrt(np.mean((a - b) ** 2)))


@pytest.mark.long
@pytest.mark.parametrize(("kind", "every"), [("ekf", 10), ("ekf", 20), ("ukf", 20)])
@pytest.mark.parametrize("policy", [zigzag(), Turning(n_P=6.0, delta=math.radians(-35)), Straight(n_P=8.0)],
                         ids=["zigzag", "turn", "straight"])  # fmt: skip
def test_velocities_are_at_least_three_times_better_than_differences(policy, kind, every):
    """Starts unknown, process noise as for a model that is a little wrong."""
    true = simulate(TUG, policy, duration=60.0, dt=0.01, every=every, speed=0.9)
    trial = Sensors(NOISE).read(true, np.random.default_rng(every))
    found = Kalman(SENSORS, WALK, kind=kind).run(TUG, trial)
    rough = finite_differences(trial)
    for name in ("u", "v_m"):
        bar = rms(rough[name], true[name]) / 3.0
        assert rms(found.trial()[name], true[name]) < bar
        assert rms(found.smoothed().trial()[name], true[name]) < bar


@KINDS
@pytest.mark.long
def test_nees_and_nis_lie_in_their_bands(sea, truth, kind):
    """Random accelerations, random starts: errors and innovations are as large as the filter says."""
    from scipy.stats import chi2

    rng = np.random.default_rng(5)
    tracker = Kalman(SENSORS, WALK, kind=kind, start=sea.prior()).prepared(TUG)
    nees, late, nis = [], [], []
    for states in truth:
        found = tracker.run(sea.measured(states, rng))
        nis.append(found.nis)
        for run, into in ((found, nees), (found.smoothed(), late)):
            miss = run.states - states
            into.append(np.einsum("ki,kij,kj->k", miss, np.linalg.inv(run.covariances), miss))
    low, high = chi2.ppf([0.025, 0.975], 6 * RUNS) / RUNS
    for each in (nees, late):
        mean = np.mean(each, axis=0)
        assert np.mean((mean > low) & (mean < high)) > 0.9
        # rows 10 s apart are nearly independent
        some = np.array(each)[:, ::50]
        assert chi2.ppf(0.025, 6 * some.size) < some.sum() < chi2.ppf(0.975, 6 * some.size)
    nis = np.array(nis)
    assert chi2.ppf(0.025, 4 * nis.size) < nis.sum() < chi2.ppf(0.975, 4 * nis.size)


@pytest.mark.long
@KINDS
def test_parameters_of_the_tug_come_back_within_three_sigma(sea, truth, kind):
    """Surge and yaw damping, drawn with the priors' own spread; stated sigma is the true one."""
    rng, priors = np.random.default_rng(6), {"damping.X_u": 3.0, "damping.N_r": 6.0}
    errors = []
    for states in truth[:10]:
        free = tuple(Free(p, v, -100.0, 0.0, v, s) for p, s in priors.items()
                     for v in [read(TUG.model, p) + s * rng.normal()])  # fmt: skip
        found = Kalman(SENSORS, WALK, free, kind=kind, start=sea.prior()).run(TUG, sea.measured(states, rng))
        errors.append([(got.value - read(TUG.model, p)) / got.sigma for p, got in found.parameters.items()])
        assert all(v.status == "identified" for v in found.verdicts[1:] if v.subject == "damping.N_r")
    assert np.abs(errors).max() < 3.0
    assert 0.7 < np.sqrt(np.mean(np.square(errors))) < 1.35


@pytest.mark.long
@KINDS
def test_K_and_T_of_a_nomoto_ship_come_back_within_three_sigma(kind):
    """Heading and rate of turn alone, the speed known."""
    zigzag = Zigzag(n_P=1.0, delta=math.radians(10), psi=math.radians(10))
    true = simulate(NOMOTO, zigzag, duration=200.0, dt=0.05, every=10)
    start = {"x": (0.0, 1.0), "y": (0.0, 1.0), "u": (5.0, 0.0), "v_m": (0.0, 0.0)}
    free = (Free("K", 0.4, 0.0, 2.0, 0.4, 0.15), Free("T", 40.0, 5.0, 200.0, 40.0, 15.0))
    sensors = {"compass": Heading(0.002), "gyro": Rate(0.0005)}
    errors = []
    for seed in range(8):
        trial = Sensors({"psi": 0.002, "r": 0.0005}).read(true, np.random.default_rng(seed))
        found = Kalman(sensors, {"r": 1e-6}, free, kind=kind, start=start).run(NOMOTO, trial)
        errors.append([(found.parameters[p].value - read(NOMOTO.model, p)) / found.parameters[p].sigma for p in "KT"])
        assert all(v.status == "identified" for v in found.verdicts[1:])
    assert np.abs(errors).max() < 3.0


@pytest.mark.long
def test_the_innovation_test_is_silent_on_the_right_model_as_designed(sea, truth):
    """At a false alarm in ten trials it rings as often as a binomial of 0.1 does (central 98 %)."""
    from scipy.stats import binom

    rng = np.random.default_rng(8)
    tracker = Kalman(SENSORS, WALK, start=sea.prior(), false_alarm=0.1).prepared(TUG)
    rung = sum(not tracker.run(sea.measured(states, rng)).consistency.fits for states in truth)
    assert binom.ppf(0.01, RUNS, 0.1) <= rung <= binom.ppf(0.99, RUNS, 0.1)


@pytest.mark.long
def test_the_innovation_test_speaks_when_a_parameter_jumps(sea):
    """A yaw damping 30 % greater, or a third of one thruster's pull, from 25 s on; and tells when."""
    rng = np.random.default_rng(9)
    tracker = Kalman(SENSORS, WALK, start=sea.prior()).prepared(TUG)
    for path, value in (("damping.N_r", 1.3), ("thrusters.1.c_2", 0.3)):
        jump = (25.0, path, value * read(TUG.model, path))
        found = [tracker.run(sea.measured(states, rng)) for states in sea.runs(rng, jump=jump)[:8]]
        for run in found:
            assert not run.consistency.fits, path
            assert 20.0 <= run.consistency.since < 30.0
            assert "no longer fits" in run.verdicts[0].text


@pytest.mark.slow
def test_a_parameter_that_may_walk_follows_a_jump(sea):
    rng = np.random.default_rng(10)
    jump = (25.0, "damping.N_r", 2.0 * read(TUG.model, "damping.N_r"))
    free = (Free("damping.N_r", -26.7, -200.0, 0.0, -26.7, 5.0),)
    states = sea.runs(rng, jump=jump)[0]
    found = Kalman(SENSORS, WALK | {"damping.N_r": 3.0}, free, start=sea.prior()).run(TUG, sea.measured(states, rng))
    values, sd = found.of("damping.N_r")
    assert abs(values[-1] - jump[2]) < 3.0 * sd[-1]
    assert abs(values[120] - jump[2] / 2.0) < 3.0 * sd[120]
    assert values[120] - values[-1] > 10.0
