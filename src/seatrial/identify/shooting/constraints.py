"""Inequality constraints on the free parameters for both back ends: conditions on mass and damping matrices.

You 2023 Eq. 19 asks X_u > 0 and X_u (Y_v N_r - Y_r N_v) > 0 of a table in which negative numbers damp; the
intended conditions, which its own result satisfies, are -X_u > 0 and Y_v N_r - Y_r N_v > 0: a ship that slows down,
and that is stable on a straight course at rest.  Eq. 18 (masses above zero) is completed to a positive definite M.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from ...core.symbolic import alone
from ...core.values import dataclass
from ...data import Array
from .. import Problem, StudyError

# How far inside the boundary a search is kept, of each quantity's own size.
_MARGIN = 1e-6


@dataclass(frozen=True)
class Inequalities:
    """Quantities that must stay above zero, scaled to order one.

    Attributes:
        names: what each one is.
        expression: CasADi function p -> values, shape (names,), margins taken off.
        slopes: CasADi function p -> (values, derivatives).
    """

    names: tuple[str, ...]
    expression: Any
    slopes: Any

    @staticmethod
    def none(problem: Problem) -> Inequalities:
        """No inequality at all."""
        return Inequalities._traced(ca.SX.sym("p", len(problem.free)), (), ca.SX(0, 1))

    @staticmethod
    def _traced(p: Any, names: tuple[str, ...], h: Any) -> Inequalities:
        slopes = ca.Function("dh", [p], [h, ca.densify(ca.jacobian(h, p))])
        return Inequalities(names, ca.Function("h", [p], [h]), slopes)

    @staticmethod
    @alone
    def of(problem: Problem) -> Inequalities:
        """Those of Eqs. 18 and 19 that the free parameters can break.

        Raises:
            StudyError: the model has no mass matrix or no linear damping derivatives.
        """
        p = ca.SX.sym("p", len(problem.free))
        model: Any = problem.vector.model(problem.ship.model, p)
        try:
            found = {**_damping(model.damping), **_masses(model.inertia.matrix)}
        except AttributeError:
            raise StudyError(
                f"{problem.ship.name}: constraints need a mass matrix and X_u, Y_v, Y_r, N_v, N_r "
                "(a fossen:Fossen ship); leave constraints = false for other families"
            ) from None
        touched = {name: ca.SX(h) for name, h in found.items() if ca.depends_on(ca.SX(h), p)}
        start = ca.DM(problem.vector.start)
        values = np.array(ca.Function("v", [p], [ca.vertcat(*touched.values())])(start)).ravel()
        # Sizes are those at the start; a damping that starts at zero is measured in its own units.
        size = np.where(np.abs(values) > 0, np.abs(values), 1.0)
        h = ca.vertcat(*(e / s - _MARGIN for e, s in zip(touched.values(), size, strict=True)))
        return Inequalities._traced(p, tuple(touched), h)

    def at(self, p: Array) -> tuple[Array, Array]:
        """Values, shape (names,), and derivatives, shape (names, free)."""
        h, dh = self.slopes(p)
        return np.array(h).reshape(len(self.names)), np.array(dh).reshape(len(self.names), p.size)


@dataclass(frozen=True)
class Penalty:
    """Inequalities as squared residuals that act where one is broken (augmented Lagrangian).

    Attributes:
        of: the inequalities.
        stiffness: weight of a squared violation.
        push: multiplier of each over the stiffness; what makes the penalty exact.
    """

    of: Inequalities
    stiffness: float
    push: Array

    def rows(self, p: Array) -> tuple[Array, Array]:
        """Residuals and their derivatives, shapes (names,) and (names, free)."""
        if not self.of.names:
            return np.zeros(0), np.zeros((0, p.size))
        h, slopes = self.of.at(p)
        broken = self.push - h
        root = np.sqrt(self.stiffness)
        return root * np.maximum(broken, 0.0), np.where(broken > 0, -root, 0.0)[:, None] * slopes

    def pushed(self, p: Array) -> Penalty:
        """With the multipliers that a minimum at `p` implies."""
        if not self.of.names:
            return self
        return Penalty(self.of, self.stiffness, np.maximum(self.push - self.of.at(p)[0], 0.0))


def _damping(d: Any) -> dict[str, Any]:
    return {
        "-X_u": -d.X_u,  # You 2023 (19), sign put right
        "Y_v N_r - Y_r N_v": d.Y_v * d.N_r - d.Y_r * d.N_v,
    }


def _masses(M: Any) -> dict[str, Any]:
    """Leading minors of the symmetric part of M, all above zero where M is positive definite."""
    (a, b, c), (d, e, f) = (M[0][0], M[1][1], M[2][2]), (
        0.5 * (M[0][1] + M[1][0]), 0.5 * (M[0][2] + M[2][0]), 0.5 * (M[1][2] + M[2][1]))  # fmt: skip
    whole = a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e)
    return {"m_11": a, "m_11 m_22 - m_12^2": a * b - d * d, "det M": whole}  # You 2023 (18), completed
