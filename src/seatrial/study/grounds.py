"""What a fit stands on: its trials with their digests, the ranges that they cover, and what they tested together.

Kept in fit.json, so that the place where a model holds is known when its trials are not at hand any more.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, pairwise
from typing import Annotated

import numpy as np

from ..core.records import Limits
from ..core.values import dataclass, field
from ..data import Array, Trial
from ..data.kinds import recognised
from ..manoeuvres.reading import through_water

_End = Annotated[float, Limits(null=math.inf)]
Ranges = Mapping[str, tuple[_End, _End]]
"""Lowest and highest value of each channel, SI units; null in a file is infinite (deep water)."""

DRIFT = "drift"
"""Angle of drift at midship, atan2(-v_m, u) [rad]."""

# So many of the samples at either end are outliers; a range reaches so much of its width, or of its greatest value,
# beyond the others.
_OUTLIERS, _MARGIN, _SAME = 1e-3, 0.1, 0.05
# Directions in which a hull reaches farthest: between two of them it is cut by 0.9 % of its half width at most.
_DIRECTIONS = 24
# So many pairs of channels outside of what was tested together are told.
_TOLD = 2
# Drift and rate of turn over speed mean nothing below this share of the greatest speed.
_SLOW = 0.1
# What a trial that does not log it is taken to have: still air, no waves, deep water.
_USUAL = {"U_T": 0.0, "H_S": 0.0, "depth": math.inf}
DRAUGHT = "draught"
"""Loading of a trial as its sidecar tells it, mean draught [m]."""
SURROUNDINGS = (*_USUAL, DRAUGHT)
"""Channels of ranges that are no motion of the ship and no control."""


@dataclass(frozen=True)
class Used:
    """A trial of a study: its role ("fit", "validation", "kept back"), samples, length [s], and digest."""

    name: str
    role: str
    kind: str
    rows: int
    duration: float
    digest: str
    source: str = ""


@dataclass(frozen=True)
class Plane:
    """What was tested of two channels together.

    Ranges of each channel by itself call tested what no trial had: the speed of the approach with the rate of turn that
    a ship has only where a turn has slowed it.

    Attributes:
        x, y: the channels.
        corners: of their convex hull, counterclockwise, SI units.
    """

    x: str
    y: str
    corners: tuple[tuple[float, float], ...]

    def excess(self, x: Array, y: Array, slack: tuple[float, float]) -> Array:
        """How far points lie outside of the hull, over the slack; up to 1 they lie within a slack of a tested point.

        Args:
            x, y: the points, shape (points,).
            slack: of x and y, above zero.
        """
        ends = np.array([*self.corners, self.corners[0]])
        over = np.full(len(x), -np.inf)
        for (x_0, y_0), (x_1, y_1) in pairwise(ends.tolist()):
            a, b = y_1 - y_0, x_0 - x_1
            reach = abs(a) * slack[0] + abs(b) * slack[1]
            if reach > 0.0:
                over = np.maximum(over, (a * (x - x_0) + b * (y - y_0)) / reach)
        return over

    def across(self, x: float) -> tuple[float, float]:
        """Lowest and highest tested y at x, or at the tested x that is nearest to it."""
        ends = np.array([*self.corners, self.corners[0]])
        at = min(max(x, float(ends[:, 0].min())), float(ends[:, 0].max()))
        met: list[float] = []
        for (x_0, y_0), (x_1, y_1) in pairwise(ends.tolist()):
            if min(x_0, x_1) <= at <= max(x_0, x_1):
                share = (at - x_0) / (x_1 - x_0) if x_1 != x_0 else 0.0
                met += [y_0 + share * (y_1 - y_0)] + [y_1] * (x_1 == x_0)
        return min(met), max(met)


@dataclass(frozen=True)
class Grounds:
    """What a fit stands on; all empty of a fit of before it was kept.

    Attributes:
        trials: of the study.
        kinds, covered: of manoeuvre and of each channel, of the trials of the fit.
        tested: motion and controls that they had together.
        made: velocities that did not count beside the track and the heading that they were made of.
    """

    trials: tuple[Used, ...] = ()
    kinds: tuple[str, ...] = ()
    covered: Ranges = field(default_factory=dict[str, tuple[float, float]])
    tested: tuple[Plane, ...] = ()
    made: tuple[str, ...] = ()

    def beyond(self, run: Trial, controls: Sequence[str]) -> tuple[Beyond, ...]:
        """Where a run leaves the trials of the fit: channels by themselves, then pairs not tested together."""
        return self.left_by(_channels(run, controls))

    def left_by(self, values: Mapping[str, Array]) -> tuple[Beyond, ...]:
        """The same for values of channels; those of motion and controls are of one shape (samples,)."""
        alone = _beyond(self.covered, values)
        names = {one.channel for one in alone}
        return *alone, *_apart(self, {name: some for name, some in values.items() if name not in names})

    def digests(self, role: str) -> dict[str, str]:
        """Digest by name of the trials of a role."""
        return {one.name: one.digest for one in self.trials if one.role == role}


@dataclass(frozen=True)
class Beyond:
    """A channel of a run that leaves the range of the trials of the fit, SI units.

    Attributes:
        covered: by the trials.
        reached: in the run.
        beside: another channel and its value, with which the trials covered no more; empty where it is of none.
    """

    channel: str
    covered: tuple[float, float]
    reached: tuple[float, float]
    beside: tuple[tuple[str, float], ...] = ()

    @property
    def times(self) -> float:
        """How many times as far as the trials the run goes, of a motion or control by itself; 1 of others.

        Ships are alike on both sides, so the greater end counts for both.
        """
        if self.beside or self.channel in SURROUNDINGS:
            return 1.0
        most = max(map(abs, self.covered))
        return max(max(map(abs, self.reached)) / most, 1.0) if most > 0.0 else math.inf


def trial_digest(trial: Trial) -> str:
    """Fingerprint of the times and channels of a trial, whatever its name."""
    found = hashlib.sha256(trial.t.tobytes())
    for name in sorted(trial.channels):
        found.update(name.encode() + trial[name].tobytes())
    return found.hexdigest()[:16]


def grounds(
    train: Sequence[Trial], validation: Sequence[Trial], test: Sequence[Trial], controls: Sequence[str]
) -> Grounds:  # fmt: skip
    """Trials by role, and the ranges and kinds of those of the fit.

    Args:
        controls: of the model.
    """
    roles = {"fit": train, "validation": validation, "kept back": test}
    trials = tuple(_used(trial, role) for role, some in roles.items() for trial in some)
    kinds = sorted({one.kind for one in trials if one.role == "fit"})
    return of_trials(train, controls, trials, kinds)


def of_trials(
    train: Sequence[Trial], controls: Sequence[str], used: Sequence[Used] = (), kinds: Sequence[str] = ()
) -> Grounds:  # fmt: skip
    """What trials cover and test together."""
    found, ranges = [_channels(trial, controls) for trial in train], covered(train, controls)
    names = [name for name in ("u", "v_m", "r", *controls) if all(name in one for one in found)]
    pools = {name: np.concatenate([one[name] for one in found]) for name in names} if found else {}
    slack = {name: (*ends, _slack(ends)) for name, ends in ranges.items()}
    return Grounds(tuple(used), tuple(kinds), ranges, planes(pools, slack))


def _used(trial: Trial, role: str) -> Used:
    return Used(trial.name, role, kind_of(trial), len(trial), trial.duration, trial_digest(trial),
                str(trial.meta.get("source", "")))  # fmt: skip


def kind_of(trial: Trial) -> str:
    """Kind of manoeuvre as the data show it; as the sidecar says where they show none."""
    found = recognised(trial).name
    told = str(trial.meta.get("kind", "")) or found
    return told if found in ("unknown", "mixed") else found


def covered(trials: Sequence[Trial], controls: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Range of each channel over all trials, without a thousandth of outliers at either end, with a margin."""
    pools: dict[str, list[Array]] = {}
    for trial in trials:
        for name, values in _channels(trial, controls).items():
            pools.setdefault(name, []).append(values)
    found = {name: _range(np.concatenate(some)) for name, some in pools.items()}
    return {name: span for name, span in found.items() if span is not None}


def _beyond(found: Ranges, run: Mapping[str, Array]) -> tuple[Beyond, ...]:
    """Channels that leave their ranges by themselves."""
    out: list[Beyond] = []
    for name, values in run.items():
        known = values[~np.isnan(values)]
        if name not in found or not known.size:
            continue
        (low, high), slack = found[name], _slack(found[name])
        reached = float(known.min()), float(known.max())
        if reached[0] < low - slack or reached[1] > high + slack:
            out.append(Beyond(name, (low, high), reached))
    return tuple(out)


def _apart(found: Grounds, run: Mapping[str, Array]) -> Iterator[Beyond]:
    """Pairs of channels farthest outside of what was tested together, the farthest first."""
    met: list[tuple[float, Beyond]] = []
    for one in found.tested:
        if one.x not in run or one.y not in run or one.x not in found.covered or one.y not in found.covered:
            continue
        over = one.excess(run[one.x], run[one.y], (_slack(found.covered[one.x]), _slack(found.covered[one.y])))
        far = int(np.argmax(np.where(np.isnan(over), -np.inf, over))) if over.size else 0
        if over.size and over[far] > 1.0:
            x, y = float(run[one.x][far]), float(run[one.y][far])
            met.append((float(over[far]), Beyond(one.y, one.across(x), (y, y), ((one.x, x),))))
    met.sort(key=lambda pair: -pair[0])
    yield from (pair[1] for pair in met[:_TOLD])


def _slack(ends: tuple[float, float]) -> float:
    """How far beyond a range its trials still hold."""
    size = max(abs(end) for end in ends)
    return max(_MARGIN * (ends[1] - ends[0]), _SAME * size, 1e-9) if math.isfinite(size) else 0.0


def planes(channels: Mapping[str, Array], ranges: Mapping[str, tuple[float, float, float]]) -> tuple[Plane, ...]:
    """The hull in each plane of two channels, in their order.

    Args:
        channels: values of each, all of one shape (samples,); NaN where there is none.
        ranges: of each channel, with the slack beyond it; samples outside of both are outliers.
    """
    kept: dict[str, Array] = {}
    for name, values in channels.items():
        if name in ranges:
            low, high, slack = ranges[name]
            near = (values >= low - slack) & (values <= high + slack)
            kept[name] = np.where(near, np.clip(values, low, high), np.nan)
    found = ((x, y, tuple(_corners(kept[x], kept[y]))) for x, y in combinations(kept, 2))
    return tuple(Plane(x, y, corners) for x, y, corners in found if corners)


def _corners(x: Array, y: Array) -> Iterator[tuple[float, float]]:
    """The points that lie farthest in each direction, each once, counterclockwise."""
    known = np.isfinite(x) & np.isfinite(y)
    x, y = x[known], y[known]
    if not x.size:
        return
    along, up = ((one - one.min()) / (float(np.ptp(one)) or 1.0) for one in (x, y))
    angles = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    far = (int(np.argmax(along * np.cos(angle) + up * np.sin(angle))) for angle in angles)
    yield from dict.fromkeys((float(x[k]), float(y[k])) for k in far)


def _channels(trial: Trial, controls: Sequence[str]) -> dict[str, Array]:
    """What a range is kept of, by name: motion through the water, controls as they act, draught, wind, waves, depth."""
    found = {name: trial[name] for name in ("u", "v_m", "r", *controls) if name in trial}
    if "u" in trial and "v_m" in trial:
        found["u"], found["v_m"] = u, v_m = through_water(trial)
        speed = np.hypot(u, v_m)
        fast = speed > _SLOW * np.nanmax(speed, initial=0.0)
        found[DRIFT] = np.where(fast, np.arctan2(-v_m, u), np.nan)
    loaded = trial.meta.get(DRAUGHT)
    if isinstance(loaded, int | float) and math.isfinite(loaded):
        found[DRAUGHT] = np.full(1, float(loaded))
    around = {name: trial[name] if name in trial else np.full(1, usual) for name, usual in _USUAL.items()}
    return found | {name: np.where(np.isnan(values), _USUAL[name], values) for name, values in around.items()}


def _range(values: Array) -> tuple[float, float] | None:
    known = values[~np.isnan(values)]
    if not known.size:
        return None
    if np.isinf(known).any():
        return float(known.min()), float(known.max())
    low, high = np.quantile(known, (_OUTLIERS, 1.0 - _OUTLIERS))
    return float(low), float(high)
