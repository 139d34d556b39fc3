"""A network exported to Python: the same track as the engine's, in a file that has no seatrial."""

from __future__ import annotations

import runpy
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.engine.rollout import simulator
from seatrial.environment import Uniform
from seatrial.exchange import equations_of, save_network
from seatrial.models.network import KINDS, Limits, Network, initial
from seatrial.models.neural import Neural
from seatrial.ships import Ship, ShipError
from seatrial.ships.files import load
from seatrial.simulate.loop import open_loop, open_loop_parameters

MEMORY = {"feedforward": 1, "forgetting": 4}
LIMITS = Limits((-0.5, -0.2, -0.2, -9.0, -0.3), (0.5, 0.2, 0.2, 9.0, 0.3), (0.02, 0.02, 0.02), 2.0)


def ship_of(net: Network, name: str = "net") -> Ship:
    return replace(load("esso_osaka_3m"), name=name, model=Neural(dt=0.1, network=net), notes={}, validity={})


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("limits", [None, LIMITS], ids=["free", "bounded"])
def test_the_exported_step_is_the_engines(kind: str, limits: Limits | None, tmp_path: Path) -> None:
    wind = limits is None
    net = initial(Network(kind, (8, 7), wind=wind, memory=MEMORY.get(kind, 0), limits=limits), 3)
    ship = ship_of(net.having({**net.weights, "W_2": 0.02 * net.weights["W_2"]}))
    written = save_network(ship, tmp_path / "net.py")
    assert sorted(path.name for path in written) == ["net.npz", "net.py"]
    module = runpy.run_path(str(tmp_path / "net.py"))
    around = Uniform(U_T=2.0, gamma_T=0.5, U_C=0.1, gamma_C=2.0).now()
    steps, start = 60, (0.0, 0.0, 0.2, 0.6, -0.05, 0.02)
    series = np.array([[[8 + k % 5, 0.4 * np.sin(0.3 * k), *around] for k in range(steps)]])
    run = simulator(open_loop(ship)).run(
        np.array([start]), series, open_loop_parameters(ship), dt=0.1, steps=steps,
        memory0=np.zeros((1, len(open_loop(ship).hidden))))  # fmt: skip
    x, memory = start, None
    for k in range(steps):
        assert run.values[0, k] == pytest.approx(x, abs=1e-12)
        x, memory = module["step"](x, series[0, k, :2], around, memory)


@pytest.mark.slow
def test_the_module_needs_numpy_only(tmp_path: Path) -> None:
    save_network(ship_of(initial(Network("forgetting", (8,), memory=3), 3)), tmp_path / "net.py")
    code = "import net, sys; net.step((0,) * 6, (5.0, 0.1)); assert not {'seatrial', 'casadi'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)


def test_what_is_not_exported(tmp_path: Path) -> None:
    with pytest.raises(ShipError, match="no weights to export"):
        save_network(ship_of(Network("rnn", (8,))), tmp_path / "net.py")
    with pytest.raises(ShipError, match="--python"):
        equations_of(ship_of(initial(Network("rnn", (8,)), 1)))
    with pytest.raises(ShipError, match="no such folder"):
        save_network(ship_of(initial(Network("rnn", (8,)), 1)), tmp_path / "none" / "net.py")
