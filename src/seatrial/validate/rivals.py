"""Model and rival of a study of virtual trials, judged beside the truth in several weathers.

The truth of virtual trials is known: each estimate is compared with its true value, and the prediction errors of the
truth itself show what the noise alone costs.  The weathers: as sailed, wind known, current ignored, calm.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..core.parameters import values
from ..core.values import dataclass, replace
from ..data import Array, Trial, unwrapped
from ..environment import Uniform
from ..identify import Fit, Problem
from ..identify.components.servo import ServoFit, fit_servo, servos
from ..identify.components.thrust_map import ThrustMap, fit_thrust
from ..identify.record import between
from ..models import STATES
from ..ships import Ship
from ..simulate.approach import substeps
from ..simulate.lanes import Steps, given, run
from ..simulate.replay import inputs, unseen
from ..study.study import Study
from ..study.virtual import VirtualTrials

TRUTH, FULL, RIVAL = "truth", "full", "rival"
AS_SAILED, WIND_KNOWN, IGNORED, CALM = "as sailed", "wind known", "current ignored", "calm"
_TURNS = 1e-3
"""An order that changes by less [rad] does not determine a servo."""

VELOCITIES: tuple[str, ...] = ("u", "v_m", "r")
HORIZONS = (1, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50)
"""Steps of a prediction, as in Fig. 22 of You 2023."""

_MOVING = [STATES.index(name) for name in VELOCITIES]
# Rows from one start of a short prediction to the next.
_STRIDE = 10


@dataclass(frozen=True)
class Score:
    """Errors of one model on some trials; infinite if its predictions diverge.

    Attributes:
        relative: by velocity, norm of the error of whole runs over that of the measured, all trials together.
        runs: root mean square error of the whole run, by trial and velocity [m/s, rad/s].
        steps: root mean square error after each of `HORIZONS` steps, by state [m, rad, m/s, rad/s].
        starts: predictions behind each number of `steps`.
    """

    relative: Mapping[str, float]
    runs: Mapping[str, Mapping[str, float]]
    steps: Mapping[str, Array]
    starts: int

    def beyond(self, other: Score) -> Mapping[str, float]:
        """Error after the longest horizon over that of `other`, by state."""
        return {name: float(self.steps[name][-1] / other.steps[name][-1]) for name in self.steps}


@dataclass(frozen=True)
class Case:
    """The study in one weather.

    Attributes:
        name, about: of the weather, and what the model knows of it.
        fits: of the model and of its rival, by label.
        truth: parameters of the truth, in the order of the full fit.
        scores: of the truth and both fits, on the held-out trials.
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
    """Thrusters as the bench and the logs determine them.

    Attributes:
        maps: thrust map and pulled rows (revolutions, pull) of each thruster, by name.
        servos: of each azimuth, from the logs in which its order changes; truth: the ship on the bench.
    """

    maps: Mapping[str, tuple[ThrustMap, Array, Array]]
    servos: Mapping[str, ServoFit]
    truth: Ship

    def thrust(self, name: str) -> Array:
        """True thrust of a thruster at the revolutions of its pulled rows [N]."""
        model: Any = self.truth.model
        thruster: Any = dict(model.thrusters.items())[name]
        return np.array([float(thruster.thrust(float(level))) for level in self.maps[name][1]])


@dataclass(frozen=True)
class Rivals:
    """Results of a study with a rival on virtual trials.

    Attributes:
        study: the study; its problem is that of the first case.
        cases: as sailed first.
        drive: thrust maps and servos.
    """

    study: Study
    cases: tuple[Case, ...]
    drive: Drive

    @property
    def fit(self) -> Fit:
        """The model of the study."""
        return self.cases[0].fits[FULL]


def judged(study: Study, fit: Fit, virtual: VirtualTrials) -> Rivals:
    """Fit the rival and judge both, then fit and judge both in the other weathers.

    Args:
        study: with a rival and held-out trials.
        fit: of the model of the study, as sailed.
        virtual: the truth and its trials.

    Raises:
        FitError: a model cannot be fitted.
    """
    problem, tests = study.problem, study.test
    blown = replace(problem, ship=_with_wind(problem.ship, virtual))
    logged = " and ".join(virtual.known) or "neither wind nor current"
    cases = [_case(study, AS_SAILED, f"as the study says: the logs contain {logged}", problem, tests, virtual, fit)]
    sails = virtual.sails.values()
    windy, wet = bool(virtual.wind.U_T), bool(virtual.wind.U_C or any(sail.current for sail in sails))
    if windy and "wind" not in virtual.known:
        train, rest = _sailed(study, replace(virtual, known=("wind",)))
        cases.append(_case(study, WIND_KNOWN, "an anemometer and the force of the wind as it is",
                           replace(blown, trials=train), rest, virtual))  # fmt: skip
    if wet and problem.nuisance.current:
        still_water = replace(problem, nuisance=replace(problem.nuisance, current=0.0))
        cases.append(_case(study, IGNORED, "no current is estimated", still_water, tests, virtual))
    if windy or wet:
        calm = replace(
            virtual, wind=Uniform(), gusts="", ship=_becalmed(virtual.ship, problem.ship),
            sails={name: replace(sail, current=None) for name, sail in virtual.sails.items()},
        )  # fmt: skip
        train, rest = _sailed(study, calm)
        cases.append(_case(study, CALM, "neither wind nor current", replace(problem, trials=train), rest, calm))
    return Rivals(study, tuple(cases), _drive(problem.trials, virtual))


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
    """The same trials, training and test, simulated again."""
    made = {trial.name: trial for trial in virtual.run()}
    return tuple(made[t.name] for t in study.problem.trials), tuple(made[t.name] for t in study.test)


def _with_wind(ship: Ship, virtual: VirtualTrials) -> Ship:
    """With the wind force of the truth, if the model can have one."""
    model: Any = ship.model
    truth: Any = virtual.ship.model
    return replace(ship, model=replace(model, wind=truth.wind)) if ship.model.takes("wind") else ship


def _becalmed(ship: Ship, studied: Ship) -> Ship:
    """Without wind force, unless the model has one too: in a calm it is that of the ship's own motion."""
    if studied.model.part("wind") is not None or not ship.model.takes("wind"):
        return ship
    model: Any = ship.model
    return replace(ship, model=replace(model, wind=None))


def _drive(trials: tuple[Trial, ...], virtual: VirtualTrials) -> Drive:
    maps = {name: (fit_thrust(n, pull, name=name), n, pull) for name, (n, pull) in virtual.pulled().items()}
    busy = {name: [t for t in trials if np.ptp(t[f"{name}_cmd"]) > _TURNS] for name in servos(trials)}
    return Drive(maps, {name: fit_servo(some, name) for name, some in busy.items() if some}, virtual.ship)


def score(ship: Ship, trials: Sequence[Trial]) -> Score:
    """Errors of `ship` on `trials`, which must have complete rows at even steps, the same in all."""
    states, known, acting = _logged(ship, trials)
    measured = [state[:, _MOVING] for state in states]
    errors = [run - state for run, state in zip(free_runs(ship, trials), measured, strict=True)]
    runs = {t.name: dict(zip(VELOCITIES, _rms(e), strict=True)) for t, e in zip(trials, errors, strict=True)}
    away, size = _rms(np.concatenate(errors)), _rms(np.concatenate(measured))
    relative = {name: a / b for name, a, b in zip(VELOCITIES, away, size, strict=True)}
    short = _short(ship, known, acting, trials[0].dt)
    steps = {name: np.array(_rms(short[:, :, k])) for k, name in enumerate(STATES)}
    return Score(relative, runs, steps, len(short))


def free_runs(ship: Ship, trials: Sequence[Trial]) -> list[Array]:
    """Velocities of each trial predicted from its first measured state, each of shape (rows, 3); trials as in `score`.

    Not finite where a prediction diverges.
    """
    _, known, acting = _logged(ship, trials)
    longest = max(len(trial) for trial in trials)
    # The last row of a shorter trial is held to the end of the longest.
    lanes = np.array([np.pad(rows, ((0, longest - len(rows)), (0, 0)), mode="edge") for rows in acting])
    whole = _predicted(ship, np.array([state[0] for state in known]), lanes, trials[0].dt)
    return [run[: len(trial), _MOVING] for run, trial in zip(whole, trials, strict=True)]


def one_step(ship: Ship, trials: Sequence[Trial]) -> list[Array]:
    """Velocities of each trial, each row predicted from the measured row before, each of shape (rows, 3).

    The first row is as measured.
    """
    return [run[:, _MOVING] for run in one_step_states(ship, trials)]


def one_step_states(ship: Ship, trials: Sequence[Trial]) -> list[Array]:
    """The same of all six states, each of shape (rows, 6)."""
    states, known, acting = _logged(ship, trials)
    begun = np.concatenate([state[:-1] for state in known])
    lanes = np.concatenate([np.stack([rows[:-1], rows[1:]], axis=1) for rows in acting])
    ends = _predicted(ship, begun, lanes, trials[0].dt)[:, 1]
    parts = np.split(ends, np.cumsum([len(trial) - 1 for trial in trials])[:-1])
    return [np.vstack([state[:1], part]) for state, part in zip(states, parts, strict=True)]


def _logged(ship: Ship, trials: Sequence[Trial]) -> tuple[list[Array], list[Array], list[Array]]:
    """Measured states of each trial, the same with the states that the log determines, and its inputs."""
    states = [trial.having(psi=unwrapped(trial["psi"])).stack(*STATES) for trial in trials]
    acting = [inputs(trial, ship.model) for trial in trials]
    known = [np.hstack([state, unseen(ship.model, rows, trials[0].dt)])
             for state, rows in zip(states, acting, strict=True)]  # fmt: skip
    return states, known, acting


def _short(ship: Ship, states: Sequence[Array], acting: Sequence[Array], dt: float) -> Array:
    """Errors after each of `HORIZONS` steps, shape (starts, horizons, 6).

    Args:
        states: initial state of each row: the measured six, and the others as the log before the row determines them.
    """
    ahead, after = HORIZONS[-1], np.array(HORIZONS)
    places = [(k, row) for k, state in enumerate(states) for row in range(0, len(state) - ahead, _STRIDE)]
    begun = np.array([states[k][row] for k, row in places])
    lanes = np.array([acting[k][row : row + ahead + 1] for k, row in places])
    ends = np.array([states[k][row + after, : len(STATES)] for k, row in places])
    return _predicted(ship, begun, lanes, dt)[:, after] - ends


def _predicted(ship: Ship, begun: Array, lanes: Array, dt: float) -> Array:
    """States from each start under the inputs of its lane, shape (lanes, steps, 6); not finite where one diverges."""
    each = substeps(ship, dt)
    runs = given(ship, begun, between(lanes, each))
    return run(runs, Steps.between(dt, lanes.shape[1], each)).values[:, :, : len(STATES)]


def _rms(errors: Array) -> list[float]:
    """Root mean square of each column; infinite if a prediction diverged."""
    with np.errstate(over="ignore", invalid="ignore"):
        found = np.sqrt((errors**2).mean(axis=0))
    return [float(value) if math.isfinite(value) else math.inf for value in found]
