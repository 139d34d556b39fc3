"""One study of shooting in several weathers: the truth as it was, its wind known, its current ignored, and a calm.

The truth of a study of virtual trials is at hand, so each estimate can stand beside it, and the truth's own
prediction errors say what the noise alone costs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..core.parameters import values
from ..data import Array, Trial
from ..environment import Uniform
from ..identify import Fit, Problem, Progress
from ..identify.components.servo import ServoFit, fit_servo, servos
from ..identify.components.thrust_map import ThrustMap, fit_thrust
from ..models import Model
from ..ships import Ship
from ..study.study import Study
from ..study.virtual import VirtualTrials
from .shooting_scores import Score, score

TRUTH, FULL, RIVAL = "truth", "full", "rival"
AS_SAILED, WIND_KNOWN, IGNORED, CALM = "as sailed", "wind known", "current ignored", "calm"
_TURNS = 1e-3
"""An order that changes by less [rad] tells nothing about a servo."""


@dataclass(frozen=True)
class Case:
    """The study in one weather.

    Attributes:
        name, about: what it is called, and what the model knows.
        fits: of the model and of its rival, by label.
        truth: parameters of the truth, in the order of the full fit.
        scores: of the truth and both fits, on the trials kept back.
    """

    name: str
    about: str
    fits: Mapping[str, Fit]
    truth: Array
    scores: Mapping[str, Score]

    @property
    def away(self) -> Array:
        """Estimate less truth over its standard deviation, per parameter."""
        fit = self.fits[FULL]
        return (fit.values - self.truth) / fit.sigma

    def smaller(self, velocity: str) -> float:
        """Relative error of the rival over that of the model."""
        return self.scores[RIVAL].relative[velocity] / self.scores[FULL].relative[velocity]


@dataclass(frozen=True)
class Drive:
    """What the bench and the logs say about the thrusters.

    Attributes:
        maps: thrust map and pulled rows (revolutions, pull) of each thruster, by name.
        servos: of each azimuth, from the logs in which its order changes.
        truth: the ship that was on the bench.
    """

    maps: Mapping[str, tuple[ThrustMap, Array, Array]]
    servos: Mapping[str, ServoFit]
    truth: Ship


@dataclass(frozen=True)
class Shot:
    """All that the page of a study of shooting tells.

    Attributes:
        study: the study; its problem is that of the first case.
        cases: as sailed first.
        drive: thrusters and servos.
    """

    study: Study
    cases: tuple[Case, ...]
    drive: Drive

    @property
    def fit(self) -> Fit:
        """The model of the study."""
        return self.cases[0].fits[FULL]


def shot(study: Study, fit: Fit, virtual: VirtualTrials, progress: Progress | None = None) -> Shot:
    """Fit and judge the rival, and the same in the other weathers.

    Raises:
        FitError: a model cannot be fitted.
    """
    problem, tests = study.problem, study.test
    told = replace(problem, ship=_blown(problem.ship, virtual))
    logged = " and ".join(virtual.known) or "neither wind nor current"
    cases = [_case(study, AS_SAILED, f"as the study says: the logs tell {logged}", problem, tests, virtual, fit)]
    sails = virtual.sails.values()
    windy, wet = bool(virtual.wind.U_T), bool(virtual.wind.U_C or any(sail.current for sail in sails))
    if windy and "wind" not in virtual.known:
        train, rest = _sailed(study, replace(virtual, known=("wind",)))
        cases.append(_case(study, WIND_KNOWN, "an anemometer and the force of the wind as it is",
                           replace(told, trials=train), rest, virtual))  # fmt: skip
    if wet and problem.nuisance.current:
        deaf = replace(problem, nuisance=replace(problem.nuisance, current=0.0))
        cases.append(_case(study, IGNORED, "no current is estimated", deaf, tests, virtual))
    if windy or wet:
        still = replace(
            virtual, wind=Uniform(), gusts="", ship=_becalmed(virtual.ship, problem.ship),
            sails={name: replace(sail, current=None) for name, sail in virtual.sails.items()},
        )  # fmt: skip
        train, rest = _sailed(study, still)
        cases.append(_case(study, CALM, "neither wind nor current", replace(problem, trials=train), rest, still))
    return Shot(study, tuple(cases), _drive(problem.trials, virtual))


def _case(
    study: Study, name: str, about: str, problem: Problem, tests: tuple[Trial, ...], virtual: VirtualTrials,
    fit: Fit | None = None,
) -> Case:  # fmt: skip
    full = fit or study.estimator.fit(problem)
    small = study.estimator.fit(replace(problem, free=study.rival))
    known = values(virtual.ship.model)
    ships = {TRUTH: virtual.ship, FULL: full.ship, RIVAL: small.ship}
    return Case(
        name, about, {FULL: full, RIVAL: small}, np.array([known[f.path] for f in full.free]),
        {label: score(ship, tests) for label, ship in ships.items()},
    )  # fmt: skip


def _sailed(study: Study, virtual: VirtualTrials) -> tuple[tuple[Trial, ...], tuple[Trial, ...]]:
    """The same trials, of training and of test, sailed anew."""
    made = {trial.name: trial for trial in virtual.run()}
    return tuple(made[t.name] for t in study.problem.trials), tuple(made[t.name] for t in study.test)


def _blown(ship: Ship, virtual: VirtualTrials) -> Ship:
    model: Any = ship.model
    truth: Any = virtual.ship.model
    return replace(ship, model=replace(model, wind=truth.wind)) if ship.model.takes("wind") else ship


def _becalmed(ship: Ship, studied: Ship) -> Ship:
    """Without force of wind, unless the model has it too: in a calm it is that of the ship's own motion."""
    model: Any = ship.model
    if studied.model.part("wind") is not None:
        return ship
    still: Model = replace(model, wind=None) if ship.model.takes("wind") else model
    return replace(ship, model=still)


def _drive(trials: tuple[Trial, ...], virtual: VirtualTrials) -> Drive:
    maps = {name: (fit_thrust(n, pull, name=name), n, pull) for name, (n, pull) in virtual.pulled().items()}
    found: dict[str, ServoFit] = {}
    for control in servos(trials):
        busy = [t for t in trials if np.ptp(t[f"{control}_cmd"]) > _TURNS]
        if busy:
            found[control] = fit_servo(busy, control)
    return Drive(maps, found, virtual.ship)
