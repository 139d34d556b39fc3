"""The fits of You 2023 in two variants: (A) as printed, (B) as this program does it; and their errors by Table 5.

(A): masses of Eq. 17 to begin with, Eq. 13 with lambda |P|^2, Eqs. 18-19, first states as measured (Eq. 12),
Algorithm 1 with one more manoeuvre at a time, one search, no current estimated; LO is a single step (Eq. 15).
(B): the study.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.signal import savgol_filter

import seatrial as st

Rivals = st.rivals.Rivals

PRINTED, OURS = "A", "B"
QUANTITIES = ("velocity", "acceleration", "distance")
# Length of the quadratic whose slope is an acceleration [rows].
_SLOPE = 11


@dataclass(frozen=True)
class Variant:
    """Fits of the larger and the smaller model, by FULL and RIVAL.

    Attributes:
        whole: of whole trajectories (GO).
        local: of short predictions or of the momentum balance (LO).
    """

    whole: Mapping[str, st.Fit]
    local: Mapping[str, st.Fit]


@dataclass(frozen=True)
class Weather:
    """Both variants on the same trials.

    Attributes:
        trials, tests: those fitted, and those held out.
        variants: by letter.
        errors: of Table 5, by "letter model" or ship, then set ("fitted", "held out"), quantity and velocity.
    """

    name: str
    trials: tuple[st.Trial, ...]
    tests: tuple[st.Trial, ...]
    variants: Mapping[str, Variant]
    errors: Mapping[str, Mapping[str, Mapping[str, Mapping[str, float]]]]


def weathers(found: Rivals, letter: st.Shooting, printed: Mapping[str, st.Ship]) -> tuple[Weather, ...]:
    """As sailed and calm; `printed` are ships of the paper's own tables, by name, judged beside."""
    out: list[Weather] = []
    for case in found.cases:
        if case.name not in (st.rivals.AS_SAILED, st.rivals.CALM):
            continue
        trials, tests = sailed(found.study, calm=case.name == st.rivals.CALM)
        problem = replace(found.study.problem, trials=trials)
        local = replace(shooting(found.study), schedule="lo")
        ours = Variant(case.fits, {who: local.fit(part) for who, part in _models(problem, found.study).items()})
        variants = {PRINTED: to_the_letter(problem, found.study, letter), OURS: ours}
        ships = {f"{name} {who}": fit.ship for name, one in variants.items() for who, fit in one.whole.items()}
        errors = {
            name: {"fitted": relative(ship, trials), "held out": relative(ship, tests)}
            for name, ship in (*ships.items(), *printed.items())
        }  # fmt: skip
        out.append(Weather(case.name, trials, tests, variants, errors))
    return tuple(out)


def sailed(study: st.Study, *, calm: bool) -> tuple[tuple[st.Trial, ...], tuple[st.Trial, ...]]:
    """Trials fitted and held out, in the weather of the study or in none."""
    virtual = study.virtual
    if not calm or virtual is None:
        return study.problem.trials, study.test
    model: Any = virtual.ship.model
    still = replace(virtual, wind=st.Uniform(), gusts="", ship=replace(virtual.ship, model=replace(model, wind=None)))
    made = {trial.name: trial for trial in still.run()}
    return tuple(made[t.name] for t in study.problem.trials), tuple(made[t.name] for t in study.test)


def to_the_letter(problem: st.Problem, study: st.Study, letter: st.Shooting) -> Variant:
    """Variant A; `letter` is the estimator of its study."""
    begun = replace(problem, nuisance=st.Nuisance(), free=eq_17(problem, study))
    models = _models(begun, study)
    one = st.OneStep(step=problem.trials[0].dt)
    return Variant(
        {who: letter.fit(part) for who, part in models.items()},
        {who: one.fit(part) for who, part in models.items()},
    )


def eq_17(problem: st.Problem, study: st.Study) -> tuple[st.Free, ...]:
    """The free parameters with the starts of Eq. 17: masses by Eq. 11 to the letter, the rest at zero."""
    return problem.vector.started(st.first_guess.as_printed(particulars(study)))


def particulars(study: st.Study) -> st.first_guess.Hull:
    """Those of Table 1."""
    ship = study.virtual.ship if study.virtual else study.problem.ship
    model: Any = ship.model
    body = model.body
    return st.first_guess.Hull(L_pp=body.L_pp, B=body.B, d=body.d, m=body.m, rho=body.rho)


def _models(problem: st.Problem, study: st.Study) -> dict[str, st.Problem]:
    small = [f.path for f in study.rival]
    return {
        st.rivals.FULL: problem,
        st.rivals.RIVAL: replace(problem, free=tuple(f for f in problem.free if f.path in small)),
    }


def shooting(study: st.Study) -> st.Shooting:
    """The estimator of a study of this page."""
    estimator = study.estimator
    if not isinstance(estimator, st.Shooting):
        raise st.FitError(f"{study.path}: this page needs logo:Shooting")
    return estimator


def relative(ship: st.Ship, trials: Sequence[st.Trial]) -> Mapping[str, Mapping[str, float]]:
    """Errors of whole free runs over the measured, by quantity and velocity: Table 5, whose definition is not printed.

    Norm of the error of all rows of all trials over that of the measured.  Accelerations are slopes of a quadratic
    over 2 s, of the measured as of the predicted; distances are integrals of each velocity from the start of the run.
    """
    dt = trials[0].dt
    sides: dict[str, tuple[list[st.Array], list[st.Array]]] = {name: ([], []) for name in QUANTITIES}
    for trial, run in zip(trials, st.rivals.free_runs(ship, trials), strict=True):
        for k, velocity in enumerate((run, trial.stack(*st.rivals.VELOCITIES))):
            for name, values in of_rows(velocity, dt).items():
                sides[name][k].append(values)
    out: dict[str, dict[str, float]] = {}
    for name, (runs, logs) in sides.items():
        predicted, measured = np.concatenate(runs), np.concatenate(logs)
        with np.errstate(all="ignore"):
            away = np.sqrt(((predicted - measured) ** 2).mean(axis=0) / (measured**2).mean(axis=0))
        out[name] = {v: float(e) if np.isfinite(e) else np.inf for v, e in zip(st.rivals.VELOCITIES, away, strict=True)}
    return out


def of_rows(velocity: st.Array, dt: float) -> dict[str, st.Array]:
    """Velocity, its slope and its integral over the rows of a run, each of shape (rows, 3)."""
    with np.errstate(all="ignore"):
        slope = np.asarray(savgol_filter(velocity, _SLOPE, 2, 1, dt, 0), dtype=np.float64)
        return {"velocity": velocity, "acceleration": slope, "distance": np.cumsum(velocity, axis=0) * dt}


@dataclass(frozen=True)
class Attempt:
    """One search of the smaller model in a calm, under a setting."""

    what: str
    objective: float
    values: Mapping[str, float]
    status: str


def attempts(found: Rivals, letter: st.Shooting) -> tuple[Attempt, ...]:
    """Algorithm 1 with one and with more searches, with and without bounds, beside the study's own way."""
    trials, _ = sailed(found.study, calm=True)
    problem = replace(found.study.problem, trials=trials, nuisance=st.Nuisance())
    small = _models(replace(problem, free=eq_17(problem, found.study)), found.study)[st.rivals.RIVAL]
    bare = replace(small, free=tuple(st.Free(f.path, f.start) for f in small.free))
    base = replace(letter, ridge=0.0, constraints=False)
    asked = [("the study's way: LO, then GO", small, st.Shooting(initial="measured"))]
    for part, where in ((small, "within the bounds of the study"), (bare, "without bounds")):
        for growth in (1, 4):
            for starts in (1, 2) if part is bare or growth == 1 else (1, 2, 8):
                what = f"Algorithm 1 by {growth}, {where}, {starts} search{'es' * (starts > 1)}"
                asked.append((what, part, replace(base, growth=growth, starts=starts)))
    out: list[Attempt] = []
    for what, part, estimator in asked:
        try:
            with np.errstate(all="ignore"):  # a search without bounds may end far beyond any ship
                fit = estimator.fit(part)
            out.append(Attempt(what, fit.objective, fit.vector.by_path(fit.values), fit.status))
        except st.FitError as error:
            out.append(Attempt(what, np.inf, {}, str(error)))
    return tuple(out)


def ridges(found: Rivals, letter: st.Shooting, weights: Sequence[float]) -> dict[float, st.Fit]:
    """The larger model in a calm with lambda |P|^2 (Eq. 13), by lambda; from LO, as growth changes nothing here."""
    trials, _ = sailed(found.study, calm=True)
    problem = replace(found.study.problem, trials=trials, nuisance=st.Nuisance())
    return {w: st.Shooting(initial=letter.initial, ridge=w, ridge_about="zero").fit(problem) for w in weights}


def true(ship: st.Ship, fit: st.Fit) -> st.Array:
    """Values of the free parameters of a fit in another ship."""
    known = st.parameters.values(ship.model)
    return np.array([known[f.path] for f in fit.free])
