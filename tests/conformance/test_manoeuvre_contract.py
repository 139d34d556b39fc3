"""Every manoeuvre of the package keeps the contract of `seatrial.manoeuvres`."""

from __future__ import annotations

import pytest

from seatrial.ships.files import load
from seatrial.testing import MANOEUVRE_CHECKS, manoeuvres

SHIPS = {"thrust-steps": "milliampere"}
"""Ships of manoeuvres that need other controls than a rudder and revolutions."""


@pytest.mark.parametrize("check", list(MANOEUVRE_CHECKS))
@pytest.mark.parametrize("kind", list(manoeuvres()))
def test_manoeuvre(kind: str, check: str) -> None:
    if reason := MANOEUVRE_CHECKS[check](manoeuvres()[kind], load(SHIPS.get(kind, "kvlcc2_l7"))):
        pytest.skip(reason)
