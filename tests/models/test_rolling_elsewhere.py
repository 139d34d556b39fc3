"""What takes a ship takes one that rolls: plant, exports, campaigns, linearisation, scaling, comparison."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.belief.bands.manoeuvring import bands
from seatrial.campaign import Campaign, Case
from seatrial.campaign.chunk import compute
from seatrial.campaign.inputs import Input
from seatrial.environment import CALM, Uniform
from seatrial.exchange.fmi.fmu import slave
from seatrial.exchange.python_source import save_python
from seatrial.exchange.traced import equations_of as traced
from seatrial.manoeuvres.turning import Turning
from seatrial.models import ROLL, STATES
from seatrial.models.linear import straight
from seatrial.realtime.plant import Plant
from seatrial.ships import ShipError
from seatrial.ships.files import load
from seatrial.ships.rolled import Stability, with_roll
from seatrial.ships.scaling import scale
from seatrial.simulate.replay import replay
from seatrial.simulate.run import simulate
from seatrial.validate.comparison import compare, constant_velocity

SHIP: Any = load("container_son_nomoto")
TURN = Turning(80.0 / 60.0, math.radians(35.0))


def test_motion_is_what_sensors_measure() -> None:
    assert SHIP.model.motion == (*STATES, *ROLL)
    assert load("kvlcc2").model.motion == load("esso_osaka_3m_hybrid").model.motion == STATES


def test_a_plant_in_real_time_is_the_simulation() -> None:
    plant, trial = Plant.of(SHIP, dt=0.1), simulate(SHIP, TURN, duration=30.0, dt=0.1)
    plant.order("delta", TURN.delta)
    for _ in range(300):
        plant.step()
    assert plant["phi"] == pytest.approx(trial["phi"][300], rel=1e-9)
    heeled = Plant.of(SHIP, dt=0.1, start=(0.0, 0.0, 0.0, 8.0, 0.0, 0.0, 0.1, 0.0))
    assert heeled["phi"] == 0.1
    with pytest.raises(ShipError, match="six or eight"):
        Plant.of(SHIP, dt=0.1, start=(0.0, 0.0, 0.0, 8.0, 0.0, 0.0, 0.1))
    with pytest.raises(ShipError, match="six finite"):
        Plant.of(load("kvlcc2"), dt=0.1, start=(0.0, 0.0, 0.0, 8.0, 0.0, 0.0, 0.1, 0.0))


@pytest.mark.slow
def test_linear_about_a_straight_run() -> None:
    """Eigenvalues of sway, roll and yaw as linearised independently at 70 rpm: a roll of 28.9 s, two real roots."""
    found = straight(SHIP.model, 7.32959).lateral().eigenvalues
    for wanted in (-0.128044, -0.009447, complex(-0.009433, 0.217633)):
        assert np.abs(found - wanted).min() < 2e-6


@pytest.mark.slow
def test_exports_have_heel_and_the_same_rates(tmp_path: Path) -> None:
    names = {one.name for one in slave(SHIP).outputs}
    assert {"ned_position.roll", "body_velocity.roll"} <= names
    made = traced(SHIP)
    assert [one.name for one in made.states] == [*STATES, *ROLL]
    path = save_python(made, tmp_path / "ship.py")
    spec = importlib.util.spec_from_file_location("ship_of_test", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    x, u = (0.0, 0.0, 0.2, 8.0, 0.3, 0.005, 0.05, 0.002), (1.3, 0.1)
    wanted = SHIP.model.derivative(x, u, CALM)
    assert module.rates(x, u, tuple(CALM)) == pytest.approx(wanted, rel=1e-12, abs=1e-16)


@pytest.mark.slow
def test_a_campaign_reads_the_heel_of_each_run() -> None:
    case = Case("turn", SHIP, TURN, SHIP.speed, 120.0, 0.1)
    campaign = Campaign("heel", (case,), 8, {"ship.body.GM": Input("uniform", (0.25, 1.5))})
    table = compute(campaign, 0).columns
    stiff = np.argsort(table["ship.body.GM"])
    assert (np.diff(table["outward_heel"][stiff]) < 0.0).all()
    drawn = bands(SHIP, TURN, ("body.GM",), np.array([[0.3], [1.0]]), speed=SHIP.speed, duration=120.0, dt=0.1,
                  weather=Uniform())  # fmt: skip
    assert drawn.indices["outward_heel"][0] > 2.0 * drawn.indices["outward_heel"][1]


@pytest.mark.slow
def test_a_ship_with_roll_scales_by_froude() -> None:
    ship = with_roll(load("kvlcc2"), Stability(GM=5.7, KG=18.6))
    model = scale(ship, 3.2, effects=False).ship
    big = simulate(ship, Turning(1.6, 0.6), speed=7.0, duration=300.0, dt=0.5)
    small = simulate(model, Turning(16.0, 0.6), speed=0.7, duration=30.0, dt=0.05)
    assert small["phi"] == pytest.approx(big["phi"], abs=1e-9)
    assert small["p"] == pytest.approx(10.0 * big["p"], abs=1e-9)


def test_a_comparison_has_the_heel_and_its_baseline_none() -> None:
    log = simulate(SHIP, TURN, duration=200.0, dt=0.1, every=10)
    found = compare(log, replay(SHIP, log), label="itself", L_pp=SHIP.L_pp)
    assert set(found.metrics) == {*STATES, *ROLL}
    assert found.metrics["phi"].rmse < 1e-4
    assert not set(constant_velocity(log, None).channels) & set(ROLL)
    flat = compare(log, replay(load("kvlcc2"), log), label="without roll", L_pp=SHIP.L_pp)
    assert set(flat.metrics) == set(STATES)
