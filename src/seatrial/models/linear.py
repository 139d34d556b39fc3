"""Any model about a trim point: A, B, E, eigenvalues, stability on course, Nomoto's constants, transfer functions.

`trim` finds a steady straight run, `linearise` differentiates the model there (CasADi, exact).  A
sampled model gives the map from one sample to the next instead.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.parameters import ParameterError, unknown
from ..core.symbolic import alone
from ..core.values import dataclass, replace
from ..data import Array
from ..environment import CALM, CHANNELS, Environment
from . import Model, Sampled
from .nomoto2 import SecondOrder, time_constants
from .trim import Trim, next_sample, trim

__all__ = ["Linear", "Trim", "linearise", "trim"]

_SURGE = ("x", "y", "psi", "u")
# Real parts (per second, or of log(lambda)/dt) below this share of the fastest count as zero.
_NEUTRAL = 1e-9
# Sway [m/s] and yaw rate [rad/s] by which a kink is stepped off.
_TILT = 1e-10
# Leading coefficients below this share of the largest one are rounding.
_ROUNDING = 1e-13


@dataclass(frozen=True)
class Linear:
    """x' = A x + B c + E e for small departures x, c, e from the trim point; x(t + dt) = ... where `dt` is set.

    Attributes:
        states, controls, environment: names of the rows of x, c and e; units as in `models.UNITS`.
        A, B, E: Jacobians, shapes (states, states), (states, controls), (states, 8).
        at: the trim point.
        obeys: per control the order it obeys and the factor, see `Model.follows`.
        differential: per control what it takes of the helm besides, see `Model.differential`.
        dt: sample time [s] of a sampled model; None in continuous time.
    """

    states: tuple[str, ...]
    controls: tuple[str, ...]
    A: Array
    B: Array
    E: Array
    at: Trim
    obeys: tuple[tuple[str, float], ...]
    dt: float | None = None
    environment: tuple[str, ...] = CHANNELS
    differential: tuple[float, ...] = ()

    def reduced(self, names: Sequence[str]) -> Linear:
        """The same with some states only, the others held at the trim point.

        Raises:
            ParameterError: no such state.
        """
        for name in names:
            if name not in self.states:
                raise ParameterError(unknown(name, self.states, "state"))
        rows = [self.states.index(name) for name in names]
        return replace(self, states=tuple(names), A=self.A[np.ix_(rows, rows)], B=self.B[rows], E=self.E[rows])

    def lateral(self) -> Linear:
        """Sway, yaw and the model's own states, without those that the model holds (the sway of a Nomoto ship)."""
        moving = self._moving()
        return moving.reduced([n for n in moving.states if n not in _SURGE and not n.startswith("u_back")])

    def steering(self) -> Linear:
        """`lateral`, and surge too where the trim point couples them (a ship that needs helm on a straight course)."""
        moving, lateral = self._moving(), self.lateral()
        rows = [moving.states.index(name) for name in lateral.states]
        others = [i for i in range(len(moving.states)) if i not in rows]
        coupling = np.abs(moving.A[np.ix_(rows, others)])
        apart = np.max(coupling, initial=0.0) <= _NEUTRAL * np.max(np.abs(moving.A), initial=0.0)
        return lateral if apart else moving

    def _moving(self) -> Linear:
        """Without the states that the model holds."""
        still = np.eye(len(self.states)) if self.dt else np.zeros_like(self.A)
        held = [bool(np.all(a == s) and not b.any()) for a, b, s in zip(self.A, self.B, still, strict=True)]
        return self.reduced([name for name, stays in zip(self.states, held, strict=True) if not stays])

    @property
    def eigenvalues(self) -> NDArray[np.complex128]:
        """Eigenvalues, shape (states,), complex: [1/s], or those of the map from sample to sample."""
        return np.linalg.eigvals(self.A).astype(complex)

    @property
    def growth(self) -> NDArray[np.complex128]:
        """Eigenvalues per second in either case, shape (states,); -inf for what dies within a sample [1/s]."""
        if self.dt is None:
            return self.eigenvalues
        found = self.eigenvalues
        gone = np.abs(found) < _NEUTRAL
        rates = np.log(np.where(gone, 1.0, found)) / self.dt
        return np.where(gone, complex(-math.inf), rates)

    def stability(self) -> tuple[str, str]:
        """("stable", "unstable" or "neutral" on a straight course with the rudder held; the same in plain words)."""
        # A regression knows no axes: its equations of sway and yaw lean on surge as they come.
        system = self.lateral() if self.dt is None else self.steering()
        rates = system.growth.real
        worst = float(np.max(rates, initial=-math.inf))
        scale = float(np.max(np.abs(rates[np.isfinite(rates)]), initial=0.0))
        if not system.states or abs(worst) <= _NEUTRAL * scale:
            return "neutral", "neutral on course: a small turn neither dies out nor grows by itself"
        if worst < 0:
            return "stable", (
                f"stable on course: with the rudder held, a small turn dies out, to 37 % in {-1.0 / worst:.3g} s"
            )
        return "unstable", (
            f"unstable on course: with the rudder held, a small turn doubles every {math.log(2.0) / worst:.3g} s; "
            "it needs a helmsman or an autopilot"
        )

    def input(self, order: str = "delta") -> Array:
        """Column of B for an order (delta, n_P, or a control by name), shape (states,).

        Raises:
            ParameterError: no control obeys it.
        """
        weights = np.array([factor if name == order else 0.0 for name, factor in self.obeys])
        if order == "delta" and self.differential:
            weights = weights + np.array(self.differential)
        if not weights.any():
            if order not in self.controls:
                known = dict.fromkeys((*(name for name, _ in self.obeys), *self.controls))
                raise ParameterError(unknown(order, known, "order"))
            weights = np.array([float(name == order) for name in self.controls])
        return np.asarray(self.B @ weights, dtype=np.float64)

    def nomoto(self, order: str = "delta") -> SecondOrder:
        """K [1/s] and T_1, T_2, T_3 [s] of the yaw rate's answer to an order (Sawada 2024 Eq. 5).

        A first-order model has T_2 = T_3 = 0.

        Raises:
            ParameterError: a sampled model, a model of higher order, or one that is neutrally stable.
        """
        lateral = self.lateral()
        n = len(lateral.states)
        if self.dt is not None or n not in (1, 2) or "r" not in lateral.states:
            kind = "sampled" if self.dt else f"of order {n} ({', '.join(lateral.states)})"
            raise ParameterError(f"Nomoto's constants need a continuous model of order 1 or 2; this one is {kind}")
        numerator, denominator = lateral.polynomials("r", order)
        if denominator[-1] == 0.0 or numerator[-1] == 0.0:
            raise ParameterError("Nomoto's constants are not finite: neutrally stable, or yaw does not obey the order")
        K, scaled = numerator[-1] / denominator[-1], denominator / denominator[-1]
        if n == 1:
            return SecondOrder(float(K), float(scaled[0]), 0.0, 0.0)
        T_1, T_2 = time_constants(float(scaled[1]), float(scaled[0]))
        return SecondOrder(float(K), T_1, T_2, float(numerator[-2] / numerator[-1]))

    def polynomials(self, output: str = "r", order: str = "delta") -> tuple[Array, Array]:
        """Numerator and denominator of output over order, in falling powers of s (of z for a sampled model)."""
        if output == "psi" and output not in self.states:
            above, below = self.polynomials("r", order)
            if self.dt is None:
                return above, np.append(below, 0.0)
            # psi(t + dt) - psi(t) is the mean of r at both ends times dt.
            return 0.5 * self.dt * np.convolve(above, [1.0, 1.0]), np.convolve(below, [1.0, -1.0])
        if output not in self.states:
            raise ParameterError(unknown(output, (*self.states, "psi"), "output"))
        b, c = self.input(order), np.eye(len(self.states))[self.states.index(output)]
        below = np.poly(self.A)
        # det(s - A + b c) = det(s - A) + c adj(s - A) b
        above = np.poly(self.A - np.outer(b, c)) - below
        return np.asarray(above, dtype=np.float64), np.asarray(below, dtype=np.float64)

    def transfer_function(self, output: str = "r", order: str = "delta") -> Any:
        """Answer of an output (r, v_m, u or psi) to an order, as a ``control.TransferFunction``; SI.

        r, v_m and psi take the lateral model where the trim point does not couple it to surge.

        Raises:
            ParameterError: no such output or order.
            ImportError: python-control is not installed.
        """
        steering = self.steering()
        system = steering if output == "psi" or output in steering.states else self
        above, below = system.polynomials(output, order)
        above = np.where(np.abs(above) > _ROUNDING * np.max(np.abs(above)), above, 0.0)
        kept = np.trim_zeros(above, "f") if above.any() else above[-1:]
        return _control().tf(kept, below) if self.dt is None else _control().tf(kept, below, self.dt)

    def state_space(self) -> Any:
        """All states and controls as a ``control.StateSpace``, with names; needs python-control."""
        n = len(self.states)
        arguments = (self.A, self.B, np.eye(n), np.zeros((n, len(self.controls))), *([self.dt] if self.dt else []))
        return _control().ss(*arguments, states=self.states, inputs=self.controls, outputs=self.states)


@alone
def linearise(model: Model, at: Trim, states: Sequence[str] | None = None, side: float | None = None) -> Linear:
    """Jacobians of a model at a trim point, by automatic differentiation.

    Some models have a kink at zero drift (a flow straightening of the rudder that differs from side to side):
    there the slope depends on which way the ship begins to turn.

    Args:
        model: any model.
        at: the point, usually from `trim`; the rates there need not vanish.
        states: names to keep; None keeps all but x, y and psi.
        side: which side of a kink: +1 a turn to starboard, -1 to port; None takes the mean of both.
    """
    import casadi as ca

    x = ca.SX.sym("x", len(at.state))
    c, e = ca.SX.sym("c", len(at.control)), ca.SX.sym("e", len(CHANNELS))
    here, acting = tuple(ca.vertsplit(x)), tuple(ca.vertsplit(c))
    around = Environment(*ca.vertsplit(e))
    sampled = model if isinstance(model, Sampled) else None
    after = next_sample(sampled, here, acting, around) if sampled else model.derivative(here, acting, around)
    y = ca.vertcat(*(ca.SX(value) for value in after))
    jacobians = ca.Function("jacobians", [x, c, e], [ca.jacobian(y, v) for v in (x, c, e)])
    tilt = np.zeros(len(at.state))
    tilt[at.states.index("v_m")], tilt[at.states.index("r")] = -_TILT, _TILT
    found = [
        [np.array(m.full()) for m in jacobians(np.array(at.state) + s * tilt, at.control, tuple(at.environment))]
        for s in ((1.0, -1.0) if side is None else (side,))
    ]
    A, B, E = (np.mean(group, axis=0) for group in zip(*found, strict=True))
    dt = None if sampled is None else float(sampled.dt)
    full = Linear(at.states, tuple(model.controls), A, B, E, at, model.follows, dt, differential=model.differential)
    return full.reduced(states or [name for name in at.states if name not in ("x", "y", "psi")])


def straight(model: Model, speed: float, environment: Environment = CALM, side: float | None = None) -> Linear:
    """`linearise` at the straight run of `trim` at a speed [m/s]."""
    return linearise(model, trim(model, speed=speed, environment=environment), side=side)


def course_stability(model: Model, at: Trim) -> tuple[str, str]:
    """`Linear.stability` of a trim point where the two sides of a kink may disagree: the worse word, and both."""
    starboard, port = (linearise(model, at, side=side).stability() for side in (1.0, -1.0))
    if starboard[0] == port[0]:
        return linearise(model, at).stability() if starboard[1] != port[1] else starboard
    worse = max((starboard[0], port[0]), key=("stable", "neutral", "unstable").index)
    return worse, f"not the same on both sides: to starboard {starboard[1]}; to port {port[1]}"


def _control() -> Any:
    try:
        import control
    except ImportError:
        raise ImportError("transfer functions need python-control: pip install 'seatrial[control]'") from None
    return control
