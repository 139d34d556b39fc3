"""What a run records of its weather, and the water through which its validity is judged."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.environment import CHANNELS, Uniform
from seatrial.environment.weather import Measured
from seatrial.manoeuvres.turning import Turning
from seatrial.ships import ShipError
from seatrial.ships.files import load
from seatrial.simulate.lanes import Judge
from seatrial.simulate.run import approach, campaign, simulate, surrounded

L7 = load("kvlcc2_l7")


def test_weather_is_recorded_as_it_was_given_and_what_is_calm_is_left_out() -> None:
    given = {
        "U_T": 9.0,
        "gamma_T": 2.0,
        "U_C": 0.4,
        "gamma_C": -1.0,
        "H_S": 1.5,
        "T_W": 7.0,
        "gamma_W": 3.0,
        "depth": 12.0,
    }
    found = surrounded(Uniform(**given).series(1.0, 1), 3)
    assert set(found) == set(given)
    for name, value in given.items():
        assert found[name] == pytest.approx([value] * 3)
    assert surrounded(Uniform().series(1.0, 1), 3) == {}
    assert set(surrounded(Uniform(U_T=3.0).series(1.0, 1), 3)) == {"U_T", "gamma_T"}
    assert set(surrounded(Uniform(U_C=3.0, gamma_C=math.pi / 2).series(1.0, 1), 3)) == {"U_C", "gamma_C"}
    rows = np.zeros((2, len(CHANNELS)))
    rows[1, CHANNELS.index("per_depth")] = 0.1
    assert surrounded(rows, 2)["depth"].tolist() == [math.inf, 10.0]
    assert set(surrounded(rows, 2)) == {"depth"}


def test_validity_is_judged_through_the_water_at_the_stored_rows() -> None:
    """In a current to the east a ship that heads east at 5 m/s over ground makes 4 through the water."""
    rows = np.zeros((6, len(CHANNELS)))
    rows[:, CHANNELS.index("current_y")] = np.arange(1.0, 7.0)
    judge = Judge.of(load("mariner"), rows, 2)
    assert judge.told is not None
    values = np.array(
        [[[0, 0, 0.5 * math.pi, 5.0, 0.2, 0], [0, 0, 0.0, 5.0, 0.2, 0], [0, 0, -0.5 * math.pi, 5.0, 0, 0]]]
    )
    found = judge.told(values.astype(float))
    assert found["u"] == pytest.approx(np.array([[5.0 - 1.0, 5.0, 5.0 + 5.0]]))
    assert found["v_m"] == pytest.approx(np.array([[0.2, 0.2 - 3.0, 0.0]]), abs=1e-12)
    assert Judge.of(load("mariner"), np.zeros((6, len(CHANNELS))), 2).told is None


def test_a_row_has_the_mean_of_the_weather_up_to_the_next() -> None:
    """A current that turns from north to east half way between two rows is their sum over two."""
    t = np.arange(0.0, 8.0, 0.5)
    turns = Measured(t, {"U_C": np.full(16, 0.2), "gamma_C": np.where(t % 2.0 < 1.0, 0.0, 0.5 * math.pi)}, held=True)
    run = simulate(L7, Turning(approach(L7)[1], 0.0), duration=6.0, dt=0.5, every=4, environment=turns)
    assert run.t == pytest.approx([0.0, 2.0, 4.0, 6.0])
    assert run["U_C"][:3] == pytest.approx(0.2 * math.sqrt(0.5))
    assert run["gamma_C"][:3] == pytest.approx(0.25 * math.pi)


def test_a_run_starts_through_the_water_or_where_it_is_told() -> None:
    policy = Turning(approach(L7)[1], 0.0)
    around = Uniform(U_C=0.3, gamma_C=2.0)
    first = campaign(L7, policy, {}, speed=1.0, duration=1.0, dt=0.5, environment=around).values[0, 0]
    assert first[:6] == pytest.approx([0.0, 0.0, 0.0, 1.0 + 0.3 * math.cos(2.0), 0.3 * math.sin(2.0), 0.0])
    told = (1.0, 2.0, 0.3, 1.1, 0.1, 0.01)
    first = campaign(L7, policy, {}, speed=9.0, duration=1.0, dt=0.5, environment=around, start=told).values[0, 0]
    assert tuple(first[:6]) == told
    with pytest.raises(ShipError, match="start: 5 numbers; give x, y, psi, u, v_m, r"):
        campaign(L7, policy, {}, speed=1.0, duration=1.0, start=(0.0,) * 5)
    for duration, kept in ((0.26, 2), (0.74, 2), (0.76, 3)):
        assert len(simulate(L7, policy, duration=duration, dt=0.5)) == kept
    for duration in (0.2, math.inf):
        with pytest.raises(ShipError, match="has no step of"):
            simulate(L7, policy, duration=duration, dt=0.5)
    with pytest.raises(ShipError, match="store fewer than"):
        simulate(L7, policy, duration=1e9, dt=0.5)
