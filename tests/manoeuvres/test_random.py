"""Random manoeuvres: their sequences are as white as theory says, and the same at any time step."""

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.core.parameters import ParameterError
from seatrial.manoeuvres import Scheduled, Settings
from seatrial.manoeuvres.human_random import HumanRandom
from seatrial.manoeuvres.pseudo_random import PseudoRandom, liveliness, m_sequence
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

SETTINGS = Settings(n_P=10.0, speed=1.0, L_pp=3.0, rudder_limit=math.radians(30.0), seed=4)


def autocorrelation(x):
    return np.array([np.mean(x * np.roll(x, k)) for k in range(x.size)])


@pytest.mark.parametrize("degree", [2, 3, 5, 7, 9])
def test_two_levels_have_the_autocorrelation_of_a_maximal_length_sequence(degree):
    x = m_sequence(2, degree)
    N = 2**degree - 1
    assert x.size == N
    assert set(x) == {-1.0, 1.0}
    R = autocorrelation(x)
    assert R[0] == pytest.approx(1.0)
    assert R[1:] == pytest.approx(-1.0 / N)


@pytest.mark.parametrize(("levels", "degree"), [(3, 2), (3, 3), (3, 5), (5, 2), (5, 3)])
def test_more_levels_are_white_but_for_the_inverted_second_half(levels, degree):
    x = m_sequence(levels, degree)
    N = levels**degree - 1
    half = levels // 2
    assert x.size == N
    assert np.unique(x) == pytest.approx(np.arange(-half, half + 1) / half)
    R = autocorrelation(x)
    assert x[N // 2 :] == pytest.approx(-x[: N // 2])
    assert R[N // 2] == pytest.approx(-R[0])
    rest = np.delete(R, [0, N // 2])
    assert rest == pytest.approx(0.0, abs=1e-12)
    # every level but zero equally often: levels**(degree - 1) times
    counts = [np.sum(np.isclose(x, level)) for level in np.unique(x) if abs(level) > 0.1]
    assert set(counts) == {levels ** (degree - 1)}


def test_rudder_and_revolutions_are_uncorrelated():
    policy = PseudoRandom(10.0, 0.3, 0.25, levels=5, degree=3, hold=1.0)
    levels = policy.schedule(1.0, 124)
    assert np.mean(levels[:, 0] * levels[:, 1]) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("cls", [PseudoRandom, HumanRandom])
def test_the_schedule_is_the_same_at_any_step_and_at_every_call(cls):
    policy = cls.ordered(SETTINGS)
    assert isinstance(policy, Scheduled)
    coarse = policy.schedule(0.1, 1001)
    assert coarse.shape == (1001, len(policy.given))
    assert np.array_equal(coarse, policy.schedule(0.1, 1001))
    for k in (2, 5, 10):
        fine = policy.schedule(0.1 / k, 1000 * k + 1)
        assert fine[::k] == pytest.approx(coarse, abs=1e-12)
    assert policy.schedule(0.1, 400) == pytest.approx(coarse[:400], abs=1e-12)
    assert np.abs(coarse).max() <= 1.0


@pytest.mark.parametrize("cls", [PseudoRandom, HumanRandom])
def test_another_seed_is_another_run_within_the_rudder_limits(cls):
    runs = [cls.ordered(replace(SETTINGS, seed=s)) for s in (1, 2, 3)]
    series = [policy.schedule(0.5, 200) for policy in runs]
    assert not np.array_equal(series[0], series[1])
    assert not np.array_equal(series[1], series[2])
    for policy, rows in zip(runs, series, strict=True):
        for row in rows:
            (n, delta), _ = policy.command(0.0, (0.0,) * 6, (), tuple(row))
            assert abs(delta) <= SETTINGS.rudder_limit + 1e-12
            assert abs(n) <= 1.25 * SETTINGS.n_P + 1e-12


def test_port_mirrors_starboard():
    for cls in (PseudoRandom, HumanRandom):
        a, b = (cls.ordered(replace(SETTINGS, side=s)) for s in (1.0, -1.0))
        for row in a.schedule(1.0, 50):
            (n_a, d_a), _ = a.command(0.0, (0.0,) * 6, (), tuple(row))
            (n_b, d_b), _ = b.command(0.0, (0.0,) * 6, (), tuple(row))
            assert (n_a, d_a) == (n_b, -d_b)


@pytest.mark.slow
def test_the_hand_covers_its_range_evenly_but_for_zero_and_the_limits():
    """Wakita 2022 Fig. 3: even, with heaps at zero and at both ends."""
    policy = HumanRandom(10.0, 0.6, hold=5.0, travel=0.5, length=1e4, seed=7)
    places = policy.schedule(0.5, 80_000)
    for stick in places.T:
        inner = np.histogram(stick, bins=[-0.95, -0.7, -0.45, -0.2, -0.05])[0] / (0.25, 0.25, 0.25, 0.15)
        assert inner.max() / inner.min() < 1.4
        assert np.mean(np.abs(stick) < 0.02) > 0.1
        assert np.mean(stick > 0.999) == pytest.approx(np.mean(stick < -0.999), abs=0.03)
        assert np.mean(np.abs(stick) > 0.999) > 0.15
    assert np.corrcoef(places.T)[0, 1] == pytest.approx(0.0, abs=0.05)


def test_astern_is_its_own_share():
    policy = HumanRandom(10.0, 0.6, astern=0.4)
    assert policy.command(0.0, (0.0,) * 6, (), (0.5, 1.0))[0] == (10.0, 0.3)
    assert policy.command(0.0, (0.0,) * 6, (), (0.5, -1.0))[0] == (-4.0, 0.3)


@pytest.mark.parametrize("cls", [PseudoRandom, HumanRandom])
def test_a_run_follows_its_schedule(cls):
    ship = load("esso_osaka_3m")
    settings = Settings(10.0, 0.4, ship.L_pp, float(ship.actuators.rudder.high))
    policy = cls.ordered(settings)
    run = simulate(ship, policy, speed=0.4, duration=60.0, dt=0.1)
    levels = policy.schedule(0.1, len(run))
    assert run["delta_cmd"][:-1] == pytest.approx(policy.delta * levels[:-1, 0], abs=1e-12)
    fine = simulate(ship, policy, speed=0.4, duration=60.0, dt=0.05)
    assert fine["psi"][::2] == pytest.approx(run["psi"], abs=0.02)
    found = policy.indices(run, ship.L_pp)
    assert not policy.complete(run)
    assert found["speed_min"].value < found["speed_max"].value
    assert 0 < found["coverage"].value <= 1


def test_figures_of_a_run_with_gaps():
    ship = load("mariner_nomoto")
    run = simulate(ship, PseudoRandom(0.0, 0.3, hold=40.0, levels=2, degree=3), duration=300.0, dt=1.0)
    holed = run["r"].copy()
    holed[10:20] = np.nan
    found = liveliness(run.having(r=holed), ship.L_pp)
    assert found["rudder_rms"].value == pytest.approx(0.3, rel=0.05)
    assert found["track_length"].over_L == pytest.approx(300.0 * 7.7175 / 160.93, rel=0.01)
    assert "yaw_rate_rms" in found


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"levels": 4}, "2, 3, 5 or 7"), ({"degree": 1}, "2 to"), ({"degree": 9}, "2 to"), ({"hold": 0.0}, "hold")],
)
def test_impossible_sequences_are_refused(changes, words):
    with pytest.raises(ParameterError, match=words):
        PseudoRandom(10.0, 0.3, **changes)


def test_an_impossible_hand_is_refused():
    with pytest.raises(ParameterError, match="travel"):
        HumanRandom(10.0, 0.3, travel=0.0)
