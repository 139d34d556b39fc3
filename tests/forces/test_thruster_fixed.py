from __future__ import annotations

from dataclasses import replace

import pytest

from seatrial.core.parameters import ParameterError
from seatrial.forces import Flow
from seatrial.forces.thruster_fixed import Fixed
from seatrial.ships.files import ShipError, load

WATER = Flow(0.5, 0.1, 0.05, 0.0, 0.0, 0.0, 0.0, 1000.0, 1.0, 0.1)
PORT = Fixed(x=-0.4, y=-0.3, T_1=2.0, T_2=3.0, astern=0.5, low=-0.8)


def test_port_ahead_turns_to_starboard():
    force = PORT.force(WATER, (0.5,))
    assert pytest.approx(2.0 * 0.5 + 3.0 * 0.25) == force.X
    assert force.Y == 0.0
    assert pytest.approx(0.3 * force.X) == force.N


def test_astern_and_beyond_the_map():
    assert PORT.thrust(-0.5) == pytest.approx(-0.5 * PORT.thrust(0.5))
    assert PORT.thrust(-1.0) == PORT.thrust(-0.8)
    assert PORT.thrust(1.4) == PORT.thrust(1.0) == pytest.approx(5.0)
    assert PORT.thrust(0.0) == 0.0


def test_way_against_the_thrust_lessens_it_by_its_square():
    boat = replace(PORT, against=0.25)
    for command, u, share in ((0.5, 2.0, 1.0), (-0.5, -2.0, 1.0), (0.5, -2.0, 0.5), (-0.5, 2.0, 0.5), (-0.5, 6.0, 0.1)):
        force = boat.force(WATER._replace(u=u), (command,))
        assert pytest.approx(share * PORT.thrust(command)) == force.X
        assert pytest.approx(0.3 * force.X) == force.N
        assert boat.inputs(WATER._replace(u=u), (command,)) == (force.X,)
    assert boat.thrust(-0.5, 1e-9) == pytest.approx(boat.thrust(-0.5, -1e-9))


def test_sternway_takes_a_share_of_the_thrust_astern_and_none_ahead():
    """The share is lost by speed, all of it at 1 / `sternway`, whatever `against` says."""
    boat = replace(PORT, sternway=0.25, against=3.0)
    for command, u, share in ((-0.5, -1.0, 0.75), (-0.5, -2.0, 0.5), (-0.5, -6.0, 0.0), (0.5, 2.0, 1.0)):
        assert boat.thrust(command, u) == pytest.approx(share * PORT.thrust(command))
    assert boat.thrust(0.5, -1.0) == pytest.approx(PORT.thrust(0.5) / 4.0)


def test_affine_form_agrees():
    ((a, b, c),) = PORT.effect
    (T,) = PORT.inputs(WATER, (0.7,))
    assert tuple(PORT.force(WATER, (0.7,))) == pytest.approx((a * T, b * T, c * T))


def test_a_thruster_without_thrust_is_refused():
    with pytest.raises(ParameterError, match="needs T_1 or T_2 above zero"):
        Fixed(y=0.3)


def test_a_thrust_that_falls_is_refused(tmp_path):
    """The map rises with the command, so neither number can be negative."""
    from pathlib import Path

    file = Path(__file__).parents[2] / "studies" / "ships" / "usv_asw_twinhull.toml"
    path = tmp_path / "falls.toml"
    path.write_text(file.read_text().replace("T_1 = { value = 1.0", "T_1 = { value = -1.0", 1))
    with pytest.raises(ShipError, match=r"thrusters\.port.*T_1"):
        load(path)
