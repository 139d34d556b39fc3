"""Normal equations with nuisances: on a linear problem one step is the least-squares answer of everything at once."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.identify import StudyError
from seatrial.identify.trajectory.gauss_newton import Block, Normal, State, minimise
from seatrial.identify.trajectory.shooting import Trajectory

# A speed log with a scale error p, runs up and down a measured mile, each pair in a current of its own.
SPEED, HOURS = np.array([10.0, 10.2, 9.9, 10.1]), np.array([0.100, 0.098, 0.101, 0.099])
AGAINST = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])


class Mile:
    """Distance run over ground, log scale and the currents of the two pairs as nuisances with a prior."""

    def __init__(self, found: np.ndarray) -> None:
        self.A, self.B, self.found = (SPEED * HOURS)[:, None], AGAINST * HOURS[:, None], found
        self.weight = 1e-4

    def costs(self, p: np.ndarray, eta: np.ndarray, which: np.ndarray) -> np.ndarray:
        return np.array([self.cost(*one) for one in zip(p, eta, strict=True)])

    def normals(self, p: np.ndarray, eta: np.ndarray, which: np.ndarray) -> Normal:
        return Normal.stacked([self.normal(*one) for one in zip(p, eta, strict=True)])

    def cost(self, p: np.ndarray, eta: np.ndarray) -> float:
        miss = self.found - self.A @ p - self.B @ eta
        return float(miss @ miss + self.weight * eta @ eta)

    def normal(self, p: np.ndarray, eta: np.ndarray) -> Normal:
        miss = self.found - self.A @ p - self.B @ eta
        own = (self.B * self.B).sum(axis=0) + self.weight
        gradient = -self.B.T @ miss + self.weight * eta
        pairs = Block(np.arange(2)[:, None], own[:, None, None], (self.B.T @ self.A)[:, None], gradient[:, None])
        return Normal(self.cost(p, eta), self.A.T @ self.A, -self.A.T @ miss, (pairs,))


def test_one_step_finds_the_log_and_both_currents() -> None:
    truth, currents = np.array([1.04]), np.array([0.6, -0.9])
    mile = Mile((SPEED * truth + AGAINST @ currents) * HOURS + 1e-3 * np.array([1.0, -2.0, 1.5, 0.5]))
    rows = np.block([[mile.A, mile.B], [np.zeros((2, 1)), np.sqrt(mile.weight) * np.eye(2)]])
    exact = np.linalg.lstsq(rows, np.concatenate([mile.found, np.zeros(2)]), rcond=None)[0]
    far = State(np.array([0.7]), np.array([2.0, 2.0]), np.inf, damping=1e-12)
    end = minimise(mile, far, np.array([0.1]), np.array([2.0]), iterations=1, tolerance=1e-12, each=lambda _: None)
    assert [*end.p, *end.eta] == pytest.approx(exact, rel=1e-6)


def test_it_says_converged_once_a_step_gains_no_more_than_the_tolerance() -> None:
    mile = Mile((SPEED * 1.04 + AGAINST @ [0.6, -0.9]) * HOURS + 1e-3 * np.array([1.0, -2.0, 1.5, 0.5]))
    begun = State(np.array([0.7]), np.zeros(2), mile.cost(np.array([0.7]), np.zeros(2)))
    costs: list[float] = []
    end = minimise(mile, begun, np.array([0.1]), np.array([2.0]), iterations=60, tolerance=1e-6,
                   each=lambda state: costs.append(state.cost))  # fmt: skip
    assert end.done == "converged"
    assert end.iteration == len(costs) < 20
    assert costs[-2] - costs[-1] <= 1e-6 * costs[-1]
    before = minimise(mile, begun, np.array([0.1]), np.array([2.0]), iterations=1, tolerance=1e-6, each=lambda _: None)
    assert before.done == "stopped after 1 iterations", "a step that gains much is none to stop at"


def test_a_step_that_damping_made_short_ends_no_descent() -> None:
    mile = Mile((SPEED * 1.04 + AGAINST @ [0.6, -0.9]) * HOURS + 1e-3 * np.array([1.0, -2.0, 1.5, 0.5]))
    rows = np.block([[mile.A, mile.B], [np.zeros((2, 1)), np.sqrt(mile.weight) * np.eye(2)]])
    exact = np.linalg.lstsq(rows, np.concatenate([mile.found, np.zeros(2)]), rcond=None)[0]
    near = np.array([0.7]), np.zeros(2)
    begun = State(*near, mile.cost(*near), damping=1e6)
    first = minimise(mile, begun, np.array([0.1]), np.array([2.0]), iterations=1, tolerance=1e-4, each=lambda _: None)
    assert 0.0 < begun.cost - first.cost < 1e-4 * begun.cost, "a step as short as ends a descent by its gain"
    assert not first.done.startswith("converged")
    end = minimise(mile, begun, np.array([0.1]), np.array([2.0]), iterations=60, tolerance=1e-4, each=lambda _: None)
    assert end.done == "converged"
    assert [*end.p, *end.eta] == pytest.approx(exact, rel=1e-2)
    # what a step promises is what it gains where all is linear, and at a bound what may be had there
    normal = Normal.stacked([mile.normal(*near)])
    moving = np.ones((1, 1), dtype=bool)
    whole = normal.promised(near[0][None], np.array([0.1]), np.array([2.0]), moving)
    best = float(np.sum((rows @ exact - np.concatenate([mile.found, np.zeros(2)])) ** 2))
    settled = mile.normal(*near)
    eta = near[1] + settled.stacked([settled]).alone()[0]
    assert whole[0] == pytest.approx(mile.cost(near[0], eta) - best, rel=1e-6)
    assert normal.promised(near[0][None], np.array([0.1]), near[0], moving)[0] == pytest.approx(0.0, abs=1e-12)


def test_at_a_bound_the_currents_take_what_the_log_may_not() -> None:
    mile = Mile((SPEED * 1.04 + AGAINST @ [0.6, -0.9]) * HOURS)
    far = State(np.array([0.9]), np.zeros(2), np.inf, damping=1e-12)
    end = minimise(mile, far, np.array([0.5]), np.array([1.0]), iterations=1, tolerance=1e-12, each=lambda _: None)
    rows = np.vstack([mile.B, np.sqrt(mile.weight) * np.eye(2)])
    left = np.linalg.lstsq(rows, np.concatenate([mile.found - mile.A @ [1.0], np.zeros(2)]), rcond=None)[0]
    assert end.p[0] == 1.0
    assert end.eta == pytest.approx(left, rel=1e-6)


@pytest.mark.parametrize(("pattern", "told"), [("rudder.*", "no"), ("hull.*", "every")])
def test_parameters_that_join_later_are_some_of_the_free_ones(pattern: str, told: str) -> None:
    problem: Any = SimpleNamespace(free=tuple(SimpleNamespace(path=one) for one in ("hull.N_r", "hull.Y_v")))
    with pytest.raises(StudyError, match=f"later fits {told} free parameter"):
        Trajectory(window=30.0, later=(pattern,))._begun(problem, None)
