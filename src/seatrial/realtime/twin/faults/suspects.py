"""What the innovations would look like under each fault: a bank of generalised likelihood ratios.

A fault of unit size that sets in at some time moves the true state away from the estimate, and the readings away from
the true state, by known amounts, to first order (Willsky and Jones 1976).  For each suspect and each onset of the last
`window` seconds the bank carries that signature along with the filter and weighs the innovations against it.  The
evidence is twice the logarithm of the Bayes factor against no fault, with a Gaussian prior of the fault's size; under
no fault its supremum over time exceeds 2 log(1/p) with probability p at most (Ville's inequality), so the rate of false
alarms follows from the number of onsets and suspects.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Sequence

import numpy as np

from ....actuators import Servo
from ....core.values import dataclass, replace
from ....data import Array
from ....identify.filters.augmented import ANTENNA, BIAS, SLOW, WAVES
from ....identify.nuisance import CURRENT
from ....models import unit
from ....ships import Ship
from ..follow import GATE, Follower, Machine, Step, inverse_of, lever
from ..settings import ANYWHERE, HEADING, POSITION, SPEED, TURN, VELOCITY

# No more onsets than this are kept, the older the further apart.
_SLOTS = 30
# A reading counts as so many standard deviations at most; the first one beyond the gate, maybe an outlier, not at all.
_MOST = 50.0
# How far from its last angle a jammed control may stand, one standard deviation [rad]: the log is late.
_BESIDE = math.radians(1.0)
# A slow rudder moves at one of these shares of its rate.
_SLOW = (0.5, 0.25, 0.12)
# By how much the sensor of a control jumps, one standard deviation: an angle [rad], or a share of what it shows.
_ANGLE, _SHARE = math.radians(3.0), 0.1

# By how much a sensor of the motion is off as a share, one standard deviation: at one speed it is the step's.
_SCALE = 0.3
# By how much a reading is late, as shares of L/U, and no more than so many seconds each.
_LATE = ((0.2, 3.0), (0.5, 6.0))
# By how much the clock of a log goes wrong, one standard deviation; step of the difference that shows it.
_PACE, _STEP = 0.02, 1e-3
# A current or force that grows comes within so many L/U.
_COMES = 2.0

JUMP, RAMP, IMPULSE = "jump", "ramp", "impulse"
LATE, SHARE, GROWS, CARRIED, LEVER, PACE = "late", "share", "grows", "carried", "lever", "pace"
STUCK, LAZY, LOST, REVERSED, MISREAD, SCALED = "stuck", "lazy", "lost", "reversed", "misread", "scaled"
FORM = "form"
"""How a fault acts: on a reading as a step, a ramp, as one that is late or off by a share; on a state at once, or as it
grows; on the water, which takes the ship along as it grows; on the place of the antenna; on the time between rows; on a
control (holds, lags, has no effect, has the opposite one, is logged off by a constant or by a share); on the forces of
the hull, each by itself, which no signature shows and the filter that runs again does."""
ELSEWHERE = "antenna elsewhere than stated"
"""The cause of an antenna that is not where the ship's file has it."""
PUSHED, RESISTED = "wind or another force changed", "resistance or wind changed"
"""Causes of forces that no signal tells: beside and about the ship, and along it."""
OF_SENSOR = frozenset({JUMP, RAMP, LATE, SHARE})
"""Kinds that are a fault of what measures."""
OF_CONTROL = frozenset({STUCK, LAZY, LOST, REVERSED, MISREAD, SCALED})
"""Kinds that are a fault of what steers or drives."""


@dataclass(frozen=True)
class Suspect:
    """A kind of fault.

    Attributes:
        cause: its name.
        how: one of `JUMP` ... `SCALED`.
        what: names of the channels, the states or the control that it acts on; one or two.
        size: standard deviation of each component of its size; a stuck, lazy or reversed control has size 1.
        unit: of the size.
        share: of its rate at which a lazy control moves; the delay at which what a late reading shows is exact [s].
    """

    cause: str
    how: str
    what: tuple[str, ...]
    size: tuple[float, ...]
    unit: str
    share: float = 1.0

    @property
    def fixed(self) -> bool:
        """Whether its size is known, 1."""
        return self.how in (STUCK, LAZY, REVERSED, FORM)


@dataclass(frozen=True)
class Evidence:
    """What speaks for a suspect.

    Attributes:
        suspect: the kind of fault.
        score: twice the logarithm of the Bayes factor against no fault.
        onset: its most likely onset [s].
        size, sigma: its size if it set in then, and the standard deviation of that; each as long as `suspect.size`.
        held: the control that it acts on, at its onset.
    """

    suspect: Suspect
    score: float
    onset: float
    size: tuple[float, ...]
    sigma: tuple[float, ...]
    held: float = math.nan


def suspects(machine: Machine) -> tuple[Suspect, ...]:
    """The faults that the log of this ship can show."""
    found = [*_of_sensors(machine), *_of_states(machine), *_of_controls(machine)]
    found.append(Suspect("clock of the log off its pace", PACE, ("t",), (_PACE,), "s/s"))
    return tuple(one for one in found if not one.what[0].startswith(BIAS))


def _of_sensors(machine: Machine) -> list[Suspect]:
    ship, found = machine.ship, list[Suspect]()
    U, T = max(ship.speed, 1e-3), ship.L_pp / max(ship.speed, 1e-3)
    for name, sensor in machine.settings.sensors.items():
        channels, count = sensor.channels, len(sensor.channels)
        jump = {POSITION: 20.0 * sensor.sd + 0.05 * ship.L_pp, HEADING: math.radians(5.0),
                TURN: 10.0 * sensor.sd + 0.05 / T, SPEED: 0.2 * U, VELOCITY: 0.2 * U}[name]  # fmt: skip
        units = {POSITION: "m", HEADING: "rad", TURN: "rad/s", SPEED: "m/s", VELOCITY: "m/s"}[name]
        ramp = {POSITION: 0.1 * U, HEADING: jump / 60.0}.get(name, jump / 120.0)
        slower = (0.1 * ramp,) if name == POSITION else ()  # a receiver that loses its aid, and one that is spoofed
        found += [
            Suspect(f"{name} jumped", JUMP, channels, (jump,) * count, units),
            *(Suspect(f"{name} drifts", RAMP, channels, (one,) * count, f"{units}/s") for one in (ramp, *slower)),
            *(Suspect(f"{name} late", LATE, channels, (lag,), "s", lag)
              for lag in (min(share * T, most) for share, most in _LATE)),
        ]
        if name in (TURN, SPEED):
            found.append(Suspect(f"{name} scaled", SHARE, channels, (_SCALE,), "of what it shows"))
    return found


def _of_states(machine: Machine) -> list[Suspect]:
    settings, ship, there, found = machine.settings, machine.ship, machine.names, list[Suspect]()
    U, T = max(ship.speed, 1e-3), ship.L_pp / max(ship.speed, 1e-3)
    if settings.placed and all(name in there for name in ANTENNA):
        ahead, aside = (share * ship.L_pp for share in ANYWHERE)
        found.append(Suspect(ELSEWHERE, LEVER, ANTENNA, (ahead, aside), "m forward, starboard"))
    if CURRENT[0] in there:
        found += _both("current changed", CURRENT, (0.1 * U,) * 2, "m/s", T)
        found.append(Suspect("current changed", CARRIED, CURRENT, (0.1 * U / (_COMES * T),) * 2, "m/s a second"))
    forces = {name: 10.0 * settings.start[name] for name in SLOW if name in there}
    if len(forces) == len(SLOW):
        aside = tuple(forces[name] for name in SLOW[1:])
        found += _both(PUSHED, SLOW[1:], aside, "", T)
        found += _both(RESISTED, SLOW[:1], (forces[SLOW[0]],), "m/s^2", T)
    return found + [Suspect(f"{path} changed", IMPULSE, (path,), (2.0 * settings.start[path],), "")
                    for path in settings.free]  # fmt: skip


def _of_controls(machine: Machine) -> list[Suspect]:
    found = list[Suspect]()
    for control in machine.ship.model.controls:
        if unit(control) == "rad":
            found.append(Suspect(f"{control} jammed", STUCK, (control,) * 2, (1.0, _BESIDE), "1"))
            found += [Suspect(f"{control} slow", LAZY, (control,), (1.0,), "1", share) for share in _SLOW]
            found.append(Suspect(f"{control} of the wrong sign", REVERSED, (control,), (1.0,), "1"))
            found.append(Suspect(f"{control} sensor jumped", MISREAD, (control,), (_ANGLE,), "rad"))
            found.append(Suspect(f"{control} sensor scaled", SCALED, (control,), (_SHARE,), "of what it shows"))
        else:
            found.append(Suspect(f"{control} sensor jumped", SCALED, (control,), (_SHARE,), "of what it shows"))
            found.append(Suspect(f"{control} without its thrust", LOST, (control,), (1.0,), "1"))
    return found


def _both(cause: str, what: tuple[str, ...], size: tuple[float, ...], unit: str, T: float) -> list[Suspect]:
    """A change of states at once, and one that comes in some lengths."""
    grows = tuple(one / (_COMES * T) for one in size)
    return [Suspect(cause, IMPULSE, what, size, unit), Suspect(cause, GROWS, what, grows, f"{unit} a second".strip())]


class Bank:
    """All suspects at all onsets; each column of its arrays is a suspect's component, each slot an onset."""

    def __init__(self, machine: Machine, all_of: Sequence[Suspect]) -> None:
        self.machine, self.suspects = machine, tuple(all_of)
        self._slots = min(max(2, round(machine.settings.window / machine.settings.spacing)), _SLOTS)
        self._first = np.cumsum([0, *(len(one.size) for one in self.suspects)]).astype(np.intp)
        self._columns = int(self._first[-1])
        self._place = {name: k for k, name in enumerate(machine.names)}
        self._control = {name: k for k, name in enumerate(machine.ship.model.controls)}
        self._rate = {name: _rate(machine.ship.actuators.of(name)) for name in self._control}
        self._acted = [k for k, one in enumerate(self.suspects) if one.how in OF_CONTROL]
        self._waves = [k for k, name in enumerate(machine.names) if name in (*WAVES, *WAVES.values())]
        self._sensor = [k for k, one in enumerate(machine.settings.sensors.values()) for _ in one.channels]
        self._said: dict[str, deque[tuple[float, float]]] = {name: deque() for name in machine.channels}
        self._prior = np.array([size**-2.0 for one in self.suspects for size in one.size])[:, None]
        self.clear()

    def clear(self) -> None:
        """Forget all evidence."""
        n, columns, slots = len(self.machine.names), self._columns, self._slots
        self._away = np.zeros((n, columns, slots))
        self._score, self._weight, self._cross = (np.zeros((columns, slots)) for _ in range(3))
        self._onset = np.full(slots, np.nan)
        self._far = np.zeros(len(self.machine.channels), dtype=np.bool_)
        self._held = np.zeros((len(self._control), slots))
        self._lazy = np.zeros((len(self.suspects), slots))

    def onset(self, t: float, acting: Array, mean: Array) -> None:
        """Try this time as an onset from here on; `mean` is the estimate at it."""
        slot = self._least(t)
        self._onset[slot] = t
        self._away[:, :, slot] = 0.0
        for array in (self._score, self._weight, self._cross):
            array[:, slot] = 0.0
        self._held[:, slot] = acting[: len(self._control)]
        for k in self._acted:
            self._lazy[k, slot] = acting[self._control[self.suspects[k].what[0]]]
        for one, first in zip(self.suspects, self._first, strict=False):
            for k, name in enumerate(one.what if one.how in (IMPULSE, LEVER) else ()):
                self._away[self._place[name], first + k, slot] = 1.0
                if one.how == LEVER:  # what it read until then was taken for the place of midship
                    self._away[[self._place["x"], self._place["y"]], first + k, slot] = -lever(name, mean[2])

    def _least(self, t: float) -> int:
        """An empty slot, or the oldest beyond the window; else that whose neighbours are nearest for its age."""
        order = np.argsort(np.where(np.isnan(self._onset), -np.inf, self._onset))
        known = self._onset[order]
        if not known[0] > t - self.machine.settings.window + 1e-9 or known.size < 3:
            return int(order[0])
        gaps = (known[2:] - known[:-2]) / np.maximum(t - known[1:-1], 1e-9)
        return int(order[1 + int(np.argmin(gaps))])

    def surprised(self, step: Step) -> bool:
        """Whether a channel goes beyond the gate that did not before: a likely onset."""
        far = np.abs(step.innovation) > GATE * np.sqrt(np.diagonal(step.spread))
        return bool((far & ~self._far[step.rows]).any())

    @property
    def latest(self) -> float:
        """The last onset; minus infinity before the first."""
        return float(np.max(np.where(np.isnan(self._onset), -np.inf, self._onset)))

    def weigh(self, step: Step, logged: Array, faulty: Collection[str] = (), level: float = 1.0) -> None:
        """Weigh the innovations of a row.

        Args:
            logged: controls and environment as the log has them; `step` has them as they are believed to act.
            faulty: controls that are known to be at fault; their suspects stand for the end of the fault.
            level: by how much innovations are larger than stated, squared; 1 where the filter is right.
        """
        n, flat = len(self.machine.names), self._columns * self._slots
        away = (step.onward @ self._away.reshape(n, flat)).reshape(n, self._columns, self._slots)
        traced = self.machine.traced
        (usual,) = traced.onward(step.before, step.acting, step.dt)
        self._grow(step, away, usual)
        self._act(step, away, logged, faulty, usual)
        found = (step.slope @ away.reshape(n, flat)).reshape(-1, self._columns, self._slots)
        self._misread(step, found, usual)
        deviation = np.sqrt(np.diagonal(step.spread))
        far = np.abs(step.innovation) > GATE * deviation
        counted = ~(far & ~self._far[step.rows])
        self._far[step.rows] = far
        inverse = np.zeros_like(step.spread)
        inverse[np.ix_(counted, counted)] = (
            step.inverse if counted.all() else inverse_of(step.spread[np.ix_(counted, counted)])
        )
        whitened = inverse @ self._within(step, deviation) / level
        weighed = np.tensordot(inverse / level, found, 1)
        self._score += np.tensordot(whitened, found, 1)
        self._weight += np.einsum("kcs,kcs->cs", found, weighed)
        self._cross[:-1] += np.einsum("kcs,kcs->cs", found[:, :-1], weighed[:, 1:])
        self._away = away - np.tensordot(step.gain, found, 1)

    def _within(self, step: Step, deviation: Array) -> Array:
        """The innovations, those of a sensor no further than `_MOST` deviations, in their direction."""
        most = dict[int, float]()
        share = np.minimum(1.0, _MOST * deviation / np.maximum(np.abs(step.innovation), 1e-300))
        groups = [self._sensor[k] for k in step.rows.tolist()]
        for group, one in zip(groups, share.tolist(), strict=True):
            most[group] = min(most.get(group, 1.0), one)
        return step.innovation * np.array([most[group] for group in groups])

    def _grow(self, step: Step, away: Array, usual: Array) -> None:
        """Add what a wrong clock and growing currents and forces do to the state; `usual` is what was expected."""
        (slower,) = self.machine.traced.onward(step.before, step.acting, (1.0 - _STEP) * step.dt)
        for one, first in zip(self.suspects, self._first, strict=False):
            if one.how == PACE:
                away[:, first] -= ((usual - slower) / _STEP)[:, None]
            for k, name in enumerate(one.what if one.how in (GROWS, CARRIED) else ()):
                more = np.clip(self._onset + comes(self.machine.ship) - step.t + step.dt, 0.0, step.dt)
                away[:, first + k] += _grows(self.machine, one.how, name, step.before[2])[:, None] * more

    def _act(self, step: Step, away: Array, logged: Array, faulty: Collection[str], usual: Array) -> None:
        """Add what faulty controls do to the state during the row; of those known to be at fault, what healing does."""
        if not self._acted:
            return
        traced = self.machine.traced
        (pushed,) = traced.pushed(step.before, step.acting, step.dt)
        pushed = pushed.reshape(len(self._control), -1)
        for k in self._acted:
            one, column = self.suspects[k], self._first[k]
            number = self._control[one.what[0]]
            here = float(step.acting[number])
            if one.what[0] in faulty:
                if one.how != LAZY:
                    other = step.acting.copy()
                    other[number] = logged[number]
                    (healed,) = traced.onward(step.before, other, step.dt)
                    away[:, column] += (healed - usual)[:, None]
            elif one.how == STUCK:
                away[:, column] += pushed[number][:, None] * (self._held[number] - here)
                away[:, column + 1] += pushed[number][:, None]
            elif one.how == LAZY:
                reach = one.share * self._rate[one.what[0]] * step.dt
                self._lazy[k] += np.clip(here - self._lazy[k], -reach, reach)
                away[:, column] += pushed[number][:, None] * (self._lazy[k] - here)
            elif one.how in (MISREAD, SCALED):
                away[:, column] -= pushed[number][:, None] * (1.0 if one.how == MISREAD else here)
            else:
                other = step.acting.copy()
                other[number] = -here if one.how == REVERSED else 0.0
                (instead,) = traced.onward(step.before, other, step.dt)
                away[:, column] += (instead - usual)[:, None]

    def _misread(self, step: Step, found: Array, usual: Array) -> None:
        """Add what faulty readings do to the innovations; `usual` is the state that was expected.

        A share or a delay is that of the slow motion: of the waves, which are never quite those of an oscillator, the
        innovations would look like one.
        """
        slow = step.slope.copy()
        slow[:, self._waves] = 0.0
        expected = step.expected - (step.slope - slow) @ usual
        rate = slow @ (usual - step.before) / step.dt
        row = {name: int(np.flatnonzero(step.rows == k)[0]) for k, name in enumerate(self.machine.channels)
               if k in step.rows}  # fmt: skip
        for name, k in row.items():
            said = self._said[name]
            said.append((step.t, float(expected[k])))
            while len(said) > 2 and said[1][0] < step.t - _LATE[-1][1]:
                said.popleft()
        for one, first in zip(self.suspects, self._first, strict=False):
            for k, name in enumerate(one.what if one.how in OF_SENSOR else ()):
                if name not in row:
                    continue
                if one.how in (JUMP, RAMP):
                    found[row[name], first + k] += 1.0 if one.how == JUMP else step.t - self._onset
                else:
                    shown = expected[row[name]]
                    found[row[name], first] += shown if one.how == SHARE else (
                        self._late(name, step.t, one.share, float(shown), float(rate[row[name]])))  # fmt: skip

    def _late(self, name: str, t: float, lag: float, now: float, rate: float) -> float:
        """What a second of delay adds to a reading, about a delay `lag`; by its rate where less is known than that."""
        if self._said[name][0][0] > t - lag:
            return -rate
        times, values = zip(*self._said[name], strict=True)
        return (float(np.interp(t - lag, times, values)) - now) / lag

    def evidence(self) -> list[Evidence]:
        """The best onset of each suspect, the best suspect first; none before the first onset."""
        live = np.flatnonzero(np.isfinite(self._onset))
        if not live.size:
            return []
        b, cross = self._score[:, live], self._cross[:, live]
        weight = self._weight[:, live] + self._prior
        found: list[Evidence] = []
        for one, first in zip(self.suspects, self._first, strict=False):
            part = slice(int(first), int(first) + len(one.size))
            score, size, sigma = _ratio(one, part, b, weight, cross, self._prior)
            j = int(np.argmax(score))
            number = self._control.get(one.what[0])
            held = math.nan if number is None else float(self._held[number, live[j]])
            found.append(Evidence(one, float(score[j]), float(self._onset[live[j]]),
                                  tuple(size[:, j].tolist()), tuple(sigma[:, j].tolist()), held))  # fmt: skip
        return sorted(found, key=lambda e: -e.score)


def _ratio(
    one: Suspect, part: slice, b: Array, weight: Array, cross: Array, prior: Array
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Score of each onset, and size and its deviation, shapes (onsets,), (components, onsets) twice."""
    b, w, x, prior = b[part], weight[part], cross[part.start], prior[part]
    if one.how == STUCK:
        left = b[1] - x
        score = 2.0 * b[0] - (w[0] - prior[0]) + left**2 / w[1] - np.log(w[1] / prior[1])
        return score, np.stack([np.ones_like(left), left / w[1]]), np.stack([np.zeros_like(left), w[1] ** -0.5])
    if one.fixed:
        return 2.0 * b[0] - (w[0] - prior[0]), np.ones_like(b), np.zeros_like(b)
    if len(one.size) == 1:
        return b[0] ** 2 / w[0] - np.log(w[0] / prior[0]), b / w, w**-0.5
    det = w[0] * w[1] - x**2
    size = np.stack([w[1] * b[0] - x * b[1], w[0] * b[1] - x * b[0]]) / det
    score = (b * size).sum(axis=0) - np.log(det / (prior[0] * prior[1]))
    return score, size, np.sqrt(np.stack([w[1], w[0]]) / det)


def comes(ship: Ship) -> float:
    """How long a current or a force grows, once it does [s]."""
    return _COMES * ship.L_pp / max(ship.speed, 1e-3)


def _grows(machine: Machine, how: str, name: str, psi: float) -> Array:
    """What a state that grows moves: itself, and the ship over ground with the water where that takes it along."""
    out = np.zeros(len(machine.names))
    out[machine.names.index(name)] = 1.0
    if how == CARRIED:
        c, s = math.cos(psi), math.sin(psi)
        out[[machine.names.index(one) for one in ("u", "v_m")]] = (c, -s) if name == CURRENT[0] else (s, c)
    return out


def grown(follower: Follower, fault: Evidence, t: float) -> Follower:
    """The estimate with what grows until `t` added."""
    machine, how = follower.machine, fault.suspect.how
    until = fault.onset + comes(machine.ship)
    span = max(min(t, until) - max(follower.t, fault.onset), 0.0)
    more = [size * span * _grows(machine, how, name, follower.mean[2])
            for name, size in zip(fault.suspect.what, fault.size, strict=True)]  # fmt: skip
    return replace(follower, mean=follower.mean + np.sum(more, axis=0))


def walking(follower: Follower, how: str, fault: tuple[tuple[str, ...], tuple[float, ...]], t: float) -> Follower:
    """The estimate with what may have grown until `t`, a walk as far in all as growth at this rate; (states, rates)."""
    machine = follower.machine
    spread = comes(machine.ship) * max(t - follower.t, 0.0)
    columns = np.array([size * _grows(machine, how, name, follower.mean[2]) for name, size in zip(*fault, strict=True)])
    return replace(follower, cov=follower.cov + spread * columns.T @ columns)


def pace(ship: Ship, one: Suspect) -> float:
    """How fast a lazy control moves; infinite for other suspects."""
    return one.share * _rate(ship.actuators.of(one.what[0])) if one.how == LAZY else math.inf


def _rate(servo: Servo) -> float:
    """How fast a control can move; without a limit, over its range in 20 s."""
    rate = float(getattr(servo, "rate", math.inf))
    return rate if math.isfinite(rate) else math.radians(70.0) / 20.0


def threshold(count: int, spacing: float, false_alarms: float) -> float:
    """Score from which a fault is there, so that false alarms are at most `false_alarms` a day."""
    tests = 86400.0 / spacing * count
    return 2.0 * math.log(max(tests / false_alarms, 2.0))
