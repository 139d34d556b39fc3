"""The autopilot against the second-order system that pole placement makes of a Nomoto ship."""

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.actuators import Actuators
from seatrial.core.parameters import ParameterError
from seatrial.data import Trial
from seatrial.environment import Uniform
from seatrial.manoeuvres import Settings
from seatrial.manoeuvres.autopilot import CourseKeeping, gains, wrapped
from seatrial.ships.files import load
from seatrial.simulate.run import campaign, simulate

TEN = math.radians(10.0)


@pytest.fixture(scope="module")
def ship():
    """The mariner without limits of its steering gear."""
    return replace(load("mariner_nomoto"), actuators=Actuators())


@pytest.mark.parametrize("zeta", [0.4, 0.7])
@pytest.mark.parametrize("omega", [0.02, 0.05])
def test_a_change_of_course_overshoots_as_the_second_order_system_does(ship, omega, zeta):
    K_p, K_d, _ = gains(ship.model.K, ship.model.T, omega, zeta)
    policy = CourseKeeping(0.0, TEN, K_p, K_d)
    run = simulate(ship, policy, duration=14.0 / (zeta * omega), dt=0.05 / omega / 10)
    found = policy.indices(run, ship.L_pp)
    damped = math.sqrt(1 - zeta**2)
    assert found["overshoot"].value == pytest.approx(TEN * math.exp(-math.pi * zeta / damped), rel=0.02)
    rise = (math.pi - math.acos(zeta)) / (omega * damped)
    assert found["rise_time"].value == pytest.approx(rise, rel=0.01)
    t = run.t
    exact = 1 - np.exp(-zeta * omega * t) * (np.cos(omega * damped * t) + zeta / damped * np.sin(omega * damped * t))
    assert np.abs(run["psi"] - TEN * exact).max() <= 0.003 * TEN
    settled = np.flatnonzero(np.abs(exact - 1) > 0.05)[-1]
    assert found["settling_time"].value == pytest.approx(float(t[settled]), rel=0.02)
    assert policy.complete(run)
    assert found["final_error"].value == pytest.approx(0.0, abs=1e-4)


def test_the_error_of_the_law_falls_with_the_step(ship):
    """The rudder is held between steps, so the run differs from the exact one in the first order of dt."""
    K_p, K_d, _ = gains(ship.model.K, ship.model.T, 0.05, 0.5)
    policy = CourseKeeping(0.0, TEN, K_p, K_d)
    exact = TEN * math.exp(-math.pi * 0.5 / math.sqrt(0.75))
    errors = [
        policy.indices(simulate(ship, policy, duration=300.0, dt=dt), ship.L_pp)["overshoot"].value - exact
        for dt in (0.4, 0.2, 0.1)
    ]
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.1)


def test_a_third_pole_takes_out_a_steady_disturbance(ship):
    """A rudder that sits 2 deg off is balanced by the integral alone."""

    def offset(policy):
        class Off(type(policy)):
            def command(self, t, state, memory):
                (n, delta), memory = super().command(t, state, memory)
                return (n, delta + math.radians(2.0)), memory

        return Off(**{k: getattr(policy, k) for k in ("n_P", "change", "K_p", "K_d", "K_i")})

    pd = CourseKeeping(0.0, 0.0, *gains(ship.model.K, ship.model.T, 0.05, 0.8))
    pid = CourseKeeping(0.0, 0.0, *gains(ship.model.K, ship.model.T, 0.05, 0.8, pole=0.005))
    ends = [float(simulate(ship, offset(p), duration=3000.0, dt=0.5)["psi"][-1]) for p in (pd, pid)]
    assert ends[0] == pytest.approx(math.radians(2.0) / pd.K_p, rel=1e-3)
    assert ends[1] == pytest.approx(0.0, abs=1e-5)


def test_three_poles_are_where_they_were_asked_for():
    K, T, omega, zeta, pole = 0.19, 100.0, 0.05, 0.7, 0.004
    K_p, K_d, K_i = gains(K, T, omega, zeta, pole)
    roots = np.roots([T, 1 + K * K_d, K * K_p, K * K_i])
    asked = np.roots(np.polymul([1, 2 * zeta * omega, omega**2], [1, pole]))
    assert np.sort_complex(roots) == pytest.approx(np.sort_complex(asked), rel=1e-9)


def test_an_unstable_ship_is_held_too(ship):
    tanker = replace(ship, model=replace(ship.model, K=-0.019, T=-153.7))
    policy = CourseKeeping(0.0, TEN, *gains(-0.019, -153.7, 0.05, 0.8))
    run = simulate(tanker, policy, duration=400.0, dt=0.2)
    assert run["psi"][-1] == pytest.approx(TEN, rel=1e-3)


def test_the_rudder_keeps_its_limit_and_the_integral_waits(ship):
    policy = CourseKeeping(0.0, math.radians(90.0), *gains(ship.model.K, ship.model.T, 0.08, 0.8, 0.02), 0.1)
    run = simulate(ship, policy, duration=1500.0, dt=0.5)
    assert np.abs(run["delta_cmd"]).max() == pytest.approx(0.1)
    found = policy.indices(run, ship.L_pp)
    assert found["overshoot"].value < math.radians(25.0)
    assert found["final_error"].value == pytest.approx(0.0, abs=1e-3)


def test_it_turns_the_short_way_round():
    assert wrapped(math.radians(350.0)) == pytest.approx(math.radians(-10.0))
    policy = CourseKeeping(0.0, 0.0, 1.0, 0.0)
    (_, delta), _ = policy.command(0.0, (0.0, 0.0, math.radians(355.0), 1.0, 0.0, 0.0), (math.radians(5.0), 0.0, 0.0))
    assert delta == pytest.approx(math.radians(10.0))


def test_keeping_a_course_in_wind_says_how_quiet_it_is():
    ship = load("esso_osaka_3m")
    policy = replace(CourseKeeping.ordered(Settings(10.0, 0.4, 3.0, 0.6)), change=0.0)
    run = simulate(ship, policy, speed=0.4, duration=120.0, environment=Uniform(U_T=1.0, gamma_T=1.0))
    found = policy.indices(run, 3.0)
    assert set(found) == {"final_error", "heading_rms", "rudder_rms"}
    assert 0 < found["heading_rms"].value < math.radians(20.0)
    assert policy.complete(run)


def test_ordered_holds_a_real_ship_and_mirrors(ship):
    vessel = load("kvlcc2_l7")
    settings = Settings(11.85, 1.179, 7.0, math.radians(35.0), heading=math.radians(20.0))
    ends = []
    for side in (1.0, -1.0):
        policy = CourseKeeping.ordered(replace(settings, side=side))
        run = simulate(vessel, policy, duration=150.0)
        found = policy.indices(run, 7.0)
        assert policy.complete(run)
        assert found["overshoot"].value < math.radians(4.0)
        ends.append(float(run["psi"][-1]))
    assert ends[0] == pytest.approx(-ends[1], abs=math.radians(0.2))


def test_gains_can_vary_from_lane_to_lane(ship):
    policy = CourseKeeping(0.0, TEN, 1.0, 30.0)
    rollout = campaign(ship, policy, {"policy.K_p": np.array([0.5, 1.0, 2.0])}, speed=7.7175, duration=50.0, dt=0.5)
    psi = rollout.values[:, -1, 2]
    assert psi[0] < psi[1] < psi[2]


@pytest.mark.parametrize("bad", [(0.0, 9, 1, 1), (1, 0.0, 1, 1), (1, 1, 0.0, 1), (1, 1, 1, 0.0)])
def test_gains_that_cannot_be_are_refused(bad):
    with pytest.raises(ParameterError):
        gains(*bad)


def test_a_run_that_never_settles_is_not_complete():
    t = np.arange(0.0, 100.0)
    trial = Trial("t", t, {"psi": TEN + 0.5 * TEN * np.sin(t), "delta": 0 * t})
    policy = CourseKeeping(0.0, TEN, 1.0, 1.0)
    assert not policy.complete(trial)
    assert "settling_time" not in policy.indices(trial, 1.0)
