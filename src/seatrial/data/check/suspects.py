"""Who is the odd one out: causes compete to explain what track, heading, rates and speeds leave over of each other.

Each suspect is a repair of the log: of a sign, of axes, of a unit, or by an amount that is fitted.  The one after which
least is left over is named, once, with its size; the log is repaired by it, and the rest is judged again.  Suspects
that explain the same are named together, unless a third witness decides (`_third_witness`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from ...core.values import dataclass, replace
from .. import Array, Trial
from .relations import Window, has, joined, left_over, window_of
from .repairs import Repair, Suspect, gross
from .sensors import Fault
from .sizes import FITTED, Make, length

# A gross suspect must leave at most this part of the squares, and there must be this much to explain (rms in noise).
_GROSS, _MUCH = 0.1, 4.0
# ... and these parts of what was moved, of the track and of the heading.
_ASTRAY, _TURNED = 0.04, 0.25
# A fine one must take away this part of what is beyond noise, and be this many standard errors from none.
_SHARE, _SURE = 0.5, 8.0
_QUIET = 0.3
# One of a size that instruments seldom have must leave this part of the squares that the best of the others leaves.
_DECISIVE = 0.25
# What one log shows is told of another if it is as large there, to this part, and so many standard errors from none.
_ALIKE, _SHARED = 0.3, 4.0
# Suspects whose logarithm of the squares differ by less than this part of the windows are told together.
_TIE = 0.02
_ROUNDS = 3
# Without any explanation it is told from this many times the noise on.
_LOST = 60.0
_ROWS, _WINDOWS, _TRIALS = 16, 60, 6


@dataclass(frozen=True)
class _Rival:
    """A suspect, the squares that it leaves over, the suspect with its size from the repaired logs, and its causes."""

    left: float
    suspect: Suspect
    refined: Callable[[], Suspect]
    fitted: Mapping[str, float]


@dataclass(frozen=True)
class Named:
    """A fault that was named, the repair of it, and the sizes of its causes where they were fitted."""

    fault: Fault
    repair: Repair | None
    fitted: Mapping[str, float]

    def shared_by(self, left: Window | None) -> bool:
        """Whether what a log leaves over has the same causes, as large."""
        found = Normal.of(left).fit([*self.fitted]) if left and self.fitted else None
        if found is None:
            return False
        sizes = np.array([*self.fitted.values()])
        k = int(np.argmax(np.abs(sizes)))
        alike = bool((np.abs(np.array(found[0]) - sizes) < _ALIKE * abs(sizes[k])).all())
        return alike and abs(found[0][k]) > _SHARED * found[1][k]


@dataclass(frozen=True)
class Judged:
    """What some trials of one ship have in common.

    Attributes:
        named: faults of channels, the gravest first.
        trials: repaired.
        left: what each of them leaves over then; None where it has no two sources.
    """

    named: list[Named]
    trials: list[Trial]
    left: list[Window | None]

    @property
    def faults(self) -> list[Fault]:
        """Those that were named."""
        return [one.fault for one in self.named]

    @property
    def differing(self) -> list[int]:
        """Indices of trials of which the track, or the heading, fits much worse than that of the others."""
        found: set[int] = set()
        for part in (slice(0, 2), slice(2, 3)):
            own = [_rms(one.left[:, part]) if one else 0.0 for one in self.left]
            usual = float(np.median([one for one in own if one] or [0.0]))
            found |= {k for k, one in enumerate(own) if one > max(1.5 * usual, 1.5)}
        return sorted(found)


def accused(trials: Sequence[Trial]) -> Judged:
    """Faults of channels that some trials of one ship have in common."""
    repaired = list(trials)
    found: list[Named] = []
    left = [left_over([trial]) for trial in repaired]
    for _ in range(_ROUNDS):
        worst = _worst(repaired, left, {(one.fault.key, one.fault.channels) for one in found})
        if worst is None:
            break
        found.append(worst)
        if worst.repair is None:
            break
        repaired = [worst.repair(trial) for trial in repaired]
        left = [left_over([trial]) for trial in repaired]
    return Judged(found, repaired, left)


def _worst(
    trials: Sequence[Trial], left: Sequence[Window | None], told: set[tuple[str, tuple[str, ...]]]
) -> Named | None:
    now = joined([one for one in left if one])
    if now is None or (rms := _rms(now.left)) < _QUIET:
        return None
    rivals = [*_gross(trials)] if rms > _MUCH and _astray(now) else []
    rivals += [one for one in _fine(trials, now) if (one.suspect.key, one.suspect.channels) not in told]
    if not rivals:
        return Named(_unexplained(rms), None, {}) if _gross_misfit(trials, left) and not told else None
    rivals = sorted(_heard(rivals), key=lambda one: one.left)
    best = rivals[0].left
    even = [one for one in rivals if math.log(one.left / best) < _TIE]
    if not np.isfinite(now.left[:, :2]).any():  # psi and r alone: either may be the one
        kind = even[0].suspect.kind
        either = [one for one in rivals if one.suspect.channels in (("psi",), ("r",)) and one.suspect.kind == kind]
        even = [next((one for one in either if one.suspect.channels == own), even[0]) for own in (("psi",), ("r",))]
    named = _third_witness(trials, [one.refined() for one in even])
    return Named(_told(named, rms, math.sqrt(best / _squares(now.left))), named[0].repair, even[0].fitted)


def _heard(rivals: Sequence[_Rival]) -> list[_Rival]:
    """Without those of a size that instruments seldom have, where a unit of the channels or nearly any explains."""
    first = min((one.left for one in rivals if not one.suspect.last), default=math.inf)
    units = {name for one in rivals if one.suspect.key == "unit" for name in one.suspect.channels}
    return [one for one in rivals if not one.suspect.last
            or (one.left < _DECISIVE * first and not units & set(one.suspect.channels))]  # fmt: skip


def _gross(trials: Sequence[Trial]) -> Iterator[_Rival]:
    """Signs, axes and units that explain nearly all of it, judged by some rows of the trials that turn most."""
    thin = [_thinned(trial) for trial in _turning_most(trials)]
    before = left_over(thin, causes=False)
    for suspect in gross(trials) if before is not None else ():
        after = left_over([suspect.repair(trial) for trial in thin], causes=False)
        if before and after and _rms(after.left) ** 2 < _GROSS * _rms(before.left) ** 2:
            yield _Rival(_squares(after.left), suspect, partial(_itself, suspect), {})


def _itself(suspect: Suspect) -> Suspect:
    return suspect


def _told(even: Sequence[Suspect], rms: float, part: float) -> Fault:
    first = even[0]
    names = list(dict.fromkeys(name for one in even for name in one.channels))
    what = " or ".join(dict.fromkeys(one.what for one in even))
    rest = [said for said in dict.fromkeys(str(one.remedy) for one in even[1:]) if said != str(first.remedy)]
    remedy = replace(first.remedy, text="; or ".join(filter(None, [first.remedy.text, *rest])))
    about = [one.evidence for one in even if one.evidence]
    about.append(f"track, heading, rates and speeds differ by {rms:.3g} times their noise, by {rms * part:.2g} after")
    return Fault("error" if first.grave else "warning", ", ".join(names), what, "; ".join(about), remedy,
                 first.kind, first.key)  # fmt: skip


def _astray(now: Window) -> bool:
    """Whether what is left over is a large part of what was moved."""
    track, turn = (_rms(now.left[:, part]) / max(_rms(now.moved[:, part]), 1e-9) for part in (slice(0, 2), slice(2, 3)))
    return track > _ASTRAY or turn > _TURNED


def _gross_misfit(trials: Sequence[Trial], left: Sequence[Window | None]) -> bool:
    """Whether positions do not follow the velocities at all."""
    lost = (trial for trial, one in zip(trials, left, strict=True) if one and _rms(one.left) > _LOST)
    return any(has(trial, "x", "y", "u", "psi") for trial in lost)


def _unexplained(rms: float) -> Fault:
    return Fault("warning", "x, y, psi, u, v_m, r", "track, heading, rates and speeds do not fit together",
                 f"they differ by {rms:.3g} times their noise, and no single cause explains it",
                 "check axes, reference point and time of the sensors", "quality", "inconsistent")  # fmt: skip


def _turning_most(trials: Sequence[Trial]) -> list[Trial]:
    """The few trials whose heading changes most."""

    def turned(trial: Trial) -> float:
        return -float(np.nanmax(trial["psi"]) - np.nanmin(trial["psi"])) if has(trial, "psi") else 0.0

    return sorted(trials, key=turned)[:_TRIALS]


def _thinned(trial: Trial) -> Trial:
    """Few rows a window and few windows, which is enough for signs, axes and units."""
    every = max(int(window_of(trial) / (_ROWS * trial.dt)), 1)
    return trial.rows(slice(0, _WINDOWS * _ROWS * every, every))


def _rms(left: Array) -> float:
    good = left[np.isfinite(left)]
    return float(np.sqrt(np.mean(good**2))) if good.size else 0.0


def _squares(left: Array) -> float:
    good = left[np.isfinite(left)]
    return float(good @ good) / max(good.size, 1) + 0.05


# -- suspects whose size is fitted


@dataclass(frozen=True)
class Normal:
    """Normal equations of what is left over by all causes, of windows where a channel does not lack."""

    names: list[str]
    H: Array
    g: Array
    square: float
    count: int

    @staticmethod
    def of(now: Window) -> Normal:
        left = now.left.ravel()
        matrix = np.column_stack([one.ravel() for one in now.columns.values()])
        good = np.isfinite(left) & np.isfinite(matrix).all(axis=1)
        left, matrix = left[good], matrix[good]
        return Normal([*now.columns], matrix.T @ matrix, matrix.T @ left, float(left @ left), left.size)

    def fit(self, columns: Sequence[str]) -> tuple[list[float], list[float], float] | None:
        """Sizes of some causes, their standard errors with what is left as noise, and the rms that is left."""
        at = [self.names.index(name) for name in columns]
        normal, g = self.H[np.ix_(at, at)], self.g[at]
        power = np.diag(normal)
        if self.count < 20 or not (power > 0).all():
            return None
        if len(at) > 1 and np.linalg.cond(normal / np.sqrt(np.outer(power, power))) > 1e6:
            return None
        back = np.linalg.inv(normal)
        sizes = back @ g
        rms = math.sqrt(max(self.square - float(sizes @ g), 0.0) / self.count)
        # windows overlap by three quarters
        errors = np.sqrt(np.diag(back) * 4.0) * max(rms, 0.5)
        return sizes.tolist(), errors.tolist(), rms


def _fine(trials: Sequence[Trial], now: Window) -> Iterator[_Rival]:
    normal, squares, power = Normal.of(now), _squares(now.left), _rms(now.left) ** 2
    for columns, make in FITTED:
        fitted = normal.fit(columns)
        if fitted is None:
            continue
        sizes, errors, rms = fitted
        scale = columns[0].endswith("_scale")
        if scale:  # what is left over is counted in what was shown, not in what was true
            if sizes[0] > 0.98:
                continue
            sizes, errors = [sizes[0] / (1.0 - sizes[0])], [errors[0] / (1.0 - sizes[0]) ** 2]
        sure = max(abs(size) / error for size, error in zip(sizes, errors, strict=True))
        if sure < _SURE or power - rms**2 < _SHARE * (power - 1.0):
            continue
        suspect = make(trials, sizes, errors)
        if suspect is None:
            continue
        left = min(rms**2 + 0.05 + 0.01 * (len(columns) - 1) * squares, squares)
        exact = scale or not any(sizes)
        refined = partial(_refined, trials, columns, make, sizes, errors, suspect)
        yield _Rival(left, suspect, partial(_itself, suspect) if exact else refined,
                     {} if scale else dict(zip(columns, sizes, strict=True)))  # fmt: skip


def _refined(
    trials: Sequence[Trial], columns: Sequence[str], make: Make, sizes: list[float], errors: list[float],
    suspect: Suspect,
) -> Suspect:  # fmt: skip
    """The suspect with its size from the repaired logs: large faults are not linear."""
    after = left_over([suspect.repair(trial) for trial in trials])
    more = None if after is None else Normal.of(after).fit(columns)
    if more is None:
        return suspect
    return make(trials, [a + b for a, b in zip(sizes, more[0], strict=True)], errors) or suspect


def _third_witness(trials: Sequence[Trial], even: list[Suspect]) -> list[Suspect]:
    """Decide between suspects that explain the same, where something else in the logs can."""
    points = [one for one in even if one.key == "lever_arm"]
    if len(points) == 2 and even[0].key == "lever_arm":
        # a turning ship pivots a quarter to half its length ahead of midship, where there is no sway
        pivots = [pivot for trial in trials if (pivot := _pivot(trial)) is not None]
        inside = not pivots or 0.1 < float(np.median(pivots)) / length(trials) < 0.8
        return [one for one in points if ("x" in one.channels) == inside]
    if even[0].key == "log_scale":
        return even[:1]
    return even


def _pivot(trial: Trial) -> float | None:
    """Distance of the point without sway ahead of midship in turns [m]."""
    if not has(trial, "r", "v_m"):
        return None
    r, v = trial["r"], trial["v_m"]
    hard = np.isfinite(r) & np.isfinite(v)
    hard &= np.abs(r) > 0.5 * float(np.nanmax(np.abs(r)))
    return float(-(v[hard] @ r[hard]) / (r[hard] @ r[hard])) if hard.sum() > 20 else None
