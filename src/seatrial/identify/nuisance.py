"""Nuisance parameters as arrays: initial states of windows, and a current and sensor biases of each trial.

Each is drawn to zero by a Gaussian prior and eliminated trial by trial.  `Nuisances` is what one trial has of its own;
`Layout` is where those of all trials, and the offsets of the initial states of their windows, stand in one vector.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..core.values import dataclass, replace
from ..data import Array, Trial
from ..data.prepare import measured
from ..models import ROLL, STATES
from ..models.rolling import GRAVITY
from ..simulate.begun import drift
from ..simulate.replay import logged
from . import Nuisance, Problem, StudyError

Index = NDArray[np.intp]
CURRENT = ("environment.current_x", "environment.current_y")
"""Parameters of a compiled system that hold a constant current north and east [m/s]."""
_SHARED = ("current.north", "current.east")
EVERY = "*"
"""Stands for the name of a trial where errors of instruments are the same in every trial (`Nuisance.common`)."""
# Heel [rad] of an unlogged start; its rate is that times the root of g/L, about a roll frequency of any ship.
_HEEL = 0.1
# Start of a state that was not read: a heading is the course but for the drift [rad]; a share of speed and of U/L.
_COURSE, _SPEED = 0.3, 0.5
INITIAL = ("free", "measured")
"""Initial states of predictions: estimated along with the parameters, or the first row as recorded."""


def checked_initial(initial: str) -> None:
    """Refuse an unknown choice of initial states.

    Raises:
        StudyError: neither of `INITIAL`.
    """
    if initial not in INITIAL:
        raise StudyError(f"estimator.initial is '{initial}'; it is {' or '.join(INITIAL)}")


def begun_as(problem: Problem, initial: str) -> Problem:
    """The problem with the initial state of each window free if `initial` is "free": its first row counts as any other.

    States that the loss does not compare start as recorded: nothing is known of their errors.
    """
    if initial != "free" or problem.nuisance.initial:
        return problem
    named = problem.loss.sigma or STATES
    free = dict.fromkeys((name for name in _read(problem) if name in named), math.inf) | unread(problem)
    free = {name: free[name] for name in STATES if name in free}
    if problem.ship.model.motion != STATES:
        free |= _heeled(problem)
    return replace(problem, nuisance=replace(problem.nuisance, initial=free))


def _read(problem: Problem) -> list[str]:
    return [name for name in STATES if any(measured(trial, name) for trial in problem.trials)]


def unread(problem: Problem) -> dict[str, float]:
    """Deviations of the states that no trial has read, about what `simulate.begun` makes of the others.

    A position that nothing reads acts on nothing and is none of them.
    """
    U, L = problem.ship.speed, problem.ship.L_pp
    every = {"psi": _COURSE, "u": _SPEED * U, "v_m": _SPEED * U, "r": _SPEED * U / L}
    read = _read(problem)
    return {name: sd for name, sd in every.items() if name not in read}


def _heeled(problem: Problem) -> dict[str, float]:
    """Deviations of heel and roll rate at the start of a window, of a ship that rolls.

    Free where every trial has logged the heel and the loss compares it, else about zero as ships heel in turns.
    """
    if not all(logged(trial, "phi") for trial in problem.trials):
        return {"phi": _HEEL, "p": _HEEL * math.sqrt(GRAVITY / problem.ship.L_pp)}
    return dict.fromkeys(ROLL, math.inf) if "phi" in problem.loss.sigma or not problem.loss.sigma else {}


def held(problem: Problem) -> bool:
    """Whether the problem has nuisance parameters other than initial states."""
    own = problem.nuisance
    return bool(own.current or own.bias or own.common)


def first_errors(nuisance: Nuisance, trials: Sequence[Trial]) -> list[float]:
    """Where the search for the errors of instruments that all trials share begins: as the problem says, else zero.

    A current begins with what the sway over ground says of it: in one that is left out, a slow ship would drift at
    angles at which its polynomials mean nothing.
    """
    known = dict(nuisance.begun)
    if all(name in nuisance.common and name not in known for name in _SHARED):
        known |= dict(zip(_SHARED, drift(trials), strict=True))
    return [known.get(name, 0.0) for name in nuisance.common]


@dataclass(frozen=True)
class Nuisances:
    """The nuisance parameters of one trial: current north and east [m/s] where there is one, then sensor biases.

    Attributes:
        initial: indices of the channels whose initial state is estimated in every window.
        current: whether trials have a current of their own.
        bias: indices of the channels that are read with a bias.
        deviation: standard deviation of current and biases, shape (count,).
        motion: names of the measured states.
    """

    initial: Index
    current: bool
    bias: Index
    deviation: Array
    motion: tuple[str, ...] = STATES

    @staticmethod
    def of(nuisance: Nuisance, motion: Sequence[str] = STATES) -> Nuisances:
        """Those that a problem declares; `motion` names the measured states of its model.

        Raises:
            StudyError: an unknown channel, or a deviation that is not above zero.
        """
        for name, sigma in nuisance.bias.items():
            if name not in motion:
                raise StudyError(f"[nuisance] bias names '{name}'; channels are {', '.join(motion)}")
            if not sigma > 0:
                raise StudyError(f"[nuisance] bias of {name} is {sigma:g}; it must be above zero")
        sizes = [nuisance.current] * (len(CURRENT) * (nuisance.current > 0)) + list(nuisance.bias.values())
        initial, bias = (
            np.array([motion.index(name) for name in names], dtype=np.intp)
            for names in (nuisance.initial, nuisance.bias)
        )
        return Nuisances(initial, nuisance.current > 0, bias, np.array(sizes, dtype=np.float64), tuple(motion))

    @property
    def count(self) -> int:
        """Number of currents and biases of a trial."""
        return self.deviation.size

    @property
    def currents(self) -> int:
        """How many of them, the first ones, are components of a current."""
        return len(CURRENT) * self.current

    @property
    def lanewise(self) -> tuple[str, ...]:
        """Parameters of the compiled system that differ from trial to trial."""
        return CURRENT if self.current else ()

    def drift(self, own: Array) -> Array | None:
        """Values of `lanewise`, shape (lanes, 2), from current and biases of all lanes, shape (lanes, count)."""
        return own[:, : self.currents] if self.current else None

    def offset(self, own: Array) -> Array:
        """Biases added to predictions, shape (..., motion), from current and biases, shape (..., count)."""
        out = np.zeros((*own.shape[:-1], len(self.motion)))
        out[..., self.bias] = own[..., self.currents :]
        return out

    @property
    def names(self) -> tuple[str, ...]:
        """Names of currents and biases, as in `Fit.nuisances`."""
        currents = tuple(path.rpartition(".")[2] for path in self.lanewise)
        return (*currents, *(f"bias_{self.motion[k]}" for k in self.bias))

    def by_trial(self, trials: Sequence[Trial], own: Array) -> dict[str, dict[str, float]]:
        """Currents and biases of all trials, shape (trials, count), by trial and name; empty where there are none."""
        if not self.count:
            return {}
        return {t.name: dict(zip(self.names, row, strict=True)) for t, row in zip(trials, own.tolist(), strict=True)}

    def prior(self, own: Array) -> float:
        """Their part of the objective."""
        return float(((own / self.deviation) ** 2).sum())


@dataclass(frozen=True)
class Layout:
    """Where the nuisance parameters of all trials stand in one vector `eta`, trial by trial.

    Attributes:
        own: current and biases of one trial, and the channels of free initial states.
        slices: part of `eta` of each trial: initial offsets of each of its windows, then current, then biases.
        lanes: windows of each trial.
        trial: trial of each window.
        deviation: prior standard deviations, shape (eta,); inf where no prior holds.
    """

    own: Nuisances
    slices: tuple[slice, ...]
    lanes: tuple[Index, ...]
    trial: Index
    deviation: Array

    @staticmethod
    def of(nuisance: Nuisance, trial: Index, motion: Sequence[str] = STATES) -> Layout:
        """The layout for windows of these trials, shape (lanes,); `motion` names the measured states."""
        own, starts = Nuisances.of(nuisance, motion), list(nuisance.initial.values())
        names, rows = np.unique(trial, return_inverse=True)
        lanes = tuple(np.flatnonzero(rows == k) for k in range(names.size))
        parts = [np.array([*(starts * len(mine)), *own.deviation], dtype=np.float64) for mine in lanes]
        ends = np.cumsum([part.size for part in parts])
        slices = tuple(slice(int(end - part.size), int(end)) for part, end in zip(parts, ends, strict=True))
        return Layout(own, slices, lanes, rows, np.concatenate(parts))

    @property
    def flat(self) -> int:
        """How many no prior holds."""
        return int(np.isinf(self.deviation).sum())

    @cached_property
    def by_window(self) -> Index:
        """Entries of `eta` that hold the offsets of the initial state of each window, shape (lanes, offsets)."""
        width = self.own.initial.size
        first = np.zeros(self.trial.size, dtype=np.intp)
        for part, mine in zip(self.slices, self.lanes, strict=True):
            first[mine] = part.start + width * np.arange(len(mine))
        return first[:, None] + np.arange(width)

    @cached_property
    def by_trial(self) -> Index:
        """Entries that hold current and biases of each trial, shape (trials, count)."""
        ends = np.array([part.stop for part in self.slices], dtype=np.intp)
        return ends[:, None] - self.own.count + np.arange(self.own.count)

    @property
    def of_window(self) -> Index:
        """Entries that act on each window, shape (lanes, offsets + count)."""
        return np.hstack([self.by_window, self.by_trial[self.trial]])

    def starts(self, eta: Array) -> Array:
        """Offsets of the initial states of windows from the recorded ones, shape (..., lanes, motion)."""
        out = np.zeros((*eta.shape[:-1], self.trial.size, len(self.own.motion)))
        out[..., self.own.initial] = eta[..., self.by_window]
        return out

    def of_trials(self, eta: Array) -> Array:
        """Current and biases of each trial, shape (..., trials, count)."""
        return eta[..., self.by_trial]

    def columns(self, index: int, slopes: Array, scale: Array, first: int) -> Array:
        """Derivatives of the weighted residuals of a trial by its nuisance parameters, shape (lanes, entries, part).

        A channel that reads with a bias began off by it: the recorded start, less the bias, is where the model starts.

        Args:
            index: of the trial.
            slopes: weighted derivatives of its windows, shape (lanes, rows, motion, parameters + currents + states).
            scale: weights of its windows, shape (lanes, rows, motion).
            first: number of parameters.
        """
        part, mine, own = self.slices[index], self.lanes[index], self.own
        out = np.zeros((len(mine), scale[0].size, part.stop - part.start))
        flat, width = slopes.reshape(len(mine), scale[0].size, -1), own.initial.size
        state = first + own.currents
        for k in range(len(mine)):
            out[k, :, k * width : (k + 1) * width] = flat[k][:, state + own.initial]
        at = len(mine) * width
        out[:, :, at : at + own.currents] = flat[:, :, first:state]
        for k, channel in enumerate(own.bias):
            column = np.zeros_like(scale)
            column[:, :, channel] = scale[:, :, channel]
            out[:, :, at + own.currents + k] = column.reshape(len(mine), -1) - flat[:, :, state + channel]
        return out


def with_current(trial: Trial, found: Mapping[str, Mapping[str, float]]) -> Trial:
    """A trial with the current that a fit estimated for it on top of the one it logged; as it is where there is none.

    Args:
        found: values by trial and name, as in `Fit.nuisances`; a current is constant, north and east [m/s].
    """
    north, east = (found.get(trial.name, {}).get(path.rpartition(".")[2], 0.0) for path in CURRENT)
    if not (north or east):
        return trial
    if logged(trial, "U_C") and logged(trial, "gamma_C"):
        north = north + trial["U_C"] * np.cos(trial["gamma_C"])
        east = east + trial["U_C"] * np.sin(trial["gamma_C"])
    one = np.ones(len(trial))
    return trial.having(U_C=np.hypot(north, east) * one, gamma_C=np.arctan2(east, north) * one)
