"""What acted before a start is carried on: nothing where the model is right, the unlogged wind where it is not."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.data import DataError, Trial
from seatrial.manoeuvres.turning import Turning
from seatrial.models import STATES
from seatrial.ships.files import load
from seatrial.simulate.carried import Carrier, Slow
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
