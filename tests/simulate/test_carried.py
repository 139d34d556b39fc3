"""What acted before a start is carried on: nothing where the model is right, the unlogged wind where it is not."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.data import DataError, Trial
from seatrial.manoeuvres.turning import Turning
from seatrial.models import STATES
from seatrial.ships.files import load
from seatrial.simulate.carried import Carrier, Slow, swung
from seatrial.simulate.replay import replay
from seatrial.simulate.run import simulate

SHIP = load("esso_osaka_3m")
WIND = {"U_T": 3.0, "gamma_T": 2.0}


def trial(blown: bool) -> Trial:
    """Ahead at constant revolutions, in a wind that the log does not hold."""
    calm = simulate(SHIP, Turning(delta=0.0, n_P=8.0), speed=0.3, duration=90.0, dt=0.1)
    if not blown:
        return calm
    windy = calm.having(**{name: np.full(len(calm), value) for name, value in WIND.items()})
    moved = replay(SHIP, windy)
    return calm.having(**{name: moved[name] for name in STATES})


def missed(predicted: Trial, made: Trial) -> np.ndarray:
    """Squared error of each row after the second start, over the size of each state."""
    late = made.t >= 30.0
    size = np.array([1.0, 1.0, 0.2, 0.1, 0.05, 0.02])
    return (((predicted.stack(*STATES) - made.stack(*STATES)) / size) ** 2)[late].sum(axis=1)


@pytest.mark.slow
def test_a_right_model_carries_nothing_on() -> None:
    made = trial(blown=False)
    carried = Carrier.of(SHIP, 60.0).replay(made, restart=30.0)
    plain = replay(SHIP, made, restart=30.0)
    assert carried.stack(*STATES) == pytest.approx(plain.stack(*STATES), abs=2e-3)
    assert carried.meta["processing"][-1] == "what acted in 60 s before each start carried on"


@pytest.mark.slow
def test_an_unlogged_wind_acts_on() -> None:
    made = trial(blown=True)
    plain = replay(SHIP, made, restart=30.0)
    carrier = Carrier.of(SHIP, 60.0, Slow((1.0, 1.0, 1.0), 10.0, 1e6))
    carried = carrier.replay(made, restart=30.0)
    assert missed(carried, made).mean() < 0.35 * missed(plain, made).mean()  # a wind turns with the ship
    usual = Carrier.of(SHIP, 60.0).replay(made, restart=30.0)
    assert missed(carried, made).mean() < missed(usual, made).mean() < 0.9 * missed(plain, made).mean()


def test_the_first_start_has_no_history_and_a_gap_says_nothing() -> None:
    made = trial(blown=True)
    early = made.t < 30.0
    carrier = Carrier.of(SHIP, 60.0)
    first = carrier.replay(made, restart=30.0).stack(*STATES)[early]
    assert first == pytest.approx(replay(SHIP, made, restart=30.0).stack(*STATES)[early], abs=1e-12)
    gap = (made.t > 20.0) & (made.t < 29.0)
    torn = made.having(u=np.where(gap, np.nan, made["u"]))
    assert np.isfinite(carrier.replay(torn, restart=30.0).stack(*STATES)).all()


def test_what_cannot_be() -> None:
    with pytest.raises(DataError, match="history is 0 s"):
        Carrier.of(SHIP, 0.0)


def test_the_usual_law_goes_with_the_length_of_the_ship() -> None:
    """Of the 3 m model, 8 and 19 s."""
    slow = Slow.of(SHIP)
    assert (slow.filter, slow.fade) == pytest.approx((SHIP.L_pp / SHIP.speed, 2.5 * SHIP.L_pp / SHIP.speed))
    assert slow.share == (0.0, 0.5, 0.5)


def boat(turn: float, share: float = 1.0) -> Trial:
    """A catamaran on its way, one side pushing more, with its compass off by `turn` [rad] and speeds made of it."""
    ship, rows = load("blueboat"), np.arange(101)
    orders = {"throttle_port": 0.6, "throttle_starboard": 0.5}
    held = {name: np.full(rows.size, share * value) for name, value in orders.items()}
    zero = {name: np.zeros(rows.size) for name in STATES} | {"u": np.full(rows.size, 1.5 * share)}
    made = replay(ship, Trial("a", 0.1 * rows, {**zero, **held}))
    over_ground = (made["u"] + 1j * made["v_m"]) * np.exp(-1j * turn)
    return made.having(psi=made["psi"] + turn, u=over_ground.real, v_m=over_ground.imag, **held)


@pytest.mark.slow
def test_a_sway_beyond_the_model_is_the_error_of_the_compass_as_far_as_there_is_way() -> None:
    ship = load("blueboat")
    true, read = boat(0.0), boat(0.1)
    last = read.stack(*STATES)[-1]
    state, off = swung(ship, read, last)
    slow = boat(0.1, 0.3)
    for one, found in ((read, off), (slow, swung(ship, slow, slow.stack(*STATES)[-1])[1])):
        u = float(one["u"][-1])
        assert found == pytest.approx(-0.1 * u**2 / (u**2 + (ship.speed / 3.0) ** 2), rel=0.1)
    assert state[2] == pytest.approx(last[2] + off)
    assert state[[0, 1, 5]] == pytest.approx(last[[0, 1, 5]])
    # the track over ground goes on as it was read
    ground = (last[3] + 1j * last[4]) * np.exp(1j * last[2])
    assert (state[3] + 1j * state[4]) * np.exp(1j * state[2]) == pytest.approx(ground)
    assert abs(state[4] - true["v_m"][-1]) < 0.3 * abs(last[4] - true["v_m"][-1])


@pytest.mark.slow
def test_a_right_compass_and_one_of_a_boat_at_rest_stay_as_they_are() -> None:
    ship, true = load("blueboat"), boat(0.0)
    assert swung(ship, true, true.stack(*STATES)[-1])[1] == pytest.approx(0.0, abs=2e-3)
    still = true.having(**dict.fromkeys(("throttle_port", "throttle_starboard", "u", "v_m", "r"), 0.0 * true.t))
    aside = still.having(v_m=np.full(len(still), 0.05))
    assert swung(ship, aside, aside.stack(*STATES)[-1])[1] == 0.0
    few = true.rows(slice(0, 2))
    assert swung(ship, few, few.stack(*STATES)[-1])[1] == 0.0
