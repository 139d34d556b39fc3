"""Functions of symbolic: one value on floats and on symbols."""

from __future__ import annotations

import itertools
import math
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import casadi as ca
import numpy as np
import pytest

from seatrial.core.symbolic import (
    atan2,
    both,
    clip,
    cos,
    exp,
    floor,
    is_symbol,
    larger,
    log,
    magnitude,
    negated,
    root,
    sign,
    sin,
    smaller,
    speed,
    tanh,
    where,
)  # fmt: skip
from seatrial.engine.trace import over_rows


def where_above(a: Any, b: Any) -> Any:
    return where(a > b, 3.0 * a, b - 1.0)


@pytest.mark.parametrize("x", [-2.5, -1.0, -1e-12, 0.0, 0.999999, 1.0, 16807.0 * (2.0**31 - 2.0) / (2.0**31 - 1.0)])
def test_floor_is_the_greatest_whole_number_below(x: float) -> None:
    symbol = ca.SX.sym("x")
    assert float(ca.Function("f", [symbol], [floor(symbol)])(x)) == floor(x)
    assert floor(x) <= x < floor(x) + 1


ONE = {
    sin: math.sin, cos: math.cos, exp: math.exp, tanh: math.tanh, magnitude: abs, sign: lambda x: (x > 0) - (x < 0),
    root: lambda x: math.sqrt(max(x, 0.0)), log: lambda x: math.log(x) if x > 0.0 else None,
    negated: lambda x: not x,
}  # fmt: skip
TWO = {
    larger: max, smaller: min, atan2: math.atan2, both: lambda a, b: bool(a) and bool(b),
    speed: lambda u, v: math.hypot(u, v, 1e-6), where_above: lambda a, b: 3.0 * a if a > b else b - 1.0,
}  # fmt: skip
POINTS = (-2.5, -1.0, 0.0, 0.3, 1.0, 4.0)


@pytest.mark.parametrize("function", ONE)
def test_a_function_of_one_is_what_it_is_called_on_floats_and_symbols(function: Any) -> None:
    x = ca.SX.sym("x")
    traced = ca.Function("f", [x], [function(x)])
    for at in POINTS:
        wanted = ONE[function](at)
        if wanted is not None:
            assert float(function(at)) == pytest.approx(float(wanted), rel=1e-12, abs=1e-12)
            assert float(traced(at)) == pytest.approx(float(wanted), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("function", TWO)
def test_a_function_of_two_is_what_it_is_called_on_floats_and_symbols(function: Any) -> None:
    """A number and a symbol go together, in either place."""
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    traced = ca.Function("f", [a, b], [function(a, b)])
    for p, q in itertools.product(POINTS, POINTS):
        wanted = float(TWO[function](p, q))
        assert float(function(p, q)) == pytest.approx(wanted, rel=1e-12, abs=1e-12)
        assert float(traced(p, q)) == pytest.approx(wanted, rel=1e-12, abs=1e-12)
        for half in (ca.Function("f", [a], [function(a, q)])(p), ca.Function("f", [b], [function(p, b)])(q)):
            assert float(half) == pytest.approx(wanted, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("function", [root, magnitude, sign])
def test_derivatives_are_finite_at_rest(function: Any) -> None:
    x = ca.SX.sym("x")
    slope = ca.Function("f", [x], [ca.jacobian(function(x), x)])
    assert all(math.isfinite(float(slope(at))) for at in POINTS)
    assert float(slope(-1.0)) == (-1.0 if function is magnitude else 0.0)


@pytest.mark.parametrize("function", [speed, atan2])
def test_derivatives_of_a_speed_and_an_angle_are_finite_at_rest(function: Any) -> None:
    v = ca.SX.sym("v", 2)
    slope = ca.Function("f", [v], [ca.jacobian(function(v[0], v[1]), v)])
    assert np.isfinite(slope([0.0, 0.0]).full()).all()
    assert slope([3.0, 4.0]).full()[0] == pytest.approx([0.6, 0.8] if function is speed else [4.0 / 25.0, -3.0 / 25.0])


def test_what_is_held_and_what_overflows() -> None:
    assert [clip(x, -1.0, 2.0) for x in (-3.0, 0.5, 7.0)] == [-1.0, 0.5, 2.0]
    assert exp(800.0) == math.inf
    assert exp(700.0) == math.exp(700.0)
    assert (is_symbol(ca.SX.sym("x")), is_symbol(1.0)) == (True, False)


def test_one_thread_at_a_time_makes_expressions() -> None:
    """Expressions share nodes, and CasADi lets other threads run meanwhile: tracing waits for tracing, and itself."""
    inside, most = threading.Semaphore(0), list[bool]()

    def lonely(row: tuple[Any, ...]) -> tuple[Any, ...]:
        most.append(inside.acquire(blocking=False))  # another one is within
        inside.release()
        twice = over_rows(lambda x: (2.0 * x[0],), np.ones((1, 1)))[0, 0]
        threading.Event().wait(0.02)
        inside.acquire()
        if most[-1]:
            inside.release()
        return (twice * row[0],)

    with ThreadPoolExecutor(3) as pool:
        found = list(pool.map(lambda k: over_rows(lonely, np.full((2, 1), float(k))), range(3)))
    assert not any(most)
    assert [one[:, 0].tolist() for one in found] == [[0.0, 0.0], [2.0, 2.0], [4.0, 4.0]]
