"""Thrust steps: what is asked for is what the thrusters give, on one axis or several, fore and aft or aft only."""

import math

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.core.parameters import ParameterError
from seatrial.forces import Flow
from seatrial.manoeuvres import Settings
from seatrial.manoeuvres.thrust_steps import ThrustSteps
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

FULL, AFT = load("milliampere"), load("milliampere_aft")
ENDS = {"x_first": 1.8, "x_second": -1.8}
STERN = {"x_first": -1.8, "x_second": -1.8, "first": "port", "second": "starboard"}
HELD = {"K_p": 600.0, "K_d": 1500.0}


def thrust(ship, orders):
    flow = Flow(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1000.0, 5.0, 0.0)
    parts = ship.model.thrusters.components
    total = [part.force(flow, tuple(orders[2 * k : 2 * k + 2])) for k, part in enumerate(parts)]
    return [sum(getattr(one, axis) for one in total) for axis in ("X", "Y", "N")]


@pytest.mark.parametrize("levels", [(1.0, -0.5, 0.5), (0.0, 1.0, -1.0), (-1.0, 0.0, 0.0)])
def test_thrusters_at_either_end_give_the_three_forces_asked_for(levels):
    policy = ThrustSteps(200.0, 150.0, 300.0, X_mean=50.0, **ENDS)
    orders, _ = policy.command(0.0, (0.0,) * 6, (0.0,), levels)
    wanted = (50.0 + 200.0 * levels[0], 150.0 * levels[1], 300.0 * levels[2])
    assert thrust(FULL, orders) == pytest.approx(wanted, abs=1e-4)


def test_thrusters_aft_bring_the_moment_of_their_lever_along():
    policy = ThrustSteps(200.0, 150.0, 0.0, **STERN)
    orders, _ = policy.command(0.0, (0.0,) * 6, (0.0,), (1.0, 0.5, 1.0))
    assert orders[:2] == orders[2:]
    assert thrust(AFT, orders) == pytest.approx((200.0, 75.0, -1.8 * 75.0), abs=1e-4)


@pytest.mark.parametrize(("ship", "where"), [(FULL, ENDS), (AFT, STERN)])
def test_an_unstable_ship_holds_its_heading_through_a_surge_run(ship, where):
    run = simulate(ship, ThrustSteps(200.0, X_mean=200.0, **HELD, **where), duration=60.0, dt=0.2,
                   start=(0.0, 0.0, 0.05, 1.0, 0.0, 0.02))  # fmt: skip
    assert np.ptp(run["u"]) > 0.2
    assert np.abs(run["psi"][-50:] - 0.05).max() < math.radians(3.0)


def test_one_axis_moves_alone():
    still = {"surge": ("v_m", "r"), "yaw": ("u",)}
    for axis, policy in (("surge", ThrustSteps(300.0, **ENDS)), ("yaw", ThrustSteps(N=300.0, **ENDS))):
        run = simulate(FULL, policy, speed=0.0, duration=40.0, dt=0.2)
        assert np.abs(run["u" if axis == "surge" else "r"]).max() > 0.1
        assert max(np.abs(run[name]).max() for name in still[axis]) < 0.03


def test_levels_do_not_depend_on_the_time_step_and_differ_by_seed_and_axis():
    coarse, fine = (ThrustSteps(1.0, 1.0, 1.0, seed=4).schedule(dt, round(60.0 / dt)) for dt in (0.5, 0.1))
    assert np.array_equal(coarse, fine[::5])
    assert not np.array_equal(coarse[:, 0], coarse[:, 1])
    assert not np.array_equal(coarse, ThrustSteps(1.0, 1.0, 1.0, seed=5).schedule(0.5, 120))
    changes = np.flatnonzero(np.diff(fine[:, 0])) + 1
    assert changes.size > 3
    assert np.allclose(changes % 10, 0)
    assert set(np.unique(fine)) <= {-1.0, -0.5, 0.0, 0.5, 1.0}


@pytest.mark.slow
def test_a_ship_gets_it_by_name(tmp_path, capsys):
    out = tmp_path / "run.csv"
    assert main(["simulate", "milliampere_aft", "thrust-steps", "--seed", "3", "-o", str(out)]) == 0
    assert "f_starboard" in out.read_text().splitlines()[0]
    capsys.readouterr()


def test_bad_input_is_named():
    with pytest.raises(ParameterError, match="hold"):
        ThrustSteps(hold=0.0)
    with pytest.raises(ParameterError, match="x_first, x_second"):
        ThrustSteps(x_first=0.0, x_second=0.0)
    with pytest.raises(ParameterError, match="two thrusters"):
        ThrustSteps.ordered(Settings(1.0, 1.0, 5.0, 0.6))
