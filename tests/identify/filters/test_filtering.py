"""Kalman filters against the textbook: linear cases to rounding, then lever arms, delays, gaps and bounds."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import block_diag, expm

from seatrial.core.parameters import Free, ParameterError
from seatrial.data import DataError, Trial
from seatrial.environment import Environment, Uniform
from seatrial.identify import StudyError
from seatrial.identify.filters.filtered import innovation_test
from seatrial.identify.filters.filtering import Kalman, inside
from seatrial.identify.filters.kalman import _root
from seatrial.identify.filters.measurement import Antenna, Heading, Log, Rate
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.sensors import Sensors
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

TUG = load("qiuxin5")
KINDS = pytest.mark.parametrize("kind", ["ekf", "ukf"])
NOISE = {"x": 0.02, "y": 0.02, "psi": 0.002, "r": 0.002}
SENSORS = {"gnss": Antenna(0.02), "compass": Heading(0.002), "gyro": Rate(0.002)}
WALK = {"u": 0.002, "v_m": 0.002, "r": 0.001}


@pytest.fixture(scope="module")
def fine():
    zigzag = Zigzag(n_P=7.0, delta=math.radians(20), psi=math.radians(20))
    return simulate(TUG, zigzag, duration=60.0, dt=0.01, speed=0.9)


@pytest.fixture(scope="module")
def true(fine):
    return fine.rows(slice(None, None, 10))


@pytest.fixture(scope="module")
def noisy(true):
    return Sensors(NOISE).read(true, np.random.default_rng(1))


# --- the linear case: Nomoto at a speed that is known -------------------------------------------------

NOMOTO = load("zeefakkel").having({"alpha": 0.0})
Q, SD = 1e-3, (0.01, 0.002)
START = {"x": (0.0, 1.0), "y": (0.0, 1.0), "psi": (0.1, 0.2), "u": (5.0, 0.0), "v_m": (0.0, 0.0), "r": (0.0, 0.02)}


def linear_trial(count=40, seed=3):
    """Uneven times, gaps in either sensor."""
    rng = np.random.default_rng(seed)
    t = np.concatenate([[0.0], np.cumsum(rng.choice([0.1, 0.2, 0.3], count - 1))])
    psi, r = 0.1 * np.sin(0.1 * t) + SD[0] * rng.normal(size=count), rng.normal(size=count) * 0.01
    psi[rng.random(count) < 0.3] = np.nan
    r[rng.random(count) < 0.3] = np.nan
    delta = 0.2 * np.sign(np.sin(0.3 * t))
    channels = {"psi": psi, "r": r, "delta": delta, "n_P": np.ones(count)}
    return Trial("linear", t, channels, meta={"held": ["delta", "n_P"]})


def discrete(dt, delta):
    """Exact move, input and process noise of (psi, r) over dt (Van Loan)."""
    K, T = 0.5, 31.0
    A, b = np.array([[0.0, 1.0], [0.0, -1.0 / T]]), np.array([[0.0], [K / T * delta]])
    whole = expm(np.block([[A, b], [np.zeros((1, 3))]]) * dt)
    loan = expm(np.block([[-A, np.diag([0.0, Q**2])], [np.zeros((2, 2)), A.T]]) * dt)
    return whole[:2, :2], whole[:2, 2], loan[2:, 2:].T @ loan[:2, 2:]


def textbook(trial):
    mean, cov = np.array([0.1, 0.0]), np.diag([0.2**2, 0.02**2])
    means, covs, nis = [], [], []
    for k, t in enumerate(trial.t):
        if k:
            move, push, blur = discrete(t - trial.t[k - 1], trial["delta"][k - 1])
            mean, cov = move @ mean + push, move @ cov @ move.T + blur
        y = np.array([trial["psi"][k], trial["r"][k]])
        H, R = np.eye(2)[np.isfinite(y)], np.diag(np.square(SD))[np.isfinite(y)][:, np.isfinite(y)]
        if len(H):
            S, miss = H @ cov @ H.T + R, y[np.isfinite(y)] - H @ mean
            gain = cov @ H.T @ np.linalg.inv(S)
            nis.append(miss @ np.linalg.inv(S) @ miss)
            mean, cov = mean + gain @ miss, cov - gain @ S @ gain.T
        means.append(mean)
        covs.append(cov)
    return np.array(means), np.array(covs), np.array(nis)


def linear(kind):
    sensors = {"compass": Heading(SD[0]), "gyro": Rate(SD[1])}
    return Kalman(sensors, {"r": Q}, kind=kind, start=START)


@KINDS
def test_a_linear_ship_gives_the_textbook_filter(kind):
    trial = linear_trial()
    found, (means, covs, nis) = linear(kind).run(NOMOTO, trial), textbook(trial)
    at = np.ix_(range(len(trial)), [2, 5], [2, 5])
    np.testing.assert_allclose(found.states[:, [2, 5]], means, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(found.covariances[at], covs, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(found.nis, nis, rtol=1e-8)


def test_sigma_points_do_not_depend_on_rounding():
    """A singular covariance with equal variances: what processors round differently moves no point of the filter."""
    sd = np.array([1.0, 1.0, 0.2, 0.0, 0.0, 0.02])
    like = np.array([[1.0, 0.0, 0.3], [0.0, 1.0, 0.3], [0.3, 0.3, 1.0]])
    cov = np.diag(sd**2)
    cov[:3, :3] = like * np.outer(sd[:3], sd[:3])
    root = _root(cov)
    np.testing.assert_allclose(root @ root.T, cov, atol=1e-15)
    noise = 1e-16 * np.random.default_rng(1).standard_normal((20, 6, 6))
    for wrong in noise:
        np.testing.assert_allclose(_root(cov * (1.0 + wrong + wrong.T)), root, atol=1e-14)
    whole = np.cov(np.random.default_rng(2).standard_normal((6, 50)))
    np.testing.assert_allclose(_root(whole), np.linalg.cholesky(whole), rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize(("kind", "close"), [("ekf", 1e-10), ("ukf", 1e-7)])
def test_the_smoother_is_batch_least_squares(kind, close):
    """Start, every process noise and every reading as one Gaussian problem, solved at once.

    Sigma points see that the track is not linear in the heading; hence their wider tolerance.
    """
    trial = linear_trial(count=15)
    moves = [discrete(b - a, d) for a, b, d in zip(trial.t, trial.t[1:], trial["delta"], strict=False)]
    n = 2 * len(trial)
    carry, push = np.eye(n), np.zeros(n)
    push[:2] = 0.1, 0.0
    for k, (move, offset, _) in enumerate(moves, 1):
        rows, before = slice(2 * k, 2 * k + 2), slice(2 * k - 2, 2 * k)
        carry[rows, : 2 * k] = move @ carry[before, : 2 * k]
        push[rows] = move @ push[before] + offset
    prior = carry @ block_diag(np.diag([0.2**2, 0.02**2]), *(blur for *_, blur in moves)) @ carry.T
    y = trial.stack("psi", "r").ravel()
    good = np.isfinite(y)
    spread = prior[good][:, good] + np.diag(np.tile(np.square(SD), len(trial))[good])
    gain = prior[:, good] @ np.linalg.inv(spread)
    mean, cov = push + gain @ (y - push)[good], prior - gain @ prior[good]
    found = linear(kind).run(NOMOTO, trial).smoothed()
    np.testing.assert_allclose(found.states[:, [2, 5]].ravel(), mean, rtol=0.0, atol=close)
    variance = np.diagonal(found.covariances, axis1=1, axis2=2)[:, [2, 5]].ravel()
    np.testing.assert_allclose(variance, np.diag(cov), rtol=1e4 * close)
    assert found.smoothed() is found


def test_a_singular_covariance_has_one_square_root():
    """Rounding decides nothing: a state known exactly adds no spread, and another order of summation the same root."""
    rng = np.random.default_rng(3)
    half = rng.normal(size=(5, 3))
    cov, again = half @ half.T, sum(np.outer(column, column) for column in half.T[::-1])
    one, two = _root(cov), _root(again)
    np.testing.assert_allclose(one @ one.T, cov, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(one, two, rtol=0.0, atol=1e-12)
    assert not _root(np.zeros((3, 3))).any()


def test_iterating_changes_nothing_where_readings_are_linear():
    trial = linear_trial()
    once, often = linear("ekf").run(NOMOTO, trial), replace(linear("ekf"), iterations=3).run(NOMOTO, trial)
    np.testing.assert_allclose(often.states, once.states, rtol=0.0, atol=1e-12)


# --- the tug --------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_ekf_and_ukf_agree_on_a_mildly_nonlinear_ship(noisy):
    one, two = (Kalman(SENSORS, WALK, kind=kind).run(TUG, noisy) for kind in ("ekf", "ukf"))
    sd = np.sqrt(np.diagonal(one.covariances, axis1=1, axis2=2))
    assert (np.abs(one.states - two.states) / sd)[50:].max() < 0.15
    one, two = one.smoothed(), two.smoothed()
    assert (np.abs(one.states - two.states) / sd)[50:].max() < 0.15


def raw(fine, *, x, y, delay):
    """What an antenna at (x, y) delivers `delay` s late on rows 0.1 s apart; psi wrapped as a compass does."""
    back = round(delay / 0.01)
    north = fine["x"] + x * np.cos(fine["psi"]) - y * np.sin(fine["psi"])
    east = fine["y"] + x * np.sin(fine["psi"]) + y * np.cos(fine["psi"])
    late = {"x": north, "y": east}
    late = {name: np.concatenate([np.full(back, np.nan), v[: len(v) - back]]) for name, v in late.items()}
    trial = fine.having(**late).rows(slice(None, None, 10))
    return Sensors(NOISE).read(trial, np.random.default_rng(5))


def errors(found, true, skip=50):
    got = found.trial()
    return {name: float(np.sqrt(np.mean((got[name] - true[name])[skip:] ** 2))) for name in ("x", "y", "u", "v_m")}


@pytest.mark.long
@KINDS
def test_lever_arm_and_delay_are_taken_out(fine, true, kind):
    """A delay of 0.25 s falls between the rows; 0.9 m/s make 0.22 m of it."""
    trial = raw(fine, x=0.7, y=-0.2, delay=0.25)
    right = SENSORS | {"gnss": Antenna(0.02, x=0.7, y=-0.2, delay=0.25)}
    found = Kalman(right, WALK, kind=kind).run(TUG, trial)
    assert found.consistency.fits
    ideal = errors(Kalman(SENSORS, WALK).run(TUG, raw(fine, x=0.0, y=0.0, delay=0.0)), true)
    for name, error in errors(found, true).items():
        assert error < 2.0 * ideal[name], name
    blind = Kalman(SENSORS | {"gnss": Antenna(0.02, delay=0.25)}, WALK, kind=kind).run(TUG, trial)
    assert errors(blind, true)["x"] > 0.4
    late = Kalman(SENSORS | {"gnss": Antenna(0.02, x=0.7, y=-0.2)}, WALK, kind=kind).run(TUG, trial)
    assert errors(late, true)["x"] > 0.1


@KINDS
@pytest.mark.slow
def test_gaps_and_uneven_rows_are_bridged(noisy, true, kind):
    rng = np.random.default_rng(0)
    kept = np.sort(rng.choice(len(true), 450, replace=False))
    trial, truth = noisy.rows(kept), true.rows(kept)
    lost = (trial.t > 30.0) & (trial.t < 40.0)
    trial = trial.having(**{n: np.where(lost, np.nan, trial[n]) for n in ("x", "y", "psi", "r")})
    found = Kalman(SENSORS, WALK, kind=kind).run(TUG, trial)
    for run in (found, found.smoothed()):
        out = run.trial()
        for name in ("x", "y", "psi", "u", "v_m", "r"):
            assert np.isfinite(out[name]).all()
            # uneven rows see the controls in steps, hence the floor
            assert (np.abs(out[name] - truth[name]) < 5.0 * out[f"{name}_sd"] + 2e-3)[50:].all(), name
    sd = found.of("x")[1]
    assert sd[lost][-1] > 2.0 * sd[~lost][-1]
    assert found.smoothed().of("x")[1][lost].max() < sd[lost].max()


@pytest.mark.long
def test_a_heading_that_jumps_by_a_turn_is_the_same_heading(noisy):
    jumping = noisy.having(psi=noisy["psi"] + 2.0 * math.pi * (np.arange(len(noisy)) // 7 % 3))
    for kind in ("ekf", "ukf"):
        kalman = Kalman(SENSORS, WALK, kind=kind)
        np.testing.assert_allclose(kalman.run(TUG, jumping).states, kalman.run(TUG, noisy).states, atol=1e-9)


@pytest.mark.slow
def test_a_current_is_found_and_stands_in_the_trial():
    zigzag = Zigzag(n_P=7.0, delta=math.radians(20), psi=math.radians(20))
    true = simulate(TUG, zigzag, duration=60.0, dt=0.01, every=10, speed=0.9, environment=Uniform(U_C=0.2, gamma_C=1.0))
    bare = replace(true, channels={n: v for n, v in true.channels.items() if n not in ("U_C", "gamma_C")})
    trial = Sensors(NOISE).read(bare, np.random.default_rng(2))
    found = Kalman(SENSORS, WALK | {"current": 1e-4}, current=True).run(TUG, trial)
    for name, value in zip(("x", "y"), (0.2 * math.cos(1.0), 0.2 * math.sin(1.0)), strict=True):
        got = found.parameters[f"environment.current_{name}"]
        assert abs(got.value - value) < 3.0 * got.sigma < 0.05
    assert found.smoothed().trial()["U_C"] == pytest.approx(0.2, abs=0.02)
    assert found.trial().meta["processing"][-1].startswith("motion from a Kalman filter")
    # what the trial says itself is not found a second time
    told = Kalman(SENSORS, WALK, current=True).run(TUG, trial.having(U_C=true["U_C"], gamma_C=true["gamma_C"]))
    assert abs(told.parameters["environment.current_x"].value) < 0.02
    assert told.trial()["U_C"][-1] == pytest.approx(0.2, abs=0.02)


@pytest.mark.slow
@KINDS
def test_a_parameter_stays_within_its_bounds_and_the_verdict_says_so(noisy, kind):
    free = Free("damping.N_r", -20.0, -22.0, -10.0, -20.0, 2.0)
    found = Kalman(SENSORS, WALK, (free,), kind=kind).run(TUG, noisy)
    values = found.of("damping.N_r")[0]
    assert (values >= -22.0).all()
    assert values[-1] == pytest.approx(-22.0, rel=1e-9)
    verdict = found.verdicts[1]
    assert verdict.status == "at bound"
    assert "bound" in verdict.text
    assert found.fitted.model.damping.N_r == values[-1]


@pytest.mark.slow
def test_a_free_without_a_prior_starts_from_its_start_and_interval(noisy):
    for free in (Free("damping.N_r", -20.0, -40.0, -10.0), Free("damping.N_r", -20.0, sigma=5.0)):
        got = Kalman(SENSORS, WALK, (free,)).run(TUG, noisy).parameters["damping.N_r"]
        assert abs(got.value + 26.7122) < 3.0 * got.sigma < 1.0


@pytest.mark.slow
def test_a_parameter_that_shows_nowhere_is_disowned(noisy):
    straight = noisy.rows(slice(0, 20))
    found = Kalman(SENSORS, WALK, ("damping.N_rrr",)).run(TUG, straight)
    assert found.verdicts[1].status == "not identified"


def test_the_move_onto_a_bound_takes_correlated_states_along():
    cov = np.array([[1.0, 0.5], [0.5, 1.0]])
    moved = inside(np.array([0.0, 2.0]), cov, np.array([-np.inf, -1.0]), np.array([np.inf, 1.0]))
    np.testing.assert_allclose(moved, [-0.5, 1.0])


def test_a_log_reads_the_water_at_its_own_place():
    state, around = (0.0, 0.0, math.pi / 2, 2.0, 0.1, 0.1), Environment(current_y=0.5)
    assert Log(0.01, y=3.0).read(state, around)[0] == pytest.approx(2.0 - 0.3 - 0.5)
    assert Log(0.01, y=3.0, water=False).read(state, around)[0] == pytest.approx(1.7)


@pytest.mark.slow
def test_a_log_tells_current_from_speed(true):
    """Ground from the antenna, water from the log: the current shows without the model's help."""
    rng = np.random.default_rng(4)
    trial = Sensors(NOISE | {"u": 0.01}).read(true, rng)
    shifted = trial.having(x=trial["x"] + 0.3 * trial.t)
    loose = {"u": 0.1, "v_m": 0.1, "r": 0.1}
    found = Kalman(SENSORS | {"log": Log(0.01)}, loose, current=True).run(TUG, shifted)
    got = found.parameters["environment.current_x"]
    assert abs(got.value - 0.3) < 3.0 * got.sigma < 0.1


def test_the_innovation_test_reads_windows():
    rng = np.random.default_rng(0)
    t = np.arange(1000) * 0.1
    miss = rng.normal(size=(1000, 2))
    squares, names = miss**2, ("psi", "x")

    def judged(scale):
        return innovation_test(
            t, miss * scale, squares * scale**2, (squares * scale**2).sum(axis=1), names, window=5.0, false_alarm=0.01
        )

    assert judged(1.0).fits
    assert len(judged(1.0).windows) == 19
    late = judged(np.where((t >= 60.0)[:, None], [1.0, 2.0], 1.0))
    assert not late.fits
    assert late.since == 60.0
    assert "from t = 60 s on the model no longer fits" in late.text
    assert "those of x" in late.text
    assert "to 40 s" in judged(np.where((t >= 30) & (t < 40), 2.0, 1.0)[:, None]).text
    assert judged(0.5).fits
    assert "too large" in judged(0.5).text


@pytest.mark.parametrize(("make", "error", "says"), [
    (lambda: Kalman(SENSORS, kind="pf"), StudyError, "'ekf' or 'ukf'"),
    (lambda: Kalman({}), StudyError, "no sensor"),
    (lambda: Kalman({"a": Heading(0.1), "b": Heading(0.2)}), StudyError, "psi is read by two"),
    (lambda: Kalman(SENSORS, step=0.0), StudyError, "step = 0"),
    (lambda: Kalman({"a": Heading(0.0)}), StudyError, "above zero"),
    (lambda: Kalman({"a": Heading(0.1, delay=-1.0)}), StudyError, "delay is -1"),
    (lambda: Kalman(SENSORS, {"U": 0.1}).prepared(TUG), StudyError, "no state of the filter 'U'"),
    (lambda: Kalman(SENSORS, {"current": 0.1}).prepared(TUG), StudyError, "'current'"),
    (lambda: Kalman(SENSORS, {"u": -0.1}).prepared(TUG), StudyError, "process: that of u"),
    (lambda: Kalman(SENSORS, parameters=("damping.Q",)).prepared(TUG), ParameterError, "damping.Q"),
    (lambda: Kalman(SENSORS, parameters=("inertia.m_12",)).prepared(TUG), StudyError, "half of it is no prior"),
    (lambda: Kalman(SENSORS, parameters=(Free("damping.N_r", -20.0),)).prepared(TUG), StudyError, "finite sigma"),
    (lambda: Kalman(SENSORS).prepared(load("kvlcc2_l7_arx")), StudyError, "discrete time"),
])  # fmt: skip
def test_what_cannot_be_is_refused(make, error, says):
    with pytest.raises(error, match=says):
        make()


@pytest.mark.slow
def test_a_trial_that_cannot_be_filtered_is_refused(noisy):
    kalman = Kalman(SENSORS, WALK).prepared(TUG)
    with pytest.raises(DataError, match="no channel 'r'"):
        kalman.run(replace(noisy, channels={n: v for n, v in noisy.channels.items() if n != "r"}))
    with pytest.raises(DataError, match="channel x holds no reading"):
        kalman.run(noisy.having(x=np.full(len(noisy), np.nan)))
    with pytest.raises(DataError, match="time that rises"):
        kalman.run(replace(noisy, t=noisy.t[::-1].copy()))
    with pytest.raises(DataError, match="no sensor reads the heading"):
        Kalman({"gnss": Antenna(0.02)}).run(TUG, noisy)
    with pytest.raises(StudyError, match="no state of the filter"):
        kalman.run(noisy).of("w")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["kvlcc2_l7", "mariner_nomoto2", "twin_virtual", "esso_190k_tanker", "suzaku"])
def test_any_family_with_rates_can_be_filtered(name):
    """Also one with states of its own beyond the six, which has nothing to read them with."""
    ship = load(name)
    length, time = ship.L_pp, ship.L_pp / ship.speed
    zigzag = Zigzag(n_P=approach(ship)[1], delta=math.radians(10), psi=math.radians(10))
    true = simulate(ship, zigzag, duration=4.0 * time)
    true = true.rows(slice(None, None, max(1, round(0.01 * time / true.dt))))
    noise = {"x": 0.005 * length, "y": 0.005 * length, "psi": 0.003, "r": 0.003 / time}
    trial = Sensors(noise).read(true, np.random.default_rng(0))
    sensors = {"gnss": Antenna(noise["x"]), "compass": Heading(noise["psi"]), "gyro": Rate(noise["r"])}
    walk = 1e-3 * length / time**1.5
    found = Kalman(sensors, {"u": walk, "v_m": walk, "r": walk / length}, current=True).run(ship, trial)
    assert found.consistency.fits
    got = found.smoothed().trial()
    for channel in ("u", "v_m"):
        assert np.sqrt(np.mean((got[channel] - true[channel]) ** 2)) < 0.005 * ship.speed


@pytest.mark.slow
def test_the_example_of_the_docs_runs():
    page = (Path(__file__).parents[3] / "docs" / "filtering.md").read_text(encoding="utf-8")
    names: dict[str, object] = {}
    exec(page.split("```python")[1].split("```")[0], names)
    better, true = names["better"], names["true"]
    assert np.sqrt(np.mean((better["u"] - true["u"]) ** 2)) < 0.002
    assert names["found"].parameters["damping.N_r"].sigma < 0.1
