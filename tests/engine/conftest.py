"""Ships and lanes that the engine's tests share."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seatrial.data import Array
from seatrial.models import unit
from seatrial.ships.files import load
from seatrial.simulate import open_loop, open_loop_parameters

CONTROL = {"kvlcc2": (1.78, 0.3), "kvlcc2_l7": (11.85, 0.3), "esso_osaka_3m": (10.0, 0.3),
           "mariner_nomoto": (0.0, 0.1), "zeefakkel": (0.0, 0.1)}  # fmt: skip


class Case:
    """A ship of the library under open-loop control, with its usual size of everything."""

    def __init__(self, name: str) -> None:
        self.ship: Any = load(name)
        self.system = open_loop(self.ship)
        self.parameters = open_loop_parameters(self.ship)
        self.n_P, self.delta = CONTROL.get(name, (10.0, 0.2))
        U, L = self.ship.speed, self.ship.L_pp
        self.U, self.dt = U, 0.02 * L / U
        extra = len(self.system.states) - 6
        self.size = np.array([L, L, 3.0, U, 0.2 * U, 0.4 * U / L, *([0.1 * U / L] * extra)])

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
        """Rudder that wanders, revolutions held, a breeze and a current."""
        rng = np.random.default_rng(seed)
        controls = self.ship.model.controls
        s = np.zeros((lanes, steps, len(self.system.series)))
        for k, name in enumerate(controls):
            if unit(name) == "rad":
                s[:, :, k] = self.delta * np.sin(np.linspace(0, 6, steps) + rng.uniform(0, 6, (lanes, 1)))
            else:
                s[:, :, k] = self.n_P * rng.uniform(0.9, 1.1, (lanes, 1))
        n = len(controls)
        s[:, :, n : n + 2] = self.U * rng.uniform(-2, 2, (lanes, 1, 2))
        s[:, :, n + 2 : n + 4] = self.U * rng.uniform(-0.1, 0.1, (lanes, 1, 2))
        return s


@pytest.fixture
def l7() -> Case:
    return Case("kvlcc2_l7")


@pytest.fixture
def case(request: Any) -> Case:
    return Case(request.param)
