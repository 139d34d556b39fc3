"""Tracing a system into CasADi functions: right-hand side, step preparation, Jacobians."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from ..core.parameters import ParameterError
from ..core.symbolic import Function, alone
from ..core.values import dataclass
from . import Array, Scalars, System


@dataclass(frozen=True)
class Jacobian:
    """Layout of a traced Jacobian function.

    Its output is the rates, then the structural non-zeros of d rates/d state in `A` order, then for
    each row named in `rows` the derivatives with respect to every free parameter.
    """

    function: Function
    A: tuple[tuple[int, int], ...]
    rows: tuple[int, ...]
    free: tuple[str, ...]


_ROWS = 512
"""Rows that `over_rows` evaluates at a time."""


def _symbols(letters: str, groups: Sequence[Sequence[str]]) -> tuple[list[Any], list[tuple[Any, ...]]]:
    """A vector of symbols for each group of names, none of them empty; and the scalars in it."""
    vectors = [ca.SX.sym(letter, max(len(names), 1)) for letter, names in zip(letters, groups, strict=True)]
    return vectors, [tuple(v[i] for i in range(len(names))) for v, names in zip(vectors, groups, strict=True)]


def _column(values: Any) -> Any:
    return ca.densify(ca.vertcat(*(ca.SX(v) for v in values))) if len(values) else ca.SX(0, 1)


def _rates(system: System) -> tuple[list[Any], Any]:
    if system.plant is not None:
        raise ParameterError("a network has no symbolic right-hand side; only training:Training fits one")
    vectors, scalars = _symbols("zap", (system.states, system.acting or system.series, system.parameters))
    return vectors, _column(system.derivative(*scalars))


@alone
def right_hand_side(system: System) -> Function:
    """CasADi function (z, a, p) -> rates, shape (states,)."""
    inputs, rates = _rates(system)
    return ca.Function("rhs", inputs, [ca.cse(rates)])


@alone
def preparation(system: System) -> Function | None:
    """CasADi function (t, dt, z, m, s, p) -> (acting, memory, logged), or None."""
    if system.before is None:
        return None
    t, dt = ca.SX.sym("t"), ca.SX.sym("dt")
    vectors, scalars = _symbols("zmsp", (system.states, system.memory, system.series, system.parameters))
    stepped = system.before(t, dt, *scalars)
    return ca.Function("before", [t, dt, *vectors], [ca.cse(ca.vertcat(*map(_column, stepped)))])


@alone
def kicks(system: System) -> tuple[Function, Function, Function] | None:
    """CasADi functions of `System.kicks`, or None: touch, first and last, with the inputs in the order given there."""
    own = system.kicks
    if own is None:
        return None
    h, names = ca.SX.sym("h"), (system.states, system.acting or system.series, system.parameters)
    (z, a, p), (state, acting, parameters) = _symbols("zap", names)
    met = tuple(f"touched_{k}" for k in range(own.touched))
    (rates, kept, touched), (slopes, (one,), values) = _symbols("kwt", (system.states, ("kept",), met))
    touch = _column(own.touch(state, acting))
    first = _column(own.first(h, state, slopes, acting, values, parameters))
    last = _column(own.last(h, state, one, acting, values, parameters))
    return (ca.Function("touch", [z, a], [ca.cse(touch)]),
            ca.Function("first", [h, z, rates, a, touched, p], [ca.cse(first)]),
            ca.Function("last", [h, z, kept, a, touched, p], [ca.cse(last)]))  # fmt: skip


@alone
def jacobian(system: System, free: tuple[str, ...]) -> Jacobian:
    """Exact Jacobians of the rates with respect to the state and the parameters in `free`."""
    inputs, rates = _rates(system)
    where = [system.parameters.index(name) for name in free]
    A = ca.jacobian(rates, inputs[0])
    B = ca.jacobian(rates, inputs[2])[:, where] if where else ca.SX(rates.size1(), 0)
    pattern = [(i, j) for i in range(A.size1()) for j in range(A.size2()) if A.has_nz(i, j)]
    rows = [i for i in range(B.size1()) if any(B.has_nz(i, j) for j in range(B.size2()))]
    parts = [rates, *(A[i, j] for i, j in pattern), *(ca.densify(B[i, :]).T for i in rows)]
    function = ca.Function("slopes", inputs, [ca.cse(ca.densify(ca.vertcat(*parts)))])
    return Jacobian(function, tuple(pattern), tuple(rows), free)


@alone
def function_of(f: Callable[[Scalars], Scalars], inputs: int) -> Function:
    """`f`, written over scalars, as a CasADi function of one vector."""
    x = ca.SX.sym("x", max(inputs, 1))
    return ca.Function("f", [x], [_column(f(tuple(x[i] for i in range(inputs))))])


@alone
def over_rows(f: Callable[[Scalars], Scalars], rows: Array) -> Array:
    """`f`, written over scalars, of every row; shape (rows, outputs)."""
    # through buffers, some rows at a time: the larger the map, the longer CasADi takes to make it
    size = max(min(len(rows), _ROWS), 1)
    function: Any = function_of(f, rows.shape[1]).map(size)
    buffer, evaluate = function.buffer()
    given: Any = np.zeros((-(-len(rows) // size) * size, max(rows.shape[1], 1)))
    given[: len(rows), : rows.shape[1]] = rows
    found: Any = np.empty((len(given), function.size1_out(0)))
    for low in range(0, len(given), size):
        buffer.set_arg(0, memoryview(given[low : low + size].reshape(-1)))
        buffer.set_res(0, memoryview(found[low : low + size].reshape(-1)))
        evaluate()
    return found[: len(rows)]
