"""A network for the probes, as the library has no ship of that family: one that was taught by a ship it has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..actuators import Actuators
from ..engine.rollout import simulator
from ..environment import CHANNELS
from ..models.network import Network, initial
from ..models.network_pass import prepared
from ..models.neural import Neural, features
from ..ships import Ship
from ..ships.files import load
from ..systems import open_loop, open_loop_parameters

TEACHER = "esso_osaka_3m"
_UNITS, _SAMPLES, _RIDGE = 300, 6000, 1e-7
_GAINS = {"W_x0": 2.0, "W_u0": 2.0, "W_w0": 0.5, "b_0": 8.0, "W_1": 1.0}
# Largest u, v_m, r, n_P, delta and true wind that it was taught at.
_RANGE = np.array([0.6, 0.3, 0.2, 18.0, 0.6, 5.0, 5.0])


def taught_network() -> Ship:
    """A feed-forward network whose last layer is fitted to the accelerations of the 3 m model, without any data.

    Its first layer is drawn: least squares suffice then, and the network answers as its teacher did at random
    motions, controls and winds.
    """
    base = load(TEACHER)
    drawn = initial(Network("feedforward", (_UNITS,), memory=1, scale=tuple(0.3 * _RANGE)), 1)
    x = np.random.default_rng(1).uniform(-1.0, 1.0, (_SAMPLES, _RANGE.size)) * _RANGE
    state = np.hstack([np.zeros((_SAMPLES, 3)), x[:, :3]])
    acting = np.hstack([x[:, 3:], np.zeros((_SAMPLES, len(CHANNELS) - 2))])
    system = open_loop(base)
    answers = simulator(system).evaluate(state, acting, open_loop_parameters(base))[:, 3:6]
    w = {name: _GAINS[name] * array for name, array in drawn.weights.items()}
    ready = prepared(drawn.having(w), np.float64)
    z = np.tanh(features(drawn, state, acting) @ ready["W_x"] + ready["b_0"]) - np.tanh(ready["b_0"])
    normal = z.T @ z + _RIDGE * _SAMPLES * np.eye(_UNITS)
    w["W_1"] = np.linalg.solve(normal, z.T @ answers).astype(np.float64)
    model = Neural(dt=0.1, network=drawn.having(w))
    return replace(base, name=f"{TEACHER}, as a network", model=model, actuators=Actuators(), entries={}, n_P=None)
