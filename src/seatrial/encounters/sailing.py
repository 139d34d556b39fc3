"""Encounters sailed: the own ship by its own model, the others by a simple one, each with who steers it; many at once.

The own ship's model, actuators and draws of its parameters are a compiled kernel over runs, under a heading autopilot.
The others turn and change speed with the lags of a ship of their length (Nomoto's first order).  Everybody looks around
at an interval, and steers at each step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..core.errors import RequestError
from ..core.parameters import unknown
from ..data import Array
from ..environment import CALM, CHANNELS, Environment
from ..manoeuvres import Helm
from ..manoeuvres.autopilot import K_PRIME, OMEGA_PRIME, T_PRIME, ZETA, gains
from ..ships import Ship
from ..simulate.approach import approach, time_step
from ..simulate.lanes import Kernel
from ..simulate.loop import closed_loop, loop_memory, loop_values
from .conduct import CONDUCTS, Conduct, Master, Scene, Watch
from .meeting import Meeting
from .rules.geometry import wrapped
from .rules.limits import Limits
from .tracks import Tracks

STEP = 0.5
"""Time between two orders, and between two looks of the own ship [s]."""
LOOK = 10.0
"""Time between two looks of another ship [s]."""
_RUDDER = math.radians(20.0)
"""Most rudder of the autopilot."""
_T, _SURGE, _MOST = 1.0, 8.0, 0.25
"""Lags of yaw and surge of other ships times U/L, and their greatest rate of turn times L/U."""
_BREADTH = 1.0 / 6.0

Command = Callable[[Scene], Master]
"""Makes who steers the own ship, from the first scene."""


@dataclass(frozen=True)
class Sea:
    """How encounters are sailed.

    Attributes:
        duration: of each run [s].
        every: time between the rows of the tracks [s]; a whole number of `STEP`.
        L: length of the other ships [m]; that of the own ship unless given.
        limits: of the rules, which everybody has in mind.
        around: wind, current and waves of each run, shape (runs, channels), or one row for all.
    """

    duration: float
    every: float = 10.0
    L: float | None = None
    limits: Limits = field(default_factory=Limits)
    around: Array = field(default_factory=lambda: np.array([CALM]))


@dataclass(frozen=True, eq=False)
class Sailed:
    """Runs that went to their end.

    Attributes:
        tracks: of them.
        runs: their numbers among the meetings.
        failed: numbers of those whose model blew up or left its validity.
    """

    tracks: Tracks
    runs: NDArray[np.intp]
    failed: NDArray[np.intp]


def sail(
    ship: Ship, meeting: Meeting, sea: Sea, stack: str | Conduct | Command = "rules",
    traffic: Sequence[str] = ("rules",), seed: int = 0, draws: Mapping[str, Array] | None = None,
) -> Sailed:  # fmt: skip
    """Sail encounters.

    Args:
        ship: the own ship, in continuous time, with a rudder and revolutions.
        meeting: one, or many with an axis of runs.
        stack: who steers it: a conduct by name, a conduct, or a function that makes a master from the first scene.
        traffic: conducts of the others; each other ship of each run has one of them, drawn.
        seed: of that draw, and of when each other ship looks.
        draws: values of parameters of the ship, shape (runs,) each.

    Raises:
        RequestError: a conduct that is none, a ship that cannot be steered so, or times that do not fit.
    """
    rows = _rows(sea)
    known = [_conduct(one) for one in traffic]
    runs, targets = np.atleast_2d(meeting.x).shape
    L = np.array([ship.L_pp, *[sea.L or ship.L_pp] * targets], dtype=np.float64)
    speed = np.broadcast_to(np.asarray(meeting.U, dtype=np.float64), (runs,))
    own, others = _Own(ship, speed, sea, draws or {}), _Others(meeting, L)
    scene = _scene(0.0, own, others, L)
    master = _master(stack, scene, speed, sea.limits)
    rng = np.random.default_rng(seed)
    chosen = rng.integers(len(known), size=(runs, targets))
    watches = [[Watch(one, k + 1, scene, others.first[:, k], sea.limits) for one in known] for k in range(targets)]
    phase = int(rng.integers(round(LOOK / STEP)))
    kept, orders = [_kept(own, others)], master.look(scene)
    keep, look = round(sea.every / STEP), round(LOOK / STEP)
    for k in range(1, (rows - 1) * keep + 1):
        if (k + phase) % look == 0 or k == 1:
            _watched(others, watches, chosen, scene)
        own.steer(orders.psi, orders.speed)
        others.advance()
        scene = _scene(k * STEP, own, others, L)
        orders = master.look(scene)
        if k % keep == 0:
            kept.append(_kept(own, others))
    whole: Array = np.stack(kept, axis=-1)
    x, y, psi, u, v_m = whole
    good = np.isfinite(x).all(axis=(1, 2)) & own.valid
    B = np.array([float(ship.model.breadth) or _BREADTH * ship.L_pp, *(_BREADTH * L[1:])])
    t = np.linspace(0.0, (rows - 1) * sea.every, rows)
    tracks = Tracks(t, x[good], y[good], psi[good], u[good], v_m[good], L, B)
    return Sailed(tracks, np.flatnonzero(good), np.flatnonzero(~good))


def _rows(sea: Sea) -> int:
    keep = sea.every / STEP
    if not (keep >= 1.0 and abs(keep - round(keep)) < 1e-9):
        raise RequestError(f"every = {sea.every:g} s; it is a whole number of steps of {STEP:g} s")
    if not sea.duration >= 2.0 * sea.every:
        raise RequestError(f"duration = {sea.duration:g} s; it holds two rows of {sea.every:g} s at least")
    return math.floor(sea.duration / sea.every + 1e-9) + 1


def _conduct(name: str) -> Conduct:
    if name not in CONDUCTS:
        raise RequestError(unknown(name, CONDUCTS, "conduct"))
    return CONDUCTS[name]


def _master(stack: str | Conduct | Command, scene: Scene, speed: Array, limits: Limits) -> Master:
    conduct = _conduct(stack) if isinstance(stack, str) else stack
    if isinstance(conduct, Conduct):
        return Watch(conduct, 0, scene, speed, limits)
    return conduct(scene)


def _watched(others: _Others, watches: list[list[Watch]], chosen: NDArray[np.intp], scene: Scene) -> None:
    """Orders of the other ships after a look around, each by its own conduct."""
    for k, of_ship in enumerate(watches):
        for number, watch in enumerate(of_ship):
            orders, mine = watch.look(scene), chosen[:, k] == number
            others.wanted[mine, k], others.share[mine, k] = orders.psi[mine], orders.speed[mine]


def _scene(t: float, own: _Own, others: _Others, L: Array) -> Scene:
    x, y, psi, u, v_m = (np.column_stack([one, other]) for one, other in zip(own.motion, others.motion, strict=True))
    c, s = np.cos(psi), np.sin(psi)
    return Scene(t, x, y, psi, u * c - v_m * s, u * s + v_m * c, L)


def _kept(own: _Own, others: _Others) -> Array:
    """Shape (5, runs, ships)."""
    return np.stack([np.column_stack([one, other]) for one, other in zip(own.motion, others.motion, strict=True)])


class _Own:
    """The own ship in all runs, under its autopilot.

    Attributes:
        valid: runs that have been within the validity of the model so far.
    """

    def __init__(self, ship: Ship, speed: Array, sea: Sea, draws: Mapping[str, Array]) -> None:
        names, runs, U = ship.model.controls, len(speed), float(speed[0])
        if "delta" not in names or "n_P" not in names:
            raise RequestError(f"{ship.name} has no rudder delta and revolutions n_P; encounters are sailed by these")
        self._steps = max(1, math.ceil(STEP / time_step(ship) - 1e-9))
        self._dt, self._turns = STEP / self._steps, approach(ship, U)[1]
        policy = Helm(names, self._turns)
        system, values = closed_loop(ship, policy, self._dt), loop_values(ship, policy)
        for name in draws:
            if f"ship.{name}" not in values:
                raise RequestError(unknown(name, [one[5:] for one in values if one.startswith("ship.")], "parameter"))
        self._code = Kernel(system, tuple(f"ship.{name}" for name in draws)).forward
        self._shared = np.array(list(values.values()))
        self._lanewise = np.column_stack([*draws.values()]) if draws else np.zeros((runs, 0))
        around = np.broadcast_to(sea.around, (runs, len(CHANNELS)))
        self._state = np.zeros((runs, len(system.states)))
        drift = Environment(*around.T)  # the speed through the water is as meant, on course north
        self._state[:, 3], self._state[:, 4] = speed + drift.current_x, drift.current_y
        memory = loop_memory(ship, policy, self._dt, {"policy.n_P": self._turns}, tuple(self._state[0, :6]))
        self._memory = np.tile(np.array(memory, dtype=np.float64), (runs, 1))
        self._series = np.zeros((runs, 1, len(system.series)))
        self._series[:, 0, : len(CHANNELS)] = around
        self._at = {name: system.series.index(name) for name in ("delta", "n_P")}
        pace = U / ship.L_pp
        self._gains = gains(K_PRIME * pace, T_PRIME / pace, OMEGA_PRIME * pace, ZETA)
        self._bounds = [(k, *ship.validity[name]) for k, name in enumerate(system.states)
                        if name in ship.validity and name not in ("u", "v_m")]  # fmt: skip
        self.valid = np.ones(runs, dtype=bool)

    @property
    def motion(self) -> tuple[Array, ...]:
        """x, y, psi, u, v_m, shape (runs,)."""
        return tuple(self._state[:, k] for k in range(5))

    def steer(self, psi: Array, share: Array) -> None:
        """One step towards a heading, with a share of the revolutions of the approach."""
        error = wrapped(psi - self._state[:, 2])
        delta = self._gains.K_p * error - self._gains.K_d * self._state[:, 5]
        self._series[:, 0, self._at["delta"]] = np.clip(delta, -_RUDDER, _RUDDER)
        self._series[:, 0, self._at["n_P"]] = share * self._turns
        states = self._state.shape[1]
        out = self._code.stored(
            self._state, self._series, self._shared, dt=self._dt, steps=self._steps + 1, memory0=self._memory,
            lanewise=self._lanewise, every=self._steps,
        )[:, -1]  # fmt: skip
        self._state = out[:, :states].copy()
        self._memory = out[:, states : states + self._memory.shape[1]].copy()
        for k, low, high in self._bounds:
            self.valid &= (self._state[:, k] >= low) & (self._state[:, k] <= high)


class _Others:
    """The other ships in all runs; arrays of shape (runs, others).

    Attributes:
        first: speeds at the start [m/s].
        wanted: headings that are steered [rad].
        share: of the speed at the start that is ordered.
    """

    def __init__(self, meeting: Meeting, L: Array) -> None:
        self._x, self._y, self._psi, self._u = (
            np.atleast_2d(one).astype(np.float64) for one in (meeting.x, meeting.y, meeting.psi, meeting.U_target)
        )
        self.first, self._r = self._u.copy(), np.zeros_like(self._u)
        self._pace = self._u / L[1:]
        self.wanted, self.share = self._psi.copy(), np.ones_like(self._u)

    @property
    def motion(self) -> tuple[Array, ...]:
        """x, y, psi, u, v_m; they do not drift."""
        return self._x, self._y, self._psi, self._u, np.zeros_like(self._u)

    def advance(self) -> None:
        """One step: rate of turn and speed follow with lags, exactly; the place by the mean heading and speed."""
        most = _MOST * self._pace
        # three lags of yaw for the heading leave no overshoot
        turn = np.clip(wrapped(self.wanted - self._psi) * self._pace / (3.0 * _T), -most, most)
        r = turn + (self._r - turn) * np.exp(-STEP * self._pace / _T)
        u = self.share * self.first
        u = u + (self._u - u) * np.exp(-STEP * self._pace / _SURGE)
        psi = self._psi + 0.5 * (r + self._r) * STEP
        way, middle = 0.5 * (u + self._u) * STEP, 0.5 * (psi + self._psi)
        self._x, self._y = self._x + way * np.cos(middle), self._y + way * np.sin(middle)
        self._psi, self._u, self._r = psi, u, r
