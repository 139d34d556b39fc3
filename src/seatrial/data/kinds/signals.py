"""What a trial shows, prepared to be looked at: speed, heading, rudder, revolutions without gaps, and held values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.ranks import median, quantile
from ...core.values import dataclass
from .. import Array, Trial, unwrapped
from ..prepare import drop_trailing_gaps
from .kind import HARD_OVER

DEGREE = math.pi / 180.0
# More rows than these show nothing more of a manoeuvre.
_ROWS, _LEAST = 20_000, 20
# A mean over so much of the time of a ship length takes the noise out of speeds and rates.
_SMOOTH = 0.25
_CLOCK = (5, 0.04)
# Steps of noise that a held value may leave its mean by, and the least.
_SIGMAS, _FINEST = 4.0, 0.35 * DEGREE
_GAP = 0.2
# Part of the greatest angle that neighbours of one leg differ by while motors creep up to what they are ordered, and
# part that a held one may leave its middle by; how many clocks it lasts at least.
_CREEP, _MOTORS, _LASTS = 0.4, 0.2, 0.75
# Cosine between demand and rate of turn from which on they are opposed; smaller demands than this part may be motors
# that differ.
_AGAINST, _WORTH = 0.4, 0.15
# Thrust from this part of the most on is more than the zero of a motor is off by.
_WORKS = 0.05


class Hold(NamedTuple):
    """A value held from row `first` to row `last`, both included, and its median."""

    first: int
    last: int
    level: float


@dataclass(frozen=True)
class Signals:
    """A trial as the descriptions of kinds see it; every array of shape (samples,), SI units, without gaps.

    Attributes:
        t: time [s].
        psi: heading, continuous [rad].
        r: rate of turn, smoothed [rad/s].
        u, v_m: speeds, smoothed; None without positions or speeds.
        delta: rudder, the mean of several, or the demand of two thrusts (`pair`); None without one.
        n: mean revolutions, or what stands for them; None without any.
        reach: positions north and east, shape (samples, 2); None without.
        L_pp: length of the ship by the sidecar [m]; NaN unknown.
        clock: time in which the ship covers its length [s], or a twenty-fifth of the trial.
        doubts: about the record itself.
        pair: thrusts to port and to starboard as parts of the full one, or revolutions; None without such a pair.
        by_thrust: whether `delta` is theirs.
    """

    t: Array
    psi: Array
    r: Array
    u: Array | None
    v_m: Array | None
    delta: Array | None
    n: Array | None
    reach: Array | None
    L_pp: float
    clock: float
    doubts: tuple[str, ...] = ()
    pair: tuple[Array, Array] | None = None
    by_thrust: bool = False

    @property
    def duration(self) -> float:
        """Length of the trial [s]."""
        return float(self.t[-1] - self.t[0])

    @cached_property
    def U(self) -> Array | None:
        """Speed [m/s]."""
        return None if self.u is None or self.v_m is None else np.hypot(self.u, self.v_m)

    @property
    def top(self) -> float:
        """Highest speed but for the last hundredth of the samples [m/s]; 0 unknown."""
        return 0.0 if self.U is None else quantile(self.U, 0.99)

    @cached_property
    def holds(self) -> tuple[Hold, ...]:
        """Rudder angles that are held, some degrees of wandering allowed."""
        if self.delta is None:
            return ()
        reach = quantile(np.abs(self.delta), 0.98)
        if not self.by_thrust:
            return self.held(self.delta, max(1.0 * DEGREE, 0.06 * reach))
        found = self.held(self.delta, max(1.0 * DEGREE, _MOTORS * reach), 0.0)
        legs = _crept(found, self.delta, _CREEP * reach)
        return tuple(one for one in legs if self.lasts(one) >= _LASTS * self.clock)

    @cached_property
    def fine_holds(self) -> tuple[Hold, ...]:
        """Rudder angles that are held, as finely as noise allows."""
        return () if self.delta is None else self.held(self.delta, 0.0)

    def held(self, values: Array, band: float, least: float = 0.25, finest: float = _FINEST) -> tuple[Hold, ...]:
        """Stretches of at least `least` clocks where values stay within `band` or the noise about their middle."""
        slope = np.diff(values)
        noise = 1.4826 * median(np.abs(slope - median(slope))) / math.sqrt(2.0)
        wide = max(band, _SIGMAS * noise, finest)
        found: list[Hold] = []
        for a, b in pairwise(_breaks(values, 2.0 * wide)):
            if self.t[b - 1] - self.t[a] >= least * self.clock and b - a >= 3:
                found.append(Hold(a, b - 1, median(values[a:b])))
        return _joined(found, values, wide)

    def helm(self, angle: float) -> str:
        """A rudder angle, or a demand of thrusts, in words."""
        if self.by_thrust:
            return f"thrusts {100.0 * angle / HARD_OVER:.0f} % apart"
        return f"rudder {angle / DEGREE:.1f} deg"

    def turned(self, first: int, last: int) -> float:
        """Change of heading between two rows [rad]."""
        return float(self.psi[last] - self.psi[first])

    def lasts(self, hold: Hold) -> float:
        """How long a value is held [s]."""
        return float(self.t[hold.last] - self.t[hold.first])

    @cached_property
    def activity(self) -> tuple[str, ...]:
        """What moved, in words."""
        found: list[str] = [f"heading within {np.ptp(self.psi) / DEGREE:.0f} deg"]
        if self.delta is not None:
            low, high = np.quantile(self.delta, [0.01, 0.99]) / (HARD_OVER / 100.0 if self.by_thrust else DEGREE)
            what, unit = ("steering demand", "%") if self.by_thrust else ("rudder", "deg")
            found.append(f"{what} {low:.0f} to {high:.0f} {unit}, {len(self.holds)} angles held")
        if self.n is not None:
            found.append(f"revolutions {np.min(self.n):.3g} to {np.max(self.n):.3g} 1/s")
        if self.U is not None:
            found.append(f"speed {np.min(self.U):.2g} to {self.top:.2g} m/s")
        return tuple(found)


def signals(trial: Trial, rows: int = _ROWS) -> Signals | str:
    """What some rows of the trial show; a text where it is too little to tell a kind."""
    trial = drop_trailing_gaps(trial)
    if len(trial) < _LEAST:
        return f"{len(trial)} rows are too few"
    trial = trial.rows(slice(None, None, max(1, len(trial) // rows)))
    motion = _motion(trial)
    if motion is None:
        return "no heading, no rate of turn and no positions to tell it from"
    psi, u, v_m, reach = motion
    t, L_pp = trial.t - trial.t[0], _length(trial)
    U = None if u is None or v_m is None else np.hypot(u, v_m)
    clock = _clock(t, U, L_pp)
    width = max(1, round(_SMOOTH * clock / max(median(np.diff(t)), 1e-9)))
    rate = filled(trial["r"]) if "r" in trial and _known(trial["r"]) else np.gradient(smooth(psi, width), t)
    doubts = [f"{name} is missing for {100 * share:.0f} % of the time" for name in ("psi", "delta", "u")
              if name in trial and (share := _missing(trial.t, np.isfinite(trial[name]))) > _GAP]  # fmt: skip
    delta, n, pair = _helm(trial), _engine(trial), _pair(trial)
    by_thrust = delta is None and pair is not None
    if delta is None and pair is not None:
        delta = 0.5 * HARD_OVER * (pair[0] - pair[1])
    r = smooth(rate, width)
    if by_thrust and delta is not None and _opposed(r, delta):
        doubts.append("it turns against its thrusts: are port and starboard exchanged, or their signs?")
    return Signals(
        t, psi, r, None if u is None else smooth(u, width),
        None if v_m is None else smooth(v_m, width), delta, n, reach, L_pp, clock,
        (*doubts, *(() if delta is not None else ("no rudder is recorded: told from the motion alone",))),
        pair, by_thrust,
    )  # fmt: skip


def _missing(t: Array, read: NDArray[np.bool_]) -> float:
    """Share of the time without a reading; what lies between two readings of a slower instrument is none."""
    if not read.any():
        return 1.0
    ends = np.concatenate([t[:1], t[read], t[-1:]])
    gaps = np.diff(ends)
    usual = median(gaps[1:-1]) if read.sum() > 2 else median(np.diff(t))
    return float(gaps[gaps > 1.5 * usual].sum() / (t[-1] - t[0]))


def driven(trial: Trial) -> Trial:
    """A craft that thrusts steer from shortly before the first thrust to half as long again: rest is no course."""
    pair = _pair(trial)
    if pair is None or _helm(trial) is not None:
        return trial
    works = np.flatnonzero(np.maximum(*np.abs(pair)) > _WORKS * quantile(np.abs(pair), 0.99))
    first, last = trial.t[works[0]], trial.t[works[-1]]
    span = max(float(last - first), _LEAST * trial.dt)
    return trial.rows((trial.t >= first - 0.1 * span) & (trial.t <= last + 0.5 * span))


def both_ways(seen: Signals) -> bool:
    """Whether the engine is worked both ways, ahead and astern."""
    if seen.n is None:
        return False
    low, high = quantile(seen.n, 0.02), quantile(seen.n, 0.98)
    return bool(low < -0.2 * high)


def smooth(values: Array, width: int) -> Array:
    """Running mean over `width` samples, the ends by fewer."""
    if width < 2:
        return values
    total = np.concatenate([[0.0], np.cumsum(values)])
    half, count = width // 2, values.size
    low, high = np.maximum(np.arange(count) - half, 0), np.minimum(np.arange(count) + half + 1, count)
    return (total[high] - total[low]) / (high - low)


def filled(values: Array) -> Array:
    """Gaps closed by straight lines."""
    good = np.isfinite(values)
    return np.interp(np.arange(values.size), np.flatnonzero(good), values[good])


def _motion(trial: Trial) -> tuple[Array, Array | None, Array | None, Array | None] | None:
    """Heading, speeds in body axes and positions, as far as they are there; None without anything that turns."""
    where = all(name in trial and _known(trial[name]) for name in ("x", "y"))
    reach = np.column_stack([filled(trial["x"]), filled(trial["y"])]) if where else None
    t = trial.t
    if "psi" in trial and _known(trial["psi"]):
        psi = unwrapped(filled(trial.heading))
    elif "r" in trial and _known(trial["r"]):
        rate = filled(trial["r"])
        psi = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])
    elif reach is not None:
        psi = np.unwrap(np.arctan2(*np.gradient(reach, t, axis=0).T[::-1]))
    else:
        return None
    if "u" in trial and _known(trial["u"]):
        sway = filled(trial["v_m"]) if "v_m" in trial and _known(trial["v_m"]) else np.zeros(t.size)
        return psi, filled(trial["u"]), sway, reach
    if reach is None:
        return psi, None, None, None
    north, east = np.gradient(reach, t, axis=0).T
    return psi, north * np.cos(psi) + east * np.sin(psi), east * np.cos(psi) - north * np.sin(psi), reach


def _helm(trial: Trial) -> Array | None:
    """Mean of the rudders as they were, or as ordered where only that is logged [rad]."""
    return _mean(trial, "delta")


def _engine(trial: Trial) -> Array | None:
    """Mean of the revolutions, or of what stands for them."""
    return next((found for kind in ("n", "f", "throttle") if (found := _mean(trial, kind)) is not None), None)


def _pair(trial: Trial) -> tuple[Array, Array] | None:
    """Two thrusts, one on either side, as parts of the full one; of revolutions and newtons the greatest is full."""
    for kind in ("throttle", "f", "n_P", "n"):
        for sides in (("port", "starboard"), ("1", "2")):
            names = [f"{kind}_{side}" for side in sides]
            names = names if all(name in trial for name in names) else [f"{name}_cmd" for name in names]
            if sides[0] == "1" and kind != "n_P":
                continue  # numbers of thrusters are no sides
            if all(name in trial and _known(trial[name]) for name in names):
                port, starboard = (filled(trial[name]) for name in names)
                most = max(quantile(np.abs(one), 0.99) for one in (port, starboard))
                full = 1.0 if kind == "throttle" else most
                return (port / full, starboard / full) if most > 0 else None
    return None


def _mean(trial: Trial, kind: str) -> Array | None:
    every = [name for name in trial.channels if name.partition("_")[0] == kind and _known(trial[name])]
    names = [name for name in every if not name.endswith("_cmd")] or every
    return np.mean([filled(trial[name]) for name in names], axis=0) if names else None


def _known(values: Array) -> bool:
    return int(np.isfinite(values).sum()) >= _LEAST


def _length(trial: Trial) -> float:
    told = trial.meta.get("L_pp")
    return float(told) if isinstance(told, int | float) and not isinstance(told, bool) and told > 0 else math.nan


def _clock(t: Array, U: Array | None, L_pp: float) -> float:
    """L/U, at least some samples, at most a twenty-fifth of the trial."""
    most = max(_CLOCK[1] * float(t[-1]), 1e-9)
    if U is None or not math.isfinite(L_pp) or not (fast := quantile(U, 0.999)) > 0:
        return most
    return float(np.clip(L_pp / fast, min(_CLOCK[0] * median(np.diff(t)), most), most))


def _breaks(values: Array, wide: float) -> list[int]:
    """Rows at which a stretch begins whose values lie within `wide` of each other, and the end."""
    # A single reading beside its neighbours is a spike, not the end of a stretch.
    calm = values.copy()
    before, here, after = values[:-2], values[1:-1], values[2:]
    calm[1:-1] = np.maximum(np.minimum(before, here), np.minimum(np.maximum(before, here), after))  # their median
    starts, low, high = [0], math.inf, -math.inf
    for k, value in enumerate(calm.tolist()):
        if value < low:
            low = value
        if value > high:
            high = value
        if high - low > wide:
            starts.append(k)
            low = high = value
    return [*starts, values.size]


def _crept(holds: Sequence[Hold], values: Array, near: float) -> tuple[Hold, ...]:
    """Neighbours to one side that differ by less than `near` as one, of the level that they creep up to."""
    out: list[Hold] = []
    for one in holds:
        if out and one.level * out[-1].level > 0 and abs(one.level - out[-1].level) < near:
            one = Hold(out.pop().first, one.last, one.level)
        size = np.abs(values[one.first : one.last + 1])
        out.append(one._replace(level=math.copysign(quantile(size, 0.75), one.level)))
    return tuple(out)


def _opposed(r: Array, demand: Array) -> bool:
    """Whether a craft turns against a demand that is more than motors differ by."""
    sized = quantile(np.abs(demand), 0.98) > _WORTH * HARD_OVER
    return sized and bool(r @ demand < -_AGAINST * np.linalg.norm(r) * np.linalg.norm(demand))


def _joined(holds: Sequence[Hold], values: Array, wide: float) -> tuple[Hold, ...]:
    """Neighbours of the same value as one, with what lies between if it stays near."""
    out: list[Hold] = []
    for one in holds:
        if out and abs(one.level - out[-1].level) < wide:
            between = values[out[-1].last : one.first + 1]
            if median(np.abs(between - one.level)) < 2.0 * wide:
                first = out.pop().first
                one = Hold(first, one.last, median(values[first : one.last + 1]))
        out.append(one)
    return tuple(out)
