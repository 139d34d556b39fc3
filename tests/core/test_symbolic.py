"""Functions of symbolic: one value on floats and on symbols."""

from __future__ import annotations

import casadi as ca
import pytest

from seatrial.core.symbolic import floor


@pytest.mark.parametrize("x", [-2.5, -1.0, -1e-12, 0.0, 0.999999, 1.0, 16807.0 * (2.0**31 - 2.0) / (2.0**31 - 1.0)])
def test_floor_is_the_greatest_whole_number_below(x: float) -> None:
    symbol = ca.SX.sym("x")
    assert float(ca.Function("f", [symbol], [floor(symbol)])(x)) == floor(x)
    assert floor(x) <= x < floor(x) + 1
