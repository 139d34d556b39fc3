"""The manoeuvre of a trial by its set points, in every spelling that is read, and by its data where it has none."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.manoeuvres.told import manoeuvre, seen
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag

T = np.arange(0.0, 10.0)


def trial(rudder: float | None = None, word: str = "set_points", **meta: Any) -> Trial:
    """A trial with these set points; a rudder that goes over after a twitch to the other side."""
    channels = {"n_P": np.r_[np.full(6, 2.0), np.full(4, 9.0)]}
    if rudder is not None:
        channels["delta"] = rudder * np.r_[0.0, -0.1, np.ones(8)]
    points = {k.replace("_deg", " [deg]").replace("_rad", " [rad]"): v for k, v in meta.items() if k != "kind"}
    return Trial("t", T, channels, meta={"kind": meta.get("kind"), word: points})


@pytest.mark.parametrize("word", ["set_points", "setpoints"])
@pytest.mark.parametrize("points", [{"delta": math.pi / 9}, {"delta_deg": 20.0}, {"rudder_rad": math.pi / 9}])
def test_set_points_have_spellings(word: str, points: dict[str, float]) -> None:
    assert manoeuvre(trial(kind="turning", side="starboard", word=word, **points)) == Turning(
        0.0, pytest.approx(math.pi / 9)
    )
    told = manoeuvre(trial(kind="zigzag", heading_deg=10.0, side="port", word=word, **points))
    assert told == Zigzag(0.0, pytest.approx(math.pi / 9), pytest.approx(math.pi / 18), -1.0)


def test_the_side_is_that_told_or_that_of_the_rudder() -> None:
    for side, sign in (("port", -1.0), ("starboard", 1.0), (-1, -1.0), (1.0, 1.0)):
        assert manoeuvre(trial(kind="turning", delta=0.3, side=side, rudder=-0.3 * sign)) == Turning(0.0, 0.3 * sign)
    for rudder in (0.3, -0.3):
        assert manoeuvre(trial(kind="turning", delta=0.3, rudder=rudder)) == Turning(0.0, rudder)
        assert manoeuvre(trial(kind="zigzag", delta=0.3, psi=-0.2, rudder=rudder)) == Zigzag(
            0.0, 0.3, 0.2, math.copysign(1.0, rudder)
        )
    assert manoeuvre(trial(kind="turning", delta=-0.3)) == Turning(0.0, -0.3)  # no rudder: the sign of the set point


def test_what_names_no_manoeuvre_is_none() -> None:
    assert manoeuvre(trial(kind="spiral", delta=0.3, psi=0.2)) is None
    assert manoeuvre(trial(kind="turning", psi=0.2)) is None
    assert manoeuvre(trial(kind="zigzag", delta=0.3)) is None
    assert manoeuvre(Trial("t", T, {"delta": T}, meta={"kind": "turning"})) is None


def test_the_revolutions_are_the_median_of_the_first_shaft() -> None:
    assert seen(trial(kind="turning", delta=0.3, rudder=0.3)) == Turning(2.0, 0.3)
    assert seen(trial(kind="zigzag", delta=0.3, psi=0.2, rudder=-0.3)) == Zigzag(2.0, 0.3, 0.2, -1.0)
