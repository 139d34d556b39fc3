"""Which combinations of parameters act: sums, products and ratios that no data of these trials tell apart.

Where only f(a, b) acts, the sensitivities to a and b are proportional at every instant, and the information of the two
has rank one: its rows are the gradient of f.  A gradient that stays the same from one point to another is that of a
sum, one whose relative form stays is that of a product of powers (the structural identifiability of Bellman and
Astrom 1970, by numbers).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass
from ...data import Array

# Least curvature of a direction, relative to that of its parameters one by one: what rounding leaves of none.
_FLAT = 1e-13
# A parameter shares in a flat direction by more than this, and gradients agree to this, relative.
_PART, _SAME = 1e-5, 1e-5
# The second point differs from the first by up to so much, each parameter by its own share.
_MOVED = 0.03
_NAMED = 6
_COUNTS = ("none", "one", "two", "three", "four", "five", "six")

Point = tuple[Array, Array]
"""Information of the data alone, shape (n, n), and the values where it holds, shape (n,)."""


@dataclass(frozen=True)
class Acting:
    """Parameters of which only combinations act.

    Attributes:
        paths: of the parameters.
        count: combinations of them that act, fewer than there are paths; 0 where a parameter has no influence.
        form: the combination where there is one, "a + b", "a * b" or "a / b"; "" where it is of another form.
    """

    paths: tuple[str, ...]
    count: int
    form: str = ""

    @property
    def subject(self) -> str:
        """The parameters in words."""
        if len(self.paths) == 1:
            return self.paths[0]
        if len(self.paths) > _NAMED:
            return f"{', '.join(self.paths[:_NAMED])} and {len(self.paths) - _NAMED} more"
        return f"{', '.join(self.paths[:-1])} and {self.paths[-1]}"

    @property
    def words(self) -> str:
        """What acts, and the remedy."""
        if not self.count:
            return "has no influence in these trials: fix it"
        left = len(self.paths) - self.count
        fix = f"fix {_COUNTS[left] if left < len(_COUNTS) else left} of them"
        if self.form:
            return f"only {self.form} acts: {fix}"
        if self.count == 1:
            return f"only one combination of {self.subject} acts: {fix}"
        return f"only {self.count} combinations of {self.subject} act: {fix}"


def acting(
    names: Sequence[str], information: Array, values: Array, again: Callable[[Array], Array] | None = None
) -> tuple[Acting, ...]:
    """Parameters without influence, and groups of which fewer combinations act than there are parameters.

    Args:
        names: of the parameters.
        information: of the data alone at `values`, shape (n, n).
        values: of the parameters, shape (n,).
        again: the information at other values; without it sums and products of other than equal weights have no form.
    """
    if not np.isfinite(information).all():
        return ()
    felt = np.diag(information) > 0.0
    none = tuple(Acting((names[int(k)],), 0) for k in np.flatnonzero(~felt))
    at = np.flatnonzero(felt)
    flat = _flat(information[np.ix_(at, at)])
    groups = _groups(flat)
    ranks = [len(group) - int(np.linalg.matrix_rank(flat[group], tol=_PART)) for group in groups]
    single = [at[group] for group, rank in zip(groups, ranks, strict=True) if rank == 1]
    points = [(information, values)]
    if single and again is not None:
        there = _beside(values, np.concatenate(single))
        points.append((again(there), there))
    found: list[Acting] = []
    for group, rank in zip(groups, ranks, strict=True):
        own = at[group]
        paths = tuple(names[int(k)] for k in own)
        found.append(Acting(paths, rank, _form(paths, own, points) if rank == 1 else ""))
    return (*none, *found)


def _beside(values: Array, some: NDArray[np.intp]) -> Array:
    """A second point, where `some` values are others: the others' own are part of the weights of a sum."""
    out = values.copy()
    share = _MOVED * (0.618034 * np.arange(1, some.size + 1) % 1.0 - 0.5)
    out[some] += share * np.where(values[some] != 0.0, np.abs(values[some]), 1.0)
    return out


def _flat(information: Array) -> Array:
    """Directions without curvature as columns, each parameter measured by its own curvature."""
    scale = np.diag(information) ** -0.5
    weight, vectors = np.linalg.eigh(scale[:, None] * information * scale)
    return np.asarray(vectors[:, weight < _FLAT], dtype=np.float64)


def _groups(flat: Array) -> list[NDArray[np.intp]]:
    """Who shares a direction, directly or by others."""
    joined = np.abs(flat @ flat.T) > _PART
    for _ in range(max(len(flat), 1).bit_length()):
        joined = joined @ joined
    groups = {tuple(np.flatnonzero(row).tolist()) for row in joined}
    return [np.array(group, dtype=np.intp) for group in sorted(groups) if len(group) > 1]


def _form(names: Sequence[str], own: NDArray[np.intp], points: Sequence[Point]) -> str:
    """The combination that acts alone, by its gradient at one point or two."""
    first = int(np.argmax(np.abs(points[0][1][own])))
    slopes = [_gradient(point, own, first) for point in points]
    with np.errstate(divide="ignore", invalid="ignore"):
        powers = [g * values[own] / values[own][first] for g, (_, values) in zip(slopes, points, strict=True)]
    linear, geometric = _stays(slopes), _stays(powers)
    if linear == geometric:
        return ""
    return _sum(names, slopes[0]) if linear else _product(names, powers[0])


def _stays(rows: Sequence[Array]) -> bool:
    """Whether rows agree; a single one must have equal weights."""
    if len(rows) == 1:
        return bool(np.allclose(np.abs(rows[0]), 1.0, rtol=_SAME))
    return bool(np.allclose(rows[1], rows[0], rtol=_SAME, atol=0.0))


def _gradient(point: Point, own: NDArray[np.intp], first: int) -> Array:
    """Of what acts, over its component `first`."""
    row = point[0][np.ix_(own, own)][first]
    return np.asarray(row / row[first], dtype=np.float64)


def _sum(names: Sequence[str], slope: Array) -> str:
    weights = slope / np.abs(slope).min()
    weights = weights * np.sign(weights[0])
    terms = [f"{'-' if w < 0 else '+'} {'' if _is(abs(w), 1.0) else f'{abs(w):.3g} '}{name}"
             for name, w in zip(names, weights.tolist(), strict=True)]  # fmt: skip
    return " ".join(terms).removeprefix("+ ")


def _product(names: Sequence[str], powers: Array) -> str:
    sizes = powers / np.abs(powers).min()
    sizes = sizes * (1.0 if (sizes > 0).any() and sizes[0] > 0 else -1.0)
    up = [_power(name, e) for name, e in zip(names, sizes.tolist(), strict=True) if e > 0]
    down = [_power(name, -e) for name, e in zip(names, sizes.tolist(), strict=True) if e < 0]
    return " / ".join((" * ".join(up), *down))


def _power(name: str, size: float) -> str:
    return name if _is(size, 1.0) else f"{name}^{size:.3g}"


def _is(value: float, other: float) -> bool:
    return abs(value - other) <= 1e-3
