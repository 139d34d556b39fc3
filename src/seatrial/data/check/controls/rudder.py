"""The rudder against the motion, and port against starboard: sign, unit, offset, scale, lag, orders called angles."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ....core.constants import GRAVITY
from ....core.ranks import median, quantile
from ....core.values import dataclass, replace
from ... import Array, Trial
from ...prepare import Remedy, Step, integral, shifted
from ..relations import has, length_of, noise_of
from ..repairs import step, times
from ..sensors import Fault
from .effect import OWN, effect

_DEG = math.pi / 180.0
# Fastest steering gear of a ship [rad/s], and the length from which on it is one [m].
_QUICKEST, _SHIP = 8.0 * _DEG, 20.0
# Yaw rate r L/u per rudder angle: 1 to 3 for ships; beyond, the rudder is in another unit.
_EFFECTIVE = 12.0
# Least rate of a steering gear by SOLAS II-1/29: from 35 deg to 30 deg on the other side in 28 s [deg/s].
_SOLAS = 2.32
# Differences of held angles that matter, and those that do not [rad]; and by side [-].
_OFFSET, _EVEN, _SIDES = 0.45 * _DEG, 0.25 * _DEG, 0.04
_NEUTRAL = 1.0 * _DEG
# What the damping of a hull adds to the time of the rudder by its yaw, in ship times.
_DAMPED = 0.18
# Lags that are tried about those that the effect of the rudder tells grossly, in ship times: so far to either side the
# move stays in the window that is looked at.  Farther off a quartic and another move fit any slow hull.
_REACH = 1.6
# Lengths with which the lag of a ship of unknown length must agree [m].
_LENGTHS = (50.0, 200.0)
# A lag is told from this many standard errors on.
_CERTAIN = 5.0
# ... and by so many moves of the rudder.
_FEWEST = 3
# Controls that may turn a ship instead of its rudder.
_STEERING = ("delta_1", "delta_2", "alpha", "n_bow", "n_stern", "n_P_1", "f_")
# Part of the usual rate of turn that is a turn to one side.
_SWING = 0.4
# Rows below which nine in ten repeats of an indicator are where its noise makes it flicker.
_FLICKER = 15
# From so many times its noise on, the step of an indicator hides the noise at most values.
_COARSE = 5.0


def helm_faults(trials: Sequence[Trial]) -> Iterator[Fault]:
    """What the logs of one ship say of its rudder indicator."""
    some = [trial for trial in trials if "delta" in trial and has(trial, "r") and "u" in trial]
    if not some:
        return
    if gross := [*_dead(some), *_small(some), *_orders(some)]:
        yield gross[0]
        return
    if stuck := [*stuck_faults(some)]:
        yield stuck[0]
        return
    if late := [*_lag(some)]:
        yield late[0]
    yield from _balance(some)


def _ship_time(trial: Trial) -> float:
    return math.sqrt((length_of(trial) or 100.0) / GRAVITY)


def _turns(trial: Trial) -> bool:
    length = length_of(trial) or 100.0
    speed = float(np.nanquantile(np.abs(trial["u"]), 0.9)) or 1.0
    return float(np.nanquantile(np.abs(trial["r"]), 0.9)) * length / speed > 0.1


def _dead(trials: Sequence[Trial]) -> Iterator[Fault]:
    on_the_spot = any(name.startswith(("alpha", "n_bow", "n_stern", "f_")) for name in trials[0].channels)
    dead = [trial for trial in trials if not has(trial, "delta") and _turns(trial)]
    straight = [trial for trial in trials if not has(trial, "delta")]
    # one held rudder is a turn that was logged from its execute on; the same in several trials is no rudder
    if dead and not on_the_spot:
        levels = {float(np.nanmedian(trial["delta"])) for trial in dead}
        if levels == {0.0} or (len(dead) > 2 and len(levels) == 1 and len(straight) == len(trials)):
            value = levels.pop()
            yield Fault(
                "error", "delta", "the rudder never moves, and the ship turns",
                f"{value:g} rad in every row of {len(dead)} trial{'s' * (len(dead) > 1)}",
                step("drop", "delta", text="take the column of the rudder"),
                "quality", "zeros" if value == 0.0 else "frozen",
            )  # fmt: skip


def _small(trials: Sequence[Trial]) -> Iterator[Fault]:
    most = []
    for trial in trials:
        length, u = length_of(trial), np.abs(trial["u"])
        if length is None or not has(trial, "delta"):
            continue
        fast = u > 0.3 * float(np.nanmax(u))
        turn = float(np.nanquantile(np.abs(trial["r"][fast]) * length / u[fast], 0.9))
        angle = float(np.nanquantile(np.abs(trial["delta"]), 0.9))
        if turn > 0.15 and angle > 5.0 * noise_of(trial["delta"]):  # a rudder at rest is not one in another unit
            most.append(turn / angle)
    if most and min(most) > _EFFECTIVE:
        yield Fault(
            "error", "delta", "the rudder is too small for these turns: radians that were converted from degrees",
            f"r L/u is {min(most):.3g} times the rudder angle or more (1 to 3 for ships)",
            times(1.0 / _DEG, "delta", text='unit = "rad" in the mapping'), "unit", "unit",
        )  # fmt: skip


def _orders(trials: Sequence[Trial]) -> Iterator[Fault]:
    leaps = 0
    fastest = 0.0
    for trial in trials:
        if (length_of(trial) or 0.0) < _SHIP:
            continue  # the servo of a model may be that quick
        limit = _QUICKEST
        steps, dt = np.abs(np.diff(trial["delta"])), np.diff(trial.t)
        leap = (steps > 6.0 * _DEG) & (steps / dt > limit)
        leaps += int(leap.sum())
        fastest = max(fastest, float(np.nanmax(np.where(leap, steps / dt, 0.0), initial=0.0)))
    if leaps >= 3:
        yield Fault(
            "warning", "delta", "orders of the rudder called its angle",
            f"{leaps} leaps, up to {fastest / _DEG:.3g} deg/s; no steering gear of such a ship is so quick",
            step("follow", "delta", amount=(_SOLAS,), text="take the column of the indicator"), "quality",
            "order_as_measured",
        )  # fmt: skip


def stuck_faults(trials: Sequence[Trial]) -> Iterator[Fault]:
    """A long stretch of one value, where the indicator flickers whenever the rudder is held, or the yaw swings."""
    steps: list[Step] = []
    evidence = ""
    most = max((float(np.nanquantile(np.abs(one["r"]), 0.95)) for one in trials if has(one, "r")), default=math.inf)
    for trial in trials:
        delta, noise = trial["delta"], noise_of(trial["delta"])
        if (swung := _swinging(trial, most)) is not None:
            since, until = swung
            steps.append(Step(do="cut", where=(swung,), trials=(trial.name,)))
            evidence = evidence or (f"{trial.name}: the same value {delta[trial.t >= since][0]:.4g} rad from "
                                    f"t = {since:g} to {until:g} s, while the ship turns to either side")  # fmt: skip
            continue
        if not has(trial, "delta"):
            continue
        same = np.concatenate([[False], np.diff(delta) == 0, [False]])
        edges = np.flatnonzero(np.diff(same.astype(np.int8)))
        starts, lengths = edges[::2], edges[1::2] - edges[::2]
        if lengths.size < 10:
            continue
        order = np.argsort(lengths)
        longest, next_one = int(lengths[order[-1]]), int(lengths[order[-2]])
        # The longest of a thousand flickers is a matter of chance; that most are short is not.
        usual = quantile(lengths, 0.9)
        k = int(starts[order[-1]])
        if longest > max(30, 4 * next_one) and usual < _FLICKER and noise > 0 and _step_at(delta, k) < _COARSE * noise:
            since, until = float(trial.t[k]), float(trial.t[k + longest])
            steps.append(Step(do="cut", where=((since, until),), trials=(trial.name,)))
            evidence = evidence or (f"{trial.name}: the same value {delta[k]:.4g} rad for {until - since:.3g} s from "
                                    f"t = {since:g} s; elsewhere at most {next_one} rows")  # fmt: skip
    if steps:
        yield Fault("warning", "delta", "frozen rudder indicator", evidence, Remedy(steps=tuple(steps)), "quality",
                    "frozen")  # fmt: skip


def _swinging(trial: Trial, most: float) -> tuple[float, float] | None:
    """First and last time of the longest stretch of one value in which the ship turns to one side, back and again.

    Under a held rudder the rate of turn goes to one value.  Without sway and waves it passes zero once at most.
    """
    steered = any(name.startswith(_STEERING) for name in trial.channels)
    if steered or "r" not in trial or not np.isfinite(trial["delta"]).any():
        return None
    held = np.concatenate([[False], np.diff(trial["delta"]) == 0, [False]]).astype(np.int8)
    edges = np.flatnonzero(np.diff(held))
    starts, ends = edges[::2], edges[1::2]
    if not starts.size:
        return None
    k = int(np.argmax(ends - starts))
    part = slice(int(starts[k]), int(ends[k]) + 1)
    sides = np.sign(trial["r"][part]) * (np.abs(trial["r"][part]) > _SWING * most)
    sides = sides[np.isfinite(sides) & (sides != 0)]
    lasts = float(trial.t[part][-1] - trial.t[part][0])
    swings = int((np.diff(sides) != 0).sum())
    if not 2 <= swings <= lasts / (2.0 * _ship_time(trial)):
        return None
    return float(trial.t[part][0]), float(trial.t[part][-1])


def _step_at(delta: Array, k: int) -> float:
    """Smallest step between values as large as that of row `k`, to a power of ten in degrees [rad].

    A log of so many significant digits has coarser steps from 10 deg on.
    """
    shown = np.abs(delta) / _DEG
    decade = math.floor(math.log10(max(float(shown[k]), 1e-3)))
    steps = np.diff(np.unique(np.round(delta[(shown >= 10.0**decade) & (shown < 10.0 ** (decade + 1))] / _DEG, 6)))
    return float(steps.min()) * _DEG if steps.size else 0.0


# -- lag


@dataclass(frozen=True)
class Lag:
    """How late the rudder was logged, by the yaw that followed.

    Attributes:
        size: the log is late by so much [s].
        error: its standard error, moves of the rudder being independent [s].
        unsure: what the damping of an unknown hull, and the step of the log, leave open [s].
        shown: whether the yaw fits a shifted rudder much better.
    """

    size: float
    error: float
    unsure: float
    shown: bool

    @property
    def told(self) -> bool:
        """Whether neither chance nor the hull explains it."""
        return self.shown and abs(self.size) > self.unsure and abs(self.size) > _CERTAIN * self.error


def rudder_lag(trials: Sequence[Trial]) -> Lag | None:
    """When the rudder must have moved for the yaw that followed: r bends where the rudder moves; None of few moves."""
    dt = median([trial.dt for trial in trials])
    ship_time = median([_ship_time(trial) for trial in trials])
    reach = _REACH * ship_time
    lags = np.linspace(-reach, reach, 2 * math.ceil(reach / (0.2 * ship_time)) + 1)
    found = [_misfit(trial, moves, np.append(lags, 0.0)) for trial in trials if (moves := _moves(trial))]
    if not found or sum(map(len, found)) < _FEWEST:
        return None
    each = np.concatenate(found)
    left, unshifted = each[:, :-1].sum(axis=0), float(each[:, -1].sum())
    k = int(np.argmin(left))
    if not 0 < k < lags.size - 1:
        return None
    width = lags[1] - lags[0]
    bends = (each[:, k + 1] - 2.0 * each[:, k] + each[:, k - 1]) / width**2
    slopes = (each[:, k + 1] - each[:, k - 1]) / (2.0 * width)
    off = -float(slopes.sum() / bends.sum())
    lag = float(lags[k]) + off - _DAMPED * ship_time
    # Rows of one move are alike in what they leave over; the moves are independent (sandwich estimate).
    error = float(np.linalg.norm(slopes + off * bends) / bends.sum())
    return Lag(lag, error, max(0.35 * ship_time, 0.7 * dt), unshifted > 1.5 * left[k])


def _lag(trials: Sequence[Trial]) -> Iterator[Fault]:
    """A lag of the rudder, grossly by its effect, then by where r bends."""
    shown = effect(trials)
    gross = shown.late if shown is not None else 0.0
    long = [trial for trial in trials if trial.duration > 2.0 * abs(gross)]
    moved = [shifted(trial, gross, "delta") if gross else trial for trial in long]
    fine = _whatever_its_length(moved) if moved else None
    if gross and fine and abs(fine.size) > OWN * _ship_time(long[0]):
        fine = None  # the effect leaves no more open than what hulls respond later by: it is noise that a quartic fits
    if not gross and not (fine and fine.told):
        return
    lag, error = gross + (fine.size if fine else 0.0), fine.error if fine else 0.0
    yield Fault(
        "warning", "delta", f"the rudder is {'late' if lag > 0 else 'early'} by {abs(lag):.2g} s",
        f"the yaw fits a rudder {lag:+.3g}{f' +- {error:.1g}' if error else ''} s "
        f"{'before' if lag > 0 else 'after'} the one that was logged",
        step("shift", "delta", amount=(-lag,),
             text="" if lag > 0 else "it is the order: call it delta_cmd; or r is late"), "quality", "lag",
    )  # fmt: skip


def _whatever_its_length(trials: Sequence[Trial]) -> Lag | None:
    """The lag; of a ship of unknown length only where half and twice the usual one tell the same.

    The length decides how long a hull takes to answer, and so how far a quartic is fitted: over the windows of a ship
    of 100 m the yaw of a boat of 24 m is none, and any lag fits it.
    """
    found = rudder_lag(trials)
    if found is None or all(length_of(trial) for trial in trials):
        return found
    others = (rudder_lag([replace(trial, meta={**trial.meta, "L_pp": L}) for trial in trials]) for L in _LENGTHS)
    same = all(one is not None and abs(one.size - found.size) <= found.unsure for one in others)
    return found if same else None


def _misfit(trial: Trial, moves: Sequence[tuple[int, int]], lags: Array) -> Array:
    """Squares left of r about each move by a quartic in time and the rudder `lags` [s] earlier, shape (moves, lags).

    In squares of what the best of the lags leaves of a row of this trial: its noise, and its weight among others.
    """
    rows = np.array([np.arange(a, b) for a, b in moves])
    t = trial.t[rows]
    s = 2.0 * (t - t[:, :1]) / (t[:, -1:] - t[:, :1]) - 1.0
    smooth, _ = np.linalg.qr(s[:, :, None] ** np.arange(5.0))
    turned = integral(trial.t, np.nan_to_num(trial["delta"]))
    both = np.interp(t[:, :, None] + lags, trial.t, turned)
    both = np.concatenate([both, trial["r"][rows][:, :, None]], axis=2)
    both -= smooth @ (smooth.transpose(0, 2, 1) @ both)
    steered, r = both[:, :, :-1], both[:, :, -1:]
    power, product = (steered**2).sum(axis=1), (steered * r).sum(axis=1)
    left = (r**2).sum(axis=1) - product**2 / np.maximum(power, 1e-300)
    least = max(float(left.sum(axis=0).min()), 1e-6 * float((r**2).sum()), 1e-300)
    return np.asarray(left * (rows.size / least))


def _moves(trial: Trial) -> list[tuple[int, int]]:
    """Rows about each move of the rudder going ahead, some ship times to either side."""
    delta, r, dt, ship_time = trial["delta"], trial["r"], trial.dt, _ship_time(trial)
    near = round(ship_time / dt)
    if near < 2 or len(trial) < 8 * near + 20:
        return []  # with a row a ship time, a move has hardly more rows than the quartic has coefficients
    ahead = trial["u"] > 0.3 * float(np.nanmax(np.abs(trial["u"]), initial=0.0))
    if "n_P" in trial:
        ahead &= ~(trial["n_P"] <= 0)
    swing = np.abs(delta[near:] - delta[:-near])
    found: list[tuple[int, int]] = []
    k = 3 * near
    while k < swing.size - 5 * near:
        if swing[k] > 4.0 * _DEG:
            a, b = k - 2 * near, k + 5 * near
            if np.isfinite(r[a:b]).all() and np.isfinite(delta[a - near : b + near]).all() and ahead[a:b].all():
                found.append((a, b))
            k = b
        else:
            k += 1
    return found


# -- port against starboard


def held_angles(trial: Trial) -> list[float]:
    """Rudder angles that were held for some ship times [rad]."""
    delta, dt = trial["delta"], trial.dt
    calm = np.abs(np.diff(delta)) < max(0.3 * _DEG, 4.0 * noise_of(delta))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], calm.astype(np.int8), [0]])))
    least = max(6.0, 1.5 * _ship_time(trial) / dt)
    levels = []
    for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        part = delta[a : b + 1]
        if b - a >= least and np.ptp(part) < 1.0 * _DEG:
            levels.append(median(part))
    return levels


def _straight(trials: Sequence[Trial]) -> list[float]:
    """Mean rudder of straight stretches at the beginning of logs [rad]."""
    found = []
    for trial in trials:
        length = length_of(trial) or 100.0
        u, r, delta = np.abs(trial["u"]), np.abs(trial["r"]), trial["delta"]
        still = (r * length < 0.02 * u) & (np.abs(delta) < 4.0 * _DEG)
        bent = np.flatnonzero(~still)
        rows = int(bent[0]) if bent.size else len(trial)
        if rows >= max(10, 1.5 * _ship_time(trial) / trial.dt):
            found.append(float(np.mean(delta[:rows])))
    return found


def _clusters(levels: Sequence[float]) -> list[float]:
    """Means of levels that are alike."""
    groups: list[list[float]] = []
    for level in sorted(levels):
        if groups and level - groups[-1][-1] < 0.6 * _DEG:
            groups[-1].append(level)
        else:
            groups.append([level])
    return [float(np.mean(group)) for group in groups]


@dataclass(frozen=True)
class Helm:
    """Angles at which the rudder was held in the logs of one ship [rad].

    Attributes:
        starboard, port: held to each side, alike ones once, both as magnitudes.
        straight: means of straight stretches at the beginning of logs.
    """

    starboard: tuple[float, ...]
    port: tuple[float, ...]
    straight: tuple[float, ...]

    @classmethod
    def of(cls, trials: Sequence[Trial]) -> Helm:
        """Of trials that have a rudder, its yaw and the speed."""
        levels = [level for trial in trials for level in held_angles(trial) if abs(level) > 4.0 * _DEG]
        sides = (_clusters([x for x in levels if x > 0]), _clusters([-x for x in levels if x < 0]))
        return cls(tuple(sides[0]), tuple(sides[1]), tuple(_straight(trials)))

    @property
    def pairs(self) -> Array:
        """Angles of both sides that may be of one order, shape (pairs, 2); none where one side has more."""
        even = len(self.starboard) == len(self.port)
        return np.array(list(zip(self.starboard, self.port, strict=True))) if even else np.zeros((0, 2))

    @property
    def ahead(self) -> float:
        """The angle that goes straight; NaN where no log begins so."""
        return median(self.straight) if self.straight else math.nan

    @property
    def offset(self) -> float | None:
        """By which the angles of both sides differ alike and the ship goes straight; None where that does not agree."""
        pairs = self.pairs
        if not pairs.size:
            return self._offset_of_some
        more = pairs[:, 0] - pairs[:, 1]
        offset = 0.5 * median(more)
        agree = abs(self.ahead - offset) < 0.5 * _OFFSET if self.straight else len(pairs) > 1
        return offset if agree and float(np.ptp(more)) < 2.0 * _EVEN and abs(offset) > _OFFSET else None

    @property
    def _offset_of_some(self) -> float | None:
        """The same where one side was ordered angles that the other was not: two at least of those that both were."""
        fewer = min(len(self.starboard), len(self.port))
        if fewer < 2 or not abs(self.ahead) > _OFFSET:
            return None
        apart = np.subtract.outer(np.array(self.starboard), np.array(self.port))
        shared, alike = ((np.abs(apart - 2.0 * one) < 2.0 * _EVEN) for one in (self.ahead, 0.0))
        return 0.5 * median(apart[shared]) if shared.sum() == fewer > alike.sum() else None


def _balance(trials: Sequence[Trial]) -> Iterator[Fault]:
    helm = Helm.of(trials)
    starboard, port, straight = [*helm.starboard], [*helm.port], helm.straight
    pairs, ahead, offset = helm.pairs, helm.ahead, helm.offset
    words = "; ".join(f"held {a / _DEG:.2f} deg to starboard, {b / _DEG:.2f} to port" for a, b in pairs[:4])
    parts = pairs[:, 0] / pairs[:, 1] - 1.0 if len(pairs) else np.zeros(0)
    if offset is not None:
        yield _offset(offset, f"{words}; straight ahead at {ahead / _DEG:+.2f} deg")
    elif (parts.size and abs(median(parts)) > _SIDES and float(np.ptp(parts)) < 0.03 and abs(ahead) < _EVEN
          and max(_roundness(starboard), _roundness(port)) > _ORDERED):
        yield _sided(median(parts), words, _roundness(starboard) <= _roundness(port))
    elif len(straight) >= 3 and abs(ahead) > _NEUTRAL and float(np.ptp(straight)) < _NEUTRAL:
        yield _offset(ahead, f"straight ahead at {ahead / _DEG:+.2f} deg in {len(straight)} trials; or a neutral angle")
    elif (scale := _round_scale([*starboard, *port])) is not None:
        yield Fault(
            "warning", "delta", f"rudder angles are {100 * (scale - 1):+.1f} % off",
            f"held angles of {', '.join(f'{x / _DEG:.1f}' for x in starboard)} deg are {scale:.3f} times round ones",
            times(1.0 / scale, "delta"), "quality", "rudder_scale",
        )  # fmt: skip


def _offset(offset: float, evidence: str) -> Fault:
    return Fault(
        "warning", "delta", f"rudder offset of {offset / _DEG:+.2f} deg", evidence,
        step("add", "delta", amount=(-offset / _DEG,), unit="deg"), "quality", "rudder_offset",
    )  # fmt: skip


_ORDERED = 0.1 * _DEG
"""How near to multiples of five degrees the angles of both sides are where other ones were ordered, and none is off."""


def _roundness(levels: Sequence[float]) -> float:
    """How far the held angles of one side are from multiples of five degrees [rad], the median."""
    return median([abs(x - 5.0 * _DEG * round(x / (5.0 * _DEG))) for x in levels])


def _sided(part: float, words: str, port: bool) -> Fault:
    """The side whose held angles are not round ones is off."""
    return Fault(
        "warning", "delta", f"rudder angles to starboard are {100 * part:+.1f} % off those to port", words,
        step("multiply_port", "delta", amount=(1.0 + part,)) if port
        else step("multiply_starboard", "delta", amount=(1.0 / (1.0 + part),)), "quality", "rudder_sides",
    )  # fmt: skip


def _round_scale(levels: Sequence[float]) -> float | None:
    """Factor by which three or more held angles miss multiples of five degrees, all alike; None without one."""
    angles = np.array(_clusters(levels)) / _DEG
    if angles.size < 3:
        return None

    def off(scale: float) -> float:
        true = angles / scale
        return float(np.max(np.abs(true - 5.0 * np.round(true / 5.0))))

    if off(1.0) < 0.5:
        return None
    scales = np.arange(0.8, 1.2501, 0.0025)
    best = float(scales[int(np.argmin([off(float(scale)) for scale in scales]))])
    return best if off(best) < 0.15 and abs(best - 1.0) > 0.03 else None
