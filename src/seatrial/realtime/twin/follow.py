"""The filter of a twin: one row at a time, extended, with exact Jacobians.

`Follower` is a value: each row gives a new one and a `Step`, which has all that a test of the innovations needs.  A
reading far from its prediction (beyond a gate) is not taken in; it counts in the tests, so that an outlier does no
harm and a jump is seen.  A channel that stays beyond the gate moves the mean as one at the gate would, and adds no
certainty.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import values
from ...core.values import dataclass, replace
from ...data import Array
from ...identify.filters.augmented import ANTENNA, Augmented, augmented
from ...identify.filters.filtering import inside
from ...identify.filters.kalman import moved, over, substeps
from ...ships import Ship
from .settings import Settings

# Readings are not taken in from so many standard deviations on; a channel that stays beyond for so many L/U is.
GATE = 6.0
_PATIENCE = 0.5


@dataclass(frozen=True)
class Machine:
    """What does not change from row to row; `made` makes it.

    Attributes:
        ship: the ship as it was at first.
        settings: what is assumed.
        traced: ship, further states and sensors.
        density: spectral density of the process noise of each state, shape (n,).
        low, high: bounds of the states, shape (n,).
    """

    ship: Ship
    settings: Settings
    traced: Augmented
    density: Array
    low: Array
    high: Array

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the states."""
        return self.traced.names

    @property
    def unit(self) -> float:
        """The time in which the ship sails its length, L/U [s]."""
        return self.ship.L_pp / max(self.ship.speed, 1e-3)

    @property
    def patience(self) -> float:
        """How long a channel may stay beyond the gate before it is heeded [s]."""
        return _PATIENCE * self.unit

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the readings."""
        return self.traced.model.channels

    def walked(self, span: float) -> Array:
        """Variance that the states gather in so long [s] without readings, shape (n,); those with a memory no more."""
        return self.density * np.array([min(max(span, 0.0), self.settings.memory.get(name, math.inf))
                                        for name in self.names])  # fmt: skip


def made(ship: Ship, settings: Settings) -> Machine:
    """Trace the ship.

    Raises:
        StudyError: a model in discrete time, or an unknown name.
    """
    traced = augmented(ship, settings.more, tuple(settings.sensors.values()), settings.memory)
    density = np.array([settings.process.get(name, 0.0) ** 2 for name in traced.names])
    low, high = np.array([settings.ranges.get(name, (-math.inf, math.inf)) for name in traced.names]).T
    return Machine(ship, settings, traced, density, low, high)


class Step(NamedTuple):
    """What one row did, n states, m channels, k of them read.

    Attributes:
        t, dt: time of the row, and since the one before [s].
        rows: channels that were read, shape (k,).
        taken: whether each was taken in at its full size, shape (k,).
        innovation: reading less prediction, shape (k,).
        spread: its covariance, shape (k, k).
        inverse: of the covariance.
        onward: Jacobian from the row before, shape (n, n).
        slope: of the readings by the states, shape (k, n).
        gain: shape (n, k); zero where a reading was not taken in.
        before: mean at the row before, shape (n,).
        acting: controls and environment in between.
        expected: prediction of the readings, shape (k,).
    """

    t: float
    dt: float
    rows: NDArray[np.intp]
    taken: NDArray[np.bool_]
    innovation: Array
    spread: Array
    inverse: Array
    onward: Array
    slope: Array
    gain: Array
    before: Array
    acting: Array
    expected: Array

    @property
    def nis(self) -> float:
        """Normalised innovation squared of the readings that were taken in."""
        kept = np.flatnonzero(self.taken)
        if kept.size == self.rows.size:
            return float(self.innovation @ self.inverse @ self.innovation)
        some = self.innovation[kept]
        return float(over(some[None], self.spread[np.ix_(kept, kept)])[0] @ some) if kept.size else 0.0


@dataclass(frozen=True)
class Follower:
    """Mean and covariance of the state at one time.

    Attributes:
        machine: what it runs on.
        t: time [s].
        mean: shape (n,).
        cov: shape (n, n).
        beyond: for how long each channel has been beyond the gate [s], shape (m,); None is not at all.
    """

    machine: Machine
    t: float
    mean: Array
    cov: Array
    beyond: Array | None = None

    def ahead(self, t: float, acting: Array, step: float | None = None) -> tuple[Follower, Array]:
        """The state at a later time without any reading, and the Jacobian on the way."""
        machine, span = self.machine, t - self.t
        count = substeps(span, step or machine.settings.step)
        mean, cov, onward = self.mean, self.cov, None
        for _ in range(count):
            mean, slope, blur = moved(machine.traced.model, mean, acting, span / count, machine.density)
            cov = slope @ cov @ slope.T + blur
            onward = slope if onward is None else slope @ onward
        cov = 0.5 * (cov + cov.T)
        return replace(self, t=t, mean=mean, cov=cov), np.eye(mean.size) if onward is None else onward

    def row(self, t: float, acting: Array, readings: Array, masked: Collection[int] = ()) -> tuple[Follower, Step]:
        """Take in a row.

        Args:
            readings: by channel, NaN where there is none, shape (m,).
            masked: channels that are compared but not believed.
        """
        later, onward = self.ahead(t, acting)
        model = self.machine.traced.model
        rows = np.flatnonzero(np.isfinite(readings))
        expected, transposed = model.read(later.mean, acting)
        slope = transposed.T[rows]
        innovation = model.wrapped(readings - expected)[rows]
        noise = model.noise[rows] ** 2
        reach = later.cov @ slope.T
        spread = slope @ reach
        spread[np.diag_indices(rows.size)] += noise
        inverse = inverse_of(spread)
        near = innovation**2 <= GATE**2 * np.diagonal(spread)
        believed = np.ones(rows.size, dtype=np.bool_) if not masked else ~np.isin(rows, list(masked))
        taken = near & believed
        gain = np.zeros((later.mean.size, rows.size))
        gain[:, taken] = reach[:, taken] @ (inverse if taken.all() else inverse_of(spread[np.ix_(taken, taken)]))
        keep = np.eye(later.mean.size) - gain @ slope
        cov = keep @ later.cov @ keep.T + (gain * noise) @ gain.T
        cov = 0.5 * (cov + cov.T)
        beyond = self._beyond(rows, near, t - self.t)
        # what stays away is heeded a little, without certainty, lest the filter stays away from it for good
        late = believed & ~near & (beyond[rows] > self.machine.patience)
        pull = np.where(late, GATE * np.sign(innovation) / np.sqrt(np.diagonal(spread)), 0.0)
        mean = inside(later.mean + gain @ innovation + reach @ pull, cov, self.machine.low, self.machine.high)
        step = Step(t, t - self.t, rows, taken, innovation, spread, inverse, onward, slope, gain, self.mean, acting,
                    expected[rows])  # fmt: skip
        return replace(later, mean=mean, cov=cov, beyond=beyond), step

    def _beyond(self, rows: NDArray[np.intp], near: NDArray[np.bool_], span: float) -> Array:
        """For how long each channel is beyond the gate after a row [s]."""
        out = np.zeros(len(self.machine.channels)) if self.beyond is None else self.beyond.copy()
        out[rows] = np.where(near, 0.0, out[rows] + span)
        return out

    def value(self, name: str) -> tuple[float, float]:
        """A state and its standard deviation."""
        k = self.machine.names.index(name)
        return float(self.mean[k]), math.sqrt(max(float(self.cov[k, k]), 0.0))

    def opened(self, names: Collection[str], deviation: Array) -> Follower:
        """The same with more uncertainty of some states: variance by their `deviation`, shape (names,).

        Where the antenna may stand elsewhere, midship does as well, as the fix stays.
        """
        cov = self.cov.copy()
        for name, sd in zip(names, deviation, strict=True):
            column = np.zeros(self.mean.size)
            column[self.machine.names.index(name)] = float(sd)
            if name in ANTENNA:
                column[[self.machine.names.index(one) for one in ("x", "y")]] = -float(sd) * lever(name, self.mean[2])
            cov += np.outer(column, column)
        return replace(self, cov=cov)


def lever(name: str, psi: float) -> Array:
    """By how much a fix is moved north and east [m] where the antenna stands a metre further that way."""
    c, s = math.cos(psi), math.sin(psi)
    return np.array([c, s] if name == ANTENNA[0] else [-s, c])


def inverse_of(spread: Array) -> Array:
    """Inverse of a covariance, whatever the units."""
    size = 1.0 / np.sqrt(np.diagonal(spread))
    return np.asarray(np.linalg.inv(spread * size[:, None] * size) * size[:, None] * size, dtype=np.float64)


def begun(machine: Machine, t: float, readings: Array, further: tuple[Array, Array] | None = None) -> Follower:
    """At the first row that has heading and position: motion as read, the rest as the ship file says.

    Args:
        readings: by channel, NaN where there is none, shape (m,).
        further: mean and covariance of the further states, if they are known better.
    """
    ship, settings, names = machine.ship, machine.settings, machine.names
    read = dict(zip(machine.channels, readings.tolist(), strict=True))
    noise = dict(zip(machine.channels, machine.traced.model.noise.tolist(), strict=True))
    known, own = values(ship.model), machine.traced.own
    mean, cov = np.zeros(len(names)), np.zeros((len(names), len(names)))
    quick = ship.speed / ship.L_pp
    psi = read["psi"]
    north, east = read.get("v_north", math.nan), read.get("v_east", math.nan)
    moving = math.isfinite(north + east)
    u = north * math.cos(psi) + east * math.sin(psi) if moving else read.get("u_w", math.nan)
    v_m = east * math.cos(psi) - north * math.sin(psi) if moving else 0.0
    sure = 5.0 * noise["v_north"] if moving else 0.25 * ship.speed
    x, y = (read.get(name, math.nan) for name in ("x", "y"))
    first = {
        "x": (x, 10.0 * noise.get("x", 1.0)), "y": (y, 10.0 * noise.get("y", 1.0)), "psi": (psi, 5.0 * noise["psi"]),
        "u": (u if math.isfinite(u) else ship.speed, sure if math.isfinite(u) else ship.speed), "v_m": (v_m, sure),
        "r": (read.get("r", 0.0), 0.5 * quick),
    }  # fmt: skip
    for k, name in enumerate(names):
        value, deviation = first.get(name, (known.get(name, 0.0), settings.start.get(name, 0.0)))
        mean[k], cov[k, k] = (value if math.isfinite(value) else 0.0), deviation**2
    if further is not None:
        mean[own:], cov[own:, own:] = further
    return _midship(Follower(machine, t, mean, cov), moving)


def _midship(at: Follower, moving: bool) -> Follower:
    """Motion of the antenna as that of midship; `moving` says whether its velocity was read, or its place alone."""
    names, (ahead, aside) = at.machine.names, at.machine.settings.antenna
    where = {name: k for k, name in enumerate(names)}
    there = [where.get(name) for name in ANTENNA]
    ahead, aside = (place + (0.0 if k is None else float(at.mean[k]))
                    for place, k in zip((ahead, aside), there, strict=True))  # fmt: skip
    psi, r = at.mean[where["psi"]], at.mean[where["r"]] if moving else 0.0
    c, s = math.cos(psi), math.sin(psi)
    mean, slope = at.mean.copy(), np.eye(len(names))
    mean[:2] -= ahead * c - aside * s, ahead * s + aside * c
    mean[3:5] += aside * r, -ahead * r
    slope[:2, where["psi"]] = ahead * s + aside * c, aside * s - ahead * c
    if moving:
        slope[3:5, where["r"]] = aside, -ahead
    for k, column in zip(there, ((-c, -s, 0.0, -r), (s, -c, r, 0.0)), strict=True):
        if k is not None:
            slope[[0, 1, 3, 4], k] = column
    return replace(at, mean=mean, cov=slope @ at.cov @ slope.T)


def without(step: Step, masked: Collection[int]) -> Step:
    """The row without channels that are known to be at fault."""
    if not masked:
        return step
    kept = ~np.isin(step.rows, list(masked))
    inverse = np.linalg.inv(step.spread[np.ix_(kept, kept)]) if kept.any() else np.zeros((0, 0))
    return step._replace(
        rows=step.rows[kept], taken=step.taken[kept], innovation=step.innovation[kept],
        spread=step.spread[np.ix_(kept, kept)], inverse=inverse, slope=step.slope[kept], gain=step.gain[:, kept],
        expected=step.expected[kept],
    )  # fmt: skip


def surprise(step: Step) -> float:
    """Normalised innovation squared of all readings, each no more than that of the gate."""
    return float(np.minimum(step.innovation**2 / np.diagonal(step.spread), 100.0).sum()) if step.rows.size else 0.0
