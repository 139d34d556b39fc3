"""Ships, runs, problems and fits are values: copied, pickled and hashed, in this process or another."""

from __future__ import annotations

import copy
import math
import multiprocessing
import pickle
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
import pytest

import seatrial as st
from seatrial.core.executors import dask
from seatrial.identify.resume import digest
from seatrial.ships.files import load as load_house

TURN = st.Turning(rudder_deg=35)
pytestmark = pytest.mark.filterwarnings("ignore:.*not over after")
WAYS: dict[str, Callable[[Any], Any]] = {
    "pickle": lambda one: pickle.loads(pickle.dumps(one)), "deepcopy": copy.deepcopy, "copy": copy.copy,
}  # fmt: skip


def advance(ship: st.Ship) -> float:
    return ship.simulate(TURN, duration=150.0).indices["advance"].value


@pytest.fixture(scope="module")
def ship() -> st.Ship:
    return st.load("kvlcc2_l7")


@pytest.fixture(scope="module")
def fit(ship: st.Ship) -> st.Fit:
    run = ship.simulate(TURN, duration=60.0).with_noise({"psi": 0.002, "u": 0.005}, seed=1)
    return st.fit(st.Problem(ship, (run,), st.near(ship, "hull.N_r", ratio=0.3)))


def test_equal_ships_have_one_hash(ship: st.Ship) -> None:
    """Whatever model they are; and a ship of other numbers is another key."""
    for name in ("kvlcc2_l7", "kvlcc2_l7_arx", "kvlcc2_harbour", "mariner"):
        for read in (st.load, load_house):
            one = read(name)
            other = pickle.loads(pickle.dumps(one))  # of the library a process holds one only
            assert one is not other
            assert (one == other, hash(one) == hash(other)) == (True, True)
    changed = ship.having({"hull.N_r": -0.05})
    assert {ship: 1, changed: 2}[st.load("kvlcc2_l7")] == 1
    assert hash(changed) != hash(ship)
    assert hash(ship.having({"hull.N_r": -0.05})) == hash(changed)
    assert len({ship, st.load("kvlcc2_l7"), changed}) == 2


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_a_copied_ship_is_the_same_ship(way: Callable[[Any], Any], ship: st.Ship) -> None:
    other = way(ship)
    assert (other == ship, hash(other) == hash(ship), type(other)) == (True, True, st.Ship)
    assert advance(other) == advance(ship)


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_a_copied_run_problem_or_fit_is_the_same(way: Callable[[Any], Any], ship: st.Ship, fit: st.Fit) -> None:
    run = ship.simulate(TURN, duration=60.0)
    again = way(run)
    assert all(np.array_equal(run[name], again[name], equal_nan=True) for name in run.channels)
    assert {k: v.value for k, v in again.indices.items()} == {k: v.value for k, v in run.indices.items()}
    other = way(fit)
    assert (other.values.tolist(), other.covariance.tolist()) == (fit.values.tolist(), fit.covariance.tolist())
    assert other.digest == fit.digest
    problem = st.Problem(ship, (run,), st.near(ship, "hull.N_r", ratio=0.3))
    assert digest(way(problem), st.Trajectory()) == digest(problem, st.Trajectory())
    assert [one.path for one in way(problem).free] == ["hull.N_r"]


def elsewhere(ship: st.Ship, fit: st.Fit) -> tuple[st.Ship, st.Fit, float, float, float]:
    return ship, fit, advance(ship), advance(fit.ship), ship.equations(0.1).rates(*_point(ship)).full()[3, 0]


def _point(ship: st.Ship) -> tuple[list[float], list[float], list[float]]:
    return [0.0, 0.0, 0.0, ship.speed, 0.1, 0.02], [10.0, math.radians(10.0)], [0.0] * 8


def _same(told: tuple[st.Ship, st.Fit, float, float, float], ship: st.Ship, fit: st.Fit) -> None:
    assert (told[0] == ship, told[0] in {ship}) == (True, True)
    assert told[1].values.tolist() == fit.values.tolist()
    assert told[2:] == elsewhere(ship, fit)[2:]


@pytest.mark.slow
def test_they_travel_to_another_process(ship: st.Ship, fit: st.Fit) -> None:
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        _same(pool.submit(elsewhere, ship, fit).result(), ship, fit)


@pytest.mark.slow
def test_they_travel_to_a_dask_worker(ship: st.Ship, fit: st.Fit) -> None:
    pytest.importorskip("distributed")
    with dask("local:1") as pool:
        _same(pool.submit(elsewhere, ship, fit).result(), ship, fit)


@pytest.mark.parametrize("way", [*list(WAYS.values())[:2]], ids=["pickle", "deepcopy"])
def test_equations_survive_the_trip(way: Callable[[Any], Any], ship: st.Ship) -> None:
    equations, point = ship.equations(0.1), _point(ship)
    other = way(equations)
    assert np.array_equal(other.rates(*point).full(), equations.rates(*point).full())
    assert np.array_equal(other.step(*point, 0.1).full(), equations.step(*point, 0.1).full())
