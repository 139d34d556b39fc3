"""Heel read off turns and zigzags: sides, times, gaps, and runs without heel."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import simulate


def turn(side: float, phi: float | None = None) -> Trial:
    """A turn to a side: 1 deg inwards at 10 s, 8 deg outwards at 30 s, 3 deg outwards in the end."""
    t = np.arange(0.0, 400.0, 1.0)
    knots, heel = (0.0, 10.0, 30.0, 80.0, 400.0), (0.0, 1.0, -8.0, -3.0, -3.0)
    one = np.ones(t.size)
    channels = {
        "x": 100.0 * np.sin(0.02 * t), "y": side * 100.0 * (1.0 - np.cos(0.02 * t)), "psi": side * 0.02 * t,
        "u": 2.0 * one, "v_m": 0.0 * one, "r": side * 0.02 * one, "delta_cmd": side * 0.6 * one,
        "phi": side * np.radians(np.interp(t, knots, heel)),
    }  # fmt: skip
    return Trial("turn", t, channels if phi is None else {**channels, "phi": phi * one})


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_turn_heels_in_then_out(side: float) -> None:
    found = Turning(1.0, side * 0.6).indices(turn(side), 100.0)
    wanted = {"inward_heel": 1.0, "outward_heel": 8.0, "steady_heel": 3.0}
    assert {name: math.degrees(found[name].value) for name in wanted} == pytest.approx(wanted)
    assert (found["inward_heel_time"].value, found["outward_heel_time"].value) == (10.0, 30.0)
    assert {found[name].unit for name in wanted} == {"rad"}


def test_gaps_of_the_heel_are_passed_over_and_a_run_without_heel_has_none() -> None:
    one = turn(1.0)
    phi = one["phi"].copy()
    phi[:5], phi[100:120] = np.nan, np.nan
    found = Turning(1.0, 0.6).indices(one.having(phi=phi), 100.0)
    assert math.degrees(found["outward_heel"].value) == pytest.approx(8.0)
    bare = Trial("bare", one.t, {name: v for name, v in one.channels.items() if name != "phi"})
    for other in (bare, turn(1.0, math.nan)):
        found = Turning(1.0, 0.6).indices(other, 100.0)
        assert not any("heel" in name for name in found)
        assert "tactical_diameter" in found


def test_a_ship_that_never_heels_inwards_has_no_inward_heel() -> None:
    found = Turning(1.0, 0.6).indices(turn(1.0, -0.05), 100.0)
    assert "inward_heel" not in found
    assert found["outward_heel"].value == pytest.approx(0.05)


def test_a_zigzag_heels_to_either_side_by_its_first() -> None:
    """The mirror image exchanges the sides."""
    ship, found = load("naval_blanke"), []
    for side in (1.0, -1.0):
        policy = Zigzag(10.0, math.radians(10.0), math.radians(10.0), side)
        indices = policy.indices(simulate(ship, policy, duration=120.0), ship.L_pp)
        found.append((indices["heel_to_starboard"].value, indices["heel_to_port"].value))
    assert found[0] == pytest.approx(found[1][::-1])
    assert min(found[0]) > math.radians(0.5)
