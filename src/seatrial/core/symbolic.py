"""The element-wise functions that physics may use, on floats and on CasADi symbols alike.

No other module handles both Python floats and CasADi symbols.  Each function is finite, with
finite derivatives, wherever physics evaluates it: at rest, astern, in the dead branch of a switch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import wraps
from threading import RLock
from typing import ParamSpec, Protocol, TypeVar

import casadi as ca
from casadi import SX

from .parameters import Scalar

P = ParamSpec("P")
R = TypeVar("R")
_SYMBOLS = RLock()

TINY = 1e-12
"""Squared velocity [m^2/s^2] below which a speed is rounded to its smooth value at rest."""


class Function(Protocol):
    """A CasADi function of scalars, as far as the package uses it; CasADi has no types of its own.

    It is called with symbols, numbers or arrays, and `map` takes as many columns of each input.  Of instruction `k`
    there are its operation, the work elements that it reads and writes, and the number of a constant.
    """

    def __call__(self, *arguments: Scalar) -> Scalar: ...

    def map(self, count: int, /) -> Function: ...

    def save(self, path: str, /) -> None: ...

    def n_instructions(self) -> int: ...

    def instruction_id(self, k: int, /) -> int: ...

    def instruction_input(self, k: int, /) -> Sequence[int]: ...

    def instruction_output(self, k: int, /) -> Sequence[int]: ...

    def instruction_constant(self, k: int, /) -> float: ...


def alone(function: Callable[P, R]) -> Callable[P, R]:
    """`function`, which makes and drops CasADi expressions, in one thread at a time.

    Expressions share nodes and a table of constants, and CasADi lets other threads of Python run while it works
    on them: two threads that trace at once may bring the process down.
    """

    @wraps(function)
    def one(*args: P.args, **kwargs: P.kwargs) -> R:
        with _SYMBOLS:
            return function(*args, **kwargs)

    return one


def is_symbol(x: Scalar) -> bool:
    """Whether `x` is a CasADi symbol rather than a number."""
    return isinstance(x, SX)


def _either(symbol: Callable[[Scalar], Scalar], number: Callable[[float], float]) -> Callable[[Scalar], Scalar]:
    def apply(x: Scalar) -> Scalar:
        return symbol(x) if isinstance(x, SX) else number(x)

    return apply


def _exp(x: float) -> float:
    return math.exp(x) if x < 709.0 else math.inf


sin = _either(ca.sin, math.sin)
cos = _either(ca.cos, math.cos)
exp = _either(ca.exp, _exp)
log = _either(ca.log, math.log)
tanh = _either(ca.tanh, math.tanh)
magnitude = _either(ca.fabs, abs)
floor = _either(ca.floor, math.floor)


def sign(x: Scalar) -> Scalar:
    """-1, 0 or +1."""
    return ca.sign(x) if isinstance(x, SX) else float(x > 0) - float(x < 0)


def where(condition: Scalar, yes: Scalar, no: Scalar) -> Scalar:
    """`yes` where `condition` holds, else `no`; both are evaluated, so both must be finite."""
    return ca.if_else(condition, yes, no) if isinstance(condition, SX) else (yes if condition else no)


def both(a: Scalar, b: Scalar) -> Scalar:
    """Logical and."""
    return ca.logic_and(a, b) if isinstance(a, SX) or isinstance(b, SX) else bool(a and b)


def negated(a: Scalar) -> Scalar:
    """Logical not."""
    return ca.logic_not(a) if isinstance(a, SX) else not a


def larger(a: Scalar, b: Scalar) -> Scalar:
    """The larger of two values."""
    return ca.fmax(a, b) if isinstance(a, SX) or isinstance(b, SX) else max(a, b)


def smaller(a: Scalar, b: Scalar) -> Scalar:
    """The smaller of two values."""
    return ca.fmin(a, b) if isinstance(a, SX) or isinstance(b, SX) else min(a, b)


def clip(x: Scalar, low: Scalar, high: Scalar) -> Scalar:
    """`x` held within [low, high]."""
    return smaller(larger(x, low), high)


def root(x: Scalar) -> Scalar:
    """Square root that is zero, with zero derivative, for x <= 0 (dead branches, rounding)."""
    if isinstance(x, SX):
        live = x > 0
        return ca.if_else(live, ca.sqrt(ca.if_else(live, x, 1.0)), 0.0)
    return math.sqrt(x) if x > 0 else 0.0


def speed(u: Scalar, v: Scalar) -> Scalar:
    """sqrt(u^2 + v^2), rounded at rest so that its derivative stays finite [m/s]."""
    square = u * u + v * v + TINY
    return ca.sqrt(square) if isinstance(square, SX) else math.sqrt(square)


def atan2(y: Scalar, x: Scalar) -> Scalar:
    """Angle of (x, y) in (-pi, pi]; zero, with finite derivatives, at the origin."""
    if isinstance(y, SX) or isinstance(x, SX):
        rest = x * x + y * y <= 0
        return ca.atan2(y, ca.if_else(rest, 1.0, x))
    return math.atan2(y, x) if (x or y) else 0.0
