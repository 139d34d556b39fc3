"""Thrust by revolutions, per thruster, from bollard-pull data: the polynomial of `forces.azimuth.Azimuth`.

Terms are selected by cross-validation: all rows of one level of revolutions are left out at a time, except
the greatest, because predicting that one is extrapolation, which a map refuses.  Every set leaves a level to
spare when one is left out, so that an error is never that of an exact interpolation.  Of the sets whose error
is not significantly above the least, the one with fewest terms is taken; a polynomial that falls anywhere
within the tested range, or pushes against n there, is excluded.  The errors at the levels left out also give
the uncertainty of the polynomial.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...core.values import dataclass, replace
from ...data import Array, DataError
from ...forces.azimuth import Azimuth

GREATEST = 5
"""Highest power of n that an azimuth thruster knows."""

_GRID = np.linspace(0.0, 1.0, 401)
# A table or a polynomial may fall by these shares of the greatest thrust and still count as monotone.
_NOISE, _RIPPLE = 0.02, 1e-3
# Share of the greatest revolutions below which the sign of the thrust is that of the offset.
_AT_REST = 0.02
# Levels of revolutions that a set of terms leaves to spare, so that one is left when another is left out.
_SPARE = 2
# Fewest levels of revolutions from which the noise of a table can be estimated.
_MANY = 16


@dataclass(frozen=True)
class Candidate:
    """One set of terms that was tried.

    Attributes:
        powers: the powers of n, 0 for the offset.
        error: root mean square error on levels left out [N].
        monotone: whether the polynomial of all rows rises over the whole range.
    """

    powers: tuple[int, ...]
    error: float
    monotone: bool


@dataclass(frozen=True)
class ThrustMap:
    """Thrust of one thruster at bollard pull: c_0 + c_1 n + ... + c_5 n^5 ahead, the same turned round astern.

    Attributes:
        name: of the thruster.
        coefficients: c_0 to c_5 [N s^k], shape (6,); zero where the term is left out.
        covariance: of the coefficients, shape (6, 6), from the scatter of the rows.
        astern: thrust astern over that ahead at the same |n|; 1, an assumption, where none was tested.
        n_low, n_max: revolutions that the map holds for, from the least (negative astern) to the greatest [1/s].
            Ahead it is the least tested, or 0 where rest was tested or the polynomial has no term at rest.
        R2: share of the variance of the thrust that the map explains.
        rmse: root mean square misfit of the rows [N].
        candidates: the sets of terms that were tried, the one taken included.
        rows: rows of the table.
    """

    name: str
    coefficients: Array
    covariance: Array
    astern: float
    n_low: float
    n_max: float
    R2: float
    rmse: float
    candidates: tuple[Candidate, ...]
    rows: int

    @property
    def powers(self) -> tuple[int, ...]:
        """Powers of n that the map has."""
        return tuple(int(k) for k in np.flatnonzero(np.diag(self.covariance) > 0))

    @property
    def sigma(self) -> Array:
        """Standard deviation of each coefficient, shape (6,)."""
        return np.sqrt(np.diag(self.covariance))

    def thrust(self, n: Array | float, *, extrapolate: bool = False) -> Array:
        """Thrust [N] at revolutions [1/s], of any shape.

        Args:
            extrapolate: let the thrust hold beyond the tested revolutions, as `Azimuth` does, rather than refuse.

        Raises:
            DataError: revolutions that were not tested.
        """
        asked = np.asarray(n, dtype=np.float64)
        slack = 1e-9 * self.n_max
        beyond = asked[(asked > self.n_max + slack) | (asked < self.n_low - slack)]
        if beyond.size and not extrapolate:
            raise DataError(
                f"thruster {self.name}: {beyond.flat[0]:g} 1/s was not tested, the map holds from {self.n_low:g} to "
                f"{self.n_max:g} 1/s; stay within, test further, or ask for extrapolation"
            )
        held = np.clip(asked, -self.n_max, self.n_max)
        ahead = design(np.abs(held), range(GREATEST + 1)) @ self.coefficients
        return np.where(held < 0, -self.astern, np.where(held > 0, 1.0, 0.0)) * ahead

    def azimuth(self, x: float, y: float) -> Azimuth:
        """The thruster at x ahead of midship and y to starboard [m]."""
        numbers = {f"c_{k}": float(c) for k, c in enumerate(self.coefficients)}
        return Azimuth(x=x, y=y, **numbers, n_max=self.n_max, astern=self.astern)


def fit_thrust(
    n: Array, thrust: Array, *, name: str = "1", order: int | None = None, offset: bool | None = None,
    tolerance: float = _NOISE,
) -> ThrustMap:  # fmt: skip
    """The thrust map of one thruster from a table of its bollard pull.

    Args:
        n: revolutions [1/s], shape (rows,); below zero astern.
        thrust: pull [N], shape (rows,); below zero astern.
        name: of the thruster.
        order: highest power of n; None lets cross-validation decide.
        offset: whether thrust at rest, such as a load cell's zero, is a term; None lets cross-validation decide.
        tolerance: how far the mean thrust may fall from one level to the next, over the greatest thrust; four times
            the scatter of a table of many levels is allowed as well.

    Raises:
        DataError: gaps, too few revolutions for a map, or a table that is not monotone; names the revolutions.
    """
    n, thrust = np.asarray(n, dtype=np.float64), np.asarray(thrust, dtype=np.float64)
    where = f"thruster {name}"
    _usable(where, n, thrust, order)
    _rising(where, n, thrust, tolerance)
    ahead = n >= 0
    a, T = n[ahead], thrust[ahead]
    levels = np.unique(a[a > 0])
    if levels.size < 3:
        raise DataError(f"{where}: {levels.size} different revolutions ahead; a map needs at least 3")
    powers, candidates = _choose(where, a, T, order, offset, levels.size)
    c, covariance = least_squares(a, T, powers)
    covariance *= inflation(a, T, powers)
    rested = bool((n <= 0).any()) or 0 not in powers
    coefficients, full = np.zeros(GREATEST + 1), np.zeros((GREATEST + 1, GREATEST + 1))
    coefficients[list(powers)] = c
    full[np.ix_(powers, powers)] = covariance
    back = design(-n[~ahead], powers) @ c
    astern = float(-thrust[~ahead] @ back / (back @ back)) if back.size else 1.0
    if not 0.0 <= astern <= 2.0:
        raise DataError(f"{where}: {astern:.3g} times the thrust ahead astern; check the signs of n and of the thrust")
    misfit = np.concatenate([T - design(a, powers) @ c, thrust[~ahead] + astern * back])
    return ThrustMap(
        name, coefficients, full, astern, min(float(n.min()), 0.0) if rested else float(n.min()), float(a.max()),
        1.0 - float(misfit @ misfit) / float(((thrust - thrust.mean()) ** 2).sum()),
        float(np.sqrt(np.mean(misfit**2))), candidates, n.size,
    )  # fmt: skip


def shared(name: str, both: ThrustMap, thrusters: int) -> ThrustMap:
    """The map of one of several like thrusters that were tested together (You 2023 Eq. 20, whose /2 this is)."""
    k = float(thrusters)
    return replace(
        both, name=name, coefficients=both.coefficients / k, covariance=both.covariance / k**2, rmse=both.rmse / k,
        candidates=tuple(replace(one, error=one.error / k) for one in both.candidates),
    )  # fmt: skip


def fit_thrusters(
    table: Mapping[str, tuple[Array, Array]], thrusters: Sequence[str] | None = None, *,
    order: int | None = None, offset: bool | None = None,
) -> tuple[ThrustMap, ...]:  # fmt: skip
    """A map for each thruster of a table, by name; each row of it (revolutions, thrust).

    Raises:
        DataError: more columns than thrusters, a thruster without a column, or what `fit_thrust` raises.
    """
    names = tuple(table) if thrusters is None else tuple(thrusters)
    spare = [name for name in table if name not in names]
    if spare:
        raise DataError(
            f"the table has thrust of {len(table)} thrusters ({', '.join(table)}), the ship has {len(names)} "
            f"({', '.join(names)}); leave out {', '.join(spare)} or name it"
        )
    absent = [name for name in names if name not in table]
    if absent:
        raise DataError(f"no thrust of {', '.join(absent)}; the table has that of {', '.join(table)}")
    return tuple(fit_thrust(*table[name], name=name, order=order, offset=offset) for name in names)


def _usable(where: str, n: Array, thrust: Array, order: int | None) -> None:
    """Refuse tables without numbers, and an order that there is not."""
    wrong = ""
    if n.shape != thrust.shape or n.ndim != 1:
        wrong = f"{n.size} revolutions and {thrust.size} thrusts; give one of each a row"
    elif not n.size:
        wrong = "no row of revolutions and thrust; a map needs at least 3 revolutions ahead"
    elif not (np.isfinite(n).all() and np.isfinite(thrust).all()):
        wrong = "a row has no number; leave the row out"
    elif not thrust.any():
        wrong = "thrust is zero in every row; check the column and its unit"
    elif order is not None and not 1 <= order <= GREATEST:
        wrong = f"order is {order}; it is from 1 to {GREATEST}"
    if wrong:
        raise DataError(f"{where}: {wrong}")


def _rising(where: str, n: Array, thrust: Array, tolerance: float) -> None:
    """Refuse a table whose mean thrust falls from one level of revolutions to the next."""
    levels, index = np.unique(n, return_inverse=True)
    count = np.bincount(index)
    means = np.bincount(index, thrust) / count
    allowed = tolerance * float(np.abs(thrust).max())
    if levels.size >= _MANY:
        # Third differences leave a smooth curve out; their median does not mind a wrong row.
        scatter = 1.4826 * float(np.median(np.abs(np.diff(means, 3)))) / np.sqrt(20.0)
        allowed = max(allowed, 4.0 * np.sqrt(2.0) * scatter)
    for k in np.flatnonzero(np.diff(means) < -allowed)[:1]:
        raise DataError(
            f"{where}: thrust is not monotone: {means[k]:.4g} N at {levels[k]:g} 1/s, {means[k + 1]:.4g} N at "
            f"{levels[k + 1]:g} 1/s; correct the table, or leave out the revolutions beyond which it falls"
        )


def _choose(
    where: str, n: Array, thrust: Array, order: int | None, offset: bool | None, levels: int
) -> tuple[tuple[int, ...], tuple[Candidate, ...]]:
    """The powers to keep, and all that were tried."""
    orders = range(1, GREATEST + 1) if order is None else (order,)
    full = [tuple(range(1, k + 1)) for k in orders]
    tried = [(0, *powers) if o else powers for powers in full for o in ((False, True) if offset is None else (offset,))]
    if order is None and not offset:
        tried.append((2,))  # Sawada 2024 Eq. 25
    spare, rest = _SPARE if order is None else 1, bool((n == 0).any())
    tried = [p for p in tried if len(p) + spare <= levels + (rest and 0 in p)]
    tried = sorted(tried, key=lambda p: (len(p), sum(p)))
    if not tried:
        raise DataError(f"{where}: {levels} different revolutions ahead; order {order} needs more than {order}")
    squares = [np.concatenate([e**2 for _, e in left_out(n, thrust, powers)]) for powers in tried]
    monotone = [_monotone(least_squares(n, thrust, powers)[0], powers, float(n.max())) for powers in tried]
    found = tuple(Candidate(p, float(np.sqrt(np.mean(e))), m) for p, e, m in zip(tried, squares, monotone, strict=True))
    usable = [k for k, m in enumerate(monotone) if m]
    if not usable:
        raise DataError(f"{where}: every polynomial falls or pushes against the revolutions within the tested range; "
                        "check the table, or lower the order")  # fmt: skip
    best = min(usable, key=lambda k: found[k].error)
    worse = {k: squares[k] - squares[best] for k in usable}
    alike = (k for k, w in worse.items() if w.mean() <= w.std(ddof=1) / np.sqrt(w.size))
    return found[next(alike, best)].powers, found


def _monotone(c: Array, powers: tuple[int, ...], top: float) -> bool:
    """Whether the polynomial rises from rest to the greatest revolutions and has their sign, ripples apart."""
    curve = design(_GRID * top, powers) @ c
    ripple = _RIPPLE * np.abs(curve).max()
    rises = (np.maximum.accumulate(curve) - curve).max() <= ripple and curve[-1] > 0
    return bool(rises and curve[_GRID >= _AT_REST].min() >= -ripple)


# Variance over the mean square of the thrust below which a table is one of a formula.
_EXACT = 1e-20


def design(n: Array, powers: Sequence[int]) -> Array:
    """Powers of n, one a column."""
    return np.stack([n**k for k in powers], axis=-1)


def least_squares(n: Array, thrust: Array, powers: Sequence[int]) -> tuple[Array, Array]:
    """Coefficients and their covariance; revolutions scaled to 1, so that n^5 and n are of one size."""
    top = float(n.max())
    scale = top ** np.array(powers, dtype=np.float64)
    A = design(n / top, powers)
    c, *_ = np.linalg.lstsq(A, thrust, rcond=None)
    # Without an offset a row at rest is met by any coefficients: it carries no information about the noise.
    rows = n.size if 0 in powers else int((n != 0).sum())
    spare = max(rows - len(powers), 1)
    noise = float(((thrust - A @ c) ** 2).sum()) / spare
    # A perfect table still has terms: their variance is tiny, not zero.
    covariance = max(noise, 1e-24 * float(thrust @ thrust)) * np.linalg.pinv(A.T @ A)
    return c / scale, covariance / np.outer(scale, scale)


def inflation(n: Array, thrust: Array, powers: tuple[int, ...]) -> float:
    """Uncertainty that the scatter about the map understates: few rows, and terms that the map lacks.

    Rows of one level share what the terms miss, so the mean of a level that was left out is off by more than
    scatter, over the root of the rows, would have it; few spare rows spread as Student's t does.
    """
    informative = n.size if 0 in powers else int((n != 0).sum())
    spare = informative - len(powers)
    c, _ = least_squares(n, thrust, powers)
    noise = float(((thrust - design(n, powers) @ c) ** 2).sum()) / max(spare, 1)
    if not noise > _EXACT * float(thrust @ thrust):
        return 1.0
    # A level at rest counts where there is a term for it.
    missed = [e.size * float(e.mean()) ** 2 for level, e in left_out(n, thrust, powers) if level != 0 or 0 in powers]
    student = spare / (spare - 2) if spare > 2 else 3.0
    return student * max(1.0, float(np.mean(missed)) / noise)


def left_out(n: Array, thrust: Array, powers: tuple[int, ...]) -> list[tuple[float, Array]]:
    """Each level of revolutions but the greatest, and the errors of its rows by a map fitted without them."""
    out: list[tuple[float, Array]] = []
    for level in np.unique(n)[:-1].tolist():
        gone = n == level
        c, _ = least_squares(n[~gone], thrust[~gone], powers)
        out.append((level, thrust[gone] - design(n[gone], powers) @ c))
    return out
