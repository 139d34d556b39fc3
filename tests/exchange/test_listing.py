"""Terms written out: the same value as CasADi's, in the same order; names, limits and numbers in words."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from seatrial.environment import CALM
from seatrial.exchange.listing import listing
from seatrial.exchange.python_source import PYTHON
from seatrial.exchange.traced import Variable, elements, equations_of, identifier, one_line, outline, unit_around
from seatrial.ships import ShipError
from seatrial.ships.files import load


def written(expression: Any, *symbols: Any) -> Any:
    """A function of numbers made of the text that is written of an expression."""
    f = ca.Function("f", list(symbols), [expression])
    listed = listing(f, lambda i, j: f"x{i}", PYTHON)
    lines = [f"{name} = {text}" for name, text in listed.statements]
    assert all(len(text) <= PYTHON.width for text in listed.outputs.values())

    def value(*given: float) -> float:
        space: dict[str, Any] = {**vars(math), **{f"x{k}": v for k, v in enumerate(given)}}
        exec("\n".join(lines), space)
        return float(eval(listed.outputs[0, 0], space))

    return value, f, listed


A, B, C = (ca.SX.sym(name) for name in "abc")
TERMS = {
    "a - (b - c)": A - (B - C), "a - (b + c)": A - (B + C), "a / (b * c)": A / (B * C), "a / (b / c)": A / (B / C),
    "(a + b) * c": (A + B) * C, "a * (b * c)": A * (B * C), "-(a + b)": -(A + B), "-a * b": -A * B, "a - -b": A - (-B),
    "(a * b) ** 2": (A * B) ** 2, "(a + b) ** 2": (A + B) ** 2, "1 / (a + b)": 1 / (A + B), "2 (a + b)": 2 * (A + B),
    "min": ca.fmin(A + B, C), "max": ca.fmax(A, B - C), "sign": ca.sign(A - B) * C, "less": (A < B) * C - A,
    "at most": (A <= B) + C, "choice": ca.if_else(A < B, A + C, B - C), "not": ca.logic_not(A < B) * C,
    "both": ca.logic_and(A < B, B < C) * 3.0, "either": ca.logic_or(A < B, B < C) * 3.0, "atan2": ca.atan2(A - B, C),
    "power": ca.fabs(A) ** 1.5, "root": ca.sqrt(ca.fabs(A * B)), "turned": ca.sin(A + B) * ca.cos(C),
    "equal": (A == A) * B, "constants": (A - 1.5) * -2.5 + (-3.0) ** 3,
}  # fmt: skip


@pytest.mark.parametrize("name", TERMS)
def test_a_term_written_out_has_the_value_of_the_function(name: str) -> None:
    value, f, _ = written(TERMS[name], A, B, C)
    for row in np.random.default_rng(3).uniform(-2.0, 2.0, (40, 3)).tolist():
        assert value(*row) == float(f(*row))  # to the last bit


def test_a_term_that_is_read_twice_is_computed_once_and_a_long_one_stands_alone() -> None:
    shared = ca.sin(A * B)
    value, f, listed = written(shared + shared * C, A, B, C)
    assert sum(text.count("sin") for _, text in listed.statements) == 1
    assert value(1.0, 2.0, 3.0) == float(f(1.0, 2.0, 3.0))
    total = A
    for k in range(40):
        total = total + (k + 0.123456) * ca.cos(B + k)
    value, f, listed = written(total, A, B)
    assert len(listed.statements) > 5
    assert max(len(text) for _, text in listed.statements) < 2 * PYTHON.width
    assert value(0.3, 0.7) == float(f(0.3, 0.7))
    assert written(A + B, A, B)[2].reads == {(0, 0), (1, 0)}


def test_constants_are_exact_and_in_parentheses_below_zero() -> None:
    said = [PYTHON.constant(x) for x in (0.1, -0.1, 0.0, 1e-300, math.inf, -math.inf, math.nan)]
    assert said == ["0.1", "(-0.1)", "0.0", "1e-300", PYTHON.infinity, f"(-{PYTHON.infinity})", PYTHON.nan]


def test_an_operation_without_a_form_is_refused() -> None:
    with pytest.raises(ShipError, match="has no form"):
        PYTHON.form("OP_ERF")
    assert PYTHON.form("OP_ATAN2") == "atan2({0}, {1})"
    assert PYTHON.form("OP_SIN").endswith("sin({0})")


# what the elements are


@pytest.mark.parametrize(("low", "high", "said"), [
    (-math.inf, math.inf, ""), (-1.5, 2.0, ", -1.5 to 2"), (0.0, math.inf, ", 0 to inf"),
    (-math.inf, 3.0, ", -inf to 3"),
])  # fmt: skip
def test_limits_are_told_where_there_is_one(low: float, high: float, said: str) -> None:
    assert Variable("n_P", "1/s", "revolutions", low, high).limits == said


def test_elements_are_counted_from_zero() -> None:
    told = elements("x", [Variable("u", "m/s", "surge", 0.0, 1.5), Variable("r", "rad/s", "yaw")], 2)
    assert told == ["  x[0]  u [m/s]  surge, 0 to 1.5", "  x[1]  r [rad/s]  yaw"]
    with pytest.raises(ShipError, match="control characters"):
        Variable("a\nb", "m", "")


def test_names_are_identifiers() -> None:
    names = {
        "kvlcc2_l7": "kvlcc2_l7",
        "My Ship!": "my_ship",
        "7 m": "ship_7_m",
        "__a__b__": "a_b",
        "Ü": "ship",
        "": "ship",
    }
    assert {name: identifier(name) for name in names} == names
    assert one_line(" a\n b\x00\tc ") == "a b c"


def test_a_control_is_limited_by_its_actuator_and_by_where_the_model_holds() -> None:
    ship = load("kvlcc2_l7")
    hard = math.radians(35.0)
    limits = {one.name: (one.low, one.high) for one in outline(ship).controls}
    assert limits["delta"] == pytest.approx((-hard, hard))
    assert limits["n_P"] == (0.0, 20.0)
    narrow = replace(ship, validity={"delta": (-0.1, 2.0), "u": (0.5, 1.0)})
    told = outline(narrow)
    assert [(one.low, one.high) for one in told.controls if one.name == "delta"] == [(-0.1, pytest.approx(hard))]
    assert [(one.low, one.high) for one in told.states if one.name == "u"] == [(0.5, 1.0)]
    assert [(one.low, one.high) for one in told.states if one.name == "r"] == [(-math.inf, math.inf)]
    for dt in (0.0, -1.0, math.inf, math.nan):
        with pytest.raises(ShipError, match="must be above zero"):
            outline(ship, dt)


def test_units_of_what_is_around() -> None:
    assert [unit_around(name) for name in ("wind_x", "current_y", "wave_x", "wave_T", "per_depth")] == [
        "m/s", "m/s", "m", "s", "1/m"]  # fmt: skip


def test_a_step_is_of_fourth_order_and_its_slope_the_rate() -> None:
    """Ten steps and twenty of half the length differ from eighty by a ratio of sixteen."""
    found = equations_of(load("kvlcc2_l7"))
    step, rate = found.step, found.rates
    x0, u, e = [0, 0, 0.3, 1.1, 0.05, 0.02], [11.0, 0.5], [0.0] * 8

    def after(count: int) -> Any:
        x = ca.DM(x0)
        for _ in range(count):
            x = step(x, u, e, 20.0 / count)
        return x.full().ravel()

    fine = after(320)
    ratio = np.abs(after(10) - fine).max() / np.abs(after(20) - fine).max()
    assert 12.0 < ratio < 24.0
    slope = (step(x0, u, e, 1e-6).full().ravel() - x0) / 1e-6
    assert slope == pytest.approx(rate(x0, u, e).full().ravel(), abs=1e-6)
    rates = load("kvlcc2_l7").model.derivative(tuple(x0), tuple(u), CALM)
    assert rate(x0, u, e).full().ravel() == pytest.approx(np.array(rates, float), rel=1e-12)


def test_numbers_that_nothing_depends_on_stay_at_home() -> None:
    ship = load("kvlcc2_l7")
    found = {one.path: one for one in equations_of(ship).numbers}
    assert "body.B" not in found
    assert found["body.m"].value == 3270.0
    assert found["body.m"].unit == "kg"
    assert "3.27 m^3" in found["body.m"].source
