"""A ship on a chart: depth, banks and quays where it is, another ship, contact; what is refused; figures of a run."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import Parts
from seatrial.engine.cuda import DeviceError
from seatrial.engine.rollout import simulator
from seatrial.environment import Uniform
from seatrial.environment.chart import Area, Bank, Chart, Quay
from seatrial.environment.fenders import CURVES, Fender
from seatrial.forces import Flow, Force
from seatrial.forces.bank import Bank as Suction
from seatrial.forces.passing import Passing
from seatrial.manoeuvres import Given
from seatrial.ships import Ship, ShipError
from seatrial.ships.files import load
from seatrial.simulate.contacts import LIMIT, contact_indices, keel_indices, shallows
from seatrial.simulate.loop import closed_loop, loop_memory, loop_values
from seatrial.simulate.place import Other, place_of
from seatrial.simulate.run import simulate

SECTION = 0.998 * 58.0 * 20.8


def vessel(*extras: Any) -> Ship:
    """KVLCC2 in shallow water, free to go astern."""
    ship = load("kvlcc2_shallow")
    model: Any = ship.model
    names = tuple(f"extra_{k}" for k in range(len(extras)))
    return replace(ship, model=replace(model, extras=Parts(names, extras)), validity={})


def canal(width: float = 300.0) -> Chart:
    ends = np.array([[4000.0, 0.0], [-4000.0, 0.0]])
    east, west = np.array([0.0, 0.5 * width]), np.array([0.0, -0.5 * width])
    return Chart("canal", 25.0, banks=(Bank(ends + east), Bank(ends[::-1] + west)))


def run(ship: Ship, chart: Chart | None, start: tuple[float, ...], seconds: float = 60.0, **more: Any) -> Any:
    place = place_of(ship, chart, **{k: more.pop(k) for k in ("other", "lines", "touching") if k in more})
    return simulate(ship, Given(), duration=seconds, start=start, dt=0.5, place=place, **more), place


@pytest.mark.slow
def test_the_depth_of_a_chart_is_that_of_the_weather() -> None:
    """Without banks and quays a chart is a depth and nothing else."""
    even = Chart("even", 28.0, areas=(Area(np.array([[-1e4, -1e4], [1e4, -1e4], [1e4, 1e4], [-1e4, 1e4]]), 25.0),))
    start = (0.0, 0.0, 0.3, 5.0, 0.2, 0.003)
    here, _ = run(vessel(), even, start)
    there = simulate(vessel(), Given(), duration=60.0, start=start, dt=0.5, environment=Uniform(depth=25.0))
    for name in ("x", "y", "psi", "u", "v_m", "r"):
        assert here[name] == pytest.approx(there[name], rel=1e-12, abs=1e-12)
    assert here["depth"] == pytest.approx(25.0)


@pytest.mark.slow
def test_banks_draw_the_ship_to_the_nearer_one_and_turn_its_bow_off_and_mirror() -> None:
    ship = vessel(Suction(A_M=SECTION, x_bank=-0.1))
    right, _ = run(ship, canal(), (0.0, 60.0, 0.0, 4.0, 0.0, 0.0), 40.0)
    left, _ = run(ship, canal(), (0.0, -60.0, 0.0, 4.0, 0.0, 0.0), 40.0)
    middle, _ = run(ship, canal(), (0.0, 0.0, 0.0, 4.0, 0.0, 0.0), 40.0)
    assert right["v_m"][-1] > 1e-3
    assert right["psi"][-1] < -1e-4
    assert left["y"] == pytest.approx(-right["y"], abs=2e-3)  # the nodes of the grid are not its mirror image
    assert np.abs(middle["y"]).max() < 1e-4
    plain, _ = run(vessel(), canal(), (0.0, 60.0, 0.0, 4.0, 0.0, 0.0), 40.0)
    assert np.abs(plain["v_m"]).max() < 1e-9


@pytest.mark.slow
def test_another_ship_is_felt_as_it_passes() -> None:
    """Moored beside its course: pushed off first, drawn in abeam; not at all from far away."""
    ship = vessel(Passing(A_M=SECTION, B=58.0))
    other = Other(-480.0, 150.0, 0.0, 4.0, 320.0, SECTION)
    moored, _ = run(
        ship, Chart("open", 25.0, fairways=(np.array([[0.0, 0.0], [1.0, 0.0]]),)), (0.0,) * 6, 160.0, other=other
    )
    rate = np.gradient(moored["v_m"], moored.t)
    assert rate[4] < 0.0  # a length and a half astern
    assert rate[240] > 2e-4  # abeam after 120 s
    far, _ = run(ship, None, (0.0,) * 6, 20.0, other=replace(other, y=9000.0))
    assert not far["v_m"].any()


def quay(chi: float = 5.0) -> Chart:
    fender = Fender(CURVES["cone"], 2.0, 2.6e6, 120.0, chi=chi)
    return Chart("quay", 25.0, quays=(Quay(np.array([[370.0, 0.0], [130.0, 0.0]]), fender),))


@pytest.mark.slow
def test_a_ship_comes_to_lie_on_its_fenders_and_the_run_has_figures() -> None:
    ship, chart = vessel(), quay()
    trial, place = run(ship, chart, (250.0, -31.5, 0.0, 0.0, 0.06, 0.0), 60.0)
    assert place.grid is not None
    assert place.grid.stops == 2
    assert trial["y"].max() < -29.0 - 1.0  # of two metres of fender
    assert trial["v_m"][-1] < 0.01
    found = contact_indices(trial, ship, place)
    assert found["contact_speed"].value == pytest.approx(0.059, abs=2e-3)
    assert found["speed_limit"].value == pytest.approx(found["contact_speed"].value / LIMIT)
    assert found["contact_angle"].value == pytest.approx(0.0, abs=1e-3)
    model: Any = ship.model
    water = Flow(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1025.0, 320.0, 20.8, d_over_h=20.8 / 25.0)
    whole = 0.5 / model.answer(Force(0.0, 1.0, 0.0), water)[1] * found["contact_speed"].value ** 2
    assert 0.5 * whole < found["contact_energy"].value < whole
    stored = CURVES["cone"].both(found["fender_deflection"].value)
    assert found["fender_reaction"].value == pytest.approx(2.6e6 * stored[0], rel=1e-3)
    assert found["contact_energy"].value == pytest.approx(2.0 * 2.6e6 * 2.0 * stored[1], rel=0.05)  # x_G is not midship
    assert found["contacts"].value == 1.0
    assert found["berthing_energy"].value > 0.0


@pytest.mark.slow
def test_off_the_fenders_there_are_no_figures_and_no_force() -> None:
    trial, place = run(vessel(), quay(), (250.0, -60.0, 0.0, 0.0, 0.0, 0.0), 20.0)
    assert contact_indices(trial, vessel(), place) == {}
    assert not trial["v_m"].any()


@pytest.mark.slow
def test_the_virtual_machine_does_the_same() -> None:
    ship, policy = vessel(Suction(A_M=SECTION)), Given()
    place = place_of(ship, quay())
    system = closed_loop(ship, policy, 0.5, place)
    start = np.array([[250.0, -31.2, 0.002, 0.05, 0.06, 0.0], [250.0, -70.0, 0.0, 2.0, 0.0, 0.0]])
    memory = np.tile(loop_memory(ship, policy, 0.5, {}, (0.0,) * 6), (2, 1))
    values = np.array(list(loop_values(ship, policy).values()))
    rows = [
        simulator(system, back_end=name)
        .run(start, np.zeros((2, 1, 8)), values, dt=0.5, steps=41, memory0=memory)
        .values
        for name in ("auto", "virtual")
    ]
    assert np.abs(rows[0] - rows[1]).max() < 1e-9


@pytest.mark.parametrize(
    ("start", "about"),
    [
        ((250.0, -10.0, 0.0), "inside quay 1"),
        ((250.0, -31.0, 0.5), "inside quay 1"),
        ((250.0, 29.0, 0.0), "inside quay 1"),
    ],
)
def test_a_start_in_a_wall_is_refused_in_one_line(start: tuple[float, ...], about: str) -> None:
    with pytest.raises(ShipError, match=about) as error:
        run(vessel(), quay(), (*start, 0.0, 0.0, 0.0))
    assert "\n" not in str(error.value)


def test_a_start_aground_is_refused() -> None:
    with pytest.raises(ShipError, match=r"aground, in 15\.0 m"):
        run(vessel(), replace(quay(), depth=15.0), (250.0, -200.0, 0.0, 0.0, 0.0, 0.0))


def test_what_cannot_sail_on_a_chart_is_refused() -> None:
    for name in ("kvlcc2_l7_arx", "mariner_nomoto"):
        with pytest.raises(ShipError, match="neither"):
            place_of(load(name), canal())
    for hull, about in (
        (((-0.5, 0.0), (0.0, -1.0), (0.5, 0.0)), "convex"),
        (((-0.5, 1.0), (0.0, 2.0), (0.5, 0.0)), "stern"),
    ):
        with pytest.raises(ShipError, match=about):
            place_of(vessel(), canal(), hull=hull)


@pytest.mark.slow
def test_a_chart_on_a_device_is_refused() -> None:
    place = place_of(vessel(), canal())
    with pytest.raises(DeviceError, match=r"processor|driver|extra"):
        simulator(closed_loop(vessel(), Given(), 0.5, place), device="cuda")


@pytest.mark.slow
def test_under_keel_clearance_and_its_alarm() -> None:
    ship = vessel()
    trial, _ = run(ship, canal(), (0.0, 0.0, 0.0, 6.0, 0.0, 0.0), 20.0)
    found = keel_indices(trial, ship)
    assert found["under_keel"].value == pytest.approx(25.0 - 20.8 - found["squat"].value)
    assert 0.4 < found["squat"].value < 1.4
    assert "aground" not in found
    assert not shallows(trial, ship, 2.0)
    alarm = shallows(trial, ship, 4.0)
    assert alarm
    assert all(value < 4.0 for value in alarm.values())
    deep = simulate(ship, Given(), duration=5.0, start=(0.0, 0.0, 0.0, 6.0, 0.0, 0.0), dt=0.5)
    assert keel_indices(deep, ship) == {}
    low = trial.having(depth=np.full(len(trial), 21.0))
    assert keel_indices(low, ship)["aground"].value == 0.0
    assert math.isfinite(keel_indices(low, ship)["under_keel"].value)
