"""Two tugs at a berth: their sum is the wanted side force, their difference the moment, by the law stated in words."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.manoeuvres.tugs import TugBerthing

LAW = TugBerthing(
    y=40.0, x=-10.0, psi=0.6, mass=2e6, inertia=9e8, arm=25.0, side=-1.0, closing=0.2, touching=0.05, wanting=150.0,
    answer=80.0,
)  # fmt: skip


def forces(law: TugBerthing, x: float, y: float, psi: float, v_m: float = 0.0, r: float = 0.0) -> tuple[float, float]:
    """Side force and moment that the orders make: a tug that pushes from port drives to starboard."""
    (n_P, delta, fore, aft), _ = law.command(0.0, (x, y, psi, 0.3, v_m, r), ())
    assert (n_P, delta) == (0.0, 0.0)
    return -law.side * (fore + aft), -law.side * law.arm * (fore - aft)


def off(law: TugBerthing, left: float, along: float = 17.0) -> tuple[float, float]:
    """A place from which the line lies `left` metres to starboard, wherever along it."""
    c, s = math.cos(law.psi), math.sin(law.psi)
    return law.x + along * c + left * s, law.y + along * s - left * c


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(
    ("left", "speed"),
    [(90.0, 0.2), (15.0, 0.1), (3.0, 0.05), (0.1, 0.05), (-90.0, -0.2), (-15.0, -0.1), (-3.0, -0.05)],
)
def test_the_speed_falls_with_the_way_left_and_is_held_at_the_touch(side: float, left: float, speed: float) -> None:
    """Way over time, `closing` at most and `touching` at least; what lacks of it is made good in `answer`."""
    law = replace(LAW, side=side)
    for v_m in (0.0, 0.08):
        Y, N = forces(law, *off(law, left), law.psi, v_m)
        assert pytest.approx(2e6 * (speed - v_m) / 80.0) == Y
        assert pytest.approx(0.0, abs=1e-6) == N


def test_the_heading_is_held_as_by_a_critically_damped_spring() -> None:
    """Both poles at -1/answer: turned by the moment alone, the error is (1 + t/T) exp(-t/T) of the first."""
    error, rate, h = 0.1, 0.0, 0.2
    for k in range(1001):
        wanted = 0.1 * (1.0 + k * h / 80.0) * math.exp(-k * h / 80.0)
        assert error == pytest.approx(wanted, abs=3e-4)
        _, N = forces(LAW, *off(LAW, 0.0), LAW.psi + error, 0.0, rate)
        rate += h * N / 9e8
        error += h * rate


def test_a_turn_takes_the_short_way_and_needs_no_side_force() -> None:
    at = off(LAW, 60.0)
    for turns in (-1, 0, 1):
        assert forces(LAW, *at, LAW.psi + 0.2 + turns * math.tau) == pytest.approx(forces(LAW, *at, LAW.psi + 0.2))
    Y = [forces(LAW, *at, LAW.psi + turn)[0] for turn in (-0.2, 0.0, 0.2)]
    assert np.ptp(Y) == pytest.approx(0.0, abs=1e-6)
