"""Every manoeuvre of the package keeps the contract of `seatrial.manoeuvres`."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from seatrial.core.parameters import ParameterError, walk
from seatrial.ships.files import load
from seatrial.testing import MANOEUVRE_CHECKS, manoeuvres
from seatrial.testing.manoeuvres import ordered

SHIPS = {"thrust-steps": "milliampere"}
"""Ships of manoeuvres that need other controls than a rudder and revolutions."""


@pytest.mark.parametrize("check", list(MANOEUVRE_CHECKS))
@pytest.mark.parametrize("kind", list(manoeuvres()))
def test_manoeuvre(kind: str, check: str) -> None:
    if reason := MANOEUVRE_CHECKS[check](manoeuvres()[kind], load(SHIPS.get(kind, "kvlcc2_l7"))):
        pytest.skip(reason)


@pytest.mark.parametrize("kind", list(manoeuvres()))
def test_no_manoeuvre_takes_an_angle_that_is_not_one_in_radians(kind: str) -> None:
    """40 for 40 deg is six turns of the rudder, and no run would show it; NaN and infinity steer nothing."""
    policy: Any = ordered(manoeuvres()[kind], load(SHIPS.get(kind, "kvlcc2_l7")))
    angles = [path for path, meaning, _ in walk(policy) if meaning.unit == "rad"]
    for name in angles:
        for wrong in (40.0, -40.0, math.nan, -math.inf):
            with pytest.raises(ParameterError, match=rf"^{name} is "):
                replace(policy, **{name: wrong})
    assert angles or kind in {"acceleration", "stopping", "crash-astern", "crabbing", "thrust-steps", "reverse-spiral"}


@pytest.mark.parametrize(("kind", "changes"), [
    ("crabbing", {"side": 90.0}), ("crabbing", {"drive": 60.0}), ("stopping", {"end": 20.0}),
    ("crash-astern", {"n_astern": 5.0}), ("thrust-steps", {"X": -1.0}), ("track", {"ahead": 0.0}),
    ("berthing", {"speed": -1.0}),
])  # fmt: skip
def test_other_numbers_out_of_range_are_refused_too(kind: str, changes: dict[str, float]) -> None:
    policy: Any = ordered(manoeuvres()[kind], load(SHIPS.get(kind, "kvlcc2_l7")))
    with pytest.raises(ParameterError, match=rf"^{next(iter(changes))} is "):
        replace(policy, **changes)
