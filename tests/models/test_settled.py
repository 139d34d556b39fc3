"""Where the states beyond motion begin: the same settled start in every room."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.choosing.probing import Probe
from seatrial.environment import CALM
from seatrial.envs.episodes import Settings
from seatrial.envs.lanes import Lanes
from seatrial.envs.tasks import Course
from seatrial.models.linear import linearise
from seatrial.models.settled import begun, settled, unseen
from seatrial.models.trim import point
from seatrial.ships.felt import feels
from seatrial.ships.files import load

HYBRID: Any = load("esso_osaka_3m_hybrid")
MOTION = (0.0, 0.0, 0.4, 0.3, 0.02, 0.01)
AROUND = CALM._replace(wind_x=2.0, wind_y=-1.0, current_x=0.1)
CONTROL = (9.0, 0.2, 0.0, 0.0, 0.0)[: len(HYBRID.model.controls)]


def test_what_is_remembered_settles_to_what_acts() -> None:
    state = begun(HYBRID.model, MOTION, CONTROL, AROUND)
    assert state[:6] == MOTION
    assert state[6:] == (2.0 + 0.1, -1.0, 9.0)
    rates = HYBRID.model.derivative(state, CONTROL, AROUND)
    assert rates[6:] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_a_ship_without_memory_has_its_motion_only() -> None:
    assert begun(load("esso_osaka_3m").model, MOTION, (9.0, 0.2), AROUND) == MOTION
    assert settled(load("esso_osaka_3m").model, np.zeros((3, 10))).shape == (3, 0)


def test_a_log_of_what_never_changes_is_settled() -> None:
    series = np.tile([*CONTROL, *AROUND], (5, 1))
    assert unseen(HYBRID.model, series, 0.1) == pytest.approx(settled(HYBRID.model, series))


@pytest.mark.slow
def test_a_probe_and_a_point_are_settled() -> None:
    state = begun(HYBRID.model, MOTION, CONTROL, AROUND)
    expected = HYBRID.model.derivative(state, CONTROL, AROUND)[3]
    U, L = HYBRID.speed, HYBRID.L_pp
    assert Probe.of(HYBRID).under(MOTION, CONTROL, AROUND)[0] * U * U / L == pytest.approx(expected)
    at = point(HYBRID.model, MOTION, {"n_P": 9.0, "delta": 0.2}, AROUND)
    assert at.state == pytest.approx(state)
    assert linearise(HYBRID.model, at).A.shape == (len(HYBRID.model.states) - 3,) * 2


def test_wind_that_is_only_remembered_is_felt() -> None:
    """The drift of the water with the wind of the last minutes is all that this ship feels of the wind."""
    drifting = replace(HYBRID, model=replace(HYBRID.model, wind=None, drift_along=0.03))
    assert feels(drifting, "wind_x")
    assert not feels(replace(drifting, model=replace(drifting.model, drift_along=0.0, drift_across=0.0)), "wind_x")


@pytest.mark.slow
def test_episodes_begin_settled() -> None:
    lanes = Lanes(HYBRID, Course(), 5, Settings(wind=(0.5, 1.0), current=(0.1, 0.2)))
    lanes.seed(np.arange(5, dtype=np.uint64))
    lanes.reset()
    for axis in "xy":
        acting = lanes.series(f"wind_{axis}") + lanes.series(f"current_{axis}")
        assert np.abs(acting).min() > 0.0
        assert lanes.value(f"slow_wind_{axis}") == pytest.approx(acting)
    assert lanes.value("slow_n") == pytest.approx(lanes.work.turns)
    assert lanes.work.turns > 0.0
