"""Coefficients from captive tests: weighted least squares of computed on measured loads.

Each load has two noise levels in newtons, one in runs straight ahead and one with drift or yaw, where the terms of the
model are an approximation; both are estimated with the coefficients.  Runs at low speed, whose primed loads scatter
most, are weighted accordingly.  Model errors are correlated between neighbouring runs, so sigma of independent errors
would be too small: sigma is the larger of that and of a jackknife that leaves out one condition at a time.  A parameter
to which the runs are insensitive, or that they determine only in combination with others, is held at its value in the
ship file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import ParameterError, match, read, specs, values
from ...core.values import dataclass, replace
from ...data import Array, DataError
from ...data.captive import Captive
from ...ships import Entry, Ship
from .. import FitError, Verdict
from ..posterior.verdicts import CLEAR, CORRELATED, UNKNOWN
from ..trajectory.gauss_newton import Normal, State, minimise
from .captive_loads import Predicted, conditions

SOURCE = "captive tests"
"""How the source of a number begins that captive tests gave."""

USUAL = (
    "hull.*", "propeller.t_P", "propeller.w_P0", "propeller.C_*", "rudder.t_R", "rudder.a_H", "rudder.x_H",
    "rudder.epsilon", "rudder.kappa", "rudder.l_R", "rudder.gamma_*", "rudder.delta_0",
    "body.m_x", "body.m_y", "body.J_z", "derivatives.*",
    "body.X_udot", "body.Y_vdot", "body.Y_rdot", "body.N_vdot", "body.N_rdot",
)  # fmt: skip
"""Patterns of what captive tests determine, without dimensions, open water, and f_alpha, which goes with epsilon."""

_ADDED = {
    "u_dot": ("m_x", "X_udot"), "v_dot": ("m_y", "Y_vdot", "N_vdot"), "r_dot": ("J_z", "Y_rdot", "N_rdot"),
}  # fmt: skip
_FIXED = ("derivatives.C_R", "derivatives.S")
# Share of a column that must be left when the columns before it are taken off; below it the runs cannot separate them.
_APART = 1e-6
# A kind of test counts as determining a parameter if sigma without it is larger by this.
_DETERMINES = 1.2
_ROUNDS, _STEPS, _SETTLED = 30, 100, 1e-4
# Fewest loads that give a noise of their own, and fewest conditions that give a jackknife.
_FEW, _CONDITIONS = 5, 5
# Least noise of a load, over its largest value: no gauge is better.
_FINEST = 1e-6

TESTS = (
    ("r", "circular motion tests, or PMM in yaw"), ("l_R", "rudder angles in circular motion"),
    ("m_x", "PMM in surge"), ("m_y", "PMM in sway"), ("J_z", "PMM in yaw"), ("udot", "PMM in surge"),
    ("vdot", "PMM in sway"), ("rdot", "PMM in yaw"), ("gamma", "rudder angles in drift to both sides"),
    ("C_", "drift with the thrust measured"), ("t_P", "other propeller loads"),
    ("kappa", "rudder angles at other propeller loads"),
    ("epsilon", "rudder angles with the normal force measured"), ("v", "drift to both sides"), ("d", "rudder angles"),
)  # fmt: skip
"""By the end of a parameter's path the captive test that tells it."""


@dataclass(frozen=True)
class CaptiveFit:
    """The outcome of a fit to captive tests.

    Attributes:
        ship: with the coefficients; each has its sigma and its source.
        began: the ship that the fit started from.
        runs: what was fitted.
        paths: fitted parameters; values, sigma and covariance are in this order.
        held: why a parameter that was asked for stays as it was, by path.
        noise: estimated noise of each load [N, N m], straight ahead and with drift or yaw.
        predicted: each load at each run [N, N m], shape (runs,).
        determined_by: by path, the kinds of test without which sigma would be larger, with the factor; inf: nothing
            else determines it.
        verdicts: one a parameter, fitted or held, then one a pair that shows up as a combination only.
    """

    ship: Ship
    began: Ship
    runs: Captive
    paths: tuple[str, ...]
    values: Array
    sigma: Array
    covariance: Array
    held: Mapping[str, str]
    noise: Mapping[str, tuple[float, float]]
    predicted: Mapping[str, Array]
    determined_by: Mapping[str, Mapping[str, float]]
    verdicts: tuple[Verdict, ...]

    @property
    def explained(self) -> Mapping[str, float]:
        """Share of the variance of each load that the model explains."""
        found: dict[str, float] = {}
        for name in self.predicted:
            measured = self.runs.loads[name]
            error = measured - self.predicted[name]
            found[name] = 1.0 - float(np.nanmean(error**2)) / float(np.nanvar(measured))
        return found


def fit_captive(ship: Ship, runs: Captive, free: Sequence[str] = USUAL) -> CaptiveFit:
    """Coefficients of `ship` from captive tests of it or of a geosim; a test of another length is scaled by Froude.

    Args:
        free: patterns of the parameters to fit; those of `USUAL` that the model has, unless given.

    Raises:
        ShipError: a family without forces of its own.
        DataError: fewer loads than parameters.
        FitError: loads that are not finite.
        ParameterError: an unknown path.
    """
    loads = Predicted.of(ship, runs)
    asked, still = _moved(_asked(ship, free), runs, tuple(free) == USUAL)
    start = np.array([float(read(ship.model, path)) for path in asked])
    noise = np.repeat([max(float(np.nanstd(runs.loads[name])), 1e-12) for name in loads.names], 2)
    _, slopes = loads.by(asked)(start)
    kept, held = _apart(asked, start, slopes / noise[loads.group][:, None], loads.seen)
    if not kept:
        raise DataError(
            f"{runs.name}: the runs are insensitive to {', '.join(asked[:8])}; see the columns of the table"
        )
    paths = tuple(asked[k] for k in kept)
    if loads.seen.sum() <= len(paths):
        raise DataError(f"{runs.name}: {int(loads.seen.sum())} measured loads for {len(paths)} parameters; "
                       "test more, or name fewer with --free")  # fmt: skip
    held |= still
    p, noise = _search(ship, loads, paths, start[kept], noise)
    predicted, slopes = loads.by(paths)(p)
    each, many = noise[loads.group], len(loads.names)
    weighed = (slopes / each[:, None])[loads.seen]
    covariance = _inverse(weighed)
    sigma = np.sqrt(np.diag(covariance))
    determined_by = _determined_by(paths, weighed, np.tile(runs.kinds, many)[loads.seen], sigma)
    error = ((loads.measured - predicted) / each)[loads.seen]
    grown = np.maximum(_jackknife(weighed, error, np.tile(conditions(runs), many)[loads.seen]) / sigma, 1.0)
    sigma, covariance = grown * sigma, covariance * np.outer(grown, grown)
    made = _made(ship, runs, paths, p, sigma)
    return CaptiveFit(
        made, ship, runs, paths, p, sigma, covariance, held,
        {name: (float(noise[2 * k]), float(noise[2 * k + 1])) for k, name in enumerate(loads.names)},
        dict(zip(loads.names, predicted.reshape(len(loads.names), -1), strict=True)), determined_by,
        _verdicts(ship, paths, p, covariance, determined_by, held),
    )  # fmt: skip


def _asked(ship: Ship, free: Sequence[str]) -> list[str]:
    known = values(ship.model)
    found: dict[str, None] = {}
    for pattern in free:
        try:
            found |= dict.fromkeys(match(ship.model, pattern))
        except ParameterError:  # of the usual ones a family has its own part
            if tuple(free) != USUAL:
                raise
    fixed = _FIXED if tuple(free) == USUAL else ()
    return [path for path in known if path in found and path not in fixed]


def _moved(asked: list[str], runs: Captive, usual: bool) -> tuple[list[str], dict[str, str]]:
    """Without the added masses whose acceleration no run has, and why: in steady runs they act like Y_r and X_vr."""
    held: dict[str, str] = {}
    for rate, names in _ADDED.items():
        if usual and not runs.column(rate).any():
            held |= {path: f"no run has {rate}; {_wanted(path)} would determine it"
                     for path in asked if path.rpartition(".")[2] in names and path.startswith("body.")}  # fmt: skip
    return [path for path in asked if path not in held], held


def _apart(asked: Sequence[str], start: Array, J: Array, seen: NDArray[np.bool_]) -> tuple[list[int], dict[str, str]]:
    """Parameters that the runs can separate, and why the others are held.

    Columns are taken in the order of the model: of two with the same effect on the runs, the first is fitted.
    """
    kept: list[int] = []
    held: dict[str, str] = {}
    basis = np.zeros((int(seen.sum()), 0))
    for k, path in enumerate(asked):
        column = J[seen, k]
        size = float(np.linalg.norm(column))
        if not size * max(abs(start[k]), 1e-3) > 1e-9:
            held[path] = f"the runs are insensitive to it; {_wanted(path)} would determine it"
            continue
        column = column / size
        for _ in range(2):
            column = column - basis @ (basis.T @ column)
        rest = float(np.linalg.norm(column))
        if rest < _APART:
            held[path] = f"these runs determine it only in combination with others; {_wanted(path)} would separate it"
            continue
        kept.append(k)
        basis = np.column_stack([basis, column / rest])
    return kept, held


def _wanted(path: str) -> str:
    """The test that determines a parameter."""
    name = path.rsplit(".", 1)[-1]
    factors = name.partition("_")[2] if name[:2] in ("X_", "Y_", "N_") else name
    return next((test for key, test in TESTS if key in factors), "steady runs at several speeds")


@dataclass(frozen=True)
class _Misfit:
    """Half the squared misfit, each load over its noise; no nuisance parameters."""

    evaluate: Callable[[Array], tuple[Array, Array]]
    measured: Array
    noise: Array
    seen: NDArray[np.bool_]

    def cost(self, p: Array) -> float:
        """Objective at the parameters; infinite where a load is not finite."""
        error = ((self.evaluate(p)[0] - self.measured) / self.noise)[self.seen]
        return 0.5 * float(error @ error) if np.isfinite(error).all() else math.inf

    def costs(self, p: Array, eta: Array, which: NDArray[np.intp]) -> Array:
        """See `gauss_newton.Objective`."""
        return np.array([self.cost(one) for one in p])

    def normals(self, p: Array, eta: Array, which: NDArray[np.intp]) -> Normal:
        """See `gauss_newton.Objective`."""
        return Normal.stacked([self._normal(one) for one in p])

    def _normal(self, p: Array) -> Normal:
        value, slopes = self.evaluate(p)
        error, J = ((value - self.measured) / self.noise)[self.seen], (slopes / self.noise[:, None])[self.seen]
        return Normal(0.5 * float(error @ error), J.T @ J, J.T @ error)


def _search(ship: Ship, loads: Predicted, paths: tuple[str, ...], start: Array, noise: Array) -> tuple[Array, Array]:
    """The optimum and the noise of each load there, found in turn until both settle."""
    meanings = specs(ship.model)
    low, high = (np.array([getattr(meanings[path], side) for path in paths]) for side in ("low", "high"))
    p, seen, evaluate, none = np.clip(start, low, high), loads.seen, loads.by(paths), np.zeros(0)
    which = loads.group[seen]
    for _ in range(_ROUNDS):
        misfit = _Misfit(evaluate, loads.measured, noise[loads.group], seen)
        state = State(p, none, misfit.cost(p))
        if not math.isfinite(state.cost):
            raise FitError(f"{ship.name} has no finite loads at these runs; start from a ship nearer to the one tested")
        p = minimise(misfit, state, low, high, iterations=_STEPS, tolerance=1e-12, each=lambda _: None).p
        value, slopes = evaluate(p)
        weighed = slopes[seen] / noise[which][:, None]
        taken = np.einsum("ij,jk,ik->i", weighed, _inverse(weighed), weighed)  # share of each row that the fit takes
        before, noise = noise, _noise((value - loads.measured)[seen], 1.0 - taken, which, loads)
        if np.abs(noise / before - 1.0).max() < _SETTLED:
            break
    return p, noise


def _noise(error: Array, left: Array, which: NDArray[np.intp], loads: Predicted) -> Array:
    """Noise of each load straight ahead and oblique; `left` is the share of each row that the fit does not take."""
    found = np.zeros(2 * len(loads.names))
    for k in range(found.size):
        some = which == k
        if some.sum() < _FEW:
            some = which // 2 == k // 2
        found[k] = math.sqrt(float((error[some] ** 2).sum()) / max(float(left[some].sum()), 1.0))
    largest = np.nanmax(np.abs(loads.measured.reshape(len(loads.names), -1)), axis=1)
    return np.maximum(found, _FINEST * np.repeat(largest, 2))


def _jackknife(J: Array, error: Array, condition: NDArray[np.intp]) -> Array:
    """Sigma of each parameter from leaving out one condition at a time, to first order (Efron 1982); 0 with few.

    The fit without rows g differs by -(J'J - J_g'J_g)^-1 J_g'e_g.
    """
    groups = np.unique(condition)
    if groups.size < _CONDITIONS:
        return np.zeros(J.shape[1])
    moved = np.array([-_inverse(J[condition != g]) @ (J[condition == g].T @ error[condition == g]) for g in groups])
    moved -= moved.mean(axis=0)
    return np.sqrt((groups.size - 1) / groups.size * (moved**2).sum(axis=0))


def _inverse(J: Array) -> Array:
    """(J'J)^-1, by columns of unit length."""
    size = np.linalg.norm(J, axis=0)
    size = np.where(size > 0, size, 1.0)
    return np.linalg.pinv((J / size).T @ (J / size), rcond=1e-14, hermitian=True) / np.outer(size, size)


def _determined_by(paths: Sequence[str], J: Array, kinds: Array, sigma: Array) -> dict[str, dict[str, float]]:
    """For each parameter the kinds of test that determine it, with sigma without the kind over sigma."""
    found: dict[str, dict[str, float]] = {path: {} for path in paths}
    size = np.linalg.norm(J, axis=0)
    for kind in dict.fromkeys(kinds.tolist()):
        weight, vectors = np.linalg.eigh((J[kinds != kind] / size).T @ (J[kinds != kind] / size))
        lost = weight < _APART**2
        left = np.sqrt(np.einsum("ij,j,ij->i", vectors, 1.0 / np.maximum(weight, 1e-300), vectors)) / size
        gone = np.abs(vectors[:, lost]).max(axis=1, initial=0.0)
        for path, s, was, out in zip(paths, left, sigma, gone > 1e-3, strict=True):
            ratio = math.inf if out else float(s / was)
            if ratio > _DETERMINES:
                found[path][kind] = ratio
    return {path: dict(sorted(by.items(), key=lambda one: -one[1])) for path, by in found.items()}


def _made(ship: Ship, runs: Captive, paths: Sequence[str], p: Array, sigma: Array) -> Ship:
    """The ship with the coefficients, their sigma and their source."""
    about = f"{SOURCE}: {len(runs)} runs of {runs.name}"
    entries = dict(ship.entries)
    meanings = specs(ship.model)
    for path, value, s in zip(paths, p.tolist(), sigma.tolist(), strict=True):
        unit = meanings[path].unit
        entries[path] = Entry(about, value, prime=unit == "'", unit="" if unit in ("'", "-") else unit, sigma=s)
    return replace(ship.moved(dict(zip(paths, p.tolist(), strict=True))), entries=entries)


def _verdicts(
    ship: Ship, paths: Sequence[str], p: Array, covariance: Array,
    determined_by: Mapping[str, Mapping[str, float]],
    held: Mapping[str, str],
) -> tuple[Verdict, ...]:  # fmt: skip
    """What the tests determine of each parameter, and which pairs they fix as a combination."""
    sigma, found = np.sqrt(np.diag(covariance)), list[Verdict]()
    meanings = specs(ship.model)
    for path, value, s in zip(paths, p.tolist(), sigma.tolist(), strict=True):
        meaning = meanings[path]
        share = 1.0 - min(s / max(abs(value), 1e-300), 1.0) ** 2
        by = ", ".join(determined_by[path]) or "several kinds of test alike"
        text = f"{value:.4g} +- {s:.2g}, determined by {by}"
        if value <= meaning.low or value >= meaning.high:
            found.append(Verdict(path, "at bound", f"{text}; it ended at the edge of what it can be"))
        elif share >= CLEAR:
            found.append(Verdict(path, "identified", text))
        elif share >= UNKNOWN:
            found.append(Verdict(path, "weak", f"{text}; more of {_wanted(path)} would help"))
        else:
            found.append(Verdict(path, "not identified", f"{text}: not distinguished from zero"))
    found += [Verdict(path, "not identified", f"held at {float(read(ship.model, path)):.4g}: {why}")
              for path, why in held.items()]  # fmt: skip
    correlation = covariance / np.outer(sigma, sigma)
    for i in range(len(paths)):
        for j in range(i):
            if abs(correlation[i, j]) > CORRELATED:
                text = f"correlation {correlation[i, j]:+.3f}: the tests fix a combination of the two"
                found.append(Verdict(f"{paths[j]} and {paths[i]}", "weak", text))
    return tuple(found)


def priors(ship: Ship) -> dict[str, float]:
    """Sigmas by path of the numbers that captive tests gave a ship."""
    return {path: entry.sigma for path, entry in ship.entries.items()
            if entry.sigma and entry.source.startswith(SOURCE)}  # fmt: skip


def open_water(J: Array, K_T: Array) -> dict[str, float]:
    """k_0, k_1, k_2 of K_T = k_0 + k_1 J + k_2 J^2 by least squares over an open-water test.

    Raises:
        DataError: fewer than three different advance ratios.
    """
    if np.unique(J).size < 3:
        raise DataError(f"{np.unique(J).size} different J; K_T over J needs three at least")
    found = np.polynomial.polynomial.polyfit(J, K_T, 2)
    return {f"propeller.k_{k}": float(value) for k, value in enumerate(found)}
