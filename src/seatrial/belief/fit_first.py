"""Start of a prediction estimated on the first seconds of a trial: initial state, constant current, sensor biases.

The model's parameters are held.  Current and biases have the priors of a fit that estimated them trial by trial (what
they differ by from one training trial to the next), else of ordinary size; nothing is known of states before.  Readings
weigh by the noise of their sensors, as in a fit, as long as the model explains them from one state.  Where it does not,
its own errors would pass for a current: then only what such a fit has found to differ is estimated, in shorter windows
that each have a state of their own, each channel weighed by what it leaves over and by how alike neighbouring residuals
are; and the prediction starts from the readings, not from where the model has been.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..core.constants import GRAVITY
from ..core.values import dataclass, replace
from ..data import Array, DataError, Trial, unwrapped
from ..environment import to_earth
from ..identify import Loss, Nuisance, Problem
from ..identify.diagnosis.channels import LARGE
from ..identify.noise import noise, screened
from ..identify.nuisance import EVERY, begun_as
from ..identify.record import even
from ..identify.trajectory.gauss_newton import State, minimise
from ..identify.trajectory.objective import TrajectoryObjective
from ..models import STATES
from ..ships import Ship
from ..simulate.replay import replay
from ..simulate.starts import smoothed_starts
from .corrected import corrected

# Standard deviations: of each component of the current over sqrt(g L_pp), which is 1 m/s for a ship of 255 m; of the
# bias of the heading [rad]; of those of the speeds over the ship's speed U, and of the rate over U / L_pp.
_CURRENT, _HEADING, _SPEED, _RATE = 0.02, 0.05, 0.05, 0.05
# A state is read off over this share of the time in which the ship travels its length, where the model is no help.
_READ = 1.0 / 3.0
# Fewest rows that are fitted, and that are predicted after them.
_FEWEST, _REST = 10, 2
# Most windows of the first seconds; rounds of weights; iterations of each descent and its relative tolerance.
_WINDOWS, _ROUNDS, _ITERATIONS, _CLOSE = 8, 3, 30, 1e-8


@dataclass(frozen=True)
class Beginning:
    """What the first seconds of a trial say about the rest.

    Attributes:
        trial: with the biases taken from its readings, in the current.
        t: time of the first row after them, where predictions start [s].
        state: x, y, psi, u, v_m, r there, by the model, shape (6,).
        found, sigma: current and biases with standard deviations, by name as in `trajectory.suspects`, SI units.
        size: root mean square residual of the first seconds over the sensors' noise; 1 where the model explains them.
    """

    trial: Trial
    t: float
    state: Array
    found: Mapping[str, float]
    sigma: Mapping[str, float]
    size: float

    @property
    def rest(self) -> Trial:
        """The trial from where predictions start."""
        return self.trial.rows(slice(int(np.searchsorted(self.trial.t, self.t - 1e-6 * self.trial.dt)), None))

    @property
    def current(self) -> float:
        """Standard deviation of each component of the current that was estimated [m/s]; inf where none was."""
        known = [self.sigma[name] for name, value in self.found.items() if name.startswith("current.") and value != 0.0]
        return math.sqrt(sum(one**2 for one in known) / len(known)) if known else math.inf

    def numbers(self) -> dict[str, object]:
        """The same without trial for a JSON document, SI units and radians."""
        state = dict(zip(STATES, self.state.tolist(), strict=True))
        estimated = {name: {"value": value, "sigma": self.sigma[name]} for name, value in self.found.items()}
        return {"t": self.t, "state": state, "estimated": estimated, "residual_over_noise": self.size}


def fit_first(
    ship: Ship, trial: Trial, span: float, *, current: bool = True, differing: Mapping[str, float] | None = None
) -> Beginning:
    """Estimate how a trial begins from its first `span` seconds.

    Args:
        ship: a model in continuous time, whose parameters are held.
        trial: the trial, corrected by what is known of its instruments.
        span: from the first complete row on [s].
        current: whether a current is estimated, on top of a logged one.
        differing: standard deviations of currents and biases between the training trials of a fit that estimated them
            (`between_trials`), by name as in `trajectory.suspects`; the others are then not estimated.

    Raises:
        DataError: fewer than ten complete rows within `span`, or fewer than two after it.
    """
    level = noise([trial])
    (clean,) = screened([trial], level).trials
    whole = np.isfinite(clean.stack(*STATES)).all(axis=1) if all(name in clean for name in STATES) else np.zeros(1)
    good = np.flatnonzero(whole)
    begin = float(trial.t[good[0]]) if good.size else 0.0
    before = trial.t[good] < begin + span * (1.0 - 1e-9)
    seen, rest = good[before], good[~before]
    if seen.size < _FEWEST:
        few = f"{seen.size} complete rows within {span:g} s"
        raise DataError(f"{trial.name}: {few}; {_FEWEST} are needed to fit them first")
    if rest.size < _REST:
        raise DataError(f"{trial.name}: lasts {trial.duration:g} s; the first {span:g} s leave nothing to predict")
    part = even(clean.rows(slice(int(seen[0]), int(seen[-1]) + 1)), clean.dt, ship.model)
    priors = _ordinary(ship) if not differing else dict(differing)
    priors = {name: sd for name, sd in priors.items() if current or not name.startswith("current.")}
    best = _Search.of(ship, part, level, priors, known=bool(differing))
    found, row = best.found, int(rest[0])
    right = corrected(trial, found, ship.model)
    if best.size <= LARGE:
        t, state = _carried(ship, right, *best.end, row)
    else:
        t, state = float(trial.t[row]), _read(corrected(clean, found, ship.model), row, span, ship)
    return Beginning(right, t, state, found, best.sigma if best.eta.any() else priors, best.size)


def between_trials(nuisances: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    """Root mean square of the currents and biases that a fit estimated trial by trial, by name as in `suspects`.

    Empty for fewer than two trials.

    Args:
        nuisances: by trial and name, as in `Fit.nuisances`.
    """
    own = [found for trial, found in nuisances.items() if trial != EVERY and found]
    if len(own) < 2:
        return {}
    names = dict.fromkeys(name for found in own for name in found)
    return {_named(name): math.sqrt(sum(found.get(name, 0.0) ** 2 for found in own) / len(own)) for name in names}


def _ordinary(ship: Ship) -> dict[str, float]:
    """Standard deviations of a current and of biases of ordinary size."""
    current, speed = _CURRENT * math.sqrt(GRAVITY * ship.L_pp), _SPEED * ship.speed
    return {"current.north": current, "current.east": current, "bias.psi": _HEADING, "bias.u": speed,
            "bias.v_m": speed, "bias.r": _RATE * ship.speed / ship.L_pp}  # fmt: skip


def _read(trial: Trial, row: int, span: float, ship: Ship) -> Array:
    """State at a row, from the readings of a short time up to it."""
    state = trial.stack(*STATES)
    state[:, 2] = unwrapped(state[:, 2])
    brief = min(_READ * ship.L_pp / max(ship.speed, 1e-3), span)
    return smoothed_starts(trial.t, state, [row], brief)[0]


def _carried(ship: Ship, trial: Trial, t: float, state: Array, row: int) -> tuple[float, Array]:
    """Time and state at a row, by the model from a state at time t shortly before [s]."""
    onwards = int(np.searchsorted(trial.t, t - 1e-6 * trial.dt))
    late = float(trial.t[onwards]) - t  # a part of a step, where steps are uneven
    north, east = to_earth(state[3], state[4], math.cos(state[2]), math.sin(state[2]))
    state = state + late * np.array([float(north), float(east), state[5], 0.0, 0.0, 0.0])
    if onwards < row:
        until = replay(ship, trial.rows(slice(onwards, row + 1)), begin=(float(trial.t[onwards]), state))
        state = until.rows(slice(-1, None)).stack(*STATES)[0]
    return float(trial.t[row]), state


@dataclass(frozen=True)
class _Search:
    """The estimate on the first seconds, cut into windows, at its optimum.

    Attributes:
        part: the first seconds on even steps.
        level: noise of each compared state.
        objective, eta: with the weights of `sigma`, and its nuisance parameters.
        size: root mean square residual over the noise by degree of freedom, from one state.
    """

    part: Trial
    level: Mapping[str, float]
    objective: TrajectoryObjective
    eta: Array
    size: float

    @staticmethod
    def of(ship: Ship, part: Trial, level: Mapping[str, float], priors: Mapping[str, float], known: bool) -> _Search:
        """From one state, if the model explains it; else in shorter windows, weighted by what it leaves over.

        Args:
            known: whether the priors are those of a fit; else nothing but the state is estimated where the model
                does not explain the readings.
        """
        found = _Search._with(ship, part, level, level, priors, 1)
        if found.size <= LARGE:
            return found
        if not known:
            return replace(found, eta=np.zeros(found.eta.size), size=found.size)
        count = 1
        while count < _WINDOWS and len(part) >= 2 * count * _FEWEST:
            count *= 2
        size, found = found.size, _Search._with(ship, part, level, level, priors, count)
        for _ in range(_ROUNDS):
            found = _Search._with(ship, part, level, found.weights, priors, count)
        return replace(found, size=size)

    @staticmethod
    def _with(
        ship: Ship, part: Trial, level: Mapping[str, float], sigma: Mapping[str, float], priors: Mapping[str, float],
        count: int,
    ) -> _Search:  # fmt: skip
        flow = max((sd for name, sd in priors.items() if name.startswith("current.")), default=0.0)
        bias = {name.partition(".")[2]: sd for name, sd in priors.items() if name.startswith("bias.")}
        nuisance = Nuisance(current=flow, bias={name: sd for name, sd in bias.items() if name in level and sd > 0})
        part = part.rows(slice((len(part) - 1) % count, None))  # windows of one length
        problem = begun_as(Problem(ship, (part,), (), Loss(sigma, 0.0), nuisance), "free")
        objective = TrajectoryObjective.build(
            problem, (part,), sigma, window=part.duration / count, dt=part.dt, every=1, method="rk4", threads=None,
        )  # fmt: skip
        none, eta = np.zeros(0), np.zeros(objective.nuisances)
        state = minimise(
            objective, State(none, eta, objective.cost(none, eta)), none, none,
            iterations=_ITERATIONS, tolerance=_CLOSE, each=lambda _: None,
        )  # fmt: skip
        found = _Search(part, level, objective, state.eta, math.nan)
        e = found.left
        return replace(found, size=float(np.sqrt(np.nansum(e**2) / max(int(np.isfinite(e).sum()) - eta.size, 1))))

    @property
    def left(self) -> Array:
        """Residuals over the sensors' noise, shape (windows, rows, 6); NaN where nothing is compared."""
        scale = self.objective.windows.scale
        e = self.objective.residuals(np.zeros(0), self.eta)
        unit = np.array([self.level.get(name, 1.0) for name in STATES])
        return np.where(scale > 0, e / np.where(scale > 0, scale, 1.0) / unit, np.nan)

    @property
    def weights(self) -> dict[str, float]:
        """Scale of each channel: its noise, larger by its residuals and as neighbours among them are alike.

        The variance of a mean of n alike values is larger than that of independent ones by (1 + rho) / (1 - rho), rho
        being the correlation of neighbours, and by n at most.
        """
        out: dict[str, float] = {}
        for name, least in self.level.items():
            e = np.nan_to_num(self.left[:, :, STATES.index(name)])
            square = float((e**2).sum())
            rho = float((e[:, 1:] * e[:, :-1]).sum()) / max(square, 1e-300)
            count = max(int(np.isfinite(self.left[:, :, STATES.index(name)]).sum()), 1)
            alike = min((1.0 + rho) / max(1.0 - rho, 1e-9), e.shape[1]) if rho > 0.0 else 1.0
            out[name] = least * max(math.sqrt(square / count), 1.0) * math.sqrt(alike)
        return out

    @property
    def found(self) -> dict[str, float]:
        """Current and biases by name as in `identify.trajectory.suspects`."""
        layout = self.objective.layout
        return dict(zip(map(_named, layout.own.names), layout.of_trials(self.eta)[0].tolist(), strict=True))

    @property
    def sigma(self) -> dict[str, float]:
        """Their posterior standard deviations."""
        if not self.objective.layout.own.count:
            return {}
        (block,) = self.objective.normal(np.zeros(0), self.eta).blocks
        own = self.objective.layout.own
        spread = np.sqrt(np.diag(np.linalg.inv(block.own[0])))[-own.count :]
        return dict(zip(map(_named, own.names), spread.tolist(), strict=True))

    @property
    def end(self) -> tuple[float, Array]:
        """Time of the last row [s] and the state that the model has there; a state that is not compared as read."""
        windows = self.objective.windows
        row = int(np.flatnonzero(windows.scale[-1].any(axis=1))[-1])
        scale = windows.scale[-1, row]
        off = self.objective.layout.own.offset(self.objective.layout.of_trials(self.eta))[0]
        e = self.objective.residuals(np.zeros(0), self.eta)[-1, row]
        model = windows.measured[-1, row] + e / np.where(scale > 0, scale, 1.0) - off
        complete = np.flatnonzero(np.isfinite(self.part.stack(*STATES)).all(axis=1))
        last = int(complete[-1])
        return float(self.part.t[last]), np.where(scale > 0, model, self.part.stack(*STATES)[last])


def _named(name: str) -> str:
    """The name in `identify.trajectory.suspects` of a nuisance of a trial."""
    return {"current_x": "current.north", "current_y": "current.east"}.get(name, name.replace("bias_", "bias.", 1))
