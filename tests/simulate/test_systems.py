"""Ships that differ in numbers only share one traced system; whatever changes the equations has its own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.actuators import Actuators
from seatrial.core.parameters import values
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.loop import closed_loop, open_loop, open_loop_parameters
from seatrial.simulate.run import simulate

SHIP = load("kvlcc2_l7")
POLICY = Zigzag(10.0, 0.3, 0.3)


def rudder(**changes: float) -> Ship:
    return replace(SHIP, actuators=Actuators({"rudder": replace(SHIP.actuators.rudder, **changes)}))


def test_numbers_share_a_system() -> None:
    other = load("kvlcc2_l7").having({"hull.N_r": 1.1 * float(SHIP.model.hull.N_r)})  # type: ignore[attr-defined]
    assert open_loop(SHIP) is open_loop(other)
    slower = replace(rudder(rate=0.02), model=other.model)
    assert closed_loop(SHIP, POLICY, 0.1) is closed_loop(slower, replace(POLICY, delta=0.2), 0.1)


@pytest.mark.parametrize(("ship", "policy", "dt"), [
    (rudder(dead_time=1.0), POLICY, 0.1),
    (rudder(dead_time=0.5), POLICY, 0.1),
    (rudder(lag=1.0), POLICY, 0.1),
    (SHIP, Turning(10.0, 0.3), 0.1),
    (load("kvlcc2"), POLICY, 0.1),
    (load("esso_osaka_3m"), POLICY, 0.1),
], ids=["dead time", "another dead time", "lag", "policy", "resistance in air", "family"])  # fmt: skip
def test_other_equations_are_another_system(ship: Ship, policy: Any, dt: float) -> None:
    assert closed_loop(ship, policy, dt) is not closed_loop(SHIP, POLICY, 0.1)


def test_a_dead_time_is_a_queue_of_its_time_step() -> None:
    late = rudder(dead_time=1.0)
    assert closed_loop(late, POLICY, 0.1) is not closed_loop(late, POLICY, 0.05)


def test_the_numbers_of_the_first_ship_do_not_stay() -> None:
    """A ship that is simulated after another of its make runs as it does in a process of its own."""
    changed = SHIP.having({"hull.N_r": 1.5 * float(SHIP.model.hull.N_r)})  # type: ignore[attr-defined]
    one = simulate(SHIP, POLICY, duration=30.0, dt=0.1)
    two = simulate(changed, replace(POLICY, delta=0.2), duration=30.0, dt=0.1)
    from seatrial.engine import simd
    from seatrial.simulate import loop

    for kept in (loop._built, simd._rollout_source):
        kept.cache_clear()
    alone = simulate(changed, replace(POLICY, delta=0.2), duration=30.0, dt=0.1)
    assert np.array_equal(two.stack("x", "psi", "delta"), alone.stack("x", "psi", "delta"))
    assert not np.array_equal(one["psi"], two["psi"])


@pytest.mark.parametrize("name", ["kvlcc2_l7", "kvlcc2_l7_arx"])
def test_every_number_of_a_model_is_a_parameter_but_the_step_of_discrete_time(name: str) -> None:
    """One system serves all of its ships, so their numbers come in as parameters, each under its own name."""
    ship = load(name)
    names, held = open_loop(ship).parameters, open_loop_parameters(ship)
    given, known = dict(zip(names, held.tolist(), strict=True)), dict(values(ship.model))
    step = known.pop("dt", None)
    assert (step is not None) == (name == "kvlcc2_l7_arx")
    assert {path: given[path] for path in known} == known
    assert len(given) == len(known) + 2  # and two of the surroundings
    assert "dt" not in given
