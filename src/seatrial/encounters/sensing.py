"""What one ship knows of the others by radar and AIS: late, noisy, within a range, with gaps; many runs at once.

Radar: each sweep a plot with errors of bearing and distance that are normal and independent, or none; a tracker with
fading memory (an alpha-beta filter of one time constant, Brookner 1998) makes place and velocity of them.  AIS: reports
at the intervals of ITU-R M.1371-5 for ships that do not turn, some lost, all late by a delay, places with an error that
is new in each; between messages a ship is taken to go straight on.  Usual figures are what performance standards allow:
IMO MSC.192(79), 1 deg and 30 m or 1 % of the distance, and a motion that is known after a minute.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Annotated, Any

import numpy as np

from ..core.constants import KNOT, MILE
from ..core.records import Limits, NotNegative, Positive
from ..core.values import dataclass, replace
from ..data import Array
from .conduct import Master, Orders, Scene
from .rules.geometry import Bools

Share = Annotated[float, Limits(least=0.0, most=1.0)]
UNSEEN = 1e6
"""Where a ship is put of which nothing is known: so far astern, going away [m]."""
_LOST = 5
"""Sweeps without a plot after which a track is dropped."""


@dataclass(frozen=True, kw_only=True)
class Radar:
    """A radar and its tracker.

    Attributes:
        range: at which ships are seen [m].
        sweep: time between two plots [s].
        bearing: standard deviation [deg].
        distance, share: the same of the distance, the greater of metres and a share of it.
        missed: share of the sweeps without a plot.
        memory: time constant of the tracker [s]; a track is told after three.
    """

    range: Positive = 12.0 * MILE
    sweep: Positive = 3.0
    bearing: NotNegative = 0.5
    distance: NotNegative = 15.0
    share: Share = 0.005
    missed: Share = 0.1
    memory: Positive = 20.0


@dataclass(frozen=True, kw_only=True)
class Ais:
    """Reports of transponders as they are received.

    Attributes:
        range: at which they are [m].
        silent: share of the ships that send none.
        missed: share of the messages that are lost.
        delay: from the measurement to the receiver's output [s].
        place: standard deviation of north and east [m].
        old: age from which a report is none [s].
    """

    range: Positive = 20.0 * MILE
    silent: Share = 0.0
    missed: Share = 0.1
    delay: NotNegative = 2.0
    place: NotNegative = 5.0
    old: Positive = 60.0

    def heard(self, distance: Array, rng: np.random.Generator) -> Bools:
        """Whether a message from so far arrives."""
        return (distance <= self.range) & (rng.random(np.shape(distance)) >= self.missed)


@dataclass(frozen=True, kw_only=True)
class Sensing:
    """Eyes of the own ship; None for what it does not have."""

    radar: Radar | None = None
    ais: Ais | None = None


class Tracker:
    """Tracks of a radar; arrays of shape (runs, ships).

    Attributes:
        x, y, north, east: place [m] and velocity [m/s] over ground at the last sweep.
        t: its time [s].
    """

    def __init__(self, radar: Radar, shape: tuple[int, ...]) -> None:
        self._radar, self.t = radar, -math.inf
        self.x, self.y, self.north, self.east = np.zeros((4, *shape))
        self._plots, self._missed = np.zeros(shape), np.zeros(shape)
        theta = math.exp(-radar.sweep / radar.memory)
        self._alpha, self._beta = 1.0 - theta**2, (1.0 - theta) ** 2
        self._enough = math.ceil(3.0 * radar.memory / radar.sweep)

    @property
    def known(self) -> Bools:
        """Which tracks are told."""
        return self._plots >= self._enough

    def snapshot(self) -> dict[str, Any]:
        t = self.t if math.isfinite(self.t) else None
        return {"t": t} | {name: getattr(self, name).tolist() for name in _KEPT}

    def restore(self, saved: Mapping[str, Any]) -> None:
        self.t = -math.inf if saved["t"] is None else float(saved["t"])
        for name in _KEPT:
            setattr(self, name, np.array(saved[name], dtype=np.float64))

    def sweep(self, t: float, own: tuple[Array, Array], place: tuple[Array, Array], rng: np.random.Generator) -> None:
        """Go on to a sweep, if one is due: from the true places of the own ship and the others [m]."""
        radar = self._radar
        if t < self.t + radar.sweep - 1e-9:
            return
        north, east = place[0] - own[0], place[1] - own[1]
        far, toward = np.hypot(north, east), np.arctan2(east, north)
        errors = rng.standard_normal((2, *far.shape))
        told = far + errors[0] * np.maximum(radar.distance, radar.share * far)
        toward = toward + errors[1] * math.radians(radar.bearing)
        seen = (far <= radar.range) & (rng.random(far.shape) >= radar.missed)
        self._filter(t, own[0] + told * np.cos(toward), own[1] + told * np.sin(toward), seen)

    def _filter(self, t: float, x: Array, y: Array, seen: Bools) -> None:
        """Predict all tracks, correct those with a plot, begin new ones, drop those without for long."""
        dt = t - self.t if math.isfinite(self.t) else self._radar.sweep
        self.t = t
        first = seen & (self._plots == 0.0)
        # gains of the first plots are those of a line through all of them (expanding memory), until memory fades
        n = self._plots + 1.0
        alpha = np.maximum(self._alpha, 2.0 * (2.0 * n - 1.0) / (n * (n + 1.0)))
        beta = np.maximum(self._beta, 6.0 / (n * (n + 1.0)))
        beta = np.where(self._plots < 1.0, 0.0, beta)
        for name, speed, plot in (("x", "north", x), ("y", "east", y)):
            at, way = getattr(self, name), getattr(self, speed)
            ahead = at + way * dt
            off = np.where(seen, plot - ahead, 0.0)
            setattr(self, name, np.where(first, plot, ahead + np.minimum(alpha, 1.0) * off))
            setattr(self, speed, np.where(first, 0.0, way + np.minimum(beta, 1.0) * off / dt))
        self._missed = np.where(seen, 0.0, self._missed + 1.0)
        self._plots = np.where(self._missed > _LOST, 0.0, self._plots + seen)


_KEPT = ("x", "y", "north", "east", "_plots", "_missed")
"""Arrays of a tracker."""


class Eyes:
    """What the own ship, the first of a scene, knows of the others.  Of a ship with both, AIS is believed."""

    def __init__(self, sensing: Sensing, scene: Scene, rng: np.random.Generator) -> None:
        """Begin at a scene."""
        self._sensing, self._rng, shape = sensing, rng, scene.x.shape
        self._tracker = None if sensing.radar is None else Tracker(sensing.radar, shape)
        self._sends = rng.random(shape) >= (1.0 if sensing.ais is None else sensing.ais.silent)
        self._next = scene.t + rng.random(shape) * interval(np.hypot(scene.north, scene.east))
        self._told = np.zeros((6, *shape))
        self._told[0] = -math.inf
        """Time of the measurement, x, y, psi, north, east of the last message of each."""
        self._late: list[tuple[float, Bools, Array]] = []

    def look(self, scene: Scene) -> Scene:
        """The scene as it is known."""
        shown = [one.copy() for one in (scene.x, scene.y, scene.psi, scene.north, scene.east)]
        seen = np.zeros(scene.x.shape, dtype=bool)
        own = scene.x[:, :1], scene.y[:, :1]
        if self._tracker is not None:
            self._tracker.sweep(scene.t, own, (scene.x, scene.y), self._rng)
            seen = self._by_radar(scene.t, self._tracker, shown)
        if self._sensing.ais is not None:
            seen = seen | self._by_ais(scene, self._sensing.ais, shown)
        for values, away in zip(shown, (own[0] - UNSEEN, own[1], math.pi, -1.0, 0.0), strict=True):
            values[:, 1:] = np.where(seen, values, away)[:, 1:]
        x, y, psi, north, east = (np.where(np.arange(scene.x.shape[1]) == 0, true, known) for true, known in zip(
            (scene.x, scene.y, scene.psi, scene.north, scene.east), shown, strict=True))  # fmt: skip
        return replace(scene, x=x, y=y, psi=psi, north=north, east=east)

    def _by_radar(self, t: float, tracks: Tracker, shown: list[Array]) -> Bools:
        """Its tracks, moved on since the sweep; the heading is taken for the course."""
        known, age = tracks.known, t - tracks.t
        values = (tracks.x + tracks.north * age, tracks.y + tracks.east * age, np.arctan2(tracks.east, tracks.north),
                  tracks.north, tracks.east)  # fmt: skip
        for k, value in enumerate(values):
            shown[k] = np.where(known, value, shown[k])
        return known

    def _by_ais(self, scene: Scene, ais: Ais, shown: list[Array]) -> Bools:
        """The last messages, moved on since they were measured."""
        t, told = scene.t, self._told
        due = self._sends & (self._next <= t + 1e-9)
        if due.any():
            self._next = np.where(due, t + interval(np.hypot(scene.north, scene.east)), self._next)
            heard = due & ais.heard(np.hypot(scene.x - scene.x[:, :1], scene.y - scene.y[:, :1]), self._rng)
            error = ais.place * self._rng.standard_normal((2, *due.shape))
            self._late.append((t + ais.delay, heard, np.stack([
                np.full(due.shape, t), scene.x + error[0], scene.y + error[1], scene.psi, scene.north, scene.east])))
        while self._late and self._late[0][0] <= t + 1e-9:
            _, heard, values = self._late.pop(0)
            told[:, heard] = values[:, heard]
        known = t - told[0] <= ais.old
        age = np.where(known, t - told[0], 0.0)
        for k, value in enumerate((told[1] + told[4] * age, told[2] + told[5] * age, *told[3:])):
            shown[k] = np.where(known, value, shown[k])
        return known


def interval(U: Array) -> Array:
    """Time between two position reports of class A [s] at a speed [m/s], of a ship that does not turn."""
    return np.select([U / KNOT > 23.0, U / KNOT > 14.0], [2.0, 6.0], 10.0)


def looking(begin: Callable[[Scene], Master], sensing: Sensing, rng: np.random.Generator) -> Callable[[Scene], Master]:
    """Who steers by what the sensors tell in place of the truth."""

    def aboard(scene: Scene) -> Master:
        eyes = Eyes(sensing, scene, rng)
        return _Aboard(begin(eyes.look(scene)), eyes)

    return aboard


@dataclass(frozen=True, eq=False)
class _Aboard:
    master: Master
    eyes: Eyes

    def look(self, scene: Scene) -> Orders:
        """Orders after a look at what is known."""
        return self.master.look(self.eyes.look(scene))
