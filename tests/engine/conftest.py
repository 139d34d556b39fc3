"""Ships and lanes that the engine's tests share."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from seatrial.data import Array
from seatrial.models import Sampled, linear, unit
from seatrial.ships.files import load
from seatrial.simulate.run import approach, open_loop, open_loop_parameters, straight


class Case:
    """A ship of the library under open-loop control, with its usual size of everything."""

    def __init__(self, name: str) -> None:
        self.ship: Any = load(name)
        self.system = open_loop(self.ship)
        self.parameters = open_loop_parameters(self.ship)
        U, L = self.ship.speed, self.ship.L_pp
        self.model = self.ship.model
        self.U, self.dt = U, self.model.dt if isinstance(self.model, Sampled) else min(0.02 * L / U, step(self.ship))
        extra = len(self.system.states) - 6
        self.size = np.array([L, L, 3.0, U, 0.2 * U, 0.4 * U / L, *([0.1 * (U / L) ** 2] * extra)])
        # What runs at the approach keeps running; an angle goes from side to side; all else is tried a little.
        running = straight(self.ship, approach(self.ship)[1])
        push = max(map(abs, running), default=0.0) or 1.0
        self.angles = np.array([unit(name) == "rad" for name in self.model.controls])
        self.held = np.where(self.angles, 0.0, [x or 0.1 * push for x in running])

    def states(self, lanes: int, seed: int = 1) -> Array:
        """Initial states: ahead, astern and, in the first lane, at rest."""
        z = np.random.default_rng(seed).uniform(-1, 1, (lanes, len(self.size))) * self.size
        z[0] = 0.0
        return z

    def ahead(self, lanes: int, seed: int = 2) -> Array:
        """Initial states near the approach speed."""
        z = np.random.default_rng(seed).uniform(-0.1, 0.1, (lanes, len(self.size))) * self.size
        z[:, 3] += self.U
        return z

    def series(self, lanes: int, steps: int, seed: int = 3) -> Array:
        """Rudders that wander, revolutions held, a breeze, a current, waves and a bottom."""
        rng = np.random.default_rng(seed)
        n = len(self.held)
        s = np.zeros((lanes, steps, len(self.system.series)))
        wandering = 0.3 * np.sin(np.linspace(0, 6, steps)[None, :, None] + rng.uniform(0, 6, (lanes, 1, n)))
        s[:, :, :n] = np.where(self.angles, wandering, self.held * rng.uniform(0.9, 1.1, (lanes, 1, 1)))
        s[:, :, n : n + 2] = self.U * rng.uniform(-2, 2, (lanes, 1, 2))
        s[:, :, n + 2 : n + 4] = self.U * rng.uniform(-0.1, 0.1, (lanes, 1, 2))
        L = self.ship.L_pp
        s[:, :, n + 4 : n + 6] = 0.002 * L * rng.uniform(-1, 1, (lanes, 1, 2))
        s[:, :, n + 6] = L**0.5
        s[:, :, n + 7] = 5.0 / L * rng.uniform(0, 1, (lanes, 1))
        return s


    def memory(self, state: Array, series: Array) -> Array:
        """Memory of a sampled model at the start of each lane; none of another."""
        if not isinstance(self.model, Sampled):
            return np.zeros((len(state), 0))
        given = zip(state.tolist(), series[:, 0, : len(self.held)].tolist(), strict=True)
        return np.array([self.model.begin(tuple(z), tuple(c)) for z, c in given])


def step(ship: Any) -> float:
    """A step [s] at which Euler's method is stable near the approach, |1 + lambda dt| < 1, and four times as safe."""
    growth = linear.straight(ship.model, ship.speed).growth
    damped = growth[growth.real < 0]
    return float(np.min(-0.5 * damped.real / np.abs(damped) ** 2, initial=np.inf))


known = cache(Case)
"""Nothing in a case changes, so each is made once."""


@pytest.fixture
def l7() -> Case:
    return known("kvlcc2_l7")


@pytest.fixture
def case(request: Any) -> Case:
    return known(request.param)
