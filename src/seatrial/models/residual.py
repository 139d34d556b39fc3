"""Residual force of a hybrid: a polynomial in scaled velocities, controls and wind, and a small network.

A term is named by its factors: ``u_U`` is u|u|, ``d_n_N`` is delta n|n|.  Each factor is a quantity over its
typical size, held within the range of the data, so every term is bounded: beyond the data the residual stays
what it was at their edge, and the physics below it, which grows with the square of the speed, dominates.

A small network of hidden tanh units of those terms may stand beside the polynomial, zero at rest and bounded.
Unit h1 looks at the ship and at its mirror image about the centre plane: with z = b + e + o, the sum of a bias, of
terms that stay as they are in the mirror and of terms that change sign, and z' = b + e - o,

    X_0 W_X ((tanh z + tanh z') / 2 - tanh b),   Y_0 W_Y (tanh z - tanh z') / 2,   N_0 W_N (tanh z - tanh z') / 2,

so the network is symmetric by construction (differences between the sides are left to the polynomial), silent where
all its terms are, and never more than 2 |W_X|, |W_Y| and |W_N| of the typical force: the zero output at the origin
of Wakita 2022 Eq. 9 and the bound of its tanh, for a force in place of an acceleration.
"""

from __future__ import annotations

from collections.abc import Mapping

from ..core.parameters import ParameterError, Scalar, Spec, Terms, spec
from ..core.symbolic import clip, magnitude, speed, tanh
from ..core.values import dataclass
from ..forces import Flow, Force

FACTORS = {
    "u": "surge velocity", "v": "sway velocity", "r": "yaw rate", "n": "revolutions", "d": "rudder angle",
    "a": "apparent wind from ahead", "b": "apparent wind from starboard", "w": "speed of the apparent wind",
    "m": "remembered revolutions",
}  # fmt: skip
"""Letters of the factors; a capital is the magnitude."""

ODD = "vrdb"
"""Letters of factors that change sign in the mirror about the centre plane."""
# Longest published terms of a polynomial hull have five factors; a longer name is a slip.
_HIGHEST = 5
BIAS = "0"
"""Name of the bias of a hidden unit."""


def meaning(name: str) -> Spec:
    """The `Spec` of a term by its name.

    Raises:
        ParameterError: an unknown factor, too many of them, or a term that speaks at rest.
    """
    factors = name.split("_")
    bad = [f for f in factors if f.lower() not in FACTORS or f == "W" or len(f) != 1]
    if bad:
        raise ParameterError(
            f"no factor '{bad[0]}' in '{name}'; a term is factors joined by _, of {', '.join(FACTORS)} "
            "(a capital is the magnitude), such as u_U or d_n_N"
        )
    if len(factors) > _HIGHEST:
        raise ParameterError(f"'{name}' has {len(factors)} factors; a term has {_HIGHEST} at most")
    if set(name.lower()) <= {"d", "_"}:
        raise ParameterError(f"'{name}' is a force of the rudder at rest; give it a velocity or revolutions too")
    words = (FACTORS[f] if f in FACTORS else f"|{FACTORS[f.lower()]}|" for f in factors)
    return Spec("", f"weight of {' x '.join(words)}")


def odd(name: str) -> bool:
    """Whether a term changes sign in the mirror image about the centre plane."""
    return sum(name.count(letter) for letter in ODD) % 2 == 1


@dataclass(frozen=True, kw_only=True)
class Scale:
    """Typical sizes of the residual and of its factors, and the range of the data in which they are held."""

    X_0: Scalar = spec("N", "surge force of a term of weight one", (1e-9, 1e12))
    Y_0: Scalar = spec("N", "sway force of a term of weight one", (1e-9, 1e12))
    N_0: Scalar = spec("N m", "yaw moment of a term of weight one", (1e-9, 1e15))
    u_0: Scalar = spec("m/s", "typical surge velocity", (1e-6, 100.0))
    v_0: Scalar = spec("m/s", "typical sway velocity", (1e-6, 100.0))
    r_0: Scalar = spec("rad/s", "typical yaw rate", (1e-9, 10.0))
    n_0: Scalar = spec("1/s", "typical revolutions", (1e-6, 1e3))
    delta_0: Scalar = spec("rad", "typical rudder angle", (1e-6, 3.2))
    w_0: Scalar = spec("m/s", "typical apparent wind", (1e-6, 100.0))
    u_max: Scalar = spec("m/s", "largest surge velocity of the data", (1e-6, 100.0))
    v_max: Scalar = spec("m/s", "largest sway velocity of the data", (1e-6, 100.0))
    r_max: Scalar = spec("rad/s", "largest yaw rate of the data", (1e-9, 10.0))
    n_max: Scalar = spec("1/s", "largest revolutions of the data", (1e-6, 1e3))
    delta_max: Scalar = spec("rad", "largest rudder angle of the data", (1e-6, 3.2))
    w_max: Scalar = spec("m/s", "largest component of the apparent wind of the data", (1e-6, 100.0))

    def factors(self, flow: Flow, remembered: Scalar) -> dict[str, Scalar]:
        """Every factor by its letter, over its typical size and within the range of the data."""
        given = {
            "u": (flow.u, self.u_0, self.u_max), "v": (flow.v_m, self.v_0, self.v_max),
            "r": (flow.r, self.r_0, self.r_max), "n": (flow.n_P, self.n_0, self.n_max),
            "d": (flow.delta, self.delta_0, self.delta_max), "a": (flow.u_A, self.w_0, self.w_max),
            "b": (flow.v_A, self.w_0, self.w_max), "m": (remembered, self.n_0, self.n_max),
        }  # fmt: skip
        found = {letter: clip(x, -largest, largest) / typical for letter, (x, typical, largest) in given.items()}
        found |= {letter.upper(): magnitude(value) for letter, value in found.items()}
        # Rounded at no wind by TINY, which is taken off again: still air pushes nothing.
        return found | {"w": speed(found["a"], found["b"]) - speed(0.0, 0.0)}

    def force(self, factors: Mapping[str, Scalar], X: Terms, Y: Terms, N: Terms) -> Force:
        """Sum of the terms [N, N, N m] of the factors by letter."""
        return self.sized(Force(_sum(X, factors), _sum(Y, factors), _sum(N, factors)))

    def sized(self, force: Force) -> Force:
        """A force over the typical sizes as a force [N, N, N m]."""
        return Force(self.X_0 * force.X, self.Y_0 * force.Y, self.N_0 * force.N)


def product(name: str, factors: Mapping[str, Scalar]) -> Scalar:
    """A term: the product of its factors."""
    total: Scalar = 1.0
    for letter in name.split("_"):
        total = total * factors[letter]
    return total


def _sum(terms: Terms, factors: Mapping[str, Scalar]) -> Scalar:
    total: Scalar = 0.0
    for name, weight in terms.items():
        total = total + weight * product(name, factors)
    return total


def inward(name: str) -> Spec:
    """The `Spec` of a weight into a unit: ``h1_u_U`` of the term u|u| into h1, ``h1_0`` its bias.

    Raises:
        ParameterError: no unit before the term, or a term that cannot be.
    """
    unit, term = _split(name, "its terms, such as h1_u or h1_d_N, and h1_0 for its bias")
    return Spec("", f"bias of unit {unit}" if term == BIAS else f"{meaning(term).about}, into unit {unit}")


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
        place = 0 if term == BIAS else 2 if odd(term) else 1
        own = sums.setdefault(unit, [0.0, 0.0, 0.0])
        own[place] = own[place] + (weight if term == BIAS else weight * product(term, factors))
    total: dict[str, Scalar] = {"X": 0.0, "Y": 0.0, "N": 0.0}
    for unit, (bias, even, uneven) in sums.items():
        one, other = tanh(bias + even + uneven), tanh(bias + even - uneven)
        for axis in total:
            weight = outwards.get(f"{unit}_{axis}")
            given = 0.5 * (one + other) - tanh(bias) if axis == "X" else 0.5 * (one - other)
            total[axis] = total[axis] + weight * given
    return Force(**total)
