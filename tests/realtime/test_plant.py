"""A ship to be steered: the same run as `simulate`, orders by name, state saved and restored."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from network_ships import network, sailing
from seatrial.engine import SimulationError
from seatrial.environment import Environment, Uniform
from seatrial.environment.weather import Gust
from seatrial.manoeuvres import Policy
from seatrial.models import STATES
from seatrial.realtime.plant import CommandError, Compiled, Plant
from seatrial.ships import ShipError
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

DT = 0.1


@dataclass(frozen=True)
class Hard(Policy):
    """Rudder and revolutions that hold."""

    memory: ClassVar[tuple[str, ...]] = ()
    n_P: float
    delta: float

    def begin(self, state):
        return ()

    def command(self, t, state, memory):
        return (self.n_P, self.delta), memory


@pytest.fixture(scope="module")
def compiled() -> Compiled:
    return Compiled.of(load("kvlcc2_l7"), DT)


def sailed(plant: Plant, steps: int) -> np.ndarray:
    rows = []
    for _ in range(steps):
        plant.step()
        rows.append([plant[name] for name in STATES])
    return np.array(rows)


def test_a_turn_is_that_of_simulate_bit_for_bit(compiled):
    ship, plant = compiled.ship, compiled.plant()
    run = simulate(ship, Hard(plant["n_P"], 0.3), duration=30.0, dt=DT)
    plant.order("delta", 0.3)
    assert sailed(plant, 300).tolist() == run.stack(*STATES)[1:].tolist()
    assert plant["delta"] == run["delta"][-1]
    assert plant["r"] > 0.0  # delta > 0 turns to starboard


def test_gusts_are_those_of_simulate(compiled):
    weather = Gust(Uniform(U_T=3.0, gamma_T=1.0), seed=3)
    plant = compiled.plant(environment=weather)
    run = simulate(compiled.ship, Hard(plant["n_P"], 0.0), duration=20.0, dt=DT, environment=weather)
    found = sailed(plant, 200)
    np.testing.assert_allclose(found, run.stack(*STATES)[1:], rtol=1e-12, atol=1e-12)


def test_two_of_one_kernel_do_not_see_each_other(compiled):
    one, other = compiled.plant(), compiled.plant()
    one.order("delta", 0.5)
    sailed(one, 50)
    assert other.t == 0.0
    assert other["psi"] == 0.0
    sailed(other, 50)
    assert other["psi"] != one["psi"]


@pytest.mark.parametrize("environment", [None, Gust(Uniform(U_T=3.0), seed=1)], ids=["calm", "gusts"])
def test_a_snapshot_goes_on_as_the_ship_did(compiled, environment):
    plant = compiled.plant(environment=environment)
    plant.order("delta", -0.4)
    sailed(plant, 15)  # the rudder is still on its way
    saved = plant.snapshot()
    onward = sailed(plant, 40)
    other = compiled.plant(environment=environment)
    other.restore(saved)
    assert sailed(other, 40).tolist() == onward.tolist()
    plant.restore(saved)
    assert sailed(plant, 40).tolist() == onward.tolist()
    plant.reset()
    assert plant.t == 0.0
    assert plant["delta_cmd"] == 0.0


def test_surroundings_that_are_set_are_felt_and_saved(compiled):
    plant = compiled.plant()
    plant.surround(Uniform(U_C=0.5, gamma_C=math.pi / 2).now())
    assert plant["current_y"] == pytest.approx(0.5)
    plant.step()
    saved, here = plant.snapshot(), plant["current_y"]
    onward = sailed(plant, 20)
    assert onward[-1, 1] > 0.1
    plant.reset()
    assert plant["current_y"] == 0.0
    plant.restore(saved)
    assert plant["current_y"] == here
    assert sailed(plant, 20).tolist() == onward.tolist()


def test_orders_are_clipped_to_the_gear_and_read_back(compiled):
    plant = compiled.plant()
    low, high = plant.ranges["delta"].low, plant.ranges["delta"].high
    assert plant.order("delta", 2.0) == high == plant["delta_cmd"]
    assert plant.order("delta", -2.0) == low


def test_what_follows_the_rudder_takes_its_order():
    plant = Plant.of(load("milliampere"), dt=0.1)
    assert {"delta", "n_P"} <= set(plant.orders)
    before = {name: plant[f"{name}_cmd"] for name in plant.controls}
    plant.order("delta", 0.2)
    assert any(plant[f"{name}_cmd"] != before[name] for name in plant.controls)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["kvlcc2_l7_arx", "mariner_nomoto2", "esso_osaka_3m", "suzaku", "cybership2"])
def test_every_family_sails_and_is_saved(name):
    from seatrial.simulate.run import time_step

    plant = Plant.of(load(name), dt=time_step(load(name)))
    for control in plant.controls:
        plant.order(control, 0.1)
    sailed(plant, 5)
    saved = plant.snapshot()
    onward = sailed(plant, 5)
    plant.restore(saved)
    assert sailed(plant, 5).tolist() == onward.tolist()


def test_without_a_compiler_the_ship_moves_the_same(compiled, monkeypatch):
    monkeypatch.setenv("SEATRIAL_CC", "none")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # said once per process, perhaps before
        slow = Plant.of(compiled.ship, dt=DT)
    fast = compiled.plant()
    for plant in (slow, fast):
        plant.order("delta", 0.3)
    np.testing.assert_allclose(sailed(slow, 20), sailed(fast, 20), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("kind", ["feedforward", "forgetting", "lstm"])
def test_a_network_sails_as_in_simulate_and_is_saved(kind):
    ship = sailing(network(kind))
    plant = Plant.of(ship, dt=DT, n_P=10.0)
    plant.order("delta", 0.2)
    run = simulate(ship, Hard(10.0, 0.2), duration=4.0, dt=DT)
    np.testing.assert_allclose(sailed(plant, 40), run.stack(*STATES)[1:], rtol=1e-5, atol=1e-6)
    saved = plant.snapshot()
    onward = sailed(plant, 20)
    plant.restore(saved)
    assert sailed(plant, 20).tolist() == onward.tolist()


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [("rudder", 0.1, "no control 'rudder'"), ("delta", math.nan, "finite"), ("n_P", math.inf, "finite")],
)
def test_an_order_that_cannot_be_is_refused(compiled, name, value, text):
    plant = compiled.plant()
    with pytest.raises(CommandError, match=text):
        plant.order(name, value)
    assert plant["delta_cmd"] == 0.0


def test_what_cannot_be_started_or_restored_is_refused(compiled):
    with pytest.raises(ShipError, match="above zero"):
        Compiled.of(compiled.ship, 0.0)
    with pytest.raises(ShipError, match="its own step"):
        Compiled.of(load("kvlcc2_l7_arx"), 0.0123)
    with pytest.raises(ShipError, match="six finite numbers"):
        compiled.plant(start=(0.0, 0.0, math.nan, 1.0, 0.0, 0.0))
    plant = compiled.plant()
    other = Plant.of(load("kcs"), dt=DT).snapshot()
    for saved in (b"", b"nothing", b"{}\n", other, plant.snapshot()[:-8]):
        with pytest.raises(ShipError, match="saved state"):
            plant.restore(saved)
    with pytest.raises(CommandError, match="finite"):
        plant.surround(Environment(wind_x=math.nan))
    with pytest.raises(KeyError, match="no value 'heading'"):
        plant["heading"]


def test_a_ship_that_blows_up_says_so(compiled):
    plant = compiled.plant(start=(0.0, 0.0, 0.0, 1e200, 1e200, 1e200), n_P=1.0)
    with pytest.raises(SimulationError, match=r"at t = "):
        sailed(plant, 50)


def test_outside_its_validity_is_reported():
    plant = Plant.of(load("kvlcc2"), dt=0.5)
    assert plant.outside() is None
    plant.order("n_P", -1.0)
    low = plant.ship.validity["u"][0]
    while plant["u"] >= low and plant.t < 4000.0:
        plant.step()
    assert plant.outside() == ("u", plant["u"])


def test_a_current_takes_the_ship_not_out_of_its_validity():
    """It is the velocity through the water that the file speaks of."""
    plant = Plant.of(load("kcs"), dt=0.5, environment=Uniform(U_C=2.0))
    assert plant["u"] > plant.ship.validity["u"][1]
    assert plant.outside() is None
    plant.surround(Uniform(U_C=2.0, gamma_C=math.pi).now())
    found = plant.outside()
    assert found is not None
    assert found[0] == "u"
    assert found[1] == pytest.approx(plant["u"] + 2.0)
