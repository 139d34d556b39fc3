"""Every ship of the library, whatever its family and controls, keeps the contract of `seatrial.models`.

A public simulator took the advance speed of its propeller from the velocity over ground; the checks in a current are
the test for it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from seatrial.environment import Environment
from seatrial.testing import SHIP_CHECKS, ships, untried_families

SHIPS = ships()


def test_every_family_is_flown_by_some_ship() -> None:
    assert not untried_families(), "give it a ship, or a line in testing/examples.py"


@pytest.mark.slow
@pytest.mark.parametrize("check", list(SHIP_CHECKS))
@pytest.mark.parametrize("name", list(SHIPS))
def test_ship(name: str, check: str) -> None:
    if reason := SHIP_CHECKS[check](SHIPS[name]):
        pytest.skip(reason)


def test_wind_blows_only_where_the_ship_has_a_wind_module() -> None:
    model: Any = SHIPS["esso_osaka_3m"].model
    at = (0.0,) * 6, (0.0, 0.0)
    gale = Environment(0.0, 10.0)  # from the east, heading north: pushed to port
    assert model.derivative(*at, gale)[4] < 0
    assert replace(model, wind=None).derivative(*at, gale) == (0.0,) * 6
