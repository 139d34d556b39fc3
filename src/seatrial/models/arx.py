"""Auto-regressive models with inputs: the next velocity from the last ones and the last controls.

Sawada 2024 section 4.1.2.  The structure is the list of coefficients of the ship file, so one class is
AR (no control among them), ARX of the yaw rate, and vector ARX of (u, v_m, r).
"""

from __future__ import annotations

import re
from itertools import islice
from typing import ClassVar, NamedTuple

from ..core.parameters import ParameterError, Scalar, Scalars, Spec, Terms, spec, terms
from ..core.symbolic import cos, sin
from ..core.values import dataclass
from ..environment import Environment, to_body
from . import STATES, STEERING, UNITS, Sampled
from .common import Surroundings

OUTPUTS = STATES[3:]
"""What the regression predicts."""
INPUTS = STEERING
"""What it is driven by."""
CONSTANT = "constant"
"""The name of the regressor that is one."""
_NAME = re.compile(r"^(u|v_m|r)_(u|v_m|r|n_P|delta)_([1-9][0-9]*)$|^(u|v_m|r)_constant$")


class Lag(NamedTuple):
    """What a coefficient multiplies: `of` (a velocity, a control, or "constant") `lag` samples before `output`."""

    output: str
    of: str
    lag: int


def lag_of(name: str) -> Lag:
    """The meaning of a coefficient's name: ``r_delta_2`` is of delta, two samples back, in the equation of r.

    ``r_constant`` is the constant of that equation.

    Raises:
        ParameterError: a name that cannot be a coefficient.
    """
    found = _NAME.match(name)
    if found is None:
        raise ParameterError(
            f"no coefficient '{name}': it is <output>_<what>_<lag>, such as r_delta_2, with an output of "
            f"{', '.join(OUTPUTS)}, one of those or {', '.join(INPUTS)}, and a lag from 1; or r_constant"
        )
    output, of, lag, alone = found.groups()
    return Lag(output, of, int(lag)) if output else Lag(alone, CONSTANT, 0)


def coefficient(name: str) -> Spec:
    """Unit and meaning of a coefficient."""
    output, of, lag = lag_of(name)
    if of == CONSTANT:
        return Spec(UNITS[output], f"constant in the equation of {output}")
    unit = "-" if of == output else f"({UNITS[output]})/({UNITS[of]})"
    return Spec(unit, f"coefficient of {of}, {lag} sample{'s' if lag > 1 else ''} back, in the equation of {output}")


@dataclass(frozen=True, kw_only=True)
class Arx(Sampled):
    """x(t) = sum a_i x(t - i) + sum b_j c(t - j) + constant, one equation per velocity that has a coefficient.

    x are velocities through the water, c the controls.  A velocity without an equation is held.  The
    equations are linear: what is even in the rudder, such as the loss of speed in a turn, is beyond them;
    and their constants belong to the run they were fitted to, so the model is not valid at rest.
    """

    valid_at_rest: ClassVar[bool] = False

    dt: Scalar = spec("s", "sample time; the model runs at no other", (1e-6, 1e4))
    coefficients: Terms = terms(coefficient)

    def __post_init__(self) -> None:
        for name in self.coefficients.names:
            lag_of(name)

    @property
    def lags(self) -> dict[str, int]:
        """Longest lag of each velocity and control that appears, in samples."""
        out: dict[str, int] = {}
        for name in self.coefficients.names:
            _, of, lag = lag_of(name)
            if of != CONSTANT:
                out[of] = max(out.get(of, 1), lag)
        return {name: out[name] for name in (*OUTPUTS, *INPUTS) if name in out}

    @property
    def memory(self) -> tuple[str, ...]:
        """Lagged values: of a control itself, of a velocity the change since (r_back_1 is r(t - 1) - r(t)).

        Changes, because they are zero for a ship that did not accelerate, whatever the current.
        """
        return tuple(f"{name}_back_{k}" for name, longest in self.lags.items() for k in range(1, longest))

    def begin(self, state: Scalars, control: Scalars) -> Scalars:
        held = {**dict.fromkeys(OUTPUTS, 0.0), **dict(zip(INPUTS, control, strict=True))}
        return tuple(held[name] for name, longest in self.lags.items() for _ in range(1, longest))

    def advance(
        self, state: Scalars, control: Scalars, environment: Environment, memory: Scalars
    ) -> tuple[Scalars, Scalars]:
        around = Surroundings.of(state, environment)
        values = (around.u_r, around.v_r, around.r, *control)
        now: dict[str, Scalar] = dict(zip((*OUTPUTS, *INPUTS), values, strict=True))
        past = self._past(now, memory)
        ruled = {lag_of(name).output for name in self.coefficients.names}
        after = {name: 0.0 if name in ruled else now[name] for name in OUTPUTS}
        for name, number in self.coefficients.items():
            output, of, lag = lag_of(name)
            after[output] = after[output] + number * (1.0 if of == CONSTANT else past[of][lag - 1])  # (9)
        # The ship turns within the current until the next sample; r is linear in between.
        psi = state[2] + 0.5 * self.dt * (now["r"] + after["r"])
        u_C, v_C = to_body(environment.current_x, environment.current_y, cos(psi), sin(psi))
        ground = (after["u"] + u_C, after["v_m"] + v_C, after["r"])
        rates = tuple((b - a) / self.dt for a, b in zip(state[3:6], ground, strict=True))
        return rates, self._remembered(now, after, memory)

    def _past(self, now: dict[str, Scalar], memory: Scalars) -> dict[str, list[Scalar]]:
        """Values of each velocity and control, this sample's first."""
        out, kept = dict[str, list[Scalar]](), iter(memory)
        for name, longest in self.lags.items():
            out[name] = [now[name]]
            for back in islice(kept, longest - 1):
                out[name].append(back if name in INPUTS else out[name][-1] + back)
        return out

    def _remembered(self, now: dict[str, Scalar], after: dict[str, Scalar], memory: Scalars) -> Scalars:
        out, kept = list[Scalar](), iter(memory)
        for name, longest in self.lags.items():
            first = now[name] if name in INPUTS else now[name] - after[name]
            out += [first, *islice(kept, longest - 1)][: longest - 1]
        return tuple(out)
