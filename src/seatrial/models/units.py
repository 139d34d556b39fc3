"""A small residual network: hidden tanh units of the terms of the residual, zero at rest and bounded.

Unit h1 looks at the ship and at its mirror image about the centre plane: with z = b + e + o, the sum of a bias, of
terms that stay as they are in the mirror and of terms that change sign, and z' = b + e - o,

    X_0 W_X ((tanh z + tanh z') / 2 - tanh b),   Y_0 W_Y (tanh z - tanh z') / 2,   N_0 W_N (tanh z - tanh z') / 2,

so the network is symmetric by construction (what tells port from starboard is left to the polynomial), silent where
all its terms are, and never more than 2 |W_X|, |W_Y| and |W_N| of the typical force: the zero output at the origin
of Wakita 2022 Eq. 9 and the bound of its tanh, for a force in place of an acceleration.
"""

from __future__ import annotations

from collections.abc import Mapping

from ..core.parameters import ParameterError, Scalar, Spec, Terms
from ..core.symbolic import tanh
from ..forces import Force
from . import residual

BIAS = "0"


def inward(name: str) -> Spec:
    """The `Spec` of a weight into a unit: ``h1_u_U`` of the term u|u| into h1, ``h1_0`` its bias.

    Raises:
        ParameterError: no unit before the term, or a term that cannot be.
    """
    unit, term = _split(name, "its terms, such as h1_u or h1_d_N, and h1_0 for its bias")
    return Spec("", f"bias of unit {unit}" if term == BIAS else f"{residual.meaning(term).about}, into unit {unit}")


def outward(name: str) -> Spec:
    """The `Spec` of what a unit gives: ``h1_X``, ``h1_Y`` or ``h1_N``, over the typical force.

    Raises:
        ParameterError: any other name.
    """
    unit, axis = _split(name, "X, Y or N, such as h1_Y")
    if axis not in ("X", "Y", "N"):
        raise ParameterError(f"'{name}' goes to no force; a unit gives X, Y or N, such as {unit}_Y")
    return Spec("", f"what unit {unit} adds to {axis}, over its typical size")


def _split(name: str, what: str) -> tuple[str, str]:
    unit, _, rest = name.partition("_")
    if not (unit[:1] == "h" and unit[1:].isdigit() and rest):
        raise ParameterError(f"'{name}' names no hidden unit; units are h1, h2, ..., followed by _ and {what}")
    return unit, rest


def network(inwards: Terms, outwards: Terms, factors: Mapping[str, Scalar]) -> Force:
    """Force of all units over the typical sizes; `factors` are those of the residual by letter."""
    sums: dict[str, list[Scalar]] = {}
    for name, weight in inwards.items():
        unit, _, term = name.partition("_")
        place = 0 if term == BIAS else 2 if residual.odd(term) else 1
        own = sums.setdefault(unit, [0.0, 0.0, 0.0])
        own[place] = own[place] + (weight if term == BIAS else weight * residual.product(term, factors))
    total: dict[str, Scalar] = {"X": 0.0, "Y": 0.0, "N": 0.0}
    for unit, (bias, even, odd) in sums.items():
        one, other = tanh(bias + even + odd), tanh(bias + even - odd)
        for axis in total:
            weight = outwards.get(f"{unit}_{axis}")
            given = 0.5 * (one + other) - tanh(bias) if axis == "X" else 0.5 * (one - other)
            total[axis] = total[axis] + weight * given
    return Force(total["X"], total["Y"], total["N"])
