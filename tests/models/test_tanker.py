"""The tanker of van Berlekom and Goddard: figures in deep water, terms as printed, shallow water, odd corners."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import update
from seatrial.environment import CALM, Environment, Uniform
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load, save
from seatrial.simulate.run import simulate

GOLDEN = tomllib.loads((Path(__file__).parents[1] / "golden" / "tanker.toml").read_text())
SPEED, N = GOLDEN["straight"]["speed"], GOLDEN["straight"]["rpm"] / 60.0
State = tuple[float, ...]


def test_straight_run() -> None:
    rates = load("esso_190k_tanker").model.derivative((0.0, 0.0, 0.0, SPEED, 0.0, 0.0), (N, 0.0), CALM)
    assert rates[3] == pytest.approx(GOLDEN["straight"]["surge"], abs=0.05e-5)


@pytest.mark.parametrize("side", [1, -1])
def test_turning(side: int) -> None:
    ship, policy = load("esso_190k_tanker"), Turning(N, side * math.radians(35))
    trial = simulate(ship, policy, duration=1500.0, dt=0.5)
    assert side * trial.channels["psi"][-1] > 0
    found = policy.indices(trial, ship.L_pp)
    for name, key in (("advance", "advance"), ("tactical_diameter", "tactical")):
        low, high = GOLDEN["turning"][key]
        assert low - 0.05 <= found[name].over_L < high + 0.05, name


def test_zigzag_by_the_logic_of_mss() -> None:
    """Euler steps of 0.1 s; the rudder with its lag of 1 s and 2.33 deg/s, the propeller held."""
    ship = load("esso_190k_tanker")
    model, rudder, h = ship.model, ship.actuators.of("delta"), 0.1
    x: State = (0.0, 0.0, 0.0, SPEED, 0.0, 0.0)
    delta, side, headings, reversals = 0.0, 1.0, [0.0], 0
    while reversals < 3:
        if side * headings[-1] >= 10:
            side, reversals = -side, reversals + 1
        headings.append(math.degrees(x[2]))
        rate = model.derivative(x, (N, delta), CALM)
        x = tuple(a + h * b for a, b in zip(x, rate, strict=True))
        delta += h * max(-rudder.rate, min(rudder.rate, (side * math.radians(10) - delta) / rudder.lag))
    assert max(headings) - 10 == pytest.approx(GOLDEN["zigzag"]["overshoot1"], abs=0.05)
    assert -min(headings) - 10 == pytest.approx(GOLDEN["zigzag"]["overshoot2"], abs=0.05)


def test_zigzag_by_simulate() -> None:
    ship, policy = load("esso_190k_tanker"), Zigzag(N, math.radians(10), math.radians(10), 1.0)
    found = policy.indices(simulate(ship, policy, duration=900.0, dt=0.1), ship.L_pp)
    assert math.degrees(found["first_overshoot"].value) == pytest.approx(6.3, abs=0.05)
    assert math.degrees(found["second_overshoot"].value) == pytest.approx(14.8, abs=0.1)  # 14.74 without Euler's error


def printed(u: float, v: float, r: float, n: float, delta: float, z: float) -> tuple[float, float, float]:
    """Rates by the equations as they are printed, positive rudder to port; deep and shallow."""
    L, t = 304.8, 0.22
    beta, c = math.atan(v / u), math.sqrt(0.605 * u * n + 38.2 * n * n)
    gT = -0.00695 * u * u / L - 0.00063 * u * n + 0.0000354 * L * n * abs(n)
    b3 = c * c * abs(beta) * beta * abs(delta)
    gX = (-0.0377 * u * u + L * 2.02 * v * r + 0.3 * v * v - 0.093 * c * c * delta**2 + 0.152 * c * c * beta * delta
          + L * gT * (1 - t) - 0.0061 * u * u * z + L * 0.387 * v * r * z + 0.0125 * v * v * z * z) / L  # fmt: skip
    uvz = -0.85 * (1 - 0.8 / z) if z >= 0.8 else 0.0
    gY = (-1.205 * u * v - 2.4 * abs(v) * v + 0.208 * c * c * delta - L * 0.752 * u * r - 2.16 * b3 + 0.04 * gT * L
          + L * 0.182 * u * r * z + uvz * u * v * z - 1.5 * abs(v) * v * z - 0.191 * b3 * z) / L  # fmt: skip
    gLN = (-0.451 * u * v - L * 0.3 * abs(v) * r - 0.098 * c * c * delta - L * 0.231 * u * r + 0.688 * b3
           - L * 0.02 * gT - L * 0.047 * u * r * z - 0.241 * u * v * z - L * 0.12 * abs(v) * r * z
           + 0.344 * b3 * z)  # fmt: skip
    return (gX / (1.05 + 0.05 * z), gY / (2.02 + 0.387 * z), gLN / (L * L * (0.1232 + 0.0045 * z)))


@pytest.mark.parametrize("depth", [math.inf, 60.0, 40.0, 25.0])
def test_terms_as_printed(depth: float) -> None:
    model, d = load("esso_190k_tanker").model, 18.46
    z = 0.0 if math.isinf(depth) else d / (depth - d)
    random = np.random.default_rng(2).uniform(-1, 1, (20, 5))
    for u, v, r, n, delta in random * (3, 2, 0.01, 0.6, 0.6) + (5, 0, 0, 0.7, 0):
        found = model.derivative((0.0, 0.0, 0.0, u, v, r), (n, delta), Uniform(depth=depth).now())
        assert found[3:] == pytest.approx(printed(u, v, r, n, -delta, z), rel=1e-12, abs=1e-15)


@pytest.mark.slow
def test_shallow_water_widens_the_circle() -> None:
    ship, policy = load("esso_190k_tanker"), Turning(N, math.radians(35))
    tactical = [
        policy.indices(simulate(ship, policy, duration=2500.0, environment=Uniform(depth=depth)), ship.L_pp)[
            "tactical_diameter"
        ].value
        for depth in (math.inf, 40.0, 30.0, 25.0)
    ]
    assert tactical == sorted(tactical)
    assert tactical[-1] > 1.2 * tactical[0]


def test_aground_is_finite() -> None:
    model, dry = load("esso_190k_tanker").model, Environment(per_depth=1.0)
    assert np.isfinite(model.derivative((0.0, 0.0, 0.0, 5.0, 1.0, 0.01), (N, 0.3), dry)).all()


def test_a_standing_propeller_leaves_the_rudder_idle() -> None:
    model: Any = load("esso_190k_tanker").model
    for n in (0.0, -1.0):
        left, right = (model.derivative((0.0, 0.0, 0.0, 6.0, 0.3, 0.001), (n, d), CALM) for d in (-0.5, 0.5))
        assert left == right
    assert model.screw.flow(-8.0, 0.05) == 0.0  # c^2 would be negative: no root, no force


def test_silent_at_rest_and_stops_astern() -> None:
    model: Any = load("esso_190k_tanker").model
    assert model.derivative((0.0,) * 6, (0.0, 0.6), CALM) == (0.0,) * 6
    rates = model.derivative((0.0, 0.0, 0.0, -3.0, 0.2, 0.002), (0.0, 0.0), CALM)
    assert rates[3] > 0  # resistance brakes
    x: State = (0.0, 0.0, 0.0, SPEED, 0.0, 0.0)
    for _ in range(1500):  # crash astern, and on astern
        x = tuple(a + b for a, b in zip(x, model.derivative(x, (-N, 0.3), CALM), strict=True))
    assert -1.05 * SPEED < x[3] < 0
    assert all(map(math.isfinite, x))


def test_mirrored_without_the_side_force_of_the_screw() -> None:
    model: Any = load("esso_190k_tanker").model
    even = update(model, dict.fromkeys(model.asymmetries, 0.0))
    shallow = Uniform(depth=25.0).now()
    here = even.derivative((0.0, 0.0, 0.3, 7.0, -0.4, 0.005), (1.0, 0.2), shallow)
    there = even.derivative((0.0, 0.0, -0.3, 7.0, 0.4, -0.005), (1.0, -0.2), shallow)
    assert tuple(s * w for s, w in zip((1, -1, -1, 1, -1, -1), there, strict=True)) == pytest.approx(here, rel=1e-13)


def test_the_propeller_lags_fifty_seconds() -> None:
    """After a reversal order the revolutions have fallen to n (2/e - 1) when the lag has passed."""
    shaft = load("esso_190k_tanker").actuators.of("n_P")
    memory: State = (N,)
    for _ in range(100):
        _, memory = shaft.advance(memory, -N, 0.5)
    assert memory[0] == pytest.approx(N * (2 / math.e - 1), rel=1e-9)


def test_ship_file_round_trip(tmp_path: Path) -> None:
    ship = load("esso_190k_tanker")
    assert load(save(ship, tmp_path / "again.toml")).model == ship.model
