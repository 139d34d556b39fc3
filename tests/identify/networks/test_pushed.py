"""Seconds in which a hand holds the model are found and cut out; what the ship does by itself is not."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.identify.networks.pushed import undisturbed
from seatrial.manoeuvres.turning import Turning
from seatrial.models import STATES
from seatrial.ships.files import load
from seatrial.simulate.replay import replay
from seatrial.simulate.run import simulate

SHIP = load("esso_osaka_3m")
NOISE = 6e-5


def trial(name: str, held: tuple[float, float] | None = None) -> Trial:
    """A turn with a little noise; within `held` [s] something takes the way off."""
    made = simulate(SHIP, Turning(delta=0.3, n_P=9.0), speed=0.3, duration=120.0, dt=0.1)
    if held:
        began, ended = (round(t / made.dt) for t in held)
        state = made.stack(*STATES)
        state[began:, 3] -= 0.15 * np.clip((made.t[began:] - held[0]) / (held[1] - held[0]), 0.0, 1.0)
        after = replay(SHIP, made, begin=(held[1], state[ended]))
        state[ended:] = after.stack(*STATES)
        made = made.having(**dict(zip(STATES, state.T, strict=True)))
    drift = np.random.default_rng(len(name)).standard_normal(len(made)).cumsum()
    return Trial(name, made.t, {**{n: made[n] for n in made.channels}, "u": made["u"] + NOISE * drift}, meta=made.meta)


def test_a_free_ship_is_left_alone() -> None:
    made = (trial("a"), trial("bb"))
    assert undisturbed(SHIP, made, 3.0) == made


def test_a_caught_model_is_cut_at_the_hand() -> None:
    free, caught = trial("free"), trial("caught", held=(60.0, 63.0))
    same, before, after = undisturbed(SHIP, (free, caught), 3.0)
    assert same is free
    assert (before.name, after.name) == ("caught_1", "caught_2")
    assert before.t[-1] == pytest.approx(58.0, abs=1.5)
    assert after.t[0] == pytest.approx(65.5, abs=1.5)


def test_parts_that_are_too_short_go() -> None:
    (kept, left) = undisturbed(SHIP, (trial("free"), trial("end", held=(100.0, 104.0))), 3.0)
    assert (kept.name, left.name) == ("free", "end_1")
    assert left.t[-1] < 99.5
