"""The sea in the readings of a twin: found while it settles, taken as an oscillator, and followed as it changes."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np

from ...core.values import dataclass, field, replace
from ...data import Array
from ...identify.filters.augmented import WAVES
from .faults.cases import Kept
from .follow import Follower, Machine, Step, begun
from .settings import SPEED, VELOCITY, Seaway
from .tally import Tally

# Waves are what changes within this share of L/U; a sensor is rougher than stated from this variance ratio on.
_WITHIN, _ROUGHER = 0.5, 1.5
_FEWEST = 30
# A glitch counts as so many times the median of the squares at most.
_MOST = 12.0
# Compass and gyro show the same yaw where its rate and theirs correlate by so much, in means over this share of L/U.
_SAME, _MEAN = 0.5, 0.05
# A motion that is not seen is so large at least, as a share of the noise of speeds and of the other motion.
_UNSEEN = 0.5
# A sea is no narrower and no wider than this, as a damping ratio.
_DAMPED = (0.05, 0.4)


@dataclass
class Roughness:
    """What the sensors show of first-order waves, which the model does not have, while the twin settles.

    Waves change within less than a length; what a wrong model or a wrong sensor leaves lasts longer, and stays in the
    innovations.  Yaw in waves is what compass and rate gyro agree on; its frequency is the ratio of both, and what
    position and velocity show beside it has the same.  What does not agree is noise.
    """

    machine: Machine
    _seen: dict[str, list[tuple[float, float, float]]] = field(
        default_factory=dict[str, list[tuple[float, float, float]]]
    )

    def note(self, step: Step) -> None:
        """Note the innovations of a row, those of places and velocities along the ship's axes."""
        channels, psi = self.machine.channels, float(step.before[2])
        said = {channels[k]: float(off) for k, off in zip(step.rows, step.innovation, strict=True)}
        stated = {channels[k]: float(one) for k, one in zip(step.rows, np.diagonal(step.spread), strict=True)}
        c, s = math.cos(psi), math.sin(psi)
        for a, b in (("x", "y"), ("v_north", "v_east")):
            if a in said and b in said:
                said |= {a: said[a] * c + said[b] * s, b: said[b] * c - said[a] * s}
        for name, off in said.items():
            self._seen.setdefault(name, []).append((step.t, off, stated[name]))

    def found(self) -> Seaway:
        """The sea; of no waves and no noise where all is as stated."""
        sensors = self.machine.settings.sensors
        excess = {channel: self._excess(channel) for one in sensors.values() for channel in one.channels}
        yaw, rate = excess.get("psi", 0.0), excess.get("r", 0.0)
        means = self._means("psi", "r") if min(yaw, rate) > 0.0 else None
        if means is None or not _yaws(*means[1:]):
            most = ((name, one.sd, max(excess[channel] for channel in one.channels)) for name, one in sensors.items())
            return Seaway(noise={name: math.sqrt(sd**2 + more) for name, sd, more in most if more > 0.0})
        omega = _frequency(*means)
        # a moving mean over the span takes a part of a sine with it, or adds one
        half = 0.5 * omega * _WITHIN * self.machine.unit
        kept = (1.0 - math.sin(half) / half) ** 2
        excess = {name: one / kept for name, one in excess.items()}
        yaw = math.sqrt(excess["psi"] * excess["r"]) / omega
        size = {"wave.psi": math.sqrt(yaw)}
        moved, (ahead, aside) = dict[str, float](), self.machine.settings.antenna
        for name, lever, place, velocity in (("wave.x", aside, "x", "v_north"), ("wave.y", ahead, "y", "v_east")):
            known = excess[velocity] / omega**2 if velocity in excess else excess.get(place, 0.0)
            # the antenna moves with the yaw as well
            moved[name] = math.sqrt(max(known - lever**2 * yaw, 0.1 * known))
        # on another course, surge and sway that are not seen yet will be
        told = [one.sd for name, one in sensors.items() if name in (VELOCITY, SPEED)]
        least = max(_UNSEEN * min(told, default=0.0) / omega, _UNSEEN * max(moved.values()))
        size |= {name: max(one, least) for name, one in moved.items() if least > 0.0}
        return Seaway(omega, _damping(omega, *means), size)

    def _quick(self, channel: str) -> tuple[Array, Array, Array, float] | None:
        """Times, what changes quickly, the readings that each is held against, and their stated variance."""
        seen = self._seen.get(channel, [])
        if len(seen) < _FEWEST:
            return None
        t, off, variance = np.array(seen).T
        span = _WITHIN * self.machine.unit
        first, last = np.searchsorted(t, t - 0.5 * span), np.searchsorted(t, t + 0.5 * span, "right")
        sums, count = np.concatenate([[0.0], np.cumsum(off)]), last - first
        some = count > 2
        if some.sum() < _FEWEST:
            return None
        return t[some], (off - (sums[last] - sums[first]) / count)[some], count[some], float(np.median(variance[some]))

    def _excess(self, channel: str) -> float:
        """Variance of what changes quickly beyond that of the readings; 0 where it is as stated."""
        quick = self._quick(channel)
        if quick is None:
            return 0.0
        _, off, count, stated = quick
        # a mean of so many readings takes its share of their variance away
        square = off**2 / (1.0 - 1.0 / count)
        found = float(np.mean(np.minimum(square, _MOST * np.median(square))))
        return found - stated if found > _ROUGHER * stated else 0.0

    def _means(self, *channels: str) -> tuple[float, *tuple[Array, ...]] | None:
        """Width of equal spans of time [s], and means in them of what changes quickly, NaN where nothing was read."""
        quick = [one for name in channels if (one := self._quick(name)) is not None]
        if len(quick) < len(channels):
            return None
        width = max(_MEAN * self.machine.unit, *(1.01 * float(np.median(np.diff(one[0]))) for one in quick))
        grid = np.arange(max(one[0][0] for one in quick), min(one[0][-1] for one in quick), width)
        out = list[Array]()
        for t, off, *_ in quick:
            place = np.digitize(t, grid)
            count = np.bincount(place, minlength=grid.size + 1)[1:-1]
            out.append(np.bincount(place, off, grid.size + 1)[1:-1] / np.where(count, count, np.nan))
        return width, *out


def _yaws(psi: Array, r: Array) -> bool:
    """Whether the heading of the compass is the integral of the rate of the gyro, in what changes quickly."""
    return _together(psi[2:] - psi[:-2], r[1:-1]) > _SAME


def _together(a: Array, b: Array) -> float:
    """Correlation of two series with gaps; 0 where few have both."""
    both = np.isfinite(a + b)
    return float(np.corrcoef(a[both], b[both])[0, 1]) if both.sum() >= _FEWEST else 0.0


def _frequency(width: float, psi: Array, r: Array) -> float:
    """Mean frequency about the peak of the spectrum [rad/s], which a filter before it does not move."""
    power, omega = np.zeros(psi.size // 2 + 1), 2.0 * math.pi * np.fft.rfftfreq(psi.size, width)
    for one in (psi, r):
        found = np.abs(np.fft.rfft(np.where(np.isfinite(one), one, 0.0))) ** 2
        power += found / max(float(found.sum()), 1e-300)
    peak = float(omega[int(np.argmax(np.convolve(power, np.ones(5), "same")))])
    near = (omega > 0.5 * peak) & (omega < 2.0 * peak)
    return float((omega * power)[near].sum() / power[near].sum())


def _damping(omega: float, width: float, psi: Array, r: Array) -> float:
    """Damping ratio of the yaw: its correlations with itself and with its rate fall off as exp(-damping omega t).

    The sum of the squares of all four is exp(-2 damping omega t) up to terms of the damping squared.
    """
    lags = np.arange(1, max(round(math.pi / (omega * width)), 3) + 1)
    fall = [0.5 * sum(_together(a[k:], b[:-k]) ** 2 for a in (psi, r) for b in (psi, r)) for k in lags.tolist()]
    slope = 0.5 * np.polyfit(lags * width * omega, np.log(np.maximum(fall, 1e-3)), 1)[0]
    return float(np.clip(-slope, *_DAMPED))


# The noise that drives the waves follows the innovations of so many periods, by no more than these factors in all.
_FOLLOWS, _LEAST, _MOST_DRIVEN = 10.0, 0.02, 100.0
# An outlier counts as so many squared standard deviations.
_CLIPPED = 9.0
_YAW, _PLACE, _SPEEDS = ("psi", "r"), ("x", "y"), ("v_north", "v_east", "u_w")


@dataclass
class Swell:
    """Noise that drives the waves, followed as courses and seas change: innovations are to be as large as expected.

    A step or a drift is nothing that such an oscillator has, so neither is hidden by it.

    Attributes:
        sea: as it is now; of no size and no noise in calm water.
        since: when the noise was last set [s].
        driven: by how much the noise of yaw, and of the other motions, is what it was at first.
    """

    sea: Seaway = field(default_factory=Seaway)
    since: float = -math.inf
    driven: list[float] = field(default_factory=lambda: [1.0, 1.0])
    _sums: list[list[float]] = field(default_factory=lambda: [[0.0, 0.0], [0.0, 0.0]])

    def note(self, step: Step, masked: Collection[int], machine: Machine) -> Machine:
        """Note a row; the machine as it is from here on, another one now and then."""
        variance = np.diagonal(step.spread)
        groups = _YAW, _SPEEDS if any(name in machine.channels for name in _SPEEDS) else _PLACE
        for k, off, spread in zip(step.rows.tolist(), step.innovation.tolist(), variance.tolist(), strict=True):
            group = next((g for g, names in enumerate(groups) if machine.channels[k] in names), None)
            if group is not None and k not in masked:
                self._sums[group][0] += min(off**2 / spread, _CLIPPED)
                self._sums[group][1] += 1.0
        if step.t - self.since < _FOLLOWS * self.sea.period:
            return machine
        return self.turned(step.t, machine)

    def turned(self, t: float, machine: Machine) -> Machine:
        """The machine with the noise that the rows since the last time ask for."""
        density, self.since = machine.density.copy(), t
        for group, (sum_of, count) in enumerate(self._sums):
            if count >= _FEWEST:
                before = self.driven[group]
                self.driven[group] = min(max(before * sum_of / count, _LEAST), _MOST_DRIVEN)
                grown = self.driven[group] / before
                some = [name for name in self.sea.size if (name == "wave.psi") == (group == 0)]
                density[[machine.names.index(WAVES[name]) for name in some]] *= grown
                more = {name: self.sea.size[name] * math.sqrt(grown) for name in some}
                self.sea = replace(self.sea, size={**self.sea.size, **more})
            self._sums[group] = [0.0, 0.0]
        return replace(machine, density=density)


def settled(machine: Machine, swell: Swell, rows: Sequence[Kept], gap: float) -> tuple[Follower, Tally]:
    """The estimate after the rows in which the sea was found, begun again in it: what was learnt without it is wrong.

    Args:
        machine: in the sea of `swell`, which follows the rows.
        gap: from so long on the motion begins anew [s].
    """
    tally, swell.since, follower = Tally(), rows[0].t, begun(machine, rows[0].t, rows[0].readings)
    for row in rows[1:]:
        if row.t - follower.t > gap:
            follower = begun(machine, row.t, row.readings)
            continue
        follower, step = follower.row(row.t, row.acting, row.readings)
        tally.note(row.t, step.nis, int(step.taken.sum()))
        machine = swell.note(step, (), machine)
        follower = replace(follower, machine=machine)
    return follower, tally
