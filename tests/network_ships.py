"""Ships that move by untrained networks, of any kind."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from seatrial.models.network import KINDS, Limits, Network, initial
from seatrial.models.neural import Neural
from seatrial.ships import Ship
from seatrial.ships.files import load

SCALE = (0.3, 0.1, 0.05, 10.0, 0.5, 3.0, 3.0)
MEMORY = {"feedforward": 1, "forgetting": 5}
LIMITS = Limits((-0.8, -0.3, -0.2, -20, -0.8, -8, -8), (0.8, 0.3, 0.2, 20, 0.8, 8, 8), (0.1, 0.05, 0.05))
__all__ = ["KINDS", "LIMITS", "SCALE", "network", "sailing"]


def network(kind: str = "forgetting", layers: tuple[int, ...] = (14, 9), gain: float = 0.05, **form: Any) -> Network:
    """A network of random weights; `gain` makes its accelerations those of a model ship."""
    form = {"memory": MEMORY.get(kind, 0), "scale": SCALE[: 7 if form.get("wind", True) else 5]} | form
    drawn = initial(Network(kind, layers, **form), seed=4)
    last = f"W_{len(layers)}"
    return drawn.having({**drawn.weights, last: gain * drawn.weights[last]})


def sailing(net: Network, dt: float = 0.1) -> Ship:
    """A three-metre ship that moves by it."""
    base = load("esso_osaka_3m")
    return replace(base, name="net", model=Neural(dt=dt, network=net), n_P=10.0, validity={}, entries={}, notes={})


def inputs(lanes: int, samples: int, width: int = 7) -> Any:
    """Inputs of usual size, at random."""
    return np.random.default_rng(8).normal(size=(lanes, samples, width)) * np.array(SCALE[:width])
