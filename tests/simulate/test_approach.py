"""Steps that suit a ship and speeds that it holds, of ships whose answers are known in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import pytest

from seatrial.actuators import Actuators
from seatrial.core.parameters import Scalar, spec
from seatrial.core.symbolic import magnitude
from seatrial.models import Model
from seatrial.ships import Ship, ShipError
from seatrial.ships.files import load
from seatrial.simulate.approach import approach, fastest, rounded_down, step_doubt, substeps, surge_balance, time_step


@dataclass(frozen=True, kw_only=True)
class Damped(Model):
    """u' = b n |n| - c u |u|, v' = -p v + q r, r' = -p r - q v: eigenvalues -2 c u and -p +- i q."""

    b: Scalar = spec("m", "thrust over mass")
    c: Scalar = spec("1/m", "resistance over mass")
    p: Scalar = spec("1/s", "damping")
    q: Scalar = spec("1/s", "coupling")

    def derivative(self, state: Any, control: Any, environment: Any) -> Any:
        u, v, r, n = state[3], state[4], state[5], control[0]
        surge = self.b * n * magnitude(n) - self.c * u * magnitude(u)
        return (u, v, r, surge, self.q * r - self.p * v, -self.q * v - self.p * r)


def ship(p: float, q: float, L: float = 100.0, U: float = 5.0, c: float = 0.002) -> Ship:
    return Ship("damped", Damped(b=0.05, c=c, p=p, q=q), Actuators(), L, U)


@pytest.mark.parametrize(("p", "q", "c", "wanted"), [(0.3, 0.4, 0.002, 0.5), (0.01, 0.0, 0.03, 0.3)])
def test_the_fastest_motion_is_the_largest_eigenvalue(p: float, q: float, c: float, wanted: float) -> None:
    assert fastest(ship(p, q, c=c)) == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize(
    ("wanted", "found"),
    [(1.0, 1.0), (1.99, 1.0), (2.0, 2.0), (4.99, 2.0), (5.0, 5.0), (9.99, 5.0), (0.0999, 0.05), (0.02, 0.02),
     (70.0, 50.0)],
)  # fmt: skip
def test_a_step_is_one_two_or_five(wanted: float, found: float) -> None:
    assert rounded_down(wanted) == pytest.approx(found)


def test_a_step_is_by_the_size_and_speed_or_by_the_stiffness() -> None:
    """L/(250 U) = 0.08 s and half of the time of the fastest motion; doubt begins at 25 of them, or at that half."""
    assert time_step(ship(0.1, 0.0)) == 0.05
    assert time_step(ship(0.1, 0.0, U=0.5)) == 0.5
    assert time_step(ship(15.0, 20.0)) == 0.02  # .5/25
    slow, stiff = ship(0.01, 0.0), ship(3.0, 4.0)
    assert step_doubt(slow, 1.99) is None
    assert "inaccurate above some 2 s; take 2 s or less" in str(step_doubt(slow, 2.01))
    assert step_doubt(stiff, 0.099) is None
    assert "inaccurate above some 0.1 s" in str(step_doubt(stiff, 0.101))
    assert "inaccurate" in str(step_doubt(stiff, 0.559))
    assert "unstable above some 0.56 s" in str(step_doubt(stiff, 0.561))


def test_between_rows_steps_are_longer_and_a_search_does_not_stall() -> None:
    """0.4 of where doubt begins; no stiffness costs more than sixteen times the steps of size and speed."""
    slow, stiff, wild = ship(0.01, 0.0), ship(1.5, 2.0), ship(3e4, 4e4)
    for one, longest in ((slow, 0.8), (stiff, 0.08), (wild, 0.8 / 16.0)):
        assert substeps(one, longest) == 1
        assert substeps(one, 1.01 * longest) == 2
        assert substeps(one, 2.99 * longest) == 3
    assert substeps(stiff, 10.0, "euler") == 1
    assert substeps(load("kvlcc2_l7_arx"), 10.0) == 1


def test_speed_and_revolutions_balance_either_way() -> None:
    """b n^2 = c U^2."""
    one = ship(0.1, 0.0)
    n = 5.0 * math.sqrt(0.002 / 0.05)
    assert approach(one) == pytest.approx((5.0, n))
    assert approach(one, speed=3.0) == pytest.approx((3.0, 0.6 * n))
    assert approach(one, n_P=2.0 * n) == pytest.approx((10.0, 2.0 * n))
    assert approach(one, speed=3.0, n_P=7.0) == (3.0, 7.0)
    told = replace(one, n_P=1.7)
    assert approach(told) == (5.0, 1.7)
    assert approach(told, speed=3.0) == pytest.approx((3.0, 0.6 * n))
    assert surge_balance(one, 4.0, 2.0) == pytest.approx(0.05 * 4.0 - 0.002 * 16.0)
    with pytest.raises(ShipError, match=r"no steady run between 0\.001 and 25"):
        approach(one, n_P=50.0)
    with pytest.raises(ShipError, match=r"no steady run between 0\.005 and 100"):
        approach(ship(0.1, 0.0, c=50.0))
