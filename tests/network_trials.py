"""What the tests of training train on: virtual runs of a known ship, and an untrained network of that ship."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

from seatrial.data import Trial
from seatrial.environment import Uniform
from seatrial.identify import Problem
from seatrial.manoeuvres.human_random import HumanRandom
from seatrial.models.network import Network
from seatrial.models.neural import Neural
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

TRUTH = load("esso_osaka_3m")


@cache
def virtual(seed: int, duration: float = 60.0) -> Trial:
    """A random run in a wind that depends on the seed."""
    wind = Uniform(U_T=1.0, gamma_T=math.fmod(0.7 * seed, 2.0 * math.pi))
    policy = HumanRandom(n_P=10.0, delta=0.6, seed=seed)
    return simulate(
        TRUTH, policy, speed=0.3, duration=duration, dt=0.1, method="euler", environment=wind, name=f"random {seed}"
    )


def untrained(kind: str = "forgetting", layers: tuple[int, ...] = (8, 8), memory: int = 3, **form: Any) -> Ship:
    """A ship with a network that is yet to be trained."""
    memory = {"forgetting": memory, "feedforward": 1}.get(kind, 0)
    model = Neural(dt=0.1, network=Network(kind, layers, memory=memory, **form))
    return replace(TRUTH, name="net", model=model, entries={})


def problem(ship: Ship | None = None, trials: int = 2, duration: float = 60.0) -> Problem:
    """Some random runs, and another for validation."""
    runs = tuple(virtual(seed, duration) for seed in range(1, trials + 1))
    return Problem(ship or untrained(), runs, (), validation=(virtual(9, duration),))
