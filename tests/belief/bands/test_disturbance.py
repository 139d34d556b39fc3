"""Random accelerations in the compiled step: their statistics, and what they do to a ship."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.belief.bands.disturbance import LANEWISE, Disturbance, Process, disturbed, shared
from seatrial.engine.rollout import simulator
from seatrial.ships.files import load
from seatrial.simulate.loop import open_loop, open_loop_parameters

SHIP = load("esso_osaka_3m")
TAUS = (2.0, 8.0, math.inf)


def sailed(
    who: Disturbance, lanes: int, *, steps: int = 301, u: float = 0.4, wind: float = 0.0, back_end: str = "auto"
) -> tuple[list[str], np.ndarray]:
    """Names of the columns, and rows of every lane, one a second."""
    system = disturbed(open_loop(SHIP), who.layout)
    code, rng = simulator(system, LANEWISE, back_end=back_end), np.random.default_rng(0)
    state, series = np.zeros((lanes, 6)), np.zeros((lanes, 1, len(system.series)))
    state[:, 3] = u
    series[:, 0, system.series.index("wind_x")] = wind
    rows = code.stored(state, series, shared(open_loop_parameters(SHIP), who), memory0=who.begun(lanes, rng),
                       lanewise=who.currents(lanes, rng), dt=0.1, steps=steps, every=10)  # fmt: skip
    return list(system.stored), rows


@pytest.mark.slow
def test_a_process_is_stationary_with_its_correlation_time() -> None:
    names, rows = sailed(Disturbance(tuple(Process("u", 0.0, tau) for tau in TAUS)), 4000)
    for k, tau in enumerate(TAUS):
        values = rows[:, :, names.index(f"disturbance.{k}.value")]
        assert np.abs(values.mean(axis=0)).max() < 0.1
        assert values.std(axis=0) == pytest.approx(1.0, abs=0.06)
        for lag in (2, 8):
            found = float(np.mean(values[:, 5] * values[:, 5 + lag]))
            assert found == pytest.approx(math.exp(-lag / tau), abs=0.06)


@pytest.mark.slow
def test_processes_and_lanes_are_independent() -> None:
    names, rows = sailed(Disturbance(tuple(Process(on, 0.0, 5.0) for on in ("u", "v_m", "r"))), 4000, steps=201)
    values = rows[:, -1, names.index("disturbance.0.value") : names.index("disturbance.0.value") + 3]
    assert np.abs(np.corrcoef(values.T) - np.eye(3)).max() < 0.06
    assert np.abs(np.corrcoef(values[:-1, 0], values[1:, 0])[0, 1]) < 0.06


@pytest.mark.slow
def test_both_back_ends_draw_the_same_numbers() -> None:
    who = Disturbance((Process("r", 1e-3, 3.0, "water"), Process("u", 1e-3, 30.0)), 0.05)
    fast, slow = (sailed(who, 16, steps=101, back_end=one)[1] for one in ("auto", "virtual"))
    assert np.allclose(fast, slow, rtol=1e-9, atol=1e-12)


def test_a_constant_acceleration_moves_a_ship_at_rest_as_it_should() -> None:
    names, rows = sailed(Disturbance((Process("u", 1e-5, math.inf),)), 64, steps=101, u=0.0)
    a = 1e-5 * rows[:, 0, names.index("disturbance.0.value")]
    assert rows[:, -1, names.index("u")] == pytest.approx(10.0 * a, rel=0.05, abs=1e-7)


def test_what_grows_with_air_grows_with_the_square_of_its_speed() -> None:
    away: list[float] = []
    for wind in (5.0, 10.0):
        still, moved = (sailed(Disturbance((Process("r", sigma, math.inf, "air"),)), 64, steps=11, u=0.0, wind=wind)[1]
                        for sigma in (0.0, 1e-8))  # fmt: skip
        away.append(float(np.std(moved[:, -1, 5] - still[:, -1, 5])))
    assert away[1] / away[0] == pytest.approx(4.0, rel=0.1)


@pytest.mark.slow
def test_a_current_carries_a_ship_and_differs_by_lane() -> None:
    names, rows = sailed(Disturbance((), 0.1), 500, steps=3001, u=0.0)
    speed = rows[:, -1, [names.index("x"), names.index("y")]] - rows[:, -2, [names.index("x"), names.index("y")]]
    assert speed.std(axis=0) == pytest.approx(0.1, rel=0.25)
