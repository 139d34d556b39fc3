"""Ships that nobody steers hold their course."""

from __future__ import annotations

import math

import pytest

from seatrial.environment import Uniform
from seatrial.realtime.loop import Loop
from seatrial.realtime.plant import plant_of
from seatrial.realtime.range.pilots import TrafficPilot
from seatrial.workflow.afloat.scenes import other_of


def sailing(text: str, weather: Uniform | None = None) -> tuple[Loop, str]:
    ship, begun = other_of(text)
    start = (begun.x, begun.y, begun.psi, begun.speed, 0.0, 0.0)
    loop = Loop({ship.name: plant_of(ship, 5.0, weather or Uniform(), start, 0)}, 5.0, math.inf)
    TrafficPilot(loop, ship.name, begun.legs)
    return loop, ship.name


@pytest.mark.parametrize("ship", ["mariner", "kvlcc2", "esso_190k_tanker", "mariner_nomoto"])
def test_it_holds_its_course(ship: str) -> None:
    loop, name = sailing(f"{ship}@500,500,270")
    plant = loop.vessels[name].plant
    worst = 0.0
    for _ in range(1000):
        loop.step()
        worst = max(worst, abs(plant["psi"] - 1.5 * math.pi))
    assert math.degrees(worst) < 1.5
    assert plant["y"] < 500.0 - 0.8 * plant.ship.speed * 200.0
    assert plant["x"] == pytest.approx(500.0, abs=0.05 * plant.ship.L_pp)


@pytest.mark.slow
def test_wind_and_current_do_not_set_it_off_its_course() -> None:
    loop, name = sailing("esso_osaka_3m@0,0,90", Uniform(U_T=1.0, gamma_T=0.3, U_C=0.05, gamma_C=0.0))
    plant = loop.vessels[name].plant
    for _ in range(2000):
        loop.step()
    assert abs(plant["x"]) < 0.5 * plant.ship.L_pp  # 20 m is what the current alone does
    assert plant["y"] > 100.0


def test_it_is_saved_restored_and_reset_with_the_ship() -> None:
    loop, name = sailing("mariner@0,0,90")
    plant = loop.vessels[name].plant
    for _ in range(100):
        loop.step()
    saved = loop.snapshot()

    def on() -> list[float]:
        for _ in range(100):
            loop.step()
        return [plant["psi"], plant["r"], plant["delta"]]

    first = on()
    loop.restore(saved)
    assert on() == first
    loop.reset()
    assert [on(), on()][1] == first
