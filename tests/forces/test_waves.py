"""Mean wave forces: published coefficients by hand, signs, limits of the range."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np
import pytest

from seatrial.core.constants import GRAVITY
from seatrial.forces import Flow
from seatrial.forces.waves import HeadSea, MeanDrift

DRIFT, HEAD = MeanDrift(), HeadSea(B=32.0, L_BWL=50.0)
both = pytest.mark.parametrize("module", [DRIFT, HEAD], ids=["drift", "head"])


def sea(wave_u: Any, wave_v: Any, T: Any = 8.0, L: float = 200.0) -> Flow:
    return Flow(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1025.0, L, 10.0, wave_u, wave_v, T)


def period(ratio: float, L: float = 200.0) -> float:
    """Mean period of waves of `ratio` times the ship's length."""
    return math.sqrt(2 * math.pi * ratio * L / GRAVITY)


def test_drift_coefficients_by_hand() -> None:
    unit = 0.5 * 1025.0 * GRAVITY * 200.0 * 3.0**2 / 8.0  # a^2 = H^2 / 8 in an irregular sea
    bow = DRIFT.force(sea(3.0 * math.cos(0.6), 3.0 * math.sin(0.6), period(0.5)))
    expected = (0.07375 * math.cos(0.6), 1.0175 * math.sin(0.6), 200.0 * 0.05875 * math.sin(0.6))
    assert bow == pytest.approx(tuple(-unit * c for c in expected), rel=1e-9)


def test_beam_drift_is_near_what_a_wall_reflects() -> None:
    """A public code leaves g out and turns the wavelength upside down; the wall shows both."""
    wall = 0.5 * 1025.0 * GRAVITY * 200.0 * 3.0**2 / 8.0
    for ratio, low, high in ((0.1, 1.2, 1.4), (0.3, 1.2, 1.4), (0.5, 0.9, 1.1), (0.9, 0.0, 0.2), (3.0, 0.0, 0.2)):
        assert low < -DRIFT.force(sea(0.0, 3.0, period(ratio))).Y / wall < high


def test_waves_push_to_leeward() -> None:
    assert DRIFT.force(sea(2.0, 0.0)).X < 0 < DRIFT.force(sea(-2.0, 0.0)).X
    assert DRIFT.force(sea(0.0, 2.0)).Y < 0 < DRIFT.force(sea(0.0, -2.0)).Y
    assert HEAD.force(sea(2.0, 0.0)).X < 0 == HEAD.force(sea(-2.0, 0.0)).X


def test_beyond_the_range_its_end_holds() -> None:
    for inside, outside in ((0.3, 0.01), (0.95, 4.0)):
        assert DRIFT.force(sea(1.0, 1.0, period(outside))) == pytest.approx(
            DRIFT.force(sea(1.0, 1.0, period(inside))), rel=1e-9
        )


def test_head_sea_by_hand_up_to_its_height() -> None:
    def resistance(H: float) -> float:
        return -HEAD.force(sea(H * math.cos(0.7), H * math.sin(0.7))).X

    highest = 2.25 * math.sqrt(2.0)
    for H in (2.0, 0.999 * highest):
        assert resistance(H) == pytest.approx(1025 * GRAVITY * H * H * 32.0 * 0.8 / 16, rel=1e-9)
    assert resistance(9.0) == pytest.approx(resistance(highest), rel=1e-9)
    assert HEAD.force(sea(2.0 * math.cos(0.8), 2.0 * math.sin(0.8))).X == 0


@both
def test_silent_in_calm_mirrored_and_finite(module: Any) -> None:
    assert all(abs(y) == 0 for y in module.force(sea(0.0, 0.0, 0.0)))
    x = ca.SX.sym("x", 3)
    y = ca.vertcat(*(ca.SX(e) for e in module.force(sea(x[0], x[1], x[2]))))
    f, j = ca.Function("f", [x], [y]), ca.Function("j", [x], [ca.jacobian(y, x)])
    for u in (0.0, 2.0, -2.0, 1e-9):
        for v in (0.0, 1.5, 2.0, -2.0):
            for T in (0.0, 4.0, 9.0, 30.0):
                here = module.force(sea(u, v, T))
                assert np.array(f([u, v, T])).ravel() == pytest.approx(np.array(here), rel=1e-12)
                assert np.isfinite(np.array(ca.DM(j([u, v, T])).full())).all()
                there = module.force(sea(u, -v, T))
                assert tuple(here) == pytest.approx((there.X, -there.Y, -there.N))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_waves_from_45_degrees_are_head_waves_and_those_from_beyond_none(side: float) -> None:
    flow: Any = Flow(*[0.0] * len(Flow._fields))._replace(rho=1025.0, L_pp=200.0, wave_u=1.0)
    assert HEAD.force(flow._replace(wave_v=side)).X < 0.0
    assert HEAD.force(flow._replace(wave_v=1.0001 * side)).X == 0.0
