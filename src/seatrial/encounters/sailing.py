"""Encounters sailed: the own ship by its own model, the others by a simple one, each with who steers it; many at once.

The own ship's model, actuators and draws of its parameters are a compiled kernel over runs, under a heading autopilot.
The others turn and change speed with the lags of a ship of their length (Nomoto's first order).  Everybody looks around
at an interval, and steers at each step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..core.errors import RequestError
from ..core.parameters import Scalar, Scalars, spec, unknown
from ..core.symbolic import clip, cos, exp, sin
from ..core.values import dataclass, field
from ..data import Array
from ..engine import System
from ..engine.csource import LANES
from ..engine.rollout import Simulator
from ..engine.stepping import Buffers, stepping
from ..environment import CALM, CHANNELS, Environment, through_water
from ..manoeuvres import Policy
from ..manoeuvres.autopilot import K_PRIME, OMEGA_PRIME, T_PRIME, ZETA, gains, wrapped
from ..models import Sampled, Stepped
from ..ships import Ship
from ..simulate.approach import approach, substeps
from ..simulate.lanes import Kernel
from ..simulate.loop import closed_loop, loop_memory, loop_values
from ..simulate.place import Place
from .conduct import CONDUCTS, Conduct, Master, Orders, Scene, Watch
from .meeting import Meeting, seen_from
from .rules.geometry import Motion, Pair
from .rules.limits import L_REFERENCE, Limits
from .rules.verdict import apart
from .tracks import Tracks

STEP = 0.5
"""Time between two orders, and between two looks of the own ship [s]."""
LOOK = 10.0
"""Time between two looks of another ship, and between rows of tracks [s]; of a short one less, by `paced`."""
_RUDDER = math.radians(20.0)
"""Most rudder of the autopilot."""
_T, _SURGE, _MOST = 1.0, 8.0, 0.25
"""Lags of yaw and surge of other ships times U/L, and their greatest rate of turn times L/U."""
_BREADTH = 1.0 / 6.0

Command = Callable[[Scene], Master]
"""Makes who steers the own ship, from the first scene."""


def paced(L: float, time: float = LOOK) -> float:
    """A time [s] for ships of a length: as it is from `L_REFERENCE` on, below by Froude's law as those of `Limits`."""
    return time * math.sqrt(min(L / L_REFERENCE, 1.0))


def stepped(time: float) -> float:
    """The same as a whole number of `STEP`."""
    return STEP * max(1, round(time / STEP))


@dataclass(frozen=True)
class Sea:
    """How encounters are sailed.

    Attributes:
        duration: of each run [s].
        every: time between the rows of the tracks [s]; a whole number of `STEP`.
        L: length of the other ships [m]; that of the own ship unless given.
        limits: of the rules, which everybody has in mind.
        around: wind, current and waves of each run, shape (runs, channels), or one row for all.
        ranks: of the ships by their kind (Rule 18), as of `Scene`.
        start: place of the own ship north and east [m] and its course [rad], shape (runs, 3), or one row for all; the
            meeting is as seen from there.
        place: the chart on which it feels depth and banks; None in open water.
        own: how many own ships are in one encounter: of each as many runs, side by side, are one encounter, each as
            another own ship has it, whose first others are the own ships of the runs beside it, in order.
    """

    duration: float
    every: float = 10.0
    L: float | None = None
    limits: Limits = field(default_factory=Limits)
    around: Array = field(default_factory=lambda: np.array([CALM]))
    ranks: tuple[int, ...] = ()
    start: Array = field(default_factory=lambda: np.zeros((1, 3)))
    place: Place | None = None
    own: int = 1


@dataclass(frozen=True, eq=False)
class Sailed:
    """Runs that went to their end.

    Attributes:
        tracks: of them.
        runs: their numbers among the meetings.
        failed: numbers of those whose model blew up or left its validity.
        silent: since when the stack gave no orders [s], of `runs`; NaN where it did to the end.
    """

    tracks: Tracks
    runs: NDArray[np.intp]
    failed: NDArray[np.intp]
    silent: Array


def sail(
    ship: Ship, meeting: Meeting, sea: Sea, stack: str | Conduct | Command = "rules",
    traffic: Sequence[str] = ("rules",), seed: int = 0, draws: Mapping[str, Array] | None = None,
    chosen: NDArray[np.intp] | None = None,
) -> Sailed:  # fmt: skip
    """Sail encounters.

    Args:
        ship: the own ship, in continuous time, with a rudder and revolutions.
        meeting: one, or many with an axis of runs.
        stack: who steers it: a conduct by name, a conduct, or a function that makes a master from the first scene.
            Where its orders are no numbers it is silent, and the last ones hold.
        traffic: conducts of the others; each other ship of each run has one of them, drawn.
        seed: of that draw, and of when the others look.
        draws: values of parameters of the ship, shape (runs,) each.
        chosen: number of the conduct of each other ship of each run, instead of a draw.

    Raises:
        RequestError: a conduct that is none, a ship that cannot be steered so, or times that do not fit.
    """
    under = Sailing(ship, meeting, sea, traffic, seed, draws, chosen)
    rows, keep = _rows(sea), round(sea.every / STEP)
    master = _master(stack, under.scene, under.fleet.first[:, 0], sea.limits)
    kept = [under.fleet.motion]
    for k in range(1, (rows - 1) * keep + 1):
        under.advance(master.look(under.scene))
        if k % keep == 0:
            kept.append(under.fleet.motion)
    return under.ended(np.linspace(0.0, (rows - 1) * sea.every, rows), np.stack(kept, axis=-1))


class Sailing:
    """Encounters under way, a `STEP` at a time; arguments as of `sail`.

    Attributes:
        scene: all ships now.
        fleet: what moves them.
        silent: since when the own ship had no orders [s]; NaN where it has them.
    """

    def __init__(
        self, ship: Ship, meeting: Meeting, sea: Sea, traffic: Sequence[str], seed: int = 0,
        draws: Mapping[str, Array] | None = None, chosen: NDArray[np.intp] | None = None,
    ) -> None:  # fmt: skip
        known = [_conduct(one) for one in traffic]
        runs, targets = np.atleast_2d(meeting.x).shape
        L = np.array([*[ship.L_pp] * sea.own, *[sea.L or ship.L_pp] * (targets + 1 - sea.own)], dtype=np.float64)
        self.fleet = fleet = _Fleet(ship, meeting, L, sea, draws or {})
        self.scene = scene = fleet.scene(0.0)
        self._L, self._own, self._breadth = L, sea.own, float(ship.model.breadth) or _BREADTH * ship.L_pp
        self._B = np.array([*[self._breadth] * sea.own, *(_BREADTH * L[sea.own :])])
        self._begins_apart()
        if chosen is None:
            chosen = np.random.default_rng(seed).integers(len(known), size=(runs, targets))
        self._watches = [Watch(known, chosen[:, k], k + 1, scene, fleet.first[:, k + 1], sea.limits)
                         for k in range(sea.own - 1, targets)]  # fmt: skip
        self._every = round(stepped(paced(ship.L_pp)) / STEP)
        self._phase = int(np.random.default_rng((seed, 1)).integers(self._every))
        self._k, self._orders = 0, Orders(scene.psi[:, 0].copy(), np.ones(runs))
        self.silent = np.full(runs, np.nan)

    def _begins_apart(self) -> None:
        """Refuse encounters in which the own ship touches another one before anybody has done anything."""
        motion = self.fleet.motion[..., None]
        own, *others = (Motion(x, y, psi, u, v_m, self._L[k : k + 1], self._B[k : k + 1])
                        for k in range(len(self._L)) for x, y, psi, u, v_m in (motion[:, :, k],))  # fmt: skip
        for k, other in enumerate(others, 1):
            apart(Pair(np.zeros(1), own, other), "own", f"target {k}")

    def advance(self, orders: Orders) -> None:
        """One step under orders of the own ship; the others look when it is their time."""
        self._k += 1
        if (self._k + self._phase) % self._every == 0 or self._k == 1:
            for number, watch in enumerate(self._watches, self._own):
                self.fleet.order(number, watch.look(self.scene))
        given = np.isfinite(orders.psi) & np.isfinite(orders.speed)
        if not given.all():
            self.silent = np.where(given, self.silent, np.fmin(self.silent, self.scene.t))
            orders = Orders(*(np.where(given, new, old) for new, old in zip(orders, self._orders, strict=True)))
        self._orders = orders
        self.fleet.order(0, orders)
        self.fleet.advance()
        self.scene = self.fleet.scene(self._k * STEP)

    def ended(self, t: Array, motion: Array) -> Sailed:
        """What became of the runs, from their motion at times, shape (5, runs, ships, rows)."""
        x, y, psi, u, v_m = motion
        good = (np.isfinite(x).all(axis=(1, 2)) & self.fleet.valid).reshape(-1, self._own).all(axis=1)
        good = np.repeat(good, self._own)
        tracks = Tracks(t, x[good], y[good], psi[good], u[good], v_m[good], self._L, self._B)
        return Sailed(tracks, np.flatnonzero(good), np.flatnonzero(~good), self.silent[good])


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
        return Watch((conduct,), np.zeros(len(speed), dtype=np.intp), 0, scene, speed, limits)
    return conduct(scene)


@dataclass(frozen=True)
class _Orders(Policy):
    """Ships under headings and speeds that are ordered from outside: the own one, and others that follow with lags.

    An other ship has three lags of yaw for its heading, which leave no overshoot; rate of turn and speed follow
    exactly over a step, and the place by the mean heading and speed.
    """

    memory: ClassVar[tuple[str, ...]] = ()

    n_P: Scalar = spec("1/s", "revolutions at the start")
    K_p: Scalar = spec("-", "rudder per heading error")
    K_d: Scalar = spec("s", "rudder against yaw rate")
    step: Scalar = spec("s", "time step", (0.0, math.inf))
    given: tuple[str, ...] = ()

    def schedule(self, dt: float, steps: int) -> Array:
        """Nothing fixed beforehand; shape (steps, orders)."""
        return np.zeros((steps, len(self.given)))

    def begin(self, state: Scalars) -> Scalars:
        """Others are put in their places afterwards."""
        return (0.0,) * len(self.memory)

    def command(self, t: Scalar, state: Scalars, memory: Scalars, given: Scalars = ()) -> tuple[Scalars, Scalars]:
        """Revolutions [1/s] and rudder [rad], and the others after the step."""
        delta = self.K_p * wrapped(given[0] - state[2]) - self.K_d * state[5]
        after: list[Scalar] = []
        for k in range(len(memory) // 5):
            after += self._follows(memory[5 * k : 5 * k + 5], *given[3 * k + 2 : 3 * k + 5])
        return (given[1], clip(delta, -_RUDDER, _RUDDER)), tuple(after)

    def _follows(self, motion: Scalars, wanted: Scalar, speed: Scalar, pace: Scalar) -> Scalars:
        """x, y, psi, u, r of an other ship after the step; pace is its U/L at the start [1/s]."""
        x, y, psi, u, r = motion
        turn = clip(wrapped(wanted - psi) * pace / (3.0 * _T), -_MOST * pace, _MOST * pace)
        r_1 = turn + (r - turn) * exp(-self.step * pace / _T)
        u_1 = speed + (u - speed) * exp(-self.step * pace / _SURGE)
        psi_1 = psi + 0.5 * (r + r_1) * self.step
        way, middle = 0.5 * (u + u_1) * self.step, 0.5 * (psi + psi_1)
        return x + way * cos(middle), y + way * sin(middle), psi_1, u_1, r_1


def _policy(ship: Ship, others: int, U: float, n_P: float, step: float) -> _Orders:
    """Who obeys, for a number of other ships."""
    motions = tuple(f"{name}_{k}" for k in range(others) for name in ("x", "y", "psi", "u", "r"))

    class Ordered(_Orders):
        memory: ClassVar[tuple[str, ...]] = motions

    given = ("psi", "n_P", *(f"{name}_{k}" for k in range(others) for name in ("psi", "U", "pace")))
    pace = U / ship.L_pp
    steer = gains(K_PRIME * pace, T_PRIME / pace, OMEGA_PRIME * pace, ZETA)
    return Ordered(n_P, steer.K_p, steer.K_d, step, given)


@lru_cache(maxsize=4)
def _loop(
    ship: Ship, others: int, U: float, n_P: float, step: float, drawn: tuple[str, ...], place: Place | None
) -> tuple[_Orders, System, tuple[float, ...], Simulator]:  # fmt: skip
    """All ships as one kernel; levels of a rare breach ask for it a hundred times.

    Raises:
        RequestError: `drawn` names no parameter of the ship.
    """
    policy = _policy(ship, others, U, n_P, step)
    system, values = closed_loop(ship, policy, step, place), loop_values(ship, policy)
    for name in drawn:
        if f"ship.{name}" not in values:
            raise RequestError(unknown(name, [one[5:] for one in values if one.startswith("ship.")], "parameter"))
    compiled = Kernel(system, tuple(f"ship.{name}" for name in drawn)).forward
    return policy, system, tuple(values.values()), compiled


class _Fleet:
    """All ships in all runs: the own one by its model under a heading autopilot, the others with lags.

    Attributes:
        first: speeds at the start, the own one through the water [m/s], shape (runs, ships).
        motion: x, y, psi, u, v_m, shape (5, runs, ships); the others do not drift.
        valid: runs whose own ship has been within the validity of its model so far.
    """

    def __init__(self, ship: Ship, meeting: Meeting, L: Array, sea: Sea, draws: Mapping[str, Array]) -> None:
        _can(ship)
        runs, others = np.atleast_2d(meeting.x).shape
        start = np.broadcast_to(sea.start, (runs, 3)).T
        places = [*seen_from(meeting, *start), np.atleast_2d(np.asarray(meeting.U_target, dtype=np.float64))]
        speed = np.broadcast_to(np.asarray(meeting.U, dtype=np.float64), (runs,))
        self.first = np.column_stack([speed, places[3]])
        self.valid = np.ones(runs, dtype=bool)
        steps, U = substeps(ship, STEP), float(speed[0])
        self._L, self._ranks, self._own, self._turns = L, sea.ranks, sea.own, approach(ship, U)[1]
        policy, system, values, compiled = _loop(ship, others, U, self._turns, STEP / steps, tuple(draws), sea.place)
        at = self._buffers = Buffers.of(system, -(-runs // LANES), len(draws), np.array(values))
        self._step = stepping(compiled, at, STEP / steps, steps, threads=1)
        for k, one in enumerate(draws.values()):
            self._put(at.own, k, one)
        around = np.broadcast_to(sea.around, (runs, len(CHANNELS))).T
        memory = self._begun(ship, policy, around, start, STEP / steps)
        for other in range(others):
            for k, one in enumerate(places):
                self._put(at.memory, memory - 5 * (others - other) + k, one[:, other])
            pace = places[3][:, other] / L[other + 1]
            self._put(at.series, len(CHANNELS) + 3 * other + 4, pace)
            self.order(other + 1, Orders(places[2][:, other], np.ones(runs)))
        bounds = ship.validity
        self._bounds = [(name, k, *bounds[name]) for k, name in enumerate(system.states) if name in bounds]
        states, last = len(system.states), at.out[:, 1]
        self._carried = last[:, :states], last[:, states : states + memory]
        self._moved(at.state, at.memory[:, memory - 5 * others : memory])

    def _begun(self, ship: Ship, policy: Policy, around: Array, start: Array, dt: float) -> int:
        """Weather, and the own ship in it at its speed through the water; how many numbers the loop remembers."""
        c, s = np.cos(start[2]), np.sin(start[2])
        at, speed, drift = self._buffers, self.first[:, 0], Environment(*around)
        self._current = np.asarray(drift.current_x), np.asarray(drift.current_y)
        for k, one in enumerate(around):
            self._put(at.series, k, one)
        for k, one in enumerate(start):
            self._put(at.state, k, one)
        self._put(at.state, 3, speed + drift.current_x * c + drift.current_y * s)
        self._put(at.state, 4, drift.current_y * c - drift.current_x * s)
        begun = tuple(float(one) for one in at.state[0, :6, 0])
        memory = loop_memory(ship, policy, dt, {"policy.n_P": self._turns}, begun)
        at.memory[:, : len(memory)] = np.array(memory, dtype=np.float64)[:, None]
        return len(memory)

    def _put(self, into: Array, k: int, values: Array) -> None:
        """One number of each run; runs that fill up the last block are as the last one."""
        lane = into[:, k].reshape(-1)
        lane[: len(values)], lane[len(values) :] = values, values[-1]
        into[:, k] = lane.reshape(len(into), LANES)

    def _moved(self, state: Array, memory: Array) -> None:
        """Take places and speeds from the kernel's order; runs lie side by side, over which all else is worked out."""
        (runs, ships), blocks = self.first.shape, len(state)
        motion = np.zeros((5, ships, blocks, LANES))
        motion[:, 0] = state[:, :5].swapaxes(0, 1)
        motion[:4, 1:] = memory.reshape(blocks, ships - 1, 5, LANES)[:, :, :4].transpose(2, 1, 0, 3)
        motion = motion.reshape(5, ships, -1)[:, :, :runs]
        if (own := self._own) > 1:  # all that are in one encounter are where they are in one of its runs
            steered = motion[:, 0].reshape(5, -1, own).copy()
            for k in range(own):
                motion[:, 1:own, k::own] = np.delete(steered, k, axis=2).swapaxes(1, 2)
                motion[:, own:, k::own] = motion[:, own:, ::own]
        self.motion = motion.swapaxes(1, 2)

    def scene(self, t: float) -> Scene:
        """All ships now, as they are."""
        x, y, psi, u, v_m = self.motion
        going = np.empty((4, *u.T.shape))
        c, s = np.cos(psi), np.sin(psi)
        going[0], going[1], going[2], going[3] = x.T, y.T, (u * c - v_m * s).T, (u * s + v_m * c).T
        scene = Scene(t, x, y, psi, going[2].T, going[3].T, self._L, self._ranks)
        scene.__dict__.update(bow=(c, s), going=going)
        return scene

    def order(self, ship: int, orders: Orders) -> None:
        """Give a ship its heading and share of the revolutions, or of the speed at the start."""
        at = len(CHANNELS) + (3 * ship - 1 if ship else 0)
        self._put(self._buffers.series, at, orders.psi)
        self._put(self._buffers.series, at + 1, orders.speed * (self.first[:, ship] if ship else self._turns))

    def advance(self) -> None:
        """One `STEP`."""
        self._step()
        state, memory = self._carried
        self._buffers.state[...], self._buffers.memory[...] = state, memory
        runs, others = len(self.valid), self.first.shape[1] - 1
        self._moved(state, memory[:, memory.shape[1] - 5 * others :])
        psi, u, v_m = self.motion[2:, :, 0]
        in_water = dict(zip(("u", "v_m"), through_water(u, v_m, *self._current, np.cos(psi), np.sin(psi)), strict=True))
        for name, k, low, high in self._bounds:
            now = in_water[name] if name in in_water else state[:, k].reshape(-1)[:runs]
            self.valid &= (now >= low) & (now <= high)


def _can(ship: Ship) -> None:
    """Refuse ships that cannot be steered so."""
    if not {"delta", "n_P"} <= set(ship.model.controls):
        raise RequestError(f"{ship.name} has no rudder delta and revolutions n_P; encounters are sailed by these")
    if isinstance(ship.model, Sampled | Stepped):
        raise RequestError(f"{ship.name} is a model in discrete time; encounters are sailed by one in continuous time")
