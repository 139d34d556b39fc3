"""Posterior covariance of the parameters, and a verdict on each in words.

The posterior is Gaussian about the optimum.  A direction of parameter space is determined where the
data tighten the prior (or the interval) markedly; where they do not, the verdict says so and names
the manoeuvre that would excite it.  Every parameter is measured by its own size as well, and the worse of
the two counts: a prior or an interval that is wide enough is tightened by any data, which says nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.parameters import Free
from ...data import Array
from .. import Fit, Problem, Verdict
from ..diagnosis.findings import Diagnosis
from ..trajectory.gauss_newton import Normal
from ..vector import Vector
from . import information
from .acting import Acting, acting

# Share of the prior variance that the data must remove: below the first nothing is learned,
# above the second the data clearly outweigh the prior.  Of the squared size of a parameter, its variance
# must leave as much: sigma is below .32 of the size of what is identified, and below .71 of what is weak.
UNKNOWN, CLEAR = 0.5, 0.9
CORRELATED = 0.95
# Least part of a parameter in a combination that names it, squared, and most of them that are named together.
_PART, _MANY = 0.1, 6

EXCITES = (
    ("propeller.A_", "reversing with way ahead, and propeller ahead with sternway"),
    ("propeller.B_", "reversing with way ahead, and propeller ahead with sternway"),
    ("propeller.C_", "stopping runs: reversed propeller at several speeds"),
    ("propeller.", "straight runs at several revolutions, accelerating and coasting"),
    ("wind.", "slow runs and drifting in wind from ahead, astern and both sides"),
    ("rudder.C_PR", "rudder angles with the propeller reversed"),
    ("rudder.k_xPR", "rudder angles with the propeller reversed"),
    ("rudder.", "zigzags and turns at several rudder angles and revolutions"),
    ("body.", "rapid reversals of rudder and propeller (short zigzags, accelerations)"),
    ("hull.X_0A", "astern runs"),
    ("hull.X_", "straight runs and coasting, and turns for the coupled terms"),
    ("hull.C_", "crabbing and turning on the spot, at little or no way"),
    ("hull.", "turns and zigzags at small and large rudder angles"),
)
"""By the beginning of a parameter's path the manoeuvre that would tell it, for the advice of a verdict."""


def manoeuvre_for(path: str) -> str:
    """The manoeuvre that is most informative about a parameter."""
    return next((text for prefix, text in EXCITES if path.startswith(prefix)), "more varied manoeuvres")


def posterior(normal: Normal, free: Sequence[Free], values: Array, variance: float) -> tuple[Array, Array]:
    """Posterior covariance and the share of the prior variance that the data removed.

    Args:
        normal: normal equations at the optimum, prior included.
        free: the parameters.
        values: their estimates; without prior and interval, the larger of start and estimate stands in for both.
        variance: mean squared weighted residual; the data's share of H is divided by it, so that
            sigma need only be right up to a factor.
    """
    H, _ = normal.reduced(0.0)
    vector = Vector.of(free)
    whole = (H - vector.precision) / max(variance, 1e-200) + vector.held(values)
    found = information.covariance(whole, vector.reach(values))
    return found, removed(vector, values, found)


def removed(vector: Vector, values: Array, covariance: Array) -> Array:
    """Share of the variance before the data, or of its squared size, that each parameter has lost."""
    yardstick = np.where(np.isfinite(vector.variance), vector.variance, vector.size(values) ** 2)
    return np.clip(1.0 - np.diag(covariance) / np.where(yardstick > 0, yardstick, 1e-300), 0.0, 1.0)


def judged(
    problem: Problem, values: Array, normal: Normal, variance: float, *, history: Array, seconds: float,
    evaluations: int, status: str, digest: str, **more: Any,
) -> Fit:  # fmt: skip
    """The `Fit` of `problem` at `values`: covariance, shrinkage, bounds and verdicts from the normal equations there.

    Args:
        normal, variance: as in `posterior`.
        history, seconds, evaluations, status, digest: as in `Fit`.
        more: further fields of `Fit`.
    """
    vector = problem.vector
    spread, shrinkage = posterior(normal, problem.free, values, variance)
    at_bound = vector.at_bound(values)
    # Beside priors what the data know would be a difference of the two, and a weak direction its rounding.
    together = () if vector.precision.any() else acting(vector.paths, normal.reduced(0.0)[0], values)
    return Fit(
        ship=vector.ship(problem.ship, values), free=problem.free, values=values, sigma=np.sqrt(np.diag(spread)),
        covariance=spread, shrinkage=shrinkage, at_bound=at_bound,
        verdicts=verdicts(problem.free, values, spread, shrinkage, at_bound, together=together),
        history=np.asarray(history, dtype=np.float64).reshape(-1, 4), objective=normal.cost, seconds=seconds,
        evaluations=evaluations, status=status, digest=digest, **more,
    )  # fmt: skip


def judged_by(
    fit: Fit, problem: Problem, diagnosis: Diagnosis, covariance: Array, together: Sequence[Acting] = ()
) -> Fit:  # fmt: skip
    """The fit with its diagnosis and this covariance; nothing is "identified" where the model lacks something.

    Args:
        together: parameters of which only combinations act.
    """
    shrinkage = removed(problem.vector, fit.values, covariance)
    # A bound that the data press on makes the model wrong, whose wider sigma would then hide that they do.
    pressed = [one.subject for one in fit.verdicts if one.status == "at bound"]
    found = verdicts(fit.free, fit.values, covariance, shrinkage, fit.at_bound, pressed, together)
    return replace(
        fit, sigma=np.sqrt(np.diag(covariance)), covariance=covariance, shrinkage=shrinkage,
        verdicts=capped(found, diagnosis), diagnosis=diagnosis,
    )  # fmt: skip


def capped(found: Sequence[Verdict], diagnosis: Diagnosis | None) -> tuple[Verdict, ...]:
    """The verdicts; "graded" in place of "identified" and "weak" where the model does not explain the data."""
    lacking = diagnosis is not None and diagnosis.lacking
    return _graded(found, "by these trials, if the form of the model is right") if lacking else tuple(found)


def blown_up(found: Sequence[Verdict]) -> tuple[Verdict, ...]:
    """The verdicts of a fit with which long predictions blow up."""
    return _graded(found, "but predictions of more than a step blow up")


def _graded(found: Sequence[Verdict], why: str) -> tuple[Verdict, ...]:
    """The range of each that the data tell anything of stands; one that leaves its sign open stays weak."""
    far = [f"within {100.0 * one.within:.2g} % " if math.isfinite(one.within) else "" for one in found]
    return tuple(
        replace(one, status="graded", text=f"{one.text}; {near}{why}")
        if one.status == "identified" or (one.status == "weak" and one.within < 1.0) else one
        for one, near in zip(found, far, strict=True)
    )  # fmt: skip


def within(value: float, sigma: float) -> float:
    """Half width of the 95 % interval over the value; inf about zero."""
    return 1.96 * sigma / abs(value) if value else math.inf


def overruled(fit: Fit, unidentified: Mapping[str, str]) -> Fit:
    """The fit with the verdict "not identified" on parameters that data of this kind cannot determine, at any sigma.

    Args:
        unidentified: reasons by path; a path that is not free is held at an assumed number.
    """
    free = fit.vector.paths
    told = [
        replace(v, status="not identified", text=f"{v.text}; nevertheless: {unidentified[v.subject]}")
        if v.subject in unidentified else v
        for v in fit.verdicts
    ]  # fmt: skip
    held = [Verdict(path, "not identified", f"held, not fitted: {why}") for path, why in unidentified.items()
            if path not in free]  # fmt: skip
    return replace(fit, verdicts=(*told, *held))


def verdicts(
    free: Sequence[Free], values: Array, covariance: Array, shrinkage: Array, at_bound: Sequence[str],
    pressed: Sequence[str] = (), together: Sequence[Acting] = (),
) -> tuple[Verdict, ...]:  # fmt: skip
    """One verdict per parameter, then one per group that only shows up as a combination.

    Args:
        at_bound: paths of the parameters on a bound.
        pressed: those of them of which it is known that the data want them beyond.
        together: parameters of which only combinations act, whatever the sigma.
    """
    sigma = np.sqrt(np.diag(covariance))
    inside = {path: one for one in together for path in one.paths}
    single = tuple(
        _undetermined(f, float(v), float(s), inside[f.path]) if f.path in inside
        else _single(f, float(v), float(s), float(share), f.path in at_bound, f.path in pressed)
        for f, v, s, share in zip(free, values, sigma, shrinkage, strict=True)
    )  # fmt: skip
    groups = tuple(Verdict(one.subject, "not identified", one.words) for one in together if len(one.paths) > 1)
    rest = [k for k, f in enumerate(free) if f.path not in inside]
    some = [free[k] for k in rest]
    pairs = _pairs(some, covariance[np.ix_(rest, rest)], sigma[rest])
    named = {path for pair in pairs for path in pair.subject.split(" and ")} | inside.keys()
    loose = [k for k, one in enumerate(single) if one.status != "identified" and one.subject not in named]
    return single + groups + pairs + _groups([free[k].path for k in loose], covariance[np.ix_(loose, loose)])


def _undetermined(f: Free, value: float, sigma: float, one: Acting) -> Verdict:
    """Of a parameter that acts in a combination only, or not at all: what a prior says of it is no finding."""
    words = one.words if one.count else f"it {one.words}"
    return Verdict(f.path, "not identified", f"{value:.4g} +- {sigma:.2g}; {words}", within(value, sigma))


def _single(f: Free, value: float, sigma: float, share: float, bound: bool, pressed: bool) -> Verdict:
    told, far = f"{value:.4g} +- {sigma:.2g}", within(value, sigma)
    if bound and (pressed or share >= UNKNOWN):
        return Verdict(
            f.path, "at bound", f"{told}, on its bound [{f.low:g}, {f.high:g}]: the data want {_beyond(f, value)}", far,
        )  # fmt: skip
    if bound:
        told = f"{told} (on its bound, which the data do not ask for)"
    one = Vector.of([f])
    size = float(one.size(np.array([value]))[0])
    known = f"sigma is {sigma / size:.2g} of its size" if size > 0 else "not distinguished from zero"
    own = 1.0 - min(sigma / size, 1.0) ** 2 if size > 0 else 0.0
    if not np.isfinite(one.variance[0]):
        share, told = own, f"{told}: {known}"
    elif own < min(share, CLEAR):  # its own size is the stricter measure
        share, told = own, f"{told}: {known}, though the data removed {share:.0%} of the prior variance"
    elif share >= CLEAR:
        told = f"{told}: {known}, and the data removed {share:.0%} of the prior variance"
    elif share >= UNKNOWN:
        told = f"{told}: data and prior weigh about the same ({share:.0%})"
    else:
        known = "the prior" if np.isfinite(f.sigma) else "its interval"
        told = f"{told} is little more than {known} ({share:.0%} removed)"
    if share >= CLEAR:
        return Verdict(f.path, "identified", told, far)
    manoeuvre = manoeuvre_for(f.path)
    if share >= UNKNOWN:
        return Verdict(f.path, "weak", f"{told}; {manoeuvre} would help", far)
    return Verdict(f.path, "not identified", f"{told}; not to be read as physics; {manoeuvre} would excite it", far)


def _beyond(f: Free, value: float) -> str:
    """What lies beyond a bound: at zero the other sign, which no wider interval makes right."""
    if value >= f.high == 0.0 or value <= f.low == 0.0:
        return "the other sign, so the model lacks something, or an order or an instrument has the wrong sign"
    return "it beyond, so either the interval is too narrow or the model lacks something"


def _groups(paths: Sequence[str], covariance: Array) -> tuple[Verdict, ...]:
    """Verdicts on three and more parameters of which the data fix a combination, where no two of them tell it."""
    sigma = np.sqrt(np.diag(covariance))
    size, along = np.linalg.eigh(covariance / np.outer(sigma, sigma))
    fixed = along[:, size < 1.0 - CORRELATED]
    joined = np.abs(fixed @ fixed.T) > _PART
    for _ in paths:  # whoever shares a combination, directly or by others
        joined = joined @ joined
    groups = {tuple(np.flatnonzero(row).tolist()) for row in joined}
    return tuple(
        Verdict(f"{', '.join(paths[k] for k in group[:-1])} and {paths[group[-1]]}", "weak",
                "the data fix a combination of them, not each of them")
        for group in sorted(groups) if 2 < len(group) <= _MANY
    )  # fmt: skip


def _pairs(free: Sequence[Free], covariance: Array, sigma: Array) -> tuple[Verdict, ...]:
    correlation = covariance / np.outer(sigma, sigma)
    out: list[Verdict] = []
    for i in range(len(free)):
        for j in range(i):
            c = float(correlation[i, j])
            if abs(c) > CORRELATED:
                word = "trade off against each other" if c < 0 else "rise and fall together"
                out.append(Verdict(
                    f"{free[j].path} and {free[i].path}", "weak",
                    f"they {word} (correlation {c:+.3f}): the data fix a combination, not each of them",
                ))  # fmt: skip
    return tuple(out)
