"""Where predictions begin whose compass errs: what sways beyond the model is its error, as far as there is way."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.models import STATES
from seatrial.ships.files import load
from seatrial.simulate.replay import prepared, replay
from seatrial.simulate.starts import before, of_a_wrong_compass, swung, wrong_compass


def boat(turn: float, share: float = 1.0) -> Trial:
    """A catamaran on its way, one side pushing more, with its compass off by `turn` [rad] and speeds made of it."""
    ship, rows = load("blueboat"), np.arange(101)
    orders = {"throttle_port": 0.6, "throttle_starboard": 0.5}
    held = {name: np.full(rows.size, share * value) for name, value in orders.items()}
    zero = {name: np.zeros(rows.size) for name in STATES} | {"u": np.full(rows.size, 1.5 * share)}
    made = replay(ship, Trial("a", np.linspace(0.0, 10.0, 101), {**zero, **held}))
    over_ground = (made["u"] + 1j * made["v_m"]) * np.exp(-1j * turn)
    return made.having(psi=made["psi"] + turn, u=over_ground.real, v_m=over_ground.imag, **held)


def share(u: float) -> float:
    """Of a sway beyond the model that is the compass's at a speed [m/s]: half at a third of the approach."""
    return u**2 / (u**2 + (load("blueboat").speed / 3.0) ** 2)


def told(read: Trial) -> tuple[np.ndarray, float]:
    """State and error of the heading of the last start of a trial that restarts on its last row but one."""
    found = prepared(load("blueboat"), wrong_compass(read), restart=9.9)
    return found.begun[-1, :6], float(found.off[-1])


@pytest.mark.slow
def test_a_sway_beyond_the_model_is_the_error_of_the_compass_as_far_as_there_is_way() -> None:
    true, read, slow = boat(0.0), boat(0.1), boat(0.1, 0.3)
    last = read.stack(*STATES)[99]
    state, off = told(read)
    for one, found in ((read, off), (slow, told(slow)[1])):
        u = float(one["u"][99])
        assert found == pytest.approx(-0.1 * share(u), rel=0.1)
    assert state[2] == pytest.approx(last[2] + off)
    assert state[[0, 1, 5]] == pytest.approx(last[[0, 1, 5]])
    # the track over ground goes on as it was read
    ground = (last[3] + 1j * last[4]) * np.exp(1j * last[2])
    assert (state[3] + 1j * state[4]) * np.exp(1j * state[2]) == pytest.approx(ground)
    left = 1.0 - share(float(read["u"][99]))
    assert abs(state[4] - true["v_m"][99]) < 2.0 * left * abs(last[4] - true["v_m"][99])


@pytest.mark.slow
def test_a_right_compass_and_one_of_a_boat_at_rest_stay_as_they_are() -> None:
    true = boat(0.0)
    assert told(true)[1] == pytest.approx(0.0, abs=2e-3)
    still = true.having(**dict.fromkeys(("throttle_port", "throttle_starboard", "u", "v_m", "r"), 0.0 * true.t))
    assert told(still.having(v_m=np.full(len(still), 0.05)))[1] == 0.0
    assert prepared(load("blueboat"), boat(0.1), restart=9.9).off.tolist() == [0.0, 0.0]  # nobody found it wrong
    assert prepared(load("blueboat"), wrong_compass(boat(0.1)), restart=None).off.tolist() == [0.0]  # nothing before


@pytest.mark.slow
def test_a_prediction_is_as_the_compass_reads_and_beside_the_track_of_the_right_one() -> None:
    """From 5 s on: as read, the boat turns by the error of its compass, of which a share is taken out."""
    ship, true, read = load("blueboat"), boat(0.0), boat(0.1)
    late = true.t >= 5.0
    plain, right = (replay(ship, one, restart=5.0) for one in (read, wrong_compass(read)))
    off = [np.hypot(one["x"] - true["x"], one["y"] - true["y"])[late].max() for one in (plain, right)]
    left = 1.0 - share(float(read["u"][50]))
    assert off[1] < 2.0 * left * off[0]
    apart = {name: [np.abs(one[name] - read[name])[late].max() for one in (plain, right)]
             for name in ("psi", "u", "v_m")}  # fmt: skip
    for name in ("psi", "v_m"):
        assert apart[name][1] < 3.0 * left * apart[name][0], name
    assert apart["u"][1] < 0.8 * apart["u"][0]
    assert not of_a_wrong_compass(right)  # what is predicted is no reading


@pytest.mark.slow
def test_a_start_that_is_given_stays_and_one_at_a_time_is_read() -> None:
    ship, read = load("blueboat"), wrong_compass(boat(0.1))
    own = np.array([1.0, 2.0, 0.3, 0.9, 0.1, 0.0])
    given = prepared(ship, read, restart=2.0, begin=(5.0, own))
    assert given.begun[0, :6] == pytest.approx(own)
    assert given.off[0] == 0.0
    assert abs(given.off[1]) > 0.03
    read_off = prepared(ship, read, restart=2.0, begin=(5.0, None))
    assert read_off.off[0] == pytest.approx(prepared(ship, read, restart=5.0).off[1])


def test_the_seconds_before_a_start_are_those_in_which_it_travels_five_lengths() -> None:
    ship, t = load("blueboat"), np.arange(0.0, 60.0, 0.1)
    past = before(ship, Trial("a", t, {"u": t}), 50.0)
    assert past.t[-1] == pytest.approx(50.0)
    assert 50.0 - past.t[0] == pytest.approx(5.0 * ship.L_pp / ship.speed, abs=0.1)
    state, off = swung(ship, np.array([0.0, 0.0, 0.0, ship.speed / 3.0, 0.02, 0.0]), 0.0)
    assert off == pytest.approx(0.5 * 0.02 / (ship.speed / 3.0), rel=1e-2)
    assert state[2] == pytest.approx(off)
